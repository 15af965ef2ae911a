//! Forces and moments per initial length along beams: fixed in space, or turning with the section.

use super::{ByOrder, Connection, Effect, after_displacement, for_each_batch};
use crate::kernel::beam::VolumePoint;
use crate::kernel::load::{material_force, material_moment, spatial_moment};
use crate::kernel::{ElementSystem, NodeMotion, Weights};
use crate::rotation::Rotation;
use crate::system::{Category, Cliques, Memory, Sink, State};
use crate::tensor::Vec3;

/// Whether the components are spatial or turn with the section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineLoadKind {
    /// Fixed in space
    Spatial,
    /// Turning with the section
    Material,
}

/// Force and moment per length.
#[derive(Clone, Copy, Debug)]
pub struct Intensity {
    /// Force per initial length
    pub force: Vec3,
    /// Moment per initial length
    pub moment: Vec3,
}

/// A loaded element of N nodes.
#[derive(Clone, Debug)]
pub struct LoadedElement<const N: usize> {
    /// Its place in the scene
    pub connection: Connection<N>,
    /// Points with the intensity there
    pub points: [VolumePoint<N, Intensity>; N],
    /// The number of its amplitude
    pub amplitude: usize,
}

/// All line loads of one kind.
#[derive(Clone, Debug)]
pub struct LineLoad {
    /// What they are
    pub kind: LineLoadKind,
    /// The loaded elements
    pub elements: ByOrder<LoadedElement<2>, LoadedElement<3>, LoadedElement<4>>,
}

impl Effect for LineLoad {
    fn name(&self) -> &'static str {
        match self.kind {
            LineLoadKind::Spatial => "dead line loads",
            LineLoadKind::Material => "following line loads",
        }
    }

    fn category(&self) -> Category {
        Category::External
    }

    fn cliques(&self) -> Cliques {
        let mut cliques = Cliques::default();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            cliques.push(element.connection.slots());
        });
        cliques
    }

    fn has_tangent(&self) -> bool {
        let mut any = self.kind == LineLoadKind::Material;
        for_each_batch!(self.elements, |_first, batch| {
            any |= batch.iter().flat_map(|e| &e.points).any(|p| p.quantity.moment != Vec3::ZERO);
        });
        any
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        for_each_batch!(self.elements, |first, batch| add_batch(self.kind, batch, first, at, weights, out));
    }
}

fn add_batch<const N: usize>(
    kind: LineLoadKind,
    batch: &[LoadedElement<N>],
    first: usize,
    at: &State,
    weights: Weights,
    out: &mut Sink,
) {
    let mut system = ElementSystem::new(2 * N);
    for (k, element) in batch.iter().enumerate() {
        let amplitude = at.amplitude[element.amplitude];
        element.connection.evaluate(at, weights, false, after_displacement, &mut system, |nodes, weights, system| {
            for point in &element.points {
                add_point(kind, point, amplitude, nodes, weights.stiffness, system);
            }
        });
        out.add(first + k, &system);
    }
}

fn add_point<const N: usize>(
    kind: LineLoadKind,
    point: &VolumePoint<N, Intensity>,
    amplitude: f64,
    nodes: &[NodeMotion; N],
    stiffness: f64,
    out: &mut ElementSystem,
) {
    let force = point.quantity.force * (amplitude * point.weight);
    let moment = point.quantity.moment * (amplitude * point.weight);
    if kind == LineLoadKind::Spatial {
        for (i, &n) in point.shape.iter().enumerate() {
            out.add_force(2 * i, -(force * n));
        }
        if moment == Vec3::ZERO {
            return;
        }
    }
    let rotation = Rotation::new(point.motion(nodes).p);
    let (moment, moment_tangent) = match kind {
        LineLoadKind::Spatial => spatial_moment(&rotation, moment),
        LineLoadKind::Material => material_moment(&rotation, moment),
    };
    let following = (kind == LineLoadKind::Material).then(|| material_force(&rotation, force));
    for i in 0..N {
        out.add_force(2 * i + 1, moment * point.shape[i]);
        if let Some((force, _)) = following {
            out.add_force(2 * i, force * point.shape[i]);
        }
        for j in 0..N {
            let factor = point.shape[i] * point.shape[j] * stiffness;
            out.add_tangent(2 * i + 1, 2 * j + 1, moment_tangent * factor);
            if let Some((_, tangent)) = following {
                out.add_tangent(2 * i, 2 * j + 1, tangent * factor);
            }
        }
    }
}
