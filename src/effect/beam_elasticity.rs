//! Elasticity of beams: the total Lagrangian element with interpolated rotation vectors (sections 3.2–3.4).

use super::{ByOrder, Connection, Effect, Energy, Noise, after_displacement, for_each_batch};
use crate::kernel::beam::StiffnessPoint;
use crate::kernel::elastic::{Strain, Stress};
use crate::kernel::seam::Converted;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Category, Cliques, Memory, Sink, State};
use crate::tensor::Vec3;

/// An element of N nodes with G = N - 1 points for internal forces.
#[derive(Clone, Debug)]
pub struct ElasticElement<const N: usize, const G: usize> {
    /// Its place in the scene
    pub connection: Connection<N>,
    /// Its integration points
    pub points: [StiffnessPoint<N>; G],
}

/// All beam elements with stiffness.
#[derive(Clone, Debug, Default)]
pub struct BeamElasticity {
    /// The elements
    pub elements: ByOrder<ElasticElement<2, 1>, ElasticElement<3, 2>, ElasticElement<4, 3>>,
}

impl Effect for BeamElasticity {
    fn name(&self) -> &'static str {
        "beam elasticity"
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn cliques(&self) -> Cliques {
        let mut cliques = Cliques::default();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            cliques.push(element.connection.slots());
        });
        cliques
    }

    fn memory_points(&self) -> usize {
        self.elements.two.len() + 2 * self.elements.three.len() + 3 * self.elements.four.len()
    }

    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Sink) {
        let remembered: &[[f64; 6]] = if memory.valid { &memory.points } else { &[] };
        let (two, three) = (self.elements.two.len(), 2 * self.elements.three.len());
        let mut parts = [0, two, two + three].map(|start| remembered.get(start..).unwrap_or_default()).into_iter();
        for_each_batch!(self.elements, |first, batch| {
            add_batch(batch, first, parts.next().unwrap_or_default(), at, weights, out);
        });
    }

    fn extrapolate(&self, at: &State, dq: &[Vec3], memory: &mut Memory) {
        let mut points = memory.points.iter_mut();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            element.extrapolate(at, dq, &mut points);
        });
        memory.valid = true;
    }

    fn energy(&self, at: &State) -> Energy {
        let mut strain = 0.0;
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            strain += element.energy(at);
        });
        Energy { kinetic: 0.0, strain }
    }

    fn noise(&self, at: &State) -> Noise {
        let mut largest = Noise::default();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            let noise = element.noise(at);
            largest.force = largest.force.max(noise.force);
            largest.moment = largest.moment.max(noise.moment);
        });
        largest
    }
}

/// Adds the elements of one order, `first` instances after the first one of the effect.
fn add_batch<const N: usize, const G: usize>(
    batch: &[ElasticElement<N, G>],
    first: usize,
    remembered: &[[f64; 6]],
    at: &State,
    weights: Weights,
    out: &mut Sink,
) {
    let mut system = ElementSystem::new(2 * N);
    for (k, element) in batch.iter().enumerate() {
        let stresses = remembered.get(k * G..(k + 1) * G);
        element.connection.evaluate(at, weights, false, after_displacement, &mut system, |nodes, weights, system| {
            for (g, point) in element.points.iter().enumerate() {
                let geometric = stresses.map(|s| unpack(&s[g]));
                point.add_elastic(nodes, geometric.as_ref(), weights.stiffness, system);
            }
        });
        out.add(first + k, &system);
    }
}

fn unpack(s: &[f64; 6]) -> Stress {
    Stress { n: Vec3([s[0], s[1], s[2]]), m: Vec3([s[3], s[4], s[5]]) }
}

impl<const N: usize, const G: usize> ElasticElement<N, G> {
    /// Strain and stress at each integration point (material, global components).
    pub fn strains_and_stresses(&self, at: &State) -> [(Strain, Stress); G] {
        let nodes = self.connection.motions_in_one_chart(at);
        self.points.map(|point| point.strain_and_stress(&nodes))
    }

    fn energy(&self, at: &State) -> f64 {
        let density = |(strain, stress): &(Strain, Stress)| strain.gamma.dot(stress.n) + strain.kappa.dot(stress.m);
        let values = self.strains_and_stresses(at);
        values.iter().zip(&self.points).map(|(value, point)| 0.5 * point.weight * density(value)).sum()
    }

    /// The stress that each point is expected to have after the correction `dq`.
    fn extrapolate<'a>(&self, at: &State, dq: &[Vec3], points: &mut impl Iterator<Item = &'a mut [f64; 6]>) {
        let converted = Converted::new(&self.connection.motions(at), at.mixed[self.connection.element as usize]);
        let nodes = std::array::from_fn(|i| converted.nodes[i]);
        let slots = self.connection.nodes;
        let du: [Vec3; N] = std::array::from_fn(|i| dq[slots[i].u as usize]);
        let dp: [Vec3; N] = std::array::from_fn(|i| converted.variation(i, dq[slots[i].p as usize]));
        for (point, remembered) in self.points.iter().zip(points) {
            let Stress { n, m } = point.extrapolated_stress(&nodes, |i| du[i], |i| dp[i]);
            *remembered = [n.0[0], n.0[1], n.0[2], m.0[0], m.0[1], m.0[2]];
        }
    }

    /// Displacements u and rotations P carry a relative error of one unit in the last place; strains divide it by the
    /// element's length, and stiff sections multiply it.
    fn noise(&self, at: &State) -> Noise {
        let u = self.connection.nodes.iter().map(|node| at.q[node.u as usize].max_abs()).fold(0.0, f64::max);
        let mut noise = Noise::default();
        for point in &self.points {
            let steepest = point.slope.iter().fold(0.0_f64, |s, d| s.max(d.abs()));
            let force = f64::EPSILON * point.stiffness.cn.max_abs() * (1.0 + u * steepest);
            let bending = f64::EPSILON * point.stiffness.cm.max_abs() * std::f64::consts::PI * steepest;
            noise.force = noise.force.max(force);
            noise.moment = noise.moment.max(bending + force * point.weight);
        }
        noise
    }
}
