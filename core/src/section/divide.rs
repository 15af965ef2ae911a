//! Division of a line into cells, fine towards its ends where the solution asks for it.

/// Cells of a line, at most: with more the mesh is refused for its number of nodes.
const MOST_CELLS: f64 = 1e6;

/// The behaviour of the solution at an end of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// Nothing special
    Smooth,
    /// Changes over about one thickness, as at the free end of a wall
    Layer {
        /// The thickness
        thickness: f64,
    },
    /// Infinite stresses, as at a re-entrant corner; cells grow as the third power of their number
    Singular {
        /// Length over which they do so
        radius: f64,
    },
}

impl End {
    /// Number of cells wanted between the end and a distance from it.
    fn cells(self, distance: f64, density: f64, length: f64) -> f64 {
        match self {
            Self::Smooth => 0.0,
            Self::Layer { thickness } => density * libm::log1p(distance / thickness),
            Self::Singular { radius } => {
                let radius = radius.min(length);
                let near = libm::cbrt(distance.min(radius) / radius);
                let beyond = libm::log((distance / radius).max(1.0)) / 3.0;
                density * (near + beyond)
            }
        }
    }
}

/// Ends of cells from 0 to 1 along a line of some length.
///
/// `least` is the number of cells of a line with smooth ends, `density` the number of cells that an
/// end adds over its thickness or radius.
pub fn divide(length: f64, ends: [End; 2], least: f64, density: f64) -> Vec<f64> {
    let wanted = |s: f64| {
        let distance = s * length;
        least * s + ends[0].cells(distance, density, length) + ends[1].cells(length, density, length)
            - ends[1].cells(length - distance, density, length)
    };
    let total = wanted(1.0);
    // A ply that rounding leaves without thickness asks for infinitely many: its elements are refused.
    let count = if total.is_finite() { (total - 1e-9).ceil().clamp(1.0, MOST_CELLS) as usize } else { 1 };
    let mut points: Vec<f64> = (0..=count).map(|k| invert(&wanted, total * k as f64 / count as f64)).collect();
    points[0] = 0.0;
    points[count] = 1.0;
    points
}

/// Equal cells.
pub fn equal(count: usize) -> Vec<f64> {
    let count = count.max(1);
    (0..=count).map(|k| k as f64 / count as f64).collect()
}

/// The place from 0 to 1 at which an increasing function has a value, by bisection.
fn invert(function: &impl Fn(f64) -> f64, value: f64) -> f64 {
    let mut low = 0.0;
    let mut high = 1.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if function(middle) < value {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_without_length_or_measure_have_a_bounded_number_of_cells() {
        let singular = [End::Smooth, End::Singular { radius: 0.0 }];
        assert_eq!(divide(0.0, singular, 4.0, 3.0), [0.0, 1.0]);
        assert_eq!(divide(1.0, [End::Layer { thickness: 0.0 }, End::Smooth], 4.0, 3.0), [0.0, 1.0]);
        assert_eq!(divide(1.0, [End::Smooth; 2], f64::INFINITY, 3.0), [0.0, 1.0]);
    }

    #[test]
    fn smooth_lines_have_equal_cells() {
        let points = divide(3.0, [End::Smooth; 2], 4.0, 2.0);
        assert_eq!(points.len(), 5);
        assert!(points.iter().zip(equal(4)).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn both_ends_are_alike() {
        let points = divide(1.0, [End::Singular { radius: 0.5 }; 2], 2.0, 3.0);
        let last = points.len() - 1;
        assert!((0..=last).all(|k| (points[k] + points[last - k] - 1.0).abs() < 1e-12));
        assert!(points[1] < 0.5 * (points[2] - points[1]));
    }

    #[test]
    fn a_layer_has_cells_of_its_thickness() {
        let points = divide(100.0, [End::Smooth, End::Layer { thickness: 1.0 }], 4.0, 3.0);
        let last = points.len() - 1;
        assert!(100.0 * (1.0 - points[last - 1]) < 0.5);
    }
}
