//! Degrees of freedom: the numbers of the free equations, and the local axes of constrained slots.

use super::node_blocks::Layout;
use super::plane::Plane;
use super::state::Slot;
use crate::tensor::{Mat3, Vec3};
use crate::threads;

/// Unit vectors are parallel if their inner product differs from ±1 by less than this, and
/// orthogonal if it is smaller than this. Decks must give axes to nine digits.
const AXIS_TOLERANCE: f64 = 1e-9;

/// An axis is a global one if the magnitude of their inner product differs from 1 by less than
/// this, the round-off of normalisation.
const GLOBAL_AXIS_TOLERANCE: f64 = 1e-15;

/// A constrained direction of a slot, whose value is zero or prescribed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Constrained slot
    pub slot: Slot,
    /// Unit vector (global components)
    pub axis: Vec3,
}

/// Error: two constraints on one slot whose directions are neither parallel nor orthogonal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameConflict {
    /// Slot of the two constraints
    pub(crate) slot: Slot,
}

/// Frame number of slots whose local axes are the global ones.
const GLOBAL_FRAME: u32 = u32::MAX;

/// The numbers of the free equations, slot by slot, and the local axes in which directions are free
/// or held.
#[derive(Clone, Debug)]
pub struct DofMap {
    /// First equation of each slot; the last item is the number of all equations
    first: Vec<u32>,
    /// Free directions of each slot
    freedom: Vec<FreeDirections>,
    /// Index into `frames` for each slot, or [`GLOBAL_FRAME`]; empty if all slots have global axes
    frame: Vec<u32>,
    /// Local axes as columns (global components)
    frames: Vec<Mat3>,
    plane: Option<Plane>,
}

/// Free local directions of a slot, one bit each. A fourth bit tells that a constraint other than
/// the plane of the scene holds a direction.
#[derive(Clone, Copy, Debug)]
struct FreeDirections(u8);

impl FreeDirections {
    fn new(is_held: [bool; 3], constrained: bool) -> Self {
        let [a, b, c] = is_held.map(|held| u8::from(!held));
        Self(a | b << 1 | c << 2 | u8::from(constrained) << 3)
    }

    /// 1 if local direction k is free, else 0.
    #[inline(always)]
    fn of(self, k: u32) -> u32 {
        u32::from(self.0 >> k) & 1
    }

    /// True if all three directions are free and no constraint holds the slot.
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
    /// Equation number of held directions.
    pub const HELD: u32 = u32::MAX;

    /// Degrees of freedom of a spatial scene. `Err` if two held directions of a slot are neither
    /// parallel nor orthogonal.
    pub fn new(slots: usize, held: &[Direction]) -> Result<Self, FrameConflict> {
        let mut out = Self::empty(slots, None);
        for (slot, known) in by_slot(slots, held)?.iter().enumerate() {
            let (frame, is_held) = local_axes(known);
            out.push(slot, frame, is_held, !known.is_empty());
        }
        Ok(out)
    }

    /// Degrees of freedom of a planar scene. Displacements stay in the plane; rotation vectors (of
    /// slots for which `turns` holds) stay parallel to its normal, which is the third local axis of
    /// every slot. `Err` if two held directions of a slot are neither parallel nor orthogonal.
    pub fn planar(
        slots: usize,
        held: &[Direction],
        plane: Plane,
        turns: impl Fn(Slot) -> bool,
    ) -> Result<Self, FrameConflict> {
        let normal = plane.normal();
        let own = (!plane.is_global()).then_some(*plane.axes());
        let mut out = Self::empty(slots, Some(plane));
        for (slot, known) in by_slot(slots, held)?.iter().enumerate() {
            // Only the component in the free space of the slot counts: the plane itself holds the
            // rest.
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
        let mut first = Vec::with_capacity(slots + 1);
        let freedom = Vec::with_capacity(slots);
        first.push(0);
        Self { first, freedom, frame: Vec::new(), frames: Vec::new(), plane }
    }

    fn push(&mut self, slot: usize, frame: Option<Mat3>, is_held: [bool; 3], constrained: bool) {
        let freedom = FreeDirections::new(is_held, constrained);
        self.first.push(self.first[slot] + freedom.count());
        self.freedom.push(freedom);
        // Consecutive slots with equal axes share one frame.
        if let Some(frame) = frame.filter(|frame| self.frames.last() != Some(frame)) {
            self.frames.push(frame);
        }
        if !self.frames.is_empty() {
            self.frame.resize(slot, GLOBAL_FRAME);
            self.frame.push(frame.map_or(GLOBAL_FRAME, |_| self.frames.len() as u32 - 1));
        }
    }

    /// Layout of tile rows: planar or spatial.
    pub fn layout(&self) -> Layout {
        if self.plane.is_some() { Layout::Planar } else { Layout::Spatial }
    }

    /// Plane of a planar scene.
    #[inline]
    pub fn plane(&self) -> Option<&Plane> {
        self.plane.as_ref()
    }

    /// Number of equations.
    pub fn count(&self) -> usize {
        self.before(self.freedom.len())
    }

    /// Number of equations of all slots before `slot`.
    #[inline(always)]
    pub fn before(&self, slot: usize) -> usize {
        self.first[slot] as usize
    }

    /// Equation numbers of a slot by local direction, [`DofMap::HELD`] for held directions.
    #[inline]
    pub fn of(&self, slot: Slot) -> [u32; 3] {
        let first = self.first[slot as usize];
        let freedom = self.freedom[slot as usize];
        if freedom.is_whole() {
            return [first, first + 1, first + 2];
        }
        let number = |k: u32, before: u32| if freedom.of(k) == 1 { first + before } else { Self::HELD };
        [number(0, 0), number(1, freedom.of(0)), number(2, freedom.of(0) + freedom.of(1))]
    }

    /// Slot of an equation.
    fn slot_of(&self, equation: usize) -> usize {
        self.first.partition_point(|&first| first as usize <= equation) - 1
    }

    /// Slot and local direction (0 to 2) of an equation.
    pub fn origin(&self, equation: usize) -> (Slot, u8) {
        let slot = self.slot_of(equation);
        let directions = self.of(slot as Slot).into_iter().take_while(|&number| number as usize != equation);
        (slot as Slot, directions.count() as u8)
    }

    /// True if the equations of consecutive slots are exactly their three global components each.
    #[inline(always)]
    pub fn are_components(&self, slots: std::ops::Range<Slot>) -> bool {
        let count = self.before(slots.end as usize) - self.before(slots.start as usize);
        self.frame.is_empty() && count == 3 * slots.len()
    }

    /// True if two consecutive slots are displacement and rotation of a planar node without other
    /// constraints: the equations are the first two local components of the first slot and the
    /// third of the second.
    #[inline(always)]
    pub fn are_planar(&self, slots: std::ops::Range<Slot>) -> bool {
        let freedom = self.freedom.get(slots.start as usize..slots.end as usize);
        matches!(freedom, Some([FreeDirections(0b011), FreeDirections(0b100)]))
    }

    /// Rotated local axes of a slot as columns (global components); `None` if they are the global
    /// ones.
    #[inline]
    pub fn frame(&self, slot: Slot) -> Option<Mat3> {
        self.axes(slot).copied()
    }

    #[inline(always)]
    fn axes(&self, slot: Slot) -> Option<&Mat3> {
        self.frames.get(*self.frame.get(slot as usize)? as usize)
    }

    /// Slot and axis (global components) of an equation.
    pub fn direction(&self, equation: usize) -> Direction {
        let (slot, k) = self.origin(equation);
        let axis = self.frame(slot).map_or(Vec3::UNIT[k as usize], |frame| frame.column(k as usize));
        Direction { slot, axis }
    }

    /// Writes the free components of a field of slots (global components) to `out`, by equation.
    pub fn gather(&self, field: impl Fn(usize) -> Vec3 + Send + Sync, out: &mut [f64]) {
        self.each_entry(|slot| self.to_local(slot as Slot, field(slot)), out, |_, out, entry| *out = entry);
    }

    /// Replaces each entry of `out` by the free component of a field of slots (global components)
    /// minus the entry.
    pub fn gather_change(&self, field: impl Fn(usize) -> Vec3 + Send + Sync, out: &mut [f64]) {
        self.each_entry(|slot| self.to_local(slot as Slot, field(slot)), out, |_, out, entry| *out = entry - *out);
    }

    /// Writes the value of its slot to each equation.
    pub fn fill(&self, own: impl Fn(usize) -> f64 + Send + Sync, out: &mut [f64]) {
        self.each_entry(|_| Vec3::ZERO, out, |slot, out, _| *out = own(slot));
    }

    /// Calls `show` for each equation with its slot, its item in `list`, and its component of the
    /// local vector of the slot. Parts of the list are processed in parallel.
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

    /// Calls `show` for each free component of the local vector of one slot, with its item in
    /// `list`, which begins with equation `start`.
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
            // Held directions have the number of no equation.
            if let Some(kept) = list.get_mut((number as usize).wrapping_sub(start)) {
                show(kept, entry);
            }
        }
    }

    /// Writes a solution by equation to a field of slots (global components). Held directions take
    /// the components of `held` (global components), or zero.
    pub fn scatter(&self, solution: &[f64], held: Option<&[Vec3]>, out: &mut [Vec3]) {
        threads::each_part(out, |start, out| {
            for (slot, out) in (start..).zip(out) {
                let first = self.before(slot);
                *out = self.at(slot, &solution[first..self.before(slot + 1)], first, held);
            }
        });
    }

    /// Writes a solution, read by equation from a function, to a field of slots (global
    /// components). Held directions become zero.
    pub fn scatter_found(&self, solution: impl Fn(usize) -> f64 + Send + Sync, out: &mut [Vec3]) {
        threads::each_part(out, |start, out| {
            for (slot, out) in (start..).zip(out) {
                let first = self.before(slot);
                let end = self.before(slot + 1);
                let own: [f64; 3] = std::array::from_fn(|k| if first + k < end { solution(first + k) } else { 0.0 });
                *out = self.at(slot, &own[..end - first], first, None);
            }
        });
    }

    /// Vector at a slot (global components), from solution entries of which the first is that of
    /// equation `start`. Held directions take the components of `held`, or zero.
    #[inline(always)]
    pub fn at(&self, slot: usize, solution: &[f64], start: usize, held: Option<&[Vec3]>) -> Vec3 {
        let mut local = held.map_or(Vec3::ZERO, |held| self.to_local(slot as Slot, held[slot]));
        match solution.get(self.before(slot) - start..self.before(slot + 1) - start) {
            Some(&[x, y, z]) => local = Vec3([x, y, z]),
            _ => {
                for (local, number) in local.0.iter_mut().zip(self.of(slot as Slot)) {
                    // Held directions have the number of no equation.
                    *local = solution.get((number as usize).wrapping_sub(start)).copied().unwrap_or(*local);
                }
            }
        }
        self.to_global(slot as Slot, local)
    }

    /// True if no constraint other than the plane of the scene holds the slot.
    #[inline]
    pub fn is_plain(&self, slot: Slot) -> bool {
        !self.freedom[slot as usize].is_constrained()
    }

    /// Projection of a vector at a slot onto its held directions (global components).
    pub fn held_part(&self, slot: Slot, value: Vec3) -> Vec3 {
        let mut local = self.to_local(slot, value);
        for (local, number) in local.0.iter_mut().zip(self.of(slot)) {
            if number != Self::HELD {
                *local = 0.0;
            }
        }
        self.frame(slot).map_or(local, |frame| frame * local)
    }

    /// Global components of a vector given in the local axes of a slot.
    #[inline(always)]
    pub fn to_global(&self, slot: Slot, local: Vec3) -> Vec3 {
        self.axes(slot).map_or(local, |frame| *frame * local)
    }

    /// Components in the local axes of a slot of a vector given in global components.
    #[inline(always)]
    pub fn to_local(&self, slot: Slot, value: Vec3) -> Vec3 {
        self.axes(slot).map_or(value, |frame| frame.transpose_mul(value))
    }
}

/// Held axes of each slot without duplicates. `Err` if two of them are neither parallel nor
/// orthogonal.
fn by_slot(slots: usize, held: &[Direction]) -> Result<Vec<Vec<Vec3>>, FrameConflict> {
    let mut axes: Vec<Vec<Vec3>> = vec![Vec::new(); slots];
    for direction in held {
        let axis = direction.axis;
        let known = &mut axes[direction.slot as usize];
        let spans = known.len() == 3;
        if spans || known.iter().any(|a| a.dot(axis).abs() > 1.0 - AXIS_TOLERANCE) {
            continue;
        }
        if known.iter().any(|a| a.dot(axis).abs() > AXIS_TOLERANCE) {
            return Err(FrameConflict { slot: direction.slot });
        }
        known.push(axis);
    }
    Ok(axes)
}

/// Orthonormal basis of the span of some vectors (Gram-Schmidt).
fn spanned(vectors: impl Iterator<Item = Vec3>) -> Vec<Vec3> {
    let mut out: Vec<Vec3> = Vec::new();
    for vector in vectors {
        let rest = out.iter().fold(vector, |rest, known| rest - *known * known.dot(rest));
        out.extend(rest.normalized().filter(|_| rest.norm() > AXIS_TOLERANCE));
    }
    out
}

/// True if `axis` is parallel to local axis k of the plane.
fn is_axis(plane: &Plane, k: usize, axis: Vec3) -> bool {
    plane.axes().column(k).dot(axis).abs() > 1.0 - GLOBAL_AXIS_TOLERANCE
}

/// Local axes whose first columns are the held directions, and which of them are held; no frame is
/// needed if all held directions are global axes.
fn local_axes(held: &[Vec3]) -> (Option<Mat3>, [bool; 3]) {
    let global = held
        .iter()
        .map(|axis| (0..3).find(|&k| axis.0[k].abs() > 1.0 - GLOBAL_AXIS_TOLERANCE))
        .collect::<Option<Vec<_>>>();
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
