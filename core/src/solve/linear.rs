//! Linear solver: block factorisation where it is fast and safe, else sparse LU with partial
//! pivoting.

use super::block::BlockSolver;
use super::constraints::Constraints;
use super::general::GeneralSolver;
use super::pivots::Pivots;
use super::tangent::Tangent;
use crate::interrupt;
use crate::model::SlotKind;
use crate::system::{ResidualBuffer, System};
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// Solves linear systems whose tangents share one pattern.
///
/// The block solver serves scenes without dense nets; multipliers of joints are prepared for it
/// (`solve/constraints.rs`). Tangents for which pivoting within blocks fails are left to LU with
/// partial pivoting. Factors overwrite a tangent that may be destroyed as long as that certainly
/// loses no digits; else they are stored separately, and residuals of solutions are checked.
pub struct LinearSolver {
    /// Block solver, if the pattern suits it
    blocks: Option<Box<BlockSolver>>,
    /// Sparse LU, once the block solver has failed, or if there is none
    general: Option<Box<GeneralSolver>>,
    choice: MethodChoice,
    /// True if the last factorisation has succeeded
    pub(super) factored: bool,
    /// [`System::revision`] of the tangent factorised last; `None` if its values may have changed
    /// since without a new revision
    revision: Option<u64>,
    /// Multipliers with the tangent prepared for the block solver; `None` without multipliers
    constraints: Option<Constraints>,
    /// Separate factorisation that counts negative pivots if this solver's own does not
    pub(super) pivots: Option<Pivots>,
    /// Column of tiles in which a tangent was unsymmetric last, where the next one is looked at first
    pub(super) unsymmetric_column: usize,
    /// Buffers, by equation: the solution, its right-hand side, and the residual
    right_hand_side: Vec<f64>,
    wanted: Vec<f64>,
    leftover: ResidualBuffer,
}

/// State of the choice between block solver and sparse LU.
#[derive(Clone, Copy, Deserialize, Serialize)]
pub struct MethodChoice {
    in_blocks: bool,
    /// Number of solutions until the block solver is tried again, and the number after its next
    /// failure
    absence: u32,
    next: u32,
    /// True if sparse LU has failed, too, so that the block solver stays for one attempt
    sparse_lu_failed: bool,
    /// True if the last block factorisation certainly lost no digits
    is_sure: bool,
}

/// Backward error at which a solution is accepted: it solves a system whose entries differ by this
/// relative amount (Oettli and Prager 1964).
const ACCEPTED_BACKWARD_ERROR: f64 = 1e-11;

/// Backward error above which iterative refinement has failed.
const MAX_BACKWARD_ERROR: f64 = 1e-8;

/// Largest number of refinements of a solution
const MAX_REFINEMENTS: usize = 3;

/// Outcome of a request for a factorisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Factorisation {
    /// True if there is a factorisation of the tangent
    pub is_done: bool,
    /// True if it was not there before
    pub is_new: bool,
}

impl LinearSolver {
    /// Analyses the pattern of a system with slots of these kinds, in a scene of this length. `None`
    /// if memory is not available.
    pub fn new(system: &System, kinds: &[SlotKind], length: f64) -> Option<Self> {
        let constraints = Constraints::new(&system.pattern, kinds, length);
        let late = constraints.as_ref().map_or(&[][..], Constraints::node_blocks);
        let blocks = BlockSolver::new(&system.pattern, late);
        Self::by(blocks, constraints, system)
    }

    /// Solver for `system` that takes over the analysis of `other`, the solver of the system
    /// `others`, if their patterns are alike. `None` if memory is not available.
    pub fn beside(other: &Self, others: &System, system: &System, kinds: &[SlotKind], length: f64) -> Option<Self> {
        match other.blocks().filter(|_| system.pattern.is_like(&others.pattern)) {
            Some(blocks) => {
                let constraints = Constraints::new(&system.pattern, kinds, length);
                Self::by(Some(blocks.of_like(&system.pattern)?), constraints, system)
            }
            None => Self::new(system, kinds, length),
        }
    }

    fn by(blocks: Option<BlockSolver>, constraints: Option<Constraints>, system: &System) -> Option<Self> {
        let general = if blocks.is_none() { Some(Box::new(GeneralSolver::new(system)?)) } else { None };
        Some(Self {
            choice: MethodChoice {
                in_blocks: blocks.is_some(),
                absence: 0,
                next: 1,
                sparse_lu_failed: false,
                is_sure: true,
            },
            blocks: blocks.map(Box::new),
            general,
            factored: false,
            revision: None,
            constraints,
            pivots: None,
            unsymmetric_column: 0,
            right_hand_side: Vec::new(),
            wanted: Vec::new(),
            leftover: ResidualBuffer::default(),
        })
    }

    /// Multipliers prepared for the block solver, if there are any.
    pub(super) fn constraints(&self) -> Option<&Constraints> {
        self.constraints.as_ref()
    }

    /// Block solver, if the pattern suits it, in use or not.
    pub(super) fn blocks(&self) -> Option<&BlockSolver> {
        self.blocks.as_deref()
    }

    /// Block solver, if it is in use.
    fn blocks_in_use(&mut self) -> Option<&mut BlockSolver> {
        self.blocks.as_deref_mut().filter(|_| self.choice.in_blocks)
    }

    /// True if the factorisation in use is one for symmetric tangents, without pivoting.
    pub(super) fn is_symmetric(&self) -> bool {
        self.choice.in_blocks && self.blocks().is_some_and(BlockSolver::is_symmetric)
    }

    /// True if the last factorised tangent is known to have positive pivots only, so that no digits
    /// are lost.
    fn is_positive_definite(&self) -> bool {
        self.factored && self.constraints.is_none() && self.blocks().is_some_and(|blocks| blocks.negative() == Some(0))
    }

    /// Factorises with the block solver and counts negative pivots; `None` if either fails.
    pub(super) fn negative_of_own(&mut self, tangent: &mut Tangent) -> Option<usize> {
        if self.factorise_by_own(tangent) { self.negative_of_last() } else { None }
    }

    /// Factorises with the block solver, unless that was done last; `false` on failure.
    pub(super) fn factorise_by_own(&mut self, tangent: &mut Tangent) -> bool {
        let done = self.has_factorised(tangent.system()) || self.factorise_in_blocks(tangent);
        self.factored = done;
        self.revision = done.then_some(tangent.system().revision);
        done
    }

    /// Number of negative pivots of the last factorisation on the space that satisfies the
    /// constraints; `None` if it does not tell them.
    pub(super) fn negative_of_last(&self) -> Option<usize> {
        let of_multipliers = self.constraints.as_ref().map_or(0, Constraints::count);
        let blocks = self.blocks().filter(|_| self.choice.in_blocks && self.factored)?;
        blocks.negative()?.checked_sub(of_multipliers)
    }

    /// True if the determinant of the last factorised tangent is negative on the space that
    /// satisfies the constraints: each multiplier changes the sign of the determinant. `None` if
    /// the block solver is not in use.
    pub(super) fn has_negative_determinant(&self) -> Option<bool> {
        let of_multipliers = self.constraints.as_ref().map_or(0, Constraints::count);
        let blocks = self.blocks().filter(|_| self.choice.in_blocks && self.factored)?;
        Some(blocks.has_negative_determinant()? != (of_multipliers % 2 == 1))
    }

    /// Solves J du = -g for the correction of a system, whose tangent was factorised last, and
    /// writes du to a field of slots (global components). Held directions take the components of
    /// `held`, or zero. With `looks` the residual is [checked](LinearSolver::solve) unless that is
    /// superfluous. `false` if there is no solution.
    pub fn correct(&mut self, system: &System, looks: bool, held: Option<&[Vec3]>, out: &mut [Vec3]) -> bool {
        let nothing_to_look_at = !looks || self.is_positive_definite() || system.holds_factors();
        let is_factored = self.factored;
        let is_plain = self.constraints.is_none();
        if let Some(blocks) = self.blocks_in_use().filter(|_| nothing_to_look_at && is_plain) {
            return is_factored && blocks.correct(system, held, out);
        }
        let mut x = std::mem::take(&mut self.right_hand_side);
        x.resize(system.pattern.dof_map.count(), 0.0);
        system.right_hand_side(&mut x);
        let done = if looks { self.solve(system, &mut x) } else { self.solve_once(system, &mut x) };
        if done {
            system.pattern.dof_map.scatter(&x, held, out);
        }
        self.right_hand_side = x;
        done
    }

    /// Name of the method in use.
    pub fn name(&self) -> &'static str {
        self.blocks().filter(|_| self.choice.in_blocks).map_or("sparse LU", BlockSolver::name)
    }

    /// True if the last factorisation is that of the tangent of this system.
    pub fn has_factorised(&self, system: &System) -> bool {
        self.factored && self.revision == Some(system.revision)
    }

    /// Factorises a tangent, unless that was done last.
    pub fn factorise_new(&mut self, tangent: &mut Tangent) -> Factorisation {
        if self.has_factorised(tangent.system()) {
            return Factorisation { is_done: true, is_new: false };
        }
        self.factored = match self.choice.in_blocks {
            true => self.factorise_in_blocks(tangent) || self.leave_blocks(tangent.look()),
            false => self.factorise(tangent.look()),
        };
        self.revision = Some(tangent.system().revision);
        Factorisation { is_done: self.factored, is_new: true }
    }

    /// Factorises with the block solver, overwriting the tangent if it may be destroyed and no
    /// digits are lost. `false` on failure.
    fn factorise_in_blocks(&mut self, tangent: &mut Tangent) -> bool {
        if self.constraints.is_some() {
            return self.choice.in_blocks && self.factorise_staying(tangent.look());
        }
        let was_sure = self.choice.is_sure;
        let Some(blocks) = self.blocks_in_use() else { return false };
        let free = tangent.give_away().filter(|system| was_sure && blocks.can_stay_within(system));
        let within = free.is_some_and(|system| blocks.factorise_within(system) && blocks.is_sure());
        let done = within || blocks.factorise(tangent.look().matrix());
        self.choice.is_sure = blocks.is_sure();
        done
    }

    /// Factorises with the block solver and keeps the tangent. `false` on failure.
    fn factorise_staying(&mut self, system: &System) -> bool {
        match (&mut self.blocks, &mut self.constraints) {
            (Some(blocks), Some(constraints)) => {
                constraints.take(system);
                blocks.factorise(constraints.matrix(&system.pattern))
            }
            (Some(blocks), None) => blocks.factorise(system.matrix()),
            (None, _) => false,
        }
    }

    /// Factorises a tangent and keeps it; `false` if no pivot is found.
    pub fn factorise(&mut self, system: &System) -> bool {
        // The values may change without a new revision.
        self.revision = None;
        self.factored = match self.choice.in_blocks {
            true => self.factorise_staying(system) || self.leave_blocks(system),
            false => self.general.as_mut().is_some_and(|general| general.factorise(system)),
        };
        self.factored
    }

    /// Factorises a system whose values will change. Unless all pivots are positive, a solution is
    /// checked now, since its residual cannot be checked later. `false` on failure.
    pub fn factorise_surely(&mut self, system: &System) -> bool {
        if !self.factorise(system) || self.is_positive_definite() {
            return self.factored;
        }
        let ones = vec![1.0; system.pattern.dof_map.count()];
        let mut x = system.multiply(&system.values, &ones);
        self.solve(system, &mut x)
    }

    /// Solves with the last factorisation, which is that of `system`; `false` if there is no
    /// solution. Solutions of the block solver are refined, unless all pivots are positive, or the
    /// tangent is overwritten: such factorisations are [sure](BlockSolver::is_sure), and their
    /// residual shows in Newton's next one.
    pub fn solve(&mut self, system: &System, right_hand_side: &mut [f64]) -> bool {
        if !self.choice.in_blocks || self.is_positive_definite() || system.holds_factors() {
            return self.solve_once(system, right_hand_side);
        }
        let mut wanted = std::mem::take(&mut self.wanted);
        wanted.clear();
        wanted.extend_from_slice(right_hand_side);
        let mut done = self.solve_once(system, right_hand_side) && self.refine(system, &wanted, right_hand_side);
        if !done {
            right_hand_side.copy_from_slice(&wanted);
            self.factored = self.leave_blocks(system);
            done = self.solve_once(system, right_hand_side);
        }
        self.wanted = wanted;
        done
    }

    /// Solves as [`Self::solve`] where multipliers may have lost digits, else as [`Self::solve_once`].
    pub fn solve_for_modes(&mut self, system: &System, right_hand_side: &mut [f64]) -> bool {
        match self.constraints {
            Some(_) => self.solve(system, right_hand_side),
            None => self.solve_once(system, right_hand_side),
        }
    }

    /// Solves with the last factorisation, without refinement; `false` if the solution is not
    /// finite.
    pub fn solve_once(&mut self, system: &System, right_hand_side: &mut [f64]) -> bool {
        if right_hand_side.is_empty() {
            return true;
        }
        if !self.factored {
            return false;
        }
        if self.choice.in_blocks {
            let Some(blocks) = &mut self.blocks else { return false };
            match &self.constraints {
                Some(constraints) => {
                    constraints.change(right_hand_side);
                    blocks.solve(constraints.matrix(&system.pattern), right_hand_side);
                }
                None => blocks.solve(system.matrix(), right_hand_side),
            }
        } else {
            let Some(general) = &mut self.general else { return false };
            general.solve(right_hand_side);
        }
        right_hand_side.iter().all(|x| x.is_finite())
    }

    /// Refines a solution until its backward error is at most [`ACCEPTED_BACKWARD_ERROR`]; `false`
    /// if it remains above [`MAX_BACKWARD_ERROR`].
    fn refine(&mut self, system: &System, wanted: &[f64], x: &mut [f64]) -> bool {
        let mut error = f64::INFINITY;
        for _ in 0..=MAX_REFINEMENTS {
            let now = system.residual(wanted, x, &mut self.leftover);
            if interrupt::is_requested() {
                return false;
            }
            // A refinement that increases the error shows that only round-off is left.
            if now <= ACCEPTED_BACKWARD_ERROR || now >= error {
                error = error.min(now);
                break;
            }
            error = now;
            let mut residual = vec![0.0; x.len()];
            system.last_residual(&self.leftover, &mut residual);
            if !self.solve_once(system, &mut residual) {
                return false;
            }
            x.iter_mut().zip(&residual).for_each(|(x, correction)| *x += correction);
        }
        error <= MAX_BACKWARD_ERROR
    }

    /// State of the choice between methods.
    pub(crate) fn choice(&self) -> MethodChoice {
        self.choice
    }

    /// Goes on with another choice.
    pub(crate) fn choose(&mut self, choice: MethodChoice, system: &System) {
        if !choice.in_blocks && self.general.is_none() {
            self.general = GeneralSolver::new(system).map(Box::new);
        }
        self.choice = choice;
    }

    /// True if the block solver is in use.
    pub(super) fn is_in_blocks(&self) -> bool {
        self.choice.in_blocks
    }

    /// Called after Newton's iteration has failed. If sparse LU is in use, returns to the block
    /// solver, which then stays for the next attempt whatever its accuracy (`true`). `false` if the
    /// block solver is in use and may be replaced.
    pub(super) fn gives_way_to_blocks(&mut self) -> bool {
        if !self.choice.in_blocks {
            self.return_to_blocks();
            self.choice.sparse_lu_failed = true;
            return true;
        }
        std::mem::take(&mut self.choice.sparse_lu_failed)
    }

    /// Changes to sparse LU, until the block solver is tried again, and factorises the tangent;
    /// `false` on failure.
    pub(super) fn leave_blocks(&mut self, system: &System) -> bool {
        // An interrupted factorisation is no reason to change the method.
        if interrupt::is_requested() {
            return false;
        }
        if self.general.is_none() {
            self.general = GeneralSolver::new(system).map(Box::new);
        }
        let Some(general) = &mut self.general else { return false };
        let next = self.choice.next;
        let next_time = next.saturating_mul(2);
        self.choice =
            MethodChoice { in_blocks: false, absence: next, next: next_time, sparse_lu_failed: false, is_sure: false };
        general.factorise(system)
    }

    /// Called after a solution has converged. A diverging iterate may lose digits that the
    /// structure does not: the block solver is tried again, after twice as many solutions with each
    /// failure, and one fewer with each success.
    pub fn succeeded(&mut self) {
        self.choice.sparse_lu_failed = false;
        if self.choice.in_blocks {
            self.choice.next = (self.choice.next - 1).max(1);
            return;
        }
        self.choice.absence = self.choice.absence.saturating_sub(1);
        if self.choice.absence == 0 {
            self.return_to_blocks();
        }
    }

    /// Changes to the block solver, if there is one.
    fn return_to_blocks(&mut self) {
        if self.blocks.is_some() {
            self.choice = MethodChoice { in_blocks: true, absence: 0, ..self.choice };
            self.factored = false;
            self.revision = None;
        }
    }
}
