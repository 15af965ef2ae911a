//! Small motions x exp(s t) with (s^2 M + s C + K) x = 0 nearest to a shift, each checked before it
//! is given.

use super::krylov::{Operator, Spectrum, largest_eigenvalues, roughly_largest_eigenvalues};
use super::linear::LinearSolver;
use super::pivots::is_symmetric;
use super::softest::lost_part;
use crate::system::{Symmetry, System};
use nalgebra::Complex;

/// What is left of a rigid motion beside the others, as part of itself, that is none of its own.
const MADE_OF_OTHERS: f64 = 1e-6;

/// An eigenvector leaves no more than this of itself.
const RESIDUAL: f64 = 1e-5;

/// The same of conservative scenes, whose frequencies are wrong by its square only: solutions with
/// slender beams leave more.
const RESIDUAL_OF_SYMMETRIC: f64 = 1e-3;

/// The energies of a mode balance to this.
const BALANCE: f64 = 1e-6;

/// Damping forces below this part of inertia and stiffness forces are none.
const NO_DAMPING: f64 = 1e-14;

/// Of a rough look so many exponents tell.
const NEARLY_RIGHT: usize = 6;

/// Frequencies that round-off may change by more than this part of themselves are found once more
/// from strains.
const UNCERTAIN: f64 = 1e-9;

/// Motions slower than this part of the shift are free ones: their stiffness is round-off, and
/// balances nothing.
const FREE: f64 = 1e-3;

/// Without dampers, a motion that grows faster than this part of |s| has a twin that decays.
const TWIN: f64 = 1e-6;

/// K, C and M on the pattern of the tangent.
pub struct Matrices {
    /// K
    pub stiffness: Vec<f64>,
    /// C, of dampers and of Coriolis and gyroscopic forces
    pub damping: Vec<f64>,
    /// M
    pub mass: Vec<f64>,
}

/// A small motion: its exponent, and how large round-off may be in it, relative to itself.
#[derive(Clone, Debug, PartialEq)]
pub struct SmallMotion {
    /// s = growth + i omega, omega >= 0
    pub exponent: Complex<f64>,
    /// The part of |s| that round-off in the stiffness may have taken
    pub uncertainty: f64,
    /// The shape of motions without damping that are uncertain
    pub shape: Option<ModeShape>,
}

/// The shape of a small motion.
#[derive(Clone, Debug, PartialEq)]
pub struct ModeShape {
    /// One number an equation
    pub unknowns: Vec<f64>,
    /// x.M x
    pub mass: f64,
}

/// Properties of the matrices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// K symmetric, C = 0: s^2 is real.
    Symmetric,
    /// C = 0: with s, -s is a motion.
    Undamped,
    /// K symmetric, C skew: with s, -s is a motion.
    Gyroscopic,
    /// Anything
    General,
}

impl Form {
    /// The exponent that belongs to an eigenvalue, see [`Motions`].
    fn exponent(self, shift: f64, theta: Complex<f64>) -> Complex<f64> {
        match self {
            Self::Symmetric | Self::Undamped => root(shift * shift - theta.inv()),
            Self::Gyroscopic | Self::General => theta.inv() + shift,
        }
    }
}

/// The eigenvalue problem of a state.
pub struct ModeSearch<'a> {
    /// Where K + shift C + shift^2 M is formed
    system: &'a mut System,
    solver: &'a mut LinearSolver,
    matrices: &'a Matrices,
    form: Form,
    /// Rigid motions of free parts, and M times each: orthonormal, and taken out of everything
    rigid: Vec<[Vec<f64>; 2]>,
    shift: f64,
    /// True if the system and its factors are those of the shift
    is_ready: bool,
    /// Negative pivots of K + shift^2 M, where K is symmetric
    negative: Option<usize>,
    /// Factorisations so far
    pub factorisations: u64,
}

impl Matrices {
    /// K + shift C + shift^2 M
    pub fn combine(&self, shift: f64, out: &mut [f64]) {
        let parts = self.stiffness.iter().zip(&self.damping).zip(&self.mass);
        for (out, ((k, c), m)) in out.iter_mut().zip(parts) {
            *out = k + shift * (c + shift * m);
        }
    }

    /// True if nothing has any mass.
    pub fn is_massless(&self) -> bool {
        self.mass.iter().all(|&m| m == 0.0)
    }

    /// The root of the smallest K_ii / M_ii, or of the stiffest over the heaviest: no lowest
    /// frequency lies above it.
    pub fn softest_frequency(&self, system: &System) -> f64 {
        let Self { stiffness, mass, .. } = self;
        let (mut softest, mut largest) = (f64::INFINITY, [0.0_f64; 2]);
        system.pattern.each_diagonal(|_, place| {
            let (k, m) = (stiffness[place].abs(), mass[place]);
            largest = [largest[0].max(k), largest[1].max(m)];
            if m > 0.0 && k > 0.0 {
                softest = softest.min(k / m);
            }
        });
        let ratio = if softest.is_finite() { softest } else { largest[0] / largest[1] };
        ratio.sqrt()
    }

    /// K + square M
    fn combine_squared(&self, square: f64, out: &mut [f64]) {
        for (out, (k, m)) in out.iter_mut().zip(self.stiffness.iter().zip(&self.mass)) {
            *out = k + square * m;
        }
    }
}

impl<'a> ModeSearch<'a> {
    /// A search in these matrices; `rigid` motions are left out.
    pub fn new(
        system: &'a mut System,
        solver: &'a mut LinearSolver,
        matrices: &'a Matrices,
        rigid: Vec<Vec<f64>>,
    ) -> Self {
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let [stiffest, heaviest, dampest] =
            [&matrices.stiffness, &matrices.mass, &matrices.damping].map(|values| largest(values));
        let damped = dampest > NO_DAMPING * (stiffest * heaviest).sqrt();
        let symmetric = is_symmetric(&system.pattern, &matrices.stiffness);
        let form = match (symmetric, damped) {
            (true, false) => Form::Symmetric,
            (false, false) => Form::Undamped,
            (true, true) if is_skew(system, &matrices.damping) => Form::Gyroscopic,
            _ => Form::General,
        };
        let mut search = Self {
            system,
            solver,
            matrices,
            form,
            rigid: Vec::new(),
            shift: 0.0,
            is_ready: false,
            negative: None,
            factorisations: 0,
        };
        rigid.into_iter().for_each(|motion| search.take_out(motion));
        search
    }

    /// The number of rigid motions.
    pub fn rigid(&self) -> usize {
        self.rigid.len()
    }

    /// Orthonormal to the others; none that is made of these.
    fn take_out(&mut self, mut motion: Vec<f64>) {
        let before = dot(&motion, &self.system.multiply(&self.matrices.mass, &motion)).max(0.0).sqrt();
        for _ in 0..2 {
            self.project(&mut motion);
        }
        let mut weighed = self.system.multiply(&self.matrices.mass, &motion);
        let size = dot(&motion, &weighed).max(0.0).sqrt();
        if size > MADE_OF_OTHERS * before {
            motion.iter_mut().chain(&mut weighed).for_each(|v| *v /= size);
            self.rigid.push([motion, weighed]);
        }
    }

    /// Takes rigid motions out of a vector.
    fn project(&self, x: &mut [f64]) {
        for [motion, weighed] in &self.rigid {
            let along = dot(weighed, x);
            x.iter_mut().zip(motion).for_each(|(x, r)| *x -= along * r);
        }
    }

    /// Factorises at a shift, unless that was done last; `false` where it cannot be done.
    pub fn factorise(&mut self, shift: f64) -> bool {
        if self.is_ready && self.shift == shift {
            return true;
        }
        self.shift = shift;
        self.factorisations += 1;
        if matches!(self.form, Form::Gyroscopic | Form::General) {
            self.matrices.combine_squared(shift * shift, &mut self.system.values);
            self.negative = self.solver.negative_beside(self.system);
        }
        self.matrices.combine(shift, &mut self.system.values);
        self.system.revision += 1;
        let done = self.solver.factorise_surely(self.system);
        if self.form == Form::Symmetric {
            self.negative = self.count(done);
        }
        self.is_ready = done;
        done
    }

    /// Negative pivots of the system, which was factorised, or was tried to be.
    fn count(&mut self, done: bool) -> Option<usize> {
        let own = self.solver.negative_of_last().filter(|_| done);
        own.or_else(|| self.solver.negative_beside(self.system))
    }

    /// How many motions grow faster than the shift, where pivots tell.
    pub fn growing(&self) -> Option<usize> {
        self.negative.filter(|_| self.form == Form::Symmetric)
    }

    /// True if stiffness holds everything, so that nothing can grow but by dampers that drive.
    pub fn is_held(&self) -> bool {
        self.negative == Some(0)
    }

    /// True if `motions`, nearest to the shift that was factorised last, reach around another
    /// shift: those near to it are among them.
    pub fn reaches(&self, motions: &[SmallMotion], other: f64) -> bool {
        let shift = Complex::from(self.shift);
        let distance = |exponent: Complex<f64>| match self.form {
            Form::Symmetric | Form::Undamped => (exponent * exponent - shift * shift).norm(),
            Form::Gyroscopic | Form::General => (exponent - shift).norm(),
        };
        let reach = motions.iter().map(|motion| distance(motion.exponent)).fold(0.0, f64::max);
        reach >= 2.0 * distance(other.into())
    }

    /// How many motions swing slower than `omega` or grow, rigid ones among them, where pivots
    /// tell. Another shift has to be factorised afterwards.
    pub fn slower(&mut self, omega: f64) -> Option<usize> {
        self.matrices.combine_squared(-omega * omega, &mut self.system.values);
        self.system.revision += 1;
        if self.form != Form::Symmetric {
            return None;
        }
        self.is_ready = false;
        self.factorisations += 1;
        let done = self.solver.factorise(self.system);
        self.count(done)
    }

    /// Rough exponents nearest to the shift; `None` where a solution fails.
    pub fn roughly_nearest(&mut self) -> Option<Vec<f64>> {
        let (shift, form, diagonal) = (self.shift, self.form, self.inner_product());
        let values = roughly_largest_eigenvalues(&mut Motions { search: self, diagonal })?;
        // The first ones are nearly right.
        let there = values.into_iter().filter(|theta| theta.norm() > 0.0).take(NEARLY_RIGHT);
        Some(there.map(|theta| form.exponent(shift, theta).norm()).collect())
    }

    /// See [`Motions::diagonal`].
    fn inner_product(&self) -> Vec<f64> {
        let takes_energies = matches!(self.form, Form::Symmetric | Form::Undamped) || self.is_held();
        if takes_energies { Vec::new() } else { self.diagonal() }
    }

    /// The motions nearest to the shift that was factorised last, nearest first; those that do not
    /// pass the checks are left out. `None` where a solution fails.
    pub fn nearest(&mut self, wanted: usize) -> Option<Vec<SmallMotion>> {
        let room = match self.form {
            Form::Symmetric | Form::Undamped => wanted,
            Form::Gyroscopic | Form::General => 2 * wanted + 2,
        };
        let (shift, form, diagonal) = (self.shift, self.form, self.inner_product());
        let mut operator = Motions { search: self, diagonal };
        let spectrum = largest_eigenvalues(&mut operator, room)?;
        let allowed = match form {
            Form::Symmetric => RESIDUAL_OF_SYMMETRIC,
            Form::Undamped | Form::Gyroscopic | Form::General => RESIDUAL,
        };
        let mut found = Vec::new();
        for (number, &theta) in spectrum.values.iter().enumerate().filter(|(_, theta)| theta.norm() > 0.0) {
            let exponent = form.exponent(shift, theta);
            // Of a conjugate pair one
            let upper = exponent.im > 0.0 || (exponent.im == 0.0 && theta.im >= 0.0);
            let is_twin = form == Form::Gyroscopic && exponent.im == 0.0 && exponent.re < 0.0;
            if upper && !is_twin && spectrum.residual(&mut operator, number) <= allowed {
                found.push((number, exponent));
            }
        }
        // What follows asks for K alone.
        self.is_ready = false;
        self.system.values.copy_from_slice(&self.matrices.stiffness);
        self.system.revision += 1;
        let mut motions = Vec::new();
        for motion in found.into_iter().filter_map(|(number, exponent)| self.check(&spectrum, number, exponent)) {
            let s = motion.exponent;
            // Flutter: with s, -s* is a motion of the same frequency.
            let twin = form == Form::Undamped && s.re > TWIN * s.norm() && s.im > 0.0;
            let twin = twin.then(|| SmallMotion { exponent: -s.conj(), ..motion.clone() });
            motions.push(motion);
            motions.extend(twin);
        }
        Some(motions)
    }

    /// A motion that balances: multiplied from the left with its own x*, m s^2 + c s + k = 0.
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
        let terms =
            [mass * exponent * exponent, form(&self.matrices.damping) * exponent, form(&self.matrices.stiffness)];
        // The larger part of the vector tells.
        let of_part = if dot(&re, &re) >= dot(&im, &im) { &re } else { &im };
        let uncertainty = lost_part(self.system, of_part);
        let all: f64 = terms.iter().map(|term| term.norm()).sum();
        let balances = (terms[0] + terms[1] + terms[2]).norm() <= (BALANCE + 10.0 * uncertainty) * all;
        let is_free = exponent.norm() <= FREE * self.shift;
        // s goes with the root of K.
        let uncertainty = if is_free { 0.0 } else { 0.5 * uncertainty };
        let is_asked_for = self.form == Form::Symmetric && uncertainty > UNCERTAIN;
        let shape = is_asked_for.then_some(ModeShape { unknowns: re, mass: mass.re });
        (balances || is_free).then_some(SmallMotion { exponent, uncertainty, shape })
    }

    /// |K_ii| + shift^2 M_ii, an inner product that every scene has.
    fn diagonal(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.system.pattern.dof_map.count()];
        let Matrices { stiffness, mass, .. } = self.matrices;
        let squared = self.shift * self.shift;
        self.system.pattern.each_diagonal(|k, place| out[k] = stiffness[place].abs() + squared * mass[place]);
        out
    }
}

/// The motions with the smallest s - shift as eigenvectors with the largest eigenvalues.
///
/// ```text
/// C = 0:     (K + e^2 M)^-1 M x = x/(e^2 - s^2)
/// general:   with z = (x, s x/e):   A z = z/(s - e),   from   Q(e) x' = -[M r2 e + (C + e M) r1],  s x' = e x' + r1
/// ```
///
/// Inner products are kinetic energies, and in general the sum of strain and kinetic energies: it
/// makes a conservative A normal, so that round-off invents no motions.
struct Motions<'s, 'a> {
    search: &'s mut ModeSearch<'a>,
    /// In the place of strain energies, where these are no inner product
    diagonal: Vec<f64>,
}

impl Motions<'_, '_> {
    fn is_doubled(&self) -> bool {
        matches!(self.search.form, Form::Gyroscopic | Form::General)
    }
}

impl Operator for Motions<'_, '_> {
    fn size(&self) -> usize {
        let n = self.search.system.pattern.dof_map.count();
        if self.is_doubled() { 2 * n } else { n }
    }

    fn apply(&mut self, x: &[f64]) -> Option<Vec<f64>> {
        let doubled = self.is_doubled();
        let ModeSearch { system, solver, matrices, shift: e, .. } = &mut *self.search;
        let (n, e) = (system.pattern.dof_map.count(), *e);
        if !doubled {
            let mut out = system.multiply(&matrices.mass, x);
            let done = solver.solve_once(system, &mut out);
            self.search.project(&mut out);
            return done.then_some(out);
        }
        let (r1, r2) = x.split_at(n);
        let scaled: Vec<f64> = r1.iter().zip(r2).map(|(a, b)| e * a + e * b).collect();
        let (mass, damping) = (system.multiply(&matrices.mass, &scaled), system.multiply(&matrices.damping, r1));
        let mut out: Vec<f64> = mass.iter().zip(&damping).map(|(m, c)| -(m + c)).collect();
        if !solver.solve_once(system, &mut out) {
            return None;
        }
        let mut second: Vec<f64> = out.iter().zip(r1).map(|(x, r)| x + r / e).collect();
        self.search.project(&mut out);
        self.search.project(&mut second);
        out.extend(second);
        Some(out)
    }

    fn weigh(&mut self, x: &[f64]) -> Vec<f64> {
        let ModeSearch { system, matrices, shift, .. } = &*self.search;
        if !self.is_doubled() {
            return system.multiply(&matrices.mass, x);
        }
        let (first, second) = x.split_at(system.pattern.dof_map.count());
        let squared = shift * shift;
        let kinetic = |x: &[f64]| system.multiply(&matrices.mass, x).into_iter().map(|v| squared * v);
        let mut out: Vec<f64> = match self.diagonal.is_empty() {
            true => system
                .multiply(&matrices.stiffness, first)
                .into_iter()
                .zip(kinetic(first))
                .map(|(k, m)| k + m)
                .collect(),
            false => first.iter().zip(&self.diagonal).map(|(x, d)| x * d).collect(),
        };
        out.extend(kinetic(second));
        out
    }

    fn is_symmetric(&self) -> bool {
        self.search.form == Form::Symmetric
    }
}

/// The root with a real part that is not negative, and a positive imaginary part if that is zero;
/// of real squares exactly.
fn root(square: Complex<f64>) -> Complex<f64> {
    match square {
        Complex { re, im: 0.0 } if re < 0.0 => Complex::new(0.0, (-re).sqrt()),
        Complex { re, im: 0.0 } => Complex::new(re.sqrt(), 0.0),
        _ => square.sqrt(),
    }
}

/// True if each entry is the negative of its mirror image.
fn is_skew(system: &System, values: &[f64]) -> bool {
    if system.pattern.symmetry == Symmetry::Whole {
        return false;
    }
    let x: Vec<f64> =
        (0..system.pattern.dof_map.count()).map(|k| 0.5 + (k as f64 * 0.618_033_988_749_895).fract()).collect();
    let y: Vec<f64> = (0..x.len()).map(|k| 0.5 + (k as f64 * 0.414_213_562_373_095).fract()).collect();
    // Random vectors tell: y.C x = -x.C y, and x.C x = 0.
    let sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    let size = dot(&y, &system.multiply(&sizes, &x));
    let (of_x, of_y) = (system.multiply(values, &x), system.multiply(values, &y));
    let near = |value: f64| value.abs() <= 1e-12 * size;
    near(dot(&y, &of_x) + dot(&x, &of_y)) && near(dot(&x, &of_x)) && near(dot(&y, &of_y))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
