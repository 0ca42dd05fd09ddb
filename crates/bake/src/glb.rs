//! glTF files as JSON with one buffer, and as the bytes of a `.glb`.
//!
//! What is added to a file goes behind the bytes that it has; nothing of its JSON is lost, known or not.
//!
//! Source: Khronos Group, *glTF 2.0 Specification*, 4 (GLB). Not handled: several binary chunks.

use glam::{DVec2, Vec3};
use serde_json::{Map, Value, json};

/// glTF's numbers of what buffers hold.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;

/// A glTF file with one buffer.
#[derive(Clone, Debug)]
pub(crate) struct Glb {
    pub root: Value,
    pub binary: Vec<u8>,
}

impl Glb {
    /// A list of the file, made if it has none.
    pub(crate) fn list(&mut self, name: &str) -> &mut Vec<Value> {
        let root = self.root.as_object_mut().expect("the JSON of a glTF file is an object");
        let list = root.entry(name).or_insert_with(|| Value::Array(Vec::new()));
        if !list.is_array() {
            *list = Value::Array(Vec::new());
        }
        list.as_array_mut().expect("it is a list")
    }

    /// Adds to a list, and returns the number that it has there.
    pub(crate) fn push(&mut self, name: &str, value: Value) -> usize {
        let list = self.list(name);
        list.push(value);
        list.len() - 1
    }

    /// Adds bytes, and returns the number of their view.
    pub(crate) fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        while !self.binary.len().is_multiple_of(4) {
            self.binary.push(0);
        }
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.push("bufferViews", view)
    }

    /// Adds positions, and returns the number of their accessor.
    pub(crate) fn positions(&mut self, points: &[Vec3]) -> usize {
        let bytes: Vec<u8> = points.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let (low, high) = points.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": FLOAT, "count": points.len(),
            "type": "VEC3", "min": low.to_array(), "max": high.to_array() }),
        )
    }

    /// Adds normals, and returns the number of their accessor.
    pub(crate) fn normals(&mut self, normals: &[Vec3]) -> usize {
        let bytes: Vec<u8> = normals.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let count = normals.len();
        self.push("accessors", json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": "VEC3" }))
    }

    /// Adds texture coordinates, and returns the number of their accessor.
    pub(crate) fn coordinates(&mut self, places: &[DVec2]) -> usize {
        let bytes: Vec<u8> = places.iter().flat_map(|p| p.as_vec2().to_array()).flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let count = places.len();
        self.push("accessors", json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": "VEC2" }))
    }

    /// Adds indices, and returns the number of their accessor.
    pub(crate) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let count = indices.len();
        let kind = json!({ "bufferView": view, "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR" });
        self.push("accessors", kind)
    }

    /// Adds a texture of a PNG file, and returns its number.
    pub(crate) fn texture(&mut self, name: &str, png: &[u8], sampler: Value) -> usize {
        let view = self.view(png, None);
        let image = self.push("images", json!({ "name": name, "mimeType": "image/png", "bufferView": view }));
        let sampler = self.push("samplers", sampler);
        self.push("textures", json!({ "name": name, "sampler": sampler, "source": image }))
    }

    /// Notes that the file uses an extension.
    pub(crate) fn uses(&mut self, extension: &str) {
        let list = self.list("extensionsUsed");
        if list.iter().all(|own| own != extension) {
            list.push(extension.into());
        }
    }

    /// Gives every material the texture that its irradiance is read from.
    pub(crate) fn light(&mut self, texture: usize, intensity: f32) {
        self.uses(LIGHTMAP);
        let own = json!({ "index": texture, "texCoord": 1, "intensity": intensity });
        for material in self.list("materials") {
            let Some(material) = material.as_object_mut() else { continue };
            let extensions = material.entry("extensions").or_insert_with(|| Value::Object(Map::new()));
            if let Some(extensions) = extensions.as_object_mut() {
                extensions.insert(LIGHTMAP.into(), own.clone());
            }
        }
    }

    /// The bytes of the `.glb` file.
    pub(crate) fn bytes(mut self) -> Vec<u8> {
        while !self.binary.len().is_multiple_of(4) {
            self.binary.push(0);
        }
        self.root["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        let mut text = serde_json::to_vec(&self.root).expect("JSON of numbers and text");
        while !text.len().is_multiple_of(4) {
            text.push(b' ');
        }
        let length = 12 + 8 + text.len() + 8 + self.binary.len();
        let mut bytes = Vec::with_capacity(length);
        bytes.extend_from_slice(b"glTF");
        for number in [2, length as u32, text.len() as u32] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        bytes.extend_from_slice(b"JSON");
        bytes.extend_from_slice(&text);
        bytes.extend_from_slice(&(self.binary.len() as u32).to_le_bytes());
        bytes.extend_from_slice(b"BIN\0");
        bytes.extend_from_slice(&self.binary);
        bytes
    }
}

/// The extension that names lightmaps of materials.
pub(crate) const LIGHTMAP: &str = "MOZ_lightmap";

/// Linear between texels and without mipmaps, which three.js and Bevy need not make; the edge's texel beyond the edge.
pub(crate) fn lightmap_sampler() -> Value {
    json!({ "magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071 })
}
