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
/// scene, from which on it is told.
const TOLD_CHANGE: f64 = 0.25;

/// The largest bend, in radians over the length of an element, that is none.
const NO_BEND: f64 = 1e-9;

impl Bending {
    /// The bending stiffness about the axis of the bending moment; zero without a moment.
    fn against_bending(&self) -> f64 {
        let across = self.moment - self.tangent * self.moment.dot(self.tangent);
        across.normalized().map_or(0.0, |axis| axis.dot(self.stiffness * axis))
    }

    /// The length over which bending of some stiffness decays; infinite without tension.
    fn decay(&self, stiffness: f64) -> f64 {
        if self.tension > 0.0 { (stiffness / self.tension).sqrt() } else { f64::INFINITY }
    }

    /// True if bending about the softest axis would not be resolved.
    pub(super) fn may_be_unresolved(&self) -> bool {
        let axis = if self.tangent.0[0].abs() < 0.9 { Vec3::UNIT[0] } else { Vec3::UNIT[1] };
        let a = self.tangent.cross(axis).normalized().unwrap_or(axis);
        let b = self.tangent.cross(a);
        let [aa, ab, bb] = [(a, a), (a, b), (b, b)].map(|(x, y)| x.dot(self.stiffness * y));
        let softest = 0.5 * (aa + bb) - (0.25 * (aa - bb) * (aa - bb) + ab * ab).sqrt();
        self.length > UNRESOLVED * self.decay(softest.max(0.0))
    }
}

/// A place at which bending is not resolved.
pub(super) struct Unresolved {
    /// The node nearest to it
    node: Node,
    /// The length over which bending decays there
    decay: f64,
    /// The distance of integration points
    spacing: f64,
    /// The change of the moment between these
    change: f64,
}

impl Unresolved {
    /// The place with the largest change of the moment; `points` stand element by element.
    pub(super) fn worst(points: &[Bending]) -> Option<Self> {
        let largest = points.iter().map(|point| point.moment.norm()).fold(0.0, f64::max);
        let bends = points.iter().any(|point| point.moment.norm() * point.length > NO_BEND * point.against_bending());
        if !bends {
            return None;
        }
        let pairs = points.windows(2).filter(|pair| pair[0].ends[1] == pair[1].ends[0] || pair[0].ends == pair[1].ends);
        let places = pairs.map(|pair| Self {
            node: pair[0].ends[1],
            decay: pair.iter().map(|point| point.decay(point.against_bending())).fold(0.0, f64::max),
            spacing: 0.5 * (pair[0].length + pair[1].length),
            change: (pair[0].moment - pair[1].moment).norm(),
        });
        let is_told = |place: &Self| place.change > TOLD_CHANGE * largest && place.spacing > UNRESOLVED * place.decay;
        places.filter(is_told).max_by(|a, b| a.change.total_cmp(&b.change))
    }

    /// The message about it, for a `subject` such as a stage.
    pub(super) fn message(&self, subject: &str, model: &Model) -> String {
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
    /// The bending at all integration points in the present state.
    pub(super) fn bending(&self) -> Vec<Bending> {
        let mut points = Vec::new();
        self.assembly.each_bending(self.state, self.assembly.origin(), &mut |point| points.push(point));
        points
    }

    /// The bending at all integration points that a field of increments adds to the present state.
    pub(super) fn bending_along(&self, field: &[Vec3]) -> Vec<Bending> {
        let about = self.assembly.origin().unwrap_or(self.state);
        let mut moved = about.clone();
        // So that no unknown is larger than one: a rotation, or a displacement over the length of the scene.
        let size = |(&change, kind): (&Vec3, &SlotKind)| match kind {
            SlotKind::Displacement | SlotKind::Sliding => change.norm() / self.model.length,
            SlotKind::Rotation | SlotKind::Force | SlotKind::Moment => change.norm(),
        };
        let largest = field.iter().zip(self.model.kinds.iter()).map(size).fold(0.0, f64::max);
        moved.q.iter_mut().zip(field).for_each(|(q, &change)| *q += change * (1.0 / largest));
        let mut points = Vec::new();
        self.assembly.each_bending(about, Some(about), &mut |point| points.push(point));
        let mut number = 0;
        self.assembly.each_bending(&moved, Some(about), &mut |with| {
            points[number].moment = with.moment - points[number].moment;
            number += 1;
        });
        points
    }

    /// Warns of bending that decays over less than elements resolve.
    pub(super) fn warn_of_layers(&mut self) {
        let Some(place) = Unresolved::worst(&self.bending()) else { return };
        if !std::mem::replace(&mut self.issued.layers, true) {
            let message = place.message(&format!("stage {}", self.number + 1), self.model);
            self.warn(WarningKind::CoarseLayer, message);
        }
    }
}
