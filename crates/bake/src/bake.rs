//! Maps of irradiance: a picture of surfaces laid out flat, to the same error by the same means.
//!
//! ```text
//! map = pi * picture of white surfaces,   W/m²        direct and reflected light, or reflected light alone
//! ```
//!
//! The error of a map is the estimated RMS error over its texels relative to their RMS, as that of a picture is over
//! its pixels. With the light of each luminaire apart every lamp has a map and an error of its own, and the maps times
//! factors add up to the map of the dimmed scene.
//!
//! Not handled: reflected light alone of each luminaire; surfaces that reflect nothing, whose maps are black.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use halflight::light::Transport;
use halflight::pictures::Picture;
use halflight::render::{Apart, ErrorParts, LayerKind, Rendered, Unmet, Watch};
use halflight::{Scene, Solver};

use crate::dilation::{Coverage, dilated};
use crate::error::BakeError;
use crate::layout::Layout;
use crate::parts::Part;
use crate::texels::{LaidTriangle, TexelMap};
use crate::visible::Sight;

/// Which light a map holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Held {
    /// All of it.
    #[default]
    All,
    /// What was reflected at least once: for viewers that add the lamps' own.
    Reflected,
}

/// Whether all luminaires share one map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lamps {
    /// They do.
    #[default]
    Together,
    /// Each has a map of its own as well.
    Apart,
}

/// What is asked of a bake.
pub struct BakeGoal<'a> {
    /// (alpha, tau) of materials without their own.
    pub transport: Transport,
    /// Relative RMS error.
    pub tolerance: f64,
    /// Which light.
    pub held: Held,
    /// Of which luminaires.
    pub lamps: Lamps,
    /// Texels to a side.
    pub texels: usize,
    /// Texels around every chart.
    pub padding: usize,
    /// Chooses the sample points.
    pub seed: u32,
    /// Bytes that K may take.
    pub memory: f64,
    /// Who is told of the work.
    pub watch: &'a dyn Watch,
}

/// One map.
#[derive(Clone, Debug)]
pub struct LightMap {
    /// The luminaire whose light it holds; none of that of all.
    pub lamp: Option<String>,
    /// Irradiance, W/m²; texels that show nothing have that of their neighbours.
    pub irradiance: Picture,
    /// Standard error of the irradiance of each texel by the rays that gather, W/m²; 0 where texels show nothing.
    pub standard_error: Picture,
    /// RMS irradiance over the texels that show something, channels and texels alike, W/m².
    pub rms: f64,
    /// Estimated RMS error relative to that, all causes together.
    pub error: f64,
}

/// Maps of a scene.
pub struct Bake {
    /// Where its parts lie.
    pub layout: Layout,
    /// That of all light, then those of the luminaires.
    pub maps: Vec<LightMap>,
    /// What texels show.
    pub coverage: Coverage,
    /// Estimated errors of all light together, by their causes.
    pub error: ErrorParts,
    /// Why that is above the tolerance; none where it is not.
    pub unmet: Option<Unmet>,
    /// Patches at last.
    pub patches: usize,
    /// Rays in all.
    pub rays: u64,
    /// Seconds of the solution and the gather pass.
    pub seconds: f64,
}

/// The parts of a scene laid out, and what every texel shows.
pub struct LaidOut {
    /// Where the parts lie.
    pub layout: Layout,
    map: Arc<TexelMap>,
}

impl LaidOut {
    /// Lays the parts of a scene out in a map.
    ///
    /// # Errors
    /// [`BakeError`] where charts overlap, leave their square or do not fit.
    pub fn new(solver: &Solver, parts: &[Part], goal: &BakeGoal) -> Result<LaidOut, BakeError> {
        let layout = Layout::new(parts, goal.texels, goal.padding)?;
        let geometry = solver.geometry();
        let (scene, sight) = (&geometry.scene, Sight { scene: &geometry.scene, rays: &geometry.rays });
        let mut laid = Vec::new();
        for (part, places) in parts.iter().zip(&layout.places) {
            for (triangle, places) in part.triangles.iter().zip(places) {
                let corners = triangle.corners.map(|corner| scene.frame.to_unit(corner));
                laid.extend(LaidTriangle::new(*places, corners, sight.shown_side(corners)));
            }
        }
        let map = sight.clear(TexelMap::new(goal.texels, laid));
        Ok(LaidOut { layout, map: Arc::new(map) })
    }

    /// Where the middle of each texel that shows something lies, with the normal of the side, the file's units; of a
    /// texel that a border crosses the middle of what it shows.
    pub fn middles(&self, scene: &Scene) -> Vec<Option<(DVec3, DVec3)>> {
        let of = |texel: usize| {
            let (point, _) = self.map.middle(texel)?;
            Some((scene.frame.to_file(point.position.as_dvec3()), point.normal.as_dvec3()))
        };
        (0..self.map.texels * self.map.texels).map(of).collect()
    }

    /// The light of the scene in these maps.
    ///
    /// # Errors
    /// [`BakeError::Render`] where the series is not proved to converge, or K does not fit in memory.
    pub fn bake(self, solver: Solver, goal: &BakeGoal) -> Result<Bake, BakeError> {
        let apart = Apart { emitters: goal.lamps == Lamps::Apart, bounces: goal.held == Held::Reflected };
        let solver = solver.apart(apart).laid_out(self.map.clone());
        let found =
            solver.render(goal.transport, (goal.texels, goal.texels)).watch(goal.watch).tolerance(goal.tolerance)?;
        let coverage = Coverage::new((0..goal.texels * goal.texels).map(|texel| self.map.coverage(texel)));
        let maps = maps(&found, goal.held, &coverage);
        Ok(Bake {
            layout: self.layout,
            maps,
            coverage,
            error: found.error,
            unmet: found.unmet(goal.tolerance),
            patches: found.patches,
            rays: found.rays,
            seconds: found.seconds.total,
        })
    }
}

/// Bakes the light of a scene onto its parts.
///
/// # Errors
/// [`BakeError`] where charts overlap, leave their square or do not fit, and where there is no solution.
pub fn bake(scene: &Scene, parts: &[Part], goal: &BakeGoal) -> Result<Bake, BakeError> {
    let solver = Solver::new(scene).seed(goal.seed).memory(goal.memory);
    LaidOut::new(&solver, parts, goal)?.bake(solver, goal)
}

/// The maps of a picture of what was laid out.
fn maps(found: &Rendered, held: Held, coverage: &Coverage) -> Vec<LightMap> {
    let whole = found.error.total * coverage.rms(&found.picture);
    let once = LayerKind::Bounce(1);
    let light = match (held, found.layers.iter().find(|layer| layer.kind == once)) {
        (Held::Reflected, Some(direct)) => {
            let direct = direct.light.picture.scaled(-1.0);
            let rest = found.picture.plus(&direct).unwrap_or_else(|| found.picture.clone());
            Picture { pixels: rest.pixels.iter().map(|p| p.max(glam::Vec3::ZERO)).collect(), ..rest }
        }
        _ => found.picture.clone(),
    };
    let map = |lamp: Option<&str>, light: &Picture, noise: &Picture, error: f64| {
        let rms = coverage.rms(light);
        LightMap {
            lamp: lamp.map(str::to_owned),
            irradiance: dilated(&light.scaled(PI), coverage),
            standard_error: noise.scaled(PI),
            rms: f64::from(PI) * rms,
            error: if rms > 0.0 { error / rms } else { 0.0 },
        }
    };
    let mut all = vec![map(None, &light, &found.standard_error, whole)];
    for layer in &found.layers {
        if let LayerKind::Emitter(name) = &layer.kind {
            let own = coverage.rms(&layer.light.picture);
            let error = layer.error.map_or(whole, |e| if e.rms > 0.0 { own * e.error / e.rms } else { e.error });
            all.push(map(Some(name), &layer.light.picture, &layer.light.standard_error, error));
        }
    }
    all
}
