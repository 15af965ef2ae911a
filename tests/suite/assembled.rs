//! The assembled tangent of whole scenes against differences of their assembled forces: what dual numbers do not reach, such
//! as dampers, wound springs and effects over increments.

use crate::random::Random;
use beamsim::scene;
use beamsim_core::integrate::{Increments, Method, Scheme, Step};
use beamsim_core::kernel::Weights;
use beamsim_core::model::{Assembly, Model, Schedule, StageKind, charts};
use beamsim_core::system::{ContactRegime, State};
use std::sync::Arc;

const SECTION: &str = r#"
[point]
root = [0, 0, 0]
knee = [1, 0.2, 0]
tip = [1.4, 1, 0.3]
away = [2, 1, 1]
[section.s]
EA = 40
GA = [30, 25]
GJ = 6
EI = [7, 5]
rhoA = 1.3
rhoJ = [0.4, 0.3, 0.2]
[[support]]
at = "root"
fix = "pin"
[[stage]]
kind = "dynamic"
end = 1
step = 0.1
"#;

fn beams(interpolation: &str, order: usize) -> String {
    let beam = |name: &str, ends: &str| {
        format!(
            "[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = [{ends}]\nelements = 1\norder = {order}\n\
             interpolation = \"{interpolation}\"\nfree_strain = [0.1, 0, 0, 0.2, 0.1, 0]\n"
        )
    };
    beam("a", "\"root\", \"knee\"") + &beam("b", "\"knee\", \"tip\"")
}

/// Everything that acts.
const EXTRAS: &str = r#"
[damping]
mass = 0.3
stiffness = 0.2
[[joint]]
kind = "revolute"
at = "knee"
beams = ["a", "b"]
axis = [0.2, 0.1, 1]
stiffness = 3
damping = 0.7
[[spring]]
at = "tip"
stiffness = [3, 2, 1, 0.4, 0.5, 0.6]
damping = [0.3, 0.2, 0.1, 0.4, 0.2, 0.3]
[[spring]]
between = ["root", "tip"]
stiffness = 2
damping = 0.4
length = 1
[[body]]
at = "tip"
mass = 2
inertia = [0.3, 0.4, 0.5]
offset = [0.1, -0.2, 0.1]
[[body]]
at = "away"
mass = 1
inertia = [0.2, 0.3, 0.1]
[[joint]]
kind = "rigid"
nodes = ["tip", "away"]
[[load]]
at = "tip"
force = [1, 2, 3]
moment = [0.4, 0.2, 0.1]
frame = "body"
[[load]]
at = "tip"
moment = [0.1, 0.3, 0.2]
"#;

fn scene_of(text: &str) -> (Arc<Model>, State, Assembly) {
    let (scene, _) = scene::from_text(text).unwrap_or_else(|e| panic!("{e:?}\n{text}"));
    let model = scene.plan.model;
    let mut state = model.rest();
    let mut schedule = Schedule::new(&model);
    let dof_map = schedule.begin_stage(&model, 0, StageKind::Dynamic, &state).unwrap();
    let assembly = Assembly::new(&scene.plan.stages[0].context(0), dof_map, &model);
    schedule.set_clock(&model, &mut state, 0.3, 1.0);
    (model, state, assembly)
}

fn scatter(assembly: &Assembly, x: &[f64], field: &mut [beamsim_core::tensor::Vec3], factor: f64) {
    let mut whole = vec![beamsim_core::tensor::Vec3::ZERO; field.len()];
    assembly.system.pattern.dof_map.scatter(x, None, &mut whole);
    field.iter_mut().zip(whole).for_each(|(f, w)| *f += w * factor);
}

fn correct(assembly: &Assembly, step: &Step, x: &[f64], state: &mut State, factor: f64) {
    let mut dq = vec![beamsim_core::tensor::Vec3::ZERO; state.q.len()];
    scatter(assembly, x, &mut dq, factor);
    step.correct(state, &dq);
}

fn forces(assembly: &mut Assembly, state: &State, count: usize) -> Vec<f64> {
    assembly.evaluate(state, Weights::NONE, None);
    let mut out = vec![0.0; count];
    assembly.system.right_hand_side(&mut out);
    out.iter().map(|v| -v).collect()
}

/// Surfaces around beams and bodies, and one that a body carries.
const SURFACES: &str = r#"
[[surface]]
name = "shell"
kind = "torus"
at = [0.7, 0.5, 0]
axis = [0.1, 0.2, 1]
ring = 0.9
radius = 0.2
side = "inside"
[[surface]]
name = "ball"
kind = "sphere"
at = [2, 1, 1]
radius = 1.3
side = "inside"
on = "away"
[[surface]]
name = "roller"
kind = "cylinder"
from = [0, 0, 0.2]
to = [1, 0.1, 0.3]
radius = 0.3
rotate = [0, 1, 0]
about = [0, 0, 0]
angle = 0.4
history = "turn"
"#;

const CONTACT: &str = r#"
[[contact]]
name = "rough"
beams = ["a", "b"]
nodes = ["tip"]
surfaces = ["shell", "ball", "roller"]
radius = { a = 0.1, b = 0.15, tip = 0.2 }
stiffness = 5
friction = 0.3
damping = 0.1
[history.turn]
expr = "2*t"
"#;

/// Planes in their place, over which no contact point has a part of a force: tangents leave out how parts change.
fn planes() -> String {
    let planes = [
        ("shell", "point = [0, 0, 0.1]\nnormal = [0.1, 0.2, 1]\n"),
        ("ball", "point = [0.5, 0.5, 0]\nnormal = [0.3, -1, 0.2]\non = \"away\"\n"),
        (
            "roller",
            "point = [0.4, 0, 0]\nnormal = [1, 0.1, 0.2]\nrotate = [0, 1, 0]\nabout = [0, 0, 0]\nangle = 0.4\nhistory = \"turn\"\n",
        ),
    ];
    let tables = planes.map(|(name, keys)| format!("[[surface]]\nname = \"{name}\"\nkind = \"plane\"\n{keys}"));
    tables.concat()
}

fn tangent_holds(text: &str, incremental: bool, seed: u64) {
    tangent_holds_in(ContactRegime::Penalty, text, incremental, seed);
}

fn tangent_holds_in(regime: ContactRegime, text: &str, incremental: bool, seed: u64) {
    let mut random = Random::new(seed);
    let (model, mut state, mut assembly) = scene_of(text);
    let count = assembly.system.pattern.dof_map.count();
    let numbers =
        |random: &mut Random, half: f64| -> Vec<f64> { (0..count).map(|_| random.range(-half, half)).collect() };
    // Somewhere, moving, and wound as the rotations are.
    for (field, size) in [(0, 0.4), (1, 1.0), (2, 1.0)] {
        let x = numbers(&mut random, size);
        let field = [&mut state.q[..], &mut state.v[..], &mut state.a[..]].into_iter().nth(field).unwrap();
        scatter(&assembly, &x, field, 1.0);
    }
    assert!(state.unwrapped.is_empty(), "rotations that no chart has changed are unwrapped as they are");
    charts::freeze(&mut state, &model.charted(StageKind::Dynamic).elements);
    if let Some(contacts) = model.contacts() {
        // Tractions and places of an earlier state, in which things touched.
        state.contacts.regime = regime;
        let before = model.rest();
        contacts.accept(&before, &mut state);
        scatter(&assembly, &numbers(&mut random, 0.05), &mut state.q, 1.0);
        assert!(state.contacts.touches());
    }
    // Over increments, accelerations and velocities of rotations are functions of the unknown of the step.
    let step = Step { scheme: Scheme::lie_generalized_alpha(0.6), length: 0.8 };
    let combinations = if incremental {
        let increments = Increments::new(&model, StageKind::Dynamic, &assembly.system.pattern.dof_map);
        step.scheme.start(&mut state, step.length, None);
        increments.start(&mut state, None);
        increments.begin(&mut state, &step, 0.5);
        step.predict(&mut state, 0.5);
        correct(&assembly, &step, &numbers(&mut random, 0.3), &mut state, 1.0);
        vec![step.weights()]
    } else {
        vec![Weights::STIFFNESS, Weights::DAMPING, Weights { stiffness: 1.0, damping: 2.0, mass: 3.0 }]
    };
    for weights in combinations {
        let x = numbers(&mut random, 1.0);
        assembly.evaluate(&state, weights, None);
        let values = assembly.system.values.clone();
        let got = assembly.system.multiply(&values, &x);
        let h = 1e-5;
        let mut moved = |side: f64| {
            let mut there = state.clone();
            if incremental {
                correct(&assembly, &step, &x, &mut there, side * h);
            } else {
                scatter(&assembly, &x, &mut there.q, side * h * weights.stiffness);
                scatter(&assembly, &x, &mut there.v, side * h * weights.damping);
                scatter(&assembly, &x, &mut there.a, side * h * weights.mass);
            }
            forces(&mut assembly, &there, count)
        };
        let (after, before) = (moved(1.0), moved(-1.0));
        let exact: Vec<f64> = after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        let scale = exact.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for k in 0..count {
            let direction = assembly.system.pattern.dof_map.direction(k);
            let slot = direction.slot as usize;
            assert!(
                (got[k] - exact[k]).abs() <= 1e-8 * scale,
                "{weights:?}, {} {:?}: {} instead of {} where {scale} is the largest",
                model.node_at(slot),
                model.kinds[slot],
                got[k],
                exact[k]
            );
        }
    }
}

#[test]
fn everything_together_over_total_vectors() {
    for order in 1..=3 {
        tangent_holds(&(beams("total", order) + SECTION + EXTRAS), false, 31 + order as u64);
    }
}

#[test]
fn everything_together_with_relative_beams() {
    for order in 1..=3 {
        tangent_holds(&(beams("relative", order) + SECTION + EXTRAS), false, 41 + order as u64);
    }
}

#[test]
fn everything_together_over_increments() {
    let lie = SECTION.replace("step = 0.1", "step = 0.1\nscheme = \"lie_generalized_alpha\"");
    for order in 1..=3 {
        tangent_holds(&(beams("relative", order) + &lie + EXTRAS), true, 51 + order as u64);
    }
}

#[test]
fn contacts_over_total_vectors() {
    for order in 1..=3 {
        let beams = beams("relative", order) + SECTION + EXTRAS;
        // States in which no point opens or begins to slide within the differences.
        tangent_holds_in(ContactRegime::Augmented, &(beams.clone() + SURFACES + CONTACT), false, 62 + order as u64);
        tangent_holds(&(beams + &planes() + CONTACT), false, 61 + order as u64);
    }
}

#[test]
fn contacts_over_increments() {
    let lie = SECTION.replace("step = 0.1", "step = 0.1\nscheme = \"lie_generalized_alpha\"");
    for order in 1..=3 {
        let beams = beams("relative", order) + &lie + EXTRAS;
        tangent_holds_in(ContactRegime::Augmented, &(beams.clone() + SURFACES + CONTACT), true, 71 + order as u64);
        tangent_holds(&(beams + &planes() + CONTACT), true, 71 + order as u64);
    }
}

#[test]
fn damping_by_strain() {
    let by_strain = "stiffness = [0.2, 0.1, 0.3, 0.05, 0.4, 0.15]\n[[joint]]";
    let extras = EXTRAS.replace("stiffness = 0.2\n[[joint]]", by_strain);
    assert_ne!(extras, EXTRAS);
    let lie = SECTION.replace("step = 0.1", "step = 0.1\nscheme = \"lie_generalized_alpha\"");
    for order in 1..=3 {
        tangent_holds(&(beams("total", order) + SECTION + &extras), false, 81 + order as u64);
        tangent_holds(&(beams("relative", order) + SECTION + &extras), false, 91 + order as u64);
        tangent_holds(&(beams("relative", order) + &lie + &extras), true, 101 + order as u64);
    }
}

/// Points with viscosities of their own, in elements of several orders: as good as equal factors damp like one factor.
#[test]
fn equal_factors_of_all_strains_are_one_factor() {
    let deck = |factors: &str| {
        let beam = |name: &str, ends: &str, order: usize, interpolation: &str| {
            format!(
                "[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = [{ends}]\nelements = 2\norder = {order}\n\
                 interpolation = \"{interpolation}\"\n"
            )
        };
        let all: String = (1..=3)
            .flat_map(|order| ["total", "relative"].map(|word| (order, word)))
            .map(|(order, word)| beam(&format!("{word}{order}"), "\"root\", \"knee\", \"tip\"", order, word))
            .collect();
        let section = SECTION.replace("fix = \"pin\"", "fix = \"all\"").replace("end = 1", "end = 0.3");
        format!(
            "{all}{section}[damping]\nstiffness = {factors}\n[[load]]\nat = \"tip\"\nforce = [1, 2, 3]\n[output]\nnodes = [\"tip\"]\n"
        )
    };
    let one = crate::scenes::simulate(&deck("0.05"));
    let six = crate::scenes::simulate(&deck("[0.05, 0.05, 0.05, 0.05, 0.05, \"0.05*(1 + 1e-12)\"]"));
    for column in ["tip.ux", "tip.uy", "tip.uz"] {
        let [one, six] = [one.end(column), six.end(column)];
        assert!((one - six).abs() < 1e-8 * one.abs(), "{column}: {one} against {six}");
    }
}
