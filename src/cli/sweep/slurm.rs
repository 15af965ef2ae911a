//! Points as tasks of a Slurm job array.
//!
//! Files decide: a point whose results are there has ended, whatever Slurm says. The array has a name that belongs to the sweep and its
//! folder, so that the same command follows an array that is under way instead of submitting it twice; it is asked for by name, since Slurm
//! forgets jobs, and without accounting, which many clusters lack.

use super::plan::Plan;
use super::{Wanted, stopped};
use crate::cli::load::Refusal;
use crate::cli::progress::Progress;
use crate::cli::say;
use crate::output::PartFile;
use crate::study::sweep::Outcome;
use beamsim_core::failure::FailureKind;
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// The largest array where Slurm does not tell its own.
const MOST_TASKS: usize = 1000;

/// What a shared file system may take to show a file that another machine has written, in looks at the queue.
const GRACE: usize = 3;

/// Between looks at whether the user has stopped us.
const MOMENT: Duration = Duration::from_millis(50);

/// States that a task does not leave again.
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

/// Submits points (from 0), or follows those that were, until all have ended.
pub fn run(plan: &Plan, points: &[usize], wanted: &Wanted) -> Result<(), Refusal> {
    let array =
        Array { plan, name: format!("beamsim-{}", plan.fingerprint()), folder: absolute(&plan.folder)?.join("slurm") };
    let under_way = array.states()?.values().any(|state| is_open(state));
    if points.is_empty() && !under_way {
        return Ok(());
    }
    let tasks = if under_way {
        say::note(&format!("{}: follows the array `{}` that is under way", plan.name, array.name));
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
    /// Writes what the tasks read, and hands the array in.
    fn submit(&self, points: &[usize], wanted: &Wanted) -> Result<Vec<Vec<usize>>, Refusal> {
        let each = points.len().div_ceil(largest_array());
        let tasks: Vec<Vec<usize>> = points.chunks(each).map(<[usize]>::to_vec).collect();
        let words = |task: &Vec<usize>| task.iter().map(|k| (k + 1).to_string()).collect::<Vec<_>>().join(",");
        let lines: String = tasks.iter().map(|task| words(task) + "\n").collect();
        // Without their folder for words, tasks end before they begin.
        fs::create_dir_all(self.folder.join("log")).map_err(|error| io(&self.folder, &error))?;
        self.write("tasks", &lines)?;
        self.write("array.sh", &self.script(wanted)?)?;
        let log = self.folder.join("log").display().to_string().replace('%', "%%");
        let mut command = Command::new("sbatch");
        command.args(["--parsable", "--no-requeue"]).arg(format!("--array=0-{}", tasks.len() - 1));
        command.arg(format!("--job-name={}", self.name)).arg(format!("--output={log}/%a.txt"));
        command.args(&wanted.sbatch).arg(self.folder.join("array.sh"));
        // What an earlier run left must not look like an end of this one.
        for &point in points {
            self.plan.store.forget(&self.plan.sweep.identity(point)).map_err(|error| io(&self.folder, &error))?;
        }
        let answer = output(&mut command)?;
        let job = answer.lines().last().unwrap_or("").split(';').next().unwrap_or("").trim().to_string();
        say::note(&format!(
            "{}: {} points in {} tasks of the Slurm job {job}, `{}`",
            self.plan.name,
            points.len(),
            tasks.len(),
            self.name
        ));
        Ok(tasks)
    }

    fn write(&self, name: &str, content: &str) -> Result<(), Refusal> {
        PartFile::write(&self.folder, name, content.as_bytes()).map_err(Refusal::io)
    }

    /// A task runs the points that stand in its line.
    fn script(&self, wanted: &Wanted) -> Result<String, Refusal> {
        let program = std::env::current_exe().map_err(|error| io(Path::new("beamsim"), &error))?;
        let words = [vec![program.display().to_string()], self.plan.words(wanted)?].concat();
        let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
        let tasks = quoted(&self.folder.join("tasks").display().to_string());
        Ok(format!(
            "#!/bin/sh\nexec {} --threads 1 --only \"$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" {tasks})\"\n",
            words.join(" ")
        ))
    }

    /// The tasks that were handed in before.
    fn submitted(&self) -> Result<Vec<Vec<usize>>, Refusal> {
        let path = self.folder.join("tasks");
        let text = fs::read_to_string(&path).map_err(|error| io(&path, &error))?;
        let points =
            |line: &str| line.split(',').filter_map(|word| word.parse::<usize>().ok()?.checked_sub(1)).collect();
        Ok(text.lines().map(points).collect())
    }

    /// The state of each task that Slurm still knows.
    fn states(&self) -> Result<HashMap<usize, String>, Refusal> {
        let mut command = Command::new("squeue");
        command.args(["--me", "-h", "-r", "-t", "all", "-n", &self.name, "-o", "%K|%T"]);
        let listed = output(&mut command)?;
        let mut states: HashMap<usize, String> = HashMap::new();
        for (task, state) in listed.lines().filter_map(|line| line.trim().split_once('|')) {
            let Ok(task) = task.parse() else { continue };
            // Of an earlier array with this name a task may still be listed as ended.
            let known = states.entry(task).or_default();
            if known.is_empty() || is_open(state) {
                *known = state.into();
            }
        }
        Ok(states)
    }

    /// Until every point has ended or is given up.
    fn follow(&self, tasks: &[Vec<usize>], poll: Duration) -> Result<(), Refusal> {
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
                Err(refusal) => {
                    // Nothing is known: that is not an end.
                    progress.note(&format!("warning[{}]: {}", refusal.name, refusal.message));
                    continue;
                }
            };
            open.retain(|&(_, point)| !self.has_ended(point));
            for &(task, point) in &open {
                let state = states.get(&task).map_or("", String::as_str);
                let looks = gone.entry(point).or_default();
                *looks = if states.contains_key(&task) && is_open(state) { 0 } else { *looks + 1 };
                if *looks > GRACE {
                    self.give_up(point, state)?;
                }
            }
            open.retain(|(_, point)| gone.get(point).is_none_or(|&looks| looks <= GRACE));
            let running = states.values().filter(|state| *state == "RUNNING").count();
            let done = count - open.len();
            progress
                .tell(done as f64 / count as f64, || format!("{done} of {count} points, {running} tasks are running"));
        }
        progress.done();
        if stopped().is_some() {
            say::note(&format!(
                "{}: the array goes on, and the same command follows it; `scancel --me -n {}` ends it",
                self.plan.name, self.name
            ));
        }
        Ok(())
    }

    fn has_ended(&self, point: usize) -> bool {
        self.plan.known(point).is_some_and(|outcome| outcome.status != Outcome::KILLED)
    }

    /// A task is gone, and has left nothing of a point.
    fn give_up(&self, point: usize, state: &str) -> Result<(), Refusal> {
        if self.has_ended(point) {
            return Ok(());
        }
        let message =
            if state.is_empty() { "Slurm knows nothing of it any more".into() } else { format!("Slurm: {state}") };
        say::note(&format!("point {}: {}: {message}", point + 1, Outcome::KILLED));
        self.plan.keep(point, &Outcome::failed(Outcome::KILLED, message))
    }
}

fn is_open(state: &str) -> bool {
    // `CANCELLED by 1000`; what is unknown may go on.
    !ENDED.contains(&state.split(' ').next().unwrap_or(state))
}

/// `false` where the user has stopped us.
fn wait(time: Duration) -> bool {
    let end = Instant::now() + time;
    while Instant::now() < end && stopped().is_none() {
        sleep(MOMENT.min(time));
    }
    stopped().is_none()
}

/// What is the largest number of a task but one.
fn largest_array() -> usize {
    let told = output(Command::new("scontrol").args(["show", "config"])).unwrap_or_default();
    let line = told.lines().find(|line| line.trim_start().starts_with("MaxArraySize"));
    let number = line.and_then(|line| line.split('=').nth(1)?.trim().parse::<usize>().ok());
    number.filter(|&number| number > 1).map_or(MOST_TASKS, |number| number - 1)
}

fn output(command: &mut Command) -> Result<String, Refusal> {
    let name = command.get_program().to_string_lossy().into_owned();
    let refuse = |why: String| Refusal::of(FailureKind::Io, format!("{name}: {why}"));
    let done = command.output().map_err(|error| refuse(format!("{error}; is Slurm installed here?")))?;
    if done.status.success() {
        return Ok(String::from_utf8_lossy(&done.stdout).into_owned());
    }
    Err(refuse(String::from_utf8_lossy(&done.stderr).trim().to_string()))
}

fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// The whole path of what may not exist yet.
pub fn absolute(path: &Path) -> Result<PathBuf, Refusal> {
    std::path::absolute(path).map_err(|error| io(path, &error))
}

fn io(path: &Path, error: &std::io::Error) -> Refusal {
    Refusal::of(FailureKind::Io, format!("{}: {error}", path.display()))
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
    }
}
