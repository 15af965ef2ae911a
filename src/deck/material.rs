//! `[material.NAME]`: elastic constants and density.

use super::diagnostic::Spanned;
use super::reader::{Context, Item, Table};
use toml::de::DeValue;

/// `[material.NAME]`
#[derive(Clone, Debug)]
pub struct Material {
    /// Name of the table
    pub name: Spanned<String>,
    /// Elastic constants
    pub elastic: Elastic,
    /// Density, where given
    pub density: Option<f64>,
}

/// Elastic constants of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Elastic {
    /// The same in all directions
    Isotropic(Isotropic),
    /// Different along the fibre (1), across it in the ply (2) and normal to the ply (3)
    Orthotropic {
        /// E1, E2, E3
        young: [f64; 3],
        /// G12, G13, G23
        shear: [f64; 3],
        /// nu12, nu13, nu23
        poisson: [f64; 3],
    },
}

/// Elastic constants of an isotropic material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Isotropic {
    /// Young's modulus
    pub young: f64,
    /// Shear modulus
    pub shear: f64,
    /// Poisson's ratio, for the shear factor
    pub poisson: f64,
}

/// Keys of `[material.NAME]`.
pub(super) const KEYS: [&str; 4] = ["E", "nu", "G", "rho"];

pub(super) fn read_material<'a>(context: &'a Context, name: Spanned<String>, item: &'a Item<'a>) -> Option<Material> {
    let table = Table::new(context, item, format!("[material.{}]", name.value), &KEYS)?;
    let density = table.non_negative("rho");
    let is_list = matches!(table.get("E").map(|item| item.get_ref()), Some(DeValue::Array(_)));
    let elastic = if is_list { read_orthotropic(&table) } else { read_isotropic(&table).map(Elastic::Isotropic) };
    Some(Material { name, elastic: elastic?, density: density.map(|d| d.value) })
}

fn read_isotropic(table: &Table) -> Option<Isotropic> {
    let young = table.required_positive("E");
    let poisson = table.number("nu");
    let shear = table.positive("G");
    if table.has("nu") {
        table.refuse("G", "give `nu` or `G`, not both");
    } else if !table.has("G") {
        table.wrong::<()>(format!("{} needs `nu` or `G`", table.what));
    }
    if let Some(nu) = poisson.as_ref().filter(|nu| !(-1.0 < nu.value && nu.value <= 0.5)) {
        let message = format!("`nu` must be above -1 and at most 0.5, found {}", nu.value);
        return table.context.wrong(nu.span.clone(), message);
    }
    let young = young?.value;
    match (poisson, shear) {
        (Some(nu), _) => Some(Isotropic { young, shear: young / (2.0 * (1.0 + nu.value)), poisson: nu.value }),
        (None, Some(shear)) => {
            Some(Isotropic { young, shear: shear.value, poisson: young / (2.0 * shear.value) - 1.0 })
        }
        (None, None) => None,
    }
}

/// Three constants of each kind. With `E = [E1, E2]` the material is the same in all directions
/// across the fibre: 13 is as 12, and G23 = E2 / 2 (1 + nu23) where it is left out.
fn read_orthotropic(table: &Table) -> Option<Elastic> {
    let young = read_constants(table, "E");
    let poisson = read_constants(table, "nu");
    let shear = read_constants(table, "G");
    let (young, poisson, shear) = (young?, poisson?, shear?);
    let poisson = match poisson[..] {
        [one] => [one; 3],
        [nu12, nu23] => [nu12, nu12, nu23],
        [nu12, nu13, nu23, ..] => [nu12, nu13, nu23],
        [] => return None,
    };
    let is_round = young.len() == 2;
    let young = if let [e1, e2] = young[..] { [e1, e2, e2] } else { young.try_into().ok()? };
    let shear = match shear[..] {
        [one] if is_round => [one, one, young[1] / (2.0 * (1.0 + poisson[2]))],
        [one] => [one; 3],
        [g12, g23] => [g12, g12, g23],
        [g12, g13, g23, ..] => [g12, g13, g23],
        [] => return None,
    };
    for (key, values) in [("E", young), ("G", shear)] {
        if let Some(value) = values.into_iter().find(|&value| value <= 0.0) {
            return table.wrong_key(key, format!("`{key}` must be positive, found {value}"));
        }
    }
    Some(Elastic::Orthotropic { young, shear, poisson })
}

/// A number, or a list of two or three.
fn read_constants(table: &Table, key: &str) -> Option<Vec<f64>> {
    let item = table.required(key)?;
    if !matches!(item.get_ref(), DeValue::Array(_)) {
        return Some(vec![table.context.number(item)?.value]);
    }
    let list = table.context.numbers(item, None)?;
    if matches!(list.value.len(), 2 | 3) {
        return Some(list.value);
    }
    let names = match key {
        "E" => "[E1, E2, E3], or [E1, E2] with E3 = E2",
        "G" => "[G12, G13, G23], or [G12, G23] with G13 = G12",
        _ => "[nu12, nu13, nu23], or [nu12, nu23] with nu13 = nu12",
    };
    table.context.wrong(list.span, format!("`{key}` of an orthotropic material is {names}"))
}
