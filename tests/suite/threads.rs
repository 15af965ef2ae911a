//! Large scenes on several threads: the same results to the last bit, and the same as without regions but for the order of sums.

use crate::random::Random;
use beamsim::scene;
use beamsim_core::kernel::Weights;
use beamsim_core::model::{Assembly, Model, Schedule};
use beamsim_core::run::{Failure, Ledger, Observer, Run, Snapshot};
use beamsim_core::system::{Memory, State};
use beamsim_core::tensor::Vec3;
use beamsim_core::threads;

/// Cantilevers side by side, tied at their tips, of enough nodes for several regions; effects of every kind that is cut.
fn deck(stage: &str, order: usize, planar: bool) -> String {
    let (out, density) = if planar { (0.0, "rhoA = 1") } else { (0.3, "rhoA = 1\nrhoJ = [0.02, 0.01, 0.01]") };
    format!(
        "gravity = [0, -1, 0]\n[point]\na = [0, 0, 0]\nb = [10, 0, {out}]\nc = [0, 1, 0]\nd = [10, 1, 0]\n\
         [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1e3\nEI = 1e3\n{density}\n\
         [[beam]]\nname = \"p\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = {count}\norder = {order}\n\
         [[beam]]\nname = \"q\"\nsection = \"s\"\nthrough = [\"c\", \"d\"]\nelements = {count}\norder = {order}\n\
         [[beam]]\nname = \"r\"\nsection = \"s\"\nthrough = [\"b\", \"d\"]\nelements = 3\n\
         [[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"c\"\nfix = \"all\"\n\
         [[load]]\nat = \"b\"\nforce = [0, 5, {out}]\n\
         [[load]]\nalong = \"q\"\nforce = [0.1, -0.4, {out}]\n\
         {stage}\n",
        count = 2500 / order + 7
    )
}

const STATIC: &str = "[[stage]]\nkind = \"static\"\nsteps = 2";
const DYNAMIC: &str = "[damping]\nmass = 0.1\nstiffness = 1e-4\n[[stage]]\nkind = \"dynamic\"\nend = 0.06\nstep = 0.01";

const TURNING: &str = "[[stage]]\nkind = \"static\"\nframe = { spin = [0, 0, 0.05], about = [0, 0, 0] }\nsteps = 1";

/// States, and the energies that belong to them.
#[derive(Default)]
struct States(Vec<(State, Ledger)>);

impl Observer for States {
    fn row(&mut self, snapshot: &Snapshot) -> Result<(), Failure> {
        self.0.push((snapshot.state.clone(), snapshot.ledger));
        Ok(())
    }
}

fn model(text: &str) -> beamsim::scene::Scene {
    scene::from_text(text).unwrap_or_else(|error| panic!("{error:?}\n{text}")).0
}

/// Displacements, rotation vectors and energies of all rows, and what the run counted.
fn history(text: &str, count: usize) -> (Vec<[u64; 3]>, String) {
    let scene = model(text);
    threads::on(count, || {
        let mut states = States::default();
        let mut plan = scene.plan.clone();
        plan.energy = true;
        let (result, counters) = Run::new(plan, &mut states).finish();
        assert_eq!(result, Ok(()));
        let of_row = |(state, ledger): &(State, Ledger)| -> Vec<[u64; 3]> {
            let energies = [ledger.kinetic, ledger.strain, ledger.external, ledger.damped];
            assert!(ledger.strain == 0.0 || ledger.external != 0.0, "no work was counted");
            let numbers = energies.map(|energy| Vec3([energy; 3]));
            let all = state.q.iter().chain(&state.v[..]).chain(&state.unwrapped).chain(&numbers);
            all.map(|v| v.0.map(f64::to_bits)).collect()
        };
        (states.0.iter().flat_map(of_row).collect(), format!("{:?}", counters.evaluations))
    })
}

#[test]
fn results_are_the_same_on_any_number_of_threads() {
    let scenes = [(STATIC, 1, false), (STATIC, 3, false), (DYNAMIC, 1, false), (DYNAMIC, 2, true), (TURNING, 1, false)];
    for (stage, order, planar) in scenes {
        let text = deck(stage, order, planar);
        assert!(model(&text).plan.model.regions() > 1);
        let one = history(&text, 1);
        assert!(one.0.iter().flatten().any(|&bits| bits != 0));
        assert!(history(&text, 2) == one, "two threads, order {order}, planar {planar}: {stage}");
        assert!(history(&text, 3) == one, "three threads, order {order}, planar {planar}: {stage}");
    }
}

/// A cantilever that a moment rolls up by `angle`.
fn rolled(angle: f64, stage: &str) -> String {
    let moment = 100.0 * angle;
    format!(
        "[point]\nroot = [0, 0, 0]\ntip = [10, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1e3\nEI = 1e3\nrhoA = 1\nrhoJ = [2, 1, 1]\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 2500\n[[support]]\nat = \"root\"\nfix = \"all\"\n\
         [[load]]\nat = \"tip\"\nmoment = [0, 0, {moment}]\n[[stage]]\nkind = \"static\"\nsteps = 3\n{stage}[effects]\nplanar = false\n"
    )
}

/// Nodes pass half a turn and change their charts, in statics and between time steps; how far they are wound goes on.
#[test]
fn turns_are_counted_the_same_on_any_number_of_threads() {
    for stage in ["", "[[stage]]\nkind = \"dynamic\"\nend = 0.02\nstep = 0.01\n"] {
        let text = rolled(5.0, stage);
        let one = history(&text, 1);
        let angles = one.0.iter().flatten().map(|&bits| f64::from_bits(bits));
        assert!(angles.fold(0.0, f64::max) > 4.9, "not rolled up");
        assert!(history(&text, 2) == one && history(&text, 3) == one, "{stage}");
    }
}

fn shaken(model: &Model) -> State {
    let (mut state, mut random) = (model.rest(), Random::new(9));
    for field in [&mut state.q[..], &mut state.v, &mut state.a] {
        field.iter_mut().for_each(|value| *value = random.vector(0.01));
    }
    state.amplitude.fill(0.7);
    state
}

/// What regions add up is what one pass over all instances adds up.
#[test]
fn regions_change_nothing_but_the_order_of_sums() {
    let scenes =
        [(DYNAMIC, 1), (DYNAMIC, 2), (DYNAMIC, 3), (TURNING, 1), (TURNING, 2), (STATIC, 1), (STATIC, 2), (STATIC, 3)];
    for text in
        scenes.map(|(text, order)| deck(text, order, false)).into_iter().chain([loaded_at_a_node(), bodies_alone()])
    {
        let plan = model(&text).plan;
        let (model, stage) = (plan.model, plan.stages[0].context(0));
        let state = shaken(&model);
        let mut schedule = Schedule::new(&model);
        let dof_map = schedule.begin_stage(&model, 0, stage.kind, &state).unwrap();
        let mut assembly = Assembly::new(&stage, dof_map, &model);
        assert!(assembly.system.is_cut());
        let weights = Weights { stiffness: 1.0, damping: 3.0, mass: 40.0 };
        // Nothing of another state is left.
        let mut other = state.clone();
        other.q.iter_mut().chain(&mut other.v[..]).for_each(|value| *value = *value * -0.5);
        assembly.evaluate(&other, weights, None);
        assembly.evaluate(&state, weights, None);
        let cut = (forces(&assembly), assembly.system.values.clone());
        assembly.system.clear(None);
        for (number, effect) in model.acting(&stage).iter().enumerate() {
            let with_tangent = effect.tangent().exists();
            let weights = if with_tangent { weights } else { Weights::NONE };
            let mut sink = assembly.system.assembler(number, effect.category(), with_tangent);
            effect.add(&state, &Memory::default(), weights, &mut sink);
        }
        assert!(apart(&cut.0, &forces(&assembly)) < 1e-14);
        assert!(apart(&cut.1, &assembly.system.values) < 1e-15);
    }
}

/// One beam, on which something else than elasticity acts in single regions.
fn loaded_at_a_node() -> String {
    "[point]\na = [0, 0, 0]\nb = [10, 0, 0]\nc = [20, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1e3\nEI = 1e3\nrhoA = 1\n\
     [[beam]]\nname = \"p\"\nsection = \"s\"\nthrough = [\"a\", \"b\", \"c\"]\nelements = 2500\n\
     [[support]]\nat = \"a\"\nfix = \"all\"\n[[load]]\nat = \"b\"\nforce = [0, 5, 1]\n\
     [[spring]]\nbetween = [\"b\", \"c\"]\nstiffness = 3\ndamping = 2\n[[stage]]\nkind = \"dynamic\"\nend = 0.02\nstep = 0.01\n"
        .into()
}

/// Bodies that nothing connects: no tile stands beside the diagonal.
fn bodies_alone() -> String {
    let of_all = |one: fn(usize) -> String| (0..2100).map(one).collect::<String>();
    let points = of_all(|k| format!("p{k} = [{k}, 0, 0]\n"));
    let bodies =
        of_all(|k| format!("[[body]]\nat = \"p{k}\"\nmass = {}\ninertia = [1, 2, 2.5]\noffset = [0, 0, 0.1]\n", k + 1));
    format!(
        "gravity = [0, 0, -9.81]\n[point]\n{points}{bodies}[[stage]]\nkind = \"dynamic\"\nend = 0.02\nstep = 0.01\n"
    )
}

fn forces(assembly: &Assembly) -> Vec<f64> {
    (0..assembly.system.force[0].len()).flat_map(|slot| assembly.system.total(slot).0).collect()
}

/// The largest difference over the largest number.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let largest = a.iter().chain(b).fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!(largest > 0.0 && a.len() == b.len());
    a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / largest
}

/// Rows of elements in a plane are cut as those in space.
#[test]
fn regions_of_a_plane_are_those_of_space() {
    let numbers = |text: &str| -> Vec<f64> {
        let bits = history(text, 1).0;
        bits.iter().flatten().map(|&bits| f64::from_bits(bits)).collect()
    };
    for (stage, order) in [(STATIC, 1), (DYNAMIC, 3)] {
        let text = deck(stage, order, true);
        let in_space = format!("{text}[effects]\nplanar = false\n");
        assert!(apart(&numbers(&text), &numbers(&in_space)) < 1e-9);
    }
}
