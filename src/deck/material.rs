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
    pub(crate) elastic: Elastic,
    /// Density, where given
    pub density: Option<f64>,
    /// Strength, where given
    pub(crate) strength: Option<Strength>,
    /// Largest strain along the fibre, where given
    pub(crate) strain_limit: Option<f64>,
}

/// Strength of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// Von Mises stress at yield
    Yield(f64),
    /// Strengths in the axes of the material
    Ply {
        /// Xt, Yt, Zt
        tension: [f64; 3],
        /// Xc, Yc, Zc
        compression: [f64; 3],
        /// S12, S13, S23
        shear: [f64; 3],
    },
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
    pub(crate) young: f64,
    /// Shear modulus
    pub(crate) shear: f64,
    /// Poisson's ratio, for the shear factor
    pub(crate) poisson: f64,
}

/// Keys of `[material.NAME]`.
pub(super) const KEYS: [&str; 6] = ["E", "nu", "G", "rho", "strength", "strain_limit"];

/// Keys of `strength = {…}`.
pub(super) const STRENGTH_KEYS: [&str; 9] = ["Xt", "Xc", "Yt", "Yc", "Zt", "Zc", "S12", "S13", "S23"];

pub(super) fn read_material<'a>(context: &'a Context, name: Spanned<String>, item: &'a Item<'a>) -> Option<Material> {
    let table = Table::new(context, item, format!("[material.{}]", name.value), &KEYS)?;
    let density = table.non_negative("rho");
    let is_list = matches!(table.get("E").map(|item| item.get_ref()), Some(DeValue::Array(_)));
    let elastic = if is_list { read_orthotropic(&table) } else { read_isotropic(&table).map(Elastic::Isotropic) };
    let strength = table.optional("strength", |_, item| read_strength(&table, item));
    let strain_limit = table.optional("strain_limit", |_, _| table.positive("strain_limit"));
    Some(Material {
        name,
        elastic: elastic?,
        density: density.map(|d| d.value),
        strength: strength?,
        strain_limit: strain_limit?.map(|limit| limit.value),
    })
}

/// A yield stress, or strengths along and across the fibre.
fn read_strength<'a>(material: &Table<'a>, item: &'a Item<'a>) -> Option<Strength> {
    if !matches!(item.get_ref(), DeValue::Table(_)) {
        return material.positive("strength").map(|strength| Strength::Yield(strength.value));
    }
    let table = Table::new(material.context, item, "`strength`", &STRENGTH_KEYS)?;
    let needed = |key: &str| table.required_positive(key).map(|strength| strength.value);
    let [xt, xc, yt, yc, s12] = ["Xt", "Xc", "Yt", "Yc", "S12"].map(needed);
    let (yt, yc, s12) = (yt?, yc?, s12?);
    Some(Strength::Ply {
        tension: [xt?, yt, table.positive_or("Zt", yt)?],
        compression: [xc?, yc, table.positive_or("Zc", yc)?],
        shear: [s12, table.positive_or("S13", s12)?, table.positive_or("S23", s12)?],
    })
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
