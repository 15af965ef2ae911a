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
        let run = folder.beamsim(&["run", &deck]);
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
