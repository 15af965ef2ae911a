//! Which unknowns are free: the numbering of the equations, and turned axes at constrained slots.

use super::state::Slot;
use crate::tensor::{Mat3, Vec3};

/// A direction of a slot that is not free: its value is held or prescribed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// The slot
    pub slot: Slot,
    /// A unit vector, global components
    pub axis: Vec3,
}

/// Two constraints on one slot whose directions are neither the same nor orthogonal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameConflict {
    /// The slot
    pub slot: Slot,
}

/// The numbers of the free equations.
#[derive(Clone, Debug)]
pub struct Equations {
    /// For each slot and local direction the equation, or [`Equations::HELD`].
    number: Vec<[u32; 3]>,
    /// The local directions of a slot as columns, where they are not the global ones.
    frame: Vec<Option<Mat3>>,
    /// Slot and local direction of each equation.
    origin: Vec<(Slot, u8)>,
}

impl Equations {
    /// The number of a direction that is no equation.
    pub const HELD: u32 = u32::MAX;

    /// Numbers the free directions of `slots` slots, slot by slot.
    pub fn new(slots: usize, held: &[Direction]) -> Result<Self, FrameConflict> {
        let mut axes: Vec<Vec<Vec3>> = vec![Vec::new(); slots];
        for direction in held {
            let known = &mut axes[direction.slot as usize];
            let spans = known.len() == 3;
            if spans || known.iter().any(|a| a.dot(direction.axis).abs() > 1.0 - 1e-9) {
                continue;
            }
            if known.iter().any(|a| a.dot(direction.axis).abs() > 1e-9) {
                return Err(FrameConflict { slot: direction.slot });
            }
            known.push(direction.axis);
        }
        let mut out = Self { number: Vec::with_capacity(slots), frame: Vec::with_capacity(slots), origin: Vec::new() };
        for (slot, known) in axes.iter().enumerate() {
            let (frame, is_held) = local_axes(known);
            let mut number = [Self::HELD; 3];
            for k in (0..3).filter(|&k| !is_held[k]) {
                number[k] = out.origin.len() as u32;
                out.origin.push((slot as Slot, k as u8));
            }
            out.number.push(number);
            out.frame.push(frame);
        }
        Ok(out)
    }

    /// The number of equations.
    pub fn count(&self) -> usize {
        self.origin.len()
    }

    /// The equations of a slot, by local direction.
    #[inline]
    pub fn of(&self, slot: Slot) -> [u32; 3] {
        self.number[slot as usize]
    }

    /// The slot and the local direction of an equation.
    pub fn origin(&self, equation: usize) -> (Slot, u8) {
        self.origin[equation]
    }

    /// The turned axes of a slot as columns.
    #[inline]
    pub fn frame(&self, slot: Slot) -> Option<Mat3> {
        self.frame[slot as usize]
    }

    /// The slot and the direction (global components) of an equation.
    pub fn direction(&self, equation: usize) -> Direction {
        let (slot, k) = self.origin[equation];
        let axis = self.frame(slot).map_or(Vec3::UNIT[k as usize], |frame| frame.column(k as usize));
        Direction { slot, axis }
    }

    /// Picks the free entries of a field of slots.
    pub fn gather(&self, field: &[Vec3], out: &mut [f64]) {
        for (slot, value) in field.iter().enumerate() {
            let local = self.to_local(slot as Slot, *value);
            for k in 0..3 {
                if self.number[slot][k] != Self::HELD {
                    out[self.number[slot][k] as usize] = local.0[k];
                }
            }
        }
    }

    /// Writes the solution into a field of slots; held directions take their part of `held`.
    pub fn scatter(&self, solution: &[f64], held: Option<&[Vec3]>, out: &mut [Vec3]) {
        for slot in 0..self.number.len() {
            let mut local = self.to_local(slot as Slot, held.map_or(Vec3::ZERO, |held| held[slot]));
            for k in 0..3 {
                if self.number[slot][k] != Self::HELD {
                    local.0[k] = solution[self.number[slot][k] as usize];
                }
            }
            out[slot] = self.frame[slot].map_or(local, |frame| frame * local);
        }
    }

    /// Whether every direction of a slot is free.
    #[inline]
    pub fn is_free(&self, slot: Slot) -> bool {
        self.number[slot as usize].iter().all(|&number| number != Self::HELD)
    }

    /// The held part of a value at a slot.
    pub fn held_part(&self, slot: Slot, value: Vec3) -> Vec3 {
        let mut local = self.to_local(slot, value);
        for k in 0..3 {
            if self.number[slot as usize][k] != Self::HELD {
                local.0[k] = 0.0;
            }
        }
        self.frame[slot as usize].map_or(local, |frame| frame * local)
    }

    /// Components in the local directions of a slot.
    #[inline]
    pub fn to_local(&self, slot: Slot, value: Vec3) -> Vec3 {
        self.frame[slot as usize].map_or(value, |frame| frame.transpose_mul(value))
    }
}

/// Completes held directions to three; no frame where all of them are global axes.
fn local_axes(held: &[Vec3]) -> (Option<Mat3>, [bool; 3]) {
    let global = held.iter().map(|axis| (0..3).find(|&k| axis.0[k].abs() > 1.0 - 1e-15)).collect::<Option<Vec<_>>>();
    if let Some(global) = global {
        return (None, [0, 1, 2].map(|k| global.contains(&k)));
    }
    if held.len() == 3 {
        return (None, [true; 3]);
    }
    let first = held[0];
    let second = held.get(1).copied().unwrap_or_else(|| {
        let least = (0..3).fold(0, |best, k| if first.0[k].abs() < first.0[best].abs() { k } else { best });
        first.cross(Vec3::UNIT[least]).normalized().expect("a unit vector and another axis")
    });
    (Some(Mat3::from_columns(first, second, first.cross(second))), [true, held.len() > 1, false])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn global_axes_need_no_frame_and_turned_ones_are_completed() {
        let slanted = Vec3([0.6, 0.8, 0.0]);
        let held = [Direction { slot: 0, axis: Vec3::UNIT[1] }, Direction { slot: 1, axis: slanted }];
        let equations = Equations::new(3, &held).unwrap();
        assert_eq!(equations.count(), 7);
        assert_eq!(equations.of(0), [0, Equations::HELD, 1]);
        assert!(equations.frame(0).is_none());
        let frame = equations.frame(1).unwrap();
        assert!((frame.transpose_matmul(frame) - Mat3::IDENTITY).max_abs() < 1e-15);
        assert_eq!(frame.column(0), slanted);
    }

    #[test]
    fn a_direction_that_is_neither_new_nor_orthogonal_is_a_conflict() {
        let held = [Direction { slot: 0, axis: Vec3::UNIT[0] }, Direction { slot: 0, axis: Vec3([0.6, 0.8, 0.0]) }];
        assert_eq!(Equations::new(1, &held).unwrap_err(), FrameConflict { slot: 0 });
    }

    #[test]
    fn what_is_scattered_is_gathered_again() {
        let held = [Direction { slot: 0, axis: Vec3([0.6, 0.0, 0.8]) }];
        let equations = Equations::new(1, &held).unwrap();
        let mut field = [Vec3::ZERO];
        equations.scatter(&[2.0, 3.0], Some(&[Vec3([0.6, 0.0, 0.8])]), &mut field);
        assert!((field[0].dot(held[0].axis) - 1.0).abs() < 1e-15);
        let mut again = [0.0; 2];
        equations.gather(&field, &mut again);
        assert!((again[0] - 2.0).abs() < 1e-15 && (again[1] - 3.0).abs() < 1e-15);
    }
}
