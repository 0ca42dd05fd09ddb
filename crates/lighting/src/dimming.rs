//! How far each lamp is to be dimmed so that points are lit as wanted.
//!
//! ```text
//! minimise |A x - b|² + (RIDGE |x|)²,   0 <= x_e <= 1    A_pe illuminance of lamp e at point p at full power, b wanted
//! ```
//!
//! Light is linear in E, so A is known once every lamp's light was kept apart. Least squares within bounds by an active
//! set (P. B. Stark, R. L. Parker, *Bounded-variable least-squares*, Computational Statistics 10, 1995): lamps are
//! dark, at full power or free, and the minimum over the free ones is that of a QR decomposition. The ridge, in units
//! of the largest illuminance, is far below what anybody measures; where several x are as good, it chooses the least
//! |x|: lamps that light the points alike are dimmed alike, and one that lights none of them is dark.
//!
//! Not handled: lamps that are either on or off; power as a cost.

use nalgebra::{DMatrix, DVector};

/// Weight of |x| against illuminances near 1.
const RIDGE: f64 = 1e-6;
/// Slopes against a bound below this are rounding.
const SLOPE: f64 = 1e-15;
/// Rounds at most, of each lamp: three do, unless rounding sends one back and forth.
const ROUNDS: usize = 20;

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
    // Numbers near 1 whatever the unit is, and the ridge as a row for each lamp.
    let points = lit.len();
    let a = DMatrix::from_fn(points + lamps, lamps, |p, e| match lit.get(p) {
        Some(row) => row[e] / largest,
        None => f64::from(u8::from(p - points == e)) * RIDGE,
    });
    let b = DVector::from_fn(points + lamps, |p, _| wanted.get(p).map_or(0.0, |b| b / largest));
    // |A x - b|² = |R x - Qᵀ b|² + what x does not change.
    let qr = a.qr();
    Some(bounded(&qr.r(), &qr.q().tr_mul(&b)).iter().copied().collect())
}

/// The x from 0 to 1 with the least `|A x - b|`, of an A with independent columns.
fn bounded(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let lamps = a.ncols();
    let (mut x, mut free) = (DVector::zeros(lamps), Vec::new());
    for _ in 0..ROUNDS * lamps {
        let aim = minimum(a, b, &x, &free);
        match first_bound(&x, &aim, &free) {
            Some((share, e, bound)) => {
                x += share * (aim - &x);
                x[e] = bound;
                free.retain(|&own| own != e);
            }
            None => {
                x = aim;
                match steepest(&a.tr_mul(&(b - a * &x)), &x, &free) {
                    Some(e) => free.push(e),
                    None => break,
                }
            }
        }
    }
    x
}

/// The x with the least `|A x - b|` over the free ones; the others stay.
fn minimum(a: &DMatrix<f64>, b: &DVector<f64>, x: &DVector<f64>, free: &[usize]) -> DVector<f64> {
    let mut aim = x.clone();
    free.iter().for_each(|&e| aim[e] = 0.0);
    let qr = a.select_columns(free).qr();
    let found = qr.r().solve_upper_triangular(&qr.q().tr_mul(&(b - a * &aim)));
    free.iter().zip(found.iter().flatten()).for_each(|(&e, &own)| aim[e] = own);
    aim
}

/// The first bound on the way to an aim: the share of the way, whose it is, and where; none where the aim is within
/// all.
fn first_bound(x: &DVector<f64>, aim: &DVector<f64>, free: &[usize]) -> Option<(f64, usize, f64)> {
    let beyond = free.iter().filter(|&&e| !(0.0..=1.0).contains(&aim[e]));
    let bounds = beyond.map(|&e| {
        let bound = aim[e].clamp(0.0, 1.0);
        ((bound - x[e]) / (aim[e] - x[e]), e, bound)
    });
    bounds.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Of those at a bound the one whose slope leads away from it most; none where all are to stay.
fn steepest(slopes: &DVector<f64>, x: &DVector<f64>, free: &[usize]) -> Option<usize> {
    let inwards = |e: usize| if x[e] > 0.5 { -slopes[e] } else { slopes[e] };
    let bound = (0..x.len()).filter(|e| !free.contains(e) && inwards(*e) > SLOPE);
    bound.max_by(|&a, &b| inwards(a).total_cmp(&inwards(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three lamps at four points.
    const LIT: [[f64; 3]; 4] = [[900.0, 10.0, 3.0], [100.0, 500.0, 40.0], [20.0, 60.0, 700.0], [50.0, 300.0, 90.0]];

    fn rows<const N: usize>(lit: &[[f64; N]]) -> Vec<Vec<f64>> {
        lit.iter().map(|row| row.to_vec()).collect()
    }

    fn assert_near(found: Option<Vec<f64>>, exact: &[f64]) {
        let found = found.expect("numbers");
        let off = found.iter().zip(exact).map(|(x, exact)| (x - exact).abs()).fold(0.0, f64::max);
        assert!(found.len() == exact.len() && off < 1e-7, "{found:?}, not {exact:?}");
    }

    #[test]
    fn what_can_be_had_is_found() {
        for exact in [[0.25, 1.0, 0.0], [0.25, 0.5, 0.75], [0.0, 0.0, 1.0]] {
            let wanted: Vec<f64> = LIT.iter().map(|row| row.iter().zip(exact).map(|(lit, x)| lit * x).sum()).collect();
            assert_near(dimmed(&rows(&LIT), &wanted), &exact);
        }
    }

    /// A lamp at a bound leaves the others' least squares: a projection, here by hand.
    #[test]
    fn lamps_at_a_bound_leave_the_rest_to_the_others() {
        let lit = rows(&[[4.0, 2.0], [0.0, 1.0]]);
        // Where x_1 is at a bound, x_2 is (2 (b_1 - 4 x_1) + b_2) / 5 within its own.
        assert_near(dimmed(&lit, &[10.0, 0.1]), &[1.0, 1.0]);
        assert_near(dimmed(&lit, &[4.4, 0.1]), &[1.0, 0.9 / 5.0]);
        assert_near(dimmed(&lit, &[-0.5, 2.5]), &[0.0, 1.5 / 5.0]);
        assert_near(dimmed(&lit, &[-3.0, 0.5]), &[0.0, 0.0]);
        assert_near(dimmed(&lit, &[2.0, 0.5]), &[0.25, 0.5]);
    }

    /// Of the x with the least squares the one with the least norm, wherever the columns depend on each other.
    #[test]
    fn lamps_that_do_alike_are_dimmed_alike_and_those_that_do_nothing_are_dark() {
        let twice = rows(&[[300.0, 300.0, 0.0], [100.0, 100.0, 0.0]]);
        assert_near(dimmed(&twice, &[300.0, 100.0]), &[0.5, 0.5, 0.0]);
        assert_near(dimmed(&twice, &[900.0, 300.0]), &[1.0, 1.0, 0.0]);
        // x_1 + 2 x_2 = 1, then 2.5, where x_2 is at its bound.
        assert_near(dimmed(&rows(&[[100.0, 200.0]]), &[100.0]), &[0.2, 0.4]);
        assert_near(dimmed(&rows(&[[100.0, 200.0]]), &[250.0]), &[0.5, 1.0]);
        // More lamps than points, a rank of two.
        assert_near(dimmed(&rows(&[[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]]), &[0.6, 4.0]), &[0.3, 0.3, 1.0, 1.0]);
    }

    /// The conditions of Karush, Kuhn and Tucker at what is found for lamps and points of all kinds.
    #[test]
    fn no_lamp_could_do_better() {
        let random = |k: usize| (k as f64 * 0.618_033_988_749_895).fract();
        for (points, lamps, scale) in [(40, 6, 0.5), (40, 25, 3.0), (3, 10, 1.0), (10, 10, 2.0), (1, 7, 9.0)] {
            let lit: Vec<Vec<f64>> =
                (0..points).map(|p| (0..lamps).map(|e| random(31 * p + 7 * e + p * e + 1).powi(3)).collect()).collect();
            let wanted: Vec<f64> = (0..points).map(|p| scale * lamps as f64 * random(5 * p + 2)).collect();
            let found = dimmed(&lit, &wanted).expect("numbers");
            let left = |p: usize| wanted[p] - lit[p].iter().zip(&found).map(|(lit, x)| lit * x).sum::<f64>();
            for (e, &x) in found.iter().enumerate() {
                let slope: f64 = (0..points).map(|p| left(p) * lit[p][e]).sum();
                let may_rest = x == 0.0 && slope < 1e-9 || x == 1.0 && slope > -1e-9 || slope.abs() < 1e-9;
                assert!((0.0..=1.0).contains(&x) && may_rest, "{points} {lamps}: {x} {slope}");
            }
        }
    }

    #[test]
    fn what_has_no_numbers_has_no_factors() {
        assert_eq!(dimmed(&[vec![0.0; 2]], &[0.0]), Some(vec![0.0; 2]));
        assert_eq!(dimmed(&[vec![f64::NAN; 2]], &[0.0]), None);
        assert_eq!(dimmed(&[], &[]), None);
    }
}
