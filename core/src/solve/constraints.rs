//! Tangents with Lagrange multipliers, prepared for a factorisation without pivoting.
//!
//! With the rows B and columns C of the multipliers (C = B^T if the tangent is symmetric) and
//! weights W,
//!
//! ```text
//! | K  C | |u|   |f|                  | K + C W B  C | |u|   |f + C W g|
//! | B  0 | |l| = |g|   is the same as |     B      0 | |l| = |    g    |
//! ```
//!
//! C W B replaces the stiffness that a part has only through its joints: the pivots of the part are
//! then those of a clamped part, and each multiplier, which is eliminated after the unknowns it
//! constrains, has a negative pivot. For any W, the inertia on the space that satisfies the
//! constraints is that of the tangent (congruence with [I, C W/2; 0, I]), and so is the solution.

use crate::model::SlotKind;
use crate::system::{DofMap, Matrix, Pattern, Slot, System};
use std::collections::BTreeMap;

/// Weight of a multiplier, relative to the stiffness of the unknowns it constrains: large enough
/// that these remain stiff when they lose their own stiffness.
const RELATIVE_WEIGHT: f64 = 8.0;

/// A stiffness below this part of the largest one of a constraint is round-off, such as that of the
/// sliding along a line that is nearly straight: a weight from it would leave a pivot of round-off.
/// Displacements are taken in lengths of the scene, rotations in radians.
const NEGLIGIBLE: f64 = 1e-12;

/// No stiffness is taken to be below this part of the largest one of all constraints: what a part resists only by the
/// round-off of the forces in its joints is no stiffness, and a weight from it would leave pivots of round-off.
const LEAST_STIFFNESS: f64 = 1e-10;

/// The multipliers of a pattern, and the values of the last prepared tangent.
#[derive(Clone)]
pub struct Constraints {
    rows: Vec<Multiplier>,
    additions: Vec<WeightedProduct>,
    /// Node blocks of the multipliers, ascending
    node_blocks: Vec<u32>,
    /// Weight W of each multiplier
    weights: Vec<f64>,
    values: Vec<f64>,
}

/// Equation of a multiplier and the unknowns it constrains.
#[derive(Clone)]
struct Multiplier {
    equation: u32,
    ties: Vec<ConstrainedUnknown>,
}

/// An unknown that a multiplier constrains, with the positions of its entries of C and of B.
#[derive(Clone)]
struct ConstrainedUnknown {
    equation: u32,
    /// Square of the unit in which it compares with others
    scale2: f64,
    of_column: usize,
    of_row: usize,
    /// Positions of the entries of its column in the rows of its node, with the product of the units of row and column
    own: Vec<(usize, f64)>,
}

/// An entry of C W B: the position it is added to, the index of the multiplier, and the positions
/// of its factors in C and B.
#[derive(Clone)]
struct WeightedProduct {
    place: usize,
    row: usize,
    of_column: usize,
    of_row: usize,
}

impl Constraints {
    /// Constraints of the slots that are multipliers, among slots of these kinds, in a scene of this
    /// length; `None` if they have no equation.
    pub fn new(pattern: &Pattern, kinds: &[SlotKind], length: f64) -> Option<Self> {
        let slots = || (0..).zip(kinds.iter().copied());
        let equations_of = |slot: Slot| pattern.dof_map.of(slot).into_iter().filter(|&at| at != DofMap::HELD);
        let multipliers: Vec<Slot> = slots().filter(|(_, kind)| kind.is_multiplier()).map(|(slot, _)| slot).collect();
        let equations: Vec<u32> = multipliers.iter().flat_map(|&slot| equations_of(slot)).collect();
        if equations.is_empty() {
            return None;
        }
        let mut is_multiplier = vec![false; pattern.dof_map.count()];
        equations.iter().for_each(|&equation| is_multiplier[equation as usize] = true);
        let scales = SlotKind::scales(kinds, length, &pattern.dof_map);
        let mut columns: BTreeMap<u32, BTreeMap<u32, usize>> = BTreeMap::new();
        let mut place = |row: u32, column: u32| {
            let entries = || pattern.entries(column).map(|entry| (entry.row, entry.place)).collect();
            columns.entry(column).or_insert_with(entries).get(&row).copied()
        };
        let node_block_of = |equation: u32| pattern.node_blocks.of(pattern.dof_map.direction(equation as usize).slot);
        let mut rows = Vec::new();
        let mut additions = Vec::new();
        for (number, &equation) in equations.iter().enumerate() {
            let met: Vec<u32> = pattern.entries(equation).map(|entry| entry.row).collect();
            let others = met.into_iter().filter(|&other| !is_multiplier[other as usize]);
            let tie = |other: u32| {
                let of_column = place(other, equation)?;
                let of_row = place(equation, other)?;
                let scale = scales[other as usize];
                let node = node_block_of(other);
                let of_node = |row: u32| !is_multiplier[row as usize] && node_block_of(row) == node;
                let own = pattern.entries(other).filter(|entry| of_node(entry.row));
                let own = own.map(|entry| (entry.place, scale * scales[entry.row as usize])).collect();
                Some(ConstrainedUnknown { equation: other, scale2: scale.powi(2), of_column, of_row, own })
            };
            let ties: Vec<ConstrainedUnknown> = others.filter_map(tie).collect();
            for (k, a) in ties.iter().enumerate() {
                for b in &ties[k..] {
                    let pair = [place(a.equation, b.equation), place(b.equation, a.equation)];
                    let [Some(above), Some(below)] = pair else { continue };
                    let add = |place, of_column, of_row| WeightedProduct { place, row: number, of_column, of_row };
                    additions.push(add(above, a.of_column, b.of_row));
                    // In symmetric storage both entries have one position.
                    if below != above {
                        additions.push(add(below, b.of_column, a.of_row));
                    }
                }
            }
            rows.push(Multiplier { equation, ties });
        }
        let mut node_blocks: Vec<u32> = multipliers.iter().map(|&slot| pattern.node_blocks.of(slot) as u32).collect();
        node_blocks.sort_unstable();
        node_blocks.dedup();
        let weights = vec![0.0; rows.len()];
        Some(Self { rows, additions, node_blocks, weights, values: Vec::new() })
    }

    /// Node blocks of the multipliers.
    pub fn node_blocks(&self) -> &[u32] {
        &self.node_blocks
    }

    /// Equations of the multipliers.
    pub fn equations(&self) -> impl Iterator<Item = usize> {
        self.rows.iter().map(|row| row.equation as usize)
    }

    /// Number of multipliers.
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Prepares the tangent of a system: K + C W B.
    pub fn take(&mut self, system: &System) {
        let Self { rows, additions, weights, values, .. } = self;
        values.clear();
        values.extend_from_slice(&system.values);
        weigh(rows, values, weights);
        for addition in additions {
            let product = system.values[addition.of_column] * system.values[addition.of_row];
            values[addition.place] += weights[addition.row] * product;
        }
    }

    /// Adds the diagonal of C W B, by equation, for the present values of a system.
    pub fn add_diagonal(&self, system: &System, diagonal: &mut [f64]) {
        let mut weights = vec![0.0; self.rows.len()];
        weigh(&self.rows, &system.values, &mut weights);
        for (row, weight) in self.rows.iter().zip(weights) {
            row.ties.iter().for_each(|tie| diagonal[tie.equation as usize] += weight * tie.square(&system.values));
        }
    }

    /// The prepared tangent, on its pattern.
    pub fn matrix<'a>(&'a self, pattern: &'a Pattern) -> Matrix<'a> {
        Matrix::new(pattern, &self.values)
    }

    /// Prepares a right-hand side: f + C W g.
    pub fn change(&self, right_hand_side: &mut [f64]) {
        for (row, weight) in self.rows.iter().zip(&self.weights) {
            let gap = weight * right_hand_side[row.equation as usize];
            if gap != 0.0 {
                row.ties
                    .iter()
                    .for_each(|tie| right_hand_side[tie.equation as usize] += self.values[tie.of_column] * gap);
            }
        }
    }
}

/// The weight of each multiplier for a tangent.
fn weigh(rows: &[Multiplier], values: &[f64], weights: &mut [f64]) {
    let largest = rows.iter().flat_map(|row| &row.ties).map(|tie| tie.own_stiffness(values)).fold(0.0, f64::max);
    weights.iter_mut().zip(rows).for_each(|(weight, row)| *weight = row.weight(values, LEAST_STIFFNESS * largest));
}

impl ConstrainedUnknown {
    /// Stiffness of the unknown, in comparable units: the largest entry that couples it with its own node. Where forces in
    /// joints turn with a part, its diagonal may be empty.
    fn own_stiffness(&self, values: &[f64]) -> f64 {
        self.own.iter().map(|&(place, scale)| values[place].abs() * scale).fold(0.0, f64::max)
    }

    /// B_k C_k
    fn square(&self, values: &[f64]) -> f64 {
        (values[self.of_column] * values[self.of_row]).abs()
    }
}

impl Multiplier {
    /// Weight from the stiffness of the constrained unknowns, independent of units:
    /// `RELATIVE_WEIGHT`/w = sum B_k C_k/k_k. Each has at least the stiffness `least`.
    fn weight(&self, values: &[f64], least: f64) -> f64 {
        let part = |tie: &ConstrainedUnknown| tie.square(values) * tie.scale2;
        let stiffness = |tie: &ConstrainedUnknown| tie.own_stiffness(values).max(least);
        let most = self.ties.iter().map(part).fold(0.0, f64::max);
        // Coefficients that are round-off do not make an unknown part of the constraint.
        let constrained = self.ties.iter().filter(|tie| part(tie) > NEGLIGIBLE * NEGLIGIBLE * most);
        let stiffest = constrained.map(stiffness).fold(0.0, f64::max);
        let stiff = self.ties.iter().filter(|tie| stiffness(tie) > NEGLIGIBLE * stiffest);
        let softness: f64 = stiff.map(|tie| part(tie) / stiffness(tie)).sum();
        if softness > 0.0 { RELATIVE_WEIGHT / softness } else { 0.0 }
    }
}
