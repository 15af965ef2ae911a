//! Help for keys and words that the deck does not know: first from tables of what users of other
//! programs write, then the nearest known word.

use std::cmp::Reverse;

/// Help for a word that is not known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Hint {
    /// A known word has the same meaning.
    Use(&'static str),
    /// A known word is spelled nearly so.
    Near(String),
    /// An explanation
    Text(&'static str),
    /// Nothing like it is known.
    None,
}

impl Hint {
    /// The known word that is probably meant.
    pub fn meant(&self) -> Option<&str> {
        match self {
            Self::Use(word) => Some(word),
            Self::Near(word) => Some(word),
            Self::Text(_) | Self::None => None,
        }
    }

    /// The help of a diagnostic.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Use(word) => Some(format!("use `{word}`")),
            Self::Near(word) => Some(format!("did you mean `{word}`?")),
            Self::Text(text) => Some((*text).into()),
            Self::None => None,
        }
    }
}

/// Explanations for keys of one table, where no key of it has the same meaning.
struct Explained {
    /// `stage` for `[[stage]]`, `deck` for the top level
    table: &'static str,
    /// As users write it, in lower case
    written: &'static [&'static str],
    help: &'static str,
}

/// Known words for a word that users write.
struct Synonym {
    /// As users write it, in lower case
    written: &'static [&'static str],
    /// In the deck; the first that is known where it stands
    meant: &'static [&'static str],
}

/// Explanations for words of one key, where no word of it has the same meaning.
struct ExplainedWord {
    key: &'static str,
    /// As users write it, in lower case
    written: &'static [&'static str],
    help: &'static str,
}

#[rustfmt::skip]
const EXPLAINED: [Explained; 44] = [
    Explained { table: "deck", written: &["contact", "contacts", "collision", "collisions"], help: "contact is not supported yet" },
    Explained { table: "deck", written: &["friction"], help: "friction is not supported yet" },
    Explained { table: "deck", written: &["cable", "cables", "rope", "ropes"], help: "a cable is a [[spring]] `between` two nodes with tension_only = true" },
    Explained { table: "deck", written: &["tendon", "tendons", "muscle", "muscles"], help: "tendons along a beam are not supported yet; a straight one is a [[spring]] `between` two nodes with tension_only = true" },
    Explained { table: "deck", written: &["boundary", "boundaries", "boundary_condition", "boundary_conditions", "bc", "bcs", "constraint", "constraints", "fix", "fixed", "clamp", "anchor"], help: "use [[support]]" },
    Explained { table: "deck", written: &["motor", "motors", "actuator", "actuators", "drive", "drives"], help: "a motor is the key `angle` or `displacement` of a [[joint]]" },
    Explained { table: "deck", written: &["control", "controller", "controllers", "feedback"], help: "feedback control is not supported yet; a motor of a [[joint]] follows a [history.NAME]" },
    Explained { table: "deck", written: &["mesh", "element", "elements"], help: "use `elements` of [[beam]]" },
    Explained { table: "deck", written: &["node", "nodes"], help: "nodes follow from `elements` of [[beam]]; name places in [point]" },
    Explained { table: "deck", written: &["bodies", "mass", "masses", "point_mass", "rigid_body", "rigid_bodies", "rigid", "link"], help: "use [[body]]" },
    Explained { table: "deck", written: &["damper", "dampers", "dashpot", "rayleigh", "rayleigh_damping"], help: "use [damping] (Rayleigh), or `damping` of [[spring]] and [[joint]]" },
    Explained { table: "deck", written: &["force", "forces", "moment", "moments", "torque", "pressure"], help: "use [[load]]" },
    Explained { table: "deck", written: &["displacement", "displacements", "prescribed", "prescribed_displacement", "rotation"], help: "use [[motion]]" },
    Explained { table: "deck", written: &["hinge", "hinges", "connection", "connections", "constraint_joint"], help: "use [[joint]]" },
    Explained { table: "deck", written: &["step", "steps", "analysis", "solver", "simulation", "solution", "time", "dt", "run", "settings", "newton"], help: "use [[stage]]" },
    Explained { table: "deck", written: &["cross_section", "cross_sections", "profile", "profiles", "property", "properties"], help: "use [section.NAME]" },
    Explained { table: "deck", written: &["parameter", "parameters", "variable", "variables", "constant", "constants", "define"], help: "use [param]" },
    Explained { table: "deck", written: &["initial_velocity", "initial_condition", "initial_conditions", "velocity"], help: "use [[initial]]" },
    Explained { table: "deck", written: &["curve", "curves", "amplitude", "amplitudes", "function", "functions", "time_series", "signal"], help: "use [history.NAME]" },
    Explained { table: "deck", written: &["result", "results", "write", "record", "probe", "probes", "plot", "stress", "stresses"], help: "use [output]" },
    Explained { table: "deck", written: &["fluid", "wind", "aero", "aerodynamics", "hydrodynamics", "drag"], help: "fluid loads are not supported yet; give the forces by [[load]]" },
    Explained { table: "deck", written: &["shell", "shells", "plate", "plates", "solid", "solids", "truss", "trusses"], help: "beams, rigid bodies, joints and springs are supported; a truss is a [[spring]] `between` two nodes" },
    Explained { table: "deck", written: &["temperature", "thermal", "heat", "prestress", "prestrain"], help: "use `free_strain` of [[beam]]" },
    Explained { table: "material", written: &["yield", "yield_stress", "plasticity", "plastic", "hardening", "strength"], help: "plasticity is not supported yet: sections are elastic" },
    Explained { table: "material", written: &["viscosity", "damping", "relaxation"], help: "use [damping] for Rayleigh damping; materials are elastic" },
    Explained { table: "material", written: &["alpha", "cte", "expansion", "thermal_expansion"], help: "use `free_strain` of [[beam]], such as [\"alpha*dT\", 0, 0, 0, 0, 0]" },
    Explained { table: "section", written: &["diameter", "d", "r"], help: "use `radius`, half the diameter" },
    Explained { table: "section", written: &["e", "nu", "g", "rho", "density", "young", "poisson"], help: "give this in a [material.NAME], and name it by `material` of the section" },
    Explained { table: "section", written: &["a", "area", "i", "iy", "iz", "i2", "i3", "j", "inertia"], help: "give \
                                                                                                               the \
                                                                                                               stiffnesses \
                                                                                                               `EA`, \
                                                                                                               `GA`, \
                                                                                                               `GJ`, \
                                                                                                               `EI` \
                                                                                                               with \
                                                                                                               `rhoA`, \
                                                                                                               `rhoJ`, \
                                                                                                               or \
                                                                                                               `material` \
                                                                                                               and \
                                                                                                               `shape`" },
    Explained { table: "beam", written: &["radius", "diameter", "material", "shape", "e", "young"], help: "give this in a [section.NAME], and name it by `section` of the beam" },
    Explained { table: "beam", written: &["start", "from", "to", "begin", "end"], help: "use `through`, such as [\"root\", \"tip\"]" },
    Explained { table: "beam", written: &["length"], help: "the length follows from the points of `through`" },
    Explained { table: "beam", written: &["damping"], help: "use [damping]" },
    Explained { table: "beam", written: &["temperature", "thermal", "prestress", "prestrain", "curvature", "natural_curvature"], help: "use `free_strain`" },
    Explained { table: "joint", written: &["motor", "actuator", "drive", "target", "position"], help: "use `angle` (revolute) or `displacement` (prismatic), which may have a `history`" },
    Explained { table: "joint", written: &["limit", "limits", "stop", "stops", "range"], help: "stops of joints are not supported yet" },
    Explained { table: "joint", written: &["friction"], help: "friction is not supported yet; `damping` is viscous" },
    Explained { table: "joint", written: &["torque", "force", "moment"], help: "torques in joints are not supported yet; [[load]] acts at nodes" },
    Explained { table: "stage", written: &["gravity"], help: "`gravity` is a key at the top of the deck" },
    Explained { table: "stage", written: &["damping"], help: "use [damping], above the stages" },
    Explained { table: "stage", written: &["every", "output", "interval", "save"], help: "use `every` or `interval` of [output]" },
    Explained { table: "stage", written: &["start", "begin", "t0", "start_time"], help: "a stage starts at the time at \
                                                                                         which the previous one ends" },
    Explained { table: "stage", written: &["solver", "linear_solver"], help: "there is one solver; `tolerance` and `max_iterations` are those of Newton's method" },
    Explained { table: "support", written: &["value", "displacement"], help: "use [[motion]] to prescribe a displacement" },
];

#[rustfmt::skip]
const SYNONYMS: [Synonym; 50] = [
    Synonym { written: &["type"], meant: &["kind", "shape"] },
    Synonym { written: &["dt", "h", "timestep", "time_step", "step_size", "stepsize", "delta_t", "deltat", "increment"], meant: &["step"] },
    Synonym { written: &["t_end", "tend", "end_time", "t_final", "final_time", "tmax", "t_max", "stop_time", "duration", "time"], meant: &["end", "times"] },
    Synonym { written: &["increments", "load_steps", "nsteps", "n_steps", "num_steps", "substeps", "levels", "load_levels"], meant: &["steps"] },
    Synonym { written: &["tol", "eps", "epsilon", "convergence"], meant: &["tolerance", "rtol"] },
    Synonym { written: &["tolerance", "relative_tolerance", "rel_tol"], meant: &["rtol"] },
    Synonym { written: &["absolute_tolerance", "abs_tol"], meant: &["atol"] },
    Synonym { written: &["max_iter", "maxiter", "iterations", "max_its", "niter", "newton_iterations"], meant: &["max_iterations"] },
    Synonym { written: &["method", "integrator", "time_integration", "integration"], meant: &["scheme"] },
    Synonym { written: &["rho", "rho_infinity", "rhoinf", "spectral_radius"], meant: &["rho_inf"] },
    Synonym { written: &["nmodes", "n_modes", "num_modes", "count", "eigenvalues", "frequencies", "n"], meant: &["modes"] },
    Synonym { written: &["node", "point", "position", "location", "where"], meant: &["at"] },
    Synonym { written: &["nodes", "ends", "points"], meant: &["between", "through"] },
    Synonym { written: &["along_beam", "line", "beam", "on"], meant: &["along"] },
    Synonym { written: &["dof", "dofs", "fixed", "constrain", "constrained", "direction", "directions", "hold", "kind", "type"], meant: &["fix"] },
    Synonym { written: &["magnitude", "vector", "load", "p"], meant: &["force"] },
    Synonym { written: &["torque", "couple", "m"], meant: &["moment"] },
    Synonym { written: &["coordinate_system", "csys", "coordinates", "system"], meant: &["frame", "axes"] },
    Synonym { written: &["young", "youngs_modulus", "young_modulus", "modulus", "elastic_modulus"], meant: &["E"] },
    Synonym { written: &["poisson", "poissons_ratio", "poisson_ratio", "v"], meant: &["nu"] },
    Synonym { written: &["shear", "shear_modulus"], meant: &["G"] },
    Synonym { written: &["density"], meant: &["rho", "rhoA"] },
    Synonym { written: &["wall", "wall_thickness", "t"], meant: &["thickness"] },
    Synonym { written: &["b", "depth"], meant: &["width"] },
    Synonym { written: &["mu", "mass_per_length", "m"], meant: &["rhoA"] },
    Synonym { written: &["mesh", "n_elements", "num_elements", "nel", "ne", "n", "element", "divisions", "segments"], meant: &["elements"] },
    Synonym { written: &["degree", "polynomial_order"], meant: &["order"] },
    Synonym { written: &["path", "polyline", "centerline", "centreline", "centre_line", "center_line", "geometry"], meant: &["through"] },
    Synonym { written: &["orientation", "up", "normal", "local_z", "z_axis"], meant: &["axis3", "axis"] },
    Synonym { written: &["profile", "cross_section", "property"], meant: &["section"] },
    Synonym { written: &["k", "spring_constant", "spring_stiffness", "rate"], meant: &["stiffness"] },
    Synonym { written: &["c", "damper", "viscosity", "dashpot", "damping_coefficient"], meant: &["damping"] },
    Synonym { written: &["l0", "rest_length", "natural_length", "free_length"], meant: &["length"] },
    Synonym { written: &["cable", "no_compression", "unilateral"], meant: &["tension_only"] },
    Synonym { written: &["omega", "angular_velocity", "w", "rotation_rate", "rpm"], meant: &["spin"] },
    Synonym { written: &["v", "vel", "speed"], meant: &["velocity"] },
    Synonym { written: &["j", "i", "inertia_tensor", "moment_of_inertia"], meant: &["inertia"] },
    Synonym { written: &["m"], meant: &["mass"] },
    Synonym { written: &["com", "cog", "centre_of_mass", "center_of_mass", "centre", "center"], meant: &["offset", "about"] },
    Synonym { written: &["amplitude", "curve", "table", "function", "signal", "profile"], meant: &["history"] },
    Synonym { written: &["function", "formula", "expression", "f"], meant: &["expr"] },
    Synonym { written: &["t"], meant: &["times"] },
    Synonym { written: &["y", "data"], meant: &["values"] },
    Synonym { written: &["file", "path"], meant: &["csv"] },
    Synonym { written: &["variables", "quantities", "fields", "groups"], meant: &["columns"] },
    Synonym { written: &["quantity", "variable", "output"], meant: &["column"] },
    Synonym { written: &["frequency", "stride", "decimate"], meant: &["every"] },
    Synonym { written: &["paraview", "vtu", "shape"], meant: &["vtk"] },
    Synonym { written: &["max", "upper", "less_than"], meant: &["below"] },
    Synonym { written: &["min", "lower", "greater_than"], meant: &["above"] },
];

#[rustfmt::skip]
const WORDS: [Synonym; 44] = [
    Synonym { written: &["hinge", "hinged", "pin", "pinned", "rotational", "rotary"], meant: &["revolute", "pin"] },
    Synonym { written: &["ball", "socket", "ball_joint", "ball_and_socket"], meant: &["spherical"] },
    Synonym { written: &["slider", "slide", "sliding", "translational"], meant: &["prismatic"] },
    Synonym { written: &["cardan", "hooke", "gimbal"], meant: &["universal"] },
    Synonym { written: &["fixed", "weld", "welded", "clamp", "clamped"], meant: &["rigid", "all", "space"] },
    Synonym { written: &["encastre", "full", "builtin", "built_in"], meant: &["all"] },
    Synonym { written: &["transient", "time", "implicit", "implicit_dynamic"], meant: &["dynamic"] },
    Synonym { written: &["eigen", "eigenvalue", "eigenvalues", "frequency", "eigenfrequency", "vibration", "modes"], meant: &["modal"] },
    Synonym { written: &["quasi_static", "quasistatic", "equilibrium", "nonlinear"], meant: &["static"] },
    Synonym { written: &["stability", "linear_buckling", "critical"], meant: &["buckling"] },
    Synonym { written: &["global", "world", "inertial"], meant: &["space"] },
    Synonym { written: &["local", "beam"], meant: &["section"] },
    Synonym { written: &["follower", "following", "material"], meant: &["body"] },
    Synonym { written: &["trapezoidal", "average_acceleration", "midpoint"], meant: &["newmark"] },
    Synonym { written: &["hht_alpha", "hilber", "alpha"], meant: &["hht"] },
    Synonym { written: &["chung_hulbert", "genalpha", "gen_alpha"], meant: &["generalized_alpha"] },
    Synonym { written: &["so3", "lie", "lie_group"], meant: &["lie_generalized_alpha"] },
    Synonym { written: &["pipe", "ring", "annulus", "hollow"], meant: &["tube"] },
    Synonym { written: &["round", "rod", "disk", "disc", "cylinder"], meant: &["circle"] },
    Synonym { written: &["square", "rect", "bar"], meant: &["rectangle"] },
    Synonym { written: &["riks", "arclength", "continuation", "path"], meant: &["arc_length"] },
    Synonym { written: &["force"], meant: &["load"] },
    Synonym { written: &["maximum", "largest"], meant: &["max"] },
    Synonym { written: &["minimum", "smallest"], meant: &["min"] },
    Synonym { written: &["abs", "magnitude", "max_abs", "maxabs"], meant: &["absmax"] },
    Synonym { written: &["average", "avg"], meant: &["mean"] },
    Synonym { written: &["l2", "root_mean_square"], meant: &["rms"] },
    Synonym { written: &["diverged", "divergence", "no_convergence"], meant: &["not_converged"] },
    Synonym { written: &["mechanism", "singular_matrix"], meant: &["singular"] },
    Synonym { written: &["nan", "inf", "infinite"], meant: &["non_finite"] },
    Synonym { written: &["x", "tx", "dx", "u1"], meant: &["ux"] },
    Synonym { written: &["y", "ty", "dy", "u2"], meant: &["uy"] },
    Synonym { written: &["z", "tz", "dz", "u3"], meant: &["uz"] },
    Synonym { written: &["rotx", "rot_x", "theta_x", "ur1"], meant: &["rx"] },
    Synonym { written: &["roty", "rot_y", "theta_y", "ur2"], meant: &["ry"] },
    Synonym { written: &["rotz", "rot_z", "theta_z", "ur3"], meant: &["rz"] },
    Synonym { written: &["disp", "displacement", "displacements", "translation"], meant: &["u"] },
    Synonym { written: &["position", "positions", "coordinates"], meant: &["x"] },
    Synonym { written: &["rot", "rotation", "rotations"], meant: &["r"] },
    Synonym { written: &["quaternion", "quaternions"], meant: &["q"] },
    Synonym { written: &["velocity", "velocities", "vel"], meant: &["v"] },
    Synonym { written: &["angular_velocity", "omega", "spin"], meant: &["w"] },
    Synonym { written: &["acceleration", "accelerations", "acc"], meant: &["a"] },
    Synonym { written: &["force", "forces", "moment", "moments", "internal_forces", "section_forces"], meant: &["resultant"] },
];

#[rustfmt::skip]
const EXPLAINED_WORDS: [ExplainedWord; 6] = [
    ExplainedWord { key: "kind", written: &["riks", "arc_length", "path", "continuation"], help: "use kind = \"static\" with control = \"arc_length\"" },
    ExplainedWord { key: "kind", written: &["explicit", "explicit_dynamic"], help: "explicit time integration is not supported; use kind = \"dynamic\"" },
    ExplainedWord { key: "scheme", written: &["explicit", "rk4", "runge_kutta", "central_difference", "verlet", "leapfrog"], help: "explicit schemes are not supported" },
    ExplainedWord { key: "control", written: &["displacement", "displacements"], help: "prescribe the displacement by [[motion]]" },
    ExplainedWord { key: "shape", written: &["box", "i_beam", "ibeam", "i", "h", "c", "l", "t", "ellipse"], help: "give \
                                                                                                                   the \
                                                                                                                   stiffnesses \
                                                                                                                   of \
                                                                                                                   other \
                                                                                                                   shapes: \
                                                                                                                   `EA`, \
                                                                                                                   `GA`, \
                                                                                                                   `GJ`, \
                                                                                                                   `EI`" },
    ExplainedWord { key: "columns", written: &["stress", "stresses"], help: "stresses are not written; `resultant` gives the forces and moments of sections, `strain` their strains" },
];

/// Lower case, with underscores.
fn plain(word: &str) -> String {
    word.to_lowercase().replace(['-', ' '], "_")
}

/// Help for a key that a table does not know; `table` is its name in messages: `[[stage]]`,
/// `[section.rod]`, `the deck`.
pub fn for_key(table: &str, key: &str, known: &[&'static str]) -> Hint {
    let written = plain(key);
    let table = table.trim_start_matches("the ").trim_matches(['[', ']', '`']);
    let table = table.split('.').next().unwrap_or(table);
    if let Some(same) = known.iter().find(|word| plain(word) == written) {
        return Hint::Near((*same).into());
    }
    let explained = EXPLAINED.iter().find(|row| row.table == table && row.written.contains(&written.as_str()));
    if let Some(row) = explained {
        return Hint::Text(row.help);
    }
    synonym(&SYNONYMS, &written, known).map_or_else(|| near(key, known), Hint::Use)
}

/// Help for a word that a key does not know.
pub fn for_word(key: &str, word: &str, known: &[&'static str]) -> Hint {
    let written = plain(word);
    let explained = EXPLAINED_WORDS.iter().find(|row| row.key == key && row.written.contains(&written.as_str()));
    if let Some(row) = explained {
        return Hint::Text(row.help);
    }
    synonym(&WORDS, &written, known).map_or_else(|| near(word, known), Hint::Use)
}

/// The help for a word that a key does not know, if there is any.
pub fn hint(key: &str, word: &str, known: &[&'static str]) -> Option<String> {
    for_word(key, word, known).help()
}

/// The key with the same meaning that is known, for a key of other programs.
pub fn synonymous_key(key: &str, known: &[&str]) -> Option<&'static str> {
    synonym(&SYNONYMS, &plain(key), known)
}

fn synonym(table: &[Synonym], written: &str, known: &[&str]) -> Option<&'static str> {
    let rows = table.iter().filter(|row| row.written.contains(&written));
    rows.flat_map(|row| row.meant).copied().find(|meant| known.contains(meant))
}

fn near(word: &str, known: &[&'static str]) -> Hint {
    nearest(word, known.iter().copied()).map_or(Hint::None, |meant| Hint::Near(meant.into()))
}

/// Fewest letters of words that are compared by their spelling: most shorter ones are near to each
/// other.
const FEWEST_LETTERS: usize = 4;
/// Letters for each one that may differ.
const LETTERS_PER_ERROR: usize = 3;

/// The known word that is spelled nearly so: with at most a third of its letters wrong, or with its
/// end left out, or equal but for capitals or doubled letters.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let written = plain(word);
    let rated = known.into_iter().filter_map(|candidate| Some((errors(&written, &plain(candidate))?, candidate)));
    rated.max_by_key(|(errors, _)| Reverse(*errors)).map(|(_, candidate)| candidate)
}

/// The number of letters in which a word differs from a known one; `None` where these are too many.
fn errors(written: &str, known: &str) -> Option<usize> {
    if written == known {
        return Some(0);
    }
    let letters = |word: &str| word.chars().count();
    let is_long = letters(written) >= FEWEST_LETTERS;
    if undoubled(written) == undoubled(known) || (is_long && known.starts_with(written)) {
        return Some(1);
    }
    let shorter = letters(written).min(letters(known));
    let longer = letters(written).max(letters(known));
    let errors = strsim::damerau_levenshtein(written, known);
    (longer >= FEWEST_LETTERS && errors <= shorter / LETTERS_PER_ERROR).then_some(errors)
}

/// A word with each repeated letter once.
fn undoubled(word: &str) -> Vec<char> {
    let mut letters: Vec<char> = word.chars().collect();
    letters.dedup();
    letters
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_other_programs_are_translated() {
        let stage = ["kind", "step", "steps", "end", "adaptive", "tolerance", "max_iterations"];
        for (written, meant) in [("dt", "step"), ("type", "kind"), ("t_end", "end"), ("max_iter", "max_iterations")] {
            assert_eq!(for_key("[[stage]]", written, &stage), Hint::Use(meant), "{written}");
        }
        assert_eq!(for_key("the deck", "contact", &["cost"]), Hint::Text("contact is not supported yet"));
        assert_eq!(for_key("[section.rod]", "diameter", &["radius"]), Hint::Text("use `radius`, half the diameter"));
        assert_eq!(for_word("kind", "hinge", &["spherical", "revolute"]), Hint::Use("revolute"));
    }

    #[test]
    fn only_near_spellings_are_proposed() {
        for (written, known) in [
            ("contact", "cost"),
            ("cable", "above"),
            ("tendon", "end"),
            ("dt", "adaptive"),
            ("type", "step"),
            ("boundary", "body"),
            ("motor", "motion"),
            ("mesh", "E"),
            ("stress", "r"),
        ] {
            assert_eq!(nearest(written, [known]), None, "{written}");
        }
        for (written, known) in
            [("elments", "elements"), ("ea", "EA"), ("titel", "title"), ("rotary", "rotary_inertia"), ("EAA", "EA")]
        {
            assert_eq!(nearest(written, [known]), Some(known), "{written}");
        }
    }

    /// A hint that leads to a word which the deck does not have would mislead again.
    #[test]
    fn synonyms_lead_to_keys_and_words_of_the_deck() {
        let known = |word: &str| crate::deck::SCHEMA.contains(&format!("\"{word}\""));
        for row in SYNONYMS.iter().chain(&WORDS) {
            row.meant.iter().for_each(|word| assert!(known(word), "{word}"));
        }
        for row in &EXPLAINED {
            assert!(row.table == "deck" || known(row.table), "{}", row.table);
        }
        for row in &EXPLAINED_WORDS {
            assert!(known(row.key), "{}", row.key);
        }
    }
}
