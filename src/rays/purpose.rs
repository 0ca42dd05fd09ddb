//! Seeds by purpose: what a seed of the user's chooses is many things, and no two of them may share random numbers.
//!
//! Not handled: numbers within one purpose, which [`hash`](crate::rays::sobol::hash) separates by patch or pixel.

/// What random numbers are for.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// Points on patches and luminaires, for the light that patches receive.
    Received,
    /// Points on patches, for what punctual lights send there.
    ReceivedFromPoints,
    /// Camera rays of a half, 0 or 1.
    CameraRays(usize),
    /// Camera rays for the outlines of emitters.
    Outlines,
    /// Hemisphere rays of a half of an irradiance record, 0 or 1.
    HemisphereRays(usize),
    /// Rays of a replica of a point that irradiance is estimated at.
    Points(usize),
    /// Places at which the error of the fit between records is sampled.
    Validation,
    /// Pixels at which the error of the light is sampled, and their paths.
    SampledPixels,
    /// The n-th set of paths that patches are divided by.
    Paths(u32),
    /// The n-th samples of bright patches.
    BrightPatches(u32),
    /// Walks of light from the emitters.
    Walks,
    /// Walks of light that are seen by the camera.
    LightTracing,
    /// Walks of light that land once.
    Landings,
    /// Points on luminaires for the texels of pages.
    Texels,
    /// Paths that tell which texels of a page are reached.
    Reached,
    /// Rays from the cells of small faces of a page.
    CellRows,
    /// Estimates that a picture is audited by.
    Audit,
    /// References that `compare` renders by the path tracer.
    TracedReference,
    /// References that `compare` renders to a tolerance.
    SolvedReference,
}

impl Purpose {
    /// The seed of a purpose, from that of all.
    #[inline]
    pub fn seed(self, seed: u32) -> u32 {
        seed ^ self.salt()
    }

    /// Numbers that differ by far more than seeds which users count up.
    #[inline]
    fn salt(self) -> u32 {
        match self {
            Purpose::Received => 0x5eed_1a3b,
            Purpose::ReceivedFromPoints => 0x706f_696e,
            Purpose::CameraRays(half) => [0x9a7e_0000, 0x3c6e_f372][half],
            Purpose::HemisphereRays(half) => [0x51ed_270b, 0xa3b1_95c7][half],
            Purpose::Points(replica) => 0x1f83_0000_u32 ^ (replica as u32).wrapping_mul(0x0a54_1000),
            Purpose::Validation => 0x7a11_da7e,
            Purpose::Outlines => 0x6f75_746c,
            Purpose::SampledPixels => 0x7f4a_7c15,
            Purpose::Paths(set) => set.wrapping_mul(0x85eb_ca6b),
            Purpose::BrightPatches(round) => 0x2c1b_3c6d_u32.wrapping_add(round.wrapping_mul(0x0101_0000)),
            Purpose::Walks => 0x6c77_616c,
            Purpose::LightTracing => 0x7472_6163,
            Purpose::Landings => 0x6c61_6e64,
            Purpose::Texels => 0x3f84_d5b5,
            Purpose::Reached => 0x9d2c_5680,
            Purpose::CellRows => 0xefc6_0000,
            Purpose::Audit => 0x4175_6469,
            Purpose::TracedReference => 0xd1b5_4a33,
            Purpose::SolvedReference => 0x5eed_0002,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 1,024 seeds one after the other none shares a stream with another purpose of any of them.
    #[test]
    fn no_two_purposes_share_a_stream() {
        const SEEDS: u32 = 1024;
        let mut all = vec![
            Purpose::Received,
            Purpose::ReceivedFromPoints,
            Purpose::Validation,
            Purpose::SampledPixels,
            Purpose::Walks,
            Purpose::LightTracing,
            Purpose::TracedReference,
            Purpose::SolvedReference,
        ];
        all.extend([Purpose::Texels, Purpose::Reached, Purpose::CellRows, Purpose::Audit]);
        all.extend([0, 1].map(Purpose::CameraRays));
        all.extend([0, 1].map(Purpose::HemisphereRays));
        all.extend((0..16).map(Purpose::Points));
        all.extend((1..=16).flat_map(|n| [Purpose::Paths(n), Purpose::BrightPatches(n)]));
        for (k, a) in all.iter().enumerate() {
            assert!(a.salt() >= SEEDS, "{a:?}: as if it were a seed");
            for b in &all[..k] {
                assert!(a.salt() ^ b.salt() >= SEEDS, "{a:?} {b:?}");
            }
        }
    }
}
