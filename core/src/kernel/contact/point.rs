//! One contact point of an element, or of a node, against a rigid surface: forces and tangent.
//!
//! The point lies at s on the element, x = sum N_i x_i. The surface is carried by a node with the
//! place c and the rotation Q (its spin is T_s dP_s), is moved from outside, or is fixed. Seen from
//! the carrier, y = Q^T (x - c), S_i = Q^T R_i, and
//!
//! ```text
//! dy = sum N_i Q^T dx_i - Q^T dc + y~ T_s dP_s
//! spin of S_i:  W_i = S_i T_i dP_i - T_s dP_s
//! ```
//!
//! With the normal force p and the traction t (force on the element, carrier axes; both times the
//! part of the force that the point carries) of a gap g = phi - r, F = p n + t, m = n x t and
//! b = y - r n, the internal forces are
//!
//! ```text
//! f_x_i = -N_i Q F    f_P_i = N_i r T_i^T S_i^T m    f_c = Q F    f_P_s = T_s^T (b x F)
//! ```
//!
//! The contact point is y - r n for both sides, so that forces and moments cancel. The sliding since
//! the last converged state, for the same material point then and now, is
//!
//! ```text
//! a = y - y0 - r theta x nr,   y0 = sum N_i y0_i,   theta = sum N_i log(S_i S0_i^T)
//! ```
//!
//! with nr the mean of the normals along the arc from n0 to n, or n where the contact was open: with n
//! alone the way of a ball that rolls on a curved surface would be wrong to first order of the step.
//!
//! The tangent, with dtheta_i = T(theta_i)^-T W_i:
//!
//! ```text
//! dn = H dy,  dp = p_g n.dy,  da = dy + r nr~ dtheta - r theta~ dnr
//! dF = n dp + p dn + dt,      dm = -t~ dn + n~ dt
//! K_x_i = -N_i Q (dF - F~ T_s dP_s)
//! K_P_i = N_i r [T_i^T S_i^T (dm + m~ W_i) + C2_i(S_i^T m) on dP_i]
//! K_c   = Q (dF - F~ T_s dP_s)
//! K_P_s = T_s^T (-F~ (dy - r dn) + b~ dF) + C2_s(b x F) on dP_s
//! ```
//!
//! With damping p depends on dg/dt = n.ydot, ydot = Q^T (xdot - cdot) + y x Omega_s, and
//!
//! ```text
//! d(dg/dt) = ydot.H dy + n.[(Q^T (xdot-cdot))~ T_s dP_s + dy x Omega_s + y x dOmega_s]
//!            + n.Q^T (sum N_i dxdot_i - dcdot)
//! ```
//!
//! A closest point moves with s: F_s = n.z = 0, z = Q^T x'. With
//!
//! ```text
//! F_ss = n.Q^T x'' + z.H z,   F_sq = z.H dy + n.(sum N_i' Q^T dx_i + z~ T_s dP_s)
//! K = f_q - f_s F_sq/F_ss
//! ```
//!
//! where f_s is the derivative of the forces over s: N -> N', dy -> z, y0 -> sum N_i' y0_i, theta
//! -> sum N_i' theta_i.

use super::along::{ShapeAt, weighted_sum};
use super::distance::Distance;
use super::friction::{CarriedTraction, FrictionLaw, Status, Traction};
use super::law::{NormalForce, NormalLaw};
use super::variation::{Change, Column, ContactNode, Derived, NodeBlocks, NodeTurning, Turned};
use crate::kernel::element::{ElementSystem, MAX_NODES, Weights};
use crate::rotation::Rotation;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// The carrier of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Carrier<T = f64> {
    /// c, its place, spatial
    pub(crate) place: Vec3<T>,
    /// dc/dt
    pub(crate) velocity: Vec3<T>,
    /// Its rotation: Q and T_s
    pub(crate) rotation: Rotation<T>,
    /// Omega_s, its material angular velocity
    pub(crate) omega: Vec3<T>,
    /// The derivative of Omega_s over the unknown P_s, weighted: s dOmega/dP + d dOmega/dPdot
    pub(crate) omega_derivative: Mat3<T>,
    /// Its place in the coordinates of the surface: the node's initial place
    pub(crate) origin: Vec3,
    /// True for a node with unknowns, the last two blocks of the system; false for a surface that is
    /// fixed or moved from outside
    pub(crate) is_node: bool,
}

impl<T: Real> Carrier<T> {
    /// The carrier of a fixed surface.
    pub fn ground() -> Self {
        let o = Vec3::zero();
        Self {
            place: o,
            velocity: o,
            rotation: Rotation::new(o),
            omega: o,
            omega_derivative: Mat3::zero(),
            origin: Vec3::ZERO,
            is_node: false,
        }
    }

    /// A place as the carrier sees it: Q^T (x - c).
    pub fn sees(&self, place: Vec3<T>) -> Vec3<T> {
        self.rotation.r.transpose_mul(place - self.place)
    }

    /// The point of the surface's coordinates at a place.
    pub fn on_surface(&self, place: Vec3<T>) -> Vec3<T> {
        self.sees(place) + Vec3::constant(self.origin)
    }
}

/// The place of a contact point on its element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// At a point of the element that stays
    Fixed,
    /// At the closest point, which moves along the element
    Closest,
}

/// The laws of a contact point, and its memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw {
    /// r, the radius of the section
    pub(crate) radius: f64,
    /// The normal force
    pub(crate) normal: NormalLaw,
    /// Friction; `None` without
    pub(crate) friction: Option<FrictionLaw>,
    /// The traction at the last converged state
    pub(crate) carried: CarriedTraction,
    /// The place of the point on its element
    pub(crate) place: Place,
    /// The part of the force that the point carries
    pub(crate) weight: f64,
}

/// The state of a contact point.
#[derive(Clone, Copy, Debug)]
pub struct PointState<T = f64> {
    /// g, the gap, a length
    pub(crate) gap: T,
    /// p and its derivatives
    pub(crate) normal_force: NormalForce<T>,
    /// n, in the axes of the carrier
    pub(crate) normal: Vec3<T>,
    /// t, the force of friction on the element, in the axes of the carrier, and its status
    pub(crate) traction: Traction<T>,
}

impl<T: Real> PointState<T> {
    /// The status of the point.
    pub fn status(&self) -> Status {
        if self.normal_force.is_open() { Status::Open } else { self.traction.status }
    }

    /// F = p n + t, the force on the element without the weight, in the axes of the carrier.
    pub fn force(&self) -> Vec3<T> {
        self.normal * self.normal_force.force + self.traction.force
    }
}

/// The motion of a point as its carrier sees it.
struct Seen<T> {
    /// y
    place: Vec3<T>,
    /// z = Q^T x'
    tangent: Vec3<T>,
    /// Q^T (xdot - cdot)
    velocity: Vec3<T>,
    /// dy/dt
    rate: Vec3<T>,
}

/// Adds the forces of a contact point to `out`, and the tangent of the weights: blocks x_1, P_1, …,
/// x_N, P_N, or x_1, …, x_N where it is not given how nodes are turned, and, for a carrier with unknowns, c, P_s.
/// `distance` is that of the surface at [`Carrier::on_surface`] of the point. Only friction needs how nodes are turned.
pub fn add_point<const N: usize, T: Real>(
    (nodes, turning): (&[ContactNode<T>; N], Option<&[NodeTurning<T>; N]>),
    shape: &ShapeAt<N, T>,
    carrier: &Carrier<T>,
    distance: &Distance<T>,
    law: &ContactLaw,
    weights: Weights,
    out: &mut ElementSystem<T>,
) -> PointState<T> {
    let seen = Seen::new(nodes, shape, carrier);
    let gap = distance.value - T::constant(law.radius);
    let normal_force = law.normal.force(gap, distance.normal.dot(seen.rate));
    let mut state = PointState { gap, normal_force, normal: distance.normal, traction: Traction::none() };
    let blocks = NodeBlocks::with(turning.is_some());
    if state.status() == Status::Open {
        return state;
    }
    match law.friction.as_ref().zip(turning) {
        None => {
            Point { nodes, blocks, shape, carrier, distance, law, seen, turned: None, state: &state }.add(weights, out);
        }
        Some((friction, turning)) => {
            let turned = &Turned::new(turning, shape, &carrier.rotation.r);
            let rolled = turned.angle.cross(law.carried.rolling_normal(distance.normal).value).scale(law.radius);
            let sliding = seen.place - turned.before(&shape.values) - rolled;
            state.traction = friction.traction(&law.carried, distance.normal, normal_force.force, sliding);
            let turned = Some(turned);
            Point { nodes, blocks, shape, carrier, distance, law, seen, turned, state: &state }.add(weights, out);
        }
    }
    state
}

impl<T: Real> Seen<T> {
    fn new<const N: usize>(nodes: &[ContactNode<T>; N], shape: &ShapeAt<N, T>, carrier: &Carrier<T>) -> Self {
        let q = &carrier.rotation.r;
        let place = carrier.sees(weighted_sum(&shape.values, |i| nodes[i].place));
        let tangent = q.transpose_mul(weighted_sum(&shape.slopes, |i| nodes[i].place));
        let velocity = q.transpose_mul(weighted_sum(&shape.values, |i| nodes[i].velocity) - carrier.velocity);
        Self { place, tangent, velocity, rate: velocity + place.cross(carrier.omega) }
    }
}

/// A contact point with a force.
struct Point<'a, const N: usize, T> {
    nodes: &'a [ContactNode<T>; N],
    blocks: NodeBlocks,
    shape: &'a ShapeAt<N, T>,
    carrier: &'a Carrier<T>,
    distance: &'a Distance<T>,
    law: &'a ContactLaw,
    seen: Seen<T>,
    turned: Option<&'a Turned<'a, N, T>>,
    state: &'a PointState<T>,
}

impl<const N: usize, T: Real> Point<'_, N, T> {
    /// The block of the carrier's displacements; the block of its rotation follows.
    const fn carrier_block(&self) -> usize {
        self.blocks.of(N)
    }

    fn add(&self, weights: Weights, out: &mut ElementSystem<T>) {
        let friction = self.traction();
        let force = self.force(&friction);
        let moment = self.moment(&friction);
        let arm = self.arm();
        for i in 0..N {
            self.node_forces(i, self.shape.values[i], force.value, moment.value, |row, f| out.add_force(row, f));
        }
        if self.carrier.is_node {
            let rotation = &self.carrier.rotation;
            out.add_force(self.carrier_block(), rotation.r * force.value);
            out.add_force(self.carrier_block() + 1, rotation.t.transpose_mul(arm.cross(force.value)));
        }
        if weights.stiffness == 0.0 && weights.damping == 0.0 {
            return;
        }
        self.add_columns(&force, &moment, weights, out);
        self.add_geometric(&force, &moment, weights.stiffness, out);
        if self.law.place == Place::Closest {
            self.add_moving(&force, &moment, weights.stiffness, out);
        }
    }

    /// b = y - r n
    fn arm(&self) -> Vec3<T> {
        self.seen.place - self.distance.normal.scale(self.law.radius)
    }

    /// F = p n + t
    fn force(&self, friction: &Derived<T>) -> Derived<T> {
        let n = self.distance.normal;
        let p = self.state.normal_force.force * self.law.weight;
        Derived {
            value: n * p + friction.value,
            over_place: self.distance.curvature * p + friction.over_place,
            over_pressure: n.scale(self.law.weight) + friction.over_pressure,
            ..*friction
        }
    }

    /// m = n x t; zero without friction
    fn moment(&self, friction: &Derived<T>) -> Derived<T> {
        if self.turned.is_none() {
            return Derived::zero();
        }
        let n = self.distance.normal;
        Derived {
            value: n.cross(friction.value),
            over_place: Mat3::skew_mul(n, friction.over_place)
                - Mat3::skew_mul(friction.value, self.distance.curvature),
            over_rolling: Mat3::skew_mul(n, friction.over_rolling),
            over_before: Mat3::skew_mul(n, friction.over_before),
            over_pressure: n.cross(friction.over_pressure),
        }
    }

    /// t, with da = dy - dy0 + r nr~ dtheta - r theta~ (dnr/dn) H dy; zero without friction.
    fn traction(&self) -> Derived<T> {
        let Some(turned) = self.turned else { return Derived::zero() };
        let t = &self.state.traction;
        let ContactLaw { radius: r, weight, .. } = *self.law;
        let n = self.distance.normal;
        let curvature = self.distance.curvature;
        let rolls_about = self.law.carried.rolling_normal(n);
        let slides = Mat3::identity() - Mat3::skew_mul(turned.angle.scale(r), rolls_about.over_normal * curvature);
        Derived {
            value: t.force.scale(weight),
            over_place: (t.over_sliding * slides + t.over_normal * curvature).scale(weight),
            over_rolling: (t.over_sliding * rolls_about.value.skew()).scale(weight),
            over_before: -t.over_sliding.scale(weight),
            over_pressure: t.over_pressure.scale(weight),
        }
    }

    /// The derivative of p over y, through the gap and its rate.
    fn pressure_over_place(&self) -> Vec3<T> {
        let n = self.distance.normal;
        let NormalForce { over_gap, over_rate, .. } = self.state.normal_force;
        n * over_gap + (self.distance.curvature * self.seen.rate + self.carrier.omega.cross(n)) * over_rate
    }

    /// Shows the forces on node `i` for the factor N_i (or its derivative).
    fn node_forces(&self, i: usize, factor: T, force: Vec3<T>, moment: Vec3<T>, mut show: impl FnMut(usize, Vec3<T>)) {
        show(self.blocks.of(i), -(self.carrier.rotation.r * force) * factor);
        if let Some(turned) = self.turned {
            let material = turned.rotations[i].transpose_mul(moment);
            show(
                self.blocks.of(i) + 1,
                turned.nodes[i].rotation.t.transpose_mul(material) * (factor * self.law.radius),
            );
        }
    }

    /// Adds the derivatives of F, m and b, without those of Q, T and S.
    fn add_columns(&self, force: &Derived<T>, moment: &Derived<T>, weights: Weights, out: &mut ElementSystem<T>) {
        let mut displacements = [(self.carrier_block(), -T::one()); MAX_NODES + 1];
        for i in 0..N {
            displacements[i] = (self.blocks.of(i), self.shape.values[i]);
            if let Some(column) = self.node_rotation(i, weights) {
                self.add_column(&[(self.blocks.of(i) + 1, T::one())], &column, force, moment, out);
            }
        }
        let count = if self.carrier.is_node { N + 1 } else { N };
        self.add_column(&displacements[..count], &self.displacement(weights), force, moment, out);
        if self.carrier.is_node {
            self.add_column(
                &[(self.carrier_block() + 1, T::one())],
                &self.carrier_rotation(weights),
                force,
                moment,
                out,
            );
        }
    }

    /// The column of a displacement of the point.
    fn displacement(&self, weights: Weights) -> Column<T> {
        let moved = self.carrier.rotation.r.transpose();
        let by_rate = self.distance.normal * self.state.normal_force.over_rate;
        let pressure = self.pressure_over_place().scale(weights.stiffness) + by_rate.scale(weights.damping);
        Column { place: moved.scale(weights.stiffness), rolling: Mat3::zero(), pressure: moved.transpose() * pressure }
    }

    /// The column of the rotation of node `i`; `None` without friction.
    fn node_rotation(&self, i: usize, weights: Weights) -> Option<Column<T>> {
        let turned = self.turned?;
        let spun = turned.maps[i] * (turned.rotations[i] * turned.nodes[i].rotation.t);
        let rolling = spun * (self.shape.values[i] * (weights.stiffness * self.law.radius));
        Some(Column { place: Mat3::zero(), rolling, pressure: Vec3::zero() })
    }

    /// The column of the rotation of the carrier.
    fn carrier_rotation(&self, weights: Weights) -> Column<T> {
        let n = self.distance.normal;
        let t = self.carrier.rotation.t.scale(weights.stiffness);
        let place = Mat3::skew_mul(self.seen.place, t);
        let mut rolling = Mat3::zero();
        if let Some(turned) = self.turned {
            for i in 0..N {
                rolling -= turned.maps[i] * t * (self.shape.values[i] * self.law.radius);
            }
        }
        let by_spin = t.transpose_mul(n.cross(self.seen.velocity))
            + self.carrier.omega_derivative.transpose_mul(n.cross(self.seen.place));
        let pressure = place.transpose_mul(self.pressure_over_place()) + by_spin * self.state.normal_force.over_rate;
        Column { place, rolling, pressure }
    }

    /// Adds a column to blocks, each times its factor.
    fn add_column(
        &self,
        blocks: &[(usize, T)],
        column: &Column<T>,
        force: &Derived<T>,
        moment: &Derived<T>,
        out: &mut ElementSystem<T>,
    ) {
        let carrier = &self.carrier.rotation;
        let d_force = force.over(column);
        let spatial = carrier.r * d_force;
        let mut add =
            |row: usize, of_row: Mat3<T>| blocks.iter().for_each(|&(block, f)| out.add_tangent(row, block, of_row * f));
        for i in 0..N {
            add(self.blocks.of(i), -spatial * self.shape.values[i]);
        }
        if let Some(turned) = self.turned {
            let d_moment = moment.over(column);
            for i in 0..N {
                let factor = self.shape.values[i] * self.law.radius;
                let material = turned.rotations[i].transpose_matmul(d_moment);
                add(self.blocks.of(i) + 1, turned.nodes[i].rotation.t.transpose_matmul(material) * factor);
            }
        }
        if self.carrier.is_node {
            let d_arm = column.place - self.distance.curvature * column.place.scale(self.law.radius);
            let turned = Mat3::skew_mul(self.arm(), d_force) - Mat3::skew_mul(force.value, d_arm);
            add(self.carrier_block(), spatial);
            add(self.carrier_block() + 1, carrier.t.transpose_matmul(turned));
        }
    }

    /// Adds the derivatives of Q, T and S at constant F, m and b.
    fn add_geometric(&self, force: &Derived<T>, moment: &Derived<T>, weight: f64, out: &mut ElementSystem<T>) {
        let carrier = &self.carrier.rotation;
        if self.carrier.is_node {
            let turned = carrier.r * Mat3::skew_mul(force.value, carrier.t.scale(weight));
            for i in 0..N {
                out.add_tangent(self.blocks.of(i), self.carrier_block() + 1, turned * self.shape.values[i]);
            }
            out.add_tangent(self.carrier_block(), self.carrier_block() + 1, -turned);
            let about = carrier.c2(self.arm().cross(force.value)).scale(weight);
            out.add_tangent(self.carrier_block() + 1, self.carrier_block() + 1, about);
        }
        let Some(turned) = self.turned else { return };
        let m = moment.value;
        for i in 0..N {
            let factor = self.shape.values[i] * (self.law.radius * weight);
            let node = &turned.nodes[i].rotation;
            let s = &turned.rotations[i];
            let back = node.t.transpose() * s.transpose() * factor;
            let own = back * Mat3::skew_mul(m, *s * node.t) + node.c2(s.transpose_mul(m)) * factor;
            out.add_tangent(self.blocks.of(i) + 1, self.blocks.of(i) + 1, own);
            if self.carrier.is_node {
                out.add_tangent(
                    self.blocks.of(i) + 1,
                    self.carrier_block() + 1,
                    -(back * Mat3::skew_mul(m, carrier.t)),
                );
            }
        }
    }

    /// Adds -f_s F_sq/F_ss, unless F_ss is not positive.
    fn add_moving(&self, force: &Derived<T>, moment: &Derived<T>, weight: f64, out: &mut ElementSystem<T>) {
        let q = &self.carrier.rotation.r;
        let n = self.distance.normal;
        let z = self.seen.tangent;
        let bent = self.distance.curvature * z;
        let second = weighted_sum(&self.shape.bends, |i| self.nodes[i].place);
        let f_ss = n.dot(q.transpose_mul(second)) + z.dot(bent);
        if f_ss.largest() <= 0.0 {
            return;
        }
        let factor = T::constant(-weight) / f_ss;
        let mut columns = [(0, Vec3::zero()); MAX_COLUMNS];
        let mut count = 0;
        for i in 0..N {
            let f_sq = *q * (bent * self.shape.values[i] + n * self.shape.slopes[i]);
            columns[count] = (self.blocks.of(i), f_sq * factor);
            count += 1;
        }
        if self.carrier.is_node {
            let turned = self.seen.place.cross(bent) + z.cross(n);
            columns[count] = (self.carrier_block(), -(*q * bent) * factor);
            columns[count + 1] = (self.carrier_block() + 1, -self.carrier.rotation.t.transpose_mul(turned) * factor);
            count += 2;
        }
        let columns = &columns[..count];
        self.along(force, moment, |row, f_s| {
            columns.iter().for_each(|(column, f_sq)| out.add_tangent(row, *column, f_s.outer(*f_sq)));
        });
    }

    /// Shows f_s, the derivatives of the forces over s.
    fn along(&self, force: &Derived<T>, moment: &Derived<T>, mut show: impl FnMut(usize, Vec3<T>)) {
        let change = self.change_along();
        let d_force = force.by(&change);
        let d_moment = moment.by(&change);
        for i in 0..N {
            self.node_forces(i, self.shape.slopes[i], force.value, moment.value, &mut show);
            self.node_forces(i, self.shape.values[i], d_force, d_moment, &mut show);
        }
        if self.carrier.is_node {
            let carrier = &self.carrier.rotation;
            let d_arm = change.place - self.distance.curvature * change.place.scale(self.law.radius);
            let turned = d_arm.cross(force.value) + self.arm().cross(d_force);
            show(self.carrier_block(), carrier.r * d_force);
            show(self.carrier_block() + 1, carrier.t.transpose_mul(turned));
        }
    }

    /// Derivatives over s of what forces depend on.
    fn change_along(&self) -> Change<T> {
        let slopes = &self.shape.slopes;
        let turned = self.turned;
        let velocity = weighted_sum(slopes, |i| self.nodes[i].velocity);
        let faster = self.distance.normal.dot(self.carrier.rotation.r.transpose_mul(velocity));
        Change {
            place: self.seen.tangent,
            rolling: weighted_sum(slopes, |i| turned.map_or(Vec3::zero(), |turned| turned.angles[i]))
                .scale(self.law.radius),
            before: turned.map_or(Vec3::zero(), |turned| turned.before(slopes)),
            pressure: self.pressure_over_place().dot(self.seen.tangent) + faster * self.state.normal_force.over_rate,
        }
    }
}

/// Blocks over which the place of a closest point has derivatives: displacements of four nodes, and
/// both blocks of the carrier.
const MAX_COLUMNS: usize = MAX_NODES + 2;
