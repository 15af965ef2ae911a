//! Angles of sections and of their fibres.

use crate::deck::diagnostic::Diagnostic;
use crate::deck::reader::{Context, Item, Table};
use std::f64::consts::TAU;

/// Relative round-off of a full turn that was computed
const ROUND_OFF: f64 = 1e-9;

/// `theta` and `beta`
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fibre {
    /// Angle of the fibre from axis 1 towards the tangent, rad
    pub(crate) theta: f64,
    /// Angle of the tangent from axis 2 towards axis 3, rad
    pub(crate) beta: f64,
}

pub fn read_fibre(table: &Table) -> Option<Fibre> {
    let theta = table.optional("theta", read_angle);
    let beta = table.optional("beta", read_angle);
    Some(Fibre { theta: theta?.unwrap_or(0.0), beta: beta?.unwrap_or(0.0) })
}

/// An angle in rad, of at most a full turn: more is usually meant in degrees.
pub fn read_angle(context: &Context, item: &Item) -> Option<f64> {
    let angle = context.number(item)?;
    if angle.value.abs() <= TAU * (1.0 + ROUND_OFF) {
        return Some(angle.value);
    }
    let message = format!("an angle of {} rad is more than a full turn", angle.value);
    let help = format!("angles are in rad: write \"{}*deg\"", angle.value);
    context.report(Diagnostic::error(message, angle.span).help(help));
    None
}
