//! Lines along rigid surfaces, for pictures.

use super::surface::{Shape, Surface};
use crate::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

/// Pieces of a circle.
const CIRCLE: usize = 32;

/// Circles along a tube, about.
const MOST_SECTIONS: usize = 200;

/// Circles or straight lines in one direction along a surface.
const LINES: usize = 8;

impl Surface {
    /// Lines along the surface, in the axes of its carrier. Of surfaces without ends the part is shown
    /// that is within `reach` of the place `middle`.
    pub fn outline(&self, middle: Vec3, reach: f64) -> Vec<Vec<Vec3>> {
        match &self.shape {
            Shape::Plane { point, normal } => plane(middle - *normal * normal.dot(middle - *point), *normal, reach),
            Shape::Sphere { centre, radius } => ball(*centre, *radius),
            Shape::Cylinder { point, axis, radius } => {
                let middle = *point + *axis * axis.dot(middle - *point);
                let at = |k: usize| (middle + *axis * (reach * (k as f64 / 4.0 - 1.0)), *radius);
                pipe(&(0..=8).map(at).collect::<Vec<_>>())
            }
            Shape::Cone(cone) => {
                let ends: Vec<(Vec3, f64)> = cone.ends().into_iter().zip(cone.radii()).collect();
                let balls = ends.iter().flat_map(|(centre, radius)| ball(*centre, *radius));
                pipe(&ends).into_iter().chain(balls).collect()
            }
            Shape::Torus { centre, axis, ring, radius } => torus(*centre, *axis, *ring, *radius),
            Shape::Box { centre, axes, half } => cuboid(*centre, axes, *half),
            Shape::Tube(tube) => {
                let sections = tube.sections();
                let step = sections.len().div_ceil(MOST_SECTIONS).max(1);
                let last = sections[sections.len() - 1];
                let some = sections.into_iter().step_by(step).chain((step > 1).then_some(last));
                pipe(&some.collect::<Vec<_>>())
            }
            Shape::Mesh(mesh) => mesh.outline().into_iter().map(Vec::from).collect(),
        }
    }
}

/// Two directions that are normal to an axis and to each other.
fn across(axis: Vec3) -> [Vec3; 2] {
    let least = (0..3).fold(0, |least, k| if axis.0[k].abs() < axis.0[least].abs() { k } else { least });
    let first = axis.cross(Vec3::UNIT[least]).normalized().unwrap_or(Vec3::UNIT[least]);
    [first, axis.cross(first)]
}

/// A circle, or the part of a turn of it.
fn circle(centre: Vec3, [a, b]: [Vec3; 2]) -> Vec<Vec3> {
    let at = |k: usize| {
        let angle = 2.0 * PI * k as f64 / CIRCLE as f64;
        centre + a * libm::cos(angle) + b * libm::sin(angle)
    };
    (0..=CIRCLE).map(at).collect()
}

fn plane(middle: Vec3, normal: Vec3, reach: f64) -> Vec<Vec<Vec3>> {
    let [a, b] = across(normal).map(|direction| direction * reach);
    let half = LINES as f64 / 2.0;
    let lines = |a: Vec3, b: Vec3| {
        (0..=LINES).map(move |k| {
            let at = middle + a * (k as f64 / half - 1.0);
            (0..=LINES).map(|j| at + b * (j as f64 / half - 1.0)).collect()
        })
    };
    lines(a, b).chain(lines(b, a)).collect()
}

fn ball(centre: Vec3, radius: f64) -> Vec<Vec<Vec3>> {
    let [x, y, z] = Vec3::UNIT.map(|axis| axis * radius);
    let mut lines = vec![];
    for k in 1..LINES {
        let angle = PI * k as f64 / LINES as f64;
        let [c, s] = [libm::cos(angle), libm::sin(angle)];
        lines.push(circle(centre + z * c, [x * s, y * s]));
        lines.push(circle(centre, [x * c + y * s, z]));
    }
    lines.push(circle(centre, [x, z]));
    lines
}

fn torus(centre: Vec3, axis: Vec3, ring: f64, radius: f64) -> Vec<Vec<Vec3>> {
    let [a, b] = across(axis);
    let mut lines = vec![];
    for k in 0..LINES {
        let angle = 2.0 * PI * k as f64 / LINES as f64;
        let [c, s] = [libm::cos(angle), libm::sin(angle)];
        let far = ring + radius * c;
        lines.push(circle(centre + axis * (radius * s), [a * far, b * far]));
        let outward = a * c + b * s;
        lines.push(circle(centre + outward * ring, [outward * radius, axis * radius]));
    }
    lines
}

fn cuboid(centre: Vec3, axes: &Mat3, half: [f64; 3]) -> Vec<Vec<Vec3>> {
    let corner = |signs: [f64; 3]| centre + *axes * Vec3([0, 1, 2].map(|k| signs[k] * half[k]));
    let mut lines = vec![];
    for along in 0..3 {
        for number in 0..4 {
            let mut signs = [1.0; 3];
            signs[(along + 1) % 3] = if number & 1 == 0 { 1.0 } else { -1.0 };
            signs[(along + 2) % 3] = if number & 2 == 0 { 1.0 } else { -1.0 };
            let mut other = signs;
            other[along] = -1.0;
            lines.push(vec![corner(signs), corner(other)]);
        }
    }
    lines
}

/// Circles about the points of a line with their radii, and lines along it.
fn pipe(sections: &[(Vec3, f64)]) -> Vec<Vec<Vec3>> {
    let last = sections.len() - 1;
    let direction = |k: usize| (sections[(k + 1).min(last)].0 - sections[k.saturating_sub(1)].0).normalized();
    let mut first = across(direction(0).unwrap_or(Vec3::UNIT[0]))[0];
    let mut along = vec![vec![]; LINES];
    let mut lines = vec![];
    for (k, (centre, radius)) in sections.iter().enumerate() {
        let axis = direction(k).unwrap_or(Vec3::UNIT[0]);
        // The smallest rotation from section to section: lines do not wind.
        first = (first - axis * axis.dot(first)).normalized().unwrap_or(across(axis)[0]);
        let second = axis.cross(first);
        lines.push(circle(*centre, [first * *radius, second * *radius]));
        for (number, line) in along.iter_mut().enumerate() {
            let angle = 2.0 * PI * number as f64 / LINES as f64;
            line.push(*centre + (first * libm::cos(angle) + second * libm::sin(angle)) * *radius);
        }
    }
    lines.extend(along);
    lines
}

#[cfg(test)]
mod tests {
    use super::super::distance::Side;
    use super::super::surface::tests::shapes;
    use super::*;

    /// Points of all lines lie on the surface; those at the ends of cones and straight tubes may lie
    /// within it.
    #[test]
    fn lines_lie_on_the_surface() {
        for (name, shape) in shapes() {
            let may_be_inside = matches!(shape, Shape::Cone(_) | Shape::Tube(_));
            let surface = Surface { shape, side: Side::Outside };
            let lines = surface.outline(Vec3::ZERO, 2.0);
            assert!(lines.len() >= 8, "{name}");
            for point in lines.iter().flatten() {
                let Some(value) = surface.value(*point, 1e-3) else { continue };
                let is_on = value.abs() < 0.02 || (may_be_inside && value < 0.02);
                assert!(is_on, "{name}: {point:?} {value}");
            }
        }
    }
}
