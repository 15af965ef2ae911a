//! Sections from shapes, against closed forms, published numbers and other codes.

mod fuzz;
mod known;
mod reference;

use beamsim_core::section::Vector6;
use beamsim_core::section::analysis::StressField;
use beamsim_core::section::stress::{Corners, Peak};

/// The largest value of a measure of the stress at the nodes of a section under a load.
fn largest(
    StressField { mesh, nodal, .. }: &StressField,
    load: &Vector6,
    corners: Corners,
    measure: impl Fn(&Vector6) -> f64,
) -> Peak {
    let peak = |index: usize| {
        let place = nodal.places[index];
        let at = mesh.nodes[place.node as usize];
        Peak { value: measure(&(nodal.unit[index] * load)), at, region: place.region as usize }
    };
    let all = nodal.kept(mesh, corners).into_iter().map(peak);
    all.max_by(|a, b| a.value.total_cmp(&b.value)).expect("a node")
}
