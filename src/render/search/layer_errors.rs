//! How far the layers of a picture may be off, each for itself.
//!
//! The errors of the light on patches are known of the whole picture. Those of one lamp's part of it are found as the
//! search finds them: half the difference of two scramblings of F, and the difference to patches four times as large,
//! of each layer's own light, shown in a rough picture. Where the whole is known to be off by more than these two tell
//! of it, each layer is taken to be so by as much. The gather pass adds the noise of the layer, and its part of the
//! fit.
//!
//! Worth: where the lamp that makes nine tenths of a picture is put out, what is left is 4.2 to 4.5 % off with 2.6 to
//! 3.1 % stated of the whole, and 5.8 to 6.4 % of itself (docs/validation.md).
//!
//! Not handled: light of a lamp that patches miss and that walks of light found in the whole picture alone.

use crate::light::Rgb;
use crate::patches::Neighbours;
use crate::reading::Linear;
use crate::reading::linear;
use crate::render::assembly::Watch;
use crate::render::goal::PictureGoal;
use crate::render::layers::{LayerError, LayerKind, LayerLight};
use crate::render::rendered::Rendered;
use crate::render::search::solved::{Solved, larger, of_finer};

/// Layers whose errors are shown by one rough picture: of 6,000 patches they take some 75 MB.
const TOGETHER: usize = 128;

/// RMS errors of the light on patches in a rough picture, W/(m² sr).
#[derive(Default)]
pub(crate) struct LightErrors {
    /// Of the whole picture.
    whole: f64,
    /// Of the fields of its layers.
    layers: Vec<f64>,
}

impl LightErrors {
    /// Gathers rough pictures of the errors of layers, of both scramblings; nothing where the picture stays whole.
    pub(crate) fn new(solved: &Solved, halves: &[LayerLight], goal: &PictureGoal, watch: &dyn Watch) -> LightErrors {
        let [a, b] = halves else { return LightErrors::default() };
        let coarse = LayerLight::coarse(&solved.mode, &solved.coarse, solved.apart);
        let neighbours = solved.patches().neighbours();
        // One series may have a term more than the other.
        let dark = vec![Rgb::ZERO; solved.patches().len()];
        let levels = [a, b, &coarse].map(|own| own.fields().collect::<Vec<_>>());
        let count = levels.iter().map(Vec::len).max().unwrap_or(0);
        let layer = |k: usize| levels.each_ref().map(|own| own.get(k).copied().unwrap_or(&dark));
        let mut errors = LightErrors::default();
        for first in (0..count).step_by(TOGETHER) {
            let some = first..count.min(first + TOGETHER);
            let fields: Vec<_> = some.flat_map(|k| differences(solved, &neighbours, layer(k))).collect();
            let fields = solved.fields.clone().with_auxiliary(&fields);
            let rms = solved.rough_of(&fields, goal, watch).gathered.auxiliary_rms;
            let mut found = rms.chunks(2).map(|own| own[0].hypot(of_finer() * own[1]));
            errors.whole = found.next().unwrap_or(0.0);
            errors.layers.extend(found);
        }
        errors
    }

    /// States the errors of the layers of a picture whose own error is stated; `signal` is its RMS.
    pub(crate) fn state(&self, rendered: &mut Rendered, signal: f64) {
        let stated = signal * rendered.error.form_factors.hypot(rendered.error.patches);
        let more = if self.whole > 0.0 { (stated / self.whole).max(1.0) } else { 1.0 };
        let reads = |kind: &LayerKind| *kind != LayerKind::Bounce(0);
        let mut fields = self.layers.iter();
        let truncation = signal * rendered.error.truncation;
        for layer in &mut rendered.layers {
            // E is read by nobody.
            let light = if reads(&layer.kind) { fields.next() } else { Some(&0.0) };
            let error =
                |light: &f64| LayerError { rms: layer.light.rms, error: (more * light).hypot(layer.light.noise) };
            layer.error = light.map(error);
        }
        let last = rendered.layers.last_mut().filter(|layer| !matches!(layer.kind, LayerKind::Emitter(_)));
        if let Some(error) = last.and_then(|layer| layer.error.as_mut()) {
            // What the series leaves out would be in the last bounce, or after it.
            error.error = error.error.hypot(truncation);
        }
    }
}

/// Half the difference of two scramblings, and that of the first to larger patches.
fn differences(solved: &Solved, neighbours: &Neighbours, [a, b, c]: [&Vec<Rgb>; 3]) -> [Vec<Linear>; 2] {
    let [a, b] = [a, b].map(|values| linear(neighbours, values));
    let c = larger(solved.patches(), neighbours, c);
    [(b, 0.5), (c, 1.0)].map(|(other, share)| a.iter().zip(&other).map(|(x, y)| x.mix(share, y, -share)).collect())
}
