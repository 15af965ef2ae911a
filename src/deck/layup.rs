//! `[layup.NAME]`: plies of walls.

use super::diagnostic::Spanned;
use super::reader::{Context, Item, Table};
use super::section_shape::read_angle;
use toml::de::DeValue;

/// `[layup.NAME]`
#[derive(Clone, Debug)]
pub struct Layup {
    /// Name of the table
    pub(crate) name: Spanned<String>,
    /// Plies, from the left face of a wall (looking along it) or the outside of a skin
    pub(crate) plies: Vec<Ply>,
}

/// A ply of a layup.
#[derive(Clone, Debug)]
pub struct Ply {
    /// Name of the material
    pub material: Spanned<String>,
    /// Thickness
    pub thickness: f64,
    /// Angle of the fibre from axis 1 towards the direction of the wall, rad
    pub theta: f64,
}

/// Keys of `[layup.NAME]`.
pub(super) const KEYS: [&str; 1] = ["plies"];

pub(super) fn read_layup<'a>(context: &'a Context, name: Spanned<String>, item: &'a Item<'a>) -> Option<Layup> {
    let table = Table::new(context, item, format!("[layup.{}]", name.value), &KEYS)?;
    let item = table.required("plies")?;
    let plies: Vec<Option<Ply>> = match item.get_ref() {
        DeValue::Array(plies) if !plies.is_empty() => plies.iter().map(|ply| read_ply(context, ply)).collect(),
        _ => return context.wrong(item.span(), "`plies` must be a list of [material, thickness, angle]"),
    };
    Some(Layup { name, plies: plies.into_iter().collect::<Option<_>>()? })
}

fn read_ply(context: &Context, item: &Item) -> Option<Ply> {
    let span = item.span();
    let parts = item.get_ref().as_array().map_or(Vec::new(), |parts| parts.iter().collect());
    let (material, thickness, angle) = match parts[..] {
        [material, thickness] => (material, thickness, None),
        [material, thickness, angle] => (material, thickness, Some(angle)),
        _ => return context.wrong(span, "a ply is [material, thickness, angle]: [\"glass\", 0.001, \"45*deg\"]"),
    };
    let material = context.text(material);
    let thickness = context.number(thickness)?;
    if thickness.value <= 0.0 {
        return context
            .wrong(thickness.span, format!("a ply must have a positive thickness, found {}", thickness.value));
    }
    let theta = angle.map_or(Some(0.0), |angle| read_angle(context, angle))?;
    Some(Ply { material: material?, thickness: thickness.value, theta })
}
