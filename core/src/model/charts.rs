//! Changes of chart at nodes, and the choice of charts in elements.

use super::{Charted, ElementInfo};
use crate::kernel::seam;
use crate::rotation::{Complement, Rotation, log, relative_angle, unwound};
use crate::system::{Slot, State};
use crate::tensor::Vec3;
use crate::threads::{self, PART};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::ops::Range;

/// The band beyond pi in which a node keeps its chart in dynamics, so that it cannot chatter.
pub const DYNAMIC_BAND: f64 = 1e-3;

/// The band beyond pi in which a node keeps its chart in statics: nodes that are held at pi itself
/// must not change at every iterate.
pub const STATIC_BAND: f64 = 1e-9;

/// Most complements taken of one node at once: a node that turned further has no honest direction
/// left.
const MOST_CHANGES: usize = 10_000;

/// Neighbours that turn more than this against each other are too far apart for the element between
/// them.
pub const COARSE: f64 = 2.8;

/// From here on a warning.
pub const COARSE_WARNING: f64 = PI / 2.0;

/// A representative that lies farther than this from where it should be is not the right one.
const FAR: f64 = PI / 2.0;

/// From here on a rotation may have gone the long way round.
pub const HALF_TURN: f64 = 3.0;

/// Corrections that lead round and round do not end so near to where they began but by chance.
const LITTLE: f64 = 1.0;

/// Within this angle of a whole turn the direction of P tells nothing of the axis.
const NEAR_TURN: f64 = 0.5;

/// Replaces every rotation vector longer than pi + `band` by its complement, with its rates, until
/// none is left. `lag` is the time by which the algorithmic acceleration lies ahead of the state;
/// `None` where it is the rate of a momentum, to which charts do not matter.
pub fn switch(state: &mut State, rotations: &[Slot], band: f64, lag: Option<f64>) -> usize {
    let Some(first) = first_beyond(state, rotations, band) else { return 0 };
    state.unwrapped_mut();
    let mut switched = 0;
    for slot in rotations.iter().skip_while(|slot| **slot != first).map(|&slot| slot as usize) {
        for _ in 0..MOST_CHANGES {
            let p = state.q[slot];
            if !is_beyond(p, band) {
                break;
            }
            let (velocity, acceleration) = (state.v[slot], state.a[slot]);
            let change = Complement::new(p, velocity, acceleration);
            if let Some(lag) = lag.filter(|_| !state.algorithmic.is_empty()) {
                let drift = (change.b_rate * acceleration) * 2.0 + change.b_rate2 * velocity;
                state.algorithmic[slot] = change.b * state.algorithmic[slot] + change.b_rate * velocity + drift * lag;
            }
            state.q[slot] = change.p;
            state.v.put(slot, change.velocity);
            state.a.put(slot, change.acceleration);
            switched += 1;
        }
    }
    switched
}

/// The first rotation vector that [`switch`] replaces.
pub fn first_beyond(state: &State, rotations: &[Slot], band: f64) -> Option<Slot> {
    let in_part =
        |part: Range<usize>| rotations[part].iter().copied().find(|&slot| is_beyond(state.q[slot as usize], band));
    threads::first(rotations.len(), in_part)
}

/// NaN is never beyond: what is not finite is named by the assembly, not turned for ever.
fn is_beyond(p: Vec3, band: f64) -> bool {
    p.squared() > (PI + band) * (PI + band) && p.is_finite()
}

/// Chooses for each element the nodes that are converted into the chart of its first, and counts
/// the mixed elements.
pub fn freeze(state: &mut State, elements: &[ElementInfo]) -> usize {
    let mut mixed = 0;
    for (element, info) in elements.iter().enumerate().filter(|(_, e)| e.in_one_chart) {
        let rotations = info.rotations();
        let mut p = [Vec3::ZERO; crate::kernel::MAX_NODES];
        for (p, &slot) in p.iter_mut().zip(rotations) {
            *p = state.q[slot as usize];
        }
        let mask = seam::conversion(&p[..rotations.len()]);
        state.mixed[element] = mask;
        mixed += usize::from(mask != 0);
    }
    mixed
}

/// Carries the unwrapped rotation vectors along with a correction that the state is about to take.
/// A node may turn further than half a turn in a load step; how far, only its corrections tell.
/// What is not kept apart goes with the unknowns.
pub fn carry(state: &mut State, dq: &[Vec3], rotations: &[Slot]) {
    if state.unwrapped.is_empty() {
        return;
    }
    let State { q, unwrapped, .. } = state;
    each_rotation(unwrapped, rotations, |k, unwrapped| {
        let (old, increment) = (q[k], dq[k]);
        let p = old + increment;
        *unwrapped = match () {
            () if increment == Vec3::ZERO => *unwrapped,
            () if *unwrapped == old => p,
            () if increment.squared() < 1.0 => continued(p, *unwrapped, rotated(old, p)),
            () => continued(p, *unwrapped, Rotation::new(old).t.transpose_mul(increment)),
        };
    });
}

/// Shows a state as it was before a correction of its unknowns alone; unwrapped rotation vectors
/// that are the unknowns stay so.
pub fn there_and_back(state: &mut State, dq: &[Vec3], look: impl FnOnce(&State)) {
    let unwrapped = state.unwrapped.iter().zip(&state.q).enumerate();
    let unwound: Vec<usize> = unwrapped.filter(|(_, (unwrapped, q))| unwrapped == q).map(|(slot, _)| slot).collect();
    shift(state, dq, -1.0);
    look(state);
    shift(state, dq, 1.0);
    unwound.into_iter().for_each(|slot| state.unwrapped[slot] = state.q[slot]);
}

fn shift(state: &mut State, dq: &[Vec3], times: f64) {
    threads::each_part(&mut state.q, |start, q| q.iter_mut().zip(&dq[start..]).for_each(|(q, &dq)| *q += dq * times));
}

/// Does something with what a list holds at each of some slots, which come in their order.
fn each_rotation<T: Send>(list: &mut [T], rotations: &[Slot], work: impl Fn(usize, &mut T) + Send + Sync) {
    debug_assert!(rotations.is_sorted(), "rotations out of order");
    threads::each_part(list, |start, part| {
        let place = |slot: usize| rotations.partition_point(|&rotation| (rotation as usize) < slot);
        for &slot in &rotations[place(start)..place(start + part.len())] {
            work(slot as usize, &mut part[slot as usize - start]);
        }
    });
}

/// The spatial rotation vector that leads from one to the other.
fn rotated(old: Vec3, p: Vec3) -> Vec3 {
    log(Rotation::new(p).r * Rotation::new(old).r.transpose())
}

/// The representative of `p` next to where `turned` carries a unwrapped vector; the carried vector
/// itself near whole turns, where there is none. See [`wind`].
fn continued(p: Vec3, unwrapped: Vec3, turned: Vec3) -> Vec3 {
    let carried = unwrapped + turned;
    let candidate = unwound(p, carried);
    let together = (candidate - carried).norm() < FAR;
    let near_whole_turn = p.norm() < NEAR_TURN && carried.norm() > PI;
    if together && !near_whole_turn { candidate } else { carried }
}

/// Continues the unwrapped rotation vectors from the state `before`, and returns the slots where
/// that is ambiguous.
///
/// The way that corrections have carried them tells the turns; without any it is less than half a
/// turn. The unwrapped vector is the one of P + 2 pi k n that lies nearest to the old one carried
/// on by the rotation since. Close to a whole turn n is no guide: a node that passes it a little
/// aside sees n swing to the other side, and P + 2 pi k n with it. There the carried one is kept
/// until both come together again; it is ambiguous where they lie far apart.
pub fn wind(state: &mut State, before: &State, rotations: &[Slot]) -> Vec<Slot> {
    if state.unwrapped.is_empty() {
        return Vec::new();
    }
    let State { q, unwrapped: carried, .. } = state;
    each_rotation(carried, rotations, |k, carried| {
        let (p, old, unwrapped) = (q[k], before.q[k], before.unwrapped_at(k as Slot));
        // Then all that follows comes to P itself: the carried vector is at most 2 |P - P_old| away
        // from it.
        let is_near = unwrapped == old && (p - old).norm() < 0.4 * FAR;
        if is_near && (*carried == old || *carried == p) {
            *carried = p;
            return;
        }
        let (shortest, tracked) = (rotated(old, p), *carried - unwrapped);
        let turned = if tracked.norm() > HALF_TURN { unwound(shortest, tracked) } else { shortest };
        *carried = continued(p, unwrapped, turned);
    });
    let is_ambiguous = |&slot: &Slot| {
        let (p, unwrapped) = (q[slot as usize], carried[slot as usize]);
        p != unwrapped && (unwound(p, unwrapped) - unwrapped).norm() >= FAR
    };
    let mut ambiguous = Vec::new();
    let in_part = |part: &[Slot]| part.iter().copied().filter(is_ambiguous).collect::<Vec<_>>();
    threads::in_order(rotations.chunks(PART), in_part, |part| ambiguous.extend(part));
    ambiguous
}

/// Takes away turns that only the corrections of an iteration made: they may lead round and round
/// before they find a balance. Where a node seems to have turned by more than pi since the state
/// `before`, those that have turned by little, or as is `prescribed`, tell the others: along an
/// element the rotations of neighbours differ by less than pi, and so do their unwrapped vectors.
/// What no such node leads to stays.
pub fn unwind(state: &mut State, before: &State, charted: &Charted, prescribed: impl Fn(Slot) -> bool) {
    let Charted { elements, rotations } = charted;
    if state.unwrapped.is_empty() {
        return;
    }
    let turned = |slot: Slot| (state.unwrapped_at(slot) - before.unwrapped_at(slot)).norm();
    let far = |part: Range<usize>| rotations[part].iter().find(|&&slot| turned(slot) > PI);
    if threads::first(rotations.len(), far).is_none() {
        return;
    }
    let is_unsettled = |&slot: &Slot| turned(slot) > LITTLE && !prescribed(slot);
    let mut unsettled: BTreeSet<Slot> = rotations.iter().copied().filter(is_unsettled).collect();
    // Along a beam one pass settles all that follows, and the next one all that comes before.
    let mut left = usize::MAX;
    while !unsettled.is_empty() && unsettled.len() < left {
        left = unsettled.len();
        for element in elements.iter().chain(elements.iter().rev()) {
            let pairs = element.rotations().windows(2).flat_map(|pair| [[pair[0], pair[1]], [pair[1], pair[0]]]);
            pairs.for_each(|[from, to]| settle(state, &mut unsettled, from, to));
        }
    }
}

/// The turns of a node from those of a neighbour, where these are known and its own are not.
fn settle(state: &mut State, unsettled: &mut BTreeSet<Slot>, from: Slot, to: Slot) {
    if !unsettled.contains(&from) && unsettled.remove(&to) {
        let [own, p] = [from, to].map(|slot| state.q[slot as usize]);
        state.unwrapped[to as usize] = continued(p, state.unwrapped[from as usize], rotated(own, p));
    }
}

/// The largest relative rotation between neighbouring nodes of elements that interpolate total
/// vectors.
pub fn widest_in_one_chart(state: &State, elements: &[ElementInfo]) -> f64 {
    let pairs =
        elements.iter().filter(|element| element.in_one_chart).flat_map(|element| element.rotations().windows(2));
    let angle = |pair: &[Slot]| {
        let [a, b] = [pair[0], pair[1]].map(|slot| Rotation::new(state.q[slot as usize]).r);
        relative_angle(a, b)
    };
    pairs.map(angle).fold(0.0, f64::max)
}

/// Neighbours that turned from more than a right angle one way to more than that the other way have
/// leapt over pi: their relative rotation (element, angle) is what it was and what it has changed
/// by since the state `before`.
pub fn leapt(state: &State, before: &State, elements: &[ElementInfo]) -> Option<(usize, f64)> {
    let relative = |state: &State, pair: &[Slot]| {
        let [a, b] = [pair[0], pair[1]].map(|slot| state.q[slot as usize]);
        // |T| <= 1, so vectors that lie close belong to rotations that lie at least as close.
        ((a - b).squared() > 1.0).then(|| log(Rotation::new(a).r.transpose() * Rotation::new(b).r))
    };
    let leap = |element: usize, pair: &[Slot]| {
        let now = relative(state, pair).filter(|now| now.norm() > COARSE_WARNING)?;
        let old = relative(before, pair).filter(|old| old.norm() > COARSE_WARNING)?;
        (now.dot(old) < 0.0).then(|| (element, 2.0 * PI - now.norm()))
    };
    let leap_in = |element: usize| elements[element].rotations().windows(2).find_map(|pair| leap(element, pair));
    threads::first(elements.len(), |mut part| part.find_map(leap_in))
}

/// The largest relative rotation between neighbouring nodes of an element beyond `limit`: (element,
/// angle). Of elements that take all their nodes in the chart of the first it is the sum from the
/// first node to the last: beyond pi that chart may be the wrong one.
pub fn coarsest(state: &State, elements: &[ElementInfo], limit: f64) -> Option<(usize, f64)> {
    let vectors = |pair: &[Slot]| (state.q[pair[0] as usize], state.q[pair[1] as usize]);
    // |T| <= 1, so vectors that lie close belong to rotations that lie at least as close.
    let bound = |pair: &[Slot]| (vectors(pair).0 - vectors(pair).1).norm();
    let angle = |pair: &[Slot]| {
        let (a, b) = vectors(pair);
        relative_angle(Rotation::new(a).r, Rotation::new(b).r)
    };
    let angle_in = |element: &ElementInfo| {
        let pairs = element.rotations().windows(2);
        match element.in_one_chart {
            true if pairs.clone().map(bound).sum::<f64>() >= limit => pairs.map(angle).sum(),
            true => 0.0,
            false => pairs.filter(|pair| bound(pair) >= limit).map(angle).fold(0.0, f64::max),
        }
    };
    // The first of equal ones.
    let worse = |worst: Option<(usize, f64)>, (element, angle): (usize, f64)| match worst {
        Some((_, other)) if angle <= other => worst,
        _ if angle > limit => Some((element, angle)),
        _ => worst,
    };
    let in_part = |part: Range<usize>| part.map(|element| (element, angle_in(&elements[element]))).fold(None, worse);
    let mut worst = None;
    threads::in_order(threads::parts(elements.len()), in_part, |part| worst = part.into_iter().fold(worst, worse));
    worst
}
