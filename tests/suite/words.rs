//! Starter decks, explanations, completions.

use super::folder::{Folder, last_line, status};
use std::fs;

const TEMPLATES: [&str; 6] = ["cantilever", "frame", "mechanism", "rotating-blade", "free-body", "ring"];

#[test]
fn starter_decks_run_and_are_never_overwritten() {
    let folder = Folder::new("templates");
    for template in TEMPLATES {
        assert_eq!(status(&folder.beamsim(&["new", template])), 0);
        let deck = format!("{template}.toml");
        let checked = folder.beamsim(&["check", &deck]);
        let said = String::from_utf8_lossy(&checked.stderr).into_owned();
        assert!(status(&checked) == 0 && said.is_empty(), "{template}: {said}");
        let run = folder.beamsim(&["run", &deck, "--deny-warnings"]);
        assert_eq!(status(&run), 0, "{template}: {}", last_line(&run));
        assert!(fs::read_to_string(folder.0.join(&deck)).unwrap().starts_with("#:schema ./beamsim.schema.json\n"));
    }
    folder.write("ring.toml", "mine");
    assert_eq!(status(&folder.beamsim(&["new", "ring"])), 4);
    assert_eq!(fs::read_to_string(folder.0.join("ring.toml")).unwrap(), "mine");
    assert_eq!(status(&folder.beamsim(&["new", "ring", "--out", "other.toml"])), 0);
    assert!(folder.0.join("other.toml").exists() && folder.0.join("beamsim.schema.json").exists());
}

/// Bending of the clamped rod by hand: F L^3 / (3 EI) before it is a large displacement.
#[test]
fn the_starter_cantilever_bends_as_a_book_says() {
    let folder = Folder::new("template_cantilever");
    folder.beamsim(&["new"]);
    let words = ["run", "cantilever.toml", "--set", "param.F=0.3", "--set", "stage.0.tolerance=1e-12"];
    assert_eq!(status(&folder.beamsim(&words)), 0);
    let history = fs::read_to_string(folder.0.join("results/cantilever/history.csv")).unwrap();
    let column = history.lines().next().unwrap().split(',').position(|name| name == "tip.uz").unwrap();
    let tip: f64 = history.lines().last().unwrap().split(',').nth(column).unwrap().parse().unwrap();
    let (radius, length): (f64, f64) = (0.01, 2.0);
    let bent = 0.3 * length.powi(3) / (3.0 * 210e9 * std::f64::consts::PI * radius.powi(4) / 4.0);
    assert!((tip + bent).abs() < 1e-3 * bent, "{tip} against {bent}");
}

#[test]
fn keys_are_explained_and_wrong_ones_told() {
    let folder = Folder::new("explain");
    let told = folder.beamsim(&["explain", "section.rhoA"]);
    let text = String::from_utf8_lossy(&told.stdout);
    assert!(
        status(&told) == 0 && text.starts_with("rhoA, in [section.NAME]") && text.contains("unit: mass/length"),
        "{text}"
    );
    for (name, told) in [
        ("cylindrical", &["cylindrical, a value of `kind` in [[joint]]\n  The sliding along `axis`"][..]),
        ("q", &["q, a value of `columns` in [output]", "tip.qw, tip.qx, tip.qy, tip.qz: columns of a node"]),
        ("tip.my", &["reaction moment; unit: force·length; written by columns = [\"reaction\"]"]),
        ("limit_point", &["limit_point, a value of `warns` in [[expect]]", "about `path`"]),
        ("not_converged", &["a value of `fails` in [[expect]]"]),
        ("lie_generalized_alpha", &["a value of `scheme` in [[stage]]", "in [cost]"]),
        ("buckling", &["a value of `kind` in [[stage]]"]),
        ("follower_tangent", &["follower_tangent, in [effects]"]),
        ("load", &["load, in the deck", "a value of `control` in [[stage]]", "load: columns of the run"]),
        ("omega", &["angular frequency; unit: rad/time"]),
    ] {
        let output = folder.beamsim(&["explain", name]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(status(&output) == 0 && told.iter().all(|told| text.contains(told)), "{name}: {text}");
    }
    let collision = folder.beamsim(&["explain", "collision"]);
    assert!(last_line(&collision).contains("contacts of beams and bodies with surfaces are [[contact]]"));
    let wrong = folder.beamsim(&["explain", "elemnts"]);
    assert_eq!((status(&wrong), last_line(&wrong).contains("did you mean `elements`?")), (2, true));
}

#[test]
fn shells_editors_and_manuals_are_served() {
    let folder = Folder::new("served");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = folder.beamsim(&["completions", shell]);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(status(&output) == 0 && text.contains("sweep") && text.contains("explain"), "{shell}");
    }
    let schema = folder.beamsim(&["schema"]);
    let schema: serde_json::Value = serde_json::from_slice(&schema.stdout).unwrap();
    assert!(schema["properties"]["stage"]["items"]["properties"]["scheme"]["enum"].is_array());
    assert_eq!(status(&folder.beamsim(&["manual", "--out", "man"])), 0);
    let page = fs::read_to_string(folder.0.join("man/beamsim-sweep.1")).unwrap();
    assert!(page.contains("Latin hypercube"));
}

#[test]
fn every_command_has_an_example() {
    let folder = Folder::new("help");
    let help = folder.beamsim(&["help"]);
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    let (_, commands) = text.split_once("Commands:").unwrap();
    let names = commands.lines().skip(1).take_while(|line| line.starts_with("  "));
    let names: Vec<&str> =
        names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help").collect();
    assert!(names.len() >= 14, "{names:?}");
    for name in names {
        let help = folder.beamsim(&[name, "--help"]);
        let text = String::from_utf8_lossy(&help.stdout);
        assert!(status(&help) == 0 && text.contains(&format!("  beamsim {name}")), "{name}: {text}");
    }
}

const SPINNING: &str = "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\nspare = [0, 0, 0]\n[section.s]\nEA = 1e3\nGA = 1e3\nGJ = 1\nEI = 1\n\
     [[beam]]\nname = \"r\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 1\n[[support]]\nat = \"a\"\nfix = \"all\"\n\
     [[load]]\nat = \"b\"\nmoment = [0, 0, 2]\n[[stage]]\nkind = \"static\"\nsteps = 4\n[output]\nnodes = [\"b\"]\n";

/// Quiet, for scripts, and strict.
#[test]
fn the_manner_of_speaking_is_the_users() {
    let folder = Folder::new("manner");
    let calm = SPINNING.replace("moment = [0, 0, 2]", "moment = [0, 0, 0.1]");
    folder.write("calm.toml", &calm);
    folder.write("turned.toml", SPINNING);
    let quiet = folder.beamsim(&["--quiet", "run", "calm.toml"]);
    assert!(status(&quiet) == 0 && quiet.stdout.is_empty() && quiet.stderr.is_empty());

    let told = folder.beamsim(&["run", "calm.toml", "--json"]);
    let line: serde_json::Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!(
        (&line["command"], &line["status"], &line["results"]),
        (&"run".into(), &"finished".into(), &"results/calm".into())
    );
    assert!(line["counters"]["steps"] == 4 && line["text"].is_null());
    let checked = folder.beamsim(&["check", "calm.toml", "--json"]);
    let line: serde_json::Value = serde_json::from_slice(&checked.stdout).unwrap();
    assert!(line["elements"] == 1 && line["seconds"].as_f64().unwrap() > 0.0);
    let swept = folder.beamsim(&["sweep", "calm.toml", "--vary", "section.s.EI=1,0", "--json"]);
    let line: serde_json::Value = serde_json::from_slice(&swept.stdout).unwrap();
    assert!(status(&swept) == 3 && line["finished"] == 1 && line["failed"]["deck"][0] == 2, "{line}");
    let studied = folder.beamsim(&["effects", "calm.toml", "--tolerance", "0.5", "--json"]);
    let line: serde_json::Value = serde_json::from_slice(&studied.stdout).unwrap();
    assert_eq!((&line["command"], &line["tolerance"]), (&"effects".into(), &0.5.into()));
    let mut told: Vec<_> = line["variants"].as_array().unwrap().iter().collect();
    told.push(&line["cheapest"]);
    let table = fs::read_to_string(folder.0.join(line["file"].as_str().unwrap())).unwrap();
    for variant in &told {
        let words: Vec<_> = variant["without"].as_array().unwrap().iter().map(|word| word.as_str().unwrap()).collect();
        let own = table.lines().map(|row| row.split(',').collect::<Vec<_>>()).filter(|row| row[0] == words.join("+"));
        let changes = own.filter_map(|row| Some((row[5].parse::<f64>().ok()?, row[4].to_string())));
        let largest = changes.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, String::new()));
        assert_eq!(variant["change"], largest.0, "{words:?}");
        assert!(largest.0 == 0.0 || variant["of"] == largest.1.as_str(), "{words:?}: {variant}");
    }
    assert!(told.iter().any(|variant| variant["without"][0] == "large_rotations" && variant["change"] != 0.0));

    // One element that turns by 2 rad: a warning of the run.
    let warned = folder.beamsim(&["run", "turned.toml"]);
    assert!(status(&warned) == 0 && String::from_utf8_lossy(&warned.stderr).contains("warning[coarse_mesh]: "));
    let denied = folder.beamsim(&["run", "turned.toml", "--deny-warnings"]);
    assert_eq!((status(&denied), last_line(&denied).starts_with("error[warnings]: 1 warning")), (1, true));
    assert!(folder.0.join("results/turned/history.csv").exists());
    // A point that lies on another: a warning about the deck.
    folder.write("twice.toml", &calm.replace("[\"a\", \"b\"]", "[\"a\", \"b\"]\naxis3 = [0, 0, 1]").replace("[[support]]", "[[beam]]\nname = \"q\"\nsection = \"s\"\nthrough = [\"spare\", [0, 1, 0]]\nelements = 1\n[[support]]\nat = \"spare\"\nfix = \"all\"\n[[support]]"));
    assert_eq!(status(&folder.beamsim(&["run", "twice.toml"])), 0);
    let refused = folder.beamsim(&["run", "twice.toml", "--deny-warnings", "--out", "none"]);
    assert_eq!((status(&refused), folder.0.join("none").exists()), (2, false));
    assert!(folder.beamsim(&["--quiet", "explain", "elements"]).stdout.len() > 50);
}
