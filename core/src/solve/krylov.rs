//! Eigenvalues of largest magnitude of a linear operator, by projection onto a block Krylov space.
//!
//! Blocks find multiple eigenvalues, such as the bending modes of a round section. The basis is
//! orthonormal in an inner product x . W y in which the operator is symmetric, if there is one.

use crate::interrupt;
use crate::scalar::{LANES, Lanes};
use crate::threads;
use faer::linalg::solvers::{Eigen, SelfAdjointEigen};
use faer::{Mat, Side};
use nalgebra::Complex;

/// A linear operator with an inner product.
pub trait Operator {
    /// Length of its vectors
    fn size(&self) -> usize;
    /// Image of a vector; `None` if the computation fails or is interrupted.
    fn apply(&mut self, x: &[f64]) -> Option<Vec<f64>>;
    /// W x, with the possibly semidefinite W of the inner product.
    fn weigh(&mut self, x: &[f64]) -> Vec<f64>;
    /// True if the operator is symmetric in the inner product
    fn is_symmetric(&self) -> bool;
}

/// Eigenvalues of an operator, of descending magnitude, with their eigenvectors.
#[derive(Default)]
pub struct Spectrum {
    /// Eigenvalues
    pub(crate) values: Vec<Complex<f64>>,
    /// Coordinates of each eigenvector in the basis
    coordinates: Vec<Vec<Complex<f64>>>,
    space: KrylovSpace,
    /// True if one eigenvalue was enough: the others may not have converged
    pub(crate) was_enough: bool,
}

/// Size of the basis of a rough estimate of eigenvalues
const ROUGH_BASIS_SIZE: usize = 12;
/// Number of vectors in a block
const BLOCK_SIZE: usize = 6;
/// Size of a projection above which its eigenvalues may take long, and have a thread of their own so
/// that a request to stop need not wait for them
const LONG_PROJECTION: usize = 100;
/// Relative change of eigenvalues between two projections at which they have converged
const EIGENVALUE_TOLERANCE: f64 = 1e-11;
/// Relative change between two projections of an eigenvalue that is enough
const ENOUGH_TOLERANCE: f64 = 1e-8;
/// Vectors that orthogonalisation reduces to this part of their norm are linearly dependent on the
/// basis.
const DEPENDENT_NORM_RATIO: f64 = 1e-11;

/// The `wanted` eigenvalues of largest magnitude, descending; fewer if the space has fewer
/// dimensions. `None` if an image cannot be computed, or after a request to stop.
pub fn largest_eigenvalues(operator: &mut dyn Operator, wanted: usize) -> Option<Spectrum> {
    largest_eigenvalues_until(operator, wanted, &|_| false)
}

/// Like [`largest_eigenvalues`], but the search ends as soon as an eigenvalue has converged for
/// which `is_enough`; the others may not have converged then.
pub fn largest_eigenvalues_until(
    operator: &mut dyn Operator,
    wanted: usize,
    is_enough: &dyn Fn(Complex<f64>) -> bool,
) -> Option<Spectrum> {
    let most = operator.size().min(24 * wanted + 160);
    eigenvalues_within(operator, wanted, most, is_enough)
}

/// Rough estimates of the eigenvalues of largest magnitude from a few images. `None` if an image
/// cannot be computed, or after a request to stop.
pub fn roughly_largest_eigenvalues(operator: &mut dyn Operator) -> Option<Vec<Complex<f64>>> {
    let most = operator.size().min(ROUGH_BASIS_SIZE);
    eigenvalues_within(operator, most, most, &|_| false).map(|spectrum| spectrum.values)
}

/// Eigenvalues from a basis of at most `most` vectors, see [`largest_eigenvalues_until`]. `None` if
/// an image cannot be computed, or after a request to stop.
fn eigenvalues_within(
    operator: &mut dyn Operator,
    wanted: usize,
    most: usize,
    is_enough: &dyn Fn(Complex<f64>) -> bool,
) -> Option<Spectrum> {
    let size = operator.size();
    if size == 0 {
        return Some(Spectrum::default());
    }
    let mut space = KrylovSpace::default();
    let mut block: Vec<Vec<f64>> = Vec::new();
    for k in 0..BLOCK_SIZE.min(size) {
        block.push(operator.apply(&start(size, k))?);
    }
    let mut last: Vec<Complex<f64>> = Vec::new();
    // Eigenvalues of the projection are computed whenever the basis has grown by a quarter.
    let mut look = 0;
    loop {
        let first = space.basis.len();
        for vector in block.drain(..) {
            space.add(operator, vector, most);
            if interrupt::is_requested() {
                return None;
            }
        }
        if space.basis.is_empty() {
            return Some(Spectrum::default());
        }
        if space.basis.len() == first {
            return space.into_spectrum(operator.is_symmetric(), wanted);
        }
        for k in first..space.basis.len() {
            if interrupt::is_requested() {
                return None;
            }
            let image = operator.apply(&space.basis[k])?;
            space.images.push(image.clone());
            block.push(image);
        }
        space.project(first);
        if interrupt::is_requested() {
            return None;
        }
        if space.basis.len() < look && space.basis.len() < most {
            continue;
        }
        look = space.basis.len() + space.basis.len() / 4;
        // A few more eigenvalues than wanted must converge, lest the second of a pair is missed.
        let guard = wanted + BLOCK_SIZE;
        let now = space.eigenvalues(operator.is_symmetric(), guard)?;
        let same = |(a, b): (&Complex<f64>, &Complex<f64>)| (a - b).norm() <= EIGENVALUE_TOLERANCE * a.norm();
        let still =
            now.len() == last.len() && now.len() >= wanted.min(size) && now.iter().zip(&last).take(guard).all(same);
        let near = |a: &Complex<f64>, b: &Complex<f64>| (a - b).norm() <= ENOUGH_TOLERANCE * a.norm();
        let suffices = now.iter().zip(&last).any(|(a, b)| near(a, b) && is_enough(*a));
        if still || suffices || space.basis.len() >= most {
            let was_enough = suffices && !still;
            let spectrum = space.into_spectrum(operator.is_symmetric(), wanted)?;
            return Some(Spectrum { was_enough, ..spectrum });
        }
        last = now;
    }
}

impl Spectrum {
    /// Real and imaginary part of an eigenvector.
    pub fn vector(&self, number: usize) -> [Vec<f64>; 2] {
        self.combine(number, &self.space.basis)
    }

    /// Relative residual of an eigenvector, |A x - theta x| over |theta x|, in the norm of the
    /// inner product.
    pub fn residual(&self, operator: &mut dyn Operator, number: usize) -> f64 {
        let theta = self.values[number];
        let [re, im] = self.vector(number);
        let [mut left_re, mut left_im] = self.combine(number, &self.space.images);
        for k in 0..re.len() {
            left_re[k] -= theta.re * re[k] - theta.im * im[k];
            left_im[k] -= theta.re * im[k] + theta.im * re[k];
        }
        let mut squared = |x: &[f64]| dot(x, &operator.weigh(x)).max(0.0);
        let left = squared(&left_re) + squared(&left_im);
        let all = squared(&re) + squared(&im);
        (left / all).sqrt() / theta.norm()
    }

    fn combine(&self, number: usize, vectors: &[Vec<f64>]) -> [Vec<f64>; 2] {
        let length = vectors.first().map_or(0, Vec::len);
        let mut out = [vec![0.0; length], vec![0.0; length]];
        for (coordinate, vector) in self.coordinates[number].iter().zip(vectors) {
            for (out, part) in out.iter_mut().zip([coordinate.re, coordinate.im]).filter(|(_, part)| *part != 0.0) {
                out.iter_mut().zip(vector).for_each(|(out, v)| *out += part * v);
            }
        }
        out
    }
}

/// A pseudo-random start vector with entries in [-0.5, 0.5).
fn start(size: usize, number: usize) -> Vec<f64> {
    // The generator is splitmix64.
    let mut state = 0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(number as u64 + 1);
    let mut next = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..size).map(|_| next()).collect()
}

#[derive(Default)]
struct KrylovSpace {
    basis: Vec<Vec<f64>>,
    /// W times the basis
    weighed: Vec<Vec<f64>>,
    /// The operator applied to the basis
    images: Vec<Vec<f64>>,
    /// Projected operator by rows: basis . W images
    projected: Vec<Vec<f64>>,
}

/// Inner product in vector lanes, whose sums are independent.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let sums = a.iter().zip(b).fold(Lanes([0.0; LANES]), |sums, (x, y)| sums + Lanes(*x) * Lanes(*y));
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    sums.0.iter().sum::<f64>() + rest
}

impl KrylovSpace {
    /// Orthogonalises a vector against the basis and adds it, normalised, unless it is linearly
    /// dependent.
    fn add(&mut self, operator: &mut dyn Operator, mut vector: Vec<f64>, most: usize) {
        if self.basis.len() >= most {
            return;
        }
        // The squared part of the vector along the basis
        let mut squared = 0.0;
        // Two passes suffice (Kahan, Parlett).
        for _ in 0..2 {
            for (own, heavy) in self.basis.iter().zip(&self.weighed) {
                if interrupt::is_requested() {
                    return;
                }
                let along = dot(heavy, &vector);
                squared += along * along;
                vector.iter_mut().zip(own).for_each(|(v, o)| *v -= along * o);
            }
        }
        let mut weighed = operator.weigh(&vector);
        let length = dot(&vector, &weighed).max(0.0).sqrt();
        if length.is_nan() || length <= DEPENDENT_NORM_RATIO * squared.sqrt() {
            return;
        }
        vector.iter_mut().for_each(|v| *v /= length);
        weighed.iter_mut().for_each(|v| *v /= length);
        self.basis.push(vector);
        self.weighed.push(weighed);
    }

    /// Extends the projected operator by the rows and columns of the basis vectors from `first` on.
    fn project(&mut self, first: usize) {
        for (i, heavy) in self.weighed.iter().enumerate() {
            if i >= first {
                self.projected.push(Vec::new());
            }
            if interrupt::is_requested() {
                return;
            }
            let known = self.projected[i].len();
            for image in &self.images[known..] {
                self.projected[i].push(dot(heavy, image));
            }
        }
    }

    fn symmetric_part(&self) -> Mat<f64> {
        let n = self.projected.len();
        Mat::from_fn(n, n, |i, j| 0.5 * (self.projected[i][j] + self.projected[j][i]))
    }

    fn matrix(&self) -> Mat<f64> {
        let n = self.projected.len();
        Mat::from_fn(n, n, |i, j| self.projected[i][j])
    }

    /// `None` after a request to stop.
    fn eigenvalues(&self, is_symmetric: bool, wanted: usize) -> Option<Vec<Complex<f64>>> {
        let mut values = match is_symmetric {
            true => on_projection(self.symmetric_part(), symmetric_eigenvalues)?,
            false => on_projection(self.matrix(), eigenvalues)?,
        };
        values.sort_by(largest_first);
        values.truncate(wanted);
        Some(values)
    }

    /// `None` after a request to stop.
    fn into_spectrum(self, is_symmetric: bool, wanted: usize) -> Option<Spectrum> {
        let mut pairs = match is_symmetric {
            true => on_projection(self.symmetric_part(), symmetric_eigenpairs)?,
            false => on_projection(self.matrix(), eigenpairs)?,
        };
        pairs.sort_by(|a, b| largest_first(&a.0, &b.0));
        pairs.truncate(wanted);
        let (values, coordinates) = pairs.into_iter().unzip();
        Some(Spectrum { values, coordinates, space: self, was_enough: false })
    }
}

/// An eigenvalue of a projection with its eigenvector.
type Eigenpair = (Complex<f64>, Vec<Complex<f64>>);

/// A result of `solve` for a projection. `None` after a request to stop.
fn on_projection<R: Send + 'static>(projection: Mat<f64>, solve: fn(&Mat<f64>) -> R) -> Option<R> {
    match projection.nrows() > LONG_PROJECTION {
        true => threads::unless_interrupted(move || solve(&projection)),
        false => Some(solve(&projection)),
    }
}

fn symmetric_eigenvalues(matrix: &Mat<f64>) -> Vec<Complex<f64>> {
    let values = matrix.self_adjoint_eigenvalues(Side::Lower).unwrap_or_default();
    values.into_iter().map(|value| Complex::new(value, 0.0)).collect()
}

fn eigenvalues(matrix: &Mat<f64>) -> Vec<Complex<f64>> {
    matrix.eigenvalues().unwrap_or_default()
}

fn symmetric_eigenpairs(matrix: &Mat<f64>) -> Vec<Eigenpair> {
    match SelfAdjointEigen::new(matrix.as_ref(), Side::Lower) {
        Ok(eigen) => {
            let vector = |k: usize| eigen.U().col(k).iter().map(|&v| Complex::new(v, 0.0)).collect();
            (0..matrix.nrows()).map(|k| (Complex::new(eigen.S()[k], 0.0), vector(k))).collect()
        }
        Err(_) => Vec::new(),
    }
}

fn eigenpairs(matrix: &Mat<f64>) -> Vec<Eigenpair> {
    match Eigen::new_from_real(matrix.as_ref()) {
        Ok(eigen) => {
            let vector = |k: usize| eigen.U().col(k).iter().copied().collect();
            (0..matrix.nrows()).map(|k| (eigen.S()[k], vector(k))).collect()
        }
        Err(_) => Vec::new(),
    }
}

fn largest_first(a: &Complex<f64>, b: &Complex<f64>) -> std::cmp::Ordering {
    b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im))
}
