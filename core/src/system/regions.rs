//! A large scene in regions of nodes that follow each other: what lies in one of them is evaluated at once with what lies in others.
//!
//! Regions are cut by the scene alone. Elements between regions, and effects that are not cut, come after all regions, in their order:
//! a sum has the same terms in the same order on any number of threads.

use super::connectivity::Connectivity;
use super::dof_map::DofMap;
use super::node_blocks::NodeBlocks;
use crate::scalar::LANES;
use crate::threads;
use std::ops::Range;

/// Tile columns in a region: enough that a thread has something to do, few enough that what it writes stays near it
const GROUPS: usize = 1024;

/// What belongs to nodes that follow each other.
#[derive(Clone, Debug)]
pub struct Region {
    /// Its place among all
    pub number: usize,
    /// Columns of tiles
    pub node_blocks: Range<usize>,
    /// Their slots
    pub slots: Range<usize>,
    /// Their equations
    pub dof_map: Range<usize>,
    /// The tiles in these columns beside the diagonal
    pub tiles: Range<usize>,
}

/// The instances of an effect that lie in each region, and all others.
#[derive(Clone, Debug, Default)]
pub struct Shares {
    inside: Vec<Vec<Range<usize>>>,
    others: Vec<Range<usize>>,
}

impl Shares {
    /// Of instances that couple these slots.
    pub fn new(connectivity: &Connectivity, node_blocks: &NodeBlocks, regions: &[Region]) -> Self {
        if regions.len() < 2 || !connectivity.divisible {
            let all = std::iter::once(0..connectivity.len());
            return Self { inside: vec![Vec::new(); regions.len()], others: all.collect() };
        }
        let region = |slot: u32| region_of(slot, node_blocks, regions);
        let mut out = Self { inside: vec![Vec::new(); regions.len()], others: Vec::new() };
        for row in rows(connectivity) {
            let mut slots = row.clone().flat_map(|k| connectivity.get(k));
            let first = slots.next().map(|&slot| region(slot));
            let own = first.filter(|first| slots.all(|&slot| region(slot) == *first));
            let runs = own.map_or(&mut out.others, |own| &mut out.inside[own]);
            match runs.last_mut() {
                Some(run) if run.end == row.start => run.end = row.end,
                _ => runs.push(row),
            }
        }
        out
    }

    /// Those in a region, or with `None` those in none.
    pub fn of(&self, region: Option<usize>) -> &[Range<usize>] {
        region.map_or(&self.others, |region| &self.inside[region])
    }
}

/// All regions but the last are of the same length.
fn region_of(slot: u32, node_blocks: &NodeBlocks, regions: &[Region]) -> usize {
    node_blocks.of(slot).0 / regions[0].node_blocks.len()
}

/// Whether something of an effect lies in each region, or between it and others.
pub fn touched(connectivity: &Connectivity, node_blocks: &NodeBlocks, regions: &[Region]) -> Vec<bool> {
    let mut touched = vec![false; regions.len()];
    for &slot in connectivity.iter().flatten() {
        touched[region_of(slot, node_blocks, regions)] = true;
    }
    touched
}

/// Instances that stand side by side: of one shape, as many as there are lanes.
fn rows(connectivity: &Connectivity) -> impl Iterator<Item = Range<usize>> {
    let mut start = 0;
    std::iter::from_fn(move || {
        let shape = |k: usize| connectivity.get(k).len();
        let most = connectivity.len().min(start + LANES);
        let end = (start + 1..most).find(|&k| shape(k) != shape(start)).unwrap_or(most);
        let row = start..end;
        start = end;
        (!row.is_empty()).then_some(row)
    })
}

/// Does something for each region with what belongs to it in a list, where it ends there.
pub fn each<T: Send>(
    regions: &[Region],
    list: &mut [T],
    end: impl Fn(&Region) -> usize,
    work: impl Fn(&Region, &mut [T]) + Send + Sync,
) {
    if let [all] = regions {
        return work(all, list);
    }
    let parts = threads::split(list, regions.iter().map(end));
    threads::each(regions.iter().zip(parts), |(region, part)| work(region, part));
}

/// The regions of a scene with so many nodes: one where it is not large.
pub fn most(nodes: usize) -> usize {
    (nodes / GROUPS).max(1)
}

/// Cuts a scene; all of it is one region where it is not large.
pub fn cut(all_groups: &NodeBlocks, dof_map: &DofMap, column_starts: &[u32]) -> Vec<Region> {
    let all = all_groups.count();
    let count = most(all);
    let length = all.div_ceil(count).max(1);
    let region = |number: usize| {
        let node_blocks = (length * number).min(all)..(length * (number + 1)).min(all);
        let slots = all_groups.first_slot(node_blocks.start)..all_groups.first_slot(node_blocks.end);
        let dof_map = dof_map.before(slots.start)..dof_map.before(slots.end);
        let tiles = column_starts[node_blocks.start] as usize..column_starts[node_blocks.end] as usize;
        Region { number, node_blocks, slots, dof_map, tiles }
    };
    (0..all.div_ceil(length).max(1)).map(region).collect()
}
