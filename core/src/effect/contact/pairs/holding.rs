//! Points of beams that hold in a dynamic stage what a static one has pressed together.
//!
//! A static stage gives each point its own force. In a dynamic one points share a force by weights w,
//! so that a point with the force p per weight pushes by w p. Each force of the static stage goes to the
//! candidate that continues its point, with those at the same place. Where the kind of points changes, as
//! from closest points to nodes, it goes to those beside, by how near they are.

use super::point::{Found, PairsNow, sort};
use crate::effect::contact::predecessors::{Link, Predecessors};
use crate::kernel::contact::CarriedTraction;
use crate::system::{ListedPair, PairPointMemory, PointMemory};
use crate::tensor::Vec3;

/// Points of two elements are at one place if their places along both beams differ by less than this, in
/// elements: those at a common node of two elements.
const AT_ONE_PLACE: f64 = 1e-3;

/// Points beside take a force if their places along both beams differ by less than this, in elements.
const BESIDE: f64 = 2.0;

/// The candidates of a meeting with the points in memory that they may continue.
struct Heirs {
    found: Vec<Found>,
    /// By candidate
    links: Vec<Vec<Link>>,
    was: Vec<Predecessors>,
    /// True for points in memory that a candidate continues
    goes_on: Vec<bool>,
}

impl PairsNow<'_> {
    /// The points in memory with which a dynamic stage begins. The place and the push of a body are those
    /// of the nearest point until the first step is accepted.
    pub fn holding_points(&self) -> Vec<PairPointMemory> {
        let mut out = Vec::new();
        let mut first = 0;
        for group in self.list.chunk_by(|a, b| a.meeting == b.meeting) {
            let (_, known) = self.memory_of_meeting(group[0].meeting);
            if !known.is_empty() {
                self.add_holding(&self.heirs(first, group, known), known, &mut out);
            }
            first += group.len();
        }
        sort(&mut out);
        out
    }

    fn heirs(&self, first: usize, group: &[ListedPair], known: &[PairPointMemory]) -> Heirs {
        let laws = &self.laws[self.pairs.contact_of(group[0].meeting as usize)];
        let found = self.found(first, group, laws.penetration);
        let was = self.predecessors(&found, known, laws);
        let links_of = |found: &Found| self.links(&self.list[found.number], &found.candidate, known);
        let links = found.iter().map(links_of).collect();
        let mut heirs = Heirs { found, links, was, goes_on: Vec::new() };
        heirs.goes_on = (0..known.len())
            .map(|point| heirs.all().any(|(k, link)| link.point == point && heirs.continues(k, link)))
            .collect();
        heirs
    }

    /// Adds the heirs of points in memory, and the points that have none.
    fn add_holding(&self, heirs: &Heirs, known: &[PairPointMemory], out: &mut Vec<PairPointMemory>) {
        let mut weights = vec![0.0; known.len()];
        for (k, link) in heirs.all() {
            weights[link.point] += heirs.found[k].candidate.weight * heirs.nearness(k, link);
        }
        for (k, Found { number, candidate }) in heirs.found.iter().enumerate() {
            let held = || heirs.links[k].iter().filter(|link| heirs.nearness(k, link) > 0.0);
            let Some(nearest) = held().min_by(|a, b| a.shift.total_cmp(&b.shift)) else { continue };
            let nearest = &known[nearest.point];
            let (mut force, mut traction) = (0.0, Vec3::ZERO);
            for link in held() {
                let before = &known[link.point];
                let part = before.point.weight * heirs.nearness(k, link) / weights[link.point];
                force += before.point.force * part;
                traction += before.point.carried.force * part;
            }
            let elements = self.list[*number].elements;
            let [place, on_second] = [0, 1].map(|side| f64::from(elements[side]) + candidate.at[side]);
            let carried = CarriedTraction { force: traction, ..nearest.point.carried };
            let stiffness = self.stiffness(&self.list[*number]);
            let point = PointMemory { place, force, carried, stiffness, weight: candidate.weight, ..nearest.point };
            out.push(PairPointMemory { kind: candidate.kind, on_second, point, ..*nearest });
        }
        out.extend(known.iter().zip(&weights).filter(|(_, weight)| **weight == 0.0).map(|(point, _)| *point));
    }
}

impl Heirs {
    /// All links, with the number of the candidate.
    fn all(&self) -> impl Iterator<Item = (usize, &Link)> {
        self.links.iter().enumerate().flat_map(|(k, links)| links.iter().map(move |link| (k, link)))
    }

    /// True if candidate `k` continues a point, or is at its place.
    fn continues(&self, k: usize, link: &Link) -> bool {
        link.shift < AT_ONE_PLACE || self.was[k].own == Some(link.point)
    }

    /// How much of the force of a point candidate `k` takes, beside its weight.
    fn nearness(&self, k: usize, link: &Link) -> f64 {
        match self.goes_on[link.point] {
            true => f64::from(self.continues(k, link)),
            false => (BESIDE - link.shift).max(0.0),
        }
    }
}
