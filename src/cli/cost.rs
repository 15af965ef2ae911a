//! `beamsim cost`

use super::accuracy::study_error;
use super::error::CommandError;
use super::folders::{check_names, folder};
use super::load::Loaded;
use super::progress::Progress;
use super::status::Status;
use super::thread_count::cores;
use super::variant::{describe, paste_lines};
use super::verdict::Verdict;
use super::{console, json, load, outputs, signals};
use crate::deck::Accuracy;
use crate::output::{Axis, HistoryReader, Level, Line, LinePlot, LineStyle, OutputError, OutputKind, PartFile, Scale};
use crate::study::cost::{
    Against, CostRun, CostStudy, Expected, Family, Journal, Limit, Order, Orders, StudyOptions, study,
};
use beamsim_core::sorting::sort_by;
use std::collections::BTreeMap;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A run of the frontier is printed where its error is below this part of the error of the printed
/// run before; the table has all.
const PRINTED_IMPROVEMENT: f64 = 0.9;

/// Arguments of `beamsim cost` besides the decks.
#[derive(clap::Args)]
pub struct CostArguments {
    /// Values to try, as in [cost]: order=1,2 elements=1,2,4 interpolation=relative
    /// scheme=newmark,hht step=1,0.5 (multiples of the deck's step)
    #[arg(long, value_name = "KEY=V1,V2,…")]
    vary: Vec<String>,
    /// Print the lines of the deck that reach this error at the lowest cost
    #[arg(long, value_name = "ERROR", default_value = "1e-3")]
    accuracy: f64,
    /// Start no run after this time: 90s, 5m, 1h. Skipped runs are listed; run the command again to
    /// finish them
    #[arg(long, value_parser = console::duration, value_name = "TIME")]
    budget: Option<Duration>,
    /// The reference for errors: a stored history (CSV), or `expect` for the values in [[expect]]
    /// (default: runs finer than all others)
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Number of simultaneous runs (default: one per core)
    #[arg(long, value_parser = console::threads, value_name = "N")]
    threads: Option<NonZero<usize>>,
}

/// Studies decks one after the other.
pub fn cost(decks: &[PathBuf], settings: &[String], wanted: &CostArguments, out: Option<&Path>) -> Status {
    let mut verdict = Verdict::default();
    if let Err(error) = check_arguments(wanted).and_then(|()| check_names(decks)) {
        verdict.fail(error);
        return verdict.finish(1);
    }
    let settings: Vec<String> = settings.iter().cloned().chain(wanted.vary.iter().map(|vary| setting(vary))).collect();
    for path in decks {
        let name = load::name(path);
        let folder = folder(out, &name, decks.len() > 1);
        let done = load::deck(path, &settings).and_then(|loaded| one(&name, path, &loaded, wanted, &folder));
        if let Err(error) = done {
            verdict.fail(error);
        }
        if signals::caught().is_some() {
            break;
        }
    }
    verdict.finish(decks.len())
}

/// The file of the runs of a study that was stopped.
const JOURNAL: &str = "cost.journal";

fn check_arguments(wanted: &CostArguments) -> Result<(), CommandError> {
    Accuracy::check(wanted.accuracy).map_err(|why| CommandError::Usage(format!("--accuracy: {why}")))?;
    match wanted.vary.iter().find(|vary| !vary.contains('=')) {
        Some(vary) => Err(CommandError::Usage(format!("--vary {vary}: expected KEY=V1,V2,…"))),
        None => Ok(()),
    }
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

fn one(name: &str, path: &Path, loaded: &Loaded, wanted: &CostArguments, folder: &Path) -> Result<(), CommandError> {
    outputs::check_folder(folder, &[("cost.csv", OutputKind::Cost), ("cost.svg", OutputKind::Svg)])?;
    let (against, given) = reference(wanted.reference.as_deref())?;
    let identity = format!("beamsim {}\n{given}\n{}", env!("CARGO_PKG_VERSION"), loaded.text);
    // A signal stops the study, and the journal has the runs that are done.
    let _kept = signals::keep();
    let mut journal = Journal::open(folder, JOURNAL, &identity)?;
    if !journal.is_empty() {
        console::note(&format!("{name}: continues a stopped study, {} runs are done", journal.len()));
    }
    let mut progress = Progress::new(name);
    let mut show =
        |done: usize, all: usize| progress.show(done as f64 / all as f64, || format!("{done} of {all} runs"));
    let options = StudyOptions {
        threads: cores(wanted.threads),
        budget: wanted.budget,
        interrupted: &signals::caught,
        progress: &mut show,
        journal: &mut journal,
    };
    let found = study(&loaded.text, &loaded.deck, &loaded.scene, &against, options);
    progress.done();
    if signals::caught().is_some() && !journal.is_empty() {
        console::note(&format!("{name}: {} runs are saved; run the command again to continue", journal.len()));
    }
    let found = found.map_err(|error| study_error(error, path, loaded))?;
    print_study(name, loaded, &found, wanted.accuracy);
    write_results(name, loaded, &found, folder)?;
    if let Some(error) = journal.write_error() {
        console::note(&format!("warning[io]: the runs could not be saved to continue later: {error}"));
    }
    let is_complete = |run: &CostRun| run.trial.is_some() && (!run.frontier || run.timing.alone > 0);
    if found.runs.iter().all(is_complete) {
        journal.close()?;
    }
    Ok(())
}

/// The reference that is asked for, and a text that tells it from others.
fn reference(word: Option<&Path>) -> Result<(Against, String), CommandError> {
    match word {
        None => Ok((Against::Finest, String::new())),
        Some(word) if word.as_os_str() == "expect" => Ok((Against::Expectations, "expect".into())),
        Some(path) => {
            let table = HistoryReader::read(path)?;
            if let Some(why) = table.first_not_finite() {
                return Err(CommandError::Usage(format!("--reference {}: {why}", path.display())));
            }
            let identity = format!("{table:?}");
            Ok((Against::Table(table), identity))
        }
    }
}

/// Writes cost.csv and, where some run can be compared, cost.svg.
fn write_results(name: &str, loaded: &Loaded, found: &CostStudy, folder: &Path) -> Result<(), CommandError> {
    let table = found.to_csv().map_err(OutputError::from)?;
    write(folder, "cost.csv", &table)?;
    if found.runs.iter().any(|run| run.frontier) {
        let title = loaded.scene.title.as_deref().unwrap_or(name);
        write(folder, "cost.svg", plot(title, found).as_bytes())?;
    }
    Ok(())
}

fn write(folder: &Path, name: &str, content: &[u8]) -> Result<(), CommandError> {
    PartFile::write(folder, name, content)?;
    let path = folder.join(name);
    console::line(&format!("  {}", path.display()));
    json::wrote("cost", &path);
    Ok(())
}

fn print_study(name: &str, loaded: &Loaded, found: &CostStudy, accuracy: f64) {
    console::line(&format!("{name}: {}", loaded.scene.title.as_deref().unwrap_or("(no title)")));
    print_measure(found);
    print_runs(found);
    console::line(&format!("  {:>9}  {:>10}  {:>6}  {:<10} with", "error", "cpu", "spread", "limited by"));
    let mut printed = f64::INFINITY;
    for run in frontier(found) {
        if run.error < PRINTED_IMPROVEMENT * printed {
            printed = run.error;
            print_run(run, found);
        }
    }
    print_orders(&found.orders);
    print_lines(loaded, found, accuracy);
}

fn print_measure(found: &CostStudy) {
    let of = match found.outputs.len() {
        1 => found.columns[found.outputs[0]].clone(),
        count => format!("the worst of {count} outputs"),
    };
    let how = found.norm.described();
    console::line(&format!("  error of {of}: {how}, relative to the largest value of its kind"));
    if found.ends_only {
        console::line(
            "  compared only at the ends of stages, because steps adapt ([output] interval would give common instants)",
        );
    }
    let sure = match found.reference.uncertainty {
        0.0 => "taken as exact".into(),
        uncertainty => format!("uncertain by {uncertainty:.1e}"),
    };
    console::line(&format!("  reference: {}; {sure}", found.reference.made));
}

/// Prints the number of runs, and how those ended that did not finish.
fn print_runs(found: &CostStudy) {
    let mut failed: BTreeMap<&str, usize> = BTreeMap::new();
    for run in &found.runs {
        let status = run.trial.as_ref().map_or("skipped", |trial| &trial.status);
        if status != "finished" {
            *failed.entry(status).or_default() += 1;
        }
    }
    let failed: Vec<String> = failed.iter().map(|(status, count)| format!(", {count} {status}")).collect();
    console::line(&format!("  {} runs{}", found.runs.len(), failed.concat()));
    if found.runs.iter().any(|run| run.trial.is_none()) {
        console::line("  run the command again to finish the skipped runs, with another --budget or none");
    }
}

/// The runs of the frontier, the least accurate first.
fn frontier(found: &CostStudy) -> Vec<&CostRun> {
    let mut runs: Vec<&CostRun> = found.runs.iter().filter(|run| run.frontier).collect();
    sort_by(&mut runs, |a, b| b.error.total_cmp(&a.error));
    runs
}

fn print_run(run: &CostRun, found: &CostStudy) {
    let resolution = found.reference.resolution();
    let error = if run.error < resolution { format!("< {resolution:.1e}") } else { format!("{:.1e}", run.error) };
    let limit = run.limit.map_or("", |limit| limit.name());
    let spread = if run.timing.alone > 1 { format!("{:.0} %", 100.0 * run.timing.spread) } else { "–".into() };
    let cpu = console::time(run.timing.seconds.cpu);
    console::line(&format!("  {error:>9}  {cpu:>10}  {spread:>6}  {limit:<10} {}", describe(&run.variant)));
}

fn print_orders(orders: &[Orders]) {
    if orders.iter().all(|o| o.space.is_none() && o.time.is_none()) {
        return;
    }
    console::line("  observed (and expected) orders of convergence");
    for Orders { family, space, time } in orders {
        let parts =
            [space.map(|order| describe_order("space", order)), time.map(|order| describe_order("time", order))];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        console::line(&format!("    {:<22} {}", family.name(), parts.join("; ")));
    }
}

fn describe_order(of: &str, order: Order) -> String {
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

/// Prints the lines of the cheapest deck that reaches an accuracy.
fn print_lines(loaded: &Loaded, found: &CostStudy, accuracy: f64) {
    let Some(run) = frontier(found).into_iter().find(|run| run.error <= accuracy) else {
        let finest = frontier(found).pop().and_then(|run| run.limit);
        let advice = match finest {
            Some(_) | None if found.reference.resolution() > accuracy => "the reference is not accurate enough",
            Some(Limit::Step) => "try smaller steps, --vary step=0.25,0.125,0.0625",
            Some(Limit::Newton) => "try a smaller `tolerance` of the stages",
            Some(Limit::Mesh) | None => "try finer meshes, --vary elements=4,8,16",
        };
        return console::line(&format!("  no run reaches {accuracy:e}: {advice}"));
    };
    console::line(&format!(
        "  {accuracy:e} costs {}: {}",
        console::time(run.timing.seconds.cpu),
        describe(&run.variant)
    ));
    paste_lines(&loaded.deck, &run.settings()).iter().for_each(|line| console::line(&format!("    {line}")));
}

/// The plot of error over CPU time: a line for each family through its best runs, marks for its
/// other runs, and the best runs of all families in the background.
fn plot(title: &str, found: &CostStudy) -> String {
    let mut families: Vec<&Family> = Vec::new();
    for run in &found.runs {
        if !families.contains(&&run.variant.family) {
            families.push(&run.variant.family);
        }
    }
    let best = Line {
        name: "best of all".into(),
        points: frontier(found).into_iter().map(cost_and_error).collect(),
        bars: None,
        beside: Vec::new(),
        style: LineStyle::Background,
    };
    let of_families = families.iter().enumerate().map(|(number, family)| family_line(found, family, number));
    let of_families = of_families.filter(|line| !line.points.is_empty());
    let outputs = match &found.outputs[..] {
        [one] => found.columns[*one].clone(),
        several => format!("{} outputs", several.len()),
    };
    let axis = |title: String| Axis { title, scale: Scale::Logarithmic };
    LinePlot {
        title: title.into(),
        x: axis("CPU time [s]".into()),
        y: axis(format!("relative error of {outputs}")),
        lines: std::iter::once(best).chain(of_families).collect(),
        level: Some(Level { value: found.reference.resolution(), name: "reference uncertainty".into() }),
        boundaries: Vec::new(),
    }
    .to_svg()
}

/// The point of a run: CPU seconds and relative error.
fn cost_and_error(run: &CostRun) -> (f64, f64) {
    (run.timing.seconds.cpu, run.error)
}

/// The line of a family: its runs that are more accurate than all cheaper ones are joined, its
/// other runs are marks.
fn family_line(found: &CostStudy, family: &Family, number: usize) -> Line {
    let is_drawn = |run: &&CostRun| run.variant.family == *family && run.error > 0.0;
    let mut runs: Vec<&CostRun> = found.runs.iter().filter(is_drawn).collect();
    sort_by(&mut runs, |a, b| a.timing.seconds.cpu.total_cmp(&b.timing.seconds.cpu));
    let mut least_error = f64::INFINITY;
    let (best, others): (Vec<&CostRun>, Vec<&CostRun>) = runs.into_iter().partition(|run| {
        let is_better = run.error < least_error;
        least_error = least_error.min(run.error);
        is_better
    });
    Line {
        name: family.name(),
        points: best.into_iter().map(cost_and_error).collect(),
        bars: None,
        beside: others.into_iter().map(cost_and_error).collect(),
        style: LineStyle::Marked(number),
    }
}
