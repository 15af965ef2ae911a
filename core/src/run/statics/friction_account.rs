//! The energy account of friction: a step in which friction takes more than there is has jumped.

use crate::run::energy::{Bookkeeper, Entry};
use crate::run::stage_run::StageRun;

/// The work of friction in a step that is not looked at, over the largest energy of the stage.
const NEGLIGIBLE: f64 = 1e-6;

/// The energy that a step may miss for what friction takes, over all that it moves. The trapezoidal
/// rule is coarse where a step is.
const LARGEST_MISSING_SHARE: f64 = 0.5;

/// The energy that a step may leave over, by the forces at its end, over all that it moves. What a spring takes along leaves
/// a third.
const LARGEST_SURPLUS: f64 = 0.4;

/// The energies of a step.
struct Exchange {
    /// By loads and motions: by the forces at the end of the step, if that is more, since a load may pass from one
    /// support to another at the very start
    given: f64,
    /// By friction
    taken: f64,
    /// As strain
    stored: f64,
    /// The work of normal forces that is not booked while gaps change within what is allowed
    unbooked: f64,
}

impl Exchange {
    /// A part of all that is moved.
    fn part(&self, part: f64) -> f64 {
        part * (self.stored.abs() + self.taken + self.given.abs()) + self.unbooked
    }

    fn is_overdrawn(&self) -> bool {
        self.stored + self.taken - self.given > self.part(LARGEST_MISSING_SHARE)
    }

    fn has_surplus(&self) -> bool {
        self.given - self.stored - self.taken > self.part(LARGEST_SURPLUS)
    }
}

/// The account of a static stage.
pub(super) struct FrictionAccount {
    /// `None` where nothing rubs, or forces act whose work is not booked
    bookkeeper: Option<Bookkeeper>,
    /// True if the stage has warned of a step that was accepted all the same
    has_warned: bool,
}

impl FrictionAccount {
    /// At the present state of a stage, whose forces are known.
    pub fn open(stage: &StageRun) -> Self {
        let books_all = !stage.is_linear() && stage.state.fading.is_empty();
        let bookkeeper = (stage.rubs() && books_all).then(|| {
            let mut bookkeeper = Bookkeeper::default();
            bookkeeper.open(Entry::new(stage.model, stage.state, &stage.assembly));
            bookkeeper
        });
        Self { bookkeeper, has_warned: false }
    }

    /// Adds the step to an accepted state.
    pub fn add_step(&mut self, stage: &StageRun) {
        if let Some(bookkeeper) = &mut self.bookkeeper {
            bookkeeper.add_step(Entry::new(stage.model, stage.state, &stage.assembly));
        }
    }

    /// True if friction and strain take far more energy on the way to a balanced state than loads and
    /// motions give: no path of equilibrium leads there.
    pub fn is_overdrawn(&self, stage: &StageRun) -> bool {
        let taken = stage.model.contacts().map_or(0.0, |contacts| -contacts.friction_work(stage.state));
        let is_notable = self.bookkeeper.as_ref().is_some_and(|books| taken > NEGLIGIBLE * books.scale());
        is_notable && self.exchange(stage).is_some_and(|exchange| exchange.is_overdrawn())
    }

    /// True if loads and motions give far more energy on the way to a balanced state than friction and strain take:
    /// what is left would set parts in motion.
    pub fn has_surplus(&self, stage: &StageRun) -> bool {
        self.exchange(stage).is_some_and(|exchange| exchange.has_surplus())
    }

    /// The energies on the way to a balanced state; `None` without an account.
    fn exchange(&self, stage: &StageRun) -> Option<Exchange> {
        let (bookkeeper, contacts) = (self.bookkeeper.as_ref()?, stage.model.contacts()?);
        let taken = -contacts.friction_work(stage.state);
        // Surfaces that are driven do work by the forces in memory.
        let mut ahead = stage.state.clone();
        contacts.augment(&mut ahead);
        let entry = Entry::new(stage.model, &ahead, &stage.assembly);
        let [before, after] = [bookkeeper.ledger(), bookkeeper.ledger_at(entry)];
        let stored = after.strain - before.strain;
        let given = (after.external - before.external).max(bookkeeper.work_by_end_forces(entry));
        let unbooked = contacts.survey(stage.state, f64::INFINITY).work_in_penetration;
        Some(Exchange { given, taken, stored, unbooked })
    }

    /// True once, for the first warning of the stage.
    pub fn may_warn(&mut self) -> bool {
        !std::mem::replace(&mut self.has_warned, true)
    }
}
