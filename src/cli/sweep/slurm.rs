//! Points as tasks of a Slurm job array.
//!
//! A point has ended when its file of results exists, whatever Slurm says. The array is named after
//! the sweep and its folder, so that the command, when it is run again, follows a running array
//! instead of submitting it twice. The queue is asked for by this name, since Slurm forgets jobs,
//! and without accounting, which many clusters lack.

use super::SweepArguments;
use super::plan::Plan;
use crate::cli::error::CommandError;
use crate::cli::progress::Progress;
use crate::cli::{console, signals};
use crate::output::{OutputError, PartFile};
use crate::study::sweep::PointResult;
use beamsim_core::threads;
use std::collections::HashMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

/// Largest number of tasks of an array where Slurm does not tell its limit.
const DEFAULT_MAX_TASKS: usize = 1000;

/// Queue checks after which a point without a file is given up: a shared file system shows files of
/// other machines late.
const MAX_CHECKS_WITHOUT_FILE: usize = 3;

/// Time between checks for a signal.
const SIGNAL_CHECK: Duration = Duration::from_millis(50);

/// Time between checks whether a process has ended that has closed its outputs.
const EXIT_CHECK: Duration = Duration::from_millis(5);

/// States of a task that has ended.
const ENDED: [&str; 10] = [
    "COMPLETED",
    "FAILED",
    "CANCELLED",
    "TIMEOUT",
    "OUT_OF_MEMORY",
    "NODE_FAIL",
    "BOOT_FAIL",
    "DEADLINE",
    "PREEMPTED",
    "REVOKED",
];

/// Submits points (numbers from 0), or follows the array that was submitted before, until all
/// points have ended.
pub fn run(plan: &Plan, points: &[usize], wanted: &SweepArguments) -> Result<(), CommandError> {
    let array =
        Array { plan, name: format!("beamsim-{}", plan.fingerprint()), folder: absolute(&plan.folder)?.join("slurm") };
    let under_way = array.states()?.values().any(|state| is_open(state));
    if points.is_empty() && !under_way {
        return Ok(());
    }
    let tasks = if under_way {
        console::note(&format!("{}: follows the running array `{}`", plan.name, array.name));
        array.submitted()?
    } else {
        array.submit(points, wanted)?
    };
    array.follow(&tasks, wanted.poll)
}

struct Array<'a> {
    plan: &'a Plan,
    name: String,
    folder: PathBuf,
}

impl Array<'_> {
    /// Writes the files of the tasks, and submits the array.
    fn submit(&self, points: &[usize], wanted: &SweepArguments) -> Result<Vec<Vec<usize>>, CommandError> {
        let each = points.len().div_ceil(largest_array());
        let tasks: Vec<Vec<usize>> = points.chunks(each).map(<[usize]>::to_vec).collect();
        let words = |task: &Vec<usize>| task.iter().map(|k| (k + 1).to_string()).collect::<Vec<_>>().join(",");
        let lines: String = tasks.iter().map(|task| words(task) + "\n").collect();
        unless_stopped("sbatch")?;
        // Tasks fail at once where the folder of their logs is missing.
        fs::create_dir_all(self.folder.join("log")).map_err(|error| io(&self.folder, error))?;
        self.write("tasks", &lines)?;
        self.write("array.sh", &self.script(wanted)?)?;
        let log = self.folder.join("log").display().to_string().replace('%', "%%");
        let mut command = Command::new("sbatch");
        command.args(["--parsable", "--no-requeue"]).arg(format!("--array=0-{}", tasks.len() - 1));
        command.arg(format!("--job-name={}", self.name)).arg(format!("--output={log}/%a.txt"));
        command.args(&wanted.sbatch).arg(self.folder.join("array.sh"));
        // Results of an earlier run must not be taken for results of this one.
        for &point in points {
            self.plan.store.forget(&self.plan.sweep.identity(point))?;
        }
        let answer = output(&mut command)?;
        let job = answer.lines().last().unwrap_or("").split(';').next().unwrap_or("").trim().to_string();
        console::note(&format!(
            "{}: {} points in {} tasks of the Slurm job {job}, `{}`",
            self.plan.name,
            points.len(),
            tasks.len(),
            self.name
        ));
        Ok(tasks)
    }

    fn write(&self, name: &str, content: &str) -> Result<(), CommandError> {
        Ok(PartFile::write(&self.folder, name, content.as_bytes())?)
    }

    /// The script of a task, which runs the points of its line in the file of tasks.
    fn script(&self, wanted: &SweepArguments) -> Result<String, CommandError> {
        let program = std::env::current_exe().map_err(|error| io(Path::new("beamsim"), error))?;
        let words = [vec![program.display().to_string()], self.plan.words(wanted)?].concat();
        let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
        let tasks = quoted(&self.folder.join("tasks").display().to_string());
        Ok(format!(
            "#!/bin/sh\nexec {} --threads 1 --only \"$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" {tasks})\"\n",
            words.join(" ")
        ))
    }

    /// The points of the tasks that were submitted before.
    fn submitted(&self) -> Result<Vec<Vec<usize>>, CommandError> {
        let path = self.folder.join("tasks");
        let text = fs::read_to_string(&path).map_err(|error| io(&path, error))?;
        let points =
            |line: &str| line.split(',').filter_map(|word| word.parse::<usize>().ok()?.checked_sub(1)).collect();
        Ok(text.lines().map(points).collect())
    }

    /// The state of each task that Slurm still knows.
    fn states(&self) -> Result<HashMap<usize, String>, CommandError> {
        let mut command = Command::new("squeue");
        command.args(["--me", "-h", "-r", "-t", "all", "-n", &self.name, "-o", "%K|%T"]);
        let listed = output(&mut command)?;
        let mut states: HashMap<usize, String> = HashMap::new();
        for (task, state) in listed.lines().filter_map(|line| line.trim().split_once('|')) {
            let Ok(task) = task.parse() else { continue };
            // An ended task of an earlier array with this name may still be listed.
            let known = states.entry(task).or_default();
            if known.is_empty() || is_open(state) {
                *known = state.into();
            }
        }
        Ok(states)
    }

    /// Waits until every point has ended or is given up.
    fn follow(&self, tasks: &[Vec<usize>], poll: Duration) -> Result<(), CommandError> {
        let mut progress = Progress::new(&self.plan.name);
        let mut open: Vec<(usize, usize)> = tasks
            .iter()
            .enumerate()
            .flat_map(|(task, points)| points.iter().map(move |&point| (task, point)))
            .collect();
        let count = open.len();
        let mut gone: HashMap<usize, usize> = HashMap::new();
        while !open.is_empty() && wait(poll) {
            let states = match self.states() {
                Ok(states) => states,
                Err(CommandError::Stopped { .. }) => break,
                Err(error) => {
                    // The queue could not be read: the next check may succeed.
                    progress.note(&format!("warning[{}]: {error}", error.name()));
                    continue;
                }
            };
            open.retain(|&(_, point)| !self.has_ended(point));
            for &(task, point) in &open {
                let state = states.get(&task).map_or("", String::as_str);
                let checks = gone.entry(point).or_default();
                *checks = if states.contains_key(&task) && is_open(state) { 0 } else { *checks + 1 };
                if *checks > MAX_CHECKS_WITHOUT_FILE {
                    self.give_up(point, state)?;
                }
            }
            open.retain(|(_, point)| gone.get(point).is_none_or(|&checks| checks <= MAX_CHECKS_WITHOUT_FILE));
            let running = states.values().filter(|state| *state == "RUNNING").count();
            let done = count - open.len();
            progress
                .show(done as f64 / count as f64, || format!("{done} of {count} points, {running} tasks are running"));
        }
        progress.done();
        if signals::caught().is_some() {
            console::note(&format!(
                "{}: the array is still running; run the command again to follow it, or end it by `scancel --me -n {}`",
                self.plan.name, self.name
            ));
        }
        Ok(())
    }

    fn has_ended(&self, point: usize) -> bool {
        self.plan.known(point).is_some_and(|result| result.status != PointResult::KILLED)
    }

    /// Marks a point as killed: its task has ended without a result.
    fn give_up(&self, point: usize, state: &str) -> Result<(), CommandError> {
        if self.has_ended(point) {
            return Ok(());
        }
        let message =
            if state.is_empty() { "Slurm no longer lists its task".into() } else { format!("Slurm: {state}") };
        console::note(&format!("point {}: {}: {message}", point + 1, PointResult::KILLED));
        self.plan.keep(point, &PointResult::failed(PointResult::KILLED, message))
    }
}

fn is_open(state: &str) -> bool {
    // States may have more words: `CANCELLED by 1000`. A task in an unknown state may still run.
    !ENDED.contains(&state.split(' ').next().unwrap_or(state))
}

/// Waits; `false` after a signal.
fn wait(time: Duration) -> bool {
    let end = Instant::now() + time;
    while Instant::now() < end && signals::caught().is_none() {
        sleep(SIGNAL_CHECK.min(time));
    }
    signals::caught().is_none()
}

/// The largest number of tasks of an array: Slurm numbers them from 0 to MaxArraySize - 1.
fn largest_array() -> usize {
    let config = output(Command::new("scontrol").args(["show", "config"])).unwrap_or_default();
    let line = config.lines().find(|line| line.trim_start().starts_with("MaxArraySize"));
    let number = line.and_then(|line| line.split('=').nth(1)?.trim().parse::<usize>().ok());
    number.filter(|&number| number > 1).map_or(DEFAULT_MAX_TASKS, |number| number - 1)
}

fn output(command: &mut Command) -> Result<String, CommandError> {
    let name = command.get_program().to_string_lossy().into_owned();
    let refuse = |why: String| CommandError::Io(format!("{name}: {why}"));
    unless_stopped(&name)?;
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|error| refuse(format!("{error}; is Slurm installed here?")))?;
    let out = child.stdout.take();
    let errors = child.stderr.take();
    let printed = threads::unless_interrupted(move || Printed::read(out, errors));
    match printed.zip(wait_for(&mut child)) {
        Some((Printed { answer, .. }, true)) => Ok(answer),
        Some((Printed { complaint, .. }, false)) => Err(refuse(complaint.trim().to_string())),
        None => {
            // It may hang: Slurm's controller does not answer, or a file system.
            let _ = child.kill();
            let _ = child.wait();
            unless_stopped(&name)?;
            Err(refuse("it was lost before it ended".into()))
        }
    }
}

/// What a process has printed.
struct Printed {
    /// Standard output
    answer: String,
    /// Standard error
    complaint: String,
}

impl Printed {
    /// Reads both outputs of a process to their ends.
    fn read(out: Option<impl Read + Send>, errors: Option<impl Read + Send>) -> Self {
        thread::scope(|scope| {
            let complaint = scope.spawn(|| read(errors));
            Self { answer: read(out), complaint: complaint.join().unwrap_or_default() }
        })
    }
}

/// Reads a pipe to its end.
fn read(pipe: Option<impl Read>) -> String {
    let mut bytes = Vec::new();
    // What came before an error is there.
    let _ = pipe.map(|mut pipe| pipe.read_to_end(&mut bytes));
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Waits for a process that has closed its outputs: true if it was successful, `None` after a
/// signal.
fn wait_for(child: &mut Child) -> Option<bool> {
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status.success()),
            Ok(None) if signals::caught().is_none() => sleep(EXIT_CHECK),
            Ok(None) | Err(_) => return None,
        }
    }
}

/// `Err` after a signal: a command of Slurm is then stopped, or not begun.
fn unless_stopped(name: &str) -> Result<(), CommandError> {
    let message = format!("stopped before `{name}` answered; run the command again to continue");
    signals::caught().map_or(Ok(()), |signal| Err(CommandError::Stopped { signal, message }))
}

fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// The absolute path of a file or folder that may not exist yet.
pub fn absolute(path: &Path) -> Result<PathBuf, CommandError> {
    std::path::absolute(path).map_err(|error| io(path, error))
}

fn io(path: &Path, error: std::io::Error) -> CommandError {
    OutputError::file(path, error).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_slurm_may_still_run_is_open() {
        for state in ["RUNNING", "PENDING", "COMPLETING", "SOMETHING_NEW"] {
            assert!(is_open(state), "{state}");
        }
        for state in ["COMPLETED", "CANCELLED by 1000", "OUT_OF_MEMORY"] {
            assert!(!is_open(state), "{state}");
        }
    }

    #[test]
    fn words_stay_what_they_are_in_a_shell() {
        assert_eq!(quoted("it's"), r"'it'\''s'");
        for word in ["it's", "a b", "\"a\" `id` $(id) $HOME", "two\nlines\n#SBATCH --wrap=id", "\\", "", "*", "--only"]
        {
            let line = format!("printf '%s.' {} {}", quoted(word), quoted("next"));
            let Ok(shell) = Command::new("sh").args(["-c", &line]).output() else { return };
            assert_eq!(String::from_utf8_lossy(&shell.stdout), format!("{word}.next."), "{word:?}");
        }
    }
}
