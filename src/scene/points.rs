//! Points in single precision, each once, and how thick triangles of them are.
//!
//! Not handled: points that lie close together without being the same.

use glam::Vec3;
use rustc_hash::FxHashMap;

/// The least height of a triangle over its longest side, unit coordinates: the rounding of a coordinate near 1.
/// Thinner ones have no normal.
pub const THINNEST: f64 = 1.0 / (1 << 23) as f64;

/// Different points, by number.
#[derive(Default)]
pub(crate) struct Points {
    pub list: Vec<Vec3>,
    index: FxHashMap<[u32; 3], u32>,
}

impl Points {
    /// The number of a point, added if it is new.
    pub fn number(&mut self, point: Vec3) -> u32 {
        // Adding zero makes -0 and 0 one point.
        let point = point + Vec3::ZERO;
        *self.index.entry(point.to_array().map(f32::to_bits)).or_insert_with(|| {
            self.list.push(point);
            self.list.len() as u32 - 1
        })
    }
}

/// Height of a triangle over its longest side: twice the area by the side.
pub(crate) fn height(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|v| v.as_dvec3());
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let double_area = (b - a).cross(c - a).length();
    if longest > 0.0 { double_area / longest } else { 0.0 }
}
