//! Joints: which nodes they connect, and whether a node's own unknowns hold it or multipliers do.
//!
//! A joint to ground that sits at its node needs no multipliers: it is a support, and its motor a
//! prescribed motion.

use super::mesh::Mesh;
use super::names;
use crate::deck::{self, Deck, Diagnostic, JointParts, PointRef, Spanned};
use beamsim_core::tensor::{Mat3, Vec3};

/// A joint as found on the mesh.
pub struct FoundJoint<'a> {
    /// The table
    pub(super) joint: &'a deck::Joint,
    /// The nodes A and B; `None` is ground
    pub(super) nodes: [Option<usize>; 2],
    /// From each node to the joint
    pub(super) arms: [Vec3; 2],
    /// e_1 (the axis), e_2, e_3 as columns
    pub(super) axes: Mat3,
    /// Its place at the start
    pub(super) place: Vec3,
}

impl FoundJoint<'_> {
    /// It joins one node to ground without an arm: a support and a motion of this node do its work.
    pub fn is_support(&self) -> bool {
        self.nodes[0].is_none() && self.arms[1] == Vec3::ZERO
    }
}

/// Finds the nodes of all joints.
pub fn find<'a>(deck: &'a Deck, mesh: &Mesh, diagnostics: &mut Vec<Diagnostic>) -> Vec<FoundJoint<'a>> {
    let mut found = Vec::new();
    for joint in &deck.joints {
        let connection = match &joint.parts {
            JointParts::Beams { at, beams } => between_beams(mesh, joint, at, beams),
            JointParts::Nodes { nodes, at } => {
                between_nodes(deck, mesh, joint, nodes, at.as_ref()).map_err(|d| diagnostics.push(d)).ok()
            }
        };
        found.extend(connection);
    }
    found
}

/// `None` where the mesh could not part the beams, which it has reported.
fn between_beams<'a>(
    mesh: &Mesh,
    joint: &'a deck::Joint,
    at: &Spanned<String>,
    beams: &[Spanned<String>],
) -> Option<FoundJoint<'a>> {
    let main = *mesh.points.get(&at.value)?;
    let own = |beam: &Spanned<String>| *mesh.parted.get(&(beam.value.clone(), at.value.clone())).unwrap_or(&main);
    let nodes = match beams {
        [first, second] => [Some(own(first)), Some(own(second))],
        [only] => [None, Some(own(only))],
        [] | [_, _, _, ..] => return None,
    };
    if nodes[0] == nodes[1] {
        return None;
    }
    let place = mesh.nodes[main].place;
    Some(FoundJoint { joint, nodes, arms: [Vec3::ZERO; 2], axes: axes(&joint.axes), place })
}

fn between_nodes<'a>(
    deck: &Deck,
    mesh: &Mesh,
    joint: &'a deck::Joint,
    names: &[Spanned<String>],
    at: Option<&Spanned<PointRef>>,
) -> Result<FoundJoint<'a>, Diagnostic> {
    let mut nodes = [None; 2];
    for (slot, name) in nodes.iter_mut().rev().zip(names.iter().rev()) {
        *slot = Some(mesh.find_node(deck, name)?.0);
    }
    if let [Some(a), Some(b)] = nodes
        && mesh.nodes[a].node.p == mesh.nodes[b].node.p
    {
        return Err(Diagnostic::error("both names refer to the same node", joint.span.clone()));
    }
    let last = nodes[1].map_or(Vec3::ZERO, |node| mesh.nodes[node].place);
    let place = at.map_or(Ok(last), |point| names::place(deck, point))?;
    let arms = nodes.map(|node| node.map_or(Vec3::ZERO, |node| place - mesh.nodes[node].place));
    Ok(FoundJoint { joint, nodes, arms, axes: axes(&joint.axes), place })
}

/// Completes the given axes to three.
fn axes(given: &[[f64; 3]]) -> Mat3 {
    let Some(&first) = given.first() else { return Mat3::IDENTITY };
    let first = Vec3(first);
    let second = given.get(1).copied().map_or_else(
        || {
            let least = (0..3).fold(0, |best, k| if first.0[k].abs() < first.0[best].abs() { k } else { best });
            first.cross(Vec3::UNIT[least]).normalized().unwrap_or(Vec3::UNIT[least])
        },
        Vec3,
    );
    Mat3::from_columns(first, second, first.cross(second))
}
