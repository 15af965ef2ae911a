//! Pictures of histories.

use super::folder::{Folder, last_line, status};
use std::fs;

const DECK: &str = "[point]\nroot = [0, 0, 0]\ntip = [1, 0, 0]\n[section.s]\nEA = 1e3\nGA = 1e3\nGJ = 10\nEI = 10\nrhoA = 1\n\
     [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 4\n[[support]]\nat = \"root\"\nfix = \"all\"\n\
     [[load]]\nat = \"tip\"\nforce = [0, 0, 2]\n[[stage]]\nkind = \"static\"\nsteps = 4\n[output]\nnodes = [\"tip\"]\n";

#[test]
fn histories_of_several_runs_and_a_reference_stand_on_one_axis() {
    let folder = Folder::new("plot");
    folder.write("deck.toml", DECK);
    for (out, elements) in [("fine", "8"), ("coarse", "2")] {
        let words = ["run", "deck.toml", "--error-bars", "--out", out, "--set"];
        let setting = format!("beam.0.elements={elements}");
        assert_eq!(status(&folder.beamsim(&[&words[..], &[&setting]].concat())), 0);
    }
    folder.write("stored.csv", "stage,time,load,tip.uz\n1,0,0,0\n1,0,1,0.07\n");
    let words = ["plot", "fine", "coarse", "--column", "tip.uz", "--reference", "stored.csv", "--out", "p.svg"];
    assert_eq!(status(&folder.beamsim(&words)), 0);
    let picture = fs::read_to_string(folder.0.join("p.svg")).unwrap();
    for word in [">fine<", ">coarse<", ">stored<", ">tip.uz<", ">load factor<", "stroke-dasharray"] {
        assert!(picture.contains(word), "{word}");
    }
    assert!(picture.starts_with("<svg") && !picture.contains("NaN"));
    // Both runs have bands.
    assert!(picture.matches("fill-opacity").count() >= 2 || picture.matches("opacity").count() >= 2);

    // Displacements where nothing is named, in the folder of the results.
    assert_eq!(status(&folder.beamsim(&["plot", "fine"])), 0);
    let picture = fs::read_to_string(folder.0.join("fine/plot.svg")).unwrap();
    assert!(picture.contains("tip.ux") && !picture.contains("tip.rx"));
}

/// Texts of a class in a picture.
fn texts(folder: &Folder, name: &str, class: &str) -> Vec<String> {
    let picture = fs::read_to_string(folder.0.join(name)).unwrap();
    let begins = format!("<text class=\"{class} ");
    let all = picture.lines().filter(|line| line.starts_with(&begins));
    all.map(|line| line.split_once('>').unwrap().1.trim_end_matches("</text>").to_string()).collect()
}

#[test]
fn axes_have_the_units_of_the_deck() {
    let folder = Folder::new("plot_units");
    let units = "units = { length = \"mm\", force = \"N\", time = \"s\" }\n";
    let columns = "columns = [\"u\", \"r\", \"reaction\"]\n";
    folder.write("arm.toml", &format!("title = \"An arm & a tip\"\n{units}{DECK}{columns}"));
    let dynamic = DECK.replace("kind = \"static\"\nsteps = 4", "kind = \"dynamic\"\nend = 0.2\nstep = 0.1");
    folder.write("swing.toml", &format!("{units}{dynamic}"));
    folder.write("metres.toml", &format!("{}{DECK}", units.replace("mm", "m")));
    for deck in ["arm.toml", "swing.toml", "metres.toml"] {
        assert_eq!(status(&folder.beamsim(&["run", deck])), 0);
    }
    for (results, words, axes, legend) in [
        ("arm", &["--column", "tip.uz"][..], ["load factor", "tip.uz [mm]"], &["tip.uz"][..]),
        ("swing", &["--column", "tip.uz"], ["time [s]", "tip.uz [mm]"], &["tip.uz"]),
        ("arm", &[], ["load factor", "displacement [mm]"], &["tip.ux", "tip.uz"]),
        ("arm", &["--column", "tip.ry", "--x", "tip.uz"], ["tip.uz [mm]", "tip.ry [rad]"], &["tip.ry"]),
        ("arm", &["--column", "tip.my", "--column", "tip.uz"], ["load factor", ""], &["tip.my [N·mm]", "tip.uz [mm]"]),
    ] {
        let path = format!("results/{results}");
        assert_eq!(status(&folder.beamsim(&[&["plot", &path, "--out", "p.svg"], words].concat())), 0);
        let shown =
            [texts(&folder, "p.svg", "x-title"), texts(&folder, "p.svg", "y-title")].map(|title| title.join(" "));
        assert_eq!(shown, axes, "{words:?}");
        assert_eq!(texts(&folder, "p.svg", "legend"), legend, "{words:?}");
        let title = if results == "arm" { "An arm &amp; a tip" } else { "swing" };
        assert_eq!(texts(&folder, "p.svg", "title"), [title]);
        for tick in [texts(&folder, "p.svg", "x-tick"), texts(&folder, "p.svg", "y-tick")].concat() {
            assert!(tick.parse::<f64>().is_ok(), "{tick}");
        }
    }
    let both = folder.beamsim(&["plot", "results/arm", "results/metres", "--column", "tip.uz", "--out", "p.svg"]);
    assert!(status(&both) == 0 && last_line(&both).contains("different units"), "{}", last_line(&both));
    assert_eq!(texts(&folder, "p.svg", "y-title"), ["tip.uz"]);
}

#[test]
fn names_of_results_keep_their_dots() {
    let folder = Folder::new("plot_dots");
    for deck in ["arm2_0.004.toml", "arm2_0.001.toml"] {
        folder.write(deck, DECK);
    }
    assert_eq!(status(&folder.beamsim(&["run", "arm2_0.004.toml", "arm2_0.001.toml"])), 0);
    assert_eq!(folder.names("results"), ["arm2_0.001", "arm2_0.004"]);
    let words =
        ["plot", "results/arm2_0.004", "results/arm2_0.001/history.csv", "--column", "tip.uz", "--out", "p.svg"];
    assert_eq!(status(&folder.beamsim(&words)), 0);
    assert_eq!(texts(&folder, "p.svg", "legend"), ["arm2_0.004", "arm2_0.001"]);
    assert_eq!(texts(&folder, "p.svg", "title"), ["arm2_0.004, arm2_0.001"]);
    assert_eq!(status(&folder.beamsim(&["report", "results/arm2_0.004"])), 0);
    let page = fs::read_to_string(folder.0.join("results/arm2_0.004/report.html")).unwrap();
    assert!(page.contains("<title>arm2_0.004</title>"));

    // Two results of one name are told apart by their paths.
    assert_eq!(status(&folder.beamsim(&["run", "arm2_0.004.toml", "--out", "other/arm2_0.004"])), 0);
    let words = ["plot", "results/arm2_0.004", "other/arm2_0.004", "--column", "tip.uz", "--out", "p.svg"];
    assert_eq!(status(&folder.beamsim(&words)), 0);
    assert_eq!(texts(&folder, "p.svg", "legend"), ["results/arm2_0.004", "other/arm2_0.004"]);
}

#[test]
fn stages_follow_each_other_on_the_horizontal_axis() {
    let folder = Folder::new("plot_stages");
    folder.write(
        "static.csv",
        "stage,time,load,tip.uz\n1,0,0,0\n1,0,0.5,1\n1,0,1,2\n2,0,0.5,3\n2,0,1,4\n3,0,-0.5,3\n3,0,0.5,2\n",
    );
    assert_eq!(status(&folder.beamsim(&["plot", "static.csv", "--out", "s.svg"])), 0);
    assert_eq!(texts(&folder, "s.svg", "x-title"), ["load factor, stage by stage"]);
    assert_eq!(texts(&folder, "s.svg", "boundary"), ["stage 2", "stage 3"]);
    let ticks = texts(&folder, "s.svg", "x-tick");
    assert_eq!((ticks.first().unwrap().as_str(), ticks.last().unwrap().as_str()), ("0", "3.0"));
    // Time where it advances in any stage: static stages take none of it.
    folder.write("mixed.csv", "stage,time,load,tip.uz\n1,0,0,0\n1,0,1,2\n2,0.1,1,3\n2,0.2,1,4\n3,0.3,1,4\n");
    assert_eq!(status(&folder.beamsim(&["plot", "mixed.csv", "--out", "m.svg"])), 0);
    assert_eq!(texts(&folder, "m.svg", "x-title"), ["time"]);
    assert_eq!(texts(&folder, "m.svg", "boundary"), ["stage 2", "stage 3"]);
    // One stage has no boundaries, and its load factor may go back.
    folder.write("path.csv", "stage,time,load,tip.uz\n1,0,0,0\n1,0,0.9,1\n1,0,0.5,2\n");
    assert_eq!(status(&folder.beamsim(&["plot", "path.csv", "--out", "p.svg"])), 0);
    assert_eq!(
        (texts(&folder, "p.svg", "x-title"), texts(&folder, "p.svg", "boundary")),
        (vec!["load factor".into()], vec![])
    );
}

#[test]
fn what_cannot_be_drawn_is_told() {
    let folder = Folder::new("plot_wrong");
    folder.write("h.csv", "stage,time,load,tip.uz\n1,0,0,0\n1,1,1,0.07\n");
    folder.write("clocks.csv", "stage,time,load\n1,0,0\n");
    folder.write("empty.csv", "stage,time,load,tip.uz\n");
    for (words, told) in [
        (&["h.csv", "--column", "tip.uq"][..], "did you mean `tip.uz`?"),
        (&["h.csv", "--x", "lod"], "did you mean `load`?"),
        (&["clocks.csv"], "no columns to plot"),
        (&["empty.csv"], "empty.csv has no rows"),
        (&["h.csv", "--reference", "empty.csv"], "empty.csv has no rows"),
        (&["nothing.csv"], "nothing.csv"),
        (&["h.csv", "--out", "h.pdf"], "unknown file type `.pdf`: plots are written as .svg or .png"),
    ] {
        let output = folder.beamsim(&[&["plot"], words].concat());
        assert!([2, 4].contains(&status(&output)) && last_line(&output).contains(told), "{}", last_line(&output));
    }
    // A history of one row, and one that stands still.
    folder.write("one.csv", "stage,time,load,tip.uz\n1,0,0,0\n");
    folder.write("still.csv", "stage,time,load,tip.uz\n1,0,0,0\n1,1,1,0\n");
    for name in ["one.csv", "still.csv"] {
        assert_eq!(status(&folder.beamsim(&["plot", name, "--out", "s.svg"])), 0);
        assert!(!fs::read_to_string(folder.0.join("s.svg")).unwrap().contains("NaN"));
    }
}

#[test]
fn a_plot_in_pixels_is_written_and_may_be_replaced() {
    let folder = Folder::new("plot_pixels");
    folder.write("h.csv", "stage,time,load,tip.uz\n1,0,0,0\n1,1,1,0.07\n");
    for _ in 0..2 {
        assert_eq!(status(&folder.beamsim(&["plot", "h.csv", "--out", "h.png"])), 0);
        let png = fs::read(folder.0.join("h.png")).unwrap();
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n") && png.ends_with(b"IEND\xae\x42\x60\x82"));
    }
}

#[test]
fn columns_that_are_left_out_are_listed() {
    let folder = Folder::new("plot_columns");
    let history = |suffixes: &[&str]| {
        let names: Vec<String> = suffixes.iter().map(|suffix| format!("tip.{suffix}")).collect();
        let row = |value: &str| format!(",{value}").repeat(names.len());
        format!("stage,time,load,{}\n1,0,0{}\n1,1,1{}\n", names.join(","), row("0"), row("1"))
    };
    let resultants = ["n1", "n2", "n3", "m1", "m2", "m3", "rx", "ry"];
    folder.write("resultants.csv", &history(&resultants));
    folder.write("mixed.csv", &history(&["rx", "ux", "uz"]));
    folder.write("few.csv", &history(&["ux", "uz"]));
    let many: Vec<String> = (0..20).map(|k| format!("q{k}")).collect();
    folder.write("many.csv", &history(&many.iter().map(String::as_str).collect::<Vec<_>>()));
    for (name, told) in [
        (
            "resultants.csv",
            "drawn: the first 6 of 8 columns (there are no displacements); not drawn: tip.rx, tip.ry; choose columns by --column",
        ),
        ("mixed.csv", "drawn: displacements that change; not drawn: tip.rx; choose columns by --column"),
        ("many.csv", "and 6 more; choose columns by --column"),
        ("few.csv", ""),
    ] {
        let output = folder.beamsim(&["plot", name, "--out", "p.svg"]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(status(&output) == 0 && text.contains(told), "{name}: {text}");
        assert_eq!(text.contains("not drawn"), !told.is_empty(), "{name}: {text}");
    }
    let named = folder.beamsim(&["plot", "resultants.csv", "--column", "tip.m1", "--out", "p.svg"]);
    assert!(!String::from_utf8_lossy(&named.stdout).contains("drawn"));
}

#[test]
fn every_stage_is_named_at_its_start() {
    let folder = Folder::new("plot_short_stages");
    // Stages 2 and 3 begin within a thousandth of the axis, stages 5 to 8 at its end.
    let starts = [0.0, 5.0, 5.01, 9.0, 9.97, 9.98, 9.99, 9.995];
    let rows: Vec<String> = starts
        .iter()
        .enumerate()
        .map(|(k, start)| {
            let end = starts.get(k + 1).unwrap_or(&10.0);
            format!("{stage},{start},1,0\n{stage},{end},1,1\n", stage = k + 1)
        })
        .collect();
    folder.write("h.csv", &format!("stage,time,load,tip.uz\n{}", rows.concat()));
    assert_eq!(status(&folder.beamsim(&["plot", "h.csv", "--out", "p.svg"])), 0);
    assert_eq!(texts(&folder, "p.svg", "boundary"), ["stage 2, stage 3", "stage 4 … stage 8"]);
}

#[test]
fn runs_that_failed_are_marked() {
    let folder = Folder::new("plot_failed");
    for deck in ["arm.toml", "stiff.toml"] {
        folder.write(deck, &format!("title = \"An arm\"\n{DECK}"));
    }
    let tight = ["run", "stiff.toml", "--set", "stage.0.max_iterations=1", "--set", "stage.0.adaptive=false"];
    assert_eq!(status(&folder.beamsim(&tight)), 3);
    assert_eq!(status(&folder.beamsim(&["run", "arm.toml"])), 0);
    let told = "the run did not finish (not_converged); its history ends there";
    let one = folder.beamsim(&["plot", "results/stiff", "--out", "p.svg"]);
    assert!(status(&one) == 0 && String::from_utf8_lossy(&one.stderr).contains(told), "{}", last_line(&one));
    assert_eq!(texts(&folder, "p.svg", "title"), ["An arm (did not finish: not_converged)"]);
    let both = folder.beamsim(&["plot", "results/arm", "results/stiff", "--column", "tip.uz", "--out", "p.svg"]);
    assert!(status(&both) == 0 && last_line(&both).contains(told), "{}", last_line(&both));
    // Runs of one title keep it.
    assert_eq!(texts(&folder, "p.svg", "title"), ["An arm"]);
    assert_eq!(texts(&folder, "p.svg", "legend"), ["arm", "stiff (did not finish: not_converged)"]);
    // A run that failed before its first state.
    fs::create_dir(folder.0.join("empty")).unwrap();
    let record = fs::read_to_string(folder.0.join("results/stiff/run.json")).unwrap();
    let mut record: serde_json::Value = serde_json::from_str(&record).unwrap();
    record.as_object_mut().unwrap().remove("files");
    folder.write("empty/run.json", &record.to_string());
    folder.write("empty/history.partial.csv", "stage,time,load,tip.uz\n");
    let empty = folder.beamsim(&["plot", "empty"]);
    assert_eq!(status(&empty), 2);
    assert!(last_line(&empty).ends_with("has no rows: the run failed before its first state (not_converged)"));
}

/// Two beams of a profile, with stress known on one of them.
const BEAMS: &str = "units = { length = \"m\", force = \"N\", time = \"s\" }\n\
     [point]\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [2, 0, 0]\n[material.m]\nE = 1e9\nnu = 0.3\n\
     [section.bar]\nshape = \"rectangle\"\nmaterial = \"m\"\nwidth = 0.02\nheight = 0.04\n\
     [section.s]\nEA = 1e6\nGA = 1e6\nGJ = 50\nEI = 100\n\
     [[beam]]\nname = \"first\"\nsection = \"bar\"\nthrough = [\"a\", \"b\"]\nelements = 2\n\
     [[beam]]\nname = \"second\"\nsection = \"s\"\nthrough = [\"b\", \"c\"]\nelements = 2\n\
     [[support]]\nat = \"a\"\nfix = \"all\"\n[[load]]\nat = \"c\"\nforce = [0, 0, 2]\n\
     [[stage]]\nkind = \"static\"\nsteps = 2\n[[stage]]\nkind = \"static\"\nsteps = 1\n\
     [output]\nnodes = [\"c\"]\nprofile = true\n";

#[test]
fn a_profile_is_a_diagram_over_the_length_of_beams() {
    let folder = Folder::new("plot-profile");
    folder.write("deck.toml", BEAMS);
    assert_eq!(status(&folder.beamsim(&["run", "deck.toml", "--out", "r"])), 0);
    let told = |words: &[&str]| {
        let output = folder.beamsim(&[&["plot", "r/profile.csv"], words].concat());
        (
            status(&output),
            String::from_utf8_lossy(&[output.stdout.clone(), output.stderr.clone()].concat()).into_owned(),
        )
    };
    let (ended, text) = told(&[]);
    assert!(ended == 0 && text.contains("drawn: M2; not drawn: N1"), "{text}");
    let picture = fs::read_to_string(folder.0.join("r/profile.svg")).unwrap();
    for word in [">first<", ">second<", "length along the beam [m]", "M2", "end of stage 2"] {
        assert!(picture.contains(word), "{word}");
    }
    assert!(!picture.contains("NaN"));
    let (ended, _) = told(&["--column", "vm", "--beam", "first", "--stage", "1", "--out", "s.svg"]);
    let picture = fs::read_to_string(folder.0.join("s.svg")).unwrap();
    assert!(ended == 0 && picture.contains("end of stage 1") && picture.contains("N/m²"), "{picture}");
    for (words, expected) in [
        (&["--beam", "firs"][..], "the profile has no beam `firs`: did you mean `first`?"),
        (&["--column", "M4"], "the profile has no column `M4`"),
        (&["--stage", "3"], "the profile has no stage 3: it has stages up to 2"),
        (&["--x", "load"], "`--x` is for histories"),
        (&["r"], "is a profile along beams, which is drawn alone"),
    ] {
        let (ended, text) = told(words);
        assert!(ended == 2 && text.contains(expected), "{ended} {text}");
    }
    // The profile of a run that did not finish says so, as a history does.
    let more = "[[load]]\nat = \"c\"\nforce = [0, 0, 20]\nstages = [2]\n[[stage]]\nkind = \"static\"\nsteps = 2\n";
    folder.write("more.toml", &BEAMS.replacen("[[stage]]\nkind = \"static\"\nsteps = 2\n", more, 1));
    let tight = ["--set", "stage.1.max_iterations=1", "--set", "stage.1.adaptive=false"];
    assert_eq!(status(&folder.beamsim(&[&["run", "more.toml", "--out", "f"], &tight[..]].concat())), 3);
    let output = folder.beamsim(&["plot", "f/profile.partial.csv"]);
    assert_eq!(status(&output), 0);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains("the run did not finish (not_converged); its profile ends there"), "{text}");
    let picture = fs::read_to_string(folder.0.join("f/profile.partial.svg")).unwrap();
    assert!(picture.contains("(did not finish: not_converged)"), "{picture}");
    let output = folder.beamsim(&["plot", "r", "--beam", "first"]);
    assert!(last_line(&output).contains("`--beam` is for profiles along beams"), "{}", last_line(&output));
}
