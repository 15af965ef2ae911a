//! A beam or a body against one surface: its nodes, and its candidates for contact.
//!
//! The candidates of a state are the closest points between the ends of elements
//! ([`crate::kernel::contact::along`]), and all nodes that are not beside one. At boxes, meshes and the
//! rims of open tubes the closest points to edges are candidates as well
//! ([`crate::kernel::contact::edge`]). Elements from which the surface is farther than they reach have
//! none: the distance changes by no more than a point moves.
//!
//! In dynamic stages closest points and the nodes beside them share the force, so that it does not
//! jump where a closest point passes from one element to the next.

use super::predecessors::{LARGEST_SHIFT, Link, Predecessors, Relation};
use super::strand::{ChainNode, Strand};
use super::surface::SceneSurface;
use crate::kernel::MAX_NODES;
use crate::kernel::contact::along::{minima_on, place_and_slope, place_on};
use crate::kernel::contact::{
    Carrier, Distance, Minima, Minimum, MinimumKind, Place, ShapeAt, Side, Surface, Undefined,
};
use crate::system::{ChainMemory, Clearance, ContactRegime, PointMemory, State};
use crate::tensor::Vec3;
use std::ops::Deref;

/// The farthest point of an element with equally spaced nodes from any centre, over the farthest
/// node: the Lebesgue constants of one to four nodes.
pub(super) const REACH: [f64; MAX_NODES + 1] = [1.0, 1.0, 1.0, 1.25, 1.64];

/// Gaps below this part of the radius are looked at.
const MARGIN: f64 = 1e-5;

/// Places along a chain, counted in nodes, differ by less than this where they are equal.
const ROUNDED_PLACE: f64 = 1e-9;

/// Beams without end caps touch with the rim of their end: the surface is nearest beside the end,
/// not beyond it, if the cosine between its direction and the beam is below this.
pub(super) const CAP_COSINE: f64 = 0.5;

/// The shortest step on a way that is looked at, over the radius of what goes it.
pub(super) const SHORTEST_LOOK: f64 = 0.1;

/// A beam or a body against one surface.
#[derive(Clone, Debug)]
pub struct Chain {
    /// Number of the surface
    pub surface: usize,
    /// The beam or the body
    pub strand: Strand,
}

impl Deref for Chain {
    type Target = Strand;

    fn deref(&self) -> &Strand {
        &self.strand
    }
}

/// An element whose centre line is inside of a box or a mesh between nodes that are outside. No edge pushes it out, since
/// that needs a centre line outside of its faces.
pub(super) struct Crossing {
    /// Number of the element in the chain
    pub(super) element: usize,
    /// The penetration, a length
    pub(super) depth: f64,
}

/// A point that may touch the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Number of the element in the chain
    pub(super) element: usize,
    /// Place on the element, from 0 to 1
    pub(super) s: f64,
    /// At a node, or at the closest point
    pub(super) place: Place,
    /// The number of the edge of a box or a mesh, or of the rim of a tube, that it may touch; otherwise
    /// it may touch the whole surface
    pub(super) edge: Option<u32>,
    /// The part of the force that it carries
    pub(super) weight: f64,
}

impl Candidate {
    /// The distance of a point at its place from what it may touch; `None` where that has no normal.
    pub fn distance(&self, surface: &Surface, y: Vec3) -> Option<Distance> {
        match self.edge {
            Some(number) => surface.edge(number)?.distance(y).ok(),
            None => surface.distance(y).ok(),
        }
    }

    /// Its place in the chain, counted in elements.
    pub fn along(&self) -> f64 {
        self.element as f64 + self.s
    }
}

/// The nodes of a chain as a surface sees them.
struct SeenChain<'a> {
    chain: &'a Chain,
    surface: &'a Surface,
    /// Places of the nodes in the coordinates of the surface
    places: Vec<Vec3>,
    /// A ball without contact: its centre and its radius
    free: (Vec3, f64),
    /// Points of the chain with a force at the last look
    points: &'a [PointMemory],
    /// Whether candidates share forces: those of penalties do
    regime: ContactRegime,
}

impl Chain {
    /// The number of the node that a candidate is at; `None` between nodes.
    pub(super) fn node_at(&self, at: &Candidate) -> Option<usize> {
        let in_nodes = at.s * self.order as f64;
        let is_node = at.place == Place::Fixed && in_nodes.fract() == 0.0;
        is_node.then_some(at.element * self.order + in_nodes as usize)
    }

    /// Elements that have points between nodes: a body alone has none.
    fn spans(&self) -> usize {
        if self.order == 0 { 0 } else { self.elements() }
    }

    /// The number of its instances: elements, and single nodes, at which most points are.
    pub(super) fn instances(&self) -> usize {
        self.spans() + self.nodes.len()
    }

    /// The nodes of each instance, elements first.
    pub(super) fn nodes_of_instances(&self) -> impl Iterator<Item = &[ChainNode]> {
        (0..self.spans()).map(|k| self.nodes_of(k)).chain(self.nodes.chunks(1))
    }

    /// The instance that the force of a candidate acts on.
    pub(super) fn instance_of(&self, at: &Candidate) -> usize {
        self.node_at(at).map_or(at.element, |node| self.spans() + node)
    }

    /// The part of the length of the beam before a candidate.
    pub(super) fn fraction(&self, at: &Candidate) -> f64 {
        let nodes = self.nodes_of(at.element);
        let [from, to] = [nodes[0].fraction, nodes[nodes.len() - 1].fraction];
        from + (to - from) * at.s
    }

    /// The least gap of nodes and closest points, without ends that do not touch; infinite where nothing is there to
    /// touch.
    pub(super) fn least_gap(&self, surface: &Surface, carrier: &Carrier, at: &State) -> f64 {
        let places = self.seen(carrier, at);
        let gap = |place: Vec3| surface.value(place, self.radius).map_or(f64::INFINITY, |value| value - self.radius);
        let regime = ContactRegime::Augmented;
        let seen = SeenChain { chain: self, surface, places, free: (Vec3::ZERO, -1.0), points: &[], regime };
        let nodes = (0..seen.places.len()).filter(|&node| seen.touches(node)).map(|node| gap(seen.places[node]));
        let nodes = nodes.fold(f64::INFINITY, f64::min);
        let of_edges = |k: usize| {
            let gap = |candidate: Candidate| {
                let place = seen.place(k, candidate.s);
                let edge = candidate.edge.and_then(|number| surface.edge(number));
                edge.map_or(f64::INFINITY, |edge| edge.value(place) - self.radius).min(gap(place))
            };
            let at_edges = if self.order == 0 { Vec::from_iter(seen.rim_of_body()) } else { seen.closest_to_edges(k) };
            at_edges.into_iter().map(gap).fold(f64::INFINITY, f64::min)
        };
        let of_surface = |k: usize| {
            let minima = seen.minima(k);
            minima.found().iter().map(|minimum| gap(seen.place(k, minimum.s))).fold(f64::INFINITY, f64::min)
        };
        (0..self.elements()).map(|k| of_surface(k).min(of_edges(k))).fold(nodes, f64::min)
    }

    /// The first node at which the surface has no normal, and its penetration, if that is more than
    /// `allowed`: such a node cannot find its way out.
    pub(super) fn lost_node(
        &self,
        surface: &Surface,
        carrier: &Carrier,
        at: &State,
        allowed: f64,
    ) -> Option<(usize, f64)> {
        let depth = |place: Vec3| {
            let has_normal = surface.distance(place).is_ok();
            let gap = surface.value(place, self.radius).filter(|_| !has_normal)? - self.radius;
            (-gap > allowed).then_some(-gap)
        };
        self.seen(carrier, at).into_iter().enumerate().find_map(|(node, place)| Some((node, depth(place)?)))
    }

    /// The elements that cross a box or a mesh.
    pub(super) fn crossings(&self, surface: &Surface, carrier: &Carrier, at: &State) -> Vec<Crossing> {
        if self.order == 0 || !surface.is_faceted() {
            return Vec::new();
        }
        let places = self.seen(carrier, at);
        let regime = at.contacts.regime;
        let mut seen = SeenChain { chain: self, surface, places, free: (Vec3::ZERO, -1.0), points: &[], regime };
        let crossing = |element: usize| {
            let height = if seen.is_free(element) { None } else { seen.least_height_between_nodes(element) };
            height.map(|height| Crossing { element, depth: self.radius - height })
        };
        (0..self.elements()).filter_map(crossing).collect()
    }

    /// Places of the nodes in the coordinates of a surface.
    pub(super) fn seen(&self, carrier: &Carrier, at: &State) -> Vec<Vec3> {
        let place = |node: &ChainNode| node.place + at.q[node.node.u as usize];
        self.nodes.iter().map(|node| carrier.on_surface(place(node))).collect()
    }

    /// The candidates of a state, in the order of the chain.
    pub(super) fn candidates(
        &self,
        surface: &Surface,
        carrier: &Carrier,
        memory: Option<&ChainMemory>,
        at: &State,
    ) -> Vec<Candidate> {
        let places = self.seen(carrier, at);
        let points = memory.map_or(&[][..], |memory| &memory.points);
        let regime = at.contacts.regime;
        SeenChain { chain: self, surface, places, free: (Vec3::ZERO, -1.0), points, regime }.candidates()
    }

    /// The place of the middle node (global components).
    pub(super) fn middle(&self, at: &State) -> Vec3 {
        let node = &self.nodes[self.nodes.len() / 2];
        node.place + at.q[node.node.u as usize]
    }

    /// The ball around the middle node that holds the chain; `None` if it meets the surface. Without it
    /// no point of the chain has a force.
    pub(super) fn clearance(&self, surface: &SceneSurface, at: &State) -> Option<Clearance> {
        let place = |node: &ChainNode| node.place + at.q[node.node.u as usize];
        let centre = self.middle(at);
        let middle = surface.on_surface(centre, at);
        let gap = surface.surface.distance(middle).ok()?.value - self.radius * (1.0 + MARGIN);
        let factor = REACH[self.order + 1];
        let limit = (gap / factor).powi(2);
        let mut farthest = 0.0f64;
        for node in &self.nodes {
            let squared = (place(node) - centre).squared();
            let is_inside = squared < limit;
            if !is_inside {
                return None;
            }
            farthest = farthest.max(squared);
        }
        (gap > 0.0).then_some(Clearance { middle, reach: factor * farthest.sqrt(), gap })
    }

    /// The points in memory that each candidate was.
    pub(super) fn predecessors(&self, candidates: &[Candidate], memory: Option<&ChainMemory>) -> Vec<Predecessors> {
        let points = memory.map_or(&[][..], |memory| &memory.points);
        let mut links = Vec::new();
        let mut first = 0;
        // A ring goes on at its start.
        let goes_round = self.is_closed();
        let point_is_node: Vec<bool> = points.iter().map(|point| self.is_node(point.place)).collect();
        for (number, candidate) in candidates.iter().enumerate() {
            let along = candidate.along();
            while !goes_round && first < points.len() && points[first].place < along - LARGEST_SHIFT {
                first += 1;
            }
            let is_node = self.is_node(along);
            let may_be_near = |point: &&PointMemory| goes_round || point.place <= along + LARGEST_SHIFT;
            for (own, point) in (first..).zip(points[first..].iter().take_while(may_be_near)) {
                let shift = self.shift(point.place, along);
                if shift <= LARGEST_SHIFT {
                    let are_alike = match (point_is_node[own], is_node) {
                        (true, true) => shift < ROUNDED_PLACE,
                        (before, now) => before == now,
                    };
                    let relation = relation(point, candidate, are_alike);
                    links.push(Link { candidate: number, point: own, relation, shift });
                }
            }
        }
        Predecessors::of(links, candidates.len(), points.len())
    }

    /// True for a place along the chain, in elements, at a node.
    fn is_node(&self, along: f64) -> bool {
        let in_nodes = along * self.order as f64;
        (in_nodes - in_nodes.round()).abs() < ROUNDED_PLACE
    }
}

/// The relation of a point in memory and a candidate, by what they touch. `are_alike`: both at the same node, or both
/// between nodes.
fn relation(before: &PointMemory, now: &Candidate, are_alike: bool) -> Relation {
    match (before.edge, now.edge) {
        (before, now) if before == now && are_alike => Relation::Same,
        (Some(_), Some(_)) => Relation::OtherEdge,
        (None, _) | (_, None) => Relation::OtherFeature,
    }
}

impl SeenChain<'_> {
    fn candidates(&mut self) -> Vec<Candidate> {
        let count = self.chain.elements();
        let mut is_near = self.remembered();
        let mut candidates = Vec::new();
        for k in 0..count {
            is_near[k] = is_near[k] || !self.is_free(k);
            if is_near[k] {
                self.add_minima(k, &mut candidates);
            }
        }
        self.add_nodes(&is_near, &mut candidates);
        candidates.retain(|candidate| candidate.weight > 0.0);
        candidates.sort_by(|a, b| a.along().total_cmp(&b.along()));
        candidates
    }

    /// True for elements beside points that had a force.
    fn remembered(&self) -> Vec<bool> {
        let count = self.chain.elements();
        let mut is_beside = vec![false; count];
        let is_closed = self.chain.is_closed();
        let last = count as isize - 1;
        for point in self.points {
            let [from, to] = [-LARGEST_SHIFT, LARGEST_SHIFT].map(|shift| (point.place + shift).floor() as isize);
            if is_closed {
                (from..=to).for_each(|k| is_beside[k.rem_euclid(count as isize) as usize] = true);
            } else {
                is_beside[from.clamp(0, last) as usize..=to.clamp(0, last) as usize].fill(true);
            }
        }
        is_beside
    }

    fn places_of(&self, k: usize) -> &[Vec3] {
        let order = self.chain.order;
        &self.places[k * order..=(k + 1) * order]
    }

    /// True if no point of element `k` touches the surface.
    fn is_free(&mut self, k: usize) -> bool {
        let places = self.places_of(k);
        let factor = REACH[places.len()];
        let farthest = |centre: Vec3| places.iter().map(|place| (*place - centre).norm()).fold(0.0, f64::max);
        let (centre, radius) = self.free;
        if radius > 0.0 && factor * farthest(centre) < radius {
            return true;
        }
        let middle = places.iter().fold(Vec3::ZERO, |sum, place| sum + *place) * (1.0 / places.len() as f64);
        let Ok(distance) = self.surface.distance(middle) else { return false };
        // Nearer ones may touch but for round-off.
        let gap = distance.value - self.chain.radius * (1.0 + MARGIN);
        let is_free = factor * farthest(middle) < gap;
        self.free = (middle, gap);
        is_free
    }

    /// The least distance of the centre line of element `k` from the surface, where it is inside of it between nodes that
    /// are outside. Steps along it are as long as the distance, which cannot become zero in a shorter one.
    fn least_height_between_nodes(&self, k: usize) -> Option<f64> {
        let places = self.places_of(k);
        let height = |place: Vec3| self.surface.value(place, self.chain.radius).unwrap_or(f64::INFINITY);
        if places.iter().any(|place| height(*place) < 0.0) {
            return None;
        }
        // Markov's inequality bounds the slope of a polynomial by its size.
        let middle = self.place(k, 0.5);
        let farthest = places.iter().map(|place| (*place - middle).norm()).fold(0.0, f64::max);
        let slope = 2.0 * (self.chain.order * self.chain.order) as f64 * REACH[places.len()] * farthest;
        let (mut least, mut s) = (0.0f64, 0.0);
        while s < 1.0 {
            let here = height(self.place(k, s));
            least = least.min(here);
            s += here.max(SHORTEST_LOOK * self.chain.radius) / slope;
        }
        (least < 0.0).then_some(least)
    }

    /// The closest points of element `k` to the whole surface.
    fn minima(&self, k: usize) -> Minima {
        let nodes = self.places_of(k);
        minima_on(nodes, self.surface.intervals(nodes), &|y| self.surface.distance(y).ok())
    }

    /// The place of a point of element `k`.
    fn place(&self, k: usize, s: f64) -> Vec3 {
        place_on(self.places_of(k), s)
    }

    /// The derivative of the place on element `k` over s.
    fn tangent(&self, k: usize, s: f64) -> Vec3 {
        let [_, slope] = place_and_slope(self.places_of(k), s);
        slope
    }

    /// The part of a force that the closest point of element `k` carries. At the inside of a kink, the
    /// elements on both sides have closest points, of which one comes or goes at the kink, where the other
    /// one has a force. In a dynamic stage its part fades towards the kink.
    fn weight(&self, k: usize, distance: &dyn Fn(Vec3) -> Option<Distance>) -> f64 {
        match self.regime {
            ContactRegime::Augmented => 1.0,
            ContactRegime::Penalty => self.weight_at(k, 0.0, distance).min(self.weight_at(k, 1.0, distance)),
        }
    }

    /// The part of a force that the kink at an end of element `k`, 0 or 1, leaves to it. With the rises a and
    /// b of the distance per length towards the kink, on this element and on the one beyond: a/(a + b), and 1 where
    /// the distance falls.
    fn weight_at(&self, k: usize, end: f64, distance: &dyn Fn(Vec3) -> Option<Distance>) -> f64 {
        let rise = |element: usize, end: f64| {
            let outward = self.tangent(element, end).normalized()? * (2.0 * end - 1.0);
            Some(distance(self.place(element, end))?.normal.dot(outward))
        };
        let rises = self.chain.neighbour(k, end).and_then(|beyond| Some([rise(k, end)?, rise(beyond, 1.0 - end)?]));
        match rises {
            Some([own, beyond]) if own >= 0.0 && beyond > 0.0 => own / (own + beyond),
            Some(_) | None => 1.0,
        }
    }

    /// Adds the closest points between the ends of element `k`. The edge of a body that has come inside the
    /// section pushes it out, too, from the place where it is.
    fn add_minima(&self, k: usize, candidates: &mut Vec<Candidate>) {
        if self.chain.order == 0 {
            candidates.extend(self.rim_of_body());
            return;
        }
        if self.surface.is_flat() {
            return;
        }
        let distance = |y: Vec3| self.surface.distance(y).ok();
        for &Minimum { s, kind } in self.minima(k).found() {
            let place = match kind {
                MinimumKind::Sharp => Place::Closest,
                MinimumKind::Kink if self.surface.side == Side::Outside => Place::Fixed,
                MinimumKind::Kink | MinimumKind::Conforming => continue,
            };
            // Those at edges and corners are found by the distance from the edge.
            if place == Place::Closest && self.surface.is_faceted() {
                continue;
            }
            let weight = match place {
                Place::Closest => self.weight(k, &distance),
                Place::Fixed => 1.0,
            };
            candidates.push(Candidate { element: k, s, place, edge: None, weight });
        }
        candidates.extend(self.closest_to_edges(k));
    }

    /// Numbers of the edges that element `k` may touch: those that are near, and those that it touched
    /// before.
    fn edges_of(&self, k: usize) -> Vec<u32> {
        if !self.surface.has_edges() {
            return Vec::new();
        }
        let places = self.places_of(k);
        let [first, last] = [places[0], places[places.len() - 1]];
        let part = |i: usize| i as f64 / (places.len() - 1).max(1) as f64;
        let off_chord = |i: usize| (places[i] - first - (last - first) * part(i)).norm();
        let sag = REACH[places.len()] * (0..places.len()).map(off_chord).fold(0.0, f64::max);
        let mut edges = self.surface.edges_near([first, last], sag + self.chain.radius * (1.0 + MARGIN));
        let middle = k as f64 + 0.5;
        let is_near = |point: &&PointMemory| self.chain.shift(point.place, middle) <= 0.5 + LARGEST_SHIFT;
        edges.extend(self.points.iter().filter(is_near).filter_map(|point| point.edge));
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// The node of a body at the rims of a tube, beyond its ends. Elsewhere, and at edges and corners of other
    /// surfaces, it touches by its distance from the whole surface.
    fn rim_of_body(&self) -> Option<Candidate> {
        if self.surface.is_faceted() {
            return None;
        }
        let place = self.places[0];
        let Err(Undefined::BeyondEnd) = self.surface.distance(place) else { return None };
        let beside = self.edges_of(0).into_iter().filter_map(|number| {
            let edge = self.surface.edge(number).filter(|edge| edge.is_beside(place))?;
            Some((edge.distance(place).ok()?.value, number))
        });
        let (_, nearest) = beside.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Candidate { element: 0, s: 0.0, place: Place::Fixed, edge: Some(nearest), weight: 1.0 })
    }

    /// The points of element `k` that are closest to an edge, with its first node, and its last one at
    /// the end of the chain. Nodes keep their own contact, since they may touch a face.
    fn closest_to_edges(&self, k: usize) -> Vec<Candidate> {
        let mut found = Vec::new();
        for number in self.edges_of(k) {
            let Some(edge) = self.surface.edge(number) else { continue };
            let is_beside = |s: f64| {
                let place = self.place(k, s);
                edge.is_beside(place) && self.surface.owns_corner(number, place)
            };
            let at = |s: f64, place: Place, weight: f64| Candidate { element: k, s, place, edge: Some(number), weight };
            let distance = |y: Vec3| edge.distance(y).ok();
            let nodes = self.places_of(k);
            let minima = minima_on(nodes, edge.intervals(self.surface, nodes), &distance);
            let smooth = minima.found().iter().filter(|minimum| minimum.kind != MinimumKind::Kink);
            let beside = smooth.filter(|minimum| is_beside(minimum.s));
            found.extend(beside.map(|minimum| at(minimum.s, Place::Closest, self.weight(k, &distance))));
            let falls = |k: usize, s: f64| {
                distance(self.place(k, s)).is_some_and(|distance| distance.normal.dot(self.tangent(k, s)) < 0.0)
            };
            if self.chain.neighbour(k, 0.0).is_none_or(|before| falls(before, 1.0)) && !falls(k, 0.0) && is_beside(0.0)
            {
                found.push(at(0.0, Place::Fixed, 1.0));
            }
            if self.chain.neighbour(k, 1.0).is_none() && falls(k, 1.0) && is_beside(1.0) {
                found.push(at(1.0, Place::Fixed, 1.0));
            }
        }
        found
    }

    /// Adds the nodes of near elements with the part of the force that closest points beside them leave.
    fn add_nodes(&self, is_near: &[bool], candidates: &mut Vec<Candidate>) {
        let order = self.chain.order;
        let last = self.places.len() - 1;
        let mut left = vec![1.0; last + 1];
        let of_surface = |candidate: &&Candidate| candidate.place == Place::Closest && candidate.edge.is_none();
        for closest in candidates.iter().filter(of_surface) {
            for i in 0..=order {
                left[closest.element * order + i] *= self.left_by(closest, i as f64 / order as f64);
            }
        }
        let is_closed = self.chain.is_closed();
        if is_closed {
            left[0] *= left[last];
        }
        for k in 0..=last {
            // A body alone has no elements, and counts as one.
            let from = k.saturating_sub(1).checked_div(order).unwrap_or(0);
            let to = k.checked_div(order).map_or(0, |element| element.min(is_near.len() - 1));
            let across = (is_closed && k == 0).then_some(is_near.len() - 1);
            let is_candidate = (from..=to).chain(across).any(|element| is_near[element]);
            // The last node of a ring is the first one.
            if !is_candidate || (is_closed && k == last) {
                continue;
            }
            if !self.touches(k) {
                continue;
            }
            let s = if order == 0 { 0.0 } else { (k - to * order) as f64 / order as f64 };
            candidates.push(Candidate { element: to, s, place: Place::Fixed, edge: None, weight: left[k] });
        }
    }

    /// The part of a force that a closest point leaves to a node of its element at `s`: in a dynamic stage the
    /// more, the farther they are apart.
    fn left_by(&self, closest: &Candidate, s: f64) -> f64 {
        match self.regime {
            ContactRegime::Augmented => 0.0,
            ContactRegime::Penalty => 1.0 - closest.weight * (1.0 - (closest.s - s).abs()),
        }
    }

    /// False for an end without a cap that faces the surface: its face does not touch.
    fn touches(&self, k: usize) -> bool {
        self.chain.order == 0 || self.chain.has_caps || !self.is_cap(k)
    }

    /// True if node `k` is an end of the chain that faces the surface.
    fn is_cap(&self, k: usize) -> bool {
        let last = self.places.len() - 1;
        if self.chain.is_closed() {
            return false;
        }
        let outward = if k == 0 {
            self.places[0] - self.places[1]
        } else if k == last {
            self.places[last] - self.places[last - 1]
        } else {
            return false;
        };
        let (Some(outward), Ok(distance)) = (outward.normalized(), self.surface.distance(self.places[k])) else {
            return false;
        };
        -distance.normal.dot(outward) > CAP_COSINE
    }
}

/// Shape functions of N nodes at a candidate: at a node exactly those of the node.
pub(super) fn shape<const N: usize>(at: &Candidate) -> ShapeAt<N> {
    ShapeAt::new(at.s)
}
