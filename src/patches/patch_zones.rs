//! Which zone each patch lies in, and which zones share a patch.
//!
//! Not handled: patches of small surfaces in several zones; they count for the zone of their first piece.

use glam::DVec3;

use crate::patches::scene_patches::Patches;
use crate::patches::zones::Zones;

impl Zones {
    /// The zone of every patch, front and back alike; that of its first piece, where it has pieces of several.
    pub fn of_patches(&self, patches: &Patches) -> Vec<u32> {
        let zone = |i: usize| {
            let (face, corners) = patches.pieces(i).next()?;
            let middle: DVec3 = corners.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / 3.0;
            Some(self.at(face, middle) as u32)
        };
        let all = (0..patches.len()).map(zone);
        all.map(|zone| zone.unwrap_or(0)).collect()
    }

    /// For every zone the one whose patch its own faces are part of: itself, unless small surfaces share a patch.
    pub fn shared(&self, patches: &Patches, of_patches: &[u32]) -> Vec<u32> {
        let mut shared: Vec<u32> = (0..self.len() as u32).collect();
        for (s, surface) in self.surfaces.list.iter().enumerate() {
            if let Some(patch) = patches.of_face(surface.faces[0])
                && self.tiles(s) == [1, 1]
            {
                shared[self.zone(s, 0, 0)] = of_patches[patch as usize];
            }
        }
        shared
    }
}
