//! Walls between the same two points, such as the two halves of a round tube.

use super::wall::{Wall, Walls};
use crate::section::Point;
use crate::section::error::SectionError;

impl Walls {
    /// Walls of which no two have the same two ends: blocks know an edge by its ends. Round ones that have are
    /// parted in their middle.
    pub(super) fn with_twins_parted(&self) -> Result<Self, SectionError> {
        let lines = self.lines()?;
        let mut changed = self.clone();
        for (number, wall) in self.walls.iter().enumerate() {
            let [from, to] = wall.ends;
            let is_twin = |other: &Wall| from != to && (other.ends == [from, to] || other.ends == [to, from]);
            // A straight wall and a round one do not meet smoothly, which is refused.
            if wall.bend.is_some() && self.walls[..number].iter().any(is_twin) {
                changed.part(number, lines[number].at(0.5));
            }
        }
        Ok(changed)
    }

    /// Parts a wall at a point of its line.
    fn part(&mut self, number: usize, at: Point) {
        let middle = self.points.len();
        self.points.push(at);
        let mut rest = self.walls[number].clone();
        rest.ends[0] = middle;
        self.walls[number].ends[1] = middle;
        self.walls.push(rest);
    }
}
