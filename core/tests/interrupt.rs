//! Requests to stop concern the whole process, so that they are tested in one of their own.

use beamsim_core::effect::{Effect, Energy, Roles, TangentForm};
use beamsim_core::interrupt;
use beamsim_core::kernel::Weights;
use beamsim_core::model::{Model, ModelBuilder, SectionMatrices, StraightBeam};
use beamsim_core::run::{Counters, Failure, Observer, Plan, Run, Snapshot, Stage, StageResult, StageWork};
use beamsim_core::system::{Assembler, Category, Connectivity, Memory, MirrorData, Slot, State};
use beamsim_core::tensor::Vec3;
use beamsim_core::threads;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

const SIGTERM: i32 = 15;

/// A column of many elements, with a force along it below its critical load.
fn column(elements: usize) -> Model {
    builder_of_column(elements).0.build().unwrap()
}

/// The builder of a column, and the displacement of its tip.
fn builder_of_column(elements: usize) -> (ModelBuilder, Slot) {
    let mut builder = ModelBuilder::new();
    let root = builder.node("root", Vec3([0.0, 0.0, 0.0]));
    let tip = builder.node("tip", Vec3([1.0, 0.0, 0.0]));
    let section = SectionMatrices::diagonal([1e5, 1e5, 1e5, 10.0, 10.0, 10.0]);
    builder
        .beam(StraightBeam { ends: [root, tip], section, axis3: Vec3([0.0, 0.0, 1.0]), elements, order: 2 })
        .unwrap();
    builder.clamp(root).unwrap();
    builder.force(tip, Vec3([-20.0, 0.0, 0.0])).unwrap();
    let slot = builder.slots(tip).unwrap().u;
    (builder, slot)
}

/// No force at one node, which counts evaluations and asks to stop at one of them.
struct Alarm {
    slot: Slot,
    /// The number of evaluations so far
    count: Arc<AtomicUsize>,
    /// The number of the evaluation at which it asks to stop
    at: Option<usize>,
}

impl Effect for Alarm {
    fn name(&self) -> &'static str {
        "alarm"
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        connectivity.push([self.slot]);
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::Symmetric
    }

    fn mirror_data(&self, _show: &mut dyn FnMut(MirrorData)) {}

    fn add(&self, _at: &State, _memory: &Memory, _weights: Weights, _out: &mut Assembler) {
        let number = self.count.fetch_add(1, Ordering::Relaxed);
        if self.at == Some(number) {
            interrupt::request(SIGTERM);
        }
    }

    fn energy(&self, _at: &State) -> Energy {
        Energy { kinetic: 0.0, strain: 0.0 }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}

/// A column that asks to stop at an evaluation, and the number of evaluations so far.
fn column_with_alarm(at: Option<usize>) -> (Model, Arc<AtomicUsize>) {
    let count = Arc::new(AtomicUsize::new(0));
    let (mut builder, slot) = builder_of_column(4);
    builder.effect(Alarm { slot, count: count.clone(), at });
    (builder.build().unwrap(), count)
}

/// Collects all that a run tells.
#[derive(Default)]
struct Recorder {
    rows: Vec<Vec<f64>>,
    results: usize,
    /// Number of the row at which it asks to stop
    stops_at: Option<usize>,
}

impl Observer for Recorder {
    fn row(&mut self, snapshot: &Snapshot) -> Result<(), Failure> {
        self.rows.push(snapshot.state.q.iter().flat_map(|q| q.0).collect());
        if self.stops_at == Some(self.rows.len()) {
            interrupt::request(SIGTERM);
        }
        Ok(())
    }

    fn found(&mut self, _stage: usize, _result: &StageResult) -> Result<(), Failure> {
        self.results += 1;
        Ok(())
    }
}

fn run(plan: &Plan, stops_at: Option<usize>) -> (Result<(), Failure>, Counters, Recorder) {
    let mut recorder = Recorder { stops_at, ..Recorder::default() };
    let (result, counters) = Run::new(plan.clone(), &mut recorder).finish();
    (result, counters, recorder)
}

/// Asks to stop after some time, unless `is_over`.
fn request_after(delay: Duration, is_over: &AtomicBool) {
    let begun = Instant::now();
    while begun.elapsed() < delay && !is_over.load(Ordering::Relaxed) {
        thread::sleep(Duration::from_micros(50));
    }
    interrupt::request(SIGTERM);
}

#[test]
fn a_request_ends_work_without_a_verdict() {
    assert_eq!(interrupt::requested(), None);
    assert_eq!(threads::unless_interrupted(|| 7), Some(7));
    let statics = Stage::statics(20).work;
    let of_statics = Plan::new(column(100), vec![Stage::new(statics)]);
    let works = [statics, StageWork::Path { steps: 20, max_steps: 30 }, StageWork::Buckling { modes: 3 }];

    // From a row on: the first one comes before the search for the direction of a path.
    for (work, row) in works.into_iter().take(2).flat_map(|work| [1, 3].map(|row| (work, row))) {
        interrupt::withdraw();
        let plan = Plan::new(column(100), vec![Stage::new(work)]);
        let (result, _, recorder) = run(&plan, Some(row));
        assert!(matches!(result, Err(Failure::Interrupted { signal: SIGTERM, .. })), "{work:?}: {result:?}");
        assert_eq!(recorder.rows.len(), row, "{work:?}");
    }
    interrupt::request(2);
    assert_eq!(interrupt::requested(), Some(SIGTERM), "the first request stays");

    // Before the start.
    let (result, counters, recorder) = run(&of_statics, None);
    assert!(matches!(result, Err(Failure::Interrupted { signal: SIGTERM, .. })), "{result:?}");
    assert!(recorder.rows.is_empty() && counters.work.iterations == 0);
    assert_eq!(threads::unless_interrupted(|| 7), None);
    interrupt::withdraw();

    // At any evaluation: what was left half-done is taken for no verdict ("nothing grows with the load").
    for work in works {
        let (model, count) = column_with_alarm(None);
        let plan = Plan::new(model, vec![Stage::new(work)]);
        assert_eq!(run(&plan, None).0, Ok(()));
        for number in 0..count.load(Ordering::Relaxed) {
            let plan = Plan::new(column_with_alarm(Some(number)).0, vec![Stage::new(work)]);
            let (result, _, recorder) = run(&plan, None);
            interrupt::withdraw();
            let is_interrupted = matches!(result, Err(Failure::Interrupted { signal: SIGTERM, .. }));
            assert!(is_interrupted || result == Ok(()), "{work:?}, evaluation {number}: {result:?}");
            assert!(!is_interrupted || recorder.results == 0, "{work:?}, evaluation {number}");
        }
    }

    // While a call is under way that nothing else ends.
    let begun = Instant::now();
    let is_over = AtomicBool::new(false);
    let left = thread::scope(|scope| {
        scope.spawn(|| request_after(Duration::from_millis(100), &is_over));
        threads::unless_interrupted(|| thread::sleep(Duration::from_secs(600)))
    });
    assert!(left.is_none() && begun.elapsed() < Duration::from_secs(60));
    interrupt::withdraw();

    // At any instant.
    for work in works {
        let plan = Plan::new(column(100), vec![Stage::new(work)]);
        let begun = Instant::now();
        let (whole, counted, told) = run(&plan, None);
        let duration = begun.elapsed();
        assert_eq!(whole, Ok(()));
        let messages = |counters: &Counters| -> Vec<String> {
            counters.findings.warnings.iter().map(ToString::to_string).collect()
        };
        for number in 0..20 {
            let delay = duration.mul_f64((f64::from(number) + 0.5) / 20.0);
            let is_over = AtomicBool::new(false);
            let (result, counters, recorder) = thread::scope(|scope| {
                scope.spawn(|| request_after(delay, &is_over));
                let ended = run(&plan, None);
                is_over.store(true, Ordering::Relaxed);
                ended
            });
            interrupt::withdraw();
            assert!(told.rows.starts_with(&recorder.rows), "{work:?} after {delay:?}");
            assert!(counters.cutbacks <= counted.cutbacks, "{work:?} after {delay:?}");
            let known = messages(&counted);
            let of_whole = |message: &String| known.contains(message);
            assert!(messages(&counters).iter().all(of_whole), "{:?}", messages(&counters));
            assert!(counted.findings.stability.starts_with(&counters.findings.stability), "{work:?} after {delay:?}");
            match result {
                Ok(()) => assert_eq!((recorder.rows.len(), recorder.results), (told.rows.len(), told.results)),
                Err(Failure::Interrupted { signal: SIGTERM, .. }) => {}
                Err(failure) => panic!("{work:?} after {delay:?}: {failure}"),
            }
        }
    }
}
