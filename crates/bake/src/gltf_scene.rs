//! A scene of any kind as a glTF file with a lightmap: its parts as meshes, its materials, and its camera.
//!
//! ```text
//! rho        base colour, with its texture         E    emissive factor times KHR_materials_emissive_strength
//! gloss      none: KHR_materials_specular of factor 0
//! positions  metres                                 TEXCOORD_0 the texture's, TEXCOORD_1 the map's
//! ```
//!
//! Not handled: masks, colours of vertices, textures of emission, punctual lights, the sky.

use glam::{DVec2, Vec3, Vec4};
use halflight::Scene;
use halflight::pictures::encode_texels;
use halflight::scene::textures::Wrap;
use halflight::scene::{Material, Sides};
use serde_json::{Value, json};

use crate::error::BakeError;
use crate::glb::{Glb, lightmap_sampler};
use crate::layout::Layout;
use crate::parts::{Part, SceneFaces};

/// The bytes of the `.glb` file; `png` has the map, to be multiplied by `intensity`.
pub(crate) fn scene_with_lightmap(
    scene: &Scene,
    (parts, faces): (&[Part], &[SceneFaces]),
    layout: &Layout,
    (png, intensity): (&[u8], f32),
) -> Result<Vec<u8>, BakeError> {
    let root = json!({ "asset": { "version": "2.0", "generator": "halflight" }, "scene": 0 });
    let mut glb = Glb { root, binary: Vec::new() };
    for material in &scene.materials {
        let own = material_of(&mut glb, material)?;
        glb.push("materials", own);
    }
    let mut nodes = Vec::new();
    for (number, (part, own)) in parts.iter().zip(faces).enumerate() {
        let mesh = mesh_of(&mut glb, scene, (part, own), &layout.shares(number));
        let mesh = glb.push("meshes", mesh);
        nodes.push(glb.push("nodes", json!({ "name": part.name, "mesh": mesh })));
    }
    nodes.push(camera(&mut glb, scene));
    glb.push("scenes", json!({ "name": scene.name, "nodes": nodes }));
    let texture = glb.texture("lightmap", png, lightmap_sampler());
    glb.light(texture, intensity);
    Ok(glb.bytes())
}

/// A diffuse material.
fn material_of(glb: &mut Glb, material: &Material) -> Result<Value, BakeError> {
    let Vec3 { x, y, z } = material.rho;
    let mut diffuse = json!({ "baseColorFactor": [x, y, z, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 });
    if let Some(texture) = material.maps.as_ref().and_then(|maps| maps.reflectance.as_ref()) {
        let png = encode_texels(texture.image.texels())?;
        let wrap = |wrap: Wrap| match wrap {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        };
        let [s, t] = texture.wrap.map(wrap);
        let sampler = json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": s, "wrapT": t });
        diffuse["baseColorTexture"] = json!({ "index": glb.texture(&material.name, &png, sampler) });
    }
    let matt = json!({ "KHR_materials_specular": { "specularFactor": 0.0 } });
    let mut own = json!({ "name": material.name, "pbrMetallicRoughness": diffuse, "extensions": matt });
    glb.uses("KHR_materials_specular");
    if material.sides == Sides::Two {
        own["doubleSided"] = true.into();
    }
    let strength = material.emission.max_element();
    if strength > 0.0 {
        own["emissiveFactor"] = json!((material.emission / strength).to_array());
        own["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
        glb.uses("KHR_materials_emissive_strength");
    }
    Ok(own)
}

/// The mesh of a part: three vertices a triangle, with its normal.
fn mesh_of(glb: &mut Glb, scene: &Scene, (part, own): (&Part, &SceneFaces), shares: &[[DVec2; 3]]) -> Value {
    let metres = scene.frame.metres;
    let triangles = &part.triangles;
    let points: Vec<Vec3> = triangles.iter().flat_map(|t| t.corners).map(|p| (metres * p).as_vec3()).collect();
    let normals: Vec<Vec3> = triangles.iter().flat_map(|t| [t.normal().as_vec3(); 3]).collect();
    let second: Vec<DVec2> = shares.iter().flatten().copied().collect();
    let mut attributes = json!({ "POSITION": glb.positions(&points), "NORMAL": glb.normals(&normals),
        "TEXCOORD_1": glb.coordinates(&second) });
    let maps = scene.materials[own.material as usize].maps.as_ref();
    if let Some(texture) = maps.and_then(|maps| maps.reflectance.as_ref()) {
        let place = |&face: &u32| scene.coordinates.get(face as usize).copied().unwrap_or_default();
        let of = |at: glam::Vec2| texture.placement.transform_point2(at.as_dvec2());
        let first: Vec<DVec2> = own.faces.iter().flat_map(place).map(of).collect();
        attributes["TEXCOORD_0"] = glb.coordinates(&first).into();
    } else {
        // Readers that name sets by their order expect the first before the second.
        attributes["TEXCOORD_0"] = attributes["TEXCOORD_1"].clone();
    }
    json!({ "name": part.name, "primitives": [{ "attributes": attributes, "material": own.material }] })
}

/// The scene's camera as a node.
fn camera(glb: &mut Glb, scene: &Scene) -> usize {
    let own = &scene.camera;
    let eye = (scene.frame.metres * scene.frame.to_file(own.position.as_dvec3())).as_vec3();
    let column = |axis: Vec3, w: f32| axis.extend(w).to_array();
    let columns: [[f32; 4]; 4] =
        [column(own.right, 0.0), column(own.up, 0.0), column(-own.forward, 0.0), Vec4::from((eye, 1.0)).to_array()];
    let size = scene.frame.in_metres();
    let yfov = own.vertical_fov.to_radians();
    let perspective = json!({ "yfov": yfov, "znear": 1e-3 * size, "zfar": 1e2 * size });
    let camera = glb.push("cameras", json!({ "type": "perspective", "perspective": perspective }));
    glb.push("nodes", json!({ "name": "camera", "camera": camera, "matrix": columns.concat() }))
}
