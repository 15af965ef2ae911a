//! `beamsim cost`

use super::accuracy::{describe, lines, refused};
use super::load::{Loaded, Refusal};
use super::progress::Progress;
use super::run::{folder, refuse_twins};
use super::{Status, Verdict, cores, json, load, say, signals};
use crate::deck::Accuracy;
use crate::output::{HistoryReader, LinePlots, NamedLine, PartFile};
use crate::study::cost::{Against, Expected, Family, Journal, Knob, Options, Order, Orders, Run, Study, study};
use beamsim_core::failure::FailureKind;
use std::collections::BTreeMap;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Runs of the frontier that are only a little more accurate than the one before stand in the table, and not on the screen.
const WORTH_TELLING: f64 = 0.9;

/// What the user asks of a study.
#[derive(clap::Args)]
pub struct Wanted {
    /// What is varied, as in [cost]: order=1,2 elements=1,2,4 interpolation=relative scheme=newmark,hht step=1,0.5
    #[arg(long, value_name = "KEY=V1,V2,…")]
    vary: Vec<String>,
    /// The accuracy for which lines of the deck are printed
    #[arg(long, default_value_t = 1e-3)]
    accuracy: f64,
    /// Begin no run later than this: 90s, 5m, 1h; what is left out is told, and done when the study is called again
    #[arg(long, value_parser = say::duration, value_name = "TIME")]
    budget: Option<Duration>,
    /// What errors are held against: a stored history (CSV), or `expect` for the values in [[expect]] (default: runs finer than all others)
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Runs at a time (default: one a core)
    #[arg(long, value_parser = say::threads, value_name = "N")]
    threads: Option<NonZero<usize>>,
}

/// Studies decks one after the other.
pub fn cost(decks: &[PathBuf], settings: &[String], wanted: &Wanted, out: Option<&Path>) -> Status {
    let mut verdict = Verdict::default();
    let lists = wanted.vary.iter().find(|vary| !vary.contains('='));
    let unread = lists.map(|vary| format!("--vary {vary}: expected KEY=V1,V2,…"));
    let why = Accuracy::check(wanted.accuracy).map_err(|why| format!("--accuracy: {why}")).err().or(unread);
    if let Some(why) = why {
        verdict.fail(Status::Wrong, "usage", why);
        return verdict.finish(1);
    }
    if refuse_twins(decks, &mut verdict) {
        return verdict.finish(1);
    }
    let settings: Vec<String> = settings.iter().cloned().chain(wanted.vary.iter().map(|vary| setting(vary))).collect();
    signals::caught();
    for path in decks {
        let name = load::name(path);
        match load::deck(path, &settings) {
            Ok(loaded) => {
                let done = one(&name, path, &loaded, wanted, &folder(out, &name, decks.len() > 1));
                if let Err(refusal) = done {
                    verdict.refuse(refusal);
                }
            }
            Err(refusal) => verdict.refuse(refusal),
        }
        if signals::caught().is_some() {
            break;
        }
    }
    verdict.finish(decks.len())
}

/// `order=1,2` as a setting of the deck.
fn setting(vary: &str) -> String {
    let (key, values) = vary.split_once('=').unwrap_or((vary, ""));
    let quoted = |value: &str| match value.trim().parse::<f64>() {
        Ok(_) => value.trim().to_string(),
        Err(_) => format!("{:?}", value.trim()),
    };
    let values: Vec<String> = values.split(',').map(quoted).collect();
    match &values[..] {
        [one] => format!("cost.{}={one}", key.trim()),
        _ => format!("cost.{}=[{}]", key.trim(), values.join(", ")),
    }
}

fn one(name: &str, path: &Path, loaded: &Loaded, wanted: &Wanted, folder: &Path) -> Result<(), Refusal> {
    let io = |error: std::io::Error| Refusal::of(FailureKind::Io, format!("{}: {error}", folder.display()));
    let (against, given) = match &wanted.reference {
        None => (Against::Finest, String::new()),
        Some(word) if word.as_os_str() == "expect" => (Against::Expectations, "expect".into()),
        Some(path) => {
            let table = HistoryReader::read(path).map_err(Refusal::io)?;
            let identity = format!("{table:?}");
            (Against::Table(table), identity)
        }
    };
    let identity = format!("beamsim {}\n{given}\n{}", env!("CARGO_PKG_VERSION"), loaded.text);
    let mut journal = Journal::open(folder, &identity).map_err(io)?;
    if !journal.is_empty() {
        say::note(&format!("{name}: goes on after {} runs of a study that was stopped", journal.len()));
    }
    let mut progress = Progress::new(name);
    let mut tell =
        |done: usize, all: usize| progress.tell(done as f64 / all as f64, || format!("{done} of {all} runs"));
    let options = Options {
        threads: cores(wanted.threads),
        budget: wanted.budget,
        interrupted: &signals::caught,
        tell: &mut tell,
        journal: &mut journal,
    };
    let found = study(&loaded.text, &loaded.deck, &loaded.scene, &against, options);
    progress.done();
    if signals::caught().is_some() && !journal.is_empty() {
        say::note(&format!("{name}: {} runs are kept; the same command goes on after them", journal.len()));
    }
    let found = found.map_err(|refusal| refused(refusal, path, loaded))?;
    tell_study(name, loaded, &found, wanted.accuracy);
    let table = found.to_csv().map_err(|error| Refusal::io(error.into()))?;
    let title = loaded.scene.title.as_deref().unwrap_or(name);
    let drawn = frontier(&found).first().map(|_| ("cost.svg", plot(title, &found).into_bytes()));
    for (file, content) in std::iter::once(("cost.csv", table)).chain(drawn) {
        PartFile::write(folder, file, &content).map_err(Refusal::io)?;
        say::line(&format!("  {}", folder.join(file).display()));
        json::wrote("cost", &folder.join(file));
    }
    if let Some(error) = journal.trouble() {
        say::note(&format!("warning[io]: runs were not kept for another time: {error}"));
    }
    let whole = |run: &Run| run.trial.is_some() && (!run.frontier || run.timing.alone > 0);
    if found.runs.iter().all(whole) { journal.close().map_err(io) } else { Ok(()) }
}

fn tell_study(name: &str, loaded: &Loaded, found: &Study, accuracy: f64) {
    say::line(&format!("{name}: {}", loaded.scene.title.as_deref().unwrap_or("(no title)")));
    tell_measure(found);
    tell_runs(found);
    say::line(&format!("  {:>9}  {:>10}  {:>6}  {:<10} with", "error", "cpu", "spread", "limited by"));
    let mut told = f64::INFINITY;
    for run in frontier(found) {
        if run.error < WORTH_TELLING * told {
            told = run.error;
            tell_run(run, found);
        }
    }
    tell_orders(&found.orders);
    tell_lines(loaded, found, accuracy);
}

fn tell_measure(found: &Study) {
    let of = match found.outputs.len() {
        1 => found.columns[found.outputs[0]].clone(),
        count => format!("the worst of {count} outputs"),
    };
    let how = found.norm.described();
    say::line(&format!("  error of {of}: {how}, over the largest value of its kind"));
    if found.ends_only {
        say::line("  compared at the ends of stages only: steps adapt, and [output] interval names no instants");
    }
    let sure = match found.reference.uncertainty {
        0.0 => "taken as exact".into(),
        uncertainty => format!("uncertain by {uncertainty:.1e}"),
    };
    say::line(&format!("  reference: {}; {sure}", found.reference.made));
}

/// How many runs there are, and what became of those that are not on the table.
fn tell_runs(found: &Study) {
    let mut failed: BTreeMap<&str, usize> = BTreeMap::new();
    for run in &found.runs {
        let status = run.trial.as_ref().map_or("left out by the budget", |trial| &trial.status);
        if status != "finished" {
            *failed.entry(status).or_default() += 1;
        }
    }
    let failed: Vec<String> = failed.iter().map(|(status, count)| format!(", {count} {status}")).collect();
    say::line(&format!("  {} runs{}", found.runs.len(), failed.concat()));
    if found.runs.iter().any(|run| run.trial.is_none()) {
        say::line("  the same command without the budget, or with another, goes on");
    }
}

/// Runs of the frontier, the least accurate first.
fn frontier(found: &Study) -> Vec<&Run> {
    let mut runs: Vec<&Run> = found.runs.iter().filter(|run| run.frontier).collect();
    runs.sort_by(|a, b| b.error.total_cmp(&a.error));
    runs
}

fn tell_run(run: &Run, found: &Study) {
    let told = found.reference.least_told();
    let error = if run.error < told { format!("< {told:.1e}") } else { format!("{:.1e}", run.error) };
    let limit = run.limit.map_or("", |knob| knob.name());
    let spread = if run.timing.alone > 1 { format!("{:.0} %", 100.0 * run.timing.spread) } else { "–".into() };
    let cpu = say::time(run.timing.seconds.cpu);
    say::line(&format!("  {error:>9}  {cpu:>10}  {spread:>6}  {limit:<10} {}", describe(&run.point)));
}

fn tell_orders(orders: &[Orders]) {
    if orders.iter().all(|o| o.space.is_none() && o.time.is_none()) {
        return;
    }
    say::line("  orders of convergence seen (and expected)");
    for Orders { family, space, time } in orders {
        let parts = [space.map(|order| tell_order("space", order)), time.map(|order| tell_order("time", order))];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        say::line(&format!("    {:<22} {}", family.name(), parts.join("; ")));
    }
}

fn tell_order(of: &str, order: Order) -> String {
    let seen = order.observed.map_or("none".into(), |p| format!("{p:.1}"));
    let expected =
        order.expected.map_or(
            "–".into(),
            |Expected { order, at_least }| {
                if at_least { format!("at least {order}") } else { order.to_string() }
            },
        );
    let remark = order.remark().map_or(String::new(), |remark| format!(" {remark}"));
    format!("{of} {seen} ({expected}){remark}")
}

/// The lines of a deck that reach an accuracy for the least time.
fn tell_lines(loaded: &Loaded, found: &Study, accuracy: f64) {
    let Some(run) = frontier(found).into_iter().find(|run| run.error <= accuracy) else {
        let finest = frontier(found).pop().and_then(|run| run.limit);
        let advice = match finest {
            _ if found.reference.least_told() > accuracy => "the reference is not that certain",
            Some(Knob::Step) => "try smaller steps, --vary step=0.25,0.125,0.0625",
            Some(Knob::Newton) => "try a smaller `tolerance` of the stages",
            _ => "try finer meshes, --vary elements=4,8,16",
        };
        return say::line(&format!("  {accuracy:e} is not reached by any run: {advice}"));
    };
    say::line(&format!("  {accuracy:e} costs {}: {}", say::time(run.timing.seconds.cpu), describe(&run.point)));
    lines(&loaded.deck, &run.settings).iter().for_each(|line| say::line(&format!("    {line}")));
}

/// Error over time: a line for each family through its own best runs, all others beside it, and the frontier of all behind.
fn plot(title: &str, found: &Study) -> String {
    let place = |run: &&Run| (run.timing.seconds.cpu, run.error);
    let all = NamedLine {
        name: "cheapest of all".into(),
        points: frontier(found).iter().map(place).collect(),
        beside: Vec::new(),
        background: true,
    };
    let mut families: Vec<&Family> = Vec::new();
    for run in &found.runs {
        if !families.contains(&&run.point.family) {
            families.push(&run.point.family);
        }
    }
    let line = |family: &&Family| {
        let mut runs: Vec<&Run> =
            found.runs.iter().filter(|run| run.point.family == **family && run.error > 0.0).collect();
        runs.sort_by(|a, b| a.timing.seconds.cpu.total_cmp(&b.timing.seconds.cpu));
        let mut best = f64::INFINITY;
        let (points, beside): (Vec<&Run>, Vec<&Run>) = runs.into_iter().partition(|run| {
            let better = run.error < best;
            best = best.min(run.error);
            better
        });
        let [points, beside] = [points, beside].map(|runs| runs.iter().map(place).collect());
        NamedLine { name: family.name(), points, beside, background: false }
    };
    let outputs = match &found.outputs[..] {
        [one] => found.columns[*one].clone(),
        several => format!("{} outputs", several.len()),
    };
    LinePlots {
        title: title.into(),
        x: "CPU time / s".into(),
        y: format!("error of {outputs}, relative"),
        lines: std::iter::once(all).chain(families.iter().map(line)).collect(),
        level: Some((found.reference.least_told(), "the reference tells no less".into())),
    }
    .to_log_log_svg()
}
