//! Inertia in a scene that lies in a plane: the mass of beams on their centre lines, and bodies at nodes.

use super::beam_mass::BeamMass;
use super::rigid_body::{RigidBody, are_centred};
use super::volume::VolumeElement;
use super::{ByOrder, PlanarForm, at_slots, own_blocks};
use crate::kernel::planar::PlanarBody;
use crate::kernel::{ElementSystem, PlanarSystem, Weights};
use crate::real::{Instructions, LANES, Lanes, Pack, each_lane};
use crate::system::{Memory, Plane, Sink, Slot, State};
use crate::tensor::Vec3;
use std::sync::Arc;

/// Consistent mass matrices, which never change.
pub struct PlanarMass {
    plane: Plane,
    spatial: Arc<BeamMass>,
    blocks: ByOrder<MassBlock<2>, MassBlock<3>, MassBlock<4>>,
}

/// Elements side by side.
struct MassBlock<const N: usize> {
    u: [[Slot; LANES]; N],
    count: usize,
    /// sum of w rhoA N_i N_j over the points
    mass: [[Lanes; N]; N],
}

impl PlanarMass {
    /// The masses of `spatial`, which lie in this plane.
    pub fn new(spatial: Arc<BeamMass>, plane: Plane) -> Self {
        let elements = &spatial.elements;
        let blocks = ByOrder {
            two: mass_blocks(&elements.two),
            three: mass_blocks(&elements.three),
            four: mass_blocks(&elements.four),
        };
        Self { plane, spatial, blocks }
    }
}

fn mass_blocks<const N: usize>(batch: &[VolumeElement<N, f64>]) -> Vec<MassBlock<N>> {
    let entry = |element: &VolumeElement<N, f64>, i: usize, j: usize| -> f64 {
        element.points.iter().map(|point| point.weight * point.quantity * point.shape[i] * point.shape[j]).sum()
    };
    let block = |elements: &[VolumeElement<N, f64>]| {
        let all: [&VolumeElement<N, f64>; LANES] = each_lane!(|k| &elements[k.min(elements.len() - 1)]);
        MassBlock {
            u: std::array::from_fn(|i| all.map(|element| element.connection.nodes[i].u)),
            count: elements.len(),
            mass: std::array::from_fn(|i| std::array::from_fn(|j| Lanes(all.map(|element| entry(element, i, j))))),
        }
    };
    batch.chunks(LANES).map(block).collect()
}

/// Adds the elements of one order, `first` instances after the first one of the effect.
#[inline(always)]
fn add_masses<const N: usize>(
    blocks: &[MassBlock<N>],
    first: usize,
    at: &State,
    plane: &Plane,
    weights: Weights,
    out: &mut Sink,
) {
    let length = blocks.last().map_or(0, |last| LANES * (blocks.len() - 1) + last.count);
    for number in own_blocks(first, length, out) {
        let block = &blocks[number];
        let mut force = [Vec3::zero(); N];
        for j in 0..N {
            let acceleration = at_slots(&at.a, block.u[j]);
            for i in 0..N {
                force[i] += acceleration * block.mass[i][j];
            }
        }
        out.add_planar_mass(plane, first + number * LANES, block.count, &force, &block.mass, weights.mass);
    }
}

impl PlanarForm for PlanarMass {
    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        let (blocks, plane) = (&self.blocks, &self.plane);
        let (two, three) = (self.spatial.elements.two.len(), self.spatial.elements.three.len());
        Instructions::here().run(
            #[inline(always)]
            || {
                add_masses(&blocks.two, 0, at, plane, weights, out);
                add_masses(&blocks.three, two, at, plane, weights, out);
                add_masses(&blocks.four, two + three, at, plane, weights, out);
            },
        );
    }
}

/// Bodies at nodes.
pub struct PlanarBodies {
    plane: Plane,
    spatial: Arc<RigidBody>,
    blocks: Vec<BodyBlock>,
}

/// Bodies side by side.
struct BodyBlock {
    u: [Slot; LANES],
    p: [Slot; LANES],
    body: PlanarBody<Lanes>,
}

impl PlanarBodies {
    /// The bodies of `spatial`, which lie in this plane.
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
    fn add_side_by_side(&self, at: &State, weights: Weights, out: &mut Sink) {
        let (plane, bodies) = (&self.plane, &self.spatial.bodies);
        let normal = plane.normal();
        let along = |v: Vec3<Lanes>, axis: Vec3| v.0[0] * axis.0[0] + v.0[1] * axis.0[1] + v.0[2] * axis.0[2];
        let in_plane = |v: Vec3<Lanes>| [along(v, plane.axes().column(0)), along(v, plane.axes().column(1))];
        let gyroscopic = if self.spatial.gyroscopic { 1.0 } else { 0.0 };
        let (mut alone, centred) = (None, are_centred(&bodies[out.instances()]));
        for number in own_blocks(0, bodies.len(), out) {
            let (block, first) = (&self.blocks[number], number * LANES);
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
    /// A spin about one axis has no gyroscopic moments; only masses beside their node pull.
    fn is_symmetric(&self) -> bool {
        are_centred(&self.spatial.bodies)
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        Instructions::here().run(
            #[inline(always)]
            || self.add_side_by_side(at, weights, out),
        );
    }
}
