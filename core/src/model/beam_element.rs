//! From the geometry of beam elements to the elements of effects: integration points, elasticity,
//! volume points, mass at nodes.

use crate::effect::elasticity::{BeamLaw, ElasticElement, ElasticElements, ElasticPoint};
use crate::effect::inertia::Body;
use crate::effect::{Connection, VolumeElement, VolumeElements};
use crate::kernel::inertia::Inertia;
use crate::kernel::law::Strain;
use crate::kernel::volume::VolumePoint;
use crate::kernel::{MAX_NODES, shape};
use crate::system::Node;
use crate::tensor::{Mat3, Vec3};
use std::sync::Arc;

/// A node and its initial place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedNode {
    /// Its slots
    pub node: Node,
    /// Its initial place
    pub place: Vec3,
}

/// An integration point of an element.
#[derive(Clone, Debug)]
pub struct Station {
    /// Shape functions, as many as the element has nodes
    pub shape: [f64; MAX_NODES],
    /// Their derivatives over arc length
    pub slope: [f64; MAX_NODES],
    /// Gauss weight times ds/dxi
    pub weight: f64,
    /// Fraction of the beam's length
    pub fraction: f64,
    /// The section axes of the interpolated line as columns; the first is its tangent
    pub axes: Mat3,
    /// How far along its piece of the centre line, from 0 to 1
    pub along: f64,
}

/// The points of an element that are summed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// For internal forces: one Gauss point less than nodes, which avoids shear locking
    Inner,
    /// For mass and line loads
    Volume,
    /// At the nodes (Newton-Cotes), for what depends on rotations where these are not interpolated
    /// as vectors
    Nodal,
}

impl Rule {
    /// Abscissas on [-1, 1] and weights for an element of so many nodes.
    pub fn points(self, nodes: usize) -> &'static [(f64, f64)] {
        match self {
            Self::Inner => shape::gauss(nodes - 1),
            Self::Volume => shape::gauss(nodes),
            Self::Nodal => shape::newton_cotes(nodes),
        }
    }
}

/// Shape functions and their derivatives over xi, for 2, 3 or 4 nodes.
pub fn shape_at(nodes: usize, xi: f64) -> ([f64; MAX_NODES], [f64; MAX_NODES]) {
    fn padded<const N: usize>(values: [f64; N]) -> [f64; MAX_NODES] {
        std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
    }
    match nodes {
        2 => (padded(shape::values::<2>(xi)), padded(shape::derivatives::<2>(xi))),
        3 => (padded(shape::values::<3>(xi)), padded(shape::derivatives::<3>(xi))),
        _ => (shape::values::<4>(xi), shape::derivatives::<4>(xi)),
    }
}

/// A beam element as a mesh knows it: 2 to [`MAX_NODES`] nodes.
pub trait ElementGeometry {
    /// Its number in the scene.
    fn number(&self) -> usize;

    /// How many nodes it has.
    fn count(&self) -> usize;

    /// The node with this number in it.
    fn node(&self, i: usize) -> PlacedNode;

    /// The initial places of its nodes as seen from the first; N is their number.
    fn arms<const N: usize>(&self) -> [Vec3; N];

    /// How much longer it is than its arms tell, by round-off of the places of its nodes.
    fn rounding(&self) -> f64;

    /// Its integration points.
    fn stations(&self, rule: Rule) -> Vec<Station>;

    /// The places of its nodes, weighed.
    fn between(&self, weights: &[f64; MAX_NODES]) -> Vec3 {
        (0..self.count()).fold(Vec3::ZERO, |sum, i| sum + self.node(i).place * weights[i])
    }
}

fn connect<const N: usize>(element: &impl ElementGeometry) -> Connection<N> {
    Connection { element: element.number() as u32, nodes: std::array::from_fn(|i| element.node(i).node) }
}

/// Pushes an element with a quantity at each of these volume points into the batch of its order.
pub fn push_volume<Q: Copy + PartialEq>(
    batches: &mut VolumeElements<Q>,
    element: &impl ElementGeometry,
    stations: &[Station],
    quantity: impl Fn(usize) -> Q,
) {
    match element.count() {
        2 => batches.two.push(volume(element, stations, quantity, batches.two.last())),
        3 => batches.three.push(volume(element, stations, quantity, batches.three.last())),
        _ => batches.four.push(volume(element, stations, quantity, batches.four.last())),
    }
}

fn volume<const N: usize, Q: Copy + PartialEq>(
    element: &impl ElementGeometry,
    stations: &[Station],
    quantity: impl Fn(usize) -> Q,
    neighbour: Option<&VolumeElement<N, Q>>,
) -> VolumeElement<N, Q> {
    let point = |k: usize| {
        let Station { shape, weight, .. } = &stations[k];
        VolumePoint { shape: std::array::from_fn(|i| shape[i]), weight: *weight, quantity: quantity(k) }
    };
    let points = std::array::from_fn(point);
    VolumeElement::new(connect(element), element.node(0).place, element.arms(), points, neighbour)
}

/// The elastic properties of an integration point.
pub struct SectionPoint {
    /// The section in global components
    pub law: BeamLaw,
    /// The strain without stress for an amplitude of one
    pub free: Option<Strain>,
}

/// Pushes an elastic element into the batch of its order; `free`: the number of the amplitude of
/// its free strain.
pub fn push_elastic(
    batches: &mut ElasticElements,
    element: &impl ElementGeometry,
    free: Option<usize>,
    point: impl FnMut(&Station) -> SectionPoint,
) {
    match element.count() {
        2 => batches.two.push(elastic(element, free, point, batches.two.last())),
        3 => batches.three.push(elastic(element, free, point, batches.three.last())),
        _ => batches.four.push(elastic(element, free, point, batches.four.last())),
    }
}

fn elastic<const N: usize, const G: usize>(
    element: &impl ElementGeometry,
    free: Option<usize>,
    mut point: impl FnMut(&Station) -> SectionPoint,
    neighbour: Option<&ElasticElement<N, G>>,
) -> ElasticElement<N, G> {
    let stations = element.stations(Rule::Inner);
    let elastic_point = |k: usize| {
        let station = &stations[k];
        let SectionPoint { law, free } = point(station);
        ElasticPoint {
            shape: std::array::from_fn(|i| station.shape[i]),
            slope: std::array::from_fn(|i| station.slope[i]),
            weight: station.weight,
            tangent: station.axes.column(0),
            law,
            free,
        }
    };
    let points = std::array::from_fn(elastic_point);
    ElasticElement::new(connect(element), element.rounding(), element.arms(), points, free, neighbour)
}

/// Inertia of a body about its node, from that about its mass centre.
pub fn body_inertia(mass: f64, offset: Vec3, about_centre: Mat3) -> Inertia {
    let steiner = (Mat3::diagonal([offset.squared(); 3]) - offset.outer(offset)) * mass;
    Inertia { mass, offset, about_node: about_centre + steiner }
}

/// Mass properties of sections, collected at nodes.
pub struct NodalInertia {
    /// By number of the node
    sums: Vec<MassSum>,
}

/// Mass, first moment of mass, and inertia about the node.
#[derive(Clone, Copy)]
struct MassSum {
    mass: f64,
    moment: Vec3,
    about_node: Mat3,
}

impl NodalInertia {
    /// Nothing yet at so many nodes.
    pub fn new(nodes: usize) -> Self {
        Self { sums: vec![MassSum { mass: 0.0, moment: Vec3::ZERO, about_node: Mat3::ZERO }; nodes] }
    }

    /// Adds a length `weight` of a section to a node.
    pub fn add(&mut self, node: usize, per_length: &Inertia, weight: f64) {
        let sum = &mut self.sums[node];
        sum.mass += per_length.mass * weight;
        sum.moment += per_length.offset * (per_length.mass * weight);
        sum.about_node += per_length.about_node * weight;
    }

    /// The bodies at nodes that have any mass or inertia; neighbours with the same share it.
    pub fn bodies(self, place: impl Fn(usize) -> PlacedNode) -> Vec<Body> {
        let mut last: Option<Arc<Inertia>> = None;
        let mut bodies = Vec::new();
        for (number, MassSum { mass, moment, about_node }) in self.sums.into_iter().enumerate() {
            if mass == 0.0 && about_node == Mat3::ZERO {
                continue;
            }
            let offset = if mass > 0.0 { moment * (1.0 / mass) } else { Vec3::ZERO };
            let own = Inertia { mass, offset, about_node };
            let inertia = last.take().filter(|known| **known == own).unwrap_or_else(|| Arc::new(own));
            last = Some(inertia.clone());
            let PlacedNode { node, place } = place(number);
            bodies.push(Body { node, place, inertia });
        }
        bodies.shrink_to_fit();
        bodies
    }
}
