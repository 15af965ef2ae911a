//! Many runs of one deck, on this machine and on engines.

use super::folder::{Folder, last_line, status};
use std::collections::HashMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// A cantilever of length 2 with a small force at its end: it goes down by F L^3 / (3 EI). Its slope is below 2e-4 and shear adds 1e-8 of
/// that (of lengths up to 3, slopes below 5e-4): tests allow 1e-5 and 1e-4, far above what large displacements change and far below any other point.
const DECK: &str = "[param]\nF = 1e-3\nL = 2\n[point]\nroot = [0, 0, 0]\ntip = [\"L\", 0, 0]\n\
     [section.s]\nEA = 1e6\nGA = 1e9\nGJ = 10\nEI = 10\nrhoA = 1\n\
     [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 2\norder = 3\n\
     [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 0, \"-F\"]\n\
     [[stage]]\nkind = \"static\"\nsteps = 2\n[output]\nnodes = [\"tip\"]\ncolumns = [\"u\"]\n";

/// The table of a sweep: rows of cells by name.
fn table(path: &Path) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let names: Vec<String> = reader.headers().unwrap().iter().map(String::from).collect();
    let row = |record: csv::StringRecord| names.iter().cloned().zip(record.iter().map(String::from)).collect();
    reader.records().map(|record| row(record.unwrap())).collect()
}

fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap_or_else(|_| panic!("{name} in {row:?}"))
}

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("deck.toml", DECK);
    folder
}

fn fine(output: &Output) {
    assert_eq!(status(output), 0, "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn each_value_with_each_of_the_others_gives_a_row() {
    let folder = folder("sweep_grid");
    fine(&folder.beamsim(&[
        "sweep",
        "deck.toml",
        "--vary",
        "param.F=1e-3,2e-3",
        "--vary",
        "param.L=1:2:3",
        "--out",
        "r",
    ]));
    let rows = table(&folder.0.join("r/sweep.csv"));
    assert_eq!(rows.len(), 6);
    for (k, (force, length)) in [1e-3, 2e-3].into_iter().flat_map(|f| [1.0, 1.5, 2.0].map(|l| (f, l))).enumerate() {
        let row = &rows[k];
        assert_eq!(
            (number(row, "point"), number(row, "param.F"), number(row, "param.L")),
            (k as f64 + 1.0, force, length)
        );
        let exact = -force * length * length * length / 30.0;
        assert!((number(row, "tip.uz") - exact).abs() < 1e-5 * exact.abs(), "{row:?}");
        assert!(row["status"] == "finished" && number(row, "iterations") > 0.0);
    }
    // A row is what a run of its own gives.
    fine(&folder.beamsim(&["run", "deck.toml", "--set", "param.F=2e-3", "--set", "param.L=1.5", "--out", "one"]));
    let history = fs::read_to_string(folder.0.join("one/history.csv")).unwrap();
    assert!(history.trim_end().ends_with(&rows[4]["tip.uz"]));
}

#[test]
fn outputs_are_looked_at_when_they_say_with_error_bars() {
    let folder = folder("sweep_outputs");
    let outputs = ["--output", "tip.uz:load=0.5", "--output", "b@0.5.M2:absmax", "--error-bars"];
    fine(&folder.beamsim(&[&["sweep", "deck.toml", "--vary", "param.L=1,2"][..], &outputs].concat()));
    for row in table(&folder.0.join("results/deck/sweep.csv")) {
        let length = number(&row, "param.L");
        let (half, moment) = (-0.5e-3 * length.powi(3) / 30.0, 0.5e-3 * length);
        assert!((number(&row, "tip.uz:load=0.5") - half).abs() < 1e-5 * half.abs());
        assert!((number(&row, "b@0.5.M2:absmax") - moment).abs() < 1e-5 * moment);
        // At the nodes cubic elements are exact for this beam, but for the round-off of what Newton leaves.
        assert!((0.0..1e-6).contains(&number(&row, "tip.uz:load=0.5.err")), "{row:?}");
    }
}

#[test]
fn a_point_that_fails_is_a_row_and_stops_no_other() {
    let folder = folder("sweep_failures");
    let sweep = ["sweep", "deck.toml", "--vary", "beam.0.elements=1,0,2", "--vary", "support.0.fix=all,uz"];
    let output = folder.beamsim(&sweep);
    assert_eq!(status(&output), 3);
    assert_eq!(
        last_line(&output),
        "error[sweep]: 4 of 6 points did not finish: 2 `deck` (point 3 and 1 more), 2 `singular` (point 2 and 1 more)"
    );
    let path = folder.0.join("results/deck/sweep.csv");
    let rows = table(&path);
    let states: Vec<&str> = rows.iter().map(|row| row["status"].as_str()).collect();
    assert_eq!(states, ["finished", "singular", "deck", "deck", "finished", "singular"]);
    assert!(rows[1]["tip.uz"].is_empty() && rows[1]["message"].contains("is not constrained"));
    assert!(rows[2]["message"].contains("at least 1"));
    // The same command has nothing left to do, but to say so again.
    let bytes = fs::read(&path).unwrap();
    let again = folder.beamsim(&sweep);
    assert!(String::from_utf8_lossy(&again.stderr).contains("continues, 6 points are done"));
    assert_eq!((status(&again), fs::read(&path).unwrap()), (3, bytes));
    let redone = folder.beamsim(&[&sweep[..], &["--redo"]].concat());
    assert!(String::from_utf8_lossy(&redone.stderr).contains("continues, 2 points are done"));
}

#[test]
fn samples_are_the_same_for_the_same_seed_and_spread_over_ranges() {
    let folder = folder("sweep_samples");
    let run = |seed: &str, out: &str| {
        let sample = ["--sample", "20", "--seed", seed, "--out", out];
        fine(
            &folder.beamsim(
                &[&["sweep", "deck.toml", "--vary", "param.L=1:3", "--vary", "param.F=1e-6:1e-3:log"][..], &sample]
                    .concat(),
            ),
        );
        fs::read(folder.0.join(out).join("sweep.csv")).unwrap()
    };
    assert_eq!(run("7", "a"), run("7", "b"));
    assert_ne!(run("7", "a"), run("8", "c"));
    let rows = table(&folder.0.join("a/sweep.csv"));
    let mut tenths: Vec<usize> = rows.iter().map(|row| ((number(row, "param.L") - 1.0) * 10.0) as usize).collect();
    tenths.sort_unstable();
    assert!(tenths.into_iter().eq(0..20));
    for row in &rows {
        let exact = -number(row, "param.F") * number(row, "param.L").powi(3) / 30.0;
        assert!((number(row, "tip.uz") - exact).abs() < 1e-4 * exact.abs(), "{row:?}");
    }
}

#[test]
fn a_file_says_what_a_command_line_says() {
    let folder = folder("sweep_file");
    fs::create_dir(folder.0.join("studies")).unwrap();
    folder.write(
        "studies/lengths.toml",
        "deck = \"../deck.toml\"\nset = [\"param.F=2e-3\"]\noutputs = [\"tip.uz\", \"tip.uz:absmax\"]\nzip = true\n\
         [vary]\n\"param.L\" = { from = 1, to = 2, count = 3 }\n\"support.0.fix\" = [\"all\", [\"ux\", \"uy\", \"uz\", \"rx\", \"ry\", \"rz\"], \"all\"]\n",
    );
    fine(&folder.beamsim(&["sweep", "studies/lengths.toml"]));
    let words = [
        "--set",
        "param.F=2e-3",
        "--output",
        "tip.uz",
        "--output",
        "tip.uz:absmax",
        "--zip",
        "--vary",
        "param.L=1:2:3",
    ];
    let fixes =
        ["--vary", "support.0.fix=\"all\",[\"ux\", \"uy\", \"uz\", \"rx\", \"ry\", \"rz\"],\"all\"", "--out", "line"];
    fine(&folder.beamsim(&[&["sweep", "deck.toml"][..], &words, &fixes].concat()));
    let of = |path: &str| fs::read_to_string(folder.0.join(path)).unwrap();
    assert_eq!(of("results/lengths/sweep.csv"), of("line/sweep.csv"));

    folder.write("wrong.toml", "deck = \"deck.toml\"\nsamples = 3\n[vary]\n\"param.L\" = { form = 1, to = 2 }\n");
    let output = folder.beamsim(&["sweep", "wrong.toml"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(
        status(&output) == 2 && text.contains("did you mean `sample`?") && text.contains("did you mean `from`?"),
        "{text}"
    );
    let output = folder.beamsim(&["run", "wrong.toml"]);
    assert!(status(&output) == 2 && last_line(&output).contains("try `beamsim sweep wrong.toml`"));
}

#[test]
fn wrong_words_for_a_sweep_are_told() {
    let folder = folder("sweep_wrong");
    for (words, told) in [
        (&["--vary", "param.q=1,2"][..], "the deck has no parameter `q`"),
        (&["--vary", "sectoin.s.EA=1,2"], "the deck has no `sectoin`"),
        (&["--vary", "param.L=1:2"], "give the number of values"),
        (&["--vary", "param.L=1,2", "--vary", "param.F=1", "--zip"], "equal numbers of values"),
        (&["--vary", "param.L=1,2", "--output", "tip.uq"], "there is no column `tip.uq`"),
        (&["--vary", "param.L=1,2", "--only", "3"], "points are numbers from 1 to 2"),
        (&["--vary", "param.L"], "expected KEY=V1,V2"),
        (&[], "no key is varied"),
        (&["--vary", "param.L=1,2", "--vary", "param.L=3,4"], "`param.L` is varied twice"),
        (&["--vary", "section.s.EX=1,2"], "unknown key `EX`"),
        (&["--vary", "beam.0.elments=1,2"], "did you mean `elements`?"),
    ] {
        let output = folder.beamsim(&[&["sweep", "deck.toml"], words].concat());
        assert!(status(&output) == 2 && last_line(&output).contains(told), "{words:?}: {}", last_line(&output));
    }
    let both = "deck = \"deck.toml\"\nzip = true\nsample = 2\n[vary]\n\"param.L\" = { from = 1, to = 2 }\n";
    folder.write("both.toml", both);
    let output = folder.beamsim(&["sweep", "both.toml"]);
    assert_eq!(status(&output), 2);
    assert!(String::from_utf8_lossy(&output.stderr).contains("remove `zip`, or `sample`"));
    assert!(!folder.0.join("results").exists());
}

#[test]
fn points_that_are_run_one_by_one_are_gathered_to_the_same_table() {
    let folder = folder("sweep_parts");
    let sweep = ["sweep", "deck.toml", "--vary", "param.L=1:2:4"];
    let with = |words: &[&str]| folder.beamsim(&[&sweep[..], words].concat());
    fine(&with(&["--out", "whole"]));
    let listed = with(&["--list"]);
    assert_eq!(String::from_utf8_lossy(&listed.stdout).lines().count(), 5);
    fine(&with(&["--out", "parts", "--only", "1-2"]));
    assert!(!folder.0.join("parts/sweep.csv").exists());
    let early = with(&["--out", "parts", "--gather"]);
    assert!(
        status(&early) == 3 && last_line(&early).contains("2 `missing` (point 3 and 1 more)"),
        "{}",
        last_line(&early)
    );
    fine(&with(&["--out", "parts", "--only", "4,3"]));
    fine(&with(&["--out", "parts", "--gather"]));
    let of = |path: &str| fs::read(folder.0.join(path)).unwrap();
    assert_eq!(of("whole/sweep.csv"), of("parts/sweep.csv"));
}

/// Says why a test did nothing, past the test harness.
fn skip(why: &str) {
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
}

#[test]
fn gnu_parallel_runs_points() {
    let version = Command::new("parallel").arg("--version").output();
    if !version.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).starts_with("GNU parallel")) {
        return skip("GNU parallel is not installed");
    }
    let folder = folder("sweep_parallel");
    let sweep = ["sweep", "deck.toml", "--vary", "param.L=1:2:6"];
    fine(&folder.beamsim(&[&sweep[..], &["--out", "whole"]].concat()));
    let words = [&["-j2", env!("CARGO_BIN_EXE_beamsim")][..], &sweep, &["--out", "r", "--only", "{}", ":::"]].concat();
    let done =
        Command::new("parallel").args(words).args((1..=6).map(|k| k.to_string())).current_dir(&folder.0).output();
    fine(&done.unwrap());
    fine(&folder.beamsim(&[&sweep[..], &["--out", "r", "--gather"]].concat()));
    assert_eq!(fs::read(folder.0.join("r/sweep.csv")).unwrap(), fs::read(folder.0.join("whole/sweep.csv")).unwrap());
}

/// A Slurm of one node, which ends with the test.
struct Slurm {
    folder: PathBuf,
    config: String,
}

impl Slurm {
    fn script(arguments: &[&str]) -> Output {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/engines/slurm_node.sh");
        Command::new(script).args(arguments).output().unwrap()
    }

    /// `None` where it cannot be had, which is said.
    fn start() -> Option<Self> {
        // Sockets have short names.
        let folder = std::env::temp_dir().join(format!("beamsim-slurm-{}", std::process::id()));
        let started = Self::script(&["start", &folder.display().to_string()]);
        if status(&started) == 77 {
            skip(&format!("Slurm: {}", last_line(&started)));
            return None;
        }
        fine(&started);
        let told = String::from_utf8_lossy(&started.stdout);
        let config = told.trim().strip_prefix("export SLURM_CONF=").unwrap().to_string();
        Some(Self { folder, config })
    }

    fn run(&self, program: &str, arguments: &[&str], folder: &Path) -> Output {
        Command::new(program).args(arguments).env("SLURM_CONF", &self.config).current_dir(folder).output().unwrap()
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        Self::script(&["stop", &self.folder.display().to_string()]);
        let _ = fs::remove_dir_all(&self.folder);
    }
}

#[test]
fn a_slurm_array_gives_the_table_of_this_machine_and_a_killed_task_is_redone_alone() {
    let Some(slurm) = Slurm::start() else { return };
    let folder = folder("sweep_slurm");
    let beamsim = env!("CARGO_BIN_EXE_beamsim");
    folder.write(
        "motion.toml",
        &DECK
            .replace("kind = \"static\"\nsteps = 2", "kind = \"dynamic\"\nend = \"n/1000\"\nstep = 1e-3")
            .replace("[param]\n", "[param]\nn = 1\n"),
    );

    // The last point takes a while: long enough to be killed.
    let counts = (1..20).map(|k| (10 * k).to_string()).collect::<Vec<_>>().join(",");
    let vary = format!("param.n={counts},120000");
    let sweep = ["sweep", "motion.toml", "--vary", &vary];
    let on_slurm = [&sweep[..], &["--out", "on slurm", "--engine", "slurm", "--poll", "0.2s"]].concat();
    let output = std::thread::scope(|scope| {
        let run = scope.spawn(|| slurm.run(beamsim, &on_slurm, &folder.0));
        let begun = Instant::now();
        let running = || {
            let listed = slurm.run("squeue", &["--me", "-h", "-r", "-t", "running", "-o", "%F_%K"], &folder.0);
            String::from_utf8_lossy(&listed.stdout).lines().find(|line| line.ends_with("_19")).map(str::to_string)
        };
        let task = loop {
            match running() {
                Some(task) => break task,
                None if begun.elapsed() > Duration::from_secs(60) => panic!("task 19 does not run"),
                None => std::thread::sleep(Duration::from_millis(50)),
            }
        };
        fine(&slurm.run("scancel", &[&task], &folder.0));
        run.join().unwrap()
    });
    assert_eq!(status(&output), 3, "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(last_line(&output), "error[sweep]: 1 of 20 points did not finish: 1 `killed` (point 20)");
    let rows = table(&folder.0.join("on slurm/sweep.csv"));
    assert!(rows[19]["message"].contains("CANCELLED") && rows[..19].iter().all(|row| row["status"] == "finished"));

    fine(&folder.beamsim(&[&sweep[..], &["--out", "here"]].concat()));
    let again = slurm.run(beamsim, &on_slurm, &folder.0);
    fine(&again);
    assert!(String::from_utf8_lossy(&again.stderr).contains("motion: 1 points in 1 tasks of the Slurm job"));
    assert_eq!(
        fs::read(folder.0.join("on slurm/sweep.csv")).unwrap(),
        fs::read(folder.0.join("here/sweep.csv")).unwrap()
    );
}
