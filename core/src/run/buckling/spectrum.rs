//! Critical loads as they look from a state: the eigenvalues of its tangent and of how that varies
//! along the path.

use crate::effect::ContactChange;
use crate::kernel::Weights;
use crate::model::SlotKind;
use crate::run::failure::Failure;
use crate::run::stage_run::StageRun;
use crate::run::statics::PathDirection;
use crate::solve::{First, LinearSolver, Operator, Tangent, is_symmetric, leading_eigenvalues_until, mechanism};
use crate::sorting::sort_by;
use crate::system::{DofMap, Slot, State, System};
use crate::tensor::{Mat3, Vec3};
use nalgebra::Complex;

/// How far the state is moved along the path to see the tangent vary: lengths of the scene, and
/// radians.
const PROBE: f64 = 1e-5;
/// The ways along the path that are tried where contacts may open on them, over the usual one.
const REACHES_IN_CONTACT: [f64; 6] = [1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5];
/// Imaginary part up to which the distance of a critical load counts as real, relative to it; double ones come apart a
/// little.
const REAL: f64 = 1e-3;
/// The imaginary part of a distance, relative to it, up to which it counts as real under unsymmetric tangents: unequal meshes
/// bring double loads further apart there.
const NEARLY_REAL: f64 = 1e-2;
/// The imaginary part of a distance, relative to the critical load, up to which it counts as real under unsymmetric tangents: from
/// near by the distance itself is small.
const NEARLY_REAL_OF_LOAD: f64 = 1e-3;

/// Two critical loads whose distances from the present load differ by less, relative to these, are a pair: those seen
/// differed by up to 1.5 %, since the tangent itself is not zero between them.
const PAIRED: f64 = 0.05;

/// The number of negative pivots of the tangent at the present state; `None` where it is not
/// symmetric.
pub fn negative_pivots(stage: &mut StageRun) -> Option<usize> {
    with_held_contacts(stage, |stage| {
        let StageRun { assembly, newton, state, .. } = stage;
        assembly.forget();
        assembly.evaluate(state, Weights::STIFFNESS, None);
        newton.solver.negative_pivots(&mut Tangent::that_may_go(assembly, state, Weights::STIFFNESS))
    })
}

/// The direction of the path at the present state.
pub fn direction(stage: &mut StageRun) -> Result<Option<PathDirection>, Failure> {
    with_held_contacts(stage, |stage| stage.path_direction())
}

/// A look at the tangent of the present state with the points that touch held as they are: the stiffness of contacts that
/// load levels begin with may be small beside that of the structure. Levels go on with the stiffness that they had.
fn with_held_contacts<T>(stage: &mut StageRun, look: impl FnOnce(&mut StageRun) -> T) -> T {
    let Some(contacts) = stage.model.contacts().filter(|_| stage.state.contacts.touches()) else { return look(stage) };
    let memory = stage.state.contacts.clone();
    contacts.hold(stage.state);
    let seen = look(stage);
    stage.state.contacts = memory;
    stage.assembly.forget();
    seen
}

/// The critical loads as they look from the present state: so many, those above it first.
pub fn critical_loads(stage: &mut StageRun, modes: usize) -> Result<Vec<f64>, Failure> {
    let is_enough = |ahead: &[f64]| ahead.iter().filter(|&&ahead| ahead > 0.0).count() >= modes;
    let mut loads = nearest_critical_loads(stage, modes, First::Positive, &is_enough)?;
    loads.truncate(modes);
    Ok(loads)
}

/// The critical loads on both sides of the present one, as they look from the present state, without pairs at equal
/// distances. Where the path turns stiff directions fast, K + m K' is singular at some +m and -m, though the tangent on
/// the path is not: K' has terms of EA in bending then, and no square of them in K.
pub fn unpaired_critical_loads(stage: &mut StageRun, modes: usize) -> Result<Vec<f64>, Failure> {
    let load = stage.state.load;
    let is_enough = |ahead: &[f64]| ahead.iter().filter(|&&ahead| ahead > 0.0).count() >= modes;
    let loads = nearest_critical_loads(stage, modes, First::Largest, &is_enough)?;
    let is_pair = |a: f64, b: f64| (a + b).abs() < PAIRED * a.abs();
    let is_paired = |critical: f64| loads.iter().any(|other| is_pair(critical - load, other - load));
    Ok(loads.iter().copied().filter(|&critical| !is_paired(critical)).collect())
}

/// The critical load with `before` others between it and the present one in the direction `way`, as it looks from
/// here, if it is among the nearest on both sides.
pub fn next_critical_load(stage: &mut StageRun, way: f64, before: usize) -> Result<Option<f64>, Failure> {
    let load = stage.state.load;
    let lies_there = |ahead: f64| ahead * way > 0.0;
    let is_enough = |ahead: &[f64]| ahead.iter().filter(|&&ahead| lies_there(ahead)).count() > before;
    let loads = nearest_critical_loads(stage, before + 4, First::Largest, &is_enough)?;
    Ok(loads.into_iter().filter(|critical| lies_there(critical - load)).nth(before))
}

/// The critical loads nearest to the present one, as they look from the present state; those above it come first.
/// `first` are looked for those on one side. There are so many that `is_enough`, which is given their distances from the
/// present load, or `modes` and some more.
fn nearest_critical_loads(
    stage: &mut StageRun,
    modes: usize,
    first: First,
    is_enough: &dyn Fn(&[f64]) -> bool,
) -> Result<Vec<f64>, Failure> {
    with_held_contacts(stage, |stage| nearest_of_tangent(stage, modes, first, is_enough))
}

/// As [`nearest_critical_loads`], of the tangent with the present stiffness of contacts.
fn nearest_of_tangent(
    stage: &mut StageRun,
    modes: usize,
    first: First,
    is_enough: &dyn Fn(&[f64]) -> bool,
) -> Result<Vec<f64>, Failure> {
    let Some(PathDirection { rate: direction, .. }) = stage.path_direction()? else { return Ok(Vec::new()) };
    let length = stage.model.length;
    let moving = direction.iter().zip(stage.model.kinds.iter()).filter(|(_, kind)| !kind.is_multiplier());
    let size = moving.map(|(d, kind)| d.norm() * kind.arm(length) / length).fold(0.0, f64::max);
    let reach = if size > 0.0 { (PROBE / size).min(1e6) } else { 1.0 };
    let reach = reach_in_contact(stage, &direction, reach);
    let varied = varied_tangent(stage, &direction, reach);
    let StageRun { assembly, newton, model, state, counters, .. } = stage;
    assembly.evaluate(state, Weights::STIFFNESS, None);
    counters.work.factorisations += 1;
    let done = newton.solver.factorise_surely(&assembly.system);
    let mut tangent = Tangent::that_stays(assembly, state);
    if !done {
        let vector = mechanism(&mut newton.solver, &mut tangent, model);
        stage.unless_interrupted()?;
        return Err(stage.name_mechanism(vector, &stage.assembly.system));
    }
    // A stable state of a conservative scene: the tangent is an inner product in which everything
    // is symmetric.
    let negative = newton.solver.negative_pivots(&mut tangent);
    let stable = negative == Some(0);
    let system = &assembly.system;
    let symmetric = stable && model.multipliers.is_empty();
    let symmetric = symmetric && is_symmetric(&system.pattern, &varied.difference());
    let mut operator = Softening { system, varied: &varied, solver: &mut newton.solver, symmetric };
    let load = state.load;
    let is_real = |distance: &Complex<f64>| {
        let largest = match negative {
            Some(_) => REAL * distance.norm(),
            None => (NEARLY_REAL * distance.norm()).max(NEARLY_REAL_OF_LOAD * (load + distance.re).abs()),
        };
        distance.im.abs() <= largest
    };
    let ahead = |found: &[Complex<f64>]| -> Vec<f64> {
        let distances = found.iter().filter(|theta| theta.norm() > 0.0).map(|theta| 1.0 / theta);
        distances.filter(is_real).map(|distance| distance.re).collect()
    };
    let found = leading_eigenvalues_until(&mut operator, 4 * modes + 8, first, &|found| is_enough(&ahead(found)));
    stage.unless_interrupted()?;
    let mut loads: Vec<f64> = ahead(&found.unwrap_or_default()).into_iter().map(|ahead| load + ahead).collect();
    sort_by(&mut loads, |a, b| rank(*a, load).total_cmp(&rank(*b, load)));
    Ok(loads)
}

/// How the tangent varies along the path: (K(q + r dq, load + r) - K(q - r dq, load - r)) / 2r, with the spins of nodes
/// as unknowns, which are those of the present state there. Rates of rotation vectors are others in each state: where
/// nodes turn far their tangents vary like that of what is stiff.
struct VariedTangent {
    /// Further along the path than the present state, and before it
    ends: [TangentAtEnd; 2],
    /// 2r
    width: f64,
}

/// The tangent at a state beside the present one.
struct TangentAtEnd {
    values: Vec<f64>,
    /// Equations of rotations that differ from the present ones, with the changes of their unknowns for a spin whose
    /// unknown has unit changes in the present state
    spins: Vec<([usize; 3], Mat3)>,
}

impl TangentAtEnd {
    fn multiply(&self, system: &System, x: &[f64]) -> Vec<f64> {
        let mut changes = x.to_vec();
        self.replace(&mut changes, |spin, x| *spin * x);
        let mut out = system.multiply(&self.values, &changes);
        self.replace(&mut out, |spin, x| spin.transpose_mul(x));
        out
    }

    fn replace(&self, x: &mut [f64], image: impl Fn(&Mat3, Vec3) -> Vec3) {
        for (equations, spin) in &self.spins {
            let turned = image(spin, Vec3(equations.map(|equation| x[equation])));
            equations.iter().zip(turned.0).for_each(|(&equation, turned)| x[equation] = turned);
        }
    }
}

impl VariedTangent {
    /// The difference of both tangents, which tells whether their change is symmetric: beside all of a tangent what is not
    /// would be small.
    fn difference(&self) -> Vec<f64> {
        let [after, before] = self.ends.each_ref().map(|end| &end.values);
        after.iter().zip(before).map(|(after, before)| after - before).collect()
    }

    fn multiply(&self, system: &System, x: &[f64]) -> Vec<f64> {
        let [after, before] = self.ends.each_ref().map(|end| end.multiply(system, x));
        after.iter().zip(&before).map(|(after, before)| (after - before) / self.width).collect()
    }
}

/// See [`TangentAtEnd::spins`]. Rotations that are held in some direction keep their unknowns.
fn spins(kinds: &[SlotKind], dof_map: &DofMap, here: &State, there: &State) -> Vec<([usize; 3], Mat3)> {
    let has_turned = |slot: usize| kinds[slot] == SlotKind::Rotation && here.q[slot] != there.q[slot];
    let is_free = |slot: &usize| dof_map.of(*slot as Slot).iter().all(|&equation| equation != DofMap::HELD);
    let of_slot = |slot: usize| {
        let [from, to] = [here, there].map(|state| state.rotation(slot as Slot));
        let spin = to.t_inverse() * to.r.transpose() * from.r * from.t;
        (dof_map.of(slot as Slot).map(|equation| equation as usize), spin)
    };
    (0..kinds.len()).filter(|&slot| has_turned(slot)).filter(is_free).map(of_slot).collect()
}

/// The state beside the present one, by a difference of the load factor, if the path were straight.
fn beside(stage: &StageRun, direction: &[Vec3], by: f64) -> State {
    let StageRun { model, state: here, schedule, .. } = stage;
    let mut state = (*here).clone();
    schedule.set_clock(model, &mut state, here.time, here.load + by);
    state.q.copy_from_slice(&here.q);
    state.q.iter_mut().zip(direction).for_each(|(q, &d)| *q += d * by);
    state
}

/// The largest of a few reaches over which all points that touch stay in contact: where they open the tangent jumps. The
/// first one, where they open over all of them.
fn reach_in_contact(stage: &StageRun, direction: &[Vec3], reach: f64) -> f64 {
    let Some(contacts) = stage.model.contacts().filter(|_| stage.state.contacts.touches()) else { return reach };
    let is_kept = |by: f64| contacts.change(stage.state, &beside(stage, direction, by)) == ContactChange::None;
    let mut shorter = REACHES_IN_CONTACT.into_iter().map(|part| part * reach);
    shorter.find(|&reach| is_kept(reach) && is_kept(-reach)).unwrap_or(reach)
}

fn varied_tangent(stage: &mut StageRun, direction: &[Vec3], reach: f64) -> VariedTangent {
    let ends = [reach, -reach].map(|by| beside(stage, direction, by));
    let StageRun { assembly, model, state: here, .. } = stage;
    assembly.forget();
    let tangent = |state: State| {
        assembly.evaluate(&state, Weights::STIFFNESS, None);
        let spins = spins(&model.kinds, &assembly.system.pattern.dof_map, here, &state);
        TangentAtEnd { values: assembly.system.values.clone(), spins }
    };
    VariedTangent { ends: ends.map(tangent), width: 2.0 * reach }
}

/// Loads above the present one come first, nearest first, then the others.
pub fn rank(critical: f64, load: f64) -> f64 {
    let distance = critical - load;
    if distance > 0.0 { -1.0 / distance } else { -distance }
}

/// K^-1 K': its eigenvalues are -1/m.
struct Softening<'a> {
    system: &'a System,
    varied: &'a VariedTangent,
    solver: &'a mut LinearSolver,
    symmetric: bool,
}

impl Operator for Softening<'_> {
    fn size(&self) -> usize {
        self.system.pattern.dof_map.count()
    }

    fn apply(&mut self, x: &[f64], _weighed: &[f64]) -> Option<Vec<f64>> {
        let mut out = self.varied.multiply(self.system, x);
        out.iter_mut().for_each(|v| *v = -*v);
        self.solver.solve_for_modes(self.system, &mut out).then_some(out)
    }

    fn weigh(&mut self, x: &[f64]) -> Vec<f64> {
        if self.symmetric { self.system.multiply(&self.system.values, x) } else { x.to_vec() }
    }

    fn is_symmetric(&self) -> bool {
        self.symmetric
    }
}
