//! What goes through several stages: histories that belong to some of them, what jumps between them, and what cannot begin.

use crate::random::Random;
use crate::scenes::{self, frequencies, list};
use crate::scenes::{attempt, refusal, simulate, warnings};
use beamsim_core::tensor::Vec3;
use beamsim_core::warning::WarningKind;

/// A clamped beam.
const ARM: &str = r#"
[point]
root = [0, 0, 0]
tip = [1, 0, 0]
[section.s]
EA = 1e5
GA = 1e5
GJ = 10
EI = 10
rhoA = 1
rhoJ = [1e-3, 1e-3, 1e-3]
[[beam]]
name = "arm"
section = "s"
through = ["root", "tip"]
elements = 2
"#;

const CLAMP: &str = "[[support]]\nat = \"root\"\nfix = \"all\"\n";
const STATIC: &str = "[[stage]]\nkind = \"static\"\nsteps = 2\n";

fn dynamic(end: f64) -> String {
    format!("[[stage]]\nkind = \"dynamic\"\nend = {end:?}\nstep = 0.01\nscheme = \"generalized_alpha\"\n")
}

/// A body on a spring to ground, loaded along y.
fn sprung(history: &str, stages: &str) -> String {
    format!(
        "[point]\no = [0, 0, 0]\n[[body]]\nat = \"o\"\nmass = 1\n[[spring]]\nat = \"o\"\nstiffness = [10, 10, 10, 1, 1, 1]\n\
         damping = [40, 40, 40, 1, 1, 1]\n[[load]]\nat = \"o\"\nforce = [0, 1, 0]\nhistory = {history}\n\
         [history.h]\ntimes = [0, 1, 2]\nvalues = [0, 1, 1]\n{stages}[output]\ncolumns = [\"u\"]\n"
    )
}

#[test]
fn a_history_belongs_to_its_stages() {
    let stages = format!("{STATIC}{}{}{STATIC}", dynamic(0.5), dynamic(1.0));
    // Each stage at its end: nothing before the second dynamic stage, half of the history in it, and held behind.
    let own = simulate(&sprung("{ name = \"h\", stages = [3] }", &stages));
    let uy = own.column("o.uy");
    assert_eq!(uy[..53], [0.0; 53]);
    assert!((own.end("o.uy") - 0.05).abs() < 1e-9, "{}", own.end("o.uy"));
    // The load factor of the first stage, and its last value in all others.
    let first = simulate(&sprung("{ name = \"h\", stages = [1] }", &stages));
    assert!(first.column("o.uy")[2..].iter().all(|u| (u - 0.1).abs() < 1e-9));
    // Both dynamic stages: the time goes on.
    let both = simulate(&sprung("{ name = \"h\", stages = [2, 3] }", &stages));
    assert!((both.end("o.uy") - 0.1).abs() < 1e-9, "{}", both.end("o.uy"));
}

#[test]
fn what_a_history_begins_with_is_brought_in_by_the_load_factor() {
    let text = sprung("{ name = \"h\", stages = [2] }", &format!("{STATIC}{}", dynamic(0.1)))
        .replace("values = [0, 1, 1]", "values = [2, 2, 2]");
    let run = simulate(&text);
    for (came, value) in run.column("o.uy").iter().zip([0.0, 0.1, 0.2, 0.2, 0.2]) {
        assert!((came - value).abs() < 1e-9, "{came} {value}");
    }
}

#[test]
fn histories_that_jump_between_stages_are_told() {
    let jumps = |history: &str, stages: &str| {
        let told = warnings(&sprung(history, stages));
        told.into_iter().filter(|message| message.contains("jumps from")).collect::<Vec<_>>()
    };
    let stages = format!("{STATIC}{}", dynamic(0.5));
    let told = jumps("\"h\"", &stages);
    assert!(told.len() == 1 && told[0].contains("of this load jumps from 1 to 0 at the start of stage 2"), "{told:?}");
    for own in ["{ name = \"h\", stages = [1] }", "{ name = \"h\", stages = [2] }"] {
        assert!(jumps(own, &stages).is_empty(), "{own}");
    }
    assert!(jumps("\"h\"", &format!("{}{}", dynamic(0.5), dynamic(1.0))).is_empty());
    assert_eq!(jumps("\"h\"", &format!("{STATIC}{STATIC}")).len(), 1);
    // A sudden load, and one that comes to its stage, jump nowhere.
    assert!(jumps("\"h\"", &dynamic(0.5)).is_empty());
    // What ends at an `until` ends nobody knows where.
    let until = STATIC.replace("steps = 2", "steps = 2\nuntil = { column = \"o.uy\", above = 1 }");
    assert!(jumps("\"h\"", &format!("{until}{}", dynamic(0.5))).is_empty());
}

#[test]
fn motions_that_jump_between_static_stages_are_told() {
    let motion = "[[motion]]\nat = \"tip\"\nuy = 0.1\nhistory = \"h\"\n[history.h]\ntimes = [0, 1]\nvalues = [0, 1]\n";
    let told = warnings(&format!("{ARM}{CLAMP}{motion}{STATIC}{STATIC}"));
    assert!(
        told.len() == 1 && told[0].contains("of this motion jumps from 0.1 to 0 at the start of stage 2"),
        "{told:?}"
    );
    assert!(warnings(&format!("{ARM}{CLAMP}{motion}{STATIC}")).is_empty());
}

/// An arm that is turned, or pushed, at a constant speed.
fn moved(motion: &str, history: &str, initial: &str) -> Vec<String> {
    warnings(&format!("{ARM}{motion}history = \"h\"\n[history.h]\n{history}\n{initial}{}", dynamic(2.0)))
}

#[test]
fn a_motion_that_begins_with_the_velocity_of_its_node_is_no_jump() {
    let push = "[[support]]\nat = \"root\"\nfix = [\"uy\", \"uz\", \"rx\", \"ry\", \"rz\"]\n[[motion]]\nat = \"root\"\nux = 1\n";
    let turn = "[[support]]\nat = \"root\"\nfix = \"pin\"\n[[motion]]\nat = \"root\"\nrotate = [0, 0, 1]\nangle = 1\n";
    let velocity = "[[initial]]\nvelocity = [5, 0, 0]\n";
    let spin = "[[initial]]\nspin = [0, 0, 5]\n";
    let (formula, table) = ("expr = \"5*t\"", "times = [0, 2]\nvalues = [0, 10]");
    for (motion, initial) in [(push, velocity), (turn, spin)] {
        for history in [formula, table] {
            assert!(moved(motion, history, initial).is_empty(), "{:?}", moved(motion, history, initial));
            let told = moved(motion, history, "");
            assert!(told.len() == 1 && told[0].contains("with a velocity of 5"), "{told:?}");
            assert_eq!(moved(motion, history, &initial.replace('5', "4")).len(), 1);
        }
        // About, or along, another axis.
        assert_eq!(
            moved(motion, formula, &initial.replace("5, 0, 0", "0, 5, 0").replace("0, 0, 5", "5, 0, 0")).len(),
            1
        );
        // Kinks within the stage.
        let told = moved(motion, "times = [0, 1, 2]\nvalues = [0, 5, 6]", initial);
        assert!(told.len() == 1 && told[0].contains("has kinks: velocities jump there, first at time 1"), "{told:?}");
        assert!(moved(motion, "times = [0, 1, 2]\nvalues = [0, 5, 6]\nsmooth = true", "").is_empty());
    }
}

/// Two arms with a motor between them, or one with a motor to ground.
fn driven(ground: bool, history: &str, initial: &str, stages: &str) -> String {
    let joint = |rest: &str| {
        format!(
            "[[joint]]\nkind = \"revolute\"\n{rest}\naxis = [0, 0, 1]\nangle = 1\nhistory = \"h\"\n[history.h]\n{history}\n"
        )
    };
    let scene = match ground {
        true => format!("{ARM}{}", joint("at = \"root\"\nbeams = [\"arm\"]")),
        false => {
            let second = "[[beam]]\nname = \"fore\"\nsection = \"s\"\nthrough = [\"tip\", \"end\"]\nelements = 2\n";
            let arm = ARM.replace("tip = [1, 0, 0]", "tip = [1, 0, 0]\nend = [2, 0, 0]");
            format!("{arm}{second}{CLAMP}{}", joint("at = \"tip\"\nbeams = [\"arm\", \"fore\"]"))
        }
    };
    format!("{scene}{initial}{stages}")
}

#[test]
fn motors_with_kinks_are_told_as_motions_are() {
    for ground in [true, false] {
        let told = |history: &str, initial: &str| warnings(&driven(ground, history, initial, &dynamic(1.0)));
        let kinked = told("times = [0, 0.25, 0.5, 1]\nvalues = [0, 0, 0.5, 0.6]", "");
        assert!(kinked.len() == 1 && kinked[0].contains("of this motor has kinks"), "{kinked:?}");
        assert!(kinked[0].contains("first at time 0.25"), "{kinked:?}");
        assert!(told("times = [0, 1]\nvalues = [0, 0.5]\nsmooth = true", "").is_empty());
        let speed = told("expr = \"2*t\"", "");
        assert!(speed.len() == 1 && speed[0].contains("this motor starts stage"), "{speed:?}");
        let beam = if ground { "arm" } else { "fore" };
        let spin = format!("[[initial]]\nbeam = \"{beam}\"\nspin = [0, 0, 2]\n");
        assert!(told("expr = \"2*t\"", &spin).is_empty(), "{:?}", told("expr = \"2*t\"", &spin));
    }
}

#[test]
fn a_profile_after_preload_runs_where_its_history_belongs_to_its_stage() {
    let stages = format!("{STATIC}{}", dynamic(0.2));
    let profile = "times = [0, 0.1]\nvalues = [0.3, 0.5]\nsmooth = true";
    for ground in [true, false] {
        // Read over the load factor it would end where the motor does not begin.
        let text = driven(ground, profile, "", &stages);
        let why = refusal(&text);
        assert!(
            why.contains("stage 2: the mot")
                && why.contains("must start at 0.5 rad (28.6°), where the ")
                && why.contains("starts at 0.3"),
            "{why}"
        );
        assert!(why.contains("stages = [2]"), "{why}");
        let own = text.replace("history = \"h\"", "history = { name = \"h\", stages = [2] }");
        assert!(warnings(&own).is_empty());
        let run = simulate(&(own + "[output]\ncolumns = [\"r\"]\n"));
        let turned = if ground { run.column("root.rz") } else { Vec::new() };
        for (came, value) in turned.iter().zip([0.0, 0.15, 0.3]) {
            assert!((came - value).abs() < 1e-12, "{came} {value}");
        }
        assert!(!ground || (run.end("root.rz") - 0.5).abs() < 1e-12);
    }
}

#[test]
fn what_cannot_begin_is_refused_before_anything_is_computed() {
    let path = "[[stage]]\nkind = \"static\"\ncontrol = \"arc_length\"\nsteps = 4\n";
    let buckling = "[[stage]]\nkind = \"buckling\"\nmodes = 1\n";
    let modal = "[[stage]]\nkind = \"modal\"\nmodes = 1\n";
    let load = "[[load]]\nat = \"tip\"\nforce = [0, 1, 0]\nstages = [1]\n";
    let held = "[[support]]\nat = \"tip\"\nfix = \"all\"\nstages = [2]\n";
    let motion = "[[motion]]\nat = \"tip\"\nrotate = [0, 0, 1]\nangle = 1\nstages = [1]\n";
    let hinge = "[[support]]\nat = \"tip\"\nfix = [\"rz\"]\nstages = [2]\n";
    let massless = ARM.replace("rhoA = 1", "rhoA = 0").replace("rhoJ = [1e-3, 1e-3, 1e-3]", "");
    let moved = "[[motion]]\nat = \"tip\"\nuy = 0.1\nhistory = \"h\"\n[history.h]\nexpr = \"t\"\n";
    let cases = [
        (format!("{ARM}{CLAMP}{path}"), "stage 1: control = \"arc_length\" needs a load"),
        (format!("{ARM}{CLAMP}{STATIC}{path}"), "stage 2: control = \"arc_length\" needs a load"),
        (format!("{ARM}{CLAMP}{STATIC}{buckling}"), "stage 2: a buckling stage needs a load"),
        (format!("{massless}{CLAMP}{load}{STATIC}{modal}"), "stage 2: a modal stage needs mass"),
        (
            format!("{}{CLAMP}{held}{STATIC}{modal}", ARM.replace("elements = 2", "elements = 1")),
            "stage 2: a modal stage",
        ),
        (format!("{ARM}{CLAMP}{motion}{hinge}{STATIC}{STATIC}"), "stage 2: a support fixes single rotation"),
        (format!("{ARM}{CLAMP}{moved}{STATIC}{}", dynamic(0.5)), "stage 2: the motion of node \"tip\" must start at"),
    ];
    for (text, words) in cases {
        let why = refusal(&text);
        assert!(why.contains(words), "{words}\n{why}");
    }
    // The load is still there, and grows on; a motion that ended where the node is now free begins nobody knows where.
    let grows = "[[load]]\nat = \"tip\"\nforce = [0, -0.1, 0]\n";
    assert!(attempt(&format!("{ARM}{CLAMP}{grows}{STATIC}{buckling}")).result.is_ok());
    let free = "[[load]]\nat = \"tip\"\nforce = [0, 1, 0]\n[[motion]]\nat = \"tip\"\nuy = 0.1\nstages = [2]\n";
    assert!(attempt(&format!("{ARM}{CLAMP}{free}{STATIC}{}", dynamic(0.5))).result.is_err());
}

/// A portal whose mass sits at its corners: the girder is rigid and the columns are clamped at both ends.
#[test]
fn massless_frames_carry_bodies() {
    let text = |mass: &str, rest: &str| {
        format!(
            "[point]\na = [0, 0, 0]\nb = [0, 0, 3]\nc = [4, 0, 3]\nd = [4, 0, 0]\n\
             [section.column]\nEA = 1e9\nGA = 1e9\nGJ = 1e4\nEI = 1e4\n{mass}\n[section.girder]\nEA = 1e9\nGA = 1e9\nGJ = 1e9\nEI = 1e9\n{mass}\n\
             [[beam]]\nname = \"l\"\nsection = \"column\"\nthrough = [\"a\", \"b\"]\nelements = 2\norder = 3\n\
             [[beam]]\nname = \"g\"\nsection = \"girder\"\nthrough = [\"b\", \"c\"]\nelements = 1\norder = 3\n\
             [[beam]]\nname = \"r\"\nsection = \"column\"\nthrough = [\"d\", \"c\"]\nelements = 2\norder = 3\n\
             [[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"d\"\nfix = \"all\"\n{rest}\n[[stage]]\nkind = \"modal\"\nmodes = 3\n"
        )
    };
    let bodies = "[[body]]\nat = \"b\"\nmass = 50\n[[body]]\nat = \"c\"\nmass = 50\n";
    for mass in ["rhoA = 0", ""] {
        let found = frequencies(&text(mass, bodies));
        let sway = (2.0_f64 * 12.0 * 1e4 / 27.0 / 100.0).sqrt();
        assert!(found.iter().any(|mode| (mode / sway - 1.0).abs() < 1e-3), "{found:?}");
    }
    assert!(warnings(&text("rhoA = 0", bodies)).is_empty());
    let told = warnings(&text("", bodies));
    assert!(told.len() == 2 && told[0].contains("section `column` has no mass"), "{told:?}");
    assert!(refusal(&text("", "")).contains("section `column` needs `rhoA` for a stage with inertia"));
}

/// Hints name what helps and never what the deck has.
#[test]
fn hints_know_the_deck() {
    let load = |force: f64| format!("{ARM}{CLAMP}[[load]]\nat = \"tip\"\nforce = [0, 0, {force:?}]\n");
    let hint = |stage: &str| {
        let run = attempt(&format!("{}{stage}max_iterations = 1\n", load(1e8)));
        run.hint.unwrap_or_else(|| panic!("{stage}: {:?}", run.result))
    };
    let few = hint("[[stage]]\nkind = \"static\"\nsteps = 2\n");
    assert!(few.contains("use more than 2 `steps`") && few.contains("`[damping]`"), "{few}");
    let many = hint("[[stage]]\nkind = \"static\"\nsteps = 2000\n");
    assert!(!many.contains("`steps`"), "{many}");
    let straight = hint("[[stage]]\nkind = \"static\"\nsteps = 2\nadaptive = false\n");
    assert!(straight.contains("remove `adaptive = false`"), "{straight}");
    let with = |scheme: &str| hint(&format!("[[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.1\n{scheme}\n"));
    assert!(with("").contains("scheme = \"generalized_alpha\""), "{}", with(""));
    assert!(with("scheme = \"hht\"").contains("with a small `rho_inf`"));
    let damped = with("scheme = \"generalized_alpha\"");
    assert!(damped.contains("a smaller `rho_inf`") && !damped.contains("scheme ="), "{damped}");
    let most = with("scheme = \"generalized_alpha\"\nrho_inf = 0");
    assert!(!most.contains("rho_inf") && most.contains("a smaller `step`"), "{most}");
    // A mechanism that no load holds needs a support; in a path it may come to rest in a stage before.
    let hinge = "[[support]]\nat = \"root\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"ry\"]\n";
    let loose = |rest: &str| attempt(&format!("{ARM}{hinge}{rest}")).hint.unwrap_or_default();
    assert_eq!(
        loose(STATIC),
        "add a support, a spring or a joint that constrains this direction: the loads do not stabilise it either"
    );
    let path = "[[load]]\nat = \"tip\"\nforce = [0, 1, 0]\n[[stage]]\nkind = \"static\"\ncontrol = \"arc_length\"\nsteps = 2\n";
    assert!(loose(path).contains("put a static stage with load levels before this one"), "{}", loose(path));
}

/// Angular momentum about node `o` before and after a second stage pins it.
fn caught(parts: &str, scheme: &str) -> [[f64; 3]; 2] {
    let stage =
        |end: f64| format!("[[stage]]\nkind = \"dynamic\"\nend = {end:?}\nstep = 1e-5\nscheme = \"{scheme}\"\n");
    let run = simulate(&format!(
        "[point]\no = [0, 0, 0]\n{parts}[[support]]\nat = \"o\"\nfix = \"pin\"\nstages = [2]\n{}{}[output]\nnodes = [\"o\"]\n\
         columns = [\"u\", \"v\", \"momentum\"]\n",
        stage(3e-4),
        stage(3.2e-4)
    ));
    let values = |prefix: &str, row: usize| ["x", "y", "z"].map(|axis| run.column(&format!("{prefix}{axis}"))[row]);
    let speed = |row: usize| values("o.v", row).iter().fold(0.0, |sum: f64, v| sum.max(v.abs()));
    let first = (0..run.rows.len()).find(|&row| speed(row) < 1e-12).unwrap();
    assert!(first > 20 && speed(first - 1) > 0.1);
    [first - 1, first].map(|row| {
        let [x, p, l] = ["o.u", "momentum.p", "momentum.l"].map(|prefix| Vec3(values(prefix, row)));
        (l - x.cross(p)).0
    })
}

#[test]
fn a_support_that_catches_what_moves_keeps_the_angular_momentum_about_it() {
    let mut random = Random::new(77);
    let mut list = |size: f64| scenes::list(random.cube(size));
    for _ in 0..3 {
        let body = format!(
            "[[body]]\nat = \"o\"\nmass = 2\ninertia = [0.3, 0.4, 0.5]\noffset = {}\n[[initial]]\nvelocity = {}\nspin = {}\n",
            list(1.0),
            list(3.0),
            list(2.0)
        );
        let chain = format!(
            "q = {}\n{body}[[body]]\nat = \"q\"\nmass = 1\ninertia = [0.1, 0.2, 0.15]\noffset = {}\n\
             [[joint]]\nkind = \"revolute\"\nnodes = [\"o\", \"q\"]\naxis = {}\n",
            list(1.0),
            list(0.5),
            list(1.0)
        );
        let rod = format!(
            "e = {}\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 10\nEI = 10\nrhoA = 1\nrhoJ = [2e-3, 1e-3, 1e-3]\n[[beam]]\n\
             name = \"b\"\nsection = \"s\"\nthrough = [\"o\", \"e\"]\nelements = 3\norder = 2\n[[initial]]\nvelocity = {}\n",
            list(1.0),
            list(3.0)
        );
        for parts in [&body, &chain, &rod] {
            for scheme in ["generalized_alpha", "lie_generalized_alpha", "newmark", "lobatto"] {
                let [before, after] = caught(parts, scheme);
                let size = before.iter().fold(0.0, |size: f64, l| size.max(l.abs()));
                let error = (0..3).map(|k| (after[k] - before[k]).abs()).fold(0.0, f64::max);
                assert!(error < 2e-5 * size, "{scheme}: {before:?} {after:?}\n{parts}");
            }
        }
    }
}

#[test]
fn a_body_that_is_caught_beside_its_centre_turns_on() {
    // m v d = (J + m d^2) w about the pin.
    let body =
        "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 2\ninertia = [0.3, 0.3, 0.3]\noffset = [0, -1, 0]\n";
    let stages = "[[support]]\nat = \"a\"\nfix = \"pin\"\nstages = [2]\n[[initial]]\nat = \"a\"\nvelocity = [1, 0, 0]\n\
                  [[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.01\n[[stage]]\nkind = \"dynamic\"\nend = 0.2\nstep = 0.01\n";
    let run = simulate(&format!("{body}{stages}[output]\ncolumns = [\"w\"]\n"));
    assert!((run.end("a.wz") - 2.0 / 2.3).abs() < 1e-9, "{}", run.end("a.wz"));
}

#[test]
fn a_load_whose_history_is_over_comes_back_with_its_last_value() {
    let bar = "[point]\nroot = [0, 0, 0]\ntip = [1, 0, 0]\n[section.s]\nEA = 100\nGA = 100\nGJ = 1\nEI = 1\nrhoA = 1\n[[beam]]\n\
               name = \"arm\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 1\n[[support]]\nat = \"root\"\n\
               fix = \"all\"\n[history.h]\ntimes = [0, 1]\nvalues = [0, 0.5]\n";
    let at = |acts: &str| {
        let run = simulate(&format!("{bar}{acts}{STATIC}{STATIC}{STATIC}[output]\ncolumns = [\"u\"]\n"));
        run.end("tip.ux")
    };
    let history = "stages = [1, 3]\nhistory = { name = \"h\", stages = [1] }\n";
    assert!((at(&format!("[[load]]\nat = \"tip\"\nforce = [10, 0, 0]\n{history}")) - 0.05).abs() < 1e-6);
    assert!((at(&format!("[[motion]]\nat = \"tip\"\nux = 0.1\n{history}")) - 0.05).abs() < 1e-9);
}

#[test]
fn a_stage_may_end_before_the_one_before_it_could_have() {
    let body =
        "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 2\n[[initial]]\nat = \"a\"\nvelocity = [1, 0, 0]\n";
    let stages = "[[stage]]\nkind = \"dynamic\"\nend = 10\nstep = 0.01\nuntil = { column = \"a.ux\", above = LIMIT }\n\
                  [[stage]]\nkind = \"dynamic\"\nend = 1.6\nstep = 0.01\n[output]\ncolumns = [\"u\"]\n";
    let run = simulate(&format!("{body}{}", stages.replace("LIMIT", "0.6")));
    assert!((run.end("a.ux") - 1.6).abs() < 1e-9);
    let late = attempt(&format!("{body}{}", stages.replace("LIMIT", "3")));
    assert!(late.result.is_err_and(|failure| failure.to_string().contains("`end` is a time, not a duration")));
}

#[test]
fn a_support_of_another_stage_does_not_concern_increments() {
    let deck = |stages: &str| {
        format!(
            "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n[[support]]\nat = \"a\"\n\
             fix = [\"ux\", \"uy\", \"uz\", \"rx\"]\nstages = {stages}\n[[support]]\nat = \"a\"\nfix = \"all\"\nstages = [1]\n\
             [[stage]]\nkind = \"static\"\nsteps = 1\n[[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.01\n\
             scheme = \"lie_generalized_alpha\"\n"
        )
    };
    assert!(refusal(&deck("[2]")).contains("cannot fix a single rotation component"));
    assert!(attempt(&deck("[1]")).result.is_ok());
}

/// A top that hangs from a pin, with its own axis upright, and spins.
#[test]
fn modes_of_what_turns_are_told_to_be_those_at_rest() {
    let deck = |spin: f64| {
        format!(
            "gravity = [0, 0, -10]\n[point]\no = [0, 0, 0]\n[[body]]\nat = \"o\"\nmass = 1\ninertia = [0.1, 0.1, 0.15]\n\
             offset = [0, 0, -0.5]\n[[support]]\nat = \"o\"\nfix = \"pin\"\n[[initial]]\nat = \"o\"\nspin = [0, 0, {spin:?}]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.01\n[[stage]]\nkind = \"modal\"\nmodes = 3\n"
        )
    };
    let warned =
        |spin: f64| attempt(&deck(spin)).counters.findings.warnings.iter().any(|w| w.kind == WarningKind::OutOfBalance);
    assert!(warned(30.0) && !warned(1e-3));
}

/// A frame goes on from the spin and the axis of the stage before: on the way each state is that of a frame of its own.
#[test]
fn a_frame_goes_from_the_motion_of_the_stage_before_to_its_own() {
    let stage = |steps: usize, spin: f64, about: f64| {
        format!(
            "[[stage]]\nkind = \"static\"\nsteps = {steps}\nframe = {{ spin = [0, 0, {spin:?}], about = [{about:?}, 0, 0] }}\n"
        )
    };
    let output = "[output]\ncolumns = [\"u\"]\nnodes = [\"tip\"]\n";
    let run = |stages: &str| simulate(&format!("{ARM}{CLAMP}{stages}{output}"));
    let alone = |spin: f64, about: f64| run(&stage(1, spin, about)).end("tip.ux");
    let mut random = Random::new(88);
    for _ in 0..6 {
        let [first, second] = [0, 1].map(|_| [random.range(-8.0, 8.0), random.range(-1.0, 0.0)]);
        let both = stage(2, first[0], first[1]) + &stage(4, second[0], second[1]);
        let ux = run(&(both + &stage(1, second[0], second[1]))).column("tip.ux");
        let expected: Vec<f64> = [0.25, 0.5, 0.75, 1.0, 1.0]
            .iter()
            .map(|part| alone(first[0] + (second[0] - first[0]) * part, first[1] + (second[1] - first[1]) * part))
            .collect();
        for (found, expected) in ux[3..].iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-12, "{first:?} {second:?}: {ux:?} {expected:?}");
        }
        assert_eq!(ux.len(), 8);
    }
}

/// Forces of round-off are no imbalance.
#[test]
fn round_off_is_not_out_of_balance() {
    let deck = "[point]\na = [0, 0, 0]\nb = [0.1, 0.2, 0.3]\n[[body]]\nat = \"a\"\nmass = 1\ninertia = [1, 1, 1]\n\
                [[body]]\nat = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n[[spring]]\nat = \"a\"\nstiffness = [1, 1, 1, 1, 1, 1]\n\
                [[spring]]\nat = \"b\"\nstiffness = [1, 1, 1, 1, 1, 1]\n[[spring]]\nbetween = [\"a\", \"b\"]\nstiffness = 1\n\
                length = 0.3741657386773941\n[[stage]]\nkind = \"static\"\nsteps = 1\n[[stage]]\nkind = \"modal\"\nmodes = 2\n";
    let warned = simulate(deck).counters.findings.warnings;
    assert!(warned.is_empty(), "{warned:?}");
    let pulled = deck.replace("0.3741657386773941", "0.36").replace("[[stage]]\nkind = \"static\"\nsteps = 1\n", "");
    let warned = simulate(&pulled).counters.findings.warnings;
    assert!(warned.iter().any(|warning| warning.kind == WarningKind::OutOfBalance), "{warned:?}");
}

/// A bead that lies on the true arc, off the smooth curve through the nodes of a coarse one, begins a dynamic stage: it swings
/// to the other side.
#[test]
fn a_bead_beside_the_line_begins_a_dynamic_stage() {
    let held: String = (0..=24).map(|node| format!("[[support]]\nat = \"R:{node}\"\nfix = \"all\"\n")).collect();
    let (sin, cos) = 1.0_f64.sin_cos();
    let deck = format!(
        "gravity = [0, 0, -9.81]\n[point]\na = [-1.0, 0, 0]\nb = [1.0, 0, 0]\np = [{:?}, 0, {:?}]\n[section.s]\nEA = 1e8\nGA = 1e8\n\
         GJ = 1e7\nEI = 1e7\n[[beam]]\nname = \"R\"\nsection = \"s\"\narc = [\"a\", [0, 0, -1.0], \"b\"]\nelements = 24\n{held}\
         [[body]]\nat = \"p\"\nmass = 2.0\n[[slider]]\nnodes = [\"p\"]\non = \"R\"\n[[stage]]\nkind = \"dynamic\"\nend = 1.09\n\
         step = 0.002\nscheme = \"generalized_alpha\"\nrho_inf = 0.95\n[output]\ncolumns = [\"x\"]\nnodes = [\"p\"]\n",
        -sin, -cos
    );
    let x = simulate(&deck).column("p.x");
    let farthest = x.iter().fold(f64::MIN, |m, x| m.max(*x));
    assert!((x[0] + sin).abs() < 1e-12 && (farthest - sin).abs() < 1e-3, "{farthest}");
}

/// A free strain that jumps where a dynamic stage begins does work: the account stays closed.
#[test]
fn a_free_strain_that_jumps_does_its_work() {
    for treated in ["", "[effects]\nlarge_rotations = false\n"] {
        let arm =
            ARM.replace("elements = 2\n", "elements = 2\nfree_strain = [1e-3, 0, 0, 0, 0.3, -0.2]\nhistory = \"h\"\n");
        let history = "[history.h]\ntimes = [0, 0.5, 1]\nvalues = [0, 0, 1]\n";
        let steps = dynamic(0.2).replace("step = 0.01", "step = 1e-4").replace("alpha\"", "alpha\"\nrho_inf = 1");
        let deck = format!(
            "{arm}{history}{CLAMP}{STATIC}{steps}[output]\nnodes = [\"tip\"]\ncolumns = [\"u\", \"energy\"]\n{treated}"
        );
        let run = simulate(&deck);
        let (total, strain) = (run.column("energy.total"), run.column("energy.strain"));
        let largest = strain.iter().fold(0.0_f64, |largest, &strain| largest.max(strain));
        let off = total.iter().fold(0.0_f64, |off, &now| off.max((now - total[0]).abs()));
        assert!(
            run.column("tip.uy").last().unwrap().abs() > 0.05 && off < 2e-3 * largest,
            "{treated}{off} of {largest}"
        );
        let told = run.counters.findings.warnings.iter().map(|warning| warning.kind);
        assert!(told.clone().all(|kind| kind != WarningKind::EnergyBalance), "{:?}", told.collect::<Vec<_>>());
    }
}

/// Centrifugal forces of a frame do work as loads do: on a blade that bends out under them, beside its weight and a
/// force that follows it, the account closes as the square of the length of levels.
#[test]
fn frames_do_work() {
    let mut random = Random::new(61);
    for case in 0..6 {
        let [outward, across] = random.axes();
        let (length_unit, force_unit) = (10f64.powf(random.range(-3.0, 3.0)), 10f64.powf(random.range(-3.0, 3.0)));
        let [spin, force] = [random.range(1.0, 3.0), random.range(0.5, 2.0)];
        let bending = force_unit * length_unit * length_unit;
        let off = |steps: usize| {
            let simulation = simulate(&format!(
                "{gravity}[section.s]\nEA = {axial}\nGA = {axial}\nGJ = {bending}\nEI = {bending}\nrhoA = {rho}\n\
                 rhoJ = {rho_j}\n[[beam]]\nname = \"m\"\nsection = \"s\"\nthrough = [[0, 0, 0], {tip}]\nelements = 4\norder = {order}\n\
                 [[body]]\nat = \"m@end\"\nmass = {rho}\noffset = {beside}\n[[support]]\nat = \"m@start\"\nfix = \"all\"\n\
                 [[load]]\nat = \"m@end\"\nframe = \"body\"\nforce = [0, {force}, 0]\n[output]\nnodes = []\ncolumns = [\"energy\"]\n\
                 [[stage]]\nkind = \"static\"\nsteps = {steps}\nframe = {{ spin = {spin}, about = {about} }}\n",
                gravity = match case % 2 {
                    0 => String::new(),
                    _ => format!("gravity = {}\n", list(random_weight(outward, across) * force_unit)),
                },
                axial = 1e4 * force_unit,
                rho = force_unit / length_unit,
                rho_j = list(Vec3([2e-2, 1e-2, 1e-2]) * (force_unit * length_unit)),
                tip = list(outward * length_unit),
                order = 1 + case % 3,
                beside = list(across * (0.1 * length_unit)),
                force = force * force_unit,
                spin = list((outward.cross(across) + outward * 0.4) * spin),
                about = list((across * 0.2 - outward * 0.3) * length_unit),
            ));
            let [total, external] = ["energy.total", "energy.external"].map(|column| simulation.end(column));
            total / external
        };
        let [coarse, fine] = [off(64), off(128)];
        let falls = coarse / fine;
        assert!(fine.abs() < 2e-3 && (3.5..4.5).contains(&falls), "{case}: {coarse:e}, {fine:e}");
    }
}

/// A weight of about 0.3 in lengths and forces of one.
fn random_weight(outward: Vec3, across: Vec3) -> Vec3 {
    (outward.cross(across) - across * 0.5) * 0.3
}
