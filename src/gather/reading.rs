//! How a gather ray reads the light of what it meets: at once, after more rays, or with direct light asked for there.
//!
//! Not handled: which reading a picture needs; the weighted residual tells.

/// How a gather ray reads the light of the surface it meets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// More rays that it follows before.
    pub bounces: u32,
    /// Where direct light comes from at its end.
    pub direct: Direct,
}

/// Where the direct light of a surface comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direct {
    /// The patch's mean, as all other light.
    #[default]
    Patch,
    /// Asked for at the point.
    Asked,
}

impl Reading {
    /// The light of the patch that is met.
    pub const PLAIN: Reading = Reading { bounces: 0, direct: Direct::Patch };

    /// The readings to choose from, cheapest first.
    pub const ALL: [Reading; READINGS] = {
        let mut all = [Reading::PLAIN; READINGS];
        let mut k = 0;
        while k < READINGS {
            all[k] = Reading { bounces: k as u32 / 2, direct: if k % 2 == 0 { Direct::Patch } else { Direct::Asked } };
            k += 1;
        }
        all
    };

    /// Its number in [`Reading::ALL`].
    pub fn number(self) -> usize {
        2 * self.bounces as usize + usize::from(self.direct == Direct::Asked)
    }
}

/// Readings to choose from.
pub const READINGS: usize = 10;
