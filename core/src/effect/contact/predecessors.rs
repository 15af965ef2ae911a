//! The points of the last look at a contact that its present candidates were: a candidate takes over
//! the multiplier of one and the tractions of all.
//!
//! Candidates come and go where a contact passes to the next element or edge: two points become one,
//! or a node gives way to a closest point beside it. Normal forces find themselves anew. Friction
//! cannot: it follows from the past. So a point that has no successor leaves its traction to the
//! nearest candidate.

use crate::kernel::contact::CarriedTraction;
use crate::system::PointMemory;
use std::cmp::Ordering;

/// The largest distance, in elements, between the places of a contact in two states.
pub(super) const LARGEST_SHIFT: f64 = 1.5;

/// How a candidate is related to a point in memory. The closest relation comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Relation {
    /// They touch the same thing
    Same,
    /// They touch different edges
    OtherEdge,
    /// One touches an edge, the other one a face or a smooth surface
    OtherFeature,
    /// The candidate is not that point, but may take over its traction
    Beside,
}

/// A candidate and a point in memory near it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    /// Number of the candidate
    pub(super) candidate: usize,
    /// Number of the point in memory
    pub(super) point: usize,
    pub(super) relation: Relation,
    /// The distance of their places, in elements
    pub(super) shift: f64,
}

impl Link {
    fn numbers(&self) -> (usize, usize) {
        (self.candidate, self.point)
    }
}

/// The order in which links are taken.
fn by_closeness(a: &Link, b: &Link) -> Ordering {
    a.relation.cmp(&b.relation).then(a.shift.total_cmp(&b.shift)).then(a.numbers().cmp(&b.numbers()))
}

/// Takes the links that are the first ones both of their candidate and of their point, as nearly all are: no
/// other link can come before them.
fn take_mutual(links: &[Link], found: &mut [Predecessors], is_taken: &mut [bool]) {
    let mut of_candidates: Vec<Option<&Link>> = vec![None; found.len()];
    let mut of_points: Vec<Option<&Link>> = vec![None; is_taken.len()];
    for link in links.iter().filter(|link| link.relation != Relation::Beside) {
        for first in [&mut of_candidates[link.candidate], &mut of_points[link.point]] {
            if first.is_none_or(|first| by_closeness(link, first).is_lt()) {
                *first = Some(link);
            }
        }
    }
    for link in of_candidates.into_iter().flatten() {
        if of_points[link.point].is_some_and(|first| first.numbers() == link.numbers()) {
            found[link.candidate].own = Some(link.point);
            is_taken[link.point] = true;
        }
    }
}

/// The points in memory from which a candidate takes over.
#[derive(Clone, Debug, Default)]
pub(super) struct Predecessors {
    /// Number of the point that it was
    pub(super) own: Option<usize>,
    /// Numbers of points without a successor of their own that are nearest to it
    merged: Vec<usize>,
}

impl Predecessors {
    /// Those of each candidate. Each point in memory becomes one candidate, the nearest ones of the
    /// closest relation first.
    pub fn of(mut links: Vec<Link>, candidates: usize, points: usize) -> Vec<Self> {
        let mut found = vec![Self::default(); candidates];
        let mut is_taken = vec![false; points];
        take_mutual(&links, &mut found, &mut is_taken);
        links.retain(|link| !is_taken[link.point]);
        links.sort_by(by_closeness);
        for link in links.iter().filter(|link| link.relation != Relation::Beside) {
            let own = &mut found[link.candidate].own;
            if own.is_none() && !is_taken[link.point] {
                *own = Some(link.point);
                is_taken[link.point] = true;
            }
        }
        links.retain(|link| !is_taken[link.point]);
        links.sort_by(|a, b| a.shift.total_cmp(&b.shift).then(a.numbers().cmp(&b.numbers())));
        for link in links {
            if !is_taken[link.point] {
                found[link.candidate].merged.push(link.point);
                is_taken[link.point] = true;
            }
        }
        found
    }

    /// Numbers of all points of which the candidate is the successor.
    pub fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.own.into_iter().chain(self.merged.iter().copied())
    }

    /// The traction that a candidate of this weight takes over. `point` has the memory of a point by its
    /// number. Tractions of points that merge add up, turned to the first normal.
    pub fn traction<'a>(&self, weight: f64, point: &dyn Fn(usize) -> &'a PointMemory) -> CarriedTraction {
        let carried = |number: usize, part: f64| {
            let whole = point(number).carried;
            CarriedTraction { force: whole.force * part, ..whole }
        };
        let own = self.own.map(|number| carried(number, 1.0));
        let merged = self.merged.iter().map(|&number| carried(number, point(number).weight / weight));
        own.into_iter().chain(merged).reduce(CarriedTraction::with).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Vec3;

    fn link(candidate: usize, point: usize, relation: Relation, shift: f64) -> Link {
        Link { candidate, point, relation, shift }
    }

    fn point(force: Vec3, normal: Vec3, slides: bool, weight: f64) -> PointMemory {
        let carried = CarriedTraction { force, normal, slides };
        PointMemory { carried, weight, ..PointMemory::default() }
    }

    #[test]
    fn each_point_becomes_one_candidate() {
        let same = |candidate, point, shift| link(candidate, point, Relation::Same, shift);
        let other = |candidate, point, shift| link(candidate, point, Relation::OtherEdge, shift);
        // The nearer one of two candidates, and the same edge before another one that is nearer.
        let found = Predecessors::of(vec![same(0, 0, 0.4), same(1, 0, 0.3), other(1, 1, 0.1), other(2, 1, 0.5)], 3, 2);
        assert_eq!(found.iter().map(|p| p.own).collect::<Vec<_>>(), [None, Some(0), Some(1)]);
        assert!(found.iter().all(|p| p.merged.is_empty()));
    }

    #[test]
    fn points_without_a_successor_merge_with_the_nearest() {
        let links = vec![
            link(0, 0, Relation::Same, 0.1),
            link(0, 1, Relation::Same, 0.2),
            link(1, 2, Relation::Same, 0.1),
            link(1, 1, Relation::Beside, 0.9),
        ];
        let found = Predecessors::of(links, 2, 3);
        assert_eq!((found[0].own, &found[0].merged[..]), (Some(0), &[1][..]));
        assert_eq!((found[1].own, &found[1].merged[..]), (Some(2), &[][..]));
    }

    #[test]
    fn tractions_of_merged_points_add_up_on_the_tangent_plane() {
        let [x, y, z] = Vec3::UNIT;
        let tilted = (z + x * 0.1).normalized().unwrap();
        let along = (x - z * 0.1).normalized().unwrap();
        let memory = [point(x * 0.25, z, false, 1.0), point(along, tilted, true, 0.5)];
        let of = |number: usize| &memory[number];
        let predecessors = Predecessors { own: Some(0), merged: vec![1] };
        let both = predecessors.traction(1.0, &of);
        assert!((both.force - x * 0.75).norm() < 1e-15 && both.normal == z);
        assert!(!both.slides);
        let turned = [point(x, z, true, 1.0), point(y, -z, true, 1.0)];
        let of = |number: usize| &turned[number];
        assert_eq!(predecessors.traction(1.0, &of).force, x);
    }

    /// The assignment by sorting all links, of which most are taken at once.
    fn sorted(mut links: Vec<Link>, candidates: usize, points: usize) -> Vec<Option<usize>> {
        let mut own = vec![None; candidates];
        let mut is_taken = vec![false; points];
        links.sort_by(by_closeness);
        for link in links.iter().filter(|link| link.relation != Relation::Beside) {
            if own[link.candidate].is_none() && !is_taken[link.point] {
                own[link.candidate] = Some(link.point);
                is_taken[link.point] = true;
            }
        }
        own
    }

    #[test]
    fn links_are_taken_as_if_all_were_sorted() {
        use crate::kernel::contact::dual::Random;
        let mut random = Random(31);
        for _ in 0..500 {
            let [candidates, points] = [0, 1].map(|_| random.between(1.0, 6.99) as usize);
            let relations = [Relation::Same, Relation::OtherEdge, Relation::OtherFeature, Relation::Beside];
            let mut links = Vec::new();
            for candidate in 0..candidates {
                for point in 0..points {
                    // Few different shifts, so that many are equal.
                    let shift = random.between(0.0, 2.99).floor() / 2.0;
                    if random.between(0.0, 1.0) < 0.6 {
                        links.push(link(candidate, point, relations[random.between(0.0, 3.99) as usize], shift));
                    }
                }
            }
            let found = Predecessors::of(links.clone(), candidates, points);
            assert_eq!(found.iter().map(|p| p.own).collect::<Vec<_>>(), sorted(links, candidates, points));
        }
    }
}
