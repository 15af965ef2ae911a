//! The search for the largest value of a measure of the stress over many points: branch and bound
//! over a tree of points.
//!
//! Measures are convex and proportional to the load (von Mises stress, principal stresses, failure
//! indices): that of a sum is at most the sum of those of its parts. A group of points therefore
//! has no more than its middle, plus for each resultant its size times the largest measure of the
//! differences of unit stresses from the middle. The search is exact.

use super::{Matrix6, Point, Vector6};
use crate::sorting::sort_by;
use std::ops::Range;

/// Points of the smallest groups
const LEAF: usize = 6;

/// Points of a section, in a tree of groups.
#[derive(Clone, Debug)]
pub struct PointTree {
    /// Number of each point, in the order of the tree
    numbers: Vec<u32>,
    /// Stresses under unit resultants, by columns, in the order of the tree
    units: Vec<Matrix6>,
    groups: Vec<Group>,
}

/// A group of points.
#[derive(Clone, Debug)]
struct Group {
    points: Range<usize>,
    /// Mean of the unit stresses
    middle: Matrix6,
    /// The groups that it consists of
    parts: Option<[usize; 2]>,
}

/// For each group and resultant the largest measure of the differences from its middle.
#[derive(Clone, Debug)]
pub struct Spread(Vec<[f64; 6]>);

/// A point that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Value of the measure
    pub(super) value: f64,
    /// Number of the point
    pub(super) point: usize,
    /// Position of the point in the order of the tree
    pub(super) position: usize,
}

impl PointTree {
    /// A tree of points with unit stresses. Points of one `kind` lie together.
    pub fn new(at: &[Point], kind: &[usize], units: &[Matrix6]) -> Self {
        let mut tree = Self { numbers: (0..at.len() as u32).collect(), units: Vec::new(), groups: Vec::new() };
        if !at.is_empty() {
            tree.group(0..at.len(), at, kind);
        }
        tree.units = tree.numbers.iter().map(|&number| units[number as usize]).collect();
        for group in &mut tree.groups {
            let count = group.points.len() as f64;
            group.middle =
                tree.units[group.points.clone()].iter().fold(Matrix6::zeros(), |sum, unit| sum + unit) / count;
        }
        tree
    }

    /// Makes a group of a range of points and its parts; gives its index.
    fn group(&mut self, points: Range<usize>, at: &[Point], kind: &[usize]) -> usize {
        let index = self.groups.len();
        self.groups.push(Group { points: points.clone(), middle: Matrix6::zeros(), parts: None });
        if points.len() <= LEAF {
            return index;
        }
        let own = &mut self.numbers[points.clone()];
        let extent = |axis: usize| {
            let values = own.iter().map(|&number| at[number as usize][axis]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        let axis = usize::from(extent(1) > extent(0));
        let is_mixed = own.iter().any(|&number| kind[number as usize] != kind[own[0] as usize]);
        let order = |a: &u32, b: &u32| {
            let [a, b] = [*a as usize, *b as usize];
            let by_kind = if is_mixed { kind[a].cmp(&kind[b]) } else { std::cmp::Ordering::Equal };
            by_kind.then(at[a][axis].total_cmp(&at[b][axis])).then(a.cmp(&b))
        };
        own.sort_unstable_by(order);
        let middle = points.start + points.len() / 2;
        let first = self.group(points.start..middle, at, kind);
        let second = self.group(middle..points.end, at, kind);
        self.groups[index].parts = Some([first, second]);
        index
    }

    /// The spread of a measure within the groups.
    pub fn spread(&self, measure: impl Fn(&Vector6) -> f64) -> Spread {
        let of_group = |group: &Group| {
            let mut largest = [0.0_f64; 6];
            for unit in &self.units[group.points.clone()] {
                let off = unit - group.middle;
                for (k, largest) in largest.iter_mut().enumerate() {
                    let off = off.column(k).into_owned();
                    *largest = largest.max(measure(&off)).max(measure(&-off));
                }
            }
            largest
        };
        Spread(self.groups.iter().map(of_group).collect())
    }

    /// The stress at a point, given by its position in the order of the tree.
    pub fn stress(&self, position: usize, load: &Vector6) -> Vector6 {
        self.units[position] * load
    }

    /// The largest value of a measure above a floor.
    pub fn largest(
        &self,
        spread: &Spread,
        measure: impl Fn(&Vector6) -> f64,
        load: &Vector6,
        floor: f64,
    ) -> Option<Hit> {
        let mut best = None;
        let mut highest = floor;
        self.visit(
            spread,
            &measure,
            load,
            |hit, limit| {
                if hit.value > highest {
                    highest = hit.value;
                    best = Some(hit);
                }
                *limit = highest;
            },
            floor,
        );
        best
    }

    /// All points with a value above a floor.
    pub fn above(&self, spread: &Spread, measure: impl Fn(&Vector6) -> f64, load: &Vector6, floor: f64) -> Vec<Hit> {
        let mut found = Vec::new();
        self.visit(
            spread,
            &measure,
            load,
            |hit, _| {
                if hit.value > floor {
                    found.push(hit)
                }
            },
            floor,
        );
        found
    }

    /// Shows the points of all groups that may exceed a limit, which `see` may raise.
    fn visit(
        &self,
        Spread(spread): &Spread,
        measure: &dyn Fn(&Vector6) -> f64,
        load: &Vector6,
        mut see: impl FnMut(Hit, &mut f64),
        floor: f64,
    ) {
        let bound = |index: usize| {
            let off = spread[index].iter().zip(load.iter()).map(|(spread, load)| spread * load.abs()).sum::<f64>();
            measure(&(self.groups[index].middle * load)) + off
        };
        let mut limit = floor;
        let mut open: Vec<(f64, usize)> = Vec::new();
        if !self.groups.is_empty() {
            open.push((bound(0), 0));
        }
        while let Some((most, index)) = open.pop() {
            // Not `<=`: a bound that is not a number must not hide anything.
            if most.partial_cmp(&limit).is_some_and(std::cmp::Ordering::is_le) {
                continue;
            }
            let group = &self.groups[index];
            if let Some([first, second]) = group.parts {
                let mut both = [(bound(first), first), (bound(second), second)];
                sort_by(&mut both, |a, b| a.0.total_cmp(&b.0));
                open.extend(both);
                continue;
            }
            for k in group.points.clone() {
                let value = measure(&(self.units[k] * load));
                see(Hit { value, point: self.numbers[k] as usize, position: k }, &mut limit);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::stress::von_mises;
    use super::*;

    #[test]
    fn the_search_finds_what_looking_at_all_points_finds() {
        let wave = |i: usize| libm::sin(12.9898 * i as f64) * 43758.5453 % 1.0;
        let at: Vec<Point> = (0..500).map(|i| [wave(2 * i), wave(2 * i + 1)]).collect();
        let kind: Vec<usize> = (0..500).map(|i| i % 3).collect();
        let unit = |i: usize| {
            Matrix6::from_fn(|row, column| libm::cos(3.0 * at[i][row % 2] + (row + 2 * column + kind[i]) as f64))
        };
        let units: Vec<Matrix6> = (0..500).map(unit).collect();
        let tree = PointTree::new(&at, &kind, &units);
        let spread = tree.spread(von_mises);
        for load in 0..50 {
            let load = Vector6::from_fn(|i, _| wave(1000 + 6 * load + i));
            let all = units.iter().map(|unit| von_mises(&(unit * load))).fold(0.0, f64::max);
            let found = tree.largest(&spread, von_mises, &load, 0.0).expect("a point");
            assert!((found.value - all).abs() <= 1e-12 * all);
            assert_eq!(tree.largest(&spread, von_mises, &load, all * 1.0001), None);
            assert!(tree.above(&spread, von_mises, &load, 0.9 * all).contains(&found));
        }
    }
}
