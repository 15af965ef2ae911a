//! Faults of a plan that show before anything is computed: stages that cannot begin, and histories
//! that jump, or change where time steps do not see it.
//!
//! Loads, motions and motors go through their stages as in a run, on a state in which nothing but
//! prescribed motions moves.

use super::plan::{InitialMotion, Plan, Stage, StageWork, TimeStepping};
use super::sampling::{missed_part, missed_part_of_samples, missed_peak, sampled_load_factors};
use crate::model::{Model, Motion, MotionKind, NOTICED, Schedule, StageError, StageKind, Timeline};
use crate::system::{DofMap, Slot, State};
use crate::tensor::Vec3;
use std::collections::HashMap;

/// Values of a history that agree to this part of the larger one are the same.
const SAME_VALUE: f64 = 1e-9;

/// Velocities that agree to this part of the larger one are the same: those of initial motions come
/// from other numbers.
pub(super) const SAME_VELOCITY: f64 = 1e-6;

/// The way of a whole stage with a velocity that is round-off, in lengths of the scene or radians.
pub(super) const INVISIBLE_WAY: f64 = 1e-12;

/// Axes with this cosine are the same.
const SAME_AXIS: f64 = 1.0 - 1e-9;

/// Faults of a plan.
#[derive(Debug, Default)]
pub struct Rehearsal {
    /// Stages, from 0, that cannot begin
    pub refusals: Vec<(usize, StageError)>,
    /// Where what histories drive jumps
    pub jumps: Vec<HistoryJump>,
}

/// Something driven by a history jumps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HistoryJump {
    /// The stage, from 0
    pub stage: usize,
    /// The load, motion or motor that jumps
    pub what: Driven,
    /// How
    pub how: JumpKind,
}

/// A load, motion or motor that a history drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driven {
    /// The loads with the amplitude of this number
    Amplitude(usize),
    /// The motion with this number
    Motion(usize),
    /// The motor of the joint with this multiplier
    Motor(Slot),
}

/// How something jumps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JumpKind {
    /// From one value to another where a stage begins
    Value {
        /// At the end of the stage before
        from: f64,
        /// At the start of this one
        to: f64,
    },
    /// From one velocity to another where a dynamic stage begins
    Velocity {
        /// The velocity of its nodes
        from: f64,
        /// The velocity that it begins with
        to: f64,
    },
    /// In its velocity, within a stage
    Kink {
        /// The run's clock
        time: f64,
    },
    /// Between the ends of fixed time steps, which do not see all of it
    BetweenSteps {
        /// The share that they miss of the impulse of a load, or of the way of a motion
        part: f64,
    },
    /// Between load levels, which do not see its peak
    BetweenLevels {
        /// How far it goes beyond its values at the levels around it, over its range
        part: f64,
    },
    /// It has no finite value, velocity or acceleration where the stage begins.
    NotFinite,
}

/// Goes through all stages of a plan.
pub fn rehearse(plan: &Plan) -> Rehearsal {
    let mut rehearser = Rehearser::new(plan);
    for (number, stage) in plan.stages.iter().enumerate() {
        rehearser.begin(number, stage);
        rehearser.end(number, stage);
    }
    rehearser.found
}

/// The condition that a stage lacks to begin, whatever the state: a load that grows, or mass.
/// `fading`: forces that a motion left may fade with the load factor.
pub(super) fn lacking(
    model: &Model,
    schedule: &Schedule,
    stage: &Stage,
    number: usize,
    fading: bool,
    dof_map: impl FnOnce() -> Option<DofMap>,
) -> Option<StageError> {
    let kind = stage.work.kind();
    if stage.work.follows_path() && !fading && !stage.rotating && schedule.is_idle() {
        return Some(StageError::NothingGrows(kind));
    }
    let lacks_mass = kind.needs_mass() && dof_map().is_some_and(|free| model.lacks_mass(&stage.context(number), &free));
    lacks_mass.then_some(StageError::NoMass)
}

struct Rehearser<'p> {
    model: &'p Model,
    schedule: Schedule,
    state: State,
    initial: &'p [InitialMotion],
    found: Rehearsal,
    /// For each motion whether where its node is depends on nothing but motions and supports
    determined: Vec<bool>,
    /// True if the stages so far end where they say, and not at an `until`
    sure: bool,
    /// The stage that led to the present state
    before: Option<Before>,
    has_moved: bool,
}

/// The last static or dynamic stage.
struct Before {
    number: usize,
    /// For each amplitude its rate at the end
    rates: Vec<f64>,
    /// For each motion that acted its velocity at the end
    velocities: Vec<Option<f64>>,
}

/// The axes of a slot that motions and supports hold.
#[derive(Default)]
struct HeldAxes {
    axes: Vec<Vec3>,
    /// True if it is a rotation that is prescribed as a whole
    turned: bool,
}

impl<'p> Rehearser<'p> {
    fn new(plan: &'p Plan) -> Self {
        let model = &*plan.model;
        Self {
            schedule: Schedule::new(model),
            state: model.rest(),
            initial: &plan.initial,
            found: Rehearsal::default(),
            determined: vec![true; model.motions.len()],
            model,
            sure: true,
            before: None,
            has_moved: false,
        }
    }

    fn begin(&mut self, number: usize, stage: &Stage) {
        let kind = stage.work.kind();
        let clock = self.state.time;
        let fresh = number == 0 || self.schedule.has_fresh_loads(self.model, number);
        let jumps = self.schedule.settle(self.model, number, kind, &self.state);
        if self.sure {
            let certain = jumps.into_iter().filter(|jump| self.determined[jump.motion]);
            self.found.refusals.extend(certain.map(|jump| (number, StageError::Jump(jump))));
            self.look_at_hinges(number);
            self.look_at_amplitudes(number, kind);
            self.look_at_static_motions(number, kind);
        }
        let fading = self.has_moved && kind.ramps_load();
        let lacks =
            lacking(self.model, &self.schedule, stage, number, fading, || self.schedule.dof_map(self.model, None).ok());
        self.found.refusals.extend(lacks.map(|error| (number, error)));
        let amplitude = self.state.amplitude.clone();
        self.state.load = kind.first_load(self.state.load, fresh);
        if !kind.advances_time() {
            let load = self.state.load;
            self.schedule.set_clock(self.model, &mut self.state, clock, load);
            if self.sure && kind.ramps_load() {
                let leaps = self.model.motor_leaps(&amplitude, &self.state);
                self.found.refusals.extend(leaps.into_iter().map(|leap| (number, StageError::MotorJump(leap))));
            }
            if let StageWork::Static { steps, .. } = stage.work {
                self.look_between_levels(number, steps);
            }
            return;
        }
        let begins = !std::mem::replace(&mut self.has_moved, true);
        if begins {
            self.state.stand_still();
            self.initial.iter().for_each(|motion| motion.give_to(&mut self.state));
            self.model.constraints().for_each(|constraint| constraint.follow_nodes(&mut self.state));
        }
        let given = self.state.v.clone();
        self.schedule.set_clock(self.model, &mut self.state, clock, 1.0);
        if !self.sure {
            return;
        }
        let motors = self.model.motor_jumps(&amplitude, &self.state);
        self.found.refusals.extend(motors.into_iter().map(|jump| (number, StageError::MotorJump(jump))));
        let surfaces = self.model.surface_jumps(&amplitude, &self.state);
        self.found.refusals.extend(surfaces.into_iter().map(|jump| (number, StageError::SurfaceJump(jump))));
        let given = begins.then_some(&given[..]);
        if let StageWork::Dynamic(steps) = &stage.work {
            let slowest = INVISIBLE_WAY / (steps.end - clock);
            self.look_at_velocities(number, given, slowest);
            self.look_at_motors(number, begins, slowest);
            self.look_at_kinks(number, steps.end);
            self.look_between_steps(number, steps);
        }
    }

    /// Rotations that motions have turned.
    fn look_at_hinges(&mut self, number: usize) {
        if self.model.motions.iter().any(|motion| motion.kind == MotionKind::Rotation) {
            let turned = self.schedule.refuse_turned_hinges(self.model, &self.state);
            self.found.refusals.extend(turned.err().map(|error| (number, error)));
        }
    }

    /// Loads, free strains and motors whose history goes on in this stage, and that have acted in
    /// the one before.
    fn look_at_amplitudes(&mut self, number: usize, kind: StageKind) {
        let Some(before) = &self.before else { return };
        let load = if kind.ramps_load() { 0.0 } else { 1.0 };
        for (k, timeline) in self.schedule.loads(self.model).enumerate() {
            let from = timeline.reached();
            let [to, ..] = timeline.at(self.state.time, load);
            let acted = self.model.amplitudes[k].acts_in(before.number);
            if timeline.follows_history() && acted && differ(from, to, SAME_VALUE) {
                let how = JumpKind::Value { from, to };
                self.found.jumps.push(HistoryJump { stage: number, what: Driven::Amplitude(k), how });
            }
        }
    }

    /// In dynamic stages they are refused.
    fn look_at_static_motions(&mut self, number: usize, kind: StageKind) {
        if self.before.is_none() || !kind.ramps_load() {
            return;
        }
        for (k, (motion, timeline)) in self.schedule.motions(self.model).enumerate() {
            let from = timeline.reached();
            let [to, ..] = timeline.at(self.state.time, 0.0);
            let jumps = timeline.follows_history() && motion.is_apart(from, to, self.model.length);
            if self.determined[k] && jumps {
                let how = JumpKind::Value { from, to };
                self.found.jumps.push(HistoryJump { stage: number, what: Driven::Motion(k), how });
            }
        }
    }

    /// Motions at the start of a dynamic stage. `given`: the velocities that initial motions give,
    /// where they do. `slowest`: smaller velocities are round-off, in lengths of the scene or radians.
    fn look_at_velocities(&mut self, number: usize, given: Option<&[Vec3]>, slowest: f64) {
        let motions = self.schedule.motions(self.model).enumerate();
        for (k, (motion, timeline)) in motions.filter(|(_, (_, timeline))| timeline.acts()) {
            let [value, rate, rate2] = timeline.at(self.state.time, 1.0);
            let from = match (given, &self.before) {
                (Some(given), _) => Some(velocity_along(motion, given, rate)),
                (None, Some(before)) => before.velocities[k],
                (None, None) => Some(0.0),
            };
            let size = if motion.kind == MotionKind::Translation { self.model.length } else { 1.0 };
            let how = if ![value, rate, rate2].iter().all(|value| value.is_finite()) {
                Some(JumpKind::NotFinite)
            } else {
                let noticed = noticed_jump(motion.amplitude.fastest(), slowest * size);
                from.and_then(|from| velocity_jump(from, rate, noticed, given.is_some()))
            };
            self.found.jumps.extend(how.map(|how| HistoryJump { stage: number, what: Driven::Motion(k), how }));
        }
    }

    /// Motors at the start of a dynamic stage. `begins`: initial motions set the scene in motion. `slowest`: see
    /// [`Self::look_at_velocities`].
    fn look_at_motors(&mut self, number: usize, begins: bool, slowest: f64) {
        // How fast a joint turns that a static stage has turned before is known to nobody yet.
        if begins && self.before.is_some() && !self.initial.is_empty() {
            return;
        }
        let (state, before, jumps) = (&self.state, &self.before, &mut self.found.jumps);
        let amplitudes = &self.model.amplitudes;
        self.model.each_motor(state, &mut |motor| {
            let to = motor.value * state.amplitude_rates[motor.amplitude][0];
            let from = match before {
                Some(before) if !begins => motor.value * before.rates[motor.amplitude],
                _ => motor.speed,
            };
            let fastest = amplitudes[motor.amplitude].fastest().map(|rate| (rate * motor.value).abs());
            let size = if motor.turns { 1.0 } else { self.model.length };
            let how = velocity_jump(from, to, noticed_jump(fastest, slowest * size), begins);
            jumps.extend(how.map(|how| HistoryJump { stage: number, what: Driven::Motor(motor.slot), how }));
        });
    }

    /// Velocities that jump within a dynamic stage.
    fn look_at_kinks(&mut self, number: usize, end: f64) {
        let (clock, jumps) = (self.state.time, &mut self.found.jumps);
        let mut look = |next: Option<f64>, what: Driven| {
            let how = next.filter(|&time| time < end).map(|time| JumpKind::Kink { time });
            jumps.extend(how.map(|how| HistoryJump { stage: number, what, how }));
        };
        for (k, (_, timeline)) in self.schedule.motions(self.model).enumerate() {
            look(timeline.next_kink(clock), Driven::Motion(k));
        }
        self.model.each_motor(&self.state, &mut |motor| {
            look(self.schedule.load(self.model, motor.amplitude).next_kink(clock), Driven::Motor(motor.slot));
        });
    }

    /// Loads, and velocities of motions and motors, that change between the ends of fixed steps.
    fn look_between_steps(&mut self, number: usize, steps: &TimeStepping) {
        let time = self.state.time;
        if steps.adaptive.is_some() || steps.end <= time {
            return;
        }
        let range = [time, steps.end];
        let mut known = HashMap::new();
        for (what, timeline) in driven(self.model, &self.schedule, &self.state) {
            let Some(identity) = timeline.history_identity() else { continue };
            let (derivative, first) = match what {
                Driven::Amplitude(_) => (0, timeline.at(time, 1.0)[0]),
                // The way is the impulse of the velocity. Kinks are told anyway.
                Driven::Motion(_) | Driven::Motor(_) if timeline.next_kink(time).is_some() => continue,
                Driven::Motion(_) | Driven::Motor(_) => (1, 0.0),
            };
            let look = || missed_between_steps(&timeline, derivative, first, range, steps.step);
            let part = *known.entry((identity, derivative)).or_insert_with(look);
            let how = part.map(|part| JumpKind::BetweenSteps { part });
            self.found.jumps.extend(how.map(|how| HistoryJump { stage: number, what, how }));
        }
    }

    /// Loads, motions and motors whose history rises and falls between two load levels.
    fn look_between_levels(&mut self, number: usize, levels: usize) {
        let time = self.state.time;
        let mut known = HashMap::new();
        for (what, timeline) in driven(self.model, &self.schedule, &self.state) {
            let Some(identity) = timeline.history_identity() else { continue };
            let look = || missed_peak(|load| timeline.at(time, load)[0], &places_to_look(&timeline), levels);
            let part = *known.entry(identity).or_insert_with(look);
            let how = part.map(|part| JumpKind::BetweenLevels { part });
            self.found.jumps.extend(how.map(|how| HistoryJump { stage: number, what, how }));
        }
    }

    fn end(&mut self, number: usize, stage: &Stage) {
        let kind = stage.work.kind();
        let time = stage.work.end().unwrap_or(self.state.time);
        let load = kind.last_load(self.state.load);
        self.schedule.set_clock(self.model, &mut self.state, time, load);
        self.schedule.end_stage(self.model, &self.state);
        self.sure &= stage.until.is_none();
        if !kind.advances_state() {
            return;
        }
        let velocity = |timeline: Timeline| timeline.acts().then(|| timeline.rate_before(time));
        let velocities = self.schedule.motions(self.model).map(|(_, timeline)| velocity(timeline));
        self.before = Some(Before {
            number,
            rates: self.schedule.loads(self.model).map(|timeline| timeline.rate_before(time)).collect(),
            velocities: velocities.collect(),
        });
        self.look_for_loose_ends(number);
    }

    /// Finds the motions whose nodes motions and supports of this stage alone do not hold.
    fn look_for_loose_ends(&mut self, stage: usize) {
        let mut held: HashMap<Slot, HeldAxes> = HashMap::new();
        for (motion, timeline) in self.schedule.motions(self.model) {
            let held = held.entry(motion.slot).or_default();
            if timeline.acts() {
                held.axes.push(motion.axis);
                held.turned |= motion.kind == MotionKind::Rotation;
            }
        }
        let supports = self.model.supports.iter().filter(|support| support.stages.contains(stage));
        for direction in supports.flat_map(|support| &support.directions) {
            if let Some(held) = held.get_mut(&direction.slot) {
                held.axes.push(direction.axis);
            }
        }
        for (determined, motion) in self.determined.iter_mut().zip(&self.model.motions) {
            let Some(HeldAxes { axes, turned }) = held.get(&motion.slot) else { continue };
            let along = |axis: Vec3| axes.iter().any(|other| other.dot(axis).abs() > SAME_AXIS);
            let whole = *turned || Vec3::UNIT.into_iter().all(along);
            *determined &= whole || (motion.kind == MotionKind::Translation && along(motion.axis));
        }
    }
}

/// All that histories may drive, with its course in the present stage.
fn driven<'a>(model: &'a Model, schedule: &'a Schedule, state: &State) -> Vec<(Driven, Timeline<'a>)> {
    let mut of_motors = vec![None; model.amplitudes.len()];
    model.each_motor(state, &mut |motor| of_motors[motor.amplitude] = Some(motor.slot));
    let loads = schedule.loads(model).enumerate();
    let loads = loads.map(|(k, timeline)| (of_motors[k].map_or(Driven::Amplitude(k), Driven::Motor), timeline));
    let motions = schedule.motions(model).enumerate().map(|(k, (_, timeline))| (Driven::Motion(k), timeline));
    loads.chain(motions).collect()
}

/// What fixed time steps miss of a derivative of a course, see [`missed_part`].
fn missed_between_steps(timeline: &Timeline, derivative: usize, first: f64, range: [f64; 2], step: f64) -> Option<f64> {
    let value = |time| timeline.at(time, 1.0)[derivative];
    match timeline.knows_corners() {
        true => missed_part(value, |time| timeline.next_corner(time), first, range, step),
        false => missed_part_of_samples(value, first, range, step),
    }
}

/// The load factors of a static stage at which a course may have a peak.
fn places_to_look(timeline: &Timeline) -> Vec<f64> {
    if !timeline.knows_corners() {
        return sampled_load_factors();
    }
    let next = |load| timeline.next_corner_of_load(load);
    std::iter::successors(next(0.0), |&corner| next(corner)).take_while(|&corner| corner < 1.0).collect()
}

/// The velocity that a motion's node has along it; that of a rotation about another axis is none
/// that it could go on with.
fn velocity_along(motion: &Motion, given: &[Vec3], rate: f64) -> f64 {
    let own = given[motion.slot as usize];
    let along = own.dot(motion.axis);
    let aside = (own - motion.axis * along).norm();
    let fits = motion.kind == MotionKind::Translation || aside <= SAME_VELOCITY * rate.abs();
    if fits { along } else { 0.0 }
}

/// The smallest jump of a velocity that is told.
pub(super) fn noticed_jump(fastest: Option<f64>, slowest: f64) -> f64 {
    fastest.map_or(slowest, |fastest| slowest.max(NOTICED * fastest))
}

/// A jump of a velocity; none where initial motions move the node of a motion that begins at rest:
/// the scene begins with the velocity of the motion.
fn velocity_jump(from: f64, to: f64, noticed: f64, begins: bool) -> Option<JumpKind> {
    let jumps = (to - from).abs() > noticed && differ(from, to, SAME_VELOCITY) && (to != 0.0 || !begins);
    jumps.then_some(JumpKind::Velocity { from, to })
}

fn differ(a: f64, b: f64, same: f64) -> bool {
    (a - b).abs() > same * a.abs().max(b.abs())
}
