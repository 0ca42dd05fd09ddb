//! Patch sizes from the error they make: small in the zones that the picture's error comes from, large elsewhere. And
//! rays of F's rows from the noise they leave.
//!
//! The squared error is the sum of the zones' shares. A share falls as `N^-ORDER` of the zone's patches, N^-3/2, so
//! that
//!
//! ```text
//! sum over zones of share_z (N'_z / N_z)^-3/2 = wanted, N'_z least in sum,   gives   N'_z / N_z ~ (share_z / N_z)^2/5
//! ```
//!
//! Noise of a row falls as 1/n of its rays: rows whose zones' `(share / N n)^1/2` exceeds a level are raised to it.
//! Where a patch is divided, each part counts less in the picture, as its area.
//!
//! Not handled: shares smaller than chance in the few rays that tell them; every zone is thought to have at least a
//! small one.

use crate::patches::Zones;
use crate::render::assembly::Prepared;
use crate::render::levels::ORDER;

/// The least share of a zone, beside that of its part of all patches.
const LEAST: f64 = 0.03;
/// Number of patches of a zone over that of before, at least and at most.
const STEP: (f64, f64) = (0.5, 16.0);
/// Number of all patches over that of before at most.
const GROWTH: f64 = 4.0;

/// Rays of a row over those of the row with fewest at most.
const DENSEST: f64 = 64.0;

/// The sizes of the patches of every zone, and how many rays they cast.
pub(crate) struct Sizes {
    zones: Zones,
    sizes: Vec<f64>,
    /// Rays of a patch of each zone over the fewest.
    densities: Vec<f64>,
    /// The largest size.
    largest: f64,
}

impl Sizes {
    /// The zones of patches of one size, as they are now.
    pub fn new(p: &Prepared) -> Sizes {
        let largest = p.patches.size();
        let zones = Zones::of(&p.surfaces, largest);
        Sizes { sizes: vec![largest; zones.len()], densities: vec![1.0; zones.len()], zones, largest }
    }

    /// Number of zones.
    pub fn len(&self) -> usize {
        self.zones.len()
    }

    /// Chooses sizes for a squared error of `wanted` times what the patches of `p` have, with at most so many patches;
    /// `shares` tells each patch's share, None where nothing is known of it. Returns by how much each zone's patches
    /// become more.
    pub fn refine(&mut self, p: &Prepared, shares: &[Option<f64>], wanted: f64, most: usize) -> Vec<f64> {
        let of_patches = self.zones.of_patches(&p.patches);
        let zones = of_zones(self.zones.len(), &of_patches, shares);
        let goal = wanted * zones.iter().map(|z| z.share).sum::<f64>();
        let count = p.patches.len() as f64;
        let most = (GROWTH * count).min(most as f64);
        let level = level(&zones, goal, most);
        let shared = self.zones.shared(&p.patches, &of_patches);
        let mut more = Vec::new();
        for (size, representative) in self.sizes.iter_mut().zip(shared) {
            let wanted = *size / zones[representative as usize].more(level).sqrt();
            // Steps of half an octave: small surfaces share patches only if their sizes agree.
            let steps = (2.0 * (self.largest / wanted).log2()).round().max(0.0);
            let before = std::mem::replace(size, self.largest * (-0.5 * steps).exp2());
            more.push((before / *size).powi(2));
        }
        more
    }

    /// Chooses more rays for the rows of some zones, for a squared noise of `wanted` times what `shares` add up to;
    /// zones have `more` times as many patches by then.
    pub fn spread(&mut self, p: &Prepared, shares: &[f64], wanted: f64, more: &[f64]) {
        let of_patches = self.zones.of_patches(&p.patches);
        let known: Vec<Option<f64>> = shares.iter().copied().map(Some).collect();
        let zones = of_zones(self.zones.len(), &of_patches, &known);
        let goal = wanted * zones.iter().map(|z| z.share).sum::<f64>();
        let rows: Vec<Row> = zones
            .iter()
            .zip(self.densities.iter().zip(more))
            .map(|(zone, (&density, more))| Row {
                worth: (zone.share * density / zone.count.max(1.0)).sqrt() / more,
                share: zone.share / more,
                density,
            })
            .collect();
        let level = least(|level| rows.iter().map(|r| r.left(level)).sum::<f64>() <= goal);
        for (density, row) in self.densities.iter_mut().zip(&rows) {
            *density = row.raised(level);
        }
    }

    /// Cuts the patches of `p` anew if their sizes changed, and sets their rays.
    pub fn apply(&self, p: &mut Prepared, resized: bool) {
        if resized {
            p.cut_zones(&self.zones, &self.sizes);
        }
        let of_patches = self.zones.of_patches(&p.patches);
        let density = |&zone: &u32| self.densities[zone as usize] as f32;
        p.densities = of_patches.iter().map(density).collect();
    }
}

/// The rows of a zone: what rays of one of them are worth, their share in the squared noise, and their rays.
struct Row {
    worth: f64,
    share: f64,
    density: f64,
}

impl Row {
    fn raised(&self, level: f64) -> f64 {
        (level * self.worth).clamp(self.density, DENSEST.max(self.density))
    }

    /// The share at a level.
    fn left(&self, level: f64) -> f64 {
        self.share * self.density / self.raised(level)
    }
}

/// A zone: number of patches, and share in the squared error.
#[derive(Clone, Copy, Default)]
struct Zone {
    count: f64,
    share: f64,
}

impl Zone {
    /// Times as many patches at a level: the price at which the error is still worth lessening, inverted.
    fn more(&self, level: f64) -> f64 {
        if self.count == 0.0 {
            return 1.0;
        }
        let free = (level * self.share / self.count).powf(1.0 / (1.0 + ORDER));
        free.clamp(STEP.0, STEP.1)
    }
}

/// Patches and shares of every zone; what is not known of one is taken for its part of all.
fn of_zones(count: usize, of_patches: &[u32], shares: &[Option<f64>]) -> Vec<Zone> {
    let known: Vec<f64> = shares.iter().flatten().copied().collect();
    let mean = (known.iter().sum::<f64>() / known.len().max(1) as f64).max(f64::MIN_POSITIVE);
    let mut zones = vec![Zone::default(); count];
    for (&z, share) in of_patches.iter().zip(shares) {
        zones[z as usize].count += 1.0;
        zones[z as usize].share += share.unwrap_or(mean);
    }
    for zone in &mut zones {
        zone.share = zone.share.max(0.0) + LEAST * mean * zone.count;
    }
    zones
}

/// The level at which the shares left add up to `goal`, or at which there are `most` patches if that is lower.
fn level(zones: &[Zone], goal: f64, most: f64) -> f64 {
    let enough = |level: f64| {
        let (mut left, mut count) = (0.0, 0.0);
        for zone in zones {
            let more = zone.more(level);
            left += zone.share * more.powf(-ORDER);
            count += zone.count * more;
        }
        left <= goal || count >= most
    };
    least(enough)
}

/// The least level that is enough, by bisection over the powers of two that f64 can hold; the largest if none is.
fn least(enough: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (-1000.0_f64, 1000.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if enough(middle.exp2()) { high = middle } else { low = middle }
    }
    high.exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zone(count: f64, share: f64) -> Zone {
        Zone { count, share }
    }

    #[test]
    fn equal_zones_grow_alike_until_the_error_is_as_wanted() {
        let zones = [zone(10.0, 1.0); 4];
        let level = level(&zones, 4.0 / 8.0, f64::INFINITY);
        // The squared error falls by 8 with 4 times the patches.
        assert!((zones[0].more(level) - 4.0).abs() < 1e-6);
    }

    #[test]
    fn no_other_choice_of_as_many_patches_leaves_less() {
        let zones = [zone(10.0, 5.0), zone(40.0, 0.3), zone(4.0, 1.0)];
        let level = level(&zones, 2.0, f64::INFINITY);
        let more = zones.map(|z| z.more(level));
        let left = |more: &[f64; 3]| -> f64 {
            let each = zones.iter().zip(more);
            each.map(|(z, m)| z.share * m.powf(-ORDER)).sum()
        };
        assert!((left(&more) - 2.0).abs() < 1e-9);
        // Moving one patch from any zone to any other.
        for from in 0..3 {
            for to in 0..3 {
                let mut moved = more;
                moved[from] -= 0.1 / zones[from].count;
                moved[to] += 0.1 / zones[to].count;
                assert!(left(&moved) >= left(&more) - 1e-12, "{from} to {to}");
            }
        }
    }

    #[test]
    fn rays_go_where_noise_comes_from_and_are_never_fewer() {
        let row = |worth: f64, share: f64| Row { worth, share, density: 1.0 };
        let rows = [row(10.0, 100.0), row(1.0, 1.0), row(0.1, 0.01)];
        let left = |level: f64| rows.iter().map(|r| r.left(level)).sum::<f64>();
        let level = least(|level| left(level) <= 20.0);
        assert!((left(level) - 20.0).abs() < 1e-6);
        let raised = rows.map(|r| r.raised(level));
        assert!(raised[0] > 5.0 && raised[1] == 1.0 && raised[2] == 1.0);
    }

    #[test]
    fn the_number_of_patches_has_a_limit() {
        let zones = [zone(10.0, 1.0), zone(10.0, 0.1)];
        let level = level(&zones, 1e-9, 40.0);
        let count: f64 = zones.iter().map(|z| z.count * z.more(level)).sum();
        assert!((count - 40.0).abs() < 1e-6, "{count}");
    }

    #[test]
    fn what_is_not_known_counts_like_the_mean() {
        let zones = of_zones(2, &[0, 0, 1], &[Some(3.0), Some(1.0), None]);
        assert!((zones[0].share / zones[1].share - 2.0).abs() < 1e-12);
    }
}
