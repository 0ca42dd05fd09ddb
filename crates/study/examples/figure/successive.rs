//! Successive approximation: the bounce series of every mode in pictures.
//!
//! The terms E, KE, K²E, ... of each mode stand in a row, and under each the sum up to it; the last column has all
//! later terms together, and L. E stands there once, unless it is black. Sums share one exposure; terms after KE are
//! brightened by powers of two to about the brightness of KE, and say so. Modes whose series diverges have no L and no
//! rows: the caption names them. Not handled: errors; the effort is given.

use crate::common::{Failure, too_large};
use crate::page::{PageSettings, exposure_for, exposure_words};
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Transport};
use halflight::operator::Bounds;
use halflight::pictures::{Exposure, Picture};
use halflight::render::{Fineness, Silent};
use halflight::solve::{Diverges, Settings, Verdict, neumann};
use halflight_plot::{Cell, Heading, Page, PageRow, Shown, term_name};
use halflight_study::{bounce_fields_and_rest, bounce_pictures, brightened, brightening, partial_sums};

/// Bounces with a picture of their own; the rest shares one.
const BOUNCES: usize = 4;

/// The series of one mode in pictures, or the proof that it has no sum.
pub struct Successive {
    /// The mode.
    pub transport: Transport,
    /// How the series behaves.
    pub verdict: Verdict,
    /// Proved bounds on the spectral radius.
    pub radius: Bounds,
    /// E, KE, ..., and all later terms together; nothing where the series diverges.
    pub terms: Vec<Picture>,
}

impl Successive {
    /// A series without a sum.
    fn diverging(transport: Transport, e: &Diverges) -> Successive {
        Successive { transport, verdict: e.verdict, radius: e.radius, terms: Vec::new() }
    }

    /// Terms with a picture of their own.
    fn count(&self) -> usize {
        if self.verdict == Verdict::Ends { 2.min(self.terms.len()) } else { self.terms.len().saturating_sub(1) }
    }

    /// Term n, or all after those with a picture of their own.
    fn term(&self, n: usize, exposure: Exposure) -> Cell {
        let name = match n {
            _ if n < self.count() => term_name(n),
            _ if self.verdict == Verdict::Ends => return blank(if n == 2 { "K²E = 0" } else { "" }),
            _ => "all later terms".into(),
        };
        let gain = if n < 2 { 1.0 } else { brightening(&self.terms[1], &self.terms[n]) };
        let exposure = Exposure { stops: exposure.stops + gain.log2() };
        Cell::new(Heading::new(name, brightened(gain)), Shown::image(&self.terms[n], exposure))
    }

    /// The sum up to term n; L in the last column.
    fn sum(&self, sums: &[Picture], n: usize, exposure: Exposure) -> Cell {
        let name = match n {
            _ if self.verdict == Verdict::Ends && n == 1 => "L = E + KE".to_owned(),
            _ if self.verdict == Verdict::Ends && n >= self.count() => return blank(""),
            _ if n >= self.count() => "L".to_owned(),
            1 => "E + KE".into(),
            2 => "E + KE + K²E".into(),
            n => format!("E + … + {}", term_name(n)),
        };
        Cell::new(Heading::new(name, ""), Shown::image(&sums[n], exposure))
    }
}

fn is_black(picture: &Picture) -> bool {
    picture.pixels.iter().all(|pixel| pixel.max_element() <= 0.0)
}

fn blank(name: &str) -> Cell {
    Cell::new(Heading::new(name, ""), Shown::Blank)
}

/// Solves all modes from one cast of rays.
pub fn solve_series(settings: &PageSettings, effort: (Fineness, u32)) -> Result<Vec<Successive>, Failure> {
    let PageSettings { scene, size, seed, .. } = *settings;
    let (fineness, samples) = effort;
    let equations = Solver::new(scene).seed(seed).assemble(&Mode::ALL.map(Mode::transport), fineness, &Silent);
    let equations = equations.map_err(too_large)?;
    let pass = GatherPass::new(size, &GatherSampling::with_samples(samples, seed));
    let series = equations.modes.iter().map(|mode| match neumann(&mode.operator, &Settings::default()) {
        Ok(s) => {
            let fields = bounce_fields_and_rest(&mode.lights, &s.terms, BOUNCES);
            let terms = bounce_pictures(&mode.lights, &fields, &pass, &Silent);
            Successive { transport: mode.transport, verdict: s.verdict, radius: s.radius, terms }
        }
        Err(e) => Successive::diverging(mode.transport, &e),
    });
    Ok(series.collect())
}

/// The page of a scene, as bright as suits the sums and the settings.
pub fn successive(settings: &PageSettings, series: &[Successive]) -> Page {
    let summed: Vec<_> = series.iter().filter(|s| s.count() > 1).map(|s| (s, partial_sums(&s.terms))).collect();
    let exposure = exposure_for(summed.iter().filter_map(|(_, sums)| sums.last()), settings.brighter);
    let mut rows = Vec::new();
    // E is the same in every mode.
    let is_dark = summed.iter().all(|(s, _)| is_black(&s.terms[0]));
    let first = usize::from(is_dark);
    for (s, sums) in &summed {
        let mut row = |what, cell: &dyn Fn(usize) -> Cell| {
            let cells = (first..s.terms.len()).map(cell).collect();
            rows.push(PageRow { heading: Heading::new(s.transport.label(), what), cells });
        };
        // Once is enough.
        let is_first = std::ptr::eq(*s, summed[0].0);
        row("terms", &|n| if n == 0 && !is_first { blank("") } else { s.term(n, exposure) });
        row("sums", &|n| if n == 0 { blank("") } else { s.sum(sums, n, exposure) });
    }
    let without_rows = series.iter().filter(|s| s.count() < 2).map(|s| {
        let Bounds { lower, upper } = s.radius;
        format!(" No rows for {}: {}, spectral radius {lower:.3} to {upper:.3}.", s.transport.label(), s.verdict.name())
    });
    let of_e = if is_dark { "is black, as no luminaire is in view, and left out" } else { "is the same in every mode" };
    let caption = format!(
        "Scene {}. Upper row of each mode: single terms of the series. Lower row: their sums. E {of_e}. One {} \
         for all sums.{}",
        settings.scene.name,
        exposure_words(exposure),
        without_rows.collect::<String>(),
    );
    settings.page("Successive approximation: L = E + KE + K²E + …", caption, rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::tests::{codes, settings};
    use halflight::scene::Scene;

    const EFFORT: (Fineness, u32) = (Fineness { patches: 300, rays: 64 }, 16);

    #[test]
    fn sums_stand_under_their_terms() {
        let scene = Scene::open("gallery").unwrap();
        let settings = settings(&scene);
        let page = successive(&settings, &solve_series(&settings, EFFORT).unwrap());
        let names = |row: usize| page.rows[row].cells.iter().map(|c| &c.above.name[..]).collect::<Vec<_>>();
        assert_eq!(page.rows.len(), 8);
        assert_eq!(names(0), ["E", "KE", "K²E", "K³E", "K⁴E", "all later terms"]);
        assert_eq!(names(1)[3..], ["E + … + K³E", "E + … + K⁴E", "L"]);
        // E once, as it is the same everywhere.
        assert_eq!(names(7)[..2], ["", "L = E + KE"]);
        let shows_e = |row: &&PageRow| row.cells[0].above.name == "E";
        assert_eq!(page.rows.iter().filter(shows_e).count(), 1);
        // Later terms are brightened, sums are not; where a mode ends L is E + KE.
        let cell = |row: usize, column: usize| &page.rows[row].cells[column];
        assert!(cell(0, 4).above.note.ends_with(" times brighter") && cell(1, 5).above.note.is_empty());
        assert!(codes(cell(4, 1)) < codes(cell(5, 1)));
    }

    #[test]
    fn what_diverges_has_no_rows() {
        let scene = Scene::open("furnished-room").unwrap();
        let settings = settings(&scene);
        let page = successive(&settings, &solve_series(&settings, EFFORT).unwrap());
        assert!(page.rows.iter().all(|row| row.heading.name != "shadowless"));
        assert!(page.caption.contains("No rows for shadowless"), "{}", page.caption);
    }
}
