//! Requests to stop concern the whole process, so that they are tested in one of their own.

use beamsim_core::interrupt;
use beamsim_core::model::{Model, ModelBuilder, SectionMatrices, StraightBeam};
use beamsim_core::run::{Counters, Failure, Observer, Plan, Run, Snapshot, Stage, StageResult, StageWork};
use beamsim_core::tensor::Vec3;
use beamsim_core::threads;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

const SIGTERM: i32 = 15;

/// A column of many elements, with a force along it below its critical load.
fn column(elements: usize) -> Model {
    let mut builder = ModelBuilder::new();
    let root = builder.node("root", Vec3([0.0, 0.0, 0.0]));
    let tip = builder.node("tip", Vec3([1.0, 0.0, 0.0]));
    let section = SectionMatrices::diagonal([1e5, 1e5, 1e5, 10.0, 10.0, 10.0]);
    builder
        .beam(StraightBeam { ends: [root, tip], section, axis3: Vec3([0.0, 0.0, 1.0]), elements, order: 2 })
        .unwrap();
    builder.clamp(root).unwrap();
    builder.force(tip, Vec3([-20.0, 0.0, 0.0])).unwrap();
    builder.build().unwrap()
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

    // From a row on.
    let (result, _, recorder) = run(&of_statics, Some(3));
    assert!(matches!(result, Err(Failure::Interrupted { signal: SIGTERM, .. })), "{result:?}");
    assert_eq!(recorder.rows.len(), 3);
    interrupt::request(2);
    assert_eq!(interrupt::requested(), Some(SIGTERM), "the first request stays");

    // Before the start.
    let (result, counters, recorder) = run(&of_statics, None);
    assert!(matches!(result, Err(Failure::Interrupted { signal: SIGTERM, .. })), "{result:?}");
    assert!(recorder.rows.is_empty() && counters.work.iterations == 0);
    assert_eq!(threads::unless_interrupted(|| 7), None);
    interrupt::withdraw();

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
