//! Long lists of numbers to six digits, in half the memory.

use crate::threads;
use serde::{Deserialize, Serialize};

/// Vectors of N numbers with six digits each. They serve comparisons and predictors, never results.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(from = "Vec<u32>", into = "Vec<u32>")]
pub struct CompressedField<const N: usize> {
    /// The upper half of each number: sign, exponent and the first twenty bits of the mantissa
    vectors: Vec<[u32; N]>,
}

impl<const N: usize> CompressedField<N> {
    /// Replaces the contents by `count` vectors, in the memory that is already allocated.
    #[inline]
    pub fn take(&mut self, count: usize, vector: impl Fn(usize) -> [f64; N] + Send + Sync) {
        self.vectors.resize(count, [0; N]);
        threads::each_part(&mut self.vectors, |start, part| {
            (start..).zip(part).for_each(|(k, rough)| *rough = vector(k).map(upper_half));
        });
    }

    /// Removes all vectors.
    pub fn clear(&mut self) {
        self.vectors.clear();
    }

    /// The number of vectors.
    pub fn len(&self) -> usize {
        self.vectors.len()
    }

    /// True if there are no vectors.
    pub fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// Vector `k`, to six digits.
    #[inline(always)]
    pub fn get(&self, k: usize) -> [f64; N] {
        self.vectors[k].map(|half| f64::from_bits(u64::from(half) << 32))
    }
}

impl<const N: usize> From<CompressedField<N>> for Vec<u32> {
    fn from(field: CompressedField<N>) -> Self {
        field.vectors.into_flattened()
    }
}

impl<const N: usize> From<Vec<u32>> for CompressedField<N> {
    fn from(halves: Vec<u32>) -> Self {
        Self { vectors: halves.as_chunks().0.to_vec() }
    }
}

/// The upper 32 bits of a number. Cutting off the others makes it smaller by at most a millionth of
/// itself, or by 2e-314 for numbers below 1e-307; infinities and NaN stay such.
#[inline(always)]
fn upper_half(number: f64) -> u32 {
    (number.to_bits() >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_digits_are_kept_of_any_size() {
        for size in [1e-300, 1e-30, 1.0, 1e300] {
            let numbers: Vec<[f64; 2]> = (0..5000).map(|k| [f64::from(k).sin() * size, size]).collect();
            let mut rough = CompressedField::default();
            rough.take(numbers.len(), |k| numbers[k]);
            let near = |k: usize| (0..2).all(|n| (rough.get(k)[n] - numbers[k][n]).abs() <= 1e-6 * numbers[k][n].abs());
            assert!(rough.len() == numbers.len() && (0..numbers.len()).all(near), "{size}");
            rough.clear();
            assert!(rough.is_empty());
        }
    }

    #[test]
    fn what_is_no_number_stays_none() {
        let mut rough = CompressedField::default();
        rough.take(3, |k| [[-0.5, f64::NAN, f64::NEG_INFINITY][k]]);
        assert_eq!((rough.get(0), rough.get(2)), ([-0.5], [f64::NEG_INFINITY]));
        assert!(rough.get(1)[0].is_nan());
    }
}
