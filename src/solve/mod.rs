//! Newton's iteration: linear solver, stop test, and the failures it can end with.

mod convergence;
mod krylov;
mod linear;
mod mechanism;
mod newton;
mod pivots;

pub use convergence::{Convergence, Residual, Verdict};
pub use krylov::{Operator, largest_eigenvalues};
pub use linear::{LinearSolver, NullVector};
pub use mechanism::{Limp, mechanism};
pub use newton::{Newton, NewtonFailure, Work, timed};
pub use pivots::{Pivots, is_symmetric};
