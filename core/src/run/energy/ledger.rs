//! The energy account: what was stored, and the work that came in.

use crate::effect::{Drive, Energy};
use crate::model::charts::HALF_TURN;
use crate::model::{Assembly, LinearisedSystem, Model, SlotKind};
use crate::rotation::{Rotation, log, unwound};
use crate::system::{Category, DofMap, Slot, State, System};
use crate::tensor::{Vec3, zeros};
use crate::threads::{self, PART};
use serde::{Deserialize, Serialize};
use std::ops::{Mul, Sub};

/// Energies of one state and the work of loads, gravity and motions so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Ledger {
    /// Kinetic energy
    pub kinetic: f64,
    /// Strain energy, springs included
    pub strain: f64,
    /// Work done from outside so far: by the trapezoidal rule from state to state, by Simpson's where
    /// steps have a stage in their middle
    pub external: f64,
    /// Energy taken by damping so far
    pub damped: f64,
    /// Energy stored in contacts: in penalties, and in elastic stick
    pub(crate) contact: f64,
    /// Energy taken by friction and damping of contacts so far
    pub(crate) friction: f64,
}

impl Ledger {
    /// kinetic + strain + damped - external, and contact + friction: constant in an exact solution.
    pub fn total(&self) -> f64 {
        (self.kinetic + self.strain + self.damped - self.external) + (self.contact + self.friction)
    }
}

/// A converged state with its forces, as it is booked.
#[derive(Clone, Copy)]
pub struct Entry<'a> {
    model: &'a Model,
    state: &'a State,
    system: &'a System,
    /// The forces of a linear stage; `None` in other stages
    linear: Option<&'a LinearisedSystem>,
    /// True in a rotating frame, whose centrifugal forces are loads. Stages with accelerations have none.
    is_rotating: bool,
}

impl<'a> Entry<'a> {
    /// A state with its forces in `assembly`.
    pub fn new(model: &'a Model, state: &'a State, assembly: &'a Assembly) -> Self {
        let is_rotating = assembly.stage.rotating;
        Self { model, state, system: &assembly.system, linear: assembly.linear(), is_rotating }
    }

    fn energy(&self) -> Energy {
        let internal = &self.system.force[Category::Internal as usize];
        match self.linear {
            None => self.model.energy(self.state),
            Some(linear) => linear.energy(self.model, self.state, internal),
        }
    }

    /// The strain energy.
    pub fn strain(&self) -> f64 {
        self.energy().strain
    }

    /// The force from outside at a slot: loads, centrifugal forces of a rotating frame, and the forces that hold or move
    /// constrained directions.
    fn outside(&self, slot: usize) -> Vec3 {
        let Self { system, is_rotating, .. } = *self;
        let dof_map: &DofMap = &system.pattern.dof_map;
        let load = system.part_of(Category::External, slot);
        let load = if is_rotating { load + system.part_of(Category::Inertia, slot) } else { load };
        match dof_map.is_plain(slot as Slot) {
            true => -load,
            false => dof_map.held_part(slot as Slot, system.total(slot)) - load,
        }
    }

    fn drives(&self) -> Vec<Drive> {
        self.model.drives(self.state, self.linear.map(|linear| &linear.origin))
    }
}

/// Keeps the account from step to step.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub struct Bookkeeper {
    ledger: Ledger,
    /// The total that an exact solution keeps; known while the account is open
    first: Option<f64>,
    /// The largest kinetic + strain energy, or work from outside, of the run so far
    scale: f64,
    q: Vec<Vec3>,
    unwrapped: Vec<Vec3>,
    force: Vec<Vec3>,
    drag: Vec<Vec3>,
    drives: Vec<Drive>,
    /// The middle of the step that is booked next
    #[serde(skip)]
    middle: Waypoint,
}

/// The middle of a step, through which work is integrated where a scheme has a stage there.
#[derive(Clone, Debug, Default)]
struct Waypoint {
    is_passed: bool,
    q: Vec<Vec3>,
    force: Vec<Vec3>,
    drag: Vec<Vec3>,
    drives: Vec<Drive>,
}

impl Bookkeeper {
    /// Notes the middle of the step that is booked next.
    pub fn pass_middle(&mut self, entry: Entry) {
        let Entry { state, system, .. } = entry;
        let Waypoint { is_passed, q, force, drag, drives } = &mut self.middle;
        *is_passed = true;
        threads::copy(q, &state.q);
        copy_outside(&entry, force);
        threads::copy(drag, &system.force[Category::Damping as usize]);
        // The forces of contacts in the middle are not remembered.
        *drives = if entry.model.contacts().is_some() { Vec::new() } else { entry.drives() };
    }

    /// Initial motions have set a scene in motion, in a stage that is opened next: the kinetic
    /// energy that is new belongs to the account.
    pub fn bring_in(&mut self, entry: Entry) {
        if let Some(first) = &mut self.first {
            *first += entry.energy().kinetic - self.ledger.kinetic;
        }
    }

    /// Motions have jumped in velocity where a stage begins, which is opened next: the kinetic energy that is new is
    /// the work of their impulses.
    pub fn book_velocity_jump(&mut self, entry: Entry) {
        if self.first.is_some() {
            self.ledger.external += entry.energy().kinetic - self.ledger.kinetic;
            self.scale = self.scale.max(self.ledger.external.abs());
        }
    }

    /// The strain energy has changed by this where what has no mass came into balance at once: that belongs to the
    /// account.
    pub fn shift(&mut self, change: f64) {
        if let Some(first) = &mut self.first {
            *first += change;
        }
    }

    /// Adds the work of the impulses by which prescribed velocities have jumped in the step that was added last, whose
    /// end without these jumps is given.
    pub fn add_impulse(&mut self, without_jumps: Entry) {
        self.ledger.external += self.ledger.kinetic - without_jumps.energy().kinetic;
        self.scale = self.scale.max(self.ledger.external.abs());
    }

    /// A stage begins whose work is not booked: the account begins anew behind it.
    pub fn close(&mut self) {
        self.first = None;
    }

    /// Opens a stage: energies are taken, with the work of free strains that jump where it begins.
    pub fn open(&mut self, entry: Entry) {
        let drives = entry.drives();
        if self.first.is_some() {
            let jumps = self.drives.iter().zip(&drives).filter(|(_, to)| to.acts_at_once);
            self.ledger.external += jumps.map(|(from, to)| trapezoid(from, to)).sum::<f64>();
        }
        self.drives = drives;
        copy_outside(&entry, &mut self.force);
        self.middle.is_passed = false;
        // Where nothing damps it is empty.
        threads::copy(&mut self.drag, &entry.system.force[Category::Damping as usize]);
        self.take(entry);
        self.first.get_or_insert(self.ledger.total());
    }

    /// Adds the work of the step that ends here.
    pub fn add_step(&mut self, entry: Entry) {
        let Entry { model, state, system, linear, .. } = entry;
        let Self { ledger, q, unwrapped, force, drag, middle, .. } = self;
        let through = std::mem::take(&mut middle.is_passed).then_some(&*middle);
        let (from, to) = ((&q[..], &unwrapped[..]), (&state.q[..], &state.unwrapped[..]));
        let middle = through.map(|middle| &middle.q[..]);
        let way = Way { kinds: &model.kinds, from, middle, to, is_linear: linear.is_some() };
        ledger.external += way.work(force, through.map(|middle| &middle.force[..]), |slot| entry.outside(slot));
        ledger.damped +=
            way.work(drag, through.map(|middle| &middle.drag[..]), |slot| system.part_of(Category::Damping, slot));
        let drives = entry.drives();
        for (k, (from, to)) in self.drives.iter().zip(&drives).enumerate() {
            ledger.external += match through.and_then(|middle| middle.drives.get(k)) {
                None => trapezoid(from, to),
                Some(middle) => {
                    let [before, within, after] = slopes(middle.value - from.value, to.value - from.value);
                    (from.force * before + 4.0 * middle.force * within + to.force * after) / 6.0
                }
            };
        }
        self.drives = drives;
        self.take(entry);
    }

    /// The energies of a state that is not accepted yet, with the work of the step that leads to it.
    pub fn ledger_at(&self, entry: Entry) -> Ledger {
        let mut ahead = self.clone();
        ahead.add_step(entry);
        ahead.ledger
    }

    /// The work from outside in the step to a state that is not accepted yet, by the forces there.
    pub fn work_by_end_forces(&self, entry: Entry) -> f64 {
        let mut ahead = self.clone();
        ahead.force.fill(Vec3::ZERO);
        ahead.drives.iter_mut().for_each(|drive| drive.force = 0.0);
        ahead.add_step(entry);
        2.0 * (ahead.ledger.external - self.ledger.external)
    }

    /// Books the energy that an artificial resistance took on the way to a state of rest: all that
    /// is missing from the `total` before.
    pub fn damp_to(&mut self, total: f64) {
        self.ledger.damped += total - self.ledger.total();
    }

    pub fn ledger(&self) -> Ledger {
        self.ledger
    }

    /// The total that an exact solution keeps; `None` where no account is open.
    pub fn first(&self) -> Option<f64> {
        self.first
    }

    /// The largest kinetic + strain energy, or work from outside, of the run so far.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Takes the energies of a state, and where it is.
    fn take(&mut self, entry: Entry) {
        threads::copy(&mut self.q, &entry.state.q);
        threads::copy(&mut self.unwrapped, &entry.state.unwrapped);
        let energy = entry.energy();
        (self.ledger.kinetic, self.ledger.strain) = (energy.kinetic, energy.strain);
        if let Some(contacts) = entry.model.contacts() {
            self.ledger.contact = contacts.energy(entry.state);
            self.ledger.friction = entry.state.contacts.dissipated;
        }
        self.scale = self.scale.max(energy.kinetic + energy.strain).max(self.ledger.external.abs());
    }
}

/// The way of all slots from one state to the next, by their unknowns and their unwrapped rotation
/// vectors where they have some.
struct Way<'a> {
    kinds: &'a [SlotKind],
    from: (&'a [Vec3], &'a [Vec3]),
    /// The unknowns in the middle, in the charts of the end, if they are known
    middle: Option<&'a [Vec3]>,
    to: (&'a [Vec3], &'a [Vec3]),
    /// True if forces are conjugate to the unknowns themselves, rotation vectors included
    is_linear: bool,
}

impl Way<'_> {
    /// The work of forces, which are `within` in the middle, and `after` where it ends; these take the
    /// place of those `before`. Where nothing damps, `before` is empty.
    fn work(&self, before: &mut [Vec3], within: Option<&[Vec3]>, after: impl Fn(usize) -> Vec3 + Send + Sync) -> f64 {
        let ((q0, wound0), (q1, wound1)) = (self.from, self.to);
        let of_part = |(number, before): (usize, &mut [Vec3])| {
            let mut sum = 0.0;
            for (slot, before) in (PART * number..).zip(before) {
                let after = after(slot);
                let before = put(before, after);
                let within = self.middle.zip(within).map(|(q, force)| (q[slot], force[slot]));
                if [before, after, within.map_or(Vec3::ZERO, |(_, force)| force)] == [Vec3::ZERO; 3] {
                    continue;
                }
                let unwrapped = *wound1.get(slot).unwrap_or(&q1[slot]) - *wound0.get(slot).unwrap_or(&q0[slot]);
                let (from, to) = ((q0[slot], before), (q1[slot], after));
                sum += match self.kinds[slot] {
                    SlotKind::Force | SlotKind::Moment => 0.0,
                    SlotKind::Rotation if !self.is_linear => turning_work(from, within, to, unwrapped),
                    SlotKind::Displacement | SlotKind::Sliding | SlotKind::Rotation => straight_work(from, within, to),
                };
            }
            sum
        };
        let mut sum = 0.0;
        threads::in_order(before.chunks_mut(PART).enumerate(), of_part, |part: f64| sum += part);
        sum
    }
}

/// Copies the forces from outside at all slots.
fn copy_outside(entry: &Entry, to: &mut Vec<Vec3>) {
    if to.len() != entry.state.q.len() {
        *to = zeros(entry.state.q.len());
    }
    threads::each_part(to, |start, part| {
        for (slot, force) in (start..).zip(part) {
            put(force, entry.outside(slot));
        }
    });
}

/// Puts a force in the place of another one, which it gives back. Most are zero and stay so, in
/// memory that nobody writes to.
#[inline(always)]
fn put(place: &mut Vec3, force: Vec3) -> Vec3 {
    let before = *place;
    if before != force {
        *place = force;
    }
    before
}

/// The rates at the start, in the middle and at the end of what goes to `middle` and to `end`, over
/// the length of the step: those of the parabola.
fn slopes<T>(middle: T, end: T) -> [T; 3]
where
    T: Copy + Sub<Output = T> + Mul<f64, Output = T>,
{
    [middle * 4.0 - end, end, end * 3.0 - middle * 4.0]
}

/// Work on a driven coordinate from one state to another, by the trapezoidal rule.
fn trapezoid(from: &Drive, to: &Drive) -> f64 {
    0.5 * (from.force + to.force) * (to.value - from.value)
}

/// Work of a force over the straight way of its unknown: by the trapezoidal rule, or by Simpson's
/// where the middle is known.
fn straight_work((q0, f0): (Vec3, Vec3), middle: Option<(Vec3, Vec3)>, (q1, f1): (Vec3, Vec3)) -> f64 {
    let Some((q, f)) = middle else { return 0.5 * (f0 + f1).dot(q1 - q0) };
    let [before, within, after] = slopes(q - q0, q1 - q0);
    (f0.dot(before) + 4.0 * f.dot(within) + f1.dot(after)) / 6.0
}

/// Work of a moment over a rotation, in a form that no change of chart disturbs: with the spatial
/// moment m = T^-1 f and the spatial rotation vector theta from the one state to the other. Where
/// the middle is known, by Simpson's rule with the spatial spin T(theta)^T dtheta/dt. `unwrapped`
/// tells how far the rotation has gone.
fn turning_work((p0, f0): (Vec3, Vec3), middle: Option<(Vec3, Vec3)>, (p1, f1): (Vec3, Vec3), unwrapped: Vec3) -> f64 {
    let [before, after] = [p0, p1].map(Rotation::new);
    let since = |rotation: &Rotation| log(rotation.r * before.r.transpose());
    let shortest = since(&after);
    let turned = if unwrapped.norm() > HALF_TURN { unwound(shortest, unwrapped) } else { shortest };
    let [m0, m1] = [before.t_inverse() * f0, after.t_inverse() * f1];
    let Some((p, f)) = middle else { return 0.5 * (m0 + m1).dot(turned) };
    let within = Rotation::new(p);
    let m = within.t_inverse() * f;
    let halfway = since(&within);
    let [at_start, at_middle, at_end] = slopes(halfway, turned);
    let power = |theta: Vec3, moment: Vec3, rate: Vec3| (Rotation::new(theta).t * moment).dot(rate);
    (m0.dot(at_start) + 4.0 * power(halfway, m, at_middle) + power(turned, m1, at_end)) / 6.0
}
