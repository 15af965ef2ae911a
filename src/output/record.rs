//! run.json: what was simulated, what it took, how it ended.

use crate::scene::Scene;
use beamsim_core::failure::FailureKind;
use beamsim_core::integrate::Largest;
use beamsim_core::run::{Counters, Event, Failure, Moment, Place, StageStability, StageTimeError, Warning};
use serde_json::{Map, Value, json};
use std::fmt::{self, Display, Formatter};
use std::path::Path;
use std::{fs, io};

/// How a run ended.
pub struct Outcome<'a> {
    /// The failure, if it was one
    pub result: &'a Result<(), Failure>,
    /// The work done
    pub counters: &'a Counters,
    /// Wall-clock seconds of the run
    pub seconds: f64,
    /// The threads that it ran on
    pub threads: usize,
    /// The accuracy that was reached, where one was wanted
    pub reached: Option<&'a Reached>,
    /// The deck as it was read
    pub text: &'a str,
}

/// An accuracy that was wanted, and what was reached.
pub struct Reached {
    /// Columns with what was wanted of each and the estimated error, over the largest value of its kind
    pub columns: Vec<(String, f64, f64)>,
    /// Whether all estimates are what was wanted
    pub is_reached: bool,
    /// What was set in the deck for it
    pub settings: Vec<String>,
    /// Runs that it took to find
    pub runs: usize,
    /// Wall-clock seconds of these
    pub seconds: f64,
}

/// The content of run.json.
#[derive(Clone, Debug)]
pub struct Record(Value);

impl Record {
    /// Of a run.
    pub fn of(scene: &Scene, outcome: &Outcome) -> Self {
        Self(run_record(scene, outcome))
    }

    /// That of the results in a folder.
    pub fn read(folder: &Path) -> io::Result<Self> {
        let path = folder.join("run.json");
        let wrong = |why: String| io::Error::other(format!("{}: {why}", path.display()));
        let bytes = fs::read(&path).map_err(|error| wrong(error.to_string()))?;
        serde_json::from_slice(&bytes).map(Self).map_err(|error| wrong(error.to_string()))
    }

    /// The deck as it was read.
    pub fn text(&self) -> Option<&str> {
        self.0["text"].as_str()
    }

    /// Whether a signal ended the run.
    pub fn is_interrupted(&self) -> bool {
        self.0["status"] == FailureKind::Interrupted.name()
    }

    /// Without the deck.
    pub fn bare(&self) -> Value {
        let mut bare = self.0.clone();
        if let Some(entries) = bare.as_object_mut() {
            entries.remove("text");
        }
        bare
    }
}

impl Display for Record {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        writeln!(f, "{:#}", self.0)
    }
}

fn run_record(scene: &Scene, outcome: &Outcome) -> Value {
    let effects: Vec<Value> =
        scene.reasons.iter().map(|r| json!({ "name": r.name, "active": r.active, "reason": r.reason })).collect();
    let status = outcome.result.as_ref().map_or_else(Failure::name, |()| "finished");
    let mut record = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "status": status,
        "deck": scene.resolved,
        "text": outcome.text,
        "effects": effects,
        "counters": counters(outcome.counters),
        "events": events(outcome.counters),
        "stability": stability(outcome.counters),
        "time_errors": time_errors(outcome.counters),
        "warnings": warnings(scene.warnings.iter().chain(&outcome.counters.findings.warnings)),
        "threads": outcome.threads,
        "seconds": {
            "total": outcome.seconds,
            "evaluation": outcome.counters.work.evaluation_seconds,
            "solve": outcome.counters.work.solve_seconds,
        },
    });
    if let Some(Reached { columns, is_reached, settings, runs, seconds }) = outcome.reached {
        let column = |(name, wanted, estimate): &(String, f64, f64)| (name.clone(), json!([wanted, estimate]));
        let columns: Map<String, Value> = columns.iter().map(column).collect();
        record["accuracy"] = json!({
            "reached": is_reached,
            "columns": columns,
            "settings": settings,
            "runs": runs,
            "seconds": seconds,
        });
    }
    if let Err(failure) = outcome.result {
        record["failure"] = numbers(failure, scene);
    }
    record
}

/// Limit, turning and branch points.
fn events(counters: &Counters) -> Value {
    let event = |event: &Event| {
        json!({
            "stage": event.at.stage,
            "load": event.at.load,
            "kind": event.kind.name(),
            "negative_pivots": event.negative_pivots,
        })
    };
    counters.findings.events.iter().map(event).collect()
}

/// Of each static stage that came to its end.
fn stability(counters: &Counters) -> Value {
    let one = |found: &StageStability| json!({ "stage": found.stage, "verdict": found.verdict.name(), "negative": found.negative });
    counters.findings.stability.iter().map(one).collect()
}

/// Of each dynamic stage of fixed steps, as far as it came.
fn time_errors(counters: &Counters) -> Value {
    let one = |&StageTimeError { stage, largest: Largest { displacement, rotation, moved } }: &StageTimeError| json!({ "stage": stage, "displacement": displacement, "rotation": rotation, "moved": moved });
    counters.findings.time_errors.iter().map(one).collect()
}

/// Warnings with their names; those about a deck have no moment.
pub fn warnings<'a>(given: impl Iterator<Item = &'a Warning>) -> Value {
    let one = |warning: &Warning| {
        json!({
            "name": warning.kind.name(),
            "about": warning.kind.about().name(),
            "stage": warning.at.map(|at| at.stage),
            "time": warning.at.map(|at| at.time),
            "load": warning.at.map(|at| at.load),
            "message": warning.message,
        })
    };
    given.map(one).collect()
}

fn counters(counters: &Counters) -> Value {
    let evaluations: Map<String, Value> =
        counters.evaluations.iter().map(|&(name, n)| (name.into(), json!(n))).collect();
    json!({
        "steps": counters.steps,
        "cutbacks": counters.cutbacks,
        "uncertainty": counters.work.uncertainty,
        "iterations": counters.work.iterations,
        "factorisations": counters.work.factorisations,
        "chart_switches": counters.work.chart_switches,
        "mixed_elements": counters.mixed_elements,
        "evaluations": evaluations,
        "linear_solvers": counters.linear_solvers,
    })
}

/// The numbers of a failure.
fn numbers(failure: &Failure, scene: &Scene) -> Value {
    let mut record = json!({ "name": failure.name(), "message": failure.to_string() });
    if let Some(hint) = failure.hint(&scene.plan) {
        record["hint"] = json!(hint);
    }
    let when = |at: &Moment, record: &mut Value| {
        record["stage"] = json!(at.stage);
        record["time"] = json!(at.time);
        record["load"] = json!(at.load);
    };
    let place = |place: &Place, record: &mut Value| {
        record["node"] = json!(place.node);
        record["direction"] = json!(place.direction.0);
        record["unknown"] = json!(format!("{:?}", place.kind).to_lowercase());
    };
    match failure {
        Failure::NotConverged { at, place: node, residual, force, history, tried } => {
            when(at, &mut record);
            place(node, &mut record);
            record["residual"] = json!(residual);
            record["force"] = json!(force);
            record["iterations"] = json!(history.len().saturating_sub(1));
            record["residual_history"] = json!(history);
            record["cutbacks"] = json!(tried.cutbacks);
        }
        Failure::TurnsTooFar { at, node, angle } => {
            when(at, &mut record);
            record["node"] = json!(node);
            record["angle"] = json!(angle);
        }
        Failure::LimitPoint { at, goal, increments, end } => {
            when(at, &mut record);
            record["goal"] = json!(goal);
            record["arc_length_increments"] = json!(increments);
            record["end"] = json!(end.load);
        }
        Failure::StepTooSmall { at, place: node, error, share } => {
            when(at, &mut record);
            place(node, &mut record);
            record["error"] = json!(error);
            record["share"] = json!(share);
        }
        Failure::Singular { at, place: node } => {
            when(at, &mut record);
            if let Some(node) = node {
                place(node, &mut record);
            }
        }
        Failure::NonFinite { at, effect, node } => {
            when(at, &mut record);
            record["effect"] = json!(effect);
            record["node"] = json!(node);
        }
        Failure::MeshTooCoarse { at, nodes, relative_rotation } => {
            when(at, &mut record);
            record["nodes"] = json!(nodes);
            record["relative_rotation"] = json!(relative_rotation);
        }
        Failure::EnergyGrowth { at, grown, largest } => {
            when(at, &mut record);
            record["grown"] = json!(grown);
            record["largest"] = json!(largest);
        }
        Failure::Interrupted { at, signal } => {
            when(at, &mut record);
            record["signal"] = json!(signal);
        }
        Failure::Deck(_) | Failure::Limit(_) | Failure::Io(_) => {}
    }
    record
}
