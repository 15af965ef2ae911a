//! Random outlines and walls: a mesh or an error, never a panic.

use beamsim_core::section::airfoil::{Airfoil, SkinPart, Web};
use beamsim_core::section::geometry::{Geometry, Shape};
use beamsim_core::section::mesh::Region;
use beamsim_core::section::outline::Outline;
use beamsim_core::section::triangulate::PlanarRegion;
use beamsim_core::section::walls::{Ply, Walls};
use std::collections::BTreeMap;

/// Numbers from 0 to 1 (Knuth's linear congruential generator).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }

    /// Often on a coarse grid, so that points and edges coincide.
    fn point(&mut self) -> [f64; 2] {
        let grid = self.below(3) > 0;
        [0, 1].map(|_| if grid { self.below(5) as f64 } else { 4.0 * self.next() })
    }
}

fn count(outcomes: &mut BTreeMap<String, usize>, geometry: &Geometry) {
    let outcome = match geometry.mesh(0) {
        Ok(_) => "meshed".to_string(),
        Err(error) => format!("{error:?}").split([' ', '{']).next().unwrap_or_default().to_string(),
    };
    *outcomes.entry(outcome).or_default() += 1;
}

#[test]
fn random_outlines() {
    let mut random = Random(1);
    let mut outcomes = BTreeMap::new();
    for _ in 0..1500 {
        let regions = 1 + random.below(3);
        let mut planar = Vec::new();
        for k in 0..regions {
            let mut outline = || {
                let corners = 3 + random.below(4);
                let radius = if random.below(4) == 0 { 0.3 * random.next() } else { 0.0 };
                let points: Vec<_> = (0..corners).map(|_| (random.point(), radius)).collect();
                if radius > 0.25 { Ok(Outline::circle(points[0].0, radius)) } else { Outline::rounded(&points, "x") }
            };
            let (Ok(first), second) = (outline(), outline()) else { continue };
            let holes = second.into_iter().filter(|_| k == 0).collect();
            planar.push(PlanarRegion { region: Region::new("x", 0), outline: first, holes });
        }
        count(&mut outcomes, &Geometry::new(Shape::Regions(planar)));
    }
    println!("{outcomes:?}");
    assert!(outcomes["meshed"] > 10);
}

#[test]
fn random_walls() {
    let mut random = Random(2);
    let mut outcomes = BTreeMap::new();
    for _ in 0..3000 {
        let mut walls = Walls::default();
        let points: Vec<_> = (0..3 + random.below(4)).map(|_| random.point()).collect();
        for _ in 0..1 + random.below(6) {
            let [from, to] = [0, 1].map(|_| points[random.below(points.len())]);
            let thickness = [0.05, 0.1, 0.2][random.below(3)];
            let ply = Ply { name: "x".to_string(), material: 0, thickness, theta: 0.0 };
            let plies = vec![ply; 1 + random.below(3)];
            walls.add(from, to, None, thickness * random.next(), &plies);
        }
        count(&mut outcomes, &Geometry::new(Shape::Walls(walls)));
    }
    println!("{outcomes:?}");
    assert!(outcomes["meshed"] > 100);
}

/// Profiles of four digits (NACA) with skins and webs of random thickness.
#[test]
fn random_airfoils() {
    let mut random = Random(3);
    let mut outcomes = BTreeMap::new();
    for _ in 0..300 {
        let camber = 0.06 * random.next();
        let thickness = 0.1 + 0.3 * random.next();
        let count = 10 + random.below(60);
        let point = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / count as f64;
            let x = 0.5 + 0.5 * angle.cos();
            let half = 5.0
                * thickness
                * (0.2969 * x.sqrt() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4));
            [x, 4.0 * camber * x * (1.0 - x) + if angle.sin() >= 0.0 { half } else { -half }]
        };
        let mut plies = |count: usize| {
            let ply = |thickness: f64| Ply { name: "x".to_string(), material: 0, thickness, theta: 0.0 };
            (0..count).map(|_| ply(0.0005 + 0.002 * random.next())).collect::<Vec<_>>()
        };
        let skin = vec![
            SkinPart { ends: [0.0, 1.0], sides: [true; 2], plies: plies(2) },
            SkinPart { ends: [0.2, 0.5], sides: [true; 2], plies: plies(4) },
        ];
        let webs = vec![Web { at: 0.2, plies: plies(2) }, Web { at: 0.45, plies: plies(3) }];
        let airfoil = Airfoil {
            profile: (0..=count).map(point).collect(),
            chord: 1.0,
            pitch_axis: 0.25,
            leads_to_plus: random.below(2) == 0,
            skin,
            webs,
            fixed_sense: false,
        };
        match airfoil.walls() {
            Ok(walls) => count_mesh(&mut outcomes, walls),
            Err(error) => *outcomes.entry(format!("{error}")).or_default() += 1,
        }
    }
    println!("{outcomes:?}");
    assert!(outcomes["meshed"] > 240);
}

fn count_mesh(outcomes: &mut BTreeMap<String, usize>, walls: Walls) {
    count(outcomes, &Geometry::new(Shape::Walls(walls)));
}
