//! Sums over bytes, which tell what is not the same: XXH3 with 128 bits.
//!
//! Two different scenes or files have one sum with a chance of 2^-128. Only place for `twox_hash`. Not handled: someone
//! who wants them to; no sum is a signature.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use glam::{DVec3, Vec3};
use twox_hash::XxHash3_128;

/// Bytes read at once.
const RUN: usize = 1 << 20;

/// A sum that grows.
pub struct Sum(XxHash3_128);

impl Sum {
    /// Over nothing.
    pub fn new() -> Sum {
        Sum(XxHash3_128::new())
    }

    /// Over a number more.
    pub fn number(&mut self, number: u64) {
        self.0.write(&number.to_le_bytes());
    }

    /// Over a vector's bits more.
    pub fn vector(&mut self, v: Vec3) {
        v.to_array().iter().for_each(|x| self.0.write(&x.to_le_bytes()));
    }

    /// The same in double precision.
    pub fn long_vector(&mut self, v: DVec3) {
        v.to_array().iter().for_each(|x| self.0.write(&x.to_le_bytes()));
    }

    /// Over bytes more, and how many they are.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        self.0.write(bytes);
    }

    /// Its 32 hexadecimal digits.
    pub fn digits(&self) -> String {
        digits(self.0.finish_128())
    }
}

fn digits(sum: u128) -> String {
    format!("{sum:032x}")
}

/// The sum over some bytes.
pub fn sum_of(bytes: &[u8]) -> String {
    digits(XxHash3_128::oneshot(bytes))
}

/// The length of a file, and the sum over its bytes.
pub fn sum_of_file(path: &Path) -> io::Result<(u64, String)> {
    let mut file = File::open(path)?;
    let (mut sum, mut length, mut run) = (XxHash3_128::new(), 0, vec![0; RUN]);
    loop {
        let read = file.read(&mut run)?;
        if read == 0 {
            return Ok((length, digits(sum.finish_128())));
        }
        sum.write(&run[..read]);
        length += read as u64;
    }
}
