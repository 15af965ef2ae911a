//! `[material.NAME]`: elastic constants and density.

use super::diagnostic::Spanned;
use super::reader::{Context, Item, Table};

/// `[material.NAME]`
#[derive(Clone, Debug)]
pub struct Material {
    /// Name of the table
    pub name: Spanned<String>,
    /// Young's modulus
    pub young: f64,
    /// Shear modulus
    pub shear: f64,
    /// Poisson's ratio, for the shear factor
    pub poisson: f64,
    /// Density, where given
    pub density: Option<f64>,
}

/// Keys of `[material.NAME]`.
pub(super) const KEYS: [&str; 4] = ["E", "nu", "G", "rho"];

pub(super) fn read_material<'a>(context: &'a Context, name: Spanned<String>, item: &'a Item<'a>) -> Option<Material> {
    let table = Table::new(context, item, format!("[material.{}]", name.value), &KEYS)?;
    let young = table.required_positive("E");
    let density = table.non_negative("rho");
    let poisson = table.number("nu");
    let shear = table.positive("G");
    if table.has("nu") {
        table.refuse("G", "give `nu` or `G`, not both");
    } else if !table.has("G") {
        table.wrong::<()>(format!("{} needs `nu` or `G`", table.what));
    }
    if let Some(nu) = poisson.as_ref().filter(|nu| !(-1.0 < nu.value && nu.value <= 0.5)) {
        let message = format!("`nu` lies above -1 and up to 0.5, found {}", nu.value);
        return context.wrong(nu.span.clone(), message);
    }
    let young = young?.value;
    let (poisson, shear) = match (poisson, shear) {
        (Some(nu), _) => (nu.value, young / (2.0 * (1.0 + nu.value))),
        (None, Some(shear)) => (young / (2.0 * shear.value) - 1.0, shear.value),
        (None, None) => return None,
    };
    Some(Material { name, young, shear, poisson, density: density.map(|d| d.value) })
}
