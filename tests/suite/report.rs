//! The page that plays a run back.

use super::folder::{Folder, last_line, status};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Command;

/// A pendulum of two beams and a body, on a soft spring, let go.
const DECK: &str = "title = \"Pendulum & <body>\"\ngravity = [0, 0, -10]\n\
     [point]\nroot = [0, 0, 0]\nmid = [1, 0, 0]\ntip = [2, 0.5, 0]\n\
     [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 10\nEI = 10\nrhoA = 1\n\
     [[beam]]\nname = \"a\"\nsection = \"s\"\nthrough = [\"root\", \"mid\"]\nelements = 2\norder = 2\n\
     [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"mid\", \"tip\"]\nelements = 3\n\
     [[joint]]\nkind = \"spherical\"\nat = \"mid\"\nbeams = [\"a\", \"b\"]\n\
     [[body]]\nat = \"tip\"\nmass = 0.5\n[[spring]]\nbetween = [\"root\", \"tip\"]\nstiffness = 0.1\n[[support]]\nat = \"root\"\nfix = \"all\"\n\
     [[stage]]\nkind = \"dynamic\"\nend = 0.5\nstep = 0.01\n\
     [output]\nnodes = [\"a@end\", \"tip\", \"b@0.1\"]\ncolumns = [\"x\", \"d\", \"energy\"]\nevery = 4\n";

/// The data of a page.
pub fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("<script id=\"data\" type=\"application/json\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

fn bytes(value: &Value) -> Vec<u8> {
    STANDARD.decode(value.as_str().unwrap()).unwrap()
}

fn numbers<const N: usize, T>(value: &Value, of: fn([u8; N]) -> T) -> Vec<T> {
    bytes(value).chunks_exact(N).map(|chunk| of(chunk.try_into().unwrap())).collect()
}

/// A column of the history in a page.
fn column(history: &Value, name: &str) -> Vec<f64> {
    let place = history["columns"].as_array().unwrap().iter().position(|known| known == name).unwrap();
    let rows = history["rows"].as_u64().unwrap() as usize;
    numbers(&history["data"], f64::from_le_bytes)[place * rows..(place + 1) * rows].to_vec()
}

#[test]
fn a_page_holds_the_run_and_its_shape() {
    let folder = Folder::new("report");
    folder.write("deck.toml", DECK);
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--report", "--out", "r"])), 0);
    let page = fs::read_to_string(folder.0.join("r/report.html")).unwrap();
    assert!(page.contains("<title>Pendulum &amp; &lt;body&gt;</title>"));
    for foreign in ["src=\"http", "href=\"http", "url(http", "@import", "fetch(", "XMLHttpRequest"] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    let data = data(&page);
    assert!(data["deck"] == DECK && data["run"]["status"] == "finished" && data["run"]["text"].is_null());
    let (scene, history) = (&data["scene"], &data["history"]);

    // The start, each fourth step, and the last.
    let times = column(history, "time");
    assert_eq!((times.len(), times[times.len() - 1]), (14, 0.5));
    let rows: Vec<usize> = scene["rows"].as_array().unwrap().iter().map(|row| row.as_u64().unwrap() as usize).collect();
    assert!(rows.into_iter().eq(0..14));

    // Five nodes of `a`, four of `b`, one of the body, two of the spring.
    assert_eq!((&scene["nodes"], &scene["links"]), (&json!(12), &json!([[10, 11]])));
    let orders: Vec<u64> =
        scene["beams"].as_array().unwrap().iter().map(|beam| beam["order"].as_u64().unwrap()).collect();
    assert_eq!(orders, [2, 1]);
    let node = |name: &str| {
        let names = scene["names"].as_array().unwrap();
        names.iter().find(|entry| entry["name"] == name).unwrap()["node"].as_u64().unwrap() as usize
    };
    assert_eq!((node("a@end"), node("b@0.1")), (4, 5));
    let joints: Vec<u64> =
        scene["joints"].as_array().unwrap().iter().map(|joint| joint["node"].as_u64().unwrap()).collect();
    assert!(joints.contains(&4) && joints.contains(&5) && scene["supports"][0]["node"] == 0);

    let places = numbers(&scene["places"], f32::from_le_bytes);
    let turns = numbers(&scene["turns"], i16::from_le_bytes);
    for (frame, name) in (0..14).flat_map(|frame| ["a@end", "tip"].map(|name| (frame, name))) {
        let at = frame * 12 + node(name);
        // Places are single floats: 1e-7 of lengths of 2.
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let exact = column(history, &format!("{name}.{axis}"))[frame];
            assert!((f64::from(places[3 * at + k]) - exact).abs() < 1e-6, "{name} {frame}");
        }
        // The first section axis from the quaternion, of four numbers in steps of 3e-5.
        let [w, x, y, z] = [0, 1, 2, 3].map(|k| f64::from(turns[4 * at + k]) / 32767.0);
        let first = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)];
        for (came, axis) in first.iter().zip(["d1x", "d1y", "d1z"]) {
            let exact = column(history, &format!("{name}.{axis}"))[frame];
            assert!((came - exact).abs() < 2e-4, "{name} {frame}: {came} against {exact}");
        }
    }
    let fields: Vec<&str> =
        scene["fields"].as_array().unwrap().iter().map(|field| field["name"].as_str().unwrap()).collect();
    assert!(fields.contains(&"M2") && fields.contains(&"energy"), "{fields:?}");

    // Of results that are there the same page is made; a run without one leaves none.
    assert_eq!(status(&folder.beamsim(&["report", "r", "--out", "again.html"])), 0);
    assert!(page == fs::read_to_string(folder.0.join("again.html")).unwrap(), "another page");
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--out", "r"])), 0);
    assert_eq!(folder.names("r"), ["history.csv", "run.json"]);
}

#[test]
fn long_runs_are_thinned_to_what_can_be_seen() {
    let folder = Folder::new("report_long");
    folder.write(
        "deck.toml",
        &DECK.replace("end = 0.5\nstep = 0.01", "end = 4.001\nstep = 5e-4").replace("every = 4", "every = 1"),
    );
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--report", "--out", "r"])), 0);
    let data = data(&fs::read_to_string(folder.0.join("r/report.html")).unwrap());
    let rows: Vec<u64> = data["scene"]["rows"].as_array().unwrap().iter().map(|row| row.as_u64().unwrap()).collect();
    assert_eq!(data["history"]["rows"], 8003);
    assert!((1500..=3001).contains(&rows.len()), "{}", rows.len());
    assert_eq!((rows[0], rows[1], rows[rows.len() - 1]), (0, 4, 8002));
}

#[test]
fn a_run_that_fails_has_a_page_and_wrong_folders_are_told() {
    let folder = Folder::new("report_failed");
    folder.write(
        "deck.toml",
        &DECK
            .replace("kind = \"dynamic\"\nend = 0.5\nstep = 0.01", "kind = \"static\"\nsteps = 2")
            .replace("gravity = [0, 0, -10]", "gravity = [0, 0, 0]"),
    );
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--report", "--out", "r"])), 3);
    let data = data(&fs::read_to_string(folder.0.join("r/report.html")).unwrap());
    assert_eq!((&data["run"]["status"], &data["run"]["failure"]["name"]), (&"singular".into(), &"singular".into()));
    let missing = folder.beamsim(&["report", "nowhere"]);
    assert!(status(&missing) == 4 && last_line(&missing).contains("nowhere/run.json"), "{}", last_line(&missing));
}

#[test]
fn modes_and_critical_loads_stand_in_the_page() {
    let folder = Folder::new("report_modes");
    let stages = "[[stage]]\nkind = \"static\"\nsteps = 1\n[[stage]]\nkind = \"modal\"\nmodes = 3\n";
    let held = DECK.replace("kind = \"spherical\"", "kind = \"rigid\"");
    folder.write("deck.toml", &held.replace("[[stage]]\nkind = \"dynamic\"\nend = 0.5\nstep = 0.01\n", stages));
    let run = folder.beamsim(&["run", "deck.toml", "--report", "--out", "r"]);
    assert_eq!(status(&run), 0, "{}", last_line(&run));
    let modes = &data(&fs::read_to_string(folder.0.join("r/report.html")).unwrap())["modes"];
    assert_eq!(modes["columns"], serde_json::json!(["stage", "mode", "omega", "growth"]));
    let told = fs::read_to_string(folder.0.join("r/modes.csv")).unwrap();
    let omega: f64 = told.lines().nth(1).unwrap().split(',').nth(2).unwrap().parse().unwrap();
    assert!(modes["rows"].as_array().unwrap().len() == 3 && modes["rows"][0][2] == omega);
}

#[test]
fn critical_loads_stand_in_the_page_with_their_kinds() {
    let folder = Folder::new("report_buckling");
    let deck = Path::new(env!("CARGO_MANIFEST_DIR")).join("decks/minimal/buckling.toml");
    let deck = deck.to_string_lossy();
    let run = folder.beamsim(&["run", &deck, "--report", "--out", "r"]);
    assert_eq!(status(&run), 0, "{}", last_line(&run));
    let found = &data(&fs::read_to_string(folder.0.join("r/report.html")).unwrap())["buckling"];
    assert_eq!(found["columns"], json!(["stage", "mode", "load", "kind"]));
    assert!(found["rows"][0][2].is_f64() && found["rows"][0][3] == "branch", "{found}");
}

#[test]
fn numbers_of_a_page_have_the_units_of_the_deck() {
    let folder = Folder::new("report_units");
    let units = "units = { length = \"mm\", force = \"N\", time = \"s\" }\n";
    folder.write("deck.toml", &format!("{units}{DECK}"));
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--report", "--error-bars", "--out", "r"])), 0);
    let data = data(&fs::read_to_string(folder.0.join("r/report.html")).unwrap());
    for (table, column, unit) in [
        ("history", "time", json!("s")),
        ("history", "load", json!(null)),
        ("history", "tip.x", json!("mm")),
        ("history", "tip.d1x", json!(null)),
        ("history", "energy.total", json!("N·mm")),
        ("bars", "tip.y", json!("mm")),
    ] {
        let place = data[table]["columns"].as_array().unwrap().iter().position(|known| known == column).unwrap();
        assert_eq!(data[table]["units"][place], unit, "{column}");
    }
    let fields = data["scene"]["fields"].as_array().unwrap();
    let unit = |name: &str| &fields.iter().find(|field| field["name"] == name).unwrap()["unit"];
    assert_eq!((unit("N1"), unit("M2"), unit("energy")), (&json!("N"), &json!("N·mm"), &json!("N")));
}

/// Plays a page in a browser, where there is one; titles are expected of the horizontal axis and of the plots.
fn play(folder: &Folder, results: &str, titles: &[&str]) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/report.py");
    let [page, history] = ["report.html", "history.csv"].map(|name| folder.0.join(results).join(name));
    let mut command = Command::new("python3");
    command.arg(script).args([page, history]).arg("--titles").args(titles);
    let done = command.output().unwrap();
    let told = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    if let Some(why) = told.lines().find(|line| line.starts_with("skipped")) {
        // Past the test harness.
        let _ = writeln!(std::io::stderr(), "{why}");
    }
    assert!(done.status.success(), "{told}");
}

#[test]
fn a_browser_plays_scrubs_and_shows_the_numbers_of_the_history() {
    let folder = Folder::new("report_browser");
    folder.write("deck.toml", DECK);
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--report", "--error-bars", "--out", "r"])), 0);
    play(&folder, "r", &["time", "energy", "a@end: position", "tip: position", "b@0.1: position"]);
}

#[test]
fn a_browser_shows_displacements_of_nodes_with_units_over_the_time() {
    let folder = Folder::new("report_browser_units");
    let units = "units = { length = \"mm\", force = \"N\", time = \"s\" }\n";
    let columns = "columns = [\"resultant\", \"r\", \"u\", \"momentum\"]";
    let rigid = DECK.replace("kind = \"spherical\"", "kind = \"rigid\"");
    let deck = rigid
        .replace("columns = [\"x\", \"d\", \"energy\"]", columns)
        .replace("\"a@end\", \"tip\", \"b@0.1\"", "\"root\", \"tip\"");
    let first = "[[stage]]\nkind = \"static\"\nsteps = 2\n[[stage]]\nkind = \"dynamic\"";
    folder.write("deck.toml", &format!("{units}{}", deck.replace("[[stage]]\nkind = \"dynamic\"", first)));
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--report", "--out", "r"])), 0);
    play(&folder, "r", &["time [s]", "tip: displacement [mm]"]);
}

#[test]
fn a_browser_shows_static_stages_one_after_the_other() {
    let folder = Folder::new("report_browser_stages");
    let rigid = DECK.replace("kind = \"spherical\"", "kind = \"rigid\"");
    let columns = rigid.replace("columns = [\"x\", \"d\", \"energy\"]", "columns = [\"u\"]");
    let stages = "[[stage]]\nkind = \"static\"\nsteps = 5\n".repeat(2);
    let load = "[[load]]\nat = \"tip\"\nforce = [0, 0, 1]\nstages = [2]\n";
    let deck = columns.replace("[[stage]]\nkind = \"dynamic\"\nend = 0.5\nstep = 0.01\n", &format!("{load}{stages}"));
    folder.write("deck.toml", &deck.replace("every = 4", "every = 1"));
    let run = folder.beamsim(&["run", "deck.toml", "--report", "--out", "r"]);
    assert_eq!(status(&run), 0, "{}", last_line(&run));
    let titles = ["a@end", "tip", "b@0.1"].map(|node| format!("{node}: displacement"));
    play(&folder, "r", &["load factor, stage by stage", &titles[0], &titles[1], &titles[2]]);
}

/// Where stresses are asked for, colours show the largest one of the section.
#[test]
fn colours_show_stress_where_it_was_asked_for() {
    let folder = Folder::new("report-stress");
    let deck = |output: &str| {
        format!(
            "units = {{ length = \"m\", force = \"N\", time = \"s\" }}\n[point]\nroot = [0, 0, 0]\ntip = [1, 0, 0]\n\
             [material.m]\nE = 1e9\nnu = 0.3\n\
             [section.bar]\nshape = \"rectangle\"\nmaterial = \"m\"\nwidth = 0.02\nheight = 0.04\n\
             [[beam]]\nname = \"arm\"\nsection = \"bar\"\nthrough = [\"root\", \"tip\"]\nelements = 8\norder = 2\n\
             [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 0, 1]\n\
             [[stage]]\nkind = \"static\"\nsteps = 1\n[output]\nnodes = [\"tip\", \"arm@0\"]\n{output}\n"
        )
    };
    let field = |output: &str| {
        folder.write("deck.toml", &deck(output));
        assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--report", "--out", "r"])), 0);
        let data = data(&fs::read_to_string(folder.0.join("r/report.html")).unwrap());
        data["scene"]["fields"].as_array().unwrap().iter().find(|field| field["name"] == "vm").cloned()
    };
    assert!(field("columns = [\"u\"]").is_none());
    let found = field("columns = [\"u\"]\nenvelope = true").unwrap();
    assert!(found["unit"] == "N/m²" && found["label"] == "largest von Mises stress", "{found}");
    // At the clamp M/W, W = b h²/6.
    let high = found["high"].as_f64().unwrap();
    assert!((high / (6.0 / (0.02 * 0.04 * 0.04)) - 1.0).abs() < 0.02, "{high}");
}
