//! Stable sorting, compiled once.
//!
//! The sorts of the standard library are long, and every kind of value with its order is another
//! copy of them. Lists whose sorting takes no time of a run are sorted here: the places of their
//! entries are, and then each entry goes to its place.

use std::cmp::Ordering;

/// Sorts a list; entries of equal order stay in their order.
pub fn sort_by<T>(list: &mut [T], order: impl Fn(&T, &T) -> Ordering) {
    let mut from = places(list.len(), &|a, b| order(&list[a], &list[b]));
    // Along each cycle of places, entries are swapped into them.
    for start in 0..list.len() {
        let mut to = start;
        while from[to] != start {
            list.swap(to, from[to]);
            to = std::mem::replace(&mut from[to], to);
        }
        from[to] = to;
    }
}

/// Sorts a list by a key of each entry; entries of equal keys stay in their order.
pub fn sort_by_key<T, K: Ord>(list: &mut [T], key: impl Fn(&T) -> K) {
    sort_by(list, |a, b| key(a).cmp(&key(b)));
}

/// Sorts numbers from the least to the largest.
pub fn sort_numbers(list: &mut [f64]) {
    list.sort_by(f64::total_cmp);
}

/// The places of the entries of a list of some length, in their order.
fn places(length: usize, order: &dyn Fn(usize, usize) -> Ordering) -> Vec<usize> {
    let mut places: Vec<usize> = (0..length).collect();
    places.sort_by(|&a, &b| order(a, b));
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_sorted_as_by_the_standard_library() {
        for length in [0, 1, 2, 3, 20, 21, 300] {
            // Many equal keys, so that a sort that is not stable would differ.
            let list: Vec<(usize, usize)> = (0..length).map(|k| (k * 7919 % 13, k)).collect();
            let mut expected = list.clone();
            expected.sort_by_key(|entry| entry.0);
            let mut sorted = list.clone();
            sort_by_key(&mut sorted, |entry| entry.0);
            assert_eq!(sorted, expected);
            let mut reversed = list;
            sort_by(&mut reversed, |a, b| b.cmp(a));
            assert!(reversed.is_sorted_by(|a, b| a > b));
        }
    }
}
