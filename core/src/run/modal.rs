//! Small motions about the state that was reached: (s^2 M + s C + K) x = 0.

use super::analysis_results::Mode;
use super::failure::Failure;
use super::rigid::{free_spins, rigid_motions};
use super::stage_run::{Run, StageRun};
use crate::kernel::Weights;
use crate::model::{Assembly, Model, StageError};
use crate::solve::{
    Convergence, LinearSolver, Matrices, ModeSearch, ModeShape, SmallMotion, Tangent, Verdict, mechanism, timed,
};
use crate::system::System;
use crate::tensor::Vec3;
use crate::warning::WarningKind;
use nalgebra::Complex;

/// Part of the lowest frequencies at which the first look is taken.
const FIRST_SHIFT: f64 = 1e-4;
/// Part of the lowest frequency found at which the others are taken: near enough to tell rigid motions from elastic ones.
const SHIFT: f64 = 0.3;
/// A shift is near enough if it is not larger than this part of the lowest frequency.
const NEAR_SHIFT: f64 = 0.5;
/// Looks until the shift is near enough
const MOST_LOOKS: usize = 6;
/// More than asked for are searched where the number of unstable ones is not known.
const SPARE: usize = 24;
/// Shifts further out from which unstable modes are searched then, times the first
const FURTHER: [f64; 2] = [10.0, 100.0];
/// Times that a shift is moved up until nothing grows faster
const MOST_DOUBLINGS: usize = 64;
/// Times that more modes are searched where some are missing.
const MOST_SEARCHES: usize = 4;
/// Two frequencies that agree to this are one, and the more unstable mode comes first.
const SAME_FREQUENCY: f64 = 1e-7;
/// Exponents that agree to this, relative, are one that two looks have found.
const SAME: f64 = 1e-6;
/// Growth above this part of |s| is no round-off.
const GROWS: f64 = 1e-6;
/// Motions slower than this part of the others tell nothing of their frequencies.
const FREE: f64 = 1e-4;
/// Uncertainty of a frequency that is told.
const TOLD: f64 = 1e-3;

/// The modes of a stage, and what is known about them.
#[derive(Default)]
pub(super) struct Found {
    pub motions: Vec<SmallMotion>,
    /// Rigid motions of free parts
    rigid: usize,
    /// Unstable modes that are known to be there and were not found
    missing: usize,
    /// Whether pivots count more among those that are asked for than were found
    is_short: bool,
}

impl Found {
    fn growing(&self) -> usize {
        self.motions.iter().filter(|motion| grows(motion)).count()
    }
}

impl Run<'_> {
    /// The modes with the lowest frequencies, and all unstable ones.
    pub(super) fn run_modal(&mut self, workshop: &mut StageRun, modes: usize) -> Result<(), Failure> {
        self.observer.progress(self.moment(), self.static_progress(0.0))?;
        let moving = self.state.clone();
        self.stand_still();
        let (time, load) = (self.state.time, self.state.load);
        self.schedule.set_clock(&self.model, &mut self.state, time, load);
        self.change_charts(None);
        self.open_account(workshop)?;
        self.warn_out_of_balance(workshop);
        let matrices = self.matrices(&mut workshop.assembly);
        if matrices.is_massless() {
            return Err(self.describe(StageError::NoMass));
        }
        let mut rigid = rigid_motions(&workshop.assembly.system, &self.model, &self.state, &self.plan.places);
        rigid.extend(free_spins(&workshop.assembly.system, &self.model, &self.state));
        self.refuse_massless_mechanisms(workshop, &matrices)?;
        let StageRun { assembly, newton, .. } = &mut *workshop;
        let found = self.find_modes(assembly, &mut newton.solver, &matrices, rigid, modes, 0.0)?;
        let found = found
            .ok_or_else(|| Failure::Limit("the modes could not be found: a solve with the tangent failed".into()))?;
        let mut listed = listed(&found, modes);
        listed.iter_mut().for_each(|motion| self.refine(workshop, motion));
        self.warn_of_modes(&found, &listed);
        self.count_steps();
        // What moved moves on.
        self.state.copy_rates(&moving);
        let listed: Vec<Mode> = listed.iter().map(mode).collect();
        self.observer.modes(self.stage + 1, &listed)
    }

    /// No velocities: modes and paths are looked at from rest.
    pub(super) fn stand_still(&mut self) {
        self.state.stand_still();
    }

    pub(super) fn warn_out_of_balance(&mut self, workshop: &mut StageRun) {
        workshop.assembly.forget();
        let round_off = workshop.assembly.round_off(&self.state);
        workshop.assembly.evaluate(&self.state, Weights::NONE, None);
        let loose = Convergence { tolerance: 1e-5 };
        let (verdict, _) = loose.judge(&self.model, &workshop.assembly.system, round_off, None);
        if !matches!(verdict, Verdict::Converged | Verdict::Noisy) {
            let message = "the state of a modal or buckling stage is not in balance: let a static stage come before it";
            self.warn(WarningKind::OutOfBalance, message);
        }
    }

    /// K, C and M; the system is left with K and the forces.
    pub(super) fn matrices(&mut self, assembly: &mut Assembly) -> Matrices {
        let mut part = |weights: Weights| {
            assembly.evaluate(&self.state, weights, None);
            assembly.system.values.clone()
        };
        let (damping, mut mass, stiffness) = (part(Weights::DAMPING), part(Weights::MASS), part(Weights::STIFFNESS));
        drop_multipliers(&assembly.system, &self.model, &mut mass);
        Matrices { stiffness, damping, mass }
    }

    /// A few looks place the shift below the lowest frequency; then all modes are searched from there. `begun`: the part of the stage that
    /// lies behind. `None` where a solve with the tangent fails.
    pub(super) fn find_modes(
        &mut self,
        assembly: &mut Assembly,
        solver: &mut LinearSolver,
        matrices: &Matrices,
        rigid: Vec<Vec<f64>>,
        modes: usize,
        begun: f64,
    ) -> Result<Option<Found>, Failure> {
        let mut shift = first_shift(matrices, &assembly.system);
        let done = |part: f64| begun + (1.0 - begun) * part;
        let mut search = ModeSearch::new(&mut assembly.system, solver, matrices, rigid);
        for look in 0..MOST_LOOKS {
            let looked = 0.5 * look as f64 / MOST_LOOKS as f64;
            self.observer.progress(self.moment(), self.static_progress(done(looked)))?;
            let Some(sizes) = search.factorise(shift).then(|| search.roughly_nearest()).flatten() else {
                return Ok(None);
            };
            let Some(lowest) = lowest(&sizes) else { break };
            if look > 0 && shift <= NEAR_SHIFT * lowest {
                break;
            }
            shift = SHIFT * lowest;
        }
        self.observer.progress(self.moment(), self.static_progress(done(0.5)))?;
        let found = timed(&mut self.counters.work.solve_seconds, || find_all(&mut search, shift, modes));
        self.counters.work.factorisations += search.factorisations;
        Ok(found)
    }

    /// What neither stiffness nor mass holds.
    fn refuse_massless_mechanisms(&mut self, workshop: &mut StageRun, matrices: &Matrices) -> Result<(), Failure> {
        let StageRun { assembly, newton, .. } = workshop;
        let shift = first_shift(matrices, &assembly.system);
        matrices.combine(shift, &mut assembly.system.values);
        self.counters.work.factorisations += 1;
        let done = newton.solver.factorise_surely(&assembly.system);
        let loose = mechanism(&mut newton.solver, &mut Tangent::that_stays(assembly, &self.state), &self.model);
        if done && loose.is_none() { Ok(()) } else { Err(self.name_mechanism(loose, &workshop.assembly.system)) }
    }

    /// Rayleigh's quotient of a motion with its stiffness from strains: digits that the tangent has lost are there again, as far as the
    /// shape is right.
    fn refine(&mut self, workshop: &mut StageRun, motion: &mut SmallMotion) {
        let Some(ModeShape { unknowns, mass }) = motion.shape.take() else { return };
        let mut field = vec![Vec3::ZERO; self.state.q.len()];
        workshop.assembly.system.pattern.dof_map.scatter(&unknowns, None, &mut field);
        let Some(stiffness) = workshop.assembly.stiffness_along(&self.state, &field) else { return };
        let square = -stiffness / mass;
        motion.exponent = match square < 0.0 {
            true => Complex::new(0.0, (-square).sqrt()),
            false => Complex::new(square.sqrt(), 0.0),
        };
        // What is wrong with the shape enters squared.
        motion.uncertainty *= motion.uncertainty;
    }

    fn warn_of_modes(&mut self, found: &Found, listed: &[SmallMotion]) {
        let stage = self.stage + 1;
        if found.missing > 0 {
            let missing = found.missing;
            let message = format!("stage {stage}: {missing} more unstable mode(s) exist and were not found");
            self.warn(WarningKind::MissingModes, message);
        }
        if found.is_short {
            let message = format!(
                "stage {stage}: a mode among those that are asked for was not found: pivots count more of them (very slender beams on \
                 very fine meshes lose digits: use fewer elements of a higher order)"
            );
            self.warn(WarningKind::MissingModes, message);
        }
        let worst = listed.iter().enumerate().max_by(|a, b| a.1.uncertainty.total_cmp(&b.1.uncertainty));
        if let Some((number, motion)) = worst.filter(|(_, motion)| motion.uncertainty > TOLD) {
            let message = format!(
                "stage {stage}: round-off makes the frequency of mode {} uncertain by about {:.1} % (very slender beams on very \
                 fine meshes lose digits: use fewer elements of a higher order)",
                number + 1,
                100.0 * motion.uncertainty
            );
            self.warn(WarningKind::LostDigits, message);
        }
    }
}

/// Where the first look is taken.
fn first_shift(matrices: &Matrices, system: &System) -> f64 {
    let shift = FIRST_SHIFT * matrices.softest_frequency(system);
    // Else nothing holds anything: every mode is a free motion.
    if shift > 0.0 && shift.is_finite() { shift } else { 1.0 }
}

/// All modes that are asked for, and all unstable ones: where pivots count them, until they are complete; else among more than are asked
/// for, and from shifts further out. `None` where a solution fails.
fn find_all(search: &mut ModeSearch, shift: f64, modes: usize) -> Option<Found> {
    let mut found = Found { rigid: search.rigid(), ..Found::default() };
    if !search.factorise(shift) {
        return None;
    }
    let Some(unstable) = search.growing() else {
        let is_held = search.is_held();
        found.motions = search.nearest(modes + SPARE)?;
        let further = FURTHER.map(|times| times * shift);
        let unseen = further.into_iter().filter(|&further| !is_held && !search.reaches(&found.motions, further));
        for further in unseen.collect::<Vec<f64>>() {
            add_new(&mut found.motions, growing_from(search, further, SPARE));
        }
        return Some(found);
    };
    let mut wanted = modes + unstable + 2;
    for _ in 0..MOST_SEARCHES {
        found.motions = look(search, shift, wanted)?;
        if found.growing() < unstable {
            find_growing(search, shift, &mut found, unstable);
        }
        found.missing = unstable.saturating_sub(found.growing());
        found.is_short = found.missing == 0 && !is_complete(search, &found, modes);
        if found.missing == 0 && !found.is_short {
            break;
        }
        wanted *= 2;
    }
    Some(found)
}

/// The motions nearest to a shift; `None` where a solution fails.
fn look(search: &mut ModeSearch, shift: f64, wanted: usize) -> Option<Vec<SmallMotion>> {
    if search.factorise(shift) { search.nearest(wanted) } else { None }
}

/// Of these the ones that grow; none where a shift hits a motion.
fn growing_from(search: &mut ModeSearch, shift: f64, wanted: usize) -> Vec<SmallMotion> {
    look(search, shift, wanted).unwrap_or_default().into_iter().filter(grows).collect()
}

/// From above: at a shift behind which nothing grows any faster. All of them are there then, or those that are new are added.
fn find_growing(search: &mut ModeSearch, shift: f64, found: &mut Found, unstable: usize) {
    let mut above = shift;
    for _ in 0..MOST_DOUBLINGS {
        above *= 4.0;
        match search.factorise(above).then(|| search.growing()).flatten() {
            Some(0) => break,
            Some(_) => {}
            None => return,
        }
    }
    let fastest = growing_from(search, above, unstable + 2);
    if fastest.len() >= unstable {
        found.motions.retain(|motion| !grows(motion));
        found.motions.extend(fastest);
    } else {
        add_new(&mut found.motions, fastest);
    }
}

/// Whether no mode is missing among those that are asked for: as many pivots are negative at a frequency behind them.
fn is_complete(search: &mut ModeSearch, found: &Found, modes: usize) -> bool {
    let mut omegas: Vec<f64> = found.motions.iter().filter(|motion| !grows(motion)).map(|m| m.exponent.im).collect();
    omegas.sort_by(f64::total_cmp);
    let first = modes.saturating_sub(found.rigid + found.growing()).max(1);
    // The widest gap behind the last mode that is asked for.
    let gaps = (first..omegas.len()).map(|k| (omegas[k] - omegas[k - 1], k));
    let Some((gap, behind)) = gaps.max_by(|a, b| a.0.total_cmp(&b.0)) else { return true };
    let at = omegas[behind] - 0.5 * gap;
    gap <= SAME * at || search.slower(at).is_none_or(|count| count == found.rigid + found.growing() + behind)
}

/// The slowest motion that something holds.
fn lowest(sizes: &[f64]) -> Option<f64> {
    let highest = sizes.iter().copied().fold(0.0, f64::max);
    sizes.iter().copied().filter(|&size| size > FREE * highest).reduce(f64::min)
}

pub(super) fn grows(motion: &SmallMotion) -> bool {
    motion.exponent.re > GROWS * motion.exponent.norm()
}

/// Adds motions that are not known yet.
fn add_new(motions: &mut Vec<SmallMotion>, more: Vec<SmallMotion>) {
    for motion in more {
        let same = |known: &SmallMotion| (known.exponent - motion.exponent).norm() <= SAME * motion.exponent.norm();
        if !motions.iter().any(same) {
            motions.push(motion);
        }
    }
}

/// The first modes by frequency, of those that are slowest or unstable, and all other unstable ones behind them.
fn listed(found: &Found, modes: usize) -> Vec<SmallMotion> {
    let rigid = SmallMotion { exponent: Complex::default(), uncertainty: 0.0, shape: None };
    let mut stable: Vec<SmallMotion> = found.motions.iter().filter(|motion| !grows(motion)).cloned().collect();
    stable.extend(std::iter::repeat_n(rigid, found.rigid));
    stable.sort_by(|a, b| a.exponent.norm().total_cmp(&b.exponent.norm()));
    stable.truncate(modes);
    let mut all: Vec<SmallMotion> =
        found.motions.iter().filter(|motion| grows(motion)).cloned().chain(stable).collect();
    sort(&mut all);
    let is_listed = |(number, motion): &(usize, SmallMotion)| *number < modes || grows(motion);
    all.into_iter().enumerate().filter(is_listed).map(|(_, motion)| motion).collect()
}

fn mode(motion: &SmallMotion) -> Mode {
    Mode { omega: motion.exponent.im, growth: motion.exponent.re }
}

/// Multipliers have no mass.
fn drop_multipliers(system: &System, model: &Model, values: &mut [f64]) {
    let pattern = &system.pattern;
    let is_multiplier: Vec<bool> = (0..pattern.dof_map.count())
        .map(|k| model.kinds[pattern.dof_map.direction(k).slot as usize].is_multiplier())
        .collect();
    for (column, &own) in is_multiplier.iter().enumerate() {
        for entry in pattern.entries(column as u32).filter(|entry| own || is_multiplier[entry.row as usize]) {
            values[entry.place] = 0.0;
        }
    }
}

/// By frequency; of equal frequencies the more unstable first.
fn sort(motions: &mut [SmallMotion]) {
    motions.sort_by(|a, b| a.exponent.im.total_cmp(&b.exponent.im));
    let mut start = 0;
    for k in 1..=motions.len() {
        let apart = k == motions.len()
            || motions[k].exponent.im - motions[start].exponent.im > SAME_FREQUENCY * motions[k].exponent.im;
        if apart {
            motions[start..k].sort_by(|a, b| b.exponent.re.total_cmp(&a.exponent.re));
            start = k;
        }
    }
}
