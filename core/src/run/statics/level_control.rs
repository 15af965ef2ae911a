//! Load control: equal levels, approached in smaller steps where Newton fails, and along the path
//! where those fail too.

use super::arc_length::{Arrival, detour};
use super::begin;
use super::checkpoint::LevelsCheckpoint;
use super::friction_account::FrictionAccount;
use super::levels::{Levels, ReachedBy};
use super::rest;
use super::stability::{Stability, conclude, tell_of_points};
use crate::effect::ContactChange;
use crate::run::checkpoint::AnalysisCheckpoint;
use crate::run::failure::Failure;
use crate::run::plan::Approach;
use crate::run::spatial::SpatialLook;
use crate::run::stage_run::{Analysis, StageRun};
use crate::solve::{NewtonFailure, Signature};
use crate::warning::WarningKind;

/// The words about a stage that took over much from a motion.
const IN_MOTION: &str = " (the stage started from a moving state, whose inertia forces are ramped down: `[damping]` in the previous dynamic \
     stage makes them smaller)";

/// The part of a level up to which a step may be long in which a point with friction comes into
/// contact: so much of a level may count as sliding that was none.
const LONGEST_STEP_OF_TOUCH: f64 = 1.0 / 32.0;

/// The outcome of a step.
enum StepOutcome {
    /// Balance, with these signs of pivots
    Good(Option<Signature>),
    /// Balance, perhaps on another branch
    Jumped(Option<Signature>),
    /// Balance, by an iteration that has not gone straight to it
    Strayed(Option<Signature>),
    /// Balance, with more friction than energy: perhaps on another branch
    Overdrawn(Option<Signature>),
    /// Balance, where something has moved much further than before: perhaps nothing holds it
    SlidAway(Option<Signature>),
    /// No balance
    Failed(NewtonFailure),
}

/// How a level was reached.
#[derive(PartialEq)]
enum Reached {
    /// By load control
    Level,
    /// Along the path, which has shown its rows
    Along,
    /// The stage's `until` came true on the way.
    Over,
}

/// A static stage by load levels.
pub(in crate::run) struct LoadLevels<'s, 'r> {
    pub(crate) stage: &'s mut StageRun<'r>,
    /// The number of levels
    pub(crate) steps: usize,
    pub(crate) approach: Approach,
}

impl<'r> Analysis<'r> for LoadLevels<'_, 'r> {
    fn stage(&mut self) -> &mut StageRun<'r> {
        self.stage
    }

    fn run(&mut self) -> Result<(), Failure> {
        match self.stage.resumed.take() {
            Some(AnalysisCheckpoint::Levels(checkpoint)) => self.take_up(checkpoint),
            None | Some(AnalysisCheckpoint::ArcLength(_) | AnalysisCheckpoint::Dynamics(_)) => self.begin(),
        }
    }

    fn judge(&mut self) {
        self.stage.warn_of_standstill();
        self.stage.warn_of_layers();
        self.stage.warn_of_hidden_penetration();
        self.stage.warn_of_soft_stick_at_rest();
    }
}

impl LoadLevels<'_, '_> {
    /// Goes through all levels.
    fn begin(&mut self) -> Result<(), Failure> {
        let mut space = SpatialLook::default();
        let loose = begin(self.stage, &mut space)?;
        let levels = Levels::new(self.stage.state.kept(), self.steps, self.approach);
        let stability = Stability::new(self.stage);
        let at_start = stability.signature;
        let begins_unbalanced = !self.stage.is_nearly_balanced();
        self.stage.good.copy_from(self.stage.state);
        self.stage.begin_to_watch_contacts();
        let control = LevelControl::new(self.stage, space, levels, stability, at_start);
        LevelControl { begins_unbalanced, loose, ..control }.go(0, self.steps)
    }

    /// Goes on from where a checkpoint has left the stage.
    fn take_up(&mut self, checkpoint: LevelsCheckpoint) -> Result<(), Failure> {
        let LevelsCheckpoint { reached, levels, follows_signs, is_given, unflattened, signature, at_start } =
            checkpoint;
        let stability = Stability::again(follows_signs, signature);
        self.stage.unflattened.clone_from(&unflattened);
        if is_given {
            self.stage.make_again(|stage| Stability::follow_again(stage, unflattened));
        }
        LevelControl::new(self.stage, SpatialLook::default(), levels, stability, at_start).go(reached, self.steps)
    }
}

/// Load control under way.
struct LevelControl<'s, 'r> {
    stage: &'s mut StageRun<'r>,
    space: SpatialLook,
    levels: Levels,
    stability: Stability,
    friction_account: FrictionAccount,
    /// The signs of pivots before the first level
    at_start: Option<Signature>,
    /// True until the first step if the start is out of balance, and no state of the path: what acts all at once leads away
    /// from it
    begins_unbalanced: bool,
    /// The mechanism that nothing holds before the first level
    loose: Option<Failure>,
    /// The load factor by which points with friction have touched that do not in the last good state
    touch: Option<f64>,
}

impl<'s, 'r> LevelControl<'s, 'r> {
    /// From a balanced state that something holds.
    fn new(
        stage: &'s mut StageRun<'r>,
        space: SpatialLook,
        levels: Levels,
        stability: Stability,
        at_start: Option<Signature>,
    ) -> Self {
        let friction_account = FrictionAccount::open(stage);
        let (begins_unbalanced, loose, touch) = (false, None, None);
        Self { stage, space, levels, stability, friction_account, at_start, begins_unbalanced, loose, touch }
    }

    /// Goes through the levels after the first `reached` ones.
    fn go(&mut self, reached: usize, steps: usize) -> Result<(), Failure> {
        for number in reached + 1..=steps {
            self.offer_checkpoint(number - 1)?;
            let reached = self.reach(number as f64 / steps as f64)?;
            if reached == Reached::Level {
                self.stage.counters.steps += 1;
                self.stage.watch_contacts();
                self.stage.show()?;
            }
            if reached == Reached::Over || self.stage.is_over() {
                break;
            }
        }
        // What is linear keeps the tangent of its start.
        let signature = if self.stage.is_linear() { self.at_start } else { self.stability.signature };
        conclude(self.stage, &mut self.space, signature, false)
    }

    /// Shows the observer where the stage is, if it wants that. Before the first level a mechanism
    /// may be known that levels hold: the stage is then begun again.
    fn offer_checkpoint(&mut self, reached: usize) -> Result<(), Failure> {
        if reached == 0 {
            return Ok(());
        }
        let Self { stage, levels, stability, at_start, .. } = self;
        let is_given = stage.newton.is_given(&stage.assembly.system);
        let unflattened = std::mem::take(&mut stage.unflattened);
        let offered = stage.offer_checkpoint(|| {
            AnalysisCheckpoint::Levels(LevelsCheckpoint {
                reached,
                levels: levels.clone(),
                follows_signs: stability.counts(),
                is_given,
                unflattened: unflattened.clone(),
                signature: stability.signature,
                at_start: *at_start,
            })
        });
        stage.unflattened = unflattened;
        offered
    }

    /// Goes from the last good state to the load factor `target`: at once, in smaller steps, or
    /// along the path.
    fn reach(&mut self, target: f64) -> Result<Reached, Failure> {
        debug_assert!(
            self.stage.state.q == self.stage.good.q && self.stage.state.load == self.stage.good.load,
            "the last state is not the good one"
        );
        if let Some(loose) = self.loose.take() {
            return self.rest_at(target, loose);
        }
        while self.stage.good.load < target {
            let next = self.next(target);
            self.stage.tell_progress(next)?;
            match self.try_step(next) {
                StepOutcome::Good(_) if self.may_halve_before_touch(next) && self.touches_late() => {
                    self.touch = Some(next);
                    self.go_back();
                }
                StepOutcome::Good(signature) => self.take_step(signature)?,
                StepOutcome::SlidAway(signature) if self.levels.is_close(next - self.stage.good.load) => {
                    self.warn_of_slide();
                    self.take_step(signature)?;
                }
                StepOutcome::Failed(NewtonFailure::Interrupted(signal)) => return Err(self.stage.stop(signal)),
                _ if self.halve(next) => self.go_back(),
                StepOutcome::Overdrawn(signature) => {
                    self.warn_of_friction();
                    self.take_step(signature)?;
                }
                StepOutcome::SlidAway(signature) => {
                    self.warn_of_slide();
                    self.take_step(signature)?;
                }
                // Nothing tells better.
                StepOutcome::Strayed(signature) => self.take_step(signature)?,
                StepOutcome::Jumped(signature) if self.levels.approach != Approach::Path => {
                    self.take_step(signature)?;
                }
                StepOutcome::Jumped(_) => return self.go_around(target, None),
                StepOutcome::Failed(failure @ NewtonFailure::Leaves { .. }) => {
                    return Err(self.stage.name_failure(failure, &self.stage.assembly.system));
                }
                StepOutcome::Failed(failure) => return self.go_around(target, Some(failure)),
            }
        }
        Ok(Reached::Level)
    }

    /// The next load factor on the way to a level: half-way to one by which points have touched.
    fn next(&mut self, target: f64) -> f64 {
        let load = self.stage.good.load;
        let planned = self.levels.next(load, target);
        match self.touch {
            Some(touch) if self.may_halve_before_touch(touch) => planned.min(0.5 * (load + touch)),
            Some(touch) => planned.min(touch),
            None => planned,
        }
    }

    /// True if the way to a load factor by which points have touched may be taken in parts.
    fn may_halve_before_touch(&self, touch: f64) -> bool {
        let longest = LONGEST_STEP_OF_TOUCH * self.levels.level;
        self.levels.approach != Approach::Straight && touch - self.stage.good.load > longest
    }

    /// Takes the next step half as long as the one to a load factor; `false` where it may not be.
    fn halve(&mut self, tried: f64) -> bool {
        if self.touch.is_some() {
            self.levels.shorten_to(tried - self.stage.good.load);
        }
        self.levels.halve(self.stage.soft)
    }

    /// Goes back to the last good state, for a shorter step.
    fn go_back(&mut self) {
        self.stage.counters.cutbacks += 1;
        self.stage.state.copy_all_but_rates(self.stage.good);
    }

    /// A level is reached by a motion to a state of rest, where there is one that its loads hold;
    /// else the stage ends with `failure`.
    fn rest_at(&mut self, target: f64, failure: Failure) -> Result<Reached, Failure> {
        let total = self.stage.bookkeeper.ledger().total();
        let may_rest = !self.stage.is_linear()
            && self.levels.approach != Approach::Straight
            && self.levels.reached_by != ReachedBy::Levels;
        if !may_rest || !rest::come_to_rest(self.stage, target)? {
            return Err(failure);
        }
        rest::refuse_loose(self.stage, &mut self.space)?;
        let at = self.stage.moment();
        let why = if let Failure::Singular { place: Some(place), .. } = &failure {
            format!("only the loads hold {place}")
        } else {
            "load levels do not converge".into()
        };
        let friction = match self.stage.rubs() && self.stage.state.contacts.touches() {
            true => {
                " (but friction in it is what that motion has left, not that of the loads: use more levels, or a dynamic \
                 stage, if it matters)"
            }
            false => "",
        };
        let message = format!(
            "{why}: the structure was moved by all forces against an artificial damping until it came to rest; the \
             state at {at} is in equilibrium without that damping{friction}"
        );
        self.stage.warn(WarningKind::CameToRest, message);
        self.stability.signature = self.stability.look(self.stage);
        self.levels.reached_by = ReachedBy::Rest;
        self.take_step(self.stability.signature)?;
        self.stage.bookkeeper.damp_to(total);
        Ok(Reached::Level)
    }

    /// The smallest step that is tried takes more by friction than there is.
    fn warn_of_friction(&mut self) {
        if !self.friction_account.may_warn() {
            return;
        }
        let at = self.stage.moment();
        let message = format!(
            "at {at} friction and strain take more energy than loads and motions give: the structure has jumped to \
             another equilibrium (use more levels, do not switch `adaptive` off, or simulate the motion in a dynamic \
             stage)"
        );
        self.stage.warn(WarningKind::FrictionJump, message);
    }

    /// Parts slide far however short the step.
    fn warn_of_slide(&mut self) {
        if !self.friction_account.may_warn() {
            return;
        }
        let at = self.stage.moment();
        let message = format!(
            "just before {at} friction no longer holds a part, which jumps to another equilibrium: forces and friction \
             there depend on the way (if it matters, simulate the motion in a dynamic stage)"
        );
        self.stage.warn(WarningKind::FrictionJump, message);
    }

    fn try_step(&mut self, next: f64) -> StepOutcome {
        if let Err(failure) = self.stage.attempt_within(next, self.refused_contraction()) {
            return StepOutcome::Failed(failure);
        }
        let signature = self.stability.look(self.stage);
        if let Err(failure) = NewtonFailure::unless_interrupted() {
            return StepOutcome::Failed(failure);
        }
        if self.friction_account.is_overdrawn(self.stage) {
            return StepOutcome::Overdrawn(signature);
        }
        let StageRun { model, good, state, newton, soft, contact_change, .. } = &*self.stage;
        let changes = self.stability.changes_to(signature);
        let after_change = || {
            let is_far = self.stage.rubs()
                && self.levels.has_moved_far(model, [good, state])
                && self.friction_account.has_surplus(self.stage);
            if is_far { StepOutcome::SlidAway(signature) } else { StepOutcome::Good(signature) }
        };
        match contact_change {
            ContactChange::Slides => return after_change(),
            // A contact that comes or goes is a kink of the path, unless it goes to another branch.
            ContactChange::Touches if changes == 0 => return after_change(),
            // Points that touch come and go between iterations, and augmentations push back what the
            // first correction has pressed in.
            ContactChange::None if changes == 0 && state.contacts.touches() => return StepOutcome::Good(signature),
            ContactChange::Touches | ContactChange::None => {}
        }
        if *soft {
            StepOutcome::Good(signature)
        } else if self.levels.may_have_jumped(model, [good, state], &newton.first, changes) {
            StepOutcome::Jumped(signature)
        } else if self.stability.may_have_strayed(newton.contraction, signature) {
            StepOutcome::Strayed(signature)
        } else {
            StepOutcome::Good(signature)
        }
    }

    /// The ratio of successive corrections beyond which the next step will be taken half as long, whatever
    /// state they lead to; infinite where it may not be.
    fn refused_contraction(&self) -> f64 {
        let is_refused = !self.stage.soft && self.levels.may_halve(false);
        if is_refused { self.stability.largest_contraction(self.stability.signature) } else { f64::INFINITY }
    }

    /// True if points with friction have come into contact on the way to a balanced state: their way before
    /// that counts as sliding.
    fn touches_late(&self) -> bool {
        let StageRun { model, good, state, contact_change, .. } = &*self.stage;
        let Some(contacts) = model.contacts() else { return false };
        contacts.rubs() && *contact_change != ContactChange::None && contacts.touches_late(good, state)
    }

    fn take_step(&mut self, signature: Option<Signature>) -> Result<(), Failure> {
        let lists = self.stage.counters.contacts.lists;
        self.stage.accept()?;
        self.friction_account.add_step(self.stage);
        let is_assembled_anew = lists != self.stage.counters.contacts.lists;
        let before = std::mem::replace(&mut self.stability.signature, signature);
        let before = before.filter(|_| !std::mem::take(&mut self.begins_unbalanced));
        if self.stage.contact_change == ContactChange::None {
            tell_of_points(self.stage, &mut self.space, None, before, signature)?;
        }
        self.stage.good.copy_all_but_rates(self.stage.state);
        self.levels.reached_by = self.levels.reached_by.max(ReachedBy::Levels);
        // Where pivots were looked at the stiffness is that of this state.
        if signature.is_some() && !is_assembled_anew && !self.stage.state.contacts.touches() {
            self.stage.newton.begin_with(&self.stage.assembly.system);
        }
        self.touch = self.touch.filter(|&touch| touch > self.stage.good.load);
        // Contacts change between iterations, and round-off is no contraction.
        let touches = self.stage.state.contacts.touches() || self.stage.contact_change != ContactChange::None;
        let contraction = if touches || self.stage.soft { 0.0 } else { self.stage.newton.contraction };
        self.levels.lengthen(contraction, self.stability.largest_contraction(signature));
        Ok(())
    }

    /// Where load control stands still the path is followed by arc length until it comes to the
    /// level. `failure` is what load control ended with, if it did not only seem to jump.
    fn go_around(&mut self, target: f64, failure: Option<NewtonFailure>) -> Result<Reached, Failure> {
        let named = failure.map(|failure| self.stage.name_failure(failure, &self.stage.assembly.system));
        self.stage.state.copy_from(self.stage.good);
        let hopeless = self.levels.approach != Approach::Path || self.stage.soft;
        match named {
            Some(named) if self.levels.approach == Approach::Straight || !named.is_of_balance() => return Err(named),
            Some(named) if hopeless => return self.rest_at(target, named),
            _ => {}
        }
        let (at, steps) = (self.stage.moment(), self.stage.counters.steps);
        let motion = if self.stage.state.fading.is_empty() { "" } else { IN_MOTION };
        let message = format!("load control fails at {at}: the path is followed by arc length from there{motion}");
        self.stage.warn(WarningKind::ArcLengthDetour, message);
        let arrival = detour(self.stage, &mut self.space, &self.levels, target);
        let (end, increments) = (self.stage.moment(), self.stage.counters.steps - steps);
        let limit = Failure::LimitPoint { at, goal: target, increments, end };
        match arrival {
            Ok(Arrival::Until) => {
                self.stability.signature = self.stability.look(self.stage);
                Ok(Reached::Over)
            }
            Ok(Arrival::Goal) => {
                self.take_load_control_up(target, increments);
                Ok(Reached::Along)
            }
            Ok(Arrival::OutOfSteps) => Err(limit),
            Ok(Arrival::Nowhere) => self.rest_at(target, named.unwrap_or(limit)),
            Err(failure) if !failure.is_of_balance() => Err(failure),
            Err(_) if increments > 0 => self.rest_at(target, limit),
            Err(failure) => self.rest_at(target, named.unwrap_or(failure)),
        }
    }

    /// Load control goes on where a detour has come to its level.
    fn take_load_control_up(&mut self, target: f64, increments: u64) {
        self.stage.good.copy_from(self.stage.state);
        self.stability.signature = self.stability.look(self.stage);
        self.levels.restart();
        self.touch = None;
        self.stage.warn(
            WarningKind::LoadControlResumed,
            format!("load control continues at load factor {target}, after {increments} arc-length increments"),
        );
    }
}
