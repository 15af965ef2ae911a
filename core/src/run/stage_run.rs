//! One stage of a run: its state, its unknowns, Newton's iteration, and what all kinds of stages
//! do.

use super::checkpoint::AnalysisCheckpoint;
use super::earlier_stages::EarlierStages;
use super::energy::{Bookkeeper, Entry};
use super::failure::{Failure, Moment};
use super::issued::IssuedWarnings;
use super::observer::Observer;
use super::plan::{Plan, Stage};
use super::results::StageResult;
use super::snapshot::{Counters, Snapshot};
use crate::effect::{ContactChange, Contacts, Missed, Penetration};
use crate::interrupt;
use crate::model::{Assembly, Charted, Model, Motion, Schedule, StageError, Timeline, charts};
use crate::solve::{Convergence, LinearSolver, Newton, NewtonFailure};
use crate::system::{Plane, Slot, State};
use crate::tensor::Vec3;
use crate::threads;
use crate::warning::WarningKind;
use std::f64::consts::PI;

/// A kind of stage at work.
pub(super) trait Analysis<'r> {
    /// The stage.
    fn stage(&mut self) -> &mut StageRun<'r>;

    /// Runs it to its end, or as far as it comes.
    fn run(&mut self) -> Result<(), Failure>;

    /// Warns of what shows only behind it, however it ended.
    fn judge(&mut self);
}

/// Tells an observer how far a run has come, while the stage is in use.
pub(super) struct Teller<'t> {
    pub(super) observer: &'t mut dyn Observer,
    pub(super) at: Moment,
    /// The stage, from 0
    pub(super) number: usize,
    /// The number of stages
    pub(super) stages: usize,
}

impl Teller<'_> {
    /// `done`: the part of the stage that lies behind, from 0 to 1. `Err` if work is asked to stop.
    pub fn tell(&mut self, done: f64) -> Result<(), Failure> {
        unless_interrupted(self.at)?;
        self.observer.progress(self.at, (self.number as f64 + done) / self.stages as f64)
    }
}

/// A stage in progress.
pub(super) struct StageRun<'r> {
    pub(super) plan: &'r Plan,
    /// From 0
    pub(super) number: usize,
    pub(super) model: &'r Model,
    /// The rotations and elements that have charts in the stage: none where it is linear
    pub(super) charted: &'r Charted,
    /// The courses of loads and motions
    pub(super) schedule: &'r mut Schedule,
    pub(super) state: &'r mut State,
    /// The last converged state, to go back to
    pub(super) good: &'r mut State,
    pub(super) observer: &'r mut dyn Observer,
    pub(super) counters: &'r mut Counters,
    pub(super) issued: &'r mut IssuedWarnings,
    pub(super) bookkeeper: &'r mut Bookkeeper,
    pub(super) past: &'r mut EarlierStages,
    pub(super) assembly: Assembly,
    pub(super) newton: Newton,
    /// The plane that the stage is treated in
    pub(super) plane: Option<Plane>,
    /// Loads act for the first time in this stage.
    pub(super) fresh: bool,
    /// Round-off takes the stiffness of the softest motion.
    pub(super) soft: bool,
    /// Energies are counted, since somebody asks for them or watches them.
    pub(super) keeps_account: bool,
    /// Increments of prescribed directions in a load step, or over a unit of load; known where
    /// there are any
    pub(super) prescribed_increment: Vec<Vec3>,
    /// Attempts that earlier stages have taken back
    pub(super) cutbacks_before: u64,
    /// The unknowns of the last balance before it was flattened, which its stiffness belongs to; in
    /// static stages in tilted planes
    pub(super) unflattened: Vec<Vec3>,
    /// Changes of contacts in the present step
    pub(super) contact_change: ContactChange,
    /// Where a checkpoint has left the stage; taken by its analysis
    pub(super) resumed: Option<AnalysisCheckpoint>,
    /// The analysis is at its end, and judged.
    pub(super) is_judged: bool,
}

/// Newton's iteration on the system of a stage.
pub(super) fn newton_for(stage: &Stage, assembly: &Assembly, model: &Model, at: Moment) -> Result<Newton, Failure> {
    let Some(solver) = LinearSolver::new(&assembly.system, &model.kinds, model.length) else {
        return Err(at.limit("not enough memory for the factorisation of the tangent"));
    };
    // Forces of bodies that fly freely fall from step to step, until products with them underflow.
    let negligible = if stage.work.kind().advances_time() { f64::MIN_POSITIVE } else { 0.0 };
    let convergence = Convergence { tolerance: stage.tolerance, negligible };
    Ok(Newton::new(convergence, stage.max_iterations, solver, &assembly.system))
}

/// `Err`, with the moment `at`, if work is asked to stop.
pub(super) fn unless_interrupted(at: Moment) -> Result<(), Failure> {
    interrupt::requested().map_or(Ok(()), |signal| Err(Failure::Interrupted { at, signal }))
}

impl StageRun<'_> {
    /// `Err` if work is asked to stop: then the last look may have been interrupted, and is no
    /// reason for any verdict.
    pub fn unless_interrupted(&self) -> Result<(), Failure> {
        unless_interrupted(self.moment())
    }

    /// Goes back to the last good state after an interrupted attempt.
    pub fn stop(&mut self, signal: i32) -> Failure {
        self.state.copy_from(self.good);
        Failure::Interrupted { at: self.moment(), signal }
    }

    /// The stage in the plan.
    pub fn stage(&self) -> &Stage {
        &self.plan.stages[self.number]
    }

    /// Where the stage is linear, it is so about the state in which the first such stage began, and
    /// the springs and loads that act when it begins itself.
    pub fn linearise(&mut self) -> Result<(), Failure> {
        if !self.is_linear() {
            return Ok(());
        }
        let mut origin = self.past.origin.get_or_insert_with(|| self.state.clone()).clone();
        (origin.time, origin.load) = (self.state.time, self.state.load);
        origin.amplitude.copy_from_slice(&self.state.amplitude);
        origin.amplitude_rates.copy_from_slice(&self.state.amplitude_rates);
        let linear = self.assembly.linearise(self.model, &origin);
        linear.map_err(|conflict| self.describe(StageError::Conflict(conflict)))
    }

    /// True if the stage is linear.
    pub fn is_linear(&self) -> bool {
        self.model.is_linear(self.stage().work.kind())
    }

    /// The present moment.
    pub fn moment(&self) -> Moment {
        Moment { stage: self.number + 1, time: self.state.time, load: self.state.load }
    }

    /// Refuses contacts that begin to act in this stage with a penetration.
    pub fn refuse_penetration(&self) -> Result<(), Failure> {
        let Some(contacts) = self.model.contacts() else { return Ok(()) };
        // Modes and buckling leave contacts as they are.
        let before = (0..self.number).rev().find(|&stage| self.plan.stages[stage].work.kind().advances_state());
        let begins = |amplitude: usize| before.is_none_or(|before| !self.model.amplitudes[amplitude].acts_in(before));
        let Some(Penetration { contact, surface, slot, depth, .. }) = contacts.penetrates(self.state, &begins) else {
            return Ok(());
        };
        let node = self.model.node_at(slot as usize);
        Err(Failure::ContactStart { at: self.moment(), contact, surface, node, depth })
    }

    /// Opens the energy account of the stage; at the start of the run also writes the first row.
    pub fn open_account(&mut self) -> Result<(), Failure> {
        if self.keeps_account {
            self.bookkeeper.open(Entry::new(self.model, self.state, &self.assembly));
        } else {
            self.bookkeeper.close();
        }
        if std::mem::replace(&mut self.past.started, true) {
            return Ok(());
        }
        self.show()
    }

    /// Accepts a converged state: turns are counted, the mesh is judged, work is booked.
    pub fn accept(&mut self) -> Result<(), Failure> {
        self.unless_interrupted()?;
        self.continue_to_state()?;
        self.judge_mesh()?;
        self.look_for_jumps();
        self.counters.mixed_elements += self.state.mixed.iter().filter(|&&mask| mask != 0).count() as u64;
        if self.keeps_account {
            self.book_step();
        }
        Ok(())
    }

    /// Notes what has jumped within a time step that is accepted. In linear stages a cable stays as it
    /// is.
    fn look_for_jumps(&mut self) {
        let length = self.state.time - self.good.time;
        if length > 0.0 && !self.is_linear() {
            let effects = self.model.force_jumps();
            let jumped = effects.filter_map(|effect| effect.jumped(self.good, self.state, length)).max();
            self.counters.jump = self.counters.jump.max(jumped);
        }
    }

    /// Books the work of the step that ends here, and that of the impulses in it.
    fn book_step(&mut self) {
        self.bookkeeper.add_step(Entry::new(self.model, self.state, &self.assembly));
        if let Some(without_jumps) = self.schedule.without_jumps(self.model, self.state, self.good.time) {
            self.bookkeeper.add_impulse(Entry::new(self.model, &without_jumps, &self.assembly));
        }
    }

    /// Continues from the last good state what goes on without jumps: turns of nodes and of joints.
    fn continue_to_state(&mut self) -> Result<(), Failure> {
        self.refuse_infinities()?;
        self.flatten();
        self.wind()?;
        self.remember();
        self.fit_assembly()
    }

    /// Assembles anew where other beams are near each other in the present state than in the pattern
    /// of the tangent.
    pub fn fit_assembly(&mut self) -> Result<(), Failure> {
        if self.assembly.fits(self.state) {
            return Ok(());
        }
        let dof_map = self.schedule.dof_map(self.model, self.plane).map_err(|error| self.describe(error))?;
        let assembly = Assembly::about(self.state, &self.stage().context(self.number), dof_map, self.model);
        let mut newton = newton_for(self.stage(), &assembly, self.model, self.moment())?;
        newton.recall(self.newton.memory(), self.model, &assembly.system);
        newton.first = std::mem::take(&mut self.newton.first);
        newton.contraction = self.newton.contraction;
        let solver = self.newton.solver.name();
        self.note_solver(solver);
        self.newton = newton;
        let old = std::mem::replace(&mut self.assembly, assembly);
        self.assembly.take_over(old);
        self.counters.contacts.lists += 1;
        Ok(())
    }

    /// Writes the memory of a state that becomes the good one: turns of joints, contacts.
    pub fn remember(&mut self) {
        self.model.remember(self.state);
        if let Some(contacts) = self.model.contacts() {
            contacts.accept(self.good, self.state);
        }
    }

    /// Takes out of the state what round-off has put aside of a tilted plane.
    fn flatten(&mut self) {
        let Some(plane) = self.plane.as_ref().filter(|plane| plane.is_tilted()) else { return };
        if self.stage().work.kind().ramps_load() {
            threads::copy(&mut self.unflattened, &self.state.q);
        }
        self.model.flatten(plane, self.state);
    }

    /// Passes a state on the way to a balance: it becomes the good one, turns are counted, and the
    /// work of its forces is booked. No row.
    pub fn pass_through(&mut self, assembly: &Assembly) -> Result<(), Failure> {
        self.unless_interrupted()?;
        self.state.anchor = None;
        self.continue_to_state()?;
        if self.plan.energy {
            self.bookkeeper.add_step(Entry::new(self.model, self.state, assembly));
        }
        self.good.copy_all_but_rates(self.state);
        Ok(())
    }

    /// Takes an earlier state as the present one, and as the last good one.
    pub fn go_back_to(&mut self, state: &State) -> Result<(), Failure> {
        self.state.copy_from(state);
        self.good.copy_from(state);
        self.fit_assembly()
    }

    /// Shows a row to the observer.
    pub fn show(&mut self) -> Result<(), Failure> {
        self.unless_interrupted()?;
        // The observer is borrowed beside what it looks at.
        let Self { observer, state, model, counters, bookkeeper, number, assembly, .. } = self;
        let (system, origin) = (&assembly.system, assembly.origin());
        let ledger = bookkeeper.ledger();
        observer.row(&Snapshot { stage: *number + 1, state, origin, system, model, ledger, counters })
    }

    /// Gives the result of an analysis to the observer.
    pub fn give(&mut self, result: &StageResult) -> Result<(), Failure> {
        self.unless_interrupted()?;
        self.observer.found(self.number + 1, result)
    }

    pub(super) fn snapshot(&self) -> Snapshot<'_> {
        Snapshot {
            stage: self.number + 1,
            state: self.state,
            origin: self.assembly.origin(),
            system: &self.assembly.system,
            model: self.model,
            ledger: self.bookkeeper.ledger(),
            counters: self.counters,
        }
    }

    /// Tells the observer how much of the stage lies behind, from 0 to 1.
    pub fn tell_progress(&mut self, done: f64) -> Result<(), Failure> {
        let at = self.moment();
        Teller { observer: self.observer, at, number: self.number, stages: self.plan.stages.len() }.tell(done)
    }

    /// True if the stage ends at the present row by its `until`.
    pub fn is_over(&self) -> bool {
        let Some(until) = &self.stage().until else { return false };
        let value = (until.column)(&self.snapshot());
        until.below.is_some_and(|bound| value < bound) || until.above.is_some_and(|bound| value > bound)
    }

    /// Motions that overflow leave no force behind that would tell.
    fn refuse_infinities(&self) -> Result<(), Failure> {
        let State { q, v, a, .. } = &self.state;
        let is_wrong = |&slot: &usize| !(q[slot].is_finite() && v[slot].is_finite() && a[slot].is_finite());
        let Some(slot) = threads::first(q.len(), |mut part| part.find(is_wrong)) else { return Ok(()) };
        Err(Failure::NonFinite { at: self.moment(), effect: Some("the motion"), node: self.model.node_at(slot) })
    }

    /// Counts turns; a rotational spring whose node leaves its axis near a whole turn has no law
    /// that would go on.
    fn wind(&mut self) -> Result<(), Failure> {
        if self.is_linear() {
            // Rotations of any size, without charts.
            self.state.unwrapped.clear();
        }
        let moves = |slot: Slot, (motion, timeline): (&Motion, Timeline)| motion.slot == slot && timeline.acts();
        let is_prescribed = |slot: Slot| self.schedule.motions(self.model).any(|motion| moves(slot, motion));
        charts::unwind(self.state, self.good, self.charted, is_prescribed);
        let ambiguous = charts::wind(self.state, self.good, &self.charted.rotations);
        if let Some(&slot) = ambiguous.first().filter(|_| self.plan.continued) {
            self.warn_of_lost_axis(slot);
        }
        let Some(slot) = ambiguous.into_iter().find(|slot| self.model.sprung.contains(slot)) else { return Ok(()) };
        let (at, node) = (self.moment(), self.model.node_at(slot as usize));
        Err(Failure::Deck(format!(
            "the rotational spring at node \"{node}\" is twisted by more than one turn and the node has left its axis \
             of rotation ({at}): the twist is then undefined; fix the other rotations of the node, or use a joint"
        )))
    }

    pub fn judge_mesh(&mut self) -> Result<(), Failure> {
        let limit = if self.issued.coarse { charts::COARSE } else { charts::COARSE_WARNING };
        let Some((element, angle)) = charts::coarsest(self.state, &self.charted.elements, limit) else {
            return Ok(());
        };
        let failure = self.name_coarse(element, angle);
        if angle > charts::COARSE {
            return Err(failure);
        }
        self.issued.coarse = true;
        self.warn(WarningKind::CoarseMesh, format!("{failure}: use more elements to resolve the shape"));
        Ok(())
    }

    /// Where a spring or the spring of a joint seems to have been wound by more than half a turn
    /// since the last good state nobody knows whether that were the load or the corrections on
    /// their way to the balance: smaller levels tell.
    pub fn refuse_windings(&self) -> Result<(), NewtonFailure> {
        // Springs of linear stages take rotation vectors of any size.
        if self.is_linear() {
            return Ok(());
        }
        let turned = |slot: Slot| self.state.unwrapped_at(slot) - self.good.unwrapped_at(slot);
        let of_joint = |[a, b]: [Option<Slot>; 2]| {
            let [start, end] = [a, b].map(|slot| slot.map_or(Vec3::ZERO, turned));
            (a.or(b).unwrap_or_default(), (end - start).norm())
        };
        let springs = self.model.sprung.iter().map(|&slot| (slot, turned(slot).norm()));
        let mut unwrapped = springs.chain(self.model.sprung_joints.iter().copied().map(of_joint));
        match unwrapped.find(|&(_, angle)| angle > PI) {
            Some((slot, angle)) => Err(NewtonFailure::TurnsTooFar { slot: slot as usize, angle }),
            None => Ok(()),
        }
    }

    /// A node may have slid beyond the end of the beam on which it slides.
    pub fn refuse_departures(&self) -> Result<(), NewtonFailure> {
        match self.model.constraints().find_map(|constraint| constraint.left(self.state)) {
            Some(slot) => Err(NewtonFailure::Leaves { slot: slot as usize }),
            None => Ok(()),
        }
    }

    /// Between the last good state and this one a node may have passed through a surface: smaller
    /// steps tell.
    pub fn refuse_passing(&self) -> Result<(), NewtonFailure> {
        let Some(contacts) = self.model.contacts() else { return Ok(()) };
        match contacts.passed(self.good, self.state) {
            Some(slot) => Err(NewtonFailure::Passes { slot: slot as usize }),
            None => Ok(()),
        }
    }

    /// Beams and surfaces that were not looked at may have met between the last good state and this one:
    /// with them the step is taken again.
    pub fn refuse_missed(&mut self) -> Result<(), NewtonFailure> {
        let Some(contacts) = self.model.contacts() else { return Ok(()) };
        match contacts.list_missed(self.good, self.state) {
            Missed::None => Ok(()),
            Missed::Listed(slot) | Missed::TooMany(slot) => Err(NewtonFailure::Passes { slot: slot as usize }),
        }
    }

    /// The same for a state within the step: a surface may come near there and leave again.
    pub fn refuse_missed_within(&mut self, within: &State) -> Result<(), NewtonFailure> {
        let Some(contacts) = self.model.contacts() else { return Ok(()) };
        match contacts.look_for(self.good, within) {
            Some(slot) => Err(NewtonFailure::Passes { slot: slot as usize }),
            None => Ok(()),
        }
    }

    /// After a failed step: goes back to the last good state. True if more pairs of beams are listed there now, or
    /// more surfaces looked at, with which the step may succeed.
    pub fn looks_at_more(&mut self) -> bool {
        let has_more =
            !self.assembly.fits(self.good) || self.good.contacts.clearances != self.state.contacts.clearances;
        let finds_more = |contacts: &dyn Contacts| contacts.look_for(self.good, self.state).is_some();
        if !has_more && !self.model.contacts().is_some_and(finds_more) {
            return false;
        }
        self.state.copy_from(self.good);
        self.fit_assembly().is_ok()
    }

    /// Between the last good state and this one neighbours may have turned past pi against each
    /// other: smaller steps tell.
    pub fn refuse_leaps(&self) -> Result<(), NewtonFailure> {
        match charts::leapt(self.state, self.good, &self.charted.elements) {
            Some((element, angle)) => Err(NewtonFailure::LeapsTooFar { element, angle }),
            None => Ok(()),
        }
    }

    /// Between steps, nodes beyond pi change their chart, and elements settle theirs; returns how
    /// many did. `lag`: see [`charts::switch`].
    pub fn change_charts(&mut self, lag: Option<f64>) -> usize {
        let switched = charts::switch(self.state, &self.charted.rotations, charts::DYNAMIC_BAND, lag);
        self.counters.work.chart_switches += switched as u64;
        charts::freeze(self.state, &self.charted.elements);
        switched
    }

    /// Brings what moves to rest, for an analysis of the present state. Returns the state as it moved, in the
    /// charts of the analysis: with its rates the motion goes on.
    pub fn stand_still(&mut self) -> State {
        self.change_charts(None);
        let moving = self.state.clone();
        self.state.stand_still();
        moving
    }

    /// Counts what the effects of an assembly have evaluated.
    pub fn count_evaluations(&mut self, assembly: &Assembly) {
        count_evaluations(self.counters, assembly);
    }

    /// Sums up the work, and warns of what any kind of stage may leave behind.
    pub fn close(&mut self) {
        count_evaluations(self.counters, &self.assembly);
        self.note_solver(self.newton.solver.name());
        self.warn_of_round_off();
        self.warn_of_frame();
    }

    fn note_solver(&mut self, name: &'static str) {
        if !self.counters.linear_solvers.contains(&name) {
            self.counters.linear_solvers.push(name);
        }
    }
}

fn count_evaluations(counters: &mut Counters, assembly: &Assembly) {
    for &(name, count) in &assembly.evaluations {
        match counters.evaluations.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += count,
            None => counters.evaluations.push((name, count)),
        }
    }
}
