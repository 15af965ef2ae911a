//! Elasticity of beams (Makinen 2007, sections 3.2–3.4), for each interpolation of rotations.

use super::element::{ElasticElement, ElasticPoint};
use super::element_stresses::ElementStresses;
use super::interpolation::{
    ElementConfiguration, HalfWayPoint, Interpolation, PointSum, Scratch, View, Workspace, is_half_way,
};
use super::planar::PlanarElasticity;
use crate::effect::{
    Bending, ByOrder, DrivenCoordinates, ELEMENTS_PER_TASK, Effect, Energy, PlanarForm, Roles, RoundOff, StressPoints,
    TangentForm, at_slots, for_each_batch, side_by_side,
};
use crate::kernel::law::{SectionLaw, StoredLaw, Strain, Stress};
use crate::kernel::{ElementSystem, MAX_NODES, NodePlace, Weights};
use crate::scalar::{Instructions, LANES, Lanes, Pack, Real, each_lane};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Plane, Slot, State};
use crate::tensor::Vec3;
use crate::threads;
use std::marker::PhantomData;
use std::sync::Arc;

/// Elastic elements of all orders.
pub type ElasticElements = ByOrder<ElasticElement<2, 1>, ElasticElement<3, 2>, ElasticElement<4, 3>>;

/// The elasticity of all beam elements with the interpolation `I`.
#[derive(Clone, Debug)]
pub struct BeamElasticity<I> {
    /// The elements
    pub(crate) elements: ElasticElements,
    /// Zero stresses at all points, which form the geometric part of the tangent if it is left out
    unstressed: Option<Vec<[f64; 6]>>,
    way: PhantomData<I>,
}

impl<I: Interpolation> BeamElasticity<I> {
    /// The elasticity of `elements`, with the geometric stiffness in the tangent.
    pub fn new(elements: ElasticElements) -> Self {
        Self { elements, unstressed: None, way: PhantomData }
    }

    /// Leaves the geometric stiffness, that of stresses, out of the tangent.
    pub fn without_geometric_stiffness(mut self) -> Self {
        self.unstressed = Some(vec![[0.0; 6]; self.memory_points()]);
        self
    }

    /// The number of integration points of the elements before number `element`.
    fn points_before(&self, element: usize) -> usize {
        self.elements.points_before(element)
    }

    /// The stresses that form the geometric parts of the tangent, by point; empty if these are the
    /// present stresses.
    fn remembered<'a>(&'a self, memory: &'a Memory) -> &'a [[f64; 6]] {
        match &self.unstressed {
            Some(none) => none,
            None if memory.valid => &memory.points,
            None => &[],
        }
    }
}

impl ElasticElements {
    /// The number of integration points of the elements before number `element`.
    pub(super) fn points_before(&self, element: usize) -> usize {
        let two = self.two.len();
        let three = self.three.len();
        element + element.saturating_sub(two) + element.saturating_sub(two + three)
    }
}

/// Elastic beams in space as their planar form asks for them: of any interpolation, since in the
/// plane interpolations do not differ.
pub(super) trait SpatialBeams: Send + Sync {
    /// The elements.
    fn elements(&self) -> &ElasticElements;

    /// The stresses that form the geometric parts of the tangent, by point; empty if these are the
    /// present stresses.
    fn remembered<'a>(&'a self, memory: &'a Memory) -> &'a [[f64; 6]];

    /// Adds one element, instance `number`, in space. `remembered` holds the stresses of geometric
    /// parts at its points, or is empty; `work` is scratch memory for elements of its order.
    fn add_one(
        &self,
        number: usize,
        remembered: &[[f64; 6]],
        at: &State,
        stiffness: f64,
        work: &mut Workspace,
        out: &mut Assembler,
    );
}

impl<I: Interpolation> SpatialBeams for BeamElasticity<I> {
    fn elements(&self) -> &ElasticElements {
        &self.elements
    }

    fn remembered<'a>(&'a self, memory: &'a Memory) -> &'a [[f64; 6]] {
        self.remembered(memory)
    }

    fn add_one(
        &self,
        number: usize,
        remembered: &[[f64; 6]],
        at: &State,
        stiffness: f64,
        work: &mut Workspace,
        out: &mut Assembler,
    ) {
        for_each_batch!(self.elements, number..number + 1, |_first, batch| for element in batch {
            element.add::<I>(number, stresses_of(remembered, 0), at, stiffness, work, out);
        });
    }
}

/// Strains and stresses in beam elements of any interpolation.
pub trait StressField: Send + Sync {
    /// Strains and stresses of an element of the scene; `None` if it belongs to another effect.
    /// `origin` is the state about which the stage is linear; `None` in other stages.
    fn stresses(&self, element: u32, at: &State, origin: Option<&State>) -> Option<ElementStresses>;
}

impl<I: Interpolation> StressField for BeamElasticity<I> {
    fn stresses(&self, element: u32, at: &State, origin: Option<&State>) -> Option<ElementStresses> {
        for_each_batch!(self.elements, |_first, batch| {
            if let Some(k) = find(batch, element) {
                return Some(batch[k].stresses::<I>(at, origin));
            }
        });
        None
    }
}

/// The place of an element of the scene in a batch, which is in the order of the scene.
pub(super) fn find<const N: usize, const G: usize>(batch: &[ElasticElement<N, G>], element: u32) -> Option<usize> {
    batch.binary_search_by_key(&element, |e| e.connection.element).ok()
}

impl<I: Interpolation> Effect for BeamElasticity<I> {
    fn name(&self) -> &'static str {
        I::NAME
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::divisible();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            connectivity.push(element.connection.slots());
        });
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::Symmetric
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        // The mesh shows the places of elements.
        for_each_batch!(self.elements, |_first, batch| for alike in batch.chunk_by(ElasticElement::is_like) {
            for point in alike[0].points() {
                show(MirrorData::Vector(point.tangent));
                point.law.show_directions(&mut |stiffness| {
                    show(MirrorData::Tensor(stiffness.cn));
                    show(MirrorData::Tensor(stiffness.cm));
                    if let Some(cc) = stiffness.cc {
                        show(MirrorData::Coupling(cc));
                    }
                });
                if let Some(free) = point.free {
                    show(MirrorData::Vector(free.gamma));
                    show(MirrorData::Axial(free.kappa));
                }
            }
        });
    }

    fn in_plane(self: Arc<Self>, plane: &Plane) -> Option<Box<dyn PlanarForm>> {
        Some(Box::new(PlanarElasticity::new(self, *plane)))
    }

    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Assembler) {
        let remembered = self.remembered(memory);
        for_each_batch!(self.elements, out.instances(), |first, batch| {
            let part = remembered.get(self.points_before(first)..).unwrap_or_default();
            let done = Instructions::here().run_side_by_side(
                #[inline(always)]
                || add_batch::<I, _, _>(batch, first, part, at, weights, out),
            );
            if done.is_none() {
                let mut work = workspace(batch);
                let each = batch.iter().enumerate();
                each.for_each(|(k, element)| {
                    element.add::<I>(first + k, stresses_of(part, k), at, weights.stiffness, &mut work, out);
                });
            }
        });
    }

    fn energy(&self, at: &State) -> Energy {
        let mut strain = 0.0;
        for_each_batch!(self.elements, |_first, batch| {
            threads::in_order(
                batch.chunks(ELEMENTS_PER_TASK),
                |batch| energy_of::<I, _, _>(batch, at),
                |own| strain += own,
            );
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

    fn roles(&self) -> Roles<'_> {
        Roles { stresses: Some(self), driven: Some(self), ..Roles::NONE }
    }
}

impl<I: Interpolation> StressPoints for BeamElasticity<I> {
    fn memory_points(&self) -> usize {
        let ByOrder { two, three, four } = &self.elements;
        self.points_before(two.len() + three.len() + four.len())
    }

    fn extrapolate(&self, at: &State, dq: &[Vec3], memory: &mut Memory) {
        for_each_batch!(self.elements, |first, batch| {
            let own = &mut memory.points[self.points_before(first)..self.points_before(first + batch.len())];
            extrapolate_batch::<I, _, _>(batch, at, dq, own);
        });
        memory.valid = true;
    }

    fn stiffness_along(&self, at: &State, field: &[Vec3]) -> Option<f64> {
        let mut sum = 0.0;
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            sum += element.stiffness_along::<I>(at, field)?;
        });
        Some(sum)
    }

    fn round_off(&self, at: &State) -> RoundOff {
        let mut largest = RoundOff::default();
        for_each_batch!(self.elements, |_first, batch| {
            threads::in_order(
                batch.chunks(ELEMENTS_PER_TASK),
                |part| round_off_of(part, at),
                |round_off| largest = largest.or(round_off),
            );
        });
        largest
    }

    fn each_bending(&self, at: &State, origin: Option<&State>, show: &mut dyn FnMut(Bending)) {
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            element.each_bending::<I>(at, origin, show);
        });
    }
}

impl<I: Interpolation> DrivenCoordinates for BeamElasticity<I> {
    fn act_at_once(&self) -> bool {
        true
    }

    fn drives(&self, at: &State, origin: Option<&State>, show: &mut dyn FnMut(f64, f64)) {
        for_each_batch!(self.elements, |_first, batch| for element in batch.iter().filter(|e| e.free().is_some()) {
            let pull: f64 = element
                .points()
                .iter()
                .zip(&element.strains_and_stresses::<I>(at, origin))
                .map(|(point, (_, stress))| {
                    let free = point.free.unwrap_or_default();
                    -point.weight * (free.gamma.dot(stress.n) + free.kappa.dot(stress.m))
                })
                .sum();
            show(element.free_amplitude(at), pull);
        });
    }
}

/// The translational strain, without unit, up to which an element counts as unstressed: in a beam
/// with EA = 1e8 EI/L^2 it changes the stiffness against bending by 1e-7 of itself.
const MAX_UNSTRESSED_STRAIN: f64 = 1e-14;

/// The bend or twist, in radians over an element, up to which it counts as unstressed: over 10,000
/// elements it adds up to 1e-8.
const MAX_UNSTRESSED_BEND: f64 = 1e-12;

/// The largest round-off of the forces of the elements of a batch.
fn round_off_of<const N: usize, const G: usize>(batch: &[ElasticElement<N, G>], at: &State) -> RoundOff {
    let mut largest = RoundOff::default();
    for element in batch {
        let nodes = element.connection.nodes.iter();
        let u = nodes.map(|node| at.q[node.u as usize].max_abs()).fold(0.0, f64::max);
        element.each_round_off(u, |round_off| largest = largest.or(round_off));
    }
    largest
}

/// Adds a batch of elements in lanes; `first` is the number of its first instance, and `remembered`
/// holds the stresses of geometric parts by point, or is empty.
#[inline(always)]
fn add_batch<I: Interpolation, const N: usize, const G: usize>(
    batch: &[ElasticElement<N, G>],
    first: usize,
    remembered: &[[f64; 6]],
    at: &State,
    weights: Weights,
    out: &mut Assembler,
) {
    let stiffness = weights.stiffness;
    let mut systems = out.lend(2 * N, stiffness != 0.0);
    let mut scratch = Scratch::lent(N, I::CARRIES_BACK && !is_half_way(N, G), out);
    let mut alone = None;
    for start in (0..batch.len()).step_by(LANES) {
        let elements = side_by_side(batch, start);
        let sum = ElasticSum::side_by_side(elements, remembered.get(start * G..).unwrap_or_default(), at);
        let configuration = ElementConfiguration::side_by_side(each_lane!(|k| elements[k].member()), at);
        I::View::new(&configuration).fill(&sum, stiffness, &mut scratch, &mut systems);
        let count = LANES.min(batch.len() - start);
        let is_mixed = |k: usize| at.mixed[elements[k].connection.element as usize] != 0;
        out.add_lanes(first + start, count, &systems, is_mixed, |k, out| {
            let work = alone.get_or_insert_with(|| workspace(batch));
            elements[k].add::<I>(first + start + k, stresses_of(remembered, start + k), at, stiffness, work, out);
        });
    }
    out.take_back(systems);
    scratch.give_back(out);
}

/// Memory for the computation of single elements of a batch.
fn workspace<const N: usize, const G: usize>(_batch: &[ElasticElement<N, G>]) -> Workspace {
    Workspace::new(N)
}

/// The remembered stresses of the points of element k; `None` if there are none.
fn stresses_of<const G: usize>(remembered: &[[f64; 6]], k: usize) -> Option<[Stress; G]> {
    let own = remembered.get(k * G..(k + 1) * G)?;
    Some(std::array::from_fn(|g| unpack(&own[g])))
}

/// The sum over the points of an element, or of several side by side.
struct ElasticSum<const N: usize, const G: usize, T> {
    points: [ElasticPoint<N, T>; G],
    /// The stresses that form the geometric parts; `None` for the present ones
    stresses: Option<[Stress<T>; G]>,
    /// The amplitude of the free strain
    free: T,
}

impl<const N: usize, const G: usize> ElasticSum<N, G, Lanes> {
    #[inline(always)]
    fn side_by_side(elements: [&ElasticElement<N, G>; LANES], remembered: &[[f64; 6]], at: &State) -> Self {
        let points = ElasticElement::points_side_by_side(elements);
        let free = Lanes(each_lane!(|k| elements[k].free_amplitude(at)));
        let none = Stress { n: Vec3::zero(), m: Vec3::zero() };
        let mut stresses = (!remembered.is_empty()).then_some([none; G]);
        if let Some(stresses) = &mut stresses {
            for g in 0..G {
                let stress = |k: usize| &remembered[(k * G + g).min(remembered.len() - 1)];
                stresses[g] = unpack(&Pack::pack(each_lane!(|k| stress(k))));
            }
        }
        Self { points, stresses, free }
    }
}

impl<const N: usize, const G: usize, T: Real> PointSum<N, T> for ElasticSum<N, G, T> {
    #[inline(always)]
    fn add(&self, nodes: &[NodePlace<T>; N], stiffness: f64, out: &mut ElementSystem<T>) {
        for g in 0..G {
            let geometric = self.stresses.as_ref().map(|stresses| &stresses[g]);
            self.points[g].add_elastic(nodes, self.free, geometric, stiffness, out);
        }
    }

    #[inline(always)]
    fn add_geometric(&self, nodes: &[NodePlace<T>; N], out: &mut ElementSystem<T>) -> bool {
        let Some(stresses) = &self.stresses else { return false };
        for g in 0..G {
            let point = &self.points[g];
            point.add_force(&point.configuration(nodes), &stresses[g], out);
        }
        true
    }

    #[inline(always)]
    fn half_way(&self) -> Option<HalfWayPoint<'_, N, T>> {
        let geometric = self.stresses.as_ref().map(|stresses| &stresses[0]);
        is_half_way(N, G).then(|| HalfWayPoint { point: &self.points[0], free: self.free, geometric })
    }
}

#[inline(always)]
fn unpack<T: Real>(s: &[T; 6]) -> Stress<T> {
    Stress { n: Vec3([s[0], s[1], s[2]]), m: Vec3([s[3], s[4], s[5]]) }
}

/// Writes the stresses at the points of a batch, extrapolated over the correction `dq`.
fn extrapolate_batch<I: Interpolation, const N: usize, const G: usize>(
    batch: &[ElasticElement<N, G>],
    at: &State,
    dq: &[Vec3],
    out: &mut [[f64; 6]],
) {
    threads::each(batch.chunks(ELEMENTS_PER_TASK).zip(out.chunks_mut(ELEMENTS_PER_TASK * G)), |(batch, out)| {
        let done = Instructions::here().run_side_by_side(
            #[inline(always)]
            || extrapolate_side_by_side::<I, _, _>(batch, at, dq, out),
        );
        if done.is_none() {
            let each = batch.iter().zip(out.as_chunks_mut::<G>().0);
            each.for_each(|(element, stresses)| element.extrapolate::<I>(at, dq, stresses));
        }
    });
}

#[inline(always)]
fn extrapolate_side_by_side<I: Interpolation, const N: usize, const G: usize>(
    batch: &[ElasticElement<N, G>],
    at: &State,
    dq: &[Vec3],
    out: &mut [[f64; 6]],
) {
    for start in (0..batch.len()).step_by(LANES) {
        let elements = side_by_side(batch, start);
        let sum = ElasticSum::side_by_side(elements, &[], at);
        let view = I::View::new(&ElementConfiguration::side_by_side(each_lane!(|k| elements[k].member()), at));
        let du: [_; N] = std::array::from_fn(|i| at_slots(dq, each_lane!(|k| elements[k].connection.nodes[i].u)));
        let dp: [_; N] = std::array::from_fn(|i| at_slots(dq, each_lane!(|k| elements[k].connection.nodes[i].p)));
        let stresses = view.extrapolated(&sum.points, sum.free, &du, &dp);
        for g in 0..G {
            let stress = stresses[g].components();
            for k in 0..LANES.min(batch.len() - start) {
                out[(start + k) * G + g] = stress.map(|lanes| lanes.0[k]);
            }
        }
        for (k, element) in elements.iter().enumerate().take(batch.len() - start) {
            if at.mixed[element.connection.element as usize] != 0 {
                element.extrapolate::<I>(at, dq, &mut out[(start + k) * G..]);
            }
        }
    }
}

/// The strain energy of the elements of a batch.
fn energy_of<I: Interpolation, const N: usize, const G: usize>(batch: &[ElasticElement<N, G>], at: &State) -> f64 {
    let mut sum = 0.0;
    let mut add = |energy: f64| sum += energy;
    // Energies are asked for once a step: lanes would be 130 kB for elements of four nodes.
    let mut done = None;
    if N < MAX_NODES {
        done = Instructions::here().run_side_by_side(
            #[inline(always)]
            || each_energy::<I, _, _>(batch, at, &mut add),
        );
    }
    if done.is_none() {
        batch.iter().for_each(|element| add(element.energy::<I>(at)));
    }
    sum
}

/// Calls `show` with the strain energy of each element of a batch, in their order.
#[inline(always)]
fn each_energy<I: Interpolation, const N: usize, const G: usize>(
    batch: &[ElasticElement<N, G>],
    at: &State,
    show: &mut dyn FnMut(f64),
) {
    for start in (0..batch.len()).step_by(LANES) {
        let elements = side_by_side(batch, start);
        let sum = ElasticSum::side_by_side(elements, &[], at);
        let view = I::View::new(&ElementConfiguration::side_by_side(each_lane!(|k| elements[k].member()), at));
        let energies = strain_energy(&sum.points, view.nodes(), sum.free);
        for (k, element) in elements.iter().enumerate().take(batch.len() - start) {
            let mixed = at.mixed[element.connection.element as usize] != 0;
            show(if mixed { element.energy::<I>(at) } else { energies.0[k] });
        }
    }
}

/// The strain energy of an element, from its points and the nodes in the frame of its kernel.
#[inline(always)]
fn strain_energy<const N: usize, const G: usize, T: Real>(
    points: &[ElasticPoint<N, T>; G],
    nodes: &[NodePlace<T>; N],
    free: T,
) -> T {
    let mut sum = T::zero();
    for point in points {
        sum += point.energy(nodes, free);
    }
    sum
}

impl<const N: usize, const G: usize> ElasticElement<N, G> {
    pub(super) fn free_amplitude(&self, at: &State) -> f64 {
        self.free().map_or(0.0, |number| at.amplitude[number])
    }

    /// Strain and stress at each integration point (material, global components). `origin` is the
    /// state about which the stage is linear; `None` in other stages.
    pub fn strains_and_stresses<I: Interpolation>(&self, at: &State, origin: Option<&State>) -> [(Strain, Stress); G] {
        match origin {
            None => {
                let view = I::see(self.member(), at);
                let free = self.free_amplitude(at);
                self.points().map(|point| point.strain_and_stress(view.nodes(), free))
            }
            Some(origin) => self.linear_strains_and_stresses::<I>(at, origin),
        }
    }

    /// Strain and stress at each integration point by the linear theory about `origin`: those of
    /// the origin, under the present free strain, and their first derivatives along the
    /// displacements and rotation vectors from there.
    fn linear_strains_and_stresses<I: Interpolation>(&self, at: &State, origin: &State) -> [(Strain, Stress); G] {
        let view = I::see(self.member(), origin);
        let displaced = |slot: Slot| at.q[slot as usize] - origin.q[slot as usize];
        let change = I::variation(self.member(), origin, &displaced);
        let [free, free_at_origin] = [at, origin].map(|state| self.free_amplitude(state));
        self.points().map(|point| {
            let nodes = view.nodes();
            let change = point.strain_variation(&point.configuration(nodes), |i| change[i].0, |i| change[i].1);
            let (strain, stress) = point.strain_and_stress(nodes, free);
            // The stiffness of the stage is that of the loads and free strains of its start.
            let added = point.law.tangent(&point.elastic_part(&strain, free_at_origin)).stress(&change);
            (strain + change, stress + added)
        })
    }

    /// Shows the bending at each point.
    fn each_bending<I: Interpolation>(&self, at: &State, origin: Option<&State>, show: &mut dyn FnMut(Bending)) {
        let nodes = &self.connection.nodes;
        let ends = [nodes[0], nodes[N - 1]];
        for (point, (_, stress)) in self.points().iter().zip(self.strains_and_stresses::<I>(at, origin)) {
            show(Bending {
                element: self.connection.element,
                ends,
                length: point.weight,
                moment: stress.m,
                tangent: point.tangent,
                stiffness: point.law.stiffness_at_rest().cm,
                tension: stress.n.dot(point.tangent),
            });
        }
    }

    #[inline(never)]
    fn energy<I: Interpolation>(&self, at: &State) -> f64 {
        strain_energy(&self.points(), I::see(self.member(), at).nodes(), self.free_amplitude(at))
    }

    /// The largest |dGamma| or |dK| length at the points, for a field of increments of the
    /// unknowns.
    fn strain_of<I: Interpolation>(&self, at: &State, field: &[Vec3], length: f64) -> f64 {
        let view = I::see(self.member(), at);
        let change = I::variation(self.member(), at, &|slot| field[slot as usize]);
        let at_point = |point: &ElasticPoint<N>| {
            let strain = point.strain_variation(&point.configuration(view.nodes()), |i| change[i].0, |i| change[i].1);
            strain.gamma.norm().max(strain.kappa.norm() * length)
        };
        self.points().iter().map(at_point).fold(0.0, f64::max)
    }

    /// The quadratic form of the stiffness, the sum of dS.dE over the points for the strains and
    /// stresses of a field of increments; `None` if the element is stressed.
    fn stiffness_along<I: Interpolation>(&self, at: &State, field: &[Vec3]) -> Option<f64> {
        let view = I::see(self.member(), at);
        let change = I::variation(self.member(), at, &|slot| field[slot as usize]);
        let free = self.free_amplitude(at);
        let length = self.points().iter().map(|point| point.weight).sum::<f64>();
        let at_point = |point: &ElasticPoint<N>| {
            let elastic = point.elastic_strain(view.nodes(), free);
            if elastic.gamma.norm() > MAX_UNSTRESSED_STRAIN || elastic.kappa.norm() * length > MAX_UNSTRESSED_BEND {
                return None;
            }
            let strain = point.strain_variation(&point.configuration(view.nodes()), |i| change[i].0, |i| change[i].1);
            let stress = point.law.stiffness_at_rest().stress(&strain);
            Some(point.weight * (stress.n.dot(strain.gamma) + stress.m.dot(strain.kappa)))
        };
        self.points().iter().map(at_point).sum()
    }

    /// Adds this element alone as instance `number`; its nodes may have rotation vectors in
    /// different charts.
    #[inline(never)]
    fn add<I: Interpolation>(
        &self,
        number: usize,
        stresses: Option<[Stress; G]>,
        at: &State,
        stiffness: f64,
        Workspace { system, scratch }: &mut Workspace,
        out: &mut Assembler,
    ) {
        let sum = ElasticSum { points: self.points(), stresses, free: self.free_amplitude(at) };
        I::evaluate(self.member(), at, stiffness, scratch, system, &sum);
        out.add(number, system);
    }

    /// Writes the stress at each point, extrapolated over the correction `dq`.
    #[inline(never)]
    fn extrapolate<I: Interpolation>(&self, at: &State, dq: &[Vec3], out: &mut [[f64; 6]]) {
        let view = I::see(self.member(), at);
        let free = self.free_amplitude(at);
        let (du, dp) = self.connection.variations_in_one_chart(at, |slot| dq[slot as usize]);
        let stresses = view.extrapolated(&self.points(), free, &du, &dp);
        out.iter_mut().zip(&stresses).for_each(|(remembered, stress)| *remembered = stress.components());
    }
}
