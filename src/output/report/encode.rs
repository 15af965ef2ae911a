//! Numbers for a page of text.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// The step of a number that is not known
const UNKNOWN: u16 = u16::MAX;

/// Bytes as text.
pub fn base64(bytes: impl Iterator<Item = u8>) -> String {
    STANDARD.encode(bytes.collect::<Vec<u8>>())
}

/// Numbers in 65,535 steps from the lowest to the highest; NaN is a number that is not known.
pub fn quantised(values: impl Iterator<Item = f32> + Clone) -> (f32, f32, String) {
    let low = values.clone().fold(f32::INFINITY, f32::min);
    let high = values.clone().fold(f32::NEG_INFINITY, f32::max);
    let last = f32::from(UNKNOWN - 1);
    let step = |x: f32| {
        if x.is_nan() {
            UNKNOWN
        } else if high > low {
            ((x - low) / (high - low) * last).round() as u16
        } else {
            0
        }
    };
    (low, high, base64(values.flat_map(|x| step(x).to_le_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_not_known_have_a_step_of_their_own() {
        let (low, high, text) = quantised([1.0, f32::NAN, 3.0].into_iter());
        assert_eq!([low, high], [1.0, 3.0]);
        assert_eq!(STANDARD.decode(text).expect("base64"), [0, 0, 255, 255, 254, 255]);
    }
}
