//! Elasticity of beams (sections 3.2–3.4), in each of the ways to interpolate rotations.

use super::interpolation::{Interpolation, Scratch};
use super::{ByOrder, Connection, Effect, Energy, Noise, for_each_batch};
use crate::kernel::beam::StiffnessPoint;
use crate::kernel::elastic::{Strain, Stress};
use crate::kernel::{ElementSystem, NodeMotion, Weights};
use crate::system::{Category, Cliques, Memory, Sink, State};
use crate::tensor::Vec3;
use std::marker::PhantomData;

/// An element of N nodes with G = N - 1 points for internal forces.
#[derive(Clone, Debug)]
pub struct ElasticElement<const N: usize, const G: usize> {
    /// Its place in the scene
    pub connection: Connection<N>,
    /// Its integration points
    pub points: [StiffnessPoint<N>; G],
    /// The number of the amplitude of its free strain
    pub free: Option<usize>,
}

/// Elastic elements of all orders.
pub type ElasticElements = ByOrder<ElasticElement<2, 1>, ElasticElement<3, 2>, ElasticElement<4, 3>>;

/// All beam elements that interpolate in one way.
#[derive(Clone, Debug)]
pub struct BeamElasticity<I> {
    /// The elements
    pub elements: ElasticElements,
    way: PhantomData<I>,
}

impl<I> BeamElasticity<I> {
    /// Of these elements.
    pub fn new(elements: ElasticElements) -> Self {
        Self { elements, way: PhantomData }
    }
}

/// Strain and stress in beam elements, however they interpolate.
pub trait StressField: Send + Sync {
    /// Strain and stress (material, global components) at the integration points of an element; `None` where it is not
    /// one of these.
    fn at_points(&self, element: u32, at: &State) -> Option<Vec<(Strain, Stress)>>;
}

impl<I: Interpolation> StressField for BeamElasticity<I> {
    fn at_points(&self, element: u32, at: &State) -> Option<Vec<(Strain, Stress)>> {
        for_each_batch!(self.elements, |_first, batch| {
            // Batches are in the order of the scene.
            if let Ok(k) = batch.binary_search_by_key(&element, |e| e.connection.element) {
                return Some(batch[k].strains_and_stresses::<I>(at).to_vec());
            }
        });
        None
    }
}

impl<I: Interpolation> Effect for BeamElasticity<I> {
    fn name(&self) -> &'static str {
        I::NAME
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

    fn is_symmetric(&self) -> bool {
        true
    }

    fn memory_points(&self) -> usize {
        self.elements.two.len() + 2 * self.elements.three.len() + 3 * self.elements.four.len()
    }

    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Sink) {
        let remembered: &[[f64; 6]] = if memory.valid { &memory.points } else { &[] };
        let (two, three) = (self.elements.two.len(), 2 * self.elements.three.len());
        let mut parts = [0, two, two + three].map(|start| remembered.get(start..).unwrap_or_default()).into_iter();
        for_each_batch!(self.elements, |first, batch| {
            add_batch::<I, _, _>(batch, first, parts.next().unwrap_or_default(), at, weights, out);
        });
    }

    fn extrapolate(&self, at: &State, dq: &[Vec3], memory: &mut Memory) {
        let mut points = memory.points.iter_mut();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            element.extrapolate::<I>(at, dq, &mut points);
        });
        memory.valid = true;
    }

    fn energy(&self, at: &State) -> Energy {
        let mut strain = 0.0;
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            strain += element.energy::<I>(at);
        });
        Energy { kinetic: 0.0, strain }
    }

    fn strain_of(&self, at: &State, field: &[Vec3], length: f64) -> f64 {
        let mut largest = 0.0_f64;
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            largest = largest.max(element.strain_of::<I>(at, field, length));
        });
        largest
    }

    fn drives(&self, at: &State, show: &mut dyn FnMut(f64, f64)) {
        for_each_batch!(self.elements, |_first, batch| for element in batch.iter().filter(|e| e.free.is_some()) {
            let pull: f64 = element
                .points
                .iter()
                .zip(&element.strains_and_stresses::<I>(at))
                .map(|(point, (_, stress))| {
                    let free = point.free.unwrap_or(Strain { gamma: Vec3::ZERO, kappa: Vec3::ZERO });
                    -point.weight * (free.gamma.dot(stress.n) + free.kappa.dot(stress.m))
                })
                .sum();
            show(element.free_amplitude(at), pull);
        });
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
fn add_batch<I: Interpolation, const N: usize, const G: usize>(
    batch: &[ElasticElement<N, G>],
    first: usize,
    remembered: &[[f64; 6]],
    at: &State,
    weights: Weights,
    out: &mut Sink,
) {
    let (mut system, mut scratch) = (ElementSystem::new(2 * N), Scratch::new(N));
    for (k, element) in batch.iter().enumerate() {
        let free = element.free_amplitude(at);
        let stresses = remembered.get(k * G..(k + 1) * G);
        let kernel = |nodes: &[NodeMotion; N], stiffness: f64, out: &mut ElementSystem| {
            for (g, point) in element.points.iter().enumerate() {
                let geometric = stresses.map(|s| unpack(&s[g]));
                point.add_elastic(nodes, free, geometric.as_ref(), stiffness, out);
            }
        };
        let geometric = stresses.map(|stresses| {
            move |nodes: &[NodeMotion; N], out: &mut ElementSystem| {
                for (point, stress) in element.points.iter().zip(stresses) {
                    point.add_force(&point.configuration(nodes), &unpack(stress), out);
                }
            }
        });
        I::evaluate(&element.connection, at, weights.stiffness, &mut scratch, &mut system, kernel, geometric);
        out.add(first + k, &system);
    }
}

fn unpack(s: &[f64; 6]) -> Stress {
    Stress { n: Vec3([s[0], s[1], s[2]]), m: Vec3([s[3], s[4], s[5]]) }
}

impl<const N: usize, const G: usize> ElasticElement<N, G> {
    fn free_amplitude(&self, at: &State) -> f64 {
        self.free.map_or(0.0, |number| at.amplitude[number])
    }

    /// Strain and stress at each integration point (material, global components).
    pub fn strains_and_stresses<I: Interpolation>(&self, at: &State) -> [(Strain, Stress); G] {
        let (nodes, free) = (I::nodes(&self.connection, at), self.free_amplitude(at));
        self.points.map(|point| point.strain_and_stress(&nodes, free))
    }

    fn energy<I: Interpolation>(&self, at: &State) -> f64 {
        let free = self.free_amplitude(at);
        let density = |(point, (strain, stress)): (&StiffnessPoint<N>, &(Strain, Stress))| {
            let elastic = point.elastic_part(strain, free);
            0.5 * point.weight * (elastic.gamma.dot(stress.n) + elastic.kappa.dot(stress.m))
        };
        self.points.iter().zip(&self.strains_and_stresses::<I>(at)).map(density).sum()
    }

    /// The largest |dGamma| or |dK| length that increments of the unknowns make.
    fn strain_of<I: Interpolation>(&self, at: &State, field: &[Vec3], length: f64) -> f64 {
        let (nodes, change) = (I::nodes(&self.connection, at), I::variation(&self.connection, at, field));
        let at_point = |point: &StiffnessPoint<N>| {
            let strain = point.strain_variation(&point.configuration(&nodes), |i| change[i].0, |i| change[i].1);
            strain.gamma.norm().max(strain.kappa.norm() * length)
        };
        self.points.iter().map(at_point).fold(0.0, f64::max)
    }

    /// The stress that each point is expected to have after the correction `dq`.
    fn extrapolate<'a, I: Interpolation>(
        &self,
        at: &State,
        dq: &[Vec3],
        points: &mut impl Iterator<Item = &'a mut [f64; 6]>,
    ) {
        let (nodes, free) = (I::nodes(&self.connection, at), self.free_amplitude(at));
        let change = I::variation(&self.connection, at, dq);
        for (point, remembered) in self.points.iter().zip(points) {
            let Stress { n, m } = point.extrapolated_stress(&nodes, free, |i| change[i].0, |i| change[i].1);
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
