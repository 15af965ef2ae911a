//! Newton's iteration: linear solver, stop test, and the failures it can end with.

mod block;
mod cholesky;
mod columns;
mod constraints;
mod convergence;
mod general;
mod krylov;
mod linear;
mod modes;
mod newton;
mod newton_failure;
mod pivots;
mod refinement;
mod reuse;
mod signature;
mod soft_mode;
mod softest;
mod stages;
mod stress_predictor;
mod tangent;
mod work;

pub use block::BlockSolver;
pub use cholesky::{Cholesky, NodeGraph};
pub use convergence::{Convergence, Judgement, Residual, Verdict, size};
pub use general::GeneralSolver;
pub use krylov::{First, Operator, Spectrum, largest_eigenvalues, leading_eigenvalues_until};
pub use linear::{Factorisation, LinearSolver};
pub use modes::{MIN_GROWTH_RATIO, Matrices, ModeSearch, ModeShape, Nearest, SmallMotion};
pub use newton::{Newton, NewtonMemory, contraction};
pub use newton_failure::NewtonFailure;
pub use pivots::is_symmetric;
pub use signature::Signature;
pub use soft_mode::{SoftMode, mechanism};
pub use softest::NullVector;
pub use tangent::Tangent;
pub use work::{Work, timed};
