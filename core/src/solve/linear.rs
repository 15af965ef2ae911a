//! The linear solver: by blocks where that is fast and safe, else in general.

use super::block::BlockSolver;
use super::constraints::Constraints;
use super::general::GeneralSolver;
use super::pivots::Pivots;
use super::tangent::Tangent;
use crate::system::{Leftover, Slot, System};
use crate::tensor::Vec3;

/// Solves with tangents of one pattern.
///
/// Blocks serve scenes that are not too much of a net; multipliers of joints are made ready for
/// them (`solve/constraints.rs`). Tangents whose pivots fail across blocks are left to LU with
/// partial pivoting. Factors take the place of a tangent that may go as long as that is sure to
/// lose no digits; else they stand beside it, and what they solve is looked at.
pub struct LinearSolver {
    /// Where the pattern suits them
    blocks: Option<Box<BlockSolver>>,
    /// Once blocks were left, or where there are none
    general: Option<Box<GeneralSolver>>,
    trust: Trust,
    /// True if the last factorisation has come to its end
    pub(super) factored: bool,
    /// That of the tangent that was factorised last; `None` where its values may have changed under
    /// the same number
    revision: Option<u64>,
    pub(super) multipliers: Vec<Slot>,
    /// The tangent that blocks factorise where there are multipliers
    constraints: Option<Constraints>,
    /// Where it cannot count them itself
    pub(super) pivots: Option<Pivots>,
    /// The last right-hand side where it had to be one list, solved, as it was, and what its
    /// solution left of it
    right_hand_side: Vec<f64>,
    wanted: Vec<f64>,
    leftover: Leftover,
}

/// The trust in blocks, where there are any.
#[derive(Clone, Copy)]
struct Trust {
    in_blocks: bool,
    /// Solutions until they have another chance, and how many there will be when they fail again
    absence: u32,
    next: u32,
    /// True if pivots have just not helped either
    in_vain: bool,
    /// True if the last factorisation was sure to lose no digits
    is_sure: bool,
}

/// A solution is one of a system whose entries differ by no more than this, relative to each
/// (Oettli and Prager 1964).
const BACKWARD_ERROR: f64 = 1e-11;

/// The backward error above which refinement has found no solution.
const LARGEST_BACKWARD_ERROR: f64 = 1e-8;

/// Corrections of one solution
const REFINEMENTS: usize = 3;

impl LinearSolver {
    /// Analyses the pattern of a system. `None` where memory for it cannot be had.
    pub fn new(system: &System, multipliers: &[Slot]) -> Option<Self> {
        let constraints = Constraints::new(&system.pattern, multipliers);
        let late = constraints.as_ref().map_or(&[][..], Constraints::node_blocks);
        let blocks = BlockSolver::new(&system.pattern, late);
        Self::by(blocks, constraints, system, multipliers)
    }

    /// A solver beside that of another system, whose analysis it takes over where the patterns are
    /// alike.
    pub fn beside(other: &Self, others: &System, system: &System, multipliers: &[Slot]) -> Option<Self> {
        match other.blocks().filter(|_| system.pattern.is_like(&others.pattern)) {
            Some(blocks) => {
                let constraints = Constraints::new(&system.pattern, multipliers);
                Self::by(Some(blocks.of_like(&system.pattern)?), constraints, system, multipliers)
            }
            None => Self::new(system, multipliers),
        }
    }

    fn by(
        blocks: Option<BlockSolver>,
        constraints: Option<Constraints>,
        system: &System,
        multipliers: &[Slot],
    ) -> Option<Self> {
        let general = if blocks.is_none() { Some(Box::new(GeneralSolver::new(system)?)) } else { None };
        Some(Self {
            trust: Trust { in_blocks: blocks.is_some(), absence: 0, next: 1, in_vain: false, is_sure: true },
            blocks: blocks.map(Box::new),
            general,
            factored: false,
            revision: None,
            multipliers: multipliers.to_vec(),
            constraints,
            pivots: None,
            right_hand_side: Vec::new(),
            wanted: Vec::new(),
            leftover: Leftover::default(),
        })
    }

    /// The constraints of its multipliers, where there are some.
    pub(super) fn constraints(&self) -> Option<&Constraints> {
        self.constraints.as_ref()
    }

    /// Its solver in blocks, where it has one, whether it is in use or not.
    pub(super) fn blocks(&self) -> Option<&BlockSolver> {
        self.blocks.as_deref()
    }

    /// Its solver in blocks while it is in use.
    fn blocks_in_use(&mut self) -> Option<&mut BlockSolver> {
        self.blocks.as_deref_mut().filter(|_| self.trust.in_blocks)
    }

    /// True if its factorisation is one of symmetric tangents, without pivoting.
    pub(super) fn is_symmetric(&self) -> bool {
        self.trust.in_blocks && self.blocks().is_some_and(BlockSolver::is_symmetric)
    }

    /// True if what was factorised last is known to have positive pivots only: then no digits are
    /// lost.
    fn is_positive_definite(&self) -> bool {
        self.factored && self.constraints.is_none() && self.blocks().is_some_and(|blocks| blocks.negative() == Some(0))
    }

    /// Factorises, as far as it can by blocks, and counts negative pivots.
    pub(super) fn negative_of_own(&mut self, tangent: &mut Tangent) -> Option<usize> {
        if self.factorise_by_own(tangent) { self.negative_of_last() } else { None }
    }

    /// Factorises by blocks what they have not factorised last; whether they could.
    pub(super) fn factorise_by_own(&mut self, tangent: &mut Tangent) -> bool {
        let done = self.has_factorised(tangent.system()) || self.factorise_in_blocks(tangent);
        (self.factored, self.revision) = (done, done.then_some(tangent.system().revision));
        done
    }

    /// The negative pivots of the last factorisation, where it tells them.
    pub(super) fn negative_of_last(&self) -> Option<usize> {
        let of_multipliers = self.constraints.as_ref().map_or(0, Constraints::count);
        let blocks = self.blocks().filter(|_| self.trust.in_blocks && self.factored)?;
        blocks.negative()?.checked_sub(of_multipliers)
    }

    /// True if the determinant of the last factorisation is negative on the space that constraints
    /// leave, where blocks tell: each multiplier turns the sign of that of the whole.
    pub(super) fn has_negative_determinant(&self) -> Option<bool> {
        let of_multipliers = self.constraints.as_ref().map_or(0, Constraints::count);
        let blocks = self.blocks().filter(|_| self.trust.in_blocks && self.factored)?;
        Some(blocks.has_negative_determinant()? != (of_multipliers % 2 == 1))
    }

    /// Solves for the correction that a system asks for with the last factorisation, which is that
    /// of its tangent, and writes it into a field of slots; held directions take their part of
    /// `held`. It [looks](LinearSolver::solve) at what is left where it is asked to and there is
    /// something to look at. `false` where there is no solution.
    pub fn correct(&mut self, system: &System, looks: bool, held: Option<&[Vec3]>, out: &mut [Vec3]) -> bool {
        let nothing_to_look_at = !looks || self.is_positive_definite() || system.holds_factors();
        let (is_factored, is_plain) = (self.factored, self.constraints.is_none());
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

    /// How it solves, in a few words.
    pub fn name(&self) -> &'static str {
        self.blocks().filter(|_| self.trust.in_blocks).map_or("sparse LU", BlockSolver::name)
    }

    /// True if its last factorisation is that of this tangent.
    pub fn has_factorised(&self, system: &System) -> bool {
        self.factored && self.revision == Some(system.revision)
    }

    /// Factorises the tangent where it is another one than the last; whether there is a
    /// factorisation, and whether it is new.
    pub fn factorise_new(&mut self, tangent: &mut Tangent) -> (bool, bool) {
        if self.has_factorised(tangent.system()) {
            return (true, false);
        }
        self.factored = match self.trust.in_blocks {
            true => self.factorise_in_blocks(tangent) || self.leave_blocks(tangent.look()),
            false => self.factorise(tangent.look()),
        };
        self.revision = Some(tangent.system().revision);
        (self.factored, true)
    }

    /// By blocks: in the place of the tangent where it may go and that is sure to lose no digits.
    fn factorise_in_blocks(&mut self, tangent: &mut Tangent) -> bool {
        if self.constraints.is_some() {
            return self.trust.in_blocks && self.factorise_staying(tangent.look());
        }
        let was_sure = self.trust.is_sure;
        let Some(blocks) = self.blocks_in_use() else { return false };
        let free = tangent.give_away().filter(|system| was_sure && blocks.can_stay_within(system));
        let within = free.is_some_and(|system| blocks.factorise_within(system) && blocks.is_sure());
        let done = within || blocks.factorise(tangent.look().matrix());
        self.trust.is_sure = blocks.is_sure();
        done
    }

    /// By blocks, beside the tangent.
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

    /// Factorises a tangent that stays; `false` where a pivot cannot be found.
    pub fn factorise(&mut self, system: &System) -> bool {
        // Its values may not stay.
        self.revision = None;
        self.factored = match self.trust.in_blocks {
            true => self.factorise_staying(system) || self.leave_blocks(system),
            false => self.general.as_mut().is_some_and(|general| general.factorise(system)),
        };
        self.factored
    }

    /// Factorises a system whose values do not stay: a solution is looked at here and now, where
    /// pivots do not vouch for it.
    pub fn factorise_surely(&mut self, system: &System) -> bool {
        if !self.factorise(system) || self.is_positive_definite() {
            return self.factored;
        }
        let ones = vec![1.0; system.pattern.dof_map.count()];
        let mut x = system.multiply(&system.values, &ones);
        self.solve(system, &mut x)
    }

    /// Solves with the last factorisation, which is that of `system`; `false` where there is no
    /// solution. What blocks leave of the residual is refined, unless all pivots are positive, or
    /// the tangent is gone: then they are [sure](BlockSolver::is_sure), and what they leave shows
    /// in Newton's next residual.
    pub fn solve(&mut self, system: &System, right_hand_side: &mut [f64]) -> bool {
        if !self.trust.in_blocks || self.is_positive_definite() || system.holds_factors() {
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

    /// Solves with the last factorisation; `false` where the solution is not finite.
    pub fn solve_once(&mut self, system: &System, right_hand_side: &mut [f64]) -> bool {
        if right_hand_side.is_empty() {
            return true;
        }
        if !self.factored {
            return false;
        }
        match (self.trust.in_blocks, &mut self.blocks, &mut self.general) {
            (true, Some(blocks), _) => match &self.constraints {
                Some(constraints) => {
                    constraints.change(right_hand_side);
                    blocks.solve(constraints.matrix(&system.pattern), right_hand_side);
                }
                None => blocks.solve(system.matrix(), right_hand_side),
            },
            (false, _, Some(general)) => general.solve(right_hand_side),
            _ => return false,
        }
        right_hand_side.iter().all(|x| x.is_finite())
    }

    /// Corrects a solution until its residual is round-off; `false` where it stays larger than it
    /// may.
    fn refine(&mut self, system: &System, wanted: &[f64], x: &mut [f64]) -> bool {
        let mut error = f64::INFINITY;
        for _ in 0..=REFINEMENTS {
            let now = system.residual(wanted, x, &mut self.leftover);
            // A last correction that made it worse is round-off.
            if now <= BACKWARD_ERROR || now >= error {
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
        error <= LARGEST_BACKWARD_ERROR
    }

    /// True if blocks do the work at present.
    pub(super) fn is_in_blocks(&self) -> bool {
        self.trust.in_blocks
    }

    /// After corrections that led nowhere pivoting gives way to blocks, which then stay for the
    /// next attempt whatever they lose; `false` where blocks did the work, and may be left.
    pub(super) fn gives_way_to_blocks(&mut self) -> bool {
        if !self.trust.in_blocks {
            self.return_to_blocks();
            self.trust.in_vain = true;
            return true;
        }
        std::mem::take(&mut self.trust.in_vain)
    }

    /// From here on in general, until blocks have another chance.
    pub(super) fn leave_blocks(&mut self, system: &System) -> bool {
        if self.general.is_none() {
            self.general = GeneralSolver::new(system).map(Box::new);
        }
        let Some(general) = &mut self.general else { return false };
        let next = self.trust.next;
        let next_time = next.saturating_mul(2);
        self.trust = Trust { in_blocks: false, absence: next, next: next_time, in_vain: false, is_sure: false };
        general.factorise(system)
    }

    /// After a solution in balance. An iterate that flies far away loses digits that the structure
    /// has: blocks come back, after twice as many solutions each time that they fail, and one less
    /// for each that they find.
    pub fn succeeded(&mut self) {
        self.trust.in_vain = false;
        if self.trust.in_blocks {
            self.trust.next = (self.trust.next - 1).max(1);
            return;
        }
        self.trust.absence = self.trust.absence.saturating_sub(1);
        if self.trust.absence == 0 {
            self.return_to_blocks();
        }
    }

    /// Where there are some.
    fn return_to_blocks(&mut self) {
        if self.blocks.is_some() {
            self.trust = Trust { in_blocks: true, absence: 0, ..self.trust };
            (self.factored, self.revision) = (false, None);
        }
    }
}
