//! Triangles of a glTF scene: the meshes at its nodes, placed in the world.
//!
//! Lists, strips and fans are read, with indices or without. Where the determinant of a node's transform is negative
//! corners are taken the other way round, so that fronts stay fronts (glTF 2.0, 3.7.4). Meshes at several nodes are
//! written out once for each, which [`MOST_INSTANCED`] bounds. `COLOR_0` is linear, RGB or RGBA, as floats or
//! normalised integers; numbers outside 0..1 are clamped, and named among what is ignored.
//!
//! Not handled: points and lines, smooth normals, skins, morph targets (each ignored with a warning).

use std::collections::{HashMap, HashSet};

use glam::{DVec3, Vec2, Vec4};
use gltf_json::accessor::Type;
use gltf_json::mesh::{Mesh, Mode, Primitive, Semantic};
use gltf_json::validation::Checked;
use gltf_json::{Accessor, Index};

use crate::scene::gltf::accessors::Data;
use crate::scene::gltf::document::{Ignored, name};
use crate::scene::gltf::nodes::Placed;
use crate::scene::soup::{Polygon, Soup};

/// Points and corners that a scene may have by repeating its meshes, whatever its size.
const MOST_INSTANCED: usize = 1 << 25;

/// Points and corners that a scene may have for each byte of its buffers: a strip of bytes makes three each.
const CORNERS_A_BYTE: usize = 4;

/// Texture coordinates beyond this are not taken for such: single precision resolves texels no more.
const FARTHEST: f32 = 1e6;

/// How far normals of a triangle's corners may lie apart to be one.
const ONE_NORMAL: f64 = 1e-3;

/// What is being read.
pub(super) struct Geometry<'a> {
    pub data: &'a Data<'a>,
    pub soup: &'a mut Soup,
    pub ignored: &'a mut Ignored,
    /// The set of texture coordinates that each material goes by, if it has textures.
    pub sets: &'a [Option<u32>],
}

impl Geometry<'_> {
    /// Appends the meshes of all nodes to the soup, each node as an object.
    pub(super) fn take(&mut self, nodes: &[Placed]) -> Result<(), String> {
        self.check_size(nodes)?;
        for placed in nodes {
            let Some(mesh) = placed.node.mesh else { continue };
            let mesh = &self.data.root.meshes[mesh.value()];
            let given = placed.node.name.as_ref().or(mesh.name.as_ref());
            let object = name(&given.cloned(), "node", placed.number);
            if placed.node.skin.is_some() {
                self.ignored.add("skins of nodes", &object);
            }
            let mut points = HashMap::new();
            for primitive in &mesh.primitives {
                if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
                    self.ignored.add("morph targets of nodes", &object);
                }
                if triangles(primitive, 0).is_none() {
                    self.ignored.add("points and lines of nodes", &object);
                    continue;
                }
                self.primitive(primitive, placed, &object, &mut points)
                    .map_err(|what| format!("node `{object}`: {what}"))?;
            }
            self.soup.objects.push(object);
        }
        if !self.soup.colours.is_empty() {
            self.soup.colours.resize(self.soup.corners.len(), Vec4::NAN);
        }
        Ok(())
    }

    /// Appends a primitive of triangles. `points` has where the points of each accessor begin that the node has used
    /// before.
    fn primitive(
        &mut self,
        primitive: &Primitive,
        placed: &Placed,
        object: &str,
        points: &mut HashMap<usize, (usize, usize)>,
    ) -> Result<(), String> {
        let Some(position) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else { return Ok(()) };
        let (first, count) = match points.get(&position.value()) {
            Some(known) => *known,
            None => *points.entry(position.value()).or_insert(self.points(*position, placed)?),
        };
        let corners = self.corners(primitive, count)?;
        let order = triangles(primitive, corners.len()).unwrap_or_default();
        let mirrored = placed.to_world.determinant() < 0.0;
        let material = primitive.material.map_or(self.soup.materials.len() - 1, |material| material.value()) as u32;
        let coordinates = self.coordinates(primitive, material, count)?;
        let colours = colours(self.data, primitive, count, self.ignored, object)?;
        if is_smooth(self.data, primitive, order.iter().map(|triangle| triangle.map(|corner| corners[corner]))) {
            self.ignored.add("smooth normals (faces are flat), of nodes", object);
        }
        let object = self.soup.objects.len() as u32;
        for [a, b, c] in order {
            let turned = if mirrored { [a, c, b] } else { [a, b, c] };
            self.soup.corners.extend(turned.map(|corner| first as u32 + corners[corner]));
            if let Some(coordinates) = &coordinates {
                let at = |corner: usize| coordinates.get(corners[corner] as usize).copied().unwrap_or_default();
                self.soup.coordinates.extend(turned.map(at));
            }
            if let Some(colours) = &colours {
                self.soup.colours.resize(self.soup.corners.len() - 3, Vec4::NAN);
                let at = |corner: usize| colours.get(corners[corner] as usize).copied().unwrap_or(Vec4::NAN);
                self.soup.colours.extend(turned.map(at));
            }
            let number = self.soup.polygons.len();
            self.soup.polygons.push(Polygon { corners: 3, material, object, number });
        }
        Ok(())
    }

    /// Texture coordinates of a primitive's vertices, empty where it has or needs none; none in a scene without
    /// textures.
    fn coordinates(&mut self, primitive: &Primitive, material: u32, count: usize) -> Result<Option<Vec<Vec2>>, String> {
        if self.sets.iter().all(Option::is_none) {
            return Ok(None);
        }
        let Some(set) = self.sets[material as usize] else { return Ok(Some(Vec::new())) };
        let Some(index) = primitive.attributes.get(&Checked::Valid(Semantic::TexCoords(set))) else {
            self.ignored
                .add("textures without coordinates, of materials", &self.soup.materials[material as usize].name);
            return Ok(Some(Vec::new()));
        };
        let numbers = self.data.numbers(*index, Type::Vec2)?;
        if numbers.len() < 2 * count {
            return Err(format!("accessor {index} has {} texture coordinates for {count} vertices", numbers.len() / 2));
        }
        let place = |at: &[f64]| {
            let at = Vec2::new(at[0] as f32, at[1] as f32);
            if at.abs().max_element() <= FARTHEST { at } else { Vec2::ZERO }
        };
        Ok(Some(numbers.chunks_exact(2).map(place).collect()))
    }

    /// Appends the points of an accessor; where they begin, and how many they are.
    fn points(&mut self, position: Index<Accessor>, placed: &Placed) -> Result<(usize, usize), String> {
        let numbers = self.data.numbers(position, Type::Vec3)?;
        let (first, count) = (self.soup.vertices.len(), numbers.len() / 3);
        let world = |p: &[f64]| placed.to_world.transform_point3(DVec3::from_slice(p));
        self.soup.vertices.extend(numbers.chunks_exact(3).map(world));
        match self.soup.vertices[first..].iter().position(|point| !point.is_finite()) {
            None => Ok((first, count)),
            Some(wrong) => Err(format!("vertex {wrong} of accessor {position} is not finite")),
        }
    }

    /// The numbers of the vertices that the primitive's corners are.
    fn corners(&self, primitive: &Primitive, count: usize) -> Result<Vec<u32>, String> {
        let Some(index) = primitive.indices else { return Ok((0..count as u32).collect()) };
        let numbers = self.data.numbers(index, Type::Scalar)?;
        match numbers.iter().find(|number| !(0.0..count as f64).contains(*number) || number.fract() != 0.0) {
            None => Ok(numbers.into_iter().map(|number| number as u32).collect()),
            Some(wrong) => Err(format!("accessor {index}: index {wrong}, but there are {count} vertices")),
        }
    }

    /// Refuses scenes whose points and corners would be more than allowed, before any of them is read.
    fn check_size(&self, nodes: &[Placed]) -> Result<(), String> {
        let meshes: Vec<u64> = self.data.root.meshes.iter().map(|mesh| self.size(mesh)).collect();
        let used = nodes.iter().filter_map(|placed| placed.node.mesh).map(|mesh| meshes[mesh.value()]);
        let bytes: usize = self.data.buffers.iter().map(|bytes| bytes.len()).sum();
        let most = MOST_INSTANCED.max(CORNERS_A_BYTE.saturating_mul(bytes)).min(u32::MAX as usize);
        let fits = used.fold(0, u64::saturating_add) <= most as u64;
        fits.then_some(()).ok_or_else(|| format!("its meshes, repeated, have more than {most} points and corners"))
    }

    /// Points of a mesh, each accessor once, and corners of its triangles at most.
    fn size(&self, mesh: &Mesh) -> u64 {
        let count = |index: &Index<Accessor>| self.data.root.accessors[index.value()].count.0;
        let (mut known, mut size) = (HashSet::new(), 0u64);
        for primitive in &mesh.primitives {
            let Some(position) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else { continue };
            let corners = count(primitive.indices.as_ref().unwrap_or(position)).saturating_mul(3);
            let points = if known.insert(position.value()) { count(position) } else { 0 };
            size = size.saturating_add(corners).saturating_add(points);
        }
        size
    }
}

/// The triangles that so many corners make, as numbers of corners; none for points and lines.
fn triangles(primitive: &Primitive, corners: usize) -> Option<Vec<[usize; 3]>> {
    let Checked::Valid(mode) = primitive.mode else { return None };
    let strip = |i: usize| if i.is_multiple_of(2) { [i, i + 1, i + 2] } else { [i, i + 2, i + 1] };
    let last = corners.saturating_sub(2);
    match mode {
        Mode::Triangles => Some((0..corners / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()),
        Mode::TriangleStrip => Some((0..last).map(strip).collect()),
        Mode::TriangleFan => Some((0..last).map(|i| [i + 1, i + 2, 0]).collect()),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
    }
}

/// The colours of a primitive's vertices, where it has any: linear RGB and alpha, in 0..=1.
fn colours(
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
fn is_smooth(data: &Data, primitive: &Primitive, corners: impl Iterator<Item = [u32; 3]>) -> bool {
    let Some(index) = primitive.attributes.get(&Checked::Valid(Semantic::Normals)) else { return false };
    let Ok(numbers) = data.numbers(*index, Type::Vec3) else { return false };
    let at = |vertex: u32| numbers.get(3 * vertex as usize..3 * vertex as usize + 3).map(DVec3::from_slice);
    let differ = |a: Option<DVec3>, b: Option<DVec3>| a.zip(b).is_some_and(|(a, b)| a.distance(b) > ONE_NORMAL);
    corners.into_iter().any(|[a, b, c]| differ(at(a), at(b)) || differ(at(a), at(c)))
}
