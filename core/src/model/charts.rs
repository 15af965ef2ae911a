//! Changes of the charts of rotation vectors at nodes, and the choice of charts in elements.

use super::{Charted, ElementInfo};
use crate::interrupt;
use crate::kernel::seam;
use crate::rotation::{Complement, Rotation, log, relative_angle, unwound};
use crate::system::{Slot, State};
use crate::tensor::Vec3;
use crate::threads::{self, PART};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::ops::Range;

/// The band beyond pi, in radians, in which a node keeps its chart in dynamics, so that it cannot
/// change at every step.
pub const DYNAMIC_BAND: f64 = 1e-3;

/// The band beyond pi, in radians, in which a node keeps its chart in statics: nodes that are held
/// at pi itself must not change at every iterate.
pub const STATIC_BAND: f64 = 1e-9;

/// The largest number of complements taken of one node at once: after more turns no digits of the
/// direction are left.
const MAX_COMPLEMENTS: usize = 10_000;

/// The largest relative rotation of neighbouring nodes, in radians, that an element can represent.
pub const COARSE: f64 = 2.8;

/// The relative rotation of neighbouring nodes, in radians, from which on a mesh is warned of as
/// coarse.
pub const COARSE_WARNING: f64 = PI / 2.0;

/// The largest distance, in radians, between the representative of a rotation and the carried
/// vector that it continues.
const MAX_DISTANCE: f64 = PI / 2.0;

/// The rotation, in radians, from which on its direction of turning is ambiguous.
pub const HALF_TURN: f64 = 3.0;

/// The change of an unwrapped vector, in radians, up to which its whole turns are taken to be
/// right: corrections that lead through spurious turns hardly end so near to their start.
const SETTLED_CHANGE: f64 = 1.0;

/// The distance from a whole turn, in radians, within which the direction of P does not determine
/// the axis.
const NEAR_WHOLE_TURN: f64 = 0.5;

/// Replaces every rotation vector longer than pi + `band` by its complement, with its rates, until
/// none is left. Returns the number of changes. After a request to stop some may be left.
///
/// `lag` is the time by which the algorithmic acceleration lies ahead of the state; `None` if it is
/// the rate of a momentum, which does not depend on charts.
pub fn switch(state: &mut State, rotations: &[Slot], band: f64, lag: Option<f64>) -> usize {
    let Some(first) = first_beyond(state, rotations, band) else { return 0 };
    state.unwrapped_mut();
    let mut switched = 0;
    for slot in rotations.iter().skip_while(|slot| **slot != first).map(|&slot| slot as usize) {
        // A wild correction may turn many nodes by many thousand turns.
        if interrupt::is_requested() {
            break;
        }
        for _ in 0..MAX_COMPLEMENTS {
            let p = state.q[slot];
            if !is_beyond(p, band) {
                break;
            }
            let velocity = state.v[slot];
            let acceleration = state.a[slot];
            let change = Complement::new(p, velocity, acceleration);
            if let Some(lag) = lag.filter(|_| !state.algorithmic.is_empty()) {
                let drift = (change.b_rate * acceleration) * 2.0 + change.b_rate2 * velocity;
                state.algorithmic[slot] = change.b * state.algorithmic[slot] + change.b_rate * velocity + drift * lag;
                state.earlier[slot] = Vec3([f64::NAN; 3]);
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

/// True if a rotation vector is finite and longer than pi + `band`. Vectors that are not finite are
/// reported by the assembly.
fn is_beyond(p: Vec3, band: f64) -> bool {
    p.squared() > (PI + band) * (PI + band) && p.is_finite()
}

/// Chooses for each element the nodes that are converted into the chart of its first node, and
/// returns the number of elements with such nodes.
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
/// A node may turn by more than half a turn in a load step, which only its corrections show.
/// Unwrapped vectors that equal the unknowns need no work.
pub fn carry(state: &mut State, dq: &[Vec3], rotations: &[Slot]) {
    if state.unwrapped.is_empty() {
        return;
    }
    let State { q, unwrapped, .. } = state;
    each_rotation(unwrapped, rotations, |k, unwrapped| {
        let old = q[k];
        let increment = dq[k];
        let p = old + increment;
        if increment == Vec3::ZERO {
            return;
        }
        *unwrapped = if *unwrapped == old {
            p
        } else if increment.squared() < 1.0 {
            continued(p, *unwrapped, rotated(old, p))
        } else {
            continued(p, *unwrapped, Rotation::new(old).t.transpose_mul(increment))
        };
    });
}

/// Calls `look` with the state before a correction `dq` of its unknowns, then restores it.
/// Unwrapped rotation vectors that equal the unknowns do so afterwards.
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

/// Calls `work` with the entry of a list at each of some slots, given in ascending order; in
/// parallel.
fn each_rotation<T: Send>(list: &mut [T], rotations: &[Slot], work: impl Fn(usize, &mut T) + Send + Sync) {
    debug_assert!(rotations.is_sorted(), "rotations out of order");
    threads::each_part(list, |start, part| {
        let place = |slot: usize| rotations.partition_point(|&rotation| (rotation as usize) < slot);
        for &slot in &rotations[place(start)..place(start + part.len())] {
            work(slot as usize, &mut part[slot as usize - start]);
        }
    });
}

/// The spatial rotation vector from the rotation of `old` to that of `p`.
fn rotated(old: Vec3, p: Vec3) -> Vec3 {
    log(Rotation::new(p).r * Rotation::new(old).r.transpose())
}

/// The representative of `p` nearest to an unwrapped vector carried on by `turned`; the carried
/// vector itself near whole turns, where no representative is near. See [`wind`].
fn continued(p: Vec3, unwrapped: Vec3, turned: Vec3) -> Vec3 {
    let carried = unwrapped + turned;
    let candidate = unwound(p, carried);
    let together = (candidate - carried).norm() < MAX_DISTANCE;
    let near_whole_turn = p.norm() < NEAR_WHOLE_TURN && carried.norm() > PI;
    if together && !near_whole_turn { candidate } else { carried }
}

/// Continues the unwrapped rotation vectors from the state `before`, and returns the slots where
/// the continuation is ambiguous.
///
/// The number of turns comes from the corrections that have carried the vectors; without
/// corrections a node has turned by less than half a turn. The unwrapped vector is the one of P + 2
/// pi k n nearest to the old one carried on by the rotation since. Close to a whole turn the axis n
/// is undetermined: for a node that passes it a little aside, n reverses, and P + 2 pi k n with it.
/// There the carried vector is kept until both agree again; it is ambiguous while they lie far
/// apart.
pub fn wind(state: &mut State, before: &State, rotations: &[Slot]) -> Vec<Slot> {
    if state.unwrapped.is_empty() {
        return Vec::new();
    }
    let State { q, unwrapped: carried, .. } = state;
    each_rotation(carried, rotations, |k, carried| {
        let p = q[k];
        let old = before.q[k];
        let unwrapped = before.unwrapped_at(k as Slot);
        // Near vectors need no logarithm: the carried vector is at most 2 |P - P_old| away from P,
        // and the result is P itself.
        let is_near = unwrapped == old && (p - old).norm() < 0.4 * MAX_DISTANCE;
        if is_near && (*carried == old || *carried == p) {
            *carried = p;
            return;
        }
        let shortest = rotated(old, p);
        let tracked = *carried - unwrapped;
        let turned = if tracked.norm() > HALF_TURN { unwound(shortest, tracked) } else { shortest };
        *carried = continued(p, unwrapped, turned);
    });
    let is_ambiguous = |&slot: &Slot| {
        let p = q[slot as usize];
        let unwrapped = carried[slot as usize];
        p != unwrapped && (unwound(p, unwrapped) - unwrapped).norm() >= MAX_DISTANCE
    };
    let mut ambiguous = Vec::new();
    let in_part = |part: &[Slot]| part.iter().copied().filter(is_ambiguous).collect::<Vec<_>>();
    threads::in_order(rotations.chunks(PART), in_part, |part| ambiguous.extend(part));
    ambiguous
}

/// Removes spurious whole turns of unwrapped vectors, through which the corrections of an iteration
/// may lead before they find a balance.
///
/// Where a node seems to have turned by more than pi since the state `before`, nodes that have
/// turned by little, or as `prescribed`, determine the turns of their neighbours: along an element
/// the unwrapped vectors of neighbours differ by less than pi. Nodes without a connection to such a
/// node are not changed.
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
    let is_unsettled = |&slot: &Slot| turned(slot) > SETTLED_CHANGE && !prescribed(slot);
    let mut unsettled: BTreeSet<Slot> = rotations.iter().copied().filter(is_unsettled).collect();
    // Along a beam the pass forwards settles all nodes after a settled one, the pass backwards all
    // before it.
    let mut left = usize::MAX;
    while !unsettled.is_empty() && unsettled.len() < left {
        left = unsettled.len();
        for element in elements.iter().chain(elements.iter().rev()) {
            let pairs = element.rotations().windows(2).flat_map(|pair| [[pair[0], pair[1]], [pair[1], pair[0]]]);
            pairs.for_each(|[from, to]| settle(state, &mut unsettled, from, to));
        }
    }
}

/// Takes the whole turns of node `to` from those of its neighbour `from`, if these are settled and
/// its own are not.
fn settle(state: &mut State, unsettled: &mut BTreeSet<Slot>, from: Slot, to: Slot) {
    if !unsettled.contains(&from) && unsettled.remove(&to) {
        let [own, p] = [from, to].map(|slot| state.q[slot as usize]);
        state.unwrapped[to as usize] = continued(p, state.unwrapped[from as usize], rotated(own, p));
    }
}

/// The largest relative rotation, in radians, between the nodes of two-node elements that interpolate
/// total vectors.
pub fn widest_of_two_nodes_in_one_chart(state: &State, elements: &[ElementInfo]) -> f64 {
    let of_two_nodes = elements.iter().filter(|element| element.in_one_chart && element.rotations().len() == 2);
    let pairs = of_two_nodes.flat_map(|element| element.rotations().windows(2));
    let angle = |pair: &[Slot]| {
        let [a, b] = [pair[0], pair[1]].map(|slot| Rotation::new(state.q[slot as usize]).r);
        relative_angle(a, b)
    };
    pairs.map(angle).fold(0.0, f64::max)
}

/// Finds neighbouring nodes whose relative rotation has jumped over pi since the state `before`:
/// from more than a right angle one way to more than a right angle the other way. Returns the
/// element, and 2 pi less the present angle.
pub fn leapt(state: &State, before: &State, elements: &[ElementInfo]) -> Option<(usize, f64)> {
    let relative = |state: &State, pair: &[Slot]| {
        let [a, b] = [pair[0], pair[1]].map(|slot| state.q[slot as usize]);
        // |T| <= 1: the angle between two rotations is at most the distance of their vectors.
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

/// The element with the largest relative rotation between neighbouring nodes, and the angle in
/// radians, if it exceeds `limit`. For elements that convert all nodes into the chart of the first
/// the angle is the sum over the element: beyond pi that chart may be the wrong one.
pub fn coarsest(state: &State, elements: &[ElementInfo], limit: f64) -> Option<(usize, f64)> {
    let vectors = |pair: &[Slot]| [pair[0], pair[1]].map(|slot| state.q[slot as usize]);
    // |T| <= 1: the angle between two rotations is at most the distance of their vectors.
    let bound = |pair: &[Slot]| {
        let [a, b] = vectors(pair);
        (a - b).norm()
    };
    let angle = |pair: &[Slot]| {
        let [a, b] = vectors(pair);
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
    // Of equal angles the first one is kept.
    let worse = |worst: Option<(usize, f64)>, (element, angle): (usize, f64)| {
        let is_smaller = worst.is_some_and(|(_, other)| angle <= other);
        if !is_smaller && angle > limit { Some((element, angle)) } else { worst }
    };
    let in_part = |part: Range<usize>| part.map(|element| (element, angle_in(&elements[element]))).fold(None, worse);
    let mut worst = None;
    threads::in_order(threads::parts(elements.len()), in_part, |part| worst = part.into_iter().fold(worst, worse));
    worst
}
