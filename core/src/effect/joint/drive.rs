//! Drives of joints: a spring with a damper, or a motor, on the free coordinate x of a joint.

use super::coordinate::{Coordinate, Rate};
use super::{FreeCoordinate, Joint};
use crate::kernel::joint::End;
use crate::kernel::{ElementSystem, Weights};
use crate::scalar::Jet;
use crate::system::State;
use crate::tensor::Vec3;

/// A motor: it prescribes the course of a free coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Motor {
    /// Angle in radians, or displacement, at an amplitude of one
    pub value: f64,
    /// The index of its amplitude
    pub amplitude: usize,
}

impl Motor {
    /// The present angle or displacement.
    pub(super) fn value(&self, at: &State) -> f64 {
        self.value * at.amplitude[self.amplitude]
    }

    /// The present angle or displacement with its derivatives over time.
    pub(super) fn course(&self, at: &State) -> Jet {
        let [rate, rate2] = at.amplitude_rates[self.amplitude];
        Jet { value: self.value(at), rate: self.value * rate, rate2: self.value * rate2 }
    }
}

/// A spring and a damper: the force k x + c dx/dt along the coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringDamper {
    /// k: moment per angle, or force per length
    pub stiffness: f64,
    /// c: moment per angular velocity, or force per velocity
    pub damping: f64,
}

/// A drive of a joint, on one of its free coordinates.
#[derive(Clone, Copy, Debug)]
pub enum Drive {
    /// A spring with a damper
    Spring(FreeCoordinate, SpringDamper),
    /// A motor
    Motor(FreeCoordinate, Motor),
}

impl Joint {
    /// The motor of the joint, if it acts on this coordinate.
    pub(super) fn motor_on(&self, coordinate: FreeCoordinate) -> Option<Motor> {
        match self.drive {
            Some(Drive::Motor(on, motor)) if on == coordinate => Some(motor),
            Some(Drive::Motor(..) | Drive::Spring(..)) | None => None,
        }
    }

    /// The motor of the joint, with the coordinate that it prescribes.
    pub(super) fn motor(&self) -> Option<(FreeCoordinate, Motor)> {
        match self.drive {
            Some(Drive::Motor(on, motor)) => Some((on, motor)),
            Some(Drive::Spring(..)) | None => None,
        }
    }

    /// The spring and the damper of the joint, with the coordinate that they act on.
    pub(super) fn spring(&self) -> Option<(FreeCoordinate, SpringDamper)> {
        match self.drive {
            Some(Drive::Spring(on, spring)) => Some((on, spring)),
            Some(Drive::Motor(..)) | None => None,
        }
    }

    /// True if the joint has a damper.
    pub(super) fn damps(&self) -> bool {
        self.spring().is_some_and(|(_, spring)| spring.damping != 0.0)
    }

    /// Adds force and tangent of spring and damper: f = (k x + c dx/dt) dx/dq. The damping part of
    /// the force is left to [`Self::drag`].
    pub(super) fn add_spring(&self, at: &State, ends: &[End; 2], weights: Weights, out: &mut ElementSystem) {
        let Some((on, SpringDamper { stiffness, damping })) = self.spring() else { return };
        let coordinate = self.coordinate(on, at, ends);
        let Rate { value: rate, over_rate, over_unknown } = self.rate(at, &coordinate);
        for row in 0..4 {
            let along = coordinate.gradient[row];
            out.add_force(row, along * (stiffness * coordinate.value));
            for column in 0..4 {
                let unknown = coordinate.gradient[column] * stiffness + over_unknown[column] * damping;
                let varies = unknown * weights.stiffness + over_rate[column] * (damping * weights.damping);
                let bent = coordinate.hessian.tangent_block(row, column);
                let force = stiffness * coordinate.value + damping * rate;
                out.add_tangent(row, column, along.outer(varies) + bent.scale(force * weights.stiffness));
            }
        }
    }

    /// The forces of the damper on u_A, P_A, u_B, P_B.
    pub(super) fn drag(&self, at: &State) -> [Vec3; 4] {
        let Some((on, spring)) = self.spring() else { return [Vec3::ZERO; 4] };
        let coordinate = self.coordinate(on, at, &self.ends(at));
        let rate = self.rate(at, &coordinate).value;
        coordinate.gradient.map(|gradient| gradient * (spring.damping * rate))
    }

    /// The strain energy of the spring of the joint.
    pub(super) fn strain_energy(&self, at: &State) -> f64 {
        let Some((on, SpringDamper { stiffness, .. })) = self.spring() else { return 0.0 };
        if stiffness == 0.0 {
            return 0.0;
        }
        let value = self.coordinate(on, at, &self.ends(at)).value;
        0.5 * stiffness * value * value
    }

    /// The change of the coordinate of its spring by a field of increments: radians, or a share of
    /// `length`; zero without a stiffness.
    pub(super) fn strain_of(&self, at: &State, field: &[Vec3], length: f64) -> f64 {
        let Some((on, SpringDamper { stiffness, .. })) = self.spring() else { return 0.0 };
        if stiffness == 0.0 {
            return 0.0;
        }
        let Coordinate { gradient, .. } = self.coordinate(on, at, &self.ends(at));
        let ends = self.nodes.iter().zip([[0, 1], [2, 3]]);
        let parts = ends.filter_map(|(node, [u, p])| {
            node.map(|node| gradient[u].dot(field[node.u as usize]) + gradient[p].dot(field[node.p as usize]))
        });
        let change = parts.sum::<f64>().abs();
        match on {
            FreeCoordinate::Angle => change,
            FreeCoordinate::Slide => change / length,
        }
    }
}
