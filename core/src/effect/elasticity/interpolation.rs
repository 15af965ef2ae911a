//! Interpolations of rotations in beam elements: each gives the element kernel nodes in a frame of
//! its own, and carries force and tangent of the kernel back to the nodes of the scene.

use super::element::{ElasticPoint, ElementNodes};
use crate::effect::{Connection, after_displacement, at_slots};
use crate::kernel::law::Stress;
use crate::kernel::relative::Relative;
use crate::kernel::{ElementSystem, NodeMotion, NodePlace, Weights};
use crate::rotation::Rotation;
use crate::scalar::{LANES, Lanes, Pack, Real, each_lane, pack};
use crate::system::{Assembler, Slot, State};
use crate::tensor::{Mat3, Vec3};

/// The configuration of an element, or of several elements side by side, with all rotation vectors
/// in one chart.
pub struct ElementConfiguration<const N: usize, T = f64> {
    /// The initial places of the nodes from the first node
    pub(crate) arms: [Vec3<T>; N],
    /// The displacements of the nodes
    pub(crate) u: [Vec3<T>; N],
    /// The rotation vectors of the nodes
    pub(crate) p: [Vec3<T>; N],
    /// The rotations before the increments `p`; `None` if `p` are total rotation vectors
    pub(crate) base: Option<[Mat3<T>; N]>,
}

impl<const N: usize> ElementConfiguration<N> {
    /// The configuration of an element with the motions `nodes`, all in one chart.
    #[inline(always)]
    pub fn new(member: ElementNodes<N>, nodes: &[NodeMotion; N], at: &State) -> Self {
        let u = nodes.map(|node| node.u);
        let p = nodes.map(|node| node.p);
        let base = || std::array::from_fn(|i| base_of(member.connection, i, at));
        Self { arms: member.arms, u, p, base: (!at.turns.is_empty()).then(base) }
    }
}

impl<const N: usize> ElementConfiguration<N, Lanes> {
    /// The configurations of elements side by side, each node in its own chart.
    #[inline(always)]
    pub fn side_by_side(members: [ElementNodes<N>; LANES], at: &State) -> Self {
        let connections = each_lane!(|k| members[k].connection);
        let mut out = Self { arms: [Vec3::zero(); N], u: [Vec3::zero(); N], p: [Vec3::zero(); N], base: None };
        for i in 0..N {
            out.arms[i] = pack!(members.arms[i]);
            out.u[i] = at_slots(&at.q, each_lane!(|k| connections[k].nodes[i].u));
            out.p[i] = at_slots(&at.q, each_lane!(|k| connections[k].nodes[i].p));
        }
        if !at.turns.is_empty() {
            out.base = Some(bases(connections, at));
        }
        out
    }
}

/// The rotation before the increment of node i; the identity if its vector is a total one.
fn base_of<const N: usize>(connection: &Connection<N>, i: usize, at: &State) -> Mat3 {
    at.turn(connection.nodes[i].p).map_or(Mat3::IDENTITY, |turn| turn.base())
}

#[inline(never)]
fn bases<const N: usize>(connections: [&Connection<N>; LANES], at: &State) -> [Mat3<Lanes>; N] {
    std::array::from_fn(|i| {
        let all = connections.map(|connection| base_of(connection, i, at));
        Mat3::pack(all.each_ref())
    })
}

/// A sum of forces and tangents over the integration points of an element.
pub trait PointSum<const N: usize, T: Real> {
    /// Adds the force and `stiffness` times the tangent, for nodes in the frame of the kernel.
    fn add(&self, nodes: &[NodePlace<T>; N], stiffness: f64, out: &mut ElementSystem<T>);

    /// Adds the forces that form the geometric parts of the tangent. Returns `false` if they are
    /// those of [`Self::add`], which are then not added.
    fn add_geometric(&self, nodes: &[NodePlace<T>; N], out: &mut ElementSystem<T>) -> bool;

    /// The elastic point of an element of two nodes with a single point half way between them,
    /// which has a shorter formula; `None` for other sums.
    fn half_way(&self) -> Option<HalfWayPoint<'_, N, T>> {
        None
    }
}

/// True for an element of two nodes with a single point, which lies half way between them.
pub const fn is_half_way(nodes: usize, points: usize) -> bool {
    nodes == 2 && points == 1
}

/// The single elastic point of an element of two nodes.
pub struct HalfWayPoint<'a, const N: usize, T> {
    /// The point
    pub(crate) point: &'a ElasticPoint<N, T>,
    /// The amplitude of its free strain
    pub(crate) free: T,
    /// The stress that forms the geometric part; `None` for the present one
    pub(crate) geometric: Option<&'a Stress<T>>,
}

/// Two element systems of scratch memory, allocated on demand and kept between elements.
pub struct Scratch<T = f64> {
    nodes: usize,
    /// The system in the frame of the kernel, and the system of the forces of its geometric parts
    systems: Option<[ElementSystem<T>; 2]>,
}

/// An element system with its scratch memory, for elements that are computed one by one.
pub struct Workspace<T = f64> {
    /// The system of the element
    pub(super) system: ElementSystem<T>,
    /// Scratch memory of the interpolation
    pub(super) scratch: Scratch<T>,
}

impl<T: Real> Workspace<T> {
    /// Memory for elements of `nodes` nodes.
    pub fn new(nodes: usize) -> Self {
        Self { system: ElementSystem::new(2 * nodes), scratch: Scratch::new(nodes) }
    }
}

impl<T: Real> Scratch<T> {
    /// Scratch memory for elements of `nodes` nodes.
    pub fn new(nodes: usize) -> Self {
        Self { nodes, systems: None }
    }

    fn systems(&mut self) -> &mut [ElementSystem<T>; 2] {
        self.systems.get_or_insert_with(|| [(); 2].map(|()| ElementSystem::new(2 * self.nodes)))
    }
}

impl Scratch<Lanes> {
    /// Scratch memory with systems lent by an assembler, if they are `needed`.
    pub fn lent(nodes: usize, needed: bool, out: &mut Assembler) -> Self {
        Self { nodes, systems: needed.then(|| [(); 2].map(|()| out.lend(2 * nodes, true))) }
    }

    /// Gives lent systems back to their assembler.
    pub fn give_back(self, out: &mut Assembler) {
        self.systems.into_iter().flatten().for_each(|system| out.take_back(system));
    }
}

/// An element in the frame of its kernel.
pub trait View<const N: usize, T: Real> {
    /// The element in a configuration.
    fn new(configuration: &ElementConfiguration<N, T>) -> Self;

    /// The nodes in the frame of the kernel.
    fn nodes(&self) -> &[NodePlace<T>; N];

    /// Variations of displacement and rotation vector at the nodes in the frame of the kernel, for
    /// variations `du` and `dp` at the nodes of the scene.
    fn variation(&self, du: &[Vec3<T>; N], dp: &[Vec3<T>; N]) -> [(Vec3<T>, Vec3<T>); N];

    /// Overwrites `out` with force and `stiffness` times the tangent of a sum over points, carried
    /// back to the nodes of the scene.
    fn fill<K: PointSum<N, T> + ?Sized>(
        &self,
        sum: &K,
        stiffness: f64,
        scratch: &mut Scratch<T>,
        out: &mut ElementSystem<T>,
    );

    /// The stresses at the points, extrapolated over variations of displacements and rotation
    /// vectors. `free` is the amplitude of the free strain.
    #[inline(always)]
    fn extrapolated<const G: usize>(
        &self,
        points: &[ElasticPoint<N, T>; G],
        free: T,
        du: &[Vec3<T>; N],
        dp: &[Vec3<T>; N],
    ) -> [Stress<T>; G]
    where
        Self: Sized,
    {
        extrapolated(self, points, free, du, dp)
    }
}

/// [`View::extrapolated`] by the general formula, for elements of any order.
#[inline(always)]
fn extrapolated<const N: usize, const G: usize, T: Real>(
    view: &impl View<N, T>,
    points: &[ElasticPoint<N, T>; G],
    free: T,
    du: &[Vec3<T>; N],
    dp: &[Vec3<T>; N],
) -> [Stress<T>; G] {
    let nodes = view.nodes();
    let change = view.variation(du, dp);
    let mut out = [Stress { n: Vec3::zero(), m: Vec3::zero() }; G];
    for g in 0..G {
        out[g] = points[g].extrapolated_stress(nodes, free, |i| change[i].0, |i| change[i].1);
    }
    out
}

/// An interpolation of rotations.
pub trait Interpolation: Send + Sync + 'static {
    /// The name of the effect of elasticity
    const NAME: &'static str;
    /// The name of the effect of strain-rate damping
    const DAMPING_NAME: &'static str;
    /// True if forces and tangents of the kernel are carried back from another frame, which needs
    /// scratch memory
    const CARRIES_BACK: bool;
    /// An element in the frame of its kernel
    type View<const N: usize, T: Real>: View<N, T>;

    /// The view of a single element; compiled once for all that look at single elements.
    #[inline(never)]
    fn alone<const N: usize, T: Real>(configuration: &ElementConfiguration<N, T>) -> Self::View<N, T> {
        Self::View::new(configuration)
    }

    /// `View::fill` for a single element; compiled once for all sums.
    #[inline(never)]
    fn fill_alone<const N: usize>(
        view: &Self::View<N, f64>,
        sum: &dyn PointSum<N, f64>,
        stiffness: f64,
        scratch: &mut Scratch,
        out: &mut ElementSystem,
    ) {
        view.fill(sum, stiffness, scratch, out);
    }

    /// The view of an element in a state, with its nodes in one chart.
    #[inline(never)]
    fn see<const N: usize>(member: ElementNodes<N>, at: &State) -> Self::View<N, f64> {
        let nodes = member.connection.motions_in_one_chart(at);
        Self::alone(&ElementConfiguration::new(member, &nodes, at))
    }

    /// Variations at the nodes in the frame of the kernel for increments `dq` of the unknowns by
    /// slot.
    #[inline(never)]
    fn variation<const N: usize>(member: ElementNodes<N>, at: &State, dq: &dyn Fn(Slot) -> Vec3) -> [(Vec3, Vec3); N] {
        let (du, dp) = member.connection.variations_in_one_chart(at, dq);
        Self::see(member, at).variation(&du, &dp)
    }

    /// Overwrites `out` with a sum over the points of an element, carried back to the nodes of the
    /// scene and to their charts.
    #[inline(never)]
    fn evaluate<const N: usize>(
        member: ElementNodes<N>,
        at: &State,
        stiffness: f64,
        scratch: &mut Scratch,
        out: &mut ElementSystem,
        sum: &dyn PointSum<N, f64>,
    ) {
        let weights = Weights { stiffness, ..Weights::NONE };
        let scratch = std::cell::RefCell::new(scratch);
        member.connection.evaluate(at, weights, false, &after_displacement, out, &|nodes, weights, out| {
            let view = Self::alone(&ElementConfiguration::new(member, nodes, at));
            Self::fill_alone(&view, sum, weights.stiffness, &mut scratch.borrow_mut(), out);
        });
    }
}

/// Total rotation vectors are interpolated, in the chart of the element's first node (Makinen
/// 2007).
#[derive(Clone, Copy, Debug)]
pub struct TotalVectors;

impl Interpolation for TotalVectors {
    const NAME: &'static str = "beam elasticity";
    const DAMPING_NAME: &'static str = "strain-rate damping";
    const CARRIES_BACK: bool = false;
    type View<const N: usize, T: Real> = TotalView<N, T>;
}

/// Rotation vectors relative to a frame that turns with the element are interpolated: strains do
/// not depend on rigid rotations, nor on charts (Crisfield & Jelenic 1999,
/// doi:10.1098/rspa.1999.0352).
#[derive(Clone, Copy, Debug)]
pub struct RelativeVectors;

impl Interpolation for RelativeVectors {
    const NAME: &'static str = "beam elasticity, relative";
    const DAMPING_NAME: &'static str = "strain-rate damping, relative";
    const CARRIES_BACK: bool = true;
    type View<const N: usize, T: Real> = RelativeView<N, T>;
}

/// An element with its own nodes: the view of [`TotalVectors`].
pub struct TotalView<const N: usize, T> {
    nodes: [NodePlace<T>; N],
}

impl<const N: usize, T: Real> View<N, T> for TotalView<N, T> {
    #[inline(always)]
    fn new(configuration: &ElementConfiguration<N, T>) -> Self {
        let mut nodes = [NodePlace::rest(); N];
        for i in 0..N {
            nodes[i].u = configuration.u[i];
            nodes[i].p = configuration.p[i];
        }
        Self { nodes }
    }

    #[inline(always)]
    fn nodes(&self) -> &[NodePlace<T>; N] {
        &self.nodes
    }

    #[inline(always)]
    fn variation(&self, du: &[Vec3<T>; N], dp: &[Vec3<T>; N]) -> [(Vec3<T>, Vec3<T>); N] {
        let mut out = [(Vec3::zero(), Vec3::zero()); N];
        for i in 0..N {
            out[i] = (du[i], dp[i]);
        }
        out
    }

    #[inline(always)]
    fn fill<K: PointSum<N, T> + ?Sized>(
        &self,
        sum: &K,
        stiffness: f64,
        _scratch: &mut Scratch<T>,
        out: &mut ElementSystem<T>,
    ) {
        out.clear_for(Weights { stiffness, ..Weights::NONE });
        sum.add(&self.nodes, stiffness, out);
    }
}

/// An element in the frame that turns with it: the view of [`RelativeVectors`].
pub struct RelativeView<const N: usize, T> {
    seen: Relative<N, T>,
    rotations: [Rotation<T>; N],
}

impl<const N: usize, T: Real> View<N, T> for RelativeView<N, T> {
    #[inline(always)]
    fn new(configuration: &ElementConfiguration<N, T>) -> Self {
        let mut rotations = [Rotation::new(configuration.p[0]); N];
        for i in 1..N {
            rotations[i] = Rotation::new(configuration.p[i]);
        }
        if let Some(base) = &configuration.base {
            for i in 0..N {
                rotations[i] = rotations[i].after(base[i]);
            }
        }
        Self { seen: Relative::new(&configuration.arms, &configuration.u, &rotations), rotations }
    }

    #[inline(always)]
    fn nodes(&self) -> &[NodePlace<T>; N] {
        &self.seen.nodes
    }

    #[inline(always)]
    fn variation(&self, du: &[Vec3<T>; N], dp: &[Vec3<T>; N]) -> [(Vec3<T>, Vec3<T>); N] {
        let mut spins = [Vec3::zero(); N];
        for i in 0..N {
            spins[i] = self.rotations[i].t * dp[i];
        }
        self.seen.variation(du, &spins)
    }

    #[inline(always)]
    fn extrapolated<const G: usize>(
        &self,
        points: &[ElasticPoint<N, T>; G],
        free: T,
        du: &[Vec3<T>; N],
        dp: &[Vec3<T>; N],
    ) -> [Stress<T>; G] {
        if is_half_way(N, G) {
            return [self.seen.extrapolated_half_way(&self.rotations, &points[0], free, du, dp); G];
        }
        extrapolated(self, points, free, du, dp)
    }

    #[inline(always)]
    fn fill<K: PointSum<N, T> + ?Sized>(
        &self,
        sum: &K,
        stiffness: f64,
        scratch: &mut Scratch<T>,
        out: &mut ElementSystem<T>,
    ) {
        if let Some(HalfWayPoint { point, free, geometric }) = sum.half_way() {
            return self.seen.fill_half_way(&self.rotations, point, free, geometric, stiffness, out);
        }
        let [local, geometric] = scratch.systems();
        local.clear_for(Weights { stiffness, ..Weights::NONE });
        sum.add(&self.seen.nodes, stiffness, local);
        geometric.clear_force();
        let other = stiffness != 0.0 && sum.add_geometric(&self.seen.nodes, geometric);
        self.seen.carry_back(&self.rotations, local, other.then_some(&*geometric), stiffness, out);
    }
}
