//! `beamsim sweep`

mod alone;
mod local;
mod plan;
mod slurm;

use super::error::CommandError;
use super::status::Status;
use super::verdict::Verdict;
use super::{console, json, outputs, signals};
use crate::output::{OutputError, OutputKind, PartFile};
use crate::study::sweep::PointResult;
use beamsim_core::failure::FailureKind;
use plan::{Again, Plan};
use std::collections::BTreeMap;
use std::num::NonZero;
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `beamsim sweep`.
#[derive(clap::Args)]
pub struct SweepArguments {
    /// Deck, or a sweep.toml that names one
    #[arg(value_name = "DECK")]
    file: PathBuf,
    /// Change a value of the deck for all points
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Vary a key: section.arm.EI=1e3,1e4 param.L=5:20:4 (four numbers from 5 to 20)
    /// param.k=1e3:1e6:4:log
    #[arg(long, value_name = "KEY=V1,V2,…")]
    vary: Vec<String>,
    /// Combine the first values of all keys, then the second ones, and so on, instead of every
    /// value with every other
    #[arg(long, conflicts_with = "sample")]
    zip: bool,
    /// Draw COUNT random points from ranges (--vary param.L=5:20), spread evenly (Latin hypercube)
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..))]
    sample: Option<u32>,
    /// Random seed of --sample (default: 1)
    #[arg(long)]
    seed: Option<u64>,
    /// Output to record: tip.uz (at the end) tip.uz:absmax (or max, min, mean, drift) tip.uz:0.5
    /// (at a time) tip.uz:load=0.5 (default: all columns at the end, and modes)
    #[arg(long = "output", value_name = "COLUMN[:WHEN]")]
    outputs: Vec<String>,
    /// Estimate the errors of the outputs, from two more runs of each point
    #[arg(long)]
    error_bars: bool,
    /// Number of simultaneous points (default: one per core)
    #[arg(long, value_parser = console::threads, value_name = "N")]
    threads: Option<NonZero<usize>>,
    /// Folder of the results (default: results/<deck name>)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Where to run the points
    #[arg(long, value_enum, default_value_t)]
    engine: Engine,
    /// Option for sbatch: --sbatch=--partition=short
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Time between queue checks
    #[arg(long, value_parser = console::duration, value_name = "TIME", default_value = "10s")]
    poll: Duration,
    #[command(flatten)]
    part: Part,
}

/// Where the points of a sweep are run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum Engine {
    /// The cores of this machine
    #[default]
    Local,
    /// A Slurm job array
    Slurm,
}

/// Parts of a sweep, for engines that run each point in its own process.
#[derive(clap::Args)]
struct Part {
    /// Print the points, one per line, and run nothing
    #[arg(long, conflicts_with_all = ["only", "gather"])]
    list: bool,
    /// Run only these points, even if they have results, and write no table: 3 or 1-5,8
    #[arg(long, value_name = "POINTS", conflicts_with = "gather")]
    only: Option<String>,
    /// Run nothing, and write the table of the results so far
    #[arg(long)]
    gather: bool,
    /// Run failed points again
    #[arg(long)]
    redo: bool,
    /// Run points again whose process died
    #[arg(long)]
    retry: bool,
}

/// Runs a sweep, or a part of one.
pub fn sweep(wanted: &SweepArguments) -> Status {
    let mut verdict = Verdict::default();
    // A signal stops the points that are running; those that are done are saved.
    let _kept = signals::keep();
    if let Err(error) = one(wanted) {
        verdict.fail(error);
    }
    verdict.finish(1)
}

fn one(wanted: &SweepArguments) -> Result<(), CommandError> {
    let plan = Plan::of(wanted)?;
    let part = &wanted.part;
    if part.list {
        list(&plan);
        return Ok(());
    }
    if let Some(words) = &part.only {
        let points = chosen(words, plan.sweep.points.len())?;
        let failed = local::run(&plan, &points, wanted.threads, None)?;
        return failures(failed, points.len());
    }
    outputs::check_folder(&plan.folder, &[("sweep.csv", OutputKind::Sweep)])?;
    plan.store.clean();
    if !part.gather {
        // A job array is told from outside what it may take, and may succeed with more.
        let again = Again { failed: part.redo, killed: part.redo || part.retry || wanted.engine == Engine::Slurm };
        let open = plan.open(again);
        match wanted.engine {
            Engine::Local => local::run_all(&plan, &open, wanted)?,
            Engine::Slurm => slurm::run(&plan, &open, wanted)?,
        }
    }
    gather(&plan)
}

/// The error after points whose failures have been printed one by one.
fn failures(failed: usize, of: usize) -> Result<(), CommandError> {
    match signals::caught() {
        Some(signal) => Err(CommandError::Stopped { signal, message: "finished points are saved".into() }),
        None if failed > 0 => Err(CommandError::Sweep(format!("{failed} of {of} points failed"))),
        None => Ok(()),
    }
}

fn list(plan: &Plan) {
    console::answer(&format!("point,{}", plan.sweep.keys.join(",")));
    let cell = |text: &String| {
        if text.contains([',', '"']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.clone() }
    };
    for (k, values) in plan.sweep.points.iter().enumerate() {
        console::answer(&format!("{},{}", k + 1, values.iter().map(cell).collect::<Vec<_>>().join(",")));
    }
}

/// Reads `3` or `1-5,8`, points from 1, and gives numbers from 0.
fn chosen(words: &str, count: usize) -> Result<Vec<usize>, CommandError> {
    let wrong = || CommandError::Usage(format!("--only {words}: points are numbers from 1 to {count}"));
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

/// Writes the table of all points and prints a summary; an error where some did not finish.
fn gather(plan: &Plan) -> Result<(), CommandError> {
    let results = plan.sweep.gathered(&plan.store);
    let table = plan.sweep.to_csv(&results).map_err(OutputError::from)?;
    PartFile::write(&plan.folder, "sweep.csv", &table)?;
    summarise(plan, &results)
}

fn summarise(plan: &Plan, results: &[Option<PointResult>]) -> Result<(), CommandError> {
    let known: Vec<&PointResult> = results.iter().flatten().collect();
    let finished = known.iter().filter(|result| result.finished()).count();
    // An empty sum of floating-point numbers is -0.0.
    let seconds = known.iter().map(|result| result.seconds).fold(0.0, |sum, seconds| sum + seconds);
    console::line(&format!(
        "{}: {finished} of {} points finished, total run time {}",
        plan.name,
        results.len(),
        console::time(seconds)
    ));
    let table = plan.folder.join("sweep.csv");
    console::line(&format!("  {}", table.display()));
    let mut failed: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (k, result) in results.iter().enumerate() {
        match result {
            Some(result) if result.finished() => {}
            Some(result) => failed.entry(&result.status).or_default().push(k + 1),
            None => failed.entry("missing").or_default().push(k + 1),
        }
    }
    json::sweep(&table, results.len(), finished, &failed);
    console::count_warnings(known.iter().filter(|result| result.finished()).map(|result| result.warnings).sum());
    if failed.is_empty() {
        return Ok(());
    }
    let kinds = failed.iter().map(|(name, points)| {
        let more = if points.len() > 1 { format!(" and {} more", points.len() - 1) } else { String::new() };
        format!("{} `{name}` (point {}{more})", points.len(), points[0])
    });
    let kinds = kinds.collect::<Vec<_>>().join(", ");
    if failed.keys().eq([FailureKind::Deck.name()].iter()) && finished == 0 {
        let why = known.first().map_or("", |result| &result.message);
        return Err(CommandError::deck(format!("no point can be run: {why}")));
    }
    if failed.contains_key(PointResult::KILLED) {
        console::note("hint: points that were killed are tried again with --retry");
    }
    let message = format!("{} of {} points did not finish: {kinds}", results.len() - finished, results.len());
    match signals::caught() {
        Some(signal) => {
            let count = known.len();
            console::note(&format!("{}: {count} points are saved; run the command again to continue", plan.name));
            Err(CommandError::Stopped { signal, message })
        }
        None => Err(CommandError::Sweep(message)),
    }
}
