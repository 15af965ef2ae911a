//! Assembly of element forces and tangents into the system: into all of it, or into the slice of
//! one region.

use super::category::Category;
use super::dof_map::DofMap;
use super::node_blocks::NodeBlocks;
use super::pattern::{Pattern, ScatterMap, TILE, WIDTH};
use super::plane::Plane;
use super::state::Slot;
use super::values::{BlockMut, TileValues};
use crate::kernel::{ElementSystem, PlanarSystem};
use crate::scalar::{LANES, Lanes, each_lane};
use crate::tensor::{Mat3, Vec3};
use std::ops::Range;

/// A slice of the system that one thread writes to: the slots, equations and tiles of one region,
/// or all of them.
pub struct SystemSlice<'a> {
    pub(super) pattern: &'a Pattern,
    /// Indices ([`Category`] as a number) of the force categories that some effect adds to in this
    /// slice
    pub(super) acting: &'a [usize],
    /// Index of the region; `None` if the slice is the whole system
    pub(super) region: Option<usize>,
    /// Nodal forces of the slots of this slice, one list per category (global components)
    pub(super) force: [&'a mut [Vec3]; 4],
    /// Tangent values of the tiles of this slice
    pub(super) values: TileValues<'a>,
    /// Prescribed increments of all slots of the scene (global components); `None` if nothing is
    /// prescribed
    pub(super) prescribed_increment: Option<&'a [Vec3]>,
    /// Tangent times prescribed increments, one number per equation of this slice
    pub(super) prescribed_forces: &'a mut [f64],
    pub(super) buffers: &'a mut Vec<ElementSystem<Lanes>>,
}

impl<'a> SystemSlice<'a> {
    /// Sets the forces of the acting categories to zero, and the tangent if it is going to be
    /// formed.
    pub fn clear(&mut self, with_tangent: bool) {
        self.acting.iter().for_each(|&category| self.force[category].fill(Vec3::ZERO));
        if with_tangent {
            self.values.clear();
        }
    }

    /// Ranges of the instances of effect number `effect` that lie in this region; for the whole
    /// system, of the instances that lie in no single region.
    pub fn instances(&self, effect: usize) -> &'a [Range<usize>] {
        self.pattern.places[effect].ranges.of(self.region)
    }

    /// Assembler of the given instances of effect number `effect`, which borrows this slice.
    pub fn assembler(
        &mut self,
        effect: usize,
        category: Category,
        with_tangent: bool,
        instances: Range<usize>,
    ) -> Assembler<'_> {
        let SystemSlice { pattern, acting, region, force, values, prescribed_increment, prescribed_forces, buffers } =
            self;
        let force = force.each_mut().map(|force| &mut force[..]);
        let values = values.reborrow();
        let part = SystemSlice {
            pattern,
            acting,
            region: *region,
            force,
            values,
            prescribed_increment: *prescribed_increment,
            prescribed_forces,
            buffers,
        };
        part.into_assembler(effect, category, with_tangent, instances)
    }

    /// Assembler of the given instances of effect number `effect`, which takes over the borrows of
    /// this slice.
    pub(super) fn into_assembler(
        self,
        effect: usize,
        category: Category,
        with_tangent: bool,
        instances: Range<usize>,
    ) -> Assembler<'a> {
        let SystemSlice { pattern, acting, region, force, values, prescribed_increment, prescribed_forces, buffers } =
            self;
        debug_assert!(acting.contains(&(category as usize)), "forces of a category that nothing clears");
        let start = region.map(|region| &pattern.regions[region]);
        let [internal, inertia, external, damping] = force;
        let (force, damping) = match category {
            Category::Internal => (internal, Some(damping)),
            Category::Inertia => (inertia, Some(damping)),
            Category::External => (external, Some(damping)),
            Category::Damping => (damping, None),
        };
        Assembler {
            places: &pattern.places[effect],
            pattern,
            instances,
            first_slot: start.map_or(0, |region| region.slots.start),
            first_equation: start.map_or(0, |region| region.equations.start),
            force,
            damping,
            values,
            prescribed_increment,
            prescribed_forces,
            buffers,
            with_tangent,
            may_damp: acting.contains(&(Category::Damping as usize)),
        }
    }
}

/// Adds one lane of an element tile to the tangent, in vectors of [`LANES`] numbers if the tile is
/// stored contiguously.
#[inline(always)]
fn add_lane(mut place: BlockMut, tile: &[Lanes; TILE], lane: usize) {
    match &mut place {
        BlockMut::Whole(values) => {
            for (sums, lanes) in values[..TILE].as_chunks_mut::<LANES>().0.iter_mut().zip(tile.as_chunks::<LANES>().0) {
                *sums = (Lanes(*sums) + Lanes(each_lane!(|k| lanes[k].0[lane]))).0;
            }
        }
        BlockMut::Upper(..) | BlockMut::Nowhere => place.add_tile::<WIDTH>(|entry| tile[entry].0[lane]),
    }
}

/// Row and column in the tile of the first entry of the block that couples two slots of an
/// instance.
#[inline(always)]
fn corner(node_blocks: &NodeBlocks, slots: &[Slot], pair: [usize; 2]) -> [usize; 2] {
    pair.map(|number| node_blocks.row(slots[number]).row)
}

/// An unknown of a planar element.
struct PlanarUnknown {
    /// Number of its slot in the instance
    number: usize,
    slot: Slot,
    /// Equation, or [`DofMap::HELD`]
    equation: u32,
}

/// Access for an effect to add the forces and tangents of its instances.
pub struct Assembler<'a> {
    places: &'a ScatterMap,
    pattern: &'a Pattern,
    instances: Range<usize>,
    /// First slot of the slice, by which slot indices are shifted
    first_slot: usize,
    first_equation: usize,
    /// Nodal forces of the category of the effect
    force: &'a mut [Vec3],
    /// Nodal damping forces; `None` if the category of the effect is damping itself
    damping: Option<&'a mut [Vec3]>,
    values: TileValues<'a>,
    prescribed_increment: Option<&'a [Vec3]>,
    prescribed_forces: &'a mut [f64],
    buffers: &'a mut Vec<ElementSystem<Lanes>>,
    with_tangent: bool,
    /// True if damping is among the acting categories, so that its forces have been cleared.
    may_damp: bool,
}

impl Assembler<'_> {
    /// Range of instances to add: all of them, unless the effect is
    /// [divisible](super::Connectivity::divisible).
    pub fn instances(&self) -> Range<usize> {
        self.instances.clone()
    }

    /// Lends a buffer of `blocks` blocks for element forces and tangents. Its forces are those of
    /// the last user. A tangent is zero unless the effect forms it (`forms_tangent`) by assignment.
    pub fn lend(&mut self, blocks: usize, forms_tangent: bool) -> ElementSystem<Lanes> {
        let Some(fits) = self.buffers.iter().position(|system| system.blocks() == blocks) else {
            return ElementSystem::new(blocks);
        };
        let mut system = self.buffers.swap_remove(fits);
        if self.with_tangent && !forms_tangent {
            system.clear();
        }
        system
    }

    /// Takes a lent buffer back for the next evaluation.
    pub fn take_back(&mut self, system: ElementSystem<Lanes>) {
        self.buffers.push(system);
    }

    /// Adds forces and tangent of instance `k`; the blocks of `element` are in the order of the
    /// slots of the instance.
    pub fn add(&mut self, k: usize, element: &ElementSystem) {
        let forces = &mut *self.force;
        let first_slot = self.first_slot;
        for (force, &slot) in element.forces().iter().zip(self.places.connectivity.get(k)) {
            forces[slot as usize - first_slot] += Vec3(*force);
        }
        if !self.with_tangent {
            return;
        }
        if self.is_constrained(k) {
            self.add_constrained(k, element.tiles(), |value| *value);
        } else {
            self.add_tangent(k, element);
        }
    }

    /// Adds the first `count` lanes of `elements`, which are the instances from `first` on, in
    /// their order, so that sums do not depend on which instances share a vector. Instances for
    /// which `is_apart` holds are passed to `alone` instead.
    #[inline(always)]
    pub fn add_lanes(
        &mut self,
        first: usize,
        count: usize,
        elements: &ElementSystem<Lanes>,
        is_apart: impl Fn(usize) -> bool,
        mut alone: impl FnMut(usize, &mut Self),
    ) {
        if !(0..count).any(|lane| is_apart(lane) || self.is_constrained(first + lane)) {
            return self.add_free(first, count, elements);
        }
        for lane in 0..count {
            if is_apart(lane) {
                alone(lane, self);
            } else {
                self.add_one_lane(first + lane, elements, lane);
            }
        }
    }

    /// True if the tangent of instance `k` cannot be added tile by tile, since some of its slots
    /// have held directions or rotated axes. In planar scenes this holds for every instance.
    #[inline(always)]
    fn is_constrained(&self, k: usize) -> bool {
        self.with_tangent && (self.places.special[k] || self.pattern.dof_map.plane().is_some())
    }

    #[inline(always)]
    fn add_forces(&mut self, k: usize, elements: &ElementSystem<Lanes>, lane: usize) {
        let forces = &mut *self.force;
        let first_slot = self.first_slot;
        for (force, &slot) in elements.forces().iter().zip(self.places.connectivity.get(k)) {
            forces[slot as usize - first_slot] += Vec3([force[0].0[lane], force[1].0[lane], force[2].0[lane]]);
        }
    }

    /// Adds instance `k`, which is one lane of `elements`. It is compiled once, not for every kernel
    /// that runs in lanes: most rows of instances are free.
    #[inline(never)]
    fn add_one_lane(&mut self, k: usize, elements: &ElementSystem<Lanes>, lane: usize) {
        self.add_forces(k, elements, lane);
        if !self.with_tangent {
            return;
        }
        if self.is_constrained(k) {
            self.add_constrained(k, elements.tiles(), |lanes| lanes.0[lane]);
        } else if self.places.whole {
            self.add_whole(k, elements, lane);
        } else {
            self.add_blocks_of_lane(k, elements, lane);
        }
    }

    /// Adds the first `count` lanes of `elements`, whose instances from `first` on have neither held
    /// directions nor rotated axes.
    #[inline(always)]
    fn add_free(&mut self, first: usize, count: usize, elements: &ElementSystem<Lanes>) {
        for lane in 0..count {
            self.add_forces(first + lane, elements, lane);
        }
        if !self.with_tangent {
            return;
        }
        if self.places.whole {
            for lane in 0..count {
                self.add_whole(first + lane, elements, lane);
            }
            return;
        }
        for lane in 0..count {
            self.add_blocks_of_lane(first + lane, elements, lane);
        }
    }

    /// Adds the tangent of instance `k`, one lane of `elements`, which couples whole nodes.
    #[inline(always)]
    fn add_whole(&mut self, k: usize, elements: &ElementSystem<Lanes>, lane: usize) {
        for (tile, &place) in elements.tiles().iter().zip(self.places.of(k)) {
            add_lane(self.values.tile(place), tile, lane);
        }
    }

    /// Adds the tangent of instance `k`, one lane of `elements`, block by block.
    #[inline(never)]
    fn add_blocks_of_lane(&mut self, k: usize, elements: &ElementSystem<Lanes>, lane: usize) {
        self.add_blocks(k, elements.blocks(), elements.tiles(), |lanes| lanes.0[lane]);
    }

    /// Adds the first `count` lanes of planar elements, which are the instances from `first` on and
    /// couple whole nodes. Instances for which `is_apart` holds, or whose slots have other axes
    /// than the plane, are passed to `alone`.
    #[inline(always)]
    pub fn add_planar<const N: usize>(
        &mut self,
        plane: &Plane,
        first: usize,
        count: usize,
        elements: &PlanarSystem<N, Lanes>,
        is_apart: impl Fn(usize) -> bool,
        mut alone: impl FnMut(usize, &mut Self),
    ) {
        let forces = elements.forces_in_space(plane.axes());
        for lane in 0..count {
            let special = self.with_tangent && self.places.special[first + lane];
            if is_apart(lane) || (special && self.has_turned_axes(plane, first + lane)) {
                alone(lane, self);
                continue;
            }
            let all = &mut *self.force;
            let first_slot = self.first_slot;
            for (force, &slot) in forces.as_flattened().iter().zip(self.places.connectivity.get(first + lane)) {
                all[slot as usize - first_slot] += Vec3(force.0.map(|component| component.0[lane]));
            }
            if !self.with_tangent {
                continue;
            }
            if special || !self.places.whole {
                self.add_planar_entries(first + lane, elements, lane);
                continue;
            }
            for (tile, &place) in elements.tangent.as_flattened().iter().zip(self.places.of(first + lane)) {
                self.values.tile(place).add_tile::<3>(|entry| tile[entry].0[lane]);
            }
        }
    }

    /// Adds instance `k` of an effect that couples displacements by an isotropic mass matrix `mass`
    /// (N x N): `forces` in global components, and `weight` times the matrix to the tangent.
    #[inline(always)]
    pub fn add_mass<const N: usize>(&mut self, k: usize, forces: &[Vec3; N], mass: &[[f64; N]; N], weight: f64) {
        let all = &mut *self.force;
        let first_slot = self.first_slot;
        for (force, &slot) in forces.iter().zip(self.places.connectivity.get(k)) {
            all[slot as usize - first_slot] += *force;
        }
        if !self.with_tangent || weight == 0.0 {
            return;
        }
        if self.places.special[k] {
            self.add_constrained_mass(k, N, mass.as_flattened(), weight);
        } else if self.pattern.dof_map.plane().is_none() {
            self.add_free_mass::<N, WIDTH, 3>(k, mass, weight);
        } else {
            self.add_free_mass::<N, 3, 2>(k, mass, weight);
        }
    }

    /// Adds `weight` times the mass matrix of instance `k` whose directions are all free, to tiles
    /// of width W.
    #[inline(always)]
    fn add_free_mass<const N: usize, const W: usize, const DIRECTIONS: usize>(
        &mut self,
        k: usize,
        mass: &[[f64; N]; N],
        weight: f64,
    ) {
        let slots = self.places.connectivity.get(k);
        let node_blocks = &self.pattern.node_blocks;
        for (number, (entry, &place)) in mass.as_flattened().iter().zip(self.places.of(k)).enumerate() {
            let corner = || corner(node_blocks, slots, [number / N, number % N]);
            self.values.block(place, corner).add_along_diagonal::<W, DIRECTIONS>(entry * weight);
        }
    }

    /// Adds `weight` times the mass matrix of instance `k` that has held directions or rotated
    /// axes: entries are scaled by the cosine between the axes of the two slots, and columns of
    /// held directions multiply the prescribed increments.
    #[cold]
    fn add_constrained_mass(&mut self, k: usize, nodes: usize, mass: &[f64], weight: f64) {
        let slots = self.places.connectivity.get(k);
        let (width, directions) = self.pattern.dof_map.plane().map_or((WIDTH, 3), |_| (3, 2));
        let frame = |slot: Slot| self.pattern.dof_map.frame(slot).unwrap_or(Mat3::IDENTITY);
        for (number, entry) in mass.iter().enumerate() {
            let i = slots[number / nodes];
            let j = slots[number % nodes];
            let rows = self.pattern.dof_map.of(i);
            let columns = self.pattern.dof_map.of(j);
            let cosines = frame(i).transpose_matmul(frame(j));
            let prescribed_increment = self
                .prescribed_increment
                .map(|prescribed_increment| self.pattern.dof_map.to_local(j, prescribed_increment[j as usize]));
            for c in 0..directions {
                for r in (0..directions).filter(|&r| rows[r] != DofMap::HELD) {
                    let value = cosines.0[r][c] * entry * weight;
                    match (columns[c], prescribed_increment) {
                        (DofMap::HELD, None) => {}
                        (DofMap::HELD, Some(prescribed_increment)) => {
                            self.prescribed_forces[rows[r] as usize - self.first_equation] +=
                                value * prescribed_increment.0[c];
                        }
                        _ => self.block(k, number / nodes, number % nodes).add(width, r, c, value),
                    }
                }
            }
        }
    }

    /// True if some slot of instance `k` has local axes other than those of the plane.
    fn has_turned_axes(&self, plane: &Plane, k: usize) -> bool {
        let is_turned = |&slot: &Slot| self.pattern.dof_map.frame(slot).is_some_and(|frame| frame != *plane.axes());
        self.places.connectivity.get(k).iter().any(is_turned)
    }

    /// Adds the tangent of one lane of a planar element entry by entry, for instances with held
    /// directions or shared displacements. Columns of held directions multiply the prescribed
    /// increments.
    fn add_planar_entries<const N: usize>(&mut self, k: usize, elements: &PlanarSystem<N, Lanes>, lane: usize) {
        let slots = self.places.connectivity.get(k);
        let places = self.places.of(k);
        let unknown = |node: usize, direction: usize| {
            let number = 2 * node + direction / 2;
            let slot = slots[number];
            PlanarUnknown { number, slot, equation: self.pattern.dof_map.of(slot)[direction] }
        };
        for (i, tiles) in elements.tangent.iter().enumerate() {
            for (j, tile) in tiles.iter().enumerate() {
                for (entry, value) in tile.iter().enumerate() {
                    let row = unknown(i, entry % 3);
                    let column = unknown(j, entry / 3);
                    if row.equation == DofMap::HELD {
                        continue;
                    }
                    if column.equation == DofMap::HELD {
                        if let Some(prescribed_increment) = self.prescribed_increment {
                            let of_slot = prescribed_increment[column.slot as usize];
                            let increment = self.pattern.dof_map.to_local(column.slot, of_slot).0[entry / 3];
                            self.prescribed_forces[row.equation as usize - self.first_equation] +=
                                value.0[lane] * increment;
                        }
                        continue;
                    }
                    let place =
                        if self.places.whole { places[N * i + j] } else { places[2 * N * row.number + column.number] };
                    self.values.tile(place).add(3, entry % 3, entry / 3, value.0[lane]);
                }
            }
        }
    }

    #[inline]
    fn add_tangent(&mut self, k: usize, element: &ElementSystem) {
        if !self.places.whole {
            return self.add_blocks(k, element.blocks(), element.tiles(), |value| *value);
        }
        for (tile, &place) in element.tiles().iter().zip(self.places.of(k)) {
            self.values.tile(place).add_tile::<WIDTH>(|entry| tile[entry]);
        }
    }

    /// Adds the tangent of instance `k` in the local axes of its slots, 3 x 3 block by block.
    /// Columns of held directions multiply the prescribed increments. `pick` reads the number of
    /// the instance from a tile entry.
    #[inline(always)]
    fn add_constrained<T>(&mut self, k: usize, tiles: &[[T; TILE]], pick: impl Fn(&T) -> f64) {
        let slots = self.places.connectivity.get(k);
        let width = self.pattern.node_blocks.width();
        let across = slots.len().div_ceil(2);
        for (column, &j) in slots.iter().enumerate() {
            let columns = self.pattern.dof_map.of(j);
            let turn = self.pattern.dof_map.frame(j);
            let prescribed_increment = self
                .prescribed_increment
                .map(|prescribed_increment| self.pattern.dof_map.to_local(j, prescribed_increment[j as usize]));
            for (row, &i) in slots.iter().enumerate() {
                let tile = &tiles[row / 2 * across + column / 2];
                let mut block = Mat3::ZERO;
                for c in 0..3 {
                    for r in 0..3 {
                        block.0[r][c] = pick(&tile[(column % 2 * 3 + c) * WIDTH + row % 2 * 3 + r]);
                    }
                }
                if let Some(frame) = self.pattern.dof_map.frame(i) {
                    block = frame.transpose_matmul(block);
                }
                if let Some(frame) = turn {
                    block = block * frame;
                }
                let rows = self.pattern.dof_map.of(i);
                for c in 0..3 {
                    for r in (0..3).filter(|&r| rows[r] != DofMap::HELD) {
                        match (columns[c], prescribed_increment) {
                            (DofMap::HELD, None) => {}
                            (DofMap::HELD, Some(prescribed_increment)) => {
                                self.prescribed_forces[rows[r] as usize - self.first_equation] +=
                                    block.0[r][c] * prescribed_increment.0[c];
                            }
                            _ => self.block(k, row, column).add(width, r, c, block.0[r][c]),
                        }
                    }
                }
            }
        }
    }

    /// Stored part of the tangent block that couples slots number `row` and `column` of instance
    /// `k`.
    #[inline(always)]
    fn block(&mut self, k: usize, row: usize, column: usize) -> BlockMut<'_> {
        let places = self.places.of(k);
        let slots = self.places.connectivity.get(k);
        let node_blocks = &self.pattern.node_blocks;
        let corner = || corner(node_blocks, slots, [row, column]);
        match self.places.whole {
            false => self.values.block(places[row * slots.len() + column], corner),
            true => {
                let place = places[row / 2 * slots.len().div_ceil(2) + column / 2];
                self.values.tile(place).within(node_blocks.width(), corner())
            }
        }
    }

    /// Adds the tangent of instance `k`, without held directions, in 3 x 3 blocks; `pick` reads the
    /// number of the instance from a tile entry.
    #[inline(always)]
    fn add_blocks<T>(&mut self, k: usize, blocks: usize, tiles: &[[T; TILE]], pick: impl Fn(&T) -> f64) {
        let slots = self.places.connectivity.get(k);
        let node_blocks = &self.pattern.node_blocks;
        for (number, &place) in self.places.of(k).iter().enumerate() {
            let row = number / blocks;
            let column = number % blocks;
            let tile = &tiles[row / 2 * blocks.div_ceil(2) + column / 2];
            let block = &tile[column % 2 * 3 * WIDTH + row % 2 * 3..][..2 * WIDTH + 3];
            let corner = || corner(node_blocks, slots, [row, column]);
            self.values.block(place, corner).add_block::<WIDTH>(|r, c| pick(&block[WIDTH * c + r]));
        }
    }

    /// Adds damping forces of instance `k`, one per slot (global components). Their derivatives
    /// belong to the element tangent.
    pub fn add_damping(&mut self, k: usize, force: &[Vec3]) {
        debug_assert!(self.may_damp, "an effect that damps says so");
        for (&slot, &force) in self.places.connectivity.get(k).iter().zip(force) {
            self.damping.as_deref_mut().unwrap_or(self.force)[slot as usize - self.first_slot] += force;
        }
    }
}
