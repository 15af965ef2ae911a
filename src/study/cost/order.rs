//! Orders of convergence, from the differences of three runs.

/// Relative differences below this come mostly from the tolerance of Newton's method.
const NOISE: f64 = 1e-8;

/// The bounds of observed orders.
const ORDERS: [f64; 2] = [0.05, 20.0];

/// An observed and an expected order of convergence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// The order of the finest three runs whose differences are above the noise; `None` where there
    /// are none
    pub observed: Option<f64>,
    /// The order for smooth solutions on fine meshes; `None` where the outputs have different
    /// orders
    pub expected: Option<Expected>,
}

/// An order that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// The order
    pub order: f64,
    /// True if the observed order may be higher
    pub at_least: bool,
}

impl Order {
    /// The meaning of an observed order that differs from the expected one.
    pub fn remark(&self) -> Option<&'static str> {
        let observed = self.observed?;
        let expected = self.expected?;
        let ratio = observed / expected.order;
        if ratio < 0.8 {
            Some("lower than expected: the meshes or steps are too coarse, or the solution is not smooth")
        } else if ratio > 1.2 && !expected.at_least {
            Some("higher than expected: errors cancel, or the meshes or steps are too coarse")
        } else {
            None
        }
    }
}

/// The order of the error as a power of the width, from falling widths and the distances between
/// neighbouring runs: that of the finest three runs from which it can be computed.
pub fn observed(widths: &[f64], distances: &[f64]) -> Option<f64> {
    let triples = widths.windows(3).zip(distances.windows(2));
    triples
        .rev()
        .filter(|(_, d)| d[1] > NOISE && d[0] > d[1])
        .find_map(|(w, d)| order_of([w[0], w[1], w[2]], d[0] / d[1]))
}

/// Solves (a^p - b^p) / (b^p - c^p) = ratio, whose left side rises with p where a > b > c.
fn order_of([a, b, c]: [f64; 3], ratio: f64) -> Option<f64> {
    let rises = |p: f64| (a.powf(p) - b.powf(p)) / (b.powf(p) - c.powf(p)) - ratio;
    let [mut low, mut high] = ORDERS;
    if !(rises(low) < 0.0 && rises(high) > 0.0) {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if rises(middle) < 0.0 { &mut low } else { &mut high }) = middle;
    }
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_is_found_from_uneven_widths() {
        for p in [1.0, 2.0, 4.0, 6.0] {
            let widths = [1.0, 0.6, 0.25, 0.125];
            let error = widths.map(|w: f64| 0.3 * w.powf(p));
            let distances: Vec<f64> = error.windows(2).map(|e| e[0] - e[1]).collect();
            assert!((observed(&widths, &distances).unwrap() - p).abs() < 1e-9, "{p}");
        }
    }

    #[test]
    fn noise_has_no_order() {
        assert_eq!(observed(&[1.0, 0.5, 0.25], &[1e-9, 1e-10]), None);
        assert_eq!(observed(&[1.0, 0.5, 0.25], &[1e-3, 1e-2]), None);
        assert_eq!(observed(&[1.0, 0.5], &[1e-3]), None);
        // The noise of the finest pair leaves the pair before.
        let p = observed(&[1.0, 0.5, 0.25, 0.125], &[1e-2, 2.5e-3, 1e-10]).unwrap();
        assert!((p - 2.0).abs() < 1e-9);
    }
}
