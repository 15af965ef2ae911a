//! The command line: one file a subcommand.

mod accuracy;
mod check;
mod compare;
mod completions;
mod console;
mod cost;
mod effects;
mod error;
mod explain;
mod folders;
mod import;
mod json;
mod load;
mod manual;
mod new;
mod outputs;
mod picture;
mod plot;
mod plot_profile;
mod plotted;
mod progress;
mod report;
mod restart;
mod run;
mod schema;
mod section;
mod section_stress;
mod signals;
mod simulate;
mod status;
mod sweep;
mod thread_count;
mod variant;
mod verdict;
mod verify;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use error::CommandError;
use status::Status;
use std::path::PathBuf;
use std::process::ExitCode;

const START: &str = "A deck is a text file that describes beams, supports, loads and stages. To begin:\n  beamsim new                     writes the deck cantilever.toml\n  beamsim run cantilever.toml     simulates it, and says where the results are";
const AFTER_HELP: &str = "Exit status: 0 success; 1 an expectation or comparison failed; 2 the deck or the command line is \
                          wrong; 3 the simulation failed; 4 a file could not be read or written; 5 an accuracy was not reached; 129, \
                          130 or 143 interrupted.";

/// Simulates slender parts with large deflections and rotations.
#[derive(Parser)]
#[command(version, about, after_help = format!("{START}\n\n{AFTER_HELP}"))]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    print_options: console::PrintOptions,
    /// Also replace plain files that beamsim did not write
    #[arg(long, global = true)]
    force: bool,
}

/// Decks and changes to them.
#[derive(clap::Args)]
struct DeckArguments {
    /// Decks (TOML files)
    #[arg(required = true, value_name = "DECK")]
    decks: Vec<PathBuf>,
    /// Change a value of the deck; may be repeated: param.L=12, section.leg.EA=2e6, stage.0.step=0.01
    /// (the first [[stage]])
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
        wanted: accuracy::RunArguments,
        /// Folder of the results (default: results/<deck name>)
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Check a deck and show what would be simulated
    #[command(after_help = "Example:\n  beamsim check arm.toml")]
    Check {
        #[command(flatten)]
        input: DeckArguments,
    },
    /// Run decks, or all decks in folders, and compare the results with the values in their [[expect]]
    /// tables
    #[command(after_help = "Examples:\n  beamsim verify decks\n  beamsim verify arm.toml --out results")]
    Verify {
        #[command(flatten)]
        input: DeckArguments,
        /// Also write the results, as `run` does
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Compare a history with a stored one, column by column
    #[command(after_help = "Example:\n  beamsim compare results/arm/history.csv stored.csv --rtol 1e-6")]
    Compare {
        /// History (CSV)
        a: PathBuf,
        /// Stored history (CSV); its columns are compared
        b: PathBuf,
        /// Allowed difference relative to the stored value
        #[arg(long, default_value = "1e-9")]
        rtol: f64,
        /// Allowed absolute difference, added to the relative one
        #[arg(long, default_value = "1e-12")]
        atol: f64,
    },
    /// Run a deck with many meshes and steps, and find the cheapest for each accuracy
    #[command(
        after_help = "Examples:\n  beamsim cost arm.toml --budget 60s\n  beamsim cost arm.toml --vary elements=1,2,4 --vary order=1,2,3"
    )]
    Cost {
        #[command(flatten)]
        input: DeckArguments,
        #[command(flatten)]
        wanted: cost::CostArguments,
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
        wanted: picture::PlotArguments,
    },
    /// Show the properties of sections (stiffness, mass, centres), and draw those that are computed from
    /// their shape
    #[command(
        after_help = "Examples:\n  beamsim section frame.toml\n  beamsim section blade.toml root --set section.root.mesh=1e-5"
    )]
    Section {
        #[command(flatten)]
        wanted: section::SectionArguments,
    },
    /// Write a page for a browser that plays a run back, with its histories, energies, effects and deck
    #[command(after_help = "Example:\n  beamsim report results/arm")]
    Report {
        /// Folders of results
        #[arg(required = true, value_name = "RESULTS")]
        folders: Vec<PathBuf>,
        /// File of the page (default: report.html in the folder)
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Leave out each effect (rotary inertia, shear, …) in turn and show how results and run time change
    #[command(after_help = "Example:\n  beamsim effects arm.toml --tolerance 1e-2")]
    Effects {
        #[command(flatten)]
        input: DeckArguments,
        /// Largest change of the outputs by effects that count as negligible, relative to the largest
        /// displacement, rotation, … of the run
        #[arg(long, default_value = "1e-3")]
        tolerance: f64,
        /// Folder of the results (default: results/<deck name>)
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Run a deck with many values of its keys (a point for each combination), and write one table of
    /// results
    #[command(
        after_help = "Examples:\n  beamsim sweep arm.toml --vary section.rod.EI=50:200:4 --vary param.L=1,2\n  beamsim sweep arm.toml --vary param.L=1:3 --sample 200 --seed 7 --output tip.uz:absmax\n  beamsim sweep arm.toml --vary param.L=1:3:1000 --engine slurm --sbatch=--partition=short"
    )]
    Sweep {
        #[command(flatten)]
        wanted: sweep::SweepArguments,
    },
    /// Write a commented starter deck
    #[command(after_help = "Example:\n  beamsim new rotating-blade --out blade.toml")]
    New {
        /// Which template
        #[arg(value_enum, default_value_t)]
        template: new::Template,
        /// File of the deck (default: <template>.toml)
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Write a deck from the files of another program
    #[command(after_help = "Example:\n  beamsim import beamdyn blade_primary.dat driver.inp --out blade.toml")]
    Import {
        #[command(subcommand)]
        from: import::From,
    },
    /// Explain a key, a table or a word of the deck, or a column of the results
    #[command(
        after_help = "Examples:\n  beamsim explain stage.scheme\n  beamsim explain cylindrical\n  beamsim explain tip.uz\n  beamsim explain deck"
    )]
    Explain {
        /// Key (elements, beam.elements), table ([[beam]]), word (cylindrical, limit_point) or column
        /// (tip.uz); `deck` lists all tables
        name: String,
    },
    /// Print the JSON Schema of the deck, for editors
    #[command(after_help = "Example:\n  beamsim schema > beamsim.schema.json")]
    Schema,
    /// Print completions for a shell
    #[command(after_help = "Example:\n  beamsim completions bash > ~/.local/share/bash-completion/completions/beamsim")]
    Completions {
        /// Which shell
        #[arg(value_enum)]
        shell: clap_complete::Shell,
    },
    /// Print the manual page, or write one page per command
    #[command(after_help = "Example:\n  beamsim manual --out ~/.local/share/man/man1")]
    Manual {
        /// Folder for one page per command
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

/// Parses the command line and runs the command.
pub fn main() -> ExitCode {
    signals::outlive_file_limits();
    let arguments = match parse() {
        Ok(arguments) => arguments,
        Err(error) => return ExitCode::from(after_printing(usage(error)) as u8),
    };
    signals::listen();
    console::configure(arguments.print_options);
    outputs::configure(arguments.force);
    let status = match arguments.command {
        Command::Run { input, wanted, out } => run::run(&input.decks, &input.set, &wanted, out.as_deref()),
        Command::Check { input } => check::check(&input.decks, &input.set),
        Command::Verify { input, out } => verify::verify(&input.decks, &input.set, out.as_deref()),
        Command::Compare { a, b, rtol, atol } => compare::compare(&a, &b, rtol, atol),
        Command::Cost { input, wanted, out } => cost::cost(&input.decks, &input.set, &wanted, out.as_deref()),
        Command::Plot { wanted } => plot::plot(&wanted),
        Command::Section { wanted } => section::section(&wanted),
        Command::Report { folders, out } => report::report(&folders, out.as_deref()),
        Command::Effects { input, tolerance, out } => {
            effects::effects(&input.decks, &input.set, tolerance, out.as_deref())
        }
        Command::Sweep { wanted } => sweep::sweep(&wanted),
        Command::New { template, out } => new::new(template, out.as_deref()),
        Command::Import { from } => import::import(&from),
        Command::Explain { name } => explain::explain(&name),
        Command::Schema => schema::schema(),
        Command::Completions { shell } => completions::completions(shell, Arguments::command()),
        Command::Manual { out } => manual::manual(Arguments::command(), out.as_deref()),
    };
    ExitCode::from(after_printing(with_warnings(status)) as u8)
}

/// The exit status, which is at least that of a file that could not be written if standard output
/// could not take everything.
fn after_printing(status: Status) -> Status {
    let Some(error) = console::stdout_error() else { return status };
    let error = CommandError::Io(format!("standard output: {error}"));
    error.print();
    status.max(error.status())
}

/// The command line. A negative number is the value of the option before it.
fn parse() -> Result<Arguments, clap::Error> {
    let mut command = Arguments::command().mut_subcommands(|subcommand| {
        subcommand.mut_args(|argument| {
            let is_option = !argument.is_positional() && argument.get_action().takes_values();
            if is_option { argument.allow_negative_numbers(true) } else { argument }
        })
    });
    let matches = command.try_get_matches_from_mut(std::env::args_os());
    // It stays in memory: to free its thousands of small pieces takes a tenth of the start.
    std::mem::forget(command);
    Arguments::from_arg_matches(&matches?)
}

/// The exit status with `--deny-warnings`: a success with warnings becomes a failure.
fn with_warnings(status: Status) -> Status {
    let count = console::warnings();
    if status != Status::Fine || !console::denies_warnings() || count == 0 {
        return status;
    }
    let error = CommandError::Warnings(count);
    error.print();
    error.status()
}

/// Prints help and version, which clap returns as errors too; everything else is a wrong command
/// line.
fn usage(mut error: clap::Error) -> Status {
    if error.kind() == ErrorKind::UnknownArgument {
        advise(&mut error);
    }
    let text = error.render().to_string();
    if error.exit_code() == 0 {
        console::answer(text.trim_end());
        return Status::Fine;
    }
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        console::notes(text.trim_end());
        console::error("usage", "a command is needed");
        return Status::Wrong;
    }
    let (first, rest) = text.split_once('\n').unwrap_or((&text, ""));
    if !rest.trim().is_empty() {
        console::notes(rest.trim());
    }
    console::error("usage", first.trim_start_matches("error: "));
    Status::Wrong
}

/// Replaces the advice to write `-- -5s`, which would make a deck of a value that begins with `-`.
fn advise(error: &mut clap::Error) {
    let Some(ContextValue::StyledStrs(mut tips)) = error.remove(ContextKind::Suggested) else { return };
    tips.retain(|tip| !tip.to_string().starts_with("to pass "));
    let argument = error.get(ContextKind::InvalidArg).map_or(String::new(), ToString::to_string);
    if argument.strip_prefix('-').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit() || c == '.')) {
        tips.push("join a value that begins with `-` to its option by `=`, such as --option=-1e-3".into());
    }
    if !tips.is_empty() {
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(tips));
    }
}
