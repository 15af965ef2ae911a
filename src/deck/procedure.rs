//! What is done with a scene: stages, output, expectations.

use super::cost::SCHEMES;
use super::diagnostic::{Diagnostic, Span, Spanned, nearest};
use super::geometry::{PointRef, read_point};
use super::reader::{Context, Item, Table, kind_of};
use beamsim_core::failure::FailureKind;
use beamsim_core::warning::WarningKind;
use toml::de::DeValue;

/// `[[stage]]`
#[derive(Clone, Debug)]
pub struct Stage {
    /// What it does
    pub body: StageBody,
    /// Newton's tolerance
    pub tolerance: f64,
    /// Newton's limit
    pub max_iterations: usize,
    /// Ends it early
    pub until: Option<Until>,
    /// A rotating frame from which it is seen
    pub frame: Option<RotatingFrame>,
    /// Where the table stands
    pub span: Span,
}

/// `frame = { spin = …, about = … }`
#[derive(Clone, Debug)]
pub struct RotatingFrame {
    /// Angular velocity
    pub spin: [f64; 3],
    /// A point on the axis; left out: the origin
    pub about: Option<Spanned<PointRef>>,
}

/// Kinds of stages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StageBody {
    /// Load control
    Static {
        /// Load levels
        steps: usize,
        /// Smaller steps where one fails
        adaptive: bool,
    },
    /// Arc-length control
    Path {
        /// The first increment is that of one of so many levels
        steps: usize,
        /// Most increments
        max_steps: usize,
    },
    /// Small motions
    Modal {
        /// How many
        modes: usize,
    },
    /// Critical loads
    Buckling {
        /// How many
        modes: usize,
    },
    /// Time steps
    Dynamic {
        /// On the run's clock
        end: f64,
        /// Step, or the first one
        step: f64,
        /// The method
        scheme: SchemeWord,
        /// Tolerance of the local error, where steps adapt to it
        step_tolerance: Option<f64>,
        /// The part of the largest energies so far by which the total may grow
        energy_limit: f64,
    },
}

impl StageBody {
    /// Loads come in and balance is found, by load levels or by arc length.
    pub fn finds_balance(&self) -> bool {
        match self {
            Self::Static { .. } | Self::Path { .. } => true,
            Self::Modal { .. } | Self::Buckling { .. } | Self::Dynamic { .. } => false,
        }
    }

    /// The clock runs.
    pub fn advances_time(&self) -> bool {
        match self {
            Self::Dynamic { .. } => true,
            Self::Static { .. } | Self::Path { .. } | Self::Modal { .. } | Self::Buckling { .. } => false,
        }
    }

    /// Mass and its inertia count.
    pub fn needs_inertia(&self) -> bool {
        match self {
            Self::Dynamic { .. } | Self::Modal { .. } => true,
            Self::Static { .. } | Self::Path { .. } | Self::Buckling { .. } => false,
        }
    }

    /// Load levels or increments along a path, at most.
    pub fn increments(&self) -> Option<usize> {
        match *self {
            Self::Static { steps, .. } => Some(steps),
            Self::Path { max_steps, .. } => Some(max_steps),
            Self::Modal { .. } | Self::Buckling { .. } | Self::Dynamic { .. } => None,
        }
    }

    /// Rows are written as it goes on.
    pub fn writes_rows(&self) -> bool {
        match self {
            Self::Static { .. } | Self::Path { .. } | Self::Dynamic { .. } => true,
            Self::Modal { .. } | Self::Buckling { .. } => false,
        }
    }
}

/// `scheme = …` with its coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SchemeWord {
    /// beta, gamma
    Newmark(f64, f64),
    /// alpha
    Hht(f64),
    /// rho_inf
    GeneralizedAlpha(f64),
    /// rho_inf
    LieGeneralizedAlpha(f64),
}

/// `until = { column = …, below = …, above = … }`
#[derive(Clone, Debug)]
pub struct Until {
    /// The watched column
    pub column: Spanned<String>,
    /// Ends below this
    pub below: Option<f64>,
    /// Ends above this
    pub above: Option<f64>,
}

/// `[output]`
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// The nodes that are written; default: every named point that is a node
    pub nodes: Option<Vec<Spanned<String>>>,
    /// The groups of columns; default: u and r
    pub columns: Option<Vec<Spanned<String>>>,
    /// Each n-th row
    pub every: usize,
    /// Rows at multiples of this time
    pub interval: Option<f64>,
    /// Whether the whole shape is written for ParaView
    pub vtk: bool,
}

/// `[[expect]]`
#[derive(Clone, Debug)]
pub struct Expect {
    /// What is expected
    pub body: ExpectBody,
    /// Where the number comes from
    pub source: Option<String>,
    /// Where the table stands
    pub span: Span,
}

/// What is expected.
#[derive(Clone, Debug)]
pub enum ExpectBody {
    /// A number
    Column {
        /// Of this column
        column: Spanned<String>,
        /// Over rows or at one
        reduce: Reduce,
        /// value, atol, rtol
        value: Option<(f64, f64, f64)>,
        /// Upper bound
        below: Option<f64>,
        /// Lower bound
        above: Option<f64>,
    },
    /// A failure of this name
    Fails(Spanned<String>),
    /// A warning of this kind
    Warns(WarningKind),
    /// No warning that puts an answer in doubt
    Quiet,
}

/// Which rows an expectation looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reduce {
    /// One instant
    At(Instant),
    /// Largest
    Max,
    /// Smallest
    Min,
    /// Largest magnitude
    AbsMax,
    /// Mean over rows
    Mean,
    /// Largest departure from the first row
    Drift,
}

const REDUCTIONS: [Reduce; 5] = [Reduce::Max, Reduce::Min, Reduce::AbsMax, Reduce::Mean, Reduce::Drift];

impl Reduce {
    /// What the deck calls it; an instant has no word.
    pub fn word(&self) -> &'static str {
        match self {
            Self::At(_) => "",
            Self::Max => "max",
            Self::Min => "min",
            Self::AbsMax => "absmax",
            Self::Mean => "mean",
            Self::Drift => "drift",
        }
    }

    /// The reduction over all rows with this word.
    pub fn of(word: &str) -> Option<Self> {
        REDUCTIONS.into_iter().find(|reduce| reduce.word() == word)
    }
}

/// One instant of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instant {
    /// The last row
    End,
    /// A time
    Time(f64),
    /// The first crossing of a load factor
    Load(f64),
}

/// Most load levels or time steps of a stage.
pub const MOST_STEPS: usize = 1_000_000_000;

pub(super) fn read_units(top: &Table) -> Option<[String; 3]> {
    let table = Table::new(top.context, top.get("units")?, "`units`", &["length", "force", "time"])?;
    let label = |key: &str| table.text(key).map_or(String::new(), |t| t.value);
    Some(["length", "force", "time"].map(label))
}

const COMMON: [&str; 5] = ["kind", "tolerance", "max_iterations", "until", "frame"];
/// Most modes of a stage.
const MOST_MODES: usize = 1000;
const STATIC: [&str; 4] = ["steps", "adaptive", "control", "max_steps"];
const DYNAMIC: [&str; 10] =
    ["end", "step", "scheme", "beta", "gamma", "alpha", "rho_inf", "adaptive", "step_tolerance", "energy_limit"];
/// The part of the largest energies so far by which the total may grow.
const ENERGY_LIMIT: f64 = 0.2;

pub(super) fn read_stage<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Stage> {
    // `adaptive` belongs to both kinds.
    let dynamic: Vec<&str> = DYNAMIC.into_iter().filter(|key| !STATIC.contains(key)).collect();
    let known = [&COMMON[..], &STATIC, &dynamic, &["modes"]].concat();
    let table = Table::new(context, item, "[[stage]]", &known)?;
    table.required("kind")?;
    let kind = table.word("kind", &["static", "dynamic", "modal", "buckling"])?;
    let body = match kind.value {
        "static" => {
            refuse_others(&table, "static", &STATIC);
            read_static(&table)
        }
        "dynamic" => {
            refuse_others(&table, "dynamic", &DYNAMIC);
            read_dynamic(&table)
        }
        other => {
            refuse_others(&table, other, &["modes"]);
            let modes = table.required("modes").and_then(|item| context.whole(item, 1, MOST_MODES));
            let modal = other == "modal";
            modes.map(
                |n| if modal { StageBody::Modal { modes: n.value } } else { StageBody::Buckling { modes: n.value } },
            )
        }
    };
    if table.has("until") && ["modal", "buckling"].contains(&kind.value) {
        let message = format!("`until` does not belong to a {} stage", kind.value);
        context.report(Diagnostic::error(message, table.key_span("until")));
    }
    if table.has("frame") && kind.value == "dynamic" {
        let message = "`frame` belongs to static, modal and buckling stages";
        context.report(Diagnostic::error(message, table.key_span("frame")));
    }
    let frame = match table.get("frame") {
        Some(item) => read_frame(context, item).map(Some),
        None => Some(None),
    };
    let tolerance = read_tolerance(&table);
    let max_iterations = match table.get("max_iterations") {
        Some(item) => context.whole(item, 1, 10_000).map(|n| n.value),
        None => Some(25),
    };
    let until = match table.get("until") {
        Some(item) => read_until(context, item).map(Some),
        None => Some(None),
    };
    Some(Stage {
        body: body?,
        tolerance: tolerance?,
        max_iterations: max_iterations?,
        until: until?,
        frame: frame?,
        span: table.span.clone(),
    })
}

fn refuse_others(table: &Table, kind: &str, own: &[&str]) {
    let all = [&STATIC[..], &DYNAMIC, &["modes"]].concat();
    for key in all.iter().filter(|key| table.has(key) && !own.contains(key)) {
        let message = format!("`{key}` does not belong to a {kind} stage");
        table.context.report(Diagnostic::error(message, table.key_span(key)));
    }
}

fn read_static(table: &Table) -> Option<StageBody> {
    let context = table.context;
    let word = if table.has("control") { table.word("control", &["load", "arc_length"])?.value } else { "load" };
    if word == "arc_length" {
        if table.has("frame") {
            let message =
                "`frame` does not go with control = \"arc_length\": its forces grow with the square of the load factor";
            context.report(Diagnostic::error(message, table.key_span("frame")));
        }
        return read_path_control(table);
    }
    if table.has("max_steps") {
        context
            .report(Diagnostic::error("`max_steps` belongs to control = \"arc_length\"", table.key_span("max_steps")));
    }
    let steps = table.required("steps").and_then(|item| context.whole(item, 1, MOST_STEPS));
    let adaptive = if table.has("adaptive") { table.flag("adaptive") } else { Some(true) };
    Some(StageBody::Static { steps: steps?.value, adaptive: adaptive? })
}

fn read_path_control(table: &Table) -> Option<StageBody> {
    let context = table.context;
    if table.has("adaptive") {
        let message = "`adaptive` does not belong to control = \"arc_length\", which always adapts";
        context.report(Diagnostic::error(message, table.key_span("adaptive")));
    }
    let steps = table.required("steps").and_then(|item| context.whole(item, 1, MOST_STEPS))?.value;
    let max_steps = match table.get("max_steps") {
        Some(item) => context.whole(item, 1, MOST_STEPS)?.value,
        None => steps.saturating_mul(10),
    };
    Some(StageBody::Path { steps, max_steps })
}

fn read_frame<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<RotatingFrame> {
    let table = Table::new(context, item, "`frame`", &["spin", "about"])?;
    table.required("spin")?;
    let spin = table.vector::<3>("spin")?.value;
    let about = match table.get("about") {
        None => None,
        Some(item) => Some(read_point(context, item)?),
    };
    Some(RotatingFrame { spin, about })
}

fn read_dynamic(table: &Table) -> Option<StageBody> {
    let context = table.context;
    let scheme = read_scheme(table);
    let step_tolerance = read_step_tolerance(table);
    table.required("end");
    table.required("step");
    let (end, step) = (table.positive("end"), table.positive("step"));
    let (end, step) = (end?, step?);
    if end.value / step.value > MOST_STEPS as f64 {
        let message = format!("{:.3e} steps are more than the largest supported {MOST_STEPS}", end.value / step.value);
        context.report(Diagnostic::limit(message, step.span));
        return None;
    }
    let energy_limit = if table.has("energy_limit") { table.positive("energy_limit")?.value } else { ENERGY_LIMIT };
    Some(StageBody::Dynamic {
        end: end.value,
        step: step.value,
        scheme: scheme?,
        step_tolerance: step_tolerance?,
        energy_limit,
    })
}

/// The coefficients that each scheme has.
pub(super) const COEFFICIENTS: [(&str, &[&str]); 4] = [
    ("beta", &["newmark"]),
    ("gamma", &["newmark"]),
    ("alpha", &["hht"]),
    ("rho_inf", &["generalized_alpha", "lie_generalized_alpha"]),
];

fn read_scheme(table: &Table) -> Option<SchemeWord> {
    let context = table.context;
    let scheme = if table.has("scheme") { table.word("scheme", &SCHEMES)?.value } else { "newmark" };
    for (key, owners) in COEFFICIENTS.into_iter().filter(|(key, owners)| table.has(key) && !owners.contains(&scheme)) {
        let owners: Vec<String> = owners.iter().map(|owner| format!("\"{owner}\"")).collect();
        let message = format!("`{key}` belongs to scheme = {}", owners.join(" or "));
        context.report(Diagnostic::error(message, table.key_span(key)));
    }
    let within = |key: &str, default: f64, most: f64| {
        if !table.has(key) {
            return Some(default);
        }
        let number = table.number(key)?;
        if (0.0..=most).contains(&number.value) {
            return Some(number.value);
        }
        context.wrong(number.span, format!("`{key}` lies from 0 to {most}, found {}", number.value))
    };
    let positive =
        |key: &str, default: f64| if table.has(key) { table.positive(key).map(|v| v.value) } else { Some(default) };
    match scheme {
        "newmark" => {
            let (beta, gamma) = (positive("beta", 0.25), positive("gamma", 0.5));
            Some(SchemeWord::Newmark(beta?, gamma?))
        }
        "hht" => within("alpha", 0.05, 1.0 / 3.0).map(SchemeWord::Hht),
        "generalized_alpha" => within("rho_inf", 0.9, 1.0).map(SchemeWord::GeneralizedAlpha),
        _ => within("rho_inf", 0.9, 1.0).map(SchemeWord::LieGeneralizedAlpha),
    }
}

/// `Some(None)` where steps are fixed.
fn read_step_tolerance(table: &Table) -> Option<Option<f64>> {
    let adaptive = if table.has("adaptive") { table.flag("adaptive")? } else { false };
    let tolerance = if table.has("step_tolerance") { table.positive("step_tolerance")?.value } else { 1e-4 };
    if adaptive {
        return Some(Some(tolerance));
    }
    if table.has("step_tolerance") {
        let (message, span) = ("`step_tolerance` belongs to adaptive = true", table.key_span("step_tolerance"));
        // Where steps are said to be fixed, the tolerance waits for another day: studies turn the one without the other.
        let said = table.has("adaptive");
        table.context.report(match said {
            true => Diagnostic::warning(WarningKind::IdleStepTolerance, message, span),
            false => Diagnostic::error(message, span),
        });
    }
    Some(None)
}

fn read_tolerance(table: &Table) -> Option<f64> {
    if !table.has("tolerance") {
        return Some(1e-9);
    }
    let tolerance = table.positive("tolerance")?;
    if tolerance.value < 1.0 {
        return Some(tolerance.value);
    }
    table.context.wrong(tolerance.span, format!("`tolerance` is relative and below 1, found {}", tolerance.value))
}

fn read_until<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Until> {
    let table = Table::new(context, item, "`until`", &["column", "below", "above"])?;
    let column = table.required("column").and_then(|item| context.text(item));
    let (below, above) = (table.number("below").map(|v| v.value), table.number("above").map(|v| v.value));
    if !table.has("below") && !table.has("above") {
        return context.wrong(table.span.clone(), "`until` needs `below` or `above`");
    }
    Some(Until { column: column?, below, above })
}

pub(super) fn read_output(top: &Table) -> Output {
    let default = Output { every: 1, ..Output::default() };
    let Some(item) = top.get("output") else { return default };
    let context = top.context;
    let keys = ["nodes", "columns", "every", "interval", "vtk"];
    let Some(table) = Table::new(context, item, "[output]", &keys) else { return default };
    if table.has("every") && table.has("interval") {
        context.report(Diagnostic::error("give `every` or `interval`, not both", table.key_span("interval")));
    }
    let list = |key: &str| table.get(key).and_then(|item| context.texts(item));
    Output {
        nodes: list("nodes"),
        columns: list("columns"),
        every: table.get("every").and_then(|item| context.whole(item, 1, MOST_STEPS)).map_or(1, |n| n.value),
        interval: table.positive("interval").map(|v| v.value),
        vtk: table.flag("vtk").unwrap_or(false),
    }
}

const EXPECT_KEYS: [&str; 11] =
    ["column", "at", "reduce", "value", "rtol", "atol", "below", "above", "source", "fails", "warns"];

pub(super) fn read_expect<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Expect> {
    let table = Table::new(context, item, "[[expect]]", &EXPECT_KEYS)?;
    let source = table.text("source").map(|t| t.value);
    let body = if table.has("fails") {
        read_fails(&table)
    } else if table.has("warns") {
        read_warns(&table)
    } else {
        read_column(&table)
    };
    Some(Expect { body: body?, source, span: table.span.clone() })
}

/// Reports the first key beside `own` that an expectation of a whole run has no use for.
fn refuse_keys_beside(table: &Table, own: &str, what: &str) -> Option<()> {
    match EXPECT_KEYS.into_iter().find(|key| ![own, "source"].contains(key) && table.has(key)) {
        Some(key) => table.context.wrong(table.key_span(key), format!("{what} has no `{key}`")),
        None => Some(()),
    }
}

fn read_warns(table: &Table) -> Option<ExpectBody> {
    let context = table.context;
    refuse_keys_beside(table, "warns", "an expected warning")?;
    let item = table.get("warns")?;
    let name = match item.get_ref() {
        DeValue::Boolean(false) => return Some(ExpectBody::Quiet),
        DeValue::String(name) => name,
        _ => return context.wrong(item.span(), "`warns` is the name of a warning, or false"),
    };
    if let Some(kind) = WarningKind::of(name) {
        return Some(ExpectBody::Warns(kind));
    }
    let names = WarningKind::ALL.iter().map(|kind| kind.name());
    let diagnostic = Diagnostic::error(format!("there is no warning `{name}`"), item.span());
    context.report(match nearest(name, names) {
        Some(meant) => diagnostic.help(format!("did you mean `{meant}`?")),
        None => diagnostic.help("`beamsim explain expect.warns` lists the warnings"),
    });
    None
}

fn read_fails(table: &Table) -> Option<ExpectBody> {
    let context = table.context;
    refuse_keys_beside(table, "fails", "an expected failure")?;
    let name = table.text("fails")?;
    if FailureKind::of(&name.value).is_some() {
        return Some(ExpectBody::Fails(name));
    }
    let mut diagnostic = Diagnostic::error(format!("there is no failure `{}`", name.value), name.span);
    let names = || FailureKind::ALL.iter().map(|kind| kind.name());
    diagnostic.help = Some(match nearest(&name.value, names()) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => format!("failures are {}", super::one_of(names())),
    });
    context.report(diagnostic);
    None
}

fn read_column(table: &Table) -> Option<ExpectBody> {
    let context = table.context;
    let column = table.required("column").and_then(|item| context.text(item));
    let reduce = read_reduce(table);
    let (below, above) = (table.number("below").map(|v| v.value), table.number("above").map(|v| v.value));
    let value = if table.has("value") {
        Some(read_value(table)?)
    } else {
        if let Some(key) = ["rtol", "atol"].into_iter().find(|key| table.has(key)) {
            return context.wrong(table.key_span(key), format!("`{key}` belongs to a `value`"));
        }
        if !table.has("below") && !table.has("above") {
            return context.wrong(table.span.clone(), "[[expect]] needs `value`, `below`, `above`, `fails` or `warns`");
        }
        None
    };
    Some(ExpectBody::Column { column: column?, reduce: reduce?, value, below, above })
}

fn read_value(table: &Table) -> Option<(f64, f64, f64)> {
    let context = table.context;
    let value = table.number("value");
    let tolerance = |key: &str| {
        let Some(number) = table.number(key) else { return Some(0.0) };
        if number.value >= 0.0 {
            return Some(number.value);
        }
        context.wrong(number.span, format!("`{key}` must not be negative"))
    };
    let (atol, rtol) = (tolerance("atol"), tolerance("rtol"));
    if !table.has("atol") && !table.has("rtol") {
        return context.wrong(table.key_span("value"), "a `value` needs `rtol` or `atol`: how close is close enough?");
    }
    Some((value?.value, atol?, rtol?))
}

fn read_reduce(table: &Table) -> Option<Reduce> {
    let context = table.context;
    match (table.get("at"), table.get("reduce")) {
        (None, None) => Some(Reduce::At(Instant::End)),
        (Some(item), None) => read_instant(context, item).map(Reduce::At),
        (None, Some(_)) => Reduce::of(table.word("reduce", &REDUCTIONS.map(|reduce| reduce.word()))?.value),
        (Some(_), Some(item)) => context
            .wrong(item.span(), "an expectation looks `at` one instant or takes a `reduce` over all rows, not both"),
    }
}

fn read_instant<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Instant> {
    match item.get_ref() {
        DeValue::String(word) if word == "end" => Some(Instant::End),
        DeValue::Table(_) => {
            let table = Table::new(context, item, "`at`", &["load"])?;
            context.number(table.required("load")?).map(|v| Instant::Load(v.value))
        }
        DeValue::Integer(_) | DeValue::Float(_) | DeValue::String(_) => {
            context.number(item).map(|v| Instant::Time(v.value))
        }
        other => {
            context.wrong(item.span(), format!("`at` is \"end\", a time or {{ load = … }}, found {}", kind_of(other)))
        }
    }
}
