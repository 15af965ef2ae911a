//! The `relative` interpolation: elements in a frame that turns with them.
//!
//! Strains of interpolated total rotation vectors depend on the charts of the nodes and so on rigid
//! rotations of the element (they are not objective). Here rotations are first measured from a
//! frame R_r that turns with the element, and only these relative rotations are interpolated
//! (Crisfield & Jelenic 1999, doi:10.1098/rspa.1999.0352):
//!
//! ```text
//! Theta_i = log(R_r^T R_i),   R(s) = R_r exp(sum N_i Theta_i),   xi_i = R_r^T x_i
//! ```
//!
//! In the frame the element is the total Lagrangian one, with nodes (xi_i, Theta_i); its forces and
//! tangent are then carried back. R_r is the rotation of the middle node, or the rotation half way
//! between the two middle nodes.
//!
//! With material spins t_i of the nodes, t of the frame, A_i = T(Theta_i)^-1 and x~ the skew tensor
//! of x:
//!
//! ```text
//! dxi_i = R_r^T dx_i + xi_i~ t,   dTheta_i = A_i t_i - A_i^T t,   t = sum F_i t_i
//! ```

use super::element::{ElementSystem, NodePlace};
use crate::rotation::{Rotation, Series, log};
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// An element of N nodes seen from its own frame.
pub struct Relative<const N: usize, T = f64> {
    /// The nodes in the frame: u = xi - X and P = Theta
    pub nodes: [NodePlace<T>; N],
    /// R_r
    pub(super) frame: Mat3<T>,
    /// xi_i, measured from the first node that carries the frame
    pub(super) arms: [Vec3<T>; N],
    /// The rotations of the vectors Theta_i
    turned: [Rotation<T>; N],
    /// A_i
    back: [Mat3<T>; N],
    pub(super) half: Half<T>,
}

/// The frame half way between two nodes: h is half the rotation vector from the first node to the
/// second.
#[derive(Clone, Copy)]
pub(super) struct Half<T> {
    /// The rotation of h
    pub(super) rotation: Rotation<T>,
    /// c = tan(h/2) / (2h)
    c: T,
    /// dc/dz over z = h.h
    c_slope: T,
}

/// The nodes that carry the frame: of two and four nodes the two in the middle, of three the middle
/// one.
pub(super) const fn carriers(nodes: usize) -> (usize, usize) {
    ((nodes - 1) / 2, nodes / 2)
}

impl<T: Real> Half<T> {
    #[inline(always)]
    fn new(h: Vec3<T>) -> Self {
        let [_, f1, f2, f3, f4, ..] = Series::at(h.squared()).0;
        // 2 df_m/dz = m f_{m+2} - f_{m+1}
        let d1 = (f3 - f2) * 0.5;
        let d2 = (f4 * 2.0 - f3) * 0.5;
        let c = f2 / f1 * 0.5;
        Self { rotation: Rotation::new(h), c, c_slope: (d2 * f1 - f2 * d1) / (f1 * f1) * 0.5 }
    }

    /// F_i, which takes the material spin of the first node, or of the `second`, to the spin of the
    /// frame.
    #[inline(always)]
    pub fn follows(&self, second: bool) -> Mat3<T> {
        let Rotation { r, p: h, .. } = self.rotation;
        let c = self.c;
        let even = Mat3::identity().scale(0.5);
        let odd = h.skew() * c;
        if second { (even - odd) * r } else { (even + odd) * r.transpose() }
    }

    /// The derivatives of F_i^T m over h, for a fixed m:
    ///
    /// ```text
    /// F_1^T m = exp(h) (m/2 - c h x m),   F_2^T m = exp(h)^T (m/2 + c h x m)
    /// ```
    #[inline(always)]
    pub fn turned(&self, m: Vec3<T>) -> [Mat3<T>; 2] {
        let Self { rotation: Rotation { r, t, p: h, .. }, c, c_slope } = *self;
        let across = h.cross(m);
        let bend = across.outer(h) * (c_slope * 2.0) - m.skew() * c;
        let g1 = m.scale(0.5) - across * c;
        let g2 = m.scale(0.5) + across * c;
        [r * (-Mat3::skew_mul(g1, t) - bend), r.transpose_matmul(Mat3::skew_mul(g2, t.transpose()) + bend)]
    }
}

impl<const N: usize, T: Real> Relative<N, T> {
    /// The element with nodes that started at `places`, have moved by `u` and turned by
    /// `rotations`.
    #[inline(always)]
    pub fn new(places: &[Vec3<T>; N], u: &[Vec3<T>; N], rotations: &[Rotation<T>; N]) -> Self {
        let (first, last) = carriers(N);
        let a = rotations[first].r;
        let b = rotations[last].r;
        let h = if first == last { Vec3::zero() } else { log(a.transpose_matmul(b)).scale(0.5) };
        let half = Half::new(h);
        let frame = if first == last { a } else { a * half.rotation.r };
        // Relative to the frame the two nodes that carry it have the rotation vectors -h and h.
        let mut turned = [half.rotation; N];
        let inverse = half.rotation.t_inverse();
        let mut back = [inverse; N];
        let mut nodes = [NodePlace::rest(); N];
        let mut arms = [Vec3::zero(); N];
        for i in 0..N {
            if i != first && i != last {
                turned[i] = Rotation::new(log(frame.transpose_matmul(rotations[i].r)));
                back[i] = turned[i].t_inverse();
            } else if i != last {
                turned[i] = half.rotation.reversed();
                back[i] = inverse.transpose();
            }
            let start = places[i] - places[first];
            arms[i] = frame.transpose_mul(start + (u[i] - u[first]));
            nodes[i].u = arms[i] - start;
            nodes[i].p = turned[i].p;
        }
        Self { nodes, frame, arms, turned, back, half }
    }

    /// F_i, which takes the material spin of node i to the spin of the frame; `None` for a node
    /// that does not carry the frame.
    #[inline(always)]
    fn follows(&self, i: usize) -> Option<Mat3<T>> {
        let (first, last) = carriers(N);
        if i != first && i != last {
            return None;
        }
        if first == last {
            return Some(Mat3::identity());
        }
        Some(self.half.follows(i == last))
    }

    /// Variations of u and Theta in the frame when the nodes move by `du` and spin by `spins`
    /// (material).
    #[inline(always)]
    pub fn variation(&self, du: &[Vec3<T>; N], spins: &[Vec3<T>; N]) -> [(Vec3<T>, Vec3<T>); N] {
        let (first, _) = carriers(N);
        let mut frame_spin = Vec3::zero();
        for (i, &spin) in spins.iter().enumerate() {
            if let Some(follows) = self.follows(i) {
                frame_spin += follows * spin;
            }
        }
        let mut out = [(Vec3::zero(), Vec3::zero()); N];
        for i in 0..N {
            let moved = self.frame.transpose_mul(du[i] - du[first]) + self.arms[i].cross(frame_spin);
            out[i] = (moved, self.back[i] * spins[i] - self.back[i].transpose_mul(frame_spin));
        }
        out
    }

    /// The rotation at the shape functions `shape`: R_r exp(sum N_i Theta_i).
    pub fn rotation(&self, shape: impl Fn(usize) -> f64) -> Mat3<T> {
        let theta = (0..N).fold(Vec3::zero(), |sum, i| sum + self.nodes[i].p.scale(shape(i)));
        self.frame * Rotation::new(theta).r
    }

    /// Carries force and tangent of the element in its frame (`local`, whose tangent is symmetric)
    /// back to the nodes, and overwrites `out` with them.
    ///
    /// `stiffness` is the weight of the tangent; zero asks for forces alone. `geometric` holds the
    /// forces in the frame that form the geometric parts, if they are not those of `local`.
    #[inline(always)]
    pub fn carry_back(
        &self,
        rotations: &[Rotation<T>; N],
        local: &ElementSystem<T>,
        geometric: Option<&ElementSystem<T>>,
        stiffness: f64,
        out: &mut ElementSystem<T>,
    ) {
        let forces = self.spin_forces(local);
        for i in 0..N {
            out.set_force(2 * i, forces.displacement[i]);
            out.set_force(2 * i + 1, rotations[i].t.transpose_mul(forces.spin[i]));
        }
        if stiffness != 0.0 {
            let source = geometric.unwrap_or(local);
            self.carry_tangent_back(rotations, local, source, &self.spin_forces(source), stiffness, out);
        }
    }

    /// Forces conjugate to displacements and material spins of the nodes:
    ///
    /// ```text
    /// m_i = A_i^T f_Theta_i,   m = sum f_xi_i x xi_i - A_i f_Theta_i
    /// f_x_i = R_r f_xi_i,   f_t_i = m_i + F_i^T m
    /// ```
    #[inline(always)]
    fn spin_forces(&self, local: &ElementSystem<T>) -> SpinForces<N, T> {
        let none = [Vec3::zero(); N];
        let mut out = SpinForces { displacement: none, spin: none, own: none, frame: Vec3::zero() };
        for i in 0..N {
            let force = local.force_block(2 * i);
            let moment = local.force_block(2 * i + 1);
            out.displacement[i] = self.frame * force;
            out.own[i] = self.back[i].transpose_mul(moment);
            out.frame += force.cross(self.arms[i]) - self.back[i] * moment;
        }
        for i in 0..N {
            out.spin[i] = out.own[i];
            if let Some(follows) = self.follows(i) {
                out.spin[i] += follows.transpose_mul(out.frame);
            }
        }
        out
    }

    /// Writes the tangent: the second variation in displacements and spins of the nodes and of the
    /// frame, with the spin of the frame replaced by those of the nodes, and spins by rotation
    /// vectors (T_i).
    #[inline(always)]
    fn carry_tangent_back(
        &self,
        rotations: &[Rotation<T>; N],
        local: &ElementSystem<T>,
        source: &ElementSystem<T>,
        forces: &SpinForces<N, T>,
        s: f64,
        out: &mut ElementSystem<T>,
    ) {
        let over = self.over_frame(local, source, forces, s);
        let drift = self.drift(rotations, forces.frame, s);
        // Variations over each node's rotation vector: dTheta_i = own_i dP_i - ..., t = following_i
        // dP_i.
        let mut own = self.back;
        let mut spin = over.spin;
        let mut row = over.row;
        let mut following = [None; N];
        for i in 0..N {
            let t = rotations[i].t;
            own[i] = self.back[i] * t;
            spin[i] = t.transpose_matmul(over.spin[i]);
            // The row of the frame over each rotation vector, the contribution through its own spin
            // included.
            row[i] = over.row[i] * t;
            if let Some(follows) = self.follows(i) {
                let follows = follows * t;
                row[i] += over.frame * follows;
                following[i] = Some(follows);
            }
        }
        for i in 0..N {
            for j in 0..N {
                let mut xp = self.frame * (local.tangent_block(2 * i, 2 * j + 1) * own[j]);
                if let Some(following) = following[j] {
                    xp += over.displacement[i] * following;
                }
                out.set_symmetric(2 * i, 2 * j + 1, &xp);
                if j < i {
                    continue;
                }
                let xx = self.frame * local.tangent_block(2 * i, 2 * j) * self.frame.transpose();
                let mut pp = own[i].transpose_matmul(local.tangent_block(2 * i + 1, 2 * j + 1) * own[j]);
                if let Some(following) = following[j] {
                    pp += spin[i] * following;
                }
                if let Some(following) = following[i] {
                    pp += following.transpose_matmul(row[j]);
                }
                if let Some(drift) = drift.between(i, j) {
                    pp += drift;
                }
                if i == j {
                    pp += rotations[i].c2(forces.spin[i]).scale(s) - own[i].transpose_matmul(over.own[i] * own[i]);
                }
                match j > i {
                    true => {
                        out.set_symmetric(2 * i, 2 * j, &xx);
                        out.set_symmetric(2 * i + 1, 2 * j + 1, &pp);
                    }
                    false => {
                        out.set_tangent(2 * i, 2 * j, &xx);
                        out.set_tangent(2 * i + 1, 2 * j + 1, &pp);
                    }
                }
            }
        }
    }

    /// The blocks that involve the spin of the frame. With Z_i the derivatives of the forces in the
    /// frame over it,
    ///
    /// ```text
    /// Z_xi = sum K_xi_x ij xi_j~ - K_xi_Theta ij A_j^T
    /// Z_Theta = sum K_Theta_x ij xi_j~ - K_Theta_Theta ij A_j^T
    /// x_i,t: R_r (Z_xi - f_xi~)
    /// t_i,t: A_i^T (Z_Theta + C2(m_i) A_i^T)
    /// t,t_j: Z_Theta^T A_j + A_j C1(A_j f) A_j
    /// t,t:   sum -xi_i~ Z_xi + f_xi~ xi_i~ - A_i Z_Theta - A_i C1(A_i f) A_i^T
    /// Theta_i,Theta_i: - C2(m_i) (`own`)
    /// ```
    #[inline(always)]
    fn over_frame(
        &self,
        local: &ElementSystem<T>,
        source: &ElementSystem<T>,
        forces: &SpinForces<N, T>,
        s: f64,
    ) -> OverFrame<N, T> {
        let zero = [Mat3::zero(); N];
        let mut over = OverFrame { displacement: zero, spin: zero, row: zero, own: zero, frame: Mat3::zero() };
        for i in 0..N {
            let mut zx = Mat3::zero();
            let mut zt = Mat3::zero();
            for j in 0..N {
                let arm = self.arms[j].skew();
                let back = self.back[j].transpose();
                zx += local.tangent_block(2 * i, 2 * j) * arm - local.tangent_block(2 * i, 2 * j + 1) * back;
                zt += local.tangent_block(2 * i + 1, 2 * j) * arm - local.tangent_block(2 * i + 1, 2 * j + 1) * back;
            }
            let force = source.force_block(2 * i);
            let moment = source.force_block(2 * i + 1);
            let a = self.back[i];
            let turned = &self.turned[i];
            let c1 = a * turned.c1(a * moment).scale(s);
            let c2 = turned.c2(forces.own[i]).scale(s);
            let a_transposed = a.transpose();
            over.displacement[i] = self.frame * (zx - force.skew().scale(s));
            over.spin[i] = a_transposed * (zt + c2 * a_transposed);
            over.row[i] = (zt.transpose() + c1) * a;
            // A^T C2 is the loss of the moments of the node; over Theta itself C2 stands alone.
            over.own[i] = c2;
            over.frame += Mat3::skew_mul(force, self.arms[i].skew()).scale(s)
                - Mat3::skew_mul(self.arms[i], zx)
                - a * zt
                - c1 * a_transposed;
        }
        over
    }

    /// The derivatives of F_i^T m over the spins t_j of the two nodes that carry the frame, for a
    /// fixed m, with
    ///
    /// ```text
    /// 2 dh = T(2h)^-1 t_2 - T(2h)^-T t_1
    /// ```
    #[inline(always)]
    fn drift(&self, rotations: &[Rotation<T>; N], m: Vec3<T>, s: f64) -> Drift<N, T> {
        let (first, last) = carriers(N);
        let [over_first, over_last] = self.half.turned(m);
        let t1 = rotations[first].t;
        let t2 = rotations[last].t;
        let rows = [t1.transpose_matmul(over_first), t2.transpose_matmul(over_last)];
        // T(2h)^-1
        let inverse = Rotation::new(self.half.rotation.p.scale(2.0)).t_inverse().scale(0.5 * s);
        let columns = [-(inverse.transpose() * t1), inverse * t2];
        Drift { rows, columns }
    }
}

/// Derivatives of F_i^T m over the spins of the nodes that carry the frame: block (i, j) is row i
/// times column j.
struct Drift<const N: usize, T> {
    rows: [Mat3<T>; 2],
    columns: [Mat3<T>; 2],
}

impl<const N: usize, T: Real> Drift<N, T> {
    /// The block between two nodes that carry the frame.
    #[inline(always)]
    fn between(&self, i: usize, j: usize) -> Option<Mat3<T>> {
        let (first, last) = carriers(N);
        let both = first != last && (i == first || i == last) && (j == first || j == last);
        both.then(|| self.rows[usize::from(i == last)] * self.columns[usize::from(j == last)])
    }
}

/// Forces conjugate to displacements and material spins.
struct SpinForces<const N: usize, T> {
    displacement: [Vec3<T>; N],
    /// f_t_i
    spin: [Vec3<T>; N],
    /// m_i, the part that does not act through the frame
    own: [Vec3<T>; N],
    /// m
    frame: Vec3<T>,
}

/// Blocks of the second variation, see [`Relative::over_frame`].
struct OverFrame<const N: usize, T> {
    displacement: [Mat3<T>; N],
    spin: [Mat3<T>; N],
    row: [Mat3<T>; N],
    own: [Mat3<T>; N],
    frame: Mat3<T>,
}
