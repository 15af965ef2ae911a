//! The study of what accuracy costs.

use beamsim::deck::{self, Accuracy, Deck, SchemeName, Spanned, Words};
use beamsim::scene::{self, Scene};
use beamsim::study::StudyError;
use beamsim::study::accuracy::{Found, reach};
use beamsim::study::cost::{Against, CostRun, CostStudy, Expected, Journal, Limit, Pace, StudyOptions, study};
use beamsim::study::error_bars::error_bars;
use beamsim_core::run::Failure;
use std::path::Path;

fn read(text: &str) -> (Deck, Scene) {
    let (deck, found) = deck::read(text).unwrap_or_else(|e| panic!("{e:?}"));
    let (scene, _) = scene::from_deck(&deck, found).unwrap_or_else(|e| panic!("{e:?}\n{text}"));
    (deck, scene)
}

/// A study on so many threads, which stops after `most` runs; also how many runs it made.
fn stopped(
    text: &str,
    against: &Against,
    threads: usize,
    most: usize,
    journal: &mut Journal,
) -> (Result<CostStudy, StudyError>, usize) {
    let (deck, scene) = read(text);
    let count = std::sync::atomic::AtomicUsize::new(0);
    let interrupted = || (count.load(std::sync::atomic::Ordering::Relaxed) > most).then_some(2);
    let mut tell = |_: usize, _: usize| {
        count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    };
    let options = StudyOptions { threads, budget: None, interrupted: &interrupted, progress: &mut tell, journal };
    let found = study(text, &deck, &scene, against, options);
    (found, count.into_inner())
}

fn costs(text: &str, against: &Against, threads: usize) -> CostStudy {
    match stopped(text, against, threads, usize::MAX, &mut Journal::default()).0 {
        Ok(study) => study,
        Err(StudyError::Failure(failure)) => panic!("{failure}"),
        Err(_) => panic!("refused"),
    }
}

/// A quarter of a circle: a cantilever of length 10 with a moment at its end.
fn quarter(rest: &str) -> String {
    format!(
        "[point]\nroot = [0, 0, 0]\ntip = [10, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 100\nEI = 100\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 4\n\
         [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nmoment = [0, 0, \"5*pi\"]\n\
         [[stage]]\nkind = \"static\"\nsteps = 2\ntolerance = 1e-12\n\
         [[expect]]\ncolumn = \"tip.ux\"\nvalue = \"20/pi-10\"\nrtol = 1\n[[expect]]\ncolumn = \"tip.uy\"\nvalue = \"20/pi\"\nrtol = 1\n{rest}"
    )
}

const TIP: &str = "[output]\nnodes = [\"tip\"]\ncolumns = [\"u\"]\n";

/// A cantilever that is loaded smoothly, and swings.
const SWINGING: &str = "[point]\nroot = [0, 0, 0]\ntip = [1, 0, 0]\n[section.s]\nEA = 1e3\nGA = 1e3\nGJ = 10\nEI = 10\nrhoA = 1\nrhoJ = [0.02, 0.01, 0.01]\n\
     [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 4\n\
     [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 3, 2]\nhistory = \"h\"\n\
     [history.h]\ntimes = [0, 0.5]\nvalues = [0, 1]\nsmooth = true\n[[stage]]\nkind = \"dynamic\"\nend = 0.5\nstep = 0.01\n[output]\nnodes = [\"tip\"]\n";

#[test]
fn errors_against_the_own_reference_are_those_against_the_exact_solution() {
    let text = quarter(&format!("{TIP}[cost]\nnorm = \"end\"\noutputs = [\"tip.ux\", \"tip.uy\"]\n"));
    let own = costs(&text, &Against::Finest, 2);
    let exact = costs(&text, &Against::Expectations, 2);
    assert!(own.reference.uncertainty < 1e-8, "{:e}", own.reference.uncertainty);
    for (a, b) in own.runs.iter().zip(&exact.runs) {
        assert_eq!(a.settings(), b.settings());
        assert!((a.error - b.error).abs() <= own.reference.uncertainty + 1e-12, "{} against {}", a.error, b.error);
    }
    assert!(own.runs.iter().any(|run| run.error > 1e-3) && own.runs.iter().any(|run| run.error < 1e-8));
}

#[test]
fn orders_in_space_are_twice_those_of_elements() {
    // A moment alone is met too well by high orders.
    let text =
        quarter(&format!("[[load]]\nat = \"tip\"\nforce = [1, 3, 2]\n{TIP}[cost]\nelements = [1, 1.5, 2, 3, 4]\n"));
    let found = costs(&text, &Against::Finest, 2);
    for orders in &found.orders {
        let (order, space) = (orders.family.order.unwrap(), orders.space.unwrap());
        assert_eq!(space.expected, Some(Expected { order: 2.0 * order as f64, at_least: false }));
        let observed = space.observed.unwrap();
        assert!((observed - 2.0 * order as f64).abs() < 0.4, "{}: {observed}", orders.family.name());
        assert_eq!((space.remark(), orders.time.is_none()), (None, true));
    }
}

#[test]
fn steps_cost_accuracy_of_the_second_order_and_are_told_where_they_limit() {
    let text = format!("{SWINGING}[cost]\norder = [2, 3]\ninterpolation = \"relative\"\nscheme = \"newmark\"\n");
    let found = costs(&text, &Against::Finest, 2);
    for orders in &found.orders {
        let time = orders.time.unwrap();
        assert_eq!(time.expected, Some(Expected { order: 2.0, at_least: false }));
        assert!((time.observed.unwrap() - 2.0).abs() < 0.4, "{time:?}");
    }
    let frontier = || found.runs.iter().filter(|run| run.frontier);
    assert!(frontier().any(|run| run.limit == Some(Limit::Step)));
    // The cheapest run of all has the longest step, and the most accurate one the shortest.
    let best = frontier().min_by(|a, b| a.error.total_cmp(&b.error)).unwrap();
    assert_eq!(best.variant.pace, Pace::Steps(0.25));
}

/// Lobatto's scheme is tried where the deck has the default scheme, and errs less at the same step.
#[test]
fn a_study_tries_the_scheme_of_order_four() {
    let found = costs(&format!("{SWINGING}[cost]\norder = 3\nelements = 1\n"), &Against::Finest, 2);
    let is_lobatto = |scheme: Option<SchemeName>| scheme == Some(SchemeName::Lobatto);
    let of_lobatto = found.orders.iter().find(|orders| is_lobatto(orders.family.scheme)).unwrap();
    assert_eq!(of_lobatto.time.unwrap().expected, Some(Expected { order: 4.0, at_least: false }));
    let longest = |of: bool| {
        let mut runs = found.runs.iter().filter(|run| is_lobatto(run.variant.family.scheme) == of);
        runs.find(|run| run.variant.pace == Pace::Steps(2.0)).unwrap().error
    };
    assert!(longest(true) < 0.2 * longest(false), "{:e} {:e}", longest(true), longest(false));
    let damped = SWINGING.replace("step = 0.01", "step = 0.01\nscheme = \"generalized_alpha\"");
    let found = costs(&format!("{damped}[cost]\norder = 1\nelements = 1\n"), &Against::Finest, 2);
    assert!(found.runs.iter().all(|run| !is_lobatto(run.variant.family.scheme)));
}

/// What must be the same whenever a study is made.
#[derive(Debug, PartialEq)]
struct Exact {
    settings: Vec<String>,
    status: Option<String>,
    counts: Option<[u64; 3]>,
    errors: Vec<u64>,
}

fn exact(run: &CostRun) -> Exact {
    Exact {
        settings: run.settings(),
        status: run.trial.as_ref().map(|t| t.status.clone()),
        counts: run.trial.as_ref().map(|t| [t.steps, t.iterations, t.factorisations]),
        errors: run.errors.iter().map(|e| e.to_bits()).collect(),
    }
}

#[test]
fn errors_and_counters_are_the_same_each_time_and_on_any_number_of_threads() {
    let [one, two] = [1, 2].map(|threads| costs(SWINGING, &Against::Finest, threads));
    assert_eq!(one.reference.samples, two.reference.samples);
    assert!(one.runs.len() > 50);
    for (a, b) in one.runs.iter().zip(&two.runs) {
        assert_eq!(exact(a), exact(b));
    }
}

#[test]
fn the_lines_of_a_run_give_its_error_again() {
    let text = quarter(TIP);
    let found = costs(&text, &Against::Expectations, 2);
    let frontier: Vec<&CostRun> = found.runs.iter().filter(|run| run.frontier).collect();
    assert!(frontier.len() > 3);
    for run in frontier {
        let pasted = deck::apply(&text, &run.settings()).unwrap();
        let (order, word) = (run.variant.family.order.unwrap(), run.variant.family.interpolation.unwrap().word());
        let alone = format!("{pasted}[cost]\nelements = 1\norder = {order}\ninterpolation = \"{word}\"\n");
        let again = costs(&alone, &Against::Expectations, 1);
        assert_eq!(again.runs.len(), 1);
        assert!(again.runs[0].settings().is_empty(), "{:?}", again.runs[0].settings());
        assert_eq!(again.runs[0].error, run.error);
    }
}

#[test]
fn numbers_of_nodes_keep_their_places_on_other_meshes() {
    let by_number = costs(&quarter("[output]\nnodes = [\"b:1\"]\ncolumns = [\"u\"]\n"), &Against::Finest, 2);
    let by_place = costs(&quarter("[output]\nnodes = [\"b@0.25\"]\ncolumns = [\"u\"]\n"), &Against::Finest, 2);
    for (a, b) in by_number.runs.iter().zip(&by_place.runs) {
        assert_eq!(a.error, b.error, "{:?}", a.settings());
        let moved = a.settings().iter().any(|s| s.starts_with("beam.0.elements") || s.starts_with("beam.0.order"));
        assert_eq!(moved, a.settings().iter().any(|s| s == "beam.0.numbering=4"), "{:?}", a.settings());
    }
    assert!(by_number.runs.iter().any(|run| run.error < 1e-4));
}

#[test]
fn a_study_that_was_stopped_goes_on() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cost_journal");
    let _ = std::fs::remove_dir_all(&folder);
    let text = quarter(TIP);
    let open = |identity: &str| Journal::open(&folder, "cost.journal", identity).unwrap();
    let (found, _) = stopped(&text, &Against::Finest, 1, 10, &mut open("a"));
    assert!(matches!(found, Err(StudyError::Failure(_))));

    let mut journal = open("a");
    let known = journal.len();
    assert!((5..20).contains(&known), "{known}");
    // A line that was cut off, wherever, is no run.
    let path = folder.join("cost.journal");
    let bytes = std::fs::read(&path).unwrap();
    for cut in 2..60 {
        std::fs::write(&path, &bytes[..bytes.len() - cut]).unwrap();
        drop(journal);
        journal = open("a");
        assert_eq!(journal.len(), known - 1, "{cut} bytes less");
    }

    let (found, runs) = stopped(&text, &Against::Finest, 1, usize::MAX, &mut journal);
    let Ok(found) = found else { panic!("refused") };
    let whole = costs(&text, &Against::Finest, 1);
    for (a, b) in found.runs.iter().zip(&whole.runs) {
        assert_eq!(exact(a), exact(b));
    }
    assert!(runs > 0);
    assert!(!journal.is_empty() && open("another study").is_empty());
    journal.close().unwrap();
    assert!(!path.exists());
}

#[test]
fn a_stored_history_can_be_the_reference() {
    let text = quarter(TIP);
    let names = ["stage", "time", "load", "tip.ux", "tip.uy", "tip.uz"].map(String::from).to_vec();
    let exact = std::f64::consts::FRAC_1_PI * 20.0;
    let rows = vec![vec![1.0, 0.0, 1.0, exact - 10.0, exact, 0.0]];
    let table = beamsim::output::HistoryReader { names, rows };
    let found = costs(&text, &Against::Table(table), 2);
    assert_eq!(found.reference.made, "the given history");
    let by_deck = costs(&text, &Against::Expectations, 2);
    for (a, b) in found.runs.iter().zip(&by_deck.runs) {
        assert!((a.error - b.error).abs() < 1e-12, "{} against {}", a.error, b.error);
    }
}

#[test]
fn outputs_that_a_reference_lacks_are_told() {
    let names = ["stage", "time", "load", "tip.uy"].map(String::from).to_vec();
    let table = beamsim::output::HistoryReader { names, rows: vec![vec![1.0, 0.0, 1.0, 6.366]] };
    let found = costs(&quarter(TIP), &Against::Table(table), 2);
    assert_eq!(found.reference.made, "the given history (without values of tip.ux, tip.uz)");
    assert_eq!(found.outputs, [1]);
}

#[test]
fn a_reference_that_ends_early_is_refused() {
    let names = ["stage", "time", "load", "tip.uz"].map(String::from).to_vec();
    for (text, last) in [
        (SWINGING.to_string(), [1.0, 0.3, 0.0, 0.1]),
        (format!("{SWINGING}[[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.01\n"), [1.0, 0.5, 1.0, 0.1]),
    ] {
        let rows = vec![vec![1.0, 0.0, 0.0, 0.0], last.to_vec()];
        let table = beamsim::output::HistoryReader { names: names.clone(), rows };
        let (deck, scene) = read(&text);
        let mut journal = Journal::default();
        let options = StudyOptions {
            threads: 1,
            budget: None,
            interrupted: &|| None,
            progress: &mut |_, _| {},
            journal: &mut journal,
        };
        let refused = study(&text, &deck, &scene, &Against::Table(table), options);
        let Err(StudyError::Deck(diagnostic)) = refused else { panic!("not refused") };
        assert!(diagnostic.message.contains("before the deck does") && diagnostic.span.is_some());
    }
}

#[test]
fn meshes_keep_nodes_where_something_acts() {
    let text = quarter(
        "[[spring]]\nat = \"b@0.5\"\nstiffness = [1, 1, 1, 0, 0, 0]\n[[load]]\nat = \"b:3\"\nforce = [0, 1, 0]\n",
    );
    let found = costs(&text, &Against::Finest, 2);
    assert!(found.runs.iter().all(|run| run.trial.as_ref().unwrap().status == "finished"));
    for run in &found.runs {
        let intervals = run.variant.count() * run.variant.family.order.unwrap();
        assert_eq!(intervals % 4, 0, "{:?}", run.settings());
    }
    assert!(found.runs.iter().any(|run| run.error < 1e-6));
}

#[test]
fn runs_that_fail_are_told_and_the_others_stay() {
    // One of the schemes has no total vectors to interpolate.
    let schemes = [SchemeName::Newmark, SchemeName::LieGeneralizedAlpha];
    let text = format!(
        "{SWINGING}[cost]\norder = 1\ninterpolation = \"total\"\nscheme = {:?}\n",
        schemes.map(SchemeName::word)
    );
    let found = costs(&text, &Against::Finest, 2);
    let (failed, rest): (Vec<_>, Vec<_>) =
        found.runs.iter().partition(|run| run.variant.family.scheme == Some(schemes[1]));
    let status = |run: &CostRun| run.trial.as_ref().unwrap().status.clone();
    assert!(
        failed.len() == 16 && failed.iter().all(|run| status(run) == "deck" && run.error.is_nan() && !run.frontier)
    );
    assert!(rest.iter().all(|run| status(run) == "finished" && run.error.is_finite()));
    assert!(found.to_csv().is_ok_and(|table| !String::from_utf8(table).unwrap().contains("NaN")));
}

fn reached(text: &str, wanted: &Accuracy) -> Result<Found, StudyError> {
    let (deck, scene) = read(text);
    let options = StudyOptions {
        threads: 2,
        budget: None,
        interrupted: &|| None,
        progress: &mut |_, _| (),
        journal: &mut Journal::default(),
    };
    reach(text, &deck, &scene, wanted, options)
}

/// The error of a deck with settings, against what it expects, or a finer run.
fn error_with(text: &str, found: &Found, against: &Against) -> f64 {
    let (family, pasted) = (&found.variant.family, deck::apply(text, &found.settings()).unwrap());
    let (order, word) = (family.order.unwrap(), family.interpolation.unwrap().word());
    let scheme = family.scheme.unwrap_or(SchemeName::Newmark).word();
    let is_dynamic = matches!(found.variant.pace, Pace::Steps(_));
    let step = if is_dynamic { format!("step = 1\nscheme = \"{scheme}\"\n") } else { String::new() };
    let alone = format!("{pasted}[cost]\nelements = 1\norder = {order}\ninterpolation = \"{word}\"\n{step}");
    let study = costs(&alone, against, 2);
    assert_eq!(study.runs.len(), 1);
    study.runs[0].error
}

#[test]
fn a_wanted_accuracy_is_reached_and_estimates_are_above_errors() {
    for wanted in [1e-2, 1e-4, 1e-6] {
        for (text, against) in [(quarter(TIP), Against::Expectations), (SWINGING.into(), Against::Finest)] {
            let Ok(found) = reached(&text, &Accuracy::All(wanted)) else { panic!("refused") };
            assert!(found.reached && found.ratio <= 1.0);
            let (error, (column, estimate)) =
                (error_with(&text, &found, &against), found.worst(&Accuracy::All(wanted)));
            assert!(estimate <= wanted && column.starts_with("tip."), "{estimate:e} of {column}");
            assert!(error <= wanted && error <= 1.1 * estimate, "{error:e} of {wanted:e}, estimated {estimate:e}");
        }
    }
}

/// A stretched strip that is clamped at both ends, under a load across: its curvature decays within a hundredth of its length.
fn stretched(output: &str) -> String {
    format!(
        "[point]\nroot = [0, 0, 0]\nend = [1, 0, 0]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 20\nEI = 1\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"end\"]\nelements = 40\n\
         [[support]]\nat = \"root\"\nfix = \"all\"\n\
         [[support]]\nat = \"end\"\nfix = [\"uy\", \"uz\", \"rx\", \"ry\", \"rz\"]\n\
         [[load]]\nat = \"end\"\nforce = [1e4, 0, 0]\n[[load]]\nalong = \"b\"\nforce = [0, 0, -5e3]\n\
         [[stage]]\nkind = \"static\"\nsteps = 4\n{output}"
    )
}

#[test]
fn placed_elements_are_fewer_where_curvature_is_local() {
    // The middle is an output: an element ends there on every mesh.
    let text = stretched("[output]\nnodes = [\"b:20\"]\ncolumns = [\"u\"]\n");
    let wanted = Accuracy::All(1e-6);
    let Ok(found) = reached(&text, &wanted) else { panic!("refused") };
    let meshes = found.meshes.as_ref().expect("both meshes");
    let placed = meshes.placed.as_ref().expect("a placed mesh");
    assert!(meshes.is_placed && found.reached && meshes.predicted < 0.8, "{}", meshes.predicted);
    assert!(4 * placed.elements < 3 * meshes.equal.elements, "{} of {}", placed.elements, meshes.equal.elements);
    assert!(found.settings()[0].starts_with("beam.0.elements=[[0."), "{:?}", found.settings());
    assert!(found.settings().iter().any(|setting| setting == "beam.0.numbering=40"));
    let error = error_with(&text, &found, &Against::Finest);
    assert!(error <= 1e-6, "{error:e}");
}

#[test]
fn equal_elements_stay_where_placing_saves_nothing() {
    let Ok(found) = reached(&quarter(TIP), &Accuracy::All(1e-8)) else { panic!("refused") };
    assert!(found.meshes.is_none_or(|meshes| !meshes.is_placed && meshes.placed.is_none()));
}

#[test]
fn studies_keep_the_shape_of_a_graded_mesh() {
    let graded = stretched("").replace("elements = 40", "elements = [[0.01, 0.05, 0.5, 0.95, 0.99]]\norder = 3");
    let found = costs(&graded, &Against::Finest, 2);
    let settings: Vec<String> = found.runs.iter().flat_map(CostRun::settings).collect();
    let has = |setting: &str| settings.iter().any(|known| known == setting);
    assert!(has("beam.0.elements=[[0.05,0.5,0.95]]") || has("beam.0.elements=[[0.05,0.95]]"), "{settings:?}");
    assert!(found.runs.iter().any(|run| run.error < 1e-4));
}

#[test]
fn only_outputs_that_are_named_must_be_accurate() {
    let name = |name: &str| Spanned { value: name.to_string(), span: 3..7 };
    let of = |names: &[(&str, f64)]| Accuracy::Columns(names.iter().map(|(n, a)| (name(n), *a)).collect());
    let nodes = |wanted: &Accuracy| match reached(SWINGING, wanted) {
        Ok(found) => found.variant.count() * found.variant.family.order.unwrap(),
        Err(_) => panic!("refused"),
    };
    assert!(nodes(&of(&[("tip.ux", 1e-5)])) > nodes(&of(&[("tip.ux", 1e-2)])));
    let Err(StudyError::Deck(diagnostic)) = reached(SWINGING, &of(&[("tip.vx", 1e-2)])) else { panic!("not refused") };
    assert_eq!(diagnostic.span, Some(3..7));
}

#[test]
fn a_mechanism_is_told_by_its_own_name_and_place() {
    // Nodes of the deck's own mesh, whatever mesh it was found on.
    let text = quarter(TIP).replace("fix = \"all\"", "fix = \"pin\"").replace("elements = 4", "elements = 2");
    let (deck, scene) = read(&text);
    let refusals = [
        reached(&text, &Accuracy::All(1e-5)).err(),
        stopped(&text, &Against::Finest, 1, usize::MAX, &mut Journal::default()).0.err(),
        error_bars(&text, &deck, &scene, &|| None).err(),
    ];
    for refusal in refusals {
        let Some(StudyError::Failure(failure)) = refusal else { panic!("not refused") };
        let own = ["b:1", "root", "tip"].iter().any(|node| failure.to_string().contains(&format!("\"{node}\"")));
        assert!(failure.name() == "singular" && own, "{failure}");
    }
}

#[test]
fn scenes_whose_outputs_stay_zero_are_refused() {
    let text = quarter(TIP).replace("\"5*pi\"", "0");
    let refusals = [
        reached(&text, &Accuracy::All(1e-2)).err(),
        stopped(&text, &Against::Finest, 1, usize::MAX, &mut Journal::default()).0.err(),
    ];
    for refusal in refusals {
        let Some(StudyError::Deck(diagnostic)) = refusal else { panic!("not refused") };
        assert!(diagnostic.message.contains("zero throughout"), "{}", diagnostic.message);
    }
}

#[test]
fn a_search_that_is_stopped_tells_the_best_so_far() {
    let (deck, scene) = read(SWINGING);
    let count = std::cell::Cell::new(0);
    let tried = std::sync::atomic::AtomicUsize::new(0);
    let interrupted = || (tried.load(std::sync::atomic::Ordering::Relaxed) > 4).then_some(2);
    let mut tell = |done: usize, _: usize| {
        count.set(done);
        tried.store(done, std::sync::atomic::Ordering::Relaxed);
    };
    let journal = &mut Journal::default();
    let options = StudyOptions { threads: 1, budget: None, interrupted: &interrupted, progress: &mut tell, journal };
    let Ok(found) = reach(SWINGING, &deck, &scene, &Accuracy::All(1e-6), options) else { panic!("nothing is told") };
    assert!(!found.reached && found.runs == 3 && found.ratio.is_finite());
    assert!(matches!(found.stopped, Some(Failure::Interrupted { signal: 2, .. })), "{:?}", found.stopped);
}

#[test]
fn modes_are_named_as_expectations_name_them() {
    let text =
        format!("{}[[stage]]\nkind = \"modal\"\nmodes = 2\n", quarter(TIP).replace("EI = 100", "EI = 100\nrhoA = 1"));
    let wanted = |name: &str| Accuracy::Columns(vec![(Spanned { value: name.into(), span: 0..1 }, 1e-3)]);
    let [short, long] = ["mode1.omega", "stage2.mode1.omega"].map(|name| match reached(&text, &wanted(name)) {
        Ok(found) => (found.reached, found.settings()),
        Err(_) => panic!("{name}: refused"),
    });
    assert!(short.0 && short == long);
}

#[test]
fn keys_that_vary_nothing_are_told() {
    let warnings = |text: &str| deck::read(text).unwrap().1.iter().filter(|d| d.is_warning()).count();
    assert_eq!(warnings(&quarter("[cost]\nelements = [1, 2]\nstep = 0.5\nscheme = \"hht\"\n")), 2);
    assert_eq!(warnings(&format!("{SWINGING}[cost]\nelements = [1, 2]\nstep = 0.5\n")), 0);
}

#[test]
fn round_off_of_rotations_is_no_error() {
    // A pull along a slanting beam turns nothing.
    let text = "[point]\nroot = [0, 0, 0]\ntip = [1.2, 1.6, 0]\n[section.s]\nEA = 100\nGA = 100\nGJ = 10\nEI = 10\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 2\n\
         [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"b@end\"\nforce = [20, 0, 0]\nframe = \"section\"\n\
         [[stage]]\nkind = \"static\"\nsteps = 2\n";
    let Ok(found) = reached(text, &Accuracy::All(1e-6)) else { panic!("refused") };
    assert!(found.reached && found.runs <= 3, "{}", found.runs);
}

#[test]
fn a_beam_of_one_element_beside_one_of_many_is_not_overlooked() {
    // The error is that of the short mesh of the stiff arm, whose elements cannot be halved.
    let text = "[point]\nroot = [0, 0, 0]\nelbow = [3, 0, 0]\ntip = [3, 1, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 10\nEI = 10\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"elbow\", \"tip\"]\nelements = [1, 20]\n\
         [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 1, 3]\n\
         [[stage]]\nkind = \"static\"\nsteps = 4\n";
    for wanted in [1e-2, 1e-4] {
        let Ok(found) = reached(text, &Accuracy::All(wanted)) else { panic!("refused") };
        let error = error_with(text, &found, &Against::Finest);
        assert!(found.reached && error <= wanted, "{error:e} of {wanted:e}");
    }
}

#[test]
fn steps_that_an_interval_cuts_are_told_apart() {
    // The step is a whole part of the interval: one that is longer changes nothing, and tells nothing.
    let text = format!("{SWINGING}interval = 0.02\n");
    for wanted in [1e-2, 1e-4] {
        let Ok(found) = reached(&text, &Accuracy::All(wanted)) else { panic!("refused") };
        let error = error_with(&text, &found, &Against::Finest);
        assert!(found.reached && error <= wanted, "{error:e} of {wanted:e}");
    }
}

#[test]
fn scenes_whose_steps_adapt_can_be_as_accurate_as_asked_for() {
    let text = SWINGING.replace("step = 0.01", "step = 0.01\nadaptive = true\nstep_tolerance = 1e-3");
    let Ok(found) = reached(&text, &Accuracy::All(1e-3)) else { panic!("refused") };
    assert!(found.reached && found.settings().iter().any(|s| s == "stage.0.adaptive=false"));
    // And they are studied by their tolerances.
    let study = costs(
        &format!("{text}interval = 0.05\n[cost]\norder = 2\ninterpolation = \"relative\"\n"),
        &Against::Finest,
        2,
    );
    let finished = |run: &&CostRun| run.trial.as_ref().unwrap().status == "finished";
    assert!(study.runs.iter().filter(finished).count() == study.runs.len() && !study.ends_only);
    assert!(study.runs.iter().any(|run| run.variant.pace == Pace::Adapts(1e-5) && run.error < 1e-2));
}

#[test]
fn a_forecast_watches_no_longer_than_it_may_and_reckons_with_the_rest() {
    use beamsim::study::forecast::forecast;
    use std::time::Duration;
    let (_, scene) = read(&SWINGING.replace("end = 0.5", "end = 1e5"));
    let long = forecast(&scene, Duration::from_millis(20));
    let steps = long.at.time / 0.01;
    assert!(long.ended.is_none() && steps > 0.0, "{steps}");
    // Ten million steps at the pace of those that were seen, within what a busy machine makes of 20 ms.
    let expected = long.watched / steps * 1e7;
    assert!((0.1..10.0).contains(&(long.seconds / expected)), "{} against {expected}", long.seconds);
    // A condition that holds when the stage begins is not what it comes to.
    let until = "end = 1e5\nuntil = { column = \"tip.uy\", below = 0 }";
    let (_, scene) = read(
        &SWINGING
            .replace("end = 0.5", until)
            .replace("force = [0, 3, 2]", "force = [0, -3, 2]")
            .replace("below = 0", "above = 0"),
    );
    assert!(forecast(&scene, Duration::from_millis(20)).seconds > 1.0);
    let (_, scene) = read(SWINGING);
    let short = forecast(&scene, Duration::from_secs(3600));
    assert!(matches!(short.ended, Some(Ok(()))) && short.seconds == short.watched);
}
