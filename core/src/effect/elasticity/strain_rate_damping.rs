//! The stiffness part of Rayleigh damping: material stresses beta C d(Gamma, K)/dt, so that rigid
//! motions are not damped. C is the stiffness of the section at rest, and beta a time. In the place
//! of beta C a point may have a viscosity of its own.
//!
//! With b_k = w dE_k/dq for each strain component E_k of a point of weight w, and G_k = db_k/dq:
//!
//! ```text
//! dE_k/dt = b_k . qd / w,   s = beta C dE/dt,   f = sum b_k s_k
//! df/dqd = sum b_k (beta C / w)_kl b_l,   df/dq = sum s_k G_k + sum b_k (beta C / w)_kl (G_l qd)
//! ```
//!
//! f and sum s_k G_k are force and geometric tangent of the elastic element under the stress s, for
//! any interpolation. b_k is its force under a unit stress, and G_k qd the rate of that force: a
//! number with its rate along the motion gives both.

use super::beam::{BeamElasticity, StressField, find};
use super::element::{ElasticElement, ElasticPoint, ElementNodes};
use super::element_stresses::ElementStresses;
use super::interpolation::{ElementConfiguration, Interpolation, PointSum, View, Workspace};
use crate::effect::{Effect, Roles, TangentForm, after_displacement, for_each_batch};
use crate::kernel::elastic::Point;
use crate::kernel::law::{SectionLaw, Stiffness, Strain, Stress};
use crate::kernel::{ElementSystem, NodeMotion, NodePlace, Weights};
use crate::scalar::Rate;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, RotationRate, State};
use crate::tensor::{Mat3, Vec3};
use std::cell::RefCell;
use std::sync::Arc;

/// Strain-rate damping of all beams with the interpolation `I`.
pub struct StrainRateDamping<I> {
    /// The beams
    pub(super) elasticity: Arc<BeamElasticity<I>>,
    /// Stress per strain rate
    pub(super) viscosity: Viscosity,
}

/// The damping stresses of points over their strain rates.
#[derive(Clone, Debug)]
pub enum Viscosity {
    /// beta times the stiffness of the section at rest; beta is a time
    Proportional(f64),
    /// Stiffness times time, in global components, for each point of each element: of those with
    /// two nodes, with three, and with four
    Points([Vec<Stiffness>; 3]),
}

impl Viscosity {
    /// The viscosities of the points of an element, where they are given; `number` counts elements
    /// with as many nodes.
    fn points<const G: usize>(&self, number: usize) -> Option<&[Stiffness; G]> {
        match self {
            Self::Proportional(_) => None,
            Self::Points(all) => all[G - 1][G * number..].first_chunk(),
        }
    }

    /// The damping of an element of the instance `number`; `starts` are the first instances of each
    /// order.
    fn of_element<const G: usize>(&self, number: usize, starts: &[usize; 3]) -> PointDamping<'_, G> {
        PointDamping { factor: self.factor(), own: self.points::<G>(number - starts[G - 1]) }
    }

    /// The factor of the stiffness of a point, in units of time.
    fn factor(&self) -> f64 {
        match self {
            Self::Proportional(factor) => *factor,
            Self::Points(_) => 1.0,
        }
    }

    fn each(&self, show: &mut dyn FnMut(&Stiffness)) {
        match self {
            Self::Proportional(_) => {}
            Self::Points(all) => all.iter().flatten().for_each(show),
        }
    }
}

impl<I: Interpolation> Effect for StrainRateDamping<I> {
    fn name(&self) -> &'static str {
        I::DAMPING_NAME
    }

    fn category(&self) -> Category {
        Category::Damping
    }

    fn connectivity(&self) -> Connectivity {
        self.elasticity.connectivity()
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::General
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        // The elasticity shows the data of its beams itself.
        self.viscosity.each(&mut |stiffness| {
            show(MirrorData::Tensor(stiffness.cn));
            show(MirrorData::Tensor(stiffness.cm));
            if let Some(cc) = stiffness.cc {
                show(MirrorData::Coupling(cc));
            }
        });
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let starts = self.starts();
        for_each_batch!(self.elasticity.elements, out.instances(), |first, batch| {
            add_batch::<I, _, _>(batch, first, (&self.viscosity, &starts), at, weights, out);
        });
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}

impl<I: Interpolation> StressField for StrainRateDamping<I> {
    fn stresses(&self, element: u32, at: &State, origin: Option<&State>) -> Option<ElementStresses> {
        let starts = self.starts();
        for_each_batch!(self.elasticity.elements, |first, batch| {
            if let Some(k) = find(batch, element) {
                let mut stresses = batch[k].stresses::<I>(at, origin);
                // Damping in proportion to the stiffness leaves elastic stresses in balance while
                // curvatures change little within the time beta.
                if let Viscosity::Points(_) = self.viscosity {
                    let damping = self.viscosity.of_element(first + k, &starts);
                    stresses
                        .add_damping(&damping_stresses::<I, _, _>(&batch[k], damping, at, origin), origin.is_some());
                }
                return Some(stresses);
            }
        });
        None
    }
}

/// The damping stress at each point of an element. `origin` is the state about which the stage is
/// linear; `None` in other stages.
fn damping_stresses<I: Interpolation, const N: usize, const G: usize>(
    element: &ElasticElement<N, G>,
    damping: PointDamping<G>,
    at: &State,
    origin: Option<&State>,
) -> [Stress; G] {
    let member = element.member();
    let moving = member.connection.motions_in_one_chart(at);
    let mut nodes = member.connection.motions_in_one_chart(origin.unwrap_or(at));
    for (node, motion) in nodes.iter_mut().zip(&moving) {
        node.u_rate = motion.u_rate;
        node.p_rate = motion.p_rate;
    }
    let motion = ElementMotion::new(member, &nodes, at);
    motion.stresses(&I::alone(&motion.configuration), &element.points(), damping)
}

impl<I> StrainRateDamping<I> {
    /// The number of the first element with as many nodes, by points of an element.
    fn starts(&self) -> [usize; 3] {
        let elements = &self.elasticity.elements;
        [0, elements.two.len(), elements.two.len() + elements.three.len()]
    }
}

fn add_batch<I: Interpolation, const N: usize, const G: usize>(
    batch: &[ElasticElement<N, G>],
    first: usize,
    (viscosity, starts): (&Viscosity, &[usize; 3]),
    at: &State,
    weights: Weights,
    out: &mut Assembler,
) {
    let scratch_memory = RefCell::new(DampingScratch { element: Workspace::new(N), moving: Workspace::new(N) });
    let mut system = ElementSystem::new(2 * N);
    for (k, element) in batch.iter().enumerate() {
        let member = element.member();
        member.connection.evaluate(at, weights, true, &after_displacement, &mut system, &|nodes, weights, out| {
            let motion = ElementMotion::new(member, nodes, at);
            let damping = viscosity.of_element(first + k, starts);
            motion.add::<I, G>(&element.points(), damping, weights, &mut scratch_memory.borrow_mut(), out);
        });
        out.add(first + k, &system);
    }
}

/// Damping stresses of the points of an element over their strain rates.
#[derive(Clone, Copy)]
struct PointDamping<'a, const G: usize> {
    /// Factor of the stiffness: beta, or 1 for viscosities of their own
    factor: f64,
    own: Option<&'a [Stiffness; G]>,
}

impl<const G: usize> PointDamping<'_, G> {
    /// The matrix that gives damping resultants when multiplied with the factor and a strain rate.
    fn stiffness<const N: usize>(&self, points: &[ElasticPoint<N>; G], g: usize) -> Stiffness {
        match self.own {
            Some(own) => own[g],
            None => points[g].law.stiffness_at_rest(),
        }
    }
}

/// Scratch memory, kept between elements.
struct DampingScratch {
    element: Workspace,
    moving: Workspace<Rate>,
}

/// The configuration of an element in one chart, with the rates of its nodes.
struct ElementMotion<const N: usize> {
    configuration: ElementConfiguration<N>,
    displacements: [Vec3; N],
    rotations: [RotationRate; N],
}

impl<const N: usize> ElementMotion<N> {
    fn new(member: ElementNodes<N>, nodes: &[NodeMotion; N], at: &State) -> Self {
        let rotation = |i: usize| match at.turns.is_empty() {
            true => RotationRate::of_vector(nodes[i].p_rate),
            false => at.rotation_rate(member.connection.nodes[i].p),
        };
        Self {
            configuration: ElementConfiguration::new(member, nodes, at),
            displacements: nodes.map(|node| node.u_rate),
            rotations: std::array::from_fn(rotation),
        }
    }

    /// Derivatives over the rate of the unknown of a block and over the unknown, from the
    /// derivative over the rate that the state holds.
    fn pull_back(&self, block: usize, over_rate: Vec3) -> (Vec3, Vec3) {
        if block.is_multiple_of(2) { (over_rate, Vec3::ZERO) } else { self.rotations[block / 2].pull_back(over_rate) }
    }

    /// The configuration as a function of time, to first order.
    fn moving(&self) -> ElementConfiguration<N, Rate> {
        let ElementConfiguration { arms, u, p, base } = &self.configuration;
        ElementConfiguration {
            arms: arms.map(Vec3::constant),
            u: std::array::from_fn(|i| Vec3::with_rate(u[i], self.displacements[i])),
            p: std::array::from_fn(|i| Vec3::with_rate(p[i], self.rotations[i].rate)),
            base: base.map(|all| all.map(Mat3::constant)),
        }
    }

    /// Adds force and tangent of all points.
    fn add<I: Interpolation, const G: usize>(
        &self,
        points: &[ElasticPoint<N>; G],
        damping: PointDamping<G>,
        weights: Weights,
        scratch_memory: &mut DampingScratch,
        out: &mut ElementSystem,
    ) {
        let view = I::alone(&self.configuration);
        let sum = Stressed { points, stresses: &self.stresses(&view, points, damping) };
        let Workspace { system, scratch } = &mut scratch_memory.element;
        I::fill_alone(&view, &sum, weights.stiffness, scratch, system);
        out.add_system(system, weights.stiffness != 0.0);
        if weights.stiffness != 0.0 || weights.damping != 0.0 {
            let moving = I::alone(&self.moving());
            for (g, point) in points.iter().enumerate() {
                let strains = Strains::new(self, &moving, &point.lifted(), &mut scratch_memory.moving);
                let factor = damping.factor / point.weight;
                strains.add_tangent(&damping.stiffness(points, g), factor, weights, out);
            }
        }
    }

    /// The stress s at each point.
    fn stresses<const G: usize>(
        &self,
        view: &impl View<N, f64>,
        points: &[ElasticPoint<N>; G],
        damping: PointDamping<G>,
    ) -> [Stress; G] {
        let factor = damping.factor;
        let nodes = view.nodes();
        let rates = view.variation(&self.displacements, &self.rotations.map(|of| of.rate));
        std::array::from_fn(|g| {
            let place = points[g].configuration(nodes);
            let rate = points[g].strain_variation(&place, |i| rates[i].0, |i| rates[i].1);
            let scaled = Strain { gamma: rate.gamma * factor, kappa: rate.kappa * factor };
            damping.stiffness(points, g).stress(&scaled)
        })
    }
}

/// Points under constant stresses.
struct Stressed<'a, const N: usize, const G: usize> {
    points: &'a [ElasticPoint<N>; G],
    stresses: &'a [Stress; G],
}

impl<const N: usize, const G: usize> PointSum<N, f64> for Stressed<'_, N, G> {
    fn add(&self, nodes: &[NodePlace; N], stiffness: f64, out: &mut ElementSystem) {
        let none = Stiffness { cn: Mat3::ZERO, cm: Mat3::ZERO, cc: None };
        for (point, stress) in self.points.iter().zip(self.stresses) {
            let place = point.configuration(nodes);
            point.add_force(&place, stress, out);
            if stiffness != 0.0 {
                point.add_tangent(&place, &none, stress, stiffness, out);
            }
        }
    }

    fn add_geometric(&self, _nodes: &[NodePlace; N], _out: &mut ElementSystem) -> bool {
        false
    }
}

/// A moving point, with its configuration, under a unit stress in one component.
struct UnitStress<'a, const N: usize> {
    point: &'a ElasticPoint<N, Rate>,
    place: &'a Point<Rate>,
    component: usize,
}

impl<const N: usize> PointSum<N, Rate> for UnitStress<'_, N> {
    fn add(&self, _nodes: &[NodePlace<Rate>; N], _stiffness: f64, out: &mut ElementSystem<Rate>) {
        let unit = |part: usize| match self.component / 3 == part {
            true => Vec3::constant(Vec3::UNIT[self.component % 3]),
            false => Vec3::zero(),
        };
        self.point.add_force(self.place, &Stress { n: unit(0), m: unit(1) }, out);
    }

    fn add_geometric(&self, _nodes: &[NodePlace<Rate>; N], _out: &mut ElementSystem<Rate>) -> bool {
        false
    }
}

/// Derivatives of the six strain rates of a point over the blocks of the element, times the weight
/// of the point.
struct Strains {
    blocks: [Vec<StrainBlock>; 6],
}

/// Derivatives of one strain rate over one block, times the weight of the point.
#[derive(Clone, Copy)]
struct StrainBlock {
    /// b_k
    force: Vec3,
    /// w dE_k/dt over the rate of this block
    over_rate: Vec3,
    /// w dE_k/dt over this block
    over_unknown: Vec3,
}

impl Strains {
    fn new<const N: usize>(
        motion: &ElementMotion<N>,
        moving: &impl View<N, Rate>,
        point: &ElasticPoint<N, Rate>,
        Workspace { system, scratch }: &mut Workspace<Rate>,
    ) -> Self {
        let place = point.configuration(moving.nodes());
        let blocks = std::array::from_fn(|component| {
            moving.fill(&UnitStress { point, place: &place, component }, 0.0, scratch, system);
            let block = |(b, moved): (usize, &[Rate; 3])| {
                let force = Vec3(moved.map(|number| number.value));
                let bent = Vec3(moved.map(|number| number.rate));
                let (over_rate, lost) = motion.pull_back(b, force);
                StrainBlock { force, over_rate, over_unknown: lost + bent }
            };
            system.forces().iter().enumerate().map(block).collect()
        });
        Self { blocks }
    }

    /// Adds the part of the tangent by the change of s; `factor` is beta / w, or 1 / w.
    fn add_tangent(&self, stiffness: &Stiffness, factor: f64, weights: Weights, out: &mut ElementSystem) {
        for column in 0..out.blocks() {
            // Each strain is a row.
            let over = |component: usize| {
                let block = self.blocks[component][column];
                (block.over_rate * weights.damping + block.over_unknown * weights.stiffness) * factor
            };
            let gamma = Mat3([over(0).0, over(1).0, over(2).0]);
            let kappa = Mat3([over(3).0, over(4).0, over(5).0]);
            let mut n = stiffness.cn * gamma;
            let mut m = stiffness.cm * kappa;
            if let Some(coupling) = stiffness.cc {
                n += coupling * kappa;
                m += coupling.transpose_matmul(gamma);
            }
            for row in 0..out.blocks() {
                let force = |component: usize| self.blocks[component][row].force.0;
                let of_n = Mat3([force(0), force(1), force(2)]).transpose_matmul(n);
                out.add_tangent(row, column, of_n + Mat3([force(3), force(4), force(5)]).transpose_matmul(m));
            }
        }
    }
}
