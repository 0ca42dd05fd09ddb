//! A glTF file that is baked: the parts of its meshes, and the file written back with maps.
//!
//! ```text
//! node with a mesh  ->  node with a mesh of its own: attributes as they were, split at borders of charts, TEXCOORD_1
//! ```
//!
//! Everything else of the file stays: names, hierarchy, materials, textures, animations, what no reader here knows.
//! Each node gets a mesh of its own, as instances are lit differently. Buffers and images in files of their own come
//! into the file. Lights of KHR_lights_punctual leave it where the maps hold their light, since viewers would add them
//! once more.
//!
//! Not handled: skins, whose meshes move and get no map; EXT_mesh_gpu_instancing, likewise: its instances share one
//! mesh. Both are named.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat4, DVec2, DVec3};
use gltf::mesh::Mode;
use gltf::{Document, Gltf, Node, Primitive};
use rustc_hash::FxHashMap;
use serde_json::{Value, json};

use crate::error::BakeError;
use crate::glb::Glb;
use crate::layout::Layout;
use crate::parts::{Part, Triangle};

/// A glTF file and the parts of its default scene.
pub struct GltfFile {
    path: PathBuf,
    root: Value,
    document: Document,
    buffers: Vec<Vec<u8>>,
    primitives: Vec<PlacedPrimitive>,
    /// Its parts, in the order of the nodes.
    pub parts: Vec<Part>,
    /// What gets no map, and why.
    pub left_out: Vec<String>,
}

/// The primitive of a node that is a part.
#[derive(Clone, Debug)]
struct PlacedPrimitive {
    node: usize,
    mesh: usize,
    primitive: usize,
    /// Vertices of its triangles.
    corners: Vec<[u32; 3]>,
}

impl GltfFile {
    /// Whether a file is glTF by its name.
    pub fn is(path: &Path) -> bool {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        ["glb", "gltf"].iter().any(|own| extension.eq_ignore_ascii_case(own))
    }

    /// Reads a `.glb` or `.gltf` file, with its buffers.
    ///
    /// # Errors
    /// A file that cannot be read, or is no glTF 2.0 with triangles.
    pub fn open(path: &Path) -> Result<GltfFile, BakeError> {
        let wrong = |message: String| gltf_error(path, message, "export it again as glTF 2.0, uncompressed");
        let bytes = fs::read(path).map_err(|error| wrong(format!("cannot be read: {error}")))?;
        // Some write a byte order mark before the JSON.
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
        let Gltf { document, blob } =
            Gltf::from_slice_without_validation(bytes).map_err(|error| wrong(error.to_string()))?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let buffers = gltf::import_buffers(&document, Some(folder), blob).map_err(|error| wrong(error.to_string()))?;
        let root = json_of(bytes).ok_or_else(|| wrong("its JSON cannot be read".into()))?;
        let buffers = buffers.into_iter().map(|buffer| buffer.0).collect();
        let (primitives, parts, left_out) = (Vec::new(), Vec::new(), Vec::new());
        let mut file = GltfFile { path: path.to_owned(), root, document, buffers, primitives, parts, left_out };
        file.find_parts();
        if file.parts.is_empty() {
            return Err(wrong("has no triangles to bake".into()));
        }
        Ok(file)
    }

    fn find_parts(&mut self) {
        let document = self.document.clone();
        let scene = document.default_scene().or_else(|| document.scenes().next());
        let mut waiting: Vec<(Node, DMat4)> = match scene {
            Some(scene) => scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect(),
            None => document.nodes().map(|node| (node, DMat4::IDENTITY)).collect(),
        };
        waiting.reverse();
        while let Some((node, parent)) = waiting.pop() {
            let matrix = node.transform().matrix().map(|column| column.map(f64::from));
            let to_world = parent * DMat4::from_cols_array_2d(&matrix);
            let children: Vec<Node> = node.children().collect();
            waiting.extend(children.into_iter().rev().map(|child| (child, to_world)));
            self.take(&node, &to_world);
        }
    }

    /// Takes the primitives of a node.
    fn take(&mut self, node: &Node, to_world: &DMat4) {
        let Some(mesh) = node.mesh() else { return };
        let name = node.name().or(mesh.name()).map_or_else(|| format!("node {}", node.index()), str::to_owned);
        let own = &self.root["nodes"][node.index()];
        let why = match (node.skin(), &own["extensions"]["EXT_mesh_gpu_instancing"]) {
            (Some(_), _) => "has a skin, which moves it",
            (_, Value::Object(_)) => "is drawn once for each of EXT_mesh_gpu_instancing, which share one mesh",
            _ => "",
        };
        if !why.is_empty() {
            self.left_out.push(format!("`{name}` {why}: it gets no map"));
            return;
        }
        for primitive in mesh.primitives() {
            let Some((triangles, corners)) = self.triangles(&primitive, to_world) else { continue };
            let (node, mesh, primitive) = (node.index(), mesh.index(), primitive.index());
            self.primitives.push(PlacedPrimitive { node, mesh, primitive, corners });
            self.parts.push(Part { name: name.clone(), triangles });
        }
    }

    /// The triangles of a primitive in the world, and their vertices; none of points and lines.
    fn triangles(&self, primitive: &Primitive, to_world: &DMat4) -> Option<(Vec<Triangle>, Vec<[u32; 3]>)> {
        let reader = primitive.reader(|buffer| self.buffers.get(buffer.index()).map(|bytes| &bytes[..]));
        let positions: Vec<DVec3> =
            reader.read_positions()?.map(|p| to_world.transform_point3(DVec3::from(p.map(f64::from)))).collect();
        let second: Option<Vec<DVec2>> =
            reader.read_tex_coords(1).map(|all| all.into_f32().map(|uv| DVec2::from(uv.map(f64::from))).collect());
        let indices: Vec<u32> =
            reader.read_indices().map_or_else(|| (0..positions.len() as u32).collect(), |all| all.into_u32().collect());
        let corners = corners(primitive.mode(), &indices)?;
        let count = positions.len() as u32;
        let corners: Vec<[u32; 3]> = corners.into_iter().filter(|all| all.iter().all(|k| *k < count)).collect();
        let triangle = |all: &[u32; 3]| Triangle {
            corners: all.map(|k| positions[k as usize]),
            second: second.as_ref().filter(|uv| uv.len() == positions.len()).map(|uv| all.map(|k| uv[k as usize])),
        };
        let triangles: Vec<Triangle> = corners.iter().map(triangle).collect();
        (!triangles.is_empty()).then_some((triangles, corners))
    }

    /// The nodes of the parts, by their numbers in the file.
    pub fn nodes(&self) -> Vec<usize> {
        self.primitives.iter().map(|own| own.node).collect()
    }

    /// The file with second texture coordinates and a lightmap at its materials; `png` has the map, to be multiplied by
    /// `intensity`. Lights stay where `keeps_lights`.
    ///
    /// # Errors
    /// An accessor that does not fit its buffer, or an image that cannot be read.
    pub fn with_lightmap(
        &self,
        layout: &Layout,
        (png, intensity): (&[u8], f32),
        keeps_lights: bool,
    ) -> Result<Vec<u8>, BakeError> {
        let mut glb = self.whole()?;
        let mut meshes: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (part, own) in self.primitives.iter().enumerate() {
            meshes.entry(own.node).or_default().push(part);
        }
        for (node, parts) in meshes {
            let mesh = self.primitives[parts[0]].mesh;
            let mut changed = glb.root["meshes"][mesh].clone();
            for part in parts {
                let own = &self.primitives[part];
                let primitive = changed["primitives"][own.primitive].clone();
                changed["primitives"][own.primitive] = self.split(&mut glb, primitive, own, &layout.shares(part))?;
            }
            let number = glb.push("meshes", changed);
            glb.root["nodes"][node]["mesh"] = number.into();
        }
        let texture = glb.texture("lightmap", png, crate::glb::lightmap_sampler());
        glb.light(texture, intensity);
        if !keeps_lights {
            without_lights(&mut glb);
        }
        drop_unused_meshes(&mut glb);
        Ok(glb.bytes())
    }

    /// The file with one buffer that holds all others, and all images.
    fn whole(&self) -> Result<Glb, BakeError> {
        let mut glb = Glb { root: self.root.clone(), binary: Vec::new() };
        let mut starts = Vec::new();
        for bytes in &self.buffers {
            while !glb.binary.len().is_multiple_of(4) {
                glb.binary.push(0);
            }
            starts.push(glb.binary.len());
            glb.binary.extend_from_slice(bytes);
        }
        for view in glb.list("bufferViews") {
            let buffer = view["buffer"].as_u64().unwrap_or(0) as usize;
            let offset = view["byteOffset"].as_u64().unwrap_or(0) as usize;
            view["byteOffset"] = (starts.get(buffer).copied().unwrap_or(0) + offset).into();
            view["buffer"] = 0.into();
        }
        for number in 0..glb.list("images").len() {
            let image = glb.root["images"][number].clone();
            let Some(uri) = image["uri"].as_str().filter(|uri| !uri.starts_with("data:")) else { continue };
            let (bytes, kind) = self.image(uri)?;
            let view = glb.view(&bytes, None);
            let own = glb.root["images"][number].as_object_mut().expect("an image");
            own.remove("uri");
            own.insert("mimeType".into(), kind.into());
            own.insert("bufferView".into(), view.into());
        }
        Ok(glb)
    }

    /// The bytes of an image beside the file, and what it is.
    fn image(&self, uri: &str) -> Result<(Vec<u8>, &'static str), BakeError> {
        let name = percent_decoded(uri);
        let place = self.path.parent().unwrap_or(Path::new("")).join(&name);
        let bytes = fs::read(&place).map_err(|error| {
            let message = format!("its image {} cannot be read: {error}", place.display());
            gltf_error(&self.path, message, "put the image beside the file, or export a .glb")
        })?;
        let kind = match place.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("jpg" | "jpeg") => "image/jpeg",
            Some("webp") => "image/webp",
            _ => "image/png",
        };
        Ok((bytes, kind))
    }

    /// A primitive with vertices split where its corners lie at several places of the map.
    fn split(
        &self,
        glb: &mut Glb,
        mut primitive: Value,
        own: &PlacedPrimitive,
        places: &[[DVec2; 3]],
    ) -> Result<Value, BakeError> {
        let mut known: FxHashMap<(u32, [u64; 2]), u32> = FxHashMap::default();
        let (mut from, mut second, mut indices) = (Vec::new(), Vec::new(), Vec::new());
        for (corners, places) in own.corners.iter().zip(places) {
            for (vertex, place) in corners.iter().zip(places) {
                let key = (*vertex, place.to_array().map(f64::to_bits));
                let number = *known.entry(key).or_insert_with(|| {
                    from.push(*vertex);
                    second.push(*place);
                    from.len() as u32 - 1
                });
                indices.push(number);
            }
        }
        self.gather_all(glb, &mut primitive["attributes"], &from)?;
        for target in primitive.get_mut("targets").and_then(Value::as_array_mut).into_iter().flatten() {
            self.gather_all(glb, target, &from)?;
        }
        primitive["attributes"]["TEXCOORD_1"] = glb.coordinates(&second).into();
        primitive["indices"] = glb.indices(&indices).into();
        primitive["mode"] = 4.into();
        if primitive["material"].is_null() {
            let material = json!({ "name": "default" });
            primitive["material"] = glb.push("materials", material).into();
        }
        Ok(primitive)
    }

    /// Gives every attribute the elements that some vertices have.
    fn gather_all(&self, glb: &mut Glb, attributes: &mut Value, from: &[u32]) -> Result<(), BakeError> {
        for accessor in attributes.as_object_mut().into_iter().flat_map(|all| all.values_mut()) {
            let number = accessor.as_u64().unwrap_or(u64::MAX) as usize;
            *accessor = self.gathered(glb, number, from)?.into();
        }
        Ok(())
    }

    /// An accessor with the elements of another that some vertices have.
    fn gathered(&self, glb: &mut Glb, number: usize, from: &[u32]) -> Result<usize, BakeError> {
        let wrong = || {
            let message = format!("accessor {number} does not fit its buffer");
            gltf_error(&self.path, message, "export the file again")
        };
        let own = self.root["accessors"].get(number).ok_or_else(wrong)?.clone();
        let (bytes, size) = self.elements(&own).ok_or_else(wrong)?;
        let stride = size.next_multiple_of(4);
        let mut packed = Vec::with_capacity(from.len() * stride);
        for &vertex in from {
            let start = vertex as usize * size;
            packed.extend_from_slice(bytes.get(start..start + size).ok_or_else(wrong)?);
            packed.resize(packed.len().next_multiple_of(4), 0);
        }
        let view = glb.view(&packed, Some(34962));
        if stride != size {
            glb.root["bufferViews"][view]["byteStride"] = stride.into();
        }
        let mut accessor = own;
        let fields = accessor.as_object_mut().ok_or_else(wrong)?;
        ["sparse", "byteOffset"].iter().for_each(|key| drop(fields.remove(*key)));
        fields.insert("bufferView".into(), view.into());
        fields.insert("count".into(), from.len().into());
        Ok(glb.push("accessors", accessor))
    }

    /// The elements of an accessor one behind another, and the bytes of each.
    fn elements(&self, accessor: &Value) -> Option<(Vec<u8>, usize)> {
        let number = |value: &Value| value.as_u64().map(|n| n as usize);
        let parts = match accessor["type"].as_str()? {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => return None,
        };
        let component = |kind: &Value| match kind.as_u64() {
            Some(5120 | 5121) => Some(1),
            Some(5122 | 5123) => Some(2),
            Some(5125 | 5126) => Some(4),
            _ => None,
        };
        let size = parts * component(&accessor["componentType"])?;
        let count = number(&accessor["count"])?;
        let mut bytes = match number(&accessor["bufferView"]) {
            Some(view) => self.strided(view, number(&accessor["byteOffset"]).unwrap_or(0), size, count)?,
            None => vec![0; size.checked_mul(count)?],
        };
        if let Some(sparse) = accessor.get("sparse") {
            let some = number(&sparse["count"])?;
            let width = component(&sparse["indices"]["componentType"])?;
            let offset = |of: &str| number(&sparse[of]["byteOffset"]).unwrap_or(0);
            let places = self.strided(number(&sparse["indices"]["bufferView"])?, offset("indices"), width, some)?;
            let values = self.strided(number(&sparse["values"]["bufferView"])?, offset("values"), size, some)?;
            for (place, value) in places.chunks_exact(width).zip(values.chunks_exact(size)) {
                let at = place.iter().rev().fold(0, |sum, byte| 256 * sum + usize::from(*byte));
                bytes.get_mut(at * size..(at + 1) * size)?.copy_from_slice(value);
            }
        }
        Some((bytes, size))
    }

    /// So many elements of a view, without what lies between them.
    fn strided(&self, view: usize, offset: usize, size: usize, count: usize) -> Option<Vec<u8>> {
        let view = self.root["bufferViews"].get(view)?;
        let number = |key: &str| view[key].as_u64().map(|n| n as usize);
        let buffer = self.buffers.get(number("buffer")?)?;
        let start = number("byteOffset").unwrap_or(0).checked_add(offset)?;
        let stride = number("byteStride").unwrap_or(size);
        let mut bytes = Vec::new();
        for k in 0..count {
            let from = start.checked_add(k.checked_mul(stride)?)?;
            bytes.extend_from_slice(buffer.get(from..from.checked_add(size)?)?);
        }
        Some(bytes)
    }
}

fn gltf_error(path: &Path, message: String, help: &str) -> BakeError {
    BakeError::Gltf { path: path.to_owned(), message, help: help.to_owned() }
}

/// The JSON of a `.glb` or `.gltf` file.
fn json_of(bytes: &[u8]) -> Option<Value> {
    if bytes.starts_with(b"glTF") {
        let length = u32::from_le_bytes(bytes.get(12..16)?.try_into().ok()?) as usize;
        return serde_json::from_slice(bytes.get(20..20 + length)?).ok();
    }
    serde_json::from_slice(bytes).ok()
}

/// The vertices of triangles, strips and fans; none of points and lines.
fn corners(mode: Mode, indices: &[u32]) -> Option<Vec<[u32; 3]>> {
    match mode {
        Mode::Triangles => Some(indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect()),
        Mode::TriangleStrip => {
            let turned = |(k, t): (usize, &[u32])| if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] };
            Some(indices.windows(3).enumerate().map(turned).collect())
        }
        Mode::TriangleFan => {
            let first = indices.first().copied().unwrap_or(0);
            Some(indices.get(1..)?.windows(2).map(|t| [t[0], t[1], first]).collect())
        }
        _ => None,
    }
}

/// Text in which %XX stands for a byte.
fn percent_decoded(text: &str) -> String {
    let (bytes, mut decoded, mut k) = (text.as_bytes(), Vec::new(), 0);
    while k < bytes.len() {
        let code = text.get(k + 1..k + 3).and_then(|two| u8::from_str_radix(two, 16).ok());
        match (bytes[k], code) {
            (b'%', Some(code)) => {
                decoded.push(code);
                k += 3;
            }
            (byte, _) => {
                decoded.push(byte);
                k += 1;
            }
        }
    }
    String::from_utf8_lossy(&decoded).into_owned()
}

/// Takes the lights of KHR_lights_punctual out.
fn without_lights(glb: &mut Glb) {
    const LIGHTS: &str = "KHR_lights_punctual";
    for node in glb.list("nodes") {
        if let Some(extensions) = node["extensions"].as_object_mut() {
            extensions.remove(LIGHTS);
        }
        if node["extensions"].as_object().is_some_and(serde_json::Map::is_empty) {
            node.as_object_mut().expect("a node").remove("extensions");
        }
    }
    if let Some(extensions) = glb.root["extensions"].as_object_mut() {
        extensions.remove(LIGHTS);
    }
    ["extensionsUsed", "extensionsRequired"].iter().for_each(|list| glb.list(list).retain(|own| own != LIGHTS));
    ["extensionsUsed", "extensionsRequired"].iter().for_each(|key| drop_if_empty(glb, key));
    drop_if_empty(glb, "extensions");
}

/// Takes an empty list or object out, which glTF does not allow.
fn drop_if_empty(glb: &mut Glb, key: &str) {
    let own = &glb.root[key];
    let is_empty = own.as_array().is_some_and(Vec::is_empty) || own.as_object().is_some_and(serde_json::Map::is_empty);
    if is_empty || own.is_null() {
        glb.root.as_object_mut().expect("an object").remove(key);
    }
}

/// Takes meshes out that no node names any more.
fn drop_unused_meshes(glb: &mut Glb) {
    let used: Vec<usize> = glb.list("nodes").iter().filter_map(|n| n["mesh"].as_u64()).map(|n| n as usize).collect();
    let (mut numbers, mut kept) = (BTreeMap::new(), Vec::new());
    for (number, mesh) in glb.list("meshes").drain(..).enumerate() {
        if used.contains(&number) {
            numbers.insert(number, kept.len());
            kept.push(mesh);
        }
    }
    *glb.list("meshes") = kept;
    for node in glb.list("nodes") {
        if let Some(number) = node["mesh"].as_u64().and_then(|n| numbers.get(&(n as usize))) {
            node["mesh"] = (*number).into();
        }
    }
    for key in ["images", "bufferViews", "accessors", "extensionsUsed"] {
        drop_if_empty(glb, key);
    }
}
