//! Holds spins that nothing resists: a straight beam without rotary inertia may spin about its own axis in a dynamic stage without
//! any force, and then round-off alone would tell by how much.

use super::Effect;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Aspect, Category, Cliques, Memory, Node, Sink, StageContext, StageKind, State};
use crate::tensor::Vec3;

/// One beam.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The node in its middle
    pub node: Node,
    /// All its nodes
    pub nodes: Vec<Node>,
    /// The axis of the beam, a unit vector
    pub axis: Vec3,
    /// GJ/L, moment per angle
    pub stiffness: f64,
}

/// The hold in time steps, as part of GJ/L: residuals that Newton tolerates may not turn the beam by much, and the swing of a
/// beam that sags must not notice.
const HOLD: f64 = 1e-3;

/// The same where no mass stands beside it: modes must not notice at all.
const HOLD_IN_MODES: f64 = 1e-8;

/// All such beams.
///
/// It exerts no force, so that balance is what it was; it only stands in the tangent, as stiffness against corrections
/// t.T dP about the axis t, and keeps predictions from carrying spins on, so that what no force asks for does not happen.
#[derive(Clone, Debug)]
pub struct SpinHold {
    /// The beams
    pub beams: Vec<Instance>,
}

impl Effect for SpinHold {
    fn name(&self) -> &'static str {
        "hold of spins without inertia"
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn cliques(&self) -> Cliques {
        let mut cliques = Cliques::default();
        self.beams.iter().for_each(|beam| cliques.push([beam.node.p]));
        cliques
    }

    fn is_symmetric(&self) -> bool {
        true
    }

    fn acts(&self, stage: &StageContext) -> bool {
        matches!(stage.kind, StageKind::Dynamic | StageKind::Modal)
    }

    fn aspects(&self, show: &mut dyn FnMut(Aspect)) {
        self.beams.iter().for_each(|beam| show(Aspect::Line(beam.axis)));
    }

    fn steady(&self, at: &mut State) {
        for beam in &self.beams {
            for node in &beam.nodes {
                let (rotation, p) = (at.rotation(node.p), node.p as usize);
                let about = rotation.t_inverse() * beam.axis;
                for rate in [&mut at.v[p], &mut at.a[p]] {
                    *rate -= about * beam.axis.dot(rotation.t * *rate);
                }
            }
        }
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        let hold = weights.stiffness * if weights.mass == 0.0 { HOLD_IN_MODES } else { HOLD };
        let mut system = ElementSystem::new(1);
        for (k, beam) in self.beams.iter().enumerate() {
            system.clear();
            let about = at.rotation(beam.node.p).t.transpose_mul(beam.axis);
            system.add_tangent(0, 0, about.outer(about).scale(beam.stiffness * hold));
            out.add(k, &system);
        }
    }
}
