//! A search for small motions: the slowest ones, and all that grow.

use crate::kernel::Weights;
use crate::model::{Assembly, Model};
use crate::run::failure::Failure;
use crate::solve::{MIN_GROWTH_RATIO, Matrices, ModeSearch, Nearest, SmallMotion, Work, timed};
use crate::sorting::sort_numbers;
use crate::system::{State, System};
use nalgebra::Complex;

/// Part of the lowest frequencies at which the first look is taken.
const FIRST_SHIFT: f64 = 1e-4;
/// Part of the lowest frequency found at which the others are taken: near enough to tell rigid
/// motions from elastic ones.
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
/// Exponents that agree to this, relative, are one that two looks have found.
const SAME: f64 = 1e-6;
/// Motions slower than this part of the others tell nothing of their frequencies.
const FREE: f64 = 1e-4;

/// Growth from which on a motion that failed verification counts as growing, over |s|: smaller growth is its error.
const MAY_GROW: f64 = 1e-3;

/// Motions that failed verification are searched from a shift of their own if that is so many times higher: next to the
/// first shift they would fail again.
const FAR_ABOVE: f64 = 10.0;

/// The modes of a stage, and what is known about them.
#[derive(Default)]
pub struct Found {
    pub(super) motions: Vec<SmallMotion>,
    /// Exponents of motions that failed verification
    failed: Vec<Complex<f64>>,
    /// Rigid motions of free parts
    pub(super) rigid: usize,
    /// Unstable modes that are known to be there and were not found
    pub(super) missing: usize,
    /// Pivots count more among those that are asked for than were found, or some of them failed verification.
    pub(super) is_short: bool,
}

impl Found {
    pub fn growing(&self) -> usize {
        self.motions.iter().filter(|motion| grows(motion)).count()
    }

    fn take(&mut self, nearest: Nearest) {
        (self.motions, self.failed) = (nearest.motions, nearest.failed);
    }

    /// True if motions that failed verification may be among those that are asked for, or grow.
    fn lacks_failed(&self, modes: usize) -> bool {
        let mut sizes: Vec<f64> = self.motions.iter().map(|motion| motion.exponent.norm()).collect();
        sizes.extend(std::iter::repeat_n(0.0, self.rigid));
        sort_numbers(&mut sizes);
        let last = modes.checked_sub(1).map_or(0.0, |last| sizes.get(last).copied().unwrap_or(f64::INFINITY));
        let is_asked_for = |exponent: &Complex<f64>| exponent.norm() < last || exponent.re > MAY_GROW * exponent.norm();
        self.failed.iter().any(is_asked_for)
    }
}

/// K, C and M of a state; the system is left with K and the forces.
pub fn matrices(assembly: &mut Assembly, state: &State, model: &Model) -> Matrices {
    let mut part = |weights: Weights| {
        assembly.evaluate(state, weights, None);
        assembly.system.values.clone()
    };
    let damping = part(Weights::DAMPING);
    let mut mass = part(Weights::MASS);
    let stiffness = part(Weights::STIFFNESS);
    drop_multipliers(&assembly.system, model, &mut mass);
    Matrices { stiffness, damping, mass }
}

/// Multipliers have no mass.
fn drop_multipliers(system: &System, model: &Model, values: &mut [f64]) {
    if model.multipliers.is_empty() {
        return;
    }
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

/// A few looks place the shift below the lowest frequency, from `shift` on; then `modes` modes and
/// all that grow are searched from there. `tell` is told the part of the search that lies behind.
/// `None` where a solve with the tangent fails.
pub fn find_modes(
    search: &mut ModeSearch,
    mut shift: f64,
    modes: usize,
    tell: &mut dyn FnMut(f64) -> Result<(), Failure>,
    work: &mut Work,
) -> Result<Option<Found>, Failure> {
    for look in 0..MOST_LOOKS {
        tell(0.5 * look as f64 / MOST_LOOKS as f64)?;
        let Some(sizes) = search.factorise(shift).then(|| search.roughly_nearest()).flatten() else {
            return Ok(None);
        };
        let Some(lowest) = lowest(&sizes) else { break };
        if look > 0 && shift <= NEAR_SHIFT * lowest {
            break;
        }
        shift = SHIFT * lowest;
    }
    tell(0.5)?;
    let found = timed(&mut work.solve_seconds, || find_all(search, shift, modes));
    work.factorisations += search.factorisations;
    Ok(found)
}

/// Where the first look is taken.
pub fn first_shift(matrices: &Matrices, system: &System) -> f64 {
    let shift = FIRST_SHIFT * matrices.softest_frequency(system);
    // Else nothing holds anything: every mode is a free motion.
    if shift > 0.0 && shift.is_finite() { shift } else { 1.0 }
}

/// All modes that are asked for, and all unstable ones: where pivots count them, until they are
/// complete; else among more than are asked for, and from shifts further out. `None` where a
/// solution fails.
fn find_all(search: &mut ModeSearch, shift: f64, modes: usize) -> Option<Found> {
    let mut found = Found { rigid: search.rigid(), ..Found::default() };
    if !search.factorise(shift) {
        return None;
    }
    let Some(unstable) = search.growing() else {
        let is_held = search.is_held();
        found.take(search.nearest(modes + SPARE)?);
        found.is_short = found.lacks_failed(modes);
        let exponents: Vec<Complex<f64>> = found.motions.iter().map(|motion| motion.exponent).collect();
        for further in unseen(search, &exponents, shift).filter(|_| !is_held) {
            add_new(&mut found.motions, growing_from(search, further, SPARE));
        }
        return Some(found);
    };
    let mut wanted = modes + unstable + 2;
    for _ in 0..MOST_SEARCHES {
        found.take(look_in_parts(search, shift, wanted)?);
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

/// Motions that grow.
pub struct Growth {
    /// The motions, verified
    pub(super) growing: Vec<SmallMotion>,
    /// False if others may have been missed
    pub(super) is_sure: bool,
}

/// Motions that grow, among the `modes` slowest and among those around shifts further out that these
/// do not reach. The search ends as soon as one grows by more than the part `enough` of its |s|. K
/// must be the matrix factorised last. `None` where a solution fails, or nothing is found.
pub fn find_growth(search: &mut ModeSearch, modes: usize, enough: f64) -> Option<Growth> {
    let shift = SHIFT * search.slowest_frequency()?;
    if !search.factorise(shift) {
        return None;
    }
    let is_held = search.is_held();
    let slowest = search.growth(modes, enough)?;
    if slowest.exponents.is_empty() {
        return None;
    }
    let mut growth = Growth { growing: slowest.growing, is_sure: slowest.is_sure };
    let is_enough = |motion: &SmallMotion| motion.exponent.re > enough * motion.exponent.norm();
    for further in unseen(search, &slowest.exponents, shift).filter(|_| !is_held) {
        if growth.growing.iter().any(is_enough) {
            break;
        }
        if let Some(found) = search.factorise(further).then(|| search.growth(SPARE, enough)).flatten() {
            growth.growing.extend(found.growing);
        }
    }
    Some(growth)
}

/// Shifts further out that motions with these exponents, nearest to `shift`, do not reach.
fn unseen(search: &ModeSearch, exponents: &[Complex<f64>], shift: f64) -> std::vec::IntoIter<f64> {
    let further = FURTHER.map(|times| times * shift);
    let unseen = further.into_iter().filter(|&further| !search.reaches(exponents.iter().copied(), further));
    unseen.collect::<Vec<f64>>().into_iter()
}

/// The motions nearest to a shift; `None` where a solution fails.
fn look(search: &mut ModeSearch, shift: f64, wanted: usize) -> Option<Nearest> {
    if search.factorise(shift) { search.nearest(wanted) } else { None }
}

/// The motions nearest to a shift. Where far slower ones take the digits of others, these are searched from a shift of
/// their own. `None` where a solution fails.
fn look_in_parts(search: &mut ModeSearch, shift: f64, wanted: usize) -> Option<Nearest> {
    let mut all = look(search, shift, wanted)?;
    let slowest = all.failed.iter().map(|exponent| exponent.norm()).fold(f64::INFINITY, f64::min);
    if !slowest.is_finite() || SHIFT * slowest < FAR_ABOVE * shift {
        return Some(all);
    }
    let is_slow = |exponent: &Complex<f64>| exponent.norm() < 0.5 * slowest;
    let others = look(search, SHIFT * slowest, wanted)?;
    all.motions.retain(|motion| is_slow(&motion.exponent) || grows(motion));
    all.motions.extend(others.motions.into_iter().filter(|motion| !is_slow(&motion.exponent) && !grows(motion)));
    all.failed = others.failed.into_iter().filter(|exponent| !is_slow(exponent)).collect();
    Some(all)
}

/// The motions nearest to a shift that grow; none where the shift hits a motion.
fn growing_from(search: &mut ModeSearch, shift: f64, wanted: usize) -> Vec<SmallMotion> {
    look(search, shift, wanted).unwrap_or_default().motions.into_iter().filter(grows).collect()
}

/// From above: at a shift behind which nothing grows any faster. All of them are there then, or
/// those that are new are added.
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

/// True if no mode is missing among those that are asked for: as many pivots are negative at a
/// frequency behind them.
fn is_complete(search: &mut ModeSearch, found: &Found, modes: usize) -> bool {
    let mut omegas: Vec<f64> = found.motions.iter().filter(|motion| !grows(motion)).map(|m| m.exponent.im).collect();
    sort_numbers(&mut omegas);
    let first = modes.saturating_sub(found.rigid + found.growing()).max(1);
    // The widest gap behind the last mode that is asked for.
    let gaps = (first..omegas.len()).map(|k| (omegas[k] - omegas[k - 1], k));
    let Some((gap, behind)) = gaps.max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return !found.lacks_failed(modes);
    };
    let at = omegas[behind] - 0.5 * gap;
    gap <= SAME * at || search.slower(at).is_none_or(|count| count == found.rigid + found.growing() + behind)
}

/// The slowest motion that something holds.
fn lowest(sizes: &[f64]) -> Option<f64> {
    let highest = sizes.iter().copied().fold(0.0, f64::max);
    sizes.iter().copied().filter(|&size| size > FREE * highest).reduce(f64::min)
}

pub fn grows(motion: &SmallMotion) -> bool {
    motion.exponent.re > MIN_GROWTH_RATIO * motion.exponent.norm()
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
