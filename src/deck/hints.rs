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
const EXPLAINED: &[Explained] = &[
    Explained { table: "deck", written: &["contacts", "collision", "collisions", "gap"], help: "contacts of beams and bodies with surfaces are [[contact]] and [[surface]]" },
    Explained { table: "deck", written: &["friction"], help: "`friction` is a key of [[contact]]" },
    Explained { table: "deck", written: &["cable", "cables", "rope", "ropes", "string", "strings", "wire", "wires", "chain", "tether", "mooring"], help: "a cable is a [[spring]] `between` two nodes with tension_only = true" },
    Explained { table: "deck", written: &["tendon", "tendons", "muscle", "muscles"], help: "tendons along a beam are not supported yet; a straight one is a [[spring]] `between` two nodes with tension_only = true" },
    Explained { table: "deck", written: &["boundary", "boundaries", "boundary_condition", "boundary_conditions", "bc", "bcs", "constraint", "constraints", "fix", "fixed", "clamp", "anchor", "encastre", "restraint", "restraints", "roller", "single_point_constraint", "sp"], help: "use [[support]]" },
    Explained { table: "deck", written: &["motor", "motors", "actuator", "actuators", "drive", "drives"], help: "a motor is the key `angle` or `displacement` of a [[joint]]" },
    Explained { table: "deck", written: &["control", "controller", "controllers", "feedback"], help: "feedback control is not supported yet; a motor of a [[joint]] follows a [history.NAME]" },
    Explained { table: "deck", written: &["element", "elements", "num_elem", "n_elem", "part", "instance", "assembly"], help: "use `elements` of [[beam]]" },
    Explained { table: "deck", written: &["node", "nodes", "nset", "coords"], help: "nodes follow from `elements` of [[beam]]; name places in [point]" },
    Explained { table: "deck", written: &["bodies", "mass", "masses", "point_mass", "rigid_body", "rigid_bodies", "rigid", "link", "lumped_mass", "lumped", "hub", "nacelle", "rigid_link", "mpc", "marker", "markers"], help: "use [[body]]" },
    Explained { table: "deck", written: &["damper", "dampers", "dashpot", "rayleigh", "rayleigh_damping", "damp"], help: "use [damping] (Rayleigh), or `damping` of [[spring]] and [[joint]]" },
    Explained { table: "deck", written: &["force", "forces", "moment", "moments", "torque", "pressure", "cload", "dload", "app_forces", "applied_forces"], help: "use [[load]]" },
    Explained { table: "deck", written: &["displacement", "displacements", "prescribed", "prescribed_displacement", "rotation"], help: "use [[motion]]" },
    Explained { table: "deck", written: &["hinge", "hinges", "connection", "connections", "constraint_joint", "connector", "connectors", "revolute_joint", "release", "releases", "equal_dof"], help: "use [[joint]]" },
    Explained { table: "deck", written: &["step", "steps", "analysis", "solver", "simulation", "solution", "time", "dt", "run", "settings", "newton", "algorithm", "static", "dynamic", "modal", "buckling", "transient", "numberer", "system"], help: "use [[stage]]" },
    Explained { table: "deck", written: &["cross_section", "cross_sections", "profile", "profiles", "property", "properties", "beam_section", "real"], help: "use [section.NAME]" },
    Explained { table: "deck", written: &["parameter", "parameters", "variable", "variables", "constant", "constants", "define", "vars"], help: "use [param]" },
    Explained { table: "deck", written: &["initial_velocity", "initial_condition", "initial_conditions", "velocity"], help: "use [[initial]]" },
    Explained { table: "deck", written: &["curve", "curves", "amplitude", "amplitudes", "function", "functions", "time_series", "signal", "table", "ramp"], help: "use [history.NAME]" },
    Explained { table: "deck", written: &["result", "results", "write", "record", "probe", "probes", "plot", "stress", "stresses", "recorder", "recorders", "sensor", "sensors", "field_output", "history_output", "monitor", "outres"], help: "use [output]" },
    Explained { table: "deck", written: &["fluid", "wind", "aero", "aerodynamics", "hydrodynamics", "drag", "inflow", "gust", "buoyancy", "current", "waves"], help: "fluid loads are not supported yet; give the forces by [[load]]" },
    Explained { table: "deck", written: &["shell", "shells", "plate", "plates", "solid", "solids", "truss", "trusses"], help: "beams, rigid bodies, joints and springs are supported; a truss is a [[spring]] `between` two nodes" },
    Explained { table: "deck", written: &["temperature", "thermal", "heat", "prestress", "prestrain"], help: "use `free_strain` of [[beam]]" },
    Explained { table: "deck", written: &["follower", "follower_load", "follower_force", "follower_forces"], help: "use [[load]] with frame = \"body\" or \"section\"" },
    Explained { table: "deck", written: &["rod", "rods", "frame", "frames"], help: "use [[beam]]" },
    Explained { table: "deck", written: &["integrator", "time_integration", "scheme"], help: "use `scheme` of a [[stage]]" },
    Explained { table: "deck", written: &["ground"], help: "use [[support]]; a [[joint]] to ground names one part" },
    Explained { table: "deck", written: &["description", "comment", "author", "version"], help: "use `title`, or comments after #" },
    Explained { table: "deck", written: &["include", "import"], help: "a deck is one file; points, stations and histories may be tables: { csv = \"blade.csv\" }" },
    Explained { table: "deck", written: &["pin", "pinned"], help: "use [[support]] with fix = \"pin\", or a `revolute` [[joint]]" },
    Explained { table: "deck", written: &["nlgeom", "large_deformation", "large_deformations", "geometric_nonlinearity", "nonlinear"], help: "deflections and rotations are always large; `large_rotations = false` of [effects] gives linear theory" },
    Explained { table: "deck", written: &["damping_ratio", "zeta"], help: "use [damping]: a mode of the angular frequency w has the damping ratio (mass/w + stiffness*w)/2" },
    Explained { table: "deck", written: &["g"], help: "use `gravity`, such as gravity = [0, 0, -9.81]" },
    Explained { table: "deck", written: &["e", "young", "youngs_modulus", "e_modulus", "rho", "density", "nu"], help: "give this in a [material.NAME]" },
    Explained { table: "deck", written: &["name"], help: "use `title`" },
    Explained { table: "deck", written: &["orientation", "orientations", "coordinate_system", "csys", "geom_transf"], help: "use `axis3` of [[beam]], or `axes` of [[support]]" },
    Explained { table: "deck", written: &["frequency", "eigen", "eigenvalue", "natural_frequencies"], help: "use a [[stage]] with kind = \"modal\"" },
    Explained { table: "material", written: &["yield", "yield_stress", "plasticity", "plastic", "hardening", "fracture", "elastoplastic"], help: "plasticity is not supported yet: sections are elastic" },
    Explained { table: "material", written: &["viscosity", "damping", "relaxation", "damping_constant", "mu", "loss_factor"], help: "use [damping] for Rayleigh damping; materials are elastic" },
    Explained { table: "material", written: &["alpha", "cte", "expansion", "thermal_expansion", "alpx"], help: "use `free_strain` of [[beam]], such as [\"alpha*dT\", 0, 0, 0, 0, 0]" },
    Explained { table: "material", written: &["type", "kind", "elastic", "name"], help: "materials are linear elastic; their names are in [material.NAME]" },
    Explained { table: "section", written: &["depth"], help: "use `d` of I, channel, T, angle and box, or `height` of rectangle and ellipse" },
    Explained { table: "section", written: &["diameter", "outer_diameter", "od"], help: "use `radius`, half the diameter" },
    Explained { table: "section", written: &["e", "nu", "g", "rho", "density", "young", "poisson", "e_modulus", "youngs_modulus"], help: "give this in a [material.NAME], and name it by `material` of the section" },
    Explained { table: "section", written: &["a", "area", "i", "iy", "iz", "i2", "i3", "j", "inertia", "ixx", "iyy", "izz", "area_moment", "ip"], help: "give the stiffnesses `EA`, `GA`, `GJ`, `EI` with `rhoA`, `rhoJ`, or `material` and `shape`" },
    Explained { table: "section", written: &["inner_radius", "ri", "inner_diameter", "id"], help: "use `radius`, the outer one, and `thickness`" },
    Explained { table: "section", written: &["compliance", "flexibility"], help: "give its inverse as `stiffness`" },
    Explained { table: "section", written: &["warping", "cw"], help: "warping is not supported" },
    Explained { table: "section", written: &["offset", "shear_center", "origin", "shear_centre"], help: "use `reference`: the point of a shape through which the line of the beam goes; without a shape `offset` of [[beam]]" },
    Explained { table: "section", written: &["twist", "orientation"], help: "use `twist` or `axis3` of [[beam]]" },
    Explained { table: "beam", written: &["radius", "diameter", "material", "shape", "e", "young", "e_modulus", "youngs_modulus", "density", "rho", "ei", "ea", "mass", "base_radius"], help: "give this in a [section.NAME], and name it by `section` of the beam" },
    Explained { table: "beam", written: &["start", "from", "to", "begin", "end", "base", "tip", "direction"], help: "use `through`, such as [\"root\", \"tip\"]" },
    Explained { table: "beam", written: &["length", "base_length", "l"], help: "the length follows from the points of `through`" },
    Explained { table: "beam", written: &["damping"], help: "use [damping]" },
    Explained { table: "beam", written: &["temperature", "thermal", "prestress", "prestrain", "curvature", "natural_curvature", "intrinsic_curvature", "rest_kappa", "rest_sigma"], help: "use `free_strain`" },
    Explained { table: "beam", written: &["hinge", "hinges", "release", "releases", "pin", "pinned"], help: "use a [[joint]] between two beams" },
    Explained { table: "beam", written: &["type", "kind", "formulation", "element_type"], help: "use `order` and `interpolation`" },
    Explained { table: "beam", written: &["fix", "fixed", "support", "clamp", "boundary_conditions"], help: "use [[support]]" },
    Explained { table: "beam", written: &["spin", "velocity", "omega"], help: "use [[initial]], or `frame` of a stage" },
    Explained { table: "beam", written: &["force", "load", "q"], help: "use [[load]] with `along`" },
    Explained { table: "joint", written: &["motor", "actuator", "drive", "target", "position", "motion", "actuation"], help: "use `angle` (revolute) or `displacement` (prismatic), which may have a `history`" },
    Explained { table: "joint", written: &["limit", "limits", "stop", "stops", "range", "min", "max", "lower", "upper"], help: "stops of joints are not supported yet" },
    Explained { table: "joint", written: &["friction"], help: "friction is not supported yet; `damping` is viscous" },
    Explained { table: "joint", written: &["torque", "force", "moment", "preload"], help: "torques in joints are not supported yet; [[load]] acts at nodes" },
    Explained { table: "joint", written: &["between", "bodies", "parts", "body1", "body2", "node1", "node2", "parent", "child", "beam1", "beam2", "marker", "markers"], help: "use `beams`, two that meet at the point `at`, or `nodes`" },
    Explained { table: "joint", written: &["velocity", "speed", "omega", "spin", "rpm"], help: "use `angle` (revolute) or `displacement` (prismatic) with a `history`" },
    Explained { table: "joint", written: &["rest_angle", "angle0", "offset", "reference"], help: "springs of joints are unstressed at the start" },
    Explained { table: "stage", written: &["gravity"], help: "`gravity` is a key at the top of the deck" },
    Explained { table: "stage", written: &["damping"], help: "use [damping], above the stages" },
    Explained { table: "stage", written: &["every", "output", "interval", "save", "save_every", "recorder", "outres"], help: "use `every` or `interval` of [output]" },
    Explained { table: "stage", written: &["start", "begin", "t0", "start_time", "initial_time"], help: "a stage starts at the time at which the previous one ends" },
    Explained { table: "stage", written: &["solver", "linear_solver", "line_search", "algorithm", "newton", "newton_method", "modified_newton", "system", "numberer", "test"], help: "there is one solver; `tolerance` and `max_iterations` are those of Newton's method" },
    Explained { table: "stage", written: &["nlgeom", "large_deformation", "geometric_nonlinearity", "nonlinear"], help: "deflections and rotations are always large; `large_rotations = false` of [effects] gives linear theory" },
    Explained { table: "stage", written: &["alpha_f", "alpha_m"], help: "use `rho_inf`" },
    Explained { table: "stage", written: &["omega", "spin", "angular_velocity", "rotation", "rpm", "centrifugal", "coriolis"], help: "use frame = { spin = [0, 0, 12] }" },
    Explained { table: "stage", written: &["load", "loads", "force", "motion", "history", "amplitude"], help: "[[load]] and [[motion]] act in all stages, or in those of their `stages`" },
    Explained { table: "stage", written: &["min_step", "max_step", "max_increment", "min_increment", "initial_step", "dt_min", "dt_max"], help: "`step` is the first one, `adaptive = true` and `step_tolerance` choose the others" },
    Explained { table: "stage", written: &["name", "title", "label", "id"], help: "stages have no names: they are numbered from 1" },
    Explained { table: "support", written: &["value", "displacement", "ux", "uy", "uz", "u1", "u2", "u3"], help: "use [[motion]] to prescribe a displacement" },
    Explained { table: "support", written: &["stiffness", "spring", "k"], help: "use [[spring]] for elastic supports" },
    Explained { table: "damping", written: &["alpha", "alpha_m", "alpha_d", "a0", "mass_factor", "mass_proportional"], help: "use `mass`, the factor of the mass matrix" },
    Explained { table: "damping", written: &["beta", "beta_k", "beta_d", "a1", "stiffness_factor", "stiffness_proportional", "mu"], help: "use `stiffness`, the factor of the stiffness matrix" },
    Explained { table: "damping", written: &["ratio", "zeta", "xi", "damping_ratio", "modal"], help: "give `mass` and `stiffness`: a mode of the angular frequency w has the damping ratio (mass/w + stiffness*w)/2" },
    Explained { table: "motion", written: &["displacement", "u", "u1", "u2", "u3", "value", "magnitude", "translation", "x", "y", "z"], help: "use `ux`, `uy`, `uz`" },
    Explained { table: "motion", written: &["rx", "ry", "rz", "rotation", "rot", "ur1", "ur2", "ur3"], help: "use `rotate`, an axis, with `angle`" },
    Explained { table: "motion", written: &["velocity", "speed", "omega", "spin", "rpm", "acceleration"], help: "give the displacement or the angle, with a `history`" },
    Explained { table: "body", written: &["ixx", "iyy", "izz", "ixy", "jxx", "j1"], help: "use `inertia`, such as inertia = [1, 1, 2]" },
    Explained { table: "body", written: &["name"], help: "a body has the name of its node" },
    Explained { table: "body", written: &["shape", "radius", "density", "rho", "size", "length"], help: "give `mass` and `inertia`" },
    Explained { table: "spring", written: &["type", "kind"], help: "a spring to ground has `at`, one along the line of two nodes `between`" },
    Explained { table: "spring", written: &["kt", "kr", "rotational_stiffness", "torsional_stiffness", "torsion"], help: "use `at` and six numbers of `stiffness`: the last three are per rotation; or `stiffness` of a [[joint]]" },
    Explained { table: "spring", written: &["prestress", "preload", "pretension", "tension", "initial_tension"], help: "use `length`, the unstressed length" },
    Explained { table: "spring", written: &["nodes", "beams", "from", "to", "node1", "node2"], help: "use `between`, two nodes" },
    Explained { table: "load", written: &["follower", "follow", "following", "follower_force"], help: "use frame = \"body\" or \"section\"" },
    Explained { table: "load", written: &["direction", "dir", "angle"], help: "give components, such as force = [0, 0, -5]" },
    Explained { table: "load", written: &["fx", "fy", "fz", "cf1", "cf2", "cf3", "px", "py", "pz", "f1", "f2", "f3"], help: "use `force`, such as force = [0, 0, -5]" },
    Explained { table: "load", written: &["mx", "my", "mz", "cm1", "cm2", "cm3"], help: "use `moment`, such as moment = [0, 2, 0]" },
    Explained { table: "load", written: &["pressure", "distributed", "line_load", "q", "per_length"], help: "use `along`, with `force` per length" },
    Explained { table: "load", written: &["ramp", "time", "start", "end"], help: "use `history`; without one a load is ramped in the first static stage" },
    Explained { table: "load", written: &["kind", "type"], help: "use `force` or `moment`" },
    Explained { table: "load", written: &["gravity"], help: "`gravity` is a key at the top of the deck" },
    Explained { table: "initial", written: &["displacement", "position", "u", "rotation", "angle"], help: "only velocities are given; a static stage before the motion deforms the scene" },
    Explained { table: "initial", written: &["node"], help: "use `at`" },
    Explained { table: "until", written: &["time", "end", "t"], help: "use `end` of the stage" },
    Explained { table: "output", written: &["dt", "time_step", "rate"], help: "use `interval` (time) or `every` (rows)" },
    Explained { table: "output", written: &["file", "path", "folder", "directory", "format", "name"], help: "`--out` of the command names the folder of the results" },
    Explained { table: "history", written: &["type", "kind", "amplitude", "frequency", "omega", "sin", "sine"], help: "use `expr`, such as expr = \"sin(2*pi*f*t)\"" },
    Explained { table: "history", written: &["ramp"], help: "use times = [0, 1] and values = [0, 1]" },
    Explained { table: "history", written: &["points", "table", "pairs"], help: "use `times` and `values`" },
    Explained { table: "expect", written: &["node", "point"], help: "the column names the node, such as column = \"tip.uz\"" },
    Explained { table: "expect", written: &["time", "t", "when"], help: "use `at`" },
    Explained { table: "expect", written: &["nodes"], help: "use one [[expect]] for each column" },
];

#[rustfmt::skip]
const SYNONYMS: &[Synonym] = &[
    Synonym { written: &["type"], meant: &["kind", "shape"] },
    Synonym { written: &["dt", "h", "timestep", "step_size", "delta_t", "increment", "inc", "deltim"], meant: &["step"] },
    Synonym { written: &["t_end", "end_time", "t_final", "final_time", "tmax", "stop_time", "duration", "time", "period", "time_period", "total_time"], meant: &["end", "times"] },
    Synonym { written: &["increments", "load_steps", "nsteps", "num_steps", "substeps", "levels", "load_levels", "nstep", "number_of_steps", "number_of_load_steps", "num_load_steps", "nsubst", "nsub", "num_increments"], meant: &["steps"] },
    Synonym { written: &["tol", "eps", "epsilon", "convergence", "cnvtol", "newton_tolerance", "residual_tolerance"], meant: &["tolerance", "rtol"] },
    Synonym { written: &["tolerance", "relative_tolerance", "rel_tol"], meant: &["rtol"] },
    Synonym { written: &["absolute_tolerance", "abs_tol"], meant: &["atol"] },
    Synonym { written: &["max_iter", "iterations", "max_its", "niter", "newton_iterations", "neqit", "newton_max_iterations"], meant: &["max_iterations"] },
    Synonym { written: &["method", "integrator", "time_integration", "integration", "solver_type", "time_integrator"], meant: &["scheme"] },
    Synonym { written: &["rho", "rho_infinity", "rhoinf", "spectral_radius"], meant: &["rho_inf"] },
    Synonym { written: &["nmodes", "num_modes", "count", "eigenvalues", "frequencies", "n", "nev", "num_eigenvalues", "number_of_modes", "modopt"], meant: &["modes"] },
    Synonym { written: &["node", "point", "position", "location", "where", "node_number", "node_id", "attachment"], meant: &["at"] },
    Synonym { written: &["nodes", "ends", "points"], meant: &["between", "through"] },
    Synonym { written: &["along_beam", "line", "beam", "on"], meant: &["along"] },
    Synonym { written: &["dof", "dofs", "fixed", "constrain", "constrained", "direction", "directions", "hold", "kind", "type"], meant: &["fix"] },
    Synonym { written: &["magnitude", "vector", "load", "p"], meant: &["force"] },
    Synonym { written: &["torque", "couple", "m"], meant: &["moment"] },
    Synonym { written: &["coordinate_system", "csys", "coordinates", "system"], meant: &["frame", "axes"] },
    Synonym { written: &["young", "youngs_modulus", "young_modulus", "modulus", "elastic_modulus", "e_modulus", "e_mod", "youngs", "elasticity", "ex", "ym"], meant: &["E"] },
    Synonym { written: &["poisson", "poissons_ratio", "poisson_ratio", "v", "prxy", "nuxy"], meant: &["nu"] },
    Synonym { written: &["shear", "shear_modulus", "gxy", "g_modulus", "shear_mod"], meant: &["G"] },
    Synonym { written: &["density", "dens", "mass_density"], meant: &["rho", "rhoA"] },
    Synonym { written: &["wall", "wall_thickness", "t"], meant: &["thickness"] },
    Synonym { written: &["b"], meant: &["width"] },
    Synonym { written: &["mu", "mass_per_length", "m", "mass_per_unit_length", "linear_density", "physics_mass_per_length"], meant: &["rhoA"] },
    Synonym { written: &["bias", "bias_ratio", "progression", "growth", "growth_rate", "spacing", "expansion", "expansion_ratio", "graded", "space_ratio"], meant: &["grading"] },
    Synonym { written: &["mesh", "n_elements", "num_elements", "nel", "ne", "n", "element", "divisions", "segments", "num_elem", "n_elem", "number_of_elements", "ndiv"], meant: &["elements"] },
    Synonym { written: &["degree", "polynomial_order", "order_elem", "num_node_elem", "nodes_per_element", "n_nodes", "polynomial_degree"], meant: &["order"] },
    Synonym { written: &["path", "polyline", "centerline", "centreline", "geometry"], meant: &["through"] },
    Synonym { written: &["curve", "bspline", "nurbs", "cubic", "interpolated"], meant: &["spline", "through"] },
    Synonym { written: &["coil", "spiral", "helical", "helicoid"], meant: &["helix"] },
    Synonym { written: &["orientation", "up", "normal", "local_z", "z_axis", "frame_of_reference_delta", "local_y", "y_axis", "normals", "d1"], meant: &["axis3", "axis"] },
    Synonym { written: &["profile", "cross_section", "property", "sec", "sect", "secid", "sec_tag"], meant: &["section"] },
    Synonym { written: &["k", "spring_constant", "spring_stiffness", "rate", "k0", "spring_coefficient", "elem_stiffness", "stiffness_matrix"], meant: &["stiffness"] },
    Synonym { written: &["c", "damper", "viscosity", "dashpot", "damping_coefficient", "damping_constant", "dashpot_coefficient"], meant: &["damping"] },
    Synonym { written: &["l0", "rest_length", "natural_length", "free_length"], meant: &["length"] },
    Synonym { written: &["cable", "no_compression", "unilateral"], meant: &["tension_only"] },
    Synonym { written: &["omega", "angular_velocity", "w", "rotation_rate", "rpm", "rotor_speed", "rotation_speed", "rotational_speed"], meant: &["spin"] },
    Synonym { written: &["v", "vel", "speed", "velocities"], meant: &["velocity"] },
    Synonym { written: &["j", "i", "inertia_tensor", "moment_of_inertia"], meant: &["inertia"] },
    Synonym { written: &["m"], meant: &["mass"] },
    Synonym { written: &["com", "cog", "centre_of_mass", "center_of_mass", "centre", "center", "center_of_gravity"], meant: &["offset", "about"] },
    Synonym { written: &["amplitude", "curve", "table", "function", "signal", "profile", "time_series", "load_function", "user_function"], meant: &["history"] },
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
    Synonym { written: &["physics_axial_stiffness", "axial_stiffness", "ka"], meant: &["EA"] },
    Synonym { written: &["physics_shear_stiffness", "shear_stiffness"], meant: &["GA"] },
    Synonym { written: &["physics_bending_stiffness", "bending_stiffness", "flexural_rigidity", "ei1", "ei2", "eiy", "eiz"], meant: &["EI"] },
    Synonym { written: &["physics_torsional_stiffness", "torsional_stiffness", "torsional_rigidity", "gk"], meant: &["GJ"] },
    Synonym { written: &["physics_cross_section_inertia", "section_inertia", "rotary_inertia", "rho_i"], meant: &["rhoJ"] },
    Synonym { written: &["mass_matrix", "mass_db", "elem_mass"], meant: &["mass"] },
    Synonym { written: &["outer_radius", "ro"], meant: &["radius"] },
    Synonym { written: &["kappa", "shear_correction", "shear_correction_factor"], meant: &["shear_factor"] },
    Synonym { written: &["pretwist", "initial_twist", "structural_twist"], meant: &["twist"] },
    Synonym { written: &["nlgeom", "geometric_nonlinearity", "large_displacements"], meant: &["large_rotations"] },
    Synonym { written: &["rotational_inertia", "inertia"], meant: &["rotary_inertia"] },
    Synonym { written: &["coriolis", "centrifugal"], meant: &["gyroscopic"] },
    Synonym { written: &["shear_deformation", "timoshenko"], meant: &["shear"] },
    Synonym { written: &["axial", "inextensible", "stretch"], meant: &["extension"] },
    Synonym { written: &["stress_stiffening", "geometric_stiffening"], meant: &["geometric_stiffness"] },
    Synonym { written: &["unit_system", "units_system"], meant: &["units"] },
    Synonym { written: &["h"], meant: &["height"] },
    Synonym { written: &["2d", "two_d", "in_plane"], meant: &["planar"] },
    Synonym { written: &["rotation_axis"], meant: &["rotate", "axis", "about"] },
    Synonym { written: &["direction"], meant: &["axis"] },
    Synonym { written: &["expected", "equals", "reference"], meant: &["value"] },
    Synonym { written: &["loads"], meant: &["load"] },
    Synonym { written: &["slide", "sliding", "sliding_joint", "sliders"], meant: &["slider"] },
    Synonym { written: &["gravity_vector", "grav"], meant: &["gravity"] },
];

#[rustfmt::skip]
const WORDS: &[Synonym] = &[
    Synonym { written: &["hinge", "hinged", "pin", "pinned", "rotational", "rotary", "revolute_joint", "hinge_joint"], meant: &["revolute", "pin"] },
    Synonym { written: &["ball", "socket", "ball_joint", "ball_and_socket", "spherical_joint"], meant: &["spherical"] },
    Synonym { written: &["translational", "prismatic_joint", "translator"], meant: &["prismatic"] },
    Synonym { written: &["cardan", "hooke", "gimbal", "universal_joint", "u_joint"], meant: &["universal"] },
    Synonym { written: &["fixed", "weld", "welded", "clamp", "clamped", "beam_connector", "cantilever"], meant: &["rigid", "all", "space"] },
    Synonym { written: &["encastre", "full", "builtin"], meant: &["all"] },
    Synonym { written: &["transient", "time", "implicit", "implicit_dynamic", "dynamic_implicit", "implicit_dynamics", "time_history", "trans"], meant: &["dynamic"] },
    Synonym { written: &["eigen", "eigenvalue", "eigenvalues", "frequency", "eigenfrequency", "vibration", "modes", "natural_frequencies", "complex_frequency"], meant: &["modal"] },
    Synonym { written: &["quasi_static", "equilibrium", "nonlinear", "static_general", "general", "static_nonlinear", "nonlinear_static", "steady"], meant: &["static"] },
    Synonym { written: &["stability", "linear_buckling", "critical", "buckle", "linear_perturbation"], meant: &["buckling"] },
    Synonym { written: &["global", "world", "inertial"], meant: &["space"] },
    Synonym { written: &["local", "beam"], meant: &["section"] },
    Synonym { written: &["follower", "following", "material", "follower_force", "moving"], meant: &["body"] },
    Synonym { written: &["trapezoidal", "average_acceleration", "midpoint", "newmark_beta", "implicit", "trapezoid"], meant: &["newmark"] },
    Synonym { written: &["hht_alpha", "hilber", "alpha", "hilber_hughes_taylor"], meant: &["hht"] },
    Synonym { written: &["chung_hulbert", "genalpha", "generalized"], meant: &["generalized_alpha"] },
    Synonym { written: &["so3", "lie", "lie_group"], meant: &["lie_generalized_alpha"] },
    Synonym { written: &["pipe", "ring", "annulus", "hollow"], meant: &["tube"] },
    Synonym { written: &["round", "rod", "disk", "disc", "cylinder"], meant: &["circle"] },
    Synonym { written: &["square", "rect", "bar"], meant: &["rectangle"] },
    Synonym { written: &["i_beam", "i_section", "h", "h_section", "w", "double_t", "ipe", "hea", "heb"], meant: &["I"] },
    Synonym { written: &["c", "u", "upn", "c_section", "u_section", "c_profile"], meant: &["channel"] },
    Synonym { written: &["l", "l_section", "corner"], meant: &["angle"] },
    Synonym { written: &["t_section", "tee"], meant: &["T"] },
    Synonym { written: &["rhs", "shs", "rectangular_hollow", "hollow_rectangle", "box_section"], meant: &["box"] },
    Synonym { written: &["arbitrary", "custom", "general_outline", "outline", "meshed"], meant: &["polygon"] },
    Synonym { written: &["composite", "sandwich", "multi_material"], meant: &["regions"] },
    Synonym { written: &["thin_walled", "thinwall", "open_section", "laminate"], meant: &["walls"] },
    Synonym { written: &["blade", "naca", "foil", "aerofoil"], meant: &["airfoil"] },
    Synonym { written: &["riks", "arclength", "continuation", "path"], meant: &["arc_length"] },
    Synonym { written: &["force"], meant: &["load"] },
    Synonym { written: &["maximum", "largest"], meant: &["max"] },
    Synonym { written: &["minimum", "smallest"], meant: &["min"] },
    Synonym { written: &["abs", "magnitude", "max_abs", "peak", "amplitude"], meant: &["absmax"] },
    Synonym { written: &["average", "avg"], meant: &["mean"] },
    Synonym { written: &["l2", "root_mean_square"], meant: &["rms"] },
    Synonym { written: &["diverged", "divergence", "no_convergence"], meant: &["not_converged"] },
    Synonym { written: &["mechanism", "singular_matrix"], meant: &["singular"] },
    Synonym { written: &["nan", "inf", "infinite"], meant: &["non_finite"] },
    Synonym { written: &["x", "tx", "dx", "u1"], meant: &["ux"] },
    Synonym { written: &["y", "ty", "dy", "u2"], meant: &["uy"] },
    Synonym { written: &["z", "tz", "dz", "u3"], meant: &["uz"] },
    Synonym { written: &["rotx", "theta_x", "ur1"], meant: &["rx"] },
    Synonym { written: &["roty", "theta_y", "ur2"], meant: &["ry"] },
    Synonym { written: &["rotz", "theta_z", "ur3"], meant: &["rz"] },
    Synonym { written: &["disp", "displacement", "displacements", "translation", "displ"], meant: &["u"] },
    Synonym { written: &["position", "positions", "coordinates"], meant: &["x"] },
    Synonym { written: &["rot", "rotation", "rotations"], meant: &["r"] },
    Synonym { written: &["quaternion", "quaternions"], meant: &["q"] },
    Synonym { written: &["velocity", "velocities", "vel"], meant: &["v"] },
    Synonym { written: &["angular_velocity", "omega", "spin"], meant: &["w"] },
    Synonym { written: &["acceleration", "accelerations", "acc"], meant: &["a"] },
    Synonym { written: &["force", "forces", "moment", "moments", "internal_forces", "section_forces"], meant: &["resultant"] },
    Synonym { written: &["bar_joint", "cylinder", "cylindrical_joint"], meant: &["cylindrical"] },
    Synonym { written: &["load_control", "force_control"], meant: &["load"] },
    Synonym { written: &["rf", "rm", "reactions", "reaction_force"], meant: &["reaction"] },
    Synonym { written: &["sf", "sm", "stress_resultants"], meant: &["resultant"] },
    Synonym { written: &["se", "strains", "curvature", "curvatures", "kappa"], meant: &["strain"] },
    Synonym { written: &["directors", "axes", "triad"], meant: &["d"] },
    Synonym { written: &["coord", "coords"], meant: &["x"] },
    Synonym { written: &["energies", "kinetic_energy", "strain_energy"], meant: &["energy"] },
    Synonym { written: &["angular_momentum", "com"], meant: &["momentum"] },
    Synonym { written: &["angular_acceleration"], meant: &["alpha"] },
];

#[rustfmt::skip]
const EXPLAINED_WORDS: &[ExplainedWord] = &[
    ExplainedWord { key: "kind", written: &["riks", "arc_length", "path", "continuation", "static_riks"], help: "use kind = \"static\" with control = \"arc_length\"" },
    ExplainedWord { key: "kind", written: &["explicit", "explicit_dynamic", "central_difference"], help: "explicit time integration is not supported; use kind = \"dynamic\"" },
    ExplainedWord { key: "scheme", written: &["explicit", "rk4", "runge_kutta", "central_difference", "verlet", "leapfrog", "explicit_midpoint", "runge_kutta_4", "position_verlet", "explicit_euler", "dopri", "ode45", "rk45"], help: "explicit schemes are not supported" },
    ExplainedWord { key: "control", written: &["displacement", "displacements", "displacement_control"], help: "prescribe the displacement by [[motion]]" },
    ExplainedWord { key: "reduce", written: &["last", "final", "end"], help: "use at = \"end\"" },
    ExplainedWord { key: "columns", written: &["stress", "stresses", "s", "mises", "von_mises"], help: "stresses are not written; `resultant` gives the forces and moments of sections, `strain` their strains" },
    ExplainedWord { key: "kind", written: &["harmonic", "frequency_response", "random_vibration", "spectrum", "steady_state", "steady_state_dynamics"], help: "responses to vibration are not supported; use kind = \"modal\", or a long kind = \"dynamic\"" },
    ExplainedWord { key: "kind", written: &["ball_screw", "screw", "helical", "planar", "planar_joint", "gear", "pulley"], help: "this joint is not supported" },
    ExplainedWord { key: "kind", written: &["bushing", "spring", "torsional"], help: "use [[spring]], or `stiffness` of a joint" },
    ExplainedWord { key: "kind", written: &["force", "moment", "dead", "follower"], help: "the kind follows from `force` or `moment`, and `frame`" },
    ExplainedWord { key: "scheme", written: &["implicit_euler", "backward_euler", "bdf", "bdf2", "trbdf2", "wilson", "houbolt", "bathe"], help: "use `generalized_alpha` with rho_inf = 0, which damps fast vibrations most" },
    ExplainedWord { key: "kind", written: &["slider", "slide", "sliding", "sliding_joint"], help: "a joint that slides along its own axis is \"prismatic\"; one that slides along a beam is a [[slider]]" },
    ExplainedWord { key: "fix", written: &["roller", "simply_supported"], help: "list the fixed directions, such as fix = [\"uy\", \"uz\"]" },
    ExplainedWord { key: "fix", written: &["slider", "slide", "sliding"], help: "list the fixed directions, such as fix = [\"uy\", \"uz\"]; a node that slides along a beam is a [[slider]]" },
    ExplainedWord { key: "fix", written: &["1", "2", "3", "4", "5", "6", "12", "123", "1234", "12345", "123456", "xsymm", "ysymm", "zsymm", "symmetry"], help: "list the fixed directions by name: ux uy uz rx ry rz" },
    ExplainedWord { key: "fix", written: &["hinge", "hinged"], help: "fix two of rx ry rz, which leaves a hinge about the third" },
];

/// Lower case, with underscores.
fn plain(word: &str) -> String {
    word.to_lowercase().replace(['-', ' '], "_")
}

/// Lower case without separators: `endTime`, `end_time` and `end-time` are one word.
fn bare(word: &str) -> String {
    plain(word).replace('_', "")
}

/// True if a word is one of those that users write.
fn is_among(word: &str, written: &[&str]) -> bool {
    let word = bare(word);
    written.iter().any(|known| bare(known) == word)
}

/// Help for a key that a table does not know; `table` is its name in messages: `[[stage]]`,
/// `[section.rod]`, `the deck`.
pub fn for_key(table: &str, key: &str, known: &[&'static str]) -> Hint {
    let table = table.trim_start_matches("the ").trim_matches(['[', ']', '`']);
    let table = table.split('.').next().unwrap_or(table);
    if let Some(same) = known.iter().find(|word| bare(word) == bare(key)) {
        return Hint::Near((*same).into());
    }
    let explained = EXPLAINED.iter().find(|row| row.table == table && is_among(key, row.written));
    if let Some(row) = explained {
        return Hint::Text(row.help);
    }
    synonym(SYNONYMS, key, known).map_or_else(|| near(key, known), Hint::Use)
}

/// Help for a word that a key does not know.
pub fn for_word(key: &str, word: &str, known: &[&'static str]) -> Hint {
    if let Some(same) = known.iter().find(|known| bare(known) == bare(word)) {
        return Hint::Near((*same).into());
    }
    let explained = EXPLAINED_WORDS.iter().find(|row| row.key == key && is_among(word, row.written));
    if let Some(row) = explained {
        return Hint::Text(row.help);
    }
    synonym(WORDS, word, known).map_or_else(|| near(word, known), Hint::Use)
}

/// The help for a word that a key does not know, if there is any.
pub fn hint(key: &str, word: &str, known: &[&'static str]) -> Option<String> {
    for_word(key, word, known).help()
}

/// Help for a name that may be a key or a word of any table.
pub fn for_any(name: &str, known: &[&str]) -> Hint {
    let meant = synonym(SYNONYMS, name, known).or_else(|| synonym(WORDS, name, known));
    let explained = EXPLAINED.iter().find(|row| is_among(name, row.written)).map(|row| row.help);
    let word = EXPLAINED_WORDS.iter().find(|row| is_among(name, row.written)).map(|row| row.help);
    if let Some(meant) = meant {
        return Hint::Use(meant);
    }
    match explained.or(word) {
        Some(help) => Hint::Text(help),
        None => nearest(name, known.iter().copied()).map_or(Hint::None, |meant| Hint::Near(meant.into())),
    }
}

fn synonym(table: &[Synonym], written: &str, known: &[&str]) -> Option<&'static str> {
    let rows = table.iter().filter(|row| is_among(written, row.written));
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
        assert_eq!(
            for_key("the deck", "collision", &["cost"]),
            Hint::Text("contacts of beams and bodies with surfaces are [[contact]] and [[surface]]")
        );
        assert_eq!(for_key("[section.rod]", "diameter", &["radius"]), Hint::Text("use `radius`, half the diameter"));
        assert_eq!(for_word("kind", "hinge", &["spherical", "revolute"]), Hint::Use("revolute"));
    }

    /// Users of other programs write camel case, and words of their own.
    #[test]
    fn words_are_one_however_they_are_separated() {
        for (table, written, known, help) in [
            ("[[stage]]", "endTime", &["end"][..], "use `end`"),
            ("[[stage]]", "numberOfLoadSteps", &["steps"], "use `steps`"),
            ("[[stage]]", "integrator", &["scheme"], "use `scheme`"),
            ("[[stage]]", "nlgeom", &["end"], "deflections and rotations are always large"),
            ("[[stage]]", "rhoInf", &["rho_inf"], "did you mean `rho_inf`?"),
            ("[material.steel]", "E_modulus", &["E"], "use `E`"),
            ("[section.rod]", "physicsBendingStiffness", &["EI"], "use `EI`"),
            ("[damping]", "alpha", &["mass", "stiffness"], "use `mass`"),
            ("[[load]]", "follower", &["frame"], "use frame = \"body\""),
            ("[effects]", "nlgeom", &["large_rotations"], "use `large_rotations`"),
            ("the deck", "string", &["spring"], "a cable is a [[spring]]"),
            ("the deck", "pin", &["point"], "use [[support]] with fix = \"pin\""),
            ("[[expect]]", "node", &["at", "column"], "the column names the node"),
        ] {
            let came = for_key(table, written, known).help().unwrap_or_default();
            assert!(came.starts_with(help), "{table} {written}: {came}");
        }
        for (key, written, known, help) in [
            ("scheme", "generalizedAlpha", &["generalized_alpha"][..], "did you mean `generalized_alpha`?"),
            ("fix", "hinge", &["pin"], "fix two of rx ry rz"),
            ("kind", "riks", &["static"], "use kind = \"static\" with control"),
            ("columns", "RF", &["reaction"], "use `reaction`"),
        ] {
            let came = for_word(key, written, known).help().unwrap_or_default();
            assert!(came.starts_with(help), "{key} {written}: {came}");
        }
    }

    /// A row for a key that the table has would never be shown, nor a word that stands twice.
    #[test]
    fn every_row_is_reached() {
        let entries = crate::deck::entries();
        let is_key = |table: &str, word: &str| {
            entries.iter().any(|entry| match entry.path.rsplit_once('.') {
                Some((above, key)) => above.rsplit('.').next() == Some(table) && bare(key) == bare(word),
                None => table == "deck" && bare(&entry.path) == bare(word),
            })
        };
        for (k, row) in EXPLAINED.iter().enumerate() {
            for word in row.written {
                assert!(!is_key(row.table, word), "`{word}` is a key of {}", row.table);
                let others = EXPLAINED[..k].iter().filter(|other| other.table == row.table);
                assert!(others.into_iter().all(|other| !is_among(word, other.written)), "{}: {word} twice", row.table);
            }
        }
        for row in SYNONYMS.iter().chain(WORDS) {
            let count = |word: &str| row.written.iter().filter(|other| bare(other) == bare(word)).count();
            row.written.iter().for_each(|word| assert_eq!(count(word), 1, "{word}"));
        }
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

    /// The kind of other programs is a joint that slides along its own axis, or along a beam.
    #[test]
    fn sliders_lead_to_their_table() {
        for written in ["slider", "slide", "sliding"] {
            let told = hint("kind", written, &["revolute", "prismatic"]).unwrap();
            assert!(told.contains("[[slider]]") && told.contains("prismatic"), "{told}");
            assert!(hint("fix", written, &["ux", "all"]).unwrap().contains("[[slider]]"));
        }
    }

    /// A hint that leads to a word which the deck does not have would mislead again.
    #[test]
    fn synonyms_lead_to_keys_and_words_of_the_deck() {
        let known = |word: &str| crate::deck::SCHEMA.contains(&format!("\"{word}\""));
        for row in SYNONYMS.iter().chain(WORDS) {
            row.meant.iter().for_each(|word| assert!(known(word), "{word}"));
        }
        for row in EXPLAINED {
            assert!(row.table == "deck" || known(row.table), "{}", row.table);
        }
        for row in EXPLAINED_WORDS {
            assert!(known(row.key), "{}", row.key);
        }
    }
}
