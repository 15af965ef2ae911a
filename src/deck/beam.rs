//! `[[beam]]`: centre line, sections and mesh of a beam.

use super::axes::{read_direction, read_unit};
use super::by_name::Named;
use super::diagnostic::{Span, Spanned};
use super::division::{Division, read_divisions, read_elements};
use super::history::{HistoryUse, read_history_use};
use super::point::{PointRef, check_name, read_point, read_point_list};
use super::reader::{Context, Item, Table, kind_of};
use super::words::words;
use toml::de::DeValue;

/// The centre line of a beam.
#[derive(Clone, Debug)]
pub enum Path {
    /// Straight pieces
    Through(Vec<Spanned<PointRef>>),
    /// Start, a point between, end of a circular arc
    Arc([Spanned<PointRef>; 3]),
    /// A helix about an axis
    Helix(Box<Helix>),
    /// A cubic spline
    Spline(SplinePath),
}

/// `helix = { … }`
#[derive(Clone, Debug)]
pub struct Helix {
    /// The place at which it starts; its distance from the axis is the radius
    pub start: Spanned<PointRef>,
    /// The name of the point at its end, where it has one
    pub(crate) end: Option<Spanned<PointRef>>,
    /// A point on the axis
    pub centre: Spanned<PointRef>,
    /// Direction of the axis, of length one
    pub axis: [f64; 3],
    /// Advance along the axis in a turn
    pub(crate) pitch: f64,
    /// Turns about the axis; negative: the other way round
    pub(crate) turns: f64,
    /// Place of the table
    pub(crate) span: Span,
}

/// `spline = […]` with its `tangents`
#[derive(Clone, Debug)]
pub struct SplinePath {
    /// Points on the spline, of which two do not follow one another at one place
    pub points: Vec<Spanned<PointRef>>,
    /// Directions at start and end; left out: no curvature there
    pub tangents: Option<Spanned<[[f64; 3]; 2]>>,
}

words! {
    /// `interpolation = …`
    pub enum InterpolationWord {
        /// Of rotations relative to the element
        Relative = "relative",
        /// Of total rotation vectors
        Total = "total",
    }
}

words! {
    /// `stations_in = …`
    pub enum StationsWord {
        /// Fractions of the length
        Fraction = "fraction",
        /// Arc length from the start
        Length = "length",
    }
}

/// `free_strain = […]` with its history
#[derive(Clone, Debug)]
pub struct FreeStrain {
    /// Gamma1 Gamma2 Gamma3 K1 K2 K3 in section axes
    pub(crate) strain: [f64; 6],
    /// Factor over time; left out: it ramps like a load
    pub(crate) history: Option<HistoryUse>,
}

/// `[[beam]]`
#[derive(Clone, Debug)]
pub struct Beam {
    /// Name of the beam
    pub(crate) name: Spanned<String>,
    /// One section, two for a taper, or more
    pub sections: Vec<Spanned<String>>,
    /// Places of the sections, from 0 to 1 as fractions of the length, or to the length; none: at
    /// start and end
    pub(crate) stations: Option<Spanned<Vec<f64>>>,
    /// The unit of the stations; left out: the last of them tells
    pub(crate) stations_in: Option<StationsWord>,
    /// Its centre line
    pub path: Path,
    /// Elements of each piece; one entry for all
    pub elements: Spanned<Vec<Division>>,
    /// Polynomial order of an element
    pub(crate) order: usize,
    /// Parts of each piece that node numbers count; left out: those between nodes
    pub(crate) numbering: Option<Spanned<Vec<Division>>>,
    /// The vector whose normal part is local axis 3
    pub axis3: Option<Spanned<[f64; 3]>>,
    /// Angle of axes 2 and 3 about axis 1: at start and end, or at the stations
    pub(crate) twist: Option<Spanned<Vec<[f64; 1]>>>,
    /// Places of the origin of the sections seen from the line, along axes 2 and 3: one, at start
    /// and end, or at the stations
    pub(crate) offset: Option<Spanned<Vec<[f64; 2]>>>,
    /// Angle of the sections about axis 1, relative to the axes of the beam: one, at start and end,
    /// or at the stations
    pub(crate) turn: Option<Spanned<Vec<[f64; 1]>>>,
    /// Interpolation of rotations
    pub(crate) interpolation: InterpolationWord,
    /// Strain without stress
    pub free_strain: Option<FreeStrain>,
    /// Place of the table
    pub span: Span,
}

impl Named for Beam {
    fn name(&self) -> &str {
        &self.name.value
    }
}

impl Beam {
    /// The elements of a piece of the centre line.
    pub fn elements_of(&self, piece: usize) -> &Division {
        &self.elements.value[piece.min(self.elements.value.len() - 1)]
    }

    /// The numbers of elements, as many as `elements` has entries.
    pub fn element_counts(&self) -> Vec<usize> {
        self.elements.value.iter().map(Division::count).collect()
    }

    /// The number of pieces of the centre line.
    pub fn pieces(&self) -> usize {
        self.path.pieces()
    }
}

impl Path {
    fn pieces(&self) -> usize {
        match self {
            Self::Through(points) => points.len().saturating_sub(1),
            Self::Arc(_) | Self::Helix(_) => 1,
            Self::Spline(spline) => spline.corners().len() - 1,
        }
    }

    /// True if elements approximate the line.
    pub fn is_curved(&self) -> bool {
        match self {
            Self::Through(_) => false,
            Self::Arc(_) | Self::Helix(_) | Self::Spline(_) => true,
        }
    }

    /// The points through which the line goes, as far as the deck gives them.
    pub fn points(&self) -> Vec<&Spanned<PointRef>> {
        match self {
            Self::Through(points) => points.iter().collect(),
            Self::Arc(points) => points.iter().collect(),
            Self::Helix(helix) => std::iter::once(&helix.start).chain(&helix.end).collect(),
            Self::Spline(spline) => spline.points.iter().collect(),
        }
    }
}

impl SplinePath {
    /// The numbers of the points at the ends of its pieces: first, last, and those with names.
    pub fn corners(&self) -> Vec<usize> {
        let last = self.points.len() - 1;
        let is_corner = |k: &usize| {
            let named = matches!(self.points[*k].value, PointRef::Name(_));
            named || *k == 0 || *k == last
        };
        (0..=last).filter(is_corner).collect()
    }
}

/// Keys of `[[beam]]`.
pub(super) const KEYS: [&str; 20] = [
    "name",
    "section",
    "stations",
    "stations_in",
    "through",
    "arc",
    "helix",
    "spline",
    "tangents",
    "elements",
    "grading",
    "order",
    "numbering",
    "axis3",
    "twist",
    "offset",
    "turn",
    "interpolation",
    "free_strain",
    "history",
];

/// Keys of `helix`.
pub(super) const HELIX_KEYS: [&str; 6] = ["start", "end", "centre", "axis", "pitch", "turns"];

pub(super) fn read_beam<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Beam> {
    let table = Table::new(context, item, "[[beam]]", &KEYS)?;
    let name = table.required_text("name").and_then(|name| check_name(context, name));
    let sections = table.required("section").and_then(|item| read_sections(context, item));
    let stations = read_stations(&table, sections.as_ref().map_or(0, Vec::len));
    if !table.has("stations") {
        table.refuse("stations_in", "`stations_in` is only allowed with `stations`");
    }
    let stations_in = table.optional("stations_in", |context, item| Some(context.word(item, "stations_in")?.value));
    let path = read_path(&table);
    let elements = read_elements(&table, path.as_ref().map(Path::pieces));
    let order = table.optional("order", read_order);
    let numbering = table.optional("numbering", |context, item| read_divisions(context, item, "numbering"));
    let axis3 = table.vector("axis3");
    let count = stations.as_ref().and_then(|stations| stations.as_ref().map(|stations| stations.value.len()));
    let twist = table.optional("twist", |context, item| read_along(context, item, "twist", count, 2));
    let offset = table.optional("offset", |context, item| read_along(context, item, "offset", count, 1));
    let turn = table.optional("turn", |context, item| read_along(context, item, "turn", count, 1));
    let interpolation = table.word_or("interpolation", InterpolationWord::Relative);
    let free_strain = read_free_strain(&table);
    Some(Beam {
        name: name?,
        sections: sections?,
        stations: stations?,
        stations_in: stations_in?,
        path: path?,
        elements: elements?,
        order: order?.unwrap_or(1),
        numbering: numbering?,
        axis3,
        twist: twist?,
        offset: offset?,
        turn: turn?,
        interpolation: interpolation?,
        free_strain: free_strain?,
        span: table.span.clone(),
    })
}

fn read_order(context: &Context, item: &Item) -> Option<usize> {
    let order = context.whole(item, 1, usize::MAX)?;
    if order.value <= 3 {
        return Some(order.value);
    }
    context.wrong(order.span, format!("`order` must be 1, 2 or 3, found {}", order.value))
}

/// `Some(None)` where there is no key.
fn read_free_strain(table: &Table) -> Option<Option<FreeStrain>> {
    if !table.has("free_strain") {
        table.refuse("history", "`history` of a beam is only allowed with `free_strain`");
    }
    table.optional("free_strain", |context, item| {
        let strain = context.vector::<6>(item)?.value;
        Some(FreeStrain { strain, history: read_history_use(table, None) })
    })
}

fn read_sections(context: &Context, item: &Item) -> Option<Vec<Spanned<String>>> {
    if !matches!(item.get_ref(), DeValue::Array(_)) {
        return Some(vec![context.text(item)?]);
    }
    let names = context.texts(item)?;
    if names.is_empty() {
        return context.wrong(
            item.span(),
            "`section` must be one name, two for a taper from start to end, or more with `stations`",
        );
    }
    Some(names)
}

/// Fractions of the length, one for each of the sections; none for a taper from start to end.
fn read_stations(table: &Table, sections: usize) -> Option<Option<Spanned<Vec<f64>>>> {
    let context = table.context;
    let Some(item) = table.get("stations") else {
        if sections > 2 {
            return table.wrong_key(
                "section",
                format!("{sections} sections need `stations`: the fraction of the length of each"),
            );
        }
        return Some(None);
    };
    let stations = context.numbers(item, None)?;
    let values = &stations.value;
    if values.len() != sections || sections < 2 {
        let message =
            format!("`stations` must be as many as sections, two or more: found {} and {sections}", values.len());
        return context.wrong(stations.span, message);
    }
    if values[0] != 0.0 || !values.is_sorted_by(|a, b| a < b) {
        return context.wrong(
            stations.span,
            "`stations` must increase from 0 (the start of the beam) to 1, or to its length (the end)",
        );
    }
    Some(Some(stations))
}

/// Entries of N numbers: one for the whole beam where `least` is 1, two for its start and its end,
/// or as many as there are stations.
fn read_along<const N: usize>(
    context: &Context,
    item: &Item,
    key: &str,
    stations: Option<usize>,
    least: usize,
) -> Option<Spanned<Vec<[f64; N]>>> {
    let entry = |item: &Item| match N {
        1 => Some([context.number(item)?.value; N]),
        _ => Some(context.vector::<N>(item)?.value),
    };
    let is_list = |item: &Item| matches!(item.get_ref(), DeValue::Array(_));
    let value = match item.get_ref() {
        DeValue::Array(list) if N == 1 || list.iter().any(is_list) => {
            list.iter().map(entry).collect::<Vec<_>>().into_iter().collect::<Option<Vec<_>>>()?
        }
        _ => vec![entry(item)?],
    };
    let found = value.len();
    if (least..=2).contains(&found) || (found > 2 && Some(found) == stations) {
        return Some(Spanned { value, span: item.span() });
    }
    let one = if least == 1 { "one entry, " } else { "" };
    let many = stations.map_or("as many as `stations`".into(), |count| format!("{count}, one for each of `stations`"));
    context.wrong(item.span(), format!("`{key}` must have {one}two (at start and end), or {many}; found {found}"))
}

fn read_path(table: &Table) -> Option<Path> {
    const LINES: [&str; 4] = ["through", "arc", "helix", "spline"];
    let given: Vec<&str> = LINES.into_iter().filter(|key| table.has(key)).collect();
    if !given.contains(&"spline") {
        table.refuse("tangents", "`tangents` is only allowed with `spline`");
    }
    match given[..] {
        [] => table.wrong("[[beam]] needs `through` (straight pieces), `arc` (a circular arc), `helix` or `spline`"),
        ["through"] => read_points_of(table, "through").map(Path::Through),
        ["arc"] => read_arc(table.context, table.get("arc")?),
        ["helix"] => read_helix(table.context, table.get("helix")?).map(|helix| Path::Helix(Box::new(helix))),
        ["spline"] => {
            let points = read_points_of(table, "spline");
            let tangents = table.optional("tangents", read_tangents);
            Some(Path::Spline(SplinePath { points: points?, tangents: tangents? }))
        }
        [first, second, ..] => {
            table.wrong_value(second, format!("a beam takes either `{first}` or `{second}`, not both"))
        }
        [_] => None,
    }
}

/// Two or more points.
fn read_points_of(table: &Table, key: &str) -> Option<Vec<Spanned<PointRef>>> {
    let item = table.get(key)?;
    let points = read_point_list(table.context, item)?;
    if points.len() < 2 {
        return table.context.wrong(item.span(), format!("`{key}` needs two or more points"));
    }
    Some(points)
}

fn read_arc(context: &Context, item: &Item) -> Option<Path> {
    let points = read_point_list(context, item)?;
    let count = points.len();
    let Ok(points) = points.try_into() else {
        let message = format!("`arc` must be [start, any point between, end], found {count} point(s)");
        return context.wrong(item.span(), message);
    };
    Some(Path::Arc(points))
}

fn read_helix<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Helix> {
    let table = Table::new(context, item, "helix", &HELIX_KEYS)?;
    let start = table.required("start").and_then(|item| read_point(context, item));
    let end = table.optional("end", |context, item| {
        let name = context.text(item)?;
        Some(name.map(PointRef::Name))
    });
    let centre = match table.get("centre") {
        Some(item) => read_point(context, item),
        None => Some(Spanned { value: PointRef::Coordinates([0.0; 3]), span: table.span.clone() }),
    };
    let axis = read_direction(&table, "axis");
    let pitch = table.required_number("pitch");
    let turns = table.required_number("turns");
    let turns = turns?;
    if turns.value == 0.0 {
        return context.wrong(turns.span, "`turns` must not be zero");
    }
    Some(Helix {
        start: start?,
        end: end?,
        centre: centre?,
        axis: axis?,
        pitch: pitch?.value,
        turns: turns.value,
        span: table.span.clone(),
    })
}

/// Directions at start and end of a spline, of length one.
fn read_tangents(context: &Context, item: &Item) -> Option<Spanned<[[f64; 3]; 2]>> {
    let DeValue::Array(rows) = item.get_ref() else {
        return context.wrong(
            item.span(),
            format!("`tangents` must be two vectors, at start and end, found {}", kind_of(item.get_ref())),
        );
    };
    if rows.len() != 2 {
        return context
            .wrong(item.span(), format!("`tangents` must be two vectors, at start and end, found {}", rows.len()));
    }
    let start = read_unit(context, &rows[0], "tangents");
    let end = read_unit(context, &rows[1], "tangents");
    Some(Spanned { value: [start?, end?], span: item.span() })
}
