//! Rigid bodies at nodes, with their mass centres at offsets.

use super::inertia_mirror_data;
use super::planar::PlanarBodies;
use crate::effect::{
    ELEMENTS_PER_TASK, Effect, Energy, Masses, Momentum, PlanarForm, Roles, TangentForm, at_slots, motion_of,
    quadratic, side_by_side,
};
use crate::kernel::inertia::{self, Inertia, Spin};
use crate::kernel::{ElementSystem, NodeMotion, Weights};
use crate::scalar::{Instructions, LANES, Pack, Real, each_lane};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Node, Plane, State};
use crate::tensor::Vec3;
use crate::threads;
use std::sync::Arc;

/// A rigid body at a node.
#[derive(Clone, Debug)]
pub struct Body {
    /// The node of the body
    pub node: Node,
    /// The node's initial place
    pub place: Vec3,
    /// Its mass properties about the node, shared with equal neighbours along a beam
    pub inertia: Arc<Inertia>,
}

/// The inertia of all bodies of one kind: the bodies of the deck, or the section inertia of beams
/// lumped at nodes.
#[derive(Clone, Debug)]
pub struct RigidBody {
    /// The effect's name
    pub name: &'static str,
    /// The bodies
    pub bodies: Vec<Body>,
    /// True if gyroscopic and centrifugal forces count
    pub gyroscopic: bool,
}

impl Effect for RigidBody {
    fn name(&self) -> &'static str {
        self.name
    }

    fn category(&self) -> Category {
        Category::Inertia
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::divisible();
        self.bodies.iter().for_each(|body| connectivity.push([body.node.u, body.node.p]));
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::General
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        for body in &self.bodies {
            show(MirrorData::Place(body.place));
            inertia_mirror_data(&body.inertia, show);
        }
    }

    fn in_plane(self: Arc<Self>, plane: &Plane) -> Option<Box<dyn PlanarForm>> {
        Some(Box::new(PlanarBodies::new(self, *plane)))
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let centred = are_centred(&self.bodies[out.instances()]);
        // Increments of rotation have spins that lanes do not compute.
        let vectors = at.turns.is_empty().then(Instructions::here);
        let done = vectors.and_then(|instructions| {
            instructions.run_side_by_side(
                #[inline(always)]
                || self.add_side_by_side(centred, at, weights, out),
            )
        });
        if done.is_none() {
            let mut system = ElementSystem::new(2);
            out.instances().for_each(|k| self.add_one(k, centred, at, weights, &mut system, out));
        }
    }

    fn energy(&self, at: &State) -> Energy {
        let mut kinetic = 0.0;
        threads::in_order(self.bodies.chunks(ELEMENTS_PER_TASK), |bodies| energy_of(bodies, at), |own| kinetic += own);
        Energy { kinetic, strain: 0.0 }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles { masses: Some(self), ..Roles::NONE }
    }
}

impl Masses for RigidBody {
    fn momentum(&self, at: &State) -> Momentum {
        let mut sum = Momentum::default();
        self.bodies.iter().for_each(|b| sum.add(momentum(&b.inertia, b.place, &at.motion(b.node), 1.0)));
        sum
    }

    fn bodies(&self, show: &mut dyn FnMut(Node, &Inertia)) {
        self.bodies.iter().for_each(|body| show(body.node, &body.inertia));
    }
}

impl RigidBody {
    /// Adds body `k`. `centred` is true if its mass centre is at its node; `system` is scratch
    /// memory.
    pub(super) fn add_one(
        &self,
        k: usize,
        centred: bool,
        at: &State,
        weights: Weights,
        system: &mut ElementSystem,
        out: &mut Assembler,
    ) {
        let body = &self.bodies[k];
        let acceleration = at.a[body.node.u as usize];
        let spin = at.spin(body.node.p);
        self.put(&body.inertia, centred, acceleration, spin, weights, system);
        out.add(k, system);
    }

    #[inline(always)]
    fn add_side_by_side(&self, centred: bool, at: &State, weights: Weights, out: &mut Assembler) {
        let mut systems = out.lend(2, weights != Weights::NONE);
        let own = &self.bodies[out.instances()];
        let before = out.instances().start;
        for first in (0..own.len()).step_by(LANES) {
            let bodies = side_by_side(own, first);
            let inertia = Inertia::pack(each_lane!(|k| &*bodies[k].inertia));
            let [u, p] = [each_lane!(|k| bodies[k].node.u), each_lane!(|k| bodies[k].node.p)];
            let spin = Spin::new(at_slots(&at.q, p), at_slots(&at.v, p), at_slots(&at.a, p));
            self.put(&inertia, centred, at_slots(&at.a, u), spin, weights, &mut systems);
            let count = LANES.min(own.len() - first);
            out.add_lanes(before + first, count, &systems, |_| false, |_, _| ());
        }
        out.take_back(systems);
    }

    /// Overwrites `system` with force and tangent of a body.
    #[inline(always)]
    fn put<T: Real>(
        &self,
        inertia: &Inertia<T>,
        centred: bool,
        acceleration: Vec3<T>,
        spin: Spin<T>,
        weights: Weights,
        system: &mut ElementSystem<T>,
    ) {
        let spin = spin.with_gyroscopic_forces(self.gyroscopic);
        let force = if centred {
            inertia::centred_body(inertia, acceleration, &spin, weights)
        } else {
            inertia::body(inertia, acceleration, &spin, weights)
        };
        force.write(weights, system);
    }
}

/// True if every mass centre is at its node.
pub(super) fn are_centred(bodies: &[Body]) -> bool {
    bodies.iter().all(|body| body.inertia.offset == Vec3::ZERO)
}

/// The kinetic energy of bodies.
fn energy_of(bodies: &[Body], at: &State) -> f64 {
    let mut sum = 0.0;
    let mut add = |energy: f64| sum += energy;
    let done = Instructions::here().run_side_by_side(
        #[inline(always)]
        || each_energy(bodies, at, &mut add),
    );
    if done.is_none() {
        bodies.iter().for_each(|body| add(kinetic(&body.inertia, &at.motion(body.node))));
    }
    sum
}

/// Calls `show` with the kinetic energy of each body, in their order.
#[inline(always)]
fn each_energy(all: &[Body], at: &State, show: &mut dyn FnMut(f64)) {
    for first in (0..all.len()).step_by(LANES) {
        let bodies = side_by_side(all, first);
        let nodes = each_lane!(|k| bodies[k].node);
        let energies = kinetic(&Inertia::pack(each_lane!(|k| &*bodies[k].inertia)), &motion_of(nodes, at));
        energies.0.iter().take(all.len() - first).for_each(|energy| show(*energy));
    }
}

/// The kinetic energy of mass properties: m v.v/2 + m v.R(Omega x d) + Omega.J0 Omega/2.
#[inline(always)]
pub(super) fn kinetic<T: Real>(inertia: &Inertia<T>, motion: &NodeMotion<T>) -> T {
    let spin = Spin::new(motion.p, motion.p_rate, Vec3::zero());
    let v = motion.u_rate;
    let relative = spin.rotation.r * spin.omega.cross(inertia.offset);
    inertia.mass * (v.squared() * 0.5 + v.dot(relative)) + quadratic(inertia.about_node, spin.omega)
}

/// Mass and momenta of `weight` times the mass properties `inertia`, at a node with the initial
/// place `place`.
pub(super) fn momentum(inertia: &Inertia, place: Vec3, motion: &NodeMotion, weight: f64) -> Momentum {
    let spin = Spin::new(motion.p, motion.p_rate, Vec3::ZERO);
    let r = spin.rotation.r;
    let m = inertia.mass;
    let x = place + motion.u;
    let arm = r * inertia.offset;
    let linear = (motion.u_rate + r * spin.omega.cross(inertia.offset)) * m;
    // The angular momentum about the node is R (J0 Omega + m d x R^T v).
    let about_node = r * (inertia.about_node * spin.omega) + arm.cross(motion.u_rate) * m;
    Momentum {
        mass: m * weight,
        moment: (x + arm) * (m * weight),
        linear: linear * weight,
        angular: (x.cross(linear) + about_node) * weight,
    }
}
