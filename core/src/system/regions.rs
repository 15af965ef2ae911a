//! Regions: a large scene is cut into runs of consecutive node blocks, which are evaluated in
//! parallel.
//!
//! The cuts depend on the scene alone. Instances between regions, and effects that are not
//! divisible, are added after all regions in their order, so that sums have the same terms in the
//! same order on any number of threads.

use super::connectivity::Connectivity;
use super::dof_map::DofMap;
use super::node_blocks::NodeBlocks;
use crate::scalar::LANES;
use crate::threads;
use std::ops::Range;

/// Least number of node blocks in a region of a large scene: enough work for a thread, few enough
/// that the values it writes stay in its cache
const NODE_BLOCKS_PER_REGION: usize = 1024;

/// A run of consecutive node blocks.
#[derive(Clone, Debug)]
pub struct Region {
    /// Index of the region
    pub(crate) number: usize,
    /// Node blocks, which are columns of tiles
    pub(crate) node_blocks: Range<usize>,
    /// Slots of these node blocks
    pub(crate) slots: Range<usize>,
    /// Equations of these slots
    pub(crate) equations: Range<usize>,
    /// Off-diagonal tiles stored in these columns
    pub(crate) tiles: Range<usize>,
}

/// Instances of an effect by region, as ranges.
#[derive(Clone, Debug, Default)]
pub struct InstanceRanges {
    inside: Vec<Vec<Range<usize>>>,
    others: Vec<Range<usize>>,
}

impl InstanceRanges {
    /// Divides the instances of an effect into those within one region and all others. Effects that
    /// are not [divisible](Connectivity::divisible) have others only.
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

    /// Instances within one region; with `None` those within no single region.
    pub fn of(&self, region: Option<usize>) -> &[Range<usize>] {
        region.map_or(&self.others, |region| &self.inside[region])
    }
}

/// Region of a slot. All regions but the last have the length of the first.
fn region_of(slot: u32, node_blocks: &NodeBlocks, regions: &[Region]) -> usize {
    node_blocks.of(slot) / regions[0].node_blocks.len()
}

/// By region: true if some instance of an effect has a slot in it.
pub fn touched(connectivity: &Connectivity, node_blocks: &NodeBlocks, regions: &[Region]) -> Vec<bool> {
    let mut touched = vec![false; regions.len()];
    for &slot in connectivity.iter().flatten() {
        touched[region_of(slot, node_blocks, regions)] = true;
    }
    touched
}

/// Ranges of instances that are evaluated together in vector lanes: at most [`LANES`] consecutive
/// ones with equal numbers of slots.
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

/// Calls `work` for each region, in parallel, with its items in `list`; `end` gives the end of its
/// items.
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

/// Number of regions of a scene of `nodes` nodes.
pub fn most(nodes: usize) -> usize {
    (nodes / NODE_BLOCKS_PER_REGION).max(1)
}

/// Cuts a scene into regions of equal length.
pub fn cut(all_blocks: &NodeBlocks, dof_map: &DofMap, column_starts: &[u32]) -> Vec<Region> {
    let all = all_blocks.count();
    let count = most(all);
    let length = all.div_ceil(count).max(1);
    let region = |number: usize| {
        let node_blocks = (length * number).min(all)..(length * (number + 1)).min(all);
        let slots = all_blocks.first_slot(node_blocks.start)..all_blocks.first_slot(node_blocks.end);
        let equations = dof_map.before(slots.start)..dof_map.before(slots.end);
        let tiles = column_starts[node_blocks.start] as usize..column_starts[node_blocks.end] as usize;
        Region { number, node_blocks, slots, equations, tiles }
    };
    (0..all.div_ceil(length).max(1)).map(region).collect()
}
