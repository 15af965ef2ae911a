//! The energy account of friction: a step in which friction takes more than there is has jumped.

use crate::run::energy::{Bookkeeper, Entry};
use crate::run::stage_run::StageRun;

/// The work of friction in a step that is not looked at, over the largest energy of the stage.
const NEGLIGIBLE: f64 = 1e-6;

/// The energy that a step may miss for what friction takes, over all that it moves. The trapezoidal
/// rule is coarse where a step is.
const LARGEST_MISSING_SHARE: f64 = 0.5;

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
        let books_all = !stage.is_linear() && !stage.stage().rotating && stage.state.fading.is_empty();
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
        let (Some(bookkeeper), Some(contacts)) = (&self.bookkeeper, stage.model.contacts()) else { return false };
        let taken = -contacts.friction_work(stage.state);
        if taken <= NEGLIGIBLE * bookkeeper.scale() {
            return false;
        }
        // Surfaces that are driven do work by the forces in memory.
        let mut ahead = stage.state.clone();
        contacts.augment(&mut ahead);
        let entry = Entry::new(stage.model, &ahead, &stage.assembly);
        let [before, after] = [bookkeeper.ledger(), bookkeeper.ledger_at(entry)];
        let stored = after.strain - before.strain;
        // A load may pass from one support to another at the very start of a step.
        let given = (after.external - before.external).max(bookkeeper.work_by_end_forces(entry));
        // Normal forces do work that is not booked while gaps change within what is allowed.
        let unbooked = contacts.survey(stage.state).work_in_penetration;
        stored + taken - given > LARGEST_MISSING_SHARE * (stored.abs() + taken + given.abs()) + unbooked
    }

    /// True once, for the first warning of the stage.
    pub fn may_warn(&mut self) -> bool {
        !std::mem::replace(&mut self.has_warned, true)
    }
}
