//! A texture of three dimensions as KTX 2.0, half floats of red, green, blue and alpha.
//!
//! Source: Khronos Group, *KTX File Format Specification*, version 2.0, and *Khronos Data Format Specification* 1.3 for
//! what describes the texels. Not handled: other formats, mipmaps, compression.

use glam::Vec3;
use half::f16;

/// What every file begins with.
const IDENTIFIER: [u8; 12] = [0xAB, b'K', b'T', b'X', b' ', b'2', b'0', 0xBB, b'\r', b'\n', 0x1A, b'\n'];
/// Vulkan's VK_FORMAT_R16G16B16A16_SFLOAT.
const HALF_FLOATS: u32 = 97;
/// Bytes of the header with the index of one level.
const HEADER: u32 = 12 + 9 * 4 + 4 * 4 + 2 * 8 + 3 * 8;
/// The description of four samples.
const SAMPLES: u32 = 4;
const DESCRIPTION: u32 = 4 + 24 + 16 * SAMPLES;

/// The bytes of a file of so many texels along x, y and z, x running fastest.
pub(crate) fn ktx2(size: [usize; 3], texels: &[Vec3]) -> Vec<u8> {
    let mut bytes = IDENTIFIER.to_vec();
    let mut word = |number: u32| bytes.extend_from_slice(&number.to_le_bytes());
    let [width, height, depth] = size.map(|n| n as u32);
    // Format, size of a number, size, no layers, one face, one level, no compression.
    [HALF_FLOATS, 2, width, height, depth, 0, 1, 1, 0].into_iter().for_each(&mut word);
    // The description, no keys and values, nothing of compression.
    [HEADER, DESCRIPTION, 0, 0, 0, 0, 0, 0].into_iter().for_each(&mut word);
    let start = (HEADER + DESCRIPTION).next_multiple_of(8);
    let length = (8 * texels.len()) as u32;
    [start, 0, length, 0, length, 0].into_iter().for_each(&mut word);
    describe(&mut word);
    bytes.resize(start as usize, 0);
    for texel in texels {
        for number in texel.extend(1.0).to_array() {
            bytes.extend_from_slice(&f16::from_f32(number.clamp(0.0, f16::MAX.to_f32())).to_le_bytes());
        }
    }
    bytes
}

/// The description: linear RGBA of BT.709's primaries, eight bytes a texel, four signed floats of 16 bits.
fn describe(word: &mut impl FnMut(u32)) {
    [DESCRIPTION, 0, 2 | ((DESCRIPTION - 4) << 16), 1 | (1 << 8) | (1 << 16), 0, 8, 0].into_iter().for_each(&mut *word);
    for (k, channel) in [0, 1, 2, 15].into_iter().enumerate() {
        let floats = 0xC0;
        [(16 * k as u32) | (15 << 16) | ((channel | floats) << 24), 0, (-1.0_f32).to_bits(), 1.0_f32.to_bits()]
            .into_iter()
            .for_each(&mut *word);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the reader that Bevy uses reads it.
    #[test]
    fn another_reader_finds_the_texels() {
        let texels: Vec<Vec3> = (0..24).map(|k| Vec3::new(k as f32, 0.5 * k as f32, 1e6)).collect();
        let bytes = ktx2([2, 4, 3], &texels);
        let reader = ktx2::Reader::new(&bytes).expect("a KTX 2.0 file");
        let header = reader.header();
        assert_eq!((header.pixel_width, header.pixel_height, header.pixel_depth), (2, 4, 3));
        assert_eq!(header.format, Some(ktx2::Format::R16G16B16A16_SFLOAT));
        let level = reader.levels().next().expect("one level");
        let half = |k: usize| f16::from_le_bytes([level.data[2 * k], level.data[2 * k + 1]]).to_f32();
        assert_eq!([half(4 * 7), half(4 * 7 + 1), half(4 * 7 + 2), half(4 * 7 + 3)], [7.0, 3.5, 65504.0, 1.0]);
        assert_eq!(level.data.len(), 8 * 24);
        assert!(reader.dfd_blocks().len() == 1);
    }
}
