//! The start of time steps whose joints are in motion.
//!
//! The steps of generalised-alpha methods keep the gaps of joints closed at their ends. In the
//! directions that joints hold, accelerations are smooth only from a start with
//!
//! ```text
//! A0 = q'' + (alpha_m - alpha_f) h q'''        v0 = q' - (beta - 1/6 + (alpha_m - alpha_f)/2) h^2 q'''
//! ```
//!
//! (Arnold, Bruls & Cardona 2015, doi:10.1007/s00211-014-0633-1). From A0 = q'' and v0 = q' they
//! swing by the order of h, and so do the forces of joints: less and less with numerical
//! dissipation, more and more with the trapezoidal rule. In other directions a start with q'' and q'
//! costs an error of third order once.
//!
//! Where the unknowns are increments of rotation, v0 is another one, since part of the acceleration
//! is integrated to a higher order: see [`Accelerations`](crate::integrate::Accelerations).

use super::Dynamics;
use crate::integrate::{AtLag, Increments, Stages, Step};
use crate::kernel::Weights;
use crate::rotation::Rotation;
use crate::run::failure::Failure;
use crate::run::stage_run::StageRun;
use crate::system::State;
use crate::tensor::{Vec3, zeros};

/// Third rates that keep the gaps of joints closed, by slot, with the least motion that mass allows.
pub(super) struct JointJerk {
    /// q'''
    rates3: Vec<Vec3>,
    /// q' - v0 over h^2
    lead: Vec<Vec3>,
}

/// The instants, in parts of a step, whose accelerations give third rates; see [`slope`].
const INSTANTS: [f64; 3] = [0.0, 0.5, 1.0];

/// The rate at the first of [`INSTANTS`] of a quantity with these values, by a parabola.
fn slope([now, half, whole]: [Vec3; 3], step: f64) -> Vec3 {
    (half * 4.0 - whole - now * 3.0) * (1.0 / step)
}

impl Dynamics<'_, '_> {
    /// The third rates at the start of the stage; `None` without joints, and where only their forces
    /// change.
    pub(super) fn jerk_of_joints(&mut self) -> Result<Option<JointJerk>, Failure> {
        let step = self.first_length();
        if self.stage.model.multipliers.is_empty() || self.settings.scheme.stages == Stages::MiddleAndEnd {
            return Ok(None);
        }
        let [Some(now), Some(half), Some(whole)] = INSTANTS.map(|part| self.after(part * step)) else {
            return Ok(None);
        };
        let states = [&now, &half, &whole];
        let rates2 = states.map(|state| {
            let [_, rates2] = self.stage.assembly.drift(state);
            rates2
        });
        let of_gap = |slot: usize| slope(rates2.each_ref().map(|rates2| rates2[slot]), step);
        let of_gaps: Vec<Vec3> = (0..now.q.len()).map(of_gap).collect();
        if of_gaps.iter().all(|&rate3| rate3 == Vec3::ZERO) {
            return Ok(None);
        }
        let factor = self.settings.scheme.error_factor().unwrap_or(0.0);
        let own = self.increments.as_ref().map(|increments| lead_of_turns(increments, states, step, factor));
        let Some(rates3) = self.closing_rates(&of_gaps)? else { return Ok(None) };
        let lead = match own {
            None => rates3.iter().map(|&rate3| rate3 * factor).collect(),
            Some(own) => {
                let own = self.rates_of_gaps(&own);
                let rest: Vec<Vec3> = of_gaps.iter().zip(own).map(|(&rate3, own)| rate3 * factor - own).collect();
                self.closing_rates(&rest)?.unwrap_or_default()
            }
        };
        Ok(Some(JointJerk { rates3, lead }))
    }

    /// The length of the first step: fixed ones are shorter where rows or the end of the stage ask for
    /// it.
    fn first_length(&self) -> f64 {
        match self.settings.adaptive {
            Some(_) => self.settings.step,
            None => self.grid_from(self.stage.state.time).step(1).1,
        }
    }

    /// Rates of the unknowns that keep gaps closed, with the least motion that mass allows, where the
    /// gaps have the rates `gaps` without them; all of one order, say third rates.
    fn closing_rates(&mut self, gaps: &[Vec3]) -> Result<Option<Vec<Vec3>>, Failure> {
        self.stage.assembly.evaluate(self.stage.state, Weights::MASS, None);
        self.stage.assembly.system.forget_forces();
        let solved = self.solve_with_mass(gaps)?;
        self.stage.assembly.evaluate(self.stage.state, Weights::NONE, None);
        let kinds = &self.stage.model.kinds;
        Ok(solved.map(|mut rates3| {
            let forces = (0..rates3.len()).filter(|&slot| kinds[slot].is_multiplier());
            forces.for_each(|slot| rates3[slot] = Vec3::ZERO);
            rates3
        }))
    }

    /// The rates of gaps where the unknowns have the velocities `v`, without those of motors.
    fn rates_of_gaps(&self, v: &[Vec3]) -> Vec<Vec3> {
        let mut moving = State::clone(self.stage.state);
        moving.v.fill(Vec3::ZERO);
        let [of_motors, _] = self.stage.assembly.drift(&moving);
        moving.v.copy_from_slice(v);
        let [rates, _] = self.stage.assembly.drift(&moving);
        rates.into_iter().zip(of_motors).map(|(rate, of_motor)| rate - of_motor).collect()
    }

    /// The state after some time with the accelerations of now; `None` where motions turn too far
    /// by then.
    fn after(&self, time: f64) -> Option<State> {
        let StageRun { model, schedule, state, .. } = &*self.stage;
        let mut ahead = State::clone(state);
        if time > 0.0 {
            advance(&mut ahead, time, None);
            if schedule.set_clock(model, &mut ahead, state.time + time, 1.0).is_some() {
                return None;
            }
        }
        Some(ahead)
    }

    /// Starts the scheme, with third rates where there are some.
    pub(super) fn start_scheme(&mut self, jerk: Option<&JointJerk>) {
        let Step { scheme, length } = self.first_step();
        let state = &mut *self.stage.state;
        let rates3 = jerk.map(|jerk| &jerk.rates3[..]);
        scheme.start(state, length, rates3);
        let Some(increments) = &self.increments else { return };
        let lag = scheme.lag();
        let at_lag = rates3.filter(|_| lag != 0.0).map(|rates3| {
            let mut at_lag = State::clone(state);
            advance(&mut at_lag, lag * length, Some(rates3));
            (at_lag, rates3)
        });
        increments.start(state, at_lag.as_ref().map(|(state, jerk)| AtLag { state, lag, jerk }));
    }

    /// Changes the velocities of the start to those that fixed steps of the scheme keep along a
    /// motion with third rates. After adaptive steps velocities are given back to the joints.
    pub(super) fn lead_velocities(&mut self, jerk: Option<&JointJerk>) {
        let Some(jerk) = jerk.filter(|_| self.settings.adaptive.is_none()) else { return };
        let length = self.first_length();
        let velocities = self.stage.state.v.iter_mut().zip(&jerk.lead);
        velocities.for_each(|(v, &lead)| *v -= lead * (length * length));
    }
}

/// The lead of rotations whose unknowns are increments, as rates of their total vectors by slot, from
/// the states at [`INSTANTS`].
fn lead_of_turns(increments: &Increments, states: [&State; 3], step: f64, factor: f64) -> Vec<Vec3> {
    let [now, half, whole] = states;
    let mut lead = zeros(now.q.len());
    let all = increments.accelerations(now).zip(increments.accelerations(half)).zip(increments.accelerations(whole));
    for ((first, second), third) in all {
        let slot = first.slot as usize;
        let rotation = Rotation::new(now.q[slot]);
        let rate3 = slope([first.driven, second.driven, third.driven], step);
        lead[slot] = rotation.t_inverse() * rotation.r.transpose_mul(rate3 * factor + first.lead);
    }
    lead
}

/// Moves a state on by some time, with its accelerations and third rates.
pub(super) fn advance(state: &mut State, time: f64, jerk: Option<&[Vec3]>) {
    let State { q, v, a, .. } = state;
    let (v, a) = (&mut v[..], &mut a[..]);
    for slot in 0..q.len() {
        let jerk = jerk.map_or(Vec3::ZERO, |jerk| jerk[slot]);
        q[slot] += (v[slot] + (a[slot] + jerk * (time / 3.0)) * (0.5 * time)) * time;
        v[slot] += (a[slot] + jerk * (0.5 * time)) * time;
        a[slot] += jerk * time;
    }
}
