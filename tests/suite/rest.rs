//! States of rest that no load level leads to: of what only its loads hold, and of what is laid loosely.

use crate::random::Random;
use crate::scenes::{attempt, modes, simulate};
use beamsim_core::rotation::Rotation;
use beamsim_core::run::StabilityVerdict;
use beamsim_core::tensor::{Mat3, Vec3};
use beamsim_core::warning::WarningKind;
use std::f64::consts::PI;

/// Links of one length and weight between ball joints, hung between two points; in the vertical plane x, z.
struct Chain {
    links: usize,
    length: f64,
    weight: f64,
    stiffness: f64,
    span: f64,
    rise: f64,
}

impl Chain {
    fn random(random: &mut Random) -> Self {
        let (links, unit) = (random.range(2.0, 9.0) as usize, 10_f64.powf(random.range(-3.0, 3.0)));
        let (length, weight) = (unit * random.range(0.3, 2.0), 10_f64.powf(random.range(-2.0, 4.0)));
        let whole = links as f64 * length;
        let span = whole * random.range(0.4, 0.9);
        let rise = random.range(-0.3, 0.3) * (whole * whole - span * span).sqrt();
        Self { links, length, weight, stiffness: 1e6 * weight, span, rise }
    }

    /// The places of the joints on a circle through both ends, below the line between them.
    fn circle(&self) -> Vec<[f64; 2]> {
        let (distance, lean) = (self.span.hypot(self.rise), self.rise.atan2(self.span));
        let angle = |opening: f64, link: usize| opening * ((2 * link + 1) as f64 / self.links as f64 - 1.0);
        let reach = |opening: f64| (0..self.links).map(|k| self.length * angle(opening, k).cos()).sum::<f64>();
        let (mut low, mut high) = (0.0, PI);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if reach(middle) > distance { low = middle } else { high = middle }
        }
        let mut places = vec![[0.0; 2]];
        for link in 0..self.links {
            let [x, z] = places[link];
            let angle = lean + angle(low, link);
            places.push([x + self.length * angle.cos(), z + self.length * angle.sin()]);
        }
        places
    }

    /// What the horizontal and vertical force of the first support leave of the span and the rise: a link points along the force in its
    /// middle.
    fn gap(&self, [h, v]: [f64; 2]) -> [f64; 2] {
        let mut end = [0.0; 2];
        for link in 0..self.links {
            let v = v - (link as f64 + 0.5) * self.weight;
            let tension = h.hypot(v);
            let length = self.length * (1.0 + tension / self.stiffness);
            end = [end[0] + length * h / tension, end[1] - length * v / tension];
        }
        [end[0] - self.span, end[1] - self.rise]
    }

    /// The force of the first support, by Newton's method on the gap.
    fn exact(&self) -> [f64; 2] {
        let whole = self.links as f64 * self.weight;
        let mut force = [0.5 * whole, 0.5 * whole];
        for _ in 0..200 {
            let (gap, step) = (self.gap(force), 1e-6 * whole);
            let [a, b] = [[step, 0.0], [0.0, step]].map(|d| {
                let moved = self.gap([force[0] + d[0], force[1] + d[1]]);
                [(moved[0] - gap[0]) / step, (moved[1] - gap[1]) / step]
            });
            let determinant = a[0] * b[1] - a[1] * b[0];
            let correction =
                [(b[1] * gap[0] - b[0] * gap[1]) / determinant, (a[0] * gap[1] - a[1] * gap[0]) / determinant];
            let size = correction[0].hypot(correction[1]);
            let part = (0.3 * force[0].abs() / size).min(1.0);
            force = [force[0] - part * correction[0], force[1] - part * correction[1]];
        }
        force
    }

    /// In a frame of its own; it begins in a plane that leans by an angle, and its joints are said from the first on or from the last.
    fn deck(&self, frame: Mat3, leaning: f64, backwards: bool, levels: usize) -> String {
        let chord = Vec3([self.span, 0.0, self.rise]).normalized().expect("a span");
        let leans = Rotation::new(chord * leaning).r;
        let place = |[x, z]: [f64; 2]| text(frame * (leans * Vec3([x, 0.0, z])));
        let points = self.circle().into_iter().enumerate().map(|(k, at)| format!("p{k} = {}\n", place(at)));
        let ea = self.stiffness;
        let turning = ea * self.length * self.length / 100.0;
        let beam = |k: usize| {
            format!(
                "[[beam]]\nname = \"l{k}\"\nsection = \"s\"\nthrough = [\"p{k}\", \"p{}\"]\nelements = 1\norder = 2\n",
                k + 1
            )
        };
        let joint =
            |k: usize| format!("[[joint]]\nkind = \"spherical\"\nat = \"p{k}\"\nbeams = [\"l{}\", \"l{k}\"]\n", k - 1);
        let mut joints: Vec<String> = (1..self.links).map(joint).collect();
        if backwards {
            joints.reverse();
        }
        format!(
            "gravity = {}\n[point]\n{}[section.s]\nEA = {ea:e}\nGA = {ea:e}\nGJ = {turning:e}\nEI = {turning:e}\nrhoA = {:e}\n{}{}\
             [[support]]\nat = \"p0\"\nfix = \"pin\"\n[[support]]\nat = \"p{}\"\nfix = \"pin\"\n\
             [[stage]]\nkind = \"static\"\nsteps = {levels}\n[output]\nnodes = [\"p0\"]\ncolumns = [\"reaction\"]\n",
            text(frame * Vec3([0.0, 0.0, -9.81])),
            points.collect::<String>(),
            self.weight / 9.81 / self.length,
            (0..self.links).map(beam).collect::<String>(),
            joints.concat(),
            self.links,
        )
    }
}

fn text(v: Vec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.0[0], v.0[1], v.0[2])
}

#[test]
fn chains_come_to_rest_in_any_units_orientation_and_order() {
    let mut random = Random::new(34);
    for number in 0..24 {
        let chain = Chain::random(&mut random);
        let frame = Rotation::new(random.vector(random_angle(number))).r;
        let leaning = if number % 3 == 0 { 0.0 } else { random.range(-1.0, 1.0) };
        let levels = [1, 4][number % 2];
        let deck = chain.deck(frame, leaning, number % 4 < 2, levels);
        let simulation = simulate(&deck);
        let [h, v] = chain.exact();
        let exact = frame * Vec3([-h, 0.0, v]);
        let found = Vec3(simulation.vector("p0.f"));
        let off = (found - exact).norm() / exact.norm();
        assert!(off < 1e-4, "{number}: off by {off:.1e}\n{deck}");
        let findings = &simulation.counters.findings;
        assert!(findings.warnings.iter().any(|w| w.kind == WarningKind::CameToRest), "{number}: untold");
        assert_eq!(findings.stability[0].verdict, StabilityVerdict::Stable, "{number}\n{deck}");
    }
}

fn random_angle(number: usize) -> f64 {
    if number.is_multiple_of(4) { 0.0 } else { 0.7 * number as f64 }
}

/// A bar on a hinge that its load turns by a quarter turn: it then lies along the load.
#[test]
fn a_hinged_bar_turns_into_its_load() {
    for (levels, order) in [(1, 1), (5, 2)] {
        let simulation = simulate(&format!(
            "[point]\na = [0, 0, 0]\nb = [2, 0, 0]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 1e3\nEI = 1e3\n\
             [[beam]]\nname = \"bar\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 3\norder = {order}\n\
             [[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"ry\"]\n[[load]]\nat = \"b\"\nforce = [0, 5, 0]\n\
             [[stage]]\nkind = \"static\"\nsteps = {levels}\n[output]\nnodes = [\"b\"]\ncolumns = [\"u\", \"energy\"]\n"
        ));
        let [x, y, z] = simulation.vector("b.u");
        assert!((x + 2.0).abs() < 1e-8 && (y - 2.00001).abs() < 1e-8 && z == 0.0, "{x} {y} {z}");
        // What the load did beyond stretching the bar, the artificial resistance has taken.
        let [work, damped, total] =
            ["external", "damped", "total"].map(|part| simulation.end(&format!("energy.{part}")));
        // It turns at the first level; the load grows on the way.
        let fall = 5.0 * 2.0 / f64::from(levels);
        assert!(
            (0.9..1.01).contains(&(work / fall)) && damped > 0.9 * work && total.abs() < 1e-9,
            "{work} {damped} {total}"
        );
    }
}

/// A spin about the own axis is held as long as no moment feels it.
#[test]
fn a_spin_that_no_load_feels_is_held() {
    let deck = |moment: &str| {
        format!(
            "gravity = [0, 0, -9.81]\n[point]\na = [0, 0, 0]\nb = [2, 1, 0]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 1e3\nEI = 1e3\nrhoA = 1\n\
             [[beam]]\nname = \"rod\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\n\
             [[support]]\nat = \"a\"\nfix = \"pin\"\n[[support]]\nat = \"b\"\nfix = \"pin\"\n{moment}\
             [[stage]]\nkind = \"static\"\nsteps = 2\n[output]\nnodes = [\"b\", \"rod@0.5\"]\ncolumns = [\"r\", \"reaction\"]\n"
        )
    };
    let simulation = simulate(&deck(""));
    let [rx, ry, _] = simulation.vector("b.r");
    assert!((2.0 * rx + ry).abs() < 1e-6, "it spins by {}", 2.0 * rx + ry);
    assert!((simulation.end("b.fz") - 0.5 * 9.81 * 5_f64.sqrt()).abs() < 1e-6);
    let turned = attempt(&deck("[[load]]\nat = \"b\"\nmoment = [2, 1, 0]\n"));
    assert_eq!(turned.result.expect_err("a moment turns it").name(), "singular");
}

/// Loads that hold a structure against all motions but one do not hold it.
#[test]
fn what_no_load_holds_either_is_still_a_mechanism() {
    let mut random = Random::new(7);
    for number in 0..8 {
        let frame = Rotation::new(random.vector(2.0)).r;
        let places = [Vec3::ZERO, Vec3([1.0, 0.0, -1.0]), Vec3([1.0, random.range(0.2, 1.0), -0.7])];
        let [a, b, c] = places.map(|place| text(frame * place));
        let deck = format!(
            "gravity = {}\n[point]\na = {a}\nb = {b}\nc = {c}\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 1e4\nEI = 1e4\nrhoA = 2\n\
             [[beam]]\nname = \"arm\"\nsection = \"s\"\nthrough = [\"a\", \"b\", \"c\"]\nelements = 2\norder = 2\n\
             [[support]]\nat = \"a\"\nfix = \"pin\"\n[[stage]]\nkind = \"static\"\nsteps = 2\n",
            text(frame * Vec3([0.0, 0.0, -9.81]))
        );
        let failure = attempt(&deck).result.expect_err("it may turn about the vertical");
        assert_eq!(failure.name(), "singular", "{number}: {failure}\n{deck}");
    }
}

/// A rod of unequal bending stiffness rolls over to the soft side as it sags: its weight feels the spin.
#[test]
fn a_flat_rod_rolls_over_to_its_soft_side() {
    let simulation = simulate(
        "gravity = [0, 0, -9.81]\n[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1\nEI = [100, 1]\nrhoA = 0.03\n\
         [[beam]]\nname = \"rod\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\naxis3 = [0, 0.1, 1]\nelements = 8\norder = 2\n\
         [[support]]\nat = \"a\"\nfix = \"pin\"\n[[support]]\nat = \"b\"\nfix = [\"uy\", \"uz\"]\n\
         [[stage]]\nkind = \"static\"\nsteps = 2\n[output]\nnodes = [\"rod@0.5\"]\ncolumns = [\"u\"]\n",
    );
    let sag = -5.0 / 384.0 * 9.81 * 0.03;
    assert!((simulation.end("rod@0.5.uz") / sag - 1.0).abs() < 0.01, "{} for {sag}", simulation.end("rod@0.5.uz"));
}

/// A rod without rotary inertia flies, and is clamped in the stage after: its spin is held where nothing else does.
#[test]
fn a_spin_is_held_until_something_else_holds_it() {
    for later in [
        "[[support]]\nat = \"a\"\nfix = \"all\"\nstages = [2]\n",
        "[[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"rx\"]\nstages = [2]\n",
        "[[spring]]\nat = \"a\"\nstiffness = [10, 10, 10, 1, 1, 1]\nstages = [2]\n",
        "[[motion]]\nat = \"b\"\nrotate = [1, 0, 0]\nangle = 0\nstages = [2]\n",
    ] {
        let run = simulate(&format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 1e3\nEI = 200\nrhoA = 2\n\
             [[beam]]\nname = \"rod\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\n\
             [[initial]]\nvelocity = [0, 1, 0]\n{later}[output]\nnodes = [\"b\"]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 0.01\nstep = 0.001\n\
             [[stage]]\nkind = \"dynamic\"\nend = 0.02\nstep = 0.001\n"
        ));
        let flown = run.column("b.uy")[10];
        assert!((flown - 0.01).abs() < 1e-12, "{later}: {flown}");
    }
}

/// The rotation of a point mass means nothing, also where a support held it in the stage before.
#[test]
fn a_point_mass_may_be_let_go_with_its_rotation() {
    for fix in ["\"all\"", "[\"ux\", \"uy\", \"rx\", \"ry\", \"rz\"]", "[\"ux\", \"rz\"]"] {
        let run = simulate(&format!(
            "gravity = [0, 0, -10]\n[point]\nm = [0, 0, 0]\n[[body]]\nat = \"m\"\nmass = 2\n\
             [[support]]\nat = \"m\"\naxes = [[0.6, 0.8, 0], [-0.8, 0.6, 0]]\nfix = {fix}\nstages = [1]\n\
             [output]\nnodes = [\"m\"]\n[[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.01\n\
             [[stage]]\nkind = \"dynamic\"\nend = 1.1\nstep = 0.01\n"
        ));
        let fallen = -run.end("m.uz");
        let exact = if fix == "\"all\"" { 5.0 } else { 5.0 * 1.1 * 1.1 };
        assert!((fallen / exact - 1.0).abs() < 1e-9, "{fix}: {fallen} for {exact}");
    }
}

/// A damper of the spin acts in the stage after with all of its rate.
#[test]
fn a_spin_that_is_held_in_one_stage_is_damped_in_the_next() {
    for scheme in ["newmark", "generalized_alpha", "lobatto"] {
        let run = simulate(&format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 1e3\nEI = 200\nrhoA = 2\n\
             [[beam]]\nname = \"rod\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\n\
             [[spring]]\nat = \"a\"\nstiffness = [10, 10, 10, 0, 0, 0]\ndamping = [0, 0, 0, 0.5, 0.5, 0.5]\nstages = [2]\n\
             [[load]]\nat = \"a\"\nmoment = [0.05, 0, 0]\nstages = [2]\n[output]\nnodes = [\"a\"]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 0.01\nstep = 0.001\nscheme = \"{scheme}\"\n\
             [[stage]]\nkind = \"dynamic\"\nend = 0.05\nstep = 0.001\nscheme = \"{scheme}\"\n"
        ));
        // Moment over damping, after the first step.
        let turned = run.end("a.rx") / (0.04 * 0.1);
        assert!((turned - 1.0).abs() < 0.03, "{scheme}: {turned}");
    }
}

/// What statics holds may spin in time, where it has inertia, before and after.
#[test]
fn a_spin_that_statics_holds_goes_on_in_time() {
    let rod = "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 10\nEI = 10\nrhoA = 1\nrhoJ = [0.02, 0.01, 0.01]\n\
         [[beam]]\nname = \"rod\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 2\n\
         [[support]]\nat = \"a\"\nfix = \"pin\"\n[[support]]\nat = \"b\"\nfix = \"pin\"\n[[initial]]\nbeam = \"rod\"\nspin = [1, 0, 0]\n\
         [output]\nnodes = [\"b\"]\ncolumns = [\"rc\"]\n";
    let still = "[[stage]]\nkind = \"static\"\nsteps = 1\n";
    let turns = "[[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.05\n";
    for stages in [format!("{turns}{still}"), format!("{still}{turns}")] {
        let turned = simulate(&format!("{rod}{stages}")).end("b.rx");
        assert!((turned - 1.0).abs() < 1e-6, "{stages}: {turned}");
    }
}

/// Modes of a chain at rest: its links spin about their own axes without any force, and swing.
#[test]
fn a_chain_at_rest_swings_and_its_spins_are_exact_zeros() {
    let mut random = Random::new(5);
    let chain = Chain { links: 6, length: 1.0, weight: 10.0, stiffness: 1e6, span: 3.5, rise: 0.6 };
    let frame = Rotation::new(random.vector(1.0)).r;
    let with_inertia = |inertia: &str| {
        let deck = chain
            .deck(frame, 0.3, false, 1)
            .replace("[[beam]]\nname = \"l0\"", &format!("{inertia}[[beam]]\nname = \"l0\""));
        let deck = deck.replace("[output]", "[[stage]]\nkind = \"modal\"\nmodes = 10\n[output]");
        modes(&deck)
    };
    let (spinning, plain) = (with_inertia("rhoJ = [2e-3, 1e-3, 1e-3]\n"), with_inertia(""));
    assert!(spinning[..6].iter().all(|mode| mode.size() == 0.0), "{spinning:?}");
    for (with, without) in spinning[6..10].iter().zip(&plain) {
        assert!(with.growth == 0.0 && (with.omega / without.omega - 1.0).abs() < 0.02, "{spinning:?} {plain:?}");
    }
}
