//! `[[beam]]`: centre line, sections and mesh of a beam.

use super::diagnostic::{Span, Spanned};
use super::division::{Division, read_divisions, read_elements};
use super::history::{HistoryUse, read_history_use};
use super::point::{PointRef, check_name, read_point_list};
use super::reader::{Context, Item, Table};
use super::words::words;
use toml::de::DeValue;

/// The centre line of a beam.
#[derive(Clone, Debug)]
pub enum Path {
    /// Straight pieces
    Through(Vec<Spanned<PointRef>>),
    /// Start, a point between, end of a circular arc
    Arc([Spanned<PointRef>; 3]),
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
    pub strain: [f64; 6],
    /// Factor over time; left out: it ramps like a load
    pub history: Option<HistoryUse>,
}

/// `[[beam]]`
#[derive(Clone, Debug)]
pub struct Beam {
    /// Name of the beam
    pub name: Spanned<String>,
    /// One section, two for a taper, or more
    pub sections: Vec<Spanned<String>>,
    /// Places of the sections, from 0 to 1 as fractions of the length, or to the length; none: at
    /// start and end
    pub stations: Option<Spanned<Vec<f64>>>,
    /// The unit of the stations; left out: the last of them tells
    pub stations_in: Option<StationsWord>,
    /// Its centre line
    pub path: Path,
    /// Elements of each piece; one entry for all
    pub elements: Spanned<Vec<Division>>,
    /// Polynomial order of an element
    pub order: usize,
    /// Parts of each piece that node numbers count; left out: those between nodes
    pub numbering: Option<Spanned<Vec<Division>>>,
    /// The vector whose normal part is local axis 3
    pub axis3: Option<Spanned<[f64; 3]>>,
    /// Angle of the section about axis 1 at start and end
    pub twist: Option<[f64; 2]>,
    /// Interpolation of rotations
    pub interpolation: InterpolationWord,
    /// Strain without stress
    pub free_strain: Option<FreeStrain>,
    /// Place of the table
    pub span: Span,
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
            Self::Arc(_) => 1,
        }
    }
}

/// Keys of `[[beam]]`.
pub(super) const KEYS: [&str; 15] = [
    "name",
    "section",
    "stations",
    "stations_in",
    "through",
    "arc",
    "elements",
    "grading",
    "order",
    "numbering",
    "axis3",
    "twist",
    "interpolation",
    "free_strain",
    "history",
];

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
    let twist = table.vector("twist").map(|t| t.value);
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
        twist,
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

fn read_path(table: &Table) -> Option<Path> {
    let context = table.context;
    match (table.get("through"), table.get("arc")) {
        (Some(item), None) => {
            let points = read_point_list(context, item)?;
            if points.len() < 2 {
                return context.wrong(item.span(), "`through` needs two or more points");
            }
            Some(Path::Through(points))
        }
        (None, Some(item)) => {
            let points = read_point_list(context, item)?;
            let count = points.len();
            let Ok(points) = points.try_into() else {
                let message = format!("`arc` must be [start, any point between, end], found {count} point(s)");
                return context.wrong(item.span(), message);
            };
            Some(Path::Arc(points))
        }
        (Some(_), Some(item)) => {
            context.wrong(item.span(), "a beam takes either `through` (points) or `arc`, not both")
        }
        (None, None) => table.wrong("[[beam]] needs `through` (straight pieces) or `arc` (a circular arc)"),
    }
}
