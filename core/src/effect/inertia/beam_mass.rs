//! Translational inertia of beams without eccentric mass: consistent mass matrices, which are
//! constant.

use crate::effect::volume::{VolumeElement, VolumeElements};
use crate::effect::{
    ByOrder, ELEMENTS_PER_TASK, Effect, Energy, Masses, Momentum, Roles, TangentForm, for_each_batch, shared,
};
use crate::kernel::Weights;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Slot, State};
use crate::tensor::Vec3;
use crate::threads;
use std::sync::Arc;

/// The mass of all beam elements, on their centre lines.
#[derive(Clone, Debug, Default)]
pub struct BeamMass {
    elements: ByOrder<MassElement<2>, MassElement<3>, MassElement<4>>,
}

/// The mass of an element of N nodes.
#[derive(Clone, Debug)]
struct MassElement<const N: usize> {
    /// The slots of the displacements of its nodes
    u: [Slot; N],
    /// The initial place of its first node
    place: Vec3,
    /// Data shared with equal neighbours
    common: Arc<SharedMassData<N>>,
}

/// The data that neighbouring mass elements share.
#[derive(Debug, PartialEq)]
struct SharedMassData<const N: usize> {
    /// The initial places of the nodes from the first node
    arms: [Vec3; N],
    /// The consistent mass matrix, the sum of w rhoA N_i N_j over the points; equal in all
    /// directions
    mass: [[f64; N]; N],
}

impl<const N: usize> MassElement<N> {
    fn new(element: &VolumeElement<N, f64>, neighbour: Option<&Self>) -> Self {
        let entry = |i: usize, j: usize| -> f64 {
            element.points().iter().map(|point| point.weight * point.quantity * point.shape[i] * point.shape[j]).sum()
        };
        let mass = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
        let common =
            shared(SharedMassData { arms: *element.arms(), mass }, neighbour.map(|neighbour| &neighbour.common));
        Self { u: element.connection.nodes.map(|node| node.u), place: element.place(), common }
    }

    #[inline(always)]
    fn mass(&self) -> &[[f64; N]; N] {
        &self.common.mass
    }

    /// The mass matrix times a field at the nodes: forces M a or momenta M v.
    #[inline(always)]
    fn times(&self, field: &[Vec3]) -> [Vec3; N] {
        let mut out = [Vec3::ZERO; N];
        for j in 0..N {
            let value = field[self.u[j] as usize];
            for i in 0..N {
                out[i] += value * self.mass()[i][j];
            }
        }
        out
    }

    fn energy(&self, at: &State) -> f64 {
        let linear = self.times(&at.v);
        let twice = |i: usize| at.v[self.u[i] as usize].dot(linear[i]);
        0.5 * (0..N).map(twice).sum::<f64>()
    }

    /// Calls `show` with the number of each node, its present place and its momentum, its part of M
    /// v.
    fn each_momentum(&self, at: &State, mut show: impl FnMut(usize, Vec3, Vec3)) {
        for (i, linear) in self.times(&at.v).into_iter().enumerate() {
            show(i, self.place + self.common.arms[i] + at.q[self.u[i] as usize], linear);
        }
    }
}

impl BeamMass {
    /// The mass of elements with their masses per length.
    pub fn new(elements: &VolumeElements<f64>) -> Self {
        let VolumeElements { two, three, four } = elements;
        Self { elements: ByOrder { two: matrices(two), three: matrices(three), four: matrices(four) } }
    }

    /// True if no element has mass.
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }
}

fn matrices<const N: usize>(elements: &[VolumeElement<N, f64>]) -> Vec<MassElement<N>> {
    let mut out = Vec::with_capacity(elements.len());
    elements.iter().for_each(|element| out.push(MassElement::new(element, out.last())));
    out
}

impl Effect for BeamMass {
    fn name(&self) -> &'static str {
        "beam mass"
    }

    fn category(&self) -> Category {
        Category::Inertia
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::divisible();
        for_each_batch!(self.elements, |_first, batch| batch.iter().for_each(|element| connectivity.push(element.u)));
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::Symmetric
    }

    fn mirror_data(&self, _show: &mut dyn FnMut(MirrorData)) {
        // Mass lies on the centre line, which the mesh shows.
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        for_each_batch!(self.elements, out.instances(), |first, batch| {
            for (k, element) in batch.iter().enumerate() {
                out.add_mass(first + k, &element.times(&at.a), element.mass(), weights.mass);
            }
        });
    }

    fn energy(&self, at: &State) -> Energy {
        let mut kinetic = 0.0;
        for_each_batch!(self.elements, |_first, batch| {
            let energy_of = |elements: &[MassElement<_>]| elements.iter().map(|element| element.energy(at)).sum();
            threads::in_order(batch.chunks(ELEMENTS_PER_TASK), energy_of, |own: f64| kinetic += own);
        });
        Energy { kinetic, strain: 0.0 }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles { masses: Some(self), ..Roles::NONE }
    }
}

impl Masses for BeamMass {
    fn momentum(&self, at: &State) -> Momentum {
        let mut sum = Momentum::default();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            element.each_momentum(at, |i, x, linear| {
                // The mass of a node is the sum of its row of the matrix.
                let mass = element.mass()[i].iter().sum();
                sum.add(Momentum { mass, moment: x * mass, linear, angular: x.cross(linear) });
            });
        });
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::Connection;
    use crate::kernel::shape;
    use crate::kernel::volume::VolumePoint;
    use crate::system::Node;

    const LENGTH: f64 = 3.0;
    const MASS: f64 = 2.5;

    /// An element along x, from the origin on, with a uniform mass.
    fn element<const N: usize>() -> VolumeElement<N, f64> {
        let point = |g: usize| {
            let (xi, weight) = shape::gauss(N)[g];
            VolumePoint { shape: shape::values(xi), weight: weight * 0.5 * LENGTH, quantity: MASS / LENGTH }
        };
        let place = |i: usize| Vec3([LENGTH * i as f64 / (N - 1) as f64, 0.0, 0.0]);
        let nodes = std::array::from_fn(|i| Node { u: 2 * i as Slot, p: 2 * i as Slot + 1 });
        let connection = Connection { element: 0, nodes };
        VolumeElement::new(connection, Vec3::ZERO, std::array::from_fn(place), std::array::from_fn(point), None)
    }

    /// Checks energy and momenta of an element that spins about a pivot beside it as a rigid body.
    fn spins<const N: usize>(elements: &VolumeElements<f64>) {
        let mass = BeamMass::new(elements);
        let mut state = State::rest(2 * N, 1, 0, 0);
        let spin = Vec3([0.3, -0.7, 1.1]);
        let pivot = Vec3([0.5, -2.0, 0.0]);
        for i in 0..N {
            let place = Vec3([LENGTH * i as f64 / (N - 1) as f64, 0.0, 0.0]);
            state.v[2 * i] = spin.cross(place - pivot);
        }
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-14 * MASS * 100.0, "{N} nodes: {a} instead of {b}");
        let centre = Vec3([0.5 * LENGTH, 0.0, 0.0]);
        let velocity = spin.cross(centre - pivot);
        // A thin rod has no inertia about its own line.
        let about_centre = MASS * LENGTH * LENGTH / 12.0;
        let across = Vec3([0.0, spin.0[1], spin.0[2]]);
        near(mass.energy(&state).kinetic, 0.5 * (MASS * velocity.squared() + about_centre * across.squared()));
        let momentum = mass.momentum(&state);
        let angular = centre.cross(velocity) * MASS + across * about_centre;
        near(momentum.mass, MASS);
        for k in 0..3 {
            near(momentum.moment.0[k], MASS * centre.0[k]);
            near(momentum.linear.0[k], MASS * velocity.0[k]);
            near(momentum.angular.0[k], angular.0[k]);
        }
    }

    #[test]
    fn elements_of_all_orders_spin_like_rods() {
        spins::<2>(&ByOrder { two: vec![element()], ..ByOrder::default() });
        spins::<3>(&ByOrder { three: vec![element()], ..ByOrder::default() });
        spins::<4>(&ByOrder { four: vec![element()], ..ByOrder::default() });
    }
}
