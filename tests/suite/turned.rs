//! Every hard case, turned as a whole: the answer turns with it. These runs take minutes: `cargo test --release -- --ignored`.

use crate::decks::decks;
use crate::random::Random;
use beamsim::deck::{self, Axes, Deck, Diagnostic, Frame, Load, MotionWhat, Path, PointRef, SectionBody, SpringBody};
use beamsim::scene;
use beamsim_core::model::StageKind;
use beamsim_core::rotation::Rotation;
use beamsim_core::run::{Failure, Observer, Run, Snapshot};
use beamsim_core::tensor::{Mat3, Vec3};

/// Place and rotation of each node, at one row of the output.
struct Row {
    clock: f64,
    nodes: Vec<(Vec3, Mat3)>,
}

/// What a run came to: its name, its rows, and the size of the scene.
struct Outcome {
    name: String,
    rows: Vec<Row>,
    size: f64,
}

struct Rows(Outcome);

impl Observer for Rows {
    fn row(&mut self, at: &Snapshot) -> Result<(), Failure> {
        let slots = &at.model.charted(StageKind::Static).rotations;
        // The rotation of a node follows its displacement.
        let node = |&p: &u32| (at.state.q[p as usize - 1], Rotation::new(at.state.q[p as usize]).r);
        let nodes: Vec<(Vec3, Mat3)> = slots.iter().map(node).collect();
        self.0.size = nodes.iter().map(|(u, _)| u.norm()).fold(self.0.size.max(at.model.length), f64::max);
        self.0.rows.push(Row { clock: at.state.load + at.state.time, nodes });
        Ok(())
    }
}

fn run(deck: &Deck) -> Option<Outcome> {
    let mut diagnostics = Vec::new();
    let scene = scene::build(deck, &mut diagnostics)?;
    if !diagnostics.iter().all(Diagnostic::is_warning) {
        return None;
    }
    let mut rows = Rows(Outcome { name: String::new(), rows: Vec::new(), size: 0.0 });
    let (result, _) = Run::new(scene.plan, &mut rows).finish();
    rows.0.name = result.map_or_else(|failure| failure.name().to_string(), |()| "finished".into());
    (!rows.0.rows.is_empty()).then_some(rows.0)
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
    let named = |name: &str| deck.points.iter().find(|(known, _)| known.value == name);
    let place = |point: &PointRef| match point {
        PointRef::Coordinates(x) => Vec3(*x),
        // A name that the deck was refused for stands nowhere.
        PointRef::Name(name) => named(name).map_or(Vec3::ZERO, |(_, x)| Vec3(*x)),
    };
    place(b) - place(a)
}

/// Axis 3 of straight beams is z by default, or y along z; both must be said before the deck is turned. `None` where the pieces
/// of a beam differ in that and its section is not round.
fn with_axes(mut deck: Deck) -> Option<Deck> {
    let plain = deck.clone();
    for beam in &mut deck.beams {
        if beam.axis3.is_some() {
            continue;
        }
        if let Path::Spline(_) = &beam.path {
            beam.axis3 = Some(deck::Spanned { value: Vec3::UNIT[2].0, span: beam.span.clone() });
        }
        let Path::Through(points) = &beam.path else { continue };
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
            Path::Helix(helix) => {
                turn_place(q, &mut helix.start.value);
                turn_place(q, &mut helix.centre.value);
                helix.axis = turned(q, helix.axis);
            }
            Path::Spline(spline) => {
                spline.points.iter_mut().for_each(|p| turn_place(q, &mut p.value));
                let tangents = spline.tangents.iter_mut().flat_map(|tangents| &mut tangents.value);
                tangents.for_each(|tangent| *tangent = turned(q, *tangent));
            }
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

/// The same deck with each coordinate of its points off by up to two units in its last place.
fn jittered(mut deck: Deck, random: &mut Random) -> Deck {
    for (_, x) in &mut deck.points {
        x.iter_mut().for_each(|x| *x *= 1.0 + 2.0 * f64::EPSILON * random.range(-1.0, 1.0));
    }
    deck
}

/// How far apart two runs are in each of their rows, over the size of the scene, when the second is seen turned back by `q`. Where
/// a path is followed its rows lie where round-off puts them: they are compared where both are at the same load.
fn differences(one: &Outcome, other: &Outcome, q: Mat3) -> Vec<f64> {
    let node = |((u, r), (v, s)): (&(Vec3, Mat3), &(Vec3, Mat3))| {
        let (moved, turned) = (*v - q * *u, *s - q * *r * q.transpose());
        (moved.norm() / one.size).max(turned.max_abs())
    };
    let together = |a: &Row, b: &Row| (a.clock - b.clock).abs() <= 1e-12 * a.clock.abs();
    let row = |(a, b): (&Row, &Row)| match together(a, b) {
        true => a.nodes.iter().zip(&b.nodes).map(node).fold(0.0, f64::max),
        false => 0.0,
    };
    let mut all: Vec<f64> = one.rows.iter().zip(&other.rows).map(row).collect();
    // The last rows are at the same load, however many come before.
    let last = one.rows.last().zip(other.rows.last()).map(row);
    all.last_mut().zip(last).into_iter().for_each(|(of_row, last)| *of_row = last);
    all
}

/// Whether two runs ended alike: at the same load or time and, but for paths, in the same number of rows.
fn alike(one: &Outcome, other: &Outcome) -> Result<(), String> {
    let end = |outcome: &Outcome| (outcome.name.clone(), outcome.rows.len(), outcome.rows.last().unwrap().clock);
    let ((name, count, clock), (other_name, other_count, other_clock)) = (end(one), end(other));
    let path = one.rows.iter().zip(&other.rows).any(|(a, b)| a.clock != b.clock);
    let together = name == other_name && clock == other_clock && (count == other_count || path);
    if together { Ok(()) } else { Err(format!("{:?}, turned {:?}", end(one), end(other))) }
}

/// What turning a deck came to, row by row: the worst difference from the plain run, and what two units in the last place of the
/// points change in a turned one.
struct Turned {
    clocks: Vec<f64>,
    worst: Vec<f64>,
    round_off: Vec<f64>,
}

fn raise(worst: &mut [f64], by: &[f64]) {
    worst.iter_mut().zip(by).for_each(|(worst, &by)| *worst = worst.max(by));
}

fn turn_one(deck: &Deck, plain: &Outcome, orientations: usize, seed: u64) -> Result<Turned, String> {
    let mut random = Random::new(seed);
    let zero = vec![0.0; plain.rows.len()];
    let clocks = plain.rows.iter().map(|row| row.clock).collect();
    let mut all = Turned { clocks, worst: zero.clone(), round_off: zero };
    for k in 0..orientations {
        let q = Rotation::new(random.vector(3.0)).r;
        let deck = turn(deck.clone(), q);
        let other = run(&deck).ok_or("refused when turned")?;
        alike(plain, &other)?;
        raise(&mut all.worst, &differences(plain, &other, q));
        if k < 2 {
            let off = run(&jittered(deck, &mut random)).ok_or("refused when off by round-off")?;
            raise(&mut all.round_off, &differences(&other, &off, Mat3::IDENTITY));
        }
    }
    Ok(all)
}

/// Turns a deck in half of the orientations on each of two threads.
fn turn_twice(deck: &Deck, plain: &Outcome, orientations: usize) -> Result<Turned, String> {
    let half = |seed| move || turn_one(deck, plain, orientations / 2, seed);
    let (one, two) = std::thread::scope(|threads| {
        let other = threads.spawn(half(12));
        (half(11)(), other.join().unwrap())
    });
    let (mut one, two) = (one?, two?);
    raise(&mut one.worst, &two.worst);
    raise(&mut one.round_off, &two.round_off);
    Ok(one)
}

/// A deck whose answer depends on round-off more than its tolerance tells.
struct Sensitive {
    name: &'static str,
    /// The ordinary tolerance holds up to this clock,
    until: f64,
    /// and this one beyond it; none where the motion is chaotic, which two units in the last place of the points must show.
    then: Option<f64>,
}

const SENSITIVE: [Sensitive; 13] = [
    // Axial stiffness 1e6, 1e7 times the rotary inertia: the round-off of forces turns the beam.
    Sensitive { name: "d05_beam_own_axis_100_turns", until: 50.0, then: Some(1e-7) },
    // Axial stiffness 1e10 on a mass of 20: the round-off of forces alone is 3e-6.
    Sensitive { name: "d08_stiff_pendulum", until: 20.0, then: Some(1e-7) },
    Sensitive { name: "d08_stiff_pendulum_h01", until: 3.0, then: Some(1e-6) },
    // RunExtras the cliff of the trapezoidal rule
    Sensitive { name: "d10_spin_up_newmark", until: 10.0, then: None },
    Sensitive { name: "d10_spin_up_rho_09", until: 15.0, then: None },
    // A double pendulum, in effect
    Sensitive { name: "d14_robot_arm_60", until: 18.0, then: None },
    Sensitive { name: "d14_robot_arm_60_rho_half", until: 18.0, then: None },
    // Rows at and beyond the limit point: what the load leaves open by its last digit is open by the root of that in the displacement.
    Sensitive { name: "s01_lee_one_level", until: f64::NEG_INFINITY, then: Some(5e-8) },
    Sensitive { name: "s01_lee_plain_static", until: f64::NEG_INFINITY, then: Some(5e-8) },
    Sensitive { name: "s01_lee_skew", until: f64::NEG_INFINITY, then: Some(5e-8) },
    // A wire compressed a thousand times beyond buckling: what is off its axis grows. By its own unit of time.
    Sensitive { name: "z08_megametre", until: 3e5, then: Some(1e-6) },
    Sensitive { name: "z08_micrometre", until: 1.0000003, then: Some(1e-6) },
    Sensitive { name: "z08_unity", until: 300.0, then: Some(1e-6) },
];

/// The answer of each deck, in each row, is the turned one to `tolerance`, but for [`SENSITIVE`] ones.
fn turn_all(families: &str, orientations: usize, tolerance: f64) {
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
        compared += 1;
        match turn_twice(&deck, &plain, orientations) {
            Ok(turned) => {
                let (line, holds) = turned.judge(&name, tolerance);
                eprintln!("{name}: {line}");
                if !holds {
                    wrong.push(format!("{name}: {line}"));
                }
            }
            Err(why) => wrong.push(format!("{name}: {why}")),
        }
    }
    assert!(compared > 0);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

impl Turned {
    fn judge(&self, name: &str, tolerance: f64) -> (String, bool) {
        let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let (worst, round_off) = (largest(&self.worst), largest(&self.round_off));
        let mut line = format!("{worst:.1e}, round-off {round_off:.1e}");
        if let Some(k) = self.worst.iter().position(|&worst| worst > tolerance) {
            line += &format!(", beyond {tolerance:.0e} from {} of {}", self.clocks[k], self.clocks.last().unwrap());
        }
        let sensitive = SENSITIVE.iter().find(|sensitive| sensitive.name == name);
        let chaotic = sensitive.is_some_and(|sensitive| sensitive.then.is_none());
        let limit = |clock: f64| match sensitive {
            Some(Sensitive { until, then, .. }) if clock > *until => then.unwrap_or(f64::INFINITY),
            _ => tolerance,
        };
        let holds = self.clocks.iter().zip(&self.worst).all(|(&clock, &worst)| worst <= limit(clock));
        (line, holds && (!chaotic || round_off > tolerance))
    }
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
