//! A hasher for tables of numbers: fast, and without random state, so that runs are repeatable.
//!
//! Each word is added by a rotation, an exclusive or and a multiplication (the scheme of Firefox and rustc).
//!
//! Not handled: keys chosen to collide.

use std::hash::{BuildHasherDefault, Hasher};

/// Makes [`Mix`] for a table.
pub(crate) type BuildMix = BuildHasherDefault<Mix>;

/// Mixes words into 64 bits.
#[derive(Default)]
pub(crate) struct Mix(u64);

impl Mix {
    #[inline]
    fn add(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(0x517c_c1b7_2722_0a95);
    }
}

impl Hasher for Mix {
    #[inline]
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.add(u64::from_le_bytes(word));
        }
    }

    #[inline]
    fn write_u32(&mut self, x: u32) {
        self.add(u64::from(x));
    }

    #[inline]
    fn write_u64(&mut self, x: u64) {
        self.add(x);
    }

    #[inline]
    fn write_usize(&mut self, x: usize) {
        self.add(x as u64);
    }

    /// The highest bits are mixed best; tables look at the lowest first.
    #[inline]
    fn finish(&self) -> u64 {
        self.0.rotate_left(26)
    }
}
