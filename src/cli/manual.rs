//! `beamsim manual`

use super::console;
use super::status::Status;
use std::path::Path;

/// Prints the manual page, or writes one page per command into a folder.
pub fn manual(command: clap::Command, folder: Option<&Path>) -> Status {
    let page = |command: &clap::Command| {
        let mut text = Vec::new();
        clap_mangen::Man::new(command.clone()).render(&mut text).map(|()| text)
    };
    let done = match folder {
        None => page(&command).map(|text| console::answer(String::from_utf8_lossy(&text).trim_end())),
        Some(folder) => std::fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(command, folder)),
    };
    match done {
        Ok(()) => Status::Fine,
        Err(error) => {
            console::error("io", &error.to_string());
            Status::Io
        }
    }
}
