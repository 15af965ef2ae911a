//! The linear solver: by blocks where that is fast and safe, else in general.

use super::block::BlockSolver;
use super::general::GeneralSolver;
use super::pivots::Pivots;
use super::softest::NullVector;
use crate::system::{Slot, System};

/// Solves with tangents of one pattern.
///
/// Blocks serve what consists of nodes and is not too much of a net; joints with multipliers, whose diagonal is empty, and
/// tangents whose pivots fail across blocks are left to LU with partial pivoting.
pub struct LinearSolver {
    way: Way,
    /// Blocks, while pivots are taken instead, or the other way round
    other: Option<Way>,
    /// Solutions until blocks have another chance, and how many there will be when they fail again
    absence: [u32; 2],
    /// Whether pivots have not helped either since the last solution
    in_vain: bool,
    /// Whether the last factorisation has come to its end
    factored: bool,
    /// That of the tangent that was factorised last, where it stays
    revision: Option<u64>,
    pub(super) multipliers: Vec<Slot>,
    /// Where it cannot count them itself
    pub(super) pivots: Option<Pivots>,
}

enum Way {
    Blocks(Box<BlockSolver>),
    General(Box<GeneralSolver>),
}

/// A solution is one of a system whose entries differ by no more than this, relative to each (Oettli and Prager 1964).
const BACKWARD_ERROR: f64 = 1e-11;

/// What refinement does not bring below this is no solution.
const LARGEST_BACKWARD_ERROR: f64 = 1e-8;

/// Blocks need more of them.
const FEW_DIGITS: f64 = 4.0;

/// So many corrections
const REFINEMENTS: usize = 3;

impl LinearSolver {
    /// Analyses the pattern of a system. `None` where memory for it cannot be had.
    pub fn new(system: &System, multipliers: &[Slot]) -> Option<Self> {
        let blocks = multipliers.is_empty().then(|| BlockSolver::new(&system.pattern, system.symmetric)).flatten();
        let way = match blocks {
            Some(blocks) => Way::Blocks(Box::new(blocks)),
            None => Way::General(Box::new(GeneralSolver::new(system)?)),
        };
        let multipliers = multipliers.to_vec();
        Some(Self {
            way,
            other: None,
            absence: [0, 1],
            in_vain: false,
            factored: false,
            revision: None,
            multipliers,
            pivots: None,
        })
    }

    /// Its factorisation in blocks, where it has one.
    pub(super) fn blocks(&self) -> Option<&BlockSolver> {
        match &self.way {
            Way::Blocks(blocks) => Some(blocks),
            Way::General(_) => None,
        }
    }

    /// Whether its factorisation is one of symmetric tangents, without pivoting.
    pub(super) fn is_symmetric(&self) -> bool {
        self.blocks().is_some_and(BlockSolver::is_symmetric)
    }

    /// Factorises, as far as it can by blocks, and counts negative pivots.
    pub(super) fn negative_of_own(&mut self, system: &System) -> Option<usize> {
        let known = self.has_factorised(system);
        let Way::Blocks(blocks) = &mut self.way else { return None };
        self.factored = known || blocks.factorise(system);
        self.revision = self.factored.then_some(system.revision);
        self.factored.then(|| blocks.negative()).flatten()
    }

    /// How it solves, in a few words.
    pub fn name(&self) -> &'static str {
        match &self.way {
            Way::Blocks(blocks) => blocks.name(),
            Way::General(_) => "sparse LU",
        }
    }

    /// Whether its last factorisation is that of this tangent.
    pub fn has_factorised(&self, system: &System) -> bool {
        self.factored && self.revision == Some(system.revision)
    }

    /// Factorises the tangent where it is another one than the last; whether there is a factorisation, and whether it is new.
    pub fn factorise_new(&mut self, system: &System) -> (bool, bool) {
        if self.has_factorised(system) {
            return (true, false);
        }
        let done = self.factorise(system);
        self.revision = Some(system.revision);
        (done, true)
    }

    /// Factorises the tangent; `false` where a pivot cannot be found.
    pub fn factorise(&mut self, system: &System) -> bool {
        // Its values may not stay.
        self.revision = None;
        self.factored = match &mut self.way {
            Way::Blocks(blocks) => blocks.factorise(system) || self.leave_blocks(system),
            Way::General(general) => general.factorise(system),
        };
        self.factored
    }

    /// The same for systems whose values do not stay: what it solves is looked at here and now.
    pub fn factorise_surely(&mut self, system: &System) -> bool {
        if !self.factorise(system) {
            return false;
        }
        let ones = vec![1.0; system.pattern.equations.count()];
        let mut x = system.multiply(&system.values, &ones);
        self.solve(system, &mut x)
    }

    /// Solves with the last factorisation, which is that of `system`; `false` where there is no solution. What blocks leave
    /// of the residual is refined.
    pub fn solve(&mut self, system: &System, right_hand_side: &mut [f64]) -> bool {
        if matches!(self.way, Way::General(_)) {
            return self.solve_once(system, right_hand_side);
        }
        let wanted = right_hand_side.to_vec();
        if self.solve_once(system, right_hand_side) && self.refine(system, &wanted, right_hand_side) {
            return true;
        }
        right_hand_side.copy_from_slice(&wanted);
        self.factored = self.leave_blocks(system);
        self.solve_once(system, right_hand_side)
    }

    /// Solves with the last factorisation; `false` where the solution is not finite.
    pub fn solve_once(&mut self, system: &System, right_hand_side: &mut [f64]) -> bool {
        if right_hand_side.is_empty() {
            return true;
        }
        if !self.factored {
            return false;
        }
        match &mut self.way {
            Way::Blocks(blocks) => blocks.solve(&system.pattern, right_hand_side),
            Way::General(general) => general.solve(right_hand_side),
        }
        right_hand_side.iter().all(|x| x.is_finite())
    }

    /// Corrects a solution until its residual is round-off; `false` where it stays larger than it may.
    fn refine(&mut self, system: &System, wanted: &[f64], x: &mut [f64]) -> bool {
        let mut error = f64::INFINITY;
        for _ in 0..=REFINEMENTS {
            let (mut residual, now) = system.residual(wanted, x);
            // A last correction that made it worse is round-off.
            if now <= BACKWARD_ERROR || now >= error {
                error = error.min(now);
                break;
            }
            error = now;
            if !self.solve_once(system, &mut residual) {
                return false;
            }
            x.iter_mut().zip(&residual).for_each(|(x, correction)| *x += correction);
        }
        error <= LARGEST_BACKWARD_ERROR
    }

    /// After corrections that led nowhere: in general where few digits of the softest stiffness are left, of which pivots save more; and
    /// back to blocks where they did not help either.
    pub fn doubt(&mut self, system: &System) {
        let few = |vector: NullVector| vector.digits(system) < FEW_DIGITS;
        if matches!(self.way, Way::General(_)) {
            self.return_to_blocks();
            self.in_vain = true;
            return;
        }
        // The factorisation may be that of the iterate before.
        if !self.in_vain && self.factorise(system) && self.softest(system).is_none_or(few) {
            self.factored = self.leave_blocks(system);
        }
    }

    /// From here on in general, until blocks have another chance.
    fn leave_blocks(&mut self, system: &System) -> bool {
        let known = self.other.take();
        let Some(mut general) = known.or_else(|| GeneralSolver::new(system).map(Box::new).map(Way::General)) else {
            return false;
        };
        let done = match &mut general {
            Way::General(general) => general.factorise(system),
            Way::Blocks(_) => false,
        };
        self.other = Some(std::mem::replace(&mut self.way, general));
        let [rest, next] = &mut self.absence;
        (*rest, *next) = (*next, next.saturating_mul(2));
        done
    }

    /// After a solution in balance. An iterate that flies far away loses digits that the structure has: blocks come back, after twice as many
    /// solutions each time.
    pub fn succeeded(&mut self) {
        self.in_vain = false;
        self.absence[0] = self.absence[0].saturating_sub(1);
        if self.absence[0] == 0 {
            self.return_to_blocks();
        }
    }

    /// Where there are some.
    fn return_to_blocks(&mut self) {
        if let Some(blocks) = self.other.take_if(|other| matches!(other, Way::Blocks(_))) {
            self.other = Some(std::mem::replace(&mut self.way, blocks));
            (self.factored, self.revision) = (false, None);
        }
    }
}
