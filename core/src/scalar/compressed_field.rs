//! Long lists of which the first digits are enough, in half the memory.

use crate::threads;

/// Vectors of N numbers with six digits each: what is only compared or guessed with, never what results are made of.
#[derive(Clone, Debug, Default)]
pub struct CompressedField<const N: usize> {
    /// The upper half of each number: sign, exponent and twenty bits
    vectors: Vec<[u32; N]>,
}

impl<const N: usize> CompressedField<N> {
    /// Takes so many vectors over what was there, into the memory that it has.
    #[inline]
    pub fn take(&mut self, count: usize, vector: impl Fn(usize) -> [f64; N] + Send + Sync) {
        self.vectors.resize(count, [0; N]);
        threads::each_part(&mut self.vectors, |start, part| {
            (start..).zip(part).for_each(|(k, rough)| *rough = vector(k).map(upper_half));
        });
    }

    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.vectors.clear();
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.vectors.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// One of them.
    #[inline(always)]
    pub fn get(&self, k: usize) -> [f64; N] {
        self.vectors[k].map(|half| f64::from_bits(u64::from(half) << 32))
    }
}

/// The upper 32 bits. What is cut off makes a number smaller by a millionth of it at most, of numbers below 1e-307 by 2e-314; infinities stay
/// what they are, and what arithmetic gives instead of a number stays none.
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
