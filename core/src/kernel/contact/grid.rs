//! Pairs of elements that may touch: a sorted grid of their middles.
//!
//! Each element is a ball around its middle. Cells are as wide as the largest reach of two balls,
//! so that partners are in the same cell or in one of the 26 around it. Sorting keys with numbers of
//! elements makes the pairs, and their order, a function of the places alone. Cells that follow each
//! other in z have keys that do: the 27 cells are nine ranges of sorted keys.

use crate::tensor::Vec3;
use std::ops::Range;

/// Columns of cells in a cube of three cells a side.
const COLUMNS: usize = 9;

/// Cells in each direction on both sides of the origin: 21 bits of a key for each direction.
const LIMIT: i64 = 1 << 20;

/// An element as a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// The middle of the element
    pub(crate) middle: Vec3,
    /// Half of its extent, its radius for contact, and half of the margin: a length
    pub(crate) reach: f64,
}

/// Shows each pair of balls that overlap, the smaller number first, in the order of both numbers.
/// Balls that are not finite have no partners.
pub fn overlapping(balls: &[Ball], show: &mut dyn FnMut(usize, usize)) {
    let widest = balls.iter().map(|ball| ball.reach).filter(|reach| reach.is_finite()).fold(0.0, f64::max);
    let width = 2.0 * widest;
    let width_is_usable = width > 0.0 && width.is_finite();
    if !width_is_usable {
        return;
    }
    let is_finite = |ball: &Ball| ball.middle.is_finite() && ball.reach.is_finite();
    let mut keys: Vec<(u64, u32)> = vec![];
    for (number, ball) in balls.iter().enumerate().filter(|(_, ball)| is_finite(ball)) {
        keys.push((key(cell(ball.middle, width)), number as u32));
    }
    keys.sort_unstable();
    let in_cells: Vec<Ball> = keys.iter().map(|&(_, number)| balls[number as usize]).collect();
    let mut partners = vec![];
    // Elements that follow each other are often in one cell.
    let mut around: Option<([i64; 3], [Range<usize>; COLUMNS])> = None;
    for (number, ball) in balls.iter().enumerate().filter(|(_, ball)| is_finite(ball)) {
        let at = cell(ball.middle, width);
        let (_, ranges) = match around.take() {
            Some(known) if known.0 == at => around.insert(known),
            Some(_) | None => around.insert((at, ranges_around(at, &keys))),
        };
        partners.clear();
        for range in ranges {
            let in_range = in_cells[range.clone()].iter().zip(&keys[range.clone()]);
            for (other, &(_, partner)) in in_range.filter(|(_, (_, partner))| *partner as usize > number) {
                let reach = ball.reach + other.reach;
                if (other.middle - ball.middle).squared() <= reach * reach {
                    partners.push(partner as usize);
                }
            }
        }
        partners.sort_unstable();
        partners.iter().for_each(|&other| show(number, other));
    }
}

fn cell(place: Vec3, width: f64) -> [i64; 3] {
    // Casts saturate: far places share the cells at the limit.
    place.0.map(|component| ((component / width).floor() as i64).clamp(-LIMIT + 1, LIMIT - 2))
}

fn key(cell: [i64; 3]) -> u64 {
    cell.iter().fold(0, |key, &index| (key << 21) | (index + LIMIT) as u64)
}

/// The ranges of sorted keys in a cell and in those around it, one for each column in z.
fn ranges_around([x, y, z]: [i64; 3], keys: &[(u64, u32)]) -> [Range<usize>; COLUMNS] {
    std::array::from_fn(|column| {
        let [dx, dy] = [column / 3, column % 3].map(|index| index as i64 - 1);
        let [least, most] = [z - 1, z + 1].map(|z| key([x + dx, y + dy, z]));
        let first = keys.partition_point(|&(key, _)| key < least);
        let count = keys[first..].partition_point(|&(key, _)| key <= most);
        first..first + count
    })
}

#[cfg(test)]
mod tests {
    use super::super::dual::Random;
    use super::*;

    #[test]
    fn all_overlapping_pairs_are_found_once() {
        let mut random = Random(51);
        for size in [0.5, 3.0, 1e9] {
            let balls: Vec<Ball> = (0..400)
                .map(|_| Ball { middle: random.vector(size), reach: random.between(0.01, 0.1) })
                .chain([Ball { middle: Vec3([f64::NAN; 3]), reach: 1.0 }])
                .collect();
            let mut found = vec![];
            overlapping(&balls, &mut |a, b| found.push((a, b)));
            let mut expected = vec![];
            for a in 0..balls.len() {
                for b in a + 1..balls.len() {
                    if (balls[a].middle - balls[b].middle).norm() <= balls[a].reach + balls[b].reach {
                        expected.push((a, b));
                    }
                }
            }
            println!("{} pairs at size {size}", found.len());
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn balls_without_reach_have_no_pairs() {
        let ball = Ball { middle: Vec3::ZERO, reach: 0.0 };
        overlapping(&[ball, ball], &mut |_, _| panic!("no pair"));
        overlapping(&[], &mut |_, _| panic!("no pair"));
    }
}
