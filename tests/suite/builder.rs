//! Models built without a deck.

use beamsim_core::model::{Amplitude, Model, ModelBuilder, MotionKind, SectionMatrices, StageSet, StraightBeam};
use beamsim_core::run::{Plan, Run, Snapshot, Stage};
use beamsim_core::system::Slot;
use beamsim_core::tensor::Vec3;

/// Displacements at the end of a static stage with one load level.
fn displacements(model: Model, slots: &[Slot]) -> Vec<Vec3> {
    let mut found = Vec::new();
    let mut watch = |at: &Snapshot| {
        found = slots.iter().map(|&slot| at.state.q[slot as usize]).collect();
        Ok(())
    };
    let (result, _) = Run::new(Plan::new(model, vec![Stage::statics(1)]), &mut watch).finish();
    result.unwrap();
    found
}

/// Two springs in series: to ground, and between two nodes.
#[test]
fn springs_in_series_give_way_as_their_sum() {
    let (to_ground, between, force) = (40.0, 10.0, 2.0);
    let mut builder = ModelBuilder::new();
    let nodes = [builder.node("a", Vec3::ZERO), builder.node("b", Vec3::UNIT[0])];
    for node in nodes {
        builder.support(node, [false, true, true, true, true, true]).unwrap();
    }
    builder.ground_spring(nodes[0], [to_ground, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    builder.spring(nodes, between).unwrap();
    builder.force(nodes[1], Vec3([force, 0.0, 0.0])).unwrap();
    let slots = nodes.map(|node| builder.slots(node).unwrap().u);
    let found = displacements(builder.build().unwrap(), &slots);
    let exact = [force / to_ground, force / to_ground + force / between];
    for (found, exact) in found.iter().zip(exact) {
        // Linear along the line of the springs: round-off alone.
        assert!((found.0[0] - exact).abs() <= 1e-14, "{found:?} for {exact}");
    }
}

/// A cantilever with mass whose tip is moved sideways by a little.
#[test]
fn sections_bring_mass_and_motions_move() {
    let (length, mass, aside) = (2.0, 3.0, 1e-3);
    let mut builder = ModelBuilder::new();
    let ends = [builder.node("root", Vec3::ZERO), builder.node("tip", Vec3([length, 0.0, 0.0]))];
    let section = SectionMatrices::diagonal([1e4, 1e4, 1e4, 1e2, 1e2, 1e2]).with_mass(mass, [0.0; 3]);
    builder.beam(StraightBeam { ends, section, axis3: Vec3::UNIT[2], elements: 3, order: 2 }).unwrap();
    builder.clamp(ends[0]).unwrap();
    let amplitude = Amplitude::of_motion(aside, None, StageSet::default());
    builder.motion(ends[1], MotionKind::Translation, Vec3([0.0, 2.0, 0.0]), amplitude).unwrap();
    let tip = builder.slots(ends[1]).unwrap().u;
    let model = builder.build().unwrap();
    let sum = model.momentum(&model.rest());
    assert!((sum.mass - mass * length).abs() <= 1e-14, "{}", sum.mass);
    assert!((sum.moment - Vec3([0.5 * mass * length * length, 0.0, 0.0])).norm() <= 1e-14, "{:?}", sum.moment);
    assert_eq!(displacements(model, &[tip])[0].0[1], aside);
}
