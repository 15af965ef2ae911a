//! Latin hypercube: each axis is cut into as many equal parts as there are points, and each part
//! holds one point.

/// `count` points in the unit cube, the same for the same seed on every machine.
pub fn latin_hypercube(count: usize, axes: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = SplitMix(seed);
    let mut points = vec![Vec::with_capacity(axes); count];
    for _ in 0..axes {
        for (point, stratum) in points.iter_mut().zip(shuffled(count, &mut random)) {
            point.push((stratum as f64 + random.unit()) / count as f64);
        }
    }
    points
}

/// The numbers below `count` in random order (Fisher and Yates).
fn shuffled(count: usize, random: &mut SplitMix) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        order.swap(last, ((last + 1) as f64 * random.unit()) as usize);
    }
    order
}

/// The generator SplitMix64 (Steele, Lea and Flood 2014, doi:10.1145/2714064.2660195).
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 * 0.5_f64.powi(53)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_generator_that_is_named() {
        // The first outputs for the seed 1234567, as the reference implementation gives them.
        let mut random = SplitMix(1_234_567);
        assert_eq!([random.next(), random.next()], [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }

    #[test]
    fn each_part_of_each_axis_holds_one_point() {
        let points = latin_hypercube(50, 3, 1);
        for axis in 0..3 {
            let mut parts: Vec<usize> = points.iter().map(|p| (p[axis] * 50.0) as usize).collect();
            parts.sort_unstable();
            assert!(parts.into_iter().eq(0..50));
        }
        assert_ne!(points, latin_hypercube(50, 3, 2));
    }
}
