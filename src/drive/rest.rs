//! States of rest that small load levels do not lead to: of what only its loads hold, as hanging chains and blades on free hinges, and of
//! cables that are laid loosely.
//!
//! The structure moves along the forces on it, against an artificial resistance that fades (see [`crate::effect::resistance`]), until it
//! comes to rest. Balance is then found without any resistance, from that state.

use super::failure::Failure;
use super::levels::{LARGEST_UNCOUNTED, distance};
use super::run::{Run, Workshop};
use crate::effect::resistance::Resistance;
use crate::integrate::{Equilibrium, Method};
use crate::kernel::Weights;
use crate::model::{Assembly, SlotKind, charts};
use crate::solve::{Convergence, LinearSolver, Newton, Tangent, Work, size};
use crate::system::{Anchor, Slot, State};
use std::sync::Arc;

/// The first resistance lets the largest force move its node by this part of the length of the scene.
const GENTLE: f64 = 0.05;

/// What the resistance is multiplied by after a step that came to balance, and after one that did not.
const EASIER: f64 = 0.2;
const HARDER: f64 = 8.0;

/// More than so many times the first resistance is not tried.
const HARDEST: f64 = 1e8;

/// The arm by which rotations are resisted, as part of the length of the scene.
const ARM: f64 = 0.05;

/// After a step that moves less (lengths of the scene, radians) balance is tried without resistance.
const NEAR: f64 = 1e-2;

/// Where steps move less, and there is no balance without resistance, there will be none.
const STILL: f64 = 1e-10;

/// Balance is not further away than that.
const AROUND: f64 = 0.1;

/// What is unstable is pushed by this (lengths of the scene, radians).
const PUSH: f64 = 1e-3;

/// What moves further than so many lengths of the scene, nothing holds.
const AWAY: f64 = 100.0;

/// Steps in all, those that fail among them.
const MOST_STEPS: usize = 500;

/// The load is applied in parts; each that fails is tried again in so many.
const DIVISOR: f64 = 4.0;

/// Parts of the stage that are not divided further.
const SMALLEST: f64 = 1.0 / 65536.0;

/// A stage with an artificial resistance beside its effects.
struct Resisted {
    assembly: Assembly,
    newton: Newton,
    /// Steps that are left
    steps: usize,
}

impl Resisted {
    /// The negative pivots of a state under resistance, where they tell.
    fn count_pivots(&mut self, state: &State, work: &mut Work) -> Option<usize> {
        self.assembly.forget();
        self.assembly.evaluate(state, Weights::STIFFNESS, None);
        let mut tangent = Tangent::that_may_go(&mut self.assembly, state, Weights::STIFFNESS);
        self.newton.count_pivots(&mut tangent, work)
    }
}

impl Run<'_> {
    /// From the last good state to one at rest at the load factor `target`; `false`, with the last good state, where none is found.
    pub(super) fn come_to_rest(&mut self, workshop: &mut Workshop, target: f64) -> Result<bool, Failure> {
        let start = self.good.kept();
        let mut resisted = self.resist()?;
        let mut part = target - start.load;
        let mut arrived = true;
        while arrived && self.good.load < target {
            let rest = target - self.good.load;
            let next = if part >= rest * (1.0 - 1e-9) { target } else { self.good.load + part };
            let before = self.good.kept();
            if self.fall(workshop, &mut resisted, next)? {
                part *= 2.0;
            } else {
                self.good.copy_all_but_rates(&before);
                part = (part / DIVISOR).min(rest / DIVISOR);
                arrived = part >= SMALLEST && resisted.steps > 0;
            }
        }
        self.count_evaluations(&resisted.assembly);
        if !arrived {
            self.good.copy_all_but_rates(&start);
            self.state.copy_all_but_rates(&start);
        }
        Ok(arrived)
    }

    fn resist(&self) -> Result<Resisted, Failure> {
        let stage = &self.plan.stages[self.stage];
        let equations = self.model.number(self.stage, self.plane).map_err(|error| self.describe(error))?;
        let slots = self.model.kinds.iter().enumerate().filter(|(_, kind)| !kind.is_multiplier());
        let slots = slots.map(|(slot, kind)| (slot as Slot, *kind == SlotKind::Rotation)).collect();
        let mut model = self.model.clone();
        model.effects.push(Arc::new(Resistance { slots, arm: ARM * model.length }));
        let assembly = Assembly::new(&stage.context(self.stage), equations, &model);
        let Some(solver) = LinearSolver::new(&assembly.system, &model.multipliers) else {
            return Err(Failure::Limit("not enough memory for the factorisation of the tangent".into()));
        };
        let convergence = Convergence { tolerance: stage.tolerance };
        let newton = Newton::new(convergence, stage.max_iterations, solver, &assembly.system);
        Ok(Resisted { assembly, newton, steps: MOST_STEPS })
    }

    /// At one load factor: steps against a resistance that fades, until the state is in balance without it. Each step leaves its state as
    /// the good one.
    fn fall(&mut self, workshop: &mut Workshop, resisted: &mut Resisted, load: f64) -> Result<bool, Failure> {
        let start = self.good.kept();
        let mut lift = Vec::new();
        self.state.copy_all_but_rates(&self.good);
        // With prescribed motions in the state: what they strain at once is to be resisted, too.
        let time = self.state.time;
        self.model.set_clock(&mut self.state, time, load);
        resisted.assembly.evaluate(&self.state, Weights::NONE, None);
        let gentle = self.model.largest_force(&resisted.assembly.system) / (GENTLE * self.model.length);
        self.state.copy_all_but_rates(&self.good);
        if self.set_load(&mut lift, load).is_err() {
            return Ok(false);
        }
        let mut resistance = gentle;
        let mut lifts = true;
        while gentle > 0.0 && resistance <= HARDEST * gentle && resisted.steps > 0 {
            self.observer.progress(self.moment(), self.static_progress(start.load))?;
            resisted.steps -= 1;
            self.state.anchor = Some(Arc::new(Anchor { resistance, q: self.state.q.clone() }));
            let lift = (lifts && !lift.is_empty()).then_some(&lift[..]);
            let Resisted { assembly, newton, .. } = resisted;
            let work = &mut self.counters.work;
            let solved = newton.solve(&self.model, assembly, &mut self.state, &Equilibrium, lift, work);
            let solved = solved.and_then(|()| self.refuse_leaps()).and_then(|()| self.refuse_windings());
            if solved.is_err() || resisted.count_pivots(&self.state, &mut self.counters.work) > Some(0) {
                // With less resistance than some motion gains by the forces there is no way along them.
                self.counters.cutbacks += 1;
                resistance *= HARDER;
                self.state.copy_all_but_rates(&self.good);
                if lifts && self.set_load(&mut Vec::new(), load).is_err() {
                    return Ok(false);
                }
                continue;
            }
            lifts = false;
            resistance *= EASIER;
            let moved = distance(&self.model, &self.good, &self.state);
            self.pass_through(&resisted.assembly.system)?;
            if distance(&self.model, &start, &self.good) > AWAY {
                return Ok(false);
            }
            if moved >= NEAR {
                continue;
            }
            if !self.balances(workshop, load) {
                if moved < STILL {
                    return Ok(false);
                }
                continue;
            }
            if self.count_unresisted(workshop) > Some(0) {
                // Balance, but not at rest: what is unstable is pushed on its way.
                self.push(resisted);
                resistance *= HARDER;
                continue;
            }
            self.good.copy_all_but_rates(&self.state);
            return Ok(true);
        }
        Ok(false)
    }

    /// Whether there is balance without resistance at the last good state; then it is the state of the run.
    fn balances(&mut self, workshop: &mut Workshop, load: f64) -> bool {
        let found = self.attempt(workshop, load).is_ok()
            && workshop.newton.contraction <= LARGEST_UNCOUNTED
            && distance(&self.model, &self.good, &self.state) < AROUND;
        if !found {
            self.state.copy_all_but_rates(&self.good);
        }
        found
    }

    /// The negative pivots of the state without resistance, where they tell.
    fn count_unresisted(&mut self, workshop: &mut Workshop) -> Option<usize> {
        let Workshop { assembly, newton, .. } = workshop;
        assembly.forget();
        assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        let mut tangent = Tangent::that_may_go(assembly, &self.state, Weights::STIFFNESS);
        newton.count_pivots(&mut tangent, &mut self.counters.work)
    }

    /// From the last good state a little along its softest motion.
    fn push(&mut self, resisted: &mut Resisted) {
        self.state.copy_all_but_rates(&self.good);
        let Resisted { assembly, newton, .. } = resisted;
        assembly.forget();
        assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        let mut tangent = Tangent::that_may_go(assembly, &self.state, Weights::STIFFNESS);
        let Some(softest) = newton.solver.softest(&mut tangent) else { return };
        let (_, mut motion) = softest.by_slot(&assembly.system.pattern.equations, self.state.q.len());
        let size = size(&self.model, &motion);
        let scale = if size > 0.0 { PUSH / size } else { 0.0 };
        let moves = self.model.kinds.iter().map(|kind| if kind.is_multiplier() { 0.0 } else { scale });
        motion.iter_mut().zip(moves).for_each(|(motion, scale)| *motion = *motion * scale);
        charts::carry(&mut self.state, &motion, &self.model.charted.rotations);
        Equilibrium.correct(&mut self.state, &motion);
    }
}
