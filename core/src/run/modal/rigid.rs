//! Rigid motions of free parts: motions against which nothing acts, whatever the state.
//!
//! A part may move rigidly where no support holds it and where all forces on it follow: when a part
//! turns by an infinitesimal rotation w, its forces f turn with it. With the gradients g_u = f and
//! g_P = T^T m of a node (m: material moment) this says
//!
//! ```text
//! K r = dg,   r_u = d + w x (x - c),   r_P = T^-1 R^T w,   dg_u = w x f,   dg_P = D_P(T^T m) r_P
//! ```
//!
//! It holds in balance and out of it, under pretension and under following loads, but for dead
//! loads that turning changes.
//!
//! Beams that joints or springs connect may also move against each other. Such a motion of a
//! mechanism is found where nothing carries a force through it: K r = 0, with a rigid motion of its
//! own for each body of connected beams.

use crate::effect::{Effect, SomeIncrements};
use crate::kernel::Weights;
use crate::model::{Assembly, Model};
use crate::rotation::Rotation;
use crate::system::{Node, Pattern, State, System};
use crate::tensor::Vec3;
use nalgebra::{DMatrix, SVD};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A motion is held where it moves a held direction by more than this part of itself.
const HELD: f64 = 1e-7;

/// Forces against a motion that are smaller than this part of their terms are round-off.
const NO_FORCE: f64 = 1e-11;

/// An unknown that a motion moves by round-off only is taken to move by this part of its motion in the others, so that
/// round-off in its forces is not compared with itself.
const LEAST_PART: f64 = 1e-4;

/// Terms of some effects count as at least this part of those of all effects: loads that have gone back to round-off are
/// none.
const LEAST_OF_ALL: f64 = 1e-3;

/// Parts in a scene of more are not looked at: each look goes over all unknowns. Their rigid motions are found as other
/// slow modes are.
const MOST_PARTS: usize = 64;

/// The numbers of all rigid motions of the bodies of a part, at most, for which its mechanisms are looked for: 160 MB.
const MOST_NUMBERS: usize = 20_000_000;

/// Sweeps for the decomposition of six columns, at most.
const MOST_SWEEPS: usize = 1000;

/// Directions of motion of one body.
const MOTIONS: usize = 6;

/// Forces against a spin that are smaller than this part of their terms are what the tolerance of
/// balance leaves.
const NO_FORCE_OF_SPIN: f64 = 1e-8;

/// The spins of straight parts about their own axes against which nothing acts, one number an
/// equation each. The system holds the stiffness of the state.
pub fn free_spins(system: &System, model: &Model, state: &State) -> Vec<Vec<f64>> {
    let dof_map = &system.pattern.dof_map;
    let sizes: Vec<f64> = system.values.iter().map(|v| v.abs()).collect();
    let mut found = Vec::new();
    let mut field = vec![Vec3::ZERO; state.q.len()];
    let mut look = |increments: &SomeIncrements| {
        increments.iter().for_each(|&(slot, increment)| field[slot as usize] = increment);
        let mut motion = vec![0.0; dof_map.count()];
        dof_map.gather(|slot| field[slot], &mut motion);
        increments.iter().for_each(|&(slot, _)| field[slot as usize] = Vec3::ZERO);
        let absolute: Vec<f64> = motion.iter().map(|v| v.abs()).collect();
        let (force, terms) = (system.multiply(&system.values, &motion), system.multiply(&sizes, &absolute));
        if force.iter().zip(&terms).all(|(force, terms)| force.abs() <= NO_FORCE_OF_SPIN * terms) {
            found.push(motion);
        }
    };
    let spins = model.effects.iter().filter_map(|effect| effect.roles().spins);
    spins.for_each(|spins| spins.free_motions(state, &mut look));
    found
}

/// The rigid motions of all free parts and of the mechanisms in them, one number an equation each. The assembly holds
/// forces and stiffness of the state.
pub fn rigid_motions(assembly: &Assembly, model: &Model, state: &State, places: &[(Node, Vec3)]) -> Vec<Vec<f64>> {
    let system = &assembly.system;
    let coupled = (0..system.pattern.node_blocks.count())
        .flat_map(|column| system.pattern.rows_of(column).iter().map(move |&row| [row as usize, column]));
    let parts = groups(&system.pattern, places, coupled);
    if parts.len() > MOST_PARTS {
        return Vec::new();
    }
    // A soft spring is round-off beside stiff beams, but not beside all else, which is looked at first.
    let mut others = None;
    let mut free_motions = |bodies: &[&[(Node, Vec3)]]| -> Vec<Vec<f64>> {
        let part = FreePart::new(bodies, system, model, state);
        let Some(allowed) = null_space(part.held(), HELD * HELD) else { return Vec::new() };
        let others = others.get_or_insert_with(|| all_but_beams(assembly, model, state));
        let fields = part.fields();
        let free = FreePart { system: &others.system, ..part.clone() }.unresisted(&fields, allowed);
        let free = free.and_then(|free| part.unresisted(&fields, free));
        free.map_or(Vec::new(), |free| combine(&fields, &free))
    };
    let elements = elements_of_beams(assembly, model);
    let of_part = |part: &Vec<(Node, Vec3)>| {
        let as_one = free_motions(&[part]);
        let bodies = groups(&system.pattern, part, elements.iter().copied());
        let is_large = MOTIONS * bodies.len() * system.pattern.dof_map.count() > MOST_NUMBERS;
        if bodies.len() == 1 || is_large {
            return as_one;
        }
        let bodies: Vec<&[(Node, Vec3)]> = bodies.iter().map(|body| &body[..]).collect();
        let of_mechanism = free_motions(&bodies);
        // The motions of the whole part are among those of its bodies where nothing carries a force.
        if of_mechanism.len() > as_one.len() { of_mechanism } else { as_one }
    };
    parts.iter().flat_map(of_part).collect()
}

/// The pairs of node blocks that elements of beams connect.
fn elements_of_beams(assembly: &Assembly, model: &Model) -> Vec<[usize; 2]> {
    let node_blocks = &assembly.system.pattern.node_blocks;
    let mut pairs = Vec::new();
    for effect in model.acting(&assembly.stage).iter().filter(|effect| effect.roles().stresses.is_some()) {
        for slots in effect.connectivity().iter() {
            pairs.extend(slots.windows(2).map(|pair| [node_blocks.of(pair[0]), node_blocks.of(pair[1])]));
        }
    }
    pairs
}

/// Forces and stiffness of all effects without the elasticity of beams, which resists no rigid motion, and without the
/// holds of spins. Loads that beams balance are alone in it.
fn all_but_beams(assembly: &Assembly, model: &Model, state: &State) -> Assembly {
    let is_other = |effect: &Arc<dyn Effect>| effect.roles().stresses.is_none() && effect.roles().spins.is_none();
    let effects = model.acting(&assembly.stage).into_iter().filter(is_other).collect();
    let pairs = state.contacts.pairs.list.clone();
    let mut others = Assembly::of(effects, &assembly.stage, assembly.system.pattern.dof_map.clone(), model, pairs);
    others.evaluate(state, Weights::STIFFNESS, None);
    others
}

/// Nodes in groups that are connected by these pairs of node blocks.
fn groups(
    pattern: &Pattern,
    places: &[(Node, Vec3)],
    pairs: impl Iterator<Item = [usize; 2]>,
) -> Vec<Vec<(Node, Vec3)>> {
    let node_blocks = &pattern.node_blocks;
    let mut group_of: Vec<usize> = (0..node_blocks.count()).collect();
    fn root(group_of: &mut [usize], mut group: usize) -> usize {
        while group_of[group] != group {
            group_of[group] = group_of[group_of[group]];
            group = group_of[group];
        }
        group
    }
    let mut join = |a: usize, b: usize| {
        let (a, b) = (root(&mut group_of, a), root(&mut group_of, b));
        group_of[a.max(b)] = a.min(b);
    };
    pairs.for_each(|[a, b]| join(a, b));
    // Nodes that share a displacement are one group.
    places.iter().for_each(|(node, _)| join(node_blocks.of(node.u), node_blocks.of(node.p)));
    let mut groups: BTreeMap<usize, Vec<(Node, Vec3)>> = BTreeMap::new();
    for &(node, place) in places {
        groups.entry(root(&mut group_of, node_blocks.of(node.u))).or_default().push((node, place));
    }
    groups.into_values().collect()
}

/// A body in a state: nodes that move rigidly together.
#[derive(Clone, Copy)]
struct Body<'p> {
    nodes: &'p [(Node, Vec3)],
    centre: Vec3,
    /// The distance of the farthest node from the centre; turns are measured by what they move, so
    /// that all motions compare
    extent: f64,
}

impl<'p> Body<'p> {
    fn new(nodes: &'p [(Node, Vec3)], model: &Model, state: &State) -> Self {
        let now = |(node, place): &(Node, Vec3)| *place + state.q[node.u as usize];
        let centre = nodes.iter().fold(Vec3::ZERO, |sum, node| sum + now(node)) * (1.0 / nodes.len() as f64);
        let extent = nodes.iter().map(|node| (now(node) - centre).norm()).fold(0.0, f64::max);
        Self { nodes, centre, extent: if extent > 0.0 { extent } else { model.length } }
    }

    /// The size of a motion as it is measured.
    fn unit(&self, number: usize) -> f64 {
        if number < 3 { 1.0 } else { 1.0 / self.extent }
    }

    /// A rigid motion of a node: its displacement and the change of its rotation vector.
    fn moved(&self, (node, place): &(Node, Vec3), number: usize, state: &State) -> (Vec3, Vec3) {
        let axis = Vec3::UNIT[number % 3];
        if number < 3 {
            return (axis, Vec3::ZERO);
        }
        let from_centre = *place + state.q[node.u as usize] - self.centre;
        let rotation = Rotation::new(state.q[node.p as usize]);
        (axis.cross(from_centre), rotation.t_inverse() * rotation.r.transpose_mul(axis))
    }
}

/// A free part of a structure in a state: a body, or bodies that something else than beams connects.
#[derive(Clone)]
struct FreePart<'p> {
    bodies: Vec<Body<'p>>,
    /// The forces and the stiffness that are looked at
    system: &'p System,
    /// Those of all effects
    whole: &'p System,
    state: &'p State,
}

impl<'p> FreePart<'p> {
    fn new(bodies: &[&'p [(Node, Vec3)]], system: &'p System, model: &Model, state: &'p State) -> Self {
        let bodies = bodies.iter().map(|nodes| Body::new(nodes, model, state)).collect();
        Self { bodies, system, whole: system, state }
    }

    /// The combinations of the columns of `allowed` against which nothing acts; `None` where there are none. `fields`: see
    /// [`Self::fields`].
    fn unresisted(&self, fields: &[Vec<f64>], allowed: DMatrix<f64>) -> Option<DMatrix<f64>> {
        let resisted = self.resisted(fields, &allowed);
        // Numbers without a square have no decomposition.
        let decomposed = SVD::try_new(resisted, false, true, f64::EPSILON, MOST_SWEEPS);
        let SVD { singular_values, v_t, .. } = decomposed?;
        let v = v_t?.transpose();
        let is_free = |k: &usize| singular_values[*k] <= NO_FORCE;
        let free: Vec<_> = (0..singular_values.len()).filter(is_free).map(|k| v.column(k).into_owned()).collect();
        (!free.is_empty()).then(|| allowed * DMatrix::from_columns(&free))
    }

    /// The rigid motions of the bodies, one number an equation each.
    fn fields(&self) -> Vec<Vec<f64>> {
        self.bodies.iter().flat_map(|body| (0..MOTIONS).map(|number| self.field(body, number))).collect()
    }

    /// The Gram matrix of what the motions do to held directions.
    fn held(&self) -> DMatrix<f64> {
        let dof_map = &self.system.pattern.dof_map;
        let count = MOTIONS * self.bodies.len();
        let mut held = DMatrix::<f64>::zeros(count, count);
        for (body, first) in self.bodies.iter().zip((0..).step_by(MOTIONS)) {
            for node in body.nodes {
                let held_parts: [[f64; 6]; MOTIONS] = std::array::from_fn(|number| {
                    let (u, p) = body.moved(node, number, self.state);
                    let u = dof_map.held_part(node.0.u, u);
                    let p = dof_map.held_part(node.0.p, p) * body.extent;
                    let [a, b] = [u.0, p.0].map(|v| v.map(|v| v * body.unit(number)));
                    [a[0], a[1], a[2], b[0], b[1], b[2]]
                });
                add_gram(&mut held, first, &held_parts);
            }
        }
        held
    }

    /// A motion of a body, one number an equation.
    fn field(&self, body: &Body, number: usize) -> Vec<f64> {
        let dof_map = &self.system.pattern.dof_map;
        let mut out = vec![0.0; dof_map.count()];
        let mut motion = vec![Vec3::ZERO; self.state.q.len()];
        for node in body.nodes {
            let (u, p) = body.moved(node, number, self.state);
            motion[node.0.u as usize] = u * body.unit(number);
            motion[node.0.p as usize] = p * body.unit(number);
        }
        dof_map.gather(|slot| motion[slot], &mut out);
        out
    }

    /// The forces against the combinations of `fields` with the columns of `allowed`, each over its terms: the triangle R
    /// of their factorisation Q R.
    fn resisted(&self, fields: &[Vec<f64>], allowed: &DMatrix<f64>) -> DMatrix<f64> {
        let system = self.system;
        let count = system.pattern.dof_map.count();
        let sizes: Vec<f64> = system.values.iter().map(|v| v.abs()).collect();
        let all_sizes: Vec<f64> = self.whole.values.iter().map(|v| v.abs()).collect();
        let usual: Vec<f64> =
            (0..count).map(|k| fields.iter().map(|field| field[k].abs()).fold(0.0, f64::max)).collect();
        let mut scale = vec![0.0_f64; count];
        let mut forces: Vec<Vec<f64>> = Vec::new();
        for (k, motion) in combine(fields, allowed).iter().enumerate() {
            let mut force = system.multiply(&system.values, motion);
            let expected = match &self.bodies[..] {
                [body] => self.turned_forces(body, motion, Vec3([3, 4, 5].map(|i| allowed[(i, k)] / body.extent))),
                // Of bodies that move against each other nothing is known of the forces between them.
                _ => vec![0.0; count],
            };
            force.iter_mut().zip(&expected).for_each(|(force, expected)| *force -= expected);
            let absolute: Vec<f64> =
                motion.iter().zip(&usual).map(|(v, usual)| v.abs().max(LEAST_PART * usual)).collect();
            let terms = system.multiply(&sizes, &absolute);
            let all_terms = self.whole.multiply(&all_sizes, &absolute);
            scale
                .iter_mut()
                .zip(terms.iter().zip(&all_terms))
                .zip(&expected)
                .for_each(|((scale, (term, all)), e)| *scale = scale.max(term + e.abs()).max(LEAST_OF_ALL * all));
            forces.push(force);
        }
        // Rows without terms are none; there are at least as many rows as columns.
        let mut rows: Vec<usize> = (0..count).filter(|&row| scale[row] > 0.0).collect();
        let (terms, columns) = (rows.len(), forces.len());
        rows.resize(terms.max(columns), 0);
        let over_terms = |k: usize, column: usize| {
            let row = rows[k];
            if k < terms { forces[column][row] / scale[row] } else { 0.0 }
        };
        // Squares would lose half of the digits: the triangle of a factorisation does not.
        DMatrix::from_fn(rows.len(), columns, over_terms).qr().r()
    }

    /// The change of the forces on a body where they turn with it, one number an equation.
    fn turned_forces(&self, body: &Body, motion: &[f64], turn: Vec3) -> Vec<f64> {
        let dof_map = &self.system.pattern.dof_map;
        let mut field = vec![Vec3::ZERO; self.state.q.len()];
        let mut change = field.clone();
        dof_map.scatter(motion, None, &mut field);
        for (node, _) in body.nodes {
            let (u, p) = (node.u as usize, node.p as usize);
            change[u] = turn.cross(self.system.total(u));
            let rotation = Rotation::new(self.state.q[p]);
            let moment = rotation.t_inverse().transpose_mul(self.system.total(p));
            change[p] = rotation.c2(moment) * field[p];
        }
        let mut out = vec![0.0; dof_map.count()];
        dof_map.gather(|slot| change[slot], &mut out);
        out
    }
}

/// The sums of fields with the coefficients of each column.
fn combine(fields: &[Vec<f64>], coefficients: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let sum = |column: usize| {
        let mut sum = vec![0.0; fields[0].len()];
        for (number, field) in fields.iter().enumerate() {
            sum.iter_mut().zip(field).for_each(|(sum, v)| *sum += coefficients[(number, column)] * v);
        }
        sum
    };
    (0..coefficients.ncols()).map(sum).collect()
}

/// Adds the products of columns to the square on the diagonal that begins at `first`.
fn add_gram(gram: &mut DMatrix<f64>, first: usize, columns: &[[f64; 6]; MOTIONS]) {
    for i in 0..MOTIONS {
        for j in 0..MOTIONS {
            gram[(first + i, first + j)] += columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum::<f64>();
        }
    }
}

/// The vectors, as columns, whose squares a Gram matrix makes no larger than `least`; `None` where
/// there are none.
fn null_space(gram: DMatrix<f64>, least: f64) -> Option<DMatrix<f64>> {
    let eigen = gram.symmetric_eigen();
    let small: Vec<_> = (0..eigen.eigenvalues.len()).filter(|&k| eigen.eigenvalues[k] <= least).collect();
    let columns: Vec<_> = small.into_iter().map(|k| eigen.eigenvectors.column(k).into_owned()).collect();
    (!columns.is_empty()).then(|| DMatrix::from_columns(&columns))
}
