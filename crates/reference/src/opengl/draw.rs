//! A scene drawn by fixed-function OpenGL: its triangles with flat normals, lit at their corners, and as many samples a
//! pixel as requested.
//!
//! ```text
//! colour of a corner = emission + sum over lights of
//!                      (Kd max(0, n·l) + Ks (n·h)^Ns [n·l > 0]) I/pi spot / (a0 + a1 d + a2 d²)
//! ```
//!
//! Between the corners colours are linear (Gouraud), so triangles must be small where light varies. OpenGL has few
//! samples a pixel of its own, so pictures are drawn larger, in tiles, and each pixel is the mean of its samples, which
//! stand on a regular grid. All ambient terms are zero; the viewer is local; backs of one-sided materials are black.
//!
//! Not handled: more lights than OpenGL has (8), exponents above 128, skies, textures.

use std::time::Instant;

use glam::{DVec3, Vec3};

use crate::opengl::answer::{NoOpenGl, OpenGlPicture};
use crate::opengl::calls::{Gl, Vertex};
use crate::opengl::constants as gl;
use halflight::light::Rgb;
use halflight::pictures::{Picture, Size};
use halflight::scene::{Beam, Material, PunctualForm, PunctualLight, Scene, Sides};

/// Samples of a tile's side at most.
const TILE: usize = 4096;
/// The largest exponent of highlights and of spots.
const MOST_EXPONENT: f64 = 128.0;

/// Triangles of one material, side by side.
struct Batch {
    material: usize,
    vertices: std::ops::Range<usize>,
}

/// Draws the visible light of a scene as OpenGL has it, with about so many samples a pixel.
///
/// # Errors
/// [`NoOpenGl`] where the machine has no OpenGL, or OpenGL has not what the scene has.
pub fn render(scene: &Scene, size: impl Into<Size>, samples: u32) -> Result<OpenGlPicture, NoOpenGl> {
    let (start, size) = (Instant::now(), size.into());
    let gl = Gl::open().map_err(NoOpenGl::Missing)?;
    check(scene, gl.most_lights())?;
    let across = (f64::from(samples.max(1)).sqrt().round() as usize).clamp(1, TILE);
    let tile = TILE / across;
    let fits = |length: usize| tile.min(length.max(1)) * across;
    let buffer = Size { width: fits(size.width), height: fits(size.height) };
    let floating = gl.draw_on(gl::RGBA32F, buffer);
    if !floating && !gl.draw_on(gl::RGBA8, buffer) {
        return Err(NoOpenGl::Missing("it has nothing to draw on".into()));
    }
    let batches = load(&gl, scene);
    light(&gl, scene);
    let mut picture = Picture::new(size.width, size.height);
    for top in (0..size.height).step_by(tile) {
        for left in (0..size.width).step_by(tile) {
            let view = Tile { left, top, across, buffer };
            gl.matrix(gl::PROJECTION, view.projection(scene, size));
            gl.clear();
            for batch in &batches {
                paint(&gl, &scene.materials[batch.material]);
                gl.draw(batch.vertices.clone());
            }
            view.take(&gl.read(), &mut picture);
        }
    }
    if gl.failed() {
        return Err(NoOpenGl::Missing("a call failed".into()));
    }
    let [renderer, version] = [gl::RENDERER, gl::VERSION].map(|name| gl.string(name));
    Ok(OpenGlPicture { picture, renderer, version, seconds: start.elapsed().as_secs_f64(), floating })
}

/// Refuses what OpenGL has not.
fn check(scene: &Scene, most: usize) -> Result<(), NoOpenGl> {
    let unable = |what: String| Err(NoOpenGl::Unable(what));
    if scene.lights.len() > most {
        return unable(format!("it has {} lights, OpenGL {most}", scene.lights.len()));
    }
    if scene.sky.is_some() {
        return unable("it has a sky".into());
    }
    if scene.is_textured() {
        return unable("it has textures".into());
    }
    let beams = || scene.lights.iter().filter_map(|light| light.form.beam());
    if beams().any(|beam| matches!(beam, Beam::Measured(_))) {
        return unable("a light has a measured intensity (type `ies`)".into());
    }
    let spots = beams().map(|beam| if let Beam::Spot { exponent, .. } = beam { *exponent } else { 0.0 });
    let highlights = scene.materials.iter().filter_map(|m| Some(f64::from(m.gloss?.exponent)));
    match spots.chain(highlights).find(|&exponent| exponent > MOST_EXPONENT) {
        Some(exponent) => unable(format!("an exponent is {exponent}, at most {MOST_EXPONENT}")),
        None => Ok(()),
    }
}

/// Loads all triangles, those of one material together.
fn load(gl: &Gl, scene: &Scene) -> Vec<Batch> {
    let mut faces: Vec<u32> = (0..scene.solid_faces()).collect();
    faces.sort_by_key(|&face| scene.faces[face as usize].material);
    let mut vertices: Vec<Vertex> = Vec::with_capacity(3 * faces.len());
    let mut batches: Vec<Batch> = Vec::new();
    for &face in &faces {
        let corners = scene.corners(face);
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array();
        vertices.extend(corners.map(|corner| [corner.to_array(), normal]));
        let material = scene.faces[face as usize].material as usize;
        match batches.last_mut() {
            Some(last) if last.material == material => last.vertices.end = vertices.len(),
            _ => batches.push(Batch { material, vertices: vertices.len() - 3..vertices.len() }),
        }
    }
    gl.load(&vertices);
    batches
}

/// Puts the camera and the lights where they are.
fn light(gl: &Gl, scene: &Scene) {
    let camera = &scene.camera;
    let [right, up, back] = [camera.right, camera.up, -camera.forward];
    let column = |k: usize| [right[k], up[k], back[k], 0.0];
    let shift = [right, up, back].map(|axis| -axis.dot(camera.position));
    let last = [shift[0], shift[1], shift[2], 1.0];
    let columns = [column(0), column(1), column(2), last];
    gl.matrix(gl::MODELVIEW, std::array::from_fn(|k| columns[k / 4][k % 4]));
    for capability in [gl::DEPTH_TEST, gl::LIGHTING] {
        gl.enable(capability);
    }
    gl.light_model(gl::LIGHT_MODEL_AMBIENT, [0.0, 0.0, 0.0, 1.0]);
    gl.light_model(gl::LIGHT_MODEL_LOCAL_VIEWER, [1.0; 4]);
    gl.light_model(gl::LIGHT_MODEL_TWO_SIDE, [1.0; 4]);
    for (number, light) in scene.lights.iter().enumerate() {
        set(gl, gl::LIGHT0 + number as u32, light);
    }
}

/// One light.
fn set(gl: &Gl, number: u32, light: &PunctualLight) {
    gl.enable(number);
    let colour = rgba(light.intensity / std::f32::consts::PI);
    gl.light(number, gl::AMBIENT, rgba(Rgb::ZERO));
    gl.light(number, gl::DIFFUSE, colour);
    gl.light(number, gl::SPECULAR, colour);
    let one = |value: f64| [value as f32; 4];
    let at = |point: DVec3, w: f32| point.as_vec3().extend(w).to_array();
    let (place, beam) = match &light.form {
        PunctualForm::Directional { direction } => return gl.light(number, gl::POSITION, at(-*direction, 0.0)),
        PunctualForm::Point { place, beam } => (place, beam),
    };
    if let Beam::Spot { direction, exponent, cutoff } = beam {
        gl.light(number, gl::SPOT_DIRECTION, at(*direction, 0.0));
        gl.light(number, gl::SPOT_EXPONENT, one(*exponent));
        // At 180, OpenGL's default, a light is no spot; at 90 it is one of the whole half space.
        gl.light(number, gl::SPOT_CUTOFF, one(cutoff.clamp(0.0, 1.0).acos().to_degrees()));
    }
    gl.light(number, gl::POSITION, at(place.position, 1.0));
    let names = [gl::CONSTANT_ATTENUATION, gl::LINEAR_ATTENUATION, gl::QUADRATIC_ATTENUATION];
    for (name, value) in names.into_iter().zip(place.attenuation) {
        gl.light(number, name, one(value));
    }
}

/// The material of what is drawn next.
fn paint(gl: &Gl, material: &Material) {
    for side in [gl::FRONT, gl::BACK] {
        let sends = side == gl::FRONT || material.sides == Sides::Two;
        let seen = |colour: Rgb| rgba(if sends { colour } else { Rgb::ZERO });
        gl.material(side, gl::AMBIENT, rgba(Rgb::ZERO));
        gl.material(side, gl::DIFFUSE, seen(material.rho));
        gl.material(side, gl::EMISSION, seen(material.emitted().visible));
        gl.material(side, gl::SPECULAR, seen(material.gloss.map_or(Rgb::ZERO, |gloss| gloss.specular)));
        gl.material(side, gl::SHININESS, [material.gloss.map_or(0.0, |gloss| gloss.exponent); 4]);
    }
}

fn rgba(colour: Rgb) -> [f32; 4] {
    colour.extend(1.0).to_array()
}

/// A part of the picture that is drawn at once.
struct Tile {
    /// Its first pixel.
    left: usize,
    top: usize,
    /// Samples along a pixel's side.
    across: usize,
    /// Width and height of what is drawn on, samples.
    buffer: Size,
}

impl Tile {
    /// The frustum through it, as `glFrustum` makes it, column by column.
    fn projection(&self, scene: &Scene, Size { width, height }: Size) -> [f32; 16] {
        let camera = &scene.camera;
        let half = (0.5 * f64::from(camera.vertical_fov).to_radians()).tan();
        let aspect = width as f64 / height as f64;
        let [wide, high] = [self.buffer.width, self.buffer.height].map(|length| length as f64 / self.across as f64);
        let x = |pixel: f64| (2.0 * pixel / width as f64 - 1.0) * half * aspect;
        let y = |pixel: f64| (1.0 - 2.0 * pixel / height as f64) * half;
        let (l, r) = (x(self.left as f64), x(self.left as f64 + wide));
        let (t, b) = (y(self.top as f64), y(self.top as f64 + high));
        let depths = scene.vertices.iter().map(|v: &Vec3| f64::from((*v - camera.position).dot(camera.forward)));
        let (low, most) = depths.fold((f64::INFINITY, 0.0_f64), |(low, high), d| (low.min(d), high.max(d)));
        let near = (0.9 * low).max(1e-3 * most.max(1e-3));
        let far = (1.1 * most).max(2.0 * near);
        let columns = [
            [2.0 / (r - l), 0.0, 0.0, 0.0],
            [0.0, 2.0 / (t - b), 0.0, 0.0],
            [(r + l) / (r - l), (t + b) / (t - b), -(far + near) / (far - near), -1.0],
            [0.0, 0.0, -2.0 * far * near / (far - near), 0.0],
        ];
        std::array::from_fn(|k| columns[k / 4][k % 4] as f32)
    }

    /// Puts the means of the samples into the picture.
    fn take(&self, samples: &[[f32; 3]], picture: &mut Picture) {
        let Size { width: wide, height: high } = self.buffer;
        let share = 1.0 / (self.across * self.across) as f64;
        for y in self.top..(self.top + high / self.across).min(picture.height) {
            for x in self.left..(self.left + wide / self.across).min(picture.width) {
                let mut sum = DVec3::ZERO;
                for row in 0..self.across {
                    // Rows come from below.
                    let from = (high - 1 - ((y - self.top) * self.across + row)) * wide + (x - self.left) * self.across;
                    let own = &samples[from..from + self.across];
                    sum += own.iter().map(|&sample| Vec3::from_array(sample).as_dvec3()).sum::<DVec3>();
                }
                picture.pixels[y * picture.width + x] = (share * sum).as_vec3();
            }
        }
    }
}
