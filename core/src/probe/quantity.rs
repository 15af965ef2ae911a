//! What can be looked at, and the names of its columns.

use super::place::{BeamPoint, Place};
use crate::kernel::inertia::Spin;
use crate::rotation::{Rotation, principal};
use crate::run::Snapshot;
use crate::system::Node;
use crate::tensor::Vec3;

/// A quantity of a state.
#[derive(Clone)]
pub enum Quantity {
    /// u
    Displacement(Place),
    /// x
    Position(Place),
    /// The total rotation vector with |r| <= pi
    Rotation(Place),
    /// The same, continued from row to row
    Wound(Place),
    /// The section axes
    Axes(Place),
    /// Velocity
    Velocity(Place),
    /// Spatial angular velocity
    Spin(Place),
    /// Acceleration
    Acceleration(Place),
    /// Spatial angular acceleration
    AngularAcceleration(Place),
    /// What the supports and motions do to the structure at a node, spatial
    Reaction(Node),
    /// Stress resultants in section axes
    Resultant(BeamPoint),
    /// Strains in section axes
    Strain(BeamPoint),
    /// The energy account
    Energy,
    /// Momenta and the centre of mass
    Momentum,
    /// The number of the stage
    Stage,
    /// The run's clock
    Time,
    /// The load factor
    Load,
}

/// NodeBlocks of columns of a node, with the suffixes of their columns.
pub const NODE_GROUPS: [(&str, &[&str]); 12] = [
    ("u", &["ux", "uy", "uz"]),
    ("x", &["x", "y", "z"]),
    ("r", &["rx", "ry", "rz"]),
    // A history holds one of the two: they have the same columns.
    ("rc", &["rx", "ry", "rz"]),
    ("d", &["d1x", "d1y", "d1z", "d2x", "d2y", "d2z", "d3x", "d3y", "d3z"]),
    ("v", &["vx", "vy", "vz"]),
    ("w", &["wx", "wy", "wz"]),
    ("a", &["ax", "ay", "az"]),
    ("alpha", &["alphax", "alphay", "alphaz"]),
    ("reaction", &["fx", "fy", "fz", "mx", "my", "mz"]),
    ("resultant", &["N1", "N2", "N3", "M1", "M2", "M3"]),
    ("strain", &["G1", "G2", "G3", "K1", "K2", "K3"]),
];

/// NodeBlocks of columns of the whole scene.
pub const WHOLE_GROUPS: [(&str, &[&str]); 2] = [
    ("energy", &["kinetic", "strain", "external", "damped", "total"]),
    ("momentum", &["px", "py", "pz", "lx", "ly", "lz", "cx", "cy", "cz"]),
];

/// The suffixes of a group.
pub fn suffixes(group: &str) -> Option<&'static [&'static str]> {
    NODE_GROUPS.iter().chain(&WHOLE_GROUPS).find(|(name, _)| *name == group).map(|(_, suffixes)| *suffixes)
}

/// A quantity with the names of its columns.
#[derive(Clone)]
pub struct Probe {
    /// One name a column
    pub names: Vec<String>,
    /// What they show
    pub quantity: Quantity,
}

impl Probe {
    /// Appends the values of the columns.
    pub fn read(&self, at: &Snapshot, out: &mut Vec<f64>) {
        let state = at.state;
        let mut vector = |v: Vec3| out.extend(v.0);
        match &self.quantity {
            Quantity::Displacement(place) => vector(place.motion(state).u),
            Quantity::Position(place) => vector(place.initial() + place.motion(state).u),
            Quantity::Rotation(place) => vector(principal(place.motion(state).p)),
            Quantity::Wound(place) => vector(place.unwrapped(state)),
            Quantity::Axes(place) => {
                let axes = Rotation::new(place.motion(state).p).r * place.frame;
                (0..3).for_each(|k| vector(axes.column(k)));
            }
            Quantity::Velocity(place) => vector(place.motion(state).u_rate),
            Quantity::Acceleration(place) => vector(place.motion(state).u_rate2),
            Quantity::Spin(place) => {
                let spin = spin(place, at);
                vector(spin.rotation.r * spin.omega);
            }
            Quantity::AngularAcceleration(place) => {
                let spin = spin(place, at);
                vector(spin.rotation.r * spin.acceleration);
            }
            Quantity::Reaction(node) => {
                let held = |slot: u32| at.system.pattern.dof_map.held_part(slot, at.system.total(slot as usize));
                let (force, moment) = at.model.held_by_ground(state, *node);
                vector(held(node.u) - force);
                vector(Rotation::new(state.q[node.p as usize]).t_inverse() * (held(node.p) - moment));
            }
            Quantity::Strain(point) => out.extend(point.strain_and_stress(state)[0]),
            Quantity::Resultant(point) => out.extend(point.strain_and_stress(state)[1]),
            Quantity::Energy => {
                let ledger = at.ledger;
                out.extend([ledger.kinetic, ledger.strain, ledger.external, ledger.damped, ledger.total()]);
            }
            Quantity::Momentum => {
                let sum = at.model.momentum(state);
                vector(sum.linear);
                vector(sum.angular);
                vector(if sum.mass > 0.0 { sum.moment * (1.0 / sum.mass) } else { Vec3::ZERO });
            }
            Quantity::Stage => out.push(at.stage as f64),
            Quantity::Time => out.push(state.time),
            Quantity::Load => out.push(state.load),
        }
    }
}

fn spin(place: &Place, at: &Snapshot) -> Spin {
    let motion = place.motion(at.state);
    Spin::new(motion.p, motion.p_rate, motion.p_rate2)
}
