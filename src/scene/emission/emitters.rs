//! The emitters of a scene by name: every object or material that emits, the sky, and each punctual light.
//!
//! Light is linear in E. With E the sum of the emitters' own, L is the sum of `(I - K)^-1 E_e`, and each of them may be
//! kept apart from the same rays.
//!
//! The emitting faces of one object and material are one emitter. It has the object's name; the material's where an
//! object has several that emit, or the scene has one object. Punctual lights have the names that the file gives
//! them, others are numbered. Not handled: names that are taken to be the same but for case.

use std::collections::HashMap;
use std::sync::Arc;

use crate::pictures::{spaced, unlike};
use crate::scene::model::Scene;

/// The emitters of a scene that are kept apart; all in one where nobody asked for that.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Emitters {
    names: Vec<String>,
    /// Of every object and material that emit.
    of: HashMap<(u32, u32), u16>,
    /// Of every punctual light, of those that shine or not.
    of_lights: Vec<u16>,
}

/// Emitters kept apart at most.
pub const MOST_EMITTERS: usize = 1 << 10;

impl Emitters {
    /// All that emits as one.
    pub fn together() -> Arc<Emitters> {
        Arc::default()
    }

    /// Every emitter of a scene apart, in the order of its faces, then its lights; the last stands for all that are
    /// more than [`MOST_EMITTERS`].
    pub fn of(scene: &Scene) -> Arc<Emitters> {
        let mut emitters = Emitters::default();
        let (mut keys, mut known) = (Vec::new(), HashMap::new());
        for face in scene.faces.iter().filter(|face| scene.materials[face.material as usize].emits()) {
            // All cells of a sky are one.
            let material = if scene.is_sky_material(face.material as usize) { u32::MAX } else { face.material };
            let key = (face.object, material);
            let number = *known.entry(key).or_insert_with(|| {
                keys.push(key);
                keys.len().min(MOST_EMITTERS) as u16 - 1
            });
            emitters.of.entry((face.object, face.material)).or_insert(number);
        }
        let mut names: Vec<String> = keys.iter().take(MOST_EMITTERS).map(|key| name(scene, &keys, *key)).collect();
        for (k, light) in scene.lights.iter().enumerate() {
            if names.len() < MOST_EMITTERS {
                names.push(light.name.clone().unwrap_or_else(|| format!("light {}", k + 1)));
            }
            emitters.of_lights.push(names.len() as u16 - 1);
        }
        emitters.names = unlike(names, spaced);
        Arc::new(emitters)
    }

    /// How many are kept apart; 1 where all are together.
    pub fn count(&self) -> usize {
        self.names.len().max(1)
    }

    /// Whether they are kept apart.
    pub fn are_apart(&self) -> bool {
        !self.names.is_empty()
    }

    /// Their names; none where all are together.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The emitter that a face belongs to; the first where it emits nothing.
    pub fn of_face(&self, scene: &Scene, face: u32) -> usize {
        let face = &scene.faces[face as usize];
        self.of.get(&(face.object, face.material)).map_or(0, |&e| e.into())
    }

    /// The emitter that light number k of the scene is.
    pub fn of_light(&self, k: usize) -> usize {
        self.of_lights.get(k).map_or(0, |&e| e.into())
    }
}

/// The name of an object's and material's faces, among all that emit.
fn name(scene: &Scene, keys: &[(u32, u32)], (object, material): (u32, u32)) -> String {
    let among = keys.iter().filter(|key| key.0 == object).count();
    let of_object = &scene.objects[object as usize];
    match scene.materials.get(material as usize) {
        Some(material) if scene.solid_objects() <= 1 || of_object.is_empty() => material.name.clone(),
        Some(material) if among > 1 => format!("{of_object} {}", material.name),
        _ => of_object.clone(),
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::light::Rgb;
    use crate::scene::{Material, PunctualForm, PunctualLight, SkyLight};

    #[test]
    fn objects_materials_the_sky_and_lights_have_names() {
        let mut scene = Scene::open("cornell-box").expect("a scene");
        assert_eq!(Emitters::of(&scene).names(), ["light"]);
        assert!(!Emitters::together().are_apart() && Emitters::together().count() == 1);
        let form = PunctualForm::Directional { direction: DVec3::NEG_Y };
        let light = |name: Option<&str>| PunctualLight {
            form: form.clone(),
            intensity: Rgb::ONE,
            name: name.map(str::to_owned),
        };
        scene.lights = vec![light(Some("sun")), light(None), light(Some("light"))];
        scene.set_sky(SkyLight { upper: Rgb::ONE, lower: Rgb::splat(0.5) }, DVec3::Y);
        let emitters = Emitters::of(&scene);
        assert_eq!(emitters.names(), ["light", "sky", "sun", "light 2", "light 3"]);
        assert_eq!([0, 1, 2].map(|k| emitters.of_light(k)), [2, 3, 4]);
        let last = scene.faces.len() as u32 - 1;
        assert_eq!([last, last - 1].map(|face| emitters.of_face(&scene, face)), [1, 1]);
        // Two emitters of one object are told apart by their materials.
        let mut scene = Scene::open("cornell-box").expect("a scene");
        let object = scene.faces[0].object;
        for (k, name) in ["red", "blue"].into_iter().enumerate() {
            scene.faces[k] = crate::scene::Face { material: scene.materials.len() as u32, object, ..scene.faces[k] };
            scene.materials.push(Material::new(name, Rgb::ZERO, Rgb::ONE));
        }
        let own = scene.objects[object as usize].clone();
        assert_eq!(Emitters::of(&scene).names()[..2], [format!("{own} red"), format!("{own} blue")]);
    }
}
