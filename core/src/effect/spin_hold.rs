//! Holds of free spins: a straight part between ball joints may spin about its own axis without any
//! force, in statics and in dynamic stages without rotary inertia, so that its angle would be
//! round-off.

use super::{Effect, FreeSpins, Roles, SomeIncrements, TangentForm};
use crate::kernel::{ElementSystem, Weights};
use crate::system::{
    Assembler, Category, Connectivity, Memory, MirrorData, Node, StageContext, StageKind, StageSet, State,
};
use crate::tensor::Vec3;

/// A straight part that may spin freely: beams joined rigidly along a line.
#[derive(Clone, Debug)]
pub struct SpinningPart {
    /// A node in the middle of a beam
    pub node: Node,
    /// All nodes of the part
    pub nodes: Vec<Node>,
    /// The axis of the part in the initial placement, a unit vector
    pub axis: Vec3,
    /// GJ/L, a moment per radian
    pub torsion: f64,
    /// The moment of drag against a spin in dynamic stages, over its rate; zero where something may turn the part
    pub drag: f64,
    /// EA L, which has the unit of a moment per radian: the size of what resists stretching and shear
    pub stretching: f64,
}

/// The stiffness of the hold in load levels and time steps, over GJ/L: large enough that tolerated
/// residuals of Newton's method hardly turn the part, small enough that it does not change the
/// swing of a sagging beam.
const HOLD_RATIO: f64 = 1e-3;

/// The stiffness of the hold in tangents without mass, over GJ/L: small enough that modes do not
/// change.
const HOLD_RATIO_IN_MODES: f64 = 1e-8;

/// The least stiffness of the hold, over EA L: where GJ is tiny, the spin would be lost in the round-off
/// of what resists stretching and shear. Modes of straight parts do not contain the spin, whatever holds it.
const LEAST_HOLD_RATIO: f64 = 1e-14;

/// The stages in which spins are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldIn {
    /// Dynamic and modal stages
    Motion,
    /// Static stages and searches for critical loads
    Statics,
}

impl HeldIn {
    /// Those among which a stage of some kind is.
    pub fn stages_of(kind: StageKind) -> Self {
        if kind.needs_inertia() { Self::Motion } else { Self::Statics }
    }

    /// The name of the effect.
    pub fn name(self) -> &'static str {
        match self {
            Self::Motion => "hold of spins without inertia",
            Self::Statics => "hold of free spins",
        }
    }
}

/// The hold of all parts that may spin freely.
///
/// It adds to the tangent a stiffness against corrections t.T dP about the axis t, and removes spins
/// from predictions, so that parts spin only if forces turn them. It does not change balance but for
/// the drag of round parts that nothing turns: the strain energy of a mesh depends a little on how
/// such a part is turned about its bent axis, and without inertia the part would jump to where that
/// is least, within a few steps.
#[derive(Clone, Debug)]
pub struct SpinHold {
    /// The parts
    pub parts: Vec<SpinningPart>,
    /// The kinds of stages that hold them
    pub held_in: HeldIn,
    /// The stages in which nothing else does
    pub stages: StageSet,
}

impl Effect for SpinHold {
    fn name(&self) -> &'static str {
        self.held_in.name()
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        self.parts.iter().for_each(|part| connectivity.push([part.node.p]));
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::Symmetric
    }

    fn acts(&self, stage: &StageContext) -> bool {
        self.held_in == HeldIn::stages_of(stage.kind) && self.stages.contains(stage.number)
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        self.parts.iter().for_each(|part| show(MirrorData::Line(part.axis)));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        // An artificial resistance holds spins by a force.
        if at.anchor.is_some() {
            return;
        }
        let among_modes = self.held_in == HeldIn::Motion && weights.mass == 0.0;
        let ratio = if among_modes { HOLD_RATIO_IN_MODES } else { HOLD_RATIO };
        let mut system = ElementSystem::new(1);
        for (k, part) in self.parts.iter().enumerate() {
            system.clear();
            let about = at.rotation(part.node.p).t.transpose_mul(part.axis);
            let hold = (ratio * part.torsion).max(LEAST_HOLD_RATIO * part.stretching);
            let mut resistance = weights.stiffness * hold;
            if part.drag > 0.0 {
                system.add_force(0, about * (part.drag * about.dot(at.v[part.node.p as usize])));
                // Modes do not contain the spin.
                resistance += if among_modes { 0.0 } else { weights.damping * part.drag };
            }
            system.add_tangent(0, 0, about.outer(about).scale(resistance));
            out.add(k, &system);
        }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles { spins: Some(self), ..Roles::NONE }
    }
}

impl FreeSpins for SpinHold {
    fn free_motions(&self, at: &State, show: &mut dyn FnMut(&SomeIncrements)) {
        // A free motion is a material spin of all nodes of a part about its axis. Without inertia
        // it is no mode.
        let parts = if self.held_in == HeldIn::Statics { &self.parts[..] } else { &[] };
        for part in parts {
            let spin = |node: &Node| (node.p, at.rotation(node.p).t_inverse() * part.axis);
            show(&part.nodes.iter().map(spin).collect::<Vec<_>>());
        }
    }

    fn steady(&self, at: &mut State) {
        // Parts that are held only in statics may spin by their inertia.
        let parts = if self.held_in == HeldIn::Motion { &self.parts[..] } else { &[] };
        for part in parts {
            for node in &part.nodes {
                let rotation = at.rotation(node.p);
                let p = node.p as usize;
                let about = rotation.t_inverse() * part.axis;
                for rate in [&mut at.v[p], &mut at.a[p]] {
                    *rate -= about * part.axis.dot(rotation.t * *rate);
                }
            }
        }
    }
}
