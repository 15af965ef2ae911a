//! Runs programs with limits on memory and time.

use std::fs::{self, File};
use std::io;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Address space of a process beside its scene, in KiB.
const MEMORY_KIB: u64 = 512 << 10;

/// Time after which a process is asked to end (SIGTERM), and time in which it must then end.
pub const PATIENCE: Duration = Duration::from_secs(5);

/// Processor time in seconds that a process has taken so far, in which a crowded machine does not
/// count; `None` where the system does not tell.
pub fn processor_seconds(child: &Child) -> Option<f64> {
    // Fields 14 and 15 (user and system time), counted from behind the name in parentheses; in
    // hundredths of a second on all Linux systems.
    let stat = fs::read_to_string(format!("/proc/{}/stat", child.id())).ok()?;
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some((user + system) / 100.0)
}

/// A process that has ended.
pub struct Ended {
    /// Its exit status; `None` after a signal
    pub code: Option<i32>,
    /// The signal that ended it
    pub signal: Option<i32>,
    /// True if it was asked to end
    pub asked: bool,
    /// True if it did not end when it was asked to
    pub hangs: bool,
    /// Standard output
    pub stdout: String,
    /// Standard error
    pub stderr: String,
}

impl Ended {
    /// The fault that the end of the process shows.
    pub fn fault(&self) -> Option<String> {
        let panic = panic_of(&self.stderr);
        if self.hangs {
            return Some(format!("hang: it did not end within {PATIENCE:?} after SIGTERM"));
        }
        match (self.code, self.signal) {
            (Some(101), _) => Some(panic.unwrap_or("panic".into())),
            (None, Some(signal)) if !self.asked => {
                let last = self.stderr.lines().rfind(|line| !line.trim().is_empty()).unwrap_or_default();
                Some(panic.unwrap_or(format!("signal {signal}: {last}")))
            }
            (Some(_), _) | (None, _) => None,
        }
    }
}

/// The place and the message of a panic, on one line.
pub fn panic_of(text: &str) -> Option<String> {
    let (_, panic) = text.split_once("panicked at ")?;
    Some(format!("panic at {}", panic.lines().take(2).collect::<Vec<_>>().join(" ")))
}

/// A command with limited address space, where the system has a shell that limits it.
pub fn limited(program: &Path) -> Command {
    if !cfg!(unix) {
        return Command::new(program);
    }
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -v \"$0\" 2>/dev/null; exec \"$@\"", &MEMORY_KIB.to_string()]).arg(program);
    command
}

/// Runs a command to its end. Its output goes to files in `folder` first.
pub fn run(mut command: Command, folder: &Path) -> io::Result<Ended> {
    fs::create_dir_all(folder)?;
    let files = [folder.join("stdout"), folder.join("stderr")];
    command.stdin(Stdio::null()).stdout(File::create(&files[0])?).stderr(File::create(&files[1])?);
    let mut child = command.spawn()?;
    let mut end = wait(&mut child, PATIENCE)?;
    let asked = end.is_none();
    if asked {
        terminate(&child)?;
        end = wait(&mut child, PATIENCE)?;
    }
    let hangs = end.is_none();
    let status = match end {
        Some(status) => status,
        None => {
            child.kill()?;
            child.wait()?
        }
    };
    let [stdout, stderr] = files.map(|file| fs::read(file).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()));
    Ok(Ended { code: status.code(), signal: signal(status), asked, hangs, stdout: stdout?, stderr: stderr? })
}

fn wait(child: &mut Child, limit: Duration) -> io::Result<Option<ExitStatus>> {
    let begun = Instant::now();
    let mut pause = Duration::from_micros(500);
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if begun.elapsed() > limit {
            return Ok(None);
        }
        thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(20));
    }
}

#[cfg(unix)]
fn terminate(child: &Child) -> io::Result<()> {
    Command::new("kill").arg(child.id().to_string()).status().map(drop)
}

#[cfg(unix)]
fn signal(status: ExitStatus) -> Option<i32> {
    std::os::unix::process::ExitStatusExt::signal(&status)
}

#[cfg(not(unix))]
fn terminate(_: &Child) -> io::Result<()> {
    Ok(())
}

#[cfg(not(unix))]
fn signal(_: ExitStatus) -> Option<i32> {
    None
}
