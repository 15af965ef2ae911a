//! A point in a process of its own: if it dies, the sweep goes on.

use super::SweepArguments;
use super::plan::Plan;
use crate::cli::error::CommandError;
use crate::cli::{console, signals};
use crate::output::OutputError;
use crate::study::sweep::PointResult;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// Time between looks at the process.
const POLL: Duration = Duration::from_millis(20);

/// Runs a point (from 0) in a process of its own, which saves its result. If the process dies by
/// itself, the point is recorded as killed; if somebody else ends it, the point stays open.
pub fn run_alone(plan: &Plan, point: usize, wanted: &SweepArguments) -> Result<(), CommandError> {
    let program = std::env::current_exe().map_err(|error| OutputError::file(Path::new("beamsim"), error))?;
    let failed = |error| CommandError::from(OutputError::file(&program, error));
    let kills = kills_for_memory();
    let mut command = Command::new(&program);
    command.args(plan.words(wanted)?).args(["--threads", "1", "--only", &(point + 1).to_string()]);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().map_err(failed)?;
    let Some(ended) = wait(&mut child).map_err(failed)? else { return Ok(()) };
    if plan.known(point).is_some_and(|result| result.status != PointResult::KILLED) {
        return Ok(());
    }
    let number = point + 1;
    let Some(why) = own_death(ended, kills_for_memory() > kills) else {
        console::note(&format!("point {number}: its process ended without a result ({ended}); the point stays open"));
        return Ok(());
    };
    console::note(&format!("point {number}: {}: {why}", PointResult::KILLED));
    plan.keep(point, &PointResult::failed(PointResult::KILLED, why))
}

/// Waits for the end of a process; `None` after a signal to this one, which ends the other, too.
fn wait(child: &mut Child) -> std::io::Result<Option<ExitStatus>> {
    loop {
        if let Some(ended) = child.try_wait()? {
            return Ok(Some(ended));
        }
        if signals::caught().is_some() {
            // It writes its result completely or not at all.
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        sleep(POLL);
    }
}

/// The way in which a process died by itself; `None` if it ended in order, or by a signal from
/// outside.
#[cfg(unix)]
fn own_death(ended: ExitStatus, killed_for_memory: bool) -> Option<String> {
    use std::os::unix::process::ExitStatusExt;
    /// Signals that a process gets by its own fault.
    const OWN: [(i32, &str); 6] = [
        (4, "an illegal instruction"),
        (5, "a trap"),
        (6, "an abort, as after a failed allocation of memory"),
        (7, "a bus error"),
        (8, "an arithmetic exception"),
        (11, "a segmentation fault, as after an overflow of the stack"),
    ];
    const SIGKILL: i32 = 9;
    let signal = ended.signal()?;
    if signal == SIGKILL && killed_for_memory {
        return Some("the process died alone: the system killed it for lack of memory".into());
    }
    let (_, name) = OWN.into_iter().find(|(own, _)| *own == signal)?;
    Some(format!("the process died alone by {name} (signal {signal})"))
}

/// The way in which a process died by itself; `None` if it ended in order.
#[cfg(not(unix))]
fn own_death(ended: ExitStatus, _: bool) -> Option<String> {
    /// Exit statuses of the program are below this one.
    const LARGEST_STATUS: i32 = 255;
    let code = ended.code()?;
    let died = !(0..=LARGEST_STATUS).contains(&code);
    died.then(|| format!("the process died alone with status {code:#x}"))
}

/// How many processes the system has killed for lack of memory, if it tells.
fn kills_for_memory() -> u64 {
    let text = std::fs::read_to_string("/proc/vmstat").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("oom_kill "));
    line.and_then(|count| count.trim().parse().ok()).unwrap_or(0)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::process::ExitStatusExt;

    #[test]
    fn only_a_death_by_itself_is_one() {
        for signal in [6, 11] {
            assert!(own_death(ExitStatus::from_raw(signal), false).is_some(), "{signal}");
        }
        for signal in [1, 2, 9, 15] {
            assert!(own_death(ExitStatus::from_raw(signal), false).is_none(), "{signal}");
        }
        assert!(own_death(ExitStatus::from_raw(9), true).is_some());
        // Exit statuses 3 and 0.
        assert!(own_death(ExitStatus::from_raw(3 << 8), true).is_none());
        assert!(own_death(ExitStatus::from_raw(0), false).is_none());
    }
}
