//! Places that columns are read at: nodes, and points within elements.

use crate::effect::elasticity::StressField;
use crate::kernel::NodeMotion;
use crate::kernel::element::MAX_NODES;
use crate::kernel::law::{Strain, Stress};
use crate::kernel::relative::Relative;
use crate::kernel::seam::{Converted, conversion};
use crate::kernel::shape::gauss;
use crate::rotation::{Rotation, log};
use crate::scalar::Jet;
use crate::section::Vector6;
use crate::section::recovery::{PlacedRecovery, PointStress};
use crate::system::{Node, State};
use crate::tensor::{Mat3, Vec3};
use std::sync::Arc;

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

/// A point within beam elements: between two elements of a beam it has two sides.
#[derive(Clone)]
pub struct BeamPoint {
    /// Number of the beam in the scene
    pub beam: usize,
    /// The part of the length of the beam before it
    pub fraction: f64,
    /// Elasticity of the scene, one for each way to interpolate rotations
    pub elasticity: Vec<Arc<dyn StressField>>,
    /// For each side the number of the element in the scene, and xi in it
    pub sides: Vec<(u32, f64)>,
    /// Initial section axes as columns
    pub frame: Mat3,
}

/// A point of a beam with the stresses of its section.
#[derive(Clone)]
pub struct StressPlace {
    /// The point, for resultants
    pub inside: BeamPoint,
    /// The section there
    pub section: PlacedRecovery,
}

/// A fixed point of the section at a point of a beam.
#[derive(Clone)]
pub struct StressPoint {
    /// The point of the beam, for resultants
    pub inside: BeamPoint,
    /// Stresses there under unit resultants
    pub stress: PointStress,
}

/// Strains and stresses at the Gauss points of the element that was evaluated last, at one state:
/// neighbouring points share elements.
#[derive(Default)]
pub struct LastElement {
    element: Option<u32>,
    values: Vec<(Strain, Stress)>,
}

impl BeamPoint {
    /// N and M in section axes, see [`strain_and_stress`](Self::strain_and_stress).
    pub fn resultant(&self, state: &State, origin: Option<&State>) -> Vector6 {
        Vector6::from(self.strain_and_stress(state, origin)[1])
    }

    /// Gamma and K, then N and M, in section axes: values at Gauss points extrapolated within the
    /// element, mean of both sides. `origin` is the state about which the stage is linear; `None`
    /// in other stages.
    pub fn strain_and_stress(&self, state: &State, origin: Option<&State>) -> [[f64; 6]; 2] {
        self.strain_and_stress_after(&mut LastElement::default(), state, origin)
    }

    /// As [`strain_and_stress`](Self::strain_and_stress), with the element of the point before at the
    /// same state.
    pub fn strain_and_stress_after(
        &self,
        last: &mut LastElement,
        state: &State,
        origin: Option<&State>,
    ) -> [[f64; 6]; 2] {
        let mut mean = [[0.0; 6]; 2];
        for &(element, xi) in &self.sides {
            let values = self.one_side(last.at(element, self, state, origin), xi);
            for (sum, part) in mean.iter_mut().flatten().zip(values.iter().flatten()) {
                *sum += part / self.sides.len() as f64;
            }
        }
        mean
    }

    /// Strains and resultants of one side: the polynomial through the values at the Gauss points.
    fn one_side(&self, values: &[(Strain, Stress)], xi: f64) -> [[f64; 6]; 2] {
        let abscissas: Vec<f64> = gauss(values.len()).iter().map(|&(x, _)| x).collect();
        let mut out = [[0.0; 6]; 2];
        for (g, (strain, stress)) in values.iter().enumerate() {
            let others = (0..values.len()).filter(|&k| k != g);
            let weight: f64 = others.map(|k| (xi - abscissas[k]) / (abscissas[g] - abscissas[k])).product();
            let local = |v: Vec3| self.frame.transpose_mul(v).0;
            let parts = [[local(strain.gamma), local(strain.kappa)], [local(stress.n), local(stress.m)]];
            for (sum, part) in out.iter_mut().zip(&parts) {
                for (s, p) in sum.iter_mut().zip(part.iter().flatten()) {
                    *s += weight * p;
                }
            }
        }
        out
    }
}

impl LastElement {
    /// Values of an element, which belongs to a point of a beam.
    fn at(&mut self, element: u32, point: &BeamPoint, state: &State, origin: Option<&State>) -> &[(Strain, Stress)] {
        if self.element != Some(element) {
            let values = point.elasticity.iter().find_map(|field| field.at_points(element, state, origin));
            *self = Self { element: Some(element), values: values.unwrap_or_default() };
        }
        &self.values
    }
}
