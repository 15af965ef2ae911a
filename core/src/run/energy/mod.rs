//! The account of the energy, and what watches it.

mod guard;
mod ledger;

pub(super) use guard::{EnergyGuard, Growth, Imbalance, is_unbalanced};
pub use ledger::Ledger;
pub(super) use ledger::{Bookkeeper, Entry};
