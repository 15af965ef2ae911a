//! Strains, resultants, reactions and energies of linear stages: first derivatives about their origin, in balance with
//! the loads at the initial places.

use crate::random::Random;
use crate::scenes::{Simulation, list, simulate};
use beamsim::scene::{self, Scene};
use beamsim_core::effect::elasticity::{ElementStresses, StressField};
use beamsim_core::kernel::law::{Strain, Stress};
use beamsim_core::kernel::shape::gauss;
use beamsim_core::model::beam_element::shape_at;
use beamsim_core::probe::Line;
use beamsim_core::run::{Failure, Run, Snapshot};
use beamsim_core::system::State;
use beamsim_core::tensor::{Mat3, Vec3};
use std::sync::Arc;

const LINEAR: &str = "[effects]\nlarge_rotations = false\n";
const STATIC: &str = "[[stage]]\nkind = \"static\"\nsteps = 3\n";

/// A cantilever from its root to its tip; `beam` has the keys of its shape and mesh.
struct Cantilever {
    what: String,
    beam: String,
    sections: String,
}

impl Cantilever {
    fn deck(&self, rest: &str) -> String {
        let Self { beam, sections, .. } = self;
        format!(
            "{sections}[[beam]]\nname = \"b\"\n{beam}[[support]]\nat = \"b@start\"\nfix = \"all\"\n{rest}{STATIC}{LINEAR}"
        )
    }
}

/// A section with a full 6x6 stiffness.
fn coupled_section(name: &str, random: &mut Random) -> String {
    let mut entries = [[0.0; 6]; 6];
    let factor: [[f64; 6]; 6] = std::array::from_fn(|_| std::array::from_fn(|_| random.range(-1.0, 1.0)));
    for (i, row) in entries.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            let sum: f64 = (0..6).map(|k| factor[i][k] * factor[j][k]).sum();
            *entry = if i == j { sum + 1.0 } else { sum } * 20.0;
        }
    }
    format!("[section.{name}]\nstiffness = {entries:?}\n")
}

/// Cantilevers of every order, interpolation, shape and kind of section, in random directions.
fn cantilevers(random: &mut Random) -> Vec<Cantilever> {
    let plain = "[section.s]\nEA = 500\nGA = [60, 90]\nGJ = 20\nEI = [40, 70]\n[section.t]\nEA = 200\nGA = [20, 30]\nGJ = 9\nEI = [15, 20]\n";
    let coupled = coupled_section("s", random) + &coupled_section("t", random);
    let mut all = Vec::new();
    for order in 1..=3 {
        for interpolation in ["relative", "total"] {
            for shape in ["through", "arc"] {
                for (sections, names) in
                    [(plain, "\"s\""), (plain, "[\"s\", \"t\"]"), (&coupled, "\"s\""), (&coupled, "[\"s\", \"t\"]")]
                {
                    let places = [random.cube(0.3), random.vector(1.0), random.vector(2.5)].map(list).join(", ");
                    let beam = format!(
                        "section = {names}\n{shape} = [{places}]\nelements = 3\norder = {order}\ntwist = [0.2, 1.1]\n\
                         interpolation = \"{interpolation}\"\n"
                    );
                    let what = format!("{beam}\n{sections}");
                    all.push(Cantilever { what, beam, sections: sections.into() });
                }
            }
        }
    }
    all
}

fn scene_of(text: &str) -> Scene {
    match scene::from_text(text) {
        Ok((scene, _)) => scene,
        Err(found) => panic!("{:?}\n{text}", found.iter().map(|d| &d.message).collect::<Vec<_>>()),
    }
}

/// The last row of a run: its state, and the state about which its stage is linear.
fn last_row(scene: &Scene) -> (State, Option<State>) {
    let mut last = None;
    let mut observer = |at: &Snapshot| -> Result<(), Failure> {
        last = Some((at.state.clone(), at.origin.cloned()));
        Ok(())
    };
    Run::new(scene.plan.clone(), &mut observer).finish().0.unwrap();
    last.unwrap()
}

fn stresses(fields: &[Arc<dyn StressField>], element: u32, at: &State, origin: Option<&State>) -> ElementStresses {
    fields.iter().find_map(|field| field.stresses(element, at, origin)).expect("each element has an elasticity")
}

/// Strains and stresses at the integration points of an element and, where no free strain acts, at some places. Between
/// points the balance of a linear stage leaves out the stresses of free strains, which act as loads.
fn samples(fields: &[Arc<dyn StressField>], element: u32, at: &State, origin: Option<&State>) -> Vec<(Strain, Stress)> {
    let found = stresses(fields, element, at, origin);
    if at.amplitude.iter().any(|&amplitude| amplitude != 0.0) {
        return found.at_points();
    }
    let along = if found.hides_force_along() { Vec3([0.3, -0.2, 0.1]) } else { Vec3::ZERO };
    let places = [-1.0, 0.4, 1.0].map(|xi| found.at(xi, along));
    found.at_points().into_iter().chain(places).collect()
}

/// The components of strain and stress.
fn components((strain, stress): &(Strain, Stress)) -> [f64; 12] {
    let all = [strain.gamma.0, strain.kappa.0, stress.n.0, stress.m.0].concat();
    all.try_into().unwrap()
}

/// The last node of an element is the first of the next one.
fn elements(line: &Line) -> impl Iterator<Item = u32> {
    let first = line.points[0].inside.sides[0].element;
    (0..(line.points.len() - 1) / line.order).map(move |k| first + k as u32)
}

#[test]
fn strains_are_first_derivatives_about_the_origin() {
    let mut random = Random::new(61);
    for (number, cantilever) in cantilevers(&mut random).into_iter().enumerate() {
        let free = "free_strain = [0.1, 0.02, -0.03, 0.2, 0.1, -0.3]\n";
        let with_free = Cantilever { beam: format!("{}{free}", cantilever.beam), ..cantilever };
        let scene = scene_of(&with_free.deck("[[load]]\nat = \"b@end\"\nforce = [0, 0, 1]\n"));
        let line = &scene.figure().lines[0];
        let fields = &line.points[0].inside.elasticity;
        let mut origin = scene.plan.model.rest();
        origin.amplitude.fill([0.7, 0.0][number % 2]);
        let turned = random.vector(1.2);
        let mut direction = origin.q.clone();
        for node in line.points.iter().flat_map(|point| &point.place.nodes).map(|&(node, _, _)| node) {
            origin.q[node.u as usize] = random.cube(0.3);
            origin.q[node.p as usize] = turned + random.cube(0.3);
            direction[node.u as usize] = random.cube(1.0);
            direction[node.p as usize] = random.cube(1.0);
        }
        let moved = |by: f64| {
            let mut state = origin.clone();
            state.q.iter_mut().zip(&direction).for_each(|(q, &d)| *q += d * by);
            state
        };
        for element in elements(line) {
            let full = |by: f64| samples(fields, element, &moved(by), None);
            let linear = |by: f64| samples(fields, element, &moved(by), Some(&origin));
            let h = 1e-3;
            let samples = [full(0.0), full(h), full(-h), full(2.0 * h), full(-2.0 * h), linear(1.0), linear(1e3)];
            for g in 0..samples[0].len() {
                let [here, after, before, far, back, one, thousand] = samples.each_ref().map(|s| components(&s[g]));
                let size = one.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
                for k in 0..12 {
                    let slope = (8.0 * (after[k] - before[k]) - (far[k] - back[k])) / (12.0 * h);
                    let off = (one[k] - here[k] - slope).abs();
                    assert!(off < 1e-8 * size, "{k}: {} for {slope}\n{}", one[k] - here[k], with_free.what);
                    let off = (thousand[k] - here[k] - 1e3 * (one[k] - here[k])).abs();
                    assert!(off < 1e-9 * size * 1e3, "{k}: a thousand times\n{}", with_free.what);
                }
            }
        }
    }
}

/// In statically determinate scenes the loads alone decide on the resultants, whatever the displacements: those here
/// are many times as long as the beam. Free strains change nothing.
#[test]
fn resultants_balance_the_loads_at_the_initial_places() {
    let mut random = Random::new(62);
    for cantilever in cantilevers(&mut random) {
        // A second stage begins with the load stiffness of moments, which changes the loads.
        for (free, moment, stages) in
            [("", 200.0, ""), ("free_strain = [0.1, 0.02, -0.03, 0.2, 0.1, -0.3]\n", 0.0, STATIC)]
        {
            let [force, moment] = [random.vector(300.0), random.vector(moment)];
            let with_free = Cantilever {
                what: cantilever.what.clone(),
                beam: format!("{}{free}", cantilever.beam),
                sections: cantilever.sections.clone(),
            };
            let load = format!("[[load]]\nat = \"b@end\"\nforce = {}\nmoment = {}\n", list(force), list(moment));
            let scene = scene_of(&with_free.deck(&(load + stages)));
            let (state, origin) = last_row(&scene);
            let line = &scene.figure().lines[0];
            let tip = line.points.last().unwrap().place.initial();
            let size = 300.0 * 3.0 + 200.0;
            for (number, element) in elements(line).enumerate() {
                let nodes = &line.points[number * line.order..=(number + 1) * line.order];
                let found = stresses(&line.points[0].inside.elasticity, element, &state, origin.as_ref());
                let at_points = found.at_points().into_iter().zip(gauss(line.order)).map(|(at, &(xi, _))| (at, xi));
                let others = [-1.0, 0.3, 1.0].map(|xi| (found.at(xi, Vec3::ZERO), xi));
                for ((_, stress), xi) in at_points.chain(others) {
                    let (shape, _) = shape_at(nodes.len(), xi);
                    let place = nodes.iter().zip(shape).fold(Vec3::ZERO, |x, (node, n)| x + node.place.initial() * n);
                    let off = (stress.n - force).norm().max((stress.m - moment - (tip - place).cross(force)).norm());
                    assert!(off < 1e-9 * size, "off by {off:e}\n{free}{}", cantilever.what);
                }
            }
        }
    }
}

/// A heated cantilever is free to grow: its stiffness is that of a cold one, in each stage.
#[test]
fn free_strains_are_loads() {
    let simulation = simulate(&format!(
        "[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 100\nEI = 100\nrhoA = 1\n[[beam]]\nname = \"b\"\nsection = \"s\"\n\
         through = [[0, 0, 0], [2, 0, 0]]\nelements = 2\norder = 2\nfree_strain = [1e-2, 0, 0, 0, 0, 0]\n\
         [[support]]\nat = \"b@start\"\nfix = \"all\"\n[[load]]\nat = \"b@end\"\nforce = [0, 5, 0]\n[output]\nnodes = [\"b@end\"]\n\
         columns = [\"u\"]\n{}[[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.01\n{LINEAR}",
        STATIC.repeat(2)
    ));
    for (column, expected) in [("b@end.ux", 0.02), ("b@end.uy", 5.0 * (8.0 / 300.0 + 2.0 / 1e6))] {
        for value in &simulation.column(column)[3..] {
            assert!((value / expected - 1.0).abs() < 1e-8, "{column}: {value} instead of {expected}");
        }
    }
}

/// The columns themselves, in section axes, at both ends and in the middle of straight beams.
#[test]
fn columns_are_resultants_of_the_linear_theory() {
    let mut random = Random::new(63);
    for order in 1..=3 {
        let [root, along] = [random.cube(1.0), random.vector(2.0)];
        let [force, moment] = [random.vector(50.0), random.vector(40.0)];
        let text = format!(
            "[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 20\nEI = 40\n[[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [{}, {}]\n\
             elements = 2\norder = {order}\n[[support]]\nat = \"b@start\"\nfix = \"all\"\n\
             [[load]]\nat = \"b@end\"\nforce = {}\nmoment = {}\n[output]\nnodes = [\"b@start\", \"b@0.5\", \"b@end\"]\n\
             columns = [\"resultant\", \"strain\", \"reaction\"]\n{STATIC}{LINEAR}",
            list(root),
            list(root + along),
            list(force),
            list(moment)
        );
        let simulation = simulate(&text);
        let axes = scene_of(&text).figure().lines[0].points[0].inside.sides[0].frame;
        let size = force.norm() * along.norm() + moment.norm();
        for (at, fraction) in [("b@start", 0.0), ("b@0.5", 0.5), ("b@end", 1.0)] {
            let read = |names: [&str; 3]| Vec3(names.map(|name| simulation.end(&format!("{at}.{name}"))));
            let expected_moment = moment + (along * (1.0 - fraction)).cross(force);
            let [n, m] = [axes.transpose_mul(force), axes.transpose_mul(expected_moment)];
            assert!((read(["N1", "N2", "N3"]) - n).norm() < 1e-7 * size, "{at}: order {order}");
            assert!((read(["M1", "M2", "M3"]) - m).norm() < 1e-9 * size, "{at}: order {order}");
            let strain = n.0.map(|n| n / 1e6);
            assert!((read(["G1", "G2", "G3"]) - Vec3(strain)).norm() < 1e-12 * size, "{at}: order {order}");
            let bend = Mat3::diagonal([1.0 / 20.0, 1.0 / 40.0, 1.0 / 40.0]) * m;
            assert!((read(["K1", "K2", "K3"]) - bend).norm() < 1e-9 * size, "{at}: order {order}");
        }
        let reaction = |names: [&str; 3]| Vec3(names.map(|name| simulation.end(&format!("b@start.{name}"))));
        assert!((reaction(["fx", "fy", "fz"]) + force).norm() < 1e-9 * size);
        assert!((reaction(["mx", "my", "mz"]) + moment + along.cross(force)).norm() < 1e-9 * size);
    }
}

/// Moments at a node with a large prescribed rotation, and those of a joint to ground with a large angle, are taken at
/// the initial places.
#[test]
fn reactions_at_turned_nodes_balance_the_loads_at_the_initial_places() {
    let held =
        "[[support]]\nat = \"root\"\nfix = \"pin\"\n[[motion]]\nat = \"root\"\nrotate = [0.6, 0, 0.8]\nangle = 2\n";
    let hinged = "[[joint]]\nkind = \"revolute\"\nat = \"root\"\nbeams = [\"b\"]\naxis = [0, 0, 1]\nstiffness = 2\n";
    for (root, about_z) in [(held, true), (hinged, false)] {
        let simulation = simulate(&format!(
            "[point]\nroot = [0, 0, 0]\ntip = [2, 0, 0]\n[section.s]\nEA = 500\nGA = 60\nGJ = 20\nEI = 40\n\
             [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 2\n{root}\
             [[load]]\nat = \"tip\"\nforce = [1, 2, 3]\nmoment = [4, 5, 0]\n[output]\nnodes = [\"root\"]\n\
             columns = [\"r\", \"reaction\"]\n{STATIC}{LINEAR}"
        ));
        let read = |names: [&str; 3]| Vec3(names.map(|name| simulation.end(&format!("root.{name}"))));
        assert!(read(["rx", "ry", "rz"]).norm() > 1.9);
        assert!((read(["fx", "fy", "fz"]) + Vec3([1.0, 2.0, 3.0])).norm() < 1e-10);
        let [x, y, z] = (read(["mx", "my", "mz"]) + Vec3([4.0, -1.0, 4.0])).0;
        assert!(x.abs() < 1e-10 && y.abs() < 1e-10, "{x:e} {y:e}");
        assert!(!about_z || z.abs() < 1e-10, "{z:e}");
    }
}

/// The largest departure of the total energy from that of row number `first`, in later rows, over the largest energy.
fn energy_error(simulation: &Simulation, first: usize) -> f64 {
    let largest = |column: &str| simulation.column(column).iter().fold(0.0_f64, |largest, e| largest.max(e.abs()));
    let scale = largest("energy.strain").max(largest("energy.kinetic"));
    assert!(scale > 1.0, "the scene moves");
    let total = &simulation.column("energy.total")[first..];
    total.iter().fold(0.0_f64, |off, e| off.max((e - total[0]).abs())) / scale
}

/// An elbow of two beams far bent by its loads, with mass.
fn elbow(between: &str, rest: &str) -> String {
    format!(
        "[point]\nroot = [0, 0, 0]\nknee = [1, 0.2, 0]\ntip = [1, 1, 1]\n\
         [section.s]\nEA = 500\nGA = 60\nGJ = 20\nEI = 40\nrhoA = 1.5\nrhoJ = [0.02, 0.01, 0.01]\n\
         [[beam]]\nname = \"a\"\nsection = \"s\"\nthrough = [\"root\", \"knee\"]\nelements = 2\norder = 2\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"knee\", \"tip\"]\nelements = 2\n{between}\
         [[support]]\nat = \"root\"\nfix = \"all\"\n{rest}[output]\nnodes = [\"tip\"]\ncolumns = [\"u\", \"energy\"]\n{LINEAR}"
    )
}

const FORCE: &str = "[[load]]\nat = \"tip\"\nforce = [10, 200, 30]\n";
const LOAD: &str = "[[load]]\nat = \"tip\"\nforce = [10, 200, 30]\nmoment = [20, 10, -50]\n";
const HINGE: &str =
    "[[joint]]\nkind = \"revolute\"\nat = \"knee\"\nbeams = [\"a\", \"b\"]\naxis = [0, 0, 1]\nstiffness = 30\n";

#[test]
fn the_work_of_the_loads_is_the_energy_of_linear_statics() {
    let spring = "[[spring]]\nat = \"tip\"\nstiffness = [9, 8, 7, 3, 2, 1]\n";
    let motion = "[[motion]]\nat = \"tip\"\nrotate = [0, 0.6, 0.8]\nangle = 2.5\n";
    let following = "[[load]]\nat = \"tip\"\nforce = [0, 100, 0]\nframe = \"body\"\n";
    let free = "free_strain = [0.2, 0, 0.1, 0, 1, 2]\n";
    let both = STATIC.repeat(2);
    let both = both.as_str();
    for (between, rest, stages) in [
        ("", LOAD.to_string(), STATIC),
        ("", FORCE.to_string(), both),
        (HINGE, FORCE.to_string(), both),
        (HINGE, format!("{LOAD}{spring}"), STATIC),
        ("", format!("{FORCE}{spring}"), both),
        ("", format!("{FORCE}{motion}"), both),
        ("", format!("{LOAD}{following}"), STATIC),
        (free, FORCE.to_string(), both),
    ] {
        let simulation = simulate(&(elbow(between, &rest) + stages));
        let off = energy_error(&simulation, 0);
        assert!(off < 1e-10, "{off:e}\n{between}{rest}");
    }
    // Clapeyron: half the final load times its displacement.
    let simulation = simulate(&(elbow("", "[[load]]\nat = \"tip\"\nforce = [0, 200, 0]\n") + STATIC));
    let work = 0.5 * 200.0 * simulation.end("tip.uy");
    assert!((simulation.end("energy.strain") / work - 1.0).abs() < 1e-10);
}

/// The trapezoidal rule keeps the energy of linear equations of motion.
#[test]
fn linear_dynamics_keeps_its_energy() {
    let dynamic = "[[stage]]\nkind = \"dynamic\"\nend = 2\nstep = 0.02\ntolerance = 1e-12\n";
    let initial = "[[initial]]\nvelocity = [3, 0, 9]\nspin = [0, 0, 5]\nabout = \"root\"\n";
    let spring = "[[spring]]\nat = \"tip\"\nstiffness = [9, 8, 7, 3, 2, 1]\ndamping = [1, 1, 1, 0.1, 0.1, 0.1]\n";
    let damping = "[damping]\nstiffness = 0.01\nmass = 0.1\n";
    for rest in [FORCE.to_string(), format!("{FORCE}{initial}"), format!("{FORCE}{initial}{spring}{damping}")] {
        // Initial velocities bring in energy behind the four rows of a static stage.
        for (stages, first) in [(dynamic.to_string(), 0), (format!("{STATIC}{dynamic}"), 4)] {
            let simulation = simulate(&(elbow("", &rest) + &stages));
            let off = energy_error(&simulation, first);
            assert!(off < 1e-9, "{off:e}\n{rest}{stages}");
        }
    }
}

/// A body on a rigid arm from a hinge, which is set in motion across the arm, goes straight on: nothing of second order
/// pulls it towards the hinge.
#[test]
fn linear_dynamics_begins_without_centripetal_accelerations() {
    let simulation = simulate(&format!(
        "[point]\nc = [1, 0, 0]\n[[body]]\nat = \"c\"\nmass = 2\ninertia = [1, 2, 3]\n\
         [[joint]]\nkind = \"revolute\"\nnodes = [\"c\"]\nat = [0, 0, 0]\naxis = [0, 0, 1]\n\
         [[initial]]\nat = \"c\"\nspin = [0, 0, 3]\nabout = [0, 0, 0]\n[output]\nnodes = [\"c\"]\ncolumns = [\"u\", \"a\", \"reaction\"]\n\
         [[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.1\n{LINEAR}"
    ));
    for (k, y) in simulation.column("c.uy").into_iter().enumerate() {
        assert!((y - 0.3 * k as f64).abs() < 1e-10, "{y} in row {k}");
    }
    for column in ["c.ux", "c.ax", "c.ay", "c.fx", "c.fy"] {
        assert!(simulation.column(column).iter().all(|value| value.abs() < 1e-9), "{column}");
    }
}
