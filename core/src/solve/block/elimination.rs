//! Symbolic factorisation: the order of elimination and the positions of its updates, computed once
//! for a pattern.

use super::order::{self, EliminationOrder};
use crate::interrupt;
use crate::system::{IdleRow, Pattern};
use std::ops::Range;

/// Limit of fill: with more blocks in the factor than this many times those of the tangent, a
/// supernodal factorisation is faster.
const MAX_FILL_RATIO: usize = 8;

/// Limit of fill of a factorisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FillLimit {
    /// At most [`MAX_FILL_RATIO`] times the blocks of the tangent
    Little,
    /// Any amount
    Any,
}

/// Position of the first value of a block, packed into one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSource(u32);

/// Position of the first value of a block, unpacked from a [`BlockSource`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockPosition {
    /// Off-diagonal tile of the tangent, by number
    Tile(usize),
    /// Transpose of an off-diagonal tile of the tangent
    Transpose(usize),
    /// Block of the factorisation that elimination changes, by number
    Changed(usize),
    /// Fill: a block that the tangent does not have.
    Nowhere,
}

impl BlockSource {
    const NOWHERE: Self = Self(u32::MAX);

    fn tile(number: usize) -> Self {
        Self(4 * number as u32)
    }

    fn own(number: usize) -> Self {
        Self(4 * number as u32 + 2)
    }

    /// Source of the transpose of a block of the tangent.
    fn transposed(self) -> Self {
        if self.0 & 2 == 0 { Self(self.0 ^ 1) } else { self }
    }

    /// The position, unpacked.
    #[inline(always)]
    pub fn position(self) -> BlockPosition {
        let number = (self.0 / 4) as usize;
        match self.0 % 4 {
            0 => BlockPosition::Tile(number),
            1 => BlockPosition::Transpose(number),
            2 => BlockPosition::Changed(number),
            _ => BlockPosition::Nowhere,
        }
    }
}

/// Elimination of block rows one after the other.
///
/// Rows are numbered in the order of elimination. Eliminating row k changes its later neighbours;
/// the blocks right of the diagonal in row k are in their order. Blocks that no elimination changes
/// are read from the tangent.
#[derive(Clone, Debug)]
pub struct Elimination {
    /// Node block of each row
    pub(super) order: Vec<u32>,
    /// Row of each node block
    pub(super) row_of: Vec<u32>,
    /// Ranges of rows (subtrees of the elimination tree) that are coupled only through the trunk
    /// and are eliminated in parallel
    pub(super) branches: Vec<Range<usize>>,
    /// Rows after all branches
    pub(super) trunk: Range<usize>,
    /// Node blocks of each branch and of the trunk as ranges; empty unless those of each one are
    /// consecutive
    pub(super) runs: Vec<Range<usize>>,
    /// Position in `later` of the first later neighbour of each row
    starts: Vec<u32>,
    /// Later neighbours, row by row
    pub(super) later: Vec<u32>,
    /// Position in `targets` of the first target of each row; empty without targets
    target_starts: Vec<u32>,
    /// Row by row, for each pair of later neighbours a < b, in the order of b and then of a: the
    /// changed block in which they are coupled, by its number among changed blocks
    pub(super) targets: Vec<u32>,
    /// Blocks right of the diagonal that elimination changes, ascending
    changed: Vec<u32>,
    /// Sources of the initial values of each changed block and of its mirror image
    begin: Vec<[BlockSource; 2]>,
    /// Source of each block right of the diagonal; empty for symmetric off-diagonal tiles, for
    /// which `below` is used
    above: Vec<BlockSource>,
    /// Source of the transpose of the mirror image of each block
    below: Vec<BlockSource>,
    /// Rows of diagonal tiles without an equation, by row of elimination
    idle: Vec<IdleRow>,
}

impl Elimination {
    /// Elimination in the order of [`order::find`], without fill on chains and trees. `None` if
    /// fill exceeds its limit, memory for the analysis is not available, or work is asked to stop.
    pub fn new(pattern: &Pattern, multipliers: &[u32], fill: FillLimit) -> Option<Self> {
        let most = match fill {
            FillLimit::Little => MAX_FILL_RATIO * pattern.pairs(),
            FillLimit::Any => usize::MAX,
        };
        let EliminationOrder { order, branches, neighbours } = order::find(pattern, multipliers, most)?;
        let starts = neighbours.starts;
        let later = neighbours.later;
        let (target_starts, mut targets) = targets(&starts, &later)?;
        let changed = number_changed(&mut targets, later.len());
        let trunk = branches.last().map_or(0, |branch| branch.end)..order.len();
        let row_of = order::inverse(&order);
        let mut out = Self {
            row_of,
            order,
            branches,
            trunk,
            runs: Vec::new(),
            starts,
            later,
            target_starts,
            targets,
            changed,
            begin: Vec::new(),
            above: Vec::new(),
            below: Vec::new(),
            idle: Vec::new(),
        };
        out.runs = out.pieces().map(|rows| run(&out.order[rows])).collect::<Option<_>>().unwrap_or_default();
        out.find_sources(pattern);
        Some(out)
    }

    /// Elimination in the same order for another pattern that is [like](Pattern::is_like) this one.
    pub fn of_like(&self, pattern: &Pattern) -> Self {
        let mut out = self.clone();
        out.find_sources(pattern);
        out
    }

    /// Positions of the later neighbours of a row.
    #[inline]
    pub fn neighbours(&self, row: usize) -> Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    /// Position in `targets` of the first target of a row.
    #[inline(always)]
    pub fn first_target(&self, row: usize) -> usize {
        self.target_starts.get(row).map_or(0, |&first| first as usize)
    }

    /// Source of a block right of the diagonal.
    #[inline(always)]
    pub fn above(&self, block: usize) -> BlockSource {
        *self.above.get(block).unwrap_or(&self.below[block])
    }

    /// Source of the transpose of the mirror image, left of the diagonal, of a block.
    #[inline(always)]
    pub fn below(&self, block: usize) -> BlockSource {
        self.below[block]
    }

    /// True if a block and the transpose of its mirror image are equal and read from one tile of
    /// the tangent.
    #[inline(always)]
    pub fn is_one(&self, block: usize) -> bool {
        self.above.is_empty() && !matches!(self.below[block].position(), BlockPosition::Changed(_))
    }

    /// Numbers, among changed blocks, of those in the given rows.
    pub fn changed(&self, rows: &Range<usize>) -> Range<usize> {
        let place = |row: usize| self.changed.partition_point(|&block| block < self.starts[row]);
        if self.changed.is_empty() { 0..0 } else { place(rows.start)..place(rows.end) }
    }

    /// Sources of the initial values of changed block `number` and of the transpose of its mirror
    /// image.
    pub fn begin(&self, number: usize) -> [BlockSource; 2] {
        self.begin[number]
    }

    /// The end of the rows up to `end` that the elimination of `rows` reads or changes.
    pub fn reach(&self, rows: &Range<usize>, end: usize) -> usize {
        let later = &self.later[self.starts[rows.start] as usize..self.starts[rows.end] as usize];
        let ends = later.iter().map(|&row| row as usize + 1).filter(|&after| after <= end);
        ends.fold(rows.end, usize::max)
    }

    /// Row ranges of all branches and of the trunk.
    pub fn pieces(&self) -> impl Iterator<Item = Range<usize>> {
        self.branches.iter().chain([&self.trunk]).cloned()
    }

    /// Position of the later row of a block relative to the piece of `rows`.
    #[inline(always)]
    pub fn place(&self, rows: &Range<usize>, block: usize) -> LaterRow {
        match self.later[block] as usize {
            row if row < rows.end => LaterRow::InPiece(row - rows.start),
            row => LaterRow::InTrunk(row - self.trunk.start),
        }
    }

    /// Rows of diagonal tiles without an equation, among `rows`.
    pub fn idle(&self, rows: &Range<usize>) -> &[IdleRow] {
        let place = |row: usize| self.idle.partition_point(|idle| (idle.block_row as usize) < row);
        &self.idle[place(rows.start)..place(rows.end)]
    }

    fn find_sources(&mut self, pattern: &Pattern) {
        let row_of = &self.row_of;
        self.below = vec![BlockSource::NOWHERE; self.later.len()];
        self.above = if pattern.symmetry.halves() { Vec::new() } else { self.below.clone() };
        for column in 0..pattern.node_blocks.count() {
            for tile in pattern.tiles_of(column) {
                let i = row_of[pattern.rows[tile] as usize];
                let j = row_of[column];
                // Tiles are stored by columns; factors are by rows.
                let block = find(&self.starts, &self.later, i.min(j), i.max(j));
                let source = BlockSource::tile(tile);
                match (i < j, self.above.get_mut(block)) {
                    (true, Some(above)) => *above = source.transposed(),
                    (true, None) => self.below[block] = source.transposed(),
                    (false, _) => self.below[block] = source,
                }
            }
        }
        self.begin =
            self.changed.iter().map(|&block| [self.above(block as usize), self.below(block as usize)]).collect();
        for sources in [&mut self.above, &mut self.below].into_iter().filter(|sources| !sources.is_empty()) {
            for (number, &block) in self.changed.iter().enumerate() {
                sources[block as usize] = BlockSource::own(number);
            }
        }
        let of_row = |idle: &IdleRow| IdleRow { block_row: row_of[idle.block_row as usize], ..*idle };
        self.idle = pattern.idle.iter().map(of_row).collect();
        self.idle.sort_unstable();
    }
}

/// Position of a later row relative to a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaterRow {
    /// Row of the same piece, from its first on
    InPiece(usize),
    /// Row of the trunk, from its first on
    InTrunk(usize),
}

impl LaterRow {
    /// Item of the row, in the list of the piece or in that of the trunk.
    #[inline(always)]
    pub fn of<'a, T>(self, own: &'a [T], beyond: &'a [T]) -> &'a T {
        match self {
            Self::InPiece(row) => &own[row],
            Self::InTrunk(row) => &beyond[row],
        }
    }

    /// Mutable item of the row, in the list of the piece or in that of the trunk.
    #[inline(always)]
    pub fn of_mut<'a, T>(self, own: &'a mut [T], beyond: &'a mut [T]) -> &'a mut T {
        match self {
            Self::InPiece(row) => &mut own[row],
            Self::InTrunk(row) => &mut beyond[row],
        }
    }
}

/// Node blocks as a range, if they are consecutive in some order.
fn run(node_blocks: &[u32]) -> Option<Range<usize>> {
    let Some((least, most)) = node_blocks.iter().min().zip(node_blocks.iter().max()) else { return Some(0..0) };
    let range = *least as usize..*most as usize + 1;
    (range.len() == node_blocks.len()).then_some(range)
}

/// Position of the block of row `i` and later row `j`.
fn find(starts: &[u32], later: &[u32], i: u32, j: u32) -> usize {
    let start = starts[i as usize] as usize;
    let neighbours = &later[start..starts[i as usize + 1] as usize];
    start + neighbours.partition_point(|&other| other < j)
}

/// For each row the position of its first target, and for each pair of later neighbours the block
/// in which they are coupled. `None` after a request to stop.
fn targets(starts: &[u32], later: &[u32]) -> Option<(Vec<u32>, Vec<u32>)> {
    let mut begins = Vec::with_capacity(starts.len());
    let mut targets = Vec::new();
    for row in 0..starts.len() - 1 {
        begins.push(targets.len() as u32);
        let neighbours = &later[starts[row] as usize..starts[row + 1] as usize];
        for (k, &b) in neighbours.iter().enumerate() {
            if interrupt::is_requested() {
                return None;
            }
            targets.extend(neighbours[..k].iter().map(|&a| find(starts, later, a, b) as u32));
        }
    }
    Some(if targets.is_empty() { Default::default() } else { (begins, targets) })
}

/// The blocks among `blocks` that are targets, ascending. Targets then count these instead of all
/// blocks.
fn number_changed(targets: &mut [u32], blocks: usize) -> Vec<u32> {
    if targets.is_empty() {
        return Vec::new();
    }
    // First a mark, then the number of each changed block.
    let mut numbers = vec![0_u32; blocks];
    targets.iter().for_each(|&block| numbers[block as usize] = 1);
    let changed: Vec<u32> = (0..).zip(&numbers).filter(|(_, mark)| **mark == 1).map(|(block, _)| block).collect();
    (0..).zip(&changed).for_each(|(number, &block)| numbers[block as usize] = number);
    targets.iter_mut().for_each(|block| *block = numbers[*block as usize]);
    changed
}
