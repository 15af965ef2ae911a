//! Joints between two nodes, or a node and ground: a kind is a row of data, which gaps it keeps closed; see
//! [`crate::kernel::joint`]. Springs, dampers and motors act on what a joint leaves free.

use super::{Effect, Energy, MotorState};
use crate::kernel::joint::{End, add_along, add_between, block, cosine, slides};
use crate::kernel::{ElementSystem, Weights};
use crate::rotation::Rotation;
use crate::scalar::{Jet, Real};
use crate::system::{Assembler, Category, Connectivity, Memory, Node, Slot, State};
use crate::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

/// What a kind of joint keeps closed; the joint's axis is e_1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// The axes along which the ends do not slide
    pub held: [bool; 3],
    /// Pairs of axes, one of A and one of B, that stay normal to each other
    pub normal: &'static [(usize, usize)],
}

/// All rotations are held.
const LOCKED: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];

impl Kind {
    /// Rotations are free.
    pub const SPHERICAL: Self = Self { held: [true; 3], normal: &[] };
    /// Turns about e_1.
    pub const REVOLUTE: Self = Self { held: [true; 3], normal: &[(0, 1), (0, 2)] };
    /// Turns about e_1 of A and e_2 of B.
    pub const UNIVERSAL: Self = Self { held: [true; 3], normal: &[(0, 1)] };
    /// Slides along e_1.
    pub const PRISMATIC: Self = Self { held: [false, true, true], normal: &LOCKED };
    /// Holds everything.
    pub const RIGID: Self = Self { held: [true; 3], normal: &LOCKED };
}

/// A prescribed relative motion along the free direction.
#[derive(Clone, Copy, Debug)]
pub struct Motor {
    /// Angle or displacement
    pub value: f64,
    /// The number of its amplitude
    pub amplitude: usize,
}

/// What acts on the one free direction of a revolute or prismatic joint.
#[derive(Clone, Copy, Debug, Default)]
pub struct Drive {
    /// Moment per angle, or force per length
    pub stiffness: f64,
    /// Moment per angular velocity, or force per velocity
    pub damping: f64,
    /// A prescribed motion
    pub motor: Option<Motor>,
}

impl Drive {
    fn damps(&self) -> bool {
        self.damping != 0.0 && self.motor.is_none()
    }
}

/// One joint.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What it holds
    pub kind: Kind,
    /// A and B; `None` is ground
    pub nodes: [Option<Node>; 2],
    /// Their initial places
    pub places: [Vec3; 2],
    /// From each to the joint, at the start
    pub arms: [Vec3; 2],
    /// e_1, e_2, e_3 as columns
    pub axes: Mat3,
    /// Multipliers of gaps along axes, where there are any: ends with arms or slides
    pub along: Option<Slot>,
    /// Multipliers of gaps between directions
    pub between: Option<Slot>,
    /// On the free direction
    pub drive: Drive,
    /// Where the state remembers its angle, if it has a spring
    pub angle: Option<usize>,
}

/// All joints that need multipliers.
#[derive(Clone, Debug)]
pub struct Joints {
    /// The joints
    pub joints: Vec<Instance>,
}

impl Instance {
    fn slots(&self) -> [Option<Slot>; block::COUNT] {
        let [a, b] = self.nodes;
        // Ends that share their displacement need none.
        let displacement = |node: Option<Node>| node.filter(|_| self.slides_matter()).map(|node| node.u);
        let rotation = |node: Option<Node>| node.map(|node| node.p);
        [displacement(a), rotation(a), displacement(b), rotation(b), self.along, self.between]
    }

    fn slides_matter(&self) -> bool {
        self.along.is_some() || self.is_prismatic()
    }

    /// The free direction slides, it does not turn.
    fn is_prismatic(&self) -> bool {
        !self.kind.held[0]
    }

    fn ends(&self, at: &State) -> [End; 2] {
        std::array::from_fn(|k| match self.nodes[k] {
            Some(node) => End { place: self.places[k] + at.q[node.u as usize], rotation: at.rotation(node.p) },
            None => End { place: self.places[k], rotation: Rotation::new(Vec3::ZERO) },
        })
    }

    fn multipliers(&self, at: &State, slot: Option<Slot>) -> Vec3 {
        slot.map_or(Vec3::ZERO, |slot| at.q[slot as usize])
    }

    /// The pairs of directions that stay normal.
    fn pairs<T: Real>(&self) -> Vec<(Vec3<T>, Vec3<T>)> {
        let e = |k: usize| Vec3::<T>::constant(self.axes.column(k));
        self.kind.normal.iter().map(|&(i, k)| (e(i), e(k))).collect()
    }

    fn motor_value(&self, at: &State) -> f64 {
        self.drive.motor.map_or(0.0, |motor| motor.value * at.amplitude[motor.amplitude])
    }

    /// The row of a motor that turns, behind those of the pairs.
    fn turning_motor(&self) -> Option<usize> {
        (self.drive.motor.is_some() && !self.is_prismatic()).then_some(self.kind.normal.len())
    }

    /// The gaps, zero where nothing is held.
    fn gaps(&self, at: &State, ends: &[End; 2]) -> (Vec3, Vec3) {
        let mut along = slides(&self.axes, &self.arms, &ends[0], &ends[1]);
        let slides_on = self.is_prismatic() && self.drive.motor.is_some();
        along.0[0] -= if slides_on { self.motor_value(at) } else { 0.0 };
        let mut between = Vec3::ZERO;
        for (k, &pair) in self.pairs().iter().enumerate() {
            between.0[k] = cosine(pair, &ends[0], &ends[1]);
        }
        if let Some(row) = self.turning_motor() {
            between.0[row] = nearest_angle(self.angle_of(ends).value - self.motor_value(at));
        }
        let held = |k: usize| self.kind.held[k] || (k == 0 && slides_on);
        (Vec3([0, 1, 2].map(|k| if held(k) { along.0[k] } else { 0.0 })), between)
    }

    /// Which of the multipliers of a slot are used.
    pub fn used(&self, slot: Slot) -> [bool; 3] {
        let driven = self.drive.motor.is_some();
        if self.along == Some(slot) {
            return [self.kind.held[0] || driven, self.kind.held[1], self.kind.held[2]];
        }
        let count = self.kind.normal.len() + usize::from(driven && !self.is_prismatic());
        [0, 1, 2].map(|k| k < count)
    }

    /// Forces, tangent, and the rows of the multipliers.
    fn system(&self, at: &State, weights: Weights, out: &mut ElementSystem) {
        let ends = self.ends(at);
        self.hold(at, &ends, weights, out);
        self.add_drive(at, &ends, weights, out);
    }

    /// What the multipliers do, and their rows.
    fn hold(&self, at: &State, ends: &[End; 2], weights: Weights, out: &mut ElementSystem) {
        // Without a stiffness in the tangent the multipliers belong to accelerations.
        let couple = if weights.stiffness != 0.0 { weights.stiffness } else { weights.mass };
        let factors = (weights.stiffness, couple);
        let (along, between) = self.gaps(at, ends);
        if self.slides_matter() {
            let force = self.multipliers(at, self.along);
            add_along(&self.axes, &self.arms, ends, force, factors, out);
            out.add_force(block::ALONG, along);
        }
        let multipliers = self.multipliers(at, self.between);
        for (k, pair) in self.pairs().into_iter().enumerate() {
            add_between(pair, ends, multipliers.0[k], factors, k, out);
        }
        if let Some(row) = self.turning_motor() {
            self.angle_of(ends).add_multiplier(multipliers.0[row], factors, row, out);
        }
        out.add_force(block::BETWEEN, between);
    }

    /// A spring and a damper on the free direction x: f = (k x + c dx/dt) dx/dq.
    fn add_drive(&self, at: &State, ends: &[End; 2], weights: Weights, out: &mut ElementSystem) {
        let Drive { stiffness, damping, motor } = self.drive;
        if motor.is_some() || (stiffness == 0.0 && damping == 0.0) {
            return;
        }
        let coordinate = self.coordinate(at, ends);
        let Rate { rate, over_rate, over_unknown } = self.rate(at, &coordinate);
        for row in 0..4 {
            let along = coordinate.gradient[row];
            out.add_force(row, along * (stiffness * coordinate.value));
            for column in 0..4 {
                let unknown = coordinate.gradient[column] * stiffness + over_unknown[column] * damping;
                let varies = unknown * weights.stiffness + over_rate[column] * (damping * weights.damping);
                let bent = coordinate.hessian.tangent_block(row, column);
                let force = stiffness * coordinate.value + damping * rate;
                out.add_tangent(row, column, along.outer(varies) + bent.scale(force * weights.stiffness));
            }
        }
    }

    /// The forces of the damper on u_A, P_A, u_B, P_B.
    fn drag(&self, at: &State) -> [Vec3; 4] {
        let coordinate = self.coordinate(at, &self.ends(at));
        let rate = self.rate(at, &coordinate).rate;
        coordinate.gradient.map(|gradient| gradient * (self.drive.damping * rate))
    }

    /// The angle or slide along the free direction, with its first and second derivatives over u_A, P_A, u_B, P_B.
    fn coordinate(&self, at: &State, ends: &[End; 2]) -> Coordinate {
        if self.is_prismatic() {
            let mut own = ElementSystem::new(block::COUNT);
            add_along(&self.axes, &self.arms, ends, Vec3::UNIT[0], (1.0, 0.0), &mut own);
            return Coordinate {
                value: slides(&self.axes, &self.arms, &ends[0], &ends[1]).0[0],
                gradient: [0, 1, 2, 3].map(|k| own.force_block(k)),
                hessian: own,
            };
        }
        let before = self.angle.map_or(0.0, |number| at.angles[number]);
        let coordinate = self.angle_of(ends);
        let turns = ((before - coordinate.value) / (2.0 * PI)).round();
        Coordinate { value: coordinate.value + 2.0 * PI * turns, ..coordinate }
    }

    /// The angle atan2(s, c) between e_2 of A and of B, with c = (R_A e_2).(R_B e_2), s = -(R_A e_2).(R_B e_3):
    ///
    /// ```text
    /// r^2 dx = c ds - s dc,   r^2 d2x = c d2s - s d2c + ds dc' - dc ds' - 2 dx (c dc' + s ds'),   r^2 = c^2 + s^2
    /// ```
    fn angle_of(&self, ends: &[End; 2]) -> Coordinate {
        let e = |k: usize| self.axes.column(k);
        let part = |directions: (Vec3, Vec3)| {
            let mut own = ElementSystem::new(block::COUNT);
            add_between(directions, ends, 1.0, (1.0, 0.0), 0, &mut own);
            (cosine(directions, &ends[0], &ends[1]), own)
        };
        let ((c, dc), (s, ds)) = (part((e(1), e(1))), part((e(1), -e(2))));
        let scale = 1.0 / (c * c + s * s);
        let gradient: [Vec3; 4] = std::array::from_fn(|k| (ds.force_block(k) * c - dc.force_block(k) * s) * scale);
        let mut hessian = ElementSystem::new(block::COUNT);
        for row in 0..4 {
            for column in 0..4 {
                let straight = ds.tangent_block(row, column).scale(c) - dc.tangent_block(row, column).scale(s);
                let turning = ds.force_block(row).outer(dc.force_block(column))
                    - dc.force_block(row).outer(ds.force_block(column));
                let growth = dc.force_block(column) * c + ds.force_block(column) * s;
                let shrinking = gradient[row].outer(growth * 2.0);
                hessian.add_tangent(row, column, (straight + turning - shrinking).scale(scale));
            }
        }
        Coordinate { value: libm::atan2(s, c), gradient, hessian }
    }

    /// The rate of the coordinate, with its derivatives over the unknown rates and the unknowns.
    fn rate(&self, at: &State, coordinate: &Coordinate) -> Rate {
        let mut out = Rate { rate: 0.0, over_rate: coordinate.gradient, over_unknown: [Vec3::ZERO; 4] };
        let mut rates = [Vec3::ZERO; 4];
        for (k, node) in self.nodes.iter().enumerate() {
            let Some(node) = node else { continue };
            let turning = at.rotation_rate(node.p);
            (rates[2 * k], rates[2 * k + 1]) = (at.v[node.u as usize], turning.rate);
            let row = 2 * k + 1;
            (out.over_rate[row], out.over_unknown[row]) = turning.pull_back(coordinate.gradient[row]);
        }
        for row in 0..4 {
            out.rate += coordinate.gradient[row].dot(rates[row]);
            for (column, over) in out.over_unknown.iter_mut().enumerate() {
                *over += coordinate.hessian.tangent_block(row, column).transpose_mul(rates[row]);
            }
        }
        out
    }

    /// Second derivatives of the gaps over time for a motion without accelerations.
    fn bias(&self, at: &State) -> (Vec3, Vec3, Vec3, Vec3) {
        let jet = |value: Vec3, rate: Vec3| {
            Vec3(std::array::from_fn(|k| Jet { value: value.0[k], rate: rate.0[k], rate2: 0.0 }))
        };
        let ends: [End<Jet>; 2] = std::array::from_fn(|k| match self.nodes[k] {
            Some(node) => {
                let (u, p) = (node.u as usize, node.p as usize);
                let place = jet(self.places[k] + at.q[u], at.v[u]);
                End { place, rotation: Rotation::new(jet(at.q[p], at.v[p])) }
            }
            None => End { place: Vec3::constant(self.places[k]), rotation: Rotation::new(Vec3::constant(Vec3::ZERO)) },
        });
        let motor = self.drive.motor.map_or(Jet::constant(0.0), |motor| {
            let [rate, rate2] = at.amplitude_rates[motor.amplitude];
            let value = motor.value * at.amplitude[motor.amplitude];
            Jet { value, rate: motor.value * rate, rate2: motor.value * rate2 }
        });
        let mut along = slides(&self.axes, &self.arms, &ends[0], &ends[1]);
        if self.is_prismatic() && self.drive.motor.is_some() {
            along.0[0] -= motor;
        }
        let mut between = [Jet::constant(0.0); 3];
        for (k, &pair) in self.pairs().iter().enumerate() {
            between[k] = cosine(pair, &ends[0], &ends[1]);
        }
        if let Some(row) = self.turning_motor() {
            let e = |k: usize| Vec3::<Jet>::constant(self.axes.column(k));
            let sine = -cosine((e(1), e(2)), &ends[0], &ends[1]);
            between[row] = sine.atan2(cosine((e(1), e(1)), &ends[0], &ends[1])) - motor;
        }
        let rate = |v: [Jet; 3]| Vec3(v.map(|jet| jet.rate));
        let rate2 = |v: [Jet; 3]| Vec3(v.map(|jet| jet.rate2));
        (rate(along.0), rate(between), rate2(along.0), rate2(between))
    }
}

/// A scalar coordinate of a joint.
struct Coordinate {
    value: f64,
    gradient: [Vec3; 4],
    /// In the tangent
    hessian: ElementSystem,
}

impl Coordinate {
    /// Adds the forces of a multiplier on this coordinate, as [`add_between`] does on a gap.
    fn add_multiplier(&self, multiplier: f64, (weight, couple): (f64, f64), row: usize, out: &mut ElementSystem) {
        let mut unit = Vec3::ZERO;
        unit.0[row] = couple;
        for k in 0..4 {
            out.add_force(k, self.gradient[k] * multiplier);
            let column = self.gradient[k].outer(unit);
            out.add_tangent(k, block::BETWEEN, column);
            out.add_tangent(block::BETWEEN, k, column.transpose());
            for j in 0..4 {
                out.add_tangent(k, j, self.hessian.tangent_block(k, j).scale(multiplier * weight));
            }
        }
    }
}

/// The same angle in (-pi, pi].
pub fn nearest_angle(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}

/// Its rate.
struct Rate {
    rate: f64,
    over_rate: [Vec3; 4],
    over_unknown: [Vec3; 4],
}

impl Effect for Joints {
    fn name(&self) -> &'static str {
        "joints"
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn damps(&self) -> bool {
        self.joints.iter().any(|joint| joint.drive.damps())
    }

    fn is_symmetric(&self) -> bool {
        !self.damps()
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        self.joints.iter().for_each(|joint| connectivity.push(joint.slots().into_iter().flatten()));
        connectivity
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let mut whole = ElementSystem::new(block::COUNT);
        for (k, joint) in self.joints.iter().enumerate() {
            whole.clear();
            joint.system(at, weights, &mut whole);
            let present: Vec<usize> = (0..block::COUNT).filter(|&b| joint.slots()[b].is_some()).collect();
            out.add(k, &whole.part(&present));
            if joint.drive.damps() {
                let drag = joint.drag(at);
                let parts: Vec<Vec3> = present.iter().map(|&b| drag.get(b).copied().unwrap_or(Vec3::ZERO)).collect();
                out.add_damping(k, &parts);
            }
        }
    }

    fn energy(&self, at: &State) -> Energy {
        let one = |joint: &Instance| match joint.drive {
            Drive { stiffness, motor: None, .. } if stiffness != 0.0 => {
                let value = joint.coordinate(at, &joint.ends(at)).value;
                0.5 * stiffness * value * value
            }
            _ => 0.0,
        };
        Energy { kinetic: 0.0, strain: self.joints.iter().map(one).sum() }
    }

    fn strain_of(&self, at: &State, field: &[Vec3], length: f64) -> f64 {
        let one = |joint: &Instance| {
            let gradient = joint.coordinate(at, &joint.ends(at)).gradient;
            let ends = joint.nodes.iter().zip([[0, 1], [2, 3]]);
            let parts = ends.filter_map(|(node, [u, p])| {
                node.map(|node| gradient[u].dot(field[node.u as usize]) + gradient[p].dot(field[node.p as usize]))
            });
            let change = parts.sum::<f64>().abs();
            if joint.is_prismatic() { change / length } else { change }
        };
        let sprung = |joint: &&Instance| joint.drive.motor.is_none() && joint.drive.stiffness != 0.0;
        self.joints.iter().filter(sprung).map(one).fold(0.0, f64::max)
    }

    fn held_by_ground(&self, at: &State, node: Node) -> (Vec3, Vec3) {
        let mut sum = (Vec3::ZERO, Vec3::ZERO);
        for joint in self.joints.iter().filter(|joint| joint.nodes == [None, Some(node)]) {
            let mut own = ElementSystem::new(block::COUNT);
            joint.hold(at, &joint.ends(at), Weights::NONE, &mut own);
            sum.0 += own.force_block(2);
            sum.1 += own.force_block(3);
        }
        sum
    }

    fn remember(&self, at: &mut State) {
        for joint in &self.joints {
            if let Some(number) = joint.angle {
                at.angles[number] = joint.coordinate(at, &joint.ends(at)).value;
            }
        }
    }

    fn drift(&self, at: &State, rates: &mut [Vec3], rates2: &mut [Vec3]) {
        for joint in &self.joints {
            let (along, between, along2, between2) = joint.bias(at);
            for (slot, rate, rate2) in [(joint.along, along, along2), (joint.between, between, between2)] {
                if let Some(slot) = slot {
                    rates[slot as usize] = rate;
                    rates2[slot as usize] = rate2;
                }
            }
        }
    }

    fn motors(&self, at: &State, show: &mut dyn FnMut(MotorState)) {
        for joint in &self.joints {
            let turns = !joint.is_prismatic();
            let slot = if turns { joint.between } else { joint.along };
            if let (Some(Motor { value, amplitude }), Some(slot)) = (joint.drive.motor, slot) {
                let speed = joint.rate(at, &joint.coordinate(at, &joint.ends(at))).rate;
                show(MotorState { slot, value, amplitude, turns, speed });
            }
        }
    }

    fn turned(&self, from: &[f64], to: &[f64]) -> Option<(Slot, f64)> {
        let turning = self.joints.iter().filter(|joint| joint.turning_motor().is_some());
        let turn = |joint: &Instance| {
            let node = joint.nodes[1].or(joint.nodes[0])?;
            let motor = joint.drive.motor?;
            Some((node.p, (motor.value * (to[motor.amplitude] - from[motor.amplitude])).abs()))
        };
        turning.filter_map(turn).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn drives(&self, at: &State, show: &mut dyn FnMut(f64, f64)) {
        for joint in self.joints.iter().filter(|joint| joint.drive.motor.is_some()) {
            let value = joint.motor_value(at);
            // L = lambda (coordinate - value): what the motor gives grows with -value.
            let multipliers = match joint.turning_motor() {
                Some(row) => joint.multipliers(at, joint.between).0[row],
                None => joint.multipliers(at, joint.along).0[0],
            };
            show(value, -multipliers);
        }
    }
}
