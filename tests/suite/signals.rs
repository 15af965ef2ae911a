//! Signals end the binary soon, wherever it is, and what was reached is kept.

use super::folder::{Folder, last_line, status};
use super::report::data;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time in which a signal is answered.
const ANSWER: Duration = Duration::from_secs(1);
/// Signals at one instant, of which one must be answered in time: another process may have taken
/// the processor from the others.
const ATTEMPTS: usize = 4;
/// Time after which a process is killed that does not end.
const DEAF: Duration = Duration::from_secs(60);

const HUP: i32 = 1;
const INT: i32 = 2;
const TERM: i32 = 15;

const ARM: &str = r#"
[point]
root = [0, 0, 0]
tip = [2, 0, 0]
[section.rod]
EA = 1e6
GA = 4e5
GJ = 80
EI = 100
rhoA = 1.0
[[beam]]
name = "arm"
section = "rod"
through = ["root", "tip"]
elements = ELEMENTS
order = 2
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [-1, 0.3, 0.4]
"#;

const STATIC: &str = "[[stage]]\nkind = \"static\"\nsteps = 2000\n";
const PATH: &str = "[[stage]]\nkind = \"static\"\ncontrol = \"arc_length\"\nsteps = 5000\n";
const MODAL: &str = "[[stage]]\nkind = \"static\"\nsteps = 1\n[[stage]]\nkind = \"modal\"\nmodes = 300\n";
const BUCKLING: &str = "[[stage]]\nkind = \"buckling\"\nmodes = 6\n";
const DYNAMIC: &str = "[[stage]]\nkind = \"dynamic\"\nend = 1e5\nstep = 0.01\nscheme = \"generalized_alpha\"\n";

/// A process that is killed with the test.
struct Running(Child);

impl Running {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        Self::by(Command::new(env!("CARGO_BIN_EXE_beamsim")).args(arguments), folder)
    }

    fn by(command: &mut Command, folder: &Path) -> Self {
        let quiet = command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        Self(quiet.spawn().unwrap())
    }

    fn send(&self, signal: i32) {
        let number = self.0.id().to_string();
        Command::new("kill").args([&format!("-{signal}"), &number]).status().unwrap();
    }

    /// The end of the process, and the time until then.
    fn end(&mut self) -> (ExitStatus, Duration) {
        let begun = Instant::now();
        while begun.elapsed() < DEAF {
            if let Some(status) = self.0.try_wait().unwrap() {
                return (status, begun.elapsed());
            }
            sleep(Duration::from_millis(5));
        }
        panic!("no answer to a signal within {DEAF:?}");
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The exit status as a shell shows it: a process that is not yet ready to hear is ended by the
/// signal itself.
fn shown(status: ExitStatus) -> i32 {
    status.code().unwrap_or_else(|| 128 + status.signal().unwrap_or(0))
}

/// Starts a process again and again until a signal, sent after `delay`, is answered in time. Each begins without the
/// checkpoint that the one before has left.
fn answers(folder: &Folder, arguments: &[&str], delay: Duration, signal: i32) {
    for attempt in 1..=ATTEMPTS {
        if let Some(option) = arguments.iter().position(|&argument| argument == "--out") {
            let _ = fs::remove_dir_all(folder.0.join(arguments[option + 1]));
        }
        let mut running = Running::start(&folder.0, arguments);
        sleep(delay);
        running.send(signal);
        let (status, time) = running.end();
        let shown = shown(status);
        assert!([128 + signal, 0].contains(&shown), "{arguments:?}, signal {signal} after {delay:?}: status {shown}");
        if time <= ANSWER {
            return;
        }
        assert!(attempt < ATTEMPTS, "{arguments:?}: signal {signal} after {delay:?} is answered after {time:?}");
    }
}

/// Pseudo-random delays: short ones are more frequent, since the time before the first step is
/// short.
fn delays(count: usize, longest: f64) -> impl Iterator<Item = Duration> {
    let mut part = 0.3_f64;
    (0..count).map(move |_| {
        part = (part + 0.618_033_988_749_895).fract();
        Duration::from_secs_f64(longest * part * part)
    })
}

#[test]
fn every_stage_of_any_size_answers_signals_at_any_instant() {
    let folder = Folder::new("signals");
    let signals = [TERM, INT, HUP].into_iter().cycle();
    let kinds = [("static", STATIC), ("path", PATH), ("modal", MODAL), ("buckling", BUCKLING), ("dynamic", DYNAMIC)];
    let sizes = [10, 1000, 30_000];
    let mut cases = delays(kinds.len() * sizes.len() * 3, 2.0).zip(signals);
    for (kind, stage) in kinds {
        for elements in sizes {
            let name = format!("{kind}_{elements}");
            let deck = format!("{name}.toml");
            folder.write(&deck, &(ARM.replace("ELEMENTS", &elements.to_string()) + stage));
            for (delay, signal) in cases.by_ref().take(3) {
                let out = format!("results/{name}");
                answers(&folder, &["run", &deck, "--out", &out], delay, signal);
                let left = if folder.0.join(&out).is_dir() { folder.names(&out) } else { Vec::new() };
                let is_part = |name: &String| name.ends_with(".part");
                assert!(!left.iter().any(is_part), "{name}, signal {signal} after {delay:?}: {left:?}");
            }
        }
    }
}

/// `nohup` switches the hang-up off.
#[test]
fn a_hang_up_that_is_switched_off_stays_so() {
    let folder = Folder::new("no_hang_up");
    folder.write("long.toml", &(ARM.replace("ELEMENTS", "10") + DYNAMIC));
    let script = format!("trap '' HUP; exec '{}' run long.toml", env!("CARGO_BIN_EXE_beamsim"));
    let mut running = Running::by(Command::new("sh").args(["-c", &script]), &folder.0);
    sleep(Duration::from_millis(500));
    running.send(HUP);
    sleep(Duration::from_millis(500));
    assert!(running.0.try_wait().unwrap().is_none(), "a hang-up has ended the run");
    running.send(TERM);
    assert_eq!(shown(running.end().0), 143);
}

/// `timeout` sends its signal to the process and to its group.
#[test]
fn a_signal_that_comes_twice_at_once_is_one() {
    let folder = Folder::new("twice");
    folder.write("long.toml", &(ARM.replace("ELEMENTS", "10") + DYNAMIC));
    let run = [env!("CARGO_BIN_EXE_beamsim"), "run", "long.toml"];
    let mut running = Running::by(Command::new("timeout").arg("1").args(run), &folder.0);
    running.end();
    assert_eq!(folder.names("results/long"), ["checkpoint", "history.partial.csv", "run.json"]);
}

/// Messages that nobody reads stop the process in its work: it cannot answer.
#[test]
fn a_second_signal_ends_a_process_that_hangs() {
    let folder = Folder::new("second_signal");
    folder.write("arm.toml", &(ARM.replace("ELEMENTS", "1") + "[[stage]]\nkind = \"static\"\nsteps = 1\n"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_beamsim"));
    command.args(["sweep", "arm.toml", "--vary", "section.rod.EA=-1:-2:4000", "--threads", "1"]);
    command.current_dir(&folder.0).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut running = Running(command.spawn().unwrap());
    sleep(Duration::from_secs(3));
    running.send(TERM);
    sleep(Duration::from_secs(1));
    running.send(TERM);
    assert_eq!(shown(running.end().0), 143);
}

#[test]
fn other_commands_answer_signals() {
    let folder = Folder::new("signals_of_commands");
    let deck = ARM.replace("ELEMENTS", "50") + DYNAMIC;
    folder.write("motion.toml", &deck);
    folder.write("large.toml", &(ARM.replace("ELEMENTS", "30000") + STATIC));
    for arguments in [
        &["check", "large.toml"][..],
        &["verify", "motion.toml"],
        &["verify", "motion.toml", "--out", "v"],
        &["effects", "motion.toml"],
        &["cost", "motion.toml", "--out", "c"],
        &["run", "motion.toml", "--fresh", "--accuracy", "1e-6", "--set", "stage.0.end=200"],
        &["run", "motion.toml", "--fresh", "--error-bars"],
        &["sweep", "motion.toml", "--vary", "beam.0.elements=50,60,70,80", "--out", "s"],
    ] {
        for (delay, signal) in delays(3, 1.5).zip([INT, TERM, HUP]) {
            answers(&folder, arguments, delay, signal);
        }
    }
}

#[test]
fn a_pipe_without_a_writer_does_not_keep_a_command() {
    let folder = Folder::new("pipe_as_deck");
    Command::new("mkfifo").arg(folder.0.join("pipe.toml")).status().unwrap();
    for arguments in [["check", "pipe.toml"], ["verify", "pipe.toml"], ["run", "pipe.toml"]] {
        answers(&folder, &arguments, Duration::from_millis(300), TERM);
    }
}

#[test]
fn a_folder_of_decks_may_hold_pipes_and_links_to_itself() {
    let folder = Folder::new("odd_folder");
    fs::create_dir_all(folder.0.join("decks/inner")).unwrap();
    folder.write("decks/arm.toml", &(ARM.replace("ELEMENTS", "1") + "[[stage]]\nkind = \"static\"\nsteps = 1\n"));
    Command::new("mkfifo").arg(folder.0.join("decks/pipe.toml")).status().unwrap();
    std::os::unix::fs::symlink("../..", folder.0.join("decks/inner/up")).unwrap();
    std::os::unix::fs::symlink("..", folder.0.join("decks/inner/loop")).unwrap();
    let output = folder.beamsim(&["verify", "decks"]);
    assert_eq!(status(&output), 0, "{}", last_line(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.ends_with("0 of 0 expectations hold in 1 deck(s)\n"), "{text}");
}

/// Commands of Slurm hang where its controller does not answer.
#[test]
fn a_slurm_that_hangs_is_stopped() {
    let folder = Folder::new("slurm_hangs");
    folder.write("arm.toml", &(ARM.replace("ELEMENTS", "1") + "[[stage]]\nkind = \"static\"\nsteps = 1\n"));
    let tools = folder.0.join("tools");
    fs::create_dir_all(&tools).unwrap();
    for hangs in ["squeue", "scontrol", "sbatch"] {
        for name in ["squeue", "scontrol", "sbatch"] {
            let work = if name == hangs { "echo $$ > hangs; exec sleep 1000" } else { "exit 0" };
            let path = folder.write(&format!("tools/{name}"), &format!("#!/bin/sh\n{work}\n"));
            fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
        }
        let _ = fs::remove_file(folder.0.join("hangs"));
        let path = format!("{}:{}", tools.display(), std::env::var("PATH").unwrap());
        let mut command = Command::new(env!("CARGO_BIN_EXE_beamsim"));
        command.args(["sweep", "arm.toml", "--vary", "beam.0.elements=1,2", "--engine", "slurm"]).env("PATH", path);
        let mut running = Running::by(&mut command, &folder.0);
        let begun = Instant::now();
        let hanging = || fs::read_to_string(folder.0.join("hangs")).ok().filter(|text| text.ends_with('\n'));
        while hanging().is_none() && begun.elapsed() < DEAF {
            sleep(Duration::from_millis(20));
        }
        let process = hanging().unwrap_or_else(|| panic!("{hangs} was not called"));
        running.send(TERM);
        let (status, _) = running.end();
        assert_eq!(shown(status), 143, "{hangs}");
        let lives = Command::new("kill").args(["-0", process.trim()]).stderr(Stdio::null()).status().unwrap();
        assert!(!lives.success(), "{hangs} still hangs");
    }
}

/// The rows of the history that have shapes in the page of results.
fn rows_with_shapes(folder: &Folder) -> Vec<u64> {
    let page = fs::read_to_string(folder.0.join("r/report.html")).unwrap();
    data(&page)["scene"]["rows"].as_array().unwrap().iter().map(|row| row.as_u64().unwrap()).collect()
}

/// The shapes come from another run of the deck, which is not that of the history where a stopped run
/// goes on with other rows.
#[test]
fn pages_of_stopped_and_resumed_runs_have_their_own_shapes_or_none() {
    let folder = Folder::new("signals_report");
    folder.write("deck.toml", &(ARM.replace("ELEMENTS", "2") + DYNAMIC));
    let mut running = Running::start(&folder.0, &["run", "deck.toml", "--out", "r"]);
    let has_rows = || {
        let files = fs::read_dir(folder.0.join("r")).into_iter().flatten().flatten();
        files.filter_map(|file| file.metadata().ok()).any(|file| file.len() > 100_000)
    };
    let begun = Instant::now();
    while !has_rows() && begun.elapsed() < DEAF {
        sleep(Duration::from_millis(20));
    }
    running.send(TERM);
    assert_eq!(shown(running.end().0), 128 + TERM);
    // It ends where the run was stopped, not after ten million steps.
    let report = folder.beamsim(&["report", "r"]);
    assert_eq!(status(&report), 0, "{}", last_line(&report));
    let history = fs::read_to_string(folder.0.join("r/history.partial.csv")).unwrap();
    let rows = history.lines().count() as u64 - 1;
    let shown = rows_with_shapes(&folder);
    assert!(rows > 10 && shown.len() > 5 && *shown.last().unwrap() + 10 > rows * 9 / 10, "{rows}: {shown:?}");
    let last: f64 = history.lines().last().unwrap().split(',').nth(1).unwrap().parse().unwrap();
    let end = format!("stage.0.end={}", (last + 5.0).ceil());
    let resumed = ["run", "deck.toml", "--out", "r", "--resume", "--set", "output.every=7", "--set", &end];
    let resumed = folder.beamsim(&resumed);
    assert_eq!(status(&resumed), 0, "{}", last_line(&resumed));
    let report = folder.beamsim(&["report", "r"]);
    assert_eq!(status(&report), 0);
    assert!(String::from_utf8_lossy(&report.stderr).contains("without shapes"));
    assert_eq!(rows_with_shapes(&folder), [0; 0]);
}
