//! `beamsim manual`

use super::error::CommandError;
use super::status::Status;
use super::{console, outputs};
use crate::output::OutputKind;
use beamsim_core::failure::FailureKind;
use std::path::Path;

/// Prints the manual page, or writes one page per command into a folder.
pub fn manual(command: clap::Command, folder: Option<&Path>) -> Status {
    let page = |command: &clap::Command| {
        let mut text = Vec::new();
        clap_mangen::Man::new(command.clone()).render(&mut text).map(|()| text)
    };
    if let Some(Err(error)) = folder.map(check_pages) {
        error.print();
        return error.status();
    }
    let done = match folder {
        None => page(&command).map(|text| console::answer(String::from_utf8_lossy(&text).trim_end())),
        Some(folder) => std::fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(command, folder)),
    };
    match done {
        Ok(()) => Status::Fine,
        Err(error) => {
            console::error(FailureKind::Io.name(), &error.to_string());
            Status::Io
        }
    }
}

/// Refuses a folder in which files of others have the names of manual pages.
fn check_pages(folder: &Path) -> Result<(), CommandError> {
    outputs::check_folder(folder, &[])?;
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with("beamsim") && name.ends_with(".1") {
            outputs::check_file(&entry.path(), OutputKind::Manual)?;
        }
    }
    Ok(())
}
