//! Between the modes: pictures over the (alpha, tau) square, solved from one cast of rays.
//!
//! ```text
//! F^t  = sum over k of t^k F^(k)                        layers of one cast (form_factors::layers)
//! L    = (I - alpha b F^t)^-1 E                         one solve for each point, b = own alpha rho
//! ```
//!
//! A material without numbers of its own takes (alpha, tau); one with its own takes alpha times its alpha and tau times
//! its tau, as in the [map](crate::study::map). The gather pass is linear in L, so all alphas of one tau are gathered
//! from the same rays, one field each. Points whose series is not proved to converge have no light and are hatched.
//!
//! Not handled: errors; the effort is given.

use crate::form_factors::{FormFactors, Layers, Sampling, Variant, cast_layers};
use crate::gather::GatherSampling;
use crate::light::{Rgb, Transport};
use crate::operator::{Operator, PatchMaterials};
use crate::pictures::{Picture, Size};
use crate::reading::invisible;
use crate::render::prepared::{fields, look};
use crate::render::prepared::{received, sight};
use crate::render::without_luminaires;
use crate::render::{Prepared, Watch};
use crate::solve::{Diverges, Extrapolated, Settings, extrapolated};

/// A point of the square, and its picture or the proof that there is none.
pub struct Point {
    /// Factors on every alpha and tau.
    pub transport: Transport,
    /// The solution on patches.
    pub solution: Result<Extrapolated, Diverges>,
    /// The visible half of L; none where the series is not proved to converge.
    pub picture: Option<Picture>,
}

/// How finely the square is solved, and how large its pictures are.
pub struct SquareEffort {
    /// Rays of the patches.
    pub sampling: Sampling,
    /// Rays of the pixels.
    pub gather: GatherSampling,
    /// Pixels across and down.
    pub size: Size,
}

/// Solves a scene at points of the (alpha, tau) square from one cast of rays; points of one tau are gathered together.
pub fn solve_points(p: &Prepared, points: &[Transport], effort: &SquareEffort, watch: &dyn Watch) -> Vec<Point> {
    let layers = cast(p, &effort.sampling, watch);
    let mut taus: Vec<f32> = points.iter().map(|t| t.tau).collect();
    taus.sort_by(f32::total_cmp);
    taus.dedup();
    let of = |tau: f32| points.iter().copied().filter(move |t| t.tau == tau).collect();
    taus.into_iter().flat_map(|tau| column(p, &layers, of(tau), effort, watch)).collect()
}

/// The crossings of all rays, materials at alpha = tau = 1 or their own.
fn cast(p: &Prepared, sampling: &Sampling, watch: &dyn Watch) -> Layers {
    let own = p.scene.transports(Transport { alpha: 1.0, tau: 1.0 });
    let materials = PatchMaterials::new(&p.scene, &p.patches, &p.luminaires, &own);
    let tau: Vec<f32> = own.iter().map(|t| t.tau).collect();
    watch.begin("form factors", p.patches.len() as u64);
    let tick = |done| watch.tick(done);
    let own = Variant { tau, rows: materials.receives(), columns: materials.sends() };
    cast_layers(&p.rays, &p.patches, &own, sampling, &tick).0
}

/// (alpha, tau) of every material at a point of the square.
fn scaled(p: &Prepared, point: Transport) -> Vec<Transport> {
    let own = p.scene.transports(Transport { alpha: 1.0, tau: 1.0 });
    own.iter().map(|t| Transport { alpha: point.alpha * t.alpha, tau: point.tau * t.tau }).collect()
}

/// The points of one tau.
fn column(
    p: &Prepared,
    layers: &Layers,
    points: Vec<Transport>,
    effort: &SquareEffort,
    watch: &dyn Watch,
) -> Vec<Point> {
    let Some(&first) = points.first() else {
        return Vec::new();
    };
    let surfaces = scaled(p, first);
    let sight = sight(p, &surfaces);
    let materials = |t: Transport| PatchMaterials::new(&p.scene, &p.patches, &p.luminaires, &scaled(p, t));
    let direct = received(p, &sight, &materials(first), &effort.sampling, watch);
    let rows = layers.form_factors(first.tau);
    let unit = p.scene.frame.scale * p.scene.frame.scale;
    let areas: Vec<f64> = p.patches.areas().iter().map(|a| a * unit).collect();
    let mut fields_of = Vec::new();
    let mut solved = Vec::new();
    watch.begin("series", points.len() as u64);
    for transport in points {
        let f = FormFactors { rows: rows.clone(), row_sums: vec![None; p.patches.len()] };
        let k = Operator::new(f, materials(transport), areas.clone(), direct.luminaires.clone())
            .with_punctual(&direct.punctual);
        let solution = extrapolated(&k, &Settings::default());
        if let Ok(found) = &solution {
            fields_of.push(reflected(p, &k, found));
        }
        solved.push(Point { transport, solution, picture: None });
        watch.tick(1);
    }
    let view = crate::reading::View::new(&sight, effort.size);
    let gathered = look(&view, &fields(p, &fields_of), &(&effort.gather).into(), watch);
    let seen = gathered.emission.plus(&gathered.direct).unwrap_or_default();
    let lit = solved.iter_mut().filter(|point| point.solution.is_ok());
    for (point, indirect) in lit.zip(&gathered.indirect) {
        point.picture = seen.plus(indirect);
    }
    solved
}

/// The invisible light that hemisphere rays read: all of L but what luminaires emit.
fn reflected(p: &Prepared, k: &Operator, found: &Extrapolated) -> Vec<Rgb> {
    let emission = invisible(k.emission());
    let others = without_luminaires(p, k.emission());
    let light = invisible(&found.light).into_iter();
    light.zip(emission.into_iter().zip(others)).map(|(l, (e, other))| l - (e - other)).collect()
}
