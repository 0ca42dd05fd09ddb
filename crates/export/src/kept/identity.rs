//! What F depends on beside tau and the rays: the geometry, the sides and masks of materials, and the patches.
//!
//! Not handled: what surfaces reflect and emit, lights and the camera, which F does not depend on.

use glam::{DVec3, Vec2, Vec3, Vec4};
use serde::Serialize;
use twox_hash::XxHash3_128;

use crate::kept::meta::FORMAT;
use halflight::light::Transport;
use halflight::patches::Patches;
use halflight::rays::Side;
use halflight::scene::{Material, Scene, Sides, Sky};

/// What rays meet.
#[derive(PartialEq, Serialize)]
struct Shape<'a> {
    vertices: &'a [Vec3],
    /// Vertices and material of each face.
    faces: Vec<([u32; 3], u32)>,
    exact: &'a [[DVec3; 3]],
    sky: Option<&'a Sky>,
    /// Of the corners of faces, where masks go by them.
    coordinates: Option<&'a [[Vec2; 3]]>,
    colours: Option<&'a [[Vec4; 3]]>,
}

impl Shape<'_> {
    fn of(scene: &Scene) -> Shape<'_> {
        let masked = scene.materials.iter().any(|material| mask(material).is_some());
        Shape {
            vertices: &scene.vertices,
            faces: scene.faces.iter().map(|face| (face.vertices, face.material)).collect(),
            exact: &scene.exact,
            sky: scene.sky.as_ref(),
            coordinates: masked.then_some(&scene.coordinates),
            colours: masked.then_some(&scene.colours),
        }
    }
}

/// Where the surface of a material is: its mask, and whether that goes by vertices too.
fn mask(material: &Material) -> Option<impl PartialEq + Serialize + '_> {
    material.maps.as_ref().and_then(|maps| Some((maps.mask.as_ref()?, maps.vertex_colours)))
}

/// The first difference between a scene in a mode as it was kept and as it is now that F depends on.
pub fn difference((kept, before): (&Scene, Transport), (now, mode): (&Scene, Transport)) -> Option<String> {
    let sizes = |scene: &Scene| (scene.vertices.len(), scene.faces.len(), scene.materials.len());
    if sizes(kept) != sizes(now) {
        let words = |scene: &Scene| {
            let (vertices, faces, materials) = sizes(scene);
            format!("{}: {vertices} vertices, {faces} faces, {materials} materials", scene.name)
        };
        return Some(format!("it is of another geometry ({}; now {})", words(kept), words(now)));
    }
    if Shape::of(kept) != Shape::of(now) {
        let (kept, now) = (&kept.name, &now.name);
        return Some(format!("it is of another geometry ({kept}): as many faces as {now} has, in other places"));
    }
    let materials = kept.materials.iter().zip(&now.materials);
    let taus = kept.transports(before).into_iter().zip(now.transports(mode)).map(|(kept, now)| (kept.tau, now.tau));
    materials.zip(taus).find_map(|((kept, now), (before, tau))| {
        let name = &now.name;
        if kept.sides != now.sides {
            let [kept, now] = [kept, now].map(|m| if m.sides == Sides::Two { "two" } else { "one" });
            return Some(format!("material {name} reflected on {kept} of its sides, and now on {now}"));
        }
        if mask(kept) != mask(now) {
            return Some(format!("material {name} has another mask"));
        }
        (before != tau).then(|| format!("it is of tau {before} (material {name}), and now tau is {tau}"))
    })
}

/// A sum over a scene and its patches, so far as F depends on them, and the program's version: 32 hexadecimal digits of
/// XXH3. Of the patches it goes over what they came out as, so that whatever might cut them otherwise shows.
pub fn sum(scene: &Scene, patches: &Patches) -> String {
    let mut sum = XxHash3_128::new();
    add(&mut sum, &(FORMAT, env!("CARGO_PKG_VERSION"), Shape::of(scene), patches.size()));
    scene.materials.iter().for_each(|material| add(&mut sum, &(material.sides, mask(material))));
    for i in 0..patches.len() {
        let (back, whole) = (patches.side(i) == Side::Back, patches.whole(i as u32));
        add(&mut sum, &(back, whole, patches.materials()[i], patches.parents()[i], patches.areas()[i]));
        let chosen = patches.chosen(i).iter().map(|point| (point.face, point.position, point.normal));
        add(&mut sum, &chosen.collect::<Vec<_>>());
        if whole as usize == i {
            add(&mut sum, &patches.pieces(i).collect::<Vec<_>>());
        }
    }
    digits(&sum)
}

/// A sum over some values.
pub fn sum_of(values: &impl Serialize) -> String {
    let mut sum = XxHash3_128::new();
    add(&mut sum, values);
    digits(&sum)
}

fn add(sum: &mut XxHash3_128, values: &impl Serialize) {
    sum.write(&postcard::to_stdvec(values).expect("numbers, texts and lists only"));
}

fn digits(sum: &XxHash3_128) -> String {
    format!("{:032x}", sum.finish_128())
}
