//! Points at which ends of walls meet.

use super::line::Line;
use super::wall::Walls;
use crate::section::Point;
use crate::section::error::{SectionError, show};

/// Cosine of the turn below which two walls fold back on each other
const MIN_MITRE: f64 = -0.95;

/// One end of a wall: 0 its start, 1 its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct WallEnd {
    pub(super) wall: usize,
    pub(super) end: usize,
}

/// The ends of walls at a point.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub(super) at: Point,
    /// One end where a wall is free, else the two that continue each other
    pub(super) through: Vec<WallEnd>,
    /// Ends of walls that butt against the others
    pub(super) stems: Vec<WallEnd>,
}

/// Sorts the ends of walls at each point.
pub(super) fn joints(walls: &Walls, lines: &[Line]) -> Result<Vec<Joint>, SectionError> {
    let mut joints = Vec::new();
    for (point, &at) in walls.points.iter().enumerate() {
        let mut ends = Vec::new();
        for (wall, line) in lines.iter().enumerate() {
            ends.extend((0..2).filter(|&end| line.joints[end] == point).map(|end| WallEnd { wall, end }));
        }
        let away = |end: &WallEnd| {
            let [t2, t3] = lines[end.wall].tangent_at(end.end as f64);
            if end.end == 0 { [t2, t3] } else { [-t2, -t3] }
        };
        let mut best: Option<(f64, usize, usize)> = None;
        for i in 0..ends.len() {
            for j in i + 1..ends.len() {
                let [first, second] = [away(&ends[i]), away(&ends[j])];
                let cosine = first[0] * second[0] + first[1] * second[1];
                if best.is_none_or(|(smallest, ..)| cosine < smallest - 1e-9) {
                    best = Some((cosine, i, j));
                }
            }
        }
        let through = match best {
            None => ends.clone(),
            Some((cosine, ..)) if cosine > -MIN_MITRE => {
                let message = format!("two walls fold back on each other at {}", show(at));
                return Err(SectionError::Dimensions { message });
            }
            Some((_, i, j)) => vec![ends[i], ends[j]],
        };
        let stems = ends.into_iter().filter(|end| !through.contains(end)).collect();
        joints.push(Joint { at, through, stems });
    }
    Ok(joints)
}
