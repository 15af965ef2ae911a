//! The forces of penalties do not jump where a contact passes from one element to the next.

use crate::beam_contacts::{Bar, pushed};
use crate::random::Random;
use beamsim::scene::{self, Mesh, Scene};
use beamsim_core::kernel::Weights;
use beamsim_core::model::{Assembly, Model, Schedule, StageContext, StageKind};
use beamsim_core::system::ContactRegime;
use beamsim_core::tensor::Vec3;

/// A beam along an arc about the z axis, and a straight one that touches it from the inside or the
/// outside.
struct OnArc {
    radius_of_arc: f64,
    arc: Bar,
    bar: Bar,
}

fn on_arc(random: &mut Random) -> OnArc {
    let radius_of_arc = random.range(0.06, 0.2);
    let radii = [0, 1].map(|_| random.range(0.005, 0.02));
    let of_arc = |angle: f64| Vec3([angle.cos(), angle.sin(), 0.0]) * radius_of_arc;
    let [order, order_of_bar] = [0, 1].map(|_| random.range(1.0, 3.99) as usize);
    let arc = Bar {
        ends: [of_arc(-0.6), of_arc(0.6)],
        elements: random.range(6.0, 20.0) as usize / order + 2,
        order,
        radius: radii[0],
    };
    let side = if random.range(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
    let angle = random.range(2.0, 90.0).to_radians();
    let direction = Vec3([0.0, angle.cos(), angle.sin()]);
    let middle = Vec3([radius_of_arc + side * 0.98 * (radii[0] + radii[1]), 0.0, 0.0]);
    let parts = [-random.range(0.02, 0.04), random.range(0.02, 0.04)];
    let bar = Bar {
        ends: parts.map(|part| middle + direction * part),
        elements: random.range(1.0, 4.99) as usize,
        order: order_of_bar,
        radius: radii[1],
    };
    OnArc { radius_of_arc, arc, bar }
}

/// A scene of which one beam turns about the z axis.
struct Turning<'a> {
    model: &'a Model,
    mesh: &'a Mesh,
    stage: StageContext,
    /// Number of the beam
    beam: usize,
}

impl Turning<'_> {
    /// The largest change of the force at a node from each place of the beam to the next, where it turns in
    /// many steps.
    fn largest_change(&self, [from, to]: [f64; 2], steps: usize) -> f64 {
        let Self { model, mesh, stage, beam } = self;
        let contacts = model.contacts().unwrap();
        let effect = model.effects.iter().find(|effect| effect.name() == "contact").unwrap();
        let mut before: Option<Vec<Vec3>> = None;
        let mut largest = 0.0f64;
        for step in 0..=steps {
            let angle = from + (to - from) * step as f64 / steps as f64;
            let mut state = model.rest();
            let mut schedule = Schedule::new(model);
            let dof_map = schedule.begin_stage(model, 0, StageKind::Static, &state).unwrap();
            schedule.set_clock(model, &mut state, 0.0, 0.0);
            for &node in &mesh.beams[*beam].nodes {
                let placed = &mesh.nodes[node];
                let [x, y, z] = placed.place.0;
                let (sin, cos) = angle.sin_cos();
                state.q[placed.node.u as usize] = Vec3([cos * x - sin * y, sin * x + cos * y, z]) - placed.place;
            }
            contacts.list_pairs(&mut state);
            state.contacts.regime = ContactRegime::Penalty;
            let pairs = state.contacts.pairs.list.clone();
            let mut assembly = Assembly::of(vec![effect.clone()], stage, dof_map, model, pairs);
            assembly.evaluate(&state, Weights::NONE, None);
            let forces: Vec<Vec3> = mesh.nodes.iter().map(|node| assembly.system.total(node.node.u as usize)).collect();
            if let Some(before) = &before {
                let changes = forces.iter().zip(before).map(|(after, before)| (*after - *before).norm());
                largest = changes.fold(largest, f64::max);
            }
            before = Some(forces);
        }
        largest
    }
}

/// The largest changes of forces in 1000 and in 2000 steps on the way over two elements of an arc, of the angle
/// `element`, where a beam turns.
fn changes(scene: &Scene, beam: usize, element: f64) -> [f64; 2] {
    let stage = scene.plan.stages[0].context(0);
    let turning = Turning { model: &scene.plan.model, mesh: &scene.mesh, stage, beam };
    [1000, 2000].map(|steps| turning.largest_change([-1.1 * element, 1.1 * element], steps))
}

#[test]
fn penalties_do_not_jump_where_contacts_pass_nodes() {
    let mut random = Random::new(87);
    let mut jumps = Vec::new();
    for case in 0..40 {
        let OnArc { radius_of_arc, arc, bar } = &on_arc(&mut random);
        let text = pushed(arc, bar, Vec3::ZERO, 1).replace("name = \"c\"", "name = \"c\"\nstiffness = 1000");
        let [[ax, ay, az], [bx, by, bz]] = arc.ends.map(|end| end.0);
        let straight = format!("through = [[{ax}, {ay}, {az}], [{bx}, {by}, {bz}]]");
        let bent = format!("arc = [[{ax}, {ay}, {az}], [{radius_of_arc}, 0, 0], [{bx}, {by}, {bz}]]");
        let (scene, _) = scene::from_text(&text.replace(&straight, &bent)).unwrap();
        let [coarse, fine] = changes(&scene, 1, 1.2 / arc.elements as f64);
        println!("{case}: {coarse} {fine}, orders {} {}", arc.order, bar.order);
        if fine > 0.7 * coarse {
            jumps.push(case);
        }
    }
    // In case 38 two closest points of a cubic element merge: the distance has no curvature there.
    assert!(jumps.iter().all(|&case| case == 38), "{jumps:?}");
}

/// A surface that an arc about the z axis touches from outside or inside, and their penetration.
struct Obstacle {
    surface: String,
    penetration: f64,
}

impl Obstacle {
    fn beside(random: &mut Random, radius_of_arc: f64, radius: f64) -> Self {
        let size = random.range(0.1, 0.8) * radius_of_arc;
        let side = if random.range(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
        let tilt = random.range(30.0, 90.0).to_radians();
        let [y, z] = [tilt.cos(), tilt.sin()];
        let penetration = radius * random.range(0.005, 0.05);
        // Of an edge that points to the arc.
        let half = size / 2.0;
        let out_to = |reach: f64| radius_of_arc + side * (radius + reach - penetration);
        let [x, at_edge] = [out_to(size), out_to(1.4 * half)];
        let from_to = format!("from = [{x}, {}, {}]\nto = [{x}, {y}, {z}]", -y, -z);
        let surface = match random.range(0.0, 4.0) as usize {
            0 => format!("kind = \"cylinder\"\n{from_to}\nradius = {size}"),
            1 => format!("kind = \"capsule\"\n{from_to}\nradius = {size}"),
            2 => format!("kind = \"sphere\"\nat = [{x}, 0, 0]\nradius = {size}"),
            _ => format!(
                "kind = \"box\"\nat = [{at_edge}, {}, 0]\nhalf = [{half}, {half}, 1]\naxes = [[0.8, 0.6, 0], [-0.6, 0.8, 0]]",
                -0.2 * side * half
            ),
        };
        Self { surface, penetration }
    }
}

#[test]
fn penalties_of_surfaces_do_not_jump_where_contacts_pass_nodes() {
    let mut random = Random::new(91);
    let mut jumps = Vec::new();
    let mut touched = 0;
    for case in 0..60 {
        let radius_of_arc = random.range(0.06, 0.2);
        let radius = random.range(0.005, 0.02);
        let elements = random.range(8.0, 22.0) as usize;
        let Obstacle { surface, penetration } = Obstacle::beside(&mut random, radius_of_arc, radius);
        let [x, y] = [0.6f64.cos() * radius_of_arc, 0.6f64.sin() * radius_of_arc];
        let text = format!(
            r#"
[section.s]
EA = 200
GA = 100
GJ = 1
EI = 1
[[beam]]
name = "rope"
section = "s"
arc = [[{x}, {}, 0], [{radius_of_arc}, 0, 0], [{x}, {y}, 0]]
elements = {elements}
[[support]]
at = "rope@start"
fix = "all"
[[surface]]
name = "obstacle"
{surface}
[[contact]]
name = "c"
beams = ["rope"]
surfaces = ["obstacle"]
radius = {radius}
stiffness = 1000
[[stage]]
kind = "static"
steps = 1
[output]
nodes = ["rope@end"]
"#,
            -y
        );
        let (scene, _) = scene::from_text(&text).unwrap();
        let [coarse, fine] = changes(&scene, 0, 1.2 / elements as f64);
        touched += usize::from(coarse > 0.0);
        println!("{case}: {coarse} {fine}, {elements} elements, {penetration}\n{surface}");
        if fine > 0.7 * coarse {
            jumps.push(case);
        }
    }
    println!("{touched} touch");
    assert!(touched > 40 && jumps.is_empty(), "{jumps:?}");
}
