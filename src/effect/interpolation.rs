//! How beam elements interpolate rotations: each way shows the same element kernel other nodes, and carries what the kernel
//! gives back to the nodes of the scene.

use super::{Connection, after_displacement};
use crate::kernel::relative::Relative;
use crate::kernel::seam::Converted;
use crate::kernel::{ElementSystem, NodeMotion, Weights};
use crate::rotation::Rotation;
use crate::system::State;
use crate::tensor::Vec3;

/// Two element systems to compute with, kept between elements.
pub struct Scratch {
    local: ElementSystem,
    geometric: ElementSystem,
}

impl Scratch {
    /// For elements of `nodes` nodes.
    pub fn new(nodes: usize) -> Self {
        Self { local: ElementSystem::new(2 * nodes), geometric: ElementSystem::new(2 * nodes) }
    }
}

/// A way to interpolate rotations.
pub trait Interpolation: Send + Sync + 'static {
    /// What their elasticity is called
    const NAME: &'static str;
    /// What their damping by strain rates is called
    const DAMPING_NAME: &'static str;

    /// The nodes that the kernel sees.
    fn nodes<const N: usize>(connection: &Connection<N>, at: &State) -> [NodeMotion; N];

    /// How these vary when the unknowns do: displacements and rotation vectors.
    fn variation<const N: usize>(connection: &Connection<N>, at: &State, dq: &[Vec3]) -> [(Vec3, Vec3); N];

    /// Evaluates the kernel, which adds the force and `stiffness` times the tangent, on these nodes and carries both back
    /// into `out`. `geometric` adds the forces that geometric parts are formed with, where they are others.
    fn evaluate<const N: usize>(
        connection: &Connection<N>,
        at: &State,
        stiffness: f64,
        scratch: &mut Scratch,
        out: &mut ElementSystem,
        kernel: impl Fn(&[NodeMotion; N], f64, &mut ElementSystem),
        geometric: Option<impl Fn(&[NodeMotion; N], &mut ElementSystem)>,
    );
}

/// The paper's: total rotation vectors are interpolated, in the chart of the element's first node.
#[derive(Clone, Copy, Debug)]
pub struct TotalVectors;

impl Interpolation for TotalVectors {
    const NAME: &'static str = "beam elasticity";
    const DAMPING_NAME: &'static str = "strain-rate damping";

    fn nodes<const N: usize>(connection: &Connection<N>, at: &State) -> [NodeMotion; N] {
        connection.motions_in_one_chart(at)
    }

    fn variation<const N: usize>(connection: &Connection<N>, at: &State, dq: &[Vec3]) -> [(Vec3, Vec3); N] {
        let converted = Converted::new(&connection.motions(at), at.mixed[connection.element as usize]);
        std::array::from_fn(|i| {
            let node = connection.nodes[i];
            (dq[node.u as usize], converted.variation(i, dq[node.p as usize]))
        })
    }

    #[inline]
    fn evaluate<const N: usize>(
        connection: &Connection<N>,
        at: &State,
        stiffness: f64,
        _scratch: &mut Scratch,
        out: &mut ElementSystem,
        kernel: impl Fn(&[NodeMotion; N], f64, &mut ElementSystem),
        _geometric: Option<impl Fn(&[NodeMotion; N], &mut ElementSystem)>,
    ) {
        let weights = Weights { stiffness, ..Weights::NONE };
        connection.evaluate(at, weights, false, after_displacement, out, |nodes, weights, out| {
            kernel(nodes, weights.stiffness, out);
        });
    }
}

/// Rotations relative to a frame that turns with the element: strains do not notice rigid rotations, and charts do not matter.
#[derive(Clone, Copy, Debug)]
pub struct RelativeVectors;

impl RelativeVectors {
    fn see<const N: usize>(connection: &Connection<N>, at: &State) -> (Relative<N>, [Rotation; N]) {
        let rotations = connection.nodes.map(|node| at.rotation(node.p));
        let u = connection.nodes.map(|node| at.q[node.u as usize]);
        (Relative::new(&connection.places, &u, &rotations), rotations)
    }
}

impl Interpolation for RelativeVectors {
    const NAME: &'static str = "beam elasticity, relative";
    const DAMPING_NAME: &'static str = "strain-rate damping, relative";

    fn nodes<const N: usize>(connection: &Connection<N>, at: &State) -> [NodeMotion; N] {
        Self::see(connection, at).0.nodes
    }

    fn variation<const N: usize>(connection: &Connection<N>, at: &State, dq: &[Vec3]) -> [(Vec3, Vec3); N] {
        let (seen, rotations) = Self::see(connection, at);
        let du = connection.nodes.map(|node| dq[node.u as usize]);
        let spins = std::array::from_fn(|i| rotations[i].t * dq[connection.nodes[i].p as usize]);
        seen.variation(&du, &spins)
    }

    #[inline]
    fn evaluate<const N: usize>(
        connection: &Connection<N>,
        at: &State,
        stiffness: f64,
        scratch: &mut Scratch,
        out: &mut ElementSystem,
        kernel: impl Fn(&[NodeMotion; N], f64, &mut ElementSystem),
        geometric: Option<impl Fn(&[NodeMotion; N], &mut ElementSystem)>,
    ) {
        let (seen, rotations) = Self::see(connection, at);
        let Scratch { local, geometric: source } = scratch;
        local.clear();
        kernel(&seen.nodes, stiffness, local);
        let source = geometric.filter(|_| stiffness != 0.0).map(|geometric| {
            source.clear();
            geometric(&seen.nodes, source);
            &*source
        });
        out.clear();
        seen.carry_back(&rotations, local, source, stiffness, out);
    }
}
