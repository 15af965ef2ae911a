//! Parallel loops over items of work, on the threads of the caller's pool.
//!
//! Work is cut by the scene alone, never by the number of threads, and results of items are
//! combined in the order of the items: results are equal on any number of threads, to the last bit.

use crate::interrupt;
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use std::io;
use std::ops::Range;
use std::panic;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, Scope, ScopedJoinHandle};
use std::time::Duration;

/// Bytes of stack of each thread, as the main thread has them on most systems.
const STACK_BYTES: usize = 8 << 20;

/// Time between looks for a request to stop, while work without looks of its own is under way.
const LOOK: Duration = Duration::from_millis(20);

/// Runs work that may use `threads` threads. With one thread, or if the system gives no more, the
/// work runs serially.
pub fn on<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES);
    match (threads > 1).then(|| builder.build().ok()).flatten() {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// Spawns a thread with enough stack for a whole scene. `Err` if the system gives none.
pub fn beside<'scope, R: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    work: impl FnOnce() -> R + Send + 'scope,
) -> io::Result<ScopedJoinHandle<'scope, R>> {
    thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, work)
}

/// Runs work that cannot look for a request to stop itself, such as a long call into another crate,
/// on a thread of its own. `None` after a request: the work is then left to itself, and its result
/// is dropped. It must not use threads of the pool.
pub fn unless_interrupted<R: Send + 'static>(work: impl FnOnce() -> R + Send + 'static) -> Option<R> {
    if interrupt::is_requested() {
        return None;
    }
    let (sender, receiver) = mpsc::channel();
    let waiting = Arc::new(Mutex::new(Some(work)));
    let taken = waiting.clone();
    let take = |work: &Mutex<Option<_>>| work.lock().unwrap_or_else(PoisonError::into_inner).take();
    let run = move || {
        if let Some(work) = take(&taken) {
            // Nobody receives what comes after a request.
            let _ = sender.send(work());
        }
    };
    let Ok(thread) = thread::Builder::new().stack_size(STACK_BYTES).spawn(run) else {
        return take(&waiting).map(|work| work());
    };
    loop {
        match receiver.recv_timeout(LOOK) {
            Ok(result) => return Some(result),
            Err(RecvTimeoutError::Timeout) if interrupt::is_requested() => return None,
            Err(RecvTimeoutError::Timeout) => {}
            // The work panicked.
            Err(RecvTimeoutError::Disconnected) => match thread.join() {
                Ok(()) => return None,
                Err(panic) => panic::resume_unwind(panic),
            },
        }
    }
}

/// Calls `work` with each item.
pub fn each<T: Send>(items: impl Iterator<Item = T>, work: impl Fn(T) + Send + Sync) {
    in_order(items, work, |()| ());
}

/// Calls `work` with each item, and `take` with each result in the order of the items.
pub fn in_order<T: Send, R: Send>(
    items: impl Iterator<Item = T>,
    work: impl Fn(T) -> R + Send + Sync,
    mut take: impl FnMut(R),
) {
    if !are_given() {
        return items.for_each(|item| take(work(item)));
    }
    let jobs: Vec<Mutex<Job<T, R>>> = items.map(|item| Mutex::new(Job::Waiting(item))).collect();
    at_once(jobs.len(), &|number| {
        let mut job = jobs[number].lock().unwrap_or_else(PoisonError::into_inner);
        if let Job::Waiting(item) = std::mem::replace(&mut *job, Job::Running) {
            *job = Job::Done(work(item));
        }
    });
    for job in jobs {
        if let Job::Done(result) = job.into_inner().unwrap_or_else(PoisonError::into_inner) {
            take(result);
        }
    }
}

/// An item of work: waiting, running, or done with its result.
enum Job<T, R> {
    Waiting(T),
    Running,
    Done(R),
}

/// Calls `work` with the numbers below `count`, a thread taking one number at a time. The generic
/// code of rayon is compiled once, here, not for each caller.
fn at_once(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().with_max_len(1).for_each(work);
}

/// The list of the results of items, in their order.
pub fn map<T: Send, R: Send>(items: impl Iterator<Item = T>, work: impl Fn(T) -> R + Send + Sync) -> Vec<R> {
    let mut list = Vec::new();
    in_order(items, work, |result| list.push(result));
    list
}

/// True if the caller runs in a pool of threads.
fn are_given() -> bool {
    rayon::current_thread_index().is_some()
}

/// Entries of a part: the piece of a long list that one thread takes at a time.
pub const PART: usize = 2048;

/// Calls `work` with each part of a list and the index of the part's first entry.
pub fn each_part<T: Send>(list: &mut [T], work: impl Fn(usize, &mut [T]) + Send + Sync) {
    if !are_given() {
        return work(0, list);
    }
    each(list.chunks_mut(PART).enumerate(), |(number, part)| work(PART * number, part));
}

/// The list of `entry(k)` for each index k below `length`.
pub fn list<T: Send>(length: usize, entry: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    if !are_given() {
        return (0..length).map(entry).collect();
    }
    let mut list = Vec::with_capacity(length);
    let of_part = |part: Range<usize>| part.map(&entry).collect::<Vec<T>>();
    in_order(parts(length), of_part, |part| list.extend(part));
    list
}

/// The largest of zero and the values `of_part(range)` over the parts of a list, given as ranges of
/// indices.
pub fn largest(length: usize, of_part: impl Fn(Range<usize>) -> f64 + Send + Sync) -> f64 {
    if !are_given() {
        return of_part(0..length).max(0.0);
    }
    let mut largest = 0.0_f64;
    in_order(parts(length), of_part, |part| largest = largest.max(part));
    largest
}

/// The sums of the values `of_part(range)` over the parts of a list, given as ranges of indices.
/// Parts, and so the order of additions, do not depend on the number of threads.
pub fn sums<const N: usize>(length: usize, of_part: impl Fn(Range<usize>) -> [f64; N] + Send + Sync) -> [f64; N] {
    let mut sums = [0.0; N];
    in_order(parts(length), of_part, |part| sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part));
    sums
}

/// The first finding of `in_part(range)` in the order of the parts of a list, given as ranges of
/// indices.
pub fn first<T: Send>(length: usize, in_part: impl Fn(Range<usize>) -> Option<T> + Send + Sync) -> Option<T> {
    if !are_given() {
        return in_part(0..length);
    }
    let mut first = None;
    in_order(parts(length), in_part, |found| first = first.take().or(found));
    first
}

/// The parts of a list, as ranges of indices.
pub fn parts(length: usize) -> impl Iterator<Item = Range<usize>> {
    (0..length).step_by(PART).map(move |start| start..length.min(start + PART))
}

/// Copies `from` to `to`, which takes its length.
pub fn copy<T: Copy + Send + Sync>(to: &mut Vec<T>, from: &[T]) {
    if to.len() != from.len() {
        to.clear();
        return to.extend_from_slice(from);
    }
    copy_over(to, from);
}

/// Copies `from` over `to`, which has its length.
pub fn copy_over<T: Copy + Send + Sync>(to: &mut [T], from: &[T]) {
    each_part(to, |start, to| to.copy_from_slice(&from[start..start + to.len()]));
}

/// Splits a list into consecutive parts that end at `ends`; an empty list has no parts.
pub fn split<T>(mut list: &mut [T], ends: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let mut start = 0;
    let mut parts = Vec::new();
    if list.is_empty() {
        return parts;
    }
    for end in ends {
        let (part, rest) = list.split_at_mut(end - start);
        parts.push(part);
        list = rest;
        start = end;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The result of `work` without threads, after a check that three threads give an equal one.
    fn same<R: PartialEq + std::fmt::Debug + Send>(work: impl Fn() -> R + Sync) -> R {
        let alone = work();
        assert_eq!(on(3, &work), alone);
        alone
    }

    #[test]
    fn sums_do_not_depend_on_threads() {
        // Terms of many sizes: another order of additions gives another sum.
        let term = |k: usize| (k as f64 * 0.618).sin() * 10_f64.powi((k % 13) as i32);
        let length = 5 * PART + 7;
        let of_part = |part: Range<usize>| [part.clone().map(term).sum(), part.len() as f64];
        let [sum, count] = same(|| sums(length, of_part).map(f64::to_bits)).map(f64::from_bits);
        assert_ne!(sum, (0..length).map(term).sum::<f64>(), "the terms tell nothing");
        assert_eq!(count, length as f64);
        assert_eq!(same(|| sums(0, |_| [1.0])), [0.0]);
    }

    #[test]
    fn the_first_find_is_the_first_of_the_list() {
        for wanted in [0, 1, PART - 1, PART, 3 * PART + 5] {
            let found = same(|| first(4 * PART, |mut part| part.find(|&k| k >= wanted)));
            assert_eq!(found, Some(wanted));
        }
        assert_eq!(same(|| first(4 * PART, |_| None::<usize>)), None);
    }

    #[test]
    fn copies_become_as_long() {
        let from: Vec<usize> = (0..3 * PART + 1).collect();
        for length in [0, 5, from.len(), from.len() + 9] {
            let copied = same(|| {
                let mut to = vec![1; length];
                copy(&mut to, &from);
                to
            });
            assert_eq!(copied, from);
        }
    }
}
