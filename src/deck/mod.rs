//! The language of the deck: text in, words with their places out. It knows no mechanics.
//!
//! Everything that is wrong is gathered, each with file, line and column; one struct stands for one table.

mod accuracy;
mod action;
mod cost;
mod diagnostic;
mod effects;
mod expression;
mod geometry;
mod import;
mod looked_at;
mod overrides;
mod parameters;
mod procedure;
mod reader;
mod resolved;
mod schema;
mod sweep;

pub use accuracy::{Accuracy, is_named, without_stage};
pub use action::{
    Axes, Body, Frame, HistoryBody, HistoryTable, HistoryUse, Initial, InitialTarget, Joint, JointKind, JointParts,
    Load, LoadTarget, LoadVector, Motion, MotionWhat, Spring, SpringBody, Support,
};
pub use cost::{Cost, NormWord};
pub use diagnostic::{Diagnostic, Severity, Span, Spanned, nearest, one_of};
pub use effects::{EffectWord, Effects};
pub use expression::{Expression, Jet};
pub use geometry::{
    Beam, FreeStrain, InterpolationWord, MOST_ELEMENTS, Material, Path, PointRef, Section, SectionBody, Shape,
};
pub use import::import;
pub use looked_at::{Looked, looking_at};
pub use overrides::apply;
pub use parameters::Parameters;
pub use procedure::{
    Expect, ExpectBody, FAILURES, Instant, MOST_STEPS, Output, Reduce, RotatingFrame, SchemeWord, Stage, StageBody,
    Until,
};

pub use schema::{Entry, SCHEMA, entries, explain};
pub use sweep::{SweepFile, VaryBody, VaryTable};

use reader::{Context, Table};
use std::cell::RefCell;
use toml::de::{DeTable, DeValue};

/// A deck as it stands in the text.
#[derive(Clone, Debug, Default)]
pub struct Deck {
    /// What it is about
    pub title: Option<String>,
    /// Labels of the units: length, force, time
    pub units: Option<[String; 3]>,
    /// Acceleration of gravity
    pub gravity: Option<Spanned<[f64; 3]>>,
    /// Named places
    pub points: Vec<(Spanned<String>, [f64; 3])>,
    /// Materials
    pub materials: Vec<Material>,
    /// Sections
    pub sections: Vec<Section>,
    /// Beams
    pub beams: Vec<Beam>,
    /// Supports
    pub supports: Vec<Support>,
    /// Prescribed motions
    pub motions: Vec<Motion>,
    /// Joints
    pub joints: Vec<Joint>,
    /// Rigid bodies
    pub bodies: Vec<Body>,
    /// Springs to ground
    pub springs: Vec<Spring>,
    /// Loads
    pub loads: Vec<Load>,
    /// Rayleigh factors of mass and stiffness
    pub damping: Option<[f64; 2]>,
    /// Initial velocities
    pub initials: Vec<Initial>,
    /// Histories
    pub histories: Vec<HistoryTable>,
    /// Stages
    pub stages: Vec<Stage>,
    /// Effects forced on or off
    pub effects: Effects,
    /// What is written
    pub output: Output,
    /// What a study of accuracy and time varies
    pub cost: Cost,
    /// How large the errors of outputs may be
    pub accuracy: Option<Accuracy>,
    /// Expectations
    pub expects: Vec<Expect>,
    /// The values of `[param]`
    pub parameters: Parameters,
    /// How many stages stand in the text
    pub stage_count: usize,
    /// Names of tables that could not be read: they are not unknown
    pub broken: Vec<String>,
    /// The deck with expressions replaced by numbers, for run.json
    pub resolved: serde_json::Value,
}

const KEYS: [&str; 21] = [
    "title", "units", "gravity", "param", "point", "material", "section", "beam", "support", "motion", "joint", "body",
    "spring", "load", "initial", "history", "stage", "effects", "output", "cost", "accuracy",
];

/// Reads a deck. What is wrong with it comes beside it, so that the scene can tell what else is; `Err` where the text is no
/// TOML.
pub fn read(text: &str) -> Result<(Deck, Vec<Diagnostic>), Vec<Diagnostic>> {
    let (document, syntax) = DeTable::parse_recoverable(text);
    if !syntax.is_empty() {
        return Err(describe_syntax(&syntax));
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

/// The first syntax error, and keys that stand twice; the parser's other errors are mostly consequences of the first.
fn describe_syntax(errors: &[toml::de::Error]) -> Vec<Diagnostic> {
    let describe = |error: &toml::de::Error| {
        let mut diagnostic = Diagnostic::whole(error.message().trim().replace('\n', "; "));
        diagnostic.span = error.span();
        diagnostic
    };
    let twice = |error: &toml::de::Error| error.message().contains("duplicate key");
    errors.iter().enumerate().filter(|(k, error)| *k == 0 || twice(error)).map(|(_, error)| describe(error)).collect()
}

fn read_tables(context: &Context, document: &DeTable) -> Deck {
    let keys: Vec<&str> = KEYS.into_iter().chain(["damping", "expect"]).collect();
    let top = Table::top(context, document, "the deck", &keys);
    let points = geometry::read_points(&top);
    let materials = named(&top, "material", geometry::read_material);
    let sections = named(&top, "section", geometry::read_section);
    let beams = listed(&top, "beam", geometry::read_beam);
    let joints = listed(&top, "joint", action::read_joint);
    let bodies = listed(&top, "body", action::read_body);
    let histories = named(&top, "history", action::read_history);
    let read: Vec<&str> = [
        points.iter().map(|(name, _)| name.value.as_str()).collect::<Vec<_>>(),
        materials.iter().map(|m| m.name.value.as_str()).collect(),
        sections.iter().map(|s| s.name.value.as_str()).collect(),
        beams.iter().map(|b| b.name.value.as_str()).collect(),
        histories.iter().map(|h| h.name.value.as_str()).collect(),
    ]
    .concat();
    let broken = defined_names(document).into_iter().filter(|name| !read.contains(&name.as_str())).collect();
    let deck = Deck {
        broken,
        stage_count: 0,
        title: top.text("title").map(|t| t.value),
        units: procedure::read_units(&top),
        gravity: top.vector("gravity"),
        points,
        materials,
        sections,
        beams,
        supports: listed(&top, "support", action::read_support),
        motions: listed(&top, "motion", action::read_motion),
        joints,
        bodies,
        springs: listed(&top, "spring", action::read_spring),
        loads: listed(&top, "load", action::read_load),
        damping: action::read_damping(&top),
        initials: listed(&top, "initial", action::read_initial),
        histories,
        stages: listed(&top, "stage", procedure::read_stage),
        effects: Effects::read(&top),
        output: procedure::read_output(&top),
        cost: cost::Cost::read(&top),
        accuracy: Accuracy::read(&top),
        expects: listed(&top, "expect", procedure::read_expect),
        parameters: Parameters::default(),
        resolved: serde_json::Value::Null,
    };
    cost::warn_of_idle_keys(&top, &deck);
    deck
}

/// Every name that the text defines, whether its table can be read or not.
fn defined_names(document: &DeTable) -> Vec<String> {
    let table = |key: &str| document.get(key).and_then(|item| item.get_ref().as_table());
    let named = ["point", "material", "section", "history"].into_iter().filter_map(table);
    let mut names: Vec<String> = named.flat_map(|t| t.keys().map(|k| k.get_ref().to_string())).collect();
    if let Some(DeValue::Array(beams)) = document.get("beam").map(|item| item.get_ref()) {
        let name = |beam: &reader::Item| Some(beam.get_ref().as_table()?.get("name")?.get_ref().as_str()?.to_string());
        names.extend(beams.iter().filter_map(name));
    }
    names
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
        top.context.report(Diagnostic::error(format!("`{key}` holds named tables: [{key}.NAME]"), item.span()));
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
