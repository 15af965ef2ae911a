//! Random outlines and walls: a mesh or an error, never a panic.

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
