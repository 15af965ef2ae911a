//! Builds a [`Model`] from nodes, straight beams, supports and loads, without a deck.

use super::beam_element::{
    ElementGeometry, NodalInertia, PlacedNode, Rule, SectionPoint, Station, body_inertia, push_elastic, push_volume,
    shape_at,
};
use super::parts::ModelParts;
use super::{Amplitude, ElementInfo, Model, Motion, MotionKind, Names, SectionMatrices, Support};
use crate::effect::elasticity::{ElasticElements, RotationInterpolation};
use crate::effect::inertia::{BeamMass, Body, RigidBody};
use crate::effect::load::{BeamGravity, BodyGravity, NodeForce, NodeLoad, NodeLoadKind};
use crate::effect::spring::{GroundSpring, GroundSprings, Link, Links};
use crate::effect::{Effect, VolumeElements};
use crate::kernel::MAX_NODES;
use crate::kernel::inertia::Inertia;
use crate::system::{Direction, Node, Slot, StageSet};
use crate::tensor::{Mat3, Vec3};
use std::fmt;
use std::sync::Arc;

/// The sine of the angle between a beam and its `axis3` below which the section has no direction.
const PARALLEL: f64 = 1e-9;

/// A node of a [`ModelBuilder`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeId(usize);

/// A straight beam of equal elements with one section, whose rotations are interpolated relative to
/// each element.
#[derive(Clone, Debug)]
pub struct StraightBeam {
    /// Start and end
    pub ends: [NodeId; 2],
    /// Its section
    pub section: SectionMatrices,
    /// The third section axis is the part of it normal to the beam; EI2 bends about the second, EI3
    /// about the third.
    pub axis3: Vec3,
    /// The number of elements
    pub elements: usize,
    /// The order of their shape functions, 1 to 3
    pub order: usize,
}

/// The reason why a part cannot be built.
#[derive(Clone, Debug, PartialEq)]
pub enum BuildError {
    /// A node of another builder
    UnknownNode(usize),
    /// Two nodes at one place
    NoLength {
        /// The part that lies between them
        what: &'static str,
        /// The names of both
        nodes: [String; 2],
    },
    /// A beam without elements
    NoElements,
    /// Shape functions of an order that no element has
    Order(usize),
    /// A stiffness that is not positive, by its place on the diagonal
    Stiffness(usize, f64),
    /// The third section axis lies along the beam.
    AxisAlongBeam(Vec3),
    /// An axis of length zero, or one that is not finite
    NoAxis(Vec3),
    /// A mass or a principal inertia that is negative or not finite
    Mass(f64),
    /// A model without nodes
    NoNodes,
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::UnknownNode(number) => write!(f, "there is no node number {number}: it belongs to another builder"),
            Self::NoLength { what, nodes: [a, b] } => {
                write!(f, "a {what} has no length: nodes \"{a}\" and \"{b}\" are at one place")
            }
            Self::NoElements => write!(f, "a beam needs at least one element"),
            Self::Order(order) => write!(f, "there are no elements of order {order}: 1, 2 or 3 are possible"),
            Self::Stiffness(place, value) => {
                let name = ["EA", "GA2", "GA3", "GJ", "EI2", "EI3"].get(*place).unwrap_or(&"a stiffness");
                write!(f, "{name} = {value}: the stiffness of a section must be positive")
            }
            Self::AxisAlongBeam(axis) => {
                write!(f, "axis3 = {:?} lies along the beam: choose a direction normal to it", axis.0)
            }
            Self::NoAxis(axis) => write!(f, "{:?} is not a direction: its length must be positive", axis.0),
            Self::Mass(value) => write!(f, "{value}: masses and moments of inertia must not be negative"),
            Self::NoNodes => write!(f, "the model has no nodes"),
        }
    }
}

impl std::error::Error for BuildError {}

/// A straight beam with its nodes.
struct BuiltBeam {
    /// From start to end
    nodes: Vec<usize>,
    /// The number of its first element in the scene
    first_element: usize,
    elements: usize,
    order: usize,
    section: SectionMatrices,
    /// Section axes as columns
    axes: Mat3,
    length: f64,
}

impl BuiltBeam {
    /// Its elements as changes of chart see them.
    fn elements(&self, nodes: &[PlacedNode]) -> impl Iterator<Item = ElementInfo> {
        let of_element = |k: usize| &self.nodes[k * self.order..=(k + 1) * self.order];
        let rotations = move |k: usize| of_element(k).iter().map(|&node| nodes[node].node.p);
        (0..self.elements).map(move |k| ElementInfo::new(rotations(k), false))
    }
}

/// One element of a straight beam.
struct StraightElement<'b> {
    nodes: &'b [PlacedNode],
    beam: &'b BuiltBeam,
    /// Its number on the beam
    number: usize,
}

impl StraightElement<'_> {
    fn node_number(&self, i: usize) -> usize {
        self.beam.nodes[self.number * self.beam.order + i]
    }
}

impl ElementGeometry for StraightElement<'_> {
    fn number(&self) -> usize {
        self.beam.first_element + self.number
    }

    fn count(&self) -> usize {
        self.beam.order + 1
    }

    fn node(&self, i: usize) -> PlacedNode {
        self.nodes[self.node_number(i)]
    }

    fn arms<const N: usize>(&self) -> [Vec3; N] {
        let first = self.nodes[self.beam.nodes[0]].place;
        let last = self.nodes[self.beam.nodes[self.beam.nodes.len() - 1]].place;
        std::array::from_fn(|i| (last - first) * (i as f64 / ((N - 1) * self.beam.elements) as f64))
    }

    fn rounding(&self) -> f64 {
        let chord = self.node(self.beam.order).place - self.node(0).place;
        chord.norm() * self.beam.elements as f64 / self.beam.length
    }

    fn stations(&self, rule: Rule) -> Vec<Station> {
        let jacobian = 0.5 * self.beam.length / self.beam.elements as f64;
        let station = |&(xi, gauss_weight): &(f64, f64)| {
            let (shape, slope) = shape_at(self.count(), xi);
            let fraction = (self.number as f64 + 0.5 * (xi + 1.0)) / self.beam.elements as f64;
            Station {
                shape,
                slope: slope.map(|d| d / jacobian),
                weight: gauss_weight * jacobian,
                fraction,
                axes: self.beam.axes,
                along: fraction,
            }
        };
        rule.points(self.count()).iter().map(station).collect()
    }
}

/// Collects the parts of a scene.
///
/// Loads and motions come with an [`Amplitude`], which says when they act: `Amplitude::default()`
/// ramps a load up in the first static stage, and applies it in full from the start of a dynamic
/// one.
#[derive(Default)]
pub struct ModelBuilder {
    nodes: Vec<PlacedNode>,
    names: Names,
    beams: Vec<BuiltBeam>,
    elements: usize,
    bodies: Vec<Body>,
    loads: Vec<(NodeLoadKind, NodeForce)>,
    springs: Vec<GroundSpring>,
    links: Vec<Link>,
    supports: Vec<Support>,
    motions: Vec<Motion>,
    amplitudes: Vec<Amplitude>,
    gravity: Vec3,
    own_effects: Vec<Arc<dyn Effect>>,
}

impl ModelBuilder {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// A node with six unknowns at this initial place.
    pub fn node(&mut self, name: &str, place: Vec3) -> NodeId {
        self.names.give(self.next_slot(), name);
        self.add_node(place)
    }

    fn next_slot(&self) -> Slot {
        2 * self.nodes.len() as Slot
    }

    fn add_node(&mut self, place: Vec3) -> NodeId {
        let u = self.next_slot();
        self.nodes.push(PlacedNode { node: Node { u, p: u + 1 }, place });
        NodeId(self.nodes.len() - 1)
    }

    fn find(&self, node: NodeId) -> Result<PlacedNode, BuildError> {
        self.nodes.get(node.0).copied().ok_or(BuildError::UnknownNode(node.0))
    }

    /// The slots of a node in the states of the model: displacement and rotation vector.
    pub fn slots(&self, node: NodeId) -> Result<Node, BuildError> {
        Ok(self.find(node)?.node)
    }

    /// The way from one node to another, which must not be zero.
    fn way(&self, ends: [NodeId; 2], what: &'static str) -> Result<Vec3, BuildError> {
        let [from, to] = [self.find(ends[0])?, self.find(ends[1])?];
        let way = to.place - from.place;
        if way.norm() > 0.0 && way.is_finite() {
            return Ok(way);
        }
        Err(BuildError::NoLength { what, nodes: [from, to].map(|end| self.names.of(end.node.p)) })
    }

    /// A straight beam; its nodes from start to end.
    pub fn beam(&mut self, beam: StraightBeam) -> Result<Vec<NodeId>, BuildError> {
        let way = self.way(beam.ends, "beam")?;
        if beam.elements == 0 {
            return Err(BuildError::NoElements);
        }
        if beam.order == 0 || beam.order >= MAX_NODES {
            return Err(BuildError::Order(beam.order));
        }
        for (place, row) in beam.section.stiffness.iter().enumerate() {
            if row[place].is_nan() || row[place] <= 0.0 {
                return Err(BuildError::Stiffness(place, row[place]));
            }
        }
        let mass = beam.section.mass_per_length().mass;
        if mass.is_nan() || mass < 0.0 {
            return Err(BuildError::Mass(mass));
        }
        let length = way.norm();
        let tangent = way * (1.0 / length);
        let normal = beam.axis3 - tangent * beam.axis3.dot(tangent);
        let parallel = normal.norm() <= PARALLEL * beam.axis3.norm();
        let axis3 = normal.normalized().filter(|_| !parallel).ok_or(BuildError::AxisAlongBeam(beam.axis3))?;
        let nodes = self.nodes_along(&beam, way);
        self.beams.push(BuiltBeam {
            nodes: nodes.iter().map(|node| node.0).collect(),
            first_element: self.elements,
            elements: beam.elements,
            order: beam.order,
            section: beam.section,
            axes: Mat3::from_columns(tangent, axis3.cross(tangent), axis3),
            length,
        });
        self.elements += beam.elements;
        Ok(nodes)
    }

    fn nodes_along(&mut self, beam: &StraightBeam, way: Vec3) -> Vec<NodeId> {
        let name = format!("beam {}", self.beams.len() + 1);
        let start = self.nodes[beam.ends[0].0].place;
        let steps = beam.elements * beam.order;
        let mut nodes = vec![beam.ends[0]];
        for step in 1..steps {
            self.names.count(self.next_slot(), &name, step);
            nodes.push(self.add_node(start + way * (step as f64 / steps as f64)));
        }
        nodes.push(beam.ends[1]);
        nodes
    }

    /// Holds components of displacement and rotation where they begin, along the global axes.
    pub fn support(&mut self, node: NodeId, held: [bool; 6]) -> Result<(), BuildError> {
        let Node { u, p } = self.slots(node)?;
        let direction = |k: usize| Direction { slot: if k < 3 { u } else { p }, axis: Vec3::UNIT[k % 3] };
        let directions = (0..6).filter(|&k| held[k]).map(direction).collect();
        self.supports.push(Support { directions, stages: StageSet::default() });
        Ok(())
    }

    /// Holds displacement and rotation of a node.
    pub fn clamp(&mut self, node: NodeId) -> Result<(), BuildError> {
        self.support(node, [true; 6])
    }

    /// The number of a new amplitude.
    pub fn amplitude(&mut self, amplitude: Amplitude) -> usize {
        self.amplitudes.push(amplitude);
        self.amplitudes.len() - 1
    }

    /// A force or a moment at a node, in global components.
    pub fn load(
        &mut self,
        node: NodeId,
        kind: NodeLoadKind,
        vector: Vec3,
        amplitude: Amplitude,
    ) -> Result<(), BuildError> {
        let node = self.slots(node)?;
        let amplitude = self.amplitude(amplitude);
        self.loads.push((kind, NodeForce { node, vector, amplitude }));
        Ok(())
    }

    /// A force fixed in space, with the default amplitude.
    pub fn force(&mut self, node: NodeId, force: Vec3) -> Result<(), BuildError> {
        self.load(node, NodeLoadKind::SpatialForce, force, Amplitude::default())
    }

    /// A moment fixed in space, with the default amplitude.
    pub fn moment(&mut self, node: NodeId, moment: Vec3) -> Result<(), BuildError> {
        self.load(node, NodeLoadKind::SpatialMoment, moment, Amplitude::default())
    }

    /// A rigid body at a node: its mass, the place of its mass centre as seen from the node, and
    /// its inertia about the mass centre along the global axes.
    pub fn body(&mut self, node: NodeId, mass: f64, offset: Vec3, inertia: [f64; 3]) -> Result<(), BuildError> {
        let PlacedNode { node, place } = self.find(node)?;
        if let Some(&wrong) = [mass].iter().chain(&inertia).find(|value| !value.is_finite() || **value < 0.0) {
            return Err(BuildError::Mass(wrong));
        }
        let inertia = Arc::new(body_inertia(mass, offset, Mat3::diagonal(inertia)));
        self.bodies.push(Body { node, place, inertia });
        Ok(())
    }

    /// A spring from a node to ground: stiffness against displacement and rotation, along the
    /// global axes.
    pub fn ground_spring(&mut self, node: NodeId, stiffness: [f64; 6]) -> Result<(), BuildError> {
        let node = self.slots(node)?;
        let [x, y, z, rx, ry, rz] = stiffness;
        let amplitude = self.amplitude(Amplitude::of_switch(StageSet::default()));
        self.springs.push(GroundSpring {
            node,
            translation: Mat3::diagonal([x, y, z]),
            rotation: Mat3::diagonal([rx, ry, rz]),
            translation_damping: Mat3::ZERO,
            rotation_damping: Mat3::ZERO,
            amplitude,
        });
        Ok(())
    }

    /// A spring between two nodes, without force at its initial length.
    pub fn spring(&mut self, ends: [NodeId; 2], stiffness: f64) -> Result<(), BuildError> {
        let length = self.way(ends, "spring")?.norm();
        let [a, b] = [self.find(ends[0])?, self.find(ends[1])?];
        let amplitude = self.amplitude(Amplitude::of_switch(StageSet::default()));
        self.links.push(Link {
            nodes: [a.node, b.node],
            places: [a.place, b.place],
            stiffness,
            damping: 0.0,
            length,
            tension_only: false,
            amplitude,
        });
        Ok(())
    }

    /// Prescribes the displacement of a node along an axis, or its rotation about one; the
    /// amplitude is one [of a motion](Amplitude::of_motion).
    pub fn motion(
        &mut self,
        node: NodeId,
        kind: MotionKind,
        axis: Vec3,
        amplitude: Amplitude,
    ) -> Result<(), BuildError> {
        let Node { u, p } = self.slots(node)?;
        let slot = match kind {
            MotionKind::Translation => u,
            MotionKind::Rotation => p,
        };
        let axis = axis.normalized().filter(|axis| axis.is_finite()).ok_or(BuildError::NoAxis(axis))?;
        self.motions.push(Motion { kind, slot, axis, amplitude });
        Ok(())
    }

    /// The acceleration of gravity on all mass.
    pub fn gravity(&mut self, acceleration: Vec3) {
        self.gravity = acceleration;
    }

    /// An effect of one's own; [`Self::slots`] tells where its nodes are.
    pub fn effect(&mut self, effect: impl Effect + 'static) {
        self.own_effects.push(Arc::new(effect));
    }

    /// The model of all parts.
    pub fn build(mut self) -> Result<Model, BuildError> {
        if self.nodes.is_empty() {
            return Err(BuildError::NoNodes);
        }
        let mut effects = Effects::default();
        self.add_beams(&mut effects);
        effects.push(!self.springs.is_empty(), GroundSprings { springs: self.springs.clone() });
        effects.push(!self.links.is_empty(), Links { links: self.links });
        let sizes = self.bodies.iter().map(|body| body.inertia.radius_of_gyration()).collect();
        let bodies = RigidBody { name: "rigid body inertia", bodies: self.bodies, gyroscopic: true };
        effects.push(!bodies.bodies.is_empty(), bodies);
        for kind in [
            NodeLoadKind::SpatialForce,
            NodeLoadKind::SpatialMoment,
            NodeLoadKind::MaterialForce,
            NodeLoadKind::MaterialMoment,
        ] {
            let of_kind = self.loads.iter().filter(|(own, _)| *own == kind);
            let loads: Vec<NodeForce> = of_kind.map(|(_, load)| *load).collect();
            effects.push(!loads.is_empty(), NodeLoad { kind, loads, tangent: true });
        }
        effects.0.append(&mut self.own_effects);
        let parts = ModelParts {
            names: self.names,
            elements: self.beams.iter().flat_map(|beam| beam.elements(&self.nodes)).collect(),
            sprung: self.springs.iter().filter(|spring| spring.rotation != Mat3::ZERO).map(|s| s.node.p).collect(),
            effects: effects.0,
            amplitudes: self.amplitudes,
            supports: self.supports,
            motions: self.motions,
            sizes,
            ..ModelParts::default()
        };
        Ok(parts.assemble(&self.nodes))
    }

    /// Elasticity, inertia and weight of beams, and the weight of bodies.
    fn add_beams(&mut self, effects: &mut Effects) {
        let mut elastic = ElasticElements::default();
        let mut mass = VolumeElements::default();
        let mut heavy: VolumeElements<Inertia> = VolumeElements::default();
        let mut nodal = NodalInertia::new(self.nodes.len());
        for beam in &self.beams {
            let turned = beam.section.mass_per_length().turned(beam.axes);
            let is_eccentric = turned.offset != Vec3::ZERO;
            let at_nodes = if is_eccentric { turned } else { Inertia { mass: 0.0, ..turned } };
            let on_line = Inertia { about_node: Mat3::ZERO, ..turned };
            let law = beam.section.law_in(beam.axes);
            for number in 0..beam.elements {
                let element = StraightElement { nodes: &self.nodes, beam, number };
                push_elastic(&mut elastic, &element, None, |_| SectionPoint { law, free: None });
                for (i, station) in element.stations(Rule::Nodal).iter().enumerate() {
                    nodal.add(element.node_number(i), &at_nodes, station.weight);
                }
                if !is_eccentric && on_line.mass != 0.0 {
                    let stations = element.stations(Rule::Volume);
                    push_volume(&mut mass, &element, &stations, |_| on_line.mass);
                    if self.gravity != Vec3::ZERO {
                        push_volume(&mut heavy, &element, &stations, |_| on_line);
                    }
                }
            }
        }
        elastic.shrink_to_fit();
        heavy.shrink_to_fit();
        let sections = nodal.bodies(|node| self.nodes[node]);
        if !elastic.is_empty() {
            effects.0.push(RotationInterpolation::Relative.build(elastic, true, None).elasticity);
        }
        let mass = BeamMass::new(&mass);
        effects.push(!mass.is_empty(), mass);
        let massive: Vec<Body> = [&sections[..], &self.bodies].concat();
        let massive: Vec<Body> = massive.into_iter().filter(|body| body.inertia.mass > 0.0).collect();
        let sections = RigidBody { name: "section inertia at nodes", bodies: sections, gyroscopic: true };
        effects.push(!sections.bodies.is_empty(), sections);
        if self.gravity != Vec3::ZERO {
            let acceleration = self.gravity;
            let amplitude = self.amplitude(Amplitude::default());
            effects.push(!heavy.is_empty(), BeamGravity { acceleration, amplitude, elements: heavy });
            effects.push(!massive.is_empty(), BodyGravity { acceleration, amplitude, bodies: massive });
        }
    }
}

/// The effects of a model in their order.
#[derive(Default)]
struct Effects(Vec<Arc<dyn Effect>>);

impl Effects {
    fn push(&mut self, has_instances: bool, effect: impl Effect + 'static) {
        if has_instances {
            self.0.push(Arc::new(effect));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam(ends: [NodeId; 2]) -> StraightBeam {
        let section = SectionMatrices::diagonal([1e4, 1e4, 1e4, 1e2, 1e2, 1e2]);
        StraightBeam { ends, section, axis3: Vec3::UNIT[2], elements: 2, order: 1 }
    }

    #[test]
    fn what_cannot_be_built_is_told() {
        let mut builder = ModelBuilder::new();
        let root = builder.node("root", Vec3::ZERO);
        let tip = builder.node("tip", Vec3::UNIT[0]);
        let good = beam([root, tip]);
        let errors = [
            builder.beam(beam([root, root])),
            builder.beam(StraightBeam { elements: 0, ..good.clone() }),
            builder.beam(StraightBeam { order: 4, ..good.clone() }),
            builder.beam(StraightBeam { axis3: Vec3::UNIT[0], ..good.clone() }),
            builder.beam(StraightBeam {
                section: SectionMatrices::diagonal([1.0, 1.0, 1.0, 1.0, 0.0, 1.0]),
                ..good.clone()
            }),
            builder.beam(beam([root, NodeId(9)])),
        ];
        let messages = errors.map(|found| found.map_or_else(|error| error.to_string(), |_| "built".into()));
        assert_eq!(
            messages,
            [
                "a beam has no length: nodes \"root\" and \"root\" are at one place",
                "a beam needs at least one element",
                "there are no elements of order 4: 1, 2 or 3 are possible",
                "axis3 = [1.0, 0.0, 0.0] lies along the beam: choose a direction normal to it",
                "EI2 = 0: the stiffness of a section must be positive",
                "there is no node number 9: it belongs to another builder",
            ]
        );
        assert_eq!(builder.beam(good).map(|nodes| nodes.len()), Ok(3));
        assert_eq!(ModelBuilder::new().build().map(|_| ()), Err(BuildError::NoNodes));
    }
}
