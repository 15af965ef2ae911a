//! Tests of triangle meshes against closed forms and dual numbers.

use super::along::ShapeAt;
use super::dual::{Random, jacobian, variables};
use super::mesh_parts::MeshError;
use super::{Feature, Shape, Side, Surface, TriangleMesh};
use crate::tensor::{Mat3, Vec3};
use std::sync::Arc;

/// Vertices and triangles of a box.
fn box_mesh(centre: Vec3, axes: Mat3, half: [f64; 3]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let sign = |k: usize, bit: usize| if k & (1 << bit) == 0 { -1.0 } else { 1.0 };
    let corner = |k: usize| centre + axes * Vec3([0, 1, 2].map(|bit| sign(k, bit) * half[bit]));
    let vertices = (0..8).map(corner).collect();
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    (vertices, sides.into_iter().flat_map(halves).collect())
}

/// An icosahedron whose faces are divided, with its vertices on a sphere about the origin.
fn sphere_mesh(radius: f64, divisions: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut vertices: Vec<Vec3> = Vec::new();
    for [a, b] in [[-1.0, -g], [1.0, -g], [-1.0, g], [1.0, g]] {
        vertices.extend([Vec3([a, b, 0.0]), Vec3([0.0, a, b]), Vec3([b, 0.0, a])]);
    }
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for i in 0..12u32 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [i, j, k].map(|v| vertices[v as usize]);
                let is_side = |a: Vec3, b: Vec3| (a - b).norm() < 2.1;
                if is_side(a, b) && is_side(b, c) && is_side(c, a) {
                    triangles.push(if a.dot(b.cross(c)) > 0.0 { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    for _ in 0..divisions {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                vertices.push((vertices[a as usize] + vertices[b as usize]) * 0.5);
                vertices.len() as u32 - 1
            })
        };
        let mut fine = Vec::new();
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            fine.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = fine;
    }
    (vertices.into_iter().map(|v| v * (radius / v.norm())).collect(), triangles)
}

fn surface((vertices, triangles): (Vec<Vec3>, Vec<[u32; 3]>), side: Side) -> Surface {
    Surface { shape: Shape::Mesh(Arc::new(TriangleMesh::new(vertices, &triangles).unwrap())), side }
}

fn cuboid(random: &mut Random) -> (Vec3, Mat3, [f64; 3]) {
    (random.vector(0.2), random.rotation(3.0).r, [0.4, 0.6, 0.9])
}

#[test]
fn a_meshed_box_has_the_distance_of_the_box() {
    let mut random = Random(31);
    let (centre, axes, half) = cuboid(&mut random);
    for side in [Side::Outside, Side::Inside] {
        let exact = Surface { shape: Shape::Box { centre, axes, half }, side };
        let mesh = surface(box_mesh(centre, axes, half), side);
        for _ in 0..3000 {
            let y = random.vector(1.6);
            let [a, b] = [&exact, &mesh].map(|surface| surface.distance(y).unwrap());
            let size = 1.0 + a.curvature.max_abs();
            assert!((a.value - b.value).abs() < 1e-14, "{y:?} {a:?} {b:?}");
            assert!((a.normal - b.normal).max_abs() < 1e-13 * size, "{y:?} {a:?} {b:?}");
            assert!((a.curvature - b.curvature).max_abs() < 1e-12 * size * size, "{y:?} {a:?} {b:?}");
        }
    }
}

#[test]
fn normals_and_curvatures_are_derivatives() {
    let mut random = Random(32);
    let (vertices, triangles) = sphere_mesh(1.0, 1);
    // Dents make edges and corners that are notches.
    let dented = vertices.into_iter().enumerate().map(|(k, v)| v * if k % 3 == 0 { 0.6 } else { 1.0 }).collect();
    let mesh = surface((dented, triangles), Side::Outside);
    let mut features = [0; 3];
    for _ in 0..3000 {
        let y = random.vector(1.5);
        let exact = mesh.distance(variables::<3>(y, 0)).unwrap();
        let here = mesh.distance(y).unwrap();
        let size = 1.0 + here.curvature.max_abs();
        features[here.feature as usize] += 1;
        assert!((Vec3(exact.value.partials) - here.normal).max_abs() < 1e-12 * size, "{y:?} {here:?}");
        assert!((jacobian(exact.normal, 0) - here.curvature).max_abs() < 1e-12 * size * size, "{y:?} {here:?}");
        assert!((here.normal.norm() - 1.0).abs() < 1e-14 && (here.curvature * here.normal).max_abs() < 1e-12 * size);
    }
    assert!(features.iter().all(|&count| count > 100), "{features:?}");
}

/// The distance leads to the surface, and no point of it is nearer; its sign tells inside from outside.
#[test]
fn no_triangle_is_nearer() {
    let mut random = Random(33);
    let (vertices, triangles) = sphere_mesh(1.0, 2);
    let dented: Vec<Vec3> =
        vertices.into_iter().enumerate().map(|(k, v)| v * if k % 7 == 0 { 0.7 } else { 1.0 }).collect();
    let mesh = surface((dented.clone(), triangles.clone()), Side::Outside);
    for _ in 0..500 {
        let y = random.vector(1.5);
        let here = mesh.distance(y).unwrap();
        let foot = y - here.normal * here.value;
        assert!(mesh.distance(foot).unwrap().value.abs() < 1e-12, "{y:?}");
        let mut solid_angle = 0.0;
        for corners in &triangles {
            let [a, b, c] = corners.map(|corner| dented[corner as usize] - y);
            let weights = ShapeAt::<3>::new(random.between(0.0, 1.0)).values.map(|w| w.abs());
            let sum: f64 = weights.iter().sum();
            let point = (a * weights[0] + b * weights[1] + c * weights[2]) * (1.0 / sum);
            assert!(point.norm() > here.value.abs() - 1e-12);
            let [la, lb, lc] = [a, b, c].map(|v| v.norm());
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            solid_angle += 2.0 * libm::atan2(a.dot(b.cross(c)), below);
        }
        let is_inside = solid_angle > 2.0 * std::f64::consts::PI;
        assert_eq!(is_inside, here.value < 0.0, "{y:?} {solid_angle}");
    }
}

#[test]
fn fine_meshes_of_a_sphere_are_within_their_error() {
    let mut random = Random(34);
    let ball = Surface { shape: Shape::Sphere { centre: Vec3::ZERO, radius: 1.0 }, side: Side::Outside };
    let mut before: Option<f64> = None;
    for divisions in [1, 2, 3, 4] {
        let mesh = surface(sphere_mesh(1.0, divisions), Side::Outside);
        let mut worst = 0.0f64;
        for _ in 0..1000 {
            let y = random.direction() * random.between(1.01, 2.0);
            worst = worst.max((mesh.distance(y).unwrap().value - ball.distance(y).unwrap().value).abs());
        }
        println!("{divisions} divisions: {worst:e}");
        if let Some(before) = before {
            assert!((3.0..5.0).contains(&(before / worst)), "second order: {before} {worst}");
        }
        before = Some(worst);
        let Shape::Mesh(mesh) = &mesh.shape else { unreachable!() };
        assert!((mesh.depth() - 1.0).abs() < 0.1, "{}", mesh.depth());
    }
}

/// Points above a diagonal of a flat side, or on an edge or a corner itself, have a normal.
#[test]
fn borders_of_faces_have_normals() {
    let mesh = surface(box_mesh(Vec3::ZERO, Mat3::IDENTITY, [1.0; 3]), Side::Outside);
    for y in [Vec3([0.0, 0.0, 1.3]), Vec3([0.25, 0.25, 1.3]), Vec3([0.25, -0.25, 1.3]), Vec3([0.25, 0.25, 0.9])] {
        let here = mesh.distance(y).unwrap();
        assert_eq!((here.normal, here.curvature), (Vec3::UNIT[2], Mat3::zero()), "{y:?}");
        assert!((here.value - (y.0[2] - 1.0)).abs() < 1e-15);
    }
    for y in [Vec3([1.0; 3]), Vec3([1.0, 0.3, 1.0]), Vec3([1.0, 1.0, 1.0 + 1e-13])] {
        let here = mesh.distance(y).unwrap();
        assert!(here.value.abs() < 1e-12 && (here.normal.norm() - 1.0).abs() < 1e-15, "{y:?} {here:?}");
    }
}

#[test]
fn edges_of_a_meshed_box_are_those_of_the_box() {
    let mut random = Random(35);
    let (centre, axes, half) = cuboid(&mut random);
    let exact = Surface { shape: Shape::Box { centre, axes, half }, side: Side::Outside };
    let mesh = surface(box_mesh(centre, axes, half), Side::Outside);
    let line = [Vec3::ZERO, Vec3::ZERO];
    let numbers = mesh.edges_near(line, 10.0);
    assert_eq!(numbers.len(), 12);
    let mut pairs = 0;
    for box_edge in exact.edges_near(line, 10.0).into_iter().filter_map(|number| exact.edge(number)) {
        for mesh_edge in numbers.iter().filter_map(|&number| mesh.edge(number)) {
            let points: Vec<Vec3> = (0..20).map(|_| random.vector(2.0)).collect();
            let differs = |y: &Vec3| {
                let [a, b] = [&box_edge, &mesh_edge].map(|edge| edge.distance(*y).unwrap().value);
                (a - b).abs() > 1e-13
            };
            pairs += usize::from(!points.iter().any(differs));
        }
    }
    assert_eq!(pairs, 12);
    // No edge of a box protrudes inwards.
    let inside = Surface { side: Side::Inside, ..mesh.clone() };
    assert!(inside.edges_near(line, 10.0).is_empty());
    // Only those near a line are looked at.
    let far = centre + axes * Vec3([2.0, 0.0, 0.0]);
    assert!(mesh.edges_near([far, far], 0.5).is_empty());
    let corner = centre + axes * Vec3(half);
    assert_eq!(mesh.edges_near([corner, corner], 0.01).len(), 3);
}

#[test]
fn what_bounds_no_body_is_refused() {
    let (vertices, triangles) = box_mesh(Vec3::ZERO, Mat3::IDENTITY, [1.0; 3]);
    let refused = |vertices: &[Vec3], triangles: &[[u32; 3]]| {
        TriangleMesh::new(vertices.to_vec(), triangles).map(|_| ()).unwrap_err()
    };
    assert_eq!(refused(&vertices, &triangles[..3]), MeshError::Few);
    assert!(matches!(refused(&vertices, &triangles[1..]), MeshError::Open(_)));
    let mut turned = triangles.clone();
    turned[5].swap(0, 1);
    assert!(matches!(refused(&vertices, &turned), MeshError::Turned(..)));
    let inside_out: Vec<[u32; 3]> = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    assert_eq!(refused(&vertices, &inside_out), MeshError::InsideOut);
    let mut repeated = triangles.clone();
    repeated[7] = [3, 3, 1];
    assert_eq!(refused(&vertices, &repeated), MeshError::Degenerate(7, vertices[3]));
    repeated[7] = [3, 8, 1];
    assert_eq!(refused(&vertices, &repeated), MeshError::NoVertex(7));
    let mut broken = vertices.clone();
    broken[2].0[1] = f64::NAN;
    assert_eq!(refused(&broken, &triangles), MeshError::NotFinite(2));
    // A side divided about a point in it, and about a point beyond its border.
    let mut divided = vertices.clone();
    divided.push(Vec3([-1.0, 0.9, 0.0]));
    let mut folded: Vec<[u32; 3]> = triangles[2..].to_vec();
    folded.extend([[8, 0, 4], [8, 4, 6], [8, 6, 2], [8, 2, 0]]);
    assert!(TriangleMesh::new(divided.clone(), &folded).is_ok());
    divided[8] = Vec3([-1.0, 1.1, 0.0]);
    assert!(matches!(refused(&divided, &folded), MeshError::Folded(_)));
    let mut fin = triangles.clone();
    fin.push([0, 4, 7]);
    assert!(matches!(refused(&vertices, &fin), MeshError::Branched(_) | MeshError::Turned(..)));
}

/// Of the edges that meet at a corner one touches what is nearest to the corner.
#[test]
fn a_corner_belongs_to_one_edge() {
    let mut random = Random(37);
    let (centre, axes, half) = cuboid(&mut random);
    let exact = Surface { shape: Shape::Box { centre, axes, half }, side: Side::Outside };
    let mesh = surface(box_mesh(centre, axes, half), Side::Outside);
    let mut corners = 0;
    for _ in 0..2000 {
        let y = random.vector(1.6);
        for surface in [&exact, &mesh] {
            let nearest = surface.distance(y).unwrap();
            let owns = |number: &u32| {
                let distance = surface.edge(*number).unwrap().distance(y).unwrap().value;
                (distance - nearest.value).abs() < 1e-13 && surface.owns_corner(*number, y)
            };
            let count = surface.edges_near([y, y], 10.0).iter().filter(|number| owns(number)).count();
            let expected = usize::from(nearest.feature != Feature::Face);
            assert_eq!(count, expected, "{y:?} {nearest:?}");
            corners += usize::from(nearest.feature == Feature::Corner);
        }
    }
    assert!(corners > 100, "{corners}");
}

/// The time of a distance, told.
#[test]
#[ignore = "a measurement"]
fn time_of_a_distance() {
    let mut random = Random(36);
    for divisions in [0, 2, 4, 6] {
        let mesh = surface(sphere_mesh(1.0, divisions), Side::Outside);
        let points: Vec<Vec3> = (0..20_000).map(|_| random.direction() * 1.05).collect();
        let begun = std::time::Instant::now();
        let sum: f64 = points.iter().map(|y| mesh.distance(*y).unwrap().value).sum();
        println!("{} triangles: {:?} a point ({sum})", 20 << (2 * divisions), begun.elapsed() / 20_000);
    }
}
