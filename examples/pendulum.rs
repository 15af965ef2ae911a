//! A point mass on a massless arm, let go from the horizontal, built without a deck.
//!
//! A pendulum of length l that swings to an angle A from the vertical has the period 4 sqrt(l/g) K(sin(A/2)), with the complete
//! elliptic integral K(k) = pi / (2 agm(1, sqrt(1 - k^2))).

use beamsim_core::integrate::Scheme;
use beamsim_core::model::ModelBuilder;
use beamsim_core::run::{Plan, Run, Snapshot, Stage};
use beamsim_core::tensor::Vec3;
use std::error::Error;
use std::f64::consts::{FRAC_PI_2, PI};

const ARM: f64 = 0.7;
const GRAVITY: f64 = 9.81;

/// Gauss's arithmetic-geometric mean.
fn agm(mut a: f64, mut b: f64) -> f64 {
    while (a - b).abs() > 1e-15 * a {
        let mean = 0.5 * (a + b);
        b = (a * b).sqrt();
        a = mean;
    }
    a
}

/// The period for the largest angle from the vertical.
fn period(largest: f64) -> f64 {
    let cosine = (0.5 * largest).cos();
    4.0 * (ARM / GRAVITY).sqrt() * PI / (2.0 * agm(1.0, cosine))
}

/// The angle by which the arm has turned down from the horizontal at a time, computed in so many steps.
fn angle_at(time: f64, steps: usize) -> Result<f64, Box<dyn Error>> {
    let mut builder = ModelBuilder::new();
    let pivot = builder.node("pivot", Vec3::ZERO);
    builder.body(pivot, 2.0, Vec3([ARM, 0.0, 0.0]), [0.0; 3])?;
    // All but the rotation about z is held.
    builder.support(pivot, [true, true, true, true, true, false])?;
    builder.gravity(Vec3([0.0, -GRAVITY, 0.0]));
    let slots = builder.slots(pivot)?;
    let stage = Stage::dynamics(time, time / steps as f64, Scheme::generalized_alpha(1.0));
    let plan = Plan::new(builder.build()?, vec![stage]);
    let mut angle = 0.0;
    let mut watch = |at: &Snapshot| {
        angle = -at.state.q[slots.p as usize].0[2];
        Ok(())
    };
    let (result, _) = Run::new(plan, &mut watch).finish();
    result?;
    Ok(angle)
}

fn main() -> Result<(), Box<dyn Error>> {
    // After a quarter of the period the arm hangs down.
    let quarter = 0.25 * period(FRAC_PI_2);
    for steps in [50, 100, 200] {
        let error = (angle_at(quarter, steps)? - FRAC_PI_2).abs();
        println!("{steps:>4} steps: the angle after a quarter of the period errs by {error:.1e} rad");
        assert!(error < 1.0 / (steps * steps) as f64, "second order in the step");
    }
    Ok(())
}

#[test]
fn the_pendulum_keeps_its_period() -> Result<(), Box<dyn Error>> {
    main()
}
