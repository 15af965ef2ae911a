//! Steps of thickness at branches, which move along the thinner wall.

use super::joints::{WallEnd, joints};
use super::line::{Line, SAME_FACE};
use super::wall::Walls;
use crate::section::error::SectionError;

/// A step of thickness at a branch is moved along the thinner wall by this many thicknesses of the
/// branch
const STEP_BEHIND_BRANCH: f64 = 1.5;

impl Walls {
    /// Walls whose thickness does not change where a third one branches off: the thicker of two
    /// that go through a joint goes on beyond it.
    pub(super) fn with_steps_away_from_branches(&self) -> Result<Self, SectionError> {
        let lines = self.lines()?;
        let mut changed = self.clone();
        for joint in joints(self, &lines)?.iter().filter(|joint| !joint.stems.is_empty()) {
            let [first, second] = joint.through[..] else { continue };
            let is_straight = [first, second].iter().all(|end| lines[end.wall].bend.is_none());
            let [before, after] =
                [lines[first.wall].faces_away(1 - first.end), lines[second.wall].faces_away(second.end)];
            let tolerance = SAME_FACE * lines[first.wall].thickness();
            if !is_straight || before.iter().zip(after).all(|(a, b)| (a - b).abs() <= tolerance) {
                continue;
            }
            let is_first_thicker = lines[first.wall].thickness() >= lines[second.wall].thickness();
            let (thick, thin) = if is_first_thicker { (first, second) } else { (second, first) };
            let branch = joint.stems.iter().map(|stem| lines[stem.wall].thickness()).fold(0.0, f64::max);
            let part = STEP_BEHIND_BRANCH * branch / lines[thin.wall].length();
            if part < 0.5 {
                changed.extend_beyond(thick, thin, if thin.end == 0 { part } else { 1.0 - part }, &lines);
            }
        }
        Ok(changed)
    }

    /// Replaces the plies of a wall between a joint and a part of its length by those of another
    /// wall at the joint.
    fn extend_beyond(&mut self, thick: WallEnd, thin: WallEnd, part: f64, lines: &[Line]) {
        let step = self.points.len();
        self.points.push(lines[thin.wall].at(part));
        let mut piece = self.walls[thick.wall].clone();
        piece.ends = self.walls[thin.wall].ends;
        piece.ends[1 - thin.end] = step;
        self.walls[thin.wall].ends[thin.end] = step;
        if thick.end == thin.end {
            // The walls run against each other.
            piece.left = lines[thick.wall].thickness() - piece.left;
            piece.plies.reverse();
            piece.plies.iter_mut().for_each(|ply| ply.theta = -ply.theta);
        }
        self.walls.push(piece);
    }
}
