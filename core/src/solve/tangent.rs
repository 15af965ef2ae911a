//! A tangent that solvers may use up: factors take its place, and who looks at it again has it
//! formed again.

use crate::kernel::Weights;
use crate::model::Assembly;
use crate::system::{Slot, State, System};
use crate::tensor::Mat3;

/// The tangent of a state, as it stands in an assembly.
pub struct Tangent<'a> {
    assembly: &'a mut Assembly,
    state: &'a State,
    /// The weights that it is formed again with; `None` where it stays
    weights: Option<Weights>,
    /// Blocks that are added to it then, see [`System::add_to_own_block`]
    additions: &'a [(Slot, Mat3)],
}

impl<'a> Tangent<'a> {
    /// One that stays: factors stand elsewhere.
    pub fn that_stays(assembly: &'a mut Assembly, state: &'a State) -> Self {
        Self { assembly, state, weights: None, additions: &[] }
    }

    /// One that may be used up. It was formed of this state with these weights.
    pub fn that_may_go(assembly: &'a mut Assembly, state: &'a State, weights: Weights) -> Self {
        Self { assembly, state, weights: Some(weights), additions: &[] }
    }

    /// The tangent to which something was added.
    pub fn with(self, additions: &'a [(Slot, Mat3)]) -> Self {
        Self { additions, ..self }
    }

    /// Where it stands, or what has taken its place.
    pub fn system(&self) -> &System {
        &self.assembly.system
    }

    /// The system whose values factors may take the place of; `None` where the tangent stays, or is
    /// gone already.
    pub(super) fn give_away(&mut self) -> Option<&mut System> {
        let may_go = self.weights.is_some() && !self.assembly.system.holds_factors();
        may_go.then_some(&mut self.assembly.system)
    }

    /// The tangent itself, formed again where it is gone.
    pub fn look(&mut self) -> &System {
        if let Some(weights) = self.weights.filter(|_| self.assembly.system.holds_factors()) {
            self.assembly.form_again(self.state, weights);
            for (slot, block) in self.additions {
                self.assembly.system.add_to_own_block(*slot, block);
            }
        }
        &self.assembly.system
    }

    /// True if it stays.
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
