//! Eigenvalues of largest magnitude of a linear operator, by projection onto a block Krylov space.
//!
//! Blocks find multiple eigenvalues, such as the bending modes of a round section. The basis is
//! orthonormal in an inner product x . W y in which the operator is symmetric, if there is one.

use crate::interrupt;
use crate::scalar::{Instructions, LANES, Lanes};
use crate::sorting::sort_by;
use crate::threads;
use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, EvdParams, evd_real, evd_scratch};
use faer::linalg::solvers::{SelfAdjointEigen, Solve};
use faer::{Auto, Mat, Par, Side};
use nalgebra::Complex;

/// A linear operator with an inner product.
pub trait Operator {
    /// Length of its vectors
    fn size(&self) -> usize;
    /// Image of a vector x, given with W x; `None` if the computation fails or is interrupted.
    fn apply(&mut self, x: &[f64], weighed: &[f64]) -> Option<Vec<f64>>;
    /// W x, with the possibly semidefinite W of the inner product.
    fn weigh(&mut self, x: &[f64]) -> Vec<f64>;
    /// True if the operator is symmetric in the inner product
    fn is_symmetric(&self) -> bool;
    /// Number of images after which a vector has no part left that the operator maps to zero
    fn rounds(&self) -> usize {
        1
    }
}

/// Eigenvalues of an operator, of descending magnitude, with their eigenvectors.
#[derive(Default)]
pub struct Spectrum {
    /// Eigenvalues
    pub(crate) values: Vec<Complex<f64>>,
    /// Coordinates of each eigenvector in the basis
    coordinates: Vec<Vec<Complex<f64>>>,
    space: KrylovSpace,
    /// True if no eigenvalue that was wanted is missing, of multiple ones at least one
    pub(crate) is_complete: bool,
}

/// The eigenvalues that are looked for first
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum First {
    /// Those of largest magnitude
    Largest,
    /// Those with a positive real part, the largest first, then the others; minor ones are left out
    Positive,
}

/// Size of the basis of a rough estimate of eigenvalues
const ROUGH_BASIS_SIZE: usize = 12;
/// Number of vectors in a block
const BLOCK_SIZE: usize = 6;
/// Number of vectors in a block where multiple eigenvalues need not be counted: two tell apart a
/// conjugate pair that is nearly real
const SMALL_BLOCK_SIZE: usize = 2;
/// Number of basis vectors that are multiplied with another one at a time, which is then read once
const GROUP_SIZE: usize = 4;
/// Size of a projection above which its eigenvalues may take long, and have a thread of their own so
/// that a request to stop need not wait for them
const LONG_PROJECTION: usize = 100;
/// Relative change of eigenvalues between two projections at which they have converged
const EIGENVALUE_TOLERANCE: f64 = 1e-11;
/// Changes of eigenvalues below this part of the largest are round-off. Next to a critical load the largest is 1e8 times
/// as large as the others, of which half of the digits are right.
const ROUND_OFF_OF_LARGEST: f64 = 1e-14;
/// Relative change between two projections at which positive eigenvalues have converged that are looked for first: they
/// may be far from the largest, and are estimates
const ONE_SIDED_TOLERANCE: f64 = 1e-8;
/// The largest part of a positive eigenvalue that the next one is, if it is alone
const NEXT_TO_ONE_ALONE: f64 = 0.5;
/// Relative residual of an eigenvector at which it has converged where its eigenvalue only tells
/// the sign of a growth
const RESIDUAL_TOLERANCE: f64 = 1e-9;
/// Relative residual of a vector of a projection that needs no mending
const GOOD_VECTOR: f64 = 1e-9;
/// Eigenvalues of a projection that differ by less, relative to them, are one multiple eigenvalue.
const SAME_EIGENVALUE: f64 = 1e-7;
/// The shift of inverse iteration beside an eigenvalue, relative to it
const BESIDE_EIGENVALUE: f64 = 1e-12;
/// Inverse iterations for a vector of a multiple eigenvalue
const INVERSE_ITERATIONS: usize = 3;
/// Positive eigenvalues that are smaller than this part of the largest of all are not looked for.
const MINOR: f64 = 1e-4;
/// Vectors that orthogonalisation reduces to this part of their norm are linearly dependent on the
/// basis.
const DEPENDENT_NORM_RATIO: f64 = 1e-11;
/// The part of a vector along the basis after orthogonalisation.
const SMALL_REST: f64 = 1e-4;
/// Passes of an orthogonalisation, at most.
const MOST_PASSES: usize = 5;

/// The `wanted` eigenvalues of largest magnitude, descending; fewer if the space has fewer
/// dimensions. `None` if an image cannot be computed, or after a request to stop.
pub fn largest_eigenvalues(operator: &mut dyn Operator, wanted: usize) -> Option<Spectrum> {
    let most = most_vectors(operator, wanted);
    let (space, _) = converged_space(operator, wanted, most, First::Largest, &|_| false)?;
    space.spectrum(operator.is_symmetric(), wanted)
}

/// The eigenvalues of largest magnitude, descending, `first` the positive ones, so many of them that `is_enough`, but no
/// more than `most_wanted`, or than the space has dimensions. `None` if an image cannot be computed, or after a request
/// to stop.
pub fn leading_eigenvalues_until(
    operator: &mut dyn Operator,
    most_wanted: usize,
    first: First,
    is_enough: &dyn Fn(&[Complex<f64>]) -> bool,
) -> Option<Vec<Complex<f64>>> {
    let most = most_vectors(operator, most_wanted);
    converged_space(operator, most_wanted, most, first, is_enough).map(|(_, values)| values)
}

/// Rough estimates of the eigenvalues of largest magnitude from a few images. `None` if an image
/// cannot be computed, or after a request to stop.
pub fn roughly_largest_eigenvalues(operator: &mut dyn Operator) -> Option<Vec<Complex<f64>>> {
    let most = operator.size().min(ROUGH_BASIS_SIZE);
    let (space, _) = converged_space(operator, most, most, First::Largest, &|_| false)?;
    space.spectrum(operator.is_symmetric(), most).map(|spectrum| spectrum.values)
}

/// The `wanted` eigenvalues of largest magnitude that have converged, descending; of multiple ones
/// there is at least one. The search ends as soon as one has converged for which `is_enough`, and
/// others may be missing then. `None` if an image cannot be computed, or after a request to stop.
pub fn distinct_eigenvalues_until(
    operator: &mut dyn Operator,
    wanted: usize,
    is_enough: &dyn Fn(Complex<f64>) -> bool,
) -> Option<Spectrum> {
    let most = most_vectors(operator, wanted);
    let mut space = KrylovSpace::starting(operator, SMALL_BLOCK_SIZE)?;
    let mut looks = Looks { wanted, ..Looks::default() };
    loop {
        let grows = space.grow(operator)? && space.applied() < most;
        if grows && space.applied() < looks.next {
            continue;
        }
        let pairs = space.pairs(operator.is_symmetric(), wanted)?;
        let is_all = pairs.len() == wanted || space.applied() == space.basis.len();
        let count = pairs.len();
        let converged: Vec<Eigenpair> =
            pairs.into_iter().filter(|(value, x)| space.residual(*value, x) <= RESIDUAL_TOLERANCE).collect();
        let is_complete = is_all && converged.len() == count;
        let is_end = !grows || (is_complete && count == wanted);
        if is_end || converged.iter().any(|(value, _)| is_enough(*value)) {
            return Some(Spectrum { is_complete, ..Spectrum::of(converged, space) });
        }
        looks.plan(space.applied(), converged.len());
    }
}

/// Sizes of a basis at which eigenvectors are computed: few, since that is expensive.
#[derive(Default)]
struct Looks {
    /// Number of eigenvectors that must converge
    wanted: usize,
    /// Size of the basis at the next look
    next: usize,
    /// Size of the basis, and number of eigenvectors that had converged, at the last look
    last: [usize; 2],
}

impl Looks {
    /// The next look is where all will have converged if their number grows on as it has since the
    /// last look, but within an eighth and a half more vectors.
    fn plan(&mut self, size: usize, converged: usize) {
        let [last_size, last_converged] = self.last;
        let came = converged.saturating_sub(last_converged).max(1);
        let more = self.wanted.saturating_sub(converged) * (size - last_size) / came;
        self.next = size + more.clamp(size / 8, size / 2);
        self.last = [size, converged];
    }
}

/// Largest size of a basis.
fn most_vectors(operator: &dyn Operator, wanted: usize) -> usize {
    operator.size().min(24 * wanted + 160)
}

/// A space of at most `most` vectors in which the `wanted` eigenvalues of largest magnitude, `first` the positive ones,
/// have converged, or so many of them that `is_enough`, and those eigenvalues. `None` if an image cannot be computed, or
/// after a request to stop.
fn converged_space(
    operator: &mut dyn Operator,
    wanted: usize,
    most: usize,
    first: First,
    is_enough: &dyn Fn(&[Complex<f64>]) -> bool,
) -> Option<(KrylovSpace, Vec<Complex<f64>>)> {
    let mut space = KrylovSpace::starting(operator, BLOCK_SIZE)?;
    let (tolerance, next_to_it) = match first {
        First::Largest => (EIGENVALUE_TOLERANCE, 0.0),
        First::Positive => (ONE_SIDED_TOLERANCE, NEXT_TO_ONE_ALONE),
    };
    // A few more eigenvalues than wanted must converge, lest the second of a pair is missed.
    let guard = wanted + BLOCK_SIZE;
    let mut last: Vec<Complex<f64>> = Vec::new();
    // Eigenvalues of the projection are computed whenever the basis has grown by a quarter.
    let mut look = 0;
    loop {
        let grows = space.grow(operator)? && space.applied() < most;
        if grows && space.applied() < look {
            continue;
        }
        look = space.applied() + space.applied() / 4;
        let mut now = space.eigenvalues(operator.is_symmetric(), first)?;
        now.truncate(guard);
        let largest = now.iter().map(|theta| theta.norm()).fold(0.0, f64::max);
        let allowed = |theta: &Complex<f64>| (tolerance * theta.norm()).max(ROUND_OFF_OF_LARGEST * largest);
        let same = |&(a, b): &(&Complex<f64>, &Complex<f64>)| (a - b).norm() <= allowed(a);
        let converged = now.iter().zip(&last).take_while(same).count();
        let is_all = converged == now.len().max(last.len()) && converged >= wanted.min(operator.size());
        if is_all || !grows {
            now.truncate(wanted);
            return Some((space, now));
        }
        // The second of a pair is not missed where the next eigenvalue is far smaller.
        let is_alone =
            |count: usize| now.get(count).is_some_and(|next| next.norm() < next_to_it * now[count - 1].norm());
        let leading =
            (1..=converged).rev().find(|&count| count + BLOCK_SIZE <= converged || is_alone(count)).unwrap_or(0);
        if is_enough(&now[..leading]) {
            now.truncate(leading);
            return Some((space, now));
        }
        last = now;
    }
}

impl Spectrum {
    fn of(pairs: Vec<Eigenpair>, space: KrylovSpace) -> Self {
        let (values, coordinates) = pairs.into_iter().unzip();
        Self { values, coordinates, space, is_complete: true }
    }

    /// Finds vectors of multiple eigenvalues again, of which back substitution may give only one well: the
    /// others by inverse iteration. `None` after a request to stop.
    pub fn mend_vectors(&mut self) -> Option<()> {
        let projection = self.space.projection();
        for number in 0..self.values.len() {
            let theta = self.values[number];
            let is_same = |k: &usize| (self.values[*k] - theta).norm() <= SAME_EIGENVALUE * theta.norm();
            let same: Vec<usize> = (0..self.values.len()).filter(is_same).collect();
            let is_good = |k: usize| left_over(&projection, theta, &self.coordinates[k]) <= GOOD_VECTOR;
            if theta.norm() == 0.0 || same.len() < 2 || is_good(number) {
                continue;
            }
            if interrupt::is_requested() {
                return None;
            }
            let mut good: Vec<Vec<Complex<f64>>> = Vec::new();
            for k in same.into_iter().filter(|&k| is_good(k)) {
                let mut vector = self.coordinates[k].clone();
                take_out(&good, &mut vector);
                good.push(vector);
            }
            self.coordinates[number] = vector_beside(&projection, theta, &good, number);
        }
        Some(())
    }

    /// Real and imaginary part of an eigenvector.
    pub fn vector(&self, number: usize) -> [Vec<f64>; 2] {
        let length = self.space.basis.first().map_or(0, Vec::len);
        let mut out = [vec![0.0; length], vec![0.0; length]];
        for (coordinate, vector) in self.coordinates[number].iter().zip(&self.space.basis) {
            for (out, part) in out.iter_mut().zip([coordinate.re, coordinate.im]).filter(|(_, part)| *part != 0.0) {
                out.iter_mut().zip(vector).for_each(|(out, v)| *out += part * v);
            }
        }
        out
    }

    /// Relative residual of an eigenvector, |A x - theta x| over |theta x|, in the norm of the inner
    /// product, with an image of x itself: a basis that round-off has extended shows there. `None`
    /// if the image cannot be computed.
    pub fn residual(&self, operator: &mut dyn Operator, number: usize) -> Option<f64> {
        let theta = self.values[number];
        let [re, im] = self.vector(number);
        let [of_re, of_im] = [image_of(operator, &re)?, image_of(operator, &im)?];
        let left_re: Vec<f64> = (0..re.len()).map(|k| of_re[k] - theta.re * re[k] + theta.im * im[k]).collect();
        let left_im: Vec<f64> = (0..re.len()).map(|k| of_im[k] - theta.re * im[k] - theta.im * re[k]).collect();
        let mut squared = |x: &[f64]| dot(x, &operator.weigh(x)).max(0.0);
        let left = squared(&left_re) + squared(&left_im);
        let all = squared(&re) + squared(&im);
        Some((left / all).sqrt() / theta.norm())
    }
}

/// The image of a vector, which may be zero.
fn image_of(operator: &mut dyn Operator, x: &[f64]) -> Option<Vec<f64>> {
    if x.iter().all(|x| *x == 0.0) {
        return Some(x.to_vec());
    }
    let weighed = operator.weigh(x);
    operator.apply(x, &weighed)
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

/// An orthonormal basis, and the images of its first vectors.
#[derive(Default)]
struct KrylovSpace {
    basis: Vec<Vec<f64>>,
    /// W times the basis
    weighed: Vec<Vec<f64>>,
    /// Coordinates in the basis of the operator applied to each of its first vectors
    images: Vec<Vec<f64>>,
}

/// Inner product in vector lanes, whose sums are independent.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let [product] = products_of([a], b);
    product
}

/// Inner products of some vectors with x.
#[inline(always)]
fn products(vectors: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    let (groups, rest) = vectors.as_chunks::<GROUP_SIZE>();
    let of_groups = groups.iter().flat_map(
        #[inline(always)]
        |group| products_of(group.each_ref().map(Vec::as_slice), x),
    );
    let of_rest = rest.iter().map(
        #[inline(always)]
        |vector| dot(vector, x),
    );
    of_groups.chain(of_rest).collect()
}

/// Inner products of a few vectors with x, each in lanes.
#[inline(always)]
fn products_of<const N: usize>(vectors: [&[f64]; N], x: &[f64]) -> [f64; N] {
    let (lanes, rest) = x.as_chunks::<LANES>();
    let parts = vectors.map(|vector| &vector.as_chunks::<LANES>().0[..lanes.len()]);
    let mut sums = [Lanes([0.0; LANES]); N];
    for (k, x) in lanes.iter().enumerate() {
        for (sum, part) in sums.iter_mut().zip(&parts) {
            *sum += Lanes(part[k]) * Lanes(*x);
        }
    }
    let start = x.len() - rest.len();
    std::array::from_fn(|n| {
        let of_rest: f64 = vectors[n][start..].iter().zip(rest).map(|(a, b)| a * b).sum();
        sums[n].0.iter().sum::<f64>() + of_rest
    })
}

/// Subtracts from x some vectors times their coordinates.
#[inline(always)]
fn subtract(vectors: &[Vec<f64>], coordinates: &[f64], x: &mut [f64]) {
    let (groups, rest) = vectors.as_chunks::<GROUP_SIZE>();
    let (of_groups, of_rest) = coordinates.as_chunks::<GROUP_SIZE>();
    for (group, coordinates) in groups.iter().zip(of_groups) {
        let [a, b, c, d] = group;
        let [of_a, of_b, of_c, of_d] = coordinates;
        for ((((x, a), b), c), d) in x.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *x = *x - of_a * a - of_b * b - of_c * c - of_d * d;
        }
    }
    for (vector, coordinate) in rest.iter().zip(of_rest) {
        for (x, a) in x.iter_mut().zip(vector) {
            *x -= coordinate * a;
        }
    }
}

impl KrylovSpace {
    /// Space of the images of a few pseudo-random vectors.
    fn starting(operator: &mut dyn Operator, block: usize) -> Option<Self> {
        let mut space = Self::default();
        let size = operator.size();
        for number in 0..block.min(size) {
            let mut vector = start(size, number);
            for _ in 0..operator.rounds() {
                let weighed = operator.weigh(&vector);
                vector = operator.apply(&vector, &weighed)?;
            }
            space.add(operator, vector);
        }
        Some(space)
    }

    /// Number of basis vectors whose images are known.
    fn applied(&self) -> usize {
        self.images.len()
    }

    /// Applies the operator to the vectors that were added last, and adds their images; `false` if
    /// that adds no vectors. `None` if an image cannot be computed, or after a request to stop.
    fn grow(&mut self, operator: &mut dyn Operator) -> Option<bool> {
        let block = self.applied()..self.basis.len();
        let end = block.end;
        for k in block {
            if interrupt::is_requested() {
                return None;
            }
            let image = operator.apply(&self.basis[k], &self.weighed[k])?;
            let coordinates = self.add(operator, image);
            self.images.push(coordinates);
        }
        if interrupt::is_requested() { None } else { Some(self.basis.len() > end) }
    }

    /// Orthogonalises a vector against the basis and adds it, normalised, unless it is linearly
    /// dependent; its coordinates in the basis.
    fn add(&mut self, operator: &mut dyn Operator, mut vector: Vec<f64>) -> Vec<f64> {
        let mut coordinates = self.take_basis_out(&mut vector);
        let size = |coordinates: &[f64]| coordinates.iter().map(|c| c * c).sum::<f64>().sqrt();
        let (mut weighed, mut length);
        let mut passes = 1;
        loop {
            let rest = self.take_basis_out(&mut vector);
            coordinates.iter_mut().zip(&rest).for_each(|(coordinate, rest)| *coordinate += rest);
            weighed = operator.weigh(&vector);
            length = dot(&vector, &weighed).max(0.0).sqrt();
            passes += 1;
            // Two passes suffice (Giraud, Langou, Rozloznik, van den Eshof 2005) where the inner product is exact but for
            // round-off of its result. What is left may be less than stiff directions, whose parts cancel, bring into it.
            if size(&rest) <= SMALL_REST * length {
                break;
            }
            if passes == MOST_PASSES {
                return coordinates;
            }
        }
        if length.is_nan() || length <= DEPENDENT_NORM_RATIO * size(&coordinates) {
            return coordinates;
        }
        vector.iter_mut().for_each(|v| *v /= length);
        weighed.iter_mut().for_each(|v| *v /= length);
        self.basis.push(vector);
        self.weighed.push(weighed);
        coordinates.push(length);
        coordinates
    }

    /// Subtracts the part of a vector along the basis, by classical Gram-Schmidt; the coordinates of
    /// that part.
    fn take_basis_out(&self, vector: &mut [f64]) -> Vec<f64> {
        Instructions::here().run(
            #[inline(always)]
            || {
                let coordinates = products(&self.weighed, vector);
                subtract(&self.basis, &coordinates, vector);
                coordinates
            },
        )
    }

    /// Relative residual of an eigenvector of the projection, |A x - theta x| over |theta x|, in the
    /// norm of the inner product: the part of A x outside the vectors with known images.
    fn residual(&self, value: Complex<f64>, coordinates: &[Complex<f64>]) -> f64 {
        let mut outside = vec![Complex::<f64>::default(); self.basis.len() - self.applied()];
        for (coordinate, image) in coordinates.iter().zip(&self.images) {
            let own = image.get(self.applied()..).unwrap_or_default();
            outside.iter_mut().zip(own).for_each(|(sum, entry)| *sum += coordinate * entry);
        }
        let norm = |entries: &[Complex<f64>]| entries.iter().map(Complex::norm_sqr).sum::<f64>().sqrt();
        norm(&outside) / (norm(coordinates) * value.norm())
    }

    /// Projection of the operator onto the vectors with known images.
    fn projection(&self) -> Mat<f64> {
        let n = self.applied();
        Mat::from_fn(n, n, |i, j| self.images[j].get(i).copied().unwrap_or(0.0))
    }

    fn symmetric_part(&self) -> Mat<f64> {
        let whole = self.projection();
        Mat::from_fn(whole.nrows(), whole.ncols(), |i, j| 0.5 * (whole[(i, j)] + whole[(j, i)]))
    }

    /// Eigenvalues of the projection in the order in which they are looked for. `None` after a request to stop.
    fn eigenvalues(&self, is_symmetric: bool, first: First) -> Option<Vec<Complex<f64>>> {
        let mut values = match is_symmetric {
            true => on_projection(self.symmetric_part(), symmetric_eigenvalues)?,
            false => on_projection(self.projection(), eigenvalues)?,
        };
        sort_by(&mut values, largest_first);
        if first == First::Largest {
            return Some(values);
        }
        let least = values.first().map_or(0.0, |largest| MINOR * largest.norm());
        values.retain(|value| value.re <= 0.0 || value.norm() >= least);
        let (mut values, others): (Vec<_>, Vec<_>) = values.into_iter().partition(|value| value.re > 0.0);
        values.extend(others);
        Some(values)
    }

    /// The largest eigenvalues and their vectors. `None` after a request to stop.
    fn spectrum(self, is_symmetric: bool, wanted: usize) -> Option<Spectrum> {
        let pairs = self.pairs(is_symmetric, wanted)?;
        Some(Spectrum::of(pairs, self))
    }

    /// The largest eigenvalues with their eigenvectors. `None` after a request to stop.
    fn pairs(&self, is_symmetric: bool, wanted: usize) -> Option<Vec<Eigenpair>> {
        let mut pairs = match is_symmetric {
            true => on_projection(self.symmetric_part(), symmetric_eigenpairs)?,
            false => on_projection(self.projection(), eigenpairs)?,
        };
        sort_by(&mut pairs, |a, b| largest_first(&a.0, &b.0));
        pairs.truncate(wanted);
        Some(pairs)
    }
}

/// An eigenvalue of a projection with its eigenvector.
type Eigenpair = (Complex<f64>, Vec<Complex<f64>>);

/// A list that `solve` makes of a projection. `None` after a request to stop.
fn on_projection<R: Send + 'static>(projection: Mat<f64>, solve: fn(&Mat<f64>) -> Vec<R>) -> Option<Vec<R>> {
    match projection.nrows() {
        0 => Some(Vec::new()),
        1..=LONG_PROJECTION => Some(solve(&projection)),
        _ => threads::unless_interrupted(move || solve(&projection)),
    }
}

fn symmetric_eigenvalues(matrix: &Mat<f64>) -> Vec<Complex<f64>> {
    let values = matrix.self_adjoint_eigenvalues(Side::Lower).unwrap_or_default();
    values.into_iter().map(|value| Complex::new(value, 0.0)).collect()
}

fn eigenvalues(matrix: &Mat<f64>) -> Vec<Complex<f64>> {
    decompose(matrix, None)
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
    let size = matrix.nrows();
    let mut parts = Mat::zeros(size, size);
    let values = decompose(matrix, Some(&mut parts));
    // A column for a real eigenvalue; two for a pair, the real and the imaginary part of the vector of the first.
    let vector = |k: usize| -> Vec<Complex<f64>> {
        let part = |i: usize| match values[k].im {
            0.0 => Complex::new(parts[(i, k)], 0.0),
            im if im > 0.0 => Complex::new(parts[(i, k)], parts[(i, k + 1)]),
            _ => Complex::new(parts[(i, k - 1)], -parts[(i, k)]),
        };
        (0..size).map(part).collect()
    };
    (0..values.len()).map(|k| (values[k], vector(k))).collect()
}

/// The eigenvalues of a matrix, of conjugate ones that with the positive imaginary part first, and the parts of their
/// vectors; none where they are not found.
///
/// The decomposition does not deflate early: faer 0.24.4 sorts eigenvalues for that, without an end where two pairs are
/// equal but for round-off.
fn decompose(matrix: &Mat<f64>, vectors: Option<&mut Mat<f64>>) -> Vec<Complex<f64>> {
    let size = matrix.nrows();
    let mut params = <EvdParams as Auto<f64>>::auto();
    params.schur.blocking_threshold = usize::MAX;
    let wants = if vectors.is_some() { ComputeEigenvectors::Yes } else { ComputeEigenvectors::No };
    let room = evd_scratch::<f64>(size, ComputeEigenvectors::No, wants, Par::Seq, params.into());
    let (mut re, mut im) = (Diag::zeros(size), Diag::zeros(size));
    let mut memory = MemBuffer::new(room);
    let stack = MemStack::new(&mut memory);
    let vectors = vectors.map(|vectors| vectors.as_mut());
    match evd_real(matrix.as_ref(), re.as_mut(), im.as_mut(), None, vectors, Par::Seq, stack, params.into()) {
        Ok(()) => (0..size).map(|k| Complex::new(re[k], im[k])).collect(),
        Err(_) => Vec::new(),
    }
}

/// An eigenvector of a projection orthogonal to others of the same eigenvalue, by inverse iteration from start
/// vector `number`.
fn vector_beside(
    projection: &Mat<f64>,
    theta: Complex<f64>,
    others: &[Vec<Complex<f64>>],
    number: usize,
) -> Vec<Complex<f64>> {
    let size = projection.nrows();
    let beside = theta * (1.0 + BESIDE_EIGENVALUE);
    let shifted = Mat::from_fn(size, size, |i, j| {
        Complex::from(projection[(i, j)]) - if i == j { beside } else { Complex::default() }
    });
    let factors = shifted.partial_piv_lu();
    let mut vector: Vec<Complex<f64>> = start(size, number).into_iter().map(Complex::from).collect();
    for _ in 0..INVERSE_ITERATIONS {
        take_out(others, &mut vector);
        let solved = factors.solve(Mat::from_fn(size, 1, |i, _| vector[i]));
        vector = (0..size).map(|i| solved[(i, 0)]).collect();
    }
    take_out(others, &mut vector);
    vector
}

/// |P x - theta x| over |theta x|
fn left_over(projection: &Mat<f64>, theta: Complex<f64>, x: &[Complex<f64>]) -> f64 {
    let row = |i: usize| -> Complex<f64> { x.iter().enumerate().map(|(j, x)| x * projection[(i, j)]).sum() };
    let left: f64 = (0..x.len()).map(|i| (row(i) - theta * x[i]).norm_sqr()).sum();
    (left / x.iter().map(Complex::norm_sqr).sum::<f64>()).sqrt() / theta.norm()
}

/// Makes a vector orthogonal to orthonormal others, and its norm one.
fn take_out(others: &[Vec<Complex<f64>>], x: &mut [Complex<f64>]) {
    for other in others {
        let along: Complex<f64> = other.iter().zip(&*x).map(|(other, x)| other.conj() * x).sum();
        x.iter_mut().zip(other).for_each(|(x, other)| *x -= along * other);
    }
    let norm = x.iter().map(Complex::norm_sqr).sum::<f64>().sqrt();
    x.iter_mut().for_each(|x| *x /= norm);
}

fn largest_first(a: &Complex<f64>, b: &Complex<f64>) -> std::cmp::Ordering {
    b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A diagonal matrix, which counts its images.
    struct Diagonal {
        values: Vec<f64>,
        images: usize,
    }

    impl Operator for Diagonal {
        fn size(&self) -> usize {
            self.values.len()
        }

        fn apply(&mut self, x: &[f64], _weighed: &[f64]) -> Option<Vec<f64>> {
            self.images += 1;
            Some(x.iter().zip(&self.values).map(|(x, value)| x * value).collect())
        }

        fn weigh(&mut self, x: &[f64]) -> Vec<f64> {
            x.to_vec()
        }

        fn is_symmetric(&self) -> bool {
            true
        }
    }

    /// As next to a critical load of a column: its eigenvalue is far larger than the others.
    #[test]
    fn eigenvalues_far_below_the_largest_converge_to_its_round_off() {
        for largest in [10.0, 1e4, 1e8, 1e9] {
            let others = (0..600).map(|k| f64::from(k / 2 + 1).powi(-2));
            let mut operator = Diagonal { values: [largest; 2].into_iter().chain(others).collect(), images: 0 };
            let found = leading_eigenvalues_until(&mut operator, 24, First::Largest, &|found| found.len() > 4).unwrap();
            for (found, exact) in found.iter().zip(operator.values.clone()) {
                assert!((found - exact).norm() < 1e-10 * exact + 1e-14 * largest, "{largest}: {found} for {exact}");
            }
            assert!(operator.images < 150, "{largest}: {} images", operator.images);
        }
    }
}
