//! How contact points of beams share their force.
//!
//! Where beams cross, closest points carry it; where they are side by side, the nodes of both; in
//! between, both. The angle is that of directions at the nodes, linear along the elements, so that
//! a point that passes from one element to the next keeps its share. Beams that cross at a small angle, with nodes
//! farther apart than they are thick, cross between nodes that do not touch: closest points carry the
//! force there, too.

use super::candidate::{AT_NODE, Kinds, PairCandidate};
use super::point::{Found, PairsNow};
use super::{BeamPairs, ElementOf};
use crate::kernel::contact::along::place_and_slope;
use crate::system::{ContactRegime, ListedPair, PairPointKind};
use crate::tensor::Vec3;
use std::f64::consts::FRAC_PI_2;

/// The largest angle of elements side by side, in radians: 10 degrees.
const SIDE_BY_SIDE: f64 = 0.174_532_925_199_432_95;

/// The smallest angle of elements that cross, in radians: 20 degrees.
const CROSSING: f64 = 2.0 * SIDE_BY_SIDE;

/// The largest offset of neighbouring nodes across the other beam, over the sum of radii, at which
/// nodes carry all of the force. The gap between two nodes in contact is then less than theirs by
/// 3e-4 of that sum.
const SMALLEST_OFFSET: f64 = 0.05;

/// The offset from which on closest points carry all of the force.
const LARGEST_OFFSET: f64 = 0.15;

/// Offsets from which closest points begin to carry force in dynamic stages, and carry all of it: gaps between nodes
/// and of nodes differ by 1.1 % of the sum of radii there. Only the angle across the normal counts, since beams that come
/// down on each other at an angle touch at nodes.
const OFFSETS_OF_PENALTY: [f64; 2] = [0.1, 0.3];

/// Closest points that are nearer to each other than the first part of the sum of radii are one contact, those farther
/// than the second part are two.
const ONE_CONTACT: [f64; 2] = [0.25, 0.5];

/// The cosine of the angle between a kink and a point up to which the point is beside the kink,
/// neither inside nor outside.
const COSINE_BESIDE: f64 = 0.5;

impl BeamPairs {
    /// Unit tangents of centre lines at all nodes: where elements meet, the mean of both.
    pub(super) fn directions(&self, places: &[Vec3]) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; places.len()];
        for (number, strand) in self.strands.iter().enumerate() {
            let first = self.first_nodes[number];
            for element in 0..strand.elements() {
                let nodes = self.of_element(ElementOf { strand: number, element }, places);
                for i in 0..nodes.len() {
                    let [_, slope] = place_and_slope(nodes, i as f64 / strand.order as f64);
                    sums[first + element * strand.order + i] += slope.normalized().unwrap_or(Vec3::ZERO);
                }
            }
            if strand.is_closed() {
                let last = first + strand.nodes.len() - 1;
                let sum = sums[first] + sums[last];
                sums[first] = sum;
                sums[last] = sum;
            }
        }
        sums.iter().map(|sum| sum.normalized().unwrap_or(Vec3::ZERO)).collect()
    }
}

impl PairsNow<'_> {
    /// The candidates of a pair with the parts of the force that they carry. `reach`: the largest gap
    /// with a force.
    pub(super) fn sharing_candidates(&self, pair: &ListedPair, reach: f64) -> Vec<PairCandidate> {
        let kinds = self.kinds_of(pair);
        let share_by_angle = kinds.closest && kinds.nodes;
        let share_at_kinks = self.at.contacts.regime == ContactRegime::Penalty;
        let [a, b] = self.pairs.both(pair.meeting as usize);
        let farthest = reach + a.radius + b.radius;
        let mut candidates = self.candidates(pair, kinds);
        candidates.retain_mut(|candidate| {
            if share_by_angle {
                candidate.weight *= self.share_by_angle(pair, candidate);
            }
            // Points beyond have no force to share.
            if share_at_kinks && self.distance(pair, candidate.at) <= farthest {
                candidate.weight *= self.share_at_kinks(pair, candidate);
            }
            candidate.weight > 0.0
        });
        candidates
    }

    /// Where two kinks cross, up to four pairs of elements have closest points, and the nodes one more. Penalties of
    /// those that are near each other act as one: together they have no more than the force of one. Each counts
    /// by its depth below `reach`, the largest gap with a force, so that it comes without a jump.
    pub(super) fn share_among_near(&self, found: &mut [Found], reach: f64) {
        if self.at.contacts.regime == ContactRegime::Augmented {
            return;
        }
        let closest: Vec<NearPoint> =
            found.iter().enumerate().filter_map(|(k, it)| self.near_point(k, it, reach)).collect();
        if closest.len() < 2 {
            return;
        }
        for (point, sum) in closest.iter().zip(self.sums_near(&closest)) {
            let Found { number, candidate } = &mut found[point.number];
            // Nodes have the rest.
            let whole = self.share_by_angle(&self.list[*number], candidate);
            candidate.weight /= f64::max(sum / whole, 1.0);
        }
    }

    /// For each of the closest points of a meeting, its weight and those near it, which are in the order of the first
    /// beam.
    fn sums_near(&self, closest: &[NearPoint]) -> Vec<f64> {
        let [first, second] = self.pairs.both(closest[0].pair.meeting as usize);
        let radii = first.radius + second.radius;
        let mut sums: Vec<f64> = closest.iter().map(|point| point.weight).collect();
        let mut add = |i: usize, j: usize| {
            let [a, b] = [&closest[i], &closest[j]];
            let apart = (0..2).map(|side| (a.places[side] - b.places[side]).norm()).fold(0.0, f64::max);
            let near = 1.0 - smooth_part(apart, ONE_CONTACT.map(|part| part * radii));
            sums[i] += near * b.weight * (b.depth / a.depth).min(1.0);
            sums[j] += near * a.weight * (a.depth / b.depth).min(1.0);
        };
        let on_element = |element: usize| (0..closest.len()).filter(move |&k| closest[k].element() == element);
        for (i, own) in closest.iter().enumerate() {
            let length = first.element_length(own.element());
            let last = own.element() + 1 + (ONE_CONTACT[1] * radii / length) as usize;
            (i + 1..closest.len()).take_while(|&j| closest[j].element() <= last).for_each(|j| add(i, j));
        }
        // A ring goes on at its start.
        let end = first.elements() - 1;
        if first.is_closed() && end > 1 {
            on_element(0).for_each(|i| on_element(end).for_each(|j| add(i, j)));
        }
        sums
    }

    /// A closest point with a force, by its number among those found; `None` for others.
    fn near_point(&self, number: usize, found: &Found, reach: f64) -> Option<NearPoint> {
        let Found { number: of_pair, candidate } = found;
        if candidate.kind != PairPointKind::Closest {
            return None;
        }
        let pair = self.list[*of_pair];
        let elements = self.pairs.elements_of(&pair);
        let places = [0, 1].map(|side| self.place_and_slope(elements[side], candidate.at[side])[0]);
        let [first, second] = self.pairs.both(pair.meeting as usize);
        let depth = reach + first.radius + second.radius - (places[0] - places[1]).norm();
        (depth > 0.0).then_some(NearPoint { number, pair, places, depth, weight: candidate.weight })
    }

    /// The kinds of points that a pair may have, by the angles between its elements.
    fn kinds_of(&self, pair: &ListedPair) -> Kinds {
        let directions = self.pairs.elements_of(pair).map(|of| self.pairs.of_element(of, &self.directions));
        let middles = directions.map(|nodes| nodes.iter().fold(Vec3::ZERO, |sum, node| sum + *node));
        if let Some(kinds) = self.plain_kinds(pair, directions, middles) {
            return kinds;
        }
        let spread = |side: usize| directions[side].iter().map(|node| angle(*node, middles[side])).fold(0.0, f64::max);
        let spreads = spread(0) + spread(1);
        let middle = angle_of_lines(middles[0], middles[1]);
        let least_sine = match self.at.contacts.regime {
            ContactRegime::Augmented => sine(middle - spreads),
            // That across the normal is not known here.
            ContactRegime::Penalty => 0.0,
        };
        Kinds {
            closest: self.part_of_closest(pair, middle + spreads, sine(middle + spreads)) > 0.0,
            nodes: self.part_of_closest(pair, middle - spreads, least_sine) < 1.0,
        }
    }

    /// The kinds of points of a pair of which bounds of the angles tell that it is side by side, or crosses.
    fn plain_kinds(&self, pair: &ListedPair, directions: [&[Vec3]; 2], middles: [Vec3; 2]) -> Option<Kinds> {
        let tangent = |a: Vec3, b: Vec3, cosine: f64| a.cross(b).norm() / cosine;
        // An angle is not larger than its tangent.
        let spread = |side: usize| {
            let of_node = |node: &Vec3| tangent(*node, middles[side], node.dot(middles[side]));
            directions[side].iter().map(of_node).try_fold(0.0, |most, t| (t >= 0.0).then_some(f64::max(most, t)))
        };
        let spreads = spread(0)? + spread(1)?;
        let middle = tangent(middles[0], middles[1], middles[0].dot(middles[1]).abs());
        if self.part_of_closest(pair, middle + spreads, middle + spreads) == 0.0 {
            return Some(Kinds { closest: false, nodes: true });
        }
        // An angle with the tangent t is at least 3 t/(1 + 2 sqrt(1 + t^2)) (Shafer 1966).
        let least = 3.0 * middle / (1.0 + 2.0 * (1.0 + middle * middle).sqrt());
        (least - spreads >= CROSSING).then_some(Kinds { closest: true, nodes: false })
    }

    /// The part of the force of a candidate of its kind. Penalties share the force of the same gap.
    /// Multipliers close the gap of each point whatever its weight, which only makes its stiffness
    /// smaller: a point of small weight would take many augmentations.
    fn share_by_angle(&self, pair: &ListedPair, candidate: &PairCandidate) -> f64 {
        let elements = self.pairs.elements_of(pair);
        let [a, b] = [0, 1].map(|side| self.direction(elements[side], candidate.at[side]));
        let angle = angle_of_lines(a, b);
        let sine = match self.at.contacts.regime {
            ContactRegime::Augmented => sine(angle),
            ContactRegime::Penalty => self.sine_across(elements, candidate, [a, b]),
        };
        let closest = self.part_of_closest(pair, angle, sine);
        let part = match candidate.kind {
            PairPointKind::Closest => closest,
            PairPointKind::NodeOfFirst | PairPointKind::NodeOfSecond => 1.0 - closest,
        };
        match self.at.contacts.regime {
            ContactRegime::Penalty => part,
            ContactRegime::Augmented => f64::from(part > 0.0),
        }
    }

    /// The sine of the angle between both beams across the normal of a candidate in the last accepted state: within a
    /// step only the place of the candidate changes it. `directions`: of both beams there.
    fn sine_across(&self, elements: [ElementOf; 2], candidate: &PairCandidate, directions: [Vec3; 2]) -> f64 {
        let [a, b] = directions.map(|direction| direction.normalized().unwrap_or(Vec3::ZERO));
        let both = a.cross(b);
        let [on_a, on_b] = [0, 1]
            .map(|side| place_and_slope(self.pairs.of_element(elements[side], &self.accepted), candidate.at[side])[0]);
        let apart = on_a - on_b;
        // The foot of a node is the point of the other beam that is nearest to it.
        let across = |along: Vec3| apart - along * apart.dot(along);
        let normal = match candidate.free {
            [true, true] => both,
            [true, false] => across(a),
            [false, true] => across(b),
            [false, false] => apart,
        };
        normal.normalized().map_or(0.0, |normal| both.dot(normal).abs())
    }

    /// The part of the force that closest points carry at an angle between both beams: all of it
    /// where they cross, none where they are side by side. Also by how far the angle takes
    /// neighbouring nodes across the other beam, by its `sine`.
    fn part_of_closest(&self, pair: &ListedPair, angle: f64, sine: f64) -> f64 {
        let by_angle = smooth_part(angle, [SIDE_BY_SIDE, CROSSING]);
        let strands = self.pairs.both(pair.meeting as usize);
        // Of undeformed elements: what acts does not change with their stretch in an iteration.
        let between_nodes =
            [0, 1].map(|side| strands[side].element_length(pair.elements[side] as usize) / strands[side].order as f64);
        let offset = between_nodes[0].min(between_nodes[1]) * sine / (strands[0].radius + strands[1].radius);
        // The closest points of curved elements side by side may part into two.
        let is_straight = strands.iter().all(|strand| strand.order == 1);
        match self.at.contacts.regime {
            ContactRegime::Augmented if is_straight => {
                by_angle.max(smooth_part(offset, [SMALLEST_OFFSET, LARGEST_OFFSET]))
            }
            ContactRegime::Augmented => by_angle,
            ContactRegime::Penalty => by_angle.max(smooth_part(offset, OFFSETS_OF_PENALTY)),
        }
    }

    /// The direction of the centre line at a place of an element, linear between its nodes.
    fn direction(&self, of: ElementOf, s: f64) -> Vec3 {
        let nodes = self.pairs.of_element(of, &self.directions);
        let at = s * (nodes.len() - 1) as f64;
        let before = (at as usize).min(nodes.len() - 2);
        let part = at - before as f64;
        nodes[before] * (1.0 - part) + nodes[before + 1] * part
    }

    /// The inside of a kink has closest points on both sides of it, of which one begins and ends at
    /// the kink while the other one has a force. Penalties share it by their ways to the kink.
    fn share_at_kinks(&self, pair: &ListedPair, candidate: &PairCandidate) -> f64 {
        let elements = self.pairs.elements_of(pair);
        let of_side = |side: usize| {
            let other = 1 - side;
            let seen_from = |kink: Vec3| match candidate.kind {
                PairPointKind::Closest => self.nearest(kink, elements[other], candidate.at[other]),
                PairPointKind::NodeOfFirst | PairPointKind::NodeOfSecond => {
                    self.place_and_slope(elements[other], candidate.at[other])[0]
                }
            };
            let share_at = |end: f64| self.share_at_kink(elements[side], end, &seen_from);
            share_at(0.0) * share_at(1.0)
        };
        match candidate.kind {
            PairPointKind::Closest => of_side(0) * of_side(1),
            PairPointKind::NodeOfFirst => of_side(1),
            PairPointKind::NodeOfSecond => of_side(0),
        }
    }

    /// The part of a force that an element carries beside the kink at one of its ends, 0 or 1. Seen
    /// from the point of the other beam that belongs to the kink, the feet on both sides of it have the
    /// ways d_1 and d_2 to the kink: d_1/(d_1 + d_2), and all where one of them does not exist.
    fn share_at_kink(&self, of: ElementOf, end: f64, seen_from: &dyn Fn(Vec3) -> Vec3) -> f64 {
        let Some(next) = self.neighbour(of, end) else { return 1.0 };
        let kink = self.kink(of, end, next);
        let from_kink = seen_from(kink.place) - kink.place;
        let ways = [-kink.own.dot(from_kink), kink.beyond.dot(from_kink)];
        // The search finds no foot so near to the kink, but one at it.
        if ways[1] <= AT_NODE * kink.length_beyond {
            return 1.0;
        }
        (ways[0] / (ways[0] + ways[1])).clamp(0.0, 1.0)
    }

    /// The place of a beam nearest to a point, looked for from a place on one of its elements. It goes on
    /// to the next element where a kink has its outside towards the point. At the inside of a kink the
    /// element goes on straight, since the place beyond belongs to another contact. In between, both.
    fn nearest(&self, point: Vec3, of: ElementOf, from: f64) -> Vec3 {
        let [place, slope] = self.place_and_slope(of, from);
        let to = from + slope.dot(point - place) / slope.squared();
        let end = to.clamp(0.0, 1.0);
        let next = if to == end { None } else { self.neighbour(of, end) };
        let Some(next) = next else { return self.place_and_slope(of, end)[0] };
        let kink = self.kink(of, end, next);
        let from_kink = point - kink.place;
        let [towards, turn] = [from_kink, kink.turn()].map(|vector| vector.normalized().unwrap_or(Vec3::ZERO));
        let inside = smooth_part(towards.dot(turn), [-COSINE_BESIDE, COSINE_BESIDE]);
        let straight = kink.slope * (to - end).abs();
        let walked = kink.beyond * kink.beyond.dot(from_kink).max(0.0).min(kink.length_beyond);
        kink.place + straight * inside + walked * (1.0 - inside)
    }

    /// The kink between an element, at its end 0 or 1, and the one beyond.
    fn kink(&self, of: ElementOf, end: f64, next: ElementOf) -> Kink {
        let [place, slope] = self.place_and_slope(of, end);
        let [_, slope_beyond] = self.place_and_slope(next, 1.0 - end);
        let outward = if end == 1.0 { 1.0 } else { -1.0 };
        let unit = |slope: Vec3| slope.normalized().unwrap_or(Vec3::ZERO) * outward;
        Kink {
            place,
            slope: slope * outward,
            own: unit(slope),
            beyond: unit(slope_beyond),
            length_beyond: slope_beyond.norm(),
        }
    }

    /// The element beyond an end of an element, 0 or 1.
    fn neighbour(&self, of: ElementOf, end: f64) -> Option<ElementOf> {
        let element = self.pairs.strands[of.strand].neighbour(of.element, end)?;
        Some(ElementOf { element, ..of })
    }

    pub(super) fn place_and_slope(&self, of: ElementOf, s: f64) -> [Vec3; 2] {
        place_and_slope(self.pairs.of_element(of, &self.places), s)
    }
}

/// A closest point with a force.
struct NearPoint {
    /// Its number among the candidates
    number: usize,
    pair: ListedPair,
    /// Its places on both centre lines
    places: [Vec3; 2],
    /// How far it is below the largest gap with a force
    depth: f64,
    weight: f64,
}

impl NearPoint {
    /// Its element of the first beam.
    fn element(&self) -> usize {
        self.pair.elements[0] as usize
    }
}

/// Where two elements of a beam meet.
struct Kink {
    place: Vec3,
    /// Derivative of the place on the first element, away from it
    slope: Vec3,
    /// Unit tangent of the first element, away from it
    own: Vec3,
    /// Unit tangent of the next element, into it
    beyond: Vec3,
    /// The length of the next element as it begins
    length_beyond: f64,
}

impl Kink {
    /// Towards the inside of the kink.
    fn turn(&self) -> Vec3 {
        self.beyond - self.own
    }
}

/// The sine of an angle, up to a right one.
fn sine(angle: f64) -> f64 {
    libm::sin(angle.clamp(0.0, FRAC_PI_2))
}

/// The angle between two vectors.
fn angle(a: Vec3, b: Vec3) -> f64 {
    libm::atan2(a.cross(b).norm(), a.dot(b))
}

/// The angle between two lines, up to a right angle.
fn angle_of_lines(a: Vec3, b: Vec3) -> f64 {
    libm::atan2(a.cross(b).norm(), a.dot(b).abs())
}

/// 0 below the first bound, 1 above the second one, between them a smooth step.
fn smooth_part(value: f64, [low, high]: [f64; 2]) -> f64 {
    let part = ((value - low) / (high - low)).clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}
