//! Sections by shape, as decks give them: the reference sections of `core/tests/section`, and what only decks say.

use super::scenes::{simulate, warnings};
use beamsim::deck::{self, Deck};
use beamsim::scene;
use beamsim_core::model::SectionMatrices;
use beamsim_core::section::properties::{Properties, moved, relative_difference, turned};
use beamsim_core::section::recovery::{Measure, Recovery};
use beamsim_core::section::{Matrix6, Vector6};
use serde_json::Value;
use std::fmt::Write;
use std::sync::Arc;

fn read(text: &str) -> Deck {
    let (deck, found) = deck::read(text).unwrap_or_else(|found| panic!("{found:?}\n{text}"));
    assert!(found.is_empty(), "{found:?}\n{text}");
    deck
}

/// The matrices of the section `s`.
fn matrices(text: &str) -> SectionMatrices {
    let deck = read(text);
    let section = deck.sections.iter().find(|section| section.name.value == "s").unwrap();
    scene::section_matrices(section, &deck).unwrap_or_else(|found| panic!("{}\n{text}", found.message))
}

fn stiffness(text: &str) -> Matrix6 {
    let found = matrices(text);
    Matrix6::from_fn(|i, j| found.stiffness[i][j])
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

/// `[material.NAME]` tables of a case.
fn materials(case: &Value) -> String {
    let mut text = String::new();
    for (name, m) in case["materials"].as_object().unwrap() {
        let _ = writeln!(text, "[material.{name}]\nrho = {}", m["rho"]);
        let list = |keys: [&str; 3]| format!("[{}, {}, {}]", m[keys[0]], m[keys[1]], m[keys[2]]);
        let _ = match m.get("E") {
            Some(e) => writeln!(text, "E = {e}\nnu = {}", m["nu"]),
            None => writeln!(
                text,
                "E = {}\nG = {}\nnu = {}",
                list(["E1", "E2", "E3"]),
                list(["G12", "G13", "G23"]),
                list(["nu12", "nu13", "nu23"])
            ),
        };
    }
    text
}

/// `[section.s]` of a case, its line through the reference point of the case.
fn section(case: &Value) -> String {
    let g = &case["geometry"];
    let material = case["materials"].as_object().unwrap().keys().next().unwrap();
    let mut text = "[section.s]\nmesh = 1e-3\n".to_string();
    if let Some(regions) = g["regions"].as_array() {
        text += "shape = \"regions\"\n";
        for region in regions {
            let _ = writeln!(text, "[[section.s.region]]\nmaterial = {}", region["material"]);
            let _ = match region["shape"].as_str() {
                None => writeln!(text, "rect = {}", region["rect"]),
                Some("circle") => writeln!(text, "circle = {}", region["radius"]),
                Some(_) => {
                    let hole = number(region, "radius") - number(region, "thickness");
                    writeln!(text, "circle = {}\nholes = [{{ circle = {hole} }}]", region["radius"])
                }
            };
        }
        return text;
    }
    let keys = |keys: &[&str]| keys.iter().fold(String::new(), |all, key| format!("{all}{key} = {}\n", g[*key]));
    let (body, reference) = match g["shape"].as_str().unwrap() {
        "circle" => (keys(&["radius"]), [0.0; 2]),
        "tube" => (keys(&["radius", "thickness"]), [0.0; 2]),
        "ellipse" => {
            let size = ["semi_axis_2", "semi_axis_3"].map(|key| 2.0 * number(g, key));
            (format!("width = {}\nheight = {}\n", size[0], size[1]), [0.0; 2])
        }
        "rectangle" => {
            let centre = [0, 1].map(|k| -g["centre"][k].as_f64().unwrap_or(0.0));
            let angles = ["theta", "beta"].map(|key| g[format!("{key}_deg")].as_f64().unwrap_or(0.0).to_radians());
            (format!("{}theta = {}\nbeta = {}\n", keys(&["width", "height"]), angles[0], angles[1]), centre)
        }
        "polygon" => (keys(&["outline"]), [0.0; 2]),
        "channel" => {
            let web = -0.5 * (number(g, "b") - number(g, "t_w"));
            (keys(&["d", "b", "t_f", "t_w", "r"]), [web, 0.0])
        }
        "I" => (keys(&["d", "b", "t_f", "t_w", "r"]), [0.0; 2]),
        "T" => (keys(&["d", "b", "t_f", "t_w", "r"]), [0.0, 0.5 * number(g, "d")]),
        "box" if g.get("plies").is_some() => return format!("{text}{}", laminated_box(g)),
        "box" => (keys(&["d", "b", "t"]), [0.0; 2]),
        "laminate strip" => return format!("{text}{}", laminate_strip(g)),
        other => panic!("unknown shape {other}"),
    };
    let [x2, x3] = reference;
    format!("{text}shape = {}\nmaterial = \"{material}\"\nreference = [{x2}, {x3}]\n{body}", g["shape"])
}

fn laminated_box(g: &Value) -> String {
    let (b, d) = (0.5 * number(g, "b"), 0.5 * number(g, "d"));
    let count = number(g, "plies") as usize;
    let ply = format!("[\"ply\", {}, \"15*deg\"], ", number(g, "t") / count as f64);
    format!(
        "shape = \"walls\"\nside = \"right\"\nreference = [0, 0]\n\
         points = {{ a = [-{b}, {d}], b = [{b}, {d}], c = [{b}, -{d}], d = [-{b}, -{d}] }}\n\
         walls = [[\"a\", \"b\", \"w\"], [\"b\", \"c\", \"w\"], [\"c\", \"d\", \"w\"], [\"d\", \"a\", \"w\"]]\n\
         [layup.w]\nplies = [{}]\n",
        ply.repeat(count)
    )
}

fn laminate_strip(g: &Value) -> String {
    let angles = g["theta_deg"].as_array().unwrap();
    let names = g["materials"].as_array().unwrap();
    let thickness = number(g, "height") / angles.len() as f64;
    let half = 0.5 * number(g, "width");
    // Plies of the file are from below, those of walls from the left of the line, which is above.
    let plies = angles.iter().zip(names).rev();
    let plies: String = plies.map(|(angle, name)| format!("[{name}, {thickness}, \"{angle}*deg\"], ")).collect();
    format!(
        "shape = \"walls\"\nreference = [0, 0]\nturn = \"{}*deg\"\npoints = {{ a = [-{half}, 0], b = [{half}, 0] }}\n\
         walls = [[\"a\", \"b\", \"w\"]]\n[layup.w]\nplies = [{plies}]\n",
        g["turn_deg"]
    )
}

#[test]
fn reference_sections_are_those_of_decks() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/core/tests/section/section_cases.json");
    let cases: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    for case in cases.as_array().unwrap() {
        let text = materials(case) + &section(case);
        let reference = Matrix6::from_fn(|i, j| case["stiffness"][i][j].as_f64().unwrap());
        let error = relative_difference(&stiffness(&text), &reference);
        assert!(error < 1e-3, "{}: {error:.1e}\n{text}", case["name"]);
    }
}

const STEEL: &str = "[material.steel]\nE = 2.1e5\nnu = 0.3\nrho = 7.85e-9\n";

#[test]
fn closed_forms_and_computed_sections_agree() {
    let shapes = [
        "shape = \"circle\"\nradius = 5",
        "shape = \"tube\"\nradius = 5\nthickness = 1",
        "shape = \"rectangle\"\nwidth = 4\nheight = 7",
    ];
    for shape in shapes {
        let of = |more: &str| stiffness(&format!("{STEEL}[section.s]\nmaterial = \"steel\"\n{shape}\n{more}\n"));
        let error = relative_difference(&of("mesh = 1e-4"), &of("shear_factor = \"energy\""));
        assert!(error < 1e-4, "{shape}: {error:.1e}");
        // Cowper's factors are larger.
        assert!(of("")[(1, 1)] > 1.01 * of("shear_factor = \"energy\"")[(1, 1)]);
    }
}

#[test]
fn reference_and_turn_move_closed_forms_and_computed_sections() {
    for mesh in ["", "mesh = 1e-3\n"] {
        let shape =
            format!("{STEEL}[section.s]\nmaterial = \"steel\"\nshape = \"rectangle\"\nwidth = 4\nheight = 7\n{mesh}");
        let own = stiffness(&shape);
        let placed = stiffness(&format!("{shape}reference = [0.5, -2]\nturn = 0.3\n"));
        // Axes of a section that is turned by +0.3 see it as axes turned by -0.3 see the other one.
        let expected = turned(&moved(&own, [0.5, -2.0]), -0.3);
        assert!(relative_difference(&placed, &expected) < 1e-12);
        assert_eq!(own[(0, 4)], 0.0);
    }
}

/// Stresses of the section `s`.
fn stresses(text: &str) -> Recovery {
    let deck = read(text);
    let section = deck.sections.iter().find(|section| section.name.value == "s").unwrap();
    scene::section_stresses(section, &deck, &section.name.span)
        .unwrap_or_else(|found| panic!("{}\n{text}", found.message))
}

#[test]
fn closed_forms_and_computed_sections_have_the_same_stresses() {
    let shapes = [
        "shape = \"circle\"\nradius = 5",
        "shape = \"tube\"\nradius = 5\nthickness = 1",
        "shape = \"rectangle\"\nwidth = 4\nheight = 7",
    ];
    let loads = [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        [2.0, -3.0, 1.0, 4.0, 5.0, -6.0],
        [-1.0, 5.0, 5.0, -4.0, 1.0, 0.5],
    ];
    for shape in shapes {
        for placed in ["", "reference = [0.5, -2]\nturn = 0.3\n"] {
            let of = |more: &str| {
                let section = format!("[section.s]\nmaterial = \"steel\"\n{shape}\n{placed}{more}\n");
                stresses(&format!("{STEEL}{section}"))
            };
            let [closed, computed] = [of(""), of("mesh = 1e-5")];
            for load in loads {
                let load = Vector6::from(load);
                for (measure, name, _) in Measure::ALL {
                    let value = |section: &Recovery| section.largest(measure, &load, f64::NEG_INFINITY).unwrap().value;
                    let [exact, found] = [value(&closed), value(&computed)];
                    let scale = closed.largest(Measure::VonMises, &load, 0.0).unwrap().value;
                    assert!((found - exact).abs() < 1e-2 * scale, "{shape} {placed} {load} {name}: {found} {exact}");
                }
            }
        }
    }
}

#[test]
fn a_section_is_computed_once() {
    let text = format!("{STEEL}[section.s]\nshape = \"angle\"\nmaterial = \"steel\"\nd = 80\nb = 50\nt = 6\n");
    let solve = || {
        let deck = read(&text);
        let solved =
            scene::solved(&deck.sections[0], &deck).unwrap().unwrap_or_else(|found| panic!("{}", found.message));
        solved.solution.unwrap().analysis
    };
    assert!(Arc::ptr_eq(&solve(), &solve()));
}

#[test]
fn a_profile_with_root_radius_is_as_symmetric_as_its_shape() {
    let shape = "[section.s]\nshape = \"I\"\nmaterial = \"steel\"\nd = 200\nb = 100\nt_f = 8.5\nt_w = 5.6\nr = 12\n";
    let found = matrices(&format!("{STEEL}{shape}"));
    let couplings = (0..36).filter(|k| k / 6 != k % 6 && found.stiffness[k / 6][k % 6] != 0.0).count();
    assert_eq!(couplings, 0);
    let mass = found.mass.unwrap();
    assert!((mass.mass / 7.85e-9 / 2848.4 - 1.0).abs() < 1e-3, "{}", mass.mass);
    // True arcs have a torsion constant of 68462 mm^4.
    assert!((found.stiffness[3][3] * 2.6 / 2.1e5 / 68462.0 - 1.0).abs() < 1e-3);
}

/// An ellipse with a thin skin is near to a hollow ellipse, whose wall is thinner between its axes; it leads to +2 or to -2 alike.
#[test]
fn an_airfoil_is_its_skin() {
    let count = 40;
    let point = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / count as f64;
        format!("[{}, {}], ", 0.5 + 0.5 * angle.cos(), 0.2 * angle.sin())
    };
    let profile: String = (0..=count).map(point).collect();
    let blade = |le: &str| {
        format!(
            "{STEEL}[layup.skin]\nplies = [[\"steel\", 0.01]]\n[section.s]\nshape = \"airfoil\"\nprofile = [{profile}]\n\
             chord = 1\npitch_axis = 0.5\nle = \"{le}\"\nskin = [{{ layup = \"skin\" }}]\n"
        )
    };
    let ellipse = format!(
        "{STEEL}[section.s]\nshape = \"ellipse\"\nmaterial = \"steel\"\nwidth = 1\nheight = 0.4\nthickness = 0.01\n"
    );
    let [plus, minus] = ["+2", "-2"].map(|le| stiffness(&blade(le)));
    let ellipse = stiffness(&ellipse);
    for i in [0, 3, 4, 5] {
        assert!((plus[(i, i)] / ellipse[(i, i)] - 1.0).abs() < 0.1, "{i}: {} {}", plus[(i, i)], ellipse[(i, i)]);
        assert!((plus[(i, i)] / minus[(i, i)] - 1.0).abs() < 1e-3);
    }
}

/// Coordinates of maps: the origin is far away.
#[test]
fn sections_far_from_their_origin_keep_their_digits() {
    let properties = |left: f64, reference: &str| {
        let (right, low, high) = (left + 20.0, left, left + 10.0);
        let outline = format!("[[{left}, {low}], [{right}, {low}], [{right}, {high}], [{left}, {high}]]");
        let text = format!(
            "[material.m]\nE = 1\nnu = 0.3\n[section.s]\nshape = \"polygon\"\nmaterial = \"m\"\n\
             outline = {outline}\n{reference}"
        );
        let deck = read(&text);
        let solved = scene::solved(&deck.sections[0], &deck).unwrap().unwrap_or_else(|found| panic!("{found:?}"));
        let stiffness = Matrix6::from_fn(|i, j| solved.matrices.stiffness[i][j]);
        let compliance = solved.compliance.unwrap_or_else(|| stiffness.try_inverse().unwrap());
        (solved.place, Properties::new(&compliance))
    };
    let (_, near) = properties(0.0, "");
    let (place, far) = properties(1e6, "");
    assert_eq!(place, [0.0; 2]);
    assert!((far.gj / near.gj - 1.0).abs() < 1e-3, "{far:?}");
    for (found, exact) in [(far.shear_centre, [1e6 + 10.0, 1e6 + 5.0]), (far.tension_centre, [1e6 + 10.0, 1e6 + 5.0])] {
        assert!((0..2).all(|axis| (found[axis] - exact[axis]).abs() < 1e-2), "{far:?}");
    }
    let (place, centred) = properties(1e6, "reference = \"centroid\"");
    assert!((0..2).all(|axis| (place[axis] - [1e6 + 10.0, 1e6 + 5.0][axis]).abs() < 1e-5), "{place:?}");
    assert!((centred.ea / 200.0 - 1.0).abs() < 1e-9 && (centred.ga[0] / near.ga[0] - 1.0).abs() < 1e-3, "{centred:?}");
}

/// A cantilever whose section varies between the two that are given, with a beam table of its own.
fn tapered(ends: [&str; 2], beam: &str) -> String {
    let [first, second] = ends;
    format!(
        "[material.m]\nE = 1000\nnu = 0.3\nrho = 2\n[section.a]\nmaterial = \"m\"\n{first}\n[section.b]\nmaterial = \"m\"\n\
         {second}\n[point]\nroot = [0, 0, 0]\ntip = [3, 0, 0]\n[[beam]]\nname = \"b\"\nsection = [\"a\", \"b\"]\n\
         through = [\"root\", \"tip\"]\nelements = 3\norder = 2\n{beam}\n[[support]]\nat = \"root\"\nfix = \"all\"\n\
         [[load]]\nat = \"tip\"\nforce = [0.01, 0.02, -0.03]\nmoment = [0.02, 0, 0]\n\
         [[stage]]\nkind = \"static\"\nsteps = 1\n[output]\n"
    )
}

#[test]
fn a_taper_of_placed_sections_is_that_of_a_placed_beam() {
    let shapes = [
        ["shape = \"circle\"\nradius = 0.2", "shape = \"circle\"\nradius = 0.1"],
        [
            "shape = \"tube\"\nradius = 0.1\nthickness = 0.02\nshear_factor = \"energy\"",
            "shape = \"tube\"\nradius = 0.3\nthickness = 0.01\nshear_factor = \"energy\"",
        ],
        [
            "shape = \"rectangle\"\nwidth = 0.1\nheight = 0.3\nshear_factor = [0.8, 0.9]",
            "shape = \"rectangle\"\nwidth = 0.2\nheight = 0.1\nshear_factor = [0.7, 0.6]",
        ],
    ];
    for shape in shapes {
        for (turn, [a, b]) in [(0.4, [[0.0; 2]; 2]), (-1.1, [[0.1, -0.05], [0.02, 0.2]])] {
            let of_section = |shape: &str, at: [f64; 2]| format!("{shape}\nturn = {turn:?}\nreference = {at:?}");
            let by_sections = tapered([&of_section(shape[0], a), &of_section(shape[1], b)], "");
            // The middle lies beside the line by -reference, in axes that turn with the section.
            let (sin, cos) = f64::sin_cos(turn);
            let offset = |[x, y]: [f64; 2]| [-(cos * x - sin * y), -(sin * x + cos * y)];
            let (oa, ob) = (offset(a), offset(b));
            let by_beam = tapered(shape, &format!("offset = [{oa:?}, {ob:?}]\nturn = {turn:?}"));
            let [sections, beam] = [by_sections, by_beam].map(|text| {
                simulate(&format!("{text}nodes = [\"tip\", \"b@0.3\"]\ncolumns = [\"u\", \"r\", \"stress\"]\n"))
            });
            assert_eq!(sections.names, beam.names);
            for (name, (found, right)) in sections.names.iter().zip(sections.rows[1].iter().zip(&beam.rows[1])) {
                assert!((found - right).abs() <= 1e-9 * right.abs() + 1e-12, "{name}: {found} {right}\n{shape:?}");
            }
        }
    }
}

#[test]
fn sections_without_a_shape_in_between_are_warned_of_where_they_differ_much() {
    let square = |height: f64| format!("shape = \"rectangle\"\nwidth = 0.2\nheight = {height:?}\nmesh = 1e-2");
    let warned = |ends: [f64; 2]| {
        let text = tapered([&square(ends[0]), &square(ends[1])], "");
        warnings(&text).iter().any(|message| message.contains("varies linearly between the sections"))
    };
    // EI grows with the third power of the height.
    assert!(!warned([0.2, 0.25]) && !warned([0.25, 0.2]));
    assert!(warned([0.2, 0.32]) && warned([0.32, 0.2]));
}

#[test]
fn timber_has_no_contraction_of_its_section() {
    let section = "[section.s]\nmaterial = \"m\"\nshape = \"circle\"\nradius = 2\n";
    let timber = format!("[material.m]\nE = 11000\nG = 690\n{section}");
    let plain = format!("[material.m]\nE = 11000\nnu = 0\n{section}");
    let [of_timber, of_plain] = [stiffness(&timber), stiffness(&plain)];
    // GA is that of the given G, with the shear factor of a material without contraction.
    assert!((of_timber[(1, 1)] / of_plain[(1, 1)] - 690.0 / 5500.0).abs() < 1e-12);
    let shear = Vector6::from([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    let largest = |text: &str| stresses(text).largest(Measure::VonMises, &shear, f64::NEG_INFINITY).unwrap().value;
    assert!((largest(&timber) / largest(&plain) - 1.0).abs() < 1e-12);
}

/// Points as decks write them, turned about the origin.
fn turned_points(points: &[[f64; 2]], angle: f64) -> String {
    let (sin, cos) = angle.sin_cos();
    let point = |&[x, y]: &[f64; 2]| format!("[{:?}, {:?}]", cos * x - sin * y, sin * x + cos * y);
    format!("[{}]", points.iter().map(point).collect::<Vec<_>>().join(", "))
}

/// An outline and its holes.
type Outlined = (Vec<[f64; 2]>, Vec<Vec<[f64; 2]>>);

#[test]
fn outlines_that_share_edges_mean_what_they_enclose() {
    let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
    let rect = |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    // Each section twice: outline and holes that share edges, and what they mean.
    let notched =
        vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 4.0], [3.0, 4.0], [3.0, 1.0], [0.0, 1.0]];
    let spiked = vec![[0.0, 0.0], [12.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
    // A hole that is cut into the outline along a line which is followed to and fro.
    let mut keyhole = square.to_vec();
    keyhole.extend([[0.0, 0.0], [3.0, 3.0], [3.0, 6.0], [6.0, 6.0], [6.0, 3.0], [3.0, 3.0]]);
    let pairs: [[Outlined; 2]; 4] = [
        [(square.to_vec(), vec![rect([0.0, 3.0], [1.0, 4.0])]), (notched, vec![])],
        [
            (square.to_vec(), vec![rect([2.0, 4.0], [2.0, 5.0]), rect([4.0, 7.0], [2.0, 5.0])]),
            (square.to_vec(), vec![rect([2.0, 7.0], [2.0, 5.0])]),
        ],
        [(spiked, vec![]), (square.to_vec(), vec![])],
        [(keyhole, vec![]), (square.to_vec(), vec![rect([3.0, 6.0], [3.0, 6.0])])],
    ];
    for (number, pair) in pairs.iter().enumerate() {
        for angle in [0.0, 0.3] {
            let [shared, plain] = pair.each_ref().map(|(outline, holes)| {
                let holes: Vec<String> = holes.iter().map(|hole| turned_points(hole, angle)).collect();
                stiffness(&format!(
                    "{STEEL}[section.s]\nmaterial = \"steel\"\nshape = \"polygon\"\noutline = {}\nholes = [{}]\n",
                    turned_points(outline, angle),
                    holes.join(", ")
                ))
            });
            let error = relative_difference(&shared, &plain);
            assert!(error < 2e-3, "{number} turned by {angle}: {error:.1e}");
        }
    }
}

#[test]
fn parts_that_touch_in_a_point_are_apart_there() {
    let square = "[[0, 0], [10, 0], [10, 10], [0, 10]]";
    // Each section twice: with a point of contact, and with a narrow opening in its place.
    let pairs = [
        [
            "[{ rect = [2, 5, 2, 5] }, { rect = [5, 8, 5, 8] }]",
            "[[[2, 2], [5, 2], [5, 4.995], [5.005, 5], [8, 5], [8, 8], [5, 8], [5, 5.005], [4.995, 5], [2, 5]]]",
        ],
        ["[[[0, 5], [4, 3], [4, 7]]]", "[[[0, 4.995], [4, 3], [4, 7], [0, 5.005]]]"],
    ];
    for (number, pair) in pairs.iter().enumerate() {
        let [touching, open] = pair.map(|holes| {
            stiffness(&format!(
                "{STEEL}[section.s]\nmaterial = \"steel\"\nshape = \"polygon\"\noutline = {square}\nholes = {holes}\n"
            ))
        });
        let error = relative_difference(&touching, &open);
        assert!(error < 4e-3, "{number}: {error:.1e}");
    }
}

/// A tube of two arcs, wherever they part it, whichever way they run.
#[test]
fn tubes_of_two_arcs_are_tubes() {
    let material = "[material.m]\nE = 2\nnu = 0.3\nrho = 1\n";
    let tube = stiffness(&format!(
        "{material}[section.s]\nmaterial = \"m\"\nshape = \"tube\"\nradius = 0.11\nthickness = 0.02\nshear_factor = \"energy\"\n"
    ));
    for (degrees, turned) in [(180.0, false), (120.0, false), (250.0, false), (180.0, true), (100.0, true)] {
        let on_circle = |degrees: f64| {
            let (sine, cosine) = f64::to_radians(degrees + 20.0).sin_cos();
            format!("[{}, {}]", 0.1 * cosine, 0.1 * sine)
        };
        let second = match turned {
            false => format!("from = \"b\", to = \"a\", arc = {}", on_circle(0.5 * (degrees + 360.0))),
            true => format!("from = \"a\", to = \"b\", arc = {}", on_circle(0.5 * (degrees + 360.0))),
        };
        let walls = stiffness(&format!(
            "{material}[section.s]\nmaterial = \"m\"\nshape = \"walls\"\npoints = {{ a = {}, b = {} }}\n\
             walls = [{{ from = \"a\", to = \"b\", thickness = 0.02, arc = {} }}, {{ {second}, thickness = 0.02 }}]\n",
            on_circle(0.0),
            on_circle(degrees),
            on_circle(0.5 * degrees)
        ));
        for k in 0..6 {
            let error = walls[(k, k)] / tube[(k, k)] - 1.0;
            assert!(error.abs() < 1e-3, "{degrees}, {turned}, {k}: {error:e}");
        }
    }
}
