//! Newton's iteration: linear solver, stop test, and the failures it can end with.

mod convergence;
mod linear;
mod newton;

pub use convergence::{Convergence, Residual, Verdict};
pub use linear::{LinearSolver, NullVector};
pub use newton::{Newton, NewtonFailure, Work};
