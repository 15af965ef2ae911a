//! State of a scene: a 3-vector of unknowns per slot, with its rates.

use super::contact::{ContactMemory, ListedPair};
use super::field::Field;
use crate::kernel::NodeMotion;
use crate::kernel::inertia::Spin;
use crate::kernel::seam::Conversion;
use crate::kernel::turn::Turn;
use crate::rotation::Rotation;
use crate::tensor::{Mat3, Vec3, copied, zeros};
use crate::threads;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::sync::Arc;

/// Index of a 3-vector of unknowns: a displacement or a rotation vector.
pub type Slot = u32;

/// The two slots of a node. Nodes connected by a spherical joint share `u`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// Slot of the displacement
    pub u: Slot,
    /// Slot of the rotation vector
    pub p: Slot,
}

/// Force at a slot that fades to zero as the load factor of a static stage rises.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Fading {
    /// Full force, at load factor 0, on the side of the internal forces (global components)
    pub(crate) force: Vec3,
    /// Unknowns of the slot when the force was computed, which identify the chart that it is
    /// conjugate in
    pub(crate) at: Vec3,
}

/// Unknowns towards which the artificial resistance of a static stage pulls, see
/// [`crate::effect::resistance`].
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Anchor {
    /// Stiffness, force per displacement, at every node
    pub(crate) resistance: f64,
    /// Unknowns by slot
    pub(crate) q: Vec<Vec3>,
}

/// The variables of a run. Effects are functions of it.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct State {
    /// Time of the run, constant in static stages
    pub time: f64,
    /// Load factor of a static stage; 1 in dynamic stages
    pub load: f64,
    /// Displacements, and rotation vectors each in its current chart (global components)
    pub q: Vec<Vec3>,
    /// Rates dq/dt; zero in static stages
    pub v: Field,
    /// Second rates d2q/dt2; zero in static stages
    pub a: Field,
    /// Algorithmic accelerations of generalised-alpha methods; empty for methods without, which use
    /// `a`. If the unknowns of a step are increments, that of a rotation is the rate of its angular
    /// momentum, see [`Turn`]; during the iterations of a step it has the value at the start of the
    /// step.
    pub(crate) algorithmic: Field,
    /// True accelerations at the start of the last step, where there are algorithmic ones, and like
    /// these rates of angular momenta; NaN where a chart has changed
    pub(crate) earlier: Field,
    /// Factor of each load, valid at `time` and `load`
    pub amplitude: Vec<f64>,
    /// For each beam element the nodes whose rotation is converted into the chart of the first;
    /// constant during a Newton iteration
    pub(crate) mixed: Vec<Conversion>,
    /// For each rotation slot the rotation vector continued without jumps since the start, valid at
    /// the last converged state. Springs that count turns and the output columns `rc` read it.
    /// Empty as long as no chart has changed: `q` itself is then without jumps.
    pub unwrapped: Vec<Vec3>,
    /// First and second time derivative of each load factor
    pub(crate) amplitude_rates: Vec<[f64; 2]>,
    /// For each slot the inertia and damping force at the end of the motion before a static stage;
    /// empty without such a motion
    pub(crate) fading: Arc<Vec<Fading>>,
    /// Anchor of the artificial resistance while a static stage searches for an equilibrium
    pub(crate) anchor: Option<Arc<Anchor>>,
    /// Angle of each joint spring in rad, continued without jumps, valid at the last converged state
    pub(crate) angles: Vec<f64>,
    /// Contacts at the last converged state
    pub contacts: ContactMemory,
    /// For each rotation slot the base of the current time step, during the iterations of a step
    /// whose unknowns are increments: `q` is then the increment, `v` and `a` the material spin and
    /// its rate. Otherwise empty: rotation vectors are total.
    #[serde(skip)]
    pub(crate) turns: Vec<Option<Turn>>,
}

impl State {
    /// The undeformed state at rest.
    pub fn rest(slots: usize, elements: usize, amplitudes: usize, angles: usize) -> Self {
        let rates = Field::zero(slots);
        Self {
            time: 0.0,
            load: 0.0,
            q: zeros(slots),
            v: rates.clone(),
            a: rates,
            algorithmic: Field::none(),
            earlier: Field::none(),
            amplitude: vec![0.0; amplitudes],
            mixed: vec![0; elements],
            unwrapped: Vec::new(),
            amplitude_rates: vec![[0.0; 2]; amplitudes],
            fading: Arc::default(),
            anchor: None,
            angles: vec![0.0; angles],
            contacts: ContactMemory::default(),
            turns: Vec::new(),
        }
    }

    /// A copy to restore later. Lists of zeros, as at the start of a run, take no memory.
    pub fn kept(&self) -> Self {
        Self {
            time: self.time,
            load: self.load,
            q: copied(&self.q),
            v: self.v.clone(),
            a: self.a.clone(),
            algorithmic: self.algorithmic.clone(),
            earlier: self.earlier.clone(),
            amplitude: self.amplitude.clone(),
            mixed: self.mixed.clone(),
            unwrapped: self.unwrapped.clone(),
            amplitude_rates: self.amplitude_rates.clone(),
            fading: self.fading.clone(),
            anchor: self.anchor.clone(),
            angles: self.angles.clone(),
            contacts: self.contacts.clone(),
            turns: self.turns.clone(),
        }
    }

    /// Sets all velocities and accelerations to zero.
    pub fn stand_still(&mut self) {
        if self.moves() {
            let rest = Field::zero(self.v.len());
            self.v = rest.clone();
            self.a = rest;
            self.algorithmic = Field::none();
            self.earlier = Field::none();
        }
    }

    /// True if some velocity or acceleration is not zero.
    pub fn moves(&self) -> bool {
        let moves = |&slot: &usize| {
            [&self.v, &self.a, &self.algorithmic]
                .iter()
                .any(|rates| rates.get(slot).is_some_and(|&rate| rate != Vec3::ZERO))
        };
        threads::first(self.v.len(), |mut part| part.find(moves)).is_some()
    }

    /// The state itself if it is at rest, else a copy without velocities and accelerations.
    pub fn at_rest(&self) -> Cow<'_, Self> {
        if !self.moves() {
            return Cow::Borrowed(self);
        }
        let mut still = self.clone();
        still.stand_still();
        Cow::Owned(still)
    }

    /// Takes over another state of the same scene, into the memory of this one.
    pub fn copy_from(&mut self, other: &Self) {
        self.copy_rates(other);
        self.copy_all_but_rates(other);
    }

    /// Takes over velocities and accelerations of another state.
    pub fn copy_rates(&mut self, other: &Self) {
        self.v.copy_from(&other.v);
        self.a.copy_from(&other.a);
        self.algorithmic.copy_from(&other.algorithmic);
        self.earlier.copy_from(&other.earlier);
    }

    /// Takes over another state that has equal velocities and accelerations, as in statics.
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
        self.contacts.clone_from(&other.contacts);
        self.turns.clone_from(&other.turns);
    }

    /// Rotation vector at a slot continued without jumps since the start (global components).
    #[inline]
    pub fn unwrapped_at(&self, slot: Slot) -> Vec3 {
        *self.unwrapped.get(slot as usize).unwrap_or(&self.q[slot as usize])
    }

    /// Rotation vectors continued without jumps, by slot, stored separately from `q` from here on.
    pub fn unwrapped_mut(&mut self) -> &mut [Vec3] {
        if self.unwrapped.is_empty() {
            threads::copy(&mut self.unwrapped, &self.q);
        }
        &mut self.unwrapped
    }

    /// Base of the current time step of a rotation whose unknown is an increment; `None` for total
    /// rotation vectors.
    #[inline]
    pub fn turn(&self, slot: Slot) -> Option<&Turn> {
        self.turns.get(slot as usize)?.as_ref()
    }

    /// Rotation at a slot, in the chart of the state.
    #[inline]
    pub fn rotation(&self, slot: Slot) -> Rotation {
        let rotation = Rotation::new(self.q[slot as usize]);
        match self.turn(slot) {
            None => rotation,
            Some(turn) => rotation.after(turn.base()),
        }
    }

    /// Rate of the rotation unknown at a slot: of the total rotation vector, or of the increment.
    pub fn rotation_rate(&self, slot: Slot) -> RotationRate {
        let given = self.v[slot as usize];
        let Some(turn) = self.turn(slot) else { return RotationRate::of_vector(given) };
        let spin = turn.spin(self.q[slot as usize], given, self.a[slot as usize]);
        let inverse = spin.rotation.t_inverse();
        let rate = inverse * given;
        let over = spin.over_unknown().map(|over| inverse * (over.d_omega - spin.rotation.c1(rate)));
        RotationRate { rate, over_unknown: over }
    }

    /// Spin and its rate at a rotation slot.
    #[inline]
    pub fn spin(&self, slot: Slot) -> Spin {
        let k = slot as usize;
        match self.turn(slot) {
            None => Spin::new(self.q[k], self.v[k], self.a[k]),
            Some(turn) => turn.spin(self.q[k], self.v[k], self.a[k]),
        }
    }

    /// Motion of a node, for effects that support total rotation vectors only.
    #[inline]
    pub fn motion(&self, node: Node) -> NodeMotion {
        let u = node.u as usize;
        let p = node.p as usize;
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

/// Rate of a rotation unknown. For an increment X, the rate Xd = T^-1 Omega is a function of X.
#[derive(Clone, Copy, Debug)]
pub struct RotationRate {
    /// Rate Pd of a total rotation vector, or Xd of an increment
    pub(crate) rate: Vec3,
    /// dXd/dX = T^-1 (dOmega - C1(Xd)); `None` for a total rotation vector
    over_unknown: Option<Mat3>,
}

impl RotationRate {
    /// Rate of a total rotation vector, an independent variable.
    pub fn of_vector(rate: Vec3) -> Self {
        Self { rate, over_unknown: None }
    }

    /// Converts a derivative with respect to the rate of a rotation unknown into derivatives with
    /// respect to the independent rate of the state (first) and to the unknown itself (second).
    pub fn pull_back(&self, over_rate: Vec3) -> (Vec3, Vec3) {
        match &self.over_unknown {
            None => (over_rate, Vec3::ZERO),
            Some(over_unknown) => (Vec3::ZERO, over_unknown.transpose_mul(over_rate)),
        }
    }
}

/// What an assembly keeps for one effect: stresses that it remembers during a Newton iteration, six
/// numbers per integration point, which can be dropped at any time, and the pairs of its pattern.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    /// Remembered stresses, meaningful only while `valid`
    pub(crate) points: Vec<[f64; 6]>,
    /// True if `points` belongs to the current iteration.
    pub(crate) valid: bool,
    /// The pairs of beam elements that the pattern of the assembly has room for
    pub(crate) pairs: Arc<Vec<ListedPair>>,
}
