//! Where references come from: the path tracer, a tightly solved patch picture, or the user's files.
//!
//! None is made by the method that it judges, nor with the ladders' sample points. Those that are made are kept on disk
//! and found again by a hash of everything the picture depends on: the scene's faces, materials and camera, the modes'
//! numbers, the picture's size, and this program's version. Each is three EXR files (picture, standard error, mask) and
//! a JSON file with the key and how it was made, written last. One that does not fit (another key, a file missing or
//! broken, less time than is now allowed) is made anew.
//!
//! Not handled: filters other than the box in a picture that the user brings.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;
use std::{fmt, fs};

use serde::{Deserialize, Serialize};

use crate::compare::ladder::{StudyError, StudyPlan, lap};
use crate::compare::truth::{Made, Truth, or_everywhere};
use halflight::Solver;
use halflight::light::Transport;
use halflight::pictures::{
    Exposure, ImageError, Picture, Size, make_directory, read_picture, relative_rms, write_picture, write_whole,
};
use halflight::rays::Rays;
use halflight::rays::purpose::Purpose;
use halflight::render::Rendered;
use halflight::scene::Scene;
use halflight_reference::{NextEvent, TraceSettings, Tracer};

/// Samples of the path tracer between two looks at the clock.
const PASS: u32 = 16;
/// The path tracer stops here in any case: finer than any tolerance charted.
const NOISE: f64 = 2e-4;
/// Tolerances of the patch picture, one after the other while time allows; each takes some three times the last.
const TIGHTER: [f64; 5] = [0.01, 0.005, 0.002, 0.001, 0.0005];
/// Camera rays a pixel that look for luminaires where the user brings a reference.
const LOOKS: u32 = 256;

/// Where references come from.
#[derive(Clone, Debug)]
pub enum Source {
    /// The answers of the compared methods, each for those of the other kind.
    Answers,
    /// They are kept in this folder, and made where they are not there.
    Store(PathBuf),
    /// The user brings one for all methods.
    Files {
        /// The picture, `.exr`, `.hdr` or `.png`.
        picture: PathBuf,
        /// Its standard error.
        error: Option<PathBuf>,
    },
}

/// The picture to a tolerance, from scratch.
pub(crate) fn within(scene: &Scene, plan: &StudyPlan, tolerance: f64, seed: u32) -> Result<Rendered, StudyError> {
    let solver = Solver::new(scene).seed(seed).memory(plan.memory);
    Ok(solver.render(plan.transport, plan.size).tolerance(tolerance)?)
}

/// The references for patch methods and for the path tracer: from the store, or made and put there. Where no path
/// tracer is to be judged both are the first.
///
/// # Errors
/// A series that diverges, a store that cannot be written.
pub(crate) fn made(
    scene: &Scene,
    plan: &StudyPlan,
    store: &Path,
    judges_paths: bool,
) -> Result<Vec<Truth>, StudyError> {
    let paths = Kept::new(store, scene, plan, "paths");
    let traced = match paths.read() {
        Some(truth) => truth,
        None => paths.write(traced(scene, plan))?,
    };
    if !judges_paths {
        return Ok(vec![traced.clone(), traced]);
    }
    let patches = Kept::new(store, scene, plan, "patches");
    let mut solved = match patches.read() {
        Some(truth) => truth,
        None => patches.write(solved(scene, plan)?)?,
    };
    // Thousands of samples know best which pixels see a luminaire.
    solved.mask = traced.mask.clone();
    Ok(vec![traced, solved])
}

/// The path tracer, until the time is over.
fn traced(scene: &Scene, plan: &StudyPlan) -> Truth {
    plan.watch.begin("reference, paths", plan.seconds.ceil() as u64);
    let mut clock = Instant::now();
    let rays = Rays::new(scene);
    let seed = Purpose::TracedReference.seed(plan.seed);
    let settings = TraceSettings { seed, ..TraceSettings::default() };
    let mut tracer = Tracer::new(scene, &rays, &scene.transports(plan.transport), plan.size, &settings);
    let (ready, mut ticked) = (lap(&mut clock), 0);
    let seconds = tracer.sample_within(PASS, u32::MAX, plan.seconds - ready, |tracer, now| {
        plan.watch.tick(now as u64 - ticked);
        ticked = now as u64;
        tracer.relative_error().is_none_or(|e| e >= NOISE)
    });
    let made = Made {
        by: "path tracing, next event".into(),
        effort: format!("{} samples a pixel", tracer.samples()),
        seconds: ready + seconds,
        error: tracer.relative_error(),
    };
    let picture = tracer.picture();
    let noise = tracer.standard_error().unwrap_or_else(|| picture.scaled(0.0));
    Truth::new(picture, noise, or_everywhere(tracer.mask()), made)
}

/// The patch picture, tighter and tighter until the time would be over; every pixel counts.
fn solved(scene: &Scene, plan: &StudyPlan) -> Result<Truth, StudyError> {
    plan.watch.begin("reference, patches", TIGHTER.len() as u64);
    let seed = Purpose::SolvedReference.seed(plan.seed);
    let mut clock = Instant::now();
    let mut best = None;
    let mut last = 0.0;
    for tolerance in TIGHTER {
        if 3.0 * last > plan.seconds {
            break;
        }
        let found = within(scene, plan, tolerance, seed)?;
        last = lap(&mut clock);
        plan.watch.tick(1);
        best = Some((tolerance, found, last));
    }
    let (tolerance, found, seconds) = best.expect("the first is always made");
    let made = Made {
        by: "Neumann over patches".into(),
        effort: format!("tolerance {} %", 100.0 * tolerance),
        seconds,
        error: Some(found.error.total),
    };
    let mask = or_everywhere(found.picture.scaled(0.0));
    Ok(Truth::new(found.picture, found.standard_error, mask, made))
}

/// A reference from the user's files.
///
/// # Errors
/// Files that cannot be read, sizes that differ, a black picture; before the ladders are climbed.
pub(crate) fn brought(scene: &Scene, plan: &StudyPlan, path: &Path, error: Option<&Path>) -> Result<Truth, StudyError> {
    let picture = read_picture(path)?;
    let noise = error.map(read_picture).transpose()?;
    let mask = or_everywhere(luminaires_unseen(scene, plan));
    let known = noise.is_some();
    let noise = noise.unwrap_or_else(|| picture.scaled(0.0));
    relative_rms(&mask.scaled(0.0), &picture, Some(&mask), Some(&noise))?;
    let own = relative_rms(&noise.plus(&picture).unwrap_or_else(|| picture.clone()), &picture, Some(&mask), None)?;
    let made = Made {
        by: path.display().to_string(),
        effort: "brought by the user".into(),
        seconds: 0.0,
        error: known.then_some(own),
    };
    let files = [Some(path), error].into_iter().flatten().map(Path::to_path_buf).collect();
    Ok(Truth { kept: true, files, ..Truth::new(picture, noise, mask, made) })
}

/// 1 in pixels none of whose camera rays meets a luminaire.
fn luminaires_unseen(scene: &Scene, plan: &StudyPlan) -> Picture {
    let rays = Rays::new(scene);
    let settings = TraceSettings { next_event: NextEvent::Off, max_bounces: 0, seed: plan.seed };
    let mut tracer = Tracer::new(scene, &rays, &scene.transports(plan.transport), plan.size, &settings);
    tracer.pass(LOOKS);
    tracer.mask()
}

/// FNV-1a with 128 bits (Fowler, Noll, Vo) over what is written into it: it finds changes, and is no defence against
/// forgery.
struct Hash(u128);

impl fmt::Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
        for byte in text.bytes() {
            self.0 = (self.0 ^ u128::from(byte)).wrapping_mul(PRIME);
        }
        Ok(())
    }
}

/// What a reference shows, as 32 hexadecimal digits: a scene in one mode at one size.
fn key(scene: &Scene, transport: Transport, Size { width, height }: Size) -> String {
    let mut hash = Hash(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);
    let (version, transports) = (env!("CARGO_PKG_VERSION"), scene.transports(transport));
    // The shortest decimal form of a float distinguishes it from any other. Writing into the hash cannot fail.
    let _ = write!(hash, "{version}({width}, {height}){transports:?}");
    let _ = write!(hash, "{:?}{:?}", scene.camera, scene.frame);
    let _ = write!(hash, "{:?}{:?}{:?}", scene.materials, scene.faces, scene.vertices);
    if scene.is_textured() {
        let _ = write!(hash, "{:?}{:?}", scene.coordinates, scene.colours);
    }
    format!("{:032x}", hash.0)
}

/// What stands next to the pictures of a kept reference.
#[derive(Serialize, Deserialize)]
struct Label {
    key: String,
    /// Seconds it was allowed.
    time: f64,
    made: Made,
}

/// The place of one kept reference.
struct Kept {
    /// Its files' path without endings.
    stem: String,
    folder: PathBuf,
    key: String,
    /// Seconds it is allowed now.
    time: f64,
}

impl Kept {
    /// In `folder`, named for a reader after the scene, the mode and the method, and by the start of the key.
    fn new(folder: &Path, scene: &Scene, plan: &StudyPlan, by: &str) -> Kept {
        let key = key(scene, plan.transport, plan.size);
        let mode = plan.transport.file_name();
        let stem = format!("{}-{mode}-{by}-{}", scene.name, &key[..12]);
        Kept { folder: folder.to_path_buf(), stem, key, time: plan.seconds }
    }

    fn path(&self, end: &str) -> PathBuf {
        self.folder.join(format!("{}{end}", self.stem))
    }

    /// The three pictures' files.
    fn files(&self) -> [PathBuf; 3] {
        [".exr", "-se.exr", "-mask.exr"].map(|end| self.path(end))
    }

    /// The reference, where it is whole, shows what the key says, and had at least so much time.
    fn read(&self) -> Option<Truth> {
        let label: Label = serde_json::from_str(&fs::read_to_string(self.path(".json")).ok()?).ok()?;
        if label.key != self.key || label.time < self.time {
            return None;
        }
        let [picture, noise, mask] = self.files().map(|path| read_picture(path).ok());
        let truth = Truth::new(picture?, noise?, mask?, label.made);
        let fits = |p: &Picture| p.size() == truth.picture.size() && p.pixels.iter().all(|colour| colour.is_finite());
        let whole = truth.pictures().into_iter().all(fits);
        whole.then(|| Truth { kept: true, files: self.files().to_vec(), ..truth })
    }

    /// Puts a reference there, its label last, and gives it back with its files.
    fn write(&self, truth: Truth) -> Result<Truth, ImageError> {
        make_directory(&self.folder)?;
        for (path, picture) in self.files().iter().zip(truth.pictures()) {
            write_picture(path, picture, Exposure::default())?;
        }
        let label = Label { key: self.key.clone(), time: self.time, made: truth.made.clone() };
        let text = serde_json::to_string_pretty(&label).expect("labels have string keys");
        write_whole(self.path(".json"), text.as_bytes())?;
        Ok(Truth { files: self.files().to_vec(), ..truth })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::light::Mode;

    #[test]
    fn the_key_depends_on_all_that_the_picture_does() {
        let size = Size { width: 2, height: 2 };
        let (scene, global) = (Scene::open("cornell-box").unwrap(), Mode::Global.transport());
        let own = key(&scene, global, size);
        assert_eq!(own, key(&Scene::open("cornell-box").unwrap(), global, size));
        let changes: [fn(&mut Scene); 4] = [
            |s| s.materials[0].rho.x += 1e-7,
            |s| s.vertices[3].y = s.vertices[3].y.next_up(),
            |s| s.camera.vertical_fov += 0.001,
            |s| s.faces.swap(0, 1),
        ];
        for change in changes {
            let mut other = scene.clone();
            change(&mut other);
            assert_ne!(own, key(&other, global, size));
        }
        assert_ne!(own, key(&scene, Mode::Local.transport(), size));
        assert_ne!(own, key(&scene, global, Size { height: 3, ..size }));
    }
}
