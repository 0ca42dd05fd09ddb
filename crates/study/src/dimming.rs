//! How far each lamp is to be dimmed so that points are lit as wanted.
//!
//! ```text
//! minimise |A x - b|²,   0 <= x_e <= 1      A_pe illuminance of lamp e at point p at full power, b as wanted
//! ```
//!
//! Light is linear in E, so A is known once every lamp's light was kept apart. A quadratic programme with bounds, by an
//! interior point method (P. J. Goulart, Y. Chen, *Clarabel*, 2024), to 1e-6 of the largest illuminance. Where several
//! x are as good the result is one in their middle.
//!
//! Not handled: lamps that are either on or off; power as a cost.

use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::NonnegativeConeT;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus};

/// Of the objective, which is a square.
const GAP: f64 = 1e-13;

/// The factors of lamps whose illuminances at points are the rows of `lit`, nearest to `wanted` in the mean square;
/// `None` where the numbers are not finite.
pub fn dimmed(lit: &[Vec<f64>], wanted: &[f64]) -> Option<Vec<f64>> {
    let lamps = lit.first().map_or(0, Vec::len);
    let largest = lit.iter().flatten().chain(wanted).fold(0.0_f64, |most, x| most.max(x.abs()));
    if lamps == 0 || !lit.iter().flatten().chain(wanted).all(|x| x.is_finite()) {
        return None;
    }
    if largest == 0.0 {
        return Some(vec![0.0; lamps]);
    }
    // Numbers near 1 whatever the unit is.
    let product = |i: usize, j: usize| lit.iter().map(|row| row[i] * row[j] / (largest * largest)).sum::<f64>();
    let upper: Vec<Vec<f64>> =
        (0..lamps).map(|i| (0..lamps).map(|j| if i <= j { product(i, j) } else { 0.0 }).collect()).collect();
    let toward = |i: usize| -lit.iter().zip(wanted).map(|(row, b)| row[i] * b / (largest * largest)).sum::<f64>();
    let toward: Vec<f64> = (0..lamps).map(toward).collect();
    // Ax + s = b with s >= 0:  x <= 1 and -x <= 0.
    let bound = |sign: f64| (0..lamps).map(move |i| (0..lamps).map(|j| if i == j { sign } else { 0.0 }).collect());
    let bounds: Vec<Vec<f64>> = bound(1.0).chain(bound(-1.0)).collect();
    let limits = [vec![1.0; lamps], vec![0.0; lamps]].concat();
    // The gap is of squares: its root is what illuminances may be off by.
    let builder = DefaultSettingsBuilder::default().verbose(false).tol_gap_abs(GAP).tol_gap_rel(GAP).build();
    let settings = builder.ok()?;
    let (p, a) = (CscMatrix::from(&upper), CscMatrix::from(&bounds));
    let mut solver = DefaultSolver::new(&p, &toward, &a, &limits, &[NonnegativeConeT(2 * lamps)], settings).ok()?;
    solver.solve();
    let is_solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
    is_solved.then(|| solver.solution.x.iter().map(|x| x.clamp(0.0, 1.0)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_can_be_had_is_found() {
        // Three lamps at four points: factors 0.25, 1 and 0 make what is wanted.
        let lit = [[900.0, 10.0, 3.0], [100.0, 500.0, 40.0], [20.0, 60.0, 700.0], [50.0, 300.0, 90.0]];
        let lit: Vec<Vec<f64>> = lit.iter().map(|row| row.to_vec()).collect();
        let wanted: Vec<f64> = lit.iter().map(|row| 0.25 * row[0] + row[1]).collect();
        let found = dimmed(&lit, &wanted).expect("numbers");
        for (x, exact) in found.iter().zip([0.25, 1.0, 0.0]) {
            assert!((x - exact).abs() < 1e-5, "{found:?}");
        }
    }

    #[test]
    fn no_lamp_is_below_dark_or_beyond_its_power() {
        let lit = vec![vec![100.0, 100.0], vec![0.0, 50.0]];
        // The second point wants less than nothing of the second lamp, the first more than both have.
        let found = dimmed(&lit, &[1000.0, 0.0]).expect("numbers");
        assert!(found.iter().all(|x| (0.0..=1.0).contains(x)) && (found[0] - 1.0).abs() < 1e-6, "{found:?}");
        assert_eq!(dimmed(&[vec![0.0; 2]], &[0.0]), Some(vec![0.0; 2]));
        assert_eq!(dimmed(&[vec![f64::NAN; 2]], &[0.0]), None);
        assert_eq!(dimmed(&[], &[]), None);
    }
}
