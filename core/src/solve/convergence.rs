//! Stop test of Newton's iteration, independent of units.

use crate::effect::RoundOff;
use crate::model::{Model, SlotKind};
use crate::system::{DofMap, Plane, Region, Slot, System};
use crate::tensor::Vec3;
use crate::threads;

/// Tolerance of the stop test.
///
/// A state has converged if every translational residual is below `tolerance` F and every
/// rotational one below `tolerance` F l, or at its round-off floor; F is the largest nodal force,
/// or moment over l, among internal, external, inertia and support forces, and l the length of the
/// scene. A last correction below 1e-12 in |du|/l and |dpsi| ends the iteration, too.
#[derive(Clone, Copy, Debug)]
pub struct Convergence {
    /// Largest residual relative to the largest force, see [`Convergence`]
    pub tolerance: f64,
    /// Residual forces (and moments) up to this are none
    pub negligible: f64,
}

/// Correction below which the iteration ends: displacements relative to the length of the scene,
/// rotations in radians.
const NEGLIGIBLE_CORRECTION: f64 = 1e-12;

/// Tolerance of constraint gaps relative to that of forces. Translational gaps are relative to the
/// length of the scene, rotational ones in radians.
const RELATIVE_GAP_TOLERANCE: f64 = 1e-2;

/// A nodal force is a sum of a few products; its round-off is this many times that of one product.
const ROUND_OFF_FACTOR: f64 = 4.0;

/// Largest residual, relative to its tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Size of the residual over its tolerance
    pub(crate) ratio: f64,
    /// Slot of the residual
    pub(crate) slot: Slot,
    /// Free component of the residual at the slot (global components): a force, or a moment
    /// conjugate to the rotation vector
    pub(crate) value: Vec3,
    /// Force F that the tolerance refers to
    pub(crate) force: f64,
    /// True if some residual is tolerated for its round-off only
    noisy: bool,
}

/// Verdict of the stop test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// The state is an equilibrium.
    Converged,
    /// The residual is within its round-off, while the last correction is not small.
    Noisy,
    /// The residual exceeds its tolerance.
    Continue,
    /// A force is not finite.
    NotFinite,
}

/// Verdict of the stop test with the residual that it is based on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Verdict
    pub(crate) verdict: Verdict,
    /// Largest residual, relative to its tolerance
    pub(crate) residual: Residual,
}

impl Convergence {
    /// Judges the forces of `system` and the [`size`] of the last correction: `None` before the
    /// first, infinite if charts have changed since.
    pub fn judge(&self, model: &Model, system: &System, round_off: RoundOff, last: Option<f64>) -> Judgement {
        let residual = self.residual(model, system, round_off);
        if !(residual.ratio.is_finite() && residual.force.is_finite()) {
            return Judgement { verdict: Verdict::NotFinite, residual };
        }
        let small = last.is_some_and(|size| size <= NEGLIGIBLE_CORRECTION);
        let verdict = if small {
            Verdict::Converged
        } else if residual.ratio > 1.0 {
            Verdict::Continue
        } else if residual.noisy {
            Verdict::Noisy
        } else {
            Verdict::Converged
        };
        Judgement { verdict, residual }
    }

    fn residual(&self, model: &Model, system: &System, round_off: RoundOff) -> Residual {
        let squares = Peaks::of(model, system, Vec3::squared);
        let peaks = match squares.largest() {
            // Squares have neither overflowed nor lost relevant digits to underflow.
            1e-280..=1e280 if squares.poison == 0.0 => squares.map(f64::sqrt),
            _ => Peaks::of(model, system, Vec3::size),
        };
        let force = larger(peaks.force, peaks.moment / model.length);
        let mut worst = Residual { ratio: 0.0, slot: 0, value: Vec3::ZERO, force, noisy: false };
        if peaks.poison != 0.0 {
            return Residual { ratio: f64::NAN, ..worst };
        }
        for (kind, peak) in SlotKind::ALL.into_iter().zip(peaks.residuals) {
            let tolerated = match kind {
                SlotKind::Force => RELATIVE_GAP_TOLERANCE * self.tolerance * model.length,
                SlotKind::Moment => RELATIVE_GAP_TOLERANCE * self.tolerance,
                SlotKind::Displacement | SlotKind::Sliding => self.tolerance * force,
                SlotKind::Rotation => self.tolerance * force * model.length,
            };
            let allowed = match kind {
                SlotKind::Force | SlotKind::Moment => tolerated,
                SlotKind::Displacement | SlotKind::Sliding => tolerated.max(ROUND_OFF_FACTOR * round_off.force),
                SlotKind::Rotation => tolerated.max(ROUND_OFF_FACTOR * round_off.moment),
            };
            let allowed = allowed.max(self.negligible);
            worst.noisy |= peak.size > tolerated;
            let ratio = if peak.size == 0.0 { 0.0 } else { peak.size / allowed };
            if ratio > worst.ratio {
                let value = free_part(&system.pattern.dof_map, peak.slot, system.total(peak.slot as usize));
                worst = Residual { ratio, slot: peak.slot, value, ..worst };
            }
        }
        worst
    }
}

/// Largest of some vectors, and its slot.
#[derive(Clone, Copy, Debug, Default)]
struct Peak {
    size: f64,
    slot: Slot,
}

/// Largest forces and residuals.
#[derive(Clone, Copy, Debug, Default)]
struct Peaks {
    /// Largest nodal force, and largest moment, among all categories and constraint forces
    force: f64,
    moment: f64,
    /// Largest free residual for each [`SlotKind`]
    residuals: [Peak; SlotKind::ALL.len()],
    /// Zero; NaN if some value is not finite, which maxima may ignore
    poison: f64,
}

impl Peaks {
    /// Peaks of all slots, with vectors measured by `measure`.
    fn of(model: &Model, system: &System, measure: impl Fn(Vec3) -> f64 + Copy + Send + Sync) -> Self {
        let mut all: Option<Self> = None;
        let of_region = |region| Self::among(region, model, system, measure);
        let add = |own| all = Some(all.map_or(own, |all| all.or(own)));
        threads::in_order(system.pattern.regions.iter(), of_region, add);
        // There is at least one region.
        all.unwrap_or_default()
    }

    /// Peaks of the slots of a region.
    fn among(region: &Region, model: &Model, system: &System, measure: impl Fn(Vec3) -> f64 + Copy) -> Self {
        let slots = region.slots.clone();
        let dof_map = &system.pattern.dof_map;
        // In a tilted plane, vectors have round-off out of the plane.
        let tilted = dof_map.plane().is_some_and(Plane::is_tilted);
        let mut forces = [0.0; SlotKind::ALL.len()];
        let mut residuals = [Peak::default(); SlotKind::ALL.len()];
        let mut poison = 0.0;
        for (slot, &kind) in slots.clone().zip(&model.kinds[slots]) {
            let mut total = Vec3::ZERO;
            let mut largest = 0.0;
            let mut sum = 0.0;
            for force in system.acting_in(region) {
                let size = measure(force[slot]);
                total += force[slot];
                largest = larger(size, largest);
                sum += size;
            }
            let whole = !tilted && dof_map.is_plain(slot as Slot);
            let free = if whole { total } else { free_part(dof_map, slot as Slot, total) };
            let held = if whole { 0.0 } else { measure(total - free) };
            let free = measure(free);
            poison += sum * 0.0;
            let kind = kind as usize;
            forces[kind] = larger(largest, larger(held, forces[kind]));
            if free > residuals[kind].size {
                residuals[kind] = Peak { size: free, slot: slot as Slot };
            }
        }
        let [force, moment] = [SlotKind::Displacement, SlotKind::Rotation].map(|kind| forces[kind as usize]);
        Self { force, moment, residuals, poison }
    }

    /// The larger peaks of two; the first of equal ones.
    fn or(self, other: Self) -> Self {
        let mut residuals = self.residuals;
        for (own, other) in residuals.iter_mut().zip(other.residuals) {
            if other.size > own.size {
                *own = other;
            }
        }
        Self {
            force: larger(other.force, self.force),
            moment: larger(other.moment, self.moment),
            residuals,
            poison: self.poison + other.poison,
        }
    }

    /// Largest of all peaks.
    fn largest(&self) -> f64 {
        self.residuals.iter().fold(larger(self.force, self.moment), |largest, peak| larger(largest, peak.size))
    }

    fn map(self, change: impl Fn(f64) -> f64) -> Self {
        let residuals = self.residuals.map(|peak| Peak { size: change(peak.size), ..peak });
        Self { force: change(self.force), moment: change(self.moment), residuals, ..self }
    }
}

/// The larger of two numbers in one instruction, unlike `f64::max`. If either is NaN the result is
/// `b`; `poison` reports this.
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Component of a force in the free directions of its slot (global components).
fn free_part(dof_map: &DofMap, slot: Slot, force: Vec3) -> Vec3 {
    force - dof_map.held_part(slot, force)
}

/// Size of a correction or another motion: the largest of rotations in radians and displacements
/// relative to the length of the scene. NaN entries are ignored.
pub fn size(model: &Model, motion: &[Vec3]) -> f64 {
    threads::largest(motion.len(), |slots| {
        let mut squares = [0.0_f64; SlotKind::ALL.len()];
        for (&kind, vector) in model.kinds[slots.clone()].iter().zip(&motion[slots]) {
            let largest = &mut squares[kind as usize];
            *largest = largest.max(vector.squared());
        }
        let [displacement, rotation, sliding] =
            [SlotKind::Displacement, SlotKind::Rotation, SlotKind::Sliding].map(|kind| squares[kind as usize].sqrt());
        rotation.max(displacement.max(sliding) / model.length)
    })
}
