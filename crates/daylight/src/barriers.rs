//! What stands between a point and the sky: the cosine-weighted solid angle of each sky patch that is seen.
//!
//! ```text
//! S_p = integral over directions of patch p of through(x, w) cos dw
//!     = integral over azimuths of [ sum over what is open between two altitudes of  G(t) ]
//! G(t) = n_h/2 (t + sin t cos t) + n_z/2 sin² t        the antiderivative of (n_h cos t + n_z sin t) cos t
//! ```
//!
//! Along a meridian every triangle hides one interval of altitudes, so the integral over altitudes is a closed form,
//! patch by patch. That over azimuths is Gauss's and Kronrod's between the meridians at which patches meet and those
//! of all corners, halved until both agree, so that S is known to the error stated, 1e-6 or so; or the mean over
//! meridians at even distances from a random first one, which has no bias. A sun is the same around another axis.
//!
//! Source: A. S. Kronrod, *Nodes and weights of quadrature formulas*, 1965 (the rule of 3 and 7 points). Not handled:
//! images that cut holes into faces, which count by the mean of their face; surfaces that bend light.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use halflight::Scene;

use crate::division::{Compass, Division};
use crate::sun::DIAMETER;

/// Nodes of Kronrod's rule in 0..1, with its weights and Gauss's.
const RULE: [(f64, f64, f64); 4] = [
    (0.0, 0.450_916_538_658_474_14, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 0.268_488_089_868_333_44, 5.0 / 9.0),
    (0.434_243_749_346_802_55, 0.401_397_414_775_962_2, 0.0),
    (0.960_491_268_708_020_3, 0.104_656_226_026_467_27, 0.0),
];
/// Error of an integral over all azimuths that is allowed to a row of patches, as a share of pi.
const EXACT: f64 = 1e-6;
/// Times that an interval of azimuths is halved at most.
const HALVINGS: usize = 24;
/// Of more triangles than these no list by azimuth is spared.
const FEW: usize = 48;
/// Altitudes between things that are no wider are rounding, radians.
const SLIT: f64 = 1e-12;
/// Azimuths by which triangles are listed.
const LISTS: usize = 96;
/// More corners than these are no ends of intervals: halving finds them.
const CORNERS: usize = 4096;

/// A triangle that hides what is behind it, east, north and up of its corners in unit coordinates.
#[derive(Clone, Copy, Debug)]
struct Barrier {
    corners: [DVec3; 3],
    /// The share of light that passes.
    through: f64,
}

/// All that may stand before the sky.
pub(crate) struct Barriers {
    compass: Compass,
    division: Division,
    all: Vec<Barrier>,
    /// Lower ends of the ground, of each row, and the upper one of the last.
    ends: Vec<f64>,
    /// The first column of the ground and of each row, and their patches.
    firsts: Vec<(usize, usize)>,
    meridians: Vec<f64>,
}

/// Where sky is looked at from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Unit coordinates.
    pub position: DVec3,
    /// Unit vector.
    pub normal: DVec3,
}

/// An interval of altitudes, and the share of light that passes there.
type Hidden = (f64, f64, f64);

/// What a point sees, ready for meridians.
struct Around {
    normal: DVec3,
    near: Vec<Barrier>,
    /// The triangles that each azimuth may meet; none where all are tried.
    lists: Option<Vec<Vec<u32>>>,
}

/// Memory for one meridian after the other.
#[derive(Default)]
struct Scratch {
    hidden: Vec<Hidden>,
    ends: Vec<f64>,
}

impl Barriers {
    /// The faces of a scene, with tau of its materials.
    pub fn new(scene: &Scene, tau: &[f32], compass: Compass, division: Division) -> Barriers {
        let barrier = |face: u32| {
            let own = f64::from(tau[scene.faces[face as usize].material as usize]);
            let there = if scene.material(face).is_masked() { scene.means_of_face(face).coverage } else { 1.0 };
            let corners = scene.exact_corners(face).map(|corner| compass.of(corner));
            Barrier { corners, through: 1.0 - there * (1.0 - own) }
        };
        let all = (0..scene.solid_faces()).map(barrier).filter(|own| own.through < 1.0).collect();
        let rows = 0..division.rows();
        let ends = std::iter::once(-FRAC_PI_2).chain((0..=division.rows()).map(|row| division.altitude(row)));
        let firsts = std::iter::once((0, 1)).chain(rows.map(|row| (division.first(row), division.in_row(row))));
        Barriers {
            compass,
            division,
            all,
            ends: ends.collect(),
            firsts: firsts.collect(),
            meridians: division.meridians(),
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// S of every column to the error of the quadrature, which comes with each.
    pub fn exact(&self, place: &Place) -> (Vec<f64>, Vec<f64>) {
        let around = self.around(place, self.compass);
        let ends = self.intervals(&around);
        let mut found = Exact::new(self.division.columns(), self.ends.len() - 1);
        for pair in ends.windows(2) {
            found.interval(
                (pair[0], pair[1]),
                HALVINGS,
                &mut |azimuth, scratch, out| {
                    self.meridian(&around, azimuth, (-FRAC_PI_2, FRAC_PI_2), scratch, out);
                },
                |azimuth, row| self.column(row, azimuth),
            );
        }
        (found.sums, found.errors)
    }

    /// An estimate of S without bias: the mean over so many meridians at even distances, the first of them at a share
    /// of that distance.
    pub fn sampled(&self, place: &Place, (meridians, first): (usize, f64), scale: f64, out: &mut [f32]) {
        let around = self.around(place, self.compass);
        let (mut scratch, mut rows) = (Scratch::default(), vec![0.0; self.ends.len() - 1]);
        let step = TAU / meridians as f64;
        for k in 0..meridians {
            let azimuth = (k as f64 + first) * step;
            if !self.meridian(&around, azimuth, (-FRAC_PI_2, FRAC_PI_2), &mut scratch, &mut rows) {
                continue;
            }
            for (row, value) in rows.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                out[self.column(row, azimuth)] += (scale * step * value) as f32;
            }
        }
    }

    /// Irradiance by a sun of unit irradiance on a plane that faces it: the mean of `through cos` over its disc, and
    /// the error of the quadrature. `towards` is east, north and up of the direction to its middle.
    pub fn sun(&self, place: &Place, towards: DVec3) -> (f64, f64) {
        let radius = 0.5 * DIAMETER;
        let side = towards.any_orthonormal_vector();
        let frame = Compass { east: towards.cross(side), north: towards, up: side };
        let normal = frame.of(self.compass.of(place.normal));
        if normal.y < -radius.sin() {
            return (0.0, 0.0);
        }
        let at = self.compass.of(place.position);
        let local = |own: &Barrier| Barrier { corners: own.corners.map(|corner| frame.of(corner - at)), ..*own };
        let near: Vec<Barrier> = self.all.iter().map(local).filter(|own| own.may_hide(radius.tan())).collect();
        let around = Around { normal, near, lists: None };
        if around.near.iter().any(|own| own.through == 0.0 && own.covers(radius)) {
            return (0.0, 0.0);
        }
        let (mut found, disc) = (Exact::new(1, 1), TAU * (1.0 - radius.cos()));
        // The width of the disc at an azimuth ends like a root: azimuths are radius sin u.
        let mut ends = vec![-FRAC_PI_2, FRAC_PI_2];
        let corners = around.near.iter().flat_map(|own| own.corners).filter(|corner| corner.y > 0.0);
        ends.extend(corners.map(|corner| (corner.x.atan2(corner.y) / radius).clamp(-1.0, 1.0).asin()));
        ends.sort_by(f64::total_cmp);
        for pair in ends.windows(2).filter(|pair| pair[1] > pair[0]) {
            found.interval(
                (pair[0], pair[1]),
                HALVINGS,
                &mut |u, scratch, out| {
                    let azimuth = radius * u.sin();
                    let height = (radius.cos() / azimuth.cos()).min(1.0).acos();
                    out[0] = within(&around, azimuth, (-height, height), scratch) * radius * u.cos() / disc;
                },
                |_, _| 0,
            );
        }
        (found.sums[0], found.errors[0])
    }

    fn around(&self, place: &Place, compass: Compass) -> Around {
        let at = compass.of(place.position);
        let normal = compass.of(place.normal);
        let local = |own: &Barrier| Barrier { corners: own.corners.map(|corner| corner - at), ..*own };
        // What lies behind the plane of the place hides nothing that it faces.
        let is_before = |own: &Barrier| own.corners.iter().any(|corner| corner.dot(normal) > 0.0);
        let near: Vec<Barrier> = self.all.iter().map(local).filter(is_before).collect();
        let lists = (near.len() > FEW).then(|| lists(&near));
        Around { normal, near, lists }
    }

    /// The ends of the intervals of azimuth between which S is smooth but for edges that cross.
    fn intervals(&self, around: &Around) -> Vec<f64> {
        let mut ends = self.meridians.clone();
        ends.extend([0.0, TAU]);
        // Where the plane of the place meets the horizon.
        let level = around.normal.x.atan2(around.normal.y);
        ends.extend([level + FRAC_PI_2, level - FRAC_PI_2].map(|azimuth| azimuth.rem_euclid(TAU)));
        if 3 * around.near.len() <= CORNERS {
            let corners = around.near.iter().flat_map(|own| own.corners);
            ends.extend(corners.map(|corner| corner.x.atan2(corner.y).rem_euclid(TAU)));
        }
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        ends
    }

    fn column(&self, row: usize, azimuth: f64) -> usize {
        let (first, many) = self.firsts[row];
        let patch = (azimuth / TAU * many as f64 + 0.5).floor().rem_euclid(many as f64) as usize;
        first + patch.min(many - 1)
    }

    /// The integrals over the altitudes of the ground and of each row along a meridian; false where all is hidden.
    fn meridian(
        &self,
        around: &Around,
        azimuth: f64,
        domain: (f64, f64),
        scratch: &mut Scratch,
        rows: &mut [f64],
    ) -> bool {
        rows.fill(0.0);
        let (sin, cos) = azimuth.sin_cos();
        let level = around.normal.x * sin + around.normal.y * cos;
        let Some(domain) = facing(level, around.normal.z, domain) else { return false };
        around.hide(azimuth, (sin, cos), domain, &mut scratch.hidden);
        let antiderivative = |t: f64| antiderivative((level, around.normal.z), t);
        let mut any = false;
        open(domain, scratch, |low, high, share| {
            let mut row = self.ends.partition_point(|end| *end <= low).saturating_sub(1).min(rows.len() - 1);
            let (mut from, mut before) = (low, antiderivative(low));
            while from < high {
                let to = if row + 1 < rows.len() { self.ends[row + 1].min(high) } else { high };
                let after = antiderivative(to);
                rows[row] += share * (after - before);
                (from, before, row) = (to, after, row + 1);
            }
            any = true;
        });
        any
    }
}

/// The integral over an interval of altitudes along a meridian.
fn within(around: &Around, azimuth: f64, domain: (f64, f64), scratch: &mut Scratch) -> f64 {
    let (sin, cos) = azimuth.sin_cos();
    let level = around.normal.x * sin + around.normal.y * cos;
    let Some(domain) = facing(level, around.normal.z, domain) else { return 0.0 };
    around.hide(azimuth, (sin, cos), domain, &mut scratch.hidden);
    let antiderivative = |t: f64| antiderivative((level, around.normal.z), t);
    let mut sum = 0.0;
    open(domain, scratch, |low, high, share| sum += share * (antiderivative(high) - antiderivative(low)));
    sum
}

/// The integral of `(n_h cos t + n_z sin t) cos t` up to t.
fn antiderivative((level, upward): (f64, f64), t: f64) -> f64 {
    let (sin, cos) = t.sin_cos();
    0.5 * level * (t + sin * cos) + 0.5 * upward * sin * sin
}

/// The part of an interval of altitudes that lies before a plane whose normal has these parts along a meridian.
fn facing(level: f64, upward: f64, (low, high): (f64, f64)) -> Option<(f64, f64)> {
    let middle = upward.atan2(level);
    let own = ((middle - FRAC_PI_2).max(low), (middle + FRAC_PI_2).min(high));
    (own.0 < own.1 && (level != 0.0 || upward != 0.0)).then_some(own)
}

/// Lists of triangles by azimuth.
fn lists(near: &[Barrier]) -> Vec<Vec<u32>> {
    let mut lists = vec![Vec::new(); LISTS];
    let list = |azimuth: f64| (azimuth / TAU * LISTS as f64).floor() as i64;
    for (k, barrier) in near.iter().enumerate() {
        let [a, b, c] = barrier.corners.map(|corner| corner.x.atan2(corner.y));
        let turn = |to: f64| (to - a + PI).rem_euclid(TAU) - PI;
        let (low, high) = ([0.0, turn(b), turn(c)].into_iter())
            .fold((0.0, 0.0), |(low, high): (f64, f64), d| (low.min(d), high.max(d)));
        // One that has the zenith or the nadir in it may be met at any azimuth.
        let range =
            if high - low >= PI - 1e-6 { 0..=LISTS as i64 - 1 } else { list(a + low - 1e-9)..=list(a + high + 1e-9) };
        range.for_each(|list| lists[list.rem_euclid(LISTS as i64) as usize].push(k as u32));
    }
    lists
}

impl Around {
    /// What is hidden of an interval of altitudes along a meridian.
    fn hide(&self, azimuth: f64, towards: (f64, f64), domain: (f64, f64), hidden: &mut Vec<Hidden>) {
        hidden.clear();
        let mut meet = |own: &Barrier| {
            let Some((low, high)) = own.altitudes(towards) else { return };
            let (low, high) = (low.max(domain.0), high.min(domain.1));
            if low < high {
                hidden.push((low, high, own.through));
            }
        };
        match &self.lists {
            None => self.near.iter().for_each(meet),
            Some(lists) => {
                let list = (azimuth / TAU * LISTS as f64).floor().rem_euclid(LISTS as f64) as usize;
                lists[list.min(LISTS - 1)].iter().for_each(|&k| meet(&self.near[k as usize]));
            }
        }
    }
}

impl Barrier {
    /// Whether it may reach into a cone around y of a half width at unit distance.
    fn may_hide(&self, wide: f64) -> bool {
        let corners = &self.corners;
        if corners.iter().any(|c| c.y < 0.0) {
            return corners.iter().any(|c| c.y > 0.0);
        }
        let all = |beyond: fn(&DVec3, f64) -> bool| corners.iter().all(|c| beyond(c, wide * c.y));
        !(all(|c, w| c.x > w) || all(|c, w| c.x < -w) || all(|c, w| c.z > w) || all(|c, w| c.z < -w))
    }

    /// Whether it covers all of a cone around y of a half angle: that lies within the planes through its edges.
    fn covers(&self, radius: f64) -> bool {
        let [a, b, c] = self.corners;
        let sides = [a.cross(b), b.cross(c), c.cross(a)].map(|m| m.y / m.length());
        a.dot(b.cross(c)) * sides[0] > 0.0 && sides.iter().all(|own| own.abs() > radius.sin() && own * sides[0] > 0.0)
    }

    /// The altitudes that it hides along a meridian, the sine and cosine of whose azimuth these are.
    #[inline]
    fn altitudes(&self, (sin, cos): (f64, f64)) -> Option<(f64, f64)> {
        let across = self.corners.map(|corner| corner.x * cos - corner.y * sin);
        let is_right = across.map(|own| own >= 0.0);
        if is_right[0] == is_right[1] && is_right[1] == is_right[2] {
            return None;
        }
        let along = |k: usize| self.corners[k].x * sin + self.corners[k].y * cos;
        let mut ends = [(0.0, 0.0); 2];
        let mut count = 0;
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            if is_right[a] != is_right[b] && count < 2 {
                let share = across[a] / (across[a] - across[b]);
                let (from, to) = (along(a), along(b));
                let (low, high) = (self.corners[a].z, self.corners[b].z);
                ends[count] = (from + share * (to - from), low + share * (high - low));
                count += 1;
            }
        }
        let [(mut r, mut z), (mut s, mut y)] = ends;
        if r <= 0.0 && s <= 0.0 {
            return None;
        }
        // The part behind the vertical through the point belongs to the meridian on the other side.
        let crossing = || z + (y - z) * (r / (r - s));
        if r < 0.0 {
            (z, r) = (crossing(), 0.0);
        } else if s < 0.0 {
            (y, s) = (crossing(), 0.0);
        }
        let (first, second) = (z.atan2(r), y.atan2(s));
        Some((first.min(second), first.max(second)))
    }
}

/// Calls `each` with what is open of an interval, and the share of light that passes.
fn open((low, high): (f64, f64), scratch: &mut Scratch, mut each: impl FnMut(f64, f64, f64)) {
    let Scratch { hidden, ends } = scratch;
    if hidden.iter().all(|own| own.2 == 0.0) {
        hidden.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut from = low;
        for &(start, end, _) in hidden.iter() {
            if start > from + SLIT {
                each(from, start, 1.0);
            }
            from = from.max(end);
        }
        if from + SLIT < high {
            each(from, high, 1.0);
        }
        return;
    }
    ends.clear();
    ends.extend([low, high].into_iter().chain(hidden.iter().flat_map(|own| [own.0, own.1])));
    ends.sort_unstable_by(f64::total_cmp);
    for pair in ends.windows(2).filter(|pair| pair[1] > pair[0] + SLIT) {
        let middle = 0.5 * (pair[0] + pair[1]);
        let over = hidden.iter().filter(|own| own.0 < middle && middle < own.1);
        let share: f64 = over.map(|own| own.2).product();
        if share > 0.0 {
            each(pair[0], pair[1], share);
        }
    }
}

/// Integrals over azimuths, with their errors.
struct Exact {
    sums: Vec<f64>,
    errors: Vec<f64>,
    rows: Vec<f64>,
    scratch: Scratch,
}

impl Exact {
    fn new(columns: usize, rows: usize) -> Exact {
        Exact {
            sums: vec![0.0; columns],
            errors: vec![0.0; columns],
            rows: vec![0.0; rows],
            scratch: Scratch::default(),
        }
    }

    /// Adds an interval, halved until Gauss's rule and Kronrod's agree; each row's part to the column that has it.
    fn interval(
        &mut self,
        (low, high): (f64, f64),
        halvings: usize,
        meridian: &mut impl FnMut(f64, &mut Scratch, &mut [f64]),
        column: impl Fn(f64, usize) -> usize + Copy,
    ) {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let mut both = vec![[0.0; 2]; self.rows.len()];
        for (node, kronrod, gauss) in RULE {
            for side in if node == 0.0 { &[0.0][..] } else { &[-1.0, 1.0] } {
                meridian(middle + side * half * node, &mut self.scratch, &mut self.rows);
                for (both, value) in both.iter_mut().zip(&self.rows) {
                    both[0] += half * kronrod * value;
                    both[1] += half * gauss * value;
                }
            }
        }
        let apart = both.iter().map(|[kronrod, gauss]| (kronrod - gauss).abs());
        if halvings > 0 && apart.fold(0.0, f64::max) > EXACT * half {
            self.interval((low, middle), halvings - 1, meridian, column);
            self.interval((middle, high), halvings - 1, meridian, column);
            return;
        }
        for (row, [kronrod, gauss]) in both.into_iter().enumerate() {
            let column = column(middle, row);
            self.sums[column] += kronrod;
            self.errors[column] += (kronrod - gauss).abs();
        }
    }
}
