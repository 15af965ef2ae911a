//! Cubic splines: two continuous derivatives, through values over a parameter.

/// The cubics between values whose parameters differ by `chords`: coefficients of 1, u, u², u³ with
/// u from 0 to the chord. With slopes at start and end, or no second derivative there (natural).
pub fn cubics(values: &[f64], chords: &[f64], ends: Option<[f64; 2]>) -> Vec<[f64; 4]> {
    let slopes = slopes(values, chords, ends);
    let cubic = |(k, &chord): (usize, &f64)| {
        let rise = (values[k + 1] - values[k]) * (1.0 / chord);
        let second = (rise * 3.0 - slopes[k] * 2.0 - slopes[k + 1]) * (1.0 / chord);
        let third = (slopes[k] + slopes[k + 1] - rise * 2.0) * (1.0 / (chord * chord));
        [values[k], slopes[k], second, third]
    };
    chords.iter().enumerate().map(cubic).collect()
}

/// The first derivatives at all values, which make the second ones continuous:
/// h_k m_(k-1) + 2 (h_(k-1) + h_k) m_k + h_(k-1) m_(k+1) = 3 (h_k d_(k-1) + h_(k-1) d_k),
/// d_k = (x_(k+1) - x_k)/h_k. At an end without slope 2 m_0 + m_1 = 3 d_0.
fn slopes(values: &[f64], chords: &[f64], ends: Option<[f64; 2]>) -> Vec<f64> {
    let last = values.len() - 1;
    let rise = |k: usize| (values[k + 1] - values[k]) * (1.0 / chords[k]);
    // A row [below, diagonal, above] of the tridiagonal matrix, and its right-hand side.
    let row = |k: usize| match (k, ends) {
        (0, Some([slope, _])) => ([0.0, 1.0, 0.0], slope),
        (0, None) => ([0.0, 2.0, 1.0], rise(0) * 3.0),
        (k, Some([_, slope])) if k == last => ([0.0, 1.0, 0.0], slope),
        (k, None) if k == last => ([1.0, 2.0, 0.0], rise(last - 1) * 3.0),
        (k, _) => {
            let before = chords[k - 1];
            let after = chords[k];
            let right = rise(k - 1) * (3.0 * after) + rise(k) * (3.0 * before);
            ([after, 2.0 * (before + after), before], right)
        }
    };
    let mut above = Vec::with_capacity(values.len());
    let mut slopes: Vec<f64> = Vec::with_capacity(values.len());
    for k in 0..=last {
        let ([below, diagonal, over], right) = row(k);
        let (pivot, right) = match k {
            0 => (diagonal, right),
            _ => (diagonal - below * above[k - 1], right - slopes[k - 1] * below),
        };
        above.push(over / pivot);
        slopes.push(right * (1.0 / pivot));
    }
    for k in (0..last).rev() {
        let next = slopes[k + 1];
        slopes[k] -= next * above[k];
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_with_its_end_slopes_is_found_exactly() {
        let exact = |x: f64| 1.0 - 2.0 * x + 0.5 * x * x * x;
        let places = [0.0, 0.7, 1.0, 2.5];
        let chords: Vec<f64> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let found = cubics(&places.map(exact), &chords, Some([-2.0, -2.0 + 1.5 * 2.5 * 2.5]));
        for (k, [c0, c1, c2, c3]) in found.into_iter().enumerate() {
            let u = 0.4 * chords[k];
            assert!((c0 + u * (c1 + u * (c2 + u * c3)) - exact(places[k] + u)).abs() < 1e-13);
        }
    }

    #[test]
    fn natural_ends_have_no_curvature_and_inner_points_no_jump() {
        let chords = [0.5, 1.0, 0.25];
        let found = cubics(&[0.0, 1.0, -1.0, 2.0], &chords, None);
        let second = |k: usize, u: f64| 2.0 * found[k][2] + 6.0 * found[k][3] * u;
        assert!(second(0, 0.0).abs() < 1e-13 && second(2, chords[2]).abs() < 1e-12);
        for k in 0..2 {
            assert!((second(k, chords[k]) - second(k + 1, 0.0)).abs() < 1e-11);
        }
    }
}
