//! The picture of a solution: what of it hemisphere rays read, and the gather pass over it.
//!
//! Not handled: how much effort it takes ([`crate::render::tolerance`]).

use crate::direct::Sight;
use crate::gather::{Fields, GatherPass, Gathered, Gathering, View, gather, invisible, linear};
use crate::light::{Light, Rgb, Transport};
use crate::pictures::Size;
use crate::render::assembly::{Assembled, Prepared, Watch, sight};
use crate::solve::Solution;

/// What hemisphere rays read of E: all of it but the luminaires', which are gathered by closed form.
pub fn without_luminaires(p: &Prepared, emission: &[Light]) -> Vec<Rgb> {
    let mut field = invisible(emission);
    for (l, &material) in field.iter_mut().zip(p.patches.materials()) {
        if p.luminaires.carries[material as usize] {
            *l = Rgb::ZERO;
        }
    }
    field
}

/// The invisible light that the picture of a solution reads: every term, luminaires' emission excepted.
pub(crate) fn reflected(p: &Prepared, terms: &[Vec<Light>]) -> Vec<Rgb> {
    let mut terms = terms.iter();
    let mut field = terms.next().map_or_else(Vec::new, |emission| without_luminaires(p, emission));
    for term in terms {
        for (sum, l) in field.iter_mut().zip(term) {
            *sum += l.invisible;
        }
    }
    field
}

/// What the patches receive of the reflected light, irradiance over pi.
pub(crate) fn ambient(mode: &Assembled, solution: &Solution) -> Vec<Rgb> {
    let k = &mode.operator;
    let received = |i: usize| {
        let visible = solution.light[i].visible - k.emission()[i].visible;
        let rho = k.reflectance(i);
        let over = |c: usize| {
            if rho[c] > 0.0 { visible[c] / rho[c] } else { 0.0 }
        };
        Rgb::new(over(0), over(1), over(2)) - k.received()[i]
    };
    (0..k.len()).map(received).collect()
}

/// Renders fields of patch light under one choice of (alpha, tau) for every material.
pub fn picture(
    p: &Prepared,
    transports: &[Transport],
    fields: &Fields,
    pass: &GatherPass,
    watch: &dyn Watch,
) -> Gathered {
    let sight = sight(p, transports);
    look(&view(p, transports, &sight, pass.size), fields, &pass.gathering, watch)
}

/// Fields to gather from one value a patch each, read as linear within a patch.
pub(crate) fn fields(p: &Prepared, values: &[Vec<Rgb>]) -> Fields {
    let neighbours = p.patches.neighbours();
    let each = values.iter().map(|field| linear(&neighbours, field));
    Fields::linear(&each.collect::<Vec<_>>())
}

/// Renders the solution of one mode.
pub fn render(p: &Prepared, mode: &Assembled, solution: &Solution, pass: &GatherPass, watch: &dyn Watch) -> Gathered {
    let fields = fields(p, &[reflected(p, &solution.terms)]).with_ambient(ambient(mode, solution));
    look(&mode_view(p, mode, pass.size), &fields, &pass.gathering, watch)
}

/// Renders the visible half of what the fields send.
pub(crate) fn look(view: &View, fields: &Fields, gathering: &Gathering, watch: &dyn Watch) -> Gathered {
    watch.begin("gather", view.height as u64);
    gather(view, fields, gathering, &|done| watch.tick(done))
}

/// What the camera looks at in an assembled mode.
pub(crate) fn mode_view<'a>(p: &'a Prepared, mode: &'a Assembled, size: Size) -> View<'a> {
    view(p, &mode.transports, &mode.sight, size)
}

/// What the camera looks at, where `sight` belongs to (alpha, tau) of every material.
pub(crate) fn view<'a>(p: &'a Prepared, transports: &'a [Transport], sight: &'a Sight, size: Size) -> View<'a> {
    View {
        scene: &p.scene,
        rays: &p.rays,
        patches: &p.patches,
        luminaires: &p.luminaires,
        sight,
        transports,
        width: size.width,
        height: size.height,
    }
}
