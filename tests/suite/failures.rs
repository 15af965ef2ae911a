//! Runs that must end in a named failure, with the right node and direction.

use crate::scenes::{attempt, frequencies};
use beamsim_core::run::Failure;

const ARM: &str = r#"
[point]
root = [0, 0, 0]
tip = [1, 0, 0]
[section.s]
EA = 1e3
GA = 1e3
GJ = 10
EI = 10
rhoA = 1
[[beam]]
name = "arm"
section = "s"
through = ["root", "tip"]
elements = 2
"#;

fn failure(text: &str) -> Failure {
    attempt(&format!("{ARM}{text}")).result.expect_err("the run must fail")
}

fn singular_place(text: &str) -> String {
    match failure(text) {
        Failure::Singular { place: Some(place), .. } => place.to_string(),
        other => panic!("expected a named mechanism, found {other}"),
    }
}

#[test]
fn a_beam_that_a_moment_spins_is_a_mechanism() {
    let place = singular_place(
        "[[support]]\nat = \"root\"\nfix = \"pin\"\n[[support]]\nat = \"tip\"\nfix = [\"uy\", \"uz\"]\n\
         [[load]]\nat = \"tip\"\nmoment = [1, 0, 0]\n\
         [[stage]]\nkind = \"static\"\nsteps = 1\n",
    );
    assert!(place.ends_with("rotation about x"), "{place}");
}

#[test]
fn a_loose_part_is_named() {
    let place = singular_place(
        "[[support]]\nat = \"root\"\nfix = [\"uy\", \"uz\", \"rx\", \"ry\", \"rz\"]\n[[stage]]\nkind = \"static\"\nsteps = 1\n",
    );
    assert!(place.ends_with("displacement along x"), "{place}");
}

#[test]
fn a_hinge_in_statics_is_a_mechanism() {
    let place = singular_place(
        "[[support]]\nat = \"root\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"ry\"]\n\
         [[load]]\nat = \"tip\"\nforce = [0, 0, 1]\n[[stage]]\nkind = \"static\"\nsteps = 1\n",
    );
    assert!(place.contains("rotation about z") || place.contains("displacement along y"), "{place}");
}

#[test]
fn a_history_without_a_value_is_not_finite() {
    let failure = failure(
        "[[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 0, 1]\nhistory = \"h\"\n\
         [history.h]\nexpr = \"1/(t - 0.5)\"\n[[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.1\n",
    );
    assert!(matches!(&failure, Failure::NonFinite { node, .. } if node == "tip"), "{failure}");
}

#[test]
fn a_mesh_that_turns_too_far_from_node_to_node_is_refused() {
    let failure = failure(
        "[[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nmoment = [0, 0, \"10*5.8\"]\n\
         [[stage]]\nkind = \"static\"\nsteps = 10\n",
    );
    match failure {
        Failure::MeshTooCoarse { relative_rotation, .. } => assert!((relative_rotation - 2.9).abs() < 0.3),
        other => panic!("{other}"),
    }
}

#[test]
fn too_few_iterations_are_told_with_the_residual() {
    let failure = failure(
        "[[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 0, 20]\n\
         [[stage]]\nkind = \"static\"\nsteps = 1\nadaptive = false\nmax_iterations = 2\n",
    );
    match failure {
        Failure::NotConverged { at, residual, history, .. } => {
            assert_eq!((at.stage, history.len()), (1, 3));
            assert!(residual > 0.0 && residual.is_finite());
        }
        other => panic!("{other}"),
    }
}

/// A von Mises truss pushed through and pulled back by a history, which no arc length follows.
#[test]
fn a_snap_under_a_history_is_told_what_to_try() {
    let text = "[point]\nleft = [0, 0, 0]\ncrown = [1, 0, 0.1]\nright = [2, 0, 0]\n\
         [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 100\nEI = 1\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"left\", \"crown\", \"right\"]\nelements = 2\norder = 2\naxis3 = [0, 1, 0]\n\
         [[support]]\nat = \"left\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"rz\"]\n\
         [[support]]\nat = \"right\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"rz\"]\n\
         [[load]]\nat = \"crown\"\nforce = [0, 0, -20]\nhistory = \"h\"\n[history.h]\ntimes = [0, 0.5, 1]\nvalues = [0, 1, 0]\n\
         [[stage]]\nkind = \"static\"\nsteps = 20\n";
    let simulation = attempt(text);
    assert_eq!(simulation.result.expect_err("it snaps").name(), "not_converged");
    assert!(simulation.hint.is_some_and(|hint| hint.contains("`history`")));
}

#[test]
fn a_motion_that_would_jump_is_an_error_of_the_deck() {
    let failure = failure(
        "[[support]]\nat = \"root\"\nfix = \"all\"\n[[motion]]\nat = \"tip\"\nuy = 0.1\nstages = [2]\n\
         [[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.1\n[[stage]]\nkind = \"dynamic\"\nend = 0.2\nstep = 0.1\n",
    );
    assert_eq!(failure.name(), "deck");
    assert!(failure.to_string().contains("must start at 0, where the node is, but starts at 0.1"), "{failure}");
}

#[test]
fn rows_before_a_failure_are_kept() {
    let text = format!(
        "{ARM}[[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nmoment = [0, 0, \"10*5.8\"]\n\
         [[stage]]\nkind = \"static\"\nsteps = 10\n"
    );
    let simulation = attempt(&text);
    assert!(simulation.result.is_err());
    assert!(simulation.rows.len() > 5, "{} rows", simulation.rows.len());
}

/// Near the limits of floating point lengths along a path are no numbers any more: a search for a shorter one must end all the same.
#[test]
fn forces_near_the_limits_of_floating_point_end_in_a_name() {
    for force in ["1e20", "1e200", "1e300"] {
        let deck = format!(
            "{}[[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 0, {force}]\n[[stage]]\nkind = \"static\"\nsteps = 2\n",
            ARM.replace("elements = 2", "elements = 8\norder = 2")
        );
        let failure = attempt(&deck).result.expect_err("the run must fail");
        assert!(["not_converged", "non_finite", "mesh_too_coarse"].contains(&failure.name()), "{force}: {failure}");
    }
}

/// A pendulum that hangs at rest, in axes in which it does so but for round-off: what it gains is that.
#[test]
fn round_off_is_no_growth_of_energy() {
    let text = "gravity = [6.570175082125996, 6.7714052935322195, -2.6864418365068885]\n[point]\na = [0, 0, 0]\n\
        b = [0.6697426179537203, 0.690255381603692, -0.2738472820088571]\n\
        [[body]]\nat = \"a\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\n[[body]]\nat = \"b\"\nmass = 3\ninertia = [0.2, 0.2, 0.2]\n\
        [[support]]\nat = \"a\"\nfix = \"all\"\n[[joint]]\nkind = \"revolute\"\nnodes = [\"a\", \"b\"]\nat = \"a\"\n\
        axis = [-0.6159387362363827, 0.7223533725327984, 0.31436456287886516]\n\
        [[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.01\nscheme = \"generalized_alpha\"\n";
    let ended = attempt(text).result;
    assert!(ended.is_ok(), "{ended:?}");
}

/// Where few modes are asked for, they are all rigid: a second look about a part of the lowest elastic one has none to go by.
#[test]
fn rigid_motions_alone_are_modes() {
    for (modes, stiff) in [(1, false), (3, false), (6, false), (8, true)] {
        let text = format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0.5, 0]\n[section.s]\nEA = 1e5\nGA = 4e4\nGJ = 8\nEI = 10\nrhoA = 1\n\
             rhoJ = [3e-3, 1e-3, 2e-3]\n[[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 1\n\
             [[stage]]\nkind = \"modal\"\nmodes = {modes}\n"
        );
        let found = frequencies(&text);
        assert_eq!(found.len(), modes);
        assert!(found.iter().take(6).all(|omega| *omega < 1e-3), "{found:?}");
        assert_eq!(found.iter().any(|omega| *omega > 1.0), stiff, "{found:?}");
    }
}
