//! What is read of the JSON of glTF 2.0: the values that a picture needs, and no others.
//!
//! Everything else is read over without being kept: `extras`, `asset`, bounds, targets of buffer views, channels of
//! animations, unknown extensions. So it may be of any type, of any depth and wrong. Values that are left out have
//! glTF's defaults; indices and codes are checked where they are used. A whole number may be written with a fraction of
//! zeros.
//!
//! Not handled: which of these values belong together; that is for those who use them.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{Error, IgnoredAny, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};

/// A whole number that is not negative: a count, a size, a code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Whole(pub u64);

/// A whole number that names an item of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(from = "Whole")]
pub(super) struct Index(pub usize);

impl From<Whole> for Index {
    fn from(Whole(number): Whole) -> Index {
        Index(usize::try_from(number).unwrap_or(usize::MAX))
    }
}

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Whole, D::Error> {
        from.deserialize_any(WholeVisitor)
    }
}

struct WholeVisitor;

impl Visitor<'_> for WholeVisitor {
    type Value = Whole;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a whole number of at least 0")
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Whole, E> {
        Ok(Whole(number))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Whole, E> {
        let whole = number.fract() == 0.0 && (0.0..=u64::MAX as f64).contains(&number);
        whole.then_some(Whole(number as u64)).ok_or_else(|| E::invalid_value(Unexpected::Float(number), &self))
    }
}

/// What stands for `null` is what stands for nothing.
fn given<'de, D: Deserializer<'de>, T: Default + Deserialize<'de>>(from: D) -> Result<T, D::Error> {
    Option::deserialize(from).map(Option::unwrap_or_default)
}

/// The whole file.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Root {
    pub accessors: Vec<Accessor>,
    pub animations: Vec<Animation>,
    pub buffers: Vec<Buffer>,
    pub buffer_views: Vec<View>,
    pub cameras: Vec<Camera>,
    #[serde(deserialize_with = "given")]
    pub extensions: RootExtensions,
    pub extensions_required: Vec<String>,
    pub extensions_used: Vec<String>,
    pub images: Vec<Image>,
    pub materials: Vec<Material>,
    pub meshes: Vec<Mesh>,
    pub nodes: Vec<Node>,
    pub samplers: Vec<Sampler>,
    pub scene: Option<Index>,
    pub scenes: Vec<Shown>,
    pub skins: Vec<Skin>,
    pub textures: Vec<Texture>,
}

/// An animation, of which the name is all.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Animation {
    pub name: Option<String>,
}

/// Extensions of the whole file.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights_punctual: Option<Lights>,
}

/// The lights that nodes name.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Lights {
    pub lights: Vec<Light>,
}

/// A punctual light.
#[derive(Deserialize)]
#[serde(default)]
pub(super) struct Light {
    pub name: Option<String>,
    pub color: [f32; 3],
    pub intensity: f32,
    pub range: Option<f32>,
    pub spot: Option<Spot>,
    #[serde(rename = "type")]
    pub kind: String,
}

impl Default for Light {
    fn default() -> Light {
        Light { name: None, color: [1.0; 3], intensity: 1.0, range: None, spot: None, kind: String::new() }
    }
}

/// The cone of a spot, in radians.
#[derive(Clone, Copy, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Spot {
    pub inner_cone_angle: f32,
    pub outer_cone_angle: f32,
}

impl Default for Spot {
    fn default() -> Spot {
        Spot { inner_cone_angle: 0.0, outer_cone_angle: std::f32::consts::FRAC_PI_4 }
    }
}

impl Spot {
    /// Whether it fades towards its edge.
    pub(super) fn is_soft(self) -> bool {
        self.inner_cone_angle < self.outer_cone_angle
    }
}

/// One of the scenes of a file.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Shown {
    pub nodes: Vec<Index>,
}

/// A node: a transform, and what is there.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub name: Option<String>,
    pub camera: Option<Index>,
    #[serde(deserialize_with = "given")]
    pub children: Vec<Index>,
    #[serde(deserialize_with = "given")]
    pub extensions: NodeExtensions,
    pub matrix: Option<[f32; 16]>,
    pub mesh: Option<Index>,
    pub rotation: Option<[f32; 4]>,
    pub scale: Option<[f32; 3]>,
    pub translation: Option<[f32; 3]>,
    pub skin: Option<Index>,
    #[serde(deserialize_with = "given")]
    pub weights: Vec<f32>,
}

/// Extensions of a node.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub light: Option<LightOfNode>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
}

/// The light at a node.
#[derive(Deserialize)]
pub(super) struct LightOfNode {
    pub light: Index,
}

/// Accessors of the transforms of a mesh's instances.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Instancing {
    #[serde(deserialize_with = "given")]
    pub attributes: BTreeMap<String, Index>,
}

/// A skin: the nodes that move a mesh, and the matrices that bind it to them.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Skin {
    pub inverse_bind_matrices: Option<Index>,
    pub joints: Vec<Index>,
}

/// A camera, with what it needs if it is a perspective one.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Camera {
    pub name: Option<String>,
    pub perspective: Option<Perspective>,
}

/// The view of a perspective camera.
#[derive(Deserialize)]
pub(super) struct Perspective {
    /// Vertical field of view, radians.
    pub yfov: f32,
}

/// A mesh.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    /// How much of each morph target there is.
    #[serde(deserialize_with = "given")]
    pub weights: Vec<f32>,
}

/// A part of a mesh, of one material.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Primitive {
    /// Accessors by what they are.
    #[serde(deserialize_with = "given")]
    pub attributes: BTreeMap<String, Index>,
    #[serde(deserialize_with = "given")]
    pub extensions: PrimitiveExtensions,
    pub indices: Option<Index>,
    pub material: Option<Index>,
    pub mode: Option<Whole>,
    #[serde(deserialize_with = "given")]
    pub targets: Vec<IgnoredAny>,
}

/// Extensions of a part of a mesh.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<IgnoredAny>,
}

/// Numbers in a buffer.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<Index>,
    #[serde(deserialize_with = "given")]
    pub byte_offset: Whole,
    pub component_type: Whole,
    pub count: Whole,
    #[serde(deserialize_with = "given")]
    pub normalized: bool,
    pub sparse: Option<Sparse>,
    #[serde(rename = "type")]
    pub kind: String,
}

/// Elements of an accessor that differ from what it begins with.
#[derive(Deserialize)]
pub(super) struct Sparse {
    pub count: Whole,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

/// Which elements differ.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub buffer_view: Index,
    #[serde(default)]
    pub byte_offset: Whole,
    pub component_type: Whole,
}

/// What they are.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub buffer_view: Index,
    #[serde(default)]
    pub byte_offset: Whole,
}

/// A part of a buffer.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub buffer: Index,
    #[serde(default, deserialize_with = "given")]
    pub byte_offset: Whole,
    pub byte_length: Whole,
    /// Bytes from element to element; 0 where they follow each other.
    #[serde(default, deserialize_with = "given")]
    pub byte_stride: Whole,
}

/// A buffer.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Buffer {
    pub byte_length: Whole,
    pub uri: Option<String>,
}

/// A material.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Material {
    pub name: Option<String>,
    pub alpha_cutoff: Option<f32>,
    pub alpha_mode: Option<String>,
    #[serde(deserialize_with = "given")]
    pub double_sided: bool,
    #[serde(deserialize_with = "given")]
    pub emissive_factor: [f32; 3],
    pub emissive_texture: Option<TextureInfo>,
    #[serde(deserialize_with = "given")]
    pub extensions: MaterialExtensions,
    pub normal_texture: Option<IgnoredAny>,
    pub occlusion_texture: Option<IgnoredAny>,
    #[serde(deserialize_with = "given")]
    pub pbr_metallic_roughness: MetallicRoughness,
}

/// The base colour, and what is metal and rough.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct MetallicRoughness {
    pub base_color_factor: [f32; 4],
    pub base_color_texture: Option<TextureInfo>,
    pub metallic_factor: f32,
    pub metallic_roughness_texture: Option<IgnoredAny>,
    pub roughness_factor: f32,
}

impl Default for MetallicRoughness {
    fn default() -> MetallicRoughness {
        MetallicRoughness {
            base_color_factor: [1.0; 4],
            base_color_texture: None,
            metallic_factor: 1.0,
            metallic_roughness_texture: None,
            roughness_factor: 1.0,
        }
    }
}

/// Extensions of a material.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub specular_glossiness: Option<SpecularGlossiness>,
}

/// A factor on what is emitted.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct EmissiveStrength {
    pub emissive_strength: f32,
}

impl Default for EmissiveStrength {
    fn default() -> EmissiveStrength {
        EmissiveStrength { emissive_strength: 1.0 }
    }
}

/// What stands for the base colour, and what is mirrored.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SpecularGlossiness {
    pub diffuse_factor: [f32; 4],
    pub diffuse_texture: Option<TextureInfo>,
    pub specular_factor: [f32; 3],
    pub specular_glossiness_texture: Option<IgnoredAny>,
}

impl Default for SpecularGlossiness {
    fn default() -> SpecularGlossiness {
        SpecularGlossiness {
            diffuse_factor: [1.0; 4],
            diffuse_texture: None,
            specular_factor: [1.0; 3],
            specular_glossiness_texture: None,
        }
    }
}

/// A texture as a material uses it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureInfo {
    pub index: Index,
    /// The set of coordinates that it goes by.
    #[serde(default, deserialize_with = "given")]
    pub tex_coord: Whole,
    #[serde(default, deserialize_with = "given")]
    pub extensions: TextureInfoExtensions,
}

/// Extensions of a texture as a material uses it.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

/// Where a texture lies in the plane of coordinates.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct TextureTransform {
    pub offset: [f32; 2],
    /// Radians.
    pub rotation: f32,
    pub scale: [f32; 2],
    pub tex_coord: Option<Whole>,
}

impl Default for TextureTransform {
    fn default() -> TextureTransform {
        TextureTransform { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

/// A texture: an image, and how it is sampled.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Texture {
    pub sampler: Option<Index>,
    pub source: Option<Index>,
    #[serde(deserialize_with = "given")]
    pub extensions: TextureExtensions,
}

/// Images in other formats than PNG and JPEG.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    pub webp: Option<OtherSource>,
    #[serde(rename = "KHR_texture_basisu")]
    pub basisu: Option<OtherSource>,
    #[serde(rename = "EXT_texture_avif")]
    pub avif: Option<OtherSource>,
    #[serde(rename = "MSFT_texture_dds")]
    pub dds: Option<OtherSource>,
}

/// An image in another format.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct OtherSource {
    pub source: Option<Index>,
}

/// How a texture goes on beyond its edges, and between its texels.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Sampler {
    pub mag_filter: Option<f64>,
    pub wrap_s: Option<f64>,
    pub wrap_t: Option<f64>,
}

/// An image.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Image {
    pub buffer_view: Option<Index>,
    pub uri: Option<String>,
}
