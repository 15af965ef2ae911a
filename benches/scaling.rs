//! Microseconds per element and Newton iteration, split into evaluation, assembly and solve, for chains of 10 to 100,000
//! elements in statics and dynamics.
//!
//! `cargo bench --bench scaling` prints the table; `-- --smoke` runs the small sizes only, `-- --elements 10000,1000000` these.

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
    let sizes = &sizes()[..];
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
