//! Scenes that can move without any force must be named, by a node that moves and the direction in which it does; scenes that
//! are held, however softly, must not.

use crate::random::Random;
use crate::scenes::{attempt, simulate};
use beamsim_core::model::SlotKind;
use beamsim_core::rotation::Rotation;
use beamsim_core::run::Failure;
use beamsim_core::tensor::{Mat3, Vec3};

/// A rigid motion of a part of the scene: about a point and an axis, or along a direction.
enum Free {
    Turns { about: Vec3, axis: Vec3 },
    Slides { along: Vec3 },
}

impl Free {
    /// What it does to a node at `place`.
    fn at(&self, place: Vec3) -> (Vec3, Vec3) {
        match self {
            Self::Turns { about, axis } => (axis.cross(place - *about), *axis),
            Self::Slides { along } => (*along, Vec3::ZERO),
        }
    }
}

/// A deck in a frame of its own, and what can move in it: names of nodes begin with one of `parts`, which move so.
struct Mechanism {
    deck: String,
    parts: Vec<&'static str>,
    free: Vec<Free>,
}

/// The part of `direction` outside of the span of `motions`.
fn outside(direction: Vec3, motions: &[Vec3]) -> f64 {
    let mut rest = direction;
    let mut basis: Vec<Vec3> = Vec::new();
    for motion in motions {
        let new = basis.iter().fold(*motion, |m, b| m - *b * b.dot(m));
        if new.norm() > 1e-9 * motion.norm().max(1e-30) {
            basis.push(new * (1.0 / new.norm()));
        }
    }
    basis.iter().for_each(|b| rest = rest - *b * b.dot(rest));
    rest.norm()
}

fn text(v: Vec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.0[0], v.0[1], v.0[2])
}

/// A straight beam from a to b along the first axis of `q`, 2 long.
fn beam(q: Mat3, elements: usize, order: usize, slenderness: f64) -> String {
    let (ea, half) = (12.0 * slenderness * slenderness, 5.0 * slenderness * slenderness);
    format!(
        "[point]\na = [0, 0, 0]\nb = {}\n[section.s]\nEA = {ea:e}\nGA = {half:e}\nGJ = 0.8\nEI = 1\n\
         [[beam]]\nname = \"m\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = {elements}\norder = {order}\n",
        text(q.column(0) * 2.0)
    )
}

fn support(at: &str, fix: &str, q: Mat3) -> String {
    let fix = if fix == "all" || fix == "pin" { format!("\"{fix}\"") } else { format!("[{fix}]") };
    let axes = if fix.starts_with('[') {
        format!("axes = [{}, {}]\n", text(q.column(0)), text(q.column(1)))
    } else {
        String::new()
    };
    format!("[[support]]\nat = \"{at}\"\nfix = {fix}\n{axes}")
}

const STAGE: &str = "[[stage]]\nkind = \"static\"\nsteps = 1\n";

/// One of eleven kinds, in a random orientation, on a random mesh.
fn mechanism(kind: usize, random: &mut Random) -> Mechanism {
    let q = Rotation::new(random.vector(3.0)).r;
    let pick = |choices: &[usize], random: &mut Random| choices[random.range(0.0, choices.len() as f64) as usize];
    let elements = pick(&[1, 3, 10, 40], random);
    let order = pick(&[1, 2, 3], random);
    let slenderness = [10.0, 100.0, 1e3][pick(&[0, 1, 2], random)];
    let beam = beam(q, elements, order, slenderness);
    let (origin, end) = (Vec3::ZERO, q.column(0) * 2.0);
    let turns = |about: Vec3, k: usize| Free::Turns { about, axis: q.column(k) };
    let slides = |k: usize| Free::Slides { along: q.column(k) };
    let all = vec!["a", "b", "m"];
    let (rest, parts, free) = match kind {
        // Nothing holds it at all.
        0 => (String::new(), all, (0..3).flat_map(|k| [turns(origin, k), slides(k)]).collect()),
        // A pendulum.
        1 => (support("a", "pin", q), all, (0..3).map(|k| turns(origin, k)).collect()),
        // Between two pins it spins about its axis, as a moment asks it to.
        2 => {
            let load = format!("[[load]]\nat = \"b\"\nmoment = {}\n", text(q.column(0)));
            (support("a", "pin", q) + &support("b", "pin", q) + &load, all, vec![turns(origin, 0)])
        }
        // Rollers that all roll the same way.
        3 => {
            let rollers = support("a", "\"uy\", \"uz\", \"rx\"", q) + &support("b", "\"uy\", \"uz\"", q);
            (rollers, all, vec![slides(0)])
        }
        // A hinge about the third axis.
        4 => (support("a", "\"ux\", \"uy\", \"uz\", \"rx\", \"ry\"", q), all, vec![turns(origin, 2)]),
        // A guide at one end, along the second axis.
        5 => (support("a", "\"ux\", \"uz\", \"rx\", \"ry\", \"rz\"", q), all, vec![slides(1)]),
        // Three collinear joints: the middle falls through, each half about its end.
        6 => {
            let rest = format!(
                "[[beam]]\nname = \"n\"\nsection = \"s\"\nthrough = [\"b\", \"c\"]\nelements = {elements}\n\
                 [[joint]]\nkind = \"spherical\"\nat = \"b\"\nbeams = [\"m\", \"n\"]\n"
            );
            let held = support("a", "pin", q) + &support("c", "pin", q);
            let halves = [0, 1, 2].map(|k| turns(origin, k)).into_iter().chain([0, 1, 2].map(|k| turns(end * 2.0, k)));
            (rest + &held, vec!["a", "b", "c", "m", "n"], halves.collect())
        }
        // A revolute joint to ground.
        7 => {
            let rest = format!("[[joint]]\nkind = \"revolute\"\nnodes = [\"a\"]\naxis = {}\n", text(q.column(1)));
            (rest, all, vec![turns(origin, 1)])
        }
        // A prismatic joint to ground.
        8 => {
            let rest = format!("[[joint]]\nkind = \"prismatic\"\nnodes = [\"a\"]\naxis = {}\n", text(q.column(2)));
            (rest, all, vec![slides(2)])
        }
        // A cylindrical joint to ground.
        10 => {
            let rest = format!("[[joint]]\nkind = \"cylindrical\"\nnodes = [\"a\"]\naxis = {}\n", text(q.column(1)));
            (rest, all, vec![turns(origin, 1), slides(1)])
        }
        // Springs hold the displacements of one end only.
        _ => {
            let rest = "[[spring]]\nat = \"a\"\nstiffness = [5, 6, 7, 0, 0, 0]\n".to_string();
            (rest, all, (0..3).map(|k| turns(origin, k)).collect())
        }
    };
    // The second half of three joints in a row.
    let beam = match kind {
        6 => beam.replacen("[point]\n", &format!("[point]\nc = {}\n", text(end * 2.0)), 1),
        _ => beam,
    };
    Mechanism { deck: format!("{beam}{rest}{STAGE}"), parts, free }
}

/// Where a node is: at an end, or along the beam by its name.
fn place_of(node: &str, deck: &str) -> Vec3 {
    let (scene, _) = beamsim::scene::from_text(deck).unwrap_or_else(|d| panic!("{d:?}\n{deck}"));
    let node = (0..scene.mesh.nodes.len()).find(|&n| scene.mesh.name_of(n) == node).map(|n| &scene.mesh.nodes[n]);
    node.unwrap_or_else(|| panic!("no such node")).place
}

#[test]
fn mechanisms_are_named_by_node_and_direction() {
    let mut random = Random::new(4);
    for (number, kind) in (0..50).map(|number| number % 10).chain([10; 5]).enumerate() {
        let Mechanism { deck, parts, free } = mechanism(kind, &mut random);
        let failure = attempt(&deck).result.expect_err(&deck);
        let Failure::Singular { place: Some(place), .. } = &failure else { panic!("{number}: {failure}\n{deck}") };
        assert!(parts.iter().any(|part| place.node.starts_with(part)), "{number}: {failure}\n{deck}");
        let at = place_of(&place.node, &deck);
        // Of three joints in a row each half turns about its own end.
        let own = match (kind, place.node.starts_with(['n', 'c'])) {
            (6, false) => &free[..3],
            (6, true) => &free[3..],
            _ => &free[..],
        };
        let motions = own.iter().map(|motion| motion.at(at));
        let span: Vec<Vec3> = motions.map(|(u, p)| if place.kind == SlotKind::Rotation { p } else { u }).collect();
        let off = outside(place.direction, &span);
        assert!(off < 1e-4, "{number}: {failure}: off by {off:.1e}\n{deck}");
    }
}

/// A beam between pins that only a soft spring keeps from spinning.
#[test]
fn what_a_soft_spring_holds_is_no_mechanism() {
    for (soft, most) in [(1e-6, 1e3), (1e-3, 1e5), (1.0, 1e5)] {
        for slenderness in [10.0, 1e3, 1e5].into_iter().filter(|&slenderness| slenderness <= most) {
            let q = Rotation::new(Vec3([0.3, -0.8, 0.5])).r;
            let deck = format!(
                "{}{}{}[[spring]]\nat = \"b\"\nstiffness = [0, 0, 0, {soft:e}, {soft:e}, {soft:e}]\n\
                 [[load]]\nat = \"b\"\nmoment = {}\n{STAGE}",
                beam(q, 10, 1, slenderness),
                support("a", "pin", q),
                support("b", "pin", q),
                text(q.column(0) * soft)
            );
            // One radian about its axis.
            let turned = simulate(&deck).vector("b.r");
            let expected = q.column(0);
            for (k, turned) in turned.into_iter().enumerate() {
                assert!((turned - expected.0[k]).abs() < 1e-6, "{soft} {slenderness}: {turned} for {}", expected.0[k]);
            }
        }
    }
}
