//! Modes against closed forms.

use crate::random::Random;
use crate::scenes::{list, modes};
use beamsim_core::tensor::Vec3;

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
