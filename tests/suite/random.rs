//! Random states that are the same in every run (splitmix64).

use beamsim_core::tensor::{Mat3, Vec3};

/// A generator.
pub struct Random(u64);

impl Random {
    /// A generator that starts from `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number between `low` and `high`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.bits() >> 11) as f64 / (1_u64 << 53) as f64;
        low + (high - low) * unit
    }

    /// A vector with components between -`half` and `half`.
    pub fn cube(&mut self, half: f64) -> Vec3 {
        Vec3([self.range(-half, half), self.range(-half, half), self.range(-half, half)])
    }

    /// A unit vector, all directions alike.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.cube(1.0);
            let length = v.norm();
            if length > 0.1 && length <= 1.0 {
                return v * (1.0 / length);
            }
        }
    }

    /// Two orthogonal unit vectors, all directions alike.
    pub fn axes(&mut self) -> [Vec3; 2] {
        let along = self.direction();
        [along, along.cross(self.direction()).normalized().unwrap()]
    }

    /// A vector of this length.
    pub fn vector(&mut self, length: f64) -> Vec3 {
        self.direction() * length
    }

    /// A tensor with components between -`half` and `half`.
    pub fn tensor(&mut self, half: f64) -> Mat3 {
        let rows = [self.cube(half), self.cube(half), self.cube(half)];
        Mat3(rows.map(|row| row.0))
    }

    /// A symmetric positive definite tensor.
    pub fn positive_definite(&mut self) -> Mat3 {
        let a = self.tensor(1.0);
        a * a.transpose() + Mat3::IDENTITY.scale(0.5)
    }
}

#[test]
fn random_states_are_what_they_claim() {
    let mut random = Random::new(1);
    for _ in 0..1000 {
        let number = random.range(2.0, 3.0);
        assert!((2.0..3.0).contains(&number), "{number} is not between 2 and 3");
        let length = random.vector(4.0).norm();
        assert!((length - 4.0).abs() < 1e-14, "the length is {length} instead of 4");
        let (m, v) = (random.positive_definite(), random.direction());
        assert_eq!(m, m.transpose());
        assert!(v.dot(m * v) >= 0.4, "{m:?} is not positive definite along {v:?}");
    }
}
