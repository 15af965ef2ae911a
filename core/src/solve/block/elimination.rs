//! The order of elimination and where its updates go, worked out once for a pattern.

use super::order::{self, Order};
use crate::system::Pattern;
use std::ops::Range;

/// Elimination makes so many blocks out of one at most; beyond, a supernodal factorisation is
/// faster.
const MOST_FILL: usize = 8;

/// How much fill a factorisation may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// As much as is faster than another solver
    Little,
    /// As much as it takes
    Any,
}

/// Where a block stands, in one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source(u32);

/// What a [`Source`] says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stands {
    /// A tile of the tangent beside its diagonal
    Tile(usize),
    /// The transpose of one
    Transpose(usize),
    /// Elimination changes it, and keeps it by itself.
    Own(usize),
    /// Elimination fills it.
    Nowhere,
}

impl Source {
    const NOWHERE: Self = Self(u32::MAX);

    fn tile(number: usize) -> Self {
        Self(4 * number as u32)
    }

    fn own(number: usize) -> Self {
        Self(4 * number as u32 + 2)
    }

    /// Where the transpose of a block that stands in the tangent stands.
    fn transposed(self) -> Self {
        if self.0 & 2 == 0 { Self(self.0 ^ 1) } else { self }
    }

    /// Where it is.
    #[inline(always)]
    pub fn stands(self) -> Stands {
        let number = (self.0 / 4) as usize;
        match self.0 % 4 {
            0 => Stands::Tile(number),
            1 => Stands::Transpose(number),
            2 => Stands::Own(number),
            _ => Stands::Nowhere,
        }
    }
}

/// The elimination of block rows one after the other.
///
/// Rows are called by their place in the order. The rows that the elimination of row k changes are
/// its later neighbours; the blocks right of the diagonal in row k stand in their order. Blocks
/// that no elimination changes are those of the tangent.
#[derive(Clone, Debug)]
pub struct Elimination {
    /// The group of each row
    pub order: Vec<u32>,
    /// The row of each group
    pub row_of: Vec<u32>,
    /// Rows that do not meet but in the trunk, and can be eliminated at once
    pub branches: Vec<Range<usize>>,
    /// The rows after all branches
    pub trunk: Range<usize>,
    /// The groups of each branch and of the trunk, where those of each follow each other; else
    /// nothing
    pub runs: Vec<Range<usize>>,
    /// Where the later neighbours of each row begin
    pub starts: Vec<u32>,
    /// Later neighbours
    pub later: Vec<u32>,
    /// Where the targets of each row begin, where there are some
    target_starts: Vec<u32>,
    /// Row by row, for each pair of later neighbours (a before b), in the order of b and then of a:
    /// the number, among those that elimination changes, of the block that they share right of the
    /// diagonal
    pub targets: Vec<u32>,
    /// The blocks that elimination changes
    changed: Vec<u32>,
    /// What these begin with, as `above` and `below`
    begin: Vec<[Source; 2]>,
    /// Each block right of the diagonal by rows; empty where they are `below`
    above: Vec<Source>,
    /// Their mirror images by columns
    below: Vec<Source>,
    /// Rows of tiles that are no equations: row, and row of its tile
    idle: Vec<(u32, u8)>,
}

impl Elimination {
    /// In the order of [`order::find`]: without any fill on chains and trees. `None` where there is
    /// more fill than there may be, or memory for the analysis cannot be had.
    pub fn new(pattern: &Pattern, multipliers: &[u32], fill: Fill) -> Option<Self> {
        let most = match fill {
            Fill::Little => MOST_FILL * pattern.pairs(),
            Fill::Any => usize::MAX,
        };
        let Order { order, branches, neighbours } = order::find(pattern, multipliers, most)?;
        let (starts, later) = (neighbours.starts, neighbours.later);
        let (target_starts, mut targets) = targets(&starts, &later);
        let mut changed = targets.clone();
        changed.sort_unstable();
        changed.dedup();
        targets.iter_mut().for_each(|block| *block = changed.partition_point(|other| other < block) as u32);
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

    /// The same for a pattern that is [like](Pattern::is_like) its own.
    pub fn of_like(&self, pattern: &Pattern) -> Self {
        let mut out = self.clone();
        out.find_sources(pattern);
        out
    }

    /// The later neighbours of a row.
    #[inline]
    pub fn neighbours(&self, row: usize) -> Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    /// Where the targets of a row begin.
    #[inline(always)]
    pub fn first_target(&self, row: usize) -> usize {
        self.target_starts.get(row).map_or(0, |&first| first as usize)
    }

    /// A block right of the diagonal, by rows.
    #[inline(always)]
    pub fn above(&self, block: usize) -> Source {
        *self.above.get(block).unwrap_or(&self.below[block])
    }

    /// Its mirror image, by columns.
    #[inline(always)]
    pub fn below(&self, block: usize) -> Source {
        self.below[block]
    }

    /// True if a block by rows and its mirror image by columns stand at one place and are the same.
    #[inline(always)]
    pub fn is_one(&self, block: usize) -> bool {
        self.above.is_empty() && !matches!(self.below[block].stands(), Stands::Own(_))
    }

    /// The blocks in these rows that elimination changes, by their numbers among all such.
    pub fn changed(&self, rows: &Range<usize>) -> Range<usize> {
        let place = |row: usize| self.changed.partition_point(|&block| block < self.starts[row]);
        if self.changed.is_empty() { 0..0 } else { place(rows.start)..place(rows.end) }
    }

    /// What one of these begins with, by rows, and its mirror image, by columns.
    pub fn begin(&self, number: usize) -> [Source; 2] {
        self.begin[number]
    }

    /// The end of these rows and of those before `end` that their elimination changes.
    pub fn reach(&self, rows: &Range<usize>, end: usize) -> usize {
        let later = &self.later[self.starts[rows.start] as usize..self.starts[rows.end] as usize];
        let ends = later.iter().map(|&row| row as usize + 1).filter(|&after| after <= end);
        ends.fold(rows.end, usize::max)
    }

    /// Branches and trunk.
    pub fn pieces(&self) -> impl Iterator<Item = Range<usize>> {
        self.branches.iter().chain([&self.trunk]).cloned()
    }

    /// Where the later row of a block stands, seen from the rows of its piece.
    #[inline(always)]
    pub fn place(&self, rows: &Range<usize>, block: usize) -> Later {
        match self.later[block] as usize {
            row if row < rows.end => Later::Own(row - rows.start),
            row => Later::Beyond(row - self.trunk.start),
        }
    }

    /// The rows of some tiles that are no equations.
    pub fn idle(&self, rows: &Range<usize>) -> &[(u32, u8)] {
        let place = |row: usize| self.idle.partition_point(|(other, _)| (*other as usize) < row);
        &self.idle[place(rows.start)..place(rows.end)]
    }

    fn find_sources(&mut self, pattern: &Pattern) {
        let row_of = &self.row_of;
        self.below = vec![Source::NOWHERE; self.later.len()];
        self.above = if pattern.symmetry.halves() { Vec::new() } else { self.below.clone() };
        for column in 0..pattern.node_blocks.count() {
            for tile in pattern.tiles_of(column) {
                let (i, j) = (row_of[pattern.rows[tile] as usize], row_of[column]);
                // Tiles stand by their columns.
                let (block, source) = (find(&self.starts, &self.later, i.min(j), i.max(j)), Source::tile(tile));
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
                sources[block as usize] = Source::own(number);
            }
        }
        self.idle = pattern.idle.iter().map(|&(group, direction)| (row_of[group as usize], direction)).collect();
        self.idle.sort_unstable();
    }
}

/// Where a later row stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Later {
    /// In the same piece
    Own(usize),
    /// In the trunk
    Beyond(usize),
}

impl Later {
    /// What belongs to it.
    #[inline(always)]
    pub fn of<'a, T>(self, own: &'a [T], beyond: &'a [T]) -> &'a T {
        match self {
            Self::Own(row) => &own[row],
            Self::Beyond(row) => &beyond[row],
        }
    }

    /// The same, to change it.
    #[inline(always)]
    pub fn of_mut<'a, T>(self, own: &'a mut [T], beyond: &'a mut [T]) -> &'a mut T {
        match self {
            Self::Own(row) => &mut own[row],
            Self::Beyond(row) => &mut beyond[row],
        }
    }
}

/// NodeBlocks as a range, where they follow each other in some order.
fn run(node_blocks: &[u32]) -> Option<Range<usize>> {
    let Some((least, most)) = node_blocks.iter().min().zip(node_blocks.iter().max()) else { return Some(0..0) };
    let range = *least as usize..*most as usize + 1;
    (range.len() == node_blocks.len()).then_some(range)
}

/// Where row `i` keeps its block with the later row `j`.
fn find(starts: &[u32], later: &[u32], i: u32, j: u32) -> usize {
    let start = starts[i as usize] as usize;
    let neighbours = &later[start..starts[i as usize + 1] as usize];
    start + neighbours.partition_point(|&other| other < j)
}

fn targets(starts: &[u32], later: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let (mut begins, mut targets) = (Vec::with_capacity(starts.len()), Vec::new());
    for row in 0..starts.len() - 1 {
        begins.push(targets.len() as u32);
        let neighbours = &later[starts[row] as usize..starts[row + 1] as usize];
        for (k, &b) in neighbours.iter().enumerate() {
            targets.extend(neighbours[..k].iter().map(|&a| find(starts, later, a, b) as u32));
        }
    }
    if targets.is_empty() { Default::default() } else { (begins, targets) }
}
