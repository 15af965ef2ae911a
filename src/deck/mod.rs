//! The language of the deck: from text to tables whose values have their places in the text. It
//! knows no mechanics.
//!
//! All errors are collected, each with file, line and column. One file a table, with its struct,
//! its keys and its reader.

// The kinds of TOML values are not ours: a reader takes what it knows and refuses the rest.
#![allow(clippy::wildcard_enum_match_arm)]

mod accuracy;
mod axes;
mod beam;
mod body;
mod by_name;
mod contact;
mod cost;
mod damping;
mod diagnostic;
mod division;
mod effects;
mod expect;
mod expression;
mod files;
mod hints;
mod history;
mod home;
mod import;
mod initial;
mod joint;
mod layup;
mod load;
mod material;
mod mesh_file;
mod motion;
mod observable;
mod output;
mod overrides;
mod parameters;
mod point;
mod reader;
mod resolved;
mod schema;
mod scheme;
mod section;
mod section_shape;
mod shown;
mod slider;
mod spring;
mod stage;
mod support;
mod surface;
mod sweep;
mod units;
mod words;

pub use accuracy::{Accuracy, is_named, without_stage};
pub use axes::Axes;
pub use beam::{Beam, FreeStrain, Helix, InterpolationWord, Path, SplinePath, StationsWord};
pub use body::Body;
pub use by_name::{ByName, Named};
pub use contact::{Contact, ContactDamping, ContactRadius, EndsWord};
pub use cost::{Cost, NormWord};
pub use damping::Damping;
pub use diagnostic::{Diagnostic, Severity, Span, Spanned, one_of};
pub use division::{Division, MOST_ELEMENTS};
pub use effects::{EffectWord, Effects};
pub use expect::{Expect, ExpectBody, Instant, Reduce, Reduction, Target};
use expression::help_behind_number;
pub use expression::{Expression, Jet};
pub use files::{ImportedTable, Unreadable, fingerprint};
pub use hints::{Hint, hint, nearest};
pub use history::{HistoryBody, HistoryTable, HistoryUse};
pub use import::{Imported, import, import_up_to};
pub use initial::{Initial, InitialTarget};
pub use joint::{Joint, JointMotor, JointParts};
pub use layup::{Layup, Ply};
pub use load::{Frame, Load, LoadTarget, LoadVector};
pub use material::{Elastic, Isotropic, Material, Strength};
pub use mesh_file::MeshTable;
pub use motion::{Motion, MotionWhat};
pub use observable::{Looked, looking_at};
pub use output::Output;
pub use overrides::apply;
pub use parameters::Parameters;
pub use point::PointRef;
pub use schema::{Entry, SCHEMA, entries, explain, similar};
pub use scheme::{SchemeName, SchemeWord};
pub use section::{CornerWord, Section, SectionBody, SectionProbe};
pub use section_shape::{
    Airfoil, ComputedSection, ComputedShape, Fibre, Flanged, LeadingEdgeWord, MeshAim, Outline, Reference,
    ReferenceWord, Region, Shape, ShapeWord, ShearFactor, SkinPart, SkinSideWord, ThetaSenseWord, TrailingEdgeWord,
    Wall, WallPlies, WallSideWord, Walls, Web,
};
pub use shown::{hides_text, shown, shown_in_line};
pub use slider::{Slider, SliderDrive, Sliding};
pub use spring::{Spring, SpringBody};
pub use stage::{MOST_STEPS, RotatingFrame, STEP_TOLERANCE, Stage, StageBody, Until};
pub use support::Support;
pub use surface::{SideWord, Surface, SurfaceBody, SurfaceMotion, SurfacePoint, SurfaceWord, TubeLine};
pub use sweep::{SweepFile, VaryBody, VaryTable};
pub use words::Words;
pub(crate) use words::words;

use reader::{Context, Table};
use std::cell::RefCell;
use std::collections::HashSet;
use toml::de::{DeTable, DeValue};

/// A deck as it stands in the text.
#[derive(Clone, Debug, Default)]
pub struct Deck {
    /// Title
    pub(crate) title: Option<String>,
    /// Acceleration of gravity
    pub gravity: Option<Spanned<[f64; 3]>>,
    /// Named places
    pub points: ByName<(Spanned<String>, [f64; 3])>,
    /// Materials
    pub(crate) materials: Vec<Material>,
    /// Plies of walls
    pub(crate) layups: Vec<Layup>,
    /// Sections
    pub sections: ByName<Section>,
    /// Beams
    pub beams: ByName<Beam>,
    /// Supports
    pub supports: Vec<Support>,
    /// Prescribed motions
    pub motions: Vec<Motion>,
    /// Joints
    pub joints: Vec<Joint>,
    /// Sliding joints along beams
    pub(crate) sliders: Vec<Slider>,
    /// Rigid bodies
    pub bodies: Vec<Body>,
    /// Springs and cables
    pub springs: Vec<Spring>,
    /// Triangles of mesh files
    pub(crate) meshes: Vec<MeshTable>,
    /// Rigid surfaces
    pub(crate) surfaces: Vec<Surface>,
    /// Contacts of beams and bodies with surfaces
    pub(crate) contacts: Vec<Contact>,
    /// Loads
    pub loads: Vec<Load>,
    /// Rayleigh factors of mass and stiffness
    pub(crate) damping: Option<Damping>,
    /// Initial velocities
    pub initials: Vec<Initial>,
    /// Histories
    pub(crate) histories: Vec<HistoryTable>,
    /// Stages
    pub stages: Vec<Stage>,
    /// Effects forced on or off
    pub(crate) effects: Effects,
    /// Written nodes, columns and rows
    pub(crate) output: Output,
    /// Variants of a study of accuracy and time
    pub(crate) cost: Cost,
    /// Largest estimated errors of outputs
    pub(crate) accuracy: Option<Accuracy>,
    /// Expectations
    pub expects: Vec<Expect>,
    /// The values of `[param]`
    pub(crate) parameters: Parameters,
    /// Number of stages in the text
    pub(crate) stage_count: usize,
    /// Names of tables that could not be read: they are not unknown
    pub(crate) broken: Vec<String>,
    /// The deck with expressions replaced by numbers, for run.json
    pub(crate) resolved: serde_json::Value,
}

/// Keys of a deck.
const KEYS: [&str; 28] = [
    "title", "units", "gravity", "param", "point", "material", "layup", "section", "beam", "support", "motion",
    "joint", "slider", "body", "spring", "mesh", "surface", "contact", "load", "initial", "history", "stage",
    "effects", "output", "cost", "accuracy", "damping", "expect",
];

/// Reads a deck. Errors and warnings are returned beside it, so that the scene can add its own;
/// `Err` where the text is not TOML.
pub fn read(text: &str) -> Result<(Deck, Vec<Diagnostic>), Vec<Diagnostic>> {
    let (document, syntax) = DeTable::parse_recoverable(text);
    if !syntax.is_empty() {
        return Err(describe_syntax(text, &syntax));
    }
    let mut diagnostics = Vec::new();
    let parameters = match document.get_ref().get("param").map(|item| (item, item.get_ref())) {
        Some((_, DeValue::Table(table))) => Parameters::read(table, &mut diagnostics),
        Some((item, _)) => {
            diagnostics.push(Diagnostic::error("`param` must be a table: [param]", item.span()));
            Parameters::default()
        }
        None => Parameters::default(),
    };
    let stage_count = match document.get_ref().get("stage").map(|item| item.get_ref()) {
        Some(DeValue::Array(stages)) => stages.len(),
        _ => 0,
    };
    let context =
        Context { parameters, stage_count, diagnostics: RefCell::new(diagnostics), resolved: RefCell::default() };
    let deck = read_tables(&context, document.get_ref());
    let resolved = resolved::to_json(document.get_ref(), &context.resolved.borrow(), &context.parameters);
    let deck = Deck { parameters: context.parameters.clone(), resolved, stage_count, ..deck };
    Ok((deck, context.diagnostics.take()))
}

/// The first syntax error, and keys that stand twice; the parser's other errors are mostly
/// consequences of the first.
fn describe_syntax(text: &str, errors: &[toml::de::Error]) -> Vec<Diagnostic> {
    let describe = |error: &toml::de::Error| {
        // The parser does not say which key it is.
        if error.span().is_none() && error.message() == "recursion limit" {
            return Diagnostic::error("this key has too many parts: at most 80 are supported", longest_key(text));
        }
        let mut diagnostic = Diagnostic::whole(error.message().trim().replace('\n', "; "));
        diagnostic.span = error.span();
        diagnostic
    };
    let twice = |error: &toml::de::Error| error.message().contains("duplicate key");
    let shown = errors.iter().enumerate().filter(|(k, error)| *k == 0 || twice(error));
    let mut shown: Vec<Diagnostic> = shown.map(|(_, error)| describe(error)).collect();
    let hidden = errors.len() - shown.len();
    if let Some(first) = shown.first_mut() {
        let more = (hidden > 0).then(|| format!("{hidden} more syntax error(s) may be consequences of this one"));
        let value = first.span.as_ref().and_then(|span| unquoted(text, span.start));
        let quotes = value.map(|value| format!("text and expressions stand in quotes: \"{value}\""));
        let advice = || first.span.as_ref().and_then(|span| help_of_number(text, span.start));
        let advice = quotes.or_else(|| advice().map(String::from));
        let help: Vec<String> = advice.into_iter().chain(more).collect();
        first.help = (!help.is_empty()).then(|| help.join("; "));
    }
    shown
}

/// The value about this place, if it is a word or an expression without quotes.
fn unquoted(text: &str, place: usize) -> Option<&str> {
    let before = text.get(..place)?;
    let line = before.rfind('\n').map_or(0, |end| end + 1);
    let start = before[line..].find('=').map(|_| before.rfind(['=', '[']))??;
    let value = |start: usize, ends: &[char]| Some(text[start + 1..].split(ends).next()?.trim());
    let whole = value(start, &['\n', '\r', ']', '#'])?;
    let item = value(before.rfind(['=', '[', ','])?, &['\n', '\r', ']', '#', ','])?;
    let value = if whole.contains(',') && !item.contains(['(', ')']) { item } else { whole };
    let begins = value.trim_start_matches('-').starts_with(|c: char| c.is_ascii_alphabetic()) || value.contains('*');
    let is_expression = |c: char| c.is_ascii_alphanumeric() || " _+-*/().,^".contains(c);
    let is_whole = value.matches('(').count() == value.matches(')').count();
    let is_list = value.contains(',') && !value.contains('(');
    let is_word = begins && is_whole && !is_list && value.chars().all(is_expression);
    (is_word && !value.eq_ignore_ascii_case("true") && !value.eq_ignore_ascii_case("false")).then_some(value)
}

/// What helps if the value about this place begins as a number.
fn help_of_number(text: &str, place: usize) -> Option<&'static str> {
    let before = text.get(..place)?;
    let line = before.rfind('\n').map_or(0, |end| end + 1);
    let start = line + before[line..].rfind(['=', '[', ','])? + 1;
    let value = text[start..].trim_start_matches([' ', '\t', '-', '+']);
    let behind = value.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.' || c == '_');
    let number = &value[..value.len() - behind.len()];
    if number.starts_with('.') || number.ends_with('.') {
        return Some("digits stand on both sides of the point: 0.4, 5.0");
    }
    let found = behind.trim_start_matches([' ', '\t']).chars().next()?;
    // A comma before another value separates, and a word before `=` is a key.
    let separates = found == ',' && !behind[1..].starts_with(|c: char| c.is_ascii_digit());
    let is_key = behind.split(['\n', ',', '}', '#']).next().is_some_and(|rest| rest.contains('='));
    if number.is_empty() || separates || is_key { None } else { help_behind_number(found) }
}

/// The place of the key with the most dots.
fn longest_key(text: &str) -> Span {
    const ENDS: [char; 7] = ['\n', ',', '=', '[', ']', '{', '}'];
    let mut start = 0;
    let place = |piece: &str| {
        let own = start..start + piece.trim_end_matches(ENDS).trim_end().len();
        start += piece.len();
        own
    };
    let pieces = text.split_inclusive(ENDS).map(place);
    pieces.max_by_key(|piece| text[piece.clone()].matches('.').count()).unwrap_or(0..0)
}

fn read_tables(context: &Context, document: &DeTable) -> Deck {
    let top = Table::top(context, document, "the deck", &KEYS);
    let points = ByName::from(point::read_points(&top));
    let materials = named(&top, "material", material::read_material);
    let layups = named(&top, "layup", layup::read_layup);
    let layup_names = names_below(&top, "layup");
    let read_section = |context: &_, name, item: &_| section::read_section(context, name, item, &layup_names);
    let sections = ByName::from(named(&top, "section", read_section));
    let beams = ByName::from(listed(&top, "beam", beam::read_beam));
    let joints = listed(&top, "joint", joint::read_joint);
    let bodies = listed(&top, "body", body::read_body);
    let surfaces = listed(&top, "surface", surface::read_surface);
    let contacts = listed(&top, "contact", contact::read_contact);
    let histories = named(&top, "history", history::read_history);
    let read: Vec<&str> = [
        points.names().collect::<Vec<_>>(),
        materials.iter().map(|m| m.name.value.as_str()).collect(),
        layups.iter().map(|l| l.name.value.as_str()).collect(),
        sections.names().collect(),
        beams.names().collect(),
        surfaces.iter().map(|s| s.name.value.as_str()).collect(),
        contacts.iter().map(|c| c.name.value.as_str()).collect(),
        histories.iter().map(|h| h.name.value.as_str()).collect(),
    ]
    .concat();
    let read: HashSet<&str> = read.into_iter().collect();
    let broken = defined_names(document).into_iter().filter(|name| !read.contains(name.as_str())).collect();
    units::check_units(&top);
    let deck = Deck {
        broken,
        stage_count: 0,
        title: top.text("title").map(|t| t.value),
        gravity: read_gravity(&top),
        points,
        materials,
        layups,
        sections,
        beams,
        supports: listed(&top, "support", support::read_support),
        motions: listed(&top, "motion", motion::read_motion),
        joints,
        sliders: listed(&top, "slider", slider::read_slider),
        bodies,
        springs: listed(&top, "spring", spring::read_spring),
        meshes: named(&top, "mesh", mesh_file::read_mesh),
        surfaces,
        contacts,
        loads: listed(&top, "load", load::read_load),
        damping: damping::read_damping(&top),
        initials: listed(&top, "initial", initial::read_initial),
        histories,
        stages: listed(&top, "stage", stage::read_stage),
        effects: Effects::read(&top),
        output: output::read_output(&top),
        cost: cost::Cost::read(&top),
        accuracy: Accuracy::read(&top),
        expects: listed(&top, "expect", expect::read_expect),
        parameters: Parameters::default(),
        resolved: serde_json::Value::Null,
    };
    cost::warn_of_idle_keys(&top, &deck);
    deck
}

/// The names of `[key.NAME]` tables.
fn names_below(top: &Table, key: &str) -> Vec<String> {
    let tables = top.get(key).and_then(|item| item.get_ref().as_table());
    tables.map_or(Vec::new(), |tables| tables.keys().map(|name| name.get_ref().to_string()).collect())
}

/// Every name that the text defines, also those of tables that cannot be read.
fn defined_names(document: &DeTable) -> Vec<String> {
    let table = |key: &str| document.get(key).and_then(|item| item.get_ref().as_table());
    let named = ["point", "material", "layup", "section", "history"].into_iter().filter_map(table);
    let mut names: Vec<String> = named.flat_map(|t| t.keys().map(|k| k.get_ref().to_string())).collect();
    let name = |entry: &reader::Item| Some(entry.get_ref().as_table()?.get("name")?.get_ref().as_str()?.to_string());
    for key in ["beam", "surface", "contact"] {
        if let Some(DeValue::Array(entries)) = document.get(key).map(|item| item.get_ref()) {
            names.extend(entries.iter().filter_map(name));
        }
    }
    names
}

/// `gravity`, which is a key, although other programs have a table.
fn read_gravity(top: &Table) -> Option<Spanned<[f64; 3]>> {
    let is_table = match top.get("gravity")?.get_ref() {
        DeValue::Table(_) => true,
        DeValue::Array(entries) => entries.iter().any(|entry| matches!(entry.get_ref(), DeValue::Table(_))),
        _ => false,
    };
    if is_table {
        let diagnostic = Diagnostic::error("`gravity` is a key, not a table", top.key_span("gravity"));
        top.context.report(diagnostic.help("write gravity = [0, 0, -9.81] above the first table"));
        return None;
    }
    top.vector("gravity")
}

/// Reads `[[key]]` tables.
fn listed<'a, T>(top: &Table<'a>, key: &str, read: impl Fn(&'a Context, &'a reader::Item<'a>) -> Option<T>) -> Vec<T> {
    top.list(key).into_iter().filter_map(|item| read(top.context, item)).collect()
}

/// Reads `[key.NAME]` tables.
fn named<'a, T>(
    top: &Table<'a>,
    key: &str,
    read: impl Fn(&'a Context, Spanned<String>, &'a reader::Item<'a>) -> Option<T>,
) -> Vec<T> {
    let Some(item) = top.get(key) else { return Vec::new() };
    let DeValue::Table(entries) = item.get_ref() else {
        top.context.report(Diagnostic::error(format!("`{key}` must contain named tables: [{key}.NAME]"), item.span()));
        return Vec::new();
    };
    let mut all: Vec<_> = entries.iter().collect();
    all.sort_by_key(|(name, _)| name.span().start);
    let read_one = |(name, item): (&'a toml::Spanned<_>, &'a reader::Item<'a>)| {
        let name: &toml::Spanned<toml::de::DeString> = name;
        read(top.context, Spanned { value: name.get_ref().to_string(), span: name.span() }, item)
    };
    all.into_iter().filter_map(read_one).collect()
}
