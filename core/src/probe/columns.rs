//! The table of output columns: names, quantities, and the functions that read them from a
//! converged state.
//!
//! A new group of columns is a row of [`COLUMNS`] and the function that reads it. Histories,
//! expectations, error scales, pictures and the report ask the row.

use super::beam_point::{BeamPoint, ElementCache, StressPlace, StressPoint};
use super::place::Place;
use super::quantity::Quantity;
use crate::kernel::inertia::Spin;
use crate::rotation::{Rotation, Series, principal};
use crate::run::Snapshot;
use crate::section::recovery::Measure;
use crate::section::stress::von_mises;
use crate::system::Node;
use crate::tensor::Vec3;
use std::f64::consts::TAU;

/// A group of columns, which a deck asks for by its key.
pub struct ColumnGroup {
    /// Word in a deck; the columns of the whole scene and of the run begin with it
    pub key: &'static str,
    /// Columns in the order in which they are written, quantity by quantity
    pub parts: &'static [ColumnPart],
    /// Object that the columns belong to, with the function that reads them
    pub source: Source,
    /// Parts of a model or run that must be there for the columns
    pub needs: &'static [Need],
    /// For values that are not unique: replaces the first by its representative that is nearest to
    /// the second
    pub nearest: Option<Nearest>,
}

/// Replaces the first values by those that mean the same and are nearest to the second.
pub type Nearest = fn(&mut [f64], &[f64]);

/// Columns of one quantity: the components of a vector, or the terms of a sum.
pub struct ColumnPart {
    /// Name of the values in plots and reports
    pub title: &'static str,
    /// Physical quantity of the values
    pub quantity: Quantity,
    /// Ends of the names of the columns; none where the key alone is the name
    pub suffixes: &'static [&'static str],
}

/// The object that columns belong to, with the function that appends their values to a row.
#[derive(Clone, Copy)]
pub enum Source {
    /// A node, or a place within a beam element
    Place(fn(&Place, &Snapshot, &mut Vec<f64>)),
    /// A node
    Node(fn(Node, &Snapshot, &mut Vec<f64>)),
    /// A point of one beam
    BeamPoint(fn(&BeamPoint, &Snapshot, &mut Vec<f64>)),
    /// A section of one beam with its stresses
    Stress(fn(&StressPlace, &Snapshot, &mut Vec<f64>)),
    /// A fixed point of such a section
    StressPoint(fn(&StressPoint, &Snapshot, &mut Vec<f64>)),
    /// A contact, by its number
    Contact(fn(usize, &Snapshot, &mut Vec<f64>)),
    /// The whole scene
    Scene(fn(&Snapshot, &mut Vec<f64>)),
    /// The clocks of the run, which begin every row
    Run(fn(&Snapshot, &mut Vec<f64>)),
}

/// Parts of a model or run that cost time and are there only where columns need them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// Inertia, also in static stages
    Mass,
    /// The energy account
    EnergyAccount,
    /// Rotation vectors continued from row to row
    ContinuedRotations,
}

/// All groups: those of nodes, of the whole scene, and of the run. Where suffixes stand in two
/// groups, the first is meant unless a deck writes the other.
pub static COLUMNS: [ColumnGroup; 21] = [
    ColumnGroup {
        key: "u",
        parts: &[part("displacement", Quantity::Displacement, &["ux", "uy", "uz"])],
        source: Source::Place(|place, at, out| out.extend(place.motion(at.state).u.0)),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "x",
        parts: &[part("position", Quantity::Position, &["x", "y", "z"])],
        source: Source::Place(|place, at, out| out.extend((place.initial() + place.motion(at.state).u).0)),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "r",
        parts: &[part("rotation vector", Quantity::Rotation, &["rx", "ry", "rz"])],
        source: Source::Place(|place, at, out| out.extend(principal(place.motion(at.state).p).0)),
        needs: &[],
        nearest: Some(nearest_rotation_vector),
    },
    ColumnGroup {
        key: "rc",
        parts: &[part("rotation vector", Quantity::Rotation, &["rx", "ry", "rz"])],
        source: Source::Place(|place, at, out| out.extend(place.unwrapped(at.state).0)),
        needs: &[Need::ContinuedRotations],
        nearest: None,
    },
    ColumnGroup {
        key: "d",
        parts: &[
            part("section axis d1", Quantity::SectionAxis, &["d1x", "d1y", "d1z"]),
            part("section axis d2", Quantity::SectionAxis, &["d2x", "d2y", "d2z"]),
            part("section axis d3", Quantity::SectionAxis, &["d3x", "d3y", "d3z"]),
        ],
        source: Source::Place(section_axes),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "q",
        parts: &[part("unit quaternion", Quantity::Orientation, &["qw", "qx", "qy", "qz"])],
        source: Source::Place(orientation),
        needs: &[],
        nearest: Some(nearest_quaternion),
    },
    ColumnGroup {
        key: "v",
        parts: &[part("velocity", Quantity::Velocity, &["vx", "vy", "vz"])],
        source: Source::Place(|place, at, out| out.extend(place.motion(at.state).u_rate.0)),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "w",
        parts: &[part("angular velocity", Quantity::AngularVelocity, &["wx", "wy", "wz"])],
        source: Source::Place(angular_velocity),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "a",
        parts: &[part("acceleration", Quantity::Acceleration, &["ax", "ay", "az"])],
        source: Source::Place(|place, at, out| out.extend(place.motion(at.state).u_rate2.0)),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "alpha",
        parts: &[part("angular acceleration", Quantity::AngularAcceleration, &["alphax", "alphay", "alphaz"])],
        source: Source::Place(angular_acceleration),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "reaction",
        parts: &[
            part("reaction force", Quantity::ReactionForce, &["fx", "fy", "fz"]),
            part("reaction moment", Quantity::ReactionMoment, &["mx", "my", "mz"]),
        ],
        source: Source::Node(reaction),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "resultant",
        parts: &[
            part("section force", Quantity::SectionForce, &["N1", "N2", "N3"]),
            part("section moment", Quantity::SectionMoment, &["M1", "M2", "M3"]),
        ],
        source: Source::BeamPoint(|point, at, out| {
            out.extend(point.strain_and_stress(&mut ElementCache::new(at.state, at.origin))[1])
        }),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "strain",
        parts: &[
            part("strain", Quantity::Strain, &["G1", "G2", "G3"]),
            part("change of curvature", Quantity::Curvature, &["K1", "K2", "K3"]),
        ],
        source: Source::BeamPoint(|point, at, out| {
            out.extend(point.strain_and_stress(&mut ElementCache::new(at.state, at.origin))[0])
        }),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "stress",
        parts: &[LARGEST_STRESSES],
        source: Source::Stress(largest_stresses),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "line_contact",
        parts: &[part("contact force per length", Quantity::ContactForcePerLength, &["cn", "cf"])],
        source: Source::BeamPoint(|point, at, out| {
            let contacts = at.model.contacts();
            let force =
                contacts.map_or([0.0; 2], |contacts| contacts.force_along(point.beam, point.fraction, at.state));
            out.extend(force);
        }),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "contact",
        parts: &[
            part("contact gap", Quantity::ContactGap, &["gap", "depth"]),
            part("contact force", Quantity::ContactForce, &["normal", "friction", "fx", "fy", "fz"]),
            part("contact moment", Quantity::ContactMoment, &["mx", "my", "mz"]),
            part("contact length", Quantity::ContactLength, &["length"]),
            part("contact points", Quantity::ContactPoints, &["points", "sliding"]),
        ],
        source: Source::Contact(contact),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "energy",
        parts: &[part("energy", Quantity::Energy, &["kinetic", "strain", "external", "damped", "total"])],
        source: Source::Scene(energy),
        needs: &[Need::EnergyAccount],
        nearest: None,
    },
    ColumnGroup {
        key: "momentum",
        parts: &[
            part("momentum", Quantity::Momentum, &["px", "py", "pz"]),
            part("angular momentum", Quantity::AngularMomentum, &["lx", "ly", "lz"]),
            part("centre of mass", Quantity::CentreOfMass, &["cx", "cy", "cz"]),
        ],
        source: Source::Scene(momentum),
        needs: &[Need::Mass],
        nearest: None,
    },
    ColumnGroup {
        key: "stage",
        parts: &[part("stage", Quantity::Stage, &[])],
        source: Source::Run(|at, out| out.push(at.stage as f64)),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "time",
        parts: &[part("time", Quantity::Time, &[])],
        source: Source::Run(|at, out| out.push(at.state.time)),
        needs: &[],
        nearest: None,
    },
    ColumnGroup {
        key: "load",
        parts: &[part("load factor", Quantity::LoadFactor, &[])],
        source: Source::Run(|at, out| out.push(at.state.load)),
        needs: &[],
        nearest: None,
    },
];

/// The columns of `energy` in scenes with contacts.
pub static ENERGY_WITH_CONTACTS: ColumnGroup = ColumnGroup {
    key: "energy",
    parts: &[part(
        "energy",
        Quantity::Energy,
        &["kinetic", "strain", "external", "damped", "contact", "friction", "total"],
    )],
    source: Source::Scene(energy_with_contacts),
    needs: &[Need::EnergyAccount],
    nearest: None,
};

/// The columns of `stress` in sections with strengths.
pub static STRESS_WITH_INDEX: ColumnGroup = ColumnGroup {
    key: "stress",
    parts: &[LARGEST_STRESSES, part("failure index", Quantity::FailureIndex, &["index"])],
    source: Source::Stress(largest_stresses_with_index),
    needs: &[],
    nearest: None,
};

/// The columns of `stress` at fixed points of sections.
pub static STRESS_AT_POINT: ColumnGroup = ColumnGroup {
    key: "stress",
    parts: &[part("stress", Quantity::Stress, &["s11", "s22", "s33", "s23", "s13", "s12", "vm"])],
    source: Source::StressPoint(|point, at, out| {
        let stress = point.stress.unit * point.inside.resultant(at.state, at.origin);
        out.extend(stress.iter());
        out.push(von_mises(&stress));
    }),
    needs: &[],
    nearest: None,
};

/// Largest stresses over a section: von Mises, first and third principal stress, stress along the
/// beam, shear.
const LARGEST_STRESSES: ColumnPart =
    part("stress", Quantity::Stress, &["vm", "s1max", "s1min", "s11max", "s11min", "tau"]);

/// Columns of modes and critical loads, which have the number of a mode before the dot.
static MODE_COLUMNS: [ColumnPart; 3] = [
    part("angular frequency", Quantity::AngularFrequency, &["omega"]),
    part("growth rate", Quantity::GrowthRate, &["growth"]),
    part("critical load factor", Quantity::LoadFactor, &["load"]),
];

const fn part(title: &'static str, quantity: Quantity, suffixes: &'static [&'static str]) -> ColumnPart {
    ColumnPart { title, quantity, suffixes }
}

/// Group with this key that a deck may ask for: the clocks of the run stand in every row.
pub fn group(key: &str) -> Option<&'static ColumnGroup> {
    COLUMNS.iter().find(|group| group.key == key && !group.is_of_run())
}

/// Names of the columns that begin every row, in their order.
pub fn clocks() -> impl Iterator<Item = &'static str> {
    COLUMNS.iter().filter(|group| group.is_of_run()).map(|group| group.key)
}

/// Group and component of a column, by its name (`tip.ux`, `energy.total`, `time`). Of groups with
/// the same suffixes the first.
pub fn find_column(name: &str) -> Option<(&'static ColumnGroup, usize)> {
    let Some((owner, suffix)) = name.rsplit_once('.') else {
        return COLUMNS.iter().find(|group| group.is_of_run() && group.key == name).map(|group| (group, 0));
    };
    let of_scene = COLUMNS.iter().find(|group| group.is_of_scene() && group.key == owner);
    let component = |group: &'static ColumnGroup| Some((group, group.component(suffix)?));
    match of_scene {
        Some(group) => component(group).or_else(|| component(&ENERGY_WITH_CONTACTS).filter(|_| group.key == "energy")),
        None => {
            let others = [&STRESS_WITH_INDEX, &STRESS_AT_POINT];
            COLUMNS.iter().filter(|group| group.is_of_node() || group.is_of_contact()).chain(others).find_map(component)
        }
    }
}

/// Part of a table that a column belongs to, by its name: a column of a history, or of modes and
/// critical loads, where the name may be the suffix alone (`mode1.omega`, `omega`).
pub fn find_part(name: &str) -> Option<&'static ColumnPart> {
    if let Some((group, component)) = find_column(name) {
        return Some(group.part(component));
    }
    let suffix = name.rsplit_once('.').map_or(name, |(_, suffix)| suffix);
    MODE_COLUMNS.iter().find(|part| part.suffixes.contains(&suffix))
}

/// Quantity of a column, by its name.
pub fn quantity(name: &str) -> Option<Quantity> {
    find_part(name).map(|part| part.quantity)
}

impl ColumnGroup {
    /// Ends of the names of all columns.
    pub fn suffixes(&self) -> impl Iterator<Item = &'static str> {
        self.parts.iter().flat_map(|part| part.suffixes).copied()
    }

    /// Place of the column with this suffix in the group.
    pub fn component(&self, suffix: &str) -> Option<usize> {
        self.suffixes().position(|known| known == suffix)
    }

    /// Names of the columns of a node, which stands before the dot.
    pub fn names_at(&self, node: &str) -> Vec<String> {
        self.suffixes().map(|suffix| format!("{node}.{suffix}")).collect()
    }

    /// Names of the columns of the whole scene or the run.
    pub fn own_names(&self) -> Vec<String> {
        if self.is_of_run() { vec![self.key.into()] } else { self.names_at(self.key) }
    }

    /// True if both groups have columns of the same names: a history then holds one of them.
    pub fn has_columns_of(&self, other: &Self) -> bool {
        self.is_of_node() && other.is_of_node() && self.suffixes().eq(other.suffixes())
    }

    /// True if the columns belong to a node, or a place on a beam.
    pub fn is_of_node(&self) -> bool {
        match self.source {
            Source::Place(_) | Source::Node(_) | Source::BeamPoint(_) | Source::Stress(_) | Source::StressPoint(_) => {
                true
            }
            Source::Contact(_) | Source::Scene(_) | Source::Run(_) => false,
        }
    }

    /// True if the columns belong to a section of one beam, which need not be at a node.
    pub fn is_of_section(&self) -> bool {
        matches!(self.source, Source::BeamPoint(_) | Source::Stress(_) | Source::StressPoint(_))
    }

    /// True if the columns belong to a contact.
    pub fn is_of_contact(&self) -> bool {
        matches!(self.source, Source::Contact(_))
    }

    /// True if the columns belong to the whole scene.
    pub fn is_of_scene(&self) -> bool {
        matches!(self.source, Source::Scene(_))
    }

    fn is_of_run(&self) -> bool {
        matches!(self.source, Source::Run(_))
    }

    fn part(&self, component: usize) -> &ColumnPart {
        let mut end = 0;
        let holds = |part: &&ColumnPart| {
            end += part.suffixes.len();
            component < end
        };
        self.parts.iter().find(holds).unwrap_or(&self.parts[0])
    }
}

/// Section axes d1, d2, d3 of the rotated section, spatial components.
fn section_axes(place: &Place, at: &Snapshot, out: &mut Vec<f64>) {
    let axes = Rotation::new(place.motion(at.state).p).r * place.frame;
    (0..3).for_each(|k| out.extend(axes.column(k).0));
}

/// Unit quaternion of the total rotation: scalar part, which is not negative, then vector part,
/// which points along the rotation vector of at most pi.
fn orientation(place: &Place, at: &Snapshot, out: &mut Vec<f64>) {
    let p = principal(place.motion(at.state).p);
    // Cosine of half the angle, and sine over it: no angle in a denominator.
    let [cosine, sine_over_half_angle, ..] = Series::at(0.25 * p.squared()).0;
    out.push(cosine.max(0.0));
    out.extend((p * (0.5 * sine_over_half_angle)).0);
}

/// Spatial angular velocity.
fn angular_velocity(place: &Place, at: &Snapshot, out: &mut Vec<f64>) {
    let spin = spin(place, at);
    out.extend((spin.rotation.r * spin.omega).0);
}

/// Spatial angular acceleration.
fn angular_acceleration(place: &Place, at: &Snapshot, out: &mut Vec<f64>) {
    let spin = spin(place, at);
    out.extend((spin.rotation.r * spin.acceleration).0);
}

fn spin(place: &Place, at: &Snapshot) -> Spin {
    let motion = place.motion(at.state);
    Spin::new(motion.p, motion.p_rate, motion.p_rate2)
}

/// Force and moment that supports and motions exert on the structure at a node, spatial components.
fn reaction(node: Node, at: &Snapshot, out: &mut Vec<f64>) {
    let state = at.state;
    let held = |slot: u32| at.system.pattern.dof_map.held_part(slot, at.system.total(slot as usize));
    let (force, moment) = at.model.held_by_ground(state, at.origin, node);
    out.extend((held(node.u) - force).0);
    // In linear stages moments are conjugate to rotation vectors about the origin.
    let rotation_vector = at.origin.unwrap_or(state).q[node.p as usize];
    out.extend((Rotation::new(rotation_vector).t_inverse() * (held(node.p) - moment)).0);
}

/// Largest and smallest stresses over a section.
fn largest_stresses(place: &StressPlace, at: &Snapshot, out: &mut Vec<f64>) {
    let load = place.inside.resultant(at.state, at.origin);
    for (measure, _, sign) in Measure::ALL {
        let found = place.section.largest(measure, &load, f64::NEG_INFINITY);
        out.push(found.map_or(f64::NAN, |peak| sign * peak.value));
    }
}

/// Largest and smallest stresses over a section, and its failure index.
fn largest_stresses_with_index(place: &StressPlace, at: &Snapshot, out: &mut Vec<f64>) {
    largest_stresses(place, at, out);
    let load = place.inside.resultant(at.state, at.origin);
    out.push(place.section.largest_index(&load, f64::NEG_INFINITY).map_or(f64::NAN, |peak| peak.value));
}

/// The energy account.
fn energy(at: &Snapshot, out: &mut Vec<f64>) {
    let ledger = at.ledger;
    out.extend([ledger.kinetic, ledger.strain, ledger.external, ledger.damped, ledger.total()]);
}

/// The energy account with the parts of contacts.
fn energy_with_contacts(at: &Snapshot, out: &mut Vec<f64>) {
    let ledger = at.ledger;
    out.extend([ledger.kinetic, ledger.strain, ledger.external, ledger.damped]);
    out.extend([ledger.contact, ledger.friction, ledger.total()]);
}

/// Gap, forces, moment about the origin (or about the node that carries the surface), length and
/// points of a contact; zeros where contacts are switched off.
fn contact(number: usize, at: &Snapshot, out: &mut Vec<f64>) {
    let Some(contacts) = at.model.contacts() else {
        out.extend([0.0; 13]);
        return;
    };
    let sum = contacts.resultant(number, at.state);
    // Where nothing is there to touch, such as beyond the open end of a tube.
    let gap = if sum.gap.is_finite() { sum.gap } else { at.model.length };
    out.extend([gap, (-gap).max(0.0), sum.normal, sum.friction]);
    out.extend(sum.force.0);
    out.extend(sum.moment.0);
    out.extend([sum.length, sum.points as f64, sum.sliding as f64]);
}

/// Momentum, angular momentum about the origin, and centre of mass.
fn momentum(at: &Snapshot, out: &mut Vec<f64>) {
    let sum = at.model.momentum(at.state);
    out.extend(sum.linear.0);
    out.extend(sum.angular.0);
    let centre = if sum.mass > 0.0 { sum.moment * (1.0 / sum.mass) } else { Vec3::ZERO };
    out.extend(centre.0);
}

/// A rotation has two rotation vectors of up to 2 pi: takes the one that is nearer to `goal`.
fn nearest_rotation_vector(vector: &mut [f64], goal: &[f64]) {
    let angle = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    if angle == 0.0 {
        return;
    }
    let other: Vec<f64> = vector.iter().map(|x| x * (1.0 - TAU / angle)).collect();
    if squared_distance(&other, goal) < squared_distance(vector, goal) {
        vector.copy_from_slice(&other);
    }
}

/// A quaternion and its negative are the same rotation: takes the one that is nearer to `goal`.
fn nearest_quaternion(quaternion: &mut [f64], goal: &[f64]) {
    if quaternion.iter().zip(goal).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
        quaternion.iter_mut().for_each(|x| *x = -*x);
    }
}

fn squared_distance(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_columns_belong_to_one_group() {
        for (k, group) in COLUMNS.iter().enumerate() {
            for other in &COLUMNS[..k] {
                assert_ne!(group.key, other.key);
                let shared = group.suffixes().any(|suffix| other.component(suffix).is_some());
                let both_of_nodes = group.is_of_node() && other.is_of_node();
                assert!(!(both_of_nodes && shared) || group.has_columns_of(other), "{} {}", group.key, other.key);
            }
        }
    }

    #[test]
    fn columns_are_found_by_their_names() {
        let found = |name: &str| find_column(name).map(|(group, component)| (group.key, component));
        assert_eq!(found("arm@0.5.M2"), Some(("resultant", 4)));
        assert_eq!(found("momentum.cx"), Some(("momentum", 6)));
        assert_eq!(found("tip.rz"), Some(("r", 2)));
        assert_eq!(found("load"), Some(("load", 0)));
        assert_eq!([found("arm@0.5.vm"), found("arm@0.5.index")], [Some(("stress", 0)), Some(("stress", 6))]);
        assert_eq!(found("arm@0.5.top.s12"), Some(("stress", 5)));
        assert_eq!([found("energy.ux"), found("tip.total"), found("ux"), found("tip.load")], [None; 4]);
        assert_eq!(quantity("tip.my"), Some(Quantity::ReactionMoment));
        assert_eq!(quantity("tip.d3x"), Some(Quantity::SectionAxis));
    }
}
