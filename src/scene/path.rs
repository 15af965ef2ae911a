//! Centre lines: straight pieces, arcs, helices and splines, and the section axes along them.

use super::along::Along;
use super::curve::{Helix, Spline};
use crate::deck::{self, Diagnostic, PointRef, Span, Spanned};
use beamsim_core::tensor::{Mat3, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Places of a turn, or of a segment of a spline, at which the tangent is compared with `axis3`.
const TANGENTS: f64 = 720.0;

/// Places of a curve at which the tangent is compared with `axis3`, at most.
const MOST_TANGENTS: f64 = 1e5;

/// Angle that the tangent turns by along an element of order 1, at most, rad: elements of order 2
/// and 3 may turn by twice and three times as much.
const MOST_TURN: f64 = 60.0 * PI / 180.0;

/// Steps in which the turn of the tangent is measured along an element, a turn of a helix, or a
/// segment of a spline.
const TURN_STEPS: f64 = 8.0;

/// Least speed of a spline over the sum of its chords: less is a cusp.
const SLOWEST: f64 = 1e-3;

/// One piece of a centre line.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Start
    start: Vec3,
    /// End
    end: Vec3,
    curve: Curve,
    /// Arc length
    pub(crate) length: f64,
    /// The vector whose part normal to the tangent is local axis 3
    axis3: Vec3,
}

#[derive(Clone, Debug)]
enum Curve {
    Line,
    /// x = centre + radius (cos a e + sin a f), a from 0 to `angle`
    Arc {
        centre: Vec3,
        radius: f64,
        e: Vec3,
        f: Vec3,
        angle: f64,
    },
    Helix(Helix),
    /// Arc length from `from` on, over some segments between points
    Spline {
        spline: Arc<Spline>,
        from: f64,
        segments: usize,
    },
}

/// The part of a piece that an element covers. Places are fractions of the length of the piece.
#[derive(Clone, Copy, Debug)]
pub enum Cover {
    /// One of some equal parts
    Equal {
        /// From 0
        number: usize,
        /// The number of parts
        count: usize,
    },
    /// From one place to another
    Between {
        /// The first place
        start: f64,
        /// The last place
        end: f64,
    },
}

impl Cover {
    /// The place at xi, which goes from -1 to 1.
    pub fn place(self, xi: f64) -> f64 {
        match self {
            Self::Equal { number, count } => (number as f64 + 0.5 * (xi + 1.0)) / count as f64,
            Self::Between { start, end } => start + 0.5 * (xi + 1.0) * (end - start),
        }
    }

    /// This part of a length.
    fn of(self, length: f64) -> f64 {
        match self {
            Self::Equal { count, .. } => length / count as f64,
            Self::Between { start, end } => length * (end - start),
        }
    }

    /// The way to a node, in pieces, where the part has `steps` equal steps between nodes.
    fn way(self, node: usize, steps: usize) -> f64 {
        match self {
            Self::Equal { count, .. } => node as f64 / (steps * count) as f64,
            Self::Between { start, end } => (end - start) * (node as f64 / steps as f64),
        }
    }
}

/// The centre line of a beam with its section axes.
#[derive(Clone, Debug)]
pub struct CentreLine {
    /// The pieces in order
    pub(crate) pieces: Vec<Piece>,
    /// Arc length of all
    pub(crate) length: f64,
    /// Arc length before each piece
    before: Vec<f64>,
    /// Angle of axes 2 and 3 about axis 1
    twist: Along<1>,
    /// The section axes of each straight piece without twist, which are the same everywhere on it
    constant_axes: Vec<Option<Mat3>>,
}

impl Piece {
    /// The place at the fraction `t` of the piece; ends are met to the last bit.
    pub fn place(&self, t: f64) -> Vec3 {
        if t == 0.0 {
            return self.start;
        }
        if t == 1.0 {
            return self.end;
        }
        match &self.curve {
            Curve::Line => self.start + (self.end - self.start) * t,
            Curve::Arc { centre, radius, e, f, angle } => {
                let a = t * angle;
                *centre + (*e * libm::cos(a) + *f * libm::sin(a)) * *radius
            }
            Curve::Helix(helix) => helix.place(t),
            Curve::Spline { spline, from, .. } => spline.place(from + t * self.length),
        }
    }

    /// The unit tangent at the fraction `t`.
    pub fn tangent(&self, t: f64) -> Vec3 {
        match &self.curve {
            Curve::Line => (self.end - self.start) * (1.0 / self.length),
            Curve::Arc { e, f, angle, .. } => {
                let a = t * angle;
                *f * libm::cos(a) - *e * libm::sin(a)
            }
            Curve::Helix(helix) => helix.tangent(t),
            Curve::Spline { spline, from, .. } => spline.tangent(from + t * self.length),
        }
    }

    /// Turns of a helix, segments of a spline, else 1: parts in which the tangent has no more than
    /// about one turn.
    fn windings(&self) -> f64 {
        match &self.curve {
            Curve::Line | Curve::Arc { .. } => 1.0,
            Curve::Helix(helix) => helix.turns(),
            Curve::Spline { segments, .. } => *segments as f64,
        }
    }

    /// The unit tangent of an element and its length over that of xi; `stretch`: derivative of the
    /// interpolated line over xi. On a straight piece equal elements have the same, without the
    /// round-off in the places of their nodes, so that they can share data.
    pub fn slope(&self, stretch: impl FnOnce() -> Vec3, cover: Cover) -> (Vec3, f64) {
        match &self.curve {
            Curve::Line => (self.tangent(0.0), cover.of(0.5 * self.length)),
            Curve::Arc { .. } | Curve::Helix(_) | Curve::Spline { .. } => {
                let stretch = stretch();
                (stretch * (1.0 / stretch.norm()), stretch.norm())
            }
        }
    }

    /// The chord of an element relative to its part of a straight piece: 1 but for round-off in the
    /// places of its nodes.
    pub fn rounding(&self, chord: Vec3, cover: Cover) -> f64 {
        match (&self.curve, cover) {
            (Curve::Line, Cover::Equal { count, .. }) => chord.norm() * count as f64 / self.length,
            (Curve::Line, Cover::Between { .. }) => chord.norm() / cover.of(self.length),
            (Curve::Arc { .. } | Curve::Helix(_) | Curve::Spline { .. }, _) => 1.0,
        }
    }

    /// The way from the first node of an element to the next ones, where these stand at `places`.
    pub fn arms<const N: usize>(&self, places: [Vec3; N], cover: Cover) -> [Vec3; N] {
        let straight = |i: usize| (self.end - self.start) * cover.way(i, N - 1);
        match &self.curve {
            Curve::Line => std::array::from_fn(straight),
            Curve::Arc { .. } | Curve::Helix(_) | Curve::Spline { .. } => places.map(|place| place - places[0]),
        }
    }

    /// The section axes for the unit tangent `e1`, before twist: E3 is the part of axis3 normal to
    /// it, E2 = E3 x E1.
    pub fn untwisted_axes(&self, e1: Vec3) -> Mat3 {
        let normal = self.axis3 - e1 * self.axis3.dot(e1);
        let e3 = normal.normalized().unwrap_or(self.axis3);
        Mat3::from_columns(e1, e3.cross(e1), e3)
    }
}

impl CentreLine {
    /// The line through these pieces.
    fn new(pieces: Vec<Piece>, twist: Along<1>) -> Self {
        let mut length = 0.0;
        let mut before = Vec::with_capacity(pieces.len());
        for piece in &pieces {
            before.push(length);
            length += piece.length;
        }
        let constant_axes = |piece: &Piece| match piece.curve {
            Curve::Line if twist.is_zero() => Some(piece.untwisted_axes(piece.tangent(0.0))),
            Curve::Line | Curve::Arc { .. } | Curve::Helix(_) | Curve::Spline { .. } => None,
        };
        let constant_axes = pieces.iter().map(constant_axes).collect();
        Self { pieces, length, before, twist, constant_axes }
    }

    /// The section axes on the piece `piece` for the unit tangent `e1`, at the fraction `s` of the
    /// beam's length.
    pub fn axes(&self, piece: usize, e1: Vec3, s: f64) -> Mat3 {
        if let Some(axes) = self.constant_axes[piece] {
            return axes;
        }
        let axes = self.pieces[piece].untwisted_axes(e1);
        let [angle] = self.twist.at(s);
        if angle == 0.0 {
            return axes;
        }
        let sin = libm::sin(angle);
        let cos = libm::cos(angle);
        let [e1, e2, e3] = [0, 1, 2].map(|k| axes.column(k));
        Mat3::from_columns(e1, e2 * cos + e3 * sin, e3 * cos - e2 * sin)
    }

    /// The fraction of the beam's length at the fraction `t` of a piece.
    pub fn fraction(&self, piece: usize, t: f64) -> f64 {
        (self.before[piece] + t * self.pieces[piece].length) / self.length
    }

    /// The piece and the fraction in it at the fraction `s` of the beam's length.
    pub fn locate(&self, s: f64) -> (usize, f64) {
        let along = s * self.length;
        let number = self.before.partition_point(|&before| before * (1.0 + 1e-12) < along).max(1) - 1;
        (number, ((along - self.before[number]) / self.pieces[number].length).clamp(0.0, 1.0))
    }

    /// The fraction of the length at which a place lies on the line, if it does.
    pub fn find(&self, place: Vec3) -> Option<f64> {
        let near = |p: Vec3| (p - place).norm() < 1e-9 * self.length;
        self.pieces.iter().enumerate().find_map(|(number, piece)| {
            let t = match &piece.curve {
                Curve::Line => (place - piece.start).dot(piece.tangent(0.0)) / piece.length,
                Curve::Arc { centre, e, f, angle, .. } => {
                    let x = (place - *centre).dot(*e);
                    let y = (place - *centre).dot(*f);
                    libm::atan2(y, x).rem_euclid(2.0 * PI) / angle
                }
                // Only ends of these have names.
                Curve::Helix(_) | Curve::Spline { .. } => f64::from(near(piece.end)),
            };
            ((0.0..=1.0).contains(&t) && near(piece.place(t))).then(|| self.fraction(number, t))
        })
    }
}

/// The centre line of a beam; `places` gives the coordinates of named points.
pub fn centre_line(
    beam: &deck::Beam,
    place: &dyn Fn(&Spanned<PointRef>) -> Result<Vec3, Diagnostic>,
) -> Result<CentreLine, Diagnostic> {
    // Only the direction counts, but squares of very large or very small components overflow or
    // vanish.
    let ordinary = |axis: Vec3| axis == Vec3::ZERO || (1e-100..1e100).contains(&axis.max_abs());
    let given = beam.axis3.as_ref().map(|axis| {
        let value = Vec3(axis.value);
        let value = if ordinary(value) { value } else { value.normalized().unwrap_or(value) };
        Spanned { value, span: axis.span.clone() }
    });
    if let Some(axis) = given.as_ref().filter(|axis| axis.value == Vec3::ZERO) {
        return Err(Diagnostic::error("`axis3` must not be zero", axis.span.clone()));
    }
    let pieces = match &beam.path {
        deck::Path::Through(points) => {
            let places: Vec<Vec3> = points.iter().map(place).collect::<Result<_, _>>()?;
            let piece = |k: usize| line(beam, places[k], places[k + 1], given.as_ref(), &points[k + 1].span);
            (0..places.len() - 1).map(piece).collect::<Result<Vec<_>, _>>()?
        }
        deck::Path::Arc(points) => {
            let [a, b, c] = [place(&points[0])?, place(&points[1])?, place(&points[2])?];
            vec![arc(beam, [a, b, c], given.as_ref(), &points[1].span)?]
        }
        deck::Path::Helix(path) => vec![helix(beam, path, place, given.as_ref())?],
        deck::Path::Spline(path) => {
            let places: Vec<Vec3> = path.points.iter().map(place).collect::<Result<_, _>>()?;
            spline(beam, path, &places, given.as_ref())?
        }
    };
    Ok(CentreLine::new(pieces, along(beam, beam.twist.as_ref())))
}

/// Refuses elements so long that nodes on a helix or spline lose its shape: a turn of one element
/// would be straight.
pub fn refuse_coarse(beam: &deck::Beam, line: &CentreLine) -> Result<(), Diagnostic> {
    for (number, piece) in line.pieces.iter().enumerate() {
        let kind = match piece.curve {
            Curve::Line | Curve::Arc { .. } => continue,
            Curve::Helix(_) => "helix",
            Curve::Spline { .. } => "spline",
        };
        let division = beam.elements_of(number);
        let most = MOST_TURN * beam.order as f64;
        let is_coarse = |part: &usize| turn(piece, [division.end(*part), division.end(part + 1)]) > most * (1.0 + 1e-6);
        if let Some(part) = (0..division.count()).find(is_coarse) {
            let degrees = turn(piece, [division.end(part), division.end(part + 1)]).to_degrees().round();
            let most = most.to_degrees().round();
            let message = format!(
                "element {} of the {kind} of beam `{}` turns by {degrees}°; elements of order {} may turn by {most}°",
                part + 1,
                beam.name.value,
                beam.order
            );
            return Err(Diagnostic::error(message, beam.elements.span.clone()).help("use more `elements`"));
        }
    }
    Ok(())
}

/// The angle by which the tangent turns between two fractions of a piece.
fn turn(piece: &Piece, [start, end]: [f64; 2]) -> f64 {
    let steps = (TURN_STEPS * (piece.windings() * (end - start)).ceil().max(1.0)).min(MOST_TANGENTS);
    let tangent = |k: usize| piece.tangent(start + (end - start) * (k as f64 / steps));
    let between = |k: usize| {
        let [a, b] = [tangent(k), tangent(k + 1)];
        libm::atan2(a.cross(b).norm(), a.dot(b))
    };
    (0..steps as usize).map(between).sum()
}

/// Numbers that a beam gives at its start and its end, or at its stations; zero where it gives none.
pub fn along<const N: usize>(beam: &deck::Beam, values: Option<&Spanned<Vec<[f64; N]>>>) -> Along<N> {
    let Some(values) = values else { return Along::zero() };
    Along::new(&values.value, stations(beam).as_deref())
}

/// Places of the stations of a beam as fractions of its length, where it has stations.
pub fn stations(beam: &deck::Beam) -> Option<Vec<f64>> {
    let stations = &beam.stations.as_ref()?.value;
    let last = stations.last().copied().unwrap_or(1.0);
    Some(stations.iter().map(|station| station / last).collect())
}

fn line(
    beam: &deck::Beam,
    start: Vec3,
    end: Vec3,
    axis3: Option<&Spanned<Vec3>>,
    span: &Span,
) -> Result<Piece, Diagnostic> {
    refuse_no_length(beam, start, end, span)?;
    let length = (end - start).norm();
    let tangent = (end - start) * (1.0 / length);
    let along_z = tangent.cross(Vec3::UNIT[2]).norm() < 1e-6;
    let default = if along_z { Vec3::UNIT[1] } else { Vec3::UNIT[2] };
    let axis = axis3.map_or(default, |axis| axis.value);
    if let Some(axis) = axis3.filter(|axis| axis.value.cross(tangent).norm() <= 1e-6 * axis.value.norm()) {
        let message = format!("`axis3` is parallel to a piece of beam `{}`", beam.name.value);
        return Err(Diagnostic::error(message, axis.span.clone())
            .help("local axis 3 is the component of `axis3` normal to the beam"));
    }
    Ok(Piece { start, end, curve: Curve::Line, length, axis3: axis })
}

fn arc(
    beam: &deck::Beam,
    [a, b, c]: [Vec3; 3],
    axis3: Option<&Spanned<Vec3>>,
    span: &Span,
) -> Result<Piece, Diagnostic> {
    let u = b - a;
    let v = c - a;
    let cross = u.cross(v);
    let sizes = u.norm() * v.norm();
    if sizes.is_nan() || cross.norm() <= 1e-9 * sizes || (c - b).norm() <= 1e-12 * v.norm() || sizes == 0.0 {
        let message = format!("the three points of the arc of beam `{}` lie on a line", beam.name.value);
        return Err(Diagnostic::error(message, span.clone()).help("for a straight beam use `through`"));
    }
    let normal = cross * (1.0 / cross.norm());
    let to_centre = (cross.cross(u) * v.squared() + v.cross(cross) * u.squared()) * (0.5 / cross.squared());
    let centre = a + to_centre;
    let radius = to_centre.norm();
    let e = (a - centre) * (1.0 / radius);
    let f = normal.cross(e);
    let angle = libm::atan2((c - centre).dot(f), (c - centre).dot(e)).rem_euclid(2.0 * PI);
    let piece = Piece {
        start: a,
        end: c,
        curve: Curve::Arc { centre, radius, e, f, angle },
        length: radius * angle,
        axis3: axis3.map_or(normal, |axis| axis.value),
    };
    if let Some(axis) = axis3 {
        refuse_parallel(beam, &piece, &axis.span)?;
    }
    Ok(piece)
}

fn helix(
    beam: &deck::Beam,
    path: &deck::Helix,
    place: &dyn Fn(&Spanned<PointRef>) -> Result<Vec3, Diagnostic>,
    axis3: Option<&Spanned<Vec3>>,
) -> Result<Piece, Diagnostic> {
    let name = &beam.name.value;
    let start = place(&path.start)?;
    let found = Helix::new(start, place(&path.centre)?, Vec3(path.axis), path.pitch, path.turns);
    let helix = found.ok_or_else(|| {
        let message = format!("the helix of beam `{name}` starts on its axis");
        Diagnostic::error(message, path.start.span.clone())
            .help("the radius is the distance of `start` from the axis through `centre`")
    })?;
    let length = helix.length();
    refuse_infinite(beam, length, &path.span)?;
    let mut end = helix.place(1.0);
    if let Some(point) = &path.end {
        let given = place(point)?;
        if (given - end).norm() > 1e-9 * length.max(end.norm()) {
            let Vec3([x, y, z]) = end;
            let message = format!("the helix of beam `{name}` does not end at this point");
            return Err(Diagnostic::error(message, point.span.clone()).help(format!("it ends at [{x}, {y}, {z}]")));
        }
        end = given;
    }
    let axis = axis3.map_or(helix.axis(), |axis| axis.value);
    let piece = Piece { start, end, curve: Curve::Helix(helix), length, axis3: axis };
    refuse_parallel(beam, &piece, axis3.map_or(&path.span, |axis| &axis.span))?;
    Ok(piece)
}

fn spline(
    beam: &deck::Beam,
    path: &deck::SplinePath,
    places: &[Vec3],
    axis3: Option<&Spanned<Vec3>>,
) -> Result<Vec<Piece>, Diagnostic> {
    for (k, ends) in places.windows(2).enumerate() {
        refuse_no_length(beam, ends[0], ends[1], &path.points[k + 1].span)?;
    }
    let spline = Arc::new(Spline::new(places, path.tangents.as_ref().map(|tangents| tangents.value.map(Vec3))));
    let span = &path.points[0].span;
    if spline.slowest() < SLOWEST {
        let message = format!("the spline of beam `{}` has a cusp", beam.name.value);
        return Err(Diagnostic::error(message, span.clone()).help("use more points, in order along the line"));
    }
    let corners = path.corners();
    let piece = |ends: &[usize]| {
        let from = spline.length_to(ends[0]);
        let length = spline.length_to(ends[1]) - from;
        let piece = Piece {
            start: places[ends[0]],
            end: places[ends[1]],
            curve: Curve::Spline { spline: spline.clone(), from, segments: ends[1] - ends[0] },
            length,
            axis3: axis3.map_or(Vec3::UNIT[2], |axis| axis.value),
        };
        refuse_parallel(beam, &piece, axis3.map_or(span, |axis| &axis.span))?;
        Ok(piece)
    };
    corners.windows(2).map(piece).collect()
}

/// Refuses a curve along which `axis3` has no part normal to it somewhere: looks closely enough for
/// any arc.
fn refuse_parallel(beam: &deck::Beam, piece: &Piece, span: &Span) -> Result<(), Diagnostic> {
    let axis = piece.axis3;
    let count = (TANGENTS * piece.windings().max(1.0)).min(MOST_TANGENTS) as usize;
    let parallel = |k: usize| piece.tangent(k as f64 / count as f64).cross(axis).norm() <= 1e-2 * axis.norm();
    if !(0..=count).any(parallel) {
        return Ok(());
    }
    let line = match piece.curve {
        Curve::Line => "line",
        Curve::Arc { .. } => "arc",
        Curve::Helix(_) => "helix",
        Curve::Spline { .. } => "spline",
    };
    let error = if beam.axis3.is_some() {
        Diagnostic::error(
            format!("`axis3` is parallel to the {line} of beam `{}` at some point", beam.name.value),
            span.clone(),
        )
    } else {
        let Vec3([x, y, z]) = axis;
        let message = format!(
            "the {line} of beam `{}` is parallel to its `axis3` at some point, which is [{x}, {y}, {z}] if left out",
            beam.name.value
        );
        Diagnostic::error(message, span.clone()).help("give `axis3`: a vector that is nowhere along the beam")
    };
    Err(error)
}

fn refuse_infinite(beam: &deck::Beam, length: f64, span: &Span) -> Result<(), Diagnostic> {
    if length.is_finite() {
        return Ok(());
    }
    let message =
        format!("a piece of beam `{}` has a length beyond the range of floating-point numbers", beam.name.value);
    Err(Diagnostic::error(message, span.clone()))
}

fn refuse_no_length(beam: &deck::Beam, start: Vec3, end: Vec3, span: &Span) -> Result<(), Diagnostic> {
    let length = (end - start).norm();
    refuse_infinite(beam, length, span)?;
    if length > 1e-12 * start.norm().max(end.norm()) {
        return Ok(());
    }
    let message = format!("a piece of beam `{}` has no length: it starts and ends at the same place", beam.name.value);
    Err(Diagnostic::error(message, span.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(points: [[f64; 3]; 3]) -> Piece {
        let text = "[section.s]\nEA = 1\nGA = 1\nGJ = 1\nEI = 1\n[[beam]]\nname = \"b\"\nsection = \"s\"\narc = [[0,0,0],[1,0,0],[1,1,0]]\nelements = 1";
        let (deck, _) = deck::read(text).unwrap();
        arc(&deck.beams[0], points.map(Vec3), None, &(0..0)).unwrap()
    }

    #[test]
    fn an_arc_passes_its_three_points() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let quarter = piece([[1.0, 0.0, 0.0], [half, half, 0.0], [0.0, 1.0, 0.0]]);
        assert!((quarter.length - PI / 2.0).abs() < 1e-15);
        assert!((quarter.place(0.5) - Vec3([half, half, 0.0])).norm() < 1e-15);
        assert!((quarter.tangent(0.0) - Vec3([0.0, 1.0, 0.0])).norm() < 1e-15);
        let long_way = piece([[1.0, 0.0, 0.0], [-half, -half, 0.0], [0.0, 1.0, 0.0]]);
        assert!((long_way.length - 1.5 * PI).abs() < 1e-14, "clockwise through the lower half");
    }

    #[test]
    fn axes_are_right_handed_and_twist_about_the_tangent() {
        let quarter = piece([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 1.0, 0.0]]);
        let line = CentreLine::new(vec![quarter], Along::new(&[[0.0], [PI / 2.0]], None));
        let e1 = line.pieces[0].tangent(1.0);
        let plain = line.pieces[0].untwisted_axes(e1);
        let turned = line.axes(0, e1, 1.0);
        assert!((plain.column(0).cross(plain.column(1)) - plain.column(2)).norm() < 1e-15);
        assert!((turned.column(1) - plain.column(2)).norm() < 1e-15);
    }
}
