//! The start of a dynamic stage: velocities, and accelerations from equilibrium at its first instant.

use super::failure::Failure;
use super::plan::InitialMotion;
use super::stage_run::{Run, StageRun};
use crate::integrate::{Method, Step};
use crate::kernel::Weights;
use crate::model::{LARGEST_GAP, Model, SlotKind, StageError};
use crate::rotation::Rotation;
use crate::solve::{NewtonFailure, SoftMode, Tangent, mechanism};
use crate::system::{DofMap, Slot, State, System};
use crate::tensor::{Mat3, Vec3};
use crate::threads;
use crate::warning::WarningKind;
use nalgebra::{Matrix3, SymmetricEigen};

impl Run<'_> {
    /// Gives velocities, sets the clock, solves M a = f_ext - f_int - f_acc(a = 0) on the free directions.
    pub(super) fn start_dynamic(&mut self, workshop: &mut StageRun, step: &Step) -> Result<(), Failure> {
        let begins = self.takes_initial_motion();
        if begins {
            let initial = std::mem::take(&mut self.plan.initial);
            initial.iter().for_each(|motion| set_in_motion(&mut self.state, motion));
        }
        let dof_map = &workshop.assembly.system.pattern.dof_map;
        threads::each_part(&mut self.state.v, |start, part| {
            (start..).zip(part).for_each(|(slot, v)| *v -= dof_map.held_part(slot as Slot, *v));
        });
        self.state.a.fill(Vec3::ZERO);
        let (time, amplitude) = (self.state.time, self.state.amplitude.clone());
        self.schedule.set_clock(&self.model, &mut self.state, time, 1.0);
        if let Some(jump) = self.model.motor_jumps(&amplitude, &self.state).into_iter().next() {
            return Err(self.describe(StageError::MotorJump(jump)));
        }
        self.change_charts(None);
        self.linearise(workshop)?;
        self.refuse_loose(workshop, step)?;
        self.refuse_loose_in_space(workshop, step.weights())?;
        // Time steps do not look again.
        workshop.space = None;
        self.close_joints(workshop)?;
        self.solve_accelerations(workshop)?;
        step.scheme.start(&mut self.state);
        if let Some(increments) = &workshop.increments {
            increments.start(&mut self.state);
        }
        if begins {
            self.bookkeeper.bring_in(&self.model, &self.state);
        }
        self.open_account(workshop)
    }

    /// Velocities that the gaps of joints allow: those given, changed by the impulses that closing the joints takes,
    /// [M G^T; G 0] [dv; impulse] = [0; -dg/dt].
    pub(super) fn close_joints(&mut self, workshop: &mut StageRun) -> Result<(), Failure> {
        if self.model.multipliers.is_empty() {
            return Ok(());
        }
        let [rates, _] = workshop.assembly.drift(&self.state);
        workshop.assembly.evaluate(&self.state, Weights::MASS, None);
        self.refuse_open_joints(workshop)?;
        workshop.assembly.system.forget_forces();
        let Some(impulse) = self.solve_with_mass(workshop, &rates)? else { return Ok(()) };
        let moves = self.model.kinds.iter().map(|kind| !kind.is_multiplier());
        for ((v, impulse), _) in self.state.v.iter_mut().zip(impulse).zip(moves).filter(|(_, moves)| *moves) {
            *v += impulse;
        }
        Ok(())
    }

    /// A dynamic stage never jumps: neither do joints that a stage before has left open.
    fn refuse_open_joints(&self, workshop: &StageRun) -> Result<(), Failure> {
        for &slot in &self.model.multipliers {
            let kind = self.model.kinds[slot as usize];
            let size = if kind == SlotKind::Force { self.model.length } else { 1.0 };
            let gap = workshop.assembly.system.total(slot as usize).norm();
            if gap > LARGEST_GAP * size {
                let at = self.moment();
                return Err(Failure::Deck(format!(
                    "the {} is open by {gap:.3e} where the stage begins ({at}), and would have to jump",
                    self.model.node_at(slot as usize)
                )));
            }
        }
        Ok(())
    }

    fn solve_accelerations(&mut self, workshop: &mut StageRun) -> Result<(), Failure> {
        let assembly = &mut workshop.assembly;
        assembly.forget();
        let [_, rates2] = assembly.drift(&self.state);
        assembly.evaluate(&self.state, Weights::MASS, None);
        if (0..self.state.q.len()).any(|slot| !assembly.system.total(slot).is_finite()) {
            let failure = NewtonFailure::not_finite(assembly, &self.state);
            return Err(self.name_failure(failure, &workshop.assembly.system));
        }
        let Some(solved) = self.solve_with_mass(workshop, &rates2)? else {
            self.warn(
                WarningKind::NoStartAccelerations,
                "mass does not determine the accelerations at the start (a point mass with an offset and without inertia?): the motion \
                 begins without them",
            );
            workshop.assembly.evaluate(&self.state, Weights::NONE, None);
            return Ok(());
        };
        let (multipliers, accelerations) = (&mut self.state.q[..], &mut self.state.a[..]);
        for (slot, kind) in self.model.kinds.iter().enumerate() {
            let field = if kind.is_multiplier() { &mut *multipliers } else { &mut *accelerations };
            field[slot] += solved[slot];
        }
        // The forces of the start, for reactions and the energy account.
        workshop.assembly.evaluate(&self.state, Weights::NONE, None);
        Ok(())
    }

    /// Solves with the mass matrix, bordered by the gaps of joints, whose rows ask for -`gaps`; `None` where mass alone does not
    /// tell the solution, but stiffness holds everything.
    fn solve_with_mass(&mut self, workshop: &mut StageRun, gaps: &[Vec3]) -> Result<Option<Vec<Vec3>>, Failure> {
        let StageRun { assembly, newton, .. } = workshop;
        let (solver, system) = (&mut newton.solver, &mut assembly.system);
        for &slot in &self.model.multipliers {
            system.replace_force(slot, gaps[slot as usize]);
        }
        let mut right_hand_side = vec![0.0; system.pattern.dof_map.count()];
        system.right_hand_side(&mut right_hand_side);
        let additions = massless_blocks(system, &self.model, &mut right_hand_side);
        additions.iter().for_each(|(slot, block)| system.add_to_own_block(*slot, block));
        self.counters.work.factorisations += 1;
        let mut mass = Tangent::that_may_go(assembly, &self.state, Weights::MASS).with(&additions);
        // Along no axis round-off leaves pivots where the mass matrix is singular: solved with, they give accelerations of 1e16.
        let massless = solver.null_vector(&mut mass);
        let factorised = massless.is_none() && solver.factorise_new(&mut mass).0;
        let system = mass.system();
        if !factorised || !solver.solve(system, &mut right_hand_side) {
            let named = self.name_mechanism(massless, &workshop.assembly.system);
            return if self.is_held(workshop, &named) { Ok(None) } else { Err(named) };
        }
        let mut solved = vec![Vec3::ZERO; self.state.q.len()];
        system.pattern.dof_map.scatter(&right_hand_side, None, &mut solved);
        Ok(Some(solved))
    }

    /// Whether stiffness holds what mass does not resist; a condition of joints that is said twice is none of its business.
    fn is_held(&self, workshop: &mut StageRun, without_mass: &Failure) -> bool {
        if matches!(without_mass, Failure::Singular { place: Some(place), .. } if place.is_joint()) {
            return false;
        }
        let StageRun { assembly, newton, .. } = workshop;
        assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        let mut tangent = Tangent::that_may_go(assembly, &self.state, Weights::STIFFNESS);
        newton.solver.factorise_new(&mut tangent).0
            && SoftMode::find(&mut newton.solver, &mut tangent, &self.model, false)
                .is_none_or(|soft_mode| !soft_mode.is_loose())
    }
}

/// v = velocity + spin x (x - about), and the rate of P from the spin: Pd = T^-T w.
pub(super) fn set_in_motion(state: &mut State, motion: &InitialMotion) {
    for &(node, place) in &motion.nodes {
        let (u, p) = (node.u as usize, node.p as usize);
        let x = place + state.q[u];
        state.v[u] = motion.velocity + motion.spin.cross(x - motion.about);
        state.v[p] = Rotation::new(state.q[p]).t_inverse().transpose_mul(motion.spin);
    }
}

/// Directions without mass take no acceleration: their part of the mass matrix is replaced by one that leaves them at
/// zero. They are the null directions of the diagonal blocks; what is to be added to these.
fn massless_blocks(system: &System, model: &Model, right_hand_side: &mut [f64]) -> Vec<(Slot, Mat3)> {
    let mut additions = Vec::new();
    let is_massive = threads::list(model.slots(), |slot| is_regular(&with_mass_where_held(system, slot as Slot).0));
    for slot in (0..model.slots()).filter(|&slot| !(is_massive[slot] || model.kinds[slot].is_multiplier())) {
        let numbers = system.pattern.dof_map.of(slot as Slot);
        let free: Vec<usize> = (0..3).filter(|&k| numbers[k] != DofMap::HELD).collect();
        let (block, weight) = with_mass_where_held(system, slot as Slot);
        let mut addition = Mat3::ZERO;
        let symmetric = Matrix3::from_fn(|i, j| 0.5 * (block.0[i][j] + block.0[j][i]));
        let eigen = SymmetricEigen::new(symmetric);
        for k in 0..3 {
            let v = eigen.eigenvectors.column(k);
            if eigen.eigenvalues[k].abs() > 1e-12 * weight {
                continue;
            }
            let along: f64 = free.iter().map(|&i| v[i] * right_hand_side[numbers[i] as usize]).sum();
            free.iter().for_each(|&i| right_hand_side[numbers[i] as usize] -= along * v[i]);
            let direction = Vec3([v[0], v[1], v[2]]);
            addition += direction.outer(direction).scale(weight);
        }
        additions.push((slot as Slot, addition));
    }
    additions
}

/// What a slot has of a mass matrix on its diagonal, and the largest entry of that. A held direction is given as much, so that it does
/// not count as massless.
fn with_mass_where_held(system: &System, slot: Slot) -> (Mat3, f64) {
    let (mut block, numbers) = (system.own_block(slot), system.pattern.dof_map.of(slot));
    let weight = if block.max_abs() > 0.0 { block.max_abs() } else { 1.0 };
    for k in (0..3).filter(|&k| numbers[k] == DofMap::HELD) {
        block.0[k][k] += weight;
    }
    (block, weight)
}

/// Whether a matrix has no eigenvalue that is next to nothing beside its entries: none is larger than three times the largest of these.
fn is_regular(matrix: &Mat3) -> bool {
    let [a, b, c] = matrix.0.map(Vec3);
    a.dot(b.cross(c)).abs() > 1e-9 * matrix.max_abs().powi(3)
}

impl Run<'_> {
    /// Refuses what neither stiffness nor mass resists, and joints that hold what is held already: round-off would move them. It is
    /// looked at without velocities, whose forces come and go with them.
    fn refuse_loose(&mut self, workshop: &mut StageRun, method: &dyn Method) -> Result<(), Failure> {
        let StageRun { assembly, newton, .. } = &mut *workshop;
        let still = self.state.at_rest();
        assembly.forget();
        assembly.evaluate(&still, method.weights(), None);
        self.counters.work.factorisations += 1;
        let mut tangent = Tangent::that_may_go(assembly, &still, method.weights());
        let loose = mechanism(&mut newton.solver, &mut tangent, &self.model);
        loose.map_or(Ok(()), |vector| Err(self.name_mechanism(Some(vector), &workshop.assembly.system)))
    }

    /// Finds the slots whose accelerations mean something: their unknowns have inertia, or their motion is prescribed; and those
    /// whose velocities do not, either.
    pub(super) fn find_rates(&self, workshop: &mut StageRun) {
        let mut moves = vec![false; self.model.slots()];
        self.model.motions.iter().for_each(|motion| moves[motion.slot as usize] = true);
        let mut touched = |weights: Weights| -> Vec<bool> {
            // Factors may have taken the place of the one that is there.
            workshop.assembly.form_again(&self.state, weights);
            let system = &workshop.assembly.system;
            threads::list(moves.len(), |slot| {
                let moves = moves[slot] && !system.pattern.dof_map.is_plain(slot as Slot);
                moves || system.own_block(slot as Slot).max_abs() > 0.0
            })
        };
        let (massive, damped) = (touched(Weights::MASS), touched(Weights::DAMPING));
        workshop.assembly.evaluate(&self.state, Weights::NONE, None);
        let rateless = |&slot: &usize| !(massive[slot] || damped[slot] || self.model.kinds[slot].is_multiplier());
        workshop.rateless = (0..massive.len()).filter(rateless).collect();
        workshop.massive = massive;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_regular_has_no_eigenvalue_next_to_nothing() {
        let turn = Rotation::new(Vec3([0.3, -1.1, 0.7])).r;
        let with = |eigenvalues: [f64; 3]| turn * Mat3::diagonal(eigenvalues) * turn.transpose() * 1e5;
        let smallest = |matrix: &Mat3| {
            let eigen = SymmetricEigen::new(Matrix3::from_fn(|i, j| matrix.0[i][j])).eigenvalues;
            eigen.iter().fold(f64::INFINITY, |m: f64, e| m.min(e.abs())) / matrix.max_abs()
        };
        for (third, regular) in [(1.0, true), (1e-3, true), (1e-8, true), (1e-11, false), (1e-13, false), (0.0, false)]
        {
            let matrix = with([2.0, 1.0, third]);
            assert_eq!(is_regular(&matrix), regular, "{third}");
            assert!(!is_regular(&matrix) || smallest(&matrix) > 1e-12, "{third}");
        }
        let none = [Mat3::ZERO, with([f64::NAN, 1.0, 1.0]), Mat3::ZERO * f64::NAN];
        assert!(!none.iter().any(is_regular));
    }
}
