//! The rotation algebra: every tensor against automatic differentiation of the one below it.

use crate::dual::{Dual, along, jacobian, tensor_rate, values, variables, vector_rate};
use crate::random::Random;
use crate::scenes::simulate;
use beamsim_core::model::charts;
use beamsim_core::rotation::{Complement, Rotation, complement, log, nearest_turn, principal, relative_angle, unwound};
use beamsim_core::system::State;
use beamsim_core::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

type Jet = Dual<3>;

const ANGLES: [f64; 10] = [1e-9, 1e-4, 0.3, 1.0, PI - 1e-6, PI, 4.0, 6.1, 6.5, 8.0];

/// Angles where the change of chart is not close to its pole at zero.
const REGULAR: [f64; 8] = [0.3, 1.0, PI - 1e-6, PI, 4.0, 6.1, 6.5, 8.0];

/// A rotation vector with two more vectors: rates, or what a tensor is applied to.
struct Sample {
    p: Vec3,
    v: Vec3,
    w: Vec3,
}

/// Ten directions for each angle.
fn samples(angles: &[f64]) -> Vec<Sample> {
    let mut random = Random::new(19);
    let mut samples = Vec::new();
    for &psi in angles {
        for _ in 0..10 {
            samples.push(Sample { p: random.vector(psi), v: random.cube(2.0), w: random.cube(2.0) });
        }
    }
    samples
}

/// Holds a tensor; the error is relative to the largest entry, or to one where that is less.
fn agree(what: &str, p: Vec3, got: Mat3, exact: Mat3, tolerance: f64) {
    let (error, scale) = ((got - exact).max_abs(), exact.max_abs().max(1.0));
    let finite = got.is_finite() && exact.is_finite();
    let psi = p.norm();
    assert!(
        finite && error <= tolerance * scale,
        "{what} at P = {p:?}, |P| = {psi}: error {error:e} where the largest entry is {scale:e}\n{got:?}\n{exact:?}"
    );
}

/// The same for a vector.
fn agree_vector(what: &str, p: Vec3, got: Vec3, exact: Vec3, tolerance: f64) {
    let (error, scale) = ((got - exact).max_abs(), exact.max_abs().max(1.0));
    let finite = got.is_finite() && exact.is_finite();
    let psi = p.norm();
    assert!(
        finite && error <= tolerance * scale,
        "{what} at P = {p:?}, |P| = {psi}: error {error:e} where the largest entry is {scale:e}\n{got:?}\n{exact:?}"
    );
}

#[test]
fn rotation_tensors_are_orthogonal_and_keep_their_axis() {
    for Sample { p, .. } in samples(&ANGLES) {
        let r = Rotation::new(p).r;
        agree("R^T R = I", p, r.transpose_matmul(r), Mat3::IDENTITY, 1e-13);
        agree_vector("R P = P", p, r * p, p, 1e-13);
        let determinant = r.column(0).cross(r.column(1)).dot(r.column(2));
        assert!((determinant - 1.0).abs() <= 1e-13, "det R = {determinant} at P = {p:?}");
    }
}

#[test]
fn the_transposed_tangent_tensor_is_the_turned_one() {
    for Sample { p, .. } in samples(&ANGLES) {
        let Rotation { r, t, .. } = Rotation::new(p);
        agree("T^T = R T", p, t.transpose(), r * t, 1e-13);
    }
}

#[test]
fn the_tangent_tensor_gives_the_material_spin() {
    for Sample { p, w, .. } in samples(&ANGLES) {
        let Rotation { r, t, .. } = Rotation::new(p);
        let rate = tensor_rate(Rotation::new(along(p, w)).r);
        agree("R^T dR/dt = (T W)~", p, r.transpose_matmul(rate), (t * w).skew(), 1e-12);
    }
}

#[test]
fn the_tangent_tensor_is_inverted_below_a_turn() {
    for Sample { p, .. } in samples(&[1e-9, 1e-4, 0.3, 1.0, PI - 1e-6, PI, 4.0, 5.0, 6.0]) {
        let rotation = Rotation::new(p);
        agree("T^-1 T = I", p, rotation.t_inverse() * rotation.t, Mat3::IDENTITY, 1e-13);
    }
}

#[test]
fn c1_is_the_derivative_of_the_spin() {
    for Sample { p, v, .. } in samples(&ANGLES) {
        let fixed: Vec3<Jet> = Vec3::constant(v);
        let spin = Rotation::new(variables::<3>(p, 0)).t * fixed;
        agree("C1(V) = D(T V)", p, Rotation::new(p).c1(v), jacobian(spin, 0), 1e-12);
    }
}

#[test]
fn c2_is_the_derivative_of_the_moment() {
    for Sample { p, v, .. } in samples(&ANGLES) {
        let fixed: Vec3<Jet> = Vec3::constant(v);
        let moment = Rotation::new(variables::<3>(p, 0)).t.transpose_mul(fixed);
        agree("C2(V) = D(T^T V)", p, Rotation::new(p).c2(v), jacobian(moment, 0), 1e-12);
    }
}

#[test]
fn the_rate_of_the_tangent_tensor_holds() {
    for Sample { p, w, .. } in samples(&ANGLES) {
        let rotation = Rotation::new(p);
        let rate = tensor_rate(Rotation::new(along(p, w)).t);
        agree("dT/dt", p, rotation.t_rate(w), rate, 1e-12);
        agree_vector("Td(W) W = C1(W) W", p, rotation.t_rate(w) * w, rotation.c1(w) * w, 1e-12);
    }
}

#[test]
fn c3_is_the_derivative_of_the_transposed_c1_and_symmetric() {
    for Sample { p, v, w } in samples(&ANGLES) {
        let (fixed_v, fixed_w): (Vec3<Jet>, Vec3<Jet>) = (Vec3::constant(v), Vec3::constant(w));
        let force = Rotation::new(variables::<3>(p, 0)).c1(fixed_w).transpose_mul(fixed_v);
        let c3 = Rotation::new(p).c3(v, w);
        agree("C3(V, W) = D(C1(W)^T V)", p, c3, jacobian(force, 0), 1e-12);
        agree("C3 = C3^T", p, c3, c3.transpose(), 1e-13);
    }
}

#[test]
fn c4_and_c5_are_the_derivatives_of_the_spin_rate() {
    for Sample { p, w, .. } in samples(&ANGLES) {
        let rotation = Rotation::new(p);
        let (fixed_p, fixed_w): (Vec3<Jet>, Vec3<Jet>) = (Vec3::constant(p), Vec3::constant(w));
        let moving_w = variables::<3>(w, 0);
        let over_w = Rotation::new(fixed_p).t_rate(moving_w) * moving_w;
        let over_p = Rotation::new(variables::<3>(p, 0)).t_rate(fixed_w) * fixed_w;
        agree("C4(W) = D_W(Td(W) W)", p, rotation.c4(w), jacobian(over_w, 0), 1e-12);
        agree("C5(W) = D_P(Td(W) W)", p, rotation.c5(w), jacobian(over_p, 0), 1e-12);
    }
}

#[test]
fn gradient_and_hessian_of_a_direction_hold() {
    for Sample { p, v, w } in samples(&ANGLES) {
        let (fixed_v, fixed_w): (Vec3<Jet>, Vec3<Jet>) = (Vec3::constant(v), Vec3::constant(w));
        let (rotation, moving) = (Rotation::new(p), Rotation::new(variables::<3>(p, 0)));
        let potential = fixed_w.dot(moving.r * fixed_v);
        let gradient = moving.potential_gradient(fixed_v, fixed_w);
        let hessian = rotation.potential_hessian(v, w);
        agree_vector("D(w . R v)", p, rotation.potential_gradient(v, w), Vec3(potential.partials), 1e-12);
        agree("D D(w . R v)", p, hessian, jacobian(gradient, 0), 1e-12);
        agree("D D(w . R v) = (D D(w . R v))^T", p, hessian, hessian.transpose(), 1e-13);
    }
}

#[test]
fn complements_are_the_same_rotation() {
    for Sample { p, .. } in samples(&ANGLES) {
        let change = Complement::new(p, Vec3::ZERO, Vec3::ZERO);
        agree("R(P^C) = R(P)", p, Rotation::new(change.p).r, Rotation::new(p).r, 1e-13);
        agree_vector("both functions give P^C", p, complement(p), change.p, 1e-15);
        let (psi, length) = (p.norm(), change.p.norm());
        let error = (length - (2.0 * PI - psi).abs()).abs();
        assert!(error <= 1e-14, "|P^C| = {length} at P = {p:?}, |P| = {psi}: error {error:e}");
    }
}

#[test]
fn the_complement_of_the_complement_is_the_vector_itself() {
    for Sample { p, .. } in samples(&[1e-9, 1e-4, 0.3, 1.0, PI - 1e-6, PI, 4.0, 6.1]) {
        agree_vector("P^CC = P", p, complement(complement(p)), p, 1e-13);
    }
    for Sample { p, v, w } in samples(&[0.3, 1.0, PI - 1e-6, PI, 4.0, 6.1]) {
        let there = Complement::new(p, v, w);
        let back = Complement::new(there.p, there.velocity, there.acceleration);
        agree_vector("P^CC = P", p, back.p, p, 1e-13);
        agree_vector("P^CCd = Pd", p, back.velocity, v, 1e-11);
        agree_vector("P^CCdd = Pdd", p, back.acceleration, w, 1e-11);
        agree("B^C B = I", p, back.b * there.b, Mat3::IDENTITY, 1e-12);
    }
}

#[test]
fn a_change_of_chart_changes_no_spin() {
    for Sample { p, v, w } in samples(&REGULAR) {
        let (here, change) = (Rotation::new(p), Complement::new(p, v, w));
        let there = Rotation::new(change.p);
        let acceleration = here.t * w + here.t_rate(v) * v;
        let same = there.t * change.acceleration + there.t_rate(change.velocity) * change.velocity;
        agree_vector("Omega", p, there.t * change.velocity, here.t * v, 1e-12);
        agree_vector("Acc", p, same, acceleration, 1e-11);
    }
}

/// P(t) = P + W t + A t^2/2, and everything that follows from it.
#[test]
fn the_tensors_of_the_change_of_chart_are_derivatives() {
    for Sample { p, v: w, w: a } in samples(&REGULAR) {
        let change = Complement::new(p, w, a);
        let (rest, fixed_w, fixed_a): (Vec3<Jet>, Vec3<Jet>, Vec3<Jet>) =
            (Vec3::zero(), Vec3::constant(w), Vec3::constant(a));
        let over_p = Complement::new(variables::<3>(p, 0), fixed_w, fixed_a);
        agree("B = dP^C/dP", p, change.b, jacobian(over_p.p, 0), 1e-12);
        agree("Bd = dP^Cd/dP", p, change.b_rate, jacobian(over_p.velocity, 0), 1e-12);
        agree("Bdd = dP^Cdd/dP", p, change.b_rate2, jacobian(over_p.acceleration, 0), 1e-12);
        let over_w = Complement::new(Vec3::<Jet>::constant(p), variables::<3>(w, 0), fixed_a);
        agree("B = dP^Cd/dPd", p, change.b, jacobian(over_w.velocity, 0), 1e-12);
        agree("2 Bd = dP^Cdd/dPd", p, change.b_rate.scale(2.0), jacobian(over_w.acceleration, 0), 1e-12);
        let over_a = Complement::new(Vec3::<Jet>::constant(p), rest, variables::<3>(a, 0));
        agree("B = dP^Cdd/dPdd", p, change.b, jacobian(over_a.acceleration, 0), 1e-12);

        let over_t = Complement::new(along(p, w), along(w, a), Vec3::zero());
        agree_vector("P^Cd", p, change.velocity, vector_rate(over_t.p), 1e-12);
        agree_vector("P^Cdd", p, change.acceleration, vector_rate(over_t.velocity), 1e-12);
        agree("dB/dt", p, change.b_rate, tensor_rate(over_t.b), 1e-12);
        // Bd as a function of (P, W); the acceleration does not enter it, but the derivative of W does.
        agree("d2B/dt2", p, change.b_rate2, tensor_rate(over_t.b_rate), 1e-12);
    }
}

#[test]
fn the_geometric_matrix_of_the_change_of_chart_is_a_derivative() {
    for Sample { p, v: force, .. } in samples(&REGULAR) {
        let fixed: Vec3<Jet> = Vec3::constant(force);
        let moving = Complement::new(variables::<3>(p, 0), Vec3::zero(), Vec3::zero());
        let pulled = moving.b.transpose_mul(fixed);
        let geometric = Complement::geometric(p, force);
        agree_vector(
            "B^T f",
            p,
            Complement::new(p, Vec3::ZERO, Vec3::ZERO).b.transpose_mul(force),
            values(pulled),
            1e-14,
        );
        agree("D(B^T f)", p, geometric, jacobian(pulled, 0), 1e-12);
        agree("D(B^T f) = D(B^T f)^T", p, geometric, geometric.transpose(), 1e-13);
    }
}

#[test]
fn the_logarithm_inverts_the_exponential_from_zero_to_pi() {
    let angles = [1e-12, 1e-9, 1e-4, 0.5, 1.0, 2.0, 2.2, 2.8, PI - 1e-3, PI - 1e-6, PI - 1e-9, PI];
    for Sample { p, .. } in samples(&angles) {
        let psi = p.norm();
        let got = log(Rotation::new(p).r);
        let mut error = (got - p).norm();
        if PI - psi < 1e-12 {
            error = error.min((got + p).norm());
        }
        assert!(error <= 1e-12 * psi, "log exp P at P = {p:?}, |P| = {psi}: {got:?}, error {error:e}");
    }
    assert_eq!(log(Mat3::IDENTITY), Vec3::ZERO);
    assert_eq!(log(Rotation::new(Vec3::ZERO).r), Vec3::ZERO);
}

#[test]
fn the_logarithm_knows_half_turns_about_the_axes() {
    for axis in Vec3::UNIT {
        let half = axis.outer(axis).scale(2.0) - Mat3::IDENTITY;
        let got = log(half);
        let error = (got - axis * PI).norm().min((got + axis * PI).norm());
        assert!(error <= 1e-15, "half a turn about {axis:?}: {got:?}, error {error:e}");
    }
}

#[test]
fn the_logarithm_inverts_twenty_thousand_rotations() {
    let mut random = Random::new(20_000);
    for _ in 0..20_000 {
        let psi = random.range(0.0, PI - 1e-9);
        let p = random.vector(psi);
        let r = Rotation::new(p).r;
        let got = log(r);
        let error = (got - p).norm();
        assert!(error <= 1e-13, "log exp P at P = {p:?}, |P| = {psi}: {got:?}, error {error:e}");
        agree("exp log R = R", p, Rotation::new(got).r, r, 1e-13);
    }
}

#[test]
fn the_relative_angle_is_the_angle_between() {
    let mut random = Random::new(5);
    for angle in [0.0, 1e-9, 1e-4, 0.7, 2.0, 2.8, 3.0, PI - 1e-9, PI] {
        for _ in 0..50 {
            let length = random.range(0.0, 6.0);
            let a = Rotation::new(random.vector(length)).r;
            let b = a * Rotation::new(random.vector(angle)).r;
            let got = relative_angle(a, b);
            assert!((got - angle).abs() <= 1e-13, "angle {angle}: {got}, error {:e}, from {a:?}", got - angle);
        }
    }
}

#[test]
fn principal_vectors_are_short_and_the_same_rotation() {
    for Sample { p, .. } in samples(&[0.0, 1e-9, 1.0, 3.0, PI, 3.2, 6.1, 2.0 * PI, 6.5, 8.0, 3.0 * PI, 20.0, 30.0]) {
        let short = principal(p);
        let length = short.norm();
        assert!(length <= PI + 1e-13, "the principal vector of {p:?} has length {length}");
        agree("R of the principal vector", p, Rotation::new(short).r, Rotation::new(p).r, 1e-12);
    }
    for turns in [1.0, -1.0, 3.0, -3.0] {
        for axis in Vec3::UNIT {
            let error = (principal(axis * (PI * turns)) - axis * PI).norm();
            assert!(error <= 1e-14, "{turns} half turns about {axis:?}: error {error:e}");
        }
    }
    let slanted = Vec3([0.0, -0.6, 0.8]) * PI;
    assert!((principal(slanted) + slanted).norm() <= 1e-14, "the first component of {:?}", principal(slanted));
}

#[test]
fn the_nearest_turn_is_counted_along_the_vector() {
    for Sample { p, .. } in samples(&[0.2, 1.0, 3.0, PI, 4.0, 6.1]) {
        for turns in -3..=3_i32 {
            let turns = f64::from(turns);
            let reference = p * (1.0 + 2.0 * PI * turns / p.norm());
            let got = nearest_turn(p, reference);
            assert!(got == turns, "{turns} turns at P = {p:?}: {got}");
        }
    }
    assert_eq!(nearest_turn(Vec3::ZERO, Vec3([7.0, 0.0, 0.0])), 0.0);
}

/// Ten turns forward and back about an axis, seen only through principal vectors; half and whole turns are among the
/// steps.
#[test]
fn ten_turns_are_followed_and_undone() {
    let mut random = Random::new(10);
    for steps_a_turn in [3_i32, 8, 40] {
        let (axis, step) = (random.direction(), 2.0 * PI / f64::from(steps_a_turn));
        let mut unwrapped = Vec3::ZERO;
        let last = 10 * steps_a_turn;
        for k in (0..=last).chain((0..last).rev()) {
            let exact = axis * (f64::from(k) * step);
            unwrapped = unwound(principal(exact), unwrapped);
            let error = (unwrapped - exact).norm();
            assert!(error <= 1e-12, "step {k} of {steps_a_turn} a turn about {axis:?}: {unwrapped:?}, error {error:e}");
            if k == last {
                assert!((unwrapped.norm() - 20.0 * PI).abs() <= 1e-12, "ten turns read {}", unwrapped.norm());
            }
        }
        assert!(unwrapped.norm() <= 1e-12, "back again: {unwrapped:?}");
    }
}

#[test]
fn a_vector_without_axis_keeps_the_axis_of_before() {
    let axis = Vec3([0.6, 0.0, -0.8]);
    for (before, turns) in [(6.1, 1.0), (6.5, 1.0), (12.0, 2.0), (0.3, 0.0)] {
        let got = unwound(Vec3::ZERO, axis * before);
        let error = (got - axis * (2.0 * PI * turns)).norm();
        assert!(error <= 1e-14, "zero after {before} about {axis:?}: {got:?}, error {error:e}");
    }
    assert_eq!(unwound(Vec3::ZERO, Vec3::ZERO), Vec3::ZERO);
}

/// A million random rotations, and every multiple of pi up to 200 pi with its neighbours in the last digits. Vectors of many turns
/// are brought to their principal one first, as the program does; they are held against sine and cosine.
#[test]
fn the_logarithm_undoes_the_exponential_everywhere() {
    let mut random = Random::new(10);
    let mut worst = 0.0_f64;
    let mut look = |p: Vec3| {
        let r = Rotation::new(unwound(p, Vec3::ZERO)).r;
        let back = log(r);
        assert!(back.is_finite() && back.norm() <= PI * (1.0 + 1e-15), "{p:?} came back as {back:?}");
        let angle = p.norm();
        let n = if angle > 0.0 { p * (1.0 / angle) } else { Vec3::ZERO };
        let exact = Mat3::IDENTITY.scale(libm::cos(angle))
            + Mat3::skew_mul(n, Mat3::IDENTITY).scale(libm::sin(angle))
            + n.outer(n).scale(1.0 - libm::cos(angle));
        let error = (Rotation::new(back).r - r).max_abs().max((r - exact).max_abs());
        worst = worst.max(error);
    };
    for _ in 0..1_000_000 {
        let angle = random.range(0.0, 4.0 * PI);
        look(random.vector(angle));
    }
    for k in 0..=200 {
        let angle = f64::from(k) * PI;
        for near in
            [angle, angle.next_up(), angle.next_down(), angle * (1.0 + 1e-15), angle - 1e-9, angle + 1e-9, angle + 1e-5]
        {
            look(random.vector(near));
            Vec3::UNIT.into_iter().for_each(|axis| look(axis * near));
        }
    }
    assert!(worst < 1e-12, "{worst:e}");
}

/// A vector that has not wound is continued by itself, whichever way that is found out: a wound vector that is carried a little aside
/// takes the long way.
#[test]
fn near_vectors_are_continued_by_themselves() {
    let mut random = Random::new(21);
    for _ in 0..2000 {
        let (old, aside) = (random.cube(4.0), random.direction() * 1e-9);
        let length = random.range(0.0, 0.62);
        let p = old + random.direction() * length;
        let mut before = State::rest(1, 0, 0, 0);
        (before.q[0], before.unwrapped) = (old, vec![old]);
        for carried in [old, p, old + aside] {
            let mut state = before.clone();
            (state.q[0], state.unwrapped) = (p, vec![carried]);
            assert!(charts::wind(&mut state, &before, &[0]).is_empty());
            assert!((state.unwrapped[0] - p).norm() < 1e-12, "{old:?} to {p:?}");
        }
    }
}

/// Matrix of a unit quaternion, scalar part first.
fn matrix_of_quaternion([w, x, y, z]: [f64; 4]) -> Mat3 {
    Mat3([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ])
}

/// Columns `q` against `d` and `r`, at a node and between nodes of bent beams that turn about random axes by up to
/// three half turns.
#[test]
fn quaternions_in_columns_take_initial_section_axes_to_the_present_ones() {
    let mut random = Random::new(83);
    for (case, angle) in [0.7, PI, 4.0, 9.0].into_iter().enumerate() {
        let axis = random.direction().0;
        let force = random.cube(0.2).0;
        let interpolation = ["relative", "total"][case % 2];
        let text = format!(
            r#"
[point]
root = [0, 0, 0]
tip = [0.3, 0.5, 1]
[section.s]
EA = 100
GA = 100
GJ = 1
EI = 1
[[beam]]
name = "b"
section = "s"
through = ["root", "tip"]
elements = 4
order = 2
interpolation = "{interpolation}"
[[support]]
at = "root"
fix = "pin"
[[motion]]
at = "root"
rotate = {axis:?}
angle = {angle:?}
[[load]]
at = "tip"
force = {force:?}
frame = "section"
[[stage]]
kind = "static"
steps = 24
[output]
nodes = ["tip", "b@0.37"]
columns = ["d", "q", "r"]
"#
        );
        let simulation = simulate(&text);
        for node in ["tip", "b@0.37"] {
            let columns = |names: &[&str]| -> Vec<Vec<f64>> {
                names.iter().map(|name| simulation.column(&format!("{node}.{name}"))).collect()
            };
            let d = columns(&["d1x", "d2x", "d3x", "d1y", "d2y", "d3y", "d1z", "d2z", "d3z"]);
            let q = columns(&["qw", "qx", "qy", "qz"]);
            let r = columns(&["rx", "ry", "rz"]);
            let axes = |row: usize| Mat3(std::array::from_fn(|i| std::array::from_fn(|k| d[3 * i + k][row])));
            for row in 0..simulation.rows.len() {
                let quaternion: [f64; 4] = std::array::from_fn(|k| q[k][row]);
                let vector = Vec3([quaternion[1], quaternion[2], quaternion[3]]);
                let present = matrix_of_quaternion(quaternion) * axes(0);
                let error = (present - axes(row)).max_abs();
                assert!(error < 1e-14, "{node}, row {row} of case {case}: {error:e}");
                let half_turn = vector.dot(Vec3([r[0][row], r[1][row], r[2][row]]));
                assert!(quaternion[0] >= 0.0 && half_turn >= 0.0, "{node}, row {row} of case {case}: {quaternion:?}");
            }
        }
    }
}
