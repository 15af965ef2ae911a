//! Rigid surfaces in a scene, with what carries them.

use crate::kernel::Weights;
use crate::kernel::contact::{Carrier, Shape, Side, Surface};
use crate::rotation::{Rotation, relative_angle};
use crate::system::{MirrorData, Node, Slot, State};
use crate::tensor::{Mat3, Vec3};

/// A rigid surface of a scene.
#[derive(Clone, Debug)]
pub struct SceneSurface {
    /// Its name
    pub name: String,
    /// Its shape, at its initial place (global axes)
    pub surface: Surface,
    /// What carries it
    pub carrier: SurfaceCarrier,
}

/// What carries a surface.
#[derive(Clone, Copy, Debug)]
pub enum SurfaceCarrier {
    /// The ground
    Ground,
    /// A node
    Node {
        /// The node
        node: Node,
        /// Its initial place
        place: Vec3,
    },
    /// A prescribed displacement
    Shift {
        /// Its direction, a unit vector
        direction: Vec3,
        /// The index of its amplitude, the displacement
        amplitude: usize,
    },
    /// A prescribed rotation
    Turn {
        /// A point of its axis
        about: Vec3,
        /// The axis, a unit vector
        axis: Vec3,
        /// The index of its amplitude, the angle in radians
        amplitude: usize,
    },
}

impl SceneSurface {
    /// The place at which the centre line of this tube leaves another one, if both hold what touches them within
    /// them and stand still; `size` is a length of the order of gaps.
    pub fn leaves(&self, other: &Self, size: f64) -> Option<Vec3> {
        let stand_still = [self, other].iter().all(|surface| matches!(surface.carrier, SurfaceCarrier::Ground));
        if !stand_still || other.surface.centre_line_of_lumen().is_empty() {
            return None;
        }
        let is_outside = |place: &Vec3| other.surface.value(*place, size).is_some_and(|gap| gap < 0.0);
        self.surface.centre_line_of_lumen().into_iter().find(is_outside)
    }

    /// The angle of a prescribed rotation between two lists of amplitudes, in radians.
    pub(super) fn turned(&self, from: &[f64], to: &[f64]) -> f64 {
        match self.carrier {
            SurfaceCarrier::Turn { amplitude, .. } => (to[amplitude] - from[amplitude]).abs(),
            SurfaceCarrier::Ground | SurfaceCarrier::Node { .. } | SurfaceCarrier::Shift { .. } => 0.0,
        }
    }

    /// The carrier in a state, for the tangent of `weights`.
    pub(super) fn carrier(&self, at: &State, weights: Weights) -> Carrier {
        match self.carrier {
            SurfaceCarrier::Ground => Carrier::ground(),
            SurfaceCarrier::Node { node, place } => node_carrier(node, place, at, weights),
            SurfaceCarrier::Shift { direction, amplitude } => Carrier {
                place: direction * at.amplitude[amplitude],
                velocity: direction * at.amplitude_rates[amplitude][0],
                ..Carrier::ground()
            },
            SurfaceCarrier::Turn { about, axis, amplitude } => Carrier {
                place: about,
                rotation: Rotation::new(axis * at.amplitude[amplitude]),
                omega: axis * at.amplitude_rates[amplitude][0],
                origin: about,
                ..Carrier::ground()
            },
        }
    }

    /// How far the way of a place, between two ends (axes of the surface), may be off its chord, a length: twice the
    /// angle by which the surface turns between the states times the farther distance of the ends from what it turns about.
    pub(super) fn off_chord(&self, ends: [Vec3; 2], from: &State, to: &State) -> f64 {
        let (angle, levers) = match self.carrier {
            SurfaceCarrier::Turn { about, axis, .. } => {
                (self.turned(&from.amplitude, &to.amplitude), ends.map(|end| axis.cross(end - about).norm()))
            }
            SurfaceCarrier::Node { node, place } => {
                let [before, after] = [from, to].map(|at| at.rotation(node.p).r);
                (relative_angle(before, after), ends.map(|end| (end - place).norm()))
            }
            SurfaceCarrier::Ground | SurfaceCarrier::Shift { .. } => return 0.0,
        };
        2.0 * angle * levers[0].max(levers[1])
    }

    /// A place (global components) in the axes of the surface.
    pub(super) fn on_surface(&self, place: Vec3, at: &State) -> Vec3 {
        match self.carrier {
            SurfaceCarrier::Ground => place,
            SurfaceCarrier::Shift { direction, amplitude } => place - direction * at.amplitude[amplitude],
            SurfaceCarrier::Node { .. } | SurfaceCarrier::Turn { .. } => {
                self.carrier(at, Weights::NONE).on_surface(place)
            }
        }
    }

    /// Its rotation and its shift in a state: a point y of the surface is at R y + d.
    pub fn pose(&self, at: &State) -> (Mat3, Vec3) {
        let carrier = self.carrier(at, Weights::NONE);
        let rotation = carrier.rotation.r;
        (rotation, carrier.place - rotation * carrier.origin)
    }

    /// The depth from which a point that penetrates still finds its way out; infinite for planes, and
    /// where beams are inside.
    pub(super) fn depth(&self) -> f64 {
        match self.surface.side {
            Side::Outside => self.surface.shape.depth(),
            Side::Inside => f64::INFINITY,
        }
    }

    /// The node that carries it, if there is one.
    pub fn carrier_node(&self) -> Option<Node> {
        match self.carrier {
            SurfaceCarrier::Node { node, .. } => Some(node),
            SurfaceCarrier::Ground | SurfaceCarrier::Shift { .. } | SurfaceCarrier::Turn { .. } => None,
        }
    }

    /// The slots of its carrier.
    pub(super) fn slots(&self) -> Option<[Slot; 2]> {
        self.carrier_node().map(|node| [node.u, node.p])
    }

    /// Shows the data that a reflection must leave unchanged. `reference` is a place of the scene.
    pub(super) fn mirror_data(&self, reference: Vec3, show: &mut dyn FnMut(MirrorData)) {
        match &self.surface.shape {
            Shape::Plane { normal, .. } => show(MirrorData::Vector(*normal)),
            Shape::Sphere { centre, .. } => show(MirrorData::Place(*centre)),
            Shape::Cylinder { point, axis, .. } => {
                let aside = *point - reference;
                show(MirrorData::Line(*axis));
                show(MirrorData::Vector(aside - *axis * axis.dot(aside)));
            }
            Shape::Cone(cone) => cone.ends().into_iter().for_each(|end| show(MirrorData::Place(end))),
            Shape::Torus { centre, axis, .. } => {
                show(MirrorData::Place(*centre));
                show(MirrorData::Line(*axis));
            }
            // A box whose edges are equal has more planes, in which it is simulated in space.
            Shape::Box { centre, axes, .. } => {
                show(MirrorData::Place(*centre));
                (0..3).for_each(|k| show(MirrorData::Line(axes.column(k))));
            }
            Shape::Tube(_) | Shape::Mesh(_) => show(MirrorData::Spatial),
        }
        match self.carrier {
            SurfaceCarrier::Ground => {}
            SurfaceCarrier::Node { place, .. } => show(MirrorData::Place(place)),
            SurfaceCarrier::Shift { direction, .. } => show(MirrorData::Vector(direction)),
            SurfaceCarrier::Turn { axis, .. } => show(MirrorData::Axial(axis)),
        }
    }

    /// The amplitude that moves the surface, with the derivative of the work of a force at a place
    /// over it; `None` for surfaces that are not driven.
    pub(super) fn driven(&self, at: &State, push: Vec3, place: Vec3) -> Option<(f64, f64)> {
        match self.carrier {
            SurfaceCarrier::Ground | SurfaceCarrier::Node { .. } => None,
            SurfaceCarrier::Shift { direction, amplitude } => Some((at.amplitude[amplitude], push.dot(direction))),
            SurfaceCarrier::Turn { about, axis, amplitude } => {
                Some((at.amplitude[amplitude], (place - about).cross(push).dot(axis)))
            }
        }
    }
}

/// The carrier of a surface on a node with the initial place `origin`.
fn node_carrier(node: Node, origin: Vec3, at: &State, weights: Weights) -> Carrier {
    let spin = at.spin(node.p);
    Carrier {
        place: origin + at.q[node.u as usize],
        velocity: at.v[node.u as usize],
        omega: spin.omega,
        omega_derivative: spin.omega_derivative(weights),
        rotation: spin.rotation,
        origin,
        is_node: true,
    }
}
