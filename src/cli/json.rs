//! Summaries for scripts: with `--json` a line on standard output for each deck, folder or table, instead of words.

use super::say;
use crate::deck::EffectWord;
use crate::output::{Record, warnings};
use crate::scene::Scene;
use crate::study::ablation::{Ablation, Variant};
use crate::study::{Comparison, Judgement};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;

fn tell(command: &str, rest: Value) {
    let mut entries = Map::from_iter([("command".to_string(), json!(command))]);
    if let Value::Object(rest) = rest {
        entries.extend(rest);
    }
    say::data(&Value::Object(entries).to_string());
}

/// A run: what run.json says, but for the deck.
pub fn run(deck: &Path, results: &Path, record: &Record) {
    if !say::speaks_json() {
        return;
    }
    let mut rest = record.bare();
    rest["deck"] = json!(deck);
    rest["results"] = json!(results);
    tell("run", rest);
}

/// A deck that was looked at; seconds are those that a run will take, where it can run.
pub fn check(deck: &Path, scene: &Scene, seconds: Option<f64>) {
    let effects: Vec<&str> = scene.reasons.iter().filter(|reason| reason.active).map(|reason| reason.name).collect();
    tell(
        "check",
        json!({
            "deck": deck,
            "elements": scene.mesh.element_count,
            "nodes": scene.mesh.nodes.len(),
            "unknowns": scene.plan.model.slots() * 3,
            "effects": effects,
            "seconds": seconds,
            "warnings": warnings(scene.warnings.iter()),
        }),
    );
}

/// A deck that was held against what it expects.
pub fn verify(deck: &Path, seconds: f64, judgements: &[Judgement]) {
    let one = |j: &Judgement| json!({ "what": j.what, "expected": j.expected, "came": j.came, "error": j.error, "ratio": j.ratio, "holds": j.holds });
    let all: Vec<Value> = judgements.iter().map(one).collect();
    let holds = judgements.iter().all(|judgement| judgement.holds);
    tell("verify", json!({ "deck": deck, "seconds": seconds, "holds": holds, "expectations": all }));
}

/// A history that was compared with a stored one.
pub fn compare(a: &Path, b: &Path, cells: &[Comparison]) {
    let one = |c: &Comparison| json!({ "column": c.column, "row": c.row, "came": c.came, "stored": c.stored, "holds": c.ratio <= 1.0 });
    let columns: Vec<Value> = cells.iter().map(one).collect();
    let holds = cells.iter().all(|cell| cell.ratio <= 1.0);
    tell("compare", json!({ "history": a, "stored": b, "holds": holds, "columns": columns }));
}

/// What each effect of a deck changes and costs, as the table tells it, and what all outputs can do without.
pub fn effects(deck: &Path, file: &Path, found: &Ablation, tolerance: f64) {
    let keys = |words: &[EffectWord]| words.iter().map(|word| word.key()).collect::<Vec<_>>();
    let one = |variant: &Variant| {
        let ((change, column), outcome) = (variant.largest(), variant.outcome());
        json!({
            "without": keys(&variant.without),
            "failure": if outcome.is_none() { Some(variant.failure()) } else { None },
            "change": outcome.map(|_| change),
            "of": outcome.filter(|_| change > 0.0).map(|_| &found.columns[column]),
            "time": outcome.map(|outcome| outcome.seconds / found.whole.seconds),
            "iterations": outcome.map(|outcome| outcome.counters.work.iterations),
        })
    };
    let all: Vec<Value> = found.variants.iter().map(one).collect();
    tell(
        "effects",
        json!({
            "deck": deck,
            "file": file,
            "seconds": found.whole.seconds,
            "iterations": found.whole.counters.work.iterations,
            "tolerance": tolerance,
            "variants": all,
            "cheapest": one(&found.cheapest),
            "absent": keys(&found.absent),
        }),
    );
}

/// A sweep, with the points that did not finish by what they ended with.
pub fn sweep(table: &Path, points: usize, finished: usize, failed: &BTreeMap<&str, Vec<usize>>) {
    tell("sweep", json!({ "table": table, "points": points, "finished": finished, "failed": failed }));
}

/// Anything else that leaves a file.
pub fn wrote(command: &str, path: &Path) {
    tell(command, json!({ "file": path }));
}
