//! Many columns of E over one F: products with F against the machine's read bandwidth, and many solves together.
//!
//! `cargo bench --bench columns -- [PATCHES [RAYS]]` casts F of the furnished room, 100,000 patches of 512 rays each
//! where nothing else is said, and prints for 1, 4, 16 and 64 RGB columns the milliseconds of a product and of each
//! column, how many times as long as for one column it takes, and the matrix's bytes a second as a share of the
//! bandwidth. One column is a product with one vector of four numbers a patch. The bandwidth is that of a sum over an
//! array of 1 GiB on all threads. Every figure is the median of [`TURNS`] turns, and each turn measures all of them.
//!
//! Then, on 4000 patches, 500 columns solved together against as many times the median of single solves.

use std::hint::black_box;
use std::time::Instant;

use glam::Vec4;
use halflight::Solver;
use halflight::form_factors::{Columns, Rows, Sampling, Variant, cast};
use halflight::light::{Light, Mode, Rgb};
use halflight::operator::LitPatches;
use halflight::render::{Discretization, Silent};
use halflight::scene::{LoadOptions, Scene};
use halflight::solve::{Settings, Source, neumann, solve_columns};
use rayon::prelude::*;

/// Times that everything is measured.
const TURNS: usize = 7;
/// RGB columns multiplied at once.
const COUNTS: [usize; 4] = [1, 4, 16, 64];
/// Numbers of 8 bytes in the array whose sum measures the bandwidth.
const ARRAY: usize = 1 << 27;
/// Columns solved together, and patches they are solved on.
const SOLVED: usize = 500;
const PATCHES: usize = 4000;

fn room(patches: usize) -> Discretization {
    let scene = Scene::builtin("furnished-room", LoadOptions::default());
    Solver::new(&scene.expect("a built-in name").expect("a correct scene")).cut(patches)
}

fn form_factors(patches: usize, rays: u32) -> Rows {
    let p = room(patches);
    let all = vec![true; p.patches.len()];
    let variant = Variant { tau: vec![0.0; p.geometry.scene.materials.len()], rows: all.clone(), columns: all };
    let sampling = Sampling { rays, ..Sampling::default() };
    let (mut found, _) = cast(&p.geometry.rays, &p.patches, &[variant], &sampling, &|_| ());
    found.remove(0).rows
}

fn seconds<T>(work: impl FnOnce() -> T) -> f64 {
    let start = Instant::now();
    black_box(work());
    start.elapsed().as_secs_f64()
}

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_unstable_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Numbers between 0 and 1, told by patch and column.
fn number(i: usize, c: usize) -> f32 {
    ((i * 31 + c * 17) % 101) as f32 / 101.0
}

fn products(f: &Rows) {
    let array = vec![1u64; ARRAY];
    let sum = || array.par_chunks(1 << 16).map(|part| part.iter().copied().fold(0, u64::wrapping_add)).sum::<u64>();
    let x: Vec<Vec4> = (0..f.len()).map(|i| Vec4::from_array([0, 1, 2, 3].map(|c| number(i, c)))).collect();
    let columns = COUNTS.map(|count| {
        let mut x = Columns::zeros(f.len(), 3 * count);
        x.for_each(|i, first, row| row.iter_mut().enumerate().for_each(|(c, x)| *x = number(i, first + c)));
        x
    });
    let mut bandwidths = Vec::new();
    let mut times = [const { Vec::new() }; COUNTS.len()];
    for _ in 0..TURNS {
        bandwidths.push(8.0 * ARRAY as f64 / seconds(sum));
        times[0].push(seconds(|| f.product(&x)));
        for (times, x) in times.iter_mut().zip(&columns).skip(1) {
            times.push(seconds(|| f.product_of_columns(x)));
        }
    }
    let bandwidth = median(bandwidths);
    println!("{} patches, {} entries a row, {:.0} MB", f.len(), f.entries() / f.len(), 1e-6 * f.bytes() as f64);
    println!("bandwidth {:.1} GB/s on {} threads", 1e-9 * bandwidth, rayon::current_num_threads());
    let [first, ..] = &times;
    let first = median(first.clone());
    println!("columns        ms  ms a column  times one  GB/s  of bandwidth");
    let say = |count: usize, time: f64| {
        let rate = f.bytes() as f64 / time;
        let (all, each) = (1e3 * time, 1e3 * time / count as f64);
        println!(
            "{count:>7} {all:>9.1} {each:>12.2} {:>10.2} {:>5.1} {:>12.0} %",
            time / first,
            1e-9 * rate,
            100.0 * rate / bandwidth
        );
    };
    for (count, times) in COUNTS.into_iter().zip(times) {
        say(count, median(times));
    }
}

fn solves() {
    let (mut found, _) = room(PATCHES).assemble(&[Mode::Global.transport()], &Sampling::default(), &Silent);
    let k = found.remove(0).operator;
    // About half of all patches are lit, as by a sun.
    let emission = |c: usize| -> Vec<Light> {
        let lit = |i: usize| (number(i, c) - 0.5).max(0.0) * Rgb::new(1.0, 0.9, 0.8);
        (0..k.len()).map(|i| Light::unseen(lit(i))).collect()
    };
    let sources: Vec<Source> = (0..SOLVED).map(|c| Source { emission: emission(c), first_bounce: None }).collect();
    let settings = Settings::default();
    let mut singles = Vec::new();
    let mut together = Vec::new();
    let mut products_taken = 0;
    for turn in 0..TURNS {
        let single = LitPatches::of_source(&k, sources[turn * SOLVED / TURNS].clone());
        singles.push(seconds(|| neumann(&single, &settings).expect("it converges")));
        together.push(seconds(|| {
            products_taken = solve_columns(&k, &sources, &settings).expect("it converges").products;
        }));
    }
    let (single, together) = (median(singles), median(together));
    println!(
        "{} patches, {} entries a row, {products_taken} products a column",
        k.len(),
        k.form_factors().entries() / k.len()
    );
    println!(
        "{SOLVED} columns together {together:.3} s, one alone {single:.3} s: 1/{:.1} of {SOLVED} single solves",
        SOLVED as f64 * single / together
    );
}

fn main() {
    // Cargo passes --bench.
    let mut numbers = std::env::args().filter_map(|word| word.parse::<u32>().ok());
    let patches = numbers.next().unwrap_or(100_000);
    let rays = numbers.next().unwrap_or(512);
    products(&form_factors(patches as usize, rays));
    solves();
}
