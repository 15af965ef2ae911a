//! Sections with published or closed-form results that are not among the reference cases.

use super::largest;
use beamsim_core::section::analysis::{Analysis, DEFAULT_AIM, MeshAim, Reference, analyse};
use beamsim_core::section::geometry::{Geometry, Profile, Shape};
use beamsim_core::section::grid::Rect;
use beamsim_core::section::material::{Elastic, Material};
use beamsim_core::section::mesh::Region;
use beamsim_core::section::outline::Outline;
use beamsim_core::section::properties::{moved, relative_difference, turned};
use beamsim_core::section::saint_venant::solve;
use beamsim_core::section::stress::{Corners, von_mises};
use beamsim_core::section::triangulate::PlanarRegion;
use beamsim_core::section::walls::{Bend, Ply, Walls};
use beamsim_core::section::{Matrix6, SectionError, Vector6};
use std::f64::consts::PI;

fn unit_material() -> Vec<Material> {
    vec![Material::isotropic("unit", 1.0, 0.3, 1.0)]
}

fn profile(profile: Profile) -> Geometry {
    Geometry::new(Shape::Profile { profile, region: Region::new("section", 0) })
}

fn polygon(points: &[[f64; 2]]) -> Geometry {
    let outline = Outline::polygon(points, "section").unwrap();
    Geometry::new(Shape::Regions(vec![PlanarRegion { region: Region::new("section", 0), outline, holes: vec![] }]))
}

fn run(geometry: &Geometry, materials: &[Material], aim: f64) -> Analysis {
    let analysis = analyse(geometry, materials, MeshAim::Error(aim)).unwrap();
    assert!(analysis.meets_aim, "estimate {:e}", analysis.estimate);
    assert!(analysis.solution.resultant_check < 1e-6, "{:e}", analysis.solution.resultant_check);
    analysis
}

fn assert_near(value: f64, exact: f64, tolerance: f64, what: &str) {
    let error = value / exact - 1.0;
    println!("{what}: {value:.6e}, reference {exact:.6e}, error {error:.1e}");
    assert!(error.abs() < tolerance, "{what}: {value} and {exact}");
}

/// IPE 200 with each fillet as a number of chords.
fn ipe_200_of_chords(chords: usize) -> Geometry {
    let [d, b, t_f, t_w, r] = [200.0, 100.0, 8.5, 5.6, 12.0];
    let quarter: Vec<[f64; 2]> = [[0.5 * b, -0.5 * d], [0.5 * b, -0.5 * d + t_f]]
        .into_iter()
        .chain((0..=chords).map(|k| {
            let angle = 0.5 * PI * k as f64 / chords as f64;
            [0.5 * t_w + r * (1.0 - angle.sin()), -0.5 * d + t_f + r * (1.0 - angle.cos())]
        }))
        .collect();
    let turn = |signs: [f64; 2], backwards: bool| {
        let mut points: Vec<[f64; 2]> = quarter.iter().map(|p| [signs[0] * p[0], signs[1] * p[1]]).collect();
        if backwards {
            points.reverse();
        }
        points
    };
    let quarters =
        [turn([1.0, 1.0], false), turn([1.0, -1.0], true), turn([-1.0, -1.0], false), turn([-1.0, 1.0], true)];
    polygon(&quarters.concat())
}

/// sectionproperties 3.10 gives 68573 mm4, 1578.831 mm2 and 1096.547 mm2, with 16 points a fillet:
/// 15 chords. True arcs have 0.16 % less torsional stiffness.
#[test]
fn ipe_200_with_fillets() {
    let materials = unit_material();
    let check = |geometry: &Geometry, gj: f64, shear: [f64; 2], tolerance: f64| {
        let start = std::time::Instant::now();
        let analysis = run(geometry, &materials, tolerance);
        println!("{} nodes, {:.3} s", analysis.mesh.nodes.len(), start.elapsed().as_secs_f64());
        let properties = analysis.properties();
        assert_near(properties.gj * 2.6, gj, tolerance, "torsion constant");
        assert_near(properties.ga[0] * 2.6, shear[0], tolerance, "shear area of the flanges");
        assert_near(properties.ga[1] * 2.6, shear[1], tolerance, "shear area of the web");
        assert!(analysis.mesh.corners.is_empty());
    };
    check(&ipe_200_of_chords(15), 68573.0, [1578.831, 1096.547], 5e-5);
    let round = profile(Profile::I { d: 200.0, b: 100.0, t_f: 8.5, t_w: 5.6, r: 12.0, b_top: 100.0, t_f_top: 8.5 });
    check(&round, 68462.0, [1578.010, 1096.296], DEFAULT_AIM);
    check(&round, 68462.0, [1578.010, 1096.296], 5e-5);
}

fn ply(name: &str, thickness: f64, degrees: f64) -> Ply {
    Ply { name: name.to_string(), material: 0, thickness, theta: degrees.to_radians() }
}

/// Yu, Ho and Hodges 2012, numbers of VABS
/// through the tests of GXBeam: two plies, flat sides 0 and 90 degrees, round ends -45 and +45.
fn vabs_pipe() -> (Geometry, Vec<Material>) {
    let elastic = Elastic::Orthotropic { e: [20.59e6, 1.42e6, 1.42e6], g: [0.87e6; 3], nu: [0.42; 3] };
    let materials = vec![Material { name: "ply".to_string(), elastic, density: 1.0 }];
    let flat = vec![ply("flat 0", 0.1, 0.0), ply("flat 90", 0.1, 90.0)];
    let round = vec![ply("round -45", 0.1, -45.0), ply("round +45", 0.1, 45.0)];
    let bend = |centre| Some(Bend { centre, counterclockwise: false });
    let mut walls = Walls::default();
    walls.add([-1.0, 0.5], [1.0, 0.5], None, 0.0, &flat);
    walls.add([1.0, 0.5], [1.0, -0.5], bend([1.0, 0.0]), 0.0, &round);
    walls.add([1.0, -0.5], [-1.0, -0.5], None, 0.0, &flat);
    walls.add([-1.0, -0.5], [-1.0, 0.5], bend([-1.0, 0.0]), 0.0, &round);
    (Geometry::new(Shape::Walls(walls)), materials)
}

#[test]
fn composite_pipe_of_vabs() {
    let (geometry, materials) = vabs_pipe();
    let start = std::time::Instant::now();
    let analysis = run(&geometry, &materials, DEFAULT_AIM);
    println!("{} nodes, {:.3} s", analysis.mesh.nodes.len(), start.elapsed().as_secs_f64());
    let k = analysis.solution.stiffness;
    let published = [
        (0, 0, 1.03892e7, 3e-4),
        (1, 1, 7.85310e5, 3e-4),
        (2, 2, 3.29279e5, 2e-3),
        (0, 3, 9.84575e4, 2e-3),
        (1, 4, -8.21805e3, 2e-3),
        (2, 5, -5.20981e4, 4e-3),
        (3, 3, 6.87275e5, 1e-3),
        (4, 4, 1.88238e6, 3e-4),
        (5, 5, 5.38987e6, 3e-4),
    ];
    for (i, j, value, tolerance) in published {
        assert_near(k[(i, j)], value, tolerance, &format!("K{}{}", i + 1, j + 1));
    }
    let stresses = analysis.stresses(&materials).unwrap();
    let load = Vector6::new(0.0, 0.0, 0.0, 0.0, -1000.0, 0.0);
    let digest =
        [(0.325, -0.2432, 0.0690), (0.375, -0.2772, 0.1963), (0.425, -4.693, -0.1046), (0.475, -5.243, -0.1107)];
    for (x3, s11, s22) in digest {
        let probes = stresses.nodal.probe(&stresses.mesh, [0.0, x3]);
        let stress = probes[0].stress(&load) * 1e-3;
        println!("x3 {x3}: s11 {:.4} ({s11}), s22 {:.4} ({s22})", stress[0], stress[1]);
        assert!((stress[0] - s11).abs() < 1e-3 && (stress[1] - s22).abs() < 3e-4);
    }
}

/// BECAS user guide, case C2: half of a tube, opening towards +2. Its mesh of bilinear elements is
/// good to about 0.3 %.
#[test]
fn half_cylinder_of_becas() {
    let materials = vec![Material::isotropic("m", 100.0, 0.2, 1.0)];
    let mut walls = Walls::default();
    let bend = Bend { centre: [0.0, 0.0], counterclockwise: true };
    walls.add([0.0, 0.1], [0.0, -0.1], Some(bend), 0.01, &[ply("wall", 0.01, 0.0)]);
    let analysis = run(&Geometry::new(Shape::Walls(walls)), &materials, 1e-4);
    let k = analysis.solution.stiffness;
    let printed = [
        (1, 1, 4.964e-2, 3e-3),
        (2, 2, 6.244e-2, 3e-3),
        (0, 0, 2.982e-1, 1e-3),
        (4, 4, 1.349e-3, 2e-3),
        (5, 5, 1.349e-3, 2e-3),
        (3, 3, 9.120e-4, 3e-3),
        (0, 5, 1.805e-2, 2e-3),
        (2, 3, -7.529e-3, 3e-3),
    ];
    for (i, j, value, tolerance) in printed {
        assert_near(k[(i, j)], value, tolerance, &format!("K{}{}", i + 1, j + 1));
    }
    assert_near(analysis.properties().shear_centre[0], -1.206e-1, 1e-3, "shear centre");
    assert_near(analysis.properties().tension_centre[0], -6.051e-2, 1e-3, "tension centre");
}

#[test]
fn triangles_and_quadrilaterals_agree() {
    let materials = vec![Material::isotropic("stiff", 100.0, 0.2, 1.0), Material::isotropic("soft", 10.0, 0.2, 1.0)];
    let halves = [([-0.05, 0.0], 0), ([0.0, 0.05], 1)];
    let regions: Vec<Region> = halves.iter().map(|&(_, material)| Region::new("half", material)).collect();
    let rects = halves.map(|(x2, region)| Rect { x2, x3: [-0.05, 0.05], region }).to_vec();
    let quadrilaterals = Geometry::new(Shape::Rects { rects, regions: regions.clone() });
    let planar = halves.map(|([a, b], material)| PlanarRegion {
        region: Region::new("half", material),
        outline: Outline::polygon(&[[a, -0.05], [b, -0.05], [b, 0.05], [a, 0.05]], "half").unwrap(),
        holes: vec![],
    });
    let triangles = Geometry::new(Shape::Regions(planar.to_vec()));
    let first = run(&quadrilaterals, &materials, 1e-5);
    let second = run(&triangles, &materials, 1e-5);
    println!("{} and {} nodes", first.mesh.nodes.len(), second.mesh.nodes.len());
    assert!(relative_difference(&second.solution.stiffness, &first.solution.stiffness) < 5e-6);
    assert!(relative_difference(&second.solution.mass, &first.solution.mass) < 1e-12);

    let points = [[0.0, 0.0], [60.0, 0.0], [60.0, 8.0], [8.0, 8.0], [8.0, 100.0], [0.0, 100.0]];
    let mut outline = polygon(&points);
    outline.shift = [-30.0, -50.0];
    let angle = profile(Profile::Angle { d: 100.0, b: 60.0, t: 8.0, r_r: 0.0, r_t: 0.0 });
    let first = run(&angle, &unit_material(), 1e-5);
    let second = run(&outline, &unit_material(), 1e-5);
    println!("{} and {} nodes", first.mesh.nodes.len(), second.mesh.nodes.len());
    let difference = relative_difference(&second.solution.stiffness, &first.solution.stiffness);
    assert!(difference < 2e-5, "{difference:e}");
    assert_eq!(second.mesh.corners.len(), 1);
    assert_eq!(first.mesh.corners[0].wall, 8.0);
    assert!((second.mesh.corners[0].wall - 8.0).abs() < 1e-9);
}

#[test]
fn moving_and_turning_a_section_are_those_of_its_matrices() {
    let (mut geometry, materials) = vabs_pipe();
    let before = solve(&geometry.mesh(0).unwrap(), &materials).unwrap();
    geometry.turn = 0.7;
    geometry.shift = [0.3, -0.4];
    let after = solve(&geometry.mesh(0).unwrap(), &materials).unwrap();
    for (old, new) in [(before.stiffness, after.stiffness), (before.mass, after.mass)] {
        // Axes turn backwards and the reference point moves opposite to the section.
        let expected = moved(&turned(&old, -0.7), [-0.3, 0.4]);
        assert!(relative_difference(&new, &expected) < 1e-10);
    }
}

#[test]
fn thick_tube_has_the_shear_of_the_theory() {
    let ratio = 0.5_f64;
    let nu = 0.3_f64;
    let tube = Shape::Ellipse { semi_axes: [1.0; 2], thickness: Some(1.0 - ratio), region: Region::new("tube", 0) };
    let analysis = run(&Geometry::new(tube), &unit_material(), 1e-6);
    let m2 = ratio * ratio;
    let square = (1.0 + m2).powi(2);
    let factor = 6.0 * (1.0 + nu).powi(2) * square
        / ((7.0 + 14.0 * nu + 8.0 * nu * nu) * square + 4.0 * (5.0 + 10.0 * nu + 4.0 * nu * nu) * m2);
    let area = PI * (1.0 - m2);
    for ga in analysis.properties().ga {
        assert_near(ga, factor * area / 2.6, 1e-6, "GA");
    }
}

#[test]
fn stresses_converge_to_exact_ones() {
    // Circle of radius 1 under a shear force: centre (3+2nu)/(8(1+nu)) P/I, sides (1+2nu)/(4(1+nu))
    // P/I.
    let circle = Shape::Ellipse { semi_axes: [1.0; 2], thickness: None, region: Region::new("circle", 0) };
    let analysis = run(&Geometry::new(circle), &unit_material(), 1e-5);
    let stresses = analysis.stresses(&unit_material()).unwrap();
    let load = Vector6::ith(2, 1.0);
    let inertia = PI / 4.0;
    let at = |at: [f64; 2]| stresses.nodal.probe(&stresses.mesh, at)[0].stress(&load);
    assert_near(at([0.0, 0.0])[4], 3.6 / 10.4 / inertia, 2e-3, "centre");
    assert_near(at([1.0, 0.0])[4], 1.6 / 5.2 / inertia, 1e-3, "side");
    let peak = largest(stresses, &load, Corners::Exclude, von_mises);
    assert!(peak.at[0].hypot(peak.at[1]) < 0.05, "{peak:?}");
}

#[test]
fn largest_stress_away_from_corners_does_not_depend_on_the_mesh() {
    let geometry = profile(Profile::I { d: 200.0, b: 100.0, t_f: 9.0, t_w: 6.0, r: 0.0, b_top: 100.0, t_f_top: 9.0 });
    let materials = unit_material();
    let load = Vector6::ith(3, 1.0);
    let peak = |aim: f64, corners: Corners| {
        let analysis = run(&geometry, &materials, aim);
        let stresses = analysis.stresses(&materials).unwrap();
        largest(stresses, &load, corners, von_mises).value
    };
    let outside = [1e-3, 1e-5].map(|aim| peak(aim, Corners::Exclude));
    let inside = [1e-3, 1e-5].map(|aim| peak(aim, Corners::Include));
    println!("without corners {outside:?}, with corners {inside:?}");
    assert!((outside[0] / outside[1] - 1.0).abs() < 0.02);
    assert!(inside[1] > 1.5 * inside[0] && inside[0] > outside[0]);
}

#[test]
fn a_rectangle_warns_of_free_edges_by_its_shear_stiffness() {
    let geometry = profile(Profile::Rectangle { d: 10.0, b: 1.0 });
    let ga = run(&geometry, &unit_material(), DEFAULT_AIM).properties().ga;
    assert_near(ga[0] * 2.6 / 10.0, 0.17913, 1e-3, "shear coefficient along the thin side");
}

/// Smooth sections converge with the fourth power of the size of elements; grading keeps nearly
/// that at re-entrant corners, where uniform meshes have the power 4/3.
#[test]
fn errors_fall_as_promised() {
    let materials = unit_material();
    let stiffness =
        |geometry: &Geometry, level: usize| solve(&geometry.mesh(level).unwrap(), &materials).unwrap().stiffness;
    let region = Region::new("section", 0);
    let circle = Geometry::new(Shape::Ellipse { semi_axes: [1.0; 2], thickness: None, region });
    // 4 and 9 cells in a quarter.
    let error = |level: usize| stiffness(&circle, level)[(3, 3)] / (0.5 * PI / 2.6) - 1.0;
    let order = (error(0) / error(2)).abs().ln() / (9.0_f64 / 4.0).ln();
    println!("circle: order {order:.2}");
    assert!(order > 3.8);
    let tee = profile(Profile::T { d: 100.0, b: 80.0, t_f: 10.0, t_w: 8.0, r: 0.0 });
    let levels: Vec<Matrix6> = (0..4).map(|level| stiffness(&tee, level)).collect();
    let change = |level: usize| relative_difference(&levels[level], &levels[level + 1]);
    let order = (change(0) / change(2)).ln() / (2.0 * 1.5_f64.ln());
    println!("T: order {order:.2}");
    assert!(order > 2.9);
}

#[test]
fn meshing_gives_the_same_bytes_again() {
    let mut corners: Vec<([f64; 2], f64)> =
        [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]].map(|at| (at, 0.0)).to_vec();
    corners[3].1 = 0.4;
    let outline = Outline::rounded(&corners, "angle").unwrap();
    let planar =
        PlanarRegion { region: Region::new("angle", 0), outline, holes: vec![Outline::circle([0.5, 0.5], 0.2)] };
    let geometry = Geometry::new(Shape::Regions(vec![planar]));
    let [first, second] = [0, 1].map(|_| geometry.mesh(1).unwrap());
    assert_eq!(first.nodes, second.nodes);
    assert!(first.elements.iter().zip(&second.elements).all(|(a, b)| a.nodes == b.nodes));
    let materials = unit_material();
    assert_eq!(solve(&first, &materials).unwrap().stiffness, solve(&second, &materials).unwrap().stiffness);
}

#[test]
fn sharp_and_thin_outlines_are_meshed() {
    // A wedge of 3 degrees, a plate with a small hole, a profile of many short sides.
    let wedge = polygon(&[[0.0, -0.5], [20.0, 0.0], [0.0, 0.5]]);
    let plate = PlanarRegion {
        region: Region::new("plate", 0),
        outline: Outline::polygon(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]], "plate").unwrap(),
        holes: vec![Outline::circle([0.3, 0.2], 0.05)],
    };
    let upper = |k: usize| (k as f64 * PI / 60.0).cos();
    let thickness =
        |x: f64| 0.6 * (0.2969 * x.sqrt() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1015 * x.powi(4));
    let mut foil: Vec<[f64; 2]> = (0..=60).map(|k| 0.5 * (1.0 + upper(k))).map(|x| [x, thickness(x)]).collect();
    foil.extend((1..=60).map(|k| 0.5 * (1.0 - upper(k))).map(|x| [x, -thickness(x)]));
    let foil = polygon(&foil);
    // A hole that leaves two hundredths of its radius to the edge.
    let near_edge = PlanarRegion {
        region: Region::new("plate", 0),
        outline: Outline::polygon(&[[-1.0, -0.51], [1.0, -0.51], [1.0, 0.51], [-1.0, 0.51]], "plate").unwrap(),
        holes: vec![Outline::circle([0.0, 0.0], 0.5)],
    };
    let [plate, near_edge] = [plate, near_edge].map(|planar| Geometry::new(Shape::Regions(vec![planar])));
    for geometry in [wedge, plate, near_edge, foil] {
        let start = std::time::Instant::now();
        let analysis = run(&geometry, &unit_material(), DEFAULT_AIM);
        let seconds = start.elapsed().as_secs_f64();
        println!("{} nodes, estimate {:.1e}, {seconds:.3} s", analysis.mesh.nodes.len(), analysis.estimate);
    }
}

#[test]
fn a_mesh_may_be_given_by_size() {
    let rectangle = profile(Profile::Rectangle { d: 2.0, b: 1.0 });
    let analysis = analyse(&rectangle, &unit_material(), MeshAim::Size(0.1)).unwrap();
    assert!(analysis.mesh.longest_side() <= 0.1 && analysis.meets_aim);
    assert!(analysis.mesh.nodes.len() < 6000 && analysis.estimate < 1e-4);
    let analysis = analyse(&rectangle, &unit_material(), MeshAim::Error(1e-14)).unwrap();
    assert!(!analysis.meets_aim && analysis.warnings().len() == 1);
}

/// A ply that is a million times as soft in one shear needs very fine meshes.
#[test]
fn the_largest_meshes_are_only_made_where_an_aim_is_given() {
    let elastic = Elastic::Orthotropic { e: [20.59e6, 1.42e6, 1.42e6], g: [0.87e6, 0.87e6, 1.0], nu: [0.3, 0.3, 0.34] };
    let materials = vec![Material { name: "ply".to_string(), elastic, density: 1.0 }];
    let plies: Vec<Ply> = [15.0, -15.0].map(|degrees| ply("ply", 0.015, degrees)).into();
    let corners = [[-0.48, 0.27], [0.48, 0.27], [0.48, -0.27], [-0.48, -0.27]];
    let mut walls = Walls::default();
    for k in 0..4 {
        walls.add(corners[k], corners[(k + 1) % 4], None, 0.0, &plies);
    }
    let geometry = Geometry::new(Shape::Walls(walls));
    let usual = analyse(&geometry, &materials, MeshAim::Usual).unwrap();
    let asked = analyse(&geometry, &materials, MeshAim::Error(DEFAULT_AIM)).unwrap();
    println!(
        "{} nodes {:.1e}, {} nodes {:.1e}",
        usual.mesh.nodes.len(),
        usual.estimate,
        asked.mesh.nodes.len(),
        asked.estimate
    );
    assert!(!usual.meets_aim && usual.mesh.nodes.len() <= 20_000 && usual.estimate < 2e-2);
    assert!(asked.mesh.nodes.len() > 20_000 && asked.estimate < usual.estimate);
}

#[test]
fn impossible_sections_are_explained() {
    let thin = profile(Profile::Box { d: 1.0, b: 1.0, t_f: 1e-4, t_w: 1e-4, r_out: 0.0 });
    assert!(matches!(thin.mesh(0), Err(SectionError::TooThin { .. })));
    let thick = profile(Profile::Channel { d: 1.0, b: 1.0, t_f: 0.6, t_w: 0.1, r: 0.0 });
    assert!(thick.mesh(0).unwrap_err().to_string().contains("d - 2 t_f"));
    let fillet = profile(Profile::I { d: 1.0, b: 0.5, t_f: 0.1, t_w: 0.1, r: 0.3, b_top: 0.5, t_f_top: 0.1 });
    assert!(matches!(fillet.mesh(0), Err(SectionError::Outline { .. })));
    let rects =
        vec![Rect { x2: [0.0, 1.0], x3: [0.0, 1.0], region: 0 }, Rect { x2: [1.0, 2.0], x3: [1.0, 2.0], region: 1 }];
    let regions = vec![Region::new("left", 0), Region::new("right", 0)];
    let found = Geometry::new(Shape::Rects { rects, regions }).mesh(0).unwrap_err();
    assert!(matches!(found, SectionError::NotConnected { .. }), "{found}");
}

/// The stiffness does not depend on which rigid motions are held: a section and its mirror image
/// hold different nodes.
#[test]
fn mirror_images_have_mirrored_stiffness() {
    let points = [[0.0, 0.0], [1.0, 0.1], [0.3, 0.4], [0.2, 1.3]];
    let mirrored: Vec<[f64; 2]> = points.iter().rev().map(|[a, b]| [-a, *b]).collect();
    let [first, second] = [&points[..], &mirrored[..]].map(|points| run(&polygon(points), &unit_material(), 1e-6));
    let signs = Vector6::new(1.0, -1.0, 1.0, -1.0, 1.0, -1.0);
    let k = first.solution.stiffness;
    let expected = Matrix6::from_fn(|i, j| signs[i] * signs[j] * k[(i, j)]);
    let difference = relative_difference(&second.solution.stiffness, &expected);
    assert!(difference < 3e-6, "{difference:e}");
}

/// A box with two cells, of walls with a branch, and of rectangles.
#[test]
fn branched_walls_are_those_of_rectangles() {
    let half = |b: f64, d: f64| [[-b, d], [b, d], [b, -d], [-b, -d], [-b, d]];
    let [width, depth, t, web] = [100.0, 50.0, 5.0, 4.0];
    let plies = [ply("inner", 0.4 * t, 0.0), ply("outer", 0.6 * t, 0.0)];
    let mut points = half(0.5 * width, 0.5 * depth).to_vec();
    points.insert(1, [10.0, 0.5 * depth]);
    points.insert(4, [10.0, -0.5 * depth]);
    let mut walls = Walls::line(&points, 0.0, &plies);
    // The web is given from below and from above: the same section.
    for ends in [[[10.0, -25.0], [10.0, 25.0]], [[10.0, 25.0], [10.0, -25.0]]] {
        let mut walls = walls.clone();
        walls.add(ends[0], ends[1], None, 0.5 * web, &[ply("web", web, 0.0)]);
        compare(walls);
    }
    // A web with a ply that ends at a joint.
    walls.add([10.0, -25.0], [10.0, 0.0], None, 0.5 * web, &[ply("web", web, 0.0)]);
    walls.add([10.0, 25.0], [10.0, 0.0], None, 0.5 * web, &[ply("web", 0.5 * web, 0.0), ply("web", 0.5 * web, 0.0)]);
    compare(walls);

    fn compare(walls: Walls) {
        let rects = [
            ([-50.0, 50.0], [20.0, 25.0]),
            ([-50.0, 50.0], [-25.0, -20.0]),
            ([-50.0, -45.0], [-20.0, 20.0]),
            ([45.0, 50.0], [-20.0, 20.0]),
            ([8.0, 12.0], [-20.0, 20.0]),
        ];
        let rects = rects.map(|(x2, x3)| Rect { x2, x3, region: 0 }).to_vec();
        let rects = Geometry::new(Shape::Rects { rects, regions: vec![Region::new("box", 0)] });
        let first = run(&rects, &unit_material(), 1e-4);
        let second = run(&Geometry::new(Shape::Walls(walls)), &unit_material(), 1e-4);
        let difference = relative_difference(&second.solution.stiffness, &first.solution.stiffness);
        println!("{} and {} nodes, {difference:.1e}", first.mesh.nodes.len(), second.mesh.nodes.len());
        assert!(difference < 1e-4, "{difference:e}");
        let area = second.solution.area / first.solution.area - 1.0;
        assert!(area.abs() < 1e-12, "{area:e}");
        assert_eq!(first.mesh.corners.len(), 8);
        assert_eq!(second.mesh.corners.len(), 8);
        for corner in &first.mesh.corners {
            let near = |other: &&beamsim_core::section::mesh::ReentrantCorner| {
                (other.at[0] - corner.at[0]).hypot(other.at[1] - corner.at[1]) < 1e-9
            };
            assert!(second.mesh.corners.iter().any(|other| near(&other)), "{corner:?}");
        }
    }
}

/// Warping of an ellipse under torsion: u1 = -K1 (a^2 - b^2) / (a^2 + b^2) x2 x3, half axes a and b
/// along 2 and 3.
/// Two cells whose top is thinner on one side: its step is moved away from the middle web, which
/// adds about 1 part in 300 of the area.
#[test]
fn walls_of_different_thickness_meet_at_a_web() {
    let materials = unit_material();
    let [thick, thin] = [0.05, 0.04].map(|thickness| vec![ply("wall", thickness, 0.0)]);
    let mut outlines = Vec::new();
    for backwards in [false, true] {
        let mut walls = Walls::default();
        let middle = |walls: &mut Walls, ends: [[f64; 2]; 2], plies: &[Ply]| {
            walls.add(ends[0], ends[1], None, 0.5 * plies[0].thickness, plies);
        };
        middle(&mut walls, [[-1.0, 0.5], [0.0, 0.5]], &thick);
        let top = if backwards { [[1.0, 0.5], [0.0, 0.5]] } else { [[0.0, 0.5], [1.0, 0.5]] };
        middle(&mut walls, top, &thin);
        middle(&mut walls, [[1.0, 0.5], [1.0, -0.5]], &thick);
        middle(&mut walls, [[1.0, -0.5], [0.0, -0.5]], &thick);
        middle(&mut walls, [[0.0, -0.5], [-1.0, -0.5]], &thick);
        middle(&mut walls, [[-1.0, -0.5], [-1.0, 0.5]], &thick);
        middle(&mut walls, [[0.0, 0.5], [0.0, -0.5]], &thick);
        outlines.push(run(&Geometry::new(Shape::Walls(walls)), &materials, DEFAULT_AIM));
    }
    let difference = relative_difference(&outlines[0].solution.stiffness, &outlines[1].solution.stiffness);
    assert!(difference < 1e-9, "{difference:e}");
    let rect = |x2: [f64; 2], x3: [f64; 2]| Rect { x2, x3, region: 0 };
    let (inner, outer) = (0.475, 0.525);
    let rects = vec![
        rect([-1.025, 0.025], [inner, outer]),
        rect([0.025, 0.975], [0.48, 0.52]),
        rect([0.975, 1.025], [inner, outer]),
        rect([-1.025, 1.025], [-outer, -inner]),
        rect([-1.025, -0.975], [-inner, inner]),
        rect([-0.025, 0.025], [-inner, inner]),
        rect([0.975, 1.025], [-inner, inner]),
    ];
    let exact =
        run(&Geometry::new(Shape::Rects { rects, regions: vec![Region::new("box", 0)] }), &materials, DEFAULT_AIM);
    let difference = relative_difference(&outlines[0].solution.stiffness, &exact.solution.stiffness);
    println!("{difference:.1e}");
    assert!(difference < 5e-3);
}

#[test]
fn warping_of_an_ellipse_is_exact() {
    let ellipse = Shape::Ellipse { semi_axes: [2.0, 1.0], thickness: None, region: Region::new("ellipse", 0) };
    let analysis = run(&Geometry::new(ellipse), &unit_material(), 1e-5);
    let twist = analysis.solution.compliance[(3, 3)];
    let warping = analysis.solution.axial_warping(&analysis.mesh, 3);
    for (value, at) in warping.iter().zip(&analysis.mesh.nodes) {
        let exact = -twist * 0.6 * at[0] * at[1];
        assert!((value - exact).abs() < 1e-4 * twist, "{value} {exact} {at:?}");
    }
}

/// Branches at a bend, at an angle, crossing; steps of thickness. The area tells gaps and overlaps.
#[test]
fn joints_of_walls_have_their_area() {
    let plies = |t: f64| vec![ply("a", 0.3 * t, 0.0), ply("b", 0.7 * t, 0.0)];
    // Three walls at 120 degrees: two go through with a bend, the third meets the bend.
    let star = |angles: &[f64]| {
        let mut walls = Walls::default();
        for angle in angles {
            let (sin, cos) = angle.to_radians().sin_cos();
            walls.add([0.0, 0.0], [10.0 * cos, 10.0 * sin], None, 0.5, &plies(1.0));
        }
        walls
    };
    let cases = [
        ("star", star(&[90.0, 210.0, 330.0]), 30.0 - 3.0 * 0.5 * 0.5 * (PI / 6.0).tan()),
        ("cross", star(&[0.0, 90.0, 180.0, 270.0]), 40.0 - 1.0),
        ("oblique", star(&[0.0, 60.0, 180.0]), 30.0 - 0.5 * 1.0 / (PI / 3.0).sin()),
    ];
    for (name, walls, area) in cases {
        let analysis = run(&Geometry::new(Shape::Walls(walls)), &unit_material(), DEFAULT_AIM);
        let found = analysis.solution.area;
        println!(
            "{name}: {} nodes, area {found} ({area}), estimate {:.1e}",
            analysis.mesh.nodes.len(),
            analysis.estimate
        );
        // Plies near a bend may move to it.
        assert!((found / area - 1.0).abs() < 1e-3, "{name}: {found} and {area}");
    }
    // The cross is that of rectangles, turned by nothing: stiffness tells hanging nodes.
    let plus = [([-10.0, -0.5], [-0.5, 0.5]), ([-0.5, 0.5], [-10.0, 10.0]), ([0.5, 10.0], [-0.5, 0.5])];
    let rects = plus.map(|(x2, x3)| Rect { x2, x3, region: 0 }).to_vec();
    let plus = Geometry::new(Shape::Rects { rects, regions: vec![Region::new("plus", 0)] });
    let first = run(&plus, &unit_material(), 1e-4);
    let walls = Geometry::new(Shape::Walls(star(&[0.0, 90.0, 180.0, 270.0])));
    let second = run(&walls, &unit_material(), 1e-4);
    let difference = relative_difference(&second.solution.stiffness, &first.solution.stiffness);
    println!("{} and {} nodes, {difference:.1e}", first.mesh.nodes.len(), second.mesh.nodes.len());
    assert!(difference < 5e-5, "{difference:e}");
    let mut step = Walls::default();
    step.add([0.0, 0.0], [10.0, 0.0], None, 0.0, &plies(1.0));
    step.add([20.0, 0.0], [10.0, 0.0], None, 2.0, &plies(2.0));
    let analysis = run(&Geometry::new(Shape::Walls(step)), &unit_material(), DEFAULT_AIM);
    assert!((analysis.solution.area - 30.0).abs() < 1e-9);
}

/// A blade-like section: a skin of three plies around an ellipse of many short walls, two webs at
/// bends of it, thicker skin between them.
#[test]
fn skin_with_two_webs() {
    let thin = vec![ply("skin", 0.002, 45.0), ply("skin", 0.002, -45.0)];
    let thick = vec![ply("skin", 0.002, 45.0), ply("cap", 0.006, 0.0), ply("skin", 0.002, -45.0)];
    let web = vec![ply("web", 0.001, 45.0), ply("core", 0.008, 0.0), ply("web", 0.001, -45.0)];
    let count = 48;
    // Clockwise, from the right.
    let points: Vec<[f64; 2]> = (0..=count)
        .map(|k| -2.0 * PI * (k % count) as f64 / count as f64)
        .map(|angle| [0.5 * angle.cos(), 0.12 * angle.sin()])
        .collect();
    let mut walls = Walls::default();
    for (k, pair) in points.windows(2).enumerate() {
        let is_cap = (8..16).contains(&(k % 24));
        walls.add(pair[0], pair[1], None, 0.0, if is_cap { &thick } else { &thin });
    }
    for k in [10, 14] {
        walls.add(points[k], points[count - k], None, 0.005, &web);
    }
    let elastic = Elastic::Orthotropic { e: [37e9, 9e9, 9e9], g: [4e9; 3], nu: [0.28; 3] };
    let materials = vec![Material { name: "glass".to_string(), elastic, density: 1860.0 }];
    let start = std::time::Instant::now();
    let analysis = run(&Geometry::new(Shape::Walls(walls.clone())), &materials, DEFAULT_AIM);
    let seconds = start.elapsed().as_secs_f64();
    println!("{} nodes, estimate {:.1e}, {seconds:.3} s", analysis.mesh.nodes.len(), analysis.estimate);
    println!("{:.4e}", analysis.solution.stiffness);
    println!("{:?}", analysis.properties());
    assert!(analysis.mesh.corners.len() >= 8);
    // A wall that crosses others without a common point is refused.
    walls.add(points[5], points[count - 6], None, 0.005, &web);
    walls.add(points[6], points[count - 5], None, 0.005, &web);
    let found = Geometry::new(Shape::Walls(walls)).mesh(0).unwrap_err();
    assert!(matches!(found, SectionError::OverlappingRegions { .. }), "{found}");
}

#[test]
fn reference_points_move_loads_too() {
    let channel = profile(Profile::Channel { d: 100.0, b: 50.0, t_f: 5.0, t_w: 5.0, r: 0.0 });
    let analysis = run(&channel, &unit_material(), DEFAULT_AIM);
    let at = analysis.place(Reference::ShearCentre);
    // A shear force through the shear centre makes no twist.
    let compliance = analysis.compliance_about(at);
    assert!(compliance[(3, 2)].abs() < 1e-10 * (compliance[(3, 3)] * compliance[(2, 2)]).sqrt());
    let at = analysis.place(Reference::TensionCentre);
    let stresses = analysis.stresses(&unit_material()).unwrap();
    let load = analysis.load_of(&Vector6::ith(0, 1.0), at);
    // Tension through the tension centre is uniform.
    for (place, unit) in stresses.nodal.places.iter().zip(&stresses.nodal.unit) {
        let stress = unit * load;
        let error = (stress[0] * analysis.solution.area - 1.0).abs();
        assert!(error < 1e-9, "{:?} {error:e}", stresses.mesh.nodes[place.node as usize]);
    }
    assert!(analysis.warnings().is_empty());
}

/// Corrections from strains remove the round-off of bending along thin walls.
#[test]
fn walls_may_be_very_thin() {
    let thin = run(&profile(Profile::Rectangle { d: 2900.0, b: 1.0 }), &unit_material(), DEFAULT_AIM);
    assert_near(thin.solution.stiffness[(5, 5)], 2900.0 / 12.0, 1e-8, "EI");
    // A channel bends about its web like thin walls, the closed form of which is exact for EI.
    let channel = profile(Profile::Channel { d: 2501.0, b: 1250.5, t_f: 1.0, t_w: 1.0, r: 0.0 });
    let analysis = run(&channel, &unit_material(), DEFAULT_AIM);
    let [b, d] = [1250.5_f64, 2501.0_f64];
    let exact = b * d.powi(3) / 12.0 - (b - 1.0) * (d - 2.0).powi(3) / 12.0;
    assert_near(analysis.solution.stiffness[(4, 4)], exact, 1e-7, "EI");
    println!("estimate {:.1e}, check {:.1e}", analysis.estimate, analysis.solution.resultant_check);
    assert!(analysis.warnings().is_empty());
}
