//! Points of beams that strains and resultants are read at.

use super::mesh::{Mesh, MeshBeam};
use beamsim_core::effect::Effect;
use beamsim_core::effect::elasticity::StressField;
use beamsim_core::probe::{BeamElements, BeamPoint};
use beamsim_core::system::Slot;
use std::collections::{HashMap, HashSet};
use std::sync::{Arc, OnceLock};

/// Nodes within beams at which nothing acts but the two elements beside them, with their loads and masses: forces jump
/// there only by what acts along the beam.
pub struct PlainNodes {
    /// Slots at which something acts
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
    /// Nodes of a scene with things that act at the slots `acting`. Joints and others that couple nodes are found in its
    /// effects.
    pub fn new(acting: Vec<Slot>) -> Self {
        Self { acting, found: OnceLock::new() }
    }

    /// For each beam with elements of two nodes, each node between two of them.
    fn of_beams(&self, mesh: &Mesh, effects: &[Arc<dyn Effect>]) -> &[Arc<[bool]>] {
        self.found.get_or_init(|| {
            let displacement =
                |beam: &MeshBeam| -> Vec<Slot> { beam.nodes.iter().map(|&node| mesh.nodes[node].node.u).collect() };
            let beams: Vec<Vec<Slot>> = mesh.beams.iter().map(displacement).collect();
            let elements: HashSet<[Slot; 2]> = beams.iter().flat_map(|beam| beam.array_windows().copied()).collect();
            let node_at: HashMap<Slot, Slot> =
                mesh.nodes.iter().flat_map(|at| [(at.node.u, at.node.u), (at.node.p, at.node.u)]).collect();
            let mut not_plain: HashSet<Slot> = self.acting.iter().copied().collect();
            let mut ends: HashMap<Slot, usize> = HashMap::new();
            beams
                .iter()
                .flat_map(|beam| beam.array_windows::<2>())
                .flatten()
                .for_each(|&end| *ends.entry(end).or_default() += 1);
            for connectivity in effects.iter().map(|effect| effect.connectivity()) {
                for instance in connectivity.iter() {
                    let mut nodes: Vec<Option<Slot>> = instance.iter().map(|slot| node_at.get(slot).copied()).collect();
                    nodes.dedup();
                    let acts_at_one = matches!(nodes[..], [_]);
                    let is_element = matches!(nodes[..], [Some(a), Some(b)] if elements.contains(&[a, b]));
                    if !acts_at_one && !is_element {
                        not_plain.extend(nodes.into_iter().flatten());
                    }
                }
            }
            let is_plain = |slot: &Slot| ends[slot] == 2 && !not_plain.contains(slot);
            beams.iter().map(|beam| beam.iter().skip(1).map(is_plain).collect()).collect()
        })
    }
}

impl BeamPoints<'_> {
    /// The point of a beam at a fraction of its length, which lies in elements at some xi: two at a node between elements.
    pub fn point(&self, number: usize, fraction: f64, sides: Vec<(u32, f64)>) -> BeamPoint {
        let beam = &self.mesh.beams[number];
        let plain = match beam.order {
            1 => self.plain.of_beams(self.mesh, self.effects)[number].clone(),
            _ => Arc::default(),
        };
        BeamPoint {
            beam: number,
            fraction,
            elasticity: self.elasticity.to_vec(),
            elements: BeamElements { first: beam.elements.start as u32, plain },
            sides,
            frame: beam.frame(fraction),
        }
    }
}
