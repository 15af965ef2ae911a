//! Contact of two beams, or of a beam with itself: forces and tangent of one pair of points.
//!
//! Point A lies at s on one element, point B at e on the other; D = x_A - x_B, l = |D|, n = D/l
//! points from B to A, and the gap is g = l - r_A - r_B. A node j of B, the one nearest to e at the
//! last converged state, carries the pair: with its rotation Q
//!
//! ```text
//! y = Q^T D,  m = y/l,  H = (I - mm)/l,  dy = Q^T dD + y~ w,  w = T_j dP_j
//! arms       a_A = r_A + g/2,  a_B = r_B + g/2
//! rolling    Theta = a_A theta_A + a_B theta_B
//! sliding    a = y - y0 - Theta x mr,   da = dy - dy0 + mr~ dTheta - Theta~ (dmr/dm) H dy
//! ```
//!
//! with mr the mean of the normals along the arc from m0 to m, or m where the contact was open.
//!
//! With F = p m + t (force on A), internal forces are
//!
//! ```text
//! f_x_A = -N_A Q F            f_x_B = N_B Q F
//! f_P_A = N_A T^T S^T a_A (m x t)     f_P_B = N_B T^T S^T a_B (m x t),   S = Q^T R
//! ```
//!
//! Free parameters, any of s and e, are those of the closest points. With z_A = Q^T x_A', z_B = Q^T
//! x_B' and F_s = m.z_A = 0, F_e = -m.z_B = 0:
//!
//! ```text
//! F_ss = z_A.H z_A + n.x_A''    F_se = -z_A.H z_B    F_ee = z_B.H z_B - n.x_B''
//! F_s over x_A: Q (H z_A N_A + m N_A')    over x_B: -Q H z_A N_B
//! F_e over x_A: -Q H z_B N_A              over x_B: Q (H z_B N_B - m N_B')
//! K = f_q - f_s F_ss^-1 F_sq
//! ```
//!
//! Without friction and damping K is symmetric:
//!
//! ```text
//! K = -p_g (N^T n)(N^T n)^T - p [N^T H N - F_qs F_ss^-1 F_sq],   N = [N_A, -N_B]
//! ```

use super::along::{ShapeAt, weighted_sum};
use super::friction::{CarriedTraction, FrictionLaw, Status, Traction};
use super::law::NormalLaw;
use super::point::PointState;
use super::variation::{Change, Column, ContactNode, Derived, NodeBlocks, NodeTurning, Turned};
use crate::kernel::element::{ElementSystem, MAX_NODES, Weights};
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// One of the two elements of a pair.
#[derive(Clone, Copy, Debug)]
pub struct PairSide<const N: usize, T = f64> {
    /// The nodes
    pub(crate) nodes: [ContactNode<T>; N],
    /// How they are turned, which only friction needs; states before are seen from the carrier of the pair
    pub(crate) turning: Option<[NodeTurning<T>; N]>,
    /// The shape functions at the point
    pub(crate) shape: ShapeAt<N, T>,
}

impl<const N: usize, T: Real> PairSide<N, T> {
    /// x at the point.
    pub fn place(&self) -> Vec3<T> {
        weighted_sum(&self.shape.values, |i| self.nodes[i].place)
    }

    /// x' at the point.
    fn tangent(&self) -> Vec3<T> {
        weighted_sum(&self.shape.slopes, |i| self.nodes[i].place)
    }

    /// x'' at the point.
    fn bend(&self) -> Vec3<T> {
        weighted_sum(&self.shape.bends, |i| self.nodes[i].place)
    }
}

/// The laws of a pair of points, and its memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairLaw {
    /// r_A and r_B, radii of the sections
    pub(crate) radii: [f64; 2],
    /// The normal force
    pub(crate) normal: NormalLaw,
    /// Friction; `None` without
    pub(crate) friction: Option<FrictionLaw>,
    /// The traction on A at the last converged state, in the axes of the carrier
    pub(crate) carried: CarriedTraction,
    /// j, the node of B whose rotation carries the pair
    pub(crate) carrier: usize,
    /// True for parameters s of A and e of B that are those of the closest points; others stay
    pub(crate) free: [bool; 2],
    /// Part of the force that this pair stands for. The tangent leaves out how it changes.
    pub(crate) weight: f64,
}

/// The largest number of blocks of a pair: two elements.
const MAX_BLOCKS: usize = 4 * MAX_NODES;

/// A vector for each block of a pair.
type ByBlock<T> = [Vec3<T>; MAX_BLOCKS];

/// A vector for the displacements of each node of a pair.
type ByNode<T> = [Vec3<T>; 2 * MAX_NODES];

/// Adds the forces of a pair of points to `out`, and the tangent of the weights: blocks x_1, P_1, …
/// of A, then those of B, or x_1, x_2, … where it is not given how nodes are turned. `None` if the centre lines meet,
/// where there is no normal.
pub fn add_pair<const NA: usize, const NB: usize, T: Real>(
    a: &PairSide<NA, T>,
    b: &PairSide<NB, T>,
    law: &PairLaw,
    weights: Weights,
    out: &mut ElementSystem<T>,
) -> Option<PointState<T>> {
    let both = law.friction.as_ref().and_then(|friction| Some((friction, a.turning.as_ref()?, b.turning.as_ref()?)));
    // Without friction it does not matter how the axes are turned.
    let q = both.map_or(Mat3::identity(), |(_, _, turning_b)| turning_b[law.carrier].rotation.r);
    let place = q.transpose_mul(a.place() - b.place());
    let length = place.norm();
    if length.largest() <= 0.0 || length.largest().is_nan() {
        return None;
    }
    let inverse = T::one() / length;
    let normal = place * inverse;
    let curvature = (Mat3::identity() - normal.outer(normal)) * inverse;
    let moves = |i: usize| a.nodes[i].velocity;
    let carries = |k: usize| b.nodes[k].velocity;
    let rate = q.transpose_mul(weighted_sum(&a.shape.values, moves) - weighted_sum(&b.shape.values, carries));
    let gap = length - T::constant(law.radii[0] + law.radii[1]);
    let normal_force = law.normal.force(gap, normal.dot(rate));
    let mut state = PointState { gap, normal_force, normal, traction: Traction::none() };
    if state.status() == Status::Open {
        return Some(state);
    }
    let arms = law.radii.map(|radius| T::constant(radius) + gap * 0.5);
    let turned = both
        .map(|(_, turning_a, turning_b)| (Turned::new(turning_a, &a.shape, &q), Turned::new(turning_b, &b.shape, &q)));
    let mut rolling = Vec3::zero();
    let mut angles = Vec3::zero();
    if let (Some((friction, ..)), Some((turned_a, turned_b))) = (both, &turned) {
        let before = turned_a.before(&a.shape.values) - turned_b.before(&b.shape.values);
        angles = turned_a.angle + turned_b.angle;
        rolling = turned_a.angle * arms[0] + turned_b.angle * arms[1];
        let sliding = place - before - rolling.cross(law.carried.rolling_normal(normal).value);
        state.traction = friction.traction(&law.carried, normal, normal_force.force, sliding);
    }
    let blocks = NodeBlocks::with(a.turning.is_some());
    let pair =
        Pair { a, b, law, blocks, q, place, normal, curvature, rate, arms, turned, angles, rolling, state: &state };
    pair.add(weights, out);
    Some(state)
}

/// A pair of points with a force.
struct Pair<'a, const NA: usize, const NB: usize, T> {
    a: &'a PairSide<NA, T>,
    b: &'a PairSide<NB, T>,
    law: &'a PairLaw,
    blocks: NodeBlocks,
    /// Q
    q: Mat3<T>,
    /// y
    place: Vec3<T>,
    /// m
    normal: Vec3<T>,
    /// H
    curvature: Mat3<T>,
    /// Q^T dD/dt
    rate: Vec3<T>,
    /// a_A and a_B
    arms: [T; 2],
    turned: Option<(Turned<'a, NA, T>, Turned<'a, NB, T>)>,
    /// theta_A + theta_B
    angles: Vec3<T>,
    /// Theta
    rolling: Vec3<T>,
    state: &'a PointState<T>,
}

/// The force on A, and the moments on A and B about their centre lines.
struct Loads<T> {
    /// F
    force: Derived<T>,
    /// a_A (m x t) and a_B (m x t)
    moments: [Derived<T>; 2],
}

/// Changes of the loads, and of the shape functions that distribute them.
struct LoadChange<'a, const NA: usize, const NB: usize, T> {
    force: Vec3<T>,
    moments: [Vec3<T>; 2],
    /// Factors of A and B
    factors: (&'a [T; NA], &'a [T; NB]),
}

impl<const NA: usize, const NB: usize, T: Real> Pair<'_, NA, NB, T> {
    /// The number of blocks.
    const fn count(&self) -> usize {
        self.blocks.of(NA + NB)
    }

    /// The block of the displacements of node `i` of A.
    const fn on_a(&self, i: usize) -> usize {
        self.blocks.of(i)
    }

    /// The block of the displacements of node `k` of B.
    const fn on_b(&self, k: usize) -> usize {
        self.blocks.of(NA + k)
    }

    fn add(&self, weights: Weights, out: &mut ElementSystem<T>) {
        let loads = self.loads();
        let values = (&self.a.shape.values, &self.b.shape.values);
        let moments = [loads.moments[0].value, loads.moments[1].value];
        let mut forces = [Vec3::zero(); MAX_BLOCKS];
        self.distribute(&LoadChange { force: loads.force.value, moments, factors: values }, &mut forces);
        for block in 0..self.count() {
            out.add_force(block, forces[block]);
        }
        if weights.stiffness == 0.0 && weights.damping == 0.0 {
            return;
        }
        self.add_columns(&loads, weights, out);
        if self.turned.is_some() {
            self.add_geometric(&loads, weights.stiffness, out);
        }
        self.add_moving(&loads, weights.stiffness, out);
    }

    /// F and the moments.
    fn loads(&self) -> Loads<T> {
        let t = &self.state.traction;
        let m = self.normal;
        let p = self.state.normal_force.force;
        let weight = self.law.weight;
        let half = m.scale(0.5);
        let rolls_about = self.law.carried.rolling_normal(m);
        let slides = Mat3::identity() - Mat3::skew_mul(self.rolling, rolls_about.over_normal * self.curvature)
            + Mat3::skew_mul(rolls_about.value, self.angles.outer(half));
        let friction = Derived {
            value: t.force.scale(weight),
            over_place: (t.over_sliding * slides + t.over_normal * self.curvature).scale(weight),
            over_rolling: (t.over_sliding * rolls_about.value.skew()).scale(weight),
            over_before: -t.over_sliding.scale(weight),
            over_pressure: t.over_pressure.scale(weight),
        };
        let lever = m.cross(friction.value);
        let lever_over_place = Mat3::skew_mul(m, friction.over_place) - Mat3::skew_mul(friction.value, self.curvature);
        let moments = self.arms.map(|arm| Derived {
            value: lever * arm,
            over_place: lever_over_place * arm + lever.outer(half),
            over_rolling: Mat3::skew_mul(m, friction.over_rolling) * arm,
            over_before: Mat3::skew_mul(m, friction.over_before) * arm,
            over_pressure: m.cross(friction.over_pressure) * arm,
        });
        let force = Derived {
            value: (m * p).scale(weight) + friction.value,
            over_place: (self.curvature * p).scale(weight) + friction.over_place,
            over_pressure: m.scale(weight) + friction.over_pressure,
            ..friction
        };
        Loads { force, moments }
    }

    /// The derivative of p over D (axes of the carrier), through the gap and its rate.
    fn pressure_over_place(&self) -> Vec3<T> {
        let force = &self.state.normal_force;
        self.normal * force.over_gap + self.curvature * self.rate * force.over_rate
    }

    /// Forces on the nodes from loads.
    fn distribute(&self, loads: &LoadChange<'_, NA, NB, T>, forces: &mut ByBlock<T>) {
        let spatial = self.q * loads.force;
        let (on_a, on_b) = loads.factors;
        for i in 0..NA {
            forces[self.on_a(i)] += -spatial * on_a[i];
        }
        for k in 0..NB {
            forces[self.on_b(k)] += spatial * on_b[k];
        }
        let Some((turned_a, turned_b)) = &self.turned else { return };
        for i in 0..NA {
            let material = turned_a.rotations[i].transpose_mul(loads.moments[0]);
            forces[self.on_a(i) + 1] += turned_a.nodes[i].rotation.t.transpose_mul(material) * on_a[i];
        }
        for k in 0..NB {
            let material = turned_b.rotations[k].transpose_mul(loads.moments[1]);
            forces[self.on_b(k) + 1] += turned_b.nodes[k].rotation.t.transpose_mul(material) * on_b[k];
        }
    }

    /// The block of the rotation of the carrier.
    fn carrier(&self) -> usize {
        self.on_b(self.law.carrier) + 1
    }

    /// Adds the derivatives of F and of the moments, without those of Q, T and S.
    fn add_columns(&self, loads: &Loads<T>, weights: Weights, out: &mut ElementSystem<T>) {
        let mut displacements = [(0, T::zero()); 2 * MAX_NODES];
        for i in 0..NA {
            displacements[i] = (self.on_a(i), self.a.shape.values[i]);
        }
        for k in 0..NB {
            displacements[NA + k] = (self.on_b(k), -self.b.shape.values[k]);
        }
        self.add_column(&displacements[..NA + NB], &self.displacement(weights), loads, out);
        let Some(turned) = &self.turned else { return };
        let (turned_a, turned_b) = turned;
        let column = |rolling: Mat3<T>| Column {
            place: Mat3::zero(),
            rolling: rolling.scale(weights.stiffness),
            pressure: Vec3::zero(),
        };
        for i in 0..NA {
            let spun = turned_a.maps[i] * (turned_a.rotations[i] * turned_a.nodes[i].rotation.t);
            let rolling = spun * (self.a.shape.values[i] * self.arms[0]);
            self.add_column(&[(self.on_a(i) + 1, T::one())], &column(rolling), loads, out);
        }
        for k in 0..NB {
            let spun = turned_b.maps[k] * (turned_b.rotations[k] * turned_b.nodes[k].rotation.t);
            let rolling = spun * (self.b.shape.values[k] * self.arms[1]);
            self.add_column(&[(self.on_b(k) + 1, T::one())], &column(rolling), loads, out);
        }
        self.add_column(&[(self.carrier(), T::one())], &self.carrier_rotation(turned, weights), loads, out);
    }

    /// The column of a change of D.
    fn displacement(&self, weights: Weights) -> Column<T> {
        let moved = self.q.transpose();
        let by_rate = self.normal * self.state.normal_force.over_rate;
        let pressure = self.pressure_over_place().scale(weights.stiffness) + by_rate.scale(weights.damping);
        Column { place: moved.scale(weights.stiffness), rolling: Mat3::zero(), pressure: moved.transpose() * pressure }
    }

    /// The column of the rotation of the carrier, at constant spatial D and rotations of the nodes:
    /// it changes neither the gap nor its rate.
    fn carrier_rotation(&self, (turned_a, turned_b): &(Turned<NA, T>, Turned<NB, T>), weights: Weights) -> Column<T> {
        let t = turned_b.nodes[self.law.carrier].rotation.t.scale(weights.stiffness);
        let mut rolling = Mat3::zero();
        for i in 0..NA {
            rolling -= turned_a.maps[i] * t * (self.a.shape.values[i] * self.arms[0]);
        }
        for k in 0..NB {
            rolling -= turned_b.maps[k] * t * (self.b.shape.values[k] * self.arms[1]);
        }
        Column { place: Mat3::skew_mul(self.place, t), rolling, pressure: Vec3::zero() }
    }

    /// Adds a column to blocks, each times its factor.
    fn add_column(&self, blocks: &[(usize, T)], column: &Column<T>, loads: &Loads<T>, out: &mut ElementSystem<T>) {
        let spatial = self.q * loads.force.over(column);
        let mut add =
            |row: usize, of_row: Mat3<T>| blocks.iter().for_each(|&(block, f)| out.add_tangent(row, block, of_row * f));
        for i in 0..NA {
            add(self.on_a(i), -spatial * self.a.shape.values[i]);
        }
        for k in 0..NB {
            add(self.on_b(k), spatial * self.b.shape.values[k]);
        }
        let Some((turned_a, turned_b)) = &self.turned else { return };
        let moments = [loads.moments[0].over(column), loads.moments[1].over(column)];
        for i in 0..NA {
            let material = turned_a.rotations[i].transpose_matmul(moments[0]);
            add(self.on_a(i) + 1, turned_a.nodes[i].rotation.t.transpose_matmul(material) * self.a.shape.values[i]);
        }
        for k in 0..NB {
            let material = turned_b.rotations[k].transpose_matmul(moments[1]);
            add(self.on_b(k) + 1, turned_b.nodes[k].rotation.t.transpose_matmul(material) * self.b.shape.values[k]);
        }
    }

    /// Adds the derivatives of Q, T and S at constant loads.
    fn add_geometric(&self, loads: &Loads<T>, weight: f64, out: &mut ElementSystem<T>) {
        let Some((turned_a, turned_b)) = &self.turned else { return };
        let carried = turned_b.nodes[self.law.carrier].rotation.t;
        let turned = self.q * Mat3::skew_mul(loads.force.value, carried.scale(weight));
        for i in 0..NA {
            out.add_tangent(self.on_a(i), self.carrier(), turned * self.a.shape.values[i]);
        }
        for k in 0..NB {
            out.add_tangent(self.on_b(k), self.carrier(), -(turned * self.b.shape.values[k]));
        }
        for i in 0..NA {
            let side = (&turned_a.nodes[i], &turned_a.rotations[i], self.a.shape.values[i] * weight);
            self.add_spin(self.on_a(i) + 1, side, loads.moments[0].value, &carried, out);
        }
        for k in 0..NB {
            let side = (&turned_b.nodes[k], &turned_b.rotations[k], self.b.shape.values[k] * weight);
            self.add_spin(self.on_b(k) + 1, side, loads.moments[1].value, &carried, out);
        }
    }

    /// Adds the derivatives of T and S of one node at a constant moment. `carried`: T of the carrier.
    fn add_spin(
        &self,
        block: usize,
        (node, s, factor): (&NodeTurning<T>, &Mat3<T>, T),
        moment: Vec3<T>,
        carried: &Mat3<T>,
        out: &mut ElementSystem<T>,
    ) {
        let t = node.rotation.t;
        let back = t.transpose() * s.transpose() * factor;
        let own = back * Mat3::skew_mul(moment, *s * t) + node.rotation.c2(s.transpose_mul(moment)) * factor;
        out.add_tangent(block, block, own);
        out.add_tangent(block, self.carrier(), -(back * Mat3::skew_mul(moment, *carried)));
    }

    /// Adds -f_s F_ss^-1 F_sq for the free parameters, unless F_ss is not positive definite.
    fn add_moving(&self, loads: &Loads<T>, weight: f64, out: &mut ElementSystem<T>) {
        let Some(inverse) = invert(self.second_derivatives(), self.law.free) else { return };
        let gradients = self.gradients();
        let mut add = |forces: &ByBlock<T>, by: &[T; 2]| {
            for node in 0..NA + NB {
                // How the parameter moves with the displacements, the only unknowns that F depends on.
                let moves = (gradients[0][node] * by[0] + gradients[1][node] * by[1]).scale(-weight);
                for row in 0..self.count() {
                    out.add_tangent(row, self.blocks.of(node), forces[row].outer(moves));
                }
            }
        };
        if self.law.free[0] {
            add(&self.along_a(loads), &inverse[0]);
        }
        if self.law.free[1] {
            add(&self.along_b(loads), &inverse[1]);
        }
    }

    /// z_A and z_B
    fn tangents(&self) -> [Vec3<T>; 2] {
        [self.q.transpose_mul(self.a.tangent()), self.q.transpose_mul(self.b.tangent())]
    }

    /// F_ss, F_se; F_se, F_ee
    fn second_derivatives(&self) -> [[T; 2]; 2] {
        let [za, zb] = self.tangents();
        let spatial = self.q * self.normal;
        let mixed = -za.dot(self.curvature * zb);
        [
            [za.dot(self.curvature * za) + spatial.dot(self.a.bend()), mixed],
            [mixed, zb.dot(self.curvature * zb) - spatial.dot(self.b.bend())],
        ]
    }

    /// F_s and F_e over the displacements; zero for a parameter that is not free.
    fn gradients(&self) -> [ByNode<T>; 2] {
        let mut out = [[Vec3::zero(); 2 * MAX_NODES]; 2];
        let n = self.q * self.normal;
        let bent = self.tangents().map(|z| self.q * (self.curvature * z));
        let (on_a, on_b) = (&self.a.shape, &self.b.shape);
        if self.law.free[0] {
            for i in 0..NA {
                out[0][i] = bent[0] * on_a.values[i] + n * on_a.slopes[i];
            }
            for k in 0..NB {
                out[0][NA + k] = -bent[0] * on_b.values[k];
            }
        }
        if self.law.free[1] {
            for i in 0..NA {
                out[1][i] = -bent[1] * on_a.values[i];
            }
            for k in 0..NB {
                out[1][NA + k] = bent[1] * on_b.values[k] - n * on_b.slopes[k];
            }
        }
        out
    }

    /// f_s, the derivatives of the forces over s.
    fn along_a(&self, loads: &Loads<T>) -> ByBlock<T> {
        let shape = &self.a.shape;
        let z = self.tangents()[0];
        let faster = self.q.transpose_mul(weighted_sum(&shape.slopes, |i| self.a.nodes[i].velocity));
        let angles = |i: usize| self.turned.as_ref().map_or(Vec3::zero(), |(a, _)| a.angles[i]);
        let change = Change {
            place: z,
            rolling: weighted_sum(&shape.slopes, angles) * self.arms[0],
            before: self.turned.as_ref().map_or(Vec3::zero(), |(a, _)| a.before(&shape.slopes)),
            pressure: self.pressure_over_place().dot(z) + self.normal.dot(faster) * self.state.normal_force.over_rate,
        };
        self.along(loads, &change, (&shape.slopes, &[T::zero(); NB]))
    }

    /// f_e, the derivatives of the forces over e.
    fn along_b(&self, loads: &Loads<T>) -> ByBlock<T> {
        let shape = &self.b.shape;
        let z = self.tangents()[1];
        let faster = self.q.transpose_mul(weighted_sum(&shape.slopes, |k| self.b.nodes[k].velocity));
        let angles = |k: usize| self.turned.as_ref().map_or(Vec3::zero(), |(_, b)| b.angles[k]);
        let change = Change {
            place: -z,
            rolling: weighted_sum(&shape.slopes, angles) * self.arms[1],
            before: self.turned.as_ref().map_or(Vec3::zero(), |(_, b)| -b.before(&shape.slopes)),
            pressure: -(self.pressure_over_place().dot(z)
                + self.normal.dot(faster) * self.state.normal_force.over_rate),
        };
        self.along(loads, &change, (&[T::zero(); NA], &shape.slopes))
    }

    /// The derivatives of the forces for a change of what loads depend on, and `slopes` of the shape
    /// functions.
    fn along(&self, loads: &Loads<T>, change: &Change<T>, slopes: (&[T; NA], &[T; NB])) -> ByBlock<T> {
        let mut out = [Vec3::zero(); MAX_BLOCKS];
        let values = (&self.a.shape.values, &self.b.shape.values);
        let moments = [loads.moments[0].by(change), loads.moments[1].by(change)];
        self.distribute(&LoadChange { force: loads.force.by(change), moments, factors: values }, &mut out);
        let moments = [loads.moments[0].value, loads.moments[1].value];
        self.distribute(&LoadChange { force: loads.force.value, moments, factors: slopes }, &mut out);
        out
    }
}

/// The inverse of a symmetric 2x2 matrix on the free parameters; `None` without a free one, or if
/// it is not positive definite.
fn invert<T: Real>(m: [[T; 2]; 2], free: [bool; 2]) -> Option<[[T; 2]; 2]> {
    let one = T::one();
    let zero = T::zero();
    let positive = |value: T| value.largest() > 0.0;
    match free {
        [false, false] => None,
        [true, false] => positive(m[0][0]).then(|| [[one / m[0][0], zero], [zero; 2]]),
        [false, true] => positive(m[1][1]).then(|| [[zero; 2], [zero, one / m[1][1]]]),
        [true, true] => {
            let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
            let inverse = one / determinant;
            let definite = positive(m[0][0]) && positive(determinant);
            definite.then(|| [[m[1][1] * inverse, -m[0][1] * inverse], [-m[1][0] * inverse, m[0][0] * inverse]])
        }
    }
}
