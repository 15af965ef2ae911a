//! `[damping]`: Rayleigh damping.

use super::reader::Table;

/// Keys of `[damping]`.
pub(super) const KEYS: [&str; 2] = ["mass", "stiffness"];

/// Rayleigh factors of mass and stiffness.
pub(super) fn read_damping(top: &Table) -> Option<[f64; 2]> {
    let table = Table::new(top.context, top.get("damping")?, "[damping]", &KEYS)?;
    let mass = table.non_negative_or("mass", 0.0);
    let stiffness = table.non_negative_or("stiffness", 0.0);
    Some([mass?, stiffness?])
}
