//! Numbers for a page of text.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Bytes as text.
pub fn base64(bytes: impl Iterator<Item = u8>) -> String {
    STANDARD.encode(bytes.collect::<Vec<u8>>())
}

/// Numbers in 65,536 steps from the lowest to the highest.
pub fn quantised(values: impl Iterator<Item = f32> + Clone) -> (f32, f32, String) {
    let low = values.clone().fold(f32::INFINITY, f32::min);
    let high = values.clone().fold(f32::NEG_INFINITY, f32::max);
    let step = |x: f32| if high > low { ((x - low) / (high - low) * 65535.0).round() as u16 } else { 0 };
    (low, high, base64(values.flat_map(|x| step(x).to_le_bytes())))
}
