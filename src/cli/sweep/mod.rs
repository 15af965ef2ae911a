//! `beamsim sweep`

mod local;
mod plan;
mod slurm;

use super::load::Refusal;
use super::{Status, Verdict, json, say, signals};
use crate::output::PartFile;
use crate::study::sweep::Outcome;
use beamsim_core::failure::FailureKind;
use plan::Plan;
use std::collections::BTreeMap;
use std::num::NonZero;
use std::path::PathBuf;
use std::time::Duration;

/// What the user asks of a sweep.
#[derive(clap::Args)]
pub struct Wanted {
    /// A deck, or a sweep.toml that names one
    #[arg(value_name = "DECK")]
    file: PathBuf,
    /// Change a value of the deck for all points
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Vary a key: section.arm.EI=1e3,1e4 param.L=5:20:4 (four numbers from 5 to 20) param.k=1e3:1e6:4:log
    #[arg(long, value_name = "KEY=V1,V2,…")]
    vary: Vec<String>,
    /// Take the first values of all keys together, then the second, instead of each with each
    #[arg(long, conflicts_with = "sample")]
    zip: bool,
    /// Draw so many points from ranges (--vary param.L=5:20), spread evenly (Latin hypercube)
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..))]
    sample: Option<u32>,
    /// What random numbers begin with
    #[arg(long)]
    seed: Option<u64>,
    /// What is looked at: tip.uz (at the end) tip.uz:absmax (or max, min, mean, drift) tip.uz:0.5 (a time) tip.uz:load=0.5 (default: all
    /// columns at the end, and modes)
    #[arg(long = "output", value_name = "COLUMN[:WHEN]")]
    outputs: Vec<String>,
    /// Estimate the errors of these, from two coarser runs of each point
    #[arg(long)]
    error_bars: bool,
    /// Points at a time (default: one a core)
    #[arg(long, value_parser = say::threads, value_name = "N")]
    threads: Option<NonZero<usize>>,
    /// Folder of the results (default: results/<deck name>)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// What runs the points
    #[arg(long, value_enum, default_value_t)]
    engine: Engine,
    /// An option for sbatch: --sbatch=--partition=short
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Between looks at the queue of an engine
    #[arg(long, value_parser = say::duration, value_name = "TIME", default_value = "10s")]
    poll: Duration,
    #[command(flatten)]
    part: Part,
}

/// What runs the points of a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum Engine {
    /// The cores of this machine
    #[default]
    Local,
    /// A Slurm job array
    Slurm,
}

/// Parts of a sweep, for engines that run points as processes of their own.
#[derive(clap::Args)]
struct Part {
    /// Print the points, a line each, and run none
    #[arg(long, conflicts_with_all = ["only", "gather"])]
    list: bool,
    /// Run these points again, whatever is known of them, and write no table: 3 or 1-5,8
    #[arg(long, value_name = "POINTS", conflicts_with = "gather")]
    only: Option<String>,
    /// Run nothing, and write the table of what is known
    #[arg(long)]
    gather: bool,
    /// Run points that have failed once more
    #[arg(long)]
    redo: bool,
}

/// Runs a sweep, or a part of one.
pub fn sweep(wanted: &Wanted) -> Status {
    let mut verdict = Verdict::default();
    signals::caught();
    if let Err(refusal) = one(wanted, &mut verdict) {
        verdict.refuse(refusal);
    }
    verdict.finish(1)
}

fn one(wanted: &Wanted, verdict: &mut Verdict) -> Result<(), Refusal> {
    let plan = Plan::of(wanted)?;
    let part = &wanted.part;
    if part.list {
        list(&plan);
        return Ok(());
    }
    if let Some(words) = &part.only {
        let points = chosen(words, plan.sweep.points.len())?;
        let failed = local::run(&plan, &points, wanted.threads)?;
        tell_failures(failed, points.len(), verdict);
        return Ok(());
    }
    if !part.gather {
        let open = plan.open(part.redo);
        match wanted.engine {
            Engine::Local => local::run(&plan, &open, wanted.threads).map(|_| ())?,
            Engine::Slurm => slurm::run(&plan, &open, wanted)?,
        }
    }
    gather(&plan, verdict)
}

/// After points of which each has been named.
fn tell_failures(failed: usize, of: usize, verdict: &mut Verdict) {
    match stopped() {
        Some(status) => verdict.fail(status, FailureKind::Interrupted.name(), "what had ended is kept".into()),
        None if failed > 0 => verdict.fail(Status::GaveUp, "sweep", format!("{failed} of {of} points failed")),
        None => {}
    }
}

/// The exit status after a signal.
fn stopped() -> Option<Status> {
    signals::caught().map(Status::after)
}

fn list(plan: &Plan) {
    say::answer(&format!("point,{}", plan.sweep.keys.join(",")));
    let cell = |text: &String| {
        if text.contains([',', '"']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.clone() }
    };
    for (k, values) in plan.sweep.points.iter().enumerate() {
        say::answer(&format!("{},{}", k + 1, values.iter().map(cell).collect::<Vec<_>>().join(",")));
    }
}

/// `3`, `1-5,8`: points from 1, as numbers from 0.
fn chosen(words: &str, count: usize) -> Result<Vec<usize>, Refusal> {
    let wrong = || Refusal::usage(format!("--only {words}: points are numbers from 1 to {count}"));
    let mut points = Vec::new();
    for word in words.split(',') {
        let (from, to) = word.split_once('-').unwrap_or((word, word));
        let number =
            |text: &str| text.trim().parse::<usize>().ok().filter(|k| (1..=count).contains(k)).ok_or_else(wrong);
        let (from, to) = (number(from)?, number(to)?);
        if from > to {
            return Err(wrong());
        }
        points.extend(from - 1..to);
    }
    points.sort_unstable();
    points.dedup();
    if points.is_empty() { Err(wrong()) } else { Ok(points) }
}

/// Writes the table, and says what failed.
fn gather(plan: &Plan, verdict: &mut Verdict) -> Result<(), Refusal> {
    let outcomes = plan.sweep.gathered(&plan.store);
    let table = plan.sweep.to_csv(&outcomes).map_err(|error| Refusal::io(error.into()))?;
    PartFile::write(&plan.folder, "sweep.csv", &table).map_err(Refusal::io)?;
    tell(plan, &outcomes, verdict);
    Ok(())
}

fn tell(plan: &Plan, outcomes: &[Option<Outcome>], verdict: &mut Verdict) {
    let known: Vec<&Outcome> = outcomes.iter().flatten().collect();
    let finished = known.iter().filter(|outcome| outcome.finished()).count();
    // An empty sum is -0.0.
    let seconds = known.iter().map(|outcome| outcome.seconds).fold(0.0, |sum, seconds| sum + seconds);
    say::line(&format!(
        "{}: {finished} of {} points finished, {} of runs",
        plan.name,
        outcomes.len(),
        say::time(seconds)
    ));
    say::line(&format!("  {}", plan.folder.join("sweep.csv").display()));
    let mut failed: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (k, outcome) in outcomes.iter().enumerate() {
        match outcome {
            Some(outcome) if outcome.finished() => {}
            outcome => failed.entry(outcome.as_ref().map_or("missing", |o| &o.status)).or_default().push(k + 1),
        }
    }
    json::sweep(&plan.folder.join("sweep.csv"), outcomes.len(), finished, &failed);
    if failed.is_empty() {
        return;
    }
    let words = failed.iter().map(|(name, points)| {
        format!("{} `{name}` (point {}{})", points.len(), points[0], if points.len() > 1 { ", …" } else { "" })
    });
    let words = words.collect::<Vec<_>>().join(", ");
    let message = format!("{} of {} points did not finish: {words}", outcomes.len() - finished, outcomes.len());
    match stopped() {
        Some(status) => {
            say::note(&format!("{}: {} points are kept; the same command goes on after them", plan.name, known.len()));
            verdict.fail(status, FailureKind::Interrupted.name(), message);
        }
        None => verdict.fail(Status::GaveUp, "sweep", message),
    }
}
