//! Checks and runs decks with the program itself, as a user would.

use super::generate::Corpus;
use super::input::Input;
use super::inspect::whole_text;
use super::process::{self, Ended};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The program.
const BEAMSIM: &str = env!("CARGO_BIN_EXE_beamsim");

/// Predicted duration from which on a deck is not run, in seconds.
const LONGEST: f64 = 0.3;

/// The outcome of a deck.
#[derive(Clone, Debug, PartialEq)]
pub enum Trial {
    /// It ran to its end.
    Finished,
    /// The run failed, with a name and a place.
    Failed,
    /// SIGTERM ended the run after the time limit.
    Stopped,
    /// `check` refused it.
    Refused,
    /// Not run: it would take longer than the limit.
    TooLong,
    /// A fault of the program
    Fault(String),
}

/// Checks a deck with `beamsim check`, and runs it if it is short.
pub fn try_deck(input: &Input, corpus: &Corpus, folder: &Path) -> io::Result<Trial> {
    let deck = folder.join("deck.toml");
    fs::create_dir_all(folder)?;
    // The program has the same names of tables in the folder as the corpus has.
    let text = if input.table.is_some() || input.text.contains("csv") { whole_text(input, corpus).ok() } else { None };
    fs::write(&deck, text.as_ref().unwrap_or(&input.text))?;
    let settings = if text.is_some() { &[][..] } else { &input.settings[..] };
    let command = |name: &str| {
        let mut command = process::limited(Path::new(BEAMSIM));
        command.args(["--json", name]).arg(&deck);
        command.args(settings.iter().flat_map(|setting| ["--set", setting]));
        command
    };
    let checked = process::run(command("check"), folder)?;
    if let Some(fault) = ending(&checked, "check") {
        return Ok(Trial::Fault(fault));
    }
    if checked.asked {
        return Ok(Trial::Stopped);
    }
    if checked.code != Some(0) {
        return Ok(Trial::Refused);
    }
    let summary: serde_json::Value = serde_json::from_str(&checked.stdout).unwrap_or_default();
    let Some(seconds) = summary["seconds"].as_f64() else {
        return Ok(Trial::Fault(format!("check, no predicted duration: {}", checked.stdout.trim())));
    };
    if seconds > LONGEST {
        return Ok(Trial::TooLong);
    }
    let results = folder.join("results");
    let _ = fs::remove_dir_all(&results);
    let mut run: Command = command("run");
    run.arg("--out").arg(&results);
    let ended = process::run(run, folder)?;
    Ok(match (ending(&ended, "run"), ended.code) {
        (Some(fault), _) => Trial::Fault(fault),
        (None, Some(0)) => not_finite(&results)?.map_or(Trial::Finished, Trial::Fault),
        // A refusal with a moment depends on the state that was reached: `check` cannot foresee it.
        (None, Some(2)) if !last_line(&ended).contains("(stage ") => {
            let reason = ended.stderr.lines().find(|line| line.starts_with("error")).unwrap_or_default();
            Trial::Fault(format!("check accepts what run refuses: {reason}"))
        }
        (None, _) if ended.asked => Trial::Stopped,
        (None, _) => Trial::Failed,
    })
}

/// The fault that the end of a command shows: an end by itself, or an error without name or place.
fn ending(ended: &Ended, command: &str) -> Option<String> {
    if let Some(fault) = ended.fault() {
        return Some(format!("{command}, {fault}"));
    }
    let last = last_line(ended);
    match ended.code {
        Some(0) | None => None,
        Some(143) if ended.asked => None,
        Some(2 | 3) => {
            let (name, message) =
                last.strip_prefix("error[").and_then(|line| line.split_once("]: ")).unwrap_or_default();
            let has_place = message.contains("stage ") || message.contains('"') || message.contains(".toml");
            (name.is_empty() || !has_place).then(|| format!("{command}, an error without name or place: {last}"))
        }
        Some(code) => Some(format!("{command}, exit status {code}: {last}")),
    }
}

fn last_line(ended: &Ended) -> &str {
    ended.stderr.lines().rfind(|line| !line.trim().is_empty()).unwrap_or_default()
}

/// The first number in the results that is not finite, with its file and its column.
fn not_finite(results: &Path) -> io::Result<Option<String>> {
    let record = fs::read_to_string(results.join("run.json"))?;
    if let Err(error) = serde_json::from_str::<serde_json::Value>(&record) {
        return Ok(Some(format!("run.json: {error}")));
    }
    let mut files: Vec<PathBuf> = fs::read_dir(results)?.flatten().map(|entry| entry.path()).collect();
    files.sort();
    for file in files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "csv")) {
        let mut reader = csv::Reader::from_path(file).map_err(io::Error::other)?;
        let names = reader.headers().map_err(io::Error::other)?.clone();
        for record in reader.records() {
            let record = record.map_err(io::Error::other)?;
            let wrong = record.iter().position(|cell| cell.parse().is_ok_and(|number: f64| !number.is_finite()));
            if let Some(column) = wrong {
                let file = file.file_name().unwrap_or_default().display();
                return Ok(Some(format!("not finite in {file}: column {} is {}", &names[column], &record[column])));
            }
        }
    }
    Ok(None)
}
