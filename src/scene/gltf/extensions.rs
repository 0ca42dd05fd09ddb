//! What extensions of glTF mean for a picture: which are read, which change nothing in it, and what is not there of the
//! others.
//!
//! Not handled: what the extensions hold.

/// Extensions that are read.
const READ: [&str; 7] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
];

/// Extensions that only give where texels come from: their textures are told of one by one.
const OF_TEXTURES: [&str; 3] = ["KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"];

/// Extensions that change nothing in a picture of diffuse surfaces at rest, by how their names begin: what objects are
/// called, made of, sound and weigh, how they move, and how they are kept.
const SILENT: [&str; 26] = [
    "KHR_xmp",
    "KHR_animation_pointer",
    "KHR_audio",
    "KHR_accessor_float64",
    "KHR_collision_shapes",
    "KHR_physics",
    "KHR_implicit_shapes",
    "KHR_interactivity",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_structural_metadata",
    "EXT_collada",
    "AGI_",
    "CESIUM_RTC",
    "CESIUM_primitive_outline",
    "FB_geometry_metadata",
    "GODOT_single_root",
    "MSFT_audio_emitter",
    "MSFT_packing",
    "OMI_",
    "VRMC_springBone",
    "VRMC_node_constraint",
];

/// Extensions whose content is given without them too, unless they are required.
const BESIDE: [&str; 3] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// What is not in the picture of the others, by how their names begin.
const LOST: [(&str, &str); 16] = [
    ("KHR_materials_unlit", "these surfaces reflect light by their base colour, instead of showing it unlit"),
    ("KHR_materials_transmission", "no light goes through these surfaces but by their alpha"),
    ("KHR_materials_diffuse_transmission", "no light goes through these surfaces but by their alpha"),
    ("KHR_materials_volume", "nothing is clouded or coloured by what light goes through"),
    ("KHR_materials_ior", "surfaces mirror nothing and light is not bent"),
    ("KHR_materials_dispersion", "light is not bent"),
    ("KHR_materials_variants", "the materials that count without a choice are shown"),
    ("KHR_materials_", "surfaces are diffuse, of their base colour alone"),
    ("ADOBE_materials_", "surfaces are diffuse, of their base colour alone"),
    ("EXT_lights_image_based", "its light is not there: [sky] of a scene file gives a sky"),
    ("EXT_lights_ies", "its luminaires are not there: [[lights]] of a scene file gives such"),
    ("EXT_lights", "its lights are not there"),
    ("KHR_node_visibility", "nodes that it hides are shown"),
    ("MSFT_lod", "only the finest of its levels is shown, which is that of the node"),
    ("KHR_gaussian_splatting", "its splats are not there"),
    ("EXT_primitive_voxels", "its voxels are not there"),
];

/// What the picture lacks of an extension that a file uses; none where it lacks nothing.
pub(super) fn lost(extension: &str) -> Option<&'static str> {
    let silent = SILENT.iter().any(|known| extension.starts_with(known));
    if silent || [&READ[..], &OF_TEXTURES, &BESIDE].concat().contains(&extension) {
        return None;
    }
    let known = LOST.iter().find(|(known, _)| extension.starts_with(known));
    Some(known.map_or("what it says is not in the picture", |(_, lost)| lost))
}

/// Whether a picture without an extension that is required would be of another thing.
pub(super) fn is_needed(extension: &str) -> bool {
    BESIDE.contains(&extension) || lost(extension).is_some()
}
