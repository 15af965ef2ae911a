//! The effects of one stage, and the system that they add to.

use super::linear::Linear;
use super::{Model, StageContext};
use crate::effect::{Effect, PlanarForm, RoundOff, TangentForm};
use crate::kernel::Weights;
use crate::system::{
    Assembler, Category, Connectivity, DofMap, FrameConflict, Memory, Pattern, Plane, State, Symmetry, System,
    SystemSlice,
};
use crate::tensor::{Vec3, zeros};
use crate::threads;
use std::sync::Arc;

/// The effects of one stage with their scratch, and the system they add to.
pub struct Assembly {
    /// The stage
    pub stage: StageContext,
    effects: Vec<Acting>,
    /// Forces and tangent
    pub system: System,
    /// Evaluations of each effect's instances so far, by name
    pub evaluations: Vec<(&'static str, u64)>,
    /// In linear stages
    linear: Option<Box<Linear>>,
}

/// An effect in a stage.
struct Acting {
    effect: Arc<dyn Effect>,
    /// The form that adds in its place, where the stage is treated in a plane
    planar: Option<Box<dyn PlanarForm>>,
    memory: Memory,
    instances: u64,
    has_tangent: bool,
}

impl Acting {
    fn new(effect: Arc<dyn Effect>, plane: Option<&Plane>, instances: usize) -> Self {
        let points = effect.roles().stresses.map_or(0, |stresses| stresses.memory_points());
        let memory = Memory { points: vec![[0.0; 6]; points], valid: false };
        let planar = plane.and_then(|plane| effect.clone().in_plane(plane));
        Self { has_tangent: effect.tangent().exists(), effect, planar, memory, instances: instances as u64 }
    }

    fn is_symmetric(&self) -> bool {
        match &self.planar {
            None => self.effect.tangent() != TangentForm::General,
            Some(planar) => planar.is_symmetric(),
        }
    }

    /// The categories of its forces.
    fn categories(&self) -> impl Iterator<Item = Category> {
        std::iter::once(self.effect.category()).chain(self.effect.damps().then_some(Category::Damping))
    }

    fn add(&self, at: &State, weights: Weights, out: &mut Assembler) {
        match &self.planar {
            None => self.effect.add(at, &self.memory, weights, out),
            Some(planar) => planar.add(at, &self.memory, weights, out),
        }
    }

    fn extrapolate(&mut self, at: &State, dq: &[Vec3]) {
        match &self.planar {
            None => {
                if let Some(stresses) = self.effect.roles().stresses {
                    stresses.extrapolate(at, dq, &mut self.memory);
                }
            }
            Some(planar) => planar.extrapolate(at, dq, &mut self.memory),
        }
    }
}

/// Adds the instances that belong to a part of the system.
fn add_part(effects: &[Acting], state: &State, weights: Weights, part: &mut SystemSlice) {
    for (number, acting) in effects.iter().enumerate() {
        let with_tangent = weights != Weights::NONE && acting.has_tangent;
        let weights = if with_tangent { weights } else { Weights::NONE };
        for instances in part.instances(number) {
            let category = acting.effect.category();
            acting.add(state, weights, &mut part.assembler(number, category, with_tangent, instances.clone()));
        }
    }
}

/// Adds the forces of effects that inertia or damping come from, without a tangent.
fn add_rates(effects: &[Acting], state: &State, part: &mut SystemSlice) {
    for (number, acting) in effects.iter().enumerate() {
        if !acting.categories().any(|category| matches!(category, Category::Inertia | Category::Damping)) {
            continue;
        }
        for instances in part.instances(number) {
            let category = acting.effect.category();
            acting.add(state, Weights::NONE, &mut part.assembler(number, category, false, instances.clone()));
        }
    }
}

impl Assembly {
    /// The system of what acts in a stage on these equations.
    pub fn new(stage: &StageContext, dof_map: DofMap, model: &Model) -> Self {
        Self::of(model.acting(stage), stage, dof_map, model)
    }

    /// The system of these effects in a stage on these equations.
    pub fn of(acting: Vec<Arc<dyn Effect>>, stage: &StageContext, dof_map: DofMap, model: &Model) -> Self {
        let connectivity = threads::map(acting.iter(), |effect| effect.connectivity());
        let acts = |(effect, own): (Arc<dyn Effect>, &Connectivity)| Acting::new(effect, dof_map.plane(), own.len());
        let effects: Vec<Acting> = acting.into_iter().zip(&connectivity).map(acts).collect();
        // Linear stages add their forces by themselves.
        let everywhere: &[Category] = if model.is_linear(stage.kind) { &Category::ALL } else { &[] };
        let categories: Vec<Vec<Category>> = effects.iter().map(|acting| acting.categories().collect()).collect();
        let node_blocks = model.node_blocks(dof_map.layout());
        let symmetry = Symmetry::of(connectivity.iter().zip(effects.iter().map(Acting::is_symmetric)), &node_blocks);
        Self {
            stage: *stage,
            evaluations: effects.iter().map(|acting| (acting.effect.name(), 0)).collect(),
            system: System::new(
                Pattern::new(dof_map, node_blocks, connectivity, symmetry),
                model.slots(),
                everywhere,
                &categories,
            ),
            effects,
            linear: None,
        }
    }

    /// From here on everything is linear about a state.
    pub fn linearise(&mut self, model: &Model, about: &State) -> Result<(), FrameConflict> {
        self.linear = Some(Box::new(Linear::new(self.effects.iter().map(|acting| &*acting.effect), model, about)?));
        Ok(())
    }

    /// Forces of the state, and the tangent of the weights; `prescribed_increment`: see
    /// [`System::clear`]. Without weights the tangent is left as it is.
    pub fn evaluate(&mut self, state: &State, weights: Weights, prescribed_increment: Option<&[Vec3]>) {
        match self.linear.take() {
            None => self.evaluate_effects(state, weights, prescribed_increment),
            Some(mut linear) => {
                self.evaluate_linear(&mut linear, state, weights, prescribed_increment);
                self.linear = Some(linear);
            }
        }
    }

    /// Forces and tangent as [`Self::evaluate`] forms them, also where factors have taken the place
    /// of a tangent that was formed already.
    pub fn form_again(&mut self, state: &State, weights: Weights) {
        if let Some(linear) = &mut self.linear {
            linear.formed = None;
        }
        let prescribed_increment = self.system.prescribed_increment().map(<[Vec3]>::to_vec);
        self.evaluate(state, weights, prescribed_increment.as_deref());
    }

    /// The tangent is formed where its weights change; and where increments are prescribed, which
    /// act through it.
    fn evaluate_linear(
        &mut self,
        linear: &mut Linear,
        state: &State,
        weights: Weights,
        prescribed_increment: Option<&[Vec3]>,
    ) {
        linear.follow(state);
        let known = weights == Weights::NONE
            || (prescribed_increment.is_none() && linear.formed == Some((weights, self.system.revision)));
        if known {
            self.system.clear_forces();
        } else {
            self.forget();
            self.evaluate_effects(&linear.origin, weights, prescribed_increment);
            self.system.forget_forces();
            linear.formed = Some((weights, self.system.revision));
        }
        self.add_effects(&linear.about, Weights::NONE, |_| ());
        linear.add_forces(state, &mut self.system.force);
    }

    fn evaluate_effects(&mut self, state: &State, weights: Weights, prescribed_increment: Option<&[Vec3]>) {
        let with_tangent = weights != Weights::NONE;
        debug_assert!(with_tangent || prescribed_increment.is_none(), "prescribed increments act through the tangent");
        self.system.begin(with_tangent, prescribed_increment);
        // Memory that has just been cleared is still in the cache.
        self.add_effects(state, weights, |part| part.clear(with_tangent));
    }

    /// Regions of a large scene at once, each after it was made ready, then what lies in none.
    fn add_effects(&mut self, state: &State, weights: Weights, make_ready: impl Fn(&mut SystemSlice) + Send + Sync) {
        let Self { effects, system, evaluations, .. } = self;
        system.each_part(|part| {
            make_ready(part);
            add_part(effects, state, weights, part);
        });
        if system.is_cut() {
            add_part(effects, state, weights, &mut system.whole());
        }
        evaluations.iter_mut().zip(effects).for_each(|((_, count), acting)| *count += acting.instances);
    }

    /// Inertia and damping of a state alone, into other forces than those of the system, which
    /// stay; what else stands there is nobody's. In linear stages those of its rates.
    pub fn evaluate_rates(&mut self, state: &State, force: &mut [Vec<Vec3>; 4]) {
        if let Some(linear) = &self.linear {
            force.iter_mut().for_each(|force| force.fill(Vec3::ZERO));
            return linear.add_rates(state, force);
        }
        std::mem::swap(&mut self.system.force, force);
        let Self { effects, system, .. } = self;
        system.each_part(|part| {
            part.clear(false);
            add_rates(effects, state, part);
        });
        if system.is_cut() {
            add_rates(effects, state, &mut system.whole());
        }
        std::mem::swap(&mut self.system.force, force);
    }

    /// Tells whether any effect forms tangents with stresses that it foresees.
    pub fn foresees(&self) -> bool {
        self.linear.is_none() && self.effects.iter().any(|acting| !acting.memory.points.is_empty())
    }

    /// Lets effects remember what the next tangent is formed with, see [`StressPoints::extrapolate`](crate::effect::StressPoints::extrapolate).
    pub fn extrapolate(&mut self, state: &State, dq: &[Vec3]) {
        if !self.foresees() {
            return;
        }
        for acting in self.effects.iter_mut().filter(|acting| !acting.memory.points.is_empty()) {
            acting.extrapolate(state, dq);
        }
    }

    /// Forgets what was remembered: a new step begins.
    pub fn forget(&mut self) {
        self.effects.iter_mut().for_each(|acting| acting.memory.valid = false);
    }

    /// First and second derivatives over time of the gaps of joints, by slot of their multipliers;
    /// see [`Constraint::drift`](crate::effect::Constraint::drift).
    pub fn drift(&self, state: &State) -> [Vec<Vec3>; 2] {
        let [mut rates, mut rates2] = [state.q.len(); 2].map(zeros);
        let constraints = self.effects.iter().filter_map(|acting| acting.effect.roles().constraint);
        constraints.for_each(|constraint| constraint.drift(state, &mut rates, &mut rates2));
        [rates, rates2]
    }

    /// The largest round-off among the effects.
    pub fn round_off(&self, state: &State) -> RoundOff {
        let stresses = self.effects.iter().filter_map(|acting| acting.effect.roles().stresses);
        stresses.map(|stresses| stresses.round_off(state)).fold(RoundOff::default(), RoundOff::or)
    }

    /// The largest strain that a field makes, see [`Effect::strain_of`].
    pub fn strain_of(&self, state: &State, field: &[Vec3], length: f64) -> f64 {
        self.effects.iter().map(|acting| acting.effect.strain_of(state, field, length)).fold(0.0, f64::max)
    }

    /// x.K x of a field at a state, from strains where an effect tells them, and from tangents of
    /// the others; `None` where no effect does. The tangent is used up.
    pub fn stiffness_along(&mut self, state: &State, field: &[Vec3]) -> Option<f64> {
        let told_by = |acting: &Acting| acting.effect.roles().stresses?.stiffness_along(state, field);
        let told: Vec<Option<f64>> = self.effects.iter().map(told_by).collect();
        if told.iter().all(Option::is_none) || self.linear.is_some() {
            return None;
        }
        self.system.clear(None);
        for (number, acting) in self.effects.iter().enumerate().filter(|(k, a)| told[*k].is_none() && a.has_tangent) {
            let category = acting.effect.category();
            acting.add(state, Weights::STIFFNESS, &mut self.system.assembler(number, category, true));
        }
        let dof_map = &self.system.pattern.dof_map;
        let mut x = vec![0.0; dof_map.count()];
        dof_map.gather(|slot| field[slot], &mut x);
        let others = self.system.multiply(&self.system.values, &x);
        let others: f64 = others.iter().zip(&x).map(|(a, b)| a * b).sum();
        Some(told.iter().flatten().sum::<f64>() + others)
    }

    /// The name of the first effect whose forces are not finite, and the slot.
    pub fn culprit(&mut self, state: &State) -> Option<(&'static str, usize)> {
        for (number, acting) in self.effects.iter().enumerate() {
            self.system.clear(None);
            let category = acting.effect.category();
            acting.add(state, Weights::NONE, &mut self.system.assembler(number, category, false));
            let forces = &self.system.force[category as usize];
            if let Some(slot) = forces.iter().position(|f| !f.is_finite()) {
                return Some((acting.effect.name(), slot));
            }
        }
        None
    }
}
