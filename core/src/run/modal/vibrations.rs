//! Small vibrations about the end of a static stage, which tell its stability where negative pivots
//! do not.
//!
//! Under an unsymmetric tangent K the motions x exp(s t) with (s^2 M + s C + K) x = 0 tell (Bolotin
//! 1963, Nonconservative Problems of the Theory of Elastic Stability). A real s > 0 is divergence,
//! a complex one with a positive real part is flutter. Where det K < 0 there is a real s > 0,
//! whatever masses M and dampers C there are: det(s^2 M + s C + K) is negative at s = 0 and
//! positive for large s. Without masses no more is known: for each K that is not symmetric there
//! are masses with which something grows.

use super::search::{Growth, find_growth, matrices};
use crate::model::{Assembly, StageContext, StageKind};
use crate::run::failure::Failure;
use crate::run::results::Mode;
use crate::run::stage_run::{StageRun, Teller};
use crate::solve::{LinearSolver, ModeSearch, Signature, SmallMotion, Tangent, timed};

/// Number of modes that are looked at, slowest first
const MODES: usize = 32;

/// A mode that grows by more than this part of its |s|, which is no round-off, tells enough.
const ENOUGH_GROWTH: f64 = 1e-3;

/// Growth that is less than so many times what round-off may have taken of |s| is in doubt.
const SURELY: f64 = 10.0;

/// With more unknowns no modes are looked for: that would take longer than the stage.
const MOST_UNKNOWNS: usize = 20_000;

/// Small vibrations about an equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::run) enum Vibrations {
    /// The number of negative eigenvalues of the tangent, which is symmetric
    Counted(usize),
    /// None of those that were looked at grows.
    Bounded,
    /// This one grows, fastest of those that were found.
    Growing(Mode),
    /// Some grow, whatever masses there are.
    Diverging,
    /// Not known
    Unknown,
}

/// Small vibrations about the state of a stage, in space and with the masses and dampers of the
/// scene. `signature`: of the tangent as the stage is treated.
pub(in crate::run) fn vibrations(stage: &mut StageRun, signature: Option<Signature>) -> Result<Vibrations, Failure> {
    // Points that slide have no tangent for small vibrations.
    if stage.is_linear() || stage.state.contacts.touches() {
        return Ok(Vibrations::Unknown);
    }
    let own = stage.stage().context(stage.number);
    let context = StageContext { kind: StageKind::Modal, ..own };
    let dof_map = stage.schedule.dof_map(stage.model, None).map_err(|error| stage.describe(error))?;
    let is_massless = stage.model.lacks_mass(&context, &dof_map);
    let is_even_in_space = stage.plane.is_none() && signature.is_some_and(|signature| !signature.tells_unstable());
    if dof_map.count() > MOST_UNKNOWNS || (is_massless && is_even_in_space) {
        return Ok(Vibrations::Unknown);
    }
    let mut assembly = Assembly::about(stage.state, &context, dof_map, stage.model);
    let Some(mut solver) = LinearSolver::new(&assembly.system, &stage.model.kinds, stage.model.length) else {
        return Ok(Vibrations::Unknown);
    };
    let matrices = matrices(&mut assembly, stage.state, stage.model);
    stage.counters.work.factorisations += 1;
    // Without digits signs tell nothing, nor where a motion has no stiffness, such as a spin that
    // statics holds.
    let is_sure = solver.factorise_surely(&assembly.system);
    if !is_sure || solver.null_vector(&mut Tangent::that_stays(&mut assembly, stage.state)).is_some() {
        return Ok(Vibrations::Unknown);
    }
    // In a plane no direction out of it takes part.
    if let Some(Signature::Parity { is_odd: true }) = signature {
        return Ok(Vibrations::Diverging);
    }
    match solver.signature_of_last(&assembly.system) {
        Some(Signature::Negative(count)) if pivots_tell(count, context.rotating) => {
            return Ok(Vibrations::Counted(count));
        }
        Some(Signature::Negative(_)) => {}
        Some(Signature::Parity { is_odd: true }) => return Ok(Vibrations::Diverging),
        Some(Signature::Parity { is_odd: false }) | None => {}
    }
    if is_massless || matrices.is_massless() {
        return Ok(Vibrations::Unknown);
    }
    let at = stage.moment();
    let StageRun { observer, counters, number, plan, model, .. } = stage;
    let mut teller = Teller { observer: &mut **observer, at, number: *number, stages: plan.stages.len() };
    // The stage itself lies behind.
    teller.tell(1.0)?;
    let scales = model.scales(&assembly.system.pattern.dof_map);
    let mut search = ModeSearch::new(&mut assembly.system, &mut solver, &matrices, Vec::new(), scales);
    let found = timed(&mut counters.work.solve_seconds, || find_growth(&mut search, MODES, ENOUGH_GROWTH));
    counters.work.factorisations += search.factorisations;
    Ok(found.map_or(Vibrations::Unknown, |growth| judge(&growth)))
}

/// True if the number of negative pivots tells stability: in a rotating frame Coriolis forces may hold
/// an even number of unstable directions, and never an odd one (Thomson and Tait 1879).
pub(in crate::run) fn pivots_tell(negative: usize, is_rotating: bool) -> bool {
    !is_rotating || negative == 0 || negative % 2 == 1
}

/// The verdict of the motions that grow.
fn judge(growth: &Growth) -> Vibrations {
    let surely = |motion: &&SmallMotion| motion.exponent.re > SURELY * motion.uncertainty * motion.exponent.norm();
    let fastest = growth.growing.iter().filter(surely).max_by(|a, b| a.exponent.re.total_cmp(&b.exponent.re));
    match fastest {
        Some(motion) => Vibrations::Growing(Mode { omega: motion.exponent.im, growth: motion.exponent.re }),
        None if growth.growing.is_empty() && growth.is_sure => Vibrations::Bounded,
        None => Vibrations::Unknown,
    }
}
