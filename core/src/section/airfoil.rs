//! The skin of an airfoil with webs, as walls: clockwise (2 to the right, 3 upwards), so that the
//! first ply of a layup lies outside.

use super::Point;
use super::error::{SectionError, check_positive};
use super::walls::{Ply, Walls};
use crate::sorting::sort_by;

/// A step of the skin at a web is moved backwards by this many thicknesses of the web
const STEP_BEHIND_WEB: f64 = 1.5;

/// Points of the profile nearer than this many thicknesses of a web to its middle are left out
const FREE_AT_WEB: f64 = 1.2;

/// Points of the profile nearer than this many thicknesses of the skin to its end are left out: the
/// mitre of the closing wall takes about one of them
const FREE_AT_END: f64 = 2.0;

/// Points of the profile nearer than this part of the chord to an inserted one are left out
const SAME_PLACE: f64 = 1e-3;

/// Places at which room for a trailing edge is looked for
const SAMPLES: usize = 2000;

/// An airfoil.
#[derive(Clone, Debug, PartialEq)]
pub struct Airfoil {
    /// Points in parts of the chord, from the trailing edge over the upper side to the leading edge
    /// and back
    pub profile: Vec<Point>,
    /// Length of the chord
    pub chord: f64,
    /// Part of the chord at which the origin lies
    pub pitch_axis: f64,
    /// True if the leading edge points to +2
    pub leads_to_plus: bool,
    /// Parts of the skin; later ones replace earlier ones
    pub skin: Vec<SkinPart>,
    /// Webs
    pub webs: Vec<Web>,
    /// True if angles of fibres turn towards +2 everywhere
    pub fixed_sense: bool,
}

/// A part of the skin.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinPart {
    /// Its ends, as parts of the chord from the leading edge
    pub ends: [f64; 2],
    /// True if it covers the upper side, and the lower one
    pub sides: [bool; 2],
    /// Plies from outside inwards
    pub plies: Vec<Ply>,
}

/// A web normal to the chord.
#[derive(Clone, Debug, PartialEq)]
pub struct Web {
    /// Part of the chord at which its middle lies
    pub at: f64,
    /// Plies from the leading edge backwards
    pub plies: Vec<Ply>,
}

/// One side of the profile: points from the leading edge to the trailing edge.
struct Side {
    /// 0 the upper one, 1 the lower one
    number: usize,
    points: Vec<Point>,
}

impl Side {
    /// Height above the chord at a part of it.
    fn height(&self, x: f64) -> f64 {
        let next = self.points.partition_point(|point| point[0] < x).clamp(1, self.points.len() - 1);
        let [from, to] = [self.points[next - 1], self.points[next]];
        if to[0] <= from[0] {
            return to[1];
        }
        let part = ((x - from[0]) / (to[0] - from[0])).clamp(0.0, 1.0);
        from[1] + part * (to[1] - from[1])
    }
}

impl Airfoil {
    /// Skin, webs, and a wall that closes the trailing edge.
    pub fn walls(&self) -> Result<Walls, SectionError> {
        check_positive("the chord", self.chord)?;
        let sides = self.sides()?;
        let parts = self.parts();
        let end = self.trailing_edge(&sides, &parts)?;
        let [upper, lower] = sides.each_ref().map(|side| self.divided(side, &parts, end));
        let mut walls = Walls::default();
        // Clockwise: over the upper side from left to right.
        let mut around: Vec<(usize, Point)> = Vec::new();
        let (first, second) = if self.leads_to_plus { (upper, lower) } else { (lower, upper) };
        let [first_side, second_side] = if self.leads_to_plus { [0, 1] } else { [1, 0] };
        around.extend(first.into_iter().rev().map(|at| (first_side, at)));
        // The leading edge is a point of both sides.
        around.extend(second.into_iter().skip(1).map(|at| (second_side, at)));
        for pair in around.windows(2) {
            let middle = 0.5 * (pair[0].1[0] + pair[1].1[0]);
            // The side of a segment is that of its end behind the leading edge.
            let side = if pair[0].1[0] > pair[1].1[0] { pair[0].0 } else { pair[1].0 };
            let plies = plies_at(&parts, side, middle).ok_or_else(|| bare(side, middle))?;
            self.add(&mut walls, [pair[0].1, pair[1].1], 0.0, plies);
        }
        let [start, stop] = [around[0].1, around[around.len() - 1].1];
        let closing = self.closing_plies(&parts, end)?;
        self.add(&mut walls, [stop, start], 0.0, &closing);
        self.check_webs()?;
        for web in &self.webs {
            if web.at >= end {
                let message =
                    format!("the web at {} lies behind the trailing edge, which is closed at {end:.4}", web.at);
                return Err(SectionError::Dimensions { message });
            }
            // Looking along it, the leading edge is on the left.
            let [above, below] = sides.each_ref().map(|side| [web.at, side.height(web.at)]);
            let ends = if self.leads_to_plus { [above, below] } else { [below, above] };
            self.add(&mut walls, ends, 0.5 * thickness(&web.plies), &web.plies);
        }
        Ok(walls)
    }

    /// Refuses webs that overlap.
    fn check_webs(&self) -> Result<(), SectionError> {
        for (k, first) in self.webs.iter().enumerate() {
            for second in &self.webs[k + 1..] {
                let apart = (second.at - first.at).abs() * self.chord;
                if apart < 0.5 * (1.0 - SAME_PLACE) * (thickness(&first.plies) + thickness(&second.plies)) {
                    let message = format!("the webs at {} and {} overlap", first.at, second.at);
                    return Err(SectionError::Dimensions { message });
                }
            }
        }
        Ok(())
    }

    /// Adds a wall between two points in parts of the chord.
    fn add(&self, walls: &mut Walls, ends: [Point; 2], left: f64, plies: &[Ply]) {
        let sense = if self.leads_to_plus { -1.0 } else { 1.0 };
        let [from, to] = ends.map(|[x, y]| [sense * (x - self.pitch_axis) * self.chord, y * self.chord]);
        let flips = self.fixed_sense && to[0] < from[0];
        let turned = |ply: &Ply| Ply { theta: if flips { -ply.theta } else { ply.theta }, ..ply.clone() };
        walls.add(from, to, None, left, &plies.iter().map(turned).collect::<Vec<_>>());
    }

    /// Upper and lower side, both from the leading edge.
    fn sides(&self) -> Result<[Side; 2], SectionError> {
        let fail = |message: String| SectionError::Outline { region: "profile".to_string(), message };
        let nose = (0..self.profile.len()).min_by(|&a, &b| self.profile[a][0].total_cmp(&self.profile[b][0]));
        let nose = nose.unwrap_or(0);
        let mut upper: Vec<Point> = self.profile[..=nose].to_vec();
        upper.reverse();
        let lower = self.profile[nose..].to_vec();
        for (name, points) in [("upper", &upper), ("lower", &lower)] {
            if points.len() < 2 {
                return Err(fail("must go from the trailing edge around the leading edge and back".to_string()));
            }
            // The leading edge may be blunt.
            let turns = |k: &usize| points[k + 1][0] < points[*k][0] || *k > 0 && points[k + 1][0] == points[*k][0];
            if let Some(k) = (0..points.len() - 1).find(turns) {
                let x = points[k + 1][0];
                return Err(fail(format!(
                    "must go from leading to trailing edge on its {name} side, but turns at {x}"
                )));
            }
        }
        let sides = [Side { number: 0, points: upper }, Side { number: 1, points: lower }];
        let middle = 0.5 * sides[0].points[sides[0].points.len() - 1][0];
        if sides[0].height(middle) <= sides[1].height(middle) {
            return Err(fail("must begin with its upper side".to_string()));
        }
        Ok(sides)
    }

    /// Parts of the skin, whose ends are kept away from webs.
    fn parts(&self) -> Vec<SkinPart> {
        let away = |x: f64| {
            let web =
                self.webs.iter().find(|web| (web.at - x).abs() * self.chord < STEP_BEHIND_WEB * thickness(&web.plies));
            web.map_or(x, |web| web.at + STEP_BEHIND_WEB * thickness(&web.plies) / self.chord)
        };
        self.skin.iter().map(|part| SkinPart { ends: part.ends.map(away), ..part.clone() }).collect()
    }

    /// The part of the chord at which the skin ends: where both sides and a closing wall have room.
    fn trailing_edge(&self, sides: &[Side; 2], parts: &[SkinPart]) -> Result<f64, SectionError> {
        let last = sides.each_ref().map(|side| side.points[side.points.len() - 1][0]);
        let last = last[0].min(last[1]);
        for k in (1..=SAMPLES).rev() {
            let x = last * k as f64 / SAMPLES as f64;
            let mut skins = [0.0; 2];
            for (skin, side) in skins.iter_mut().zip(sides) {
                *skin = thickness(plies_at(parts, side.number, x).ok_or_else(|| bare(side.number, x))?);
            }
            let room = (sides[0].height(x) - sides[1].height(x)) * self.chord;
            if room >= skins[0] + skins[1] + skins[0].min(skins[1]) {
                return Ok(x);
            }
        }
        let message = "the skins are thicker than the profile".to_string();
        Err(SectionError::Dimensions { message })
    }

    /// Plies of the thinner skin at the trailing edge.
    fn closing_plies(&self, parts: &[SkinPart], end: f64) -> Result<Vec<Ply>, SectionError> {
        let [upper, lower] = [0, 1].map(|side| plies_at(parts, side, end).ok_or_else(|| bare(side, end)));
        let (upper, lower) = (upper?, lower?);
        Ok(if thickness(upper) <= thickness(lower) { upper } else { lower }.to_vec())
    }

    /// Points of a side up to the end of the skin, with one at each step of the skin and at each
    /// web.
    fn divided(&self, side: &Side, parts: &[SkinPart], end: f64) -> Vec<Point> {
        let last = plies_at(parts, side.number, end).map_or(0.0, thickness);
        let mut inserted: Vec<(f64, f64)> = vec![(end, (FREE_AT_END * last / self.chord).max(SAME_PLACE))];
        for part in parts.iter().filter(|part| part.sides[side.number]) {
            inserted.extend(part.ends.map(|x| (x, SAME_PLACE)));
        }
        for web in &self.webs {
            inserted.push((web.at, (FREE_AT_WEB * thickness(&web.plies) / self.chord).max(SAME_PLACE)));
        }
        let first = side.points[0][0];
        inserted.retain(|(x, _)| *x > first + SAME_PLACE && *x <= end);
        sort_by(&mut inserted, |a, b| a.0.total_cmp(&b.0));
        inserted.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-9);
        let is_free = |point: &&Point| point[0] < end && inserted.iter().all(|(x, room)| (point[0] - x).abs() > *room);
        let mut points: Vec<Point> = vec![side.points[0]];
        points.extend(side.points[1..].iter().filter(is_free));
        points.extend(inserted.iter().map(|&(x, _)| [x, side.height(x)]));
        sort_by(&mut points, |a, b| a[0].total_cmp(&b[0]));
        points
    }
}

/// The plies of a side at a part of the chord: those of the last part that covers it.
fn plies_at(parts: &[SkinPart], side: usize, x: f64) -> Option<&[Ply]> {
    // Profiles may reach a little beyond their chord.
    let x = x.clamp(0.0, 1.0);
    let covers = |part: &&SkinPart| part.sides[side] && part.ends[0] <= x && x <= part.ends[1];
    parts.iter().rev().find(covers).map(|part| &part.plies[..])
}

fn thickness(plies: &[Ply]) -> f64 {
    plies.iter().map(|ply| ply.thickness).sum()
}

/// The error of a place without a skin.
fn bare(side: usize, x: f64) -> SectionError {
    let side = ["upper", "lower"][side];
    SectionError::Dimensions { message: format!("no part of the skin covers the {side} side at {x:.4} of the chord") }
}
