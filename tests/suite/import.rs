//! Decks from files of other programs: blades of BeamDyn and windIO.

use super::folder::{Folder, last_line, status};
use crate::scenes::frequencies;
use crate::scenes::simulate;
use beamsim::import::{abaqus_deck, blade_deck, read_abaqus, read_blade, read_driver, read_windio};
use std::fs;

fn text(name: &str) -> String {
    fs::read_to_string(format!("tests/import/{name}")).unwrap()
}

/// The deck of the NREL 5-MW blade (NREL/TP-500-38060, table 2-1), with its driver or without.
fn nrel(primary: &str, blade: &str, driver: Option<&str>) -> Result<String, String> {
    let driver = driver.map(|text| read_driver("d.dat", text)).transpose().map_err(|error| error.to_string())?;
    let open = |_: &str| Ok(("b.dat".to_string(), blade.to_string()));
    let blade = read_blade("p.dat", primary, open).map_err(|error| error.to_string())?;
    Ok(blade_deck(&blade, driver.as_ref()).deck)
}

/// The modes of the blade alone, as published: the turbine has collective flap 0.6993 Hz and
/// asymmetric edge 1.0793 and 1.0898 Hz, second asymmetric flap 1.9337 to 2.0205 Hz (table 9-1, FAST), in which hub and tower
/// take part a little.
#[test]
fn the_nrel_5mw_blade_has_its_published_frequencies() {
    let deck = nrel(&text("nrel_5mw.dat"), &text("nrel_5mw_blade.dat"), None).unwrap();
    let found: Vec<f64> = frequencies(&deck).iter().map(|omega| omega / (2.0 * std::f64::consts::PI)).collect();
    for (found, published) in found.iter().zip([0.6993, 1.0845, 1.977]) {
        assert!((found / published - 1.0).abs() < 0.025, "{found} Hz against {published} Hz; all: {found:?}");
    }
}

/// A force along x, small enough for the linear theory. The expected values are unit-load integrals over the tables, with the twist
/// about -z linear between stations (a program of its own, 8 Gauss points between two stations).
#[test]
fn the_nrel_5mw_blade_deflects_by_the_unit_load_integral() {
    let driver = text("nrel_5mw_driver.dat");
    let deck = nrel(&text("nrel_5mw.dat"), &text("nrel_5mw_blade.dat"), Some(&driver)).unwrap();
    let run = simulate(&deck);
    let [x, y] = ["blade@end.ux", "blade@end.uy"].map(|column| run.end(column));
    assert!((x / 0.08156319489 - 1.0).abs() < 2e-3, "{x}");
    assert!((y / -0.00475603542 - 1.0).abs() < 5e-3, "{y}");
}

#[test]
fn damping_and_matrices_are_in_the_order_of_sections() {
    let blade = text("nrel_5mw_blade.dat");
    let deck = nrel(&text("nrel_5mw.dat"), &blade, None).unwrap();
    assert!(deck.contains("stiffness = [0.0012, 0.001, 0.0011, 0.0016, 0.0014, 0.0022]"), "{deck}");
    // EA first, then shear along x and y, torsion, bending about x and y.
    assert!(
        deck.contains("# at 0.0: b.dat, line 11\nstiffness = [\n  [9729480000.0, 0.0, 0.0, 0.0, 0.0, 0.0],"),
        "{deck}"
    );
    let first = deck.split("[section.station_02]").next().unwrap();
    let torsion = first.find("5564400000.0").unwrap();
    assert!(torsion < first.find("18113600000.0").unwrap(), "{first}");
    assert!(first.find("18113600000.0").unwrap() < first.find("18110000000.0").unwrap(), "{first}");
}

/// The primary file with other key points: x, y and twist in degrees over z.
fn with_keys(primary: &str, key: impl Fn(f64, f64) -> [f64; 3]) -> String {
    let line = |line: &str| {
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        match numbers[..] {
            [0.0, 0.0, z, twist] if line.contains('E') => {
                let [x, y, twist] = key(z, twist);
                format!("{x} {y} {z} {twist}\n")
            }
            _ => format!("{line}\n"),
        }
    };
    primary.lines().map(line).collect()
}

/// The primary file of a blade that bends and sweeps.
fn bent(primary: &str) -> String {
    with_keys(primary, |z, twist| {
        let s = z / 61.5;
        [-4.0 * s * s, 0.8 * s * s * s, twist]
    })
}

/// The driver file with a force of 500 N along y at a fraction of the length.
fn point_load(eta: &str) -> String {
    text("nrel_5mw_driver.dat").replace("0   NumPointLoads", "1   NumPointLoads").replace(
        "(N-m)        (N-m)        (N-m)\n",
        &format!("(N-m)        (N-m)        (N-m)\n{eta} 0 500 0 0 0 0\n"),
    )
}

/// The numbers of a list of a deck.
fn list_of(deck: &str, key: &str) -> Vec<f64> {
    let begin = deck.find(&format!("\n{key} = [")).unwrap() + key.len() + 5;
    let end = begin + deck[begin..].find(']').unwrap();
    deck[begin..end].split(',').filter_map(|word| word.trim().parse().ok()).collect()
}

/// Angles go on where the twist passes half a turn.
#[test]
fn twist_goes_on_beyond_half_a_turn() {
    let primary = with_keys(&text("nrel_5mw.dat"), |z, _| [0.0, 0.0, 170.0 + 40.0 * z / 61.5]);
    let deck = nrel(&primary, &text("nrel_5mw_blade.dat"), None).unwrap();
    let twist = list_of(&deck, "twist");
    assert!(twist.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.2), "{twist:?}");
    assert!((twist[twist.len() - 1] - twist[0] + 40.0_f64.to_radians()).abs() < 1e-9, "{twist:?}");
}

/// A point load beside a station acts at the station, which is a node.
#[test]
fn point_loads_beside_a_station_act_there() {
    let blade = text("nrel_5mw_blade.dat");
    let deck = nrel(&text("nrel_5mw.dat"), &blade, None).unwrap();
    for station in [0, 3, 22] {
        let eta = list_of(&deck, "stations")[station];
        for shift in [1e-9, 5e-7, -5e-7] {
            let place = eta + shift;
            if !(0.0..=1.0).contains(&place) {
                continue;
            }
            let loaded = nrel(&text("nrel_5mw.dat"), &blade, Some(&point_load(&format!("{place:?}")))).unwrap();
            assert!(
                loaded.contains(&format!("at = \"blade@{eta:?}\"\nforce = [0.0, 500.0, 0.0]")),
                "{place}\n{loaded}"
            );
        }
    }
}

/// Each member has a natural spline of its own, and is a beam; the beams meet at named points.
#[test]
fn members_are_beams_that_meet() {
    let members = "2   member_total    - Total number of members (-)
         23   kp_total        - Total number of key points (-)
     1     12                - Member number; Number of key points in this member
     2     12                - Member number; Number of key points in this member
";
    let primary = bent(&text("nrel_5mw.dat"));
    let begin = primary.find("1   member_total").unwrap();
    let end = primary.find("   kp_xr").unwrap();
    let two = format!("{}{members}{}", &primary[..begin], &primary[end..]);
    let blade = text("nrel_5mw_blade.dat");
    let deck = nrel(&two, &blade, Some(&point_load("0.7"))).unwrap();
    assert!(deck.contains("[point]\nmember_2 = [") && deck.contains("at = \"blade_2@"), "{deck}");
    assert_eq!((deck.matches("\"member_2\"").count(), deck.matches("[[beam]]").count()), (2, 2), "{deck}");
    let one = simulate(&nrel(&primary, &blade, Some(&point_load("0.7"))).unwrap()).end("blade@end.ux");
    let two = simulate(&deck).end("blade_2@end.ux");
    assert!((two / one - 1.0).abs() < 0.01, "{two} against {one}");
}

#[test]
fn a_pitch_actuator_is_noted() {
    let primary =
        text("nrel_5mw.dat").replace("END of", "True  UsePitchAct - Whether a pitch actuator is used\nEND of");
    let deck = nrel(&primary, &text("nrel_5mw_blade.dat"), None).unwrap();
    assert!(deck.contains("# the pitch actuator (UsePitchAct) is not imported: the root is clamped"), "{deck}");
}

/// A blade that bends and sweeps is a spline; point loads find nodes.
#[test]
fn curved_blades_are_splines() {
    let curved = bent(&text("nrel_5mw.dat"));
    let driver = point_load("0.7");
    let deck = nrel(&curved, &text("nrel_5mw_blade.dat"), Some(&driver)).unwrap();
    assert!(deck.contains("spline = [") && deck.contains("at = \"blade@0.7\""), "{deck}");
    let run = simulate(&deck);
    assert!((run.end("blade@end.ux") / 0.0816 - 1.0).abs() < 0.05, "{}", run.end("blade@end.ux"));
}

#[test]
fn wrong_files_are_refused_at_their_place() {
    let primary = text("nrel_5mw.dat");
    let blade = text("nrel_5mw_blade.dat");
    let driver = text("nrel_5mw_driver.dat");
    let cases = [
        (nrel(&blade, &blade, None), "p.dat: this is a blade file: give the primary file"),
        (nrel("nothing", &blade, None), "p.dat: this is no primary input file of BeamDyn"),
        (nrel(&primary, &blade, Some("nothing")), "d.dat: this is no driver input file of BeamDyn"),
        (
            nrel(&primary.replace("23   kp_total", "24   kp_total"), &blade, None),
            "the members have 23 key points in all",
        ),
        (nrel(&primary.replace("1.3181000E+01", "13.18l"), &blade, None), "p.dat:26:46: `13.18l` is not a number"),
        (nrel(&primary, &blade.replace("9.729480E+09", "NaN"), None), "b.dat:14:"),
        (
            nrel(&primary, &blade.replace("  1.000000\n", "  0.999\n"), None),
            "the place of a station must be 1 at the last station, found 0.999",
        ),
        (
            nrel(&primary, &blade.replace("1.1E-03", "-1.1E-03"), None),
            "b.dat:9:1: a damping coefficient is negative: -0.0011",
        ),
        (
            nrel(&primary, &blade.replace("1.811360E+10", "-1.811360E+10"), None),
            "the stiffness of station 1 is not positive definite",
        ),
        (
            nrel(&primary.replace("0.0   rhoinf", "1.5   rhoinf"), &blade, None),
            "p.dat:6:9: `rhoinf` must be from 0 to 1, found 1.5",
        ),
        (
            nrel(&primary, &blade, Some(&driver.replace("GlbPos(3)", "GlbPos"))),
            "d.dat: there is no line with `GlbPos(3)`",
        ),
        (nrel(&primary, &blade, Some(&driver.replacen("1.0000000E+00  0.0000000E+00", "0.5  0.5", 1))), "GlbDCM"),
    ];
    for (found, told) in cases {
        let message = found.expect_err(told);
        assert!(
            message.contains(told),
            "{message}
expected {told}"
        );
    }
}

/// Key points far apart, whose spline bends the twist between them: the deck follows it with stations of its own.
#[test]
fn the_twist_of_a_blade_follows_its_spline() {
    let primary = text("nrel_5mw.dat");
    let keys = |count: usize, points: &str| -> String {
        let head = primary.split("kp_total").next().unwrap().rsplit_once('\n').unwrap().0;
        let tail = &primary[primary.find("---------------------- MESH PARAMETER").unwrap()..];
        format!(
            "{head}\n {count} kp_total\n 1 {count}\nkp_xr kp_yr kp_zr initial_twist\n(m) (m) (m) (deg)\n{points}{tail}"
        )
    };
    let deck = nrel(&keys(3, "0 0 0 0\n0 0 30.75 30\n0 0 61.5 0\n"), &text("nrel_5mw_blade.dat"), None).unwrap();
    let numbers = |key: &str| -> Vec<f64> {
        let list = deck.split_once(key).unwrap().1.split_once(']').unwrap().0;
        list.split([' ', ',', '[', '\n']).filter_map(|number| number.parse().ok()).collect()
    };
    let (places, twist) = (numbers("\nstations ="), numbers("\ntwist ="));
    // The natural spline through 0, 30 and 0 degrees, the opposite sign about axis 1.
    let spline = |place: f64| {
        let s = 1.0 - (2.0 * place - 1.0).abs();
        -30.0_f64.to_radians() * (1.5 * s - 0.5 * s.powi(3))
    };
    assert!(places.len() == twist.len() && places.len() > 20, "{deck}");
    for k in 1..places.len() {
        for part in [0.0, 0.3, 0.5, 0.8] {
            let linear = |list: &[f64]| list[k - 1] + (list[k] - list[k - 1]) * part;
            let error = (linear(&twist) - spline(linear(&places))).abs();
            assert!(error < 1.2e-3, "{error} between {} and {}", places[k - 1], places[k]);
        }
    }
}

/// The deck of a turbine of windIO.
fn windio(yaml: &str) -> Result<String, String> {
    let blade = read_windio("t.yaml", yaml).map_err(|error| error.to_string())?;
    Ok(blade_deck(&blade, None).deck)
}

/// The same blade in both forms: same sections, same line, same twist.
#[test]
fn windio_and_beamdyn_describe_one_blade() {
    let yaml = windio(&text("nrel_5mw_windio.yaml")).unwrap();
    let beamdyn = nrel(&text("nrel_5mw.dat"), &text("nrel_5mw_blade.dat"), None).unwrap();
    assert!(yaml.contains("# From a file of windIO: the blade (six_x_six) of t.yaml"), "{yaml}");
    let numbers = |deck: &str| -> Vec<f64> {
        let text: Vec<&str> = deck.lines().filter(|line| !line.starts_with('#')).collect();
        let text = text.join("\n");
        let text = text.split("[damping]").next().unwrap().split("[[stage]]").next().unwrap();
        let without = |line: &str| line.split('#').next().unwrap_or("").to_string();
        let text: String = text.lines().map(without).collect::<Vec<_>>().join("\n");
        text.split(|c: char| " ,[]\n".contains(c)).filter_map(|word| word.parse().ok()).collect()
    };
    let [a, b] = [numbers(&yaml), numbers(&beamdyn)];
    assert!(a.len() == b.len() && a.len() > 1500, "{} {}", a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} {b}");
    }
}

/// A matrix with all couplings: the upper triangle by rows, in the order x y z x y z.
#[test]
fn matrices_of_windio_are_upper_triangles_in_the_order_of_beamdyn() {
    let text = text("nrel_5mw_windio.yaml");
    let row = text.lines().find(|line| line.trim_start().starts_with("-  [972948000.0")).unwrap();
    let coupled = "                       -  [9e8, 1e6, 2e6, 3e6, 4e6, 5e6, 8e8, 6e6, 7e6, 8e6, 9e6, 9e9, 10e6, 11e6, 12e6, \
                   1.8e10, 13e6, 14e6, 1.7e10, 15e6, 5.5e9]";
    let deck = windio(&text.replace(row, coupled)).unwrap();
    // Axes 1, 2, 3 are z, x, y.
    let expected = "stiffness = [\n  [9000000000.0, 2000000.0, 6000000.0, 12000000.0, 10000000.0, 11000000.0],\n  \
                    [2000000.0, 900000000.0, 1000000.0, 5000000.0, 3000000.0, 4000000.0],";
    assert!(deck.contains(expected), "{}", &deck[..2000]);
}

#[test]
fn wrong_turbines_are_refused_at_their_place() {
    let text = text("nrel_5mw_windio.yaml");
    for (from, to, told) in [
        (
            "six_x_six:",
            "timoschenko_hawc:",
            "t.yaml:3:1: there is no `components.blade.elastic_properties_mb.six_x_six`",
        ),
        ("stiff_matrix:", "stiffness:", "there is no `stiff_matrix` here"),
        ("-  [972948000.0, ", "-  [", "a matrix has the 21 entries of its upper triangle by rows, found 20"),
        (
            "-  [972948000.0, ",
            "-  [-972948000.0, ",
            "t.yaml:27:27: the stiffness of a station is not positive definite (at 0)",
        ),
        ("-  [972948000.0, ", "-  [0.0, ", "the shear stiffness of a station is zero, as in files of PreComp"),
        ("-  [972948000.0, ", "-  [1e9l, ", "a matrix of `stiff_matrix` must be numbers"),
        ("-  [678.935, ", "-  [700.0, ", "t.yaml:53:27: the mass of a station differs by direction"),
        ("&span [0.0, ", "&span [0.1, ", "`grid` of `z` of the reference axis must increase from 0 to 1"),
        ("grid: [0.0, 1.0]", "grid: [0.0, 0.5, 1.0]", "`x` of the reference axis has 2 values and 3 places in `grid`"),
        ("*axis", "*axes", "t.yaml:22:33: this is no YAML"),
        (
            "[0.0, 1.199865, ",
            "[0.0, -1.199865, ",
            "`z` of the reference axis must increase, but does not before 0.01951",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let message = windio(&text.replacen(from, to, 1)).expect_err(told);
        assert!(message.contains(told), "{message}\nexpected {told}");
    }
    for end in (0..text.len()).step_by(997).filter(|&end| text.is_char_boundary(end)) {
        let _ = windio(&text[..end]);
    }
}

/// A note lists the keys that the import has no use for.
#[test]
fn keys_that_are_not_read_are_told() {
    let text = text("nrel_5mw_windio.yaml");
    let notes = |text: &str| blade_deck(&read_windio("t.yaml", text).unwrap(), None).notes;
    assert_eq!(notes(&text), ["not read: `components.blade.outer_shape_bem` (line 6)"]);
    let more = text.replacen("six_x_six:\n", "six_x_six:\n                viscosity: [1]\n", 1) + "assembly: {}\n";
    let told = notes(&more);
    let expected = "not read: `components.blade.outer_shape_bem` (line 6), \
                    `components.blade.elastic_properties_mb.six_x_six.viscosity` (line 22), `assembly` (line";
    assert!(told.len() == 1 && told[0].starts_with(expected), "{told:?}");
}

/// Files that end anywhere, or have lost any line, are refused or read, without a panic.
#[test]
fn damaged_files_never_panic() {
    let files = [text("nrel_5mw.dat"), text("nrel_5mw_blade.dat"), text("nrel_5mw_driver.dat")];
    for which in 0..3 {
        let lines: Vec<&str> = files[which].lines().collect();
        for line in (0..lines.len()).step_by(if which == 1 { 7 } else { 1 }) {
            let cut = lines[..line].join("\n");
            let without = [&lines[..line], &lines[line + 1..]].concat().join("\n");
            let garbage = [&lines[..line], &["\u{fffd} \" ,1e999"], &lines[line + 1..]].concat().join("\n");
            for damaged in [cut, without, garbage] {
                let mut now = files.clone();
                now[which] = damaged;
                let _ = nrel(&now[0], &now[1], Some(&now[2]));
            }
        }
    }
}

#[test]
fn the_command_writes_a_deck_that_checks() {
    let folder = Folder::new("import");
    for name in ["nrel_5mw.dat", "nrel_5mw_blade.dat", "nrel_5mw_driver.dat"] {
        folder.write(name, &text(name));
    }
    let output = folder.beamsim(&["import", "beamdyn", "nrel_5mw.dat", "nrel_5mw_driver.dat"]);
    assert_eq!(status(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let output = folder.beamsim(&["check", "nrel_5mw.toml"]);
    assert_eq!(status(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let again = folder.beamsim(&["import", "beamdyn", "nrel_5mw.dat"]);
    assert_eq!(status(&again), 4);
    assert!(last_line(&again).contains("already exists"), "{}", last_line(&again));
    let gone = folder.beamsim(&["import", "beamdyn", "missing.dat"]);
    assert_eq!(status(&gone), 4);
    folder.write("alone.dat", &text("nrel_5mw.dat").replace("nrel_5mw_blade.dat", "elsewhere.dat"));
    let alone = folder.beamsim(&["import", "beamdyn", "alone.dat"]);
    assert_eq!(status(&alone), 2);
    assert!(
        last_line(&alone).contains("alone.dat:") && last_line(&alone).contains("elsewhere.dat"),
        "{}",
        last_line(&alone)
    );
}

/// A cantilever of CalculiX, whose n1 is -z by default: its width lies along z, and its height along y.
const CANTILEVER: &str = "*NODE
1, 0, 0, 0
2, 0.5
3, 1.0
4, 1.5
5, 2.0
*ELEMENT, TYPE=B32, ELSET=ARM
1, 1, 2, 3
2, 3, 4, 5
*MATERIAL, NAME=Steel-1
*ELASTIC
1000., 0.25
*BEAM SECTION, ELSET=ARM, MATERIAL=STEEL-1, SECTION=RECT
0.1, 0.2
*BOUNDARY
1, 1, 6
*STEP
*STATIC
*CLOAD
5, 3, 1E-6
*END STEP
";

fn abaqus(text: &str) -> Result<String, String> {
    let model = read_abaqus("a.inp", text).map_err(|error| error.to_string())?;
    abaqus_deck(&model).map(|imported| imported.deck).map_err(|error| error.to_string())
}

/// F L³/(3 E I) + F L/(k G A) with Cowper's k.
#[test]
fn a_cantilever_of_calculix_deflects_by_its_formula() {
    let deck = abaqus(CANTILEVER).unwrap();
    let run = simulate(&format!("{deck}[output]\nnodes = [\"n5\"]\ncolumns = [\"u\"]\n"));
    let bending = 1e-6 * 8.0 / (3.0 * 1000.0 * 0.2 * 0.001 / 12.0);
    let shear = 1e-6 * 2.0 / (12.5 / 14.75 * 400.0 * 0.02);
    assert!((run.end("n5.uz") / (bending + shear) - 1.0).abs() < 1e-9, "{}", run.end("n5.uz"));
}

#[test]
fn rounds_have_a_radius_or_two_widths() {
    let of = |dimensions: &str| abaqus(&CANTILEVER.replace("RECT\n0.1, 0.2", &format!("CIRC\n{dimensions}"))).unwrap();
    assert!(of("0.1").contains("shape = \"circle\"\nradius = 0.1\n"));
    assert!(of("0.1, 0.1").contains("shape = \"circle\"\nradius = 0.05\n"));
    assert!(of("0.1, 0.2").contains("shape = \"ellipse\"\nwidth = 0.1\nheight = 0.2\n"));
}

#[test]
fn a_frame_of_abaqus_is_three_beams() {
    let deck = abaqus(&text("frame.inp")).unwrap();
    assert_eq!(deck.matches("[[beam]]").count(), 3, "{deck}");
    assert!(deck.contains("through = [\"n3\", \"n8\", \"n4\", \"n9\", \"n5\"]\nelements = 1\norder = 2"), "{deck}");
    assert!(deck.contains("along = \"girder\"\nforce = [0.0, 0.0, -5000.0]"), "{deck}");
    let run = simulate(&format!("{deck}[output]\nnodes = [\"n3\", \"n5\"]\ncolumns = [\"u\"]\n"));
    assert!(run.end("n3.ux") > 1e-3 && run.end("n3.uz") < 0.0);
    let modes = text("frame.inp").replace("*STATIC", "*FREQUENCY\n4,");
    assert_eq!(frequencies(&abaqus(&modes).unwrap()).len(), 4);
}

#[test]
fn wrong_input_files_are_refused_at_their_place() {
    let changed = |from: &str, to: &str| {
        assert!(CANTILEVER.contains(from), "{from}");
        abaqus(&CANTILEVER.replace(from, to))
    };
    let cases = [
        (abaqus("1, 2, 3\n"), "a.inp:1:1: data without a keyword"),
        (abaqus("*NODE\n1, 0, 0\n"), "a.inp: there are no beam elements"),
        (changed("2, 3, 4, 5", "2, 3, 4, 55"), "a.inp:9:10: there is no node 55"),
        (changed("2, 3, 4, 5", "2, 3, 4"), "a.inp:9:1: an element of type B32 has a number and 3 nodes"),
        (changed("3, 1.0", "3, 1.o"), "a.inp:4:4: `1.o` is not a number"),
        (changed("SECTION=RECT", "SECTION=ARBITRARY"), "a.inp:13:1: SECTION=ARBITRARY is not imported"),
        (changed("0.1, 0.2", "0.1"), "a.inp:14:1: too few dimensions"),
        (changed("0.1, 0.2", "0.1, 0.2\n1., 0., 0."), "is parallel to the element at node 1"),
        (changed("MATERIAL=STEEL-1", "MATERIAL=WOOD"), "a.inp:13:1: there is no *MATERIAL WOOD"),
        (changed("ELSET=ARM, MATERIAL", "ELSET=LEG, MATERIAL"), "there is no set of elements LEG"),
        (changed("1, 1, 6", "1, 1, 7"), "a.inp:16:7: expected a direction from 1 to 6, found `7`"),
        (changed("5, 3, 1E-6", "TIP, 3, 1E-6"), "a.inp:20:1: there is no set `TIP` above this line"),
        (changed("*ELASTIC\n1000., 0.25\n", ""), "the material STEEL-1 has no *ELASTIC"),
        (changed("4, 1.5", "4, 1.0"), "this element has no length"),
    ];
    for (found, told) in cases {
        let message = found.expect_err(told);
        assert!(message.contains(told), "{message}\nexpected {told}");
    }
    let lines: Vec<&str> = CANTILEVER.lines().collect();
    for line in 0..lines.len() {
        let _ = abaqus(&lines[..line].join("\n"));
        let _ = abaqus(&[&lines[..line], &lines[line + 1..]].concat().join("\n"));
        let _ = abaqus(&[&lines[..line], &[", =,*,\u{fffd}"], &lines[line + 1..]].concat().join("\n"));
        let _ = abaqus(&[&lines[..line], &["*"], &lines[line..]].concat().join("\n"));
    }
}

fn abaqus_notes(text: &str) -> Vec<String> {
    abaqus_deck(&read_abaqus("a.inp", text).unwrap()).unwrap().notes
}

fn with(from: &str, to: &str) -> String {
    assert!(CANTILEVER.contains(from), "{from}");
    CANTILEVER.replace(from, to)
}

/// A set of a line load may be any part of a straight run: the run is split where the load ends.
#[test]
fn line_loads_of_any_set_are_written() {
    let part = with(
        "*CLOAD\n5, 3, 1E-6",
        "*ELSET, ELSET=\"Outer-1\"\n2\n*DLOAD\nOuter-1, PZ, -1E-6\nARM, PY, 2E-6\n1, PX, 0.",
    );
    let deck = abaqus(&part).unwrap();
    assert_eq!(deck.matches("[[beam]]").count(), 2, "{deck}");
    assert!(deck.contains("along = \"arm_1\"\nforce = [0.0, 2e-6, 0.0]"), "{deck}");
    assert!(deck.contains("along = \"arm_2\"\nforce = [0.0, 2e-6, -1e-6]"), "{deck}");
    let alike = with("*CLOAD\n5, 3, 1E-6", "*DLOAD\n1, PZ, -1E-6\n2, PZ, -1E-6");
    let deck = abaqus(&alike).unwrap();
    assert_eq!(deck.matches("[[beam]]").count(), 1, "{deck}");
    let whole = with("*CLOAD\n5, 3, 1E-6", "*ELSET, ELSET=OTHER\nARM\n*DLOAD\nOTHER, PZ, -1E-6");
    let deck = abaqus(&whole).unwrap();
    assert_eq!(deck.matches("[[beam]]").count(), 1, "{deck}");
    assert!(deck.contains("along = \"arm\"\nforce = [0.0, 0.0, -1e-6]"), "{deck}");
}

/// GRAV has an acceleration, and a direction whose length does not count.
#[test]
fn gravity_has_the_length_of_its_number() {
    let deck = abaqus(&with("*CLOAD\n5, 3, 1E-6", "*DLOAD\nARM, GRAV, 9.81, 0., 0., -2.")).unwrap();
    assert!(deck.contains("gravity = [0.0, 0.0, -9.81]"), "{deck}");
    let deck = abaqus(&with("*CLOAD\n5, 3, 1E-6", "*DLOAD\n, GRAV, 10., 0., -4., 0.")).unwrap();
    assert!(deck.contains("gravity = [0.0, -10.0, 0.0]"), "{deck}");
}

/// Elements of the plane stay in it: the nodes of a B22 have no uz, rx, ry.
#[test]
fn planar_elements_stay_in_their_plane() {
    let deck = abaqus(&with("TYPE=B32", "TYPE=B22").replace("5, 3, 1E-6", "5, 2, 1E-6")).unwrap();
    assert!(deck.contains("at = \"n1\"\nfix = \"all\""), "{deck}");
    assert_eq!(deck.matches("fix = [\"uz\", \"rx\", \"ry\"]").count(), 4, "{deck}");
    let bending = 1e-6 * 8.0 / (3.0 * 1000.0 * 0.1 * 0.008 / 12.0);
    let run = simulate(&format!("{deck}[output]\nnodes = [\"n5\"]\ncolumns = [\"u\"]\n"));
    assert!(run.end("n5.uy") > bending && run.end("n5.uy") < 1.02 * bending, "{}", run.end("n5.uy"));
}

#[test]
fn names_that_become_alike_stay_apart() {
    let text = "*NODE
1, 0
2, 1
3, 2
4, 2, 1
*ELEMENT, TYPE=B31, ELSET=\"A-1\"
1, 1, 2
*ELEMENT, TYPE=B31, ELSET=A_1
2, 2, 3
3, 3, 4
*MATERIAL, NAME=\"M-1\"
*ELASTIC
1., 0.25
*MATERIAL, NAME=M_1
*ELASTIC
2., 0.25
*BEAM SECTION, ELSET=A-1, MATERIAL=M-1, SECTION=CIRC
0.1
*BEAM SECTION, ELSET=\"A_1\", MATERIAL=M_1, SECTION=CIRC
0.1
0, 0, 1
";
    let deck = abaqus(text).unwrap();
    for name in ["[material.m_1]", "[material.m_1_2]", "[section.a_1]", "[section.a_1_2]"] {
        assert_eq!(deck.matches(name).count(), 1, "{name}\n{deck}");
    }
    let names: Vec<&str> = deck.lines().filter(|line| line.starts_with("name = ")).collect();
    let mut alone = names.clone();
    alone.sort_unstable();
    alone.dedup();
    assert_eq!((names.len(), alone.len()), (3, 3), "{deck}");
}

/// Parts of a file that are left out are noted with their line.
#[test]
fn all_that_is_left_out_is_noted() {
    let cases = [
        (
            with("1, 1, 6", "1, 1, 6\n9, 1, 3").replace("5, 2.0", "5, 2.0\n9, 9."),
            "line 18: *BOUNDARY is not imported at nodes that belong to no beam: 9",
        ),
        (
            with("5, 3, 1E-6", "5, 3, 1E-6\n9, 1, 3.").replace("5, 2.0", "5, 2.0\n9, 9."),
            "line 22: *CLOAD is not imported at nodes",
        ),
        (with("*CLOAD", "*CLOAD, AMPLITUDE=RAMP"), "line 19: the parameter AMPLITUDE of *CLOAD"),
        (with("*BOUNDARY", "*BOUNDARY, OP=NEW"), "line 15: the parameter OP of *BOUNDARY"),
    ];
    for (text, told) in cases {
        let notes = abaqus_notes(&text);
        assert!(notes.len() == 1 && notes[0].starts_with(told), "{notes:?}\nexpected {told}");
    }
    let mixed = with("*MATERIAL", "*ELEMENT, TYPE=T3D2, ELSET=TIES\n7, 1, 5\n*ELSET, ELSET=EALL\nARM, TIES\n*MATERIAL");
    assert_eq!(abaqus_notes(&mixed), ["line 10: *ELEMENT of type T3D2 is not imported"]);
    assert!(abaqus_notes(CANTILEVER).is_empty());
    assert!(abaqus_notes(&with("*BOUNDARY", "*BOUNDARY, OP=MOD")).is_empty());
}

/// A file whose geometry, material or numbers would change unseen is refused at the place.
#[test]
fn what_means_two_things_is_refused_at_its_place() {
    let second = "2, 3, 4, 5\n";
    let dload = |line: &str| with("*CLOAD\n5, 3, 1E-6", &format!("*DLOAD\n{line}"));
    let section = "*BEAM SECTION, ELSET=ARM, MATERIAL=STEEL-1, SECTION=RECT\n0.1, 0.2\n";
    let cases = [
        (with("*NODE", "*PART, NAME=A\n*END PART\n*PART, NAME=B\n*NODE"), "a.inp:3:1: a second *PART"),
        (with("*NODE", "*INSTANCE, NAME=A\n*END INSTANCE\n*INSTANCE, NAME=B\n*NODE"), "a.inp:3:1: a second *INSTANCE"),
        (with("5, 2.0", "4, 2.0"), "a.inp:6:1: node 4 is given twice"),
        (with(second, "1, 3, 4, 5\n"), "a.inp:9:1: element 1 is given twice"),
        (with("*STEP", &format!("{section}*STEP")), "a.inp:17:1: element 1 has a *BEAM SECTION already, at line 13"),
        (with(second, "*ELEMENT, TYPE=B32\n2, 1, 2, 3\n"), "a.inp:10:1: element 2 has no *BEAM SECTION"),
        (with("*NODE", "*NODE, SYSTEM=C"), "a.inp:1:8: the parameter SYSTEM of *NODE"),
        (with("SECTION=RECT", "SECTION=RECT, OFFSET1=0.5"), "a.inp:13:59: the parameter OFFSET1 of *BEAMSECTION"),
        (with(second, "2, 3, 4, 5, 1\n"), "a.inp:9:13: a node of orientation"),
        (with("1000., 0.25", "1000., 0.25, 20.\n900., 0.25, 100."), "a.inp:13:1: *ELASTIC that depends on temperature"),
        (with("*MATERIAL, NAME=Steel-1", "*MATERIAL, NAME=Steel-1\n*MATERIAL, NAME=\"STEEL-1\""), "is given twice"),
        (with("*NODE", "*TRANSFORM, NSET=A\n*NODE"), "a.inp:1:1: *TRANSFORM is not imported"),
        (with("3, 1.0", "3, 1.0, 0., 0., 0., 1., 0."), "a.inp:4:17: a normal at a node"),
        (dload("2, GRAV, 9.81, 0., 0., -1."), "a.inp:20:1: GRAV is imported only for all beam elements"),
        (dload("ARM, GRAV, 9.81"), "a.inp:20:1: GRAV needs"),
        (dload("ARM, GRAV, 9.81, 0., 0., -1.\nARM, GRAV, 1., 1., 0., 0."), "a.inp:21:1: a second GRAV"),
        (dload("9, PX, 1."), "a.inp:20:1: `9` has no beam elements"),
        (with("1, 1, 6", "1, 6, 1"), "a.inp:16:7: the last direction, 1, is below the first, 6"),
        (
            with("*BOUNDARY", "*NSET, NSET=S, GENERATE\n5, 1\n*BOUNDARY"),
            "a.inp:16:1: GENERATE goes up, but 1 is below 5",
        ),
        (
            with("TYPE=B32", "TYPE=B22").replace("5, 2.0", "5, 2.0, 0., 1."),
            "a.inp:9:1: an element of type B22 must lie in the plane",
        ),
        (
            with("*BOUNDARY", "*NSET, NSET=S\n1\n*ASSEMBLY\n*NSET, NSET=S\n5\n*BOUNDARY"),
            "a.inp:18:1: the set S is one of the part and one of the assembly",
        ),
    ];
    for (text, told) in cases {
        let message = abaqus(&text).expect_err(told);
        assert!(message.contains(told), "{message}\nexpected {told}");
    }
}
