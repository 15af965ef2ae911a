//! Points that have come into contact in a level: what they moved before they touched counts as
//! sliding.

/// The part of the friction of a contact that its new points have, beyond which they decide it.
const DECISIVE: f64 = 0.5;

/// The part of its limit up to which friction at a new point does not count.
const NEGLIGIBLE: f64 = 0.05;

/// Sums of the amounts of friction at the points of a contact.
#[derive(Clone, Copy, Default)]
struct Friction {
    /// At points that were apart when the level began
    of_new: f64,
    /// At all points
    of_all: f64,
}

/// The friction of all contacts at the end of a level.
pub(super) struct LateTouch {
    of_contacts: Vec<Friction>,
}

impl LateTouch {
    /// Of so many contacts.
    pub fn new(contacts: usize) -> Self {
        Self { of_contacts: vec![Friction::default(); contacts] }
    }

    /// Adds a point of a contact: its friction, the limit of it, and whether the point was apart when
    /// the level began.
    pub fn add(&mut self, contact: usize, friction: f64, limit: f64, was_apart: impl FnOnce() -> bool) {
        let sums = &mut self.of_contacts[contact];
        sums.of_all += friction;
        if friction > NEGLIGIBLE * limit && was_apart() {
            sums.of_new += friction;
        }
    }

    /// True if new points have most of the friction of some contact.
    pub fn is_decisive(&self) -> bool {
        self.of_contacts.iter().any(|sums| sums.of_new > DECISIVE * sums.of_all)
    }
}
