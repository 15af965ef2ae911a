//! Round sections: circles, ellipses and tubes.

use super::Point;
use super::blocks::{Arc, BlockMesher};
use super::divide::equal;
use super::error::{SectionError, check_positive};
use super::grid::Fineness;
use super::mesh::{Mesh, Region};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Place of the corners of the middle block of a solid section, as a part of the radius
const MIDDLE_BLOCK: f64 = 0.55;

/// Meshes an ellipse by the half axes of its boundary, along 2 and 3, and of its hole.
pub fn mesh_ellipse(
    semi_axes: [f64; 2],
    hole: Option<[f64; 2]>,
    region: &Region,
    fineness: Fineness,
) -> Result<Mesh, SectionError> {
    for value in semi_axes {
        check_positive("the radius", value)?;
    }
    let per_quarter = (2.0 * fineness.least).round() as usize;
    let around = equal(per_quarter);
    let mut mesher = BlockMesher::new(vec![region.clone()]);
    let outside = ellipse(&mut mesher, semi_axes);
    match hole {
        Some(hole) => {
            let thickness = (semi_axes[0] - hole[0]).max(semi_axes[1] - hole[1]);
            let mean_radius = 0.25 * (semi_axes[0] + hole[0] + semi_axes[1] + hole[1]);
            let cell = FRAC_PI_2 * mean_radius / per_quarter as f64;
            let inside = ellipse(&mut mesher, hole);
            quarters(&mut mesher, inside, outside, &around, &equal((thickness / cell).ceil() as usize))?;
        }
        None => {
            let inside = quarter_points(semi_axes.map(|a| MIDDLE_BLOCK * a)).map(|at| mesher.vertex(at));
            // Corners at 45, 135, 225 and 315 degrees: the block begins at its lower left.
            mesher.block([inside[2], inside[3], inside[0], inside[1]], &around, &around, 0)?;
            quarters(&mut mesher, inside, outside, &around, &equal(around.len().div_ceil(2)))?;
        }
    }
    Ok(mesher.finish())
}

/// Four blocks between two closed lines.
fn quarters(
    mesher: &mut BlockMesher,
    inside: [u32; 4],
    outside: [u32; 4],
    around: &[f64],
    radial: &[f64],
) -> Result<(), SectionError> {
    for k in 0..4 {
        let next = (k + 1) % 4;
        mesher.block([inside[k], outside[k], outside[next], inside[next]], radial, around, 0)?;
    }
    Ok(())
}

/// Four vertices of an ellipse, with arcs between them.
fn ellipse(mesher: &mut BlockMesher, semi_axes: [f64; 2]) -> [u32; 4] {
    let vertices = quarter_points(semi_axes).map(|at| mesher.vertex(at));
    for k in 0..4 {
        let start = FRAC_PI_4 + k as f64 * FRAC_PI_2;
        let arc = Arc { centre: [0.0; 2], semi_axes, angles: [start, start + FRAC_PI_2] };
        mesher.arc(vertices[k], vertices[(k + 1) % 4], arc);
    }
    vertices
}

/// Points of an ellipse at parameters of 45, 135, 225 and 315 degrees.
fn quarter_points(semi_axes: [f64; 2]) -> [Point; 4] {
    std::array::from_fn(|k| {
        let angle = FRAC_PI_4 + k as f64 * FRAC_PI_2;
        [semi_axes[0] * libm::cos(angle), semi_axes[1] * libm::sin(angle)]
    })
}
