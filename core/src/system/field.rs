//! One 3-vector a slot, kept once by all states that have the same.

use crate::tensor::{Vec3, zeros};
use crate::threads;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// A vector a slot. Clones are one until one of them is changed: where nothing moves, all rates of all states are one list of zeros.
#[derive(Clone, Debug, PartialEq)]
pub struct Field(Arc<Vec<Vec3>>);

impl Field {
    /// Zero at so many slots.
    pub fn zero(slots: usize) -> Self {
        Self(Arc::new(zeros(slots)))
    }

    /// At no slot: nothing is kept.
    pub fn none() -> Self {
        Self::zero(0)
    }

    /// Puts a value at a slot, where another one stands there.
    #[inline]
    pub fn put(&mut self, slot: usize, value: Vec3) {
        if self[slot] != value {
            self[slot] = value;
        }
    }

    /// Takes over another one, into memory of its own where it has some.
    pub fn copy_from(&mut self, other: &Self) {
        if Arc::ptr_eq(&self.0, &other.0) {
            return;
        }
        match Arc::get_mut(&mut self.0) {
            Some(own) if own.len() == other.len() => threads::copy_over(own, &other.0),
            _ => self.0 = other.0.clone(),
        }
    }
}

impl Deref for Field {
    type Target = [Vec3];

    #[inline(always)]
    fn deref(&self) -> &[Vec3] {
        &self.0
    }
}

impl DerefMut for Field {
    /// Looks whether others have it, too: who changes many slots asks once.
    #[inline]
    fn deref_mut(&mut self) -> &mut [Vec3] {
        Arc::make_mut(&mut self.0).as_mut_slice()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_are_one_until_one_is_changed() {
        let mut field = Field::zero(3);
        let mut other = field.clone();
        assert!(Arc::ptr_eq(&field.0, &other.0));
        other[1] = Vec3::UNIT[0];
        assert_eq!((field[1], other[1]), (Vec3::ZERO, Vec3::UNIT[0]));
        // What is a field's own stays its own.
        let place = field.0.as_ptr();
        field.copy_from(&other);
        assert_eq!((field.0.as_ptr(), &field), (place, &other));
        let shared = field.clone();
        field.copy_from(&other);
        assert!(Arc::ptr_eq(&field.0, &other.0) && shared == other);
        field.put(1, Vec3::UNIT[0]);
        assert!(Arc::ptr_eq(&field.0, &other.0));
        field.put(1, Vec3::UNIT[2]);
        assert_eq!((field[1], other[1]), (Vec3::UNIT[2], Vec3::UNIT[0]));
    }
}
