//! Numbers that vary along a beam.

/// Numbers given at places of a beam, linear in arc length between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Along<const N: usize> {
    /// Fractions of the length of the beam, from 0 to 1
    places: Vec<f64>,
    values: Vec<[f64; N]>,
}

impl<const N: usize> Along<N> {
    /// One value for the whole beam, two for its start and its end, or one for each station.
    pub fn new(values: &[[f64; N]], stations: Option<&[f64]>) -> Self {
        let places = match (values, stations) {
            (&[one], _) => return Self { places: vec![0.0, 1.0], values: vec![one; 2] },
            ([_, _], _) | (_, None) => vec![0.0, 1.0],
            (_, Some(stations)) => stations.to_vec(),
        };
        Self { places, values: values.to_vec() }
    }

    /// Zero everywhere.
    pub fn zero() -> Self {
        Self { places: vec![0.0, 1.0], values: vec![[0.0; N]; 2] }
    }

    /// True if it is zero everywhere.
    pub fn is_zero(&self) -> bool {
        self.values.iter().flatten().all(|&value| value == 0.0)
    }

    /// The values at a fraction of the length.
    pub fn at(&self, s: f64) -> [f64; N] {
        let next = self.places.partition_point(|&place| place <= s).clamp(1, self.places.len() - 1);
        let from = self.places[next - 1];
        let part = (s - from) / (self.places[next] - from);
        let [a, b] = [self.values[next - 1], self.values[next]];
        std::array::from_fn(|k| a[k] + (b[k] - a[k]) * part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_linear_between_stations() {
        let along = Along::new(&[[0.0, 1.0], [2.0, 1.0], [1.0, 5.0]], Some(&[0.0, 0.25, 1.0]));
        assert_eq!(along.at(0.125), [1.0, 1.0]);
        assert_eq!(along.at(0.625), [1.5, 3.0]);
        assert_eq!(along.at(1.0), [1.0, 5.0]);
        assert_eq!(Along::new(&[[1.0], [3.0]], Some(&[0.0, 0.25, 1.0])).at(0.5), [2.0]);
        assert_eq!(Along::new(&[[4.0]], None).at(0.3), [4.0]);
        assert!(Along::<2>::zero().is_zero() && !along.is_zero());
    }
}
