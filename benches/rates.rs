//! Rays per second on one thread as JSON, for `against_embree.py`: closest hits, visibility and all crossings.
//!
//! `cargo bench --bench rates -- [--dump DIR] [FILE.obj ...]` measures a room of 38 triangles, a rippled sphere of
//! 2,000, 20,000 and 500,000, and the files. With `--dump` the triangles, rays and segments are written as
//! little-endian f32, so that others may cast the same. Rays are incoherent: each starts at a random point of a random
//! face and leaves by the cosine law.
//!
//! Each slice of [`SLICE`] counts by the best of [`RUNS`] passes: other work on the machine can only slow them down.

mod common;

use std::error::Error;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

use common::{Corners, cornell, end, ray, scene_of, tessellated};
use glam::Vec3;
use halflight::rays::{End, Ray, Rays};
use halflight::scene::Scene;

/// Rays of each kind.
const BATCH: u32 = 100_000;

/// Rays timed at once: few, so that most of the best runs are not interrupted.
const SLICE: usize = 1000;

/// Passes over all slices.
const RUNS: usize = 7;

/// How far dumped rays are lifted off their face: they know no plane to skip.
const LIFT: f32 = 1e-5;

/// Triangles with the rays and segments cast among them.
struct Case {
    name: String,
    scene: Scene,
    triangles: Vec<Corners>,
    rays: Vec<Ray>,
    segments: Vec<(End, End)>,
}

impl Case {
    fn new(name: &str, scene: Scene) -> Case {
        let faces = 0..scene.faces.len() as u32;
        let triangles: Vec<Corners> = faces.map(|face| scene.corners(face)).collect();
        let segment = |i| (end(&triangles, i, 0), end(&triangles, i + BATCH, 4));
        Case {
            name: name.to_owned(),
            rays: (0..BATCH).map(|i| ray(&triangles, i)).collect(),
            segments: (0..BATCH).map(segment).collect(),
            triangles,
            scene,
        }
    }

    /// The best rates, in millions a second.
    fn measured(&self) -> serde_json::Value {
        let start = Instant::now();
        let rays = Rays::new(&self.scene);
        let build = start.elapsed().as_secs_f64();
        let closest = rate(&self.rays, |some| {
            let hits = some.iter().filter_map(|r| rays.closest(r));
            hits.map(|h| h.t).sum::<f32>()
        });
        let visible = rate(&self.segments, |some| {
            let clear = |&&(from, to): &&(End, End)| rays.visible(from, to);
            some.iter().filter(clear).count()
        });
        let mut hits = Vec::new();
        let crossings = rate(&self.rays, |some| {
            let mut count = |r| {
                rays.crossings(r, &mut hits);
                hits.len()
            };
            some.iter().map(&mut count).sum::<usize>()
        });
        serde_json::json!({
            "name": self.name, "triangles": self.triangles.len(), "build": build,
            "closest": closest, "visible": visible, "crossings": crossings,
        })
    }

    /// Writes `NAME.triangles`, `NAME.rays` (origin, direction) and `NAME.segments` (from, to).
    fn dump(&self, folder: &Path) -> std::io::Result<()> {
        let lifted = |ray: &Ray| [ray.origin + LIFT * ray.direction, ray.direction];
        let segment = |&((from, _), (to, _)): &(End, End)| {
            let step = LIFT * (to - from).normalize_or_zero();
            [from + step, to - step]
        };
        let write = |kind: &str, points: Vec<Vec3>| {
            let numbers = points.into_iter().flat_map(|p| p.to_array());
            let bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
            std::fs::write(folder.join(format!("{}.{kind}", self.name)), bytes)
        };
        write("triangles", self.triangles.concat())?;
        write("rays", self.rays.iter().flat_map(lifted).collect())?;
        write("segments", self.segments.iter().flat_map(segment).collect())
    }
}

/// Millions of elements a second: the sum over slices of the best of some runs of each.
fn rate<T, R>(elements: &[T], mut run: impl FnMut(&[T]) -> R) -> f64 {
    let slices = || elements.chunks(SLICE).enumerate();
    let mut best = vec![f64::INFINITY; slices().count()];
    for (k, slice) in (0..RUNS).flat_map(|_| slices()) {
        let start = Instant::now();
        black_box(run(slice));
        best[k] = start.elapsed().as_secs_f64().min(best[k]);
    }
    1e-6 * elements.len() as f64 / best.into_iter().sum::<f64>()
}

fn cases(files: &[PathBuf]) -> Result<Vec<Case>, Box<dyn Error>> {
    let mut cases = vec![Case::new("room", scene_of(&cornell()))];
    for (name, n) in [("2k", 23), ("20k", 71), ("500k", 354)] {
        cases.push(Case::new(name, scene_of(&tessellated(n))));
    }
    for file in files {
        let name = file.file_stem().unwrap_or(file.as_os_str());
        let scene = Scene::open(&file.to_string_lossy())?;
        cases.push(Case::new(&name.to_string_lossy(), scene));
    }
    Ok(cases)
}

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds `--bench`.
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let (mut folder, mut files) = (None, Vec::new());
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--dump" => folder = arguments.next().map(PathBuf::from),
            file => files.push(PathBuf::from(file)),
        }
    }
    let mut found = Vec::new();
    for case in cases(&files)? {
        if let Some(folder) = &folder {
            case.dump(folder)?;
        }
        found.push(case.measured());
    }
    println!("{}", serde_json::to_string_pretty(&found)?);
    Ok(())
}
