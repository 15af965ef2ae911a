//! Errors and warnings about stages that are found before anything is computed, with their places
//! in the deck.

use super::compose::DrivenTable;
use crate::deck::{Deck, Diagnostic, HistoryBody, HistoryTable, Span};
use beamsim_core::model::{StageError, StageKind};
use beamsim_core::run::{Driven, HistoryJump, JumpKind, Plan, refusal, refusal_help, rehearse};
use beamsim_core::warning::WarningKind;

/// Refuses stages that cannot begin, and warns where histories jump.
pub fn tell(deck: &Deck, plan: &Plan, tables: &[DrivenTable], diagnostics: &mut Vec<Diagnostic>) {
    let rehearsal = rehearse(plan);
    for (number, error) in &rehearsal.refusals {
        let stage = &deck.stages[*number].span;
        let span = place(error, tables).unwrap_or(stage);
        let message = format!("stage {}: {}", number + 1, refusal(error, &plan.model));
        let mut diagnostic = Diagnostic::error(message, span.clone());
        diagnostic.help = refusal_help(error, &plan.model, *number);
        diagnostics.push(if span == stage { diagnostic } else { diagnostic.context(stage.clone(), "this stage") });
    }
    let teller = Teller { deck, plan, tables };
    // Whose place is wrong has no velocity to speak of.
    let refused: Vec<&Span> = rehearsal.refusals.iter().filter_map(|(_, error)| place(error, tables)).collect();
    let mut told: Vec<Warned> = Vec::new();
    for jump in &rehearsal.jumps {
        let own = tables.iter().filter(|table| table.drives == jump.what && teller.concerns(jump, table));
        for table in own.filter(|table| !refused.contains(&&table.span)) {
            let history = table.history.as_ref().map(|history| history.name.value.as_str());
            let same = |told: &&mut Warned| {
                let kinds = std::mem::discriminant(&told.jump.how) == std::mem::discriminant(&jump.how);
                kinds && told.history == history && told.table.what == table.what
            };
            match told.iter_mut().find(same) {
                Some(told) if told.table.span != table.span => told.others += 1,
                Some(_) => {}
                None => told.push(Warned { jump, table, history, others: 0 }),
            }
        }
    }
    diagnostics.extend(told.iter().map(|told| teller.diagnostic(told)));
}

/// The table that cannot begin a stage.
fn place<'t>(error: &StageError, tables: &'t [DrivenTable]) -> Option<&'t Span> {
    let driven = match error {
        StageError::Jump(jump) => Driven::Motion(jump.motion),
        StageError::MotorJump(jump) => Driven::Motor(jump.slot),
        StageError::SurfaceJump(jump) => Driven::Amplitude(jump.amplitude),
        StageError::Conflict(_) | StageError::TurnedHinge(_) | StageError::NothingGrows(_) | StageError::NoMass => {
            return None;
        }
    };
    tables.iter().find(|table| table.drives == driven).map(|table| &table.span)
}

/// One warning for all tables that it holds of.
struct Warned<'a> {
    jump: &'a HistoryJump,
    table: &'a DrivenTable,
    history: Option<&'a str>,
    others: usize,
}

const SMOOTH: &str = "`smooth = true` makes velocity and acceleration continuous";
/// A smooth table stands still at each of its times.
const SAMPLED: &str = "an `expr`, or a table with more points, has no kinks (`smooth = true` has none either, but its \
                       velocity is zero at each of its times)";

const FORMULA_BETWEEN_STEPS: &str = "a shorter `step`, or a table instead of the `expr`, with `adaptive = true`: adaptive steps \
                                     end at the times of tables";

const BETWEEN_STEPS: &str = "a shorter `step`, of which the times of the history are multiples, or `adaptive = true`, \
                             whose steps end at these times";

const BETWEEN_LEVELS: &str = "more `steps`, so that levels end at the times of the history, which are load factors in a \
                              static stage";

struct Teller<'a> {
    deck: &'a Deck,
    plan: &'a Plan,
    tables: &'a [DrivenTable],
}

impl Teller<'_> {
    fn kind(&self, stage: usize) -> StageKind {
        self.plan.stages[stage].work.kind()
    }

    /// Motors that jump into a dynamic stage are refused, not warned of.
    fn concerns(&self, jump: &HistoryJump, table: &DrivenTable) -> bool {
        let jumps = matches!(jump.how, JumpKind::Value { .. }) && self.kind(jump.stage).advances_time();
        !(jumps && self.is_motor(table))
    }

    fn is_motor(&self, table: &DrivenTable) -> bool {
        let twin = |other: &DrivenTable| matches!(other.drives, Driven::Motor(_)) && other.span == table.span;
        self.tables.iter().any(twin)
    }

    fn diagnostic(&self, told: &Warned) -> Diagnostic {
        let Warned { jump: HistoryJump { stage, how, .. }, table, history, others } = told;
        let number = stage + 1;
        let what = table.what;
        let name = history.map_or(String::new(), |name| format!(" `{name}`"));
        let more = match others {
            0 => String::new(),
            1 => format!(" (likewise another {what})"),
            _ => format!(" (likewise {others} other {what}s)"),
        };
        let begins_there = self.deck.stages[*stage].span.clone();
        match how {
            JumpKind::NotFinite => {
                let message = format!(
                    "the history{name} of this {what} has no finite value, velocity or acceleration at the start of \
                     stage {number}{more}"
                );
                Diagnostic::error(message, table.span.clone())
            }
            JumpKind::Value { from, to } => {
                let message = format!(
                    "the history{name} of this {what} jumps from {from} to {to} at the start of stage {number}{more}"
                );
                let diagnostic = Diagnostic::warning(WarningKind::HistoryJump, message, table.span.clone())
                    .context(begins_there, "this stage");
                diagnostic.help(self.help(told))
            }
            JumpKind::Velocity { from, to } => {
                let has = if *from == 0.0 { "is at rest".into() } else { format!("has {from}") };
                let whose = if what == "motion" { "node" } else { "joint" };
                let message = format!(
                    "this {what} starts stage {number} with a velocity of {to}, but its {whose} {has}: the velocity \
                     jumps{more}"
                );
                let help = "let the history start with zero slope, or give the velocity by `[[initial]]` (first \
                            dynamic stage only)";
                Diagnostic::warning(WarningKind::VelocityJump, message, table.span.clone()).help(help)
            }
            JumpKind::BetweenSteps { part } => {
                let percent = (100.0 * part).round();
                let message = format!(
                    "the time steps of stage {number} miss {percent} % of the history{name} of this {what}: it changes \
                     between them{more}"
                );
                Diagnostic::warning(WarningKind::MissedLoad, message, table.span.clone())
                    .context(begins_there, "this stage")
                    .help(self.help_between_steps(*history))
            }
            JumpKind::BetweenLevels { part } => {
                let percent = (100.0 * part).round();
                let message = format!(
                    "the load levels of stage {number} miss a peak of the history{name} of this {what}: between two \
                     levels it goes beyond both by {percent} % of its range{more}"
                );
                Diagnostic::warning(WarningKind::MissedLoad, message, table.span.clone())
                    .context(begins_there, "this stage")
                    .help(self.help_between_levels(*history))
            }
            JumpKind::Kink { time } => {
                let message = format!(
                    "the history{name} of this {what} has kinks: velocities jump there, first at time {time}{more}"
                );
                let diagnostic = Diagnostic::warning(WarningKind::HistoryKinks, message, table.span.clone());
                diagnostic.help(self.help_of_kinks(*history))
            }
        }
    }

    /// The table or formula of a history.
    fn body_of(&self, history: Option<&str>) -> Option<&HistoryBody> {
        let named = |table: &&HistoryTable| Some(table.name.value.as_str()) == history;
        self.deck.histories.iter().find(named).map(|table| &table.body)
    }

    /// Advice on histories that change between time steps.
    fn help_between_steps(&self, history: Option<&str>) -> &'static str {
        match self.body_of(history) {
            Some(HistoryBody::Expression(_)) => FORMULA_BETWEEN_STEPS,
            Some(HistoryBody::Table { .. }) | None => BETWEEN_STEPS,
        }
    }

    /// Advice on histories with a peak between load levels.
    fn help_between_levels(&self, history: Option<&str>) -> &'static str {
        match self.body_of(history) {
            Some(HistoryBody::Expression(_)) => {
                "more `steps`, so that levels lie on both sides of the peak and near it"
            }
            Some(HistoryBody::Table { .. }) | None => BETWEEN_LEVELS,
        }
    }

    /// Advice on histories with kinks.
    fn help_of_kinks(&self, history: Option<&str>) -> &'static str {
        let Some(HistoryBody::Table { values, .. }) = self.body_of(history) else { return SMOOTH };
        let goes_on = |w: &[f64]| (w[1] - w[0]) * (w[2] - w[1]) > 0.0;
        if values.windows(3).any(goes_on) { SAMPLED } else { SMOOTH }
    }

    /// Advice on histories that jump from one stage to the next.
    fn help(&self, told: &Warned) -> String {
        let Warned { jump: HistoryJump { stage, .. }, table, history, .. } = told;
        let own_stages = table.history.as_ref().is_some_and(|history| history.stages.is_some());
        let before = (0..*stage).rev().find(|&k| self.kind(k).advances_state());
        let before = before.unwrap_or_default();
        match (own_stages, self.kind(*stage) == self.kind(before)) {
            (true, _) => {
                "in a static stage the history is a function of the load factor, from 0 to 1: let it start at the \
                 value that the previous stage ended with"
                    .into()
            }
            (false, true) => "in each static stage the history is a function of the load factor, from 0 to 1: let it \
                              end at its first value, or give each stage its own history"
                .into(),
            (false, false) => format!(
                "a history is a function of the load factor in static stages and of time in dynamic ones: with \
                 `history = {{ name = \"{}\", stages = [{own}] }}` it keeps its first value before stage {own}; with \
                 `stages = [{last}]`, its last value after stage {last}",
                history.unwrap_or_default(),
                own = stage + 1,
                last = before + 1
            ),
        }
    }
}
