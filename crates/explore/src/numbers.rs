//! Numbers of the page: arrays in one compressed blob, as text.
//!
//! Whole numbers are kept as differences, which are small where neighbours are alike, and all arrays byte by byte, the
//! lowest byte of all numbers first, which compresses best. Light is a number of steps of its logarithm: 16 bits hold
//! 256 steps an octave over all floats, so that rounding is 0.14 % at most, whatever the light, and neighbours differ
//! by few steps.
//!
//! Not handled: what the arrays stand for ([`crate::document`]).

use std::collections::BTreeMap;
use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;

use halflight::light::Rgb;

/// Steps of an octave of light.
const STEPS: f32 = 256.0;
/// The code of light of 1 W/(m² sr).
const ONE: f32 = 32768.0;
/// Steps of an octave of a form factor, whose code of 1 is the largest.
const FACTOR_STEPS: f32 = 12.0;

/// Where an array stands in the blob, and what it holds.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Stored {
    #[serde(rename = "type")]
    kind: &'static str,
    offset: usize,
    count: usize,
}

/// Arrays by name, and their bytes.
#[derive(Default)]
pub(super) struct Arrays {
    pub stored: BTreeMap<&'static str, Stored>,
    bytes: Vec<u8>,
}

impl Arrays {
    fn add(&mut self, name: &'static str, kind: &'static str, count: usize, bytes: impl IntoIterator<Item = u8>) {
        self.stored.insert(name, Stored { kind, offset: self.bytes.len(), count });
        self.bytes.extend(bytes);
    }

    /// Adds bytes.
    pub fn bytes(&mut self, name: &'static str, values: &[u8]) {
        self.add(name, "u8", values.len(), values.iter().copied());
    }

    /// Adds numbers of 16 bits.
    pub fn shorts(&mut self, name: &'static str, values: &[u16]) {
        let mut last = 0_u16;
        let difference = |value: &u16| {
            let d = value.wrapping_sub(last) as i16;
            last = *value;
            ((d << 1) ^ (d >> 15)) as u16
        };
        let coded: Vec<u16> = values.iter().map(difference).collect();
        self.add(name, "u16", values.len(), planes(coded.iter().map(|v| v.to_le_bytes()).collect()));
    }

    /// Adds numbers of 32 bits.
    pub fn words(&mut self, name: &'static str, values: &[u32]) {
        let mut last = 0_u32;
        let difference = |value: &u32| {
            let d = value.wrapping_sub(last) as i32;
            last = *value;
            ((d << 1) ^ (d >> 31)) as u32
        };
        let coded: Vec<u32> = values.iter().map(difference).collect();
        self.add(name, "u32", values.len(), planes(coded.iter().map(|v| v.to_le_bytes()).collect()));
    }

    /// Adds floats.
    pub fn floats(&mut self, name: &'static str, values: &[f32]) {
        self.add(name, "f32", values.len(), planes(values.iter().map(|v| v.to_le_bytes()).collect()));
    }

    /// All bytes, compressed, as text.
    pub fn text(&self) -> String {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
        // Writing to memory does not fail.
        let packed = encoder.write_all(&self.bytes).and_then(|()| encoder.finish()).unwrap_or_default();
        STANDARD.encode(packed)
    }
}

/// All first bytes, then all second ones, and so on.
fn planes<const N: usize>(values: Vec<[u8; N]>) -> impl Iterator<Item = u8> {
    (0..N * values.len()).map(move |k| values[k % values.len()][k / values.len()])
}

/// The code of a value of light.
pub(super) fn light_code(value: f32) -> u16 {
    let code = ONE + STEPS * value.log2();
    if value > 0.0 && code >= 1.0 { code.round().min(f32::from(u16::MAX)) as u16 } else { 0 }
}

/// Codes of one channel after another.
pub(super) fn light_codes(values: &[Rgb], codes: &mut Vec<u16>) {
    (0..3).for_each(|c| codes.extend(values.iter().map(|v| light_code(v[c]))));
}

/// Makes codes of light small: red and blue become differences from green, each term those from the term before, and
/// each tau those from the tau before, all modulo 2^16. Layers are by tau, lamp, term and channel.
pub(super) fn predict(codes: &mut [u16], [taus, lamps, terms]: [usize; 3]) {
    let count = codes.len() / (taus * lamps * terms * 3).max(1);
    let mut subtract = |layer: usize, other: usize| {
        for i in 0..count {
            codes[layer * count + i] = codes[layer * count + i].wrapping_sub(codes[other * count + i]);
        }
    };
    for layer in 0..taus * lamps * terms {
        subtract(3 * layer, 3 * layer + 1);
        subtract(3 * layer + 2, 3 * layer + 1);
    }
    let per_term = 3;
    for layer in (0..taus * lamps * terms * 3).rev().filter(|layer| layer / per_term % terms > 0) {
        subtract(layer, layer - per_term);
    }
    let per_tau = lamps * terms * 3;
    for layer in (per_tau..taus * per_tau).rev() {
        subtract(layer, layer - per_tau);
    }
}

/// The code of a form factor.
pub(super) fn factor_code(value: f32) -> u8 {
    let code = 255.0 + FACTOR_STEPS * value.log2();
    if value > 0.0 && code >= 1.0 { code.round().min(255.0) as u8 } else { 0 }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;

    /// The light that a code stands for.
    fn decoded(code: u16) -> f32 {
        if code == 0 { 0.0 } else { ((f32::from(code) - ONE) / STEPS).exp2() }
    }

    #[test]
    fn light_comes_back_within_half_a_step() {
        for value in [1e-30_f32, 3e-5, 0.1, 1.0, 17.3, 2.5e9] {
            assert!((decoded(light_code(value)) / value).log2().abs() <= 0.501 / STEPS, "{value}");
        }
        assert_eq!([0.0, -1.0, f32::NAN].map(light_code), [0; 3]);
        assert_eq!([1.0, 0.5, 1e-9].map(factor_code), [255, 243, 0]);
    }

    #[test]
    fn predictions_can_be_undone() {
        let [taus, lamps, terms, count] = [3, 2, 4, 5];
        let codes: Vec<u16> =
            (0..(taus * lamps * terms * 3 * count) as u32).map(|k| (k * k * 977 % 65521) as u16).collect();
        let mut small = codes.clone();
        predict(&mut small, [taus, lamps, terms]);
        let layer = |q: usize, l: usize, n: usize, c: usize| ((q * lamps + l) * terms + n) * 3 + c;
        for (q, l, n, i) in (0..taus * lamps * terms * count)
            .map(|k| (k / count / terms / lamps, k / count / terms % lamps, k / count % terms, k % count))
        {
            for c in [1, 0, 2] {
                // The sum over the taus and terms up to this one.
                let all = (0..=q).flat_map(|q| (0..=n).map(move |n| (q, n)));
                let sum = |c: usize| {
                    all.clone().fold(0_u16, |sum, (q, n)| sum.wrapping_add(small[layer(q, l, n, c) * count + i]))
                };
                let own = if c == 1 { sum(1) } else { sum(c).wrapping_add(sum(1)) };
                assert_eq!(own, codes[layer(q, l, n, c) * count + i]);
            }
        }
    }

    #[test]
    fn bytes_are_those_of_the_format() {
        let mut arrays = Arrays::default();
        arrays.shorts("a", &[5, 3, 65535]);
        arrays.words("b", &[1, 0x0102_0304]);
        arrays.floats("c", &[1.5]);
        arrays.bytes("d", &[9]);
        let text = arrays.text();
        let mut bytes = Vec::new();
        let packed = STANDARD.decode(text).expect("base64");
        flate2::read::ZlibDecoder::new(&packed[..]).read_to_end(&mut bytes).expect("zlib");
        // 5, -2, -4 zigzag to 10, 3, 7; 1 and 0x01020303 to 2 and 0x02040606.
        assert_eq!(bytes[..6], [10, 3, 7, 0, 0, 0]);
        assert_eq!(bytes[6..14], [2, 6, 0, 6, 0, 4, 0, 2]);
        assert_eq!((&bytes[14..18], bytes[18]), (&1.5_f32.to_le_bytes()[..], 9));
        assert_eq!((arrays.stored["c"].offset, arrays.stored["c"].count), (14, 1));
    }
}
