//! Bounds of the largest value of a measure over a section, without a search over it.
//!
//! Measures are convex and proportional to the load: the value of a sum is at most the sum of the
//! values. So the largest values under unit resultants bound those of all loads.

use super::Vector6;

/// The part of a largest value by which the one that a search finds may be too small
const SEARCH_ERROR: f64 = 1e-8;

/// The way in which values of parts of a load bound the value of the load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parts {
    /// Their sum
    Any,
    /// Their sum; a load and its opposite have one value
    Even,
    /// The root of the squares of two sums: von Mises stress from a stress along the beam, by N1, M2
    /// and M3, and shear stresses across it, by N2, N3 and M1
    AxialAndShear {
        /// True if the section looks alike from all sides: of two forces, or two moments, the root of
        /// the squares counts
        is_round: bool,
    },
}

/// Largest values over a section under unit resultants.
#[derive(Clone, Debug)]
pub struct UnitPeaks {
    /// For each resultant those of 1 and of -1
    values: [[f64; 2]; 6],
    /// Square of the larger one
    weights: [f64; 6],
    parts: Parts,
}

impl UnitPeaks {
    /// From the largest value over the section under a load.
    pub fn new(value: impl Fn(&Vector6) -> f64, parts: Parts) -> Self {
        let values =
            std::array::from_fn(|k| [1.0, -1.0].map(|size| (1.0 + SEARCH_ERROR) * value(&Vector6::ith(k, size))));
        let weights = values.map(|[a, b]: [f64; 2]| a.max(b).powi(2));
        Self { values, weights, parts }
    }

    /// An upper bound of the value of a load.
    pub fn bound(&self, load: &Vector6) -> f64 {
        let [n1, n2, n3, m1, m2, m3] = std::array::from_fn(|k| {
            let [plus, minus] = self.values[k];
            if load[k] < 0.0 { -load[k] * minus } else { load[k] * plus }
        });
        match self.parts {
            Parts::Any | Parts::Even => n1 + n2 + n3 + m1 + m2 + m3,
            Parts::AxialAndShear { is_round } => {
                let both = |a: f64, b: f64| if is_round { (a * a + b * b).sqrt() } else { a + b };
                let axial: f64 = n1 + both(m2, m3);
                let shear: f64 = m1 + both(n2, n3);
                (axial * axial + shear * shear).sqrt()
            }
        }
    }

    /// The multiple of a load that is nearest to another one.
    pub fn part(&self, load: &Vector6, of: &Vector6) -> f64 {
        let product = |a: &Vector6| (0..6).map(|k| self.weights[k] * a[k] * of[k]).sum::<f64>();
        let square = product(of);
        if square > 0.0 { product(load) / square } else { 0.0 }
    }

    /// Lower and upper bound of the value of a load by those of another one: the load is a multiple of
    /// the other one, and what is left.
    pub fn around(&self, load: &Vector6, known: &Vector6, [least, most]: [f64; 2]) -> [f64; 2] {
        let part = self.part(load, known);
        let part = match self.parts {
            Parts::Any => part.max(0.0),
            Parts::Even | Parts::AxialAndShear { .. } => part,
        };
        let left = load - known * part;
        [part.abs() * least - self.bound(&-left), part.abs() * most + self.bound(&left)]
    }

    /// Upper bound of the value of a load by the chord between two others with their values.
    pub fn chord(&self, load: &Vector6, [start, end]: [(&Vector6, f64); 2]) -> f64 {
        let way = end.0 - start.0;
        let done = load - start.0;
        let part = self.part(&done, &way).clamp(0.0, 1.0);
        (1.0 - part) * start.1 + part * end.1 + self.bound(&(done - way * part))
    }
}
