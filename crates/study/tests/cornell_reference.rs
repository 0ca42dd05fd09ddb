//! The Cornell box against pictures made by other programs (`tests/data/cornell`), all bounces and each.

use std::path::Path;

use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Rgb};
use halflight::pictures::{Picture, mean_difference, read_picture, relative_rms};
use halflight::render::Fineness;
use halflight::solve::{Settings, neumann};
use halflight_study::{bounce_fields, bounce_pictures};

use crate::common::{Silent, assemble_one, builtin};

fn data(name: &str) -> Picture {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/cornell");
    read_picture(folder.join(format!("{name}.exr"))).expect("a picture")
}

/// Standard error of the mean over the counted pixels, per channel.
fn error_of_mean(se: &Picture, mask: &Picture) -> [f64; 3] {
    let counted: Vec<usize> = (0..mask.pixels.len()).filter(|&i| mask.pixels[i].x >= 0.5).collect();
    [0, 1, 2].map(|c| {
        let squares = counted.iter().map(|&i| f64::from(se.pixels[i][c]).powi(2));
        squares.sum::<f64>().sqrt() / counted.len() as f64
    })
}

/// The mean over boxes of 4×4 pixels.
fn reduced(picture: &Picture) -> Picture {
    Picture::from_fn(picture.width / 4, picture.height / 4, |x, y| {
        let box_of = (0..16).map(|k| picture.pixels[(4 * y + k / 4) * picture.width + 4 * x + k % 4]);
        box_of.sum::<Rgb>() / 16.0
    })
}

/// Means of the reference's bounces 1 to 4 over the mask of the 64×64 pictures, from its README.
const MEANS: [[f64; 3]; 4] = [
    [0.048541, 0.031116, 0.008480],
    [0.023720, 0.014520, 0.003445],
    [0.012440, 0.007082, 0.001460],
    [0.005986, 0.003247, 0.000543],
];

#[test]
fn the_picture_and_its_bounces_agree_with_the_reference() {
    let p = Solver::new(&builtin("cornell-box")).cut(Fineness::default().patches);
    let mode = assemble_one(&p, Mode::Global.transport(), &Sampling::default());
    let solution = neumann(&mode.operator, &Settings::default()).expect("converges");
    let gathering = GatherSampling::with_samples(128, 0);
    // The reference was rendered at 256×256 and reduced, and so is this.
    let picture = mode.picture(&solution, &GatherPass::new((256, 256), &gathering), &Silent).total();
    let picture = reduced(&picture);
    let (reference, se, mask) = (data("reference"), data("reference_se"), data("mask"));

    let rms = relative_rms(&picture, &reference, Some(&mask), Some(&se)).unwrap();
    assert!(rms < 0.015, "{rms}");
    let mean = mean_difference(&picture, &reference, Some(&mask)).unwrap();
    for relative in mean.relative {
        assert!(relative.expect("the reference is lit").abs() < 0.003, "{relative:?}");
    }

    let bounces = bounce_pictures(
        &mode.lights,
        &bounce_fields(&mode.lights, &solution, 4),
        &GatherPass::new((64, 64), &gathering),
        &Silent,
    );
    assert_eq!(bounces.len(), 5);
    let other = GatherSampling { seed: 1, ..gathering };
    let others = bounce_pictures(
        &mode.lights,
        &bounce_fields(&mode.lights, &solution, 4),
        &GatherPass::new((64, 64), &other),
        &Silent,
    );
    for (n, bounce) in bounces.iter().enumerate().skip(1) {
        let (reference, se) = (data(&format!("bounce{n}")), data(&format!("bounce{n}_se")));
        let rms = relative_rms(bounce, &reference, Some(&mask), Some(&se)).unwrap();
        let mean = mean_difference(bounce, &reference, Some(&mask)).unwrap();
        let error = error_of_mean(&se, &mask);
        // What other rays change is noise of the gather pass, and the error is that and what patches leave, which is
        // below the whole picture's bound.
        let noise = relative_rms(bounce, &others[n], Some(&mask), None).unwrap() / std::f64::consts::SQRT_2;
        assert!(rms < noise.hypot(0.015), "bounce {n}: {rms}, of which noise {noise}");
        for c in 0..3 {
            let exact = MEANS[n - 1][c];
            let apart = mean.absolute[c].abs();
            assert!(apart < (0.005 * exact).max(4.0 * error[c]), "bounce {n}, channel {c}: {apart} of {exact}");
        }
    }
}

/// Means of its bounces 1 to 8 over the mask of the 256×256 pictures; each to six decimals with a standard error below
/// 1e-6.
const MEANS_256: [[f64; 3]; 8] = [
    [0.048299, 0.030961, 0.008438],
    [0.024099, 0.014781, 0.003528],
    [0.012440, 0.007084, 0.001460],
    [0.006017, 0.003267, 0.000549],
    [0.003259, 0.001694, 0.000253],
    [0.001701, 0.000846, 0.000104],
    [0.000936, 0.000447, 0.000049],
    [0.000511, 0.000232, 0.000022],
];

#[test]
fn eight_bounces_have_the_means_of_the_reference() {
    let p = Solver::new(&builtin("cornell-box")).cut(4000);
    let sampling = Sampling { rays: 1024, ..Sampling::default() };
    let mode = assemble_one(&p, Mode::Global.transport(), &sampling);
    let solution = neumann(&mode.operator, &Settings::default()).expect("converges");
    let gathering = GatherSampling::with_samples(16, 0);
    let bounces = bounce_pictures(
        &mode.lights,
        &bounce_fields(&mode.lights, &solution, 8),
        &GatherPass::new((256, 256), &gathering),
        &Silent,
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/cornell");
    let mask = read_picture(folder.join("mask256.png")).expect("a picture");
    let black = Picture::new(256, 256);
    for (n, (bounce, exact)) in bounces[1..].iter().zip(MEANS_256).enumerate() {
        let mean = mean_difference(bounce, &black, Some(&mask)).unwrap();
        for (found, exact) in mean.absolute.iter().zip(exact) {
            let apart = (found - exact).abs();
            assert!(apart < (0.003 * exact).max(3e-6), "bounce {}: {found} of {exact}", n + 1);
        }
    }
}

#[test]
fn the_table_of_means_is_that_of_the_pictures() {
    let mask = data("mask");
    for (n, means) in MEANS.iter().enumerate() {
        let picture = data(&format!("bounce{}", n + 1));
        let black = Picture::new(picture.width, picture.height);
        let found = mean_difference(&picture, &black, Some(&mask)).unwrap().absolute;
        for (found, exact) in found.iter().zip(means) {
            // Six decimals.
            assert!((found - exact).abs() < 0.6e-6, "{found} {exact}");
        }
    }
}
