//! Springs and cables between two nodes, with a force along the line between them:
//!
//! ```text
//! n = (x_b - x_a)/l,   F = k (l - l0) + c dl/dt,   f_b = F n = -f_a
//! ```

use crate::effect::{Effect, Energy, ForceJump, ForceJumps, Roles, TangentForm};
use crate::kernel::{ElementSystem, Weights};
use crate::scalar::Real;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Node, Slot, State};
use crate::tensor::{Mat3, Vec3};

/// The parts of a time step, within which a cable becomes slack or taut, of whose forces the mean is
/// taken.
const PARTS: usize = 16;

/// A spring or cable between two nodes.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// The nodes at its ends
    pub nodes: [Node; 2],
    /// The initial places of the nodes
    pub places: [Vec3; 2],
    /// k, force per length
    pub stiffness: f64,
    /// c, force per velocity
    pub damping: f64,
    /// l0, its length without force
    pub length: f64,
    /// True for a cable, which has no force at lengths below l0
    pub tension_only: bool,
    /// The index of its amplitude, which is 0 in stages without the link and otherwise 1
    pub amplitude: usize,
}

/// All springs and cables between nodes.
#[derive(Clone, Debug)]
pub struct Links {
    /// The springs and cables
    pub links: Vec<Link>,
}

/// The force g (internal, spatial) at the second node, and its derivatives over place and velocity
/// of the second node relative to the first.
#[derive(Clone, Copy, Debug)]
pub struct Pull<T = f64> {
    /// k (l - l0) n
    pub elastic: Vec3<T>,
    /// c dl/dt n
    pub damping: Vec3<T>,
    /// The derivative over the relative place
    pub over_place: Mat3<T>,
    /// The derivative over the relative velocity
    pub over_velocity: Mat3<T>,
}

impl Link {
    /// The pull for the vector `d` from the first node to the second, and its rate.
    pub fn pull<T: Real>(&self, d: Vec3<T>, rate: Vec3<T>) -> Pull<T> {
        let zero = Pull {
            elastic: Vec3::zero(),
            damping: Vec3::zero(),
            over_place: Mat3::zero(),
            over_velocity: Mat3::zero(),
        };
        let length = d.norm();
        if self.is_slack(length.largest()) {
            return zero;
        }
        if length.largest() == 0.0 {
            // Nodes at one place give no direction: the link acts as if l0 were zero.
            return Pull { over_place: Mat3::identity().scale(self.stiffness), ..zero };
        }
        let inverse = T::one() / length;
        let n = d * inverse;
        let along = n.outer(n);
        let force = (length - T::constant(self.length)) * self.stiffness;
        let speed = n.dot(rate);
        let drag = speed * self.damping;
        let across = (Mat3::identity() - along) * ((force + drag) * inverse);
        let turning = n.outer(rate - n * speed) * (inverse * self.damping);
        Pull {
            elastic: n * force,
            damping: n * drag,
            over_place: along.scale(self.stiffness) + across + turning,
            over_velocity: along.scale(self.damping),
        }
    }

    /// True for a cable without force at a distance of its nodes.
    fn is_slack(&self, distance: f64) -> bool {
        self.tension_only && distance <= self.length
    }

    /// The force at the second node, elastic and of damping.
    fn force(&self, [d, rate]: [Vec3; 2]) -> Vec3 {
        let pull = self.pull(d, rate);
        pull.elastic + pull.damping
    }

    /// The vector from the first node to the second and its rate between two states, at a `part` of
    /// the time from one to the other, `length`: a cubic with their places and velocities.
    fn within(&self, ends: [&State; 2], length: f64, part: f64) -> [Vec3; 2] {
        let [(from, from_rate), (to, to_rate)] = ends.map(|at| self.between(at));
        let rest = 1.0 - part;
        let bulge = from_rate * rest - to_rate * part;
        let way = to - from;
        let d = from * (rest * rest * (1.0 + 2.0 * part))
            + to * (part * part * (3.0 - 2.0 * part))
            + bulge * (length * part * rest);
        let rate = way * (6.0 * part * rest / length)
            + from_rate * (rest * (rest - 2.0 * part))
            + to_rate * (part * (part - 2.0 * rest));
        [d, rate]
    }

    /// True for a cable that is neither slack nor taut all the time between two states.
    fn changes(&self, from: &State, to: &State, length: f64) -> bool {
        let is_slack = |part: f64| self.is_slack(self.within([from, to], length, part)[0].norm());
        self.tension_only && [0.5, 1.0].into_iter().any(|part| is_slack(part) != is_slack(0.0))
    }

    /// What a mean of the forces at some instants misses, see [`ForceJumps::missed`]; `None` where
    /// the cable is slack all the time, or taut.
    fn missed(&self, instants: &[(f64, &State)], length: f64) -> Option<Vec3> {
        let pieces = || instants.windows(2).map(|piece| [piece[0].1, piece[1].1]);
        let length = length / pieces().count() as f64;
        if !pieces().any(|[from, to]| self.changes(from, to, length)) {
            return None;
        }
        let part = |k: usize| (k as f64 + 0.5) / PARTS as f64;
        let along = |ends| (0..PARTS).fold(Vec3::ZERO, |sum, k| sum + self.force(self.within(ends, length, part(k))));
        let sum = pieces().fold(Vec3::ZERO, |sum, ends| sum + along(ends));
        let seen = |mean: Vec3, &(weight, at): &(f64, &State)| mean + self.force(self.between(at).into()) * weight;
        Some(sum * (1.0 / (PARTS * pieces().count()) as f64) - instants.iter().fold(Vec3::ZERO, seen))
    }

    fn between(&self, at: &State) -> (Vec3, Vec3) {
        let [a, b] = self.nodes.map(|node| node.u as usize);
        (self.places[1] - self.places[0] + (at.q[b] - at.q[a]), at.v[b] - at.v[a])
    }
}

impl Effect for Links {
    fn name(&self) -> &'static str {
        "springs and cables between nodes"
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn damps(&self) -> bool {
        self.links.iter().any(|link| link.damping != 0.0)
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        self.links.iter().for_each(|link| connectivity.push(link.nodes.map(|node| node.u)));
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::symmetric(!self.damps())
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        self.links.iter().flat_map(|link| link.places).for_each(|place| show(MirrorData::Place(place)));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let mut system = ElementSystem::new(2);
        for (k, link) in self.links.iter().enumerate() {
            let on = at.amplitude[link.amplitude];
            let (d, rate) = link.between(at);
            let pull = link.pull(d, rate);
            let tangent =
                pull.over_place.scale(weights.stiffness * on) + pull.over_velocity.scale(weights.damping * on);
            system.clear();
            system.add_force(0, -pull.elastic * on);
            system.add_force(1, pull.elastic * on);
            for (row, column, sign) in [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)] {
                system.add_tangent(row, column, tangent.scale(sign));
            }
            out.add(k, &system);
            if link.damping != 0.0 {
                out.add_damping(k, &[-pull.damping * on, pull.damping * on]);
            }
        }
    }

    fn energy(&self, at: &State) -> Energy {
        let one = |link: &Link| {
            let distance = link.between(at).0.norm();
            let stretch = distance - link.length;
            if link.is_slack(distance) {
                0.0
            } else {
                0.5 * link.stiffness * stretch * stretch * at.amplitude[link.amplitude]
            }
        };
        Energy { kinetic: 0.0, strain: self.links.iter().map(one).sum() }
    }

    fn strain_of(&self, at: &State, field: &[Vec3], length: f64) -> f64 {
        let one = |link: &Link| {
            let [a, b] = link.nodes.map(|node| field[node.u as usize]);
            let d = link.between(at).0;
            let change = b - a;
            let distance = d.norm();
            // Nodes at one place give no direction: any change stretches the link.
            let stretch = if distance == 0.0 { change.norm() } else { d.dot(change).abs() / distance };
            if link.is_slack(distance) || link.stiffness == 0.0 { 0.0 } else { stretch / length }
        };
        self.acting(at).map(one).fold(0.0, f64::max)
    }

    fn roles(&self) -> Roles<'_> {
        let has_cables = self.links.iter().any(|link| link.tension_only);
        Roles { force_jumps: has_cables.then_some(self as &dyn ForceJumps), ..Roles::NONE }
    }
}

impl ForceJumps for Links {
    fn acts(&self, at: &State) -> bool {
        self.acting(at).any(|link| link.tension_only)
    }

    fn jumped(&self, from: &State, to: &State, length: f64) -> Option<ForceJump> {
        let changed = self.acting(to).filter(|link| link.changes(from, to, length));
        changed.map(|link| if link.damping == 0.0 { ForceJump::Slope } else { ForceJump::Force }).max()
    }

    fn missed(&self, instants: &[(f64, &State)], length: f64, show: &mut dyn FnMut(Slot, Vec3)) {
        let Some((_, end)) = instants.last() else { return };
        for link in self.acting(end) {
            if let Some(missed) = link.missed(instants, length) {
                let [a, b] = link.nodes.map(|node| node.u);
                show(a, -missed);
                show(b, missed);
            }
        }
    }
}

impl Links {
    /// The springs and cables that act in a state.
    fn acting<'a>(&'a self, at: &'a State) -> impl Iterator<Item = &'a Link> {
        self.links.iter().filter(|link| at.amplitude[link.amplitude] != 0.0)
    }
}
