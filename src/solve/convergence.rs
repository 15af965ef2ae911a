//! The stop test of Newton's iteration, in terms that do not depend on units.

use crate::effect::Noise;
use crate::model::{Model, SlotInfo, SlotKind};
use crate::system::{Equations, Slot, System};
use crate::tensor::Vec3;

/// The bounds of the test.
///
/// A state has converged when every translational residual is below `tolerance` F and every rotational one below
/// `tolerance` F l, or at its round-off floor; F is the largest nodal force, or moment over l, among internal, external,
/// inertia and support forces, and l the length of the scene. A last correction below 1e-12 in |du|/l and |dpsi| ends it too.
#[derive(Clone, Copy, Debug)]
pub struct Convergence {
    /// Relative to the largest force
    pub tolerance: f64,
}

/// Correction below which nothing more can be gained, relative to the length of the scene, and in radians.
const SMALLEST_CORRECTION: f64 = 1e-12;

/// Gaps of joints are closed more tightly than forces are balanced, relative to the scene's length and in radians.
const GAP: f64 = 1e-2;

/// Sums of a few products carry a few times the round-off of one.
const NOISE_FACTOR: f64 = 4.0;

/// The largest residual, as a multiple of what the test allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Its size over the allowed size
    pub ratio: f64,
    /// Its slot
    pub slot: Slot,
    /// The free part of the residual there: a force, or a moment conjugate to the rotation vector
    pub value: Vec3,
    /// The force F to which it is compared
    pub force: f64,
    /// Whether some residual is allowed for its round-off alone.
    pub noisy: bool,
}

/// What the test says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// In balance
    Converged,
    /// The residual is not larger than what round-off may have made of it, but the last correction was.
    Noisy,
    /// Not yet
    Continue,
    /// A force is not finite.
    NotFinite,
}

impl Convergence {
    /// Judges the forces of `system`, and the last correction where there was one.
    pub fn judge(&self, model: &Model, system: &System, noise: Noise, dq: Option<&[Vec3]>) -> (Verdict, Residual) {
        let residual = self.residual(model, system, noise);
        if !(residual.ratio.is_finite() && residual.force.is_finite()) {
            return (Verdict::NotFinite, residual);
        }
        let small = dq.is_some_and(|dq| correction(model, dq) <= SMALLEST_CORRECTION);
        let verdict = match residual.ratio {
            _ if small => Verdict::Converged,
            ratio if ratio > 1.0 => Verdict::Continue,
            _ if residual.noisy => Verdict::Noisy,
            _ => Verdict::Converged,
        };
        (verdict, residual)
    }

    fn residual(&self, model: &Model, system: &System, noise: Noise) -> Residual {
        let force = largest_force(model, system);
        let mut worst = Residual { ratio: 0.0, slot: 0, value: Vec3::ZERO, force, noisy: false };
        for (slot, info) in model.slots.iter().enumerate() {
            let value = free_part(&system.pattern.equations, slot as Slot, system.total(slot));
            let noise = if info.kind == SlotKind::Rotation { noise.moment } else { noise.force };
            let tolerated = match info.kind {
                SlotKind::Force => GAP * self.tolerance * model.length,
                SlotKind::Moment => GAP * self.tolerance,
                _ => self.tolerance * force * info.arm(model.length),
            };
            let allowed = if info.is_multiplier() { tolerated } else { tolerated.max(NOISE_FACTOR * noise) };
            let size = value.size();
            worst.noisy |= size > tolerated;
            let ratio = if size == 0.0 { 0.0 } else { size / allowed };
            // NaN compares with nothing, so it is let in by hand.
            if ratio > worst.ratio || ratio.is_nan() {
                worst = Residual { ratio, slot: slot as Slot, value, ..worst };
            }
        }
        worst
    }
}

/// F: the largest nodal force, or moment over the length, among all categories and what constraints hold.
fn largest_force(model: &Model, system: &System) -> f64 {
    let mut largest = 0.0_f64;
    for (slot, info) in model.slots.iter().enumerate().filter(|(_, info)| !info.is_multiplier()) {
        let total = system.total(slot);
        let held = total - free_part(&system.pattern.equations, slot as Slot, total);
        let [a, b, c, d] = system.force.each_ref().map(|force| force[slot]);
        let force = largest_size([a, b, c, d, held]) / info.arm(model.length);
        if force > largest || force.is_nan() {
            largest = force;
        }
    }
    largest
}

/// The size of the largest of these; NaN if one is.
fn largest_size(forces: [Vec3; 5]) -> f64 {
    let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
    let square = forces.iter().map(|f| f.squared()).fold(0.0, larger);
    match square {
        // Neither has it overflowed, nor has anything that counts been lost.
        1e-280..=1e280 => square.sqrt(),
        _ => forces.iter().map(|f| f.size()).fold(0.0, larger),
    }
}

/// The part of a force in the free directions of its slot, in local components.
fn free_part(equations: &Equations, slot: Slot, force: Vec3) -> Vec3 {
    if equations.is_free(slot) { force } else { force - equations.held_part(slot, force) }
}

/// The largest correction, displacements over the length of the scene.
pub(super) fn correction(model: &Model, dq: &[Vec3]) -> f64 {
    let size = |(info, dq): (&SlotInfo, &Vec3)| dq.norm() * info.arm(model.length) / model.length;
    model.slots.iter().zip(dq).filter(|(info, _)| !info.is_multiplier()).map(size).fold(0.0, f64::max)
}

/// The inner product of two corrections, displacements over the length of the scene.
pub(super) fn weighted(model: &Model, a: &[Vec3], b: &[Vec3]) -> f64 {
    let weight = |info: &SlotInfo| (info.arm(model.length) / model.length).powi(2);
    let slots = model.slots.iter().zip(a.iter().zip(b)).filter(|(info, _)| !info.is_multiplier());
    slots.map(|(info, (a, b))| a.dot(*b) * weight(info)).sum()
}
