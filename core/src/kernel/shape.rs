//! Lagrange shape functions on [-1, 1] with equally spaced nodes, and Gauss points.

/// The values of the shape functions of an element of N nodes at `xi`.
pub fn values<const N: usize>(xi: f64) -> [f64; N] {
    let nodes: [f64; N] = std::array::from_fn(|i| node_coordinate(i, N));
    std::array::from_fn(|i| lagrange(&nodes, i, xi))
}

/// The derivatives over xi of the shape functions of an element of N nodes at `xi`.
pub fn derivatives<const N: usize>(xi: f64) -> [f64; N] {
    let nodes: [f64; N] = std::array::from_fn(|i| node_coordinate(i, N));
    std::array::from_fn(|i| lagrange_slope(&nodes, i, xi))
}

/// The value at `x` of the polynomial that is one at abscissa `i` and zero at the others.
pub fn lagrange(abscissas: &[f64], i: usize, x: f64) -> f64 {
    let others = (0..abscissas.len()).filter(|&k| k != i);
    others.map(|k| (x - abscissas[k]) / (abscissas[i] - abscissas[k])).product()
}

/// The derivative at `x` of the polynomial that is one at abscissa `i` and zero at the others.
fn lagrange_slope(abscissas: &[f64], i: usize, x: f64) -> f64 {
    let term = |left_out: usize| -> f64 {
        let slope = 1.0 / (abscissas[i] - abscissas[left_out]);
        let others = (0..abscissas.len()).filter(|&k| k != i && k != left_out);
        others.fold(slope, |p, k| p * (x - abscissas[k]) / (abscissas[i] - abscissas[k]))
    };
    (0..abscissas.len()).filter(|&k| k != i).map(term).sum()
}

/// The coordinate on [-1, 1] of node `i` of `n`.
pub fn node_coordinate(i: usize, n: usize) -> f64 {
    2.0 * i as f64 / (n - 1) as f64 - 1.0
}

/// Abscissas and weights of the Gauss–Legendre rule with `count` points (1 to 4) on [-1, 1].
pub fn gauss(count: usize) -> &'static [(f64, f64)] {
    const ONE: [(f64, f64); 1] = [(0.0, 2.0)];
    const TWO: [(f64, f64); 2] = [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];
    const THREE: [(f64, f64); 3] =
        [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];
    const FOUR: [(f64, f64); 4] = [
        (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
        (-0.339_981_043_584_856_3, 0.652_145_154_862_546_2),
        (0.339_981_043_584_856_3, 0.652_145_154_862_546_2),
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    ];
    match count {
        1 => &ONE,
        2 => &TWO,
        3 => &THREE,
        4 => &FOUR,
        _ => panic!("there is no Gauss rule of {count} points here"),
    }
}

/// Abscissas and weights of the closed Newton–Cotes rule on the nodes of an element of `count`
/// nodes (2 to 4) on [-1, 1].
pub fn newton_cotes(count: usize) -> &'static [(f64, f64)] {
    const TWO: [(f64, f64); 2] = [(-1.0, 1.0), (1.0, 1.0)];
    const THREE: [(f64, f64); 3] = [(-1.0, 1.0 / 3.0), (0.0, 4.0 / 3.0), (1.0, 1.0 / 3.0)];
    const FOUR: [(f64, f64); 4] = [(-1.0, 0.25), (-1.0 / 3.0, 0.75), (1.0 / 3.0, 0.75), (1.0, 0.25)];
    match count {
        2 => &TWO,
        3 => &THREE,
        4 => &FOUR,
        _ => panic!("there is no element of {count} nodes"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums_hold<const N: usize>() {
        for xi in [-0.83, 0.1, 0.77] {
            let n = values::<N>(xi);
            let d = derivatives::<N>(xi);
            assert!((n.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!(d.iter().sum::<f64>().abs() < 1e-14);
            let position: f64 = (0..N).map(|i| n[i] * node_coordinate(i, N)).sum();
            let slope: f64 = (0..N).map(|i| d[i] * node_coordinate(i, N)).sum();
            assert!((position - xi).abs() < 1e-15 && (slope - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn shape_functions_reproduce_constants_and_lines() {
        sums_hold::<2>();
        sums_hold::<3>();
        sums_hold::<4>();
    }

    #[test]
    fn gauss_rules_integrate_their_degree_exactly() {
        for count in 1..=4 {
            for degree in 0..2 * count as i32 {
                let sum: f64 = gauss(count).iter().map(|(x, w)| w * x.powi(degree)).sum();
                let exact = if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-15, "{count} points, degree {degree}: {sum} against {exact}");
            }
        }
    }
}
