//! Owen-scrambled Sobol points: well spread numbers in [0, 1) for up to six dimensions.
//!
//! The first `2^m` points of every dimension, and of every aligned block of that length, put one point into each
//! interval of length `2^-m`; dimensions 0 and 1 together put one into each elementary interval of area `2^-m`. Nested
//! uniform scrambling keeps this, makes every point uniform by itself, and gives errors of about N^-3/2 for smooth
//! integrands.
//!
//! Not handled: more than six dimensions; dimensions 2 and 3 are a (t, m, 2)-net with t up to 3, since in base 2
//! only the two polynomials of least degree give t = 0.
//!
//! Sources: S. Joe, F. Y. Kuo, *Constructing Sobol sequences with better two-dimensional projections*, SIAM J. Sci.
//! Comput. 30, 2008 (direction numbers); B. Burley, *Practical hash-based Owen scrambling*, JCGT 9(4), 2020; N.
//! Vegdahl, *Building a better LK hash*, 2021 (constants of the permutation).

/// Dimensions there are direction numbers for.
pub const DIMENSIONS: usize = 6;

/// Polynomial degree, inner coefficients and initial numbers of dimensions 1 to 5; dimension 0 is van der Corput's.
const JOE_KUO: [(usize, u32, [u32; 4]); DIMENSIONS - 1] =
    [(1, 0, [1, 0, 0, 0]), (2, 1, [1, 3, 0, 0]), (3, 1, [1, 3, 1, 0]), (3, 2, [1, 1, 1, 0]), (4, 1, [1, 1, 3, 3])];

/// The Sobol sequence with its first points tabled.
pub struct Sobol {
    /// Column k of dimension d, its bits reversed: what bit k of the index adds.
    columns: [[u32; 32]; DIMENSIONS],
    /// Points by index, one dimension after the other, bits reversed.
    table: Vec<u32>,
    /// Points tabled of each dimension.
    count: usize,
}

impl Sobol {
    /// Tables the first `count` points of `dimensions` dimensions (at most [`DIMENSIONS`]; more are cut off).
    pub fn new(count: usize, dimensions: usize) -> Sobol {
        let dimensions = dimensions.clamp(1, DIMENSIONS);
        let columns = std::array::from_fn(|d| columns(d).map(u32::reverse_bits));
        let mut table = vec![0; count * dimensions];
        // Point i is the point without its highest bit, plus that bit's column.
        for (own, column) in table.chunks_exact_mut(count.max(1)).zip(&columns) {
            let column: &[u32; 32] = column;
            for index in 1..count {
                let top = index.ilog2() as usize;
                own[index] = own[index - (1 << top)] ^ column[top];
            }
        }
        Sobol { columns, table, count }
    }

    /// Coordinate `dimension` of point `index` under the scrambling `seed`, in [0, 1).
    ///
    /// Points beyond the table are computed. Different dimensions are scrambled independently.
    ///
    /// # Panics
    ///
    /// If `dimension` is [`DIMENSIONS`] or more.
    #[inline]
    pub fn point(&self, index: u32, dimension: usize, seed: u32) -> f32 {
        let tabled = match self.tabled(dimension) {
            Some(own) => own.get(index as usize).copied(),
            None => None,
        };
        let reversed = tabled.unwrap_or_else(|| self.compute(index, dimension));
        unit(permute(reversed, hash(dimension as u32, seed)))
    }

    /// [`Sobol::point`] of the points from `first` on, as many as `out` holds: without branches if they are tabled, so
    /// that a caller compiled for vector instructions has them made side by side.
    #[inline(always)]
    pub(crate) fn fill(&self, first: u32, dimension: usize, seed: u32, out: &mut [f32]) {
        let key = hash(dimension as u32, seed);
        let range = first as usize..first as usize + out.len();
        match self.tabled(dimension).and_then(|own| own.get(range)) {
            Some(own) => {
                for (out, reversed) in out.iter_mut().zip(own) {
                    *out = unit(permute(*reversed, key));
                }
            }
            None => {
                for (out, index) in out.iter_mut().zip(first..) {
                    *out = unit(permute(self.compute(index, dimension), key));
                }
            }
        }
    }

    /// The table of one dimension.
    #[inline(always)]
    fn tabled(&self, dimension: usize) -> Option<&[u32]> {
        self.table.get(dimension * self.count..(dimension + 1) * self.count)
    }

    /// The point's coordinate, bits reversed, without the table.
    fn compute(&self, index: u32, dimension: usize) -> u32 {
        let columns = &self.columns[dimension];
        (0..32).filter(|bit| index >> bit & 1 == 1).fold(0, |sum, bit| sum ^ columns[bit])
    }
}

/// Mixes a value and a seed into 32 bits that look independent of either.
#[inline]
pub fn hash(value: u32, seed: u32) -> u32 {
    let mixed = finish(seed.wrapping_add(0x9e37_79b9));
    finish(value ^ mixed)
}

/// Numbers in [0, 1) that look independent of each other and of those of other seeds, one after the other.
///
/// For what has more dimensions than [`Sobol`]: paths of any length.
#[derive(Clone, Debug)]
pub struct Stream {
    seed: u32,
    count: u32,
}

impl Stream {
    /// The stream of a seed.
    pub fn new(seed: u32) -> Stream {
        Stream { seed, count: 0 }
    }

    /// The next number.
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        fraction(self.bits())
    }

    /// The next 32 bits, all of them random: a seed for other numbers.
    #[inline]
    pub fn bits(&mut self) -> u32 {
        self.count = self.count.wrapping_add(1);
        hash(self.count, self.seed)
    }
}

/// The number in [0, 1) of bits: their first 24, all an f32 below 1 can hold, so that nothing rounds up to 1.
#[inline(always)]
pub fn fraction(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The seed of the k-th of several answers that differ in their points only.
pub fn replica_seed(seed: u32, k: u32) -> u32 {
    seed.wrapping_add(k.wrapping_mul(0x9e37_79b9))
}

/// A bijection of 32 bits in which every input bit moves every output bit (C. Wellons' low-bias constants).
#[inline]
fn finish(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Nested uniform scrambling of bit-reversed numbers: each bit is flipped by a hash of the lower ones.
///
/// Laine and Karras's permutation: additions, and multiplications by odd or of the form `x ^= x * even`,
/// carry upwards only.
#[inline(always)]
fn permute(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The number in [0, 1) of reversed bits.
#[inline(always)]
fn unit(reversed: u32) -> f32 {
    fraction(reversed.reverse_bits())
}

/// Direction numbers of a dimension, column k for bit k of the index, the first binary digit in the highest bit.
fn columns(dimension: usize) -> [u32; 32] {
    let mut v: [u32; 32] = std::array::from_fn(|k| 1 << (31 - k));
    if dimension == 0 {
        return v;
    }
    let (degree, inner, initial) = JOE_KUO[dimension - 1];
    for k in 0..degree {
        v[k] = initial[k] << (31 - k);
    }
    // The recurrence of the primitive polynomial x^s + a_1 x^(s-1) + ... + 1.
    for k in degree..32 {
        v[k] = v[k - degree] ^ (v[k - degree] >> degree);
        for i in 1..degree {
            if inner >> (degree - 1 - i) & 1 == 1 {
                v[k] ^= v[k - i];
            }
        }
    }
    v
}
