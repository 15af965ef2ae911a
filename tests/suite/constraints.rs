//! Negative pivots of tangents with multipliers against eigenvalues on the space that the constraints leave.

use crate::random::Random;
use beamsim::scene;
use beamsim_core::kernel::Weights;
use beamsim_core::model::{Assembly, Model, Schedule, SlotKind};
use beamsim_core::solve::{LinearSolver, Tangent};
use beamsim_core::system::{State, System};
use beamsim_core::tensor::Vec3;
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// The eigenvalues on the space that the constraints leave, of unknowns that are scaled so that they compare.
fn eigenvalues_between_constraints(system: &System, model: &Model) -> DVector<f64> {
    let dof_map = &system.pattern.dof_map;
    let slot = |k: usize| dof_map.direction(k).slot as usize;
    let (multipliers, unknowns): (Vec<usize>, Vec<usize>) =
        (0..dof_map.count()).partition(|&k| model.kinds[slot(k)].is_multiplier());
    let entry = |row: usize, column: usize| {
        system.pattern.find(row as u32, column as u32).map_or(0.0, |place| system.values[place])
    };
    let scale: Vec<f64> = unknowns.iter().map(|&k| entry(k, k).abs().max(1e-300).sqrt()).collect();
    let stiffness = DMatrix::from_fn(unknowns.len(), unknowns.len(), |r, c| {
        entry(unknowns[r], unknowns[c]) / (scale[r] * scale[c])
    });
    let gaps =
        DMatrix::from_fn(unknowns.len(), multipliers.len(), |r, c| entry(unknowns[r], multipliers[c]) / scale[r]);
    let gaps = DMatrix::from_columns(&gaps.column_iter().map(|column| column.normalize()).collect::<Vec<_>>());
    // A projector shifts what the constraints hold away.
    let q = gaps.qr().q();
    let free = DMatrix::identity(unknowns.len(), unknowns.len()) - &q * q.transpose();
    let projected = &free * stiffness * &free + (&q * q.transpose()).scale(1e3);
    let projected = (&projected + projected.transpose()).scale(0.5);
    projected.symmetric_eigenvalues()
}

fn assembled(deck: &str) -> (Arc<Model>, Assembly) {
    let Ok((scene, _)) = scene::from_text(deck) else { panic!("the deck is good: {deck}") };
    let (model, stage) = (scene.plan.model, scene.plan.stages[0].context(0));
    let rest = model.rest();
    let mut schedule = Schedule::new(&model);
    let Ok(dof_map) = schedule.begin_stage(&model, 0, stage.kind, &rest) else { panic!("the stage begins") };
    let assembly = Assembly::new(&stage, dof_map, &model);
    (model, assembly)
}

fn count(assembly: &mut Assembly, model: &Model, state: &State) -> (Option<usize>, usize, f64) {
    assembly.evaluate(state, Weights::STIFFNESS, None);
    let eigenvalues = eigenvalues_between_constraints(&assembly.system, model);
    let nearest = eigenvalues.iter().fold(f64::INFINITY, |m, v| m.min(v.abs()));
    let mut solver = LinearSolver::new(&assembly.system, &model.kinds, model.length).unwrap();
    let told = solver.negative_pivots(&mut Tangent::that_may_go(assembly, state, Weights::STIFFNESS));
    (told, eigenvalues.iter().filter(|&&value| value < 0.0).count(), nearest)
}

/// Bars tied by joints of all kinds, shaken anywhere: tangents with many negative eigenvalues, in every unit of length.
#[test]
fn negative_pivots_are_negative_eigenvalues_between_constraints() {
    let mut random = Random::new(17);
    let (mut judged, mut unstable, mut unknown) = (0, 0, 0);
    for kind in ["rigid", "revolute", "universal", "prismatic", "cylindrical"] {
        for unit in [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6] {
            for _ in 0..4 {
                let (deck, length) = (bars(kind, unit, &mut random), 3.0 * unit);
                let (model, mut assembly) = assembled(&deck);
                let mut state = model.rest();
                for (slot, kind) in model.kinds.iter().enumerate() {
                    let size = match kind {
                        SlotKind::Displacement | SlotKind::Sliding => 0.02 * length,
                        SlotKind::Rotation => 0.1,
                        SlotKind::Force => 1.0,
                        SlotKind::Moment => unit,
                    };
                    state.q[slot] = random.vector(size);
                }
                let (told, negative, nearest) = count(&mut assembly, &model, &state);
                // Nearer to zero round-off decides.
                if nearest > 1e-10 {
                    // Where digits are lost nothing is told, which is right, and rare.
                    assert!(told.is_none_or(|told| told == negative), "{told:?}, not {negative}\n{deck}");
                    unknown += usize::from(told.is_none());
                    judged += 1;
                    unstable += usize::from(negative > 0);
                }
            }
        }
    }
    assert!(judged > 80 && unstable > 40 && unknown < 2, "{judged} judged, {unstable} unstable, {unknown} unknown");
}

/// Bars tied by joints of all kinds, in units of length that are powers of two: digits of corrections do not depend on them, so
/// weights of multipliers do not either.
#[test]
fn corrections_have_the_same_digits_in_every_unit_of_length() {
    let correction = |kind: &str, unit: f64, seed: u64| {
        let (model, mut assembly) = assembled(&bars(kind, unit, &mut Random::new(seed)));
        let mut random = Random::new(seed);
        let mut state = model.rest();
        let dimension = |kind: SlotKind| match kind {
            SlotKind::Displacement | SlotKind::Sliding | SlotKind::Moment => unit,
            SlotKind::Rotation | SlotKind::Force => 1.0,
        };
        for (q, &kind) in state.q.iter_mut().zip(model.kinds.iter()) {
            *q = random.vector(0.01 * dimension(kind));
        }
        assembly.evaluate(&state, Weights::STIFFNESS, None);
        let mut solver = LinearSolver::new(&assembly.system, &model.kinds, model.length).unwrap();
        let mut out = vec![Vec3::ZERO; model.kinds.len()];
        assert!(solver.factorise(&assembly.system) && solver.correct(&assembly.system, false, None, &mut out));
        out.iter().zip(model.kinds.iter()).map(|(u, &kind)| u.0.map(|u| u / dimension(kind))).collect::<Vec<_>>()
    };
    for (seed, kind) in (0..).zip(["rigid", "revolute", "universal", "prismatic", "cylindrical"]) {
        let plain = correction(kind, 1.0, seed);
        for exponent in [-30, -7, 13] {
            let other = correction(kind, 2f64.powi(exponent), seed);
            assert_eq!(other, plain, "{kind}, unit 2^{exponent}");
        }
    }
}

/// A clamped bar, a second and a third one on joints of a kind, skew in space; the last hangs on its joint alone, or is tied to ground.
fn bars(kind: &str, unit: f64, random: &mut Random) -> String {
    let mut points = vec![Vec3::ZERO];
    for _ in 0..3 {
        let next = *points.last().unwrap() + random.vector(unit);
        points.push(next);
    }
    let point = |k: usize| format!("p{k} = {:?}\n", points[k].0);
    let axis = |v: Vec3| format!("{:?}", v.0);
    let (a, b) = (random.direction(), random.direction());
    let b = (b - a * a.dot(b)).normalized().unwrap();
    let axes = match kind {
        "universal" => format!("axes = [{}, {}]", axis(a), axis(b)),
        "rigid" => String::new(),
        _ => format!("axis = {}", axis(a)),
    };
    let free = matches!(kind, "revolute" | "prismatic");
    let spring = if free {
        format!("stiffness = {}", if kind == "revolute" { unit } else { 1.0 / unit })
    } else {
        String::new()
    };
    let beams = (0..3).map(|k| {
        format!(
            "[[beam]]\nname = \"b{k}\"\nsection = \"s\"\nthrough = [\"p{k}\", \"p{}\"]\nelements = 2\norder = 2\n",
            k + 1
        )
    });
    let joints = (1..3).map(|k| {
        format!("[[joint]]\nkind = \"{kind}\"\nat = \"p{k}\"\nbeams = [\"b{}\", \"b{k}\"]\n{axes}\n{spring}\n", k - 1)
    });
    let tied = if random.range(0.0, 1.0) < 0.5 { "[[support]]\nat = \"p3\"\nfix = \"pin\"\n" } else { "" };
    let section =
        format!("[section.s]\nEA = 1e4\nGA = 4e3\nGJ = {0}\nEI = [{1}, {0}]\n", unit * unit, 2.0 * unit * unit);
    format!(
        "[point]\n{}{section}{}{}{tied}[[support]]\nat = \"p0\"\nfix = \"all\"\n[[load]]\nat = \"p3\"\nforce = [0, 0, 1]\n\
         [[stage]]\nkind = \"static\"\nsteps = 1\n",
        (0..4).map(point).collect::<String>(),
        beams.collect::<String>(),
        joints.collect::<String>()
    )
}
