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
    for word in [">fine<", ">coarse<", ">stored<", ">tip.uz<", ">load<", "stroke-dasharray"] {
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

#[test]
fn what_cannot_be_drawn_is_told() {
    let folder = Folder::new("plot_wrong");
    folder.write("h.csv", "stage,time,load,tip.uz\n1,0,0,0\n1,1,1,0.07\n");
    folder.write("empty.csv", "stage,time,load\n");
    for (words, told) in [
        (&["h.csv", "--column", "tip.uq"][..], "did you mean `tip.uz`?"),
        (&["h.csv", "--x", "lod"], "did you mean `load`?"),
        (&["empty.csv"], "no columns to draw"),
        (&["nothing.csv"], "nothing.csv"),
        (&["h.csv", "--out", "h.pdf"], "`.pdf`: pictures are written as .svg or .png"),
        #[cfg(not(feature = "png"))]
        (&["h.csv", "--out", "h.png"], "--features png"),
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
