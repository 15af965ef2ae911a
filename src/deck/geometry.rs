//! Points, materials, sections and beams.

use super::action::{HistoryUse, read_history_use};
use super::diagnostic::{Diagnostic, Span, Spanned};
use super::reader::{Context, Item, Table, choose, kind_of};
use toml::de::DeValue;

/// `[material.NAME]`
#[derive(Clone, Debug)]
pub struct Material {
    /// Its name
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

/// `[section.NAME]`
#[derive(Clone, Debug)]
pub struct Section {
    /// Its name
    pub name: Spanned<String>,
    /// What it is
    pub body: SectionBody,
}

/// The three ways to give a section.
#[derive(Clone, Debug)]
pub enum SectionBody {
    /// Resultants
    Resultants {
        /// EA, GA2, GA3, GJ, EI2, EI3
        stiffness: [f64; 6],
        /// Mass per length
        mass: Option<f64>,
        /// Rotary inertia per length about 1, 2, 3
        rotary: Option<[f64; 3]>,
    },
    /// Full matrices in the order Gamma1 Gamma2 Gamma3 K1 K2 K3
    Full {
        /// 6x6 stiffness
        stiffness: [[f64; 6]; 6],
        /// 6x6 mass
        mass: Option<[[f64; 6]; 6]>,
    },
    /// Shape and material
    Shaped {
        /// The shape
        shape: Shape,
        /// The name of the material
        material: Spanned<String>,
        /// Shear factors along 2 and 3, if not Cowper's
        shear_factor: Option<[f64; 2]>,
    },
}

/// A cross-section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Solid circle
    Circle {
        /// Radius
        radius: f64,
    },
    /// Ring
    Tube {
        /// Outer radius
        radius: f64,
        /// Wall
        thickness: f64,
    },
    /// Solid rectangle
    Rectangle {
        /// Along axis 2
        width: f64,
        /// Along axis 3
        height: f64,
    },
}

/// A place in a path: a name or coordinates.
#[derive(Clone, Debug, PartialEq)]
pub enum PointRef {
    /// A name of `[point]`
    Name(String),
    /// A place without a name
    Coordinates([f64; 3]),
}

/// The centre line of a beam.
#[derive(Clone, Debug)]
pub enum Path {
    /// Straight pieces
    Through(Vec<Spanned<PointRef>>),
    /// Start, a point between, end of a circular arc
    Arc([Spanned<PointRef>; 3]),
}

/// `interpolation = …`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InterpolationWord {
    /// Of total rotation vectors
    Total,
    /// Of rotations relative to the element
    Relative,
}

impl InterpolationWord {
    /// As it stands in the deck.
    pub fn word(self) -> &'static str {
        match self {
            Self::Total => "total",
            Self::Relative => "relative",
        }
    }
}

/// `free_strain = […]` with its history
#[derive(Clone, Debug)]
pub struct FreeStrain {
    /// Gamma1 Gamma2 Gamma3 K1 K2 K3 in section axes
    pub strain: [f64; 6],
    /// How it goes; without one it ramps like a load
    pub history: Option<HistoryUse>,
}

/// `[[beam]]`
#[derive(Clone, Debug)]
pub struct Beam {
    /// Its name
    pub name: Spanned<String>,
    /// One section, two for a taper, or more
    pub sections: Vec<Spanned<String>>,
    /// Where they are, from 0 to 1 as fractions of the length, or to the length; none: at start and end
    pub stations: Option<Spanned<Vec<f64>>>,
    /// Its centre line
    pub path: Path,
    /// Elements of each piece; one number for all
    pub elements: Spanned<Vec<usize>>,
    /// Polynomial order of an element
    pub order: usize,
    /// How many equal parts of each piece node numbers count; left out: those between nodes
    pub numbering: Option<Spanned<Vec<usize>>>,
    /// The vector whose normal part is local axis 3
    pub axis3: Option<Spanned<[f64; 3]>>,
    /// Angle of the section about axis 1 at start and end
    pub twist: Option<[f64; 2]>,
    /// How rotations are interpolated
    pub interpolation: InterpolationWord,
    /// Strain without stress
    pub free_strain: Option<FreeStrain>,
    /// Where the table stands
    pub span: Span,
}

/// Most elements a deck may ask for.
pub const MOST_ELEMENTS: usize = 2_000_000;

pub(super) fn read_points(top: &Table) -> Vec<(Spanned<String>, [f64; 3])> {
    let Some(item) = top.get("point") else { return Vec::new() };
    let Some(table) = Table::of_names(top.context, item, "[point]") else { return Vec::new() };
    table
        .entries()
        .filter_map(|(name, item)| Some((check_name(table.context, name)?, table.context.vector(item)?.value)))
        .collect()
}

/// Names of points and beams stand in node names and column names, so they keep clear of their punctuation.
pub(super) fn check_name(context: &Context, name: Spanned<String>) -> Option<Spanned<String>> {
    let bad = name.value.chars().find(|c| matches!(c, '@' | ':' | '.' | ',' | '"' | '/' | '\\') || c.is_control());
    if name.value.trim().is_empty() {
        return context.wrong(name.span, "a name must not be empty");
    }
    match bad {
        Some(c) => context
            .wrong(name.span, format!("a name must not contain {c:?}: it would be ambiguous in node and column names")),
        None => Some(name),
    }
}

pub(super) fn read_material<'a>(context: &'a Context, name: Spanned<String>, item: &'a Item<'a>) -> Option<Material> {
    let table = Table::new(context, item, format!("[material.{}]", name.value), &["E", "nu", "G", "rho"])?;
    table.required("E");
    let young = table.positive("E");
    let density = table.number("rho");
    if let Some(rho) = density.as_ref().filter(|rho| rho.value < 0.0) {
        context.report(Diagnostic::error("`rho` must not be negative", rho.span.clone()));
    }
    let (nu, shear) = (table.number("nu"), table.positive("G"));
    if table.has("nu") && table.has("G") {
        context.report(Diagnostic::error("give `nu` or `G`, not both", table.key_span("G")));
    } else if !table.has("nu") && !table.has("G") {
        context.report(Diagnostic::error(format!("{} needs `nu` or `G`", table.what), table.span.clone()));
    }
    if let Some(nu) = nu.as_ref().filter(|nu| !(-1.0 < nu.value && nu.value <= 0.5)) {
        let message = format!("`nu` lies above -1 and up to 0.5, found {}", nu.value);
        return context.wrong(nu.span.clone(), message);
    }
    let young = young?.value;
    let (poisson, shear) = match (nu, shear) {
        (Some(nu), _) => (nu.value, young / (2.0 * (1.0 + nu.value))),
        (None, Some(shear)) => (young / (2.0 * shear.value) - 1.0, shear.value),
        (None, None) => return None,
    };
    Some(Material { name, young, shear, poisson, density: density.map(|d| d.value) })
}

const RESULTANT_KEYS: [&str; 6] = ["EA", "GA", "GJ", "EI", "rhoA", "rhoJ"];
const FULL_KEYS: [&str; 2] = ["stiffness", "mass"];
const SHAPE_KEYS: [&str; 7] = ["material", "shape", "radius", "thickness", "width", "height", "shear_factor"];

pub(super) fn read_section<'a>(context: &'a Context, name: Spanned<String>, item: &'a Item<'a>) -> Option<Section> {
    let keys = [&RESULTANT_KEYS[..], &FULL_KEYS, &SHAPE_KEYS].concat();
    let table = Table::new(context, item, format!("[section.{}]", name.value), &keys)?;
    let families = [&RESULTANT_KEYS[..], &FULL_KEYS, &SHAPE_KEYS];
    let used: Vec<usize> = (0..3).filter(|&k| families[k].iter().any(|key| table.has(key))).collect();
    let body = match used[..] {
        [0] => read_resultants(&table),
        [1] => read_full(&table),
        [2] => read_shaped(&table),
        [] => context.wrong(
            table.span.clone(),
            format!("{} needs resultants (EA, GA, GJ, EI), or `stiffness`, or `material` and `shape`", table.what),
        ),
        _ => {
            let key = families[used[1]].iter().find(|key| table.has(key)).expect("a key of the second family");
            context.wrong(
                table.key_span(key),
                format!("{} is given in two ways; keep resultants, or `stiffness`, or `shape`", table.what),
            )
        }
    };
    Some(Section { name, body: body? })
}

/// One number for both, or two.
fn pair(table: &Table, key: &str) -> Option<[f64; 2]> {
    let item = table.required(key)?;
    let values = match item.get_ref() {
        DeValue::Array(_) => table.context.vector::<2>(item)?,
        _ => table.context.number(item)?.map(|v| [v, v]),
    };
    if values.value.iter().all(|&v| v > 0.0) {
        return Some(values.value);
    }
    table.context.wrong(values.span, format!("`{key}` must be positive"))
}

fn read_resultants(table: &Table) -> Option<SectionBody> {
    let required = |key: &str| {
        table.required(key)?;
        table.positive(key).map(|v| v.value)
    };
    let (ea, ga, gj, ei) = (required("EA"), pair(table, "GA"), required("GJ"), pair(table, "EI"));
    let mass = not_negative(table, "rhoA");
    let rotary = table.get("rhoJ").and_then(|item| table.context.vector::<3>(item));
    if let Some(rotary) = rotary.as_ref().filter(|j| j.value.iter().any(|&v| v < 0.0)) {
        table.context.report(Diagnostic::error("`rhoJ` must not be negative", rotary.span.clone()));
    }
    let (ga, ei) = (ga?, ei?);
    Some(SectionBody::Resultants {
        stiffness: [ea?, ga[0], ga[1], gj?, ei[0], ei[1]],
        mass,
        rotary: rotary.map(|j| j.value),
    })
}

fn not_negative(table: &Table, key: &str) -> Option<f64> {
    let number = table.number(key)?;
    if number.value >= 0.0 {
        return Some(number.value);
    }
    table.context.wrong(number.span, format!("`{key}` must not be negative, found {}", number.value))
}

fn read_full(table: &Table) -> Option<SectionBody> {
    let stiffness = table.required("stiffness").and_then(|item| matrix(table, "stiffness", item));
    let mass = table.get("mass").map(|item| matrix(table, "mass", item));
    Some(SectionBody::Full {
        stiffness: stiffness?,
        mass: match mass {
            None => None,
            Some(matrix) => Some(matrix?),
        },
    })
}

/// A symmetric matrix of N by N; definiteness is checked where it is used.
pub(super) fn matrix<const N: usize>(table: &Table, key: &str, item: &Item) -> Option<[[f64; N]; N]> {
    let context = table.context;
    let DeValue::Array(rows) = item.get_ref() else {
        let message = format!("`{key}` is a list of {N} rows, found {}", kind_of(item.get_ref()));
        return context.wrong(item.span(), message);
    };
    if rows.len() != N {
        return context.wrong(item.span(), format!("`{key}` has {N} rows, found {}", rows.len()));
    }
    let rows: Vec<Option<[f64; N]>> = rows.iter().map(|row| context.vector(row).map(|v| v.value)).collect();
    let rows: Vec<[f64; N]> = rows.into_iter().collect::<Option<_>>()?;
    let out: [[f64; N]; N] = rows.try_into().ok()?;
    let largest = out.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    for i in 0..N {
        for j in 0..i {
            if (out[i][j] - out[j][i]).abs() > 1e-9 * largest {
                let message = format!(
                    "`{key}` must be symmetric; entry ({}, {}) is {}, its mirror {}",
                    i + 1,
                    j + 1,
                    out[i][j],
                    out[j][i]
                );
                return context.wrong(item.span(), message);
            }
        }
    }
    Some(out)
}

fn read_shaped(table: &Table) -> Option<SectionBody> {
    let context = table.context;
    let (material, shape) = (table.required("material"), table.required("shape"));
    let material = context.text(material?)?;
    let kind = choose(context, &context.text(shape?)?, "shape", &["circle", "tube", "rectangle"])?.value;
    let wanted: &[&str] = match kind {
        "circle" => &["radius"],
        "tube" => &["radius", "thickness"],
        _ => &["width", "height"],
    };
    for key in
        ["radius", "thickness", "width", "height"].into_iter().filter(|key| table.has(key) && !wanted.contains(key))
    {
        context.report(Diagnostic::error(format!("a {kind} has no `{key}`"), table.key_span(key)));
    }
    wanted.iter().for_each(|key| {
        table.required(key);
    });
    let size = |key: &str| table.positive(key).map(|v| v.value);
    let shape = match kind {
        "circle" => Shape::Circle { radius: size("radius")? },
        "tube" => {
            let (radius, thickness) = (size("radius")?, size("thickness")?);
            if thickness > radius {
                return context.wrong(table.key_span("thickness"), "the wall is thicker than the radius");
            }
            Shape::Tube { radius, thickness }
        }
        _ => Shape::Rectangle { width: size("width")?, height: size("height")? },
    };
    let shear_factor = if table.has("shear_factor") { Some(pair(table, "shear_factor")?) } else { None };
    Some(SectionBody::Shaped { shape, material, shear_factor })
}

const BEAM_KEYS: [&str; 13] = [
    "name",
    "section",
    "stations",
    "through",
    "arc",
    "elements",
    "order",
    "numbering",
    "axis3",
    "twist",
    "interpolation",
    "free_strain",
    "history",
];

pub(super) fn read_beam<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Beam> {
    let table = Table::new(context, item, "[[beam]]", &BEAM_KEYS)?;
    let name = table.required("name").and_then(|item| context.text(item)).and_then(|name| check_name(context, name));
    let sections = table.required("section").and_then(|item| read_sections(context, item));
    let stations = read_stations(&table, sections.as_ref().map_or(0, Vec::len));
    let path = read_path(&table);
    let elements = table.required("elements").and_then(|item| read_counts(context, item, "elements"));
    let order = match table.get("order") {
        Some(item) => context.whole(item, 1, usize::MAX).and_then(|order| {
            if order.value <= 3 {
                return Some(order.value);
            }
            context.wrong(order.span, format!("`order` is 1, 2 or 3, found {}", order.value))
        }),
        None => Some(1),
    };
    let numbering = match table.get("numbering") {
        Some(item) => read_counts(context, item, "numbering").map(Some),
        None => Some(None),
    };
    let (axis3, twist) = (table.vector("axis3"), table.vector("twist").map(|t| t.value));
    let interpolation = read_interpolation(&table);
    let free_strain = read_free_strain(&table);
    Some(Beam {
        name: name?,
        sections: sections?,
        stations: stations?,
        path: path?,
        elements: elements?,
        order: order?,
        numbering: numbering?,
        axis3,
        twist,
        interpolation: interpolation?,
        free_strain: free_strain?,
        span: table.span.clone(),
    })
}

/// `Some(None)` where there is no key.
fn read_free_strain(table: &Table) -> Option<Option<FreeStrain>> {
    let Some(item) = table.get("free_strain") else {
        if table.has("history") {
            let message = "`history` of a beam belongs to its `free_strain`";
            table.context.report(Diagnostic::error(message, table.key_span("history")));
        }
        return Some(None);
    };
    let strain = table.context.vector::<6>(item)?;
    Some(Some(FreeStrain { strain: strain.value, history: read_history_use(table, None) }))
}

fn read_sections(context: &Context, item: &Item) -> Option<Vec<Spanned<String>>> {
    if !matches!(item.get_ref(), DeValue::Array(_)) {
        return Some(vec![context.text(item)?]);
    }
    let names = context.texts(item)?;
    if names.is_empty() {
        return context
            .wrong(item.span(), "`section` is one name, two for a taper from start to end, or more with `stations`");
    }
    Some(names)
}

/// Fractions of the length, one for each of the sections; none for a taper from start to end.
fn read_stations(table: &Table, sections: usize) -> Option<Option<Spanned<Vec<f64>>>> {
    let context = table.context;
    let Some(item) = table.get("stations") else {
        if sections > 2 {
            return context.wrong(
                table.key_span("section"),
                format!("{sections} sections need `stations`: the fraction of the length of each"),
            );
        }
        return Some(None);
    };
    let stations = context.numbers(item, None)?;
    let values = &stations.value;
    if values.len() != sections || sections < 2 {
        let message =
            format!("`stations` are as many as sections, two or more: there are {} and {sections}", values.len());
        return context.wrong(stations.span, message);
    }
    if values[0] != 0.0 || !values.is_sorted_by(|a, b| a < b) {
        return context
            .wrong(stations.span, "`stations` rise from 0, the start of the beam, to 1, or its length, at its end");
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
                let message = format!("`arc` is [start, any point between, end], found {count} point(s)");
                return context.wrong(item.span(), message);
            };
            Some(Path::Arc(points))
        }
        (Some(_), Some(item)) => context.wrong(item.span(), "a beam goes `through` points or along an `arc`, not both"),
        (None, None) => {
            context.wrong(table.span.clone(), "[[beam]] needs `through` (straight pieces) or `arc` (a circular arc)")
        }
    }
}

fn read_point_list(context: &Context, item: &Item) -> Option<Vec<Spanned<PointRef>>> {
    let DeValue::Array(array) = item.get_ref() else {
        return context.wrong(item.span(), format!("expected a list of points, found {}", kind_of(item.get_ref())));
    };
    let points: Vec<Option<Spanned<PointRef>>> = array.iter().map(|entry| read_point(context, entry)).collect();
    points.into_iter().collect()
}

/// A point by its name or its coordinates.
pub(super) fn read_point(context: &Context, item: &Item) -> Option<Spanned<PointRef>> {
    match item.get_ref() {
        DeValue::String(name) => Some(Spanned { value: PointRef::Name(name.to_string()), span: item.span() }),
        DeValue::Array(_) => Some(context.vector(item)?.map(PointRef::Coordinates)),
        other => context.wrong(item.span(), format!("a point is a name or [x, y, z], found {}", kind_of(other))),
    }
}

fn read_counts(context: &Context, item: &Item, key: &str) -> Option<Spanned<Vec<usize>>> {
    let counts: Vec<Option<usize>> = match item.get_ref() {
        DeValue::Array(array) => {
            array.iter().map(|entry| context.whole(entry, 1, MOST_ELEMENTS).map(|n| n.value)).collect()
        }
        _ => vec![context.whole(item, 1, MOST_ELEMENTS).map(|n| n.value)],
    };
    let value: Vec<usize> = counts.into_iter().collect::<Option<_>>()?;
    if value.is_empty() {
        return context.wrong(item.span(), format!("`{key}` must not be empty"));
    }
    Some(Spanned { value, span: item.span() })
}

fn read_interpolation(table: &Table) -> Option<InterpolationWord> {
    if !table.has("interpolation") {
        return Some(InterpolationWord::Relative);
    }
    let word = table.word("interpolation", &["total", "relative"])?;
    Some(if word.value == "total" { InterpolationWord::Total } else { InterpolationWord::Relative })
}
