//! `[[stage]]`: static, dynamic, modal and buckling stages.

use super::diagnostic::{Diagnostic, Span, Spanned};
use super::point::{PointRef, read_point};
use super::reader::{Context, Item, Table, joined, kind_of};
use super::scheme::{SchemeWord, read_scheme};
use super::words::{Words, words};
use beamsim_core::system::StageKind;
use beamsim_core::warning::WarningKind;
use toml::de::DeValue;

/// `[[stage]]`
#[derive(Clone, Debug)]
pub struct Stage {
    /// Kind with its own keys
    pub(crate) body: StageBody,
    /// Newton's tolerance
    pub tolerance: f64,
    /// Newton's limit
    pub max_iterations: usize,
    /// Ends it early
    pub until: Option<Until>,
    /// A rotating frame from which it is seen
    pub frame: Option<RotatingFrame>,
    /// Place of the table
    pub(crate) span: Span,
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
        /// Number of modes
        modes: usize,
    },
    /// Critical loads
    Buckling {
        /// Number of modes
        modes: usize,
    },
    /// Time steps
    Dynamic {
        /// On the run's clock
        end: f64,
        /// Step, or the first one
        step: f64,
        /// Scheme with its coefficients
        scheme: SchemeWord,
        /// Tolerance of the local error, where steps adapt to it
        step_tolerance: Option<f64>,
        /// The part of the largest energies so far by which the total may grow
        energy_limit: f64,
    },
}

impl StageBody {
    /// The kind of the stage. Load levels and arc length are two controls of one kind.
    pub fn kind(&self) -> StageKind {
        match self {
            Self::Static { .. } | Self::Path { .. } => StageKind::Static,
            Self::Modal { .. } => StageKind::Modal,
            Self::Buckling { .. } => StageKind::Buckling,
            Self::Dynamic { .. } => StageKind::Dynamic,
        }
    }

    /// The stage as messages call it.
    pub fn in_words(&self) -> &'static str {
        match self {
            Self::Static { .. } => "a static stage",
            Self::Path { .. } => "control = \"arc_length\"",
            Self::Modal { .. } => "a modal stage",
            Self::Buckling { .. } => "a buckling stage",
            Self::Dynamic { .. } => "a dynamic stage",
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
}

/// `kind = …` of a stage
impl Words for StageKind {
    const ALL: &'static [Self] = &[Self::Static, Self::Dynamic, Self::Modal, Self::Buckling];

    fn word(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Dynamic => "dynamic",
            Self::Modal => "modal",
            Self::Buckling => "buckling",
        }
    }
}

words! {
    /// `control = …` of a static stage
    pub enum ControlWord {
        /// Load levels
        Load = "load",
        /// Increments along the path of equilibrium
        ArcLength = "arc_length",
    }
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

/// Most load levels or time steps of a stage.
pub const MOST_STEPS: usize = 1_000_000_000;
/// Most modes of a stage.
const MOST_MODES: usize = 1000;
/// Most iterations of Newton's method.
const MOST_ITERATIONS: usize = 10_000;
/// Default of `energy_limit`.
const ENERGY_LIMIT: f64 = 0.2;
/// Default of `step_tolerance`.
pub const STEP_TOLERANCE: f64 = 1e-4;
/// Default of `max_steps`, as a multiple of `steps`, at least.
const INCREMENTS_PER_STEP: usize = 10;
/// The least default of `max_steps`: the first increments may be short.
const LEAST_INCREMENTS: usize = 200;

const COMMON_KEYS: [&str; 5] = ["kind", "tolerance", "max_iterations", "until", "frame"];
const STATIC_KEYS: [&str; 3] = ["steps", "control", "max_steps"];
const DYNAMIC_KEYS: [&str; 9] =
    ["end", "step", "scheme", "beta", "gamma", "alpha", "rho_inf", "step_tolerance", "energy_limit"];
/// Keys of static and of dynamic stages.
const SHARED_KEYS: [&str; 1] = ["adaptive"];
const MODES_KEYS: [&str; 1] = ["modes"];

/// Keys of `[[stage]]`.
pub(super) const KEYS: [&str; 19] = joined(&[&COMMON_KEYS, &STATIC_KEYS, &SHARED_KEYS, &DYNAMIC_KEYS, &MODES_KEYS]);
/// Keys of `frame = { … }`.
pub(super) const FRAME_KEYS: [&str; 2] = ["spin", "about"];
/// Keys of `until = { … }`.
pub(super) const UNTIL_KEYS: [&str; 3] = ["column", "below", "above"];

/// True for the keys that a kind of stage has.
fn has_key(kind: StageKind, key: &str) -> bool {
    if ["until", "frame"].contains(&key) {
        return match kind {
            StageKind::Static => true,
            StageKind::Dynamic => key == "until",
            StageKind::Modal | StageKind::Buckling => key == "frame",
        };
    }
    let own = match kind {
        StageKind::Static => STATIC_KEYS.contains(&key) || SHARED_KEYS.contains(&key),
        StageKind::Dynamic => DYNAMIC_KEYS.contains(&key) || SHARED_KEYS.contains(&key),
        StageKind::Modal | StageKind::Buckling => MODES_KEYS.contains(&key),
    };
    own || COMMON_KEYS.contains(&key)
}

pub(super) fn read_stage<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Stage> {
    let table = Table::new(context, item, "[[stage]]", &KEYS)?;
    table.required("kind")?;
    let kind = table.word::<StageKind>("kind")?.value;
    for key in KEYS.into_iter().filter(|key| !has_key(kind, key)) {
        table.refuse(
            key,
            match key {
                "frame" => "`frame` is only allowed in static, modal and buckling stages".into(),
                other => format!("`{other}` is not allowed in a {} stage", kind.word()),
            },
        );
    }
    let modes = || table.required("modes").and_then(|item| context.whole(item, 1, MOST_MODES)).map(|n| n.value);
    let body = match kind {
        StageKind::Static => read_static(&table),
        StageKind::Dynamic => read_dynamic(&table),
        StageKind::Modal => modes().map(|modes| StageBody::Modal { modes }),
        StageKind::Buckling => modes().map(|modes| StageBody::Buckling { modes }),
    };
    let frame = table.optional("frame", read_frame);
    let tolerance = read_tolerance(&table);
    let max_iterations = table.whole_or("max_iterations", 1..=MOST_ITERATIONS, StageKind::MAX_ITERATIONS);
    let until = table.optional("until", read_until);
    Some(Stage {
        body: body?,
        tolerance: tolerance?,
        max_iterations: max_iterations?,
        until: until?,
        frame: frame?,
        span: table.span.clone(),
    })
}

fn read_static(table: &Table) -> Option<StageBody> {
    let control = table.word_or("control", ControlWord::Load)?;
    let steps = |table: &Table| table.required("steps").and_then(|item| table.context.whole(item, 1, MOST_STEPS));
    match control {
        ControlWord::Load => {
            table.refuse("max_steps", "`max_steps` is only allowed with control = \"arc_length\"");
            let steps = steps(table);
            let adaptive = table.flag_or("adaptive", true);
            Some(StageBody::Static { steps: steps?.value, adaptive: adaptive? })
        }
        ControlWord::ArcLength => {
            table.refuse(
                "frame",
                "`frame` is not allowed with control = \"arc_length\": centrifugal forces grow with the square of the \
                 load factor",
            );
            table.refuse(
                "adaptive",
                "`adaptive` is not allowed with control = \"arc_length\", which always adapts its increments",
            );
            let steps = steps(table)?.value;
            let default = steps.saturating_mul(INCREMENTS_PER_STEP).max(LEAST_INCREMENTS);
            let max_steps = table.whole_or("max_steps", 1..=MOST_STEPS, default)?;
            Some(StageBody::Path { steps, max_steps })
        }
    }
}

fn read_frame<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<RotatingFrame> {
    let table = Table::new(context, item, "`frame`", &FRAME_KEYS)?;
    table.required("spin")?;
    let spin = table.vector::<3>("spin")?.value;
    let about = table.optional("about", read_point)?;
    Some(RotatingFrame { spin, about })
}

fn read_dynamic(table: &Table) -> Option<StageBody> {
    let context = table.context;
    let scheme = read_scheme(table);
    let step_tolerance = read_step_tolerance(table);
    let end = table.required_positive("end");
    let step = table.required_positive("step");
    let end = end?.value;
    let step = step?;
    let count = end / step.value;
    if count > MOST_STEPS as f64 {
        let message = format!("{count:.3e} steps are more than the limit of {MOST_STEPS}");
        context.report(Diagnostic::limit(message, step.span));
        return None;
    }
    let energy_limit = table.positive_or("energy_limit", ENERGY_LIMIT)?;
    Some(StageBody::Dynamic { end, step: step.value, scheme: scheme?, step_tolerance: step_tolerance?, energy_limit })
}

/// `Some(None)` where steps are fixed.
fn read_step_tolerance(table: &Table) -> Option<Option<f64>> {
    let adaptive = table.flag_or("adaptive", false)?;
    let tolerance = table.positive_or("step_tolerance", STEP_TOLERANCE)?;
    if adaptive {
        return Some(Some(tolerance));
    }
    if table.has("step_tolerance") {
        let message = "`step_tolerance` is only allowed with adaptive = true";
        let span = table.key_span("step_tolerance");
        // With `adaptive = false` the tolerance is kept for later: studies change one key and leave
        // the other.
        table.context.report(if table.has("adaptive") {
            Diagnostic::warning(WarningKind::IdleStepTolerance, message, span)
        } else {
            Diagnostic::error(message, span)
        });
    }
    Some(None)
}

fn read_tolerance(table: &Table) -> Option<f64> {
    if !table.has("tolerance") {
        return Some(StageKind::TOLERANCE);
    }
    let tolerance = table.positive("tolerance")?;
    if tolerance.value < 1.0 {
        return Some(tolerance.value);
    }
    table
        .context
        .wrong(tolerance.span, format!("`tolerance` is relative and must be below 1, found {}", tolerance.value))
}

fn read_until<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Until> {
    let table = Table::new(context, item, "`until`", &UNTIL_KEYS)?;
    let column = table.required_text("column");
    let below = table.number("below").map(|v| v.value);
    let above = table.number("above").map(|v| v.value);
    if !table.has("below") && !table.has("above") {
        return table.wrong("`until` needs `below` or `above`");
    }
    Some(Until { column: column?, below, above })
}

/// The key `stages` of a table: numbers from 1; `Some(None)` where it is left out: all stages.
pub(super) fn read_stages(table: &Table) -> Option<Option<Vec<usize>>> {
    table.optional("stages", |context, item| {
        let DeValue::Array(array) = item.get_ref() else {
            let message = format!("`stages` must be a list of stage numbers from 1, found {}", kind_of(item.get_ref()));
            return context.wrong(item.span(), message);
        };
        if array.is_empty() {
            return context.wrong(item.span(), "`stages` must not be empty");
        }
        let numbers: Vec<Option<usize>> = array.iter().map(|entry| read_stage_number(context, entry)).collect();
        numbers.into_iter().collect()
    })
}

fn read_stage_number(context: &Context, item: &Item) -> Option<usize> {
    let count = context.stage_count;
    let number = context.whole(item, 1, usize::MAX)?;
    if number.value > count {
        let message = format!("there is no stage {}: the deck has {count}", number.value);
        return context.wrong(number.span, message);
    }
    Some(number.value)
}
