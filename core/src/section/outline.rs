//! Closed outlines of straight sides and arcs of circles.

use super::Point;
use super::error::SectionError;

/// Points nearer than this part of the size of an outline are one
const SAME_POINT: f64 = 1e-9;

/// Sine of the angle by which an outline may turn without a corner
const SMOOTH: f64 = 1e-3;

/// A side of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    /// A straight line
    Line,
    /// An arc of a circle, less than a full turn
    Arc {
        /// Centre of the circle
        centre: Point,
        /// From axis 2 towards axis 3
        counterclockwise: bool,
    },
}

/// A closed line: side k goes from point k to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Ends of sides
    pub(super) points: Vec<Point>,
    /// Sides
    pub(super) sides: Vec<Side>,
}

impl Outline {
    /// A polygon. Repeated points, and a last point that repeats the first, are dropped.
    pub fn polygon(points: &[Point], name: &str) -> Result<Self, SectionError> {
        let rounded: Vec<(Point, f64)> = points.iter().map(|&at| (at, 0.0)).collect();
        Self::rounded(&rounded, name)
    }

    /// A circle, of four arcs.
    pub fn circle(centre: Point, radius: f64) -> Self {
        let points = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        Self {
            points: points.map(|[c, s]| [centre[0] + radius * c, centre[1] + radius * s]).to_vec(),
            sides: vec![Side::Arc { centre, counterclockwise: true }; 4],
        }
    }

    /// A polygon with a radius at each corner, 0 where it is sharp.
    pub fn rounded(corners: &[(Point, f64)], name: &str) -> Result<Self, SectionError> {
        let fail = |message: &str| SectionError::Outline { region: name.to_string(), message: message.to_string() };
        let corners = without_repeats(corners);
        let count = corners.len();
        if count < 3 {
            return Err(fail("needs at least three different points"));
        }
        let mut outline = Self { points: Vec::new(), sides: Vec::new() };
        for k in 0..count {
            let (at, radius) = corners[k];
            let before = corners[(k + count - 1) % count].0;
            let after = corners[(k + 1) % count].0;
            if radius <= 0.0 {
                outline.points.push(at);
                outline.sides.push(Side::Line);
                continue;
            }
            let Some(fillet) = Fillet::new(before, at, after, radius) else {
                outline.points.push(at);
                outline.sides.push(Side::Line);
                continue;
            };
            // Both fillets of a side must fit on it.
            for (neighbour, index) in [(before, (k + count - 1) % count), (after, (k + 1) % count)] {
                let (_, other_radius) = corners[index];
                let beyond = corners[if neighbour == after { (k + 2) % count } else { (k + count - 2) % count }].0;
                let other = Fillet::new(at, neighbour, beyond, other_radius).map_or(0.0, |fillet| fillet.cut);
                if fillet.cut + other > distance(at, neighbour) * (1.0 + SAME_POINT) {
                    return Err(fail(&format!("has a side that is too short for the fillet of radius {radius}")));
                }
            }
            outline.points.push(fillet.start);
            let counterclockwise = fillet.turns_left;
            outline.sides.push(Side::Arc { centre: fillet.centre, counterclockwise });
            outline.points.push(fillet.end);
            outline.sides.push(Side::Line);
        }
        outline.drop_empty_sides();
        Ok(outline)
    }

    /// Removes sides of no length, between two fillets that touch.
    fn drop_empty_sides(&mut self) {
        let size = self.size();
        let mut k = 0;
        while k < self.points.len() && self.points.len() > 2 {
            let next = (k + 1) % self.points.len();
            if self.sides[k] == Side::Line && distance(self.points[k], self.points[next]) <= SAME_POINT * size {
                self.points.remove(k);
                self.sides.remove(k);
            } else {
                k += 1;
            }
        }
    }

    /// Largest extent along an axis.
    pub fn size(&self) -> f64 {
        let extent = |axis: usize| {
            let values = self.points.iter().map(|point| point[axis]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        extent(0).max(extent(1))
    }

    /// Ends of a side.
    pub fn ends(&self, side: usize) -> [Point; 2] {
        [self.points[side], self.points[(side + 1) % self.points.len()]]
    }

    /// The outline with the other sense.
    pub fn reversed(&self) -> Self {
        let count = self.points.len();
        let points = (0..count).map(|k| self.points[(count - k) % count]).collect();
        let sides = (0..count).map(|k| match self.sides[count - 1 - k] {
            Side::Line => Side::Line,
            Side::Arc { centre, counterclockwise } => Side::Arc { centre, counterclockwise: !counterclockwise },
        });
        Self { points, sides: sides.collect() }
    }

    /// The point at a part of a side.
    pub fn at(&self, side: usize, s: f64) -> Point {
        let [from, to] = self.ends(side);
        match self.sides[side] {
            Side::Line => [from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1])],
            Side::Arc { centre, counterclockwise } => {
                let [start, end] = arc_angles(from, to, centre, counterclockwise);
                let radius = distance(from, centre);
                let (sin, cos) = libm::sincos(start + s * (end - start));
                [centre[0] + radius * cos, centre[1] + radius * sin]
            }
        }
    }

    /// Length of a side.
    pub fn length(&self, side: usize) -> f64 {
        let [from, to] = self.ends(side);
        match self.sides[side] {
            Side::Line => distance(from, to),
            Side::Arc { centre, counterclockwise } => {
                let [start, end] = arc_angles(from, to, centre, counterclockwise);
                distance(from, centre) * (end - start).abs()
            }
        }
    }

    /// Area, positive for counterclockwise outlines; arcs by 32 chords.
    pub fn area(&self) -> f64 {
        let mut area = 0.0;
        for side in 0..self.sides.len() {
            let chords = if self.sides[side] == Side::Line { 1 } else { 32 };
            for k in 0..chords {
                let a = self.at(side, k as f64 / chords as f64);
                let b =
                    if k + 1 == chords { self.ends(side)[1] } else { self.at(side, (k + 1) as f64 / chords as f64) };
                area += 0.5 * (a[0] * b[1] - a[1] * b[0]);
            }
        }
        area
    }

    /// The sum of the lengths of sides.
    pub fn perimeter(&self) -> f64 {
        (0..self.sides.len()).map(|side| self.length(side)).sum()
    }

    /// The angle of the material, on the left of the outline, at a point; rad.
    pub fn interior_angle(&self, point: usize) -> f64 {
        let [before, after] = self.tangents_at(point);
        let sine = before[0] * after[1] - before[1] * after[0];
        let cosine = before[0] * after[0] + before[1] * after[1];
        std::f64::consts::PI - libm::atan2(sine, cosine)
    }

    /// Unit tangents of the sides before and after a point.
    pub fn tangents_at(&self, point: usize) -> [Point; 2] {
        let count = self.points.len();
        [self.tangent((point + count - 1) % count, 1), self.tangent(point, 0)]
    }

    /// Unit tangent of a side at its start (0) or end (1).
    fn tangent(&self, side: usize, end: usize) -> Point {
        let [from, to] = self.ends(side);
        let along = match self.sides[side] {
            Side::Line => [to[0] - from[0], to[1] - from[1]],
            Side::Arc { centre, counterclockwise } => {
                let at = [from, to][end];
                let sense = if counterclockwise { 1.0 } else { -1.0 };
                [-sense * (at[1] - centre[1]), sense * (at[0] - centre[0])]
            }
        };
        let length = libm::hypot(along[0], along[1]);
        [along[0] / length, along[1] / length]
    }
}

/// Start and end angle of an arc in its sense.
pub fn arc_angles(from: Point, to: Point, centre: Point, counterclockwise: bool) -> [f64; 2] {
    let angle = |at: Point| libm::atan2(at[1] - centre[1], at[0] - centre[0]);
    let start = angle(from);
    let turn = (angle(to) - start).rem_euclid(std::f64::consts::TAU);
    [start, start + if counterclockwise { turn } else { turn - std::f64::consts::TAU }]
}

/// An arc that touches both sides of a corner.
struct Fillet {
    start: Point,
    end: Point,
    centre: Point,
    turns_left: bool,
    /// Length that it takes from each side
    cut: f64,
}

impl Fillet {
    /// `None` where the sides continue each other, or without radius.
    fn new(before: Point, at: Point, after: Point, radius: f64) -> Option<Self> {
        let unit = |from: Point, to: Point| {
            let length = distance(from, to);
            [(to[0] - from[0]) / length, (to[1] - from[1]) / length]
        };
        let first = unit(before, at);
        let second = unit(at, after);
        let sine = first[0] * second[1] - first[1] * second[0];
        let cosine = first[0] * second[0] + first[1] * second[1];
        if radius <= 0.0 || sine.abs() < SMOOTH {
            return None;
        }
        let half_turn = 0.5 * libm::atan2(sine.abs(), cosine);
        let cut = radius * libm::tan(half_turn);
        let start = [at[0] - cut * first[0], at[1] - cut * first[1]];
        let end = [at[0] + cut * second[0], at[1] + cut * second[1]];
        let turns_left = sine > 0.0;
        let towards = if turns_left { radius } else { -radius };
        let centre = [start[0] - towards * first[1], start[1] + towards * first[0]];
        Some(Self { start, end, centre, turns_left, cut })
    }
}

/// Drops points that repeat the point before, and a last one that repeats the first.
fn without_repeats(corners: &[(Point, f64)]) -> Vec<(Point, f64)> {
    let size = corners.iter().flat_map(|(at, _)| at.map(f64::abs)).fold(0.0, f64::max);
    let mut kept: Vec<(Point, f64)> = Vec::new();
    for &(at, radius) in corners {
        if kept.last().is_none_or(|last| distance(last.0, at) > SAME_POINT * size) {
            kept.push((at, radius));
        }
    }
    while kept.len() > 1 && distance(kept[0].0, kept[kept.len() - 1].0) <= SAME_POINT * size {
        kept.pop();
    }
    kept
}

/// The distance of two points.
pub fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const SQUARE: [Point; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn fillets_take_area_from_a_square() {
        let corners: Vec<_> = SQUARE.iter().map(|&at| (at, 0.2)).collect();
        let outline = Outline::rounded(&corners, "square").unwrap();
        assert_eq!(outline.points.len(), 8);
        assert!((outline.area() - (1.0 - (4.0 - PI) * 0.04)).abs() < 1e-4);
        assert!((outline.perimeter() - (2.4 + 0.4 * PI)).abs() < 1e-12);
        assert!((0..8).all(|k| (outline.interior_angle(k) - PI).abs() < 1e-12));
        assert!((outline.reversed().area() + outline.area()).abs() < 1e-14);
    }

    #[test]
    fn fillets_that_touch_leave_no_side_between() {
        let corners: Vec<_> = SQUARE.iter().map(|&at| (at, 0.5)).collect();
        assert_eq!(Outline::rounded(&corners, "square").unwrap().points.len(), 4);
        let too_large: Vec<_> = SQUARE.iter().map(|&at| (at, 0.6)).collect();
        assert!(Outline::rounded(&too_large, "square").is_err());
    }

    #[test]
    fn a_closing_point_is_dropped() {
        let mut points = SQUARE.to_vec();
        points.push(SQUARE[0]);
        assert_eq!(Outline::polygon(&points, "square").unwrap().points.len(), 4);
        assert!(Outline::polygon(&SQUARE[..2], "line").is_err());
    }

    #[test]
    fn the_inner_corner_of_an_angle_is_reentrant() {
        let points = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        let outline = Outline::polygon(&points, "angle").unwrap();
        let reentrant = |k: &usize| outline.interior_angle(*k) > 1.1 * PI;
        assert_eq!((0..6).filter(reentrant).collect::<Vec<_>>(), vec![3]);
    }
}
