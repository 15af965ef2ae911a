//! The list of pairs of elements that are near each other.
//!
//! It is made from the places of nodes in a state that is accepted, and holds all pairs nearer than a margin m,
//! those that may touch in the next step, and some that were listed before. As long as no node has moved by more
//! than m/2 since, no other pair can touch. A step that moves some node farther is looked at as a whole: pairs that
//! its motion may bring together are added, and the step is taken again.

use super::point::PairsNow;
use super::{BeamPairs, ElementOf, PairRole, Strand};
use crate::effect::Missed;
use crate::effect::contact::chain::REACH;
use crate::kernel::contact::grid::{Ball, overlapping};
use crate::kernel::contact::pair_search::{Segments, safe_part};
use crate::system::{ListedPair, PairsMemory, State};
use crate::tensor::Vec3;
use std::sync::Arc;

/// The margin of a list, over the largest radius.
const MARGIN_OF_RADIUS: f64 = 0.3;

/// The margin of a list, over the longest element.
const MARGIN_OF_ELEMENT: f64 = 0.1;

/// How many times the approach of a pair in the last step it may be apart beyond the margin and be in the list: it may
/// touch in the next one.
const STEPS_AHEAD: f64 = 2.5;

/// Pairs whose gap is larger than this number of margins are in no list, however fast they come: pairs that are missed
/// are added, and the step taken again, which costs less than the places of many pairs in the tangent.
const LARGEST_MARGIN: f64 = 12.0;

/// A pair stays in the list up to this number of times the gap at which it comes into it: a new list takes a new pattern
/// of the tangent.
const KEPT: f64 = 1.5;

/// A list is made anew when a node has moved by this part of the margin.
const OLD: f64 = 0.25;

/// Pairs that a step may add to a list, for each element.
const MOST_MISSED: usize = 8;

impl BeamPairs {
    /// Makes the first list.
    pub(in crate::effect::contact) fn list(&self, at: &State) -> PairsMemory {
        let places = self.places(at);
        let margin = self.margin();
        let list = self.near(&places, margin, &|_, gap| gap <= margin);
        PairsMemory {
            directions: Arc::new(self.directions_of(&list, &places)),
            accepted: Arc::new(if list.is_empty() { Vec::new() } else { places.clone() }),
            list: Arc::new(list),
            places: Arc::new(places),
            margin,
            points: Arc::default(),
            nodes: Arc::default(),
        }
    }

    /// Makes the list of an accepted state anew where nodes have moved, and in any case the
    /// directions by which points share their forces.
    pub(super) fn renew_list(&self, before: &State, memory: &mut PairsMemory, at: &State) {
        let places = self.places(at);
        if farthest(&places, &memory.places) > OLD * memory.margin {
            let before = self.places(before);
            let margin = self.margin();
            // Both elements of a pair may move.
            let fastest = 2.0 * STEPS_AHEAD * farthest(&places, &before);
            let reach = (KEPT * (margin + fastest)).min(LARGEST_MARGIN * margin);
            let list = self.near(&places, reach, &|pair, gap| {
                let is_listed = memory.list.binary_search(pair).is_ok();
                let approach = (self.chord_gap(pair, &before) - gap).max(0.0);
                let limit = margin + STEPS_AHEAD * approach;
                gap <= if is_listed { KEPT * limit } else { limit }
            });
            if list != *memory.list {
                memory.list = Arc::new(list);
            }
            memory.margin = margin;
            memory.places = Arc::new(places.clone());
        }
        memory.directions = Arc::new(self.directions_of(&memory.list, &places));
        memory.accepted = Arc::new(if memory.list.is_empty() { Vec::new() } else { places });
    }

    /// Adds to the list of `from` the pairs that may have met on the way to another state without
    /// being listed.
    pub(in crate::effect::contact) fn add_missed(&self, from: &mut State, to: &State) -> Missed {
        let [before, after] = [&*from, to].map(|at| self.places(at));
        let memory = &mut from.contacts.pairs;
        if farthest(&after, &memory.places) <= 0.5 * memory.margin {
            return Missed::None;
        }
        let mut missed = Vec::new();
        self.each_near(&self.swept(&before, &after), &mut |pair| {
            if memory.list.binary_search(&pair).is_err() && self.may_meet(&pair, &before, &after) {
                missed.push(pair);
            }
        });
        let Some(first) = missed.first() else { return Missed::None };
        let slot = self.nodes_of(first)[0][0].node.u;
        if missed.len() > MOST_MISSED * self.first_elements.last().copied().unwrap_or_default() {
            return Missed::TooMany(slot);
        }
        let mut list = (*memory.list).clone();
        list.extend(missed);
        list.sort_unstable();
        memory.directions = Arc::new(self.directions_of(&list, &before));
        memory.accepted = Arc::new(before);
        memory.list = Arc::new(list);
        Missed::Listed(slot)
    }

    /// Directions at all nodes; none where no pair is listed.
    fn directions_of(&self, list: &[ListedPair], places: &[Vec3]) -> Vec<Vec3> {
        if list.is_empty() { Vec::new() } else { self.directions(places) }
    }

    /// The margin of a list.
    fn margin(&self) -> f64 {
        let of_strand = |strand: &Strand| {
            let lengths = (0..strand.elements()).map(|k| super::arcs_of(strand, k)).map(|[from, to]| to - from);
            let longest = lengths.fold(0.0, f64::max);
            (MARGIN_OF_RADIUS * strand.radius).max(MARGIN_OF_ELEMENT * longest)
        };
        self.strands.iter().map(of_strand).fold(0.0, f64::max)
    }

    /// The pairs whose surfaces are nearer than `reach` and for which `is_near` holds, which is shown their gap.
    fn near(&self, places: &[Vec3], reach: f64, is_near: &dyn Fn(&ListedPair, f64) -> bool) -> Vec<ListedPair> {
        let mut list = Vec::new();
        let mut balls = self.swept(places, places);
        balls.iter_mut().for_each(|ball| ball.reach += 0.5 * reach);
        self.each_near(&balls, &mut |pair| {
            let gap = self.chord_gap(&pair, places);
            if gap <= reach && is_near(&pair, gap) {
                list.push(pair);
            }
        });
        list.sort_unstable();
        list
    }

    /// The least gap of surfaces among all pairs of a contact; infinite without pairs. Pairs that are
    /// not listed are looked for farther and farther away.
    pub(super) fn least_gap_of(&self, role: PairRole, contact: usize, at: &State) -> f64 {
        let memory = &at.contacts.pairs;
        let least = |list: &[ListedPair]| {
            let now = PairsNow::new(self, role.laws, at, list);
            let own = list.iter().filter(|pair| self.contact_of(pair.meeting as usize) == contact);
            own.map(|pair| now.gap(pair)).fold(f64::INFINITY, f64::min)
        };
        let has_some = (0..self.len()).any(|meeting| self.contact_of(meeting) == contact);
        let listed = least(&memory.list);
        // Nodes move by a quarter of the margin at most before a list is made anew.
        if listed <= (1.0 - 2.0 * OLD) * memory.margin || !has_some {
            return listed;
        }
        let places = self.places(at);
        let size = farthest(&places, &vec![places[0]; places.len()]);
        let mut margin = if listed.is_finite() { listed } else { 2.0 * self.margin() };
        loop {
            let gap = least(&self.near(&places, margin, &|_, _| true));
            if gap <= margin || margin > 4.0 * size {
                return gap;
            }
            margin *= 2.0;
        }
    }

    /// Shows the pairs of meetings whose balls overlap, without neighbours along a beam.
    fn each_near(&self, balls: &[Ball], show: &mut dyn FnMut(ListedPair)) {
        overlapping(balls, &mut |i, j| {
            let [a, b] = [i, j].map(|number| self.element(number));
            let Some(&meeting) = self.by_strands.get(&[a.strand, b.strand]) else { return };
            if !self.are_neighbours(meeting, [a.element, b.element]) {
                let elements = [a.element, b.element].map(|element| element as u32);
                show(ListedPair { meeting: meeting as u32, elements });
            }
        });
    }

    /// Balls that hold each element with its radius on its way.
    fn swept(&self, before: &[Vec3], after: &[Vec3]) -> Vec<Ball> {
        let mut balls = Vec::with_capacity(self.first_elements.last().copied().unwrap_or_default());
        for (number, strand) in self.strands.iter().enumerate() {
            for element in 0..strand.elements() {
                let of = ElementOf { strand: number, element };
                let [from, to] = [before, after].map(|places| extent(self.of_element(of, places)));
                let way = 0.5 * (to.middle - from.middle).norm();
                let middle = (from.middle + to.middle) * 0.5;
                balls.push(Ball { middle, reach: way + from.reach.max(to.reach) + strand.radius });
            }
        }
        balls
    }

    /// True if surfaces of a pair may touch on the way.
    fn may_meet(&self, pair: &ListedPair, before: &[Vec3], after: &[Vec3]) -> bool {
        let [a, b] = self.both(pair.meeting as usize);
        let sag = self.sags(pair, before).max(self.sags(pair, after)) + a.radius + b.radius;
        self.least_part(pair, before, after, [sag, f64::INFINITY]) < 1.0
    }

    /// The part of a motion on which the chords of a pair stay apart by more than a sag; see
    /// [`safe_part`] for it and the distance that is enough.
    pub(super) fn least_part(
        &self,
        pair: &ListedPair,
        before: &[Vec3],
        after: &[Vec3],
        [sag, enough]: [f64; 2],
    ) -> f64 {
        let mut part = 1.0f64;
        self.each_chords(pair, before, &mut |[i, j], segments| {
            let [of_a, of_b] = self.elements_of(pair).map(|of| self.of_element(of, after));
            let motion = Segments {
                a: [of_a[i] - segments.a[0], of_a[i + 1] - segments.a[1]],
                b: [of_b[j] - segments.b[0], of_b[j + 1] - segments.b[1]],
            };
            part = part.min(safe_part(segments, &motion, sag, enough));
        });
        part
    }

    /// Visits the pairs of chords between neighbouring nodes of both elements, by their numbers.
    fn each_chords(&self, pair: &ListedPair, places: &[Vec3], visit: &mut dyn FnMut([usize; 2], &Segments)) {
        let [a, b] = self.elements_of(pair).map(|of| self.of_element(of, places));
        for i in 1..a.len() {
            for j in 1..b.len() {
                visit([i - 1, j - 1], &Segments { a: [a[i - 1], a[i]], b: [b[j - 1], b[j]] });
            }
        }
    }

    /// A bound of the gap of surfaces from below.
    pub(super) fn chord_gap(&self, pair: &ListedPair, places: &[Vec3]) -> f64 {
        let [a, b] = self.both(pair.meeting as usize);
        self.chord_distance(pair, places) - self.sags(pair, places) - a.radius - b.radius
    }

    /// The distance of the chords between neighbouring nodes of both elements.
    pub(super) fn chord_distance(&self, pair: &ListedPair, places: &[Vec3]) -> f64 {
        let mut least = f64::INFINITY;
        self.each_chords(pair, places, &mut |_, segments| least = least.min(segments.closest().distance));
        least
    }

    /// How far both elements are from their chords at most, in sum.
    fn sags(&self, pair: &ListedPair, places: &[Vec3]) -> f64 {
        self.elements_of(pair).map(|of| sag(self.of_element(of, places))).iter().sum()
    }
}

/// The largest distance between places of the same node.
fn farthest(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (*a - *b).squared()).fold(0.0, f64::max).sqrt()
}

/// A ball that holds the centre line of an element.
fn extent(nodes: &[Vec3]) -> Ball {
    let middle = nodes.iter().fold(Vec3::ZERO, |sum, node| sum + *node) * (1.0 / nodes.len() as f64);
    let farthest = nodes.iter().map(|node| (*node - middle).squared()).fold(0.0, f64::max).sqrt();
    Ball { middle, reach: REACH[nodes.len()] * farthest }
}

/// A bound of the distance of an element from the chords between its nodes: x'' h^2/8 with the
/// length h of a chord in s. x'' of a cubic is largest at an end.
fn sag(nodes: &[Vec3]) -> f64 {
    match nodes {
        [a, b, c] => (*a - *b * 2.0 + *c).norm() / 8.0,
        [a, b, c, d] => {
            let at_start = *a * 2.0 - *b * 5.0 + *c * 4.0 - *d;
            let at_end = *d * 2.0 - *c * 5.0 + *b * 4.0 - *a;
            at_start.norm().max(at_end.norm()) / 8.0
        }
        _ => 0.0,
    }
}
