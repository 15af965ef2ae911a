//! Modes against closed forms.

use crate::random::Random;
use crate::scenes::{attempt, list, modes};
use beamsim_core::run::Mode;
use beamsim_core::tensor::Vec3;
use beamsim_core::warning::WarningKind;
use nalgebra::{Complex, DMatrix};

/// A body on a hinge with a spring and a damper, in a frame that turns about an axis beside the hinge.
struct Hinged {
    mass: f64,
    inertia: f64,
    arm: f64,
    stiffness: f64,
    damping: f64,
    /// The distance of the hinge from the axis of the frame, and the spin of the frame
    frame: [f64; 2],
}

impl Hinged {
    fn random(random: &mut Random, damping: f64, spin: f64) -> Self {
        let [mass, inertia, stiffness] = [0, 1, 2].map(|_| 10f64.powf(random.range(-1.0, 1.0)));
        // Damping that is small in these units is no small damping.
        let [length, weight] = [random.range(-8.0, 3.0), random.range(-20.0, 3.0)].map(|power| 10f64.powf(power));
        let arm = random.range(0.1, 2.0) * length;
        let [mass, inertia, stiffness] =
            [mass * weight, inertia * weight * length.powi(2), stiffness * weight * length.powi(2)];
        let about_hinge = inertia + mass * arm * arm;
        let damping = damping * 2.0 * (stiffness * about_hinge).sqrt();
        Self { mass, inertia, arm, stiffness, damping, frame: [random.range(0.2, 1.0) * length, spin] }
    }

    /// s = growth + i omega
    fn exact(&self) -> [f64; 2] {
        let Self { mass, inertia, arm, stiffness, damping, frame: [aside, spin] } = *self;
        let about_hinge = inertia + mass * arm * arm;
        let growth = -damping / (2.0 * about_hinge);
        let squared = (stiffness + mass * arm * aside * spin * spin) / about_hinge;
        [growth, (squared - growth * growth).sqrt()]
    }

    fn deck(&self, axis: Vec3, outward: Vec3) -> String {
        let Self { mass, inertia, arm, stiffness, damping, frame: [aside, spin] } = *self;
        let frame = format!("frame = {{ spin = {} }}", list(axis * spin));
        format!(
            "[point]\np = {}\n[[body]]\nat = \"p\"\nmass = {mass}\ninertia = [{inertia}, {inertia}, {inertia}]\n\
             [[joint]]\nkind = \"revolute\"\nnodes = [\"p\"]\nat = {}\naxis = {}\nstiffness = {stiffness}\n\
             damping = {damping}\n[[stage]]\nkind = \"static\"\nsteps = 2\n{frame}\n[[stage]]\nkind = \"modal\"\n\
             modes = 1\n{frame}\n",
            list(outward * (aside + arm)),
            list(outward * aside),
            list(axis)
        )
    }
}

/// Multipliers hold the body to its hinge.
#[test]
fn bodies_on_hinges_swing_as_closed_forms_say() {
    let mut random = Random::new(41);
    for case in 0..60 {
        let damping = [0.0, random.range(0.001, 0.5)][case % 2];
        let spin = [0.0, 0.0, 0.0, 10f64.powf(random.range(-9.0, 0.5))][case / 2 % 4];
        let hinged = Hinged::random(&mut random, damping, spin);
        let axis = random.direction();
        let outward = axis.cross(random.direction()).normalized().unwrap();
        let text = hinged.deck(axis, outward);
        let [growth, omega] = hinged.exact();
        let found = modes(&text);
        let [mode] = &found[..] else { panic!("{case}: {found:?}\n{text}") };
        let off = (mode.omega - omega).hypot(mode.growth - growth);
        assert!(off < 1e-7 * omega.hypot(growth), "{case}: {mode:?}, not {growth} and {omega}\n{text}");
    }
}

fn round_cantilever(direction: Vec3, mass_damping: f64) -> String {
    let Vec3([x, y, z]) = direction;
    format!(
        "[section.s]\nEA = 1e5\nGA = 4e4\nGJ = 40\nEI = 30\nrhoA = 1\nrhoJ = [0.02, 0.01, 0.01]\n[[beam]]\nname = \"a\"\n\
         section = \"s\"\nthrough = [[0, 0, 0], [{x}, {y}, {z}]]\nelements = 4\norder = 2\n[[support]]\nat = \"a@start\"\n\
         fix = \"all\"\n[damping]\nmass = {mass_damping}\n[[stage]]\nkind = \"modal\"\nmodes = 8\n"
    )
}

/// Damping by mass moves all exponents by the same growth: those of double modes, too.
#[test]
fn double_modes_are_listed_twice_with_damping() {
    let mut random = Random::new(42);
    for case in 0..12 {
        let direction = [Vec3::UNIT[2], random.direction()][usize::from(case > 0)];
        let [without, with] = [0.0, 0.1].map(|damping| modes(&round_cantilever(direction, damping)));
        assert_eq!([without.len(), with.len()], [8, 8]);
        for (without, with) in without.iter().zip(&with) {
            let expected = (without.omega.powi(2) - 0.05f64.powi(2)).sqrt();
            assert!((with.omega / expected - 1.0).abs() < 1e-6, "{case}: {} for {expected}", with.omega);
            assert!((with.growth + 0.05).abs() < 1e-6, "{case}: {with:?}");
        }
    }
}

/// Two masses on a spring, the first on a dashpot, along one direction in which nothing else holds them: the exponents but for zero are the
/// roots of m M s^3 + c M s^2 + k (m + M) s + c k.
fn braked(masses: [f64; 2], dashpot: f64, stiffness: f64) -> Vec<Complex<f64>> {
    let [m, heavy] = masses;
    let lead = m * heavy;
    let [a, b, c] = [dashpot * heavy / lead, stiffness * (m + heavy) / lead, dashpot * stiffness / lead];
    let companion = DMatrix::from_row_slice(3, 3, &[0.0, 0.0, -c, 1.0, 0.0, -b, 0.0, 1.0, -a]);
    companion.complex_eigenvalues().iter().copied().filter(|root| root.im >= 0.0).collect()
}

fn exponents(modes: &[Mode]) -> Vec<Complex<f64>> {
    modes.iter().map(|mode| Complex::new(mode.growth, mode.omega)).collect()
}

/// Each is found among the others, as often as it is there.
fn assert_same(mut found: Vec<Complex<f64>>, expected: &[Complex<f64>], what: &str) {
    let size = expected.iter().map(|s| s.norm()).fold(0.0, f64::max);
    assert_eq!(found.len(), expected.len(), "{what}: {found:?}, not {expected:?}");
    for one in expected {
        let near = |other: &Complex<f64>| (other - one).norm() < 1e-7 * size;
        let place =
            found.iter().position(near).unwrap_or_else(|| panic!("{what}: no {one} in {found:?}, of {expected:?}"));
        found.swap_remove(place);
    }
}

/// Free motions that dashpots resist, along random directions: nothing is missing, and each has its decay.
#[test]
fn modes_are_complete_where_dashpots_alone_hold_something() {
    let mut random = Random::new(43);
    for case in 0..40 {
        let mut power = |low: f64, high: f64| 10f64.powf(random.range(low, high));
        let masses = [power(-1.0, 1.0), power(-1.0, 1.0)];
        let stiffness = power(0.0, 3.0);
        let critical = 2.0 * (stiffness * masses[0]).sqrt();
        let dashpots = [power(-6.0, 1.0), power(-3.0, 0.5), power(-2.0, 0.3)].map(|ratio| ratio * critical);
        // Some directions are without any.
        let dashpots: [f64; 3] = std::array::from_fn(|k| if (case >> k) % 4 == 3 { 0.0 } else { dashpots[k] });
        let axis = random.direction();
        let aside = axis.cross(random.direction()).normalized().unwrap();
        // Where no node turns, a single element is a spring of EA/L along it and of GA/L across.
        let text = format!(
            "[point]\na = [0, 0, 0]\nb = {}\n[[body]]\nat = \"a\"\nmass = {}\n[[body]]\nat = \"b\"\nmass = {}\n\
             [section.s]\nEA = {stiffness}\nGA = {stiffness}\nGJ = 1\nEI = 1\n[[beam]]\nname = \"s\"\nsection = \"s\"\n\
             through = [\"a\", \"b\"]\nelements = 1\n[[support]]\nat = \"a\"\nfix = [\"rx\", \"ry\", \"rz\"]\n\
             [[support]]\nat = \"b\"\nfix = [\"rx\", \"ry\", \"rz\"]\n\
             [[spring]]\nat = \"a\"\naxes = [{}, {}]\ndamping = [{}, {}, {}, 0, 0, 0]\n\
             [[stage]]\nkind = \"modal\"\nmodes = 20\n",
            list(random.direction()),
            masses[0],
            masses[1],
            list(axis),
            list(aside),
            dashpots[0],
            dashpots[1],
            dashpots[2]
        );
        let zero = Complex::default();
        let swing = Complex::new(0.0, (stiffness * (1.0 / masses[0] + 1.0 / masses[1])).sqrt());
        let of_direction = |&dashpot: &f64| match dashpot {
            0.0 => vec![zero, swing],
            dashpot => [vec![zero], braked(masses, dashpot, stiffness)].concat(),
        };
        let expected: Vec<Complex<f64>> = dashpots.iter().flat_map(of_direction).collect();
        assert_same(exponents(&modes(&text)), &expected, &format!("{case}: {dashpots:?}\n{text}"));
    }
}

/// Damping by mass brakes the rigid motions of a free beam, each with its rate.
#[test]
fn free_beams_that_mass_damps_have_the_decay_of_their_rigid_motions() {
    let found = modes(
        "[point]\na = [0, 0, 0]\nb = [1, 0.2, 0.3]\n[section.s]\nEA = 1e4\nGA = 4e3\nGJ = 3\nEI = 4\nrhoA = 1\nrhoJ = [0.02, 0.01, 0.01]\n\
         [[beam]]\nname = \"f\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\n[damping]\nmass = 0.05\n\
         [[stage]]\nkind = \"modal\"\nmodes = 14\n",
    );
    let found = exponents(&found);
    let count = |value: f64| found.iter().filter(|s| s.im == 0.0 && (s.re - value).abs() < 1e-8).count();
    assert_eq!([count(0.0), count(-0.05)], [6, 6], "{found:?}");
    assert!(found.iter().filter(|s| s.im > 0.0).all(|s| (s.re + 0.025).abs() < 1e-8), "{found:?}");
}

/// Rotations take part, parts are of unlike mass, and round-off of other dampers is none.
#[test]
fn damped_rigid_motions_of_bodies_and_beams_are_complete() {
    // A body on a dashpot beside its centre: m u'' + c u' = 0 about the point that neither moves nor turns.
    let body = "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 1\ninertia = [0.2, 0.2, 0.2]\noffset = [0.5, 0, 0]\n\
                [[spring]]\nat = \"a\"\ndamping = [0, 0, 0.05, 0, 0, 0]\n[[stage]]\nkind = \"modal\"\nmodes = 14\n";
    let found = exponents(&modes(body));
    let decays: Vec<f64> = found.iter().map(|s| s.re).filter(|re| *re != 0.0).collect();
    // 1/m + x^2/I at the dashpot.
    assert!(decays.len() == 1 && (decays[0] + 0.05 * (1.0 + 0.25 / 0.2)).abs() < 1e-10, "{found:?}");
    let beam = |ea: f64, elements: usize, more: &str| {
        exponents(&modes(&format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0.2, 0.3]\n[section.s]\nEA = {ea}\nGA = 4e3\nGJ = 3\nEI = 4\nrhoA = 1\n\
             rhoJ = [0.02, 0.01, 0.01]\n[[beam]]\nname = \"f\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = {elements}\n\
             {more}[[stage]]\nkind = \"modal\"\nmodes = 14\n"
        )))
    };
    // With a dashpot on an end, modes move little from those without.
    let dashpot = |c: f64| format!("[[spring]]\nat = \"a\"\ndamping = [{c}, {c}, {c}, 0, 0, 0]\n");
    let swings = |found: &[Complex<f64>]| found.iter().filter(|s| s.im > 1.0).map(|s| s.im).collect::<Vec<_>>();
    let (without, with) = (swings(&beam(1e4, 4, "")), swings(&beam(1e4, 4, &dashpot(0.05))));
    assert!(with.len() >= 4, "{with:?}");
    for (a, b) in without.iter().zip(&with) {
        assert!((a / b - 1.0).abs() < 1e-2, "{without:?}, {with:?}");
    }
    // Beside large damping by stiffness that by mass is small.
    let found = beam(1e5, 20, "[damping]\nmass = 1e-3\nstiffness = 1e-4\n");
    // Round-off may make a pair of two of them.
    let decays = found.iter().filter(|s| (*s + Complex::from(1e-3)).norm() < 2e-5).count();
    assert!(decays >= 5 && found.iter().all(|s| s.re <= 0.0), "{found:?}");
    assert!(found.iter().any(|s| (s.im - 32.97).abs() < 0.01), "{found:?}");
    // Numbers without a square come to an end, whatever it is.
    attempt(&body.replace("0.05", "1e308"));
}

/// A straight cable between pins may spin about its axis, without mass and without stiffness: along any direction and however thin it is
/// it swings as a string does, and the spin is no mode.
#[test]
fn thin_pinned_cables_swing_as_strings() {
    let mut random = Random::new(61);
    let (length, tension, stretching) = (2.0_f64, 10.0_f64, 1000.0);
    for thinness in [1e-3, 1e-5, 1e-7, 1e-9, 1e-11] {
        for _ in 0..3 {
            let text = format!(
                "[point]\na = [0, 0, 0]\nb = {}\n[section.s]\nEA = {stretching}\nGA = 400\nGJ = {thinness}\nEI = {thinness}\nrhoA = 1\n\
                 [[beam]]\nname = \"c\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 16\norder = 2\n\
                 free_strain = [{}, 0, 0, 0, 0, 0]\n[[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"uz\"]\n\
                 [[support]]\nat = \"b\"\nfix = [\"ux\", \"uy\", \"uz\"]\n[[stage]]\nkind = \"static\"\nsteps = 1\n\
                 [[stage]]\nkind = \"modal\"\nmodes = 4\n",
                list(random.direction() * length),
                -tension / stretching
            );
            // Shear takes part of the tension where the axis turns, and sections do not: rhoA w^2 = k^2 T/(1 + T/GA).
            let lowest = std::f64::consts::PI / length * (tension / (1.0 + tension / 400.0)).sqrt();
            let expected = [lowest, lowest, 2.0 * lowest, 2.0 * lowest];
            let found = modes(&text);
            let fits = found.iter().zip(expected).all(|(mode, omega)| (mode.omega / omega - 1.0).abs() < 0.02);
            assert!(found.len() == 4 && fits, "{found:?} for {expected:?}\n{text}");
        }
    }
}

/// A stiff beam on soft springs is not free, however soft they are.
#[test]
fn soft_springs_are_no_free_motions() {
    let mut random = Random::new(62);
    for softness in [1e-4_f64, 1e-7, 1e-9, 1e-10] {
        let (axis, stretching) = (random.direction(), 1e6_f64);
        let stiffness = softness * stretching;
        let spring = |at: &str| {
            format!("[[spring]]\nat = \"{at}\"\nstiffness = [{stiffness}, {stiffness}, {stiffness}, 0, 0, 0]\n")
        };
        let text = format!(
            "[point]\na = {}\nb = {}\n[section.s]\nEA = {stretching}\nGA = {stretching}\nGJ = 50\nEI = 50\nrhoA = 1\n\
             rhoJ = [1e-4, 1e-4, 1e-4]\n[[beam]]\nname = \"f\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 10\norder = 2\n\
             {}{}[[stage]]\nkind = \"modal\"\nmodes = 8\n",
            list(axis * -0.5),
            list(axis * 0.5),
            spring("a"),
            spring("b")
        );
        let found = modes(&text);
        assert_eq!(found.len(), 8, "{found:?}\n{text}");
        // The spin about the axis, three translations of 2 k, two rotations of k/2 about the inertia 1/12; free-free bending.
        let bounce = (2.0 * stiffness).sqrt();
        let rocking = (0.5 * stiffness / (1.0 / 12.0 + 1e-4)).sqrt();
        let bending = 22.373 * 50f64.sqrt();
        let expected = [0.0, bounce, bounce, bounce, rocking, rocking, bending, bending];
        for (mode, omega) in found.iter().zip(expected) {
            // Bending takes part where springs are not soft beside it.
            let near = (mode.omega - omega).abs() <= (5e-3 + 2.0 * stiffness / 50.0) * omega + 1e-6;
            assert!(near && mode.growth.abs() < 1e-6, "{softness}: {found:?} for {expected:?}\n{text}");
        }
    }
}

/// More modes than there are may be asked for, and nothing is missing then.
#[test]
fn a_free_body_has_six_modes() {
    let text = "[point]\na = [0.1, 0.2, 0.3]\n[[body]]\nat = \"a\"\nmass = 2\ninertia = [0.3, 0.5, 0.7]\noffset = [0.1, 0, 0.2]\n\
                [[stage]]\nkind = \"modal\"\nmodes = 8\n";
    let found = modes(text);
    assert!(found.len() >= 6 && found[..6].iter().all(|mode| mode.omega == 0.0), "{found:?}");
    assert!(attempt(text).counters.findings.warnings.is_empty());
    // Numbers whose products overflow come to an end, whatever it is.
    for stiffness in ["1e308", "1e-308"] {
        attempt(&format!("{text}[[spring]]\nat = \"a\"\nstiffness = [{stiffness}, 0, 0, 0, 0, 0]\n"));
    }
}

/// A mode that is not exact enough to be listed is told.
#[test]
fn modes_that_fail_verification_are_told() {
    // A free bow that a following thrust accelerates is not in balance.
    let text = "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e5\nGA = 4e4\nGJ = 0.8\nEI = 1\nrhoA = 1\nrhoJ = [2e-4, 1e-4, 1e-4]\n\
                [[beam]]\nname = \"f\"\nsection = \"s\"\narc = [\"a\", [0.5, 0.2, 0], \"b\"]\norder = 2\nelements = 8\n\
                [[load]]\nat = \"a\"\nforce = [-0.5, 0, 0]\nframe = \"body\"\n[[stage]]\nkind = \"dynamic\"\nend = 0.02\nstep = 2e-3\n\
                [[stage]]\nkind = \"modal\"\nmodes = 14\n";
    let warned = attempt(text).counters.findings.warnings;
    assert!(warned.iter().any(|warning| warning.kind == WarningKind::MissingModes), "{warned:?}");
}

/// A free beam that spins in a frame: what Coriolis forces couple with its free motions is listed as it was.
#[test]
fn free_beams_in_rotating_frames_keep_their_modes() {
    let found = |damping: &str| {
        exponents(&modes(&format!(
            "[point]\na = [-1, 0, 0]\no = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e4\nGA = 4e3\nGJ = 3\nEI = 4\nrhoA = 1\n\
             rhoJ = [0.02, 0.01, 0.01]\n[[beam]]\nname = \"f\"\nsection = \"s\"\nthrough = [\"a\", \"o\", \"b\"]\nelements = 4\n{damping}\
             [[support]]\nat = \"o\"\nfix = \"all\"\nstages = [1]\n\
             [[stage]]\nkind = \"static\"\nsteps = 4\ntolerance = 1e-12\nframe = {{ spin = [0, 0, 3] }}\n\
             [[stage]]\nkind = \"modal\"\nmodes = 14\nframe = {{ spin = [0, 0, 3] }}\n"
        )))
    };
    let without = found("");
    let elastic = || without.iter().filter(|s| s.im > 5.0);
    assert!(without.len() == 14 && elastic().all(|s| s.re.abs() < 1e-4), "{without:?}");
    assert!((elastic().map(|s| s.im).fold(f64::INFINITY, f64::min) - 11.496184).abs() < 1e-5, "{without:?}");
    let with = found("[damping]\nstiffness = 1e-6\n");
    for one in elastic() {
        assert!(with.iter().any(|s| (s.im - one.im).abs() < 1e-3 * one.im), "{one}: {with:?}");
    }
}

/// Pretwisted blades that point to the axis of their frame, which presses them until some of their motions grow: all
/// others are there, whatever the mesh.
#[test]
fn modes_of_unstable_blades_in_rotating_frames_are_complete() {
    let mut random = Random::new(92);
    let mut unstable = 0;
    for _ in 0..6 {
        let [outward, axis] = random.axes();
        let length_unit = 10f64.powf(random.range(-3.0, 3.0));
        let (length, twist) = (random.range(1.0, 3.0), random.range(0.0, 0.5));
        let section = [1.0, random.range(2.0, 5.0)];
        // Between the first and the sixth load of the blade as a column under its own inertia, roughly.
        let spin = random.range(5.0, 30.0) / length.powi(2);
        let found = |elements: usize| {
            modes(&format!(
                "[section.s]\nEA = {}\nGA = {}\nGJ = {}\nEI = [{}, {}]\nrhoA = 1\nrhoJ = {}\n[[beam]]\nname = \"m\"\nsection = \"s\"\n\
                 through = [[0, 0, 0], {}]\naxis3 = {}\ntwist = [{twist}, 0]\nelements = {elements}\norder = 3\n\
                 [[support]]\nat = \"m@start\"\nfix = \"all\"\n\
                 [[stage]]\nkind = \"static\"\nsteps = 2\n{frame}[[stage]]\nkind = \"modal\"\nmodes = 12\n{frame}",
                1e6,
                4e5,
                3.0 * length_unit.powi(2),
                section[0] * length_unit.powi(2),
                section[1] * length_unit.powi(2),
                list(Vec3([2e-2, 1e-2, 1e-2]) * length_unit.powi(2)),
                list(outward * length * length_unit),
                list(axis),
                frame = format_args!(
                    "frame = {{ spin = {}, about = {} }}\n",
                    list(axis * (spin / length_unit)),
                    list(outward * 1.4 * length * length_unit)
                ),
            ))
        };
        let [coarse, fine] = [12, 30].map(found);
        unstable += usize::from(coarse.iter().any(|mode| mode.growth > 0.0));
        assert!(coarse.len() >= 12 && fine.len() >= 12, "{coarse:?} {fine:?}");
        for (a, b) in coarse.iter().zip(&fine).take(12) {
            let [a, b] = [a, b].map(|mode| Complex::new(mode.growth, mode.omega));
            assert!((a - b).norm() < 1e-3 * b.norm(), "{a} for {b}: {coarse:?} {fine:?}");
        }
    }
    assert!(unstable > 3, "{unstable}");
}

/// An open chain of slender bars on joints, clamped at its start, with the number of freedoms of its joints; `damping`:
/// of the rate of strain, a time for bars of length 1.
fn chain_of_bars(random: &mut Random, damping: f64) -> (String, usize) {
    // Kinds with the number of their freedoms
    let kinds = [("revolute", 1), ("universal", 2), ("spherical", 3), ("prismatic", 1), ("cylindrical", 2)];
    let length = 10f64.powf(random.range(-3.0, 3.0));
    let bars = 2 + (random.range(0.0, 3.0) as usize).min(2);
    let (mut points, mut parts, mut free) = (String::from("[point]\n"), String::new(), 0);
    let mut place = Vec3::ZERO;
    for bar in 0..bars {
        let next = place + random.direction() * (random.range(0.7, 1.5) * length);
        points += &format!("a{bar} = {}\nb{bar} = {}\n", list(place), list(next));
        let ei = 10f64.powf(random.range(1.0, 2.5));
        let [ea, ga, j] = [1e6 / length / length, 4e5 / length / length, 1e-3 * length * length];
        parts += &format!(
            "[section.s{bar}]\nEA = {ea:e}\nGA = {ga:e}\nGJ = {ei}\nEI = [{ei}, {}]\nrhoA = 1\nrhoJ = [{}, {j:e}, {j:e}]\n\
             [[beam]]\nname = \"L{bar}\"\nsection = \"s{bar}\"\nthrough = [\"a{bar}\", \"b{bar}\"]\nelements = 2\norder = 3\n",
            2.0 * ei,
            2.0 * j,
        );
        if bar > 0 {
            let (kind, freedoms) = kinds[(random.range(0.0, 5.0) as usize).min(4)];
            free += freedoms;
            let axis = random.direction();
            let axes = match kind {
                "spherical" => String::new(),
                "universal" => format!("axes = [{}, {}]\n", list(axis), list(axis.cross(random.direction()))),
                _ => format!("axis = {}\n", list(axis)),
            };
            parts += &format!(
                "[[joint]]\nkind = \"{kind}\"\nnodes = [\"b{}\", \"a{bar}\"]\nat = {}\n{axes}",
                bar - 1,
                list(place)
            );
        }
        place = next;
    }
    let modes = free + 3;
    let damping = format!("[damping]\nstiffness = {:e}\n", damping * length * length);
    let clamp = "[[support]]\nat = \"a0\"\nfix = \"all\"\n";
    (format!("{points}{parts}{clamp}{damping}[[stage]]\nkind = \"modal\"\nmodes = {modes}\n"), free)
}

/// Motions of a mechanism are exact zeros, as many as its joints have freedoms, with and without damping, and none of the
/// other modes is left out: round-off in the zeros took 26 of 387 such lists away, and cut others short.
#[test]
fn motions_of_mechanisms_are_exact_zeros() {
    for case in 0..24 {
        let of = |damping: f64| {
            let (text, free) = chain_of_bars(&mut Random::new(700 + case), damping);
            (modes(&text), free, text)
        };
        let (undamped, free, text) = of(0.0);
        let (damped, ..) = of(1e-6);
        for (name, list) in [("undamped", &undamped), ("damped", &damped)] {
            assert_eq!(list.len(), free + 3, "{case} {name}: {list:?}\n{text}");
            let zeros = list.iter().filter(|mode| mode.omega == 0.0 && mode.growth == 0.0).count();
            assert_eq!(zeros, free, "{case} {name}: {list:?}\n{text}");
        }
        for (a, b) in undamped.iter().zip(&damped).skip(free) {
            assert!((a.omega / b.omega - 1.0).abs() < 1e-3, "{case}: {undamped:?} {damped:?}\n{text}");
        }
    }
}

/// A body on a massless column that turns about its own axis: (k1 - m x)(k2 - m x) = 4 m^2 W^2 w^2 with x = W^2 + w^2, and the
/// stiffness k = N/(L - tanh(c L)/c), c^2 = N/EI, of a cantilever under tension. Only two of the many unknowns have mass: what
/// vectors of the search differ by beyond them is round-off, the more the stiffer the column is.
#[test]
fn bodies_on_columns_that_turn_have_their_two_modes() {
    let mut random = Random::new(731);
    for _ in 0..24 {
        let length = 10f64.powf(random.range(-2.0, 2.0));
        let [along, across] = random.axes();
        let bending = [1.0, random.range(1.05, 2.0)];
        let stiff = 10f64.powf(random.range(5.0, 7.5)) / (length * length);
        let [tension, mass] = [random.range(0.5, 4.0) / (length * length), random.range(0.02, 0.2)];
        let stiffness = bending.map(|bending: f64| {
            let c = (tension / bending).sqrt();
            tension / (length - (c * length).tanh() / c)
        });
        let spin = random.range(0.1, 0.9) * (stiffness[0].min(stiffness[1]) / mass).sqrt();
        let [a, b] = stiffness.map(|k| k / mass - spin * spin);
        let half = 0.5 * (a + b + 4.0 * spin * spin);
        let root = (half * half - a * b).sqrt();
        let exact = [half - root, half + root].map(f64::sqrt);
        let frame = format!("frame = {{ spin = {}, about = \"a\" }}", list(along * spin));
        let text = format!(
            "[point]\na = [0, 0, 0]\nb = {}\n[section.s]\nEA = {stiff}\nGA = {stiff}\nGJ = 1\nEI = [{}, {}]\nrhoA = 0\n\
             [[beam]]\nname = \"c\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 11\norder = 2\naxis3 = {}\n\
             [[support]]\nat = \"a\"\nfix = \"all\"\n[[body]]\nat = \"b\"\nmass = {mass}\n[[load]]\nat = \"b\"\nforce = {}\n\
             [[stage]]\nkind = \"static\"\nsteps = 1\n{frame}\n[[stage]]\nkind = \"modal\"\nmodes = 2\n{frame}\n",
            list(along * length),
            bending[0],
            bending[1],
            list(across),
            list(along * tension),
        );
        let found = modes(&text);
        assert_eq!(found.len(), 2, "{found:?}\n{text}");
        for (mode, exact) in found.iter().zip(exact) {
            assert!(
                (mode.omega / exact - 1.0).abs() < 1e-3 && mode.growth.abs() < 1e-6 * exact,
                "{mode:?} for {exact}\n{text}"
            );
        }
    }
}

/// Beck's column beyond flutter with damping by stiffness, whose stiff modes creep: those with the smallest |s| are listed,
/// whatever their frequencies are. Exponents by eight Hermite elements and a dense solver.
#[test]
fn slow_modes_beside_creeping_ones_are_listed() {
    let text = "[point]\nroot = [0, 0, 0]\ntip = [1, 0, 0]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 1e3\nEI = [1.5, 1]\nrhoA = 1\n\
                rhoJ = [0.001, 0, 0]\n[[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 5\norder = 3\n\
                [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [-22, 0, 0]\nframe = \"body\"\n\
                [damping]\nstiffness = 0.02\n[[stage]]\nkind = \"static\"\nsteps = 2\n[[stage]]\nkind = \"modal\"\nmodes = MODES\n";
    let expected = [(0.315, 7.781), (2.111, 8.714), (-7.176, 12.278), (-7.832, 19.081)];
    for count in [4, 5, 6, 12] {
        let found = exponents(&modes(&text.replace("MODES", &count.to_string())));
        assert_eq!(found.len(), count, "{found:?}");
        for (growth, omega) in expected {
            let exponent = Complex::new(growth, omega);
            assert!(found.iter().any(|s| (s - exponent).norm() < 2e-3 * exponent.norm()), "{exponent} in {found:?}");
        }
    }
}

/// Motors hold all bodies: no mode is invented, neither along the axes nor in random directions.
#[test]
fn what_motors_hold_has_no_modes() {
    let mut random = Random::new(97);
    let along = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]].map(Vec3);
    for number in 0..20 {
        let [b, first, second] = if number < 10 { along } else { [0; 3].map(|_| random.direction()) };
        let size = if number < 10 { 0.1 } else { 10.0_f64.powf(random.range(-3.0, 3.0)) };
        let inertia = list(Vec3([size; 3]));
        let body = |at: &str, mass: f64| format!("[[body]]\nat = \"{at}\"\nmass = {mass}\ninertia = {inertia}\n");
        let joint = |nodes: &str, axis: Vec3, angle: f64| {
            format!("[[joint]]\nkind = \"revolute\"\nnodes = [{nodes}]\naxis = {}\nangle = {angle}\n", list(axis))
        };
        let deck = format!(
            "[point]\na = [0, 0, 0]\nb = {}\n{}{}{}{}[[stage]]\nkind = \"static\"\nsteps = 2\n\
             [[stage]]\nkind = \"modal\"\nmodes = 1\n",
            list(b),
            body("a", 2.0),
            body("b", 1.0),
            joint("\"a\"", first, random.range(-1.0, 1.0)),
            joint("\"a\", \"b\"", second, random.range(-1.0, 1.0)),
        );
        let why = format!("{:?}", attempt(&deck).result.err());
        assert!(why.contains("leave no motion"), "{why}\n{deck}");
    }
}
