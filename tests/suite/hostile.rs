//! Files that must not be replaced, texts that would control a terminal, and sizes beyond the machine.

use super::folder::{Folder, last_line, status};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const DECK: &str = "[param]\nF = 1\n[point]\nroot = [0, 0, 0]\ntip = [1, 0, 0]\n[section.s]\nEA = 1e3\nGA = 1e3\nGJ = 10\nEI = 10\nrhoA = 1\n\
     [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 2\n[[support]]\nat = \"root\"\nfix = \"all\"\n\
     [[load]]\nat = \"tip\"\nforce = [0, 0, \"F\"]\n[[stage]]\nkind = \"static\"\nsteps = 1\n[output]\nnodes = [\"tip\"]\ncolumns = [\"u\"]\n";

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("deck.toml", DECK);
    folder
}

fn fine(output: &Output) {
    assert_eq!(status(output), 0, "{}", String::from_utf8_lossy(&output.stderr));
}

/// Refused with status 4, and nothing has changed.
fn refused(folder: &Folder, words: &[&str], told: &str) {
    let output = folder.beamsim(words);
    assert_eq!(status(&output), 4, "{words:?}: {}", last_line(&output));
    assert!(last_line(&output).contains(told), "{words:?}: {}", last_line(&output));
}

#[test]
fn files_of_others_are_not_replaced() {
    let folder = folder("occupied");
    fine(&folder.beamsim(&["run", "deck.toml", "--out", "r", "--report"]));
    folder.write("notes.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"/>");
    folder.write("page.html", "<html>beamsim</html>");
    refused(&folder, &["plot", "r", "--out", "notes.svg"], "beamsim did not write it");
    refused(&folder, &["report", "r", "--out", "page.html"], "beamsim did not write it");
    // A record is its own, but no page.
    refused(&folder, &["report", "r", "--out", "r/run.json"], "beamsim did not write it");
    refused(&folder, &["report", "r", "--out", "r"], "is a folder");
    for force in [&[][..], &["--force"]] {
        refused(&folder, &[&["report", "r", "--out", "deck.toml"], force].concat(), "name of a deck");
        refused(&folder, &[&["report", "r", "--out", "new.toml"], force].concat(), "name of a deck");
    }
    assert_eq!(fs::read_to_string(folder.0.join("deck.toml")).unwrap(), DECK);
    // What it wrote itself is replaced, and empty files.
    folder.write("empty.svg", "");
    for out in ["own.svg", "own.svg", "empty.svg"] {
        fine(&folder.beamsim(&["plot", "r", "--out", out]));
    }
    for _ in 0..2 {
        fine(&folder.beamsim(&["report", "r", "--out", "own.html"]));
        fine(&folder.beamsim(&["run", "deck.toml", "--out", "r", "--report"]));
    }
    fine(&folder.beamsim(&["plot", "r", "--out", "notes.svg", "--force"]));
    assert!(fs::read_to_string(folder.0.join("notes.svg")).unwrap().contains("<!-- beamsim "));
}

#[test]
fn results_of_others_are_not_replaced() {
    let folder = folder("occupied_folders");
    for (name, content) in
        [("history.csv", "time,ux\n0,0\n"), ("run.json", "{\"a\": 1}"), ("report.html", "<p>mine</p>")]
    {
        let out = format!("with {name}");
        fs::create_dir(folder.0.join(&out)).unwrap();
        folder.write(&format!("{out}/{name}"), content);
        refused(&folder, &["run", "deck.toml", "--out", &out], "beamsim did not write it");
        refused(&folder, &["verify", "deck.toml", "--out", &out], "beamsim did not write it");
        assert_eq!(folder.names(&out), [name]);
        assert_eq!(fs::read_to_string(folder.0.join(&out).join(name)).unwrap(), content);
    }
    fs::create_dir(folder.0.join("others")).unwrap();
    folder.write("others/sweep.csv", "a,b\n1,2\n");
    folder.write("others/effects.csv", "a,b\n1,2\n");
    folder.write("others/cost.csv", "a,b\n1,2\n");
    refused(&folder, &["sweep", "deck.toml", "--vary", "param.F=1,2", "--out", "others"], "sweep.csv exists");
    refused(&folder, &["effects", "deck.toml", "--out", "others"], "effects.csv exists");
    refused(&folder, &["cost", "deck.toml", "--out", "others"], "cost.csv exists");
    refused(&folder, &["run", "deck.toml", "--out", "deck.toml"], "is no folder");
    fine(&folder.beamsim(&["run", "deck.toml", "--out", "with history.csv", "--force"]));
    // All that it writes, it may replace.
    for _ in 0..2 {
        fine(&folder.beamsim(&["sweep", "deck.toml", "--vary", "param.F=1,2", "--out", "all"]));
        fine(&folder.beamsim(&["effects", "deck.toml", "--out", "all"]));
        fine(&folder.beamsim(&["run", "deck.toml", "--out", "all"]));
        fine(&folder.beamsim(&["manual", "--out", "man"]));
    }
}

#[cfg(unix)]
#[test]
fn links_and_devices_are_not_replaced_even_by_force() {
    use std::os::unix::fs::symlink;
    let folder = folder("links");
    fine(&folder.beamsim(&["run", "deck.toml", "--out", "r"]));
    fine(&folder.beamsim(&["plot", "r", "--out", "own.svg"]));
    let content = folder.write("precious", "precious");
    symlink(&content, folder.0.join("link.svg")).unwrap();
    symlink(folder.0.join("own.svg"), folder.0.join("link to own.svg")).unwrap();
    symlink(folder.0.join("nowhere"), folder.0.join("loose.svg")).unwrap();
    fine(&Command::new("mkfifo").arg(folder.0.join("pipe.svg")).output().unwrap());
    for force in [&[][..], &["--force"]] {
        for (out, told) in [
            ("link.svg", "is a link"),
            ("link to own.svg", "is a link"),
            ("loose.svg", "is a link"),
            ("pipe.svg", "is a device or a pipe"),
        ] {
            refused(&folder, &[&["plot", "r", "--out", out], force].concat(), told);
        }
    }
    fs::create_dir(folder.0.join("planted")).unwrap();
    symlink(&content, folder.0.join("planted/history.csv")).unwrap();
    refused(&folder, &["run", "deck.toml", "--out", "planted", "--force"], "is a link");
    // The schema beside a new deck does not go through a link either.
    fs::create_dir(folder.0.join("new")).unwrap();
    symlink(folder.0.join("nowhere"), folder.0.join("new/beamsim.schema.json")).unwrap();
    fine(&folder.beamsim(&["new", "--out", "new/a.toml"]));
    assert!(!folder.0.join("nowhere").exists());
    assert_eq!(fs::read_to_string(content).unwrap(), "precious");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_behind_standard_output_is_told() {
    let folder = folder("full");
    for words in [
        &["schema"][..],
        &["--help"],
        &["run", "--help"],
        &["--version"],
        &["--json", "check", "deck.toml"],
        &["check", "deck.toml"],
        &["run", "deck.toml"],
        &["explain", "deck"],
        &["completions", "bash"],
        &["manual"],
        &["sweep", "deck.toml", "--vary", "param.F=1,2", "--list"],
    ] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_beamsim"));
        let output = command.args(words).current_dir(&folder.0).stdout(full).output().unwrap();
        assert_eq!(status(&output), 4, "{words:?}");
        assert!(last_line(&output).starts_with("error[io]: standard output: "), "{words:?}: {}", last_line(&output));
    }
    // The results are there nevertheless.
    assert_eq!(folder.names("results/deck"), ["history.csv", "run.json"]);
}

#[test]
fn a_reader_that_stops_early_is_no_error() {
    let folder = folder("head");
    for words in [&["schema"][..], &["--help"], &["--json", "check", "deck.toml"]] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_beamsim"))
            .args(words)
            .current_dir(&folder.0)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!((status(&output), output.stderr.len()), (0, 0), "{words:?}");
    }
}

/// Characters that control a terminal or hide text.
fn controls(text: &[u8]) -> Vec<char> {
    let is_bad = |c: &char| {
        (c.is_control() && *c != '\n')
            || matches!(c, '\u{200e}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    String::from_utf8_lossy(text).chars().filter(is_bad).collect()
}

#[test]
fn no_text_of_a_deck_controls_the_terminal() {
    let folder = Folder::new("hostile_text");
    let title = "title = \"A\\u001b]0;x\\u0007\\u009b2J\\u202e\\nerror[deck]: forged\"\n";
    folder.write("title.toml", &format!("{title}{DECK}"));
    for words in [
        &["run", "title.toml"][..],
        &["check", "title.toml"],
        &["--json", "run", "title.toml"],
        &["effects", "title.toml"],
        &["report", "results/title"],
        &["plot", "results/title"],
    ] {
        let output = folder.beamsim(words);
        fine(&output);
        let all = [output.stdout.clone(), output.stderr.clone()].concat();
        assert_eq!(controls(&all), [], "{words:?}");
        let forged = String::from_utf8_lossy(&all).lines().any(|line| line.starts_with("error["));
        assert!(!forged, "{words:?}");
    }
    // The page loads nothing and runs nothing but its own.
    let tag = "title = \"</title><script>alert(1)</script>\"\n";
    folder.write("tag.toml", &format!("{tag}{DECK}"));
    fine(&folder.beamsim(&["run", "tag.toml", "--report"]));
    let page = fs::read_to_string(folder.0.join("results/tag/report.html")).unwrap();
    assert!(page.contains("http-equiv=\"Content-Security-Policy\" content=\"default-src 'none';"));
    assert!(page.contains("<meta name=\"generator\" content=\"beamsim ") && !page.contains("<script>alert"));
    let picture = fs::read(folder.0.join("results/title/plot.svg")).unwrap();
    assert!(!picture.contains(&0x1b));
    // Names in messages, keys of the deck, and the lines that are shown.
    for (name, wrong) in [
        ("key.toml", "\"a\\u001b[31m\\u009b\" = 1\n"),
        ("name.toml", "[[motion]]\nat = \"\\u001b[2J\\u202e\"\nux = 1\n"),
        ("shown.toml", "[[motion]]\nat = \"\u{202e}tip\u{9b}\"\nux = 1\n"),
        ("table.toml", "[history.h]\ncsv = \"\\u001b[2J.csv\"\n"),
    ] {
        let deck = if name == "key.toml" { format!("{wrong}{DECK}") } else { format!("{DECK}{wrong}") };
        folder.write(name, &deck);
        let output = folder.beamsim(&["check", name]);
        assert_ne!(status(&output), 0, "{name}");
        assert_eq!(controls(&output.stderr), [], "{name}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[cfg(unix)]
#[test]
fn no_name_of_a_file_controls_the_terminal() {
    let folder = Folder::new("hostile_names");
    let name = "a\u{1b}[2J\nerror[deck]: forged\u{202e}.toml";
    folder.write(name, DECK);
    for words in [&["run", name][..], &["check", name], &["verify", name], &["run", "b\u{9b}.toml"]] {
        let output = folder.beamsim(words);
        let all = [output.stdout, output.stderr].concat();
        assert_eq!(controls(&all), [], "{words:?}");
        assert!(!String::from_utf8_lossy(&all).contains("\nerror[deck]: forged"), "{words:?}");
    }
    let results = fs::read_dir(folder.0.join("results")).unwrap().next().unwrap().unwrap().path();
    let mut record = fs::read_to_string(results.join("run.json")).unwrap();
    record = record.replace("\"F\": 1.0", "\"F\": \"\\u001b[2J\"").replace("0.1.0", "\\u001b[2J");
    fs::write(results.join("run.json"), record).unwrap();
    let output = folder.beamsim(&["report", &results.display().to_string()]);
    assert_eq!(controls(&[output.stdout, output.stderr].concat()), []);
}

/// Results of a sweep are opened by spreadsheets, which take some texts for formulas.
#[test]
fn tables_of_sweeps_hold_no_formulas() {
    let folder = folder("formulas");
    let deck = DECK.to_string() + "[units]\nlength = \"m\"\n";
    folder.write("deck.toml", &deck);
    let output = folder.beamsim(&["sweep", "deck.toml", "--vary", "units.length==cmd(),@SUM(1),m,-x", "--out", "r"]);
    let table = fs::read_to_string(folder.0.join("r/sweep.csv")).unwrap();
    assert!(table.contains("'=cmd()") && table.contains("'@SUM(1)") && table.contains("'-x"), "{table}");
    assert!(status(&output) == 0 || status(&output) == 3);
}

#[test]
fn long_chains_of_parameters_need_no_stack() {
    let folder = Folder::new("chains");
    // Each name is the sum of 990 of the next one.
    let names: Vec<String> = ('A'..='Z').filter(|name| *name != 'F').map(String::from).collect();
    let sum = |name: &String| vec![name.as_str(); 990].join("+");
    let chain: String = names.windows(2).map(|pair| format!("{} = \"{}\"\n", pair[0], sum(&pair[1]))).collect();
    let deck = DECK.replace("F = 1\n", &format!("F = \"min(A, 1)\"\n{chain}Z = 1\n"));
    assert!(deck.len() > 40_000);
    folder.write("deck.toml", &deck);
    fine(&folder.beamsim(&["check", "deck.toml"]));
}

#[test]
fn very_many_lines_and_messages_are_limits() {
    let folder = Folder::new("lines");
    folder.write("lines.toml", &"\n".repeat(3_000_000));
    folder.write("entries.toml", &format!("a = [{}]\n", "1,".repeat(3_000_000)));
    for name in ["lines.toml", "entries.toml"] {
        let output = folder.beamsim(&["check", name]);
        assert!(status(&output) == 2 && last_line(&output).starts_with("error[limit]: "), "{}", last_line(&output));
    }
    let twice: String = (0..1000).map(|_| "twice = 1\n").collect();
    folder.write("twice.toml", &twice);
    let output = folder.beamsim(&["check", "twice.toml"]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("more messages") && told.len() < 20_000, "{} bytes", told.len());
}

/// A shell sets the limit; the deck would need more than a gigabyte.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_not_there_is_a_limit() {
    let folder = Folder::new("memory");
    folder.write("deck.toml", &DECK.replace("elements = 2", "elements = 900000"));
    let limited = |words: &str| {
        let program = env!("CARGO_BIN_EXE_beamsim");
        let line = format!("ulimit -v 1000000; exec '{program}' {words}");
        Command::new("sh").args(["-c", &line]).current_dir(&folder.0).output().unwrap()
    };
    for words in ["check deck.toml", "run deck.toml --threads 1", "effects deck.toml"] {
        let output = limited(words);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words}: {told}");
        assert!(last_line(&output).starts_with("error[limit]: "), "{words}: {told}");
        assert!(words.starts_with("effects") || told.contains("nodes would fit"), "{words}: {told}");
    }
    // A point of a sweep that is too large is a row, and stops no other.
    folder.write("small.toml", DECK);
    let sweep = limited("sweep small.toml --threads 1 --vary beam.0.elements=2,900000,4 --out r");
    assert!(last_line(&sweep).contains("1 of 3 points did not finish: 1 `limit` (point 2)"), "{}", last_line(&sweep));
}

/// Lists of points that a process leaves behind which dies.
#[test]
fn points_of_a_process_that_died_are_run_alone() {
    let folder = folder("died");
    let sweep = ["sweep", "deck.toml", "--vary", "param.F=1,2,3", "--out", "r"];
    fine(&folder.beamsim(&sweep));
    let table = fs::read(folder.0.join("r/sweep.csv")).unwrap();
    // One point loses its result, as if the process had died while it ran.
    let lost = points(&folder.0.join("r/points")).into_iter().next().unwrap();
    let mark = lost.file_stem().unwrap().to_string_lossy().into_owned();
    fs::remove_file(&lost).unwrap();
    fs::write(folder.0.join("r/points/1-0.running"), format!("{mark}\n")).unwrap();
    let again = folder.beamsim(&sweep);
    fine(&again);
    let told = String::from_utf8_lossy(&again.stderr);
    assert!(told.contains("1 point(s) of a process that died"), "{told}");
    assert_eq!(fs::read(folder.0.join("r/sweep.csv")).unwrap(), table);
    assert!(!folder.names("r/points").iter().any(|name| name.ends_with(".running")));
    // A point that is known as killed stays so, until it is tried again.
    let result = fs::read_to_string(&lost).unwrap().replace("\"finished\"", "\"killed\"");
    fs::write(&lost, result).unwrap();
    let killed = folder.beamsim(&sweep);
    assert!(status(&killed) == 3 && last_line(&killed).contains("1 `killed`"), "{}", last_line(&killed));
    fine(&folder.beamsim(&[&sweep[..], &["--retry"]].concat()));
    assert_eq!(fs::read(folder.0.join("r/sweep.csv")).unwrap(), table);
}

/// The results of points.
fn points(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files = entries.filter(|path| path.is_dir()).flat_map(|path| fs::read_dir(path).unwrap());
    files.map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn a_deck_without_a_name_has_a_folder_of_its_own() {
    let folder = folder("odd_names");
    fs::create_dir(folder.0.join("odd")).unwrap();
    folder.write("odd/.toml", DECK);
    fine(&folder.beamsim(&["run", "deck.toml", "odd/.toml"]));
    assert_eq!(folder.names("results"), [".toml", "deck"]);
}
