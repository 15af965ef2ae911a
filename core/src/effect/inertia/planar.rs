//! Inertia of bodies at nodes in a planar scene.

use super::rigid_body::{RigidBody, are_centred};
use crate::effect::{PlanarForm, at_slots, own_blocks};
use crate::kernel::planar::PlanarBody;
use crate::kernel::{ElementSystem, PlanarSystem, Weights};
use crate::scalar::{Instructions, LANES, Lanes, Pack, each_lane};
use crate::system::{Assembler, Memory, Plane, Slot, State};
use crate::tensor::Vec3;
use std::sync::Arc;

/// The planar form of [`RigidBody`].
pub struct PlanarBodies {
    plane: Plane,
    spatial: Arc<RigidBody>,
    blocks: Vec<BodyBlock>,
}

/// Bodies side by side.
struct BodyBlock {
    /// Slots of displacements
    u: [Slot; LANES],
    /// Slots of rotations
    p: [Slot; LANES],
    body: PlanarBody<Lanes>,
}

impl PlanarBodies {
    /// The planar form of the bodies of `spatial`, which lie in `plane`.
    pub fn new(spatial: Arc<RigidBody>, plane: Plane) -> Self {
        let bodies = spatial.bodies.chunks(LANES).map(|bodies| {
            let all: [_; LANES] = each_lane!(|k| &bodies[k.min(bodies.len() - 1)]);
            let in_plane = all.map(|body| PlanarBody::new(&body.inertia, plane.axes()));
            BodyBlock {
                u: all.map(|body| body.node.u),
                p: all.map(|body| body.node.p),
                body: PlanarBody::pack(in_plane.each_ref()),
            }
        });
        Self { plane, blocks: bodies.collect(), spatial }
    }

    #[inline(always)]
    fn add_side_by_side(&self, at: &State, weights: Weights, out: &mut Assembler) {
        let plane = &self.plane;
        let bodies = &self.spatial.bodies;
        let normal = plane.normal();
        let along = |v: Vec3<Lanes>, axis: Vec3| v.0[0] * axis.0[0] + v.0[1] * axis.0[1] + v.0[2] * axis.0[2];
        let in_plane = |v: Vec3<Lanes>| [along(v, plane.axes().column(0)), along(v, plane.axes().column(1))];
        let gyroscopic = if self.spatial.gyroscopic { 1.0 } else { 0.0 };
        let mut alone = None;
        let centred = are_centred(&bodies[out.instances()]);
        for number in own_blocks(0, bodies.len(), out) {
            let block = &self.blocks[number];
            let first = number * LANES;
            let angle = along(at_slots(&at.q, block.p), normal);
            let spin = along(at_slots(&at.v, block.p), normal) * gyroscopic;
            let spin_rate = along(at_slots(&at.a, block.p), normal);
            let acceleration = in_plane(at_slots(&at.a, block.u));
            let system: PlanarSystem<1, Lanes> = block.body.evaluate(acceleration, angle, [spin, spin_rate], weights);
            let count = LANES.min(bodies.len() - first);
            out.add_planar(
                plane,
                first,
                count,
                &system,
                |_| false,
                |k, out| {
                    let system = alone.get_or_insert_with(|| ElementSystem::new(2));
                    self.spatial.add_one(first + k, centred, at, weights, system, out);
                },
            );
        }
    }
}

impl PlanarForm for PlanarBodies {
    /// True if all mass centres are at their nodes: spins about one axis have no gyroscopic
    /// moments, only centrifugal forces of eccentric masses.
    fn is_symmetric(&self) -> bool {
        are_centred(&self.spatial.bodies)
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        Instructions::here().run(
            #[inline(always)]
            || self.add_side_by_side(at, weights, out),
        );
    }
}
