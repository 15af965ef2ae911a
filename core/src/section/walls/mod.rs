//! Walls of plies along lines: open, closed and branched, straight and round, as blocks of
//! quadrilaterals.
//!
//! At a point where two walls meet they are mitred. Where more meet, the two that continue each
//! other best go through, and the others end at their faces (butt joints). Walls that go through
//! one another's ends make up a chain, which is one strip of blocks: all walls of a chain have
//! blocks between the same faces, so that plies may begin and end at joints.

mod branches;
mod cells;
mod joints;
mod line;
mod steps;
mod strips;
mod twins;
mod wall;

pub use wall::{Bend, Ply, Wall, Walls};

use super::error::SectionError;
use super::grid::Fineness;
use super::mesh::Mesh;
use joints::joints;
use strips::Strips;

/// Meshes walls.
pub fn mesh_walls(walls: &Walls, fineness: Fineness) -> Result<Mesh, SectionError> {
    let walls = &walls.with_twins_parted()?.with_steps_away_from_branches()?;
    let lines = walls.lines()?;
    let joints = joints(walls, &lines)?;
    let mut strips = Strips::new(walls, lines, joints)?;
    strips.add_faces()?;
    strips.cut()?;
    strips.mesh(fineness)
}
