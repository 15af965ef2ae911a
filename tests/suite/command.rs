//! The binary as a user meets it: files, exit statuses, last lines.

use super::folder::{Folder, last_line, status};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const GOOD: &str = r#"
title = "cantilever"
[param]
f = 5
[point]
root = [0, 0, 0]
tip = [1, 0, 0]
[section.s]
EA = 1e3
GA = 1e3
GJ = 10
EI = 10
rhoA = 1
[[beam]]
name = "arm"
section = "s"
through = ["root", "tip"]
elements = 4
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [0, 0, "f"]
[[stage]]
kind = "static"
steps = 4
[[expect]]
column = "tip.uz"
value = 0.16
atol = 0.02
"#;

#[test]
fn a_run_leaves_a_history_and_a_record() {
    let folder = Folder::new("run");
    folder.write("good.toml", GOOD);
    let output = folder.beamsim(&["run", "good.toml"]);
    assert_eq!(status(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(folder.names("results/good"), ["history.csv", "run.json"]);
    let history = fs::read_to_string(folder.0.join("results/good/history.csv")).unwrap();
    let mut lines = history.lines();
    let header =
        "stage,time,load,root.ux,root.uy,root.uz,root.rx,root.ry,root.rz,tip.ux,tip.uy,tip.uz,tip.rx,tip.ry,tip.rz";
    assert_eq!(lines.next(), Some(header));
    assert_eq!(lines.clone().count(), 5);
    assert!(lines.next().unwrap().starts_with("1,0.0,0.0,0.0"));
    let record: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.0.join("results/good/run.json")).unwrap()).unwrap();
    assert_eq!(record["status"], "finished");
    assert_eq!(record["deck"]["load"][0]["force"][2], 5.0);
    assert_eq!(record["counters"]["steps"], 4);
    assert!(
        record["effects"]
            .as_array()
            .unwrap()
            .iter()
            .any(|e| e["name"] == "beam elasticity, relative" && e["active"] == true)
    );
}

#[test]
fn equal_runs_give_equal_bytes() {
    let folder = Folder::new("bytes");
    folder.write("good.toml", GOOD);
    for out in ["a", "b"] {
        assert_eq!(status(&folder.beamsim(&["run", "good.toml", "--out", out])), 0);
    }
    let read = |out: &str| fs::read(folder.0.join(out).join("history.csv")).unwrap();
    assert_eq!(read("a"), read("b"));
    assert_eq!(
        status(&folder.beamsim(&["compare", "a/history.csv", "b/history.csv", "--rtol", "0", "--atol", "0"])),
        0
    );
}

#[test]
fn several_decks_get_folders_of_their_own() {
    let folder = Folder::new("several");
    folder.write("one.toml", GOOD);
    folder.write("two.toml", GOOD);
    assert_eq!(status(&folder.beamsim(&["run", "one.toml", "two.toml", "--out", "all"])), 0);
    assert_eq!(folder.names("all"), ["one", "two"]);
}

#[test]
fn set_changes_a_deck() {
    let folder = Folder::new("set");
    folder.write("good.toml", GOOD);
    let arguments = ["run", "good.toml", "--out", "b", "--set", "param.f=0.5", "--set", "stage.0.steps=2"];
    assert_eq!(status(&folder.beamsim(&["run", "good.toml", "--out", "a"])), 0);
    assert_eq!(status(&folder.beamsim(&arguments)), 0);
    let compared = folder.beamsim(&["compare", "a/history.csv", "b/history.csv"]);
    assert_eq!(status(&compared), 1);
    assert!(last_line(&compared).starts_with("error[unexpected]: 3 rows") || last_line(&compared).contains("rows"));
    let wrong = folder.beamsim(&["run", "good.toml", "--set", "beam.0.elments=2"]);
    assert_eq!(status(&wrong), 2);
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("did you mean `elements`?"));
    assert_eq!(status(&folder.beamsim(&["run", "good.toml", "--set", "beam.7.order=2"])), 2);
}

#[test]
fn verify_tells_what_came_and_leaves_nothing() {
    let folder = Folder::new("verify");
    folder.write("good.toml", GOOD);
    let fine = folder.beamsim(&["verify", "good.toml"]);
    assert_eq!(status(&fine), 0);
    assert!(String::from_utf8_lossy(&fine.stdout).contains("1 of 1 expectations hold"));
    let broken = folder.beamsim(&["verify", "good.toml", "--set", "param.f=9"]);
    assert_eq!(status(&broken), 1);
    assert_eq!(folder.names("."), ["good.toml"]);
}

#[test]
fn a_failed_run_keeps_what_it_reached() {
    let folder = Folder::new("failed");
    folder.write("good.toml", GOOD);
    assert_eq!(status(&folder.beamsim(&["run", "good.toml"])), 0);
    let tight = ["run", "good.toml", "--set", "stage.0.max_iterations=1", "--set", "stage.0.adaptive=false"];
    let failed = folder.beamsim(&tight);
    assert_eq!(status(&failed), 3);
    assert!(last_line(&failed).starts_with("error[not_converged]: "), "{}", last_line(&failed));
    assert_eq!(folder.names("results/good"), ["history.partial.csv", "run.json"]);
    let record = fs::read_to_string(folder.0.join("results/good/run.json")).unwrap();
    assert!(record.contains("\"status\": \"not_converged\""));
    // Tables along beams, too; and those of the run before do not stay.
    let along = ["--set", "output.profile=true"];
    assert_eq!(status(&folder.beamsim(&[&["run", "good.toml"], &along[..]].concat())), 0);
    assert_eq!(folder.names("results/good"), ["history.csv", "profile.csv", "run.json"]);
    assert_eq!(status(&folder.beamsim(&[&tight[..], &along].concat())), 3);
    assert_eq!(folder.names("results/good"), ["history.partial.csv", "profile.partial.csv", "run.json"]);
}

/// A history never holds NaN or infinity.
#[test]
fn results_that_overflow_are_named() {
    let folder = Folder::new("overflow");
    let stage = "kind = \"dynamic\"\nend = 1\nstep = 0.1\n[[initial]]\nvelocity = [1e200, 0, 0]\n[output]\ncolumns = [\"energy\"]";
    let free = GOOD.replace("at = \"root\"\nfix = \"all\"", "at = \"root\"\nfix = [\"uy\"]");
    folder.write(
        "far.toml",
        &free
            .replace("kind = \"static\"\nsteps = 4", stage)
            .replace("[[expect]]\ncolumn = \"tip.uz\"\nvalue = 0.16\natol = 0.02\n", ""),
    );
    let output = folder.beamsim(&["run", "far.toml"]);
    assert_eq!(status(&output), 3, "{}", String::from_utf8_lossy(&output.stderr));
    assert!(last_line(&output).starts_with("error[non_finite]: a column of the history"), "{}", last_line(&output));
    assert_eq!(folder.names("results/far"), ["history.partial.csv", "run.json"]);
}

#[test]
fn wrong_decks_and_missing_files_have_their_status() {
    let folder = Folder::new("status");
    folder.write("bad.toml", "[[beam]]\nname = 3\n");
    let wrong = folder.beamsim(&["run", "bad.toml"]);
    assert_eq!((status(&wrong), folder.names(".")), (2, vec!["bad.toml".to_string()]));
    assert!(last_line(&wrong).starts_with("error[deck]: "), "{}", last_line(&wrong));
    let missing = folder.beamsim(&["run", "missing.toml"]);
    assert_eq!(status(&missing), 4);
    assert!(last_line(&missing).starts_with("error[io]: missing.toml"));
    folder.write("huge.toml", &GOOD.replace("elements = 4", "elements = 1e12"));
    let huge = folder.beamsim(&["check", "huge.toml"]);
    assert_eq!(status(&huge), 2);
    assert!(last_line(&huge).starts_with("error[limit]: "));
    assert_eq!(status(&folder.beamsim(&["frobnicate"])), 2);
    folder.write("file", "");
    folder.write("good.toml", GOOD);
    assert_eq!(status(&folder.beamsim(&["run", "good.toml", "--out", "file"])), 4);
}

/// A negative number is the value of the option before it: what is wrong is its value, not its sign.
#[test]
fn negative_numbers_are_values_of_options() {
    let folder = Folder::new("negative");
    folder.write("good.toml", GOOD);
    folder.write("bar.csv", "a,b\n1,nan\n");
    for (words, told) in [
        (&["run", "good.toml", "--accuracy", "-1"][..], "--accuracy"),
        (&["run", "good.toml", "--budget", "-1"], "--budget"),
        (&["run", "good.toml", "--threads", "-1"], "--threads"),
        (&["run", "good.toml", "--set", "-1"], "-1"),
        (&["compare", "bar.csv", "bar.csv", "--rtol", "-0.001"], "--rtol and --atol must be finite"),
        (&["effects", "good.toml", "--tolerance", "-0.5"], "tolerance"),
        (&["sweep", "good.toml", "--vary", "param.f=1:2", "--sample", "-1"], "--sample"),
        (&["sweep", "good.toml", "--vary", "param.f=1:2", "--sample", "2", "--seed", "-1"], "--seed"),
    ] {
        let output = folder.beamsim(words);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(status(&output), 2, "{words:?}: {text}");
        assert!(last_line(&output).contains(told), "{words:?}: {text}");
        assert!(!text.contains("unexpected argument") && !text.contains("-- -"), "{words:?}: {text}");
    }
    // Other values that begin with `-` are joined to their option; `--` would make decks of them.
    for (words, tip) in
        [(["--budget", "-5s"], "by `=`"), (["--accuracy", "-1e-3"], "by `=`"), (["--times", "3"], "--help")]
    {
        let output = folder.beamsim(&[&["run", "good.toml"][..], &words].concat());
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(status(&output) == 2 && text.contains(tip) && !text.contains("use '-- "), "{text}");
    }
    assert_eq!(status(&folder.beamsim(&["run", "good.toml", "--set", "param.f=-5"])), 0);
    let same = folder.beamsim(&["compare", "bar.csv", "bar.csv"]);
    assert!(status(&same) == 0 && String::from_utf8_lossy(&same.stdout).contains("NaN in both histories"));
}

/// A ball that falls on the ground: its contact has columns that change in jumps.
const FALLING: &str = r#"
gravity = [0, 0, -9.81]
[point]
ball = [0, 0, 0.2]
[[body]]
at = "ball"
mass = 1
inertia = [0.01, 0.01, 0.01]
[[surface]]
name = "ground"
kind = "plane"
point = [0, 0, 0]
normal = [0, 0, 1]
[[contact]]
name = "fall"
nodes = ["ball"]
surfaces = ["ground"]
radius = 0.1
stiffness = 1e4
[output]
columns = ["x", "contact"]
[[stage]]
kind = "dynamic"
end = 0.2
step = 1e-3
"#;

#[test]
fn outputs_that_jump_are_refused_before_a_run_and_by_check() {
    let folder = Folder::new("jumps");
    folder.write("good.toml", FALLING);
    assert_eq!(status(&folder.beamsim(&["check", "good.toml"])), 0);
    folder.write("accuracy.toml", &format!("accuracy = {{ \"fall.points\" = 1e-3 }}\n{FALLING}"));
    folder.write("cost.toml", &format!("{FALLING}[cost]\noutputs = [\"ball.z\", \"fall.points\"]\n"));
    for (command, deck) in
        [("run", "accuracy.toml"), ("check", "accuracy.toml"), ("cost", "cost.toml"), ("check", "cost.toml")]
    {
        let output = folder.beamsim(&[command, deck]);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(status(&output), 2, "{command} {deck}: {told}");
        assert!(told.contains("`fall.points` changes in jumps"), "{command} {deck}: {told}");
    }
    // Other commands do not look at [cost].
    assert_eq!(status(&folder.beamsim(&["run", "cost.toml"])), 0);
}

#[test]
fn check_tells_what_would_be_simulated() {
    let folder = Folder::new("check");
    folder.write("good.toml", GOOD);
    let output = folder.beamsim(&["check", "good.toml"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(status(&output), 0);
    for words in [
        "5 nodes, 4 elements, 12 free unknowns",
        "on  planar",
        "mass 1,",
        "on  beam elasticity",
        "off gravity on beams",
        "ms on this machine (measured)",
    ] {
        assert!(text.contains(words), "{words:?} is missing in\n{text}");
    }
    folder.write("long.toml", &swinging(1e6));
    let text = String::from_utf8_lossy(&folder.beamsim(&["check", "long.toml"]).stdout).into_owned();
    assert!(text.contains(" reached stage 1, time "), "{text}");
    folder.write("loose.toml", &GOOD.replace("fix = \"all\"", "fix = [\"ux\", \"uz\", \"rx\", \"ry\", \"rz\"]"));
    let output = folder.beamsim(&["check", "loose.toml"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(status(&output) == 3 && !text.contains("run: about"), "{text}");
    assert!(last_line(&output).starts_with("error[singular]: node"), "{}", last_line(&output));
    // One that fails later is told of, and can be run.
    let short = GOOD.replace("steps = ", "adaptive = false\nmax_iterations = 1\nsteps = ");
    folder.write("short.toml", &short);
    let output = folder.beamsim(&["check", "short.toml"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        status(&output) == 0 && said.contains("the run will fail with `not_converged`: no convergence at stage 1"),
        "{said}"
    );
    assert!(said.contains("hint: remove `adaptive = false`"), "{said}");
}

/// A cantilever whose load comes smoothly, and stays.
fn swinging(end: f64) -> String {
    let load = "force = [0, 0, \"f\"]\nhistory = \"h\"\n[history.h]\ntimes = [0, 0.5]\nvalues = [0, 1]\nsmooth = true";
    let (head, _) = GOOD.split_once("[[stage]]").unwrap();
    let head = head.replace("force = [0, 0, \"f\"]", load);
    format!(
        "{head}[[stage]]\nkind = \"dynamic\"\nend = {end:?}\nstep = 0.01\n[output]\nnodes = [\"tip\"]\ncolumns = [\"u\", \"r\", \"energy\"]\n"
    )
}

#[test]
fn effects_writes_its_table_and_tells_what_may_go() {
    let folder = Folder::new("effects");
    folder.write("good.toml", GOOD);
    let output = folder.beamsim(&["effects", "good.toml", "--out", "out", "--tolerance", "0.5"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(status(&output), 0, "{text}");
    for words in ["all effects: ", "large_rotations ", "not in this scene: ", "within 0.5: "] {
        assert!(text.contains(words), "{words:?} is missing in\n{text}");
    }
    assert_eq!(folder.names("out"), ["effects.csv"]);
    assert_eq!(status(&folder.beamsim(&["effects", "good.toml", "--tolerance", "-1"])), 2);
    folder.write("bad.toml", "[point]\na = 1\n");
    assert_eq!(status(&folder.beamsim(&["effects", "bad.toml"])), 2);
}

/// A run of a billion steps, stopped by a signal after its first rows.
#[test]
fn cost_writes_its_table_and_plot_and_prints_lines_for_an_accuracy() {
    let folder = Folder::new("cost");
    folder.write("deck.toml", GOOD);
    let output =
        folder.beamsim(&["cost", "deck.toml", "--vary", "order=1,2", "--vary", "elements=1,2,4", "--accuracy", "1e-3"]);
    assert_eq!(status(&output), 0, "{}", last_line(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    for part in ["reference: ", "orders of convergence", "1e-3 costs ", "in [[beam]] of beam arm:", "--set beam.0."] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
    assert_eq!(folder.names("results/deck"), ["cost.csv", "cost.svg"]);
    let table = fs::read_to_string(folder.0.join("results/deck/cost.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + 2 * 2 * 3);
    let plot = fs::read_to_string(folder.0.join("results/deck/cost.svg")).unwrap();
    assert!(plot.contains("CPU time [s]") && plot.contains("order 2, relative") && !plot.contains("NaN"));
}

/// The pictures that `beamsim section` draws of sections with a shape.
fn pictures_of(sections: &[&str]) -> Vec<String> {
    let kinds = ["", "-warping", "-stress-N1", "-stress-N2", "-stress-N3", "-stress-M1", "-stress-M2", "-stress-M3"];
    let mut names: Vec<String> =
        sections.iter().flat_map(|name| kinds.map(|kind| format!("{name}{kind}.svg"))).collect();
    names.sort();
    names
}

#[test]
fn section_shows_numbers_and_draws() {
    let folder = Folder::new("section");
    let box_section = "[material.m]\nE = 100\nnu = 0.3\nrho = 2\n[section.box]\nshape = \"box\"\nmaterial = \"m\"\n\
                       d = 2\nb = 1\nt = 0.1\n[section.rod]\nEA = 1\nGA = 1\nGJ = 1\nEI = 1\n";
    folder.write("deck.toml", box_section);
    let output = folder.beamsim(&["section", "deck.toml"]);
    assert_eq!(status(&output), 0, "{}", last_line(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    for part in ["section box\n", "nodes", "shear centre: (0.0, 0.0)", "[section.box]\n", "section rod\n"] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
    assert_eq!(folder.names("results/deck"), pictures_of(&["box"]));
    // The printed table is a section again, with the same numbers.
    let start = text.find("[section.box]").unwrap();
    let end = start + text[start..].find("results").unwrap();
    folder.write("pasted.toml", &text[start..end]);
    let again = folder.beamsim(&["section", "pasted.toml", "box", "--json"]);
    let numbers: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
    let area = 2.0 - 0.8 * 1.8;
    let computed = folder.beamsim(&["section", "deck.toml", "box", "--json"]);
    let computed: serde_json::Value = serde_json::from_slice(&computed.stdout).unwrap();
    assert_eq!(numbers["stiffness"], computed["stiffness"]);
    assert!((numbers["ea"].as_f64().unwrap() / (100.0 * area) - 1.0).abs() < 1e-6, "{numbers}");
    assert!((numbers["mass"][0][0].as_f64().unwrap() / (2.0 * area) - 1.0).abs() < 1e-6, "{numbers}");
    let output = folder.beamsim(&["section", "deck.toml", "bax"]);
    assert_eq!((status(&output), last_line(&output).contains("no section `bax`")), (2, true));
}

#[test]
fn pictures_of_sections_do_not_overwrite_each_other() {
    let folder = Folder::new("section_names");
    let mut deck = "[material.m]\nE = 1\nnu = 0.3\n".to_string();
    for name in ["a/b", "a_b", "A_B-warping"] {
        deck += &format!("[section.\"{name}\"]\nshape = \"box\"\nmaterial = \"m\"\nd = 2\nb = 1\nt = 0.1\n");
    }
    folder.write("deck.toml", &deck);
    assert_eq!(status(&folder.beamsim(&["section", "deck.toml"])), 0);
    assert_eq!(folder.names("results/deck"), pictures_of(&["A_B-warping_2", "a_b", "a_b_2"]));
    // One section alone has the same picture.
    assert_eq!(status(&folder.beamsim(&["section", "deck.toml", "a_b", "--out", "alone"])), 0);
    assert_eq!(folder.names("alone"), pictures_of(&["a_b_2"]));
}

#[test]
fn section_warns_of_coarse_meshes() {
    let folder = Folder::new("coarse_section");
    let flat = "[material.m]\nE = 1\nnu = 0.3\n[section.flat]\nshape = \"ellipse\"\nmaterial = \"m\"\n\
                width = 100\nheight = 1\nmesh = { size = 1000 }\n";
    folder.write("deck.toml", flat);
    let output = folder.beamsim(&["section", "deck.toml"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!((status(&output), errors.contains("warning[coarse_section]")), (0, true), "{errors}");
    let output = folder.beamsim(&["section", "deck.toml", "--deny-warnings"]);
    assert!(status(&output) != 0 && last_line(&output).contains("1 warning(s)"), "{}", last_line(&output));
}

/// The first step on offer fails in two steps of five, and takes three times the iterations of half of it.
#[test]
fn a_search_gives_up_steps_that_fail() {
    let folder = Folder::new("offer");
    let deck = concat!(env!("CARGO_MANIFEST_DIR"), "/decks/spin_up.toml");
    assert_eq!(status(&folder.beamsim(&["run", deck, "--accuracy", "1e-2", "--out", "r"])), 0);
    let record: serde_json::Value = serde_json::from_slice(&fs::read(folder.0.join("r/run.json")).unwrap()).unwrap();
    // It is tried alone; a round follows, and another one where it had told something.
    assert_eq!(record["accuracy"]["runs"], 4);
}

/// A stretched strip whose curvature decays within a fortieth of its length.
const STRETCHED: &str = "[point]\nroot = [0, 0, 0]\nend = [1, 0, 0]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 20\nEI = 1\n\
     [[beam]]\nname = \"strip\"\nsection = \"s\"\nthrough = [\"root\", \"end\"]\nelements = 40\n\
     [[support]]\nat = \"root\"\nfix = \"all\"\n[[support]]\nat = \"end\"\nfix = [\"uy\", \"uz\", \"rx\", \"ry\", \"rz\"]\n\
     [[load]]\nat = \"end\"\nforce = [1600, 0, 0]\n[[load]]\nat = \"strip@0.4\"\nforce = [0, 0, -500]\n\
     [[stage]]\nkind = \"static\"\nsteps = 4\n[output]\nnodes = [\"strip:16\"]\ncolumns = [\"u\"]\n";

#[test]
fn placed_elements_are_told_beside_equal_ones() {
    let folder = Folder::new("placed");
    folder.write("deck.toml", STRETCHED);
    let output = folder.beamsim(&["run", "deck.toml", "--accuracy", "1e-6"]);
    assert_eq!(status(&output), 0, "{}", last_line(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains(" equal elements: error ") && text.contains(" placed elements: error "), "{text}");
    assert!(text.contains("    elements = [[0."), "{text}");
    let record: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.0.join("results/deck/run.json")).unwrap()).unwrap();
    let found = &record["accuracy"];
    let meshes = &found["meshes"];
    assert_eq!(meshes["taken"], "placed");
    assert!(meshes["placed"]["elements"].as_u64().unwrap() < meshes["equal"]["elements"].as_u64().unwrap());
    assert!(meshes["placed"]["estimate"].as_f64().unwrap() <= 1e-6 && meshes["predicted"].as_f64().unwrap() < 0.8);
    let settings: Vec<&str> = found["settings"].as_array().unwrap().iter().map(|s| s.as_str().unwrap()).collect();
    let again: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
    assert_eq!(status(&folder.beamsim(&[&["run", "deck.toml", "--out", "again"][..], &again].concat())), 0);
    let history = fs::read(folder.0.join("results/deck/history.csv")).unwrap();
    assert_eq!(history, fs::read(folder.0.join("again/history.csv")).unwrap());
    let check = folder.beamsim(&[&["check", "deck.toml"][..], &again].concat());
    assert!(String::from_utf8_lossy(&check.stdout).contains(" elements of order 3 and lengths 0.0"));
}

#[test]
fn run_reaches_an_accuracy_and_says_with_what() {
    let folder = Folder::new("accuracy");
    folder.write("deck.toml", GOOD);
    let output = folder.beamsim(&["run", "deck.toml", "--accuracy", "1e-5"]);
    assert_eq!(status(&output), 0, "{}", last_line(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("estimated error ") && text.contains("in [[beam]] of beam arm:"), "{text}");
    let record: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.0.join("results/deck/run.json")).unwrap()).unwrap();
    let found = &record["accuracy"];
    assert!(found["columns"]["tip.uz"][1].as_f64().unwrap() <= 1e-5);
    let settings: Vec<&str> = found["settings"].as_array().unwrap().iter().map(|s| s.as_str().unwrap()).collect();
    let history = fs::read(folder.0.join("results/deck/history.csv")).unwrap();
    let again: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
    assert_eq!(status(&folder.beamsim(&[&["run", "deck.toml", "--out", "again"][..], &again].concat())), 0);
    assert_eq!(history, fs::read(folder.0.join("again/history.csv")).unwrap());

    // The same from the deck; and what a budget does not allow is refused.
    folder.write("wanted.toml", &format!("accuracy = 1e-5\n{GOOD}"));
    assert_eq!(status(&folder.beamsim(&["run", "wanted.toml"])), 0);
    assert_eq!(history, fs::read(folder.0.join("results/wanted/history.csv")).unwrap());
    let refused = folder.beamsim(&["run", "deck.toml", "--accuracy", "1e-5", "--budget", "0s", "--out", "none"]);
    assert_eq!((status(&refused), folder.0.join("none").exists()), (2, false));
    assert!(last_line(&refused).starts_with("error[limit]: "));
    for wrong in ["2", "0", "1e-303"] {
        assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--accuracy", wrong])), 2);
        assert_eq!(status(&folder.beamsim(&["cost", "deck.toml", "--accuracy", wrong])), 2);
    }
    assert_eq!(status(&folder.beamsim(&["cost", "deck.toml", "--vary", "order"])), 2);
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--budget", "5s"])), 2);
}

/// Rows at an interval, modes of a stage before, error bars, a warning; and pictures, for which it does run again.
#[test]
fn what_a_search_has_run_is_written_as_if_it_ran_again() {
    let folder = Folder::new("retold");
    let more = "[[stage]]\nkind = \"modal\"\nmodes = 3\n[[stage]]\nkind = \"dynamic\"\nend = 0.4\nstep = 0.02\n[output]\ninterval = 0.1\n";
    let (deck, _) = GOOD.split_once("[[expect]]").unwrap();
    folder.write("deck.toml", &format!("{deck}{more}"));
    for (number, extra) in [&[][..], &["--error-bars"], &["--report"]].into_iter().enumerate() {
        let [found, again] = ["found", "again"].map(|name| format!("{name}{number}"));
        let run = [&["run", "deck.toml", "--accuracy", "1e-3", "--out", &found][..], extra].concat();
        assert_eq!(status(&folder.beamsim(&run)), 0);
        let read = |name: &str, file: &str| fs::read(folder.0.join(name).join(file)).unwrap();
        let record = |name: &str| serde_json::from_slice::<serde_json::Value>(&read(name, "run.json")).unwrap();
        let settings = record(&found)["accuracy"]["settings"].clone();
        let settings: Vec<&str> = settings.as_array().unwrap().iter().map(|s| s.as_str().unwrap()).collect();
        let again_with: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
        let run = [&["run", "deck.toml", "--out", &again][..], extra, &again_with].concat();
        assert_eq!(status(&folder.beamsim(&run)), 0);
        assert_eq!(folder.names(&found), folder.names(&again));
        for file in ["history.csv", "modes.csv"] {
            assert!(read(&found, file) == read(&again, file), "{file} with {extra:?}");
        }
        let [found, again] = [&found, &again].map(|name| record(name));
        assert_eq!(
            [&found["counters"], &found["deck"], &found["text"], &found["warnings"], &found["stability"]],
            [&again["counters"], &again["deck"], &again["text"], &again["warnings"], &again["stability"]]
        );
    }
}

#[test]
fn error_bars_hold_the_error() {
    let folder = Folder::new("error_bars");
    folder.write("deck.toml", GOOD);
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--error-bars", "--out", "bars"])), 0);
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--accuracy", "1e-8", "--out", "exact"])), 0);
    let [bars, exact] = ["bars", "exact"]
        .map(|run| beamsim::output::HistoryReader::read(&folder.0.join(run).join("history.csv")).unwrap());
    for name in ["tip.ux", "tip.uz", "tip.ry"] {
        let last = |history: &beamsim::output::HistoryReader, name: &str| {
            history.rows.last().unwrap()[history.names.iter().position(|n| n == name).unwrap()]
        };
        let (error, bar) = ((last(&bars, name) - last(&exact, name)).abs(), last(&bars, &format!("{name}.err")));
        assert!(error <= bar && bar <= 10.0 * error, "{name}: {error:e} in {bar:e}");
    }
    // The stored history is within the bars, and not without them.
    let compare =
        |files: [&str; 2]| status(&folder.beamsim(&["compare", files[0], files[1], "--rtol", "0", "--atol", "1e-15"]));
    assert_eq!(compare(["exact/history.csv", "bars/history.csv"]), 0);
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--out", "plain"])), 0);
    assert_eq!(compare(["exact/history.csv", "plain/history.csv"]), 1);

    folder.write("path.toml", &GOOD.replace("kind = \"static\"", "kind = \"static\"\ncontrol = \"arc_length\""));
    let refused = folder.beamsim(&["run", "path.toml", "--error-bars"]);
    assert_eq!((status(&refused), last_line(&refused)), (2, "error[deck]: 1 error in path.toml".into()));
}

#[test]
fn resultants_are_worth_an_order_less_than_places() {
    let folder = Folder::new("resultants");
    // A force across what it bends: resultants vary along the beam.
    folder.write(
        "deck.toml",
        &GOOD.replace(
            "[[expect]]",
            "[output]\nnodes = [\"root\", \"tip\"]\ncolumns = [\"u\", \"resultant\"]\n[[expect]]",
        ),
    );
    let finer = ["--set", "beam.0.elements=24", "--set", "beam.0.order=3", "--set", "beam.0.numbering=4"];
    assert_eq!(status(&folder.beamsim(&[&["run", "deck.toml", "--out", "finer"][..], &finer].concat())), 0);
    let read = |run: &str| beamsim::output::HistoryReader::read(&folder.0.join(run).join("history.csv")).unwrap();
    let finer = read("finer");
    let last = |history: &beamsim::output::HistoryReader, name: &str| {
        let column = history.names.iter().position(|known| known == name).unwrap_or_else(|| panic!("{name}"));
        history.rows.last().unwrap()[column]
    };
    for (number, order) in ["1", "2", "3"].into_iter().enumerate() {
        let setting = format!("beam.0.order={order}");
        let words =
            ["run", "deck.toml", "--error-bars", "--set", &setting, "--set", "beam.0.elements=12", "--out", order];
        assert_eq!(status(&folder.beamsim(&words)), 0);
        let bars = read(order);
        for name in ["root.N1", "root.M2", "root.M3", "tip.N3", "tip.M2"] {
            let (error, bar) = ((last(&bars, name) - last(&finer, name)).abs(), last(&bars, &format!("{name}.err")));
            assert!(error <= bar, "{name} of order {}: {error:e} in {bar:e}", number + 1);
        }
    }
    let column = r#"accuracy={ "root.M2" = 1e-4 }"#;
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--set", column, "--out", "wanted"])), 0);
    let wanted = read("wanted");
    let (error, moment) = (last(&wanted, "root.M2") - last(&finer, "root.M2"), last(&finer, "root.M2"));
    assert!(error.abs() <= 1e-4 * moment.abs() && error != 0.0, "{error:e} of {moment:e}");
}

#[test]
fn error_bars_hold_the_errors_of_a_motion_from_its_first_row_on() {
    let folder = Folder::new("error_bars_of_a_motion");
    folder.write("deck.toml", &swinging(0.5));
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--error-bars", "--out", "bars"])), 0);
    let finer = ["beam.0.elements=8", "beam.0.order=3", "stage.0.step=0.00125"];
    let words: Vec<&str> = finer.iter().flat_map(|setting| ["--set", setting]).collect();
    assert_eq!(status(&folder.beamsim(&[&["run", "deck.toml", "--out", "exact"][..], &words].concat())), 0);
    // Rows of the coarser steps are every other one; those between have the bar of the next.
    let read = |run: &str| beamsim::output::HistoryReader::read(&folder.0.join(run).join("history.csv")).unwrap();
    let [bars, exact] = ["bars", "exact"].map(read);
    let column = |history: &beamsim::output::HistoryReader, name: &str| {
        history.names.iter().position(|known| known == name).unwrap()
    };
    for name in ["tip.ux", "tip.uz", "tip.ry", "energy.kinetic", "energy.strain"] {
        let (own, bar, other) = (column(&bars, name), column(&bars, &format!("{name}.err")), column(&exact, name));
        let mut largest = 0.0_f64;
        for (k, row) in bars.rows.iter().enumerate() {
            let error = (row[own] - exact.rows[8 * k][other]).abs();
            assert!(error <= row[bar] + 1e-15, "{name} at row {k}: {error:e} in {:e}", row[bar]);
            largest = largest.max(error);
        }
        let last = bars.rows.last().unwrap()[bar];
        assert!(last <= 10.0 * largest && largest > 0.0, "{name}: {largest:e} in {last:e}");
    }
    assert_eq!(bars.rows.len(), 51);
}

#[test]
fn error_bars_know_the_error_of_steps_that_an_interval_cuts() {
    let folder = Folder::new("error_bars_of_an_interval");
    folder.write("deck.toml", &format!("{}interval = 0.02\n", swinging(0.5).replace("step = 0.01", "step = 0.1")));
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--error-bars", "--out", "bars"])), 0);
    let finer = ["--set", "stage.0.step=0.001", "--out", "exact"];
    assert_eq!(status(&folder.beamsim(&[&["run", "deck.toml"][..], &finer].concat())), 0);
    let compare = |rtol| {
        status(&folder.beamsim(&[
            "compare",
            "exact/history.csv",
            "bars/history.csv",
            "--rtol",
            rtol,
            "--atol",
            "1e-12",
        ]))
    };
    assert_eq!(compare("0"), 0);
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--out", "plain"])), 0);
    let plain =
        folder.beamsim(&["compare", "exact/history.csv", "plain/history.csv", "--rtol", "0", "--atol", "1e-12"]);
    assert_eq!(status(&plain), 1);
}

#[test]
fn a_wanted_accuracy_holds_after_the_first_step_behind_a_jump() {
    let folder = Folder::new("accuracy_behind_a_jump");
    folder.write("deck.toml", &std::fs::read_to_string("decks/minimal/damping.toml").unwrap());
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--accuracy", "3e-3", "--out", "wanted"])), 0);
    let record: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.0.join("wanted/run.json")).unwrap()).unwrap();
    let read = |run: &str| beamsim::output::HistoryReader::read(&folder.0.join(run).join("history.csv")).unwrap();
    // Rows are the start, one load level, then steps.
    let wanted = read("wanted");
    let step = format!("stage.1.step={:?}", wanted.rows[2][1] / 4.0);
    let settings = record["accuracy"]["settings"].as_array().unwrap().iter().map(|setting| setting.as_str().unwrap());
    let words = settings.chain([&*step]).flat_map(|setting| ["--set", setting]);
    let finer = ["run", "deck.toml", "--out", "finer"].into_iter().chain(words);
    assert_eq!(status(&folder.beamsim(&finer.collect::<Vec<_>>())), 0);
    let finer = read("finer");
    let column = wanted.names.iter().position(|name| name == "energy.damped").unwrap();
    let error = (wanted.rows[2][column] - finer.rows[5][column]).abs() / 0.005;
    assert!((wanted.rows[2][1] - finer.rows[5][1]).abs() < 1e-12, "rows at the same time");
    assert!(error > 0.0 && error <= 3e-3, "{error:e}");
}

#[test]
fn the_lines_of_a_study_of_a_motion_give_their_errors_again() {
    let folder = Folder::new("lines_of_a_study");
    folder.write("deck.toml", &swinging(0.5));
    let finer = ["--set", "beam.0.elements=16", "--set", "beam.0.order=3", "--set", "stage.0.step=0.00125"];
    assert_eq!(status(&folder.beamsim(&[&["run", "deck.toml", "--out", "exact"][..], &finer].concat())), 0);
    let cost = |words: &[&str], out: &str| -> Vec<std::collections::HashMap<String, String>> {
        let all = [&["cost", "deck.toml", "--reference", "exact/history.csv", "--out", out][..], words].concat();
        let output = folder.beamsim(&all);
        assert_eq!(status(&output), 0, "{}", last_line(&output));
        let table = fs::read(folder.0.join(out).join("cost.csv")).unwrap();
        csv::Reader::from_reader(&table[..]).deserialize().map(|row| row.unwrap()).collect()
    };
    let frontier: Vec<_> =
        cost(&["--vary", "step=2,1,0.5"], "all").into_iter().filter(|run| run["frontier"] == "true").collect();
    assert!(frontier.len() > 3);
    for run in frontier {
        let settings: Vec<&str> =
            run["settings"].split(' ').filter(|s| !s.is_empty()).flat_map(|s| ["--set", s]).collect();
        let vary = [format!("order={}", run["order"]), format!("interpolation={}", run["interpolation"])];
        let scheme = if run["settings"].contains("lobatto") { "scheme=lobatto" } else { "scheme=newmark" };
        let one =
            ["--vary", &vary[0], "--vary", &vary[1], "--vary", "elements=1", "--vary", "step=1", "--vary", scheme];
        let again = cost(&[&settings[..], &one].concat(), "one");
        assert_eq!((again.len(), &again[0]["error"]), (1, &run["error"]), "{}", run["settings"]);
        assert_eq!(again[0]["iterations"], run["iterations"]);
    }
}

#[test]
fn cost_within_a_budget_tells_what_it_left_out_and_goes_on() {
    let folder = Folder::new("cost_budget");
    folder.write("deck.toml", GOOD);
    let output = folder.beamsim(&["cost", "deck.toml", "--budget", "0s"]);
    assert_eq!((status(&output), last_line(&output).starts_with("error[limit]: the budget is too small")), (2, true));
    assert_eq!(folder.names("results/deck"), ["cost.journal"]);
    let output = folder.beamsim(&["cost", "deck.toml"]);
    assert_eq!(status(&output), 0);
    assert_eq!(folder.names("results/deck"), ["cost.csv", "cost.svg"]);
}

#[test]
fn wrong_words_for_a_study_are_told() {
    let folder = Folder::new("cost_wrong");
    folder.write("deck.toml", GOOD);
    for (arguments, words) in [
        (&["--vary", "order=4"][..], "1 error in deck.toml"),
        (&["--vary", "ordre=1"], "1 error in deck.toml"),
        (&["--set", "cost.outputs=tip.vx"], "1 error in deck.toml"),
        (&["--reference", "expect", "--set", "expect.0.fails=limit"], "1 error in deck.toml"),
        (&["--budget", "soon"], "invalid"),
        (&["--accuracy", "0"], "--accuracy: an accuracy must be between"),
        (&["--reference", "nothing.csv"], "nothing.csv"),
    ] {
        let output = folder.beamsim(&[&["cost", "deck.toml"], arguments].concat());
        assert!([2, 4].contains(&status(&output)), "{arguments:?}");
        assert!(last_line(&output).contains(words), "{arguments:?}: {}", last_line(&output));
    }
}

fn interrupted(name: &str, signal: &str) -> (i32, Vec<String>) {
    let folder = Folder::new(name);
    let stage = "kind = \"dynamic\"\nend = 1e6\nstep = 0.01";
    folder.write("long.toml", &GOOD.replace("kind = \"static\"\nsteps = 4", stage));
    let mut child = Command::new(env!("CARGO_BIN_EXE_beamsim"))
        .args(["run", "long.toml"])
        .current_dir(&folder.0)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let results = folder.0.join("results/long");
    let has_rows = || {
        let parts = fs::read_dir(&results).into_iter().flatten().flatten();
        parts.filter_map(|part| part.metadata().ok()).any(|part| part.len() > 0)
    };
    let start = Instant::now();
    while !has_rows() && start.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(20));
    }
    Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    (child.wait().unwrap().code().unwrap_or(-1), folder.names("results/long"))
}

#[test]
fn an_interrupted_run_keeps_what_it_reached() {
    let left = ["checkpoint", "history.partial.csv", "run.json"].map(String::from).to_vec();
    assert_eq!(interrupted("interrupted", "-INT"), (130, left.clone()));
    assert_eq!(interrupted("terminated", "-TERM"), (143, left.clone()));
    assert_eq!(interrupted("hung_up", "-HUP"), (129, left));
}

#[test]
fn a_closed_pipe_is_a_quiet_end() {
    let folder = Folder::new("pipe");
    folder.write("good.toml", GOOD);
    let mut child = Command::new(env!("CARGO_BIN_EXE_beamsim"))
        .args(["run", "good.toml"])
        .current_dir(&folder.0)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(folder.names("results/good"), ["history.csv", "run.json"]);
}

/// What is written does not depend on the run, nor on how many threads the machine offers.
#[test]
fn twenty_runs_give_equal_bytes() {
    let folder = Folder::new("equal_runs");
    let deck = concat!(env!("CARGO_MANIFEST_DIR"), "/decks/robot_arm.toml");
    let history = |number: usize| {
        let out = format!("out{number}");
        let mut command = Command::new(env!("CARGO_BIN_EXE_beamsim"));
        command.args(["run", deck, "--set", "stage.0.end=0.2", "--out", &out]).current_dir(&folder.0);
        command.env("RAYON_NUM_THREADS", (1 + number % 8).to_string());
        assert_eq!(status(&command.output().unwrap()), 0);
        fs::read(folder.0.join(out).join("history.csv")).unwrap()
    };
    let first = history(0);
    assert!(first.len() > 1000);
    for number in 1..20 {
        assert!(history(number) == first, "run {number} wrote other bytes");
    }
}

/// Elements side by side do what elements alone do, in the same order: equal bytes whatever the instructions.
#[test]
fn histories_do_not_depend_on_instructions() {
    let decks = [
        "robot_arm.toml",
        "hard/r06_mixed_elements.toml",
        "hard/r03_half_circle_skew.toml",
        "hard/d07_flying_3d.toml",
        "minimal/section_6x6.toml",
        "minimal/free_strain.toml",
        "minimal/line_load_follower.toml",
        "minimal/lie_generalized_alpha.toml",
        "minimal/section_mass.toml",
        "paths/ring_pressure_quarter.toml",
        "hard/d14_robot_arm_60.toml",
    ];
    let folder = Folder::new("instructions");
    for deck in decks {
        let deck = Path::new(env!("CARGO_MANIFEST_DIR")).join("decks").join(deck);
        let history = |instructions: &str| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_beamsim"));
            command.current_dir(&folder.0).env("BEAMSIM_INSTRUCTIONS", instructions);
            let output = command.arg("run").arg(&deck).args(["--out", instructions]).output().unwrap();
            assert_eq!(status(&output), 0, "{deck:?} with {instructions}: {}", last_line(&output));
            fs::read(folder.0.join(instructions).join("history.csv")).unwrap()
        };
        assert!(history("baseline") == history("widest"), "{deck:?}");
    }
}

#[test]
fn fields_belong_to_the_history_beside_them() {
    let folder = Folder::new("fields");
    folder.write("deck.toml", &format!("{GOOD}[output]\nvtk = true\n"));
    let run = |settings: &[&str]| {
        let words: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
        status(&folder.beamsim(&[&["run", "deck.toml", "--out", "r"][..], &words].concat()))
    };
    assert_eq!(run(&["output.every=3"]), 0);
    // The start, the third level, and the last.
    assert_eq!(folder.names("r/fields"), ["000000.vtu", "000001.vtu", "000002.vtu"]);
    let index = fs::read_to_string(folder.0.join("r/fields.pvd")).unwrap();
    assert!(index.contains("timestep=\"4.0\" part=\"0\" file=\"fields/000002.vtu\""), "{index}");
    assert_eq!(run(&["support.0.fix=uz"]), 3);
    assert_eq!(folder.names("r"), ["fields.partial", "fields.partial.pvd", "history.partial.csv", "run.json"]);
    assert_eq!(run(&["output.vtk=false"]), 0);
    assert_eq!(folder.names("r"), ["history.csv", "run.json"]);
}

/// What a table says is what a deck says that holds the same numbers; results, sweeps and reports know it by themselves.
#[test]
fn tables_beside_a_deck_are_read_from_its_folder() {
    let folder = Folder::new("import");
    fs::create_dir(folder.0.join("in")).unwrap();
    folder.write("in/spine.csv", "x,y,z\n0,0,0\n1,0,0\n2,0.5,0\n");
    folder.write("in/blade.csv", "# from another program\nfraction,EA,GA2,GA3,GJ,EI2,EI3,rhoA\n0,4e3,4e3,4e3,40,40,30,2\n0.25,2e3,2e3,2e3,20,20,20,1\n1,1e3,1e3,1e3,10,10,10,1\n");
    folder.write("in/gust.csv", "time,drag,lift\n0,0,0\n0.1,5,1\n0.2,5,0\n");
    let rest = "[[support]]\nat = \"b@start\"\nfix = \"all\"\n[[load]]\nat = \"b@end\"\nforce = [0, 0, 3]\nhistory = \"gust\"\n\
                [[stage]]\nkind = \"dynamic\"\nend = 0.2\nstep = 0.02\n[output]\nnodes = [\"b@end\", \"b@0.6\"]\ncolumns = [\"u\", \"resultant\"]\n";
    let tables = format!(
        "[[beam]]\nname = \"b\"\nthrough = {{ csv = \"spine.csv\" }}\nsection = {{ csv = \"blade.csv\" }}\nelements = 4\n\
         [history.gust]\ncsv = \"gust.csv\"\ncolumn = \"lift\"\n{rest}"
    );
    let section = |name: &str, x: f64, three: f64, mass: f64| {
        format!(
            "[section.{name}]\nEA = {0}\nGA = {0}\nGJ = {1}\nEI = [{1}, {three}]\nrhoA = {mass}\n",
            1e3 * x,
            10.0 * x
        )
    };
    let whole = format!(
        "[[beam]]\nname = \"b\"\nthrough = [[0, 0, 0], [1, 0, 0], [2, 0.5, 0]]\nsection = [\"p\", \"q\", \"r\"]\nstations = [0, 0.25, 1]\nelements = 4\n\
         [history.gust]\ntimes = [0, 0.1, 0.2]\nvalues = [0, 1, 0]\n{}{}{}{rest}",
        section("p", 4.0, 30.0, 2.0),
        section("q", 2.0, 20.0, 1.0),
        section("r", 1.0, 10.0, 1.0)
    );
    folder.write("in/tables.toml", &tables);
    folder.write("whole.toml", &whole);
    for deck in ["in/tables.toml", "whole.toml"] {
        let run = folder.beamsim(&["run", deck]);
        assert_eq!(status(&run), 0, "{}", last_line(&run));
    }
    let history = |deck: &str| fs::read_to_string(folder.0.join("results").join(deck).join("history.csv")).unwrap();
    assert_eq!(history("tables"), history("whole"));
    // Stations in another unit than the beam.
    let blade = fs::read_to_string(folder.0.join("in/blade.csv")).unwrap();
    folder.write("in/blade.csv", &blade.replace("fraction", "s").replace("\n1,", "\n2118,"));
    let stretched = folder.beamsim(&["check", "in/tables.toml"]);
    let told = String::from_utf8_lossy(&stretched.stderr);
    assert!(status(&stretched) == 2 && told.contains("the last of the `stations` is 2118"), "{told}");
    fs::remove_dir_all(folder.0.join("in")).unwrap();
    assert_eq!(status(&folder.beamsim(&["report", "results/tables"])), 0);

    folder.write("lost.toml", &tables);
    let lost = folder.beamsim(&["run", "lost.toml"]);
    let told = String::from_utf8_lossy(&lost.stderr);
    assert!(status(&lost) == 4 && told.contains("lost.toml:3:") && told.contains("spine.csv"), "{told}");
    assert!(last_line(&lost).starts_with("error[io]: "), "{}", last_line(&lost));
}

/// Of a long table run.json keeps path, rows and fingerprint; a report reads it again, if it is the
/// same.
#[test]
fn long_tables_are_not_copied_into_records() {
    let folder = Folder::new("long_tables");
    let rows: String = (0..3000).map(|k| format!("{k},{}\n", k % 7)).collect();
    folder.write("gust.csv", &format!("time,lift\n{rows}"));
    let history = "[history.gust]\ncsv = \"gust.csv\"\n";
    let deck = GOOD.replace("force = [0, 0, \"f\"]", "force = [0, 0, \"f\"]\nhistory = \"gust\"") + history;
    folder.write("deck.toml", &deck);
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--set", "param.f=0.1", "--out", "r"])), 0);
    let text = fs::read_to_string(folder.0.join("r/run.json")).unwrap();
    assert!(text.len() < 10_000, "{} bytes", text.len());
    let record: serde_json::Value = serde_json::from_str(&text).unwrap();
    let table = &record["tables"][0];
    assert_eq!((&table["csv"], &table["rows"]), (&"gust.csv".into(), &3000.into()));
    assert!(Path::new(table["path"].as_str().unwrap()).is_absolute() && table["hash"].as_str().is_some());
    assert_eq!(record["deck"]["history"]["gust"]["csv"], "gust.csv");
    assert_eq!((&record["deck"]["param"]["f"], &record["deck"]["load"][0]["force"][2]), (&0.1.into(), &0.1.into()));
    for command in [&["report", "r"][..], &["plot", "r"], &["compare", "r/history.csv", "r/history.csv"]] {
        let output = folder.beamsim(command);
        assert_eq!(status(&output), 0, "{command:?}: {}", last_line(&output));
    }
    folder.write("gust.csv", "time,lift\n0,1\n");
    let changed = folder.beamsim(&["report", "r"]);
    assert!(status(&changed) == 4 && last_line(&changed).contains("has changed"), "{}", last_line(&changed));
    fs::remove_file(folder.0.join("gust.csv")).unwrap();
    assert_eq!(status(&folder.beamsim(&["report", "r"])), 4);
}

/// Numbers near the limits of floating point, and scenes far from the origin.
#[test]
fn check_prints_numbers() {
    let folder = Folder::new("numbers");
    let heavy = "[[body]]\nat = \"tip\"\nmass = 1e300\noffset = [1e10, 0, 0]\n";
    folder.write("heavy.toml", &format!("{GOOD}{heavy}"));
    let text = String::from_utf8_lossy(&folder.beamsim(&["check", "heavy.toml"]).stdout).into_owned();
    assert!(
        !text.contains("NaN") && !text.contains("inf") && text.contains("too large for floating-point numbers"),
        "{text}"
    );
    let far = GOOD
        .replace("root = [0, 0, 0]", "root = [1e9, 1e9, 0]")
        .replace("tip = [1, 0, 0]", "tip = [1000000001, 1e9, 0]");
    folder.write("far.toml", &far);
    let text = String::from_utf8_lossy(&folder.beamsim(&["check", "far.toml"]).stdout).into_owned();
    let line = text.lines().find(|line| line.starts_with("inertia")).unwrap_or_else(|| panic!("{text}"));
    assert!(line.contains("[0.0, 0.083333"), "{line}");
}

/// Another scheme does not trip over the coefficient of the one before.
#[test]
fn a_scheme_is_set_without_its_coefficients() {
    let folder = Folder::new("scheme");
    let swings = swinging(0.1).replace("step = 0.01", "step = 0.01\nscheme = \"generalized_alpha\"\nrho_inf = 0.5");
    folder.write("swings.toml", &swings);
    for scheme in ["newmark", "hht", "lobatto", "lie_generalized_alpha", "generalized_alpha"] {
        let output = folder.beamsim(&["run", "swings.toml", "--set", &format!("stage.0.scheme={scheme}")]);
        assert_eq!(status(&output), 0, "{scheme}: {}", last_line(&output));
    }
    let output =
        folder.beamsim(&["run", "swings.toml", "--set", "stage.0.scheme=newmark", "--set", "stage.0.rho_inf=1"]);
    assert_eq!(status(&output), 2);
}

/// What holds of several tables is said once, with the lines of the others.
#[test]
fn equal_warnings_are_said_once() {
    let folder = Folder::new("once");
    let bodies: String = (0..4).map(|k| format!("[[body]]\nat = \"b{k}\"\nmass = 1\ninertia = [1, 1, 1]\n")).collect();
    let points: String = (0..4).map(|k| format!("b{k} = [{k}, 0, 0]\n")).collect();
    let motion = |k: usize| {
        format!("[[motion]]\nat = \"b{k}\"\nux = 1\nhistory = \"h{k}\"\n[history.h{k}]\nexpr = \"({k} + 1)*t\"\n")
    };
    let motions: String = (0..4).map(motion).collect();
    folder.write(
        "many.toml",
        &format!("[point]\n{points}{bodies}{motions}[[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.1\n"),
    );
    let output = folder.beamsim(&["run", "many.toml"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(said.matches("warning[velocity_jump]: this motion starts stage").count(), 1, "{said}");
    assert!(said.contains("the same warning applies to lines "), "{said}");
}

#[test]
fn what_a_stopped_run_has_left_is_not_lost_by_another_command() {
    let folder = Folder::new("left");
    folder.write("good.toml", GOOD);
    fs::create_dir(folder.0.join("out")).unwrap();
    folder.write("out/checkpoint", "beamsim checkpoint\nof another run");
    for arguments in [
        &["verify", "good.toml", "--out", "out"][..],
        &["run", "good.toml", "--out", "out"],
        &["run", "good.toml", "--out", "out", "--accuracy", "1e-2"],
    ] {
        let output = folder.beamsim(arguments);
        assert!((status(&output), last_line(&output).starts_with("error[checkpoint]")) == (2, true), "{arguments:?}");
        assert!(folder.names("out").contains(&"checkpoint".to_string()), "{arguments:?}");
    }
}

#[test]
fn messages_about_tables_name_the_lines_of_the_deck() {
    let folder = Folder::new("table_lines");
    let deck =
        GOOD.replace("section = \"s\"", "section = { csv = \"b.csv\" }").replace("force = [0, 0, \"f\"]", "forced = 1");
    folder.write("deck.toml", &deck);
    folder.write("b.csv", "s,EA,GA2,GA3,GJ,EI2,EI3\n0,9,8,7,6,5,4\n1,-1,1,1,1,1,1\n");
    let line_of = |part: &str| deck.lines().position(|line| line.contains(part)).unwrap() + 1;
    let output = folder.beamsim(&["check", "deck.toml"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(status(&output), 2);
    assert!(said.contains(&format!("--> deck.toml:{}:1", line_of("forced"))), "{said}");
    assert!(said.contains(&format!("--> deck.toml:{}:20", line_of("b.csv"))), "{said}");
    assert!(said.contains("line 3 of this table"), "{said}");
}

#[test]
fn a_parameter_that_no_line_uses_is_refused() {
    let folder = Folder::new("unused_parameter");
    folder.write("good.toml", GOOD);
    let output = folder.beamsim(&["run", "good.toml", "--set", "param.F=1"]);
    assert_eq!(status(&output), 2);
    assert!(last_line(&output).contains("the deck has no parameter `F`: did you mean `f`?"), "{}", last_line(&output));
}

#[test]
fn warnings_of_runs_of_studies_can_be_denied() {
    let folder = Folder::new("denied_studies");
    let column = concat!(env!("CARGO_MANIFEST_DIR"), "/decks/minimal/expect_warns.toml");
    let text = fs::read_to_string(column).unwrap();
    folder.write("column.toml", &text[..text.find("[[expect]]").unwrap()]);
    let sweep = ["sweep", "column.toml", "--vary", "stage.0.steps=4,5", "--output", "top.ux", "--deny-warnings"];
    for arguments in [&sweep[..], &["effects", "column.toml", "--deny-warnings"]] {
        let output = folder.beamsim(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            (status(&output), last_line(&output).starts_with("error[warnings]")) == (1, true),
            "{arguments:?} {said}"
        );
        assert_eq!(status(&folder.beamsim(&arguments[..arguments.len() - 1])), 0, "{arguments:?}");
    }
}
