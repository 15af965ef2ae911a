//! Round sections: circles, ellipses, tubes, and rings of different materials around each other.

use super::Point;
use super::blocks::{Arc, BlockMesher};
use super::divide::equal;
use super::error::{SectionError, check_positive};
use super::grid::Fineness;
use super::mesh::{Mesh, Region};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Place of the corners of the middle block of a solid section, as a part of the radius
const MIDDLE_BLOCK: f64 = 0.55;

/// A ring: its outer boundary and its region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Half axes of the outer boundary along 2 and 3
    pub semi_axes: [f64; 2],
    /// Index of the region
    pub region: usize,
}

/// Meshes rings from inside to outside. `hole` are the half axes of the inner boundary; without
/// it, the first ring is solid.
pub fn mesh_rings(
    hole: Option<[f64; 2]>,
    rings: &[Ring],
    regions: &[Region],
    fineness: Fineness,
) -> Result<Mesh, SectionError> {
    let per_quarter = (2.0 * fineness.least).round() as usize;
    let around = equal(per_quarter);
    let mut mesher = BlockMesher::new(regions.to_vec());
    let mut rings = rings.iter();
    let mut inner = hole.unwrap_or([0.0; 2]);
    let mut inside = match hole {
        Some(semi_axes) => ellipse(&mut mesher, semi_axes),
        None => {
            let Some(core) = rings.next() else {
                return Err(SectionError::Dimensions { message: "the section has no ring".to_string() });
            };
            inner = core.semi_axes;
            solid(&mut mesher, core, &around)?
        }
    };
    for ring in rings {
        for axis in 0..2 {
            let what = format!("the thickness of `{}`", regions[ring.region].name);
            let value = ring.semi_axes[axis] - inner[axis];
            check_positive(what, value)?;
        }
        let outside = ellipse(&mut mesher, ring.semi_axes);
        let thickness = (ring.semi_axes[0] - inner[0]).max(ring.semi_axes[1] - inner[1]);
        let mean_radius = 0.25 * (ring.semi_axes[0] + inner[0] + ring.semi_axes[1] + inner[1]);
        let cell = FRAC_PI_2 * mean_radius / per_quarter as f64;
        let radial = equal((thickness / cell).ceil() as usize);
        quarters(&mut mesher, inside, outside, &around, &radial, ring.region)?;
        inside = outside;
        inner = ring.semi_axes;
    }
    Ok(mesher.finish())
}

/// The middle block and four blocks around it; gives the outer vertices.
fn solid(mesher: &mut BlockMesher, core: &Ring, around: &[f64]) -> Result<[u32; 4], SectionError> {
    for value in core.semi_axes {
        check_positive("the radius", value)?;
    }
    let middle = quarter_points(core.semi_axes.map(|a| MIDDLE_BLOCK * a)).map(|at| mesher.vertex(at));
    let outside = ellipse(mesher, core.semi_axes);
    // Corners at 45, 135, 225 and 315 degrees: the block begins at its lower left.
    mesher.block([middle[2], middle[3], middle[0], middle[1]], around, around, core.region as u32)?;
    let radial = equal(around.len().div_ceil(2));
    quarters(mesher, middle, outside, around, &radial, core.region)?;
    Ok(outside)
}

/// Four blocks between two closed lines.
fn quarters(
    mesher: &mut BlockMesher,
    inside: [u32; 4],
    outside: [u32; 4],
    around: &[f64],
    radial: &[f64],
    region: usize,
) -> Result<(), SectionError> {
    for k in 0..4 {
        let next = (k + 1) % 4;
        mesher.block([inside[k], outside[k], outside[next], inside[next]], radial, around, region as u32)?;
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
