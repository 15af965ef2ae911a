//! `[damping]`: Rayleigh damping.

use super::reader::{Context, Item, Table};
use toml::de::DeValue;

/// `[damping]`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damping {
    /// Factor of the mass, one over a time
    pub(crate) mass: f64,
    /// Factors of the stiffness for Gamma1 Gamma2 Gamma3 K1 K2 K3, times
    pub(crate) stiffness: [f64; 6],
}

impl Damping {
    /// No damping.
    pub const NONE: Self = Self { mass: 0.0, stiffness: [0.0; 6] };
}

/// Keys of `[damping]`.
pub(super) const KEYS: [&str; 2] = ["mass", "stiffness"];

pub(super) fn read_damping(top: &Table) -> Option<Damping> {
    let table = Table::new(top.context, top.get("damping")?, "[damping]", &KEYS)?;
    let mass = table.non_negative_or("mass", 0.0);
    let stiffness = table.optional("stiffness", read_stiffness);
    Some(Damping { mass: mass?, stiffness: stiffness?.unwrap_or([0.0; 6]) })
}

/// One factor for all strains, or one for each.
fn read_stiffness(context: &Context, item: &Item) -> Option<[f64; 6]> {
    let factors = match item.get_ref() {
        DeValue::Array(_) => context.vector::<6>(item)?,
        _ => context.number(item)?.map(|factor| [factor; 6]),
    };
    match factors.value.iter().find(|&&factor| factor < 0.0) {
        Some(factor) => context.wrong(factors.span, format!("`stiffness` must not be negative, found {factor}")),
        None => Some(factors.value),
    }
}
