//! The energy account: what was stored, and the work that came in.

use crate::model::charts::HALF_TURN;
use crate::model::{Model, SlotKind};
use crate::rotation::{Rotation, log, unwound};
use crate::system::{Category, Equations, Slot, State, System};
use crate::tensor::Vec3;

/// Energies of one state and the work of loads, gravity and motions so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Kinetic energy
    pub kinetic: f64,
    /// Strain energy, springs included
    pub strain: f64,
    /// Work done from outside so far, by the trapezoidal rule from row to row
    pub external: f64,
    /// Energy taken by damping so far
    pub damped: f64,
}

impl Ledger {
    /// kinetic + strain + damped - external: constant in an exact solution.
    pub fn total(&self) -> f64 {
        self.kinetic + self.strain + self.damped - self.external
    }
}

/// Keeps the account from step to step.
#[derive(Clone, Debug)]
pub(super) struct Bookkeeper {
    ledger: Ledger,
    q: Vec<Vec3>,
    wound: Vec<Vec3>,
    force: Vec<Vec3>,
    drag: Vec<Vec3>,
    drives: Vec<(f64, f64)>,
}

impl Bookkeeper {
    pub fn new(slots: usize) -> Self {
        let zero = vec![Vec3::ZERO; slots];
        Self {
            ledger: Ledger::default(),
            q: zero.clone(),
            wound: zero.clone(),
            force: zero.clone(),
            drag: zero,
            drives: Vec::new(),
        }
    }

    /// Opens a stage: energies are taken, no work is added.
    pub fn open(&mut self, model: &Model, state: &State, system: &System) {
        self.drives = model.drives(state);
        self.remember(state, system);
        self.take_energies(model, state);
    }

    /// Adds the work of the step that ends here.
    pub fn add_step(&mut self, model: &Model, state: &State, system: &System) {
        for (slot, &kind) in model.kinds.iter().enumerate() {
            let drag = system.force[Category::Damping as usize][slot];
            let wound = state.wound[slot] - self.wound[slot];
            self.ledger.damped += work(kind, (self.q[slot], self.drag[slot]), (state.q[slot], drag), wound);
            let (before, after) = (self.force[slot], outside(system, slot));
            self.ledger.external += work(kind, (self.q[slot], before), (state.q[slot], after), wound);
        }
        let drives = model.drives(state);
        for ((x0, f0), (x1, f1)) in self.drives.iter().zip(&drives) {
            self.ledger.external += 0.5 * (f0 + f1) * (x1 - x0);
        }
        self.drives = drives;
        self.remember(state, system);
        self.take_energies(model, state);
    }

    pub fn ledger(&self) -> Ledger {
        self.ledger
    }

    fn remember(&mut self, state: &State, system: &System) {
        self.q.copy_from_slice(&state.q);
        self.wound.copy_from_slice(&state.wound);
        self.drag.copy_from_slice(&system.force[Category::Damping as usize]);
        for (slot, force) in self.force.iter_mut().enumerate() {
            *force = outside(system, slot);
        }
    }

    fn take_energies(&mut self, model: &Model, state: &State) {
        let energy = model.energy(state);
        (self.ledger.kinetic, self.ledger.strain) = (energy.kinetic, energy.strain);
    }
}

/// What acts from outside at a slot: loads, and the forces that hold or move constrained directions.
fn outside(system: &System, slot: usize) -> Vec3 {
    let equations: &Equations = &system.pattern.equations;
    equations.held_part(slot as Slot, system.total(slot)) - system.force[Category::External as usize][slot]
}

/// Work of a force over the way from the one place to the other, by the trapezoidal rule. A rotation tells by `wound` how far it
/// has gone.
fn work(kind: SlotKind, (q0, f0): (Vec3, Vec3), (q1, f1): (Vec3, Vec3), wound: Vec3) -> f64 {
    if f0 == Vec3::ZERO && f1 == Vec3::ZERO {
        return 0.0;
    }
    match kind {
        SlotKind::Displacement => 0.5 * (f0 + f1).dot(q1 - q0),
        SlotKind::Rotation => turning_work(q0, f0, q1, f1, wound),
        SlotKind::Force | SlotKind::Moment => 0.0,
    }
}

/// Work of a moment over a rotation, in a form that no change of chart disturbs: with the spatial moment m = T^-1 f
/// and the spatial rotation vector from the one state to the other.
fn turning_work(p0: Vec3, f0: Vec3, p1: Vec3, f1: Vec3, wound: Vec3) -> f64 {
    let (before, after) = (Rotation::new(p0), Rotation::new(p1));
    let shortest = log(after.r * before.r.transpose());
    let turned = if wound.norm() > HALF_TURN { unwound(shortest, wound) } else { shortest };
    let (m0, m1) = (before.t_inverse() * f0, after.t_inverse() * f1);
    0.5 * (m0 + m1).dot(turned)
}
