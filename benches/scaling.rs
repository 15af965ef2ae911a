//! Microseconds per element and Newton iteration, split into evaluation, assembly and solve, for chains of 10 to 100,000
//! elements in statics and dynamics; then what points in contact and lists of near elements cost.
//!
//! `cargo bench --bench scaling` prints the table; `-- --smoke` runs the small sizes only, `-- --elements 10000,1000000` these,
//! `-- --contacts` contacts alone.

use beamsim::scene;
use beamsim_core::effect::RoundOff;
use beamsim_core::kernel::{ElementSystem, Weights};
use beamsim_core::model::{Assembly, Model, Schedule, StageContext, StageKind};
use beamsim_core::run::{Failure, Observer, Run, Snapshot};
use beamsim_core::solve::{Convergence, LinearSolver};
use beamsim_core::system::ResidualBuffer;
use beamsim_core::tensor::Vec3;
use std::hint::black_box;
use std::time::Instant;

struct Silent;

impl Observer for Silent {
    fn row(&mut self, _snapshot: &Snapshot) -> Result<(), Failure> {
        Ok(())
    }
}

/// How rotations are interpolated in space, and the plane, where that does not matter.
const WAYS: [&str; 3] = ["total", "relative", "planar"];

/// A cantilever under a force across, in statics or starting to swing.
fn deck(elements: usize, dynamic: bool, way: &str) -> String {
    let (interpolation, planar) = if way == "planar" { ("relative", true) } else { (way, false) };
    let (stage, force) = if dynamic {
        ("kind = \"dynamic\"\nend = 0.05\nstep = 0.01", "[0, 0, 5]")
    } else {
        ("kind = \"static\"\nsteps = 4", "[0, 0, 50]")
    };
    format!(
        "[point]\nroot = [0, 0, 0]\ntip = [10, 0, 0]\n\
         [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1e3\nEI = 1e3\nrhoA = 1\nrhoJ = [2, 1, 1]\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = {elements}\n\
         interpolation = \"{interpolation}\"\n[[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = {force}\n[[stage]]\n{stage}\n\
         [effects]\nplanar = {planar}\n"
    )
}

/// Seconds that scattering one set of element systems takes.
fn assembly_seconds(model: &Model, kind: StageKind) -> f64 {
    let state = model.rest();
    let Ok(dof_map) = Schedule::new(model).begin_stage(model, 0, kind, &state) else { return 0.0 };
    let stage = StageContext { number: 0, kind, rotating: false };
    let effects = model.acting(&stage);
    let shapes: Vec<_> = effects.iter().map(|effect| effect.connectivity()).collect();
    let mut assembly = Assembly::new(&stage, dof_map, model);
    let mut scatter = || {
        let start = Instant::now();
        for (number, (effect, connectivity)) in effects.iter().zip(&shapes).enumerate() {
            let element = ElementSystem::new(connectivity.iter().next().map_or(1, <[u32]>::len));
            let mut sink = assembly.system.assembler(number, effect.category(), effect.tangent().exists());
            for k in 0..connectivity.len() {
                sink.add(k, black_box(&element));
            }
        }
        start.elapsed().as_secs_f64()
    };
    // The first pass meets memory that nobody has touched yet.
    scatter();
    scatter().min(scatter())
}

/// Seconds of the quickest of several runs of `part`.
fn quickest(mut part: impl FnMut()) -> f64 {
    let once = |_| {
        let start = Instant::now();
        part();
        start.elapsed().as_secs_f64()
    };
    (0..10).map(once).fold(f64::INFINITY, f64::min)
}

/// What an iteration is made of, in nanoseconds an element.
fn parts(elements: usize, dynamic: bool, interpolation: &str) {
    let (scene, _) =
        scene::from_text(&deck(elements, dynamic, interpolation)).unwrap_or_else(|_| panic!("the deck is good"));
    let model = scene.plan.model;
    let state = model.rest();
    let (kind, weights) = if dynamic {
        (StageKind::Dynamic, Weights { stiffness: 1.0, damping: 200.0, mass: 4e4 })
    } else {
        (StageKind::Static, Weights::STIFFNESS)
    };
    let Ok(dof_map) = Schedule::new(&model).begin_stage(&model, 0, kind, &state) else { return };
    let mut assembly = Assembly::new(&StageContext { number: 0, kind, rotating: false }, dof_map, &model);
    let tangent = quickest(|| assembly.evaluate(&state, weights, None));
    let force = quickest(|| assembly.evaluate(&state, Weights::NONE, None));
    assembly.evaluate(&state, weights, None);
    let increments = vec![Vec3([1e-9; 3]); state.q.len()];
    let extrapolate = quickest(|| assembly.extrapolate(&state, &increments));
    let Some(mut solver) = LinearSolver::new(&assembly.system, &[], 1.0) else { return };
    let system = &assembly.system;
    let factorise = quickest(|| assert!(solver.factorise(system)));
    let mut x = vec![1.0; system.pattern.dof_map.count()];
    let solve = quickest(|| assert!(solver.solve_once(system, &mut x)));
    let b = vec![1.0; x.len()];
    let mut room = ResidualBuffer::default();
    let residual = quickest(|| {
        black_box(system.residual(&b, &x, &mut room));
    });
    let convergence = Convergence { tolerance: 1e-8, negligible: 0.0 };
    let judge = quickest(|| {
        black_box(convergence.judge(&model, system, RoundOff::default(), None));
    });
    print!("{:<8} {interpolation:<9} {elements:>8}", if dynamic { "dynamic" } else { "static" });
    for seconds in [tangent, force, extrapolate, factorise, solve, residual, judge] {
        print!(" {:>9.1}", 1e9 * seconds / elements as f64);
    }
    println!();
}

fn row(elements: usize, dynamic: bool, interpolation: &str) {
    let (scene, _) =
        scene::from_text(&deck(elements, dynamic, interpolation)).unwrap_or_else(|_| panic!("the deck is good"));
    let kind = if dynamic { StageKind::Dynamic } else { StageKind::Static };
    let model = scene.plan.model.clone();
    let repeats = (20_000 / elements).max(1);
    let (mut evaluation, mut solve, mut iterations, mut evaluations) = (0.0, 0.0, 0, 0);
    for _ in 0..repeats {
        let (result, counters) = Run::new(scene.plan.clone(), &mut Silent).finish();
        if let Err(failure) = result {
            println!("{elements:>8}  {failure}");
            return;
        }
        evaluation += counters.work.evaluation_seconds;
        solve += counters.work.solve_seconds;
        iterations += counters.work.iterations;
        // Each converged step is evaluated once more than it is solved.
        evaluations += counters.work.iterations + counters.steps;
    }
    // In a plane elements are not scattered one by one.
    let scatter = if interpolation == "planar" { 0.0 } else { assembly_seconds(&model, kind) };
    let micro = 1e6 / elements as f64;
    let (evaluation, solve) = (evaluation * micro / evaluations as f64, solve * micro / iterations as f64);
    let assembly = scatter * micro;
    let name = if dynamic { "dynamic" } else { "static" };
    println!(
        "{name:<8} {interpolation:<9} {elements:>8} {:>11.3} {assembly:>9.3} {solve:>9.3} {:>9.3}   ({} iterations a run)",
        evaluation - assembly,
        evaluation + solve,
        iterations / repeats as u64
    );
}

/// The ground on which a beam lies with all its nodes, a little inside.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Ground {
    Plane,
    Cylinder,
    Beam,
}

/// The section and the beam `b` along a path, held at its start.
fn held_beam(path: &str, elements: usize) -> String {
    format!(
        "[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1e3\nEI = 1e3\n[[beam]]\nname = \"b\"\nsection = \"s\"\n{path}\n\
         elements = {elements}\n[[support]]\nat = \"b@start\"\nfix = \"all\"\n[[stage]]\nkind = \"static\"\nsteps = 1\n"
    )
}

/// A beam that lies on a ground, and the contact of both.
fn deck_in_contact(elements: usize, on: Ground, friction: f64) -> [String; 2] {
    let straight = held_beam("through = [[0, 0, 0], [10, 0, 0]]", elements);
    let (scene, parties) = match on {
        Ground::Plane => (
            format!(
                "{straight}[[surface]]\nname = \"f\"\nkind = \"plane\"\npoint = [0, 0, -0.0099999]\nnormal = [0, 0, 1]\n"
            ),
            "beams = [\"b\"]\nsurfaces = [\"f\"]",
        ),
        Ground::Cylinder => (
            held_beam("arc = [[-5, 0, 0], [0, 0, 5], [5, 0, 0]]", elements)
                + "[[surface]]\nname = \"f\"\nkind = \"cylinder\"\nfrom = [0, -1, 0]\nto = [0, 1, 0]\nradius = 4.9900001\n",
            "beams = [\"b\"]\nsurfaces = [\"f\"]",
        ),
        Ground::Beam => (
            format!(
                "{straight}[[beam]]\nname = \"under\"\nsection = \"s\"\nthrough = [[0, 0, -0.0199999], [10, 0, -0.0199999]]\n\
                 elements = {elements}\n"
            ),
            "beams = [\"b\"]\nwith = [\"under\"]",
        ),
    };
    [scene, format!("[[contact]]\nname = \"c\"\n{parties}\nradius = 0.01\nfriction = {friction}\n")]
}

/// Seconds of one evaluation of force and tangent, and of force alone, of a static stage at rest, where contacts have
/// found their points before.
fn evaluation_seconds(deck: &str) -> [f64; 2] {
    let (scene, _) = scene::from_text(deck).unwrap_or_else(|_| panic!("the deck is good"));
    let model = scene.plan.model;
    let mut state = model.rest();
    state.amplitude.fill(1.0);
    if let Some(contacts) = model.contacts() {
        contacts.list_pairs(&mut state);
        contacts.augment(&mut state);
    }
    let dof_map = Schedule::new(&model).begin_stage(&model, 0, StageKind::Static, &state);
    let dof_map = dof_map.unwrap_or_else(|_| panic!("the stage is good"));
    let stage = StageContext { number: 0, kind: StageKind::Static, rotating: false };
    let mut assembly = Assembly::about(&state, &stage, dof_map, &model);
    [Weights::STIFFNESS, Weights::NONE].map(|weights| quickest(|| assembly.evaluate(&state, weights, None)))
}

/// Prints nanoseconds a point of contact takes in an evaluation.
fn contact_row(elements: usize, on: Ground, friction: f64) {
    let [scene, contact] = deck_in_contact(elements, on, friction);
    let [without, with] = [scene.clone(), scene + &contact].map(|deck| evaluation_seconds(&deck));
    // Both beams have nodes that touch.
    let points = if on == Ground::Beam { 2 * elements } else { elements };
    print!("{:<9} {friction:>8} {points:>9}", format!("{on:?}").to_lowercase());
    for (with, without) in with.into_iter().zip(without) {
        print!(" {:>9.0}", 1e9 * (with - without) / points as f64);
    }
    println!();
}

/// Milliseconds for the list of near elements of a coil of wire whose turns lie close together.
fn list_row(elements: usize) {
    let turns = elements / 40;
    let helix =
        format!("helix = {{ start = [1, 0, 0], centre = [0, 0, 0], axis = [0, 0, 1], turns = {turns}, pitch = 0.11 }}");
    let contact = "[[contact]]\nname = \"c\"\nbeams = [\"b\"]\nself = true\nradius = 0.05\n";
    let deck = held_beam(&helix, elements) + contact;
    let (scene, _) = scene::from_text(&deck).unwrap_or_else(|_| panic!("the deck is good"));
    let model = scene.plan.model;
    let Some(contacts) = model.contacts() else { panic!("the coil touches itself") };
    let mut state = model.rest();
    let seconds = quickest(|| {
        state.contacts.pairs = Default::default();
        contacts.list_pairs(&mut state);
    });
    println!("{elements:>8} {:>9} {:>9.2}", state.contacts.pairs.list.len(), 1e3 * seconds);
}

/// The numbers of elements that are asked for.
fn sizes() -> Vec<usize> {
    let arguments: Vec<String> = std::env::args().collect();
    let place_of = |name: &str| arguments.iter().position(|argument| argument == name);
    if let Some(list) = place_of("--elements").and_then(|place| arguments.get(place + 1)) {
        return list.split(',').map(|size| size.parse().expect("a number of elements")).collect();
    }
    match place_of("--smoke").or(place_of("--test")) {
        Some(_) => vec![10, 100],
        None => vec![10, 100, 1_000, 10_000, 100_000],
    }
}

fn main() {
    let sizes = sizes();
    if !std::env::args().any(|argument| argument == "--contacts") {
        elements_table(&sizes);
    }
    contacts_table(&sizes);
}

fn elements_table(sizes: &[usize]) {
    println!("microseconds per element and iteration");
    println!(
        "{:<8} {:<9} {:>8} {:>11} {:>9} {:>9} {:>9}",
        "stage", "rotations", "elements", "evaluation", "assembly", "solve", "all"
    );
    for (dynamic, interpolation) in [false, true].into_iter().flat_map(|dynamic| WAYS.map(|way| (dynamic, way))) {
        sizes.iter().for_each(|&elements| row(elements, dynamic, interpolation));
    }
    println!("\nparts of an iteration, nanoseconds per element");
    print!("{:<8} {:<9} {:>8}", "stage", "rotations", "elements");
    ["tangent", "force", "predictor", "factorise", "solve", "residual", "judge"]
        .iter()
        .for_each(|name| print!(" {name:>9}"));
    println!();
    for (dynamic, interpolation) in [false, true].into_iter().flat_map(|dynamic| WAYS.map(|way| (dynamic, way))) {
        // Parts of ten elements are over before a clock ticks often enough.
        sizes.iter().filter(|&&elements| elements > 10).for_each(|&elements| parts(elements, dynamic, interpolation));
    }
}

fn contacts_table(sizes: &[usize]) {
    let largest = sizes.iter().copied().max().unwrap_or_default();
    let in_contact = largest.min(1_000);
    println!("\npoints in contact, nanoseconds per point");
    println!("{:<9} {:>8} {:>9} {:>9} {:>9}", "on", "friction", "points", "tangent", "force");
    for (on, friction) in
        [Ground::Plane, Ground::Cylinder, Ground::Beam].into_iter().flat_map(|on| [(on, 0.0), (on, 0.3)])
    {
        contact_row(in_contact, on, friction);
    }
    println!("\nlists of near elements of a coil, milliseconds");
    println!("{:>8} {:>9} {:>9}", "elements", "listed", "list");
    list_row(largest.min(20_000));
}
