//! Outlines with holes and fillets, and regions with a material each.

use super::angle::{Fibre, read_fibre};
use crate::deck::diagnostic::{Diagnostic, Span, Spanned};
use crate::deck::reader::{Context, Item, Table, kind_of};
use toml::de::DeValue;

/// Most points of an outline, walls or regions of a section.
const MOST_PARTS: usize = 2000;

/// Keys of `[[section.NAME.region]]`.
pub const REGION_KEYS: [&str; 7] = ["material", "outline", "circle", "rect", "holes", "theta", "beta"];

/// Keys of a circle.
pub const CIRCLE_KEYS: [&str; 2] = ["centre", "radius"];

/// Keys of a hole that is not a list of points.
const HOLE_KEYS: [&str; 2] = ["circle", "rect"];

/// A closed line.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// Corners, and the radius of each
    Corners(Vec<([f64; 2], f64)>),
    /// A circle
    Circle {
        /// Centre
        centre: [f64; 2],
        /// Radius
        radius: f64,
    },
}

/// `[[section.NAME.region]]`
#[derive(Clone, Debug)]
pub struct Region {
    /// Name of the material, if not that of the section
    pub material: Option<Spanned<String>>,
    /// Outer boundary
    pub(crate) outline: Outline,
    /// Holes
    pub(crate) holes: Vec<Outline>,
    /// Orientation of the material
    pub(crate) fibre: Fibre,
    /// Place of the table
    pub(crate) span: Span,
}

/// A list of at least three points.
pub fn read_corners(context: &Context, item: &Item) -> Option<Outline> {
    let points = read_points(context, item, "an outline")?;
    Some(Outline::Corners(points.into_iter().map(|at| (at, 0.0)).collect()))
}

/// A list of at least three points.
pub fn read_points(context: &Context, item: &Item, what: &str) -> Option<Vec<[f64; 2]>> {
    let DeValue::Array(points) = item.get_ref() else {
        let message = format!("{what} is a list of points [x2, x3], found {}", kind_of(item.get_ref()));
        return context.wrong(item.span(), message);
    };
    if points.len() < 3 {
        return context.wrong(item.span(), format!("{what} needs three or more points, found {}", points.len()));
    }
    check_count(context, item, points.len())?;
    let points: Vec<Option<[f64; 2]>> = points.iter().map(|at| context.vector(at).map(|at| at.value)).collect();
    points.into_iter().collect()
}

/// Refuses lists that are too long.
pub fn check_count(context: &Context, item: &Item, count: usize) -> Option<()> {
    if count <= MOST_PARTS {
        return Some(());
    }
    let message = format!("{count} entries are more than the limit of {MOST_PARTS} for a section");
    context.report(Diagnostic::limit(message, item.span()));
    None
}

/// Gives corners the radii of `fillet`: one for all, or one for each.
pub fn with_fillets(table: &Table, outline: Outline) -> Option<Outline> {
    let (Some(item), Outline::Corners(mut corners)) = (table.get("fillet"), outline.clone()) else {
        return Some(outline);
    };
    let radii = match item.get_ref() {
        DeValue::Array(_) => table.context.numbers(item, Some(corners.len()))?.value,
        _ => vec![table.context.number(item)?.value; corners.len()],
    };
    if let Some(radius) = radii.iter().find(|&&radius| radius < 0.0) {
        return table.wrong_key("fillet", format!("`fillet` must not be negative, found {radius}"));
    }
    corners.iter_mut().zip(radii).for_each(|(corner, radius)| corner.1 = radius);
    Some(Outline::Corners(corners))
}

/// `holes`: a list of lists of points, of circles and of rectangles.
pub fn read_holes<'a>(table: &Table<'a>) -> Option<Vec<Outline>> {
    let Some(item) = table.get("holes") else { return Some(Vec::new()) };
    let DeValue::Array(holes) = item.get_ref() else {
        return table.wrong_key("holes", "`holes` is a list of outlines: [[[x2, x3], …], { circle = r }]");
    };
    let holes: Vec<Option<Outline>> = holes.iter().map(|hole| read_hole(table.context, hole)).collect();
    holes.into_iter().collect()
}

fn read_hole<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Outline> {
    if !matches!(item.get_ref(), DeValue::Table(_)) {
        return read_corners(context, item);
    }
    let table = Table::new(context, item, "a hole", &HOLE_KEYS)?;
    match (table.get("circle"), table.get("rect")) {
        (Some(circle), None) => read_circle(context, circle),
        (None, Some(rect)) => read_rect(context, rect),
        (Some(_), Some(_)) | (None, None) => table.wrong("a hole is a list of points, a `circle` or a `rect`"),
    }
}

/// A radius about the origin, [x2, x3, radius], or a table of centre and radius.
fn read_circle<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Outline> {
    let is_table = matches!(item.get_ref(), DeValue::Table(_));
    let (centre, radius) = if is_table {
        let table = Table::new(context, item, "`circle`", &CIRCLE_KEYS)?;
        (table.vector_or("centre", [0.0; 2])?, table.required_positive("radius")?)
    } else if matches!(item.get_ref(), DeValue::Array(_)) {
        let Spanned { value: [x2, x3, radius], span } = context.vector::<3>(item)?;
        ([x2, x3], Spanned { value: radius, span })
    } else {
        ([0.0; 2], context.number(item)?)
    };
    if radius.value <= 0.0 {
        return context.wrong(radius.span, format!("the radius must be positive, found {}", radius.value));
    }
    Some(Outline::Circle { centre, radius: radius.value })
}

/// From and to along 2, from and to along 3.
fn read_rect(context: &Context, item: &Item) -> Option<Outline> {
    let Spanned { value: [left, right, bottom, top], span } = context.vector::<4>(item)?;
    if left >= right || bottom >= top {
        return context.wrong(span, "`rect` is [x2 from, x2 to, x3 from, x3 to], each pair increasing");
    }
    let corners = [[left, bottom], [right, bottom], [right, top], [left, top]];
    Some(Outline::Corners(corners.map(|at| (at, 0.0)).to_vec()))
}

pub fn read_regions(table: &Table) -> Option<Vec<Region>> {
    let item = table.get("region")?;
    check_count(table.context, item, table.list("region").len())?;
    let regions: Vec<Option<Region>> = table.list("region").into_iter().map(|item| read_region(table, item)).collect();
    if regions.is_empty() && table.has("region") {
        return table.wrong_key("region", "a section of regions needs at least one [[section.NAME.region]]");
    }
    regions.into_iter().collect()
}

fn read_region<'a>(section: &Table<'a>, item: &'a Item<'a>) -> Option<Region> {
    let table = Table::new(section.context, item, "a region", &REGION_KEYS)?;
    let material = table.optional("material", |context, item| context.text(item));
    if !table.has("material") && !section.has("material") {
        table.required("material");
    }
    let outline = match (table.get("outline"), table.get("circle"), table.get("rect")) {
        (Some(item), None, None) => read_corners(table.context, item),
        (None, Some(item), None) => read_circle(table.context, item),
        (None, None, Some(item)) => read_rect(table.context, item),
        _ => table.wrong("a region needs one of `outline`, `circle`, `rect`"),
    };
    let holes = read_holes(&table);
    let fibre = read_fibre(&table);
    Some(Region { material: material?, outline: outline?, holes: holes?, fibre: fibre?, span: item.span() })
}
