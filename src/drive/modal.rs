//! Small motions about the state that was reached: (s^2 M + s C + K) x = 0.

use super::failure::Failure;
use super::run::{Mode, Run, Workshop};
use crate::kernel::Weights;
use crate::model::{Model, StageError};
use crate::solve::{
    Convergence, LinearSolver, Operator, Tangent, Verdict, is_symmetric, largest_eigenvalues, mechanism, timed,
};
use crate::system::System;
use nalgebra::Complex;

/// Part of the lowest frequencies at which the first look is taken.
const FIRST_SHIFT: f64 = 1e-4;
/// Part of the lowest frequency found at which the second is taken: near enough to tell rigid motions from elastic ones.
const SECOND_SHIFT: f64 = 0.3;
/// Two frequencies that agree to this are one, and the more unstable mode comes first.
const SAME_FREQUENCY: f64 = 1e-7;
/// Damping forces below this part of inertia and stiffness forces are none.
const NO_DAMPING: f64 = 1e-14;

impl Run<'_> {
    /// The modes with the lowest frequencies.
    pub(super) fn run_modal(&mut self, workshop: &mut Workshop, modes: usize) -> Result<(), Failure> {
        self.observer.progress(self.moment(), self.static_progress(0.0))?;
        let moving = self.state.clone();
        self.stand_still();
        let (time, load) = (self.state.time, self.state.load);
        self.model.set_clock(&mut self.state, time, load);
        self.change_charts(None);
        self.open_account(workshop)?;
        self.warn_out_of_balance(workshop);
        let matrices = self.matrices(workshop);
        let found = self.find_modes(workshop, &matrices, modes)?;
        self.count_steps();
        // What moved moves on.
        self.state.copy_rates(&moving);
        self.observer.modes(self.stage + 1, &found)
    }

    /// No velocities: modes and paths are looked at from rest.
    pub(super) fn stand_still(&mut self) {
        self.state.stand_still();
    }

    pub(super) fn warn_out_of_balance(&mut self, workshop: &mut Workshop) {
        workshop.assembly.forget();
        let noise = workshop.assembly.noise(&self.state);
        workshop.assembly.evaluate(&self.state, Weights::NONE, None);
        let loose = Convergence { tolerance: 1e-5 };
        let (verdict, _) = loose.judge(&self.model, &workshop.assembly.system, noise, None);
        if !matches!(verdict, Verdict::Converged | Verdict::Noisy) {
            self.observer
                .warn("the state of a modal or buckling stage is not in balance: let a static stage come before it");
        }
    }

    fn matrices(&mut self, workshop: &mut Workshop) -> Matrices {
        let assembly = &mut workshop.assembly;
        let mut part = |weights: Weights| {
            assembly.evaluate(&self.state, weights, None);
            assembly.system.values.clone()
        };
        let (damping, mut mass, stiffness) = (part(Weights::DAMPING), part(Weights::MASS), part(Weights::STIFFNESS));
        drop_multipliers(&assembly.system, &self.model, &mut mass);
        Matrices { stiffness, damping, mass }
    }

    /// Twice: the second time about a shift that suits the frequencies themselves.
    fn find_modes(&mut self, workshop: &mut Workshop, matrices: &Matrices, modes: usize) -> Result<Vec<Mode>, Failure> {
        let moment = self.moment();
        // Two looks, which take most of the stage.
        let ends = [0.5, 1.0].map(|done| self.static_progress(done));
        let Workshop { assembly, newton, .. } = workshop;
        let [stiffest, heaviest, dampest] =
            [&matrices.stiffness, &matrices.mass, &matrices.damping].map(|v| largest(v));
        if heaviest == 0.0 {
            return Err(self.describe(StageError::NoMass));
        }
        let mut shift = FIRST_SHIFT * softest_ratio(&assembly.system, matrices).unwrap_or(stiffest / heaviest).sqrt();
        if shift == 0.0 {
            // Nothing holds anything: every mode is a free motion.
            shift = 1.0;
        }
        let damped = dampest > NO_DAMPING * (stiffest * heaviest).sqrt();
        let mut found = Vec::new();
        for (look, end) in ends.into_iter().enumerate() {
            self.observer.progress(moment, end)?;
            matrices.combine(shift, &mut assembly.system.values);
            self.counters.work.factorisations += 1;
            let done = newton.solver.factorise_surely(&assembly.system);
            let loose = mechanism(&mut newton.solver, &mut Tangent::that_stays(assembly, &self.state), &self.model);
            if !done || loose.is_some() {
                // Rigid motions are no zeros but round-off: a shift by a part of that leaves nothing to solve with, and the first look stands.
                if look > 0 {
                    break;
                }
                return Err(self.name_mechanism(loose, &assembly.system));
            }
            let system = &assembly.system;
            let symmetric = !damped && is_symmetric(&system.pattern, &matrices.stiffness);
            let mut operator = Motions { system, matrices, solver: &mut newton.solver, shift, symmetric };
            let wanted = if symmetric { modes } else { 2 * modes + 2 };
            let found_values =
                timed(&mut self.counters.work.solve_seconds, || largest_eigenvalues(&mut operator, wanted));
            let Some(values) = found_values else {
                return Err(Failure::Limit("the modes could not be found: a solve with the tangent failed".into()));
            };
            found = if symmetric { undamped(&values, shift) } else { damped_modes(&values, shift) };
            sort(&mut found);
            found.truncate(modes);
            // Rigid motions are those that the first look finds far below the others.
            let highest = found.iter().map(Mode::size).fold(0.0, f64::max);
            let lowest = found.iter().map(Mode::size).filter(|&size| size > 1e-4 * highest).fold(highest, f64::min);
            if look == 0 && lowest > 0.0 {
                shift = SECOND_SHIFT * lowest;
            }
        }
        Ok(found)
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// The smallest K_ii / M_ii: no lowest frequency lies above it.
fn softest_ratio(system: &System, matrices: &Matrices) -> Option<f64> {
    let mut softest: Option<f64> = None;
    system.pattern.each_diagonal(|_, place| {
        let (stiffness, mass) = (matrices.stiffness[place], matrices.mass[place]);
        if mass > 0.0 && stiffness != 0.0 {
            let ratio = (stiffness / mass).abs();
            softest = Some(softest.map_or(ratio, |softest| softest.min(ratio)));
        }
    });
    softest
}

/// Multipliers have no mass.
fn drop_multipliers(system: &System, model: &Model, values: &mut [f64]) {
    let pattern = &system.pattern;
    let is_multiplier: Vec<bool> = (0..pattern.equations.count())
        .map(|k| model.kinds[pattern.equations.direction(k).slot as usize].is_multiplier())
        .collect();
    for (column, &own) in is_multiplier.iter().enumerate() {
        for entry in pattern.entries(column as u32).filter(|entry| own || is_multiplier[entry.row as usize]) {
            values[entry.place] = 0.0;
        }
    }
}

/// K, C and M on the pattern of the tangent.
struct Matrices {
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    mass: Vec<f64>,
}

impl Matrices {
    /// K + shift C + shift^2 M
    fn combine(&self, shift: f64, out: &mut [f64]) {
        let parts = self.stiffness.iter().zip(&self.damping).zip(&self.mass);
        for (out, ((k, c), m)) in out.iter_mut().zip(parts) {
            *out = k + shift * (c + shift * m);
        }
    }
}

/// The motions with the smallest s as the eigenvectors with the largest 1/(s - shift): in K + shift^2 M and M alone where
/// there is no damping and everything is symmetric, then with eigenvalues 1/(s^2 - … ) as below; else in x and s x.
///
/// ```text
/// symmetric: (K + e^2 M)^-1 M x = x/(e^2 - s^2)
/// general:   with z = (x, s x/e):   A z = z/(s - e),   from   Q(e) x' = -[M r2 e + (C + e M) r1],  s x' = e x' + r1
/// ```
struct Motions<'a> {
    system: &'a System,
    matrices: &'a Matrices,
    solver: &'a mut LinearSolver,
    shift: f64,
    symmetric: bool,
}

impl Operator for Motions<'_> {
    fn size(&self) -> usize {
        let n = self.system.pattern.equations.count();
        if self.symmetric { n } else { 2 * n }
    }

    fn apply(&mut self, x: &[f64]) -> Option<Vec<f64>> {
        let (n, e) = (self.system.pattern.equations.count(), self.shift);
        if self.symmetric {
            let mut out = self.system.multiply(&self.matrices.mass, x);
            return self.solver.solve_once(self.system, &mut out).then_some(out);
        }
        let (r1, r2) = x.split_at(n);
        let scaled: Vec<f64> = r1.iter().zip(r2).map(|(a, b)| e * a + e * b).collect();
        let (mass, damping) =
            (self.system.multiply(&self.matrices.mass, &scaled), self.system.multiply(&self.matrices.damping, r1));
        let mut out: Vec<f64> = mass.iter().zip(&damping).map(|(m, c)| -(m + c)).collect();
        if !self.solver.solve_once(self.system, &mut out) {
            return None;
        }
        let second: Vec<f64> = out.iter().zip(r1).map(|(x, r)| x + r / e).collect();
        out.extend(second);
        Some(out)
    }

    fn weigh(&mut self, x: &[f64]) -> Vec<f64> {
        if self.symmetric { self.system.multiply(&self.matrices.mass, x) } else { x.to_vec() }
    }

    fn is_symmetric(&self) -> bool {
        self.symmetric
    }
}

/// From eigenvalues 1/(e^2 - s^2): s^2 = e^2 - 1/theta, real.
fn undamped(values: &[Complex<f64>], shift: f64) -> Vec<Mode> {
    let mode = |theta: &Complex<f64>| {
        let square = shift * shift - 1.0 / theta.re;
        if square < 0.0 {
            Mode { omega: (-square).sqrt(), growth: 0.0 }
        } else {
            Mode { omega: 0.0, growth: square.sqrt() }
        }
    };
    values.iter().filter(|theta| theta.re != 0.0).map(mode).collect()
}

/// From eigenvalues 1/(s - e); of a conjugate pair one.
fn damped_modes(values: &[Complex<f64>], shift: f64) -> Vec<Mode> {
    let s = values.iter().filter(|theta| theta.norm() > 0.0).map(|theta| theta.inv() + shift);
    let upper = s.filter(|s| s.im >= 0.0);
    upper.map(|s| Mode { omega: s.im.abs(), growth: s.re }).collect()
}

/// By frequency; of equal frequencies the more unstable first.
fn sort(modes: &mut [Mode]) {
    modes.sort_by(|a, b| a.omega.total_cmp(&b.omega));
    let mut start = 0;
    for k in 1..=modes.len() {
        let apart = k == modes.len() || modes[k].omega - modes[start].omega > SAME_FREQUENCY * modes[k].omega;
        if apart {
            modes[start..k].sort_by(|a, b| b.growth.total_cmp(&a.growth));
            start = k;
        }
    }
}
