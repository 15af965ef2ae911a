//! The state of a scene: one 3-vector of unknowns a slot, with its rates.

use super::field::Field;
use crate::kernel::NodeMotion;
use crate::kernel::inertia::Spin;
use crate::kernel::seam::Conversion;
use crate::kernel::turn::Turn;
use crate::rotation::Rotation;
use crate::tensor::{Mat3, Vec3, copied, zeros};
use crate::threads;
use std::borrow::Cow;
use std::sync::Arc;

/// The index of a 3-vector of unknowns: a displacement or a rotation vector.
pub type Slot = u32;

/// Where a node keeps its displacement and its rotation vector. Nodes that a spherical joint connects share `u`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// The slot of the displacement
    pub u: Slot,
    /// The slot of the rotation vector
    pub p: Slot,
}

/// A force at a slot that fades with the load factor of a static stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fading {
    /// In full, on the side of the internal forces
    pub force: Vec3,
    /// The unknowns that it is conjugate to, as they were when it was found: they tell the chart.
    pub at: Vec3,
}

/// What an artificial resistance pulls a state back to, see [`crate::effect::resistance`].
#[derive(Clone, Debug)]
pub struct Anchor {
    /// Force per displacement at every node
    pub resistance: f64,
    /// The unknowns to which it pulls
    pub q: Vec<Vec3>,
}

/// Everything that changes in a run. Effects are functions of it.
#[derive(Clone, Debug)]
pub struct State {
    /// The run's clock. Static stages do not advance it.
    pub time: f64,
    /// The load factor of a static stage; 1 in a dynamic one.
    pub load: f64,
    /// Displacements, and rotation vectors each in its present chart (global components).
    pub q: Vec<Vec3>,
    /// dq/dt; zero in static stages.
    pub v: Field,
    /// d2q/dt2; zero in static stages.
    pub a: Field,
    /// The algorithmic acceleration of generalised-alpha methods; empty where a method has none of its own, for which it is `a`. Where
    /// the unknowns of steps are increments, that of a rotation is the rate of the momentum that it carries, see [`Turn`];
    /// while a step is iterated, that of its start.
    pub algorithmic: Field,
    /// The factor of each load, valid at `time` and `load`.
    pub amplitude: Vec<f64>,
    /// For each beam element the nodes that are converted into the chart of the first; frozen while Newton iterates.
    pub mixed: Vec<Conversion>,
    /// For each rotation slot the rotation vector continued without jumps since the start; valid at the last converged
    /// state. It tells a unwrapped spring, and the columns `rc`, which of the turns they are in. Empty as long as no chart has changed:
    /// then `q` itself goes on without jumps.
    pub unwrapped: Vec<Vec3>,
    /// First and second derivative over time of each factor of a load.
    pub amplitude_rates: Vec<[f64; 2]>,
    /// For each slot what inertia and damping did when a motion ended in a static stage; empty where none did.
    pub fading: Arc<Vec<Fading>>,
    /// What an artificial resistance pulls to, while a static stage looks for a state of rest.
    pub anchor: Option<Arc<Anchor>>,
    /// The angle of each sprung joint, continued without jumps; valid at the last converged state.
    pub angles: Vec<f64>,
    /// For each rotation slot the step it is in, while a step is iterated whose unknowns are increments. Then `q` holds the
    /// increment, `v` and `a` the material spin and its rate. Else empty: rotation vectors are total ones.
    pub turns: Vec<Option<Turn>>,
}

impl State {
    /// At rest in the initial placement.
    pub fn rest(slots: usize, elements: usize, amplitudes: usize, angles: usize) -> Self {
        let rates = Field::zero(slots);
        Self {
            time: 0.0,
            load: 0.0,
            q: zeros(slots),
            v: rates.clone(),
            a: rates,
            algorithmic: Field::none(),
            amplitude: vec![0.0; amplitudes],
            mixed: vec![0; elements],
            unwrapped: Vec::new(),
            amplitude_rates: vec![[0.0; 2]; amplitudes],
            fading: Arc::default(),
            anchor: None,
            angles: vec![0.0; angles],
            turns: Vec::new(),
        }
    }

    /// A copy to come back to. Of unknowns that are zero, as at the start of a run, it takes no memory.
    pub fn kept(&self) -> Self {
        Self {
            time: self.time,
            load: self.load,
            q: copied(&self.q),
            v: self.v.clone(),
            a: self.a.clone(),
            algorithmic: self.algorithmic.clone(),
            amplitude: self.amplitude.clone(),
            mixed: self.mixed.clone(),
            unwrapped: self.unwrapped.clone(),
            amplitude_rates: self.amplitude_rates.clone(),
            fading: self.fading.clone(),
            anchor: self.anchor.clone(),
            angles: self.angles.clone(),
            turns: self.turns.clone(),
        }
    }

    /// Takes all velocities and accelerations away.
    pub fn stand_still(&mut self) {
        if self.moves() {
            let rest = Field::zero(self.v.len());
            (self.v, self.a, self.algorithmic) = (rest.clone(), rest, Field::none());
        }
    }

    /// Whether it has velocities or accelerations.
    pub fn moves(&self) -> bool {
        let moves = |&slot: &usize| {
            [&self.v, &self.a, &self.algorithmic]
                .iter()
                .any(|rates| rates.get(slot).is_some_and(|&rate| rate != Vec3::ZERO))
        };
        threads::first(self.v.len(), |mut part| part.find(moves)).is_some()
    }

    /// The state itself where it stands still, or else another one without velocities and accelerations.
    pub fn at_rest(&self) -> Cow<'_, Self> {
        if !self.moves() {
            return Cow::Borrowed(self);
        }
        let mut still = self.clone();
        still.stand_still();
        Cow::Owned(still)
    }

    /// Takes over another state of the same scene, into the memory that it has.
    pub fn copy_from(&mut self, other: &Self) {
        self.copy_rates(other);
        self.copy_all_but_rates(other);
    }

    /// Takes over its velocities and accelerations.
    pub fn copy_rates(&mut self, other: &Self) {
        self.v.copy_from(&other.v);
        self.a.copy_from(&other.a);
        self.algorithmic.copy_from(&other.algorithmic);
    }

    /// The same where both have the same rates, as in statics.
    pub fn copy_all_but_rates(&mut self, other: &Self) {
        debug_assert!(self.v == other.v && self.a == other.a && self.algorithmic == other.algorithmic, "rates differ");
        self.time = other.time;
        self.load = other.load;
        threads::copy(&mut self.q, &other.q);
        self.amplitude.copy_from_slice(&other.amplitude);
        self.mixed.copy_from_slice(&other.mixed);
        threads::copy(&mut self.unwrapped, &other.unwrapped);
        self.amplitude_rates.copy_from_slice(&other.amplitude_rates);
        self.fading.clone_from(&other.fading);
        self.anchor.clone_from(&other.anchor);
        self.angles.copy_from_slice(&other.angles);
        self.turns.clone_from(&other.turns);
    }

    /// The unwrapped rotation vector at a slot.
    #[inline]
    pub fn unwrapped_at(&self, slot: Slot) -> Vec3 {
        *self.unwrapped.get(slot as usize).unwrap_or(&self.q[slot as usize])
    }

    /// All of them, kept apart from `q` from here on.
    pub fn wound_apart(&mut self) -> &mut [Vec3] {
        if self.unwrapped.is_empty() {
            threads::copy(&mut self.unwrapped, &self.q);
        }
        &mut self.unwrapped
    }

    /// The step that a rotation is in, where its unknown is an increment.
    #[inline]
    pub fn turn(&self, slot: Slot) -> Option<&Turn> {
        self.turns.get(slot as usize)?.as_ref()
    }

    /// The rotation at a slot, in the chart of the state.
    #[inline]
    pub fn rotation(&self, slot: Slot) -> Rotation {
        let rotation = Rotation::new(self.q[slot as usize]);
        match self.turn(slot) {
            None => rotation,
            Some(turn) => rotation.after(turn.base()),
        }
    }

    /// The rate of the unknown at a rotation slot.
    pub fn rotation_rate(&self, slot: Slot) -> RotationRate {
        let given = self.v[slot as usize];
        let Some(turn) = self.turn(slot) else { return RotationRate::of_vector(given) };
        let spin = turn.spin(self.q[slot as usize], given, self.a[slot as usize]);
        let inverse = spin.rotation.t_inverse();
        let rate = inverse * given;
        let over = spin.over_unknown().map(|over| inverse * (over.d_omega - spin.rotation.c1(rate)));
        RotationRate { rate, over_unknown: over }
    }

    /// The spin at a slot.
    #[inline]
    pub fn spin(&self, slot: Slot) -> Spin {
        let k = slot as usize;
        match self.turn(slot) {
            None => Spin::new(self.q[k], self.v[k], self.a[k]),
            Some(turn) => turn.spin(self.q[k], self.v[k], self.a[k]),
        }
    }

    /// The motion of a node, for effects that know total rotation vectors only.
    #[inline]
    pub fn motion(&self, node: Node) -> NodeMotion {
        let (u, p) = (node.u as usize, node.p as usize);
        NodeMotion {
            u: self.q[u],
            u_rate: self.v[u],
            u_rate2: self.a[u],
            p: self.q[p],
            p_rate: self.v[p],
            p_rate2: self.a[p],
        }
    }
}

/// The rate of a rotation's unknown. Where that is an increment X, its rate Xd = T^-1 Omega is a function of X.
#[derive(Clone, Copy, Debug)]
pub struct RotationRate {
    /// Pd or Xd
    pub rate: Vec3,
    /// dXd/dX = T^-1 (dOmega - C1(Xd))
    over_unknown: Option<Mat3>,
}

impl RotationRate {
    /// Of a total rotation vector.
    pub fn of_vector(rate: Vec3) -> Self {
        Self { rate, over_unknown: None }
    }

    /// What the derivative of something over the rate of the unknown means for the unknown rate of the state, and for the
    /// unknown itself.
    pub fn pull_back(&self, over_rate: Vec3) -> (Vec3, Vec3) {
        match &self.over_unknown {
            None => (over_rate, Vec3::ZERO),
            Some(over_unknown) => (Vec3::ZERO, over_unknown.transpose_mul(over_rate)),
        }
    }
}

/// What one effect must remember while Newton iterates: six numbers a point. It can be dropped at any time.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    /// The remembered numbers; valid only while `valid`.
    pub points: Vec<[f64; 6]>,
    /// Whether `points` belongs to the present iteration.
    pub valid: bool,
}
