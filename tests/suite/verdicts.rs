//! The stability of static stages under following loads against closed forms and Hermite elements.

use super::random::Random;
use super::scenes::simulate;
use beamsim_core::run::{StabilityVerdict, StageStability};
use nalgebra::DMatrix;
use std::path::Path;

/// A column of length, stiffness and mass one along x; `rest`: supports, loads, other tables.
fn column(mass: f64, rest: &str) -> String {
    format!(
        "[point]\nfoot = [0, 0, 0]\ntop = [1, 0, 0]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 10\nEI = [100, 1]\nrhoA = {mass}\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"foot\", \"top\"]\nelements = 8\norder = 3\n{rest}\
         [[stage]]\nkind = \"static\"\nsteps = 2\n"
    )
}

const CLAMPED: &str = "[[support]]\nat = \"foot\"\nfix = \"all\"\n";
const PINNED: &str = "[[support]]\nat = \"foot\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"ry\"]\n\
                      [[support]]\nat = \"top\"\nfix = [\"uy\", \"uz\", \"rx\", \"ry\"]\n";

fn tip(load: f64, frame: &str) -> String {
    format!("[[load]]\nat = \"top\"\nforce = [{}, 0, 0]\nframe = \"{frame}\"\n", -load)
}

fn line(load: f64) -> String {
    format!("[[load]]\nalong = \"b\"\nforce = [{}, 0, 0]\nframe = \"section\"\n", -load)
}

fn end(deck: &str) -> StageStability {
    *simulate(deck).counters.findings.stability.last().unwrap()
}

fn verdict(deck: &str) -> StabilityVerdict {
    end(deck).verdict
}

/// Just below and just above a critical load.
fn turns_unstable_at(critical: f64, deck: impl Fn(f64) -> String) {
    assert_eq!(verdict(&deck(0.99 * critical)), StabilityVerdict::Stable, "below {critical}");
    assert_eq!(verdict(&deck(1.01 * critical)), StabilityVerdict::Unstable, "above {critical}");
}

/// Beck 1952 (doi:10.1007/BF02008828), with a force that follows the tip: two frequencies meet.
#[test]
fn becks_column_flutters() {
    turns_unstable_at(20.0510, |load| column(1.0, &(CLAMPED.to_string() + &tip(load, "body"))));
    // No pivot tells, and nobody knows with other masses.
    let above = end(&column(1.0, &(CLAMPED.to_string() + &tip(20.3, "body"))));
    assert_eq!(above.negative, None);
    for load in [10.0, 30.0] {
        let massless = column(0.0, &(CLAMPED.to_string() + &tip(load, "body")));
        assert_eq!(verdict(&massless), StabilityVerdict::Unknown);
    }
}

/// Leipholz 1962, under a line load that follows: 40.05 EI/L^3 (40.7 by two terms of Galerkin's series).
#[test]
fn leipholz_column_flutters() {
    turns_unstable_at(40.05, |load| column(1.0, &(CLAMPED.to_string() + &line(load))));
}

/// Pflueger 1950: with both ends on hinges the line load that follows makes it diverge at 18.956 EI/L^3, whatever the masses.
#[test]
fn pfluegers_column_diverges() {
    turns_unstable_at(18.956, |load| column(1.0, &(PINNED.to_string() + &line(load))));
    let massless = |load: f64| verdict(&column(0.0, &(PINNED.to_string() + &line(load))));
    assert_eq!([18.7, 19.2].map(massless), [StabilityVerdict::Unknown, StabilityVerdict::Unstable]);
}

/// Nicolai's paradox (Bolotin 1963, 3): a rod of equal stiffness flutters under any torque about a fixed axis, one of unequal stiffness
/// does not.
#[test]
fn round_rods_flutter_under_a_torque() {
    let rod = |stiffness: &str| {
        let torque = "[[load]]\nat = \"top\"\nmoment = [0.2, 0, 0]\n";
        column(1.0, &(CLAMPED.to_string() + torque)).replace("[100, 1]", stiffness)
    };
    assert_eq!(verdict(&rod("[1, 1]")), StabilityVerdict::Unstable);
    assert_eq!(verdict(&rod("[2, 1]")), StabilityVerdict::Stable);
}

#[test]
fn dampers_of_the_scene_take_part() {
    let deck = |name: &str| std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
    let found = ["below", "above"].map(|side| verdict(&deck(&format!("decks/modes/beck_column_damped_{side}.toml"))));
    assert_eq!(found, [StabilityVerdict::Stable, StabilityVerdict::Unstable]);
}

/// Loads on a column in one plane.
struct Loads {
    /// At the top, fixed in space
    dead: f64,
    /// At the top, following
    following: f64,
    /// Along the column, following
    line: f64,
    /// A spring that holds the top aside
    spring: f64,
    /// At the top
    body: f64,
}

impl Loads {
    fn times(&self, factor: f64) -> Self {
        Self { dead: factor * self.dead, following: factor * self.following, line: factor * self.line, ..*self }
    }
}

/// Whether small vibrations of a column without shear and compression grow. `pinned`: on hinges, else clamped at its foot.
///
/// ```text
/// K = EI/l^3 [12 6l -12 6l; …] - int N w' dw' + P_f w'(L) dw(L) + int q w' dw,   N = P_d + P_f + q (L - x)
/// ```
fn grows(loads: &Loads, pinned: bool) -> bool {
    const ELEMENTS: usize = 16;
    let size = 2 * ELEMENTS + 2;
    let l = 1.0 / ELEMENTS as f64;
    let (mut stiffness, mut mass) = (DMatrix::<f64>::zeros(size, size), DMatrix::<f64>::zeros(size, size));
    let bent = [
        [12.0, 6.0 * l, -12.0, 6.0 * l],
        [6.0 * l, 4.0 * l * l, -6.0 * l, 2.0 * l * l],
        [-12.0, -6.0 * l, 12.0, -6.0 * l],
        [6.0 * l, 2.0 * l * l, -6.0 * l, 4.0 * l * l],
    ]
    .map(|row| row.map(|entry| entry / (l * l * l)));
    // Gauss's rule of four points on [0, 1].
    let gauss = [
        (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
        (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
        (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
        (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
    ];
    for element in 0..ELEMENTS {
        let first = 2 * element;
        for (s, weight) in gauss {
            let x = (element as f64 + s) * l;
            let shape = [
                1.0 - 3.0 * s * s + 2.0 * s * s * s,
                l * (s - 2.0 * s * s + s * s * s),
                3.0 * s * s - 2.0 * s * s * s,
                l * (s * s * s - s * s),
            ];
            let slope = [
                (6.0 * s * s - 6.0 * s) / l,
                1.0 - 4.0 * s + 3.0 * s * s,
                (6.0 * s - 6.0 * s * s) / l,
                3.0 * s * s - 2.0 * s,
            ];
            let pressure = loads.dead + loads.following + loads.line * (1.0 - x);
            for i in 0..4 {
                for j in 0..4 {
                    let turned = loads.line * shape[i] * slope[j] - pressure * slope[i] * slope[j];
                    stiffness[(first + i, first + j)] += weight * l * turned;
                    mass[(first + i, first + j)] += weight * l * shape[i] * shape[j];
                }
            }
        }
        for i in 0..4 {
            for j in 0..4 {
                stiffness[(first + i, first + j)] += bent[i][j];
            }
        }
    }
    stiffness[(size - 2, size - 1)] += loads.following;
    stiffness[(size - 2, size - 2)] += loads.spring;
    mass[(size - 2, size - 2)] += loads.body;
    let held: &[usize] = if pinned { &[0, size - 2] } else { &[0, 1] };
    let free: Vec<usize> = (0..size).filter(|k| !held.contains(k)).collect();
    let of_free = |matrix: &DMatrix<f64>| matrix.select_rows(&free).select_columns(&free);
    let squares = (of_free(&mass).try_inverse().unwrap() * of_free(&stiffness)).complex_eigenvalues();
    squares.iter().any(|square| square.re < 0.0 || square.im.abs() > 1e-6 * square.norm())
}

/// Columns under dead and following loads, springs and bodies at their tops: at loads that are not next to a critical one.
#[test]
fn random_columns_end_as_hermite_elements_say() {
    let mut random = Random::new(20_510);
    let (mut judged, mut unstable) = (0, 0);
    for _ in 0..80 {
        let pinned = random.range(0.0, 1.0) < 0.3;
        let mut some = |largest: f64| if random.range(0.0, 1.0) < 0.6 { random.range(0.0, largest) } else { 0.0 };
        let (dead, following, along) = (some(8.0), some(30.0), some(50.0));
        let (spring, body) = if pinned { (0.0, 0.0) } else { (some(60.0), some(1.0)) };
        let loads = Loads { dead, following, line: along, spring, body };
        let [below, here, above] = [0.97, 1.0, 1.03].map(|factor| grows(&loads.times(factor), pinned));
        if (following == 0.0 && along == 0.0) || below != here || above != here {
            continue;
        }
        let mut rest = if pinned { PINNED } else { CLAMPED }.to_string();
        for (size, table) in [(dead, tip(dead, "space")), (following, tip(following, "body")), (along, line(along))] {
            rest += if size > 0.0 { &table } else { "" };
        }
        if spring > 0.0 {
            rest += &format!("[[spring]]\nat = \"top\"\nstiffness = [0, {spring}, 0, 0, 0, 0]\n");
        }
        if body > 0.0 {
            rest += &format!("[[body]]\nat = \"top\"\nmass = {body}\n");
        }
        let expected = if here { StabilityVerdict::Unstable } else { StabilityVerdict::Stable };
        assert_eq!(verdict(&column(1.0, &rest)), expected, "{rest}");
        judged += 1;
        unstable += usize::from(here);
    }
    assert!(judged > 40 && unstable > 10 && judged - unstable > 10, "{judged} judged, {unstable} unstable");
}

/// A rotor on springs (Jeffcott): above its critical speed, 10, Coriolis forces hold it; on unequal springs it grows between the
/// two critical speeds, 8 and 10, where one pivot is negative.
#[test]
fn rotors_are_held_above_their_critical_speed() {
    let rotor = |soft: f64, spin: f64| {
        format!(
            "[point]\np = [0, 0, 0]\n[[body]]\nat = \"p\"\nmass = 1\ninertia = [1, 1, 1.5]\n[[spring]]\nat = \"p\"\n\
             stiffness = [{soft}, 100, 100, 1e4, 1e4, 1e4]\n[[stage]]\nkind = \"static\"\nsteps = 4\n\
             frame = {{ spin = [0, 0, {spin}], about = \"p\" }}\n"
        )
    };
    assert_eq!(verdict(&rotor(100.0, 9.0)), StabilityVerdict::Stable);
    assert_eq!(verdict(&rotor(100.0, 15.0)), StabilityVerdict::Stable);
    assert_eq!(verdict(&rotor(64.0, 7.0)), StabilityVerdict::Stable);
    assert_eq!(verdict(&rotor(64.0, 9.0)), StabilityVerdict::Unstable);
    assert_eq!(verdict(&rotor(64.0, 15.0)), StabilityVerdict::Stable);
    // The point at which the pivots change is told in words that agree.
    for (soft, spin, told) in
        [(100.0, 15.0, "2 negative pivots after it, against which"), (64.0, 9.0, "unstable after it, 1 ")]
    {
        let findings = simulate(&rotor(soft, spin)).counters.findings;
        assert!(findings.events.iter().any(|event| event.to_string().contains(told)), "{:?}", findings.events);
    }
}
