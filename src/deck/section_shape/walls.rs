//! Walls of plies between points.

use super::outline::check_count;
use crate::deck::diagnostic::{Span, Spanned};
use crate::deck::reader::{Context, Item, Table};
use crate::deck::words::words;
use toml::de::DeValue;

/// Keys of a wall that is a table.
const WALL_KEYS: [&str; 6] = ["from", "to", "thickness", "layup", "side", "arc"];

words! {
    /// `side = …`
    pub enum WallSideWord {
        /// The wall lies to the left of its line, looking along it
        Left = "left",
        /// The line is the middle of the wall
        Middle = "middle",
        /// The wall lies to the right of its line
        Right = "right",
    }
}

words! {
    /// `theta_sense = …`
    pub enum ThetaSenseWord {
        /// Angles of fibres turn towards the direction of the wall
        Wall = "wall",
        /// Angles of fibres turn towards +2
        Fixed = "fixed",
    }
}

/// Walls between points.
#[derive(Clone, Debug)]
pub struct Walls {
    /// Names and places of points
    pub(crate) points: Vec<(Spanned<String>, [f64; 2])>,
    /// Walls
    pub(crate) walls: Vec<Wall>,
    /// Sense of angles of fibres
    pub(crate) theta_sense: ThetaSenseWord,
}

/// A wall.
#[derive(Clone, Debug)]
pub struct Wall {
    /// Names of its points
    pub(crate) ends: [Spanned<String>; 2],
    /// Its plies
    pub(crate) plies: WallPlies,
    /// Side of the line on which it lies
    pub(crate) side: WallSideWord,
    /// A point between the ends, of a round wall
    pub(crate) arc: Option<[f64; 2]>,
    /// Its place in the text
    pub(crate) span: Span,
}

/// The build of a wall.
#[derive(Clone, Debug)]
pub enum WallPlies {
    /// Thickness, of the material of the section
    Thickness(f64),
    /// Name of a layup
    Layup(Spanned<String>),
}

pub fn read_walls(table: &Table, layups: &[String]) -> Option<Walls> {
    let points = Table::of_names(table.context, table.get("points")?, "`points`")?;
    let points: Vec<_> = points.entries().map(|(name, item)| Some((name, table.context.vector(item)?.value))).collect();
    let points: Vec<_> = points.into_iter().collect::<Option<_>>()?;
    let item = table.get("walls")?;
    let DeValue::Array(walls) = item.get_ref() else {
        return table.wrong_key("walls", "`walls` is a list of [from, to, thickness or layup]");
    };
    check_count(table.context, item, walls.len())?;
    let side = table.word_or("side", WallSideWord::Middle)?;
    let walls: Vec<Option<Wall>> = walls.iter().map(|wall| read_wall(table, wall, &points, side, layups)).collect();
    let walls: Vec<Wall> = walls.into_iter().collect::<Option<_>>()?;
    let theta_sense = table.word_or("theta_sense", ThetaSenseWord::Wall)?;
    if walls.iter().any(|wall| matches!(wall.plies, WallPlies::Thickness(_))) {
        table.required("material")?;
    }
    Some(Walls { points, walls, theta_sense })
}

/// `["a", "b", 0.002]`, or a table.
fn read_wall<'a>(
    section: &Table<'a>,
    item: &'a Item<'a>,
    points: &[(Spanned<String>, [f64; 2])],
    side: WallSideWord,
    layups: &[String],
) -> Option<Wall> {
    let context = section.context;
    let span = item.span();
    if let DeValue::Array(parts) = item.get_ref() {
        let parts: Vec<_> = parts.iter().collect();
        let [from, to, plies] = parts[..] else {
            return context.wrong(span, "a wall is [from, to, thickness or layup]: [\"a\", \"b\", 0.002]");
        };
        let ends = [context.text(from), context.text(to)];
        let plies = read_plies(context, plies, layups);
        let [from, to] = ends;
        return Some(Wall { ends: [from?, to?], plies: plies?, side, arc: None, span });
    }
    let table = Table::new(context, item, "a wall", &WALL_KEYS)?;
    let from = table.required_text("from");
    let to = table.required_text("to");
    let plies = match (table.get("thickness"), table.get("layup")) {
        (Some(_), None) => table.positive("thickness").map(|thickness| WallPlies::Thickness(thickness.value)),
        (None, Some(_)) => table.text("layup").map(WallPlies::Layup),
        (Some(_), Some(_)) => table.wrong_key("layup", "a wall has `thickness` or `layup`, not both"),
        (None, None) => table.wrong("a wall needs `thickness` or `layup`"),
    };
    let side = table.word_or("side", side)?;
    let arc = table.optional("arc", |context, item| read_between(context, item, points));
    Some(Wall { ends: [from?, to?], plies: plies?, side, arc: arc?, span })
}

/// A point of a round wall: its name or its place.
fn read_between(context: &Context, item: &Item, points: &[(Spanned<String>, [f64; 2])]) -> Option<[f64; 2]> {
    if !matches!(item.get_ref(), DeValue::String(_)) {
        return context.vector(item).map(|at| at.value);
    }
    let name = context.text(item)?;
    match points.iter().find(|(known, _)| known.value == name.value) {
        Some((_, at)) => Some(*at),
        None => context.wrong(name.span, format!("the section has no point `{}`", name.value)),
    }
}

/// A thickness, or the name of a layup. A text that names no layup is an expression if it can be
/// one.
fn read_plies(context: &Context, item: &Item, layups: &[String]) -> Option<WallPlies> {
    if let DeValue::String(text) = item.get_ref() {
        let is_name = text.chars().all(|c| c.is_alphanumeric() || c == '_' || c == ' ' || c == '-');
        let is_known = layups.iter().any(|name| name == text.as_ref());
        let is_parameter = context.parameters.names().any(|name| name == text.as_ref());
        if is_known || is_name && !is_parameter {
            return context.text(item).map(WallPlies::Layup);
        }
    }
    let thickness = context.number(item)?;
    if thickness.value > 0.0 {
        return Some(WallPlies::Thickness(thickness.value));
    }
    context.wrong(thickness.span, format!("a wall must have a positive thickness, found {}", thickness.value))
}
