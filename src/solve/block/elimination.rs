//! The order of elimination and where its updates go, worked out once for a pattern.

use crate::system::Pattern;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// Elimination makes so many blocks out of one at most; beyond, a supernodal factorisation is faster.
const MOST_FILL: usize = 8;

/// Where a stored block of the tangent is loaded to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On the diagonal
    Diagonal(u32),
    /// Right of it
    Upper(u32),
    /// Below it, kept transposed
    Lower(u32),
}

/// The elimination of block rows one after the other.
///
/// Rows are called by their place in the order. The rows that the elimination of row k changes are its later neighbours;
/// the blocks right of the diagonal in row k stand in their order.
#[derive(Clone, Debug)]
pub struct Elimination {
    /// The group of each row
    pub order: Vec<u32>,
    /// The row of each group
    pub row_of: Vec<u32>,
    /// Where the later neighbours of each row begin
    pub starts: Vec<u32>,
    /// Later neighbours
    pub later: Vec<u32>,
    /// Row by row, for each pair of later neighbours (a before b), in the order of a and then of b: the block that they
    /// share right of the diagonal
    pub targets: Vec<u32>,
    /// Of each stored block
    pub places: Vec<Place>,
}

impl Elimination {
    /// By approximate minimum degree: without any fill on chains and trees. `None` where fill makes it slow, or memory for
    /// the analysis cannot be had.
    pub fn new(pattern: &Pattern) -> Option<Self> {
        let (order, row_of) = minimum_degree(pattern)?;
        let (starts, later) = later_neighbours(pattern, &order, &row_of)?;
        let targets = targets(&starts, &later);
        let mut out = Self { order, row_of, starts, later, targets, places: Vec::new() };
        out.places = out.places_of(pattern);
        Some(out)
    }

    /// The later neighbours of a row.
    #[inline]
    pub fn neighbours(&self, row: usize) -> std::ops::Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    fn places_of(&self, pattern: &Pattern) -> Vec<Place> {
        let mut places = Vec::with_capacity(pattern.tiles());
        for column in 0..pattern.groups.count() {
            for &row in pattern.rows_of(column) {
                let (i, j) = (self.row_of[row as usize], self.row_of[column]);
                places.push(match i.cmp(&j) {
                    std::cmp::Ordering::Equal => Place::Diagonal(i),
                    std::cmp::Ordering::Less => Place::Upper(find(&self.starts, &self.later, i, j)),
                    std::cmp::Ordering::Greater => Place::Lower(find(&self.starts, &self.later, j, i)),
                });
            }
        }
        places
    }
}

/// Where row `i` keeps its block with the later row `j`.
fn find(starts: &[u32], later: &[u32], i: u32, j: u32) -> u32 {
    let start = starts[i as usize];
    let neighbours = &later[start as usize..starts[i as usize + 1] as usize];
    start + neighbours.partition_point(|&other| other < j) as u32
}

fn minimum_degree(pattern: &Pattern) -> Option<(Vec<u32>, Vec<u32>)> {
    let n = pattern.groups.count();
    let structure = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.rows);
    let mut memory = MemBuffer::try_new(amd::order_scratch::<u32>(n, pattern.tiles())).ok()?;
    let (mut order, mut row_of) = (vec![0_u32; n], vec![0_u32; n]);
    amd::order(&mut order, &mut row_of, structure, Default::default(), MemStack::new(&mut memory)).ok()?;
    Some((order, row_of))
}

/// Neighbours in the pattern, and what the rows that were eliminated before leave behind.
fn later_neighbours(pattern: &Pattern, order: &[u32], row_of: &[u32]) -> Option<(Vec<u32>, Vec<u32>)> {
    let n = order.len();
    let most = MOST_FILL * (pattern.tiles() - n) / 2;
    // Rows whose first later neighbour is this one
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); n];
    let mut seen = vec![u32::MAX; n];
    let (mut starts, mut later) = (Vec::with_capacity(n + 1), Vec::with_capacity(pattern.tiles() / 2));
    starts.push(0);
    for row in 0..n {
        let start = later.len();
        seen[row] = row as u32;
        let mut visit = |other: u32, later: &mut Vec<u32>| {
            if other > row as u32 && seen[other as usize] != row as u32 {
                seen[other as usize] = row as u32;
                later.push(other);
            }
        };
        for &group in pattern.rows_of(order[row] as usize) {
            visit(row_of[group as usize], &mut later);
        }
        for child in std::mem::take(&mut children[row]) {
            for k in starts[child as usize] as usize..starts[child as usize + 1] as usize {
                visit(later[k], &mut later);
            }
        }
        later[start..].sort_unstable();
        if let Some(&parent) = later.get(start) {
            children[parent as usize].push(row as u32);
        }
        if later.len() > most {
            return None;
        }
        starts.push(later.len() as u32);
    }
    Some((starts, later))
}

fn targets(starts: &[u32], later: &[u32]) -> Vec<u32> {
    let mut targets = Vec::new();
    for row in 0..starts.len() - 1 {
        let neighbours = &later[starts[row] as usize..starts[row + 1] as usize];
        for (k, &a) in neighbours.iter().enumerate() {
            targets.extend(neighbours[k + 1..].iter().map(|&b| find(starts, later, a, b)));
        }
    }
    targets
}
