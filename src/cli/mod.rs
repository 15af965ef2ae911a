//! The command line: one file a subcommand.

mod accuracy;
mod check;
mod compare;
mod cost;
mod effects;
mod json;
mod load;
mod plot;
mod progress;
mod report;
mod run;
mod say;
mod signals;
mod sweep;
mod verify;
mod words;

use crate::scene::Scene;
use beamsim_core::failure::{Cause, FailureKind};
use beamsim_core::run::Failure;
use clap::{CommandFactory, Parser, Subcommand};
use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;

const AFTER_HELP: &str = "Exit status: 0 fine; 1 an expectation or comparison failed; 2 the deck or the command line is \
                          wrong; 3 the numerics gave up; 4 a file could not be read or written; 5 an accuracy was not reached; 130 or \
                          143 interrupted.";

/// Simulates slender parts that bend, twist and spin far.
#[derive(Parser)]
#[command(version, about, after_help = AFTER_HELP)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    manner: say::Manner,
}

/// A deck and changes to it.
#[derive(clap::Args)]
struct DeckArguments {
    /// Decks (TOML)
    #[arg(required = true, value_name = "DECK")]
    decks: Vec<PathBuf>,
    /// Change a value of the deck: param.L=12, stage.0.step=0.01, section.leg.EA=2e6
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

#[derive(Subcommand)]
enum Command {
    /// Simulate decks and write histories
    #[command(
        after_help = "Examples:\n  beamsim run arm.toml --set section.rod.EI=50 --report\n  beamsim run arm.toml --accuracy 1e-3\n  beamsim --json run arm.toml | jq .counters.iterations"
    )]
    Run {
        #[command(flatten)]
        input: DeckArguments,
        #[command(flatten)]
        target: accuracy::Target,
        /// Folder of the results (default: results/<deck name>)
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Read a deck and tell what would be simulated
    #[command(after_help = "Example:\n  beamsim check arm.toml")]
    Check {
        #[command(flatten)]
        input: DeckArguments,
    },
    /// Run decks and hold the results against their [[expect]] tables
    #[command(after_help = "Examples:\n  beamsim verify decks\n  beamsim verify arm.toml --out results")]
    Verify {
        #[command(flatten)]
        input: DeckArguments,
        /// Also write the results, as `run` does
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Compare a history with a stored one
    #[command(after_help = "Example:\n  beamsim compare results/arm/history.csv stored.csv --rtol 1e-6")]
    Compare {
        /// The history
        a: PathBuf,
        /// The stored one
        b: PathBuf,
        /// Allowed relative difference
        #[arg(long, default_value_t = 1e-9)]
        rtol: f64,
        /// Allowed absolute difference
        #[arg(long, default_value_t = 1e-12)]
        atol: f64,
    },
    /// Tell what accuracy costs in time: many runs of a deck with other elements, orders and steps
    #[command(
        after_help = "Examples:\n  beamsim cost arm.toml --budget 60s\n  beamsim cost arm.toml --vary elements=1,2,4 --vary order=1,2,3"
    )]
    Cost {
        #[command(flatten)]
        input: DeckArguments,
        #[command(flatten)]
        wanted: cost::Wanted,
        /// Folder of the results (default: results/<deck name>)
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Draw histories as a picture (SVG)
    #[command(
        after_help = "Examples:\n  beamsim plot results/arm --column tip.uz\n  beamsim plot results/soft results/stiff --column tip.uz --reference measured.csv"
    )]
    Plot {
        #[command(flatten)]
        wanted: plot::Wanted,
    },
    /// Write a page that plays a run back, with its histories, energies, effects and deck
    #[command(after_help = "Example:\n  beamsim report results/arm")]
    Report {
        /// Folders of results
        #[arg(required = true, value_name = "RESULTS")]
        folders: Vec<PathBuf>,
        /// The page (default: report.html in the folder)
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Take each effect out in turn and tell what it changes and costs
    #[command(after_help = "Example:\n  beamsim effects arm.toml --tolerance 1e-2")]
    Effects {
        #[command(flatten)]
        input: DeckArguments,
        /// Largest change of any output that leaving effects out may make, relative to the largest value of its kind
        #[arg(long, default_value_t = 1e-3)]
        tolerance: f64,
        /// Folder of the results (default: results/<deck name>)
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Run many variants of one deck and write one table of what came of them
    #[command(
        after_help = "Examples:\n  beamsim sweep arm.toml --vary section.rod.EI=50:200:4 --vary param.L=1,2\n  beamsim sweep arm.toml --vary param.L=1:3 --sample 200 --seed 7 --output tip.uz:absmax\n  beamsim sweep arm.toml --vary param.L=1:3:1000 --engine slurm --sbatch=--partition=short"
    )]
    Sweep {
        #[command(flatten)]
        wanted: sweep::Wanted,
    },
    /// Write a commented deck to begin with
    #[command(after_help = "Example:\n  beamsim new rotating-blade --out blade.toml")]
    New {
        /// Of what
        #[arg(value_enum, default_value_t)]
        template: words::Template,
        /// The file (default: <template>.toml)
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Tell what a key or a table of the deck means
    #[command(after_help = "Examples:\n  beamsim explain stage.scheme\n  beamsim explain deck")]
    Explain {
        /// `elements`, `beam.elements`, `[[beam]]`; `deck` for all tables
        key: String,
    },
    /// Print the JSON Schema of the deck, for editors
    #[command(after_help = "Example:\n  beamsim schema > beamsim.schema.json")]
    Schema,
    /// Print completions for a shell
    #[command(after_help = "Example:\n  beamsim completions bash > ~/.local/share/bash-completion/completions/beamsim")]
    Completions {
        /// The shell
        #[arg(value_enum)]
        shell: clap_complete::Shell,
    },
    /// Print the manual page, or write one for each command
    #[command(after_help = "Example:\n  beamsim manual --out ~/.local/share/man/man1")]
    Manual {
        /// The folder they are written to
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

/// How a command ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// Fine
    #[default]
    Fine = 0,
    /// An expectation or comparison failed
    Unexpected = 1,
    /// The deck or the command line is wrong
    Wrong = 2,
    /// The numerics gave up
    GaveUp = 3,
    /// A file could not be read or written
    Io = 4,
    /// An accuracy was not reached; the results are the best that were found
    Missed = 5,
    /// SIGINT
    Interrupted = 130,
    /// SIGTERM
    Terminated = 143,
}

impl Status {
    /// The exit status that belongs to a kind of failures.
    pub fn of(kind: FailureKind) -> Self {
        match kind.cause() {
            Cause::Deck => Self::Wrong,
            Cause::Numerics => Self::GaveUp,
            Cause::File => Self::Io,
            Cause::Signal => Self::Interrupted,
        }
    }

    /// The exit status that belongs to a failure of a run.
    pub fn of_failure(failure: &Failure) -> Self {
        match failure {
            Failure::Interrupted { signal, .. } => Self::after(*signal),
            other => Self::of(other.kind()),
        }
    }

    /// The exit status of a process that a signal ended.
    pub fn after(signal: i32) -> Self {
        if signal == 15 { Self::Terminated } else { Self::Interrupted }
    }
}

/// How many runs at a time: as many as are wanted, or one a core.
fn cores(wanted: Option<NonZero<usize>>) -> usize {
    wanted.or(std::thread::available_parallelism().ok()).map_or(1, NonZero::get)
}

/// The threads of one run: those that are wanted, or one a core, as far as the scene has use for them.
fn threads_of(scene: &Scene, wanted: Option<NonZero<usize>>) -> usize {
    cores(wanted).min(scene.plan.model.regions())
}

/// Threads in words, where there are several.
fn on_threads(count: usize) -> String {
    if count > 1 { format!(" on {count} threads") } else { String::new() }
}

/// The outcome of a command over several decks: its status is the worst, and its last line names it.
#[derive(Default)]
pub struct Verdict {
    status: Status,
    worst: Option<(&'static str, String)>,
}

impl Verdict {
    /// Something failed: it is said at once.
    pub fn fail(&mut self, status: Status, name: &'static str, message: String) {
        say::error(name, &message);
        if status > self.status {
            self.status = status;
            self.worst = Some((name, message));
        }
    }

    /// A deck that could not be read.
    pub fn refuse(&mut self, refusal: load::Refusal) {
        if !refusal.details.is_empty() {
            say::note(&refusal.details);
        }
        self.fail(refusal.status, refusal.name, refusal.message);
    }

    /// The status; where other words may have followed, the worst failure is said once more.
    pub fn finish(self, decks: usize) -> Status {
        if let Some((name, message)) = self.worst.filter(|_| decks > 1) {
            say::error(name, &message);
        }
        self.status
    }
}

/// Parses the command line and runs the command.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return ExitCode::from(explain(&error) as u8),
    };
    say::in_manner(arguments.manner);
    let status = match arguments.command {
        Command::Run { input, target, out } => run::run(&input.decks, &input.set, &target, out.as_deref()),
        Command::Check { input } => check::check(&input.decks, &input.set),
        Command::Verify { input, out } => verify::verify(&input.decks, &input.set, out.as_deref()),
        Command::Compare { a, b, rtol, atol } => compare::compare(&a, &b, rtol, atol),
        Command::Cost { input, wanted, out } => cost::cost(&input.decks, &input.set, &wanted, out.as_deref()),
        Command::Plot { wanted } => plot::plot(&wanted),
        Command::Report { folders, out } => report::report(&folders, out.as_deref()),
        Command::Effects { input, tolerance, out } => {
            effects::effects(&input.decks, &input.set, tolerance, out.as_deref())
        }
        Command::Sweep { wanted } => sweep::sweep(&wanted),
        Command::New { template, out } => words::new(template, out.as_deref()),
        Command::Explain { key } => words::explain(&key),
        Command::Schema => words::schema(),
        Command::Completions { shell } => words::completions(shell, Arguments::command()),
        Command::Manual { out } => words::manual(Arguments::command(), out.as_deref()),
    };
    ExitCode::from(denied(status) as u8)
}

/// Warnings of a run that ended well may count as a failure.
fn denied(status: Status) -> Status {
    let count = say::warnings();
    if status != Status::Fine || !say::denies_warnings() || count == 0 {
        return status;
    }
    say::error("warnings", &format!("{count} warning(s), which --deny-warnings takes for a failure"));
    Status::Unexpected
}

/// Help and version are answers; anything else is a wrong command line.
fn explain(error: &clap::Error) -> Status {
    let text = error.render();
    if error.exit_code() == 0 {
        say::answer(text.to_string().trim_end());
        return Status::Fine;
    }
    let text = text.to_string();
    if error.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        say::note(text.trim_end());
        say::error("usage", "a command is needed");
        return Status::Wrong;
    }
    let (first, rest) = text.split_once('\n').unwrap_or((&text, ""));
    if !rest.trim().is_empty() {
        say::note(rest.trim());
    }
    say::error("usage", first.trim_start_matches("error: "));
    Status::Wrong
}
