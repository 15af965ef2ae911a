//! Directions of unknowns that no mass resists, where a mass matrix is solved with.
//!
//! The matrix is singular along them. Where the gaps of joints tie such a direction to something
//! that has mass, it follows that motion, and transmits forces: a mass of its own there would take
//! momentum from the rest. Along the other directions solutions are zero.

use crate::model::{Model, SlotKind};
use crate::system::{DofMap, Slot, System};
use crate::tensor::{Mat3, Vec3};
use crate::threads;
use nalgebra::{Matrix3, SymmetricEigen};
use std::collections::{BTreeMap, BTreeSet};

/// The largest eigenvalue of a diagonal block of a mass matrix that counts as zero, over the largest entry
/// of the block.
const NO_MASS: f64 = 1e-12;

/// The largest slope of a gap that counts as zero, over the largest slope of the same gap.
const NO_SLOPE: f64 = 1e-6;

/// The mass that is added where joints tie a direction, over the least mass that it is tied to. Each round
/// of [`Massless::solve`] leaves about this part of its effect.
const ADDED_SHARE: f64 = 1e-6;

/// The most rounds of [`Massless::solve`].
const MOST_ROUNDS: usize = 30;

/// The change of the forces of added masses in a round, over that of the first one, that is round-off.
const ROUND_OFF: f64 = 1e-13;

/// The change in a round, over that in the round before, from which on it is taken for round-off.
const SLOWEST: f64 = 0.95;

/// The directions without mass of a system.
pub(super) struct Massless {
    /// Masses that make the matrix regular, by slot (local axes)
    pub additions: Vec<(Slot, Mat3)>,
    /// True if joints tie some of the directions
    are_tied: bool,
}

/// The directions without mass of a slot.
struct Directions {
    /// Unit vectors in local axes
    axes: Vec<Vec3>,
    /// The added mass
    mass: f64,
    /// True if the slot has mass along other axes
    is_massive: bool,
}

impl Massless {
    /// The directions without mass of a system, which holds its mass matrix. Removes the forces along
    /// those that no joint ties from `right_hand_side`.
    pub fn release(system: &System, model: &Model, right_hand_side: &mut [f64]) -> Self {
        let mut all = massless_directions(system, model);
        let ties = Ties::new(system, model, &all);
        ties.lighten(system, &mut all);
        ties.remove_free_forces(system, &all, right_hand_side);
        let addition = |(&slot, Directions { axes, mass, .. }): (&Slot, &Directions)| {
            (slot, axes.iter().fold(Mat3::ZERO, |sum, &axis| sum + axis.outer(axis)).scale(*mass))
        };
        Self { additions: all.iter().map(addition).collect(), are_tied: !ties.rows.is_empty() }
    }

    /// Solves with the matrix that has the additions, for the solution without them: their forces
    /// are added to the right-hand side until they change no more.
    pub fn solve(
        &self,
        dof_map: &DofMap,
        right_hand_side: &mut [f64],
        mut solve: impl FnMut(&mut [f64]) -> bool,
    ) -> bool {
        if !self.are_tied {
            return solve(right_hand_side);
        }
        let given = right_hand_side.to_vec();
        let mut solved = solve(right_hand_side);
        let mut last = vec![Vec3::ZERO; self.additions.len()];
        let (mut first_change, mut last_change) = (0.0, f64::INFINITY);
        for round in 0..MOST_ROUNDS {
            let force = |(slot, mass): &(Slot, Mat3)| *mass * at(dof_map, *slot, right_hand_side);
            let forces: Vec<Vec3> = self.additions.iter().map(force).collect();
            let change = forces.iter().zip(&last).fold(0.0, |m: f64, (&now, &last)| m.max((now - last).norm()));
            first_change = if round == 0 { change } else { first_change };
            // What does not fall any more is round-off.
            if !solved || change <= ROUND_OFF * first_change || change >= SLOWEST * last_change {
                break;
            }
            right_hand_side.copy_from_slice(&given);
            let additions = self.additions.iter().zip(&forces);
            additions.for_each(|((slot, _), &force)| add(dof_map, *slot, force, right_hand_side));
            solved = solve(right_hand_side);
            (last, last_change) = (forces, change);
        }
        solved
    }
}

/// The local vector of a slot, with zeros for held directions.
fn at(dof_map: &DofMap, slot: Slot, entries: &[f64]) -> Vec3 {
    Vec3(dof_map.of(slot).map(|number| if number == DofMap::HELD { 0.0 } else { entries[number as usize] }))
}

/// Adds a local vector to a slot, in its free directions.
fn add(dof_map: &DofMap, slot: Slot, vector: Vec3, entries: &mut [f64]) {
    let numbers = dof_map.of(slot).into_iter().zip(vector.0);
    numbers.filter(|&(number, _)| number != DofMap::HELD).for_each(|(number, value)| entries[number as usize] += value);
}

/// The null directions of the diagonal blocks of a mass matrix, by slot; each with as much mass as
/// the slot has along others, or with 1.
fn massless_directions(system: &System, model: &Model) -> BTreeMap<Slot, Directions> {
    let is_massive = threads::list(model.slots(), |slot| is_regular(&with_mass_where_held(system, slot as Slot).0));
    // Sliding follows from the gaps.
    let moves = |slot: &usize| matches!(model.kinds[*slot], SlotKind::Displacement | SlotKind::Rotation);
    let directions = |slot: usize| {
        let (block, mass) = with_mass_where_held(system, slot as Slot);
        let eigen = eigen_of(&block);
        let is_none = |k: &usize| eigen.eigenvalues[*k].abs() <= NO_MASS * mass;
        let axis = |k: usize| Vec3([0, 1, 2].map(|i| eigen.eigenvectors[(i, k)]));
        let is_massive = system.own_block(slot as Slot).max_abs() > 0.0;
        (slot as Slot, Directions { axes: (0..3).filter(is_none).map(axis).collect(), mass, is_massive })
    };
    (0..model.slots()).filter(moves).filter(|&slot| !is_massive[slot]).map(directions).collect()
}

/// Gaps of joints that change with directions without mass.
struct Ties {
    /// The slopes of each gap by slot (local axes): lengths over displacements, and over rotations
    /// times the length of the scene; the largest of a gap is about 1
    rows: Vec<Vec<(Slot, Vec3)>>,
    /// The length of the scene for rotations, 1 for displacements: by slot
    scale: Vec<f64>,
}

impl Ties {
    fn new(system: &System, model: &Model, all: &BTreeMap<Slot, Directions>) -> Self {
        let dof_map = &system.pattern.dof_map;
        let scale = threads::list(model.slots(), |slot| match model.kinds[slot] {
            SlotKind::Rotation | SlotKind::Moment => model.length,
            SlotKind::Displacement | SlotKind::Sliding | SlotKind::Force => 1.0,
        });
        let row = |equation: u32| {
            let mut slopes: BTreeMap<Slot, Vec3> = BTreeMap::new();
            for entry in system.pattern.entries(equation) {
                let (slot, k) = dof_map.origin(entry.row as usize);
                if !model.kinds[slot as usize].is_multiplier() {
                    slopes.entry(slot).or_insert(Vec3::ZERO).0[k as usize] =
                        system.values[entry.place] / scale[slot as usize];
                }
            }
            let largest = slopes.values().fold(0.0, |m: f64, slope| m.max(slope.norm()));
            let slopes = slopes.into_iter().map(|(slot, slope)| (slot, slope * (1.0 / largest)));
            slopes.filter(|(_, slope)| slope.norm() > NO_SLOPE).collect()
        };
        let equations =
            model.multipliers.iter().flat_map(|&slot| dof_map.of(slot)).filter(|&number| number != DofMap::HELD);
        let ties = |row: &Vec<(Slot, Vec3)>| {
            let mut slopes = row.iter().filter_map(|(slot, slope)| Some((all.get(slot)?, slope)));
            slopes.any(|(directions, slope)| directions.axes.iter().any(|axis| axis.dot(*slope).abs() > NO_SLOPE))
        };
        let rows = if all.is_empty() { Vec::new() } else { equations.map(row).filter(ties).collect() };
        Self { rows, scale }
    }

    /// Gives directions that are tied, over several joints or one, to something that has mass a small
    /// part of that.
    fn lighten(&self, system: &System, all: &mut BTreeMap<Slot, Directions>) {
        let own_mass = |slot: Slot| {
            let eigen = eigen_of(&system.own_block(slot)).eigenvalues;
            let largest = eigen.iter().fold(0.0, |m: f64, mass| m.max(mass.abs()));
            let least =
                eigen.iter().filter(|&&mass| mass > NO_MASS * largest).fold(f64::INFINITY, |m, &mass| m.min(mass));
            least / self.scale[slot as usize].powi(2)
        };
        let is_massive = |slot: Slot| all.get(&slot).is_none_or(|directions| directions.is_massive);
        let slots = self.rows.iter().flatten().map(|&(slot, _)| slot);
        let mut known: BTreeMap<Slot, f64> =
            slots.filter(|&slot| is_massive(slot)).map(|slot| (slot, own_mass(slot))).collect();
        loop {
            let mut found: BTreeMap<Slot, f64> = BTreeMap::new();
            for row in &self.rows {
                let masses = row.iter().filter_map(|(slot, slope)| Some(known.get(slot)? / slope.squared()));
                let of_gap = masses.fold(f64::INFINITY, f64::min);
                for (slot, slope) in row.iter().filter(|(slot, _)| !known.contains_key(slot)) {
                    let least = found.entry(*slot).or_insert(f64::INFINITY);
                    *least = least.min(of_gap * slope.squared());
                }
            }
            found.retain(|_, mass| mass.is_finite());
            if found.is_empty() {
                break;
            }
            known.extend(found);
        }
        for (slot, mass) in known {
            if let Some(directions) = all.get_mut(&slot) {
                directions.mass = ADDED_SHARE * mass * self.scale[slot as usize].powi(2);
            }
        }
    }

    /// Removes the forces along directions that no joint ties from a right-hand side.
    fn remove_free_forces(&self, system: &System, all: &BTreeMap<Slot, Directions>, right_hand_side: &mut [f64]) {
        let dof_map = &system.pattern.dof_map;
        let mut free = Along::new();
        let tied = self.tied(all);
        let mut is_tied: BTreeSet<Slot> = BTreeSet::new();
        tied.iter().for_each(|along| is_tied.extend(along.keys().map(|(slot, _)| *slot)));
        for (&slot, directions) in all {
            let force = at(dof_map, slot, right_hand_side);
            let along = directions.axes.iter().map(|axis| axis.dot(force));
            if is_tied.contains(&slot) {
                let scale = self.scale[slot as usize];
                free.extend(along.enumerate().map(|(k, force)| ((slot, k), force / scale)));
            } else {
                let taken =
                    directions.axes.iter().zip(along).fold(Vec3::ZERO, |sum, (axis, force)| sum - *axis * force);
                add(dof_map, slot, taken, right_hand_side);
            }
        }
        for along in tied {
            let part = dot(&along, &free);
            add_times(&mut free, &along, -part);
        }
        for ((slot, k), force) in free {
            let taken = all[&slot].axes[k] * (-force * self.scale[slot as usize]);
            add(dof_map, slot, taken, right_hand_side);
        }
    }

    /// An orthonormal basis of the slopes of gaps along directions without mass.
    fn tied(&self, all: &BTreeMap<Slot, Directions>) -> Vec<Along> {
        let mut basis: Vec<Along> = Vec::new();
        let mut of_slot: BTreeMap<Slot, Vec<usize>> = BTreeMap::new();
        for row in &self.rows {
            let along = |&(slot, slope): &(Slot, Vec3)| {
                let axes = all.get(&slot).into_iter().flat_map(|directions| directions.axes.iter().enumerate());
                axes.map(move |(k, axis)| ((slot, k), axis.dot(slope)))
            };
            let mut rest: Along = row.iter().flat_map(along).collect();
            // Those at other slots are orthogonal to it.
            let mut others: Vec<usize> =
                rest.keys().filter_map(|(slot, _)| of_slot.get(slot)).flatten().copied().collect();
            others.sort_unstable();
            others.dedup();
            for other in others {
                let part = dot(&basis[other], &rest);
                add_times(&mut rest, &basis[other], -part);
            }
            let size = dot(&rest, &rest).sqrt();
            if size > NO_SLOPE {
                rest.values_mut().for_each(|slope| *slope /= size);
                for &(slot, _) in rest.keys() {
                    let list = of_slot.entry(slot).or_default();
                    if list.last() != Some(&basis.len()) {
                        list.push(basis.len());
                    }
                }
                basis.push(rest);
            }
        }
        basis
    }
}

/// Components along directions without mass: by slot and number of the direction.
type Along = BTreeMap<(Slot, usize), f64>;

fn dot(a: &Along, b: &Along) -> f64 {
    a.iter().filter_map(|(place, a)| Some(a * b.get(place)?)).sum()
}

fn add_times(to: &mut Along, what: &Along, factor: f64) {
    what.iter().for_each(|(&place, value)| *to.entry(place).or_insert(0.0) += factor * value);
}

/// The diagonal block of a mass matrix at a slot, and its largest entry. A held direction is given
/// as much, so that it does not count as massless.
fn with_mass_where_held(system: &System, slot: Slot) -> (Mat3, f64) {
    let (mut block, numbers) = (system.own_block(slot), system.pattern.dof_map.of(slot));
    let mass = if block.max_abs() > 0.0 { block.max_abs() } else { 1.0 };
    for k in (0..3).filter(|&k| numbers[k] == DofMap::HELD) {
        block.0[k][k] += mass;
    }
    (block, mass)
}

fn eigen_of(block: &Mat3) -> SymmetricEigen<f64, nalgebra::Const<3>> {
    SymmetricEigen::new(Matrix3::from_fn(|i, j| 0.5 * (block.0[i][j] + block.0[j][i])))
}

/// True if a matrix has no eigenvalue that is next to nothing beside its entries: none is larger
/// than three times the largest of these.
fn is_regular(matrix: &Mat3) -> bool {
    let [a, b, c] = matrix.0.map(Vec3);
    a.dot(b.cross(c)).abs() > 1e-9 * matrix.max_abs().powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::Rotation;

    #[test]
    fn what_is_regular_has_no_eigenvalue_next_to_nothing() {
        let turn = Rotation::new(Vec3([0.3, -1.1, 0.7])).r;
        let with = |eigenvalues: [f64; 3]| turn * Mat3::diagonal(eigenvalues) * turn.transpose() * 1e5;
        let smallest = |matrix: &Mat3| {
            let eigen = SymmetricEigen::new(Matrix3::from_fn(|i, j| matrix.0[i][j])).eigenvalues;
            eigen.iter().fold(f64::INFINITY, |m: f64, e| m.min(e.abs())) / matrix.max_abs()
        };
        for (third, regular) in [(1.0, true), (1e-3, true), (1e-8, true), (1e-11, false), (1e-13, false), (0.0, false)]
        {
            let matrix = with([2.0, 1.0, third]);
            assert_eq!(is_regular(&matrix), regular, "{third}");
            assert!(!is_regular(&matrix) || smallest(&matrix) > 1e-12, "{third}");
        }
        let none = [Mat3::ZERO, with([f64::NAN, 1.0, 1.0]), Mat3::ZERO * f64::NAN];
        assert!(!none.iter().any(is_regular));
    }
}
