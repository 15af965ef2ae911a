//! Motions of joints between parts of which one has no rotary inertia: a point mass, or the end of a beam without
//! `rhoJ`. Its rotation follows the other part, and takes no momentum. Spins of rods that nothing resists.

use crate::random::Random;
use crate::scenes::{Simulation, distance, list, simulate, warnings};
use beamsim_core::tensor::{Mat3, Vec3};

/// The units of a scene: of lengths, masses and times.
struct Units {
    length: f64,
    mass: f64,
    time: f64,
}

impl Units {
    fn random(random: &mut Random) -> Self {
        let mut unit = |decades: f64| 10.0_f64.powf(random.range(-decades, decades));
        Self { length: unit(3.0), mass: unit(6.0), time: unit(2.0) }
    }

    fn head(&self, random: &mut Random) -> String {
        format!("gravity = {}\n[point]\n", list(random.vector(9.81 * self.length / self.time.powi(2))))
    }

    /// A body with principal axes in any direction, slender in some scenes.
    fn body(&self, random: &mut Random) -> String {
        let [a, b] = random.axes();
        let axes = Mat3([a, b, a.cross(b)].map(|axis| axis.0)).transpose();
        let least = 10.0_f64.powf(random.range(-6.0, 0.0));
        let principal = Mat3::diagonal([0.2 * least, 0.2, 0.2 + 0.1 * least]).scale(self.mass * self.length.powi(2));
        let inertia = axes * principal * axes.transpose();
        let rows = inertia.0.map(|row| list(Vec3(row))).join(", ");
        format!("[[body]]\nat = \"hub\"\nmass = {:e}\ninertia = [{rows}]\n", 2.0 * self.mass)
    }

    fn tail(&self, settings: &str, nodes: &str) -> String {
        format!(
            "[output]\nnodes = {nodes}\ncolumns = [\"u\", \"energy\"]\n[[stage]]\nkind = \"dynamic\"\nend = {:e}\n{settings}\n",
            0.5 * self.time
        )
    }
}

/// A body on a hinge or in free flight, with a point mass fixed to it, and another to that.
fn point_masses(random: &mut Random, units: &Units, settings: &str) -> String {
    let mut place = |size: f64| list(random.vector(size * units.length));
    let points = format!("hub = {}\na = {}\nb = {}\n", place(0.3), place(1.0), place(1.2));
    let hinge = match (random.range(0.0, 3.0) as usize, list(random.direction())) {
        (0, axis) => format!("[[joint]]\nkind = \"revolute\"\nnodes = [\"hub\"]\naxis = {axis}\n"),
        (1, _) => "[[joint]]\nkind = \"spherical\"\nnodes = [\"hub\"]\n".into(),
        (_, axis) => format!("[[joint]]\nkind = \"prismatic\"\nnodes = [\"hub\"]\naxis = {axis}\n"),
    };
    let mass = |at: &str, mass: f64| format!("[[body]]\nat = \"{at}\"\nmass = {:e}\n", mass * units.mass);
    let rigid = |nodes: &str| format!("[[joint]]\nkind = \"rigid\"\nnodes = {nodes}\n");
    let bodies = units.body(random) + &mass("a", 0.7) + &mass("b", 0.4);
    let joints = hinge + &rigid("[\"hub\", \"a\"]") + &rigid("[\"a\", \"b\"]");
    units.head(random) + &points + &bodies + &joints + &units.tail(settings, "[\"b\"]")
}

/// Two beams without rotary inertia with a joint between them, and a body there.
fn beams(random: &mut Random, units: &Units, settings: &str) -> String {
    let Units { length, mass, time } = units;
    let stiffness = mass * length.powi(3) / time.powi(2);
    let mut place = |size: f64| random.vector(size * length);
    let (a, first, second) = (place(0.3), place(1.0), place(1.0));
    let points = format!("a = {}\nhub = {}\nc = {}\n", list(a), list(a + first), list(a + first + second));
    let axial = 500.0 * stiffness / length.powi(2);
    let section = format!(
        "[section.s]\nEA = {axial:e}\nGA = {axial:e}\nGJ = {bending:e}\nEI = {bending:e}\nrhoA = {:e}\n",
        mass / length,
        bending = 10.0 * stiffness
    );
    let beam = |name: &str, through: &str| {
        format!("[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = {through}\nelements = 2\norder = 2\n")
    };
    let kind = ["revolute", "universal", "spherical"][random.range(0.0, 3.0) as usize];
    let axis = match kind {
        "revolute" => format!("axis = {}\n", list(random.direction())),
        "universal" => {
            let [first, second] = random.axes();
            format!("axes = [{}, {}]\n", list(first), list(second))
        }
        _ => String::new(),
    };
    let joint = format!("[[joint]]\nkind = \"{kind}\"\nat = \"hub\"\nbeams = [\"u\", \"l\"]\n{axis}");
    let beams = beam("u", "[\"a\", \"hub\"]") + &beam("l", "[\"hub\", \"c\"]");
    let support = "[[support]]\nat = \"a\"\nfix = \"all\"\n";
    units.head(random)
        + &points
        + &section
        + &beams
        + support
        + &units.body(random)
        + &joint
        + &units.tail(settings, "[\"c\"]")
}

#[test]
fn rotations_without_inertia_take_no_momentum() {
    type Scene = fn(&mut Random, &Units, &str) -> String;
    for (scene, name, node) in [(point_masses as Scene, "point masses", "b.u"), (beams, "beams", "c.u")] {
        for seed in 0..6 {
            let units = Units::random(&mut Random::new(1000 + seed));
            let run = |settings: &str, step: f64| {
                simulate(&scene(&mut Random::new(seed), &units, &format!("step = {:e}\n{settings}", step * units.time)))
            };
            let exact = run("scheme = \"generalized_alpha\"\nrho_inf = 0.9", 2.5e-4);
            let end = |run: &Simulation| run.vector(node);
            let way = distance(end(&exact), [0.0; 3]);
            let adaptive = "scheme = \"generalized_alpha\"\nadaptive = true\nstep_tolerance = 1e-6";
            for (settings, step, allowed) in [("scheme = \"lobatto\"", 2e-3, 1e-3), (adaptive, 1e-3, 1e-3)] {
                let found = run(settings, step);
                let off = distance(end(&found), end(&exact)) / way;
                let of = format!("{name}, seed {seed}, {settings}: {off:e} of the way off");
                assert!(off < allowed, "{of}");
                let largest = |column: &str| found.column(column).into_iter().fold(0.0, |m: f64, e| m.max(e.abs()));
                let lost = largest("energy.total") / largest("energy.kinetic");
                assert!(lost < 1e-3, "{of}, {lost:e} of the energy");
            }
        }
    }
}

/// Round rods without rotary inertia, pinned at one end or free, that swing in space: nothing turns them about their axis, and
/// so they do not turn about it, whatever the scheme. Rods with unequal bending stiffness are told of.
#[test]
fn round_rods_without_rotary_inertia_do_not_spin() {
    let mut random = Random::new(104);
    for case in 0..15 {
        let scheme = ["newmark", "hht", "generalized_alpha", "lie_generalized_alpha", "generalized_alpha"][case % 5];
        let [outward, across] = random.axes();
        let (length_unit, force_unit) = (10f64.powf(random.range(-2.0, 2.0)), 10f64.powf(random.range(-2.0, 2.0)));
        let bending = 10f64.powf(random.range(-1.0, 0.6)) * force_unit * length_unit.powi(2);
        let rod = |bending: &str| {
            format!(
                "gravity = {}\n[section.s]\nEA = {}\nGA = {}\nGJ = {}\nEI = {bending}\nrhoA = {}\n\
                 [[beam]]\nname = \"c\"\nsection = \"s\"\nthrough = [[0, 0, 0], {}]\nelements = 8\norder = {}\n{}\
                 [[initial]]\nspin = {}\n[[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.002\nscheme = \"{scheme}\"\n\
                 [output]\nnodes = [\"c@0.5\"]\ncolumns = [\"w\", \"d\"]\n",
                list(across * (-9.81 * length_unit)),
                1e4 * force_unit,
                4e3 * force_unit,
                0.5 * force_unit * length_unit.powi(2),
                force_unit / length_unit.powi(2),
                list(outward * length_unit),
                1 + case % 3,
                if case % 5 == 4 { "" } else { "[[support]]\nat = \"c@start\"\nfix = \"pin\"\n" },
                list((across * 0.8 + outward.cross(across)) * 1.3),
            )
        };
        let run = simulate(&rod(&format!("{bending}")));
        let [spins, axes] = ["c@0.5.w", "c@0.5.d1"].map(|name| {
            let [x, y, z] = ["x", "y", "z"].map(|part| run.column(&format!("{name}{part}")));
            (0..x.len()).map(|row| Vec3([x[row], y[row], z[row]])).collect::<Vec<_>>()
        });
        let fastest = spins.iter().zip(&axes).map(|(w, d)| w.dot(*d).abs()).fold(0.0, f64::max);
        assert!(fastest < 0.05, "{scheme}: {fastest}\n{}", rod(&format!("{bending}")));
        assert_eq!(run.counters.cutbacks, 0, "{scheme}");
        let is_told = |bending: &str| warnings(&rod(bending)).iter().any(|message| message.contains("own axis"));
        assert!(!is_told(&format!("{bending}")) && is_told(&format!("[{bending}, {}]", 3.0 * bending)));
    }
}
