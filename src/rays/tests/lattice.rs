//! The point sequence's nets, its rate, and the maps to directions and triangles.

use crate::rays::sobol::{DIMENSIONS, Sobol, hash};
use crate::rays::tests::*;

/// Whether each elementary interval of `2^a` by `2^(m-t-a)` cells, for every a, holds `2^t` of the first `2^m` points.
fn is_net(sobol: &Sobol, (d, e): (usize, usize), m: u32, t: u32, seed: u32) -> bool {
    (0..=m - t).all(|a| {
        let (across, up) = (1u32 << a, 1u32 << (m - t - a));
        let mut count = vec![0u32; (across * up) as usize];
        for i in 0..1 << m {
            let x = (sobol.point(i, d, seed) * across as f32) as u32;
            let y = (sobol.point(i, e, seed) * up as f32) as u32;
            count[(x * up + y) as usize] += 1;
        }
        count.iter().all(|&c| c == 1 << t)
    })
}

#[test]
fn every_dimension_is_a_net_under_every_scrambling() {
    let sobol = Sobol::new(1 << 12, DIMENSIONS);
    for seed in 0..40 {
        for m in [1, 5, 12] {
            for d in 0..DIMENSIONS {
                let mut seen = vec![false; 1 << m];
                (0..1 << m).for_each(|i| {
                    seen[(sobol.point(i, d, seed) * (1 << m) as f32) as usize] = true;
                });
                assert!(seen.iter().all(|&s| s), "dimension {d}, 2^{m} points, seed {seed}");
            }
        }
    }
}

#[test]
fn pairs_of_dimensions_are_nets_of_the_quality_their_polynomials_give() {
    // Sobol: t is at most the sum of (degree - 1), degrees 1, 1, 2, 3, 3, 4 (dimension 0 counts as 1).
    let slack = [0, 0, 1, 2, 2, 3];
    let sobol = Sobol::new(1 << 10, DIMENSIONS);
    for seed in 0..20 {
        for d in 0..DIMENSIONS {
            for e in 0..d {
                let t = slack[d] + slack[e];
                assert!((t..=10).all(|m| is_net(&sobol, (e, d), m, t, seed)), "{e} {d}");
            }
        }
    }
    // The bound is reached: dimensions 2 and 3 are no (0, m, 2)-net.
    assert!(!(1..=10).all(|m| is_net(&sobol, (2, 3), m, 0, 1)));
}

#[test]
fn points_beyond_the_table_are_those_of_a_larger_table() {
    let (small, large) = (Sobol::new(1, 2), Sobol::new(1 << 12, DIMENSIONS));
    for i in 0..1 << 12 {
        for d in 0..DIMENSIONS {
            assert_eq!(small.point(i, d, 7), large.point(i, d, 7));
        }
    }
    assert!((0..1000).all(|i| small.point(u32::MAX - i, 1, i) < 1.0));
}

#[test]
fn seeds_and_dimensions_scramble_differently() {
    let sobol = Sobol::new(256, DIMENSIONS);
    let run = |d, seed| (0..256).map(|i| sobol.point(i, d, seed).to_bits()).collect::<Vec<_>>();
    let runs: Vec<_> = (0..50).flat_map(|seed| (0..DIMENSIONS).map(move |d| run(d, seed))).collect();
    let distinct: std::collections::HashSet<_> = runs.iter().collect();
    assert_eq!(distinct.len(), runs.len());
    // Every point by itself is uniform over the seeds: the mean of 4096 has deviation 1/sqrt(12 * 4096) = 0.0045.
    for i in [0, 1, 100] {
        let mean = (0..4096).map(|s| sobol.point(i, 3, hash(s, 9))).sum::<f32>() / 4096.0;
        assert!((mean - 0.5).abs() < 5.0 * 0.0045);
    }
}

/// Root mean square error over scramblings for the product of (1 + (x_d - 1/2)/2) exp-like factors of mean 1.
fn product_error(sobol: &Sobol, count: u32) -> f64 {
    let factor = |x: f64| x.exp() / (1f64.exp() - 1.0);
    let error = |seed: u32| {
        let value = |i: u32| (0..4).map(|d| factor(f64::from(sobol.point(i, d, seed)))).product::<f64>();
        (0..count).map(value).sum::<f64>() / f64::from(count) - 1.0
    };
    let squares = (0..32).map(|s| error(hash(s, 3)).powi(2)).sum::<f64>();
    (squares / 32.0).sqrt()
}

#[test]
fn smooth_products_are_integrated_faster_than_one_over_n() {
    let sobol = Sobol::new(1 << 14, 4);
    let (few, many) = (product_error(&sobol, 1 << 8), product_error(&sobol, 1 << 14));
    assert!(few / many > 64.0, "{few:e} -> {many:e}");
}

#[test]
fn cosine_directions_have_the_moments_of_lamberts_law() {
    // Over the density cos/pi: mean of cos is 2/3, of cos^2 1/2, of each tangential component 0. A midpoint grid of
    // n x n errs by O(1/n^2) inside and O(n^-3/2) from the square root at the rim.
    let n = 256;
    for axis in [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::new(0.3, -0.5, -0.81).normalize()] {
        let (mut first, mut second, mut sum) = (0.0f64, 0.0f64, DVec3::ZERO);
        for k in 0..n * n {
            let u = |k: u32| (k as f32 + 0.5) / n as f32;
            let direction = warp::cosine_direction(axis, u(k / n), u(k % n));
            assert!((direction.length() - 1.0).abs() < 1e-6);
            let cos = f64::from(direction.dot(axis));
            assert!(cos > 0.0);
            first += cos;
            second += cos * cos;
            sum += direction.as_dvec3();
        }
        let count = f64::from(n * n);
        let rim = f64::from(n).powf(-1.5);
        assert!((first / count - 2.0 / 3.0).abs() < rim);
        assert!((second / count - 0.5).abs() < rim);
        assert!((sum / count - axis.as_dvec3() * 2.0 / 3.0).length() < 2.0 * rim);
    }
    // The rim of the square stays above the surface.
    assert!(warp::cosine_direction(Vec3::Y, 0.0, 0.5).y > 0.0);
}

#[test]
fn the_basis_is_orthonormal_and_right_handed_for_every_normal() {
    let mut dice = Random(1);
    let poles = [Vec3::Z, Vec3::NEG_Z, Vec3::new(1e-5, 0.0, -1.0).normalize()];
    let normals = poles.into_iter().chain((0..1000).map(|_| dice.direction()));
    for n in normals {
        let (t, b) = warp::basis(n);
        assert!(t.cross(b).distance(n) < 2e-6);
        assert!((t.length() - 1.0).abs() < 1e-6 && (b.length() - 1.0).abs() < 1e-6);
        assert!(t.dot(b).abs() < 1e-6 && t.dot(n).abs() < 1e-6);
    }
}

#[test]
fn triangle_points_are_uniform() {
    // Moments of a uniform point: weights have mean 1/3, squares 1/6, products 1/12; the map is linear on two halves,
    // so a midpoint grid of n x n is off by O(1/n).
    let n = 128;
    let mut sums = [0.0f64; 5];
    for k in 0..n * n {
        let at = |k: u32| (k as f32 + 0.5) / n as f32;
        let (u, v) = warp::triangle_weights(at(k / n), at(k % n));
        assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0);
        let (u, v) = (f64::from(u), f64::from(v));
        for (sum, x) in sums.iter_mut().zip([u, v, u * u, v * v, u * v]) {
            *sum += x / f64::from(n * n);
        }
    }
    let expected = [1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0, 1.0 / 12.0];
    for (sum, expected) in sums.iter().zip(expected) {
        assert!((sum - expected).abs() < 1.0 / f64::from(n));
    }
}
