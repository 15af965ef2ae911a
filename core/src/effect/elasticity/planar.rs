//! Elasticity of beams in a planar scene: elements with three unknowns at each node.

use super::beam::SpatialBeams;
use super::element::{BeamLaw, ElasticElement};
use super::interpolation::Workspace;
use crate::effect::{ByOrder, ELEMENTS_PER_TASK, PlanarForm, at_slots, own_blocks};
use crate::kernel::law::{PlanarStress, StoredLaw, Stress};
use crate::kernel::planar::{PlanarNode, PlanarPoint, flattened, in_one_turn, in_space};
use crate::kernel::{PlanarSystem, Weights};
use crate::scalar::{Instructions, LANES, Lanes, Pack, Real, each_lane};
use crate::system::{Assembler, Memory, Plane, Slot, State};
use crate::tensor::Vec3;
use crate::threads;
use std::sync::Arc;

/// The planar form of [`BeamElasticity`](super::beam::BeamElasticity), with its elements side by
/// side in their order. Elements whose nodes have turned axes or different charts are added by the
/// effect in space.
pub struct PlanarElasticity {
    plane: Plane,
    spatial: Arc<dyn SpatialBeams>,
    blocks: ByOrder<ElementBlock<2, 1>, ElementBlock<3, 2>, ElementBlock<4, 3>>,
}

/// An integration point of elements side by side, in the plane.
type PlanarPoints<const N: usize> = <PlanarPoint<N, f64, <BeamLaw as StoredLaw>::InPlane> as Pack>::Packed;

/// Elements side by side.
struct ElementBlock<const N: usize, const G: usize> {
    /// Slots of displacements, by node
    u: [[Slot; LANES]; N],
    /// Slots of rotations, by node
    p: [[Slot; LANES]; N],
    points: [PlanarPoints<N>; G],
}

impl PlanarElasticity {
    /// The planar form of the elements of `spatial`, which lie in `plane`.
    pub(super) fn new(spatial: Arc<dyn SpatialBeams>, plane: Plane) -> Self {
        let elements = spatial.elements();
        let blocks = ByOrder {
            two: blocks(&elements.two, &plane),
            three: blocks(&elements.three, &plane),
            four: blocks(&elements.four, &plane),
        };
        Self { plane, spatial, blocks }
    }
}

fn blocks<const N: usize, const G: usize>(batch: &[ElasticElement<N, G>], plane: &Plane) -> Vec<ElementBlock<N, G>> {
    let block = |number: usize| {
        let elements = &batch[number * LANES..batch.len().min((number + 1) * LANES)];
        let all: [&ElasticElement<N, G>; LANES] = each_lane!(|k| &elements[k.min(elements.len() - 1)]);
        let point = |g: usize| {
            let points = all.map(|element| PlanarPoint::new(&element.points()[g], plane.axes()));
            PlanarPoint::pack(points.each_ref())
        };
        ElementBlock {
            u: std::array::from_fn(|i| all.map(|element| element.connection.nodes[i].u)),
            p: std::array::from_fn(|i| all.map(|element| element.connection.nodes[i].p)),
            points: std::array::from_fn(point),
        }
    };
    threads::list(batch.len().div_ceil(LANES), block)
}

impl<const N: usize, const G: usize> ElementBlock<N, G> {
    /// The components in the plane of a field, at the nodes.
    #[inline(always)]
    fn nodes(&self, field: &[Vec3], plane: &Plane) -> [PlanarNode<Lanes>; N] {
        let [a, b, e] = [0, 1, 2].map(|k| plane.axes().column(k));
        let along = |v: Vec3<Lanes>, axis: Vec3| v.0[0] * axis.0[0] + v.0[1] * axis.0[1] + v.0[2] * axis.0[2];
        let mut out = [PlanarNode { u: [Lanes::zero(); 2], angle: Lanes::zero() }; N];
        for i in 0..N {
            let u = at_slots(field, self.u[i]);
            let p = at_slots(field, self.p[i]);
            out[i] = PlanarNode { u: [along(u, a), along(u, b)], angle: along(p, e) };
        }
        out
    }
}

/// The amplitudes of free strains of elements side by side.
#[inline(always)]
fn free<const N: usize, const G: usize>(elements: &[ElasticElement<N, G>], at: &State) -> Lanes {
    Lanes(each_lane!(|k| elements[k.min(elements.len() - 1)].free_amplitude(at)))
}

/// The remembered stresses of point `g` of each element, which form the geometric parts of the
/// tangent.
#[inline(always)]
fn remembered<const G: usize>(memory: &[[f64; 6]], g: usize, plane: &Plane) -> PlanarStress<Lanes> {
    let last = memory.len() / G - 1;
    let of = each_lane!(|k| &memory[k.min(last) * G + g]);
    let mut stress = Stress { n: Vec3::zero(), m: Vec3::zero() };
    for c in 0..3 {
        stress.n.0[c] = Lanes(each_lane!(|k| of[k][c]));
        stress.m.0[c] = Lanes(each_lane!(|k| of[k][c + 3]));
    }
    flattened(&stress, plane.axes())
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn add_batch<const N: usize, const G: usize>(
    (spatial, plane): (&dyn SpatialBeams, &Plane),
    blocks: &[ElementBlock<N, G>],
    batch: &[ElasticElement<N, G>],
    first: usize,
    memory: &[[f64; 6]],
    at: &State,
    weights: Weights,
    out: &mut Assembler,
) {
    let stiffness = weights.stiffness;
    let mut alone = None;
    let mut system = PlanarSystem::zero();
    for number in own_blocks(first, batch.len(), out) {
        let block = &blocks[number];
        let start = number * LANES;
        let elements = &batch[start..batch.len().min(start + LANES)];
        let mut nodes = block.nodes(&at.q, plane);
        in_one_turn(&mut nodes);
        let free = free(elements, at);
        let own = memory.get(start * G..).filter(|own| !own.is_empty());
        system.clear_for(stiffness);
        for g in 0..G {
            let geometric = own.map(|own| remembered::<G>(own, g, plane));
            block.points[g].add(&nodes, free, geometric.as_ref(), stiffness, &mut system);
        }
        let is_mixed = |k: usize| at.mixed[elements[k].connection.element as usize] != 0;
        out.add_planar(plane, first + start, elements.len(), &system, is_mixed, |k, out| {
            let work = alone.get_or_insert_with(|| Workspace::new(N));
            let own = memory.get((start + k) * G..).unwrap_or_default();
            spatial.add_one(first + start + k, own, at, stiffness, work, out);
        });
    }
}

fn extrapolate_batch<const N: usize, const G: usize>(
    plane: &Plane,
    blocks: &[ElementBlock<N, G>],
    batch: &[ElasticElement<N, G>],
    at: &State,
    dq: &[Vec3],
    out: &mut [[f64; 6]],
) {
    let parts = blocks
        .chunks(ELEMENTS_PER_TASK / LANES)
        .zip(batch.chunks(ELEMENTS_PER_TASK))
        .zip(out.chunks_mut(ELEMENTS_PER_TASK * G));
    threads::each(parts, |((blocks, batch), out)| {
        Instructions::here().run(
            #[inline(always)]
            || extrapolate_blocks(plane, blocks, batch, at, dq, out),
        );
    });
}

#[inline(always)]
fn extrapolate_blocks<const N: usize, const G: usize>(
    plane: &Plane,
    blocks: &[ElementBlock<N, G>],
    batch: &[ElasticElement<N, G>],
    at: &State,
    dq: &[Vec3],
    out: &mut [[f64; 6]],
) {
    for (number, block) in blocks.iter().enumerate() {
        let start = number * LANES;
        let elements = &batch[start..batch.len().min(start + LANES)];
        let mut nodes = block.nodes(&at.q, plane);
        let change = block.nodes(dq, plane);
        in_one_turn(&mut nodes);
        for g in 0..G {
            let stress = block.points[g].extrapolated_stress(&nodes, free(elements, at), &change);
            let packed = in_space(stress, plane.axes()).components();
            for k in 0..elements.len() {
                out[(start + k) * G + g] = packed.map(|lanes| lanes.0[k]);
            }
        }
    }
}

impl PlanarForm for PlanarElasticity {
    fn is_symmetric(&self) -> bool {
        true
    }

    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Assembler) {
        let elements = self.spatial.elements();
        let blocks = &self.blocks;
        let two = elements.two.len();
        let three = elements.three.len();
        let known = |first: usize| {
            let points = elements.points_before(first);
            self.spatial.remembered(memory).get(points..).unwrap_or_default()
        };
        let spatial = (&*self.spatial, &self.plane);
        Instructions::here().run(
            #[inline(always)]
            || {
                add_batch::<2, 1>(spatial, &blocks.two, &elements.two, 0, known(0), at, weights, out);
                add_batch::<3, 2>(spatial, &blocks.three, &elements.three, two, known(two), at, weights, out);
                let first = two + three;
                add_batch::<4, 3>(spatial, &blocks.four, &elements.four, first, known(first), at, weights, out);
            },
        );
    }

    fn extrapolate(&self, at: &State, dq: &[Vec3], memory: &mut Memory) {
        let elements = self.spatial.elements();
        let blocks = &self.blocks;
        let plane = &self.plane;
        let (two, rest) = memory.points.split_at_mut(elements.two.len());
        let (three, four) = rest.split_at_mut(2 * elements.three.len());
        extrapolate_batch(plane, &blocks.two, &elements.two, at, dq, two);
        extrapolate_batch(plane, &blocks.three, &elements.three, at, dq, three);
        extrapolate_batch(plane, &blocks.four, &elements.four, at, dq, four);
        memory.valid = true;
    }
}
