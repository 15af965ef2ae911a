//! Points of beams that strains and resultants are read at.

use super::mesh::{Mesh, MeshBeam};
use beamsim_core::effect::Effect;
use beamsim_core::effect::elasticity::StressField;
use beamsim_core::probe::{BeamElements, BeamPoint};
use beamsim_core::section::{Matrix6, Vector6};
use beamsim_core::system::Slot;
use std::collections::{HashMap, HashSet};
use std::sync::{Arc, OnceLock};

/// Nodes within beams at which no concentrated force acts: forces jump there only by what acts along the beam (loads,
/// gravity, inertia). What acts on rotations alone does not matter.
pub struct PlainNodes {
    /// Slots at which something acts; joints and sliders are not among them, but found in the effects
    acting: Vec<Slot>,
    /// For each beam, looked for when they are asked for first
    found: OnceLock<Vec<Arc<[bool]>>>,
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
    /// See [`PlainNodes`]
    pub(super) plain: &'a PlainNodes,
}

impl PlainNodes {
    /// Nodes of a scene in which supports, motions, loads, bodies, springs and contacts act at the slots `acting`.
    pub fn new(acting: Vec<Slot>) -> Self {
        Self { acting, found: OnceLock::new() }
    }

    /// For each beam each node between two elements, where elements have two nodes.
    fn of_beams(&self, mesh: &Mesh, effects: &[Arc<dyn Effect>]) -> &[Arc<[bool]>] {
        self.found.get_or_init(|| {
            let slots = |beam: &MeshBeam| beam.nodes.iter().map(|&node| mesh.nodes[node].node.u).collect();
            let beams: Vec<Vec<Slot>> = mesh.beams.iter().map(slots).collect();
            let elements: Vec<[Slot; 2]> =
                beams.iter().flat_map(|beam| beam.windows(2).map(|w| [w[0], w[1]])).collect();
            let mut ends: HashMap<Slot, usize> = HashMap::new();
            elements.iter().flatten().for_each(|&end| *ends.entry(end).or_default() += 1);
            let mut loaded_or_coupled: HashSet<Slot> = self.acting.iter().copied().collect();
            loaded_or_coupled.extend(coupled(mesh, effects, &elements.into_iter().collect()));
            let is_plain = |slot: &Slot| ends[slot] == 2 && !loaded_or_coupled.contains(slot);
            beams.iter().map(|beam| beam[1..beam.len() - 1].iter().map(is_plain).collect()).collect()
        })
    }
}

/// The displacement slots of nodes that effects couple to others or to multipliers, except neighbours on a beam.
fn coupled(mesh: &Mesh, effects: &[Arc<dyn Effect>], elements: &HashSet<[Slot; 2]>) -> HashSet<Slot> {
    let slots = mesh.nodes.iter().flat_map(|at| [(at.node.u, at.node.u), (at.node.p, at.node.u)]);
    let node_at: HashMap<Slot, Slot> = slots.collect();
    let mut found = HashSet::new();
    for connectivity in effects.iter().map(|effect| effect.connectivity()) {
        for instance in connectivity.iter() {
            let mut nodes: Vec<Option<Slot>> = instance.iter().map(|slot| node_at.get(slot).copied()).collect();
            nodes.dedup();
            let acts_at_one = nodes.len() == 1;
            let is_element = matches!(nodes[..], [Some(start), Some(end)] if elements.contains(&[start, end]));
            if !acts_at_one && !is_element {
                found.extend(nodes.into_iter().flatten());
            }
        }
    }
    found
}

impl BeamPoints<'_> {
    /// The point of a beam at a fraction of its length, which lies in elements at some xi: two at a node between elements.
    pub fn point(&self, number: usize, fraction: f64, sides: Vec<(u32, f64)>) -> BeamPoint {
        let beam = &self.mesh.beams[number];
        let plain = match beam.order {
            1 => self.plain.of_beams(self.mesh, self.effects)[number].clone(),
            _ => Arc::default(),
        };
        let stiffness = beam.section.at(fraction).stiffness;
        BeamPoint {
            beam: number,
            fraction,
            elasticity: self.elasticity.to_vec(),
            elements: BeamElements { first: beam.elements.start as u32, plain },
            sides,
            frame: beam.frame(fraction),
            compliance: Matrix6::from_fn(|i, j| stiffness[i][j]).try_inverse(),
            free: beam.free_strain.as_ref().map_or(Vector6::zeros(), |free| Vector6::from(free.strain)),
        }
    }
}
