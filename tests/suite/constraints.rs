//! Negative pivots of tangents with multipliers against eigenvalues on the space that the constraints leave.

use crate::random::Random;
use beamsim::kernel::Weights;
use beamsim::model::{Assembly, Model, SlotKind, StageContext};
use beamsim::scene;
use beamsim::solve::{LinearSolver, Tangent};
use beamsim::system::{State, System};
use beamsim::tensor::Vec3;
use nalgebra::{DMatrix, DVector};

/// The eigenvalues on the space that the constraints leave, of unknowns that are scaled so that they compare.
fn eigenvalues_between_constraints(system: &System, model: &Model) -> DVector<f64> {
    let equations = &system.pattern.equations;
    let slot = |k: usize| equations.direction(k).slot as usize;
    let (multipliers, unknowns): (Vec<usize>, Vec<usize>) =
        (0..equations.count()).partition(|&k| model.kinds[slot(k)].is_multiplier());
    let entry = |row: usize, column: usize| {
        system.pattern.find(row as u32, column as u32).map_or(0.0, |place| system.values[place])
    };
    let scale: Vec<f64> = unknowns.iter().map(|&k| entry(k, k).abs().max(1e-300).sqrt()).collect();
    let stiffness = DMatrix::from_fn(unknowns.len(), unknowns.len(), |r, c| {
        entry(unknowns[r], unknowns[c]) / (scale[r] * scale[c])
    });
    let gaps = DMatrix::from_fn(unknowns.len(), multipliers.len(), |r, c| entry(unknowns[r], multipliers[c]) / scale[r]);
    let gaps = DMatrix::from_columns(&gaps.column_iter().map(|column| column.normalize()).collect::<Vec<_>>());
    // A projector shifts what the constraints hold away.
    let q = gaps.qr().q();
    let free = DMatrix::identity(unknowns.len(), unknowns.len()) - &q * q.transpose();
    let projected = &free * stiffness * &free + (&q * q.transpose()).scale(1e3);
    let projected = (&projected + projected.transpose()).scale(0.5);
    projected.symmetric_eigenvalues()
}

fn assembled(deck: &str) -> (Model, StageContext, Assembly) {
    let Ok((scene, _)) = scene::from_text(deck) else { panic!("the deck is good: {deck}") };
    let (mut model, stage) = (scene.plan.model, scene.plan.stages[0].context(0));
    let rest = model.rest();
    let Ok(equations) = model.begin_stage(0, stage.kind, &rest) else { panic!("the stage begins") };
    let assembly = Assembly::new(&stage, equations, &model);
    (model, stage, assembly)
}

fn count(assembly: &mut Assembly, model: &Model, state: &State) -> (Option<usize>, usize, f64) {
    assembly.evaluate(state, Weights::STIFFNESS, None);
    let eigenvalues = eigenvalues_between_constraints(&assembly.system, model);
    let nearest = eigenvalues.iter().fold(f64::INFINITY, |m, v| m.min(v.abs()));
    let mut solver = LinearSolver::new(&assembly.system, &model.multipliers).unwrap();
    let told = solver.negative_pivots(&mut Tangent::that_may_go(assembly, state, Weights::STIFFNESS));
    (told, eigenvalues.iter().filter(|&&value| value < 0.0).count(), nearest)
}

#[test]
fn debug_stub() {
    let text = std::fs::read_to_string("/work/shared/faults/stability/column_with_stub.toml").unwrap();
    let (model, _, mut assembly) = assembled(&text);
    let mut random = Random::new(3);
    for k in 0..10 {
        let mut state = model.rest();
        if k > 0 {
            for (slot, kind) in model.kinds.iter().enumerate() {
                let size = if kind.is_multiplier() { 0.0 } else { 1e-9 };
                state.q[slot] = if *kind == SlotKind::Rotation || kind.is_multiplier() || true { random.vector(size) } else { Vec3::ZERO };
            }
        }
        println!("{:?}", count(&mut assembly, &model, &state));
    }
}
#[test]
fn debug_dump() {
    let text = std::fs::read_to_string("/work/shared/faults/stability/column_with_stub.toml").unwrap();
    let (model, _, mut assembly) = assembled(&text);
    let mut random = Random::new(3);
    let mut state = model.rest();
    for k in 0..4 {
        if k > 0 { for slot in 0..model.kinds.len() { state.q[slot] = random.vector(1e-9); if model.kinds[slot].is_multiplier() { state.q[slot] = Vec3::ZERO; } } }
    assembly.evaluate(&state, Weights::STIFFNESS, None);
    let system = &assembly.system;
    let n = system.pattern.equations.count();
    use std::io::Write;
    let mut f = std::fs::File::create(format!("/tmp/w/dump{k}.txt")).unwrap();
    for r in 0..n {
        let d = system.pattern.equations.direction(r);
        write!(f, "{} {:?}", d.slot, model.kinds[d.slot as usize]).unwrap();
        for c in 0..n {
            let v = system.pattern.find(r as u32, c as u32).map_or(0.0, |p| system.values[p]);
            write!(f, " {v:e}").unwrap();
        }
        writeln!(f).unwrap();
    }
    println!("{:?}", count(&mut assembly, &model, &state));
    }
}
