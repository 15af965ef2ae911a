//! Points of a pair of elements that may touch.
//!
//! Elements that cross touch at their closest points: between the ends of both, or at a node where
//! the distance to the other element grows to both sides along its beam. Elements side by side touch
//! at the nodes of both, each with its closest point on the other beam, and half of the force each.

use crate::effect::contact::chain::CAP_COSINE;
use crate::kernel::contact::along::weighted_sum;
use crate::kernel::contact::pair_search::{bilateral, closest_to_point};
use crate::kernel::contact::{MinimumKind, ShapeAt};
use crate::system::PairPointKind;
use crate::tensor::Vec3;

/// Closest points nearer to a node than this part of the element are at the node.
pub(super) const AT_NODE: f64 = 1e-6;

/// An element of a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side<const N: usize> {
    /// Places of its nodes
    pub(super) nodes: [Vec3; N],
    /// The derivative of the place at the start of the next element of the beam; of the last element
    /// of a ring, the first one
    pub(super) next: Option<Vec3>,
    /// True for the first element of a beam that is no ring
    pub(super) is_first: bool,
    /// True if ends of the beam are half spheres, false if they do not touch
    pub(super) has_caps: bool,
}

/// A point of a pair of elements that may touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairCandidate {
    /// Places on the first and on the second element, from 0 to 1
    pub(super) at: [f64; 2],
    /// True for the places that are closest points and move; others stay
    pub(super) free: [bool; 2],
    /// Its kind
    pub(super) kind: PairPointKind,
    /// The part of the force that it carries
    pub(super) weight: f64,
}

/// The point of an element that is closest to a node of the other beam.
struct Foot {
    s: f64,
    moves: bool,
}

impl<const N: usize> Side<N> {
    /// The place at a point.
    pub fn place(&self, s: f64) -> Vec3 {
        weighted_sum(&ShapeAt::<N>::new(s).values, |i| self.nodes[i])
    }

    fn slope(&self, s: f64) -> Vec3 {
        weighted_sum(&ShapeAt::<N>::new(s).slopes, |i| self.nodes[i])
    }

    /// The ends of the element that belong to it: each node of a beam to one element.
    fn ends(&self) -> impl Iterator<Item = f64> + use<N> {
        [0.0, 1.0].into_iter().skip(usize::from(!self.is_first))
    }

    /// The nodes that belong to the element, by their places on it.
    fn own_nodes(&self) -> impl Iterator<Item = f64> + use<N> {
        (usize::from(!self.is_first)..N).map(|i| i as f64 / (N - 1) as f64)
    }

    /// True if the distance grows along the beam to both sides of an end. `apart`: from the other
    /// point to the end.
    fn is_closest_end(&self, s: f64, apart: Vec3) -> bool {
        let slope = self.slope(s);
        let slack = AT_NODE * slope.squared();
        let along = apart.dot(slope);
        let is_closest = if s == 0.0 {
            along >= -slack
        } else {
            along <= slack && self.next.is_none_or(|next| apart.dot(next) >= -AT_NODE * next.squared())
        };
        is_closest && self.may_touch(s, apart)
    }

    /// False at ends of beams without caps that the other beam is beyond.
    fn may_touch(&self, s: f64, apart: Vec3) -> bool {
        let is_start = s == 0.0 && self.is_first;
        let is_end = s == 1.0 && self.next.is_none();
        if self.has_caps || !(is_start || is_end) {
            return true;
        }
        let slope = self.slope(s);
        let outward = if is_start { -slope } else { slope };
        -apart.dot(outward) <= CAP_COSINE * apart.norm() * outward.norm()
    }

    /// The closest points of the element to a point, between its ends and at those that belong to
    /// it.
    fn feet(&self, point: Vec3) -> Vec<Foot> {
        let minima = closest_to_point(point, &self.nodes);
        let found = minima.found().iter().filter(|minimum| is_inside(minimum.s) && minimum.kind != MinimumKind::Kink);
        let mut feet: Vec<Foot> =
            found.map(|minimum| Foot { s: minimum.s, moves: minimum.kind == MinimumKind::Sharp }).collect();
        let ends = self.ends().filter(|&s| self.is_closest_end(s, self.place(s) - point));
        feet.extend(ends.map(|s| Foot { s, moves: false }));
        feet
    }
}

fn is_inside(s: f64) -> bool {
    s > AT_NODE && s < 1.0 - AT_NODE
}

/// The kinds of points that a pair of elements may have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kinds {
    /// Closest points of both
    pub(super) closest: bool,
    /// Nodes of both
    pub(super) nodes: bool,
}

impl Kinds {
    /// Both kinds.
    pub const ALL: Self = Self { closest: true, nodes: true };
}

/// The part of the force at a node of one of two elements side by side.
const OF_NODE: f64 = 0.5;

/// Adds the candidates of two elements: closest points with the weight 1, nodes with a half.
pub(super) fn candidates<const NA: usize, const NB: usize>(
    a: &Side<NA>,
    b: &Side<NB>,
    kinds: Kinds,
    out: &mut Vec<PairCandidate>,
) {
    if kinds.closest {
        add_closest(a, b, out);
    }
    if kinds.nodes {
        let weight = OF_NODE;
        add_nodes(a, b, &mut |[s, e], moves| {
            out.push(PairCandidate { at: [s, e], free: [false, moves], kind: PairPointKind::NodeOfFirst, weight });
        });
        add_nodes(b, a, &mut |[e, s], moves| {
            out.push(PairCandidate { at: [s, e], free: [moves, false], kind: PairPointKind::NodeOfSecond, weight });
        });
    }
}

fn add_closest<const NA: usize, const NB: usize>(a: &Side<NA>, b: &Side<NB>, out: &mut Vec<PairCandidate>) {
    let mut add = |at: [f64; 2], free: [bool; 2]| {
        out.push(PairCandidate { at, free, kind: PairPointKind::Closest, weight: 1.0 });
    };
    let inner = bilateral(&a.nodes, &b.nodes);
    inner
        .found()
        .filter(|pair| is_inside(pair.s) && is_inside(pair.e))
        .for_each(|pair| add([pair.s, pair.e], [true; 2]));
    for s in a.ends() {
        let end = a.place(s);
        for foot in b.feet(end) {
            if a.is_closest_end(s, end - b.place(foot.s)) {
                add([s, foot.s], [false, foot.moves]);
            }
        }
    }
    for e in b.ends() {
        let end = b.place(e);
        for foot in a.feet(end).into_iter().filter(|foot| is_inside(foot.s)) {
            if b.is_closest_end(e, end - a.place(foot.s)) {
                add([foot.s, e], [foot.moves, false]);
            }
        }
    }
}

/// Shows the nodes of one element with their closest points on the other.
fn add_nodes<const NA: usize, const NB: usize>(a: &Side<NA>, b: &Side<NB>, show: &mut dyn FnMut([f64; 2], bool)) {
    for s in a.own_nodes() {
        let node = a.place(s);
        for foot in b.feet(node) {
            if a.may_touch(s, node - b.place(foot.s)) {
                show([s, foot.s], foot.moves);
            }
        }
    }
}
