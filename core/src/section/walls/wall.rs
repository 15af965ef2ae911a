//! Walls as they are described: points, lines between them, and plies.

use crate::section::Point;

/// A ply of a wall.
#[derive(Clone, Debug, PartialEq)]
pub struct Ply {
    /// Name, for messages
    pub name: String,
    /// Index of the material
    pub material: usize,
    /// Thickness
    pub thickness: f64,
    /// Angle of the fibre from axis 1 towards the wall tangent, rad
    pub theta: f64,
}

/// The curve of a round wall: part of a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Centre of the circle
    pub centre: Point,
    /// From axis 2 towards axis 3
    pub counterclockwise: bool,
}

/// A wall between two points.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// Indices of its points
    pub(crate) ends: [usize; 2],
    /// Its curve, if it is not straight
    pub(super) bend: Option<Bend>,
    /// Distance from the line between the points to the left face, looking along the wall
    pub(super) left: f64,
    /// Plies from left to right; a clockwise closed line has its outside on the left
    pub(crate) plies: Vec<Ply>,
}

/// Walls that meet in points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Walls {
    /// Points
    pub points: Vec<Point>,
    /// Walls
    pub walls: Vec<Wall>,
}

impl Walls {
    /// Walls with the same plies along a line through points; closed if the last is the first.
    pub fn line(points: &[Point], left: f64, plies: &[Ply]) -> Self {
        let mut walls = Self::default();
        for pair in points.windows(2) {
            walls.add(pair[0], pair[1], None, left, plies);
        }
        walls
    }

    /// Adds a wall; its ends are points already there if they are equal.
    pub fn add(&mut self, from: Point, to: Point, bend: Option<Bend>, left: f64, plies: &[Ply]) {
        let ends = [from, to].map(|at| match self.points.iter().position(|point| *point == at) {
            Some(index) => index,
            None => {
                self.points.push(at);
                self.points.len() - 1
            }
        });
        self.walls.push(Wall { ends, bend, left, plies: plies.to_vec() });
    }
}

impl Bend {
    /// 1 counterclockwise, -1 clockwise
    pub(super) fn sense(&self) -> f64 {
        if self.counterclockwise { 1.0 } else { -1.0 }
    }
}
