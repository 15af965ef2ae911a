//! Consecutive ranges of a list, stored as one length if all are equally long.

use std::ops::Range;

/// Consecutive ranges that cover a list.
#[derive(Clone, Debug, Default)]
pub struct RangeList {
    count: usize,
    /// Length of each range if all are equally long
    length: usize,
    /// End of each range; empty if all are equally long
    ends: Vec<u32>,
}

impl RangeList {
    /// Appends a range of the given length.
    pub fn push(&mut self, length: usize) {
        if self.count == 0 {
            self.length = length;
        } else if self.ends.is_empty() && length != self.length {
            self.ends.extend((1..=self.count).map(|k| (k * self.length) as u32));
        }
        if let Some(&last) = self.ends.last() {
            self.ends.push(last + length as u32);
        }
        self.count += 1;
    }

    /// Number of ranges.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True without ranges.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Range number k.
    #[inline(always)]
    pub fn get(&self, k: usize) -> Range<usize> {
        debug_assert!(k < self.count, "part {k} of {}", self.count);
        match self.ends.get(k) {
            None => k * self.length..(k + 1) * self.length,
            Some(&end) => k.checked_sub(1).map_or(0, |before| self.ends[before] as usize)..end as usize,
        }
    }

    /// Releases unused capacity.
    pub fn shrink_to_fit(&mut self) {
        self.ends.shrink_to_fit();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_one_length_and_of_several_stand_where_they_were_put() {
        for lengths in [&[][..], &[4], &[4, 4, 4], &[0, 0, 3], &[4, 4, 2, 4], &[1, 2, 3]] {
            let mut runs = RangeList::default();
            lengths.iter().for_each(|&length| runs.push(length));
            assert_eq!((runs.len(), runs.is_empty()), (lengths.len(), lengths.is_empty()));
            let mut start = 0;
            for (k, length) in lengths.iter().enumerate() {
                assert_eq!(runs.get(k), start..start + length, "part {k} of {lengths:?}");
                start += length;
            }
            let are_equal = lengths.windows(2).all(|pair| pair[0] == pair[1]);
            assert_eq!(runs.ends.is_empty(), are_equal, "{lengths:?}");
        }
    }
}
