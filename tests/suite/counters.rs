//! What runs cost in counts: the same on every machine, so that a change which costs iterations, factorisations or evaluations shows at
//! once. `BLESS=1 cargo test --release counters` records new counts in `tests/counters.csv`.

use beamsim::scene::{self, Scene};
use beamsim_core::run::{Counters, Failure, Observer, Run, Snapshot};
use std::path::{Path, PathBuf};

/// Scenes of each kind of work: statics in space and in a plane, paths, dynamics, charts, joints, modes, the linear theory, and
/// searches for critical loads and a path of which many steps are refused.
const DECKS: [&str; 16] = [
    "bend45",
    "bend45_order3",
    "right_angle_coarse",
    "robot_arm",
    "rollup",
    "top_rigid",
    "minimal/arc_length",
    "minimal/damping",
    "minimal/generalized_alpha",
    "minimal/joint_revolute",
    "minimal/linear",
    "minimal/modal",
    "minimal/spring_between",
    "minimal/buckling",
    "stability/portal_that_turns_aside",
    "joints/concentric_tubes_limit",
];

struct Silent;

impl Observer for Silent {
    fn row(&mut self, _snapshot: &Snapshot) -> Result<(), Failure> {
        Ok(())
    }
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn run(deck: &str) -> (Scene, Counters) {
    let text = std::fs::read_to_string(root().join("decks").join(format!("{deck}.toml"))).unwrap();
    let (scene, _) = scene::from_text(&text).unwrap_or_else(|e| panic!("{deck}: {e:?}"));
    let (ended, counters) = Run::new(scene.plan.clone(), &mut Silent).finish();
    ended.unwrap_or_else(|e| panic!("{deck}: {e}"));
    (scene, counters)
}

/// Name and number, in a fixed order.
fn counts(counters: &Counters) -> Vec<(String, u64)> {
    let work = &counters.work;
    let own = [
        ("steps", counters.steps),
        ("cutbacks", counters.cutbacks),
        ("iterations", work.iterations),
        ("factorisations", work.factorisations),
        ("chart switches", work.chart_switches),
    ];
    let evaluations = counters.evaluations.iter().map(|(effect, count)| (format!("evaluations of {effect}"), *count));
    own.into_iter().map(|(name, count)| (name.to_string(), count)).chain(evaluations).collect()
}

fn recorded(path: &Path) -> Vec<(String, String, u64)> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(|record| record.unwrap()).collect()
}

fn count(decks: &[&str]) -> Vec<(String, String, u64)> {
    let row = |deck: &str, (name, count)| (deck.to_string(), name, count);
    decks.iter().flat_map(|deck| counts(&run(deck).1).into_iter().map(move |count| row(deck, count))).collect()
}

#[test]
fn runs_cost_the_recorded_counts() {
    let path = root().join("tests/counters.csv");
    let now = count(&DECKS);
    if std::env::var_os("BLESS").is_some() {
        let mut writer = csv::Writer::from_path(&path).unwrap();
        writer.write_record(["deck", "counter", "count"]).unwrap();
        now.iter().for_each(|record| writer.serialize(record).unwrap());
        return writer.flush().unwrap();
    }
    let before = recorded(&path);
    let changed: Vec<_> = now.iter().filter(|record| !before.contains(record)).collect();
    assert!(changed.is_empty() && now.len() == before.len(), "other counts than recorded: {changed:#?}");
}

/// Two short runs of those above: all take half an hour without optimisation.
#[test]
fn paths_by_arc_length_cost_the_recorded_counts() {
    let before = recorded(&root().join("tests/counters.csv"));
    let short = ["minimal/arc_length", "joints/concentric_tubes_limit"];
    let changed: Vec<_> = count(&short).into_iter().filter(|record| !before.contains(record)).collect();
    assert!(changed.is_empty() || std::env::var_os("BLESS").is_some(), "other counts than recorded: {changed:#?}");
}

/// Only what acts is ever evaluated, and what acts is said to.
#[test]
fn an_effect_that_is_absent_is_never_evaluated() {
    for deck in DECKS {
        let (scene, counters) = run(deck);
        for (effect, count) in &counters.evaluations {
            let said = scene.reasons.iter().find(|reason| reason.name == *effect);
            assert!(
                said.is_some_and(|reason| reason.active),
                "{deck}: {count} evaluations of {effect}, which is absent"
            );
        }
        let absent = scene.reasons.iter().filter(|reason| !reason.active);
        let instances = absent.filter(|reason| scene.plan.model.effects.iter().any(|e| e.name() == reason.name));
        assert_eq!(instances.count(), 0, "{deck}: an effect that is absent is in the model");
    }
}
