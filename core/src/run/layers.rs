//! Bending that elements are too long for.
//!
//! Under a tension N the bending beside clamps, point forces and joints decays over the length
//! sqrt(B/N), with the bending stiffness B. Elements that are much longer give bending moments that
//! jump from point to point, and are wrong where they are largest. Meshes of such elements hardly
//! differ from each other.

use super::stage_run::StageRun;
use crate::effect::Bending;
use crate::model::{Model, SlotKind};
use crate::system::Node;
use crate::tensor::Vec3;
use crate::warning::WarningKind;

/// The distance between integration points over the length of decay from which on bending is not
/// resolved.
const UNRESOLVED: f64 = 10.0;

/// The length of elements that resolve bending, over the length of decay.
const RESOLVING: f64 = 4.0;

/// The change of the bending moment between neighbouring points, over the largest moment of the
/// beam, from which on it is told.
const TOLD_CHANGE: f64 = 0.25;

/// The part of bending in the energy of a mode from which on its bending matters.
const TOLD_ENERGY: f64 = 0.05;

/// The largest bend, in radians over the length that an integration point stands for, that is none.
const NO_BEND: f64 = 1e-6;

impl Bending {
    /// The part of a moment that bends.
    fn across(&self, moment: Vec3) -> Vec3 {
        moment - self.tangent * moment.dot(self.tangent)
    }

    /// Twice the energy of its bending.
    fn energy(&self) -> f64 {
        let across = self.across(self.moment);
        let Some(axis) = across.normalized() else { return 0.0 };
        across.squared() / axis.dot(self.stiffness * axis) * self.length
    }

    /// True if another point follows it in its element or beam.
    fn is_before(&self, next: &Self) -> bool {
        self.element == next.element || self.ends[1] == next.ends[0]
    }

    /// The length over which its bending decays; `None` without tension or bending.
    fn decay(&self) -> Option<f64> {
        let axis = self.across(self.moment).normalized()?;
        (self.tension > 0.0).then(|| (axis.dot(self.stiffness * axis) / self.tension).sqrt())
    }

    /// True if bending about the softest axis would not be resolved.
    pub(super) fn may_be_unresolved(&self) -> bool {
        let axis = if self.tangent.0[0].abs() < 0.9 { Vec3::UNIT[0] } else { Vec3::UNIT[1] };
        let a = self.tangent.cross(axis).normalized().unwrap_or(axis);
        let b = self.tangent.cross(a);
        let [aa, ab, bb] = [(a, a), (a, b), (b, b)].map(|(x, y)| x.dot(self.stiffness * y));
        let softest = 0.5 * (aa + bb) - (0.25 * (aa - bb) * (aa - bb) + ab * ab).sqrt();
        self.tension > 0.0 && self.length > UNRESOLVED * (softest.max(0.0) / self.tension).sqrt()
    }
}

/// A place at which bending is not resolved.
#[derive(Clone, Copy)]
pub(super) struct Unresolved {
    /// The node nearest to it
    node: Node,
    /// The length over which bending decays there
    decay: f64,
    /// The distance of integration points
    spacing: f64,
    /// The change of the bending moment between these
    change: f64,
}

/// A look along beams for the place at which bending is resolved least.
#[derive(Default)]
pub(super) struct Look {
    /// The point before
    last: Option<Bending>,
    /// The largest bending moment of the beam so far
    largest: f64,
    /// True if the beam bends by more than round-off
    bends: bool,
    /// The place of the beam with the largest change of the moment between points that are too far apart
    worst: Option<Unresolved>,
    /// The worst place of all beams before
    told: Option<Unresolved>,
    /// Twice the energy of bending
    energy: f64,
}

impl Look {
    /// Looks at the next point; points of an element follow each other, and so do elements of a beam.
    pub(super) fn take(&mut self, point: Bending) {
        if self.last.is_some_and(|last| !last.is_before(&point)) {
            self.end_beam();
        }
        let size = point.across(point.moment).norm();
        self.energy += point.energy();
        self.largest = self.largest.max(size);
        self.bends |= size * point.length > NO_BEND * point.stiffness.max_abs();
        let last = self.last.replace(point);
        let neighbour = last.filter(|last| last.is_before(&point));
        let Some((last, decay)) = neighbour.and_then(|last| Some((last, longer(last.decay(), point.decay())?))) else {
            return;
        };
        let spacing = 0.5 * (last.length + point.length);
        let change = point.across(point.moment - last.moment).norm();
        if spacing > UNRESOLVED * decay && self.worst.is_none_or(|worst| change > worst.change) {
            self.worst = Some(Unresolved { node: last.ends[1], decay, spacing, change });
        }
    }

    /// Ends a beam: nodes of the next one are others.
    fn end_beam(&mut self) {
        let Self { largest, bends, worst, .. } =
            std::mem::replace(self, Self { told: self.told, energy: self.energy, ..Self::default() });
        let told = worst.filter(|worst| bends && worst.change > TOLD_CHANGE * largest);
        self.told = self.told.into_iter().chain(told).max_by(|a, b| a.change.total_cmp(&b.change));
    }

    /// The place that is to be told.
    pub(super) fn found(mut self) -> Option<Unresolved> {
        self.end_beam();
        self.told
    }
}

/// The longer of two lengths of decay; `None` if both are.
fn longer(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.into_iter().chain(b).reduce(f64::max)
}

impl Unresolved {
    /// The message about it, for a `subject` such as a stage.
    fn message(&self, subject: &str, model: &Model) -> String {
        let Self { node, decay, spacing, .. } = self;
        let name = model.node_at(node.u as usize);
        let elements = RESOLVING * decay;
        format!(
            "{subject}: tension makes bending near node \"{name}\" decay over {decay:.1e} (the root of bending stiffness \
             over tension), but points of elements are {spacing:.1e} apart: bending is wrong there, and estimated errors \
             do not show it (use elements of about {elements:.1e} there, with `grading`)"
        )
    }
}

impl StageRun<'_> {
    /// True if bending under the tensions of the present state may decay over less than elements
    /// resolve.
    pub(super) fn may_have_layers(&self) -> bool {
        let mut may = false;
        self.assembly.each_bending(self.state, self.assembly.origin(), &mut |point| may |= point.may_be_unresolved());
        may
    }

    /// The place at which the bending that a field of increments adds to the present state is
    /// resolved least. `None` also where bending is a small part of twice the energy of the field,
    /// `energy`.
    pub(super) fn unresolved_along(&self, field: &[Vec3], energy: f64) -> Option<Unresolved> {
        let about = self.assembly.origin().unwrap_or(self.state);
        // So that no unknown is larger than one: a rotation, or a displacement over the length of the scene.
        let size = |(&change, kind): (&Vec3, &SlotKind)| match kind {
            SlotKind::Displacement | SlotKind::Sliding => change.norm() / self.model.length,
            SlotKind::Rotation | SlotKind::Force | SlotKind::Moment => change.norm(),
        };
        let largest = field.iter().zip(self.model.kinds.iter()).map(size).fold(0.0, f64::max);
        if largest == 0.0 {
            return None;
        }
        let mut moved = about.clone();
        moved.q.iter_mut().zip(field).for_each(|(q, &change)| *q += change * (1.0 / largest));
        let mut points = Vec::new();
        self.assembly.each_bending(about, Some(about), &mut |point| points.push(point));
        let mut points = points.into_iter();
        let mut look = Look::default();
        self.assembly.each_bending(&moved, Some(about), &mut |with| {
            if let Some(point) = points.next() {
                look.take(Bending { moment: with.moment - point.moment, ..point });
            }
        });
        let matters = look.energy * largest * largest > TOLD_ENERGY * energy;
        look.found().filter(|_| matters)
    }

    /// Warns of bending that decays over less than elements resolve, once in a run.
    pub(super) fn warn_of_layers(&mut self) {
        if self.issued.layers {
            return;
        }
        let mut look = Look::default();
        self.assembly.each_bending(self.state, self.assembly.origin(), &mut |point| look.take(point));
        if let Some(place) = look.found() {
            self.warn_of_layer(&place, &format!("stage {}", self.number + 1));
        }
    }

    /// Warns of a place at which bending of a `subject` is not resolved.
    pub(super) fn warn_of_layer(&mut self, place: &Unresolved, subject: &str) {
        self.issued.layers = true;
        self.warn(WarningKind::CoarseLayer, place.message(subject, self.model));
    }
}
