//! Branches: walls that end at the faces of others, and the cuts that their faces make there.

use super::joints::WallEnd;
use super::line::SAME_FACE;
use super::strips::{Station, Strips, sort_faces};
use crate::section::Point;
use crate::section::error::{SectionError, show};
use crate::section::outline::distance;
use crate::sorting::sort_by;

/// The end of a ply of a branch may move by this part of the ply to a bend of the wall that it
/// meets
const SNAP: f64 = 0.05;

/// Passes in which faces of branches are carried over to branches on the other side
const MAX_PASSES: usize = 5;

/// The meeting of the end of a stem with the walls that go through a joint.
struct Butt {
    stem: WallEnd,
    /// Offset of the face of the walls against which it butts
    face: f64,
    /// Direction of the stem in its chain
    along: Point,
    /// To the left of it
    normal: Point,
    /// Offset, in the chain of the stem, of the place where the two walls meet
    bend: f64,
}

impl Strips {
    /// The face against which a stem butts: its offset in the chain of the walls that go through.
    pub(super) fn butt_face(&self, joint: usize, stem: WallEnd) -> Result<f64, SectionError> {
        let fail = |message: &str| {
            let at = show(self.joints[joint].at);
            Err(SectionError::Dimensions { message: format!("at {at} {message}") })
        };
        let Some([before, after]) = self.through(joint) else { return fail("no wall goes through") };
        if [before, after, stem.wall].iter().any(|&wall| self.lines[wall].bend.is_some()) {
            return fail("a round wall meets a branch: put a short straight wall between them");
        }
        let mitre = self.mitre(joint);
        let away = self.away(stem);
        let side = away[0] * mitre[0] + away[1] * mitre[1];
        let sides = [before, after].map(|wall| self.lines[wall].outer_faces()[if side > 0.0 { 0 } else { 1 }]);
        match (sides[0] - sides[1]).abs() <= SAME_FACE * self.lines[before].thickness() {
            true => Ok(sides[0]),
            false => fail("walls of different thickness meet where a third branches off: move the step away"),
        }
    }

    /// Unit vector from a joint along a wall.
    fn away(&self, end: WallEnd) -> Point {
        let [t2, t3] = self.lines[end.wall].tangent_at(end.end as f64);
        if end.end == 0 { [t2, t3] } else { [-t2, -t3] }
    }

    /// The offset, in the chain of a stem, of the bend of the face that it meets.
    fn offset_of_bend(&self, joint: usize, stem: WallEnd, face: f64) -> f64 {
        let mitre = self.mitre(joint);
        let [t2, t3] = self.lines[stem.wall].tangent_at(stem.end as f64);
        face * (-t3 * mitre[0] + t2 * mitre[1])
    }

    /// Adds faces to stems where the walls that they meet are joined, and where faces of a stem on
    /// the other side end, so that each block of a stem meets one block.
    pub(super) fn add_faces(&mut self) -> Result<(), SectionError> {
        for _ in 0..MAX_PASSES {
            let mut added = false;
            for joint in 0..self.joints.len() {
                for stem in self.joints[joint].stems.clone() {
                    let butt = self.butt(joint, stem)?;
                    added |= self.add_face(stem, butt.bend);
                    for other in self.joints[joint].stems.clone() {
                        let across = self.butt(joint, other)?;
                        if across.face == butt.face {
                            continue;
                        }
                        for (wall, part) in
                            self.meetings(joint, &across)?.into_iter().map(|(_, wall, part)| (wall, part))
                        {
                            let [x2, x3] = self.on_face(wall, part, butt.face);
                            let at = self.joints[joint].at;
                            let offset = (x2 - at[0]) * butt.normal[0] + (x3 - at[1]) * butt.normal[1];
                            added |= self.add_face(stem, offset);
                        }
                    }
                }
            }
            if !added {
                break;
            }
        }
        Ok(())
    }

    /// Adds a face to the chain of a stem if it lies inside the stem and away from other faces.
    fn add_face(&mut self, stem: WallEnd, offset: f64) -> bool {
        let own = self.lines[stem.wall].outer_faces();
        let faces = &mut self.faces[self.chain_of[stem.wall]];
        let is_taken = faces.iter().enumerate().any(|(k, &known)| (known - offset).abs() <= SNAP * gap(faces, k));
        let is_inside = offset < own[0] && offset > own[1];
        if is_inside && !is_taken {
            faces.push(offset);
            sort_faces(faces);
        }
        is_inside && !is_taken
    }

    /// The meeting of a stem with the walls that go through a joint.
    fn butt(&self, joint: usize, stem: WallEnd) -> Result<Butt, SectionError> {
        let face = self.butt_face(joint, stem)?;
        let along = self.lines[stem.wall].tangent_at(stem.end as f64);
        let bend = self.offset_of_bend(joint, stem, face);
        Ok(Butt { stem, face, along, normal: [-along[1], along[0]], bend })
    }

    /// For each face of a stem (index in its chain), the wall that it meets and the part of its
    /// length; two walls at their common end.
    fn meetings(&self, joint: usize, butt: &Butt) -> Result<Vec<(usize, usize, f64)>, SectionError> {
        let line = &self.lines[butt.stem.wall];
        let own = line.outer_faces();
        let tolerance = SAME_FACE * line.thickness();
        let faces = &self.faces[self.chain_of[butt.stem.wall]];
        let mut meetings = Vec::new();
        for (k, &offset) in faces.iter().enumerate() {
            if offset > own[0] + tolerance || offset < own[1] - tolerance {
                continue;
            }
            let is_bend = (offset - butt.bend).abs() <= SNAP * gap(faces, k);
            for (which, wall) in self.through(joint).into_iter().flatten().enumerate() {
                let end = 1 - which;
                let away = self.away(WallEnd { wall, end });
                // The wall lies on one side of the stem's line through the bend.
                let side = away[0] * butt.normal[0] + away[1] * butt.normal[1];
                if is_bend {
                    meetings.push((k, wall, end as f64));
                } else if (offset - butt.bend) * side > 0.0 {
                    meetings.push((k, wall, self.part_of_face(joint, wall, butt, offset)?));
                }
            }
        }
        Ok(meetings)
    }

    /// The part of the length of a wall's face at which the line of a stem's face meets it.
    fn part_of_face(&self, joint: usize, wall: usize, butt: &Butt, offset: f64) -> Result<f64, SectionError> {
        let at = self.joints[joint].at;
        let tangent = self.lines[wall].tangent_at(0.0);
        // Where offset normal + v along and face n + u t are one point, seen from the joint.
        let start =
            [offset * butt.normal[0] + butt.face * tangent[1], offset * butt.normal[1] - butt.face * tangent[0]];
        let u = cross(start, butt.along) / cross(tangent, butt.along);
        let met = [at[0] - butt.face * tangent[1] + u * tangent[0], at[1] + butt.face * tangent[0] + u * tangent[1]];
        let [from, to] = [0, 1].map(|end| self.end_of_face(wall, end, butt.face));
        let ahead = (met[0] - from[0]) * tangent[0] + (met[1] - from[1]) * tangent[1];
        let part = ahead / distance(from, to);
        match part > 0.0 && part < 1.0 {
            true => Ok(part),
            false => {
                let message = format!("at {} a wall is too short for the branch that meets it", show(at));
                Err(SectionError::Dimensions { message })
            }
        }
    }

    /// Cuts walls where the faces of stems meet them.
    pub(super) fn cut(&mut self) -> Result<(), SectionError> {
        for joint in 0..self.joints.len() {
            for stem in self.joints[joint].stems.clone() {
                let butt = self.butt(joint, stem)?;
                let faces = self.faces[self.chain_of[stem.wall]].clone();
                for (k, wall, part) in self.meetings(joint, &butt)? {
                    let same = SNAP * gap(&faces, k) / self.lines[wall].length();
                    let stations = &mut self.stations[wall];
                    match stations.iter_mut().find(|station| (station.part - part).abs() <= same) {
                        Some(station) => station.stems.push((stem, k)),
                        None => stations.push(Station { part, joint: None, stems: vec![(stem, k)] }),
                    }
                }
            }
        }
        for stations in &mut self.stations {
            sort_by(stations, |a, b| a.part.total_cmp(&b.part));
        }
        self.check_stems()
    }

    /// Checks that each block of a stem meets one block of a wall.
    fn check_stems(&self) -> Result<(), SectionError> {
        for joint in 0..self.joints.len() {
            for stem in &self.joints[joint].stems {
                let faces = &self.faces[self.chain_of[stem.wall]];
                for k in 0..faces.len() - 1 {
                    if self.lines[stem.wall].region_at(0.5 * (faces[k] + faces[k + 1])).is_none() {
                        continue;
                    }
                    let meets = |pair: &[Station]| {
                        let has = |station: &Station, k: usize| station.stems.contains(&(*stem, k));
                        has(&pair[0], k) && has(&pair[1], k + 1) || has(&pair[1], k) && has(&pair[0], k + 1)
                    };
                    let through = self.through(joint).into_iter().flatten();
                    if !through.into_iter().any(|wall| self.stations[wall].windows(2).any(meets)) {
                        let at = show(self.joints[joint].at);
                        let message = format!(
                            "at {at} branches meet a wall too close to each other: move one of them, or \
                             describe the section as regions"
                        );
                        return Err(SectionError::Dimensions { message });
                    }
                }
            }
        }
        Ok(())
    }
}

/// Distance from a face to the nearer of its neighbours.
fn gap(faces: &[f64], k: usize) -> f64 {
    let before = if k > 0 { faces[k - 1] - faces[k] } else { f64::MAX };
    let after = if k + 1 < faces.len() { faces[k] - faces[k + 1] } else { f64::MAX };
    before.min(after)
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
