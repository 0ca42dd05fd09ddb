//! Direct light of luminaires without bias: the mean of many cheap estimates against closed forms, near and far, hidden
//! in part, with textures and among many, for receivers on patches and for points of their own.

use glam::{DQuat, DVec3, Vec2};
use halflight::Solver;
use halflight::direct::{Choice, LightSum, Lights, Scratch};
use halflight::form_factors::point_to_polygon;
use halflight::light::{Mode, Rgb};
use halflight::rays::sobol::Stream;
use halflight::render::Discretization;
use halflight::scene::{Material, Scene};
use halflight::surfaces::SurfacePoint;

use crate::common::{Facing, Mesh, grey, light_by_area, lights, mean_and_error};

/// Estimates of one kind, and how many times its mean their standard deviation may be.
struct Estimates {
    kind: &'static str,
    values: Vec<f64>,
}

/// One sample after the other, as vertices of paths take them, and single draws by a cut of the receiver's own.
fn estimates(lights: &Lights, patch: u32, receiver: &SurfacePoint) -> [Estimates; 2] {
    const COUNT: usize = 4096;
    let (mut random, mut scratch) = (Stream::new(7 ^ patch), Scratch::default());
    let samples = (0..COUNT).map(|_| lights.sample(receiver, patch, &mut random, &mut scratch).x).collect();
    let cuts = lights.cuts_at(receiver);
    let mut own = || {
        let (mut sum, drawn) = (LightSum::default(), Vec2::new(random.uniform(), random.uniform()));
        // Points that hold for one draw shift along for others.
        let draw = |Choice { k, .. }: Choice| (drawn + Vec2::new(0.618, 0.755) * k as f32).fract();
        lights.add(&mut sum, (receiver, cuts.cuts(), DVec3::ONE), 1, draw, &mut scratch);
        sum.total().x
    };
    let own = (0..COUNT).map(|_| own()).collect();
    [Estimates { kind: "sample", values: samples }, Estimates { kind: "own cut", values: own }]
}

/// Both ways to shadows: cut out where they can be, and by rays alone.
fn both(p: &Discretization, mode: Mode) -> [Lights; 2] {
    let transports = p.transports(mode.transport());
    [lights(p, mode.transport()), Lights::by_rays(&p.geometry, &p.patches, &p.luminaires, transports)]
}

/// Checks that estimates have the mean `exact`, and a standard deviation of no more than `most` times that.
fn assert_unbiased(lights: &Lights, patch: usize, receiver: &SurfacePoint, exact: f64, most: f64) {
    for Estimates { kind, values } in estimates(lights, patch as u32, receiver) {
        let (mean, error) = mean_and_error(&values);
        let off = (mean - exact).abs();
        // What moments leave, and roundings of places to single precision.
        assert!(off <= 5.0 * error + 1e-4 * exact + 1e-6, "{kind}, {patch}: {mean} ± {error}, {exact}");
        let deviation = error * (values.len() as f64).sqrt();
        assert!(deviation <= most * exact + 1e-6, "{kind}, {patch}: {deviation} of {exact}");
    }
}

/// The patches of a material, and a point of each in its middle.
fn receivers(p: &Discretization, material: u32) -> impl Iterator<Item = (usize, SurfacePoint)> {
    let own = (0..p.patches.len()).filter(move |&i| p.patches.materials()[i] == material);
    own.map(|i| (i, p.patches.point(i, 0.45, 0.6)))
}

/// The form factor of a rectangle: a corner, and two edges from it, turning to the left as seen from its front.
fn form(x: &SurfacePoint, [corner, u, v]: [DVec3; 3]) -> f64 {
    let n = x.normal.as_dvec3();
    let at = |s: f64, t: f64| corner + s * u + t * v - x.position.as_dvec3();
    point_to_polygon(n, &[at(0., 0.), at(1., 0.), at(1., 1.)])
        + point_to_polygon(n, &[at(0., 0.), at(1., 1.), at(0., 1.)])
}

/// A luminous wall behind a skirting of a hundred boards: more faces than are cut out, and what they hide from the
/// floor is the near part, from which by area next to no point is drawn.
#[test]
fn a_near_luminaire_whose_near_part_is_hidden() {
    let at = DVec3::new;
    let (wide, high, board, gap) = (4.0, 3.0, 0.5, 0.02);
    let mut mesh = Mesh::default();
    mesh.polygon(&[at(-1., 0., 0.1), at(-1., 0., 2.), at(1., 0., 2.), at(1., 0., 0.1)], 0);
    mesh.polygon(&[at(-wide, 0., 0.), at(wide, 0., 0.), at(wide, high, 0.), at(-wide, high, 0.)], 1);
    for k in 0..100 {
        let [a, b] = [k, k + 1].map(|k| wide * (f64::from(k) / 50.0 - 1.0));
        mesh.polygon(&[at(a, 0., gap), at(b, 0., gap), at(b, board, gap), at(a, board, gap)], 2);
    }
    let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
    let p = Solver::new(&mesh.scene(vec![grey("floor", 0.5), glow, grey("board", 0.5)])).cut(60);
    let frame = p.geometry.scene.frame;
    for lights in both(&p, Mode::OneBounce) {
        for (patch, receiver) in receivers(&p, 0).step_by(5) {
            let z = (receiver.position.as_dvec3() / frame.scale + frame.center).z;
            let lowest = board * z / (z - gap);
            let corners = [at(-wide, lowest, 0.), at(wide, lowest, 0.), at(-wide, high, 0.)].map(|p| frame.to_unit(p));
            let exact = form(&receiver, [corners[0], corners[1] - corners[0], corners[2] - corners[0]]);
            assert_unbiased(&lights, patch, &receiver, exact, 3.0);
        }
    }
}

/// A panel a millimetre before a wall, which its front faces, and a ball of 1,280 faces that nearly touches it.
#[test]
fn luminaires_that_nearly_touch_what_they_light() {
    let at = DVec3::new;
    for ball in [false, true] {
        let mut mesh = Mesh::default();
        let middle = at(0.0, 0.0, -0.31);
        mesh.polygon(&[at(-1., -1., 0.), at(-1., 1., 0.), at(1., 1., 0.), at(1., -1., 0.)].map(|p| p - middle), 0);
        match ball {
            true => mesh.sphere(0.3, 3, Facing::Out, 1),
            false => {
                let panel = [at(-0.2, -0.2, -1e-3), at(0.2, -0.2, -1e-3), at(0.2, 0.2, -1e-3), at(-0.2, 0.2, -1e-3)];
                mesh.polygon(&panel.map(|p| p - middle), 1);
            }
        }
        let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
        let p = Solver::new(&mesh.scene(vec![grey("wall", 0.5), glow])).cut(100);
        for lights in both(&p, Mode::OneBounce) {
            for (patch, receiver) in receivers(&p, 0).step_by(7) {
                let (x, n) = (receiver.position, receiver.normal);
                let exact: f64 = p.luminaires.list.iter().map(|l| l.exact_form(x, n)).sum();
                assert_unbiased(&lights, patch, &receiver, exact, 4.0);
            }
        }
    }
}

/// A screen of 64² texels of which one shines, half of it behind a baffle: the black ones say nothing of what it
/// lights.
#[test]
fn a_screen_of_which_one_texel_shines() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut texels = image::RgbImage::new(64, 64);
    texels.put_pixel(40, 30, image::Rgb([255; 3]));
    texels.save(folder.path().join("screen.png")).expect("an image");
    std::fs::write(
        folder.path().join("a.mtl"),
        "newmtl floor\nKd .5 .5 .5\nnewmtl screen\nKd 0 0 0\nKe 1 1 1\nmap_Ke screen.png\n",
    )
    .expect("written");
    let mut obj =
        "mtllib a.mtl\nv -1 0 0\nv -1 0 2\nv 1 0 2\nv 1 0 0\nv -1 .5 0\nv 1 .5 0\nv 1 2 0\nv -1 2 0\n".to_owned();
    obj += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl floor\nf 1 2 3 4\nusemtl screen\nf 5/1 6/2 7/3 8/4\nusemtl floor\n";
    // Forty strips that stand off the screen hide some places of the floor from the texel.
    for k in 0..40 {
        let x = 0.05 * f64::from(k) - 1.0;
        obj += &format!("v {x} .5 .3\nv {} .5 .3\nv {} 1.2 .3\nv {x} 1.2 .3\n", x + 0.025, x + 0.025);
        obj += "f -4 -3 -2 -1\n";
    }
    std::fs::write(folder.path().join("a.obj"), obj).expect("written");
    let scene = Scene::open(folder.path().join("a.obj").to_str().expect("a name")).expect("a scene");
    let p = Solver::new(&scene).cut(80);
    let mut lit = 0;
    for lights in both(&p, Mode::OneBounce) {
        for (patch, receiver) in receivers(&p, 0).filter(|(_, x)| x.normal.y > 0.9).step_by(4) {
            let (mut random, mut hits) = (Stream::new(patch as u32), Vec::new());
            let by_area: Vec<f64> =
                (0..1 << 17).map(|_| light_by_area(&lights, &receiver, &mut random, &mut hits).x).collect();
            let (exact, of_exact) = mean_and_error(&by_area);
            for Estimates { kind, values } in estimates(&lights, patch as u32, &receiver) {
                let (mean, error) = mean_and_error(&values);
                let allowed = 5.0 * error.hypot(of_exact) + 1e-9;
                assert!((mean - exact).abs() <= allowed, "{kind}, {patch}: {mean} {exact} {allowed}");
                // By area one point in a thousand finds the texel.
                assert!(error * 64.0 <= 4.0 * exact.max(of_exact * 8.0) + 1e-9, "{kind}, {patch}: {error} {exact}");
            }
            lit += u32::from(exact > 0.0);
        }
    }
    assert!(lit > 4, "{lit}");
}

/// A box in a room under two thousand lamps, and one under a few.
#[test]
fn among_two_thousand_lamps() {
    let at = DVec3::new;
    for side in [3, 45] {
        let mut mesh = Mesh::default();
        mesh.cuboid(DVec3::ZERO, at(2., 2., 1.2), DQuat::IDENTITY, Facing::In, 0);
        mesh.cuboid(at(0.3, 0.1, -0.5), at(0.4, 0.5, 0.6), DQuat::from_rotation_z(0.4), Facing::Out, 0);
        let step = 3.8 / f64::from(side);
        for (i, j) in (0..side * side).map(|k| (f64::from(k % side), f64::from(k / side))) {
            let (x, y, z, a) = (step * i - 1.9, step * j - 1.9, 1.18, 0.4 * step);
            mesh.polygon(&[at(x, y, z), at(x, y + a, z), at(x + a, y + a, z), at(x + a, y, z)], 1);
        }
        let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
        let p = Solver::new(&mesh.scene(vec![grey("wall", 0.5), glow])).cut(150);
        assert_eq!(p.luminaires.list.len(), (side * side) as usize);
        for lights in both(&p, Mode::OneBounce) {
            for (patch, receiver) in receivers(&p, 0).step_by(41) {
                let (mut random, mut hits) = (Stream::new(patch as u32), Vec::new());
                let count = 400_000 / (side * side);
                let by_area: Vec<f64> =
                    (0..count).map(|_| light_by_area(&lights, &receiver, &mut random, &mut hits).x).collect();
                let (exact, of_exact) = mean_and_error(&by_area);
                for Estimates { kind, values } in estimates(&lights, patch as u32, &receiver) {
                    let (mean, error) = mean_and_error(&values);
                    // What moments leave of third order.
                    let allowed = 5.0 * error.hypot(of_exact) + 2e-3 * exact;
                    assert!((mean - exact).abs() <= allowed, "{kind}, {patch} of {side}: {mean} {exact} {allowed}");
                }
            }
        }
    }
}
