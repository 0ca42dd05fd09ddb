//! One scene in the four modes at one exposure.
//!
//! After Figure 1 of D. C. Banks, K. M. Beason, *Retro-rendering with vector-valued light*, SPIE 6060, 2006: alpha down
//! and tau across. A mode whose series diverges has a hatched panel, and the others keep their common exposure. Not
//! handled: a mode of one's own.

use crate::common::{Failure, too_large};
use crate::page::{AXES, PageSettings, exposure_for, exposure_words, no_light};
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::Mode;
use halflight::pictures::Exposure;
use halflight::render::{Fineness, RenderError, Rendered, Silent};
use halflight::solve::Diverges;
use halflight_plot::{Cell, Heading, Page, PageRow, Shown};

/// How accurately the modes are solved.
#[derive(Clone, Copy, Debug)]
pub enum Precision {
    /// To an error.
    Within(f64),
    /// With so many patches and rays, and hemisphere rays for each pixel.
    Fixed((Fineness, u32)),
}

/// A mode's picture, or the proof that there is none.
pub type Solved = Result<Rendered, Diverges>;

/// Solves [`Mode::ALL`]: to a tolerance each with the patches that it needs, else from one set of patches and one cast
/// of rays.
pub fn solve_modes(settings: &PageSettings, precision: Precision) -> Result<Vec<Solved>, Failure> {
    let PageSettings { size, seed, .. } = *settings;
    let solver = Solver::new(settings.scene).seed(seed);
    match precision {
        Precision::Within(tolerance) => {
            let solve = |mode| match solver.render(mode, size).tolerance(tolerance) {
                Err(RenderError::Memory(unfit)) => Err(too_large(unfit)),
                Err(RenderError::Diverges(e)) => Ok(Err(e)),
                Ok(rendered) => Ok(Ok(rendered)),
            };
            Mode::ALL.into_iter().map(solve).collect()
        }
        Precision::Fixed((fineness, samples)) => {
            let assembled = solver.assemble(&Mode::ALL.map(Mode::transport), fineness, &Silent);
            let equations = assembled.map_err(too_large)?;
            let pass = GatherPass::new(size, &GatherSampling::with_samples(samples, seed));
            Ok(equations.render(&pass, &Silent))
        }
    }
}

/// The page of [`Mode::ALL`] of a scene: alpha 1 above alpha 0, tau 0 left of tau 1.
pub fn four_modes(settings: &PageSettings, solved: &[Solved]) -> Page {
    let pictures = || solved.iter().flatten();
    let exposure = exposure_for(pictures().map(|r| &r.picture), settings.brighter);
    let cells: Vec<Cell> = Mode::ALL.iter().zip(solved).map(|(&mode, solved)| cell(mode, solved, exposure)).collect();
    let rows = cells.chunks(2).map(|row| PageRow { heading: Heading::default(), cells: row.to_vec() });
    // With given effort no error is estimated, and all are 0.
    let worst = pictures().map(|r| r.error.total).filter(|&error| error > 0.0).reduce(f64::max);
    let worst = worst.map_or(String::new(), |e| format!(", estimated errors at most {:.1} %", 100.0 * e));
    let (name, words) = (&settings.scene.name, exposure_words(exposure));
    let caption = format!("Scene {name}. {AXES} The visible half of L; one {words} for all panels{worst}.");
    settings.page("One equation, L = E + K L, in four modes", caption, rows.collect())
}

fn cell(mode: Mode, solved: &Solved, exposure: Exposure) -> Cell {
    let t = mode.transport();
    let meaning = match mode {
        Mode::Global => "shadows and interreflection",
        Mode::Shadowless => "interreflection, no shadows",
        Mode::OneBounce => "shadows, no interreflection",
        Mode::Local => "neither shadows nor interreflection",
    };
    let above = Heading::new(mode.name(), format!("alpha {}, tau {}", t.alpha, t.tau));
    let shown = solved.as_ref().map_or_else(no_light, |found| Shown::image(&found.picture, exposure));
    Cell { above, shown, below: meaning.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::tests::{codes, settings};
    use halflight::scene::Scene;

    const EFFORT: Precision = Precision::Fixed((Fineness { patches: 300, rays: 64 }, 16));

    /// Shadowless is brighter than global where the partition casts its shadow, and local than one-bounce.
    #[test]
    fn interreflection_brightens_and_shadows_darken() {
        let scene = Scene::open("gallery").unwrap();
        let settings = settings(&scene);
        let page = four_modes(&settings, &solve_modes(&settings, EFFORT).unwrap());
        let cells: Vec<&Cell> = page.rows.iter().flat_map(|row| &row.cells).collect();
        assert_eq!(cells.iter().map(|c| &c.above.name[..]).collect::<Vec<_>>(), Mode::ALL.map(Mode::name));
        let [global, shadowless, one_bounce, local] = [0, 1, 2, 3].map(|k| codes(cells[k]));
        assert!(shadowless > global && global > local && local > one_bounce);
        assert!(!page.caption.contains("estimated"));
    }

    #[test]
    fn a_tolerance_is_met_and_what_diverges_is_hatched() {
        let scene = Scene::open("furnished-room").unwrap();
        let settings = settings(&scene);
        let solved = solve_modes(&settings, Precision::Within(0.2)).unwrap();
        assert!(solved[0].as_ref().unwrap().error.total <= 0.2);
        let page = four_modes(&settings, &solved);
        assert!(matches!(&page.rows[0].cells[1].shown, Shown::Absent(why) if why.contains("diverges")));
        assert!(page.caption.contains("estimated errors at most"), "{}", page.caption);
    }
}
