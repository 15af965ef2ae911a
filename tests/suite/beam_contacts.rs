//! Contact of beams with beams, and with themselves, in whole scenes.

use crate::random::Random;
use crate::scenes::{Simulation, attempt, frequencies, simulate};
use beamsim::scene;
use beamsim_core::failure::FailureKind;
use beamsim_core::kernel::Weights;
use beamsim_core::model::beam_element::PlacedNode;
use beamsim_core::model::{Assembly, Schedule, StageKind};
use beamsim_core::system::ContactRegime;
use beamsim_core::tensor::Vec3;
use beamsim_core::warning::WarningKind;

/// A beam from one place to another.
pub struct Bar {
    pub ends: [Vec3; 2],
    pub elements: usize,
    pub order: usize,
    pub radius: f64,
}

impl Bar {
    fn deck(&self, name: &str) -> String {
        let [[ax, ay, az], [bx, by, bz]] = self.ends.map(|end| end.0);
        format!(
            "[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = [[{ax}, {ay}, {az}], [{bx}, {by}, {bz}]]\n\
             elements = {}\norder = {}\n",
            self.elements, self.order
        )
    }
}

/// Two bars whose ends are held; those of the second are moved by `way` in static stages.
pub fn pushed(first: &Bar, second: &Bar, way: Vec3, steps: usize) -> String {
    let held = |at: &str| format!("[[support]]\nat = \"{at}\"\nfix = [\"ux\", \"uy\", \"uz\"]\n");
    let moved = |at: &str| {
        ["ux", "uy", "uz"]
            .iter()
            .zip(way.0)
            .map(|(key, value)| format!("[[motion]]\nat = \"{at}\"\n{key} = {value}\n"))
            .collect::<String>()
    };
    let twist = |name: &str| format!("[[spring]]\nat = \"{name}@0\"\nstiffness = [0, 0, 0, 1, 1, 1]\n");
    [
        "[section.s]\nEA = 200\nGA = 100\nGJ = 1\nEI = 1\n".to_string(),
        first.deck("first"),
        second.deck("second"),
        ["first@start", "first@end"].map(held).concat(),
        ["second@start", "second@end"].map(moved).concat(),
        ["first", "second"].map(twist).concat(),
        format!(
            "[[contact]]\nname = \"c\"\nbeams = [\"first\"]\nwith = [\"second\"]\n\
             radius = {{ first = {}, second = {} }}\n",
            first.radius, second.radius
        ),
        format!("[[stage]]\nkind = \"static\"\nsteps = {steps}\n"),
        "[output]\nnodes = [\"first@start\", \"first@end\"]\ncolumns = [\"reaction\", \"contact\", \"energy\"]\n"
            .into(),
    ]
    .concat()
}

/// A pair of bars that cross at a random angle, the second one beyond the first by a random gap.
struct Crossing {
    bars: [Bar; 2],
    normal: Vec3,
}

fn crossing(random: &mut Random, angles: [f64; 2]) -> Crossing {
    let along = random.direction();
    let normal = along.cross(random.direction()).normalized().unwrap();
    let angle = random.range(angles[0], angles[1]).to_radians();
    let across = along * angle.cos() + normal.cross(along) * angle.sin();
    let radii = [0, 1].map(|_| random.range(0.01, 0.04));
    let gap = random.range(0.001, 0.05);
    let bar = |random: &mut Random, direction: Vec3, middle: Vec3, radius: f64| {
        let part = random.range(0.35, 0.65);
        let elements = random.range(4.0, 24.99) as usize;
        let order = random.range(1.0, 3.99) as usize;
        Bar {
            ends: [middle - direction * part, middle + direction * (1.0 - part)],
            elements: elements.div_ceil(order).max(2),
            order,
            radius,
        }
    };
    let first = bar(random, along, Vec3::ZERO, radii[0]);
    let second = bar(random, across, normal * (radii[0] + radii[1] + gap), radii[1]);
    Crossing { bars: [first, second], normal }
}

#[test]
fn bars_that_are_pushed_do_not_pass_through_each_other() {
    let mut random = Random::new(81);
    let mut failed = Vec::new();
    const COUNT: usize = 60;
    for case in 0..COUNT {
        let Crossing { bars: [first, second], normal } = crossing(&mut random, [25.0, 90.0]);
        let steps = random.range(1.0, 12.99) as usize;
        let text = pushed(&first, &second, normal * -0.2, steps);
        let simulation = attempt(&text);
        if let Err(failure) = &simulation.result {
            println!("case {case}: {failure}");
            failed.push(case);
            continue;
        }
        let force = force_on_first(&simulation);
        assert!(force.dot(normal) < -0.01, "case {case}: {force:?}, {normal:?}\n{text}");
        assert!(simulation.end("c.depth") < 1.01e-3 * second.radius.min(first.radius), "case {case}");
        balances(&simulation, force);
    }
    println!("{} of {COUNT} fail: {failed:?}", failed.len());
    assert!(failed.len() * 20 <= COUNT, "{failed:?}");
}

fn force_on_first(simulation: &Simulation) -> Vec3 {
    Vec3(simulation.vector("c.f"))
}

fn balances(simulation: &Simulation, force: Vec3) {
    let reactions = ["first@start.f", "first@end.f"].map(|prefix| Vec3(simulation.vector(prefix)));
    let sum = force + reactions[0] + reactions[1];
    assert!(sum.norm() < 1e-5 * reactions[0].norm().max(force.norm()), "{sum:?} of {force:?}");
}

#[test]
fn the_answer_does_not_depend_on_levels_and_stiffness() {
    let mut random = Random::new(82);
    let Crossing { bars: [first, second], normal } = crossing(&mut random, [60.0, 61.0]);
    let force = |steps: usize, stiffness: &str| {
        let text = pushed(&first, &second, normal * -0.1, steps);
        let contact = format!("name = \"c\"\n{stiffness}\npenetration = 1e-8");
        simulate(&text.replace("name = \"c\"", &contact)).end("c.normal")
    };
    let forces = [force(1, ""), force(10, ""), force(4, "stiffness = 1e3"), force(4, "stiffness = 1e5")];
    println!("{forces:?}");
    assert!(forces.iter().all(|other| (other / forces[0] - 1.0).abs() < 1e-5), "{forces:?}");
}

/// A scene whose beams do not meet is the same with contact and without, to the last bit.
#[test]
fn beams_that_never_meet_change_nothing() {
    let mut random = Random::new(83);
    let Crossing { bars: [first, second], normal } = crossing(&mut random, [60.0, 61.0]);
    let far = Bar { ends: second.ends.map(|end| end + normal), ..second };
    let text = pushed(&first, &far, normal * 0.2, 5);
    let text = text.replace("columns = [\"reaction\", \"contact\", \"energy\"]", "");
    let start = text.find("[[contact]]").unwrap();
    let end = text.find("[[stage]]").unwrap();
    let without = text[..start].to_string() + &text[end..];
    let [with, without] = [text, without].map(|text| simulate(&text));
    assert_eq!(with.rows, without.rows);
    assert_eq!(with.counters.work.iterations, without.counters.work.iterations);
    assert_eq!(with.counters.work.factorisations, without.counters.work.factorisations);
    let of = |simulation: &Simulation| {
        let counts = simulation.counters.evaluations.iter().filter(|(name, _)| *name != "contact");
        counts.copied().collect::<Vec<_>>()
    };
    assert_eq!(of(&with), of(&without));
}

/// Beams side by side: a strip on a strip that is held, pressed by a load per length.
#[test]
fn beams_side_by_side_carry_a_load_per_length() {
    for angle in [0.0f64, 4.0, 14.0] {
        let (c, s) = (angle.to_radians().cos(), angle.to_radians().sin());
        let text = format!(
            r#"
[section.s]
EA = 1000
GA = 1000
GJ = 1
EI = 1
[[beam]]
name = "upper"
section = "s"
through = [[0, 0, 0.021], [{c}, {s}, 0.021]]
elements = 10
[[beam]]
name = "lower"
section = "s"
through = [[0, 0, 0], [1, 0, 0]]
elements = 13
[[support]]
at = "lower@start"
fix = "all"
[[support]]
at = "lower@end"
fix = "all"
[[support]]
at = "upper@start"
fix = ["ux", "uy", "rx", "ry", "rz"]
[[support]]
at = "upper@end"
fix = ["ux", "uy", "rx", "ry", "rz"]
[[spring]]
at = "upper@start"
stiffness = [0, 0, 0.01, 0, 0, 0]
[[load]]
along = "upper"
force = [0, 0, -0.5]
[[contact]]
name = "c"
beams = ["upper"]
with = ["lower"]
radius = 0.01
[[stage]]
kind = "static"
steps = 4
[output]
nodes = ["upper@start", "upper@end"]
columns = ["u", "contact"]
"#
        );
        let simulation = simulate(&text);
        let held = 0.01 * -simulation.end("upper@start.uz");
        let force = simulation.end("c.fz");
        println!("{angle}: {force}, points {}", simulation.end("c.points"));
        assert!((force + held - 0.5).abs() < 1e-4, "{angle}: {force} {held}");
    }
}

#[test]
fn forces_and_moments_of_pairs_cancel_and_have_their_tangent() {
    let mut random = Random::new(84);
    let mut touched = 0;
    for case in 0..40 {
        let angles = [[25.0, 90.0], [0.0, 9.0], [10.0, 20.0]][case % 3];
        let Crossing { bars: [first, second], normal } = crossing(&mut random, angles);
        let text = pushed(&first, &second, normal * -0.1, 1).replace("name = \"c\"", "name = \"c\"\nstiffness = 3");
        let (scene, _) = scene::from_text(&text).unwrap();
        let model = scene.plan.model;
        let mut state = model.rest();
        let mut schedule = Schedule::new(&model);
        let dof_map = schedule.begin_stage(&model, 0, StageKind::Static, &state).unwrap();
        schedule.set_clock(&model, &mut state, 0.0, 0.0);
        // Penalties share their force near kinks; the tangent leaves out how that changes.
        let (regime, bend) =
            if case % 2 == 0 { (ContactRegime::Augmented, 0.001) } else { (ContactRegime::Penalty, 0.0) };
        state.contacts.regime = regime;
        // The second bar goes into the first.
        let depth = second.ends[0].dot(normal) - 0.7 * (first.radius + second.radius);
        for &node in &scene.mesh.beams[1].nodes {
            state.q[scene.mesh.nodes[node].node.u as usize] = normal * -depth + random.cube(bend);
        }
        model.contacts().unwrap().list_pairs(&mut state);
        let effect = model.effects.iter().find(|effect| effect.name() == "contact").unwrap().clone();
        let pairs = state.contacts.pairs.list.clone();
        let stage = scene.plan.stages[0].context(0);
        let mut assembly = Assembly::of(vec![effect], &stage, dof_map, &model, pairs);
        assembly.evaluate(&state, Weights::STIFFNESS, None);
        let of_node = |node: &PlacedNode| {
            let slot = node.node.u as usize;
            let force = assembly.system.total(slot);
            (force, (node.place + state.q[slot]).cross(force))
        };
        let all: Vec<(Vec3, Vec3)> = scene.mesh.nodes.iter().map(of_node).collect();
        let sum = all.iter().fold(Vec3::ZERO, |sum, (force, _)| sum + *force);
        let moment = all.iter().fold(Vec3::ZERO, |sum, (_, moment)| sum + *moment);
        let size = all.iter().map(|(force, _)| force.norm()).fold(0.0, f64::max);
        touched += usize::from(size > 0.0);
        assert!(sum.norm() <= 1e-14 * size && moment.norm() <= 1e-14 * size, "{case}: {sum:?} {moment:?} of {size}");
        let count = assembly.system.pattern.dof_map.count();
        let x: Vec<f64> = (0..count).map(|_| random.range(-1.0, 1.0)).collect();
        let values = assembly.system.values.clone();
        let got = assembly.system.multiply(&values, &x);
        let mut moved = |h: f64| {
            let mut there = state.clone();
            let mut dq = vec![Vec3::ZERO; there.q.len()];
            assembly.system.pattern.dof_map.scatter(&x, None, &mut dq);
            there.q.iter_mut().zip(&dq).for_each(|(q, dq)| *q += *dq * h);
            assembly.evaluate(&there, Weights::NONE, None);
            let mut out = vec![0.0; count];
            assembly.system.right_hand_side(&mut out);
            out
        };
        let h = 1e-7;
        let (after, before) = (moved(h), moved(-h));
        let exact: Vec<f64> = after.iter().zip(&before).map(|(a, b)| (b - a) / (2.0 * h)).collect();
        let scale = exact.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let off = got.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off <= 1e-6 * scale, "{case}: {off} of {scale}");
    }
    println!("{touched} of 40 touch");
    assert!(touched > 30);
}

/// A rope whose ends are pulled down and aside beside a thick beam, which it slides over.
fn pulled_over_beam(random: &mut Random) -> String {
    let [rope, drum] = [random.range(0.02, 0.06), random.range(0.05, 0.2)];
    let elements = random.range(12.0, 48.99) as usize;
    let friction = random.range(-0.5, 0.5).max(0.0);
    let bending = 10f64.powf(random.range(-2.5, -1.0));
    let slant = random.range(-0.6, 0.6);
    let parts = random.range(1.0, 5.99) as usize;
    let height = rope + drum + 0.01;
    let motions: String = [("start", [0.5, 0.1, -1.0]), ("end", [-0.6, 0.1, -0.8])]
        .iter()
        .flat_map(|(end, way)| {
            ["ux", "uy", "uz"]
                .iter()
                .zip(way)
                .map(move |(key, value)| format!("[[motion]]\nat = \"rope@{end}\"\n{key} = {value}\nhistory = \"h\"\n"))
        })
        .collect();
    format!(
        r#"
[section.s]
EA = 1e3
GA = 500
GJ = {bending}
EI = {bending}
rhoA = 1
rhoJ = [1e-3, 5e-4, 5e-4]
[section.d]
EA = 1e6
GA = 1e6
GJ = 1e3
EI = 1e3
rhoA = 10
rhoJ = [0.1, 0.05, 0.05]
[[beam]]
name = "rope"
section = "s"
through = [[-1, 0, {height}], [1.13, 0, {height}]]
elements = {elements}
[[beam]]
name = "drum"
section = "d"
through = [[{}, -1, 0], [{slant}, 1, 0]]
elements = {parts}
[[support]]
at = "drum@start"
fix = "all"
[[support]]
at = "drum@end"
fix = "all"
{motions}
[history.h]
times = [0, 4]
values = [0, 1]
smooth = true
[damping]
mass = 2
stiffness = 0.005
[[contact]]
name = "c"
beams = ["rope"]
with = ["drum"]
radius = {{ rope = {rope}, drum = {drum} }}
friction = {friction}
stiffness = 300
penetration = 0.05
[[stage]]
kind = "dynamic"
end = 4.5
step = 0.01
scheme = "generalized_alpha"
rho_inf = 0.5
[output]
nodes = ["rope@end"]
columns = ["u", "contact", "energy"]
"#,
        -slant
    )
}

#[test]
fn ropes_slide_over_beams_in_whole_time_steps() {
    let mut random = Random::new(88);
    for case in 0..8 {
        let text = pulled_over_beam(&mut random);
        let simulation = simulate(&text);
        let [lost, given] = ["energy.total", "energy.external"].map(|column| simulation.end(column));
        let cutbacks = simulation.counters.cutbacks;
        println!("{case}: {cutbacks} cut-backs, {lost} of {given}");
        assert!(cutbacks < 3, "{case}: {cutbacks} cut-backs\n{text}");
        assert!(simulation.end("c.normal") > 0.1 && lost.abs() < 0.01 * given, "{case}: {lost} of {given}\n{text}");
    }
}

/// A contact without a pair in reach beside one whose pairs are listed from far away, since they
/// approach fast.
#[test]
fn gaps_are_known_beside_a_list_of_a_wide_margin() {
    let bar = |name: &str, x: f64, z: f64| {
        Bar { ends: [Vec3([x, 0.0, z]), Vec3([x, 1.0, z])], elements: 4, order: 1, radius: 0.05 }.deck(name)
    };
    let text = [
        "[section.s]\nEA = 200\nGA = 100\nGJ = 1\nEI = 1\nrhoA = 1\nrhoJ = [2e-3, 1e-3, 1e-3]\n".to_string(),
        [bar("a", 0.0, 0.0), bar("b", 0.0, 3.0), bar("c", 20.0, 0.0), bar("d", 20.0, 30.0)].concat(),
        ["a", "c", "d"].map(|at| format!("[[support]]\nat = \"{at}@start\"\nfix = \"all\"\n")).concat(),
        "[[initial]]\nbeam = \"b\"\nvelocity = [0, 0, -8]\n".into(),
        [("near", "a", "b"), ("far", "c", "d")]
            .map(|(name, a, b)| {
                format!("[[contact]]\nname = \"{name}\"\nbeams = [\"{a}\"]\nwith = [\"{b}\"]\nradius = 0.05\n")
            })
            .concat(),
        "[[stage]]\nkind = \"dynamic\"\nend = 0.32\nstep = 0.02\n".into(),
        "[output]\nnodes = [\"a@start\"]\ncolumns = [\"contact\"]\n".into(),
    ]
    .concat();
    let simulation = simulate(&text);
    assert!((simulation.end("near.gap") - 0.34).abs() < 1e-9, "{}", simulation.end("near.gap"));
    assert!((simulation.end("far.gap") - 29.9).abs() < 1e-9, "{}", simulation.end("far.gap"));
}

/// A bar that is held at its ends, and one that flies at it.
fn shot(first: &Bar, second: &Bar, velocity: Vec3, step: f64, end: f64) -> String {
    let [x, y, z] = velocity.0;
    let text = pushed(first, second, Vec3::ZERO, 1);
    let without_motions: Vec<&str> = text.split("[[").filter(|table| !table.starts_with("motion]]")).collect();
    let text = without_motions.join("[[").replace("EI = 1\n", "EI = 1\nrhoA = 1\nrhoJ = [2e-3, 1e-3, 1e-3]\n");
    let stage = format!(
        "[[initial]]\nbeam = \"second\"\nvelocity = [{x}, {y}, {z}]\n\
         [[stage]]\nkind = \"dynamic\"\nend = {end}\nstep = {step}\n"
    );
    text.replace("[[stage]]\nkind = \"static\"\nsteps = 1\n", &stage)
        .replace("[[spring]]\nat = \"second@0\"\nstiffness = [0, 0, 0, 1, 1, 1]\n", "")
        .replace("columns = [\"reaction\",", "columns = [")
        .replace("nodes = [\"first@start\", \"first@end\"]", "nodes = [\"second@start\", \"second@end\"]")
        .replace("columns = [ \"contact\"", "columns = [\"x\", \"contact\"")
}

#[test]
fn a_bar_that_flies_at_another_does_not_pass_through() {
    let mut random = Random::new(85);
    let mut failed = Vec::new();
    const COUNT: usize = 24;
    for case in 0..COUNT {
        let Crossing { bars: [first, second], normal } = crossing(&mut random, [0.0, 90.0]);
        let speed = random.range(0.5, 3.0);
        let simulation = attempt(&shot(&first, &second, normal * -speed, 5e-4, 0.15));
        if let Err(failure) = &simulation.result {
            println!("case {case}: {failure}");
            failed.push(case);
        }
        let least = simulation.column("c.gap").into_iter().fold(f64::INFINITY, f64::min);
        assert!(least > -0.9 * (first.radius + second.radius), "case {case}: {least}");
        // The first bar is pushed along all the time: beyond it the force would turn over.
        let forces = ["x", "y", "z"].map(|axis| simulation.column(&format!("c.f{axis}")));
        for [x, y, z] in (0..forces[0].len()).map(|row| [0, 1, 2].map(|axis: usize| forces[axis][row])) {
            let force = Vec3([x, y, z]);
            assert!(force.dot(normal) <= 0.3 * force.norm(), "case {case}: {force:?}, {normal:?}");
        }
    }
    println!("{} of {COUNT} fail: {failed:?}", failed.len());
    assert!(failed.len() <= 1, "{failed:?}");
}

#[test]
fn beams_that_begin_inside_each_other_are_refused() {
    let mut random = Random::new(86);
    let Crossing { bars: [first, second], normal } = crossing(&mut random, [60.0, 61.0]);
    let inside = Bar { ends: second.ends.map(|end| end - normal * 0.06), ..second };
    let simulation = attempt(&pushed(&first, &inside, normal * -0.1, 2));
    let failure = simulation.result.unwrap_err();
    assert_eq!(failure.kind(), FailureKind::ContactStart);
    assert!(failure.to_string().contains("into \"second\""), "{failure}");
}

/// Two beams in line whose ends, nodes of their own at one place, a joint connects.
#[test]
fn beams_that_a_joint_connects_do_not_touch_there() {
    let text = |joint: &str| {
        format!(
            r#"
[section.s]
EA = 100
GA = 100
GJ = 1
EI = 1
[point]
o = [0, 0, 0]
m = [1, 0, 0]
n = [1, 0, 0]
e = [1.8, 0.6, 0]
[[beam]]
name = "a"
section = "s"
through = ["o", "m"]
elements = 10
[[beam]]
name = "b"
section = "s"
through = ["n", "e"]
elements = 10
[[support]]
at = "o"
fix = "all"
{joint}
[[load]]
at = "e"
force = [0, 0, 0.01]
[[contact]]
name = "c"
beams = ["a"]
with = ["b"]
radius = 0.04
[[stage]]
kind = "static"
steps = 2
[output]
nodes = ["e"]
columns = ["u", "contact"]
"#
        )
    };
    let joined = simulate(&text("[[joint]]\nkind = \"rigid\"\nnodes = [\"m\", \"n\"]"));
    assert_eq!(joined.column("c.points"), [0.0; 3]);
    // Without the joint the beams begin inside each other.
    let held = "[[support]]\nat = \"n\"\nfix = \"all\"";
    assert_eq!(attempt(&text(held)).result.unwrap_err().kind(), FailureKind::ContactStart);
}

/// A ring whose ends meet in the middle of a bar below: one contact point, with the force of all.
#[test]
fn the_node_that_closes_a_ring_touches_once() {
    let text = r#"
[section.s]
EA = 100
GA = 100
GJ = 1
EI = 1
rhoA = 1
[point]
low = [0, 0, 0]
[[beam]]
name = "ring"
section = "s"
through = ["low", [1, 0, 1], [0, 0, 2], [-1, 0, 1], "low"]
elements = [2, 2, 2, 2]
[[beam]]
name = "bar"
section = "s"
through = [[0, -0.5, -0.1], [0, 0.5, -0.1]]
elements = 3
[[support]]
at = "bar@start"
fix = "all"
[[support]]
at = "bar@end"
fix = "all"
[[load]]
at = "low"
force = [0, 0, -0.5]
[[contact]]
name = "c"
beams = ["ring"]
with = ["bar"]
radius = 0.05
stiffness = 1e3
[[stage]]
kind = "dynamic"
end = 0.02
step = 1e-3
[output]
nodes = ["low"]
columns = ["u", "contact"]
"#;
    let simulation = simulate(text);
    let points = simulation.column("c.points");
    assert!(points.iter().all(|&points| points <= 1.0) && points.contains(&1.0), "{points:?}");
    // One penalty: p = K d.
    let [normal, depth] = ["c.normal", "c.depth"].map(|name| simulation.end(name));
    assert!((normal - 1e3 * depth).abs() < 1e-9 * normal, "{normal} {depth}");
}

/// A straight bar of radius 0.01 from one place to another.
fn bar(ends: [[f64; 3]; 2], elements: usize) -> Bar {
    Bar { ends: ends.map(Vec3), elements, order: 1, radius: 0.01 }
}

/// Two bars whose ends are clamped, one on the other. The upper one is loaded along its length.
fn pressed([upper, lower]: [&Bar; 2], contact: &str, stages: &str) -> String {
    let clamp = |at: &str| format!("[[support]]\nat = \"{at}\"\nfix = \"all\"\n");
    [
        "[section.s]\nEA = 1e6\nGA = 1e4\nGJ = 1\nEI = 1\nrhoA = 0.1\nrhoJ = [1e-5, 5e-6, 5e-6]\n".to_string(),
        upper.deck("upper"),
        lower.deck("lower"),
        ["upper@start", "upper@end", "lower@start", "lower@end"].map(clamp).concat(),
        "[[load]]\nalong = \"upper\"\nforce = [0, 0, -0.5]\n".into(),
        format!("[[contact]]\nname = \"k\"\nbeams = [\"upper\"]\nwith = [\"lower\"]\nradius = 0.01\n{contact}\n"),
        format!("{stages}[output]\nnodes = [\"upper@0.5\"]\ncolumns = [\"u\", \"contact\", \"energy\"]\n"),
    ]
    .concat()
}

/// What a static stage has pressed together stays as it is in a dynamic one with the same loads, whatever
/// the angle between the beams and wherever their nodes are.
#[test]
fn forces_stay_from_a_static_to_a_dynamic_stage() {
    let stages = "[[stage]]\nkind = \"static\"\nsteps = 4\n[[stage]]\nkind = \"dynamic\"\nend = 0.05\nstep = 1e-3\n\
                  scheme = \"generalized_alpha\"\nrho_inf = 0.5\n";
    for degrees in [90.0_f64, 40.0, 15.0, 12.0, 8.0, 5.0] {
        // Below 10 degrees dynamic stages have nodes alone, which long elements hold too far from the crossing.
        let meshes = if degrees < 10.0 { &[[20, 20], [20, 21]][..] } else { &[[20, 20], [20, 21], [7, 10]] };
        for &elements in meshes {
            let [cosine, sine] = [degrees.to_radians().cos() * 0.5, degrees.to_radians().sin() * 0.5];
            let upper = bar([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], elements[0]);
            let lower = bar([[-cosine, -sine, -0.02], [cosine, sine, -0.02]], elements[1]);
            let simulation = simulate(&pressed([&upper, &lower], "damping = 0.1", stages));
            let normal = simulation.column("k.normal");
            let held = normal[4];
            let off = normal[5..].iter().map(|normal| (normal / held - 1.0).abs()).fold(0.0, f64::max);
            let moves = simulation.column("energy.kinetic").into_iter().fold(0.0, f64::max);
            let damped = simulation.end("energy.friction");
            println!(
                "{degrees} degrees, {elements:?}: {held}, off by {off:.1e}, kinetic energy {moves:.1e}, damped {damped:.1e}"
            );
            assert!(damped.abs() < 1e-10, "{degrees} degrees, {elements:?}: {damped}");
            // Where beams cross at a small angle shares go on changing with the shape; below 10 degrees nodes
            // beside take over what closest points had.
            let [most, fastest] = match degrees {
                30.0.. => [1e-9, 1e-20],
                10.0.. => [1e-3, 1e-10],
                _ => [0.02, 1e-7],
            };
            assert!(off < most && moves < fastest, "{degrees} degrees, {elements:?}: {off}, {moves}");
        }
    }
}

/// A contact that begins to act in a later stage is looked at then.
#[test]
fn contacts_that_begin_inside_each_other_are_refused_in_any_stage() {
    let upper = bar([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], 4);
    let lower = bar([[0.0, -0.5, -0.02], [0.0, 0.5, -0.02]], 4);
    let stages = "[[stage]]\nkind = \"static\"\nsteps = 1\n".repeat(2);
    let failure = attempt(&pressed([&upper, &lower], "stages = [2]", &stages)).result.unwrap_err();
    assert_eq!(failure.kind(), FailureKind::ContactStart, "{failure}");
    assert!(failure.to_string().contains("stage 2"), "{failure}");
}

/// Equal rods side by side, node against node, swap their velocities: all nodes touch at once, at kinks that
/// are no more than round-off.
#[test]
fn rods_that_hit_flush_rebound() {
    for (elements, shift) in [(4, 0.0), (10, 0.0), (11, 0.0), (10, 0.1)] {
        let a = bar([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], elements);
        let b = bar([[shift - 0.5, 0.0, 0.03], [shift + 0.5, 0.0, 0.03]], elements);
        let deck = [
            "[section.s]\nEA = 1e6\nGA = 4e5\nGJ = 500\nEI = 500\nrhoA = 0.5\nrhoJ = [1e-4, 5e-5, 5e-5]\n",
            &a.deck("a"),
            &b.deck("b"),
            "[[initial]]\nbeam = \"b\"\nvelocity = [0, 0, -2]\n",
            "[[contact]]\nname = \"hit\"\nbeams = [\"a\"]\nwith = [\"b\"]\nradius = 0.01\n",
            "[[stage]]\nkind = \"dynamic\"\nend = 0.02\nstep = 1e-4\n",
            "[output]\nnodes = [\"a@0.5\", \"b@0.5\"]\ncolumns = [\"v\", \"energy\"]\n",
        ];
        let simulation = simulate(&deck.concat());
        let [a, b] = ["a", "b"].map(|beam| simulation.end(&format!("{beam}@0.5.vz")));
        let energy = simulation.end("energy.total");
        println!("{elements} elements, shift {shift}: {a}, {b}, energy {energy}");
        assert!(a < -1.5 && b > -0.5, "{elements} elements, shift {shift}: {a}, {b}");
        assert!((energy - 1.0).abs() < 0.02, "{energy}");
    }
}

/// Two equal bars that cross in their middles exchange their velocities at any angle, wherever their nodes are: also at
/// small angles with nodes so far apart that none touches, and where two nodes meet.
#[test]
fn bars_that_cross_at_small_angles_exchange_their_velocities() {
    let mut random = Random::new(97);
    for case in 0..24 {
        let [along, normal] = random.axes();
        let angle = random.range(0.5, 20.0).to_radians();
        let across = along * angle.cos() + normal.cross(along) * angle.sin();
        let [first_elements, second_elements] = [0, 1].map(|_| random.range(1.0, 8.99) as usize);
        let order = 1 + case % 3;
        let middle = normal * 0.037;
        let bar = |direction: Vec3, middle: Vec3, elements: usize| Bar {
            ends: [middle - direction * 0.5, middle + direction * 0.5],
            elements: elements.div_ceil(order),
            order,
            radius: 0.017,
        };
        let velocity = normal * -0.7;
        let Vec3([vx, vy, vz]) = velocity;
        let deck = [
            "[section.s]\nEA = 1e8\nGA = 1e8\nGJ = 1e6\nEI = 1e6\nrhoA = 1\nrhoJ = [1e-3, 5e-4, 5e-4]\n",
            &bar(along, Vec3::ZERO, first_elements).deck("a"),
            &bar(across, middle, second_elements).deck("b"),
            &format!("[[initial]]\nbeam = \"b\"\nvelocity = [{vx}, {vy}, {vz}]\n"),
            "[[contact]]\nname = \"c\"\nbeams = [\"a\"]\nwith = [\"b\"]\nradius = 0.017\nstiffness = 5e5\npenetration = 1e-3\n",
            "[[stage]]\nkind = \"dynamic\"\nend = 0.02\nstep = 1e-4\n",
            "[output]\nnodes = [\"a@start\", \"a@end\", \"b@start\", \"b@end\"]\ncolumns = [\"v\", \"contact\", \"energy\"]\n",
        ];
        let simulation = simulate(&deck.concat());
        let speed = |beam: &str| {
            let ends = ["start", "end"].map(|end| Vec3(simulation.vector(&format!("{beam}@{end}.v"))).dot(normal));
            0.5 * (ends[0] + ends[1])
        };
        let (of_first, of_second) = (speed("a"), speed("b"));
        let deepest = simulation.column("c.depth").into_iter().fold(0.0, f64::max);
        let energy = simulation.end("energy.total");
        let about = format!("case {case}, {first_elements} and {second_elements} elements at {angle}, order {order}");
        println!("{about}: {of_first}, {of_second}, depth {deepest}, energy {energy}");
        assert!((of_first + 0.7).abs() < 0.01 && of_second.abs() < 0.01, "{about}: {of_first}, {of_second}");
        // v sqrt(m/(2 K)), less where several nodes touch.
        assert!(deepest < 1.3 * 0.7 * (0.5f64 / 5e5).sqrt(), "{about}: {deepest}");
        assert!((energy - 0.245).abs() < 0.01 * 0.245, "{about}: {energy}");
    }
}

/// The end of a cantilever lies over another one near its end and is pressed down: in one level as in six. It does not go
/// past the axis of the other one, where centre lines do not cross.
#[test]
fn ends_do_not_go_through_beams_in_one_level() {
    let mut random = Random::new(98);
    let mut compared = 0;
    for case in 0..20 {
        let beyond = random.range(0.0, 0.012);
        let force = 10.0_f64.powf(random.range(0.2, 2.0));
        let angle = random.range(40.0, 90.0).to_radians();
        let [x, y] = [0.8 * angle.cos(), -0.8 * angle.sin()];
        let force_at = |steps: usize| {
            let deck = [
                "[section.s]\nEA = 5e4\nGA = 2e4\nGJ = 6\nEI = 7\n",
                &Bar { ends: [Vec3([-1.1, 0.0, 0.0]), Vec3([0.3, 0.0, 0.0])], elements: 14, order: 1, radius: 0.02 }
                    .deck("a"),
                &Bar { ends: [Vec3([x, y, 0.043]), Vec3([0.0, beyond, 0.042])], elements: 8, order: 1, radius: 0.02 }
                    .deck("b"),
                "[[support]]\nat = \"a@start\"\nfix = \"all\"\n[[support]]\nat = \"b@start\"\nfix = \"all\"\n",
                &format!("[[load]]\nat = \"b@end\"\nforce = [0, 0, -{force}]\n"),
                "[[contact]]\nname = \"c\"\nbeams = [\"a\"]\nwith = [\"b\"]\nradius = 0.02\n",
                &format!("[[stage]]\nkind = \"static\"\nsteps = {steps}\n"),
                "[output]\nnodes = [\"b@end\"]\ncolumns = [\"u\", \"contact\"]\n",
            ];
            let simulation = attempt(&deck.concat());
            // What slides off has a named error or another end.
            simulation.result.is_ok().then(|| simulation.end("c.normal"))
        };
        let [at_once, in_six] = [1, 6].map(force_at);
        println!("case {case}: {at_once:?}, {in_six:?}");
        if let (Some(at_once), Some(in_six)) = (at_once, in_six) {
            assert!(
                (at_once - in_six).abs() < 1e-2 * in_six.max(0.1),
                "case {case}: {at_once}, in six levels {in_six}"
            );
            compared += usize::from(in_six > 0.1);
        }
    }
    assert!(compared >= 10, "{compared}");
}

/// Bars that come near each other from afar in one level or step, and touch or do not: nothing has been passed.
#[test]
fn approaches_from_afar_pass_nothing() {
    let (radius, section) =
        (0.01, "[section.s]\nEA = 1e6\nGA = 4e5\nGJ = 500\nEI = 500\nrhoA = 0.5\nrhoJ = [1e-4, 5e-5, 5e-5]\n");
    for (from, to) in [(6.0, 1.02), (8.0, 0.999), (20.0, 2.0), (50.0, 5.0), (100.0, 10.0)] {
        let height = 2.0 * radius * from;
        let way = 2.0 * radius * (from - to);
        let bar = |ends: [Vec3; 2]| Bar { ends, elements: 4, order: 1, radius };
        let first = bar([Vec3([-0.5, 0.0, 0.0]), Vec3([0.5, 0.0, 0.0])]);
        let second = bar([Vec3([0.0, -0.5, height]), Vec3([0.0, 0.5, height])]);
        let pressed = simulate(&pushed(&first, &second, Vec3([0.0, 0.0, -way]), 1));
        assert_eq!(pressed.counters.cutbacks, 0, "from {from} to {to}");
        let deck = [
            section,
            &first.deck("a"),
            &second.deck("b"),
            &format!("[[initial]]\nbeam = \"b\"\nvelocity = [0, 0, {}]\n", -way / 1e-3),
            &format!("[[contact]]\nname = \"c\"\nbeams = [\"a\"]\nwith = [\"b\"]\nradius = {radius}\n"),
            "[[stage]]\nkind = \"dynamic\"\nend = 1e-3\nstep = 1e-3\n[output]\nnodes = [\"b@start\"]\ncolumns = [\"x\"]\n",
        ];
        let flown = simulate(&deck.concat());
        assert_eq!(flown.counters.cutbacks, 0, "from {from} to {to}");
    }
}

/// Beams of two and of three elements that are pressed on each other and come apart: the overlap between their points is
/// told where a row shows it, though the stage ends without.
#[test]
fn penetrations_between_points_are_told_of_all_rows() {
    let text = std::fs::read_to_string("decks/contact/beams_of_unequal_meshes.toml").unwrap();
    let stops = text.replace("steps = 4", "steps = 4\n[history.h]\ntimes = [0, 0.5, 1]\nvalues = [0, 1, 0]");
    let released = stops.replace("force = [0, 0, ", "history = \"h\"\nforce = [0, 0, ");
    let warned = attempt(&released).counters.findings.warnings;
    let told = warned.iter().find(|warning| warning.kind == WarningKind::HiddenPenetration);
    let message = &told.expect("a warning").message;
    assert!(message.contains("at load factor 0.5"), "{message}");
}

/// Bars of one element that cross at an angle so small that their ends carry all of the force: the overlap in
/// between is told.
#[test]
fn penetrations_between_points_are_told_in_dynamic_stages() {
    let told = |stiffness: &str, elements: usize| {
        let angle = 0.0033_f64;
        let (sin, cos) = angle.sin_cos();
        let bar = |ends: [[f64; 3]; 2]| Bar { ends: ends.map(Vec3), elements, order: 1, radius: 0.017 };
        let deck = [
            "[section.s]\nEA = 1e8\nGA = 1e8\nGJ = 1e6\nEI = 1e6\nrhoA = 1\nrhoJ = [1e-3, 5e-4, 5e-4]\n",
            &bar([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]).deck("a"),
            &bar([[-0.5 * cos, -0.5 * sin, 0.0341], [0.5 * cos, 0.5 * sin, 0.0341]]).deck("b"),
            "[[initial]]\nbeam = \"b\"\nvelocity = [0, 0, -0.1]\n",
            &format!(
                "[[contact]]\nname = \"c\"\nbeams = [\"a\"]\nwith = [\"b\"]\nradius = 0.017\nstiffness = {stiffness}\n"
            ),
            "[[stage]]\nkind = \"dynamic\"\nend = 5e-3\nstep = 1e-5\n[output]\nnodes = [\"b@start\"]\ncolumns = [\"x\"]\n",
        ];
        let warned = attempt(&deck.concat()).counters.findings.warnings;
        warned.iter().any(|warning| warning.kind == WarningKind::HiddenPenetration)
    };
    assert!(told("5e8", 1));
    assert!(!told("5e6", 100));
}

/// A cantilever that presses on a beam with its next to last node, between elements of which one is half as long as the
/// other, at which the stiffness of the contact differs: modal stages hold the contact. Its first frequencies are those
/// with a contact as stiff as that of EA = 1e9, beside those of the parts alone.
#[test]
fn contacts_between_unlike_elements_are_held_in_modal_stages() {
    for stiff in [1e7, 1e8, 1e9] {
        let deck = format!(
            "[point]\nroot = [1, -1, 0.02]\ntip = [1, 0, 0.02]\nend = [1, 0.05, 0.02]\nleft = [0.5, 0, 0]\nright = [1.5, 0, 0]\n\
             [section.s]\nEA = {stiff}\nGA = {stiff}\nGJ = 1e3\nEI = 500\nrhoA = 1\nrhoJ = [2e-6, 1e-6, 1e-6]\n\
             [[beam]]\nname = \"up\"\nsection = \"s\"\nthrough = [\"root\", \"tip\", \"end\"]\nelements = [10, 1]\norder = 2\n\
             [[beam]]\nname = \"low\"\nsection = \"s\"\nthrough = [\"left\", \"right\"]\nelements = 7\norder = 2\n\
             [[support]]\nat = \"root\"\nfix = \"all\"\n[[support]]\nat = \"left\"\nfix = \"all\"\n\
             [[support]]\nat = \"right\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 0, -10]\n\
             [[load]]\nat = \"low@0.5\"\nforce = [0, 0, 10]\n\
             [[contact]]\nname = \"c\"\nbeams = [\"up\"]\nwith = [\"low\"]\nradius = 0.01\n\
             [[stage]]\nkind = \"static\"\nsteps = 2\n[[stage]]\nkind = \"modal\"\nmodes = 3\n"
        );
        let found = frequencies(&deck);
        for (found, expected) in found.iter().zip([71.31, 302.7, 446.9]) {
            assert!((found - expected).abs() < 2e-3 * expected, "{found} for {expected} with EA = {stiff}");
        }
        let warned = attempt(&deck).counters.findings.warnings;
        assert!(warned.is_empty(), "{warned:?}");
    }
}

/// Two leaves with one clamped end each, of which the upper one is pressed onto the lower, shorter one: they touch at
/// its tip, with the force P (3L - l)/(2l) B2/(B1 + B2) (beams of Euler and Bernoulli with the bending stiffness B). The
/// tip moves by a thousandth to a third of the radius, so that a penetration of a thousandth of it would be seen.
#[test]
fn leaves_share_their_load_however_little_they_bend() {
    let mut random = Random::new(86);
    let mut worst = 0.0f64;
    for _ in 0..20 {
        let [length_unit, force_unit] = [0; 2].map(|_| 10f64.powf(random.range(-3.0, 3.0)));
        let short = random.range(0.4, 0.8);
        let bending = [0; 2].map(|_| random.range(0.5, 2.0));
        let radius = 0.01;
        let force = 3.0 * bending[0] * radius * 10f64.powf(random.range(-3.0, -0.5));
        let section = |k: usize| {
            let [stiff, bend] = [1e6 * force_unit, bending[k] * force_unit * length_unit * length_unit];
            format!("[section.s{k}]\nEA = {stiff}\nGA = {stiff}\nGJ = {bend}\nEI = {bend}\n")
        };
        let leaf = |k: usize, length: f64| {
            let height = -2.0 * radius * length_unit * k as f64;
            format!(
                "[[beam]]\nname = \"b{k}\"\nsection = \"s{k}\"\nthrough = [[0, 0, {height}], [{}, 0, {height}]]\nelements = 20\n\
                 order = 2\n[[support]]\nat = \"b{k}@start\"\nfix = \"all\"\n",
                length * length_unit
            )
        };
        let text = section(0)
            + &section(1)
            + &leaf(0, 1.0)
            + &leaf(1, short)
            + &format!(
                "[[load]]\nat = \"b0@end\"\nforce = [0, 0, {}]\n[[contact]]\nname = \"c\"\nbeams = [\"b0\"]\nwith = [\"b1\"]\n\
                 radius = {}\n[[stage]]\nkind = \"static\"\nsteps = {}\n\
                 [output]\nnodes = [\"b0@end\", \"b1@start\"]\ncolumns = [\"u\", \"reaction\"]\n",
                -force * force_unit,
                radius * length_unit,
                random.range(1.0, 3.99).floor()
            );
        let simulation = simulate(&text);
        let between = force * (3.0 - short) / (2.0 * short) * bending[1] / (bending[0] + bending[1]);
        let tip = -(force / 3.0 - between * short * short * (3.0 - short) / 6.0) / bending[0];
        let off = |found: f64, exact: f64| (found / exact - 1.0).abs();
        let of_tip = off(simulation.end("b0@end.uz") / length_unit, tip);
        let of_root = off(simulation.end("b1@start.my") / (length_unit * force_unit), -between * short);
        worst = worst.max(of_tip).max(of_root);
        assert!(of_tip.max(of_root) < 1e-3, "{of_tip} {of_root}\n{text}");
    }
    println!("largest error: {worst:e}");
}

/// Friction takes too little energy at reversals, by what the run says.
fn loses_at_reversals(run: &Simulation) -> bool {
    let mut soft = run.counters.findings.warnings.iter().filter(|warning| warning.kind == WarningKind::SoftStick);
    soft.any(|warning| warning.message.contains("to and fro"))
}

/// A body that is pressed on a plane, dragged one way by a tenth of its radius, and lifted off turns nowhere.
#[test]
fn what_slides_one_way_and_lifts_off_loses_nothing() {
    for dragged in [0.01, 0.1] {
        let run = simulate(&format!(
            "[point]\np = [0, 0, 0.1]\n[[body]]\nat = \"p\"\nmass = 1\n[[spring]]\nat = \"p\"\nstiffness = [0, 0, 100, 0, 0, 0]\n\
             [[support]]\nat = \"p\"\nfix = [\"uy\", \"rx\", \"ry\", \"rz\"]\n[history.press]\ntimes = [0, 0.2, 0.6, 1]\n\
             values = [0, 1, 1, -1]\n[history.drag]\ntimes = [0, 0.2, 0.6, 1]\nvalues = [0, 0, 1, 1]\n\
             [[load]]\nat = \"p\"\nforce = [0, 0, -10]\nhistory = \"press\"\n\
             [[motion]]\nat = \"p\"\nux = {dragged}\nhistory = \"drag\"\n\
             [[surface]]\nname = \"floor\"\nkind = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n\
             [[contact]]\nname = \"c\"\nnodes = [\"p\"]\nsurfaces = [\"floor\"]\nradius = 0.1\nfriction = 0.3\nstiffness = 1e4\n\
             [[stage]]\nkind = \"static\"\nsteps = 20\n[output]\nnodes = [\"p\"]\ncolumns = [\"u\", \"energy\"]\n"
        ));
        let (taken, up) = (run.end("energy.friction"), run.end("p.uz"));
        assert!(up > 0.05 && taken > 2.0 * dragged, "{up} {taken}");
        assert!(!loses_at_reversals(&run), "{dragged}");
    }
}

/// Two equal leaves with clamped roots, pressed on each other by a line load q, whose tips go from 0 to w and to -w. Both
/// together have four times the stiffness of leaves that slide, until friction holds no more: P1 = 2 mu q r of the force
/// P0 = 6 EI w/L^3. The loop takes 3 w P1 [1 - P1/(3 P0)]. What the springs of friction give is told.
#[test]
fn loops_of_leaves_that_lose_too_little_are_told() {
    let mut random = Random::new(31);
    let mut worst = 0.0f64;
    for case in 0..6 {
        let [length, bending] = [10f64.powf(random.range(-1.0, 1.0)), 10f64.powf(random.range(-2.0, 3.0))];
        let radius = length * random.range(0.004, 0.0075);
        let friction = random.range(0.1, 0.5);
        let (order, elements) = [(1, 60), (2, 40), (3, 20)][case % 3];
        let way = 0.02 * length;
        let free = 6.0 * bending * way / length.powi(3);
        let slip = free * random.range(0.1, 0.7);
        let press = slip / (2.0 * friction * radius);
        let leaf = |name: &str, side: f64| {
            format!(
                "[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = [[0, 0, {z}], [{length}, 0, {z}]]\n\
                 elements = {elements}\norder = {order}\n[[support]]\nat = \"{name}@start\"\nfix = \"all\"\n\
                 [[load]]\nalong = \"{name}\"\nframe = \"body\"\nforce = [0, 0, {}]\n",
                -side * press,
                z = side * radius,
            )
        };
        let axial = 3.0 * bending / (radius * radius);
        let text = |stick: f64| {
            format!(
                "[effects]\nplanar = true\n[section.s]\nEA = {axial}\nGA = {}\nGJ = {bending}\nEI = {bending}\n{}{}\
                 [history.h]\ntimes = [0, 0.3333333333333333, 1]\nvalues = [0, 1, -1]\n\
                 [[motion]]\nat = \"u@end\"\nuz = {way}\nhistory = {{ name = \"h\", stages = [2] }}\n\
                 [[contact]]\nname = \"k\"\nbeams = [\"u\"]\nwith = [\"l\"]\nradius = {radius}\nfriction = {friction}\n\
                 stick = {stick}\nends = \"none\"\n[[stage]]\nkind = \"static\"\nsteps = 1\n\
                 [[stage]]\nkind = \"static\"\nsteps = 36\n[output]\nnodes = []\ncolumns = [\"energy\"]\n",
                100.0 * axial,
                leaf("u", 1.0),
                leaf("l", -1.0),
            )
        };
        let exact = 3.0 * way * slip * (1.0 - slip / (3.0 * free));
        let [soft, firm] = [1.0, 10.0].map(|stick| simulate(&text(stick)));
        let [lost, of_firm] = [&soft, &firm].map(|run| 1.0 - run.end("energy.friction") / exact);
        println!(
            "order {order}, P1/P0 {:.2}: {lost:.3}, told {}; {of_firm:.3}, told {}",
            slip / free,
            loses_at_reversals(&soft),
            loses_at_reversals(&firm)
        );
        assert!(loses_at_reversals(&soft) || lost < 0.1, "{lost}\n{}", text(1.0));
        assert!(of_firm < 0.1 && !loses_at_reversals(&firm), "{of_firm}\n{}", text(10.0));
        worst = worst.max(lost);
    }
    assert!(worst > 0.2, "{worst}");
}

/// Turns of a coil that are apart by a diameter have no place in the tangent; those that are all but in contact have.
#[test]
fn turns_that_are_apart_are_not_listed() {
    for (gap, are_near) in [(2.0, false), (0.5, false), (0.1, true)] {
        let text = format!(
            "[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 0.6\nEI = 0.8\n[[beam]]\nname = \"coil\"\nsection = \"s\"\n\
             helix = {{ start = [10, 0, 0], axis = [0, 0, 1], pitch = {}, turns = 5 }}\nelements = 200\n\
             [[support]]\nat = \"coil@start\"\nfix = \"all\"\n[[contact]]\nname = \"c\"\nbeams = [\"coil\"]\nself = true\nradius = 1\n\
             [[stage]]\nkind = \"static\"\nsteps = 1\n",
            2.0 + gap
        );
        let (scene, _) = scene::from_text(&text).unwrap_or_else(|e| panic!("{e:?}"));
        let model = scene.plan.model;
        let mut state = model.rest();
        model.contacts().unwrap().list_pairs(&mut state);
        assert_eq!(!state.contacts.pairs.list.is_empty(), are_near, "{gap}: {} pairs", state.contacts.pairs.list.len());
    }
}
