//! The shape of a scene, for pictures.

use super::beam_points::BeamPoints;
use super::mesh::MeshBeam;
use beamsim_core::effect::contact::SurfaceContacts;
use beamsim_core::effect::inertia::Body;
use beamsim_core::effect::spring::Link;
use beamsim_core::probe::{Figure, Line, LinePoint, Place};
use beamsim_core::section::recovery::PlacedRecovery;
use beamsim_core::tensor::Mat3;
use std::sync::Arc;

/// Stresses of the sections at the nodes of each beam, where they are known
pub type SectionsAtNodes = Vec<Vec<Option<PlacedRecovery>>>;

/// Every node of every beam, the rigid bodies, and the ends of what joins two nodes. `sections` may be
/// empty.
pub fn figure(
    points: BeamPoints,
    bodies: &[Body],
    links: &[Link],
    sections: &SectionsAtNodes,
    contacts: Option<Arc<SurfaceContacts>>,
) -> Figure {
    let section = |number: usize, k: usize| sections.get(number).and_then(|beam| beam[k].clone());
    let line = |(number, beam): (usize, &MeshBeam)| Line {
        name: beam.name.clone(),
        order: beam.order,
        points: (0..beam.nodes.len()).map(|k| point(&points, number, k, section(number, k))).collect(),
    };
    let bare = |node, place| Place { nodes: vec![(node, place, 1.0)], frame: Mat3::IDENTITY, relative: false };
    let ends = |link: &Link| [0, 1].map(|k| bare(link.nodes[k], link.places[k]));
    Figure {
        lines: points.mesh.beams.iter().enumerate().map(line).collect(),
        bodies: bodies.iter().map(|body| bare(body.node, body.place)).collect(),
        links: links.iter().map(ends).collect(),
        contacts,
    }
}

fn point(points: &BeamPoints, number: usize, k: usize, section: Option<PlacedRecovery>) -> LinePoint {
    let mesh = points.mesh;
    let beam = &mesh.beams[number];
    let node = &mesh.nodes[beam.nodes[k]];
    let fraction = beam.fractions[k];
    let frame = beam.frame(fraction);
    let (element, at) = (beam.elements.start + k / beam.order, k % beam.order);
    let here = (element, 2.0 * at as f64 / beam.order as f64 - 1.0);
    let before = (at == 0 && k > 0).then(|| (element - 1, 1.0));
    let next = (k + 1 < beam.nodes.len()).then_some(here);
    LinePoint {
        place: Place { nodes: vec![(node.node, node.place, 1.0)], frame, relative: false },
        inside: match before {
            Some(before) => points.point(number, fraction, before, next),
            None => points.point(number, fraction, here, None),
        },
        section,
    }
}
