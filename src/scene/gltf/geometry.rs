//! Triangles of a glTF scene: the meshes at its nodes, placed in the world.
//!
//! Lists, strips and fans are read, with indices or without. Where the determinant of a node's transform is negative
//! corners are taken the other way round, so that fronts stay fronts (glTF 2.0, 3.7.4). Meshes at several nodes, and
//! instances of a node's mesh, are written out once for each, which [`MOST_INSTANCED`] bounds. `COLOR_0` is linear, RGB
//! or RGBA, as floats or normalised integers; numbers outside 0..1 are clamped, and named among what is ignored.
//!
//! Not handled: points and lines, smooth normals, morph targets (each ignored with a warning).

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use glam::{DMat4, DVec3, Vec2, Vec4};

use crate::scene::gltf::accessors::{SCALAR, VEC2, VEC3, VEC4};
use crate::scene::gltf::buffers::Data;
use crate::scene::gltf::document::name;
use crate::scene::gltf::fault::{Fault, item};
use crate::scene::gltf::ignored::{Ignored, Kind};
use crate::scene::gltf::nodes::Placed;
use crate::scene::gltf::placements::{Placements, count, is_posed, placements, pose};
use crate::scene::gltf::schema::{Index, Mesh, Primitive};
use crate::scene::soup::{Polygon, Soup};

/// Points and corners that a scene may have by repeating its meshes, whatever its size.
const MOST_INSTANCED: usize = 1 << 25;

/// Points and corners that a scene may have for each byte of its buffers: a strip of bytes makes three each.
const CORNERS_A_BYTE: usize = 4;

/// Points and corners that an instance counts for at least: so much memory its transform takes.
const SMALLEST_INSTANCE: u64 = 8;

/// Texture coordinates beyond this are not taken for such: single precision resolves texels no more.
const FARTHEST: f32 = 1e6;

/// How far normals of a triangle's corners may lie apart to be one.
const ONE_NORMAL: f64 = 1e-3;

/// What is being read.
pub(super) struct Geometry<'a, 'r> {
    pub data: &'a Data<'a, 'r>,
    pub soup: &'a mut Soup,
    pub ignored: &'a mut Ignored,
    /// The set of texture coordinates that each material goes by, if it has textures.
    pub sets: &'a [Option<u64>],
}

/// The points of an accessor as a node shows them.
#[derive(Clone)]
struct Points {
    /// Before the transforms of the instances.
    local: Rc<Vec<DVec3>>,
    /// Where they begin in the soup, for each instance.
    first: Rc<Vec<usize>>,
    /// Whether the skin has mirrored them.
    mirrored: bool,
}

/// What is read of a primitive.
struct Part {
    points: Points,
    corners: Vec<u32>,
    triangles: Vec<[usize; 3]>,
    material: u32,
    /// Of the vertices, empty where there are none; none in a scene without textures.
    coordinates: Option<Vec<Vec2>>,
    colours: Option<Vec<Vec4>>,
}

impl Geometry<'_, '_> {
    /// Appends the meshes of all nodes to the soup, each node as an object.
    pub(super) fn take(&mut self, nodes: &[Placed]) -> Result<(), Fault> {
        self.check_size(nodes)?;
        let mut known = vec![None; self.data.root.nodes.len()];
        for placed in nodes {
            known[placed.number] = Some(placed.to_world);
        }
        for placed in nodes {
            let Some(mesh) = placed.node.mesh else { continue };
            let mesh = item(&self.data.root.meshes, mesh, "mesh")?;
            let given = placed.node.name.as_ref().or(mesh.name.as_ref());
            let object = name(&given.cloned(), "node", placed.number);
            self.node(placed, mesh, &known, &object).map_err(|fault| fault.within(&format!("node `{object}`")))?;
            self.soup.objects.push(object);
        }
        if !self.soup.colours.is_empty() {
            self.soup.colours.resize(self.soup.corners.len(), Vec4::NAN);
        }
        Ok(())
    }

    /// Appends the mesh of a node, once for each of its instances.
    fn node(&mut self, placed: &Placed, mesh: &Mesh, known: &[Option<DMat4>], object: &str) -> Result<(), Fault> {
        let places = placements(self.data, placed, known)?;
        if placed.node.skin.is_some() {
            self.ignored.add(Kind::Skins, object);
        }
        let weights = if placed.node.weights.is_empty() { &mesh.weights } else { &placed.node.weights };
        let is_morphed = weights.iter().any(|weight| *weight != 0.0);
        let mut known = HashMap::new();
        for primitive in &mesh.primitives {
            if is_morphed && !primitive.targets.is_empty() {
                self.ignored.add(Kind::Morphs, object);
            }
            if triangles(primitive, 0)?.is_none() {
                self.ignored.add(Kind::PointsAndLines, object);
                continue;
            }
            if let Some(part) = self.part(primitive, &places, object, &mut known)? {
                self.append(&part, &places);
            }
        }
        Ok(())
    }

    /// Reads a primitive of triangles. `known` has the points of each accessor that the node has used before.
    fn part(
        &mut self,
        primitive: &Primitive,
        places: &Placements,
        object: &str,
        known: &mut HashMap<Index, Points>,
    ) -> Result<Option<Part>, Fault> {
        let Some(position) = primitive.attributes.get("POSITION").copied() else { return Ok(None) };
        let is_shared = places.joints.is_none() || !is_posed(primitive);
        let points = match known.get(&position) {
            Some(points) if is_shared => points.clone(),
            _ => self.points(primitive, position, places)?,
        };
        if is_shared {
            known.insert(position, points.clone());
        }
        let count = points.local.len();
        let corners = self.corners(primitive, count)?;
        let triangles = triangles(primitive, corners.len())?.unwrap_or_default();
        let plain = self.soup.materials.len() - 1;
        let material = match primitive.material {
            Some(index) => item(&self.soup.materials[..plain], index, "material").map(|_| index.0)?,
            None => plain,
        } as u32;
        let coordinates = self.coordinates(primitive, material, count)?;
        let colours = colours(self.data, primitive, count, self.ignored, object)?;
        if is_smooth(self.data, primitive, triangles.iter().map(|triangle| triangle.map(|corner| corners[corner]))) {
            self.ignored.add(Kind::SmoothNormals, object);
        }
        Ok(Some(Part { points, corners, triangles, material, coordinates, colours }))
    }

    /// Appends the triangles of a part, once for each instance.
    fn append(&mut self, part: &Part, places: &Placements) {
        let object = self.soup.objects.len() as u32;
        for (to_world, first) in places.to_world.iter().zip(part.points.first.iter()) {
            let mirrored = (to_world.determinant() < 0.0) != part.points.mirrored;
            for &[a, b, c] in &part.triangles {
                let turned = if mirrored { [a, c, b] } else { [a, b, c] };
                self.soup.corners.extend(turned.map(|corner| *first as u32 + part.corners[corner]));
                if let Some(coordinates) = &part.coordinates {
                    let at = |corner: usize| coordinates.get(part.corners[corner] as usize).copied();
                    self.soup.coordinates.extend(turned.map(|corner| at(corner).unwrap_or_default()));
                }
                if let Some(colours) = &part.colours {
                    self.soup.colours.resize(self.soup.corners.len() - 3, Vec4::NAN);
                    let at = |corner: usize| colours.get(part.corners[corner] as usize).copied();
                    self.soup.colours.extend(turned.map(|corner| at(corner).unwrap_or(Vec4::NAN)));
                }
                let number = self.soup.polygons.len();
                self.soup.polygons.push(Polygon { corners: 3, material: part.material, object, number });
            }
        }
    }

    /// Texture coordinates of a primitive's vertices, empty where it has or needs none; none in a scene without
    /// textures.
    fn coordinates(&mut self, primitive: &Primitive, material: u32, count: usize) -> Result<Option<Vec<Vec2>>, Fault> {
        if self.sets.iter().all(Option::is_none) {
            return Ok(None);
        }
        let Some(set) = self.sets[material as usize] else { return Ok(Some(Vec::new())) };
        let Some(index) = primitive.attributes.get(&format!("TEXCOORD_{set}")) else {
            self.ignored.add(Kind::NoCoordinates, &self.soup.materials[material as usize].name);
            return Ok(Some(Vec::new()));
        };
        let numbers = self.data.numbers(*index, VEC2)?;
        let found = numbers.len() / 2;
        if found < count {
            return Err(format!("accessor {} has {found} texture coordinates for {count} vertices", index.0).into());
        }
        let place = |at: &[f64]| {
            let at = Vec2::new(at[0] as f32, at[1] as f32);
            if at.abs().max_element() <= FARTHEST { at } else { Vec2::ZERO }
        };
        Ok(Some(numbers.chunks_exact(2).map(place).collect()))
    }

    /// Appends the points of a primitive, once for each instance.
    fn points(&mut self, primitive: &Primitive, position: Index, places: &Placements) -> Result<Points, Fault> {
        let compressed = primitive.extensions.draco.is_some();
        if compressed && item(&self.data.root.accessors, position, "accessor")?.buffer_view.is_none() {
            return Err("its triangles are compressed (KHR_draco_mesh_compression): export it uncompressed".into());
        }
        let numbers = self.data.numbers(position, VEC3)?;
        let mut local: Vec<DVec3> = numbers.chunks_exact(3).map(DVec3::from_slice).collect();
        let mirrored = match &places.joints {
            Some(joints) => pose(self.data, primitive, joints, &mut local)?,
            None => false,
        };
        let mut first = Vec::new();
        for to_world in &places.to_world {
            first.push(self.soup.vertices.len());
            self.append_points(position, &local, to_world)?;
        }
        Ok(Points { local: Rc::new(local), first: Rc::new(first), mirrored })
    }

    fn append_points(&mut self, position: Index, local: &[DVec3], to_world: &DMat4) -> Result<(), Fault> {
        let first = self.soup.vertices.len();
        self.soup.vertices.extend(local.iter().map(|point| to_world.transform_point3(*point)));
        match self.soup.vertices[first..].iter().position(|point| !point.is_finite()) {
            None => Ok(()),
            Some(wrong) => Err(format!("vertex {wrong} of accessor {} is not finite", position.0).into()),
        }
    }

    /// The numbers of the vertices that the primitive's corners are.
    fn corners(&self, primitive: &Primitive, count: usize) -> Result<Vec<u32>, Fault> {
        let Some(index) = primitive.indices else { return Ok((0..count as u32).collect()) };
        let numbers = self.data.numbers(index, SCALAR)?;
        match numbers.iter().find(|number| !(0.0..count as f64).contains(*number) || number.fract() != 0.0) {
            None => Ok(numbers.into_iter().map(|number| number as u32).collect()),
            Some(wrong) => Err(format!("accessor {}: index {wrong}, but there are {count} vertices", index.0).into()),
        }
    }

    /// Refuses scenes whose points and corners would be more than allowed, before any of them is read.
    fn check_size(&self, nodes: &[Placed]) -> Result<(), Fault> {
        let meshes: Vec<Size> = self.data.root.meshes.iter().map(|mesh| self.size(mesh)).collect();
        let most = MOST_INSTANCED.max(CORNERS_A_BYTE.saturating_mul(self.data.size())).min(u32::MAX as usize);
        let mut all = 0u64;
        for placed in nodes {
            let size = self.size_of_node(placed, &meshes);
            all = all.saturating_add(size.map_err(|fault| fault.within(&format!("node {}", placed.number)))?);
        }
        let fits = all <= most as u64;
        fits.then_some(())
            .ok_or_else(|| format!("its meshes, repeated, have more than {most} points and corners").into())
    }

    fn size_of_node(&self, placed: &Placed, meshes: &[Size]) -> Result<u64, Fault> {
        let Some(mesh) = placed.node.mesh else { return Ok(0) };
        let size = item(meshes, mesh, "mesh")?;
        let points = if placed.node.skin.is_some() { size.posed } else { size.points };
        let one = size.corners.saturating_add(points);
        let count = count(self.data, placed)?;
        Ok(if count > 1 { one.max(SMALLEST_INSTANCE).saturating_mul(count) } else { one })
    }

    fn size(&self, mesh: &Mesh) -> Size {
        let count = |index: Index| self.data.root.accessors.get(index.0).map_or(0, |accessor| accessor.count.0);
        let (mut known, mut size) = (HashSet::new(), Size::default());
        for primitive in &mesh.primitives {
            let Some(position) = primitive.attributes.get("POSITION").copied() else { continue };
            let corners = count(primitive.indices.unwrap_or(position)).saturating_mul(3);
            let (is_new, is_posed) = (known.insert(position), is_posed(primitive));
            let points = |counts: bool| if counts { count(position) } else { 0 };
            size.corners = size.corners.saturating_add(corners);
            size.points = size.points.saturating_add(points(is_new));
            size.posed = size.posed.saturating_add(points(is_new || is_posed));
        }
        size
    }
}

/// How large a mesh is.
#[derive(Default)]
struct Size {
    /// Corners of its triangles, at most.
    corners: u64,
    /// Points, each accessor once.
    points: u64,
    /// Points where it has a skin: those that go by joints once for each primitive.
    posed: u64,
}

/// The triangles that so many corners make, as numbers of corners; none for points and lines.
fn triangles(primitive: &Primitive, corners: usize) -> Result<Option<Vec<[usize; 3]>>, Fault> {
    let strip = |i: usize| if i.is_multiple_of(2) { [i, i + 1, i + 2] } else { [i, i + 2, i + 1] };
    let last = corners.saturating_sub(2);
    match primitive.mode.map_or(4, |mode| mode.0) {
        0..=3 => Ok(None),
        4 => Ok(Some((0..corners / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())),
        5 => Ok(Some((0..last).map(strip).collect())),
        6 => Ok(Some((0..last).map(|i| [i + 1, i + 2, 0]).collect())),
        other => Err(format!("its mode is {other}, and those of glTF are 0 to 6").into()),
    }
}

/// The colours of a primitive's vertices, where it has any: linear RGB and alpha, in 0..=1.
fn colours(
    data: &Data,
    primitive: &Primitive,
    count: usize,
    ignored: &mut Ignored,
    object: &str,
) -> Result<Option<Vec<Vec4>>, Fault> {
    if primitive.attributes.keys().any(|key| key.starts_with("COLOR_") && key != "COLOR_0") {
        ignored.add(Kind::FurtherColours, object);
    }
    let Some(index) = primitive.attributes.get("COLOR_0").copied() else { return Ok(None) };
    let is_rgba = item(&data.root.accessors, index, "accessor")?.kind == VEC4.name;
    let shape = if is_rgba { VEC4 } else { VEC3 };
    let numbers = data.numbers(index, shape)?;
    let found = numbers.len() / shape.parts;
    if found < count {
        return Err(format!("accessor {} has {found} colours for {count} vertices", index.0).into());
    }
    if numbers.iter().any(|number| !(0.0..=1.0).contains(number)) {
        ignored.add(Kind::ColoursOutside, object);
    }
    // A number that is none counts as 0.
    let part = |number: f64| number.clamp(0.0, 1.0).max(0.0) as f32;
    let colour = |c: &[f64]| Vec4::new(part(c[0]), part(c[1]), part(c[2]), c.get(3).map_or(1.0, |alpha| part(*alpha)));
    Ok(Some(numbers.chunks_exact(shape.parts).map(colour).collect()))
}

/// Whether the normals of a primitive's vertices differ within a triangle; `corners` has the vertices of all triangles.
fn is_smooth(data: &Data, primitive: &Primitive, corners: impl Iterator<Item = [u32; 3]>) -> bool {
    let Some(index) = primitive.attributes.get("NORMAL") else { return false };
    let Ok(numbers) = data.numbers(*index, VEC3) else { return false };
    let at = |vertex: u32| numbers.get(3 * vertex as usize..3 * vertex as usize + 3).map(DVec3::from_slice);
    let differ = |a: Option<DVec3>, b: Option<DVec3>| a.zip(b).is_some_and(|(a, b)| a.distance(b) > ONE_NORMAL);
    corners.into_iter().any(|[a, b, c]| differ(at(a), at(b)) || differ(at(a), at(c)))
}
