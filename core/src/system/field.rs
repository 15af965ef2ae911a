//! A 3-vector per slot, shared by all states that have equal values.

use crate::tensor::{Vec3, zeros};
use crate::threads;
use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// A 3-vector per slot with copy-on-write storage: in statics the rates of all states share one
/// list of zeros.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Field(Arc<Vec<Vec3>>);

impl Field {
    /// Field of zeros at `slots` slots.
    pub fn zero(slots: usize) -> Self {
        Self(Arc::new(zeros(slots)))
    }

    /// Empty field, of no slot.
    pub fn none() -> Self {
        Self::zero(0)
    }

    /// Sets the value of a slot. Storage is copied only if the value differs.
    #[inline]
    pub fn put(&mut self, slot: usize, value: Vec3) {
        if self[slot] != value {
            self[slot] = value;
        }
    }

    /// Takes over the values of another field, into the memory of this one if no other field shares
    /// it.
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
    /// Copies the storage if another field shares it. Callers that change many slots borrow once.
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
        // Unshared storage is overwritten in place.
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
