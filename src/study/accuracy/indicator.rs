//! Where elements should be short: the error of a mesh, estimated from derivatives of strains.
//!
//! The strains of elements of order p err by about h^p times their p-th derivative over the arc
//! length s, so that the energy of the error is a sum of h^(2p) rho, where
//!
//! ```text
//! rho = d^p strain/ds^p . d^p stress/ds^p
//! ```
//!
//! For a number of elements this is least if h is proportional to rho^(-1/(2p+1)) (de Boor's
//! equidistribution). A part of all elements is spread as in an equal mesh, so that no place is left
//! without: outputs may depend on places with little energy.

use crate::deck::Division;
use crate::study::cost::{PlacedPiece, Placement};
use crate::study::strains::{Piece, Segment};

/// The part of all elements that is placed by rho.
const PLACED_PART: f64 = 0.75;

/// The smallest rho over the largest.
const LEAST_DENSITY: f64 = 1e-12;

/// The shape of a piece is known at so many places for each of its elements.
const PLACES_PER_ELEMENT: usize = 4;
/// The smallest number of places at which the shape of a piece is known.
const LEAST_PLACES: usize = 16;

/// Placed elements, and what they promise.
pub struct PlacedMesh {
    /// The elements
    pub(super) placement: Placement,
    /// The number of placed elements over that of equal ones with the same energy of the error
    pub(super) ratio: f64,
}

/// The shares of all segments whose densities are known.
struct Known {
    /// The largest density
    largest: f64,
    /// Their part of the elements of the equal mesh
    part: f64,
    /// The integral of the weights over their lengths
    weight: f64,
}

/// Places the elements of all pieces of all beams; `None` where there is nothing to place.
pub fn place(beams: &[Vec<Piece>]) -> Option<PlacedMesh> {
    let all = || beams.iter().flatten();
    let elements: f64 = all().map(|piece| piece.count as f64).sum();
    let known = Known::of(beams, elements)?;
    let place_piece = |piece: &Piece| place_piece(piece, &known, elements);
    let placed: Vec<Vec<PlacedPiece>> = beams.iter().map(|pieces| pieces.iter().map(place_piece).collect()).collect();
    let mut energies = Energies { placed: 0.0, equal: 0.0 };
    for (piece, placed) in all().zip(placed.iter().flatten()) {
        energies.add(piece, &placed.shape, placed.share * elements);
    }
    let order = all().map(|piece| piece.order).max()?;
    let ratio = (energies.placed / energies.equal).powf(0.5 / order as f64);
    ratio.is_finite().then_some(PlacedMesh { placement: Placement { beams: placed }, ratio })
}

impl Known {
    fn of(beams: &[Vec<Piece>], elements: f64) -> Option<Self> {
        let segments = || beams.iter().flatten().flat_map(|piece| piece.segments.iter().map(move |own| (piece, own)));
        let densities = segments().flat_map(|(_, segment)| &segment.densities);
        let largest = densities.fold(0.0_f64, |largest, &density| largest.max(density));
        if largest <= 0.0 || largest.is_infinite() {
            return None;
        }
        let mut known = Self { largest, part: 0.0, weight: 0.0 };
        for (piece, segment) in segments().filter(|(_, segment)| !segment.densities.is_empty()) {
            known.part += (segment.end - segment.start) * piece.count as f64 / elements;
            known.weight += piece.length * integral(&weights(segment, piece.order, largest));
        }
        Some(known)
    }
}

/// The elements of a piece, where the equal mesh has `elements` in all.
fn place_piece(piece: &Piece, known: &Known, elements: f64) -> PlacedPiece {
    let even = piece.count as f64 / elements;
    let spread: Vec<Vec<(f64, f64)>> =
        piece.segments.iter().map(|segment| spread(segment, piece, known, even)).collect();
    let parts = (PLACES_PER_ELEMENT * piece.count).max(LEAST_PLACES).div_ceil(piece.unit) * piece.unit;
    let ends = (1..parts).map(|k| inverse(&spread, piece, k as f64 / parts as f64));
    PlacedPiece {
        share: spread.iter().map(|segment| integral(segment)).sum(),
        shape: Division::At(ends.collect()),
        kept: piece.kept.clone(),
        unit: piece.unit,
    }
}

/// Places of a segment with the part of all elements for each length of the piece, which is `even` in
/// the equal mesh.
fn spread(segment: &Segment, piece: &Piece, known: &Known, even: f64) -> Vec<(f64, f64)> {
    let weights = weights(segment, piece.order, known.largest);
    if weights.is_empty() {
        return vec![(segment.start, even), (segment.end, even)];
    }
    let by_weight = |weight: f64| known.part * piece.length * weight / known.weight;
    let of = |weight: f64| PLACED_PART * by_weight(weight) + (1.0 - PLACED_PART) * even;
    weights.into_iter().map(|(place, weight)| (place, of(weight))).collect()
}

/// Places with the weight of their elements, from start to end.
fn weights(segment: &Segment, order: usize, largest: f64) -> Vec<(f64, f64)> {
    let power = 1.0 / (2 * order + 1) as f64;
    let weight = |rho: f64| (rho / largest).max(LEAST_DENSITY).powf(power);
    segment.profile(order).into_iter().map(|(place, rho)| (place, weight(rho))).collect()
}

/// The integral over places of a function that is linear between some.
fn integral(line: &[(f64, f64)]) -> f64 {
    line.windows(2).map(|pair| 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0)).sum()
}

/// The place in a piece where a fraction of its elements ends. Each segment has elements by its
/// length, so that kept places stay.
fn inverse(spread: &[Vec<(f64, f64)>], piece: &Piece, fraction: f64) -> f64 {
    let number = piece.segments.partition_point(|segment| segment.end <= fraction).min(spread.len() - 1);
    let segment = &piece.segments[number];
    let wanted = (fraction - segment.start) / (segment.end - segment.start) * integral(&spread[number]);
    let mut before = 0.0;
    for pair in spread[number].windows(2) {
        let here = integral(pair);
        if before + here >= wanted && here > 0.0 {
            return crossing(pair, wanted - before);
        }
        before += here;
    }
    segment.end
}

/// The place up to which the integral of a linear function is `wanted`.
fn crossing(pair: &[(f64, f64)], wanted: f64) -> f64 {
    let (start, low) = pair[0];
    let (end, high) = pair[1];
    let slope = (high - low) / (end - start);
    // The root of slope x^2/2 + low x = wanted, without a division by the slope.
    let root = (low * low + 2.0 * slope * wanted).max(0.0).sqrt();
    (start + 2.0 * wanted / (low + root)).clamp(start, end)
}

/// The energies of the error of two meshes, but for a factor.
struct Energies {
    placed: f64,
    equal: f64,
}

impl Energies {
    /// Adds a piece with its equal elements, and with so many placed ones.
    fn add(&mut self, piece: &Piece, shape: &Division, placed: f64) {
        let parts = shape.count();
        let power = 2 * piece.order as i32;
        let equal = piece.length / piece.count as f64;
        for segment in &piece.segments {
            let profile = segment.profile(piece.order);
            if profile.is_empty() {
                continue;
            }
            for k in 0..parts {
                let width = shape.end(k + 1) - shape.end(k);
                let middle = shape.end(k) + 0.5 * width;
                if middle < segment.start || middle > segment.end {
                    continue;
                }
                let density = value_at(&profile, middle) * width * piece.length;
                let own = piece.length * width * parts as f64 / placed;
                self.placed += density * own.powi(power);
                self.equal += density * equal.powi(power);
            }
        }
    }
}

/// The value of a function that is linear between some places.
fn value_at(line: &[(f64, f64)], place: f64) -> f64 {
    let after = line.partition_point(|&(at, _)| at < place).clamp(1, line.len() - 1);
    let (start, low) = line[after - 1];
    let (end, high) = line[after];
    if end > start { low + (high - low) * ((place - start) / (end - start)).clamp(0.0, 1.0) } else { low }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::strains::{Point, is_end};
    use beamsim_core::tensor::Mat3;

    fn piece(kept: &[f64], density: impl Fn(f64) -> f64) -> Piece {
        let order = 3;
        let point = |k: usize| Point { element: 0, number: 0, place: (k as f64 + 0.5) / 60.0, axes: Mat3::IDENTITY };
        let ends: Vec<f64> = [&[0.0], kept, &[1.0]].concat();
        let segment = |pair: &[f64]| {
            let points: Vec<Point> =
                (0..60).map(point).filter(|point| point.place > pair[0] && point.place < pair[1]).collect();
            let mut segment = Segment { start: pair[0], end: pair[1], points, densities: Vec::new() };
            let windows = segment.points.len() - order;
            segment.densities = (0..windows).map(|k| density(segment.middle(k, order))).collect();
            segment
        };
        let segments = ends.windows(2).map(segment).collect();
        let unit = (1..100).find(|&unit| kept.iter().all(|&place| is_end(place, unit))).unwrap();
        Piece { length: 2.0, count: 20, order, kept: kept.to_vec(), unit, segments }
    }

    #[test]
    fn equal_densities_give_equal_elements() {
        let mesh = place(&[vec![piece(&[], |_| 3.0)]]).unwrap();
        let own = &mesh.placement.beams[0][0];
        assert!((own.share - 1.0).abs() < 1e-12 && (mesh.ratio - 1.0).abs() < 1e-9, "{}", mesh.ratio);
        assert!((1..20).all(|k| (own.shape.with_count(20).end(k) - k as f64 / 20.0).abs() < 1e-12));
    }

    #[test]
    fn elements_are_short_where_the_density_is_large_and_end_at_kept_places() {
        let layer = |place: f64| (-60.0 * place).exp();
        for kept in [vec![], vec![0.25], vec![1.0 / 3.0, 0.5]] {
            let mesh = place(&[vec![piece(&kept, layer)]]).unwrap();
            let own = &mesh.placement.beams[0][0];
            let shape = own.shape.with_count(12);
            assert!(own.shape.is_possible() && mesh.ratio < 0.8, "{kept:?}: {}", mesh.ratio);
            assert!(shape.end(1) < 0.6 / 12.0, "{}", shape.end(1));
            let ends = |place: f64| (0..=12).any(|k| (shape.end(k) - place).abs() < 1e-12);
            assert!(kept.iter().all(|&place| ends(place)), "{shape:?}");
        }
    }

    #[test]
    fn elements_go_to_the_beam_that_needs_them() {
        let mesh = place(&[vec![piece(&[], |_| 1e7)], vec![piece(&[], |_| 1.0)]]).unwrap();
        let share = |beam: usize| mesh.placement.beams[beam][0].share;
        assert!((share(0) + share(1) - 1.0).abs() < 1e-12);
        // The placed part goes as density^(1/7): ten to one.
        assert!((share(0) - (0.75 * 10.0 / 11.0 + 0.125)).abs() < 1e-9, "{}", share(0));
    }
}
