//! Which unknowns are free: the numbering of the equations, and turned axes at constrained slots.

use super::node_blocks::Layout;
use super::plane::Plane;
use super::state::Slot;
use crate::tensor::{Mat3, Vec3};
use crate::threads;

/// Unit vectors whose inner product is nearer to 1 are one axis, nearer to 0 orthogonal: the fewest digits that a deck may give axes with.
const SAME_AXIS: f64 = 1e-9;

/// An axis that is nearer to a global one, by its cosine, is it but for round-off.
const GLOBAL_AXIS: f64 = 1e-15;

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

/// The number of no frame.
const GLOBAL: u32 = u32::MAX;

/// The numbers of the free equations, slot by slot.
#[derive(Clone, Debug)]
pub struct DofMap {
    /// The number of the first equation of each slot, and behind the last slot that of all
    first: Vec<u32>,
    /// What is free at each slot
    freedom: Vec<Freedom>,
    /// For each slot the number of its frame, or `GLOBAL` where its local directions are the global ones; nothing where no slot has one
    frame: Vec<u32>,
    /// Local directions as columns
    frames: Vec<Mat3>,
    plane: Option<Plane>,
}

/// The local directions of a slot that are free, a bit each, and a fourth where one is held that does not leave the plane anyway.
#[derive(Clone, Copy, Debug)]
struct Freedom(u8);

impl Freedom {
    fn new(is_held: [bool; 3], constrained: bool) -> Self {
        let [a, b, c] = is_held.map(|held| u8::from(!held));
        Self(a | b << 1 | c << 2 | u8::from(constrained) << 3)
    }

    /// Whether a direction is free, as a number.
    #[inline(always)]
    fn of(self, k: u32) -> u32 {
        u32::from(self.0 >> k) & 1
    }

    /// Whether all directions are free.
    #[inline(always)]
    fn is_whole(self) -> bool {
        self.0 == 0b111
    }

    fn count(self) -> u32 {
        self.of(0) + self.of(1) + self.of(2)
    }

    fn is_constrained(self) -> bool {
        self.0 >> 3 != 0
    }
}

impl DofMap {
    /// The number of a direction that is no equation.
    pub const HELD: u32 = u32::MAX;

    /// Numbers the free directions of `slots` slots, slot by slot.
    pub fn new(slots: usize, held: &[Direction]) -> Result<Self, FrameConflict> {
        let mut out = Self::empty(slots, None);
        for (slot, known) in by_slot(slots, held)?.iter().enumerate() {
            let (frame, is_held) = local_axes(known);
            out.push(slot, frame, is_held, !known.is_empty());
        }
        Ok(out)
    }

    /// The same in a plane: displacements stay in it, and rotation vectors, where a slot `turns`, along its normal, the third local
    /// direction of every slot.
    pub fn planar(
        slots: usize,
        held: &[Direction],
        plane: Plane,
        turns: impl Fn(Slot) -> bool,
    ) -> Result<Self, FrameConflict> {
        let (normal, own) = (plane.normal(), (!plane.is_global()).then_some(*plane.axes()));
        let mut out = Self::empty(slots, Some(plane));
        for (slot, known) in by_slot(slots, held)?.iter().enumerate() {
            // What leaves the plane is held by the plane.
            let along = |axis: &Vec3| normal * normal.dot(*axis);
            let inside = |axis: &Vec3| if turns(slot as Slot) { along(axis) } else { *axis - along(axis) };
            let known = spanned(known.iter().map(inside));
            let turned = |axis: &Vec3| Mat3::from_columns(*axis, normal.cross(*axis), normal);
            let (frame, is_held) = match (turns(slot as Slot), &known[..]) {
                (true, held) => (own, [true, true, !held.is_empty()]),
                (false, []) => (own, [false, false, true]),
                (false, [axis, rest @ ..]) => match [0, 1].into_iter().find(|&k| is_axis(&plane, k, *axis)) {
                    Some(0) => (own, [true, !rest.is_empty(), true]),
                    Some(_) => (own, [!rest.is_empty(), true, true]),
                    None => (Some(turned(axis)), [true, !rest.is_empty(), true]),
                },
            };
            out.push(slot, frame, is_held, !known.is_empty());
        }
        Ok(out)
    }

    fn empty(slots: usize, plane: Option<Plane>) -> Self {
        let (mut first, freedom) = (Vec::with_capacity(slots + 1), Vec::with_capacity(slots));
        first.push(0);
        Self { first, freedom, frame: Vec::new(), frames: Vec::new(), plane }
    }

    fn push(&mut self, slot: usize, frame: Option<Mat3>, is_held: [bool; 3], constrained: bool) {
        let freedom = Freedom::new(is_held, constrained);
        self.first.push(self.first[slot] + freedom.count());
        self.freedom.push(freedom);
        // Slots of one plane all have the same.
        if let Some(frame) = frame.filter(|frame| self.frames.last() != Some(frame)) {
            self.frames.push(frame);
        }
        if !self.frames.is_empty() {
            self.frame.resize(slot, GLOBAL);
            self.frame.push(frame.map_or(GLOBAL, |_| self.frames.len() as u32 - 1));
        }
    }

    /// Which rows of a tile they are.
    pub fn layout(&self) -> Layout {
        if self.plane.is_some() { Layout::Planar } else { Layout::Spatial }
    }

    /// The plane that everything stays in, if there is one.
    #[inline]
    pub fn plane(&self) -> Option<&Plane> {
        self.plane.as_ref()
    }

    /// The number of equations.
    pub fn count(&self) -> usize {
        self.before(self.freedom.len())
    }

    /// The number of equations of the slots before this one.
    #[inline(always)]
    pub fn before(&self, slot: usize) -> usize {
        self.first[slot] as usize
    }

    /// The equations of a slot, by local direction.
    #[inline]
    pub fn of(&self, slot: Slot) -> [u32; 3] {
        let (first, freedom) = (self.first[slot as usize], self.freedom[slot as usize]);
        if freedom.is_whole() {
            return [first, first + 1, first + 2];
        }
        let number = |k: u32, before: u32| if freedom.of(k) == 1 { first + before } else { Self::HELD };
        [number(0, 0), number(1, freedom.of(0)), number(2, freedom.of(0) + freedom.of(1))]
    }

    /// The slot of an equation.
    fn slot_of(&self, equation: usize) -> usize {
        self.first.partition_point(|&first| first as usize <= equation) - 1
    }

    /// The slot and the local direction of an equation.
    pub fn origin(&self, equation: usize) -> (Slot, u8) {
        let slot = self.slot_of(equation);
        let directions = self.of(slot as Slot).into_iter().take_while(|&number| number as usize != equation);
        (slot as Slot, directions.count() as u8)
    }

    /// Whether the equations of some slots that follow each other are their components.
    #[inline(always)]
    pub fn are_components(&self, slots: std::ops::Range<Slot>) -> bool {
        let count = self.before(slots.end as usize) - self.before(slots.start as usize);
        self.frame.is_empty() && count == 3 * slots.len()
    }

    /// Whether the equations of some slots are those of a node in a plane that nothing else holds, which would stand as a fourth bit: two local
    /// components of the first, and the third of the second.
    #[inline(always)]
    pub fn are_planar(&self, slots: std::ops::Range<Slot>) -> bool {
        let freedom = self.freedom.get(slots.start as usize..slots.end as usize);
        matches!(freedom, Some([Freedom(0b011), Freedom(0b100)]))
    }

    /// The turned axes of a slot as columns.
    #[inline]
    pub fn frame(&self, slot: Slot) -> Option<Mat3> {
        self.axes(slot).copied()
    }

    #[inline(always)]
    fn axes(&self, slot: Slot) -> Option<&Mat3> {
        self.frames.get(*self.frame.get(slot as usize)? as usize)
    }

    /// The slot and the direction (global components) of an equation.
    pub fn direction(&self, equation: usize) -> Direction {
        let (slot, k) = self.origin(equation);
        let axis = self.frame(slot).map_or(Vec3::UNIT[k as usize], |frame| frame.column(k as usize));
        Direction { slot, axis }
    }

    /// Picks the free entries of what stands at each slot.
    pub fn gather(&self, field: impl Fn(usize) -> Vec3 + Send + Sync, out: &mut [f64]) {
        self.each_entry(|slot| self.to_local(slot as Slot, field(slot)), out, |_, out, entry| *out = entry);
    }

    /// The same less what the entries were before.
    pub fn gather_change(&self, field: impl Fn(usize) -> Vec3 + Send + Sync, out: &mut [f64]) {
        self.each_entry(|slot| self.to_local(slot as Slot, field(slot)), out, |_, out, entry| *out = entry - *out);
    }

    /// Gives each entry what its slot has.
    pub fn fill(&self, own: impl Fn(usize) -> f64 + Send + Sync, out: &mut [f64]) {
        self.each_entry(|_| Vec3::ZERO, out, |slot, out, _| *out = own(slot));
    }

    /// Shows for each equation its slot, what is kept for it, and its entry of what stands at the slot in local directions.
    #[inline(always)]
    fn each_entry<T: Send>(
        &self,
        local: impl Fn(usize) -> Vec3 + Send + Sync,
        list: &mut [T],
        show: impl Fn(usize, &mut T, f64) + Send + Sync,
    ) {
        threads::each_part(list, |start, part| {
            let end = start + part.len();
            for slot in self.slot_of(start)..self.freedom.len() {
                if self.before(slot) >= end {
                    break;
                }
                self.each_of(slot, local(slot), start, part, |kept, entry| show(slot, kept, entry));
            }
        });
    }

    /// The same for one slot, with what is kept for the equations from `start` on.
    #[inline(always)]
    pub fn each_of<T>(
        &self,
        slot: usize,
        local: Vec3,
        start: usize,
        list: &mut [T],
        mut show: impl FnMut(&mut T, f64),
    ) {
        let own = self.before(slot).wrapping_sub(start)..self.before(slot + 1).wrapping_sub(start);
        if let Some([x, y, z]) = list.get_mut(own) {
            return [x, y, z].into_iter().zip(local.0).for_each(|(kept, entry)| show(kept, entry));
        }
        for (number, entry) in self.of(slot as Slot).into_iter().zip(local.0) {
            // What is held has the number of no equation.
            if let Some(kept) = list.get_mut((number as usize).wrapping_sub(start)) {
                show(kept, entry);
            }
        }
    }

    /// Writes the solution into a field of slots; held directions take their part of `held`.
    pub fn scatter(&self, solution: &[f64], held: Option<&[Vec3]>, out: &mut [Vec3]) {
        threads::each_part(out, |start, out| {
            for (slot, out) in (start..).zip(out) {
                let first = self.before(slot);
                *out = self.at(slot, &solution[first..self.before(slot + 1)], first, held);
            }
        });
    }

    /// The same where the solution is found by equation, and nothing is held that moves.
    pub fn scatter_found(&self, solution: impl Fn(usize) -> f64 + Send + Sync, out: &mut [Vec3]) {
        threads::each_part(out, |start, out| {
            for (slot, out) in (start..).zip(out) {
                let (first, end) = (self.before(slot), self.before(slot + 1));
                let own: [f64; 3] = std::array::from_fn(|k| if first + k < end { solution(first + k) } else { 0.0 });
                *out = self.at(slot, &own[..end - first], first, None);
            }
        });
    }

    /// What stands at a slot, of a solution from the equation `start` on.
    #[inline(always)]
    pub fn at(&self, slot: usize, solution: &[f64], start: usize, held: Option<&[Vec3]>) -> Vec3 {
        let mut local = held.map_or(Vec3::ZERO, |held| self.to_local(slot as Slot, held[slot]));
        match solution.get(self.before(slot) - start..self.before(slot + 1) - start) {
            Some(&[x, y, z]) => local = Vec3([x, y, z]),
            _ => {
                for (local, number) in local.0.iter_mut().zip(self.of(slot as Slot)) {
                    // What is held has the number of no equation.
                    *local = solution.get((number as usize).wrapping_sub(start)).copied().unwrap_or(*local);
                }
            }
        }
        self.to_global(slot as Slot, local)
    }

    /// Whether no direction of a slot is held but those that leave the plane.
    #[inline]
    pub fn is_plain(&self, slot: Slot) -> bool {
        !self.freedom[slot as usize].is_constrained()
    }

    /// The held part of a value at a slot.
    pub fn held_part(&self, slot: Slot, value: Vec3) -> Vec3 {
        let mut local = self.to_local(slot, value);
        for (local, number) in local.0.iter_mut().zip(self.of(slot)) {
            if number != Self::HELD {
                *local = 0.0;
            }
        }
        self.frame(slot).map_or(local, |frame| frame * local)
    }

    /// What has these components in the local directions of a slot.
    #[inline(always)]
    pub fn to_global(&self, slot: Slot, local: Vec3) -> Vec3 {
        self.axes(slot).map_or(local, |frame| *frame * local)
    }

    /// Components in the local directions of a slot.
    #[inline(always)]
    pub fn to_local(&self, slot: Slot, value: Vec3) -> Vec3 {
        self.axes(slot).map_or(value, |frame| frame.transpose_mul(value))
    }
}

/// The held axes of each slot, of each direction once.
fn by_slot(slots: usize, held: &[Direction]) -> Result<Vec<Vec<Vec3>>, FrameConflict> {
    let mut axes: Vec<Vec<Vec3>> = vec![Vec::new(); slots];
    for direction in held {
        let axis = direction.axis;
        let known = &mut axes[direction.slot as usize];
        let spans = known.len() == 3;
        if spans || known.iter().any(|a| a.dot(axis).abs() > 1.0 - SAME_AXIS) {
            continue;
        }
        if known.iter().any(|a| a.dot(axis).abs() > SAME_AXIS) {
            return Err(FrameConflict { slot: direction.slot });
        }
        known.push(axis);
    }
    Ok(axes)
}

/// Orthogonal unit vectors that span the same.
fn spanned(vectors: impl Iterator<Item = Vec3>) -> Vec<Vec3> {
    let mut out: Vec<Vec3> = Vec::new();
    for vector in vectors {
        let rest = out.iter().fold(vector, |rest, known| rest - *known * known.dot(rest));
        out.extend(rest.normalized().filter(|_| rest.norm() > SAME_AXIS));
    }
    out
}

/// Whether an axis is the k-th of a plane.
fn is_axis(plane: &Plane, k: usize, axis: Vec3) -> bool {
    plane.axes().column(k).dot(axis).abs() > 1.0 - GLOBAL_AXIS
}

/// Completes held directions to three; no frame where all of them are global axes.
fn local_axes(held: &[Vec3]) -> (Option<Mat3>, [bool; 3]) {
    let global =
        held.iter().map(|axis| (0..3).find(|&k| axis.0[k].abs() > 1.0 - GLOBAL_AXIS)).collect::<Option<Vec<_>>>();
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
        let dof_map = DofMap::new(3, &held).unwrap();
        assert_eq!(dof_map.count(), 7);
        assert_eq!(dof_map.of(0), [0, DofMap::HELD, 1]);
        let origins: Vec<_> = (0..7).map(|equation| dof_map.origin(equation)).collect();
        assert_eq!(origins, [(0, 0), (0, 2), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)]);
        assert_eq!([0, 1, 2, 3].map(|slot| dof_map.before(slot)), [0, 2, 4, 7]);
        assert!(dof_map.frame(0).is_none());
        let frame = dof_map.frame(1).unwrap();
        assert!((frame.transpose_matmul(frame) - Mat3::IDENTITY).max_abs() < 1e-15);
        assert_eq!(frame.column(0), slanted);
    }

    #[test]
    fn a_direction_that_is_neither_new_nor_orthogonal_is_a_conflict() {
        let held = [Direction { slot: 0, axis: Vec3::UNIT[0] }, Direction { slot: 0, axis: Vec3([0.6, 0.8, 0.0]) }];
        assert_eq!(DofMap::new(1, &held).unwrap_err(), FrameConflict { slot: 0 });
    }

    #[test]
    fn in_a_plane_a_node_has_three_unknowns() {
        let plane = Plane::normal_to(Vec3([0.36, 0.48, 0.8])).unwrap();
        let [a, b, e] = [0, 1, 2].map(|k| plane.axes().column(k));
        let turns = |slot: Slot| slot % 2 == 1;
        let slanted = a * 0.6 + b * 0.8;
        let held = [(2, slanted), (3, e), (4, b), (4, e), (5, a)].map(|(slot, axis)| Direction { slot, axis });
        let dof_map = DofMap::planar(6, &held, plane, turns).unwrap();
        let free = |slot: Slot| dof_map.of(slot).map(|number| number != DofMap::HELD);
        assert_eq!((free(0), free(1)), ([true, true, false], [false, false, true]));
        assert_eq!((free(2), free(3)), ([false, true, false], [false; 3]));
        assert_eq!((free(4), free(5)), ([true, false, false], [false, false, true]));
        assert!((dof_map.frame(2).unwrap().column(0) - slanted).norm() < 1e-15);
        assert_eq!([0, 1, 2, 3, 4, 5].map(|slot| dof_map.is_plain(slot)), [true, true, false, false, false, true]);
        let all = Vec3::UNIT.map(|axis| Direction { slot: 0, axis });
        assert_eq!(DofMap::planar(2, &all, plane, turns).unwrap().count(), 1);
        let flat = DofMap::planar(2, &[], Plane::normal_to(Vec3::UNIT[2]).unwrap(), turns).unwrap();
        assert!(flat.frame(0).is_none() && flat.frame(1).is_none());
    }

    #[test]
    fn what_is_scattered_is_gathered_again() {
        let held = [Direction { slot: 0, axis: Vec3([0.6, 0.0, 0.8]) }];
        let dof_map = DofMap::new(1, &held).unwrap();
        let mut field = [Vec3::ZERO];
        dof_map.scatter(&[2.0, 3.0], Some(&[Vec3([0.6, 0.0, 0.8])]), &mut field);
        assert!((field[0].dot(held[0].axis) - 1.0).abs() < 1e-15);
        let mut again = [0.0; 2];
        dof_map.gather(|slot| field[slot], &mut again);
        assert!((again[0] - 2.0).abs() < 1e-15 && (again[1] - 3.0).abs() < 1e-15);
    }
}
