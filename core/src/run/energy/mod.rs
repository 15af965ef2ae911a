//! The account of the energy, and what watches it.

mod guard;
mod ledger;

pub(super) use guard::{EnergyGuard, Growth, Imbalance, is_unbalanced};
pub(super) use ledger::Bookkeeper;
pub use ledger::Ledger;
