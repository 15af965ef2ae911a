//! A cantilever that an end moment rolls up to a full circle, built without a deck.
//!
//! A moment M bends a beam of bending stiffness EI to an arc of curvature M/EI: with M = 2 pi EI/L the tip comes back to the root.

use beamsim_core::model::{ModelBuilder, SectionMatrices, StraightBeam};
use beamsim_core::run::{Plan, Run, Snapshot, Stage};
use beamsim_core::tensor::Vec3;
use std::error::Error;
use std::f64::consts::PI;

const LENGTH: f64 = 2.0;
const BENDING_STIFFNESS: f64 = 10.0;

/// The displacement of the tip under a part of the moment of a full circle.
fn tip_displacement(part: f64) -> Result<Vec3, Box<dyn Error>> {
    let mut builder = ModelBuilder::new();
    let root = builder.node("root", Vec3::ZERO);
    let tip = builder.node("tip", Vec3([LENGTH, 0.0, 0.0]));
    builder.beam(StraightBeam {
        ends: [root, tip],
        section: SectionMatrices::diagonal([1e4, 1e4, 1e4, 10.0, BENDING_STIFFNESS, BENDING_STIFFNESS]),
        axis3: Vec3::UNIT[2],
        elements: 16,
        order: 3,
    })?;
    builder.clamp(root)?;
    builder.moment(tip, Vec3([0.0, 0.0, part * 2.0 * PI * BENDING_STIFFNESS / LENGTH]))?;
    let slots = builder.slots(tip)?;
    let plan = Plan::new(builder.build()?, vec![Stage::statics(8)]);
    let mut displacement = Vec3::ZERO;
    let mut watch = |at: &Snapshot| {
        displacement = at.state.q[slots.u as usize];
        Ok(())
    };
    let (result, _) = Run::new(plan, &mut watch).finish();
    result?;
    Ok(displacement)
}

/// The same on an arc of the exact curvature.
fn exact(part: f64) -> Vec3 {
    let angle = part * 2.0 * PI;
    let radius = LENGTH / angle;
    Vec3([radius * angle.sin() - LENGTH, radius * (1.0 - angle.cos()), 0.0])
}

fn main() -> Result<(), Box<dyn Error>> {
    for part in [0.25, 0.5, 1.0] {
        let [found, exact] = [tip_displacement(part)?, exact(part)];
        let error = (found - exact).norm() / LENGTH;
        println!("{part:>5} of a circle: tip moves by {:.6?}, relative error {error:.1e}", found.0);
        assert!(error < 1e-6, "the exact displacement is {:?}", exact.0);
    }
    Ok(())
}

#[test]
fn an_end_moment_rolls_the_beam_up() -> Result<(), Box<dyn Error>> {
    main()
}
