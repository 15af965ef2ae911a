//! The stiffness part of Rayleigh damping: stresses beta C d(Gamma, K)/dt of the material frame, so
//! that rigid motion is not damped. C is the stiffness of the section at rest.
//!
//! With b_k = w dE_k/dq for each strain component E_k of a point of weight w, and G_k = db_k/dq:
//!
//! ```text
//! dE_k/dt = b_k . qd / w,   s = beta C dE/dt,   f = sum b_k s_k
//! df/dqd = sum b_k (beta C / w)_kl b_l,   df/dq = sum s_k G_k + sum b_k (beta C / w)_kl (G_l qd)
//! ```
//!
//! f and sum s_k G_k are force and geometric tangent of the elastic element under the stress s,
//! whatever its interpolation. b_k is its force under a unit stress, and G_k qd the rate of that: a
//! jet along the motion brings both.

use super::beam::BeamElasticity;
use super::element::{ElasticElement, ElasticPoint, Member};
use super::interpolation::{Interpolation, PointSum, Posture, Scratch, View};
use crate::effect::{Effect, Roles, TangentForm, after_displacement, for_each_batch};
use crate::kernel::elastic::Point;
use crate::kernel::law::{SectionLaw, Stiffness, Strain, Stress};
use crate::kernel::{ElementSystem, NodeMotion, NodePlace, Weights};
use crate::scalar::Jet;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, RotationRate, State};
use crate::tensor::{Mat3, Vec3};
use std::cell::RefCell;
use std::sync::Arc;

/// Damping of all beams that interpolate in one way.
pub struct StrainRateDamping<I> {
    /// The beams
    pub elasticity: Arc<BeamElasticity<I>>,
    /// beta, a time
    pub factor: f64,
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

    fn mirror_data(&self, _show: &mut dyn FnMut(MirrorData)) {
        // Of the elasticity, which shows itself.
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        for_each_batch!(self.elasticity.elements, out.instances(), |first, batch| {
            add_batch::<I, _, _>(batch, first, self.factor, at, weights, out);
        });
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}

fn add_batch<I: Interpolation, const N: usize, const G: usize>(
    batch: &[ElasticElement<N, G>],
    first: usize,
    factor: f64,
    at: &State,
    weights: Weights,
    out: &mut Assembler,
) {
    let room = RefCell::new(Room::new(2 * N));
    let mut system = ElementSystem::new(2 * N);
    for (k, element) in batch.iter().enumerate() {
        let member = element.member();
        member.connection.evaluate(at, weights, true, after_displacement, &mut system, &|nodes, weights, out| {
            let motion = Motion::new(member, nodes, at);
            motion.add::<I, G>(&element.points(), factor, weights, &mut room.borrow_mut(), out);
        });
        out.add(first + k, &system);
    }
}

/// Room to work in, kept between elements.
struct Room {
    element: (ElementSystem, Scratch),
    jets: (ElementSystem<Jet>, Scratch<Jet>),
}

impl Room {
    fn new(blocks: usize) -> Self {
        let nodes = blocks / 2;
        Self {
            element: (ElementSystem::new(blocks), Scratch::new(nodes)),
            jets: (ElementSystem::new(blocks), Scratch::new(nodes)),
        }
    }
}

/// Where the nodes of an element are, in one chart, and how fast they move.
struct Motion<const N: usize> {
    posture: Posture<N>,
    displacements: [Vec3; N],
    rotations: [RotationRate; N],
}

impl<const N: usize> Motion<N> {
    fn new(member: Member<N>, nodes: &[NodeMotion; N], at: &State) -> Self {
        let rotation = |i: usize| match at.turns.is_empty() {
            true => RotationRate::of_vector(nodes[i].p_rate),
            false => at.rotation_rate(member.connection.nodes[i].p),
        };
        Self {
            posture: Posture::new(member, nodes, at),
            displacements: nodes.map(|node| node.u_rate),
            rotations: std::array::from_fn(rotation),
        }
    }

    /// Derivatives over the rate of the unknown of a block, and over the unknown, from the
    /// derivative over the rate of the state.
    fn pull_back(&self, block: usize, over_rate: Vec3) -> (Vec3, Vec3) {
        if block.is_multiple_of(2) { (over_rate, Vec3::ZERO) } else { self.rotations[block / 2].pull_back(over_rate) }
    }

    /// The posture as a function of time.
    fn jets(&self) -> Posture<N, Jet> {
        let Posture { arms, u, p, base } = &self.posture;
        Posture {
            arms: arms.map(Vec3::constant),
            u: std::array::from_fn(|i| jet(u[i], self.displacements[i])),
            p: std::array::from_fn(|i| jet(p[i], self.rotations[i].rate)),
            base: base.map(|all| all.map(Mat3::constant)),
        }
    }

    /// Adds force and tangent of all points.
    fn add<I: Interpolation, const G: usize>(
        &self,
        points: &[ElasticPoint<N>; G],
        factor: f64,
        weights: Weights,
        room: &mut Room,
        out: &mut ElementSystem,
    ) {
        let view = I::View::<N, f64>::new(&self.posture);
        let sum = Stressed { points, stresses: &self.stresses(&view, points, factor) };
        let (system, scratch) = &mut room.element;
        view.fill(&sum, weights.stiffness, scratch, system);
        out.add_system(system, weights.stiffness != 0.0);
        if weights.stiffness != 0.0 || weights.damping != 0.0 {
            let moving = I::View::<N, Jet>::new(&self.jets());
            for point in points {
                let strains = Strains::new(self, &moving, &point.lifted(), &mut room.jets);
                strains.add_tangent(&point.law.stiffness_at_rest(), factor / point.weight, weights, out);
            }
        }
    }

    /// s of each point.
    fn stresses<const G: usize>(
        &self,
        view: &impl View<N, f64>,
        points: &[ElasticPoint<N>; G],
        factor: f64,
    ) -> [Stress; G] {
        let nodes = view.nodes();
        let rates = view.variation(&self.displacements, &self.rotations.map(|of| of.rate));
        std::array::from_fn(|g| {
            let place = points[g].configuration(nodes);
            let rate = points[g].strain_variation(&place, |i| rates[i].0, |i| rates[i].1);
            let scaled = Strain { gamma: rate.gamma * factor, kappa: rate.kappa * factor };
            points[g].law.stiffness_at_rest().stress(&scaled)
        })
    }
}

/// A vector that moves.
fn jet(value: Vec3, rate: Vec3) -> Vec3<Jet> {
    Vec3(std::array::from_fn(|i| Jet { value: value.0[i], rate: rate.0[i], rate2: 0.0 }))
}

/// Points under stresses that do not depend on their strains.
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

/// A moving point, at a known place, under a stress of one in one component.
struct UnitStress<'a, const N: usize> {
    point: &'a ElasticPoint<N, Jet>,
    place: &'a Point<Jet>,
    component: usize,
}

impl<const N: usize> PointSum<N, Jet> for UnitStress<'_, N> {
    fn add(&self, _nodes: &[NodePlace<Jet>; N], _stiffness: f64, out: &mut ElementSystem<Jet>) {
        let unit = |part: usize| match self.component / 3 == part {
            true => Vec3::constant(Vec3::UNIT[self.component % 3]),
            false => Vec3::zero(),
        };
        self.point.add_force(self.place, &Stress { n: unit(0), m: unit(1) }, out);
    }

    fn add_geometric(&self, _nodes: &[NodePlace<Jet>; N], _out: &mut ElementSystem<Jet>) -> bool {
        false
    }
}

/// How the six strains of a point follow the blocks of the element, times its weight.
struct Strains {
    blocks: [Vec<StrainBlock>; 6],
}

/// How one strain follows one block.
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
        motion: &Motion<N>,
        moving: &impl View<N, Jet>,
        point: &ElasticPoint<N, Jet>,
        (system, scratch): &mut (ElementSystem<Jet>, Scratch<Jet>),
    ) -> Self {
        let place = point.configuration(moving.nodes());
        let blocks = std::array::from_fn(|component| {
            moving.fill(&UnitStress { point, place: &place, component }, 0.0, scratch, system);
            let block = |(b, moved): (usize, &[Jet; 3])| {
                let force = Vec3(moved.map(|jet| jet.value));
                let bent = Vec3(moved.map(|jet| jet.rate));
                let (over_rate, lost) = motion.pull_back(b, force);
                StrainBlock { force, over_rate, over_unknown: lost + bent }
            };
            system.forces().iter().enumerate().map(block).collect()
        });
        Self { blocks }
    }

    /// Adds what comes of the change of s; `factor` is beta / w.
    fn add_tangent(&self, stiffness: &Stiffness, factor: f64, weights: Weights, out: &mut ElementSystem) {
        for column in 0..out.blocks() {
            // One row a strain
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
