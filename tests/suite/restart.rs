//! Runs that are stopped and resumed, from the command line; one run a folder, and files that belong together.

use crate::folder::{Folder, last_line, status};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// A pendulum of many steps.
const SWING: &str = include_str!("../reliability/swing.toml");

fn start(folder: &Folder, arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_beamsim"));
    command.args(arguments).current_dir(&folder.0).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().unwrap()
}

/// Waits until a file is there.
fn wait_for(path: &Path) {
    let start = Instant::now();
    while !path.exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "{} is not written", path.display());
        thread::sleep(Duration::from_millis(1));
    }
}

/// Starts the run, and kills it when it has written a checkpoint.
fn run_and_kill(folder: &Folder, out: &str) {
    let mut child = start(folder, &["run", "swing.toml", "-q", "--out", out, "--checkpoint", "0s"]);
    wait_for(&folder.0.join(out).join("checkpoint"));
    child.kill().unwrap();
    child.wait().unwrap();
}

fn read(folder: &Folder, name: &str) -> Vec<u8> {
    fs::read(folder.0.join(name)).unwrap()
}

/// run.json without times and what tells of the restart.
fn record(folder: &Folder, out: &str) -> serde_json::Value {
    let mut record: serde_json::Value = serde_json::from_slice(&read(folder, &format!("{out}/run.json"))).unwrap();
    for key in ["seconds", "threads", "resumed"] {
        record.as_object_mut().unwrap().remove(key);
    }
    record
}

#[test]
fn a_killed_run_goes_on_with_the_bytes_of_one_that_was_not() {
    let folder = Folder::new("killed");
    folder.write("swing.toml", SWING);
    assert_eq!(status(&folder.beamsim(&["run", "swing.toml", "-q", "--out", "whole"])), 0);
    run_and_kill(&folder, "killed");
    let mut left = folder.names("killed");
    // The kill may have come while the next checkpoint was written.
    left.retain(|name| name != "checkpoint.part");
    assert_eq!(left, [".lock", "checkpoint", "history.csv.part", "run.json.part"]);
    // Nothing is lost or begun anew by accident.
    let asked = folder.beamsim(&["run", "swing.toml", "-q", "--out", "killed"]);
    assert_eq!(status(&asked), 2);
    assert!(last_line(&asked).starts_with("error[checkpoint]: ") && last_line(&asked).contains("--resume"));
    let resumed = folder.beamsim(&["run", "swing.toml", "-q", "--out", "killed", "--resume"]);
    assert_eq!(status(&resumed), 0, "{}", last_line(&resumed));
    assert_eq!(folder.names("killed"), ["history.csv", "run.json"]);
    assert!(read(&folder, "killed/history.csv") == read(&folder, "whole/history.csv"));
    assert_eq!(record(&folder, "killed"), record(&folder, "whole"));
}

#[test]
fn checkpoints_of_other_decks_are_refused_and_ends_may_change() {
    let folder = Folder::new("other_checkpoint");
    folder.write("swing.toml", SWING);
    run_and_kill(&folder, "out");
    let other = ["run", "swing.toml", "-q", "--out", "out", "--set", "section.rod.EI=101", "--resume"];
    let refused = folder.beamsim(&other);
    assert_eq!(status(&refused), 2);
    assert!(last_line(&refused).contains("it belongs to another deck"), "{}", last_line(&refused));
    let further = ["--set", "stage.0.end=4.2", "--set", "output.every=10"];
    let whole = [&["run", "swing.toml", "-q", "--out", "whole"][..], &further].concat();
    assert_eq!(status(&folder.beamsim(&whole)), 0);
    let on = [&["run", "swing.toml", "-q", "--out", "out", "--resume"][..], &further].concat();
    assert_eq!(status(&folder.beamsim(&on)), 0);
    let last = |out: &str| String::from_utf8(read(&folder, out)).unwrap().lines().last().unwrap().to_string();
    assert_eq!(last("out/history.csv"), last("whole/history.csv"));
    run_and_kill(&folder, "out");
    assert_eq!(status(&folder.beamsim(&["run", "swing.toml", "-q", "--out", "out", "--fresh"])), 0);
    assert_eq!(folder.names("out"), ["history.csv", "run.json"]);
}

#[test]
fn damaged_checkpoints_are_named() {
    let folder = Folder::new("damaged_checkpoint");
    folder.write("swing.toml", SWING);
    run_and_kill(&folder, "out");
    let mut bytes = read(&folder, "out/checkpoint");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(folder.0.join("out/checkpoint"), bytes).unwrap();
    let refused = folder.beamsim(&["run", "swing.toml", "-q", "--out", "out", "--resume"]);
    assert_eq!(status(&refused), 2);
    assert!(last_line(&refused).contains("it is damaged"), "{}", last_line(&refused));
}

#[test]
fn resuming_nothing_begins_at_the_start() {
    let folder = Folder::new("nothing_to_resume");
    folder.write("swing.toml", SWING);
    let output = folder.beamsim(&["run", "swing.toml", "-q", "--out", "out", "--resume", "--set", "stage.0.end=0.01"]);
    assert_eq!(status(&output), 0);
    assert!(String::from_utf8_lossy(&output.stderr).contains("has no checkpoint"));
}

#[test]
fn a_folder_has_one_run_at_a_time() {
    let folder = Folder::new("locked");
    folder.write("swing.toml", SWING);
    let mut first = start(&folder, &["run", "swing.toml", "-q", "--out", "out", "--set", "stage.0.end=100"]);
    wait_for(&folder.0.join("out/history.csv.part"));
    let second = folder.beamsim(&["run", "swing.toml", "-q", "--out", "out"]);
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(status(&second), 4);
    assert!(last_line(&second).starts_with("error[locked]: out: "), "{}", last_line(&second));
    // The lock ends with its process.
    assert_eq!(status(&folder.beamsim(&["run", "swing.toml", "-q", "--out", "out"])), 0);
}

#[test]
fn what_is_in_the_way_of_results_is_told_before_the_run() {
    let folder = Folder::new("in_the_way");
    folder.write("swing.toml", SWING);
    let refuse = |out: &str, why: &str| {
        let output = folder.beamsim(&["run", "swing.toml", "-q", "--out", out]);
        assert_eq!(status(&output), 4, "{out}");
        assert!(last_line(&output).contains(why), "{}", last_line(&output));
    };
    let cases = [
        ("a", "modes.csv", "is a folder"),
        ("b", "run.json", "is a folder"),
        ("c", "history.csv.part", "is in the way of the results"),
    ];
    for (out, name, why) in cases {
        fs::create_dir_all(folder.0.join(out).join(name)).unwrap();
        refuse(out, why);
        assert_eq!(folder.names(out), [name]);
    }
    fs::create_dir_all(folder.0.join("d/fields")).unwrap();
    folder.write("d/fields/mine.vtu", "");
    refuse("d", "is in the way of the results");
    #[cfg(unix)]
    {
        fs::create_dir(folder.0.join("e")).unwrap();
        std::os::unix::fs::symlink("../swing.toml", folder.0.join("e/history.csv")).unwrap();
        refuse("e", "is a link");
    }
    assert_eq!(fs::read_to_string(folder.0.join("swing.toml")).unwrap(), SWING);
}

/// A kill between the names of two files leaves some of them missing, never two runs side by side.
#[test]
fn a_commit_that_was_cut_short_is_completed() {
    let folder = Folder::new("cut_commit");
    folder.write("swing.toml", SWING);
    let short = ["run", "swing.toml", "-q", "--set", "stage.0.end=0.01", "--out"];
    assert_eq!(status(&folder.beamsim(&[&short[..], &["new"]].concat())), 0);
    let history = read(&folder, "new/history.csv");
    // After the first rename: run.json is there, the history has its temporary name.
    fs::rename(folder.0.join("new/history.csv"), folder.0.join("new/history.csv.part")).unwrap();
    assert_eq!(status(&folder.beamsim(&["plot", "new", "--out", "plot.svg"])), 0);
    assert!(read(&folder, "new/history.csv") == history);
    // Before it: both have temporary names, beside an older run.
    let older = ["--set", "stage.0.end=0.02", "--out", "old"];
    assert_eq!(status(&folder.beamsim(&[&["run", "swing.toml", "-q"][..], &older].concat())), 0);
    for name in ["history.csv", "run.json"] {
        fs::copy(folder.0.join("new").join(name), folder.0.join("old").join(format!("{name}.part"))).unwrap();
    }
    assert_eq!(status(&folder.beamsim(&["plot", "old", "--out", "plot.svg"])), 0);
    assert_eq!(folder.names("old"), ["history.csv", "run.json"]);
    assert!(read(&folder, "old/history.csv") == history);
    assert_eq!(record(&folder, "old"), record(&folder, "new"));
}

#[test]
fn files_of_two_runs_are_refused() {
    let folder = Folder::new("mixed");
    folder.write("swing.toml", SWING);
    for (out, end) in [("a", "stage.0.end=0.01"), ("b", "stage.0.end=0.02")] {
        assert_eq!(status(&folder.beamsim(&["run", "swing.toml", "-q", "--set", end, "--out", out])), 0);
    }
    fs::copy(folder.0.join("a/history.csv"), folder.0.join("b/history.csv")).unwrap();
    for command in [&["plot", "b", "--out", "b.svg"][..], &["report", "b"], &["compare", "b", "a"]] {
        let refused = folder.beamsim(command);
        assert_eq!(status(&refused), 4, "{command:?}");
        assert!(last_line(&refused).contains("is not as the run that run.json describes has written it"));
    }
}

#[test]
fn a_stopped_search_goes_on() {
    let folder = Folder::new("stopped_search");
    folder.write("swing.toml", SWING);
    let search = ["run", "swing.toml", "-q", "--accuracy", "1e-4", "--set", "stage.0.end=0.1", "--out", "out"];
    let mut child = start(&folder, &search);
    let journal = folder.0.join("out/accuracy.journal");
    let is_begun = || fs::read_to_string(&journal).is_ok_and(|text| text.lines().count() > 2);
    let mut ended = false;
    while !is_begun() && !ended {
        ended = child.try_wait().unwrap().is_some();
        thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let again = folder.beamsim(&search);
    assert_eq!(status(&again), 0, "{}", last_line(&again));
    assert!(ended || String::from_utf8_lossy(&again.stderr).contains("continues a stopped search"));
    assert_eq!(folder.names("out"), ["history.csv", "run.json"]);
}
