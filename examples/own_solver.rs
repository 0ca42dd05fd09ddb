//! A solver of one's own over K: GMRES (Saad and Schultz 1986), held against the Neumann series in products with K.
//!
//! With L = E + x the equation is `(I - K) x = KE`. GMRES makes the norm of its residual least over the Krylov space of
//! `KE, (I - K) KE, ...`, whatever K is; the Neumann series needs more products the nearer the spectral radius is to 1.
//!
//! Not handled: restarts, and a proof of the error: a residual is none where K is not normal.

use std::error::Error;

use halflight::{Fineness, Light, LinearOperator, Mode, Scene, Settings, Solver, neumann};

/// Products with K at most, each of which keeps a vector.
const MOST: usize = 60;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::open("furnished-room")?;
    let k = Solver::new(&scene).operator(Mode::Global, Fineness { patches: 1000, rays: 128 })?;
    let settings = Settings { tolerance: 1e-4, ..Settings::default() };
    let series = neumann(&k, &settings)?;
    let found = gmres(&k, settings.tolerance);
    let apart = added(&found.light, -1.0, &series.light);
    let size = |x: &[Light]| dot(&k, x, x).sqrt();
    println!("Neumann: {} products with K", series.terms.len() - 2);
    println!("GMRES:   {} products with K", found.products);
    println!("apart by {:.1e} of the light", size(&apart) / size(&series.light));
    Ok(())
}

/// L, and the products with K that it took.
struct Found {
    light: Vec<Light>,
    products: usize,
}

/// Solves `L = E + K L` up to a residual that is `tolerance` of KE in the area-weighted norm.
fn gmres(k: &dyn LinearOperator, tolerance: f64) -> Found {
    let right = k.first_bounce();
    let size = dot(k, &right, &right).sqrt();
    let mut basis = vec![scaled(&right, 1.0 / size)];
    // The Hessenberg matrix of I - K in the basis, kept triangular by rotations, and the right-hand side rotated along.
    let (mut triangle, mut rotations) = (Vec::<Vec<f64>>::new(), Vec::<[f64; 2]>::new());
    let mut rotated = vec![size];
    while rotated[rotations.len()].abs() > tolerance * size && rotations.len() < MOST {
        let newest = &basis[basis.len() - 1];
        let mut next = added(newest, -1.0, &k.apply(newest));
        let mut column = Vec::new();
        for vector in &basis {
            let along = dot(k, vector, &next);
            next = added(&next, -along, vector);
            column.push(along);
        }
        let length = dot(k, &next, &next).sqrt();
        for (i, [cos, sin]) in rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (cos * a + sin * b, cos * b - sin * a);
        }
        let last = column.len() - 1;
        let hypotenuse = column[last].hypot(length);
        let [cos, sin] = [column[last] / hypotenuse, length / hypotenuse];
        column[last] = hypotenuse;
        let carried = rotated[last];
        rotated[last] = cos * carried;
        rotated.push(-sin * carried);
        rotations.push([cos, sin]);
        triangle.push(column);
        basis.push(scaled(&next, 1.0 / length));
    }
    let products = triangle.len();
    let mut light = k.emission().to_vec();
    for (weight, vector) in solved(&triangle, &rotated).into_iter().zip(&basis) {
        light = added(&light, weight, vector);
    }
    Found { light, products }
}

/// The weights of the basis: back substitution in the triangle, given by columns.
fn solved(triangle: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    let mut weights = right[..triangle.len()].to_vec();
    for j in (0..triangle.len()).rev() {
        weights[j] /= triangle[j][j];
        for i in 0..j {
            weights[i] -= triangle[j][i] * weights[j];
        }
    }
    weights
}

/// `sum A_i x_i · y_i` over patches, halves and channels.
fn dot(k: &dyn LinearOperator, x: &[Light], y: &[Light]) -> f64 {
    let pairs = x.iter().zip(y).zip(k.areas());
    pairs.map(|((x, y), area)| area * f64::from(x.invisible.dot(y.invisible) + x.visible.dot(y.visible))).sum()
}

/// `x + weight y`.
fn added(x: &[Light], weight: f64, y: &[Light]) -> Vec<Light> {
    let weight = weight as f32;
    let pairs = x.iter().zip(y);
    let sum = |(x, y): (&Light, &Light)| Light {
        invisible: x.invisible + weight * y.invisible,
        visible: x.visible + weight * y.visible,
    };
    pairs.map(sum).collect()
}

fn scaled(x: &[Light], factor: f64) -> Vec<Light> {
    added(x, factor - 1.0, x)
}
