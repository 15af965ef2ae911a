//! Corner cases that once went wrong.

use crate::scenes::{attempt, simulate};
use beamsim::scene;

fn arm(elements: usize, section: &str, rest: &str) -> String {
    format!(
        "[point]\nroot = [0, 0, 0]\ntip = [10, 0, 0]\n[section.s]\n{section}\n\
         [[beam]]\nname = \"arm\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = {elements}\n{rest}\n"
    )
}

const SECTION: &str = "EA = 1e4\nGA = 1e4\nGJ = 100\nEI = 200\nrhoA = 2";
const CLAMP: &str = "[[support]]\nat = \"root\"\nfix = \"all\"\n";
const STATIC: &str = "[[stage]]\nkind = \"static\"\nsteps = 2\n";

#[test]
fn a_scene_without_a_free_direction_is_solved() {
    let both = format!("{CLAMP}[[support]]\nat = \"tip\"\nfix = \"all\"\n{STATIC}");
    let simulation = simulate(&arm(1, SECTION, &both));
    assert_eq!((simulation.rows.len(), simulation.counters.work.iterations), (3, 0));
}

/// A thousand elements and more of a slender rod leave hardly any stiffness against its softest motion; P L^3 / (3 EI).
#[test]
fn a_slender_rod_is_no_mechanism() {
    let rest = format!("{CLAMP}[[load]]\nat = \"tip\"\nforce = [0, 0, 1e-4]\n{STATIC}");
    let simulation = simulate(&arm(1500, "EA = 1e9\nGA = 1e9\nGJ = 60\nEI = 60", &rest));
    let exact = 1e-4 * 1000.0 / (3.0 * 60.0);
    assert!((simulation.end("tip.uz") / exact - 1.0).abs() < 1e-3, "{}", simulation.end("tip.uz"));
}

#[test]
fn a_mechanism_of_many_elements_is_still_named() {
    let rest = format!(
        "[[support]]\nat = \"root\"\nfix = \"pin\"\n[[support]]\nat = \"tip\"\nfix = [\"uy\", \"uz\"]\n\
         [[load]]\nat = \"tip\"\nmoment = [1, 0, 0]\n{STATIC}"
    );
    for elements in [1, 10, 100, 1000] {
        let failure = attempt(&arm(elements, SECTION, &rest)).result.expect_err("it can spin about its axis");
        assert_eq!(failure.name(), "singular", "{elements} elements: {failure}");
    }
}

/// A clamped rod twisted by a whole turn in one load level keeps its torque GJ 2 pi / L.
#[test]
fn a_prescribed_turn_is_not_lost() {
    let twist =
        "[[motion]]\nat = \"tip\"\nrotate = [1, 0, 0]\nangle = \"2*pi\"\n[[support]]\nat = \"tip\"\nfix = \"pin\"\n";
    let rest = format!("{CLAMP}{twist}[[stage]]\nkind = \"static\"\nsteps = 1\n[output]\ncolumns = [\"reaction\"]\n");
    let simulation = simulate(&arm(8, SECTION, &rest));
    let exact = 100.0 * 2.0 * std::f64::consts::PI / 10.0;
    assert!((simulation.end("tip.mx") - exact).abs() < 1e-6 * exact, "{}", simulation.end("tip.mx"));
    assert!(simulation.counters.cutbacks > 0);
    let jump = rest.replace("steps = 1", "steps = 1\nadaptive = false");
    let refused = attempt(&arm(8, SECTION, &jump));
    assert!(refused.result.is_err() && refused.hint.is_some_and(|hint| hint.contains("remove `adaptive = false`")));
}

/// A hinge with a rotational spring, turned by whole and broken turns: the moment is k times the angle.
#[test]
fn a_wound_spring_remembers_whole_turns() {
    let text = r#"
[point]
hub = [0, 0, 0]
[[body]]
at = "hub"
mass = 1
inertia = [1, 1, 1]
[[support]]
at = "hub"
fix = "pin"
[[spring]]
at = "hub"
stiffness = [0, 0, 0, 0, 0, 10]
[[motion]]
at = "hub"
rotate = [0, 0, 1]
angle = "6*pi"
[[stage]]
kind = "static"
steps = 12
[output]
columns = ["reaction", "energy"]
"#;
    let simulation = simulate(text);
    let (moments, energies) = (simulation.column("hub.mz"), simulation.column("energy.strain"));
    for (level, (moment, energy)) in moments.iter().zip(energies).enumerate() {
        let angle = level as f64 * std::f64::consts::PI / 2.0;
        assert!((moment - 10.0 * angle).abs() < 1e-9 * (1.0 + moment.abs()), "level {level}: {moment}");
        assert!((energy - 5.0 * angle * angle).abs() < 1e-9 * (1.0 + energy), "level {level}: {energy}");
    }
}

#[test]
fn a_point_mass_needs_no_rotation() {
    let mass = "[point]\np = [1, 0, 0]\n[[body]]\nat = \"p\"\nmass = 2\n";
    let stage = "[[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.1\n";
    let driven = "[[motion]]\nat = \"p\"\nux = 1\nhistory = \"h\"\n[history.h]\nexpr = \"t^2\"\n";
    let simulation = simulate(&format!("{mass}{driven}{stage}"));
    assert!((simulation.end("p.ux") - 1.0).abs() < 1e-12);
    let sprung = "[[spring]]\nat = \"p\"\nstiffness = [8, 8, 8, 5, 0, 0]\n[[initial]]\nvelocity = [0, 1, 0]\n";
    let simulation = simulate(&format!("{mass}{sprung}{}", stage.replace("step = 0.1", "step = 0.001")));
    // omega = 2, so y = sin(2 t)/2
    assert!((simulation.end("p.uy") - (2.0_f64).sin() / 2.0).abs() < 1e-5, "{}", simulation.end("p.uy"));
}

#[test]
fn the_centre_of_mass_is_known_in_statics_too() {
    let simulation = simulate(&arm(2, SECTION, &format!("{CLAMP}{STATIC}[output]\ncolumns = [\"momentum\"]\n")));
    assert!((simulation.end("momentum.cx") - 5.0).abs() < 1e-12);
}

#[test]
fn a_joint_may_sit_at_the_middle_of_an_arc() {
    let deck = |elements: usize| {
        format!(
            "[point]\na = [0, 0, 0]\nm = [1, 1, 0]\nb = [2, 0, 0]\nc = [1, 2, 0]\n[section.s]\n{SECTION}\n\
             [[beam]]\nname = \"arc\"\nsection = \"s\"\narc = [\"a\", \"m\", \"b\"]\nelements = {elements}\n\
             [[beam]]\nname = \"post\"\nsection = \"s\"\nthrough = [\"m\", \"c\"]\nelements = 2\n\
             [[joint]]\nkind = \"spherical\"\nat = \"m\"\nbeams = [\"arc\", \"post\"]\n\
             [[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"c\"\nfix = \"all\"\n\
             [[load]]\nat = \"b\"\nforce = [0, 0, 1]\n{STATIC}"
        )
    };
    let simulation = simulate(&deck(4));
    assert!((simulation.end("m.uz") - simulation.end("b.uz")).abs() > 1e-3);
    let errors = scene::from_text(&deck(3)).err().expect("three elements put no node there");
    assert!(errors.iter().any(|e| e.help.as_ref().is_some_and(|h| h.contains("elements = 4"))), "{errors:?}");
}

#[test]
fn both_sides_of_a_node_are_seen_however_it_is_written() {
    let load = format!("{CLAMP}[[load]]\nat = \"tip\"\nforce = [0, 0, 1]\n{STATIC}");
    let at = |fraction: &str| {
        let output = format!("[output]\nnodes = [\"arm@{fraction}\"]\ncolumns = [\"resultant\"]\n");
        simulate(&arm(3, SECTION, &format!("{load}{output}"))).end(&format!("arm@{fraction}.M2"))
    };
    assert_eq!(at("0.333333333332"), at("0.333333333334"));
}

#[test]
fn nothing_a_deck_says_exhausts_the_machine() {
    let stage = "[[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.1\n[output]\ninterval = ";
    for interval in ["1e-300", "1e-12"] {
        assert!(scene::from_text(&arm(2, SECTION, &format!("{CLAMP}{stage}{interval}"))).is_err());
    }
    let sum = vec!["1"; 300_000].join("+");
    assert!(scene::from_text(&format!("[param]\na = \"{sum}\"\n")).is_err());
    let chain: String = (0..100_000).map(|k| format!("p{k} = \"p{}\"\n", k + 1)).collect();
    assert!(scene::from_text(&format!("[param]\n{chain}p100000 = 1\n")).is_err());
    assert!(scene::from_text(&format!("a = {}1{}\n", "[".repeat(10_000), "]".repeat(10_000))).is_err());
}

#[test]
fn a_number_that_is_too_large_is_an_error_and_not_dropped() {
    let load = "[[load]]\nat = \"tip\"\nforce = [0, 0, \"F\"]\n";
    let huge = format!("[param]\nF = 0x{}\n{}", "f".repeat(40), arm(2, SECTION, &format!("{CLAMP}{load}{STATIC}")));
    assert!(scene::from_text(&huge).is_err());
}

/// Forces that die out along a fine mesh pass through the smallest numbers there are.
#[test]
fn the_smallest_forces_do_no_harm() {
    let stage = "[[stage]]\nkind = \"dynamic\"\nend = 0.05\nstep = 0.01\n";
    let rest = format!("{CLAMP}[[load]]\nat = \"tip\"\nforce = [0, 0, 5]\n{stage}");
    let simulation = simulate(&arm(1000, "EA = 1e4\nGA = 1e4\nGJ = 1e3\nEI = 1e3\nrhoA = 1\nrhoJ = [2, 1, 1]", &rest));
    assert!(simulation.end("tip.uz") > 0.0);
}

/// A wheel on a torsion spring that wobbles a little: its turns are counted, or the run says that they cannot be.
#[test]
fn turns_of_a_wobbling_wheel_are_not_lost() {
    let wheel = |wobble: f64| {
        format!(
            "[point]\np = [0, 0, 0]\n[[body]]\nat = \"p\"\nmass = 1\ninertia = [1, 1, 1.5]\n\
             [[support]]\nat = \"p\"\nfix = \"pin\"\n[[spring]]\nat = \"p\"\nstiffness = [0, 0, 0, 0, 0, 0.5]\n\
             [[initial]]\nspin = [{wobble}, 0, 10]\n[[stage]]\nkind = \"dynamic\"\nend = 2.72\nstep = 0.001\n\
             [output]\ncolumns = [\"rc\", \"energy\"]\n"
        )
    };
    let quiet = simulate(&wheel(0.0));
    // The quarter period of sqrt(k/J), where the wheel has turned by spin sqrt(J/k).
    assert!((quiet.end("p.rz") - 10.0 * 3.0_f64.sqrt()).abs() < 1e-3, "{}", quiet.end("p.rz"));
    for wobble in [1e-4, 1e-3, 1e-2, 0.1] {
        let simulation = attempt(&wheel(wobble));
        match &simulation.result {
            Ok(()) => assert!((simulation.end("p.rz") - 17.32).abs() < 0.2, "{wobble}: {}", simulation.end("p.rz")),
            Err(failure) => assert!(failure.to_string().contains("has left its axis"), "{wobble}: {failure}"),
        }
    }
}

/// A body that spins about an axis that is not quite its own: ten turns read 20 pi.
#[test]
fn continued_rotation_vectors_do_not_lose_turns_to_a_wobble() {
    let text = "[point]\np = [0, 0, 0]\n[[body]]\nat = \"p\"\nmass = 1\ninertia = [1, 1, 1.5]\n\
                [[support]]\nat = \"p\"\nfix = \"pin\"\n[[initial]]\nspin = [0.05, 0, 10]\n\
                [[stage]]\nkind = \"dynamic\"\nend = 6.283185307179586\nstep = 0.002\n[output]\ncolumns = [\"rc\"]\n";
    let rz = simulate(text).column("p.rz");
    assert!((rz.last().unwrap() - 62.83).abs() < 1.0, "{}", rz.last().unwrap());
    let jump = rz.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    assert!(jump < 2.0, "{jump}");
}

#[test]
fn unknown_names_are_told_beside_other_errors() {
    let text = arm(0, "EA = -1\nGA = 1\nGJ = 1\nEI = 1", &format!("{CLAMP}{STATIC}"))
        .replace("elements = 0", "elements = 2\norder = 7")
        + "[[load]]\nat = \"tpp\"\nforce = [0, 0, 1]\nhistory = \"hh\"\n";
    let errors = scene::from_text(&text).err().expect("it is wrong in four places");
    let messages: Vec<&str> = errors.iter().map(|e| e.message.as_str()).collect();
    for words in ["`EA` must be positive", "`order` must be 1, 2 or 3", "no node `tpp`"] {
        assert!(messages.iter().any(|m| m.contains(words)), "{words}: {messages:?}");
    }
    assert!(!messages.iter().any(|m| m.contains("`s`") || m.contains("`tip`")), "{messages:?}");
}
