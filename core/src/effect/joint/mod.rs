//! Joints between two nodes, or a node and ground: multipliers close the gaps of a
//! [kind](JointKind), see [`crate::kernel::joint`]. Springs, dampers and motors act on a free
//! coordinate.

mod coordinate;
mod drive;
mod kind;

pub use coordinate::nearest_angle;
pub use drive::{Drive, Motor, SpringDamper};
pub use kind::{FreeCoordinate, GroundHold, JointKind, NormalPair};

use super::{Constraint, DrivenCoordinates, Effect, Energy, MotorState, Roles, TangentForm};
use crate::kernel::joint::{DirectionPair, End, GapFactors, add_along, add_between, block, cosine, slides};
use crate::kernel::{ElementSystem, Weights};
use crate::rotation::Rotation;
use crate::scalar::{Jet, Real};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Node, Slot, State};
use crate::tensor::{Mat3, Vec3};

/// A joint that needs multipliers or has a spring.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Axes of A along which B does not slide
    pub held: [bool; 3],
    /// Pairs of axes that multipliers keep normal
    pub normal: &'static [NormalPair],
    /// The nodes A and B; `None` is ground
    pub nodes: [Option<Node>; 2],
    /// The initial places of the nodes
    pub places: [Vec3; 2],
    /// The initial vectors from each node to the joint
    pub arms: [Vec3; 2],
    /// e_1, e_2, e_3 as columns, in the initial placement
    pub axes: Mat3,
    /// The slot of multipliers of gaps along axes, for ends with arms or slides
    pub along: Option<Slot>,
    /// The slot of multipliers of gaps between directions
    pub between: Option<Slot>,
    /// The drive on its free coordinate
    pub drive: Option<Drive>,
    /// The index of its angle in the memory of a state, for a spring on the angle
    pub angle: Option<usize>,
}

/// The effect of all joints that need multipliers or have a spring.
#[derive(Clone, Debug)]
pub struct Joints {
    /// The joints
    pub joints: Vec<Joint>,
}

/// The gaps of a joint by multiplier; zero for multipliers without a gap.
struct Gaps<T> {
    /// Along axes of A, lengths
    along: Vec3<T>,
    /// Between directions: cosines, and the angle of a motor in radians
    between: Vec3<T>,
}

impl Joint {
    fn slots(&self) -> [Option<Slot>; block::COUNT] {
        let [a, b] = self.nodes;
        // Joints of ends that share their displacement have moments only.
        let displacement = |node: Option<Node>| node.filter(|_| self.pulls()).map(|node| node.u);
        let rotation = |node: Option<Node>| node.map(|node| node.p);
        [displacement(a), rotation(a), displacement(b), rotation(b), self.along, self.between]
    }

    /// True if forces act at its ends, not only moments.
    fn pulls(&self) -> bool {
        let slides = self.spring().is_some_and(|(on, _)| on == FreeCoordinate::Slide);
        self.along.is_some() || slides
    }

    fn ends(&self, at: &State) -> [End; 2] {
        std::array::from_fn(|k| match self.nodes[k] {
            Some(node) => End { place: self.places[k] + at.q[node.u as usize], rotation: at.rotation(node.p) },
            None => End { place: self.places[k], rotation: Rotation::new(Vec3::ZERO) },
        })
    }

    /// The ends as functions of time.
    fn moving_ends(&self, at: &State) -> [End<Jet>; 2] {
        let jet = |value: Vec3, rate: Vec3, rate2: Vec3| {
            Vec3(std::array::from_fn(|k| Jet { value: value.0[k], rate: rate.0[k], rate2: rate2.0[k] }))
        };
        std::array::from_fn(|k| match self.nodes[k] {
            Some(node) => {
                let u = node.u as usize;
                let p = node.p as usize;
                let place = jet(self.places[k] + at.q[u], at.v[u], at.a[u]);
                End { place, rotation: Rotation::new(jet(at.q[p], at.v[p], at.a[p])) }
            }
            None => End { place: Vec3::constant(self.places[k]), rotation: Rotation::new(Vec3::constant(Vec3::ZERO)) },
        })
    }

    fn multipliers(&self, at: &State, slot: Option<Slot>) -> Vec3 {
        slot.map_or(Vec3::ZERO, |slot| at.q[slot as usize])
    }

    /// The pairs of directions that stay normal.
    fn pairs<T: Real>(&self) -> Vec<DirectionPair<T>> {
        let e = |k: usize| Vec3::<T>::constant(self.axes.column(k));
        self.normal.iter().map(|&(i, k)| DirectionPair { a: e(i), b: e(k) }).collect()
    }

    /// The motor on its angle, with the row of its multiplier, which follows those of the pairs.
    fn turning_motor(&self) -> Option<(Motor, usize)> {
        self.motor_on(FreeCoordinate::Angle).map(|motor| (motor, self.normal.len()))
    }

    /// The axes along which gaps are closed: held ones, and that of a motor on the slide.
    fn closed_along(&self) -> [bool; 3] {
        let driven = self.motor_on(FreeCoordinate::Slide).is_some();
        [self.held[0] || driven, self.held[1], self.held[2]]
    }

    /// The slot of the multiplier of its motor.
    pub fn motor_slot(&self) -> Option<Slot> {
        let (on, _) = self.motor()?;
        match on {
            FreeCoordinate::Angle => self.between,
            FreeCoordinate::Slide => self.along,
        }
    }

    /// The used components of a slot of its multipliers.
    pub fn used(&self, slot: Slot) -> [bool; 3] {
        if self.along == Some(slot) {
            return self.closed_along();
        }
        let count = self.normal.len() + usize::from(self.turning_motor().is_some());
        [0, 1, 2].map(|k| k < count)
    }

    /// The gaps of a state.
    fn gaps(&self, at: &State, ends: &[End; 2]) -> Gaps<f64> {
        let mut along = slides(&self.axes, &self.arms, &ends[0], &ends[1]);
        along.0[0] -= self.motor_on(FreeCoordinate::Slide).map_or(0.0, |motor| motor.value(at));
        let mut between = Vec3::ZERO;
        for (k, &pair) in self.pairs().iter().enumerate() {
            between.0[k] = cosine(pair, &ends[0], &ends[1]);
        }
        if let Some((motor, row)) = self.turning_motor() {
            between.0[row] = nearest_angle(self.angle_of(ends).value - motor.value(at));
        }
        let closed = self.closed_along();
        Gaps { along: Vec3([0, 1, 2].map(|k| if closed[k] { along.0[k] } else { 0.0 })), between }
    }

    /// The gaps with their first and second time derivatives.
    fn moving_gaps(&self, at: &State) -> Gaps<Jet> {
        let ends = self.moving_ends(at);
        let mut along = slides(&self.axes, &self.arms, &ends[0], &ends[1]);
        if let Some(motor) = self.motor_on(FreeCoordinate::Slide) {
            along.0[0] -= motor.course(at);
        }
        let mut between = Vec3([Jet::constant(0.0); 3]);
        for (k, &pair) in self.pairs().iter().enumerate() {
            between.0[k] = cosine(pair, &ends[0], &ends[1]);
        }
        if let Some((motor, row)) = self.turning_motor() {
            let e = |k: usize| Vec3::<Jet>::constant(self.axes.column(k));
            let cosine_of = |b: Vec3<Jet>| cosine(DirectionPair { a: e(1), b }, &ends[0], &ends[1]);
            let sine = -cosine_of(e(2));
            between.0[row] = sine.atan2(cosine_of(e(1))) - motor.course(at);
        }
        Gaps { along, between }
    }

    /// Overwrites `out` with forces, tangent and the rows of the multipliers, in the blocks u_A,
    /// P_A, u_B, P_B and the multipliers along and between, see [`block`].
    pub fn system(&self, at: &State, weights: Weights, out: &mut ElementSystem) {
        out.clear();
        let ends = self.ends(at);
        self.hold(at, &ends, weights, out);
        self.add_spring(at, &ends, weights, out);
    }

    /// Adds the forces of the multipliers, their tangent and their rows.
    fn hold(&self, at: &State, ends: &[End; 2], weights: Weights, out: &mut ElementSystem) {
        // In a tangent without stiffness multipliers constrain accelerations.
        let couple = if weights.stiffness != 0.0 { weights.stiffness } else { weights.mass };
        let factors = GapFactors { forces: weights.stiffness, multiplier: couple };
        let gaps = self.gaps(at, ends);
        if self.pulls() {
            let force = self.multipliers(at, self.along);
            add_along(&self.axes, &self.arms, ends, force, factors, out);
            out.add_force(block::ALONG, gaps.along);
        }
        let multipliers = self.multipliers(at, self.between);
        for (k, pair) in self.pairs().into_iter().enumerate() {
            add_between(pair, ends, multipliers.0[k], factors, k, out);
        }
        if let Some((_, row)) = self.turning_motor() {
            self.angle_of(ends).add_multiplier(multipliers.0[row], factors, row, out);
        }
        out.add_force(block::BETWEEN, gaps.between);
    }
}

impl Effect for Joints {
    fn name(&self) -> &'static str {
        "joints"
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn damps(&self) -> bool {
        self.joints.iter().any(Joint::damps)
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        self.joints.iter().for_each(|joint| connectivity.push(joint.slots().into_iter().flatten()));
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::symmetric(!self.damps())
    }

    /// Joints have no planar form.
    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        show(MirrorData::Spatial);
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let mut whole = ElementSystem::new(block::COUNT);
        for (k, joint) in self.joints.iter().enumerate() {
            joint.system(at, weights, &mut whole);
            let slots = joint.slots();
            let present: Vec<usize> = (0..block::COUNT).filter(|&b| slots[b].is_some()).collect();
            out.add(k, &whole.part(&present));
            if joint.damps() {
                let drag = joint.drag(at);
                let parts: Vec<Vec3> = present.iter().map(|&b| drag.get(b).copied().unwrap_or(Vec3::ZERO)).collect();
                out.add_damping(k, &parts);
            }
        }
    }

    fn energy(&self, at: &State) -> Energy {
        Energy { kinetic: 0.0, strain: self.joints.iter().map(|joint| joint.strain_energy(at)).sum() }
    }

    fn strain_of(&self, at: &State, field: &[Vec3], length: f64) -> f64 {
        self.joints.iter().map(|joint| joint.strain_of(at, field, length)).fold(0.0, f64::max)
    }

    fn roles(&self) -> Roles<'_> {
        Roles { constraint: Some(self), driven: Some(self), ..Roles::NONE }
    }
}

impl Constraint for Joints {
    fn drift(&self, at: &State, rates: &mut [Vec3], rates2: &mut [Vec3]) {
        for joint in &self.joints {
            let gaps = joint.moving_gaps(at);
            for (slot, gap) in [(joint.along, gaps.along), (joint.between, gaps.between)] {
                let Some(slot) = slot else { continue };
                rates[slot as usize] = Vec3(gap.0.map(|jet| jet.rate));
                rates2[slot as usize] = Vec3(gap.0.map(|jet| jet.rate2));
            }
        }
    }

    fn remember(&self, at: &mut State) {
        for joint in &self.joints {
            if let Some(number) = joint.angle {
                at.angles[number] = joint.coordinate(FreeCoordinate::Angle, at, &joint.ends(at)).value;
            }
        }
    }

    fn motors(&self, at: &State, show: &mut dyn FnMut(MotorState)) {
        for joint in &self.joints {
            let (Some((on, Motor { value, amplitude })), Some(slot)) = (joint.motor(), joint.motor_slot()) else {
                continue;
            };
            let turns = on == FreeCoordinate::Angle;
            let speed = joint.rate(at, &joint.coordinate(on, at, &joint.ends(at))).value;
            show(MotorState { slot, value, amplitude, turns, speed });
        }
    }

    fn turned(&self, from: &[f64], to: &[f64]) -> Option<(Slot, f64)> {
        let turn = |joint: &Joint| {
            let motor = joint.motor_on(FreeCoordinate::Angle)?;
            let node = joint.nodes[1].or(joint.nodes[0])?;
            Some((node.p, (motor.value * (to[motor.amplitude] - from[motor.amplitude])).abs()))
        };
        self.joints.iter().filter_map(turn).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn held_by_ground(&self, at: &State, node: Node) -> (Vec3, Vec3) {
        let mut sum = (Vec3::ZERO, Vec3::ZERO);
        for joint in self.joints.iter().filter(|joint| joint.nodes == [None, Some(node)]) {
            let mut own = ElementSystem::new(block::COUNT);
            joint.hold(at, &joint.ends(at), Weights::NONE, &mut own);
            sum.0 += own.force_block(block::U_B);
            sum.1 += own.force_block(block::P_B);
        }
        sum
    }
}

impl DrivenCoordinates for Joints {
    /// Multipliers are unknowns of linear stages, too.
    fn act_at_once(&self) -> bool {
        false
    }

    fn drives(&self, at: &State, _origin: Option<&State>, show: &mut dyn FnMut(f64, f64)) {
        for joint in &self.joints {
            let Some((on, motor)) = joint.motor() else { continue };
            // L = lambda (coordinate - value), so that the derivative over the value is -lambda.
            let multiplier = match on {
                FreeCoordinate::Angle => joint.multipliers(at, joint.between).0[joint.normal.len()],
                FreeCoordinate::Slide => joint.multipliers(at, joint.along).0[0],
            };
            show(motor.value(at), -multiplier);
        }
    }
}
