//! Small motions about the state that was reached: (s^2 M + s C + K) x = 0.

mod rigid;
mod search;
mod vibrations;

pub(super) use vibrations::{Vibrations, pivots_tell, vibrations};

use self::rigid::{free_spins, rigid_motions};
use self::search::{Found, find_modes, first_shift, grows, matrices};
use super::failure::Failure;
use super::results::{Mode, StageResult};
use super::stage_run::{Analysis, StageRun, Teller};
use crate::model::StageError;
use crate::solve::{Matrices, ModeSearch, ModeShape, SmallMotion, Tangent, mechanism};
use crate::sorting::sort_by;
use crate::system::State;
use crate::tensor::Vec3;
use crate::warning::WarningKind;
use nalgebra::Complex;

/// Relative uncertainty of a frequency that is told.
const TOLD_UNCERTAINTY: f64 = 1e-3;
/// Two frequencies that agree to this are one, and the more unstable mode comes first.
const SAME_FREQUENCY: f64 = 1e-7;

/// Angular velocity of a node over the lowest frequency up to which there is no warning.
const NEGLIGIBLE_SPIN: f64 = 0.01;

/// A modal stage.
pub(super) struct Modal<'s, 'r> {
    pub(super) stage: &'s mut StageRun<'r>,
    /// The number of modes that are asked for
    pub(super) modes: usize,
}

impl<'r> Analysis<'r> for Modal<'_, 'r> {
    fn stage(&mut self) -> &mut StageRun<'r> {
        self.stage
    }

    /// Finds the modes with the smallest |s|, and all unstable ones.
    fn run(&mut self) -> Result<(), Failure> {
        self.stage.tell_progress(0.0)?;
        let spin = self.fastest_spin();
        let moving = self.stand_still()?;
        let matrices = self.matrices()?;
        let found = self.find(&matrices)?;
        let mut listed = listed(&found, self.modes);
        if listed.is_empty() && self.modes > 0 {
            return Err(self.nothing_moves());
        }
        for motion in &mut listed {
            self.stage.unless_interrupted()?;
            self.refine(motion);
        }
        self.warn_of_modes(&found, &listed);
        self.warn_of_layers(&listed);
        self.warn_of_spin(spin, &listed);
        self.stage.counters.steps += 1;
        // What moved moves on.
        self.stage.state.copy_rates(&moving);
        let listed = listed.iter().map(mode).collect();
        self.stage.give(&StageResult::Modes(listed))
    }

    /// Nothing is off: motions go on behind a modal stage.
    fn judge(&mut self) {}
}

impl Modal<'_, '_> {
    /// Modes are those of the state at rest. Returns the state with its rates.
    fn stand_still(&mut self) -> Result<State, Failure> {
        let moving = self.stage.stand_still();
        let StageRun { model, state, schedule, .. } = &mut *self.stage;
        let (time, load) = (state.time, state.load);
        schedule.set_clock(model, state, time, load);
        self.stage.open_account()?;
        self.stage.warn_out_of_balance();
        Ok(moving)
    }

    /// The fastest rotation of a node, rad per time.
    fn fastest_spin(&self) -> f64 {
        let StageRun { state, charted, .. } = &*self.stage;
        if !state.moves() {
            return 0.0;
        }
        charted.rotations.iter().map(|&slot| state.spin(slot).omega.norm()).fold(0.0, f64::max)
    }

    /// A state that turns has forces of inertia, which modes of the state at rest leave out.
    fn warn_of_spin(&mut self, spin: f64, listed: &[SmallMotion]) {
        let lowest = listed.iter().map(|motion| motion.exponent.norm()).filter(|&omega| omega > 0.0);
        let lowest = lowest.fold(f64::INFINITY, f64::min);
        if spin <= NEGLIGIBLE_SPIN * lowest {
            return;
        }
        let stage = self.stage.number + 1;
        let message = format!(
            "stage {stage} begins in motion, and nodes rotate at up to {spin:.3e} rad per unit of time: its modes are those \
             of the same shape at rest (for a steady rotation of the whole use a static stage with `frame`)"
        );
        self.stage.warn(WarningKind::OutOfBalance, message);
    }

    fn matrices(&mut self) -> Result<Matrices, Failure> {
        let StageRun { assembly, state, model, .. } = &mut *self.stage;
        let matrices = matrices(assembly, state, model);
        if matrices.is_massless() { Err(self.stage.describe(StageError::NoMass)) } else { Ok(matrices) }
    }

    fn find(&mut self, matrices: &Matrices) -> Result<Found, Failure> {
        let StageRun { assembly, model, state, plan, .. } = &*self.stage;
        let mut rigid = rigid_motions(assembly, model, state, &plan.places);
        rigid.extend(free_spins(&assembly.system, model, state));
        self.refuse_massless_mechanisms(matrices)?;
        if self.stage.model.lacks_freedom(&self.stage.assembly.system.pattern.dof_map) {
            return Err(self.nothing_moves());
        }
        let has_layers = !self.stage.issued.layers && self.stage.may_have_layers();
        let moment = self.stage.moment();
        let StageRun { assembly, newton, observer, counters, number, plan, model, .. } = &mut *self.stage;
        let scales = model.scales(&assembly.system.pattern.dof_map);
        let mut teller = Teller { observer: &mut **observer, at: moment, number: *number, stages: plan.stages.len() };
        let shift = first_shift(matrices, &assembly.system);
        let mut search = ModeSearch::new(&mut assembly.system, &mut newton.solver, matrices, rigid, scales);
        if has_layers {
            search.keep_shapes();
        }
        let tell = &mut |done| teller.tell(done);
        let found = find_modes(&mut search, shift, self.modes, tell, &mut counters.work)?;
        self.stage.unless_interrupted()?;
        found.ok_or_else(|| self.not_found())
    }

    fn not_found(&self) -> Failure {
        let why = "the modes could not be found: a solve with the tangent failed. Look for stiffnesses or masses near \
                   the limits of floating-point numbers";
        self.stage.moment().limit(why)
    }

    fn nothing_moves(&self) -> Failure {
        let why = "there are no modes: supports, joints and motors leave no motion to what has mass (or stiffnesses and \
                   masses are near the limits of floating-point numbers)";
        self.stage.moment().limit(why)
    }

    /// Refuses motions that neither stiffness nor mass holds.
    fn refuse_massless_mechanisms(&mut self, matrices: &Matrices) -> Result<(), Failure> {
        let StageRun { assembly, newton, model, state, counters, .. } = &mut *self.stage;
        let shift = first_shift(matrices, &assembly.system);
        matrices.combine(shift, &mut assembly.system.values);
        counters.work.factorisations += 1;
        let done = newton.solver.factorise_surely(&assembly.system);
        let loose = mechanism(&mut newton.solver, &mut Tangent::that_stays(assembly, state), model);
        self.stage.unless_interrupted()?;
        if done && loose.is_none() {
            return Ok(());
        }
        Err(self.stage.name_mechanism(loose, &self.stage.assembly.system))
    }

    /// Rayleigh's quotient of a motion with its stiffness from strains: digits that the tangent has
    /// lost are there again, as far as the shape is right.
    fn refine(&mut self, motion: &mut SmallMotion) {
        let Some(ModeShape { mass, .. }) = motion.shape.as_ref().filter(|shape| shape.is_lossy) else { return };
        let Some(field) = self.field(motion) else { return };
        let StageRun { assembly, state, .. } = &mut *self.stage;
        let Some(stiffness) = assembly.stiffness_along(state, &field) else { return };
        let square = -stiffness / mass;
        motion.exponent = match square < 0.0 {
            true => Complex::new(0.0, (-square).sqrt()),
            false => Complex::new(square.sqrt(), 0.0),
        };
        // What is wrong with the shape enters squared.
        motion.uncertainty *= motion.uncertainty;
    }

    /// The increments of the unknowns in a motion, where its shape is known.
    fn field(&self, motion: &SmallMotion) -> Option<Vec<Vec3>> {
        let StageRun { assembly, state, .. } = &*self.stage;
        let mut field = vec![Vec3::ZERO; state.q.len()];
        assembly.system.pattern.dof_map.scatter(&motion.shape.as_ref()?.unknowns, None, &mut field);
        Some(field)
    }

    /// Warns of the first mode whose bending decays over less than elements resolve, once in a run.
    fn warn_of_layers(&mut self, listed: &[SmallMotion]) {
        if self.stage.issued.layers {
            return;
        }
        let unresolved = |motion: &SmallMotion| {
            let energy = motion.shape.as_ref()?.mass * motion.exponent.norm_sqr();
            self.stage.unresolved_along(&self.field(motion)?, energy)
        };
        let found = listed.iter().enumerate().find_map(|(k, motion)| Some((k, unresolved(motion)?)));
        if let Some((k, place)) = found {
            let subject = format!("stage {}, mode {}", self.stage.number + 1, k + 1);
            self.stage.warn_of_layer(&place, &subject);
        }
    }

    fn warn_of_modes(&mut self, found: &Found, listed: &[SmallMotion]) {
        let stage = self.stage.number + 1;
        if found.missing > 0 {
            let missing = found.missing;
            let message = format!("stage {stage}: {missing} more unstable mode(s) exist but were not found");
            self.stage.warn(WarningKind::MissingModes, message);
        }
        if found.is_short {
            let message = format!(
                "stage {stage}: at least one of the requested modes was not found, or is not exact enough to be listed \
                 (soft springs beside stiff beams, and very slender beams on very fine meshes, lose digits: use fewer \
                 elements of a higher order)"
            );
            self.stage.warn(WarningKind::MissingModes, message);
        }
        let worst = listed.iter().enumerate().max_by(|a, b| a.1.uncertainty.total_cmp(&b.1.uncertainty));
        if let Some((number, motion)) = worst.filter(|(_, motion)| motion.uncertainty > TOLD_UNCERTAINTY) {
            let message = format!(
                "stage {stage}: round-off makes the frequency of mode {} uncertain by about {:.1} % (very slender beams on very \
                 fine meshes lose digits: use fewer elements of a higher order)",
                number + 1,
                100.0 * motion.uncertainty
            );
            self.stage.warn(WarningKind::LostDigits, message);
        }
    }
}

/// The modes with the smallest |s| and all further unstable ones, by frequency.
fn listed(found: &Found, modes: usize) -> Vec<SmallMotion> {
    let rigid = SmallMotion { exponent: Complex::default(), uncertainty: 0.0, shape: None };
    let mut all: Vec<SmallMotion> =
        found.motions.iter().cloned().chain(std::iter::repeat_n(rigid, found.rigid)).collect();
    sort_by(&mut all, |a, b| a.exponent.norm().total_cmp(&b.exponent.norm()));
    let further = all.split_off(modes.min(all.len()));
    all.extend(further.into_iter().filter(grows));
    sort(&mut all);
    all
}

fn mode(motion: &SmallMotion) -> Mode {
    // No zero has a sign.
    Mode { omega: motion.exponent.im + 0.0, growth: motion.exponent.re + 0.0 }
}

/// By frequency; of equal frequencies the more unstable first.
fn sort(motions: &mut [SmallMotion]) {
    sort_by(motions, |a, b| a.exponent.im.total_cmp(&b.exponent.im));
    let mut start = 0;
    for k in 1..=motions.len() {
        let apart = k == motions.len()
            || motions[k].exponent.im - motions[start].exponent.im > SAME_FREQUENCY * motions[k].exponent.im;
        if apart {
            sort_by(&mut motions[start..k], |a, b| b.exponent.re.total_cmp(&a.exponent.re));
            start = k;
        }
    }
}
