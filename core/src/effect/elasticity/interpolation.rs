//! How beam elements interpolate rotations: each way shows the same element kernel other nodes, and
//! carries what the kernel gives back to the nodes of the scene.

use super::element::{ElasticPoint, Member};
use crate::effect::{Connection, after_displacement, at_slots};
use crate::kernel::law::Stress;
use crate::kernel::relative::Relative;
use crate::kernel::{ElementSystem, NodeMotion, NodePlace, Weights};
use crate::rotation::Rotation;
use crate::scalar::{LANES, Lanes, Pack, Real, each_lane, pack};
use crate::system::{Assembler, State};
use crate::tensor::{Mat3, Vec3};

/// Where the nodes of an element are, or those of several elements side by side; rotation vectors
/// all in one chart.
pub struct Posture<const N: usize, T = f64> {
    /// Where they started, as seen from the first
    pub arms: [Vec3<T>; N],
    /// Their displacements
    pub u: [Vec3<T>; N],
    /// Their rotation vectors
    pub p: [Vec3<T>; N],
    /// The rotations that `p` are increments to, where they are no total ones
    pub base: Option<[Mat3<T>; N]>,
}

impl<const N: usize> Posture<N> {
    /// Of an element whose nodes move so.
    #[inline(always)]
    pub fn new(member: Member<N>, nodes: &[NodeMotion; N], at: &State) -> Self {
        let u = nodes.map(|node| node.u);
        let p = nodes.map(|node| node.p);
        let base = || std::array::from_fn(|i| base_of(member.connection, i, at));
        Self { arms: member.arms, u, p, base: (!at.turns.is_empty()).then(base) }
    }
}

impl<const N: usize> Posture<N, Lanes> {
    /// Of elements side by side, each node in its own chart.
    #[inline(always)]
    pub fn side_by_side(members: [Member<N>; LANES], at: &State) -> Self {
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

/// The rotation that the vector of node i is an increment to.
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

/// A sum of forces and tangents over the points of an element.
pub trait PointSum<const N: usize, T: Real> {
    /// Adds the force and `stiffness` times the tangent, for nodes that the kernel sees so.
    fn add(&self, nodes: &[NodePlace<T>; N], stiffness: f64, out: &mut ElementSystem<T>);

    /// Adds the forces that geometric parts are formed with; `false` where they are those of `add`.
    fn add_geometric(&self, nodes: &[NodePlace<T>; N], out: &mut ElementSystem<T>) -> bool;

    /// The elastic point half way between two nodes, where it is all there is: for it the way is
    /// short.
    fn half_way(&self) -> Option<HalfWay<'_, N, T>> {
        None
    }
}

/// An element of two nodes, with its only point half way between them.
pub const fn is_half_way(nodes: usize, points: usize) -> bool {
    nodes == 2 && points == 1
}

/// An elastic point with the amplitude of its free strain, and the stress of its geometric part
/// where that is not the present one.
pub struct HalfWay<'a, const N: usize, T> {
    /// The point
    pub point: &'a ElasticPoint<N, T>,
    /// The amplitude
    pub free: T,
    /// The stress
    pub geometric: Option<&'a Stress<T>>,
}

/// Two element systems to compute with where they are needed, kept between elements.
pub struct Scratch<T = f64> {
    nodes: usize,
    /// Of the nodes that the kernel is shown, and of its geometric part
    systems: Option<[ElementSystem<T>; 2]>,
}

impl<T: Real> Scratch<T> {
    /// For elements of `nodes` nodes.
    pub fn new(nodes: usize) -> Self {
        Self { nodes, systems: None }
    }

    fn systems(&mut self) -> &mut [ElementSystem<T>; 2] {
        self.systems.get_or_insert_with(|| [(); 2].map(|()| ElementSystem::new(2 * self.nodes)))
    }
}

impl Scratch<Lanes> {
    /// With systems of a sink, where they are `needed`.
    pub fn lent(nodes: usize, needed: bool, sink: &mut Assembler) -> Self {
        Self { nodes, systems: needed.then(|| [(); 2].map(|()| sink.lend(2 * nodes, true))) }
    }

    /// Gives them back.
    pub fn give_back(self, sink: &mut Assembler) {
        self.systems.into_iter().flatten().for_each(|system| sink.take_back(system));
    }
}

/// An element as its interpolation sees it.
pub trait View<const N: usize, T: Real> {
    /// Sees the element.
    fn new(posture: &Posture<N, T>) -> Self;

    /// The nodes that the kernel is shown.
    fn nodes(&self) -> &[NodePlace<T>; N];

    /// How these vary with displacements and rotation vectors.
    fn variation(&self, du: &[Vec3<T>; N], dp: &[Vec3<T>; N]) -> [(Vec3<T>, Vec3<T>); N];

    /// Adds up the points, and puts what they give, carried back to the nodes of the scene, in the
    /// place of what stands in `out`.
    fn fill<K: PointSum<N, T>>(&self, sum: &K, stiffness: f64, scratch: &mut Scratch<T>, out: &mut ElementSystem<T>);

    /// The stresses that variations of displacements and rotation vectors are expected to lead to.
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

/// [`View::extrapolated`] of any elements.
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

/// A way to interpolate rotations.
pub trait Interpolation: Send + Sync + 'static {
    /// The name of their elasticity
    const NAME: &'static str;
    /// The name of their damping by strain rates
    const DAMPING_NAME: &'static str;
    /// Forces and tangents of the kernel are carried back to other nodes, which takes systems to
    /// work in
    const CARRIES_BACK: bool;
    /// An element as its kernel sees it
    type View<const N: usize, T: Real>: View<N, T>;

    /// An element, its nodes in one chart.
    #[inline(never)]
    fn see<const N: usize>(member: Member<N>, at: &State) -> Self::View<N, f64> {
        let nodes = member.connection.motions_in_one_chart(at);
        Self::View::new(&Posture::new(member, &nodes, at))
    }

    /// How the nodes that the kernel sees vary when the unknowns do by `dq`.
    #[inline(never)]
    fn variation<const N: usize>(member: Member<N>, at: &State, dq: &[Vec3]) -> [(Vec3, Vec3); N] {
        let (du, dp) = member.connection.variations_in_one_chart(at, dq);
        Self::see(member, at).variation(&du, &dp)
    }

    /// The sum over an element's points, carried back to the nodes of the scene and to their
    /// charts.
    #[inline(never)]
    fn evaluate<const N: usize, K: PointSum<N, f64>>(
        member: Member<N>,
        at: &State,
        stiffness: f64,
        scratch: &mut Scratch,
        out: &mut ElementSystem,
        sum: &K,
    ) {
        let weights = Weights { stiffness, ..Weights::NONE };
        let scratch = std::cell::RefCell::new(scratch);
        member.connection.evaluate(at, weights, false, after_displacement, out, &|nodes, weights, out| {
            let view = Self::View::new(&Posture::new(member, nodes, at));
            view.fill(sum, weights.stiffness, &mut scratch.borrow_mut(), out);
        });
    }
}

/// The paper's: total rotation vectors are interpolated, in the chart of the element's first node.
#[derive(Clone, Copy, Debug)]
pub struct TotalVectors;

impl Interpolation for TotalVectors {
    const NAME: &'static str = "beam elasticity";
    const DAMPING_NAME: &'static str = "strain-rate damping";
    const CARRIES_BACK: bool = false;
    type View<const N: usize, T: Real> = AsItIs<N, T>;
}

/// Rotations relative to a frame that turns with the element: strains do not notice rigid
/// rotations, and charts do not matter.
#[derive(Clone, Copy, Debug)]
pub struct RelativeVectors;

impl Interpolation for RelativeVectors {
    const NAME: &'static str = "beam elasticity, relative";
    const DAMPING_NAME: &'static str = "strain-rate damping, relative";
    const CARRIES_BACK: bool = true;
    type View<const N: usize, T: Real> = FromItsFrame<N, T>;
}

/// An element with the nodes that it has.
pub struct AsItIs<const N: usize, T> {
    nodes: [NodePlace<T>; N],
}

impl<const N: usize, T: Real> View<N, T> for AsItIs<N, T> {
    #[inline(always)]
    fn new(posture: &Posture<N, T>) -> Self {
        let mut nodes = [NodePlace::rest(); N];
        for i in 0..N {
            nodes[i].u = posture.u[i];
            nodes[i].p = posture.p[i];
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
    fn fill<K: PointSum<N, T>>(&self, sum: &K, stiffness: f64, _scratch: &mut Scratch<T>, out: &mut ElementSystem<T>) {
        out.clear_for(Weights { stiffness, ..Weights::NONE });
        sum.add(&self.nodes, stiffness, out);
    }
}

/// An element seen from its own frame.
pub struct FromItsFrame<const N: usize, T> {
    seen: Relative<N, T>,
    rotations: [Rotation<T>; N],
}

impl<const N: usize, T: Real> View<N, T> for FromItsFrame<N, T> {
    #[inline(always)]
    fn new(posture: &Posture<N, T>) -> Self {
        let mut rotations = [Rotation::new(posture.p[0]); N];
        for i in 1..N {
            rotations[i] = Rotation::new(posture.p[i]);
        }
        if let Some(base) = &posture.base {
            for i in 0..N {
                rotations[i] = rotations[i].after(base[i]);
            }
        }
        Self { seen: Relative::new(&posture.arms, &posture.u, &rotations), rotations }
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
    fn fill<K: PointSum<N, T>>(&self, sum: &K, stiffness: f64, scratch: &mut Scratch<T>, out: &mut ElementSystem<T>) {
        if let Some(HalfWay { point, free, geometric }) = sum.half_way() {
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
