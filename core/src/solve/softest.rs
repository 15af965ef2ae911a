//! Softest motion of a tangent, by inverse iteration.

use super::linear::LinearSolver;
use super::tangent::Tangent;
use crate::interrupt;
use crate::kernel::WIDTH;
use crate::scalar::Instructions;
use crate::system::{DofMap, System};
use crate::tensor::Vec3;
use crate::threads;
use std::ops::Range;

/// Motion of least stiffness, with no stiffness at all unless it is `held`.
#[derive(Clone, Debug, PartialEq)]
pub struct NullVector {
    /// Motion by equation, scaled by the roots of the diagonal so that entries of all units compare
    entries: Vec<f64>,
    /// Motion by equation, in units of the unknowns
    pub(crate) motion: Vec<f64>,
    /// True if the tangent has stiffness against the motion
    pub(crate) held: bool,
    /// True if no factorisation of the tangent has succeeded
    pub(crate) broke_down: bool,
}

impl NullVector {
    /// Number of decimal digits of the stiffness against the motion that round-off in the tangent
    /// leaves.
    pub fn digits(&self, system: &System) -> f64 {
        stiffness_of(system, &self.motion).max(1.0).log10()
    }

    /// The slot with the largest scaled motion, and the motion by slot (global components).
    pub fn by_slot(&self, dof_map: &DofMap, slots: usize) -> (usize, Vec<Vec3>) {
        let field = |entries: &[f64]| {
            let mut field = vec![Vec3::ZERO; slots];
            dof_map.scatter(entries, None, &mut field);
            field
        };
        let compared = field(&self.entries);
        let larger = |best: usize, slot: usize| if compared[slot].norm() > compared[best].norm() { slot } else { best };
        ((0..slots).fold(0, larger), field(&self.motion))
    }
}

/// Ratio of x.Jx to its round-off, eps sqrt(sum (x_i J_ij x_j)^2), below which a direction has no
/// stiffness.
const MIN_STIFFNESS_RATIO: f64 = 8.0;

/// Number of decimal digits of the softest stiffness that a block factorisation must leave.
const MIN_STIFFNESS_DIGITS: f64 = 4.0;

/// Sum of multiplier forces, relative to the sum of their magnitudes, below which they cancel.
const CANCELLATION_RATIO: f64 = 1e-10;

impl LinearSolver {
    /// Direction in which the tangent has no stiffness, if there is one.
    pub fn null_vector(&mut self, tangent: &mut Tangent) -> Option<NullVector> {
        self.softest(tangent).filter(|vector| !vector.held)
    }

    /// Direction in which the tangent has the least stiffness, by inverse iteration; for a tangent
    /// that stays, with the last factorisation. Unknowns are scaled by their diagonal, so that
    /// forces and moments compare. `None` if there are no equations, the iteration fails or is
    /// interrupted.
    pub fn softest(&mut self, tangent: &mut Tangent) -> Option<NullVector> {
        if interrupt::is_requested() {
            return None;
        }
        let system = tangent.look();
        if system.pattern.dof_map.count() == 0 {
            return None;
        }
        let diagonal = diagonal(system);
        let empty = empty_column(system, &diagonal);
        let scale = scales(system, self.stiffened(system, diagonal));
        let broke_down = !(if tangent.stays() { self.factored } else { self.factorise_new(tangent).is_done });
        if let Some(empty) = empty {
            let mut entries = vec![0.0; tangent.system().pattern.dof_map.count()];
            entries[empty] = 1.0;
            return Some(NullVector { motion: entries.clone(), entries, held: false, broke_down });
        }
        let mut x = threads::list(scale.len(), |k| 0.5 + (k as f64 * 0.618_033_988_749_895).fract());
        let scaled = |x: &mut [f64], by: f64| {
            threads::each_part(x, |start, x| x.iter_mut().zip(&scale[start..]).for_each(|(x, s)| *x *= s / by));
        };
        for _ in 0..3 {
            scaled(&mut x, 1.0);
            if !self.solve_once(tangent.system(), &mut x) {
                return self.null_vector_of_shifted(tangent.look(), broke_down);
            }
            let largest = threads::largest(x.len(), |part| part.fold(0.0, |m: f64, k| m.max((x[k] * scale[k]).abs())));
            scaled(&mut x, largest);
        }
        let mut motion = scale;
        threads::each_part(&mut motion, |start, part| {
            part.iter_mut().zip(&x[start..]).for_each(|(scale, x)| *scale = x / *scale)
        });
        let system = tangent.look();
        let held = stiffness_of(system, &motion) > MIN_STIFFNESS_RATIO && !self.is_redundant(system, &x, &motion);
        Some(NullVector { entries: x, motion, held, broke_down: false })
    }

    /// The diagonal with the stiffness by which joints hold what has none of its own.
    fn stiffened(&self, system: &System, mut diagonal: Vec<f64>) -> Vec<f64> {
        if let Some(constraints) = self.constraints() {
            constraints.add_diagonal(system, &mut diagonal);
        }
        diagonal
    }

    /// Chooses the method for the next attempt after Newton's iteration has failed: partial
    /// pivoting if the block factorisation leaves few digits of the softest stiffness, and the
    /// block solver again if partial pivoting has not helped.
    pub fn doubt(&mut self, tangent: &mut Tangent) {
        if self.gives_way_to_blocks() {
            return;
        }
        // The factorisation may be that of the iterate before; either solution may change the
        // method itself.
        let softest = self.softest(tangent).filter(|vector| !vector.broke_down);
        let is_doubtful = softest.is_some_and(|vector| vector.digits(tangent.look()) < MIN_STIFFNESS_DIGITS);
        if is_doubtful && self.is_in_blocks() {
            self.factored = self.leave_blocks(tangent.look());
        }
    }

    /// True if the largest scaled components are multipliers whose forces cancel, which belong to
    /// redundant constraints. Their values are round-off and have no stiffness.
    fn is_redundant(&self, system: &System, entries: &[f64], motion: &[f64]) -> bool {
        let Some(constraints) = self.constraints() else { return false };
        let mut multipliers = vec![0.0; motion.len()];
        constraints.equations().for_each(|k| multipliers[k] = motion[k]);
        let largest = |of_multipliers: bool| {
            let kind = entries.iter().zip(&multipliers).filter(|(_, m)| (**m != 0.0) == of_multipliers);
            kind.fold(0.0_f64, |largest, (entry, _)| largest.max(entry.abs()))
        };
        if largest(true) <= largest(false) {
            return false;
        }
        let sizes: Vec<f64> = system.values.iter().map(|v| v.abs()).collect();
        let all: Vec<f64> = multipliers.iter().map(|v| v.abs()).collect();
        let left = system.multiply(&system.values, &multipliers);
        let all = system.multiply(&sizes, &all);
        left.iter().zip(&all).all(|(left, all)| left.abs() <= CANCELLATION_RATIO * all)
    }

    /// Direction of least stiffness after a failed factorisation, of a tangent with a slightly
    /// raised diagonal.
    fn null_vector_of_shifted(&mut self, system: &System, broke_down: bool) -> Option<NullVector> {
        if interrupt::is_requested() {
            return None;
        }
        let mut shifted = system.clone();
        // Multipliers have a zero diagonal and get a small compliance.
        let shift = |value: f64| if value == 0.0 { -1e-12 } else { value * (1.0 + 1e-10) };
        system.pattern.each_diagonal(|_, place| shifted.values[place] = shift(shifted.values[place]));
        if !self.factorise(&shifted) {
            return None;
        }
        let mut x = vec![1.0; system.pattern.dof_map.count()];
        for _ in 0..3 {
            if !self.solve_once(&shifted, &mut x) {
                return None;
            }
            let largest = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            x.iter_mut().for_each(|x| *x /= largest);
        }
        Some(NullVector { motion: x.clone(), entries: x, held: false, broke_down })
    }
}

fn diagonal(system: &System) -> Vec<f64> {
    let mut diagonal = vec![0.0; system.pattern.dof_map.count()];
    system.pattern.each_region(&mut diagonal, |region, own| {
        let node_blocks = region.node_blocks.clone();
        let first = region.equations.start;
        system.pattern.each_diagonal_of(node_blocks, |equation, place| own[equation - first] = system.values[place]);
    });
    diagonal
}

/// Scales of the unknowns: the root of the diagonal; for unknowns without one, such as multipliers,
/// a scale that makes their column comparable.
fn scales(system: &System, mut diagonal: Vec<f64>) -> Vec<f64> {
    threads::each_part(&mut diagonal, |_, part| part.iter_mut().for_each(|entry| *entry = entry.abs().sqrt()));
    let roots = &diagonal;
    let column = |c: usize| {
        let compared = entries(system, c).map(|(row, value)| (value, roots[row]));
        compared.filter(|&(_, root)| root > 0.0).fold(0.0_f64, |m, (value, root)| m.max(value.abs() / root))
    };
    let entry = |c: usize| entries(system, c).fold(0.0_f64, |m, (_, value)| m.max(value.abs()));
    let scale = |c: usize| match column(c) {
        compared if compared > 0.0 => compared,
        // Unknowns and multipliers that are coupled with each other only.
        _ => entry(c).sqrt().max(f64::MIN_POSITIVE),
    };
    let without: Vec<usize> = (0..roots.len()).filter(|&c| roots[c].is_nan() || roots[c] <= 0.0).collect();
    let scales = threads::list(without.len(), |k| scale(without[k]));
    without.into_iter().zip(scales).for_each(|(c, scale)| diagonal[c] = scale);
    diagonal
}

/// Rows and values of the entries of a column.
fn entries(system: &System, column: usize) -> impl Iterator<Item = (usize, f64)> {
    system.pattern.entries(column as u32).map(|entry| (entry.row as usize, system.values[entry.place]))
}

/// The first column whose entries are all zero.
fn empty_column(system: &System, diagonal: &[f64]) -> Option<usize> {
    let is_empty = |column: usize| entries(system, column).all(|(_, value)| value == 0.0);
    threads::first(diagonal.len(), |mut part| part.find(|&column| diagonal[column] == 0.0 && is_empty(column)))
}

/// Ratio of |x.Jx| to the round-off of its terms, eps sqrt(sum (x_i J_ij x_j)^2). The sum itself is
/// compensated, so that fine meshes of slender beams, whose softest motions are nearly free, are
/// not taken for mechanisms.
fn stiffness_of(system: &System, x: &[f64]) -> f64 {
    if system.pattern.width() == WIDTH { stiffness_in::<WIDTH>(system, x) } else { stiffness_in::<3>(system, x) }
}

/// Relative error of x.Jx that round-off in the entries of J may cause.
pub(super) fn lost_part(system: &System, x: &[f64]) -> f64 {
    1.0 / stiffness_of(system, x).max(1.0)
}

fn stiffness_in<const W: usize>(system: &System, x: &[f64]) -> f64 {
    let mut whole = Compensated::default();
    let mut squares = 0.0;
    let add = |(sums, part): ([Compensated; W], [f64; W])| {
        sums.iter().flat_map(|sum| [sum.sum, sum.lost]).for_each(|term| whole.add(term));
        squares += part.iter().sum::<f64>();
    };
    let parts = threads::parts(system.pattern.node_blocks.count());
    threads::in_order(parts, |columns| stiffness_of_columns(system, x, columns), add);
    if squares == 0.0 { 0.0 } else { (whole.sum + whole.lost).abs() / (f64::EPSILON * squares.sqrt()) }
}

/// Sums over some columns of tiles of the terms of x.Jx and of their squares, separately for each
/// row of a tile: independent sums are faster.
fn stiffness_of_columns<const W: usize>(
    system: &System,
    x: &[f64],
    columns: Range<usize>,
) -> ([Compensated; W], [f64; W]) {
    let mut sums = [Compensated::default(); W];
    let mut squares = [0.0; W];
    let pattern = &system.pattern;
    Instructions::here().run(
        #[inline(always)]
        || {
            system.each_tile::<W>(columns, |row, column, tile| {
                // Tiles that are not stored count as well.
                let times = if pattern.symmetry.halves() && row != column { 2.0 } else { 1.0 };
                let of_row = pattern.part::<W>(row, x);
                let of_column = pattern.part::<W>(column, x);
                for (line, x) in tile.iter().zip(of_column) {
                    for r in 0..W {
                        let term = of_row[r] * line[r] * x;
                        sums[r].add(times * term);
                        squares[r] += times * term * term;
                    }
                }
            });
        },
    );
    (sums, squares)
}

/// A compensated sum (Knuth's two-sum, which needs no branch).
#[derive(Clone, Copy, Default)]
struct Compensated {
    sum: f64,
    lost: f64,
}

impl Compensated {
    #[inline(always)]
    fn add(&mut self, term: f64) {
        let next = self.sum + term;
        let came = next - self.sum;
        self.lost += (self.sum - (next - came)) + (term - came);
        self.sum = next;
    }
}
