//! Sparsity pattern of the tangent in tiles, and for each element the positions its blocks are
//! added to, computed once.

use super::connectivity::Connectivity;
use super::dof_map::DofMap;
use super::node_blocks::{NodeBlocks, SLOTS_PER_BLOCK, TileRow};
use super::range_list::RangeList;
use super::regions::{self, InstanceRanges, Region};
use super::state::Slot;
use super::storage::{NOT_KEPT, Storage};
pub use crate::kernel::{TILE, WIDTH};
use crate::tensor::Vec3;
use crate::threads;
use std::ops::Range;
use std::sync::OnceLock;

/// Tiles of spatial tangents have the size of element tiles.
const _: () = assert!(WIDTH == 3 * SLOTS_PER_BLOCK);

/// Positions in the tangent of the element blocks of one effect.
#[derive(Clone, Debug)]
pub(super) struct ScatterMap {
    pub(super) connectivity: Connectivity,
    /// True if every instance couples whole nodes, so that it adds whole tiles.
    pub(super) whole: bool,
    /// Position of each block by instance, then by block row, or [`NOT_KEPT`]. Blocks are tiles if
    /// `whole`, else 3 x 3 blocks of two slots.
    values: Vec<u32>,
    of_instances: RangeList,
    /// True for instances with a held direction or rotated axes
    pub(super) special: Vec<bool>,
    pub(super) ranges: InstanceRanges,
}

impl ScatterMap {
    #[inline]
    pub fn of(&self, k: usize) -> &[u32] {
        &self.values[self.of_instances.get(k)]
    }
}

/// Symmetry that the tangents of a stage have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symmetry {
    /// No tile is known from its transpose.
    None,
    /// Off-diagonal tiles are transposes of each other. Diagonal tiles are unsymmetric, for
    /// instance by gyroscopic terms of bodies or by moments at single nodes.
    BetweenNodeBlocks,
    /// The tangent is symmetric.
    Whole,
}

impl Symmetry {
    /// Symmetry of the sum of effects, given by connectivity and symmetry of their tangents.
    /// Unsymmetric effects that act on single nodes spoil the diagonal tiles only.
    pub fn of<'a>(effects: impl IntoIterator<Item = (&'a Connectivity, bool)>, node_blocks: &NodeBlocks) -> Self {
        let one = |slots: &[Slot]| slots.windows(2).all(|pair| node_blocks.of(pair[0]) == node_blocks.of(pair[1]));
        let of_effect = |(connectivity, symmetric): (&Connectivity, bool)| match symmetric {
            true => Self::Whole,
            false if connectivity.iter().all(one) => Self::BetweenNodeBlocks,
            false => Self::None,
        };
        effects.into_iter().map(of_effect).min().unwrap_or(Self::Whole)
    }

    /// True if only one of two mirrored off-diagonal tiles is stored.
    #[inline]
    pub fn halves(self) -> bool {
        self != Self::None
    }
}

/// Sparsity pattern of the tangent: a diagonal tile per node block, and off-diagonal tiles in
/// compressed columns.
///
/// A tile has three rows per slot of its node block (three in all in a plane). Rows of held
/// directions are stored and stay zero. If off-diagonal tiles are transposes of each other, those
/// above the diagonal are not stored.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Equation numbers of rows and columns
    pub dof_map: DofMap,
    /// Node blocks, one per block row
    pub node_blocks: NodeBlocks,
    /// Symmetry that the tangents have in common
    pub symmetry: Symmetry,
    /// Positions of tiles in the list of values
    pub(crate) storage: Storage,
    /// First off-diagonal tile of each column; the last item is the number of all
    pub(crate) column_starts: Vec<u32>,
    /// Row (node block) of each off-diagonal tile
    pub(crate) rows: Vec<u32>,
    /// Tiles that are not stored, computed when entries are asked for
    mirrors: OnceLock<TransposedTiles>,
    /// Rows without an equation, by node block
    pub(crate) idle: Vec<IdleRow>,
    /// Regions of nodes that are evaluated in parallel
    pub(crate) regions: Vec<Region>,
    /// Off-diagonal tiles that couple two regions
    pub(super) between: Vec<CouplingTile>,
    pub(super) places: Vec<ScatterMap>,
}

/// A row of a diagonal tile without an equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct IdleRow {
    /// Node block of the tile, or its row in an elimination
    pub(crate) block_row: u32,
    /// Row of the tile
    pub(crate) tile_row: u8,
}

/// An off-diagonal tile that couples two regions.
#[derive(Clone, Copy, Debug)]
pub(super) struct CouplingTile {
    /// Node block of its columns
    pub(super) column: usize,
    /// Number of the tile
    pub(super) tile: usize,
}

/// An off-diagonal tile above the diagonal that is not stored.
#[derive(Clone, Copy, Debug, Default)]
struct TransposedTile {
    /// Node block of its rows
    row: u32,
    /// Number of the stored tile, its transpose
    tile: u32,
}

/// An entry of the tangent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TangentEntry {
    /// Equation of the row
    pub row: u32,
    /// Index of the value
    pub place: usize,
}

impl Pattern {
    /// Pattern of several effects, given by the connectivity of each.
    pub fn new(dof_map: DofMap, node_blocks: NodeBlocks, effects: Vec<Connectivity>, symmetry: Symmetry) -> Self {
        let (column_starts, rows) = compressed_columns(&node_blocks, &effects, symmetry.halves());
        let regions = regions::cut(&node_blocks, &dof_map, &column_starts);
        let storage = Storage::new(node_blocks.width(), node_blocks.count(), symmetry == Symmetry::Whole);
        let idle = Vec::new();
        let between = Vec::new();
        let places = Vec::new();
        let mut pattern = Self {
            dof_map,
            node_blocks,
            symmetry,
            storage,
            column_starts,
            rows,
            mirrors: OnceLock::new(),
            idle,
            regions,
            between,
            places,
        };
        debug_assert!(
            (0..pattern.node_blocks.count()).all(|node_block| pattern.is_ascending(node_block)),
            "rows out of order"
        );
        pattern.idle = pattern.idle();
        pattern.between = pattern.between();
        pattern.places = threads::map(effects.into_iter(), |connectivity| pattern.places_of(connectivity));
        pattern
    }

    /// Number of pairs of coupled node blocks.
    pub fn pairs(&self) -> usize {
        if self.symmetry.halves() { self.rows.len() } else { self.rows.len() / 2 }
    }

    /// Rows of a tile.
    #[inline]
    pub fn width(&self) -> usize {
        self.node_blocks.width()
    }

    /// Number of stored values.
    pub fn values(&self) -> usize {
        self.storage.off_diagonal_tile(self.rows.len())
    }

    /// Numbers of the off-diagonal tiles stored in a column.
    #[inline]
    pub fn tiles_of(&self, column: usize) -> Range<usize> {
        self.column_starts[column] as usize..self.column_starts[column + 1] as usize
    }

    /// Rows (node blocks) of the off-diagonal tiles stored in a column.
    #[inline]
    pub fn rows_of(&self, column: usize) -> &[u32] {
        &self.rows[self.tiles_of(column)]
    }

    /// Adjacency of node blocks.
    pub fn adjacency(&self) -> Adjacency<'_> {
        Adjacency { pattern: self, mirrors: self.find_mirrors() }
    }

    fn find_mirrors(&self) -> TransposedTiles {
        if self.symmetry.halves() {
            TransposedTiles::new(&self.column_starts, &self.rows)
        } else {
            TransposedTiles::default()
        }
    }

    /// Equation of each tile row of a node block, [`DofMap::HELD`] for rows without.
    #[inline]
    pub fn numbers(&self, node_block: usize) -> impl Iterator<Item = u32> {
        let mut numbers = [DofMap::HELD; WIDTH];
        for slot in self.node_blocks.members(node_block) {
            let first = self.node_blocks.row(slot).row;
            // In a plane the slots of a node share rows, each of which is free in one slot at most.
            for (row, number) in numbers[first..].iter_mut().zip(self.dof_map.of(slot)) {
                *row = number.min(*row);
            }
        }
        numbers.into_iter().take(self.width())
    }

    /// Entries of a vector by equation at the tile rows of a node block; zero for rows without an
    /// equation.
    #[inline(always)]
    pub fn part<const W: usize>(&self, node_block: usize, x: &[f64]) -> [f64; W] {
        let own = x.get(self.equations_of(node_block)).and_then(|own| own.first_chunk::<W>());
        match own {
            Some(own) => *own,
            None => self.part_by_rows(node_block, x),
        }
    }

    /// Distributes the entries of the equations of a node block, in `own`, to its tile rows; zero
    /// for rows without an equation.
    #[inline(always)]
    pub fn spread<const W: usize>(&self, node_block: usize, own: [f64; W]) -> [f64; W] {
        let equations = self.equations_of(node_block);
        if equations.len() == W {
            return own;
        }
        let mut numbers = self.numbers(node_block);
        let of_row = |number: u32| own.get((number as usize).wrapping_sub(equations.start)).copied();
        std::array::from_fn(|_| numbers.next().and_then(of_row).unwrap_or(0.0))
    }

    /// Collects the entries of the tile rows of a node block that have an equation, in the order of
    /// equations; the inverse of [`Pattern::spread`].
    #[inline(always)]
    fn gathered<const W: usize>(&self, node_block: usize, part: &[f64; W]) -> [f64; W] {
        let mut own = *part;
        if self.equations_of(node_block).len() != W {
            let free = self.numbers(node_block).zip(part).filter(|(number, _)| *number != DofMap::HELD);
            own.iter_mut().zip(free).for_each(|(own, (_, &value))| *own = value);
        }
        own
    }

    /// Entries of a vector by equation at the tile rows of a node block, looked up row by row.
    #[cold]
    fn part_by_rows<const W: usize>(&self, node_block: usize, x: &[f64]) -> [f64; W] {
        let mut numbers = self.numbers(node_block);
        std::array::from_fn(|_| numbers.next().and_then(|k| x.get(k as usize)).copied().unwrap_or(0.0))
    }

    /// True if the equations of a node block ascend with its tile rows.
    fn is_ascending(&self, node_block: usize) -> bool {
        self.numbers(node_block).filter(|&number| number != DofMap::HELD).is_sorted()
    }

    /// Equations of a node block. If they are as many as a tile has rows, they are in the order of
    /// rows.
    #[inline(always)]
    pub fn equations_of(&self, node_block: usize) -> Range<usize> {
        self.dof_map.before(self.node_blocks.first_slot(node_block))
            ..self.dof_map.before(self.node_blocks.first_slot(node_block + 1))
    }

    /// Collects a vector by equation from its parts by node block; the inverse of
    /// [`Pattern::part`].
    pub fn join<'a, const W: usize>(&self, part: impl Fn(usize) -> &'a [f64; W] + Send + Sync, out: &mut [f64]) {
        self.each_region(out, |region, out| {
            for node_block in region.node_blocks.clone() {
                let equations = self.equations_of(node_block);
                let part = part(node_block);
                let start = region.equations.start;
                let out = &mut out[equations.start - start..equations.end - start];
                match out.first_chunk_mut::<W>() {
                    Some(out) => *out = *part,
                    None => {
                        let length = out.len();
                        out.copy_from_slice(&self.gathered(node_block, part)[..length]);
                    }
                }
            }
        });
    }

    /// Writes a solution, given by node block, to a field of slots (global components). Held
    /// directions take the components of `held` (global components), or zero.
    pub fn scatter<'a, const W: usize>(
        &self,
        part: impl Fn(usize) -> &'a [f64; W] + Send + Sync,
        held: Option<&[Vec3]>,
        out: &mut [Vec3],
    ) {
        regions::each(
            &self.regions,
            out,
            |region| region.slots.end,
            |region, out| {
                for node_block in region.node_blocks.clone() {
                    let slots = self.node_blocks.members(node_block);
                    let part = part(node_block);
                    let first = slots.start as usize - region.slots.start;
                    let out = &mut out[first..first + slots.len()];
                    if 3 * slots.len() == W && self.dof_map.are_components(slots.clone()) {
                        out.iter_mut().zip(part.as_chunks().0).for_each(|(out, part)| *out = Vec3(*part));
                        continue;
                    }
                    if let ([x, y, angle], [across, about], None) = (&part[..], &mut *out, held)
                        && self.dof_map.are_planar(slots.clone())
                    {
                        *across = self.dof_map.to_global(slots.start, Vec3([*x, *y, 0.0]));
                        *about = self.dof_map.to_global(slots.start + 1, Vec3([0.0, 0.0, *angle]));
                        continue;
                    }
                    let own = self.gathered(node_block, part);
                    let equations = self.equations_of(node_block);
                    for (slot, out) in slots.zip(out) {
                        *out = self.dof_map.at(slot as usize, &own[..equations.len()], equations.start, held);
                    }
                }
            },
        );
    }

    /// Region of a node block.
    #[inline(always)]
    pub fn region_of(&self, node_block: usize) -> &Region {
        match &self.regions[..] {
            [all] => all,
            // All regions but the last have the length of the first.
            regions => &regions[node_block / regions[0].node_blocks.len()],
        }
    }

    /// Calls `work` for each region, in parallel, with the entries of its equations in `out`.
    pub fn each_region(&self, out: &mut [f64], work: impl Fn(&Region, &mut [f64]) + Send + Sync) {
        regions::each(&self.regions, out, |region| region.equations.end, work);
    }

    /// Entries of the column of an equation, tile by tile.
    pub fn entries(&self, column: u32) -> impl Iterator<Item = TangentEntry> {
        let TileRow { node_block, row: c } = self.row_of(column);
        let storage = &self.storage;
        let free = |node_block: usize| {
            let numbers = self.numbers(node_block).enumerate();
            numbers.filter(|&(_, row)| row != DofMap::HELD).map(|(r, row)| (row, r))
        };
        let in_tile = move |row: usize, tile: usize| {
            free(row).map(move |(row, r)| TangentEntry { row, place: storage.entry(tile, r, c) })
        };
        let mirrored = move |mirror: &TransposedTile| {
            let tile = storage.off_diagonal_tile(mirror.tile as usize);
            free(mirror.row as usize).map(move |(row, r)| TangentEntry { row, place: storage.entry(tile, c, r) })
        };
        let kept = self
            .tiles_of(node_block)
            .flat_map(move |tile| in_tile(self.rows[tile] as usize, storage.off_diagonal_tile(tile)));
        let mirrors = self.mirrors.get_or_init(|| self.find_mirrors());
        mirrors
            .of(node_block)
            .iter()
            .flat_map(mirrored)
            .chain(in_tile(node_block, storage.diagonal_tile(node_block)))
            .chain(kept)
    }

    /// Number of entries whose row and column are equations.
    pub fn nonzeros(&self) -> usize {
        let adjacency = self.adjacency();
        let free = |node_block: usize| self.numbers(node_block).filter(|&n| n != DofMap::HELD).count();
        let column = |c: usize| free(c) * (free(c) + adjacency.of(c).map(|row| free(row as usize)).sum::<usize>());
        (0..self.node_blocks.count()).map(column).sum()
    }

    /// Entries of the diagonal block of a slot in its free directions: row and column in its local
    /// axes, and index of the value.
    pub fn own_entries(&self, slot: Slot) -> impl Iterator<Item = ([usize; 2], usize)> {
        let TileRow { node_block, row: first } = self.node_blocks.row(slot);
        let storage = &self.storage;
        let numbers = self.dof_map.of(slot);
        let free = move || (0..3).filter(move |&k| numbers[k] != DofMap::HELD);
        let column = move |c: usize| {
            free().map(move |r| ([r, c], storage.entry(storage.diagonal_tile(node_block), first + r, first + c)))
        };
        free().flat_map(column)
    }

    /// Index of the value of an entry, which it may share with its mirror image; `None` for held
    /// directions, and for pairs of equations that no effect couples.
    pub fn find(&self, row: u32, column: u32) -> Option<usize> {
        if row == DofMap::HELD || column == DofMap::HELD {
            return None;
        }
        let row = self.row_of(row);
        let column = self.row_of(column);
        let is_kept = self.keeps(row.node_block, column.node_block);
        let [row, column] = if is_kept { [row, column] } else { [column, row] };
        Some(self.storage.entry(self.tile(row.node_block, column.node_block)?, row.row, column.row))
    }

    /// True if the same node blocks are coupled as in another pattern, as in spatial and planar
    /// patterns of one scene, for any symmetry.
    pub fn is_like(&self, other: &Self) -> bool {
        // Tiles in a column at or below the diagonal.
        let lower = |pattern: &Self, column: usize| {
            let rows = pattern.rows_of(column);
            pattern.tiles_of(column).start + rows.partition_point(|&row| (row as usize) < column)
                ..pattern.tiles_of(column).end
        };
        let count = self.node_blocks.count();
        let meet = |column: usize| self.rows[lower(self, column)] == other.rows[lower(other, column)];
        count == other.node_blocks.count() && (0..count).all(meet)
    }

    /// Calls `show` with each equation and the index of its diagonal entry.
    pub fn each_diagonal(&self, show: impl FnMut(usize, usize)) {
        self.each_diagonal_of(0..self.node_blocks.count(), show);
    }

    /// Calls `show` with each equation of some node blocks and the index of its diagonal entry.
    pub fn each_diagonal_of(&self, node_blocks: Range<usize>, mut show: impl FnMut(usize, usize)) {
        for node_block in node_blocks {
            for (r, number) in self.numbers(node_block).enumerate().filter(|(_, number)| *number != DofMap::HELD) {
                show(number as usize, self.storage.entry(self.storage.diagonal_tile(node_block), r, r));
            }
        }
    }

    /// Node block and tile row of an equation.
    fn row_of(&self, equation: u32) -> TileRow {
        let (slot, k) = self.dof_map.origin(equation as usize);
        let first = self.node_blocks.row(slot);
        TileRow { row: first.row + k as usize, ..first }
    }

    /// True if the tile of two coupled node blocks is stored.
    #[inline]
    fn keeps(&self, row: usize, column: usize) -> bool {
        row >= column || !self.symmetry.halves()
    }

    /// Index of the first value of a tile; `None` if the node blocks are not coupled, or the tile
    /// is not stored.
    pub fn tile(&self, row: usize, column: usize) -> Option<usize> {
        if row == column {
            return Some(self.storage.diagonal_tile(row));
        }
        let found = self.rows_of(column).binary_search(&(row as u32)).ok()?;
        Some(self.storage.off_diagonal_tile(self.column_starts[column] as usize + found))
    }

    fn idle(&self) -> Vec<IdleRow> {
        let of_block = |node_block: usize| {
            let rows = (0..).zip(self.numbers(node_block)).filter(|&(_, number)| number == DofMap::HELD);
            rows.map(move |(tile_row, _)| IdleRow { block_row: node_block as u32, tile_row })
        };
        (0..self.node_blocks.count()).flat_map(of_block).collect()
    }

    fn between(&self) -> Vec<CouplingTile> {
        let mut between = Vec::new();
        for region in &self.regions {
            for column in region.node_blocks.clone() {
                let elsewhere = |tile: &usize| !region.node_blocks.contains(&(self.rows[*tile] as usize));
                between.extend(self.tiles_of(column).filter(elsewhere).map(|tile| CouplingTile { column, tile }));
            }
        }
        between
    }

    fn places_of(&self, connectivity: Connectivity) -> ScatterMap {
        let whole = connectivity.iter().all(|slots| self.is_whole(slots));
        let step = if whole { SLOTS_PER_BLOCK } else { 1 };
        let mut places = ScatterMap {
            whole,
            values: Vec::with_capacity(connectivity.iter().map(|slots| (slots.len() / step).pow(2)).sum()),
            of_instances: RangeList::default(),
            special: Vec::with_capacity(connectivity.len()),
            ranges: InstanceRanges::new(&connectivity, &self.node_blocks, &self.regions),
            connectivity: Connectivity::default(),
        };
        for slots in connectivity.iter() {
            let before = places.values.len();
            let corners = || slots.iter().step_by(step).map(|&slot| self.node_blocks.row(slot));
            for first in corners() {
                let place = |second: TileRow| match self.keeps(first.node_block, second.node_block) {
                    // Every pair of an instance has a tile: the pattern was made of the same
                    // connectivity.
                    true => {
                        let tile = self.tile(first.node_block, second.node_block)?;
                        Some(self.storage.target(tile, first.row, second.row) as u32)
                    }
                    false => Some(NOT_KEPT),
                };
                places.values.extend(corners().filter_map(place));
            }
            places.of_instances.push(places.values.len() - before);
            places.special.push(!slots.iter().all(|&slot| self.dof_map.is_plain(slot)));
        }
        places.of_instances.shrink_to_fit();
        places.connectivity = connectivity;
        places.connectivity.shrink();
        places
    }

    /// True if the slots are the complete node blocks of several nodes, one after the other.
    fn is_whole(&self, slots: &[Slot]) -> bool {
        let pair = |pair: &[Slot]| match *pair {
            [u, p] => self.node_blocks.members(self.node_blocks.of(u)).eq([u, p]),
            _ => false,
        };
        slots.chunks(SLOTS_PER_BLOCK).all(pair)
    }
}

/// Off-diagonal tiles in compressed columns: starts of columns, and rows. With `halves` only rows
/// below the diagonal are included.
fn compressed_columns(node_blocks: &NodeBlocks, effects: &[Connectivity], halves: bool) -> (Vec<u32>, Vec<u32>) {
    let is_kept = |column: u32, row: u32| row > column || (row != column && !halves);
    let kept = |met: &[u32], column: u32| met.iter().filter(|&&row| is_kept(column, row)).count() as u32;
    // Every coupling is entered, then each column is sorted by itself: sorting all of them at once
    // takes longer than a linear solve.
    let mut column_starts = vec![0_u32; node_blocks.count() + 1];
    let ends = &mut column_starts[1..];
    each_meeting(node_blocks, effects, &mut |met| {
        met.iter().for_each(|&column| ends[column as usize] += kept(met, column))
    });
    let mut room = 0;
    ends.iter_mut().for_each(|end| room += std::mem::replace(end, room));
    let mut rows = vec![0_u32; room as usize];
    each_meeting(node_blocks, effects, &mut |met| {
        for &column in met {
            let end = &mut ends[column as usize];
            for &row in met.iter().filter(|&&row| is_kept(column, row)) {
                rows[*end as usize] = row;
                *end += 1;
            }
        }
    });
    // Duplicates are removed in place: a column has at most as many rows as couplings.
    let mut start = 0;
    let mut count = 0;
    for end in ends {
        let first = count;
        rows[start..*end as usize].sort_unstable();
        for k in start..*end as usize {
            if first == count || rows[count - 1] != rows[k] {
                rows[count] = rows[k];
                count += 1;
            }
        }
        start = std::mem::replace(end, count as u32) as usize;
    }
    rows.truncate(count);
    rows.shrink_to_fit();
    (column_starts, rows)
}

/// Transposes of all tiles below the diagonal, column by column.
#[derive(Clone, Debug, Default)]
struct TransposedTiles {
    starts: Vec<u32>,
    all: Vec<TransposedTile>,
}

impl TransposedTiles {
    fn new(column_starts: &[u32], rows: &[u32]) -> Self {
        let (starts, all) = mirrors(column_starts, rows);
        Self { starts, all }
    }

    /// Transposed tiles in a column.
    #[inline]
    fn of(&self, column: usize) -> &[TransposedTile] {
        match self.starts.get(column..column + 2) {
            Some(&[start, end]) => &self.all[start as usize..end as usize],
            _ => &[],
        }
    }
}

/// Adjacency of node blocks, with both directions of each pair.
pub struct Adjacency<'a> {
    pattern: &'a Pattern,
    mirrors: TransposedTiles,
}

impl Adjacency<'_> {
    /// Number of pairs of coupled node blocks.
    pub fn pairs(&self) -> usize {
        self.pattern.pairs()
    }

    /// The other node blocks that a node block is coupled with, ascending.
    pub fn of(&self, node_block: usize) -> impl Iterator<Item = u32> {
        let kept = self.pattern.rows_of(node_block).iter().copied();
        self.mirrors.of(node_block).iter().map(|mirror| mirror.row).chain(kept)
    }
}

fn mirrors(column_starts: &[u32], rows: &[u32]) -> (Vec<u32>, Vec<TransposedTile>) {
    let columns = column_starts.len() - 1;
    let below = || {
        let of = |column: usize| column_starts[column] as usize..column_starts[column + 1] as usize;
        (0..columns).flat_map(move |column| of(column).map(move |tile| (column, tile)))
    };
    let mut starts = vec![0_u32; columns + 1];
    below().for_each(|(_, tile)| starts[rows[tile] as usize + 1] += 1);
    (0..columns).for_each(|column| starts[column + 1] += starts[column]);
    let mut ends = starts.clone();
    let mut mirrors = vec![TransposedTile::default(); starts[columns] as usize];
    for (column, tile) in below() {
        let end = &mut ends[rows[tile] as usize];
        mirrors[*end as usize] = TransposedTile { row: column as u32, tile: tile as u32 };
        *end += 1;
    }
    (starts, mirrors)
}

/// Calls `show` with the node blocks that each instance couples.
fn each_meeting(node_blocks: &NodeBlocks, effects: &[Connectivity], show: &mut dyn FnMut(&[u32])) {
    let mut met = Vec::new();
    for clique in effects.iter().flat_map(Connectivity::iter) {
        met.clear();
        met.extend(clique.iter().map(|&slot| node_blocks.of(slot) as u32));
        met.dedup();
        show(&met);
    }
}
