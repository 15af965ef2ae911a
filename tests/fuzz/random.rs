//! Random numbers that are the same in every run and on every machine (splitmix64).

/// A generator.
pub struct Random(u64);

impl Random {
    /// The generator of an input, by the seed of the session and the number of the input.
    pub fn of(seed: u64, number: u64) -> Self {
        let mut own = Self(seed);
        Self(own.bits() ^ number.wrapping_mul(0xD134_2543_DE82_EF95))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number from 0 to `end` - 1; 0 where `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() % (end.max(1) as u64)) as usize
    }

    /// True once in `times`.
    pub fn one_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    /// An entry of a list that is not empty.
    pub fn pick<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }

    /// A small count, 1 or more; each further one is half as likely.
    pub fn few(&mut self) -> usize {
        1 + self.bits().trailing_ones().min(8) as usize
    }
}
