//! Runs decks through the library and keeps every converged row.

use beamsim::scene;
use beamsim_core::probe::Probe;
use beamsim_core::run::{Counters, Failure, Mode, Observer, Run, Snapshot, StageResult};
use beamsim_core::tensor::Vec3;

/// A run with all its rows.
pub struct Simulation {
    pub names: Vec<String>,
    pub rows: Vec<Vec<f64>>,
    pub result: Result<(), Failure>,
    pub counters: Counters,
    /// What is proposed where it has failed
    pub hint: Option<String>,
}

struct Collector {
    probes: Vec<Probe>,
    rows: Vec<Vec<f64>>,
}

impl Observer for Collector {
    fn row(&mut self, snapshot: &Snapshot) -> Result<(), Failure> {
        let mut row = vec![snapshot.state.load];
        self.probes.iter().for_each(|probe| probe.read(snapshot, &mut row));
        self.rows.push(row);
        Ok(())
    }
}

/// Keeps what modal and buckling stages find.
#[derive(Default)]
struct Results(Vec<StageResult>);

impl Observer for Results {
    fn row(&mut self, _snapshot: &Snapshot) -> Result<(), Failure> {
        Ok(())
    }

    fn found(&mut self, _stage: usize, result: &StageResult) -> Result<(), Failure> {
        self.0.push(result.clone());
        Ok(())
    }
}

/// What the modal and buckling stages of a deck find, which must finish.
pub fn results(text: &str) -> Vec<StageResult> {
    let (scene, _) = scene::from_text(text).unwrap_or_else(|found| panic!("{}\n{text}", found[0].message));
    let mut found = Results::default();
    let (result, _) = Run::new(scene.plan, &mut found).finish();
    assert!(result.is_ok(), "{result:?}\n{text}");
    found.0
}

/// The modes of all modal stages of a deck, which must finish.
pub fn modes(text: &str) -> Vec<Mode> {
    let of_stage = |result| match result {
        StageResult::Modes(modes) => modes,
        StageResult::CriticalLoads(_) => Vec::new(),
    };
    results(text).into_iter().flat_map(of_stage).collect()
}

/// Their frequencies.
pub fn frequencies(text: &str) -> Vec<f64> {
    modes(text).iter().map(|mode| mode.omega).collect()
}

/// A vector as decks write it.
pub fn list(v: Vec3) -> String {
    let [x, y, z] = v.0;
    format!("[{x:?}, {y:?}, {z:?}]")
}

/// Runs a deck, however it ends.
pub fn attempt(text: &str) -> Simulation {
    let (scene, _) = scene::from_text(text).unwrap_or_else(|diagnostics| {
        let all: Vec<String> = diagnostics.iter().map(|d| d.render("deck", text, false)).collect();
        panic!("{}", all.join("\n"))
    });
    let mut collector = Collector { probes: scene.probes.clone(), rows: Vec::new() };
    let (result, counters) = Run::new(scene.plan.clone(), &mut collector).finish();
    let hint = result.as_ref().err().and_then(|failure| failure.hint(&scene.plan));
    let columns = collector.probes.iter().flat_map(|probe| probe.names.clone());
    let names = std::iter::once("load".to_string()).chain(columns).collect();
    Simulation { names, rows: collector.rows, result, counters, hint }
}

/// What is said of a deck that is refused.
pub fn refusal(text: &str) -> String {
    match scene::from_text(text) {
        Ok(_) => panic!("the deck is accepted:\n{text}"),
        Err(found) => found.iter().map(|d| d.render("deck", text, false)).collect::<Vec<_>>().join("\n"),
    }
}

/// What a deck that is accepted is warned of.
pub fn warnings(text: &str) -> Vec<String> {
    match scene::from_text(text) {
        Ok((_, found)) => found.into_iter().map(|d| d.message).collect(),
        Err(_) => panic!("{}", refusal(text)),
    }
}

/// Runs a deck that must finish.
pub fn simulate(text: &str) -> Simulation {
    let simulation = attempt(text);
    if let Err(failure) = &simulation.result {
        panic!("{failure}\n{text}");
    }
    simulation
}

impl Simulation {
    /// The last value of a column.
    pub fn end(&self, column: &str) -> f64 {
        self.column(column).last().copied().expect("a run has rows")
    }

    /// All values of a column.
    pub fn column(&self, column: &str) -> Vec<f64> {
        let k = self.names.iter().position(|name| name == column).unwrap_or_else(|| panic!("no column {column}"));
        self.rows.iter().map(|row| row[k]).collect()
    }

    /// The last values of three columns: `tip.u` with x, y, z.
    pub fn vector(&self, prefix: &str) -> [f64; 3] {
        ["x", "y", "z"].map(|axis| self.end(&format!("{prefix}{axis}")))
    }
}

/// The largest difference of two vectors.
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

/// The tip of the 45-degree bend (Bathe & Bolourchi 1979, doi:10.1002/nme.1620140703) with GJ = 0.141 G, drawn from the
/// first of its `ends` to the second.
pub fn bend45(order: usize, elements: usize, ends: [&str; 2], interpolation: &str) -> [f64; 3] {
    let [start, end] = ends;
    let text = format!(
        r#"
[point]
root = [0, 0, 0]
tip = ["100*sin(45*deg)", "100*(1-cos(45*deg))", 0]
[section.s]
EA = 1e7
GA = 5e6
GJ = 7.05e5
EI = "1e7/12"
[[beam]]
name = "b"
section = "s"
arc = ["{start}", ["100*sin(22.5*deg)", "100*(1-cos(22.5*deg))", 0], "{end}"]
elements = {elements}
order = {order}
interpolation = "{interpolation}"
axis3 = [0, 0, 1]
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [0, 0, 600]
[[stage]]
kind = "static"
steps = 2
tolerance = 1e-11
"#
    );
    simulate(&text).vector("tip.u")
}
