//! `beamsim report`: the page of results that are there.

use super::load::Refusal;
use super::run::{Beyond, simulate};
use super::{Status, Verdict, json, load, say, signals, threads_of};
use crate::output::{Film, Record, Report};
use crate::scene::{self, Scene};
use beamsim_core::failure::FailureKind;
use std::fs;
use std::path::{Path, PathBuf};

/// Writes report.html into folders of results.
pub fn report(folders: &[PathBuf], out: Option<&Path>) -> Status {
    let mut verdict = Verdict::default();
    if out.is_some() && folders.len() > 1 {
        verdict.fail(Status::Wrong, "usage", "--out names one file: give one folder of results".into());
        return verdict.finish(1);
    }
    for folder in folders {
        if let Err(refusal) = one(folder, out) {
            verdict.refuse(refusal);
        }
        if signals::caught().is_some() {
            break;
        }
    }
    verdict.finish(folders.len())
}

fn one(folder: &Path, out: Option<&Path>) -> Result<(), Refusal> {
    let record = Record::read(folder).map_err(Refusal::io)?;
    let Some(text) = record.text() else {
        let message = format!("{}: run.json holds no deck: run it again", folder.display());
        return Err(Refusal::of(FailureKind::Io, message));
    };
    let scene = scene::from_text(text).map(|(scene, _)| scene).map_err(|_| {
        let message = format!("{}: this version of beamsim does not read the deck: run it again", folder.display());
        Refusal::of(FailureKind::Deck, message)
    })?;
    let name = fs::canonicalize(folder).ok().map_or("results".into(), |path| load::name(&path));
    // A history holds the nodes that were asked for; the shape is that of the same run once more.
    let film = filmed(&scene, &name)?;
    let path = out.map_or_else(|| folder.join("report.html"), Path::to_path_buf);
    write(&scene, &name, &record, film, folder, &path)
}

fn filmed(scene: &Scene, name: &str) -> Result<Film, Refusal> {
    let beyond = Beyond { film: Some(Film::of(scene)), ..Beyond::default() };
    let finished = simulate(scene, name, None, None, beyond, threads_of(scene, None));
    if signals::caught().is_some() {
        let status = finished.status();
        return Err(Refusal::with_status(
            status,
            FailureKind::Interrupted.name(),
            "stopped before the report was written".into(),
        ));
    }
    finished.film.ok_or_else(|| Refusal::of(FailureKind::Io, "nothing was filmed".into()))
}

/// Writes the page, and says where.
pub fn write(
    scene: &Scene,
    name: &str,
    record: &Record,
    film: Film,
    results: &Path,
    path: &Path,
) -> Result<(), Refusal> {
    let title = scene.title.as_deref().unwrap_or(name);
    let written = Report { title, record }.write(results, film, path);
    written.map_err(Refusal::io)?;
    say::line(&format!("  {}", path.display()));
    json::wrote("report", path);
    Ok(())
}
