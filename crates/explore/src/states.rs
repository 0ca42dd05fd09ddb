//! The states by which a page checks itself: one at least for every slider, and where the series diverges.
//!
//! Each is a link as the page writes it, with the mean of the picture that the program draws of it. Not handled: where
//! the eye is, which is the file's camera in all of them.

use glam::DVec3;
use rayon::prelude::*;

use crate::document::Expected;
use crate::drawn::{View, shown_mean};
use crate::light::Layers;
use crate::sums::{Shown, State};
use crate::terms::Solved;
use halflight::light::Mode;

/// A state under the link that leads to it.
struct Linked {
    link: String,
    state: State,
}

/// What the page should show in each state.
pub(super) fn expected(solved: &Solved, layers: &Layers, view: &View) -> Vec<Expected> {
    let one = |Linked { link, state }: &Linked| {
        let picture = view.picture(layers, &solved.kept.mixture(state));
        Expected { state: link.clone(), mean: shown_mean(&picture, state.stops) }
    };
    states(solved).par_iter().map(one).collect()
}

fn states(solved: &Solved) -> Vec<Linked> {
    let base = |mode: Mode| {
        let transport = mode.transport();
        let (alpha, tau) = (transport.alpha.into(), transport.tau.into());
        State { alpha, tau, shown: Shown::All, gains: solved.gains(), rho: 1.0, stops: 0.0 }
    };
    let global = || base(Mode::Global);
    let last = solved.kept.terms();
    let mut all = Vec::new();
    let mut add = |link: String, state: State| all.push(Linked { link, state });
    for mode in Mode::ALL {
        add(format!("mode={mode}"), base(mode));
    }
    for alpha in [0.25, 0.5, 0.9] {
        add(format!("mode=global&alpha={alpha}"), State { alpha, ..global() });
    }
    // At a node, between nodes, and near both ends.
    for tau in [0.04, 0.3, 0.5, 0.7, 0.97] {
        add(format!("mode=global&tau={tau}&bounce={last}"), State { tau, shown: Shown::UpTo(last), ..global() });
    }
    for n in 0..3.min(last) {
        add(format!("mode=global&bounce={n}"), State { shown: Shown::UpTo(n), ..global() });
    }
    for n in [0, 1, 2, last] {
        add(format!("mode=global&term={n}"), State { shown: Shown::Term(n), ..global() });
    }
    let (alpha, tau) = (0.5, 0.3);
    add(format!("alpha={alpha}&tau={tau}"), State { alpha, tau, ..global() });
    let n = 3.min(last);
    add(
        format!("mode=shadowless&term={n}&stops=-2"),
        State { shown: Shown::Term(n), stops: -2.0, ..base(Mode::Shadowless) },
    );
    for rho in [0.4, 1.1, 2.5] {
        add(format!("mode=global&rho={rho}"), State { rho, ..global() });
    }
    let (rho, tau) = (0.7, 0.4);
    add(format!("mode=global&tau={tau}&rho={rho}"), State { rho, tau, ..global() });
    for stops in [-1.5, 1.0] {
        add(format!("mode=global&stops={stops}"), State { stops, ..global() });
    }
    for (l, lamp) in solved.lamps.iter().enumerate() {
        for (text, gain) in [("0", DVec3::ZERO), ("1.5,0.75,0.2", DVec3::new(1.5, 0.75, 0.2))] {
            let mut gains = solved.gains();
            gains[l] = gain;
            add(format!("mode=global&{}={text}", lamp.key), State { gains, ..global() });
        }
    }
    all
}
