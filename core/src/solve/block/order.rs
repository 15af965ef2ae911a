//! Order of elimination: minimum degree, in large scenes rearranged from several ends to a middle,
//! so that branches of the elimination tree can be eliminated in parallel.
//!
//! Minimum degree eliminates a chain from one end to the other: its elimination tree is a single
//! branch. The filled graph of an order is chordal, and can be eliminated without further fill
//! towards any of its cliques (Rose, Tarjan and Lueker 1976, doi:10.1137/0205021), here towards a
//! clique in its middle.

use crate::interrupt;
use crate::system::{Adjacency, Pattern};
use crate::threads;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Least number of rows for which branches are looked for.
const MIN_ROWS_FOR_BRANCHES: usize = 1024;

/// Largest number of rows in the trunk that is tried.
const MAX_TRUNK_ROWS: usize = 64;

/// Number of parts of equal size into which branches are divided if the tree permits
const BRANCH_PARTS: usize = 16;

/// Number of rows above which the search for an order may take long, and has a thread of its own
/// so that a request to stop need not wait for it.
const LONG_ORDERING: usize = 5000;

/// Row number that means no row, as the parent of a root
const NO_ROW: u32 = u32::MAX;

/// An order of elimination with its branches and fill.
pub struct EliminationOrder {
    /// Node block of each row
    pub(super) order: Vec<u32>,
    /// Consecutive row ranges, from the first row on, that are coupled only with later rows after
    /// all of them; empty if parallel elimination does not pay
    pub(super) branches: Vec<Range<usize>>,
    /// Later neighbours of each row
    pub(super) neighbours: Neighbours,
}

/// For each row, the rows that its elimination changes.
pub struct Neighbours {
    /// Position in `later` of the first neighbour of each row
    pub(super) starts: Vec<u32>,
    /// Neighbours of each row, ascending
    pub(super) later: Vec<u32>,
}

impl Neighbours {
    /// Later neighbours: those in the pattern, and those that result from fill. `None` if there are
    /// more than `most`, or after a request to stop.
    fn new(adjacency: &Adjacency, order: &[u32], most: usize) -> Option<Self> {
        let n = order.len();
        let row_of = inverse(order);
        // The last row so far whose first later neighbour is the index, and the one before each
        let mut last_child = vec![NO_ROW; n];
        let mut child_before = vec![NO_ROW; n];
        let mut seen = vec![u32::MAX; n];
        let mut starts = Vec::with_capacity(n + 1);
        let mut later = Vec::with_capacity(adjacency.pairs());
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
            for node_block in adjacency.of(order[row] as usize) {
                visit(row_of[node_block as usize], &mut later);
            }
            let mut child = last_child[row];
            while child != NO_ROW {
                for k in starts[child as usize] as usize..starts[child as usize + 1] as usize {
                    visit(later[k], &mut later);
                }
                child = child_before[child as usize];
            }
            later[start..].sort_unstable();
            if let Some(&parent) = later.get(start) {
                child_before[row] = last_child[parent as usize];
                last_child[parent as usize] = row as u32;
            }
            if later.len() > most || interrupt::is_requested() {
                return None;
            }
            starts.push(later.len() as u32);
        }
        Some(Self { starts, later })
    }

    /// Later neighbours after a permutation of rows in which each row still comes before those it
    /// changes, and these keep their relative order.
    fn permuted(&self, places: &[u32]) -> Self {
        let row_of = inverse(places);
        let mut starts = Vec::with_capacity(places.len() + 1);
        let mut later = Vec::with_capacity(self.later.len());
        starts.push(0);
        for &place in places {
            let start = later.len();
            later.extend(self.of(place as usize).iter().map(|&row| row_of[row as usize]));
            debug_assert!(later[start..].is_sorted(), "rows of a branch have changed places");
            starts.push(later.len() as u32);
        }
        Self { starts, later }
    }

    fn of(&self, row: usize) -> &[u32] {
        &self.later[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Elimination tree: parent of each row, the first row that it changes.
    fn parents(&self) -> Vec<u32> {
        (0..self.count()).map(|row| self.of(row).first().copied().unwrap_or(NO_ROW)).collect()
    }

    /// For each row, the rows whose elimination changes it.
    fn earlier(&self) -> Self {
        let mut starts = vec![0; self.count() + 1];
        self.later.iter().for_each(|&row| starts[row as usize + 1] += 1);
        (0..self.count()).for_each(|row| starts[row + 1] += starts[row]);
        let mut ends = starts.clone();
        let mut rows = vec![0; self.later.len()];
        for row in 0..self.count() {
            for &other in self.of(row) {
                let end = &mut ends[other as usize];
                rows[*end as usize] = row as u32;
                *end += 1;
            }
        }
        Self { starts, later: rows }
    }
}

/// Order for a pattern, in which the node blocks of `multipliers` come after those they are coupled
/// with. `None` if the factor has more than `most` blocks right of the diagonal, memory is not
/// available, or work is asked to stop.
pub fn find(pattern: &Pattern, multipliers: &[u32], most: usize) -> Option<EliminationOrder> {
    let adjacency = &pattern.adjacency();
    let order = match multipliers {
        [] => minimum_degree(pattern.node_blocks.count(), &pattern.column_starts, &pattern.rows)?,
        _ => constrained(pattern.node_blocks.count(), adjacency, multipliers)?,
    };
    let neighbours = Neighbours::new(adjacency, &order, most)?;
    if order.len() < MIN_ROWS_FOR_BRANCHES || !multipliers.is_empty() {
        return Some(EliminationOrder { order, branches: Vec::new(), neighbours });
    }
    let order = permuted(&order, &towards_the_middle(&neighbours));
    let neighbours = Neighbours::new(adjacency, &order, most)?;
    let (sorted, branches) = branches(&neighbours.parents());
    if branches.is_empty() {
        return Some(EliminationOrder { order, branches, neighbours });
    }
    let order = permuted(&order, &sorted);
    Some(EliminationOrder { neighbours: neighbours.permuted(&sorted), order, branches })
}

/// Inverse permutation: position of each entry.
pub fn inverse(order: &[u32]) -> Vec<u32> {
    let mut out = vec![0; order.len()];
    (0..).zip(order).for_each(|(place, &entry)| out[entry as usize] = place);
    out
}

/// The entries at the given positions.
fn permuted(order: &[u32], places: &[u32]) -> Vec<u32> {
    places.iter().map(|&place| order[place as usize]).collect()
}

/// Minimum degree among all other node blocks, then each multiplier right after the last node block
/// it is coupled with. With everything after it clamped, the parts it connects are complete, so
/// that its pivot has the sign of a constraint (Vanderbei 1995, doi:10.1137/0805005).
fn constrained(node_blocks: usize, adjacency: &Adjacency, multipliers: &[u32]) -> Option<Vec<u32>> {
    let mut is_multiplier = vec![false; node_blocks];
    multipliers.iter().for_each(|&node_block| is_multiplier[node_block as usize] = true);
    let others: Vec<u32> = (0..node_blocks as u32).filter(|&node_block| !is_multiplier[node_block as usize]).collect();
    let mut number_of = vec![NO_ROW; node_blocks];
    (0..).zip(&others).for_each(|(number, &node_block)| number_of[node_block as usize] = number);
    let mut starts = vec![0];
    let mut rows = Vec::new();
    for &node_block in &others {
        rows.extend(
            adjacency.of(node_block as usize).map(|other| number_of[other as usize]).filter(|&row| row != NO_ROW),
        );
        starts.push(rows.len() as u32);
    }
    let found = minimum_degree(others.len(), &starts, &rows)?;
    let mut order = permuted(&others, &found);
    let place_of = inverse(&found);
    let last_met = |multiplier: u32| {
        let met = adjacency.of(multiplier as usize).map(|other| number_of[other as usize]).filter(|&row| row != NO_ROW);
        met.map(|number| place_of[number as usize]).max().unwrap_or(0)
    };
    let mut places: Vec<(u32, u32)> = (0..).zip(&order).map(|(place, &node_block)| (place, node_block)).collect();
    places.extend(multipliers.iter().map(|&multiplier| (last_met(multiplier), multiplier)));
    // The sort is stable: at equal positions a multiplier stays after the node block.
    places.sort_by_key(|&(place, _)| place);
    order.clear();
    order.extend(places.iter().map(|&(_, node_block)| node_block));
    Some(order)
}

/// Order of minimum degree. `None` if memory is not available, or after a request to stop.
fn minimum_degree(n: usize, column_starts: &[u32], rows: &[u32]) -> Option<Vec<u32>> {
    if n <= LONG_ORDERING {
        return minimum_degree_of(n, column_starts, rows);
    }
    let column_starts = column_starts.to_vec();
    let rows = rows.to_vec();
    threads::unless_interrupted(move || minimum_degree_of(n, &column_starts, &rows)).flatten()
}

fn minimum_degree_of(n: usize, column_starts: &[u32], rows: &[u32]) -> Option<Vec<u32>> {
    let structure = SymbolicSparseColMatRef::new_checked(n, n, column_starts, None, rows);
    let mut memory = MemBuffer::try_new(amd::order_scratch::<u32>(n, rows.len())).ok()?;
    let mut order = vec![0_u32; n];
    let mut row_of = vec![0_u32; n];
    amd::order(&mut order, &mut row_of, structure, Default::default(), MemStack::new(&mut memory)).ok()?;
    Some(order)
}

/// Order without further fill that ends in a clique in the middle: the reverse of a maximum
/// cardinality search from there.
fn towards_the_middle(neighbours: &Neighbours) -> Vec<u32> {
    let n = neighbours.count();
    let earlier = neighbours.earlier();
    let start = middle(&neighbours.parents());
    let mut known = vec![0_u32; n];
    let mut is_done = vec![false; n];
    // Rows by their number of visited neighbours, the last found on top
    let mut waiting: Vec<Vec<u32>> = vec![(0..n as u32).rev().collect()];
    waiting[0].extend(neighbours.of(start).iter().rev().copied().chain([start as u32]));
    let mut order = Vec::with_capacity(n);
    while let Some(rows) = waiting.last_mut() {
        let Some(row) = rows.pop() else {
            waiting.pop();
            continue;
        };
        if is_done[row as usize] || known[row as usize] as usize != waiting.len() - 1 {
            continue;
        }
        is_done[row as usize] = true;
        order.push(row);
        for &other in earlier.of(row as usize).iter().chain(neighbours.of(row as usize)) {
            if !is_done[other as usize] {
                known[other as usize] += 1;
                let count = known[other as usize] as usize;
                waiting.resize(waiting.len().max(count + 1), Vec::new());
                waiting[count].push(other);
            }
        }
    }
    order.reverse();
    order
}

/// Row with the property that removing it and its later neighbours leaves no part of the tree with
/// more than half of the rows.
fn middle(parents: &[u32]) -> usize {
    let sizes = sizes(parents);
    // Children precede their parents.
    (0..parents.len()).find(|&row| 2 * sizes[row] as usize > parents.len()).unwrap_or(parents.len() - 1)
}

/// Number of rows in the subtree of each row, itself included.
fn sizes(parents: &[u32]) -> Vec<u32> {
    let mut sizes = vec![1; parents.len()];
    for (row, &parent) in parents.iter().enumerate() {
        if parent != NO_ROW {
            sizes[parent as usize] += sizes[row];
        }
    }
    sizes
}

/// Rows sorted by branch, those of the trunk last, and the row ranges of the branches; no branches
/// if more than three quarters of the rows are in one of them.
fn branches(parents: &[u32]) -> (Vec<u32>, Vec<Range<usize>>) {
    let n = parents.len();
    let roots = branch_roots(parents);
    let mut owner = vec![NO_ROW; n];
    for (number, rows) in (0..).zip(&roots) {
        rows.iter().for_each(|&row| owner[row as usize] = number);
    }
    for row in (0..n).rev() {
        if owner[row] == NO_ROW && parents[row] != NO_ROW {
            owner[row] = owner[parents[row] as usize];
        }
    }
    // Rows of the trunk have no owner and sort last.
    let mut rows: Vec<u32> = (0..n as u32).collect();
    rows.sort_by_key(|&row| owner[row as usize]);
    let mut start = 0;
    let branch = |number: u32| {
        let end = rows.partition_point(|&row| owner[row as usize] <= number);
        std::mem::replace(&mut start, end)..end
    };
    let branches: Vec<_> = (0..roots.len() as u32).map(branch).collect();
    let largest = branches.iter().map(Range::len).max().unwrap_or(n);
    if 4 * largest > 3 * n { ((0..n as u32).collect(), Vec::new()) } else { (rows, branches) }
}

/// Roots of the subtrees in each branch. The trunk takes the root of the largest subtree again and
/// again, as long as that reduces the cost.
fn branch_roots(parents: &[u32]) -> Vec<Vec<u32>> {
    let sizes = sizes(parents);
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); parents.len()];
    let mut trees = BinaryHeap::new();
    for (row, &parent) in (0..).zip(parents) {
        match children.get_mut(parent as usize) {
            Some(children) => children.push(row),
            None => trees.push((sizes[row as usize], Reverse(row))),
        }
    }
    // Each row of the trunk waits for all branches, which counts double.
    let cost = |trees: &BinaryHeap<(u32, Reverse<u32>)>, trunk: usize| {
        trees.peek().map_or(0, |(size, _)| (*size as usize).max(parents.len() / BRANCH_PARTS)) + 2 * trunk
    };
    let mut best = (cost(&trees, 0), trees.clone());
    for trunk in 1..=MAX_TRUNK_ROWS {
        let Some((_, Reverse(row))) = trees.pop() else { break };
        trees.extend(children[row as usize].iter().map(|&child| (sizes[child as usize], Reverse(child))));
        if cost(&trees, trunk) < best.0 {
            best = (cost(&trees, trunk), trees.clone());
        }
    }
    in_branches(best.1.into_vec(), parents.len() / BRANCH_PARTS)
}

/// Collects consecutive subtrees into branches of at least `enough` rows.
fn in_branches(mut trees: Vec<(u32, Reverse<u32>)>, enough: usize) -> Vec<Vec<u32>> {
    trees.sort_unstable_by_key(|&(_, Reverse(row))| row);
    let mut branches = Vec::<Vec<u32>>::new();
    let mut rows = enough;
    for (size, Reverse(row)) in trees {
        if rows >= enough {
            branches.push(Vec::new());
            rows = 0;
        }
        rows += size as usize;
        branches.iter_mut().next_back().into_iter().for_each(|branch| branch.push(row));
    }
    branches
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::{Connectivity, DofMap, Layout, NodeBlocks, Symmetry};

    /// Three chains of nodes that join at node 0. One of them is a ladder, which has fill.
    fn star(length: u32) -> Pattern {
        let node = |chain: u32, k: u32| if k == 0 { 0 } else { chain * length + k };
        let rungs = (2..length).map(|k| [node(0, k - 2), node(0, k)]);
        let steps = (0..3).flat_map(|chain| (1..=length).map(move |k| [node(chain, k - 1), node(chain, k)]));
        let mut connectivity = Connectivity::default();
        steps.chain(rungs).for_each(|[a, b]| connectivity.push([2 * a, 2 * a + 1, 2 * b, 2 * b + 1]));
        let slots = 2 * (3 * length as usize + 1);
        let node_blocks = NodeBlocks::new(slots, Layout::Spatial, |slot| slot % 2 == 1);
        Pattern::new(DofMap::new(slots, &[]).unwrap(), node_blocks, vec![connectivity], Symmetry::Whole)
    }

    /// Permuted neighbours equal those computed from the permuted order.
    #[test]
    fn neighbours_of_branches_are_those_of_their_order() {
        let pattern = star(700);
        let EliminationOrder { order, branches, neighbours } = find(&pattern, &[], usize::MAX).unwrap();
        let found = Neighbours::new(&pattern.adjacency(), &order, usize::MAX).unwrap();
        assert!(branches.len() > 1, "nothing was permuted");
        assert_eq!((neighbours.starts, neighbours.later), (found.starts, found.later));
    }
}
