//! Load levels with contacts: augmentations of multipliers, and a stiffness that is softened where
//! Newton's method fails.
//!
//! A level begins with the stiffness of the level before. Once it is balanced, normal forces become
//! multipliers, the stiffness grows tenfold if gaps have not become ten times smaller, and the
//! level is balanced again, until every penetration is below what is allowed. Where this fails the
//! stiffness is divided by ten and kept, and the same level is tried again.

use crate::effect::ContactChange;
use crate::integrate::Equilibrium;
use crate::run::stage_run::StageRun;
use crate::scalar::CompressedField;
use crate::solve::NewtonFailure;

/// Augmentations of a level, at most.
const MOST_AUGMENTATIONS: usize = 12;

/// Factor of the stiffness, and of gaps below which it stays.
const GROWTH: f64 = 10.0;

/// The smallest factor of the first stiffness of a level.
const SOFTEST: f64 = 1e-4;

/// The largest factor of the first stiffness of a level.
const STIFFEST_START: f64 = 1e3;

/// The largest factor of the stiffness.
const STIFFEST: f64 = 1e6;

/// A level that takes so many augmentations makes the next begin with a larger stiffness.
const MANY_AUGMENTATIONS: usize = 3;

/// Attempts at a level with a stiffer contact of beams, at most.
const MOST_STIFFENINGS: usize = 2;

/// Attempts at a level with more pairs of beams, at most.
const MOST_LISTS: usize = 4;

impl StageRun<'_> {
    /// One attempt at a load factor, where contacts may act: first as stiff as the level before,
    /// then softer.
    pub(super) fn attempt_with_contacts(&mut self, load: f64) -> Result<(), NewtonFailure> {
        let first_factor = self.good.contacts.first_factor;
        let mut stiffenings = 0;
        let mut lists = 0;
        loop {
            let attempt = self.attempt_once(load).and_then(|()| self.augment());
            let failure = match attempt.and_then(|()| self.refuse_missed()) {
                Ok(()) => {
                    self.state.contacts.goes_on = true;
                    return Ok(());
                }
                Err(failure) => failure,
            };
            let may_soften = may_depend_on_stiffness(&failure);
            if lists < MOST_LISTS && self.looks_at_more() {
                lists += 1;
                continue;
            }
            if may_soften && self.newton.was_shortened {
                if stiffenings == MOST_STIFFENINGS {
                    self.give_up(first_factor);
                    return Err(failure);
                }
                stiffenings += 1;
                self.stiffen();
                continue;
            }
            if may_soften && self.good.contacts.goes_on && self.good.contacts.touches() {
                // Where all points slide nothing may hold a part.
                self.good.contacts.goes_on = false;
                self.state.copy_all_but_rates(self.good);
                continue;
            }
            let touched = self.good.contacts.touches() || self.state_touches();
            if !(may_soften && touched && self.good.contacts.first_factor > SOFTEST * GROWTH.sqrt()) {
                self.give_up(first_factor);
                return Err(failure);
            }
            self.set_first_factor(self.good.contacts.first_factor / GROWTH);
            self.counters.contacts.softenings += 1;
            self.state.copy_all_but_rates(self.good);
        }
    }

    /// Lets the next level, which is a smaller one, begin as the present one did: with this stiffness
    /// and points that go on sliding.
    fn give_up(&mut self, first_factor: f64) {
        self.set_first_factor(first_factor);
        self.good.contacts.goes_on = true;
    }

    /// Goes back to the last good state with a stiffer contact: a soft one cannot keep beams apart,
    /// whose force ends where centre lines meet.
    fn stiffen(&mut self) {
        self.set_first_factor((self.good.contacts.first_factor * GROWTH).min(STIFFEST_START));
        self.counters.contacts.stiffenings += 1;
        self.state.copy_all_but_rates(self.good);
    }

    /// True if some point of the present iterate has a force.
    fn state_touches(&self) -> bool {
        self.model.contacts().is_some_and(|contacts| contacts.survey(self.state).points > 0)
    }

    /// Sets the stiffness with which levels begin, for the last good state and for the present one.
    fn set_first_factor(&mut self, factor: f64) {
        for contacts in [&mut self.good.contacts, &mut self.state.contacts] {
            contacts.first_factor = factor;
            contacts.factor = factor;
        }
    }

    /// From a balanced state to one whose penetrations are small.
    fn augment(&mut self) -> Result<(), NewtonFailure> {
        let Some(contacts) = self.model.contacts() else { return Ok(()) };
        self.contact_change = ContactChange::None;
        let mut survey = contacts.survey(self.state);
        if survey.points > 0 || self.good.contacts.touches() {
            self.newton.begin_anew();
        }
        // The first solution tells whether the step follows the path.
        let first = std::mem::take(&mut self.newton.first);
        let contraction = self.newton.contraction;
        let mut augmentations = 0;
        let mut before = 0.0;
        while survey.violation > 1.0 {
            if augmentations == MOST_AUGMENTATIONS {
                let depth = -survey.gap;
                return Err(NewtonFailure::Penetrates { slot: survey.slot as usize, depth });
            }
            // Whether points have come or gone is judged by the memory of the last good state.
            contacts.augment(self.state);
            let factor = &mut self.state.contacts.factor;
            if survey.violation * GROWTH > before {
                *factor = (*factor * GROWTH).min(STIFFEST);
            }
            before = survey.violation;
            augmentations += 1;
            self.newton.begin_anew();
            let Self { assembly, newton, state, model, counters, .. } = &mut *self;
            newton.solve(model, assembly, state, &Equilibrium, None, &mut counters.work)?;
            survey = contacts.survey(self.state);
        }
        self.end_augmentations(first, contraction, augmentations)
    }

    fn end_augmentations(
        &mut self,
        first: CompressedField<3>,
        contraction: f64,
        augmentations: usize,
    ) -> Result<(), NewtonFailure> {
        let Some(contacts) = self.model.contacts() else { return Ok(()) };
        self.newton.first = first;
        self.newton.contraction = contraction;
        self.counters.contacts.augmentations += augmentations as u64;
        self.refuse_passing()?;
        self.contact_change = contacts.change(self.good, self.state);
        self.counters.contacts.changes += u64::from(self.contact_change != ContactChange::None);
        if augmentations >= MANY_AUGMENTATIONS {
            let grown = self.good.contacts.first_factor * GROWTH;
            self.state.contacts.first_factor = grown.min(STIFFEST_START);
        }
        Ok(())
    }
}

/// True for failures that another first stiffness of contacts may avoid.
fn may_depend_on_stiffness(failure: &NewtonFailure) -> bool {
    match failure {
        NewtonFailure::NotConverged { .. }
        | NewtonFailure::Singular(_)
        | NewtonFailure::Penetrates { .. }
        | NewtonFailure::Passes { .. } => true,
        NewtonFailure::LeapsTooFar { .. }
        | NewtonFailure::Leaves { .. }
        | NewtonFailure::TurnsTooFar { .. }
        | NewtonFailure::NotFinite { .. }
        | NewtonFailure::StepTooSmall { .. }
        | NewtonFailure::Interrupted(_) => false,
    }
}
