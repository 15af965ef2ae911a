//! Planar beams: two displacements and an angle at each node, in the axes of the plane.
//!
//! Rotations about one axis have T = 1, and the strains of Makinen 2007, section 3, become
//!
//! ```text
//! y = R(theta)^T x',   Gamma = y - E1,   K = theta',   N = Cn Gamma + cc K,   M = cc.Gamma + cm K
//! ```
//!
//! Rotation vectors and angles are interpolated alike, so that `total` and `relative` elements
//! agree.

use super::beam::StiffnessPoint;
use super::element::Weights;
use super::inertia::Inertia;
use super::law::{PlanarLaw, PlanarLinear, PlanarStiffness, PlanarStrain, PlanarStress, StoredLaw, Stress};
use super::relative::carriers;
use crate::rotation::Series;
use crate::scalar::{LANES, Lanes, Pack, Real, pack};
use crate::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

/// An integration point for internal forces, see [`StiffnessPoint`].
#[derive(Clone, Copy, Debug)]
pub struct PlanarPoint<const N: usize, T = f64, P = PlanarLinear<T>> {
    /// Shape functions
    pub shape: [T; N],
    /// Derivatives of the shape functions over initial arc length, 1/length
    pub slope: [T; N],
    /// Gauss weight times ds/dxi, a length
    pub weight: T,
    /// E1, the unit tangent of the initial centre line
    pub tangent: [T; 2],
    /// The law of the section in the axes of the plane
    pub law: P,
    /// Free strain, which makes no stress, at an amplitude of one: Gamma and K. `None` where there
    /// is none
    pub free: Option<PlanarStrain<T>>,
}

/// Displacement and angle of a node, or their increments.
#[derive(Clone, Copy, Debug)]
pub struct PlanarNode<T = f64> {
    /// Displacement along the two axes of the plane
    pub u: [T; 2],
    /// Angle about the normal of the plane, radians
    pub angle: T,
}

/// Force and tangent of an element in a plane.
#[derive(Clone, Copy, Debug)]
pub struct PlanarSystem<const N: usize, T = f64> {
    /// Two forces and a moment for each node
    pub force: [[T; 3]; N],
    /// The 3x3 tile of each pair of nodes, by columns
    pub tangent: [[[T; 9]; N]; N],
}

impl<const N: usize, T: Real> PlanarSystem<N, T> {
    /// No force, and no tangent.
    #[inline(always)]
    pub fn zero() -> Self {
        Self { force: [[T::zero(); 3]; N], tangent: [[[T::zero(); 9]; N]; N] }
    }

    /// Sets the force to zero and, if the weight of the stiffness is not zero, the tangent, so that
    /// both can be summed up.
    #[inline(always)]
    pub fn clear_for(&mut self, stiffness: f64) {
        for force in &mut self.force {
            *force = [T::zero(); 3];
        }
        if stiffness != 0.0 {
            for tile in self.tangent.as_flattened_mut() {
                *tile = [T::zero(); 9];
            }
        }
    }

    /// Forces and moments of the nodes (global components); the plane's axes are the columns of
    /// `axes`.
    #[inline(always)]
    pub fn forces_in_space(&self, axes: &Mat3) -> [[Vec3<T>; 2]; N] {
        let [a, b, e] = [0, 1, 2].map(|k| axes.column(k));
        let mut out = [[Vec3::zero(); 2]; N];
        for i in 0..N {
            let [x, y, moment] = self.force[i];
            for k in 0..3 {
                out[i][0].0[k] = x * a.0[k] + y * b.0[k];
                out[i][1].0[k] = moment * e.0[k];
            }
        }
        out
    }
}

impl<const N: usize, P: PlanarLaw<f64>> PlanarPoint<N, f64, P> {
    /// The in-plane part of a point, for the plane with these axes (columns, the third one normal).
    pub fn new<L: StoredLaw<InPlane = P>>(point: &StiffnessPoint<N, f64, L>, axes: &Mat3) -> Self {
        let in_plane = |v: Vec3| {
            let [x, y, _] = axes.transpose_mul(v).0;
            [x, y]
        };
        Self {
            shape: point.shape,
            slope: point.slope,
            weight: point.weight,
            tangent: in_plane(point.tangent),
            law: point.law.in_plane(axes),
            free: point.free.map(|free| {
                let [x, y] = in_plane(free.gamma);
                [x, y, axes.column(2).dot(free.kappa)]
            }),
        }
    }
}

impl<const N: usize, P: PlanarLaw<f64> + Pack> Pack for PlanarPoint<N, f64, P> {
    type Packed = PlanarPoint<N, Lanes, P::Packed>;

    fn pack(of: [&Self; LANES]) -> Self::Packed {
        PlanarPoint {
            shape: pack!(of.shape),
            slope: pack!(of.slope),
            weight: pack!(of.weight),
            tangent: pack!(of.tangent),
            law: pack!(of.law),
            free: pack!(of.free),
        }
    }
}

/// Removes whole turns by which the charts of the nodes differ: afterwards each angle is within pi
/// of the frame that turns with the element. The ends of an element may turn by more than pi
/// against each other, as in space.
#[inline(always)]
pub fn in_one_turn<const N: usize, T: Real>(nodes: &mut [PlanarNode<T>; N]) {
    let (first, last) = carriers(N);
    nodes[last].angle = within_half_a_turn(nodes[last].angle, nodes[first].angle);
    let frame = (nodes[first].angle + nodes[last].angle) * 0.5;
    for i in 0..N {
        if i != first && i != last {
            nodes[i].angle = within_half_a_turn(nodes[i].angle, frame);
        }
    }
}

/// The angle, one turn more or less if that brings it within pi of the angle `of`.
#[inline(always)]
fn within_half_a_turn<T: Real>(angle: T, of: T) -> T {
    let ahead = angle - of;
    let turn = T::constant(2.0 * PI);
    angle - (ahead.above(PI, turn, T::zero()) - (-ahead).above(PI, turn, T::zero()))
}

/// The in-plane configuration at a point.
struct Configuration<T> {
    /// Cosine and sine of the angle of the section
    turn: [T; 2],
    /// x' in the axes of the turned section
    y: [T; 2],
    /// Elastic strain: the strain less its free part
    elastic: PlanarStrain<T>,
}

impl<const N: usize, T: Real, P: PlanarLaw<T>> PlanarPoint<N, T, P> {
    #[inline(always)]
    fn sum(&self, of: &[T; N], value: impl Fn(usize) -> T) -> T {
        let mut sum = of[0] * value(0);
        for i in 1..N {
            sum += of[i] * value(i);
        }
        sum
    }

    #[inline(always)]
    fn configuration(&self, nodes: &[PlanarNode<T>; N], free: T) -> Configuration<T> {
        let angle = self.sum(&self.shape, |i| nodes[i].angle);
        let [cos, over_angle, ..] = Series::at(angle * angle).0;
        let sin = over_angle * angle;
        let x = self.tangent[0] + self.sum(&self.slope, |i| nodes[i].u[0]);
        let z = self.tangent[1] + self.sum(&self.slope, |i| nodes[i].u[1]);
        let y = [cos * x + sin * z, cos * z - sin * x];
        let mut strain = [y[0] - self.tangent[0], y[1] - self.tangent[1], self.sum(&self.slope, |i| nodes[i].angle)];
        if let Some(own) = &self.free {
            for k in 0..3 {
                strain[k] -= own[k] * free;
            }
        }
        Configuration { turn: [cos, sin], y, elastic: strain }
    }

    /// Adds the internal force and, where `weight` is not zero, `weight` times the stiffness.
    ///
    /// `free` is the amplitude of the free strain; `geometric` the stress of the geometric part, if
    /// it is not the stress of this configuration.
    #[inline(always)]
    pub fn add(
        &self,
        nodes: &[PlanarNode<T>; N],
        free: T,
        geometric: Option<&PlanarStress<T>>,
        weight: f64,
        out: &mut PlanarSystem<N, T>,
    ) {
        let at = self.configuration(nodes, free);
        let stress = self.law.stress(&at.elastic);
        let [cos, sin] = at.turn;
        let [y1, y2] = at.y;
        let [n1, n2, m] = stress;
        // f_x' = R N, f_theta = (N x y).e, f_theta' = M
        let fx = cos * n1 - sin * n2;
        let fy = sin * n1 + cos * n2;
        let f_angle = n1 * y2 - n2 * y1;
        for i in 0..N {
            let n = self.shape[i] * self.weight;
            let s = self.slope[i] * self.weight;
            let force = &mut out.force[i];
            force[0] += fx * s;
            force[1] += fy * s;
            force[2] += f_angle * n + m * s;
        }
        if weight != 0.0 {
            self.add_stiffness(&at, geometric.unwrap_or(&stress), weight, out);
        }
    }

    /// Adds `weight` times the stiffness, with e the normal and A = y x e:
    ///
    /// ```text
    /// K_xx = R Cn R^T,   K_x theta = R (Cn A - N x e)
    /// K_theta theta = A.Cn A - N.y,   K_theta' theta' = cm
    /// K_x theta' = R cc,   K_theta' theta = cc.A    (where the section couples)
    /// ```
    #[inline(always)]
    fn add_stiffness(
        &self,
        at: &Configuration<T>,
        stress: &PlanarStress<T>,
        weight: f64,
        out: &mut PlanarSystem<N, T>,
    ) {
        let [cos, sin] = at.turn;
        let [y1, y2] = at.y;
        let [n1, n2, _] = *stress;
        let PlanarStiffness { cn: [c1, c2, c12], cm, cc } = self.law.tangent(&at.elastic);
        let turned = |v: [T; 2]| [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1]];
        let first = turned([c1 * cos - c12 * sin, c12 * cos - c2 * sin]);
        let second = turned([c1 * sin + c12 * cos, c12 * sin + c2 * cos]);
        let cn_a = [c1 * y2 - c12 * y1, c12 * y2 - c2 * y1];
        let x_angle = turned([cn_a[0] - n2, cn_a[1] + n1]);
        let angle_angle = y2 * cn_a[0] - y1 * cn_a[1] - (n1 * y1 + n2 * y2);
        let coupled = cc.map(|[a, b]| (turned([a, b]), a * y2 - b * y1));
        let w = self.weight * weight;
        for i in 0..N {
            for j in 0..N {
                let n = [self.shape[i], self.shape[j]];
                let s = [self.slope[i] * w, self.slope[j]];
                let ss = s[0] * s[1];
                let sn = s[0] * n[1];
                let ns = n[0] * w * s[1];
                let nn = n[0] * w * n[1];
                let tile = &mut out.tangent[i][j];
                tile[0] += first[0] * ss;
                tile[1] += first[1] * ss;
                tile[2] += x_angle[0] * ns;
                tile[3] += first[1] * ss;
                tile[4] += second[1] * ss;
                tile[5] += x_angle[1] * ns;
                tile[6] += x_angle[0] * sn;
                tile[7] += x_angle[1] * sn;
                tile[8] += cm * ss + angle_angle * nn;
                if let Some(([x, y], bent)) = coupled {
                    tile[2] += x * ss;
                    tile[5] += y * ss;
                    tile[6] += x * ss;
                    tile[7] += y * ss;
                    tile[8] += bent * (sn + ns);
                }
            }
        }
    }

    /// The stress extrapolated over the correction `change` of the nodes: that of the linearised
    /// strain, strain + B dq.
    #[inline(always)]
    pub fn extrapolated_stress(
        &self,
        nodes: &[PlanarNode<T>; N],
        free: T,
        change: &[PlanarNode<T>; N],
    ) -> PlanarStress<T> {
        let Configuration { turn: [cos, sin], y, elastic: [x, z, kappa] } = self.configuration(nodes, free);
        let along = [0, 1].map(|k| self.sum(&self.slope, |i| change[i].u[k]));
        let turned = self.sum(&self.shape, |i| change[i].angle);
        self.law.stress(&[
            x + cos * along[0] + sin * along[1] + y[1] * turned,
            z + cos * along[1] - sin * along[0] - y[0] * turned,
            kappa + self.sum(&self.slope, |i| change[i].angle),
        ])
    }
}

/// The mass properties of a body at its node, in the axes of the plane.
#[derive(Clone, Copy, Debug)]
pub struct PlanarBody<T = f64> {
    /// Mass
    mass: T,
    /// The vector from the node to the mass centre in the initial placement
    offset: [T; 2],
    /// J0: moment of inertia about the normal of the plane through the node
    about_node: T,
}

impl PlanarBody {
    /// The in-plane part of mass properties, for the plane with these axes (columns, the third one
    /// normal).
    pub fn new(inertia: &Inertia, axes: &Mat3) -> Self {
        let [x, y, _] = axes.transpose_mul(inertia.offset).0;
        let normal = axes.column(2);
        Self { mass: inertia.mass, offset: [x, y], about_node: normal.dot(inertia.about_node * normal) }
    }
}

impl Pack for PlanarBody {
    type Packed = PlanarBody<Lanes>;

    fn pack(of: [&Self; LANES]) -> Self::Packed {
        PlanarBody { mass: pack!(of.mass), offset: pack!(of.offset), about_node: pack!(of.about_node) }
    }
}

impl<T: Real> PlanarBody<T> {
    /// Force and tangent of the inertia of a body in a plane. With the spin w and its rate w', d
    /// the present (spatial) offset, and e the normal
    ///
    /// ```text
    /// f_u = m (u'' + w' e x d - w^2 d),   f_theta = J0 w' + m (d x u'').e
    /// ```
    ///
    /// `acceleration` is u'', and `spins` are w and w'.
    #[inline(always)]
    pub fn evaluate(&self, acceleration: [T; 2], angle: T, spins: [T; 2], weights: Weights) -> PlanarSystem<1, T> {
        let [ax, ay] = acceleration;
        let [w, rate] = spins;
        let m = self.mass;
        let [cos, over_angle, ..] = Series::at(angle * angle).0;
        let sin = over_angle * angle;
        let [x, y] = self.offset;
        let dx = cos * x - sin * y;
        let dy = sin * x + cos * y;
        let mut out = PlanarSystem::zero();
        let square = w * w;
        out.force[0] = [
            m * (ax - rate * dy - square * dx),
            m * (ay + rate * dx - square * dy),
            self.about_node * rate + m * (dx * ay - dy * ax),
        ];
        if weights == Weights::NONE {
            return out;
        }
        let Weights { stiffness, damping, mass } = weights;
        // The variation of the offset is dd = dtheta e x d.
        let twice = w * (2.0 * damping);
        let over_x = (square * dy - rate * dx) * stiffness - twice * dx - dy * mass;
        let over_y = -(rate * dy + square * dx) * stiffness - twice * dy + dx * mass;
        let tile = &mut out.tangent[0][0];
        tile[0] = m * mass;
        tile[4] = m * mass;
        tile[2] = -(m * dy) * mass;
        tile[5] = m * dx * mass;
        tile[6] = m * over_x;
        tile[7] = m * over_y;
        tile[8] = self.about_node * mass - m * (dx * ax + dy * ay) * stiffness;
        out
    }
}

/// The in-plane part of a stress in space; the plane's axes are the columns of `axes`, the third
/// one normal.
#[inline(always)]
pub fn flattened<T: Real>(stress: &Stress<T>, axes: &Mat3) -> PlanarStress<T> {
    let along = |v: &Vec3<T>, k: usize| {
        let axis = axes.column(k);
        v.0[0] * axis.0[0] + v.0[1] * axis.0[1] + v.0[2] * axis.0[2]
    };
    [along(&stress.n, 0), along(&stress.n, 1), along(&stress.m, 2)]
}

/// A stress of the plane as a stress in space, in global components; the plane's axes are the
/// columns of `axes`.
#[inline(always)]
pub fn in_space<T: Real>([x, y, m]: PlanarStress<T>, axes: &Mat3) -> Stress<T> {
    let [a, b, e] = [0, 1, 2].map(|k| axes.column(k));
    let mut out = Stress { n: Vec3::zero(), m: Vec3::zero() };
    for k in 0..3 {
        out.n.0[k] = x * a.0[k] + y * b.0[k];
        out.m.0[k] = m * e.0[k];
    }
    out
}
