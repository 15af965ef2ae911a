//! The interface of the kernels: they read motions of nodes and weights, and write the force and
//! tangent of one element.

use crate::scalar::{Lanes, Real};
use crate::tensor::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// The largest number of nodes of an element.
pub const MAX_NODES: usize = 4;

/// The weights of J = s K + d C + m M. A weight of zero means: do not compute it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Weights {
    /// s, of the stiffness K = dg/dq
    pub stiffness: f64,
    /// d, of C = dg/dv
    pub damping: f64,
    /// m, of M = dg/da
    pub mass: f64,
}

impl Weights {
    /// The stiffness alone.
    pub const STIFFNESS: Self = Self { stiffness: 1.0, damping: 0.0, mass: 0.0 };
    /// The gyroscopic and damping matrix alone.
    pub const DAMPING: Self = Self { stiffness: 0.0, damping: 1.0, mass: 0.0 };
    /// The mass matrix alone.
    pub const MASS: Self = Self { stiffness: 0.0, damping: 0.0, mass: 1.0 };
    /// Forces only.
    pub const NONE: Self = Self { stiffness: 0.0, damping: 0.0, mass: 0.0 };
}

/// Displacement, rotation vector and their rates at a node or, interpolated, at a point (global
/// components).
#[derive(Clone, Copy, Debug)]
pub struct NodeMotion<T = f64> {
    /// u
    pub u: Vec3<T>,
    /// du/dt
    pub u_rate: Vec3<T>,
    /// d2u/dt2
    pub u_rate2: Vec3<T>,
    /// P, the rotation vector in the chart of the evaluation
    pub p: Vec3<T>,
    /// dP/dt
    pub p_rate: Vec3<T>,
    /// d2P/dt2
    pub p_rate2: Vec3<T>,
}

/// Displacement and rotation vector at a node (global components).
#[derive(Clone, Copy, Debug)]
pub struct NodePlace<T = f64> {
    /// u
    pub(crate) u: Vec3<T>,
    /// P, the rotation vector in the chart of the evaluation
    pub p: Vec3<T>,
}

impl<T: Real> NodePlace<T> {
    /// The initial placement: no displacement, no rotation.
    #[inline(always)]
    pub fn rest() -> Self {
        Self { u: Vec3::zero(), p: Vec3::zero() }
    }
}

/// A node, moving or not, that has a displacement and a rotation vector.
pub trait Placed<T> {
    /// The displacement and the rotation vector.
    fn place(&self) -> NodePlace<T>;
}

impl<T: Copy> Placed<T> for NodePlace<T> {
    #[inline(always)]
    fn place(&self) -> NodePlace<T> {
        *self
    }
}

impl<T: Copy> Placed<T> for NodeMotion<T> {
    #[inline(always)]
    fn place(&self) -> NodePlace<T> {
        NodePlace { u: self.u, p: self.p }
    }
}

impl<T: Real> NodeMotion<T> {
    /// The motion of a node at rest in the initial placement.
    pub fn rest() -> Self {
        let o = Vec3::zero();
        Self { u: o, u_rate: o, u_rate2: o, p: o, p_rate: o, p_rate2: o }
    }
}

/// The force g and the tangent J of one element, in 3-vectors and 3x3 blocks.
///
/// Elements with displacements and rotations order their blocks node by node: u1, P1, u2, P2, …;
/// elements with one kind of unknown: u1, u2, … or P1, P2, …. The tangent is kept in tiles of two
/// blocks by two, as nodes have them.
#[derive(Clone, Debug)]
pub struct ElementSystem<T = f64> {
    blocks: usize,
    force: Vec<[T; 3]>,
    tangent: Vec<[T; TILE]>,
}

/// Rows and columns of a tile: two blocks of three.
pub const WIDTH: usize = 6;

/// Numbers in a tile.
pub const TILE: usize = WIDTH * WIDTH;

impl ElementSystem<Lanes> {
    /// The system of lane `k`: one of the elements that are evaluated together.
    pub fn lane(&self, k: usize) -> ElementSystem {
        let mut out = ElementSystem::new(self.blocks);
        for (one, all) in out.force.iter_mut().zip(&self.force) {
            *one = all.map(|lanes| lanes.0[k]);
        }
        for (one, all) in out.tangent.iter_mut().zip(self.tiles()) {
            *one = all.map(|lanes| lanes.0[k]);
        }
        out
    }
}

impl<T: Real> ElementSystem<T> {
    /// Zero, of `blocks` 3-vectors.
    #[inline(always)]
    pub fn new(blocks: usize) -> Self {
        let zero = T::zero();
        let across = blocks.div_ceil(2);
        Self { blocks, force: vec![[zero; 3]; blocks], tangent: vec![[zero; TILE]; across * across] }
    }

    /// Sets force and tangent to zero.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.clear_force();
        self.tangent.fill([T::zero(); TILE]);
    }

    /// Sets the force alone to zero.
    #[inline(always)]
    pub fn clear_force(&mut self) {
        self.force.fill([T::zero(); 3]);
    }

    /// Sets the force to zero and, unless all weights are zero, the tangent, so that both can be
    /// summed up.
    #[inline(always)]
    pub fn clear_for(&mut self, weights: Weights) {
        if weights == Weights::NONE { self.clear_force() } else { self.clear() }
    }

    /// Adds the force of another system with equal blocks, and its tangent if `tangent` is set.
    pub fn add_system(&mut self, other: &Self, tangent: bool) {
        let add = |to: &mut [T], of: &[T]| to.iter_mut().zip(of).for_each(|(sum, part)| *sum += *part);
        add(self.force.as_flattened_mut(), other.force.as_flattened());
        if tangent {
            add(self.tangent.as_flattened_mut(), other.tangent.as_flattened());
        }
    }

    /// The number of 3-vectors.
    #[inline(always)]
    pub fn blocks(&self) -> usize {
        self.blocks
    }

    /// Tiles in a row of tiles.
    #[inline(always)]
    fn across(&self) -> usize {
        self.blocks.div_ceil(2)
    }

    /// The force, one entry a row.
    #[inline(always)]
    pub fn force(&self) -> &[T] {
        self.forces().as_flattened()
    }

    /// The force, block by block.
    #[inline(always)]
    pub fn forces(&self) -> &[[T; 3]] {
        &self.force
    }

    /// The tangent by tiles: row of tiles after row of tiles, each tile by columns. With an odd
    /// number of blocks the last tiles are only partly used.
    #[inline(always)]
    pub fn tiles(&self) -> &[[T; TILE]] {
        &self.tangent
    }

    /// The tangent by its rows.
    pub fn tangent(&self) -> Vec<T> {
        let row = |i: usize| (0..self.blocks).flat_map(move |j| self.tangent_block(i / 3, j).0[i % 3]);
        (0..3 * self.blocks).flat_map(row).collect()
    }

    /// Adds to the force of a block.
    #[inline(always)]
    pub fn add_force(&mut self, block: usize, f: Vec3<T>) {
        for i in 0..3 {
            self.force[block][i] += f.0[i];
        }
    }

    /// The force of a block.
    #[inline(always)]
    pub fn force_block(&self, block: usize) -> Vec3<T> {
        Vec3(self.force[block])
    }

    /// Replaces the force of a block.
    #[inline(always)]
    pub fn set_force(&mut self, block: usize, f: Vec3<T>) {
        self.force[block] = f.0;
    }

    /// The number of the tile that holds a block, and the place of the block's first entry in it.
    #[inline(always)]
    fn place(&self, row: usize, column: usize) -> (usize, usize) {
        (row / 2 * self.across() + column / 2, column % 2 * 3 * WIDTH + row % 2 * 3)
    }

    /// Adds to a block of the tangent.
    #[inline(always)]
    pub fn add_tangent(&mut self, row: usize, column: usize, m: Mat3<T>) {
        let (tile, start) = self.place(row, column);
        let tile = &mut self.tangent[tile];
        for i in 0..3 {
            for j in 0..3 {
                tile[start + j * WIDTH + i] += m.0[i][j];
            }
        }
    }

    /// Adds to a block of a symmetric tangent, and to its mirror image.
    #[inline(always)]
    pub fn add_symmetric(&mut self, row: usize, column: usize, m: &Mat3<T>) {
        let places = [self.place(row, column), self.place(column, row)];
        for i in 0..3 {
            for j in 0..3 {
                let [(tile, start), (mirrored, begin)] = places;
                self.tangent[tile][start + j * WIDTH + i] += m.0[i][j];
                self.tangent[mirrored][begin + i * WIDTH + j] += m.0[i][j];
            }
        }
    }

    /// A block of the tangent.
    #[inline(always)]
    pub fn tangent_block(&self, row: usize, column: usize) -> Mat3<T> {
        let (tile, start) = self.place(row, column);
        let tile = &self.tangent[tile];
        let mut out = Mat3::zero();
        for i in 0..3 {
            for j in 0..3 {
                out.0[i][j] = tile[start + j * WIDTH + i];
            }
        }
        out
    }

    /// A system of the chosen blocks alone, in the order of `blocks`.
    pub fn part(&self, blocks: &[usize]) -> Self {
        let mut out = Self::new(blocks.len());
        for (row, &i) in blocks.iter().enumerate() {
            out.set_force(row, self.force_block(i));
            for (column, &j) in blocks.iter().enumerate() {
                out.set_tangent(row, column, &self.tangent_block(i, j));
            }
        }
        out
    }

    /// Replaces a block of the tangent.
    #[inline(always)]
    pub fn set_tangent(&mut self, row: usize, column: usize, m: &Mat3<T>) {
        let (tile, start) = self.place(row, column);
        let tile = &mut self.tangent[tile];
        for i in 0..3 {
            for j in 0..3 {
                tile[start + j * WIDTH + i] = m.0[i][j];
            }
        }
    }

    /// Replaces a block of a symmetric tangent, and its mirror image.
    #[inline(always)]
    pub fn set_symmetric(&mut self, row: usize, column: usize, m: &Mat3<T>) {
        self.set_tangent(row, column, m);
        let (tile, start) = self.place(column, row);
        let tile = &mut self.tangent[tile];
        for i in 0..3 {
            for j in 0..3 {
                tile[start + i * WIDTH + j] = m.0[i][j];
            }
        }
    }
}
