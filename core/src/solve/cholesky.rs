//! Sparse Cholesky factorisation by faer, with an order of elimination by nodes.
//!
//! The unknowns of a node are one or several; the matrix is a graph of nodes, with a dense block
//! for each pair of neighbours.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::mat::MatMut;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Par, Side};

/// The factorisation by single entries. That by dense blocks is up to four times as fast for large
/// meshes of laminates, and no faster for others, but uses fused multiply-add where a processor has
/// it: its last digits depend on the machine.
const KERNELS: SupernodalThreshold = SupernodalThreshold::FORCE_SIMPLICIAL;

/// Neighbours of each node with a smaller or the same number, ascending; the last is the node.
#[derive(Clone, Debug)]
pub struct NodeGraph {
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl NodeGraph {
    /// The graph in which the nodes of each clique are neighbours.
    pub fn new<'a>(nodes: usize, cliques: impl Iterator<Item = &'a [u32]> + Clone) -> Self {
        let mut counts = vec![0_u32; nodes + 1];
        for clique in cliques.clone() {
            for &node in clique {
                counts[node as usize + 1] += clique.iter().filter(|&&other| other <= node).count() as u32;
            }
        }
        for node in 0..nodes {
            counts[node + 1] += counts[node];
        }
        let mut next = counts.clone();
        let mut with_repeats = vec![0_u32; counts[nodes] as usize];
        for clique in cliques {
            for &node in clique {
                for &other in clique.iter().filter(|&&other| other <= node) {
                    with_repeats[next[node as usize] as usize] = other;
                    next[node as usize] += 1;
                }
            }
        }
        let mut starts = vec![0];
        let mut neighbours = Vec::new();
        for node in 0..nodes {
            let list = &mut with_repeats[counts[node] as usize..counts[node + 1] as usize];
            list.sort_unstable();
            for &other in list.iter() {
                if neighbours.len() == starts[node] as usize || neighbours.last() != Some(&other) {
                    neighbours.push(other);
                }
            }
            starts.push(neighbours.len() as u32);
        }
        Self { starts, neighbours }
    }

    /// The number of nodes.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The number of pairs, with those of a node and itself.
    pub fn pairs(&self) -> usize {
        self.neighbours.len()
    }

    /// Neighbours of a node with a smaller or the same number, and the position of the first pair.
    pub fn of(&self, node: usize) -> (usize, &[u32]) {
        let start = self.starts[node] as usize;
        (start, &self.neighbours[start..self.starts[node + 1] as usize])
    }

    /// The position of a pair, `other` not larger than `node`.
    pub fn pair(&self, node: u32, other: u32) -> usize {
        let (start, list) = self.of(node as usize);
        start + list.partition_point(|&neighbour| neighbour < other)
    }

    /// An order of elimination with little fill: the node of each step.
    pub fn elimination_order(&self) -> Option<Vec<u32>> {
        let n = self.count();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.neighbours);
        let mut order = vec![0_u32; n];
        let mut step_of = vec![0_u32; n];
        let scratch = amd::order_scratch::<u32>(n, self.pairs());
        let mut memory = MemBuffer::try_new(scratch).ok()?;
        amd::order(&mut order, &mut step_of, pattern, Default::default(), MemStack::new(&mut memory)).ok()?;
        Some(order)
    }
}

/// The matrix of some of the unknowns of each node, in compressed columns of the upper triangle.
struct UpperColumns {
    starts: Vec<u32>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl UpperColumns {
    /// Takes unknowns `components` of all nodes from blocks of 3 x 3, which are by pairs (node,
    /// other) with rows of `other` and columns of `node`.
    fn new(graph: &NodeGraph, blocks: &[[f64; 9]], components: &[usize]) -> Self {
        let size = components.len();
        let mut columns = Self { starts: vec![0], rows: Vec::new(), values: Vec::new() };
        for node in 0..graph.count() {
            let (start, neighbours) = graph.of(node);
            for (column, &of_column) in components.iter().enumerate() {
                for (k, &other) in neighbours.iter().enumerate() {
                    let rows = if other as usize == node { column + 1 } else { size };
                    for (row, &of_row) in components[..rows].iter().enumerate() {
                        columns.rows.push((other as usize * size + row) as u32);
                        columns.values.push(blocks[start + k][3 * of_row + of_column]);
                    }
                }
                columns.starts.push(columns.rows.len() as u32);
            }
        }
        columns
    }

    fn matrix(&self) -> SparseColMatRef<'_, u32, f64> {
        let n = self.starts.len() - 1;
        SparseColMatRef::new(SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.rows), &self.values)
    }
}

/// The factors of a symmetric positive definite matrix of some unknowns of each node.
pub struct Cholesky {
    components: Vec<usize>,
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
}

impl Cholesky {
    /// Factorises the matrix of the unknowns `components` (0 to 2) of all nodes. `blocks` are by
    /// pairs of the graph: entry 3 i + j couples unknown i of the neighbour with unknown j of the
    /// node. `None` if the matrix is not positive definite.
    pub fn new(graph: &NodeGraph, order: &[u32], blocks: &[[f64; 9]], components: &[usize]) -> Option<Self> {
        let columns = UpperColumns::new(graph, blocks, components);
        let size = components.len() as u32;
        let forward: Vec<u32> = order.iter().flat_map(|&node| (0..size).map(move |i| node * size + i)).collect();
        let mut inverse = vec![0_u32; forward.len()];
        for (step, &unknown) in forward.iter().enumerate() {
            inverse[unknown as usize] = step as u32;
        }
        let n = forward.len();
        let order = SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n));
        let matrix = columns.matrix();
        let params = CholeskySymbolicParams { supernodal_flop_ratio_threshold: KERNELS, ..Default::default() };
        let symbolic = factorize_symbolic_cholesky(matrix.symbolic(), Side::Upper, order, params).ok()?;
        let mut values = vec![0.0; symbolic.len_val()];
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).ok()?;
        symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix,
                Side::Upper,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .ok()?;
        Some(Self { components: components.to_vec(), symbolic, values })
    }

    /// Solves for several right-hand sides of three unknowns a node, one after the other in `x`;
    /// unknowns that are not in the matrix are left alone. `None` if memory is not available.
    pub fn solve(&self, x: &mut [Vec<f64>]) -> Option<()> {
        let size = self.components.len();
        let n = self.symbolic.nrows();
        let mut dense = vec![0.0; n * x.len()];
        for (column, x) in x.iter().enumerate() {
            for node in 0..n / size {
                for (i, component) in self.components.iter().enumerate() {
                    dense[column * n + node * size + i] = x[3 * node + component];
                }
            }
        }
        let mut memory = MemBuffer::try_new(self.symbolic.solve_in_place_scratch::<f64>(x.len(), Par::Seq)).ok()?;
        let factors = LltRef::new(&self.symbolic, &self.values);
        let right_sides = MatMut::from_column_major_slice_mut(&mut dense, n, x.len());
        factors.solve_in_place_with_conj(Conj::No, right_sides, Par::Seq, MemStack::new(&mut memory));
        for (column, x) in x.iter_mut().enumerate() {
            for node in 0..n / size {
                for (i, component) in self.components.iter().enumerate() {
                    x[3 * node + component] = dense[column * n + node * size + i];
                }
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_of_nodes_is_solved() {
        // Blocks 4 I on the diagonal, -I beside it, with a coupling of components 1 and 2.
        let cliques: Vec<[u32; 2]> = (0..9).map(|k| [k, k + 1]).collect();
        let graph = NodeGraph::new(10, cliques.iter().map(|clique| clique.as_slice()));
        assert_eq!(graph.pairs(), 19);
        let mut blocks = vec![[0.0; 9]; graph.pairs()];
        for node in 0..10_u32 {
            blocks[graph.pair(node, node)] = [4.0, 0.0, 0.0, 0.0, 4.0, 1.0, 0.0, 1.0, 4.0];
            if node > 0 {
                blocks[graph.pair(node, node - 1)] = [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0];
            }
        }
        let order = graph.elimination_order().unwrap();
        let mut x = vec![(0..30).map(f64::from).collect::<Vec<_>>()];
        let right_side = x[0].clone();
        for components in [vec![0], vec![1, 2]] {
            Cholesky::new(&graph, &order, &blocks, &components).unwrap().solve(&mut x).unwrap();
        }
        for node in 0..10 {
            for i in 0..3 {
                let mut product = 4.0 * x[0][3 * node + i];
                product += [0.0, x[0][3 * node + 2], x[0][3 * node + 1]][i];
                product -= if node > 0 { x[0][3 * node - 3 + i] } else { 0.0 };
                product -= if node < 9 { x[0][3 * node + 3 + i] } else { 0.0 };
                assert!((product - right_side[3 * node + i]).abs() < 1e-12);
            }
        }
    }
}
