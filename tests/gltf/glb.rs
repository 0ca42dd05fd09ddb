//! Writes glTF from numbers: a GLB of any JSON, and the GLB of a scene's triangles.

use halflight::scene::{Scene, Sides};
use serde_json::{Value, json};

/// A GLB of a JSON chunk and a binary one.
pub fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], bytes: &[u8], filler: u8| {
        let length = bytes.len().next_multiple_of(4);
        let mut chunk = [&(length as u32).to_le_bytes(), kind.as_slice(), bytes].concat();
        chunk.resize(8 + length, filler);
        chunk
    };
    let chunks = [chunk(b"JSON", json.as_bytes(), b' '), chunk(b"BIN\0", binary, 0)].concat();
    let words = [2, 12 + chunks.len() as u32].map(u32::to_le_bytes);
    [b"glTF".as_slice(), words.as_flattened(), &chunks].concat()
}

/// Points in single precision, and indices of two bytes behind them.
pub fn bytes(points: &[[f32; 3]], indices: &[u16]) -> Vec<u8> {
    let points = points.as_flattened().iter().flat_map(|x| x.to_le_bytes());
    points.chain(indices.iter().flat_map(|i| i.to_le_bytes())).collect()
}

/// A GLB of a scene: faces in their order, a node and a mesh for each run of one object, a primitive for each of its
/// materials, three points for each face.
pub fn export(scene: &Scene) -> Vec<u8> {
    let (mut binary, mut accessors, mut views) = (Vec::new(), Vec::new(), Vec::new());
    let (mut meshes, mut nodes): (Vec<Value>, Vec<Value>) = (Vec::new(), Vec::new());
    let faces: Vec<u32> = (0..scene.faces.len() as u32).collect();
    for run in faces.chunk_by(|a, b| scene.faces[*a as usize].object == scene.faces[*b as usize].object) {
        let mut primitives = Vec::new();
        for same in run.chunk_by(|a, b| scene.faces[*a as usize].material == scene.faces[*b as usize].material) {
            let corner = |p| scene.frame.to_file(p).as_vec3().to_array();
            let points: Vec<[f32; 3]> = same.iter().flat_map(|f| scene.exact_corners(*f).map(corner)).collect();
            let bytes = bytes(&points, &[]);
            let number = accessors.len();
            views.push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len()}));
            accessors.push(json!({"bufferView": number, "componentType": 5126, "count": points.len(), "type": "VEC3"}));
            binary.extend(bytes);
            let material = scene.faces[same[0] as usize].material;
            primitives.push(json!({"attributes": {"POSITION": number}, "material": material}));
        }
        let name = &scene.objects[scene.faces[run[0] as usize].object as usize];
        nodes.push(json!({"mesh": meshes.len(), "name": name}));
        meshes.push(json!({"primitives": primitives}));
    }
    let materials: Vec<Value> = scene.materials.iter().map(material).collect();
    let json = json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}], "nodes": nodes,
        "meshes": meshes, "materials": materials, "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": binary.len()}],
    });
    glb(&json.to_string(), &binary)
}

fn material(material: &halflight::scene::Material) -> Value {
    let (rho, emission) = (material.rho, material.emission);
    let strength = emission.max_element().max(1.0);
    json!({
        "name": material.name,
        "pbrMetallicRoughness": {"baseColorFactor": [rho.x, rho.y, rho.z, 1.0], "metallicFactor": 0},
        "emissiveFactor": (emission / strength).to_array(),
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength}},
        "doubleSided": material.sides == Sides::Two,
    })
}
