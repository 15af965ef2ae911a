//! Points of beams that strains and resultants are read at.

use super::mesh::{Mesh, MeshBeam};
use beamsim_core::effect::Effect;
use beamsim_core::effect::elasticity::StressField;
use beamsim_core::probe::{BeamElements, BeamPoint, BeamSide};
use beamsim_core::section::{Matrix6, Vector6};
use beamsim_core::system::{Node, Slot};
use beamsim_core::tensor::Mat3;
use std::collections::{HashMap, HashSet};
use std::sync::{Arc, OnceLock};

/// Section axes that differ by less are those of a line without a corner.
const STRAIGHT: f64 = 1e-6;

/// What acts at the nodes between elements of beams.
pub struct ActionsAtNodes {
    /// Slots at which something acts; joints and sliders are not among them, but found in the effects
    acting: Vec<Slot>,
    /// For each beam, looked for when they are asked for first
    found: OnceLock<Vec<NodesBetween>>,
}

/// The nodes between elements of a beam.
struct NodesBetween {
    /// True where no concentrated force acts: forces jump there only by what acts along the beam (loads, gravity,
    /// inertia). What acts on rotations alone does not matter.
    plain: Arc<[bool]>,
    /// True where no concentrated moment acts either
    smooth: Vec<bool>,
}

/// Maker of points of the beams of a scene.
#[derive(Clone, Copy)]
pub struct BeamPoints<'a> {
    /// The mesh
    pub(super) mesh: &'a Mesh,
    /// Elasticity of the scene
    pub(super) elasticity: &'a [Arc<dyn StressField>],
    /// All effects of the scene
    pub(super) effects: &'a [Arc<dyn Effect>],
    /// See [`ActionsAtNodes`]
    pub(super) actions: &'a ActionsAtNodes,
}

impl ActionsAtNodes {
    /// Nodes of a scene in which supports, motions, loads, bodies, springs and contacts act at the slots `acting`.
    pub fn new(acting: Vec<Slot>) -> Self {
        Self { acting, found: OnceLock::new() }
    }

    /// The nodes between the elements of each beam.
    fn of_beams(&self, mesh: &Mesh, effects: &[Arc<dyn Effect>]) -> &[NodesBetween] {
        self.found.get_or_init(|| {
            let node = |number: &usize| mesh.nodes[*number].node;
            let of_beam = |beam: &MeshBeam| -> Vec<Vec<Slot>> {
                let nodes = |k: usize| &beam.nodes[k * beam.order..=(k + 1) * beam.order];
                (0..beam.elements.len()).map(|k| nodes(k).iter().map(|number| node(number).u).collect()).collect()
            };
            let elements: Vec<Vec<Slot>> = mesh.beams.iter().flat_map(of_beam).collect();
            let mut ends: HashMap<Slot, usize> = HashMap::new();
            let both_ends = elements.iter().flat_map(|nodes| [nodes[0], nodes[nodes.len() - 1]]);
            both_ends.for_each(|end| *ends.entry(end).or_default() += 1);
            let mut acts_at: HashSet<Slot> = self.acting.iter().copied().collect();
            acts_at.extend(coupled(mesh, effects, &elements.into_iter().collect()));
            let is_plain = |at: &Node| ends[&at.u] == 2 && !acts_at.contains(&at.u);
            let nodes_between = |beam: &MeshBeam| {
                let inner = &beam.nodes[1..beam.nodes.len() - 1];
                let nodes: Vec<Node> = inner.iter().skip(beam.order - 1).step_by(beam.order).map(node).collect();
                NodesBetween {
                    plain: nodes.iter().map(is_plain).collect(),
                    smooth: nodes.iter().map(|at| is_plain(at) && !acts_at.contains(&at.p)).collect(),
                }
            };
            mesh.beams.iter().map(nodes_between).collect()
        })
    }
}

/// The displacement slots of nodes that effects couple to others or to multipliers, except within an element.
fn coupled(mesh: &Mesh, effects: &[Arc<dyn Effect>], elements: &HashSet<Vec<Slot>>) -> HashSet<Slot> {
    let slots = mesh.nodes.iter().flat_map(|at| [(at.node.u, at.node.u), (at.node.p, at.node.u)]);
    let node_at: HashMap<Slot, Slot> = slots.collect();
    let mut found = HashSet::new();
    for connectivity in effects.iter().map(|effect| effect.connectivity()) {
        for instance in connectivity.iter() {
            let mut nodes: Vec<Option<Slot>> = instance.iter().map(|slot| node_at.get(slot).copied()).collect();
            nodes.dedup();
            let acts_at_one = nodes.len() == 1;
            let all_of_nodes = || nodes.iter().copied().collect::<Option<Vec<Slot>>>();
            let is_element = || all_of_nodes().is_some_and(|slots| elements.contains(&slots));
            if !acts_at_one && !is_element() {
                found.extend(nodes.into_iter().flatten());
            }
        }
    }
    found
}

impl BeamPoints<'_> {
    /// The point of a beam at a fraction of its length, which lies in an element at some xi, and, where it is a node
    /// between elements, in the next one, too.
    pub fn point(&self, number: usize, fraction: f64, place: (usize, f64), next: Option<(usize, f64)>) -> BeamPoint {
        let beam = &self.mesh.beams[number];
        let between = &self.actions.of_beams(self.mesh, self.effects)[number];
        let frame = beam.frame(fraction);
        let behind = if next.is_some() { beam.frame_behind(fraction) } else { frame };
        let is_smooth = || between.smooth[place.0 - beam.elements.start] && (frame - behind).max_abs() < STRAIGHT;
        let side = |(element, xi): (usize, f64), frame: Mat3| BeamSide { element: element as u32, xi, frame };
        let stiffness = beam.section.at(fraction).stiffness;
        BeamPoint {
            beam: number,
            fraction,
            elasticity: self.elasticity.to_vec(),
            elements: BeamElements { first: beam.elements.start as u32, plain: between.plain.clone() },
            sides: [side(place, frame)].into_iter().chain(next.map(|next| side(next, behind))).collect(),
            jumps: next.is_some() && !is_smooth(),
            compliance: Matrix6::from_fn(|i, j| stiffness[i][j]).try_inverse(),
            free: beam.free_strain.as_ref().map_or(Vector6::zeros(), |free| Vector6::from(free.strain)),
        }
    }
}
