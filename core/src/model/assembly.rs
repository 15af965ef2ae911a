//! The assembly of forces and tangents: the effects of one stage, and the system that they add to.

use super::linear::LinearisedSystem;
use super::{Model, StageContext};
use crate::effect::{Bending, Effect, PlanarForm, RoundOff, TangentForm};
use crate::interrupt;
use crate::kernel::Weights;
use crate::system::{
    Assembler, Category, Connectivity, DofMap, FrameConflict, ListedPair, Memory, Pattern, Plane, State, Symmetry,
    System, SystemSlice,
};
use crate::tensor::{Vec3, zeros};
use crate::threads;
use std::sync::Arc;

/// The effects of one stage with their memory, and the system that they add to.
pub struct Assembly {
    /// The stage that the effects act in
    pub(crate) stage: StageContext,
    effects: Vec<Acting>,
    /// Forces and tangent
    pub system: System,
    /// The number of evaluated instances of each effect so far, by name
    pub(crate) evaluations: Vec<(&'static str, u64)>,
    /// The matrices of a linear stage; `None` in other stages
    linear: Option<Box<LinearisedSystem>>,
    /// The pairs of beam elements in the pattern
    pairs: Arc<Vec<ListedPair>>,
}

/// An effect in a stage.
struct Acting {
    effect: Arc<dyn Effect>,
    /// The planar form that takes the place of the effect in a planar stage
    planar: Option<Box<dyn PlanarForm>>,
    memory: Memory,
    instances: u64,
    has_tangent: bool,
}

impl Acting {
    fn new(effect: Arc<dyn Effect>, plane: Option<&Plane>, instances: usize, pairs: &Arc<Vec<ListedPair>>) -> Self {
        let points = effect.roles().stresses.map_or(0, |stresses| stresses.memory_points());
        let memory = Memory { points: vec![[0.0; 6]; points], valid: false, pairs: pairs.clone() };
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

/// Adds forces and tangents of the instances that belong to a part of the system.
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

/// Adds the forces of effects with inertia or damping, without a tangent.
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
    /// The assembly of all effects that act in a stage, on the degrees of freedom `dof_map`, where no
    /// beams are near each other.
    pub fn new(stage: &StageContext, dof_map: DofMap, model: &Model) -> Self {
        Self::of(model.acting(stage), stage, dof_map, model, Arc::default())
    }

    /// The assembly of all effects that act in a stage, on the degrees of freedom `dof_map`, with the
    /// pairs of beam elements that are near each other in a state.
    pub fn about(at: &State, stage: &StageContext, dof_map: DofMap, model: &Model) -> Self {
        Self::of(model.acting(stage), stage, dof_map, model, at.contacts.pairs.list.clone())
    }

    /// The assembly of chosen effects in a stage, on the degrees of freedom `dof_map`, with pairs of
    /// beam elements near each other.
    pub fn of(
        acting: Vec<Arc<dyn Effect>>,
        stage: &StageContext,
        dof_map: DofMap,
        model: &Model,
        pairs: Arc<Vec<ListedPair>>,
    ) -> Self {
        let connectivity = threads::map(acting.iter(), |effect| effect.connectivity_with(&pairs));
        let plane = dof_map.plane();
        let acts = |(effect, own): (Arc<dyn Effect>, &Connectivity)| Acting::new(effect, plane, own.len(), &pairs);
        let effects: Vec<Acting> = acting.into_iter().zip(&connectivity).map(acts).collect();
        // Linear stages add forces of all categories at any slot.
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
            pairs,
        }
    }

    /// True if its pattern is that of the pairs of beam elements that are near each other in a state.
    pub fn fits(&self, at: &State) -> bool {
        let list = &at.contacts.pairs.list;
        Arc::ptr_eq(&self.pairs, list) || self.pairs == *list
    }

    /// Takes the forces of the present state, and what was counted, over from the assembly of other
    /// pairs.
    pub fn take_over(&mut self, other: Self) {
        self.evaluations = other.evaluations;
        self.system.force = other.system.force;
    }

    /// Makes the stage linear: forces and tangent are from now on linearised about a state.
    pub fn linearise(&mut self, model: &Model, about: &State) -> Result<(), FrameConflict> {
        self.remember_stress_of_origin(about);
        let effects = self.effects.iter().map(|acting| (&*acting.effect, &acting.memory));
        self.linear = Some(Box::new(LinearisedSystem::new(effects, model, about)?));
        Ok(())
    }

    /// Writes the stresses that form the geometric stiffness of a linear stage: those of the
    /// strains of its origin. Free strains act as loads, whose stress at the origin is relieved by
    /// displacements.
    fn remember_stress_of_origin(&mut self, origin: &State) {
        let mut without_loads = origin.clone();
        without_loads.amplitude.fill(0.0);
        let no_correction = zeros(origin.q.len());
        for acting in self.effects.iter_mut().filter(|acting| !acting.memory.points.is_empty()) {
            acting.extrapolate(&without_loads, &no_correction);
        }
    }

    /// Takes the stresses of the origin for the next tangent, which [`Self::forget`] has discarded.
    fn recall_stress_of_origin(&mut self) {
        self.effects.iter_mut().for_each(|acting| acting.memory.valid = !acting.memory.points.is_empty());
    }

    /// The forces of a linear stage; `None` in other stages.
    pub(crate) fn linear(&self) -> Option<&LinearisedSystem> {
        self.linear.as_deref()
    }

    /// The state about which the stage is linear; `None` in other stages.
    pub fn origin(&self) -> Option<&State> {
        self.linear().map(|linear| &linear.origin)
    }

    /// Forms the forces of the state and the tangent of the weights; `prescribed_increment`: see
    /// [`System::clear`]. With [`Weights::NONE`] the tangent is left as it is.
    pub fn evaluate(&mut self, state: &State, weights: Weights, prescribed_increment: Option<&[Vec3]>) {
        match self.linear.take() {
            None => self.evaluate_effects(state, weights, prescribed_increment),
            Some(mut linear) => {
                self.evaluate_linear(&mut linear, state, weights, prescribed_increment);
                self.linear = Some(linear);
            }
        }
    }

    /// Forms forces and tangent again as [`Self::evaluate`] does, also where factors have
    /// overwritten a tangent.
    pub fn form_again(&mut self, state: &State, weights: Weights) {
        if let Some(linear) = &mut self.linear {
            linear.formed = None;
        }
        let prescribed_increment = self.system.prescribed_increment().map(<[Vec3]>::to_vec);
        self.evaluate(state, weights, prescribed_increment.as_deref());
    }

    /// Forms forces of a linear stage, and its tangent if the weights have changed or increments
    /// are prescribed, which act through the tangent.
    fn evaluate_linear(
        &mut self,
        linear: &mut LinearisedSystem,
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
            self.recall_stress_of_origin();
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

    /// Adds forces and tangents, in parallel over the regions of a large scene, each after
    /// `make_ready`; then those of the instances that lie in no region. After a request to stop
    /// they stay incomplete.
    fn add_effects(&mut self, state: &State, weights: Weights, make_ready: impl Fn(&mut SystemSlice) + Send + Sync) {
        let Self { effects, system, evaluations, .. } = self;
        system.each_part(|part| {
            if interrupt::is_requested() {
                return;
            }
            make_ready(part);
            add_part(effects, state, weights, part);
        });
        if system.is_cut() {
            add_part(effects, state, weights, &mut system.whole());
        }
        evaluations.iter_mut().zip(effects).for_each(|((_, count), acting)| *count += acting.instances);
    }

    /// Writes the forces of inertia and damping of a state into `force`, whose other categories are
    /// left undefined; the forces of the system are kept. In a linear stage these are the forces of
    /// the rates of the state.
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

    /// True if an effect forms its tangent with extrapolated stresses.
    pub fn foresees(&self) -> bool {
        self.linear.is_none() && self.effects.iter().any(|acting| !acting.memory.points.is_empty())
    }

    /// Extrapolates the stresses of the next tangent, see
    /// [`StressPoints::extrapolate`](crate::effect::StressPoints::extrapolate).
    pub fn extrapolate(&mut self, state: &State, dq: &[Vec3]) {
        if !self.foresees() {
            return;
        }
        for acting in self.effects.iter_mut().filter(|acting| !acting.memory.points.is_empty()) {
            acting.extrapolate(state, dq);
        }
    }

    /// Discards extrapolated stresses at the start of a step.
    pub fn forget(&mut self) {
        self.effects.iter_mut().for_each(|acting| acting.memory.valid = false);
    }

    /// First and second derivatives over time of the gaps of joints, by slot of their multipliers;
    /// see [`Constraint::drift`](crate::effect::Constraint::drift).
    pub fn drift(&self, state: &State) -> [Vec<Vec3>; 2] {
        let Some(linear) = &self.linear else { return self.drift_of_effects(state) };
        // Gaps are linear in displacements: velocities have no part in second derivatives.
        let mut origin = linear.origin_with_loads_of(state);
        origin.a.copy_from(&state.a);
        let [_, rates2] = self.drift_of_effects(&origin);
        origin.v.copy_from(&state.v);
        let [rates, _] = self.drift_of_effects(&origin);
        [rates, rates2]
    }

    fn drift_of_effects(&self, state: &State) -> [Vec<Vec3>; 2] {
        let [mut rates, mut rates2] = [state.q.len(); 2].map(zeros);
        let constraints = self.effects.iter().filter_map(|acting| acting.effect.roles().constraint);
        constraints.for_each(|constraint| constraint.drift(state, &mut rates, &mut rates2));
        [rates, rates2]
    }

    /// The largest round-off of forces and moments among the effects.
    pub fn round_off(&self, state: &State) -> RoundOff {
        let stresses = self.effects.iter().filter_map(|acting| acting.effect.roles().stresses);
        stresses.map(|stresses| stresses.round_off(state)).fold(RoundOff::default(), RoundOff::or)
    }

    /// Shows the bending at all integration points of beams, see [`StressPoints::each_bending`](crate::effect::StressPoints::each_bending).
    /// `origin` is the state about which the stage is linear; `None` in other stages.
    pub fn each_bending(&self, state: &State, origin: Option<&State>, show: &mut dyn FnMut(Bending)) {
        let stresses = self.effects.iter().filter_map(|acting| acting.effect.roles().stresses);
        stresses.for_each(|stresses| stresses.each_bending(state, origin, show));
    }

    /// The largest strain that a field of increments makes, see [`Effect::strain_of`].
    pub fn strain_of(&self, state: &State, field: &[Vec3], length: f64) -> f64 {
        let state = self.origin().unwrap_or(state);
        self.effects.iter().map(|acting| acting.effect.strain_of(state, field, length)).fold(0.0, f64::max)
    }

    /// The quadratic form x.K x of a field at a state: from the strains of effects that have them,
    /// and from the tangents of the others. `None` if no effect gives it by strains. The tangent of
    /// the system is overwritten.
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

    /// The name of the first effect whose forces are not finite, with the slot.
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
