//! What a stage does, as far as effects and amplitudes need to know.

/// What a stage does with the clock and the load factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StageKind {
    /// The load factor goes from 0 to 1, the clock stands.
    Static,
    /// The clock runs, the load factor is 1.
    Dynamic,
    /// Small motions about the state that was reached: nothing goes on.
    Modal,
    /// The load factor goes on to where the state loses its stiffness.
    Buckling,
}

/// The stages in which something acts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StageSet(pub Option<Vec<usize>>);

impl StageSet {
    /// Whether stage number `stage` (from 0) is one of them; no list means all.
    pub fn contains(&self, stage: usize) -> bool {
        self.0.as_ref().is_none_or(|stages| stages.contains(&stage))
    }
}

/// A stage as effects see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageContext {
    /// From 0
    pub number: usize,
    /// What it does
    pub kind: StageKind,
    /// Whether it is seen from a frame that rotates, whose own effect then holds all inertia
    pub rotating: bool,
}
