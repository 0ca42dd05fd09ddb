//! Attributes of a primitive's vertices beside positions and texture coordinates: colours, and normals that ask for
//! smooth shading.
//!
//! `COLOR_0` is linear, RGB or RGBA, as floats or normalised integers; numbers outside 0..1 are clamped, and named
//! among what is ignored.
//!
//! Not handled: what normals say; faces are flat, and [`Ignored`] names the nodes whose normals differ within a face.

use glam::{DVec3, Vec4};
use gltf_json::accessor::Type;
use gltf_json::mesh::{Primitive, Semantic};
use gltf_json::validation::Checked;

use crate::scene::gltf::accessors::Data;
use crate::scene::gltf::ignored::Ignored;

/// How far normals of a triangle's corners may lie apart to be one.
const ONE_NORMAL: f64 = 1e-3;

/// The colours of a primitive's vertices, where it has any: linear RGB and alpha, in 0..=1.
pub(super) fn colours(
    data: &Data,
    primitive: &Primitive,
    count: usize,
    ignored: &mut Ignored,
    object: &str,
) -> Result<Option<Vec<Vec4>>, String> {
    let further = |key: &Checked<Semantic>| matches!(key, Checked::Valid(Semantic::Colors(set)) if *set > 0);
    if primitive.attributes.keys().any(further) {
        ignored.add("further colours of vertices, of nodes", object);
    }
    let Some(index) = primitive.attributes.get(&Checked::Valid(Semantic::Colors(0))) else { return Ok(None) };
    let parts = match data.root.accessors[index.value()].type_ {
        Checked::Valid(Type::Vec4) => Type::Vec4,
        _ => Type::Vec3,
    };
    let numbers = data.numbers(*index, parts)?;
    let size = parts.multiplicity();
    if numbers.len() < size * count {
        return Err(format!("accessor {index} has {} colours for {count} vertices", numbers.len() / size));
    }
    if numbers.iter().any(|number| !(0.0..=1.0).contains(number)) {
        ignored.add("what of colours of vertices is outside 0..1, of nodes", object);
    }
    // A number that is none counts as 0.
    let part = |number: f64| number.clamp(0.0, 1.0).max(0.0) as f32;
    let colour = |c: &[f64]| Vec4::new(part(c[0]), part(c[1]), part(c[2]), c.get(3).map_or(1.0, |alpha| part(*alpha)));
    Ok(Some(numbers.chunks_exact(size).map(colour).collect()))
}

/// Whether the normals of a primitive's vertices differ within a triangle; `corners` has the vertices of all triangles.
pub(super) fn is_smooth(data: &Data, primitive: &Primitive, corners: impl Iterator<Item = [u32; 3]>) -> bool {
    let Some(index) = primitive.attributes.get(&Checked::Valid(Semantic::Normals)) else { return false };
    let Ok(numbers) = data.numbers(*index, Type::Vec3) else { return false };
    let at = |vertex: u32| numbers.get(3 * vertex as usize..3 * vertex as usize + 3).map(DVec3::from_slice);
    let differ = |a: Option<DVec3>, b: Option<DVec3>| a.zip(b).is_some_and(|(a, b)| a.distance(b) > ONE_NORMAL);
    corners.into_iter().any(|[a, b, c]| differ(at(a), at(b)) || differ(at(a), at(c)))
}
