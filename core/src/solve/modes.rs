//! Small motions x exp(s t) with (s^2 M + s C + K) x = 0 nearest to a shift, each verified.

use super::constraints::Constraints;
use super::krylov::{Operator, Spectrum, distinct_eigenvalues_until, largest_eigenvalues, roughly_largest_eigenvalues};
use super::linear::LinearSolver;
use super::pivots::is_symmetric;
use super::softest::lost_part;
use crate::interrupt;
use crate::system::{Pattern, Symmetry, System};
use nalgebra::{Complex, DMatrix, DVector, SymmetricEigen};

/// A rigid motion is linearly dependent on others if orthogonalisation reduces it to this part of
/// its norm.
const DEPENDENT_RIGID_RATIO: f64 = 1e-6;

/// A motion is massless if its mass is below this part of the heaviest entry of M, with displacements in lengths of the
/// scene and rotations in radians: what a rotation about the axis of a pinned cable moves is round-off.
const NEGLIGIBLE_MASS_RATIO: f64 = 1e-20;

/// Largest relative residual of an eigenvector.
const MAX_RESIDUAL: f64 = 1e-5;

/// Largest relative residual of an eigenvector of a conservative scene, whose frequencies err by
/// its square only; solutions for slender beams leave more than in general.
const MAX_RESIDUAL_OF_SYMMETRIC: f64 = 1e-3;

/// Largest relative imbalance of the energies of a mode.
const MAX_ENERGY_IMBALANCE: f64 = 1e-6;

/// Damping forces below this part of inertia and stiffness forces are taken for zero, with
/// displacements in lengths of the scene and rotations in radians.
const NEGLIGIBLE_DAMPING_RATIO: f64 = 1e-14;

/// The part of a rigid motion that all unknowns count as moved by, where dampers are looked at.
const LEAST_MOVED: f64 = 1e-6;

/// Damping r.C r of a rigid motion below this part of the sum of its terms is round-off.
const NEGLIGIBLE_RATE: f64 = 1e-12;

/// Sweeps for the eigenvalues of a small symmetric matrix, at most.
const MOST_EIGENVALUE_SWEEPS: usize = 1000;

/// The factor by which a rate is raised until K + rate^2 M is positive definite.
const RAISE: f64 = 4.0;
/// How often it is raised at most: beyond 65,000 times the shift M would leave little of K.
const MOST_RAISES: i32 = 8;

/// Inverse iterations after which the slowest motion prevails.
const INVERSE_ITERATIONS: usize = 3;

/// Number of exponents of a rough estimate that are nearly right.
const ROUGH_EXPONENTS: usize = 6;

/// The imaginary part of a decay in a rough estimate, over its size.
const ROUGHLY_REAL: f64 = 1e-3;

/// Eigenvalues of the operator below this part of the largest are round-off where they fail verification, and in rough
/// estimates.
const NEGLIGIBLE_PART: f64 = 1e-10;

/// Relative uncertainty of a frequency by round-off above which it is computed again from strains.
const MAX_UNCERTAINTY: f64 = 1e-9;

/// Motions slower than this part of the shift are free motions: their stiffness is round-off, and
/// energies need not balance.
const FREE_MOTION_RATIO: f64 = 1e-3;

/// Growth above this part of |s| is no round-off.
pub const MIN_GROWTH_RATIO: f64 = 1e-6;

/// Without damping, a motion with growth above this part of |s| has a decaying counterpart.
const MIN_FLUTTER_RATIO: f64 = 1e-6;

/// K, C and M on the pattern of the tangent.
pub struct Matrices {
    /// Stiffness K
    pub(crate) stiffness: Vec<f64>,
    /// Damping C, of dampers and of Coriolis and gyroscopic forces
    pub(crate) damping: Vec<f64>,
    /// Mass M
    pub(crate) mass: Vec<f64>,
}

/// A small motion x exp(s t) with its exponent and uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct SmallMotion {
    /// s = growth + i omega in 1/s, omega >= 0
    pub(crate) exponent: Complex<f64>,
    /// Relative error of |s| that round-off in the stiffness may cause
    pub(crate) uncertainty: f64,
    /// Shape of an uncertain motion of an undamped symmetric problem; of every motion if
    /// [`ModeSearch::keep_shapes`] was called
    pub(crate) shape: Option<ModeShape>,
}

/// The small motions nearest to a shift.
#[derive(Default)]
pub struct Nearest {
    /// Those that are verified, nearest first
    pub(crate) motions: Vec<SmallMotion>,
    /// Exponents of those that failed verification, without what is round-off
    pub(crate) failed: Vec<Complex<f64>>,
}

/// Small motions near a shift, as far as they tell stability.
pub struct GrowthNearby {
    /// Exponents of the motions, without verification; of multiple ones at least one
    pub(crate) exponents: Vec<Complex<f64>>,
    /// Verified motions that grow
    pub(crate) growing: Vec<SmallMotion>,
    /// False if motions may be missing, or seem to grow and could not be verified
    pub(crate) is_sure: bool,
}

/// Shape of a small motion.
#[derive(Clone, Debug, PartialEq)]
pub struct ModeShape {
    /// Unknowns x by equation
    pub(crate) unknowns: Vec<f64>,
    /// Modal mass x . M x
    pub(crate) mass: f64,
    /// True if the problem is undamped and symmetric, and the frequency has lost digits, which can be
    /// found from the shape
    pub(crate) is_lossy: bool,
}

/// Structure of the eigenvalue problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ProblemForm {
    /// K symmetric, C = 0: s^2 is real.
    Symmetric,
    /// C = 0: if s is an exponent, so is -s.
    Undamped,
    /// K symmetric, C skew: if s is an exponent, so is -s.
    Gyroscopic,
    /// No known structure
    General,
}

impl ProblemForm {
    /// Exponent s of an eigenvalue theta of the operator, see [`ModeOperator`].
    fn exponent(self, shift: f64, theta: Complex<f64>) -> Complex<f64> {
        match self {
            Self::Symmetric | Self::Undamped => root(shift * shift - theta.inv()),
            Self::Gyroscopic | Self::General => theta.inv() + shift,
        }
    }
}

/// A rigid motion r that dampers slow down: K r = 0 and r.C r > 0. For different ones r.C r' = 0.
struct DampedRigidMotion {
    /// r, with r.M r = 1
    motion: Vec<f64>,
    /// M r
    momentum: Vec<f64>,
    /// C r
    force: Vec<f64>,
    /// r.C r, 1/time
    rate: f64,
}

/// The eigenvalue problem of a state.
pub struct ModeSearch<'a> {
    /// System whose values become K + shift C + shift^2 M
    system: &'a mut System,
    solver: &'a mut LinearSolver,
    matrices: &'a Matrices,
    form: ProblemForm,
    /// True if motions have their shapes
    keeps_shapes: bool,
    /// Equations of multipliers
    multipliers: Vec<usize>,
    /// Orthonormal rigid motions of free parts that nothing damps, and M times each; all vectors are
    /// orthogonal to them
    rigid: Vec<[Vec<f64>; 2]>,
    /// Rigid motions that dampers slow down
    damped_rigid: Vec<DampedRigidMotion>,
    shift: f64,
    /// True if the system and its factors are those of the shift
    is_ready: bool,
    /// Number of negative pivots of K + shift^2 M, for symmetric K
    negative: Option<usize>,
    /// What makes the energies of K + (shift^2 + `raised`) M positive, where that is known; zero if `negative` is. Square of a
    /// rate.
    raised: Option<f64>,
    /// Number of factorisations so far
    pub(crate) factorisations: u64,
}

impl Matrices {
    /// Writes K + shift C + shift^2 M.
    pub fn combine(&self, shift: f64, out: &mut [f64]) {
        let parts = self.stiffness.iter().zip(&self.damping).zip(&self.mass);
        for (out, ((k, c), m)) in out.iter_mut().zip(parts) {
            *out = k + shift * (c + shift * m);
        }
    }

    /// True if all masses are zero.
    pub fn is_massless(&self) -> bool {
        self.mass.iter().all(|&m| m == 0.0)
    }

    /// Upper bound of the lowest frequency in rad/s: the root of the smallest K_ii / M_ii, or if
    /// there is none, of the largest stiffness over the largest mass.
    pub fn softest_frequency(&self, system: &System) -> f64 {
        let Self { stiffness, mass, .. } = self;
        let mut softest = f64::INFINITY;
        let mut largest = [0.0_f64; 2];
        system.pattern.each_diagonal(|_, place| {
            let k = stiffness[place].abs();
            let m = mass[place];
            largest = [largest[0].max(k), largest[1].max(m)];
            if m > 0.0 && k > 0.0 {
                softest = softest.min(k / m);
            }
        });
        let ratio = if softest.is_finite() { softest } else { largest[0] / largest[1] };
        ratio.sqrt()
    }

    /// Writes K + square M.
    fn combine_squared(&self, square: f64, out: &mut [f64]) {
        for (out, (k, m)) in out.iter_mut().zip(self.stiffness.iter().zip(&self.mass)) {
            *out = k + square * m;
        }
    }
}

impl<'a> ModeSearch<'a> {
    /// From here on motions have their shapes.
    pub fn keep_shapes(&mut self) {
        self.keeps_shapes = true;
    }

    /// Search with these matrices, in the space orthogonal to the `rigid` motions. `scales` are those
    /// that the equations are compared with.
    pub fn new(
        system: &'a mut System,
        solver: &'a mut LinearSolver,
        matrices: &'a Matrices,
        rigid: Vec<Vec<f64>>,
        mut scales: Vec<f64>,
    ) -> Self {
        let multipliers: Vec<_> = solver.constraints().into_iter().flat_map(Constraints::equations).collect();
        // Gaps are neither stiffness nor mass.
        multipliers.iter().for_each(|&equation| scales[equation] = 0.0);
        let [stiffest, heaviest, dampest] = [&matrices.stiffness, &matrices.mass, &matrices.damping]
            .map(|values| largest(&system.pattern, values, &scales));
        let damped = dampest > NEGLIGIBLE_DAMPING_RATIO * (stiffest * heaviest).sqrt();
        let symmetric = is_symmetric(&system.pattern, &matrices.stiffness);
        let form = if !damped {
            if symmetric { ProblemForm::Symmetric } else { ProblemForm::Undamped }
        } else if symmetric && is_skew(system, &matrices.damping, &scales) {
            ProblemForm::Gyroscopic
        } else {
            ProblemForm::General
        };
        let mut search = Self {
            system,
            solver,
            matrices,
            form,
            multipliers,
            keeps_shapes: false,
            rigid: Vec::new(),
            damped_rigid: Vec::new(),
            shift: 0.0,
            is_ready: false,
            negative: None,
            raised: None,
            factorisations: 0,
        };
        let has_mass = |motion: &Vec<f64>| {
            let size = motion.iter().zip(&scales).filter(|(_, scale)| **scale > 0.0);
            let size = size.map(|(part, scale)| (part / scale).abs()).fold(0.0, f64::max);
            let mass = dot(motion, &search.system.multiply(&matrices.mass, motion));
            mass > NEGLIGIBLE_MASS_RATIO * heaviest * size * size
        };
        let rigid: Vec<Vec<f64>> = rigid.into_iter().filter(has_mass).collect();
        rigid.into_iter().for_each(|motion| search.take_out(motion));
        // Only where K is symmetric is r.K = 0, as r.(C x + M s x) = 0 needs it, and only where C is, is r.C = C r.
        if damped && symmetric && is_symmetric(&search.system.pattern, &matrices.damping) {
            search.split_off_damped(&scales);
        }
        search
    }

    /// Number of linearly independent rigid motions.
    pub fn rigid(&self) -> usize {
        self.rigid.len() + self.damped_rigid.len()
    }

    /// Splits rigid motions that dampers slow down off the others.
    fn split_off_damped(&mut self, scales: &[f64]) {
        let rates = self.rates_of_rigid_motions(scales);
        let is_damped = |(_, rate): &(DVector<f64>, f64)| *rate > 0.0;
        if !rates.iter().any(is_damped) {
            return;
        }
        let all = std::mem::take(&mut self.rigid);
        for (parts, rate) in rates {
            let combine = |which: usize| {
                let mut sum = vec![0.0; all[0][which].len()];
                for (factor, motion) in parts.iter().zip(&all) {
                    sum.iter_mut().zip(&motion[which]).for_each(|(sum, part)| *sum += factor * part);
                }
                sum
            };
            let [motion, momentum] = [combine(0), combine(1)];
            if rate > 0.0 {
                let force = self.system.multiply(&self.matrices.damping, &motion);
                self.damped_rigid.push(DampedRigidMotion { motion, momentum, force, rate });
            } else {
                self.rigid.push([motion, momentum]);
            }
        }
    }

    /// Combinations of the rigid motions for which R.C R is diagonal, with its entries: zero where they are round-off,
    /// beside the sum of their terms. In these an unknown that a motion moves by round-off only counts as moved by a
    /// small part. Empty without rigid motions, or where numbers are not finite.
    fn rates_of_rigid_motions(&self, scales: &[f64]) -> Vec<(DVector<f64>, f64)> {
        let products = |values: &[f64], motions: &[Vec<f64>]| {
            let images: Vec<Vec<f64>> = motions.iter().map(|motion| self.system.multiply(values, motion)).collect();
            DMatrix::from_fn(motions.len(), motions.len(), |i, j| dot(&motions[i], &images[j]))
        };
        let sizes = |values: &[f64]| values.iter().map(|value| value.abs()).collect::<Vec<f64>>();
        let damping = &self.matrices.damping;
        let motions: Vec<Vec<f64>> = self.rigid.iter().map(|[motion, _]| motion.clone()).collect();
        let moved = |motion: &Vec<f64>| {
            let parts = motion.iter().zip(scales).filter(|(_, scale)| **scale > 0.0);
            let largest = parts.map(|(part, scale)| (part / scale).abs()).fold(0.0, f64::max);
            let least = scales.iter().map(|scale| LEAST_MOVED * largest * scale);
            motion.iter().zip(least).map(|(part, least)| part.abs().max(least)).collect::<Vec<f64>>()
        };
        let terms = products(&sizes(damping), &motions.iter().map(moved).collect::<Vec<_>>());
        if motions.is_empty() || terms.iter().any(|term| !term.is_finite()) {
            return Vec::new();
        }
        let eigen = SymmetricEigen::try_new(products(damping, &motions), f64::EPSILON, MOST_EIGENVALUE_SWEEPS);
        let Some(SymmetricEigen { eigenvalues, eigenvectors }) = eigen else { return Vec::new() };
        let rate = |k: usize| {
            let parts = eigenvectors.column(k).into_owned();
            let all = (parts.abs().transpose() * &terms * parts.abs())[0];
            (parts, if eigenvalues[k] > NEGLIGIBLE_RATE * all { eigenvalues[k] } else { 0.0 })
        };
        (0..motions.len()).map(rate).collect()
    }

    /// Orthonormalises a rigid motion and adds it, unless it is linearly dependent on the others.
    fn take_out(&mut self, mut motion: Vec<f64>) {
        let before = dot(&motion, &self.system.multiply(&self.matrices.mass, &motion)).max(0.0).sqrt();
        for _ in 0..2 {
            self.project(&mut motion);
        }
        let mut weighed = self.system.multiply(&self.matrices.mass, &motion);
        let size = dot(&motion, &weighed).max(0.0).sqrt();
        if size > DEPENDENT_RIGID_RATIO * before {
            motion.iter_mut().chain(&mut weighed).for_each(|v| *v /= size);
            self.rigid.push([motion, weighed]);
        }
    }

    /// Projects a vector onto the space orthogonal to the rigid motions, without multipliers: neither inertia
    /// nor the energies of motions that keep the constraints depend on these, but round-off would.
    fn project(&self, x: &mut [f64]) {
        self.multipliers.iter().for_each(|&k| x[k] = 0.0);
        for [motion, weighed] in &self.rigid {
            let along = dot(weighed, x);
            x.iter_mut().zip(motion).for_each(|(x, r)| *x -= along * r);
        }
    }

    /// Takes the rigid motions out of the image of an operator of double size, (x, s x/e). A rigid motion r that
    /// nothing damps has the exponent 0 twice, and r.M x = 0 holds for all others. One that is damped has it once, with
    /// (r, 0); all others have r.(C x + M s x) = 0.
    fn project_doubled(&self, x: &mut [f64], second: &mut [f64]) {
        self.project(x);
        self.project(second);
        for DampedRigidMotion { motion, momentum, force, rate } in &self.damped_rigid {
            let part = (dot(force, x) + self.shift * dot(momentum, second)) / rate;
            x.iter_mut().zip(motion).for_each(|(x, r)| *x -= part * r);
        }
    }

    /// Factorises at a shift, unless that was done last; `false` on failure.
    pub fn factorise(&mut self, shift: f64) -> bool {
        if self.is_ready && self.shift == shift {
            return true;
        }
        self.shift = shift;
        self.factorisations += 1;
        if matches!(self.form, ProblemForm::Gyroscopic | ProblemForm::General) {
            self.matrices.combine_squared(shift * shift, &mut self.system.values);
            self.negative = self.solver.negative_beside(self.system);
            self.raised = self.raise(shift);
        }
        self.matrices.combine(shift, &mut self.system.values);
        self.system.revision += 1;
        let done = self.solver.factorise_surely(self.system);
        if self.form == ProblemForm::Symmetric {
            self.negative = self.count(done);
        }
        self.is_ready = done;
        done
    }

    /// The square of the first rate above the shift, if K + shift^2 M is not, for which K + rate^2 M is positive definite;
    /// zero if it is. `None` where K is unsymmetric, or no such rate is found.
    fn raise(&mut self, shift: f64) -> Option<f64> {
        if self.negative? == 0 {
            return Some(0.0);
        }
        for rate in (1..=MOST_RAISES).map(|k| shift * RAISE.powi(k)) {
            if interrupt::is_requested() {
                break;
            }
            self.matrices.combine_squared(rate * rate, &mut self.system.values);
            self.factorisations += 1;
            if self.solver.negative_beside(self.system)? == 0 {
                return Some(rate * rate);
            }
        }
        None
    }

    /// Number of negative pivots of the system; `done` if its factorisation has succeeded.
    fn count(&mut self, done: bool) -> Option<usize> {
        let own = self.solver.negative_of_last().filter(|_| done);
        own.or_else(|| self.solver.negative_beside(self.system))
    }

    /// Number of motions that grow faster than the shift, of symmetric problems; `None` if it is
    /// unknown.
    pub fn growing(&self) -> Option<usize> {
        self.negative.filter(|_| self.form == ProblemForm::Symmetric)
    }

    /// True if K + shift^2 M is positive definite, so that a motion can only grow by damping forces
    /// that supply energy.
    pub fn is_held(&self) -> bool {
        self.negative == Some(0)
    }

    /// True if motions with these exponents, which are nearest to the shift factorised last, include
    /// those near another shift.
    pub fn reaches(&self, exponents: impl Iterator<Item = Complex<f64>>, other: f64) -> bool {
        let shift = Complex::from(self.shift);
        let distance = |exponent: Complex<f64>| match self.form {
            ProblemForm::Symmetric | ProblemForm::Undamped => (exponent * exponent - shift * shift).norm(),
            ProblemForm::Gyroscopic | ProblemForm::General => (exponent - shift).norm(),
        };
        let reach = exponents.map(distance).fold(0.0, f64::max);
        reach >= 2.0 * distance(other.into())
    }

    /// Number of motions with a frequency below `omega` in rad/s or with growth, rigid motions
    /// included, of symmetric problems; `None` if it is unknown. Another shift must be factorised
    /// afterwards.
    pub fn slower(&mut self, omega: f64) -> Option<usize> {
        self.matrices.combine_squared(-omega * omega, &mut self.system.values);
        self.system.revision += 1;
        if self.form != ProblemForm::Symmetric {
            return None;
        }
        self.is_ready = false;
        self.factorisations += 1;
        let done = self.solver.factorise(self.system);
        self.count(done)
    }

    /// Rough frequency of the slowest motion in rad/s, hardly too low, by inverse iteration with K,
    /// which must be the matrix factorised last. `None` if a solution fails.
    pub fn slowest_frequency(&mut self) -> Option<f64> {
        let mut x: Vec<f64> = (0..self.system.pattern.dof_map.count())
            .map(|k| 0.5 + (k as f64 * 0.618_033_988_749_895).fract())
            .collect();
        let mut weighed = self.system.multiply(&self.matrices.mass, &x);
        let mut ratio = f64::NAN;
        let mut before = f64::NAN;
        for _ in 0..INVERSE_ITERATIONS {
            x = weighed;
            if !self.solver.solve_for_modes(self.system, &mut x) {
                return None;
            }
            weighed = self.system.multiply(&self.matrices.mass, &x);
            let size = dot(&x, &weighed).max(0.0).sqrt();
            ratio = before / size;
            before = size;
        }
        Some(ratio.sqrt()).filter(|omega| omega.is_finite() && *omega > 0.0)
    }

    /// Rough magnitudes |s| of the exponents nearest to the shift; `None` if a solution fails.
    pub fn roughly_nearest(&mut self) -> Option<Vec<f64>> {
        let shift = self.shift;
        let form = self.form;
        let inner_product = self.inner_product();
        let values = roughly_largest_eigenvalues(&mut ModeOperator { search: self, inner_product })?;
        // Only the first few are nearly right.
        let largest = self.usual_value().max(largest_of(&values));
        let is_there = |theta: &Complex<f64>| theta.norm() > NEGLIGIBLE_PART * largest;
        // Decays of damped rigid motions may be far slower than all else, and would draw the shift to where digits are lost.
        let mut decays = self.damped_rigid.len();
        let there = values.into_iter().filter(is_there).take(ROUGH_EXPONENTS + decays);
        let mut exponents: Vec<Complex<f64>> = there.map(|theta| form.exponent(shift, theta)).collect();
        exponents.retain(|s| {
            let is_decay = decays > 0 && s.re < 0.0 && s.im.abs() <= ROUGHLY_REAL * s.norm();
            decays -= usize::from(is_decay);
            !is_decay
        });
        Some(exponents.into_iter().map(|s| s.norm()).collect())
    }

    /// The eigenvalue of the operator for a motion of the size of the shift: it has parts of round-off of that size.
    fn usual_value(&self) -> f64 {
        match self.form {
            ProblemForm::Symmetric | ProblemForm::Undamped => 1.0 / (self.shift * self.shift),
            ProblemForm::Gyroscopic | ProblemForm::General => 1.0 / self.shift,
        }
    }

    /// The inner product of the operator at the shift factorised last.
    fn inner_product(&self) -> InnerProduct {
        match (self.form, self.raised) {
            (ProblemForm::Symmetric | ProblemForm::Undamped, _) => InnerProduct::Kinetic,
            (ProblemForm::Gyroscopic | ProblemForm::General, Some(raised)) => InnerProduct::Energies { raised },
            (ProblemForm::Gyroscopic | ProblemForm::General, None) => InnerProduct::Diagonal(self.diagonal()),
        }
    }

    /// The motions nearest to the shift factorised last, nearest first. `None` if a solution fails, or after a request to stop.
    pub fn nearest(&mut self, wanted: usize) -> Option<Nearest> {
        let room = self.room(wanted);
        let inner_product = self.inner_product();
        let mut operator = ModeOperator { search: self, inner_product };
        let mut spectrum = largest_eigenvalues(&mut operator, room)?;
        if !operator.is_symmetric() {
            spectrum.mend_vectors()?;
        }
        let (mut right, mut failed) = (Vec::new(), Vec::new());
        for number in 0..spectrum.values.len() {
            let theta = spectrum.values[number];
            if theta.norm() == 0.0 || !operator.search.is_told(theta) {
                continue;
            }
            if spectrum.residual(&mut operator, number)? <= operator.search.allowed_residual() {
                right.push(number);
            } else {
                failed.push(number);
            }
        }
        self.look_at_stiffness();
        let mut motions = Vec::new();
        for number in right {
            if interrupt::is_requested() {
                return None;
            }
            let Some(motion) = self.motion(&spectrum, number) else {
                failed.push(number);
                continue;
            };
            let twin = self.exponents(spectrum.values[number]).1;
            let twin = twin.map(|exponent| SmallMotion { exponent, ..motion.clone() });
            motions.push(motion);
            motions.extend(twin);
        }
        let largest = self.usual_value().max(largest_of(&spectrum.values));
        let failed = failed.into_iter().map(|number| spectrum.values[number]);
        let failed = failed.filter(|theta| theta.norm() > NEGLIGIBLE_PART * largest);
        let exponents = failed.map(|theta| self.form.exponent(self.shift, theta));
        let failed = exponents.filter(|exponent| exponent.norm() > FREE_MOTION_RATIO * self.shift).collect();
        Some(Nearest { motions, failed })
    }

    /// Motions near the shift factorised last, as far as they tell stability. The search ends as
    /// soon as it finds a motion that grows by more than the part `enough` of its |s|. `None` if a
    /// solution fails, or after a request to stop.
    pub fn growth(&mut self, wanted: usize, enough: f64) -> Option<GrowthNearby> {
        let room = self.room(wanted);
        let shift = self.shift;
        let form = self.form;
        let inner_product = self.inner_product();
        let is_enough = |s: Complex<f64>| s.re > enough * s.norm();
        // What hardly moves may be round-off.
        let moves = |s: Complex<f64>| s.norm() > FREE_MOTION_RATIO * shift;
        let ends = |theta: Complex<f64>| Some(form.exponent(shift, theta)).is_some_and(|s| is_enough(s) && moves(s));
        let spectrum = distinct_eigenvalues_until(&mut ModeOperator { search: self, inner_product }, room, &ends)?;
        let exponents: Vec<Complex<f64>> = spectrum.values.iter().map(|&theta| form.exponent(shift, theta)).collect();
        self.look_at_stiffness();
        let seems = |number: &usize| {
            let exponent = exponents[*number];
            exponent.re > MIN_GROWTH_RATIO * exponent.norm() && self.is_told(spectrum.values[*number])
        };
        let found: Vec<Option<SmallMotion>> =
            (0..exponents.len()).filter(seems).map(|number| self.motion(&spectrum, number)).collect();
        let is_sure = spectrum.is_complete && found.iter().all(Option::is_some);
        let growing: Vec<SmallMotion> = found.into_iter().flatten().collect();
        let is_confirmed = growing.iter().any(|motion| is_enough(motion.exponent));
        if !is_confirmed && spectrum.values.iter().any(|&theta| ends(theta)) {
            // Others may be missing.
            return if self.factorise(shift) { self.growth(wanted, f64::INFINITY) } else { None };
        }
        Some(GrowthNearby { exponents, growing, is_sure })
    }

    /// Relative residual up to which an eigenvector of the operator is a motion.
    fn allowed_residual(&self) -> f64 {
        match self.form {
            ProblemForm::Symmetric => MAX_RESIDUAL_OF_SYMMETRIC,
            ProblemForm::Undamped | ProblemForm::Gyroscopic | ProblemForm::General => MAX_RESIDUAL,
        }
    }

    /// Number of eigenvalues of the operator that belong to this number of motions.
    fn room(&self, motions: usize) -> usize {
        match self.form {
            ProblemForm::Symmetric | ProblemForm::Undamped => motions,
            ProblemForm::Gyroscopic | ProblemForm::General => 2 * motions + 2,
        }
    }

    /// Restores the values of K, with which motions are verified.
    fn look_at_stiffness(&mut self) {
        self.is_ready = false;
        self.system.values.copy_from_slice(&self.matrices.stiffness);
        self.system.revision += 1;
    }

    /// The verified motion of an eigenvalue of the operator; one of each conjugate pair. `None` for
    /// the other, or if verification fails.
    fn motion(&self, spectrum: &Spectrum, number: usize) -> Option<SmallMotion> {
        let theta = spectrum.values[number];
        if !self.is_told(theta) {
            return None;
        }
        let motion = self.check(spectrum, number, self.form.exponent(self.shift, theta))?;
        Some(SmallMotion { exponent: self.exponents(theta).0, ..motion })
    }

    /// The exponent of an eigenvalue that is told, and of the motion of its complex conjugate, which
    /// is not. Round-off makes conjugate pairs of double real eigenvalues: these have one exponent
    /// twice, which is real or imaginary.
    fn exponents(&self, theta: Complex<f64>) -> (Complex<f64>, Option<Complex<f64>>) {
        let s = self.form.exponent(self.shift, theta);
        if theta.im == 0.0 || self.form == ProblemForm::Symmetric {
            return (s, None);
        }
        let is_negligible = |part: f64| part.abs() <= MIN_FLUTTER_RATIO * s.norm();
        let twice = |double: Complex<f64>| (double, Some(double));
        if is_negligible(s.im) {
            return twice(s.re.into());
        }
        match self.form {
            ProblemForm::Undamped if is_negligible(s.re) => twice(Complex::new(0.0, s.im)),
            // Flutter: if s is an exponent, so is -s* (complex conjugate), of equal frequency.
            ProblemForm::Undamped => (s, Some(-s.conj())),
            ProblemForm::Symmetric | ProblemForm::Gyroscopic | ProblemForm::General => (s, None),
        }
    }

    /// True for one eigenvalue of the operator of each conjugate pair.
    fn is_told(&self, theta: Complex<f64>) -> bool {
        let exponent = self.form.exponent(self.shift, theta);
        let is_upper = exponent.im > 0.0 || (exponent.im == 0.0 && theta.im >= 0.0);
        let is_twin = self.form == ProblemForm::Gyroscopic && exponent.im == 0.0 && exponent.re < 0.0;
        is_upper && !is_twin
    }

    /// A verified motion: multiplied by x* from the left, m s^2 + c s + k = 0. `None` if the terms
    /// do not balance.
    fn check(&self, spectrum: &Spectrum, number: usize, exponent: Complex<f64>) -> Option<SmallMotion> {
        let n = self.system.pattern.dof_map.count();
        let [mut re, mut im] = spectrum.vector(number);
        re.truncate(n);
        im.truncate(n);
        let form = |values: &[f64]| {
            let [of_re, of_im] = [&re, &im].map(|x| self.system.multiply(values, x));
            Complex::new(dot(&re, &of_re) + dot(&im, &of_im), dot(&re, &of_im) - dot(&im, &of_re))
        };
        let mass = form(&self.matrices.mass);
        let damping = match self.form {
            ProblemForm::Symmetric | ProblemForm::Undamped => Complex::default(),
            ProblemForm::Gyroscopic | ProblemForm::General => form(&self.matrices.damping),
        };
        let terms = [mass * exponent * exponent, damping * exponent, form(&self.matrices.stiffness)];
        // The larger part of the vector determines the round-off.
        let of_part = if dot(&re, &re) >= dot(&im, &im) { &re } else { &im };
        let uncertainty = lost_part(self.system, of_part);
        let all: f64 = terms.iter().map(|term| term.norm()).sum();
        let balances = (terms[0] + terms[1] + terms[2]).norm() <= (MAX_ENERGY_IMBALANCE + 10.0 * uncertainty) * all;
        let is_free = exponent.norm() <= FREE_MOTION_RATIO * self.shift;
        // d(m s^2 + c s + k) = 0: what round-off changes k by moves s by dk/(2 m s + c).
        let moved = (terms[0] * 2.0 + terms[1]).norm();
        let share = match self.form {
            ProblemForm::Symmetric | ProblemForm::Undamped => 0.5,
            ProblemForm::Gyroscopic | ProblemForm::General => (terms[2].norm() / moved).min(1.0),
        };
        let uncertainty = if is_free { 0.0 } else { share * uncertainty };
        let is_lossy = self.form == ProblemForm::Symmetric && uncertainty > MAX_UNCERTAINTY;
        let unknowns = if is_lossy || dot(&re, &re) >= dot(&im, &im) { re } else { im };
        let shape = (is_lossy || self.keeps_shapes).then_some(ModeShape { unknowns, mass: mass.re, is_lossy });
        (balances || is_free).then_some(SmallMotion { exponent, uncertainty, shape })
    }

    /// Diagonal of an inner product that every scene has: |K_ii| + shift^2 M_ii, by equation.
    fn diagonal(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.system.pattern.dof_map.count()];
        let Matrices { stiffness, mass, .. } = self.matrices;
        let squared = self.shift * self.shift;
        self.system.pattern.each_diagonal(|k, place| out[k] = stiffness[place].abs() + squared * mass[place]);
        out
    }
}

/// An inner product of states of motion.
enum InnerProduct {
    /// That of M, for operators of single size
    Kinetic,
    /// The sum of strain and kinetic energies, with K + (shift^2 + `raised`) M in the place of K
    Energies { raised: f64 },
    /// With a diagonal in the place of K
    Diagonal(Vec<f64>),
}

/// Operator whose largest eigenvalues belong to the motions with the smallest |s - shift|, with the
/// shift e.
///
/// ```text
/// C = 0:     (K + e^2 M)^-1 M x = x/(e^2 - s^2)
/// general:   A z = z/(s - e) with z = (x, s x/e), and A (r1, r2) = (x', s x'/e) from
///            Q(e) x' = -[M r2 e + (C + e M) r1],  s x' = e x' + r1
/// ```
///
/// Inner products are kinetic energies, in the general case the sum of strain and kinetic energies:
/// a conservative A is then normal, so that round-off creates no spurious motions. Where K is indefinite it is nearly so for
/// motions faster than those that grow.
struct ModeOperator<'s, 'a> {
    search: &'s mut ModeSearch<'a>,
    inner_product: InnerProduct,
}

impl ModeOperator<'_, '_> {
    fn is_doubled(&self) -> bool {
        matches!(self.search.form, ProblemForm::Gyroscopic | ProblemForm::General)
    }
}

impl Operator for ModeOperator<'_, '_> {
    fn size(&self) -> usize {
        let n = self.search.system.pattern.dof_map.count();
        if self.is_doubled() { 2 * n } else { n }
    }

    fn apply(&mut self, x: &[f64], weighed: &[f64]) -> Option<Vec<f64>> {
        let doubled = self.is_doubled();
        let ModeSearch { system, solver, matrices, shift: e, .. } = &mut *self.search;
        let n = system.pattern.dof_map.count();
        let e = *e;
        if !doubled {
            // The inner product is that of M.
            let mut out = weighed.to_vec();
            let done = solver.solve_for_modes(system, &mut out);
            self.search.project(&mut out);
            return done.then_some(out);
        }
        let (r1, r2) = x.split_at(n);
        let scaled: Vec<f64> = r1.iter().zip(r2).map(|(a, b)| e * a + e * b).collect();
        let mass = system.multiply(&matrices.mass, &scaled);
        let damping = system.multiply(&matrices.damping, r1);
        let mut out: Vec<f64> = mass.iter().zip(&damping).map(|(m, c)| -(m + c)).collect();
        if !solver.solve_for_modes(system, &mut out) {
            return None;
        }
        let mut second: Vec<f64> = out.iter().zip(r1).map(|(x, r)| x + r / e).collect();
        self.search.project_doubled(&mut out, &mut second);
        out.extend(second);
        Some(out)
    }

    fn weigh(&mut self, x: &[f64]) -> Vec<f64> {
        let ModeSearch { system, matrices, shift, .. } = &*self.search;
        let squared = shift * shift;
        let kinetic = |x: &[f64]| system.multiply(&matrices.mass, x).into_iter().map(|v| squared * v);
        let (first, second) = x.split_at(system.pattern.dof_map.count());
        match &self.inner_product {
            InnerProduct::Kinetic => system.multiply(&matrices.mass, x),
            InnerProduct::Energies { raised } => {
                let strain = system.multiply(&matrices.stiffness, first).into_iter();
                let part = 1.0 + raised / squared;
                let weighed = strain.zip(kinetic(first)).map(|(k, m)| k + part * m);
                weighed.chain(kinetic(second)).collect()
            }
            InnerProduct::Diagonal(diagonal) => {
                first.iter().zip(diagonal).map(|(x, d)| x * d).chain(kinetic(second)).collect()
            }
        }
    }

    fn is_symmetric(&self) -> bool {
        self.search.form == ProblemForm::Symmetric
    }

    /// The velocities of the first image of a vector need not keep the constraints, those of the second do.
    fn rounds(&self) -> usize {
        if self.is_doubled() && !self.search.multipliers.is_empty() { 2 } else { 1 }
    }
}

/// Square root with non-negative real part, and positive imaginary part if the real part is zero;
/// exact for real squares.
fn root(square: Complex<f64>) -> Complex<f64> {
    match square {
        Complex { re, im: 0.0 } if re < 0.0 => Complex::new(0.0, (-re).sqrt()),
        Complex { re, im: 0.0 } => Complex::new(re.sqrt(), 0.0),
        _ => square.sqrt(),
    }
}

/// The size of the largest of some eigenvalues.
fn largest_of(values: &[Complex<f64>]) -> f64 {
    values.iter().map(|theta| theta.norm()).fold(0.0, f64::max)
}

/// The largest entry, its row and column in their scales.
fn largest(pattern: &Pattern, values: &[f64], scales: &[f64]) -> f64 {
    let of_column = |column: usize| {
        let sizes = pattern.entries(column as u32).map(|entry| values[entry.place].abs() * scales[entry.row as usize]);
        sizes.fold(0.0, f64::max) * scales[column]
    };
    (0..scales.len()).map(of_column).fold(0.0, f64::max)
}

/// True if each entry is the negative of its mirror image, with rows and columns in their scales.
fn is_skew(system: &System, values: &[f64], scales: &[f64]) -> bool {
    if system.pattern.symmetry == Symmetry::Whole {
        return false;
    }
    let pseudo_random = |step: f64| -> Vec<f64> {
        scales.iter().zip(0..).map(|(scale, k)| scale * (0.5 + (f64::from(k) * step).fract())).collect()
    };
    let [x, y] = [0.618_033_988_749_895, 0.414_213_562_373_095].map(pseudo_random);
    // Tested with two vectors: y.C x = -x.C y, and x.C x = 0.
    let sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    let size = dot(&y, &system.multiply(&sizes, &x));
    let of_x = system.multiply(values, &x);
    let of_y = system.multiply(values, &y);
    let near = |value: f64| value.abs() <= 1e-12 * size;
    near(dot(&y, &of_x) + dot(&x, &of_y)) && near(dot(&x, &of_x)) && near(dot(&y, &of_y))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
