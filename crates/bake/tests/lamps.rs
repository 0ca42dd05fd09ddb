//! Maps of single luminaires.

use halflight_bake::{BakeGoal, Lamps};

use crate::{baked, folder, goal, name};

/// A box with two panels in its ceiling, of some radiances.
fn two_panels(left: f64, right: f64) -> tempfile::TempDir {
    let obj = "mtllib r.mtl\nv 0 0 0\nv 2 0 0\nv 2 0 1\nv 0 0 1\nv 0 1 0\nv 2 1 0\nv 2 1 1\nv 0 1 1\n\
        v .3 .99 .3\nv .6 .99 .3\nv .6 .99 .7\nv .3 .99 .7\nv 1.4 .99 .3\nv 1.7 .99 .3\nv 1.7 .99 .7\nv 1.4 .99 .7\n\
        usemtl white\no room\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n\
        usemtl left\no left\nf 9 10 11 12\nusemtl right\no right\nf 13 14 15 16\n";
    let emits = |name: &str, x: f64| format!("newmtl {name}\nKd 0 0 0\nKe {x} {} {}\n", 0.8 * x, 0.5 * x);
    let mtl = format!("newmtl white\nKd .6 .6 .6\n{}{}", emits("left", left), emits("right", right));
    folder(&[("r.obj", obj), ("r.mtl", &mtl)])
}

#[test]
fn maps_of_lamps_times_factors_are_the_map_of_the_dimmed_room() {
    let apart = BakeGoal { lamps: Lamps::Apart, ..goal(80, 0.03) };
    let (_, found) = baked(&name(&two_panels(5.0, 5.0), "r.obj"), &apart);
    let (_, dimmed) = baked(&name(&two_panels(1.5, 4.0), "r.obj"), &BakeGoal { seed: 17, ..goal(80, 0.03) });
    let lamps: Vec<_> = found.maps[1..].iter().map(|map| (map.lamp.as_deref().unwrap_or(""), map)).collect();
    assert_eq!(lamps.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["left", "right"]);
    let (mut whole, mut apart, mut squares) = (0.0, 0.0, 0.0);
    for k in (0..80 * 80).filter(|k| found.coverage.of(*k) > 0.0) {
        let [left, right] = [0, 1].map(|lamp| lamps[lamp].1.irradiance.pixels[k]);
        let exact = dimmed.maps[0].irradiance.pixels[k];
        whole += f64::from((left + right - found.maps[0].irradiance.pixels[k]).length_squared());
        apart += f64::from((0.3 * left + 0.8 * right - exact).length_squared());
        squares += f64::from(exact.length_squared());
    }
    // The maps of the lamps add up to that of all to rounding.
    assert!((whole / squares).sqrt() < 1e-5, "{whole} {squares}");
    let own: f64 = lamps.iter().zip([0.3, 0.8]).map(|((_, map), f)| (f * map.error * map.rms).powi(2)).sum();
    let stated = own.sqrt().hypot(dimmed.maps[0].error * dimmed.maps[0].rms) / dimmed.maps[0].rms;
    let apart = (apart / squares).sqrt();
    assert!(apart < 1.25 * stated, "{apart} {stated}");
    assert!(lamps.iter().all(|(_, map)| map.error > 0.0 && map.error < 0.1));
}

/// Reflected light alone is all light but that which comes straight from the panels.
#[test]
fn reflected_light_is_what_direct_light_leaves() {
    let folder = two_panels(5.0, 5.0);
    let name = name(&folder, "r.obj");
    let (_, all) = baked(&name, &goal(48, 0.05));
    let (_, reflected) = baked(&name, &BakeGoal { held: halflight_bake::Held::Reflected, ..goal(48, 0.05) });
    let direct = halflight::Mode::OneBounce.transport();
    let (_, direct) = baked(&name, &BakeGoal { transport: direct, ..goal(48, 0.05) });
    let (mut apart, mut squares) = (0.0, 0.0);
    for k in (0..48 * 48).filter(|k| all.coverage.of(*k) > 0.0) {
        let [all, reflected, direct] = [&all, &reflected, &direct].map(|bake| bake.maps[0].irradiance.pixels[k]);
        apart += f64::from((reflected + direct - all).length_squared());
        squares += f64::from(all.length_squared());
    }
    let stated = [&all, &reflected, &direct].map(|bake| bake.maps[0].error * bake.maps[0].rms);
    let stated = stated.iter().map(|e| e * e).sum::<f64>().sqrt() / all.maps[0].rms;
    assert!((apart / squares).sqrt() < 1.25 * stated, "{} {stated}", (apart / squares).sqrt());
}
