//! Nanoseconds per element of the kernels: force, tangent, inertia, for elements of two, three and four nodes.
//!
//! `cargo bench --bench kernels`; compare figures of one run only.

use beamsim_core::kernel::beam::StiffnessPoint;
use beamsim_core::kernel::inertia::Rotary;
use beamsim_core::kernel::law::{Linear, Stiffness};
use beamsim_core::kernel::volume::VolumePoint;
use beamsim_core::kernel::{ElementSystem, NodeMotion, Weights, shape};
use beamsim_core::rotation::Rotation;
use beamsim_core::tensor::{Mat3, Vec3};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::hint::black_box;

/// A bent and twisted element of unit length that moves.
fn nodes<const N: usize>() -> [NodeMotion; N] {
    std::array::from_fn(|i| {
        let s = i as f64 / (N - 1) as f64;
        NodeMotion {
            u: Vec3([0.1 * s, 0.2 * s * s, -0.1 * s]),
            u_rate: Vec3([0.3, -0.2, 0.1]),
            u_rate2: Vec3([1.0, 2.0, s]),
            p: Vec3([1.0 + 0.1 * s, -0.7 + 0.3 * s, 0.4]),
            p_rate: Vec3([0.5, 0.2 * s, -0.4]),
            p_rate2: Vec3([1.0, s, 3.0]),
        }
    })
}

fn stiffness_points<const N: usize, const G: usize>() -> [StiffnessPoint<N>; G] {
    std::array::from_fn(|g| {
        let (xi, weight) = shape::gauss(G)[g];
        StiffnessPoint {
            shape: shape::values::<N>(xi),
            slope: shape::derivatives::<N>(xi).map(|d| 2.0 * d),
            weight: 0.5 * weight,
            tangent: Vec3::UNIT[0],
            law: Linear {
                stiffness: Stiffness {
                    cn: Mat3::diagonal([1e4, 5e3, 5e3]),
                    cm: Mat3::diagonal([80.0, 100.0, 120.0]),
                    cc: None,
                },
            },
            free: None,
        }
    })
}

fn volume_points<const N: usize>() -> [VolumePoint<N, Mat3>; N] {
    std::array::from_fn(|g| {
        let (xi, weight) = shape::gauss(N)[g];
        VolumePoint { shape: shape::values::<N>(xi), weight: 0.5 * weight, quantity: Mat3::diagonal([2.0, 1.0, 1.0]) }
    })
}

fn element<const N: usize, const G: usize>(criterion: &mut Criterion) {
    let (nodes, points, volume) = (nodes::<N>(), stiffness_points::<N, G>(), volume_points::<N>());
    let mut elastic = |name: &str, weight: f64| {
        criterion.bench_function(&format!("{name}, {N} nodes"), |bencher| {
            let fill = |mut out: ElementSystem| {
                for point in &points {
                    point.add_elastic(black_box(&nodes), 0.0, None, weight, &mut out);
                }
                out
            };
            bencher.iter_batched(|| ElementSystem::new(2 * N), fill, BatchSize::SmallInput);
        });
    };
    elastic("elastic force", 0.0);
    elastic("elastic force and tangent", 1.0);
    let weights = Weights { stiffness: 1.0, damping: 20.0, mass: 400.0 };
    criterion.bench_function(&format!("rotary inertia with tangents, {N} nodes"), |bencher| {
        let fill = |mut out: ElementSystem| {
            for point in &volume {
                point.add(&Rotary { gyroscopic: true }, black_box(&nodes), weights, &mut out);
            }
            out
        };
        bencher.iter_batched(|| ElementSystem::new(N), fill, BatchSize::SmallInput);
    });
}

fn kernels(criterion: &mut Criterion) {
    criterion.bench_function("rotation and tangent tensor", |bencher| {
        bencher.iter(|| Rotation::new(black_box(Vec3([1.0, -0.7, 0.4]))));
    });
    element::<2, 1>(criterion);
    element::<3, 2>(criterion);
    element::<4, 3>(criterion);
}

criterion_group!(benches, kernels);
criterion_main!(benches);
