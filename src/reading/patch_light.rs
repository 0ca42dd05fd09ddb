//! The light on patches that rays read: one or more fields at once, linear within each patch, and how rays read them.
//!
//! ```text
//! L(x) = L_i + G_i (x - c_i)      c_i the patch's centroid, so the patch keeps its mean
//! ```
//!
//! In a corner, light gathered from within a patch's size has an error of first order in that size where patches have
//! one value each (too bright), of second order with slopes. Along each axis the slope is the mean of the differences
//! to both sides, at most twice the smaller one and none where their signs differ (B. van Leer, 1977), so that a
//! shadow's edge makes no ripples; at a rim it is the difference to the one side. Light stays positive.
//!
//! Not handled: patches without neighbours, which have one value; variation within a patch beyond linear.

use glam::{DVec3, Mat3, Vec3};

use crate::light::{Light, Rgb};
use crate::patches::{Neighbours, Patches};

/// `L'`, the invisible light that hemisphere rays read, one or more fields of it at once.
#[derive(Clone, Debug, Default)]
pub struct Fields {
    count: usize,
    /// Number of fields that add up to the picture; they come first, auxiliary fields follow.
    picture_fields: usize,
    /// The last fields are the picture's taken apart.
    layers: FieldLayers,
    /// Patch by patch, field by field.
    values: Vec<Linear>,
    /// Irradiance over pi of the patches themselves; empty where unknown.
    ambient: Vec<Rgb>,
    /// The first field without direct light of luminaires; empty where unknown.
    without_direct: Vec<Linear>,
    /// Least distance from which each patch is read; shorter rays go on. Empty where there is none.
    near: Vec<f32>,
}

/// Fields that are the light of the picture taken apart, twice: by emitters, and by bounces. Each adds up to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FieldLayers {
    /// Fields of the emitters, before those of the bounces.
    pub emitters: usize,
    /// Fields of the bounces; light that was reflected as often as there are, or more, is in the last.
    pub bounces: usize,
}

/// What each part of some light is multiplied by, and what is added to it, so that the parts add up to the whole; light
/// of which no part has any is alike in all of them.
pub(crate) fn to_whole(parts: impl ExactSizeIterator<Item = DVec3>, whole: DVec3) -> (DVec3, DVec3) {
    let count = parts.len().max(1) as f64;
    let sum: DVec3 = parts.sum();
    let scale = DVec3::from([0, 1, 2].map(|c| if sum[c] > 0.0 { whole[c] / sum[c] } else { 0.0 }));
    (scale, DVec3::select(sum.cmpgt(DVec3::ZERO), DVec3::ZERO, whole) / count)
}

impl FieldLayers {
    /// Number of fields.
    pub(crate) fn count(&self) -> usize {
        self.emitters + self.bounces
    }
}

impl Fields {
    /// Fields of one value a patch.
    ///
    /// # Panics
    /// If the fields differ in length.
    pub fn new(fields: &[Vec<Rgb>]) -> Fields {
        let constant = |field: &Vec<Rgb>| field.iter().map(|v| Linear::constant(*v)).collect();
        Fields::linear(&fields.iter().map(constant).collect::<Vec<_>>())
    }

    /// Interleaves fields that are linear within each patch.
    ///
    /// # Panics
    /// If the fields differ in length.
    pub fn linear(fields: &[Vec<Linear>]) -> Fields {
        let patches = fields.first().map_or(0, Vec::len);
        assert!(fields.iter().all(|f| f.len() == patches));
        let values = (0..patches).flat_map(|i| fields.iter().map(move |f| f[i]));
        Fields { count: fields.len(), picture_fields: fields.len(), values: values.collect(), ..Fields::default() }
    }

    /// Only the first `picture_fields` fields make the picture; the others are auxiliary, gathered by the same rays.
    pub fn with_picture_fields(mut self, picture_fields: usize) -> Fields {
        self.picture_fields = picture_fields.min(self.count);
        self
    }

    /// The same, dark on patches cut by spots, whose light rays and paths find otherwise
    /// ([`crate::direct::strata_light`]).
    pub(crate) fn without_strata(mut self, patches: &Patches) -> Fields {
        for (i, _) in patches.all_strata() {
            self.values[i * self.count..(i + 1) * self.count].fill(Linear::DARK);
            self.without_direct.get_mut(i).into_iter().for_each(|rest| *rest = Linear::DARK);
        }
        self
    }

    /// The fields that make the picture, without auxiliary ones.
    pub fn picture_only(&self) -> Fields {
        let own = self.values.chunks_exact(self.count.max(1));
        let values = own.flat_map(|v| &v[..self.picture_fields]).copied().collect();
        Fields { count: self.picture_fields, values, layers: FieldLayers::default(), ..self.clone() }
    }

    /// Adds auxiliary fields, gathered by the same rays.
    ///
    /// # Panics
    /// If the fields differ in length.
    pub(crate) fn with_auxiliary(mut self, added: &[Vec<Linear>]) -> Fields {
        let patches = self.values.len() / self.count.max(1);
        assert!(added.iter().all(|field| field.len() == patches));
        let own = self.values.chunks_exact(self.count.max(1)).enumerate();
        self.values = own.flat_map(|(i, v)| v.iter().copied().chain(added.iter().map(move |f| f[i]))).collect();
        self.count += added.len();
        self
    }

    /// Adds auxiliary fields that are the picture's by emitters, so many, and by bounces.
    pub(crate) fn with_layers(self, fields: &[Vec<Linear>], emitters: usize) -> Fields {
        let layers = FieldLayers { emitters, bounces: fields.len() - emitters };
        Fields { layers, ..self.with_auxiliary(fields) }
    }

    /// The fields that are the picture's taken apart.
    pub(crate) fn layers(&self) -> FieldLayers {
        self.layers
    }

    /// The first of those.
    pub(crate) fn first_layer(&self) -> usize {
        self.count - self.layers.count()
    }

    /// Adds the irradiance over pi that the patches themselves receive of these fields, an estimate of indirect light
    /// before any of it is gathered.
    pub fn with_ambient(mut self, ambient: Vec<Rgb>) -> Fields {
        self.ambient = ambient;
        self
    }

    /// Adds the first field without the direct light of luminaires, of which two estimates are given, for readers that
    /// sample direct light themselves.
    pub fn with_rest(mut self, direct: [Vec<Rgb>; 2], patches: &Patches) -> Fields {
        let neighbours = patches.neighbours();
        let [a, b] = direct.map(|values| linear(&neighbours, &values));
        let rest = |i: usize| {
            let direct = a[i].mix(0.5, &b[i], 0.5);
            self.of_patch(i as u32)[0].mix(1.0, &direct, -1.0)
        };
        self.without_direct = (0..a.len()).map(rest).collect();
        self
    }

    /// Sets the least distance from which each patch is read, unit coordinates; shorter rays go on.
    pub fn not_read_nearer(mut self, near: Vec<f32>) -> Fields {
        self.near = near;
        self
    }

    /// Whether a ray of this length is too short to read the patch it meets.
    #[inline]
    pub(crate) fn is_near(&self, patch: u32, distance: f32) -> bool {
        self.near.get(patch as usize).is_some_and(|&near| distance < near)
    }

    /// Whether every ray reads the first patch that it meets.
    pub(crate) fn is_read_at_once(&self) -> bool {
        self.near.is_empty()
    }

    /// The first field at a point of a patch, without the direct light of luminaires.
    #[inline]
    pub(crate) fn without_direct(&self, patch: u32, position: Vec3) -> Rgb {
        match self.without_direct.get(patch as usize) {
            Some(rest) => rest.at(position),
            None => self.of_patch(patch)[0].at(position),
        }
    }

    /// Number of fields.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Number of fields that make the picture.
    pub(crate) fn picture_fields(&self) -> usize {
        self.picture_fields
    }

    /// Whether no field has any light.
    pub fn is_dark(&self) -> bool {
        self.values.iter().all(|v| *v == Linear::DARK)
    }

    #[inline]
    pub(crate) fn of_patch(&self, patch: u32) -> &[Linear] {
        let start = patch as usize * self.count;
        &self.values[start..start + self.count]
    }

    #[inline]
    pub(crate) fn ambient(&self, patch: u32) -> Rgb {
        self.ambient.get(patch as usize).copied().unwrap_or(Rgb::ZERO)
    }
}

/// The invisible half of patch light, as a field to gather.
pub fn invisible(light: &[Light]) -> Vec<Rgb> {
    light.iter().map(|l| l.invisible).collect()
}

/// Light that varies linearly with position: `at_origin + slope * x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    /// Its value at the origin of coordinates.
    pub at_origin: Rgb,
    /// Change of (R, G, B) over x.
    pub slope: Mat3,
}

impl Linear {
    /// No light.
    pub const DARK: Linear = Linear { at_origin: Rgb::ZERO, slope: Mat3::ZERO };

    /// Light of one value everywhere.
    pub fn constant(value: Rgb) -> Linear {
        Linear { at_origin: value, slope: Mat3::ZERO }
    }

    /// Light at x.
    #[inline]
    pub fn at(&self, x: Vec3) -> Rgb {
        self.at_origin + self.slope * x
    }

    /// `u self + v other`.
    pub fn mix(&self, u: f32, other: &Linear, v: f32) -> Linear {
        Linear { at_origin: u * self.at_origin + v * other.at_origin, slope: self.slope * u + other.slope * v }
    }
}

/// Light of the patches as linear within each, from one value a patch.
pub fn linear(neighbours: &Neighbours, values: &[Rgb]) -> Vec<Linear> {
    (0..values.len()).map(|i| one(neighbours, values, i)).collect()
}

fn one(neighbours: &Neighbours, values: &[Rgb], i: usize) -> Linear {
    let halves = neighbours.halves(i);
    let middle = neighbours.middle(i);
    // Change over half the patch along either axis.
    let mut changes = [0, 1].map(|axis| {
        let length = halves[axis].length_squared();
        let difference = |j: usize| {
            let steps = (neighbours.middle(j) - middle).dot(halves[axis]) / length;
            let change = (values[j] - values[i]) / steps;
            // The step to a larger neighbour along one axis may be orthogonal to it; then there is no slope.
            if change.is_finite() { change } else { Rgb::ZERO }
        };
        match neighbours.beside(i, axis) {
            [Some(after), Some(before)] => limited(difference(after), difference(before)),
            [Some(one), None] | [None, Some(one)] => difference(one),
            [None, None] => Rgb::ZERO,
        }
    });
    for channel in 0..3 {
        let reach: f32 = changes.iter().map(|c| c[channel].abs()).sum();
        if reach > values[i][channel] {
            let share = (values[i][channel] / reach).max(0.0);
            changes.iter_mut().for_each(|c| c[channel] *= share);
        }
    }
    let mut slope = Mat3::ZERO;
    for (change, half) in changes.iter().zip(halves) {
        if *change != Rgb::ZERO {
            let along = half / half.length_squared();
            slope += Mat3::from_cols(*change * along.x, *change * along.y, *change * along.z);
        }
    }
    Linear { at_origin: values[i] - slope * middle, slope }
}

/// The mean of two differences, at most twice the smaller; 0 where their signs differ.
fn limited(a: Rgb, b: Rgb) -> Rgb {
    let one = |a: f32, b: f32| {
        if a * b <= 0.0 {
            return 0.0;
        }
        let size = (0.5 * (a + b).abs()).min(2.0 * a.abs().min(b.abs()));
        size.copysign(a)
    };
    Rgb::new(one(a.x, b.x), one(a.y, b.y), one(a.z, b.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Rays;
    use crate::scene::Scene;

    fn furnace() -> Patches {
        let scene = Scene::open("furnace").unwrap();
        Patches::new(&scene, &Rays::new(&scene), 600)
    }

    /// Largest difference between the light read and `exact`, at the corners of all patches.
    fn worst(patches: &Patches, light: &[Linear], exact: impl Fn(Vec3) -> Rgb) -> f32 {
        let corners = |i: usize| patches.pieces(i).flat_map(|p| p.1).collect::<Vec<_>>();
        let of = |i: usize| {
            let apart = |x: Vec3| (light[i].at(x) - exact(x)).abs().max_element();
            corners(i).into_iter().map(apart).fold(0.0, f32::max)
        };
        (0..patches.len()).map(of).fold(0.0, f32::max)
    }

    #[test]
    fn linear_light_is_read_exactly_up_to_the_rims() {
        let patches = furnace();
        let neighbours = patches.neighbours();
        let exact = |x: Vec3| Rgb::new(5.0, 6.0, 7.0) + x + 0.5 * Vec3::splat(x.y);
        let means: Vec<Rgb> = (0..patches.len()).map(|i| exact(neighbours.middle(i))).collect();
        let light = linear(&neighbours, &means);
        // Rounding of values below 10 over some steps.
        assert!(worst(&patches, &light, exact) < 2e-5);
        let constant: Vec<Linear> = means.iter().map(|v| Linear::constant(*v)).collect();
        assert!(worst(&patches, &constant, exact) > 0.05);
    }

    #[test]
    fn patches_keep_their_means_and_light_stays_positive() {
        let patches = furnace();
        let neighbours = patches.neighbours();
        // Light that changes by any factor from patch to patch.
        let means: Vec<Rgb> =
            (0..patches.len() as u32).map(|i| Rgb::splat((crate::rays::sobol::hash(i, 3) % 1000) as f32)).collect();
        let light = linear(&neighbours, &means);
        for (i, (l, mean)) in light.iter().zip(&means).enumerate() {
            let middle = l.at(neighbours.middle(i));
            assert!((middle - *mean).abs().max_element() < 1e-2);
            for (_, corners) in patches.pieces(i) {
                assert!(corners.iter().all(|&x| l.at(x).min_element() > -1e-2));
            }
        }
    }

    /// Of larger patches that share no more than an edge of one part each, one may be the other's neighbour along an
    /// axis that is orthogonal to the step between their middles.
    #[test]
    fn neighbours_without_a_step_between_have_finite_light() {
        let patches = furnace();
        let neighbours = patches.neighbours();
        let after = |i: usize, axis: usize| neighbours.beside(i, axis)[0];
        // Part p lies below r, and q before s; p weighs all of its larger patch, r of its own.
        let p = (0..neighbours.len()).find(|&p| after(p, 1).is_some()).unwrap();
        let r = after(p, 1).unwrap();
        let is_free = |i: usize| ![p, r].contains(&i);
        let has_free = |q: usize| is_free(q) && after(q, 0).is_some_and(is_free);
        let q = (p + 1..neighbours.len()).find(|&q| has_free(q)).unwrap();
        let mut parents: Vec<u32> = (0..neighbours.len() as u32).collect();
        (parents[q], parents[after(q, 0).unwrap()]) = (p as u32, r as u32);
        let mut areas = vec![1e-30; neighbours.len()];
        (areas[p], areas[r]) = (1.0, 1.0);
        let larger = neighbours.larger(&parents, &areas);
        assert!(larger.beside(p, 0).contains(&Some(r)), "{:?}", larger.beside(p, 0));
        let values: Vec<Rgb> = (0..larger.len()).map(|i| Rgb::splat(1.0 + (i % 7) as f32)).collect();
        let light = linear(&larger, &values);
        for (i, l) in light.iter().enumerate() {
            assert!(l.at(larger.middle(i)).is_finite(), "{i}: {l:?}");
        }
    }

    #[test]
    fn a_step_makes_no_slope_on_either_side() {
        let one = |a: f32, b: f32| limited(Rgb::splat(a), Rgb::splat(b)).x;
        assert_eq!(one(0.0, 3.0), 0.0);
        assert_eq!(one(-1.0, 3.0), 0.0);
        assert_eq!(one(1.0, 2.0), 1.5);
        assert_eq!(one(-1.0, -9.0), -2.0);
    }
}
