//! Places that columns are read at: nodes, and points within elements.

use crate::kernel::NodeMotion;
use crate::kernel::element::MAX_NODES;
use crate::kernel::relative::Relative;
use crate::kernel::seam::{Converted, conversion};
use crate::rotation::{Rotation, log};
use crate::scalar::Jet;
use crate::system::{Node, State};
use crate::tensor::{Mat3, Vec3};

/// A node, or a place that moves with the nodes of one element by the shape functions of that
/// element.
#[derive(Clone, Debug)]
pub struct Place {
    /// Nodes with their initial positions and their shape functions at the place
    pub nodes: Vec<(Node, Vec3, f64)>,
    /// The section axes E1, E2, E3 of the initial placement as columns
    pub frame: Mat3,
    /// True where rotations are interpolated relative to the element
    pub relative: bool,
}

impl Place {
    /// Displacement and rotation vector of the place, with their rates.
    pub fn motion(&self, state: &State) -> NodeMotion {
        if let [(node, _, _)] = self.nodes[..] {
            return state.motion(node);
        }
        let motions: Vec<NodeMotion> = self.nodes.iter().map(|&(node, _, _)| state.motion(node)).collect();
        if self.relative {
            return self.relative_motion(&motions);
        }
        let mut p = [Vec3::ZERO; MAX_NODES];
        p.iter_mut().zip(&motions).for_each(|(p, motion)| *p = motion.p);
        let converted = Converted::new(&motions, conversion(&p[..motions.len()]));
        let sum = |field: fn(&NodeMotion) -> Vec3| {
            let parts = self.nodes.iter().zip(&converted.nodes);
            parts.fold(Vec3::ZERO, |sum, (&(_, _, weight), motion)| sum + field(motion) * weight)
        };
        NodeMotion {
            u: sum(|m| m.u),
            u_rate: sum(|m| m.u_rate),
            u_rate2: sum(|m| m.u_rate2),
            p: sum(|m| m.p),
            p_rate: sum(|m| m.p_rate),
            p_rate2: sum(|m| m.p_rate2),
        }
    }

    /// Motion by interpolation relative to the element: the rotation and its rates come as a jet.
    fn relative_motion(&self, motions: &[NodeMotion]) -> NodeMotion {
        let sum = |field: fn(&NodeMotion) -> Vec3| {
            let parts = self.nodes.iter().zip(motions);
            parts.fold(Vec3::ZERO, |sum, (&(_, _, weight), motion)| sum + field(motion) * weight)
        };
        let rotation = match motions.len() {
            2 => self.relative_rotation::<2>(motions),
            3 => self.relative_rotation::<3>(motions),
            _ => self.relative_rotation::<4>(motions),
        };
        let p = log(rotation);
        let pick = |field: fn(&Jet) -> f64| Vec3(p.0.each_ref().map(field));
        NodeMotion {
            u: sum(|m| m.u),
            u_rate: sum(|m| m.u_rate),
            u_rate2: sum(|m| m.u_rate2),
            p: pick(|jet| jet.value),
            p_rate: pick(|jet| jet.rate),
            p_rate2: pick(|jet| jet.rate2),
        }
    }

    fn relative_rotation<const N: usize>(&self, motions: &[NodeMotion]) -> Mat3<Jet> {
        let jet = |m: &NodeMotion| {
            Vec3(std::array::from_fn(|k| Jet { value: m.p.0[k], rate: m.p_rate.0[k], rate2: m.p_rate2.0[k] }))
        };
        let rotations: [Rotation<Jet>; N] = std::array::from_fn(|i| Rotation::new(jet(&motions[i])));
        let places = std::array::from_fn(|i| Vec3::constant(self.nodes[i].1));
        Relative::new(&places, &[Vec3::zero(); N], &rotations).rotation(|i| self.nodes[i].2)
    }

    /// Initial position.
    pub fn initial(&self) -> Vec3 {
        self.nodes.iter().fold(Vec3::ZERO, |sum, &(_, place, weight)| sum + place * weight)
    }

    /// Rotation vector continued since the start, interpolated by the shape functions.
    pub fn unwrapped(&self, state: &State) -> Vec3 {
        self.nodes.iter().fold(Vec3::ZERO, |sum, &(node, _, weight)| sum + state.unwrapped_at(node.p) * weight)
    }

    /// Node that the place is; none within an element.
    pub fn node(&self) -> Option<Node> {
        match self.nodes[..] {
            [(node, _, _)] => Some(node),
            _ => None,
        }
    }
}
