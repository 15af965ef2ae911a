//! A tangent that solvers may overwrite with factors, and that is formed again when its values are
//! needed.

use crate::kernel::Weights;
use crate::model::Assembly;
use crate::system::{Slot, State, System};
use crate::tensor::Mat3;

/// The tangent of a state in an assembly.
pub struct Tangent<'a> {
    assembly: &'a mut Assembly,
    state: &'a State,
    /// Weights with which the tangent is formed again; `None` if it must not be overwritten
    weights: Option<Weights>,
    /// Blocks that are added after it is formed again, see [`System::add_to_own_block`]
    additions: &'a [(Slot, Mat3)],
}

impl<'a> Tangent<'a> {
    /// A tangent that must not be overwritten.
    pub fn that_stays(assembly: &'a mut Assembly, state: &'a State) -> Self {
        Self { assembly, state, weights: None, additions: &[] }
    }

    /// A tangent that may be overwritten, formed at this state with these weights.
    pub fn that_may_go(assembly: &'a mut Assembly, state: &'a State, weights: Weights) -> Self {
        Self { assembly, state, weights: Some(weights), additions: &[] }
    }

    /// The tangent plus diagonal blocks that have been added to it.
    pub fn with(self, additions: &'a [(Slot, Mat3)]) -> Self {
        Self { additions, ..self }
    }

    /// The system of the tangent, whose values may be factors.
    pub fn system(&self) -> &System {
        &self.assembly.system
    }

    /// The system whose tangent factors may overwrite; `None` if they must not, or already have.
    pub(super) fn give_away(&mut self) -> Option<&mut System> {
        let may_go = self.weights.is_some() && !self.assembly.system.holds_factors();
        may_go.then_some(&mut self.assembly.system)
    }

    /// The system with the tangent itself, formed again if it was overwritten.
    pub fn look(&mut self) -> &System {
        if let Some(weights) = self.weights.filter(|_| self.assembly.system.holds_factors()) {
            self.assembly.form_again(self.state, weights);
            for (slot, block) in self.additions {
                self.assembly.system.add_to_own_block(*slot, block);
            }
        }
        &self.assembly.system
    }

    /// True if the tangent must not be overwritten.
    pub(super) fn stays(&self) -> bool {
        self.weights.is_none()
    }

    pub(super) fn assembly(&self) -> &Assembly {
        self.assembly
    }

    pub(super) fn state(&self) -> &State {
        self.state
    }
}
