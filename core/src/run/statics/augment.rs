//! Load levels with contacts: augmentations of multipliers, and a stiffness that is softened where
//! Newton's method fails.
//!
//! A level begins with the stiffness of the level before. Once it is balanced, normal forces become
//! multipliers, the stiffness grows tenfold if gaps have not become ten times smaller, and the
//! level is balanced again, until every penetration is below what is allowed. Where this fails the
//! stiffness is divided by ten and kept, and the same level is tried again.
//!
//! The stiffness of stick grows with the forces, so that friction is at its limit after a small way.
//! Where the level fails, it begins with a softer stick, which then grows to what it was in steps
//! through balanced states: all points find the way in which they slide. Where all that holds a part
//! slides, the tangent is given a stiffness against sliding.

use crate::effect::{ContactChange, Contacts};
use crate::integrate::Equilibrium;
use crate::kernel::Weights;
use crate::run::distance::distance;
use crate::run::stage_run::StageRun;
use crate::scalar::CompressedField;
use crate::solve::NewtonFailure;
use crate::system::State;

/// A stiffness of stick that has become too small is raised to this multiple of what is needed.
const STICK_RESERVE: f64 = 2.0;

/// The motion, over the length of the scene or in radians, that firmer contacts may make in any case.
const FAR: f64 = 1e-3;

/// A part of a stiffness that is all of it.
const ALL_BUT_ROUND_OFF: f64 = 1.0 - 1e-12;

/// The power of the growth of stiffness that is tried after a failure.
const GROWTH_POWER_AFTER_FAILURE: f64 = 0.25;

/// The power of the growth of stiffness that is tried after a success.
const GROWTH_POWER_AFTER_SUCCESS: f64 = 1.4;

/// The least growth of stiffness that is tried.
const SMALLEST_GROWTH: f64 = 1.05;

/// Augmentations of a level, at most.
const MOST_AUGMENTATIONS: usize = 20;

/// Augmentations of a level after these, at most, which make small motions exact.
const MOST_REFINEMENTS: usize = 6;

/// Factor of the stiffness, and of gaps below which it stays.
const GROWTH: f64 = 10.0;

/// The smallest factor of the first stiffness of a level.
const SOFTEST: f64 = 1e-4;

/// Factors below this one become no smaller, but for round-off.
const NEARLY_SOFTEST: f64 = 3.0 * SOFTEST;

/// The largest factor of the first stiffness of a level.
const STIFFEST_START: f64 = 1e3;

/// The largest factor of the stiffness.
const STIFFEST: f64 = 1e6;

/// A level that takes so many augmentations makes the next begin with a larger stiffness.
const MANY_AUGMENTATIONS: usize = 3;

/// Attempts at a level with a stiffer contact of beams, at most.
const MOST_STIFFENINGS: usize = 2;

/// Attempts at a level that looks at more pairs of beams, or at more surfaces, at most.
const MOST_LISTS: usize = 12;

/// The way in which contacts become firmer from one balanced state to the next.
#[derive(Clone, Copy, Debug)]
struct Stiffening {
    /// Normal forces become multipliers.
    penetrates: bool,
    /// The stiffness of penetrations grows.
    raises: bool,
    /// The stiffness of stick grows.
    sticks_softly: bool,
}

/// What the attempts at a level have changed so far.
struct LevelAttempts {
    /// The stiffness of penetrations with which the level before ended
    first_factor: f64,
    /// The part of the stiffness of stick with which an attempt begins
    softened_stick: f64,
    /// Attempts with a stiffer contact of beams
    stiffenings: usize,
    /// Attempts that looked at more pairs of beams, or at more surfaces
    lists: usize,
    /// True if points that slid go on sliding in the first tangent
    goes_on: bool,
    /// True if the tangent resists sliding and opening
    resists: bool,
    /// True if that has been tried
    has_resisted: bool,
    /// An attempt with the stiffest contact, where the first points with friction come into contact
    stiff_start: StiffStart,
}

/// Whether a level has been tried with the stiffest contact.
#[derive(Clone, Copy, PartialEq)]
enum StiffStart {
    Possible,
    /// In the last attempt
    Tried,
    /// Before others, softer ones
    Over,
}

impl StageRun<'_> {
    /// One attempt at a load factor, where contacts may act: first as stiff as the level before,
    /// then softer.
    pub(super) fn attempt_with_contacts(&mut self, load: f64) -> Result<(), NewtonFailure> {
        let mut attempts = LevelAttempts {
            first_factor: self.good.contacts.first_factor,
            softened_stick: 1.0,
            stiffenings: 0,
            lists: 0,
            goes_on: true,
            resists: false,
            has_resisted: false,
            stiff_start: StiffStart::Possible,
        };
        loop {
            let contacts = &mut self.state.contacts;
            contacts.stick_part = attempts.softened_stick;
            (contacts.goes_on, contacts.resists) = (attempts.goes_on, attempts.resists);
            let attempt = self.attempt_once(load).and_then(|()| self.augment());
            (self.state.contacts.goes_on, self.state.contacts.resists) = (true, false);
            // A part that has left all that held it has come to no balance of its own.
            let has_left = attempt.is_ok() && attempts.resists && !self.state_touches();
            let attempt = if has_left { Err(NewtonFailure::Singular(None)) } else { attempt };
            let failure = match attempt.and_then(|()| self.refuse_missed()) {
                Ok(()) => {
                    if attempts.softened_stick < 1.0 {
                        self.state.contacts.first_factor = self.good.contacts.first_factor;
                    }
                    return Ok(());
                }
                Err(failure) => failure,
            };
            if !self.tries_again(&failure, &mut attempts) {
                // The next level, which is a smaller one, begins as the present one did.
                self.set_first_factor(attempts.first_factor);
                return Err(failure);
            }
        }
    }

    /// After a failed attempt: goes back to the last good state, and changes what may help; `false`
    /// if nothing is left to try.
    fn tries_again(&mut self, failure: &NewtonFailure, attempts: &mut LevelAttempts) -> bool {
        if attempts.lists < MOST_LISTS && self.looks_at_more() {
            attempts.lists += 1;
            return true;
        }
        if !may_depend_on_stiffness(failure) {
            return false;
        }
        if self.newton.was_shortened {
            attempts.stiffenings += 1;
            if attempts.stiffenings <= MOST_STIFFENINGS {
                self.stiffen();
            }
            return attempts.stiffenings <= MOST_STIFFENINGS;
        }
        let touched = self.good.contacts.touches();
        if !touched && !self.state_touches() {
            return false;
        }
        let is_stiff = self.good.contacts.first_factor > NEARLY_SOFTEST;
        let sticks_firmly = self.rubs() && attempts.softened_stick > NEARLY_SOFTEST;
        let may_begin_stiffly = self.rubs() && !touched && self.good.contacts.first_factor < STIFFEST_START;
        attempts.resists = false;
        if attempts.goes_on && touched {
            // Where all points slide nothing may hold a part.
            attempts.goes_on = false;
        } else if (matches!(failure, NewtonFailure::Singular(_)) || self.newton.has_run_away(self.model))
            && !attempts.has_resisted
        {
            attempts.has_resisted = true;
            attempts.resists = true;
        } else if may_begin_stiffly && attempts.stiff_start == StiffStart::Possible {
            // Nothing rubs before it is pressed, and a soft contact is pressed only by a long way.
            attempts.stiff_start = StiffStart::Tried;
            self.set_first_factor(STIFFEST_START);
            self.counters.contacts.stiffenings += 1;
        } else if is_stiff || sticks_firmly {
            if sticks_firmly {
                attempts.softened_stick /= GROWTH;
            }
            if std::mem::replace(&mut attempts.stiff_start, StiffStart::Over) == StiffStart::Tried {
                self.set_first_factor(attempts.first_factor);
            }
            self.set_first_factor((self.good.contacts.first_factor / GROWTH).max(SOFTEST));
            self.counters.contacts.softenings += 1;
        } else {
            return false;
        }
        self.state.copy_all_but_rates(self.good);
        true
    }

    /// True if some contact has friction.
    pub(super) fn rubs(&self) -> bool {
        self.model.contacts().is_some_and(|contacts| contacts.rubs())
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
        self.model.contacts().is_some_and(|contacts| contacts.survey(self.state, f64::INFINITY).points > 0)
    }

    /// Sets the stiffness with which levels begin, for the last good state and for the present one.
    fn set_first_factor(&mut self, factor: f64) {
        for contacts in [&mut self.good.contacts, &mut self.state.contacts] {
            contacts.first_factor = factor;
            contacts.factor = factor;
        }
    }

    /// From a balanced state to one whose penetrations are small, and whose points stick firmly.
    fn augment(&mut self) -> Result<(), NewtonFailure> {
        let Some(contacts) = self.model.contacts() else { return Ok(()) };
        self.contact_change = ContactChange::None;
        // That of the first balance: what moves by its penetration alone would be held ever more tightly.
        let way = contacts.largest_displacement(self.state);
        let mut survey = contacts.survey(self.state, f64::INFINITY);
        if survey.points > 0 || self.good.contacts.touches() {
            self.newton.begin_anew();
        }
        // The first solution tells whether the step follows the path.
        let first = std::mem::take(&mut self.newton.first);
        let contraction = self.newton.contraction;
        let mut augmentations = 0;
        let mut before = 0.0;
        let mut growth = GROWTH;
        let mut is_solved_again = false;
        loop {
            let penetrates = survey.violation > 1.0;
            if !penetrates {
                raise_stick(contacts, self.state);
            }
            let sticks_softly = self.state.contacts.stick_part < ALL_BUT_ROUND_OFF;
            if !penetrates && !sticks_softly {
                break;
            }
            if penetrates && augmentations == MOST_AUGMENTATIONS {
                let depth = -survey.gap;
                return Err(NewtonFailure::Penetrates { slot: survey.slot as usize, depth });
            }
            let next =
                Stiffening { penetrates, raises: penetrates && survey.violation * GROWTH > before, sticks_softly };
            self.solve_firmer(next, &mut growth)?;
            is_solved_again = true;
            if penetrates {
                before = survey.violation;
                augmentations += 1;
            }
            survey = contacts.survey(self.state, f64::INFINITY);
        }
        if is_solved_again {
            self.refuse_far_steps()?;
        }
        self.refine(way)?;
        self.end_augmentations(first, contraction, augmentations)
    }

    /// Balances the state anew, with other contacts than before.
    fn balance_again(&mut self) -> Result<(), NewtonFailure> {
        let Self { assembly, newton, state, model, counters, .. } = &mut *self;
        newton.begin_anew();
        newton.solve(model, assembly, state, &Equilibrium, None, &mut counters.work)
    }

    /// Makes penetrations small next to the way of the nodes in contact, as long as that succeeds.
    fn refine(&mut self, way: f64) -> Result<(), NewtonFailure> {
        let Some(contacts) = self.model.contacts() else { return Ok(()) };
        let mut last = f64::INFINITY;
        for done in 0..MOST_REFINEMENTS {
            let violation = contacts.survey(self.state, way).violation;
            if violation <= 1.0 {
                break;
            }
            let before = self.state.clone();
            let was_shortened = self.newton.was_shortened;
            contacts.augment(self.state);
            // Where the stiffness is large enough multipliers alone do.
            if done > 0 && violation * GROWTH > last {
                let factor = &mut self.state.contacts.factor;
                *factor = (*factor * GROWTH).min(STIFFEST);
            }
            last = violation;
            self.counters.contacts.augmentations += 1;
            let solved = self.balance_again();
            if let Err(interrupted @ NewtonFailure::Interrupted(_)) = solved {
                return Err(interrupted);
            }
            let stays = solved.and_then(|()| self.refuse_far_steps()).and_then(|()| self.refuse_passing());
            if stays.is_err() || self.slides_away(&before) {
                self.state.copy_from(&before);
                self.newton.was_shortened = was_shortened;
                self.assembly.forget();
                self.assembly.evaluate(self.state, Weights::NONE, None);
                break;
            }
        }
        Ok(())
    }

    /// Balances the state with firmer contacts. Their stiffness grows by the factor `growth`, or by
    /// less where this fails.
    fn solve_firmer(&mut self, next: Stiffening, growth: &mut f64) -> Result<(), NewtonFailure> {
        let grows = next.raises || next.sticks_softly;
        // What does not grow is tried once.
        let before = grows.then(|| self.state.clone());
        loop {
            if let Some(contacts) = self.model.contacts()
                && next.penetrates
            {
                // Whether points have come or gone is judged by the memory of the last good state.
                contacts.augment(self.state);
            }
            let contacts = &mut self.state.contacts;
            if next.raises {
                contacts.factor = (contacts.factor * *growth).min(STIFFEST);
            }
            if next.sticks_softly {
                contacts.stick_part = (contacts.stick_part * *growth).min(1.0);
            }
            match self.balance_again() {
                Ok(()) => {
                    let slid_from = before.as_ref().filter(|before| self.slides_away(before));
                    match slid_from {
                        Some(before) if *growth > SMALLEST_GROWTH => {
                            *growth = growth.powf(GROWTH_POWER_AFTER_FAILURE);
                            self.state.copy_from(before);
                            continue;
                        }
                        // It slides however little the stiffness grows.
                        Some(_) => *growth = GROWTH,
                        None => *growth = growth.powf(GROWTH_POWER_AFTER_SUCCESS).min(GROWTH),
                    }
                    return Ok(());
                }
                Err(failure) => match &before {
                    Some(before) if may_depend_on_stiffness(&failure) && *growth > SMALLEST_GROWTH => {
                        *growth = growth.powf(GROWTH_POWER_AFTER_FAILURE);
                        self.state.copy_from(before);
                    }
                    _ => return Err(failure),
                },
            }
        }
    }

    /// True if firmer contacts with friction have let a part go further than the level has moved it before.
    fn slides_away(&self, before: &State) -> bool {
        let Self { model, good, state, .. } = self;
        self.rubs() && distance(model, before, state) > distance(model, good, before).max(FAR)
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

/// Raises the stiffness of stick of contacts whose points would reach the limit of friction too late.
/// The stiffness that acts does not grow yet.
fn raise_stick(contacts: &dyn Contacts, state: &mut State) {
    let needed = contacts.needed_stick_factors(state);
    let memory = &mut state.contacts;
    let mut largest_growth = 1.0f64;
    memory.full_stick_factors.resize(needed.len(), 1.0);
    for (full, needed) in memory.full_stick_factors.iter_mut().zip(needed) {
        if needed > *full {
            let before = std::mem::replace(full, STICK_RESERVE * needed);
            largest_growth = largest_growth.max(*full / before);
        }
    }
    memory.stick_part /= largest_growth;
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
        | NewtonFailure::SurfaceTurnsTooFar { .. }
        | NewtonFailure::NotFinite { .. }
        | NewtonFailure::StepTooSmall { .. }
        | NewtonFailure::Interrupted(_) => false,
    }
}
