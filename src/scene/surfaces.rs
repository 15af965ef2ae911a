//! Rigid surfaces: from tables of the deck to shapes.

use super::constraints::axes;
use super::mesh_surface::mesh;
use super::names;
use crate::deck::{self, Deck, Diagnostic, SideWord, Spanned, SurfaceBody, TubeLine};
use beamsim_core::kernel::contact::{Cone, Shape, Side, Surface, Tube, TubeEnds, TubeError};
use beamsim_core::tensor::Vec3;
use std::f64::consts::PI;

/// Straight pieces between points of a spline along an arc, in a full circle.
const POINTS_OF_CIRCLE: f64 = 256.0;

/// The shape of a surface with its side.
pub fn surface(deck: &Deck, table: &deck::Surface) -> Result<Surface, Diagnostic> {
    let side = match table.side {
        SideWord::Outside => Side::Outside,
        SideWord::Inside => Side::Inside,
    };
    Ok(Surface { shape: shape(deck, table)?, side })
}

fn shape(deck: &Deck, table: &deck::Surface) -> Result<Shape, Diagnostic> {
    let place = |point: &deck::SurfacePoint| names::place(deck, point);
    let wrong = |message: String| Diagnostic::error(message, table.span.clone());
    let name = &table.name.value;
    match &table.body {
        SurfaceBody::Plane { point, normal } => Ok(Shape::Plane { point: place(point)?, normal: Vec3(*normal) }),
        SurfaceBody::Sphere { at, radius } => Ok(Shape::Sphere { centre: place(at)?, radius: *radius }),
        SurfaceBody::Cylinder { axis: [from, to], radius } => {
            let point = place(from)?;
            let axis = (place(to)? - point).normalized();
            let axis = axis.ok_or_else(|| wrong(format!("`from` and `to` of the surface `{name}` are one point")))?;
            Ok(Shape::Cylinder { point, axis, radius: *radius })
        }
        SurfaceBody::Cone { axis: [from, to], radii } => {
            let cone = Cone::new(place(from)?, place(to)?, *radii);
            let message = || {
                wrong(format!(
                    "the surface `{name}` has no side: `from` and `to` are one point, or one end sphere contains the other"
                ))
            };
            cone.map(Shape::Cone).ok_or_else(message)
        }
        SurfaceBody::Torus { at, axis, ring, radius } => {
            Ok(Shape::Torus { centre: place(at)?, axis: Vec3(*axis), ring: *ring, radius: *radius })
        }
        SurfaceBody::Box { at, half, axes: directions } => {
            Ok(Shape::Box { centre: place(at)?, axes: axes(*directions), half: *half })
        }
        SurfaceBody::Tube { line, smooth, radii } => tube(deck, table, line, *smooth, radii),
        SurfaceBody::Mesh { file, scale, at, axes: directions } => {
            let at = at.as_ref().map_or(Ok(Vec3::ZERO), place)?;
            mesh(deck, file, at, axes(*directions) * *scale).map(Shape::Mesh)
        }
    }
}

fn tube(
    deck: &Deck,
    table: &deck::Surface,
    line: &TubeLine,
    smooth: bool,
    radii: &Spanned<Vec<f64>>,
) -> Result<Shape, Diagnostic> {
    let (points, radii_of_points) = match line {
        TubeLine::Through(points) => {
            let places: Vec<Vec3> = points.iter().map(|point| names::place(deck, point)).collect::<Result<_, _>>()?;
            let count = places.len();
            (places, spread(&radii.value, count))
        }
        TubeLine::Arc([a, b, c]) => {
            let [a, b, c] = [names::place(deck, a)?, names::place(deck, b)?, names::place(deck, c)?];
            let places = arc(a, b, c).ok_or_else(|| {
                Diagnostic::error("the three points of `arc` lie on a line: use `through`", table.span.clone())
            })?;
            let count = places.len();
            (places, spread(&radii.value, count))
        }
    };
    let build = if smooth { Tube::smooth } else { Tube::straight };
    build(&points, &radii_of_points, TubeEnds::Open).map(Shape::Tube).map_err(|error| refuse(table, radii, error))
}

/// One radius for each of some points: equal ones, or linear between the first and the last.
fn spread(radii: &[f64], count: usize) -> Vec<f64> {
    match radii {
        [one] => vec![*one; count],
        [from, to] if count != 2 => (0..count).map(|k| from + (to - from) * k as f64 / (count - 1) as f64).collect(),
        several => several.to_vec(),
    }
}

/// Points of the arc from `a` through `b` to `c`; `None` if they lie on a line.
fn arc(a: Vec3, b: Vec3, c: Vec3) -> Option<Vec<Vec3>> {
    let ab = b - a;
    let ac = c - a;
    let normal = ab.cross(ac);
    let e3 = normal.normalized()?;
    let to_centre = (normal.cross(ab) * ac.squared() + ac.cross(normal) * ab.squared()) * (0.5 / normal.squared());
    let centre = a + to_centre;
    let radius = to_centre.norm();
    let e1 = (a - centre).normalized()?;
    let e2 = e3.cross(e1);
    let end = c - centre;
    let angle = libm::atan2(end.dot(e2), end.dot(e1));
    let angle = if angle <= 0.0 { angle + 2.0 * PI } else { angle };
    let count = (angle / (2.0 * PI) * POINTS_OF_CIRCLE).ceil().max(2.0) as usize;
    let place = |k: usize| {
        let turned = angle * k as f64 / count as f64;
        centre + (e1 * libm::cos(turned) + e2 * libm::sin(turned)) * radius
    };
    Some((0..=count).map(place).collect())
}

fn refuse(table: &deck::Surface, radii: &Spanned<Vec<f64>>, error: TubeError) -> Diagnostic {
    let name = &table.name.value;
    let of_radius = |message: String| Diagnostic::error(message, radii.span.clone());
    match error {
        TubeError::Points => of_radius(format!("the tube `{name}` needs two or more points, each with a radius")),
        TubeError::Repeated(k) => {
            let message = format!("point {} of the tube `{name}` is equal to the one before it", k + 1);
            Diagnostic::error(message, table.span.clone())
        }
        TubeError::Radius(k) => {
            of_radius(format!("the radius of the tube `{name}` is not positive after point {}", k + 1))
        }
        TubeError::Steep(k) => of_radius(format!(
            "the radius of the tube `{name}` changes by as much as its centre line advances after point {}",
            k + 1
        ))
        .help("place the points farther apart, or change the radius less"),
        TubeError::Curved(k) => of_radius(format!(
            "the centre line of the tube `{name}` bends with a smaller radius than that of the tube after point {}",
            k + 1
        ))
        .help("use a smaller `radius`, or points along a gentler bend"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_pass_through_their_points() {
        let [a, b, c] = [Vec3([1.0, 0.0, 2.0]), Vec3([0.0, 1.0, 2.0]), Vec3([0.0, -1.0, 2.0])];
        let points = arc(a, b, c).unwrap();
        assert_eq!(points.len(), 193);
        assert!((points[64] - b).norm() < 1e-14 && (points[192] - c).norm() < 1e-14);
        assert!(points.iter().all(|point| ((*point - Vec3([0.0, 0.0, 2.0])).norm() - 1.0).abs() < 1e-14));
        assert_eq!(arc(a, a * 2.0, a * 3.0), None);
    }
}
