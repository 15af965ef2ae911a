//! `beamsim completions`

use super::console;
use super::status::Status;

/// Prints completions of the command line for a shell.
pub fn completions(shell: clap_complete::Shell, mut command: clap::Command) -> Status {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut command, "beamsim", &mut text);
    console::answer(String::from_utf8_lossy(&text).trim_end());
    Status::Fine
}
