//! Every hard case, turned as a whole: the answer turns with it. These runs take minutes: `cargo test --release -- --ignored`.

use crate::decks::decks;
use crate::random::Random;
use beamsim::deck::{self, Axes, Deck, Frame, Load, MotionWhat, Path, PointRef, SectionBody, SpringBody};
use beamsim::drive::{Failure, Observer, Run, Snapshot};
use beamsim::rotation::Rotation;
use beamsim::scene;
use beamsim::tensor::{Mat3, Vec3};

/// What a run came to: its name, the last clock, and place and rotation of each node.
struct Outcome {
    name: String,
    load: f64,
    nodes: Vec<(Vec3, Mat3)>,
    size: f64,
}

struct Last(Option<Outcome>);

impl Observer for Last {
    fn row(&mut self, at: &Snapshot) -> Result<(), Failure> {
        let slots = &at.model.rotations;
        // The rotation of a node follows its displacement.
        let node = |&p: &u32| (at.state.q[p as usize - 1], Rotation::new(at.state.q[p as usize]).r);
        let nodes: Vec<(Vec3, Mat3)> = slots.iter().map(node).collect();
        let largest = nodes.iter().map(|(u, _)| u.norm()).fold(at.model.length, f64::max);
        self.0 = Some(Outcome { name: String::new(), load: at.state.load, nodes, size: largest });
        Ok(())
    }
}

fn run(deck: &Deck) -> Option<Outcome> {
    let scene = scene::build(deck, &mut Vec::new())?;
    let mut last = Last(None);
    let (result, _) = Run::new(scene.plan, &mut last).finish();
    let name = result.map_or_else(|failure| failure.name().to_string(), |()| "finished".into());
    last.0.map(|outcome| Outcome { name, ..outcome })
}

fn turned(q: Mat3, v: [f64; 3]) -> [f64; 3] {
    (q * Vec3(v)).0
}

fn axes(q: Mat3, axes: Option<Axes>) -> Option<Axes> {
    let [a, b] = axes.unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    Some([turned(q, a), turned(q, b)])
}

fn turn_place(q: Mat3, place: &mut PointRef) {
    if let PointRef::Coordinates(x) = place {
        *x = turned(q, *x);
    }
}

/// The direction of a piece of a beam.
fn direction(deck: &Deck, a: &PointRef, b: &PointRef) -> Vec3 {
    let place = |point: &PointRef| match point {
        PointRef::Coordinates(x) => Vec3(*x),
        PointRef::Name(name) => Vec3(deck.points.iter().find(|(known, _)| known.value == *name).unwrap().1),
    };
    place(b) - place(a)
}

/// Axis 3 of straight beams is z by default, or y along z; both must be said before the deck is turned. `None` where the pieces
/// of a beam differ in that and its section is not round.
fn with_axes(mut deck: Deck) -> Option<Deck> {
    let plain = deck.clone();
    for beam in &mut deck.beams {
        let Path::Through(points) = &beam.path else { continue };
        if beam.axis3.is_some() {
            continue;
        }
        let along_z = |pair: &[deck::Spanned<PointRef>]| {
            let d = direction(&plain, &pair[0].value, &pair[1].value);
            d.cross(Vec3::UNIT[2]).norm() < 1e-6 * d.norm()
        };
        let pieces: Vec<bool> = points.windows(2).map(along_z).collect();
        if pieces.iter().any(|&piece| piece != pieces[0]) {
            let sections =
                plain.sections.iter().filter(|s| beam.sections.iter().any(|name| name.value == s.name.value));
            let round = |section: &deck::Section| match &section.body {
                SectionBody::Resultants { stiffness: [_, ga2, ga3, _, ei2, ei3], .. } => ga2 == ga3 && ei2 == ei3,
                _ => false,
            };
            if !sections.into_iter().all(round) || beam.free_strain.is_some() {
                return None;
            }
        }
        let axis = if pieces[0] { Vec3::UNIT[1] } else { Vec3::UNIT[2] };
        let mixed = pieces.iter().any(|&piece| piece != pieces[0]);
        let value = if mixed { [0.31, 0.52, 0.79] } else { axis.0 };
        beam.axis3 = Some(deck::Spanned { value, span: beam.span.clone() });
    }
    Some(deck)
}

/// The deck as seen from a frame that is turned by the inverse of `q`.
fn turn(mut deck: Deck, q: Mat3) -> Deck {
    deck.points.iter_mut().for_each(|(_, x)| *x = turned(q, *x));
    deck.gravity.iter_mut().for_each(|g| g.value = turned(q, g.value));
    for beam in &mut deck.beams {
        match &mut beam.path {
            Path::Through(points) => points.iter_mut().for_each(|p| turn_place(q, &mut p.value)),
            Path::Arc(points) => points.iter_mut().for_each(|p| turn_place(q, &mut p.value)),
        }
        beam.axis3.iter_mut().for_each(|axis| axis.value = turned(q, axis.value));
    }
    deck.supports.iter_mut().for_each(|support| support.axes = axes(q, support.axes));
    for motion in &mut deck.motions {
        match &mut motion.what {
            MotionWhat::Rotation { axis, .. } if motion.axes.is_none() => *axis = turned(q, *axis),
            _ => motion.axes = axes(q, motion.axes),
        }
    }
    for joint in &mut deck.joints {
        joint.axes.iter_mut().for_each(|axis| *axis = turned(q, *axis));
        if let deck::JointParts::Nodes { at: Some(at), .. } = &mut joint.parts {
            turn_place(q, &mut at.value);
        }
    }
    for body in &mut deck.bodies {
        body.offset = turned(q, body.offset);
        body.inertia = body.inertia.map(|j| (q * Mat3(j) * q.transpose()).0);
    }
    for spring in &mut deck.springs {
        if let SpringBody::Ground { axes: own, .. } = &mut spring.body {
            *own = axes(q, *own);
        }
    }
    deck.loads.iter_mut().for_each(|load| turn_load(q, load));
    for initial in &mut deck.initials {
        (initial.velocity, initial.spin) = (turned(q, initial.velocity), turned(q, initial.spin));
        initial.about.iter_mut().for_each(|about| turn_place(q, &mut about.value));
    }
    for frame in deck.stages.iter_mut().filter_map(|stage| stage.frame.as_mut()) {
        frame.spin = turned(q, frame.spin);
        frame.about.iter_mut().for_each(|about| turn_place(q, &mut about.value));
    }
    deck
}

fn turn_load(q: Mat3, load: &mut Load) {
    if matches!(load.frame, Frame::Section) {
        return;
    }
    for vector in [&mut load.force, &mut load.moment].into_iter().flatten() {
        (vector.start, vector.end) = (turned(q, vector.start), turned(q, vector.end));
    }
}

/// The largest difference between a run and what the plain one turns into, over the size of the scene.
fn difference(plain: &Outcome, other: &Outcome, q: Mat3) -> f64 {
    let one = |((u, r), (v, s)): (&(Vec3, Mat3), &(Vec3, Mat3))| {
        let (moved, turned) = (*v - q * *u, *s - q * *r * q.transpose());
        (moved.norm() / plain.size).max(turned.max_abs())
    };
    plain.nodes.iter().zip(&other.nodes).map(one).fold(0.0, f64::max)
}

fn turn_all(families: &str, orientations: usize, tolerance: f64) {
    let mut random = Random::new(11);
    let mut wrong = Vec::new();
    let mut compared = 0;
    for path in decks("decks/hard") {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        // A row that ends a stage is the first beyond a bound on a component, which turns.
        let until = text.contains("until =");
        if !name.starts_with(|c| families.contains(c)) || until {
            continue;
        }
        let Ok((mut deck, _)) = deck::read(&text) else { continue };
        deck.expects.clear();
        let Some(deck) = with_axes(deck) else { continue };
        let Some(plain) = run(&deck) else { continue };
        let mut worst = 0.0_f64;
        for _ in 0..orientations {
            let q = Rotation::new(random.vector(3.0)).r;
            let Some(other) = run(&turn(deck.clone(), q)) else {
                wrong.push(format!("{name}: refused when turned"));
                break;
            };
            if other.name != plain.name || other.load != plain.load {
                wrong
                    .push(format!("{name}: {} at {}, turned {} at {}", plain.name, plain.load, other.name, other.load));
                break;
            }
            worst = worst.max(difference(&plain, &other, q));
        }
        compared += 1;
        eprintln!("{name}: {worst:.1e}");
        if worst > tolerance {
            wrong.push(format!("{name}: {worst:.1e}"));
        }
    }
    assert!(compared > 0);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[ignore = "minutes"]
fn hard_statics_turn_with_their_frame() {
    turn_all("lrs", 20, 1e-8);
}

#[test]
#[ignore = "minutes"]
fn hard_motions_turn_with_their_frame() {
    turn_all("cdz", 20, 1e-8);
}
