//! Mass matrices that are the same in all directions, added entry by entry, against what adds any element.

use crate::random::Random;
use beamsim_core::kernel::ElementSystem;
use beamsim_core::system::{
    Category, Connectivity, Direction, DofMap, Layout, NodeBlocks, Pattern, Plane, Symmetry, System,
};
use beamsim_core::tensor::{Mat3, Vec3};

const NODES: usize = 6;

/// Directions that are held: global ones, slanted ones in the plane, two of a slot, all of one.
fn held(plane: Option<&Plane>) -> Vec<Direction> {
    let axes = plane.map_or(Mat3::IDENTITY, |plane| *plane.axes());
    let axis = |slot: u32, local: [f64; 3]| Direction { slot, axis: axes * Vec3(local) };
    let whole = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|local| axis(8, local));
    let some = [axis(0, [0.0, 1.0, 0.0]), axis(2, [0.6, 0.8, 0.0]), axis(4, [1.0, 0.0, 0.0]), axis(4, [0.0, 0.0, 1.0])];
    [&some[..], &whole].concat()
}

/// An empty system of elements of two nodes, which couple displacements alone.
fn system(plane: Option<&Plane>, symmetry: Symmetry) -> System {
    let turns = |slot: u32| slot % 2 == 1;
    let (dof_map, layout) = match plane {
        None => (DofMap::new(2 * NODES, &held(None)).unwrap(), Layout::Spatial),
        Some(plane) => (DofMap::planar(2 * NODES, &held(Some(plane)), *plane, turns).unwrap(), Layout::Planar),
    };
    let mut connectivity = Connectivity::default();
    (1..NODES as u32).for_each(|node| connectivity.push([2 * node - 2, 2 * node]));
    let node_blocks = NodeBlocks::new(2 * NODES, layout, turns);
    System::new(Pattern::new(dof_map, node_blocks, vec![connectivity], symmetry), 2 * NODES, &[], &[])
}

#[test]
fn masses_are_added_as_elements_are() {
    let mut random = Random::new(5);
    let tilted = Plane::normal_to(Vec3([0.3, -0.5, 0.8])).unwrap();
    let flat = Plane::normal_to(Vec3::UNIT[2]).unwrap();
    let both = |plane| [Symmetry::None, Symmetry::Whole].map(|symmetry| (plane, symmetry));
    for (plane, symmetry) in [None, Some(&flat), Some(&tilted)].into_iter().flat_map(both) {
        // Forces and increments that stay in the plane.
        let mut vector = || {
            let vector = random.vector(1.0);
            plane.map_or(vector, |plane| vector - plane.normal() * plane.normal().dot(vector))
        };
        let prescribed_increment: Vec<Vec3> = (0..2 * NODES).map(|_| vector()).collect();
        for prescribed_increment in [None, Some(&prescribed_increment[..])] {
            let (mut as_masses, mut as_elements) = (system(plane, symmetry), system(plane, symmetry));
            as_masses.clear(prescribed_increment);
            as_elements.clear(prescribed_increment);
            for k in 0..NODES - 1 {
                let (forces, weight) = ([vector(), vector()], 3.0);
                let mass = [[1.0 + k as f64, 0.4], [0.4, 2.0]];
                let mut element = ElementSystem::new(2);
                for i in 0..2 {
                    element.set_force(i, forces[i]);
                    (0..2).for_each(|j| element.set_tangent(i, j, &Mat3::IDENTITY.scale(mass[i][j] * weight)));
                }
                as_masses.assembler(0, Category::Internal, true).add_mass(k, &forces, &mass, weight);
                as_elements.assembler(0, Category::Internal, true).add(k, &element);
            }
            let what = format!(
                "plane {}, symmetry {symmetry:?}, prescribed_increment {}",
                plane.is_some(),
                prescribed_increment.is_some()
            );
            let sides = [&as_masses, &as_elements].map(|system| {
                let mut side = vec![0.0; system.pattern.dof_map.count()];
                system.right_hand_side(&mut side);
                side
            });
            let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(as_masses.values.iter().any(|&value| value != 0.0), "{what}");
            assert!(apart(&as_masses.values, &as_elements.values) < 1e-14, "{what}");
            assert!(apart(&sides[0], &sides[1]) < 1e-14, "{what}");
        }
    }
}
