//! Contact with surfaces in whole scenes.

use crate::random::Random;
use crate::scenes::{Simulation, attempt, list, refusal, simulate, warnings};
use beamsim_core::failure::FailureKind;
use beamsim_core::tensor::Vec3;
use beamsim_core::warning::WarningKind;

/// A cantilever that a cylinder pushes down, in `steps` levels.
fn under_cylinder(elements: usize, order: usize, steps: usize, extra: &str) -> String {
    format!(
        r#"
[point]
root = [0, 0, 0]
tip = [1, 0, 0]
[section.s]
EA = 1e8
GA = 1e8
GJ = 100
EI = 100
[[beam]]
name = "beam"
section = "s"
through = ["root", "tip"]
elements = {elements}
order = {order}
[[support]]
at = "root"
fix = "all"
[[surface]]
name = "cylinder"
kind = "cylinder"
from = [0.7, -1, 0.1]
to = [0.7, 1, 0.1]
radius = 0.09
move = [0, 0, -0.3]
[[contact]]
name = "push"
beams = ["beam"]
surfaces = ["cylinder"]
radius = 0.01
{extra}
[[stage]]
kind = "static"
steps = {steps}
[output]
nodes = ["root", "tip"]
columns = ["u", "reaction", "contact", "energy"]
"#
    )
}

/// The force of the shooting solution of decks/contact/cantilever_under_cylinder.toml.
const FORCE: f64 = 247.49394512297124;

#[test]
fn the_force_of_a_moving_closest_point_converges_fast() {
    for (elements, order, limit) in [(50, 1, 1e-3), (25, 2, 1e-3), (17, 3, 2e-3)] {
        let simulation = simulate(&under_cylinder(elements, order, 20, ""));
        let error = (simulation.end("push.normal") / FORCE - 1.0).abs();
        println!(
            "{elements} elements of order {order}: {error:.2e}, {} iterations",
            simulation.counters.work.iterations
        );
        assert!(error < limit, "{elements} elements of order {order}: {error}");
    }
}

#[test]
fn cut_backs_give_the_answer_of_small_levels() {
    let [few, many] = [3, 40].map(|steps| simulate(&under_cylinder(40, 1, steps, "friction = 0.2")));
    let [few, many] = [few, many].map(|simulation| [simulation.end("push.normal"), simulation.end("tip.uz")]);
    // The path of friction depends on the levels a little.
    assert!((few[0] / many[0] - 1.0).abs() < 0.02 && (few[1] / many[1] - 1.0).abs() < 0.01, "{few:?} {many:?}");
}

#[test]
fn the_answer_does_not_depend_on_the_stiffness() {
    let forces = [1e3, 1e5, 1e7, 1e18].map(|stiffness| {
        simulate(&under_cylinder(40, 1, 20, &format!("stiffness = {stiffness}\npenetration = 1e-8"))).end("push.normal")
    });
    assert!(forces.iter().all(|force| (force / forces[0] - 1.0).abs() < 1e-6), "{forces:?}");
}

/// Balance of forces, and the work of the moving surface.
#[test]
fn reactions_and_energies_balance() {
    let simulation = simulate(&under_cylinder(40, 1, 40, ""));
    for axis in ["x", "y", "z"] {
        let sum = simulation.end(&format!("root.f{axis}")) + simulation.end(&format!("push.f{axis}"));
        assert!(sum.abs() < 1e-6 * FORCE, "{axis}: {sum}");
    }
    let [total, strain] = ["energy.total", "energy.strain"].map(|name| simulation.end(name));
    assert!(total.abs() < 0.01 * strain, "{total} {strain}");
}

/// A scene whose parts do not meet is the same with contact and without, to the last bit.
#[test]
fn contacts_that_never_touch_change_nothing() {
    let far = under_cylinder(20, 1, 5, "").replace("0.7, -1, 0.1", "0.7, -1, 5").replace("0.7, 1, 0.1", "0.7, 1, 5");
    let load = "[[load]]\nat = \"tip\"\nforce = [0, 0, 50]\n";
    let with = (load.to_string() + &far).replace("columns = [\"u\", \"reaction\", \"contact\", \"energy\"]", "");
    let start = with.find("[[surface]]").unwrap();
    let end = with.find("[[stage]]").unwrap();
    let without = with[..start].to_string() + &with[end..];
    let [with, without] = [with, without].map(|text| simulate(&text));
    assert_eq!(with.rows, without.rows);
    assert_eq!(with.counters.work.iterations, without.counters.work.iterations);
}

/// A heavy block on a plane of 20 degrees.
fn block(friction: f64, stage: &str) -> String {
    format!(
        r#"
gravity = ["9.81*sin(20*deg)", 0, "-9.81*cos(20*deg)"]
[point]
block = [0, 0, 0.1]
[[body]]
at = "block"
mass = 1
[[surface]]
name = "incline"
kind = "plane"
point = [0, 0, 0]
normal = [0, 0, 1]
[[contact]]
name = "base"
nodes = ["block"]
surfaces = ["incline"]
radius = 0.1
stiffness = 1e4
friction = {friction}
{stage}
[output]
nodes = ["block"]
columns = ["u", "v", "contact", "energy"]
"#
    )
}

#[test]
fn a_block_creeps_elastically_where_it_sticks() {
    let simulation = simulate(&block(0.4, "[[stage]]\nkind = \"static\"\nsteps = 4"));
    let creep = simulation.end("block.ux");
    assert!((creep * 1e4 / 3.3552176060248105 - 1.0).abs() < 1e-6, "{creep}");
    assert_eq!(simulation.end("base.sliding"), 0.0);
    let total = simulation.end("energy.total");
    assert!(total.abs() < 1e-9, "{total}");
}

#[test]
fn a_block_that_slides_has_no_equilibrium() {
    let simulation = attempt(&block(0.3, "[[stage]]\nkind = \"static\"\nsteps = 4"));
    assert!(simulation.result.is_err());
}

#[test]
fn a_run_does_not_begin_with_a_penetration() {
    let deep = block(0.3, "[[stage]]\nkind = \"static\"\nsteps = 4").replace("[0, 0, 0.1]", "[0, 0, 0.05]");
    let failure = attempt(&deep).result.unwrap_err();
    assert_eq!(failure.kind(), FailureKind::ContactStart, "{failure}");
}

#[test]
fn what_contact_cannot_do_is_refused_by_name() {
    let deck = |extra: &str| under_cylinder(10, 1, 5, extra);
    for (text, message) in [
        (deck("with = [\"beam\"]"), "`beam` is in `beams` and in `with`"),
        (deck("start = \"push\""), "`start` is not available"),
        (
            deck("friction = 0.1") + "[[stage]]\nkind = \"buckling\"\nmodes = 1\n",
            "a buckling stage does not support [[contact]]",
        ),
        (
            deck("").replace("steps = 5", "steps = 5\ncontrol = \"arc_length\""),
            "control = \"arc_length\" does not support",
        ),
        (deck("") + "[effects]\nlarge_rotations = false\n", "large_rotations = false does not support [[contact]]"),
        (deck("").replace("name = \"push\"", "name = \"tip\""), "has the name of a point"),
    ] {
        let found = refusal(&text);
        assert!(found.contains(message), "{message}: {found}");
    }
}

/// A ball that hits a wall, as `extra` keys of its contact say.
fn ball(extra: &str, step: f64) -> String {
    format!(
        r#"
[point]
ball = [0, 0, 0.11]
[[body]]
at = "ball"
mass = 1
[[initial]]
at = "ball"
velocity = [0, 0, -2]
[[surface]]
name = "wall"
kind = "plane"
point = [0, 0, 0]
normal = [0, 0, 1]
[[contact]]
name = "hit"
nodes = ["ball"]
surfaces = ["wall"]
radius = 0.1
stiffness = 1e6
penetration = 0.003
{extra}
[[stage]]
kind = "dynamic"
end = 0.02
step = {step}
[output]
nodes = ["ball"]
columns = ["u", "v", "contact", "energy"]
"#
    )
}

#[test]
fn a_ball_rebounds_with_its_restitution() {
    for (extra, rebound) in [("", 1.0), ("damping = 0.25", 0.7484349315974341), ("restitution = 0.5\nspeed = 2", 0.5)] {
        let simulation = simulate(&ball(extra, 3e-5));
        let velocity = simulation.end("ball.vz");
        assert!((velocity / (2.0 * rebound) - 1.0).abs() < 2e-3, "{extra}: {velocity}");
        let total = simulation.end("energy.total");
        assert!((total - 2.0).abs() < 5e-3 * 2.0, "{extra}: {total}");
    }
}

/// A wire, or a ball if there are no elements, at the origin, inside or outside a surface about it.
fn at_the_middle(carrier: &str, surface: &str) -> String {
    format!(
        r#"
[point]
a = [0, 0, 0]
b = [1, 0, 0]
{carrier}
[[surface]]
name = "round"
{surface}
[[contact]]
name = "c"
surfaces = ["round"]
radius = 0.01
"#
    ) + if carrier.contains("[[beam]]") {
        "beams = [\"wire\"]\n[[stage]]\nkind = \"static\"\nsteps = 2\n[output]\ncolumns = [\"u\", \"contact\"]\n"
    } else {
        "nodes = [\"a\"]\nstiffness = 1e4\n[[stage]]\nkind = \"dynamic\"\nend = 1e-3\nstep = 1e-4\n[output]\ncolumns = [\"u\", \"contact\"]\n"
    }
}

const WIRE: &str = "[section.s]\nEA = 1e3\nGA = 1e3\nGJ = 1\nEI = 1\n[[beam]]\nname = \"wire\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\n\
                    elements = 4\n[[support]]\nat = \"a\"\nfix = \"all\"\n[[load]]\nat = \"b\"\nforce = [1e-3, 0, 0]\n";
const BALL: &str = "[[body]]\nat = \"a\"\nmass = 1\n";

#[test]
fn gaps_are_known_where_surfaces_have_no_normal() {
    let surfaces = [
        (WIRE, "kind = \"cylinder\"\nfrom = [0, 0, 0]\nto = [1, 0, 0]\nradius = 0.05\nside = \"inside\""),
        (WIRE, "kind = \"tube\"\nthrough = [[-1, 0, 0], [0.5, 0, 0], [3, 0, 0]]\nradius = 0.05\nside = \"inside\""),
        (BALL, "kind = \"sphere\"\nat = [0, 0, 0]\nradius = 0.05\nside = \"inside\""),
        (BALL, "kind = \"torus\"\nat = [0, 1, 0]\naxis = [0, 0, 1]\nring = 1\nradius = 0.05\nside = \"inside\""),
    ];
    for (carrier, surface) in surfaces {
        let gap = simulate(&at_the_middle(carrier, surface)).end("c.gap");
        assert!((gap - 0.04).abs() < 1e-6, "{surface}: {gap}");
    }
}

#[test]
fn what_begins_at_a_centre_begins_inside() {
    for surface in [
        "kind = \"sphere\"\nat = [0, 0, 0]\nradius = 1",
        "kind = \"cylinder\"\nfrom = [0, 0, 0]\nto = [1, 0, 0]\nradius = 1",
        "kind = \"sphere\"\nat = [0, 0, 0]\nradius = 0.005\nside = \"inside\"",
    ] {
        let failure = attempt(&at_the_middle(BALL, surface)).result.unwrap_err();
        assert_eq!(failure.kind(), FailureKind::ContactStart, "{surface}: {failure}");
    }
}

#[test]
fn what_is_named_twice_is_refused() {
    let text = at_the_middle(BALL, "kind = \"plane\"\npoint = [0, 0, -1]\nnormal = [0, 0, 1]");
    let found = refusal(&text.replace("nodes = [\"a\"]", "nodes = [\"a\", \"a\"]"));
    assert!(found.contains("`nodes` names `a` twice"), "{found}");
}

/// A rod that falls on a box, both in random orientations.
fn rod_on_box(random: &mut Random) -> String {
    let order = random.range(1.0, 3.99) as usize;
    let elements = random.range(1.0, 5.99) as usize;
    let [first, second] = [random.direction(), random.direction()];
    let third = first.cross(second).normalized().expect("the directions are random");
    let half = [0; 3].map(|_| random.range(0.05, 0.2));
    let along = Vec3([1.0, random.range(-0.3, 0.3), random.range(-0.15, 0.15)]).normalized().expect("along x");
    let above = Vec3([0.0, 0.0, Vec3(half).norm() + 0.25]);
    let from = above - along * random.range(0.3, 0.7);
    format!(
        r#"
gravity = [0, 0, -9.81]
[point]
a = {:?}
b = {:?}
[section.s]
EA = 1e5
GA = 5e4
GJ = 100
EI = 100
rhoA = 0.5
rhoJ = [1e-4, 5e-5, 5e-5]
[[beam]]
name = "rod"
section = "s"
through = ["a", "b"]
elements = {elements}
order = {order}
[[surface]]
name = "box"
kind = "box"
at = [0, 0, 0]
half = {half:?}
axes = [{:?}, {:?}]
[[contact]]
name = "hit"
beams = ["rod"]
surfaces = ["box"]
radius = 0.02
stiffness = 1e4
penetration = 0.01
[output]
columns = ["energy", "contact"]
[[stage]]
kind = "dynamic"
end = 0.4
step = 2.5e-4
"#,
        from.0,
        (from + along).0,
        first.0,
        third.0
    )
}

/// A box of half edges of one, as a mesh file.
const BOX: &str = "v -1 -1 -1\nv -1 -1 1\nv -1 1 -1\nv -1 1 1\nv 1 -1 -1\nv 1 -1 1\nv 1 1 -1\nv 1 1 1\n\
                   f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n";

/// The text of a deck with the triangles of the file that it names.
fn with_file(text: &str, content: &str) -> Result<String, String> {
    let imported = beamsim::deck::import(text, &|_| Ok(content.into()));
    imported.map(|imported| imported.text).map_err(|found| found[0].message.clone())
}

/// A box as a mesh gives the same motion as the box itself.
#[test]
fn rods_that_fall_on_meshed_boxes_move_as_on_boxes() {
    let mut random = Random::new(17);
    for case in 0..6 {
        let text = rod_on_box(&mut random).replace("end = 0.4", "end = 0.3");
        let start = text.find("half = [").unwrap();
        let end = start + text[start..].find('\n').unwrap();
        let half: Vec<f64> = text[start + 8..end - 1].split(", ").map(|x| x.parse().unwrap()).collect();
        let coordinates = |line: &str| -> String {
            let scaled = line.split(' ').skip(1).zip(&half).map(|(x, half)| x.parse::<f64>().unwrap() * half);
            scaled.map(|x| format!(" {x:?}")).collect()
        };
        let scaled =
            |line: &str| if line.starts_with('v') { format!("v{}\n", coordinates(line)) } else { format!("{line}\n") };
        let file: String = BOX.lines().map(scaled).collect();
        let meshed = text.replace("kind = \"box\"", "kind = \"mesh\"").replace(&text[start..end], "file = \"box.obj\"");
        let [exact, meshed] = [text, with_file(&meshed, &file).unwrap()].map(|text| simulate(&text));
        let [exact, meshed] = [exact, meshed].map(|simulation| simulation.column("energy.kinetic"));
        let largest = exact.iter().copied().fold(0.0, f64::max);
        let differs = exact.iter().zip(&meshed).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest;
        println!("case {case}: {differs:.1e}");
        assert!(exact.len() == meshed.len() && differs < 1e-5, "case {case}: {differs}");
    }
}

#[test]
fn meshes_that_bound_no_body_are_refused_with_their_place() {
    let deck = under_cylinder(4, 1, 1, "");
    let start = deck.find("kind = \"cylinder\"").unwrap();
    let end = deck.find("move = ").unwrap();
    let deck = format!("{}kind = \"mesh\"\nfile = \"part.obj\"\nat = [0.7, 0, 3]\n{}", &deck[..start], &deck[end..]);
    let built = |file: &str| refusal(&with_file(&deck, file).unwrap());
    for (file, told) in [
        (BOX.replace("f 1 2 4 3\n", ""), "part.obj does not bound a body: the edge from"),
        (BOX.replace("f 1 2 4 3", "f 1 3 4 2"), "is turned over"),
        (BOX.replace("v 1 1 1", "v 1 1 -1"), "has no area"),
        (format!("{BOX}f 1 2 8\n"), "belongs to more than two triangles"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".into(), "fewer than four triangles"),
        (inside_out(), "all of its normals point inward"),
    ] {
        let found = built(&file);
        assert!(found.contains(told), "{found}");
    }
    let told = [
        ("v 0 0 zero\nf 1 1 1\n", "part.obj: line 1: `zero` is not a number"),
        ("v 0 \\\n0\n", "line 1: a vertex has three"),
        ("v 0 0 0\n\nf 1 1 -2\n", "line 3: there is no vertex -2"),
    ];
    for (file, told) in told {
        let found = with_file(&deck, file).unwrap_err();
        assert!(found.contains(told), "{found}");
    }
    assert!(with_file(&deck.replace("part.obj", "part.ply"), BOX).unwrap_err().contains(".stl or .obj"));
    let unread = refusal(&deck);
    assert!(unread.contains("the mesh `part.obj` was not read"), "{unread}");
}

/// The box with all of its faces turned.
fn inside_out() -> String {
    let turned = |line: &str| {
        let mut words: Vec<&str> = line.split(' ').collect();
        if words[0] == "f" {
            words[1..].reverse();
        }
        words.join(" ") + "\n"
    };
    BOX.lines().map(turned).collect()
}

/// Edges of a box are touched between nodes, too: energy is kept, and no rod passes through. In one
/// case a closest point of a bent element ends in contact, which takes 1 % of the energy.
#[test]
fn rods_that_fall_on_boxes_keep_their_energy() {
    let mut random = Random::new(11);
    for case in 0..12 {
        let simulation = simulate(&rod_on_box(&mut random));
        let total = simulation.column("energy.total");
        let kinetic = simulation.column("energy.kinetic").into_iter().fold(0.0, f64::max);
        let drift = total.iter().map(|e| (e - total[0]).abs()).fold(0.0, f64::max) / kinetic;
        let touched = simulation.column("energy.contact").into_iter().fold(0.0, f64::max);
        let gap = simulation.column("hit.gap").into_iter().fold(f64::INFINITY, f64::min);
        println!("case {case}: energy drifts by {drift:.1e}, least gap {gap:.4}");
        assert!(touched > 0.01 * kinetic && drift < 1.5e-2, "case {case}: {touched} {drift}");
        assert!(gap > -0.018, "case {case}: {gap}");
    }
}

/// A drum with a radial arm winds up a cable by a third of a turn, in a few load levels; its hub
/// carries the load at the free end.
const WINCH: &str = r#"
[param]
R = 0.1
r = 0.005
out = "R + r"
turns = 0.3
T = 50.0
EI = 0.02
n = 30

[point]
hub = [0, 0, 0]
start = ["out", 0, 0]
weight = ["out", 0, "-(2*pi*turns*out + 0.3)"]

[section.cable]
EA = 1e5
GA = 1e4
GJ = 0.02
EI = "EI"

[section.spoke]
EA = 1e7
GA = 1e7
GJ = 1e4
EI = 1e4

[[beam]]
name = "spoke"
section = "spoke"
through = ["hub", "start"]
elements = 1
axis3 = [0, 1, 0]

[[beam]]
name = "cable"
section = "cable"
through = ["start", "weight"]
elements = "n"
order = 1
axis3 = [0, 1, 0]

[[motion]]
at = "hub"
rotate = [0, -1, 0]
angle = "2*pi*turns"
stages = [2]

[[support]]
at = "hub"
fix = ["ux", "uy", "uz"]

[[support]]
at = "hub"
fix = ["rx", "ry", "rz"]
stages = [1]

[[support]]
at = "weight"
fix = ["uy", "rz"]

[[load]]
at = "weight"
force = [0, 0, "-T"]

[[surface]]
name = "drum"
kind = "cylinder"
from = [0, -1, 0]
to = [0, 1, 0]
radius = "R"
on = "hub"

[[contact]]
name = "wind"
beams = ["cable"]
surfaces = ["drum"]
radius = "r"
friction = 0.2
penetration = 1e-5

[[stage]]
kind = "static"
steps = 2

[[stage]]
kind = "static"
steps = 12

[output]
nodes = ["hub", "weight"]
columns = ["reaction", "contact"]
"#;

/// Each accepted level is in equilibrium, also where the stiffness of contacts grows for the next one.
#[test]
fn levels_with_friction_are_in_equilibrium() {
    let simulation = simulate(WINCH);
    let held = simulation.column("hub.fz");
    let load = simulation.column("load");
    assert!(simulation.counters.contacts.augmentations > 20);
    for (row, (held, load)) in held.iter().zip(load).enumerate() {
        // The second stage follows the start and two levels.
        let wanted = if row < 3 { 50.0 * load } else { 50.0 };
        assert!((held - wanted).abs() < 1e-5, "row {row}, load factor {load}: {held}");
    }
}

/// A rod that is clamped at `root` lies on a drum, which is turned in the second stage.
const RUBBED_ROD: &str = r#"
[point]
root = [-1, 0, 0.25]
tip = [0.5, 0, 0.25]

[section.rod]
EA = 1e5
GA = 1e5
GJ = 50
EI = 10

[[beam]]
name = "rod"
section = "rod"
through = ["root", "tip"]
elements = 6

[[support]]
at = "root"
fix = "all"

[[load]]
at = "tip"
force = [0, 0, -2]

[[surface]]
name = "drum"
kind = "cylinder"
from = [0, -1, 0]
to = [0, 1, 0]
radius = 0.2
rotate = [0, 1, 0]
about = [0, 0, 0]
angle = "ANGLE"
stages = [2]

[[contact]]
name = "rub"
beams = ["rod"]
surfaces = ["drum"]
radius = 0.05
friction = 0.3

[[stage]]
kind = "static"
steps = 2

[[stage]]
kind = "static"
steps = STEPS

[output]
nodes = ["root"]
columns = ["reaction", "contact", "energy"]
"#;

/// A drum that is turned rubs by mu N against its sense and takes mu N times the way of its surface, also
/// where a level has whole turns.
#[test]
fn whole_turns_of_a_surface_in_one_level_slide() {
    for turns in [1.0_f64, -1.0, 1.5, -3.0] {
        for steps in [1, 3] {
            let deck = RUBBED_ROD.replace("ANGLE", &format!("{turns}*2*pi")).replace("STEPS", &steps.to_string());
            let simulation = simulate(&deck);
            let [normal, friction] = ["rub.normal", "rub.friction"].map(|column| simulation.end(column));
            assert!((friction / normal - 0.3).abs() < 1e-9, "{turns} turns, {steps} levels: {friction}, {normal}");
            assert_eq!((simulation.end("rub.fx") - 0.1).signum(), turns.signum(), "{turns} turns, {steps} levels");
            let way = 0.2 * 2.0 * std::f64::consts::PI * turns.abs();
            let part = simulation.end("energy.friction") / (friction * way);
            println!("{turns} turns, {steps} levels: work {part:.4} of mu N times the way");
            assert!((part - 1.0).abs() < 0.04);
        }
    }
    let straight = RUBBED_ROD.replace("ANGLE", "2*pi").replace("steps = STEPS", "steps = 1\nadaptive = false");
    let failure = attempt(&straight).result.unwrap_err();
    assert!(failure.to_string().contains("surface \"drum\" is turned by 6.283 rad"), "{failure}");
}

/// A dynamic stage holds what a static one has pressed on a drum, with springs of any stiffness: the rod
/// rubs by mu N against the sense of the drum, whose torque is mu N times its radius.
#[test]
fn friction_after_a_static_stage_is_that_of_the_true_radius() {
    let deck = r#"
[point]
hub = [0, 0, 0]
start = [-0.4, 0, 0.11]
end = [0.2, 0, 0.11]

[section.rod]
EA = 1e6
GA = 1e6
GJ = 100
EI = 100
rhoA = 0.5
rhoJ = [1e-3, 5e-4, 5e-4]

[[body]]
at = "hub"
mass = 1
inertia = [0.1, 0.1, 0.1]

[[beam]]
name = "rod"
section = "rod"
through = ["start", "end"]
elements = 6

[[support]]
at = "start"
fix = "all"

[[support]]
at = "hub"
fix = ["ux", "uy", "uz"]

[[support]]
at = "hub"
fix = ["rx", "ry", "rz"]
stages = [1]

[[load]]
at = "end"
force = [0, 0, -10]

[[motion]]
at = "hub"
rotate = [0, 1, 0]
angle = 1
history = { name = "spin", stages = [2] }
stages = [2]

[history.spin]
expr = "2*t"

[damping]
mass = 5

[[surface]]
name = "drum"
kind = "cylinder"
from = [0, -1, 0]
to = [0, 1, 0]
radius = 0.1
on = "hub"

[[contact]]
name = "rub"
beams = ["rod"]
surfaces = ["drum"]
radius = 0.01
friction = 0.3
stiffness = STIFFNESS

[[stage]]
kind = "static"
steps = 2

[[stage]]
kind = "dynamic"
end = 1
step = 0.005
scheme = "generalized_alpha"
rho_inf = 0.5

[output]
nodes = ["hub"]
columns = ["reaction", "contact", "energy"]
"#;
    for stiffness in ["60", "200", "1e4", "1e6"] {
        let simulation = simulate(&deck.replace("STIFFNESS", stiffness));
        let [normal, friction, along, torque] =
            ["normal", "friction", "fx", "my"].map(|column| simulation.end(&format!("rub.{column}")));
        println!("{stiffness}: N {normal}, friction {friction}, along {along}, torque {torque}");
        assert!((friction / normal - 0.3).abs() < 1e-9 && along > 0.0, "{stiffness}: {friction}, {normal}");
        assert!((torque / friction - 0.1).abs() < 2e-4, "{stiffness}: {torque}");
    }
}

/// A rod or a ball that meets a thin surface fast either comes back or ends the run, whatever the places of the
/// nodes of the rod.
#[test]
fn beams_and_bodies_pass_through_no_round_surface() {
    let mut random = Random::new(11);
    let shapes = [
        "kind = \"cylinder\"\nfrom = [-1, 0, 0]\nto = [1, 0, 0]\nradius = 0.004",
        "kind = \"capsule\"\nfrom = [-0.1, 0, 0]\nto = [0.1, 0, 0]\nradius = 0.004",
        "kind = \"box\"\nat = [0, 0, 0]\nhalf = [0.15, 0.005, 0.01]",
    ];
    let (mut ended, mut returned) = (0, 0);
    for shape in shapes {
        for case in 0..10 {
            let speed = 10.0_f64.powf(random.range(0.0, 3.5));
            let (tilt, elements) = (random.range(-0.01, 0.01), 5 + (random.range(0.0, 6.0) as usize));
            let [end, step] = [0.4 / speed, 10.0_f64.powf(random.range(-4.3, -2.4)) / speed];
            let rod = format!(
                "[section.s]\nEA = 1e5\nGA = 4e4\nGJ = 1\nEI = 1\nrhoA = 1\nrhoJ = [1e-5, 5e-6, 5e-6]\n\
                 [[beam]]\nname = \"rod\"\nsection = \"s\"\nthrough = [[0.001, -0.3, 0.1], [0.001, 0.31, {}]]\n\
                 elements = {elements}\n[[initial]]\nbeam = \"rod\"\n",
                0.1 + tilt
            );
            let ball =
                "[point]\nball = [0.001, 0, 0.1]\n[[body]]\nat = \"ball\"\nmass = 1\n[[initial]]\nat = \"ball\"\n";
            let (thing, touches, node) = match case {
                0..8 => (rod.as_str(), "beams = [\"rod\"]", format!("rod:{}", elements / 2)),
                _ => (ball, "nodes = [\"ball\"]\nstiffness = 1e8", "ball".into()),
            };
            let deck = format!(
                "{thing}velocity = [0, 0, -{speed}]\n[[surface]]\nname = \"obstacle\"\n{shape}\n\
                 [[contact]]\nname = \"hit\"\n{touches}\nradius = 0.003\nsurfaces = [\"obstacle\"]\n\
                 [[stage]]\nkind = \"dynamic\"\nend = {end}\nstep = {step}\n\
                 [output]\nnodes = [\"{node}\"]\ncolumns = [\"x\", \"v\"]\n"
            );
            let simulation = attempt(&deck);
            match &simulation.result {
                Ok(()) => {
                    let height = simulation.end(&format!("{node}.z"));
                    assert!(height > 0.0, "{shape}, {speed}: {height}\n{deck}");
                    returned += 1;
                }
                Err(failure) => {
                    let kinds = [FailureKind::ContactPassed, FailureKind::NotConverged];
                    assert!(kinds.contains(&failure.kind()), "{failure}\n{deck}");
                    ended += 1;
                }
            }
        }
    }
    println!("{ended} ended, {returned} came back");
    assert!(ended >= 3 && returned >= 3);
}

/// A surface stays where it is when a dynamic stage begins.
#[test]
fn surfaces_that_jump_into_a_dynamic_stage_are_refused() {
    let deck = RUBBED_ROD
        .replace("EI = 10", "EI = 10\nrhoA = 1\nrhoJ = [1e-2, 1e-2, 1e-2]")
        .replace("ANGLE", "2")
        .replace("kind = \"static\"\nsteps = STEPS", "kind = \"dynamic\"\nend = 0.1\nstep = 0.01");
    let why = refusal(&deck);
    assert!(why.contains("stage 2: the motion of surface \"drum\" must start at 0"), "{why}");
    assert!(why.contains("give it a `history` that starts at the current value"), "{why}");
    let first = deck.replace("stages = [2]", "").replace("[[stage]]\nkind = \"static\"\nsteps = 2\n", "");
    assert!(refusal(&first).contains("stage 1: the motion of surface"), "{}", refusal(&first));
}

/// A level that fails for one stiffness of its contacts is cut back with the stiffness that it began with: wires of
/// any number of elements come through the first curve.
#[test]
fn coarse_guidewires_come_through_the_first_curve() {
    let deck = std::fs::read_to_string("decks/contact/scenes/guidewire.toml").unwrap();
    let pushed = |elements: usize| {
        let settings = [format!("beam.0.elements={elements}"), "motion.0.ux=50".into(), "stage.0.steps=50".into()];
        simulate(&beamsim::deck::apply(&deck, &settings).unwrap())
    };
    // With 500 elements
    let (force, height) = (0.01027, 9.0971);
    for elements in [60, 100] {
        let simulation = pushed(elements);
        let errors = [simulation.end("tail.fx") / force - 1.0, simulation.end("tip.uy") / height - 1.0];
        assert!(errors[0].abs() < 0.03 && errors[1].abs() < 1e-3, "{elements} elements: {errors:?}");
    }
}

/// A contact that ends with its stage has no forces in the next one.
#[test]
fn a_contact_that_has_ended_has_no_forces() {
    let text = under_cylinder(20, 1, 4, "stages = [1]\n") + "[[stage]]\nkind = \"static\"\nsteps = 2\n";
    let simulation = simulate(&text);
    let forces = simulation.column("push.normal");
    assert!(forces[4] > 1.0, "{forces:?}");
    let (points, last) = (simulation.column("push.points"), forces.len() - 1);
    assert_eq!((forces[last], points[last]), (0.0, 0.0));
}

/// A ball that springs hold is pushed against a box beside the middle of a face, in levels that are longer than the
/// box is thick: no level comes out on another side.
#[test]
fn a_ball_does_not_go_through_the_edge_of_a_box() {
    for place in [[0.0, 0.0], [0.0, 0.3], [0.1, 0.1], [0.2, 0.1], [0.45, 0.0]] {
        let [y, z] = place;
        let text = format!(
            r#"
[point]
ball = [0.65, {y}, {z}]
centre = [0, 0, 0]
[[body]]
at = "ball"
mass = 1
inertia = [0.01, 0.01, 0.01]
[[spring]]
at = "ball"
stiffness = [1, 1, 1, 1, 1, 1]
[[load]]
at = "ball"
force = [-3, 0, 0]
[[surface]]
name = "box"
kind = "box"
at = "centre"
half = [0.5, 0.5, 0.5]
[[contact]]
name = "c"
nodes = ["ball"]
surfaces = ["box"]
radius = 0.1
stiffness = 100
[[stage]]
kind = "static"
steps = 4
[output]
nodes = ["ball"]
columns = ["u", "contact"]
"#
        );
        let simulation = simulate(&text);
        let [moved, force] = ["ball.ux", "c.normal"].map(|column| simulation.end(column));
        assert!((moved + 0.05).abs() < 1e-3 && (force - 2.95).abs() < 1e-2, "{place:?}: {moved} {force}");
    }
}

/// A round obstacle, and the keys of a contact with it.
struct Obstacle {
    tables: &'static str,
    keys: &'static str,
}

const OBSTACLES: [Obstacle; 3] = [
    Obstacle {
        tables: "[[surface]]\nname = 'o'\nkind = 'cylinder'\nfrom = [0, -1, 0]\nto = [0, 1, 0]\nradius = 0.5",
        keys: "surfaces = ['o']\nradius = 0.05",
    },
    Obstacle {
        tables: "[[surface]]\nname = 'o'\nkind = 'sphere'\nat = [0, 0, 0]\nradius = 0.5",
        keys: "surfaces = ['o']\nradius = 0.05",
    },
    Obstacle {
        tables: "[section.bar]\nEA = 1e8\nGA = 4e7\nGJ = 1e6\nEI = 1e6\n[[beam]]\nname = 'bar'\nsection = 'bar'\n\
                 through = ['near', 'far']\nelements = 3\n[[support]]\nat = 'near'\nfix = 'all'\n[[support]]\nat = 'far'\n\
                 fix = 'all'",
        keys: "with = ['bar']\nradius = { w = 0.05, bar = 0.5 }",
    },
];

/// A beam "w" from a to b in a contact "c", in two static stages. `tables`: supports, motions, loads and surfaces.
struct BeamInContact {
    points: String,
    section: String,
    elements: usize,
    order: usize,
    tables: String,
    contact: String,
    steps: [usize; 2],
}

impl BeamInContact {
    fn deck(&self) -> String {
        let Self { points, section, elements, order, tables, contact, steps: [first, second] } = self;
        format!(
            r#"
[point]
{points}
[section.s]
{section}
[[beam]]
name = "w"
section = "s"
through = ["a", "b"]
elements = {elements}
order = {order}
{tables}
[[contact]]
name = "c"
beams = ["w"]
{contact}
[[stage]]
kind = "static"
steps = {first}
[[stage]]
kind = "static"
steps = {second}
[output]
nodes = ["a"]
columns = ["reaction", "contact", "energy"]
"#
        )
    }
}

/// A beam that is bent over an obstacle by its ends and then dragged along itself.
fn dragged(elements: usize, order: usize, obstacle: &Obstacle, shift: f64, friction: f64) -> String {
    let Obstacle { tables, keys } = obstacle;
    let held = r#"
[[support]]
at = "a"
fix = ["uy", "rx", "rz"]
[[support]]
at = "b"
fix = ["uy"]
[[support]]
at = "a"
fix = ["ux"]
stages = [1]
[[motion]]
at = "a"
uz = -0.3
[[motion]]
at = "b"
uz = -0.3
[[motion]]
at = "a"
ux = 0.3
stages = [2]
"#;
    let points = format!(
        "a = [\"-1.5 + {shift}\", 0, 0.5501]\nb = [\"1.5 + {shift}\", 0, 0.5501]\nnear = [0, -0.6, 0]\nfar = [0, 0.6, 0]"
    );
    BeamInContact {
        points,
        section: "EA = 1e5\nGA = 4e4\nGJ = 10\nEI = 10".into(),
        elements,
        order,
        tables: format!("{held}{tables}"),
        contact: format!("{keys}\nfriction = {friction}"),
        steps: [6, 60],
    }
    .deck()
}

/// A beam that slides keeps the friction mu N where its contact passes to the next element, and where points come
/// and go.
#[test]
fn sliding_goes_on_from_element_to_element() {
    let mut random = Random::new(31);
    for case in 0..27 {
        let order = 1 + case % 3;
        let elements = 8 + (random.range(0.0, 25.0) as usize) / order;
        let (number, shift, friction) = (case / 3 % 3, random.range(0.0, 0.3), random.range(0.1, 0.6));
        let simulation = simulate(&dragged(elements, order, &OBSTACLES[number], shift, friction));
        let [normal, force] = ["c.normal", "c.friction"].map(|name| simulation.column(name));
        let parts = normal.iter().zip(&force).skip(7).map(|(normal, force)| force / (friction * normal));
        let since_it_slides: Vec<f64> = parts.skip_while(|&part| part < 0.999).collect();
        assert!(since_it_slides.len() > 20, "case {case}: it does not slide");
        let least = since_it_slides.into_iter().fold(f64::INFINITY, f64::min);
        assert!(least > 0.999, "case {case}: {elements} elements of order {order}, obstacle {number}: {least}");
    }
}

/// The places of a weight on a beam.
#[derive(Clone, Copy)]
enum Load {
    Ends,
    All,
}

/// A beam on a plane, pressed by `weight`, whose end is dragged along it by `way`.
struct DraggedOnPlane {
    elements: usize,
    order: usize,
    bending: f64,
    weight: f64,
    load: Load,
    friction: f64,
    stick: f64,
    radius: f64,
    end: &'static str,
    way: f64,
    steps: usize,
}

impl DraggedOnPlane {
    fn deck(&self) -> String {
        let Self { elements, order, bending, weight, friction, stick, radius, end, way, steps, .. } = *self;
        let loads = match self.load {
            Load::Ends => {
                ["a", "b"].map(|at| format!("[[load]]\nat = \"{at}\"\nforce = [0, 0, {}]\n", -weight / 2.0)).concat()
            }
            Load::All => format!("[[load]]\nalong = \"w\"\nforce = [0, 0, {}]\n", -weight),
        };
        let tables = format!(
            r#"
[[support]]
at = "{end}"
fix = ["uy", "rx", "rz"]
[[support]]
at = "{end}"
fix = ["ux"]
stages = [1]
[[motion]]
at = "{end}"
ux = {way}
stages = [2]
{loads}
[[surface]]
name = "g"
kind = "plane"
point = [0, 0, 0]
normal = [0, 0, 1]
"#
        );
        let axial = 1e4 * bending;
        BeamInContact {
            points: format!("a = [0, 0, {radius}]\nb = [1, 0, {radius}]"),
            section: format!("EA = {axial}\nGA = {axial}\nGJ = {bending}\nEI = {bending}"),
            elements,
            order,
            tables,
            contact: format!("surfaces = [\"g\"]\nradius = {radius}\nfriction = {friction}\nstick = {stick}"),
            steps: [4, steps],
        }
        .deck()
    }
}

/// Friction on a beam that is dragged is mu N against the motion, whatever the load, the stiffness of the beam, the
/// mesh, the levels and `stick`; and what the motion gives is what friction takes and the beam stores.
#[test]
fn beams_dragged_over_a_plane_feel_all_friction() {
    let mut random = Random::new(77);
    for case in 0..36 {
        let power = |random: &mut Random, from: f64, to: f64| 10f64.powf(random.range(from, to));
        let weight = power(&mut random, 0.5, 3.0);
        let way = power(&mut random, -2.0, -0.7);
        let scene = DraggedOnPlane {
            elements: 2 + random.range(0.0, 11.0) as usize,
            order: 1 + case % 3,
            bending: weight * power(&mut random, -1.0, 2.0),
            weight,
            load: [Load::Ends, Load::All][case / 3 % 2],
            friction: random.range(0.1, 0.7),
            stick: [1.0, 1e-2, 1e2, 1e4][case % 4],
            radius: power(&mut random, -2.5, -1.5),
            end: ["a", "b"][case / 2 % 2],
            way: if case % 5 < 3 { way } else { -way },
            steps: [1, 3, 30][case / 9 % 3],
        };
        let simulation = simulate(&scene.deck());
        let force = -simulation.end("c.fx") * scene.way.signum() / (scene.friction * scene.weight);
        assert!((force - 1.0).abs() < 1e-3, "case {case}: {force} of mu N");
        let [total, taken] = ["energy.total", "energy.friction"].map(|name| simulation.end(name));
        assert!(total.abs() < 0.1 * taken, "case {case}: {total} of {taken}");
    }
}

/// A beam that only its weight holds on a plane loses almost all of that weight, in any number of levels.
#[test]
fn beams_held_by_their_weight_are_unloaded() {
    let mut random = Random::new(78);
    for case in 0..24 {
        let power = |random: &mut Random, from: f64, to: f64| 10f64.powf(random.range(from, to));
        let weight = power(&mut random, 0.5, 3.0);
        let rest = [0.01, 0.1, 0.9][case % 3];
        let scene = DraggedOnPlane {
            elements: 1 + random.range(0.0, 8.0) as usize,
            order: 1 + case / 3 % 3,
            bending: weight * power(&mut random, -1.0, 2.0),
            weight,
            load: Load::All,
            friction: [0.0, 0.3][case % 2],
            stick: 1.0,
            radius: power(&mut random, -2.5, -1.5),
            end: "a",
            way: 0.0,
            steps: [1, 2, 5][case / 2 % 3],
        };
        let load = format!("force = [0, 0, {}]\n", -weight);
        let less =
            format!("{load}stages = [1]\n[[load]]\nalong = \"w\"\nforce = [0, 0, {}]\nstages = [2]\n", -weight * rest);
        let normal = simulate(&scene.deck().replace(&load, &less)).end("c.normal");
        assert!((normal / (rest * weight) - 1.0).abs() < 1e-3, "case {case}: {normal} for {}", rest * weight);
    }
}

/// Where steps may not be halved, one that stands a beam upright is told.
#[test]
fn a_step_that_takes_more_energy_than_there_is_is_told() {
    let scene = DraggedOnPlane {
        elements: 11,
        order: 2,
        bending: 4718.373085474429,
        weight: 81.98345764208582,
        load: Load::All,
        friction: 0.41527096348948056,
        stick: 100.0,
        radius: 0.01660902720347138,
        end: "b",
        way: 0.0693630228166199,
        steps: 3,
    };
    let told =
        |deck: &str| simulate(deck).counters.findings.warnings.iter().any(|w| w.kind == WarningKind::FrictionJump);
    let deck = scene.deck();
    assert!(!told(&deck));
    assert!(told(&deck.replace("kind = \"static\"", "kind = \"static\"\nadaptive = false")));
}

/// What sticks to a surface follows it, however stiff the contact is: a ball that does not turn, held by a spring, on a
/// floor that moves aside. It slides where the spring takes more than friction gives.
#[test]
fn floors_that_move_carry_what_sticks_to_them() {
    let mut random = Random::new(71);
    for case in 0..40 {
        let radius = 10f64.powf(random.range(-3.0, 1.0));
        let mass = 10f64.powf(random.range(-2.0, 2.0));
        let weight = 9.81 * mass;
        let stiffness = 10f64.powf(random.range(3.0, 6.0)) * weight / radius;
        let friction = random.range(0.1, 1.0);
        let spring = weight / radius * 10f64.powf(random.range(-1.0, 1.0));
        let way = radius * random.range(0.05, 0.8);
        let steps = [1, 3, 10][case % 3];
        let text = format!(
            "gravity = [0, 0, -9.81]\n[point]\nc = [0, 0, {radius}]\n[[body]]\nat = \"c\"\nmass = {mass}\n\
             [[support]]\nat = \"c\"\nfix = [\"uy\", \"rx\", \"ry\", \"rz\"]\n\
             [[spring]]\nat = \"c\"\nstiffness = [{spring}, 0, 0, 0, 0, 0]\n\
             [[surface]]\nname = \"floor\"\nkind = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n\
             move = [{way}, 0, 0]\nstages = [2]\n\
             [[contact]]\nname = \"k\"\nnodes = [\"c\"]\nsurfaces = [\"floor\"]\nradius = {radius}\n\
             friction = {friction}\nstiffness = {stiffness}\n[[stage]]\nkind = \"static\"\nsteps = 1\n\
             [[stage]]\nkind = \"static\"\nsteps = {steps}\n[output]\ncolumns = [\"u\"]\n"
        );
        let simulation = simulate(&text);
        let exact = way.min(friction * weight / spring);
        let off = (simulation.end("c.ux") - exact).abs();
        // Elastic stick gives way by the force over its stiffness, which is at least that of the contact.
        let given = friction * weight / stiffness;
        assert!(off <= 1e-6 * exact + given, "{case}: {} for {exact}\n{text}", simulation.end("c.ux"));
        assert_eq!(simulation.counters.cutbacks, 0, "{case}\n{text}");
    }
}

/// Points on the centre line have no way out of their own, wherever along the tube they are.
#[test]
fn wires_on_the_axis_of_straight_tubes_touch_nothing() {
    let mut random = Random::new(72);
    for case in 0..60 {
        let (along, middle) = (random.direction(), random.cube(3.0));
        let (half, radius) = (random.range(0.2, 3.0), random.range(0.02, 0.1));
        let count = 2 + case % 3;
        let point = |k: usize| list(middle + along * (half * (2.0 * k as f64 / (count - 1) as f64 - 1.0)));
        let through: Vec<String> = (0..count).map(point).collect();
        let end = middle + along * (half * 0.7);
        let text = format!(
            "[point]\nA = {}\nB = {}\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1\nEI = 1\n\
             [[beam]]\nname = \"w\"\nsection = \"s\"\nthrough = [\"A\", \"B\"]\nelements = 4\n\
             [[support]]\nat = \"A\"\nfix = \"all\"\n[[load]]\nat = \"B\"\nforce = {}\n\
             [[surface]]\nname = \"v\"\nkind = \"tube\"\nthrough = [{}]\nradius = {radius}\nside = \"inside\"\n\
             [[contact]]\nname = \"k\"\nbeams = [\"w\"]\nsurfaces = [\"v\"]\nradius = {}\n\
             [[stage]]\nkind = \"static\"\nsteps = 2\n[output]\nnodes = [\"B\"]\ncolumns = [\"u\", \"contact\"]\n",
            list(middle),
            list(end),
            list(along),
            through.join(", "),
            0.2 * radius
        );
        let simulation = simulate(&text);
        let moved = Vec3(simulation.vector("B.u"));
        let exact = along * (0.7 * half / 1e4);
        assert!((moved - exact).norm() < 1e-9 * half, "{case}: {moved:?}\n{text}");
        let gap = simulation.end("k.gap");
        assert!((gap - 0.8 * radius).abs() < 1e-6 * radius, "{case}: {gap}\n{text}");
    }
}

/// What touches at the start of a run has its forces in the first row, whatever the scheme, and has lasted no step.
#[test]
fn a_run_begins_with_the_forces_of_what_touches() {
    for scheme in ["lobatto", "generalized_alpha", "lie_generalized_alpha", "hht", "newmark"] {
        let run = simulate(&format!(
            "gravity = [0, 0, -10]\n[point]\nb = [0, 0, \"0.1 - 1e-4\"]\n[[body]]\nat = \"b\"\nmass = 1\n\
             [[initial]]\nat = \"b\"\nvelocity = [0, 0, 2]\n\
             [[surface]]\nname = \"s\"\nkind = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n\
             [[contact]]\nname = \"c\"\nnodes = [\"b\"]\nsurfaces = [\"s\"]\nradius = 0.1\nstiffness = 1e5\nfriction = 0.05\n\
             penetration = 1e-3\n[[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 1e-3\nscheme = \"{scheme}\"\n\
             [output]\ncolumns = [\"u\", \"contact\", \"energy\"]\n"
        ));
        let [force, points] = ["c.normal", "c.points"].map(|column| run.column(column)[0]);
        assert!((force - 10.0).abs() < 1e-9 && points == 1.0, "{scheme}: {force}, {points}");
        assert!(run.counters.findings.warnings.is_empty(), "{scheme}: {:?}", run.counters.findings.warnings);
        assert!((run.end("b.uz") - (2.0 * 0.1 - 5.0 * 0.01)).abs() < 2e-3, "{scheme}: {}", run.end("b.uz"));
    }
}

/// Beams that touch at the start have forces in the first row: as deep as they are.
#[test]
fn a_run_begins_with_the_forces_of_beams_that_touch() {
    let run = simulate(
        "[point]\na = [-1, 0, 0]\nb = [1, 0, 0]\nc = [0, -1, 0.199]\nd = [0, 1, 0.199]\n\
         [section.s]\nEA = 1e7\nGA = 1e7\nGJ = 1e5\nEI = 1e5\nrhoA = 10\nrhoJ = [0.2, 0.1, 0.1]\n\
         [[beam]]\nname = \"lower\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 3\n\
         [[beam]]\nname = \"upper\"\nsection = \"s\"\nthrough = [\"c\", \"d\"]\nelements = 3\n\
         [[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"b\"\nfix = \"all\"\n\
         [[initial]]\nbeam = \"upper\"\nvelocity = [0, 4, 0]\n\
         [[contact]]\nname = \"hit\"\nbeams = [\"upper\"]\nwith = [\"lower\"]\nradius = 0.1\nfriction = 0.2\nstiffness = 1e5\n\
         penetration = 0.01\n[[stage]]\nkind = \"dynamic\"\nend = 1e-3\nstep = 1e-4\nscheme = \"generalized_alpha\"\n\
         [output]\ncolumns = [\"contact\", \"energy\"]\n",
    );
    for (column, value) in [("hit.normal", 100.0), ("hit.fz", 100.0), ("hit.points", 1.0)] {
        let found = run.column(column)[0];
        assert!((found - value).abs() < 1e-6 * value.abs(), "{column}: {found} for {value}");
    }
}

/// The end of a beam without caps does not touch what lies before it.
#[test]
fn ends_without_caps_hide_no_penetration() {
    let run = simulate(
        "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e5\nGA = 1e5\nGJ = 10\nEI = 10\n\
         [[beam]]\nname = \"w\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\n[[support]]\nat = \"a\"\nfix = \"all\"\n\
         [[surface]]\nname = \"f\"\nkind = \"plane\"\npoint = [1.021, 0, 0]\nnormal = [-1, 0, 0]\n\
         [[contact]]\nname = \"c\"\nbeams = [\"w\"]\nsurfaces = [\"f\"]\nradius = 0.02\nends = \"none\"\n\
         [[load]]\nat = \"b\"\nforce = [500, 0, 0]\n[[stage]]\nkind = \"static\"\nsteps = 2\n[output]\ncolumns = [\"u\", \"contact\"]\n",
    );
    assert!((run.end("b.ux") - 5e-3).abs() < 1e-6 && run.end("c.normal") == 0.0);
    assert!(run.end("c.gap") > 0.2, "{}", run.end("c.gap"));
    assert!(run.counters.findings.warnings.is_empty(), "{:?}", run.counters.findings.warnings);
}

/// In two tables a pair would push twice, unless they act in different stages. A beam and a surface may share a name.
#[test]
fn pairs_in_two_contacts_are_refused() {
    let contact = |name: &str, keys: &str| format!("[[contact]]\nname = \"{name}\"\nradius = 0.1\n{keys}\n");
    let deck = |first: &str, second: &str| {
        format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [0, 0, 1]\nd = [1, 0, 1]\n[section.s]\nEA = 1\nGA = 1\nGJ = 1\nEI = 1\n\
             [[beam]]\nname = \"v\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 2\n\
             [[beam]]\nname = \"w\"\nsection = \"s\"\nthrough = [\"c\", \"d\"]\nelements = 2\n\
             [[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"c\"\nfix = \"all\"\n\
             [[surface]]\nname = \"w\"\nkind = \"plane\"\npoint = [0, 0, -9]\nnormal = [0, 0, 1]\n{}{}\
             [[stage]]\nkind = \"static\"\nsteps = 1\n[[stage]]\nkind = \"static\"\nsteps = 1\n",
            contact("one", first),
            contact("two", second)
        )
    };
    let [on_surface, on_beam] = ["beams = [\"v\"]\nsurfaces = [\"w\"]", "beams = [\"v\"]\nwith = [\"w\"]"];
    let turned = "beams = [\"w\"]\nwith = [\"v\"]";
    let itself = "beams = [\"v\"]\nself = true";
    for (first, second) in [(on_surface, on_surface), (on_beam, turned), (itself, itself)] {
        let found = refusal(&deck(first, second));
        assert!(found.contains("is in two [[contact]] tables"), "{first}, {second}: {found}");
        let apart = deck(&format!("{first}\nstages = [1]"), &format!("{second}\nstages = [2]"));
        assert!(attempt(&apart).result.is_ok(), "{apart}");
    }
    for second in [on_beam, itself] {
        assert!(attempt(&deck(on_surface, second)).result.is_ok());
    }
}

/// A beam whose root comes down beside the middle of a ball, on whose flank it sticks.
fn comes_down_on_a_ball(place: f64, steps: usize) -> String {
    format!(
        r#"
[point]
root = [0, 0, 0]
tip = [1, 0, 0]
[section.s]
EA = 1e5
GA = 4e4
GJ = 20
EI = 10
[[beam]]
name = "b"
section = "s"
through = ["root", "tip"]
elements = 20
[[support]]
at = "root"
fix = ["ux", "uy", "rx", "ry", "rz"]
[[motion]]
at = "root"
uz = -0.3
[[surface]]
name = "ball"
kind = "sphere"
at = [{place}, 0.12, -0.4]
radius = 0.2
[[contact]]
name = "c"
beams = ["b"]
surfaces = ["ball"]
radius = 0.01
friction = 1
[[stage]]
kind = "static"
steps = {steps}
[output]
nodes = ["tip"]
columns = ["u", "contact"]
"#
    )
}

/// What a beam moved before it touched is no sliding. Counted as such, one level gave a force across of 0.873 for
/// -0.061 at 0.95, and of 4.1 for -0.89 at 0.5.
#[test]
fn a_way_before_the_touch_is_no_sliding() {
    for place in [0.5, 0.95] {
        let across = |steps| {
            let simulation = simulate(&comes_down_on_a_ball(place, steps));
            [simulation.end("c.fy"), simulation.end("c.normal")]
        };
        let [fine, normal] = across(100);
        for steps in [1, 2, 5] {
            let [coarse, _] = across(steps);
            assert!((coarse - fine).abs() < 0.03 * normal, "{place}, {steps} levels: {coarse} for {fine}");
        }
    }
}

/// A box that a level lifts through the middle of an element: between nodes that it does not touch.
fn box_under_an_element(place: f64, half: f64, order: usize, steps: usize, height: f64) -> String {
    format!(
        r#"
[point]
root = [0, 0, 0]
tip = [1, 0, 0]
[section.s]
EA = 1e5
GA = 4e4
GJ = 20
EI = 10
[[beam]]
name = "b"
section = "s"
through = ["root", "tip"]
elements = 6
order = {order}
[[support]]
at = "root"
fix = "all"
[[surface]]
name = "box"
kind = "box"
at = [{place}, 0, {height}]
half = [{half}, {half}, {half}]
move = [0, 0, 0.08]
[[contact]]
name = "c"
beams = ["b"]
surfaces = ["box"]
radius = 0.005
[[stage]]
kind = "static"
steps = {steps}
[output]
nodes = ["tip"]
columns = ["u", "contact"]
"#
    )
}

/// Levels of more than a radius carried the box through, with no force at all.
#[test]
fn boxes_between_nodes_are_not_passed() {
    let mut random = Random::new(31);
    let mut finished = [0; 4];
    for order in 1..=3 {
        for _ in 0..6 {
            let (place, half) = (random.range(0.3, 0.9), random.range(0.015, 0.05));
            let text = |steps| box_under_an_element(place, half, order, steps, -half - 0.01);
            for steps in [1, 3, 8] {
                let simulation = attempt(&text(steps));
                if let Err(failure) = &simulation.result {
                    let is_named = [FailureKind::ContactPassed, FailureKind::NotConverged].contains(&failure.kind());
                    assert!(order == 3 && is_named, "{failure:?}\n{}", text(steps));
                    continue;
                }
                finished[order] += 1;
                let gap = simulation.end("c.gap");
                assert!(gap.abs() < 1e-4 && simulation.end("c.normal") > 0.0, "{gap}\n{}", text(steps));
            }
        }
    }
    assert!(finished[3] > 6, "{finished:?}");
    let inside = attempt(&box_under_an_element(0.55, 0.03, 1, 4, 0.0)).result.unwrap_err();
    assert_eq!(inside.kind(), FailureKind::ContactStart, "{inside:?}");
}

/// A beam that is drawn over a drum by more than its elements in each level has touched all the time: its levels are not
/// cut for it.
#[test]
fn a_contact_that_slides_on_has_not_touched_late() {
    let text = |elements: usize| {
        format!(
            r#"
[point]
a = [-1.5, 0.1, 0.5501]
b = [1.5, 0.1, 0.5501]
[section.s]
EA = 1e5
GA = 4e4
GJ = 10
EI = 10
[[beam]]
name = "w"
section = "s"
through = ["a", "b"]
elements = {elements}
[[support]]
at = "a"
fix = ["uy", "rx"]
[[support]]
at = "b"
fix = ["uy"]
[[support]]
at = "a"
fix = ["ux"]
stages = [1]
[[motion]]
at = "a"
uz = -0.3
[[motion]]
at = "b"
uz = -0.3
[[motion]]
at = "a"
ux = 0.4
stages = [2]
[[surface]]
name = "m"
kind = "cylinder"
from = [0, -1, 0]
to = [0, 1, 0]
radius = 0.5
[[contact]]
name = "c"
beams = ["w"]
surfaces = ["m"]
radius = 0.05
friction = 0.3
[[stage]]
kind = "static"
steps = 6
[[stage]]
kind = "static"
steps = 3
[output]
nodes = ["a"]
columns = ["reaction", "contact"]
"#
        )
    };
    for elements in [60, 200] {
        let simulation = simulate(&text(elements));
        // The first touch takes five of them.
        let cutbacks = simulation.counters.cutbacks;
        assert!(cutbacks <= 8, "{elements} elements: {cutbacks} cut-backs");
    }
}

/// The reason of contacts names the pairs that pass through each other: none where all are named, the first of many, bodies
/// with each other, and not a body with the surface that it carries.
#[test]
fn pairs_without_a_contact_are_named() {
    let reason = |beams: usize, contacts: &str| {
        let beam = |k: usize| {
            format!("[[beam]]\nname = \"b{k}\"\nsection = \"s\"\nthrough = [[0, {k}, 0], [1, {k}, 0]]\nelements = 2\n")
        };
        let text = format!(
            "[point]\np = [0, 0, 5]\nq = [0, 0, 7]\n[section.s]\nEA = 1\nGA = 1\nGJ = 1\nEI = 1\n{}[[body]]\nat = \"p\"\nmass = 1\n\
             [[body]]\nat = \"q\"\nmass = 1\n[[surface]]\nname = \"floor\"\nkind = \"plane\"\npoint = [0, 0, -1]\nnormal = [0, 0, 1]\n\
             [[surface]]\nname = \"ball\"\nkind = \"sphere\"\nat = [0, 0, 5]\nradius = 0.1\non = \"p\"\n{contacts}\
             [[stage]]\nkind = \"static\"\nsteps = 1\n",
            (0..beams).map(beam).collect::<String>()
        );
        let (scene, _) = beamsim::scene::from_text(&text).unwrap_or_else(|errors| panic!("{errors:?}\n{text}"));
        scene.reasons.into_iter().find(|reason| reason.name == "contact").unwrap().reason
    };
    let contact =
        |name: &str, rest: &str| format!("[[contact]]\nname = \"{name}\"\nradius = 0.01\nstiffness = 1\n{rest}\n");
    let all = reason(1, &contact("c", "beams = [\"b0\"]\nsurfaces = [\"floor\"]\nself = true"));
    assert!(!all.contains("names both"), "{all}");
    let two = reason(2, &contact("c", "beams = [\"b0\"]\nwith = [\"b1\"]"));
    assert!(two.contains("no contact, as no [[contact]] names both: b0 and itself, b1 and itself"), "{two}");
    let four = reason(4, &contact("c", "beams = [\"b0\", \"b1\", \"b2\", \"b3\"]\nsurfaces = [\"floor\"]"));
    assert!(four.contains("b1 and itself, b1 and b2, 4 more pairs"), "{four}");
    let bodies = [
        contact("c", "nodes = [\"p\", \"q\"]\nsurfaces = [\"floor\"]"),
        contact("d", "nodes = [\"q\"]\nsurfaces = [\"ball\"]"),
    ];
    let bodies = reason(1, &bodies.concat());
    let said = bodies.split("names both: ").nth(1).unwrap();
    assert!(said.starts_with("bodies and each other"), "{bodies}");
}

/// A rope that slides over a drum everywhere is held together by nothing that is soft.
#[test]
fn springs_of_points_that_slide_hold_nothing() {
    let run = simulate(
        "[point]\nslack = [1.0032, -0.5, 0]\non = [1.0032, 0, 0]\noff = [-1.0032, 0, 0]\npulled = [-1.0032, -0.5, 0]\n\
         [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1e-5\nEI = 1e-5\n\
         [[beam]]\nname = \"left\"\nsection = \"s\"\nthrough = [\"slack\", \"on\"]\nelements = 4\n\
         [[beam]]\nname = \"top\"\nsection = \"s\"\narc = [\"on\", [0, 1.0032, 0], \"off\"]\nelements = 24\n\
         [[beam]]\nname = \"right\"\nsection = \"s\"\nthrough = [\"off\", \"pulled\"]\nelements = 4\n\
         [[load]]\nat = \"slack\"\nforce = [0, -1, 0]\n[[support]]\nat = \"pulled\"\nfix = \"pin\"\nstages = [1]\n\
         [[support]]\nat = \"pulled\"\nfix = [\"ux\", \"uz\"]\nstages = [2]\n[[motion]]\nat = \"pulled\"\nuy = -0.02\nstages = [2]\n\
         [[surface]]\nname = \"drum\"\nkind = \"cylinder\"\nfrom = [0, 0, -1]\nto = [0, 0, 1]\nradius = 1\n\
         [[contact]]\nname = \"rope\"\nbeams = [\"left\", \"top\", \"right\"]\nsurfaces = [\"drum\"]\nradius = 0.001\n\
         friction = 0.2\npenetration = 1e-6\n[[stage]]\nkind = \"static\"\nsteps = 4\n[[stage]]\nkind = \"static\"\nsteps = 10\n\
         [output]\nnodes = [\"pulled\"]\ncolumns = [\"reaction\", \"contact\"]\n",
    );
    let [points, sliding] = ["rope.points", "rope.sliding"].map(|column| run.end(column));
    assert!(points > 20.0 && sliding == points, "{sliding} of {points} slide");
    let pull = run.end("pulled.fy").abs() / (0.2 * std::f64::consts::PI).exp();
    assert!((pull - 1.0).abs() < 0.02, "{pull}");
    let soft = run.counters.findings.warnings.iter().find(|warning| warning.kind == WarningKind::SoftStick);
    assert!(soft.is_none(), "{soft:?}");
}

/// A ladder stands with any number of levels where its angle exceeds the least one.
#[test]
fn friction_holds_a_ladder_with_any_number_of_levels() {
    let random = &mut Random::new(98);
    for _ in 0..25 {
        let mu = random.range(0.25, 0.9);
        let angle = random.range(least_angle_of_ladder(mu) + 0.05, 1.5);
        let ladder = Ladder::new(random, angle, mu);
        let run = simulate(&ladder.deck);
        let moved = ladder.moves(&run);
        let normal = run.end("below.normal") / ladder.weight;
        assert!(
            moved.iter().all(|&moved| moved < 5e-3) && (0.99 / (1.0 + mu * mu)..1.01).contains(&normal),
            "{moved:?} {normal}\n{}",
            ladder.deck
        );
    }
}

#[test]
fn a_ladder_that_slides_away_is_told() {
    let random = &mut Random::new(99);
    let mut jumps = 0;
    for _ in 0..25 {
        let mu = random.range(0.1, 0.6);
        let angle = random.range(0.3, least_angle_of_ladder(mu) - 0.05);
        let ladder = Ladder::new(random, angle, mu);
        let run = attempt(&ladder.deck);
        let warned = |kind| run.counters.findings.warnings.iter().any(|warning| warning.kind == kind);
        let is_told = warned(WarningKind::FrictionJump) || warned(WarningKind::CameToRest);
        assert!(
            run.result.is_err() || is_told,
            "{:?} {:?}\n{}",
            run.counters.findings.warnings,
            ladder.moves(&run),
            ladder.deck
        );
        jumps += usize::from(warned(WarningKind::FrictionJump));
    }
    assert!(jumps >= 3, "{jumps}");
}

/// A ball that a force pushes into a narrowing hole, against a spring, fills it where its radius is that of the
/// hole; there the force is that of a ring, N sin(half angle) of the cone. It may begin on the axis or beside it.
#[test]
fn what_fills_a_funnel_stops_in_it() {
    let random = &mut Random::new(61);
    for k in 0..24 {
        let unit = 10.0_f64.powf(random.range(-3.0, 3.0));
        let [along, aside] = random.axes();
        let (wide, narrow) = (0.5, 0.2);
        let tilt = wide - narrow;
        let radius = random.range(0.25, 0.36);
        let (offset, steps) = ([0.0, 1e-12, 1e-7, 1e-3, 0.03][k % 5], [1, 7, 40][k % 3]);
        let force = random.range(11.0, 13.5);
        let place = |distance: f64, beside: f64| {
            let at = (along * distance + aside * beside) * unit;
            format!("[{:e}, {:e}, {:e}]", at.0[0], at.0[1], at.0[2])
        };
        let surface = if k % 2 == 0 {
            let [from, to] = [place(0.0, 0.0), place(1.0, 0.0)];
            format!("kind = \"cone\"\nfrom = {from}\nto = {to}\nside = \"inside\"\nradius = ")
        } else {
            format!(
                "kind = \"tube\"\nthrough = [{}, {}]\nside = \"inside\"\nradius = ",
                place(0.0, 0.0),
                place(1.0, 0.0)
            )
        };
        let soft = 20.0 / unit;
        let deck = format!(
            "[point]\nball = {start}\n[[body]]\nat = \"ball\"\nmass = 1\ninertia = [{inertia:e}, {inertia:e}, {inertia:e}]\n\
             [[spring]]\nat = \"ball\"\nstiffness = [{soft:e}, {soft:e}, {soft:e}, {turn:e}, {turn:e}, {turn:e}]\n\
             [[load]]\nat = \"ball\"\nforce = {push}\n[[surface]]\nname = \"hole\"\n{surface}[{wide:e}, {narrow:e}]\n\
             [[contact]]\nname = \"c\"\nnodes = [\"ball\"]\nsurfaces = [\"hole\"]\nradius = {radius:e}\nstiffness = {stiffness:e}\n\
             [[stage]]\nkind = \"static\"\nsteps = {steps}\n[output]\nnodes = [\"ball\"]\ncolumns = [\"x\", \"contact\"]\n",
            start = place(0.3, offset),
            inertia = 0.01 * unit * unit,
            turn = unit,
            push = {
                let push = along * force;
                format!("[{:e}, {:e}, {:e}]", push.0[0], push.0[1], push.0[2])
            },
            wide = wide * unit,
            narrow = narrow * unit,
            radius = radius * unit,
            stiffness = 1e4 / unit,
        );
        let run = simulate(&deck);
        let at = Vec3(["x", "y", "z"].map(|axis| run.end(&format!("ball.{axis}")))) * (1.0 / unit);
        let reached = at.dot(along);
        let fills = (wide - radius) / tilt;
        // What `penetration` allows, and what is rounded off around the axis.
        assert!((reached - fills).abs() < (1e-3 * radius + 1e-4 * narrow) / tilt, "{reached} for {fills}\n{deck}");
        assert!((at - along * reached).norm() < 1e-4, "{at:?}\n{deck}");
        let normal = run.end("c.normal") * tilt;
        let left = force - 20.0 * (reached - 0.3);
        assert!((normal - left).abs() < 1e-6 * force, "{normal} for {left}\n{deck}");
    }
}

/// Friction takes what is missing of the energy of a ball that fills a funnel, which ends where it sticks.
#[test]
fn friction_in_a_funnel_keeps_the_account() {
    let deck = std::fs::read_to_string("decks/contact/ball_fills_funnel.toml").unwrap();
    let deck = deck.replace("penetration = 0.02\n", "penetration = 0.02\nfriction = 0.3\n");
    let (scene, expectations) = deck.split_once("[[expect]]").unwrap();
    assert!(!expectations.is_empty() && scene.contains("friction"));
    let run = simulate(scene);
    let [total, taken] = ["energy.total", "energy.friction"].map(|column| run.end(column));
    assert!(taken > 1.0 && total.abs() < 1e-3 * taken, "{total} of {taken}");
    // After its rebounds it is wedged: the tangent of the half angle is below mu.
    let run = simulate(&scene.replace("end = 0.55", "end = 1.1"));
    let heights = run.column("ball.z");
    let late = &heights[heights.len() * 4 / 5..];
    let [low, high] = [f64::min, f64::max].map(|pick| late.iter().copied().reduce(pick).unwrap());
    assert!(high - low < 5e-3, "{low} {high}");
}

/// The least angle to the floor at which friction `mu` at both ends holds a rigid ladder: atan((1 - mu^2)/(2 mu)).
fn least_angle_of_ladder(mu: f64) -> f64 {
    ((1.0 - mu * mu) / (2.0 * mu)).atan()
}

/// A stiff ladder between a floor and a wall, in random units and a random number of levels.
struct Ladder {
    deck: String,
    length: f64,
    weight: f64,
}

impl Ladder {
    fn new(random: &mut Random, angle: f64, mu: f64) -> Self {
        let [length, mass] = [0, 0].map(|_| 10.0_f64.powf(random.range(-3.0, 3.0)));
        let steps = 10.0_f64.powf(random.range(0.0, 1.5)) as u32;
        let radius = 0.005 * length;
        // Forces have the unit of mass times length.
        let (force, [x, y]) = (mass * length, [angle.cos(), angle.sin()].map(|part| part * length));
        let deck = format!(
            "gravity = [0, {gravity:e}, 0]\n[point]\nfoot = [0, 0, 0]\ntop = [{x:e}, {y:e}, 0]\n\
             [section.s]\nEA = {ea:e}\nGA = {ea:e}\nGJ = {ei:e}\nEI = {ei:e}\nrhoA = {line:e}\n\
             [[beam]]\nname = \"ladder\"\nsection = \"s\"\nthrough = [\"foot\", \"top\"]\nelements = 8\n\
             [[surface]]\nname = \"floor\"\nkind = \"plane\"\npoint = [0, {below:e}, 0]\nnormal = [0, 1, 0]\n\
             [[surface]]\nname = \"wall\"\nkind = \"plane\"\npoint = [{beyond:e}, 0, 0]\nnormal = [-1, 0, 0]\n\
             [[contact]]\nname = \"below\"\nbeams = [\"ladder\"]\nsurfaces = [\"floor\"]\nradius = {radius:e}\nfriction = {mu}\n\
             [[contact]]\nname = \"beside\"\nbeams = [\"ladder\"]\nsurfaces = [\"wall\"]\nradius = {radius:e}\nfriction = {mu}\n\
             [[stage]]\nkind = \"static\"\nsteps = {steps}\n[output]\nnodes = [\"foot\", \"top\"]\ncolumns = [\"u\", \"contact\"]\n",
            gravity = -9.81 * length,
            ea = 4e5 * force,
            ei = 1e3 * force * length * length,
            line = 10.0 * mass / length,
            below = -radius,
            beyond = x + radius,
        );
        Self { deck, length, weight: 98.1 * force }
    }

    /// Displacements of both ends, over its length.
    fn moves(&self, run: &Simulation) -> [f64; 4] {
        ["foot.ux", "foot.uy", "top.ux", "top.uy"].map(|column| (run.end(column) / self.length).abs())
    }
}

/// A ball that rolls round in a tall cylinder goes up and down as often as sqrt(2/7) times per turn, and neither higher
/// nor lower (Neimark and Fufaev 1972, Dynamics of Nonholonomic Systems).
#[test]
fn a_ball_that_rolls_round_in_a_cylinder_comes_up_again() {
    let random = &mut Random::new(103);
    for (case, scheme) in
        ["newmark", "generalized_alpha", "lie_generalized_alpha", "lobatto"].iter().cycle().take(8).enumerate()
    {
        let [length, mass] = [0, 0].map(|_| 10.0_f64.powf(random.range(-3.0, 3.0)));
        let (spin, radius) = (8.0, 0.1 * length);
        let way = length - radius;
        let velocity = spin * way;
        let stiffness = 2e4 * mass;
        let along = random.direction();
        let out = along.cross(random.direction()).normalized().unwrap();
        // In balance with the force that bends the way.
        let start = out * (way + mass * velocity * spin / stiffness);
        let text = format!(
            "gravity = {}\n[point]\nball = {}\n[[body]]\nat = \"ball\"\nmass = {mass:e}\ninertia = [{j:e}, {j:e}, {j:e}]\n\
             [[surface]]\nname = \"wall\"\nkind = \"cylinder\"\nfrom = {}\nto = {}\nradius = {length:e}\nside = \"inside\"\n\
             [[contact]]\nname = \"roll\"\nnodes = [\"ball\"]\nsurfaces = [\"wall\"]\nradius = {radius:e}\nfriction = 0.9\n\
             stiffness = {stiffness:e}\npenetration = {penetration:e}\n\
             [[initial]]\nat = \"ball\"\nvelocity = {}\nspin = {}\nabout = \"ball\"\n\
             [[stage]]\nkind = \"dynamic\"\nscheme = \"{scheme}\"\nstep = 2e-3\nend = 6\n\
             [output]\nnodes = [\"ball\"]\ncolumns = [\"u\"]\n",
            list(along * (-9.81 * length)),
            list(start),
            list(along * (-40.0 * length)),
            list(along * (40.0 * length)),
            list(along.cross(out) * velocity),
            list(along * (-velocity / radius)),
            j = 0.4 * mass * radius * radius,
            penetration = 0.01 * length,
        );
        let run = simulate(&text);
        let parts = ["ball.ux", "ball.uy", "ball.uz"].map(|name| run.column(name));
        let heights = (0..parts[0].len()).map(|row| Vec3([0, 1, 2].map(|k| parts[k][row])).dot(along) / length);
        let heights: Vec<f64> = heights.collect();
        let deepest = 2.0 * 9.81 * (5.0 / 7.0) / (spin * spin * 2.0 / 7.0);
        let [lowest, highest] = [f64::min, f64::max].map(|most| heights.iter().copied().fold(0.0, most));
        assert!(
            (lowest / -deepest - 1.0).abs() < 0.015 && highest < 0.005 * deepest,
            "{case}: {lowest} {highest}\n{text}"
        );
        // Of the third period from its start.
        let period = std::f64::consts::TAU / (spin * (2.0_f64 / 7.0).sqrt());
        let third = heights[(2.0 * period / 2e-3) as usize..].iter().take((period / 2e-3) as usize);
        let again = third.copied().fold(f64::NEG_INFINITY, f64::max);
        assert!(again.abs() < 0.005 * deepest, "{case} {scheme}: comes up to {again}\n{text}");
    }
}

/// A ball that is carried round the inside of a cylinder rolls, in levels of any size, with or without smaller steps.
#[test]
fn a_ball_that_is_carried_round_rolls_in_any_levels() {
    for spring in [1e-6, 1e-2] {
        for (steps, adaptive) in [(10, true), (20, true), (20, false), (40, false)] {
            let text = format!(
                "[point]\nb = [0.9, 0, 0]\n[[body]]\nat = \"b\"\nmass = 1\ninertia = [0.004, 0.004, 0.004]\n\
                 [[spring]]\nat = \"b\"\nstiffness = [0, 0, 0, 0, {spring:e}, 0]\n\
                 [[motion]]\nat = \"b\"\nux = 0.9\nhistory = \"cx\"\n[[motion]]\nat = \"b\"\nuz = 0.9\nhistory = \"cz\"\n\
                 [[support]]\nat = \"b\"\nfix = [\"uy\", \"rx\", \"rz\"]\n\
                 [history.cx]\nexpr = \"(1 + 1e-4)*cos(1.5707963267948966*t) - 1\"\n\
                 [history.cz]\nexpr = \"(1 + 1e-4)*sin(1.5707963267948966*t)\"\n\
                 [[surface]]\nname = \"s\"\nkind = \"cylinder\"\nfrom = [0, 0, 0]\nto = [0, 1, 0]\nradius = 1.0\nside = \"inside\"\n\
                 [[contact]]\nname = \"c\"\nnodes = [\"b\"]\nsurfaces = [\"s\"]\nradius = 0.1\nstiffness = 1e5\nfriction = 0.5\n\
                 penetration = 1e-2\n[[stage]]\nkind = \"static\"\nsteps = {steps}\nadaptive = {adaptive}\n\
                 [output]\nnodes = [\"b\"]\ncolumns = [\"rc\"]\n"
            );
            let (came, exact) = (simulate(&text).end("b.ry").abs(), 9.0 * std::f64::consts::FRAC_PI_2);
            assert!((came / exact - 1.0).abs() < 3e-3, "{came} for {exact}\n{text}");
        }
    }
}

/// Tubes that part block each other; a sheath in a vessel does not, nor do tubes one after the other.
#[test]
fn tubes_that_part_are_told() {
    let tube = |name: &str, through: &str, radius: f64| {
        format!(
            "[[surface]]\nname = \"{name}\"\nkind = \"tube\"\nside = \"inside\"\nsmooth = false\nthrough = {through}\nradius = {radius}\n"
        )
    };
    let trunk = tube("a", "[[-1, 0, 0], [0, 0, 0], [0.8, 0, 0.4]]", 0.05);
    for (other, is_told) in [
        (tube("b", "[[-1, 0, 0], [0, 0, 0], [0.8, 0, -0.4]]", 0.05), true),
        (tube("b", "[[0, 0, 0], [0.8, 0, -0.4]]", 0.05), true),
        (tube("b", "[[-1, 0, 0], [0, 0, 0.02], [0.8, 0, 0.4]]", 0.03), false),
        (tube("b", "[[0.8, 0, 0.4], [1.6, 0, 0.8]]", 0.05), false),
    ] {
        let text = format!(
            "[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1e-3\nEI = 1e-3\n[[beam]]\nname = \"w\"\nsection = \"s\"\n\
             through = [[-0.9, 0, 0], [-0.3, 0, 0]]\nelements = 8\n[[support]]\nat = \"w@start\"\nfix = \"all\"\n{trunk}{other}\
             [[contact]]\nname = \"k\"\nbeams = [\"w\"]\nsurfaces = [\"a\", \"b\"]\nradius = 0.01\n\
             [[stage]]\nkind = \"static\"\nsteps = 1\n"
        );
        let told = warnings(&text);
        assert_eq!(told.iter().any(|message| message.contains("neither branch")), is_told, "{told:?}\n{other}");
    }
}
