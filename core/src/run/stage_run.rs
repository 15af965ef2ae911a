//! A run from its plan: the stages one after the other, watched by an observer.

use super::failure::{Failure, Moment, Place, Tried, place, refusal, refusal_help};
use super::guard::EnergyGuard;
use super::ledger::Bookkeeper;
use super::observer::{Counters, Observer, Snapshot};
use super::plan::{Plan, Stage, StageWork, Until};
use super::rehearsal::lacking;
use super::space::Space;
use super::warnings::IssuedWarnings;
use crate::integrate::{Increments, Predictor};
use crate::model::{Assembly, Model, Motion, Schedule, StageError, Timeline, charts};
use crate::solve::{Convergence, LinearSolver, Newton, NewtonFailure, NullVector};
use crate::system::{Plane, Slot, State, System};
use crate::tensor::Vec3;
use crate::threads;
use crate::warning::WarningKind;
use std::f64::consts::PI;
use std::sync::Arc;

/// Strains that may be left where an iteration ends.
const TOLERATED_STRAIN: f64 = 1e-9;

/// A run in progress.
pub struct Run<'o> {
    pub(super) model: Arc<Model>,
    /// What loads and motions do in the present stage
    pub(super) schedule: Schedule,
    pub(super) state: State,
    /// The last converged state, to go back to
    pub(super) good: State,
    pub(super) counters: Counters,
    pub(super) observer: &'o mut dyn Observer,
    pub(super) plan: Plan,
    pub(super) bookkeeper: Bookkeeper,
    pub(super) stage: usize,
    /// Whether loads act for the first time in this stage
    pub(super) fresh: bool,
    started: bool,
    pub(super) told: IssuedWarnings,
    /// Whether round-off takes the stiffness of the softest motion of the stage
    pub(super) soft: bool,
    /// The plane that the stage is treated in
    pub(super) plane: Option<Plane>,
    /// The state in which the first linear stage began
    origin: Option<State>,
    /// Of earlier stages
    cutbacks_before: u64,
    /// Whether a dynamic stage has begun
    pub(super) moving: bool,
}

/// What one stage works with.
pub(super) struct StageRun {
    pub assembly: Assembly,
    pub newton: Newton,
    /// Where a static stage is treated in a plane, once it has been looked at in space
    pub space: Option<Space>,
    /// Increments of prescribed directions in a load step; known where there are any
    pub prescribed_increment: Vec<Vec3>,
    pub until: Option<Until>,
    /// Where the unknowns of time steps are increments of rotation
    pub increments: Option<Increments>,
    /// How time steps go on
    pub trend: Predictor,
    /// For each slot whether its accelerations mean something; known in dynamic stages
    pub massive: Vec<bool>,
    /// The slots whose velocities enter no force: they have neither inertia nor damping; known in dynamic stages
    pub rateless: Vec<usize>,
    /// Watches the energy of time steps
    pub guard: Option<EnergyGuard>,
}

impl<'o> Run<'o> {
    /// A run at its start.
    pub fn new(plan: Plan, observer: &'o mut dyn Observer) -> Self {
        let model = plan.model.clone();
        let state = model.rest();
        Self {
            good: state.clone(),
            state,
            bookkeeper: Bookkeeper::default(),
            schedule: Schedule::new(&model),
            model,
            plan,
            counters: Counters::default(),
            observer,
            stage: 0,
            fresh: true,
            started: false,
            told: IssuedWarnings::default(),
            soft: false,
            plane: None,
            origin: None,
            cutbacks_before: 0,
            moving: false,
        }
    }

    /// Runs all stages. Whatever happens, the counters tell how far it came.
    pub fn finish(mut self) -> (Result<(), Failure>, Counters) {
        let result = self.run_stages();
        (result, self.counters)
    }

    fn run_stages(&mut self) -> Result<(), Failure> {
        let stages = self.plan.stages.clone();
        for (number, stage) in stages.iter().enumerate() {
            self.stage = number;
            let mut workshop = self.open_stage(stage)?;
            let result = match stage.work {
                StageWork::Static { steps, approach } => self.run_static(&mut workshop, steps, approach),
                StageWork::Path { steps, max_steps } => self.run_path(&mut workshop, steps, max_steps),
                StageWork::Modal { modes } => self.run_modal(&mut workshop, modes),
                StageWork::Buckling { modes } => self.run_buckling(&mut workshop, modes),
                StageWork::Dynamic { end, step, scheme, adaptive, energy_limit } => {
                    // The energy of the full theory is not that of the linear one.
                    workshop.guard = (!self.is_linear()).then(|| self.energy_guard(&workshop, energy_limit));
                    self.run_dynamic(&mut workshop, end, step, scheme, adaptive)
                }
            };
            self.count_evaluations(&workshop.assembly);
            self.note_solver(workshop.newton.solver.name());
            self.warn_of_round_off();
            self.warn_of_frame();
            self.warn_of_imbalance(&workshop);
            self.judge_steps(&mut workshop);
            result?;
            self.hand_over(&mut workshop);
            self.schedule.end_stage(&self.model, &self.state);
        }
        Ok(())
    }

    /// Strains that Newton leaves have an energy of their own, of the stiffest section along the length of the scene.
    fn energy_guard(&self, workshop: &StageRun, limit: f64) -> EnergyGuard {
        let round_off = workshop.assembly.round_off(&self.state).force;
        let stiffest = round_off / f64::EPSILON;
        EnergyGuard::new(limit, stiffest * self.model.length * TOLERATED_STRAIN * TOLERATED_STRAIN, round_off)
    }

    fn note_solver(&mut self, name: &'static str) {
        if !self.counters.linear_solvers.contains(&name) {
            self.counters.linear_solvers.push(name);
        }
    }

    /// Settles loads and constraints of the stage, and analyses the pattern of its unknowns.
    fn open_stage(&mut self, stage: &Stage) -> Result<StageRun, Failure> {
        let kind = stage.work.kind();
        (self.soft, self.cutbacks_before) = (false, self.counters.cutbacks);
        self.fresh = self.stage == 0 || self.schedule.has_fresh_loads(&self.model, self.stage);
        let begun = self.schedule.begin_stage(&self.model, self.stage, kind, &self.state);
        let dof_map = begun.map_err(|error| self.describe(error))?;
        let fading = !self.state.fading.is_empty();
        if let Some(error) = lacking(&self.model, &self.schedule, stage, self.stage, fading, || Some(dof_map.clone())) {
            return Err(self.describe(error));
        }
        self.plane = dof_map.plane().copied();
        self.warn_of_space(kind);
        let assembly = Assembly::new(&stage.context(self.stage), dof_map, &self.model);
        let newton = self.newton_for(stage, &assembly)?;
        Ok(StageRun {
            assembly,
            newton,
            space: None,
            prescribed_increment: Vec::new(),
            until: stage.until.clone(),
            increments: None,
            trend: Predictor::default(),
            massive: Vec::new(),
            rateless: Vec::new(),
            guard: None,
        })
    }

    /// Newton's iteration on the system of a stage.
    pub(super) fn newton_for(&self, stage: &Stage, assembly: &Assembly) -> Result<Newton, Failure> {
        let Some(solver) = LinearSolver::new(&assembly.system, &self.model.multipliers) else {
            return Err(Failure::Limit("not enough memory for the factorisation of the tangent".into()));
        };
        let convergence = Convergence { tolerance: stage.tolerance };
        Ok(Newton::new(convergence, stage.max_iterations, solver, &assembly.system))
    }

    /// Where the stage is linear, it is so about the state in which the first such stage began, and the springs and loads that act when it
    /// begins itself.
    pub(super) fn linearise(&mut self, workshop: &mut StageRun) -> Result<(), Failure> {
        if !self.is_linear() {
            return Ok(());
        }
        let mut origin = self.origin.get_or_insert_with(|| self.state.clone()).clone();
        (origin.time, origin.load) = (self.state.time, self.state.load);
        origin.amplitude.copy_from_slice(&self.state.amplitude);
        origin.amplitude_rates.copy_from_slice(&self.state.amplitude_rates);
        let linear = workshop.assembly.linearise(&self.model, &origin);
        linear.map_err(|conflict| self.describe(StageError::Conflict(conflict)))
    }

    /// Whether the stage is linear.
    pub(super) fn is_linear(&self) -> bool {
        self.model.is_linear(self.plan.stages[self.stage].work.kind())
    }

    /// The first dynamic stage gives the initial velocities.
    pub(super) fn takes_initial_motion(&mut self) -> bool {
        !std::mem::replace(&mut self.moving, true)
    }

    /// The present moment.
    pub(super) fn moment(&self) -> Moment {
        Moment { stage: self.stage + 1, time: self.state.time, load: self.state.load }
    }

    /// Opens the energy account of the stage; at the start of the run also writes the first row.
    pub(super) fn open_account(&mut self, workshop: &mut StageRun) -> Result<(), Failure> {
        if self.keeps_account(workshop) {
            self.bookkeeper.open(&self.model, &self.state, &workshop.assembly.system);
        } else {
            self.bookkeeper.close();
        }
        let first = self.bookkeeper.first().unwrap_or_default();
        if let Some(guard) = &mut workshop.guard {
            let force = self.model.largest_force(&workshop.assembly.system);
            guard.open(self.bookkeeper.ledger(), first, f64::EPSILON * force * self.model.length);
        }
        if std::mem::replace(&mut self.started, true) {
            return Ok(());
        }
        self.show(workshop)
    }

    /// What follows every converged state: turns are counted, the mesh is judged, work is booked.
    pub(super) fn accept(&mut self, workshop: &StageRun) -> Result<(), Failure> {
        self.continue_to_state()?;
        self.judge_mesh()?;
        self.counters.mixed_elements += self.state.mixed.iter().filter(|&&mask| mask != 0).count() as u64;
        if self.keeps_account(workshop) {
            self.bookkeeper.add_step(&self.model, &self.state, &workshop.assembly.system);
        }
        Ok(())
    }

    /// Continues from the last good state what goes on without jumps: turns of nodes and of joints.
    fn continue_to_state(&mut self) -> Result<(), Failure> {
        self.refuse_infinities()?;
        if let Some(plane) = &self.plane {
            self.model.flatten(plane, &mut self.state);
        }
        self.wind()?;
        self.model.remember(&mut self.state);
        Ok(())
    }

    /// What follows a state on the way to a balance: it becomes the good one, turns are counted, and the work of its forces is booked. No row.
    pub(super) fn pass_through(&mut self, system: &System) -> Result<(), Failure> {
        self.state.anchor = None;
        self.continue_to_state()?;
        if self.plan.energy {
            self.bookkeeper.add_step(&self.model, &self.state, system);
        }
        self.good.copy_all_but_rates(&self.state);
        Ok(())
    }

    /// Energies are counted where somebody asks for them, or watches them.
    fn keeps_account(&self, workshop: &StageRun) -> bool {
        self.plan.energy || workshop.guard.is_some()
    }

    /// Modes and critical loads count as one step.
    pub(super) fn count_steps(&mut self) {
        self.counters.steps += 1;
    }

    /// Shows a row to the observer.
    pub(super) fn show(&mut self, workshop: &StageRun) -> Result<(), Failure> {
        // The observer is borrowed beside what it looks at.
        let Self { observer, state, model, counters, bookkeeper, stage, .. } = self;
        let ledger = bookkeeper.ledger();
        let system = &workshop.assembly.system;
        observer.row(&Snapshot { stage: *stage + 1, state, system, model, ledger, counters })
    }

    fn snapshot<'a>(&'a self, workshop: &'a StageRun) -> Snapshot<'a> {
        Snapshot {
            stage: self.stage + 1,
            state: &self.state,
            system: &workshop.assembly.system,
            model: &self.model,
            ledger: self.bookkeeper.ledger(),
            counters: &self.counters,
        }
    }

    /// Whether the stage shall end at the present row.
    pub(super) fn is_over(&self, workshop: &StageRun) -> bool {
        let Some(until) = &workshop.until else { return false };
        let value = (until.column)(&self.snapshot(workshop));
        until.below.is_some_and(|bound| value < bound) || until.above.is_some_and(|bound| value > bound)
    }

    /// Motions that overflow leave no force behind that would tell.
    fn refuse_infinities(&self) -> Result<(), Failure> {
        let State { q, v, a, .. } = &self.state;
        let is_wrong = |&slot: &usize| !(q[slot].is_finite() && v[slot].is_finite() && a[slot].is_finite());
        let Some(slot) = threads::first(q.len(), |mut part| part.find(is_wrong)) else { return Ok(()) };
        Err(Failure::NonFinite { at: self.moment(), effect: Some("the motion"), node: self.model.node_at(slot) })
    }

    /// Counts turns; a rotational spring whose node leaves its axis near a whole turn has no law that would go on.
    fn wind(&mut self) -> Result<(), Failure> {
        if self.is_linear() {
            // Rotations of any size, without charts.
            self.state.unwrapped.clear();
        }
        let (model, schedule) = (&self.model, &self.schedule);
        let moves = |slot: Slot, (motion, timeline): (&Motion, Timeline)| motion.slot == slot && timeline.acts();
        let is_prescribed = |slot: Slot| schedule.motions(model).any(|motion| moves(slot, motion));
        charts::unwind(&mut self.state, &self.good, self.schedule.charted(&self.model), is_prescribed);
        let ambiguous = charts::wind(&mut self.state, &self.good, &self.schedule.charted(&self.model).rotations);
        if let Some(&slot) = ambiguous.first().filter(|_| self.plan.continued) {
            self.warn_of_lost_axis(slot);
        }
        let Some(slot) = ambiguous.into_iter().find(|slot| self.model.sprung.contains(slot)) else { return Ok(()) };
        let (at, node) = (self.moment(), self.model.node_at(slot as usize));
        Err(Failure::Deck(format!(
            "the rotational spring at node \"{node}\" has been wound by more than a turn and its node left the axis ({at}): how \
             far it is wound is not defined there; hold the other rotations of the node, or use a joint"
        )))
    }

    pub(super) fn judge_mesh(&mut self) -> Result<(), Failure> {
        let limit = if self.told.coarse { charts::COARSE } else { charts::COARSE_WARNING };
        let Some((element, angle)) = charts::coarsest(&self.state, &self.schedule.charted(&self.model).elements, limit)
        else {
            return Ok(());
        };
        let failure = self.name_coarse(element, angle);
        if angle > charts::COARSE {
            return Err(failure);
        }
        self.told.coarse = true;
        self.warn(WarningKind::CoarseMesh, format!("{failure}: more elements would tell the shape better"));
        Ok(())
    }

    fn name_coarse(&self, element: usize, angle: f64) -> Failure {
        let rotations = self.schedule.charted(&self.model).elements[element].rotations();
        let names = [rotations[0], rotations[rotations.len() - 1]].map(|slot| self.model.node_at(slot as usize));
        Failure::MeshTooCoarse { at: self.moment(), nodes: names, relative_rotation: angle }
    }

    /// Where a spring or the spring of a joint seems to have been wound by more than half a turn since the last good state nobody knows
    /// whether that were the load or the corrections on their way to the balance: smaller levels tell.
    pub(super) fn refuse_windings(&self) -> Result<(), NewtonFailure> {
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

    /// Between the last good state and this one neighbours may have turned past pi against each other: smaller steps tell.
    pub(super) fn refuse_leaps(&self) -> Result<(), NewtonFailure> {
        match charts::leapt(&self.state, &self.good, &self.schedule.charted(&self.model).elements) {
            Some((element, angle)) => Err(NewtonFailure::LeapsTooFar { element, angle }),
            None => Ok(()),
        }
    }

    pub(super) fn count_evaluations(&mut self, assembly: &Assembly) {
        for &(name, count) in &assembly.evaluations {
            match self.counters.evaluations.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += count,
                None => self.counters.evaluations.push((name, count)),
            }
        }
    }

    /// Names what Newton ended with.
    pub(super) fn name_failure(&self, failure: NewtonFailure, system: &System) -> Failure {
        let at = self.moment();
        match failure {
            NewtonFailure::NotConverged { residual, history } => Failure::NotConverged {
                at,
                place: place(&self.model, residual.slot as usize, residual.value),
                residual: residual.value.norm(),
                force: residual.force,
                history,
                tried: Tried { cutbacks: self.counters.cutbacks - self.cutbacks_before, soft: self.soft },
            },
            NewtonFailure::StepTooSmall { slot, error, share } => {
                Failure::StepTooSmall { at, place: place(&self.model, slot, Vec3::ZERO), error, share }
            }
            NewtonFailure::Singular(vector) => self.name_mechanism(vector, system),
            NewtonFailure::TurnsTooFar { slot, angle } => {
                Failure::TurnsTooFar { at, node: self.model.node_at(slot), angle }
            }
            NewtonFailure::LeapsTooFar { element, angle } => self.name_coarse(element, angle),
            NewtonFailure::NotFinite { effect, slot } => {
                Failure::NonFinite { at, effect, node: self.model.node_at(slot) }
            }
        }
    }

    /// Names the node and the direction that move most in a motion without stiffness.
    pub(super) fn name_mechanism(&self, vector: Option<NullVector>, system: &System) -> Failure {
        let at = self.moment();
        Failure::Singular { at, place: vector.map(|vector| self.place_of(&vector, system)) }
    }

    /// Where a motion moves most.
    pub(super) fn place_of(&self, vector: &NullVector, system: &System) -> Place {
        let (largest, motion) = vector.by_slot(&system.pattern.dof_map, self.model.slots());
        place(&self.model, largest, motion[largest])
    }

    pub(super) fn describe(&self, error: StageError) -> Failure {
        let message = format!("stage {}: {}", self.stage + 1, refusal(&error, &self.model));
        let help = refusal_help(&error, &self.model, self.stage);
        Failure::Deck(help.map_or(message.clone(), |help| format!("{message}; {help}")))
    }
}
