//! Where a patch lies and how wide it is: the mean and the spread of the points that it stands for.
//!
//! Lengths are in unit coordinates. Not handled: its shape; a long patch is about as wide as it is long.

use glam::{DVec3, Vec3};

use crate::patches::scene_patches::Patches;
use crate::surfaces::SurfacePoint;

/// The points that a patch stands for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Their mean.
    pub middle: Vec3,
    /// Twice their RMS distance to it: 0.82 times the side of a square.
    pub width: f32,
}

/// Sums over points: how much they weigh, and what they and their squares come to.
#[derive(Clone, Copy, Default)]
struct Moments {
    weight: f64,
    sum: DVec3,
    squares: f64,
}

impl Patches {
    /// Where a patch lies, by its chosen points, or else by its area.
    pub(crate) fn extent(&self, i: usize) -> Extent {
        let chosen = self.chosen(i);
        if chosen.is_empty() {
            return self.cut_extent(i);
        }
        let point = |m: Moments, point: &SurfacePoint| m.with_point(point.position.as_dvec3());
        chosen.iter().fold(Moments::default(), point).extent()
    }

    /// Where a patch as it was cut lies, by its area.
    pub(crate) fn cut_extent(&self, i: usize) -> Extent {
        let triangle = |m: Moments, (_, corners): (u32, [Vec3; 3])| m.with_triangle(corners.map(Vec3::as_dvec3));
        self.pieces(i).fold(Moments::default(), triangle).extent()
    }
}

impl Moments {
    fn with_point(self, x: DVec3) -> Moments {
        Moments { weight: self.weight + 1.0, sum: self.sum + x, squares: self.squares + x.length_squared() }
    }

    /// With the points of a triangle, which weigh as much as its area: the mean of their squares is a twelfth of the
    /// corners' squares and of the square of the corners' sum.
    fn with_triangle(self, [a, b, c]: [DVec3; 3]) -> Moments {
        let area = 0.5 * (b - a).cross(c - a).length();
        let corners = a + b + c;
        let squares = [a, b, c, corners].iter().map(|x| x.length_squared()).sum::<f64>() / 12.0;
        Moments {
            weight: self.weight + area,
            sum: self.sum + area / 3.0 * corners,
            squares: self.squares + area * squares,
        }
    }

    fn extent(self) -> Extent {
        if self.weight == 0.0 {
            return Extent { middle: Vec3::ZERO, width: 0.0 };
        }
        let middle = self.sum / self.weight;
        let spread = (self.squares / self.weight - middle.length_squared()).max(0.0);
        Extent { middle: middle.as_vec3(), width: 2.0 * spread.sqrt() as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Rays;
    use crate::scene::Scene;

    /// A cell of a cube's wall is a square; its points chosen anew at its corners lie further apart.
    #[test]
    fn a_square_is_as_wide_as_its_points_lie_apart() {
        let scene = Scene::open("furnace").expect("a scene");
        let mut patches = Patches::new(&scene, &Rays::new(&scene), 24);
        let side = patches.areas()[0].sqrt();
        let whole = patches.extent(0);
        assert!((f64::from(whole.width) / side - 2.0 * 6.0_f64.sqrt().recip()).abs() < 1e-5, "{whole:?}");
        let ends = [0.0, 0.999_999].map(|u| patches.point(0, 0.0, u));
        let apart = ends[0].position.distance(ends[1].position);
        patches.start_from(vec![ends.to_vec()]);
        let chosen = patches.extent(0);
        assert!((chosen.width - apart).abs() < 1e-5, "{chosen:?} {apart}");
        assert!(chosen.middle.distance(0.5 * (ends[0].position + ends[1].position)) < 1e-5);
    }
}
