//! The line of a beam on which a node slides: the smooth curve through the nodes of the beam.
//!
//! Between nodes the curve is a cubic polynomial of the initial arc length s, with the slope at each
//! node of the parabola through it and its two neighbours (Catmull and Rom 1974, with unequal
//! distances). It has no kinks, so that a node slides over the nodes of the beam, and its weights
//! depend on s alone: x(s) = sum_k N_k(s) x_k. They reproduce parabolas, and add up to one, so that
//! force and moment of the node on the beam are exact. Beyond its ends the curve is straight.

use super::element::ElementSystem;
use super::joint::GapFactors;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};
use std::ops::Range;

/// The most nodes that a place on the line depends on.
pub const STENCIL: usize = 4;

/// Weights of the nodes of a stencil at a place of the line, with derivatives over s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuideWeights<T = f64> {
    /// N_k
    values: [T; STENCIL],
    /// dN_k/ds, 1/length
    slopes: [T; STENCIL],
    /// d2N_k/ds2, 1/length^2
    curvatures: [T; STENCIL],
}

/// The nodes on which the line between nodes `element` and `element + 1` depends, of `count` nodes.
pub fn stencil(element: usize, count: usize) -> Range<usize> {
    element.saturating_sub(1)..(element + 3).min(count)
}

/// The element with the place s; the first or the last one beyond the ends. `knots` are the arc
/// lengths of the nodes, ascending.
pub fn element_at(knots: &[f64], s: f64) -> usize {
    knots.partition_point(|&knot| knot <= s).clamp(1, knots.len() - 1) - 1
}

/// Weights of the nodes of the stencil of an element at the place s, which may lie beyond the ends.
pub fn weights(knots: &[f64], element: usize, s: f64) -> GuideWeights {
    let inside = s.clamp(knots[0], knots[knots.len() - 1]);
    let at = weights_inside(knots, element, inside);
    if s == inside {
        return at;
    }
    let values = std::array::from_fn(|k| at.values[k] + (s - inside) * at.slopes[k]);
    GuideWeights { values, slopes: at.slopes, curvatures: [0.0; STENCIL] }
}

/// Weights of the nodes of the stencil of an element at the place s of this element.
pub fn weights_inside<T: Real>(knots: &[f64], element: usize, s: T) -> GuideWeights<T> {
    let number = T::constant;
    let width = knots[element + 1] - knots[element];
    let x = (s - number(knots[element])) * (1.0 / width);
    // Hermite polynomials of both ends' values and slopes, with derivatives over x.
    let end = [x * x * (number(3.0) - x * 2.0), x * (number(1.0) - x) * 6.0, number(6.0) - x * 12.0];
    let rest = number(1.0) - x;
    let start_slope = [x * rest * rest, rest * (number(1.0) - x * 3.0), x * 6.0 - number(4.0)];
    let end_slope = [-(x * x * rest), x * (x * 3.0 - number(2.0)), x * 6.0 - number(2.0)];
    let slope_at_start = slope_at(knots, element);
    let slope_at_end = slope_at(knots, element + 1);
    let row = |derivative: usize, one: f64| {
        let scale = width.powi(-(derivative as i32));
        let mut row = [T::zero(); STENCIL];
        for (weight, node) in row.iter_mut().zip(stencil(element, knots.len())) {
            let turned = start_slope[derivative] * (width * slope_at_start(node))
                + end_slope[derivative] * (width * slope_at_end(node));
            let of_start = if node == element { number(one) - end[derivative] } else { T::zero() };
            let of_end = if node == element + 1 { end[derivative] } else { T::zero() };
            *weight = (of_start + of_end + turned) * scale;
        }
        row
    };
    GuideWeights { values: row(0, 1.0), slopes: row(1, 0.0), curvatures: row(2, 0.0) }
}

/// The weights of nodes in the slope of the line at a node: that of the parabola through the node
/// and its neighbours, at an end through the three nodes there. A line of two nodes is straight.
fn slope_at(knots: &[f64], node: usize) -> impl Fn(usize) -> f64 {
    let last = knots.len() - 1;
    let middle = node.clamp(1, last.max(2) - 1);
    let chord = |k: usize| {
        let width = knots[k + 1] - knots[k];
        move |of: usize| f64::from(i8::from(of == k + 1) - i8::from(of == k)) / width
    };
    let before = chord(middle - 1);
    let after = chord(middle.min(last - 1));
    let left = knots[middle] - knots[middle - 1];
    let right = knots[(middle + 1).min(last)] - knots[middle];
    let share = right / (left + right);
    move |of| {
        let mean = before(of) * share + after(of) * (1.0 - share);
        if last == 1 || node == middle {
            mean
        } else if node < middle {
            2.0 * before(of) - mean
        } else {
            2.0 * after(of) - mean
        }
    }
}

/// The blocks of the system of a sliding joint; the nodes of the stencil follow.
pub mod block {
    /// Displacement of the node that slides
    pub const NODE: usize = 0;
    /// The sliding, in the first component
    pub const SLIDE: usize = 1;
    /// Multipliers: the force on the node that slides, spatial
    pub const FORCE: usize = 2;
    /// The first node of the stencil
    pub const GUIDE: usize = 3;
}

/// The line at a place, with its derivatives over s.
#[derive(Clone, Copy, Debug)]
pub struct LinePoint<T = f64> {
    /// x(s)
    pub place: Vec3<T>,
    /// dx/ds
    pub(crate) slope: Vec3<T>,
    /// d2x/ds2
    pub(crate) curvature: Vec3<T>,
}

impl<T: Real> LinePoint<T> {
    /// The line through the places of the nodes of a stencil.
    pub fn new(weights: &GuideWeights<T>, nodes: &[Vec3<T>]) -> Self {
        let sum = |weights: &[T; STENCIL]| {
            nodes.iter().zip(weights).fold(Vec3::zero(), |sum, (node, &weight)| sum + *node * weight)
        };
        Self { place: sum(&weights.values), slope: sum(&weights.slopes), curvature: sum(&weights.curvatures) }
    }
}

/// Adds the forces of L = `force` . (x_node - x(s)), conjugate to the blocks of [`block`], with their
/// tangent and the gap.
pub fn add_slide<T: Real>(
    weights: &GuideWeights<T>,
    line: &LinePoint<T>,
    nodes: usize,
    place: Vec3<T>,
    force: Vec3<T>,
    factors: GapFactors,
    out: &mut ElementSystem<T>,
) {
    let first = Vec3([T::one(), T::zero(), T::zero()]);
    out.add_force(block::NODE, force);
    out.add_force(block::SLIDE, -first * line.slope.dot(force));
    out.add_force(block::FORCE, place - line.place);
    for k in 0..nodes {
        out.add_force(block::GUIDE + k, -force * weights.values[k]);
    }
    let mut both = |row: usize, column: usize, block: Mat3<T>| {
        out.add_tangent(row, column, block);
        out.add_tangent(column, row, block.transpose());
    };
    let GapFactors { forces, multiplier } = factors;
    if multiplier != 0.0 {
        let identity = Mat3::identity().scale(multiplier);
        both(block::NODE, block::FORCE, identity);
        both(block::SLIDE, block::FORCE, -first.outer(line.slope.scale(multiplier)));
        for k in 0..nodes {
            both(block::GUIDE + k, block::FORCE, -(identity * weights.values[k]));
        }
    }
    if forces != 0.0 {
        for k in 0..nodes {
            let turned = force.scale(-forces) * weights.slopes[k];
            both(block::GUIDE + k, block::SLIDE, turned.outer(first));
        }
        let bent = line.curvature.scale(-forces).dot(force);
        out.add_tangent(block::SLIDE, block::SLIDE, first.outer(first * bent));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::contact::dual::Dual;

    const KNOTS: [f64; 5] = [0.0, 0.7, 1.1, 2.0, 2.4];

    /// u_node, s, force and four nodes of the line.
    const UNKNOWNS: usize = 3 * 7;

    #[test]
    fn weights_reproduce_parabolas_and_have_no_kinks() {
        let parabola = |s: f64| 0.3 - 1.2 * s + 0.8 * s * s;
        for element in 0..4 {
            let nodes = stencil(element, KNOTS.len());
            let sum = |weights: [f64; STENCIL]| -> f64 {
                nodes.clone().zip(weights).map(|(k, weight)| weight * parabola(KNOTS[k])).sum()
            };
            for x in [0.0, 0.3, 1.0] {
                let s = KNOTS[element] + x * (KNOTS[element + 1] - KNOTS[element]);
                let at = weights(&KNOTS, element, s);
                assert!((sum(at.values) - parabola(s)).abs() < 1e-14);
                assert!((sum(at.slopes) - (1.6 * s - 1.2)).abs() < 1e-13);
                assert!((sum(at.curvatures) - 1.6).abs() < 1e-12);
                assert!((at.values.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            }
        }
        for inner in 1..4 {
            let before = weights(&KNOTS, inner - 1, KNOTS[inner]);
            let after = weights(&KNOTS, inner, KNOTS[inner]);
            let slope = |at: &GuideWeights, element: usize, node: usize| {
                stencil(element, KNOTS.len()).position(|k| k == node).map_or(0.0, |k| at.slopes[k])
            };
            for node in 0..KNOTS.len() {
                assert!((slope(&before, inner - 1, node) - slope(&after, inner, node)).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn two_nodes_make_a_straight_line() {
        let at = weights(&[0.0, 2.0], 0, 0.5);
        assert_eq!(at.values[..2], [0.75, 0.25]);
        assert_eq!(at.slopes[..2], [-0.5, 0.5]);
    }

    #[test]
    fn the_line_goes_on_straight_beyond_its_end() {
        let end = weights(&KNOTS, 3, 2.4);
        let beyond = weights(&KNOTS, 3, 2.9);
        assert_eq!(end.slopes, beyond.slopes);
        assert_eq!(beyond.curvatures, [0.0; STENCIL]);
        assert!((beyond.values[2] - (end.values[2] + 0.5 * end.slopes[2])).abs() < 1e-15);
    }

    /// Forces are the gradient of force . (x_node - x(s)), and the tangent is that of the forces.
    #[test]
    fn the_tangent_is_that_of_dual_numbers() {
        let value = |k: usize| 0.4 + (1.7 * k as f64).sin();
        for element in 0..4 {
            let count = stencil(element, KNOTS.len()).len();
            let variable = |k: usize| Dual::<UNKNOWNS>::variable(value(k), k);
            let vector = |block: usize| Vec3([0, 1, 2].map(|k| variable(3 * block + k)));
            let inside = KNOTS[element] + 0.37 * (KNOTS[element + 1] - KNOTS[element]);
            let s = Dual::variable(inside, 3 * block::SLIDE);
            let weights = weights_inside(&KNOTS, element, s);
            let nodes: Vec<Vec3<Dual<UNKNOWNS>>> = (0..count).map(|k| vector(block::GUIDE + k)).collect();
            let line = LinePoint::new(&weights, &nodes);
            let place = vector(block::NODE);
            let force = vector(block::FORCE);
            let factors = GapFactors { forces: 1.0, multiplier: 1.0 };
            let mut out = ElementSystem::new(block::GUIDE + count);
            add_slide(&weights, &line, count, place, force, factors, &mut out);
            let potential = force.dot(place - line.place);
            for row in 0..block::GUIDE + count {
                for i in 0..3 {
                    let own = out.force_block(row).0[i];
                    let is_used = row != block::SLIDE || i == 0;
                    let gradient = if is_used { potential.partials[3 * row + i] } else { 0.0 };
                    assert!((own.value - gradient).abs() < 1e-14, "force {row} {i} of element {element}");
                    for column in 0..block::GUIDE + count {
                        let tangent = out.tangent_block(row, column);
                        for j in 0..3 {
                            let is_used = column != block::SLIDE || j == 0;
                            let exact = if is_used { own.partials[3 * column + j] } else { 0.0 };
                            let ours = tangent.0[i][j].value;
                            assert!((ours - exact).abs() < 1e-12, "tangent {row} {column} of element {element}");
                            assert_eq!(ours, out.tangent_block(column, row).0[j][i].value);
                        }
                    }
                }
            }
        }
    }
}
