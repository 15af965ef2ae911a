//! Reads, checks and runs many wrong and odd inputs: the program may refuse them, but must not fall.
//!
//! `docs/reliability.md` has the commands, and the list of faults that are looked for.

mod generate;
mod input;
mod inspect;
mod process;
mod program;
mod random;
mod session;

use input::Input;
use session::Session;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The options of the command line.
struct Options {
    seed: u64,
    inputs: u64,
    runs: usize,
    jobs: usize,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let number = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1)?.parse::<u64>().ok()
    };
    let files = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        Some(arguments[at + 1..].iter().map(PathBuf::from).collect::<Vec<_>>())
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let options = Options {
        seed: number("--seed").unwrap_or(1),
        inputs: number("--inputs").unwrap_or(1_000),
        runs: number("--runs").unwrap_or(10) as usize,
        jobs: number("--jobs").unwrap_or(cores as u64).max(1) as usize,
    };
    if arguments.iter().any(|argument| argument == "--worker") {
        let first = number("--from").unwrap_or(0);
        let step = number("--step").unwrap_or(1) as usize;
        session::work(root, options.seed, (first..options.inputs).step_by(step));
        return ExitCode::SUCCESS;
    }
    if let Some(files) = files("--inspect") {
        return session::inspect_files(root, &files);
    }
    if let Some(files) = files("--replay") {
        return replay(root, &files);
    }
    // `cargo test NAME` passes NAME to every test program, and `cargo test -- --list` asks for names.
    let filter = arguments
        .iter()
        .enumerate()
        .find(|(k, a)| !a.starts_with('-') && (*k == 0 || !arguments[k - 1].starts_with("--")));
    if filter.is_some_and(|(_, name)| !"fuzz".contains(name.as_str())) || arguments.iter().any(|a| a == "--list") {
        return ExitCode::SUCCESS;
    }
    Session::new(root, options).run().unwrap_or_else(|error| {
        println!("fuzz: stopped: {error}");
        ExitCode::FAILURE
    })
}

/// Shows what becomes of inputs that were written to files.
fn replay(root: &Path, paths: &[PathBuf]) -> ExitCode {
    let options = Options { seed: 0, inputs: 0, runs: 0, jobs: 1 };
    let session = Session::new(root, options);
    let mut faults = 0;
    for path in paths {
        match Input::read(path).and_then(|input| session.judge(&input)) {
            Ok(None) => println!("{}: no fault", path.display()),
            Ok(Some(fault)) => {
                println!("{}: {fault}", path.display());
                faults += 1;
            }
            Err(error) => {
                println!("{}: {error}", path.display());
                faults += 1;
            }
        }
    }
    if faults == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
