//! Microseconds per element and Newton iteration, split into evaluation, assembly and solve, for chains of 10 to 100,000
//! elements in statics and dynamics.
//!
//! `cargo bench --bench scaling` prints the table; `-- --smoke` runs the small sizes only.

use beamsim::drive::{Failure, Observer, Run, Snapshot};
use beamsim::kernel::ElementSystem;
use beamsim::model::{Assembly, Model, StageContext, StageKind};
use beamsim::scene;
use std::hint::black_box;
use std::time::Instant;

struct Silent;

impl Observer for Silent {
    fn row(&mut self, _snapshot: &Snapshot) -> Result<(), Failure> {
        Ok(())
    }
}

/// A cantilever under a force across, in statics or starting to swing.
fn deck(elements: usize, dynamic: bool, interpolation: &str) -> String {
    let (stage, force) = if dynamic {
        ("kind = \"dynamic\"\nend = 0.05\nstep = 0.01", "[0, 0, 5]")
    } else {
        ("kind = \"static\"\nsteps = 4", "[0, 0, 50]")
    };
    format!(
        "[point]\nroot = [0, 0, 0]\ntip = [10, 0, 0]\n\
         [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1e3\nEI = 1e3\nrhoA = 1\nrhoJ = [2, 1, 1]\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = {elements}\n\
         interpolation = \"{interpolation}\"\n[[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = {force}\n[[stage]]\n{stage}\n"
    )
}

/// Seconds that scattering one set of element systems takes.
fn assembly_seconds(model: &Model, kind: StageKind) -> f64 {
    let mut model = model.clone();
    let state = model.rest();
    let Ok(equations) = model.begin_stage(0, kind, &state) else { return 0.0 };
    let effects = model.acting(&StageContext { number: 0, kind, rotating: false });
    let shapes: Vec<_> = effects.iter().map(|effect| effect.cliques()).collect();
    let mut assembly = Assembly::new(effects.clone(), equations, &model);
    let mut scatter = || {
        let start = Instant::now();
        for (number, (effect, cliques)) in effects.iter().zip(&shapes).enumerate() {
            let element = ElementSystem::new(cliques.iter().next().map_or(1, <[u32]>::len));
            let mut sink = assembly.system.sink(number, effect.category(), effect.has_tangent());
            for k in 0..cliques.len() {
                sink.add(k, black_box(&element));
            }
        }
        start.elapsed().as_secs_f64()
    };
    // The first pass meets memory that nobody has touched yet.
    scatter();
    scatter().min(scatter())
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
    let scatter = assembly_seconds(&model, kind);
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

fn main() {
    let smoke = std::env::args().any(|argument| argument == "--smoke" || argument == "--test");
    let sizes: &[usize] = if smoke { &[10, 100] } else { &[10, 100, 1_000, 10_000, 100_000] };
    println!("microseconds per element and iteration");
    println!(
        "{:<8} {:<9} {:>8} {:>11} {:>9} {:>9} {:>9}",
        "stage", "rotations", "elements", "evaluation", "assembly", "solve", "all"
    );
    for (dynamic, interpolation) in [(false, "total"), (false, "relative"), (true, "total"), (true, "relative")] {
        sizes.iter().for_each(|&elements| row(elements, dynamic, interpolation));
    }
}
