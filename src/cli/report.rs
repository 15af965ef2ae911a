//! `beamsim report`: the page of results that exist already.

use super::error::CommandError;
use super::simulate::{RunExtras, simulate};
use super::status::Status;
use super::thread_count::threads_of;
use super::verdict::Verdict;
use super::{console, json, load, outputs, signals};
use crate::deck::{self, Severity, Unreadable};
use crate::output::{Film, OutputError, OutputKind, Record, Report, filmed_rows, read_history};
use crate::scene::{self, Scene};
use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};

/// Writes report.html into folders of results.
pub fn report(folders: &[PathBuf], out: Option<&Path>) -> Status {
    let mut verdict = Verdict::default();
    if out.is_some() && folders.len() > 1 {
        verdict.fail(CommandError::Usage("--out names one file: give one folder of results".into()));
        return verdict.finish(1);
    }
    for folder in folders {
        if let Err(error) = one(folder, out) {
            verdict.fail(error);
        }
        if signals::caught().is_some() {
            break;
        }
    }
    verdict.finish(folders.len())
}

fn one(folder: &Path, out: Option<&Path>) -> Result<(), CommandError> {
    let path = out.map_or_else(|| folder.join("report.html"), Path::to_path_buf);
    outputs::check_file(&path, OutputKind::Page)?;
    let record = Record::read(folder)?;
    let Some(text) = record.text() else {
        let error = OutputError::content(folder, "run.json contains no deck: run the deck again");
        return Err(error.into());
    };
    let text = with_tables(text, &record, folder)?;
    let scene = scene::from_text(&text).map(|(scene, _)| scene).map_err(|_| unreadable(folder))?;
    let name = fs::canonicalize(folder).ok().map_or("results".into(), |path| load::folder_name(&path));
    // The history holds only the requested nodes; the shapes come from another run of the deck.
    let film = Film::of(&scene);
    let film = if record.is_interrupted() { film.until(filmed_rows(&read_history(folder)?, &record)) } else { film };
    let film = filmed(&scene, &name, film)?;
    write(&scene, &name, &record, film, folder, &path)
}

/// The error of a deck that another version of the program stored.
fn unreadable(folder: &Path) -> CommandError {
    let folder = folder.display();
    CommandError::deck(format!("{folder}: this version of beamsim cannot read the stored deck: run the deck again"))
}

/// The text of a deck with the rows of the tables beside it, which must be those of the run.
fn with_tables(text: &str, record: &Record, folder: &Path) -> Result<String, CommandError> {
    let changed = RefCell::new(None);
    let open = |name: &str| {
        let Some(stored) = record.tables().iter().find(|table| table.csv == name) else {
            let message = "the run did not read this table".into();
            return Err(Unreadable { message, severity: Severity::Error });
        };
        let message = match load::table(Path::new(&stored.path)) {
            Ok(content) if deck::fingerprint(&content) == stored.hash => return Ok(content),
            Ok(_) => format!("{}: the table has changed since the run", stored.path),
            Err(error) => error.message,
        };
        changed.replace(Some(message.clone()));
        Err(Unreadable { message, severity: Severity::File })
    };
    let imported = deck::import(text, &open);
    match (imported, changed.into_inner()) {
        (Ok(imported), _) => Ok(imported.text),
        (Err(_), Some(why)) => Err(CommandError::Io(format!("{why}: run the deck again"))),
        (Err(_), None) => Err(unreadable(folder)),
    }
}

fn filmed(scene: &Scene, name: &str, film: Film) -> Result<Film, CommandError> {
    let extras = RunExtras { film: Some(film), ..RunExtras::default() };
    let finished = simulate(scene, name, None, None, extras, threads_of(scene, None));
    if let Some(signal) = signals::caught() {
        let message = "stopped before the report was written".into();
        return Err(CommandError::Stopped { signal, message });
    }
    finished.film.ok_or_else(|| CommandError::Io("no shapes of the structure were recorded".into()))
}

/// Writes the page and prints its path.
pub fn write(
    scene: &Scene,
    name: &str,
    record: &Record,
    film: Film,
    results: &Path,
    path: &Path,
) -> Result<(), CommandError> {
    let title = scene.title.as_deref().unwrap_or(name);
    let has_shapes = Report { title, record }.write(results, film, path)?;
    if !has_shapes {
        console::count_warnings(1);
        console::note(&format!(
            "warning: {}: without shapes, since the deck run again does not pass through the rows of the history: the run was \
             resumed with other steps or rows. Run the deck again with --report",
            path.display()
        ));
    }
    console::line(&format!("  {}", path.display()));
    json::wrote("report", path);
    Ok(())
}
