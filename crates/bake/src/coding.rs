//! Irradiance as eight-bit codes.
//!
//! ```text
//! RGBM:   E = range * A * (R, G, B)          each code / 255, linear
//! sRGB:   E = range * decode(R, G, B)        each code / 255 through the sRGB curve (IEC 61966-2-1)
//! ```
//!
//! The range is the largest value of a map. RGBM tells values apart by half a percent down to 1/255 of the range, sRGB
//! by one percent at a fifth of it and by four at a hundredth.
//!
//! Not handled: dithering; negative values, which count as 0.

use glam::Vec3;
use halflight::pictures::{Picture, Texels, encode_srgb};

/// The largest channel of a map, W/m²; 1 of a black one.
pub fn range(map: &Picture) -> f32 {
    let most = map.pixels.iter().fold(0.0_f32, |most, pixel| most.max(pixel.max_element()));
    if most > 0.0 && most.is_finite() { most } else { 1.0 }
}

/// A code of a number from 0 to 1.
fn code(value: f32) -> u8 {
    (255.0 * value.clamp(0.0, 1.0)).round() as u8
}

/// A map as RGBM.
pub fn rgbm(map: &Picture, range: f32) -> Texels {
    let one = |pixel: &Vec3| {
        let share = (*pixel / range).clamp(Vec3::ZERO, Vec3::ONE);
        // The least multiplier that holds the largest channel.
        let multiplier = (255.0 * share.max_element()).ceil().clamp(1.0, 255.0);
        let own = share * 255.0 / multiplier;
        [code(own.x), code(own.y), code(own.z), multiplier as u8]
    };
    let codes = map.pixels.iter().flat_map(one).collect();
    Texels { width: map.width, height: map.height, channels: 4, codes }
}

/// A map as sRGB.
pub fn srgb(map: &Picture, range: f32) -> Texels {
    let one = |pixel: &Vec3| pixel.to_array().map(|x| code(encode_srgb((x / range).clamp(0.0, 1.0))));
    let codes = map.pixels.iter().flat_map(one).collect();
    Texels { width: map.width, height: map.height, channels: 3, codes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::pictures::decode_srgb;

    #[test]
    fn codes_give_back_what_they_stand_for() {
        let values = |k: usize| {
            let x = 20.0 * 0.97_f32.powi(k as i32);
            Vec3::new(x, 0.6 * x, 0.3 * x)
        };
        let map = Picture { pixels: (0..128).map(values).collect(), ..Picture::new(16, 8) };
        let range = range(&map);
        assert_eq!(range, 20.0);
        for (pixel, codes) in map.pixels.iter().zip(rgbm(&map, range).codes.chunks_exact(4)) {
            let [r, g, b, m] = [0, 1, 2, 3].map(|c| f32::from(codes[c]) / 255.0);
            // Half a code of the multiplied colours.
            let off = (range * m * Vec3::new(r, g, b) - *pixel).abs().max_element();
            assert!(off <= 0.5 / 255.0 * range * m * 1.001, "{pixel} {off}");
        }
        for (pixel, codes) in map.pixels.iter().zip(srgb(&map, range).codes.chunks_exact(3)) {
            let off = (range * decode_srgb(f32::from(codes[0]) / 255.0) - pixel.x).abs() / pixel.x;
            assert!(off < 0.025, "{pixel} {off}");
        }
    }
}
