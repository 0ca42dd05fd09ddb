//! What F depends on, and what it does not, as sums and numbers that two runs can compare.
//!
//! The geometry is every bit of it that rays and patches are made of. Of the patches the sum goes over what they came
//! out as, so that whatever might cut them otherwise shows. A material counts as far as rays feel it: its sides, its
//! mask, its tau. What it reflects and emits is kept to name what has changed.
//!
//! Not handled: units, which F does not feel; names of objects.

use serde::{Deserialize, Serialize};

use crate::kept::sums::Sum;
use halflight::light::Transport;
use halflight::patches::Patches;
use halflight::rays::Side;
use halflight::scene::textures::{Mask, Texture};
use halflight::scene::{Material, Scene, Sides};

/// What rays can meet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometryIdentity {
    /// The scene's name, which may differ.
    pub name: String,
    pub vertices: usize,
    pub faces: usize,
    pub sum: String,
}

/// The patches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchIdentity {
    /// About how many were requested.
    pub requested: usize,
    pub count: usize,
    pub sum: String,
}

/// A material in a mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialIdentity {
    pub name: String,
    pub faces: usize,
    pub two_sided: bool,
    pub mask: Option<String>,
    pub tau: f32,
    /// Its own alpha, where it has one; that of the others is the mode's.
    pub alpha: Option<f32>,
    pub rho: [f32; 3],
    pub emission: [f32; 3],
    /// Its textures but the mask.
    pub textures: Option<String>,
}

impl GeometryIdentity {
    /// That of a scene.
    pub fn of(scene: &Scene) -> GeometryIdentity {
        let mut sum = Sum::new();
        scene.vertices.iter().for_each(|v| sum.vector(*v));
        for face in &scene.faces {
            face.vertices.iter().chain([&face.material]).for_each(|&number| sum.number(number.into()));
        }
        scene.exact.iter().flatten().for_each(|corner| sum.long_vector(*corner));
        if scene.materials.iter().any(Material::is_masked) {
            scene.coordinates.iter().flatten().for_each(|at| sum.vector(at.extend(0.0)));
            scene.colours.iter().flatten().for_each(|colour| sum.number(colour.w.to_bits().into()));
        }
        if let Some(sky) = scene.sky {
            sum.vector(sky.up);
            sum.number(sky.first.into());
            sum.number(sky.radius.to_bits());
        }
        let (vertices, faces) = (scene.vertices.len(), scene.faces.len());
        GeometryIdentity { name: scene.name.clone(), vertices, faces, sum: sum.digits() }
    }

    /// How that of a scene now differs from this one.
    pub fn difference(&self, now: &GeometryIdentity) -> Option<String> {
        if (self.vertices, self.faces) != (now.vertices, now.faces) {
            return Some(format!(
                "it is of another geometry ({}: {} vertices, {} faces; now {}: {} vertices, {} faces)",
                self.name, self.vertices, self.faces, now.name, now.vertices, now.faces
            ));
        }
        let moved =
            || format!("it is of another geometry ({}): as many faces as {} has, in other places", self.name, now.name);
        (self.sum != now.sum).then(moved)
    }
}

/// The sum over all that patches are.
pub fn sum_of_patches(patches: &Patches) -> String {
    let mut sum = Sum::new();
    sum.number(patches.size().to_bits());
    for i in 0..patches.len() {
        let (back, whole) = (patches.side(i) == Side::Back, patches.whole(i as u32));
        for number in [u32::from(back), whole, patches.materials()[i], patches.parents()[i]] {
            sum.number(number.into());
        }
        sum.number(patches.areas()[i].to_bits());
        for point in patches.chosen(i) {
            sum.number(point.face.into());
            sum.vector(point.position);
            sum.vector(point.normal);
        }
        if whole as usize == i {
            for (face, corners) in patches.pieces(i) {
                sum.number(face.into());
                corners.iter().for_each(|corner| sum.vector(*corner));
            }
        }
    }
    sum.digits()
}

/// The materials of a scene, in order, under (alpha, tau) of each.
pub fn materials(scene: &Scene, transports: &[Transport]) -> Vec<MaterialIdentity> {
    let mut faces = vec![0; scene.materials.len()];
    scene.faces.iter().for_each(|face| faces[face.material as usize] += 1);
    let one = |((material, transport), faces): ((&Material, &Transport), usize)| MaterialIdentity {
        name: material.name.clone(),
        faces,
        two_sided: material.sides == Sides::Two,
        mask: material.mask().map(|mask| {
            let mut sum = Sum::new();
            add_mask(&mut sum, mask);
            sum.number(u64::from(material.maps.as_ref().is_some_and(|maps| maps.vertex_colours)));
            sum.digits()
        }),
        tau: transport.tau,
        alpha: material.alpha,
        rho: material.rho.to_array(),
        emission: material.emission.to_array(),
        textures: textures(material),
    };
    scene.materials.iter().zip(transports).zip(faces).map(one).collect()
}

fn textures(material: &Material) -> Option<String> {
    let maps = material.maps.as_ref()?;
    let mut sum = Sum::new();
    for texture in [&maps.reflectance, &maps.emission] {
        sum.number(u64::from(texture.is_some()));
        texture.iter().for_each(|texture| add_texture(&mut sum, texture));
    }
    sum.number(u64::from(maps.vertex_colours));
    Some(sum.digits())
}

fn add_mask(sum: &mut Sum, mask: &Mask) {
    sum.bytes(format!("{:?} {:?} {:?}", mask.channel, mask.factor, mask.cutoff).as_bytes());
    mask.texture.iter().for_each(|texture| add_texture(sum, texture));
    sum.number(mask.over.len() as u64);
    mask.over.iter().for_each(|mask| add_mask(sum, mask));
}

fn add_texture(sum: &mut Sum, texture: &Texture) {
    sum.bytes(format!("{:?} {:?} {:?}", texture.placement, texture.wrap, texture.filter).as_bytes());
    let texels = texture.image.texels();
    [texels.width, texels.height, texels.channels].iter().for_each(|n| sum.number(*n as u64));
    sum.bytes(&texels.codes);
}

/// How materials differ where rays feel it: the first that does.
pub fn felt_difference(kept: &[MaterialIdentity], now: &[MaterialIdentity]) -> Option<String> {
    if kept.len() != now.len() {
        return Some(format!("it is of {} materials, and now there are {}", kept.len(), now.len()));
    }
    let first = |(kept, now): (&MaterialIdentity, &MaterialIdentity)| {
        let name = &now.name;
        let sides = |two: bool| if two { "two" } else { "one" };
        if kept.two_sided != now.two_sided {
            let [kept, now] = [kept, now].map(|m| sides(m.two_sided));
            return Some(format!("material {name} reflected on {kept} of its sides, and now on {now}"));
        }
        if kept.mask != now.mask {
            return Some(format!("material {name} has another mask"));
        }
        (kept.tau != now.tau && now.faces > 0)
            .then(|| format!("it is of tau {} (material {name}), and now tau is {}", kept.tau, now.tau))
    };
    kept.iter().zip(now).find_map(first)
}

/// What differs that F does not depend on, named.
pub fn unfelt_differences(kept: &[MaterialIdentity], now: &[MaterialIdentity]) -> Vec<String> {
    let mut found = Vec::new();
    for (kept, now) in kept.iter().zip(now) {
        let parts = [
            ("name", kept.name != now.name),
            ("reflectance", kept.rho != now.rho),
            ("emission", kept.emission != now.emission),
            ("textures", kept.textures != now.textures),
            ("alpha", kept.alpha != now.alpha),
        ];
        let own: Vec<&str> = parts.iter().filter(|part| part.1).map(|part| part.0).collect();
        if !own.is_empty() {
            found.push(format!("material {} ({})", now.name, own.join(", ")));
        }
    }
    found
}
