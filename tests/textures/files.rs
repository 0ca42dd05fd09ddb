//! Images as MTL files name them: found, shared, missing, broken.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use halflight::Scene;
use halflight::scene::SceneError;
use tempfile::TempDir;

const OBJ: &str = "mtllib lib/m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                   usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/-4 3/-2 4/-1\n";

fn loaded(mtl: &str, files: &[&str]) -> (TempDir, Result<Scene, SceneError>) {
    let place = TempDir::new().unwrap();
    fs::create_dir(place.path().join("lib")).unwrap();
    fs::write(place.path().join("s.obj"), OBJ).unwrap();
    fs::write(place.path().join("lib/m.mtl"), mtl).unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/textured/checker.png");
    for file in files {
        fs::copy(&data, place.path().join(file)).unwrap();
    }
    let scene = Scene::open(&place.path().join("s.obj").to_string_lossy());
    (place, scene)
}

#[test]
fn one_image_serves_many_materials_wherever_it_lies() {
    for (written, file) in [
        ("wall.png", "lib/wall.png"),
        ("wall.png", "wall.png"),
        (".\\wall.png", "lib/wall.png"),
        ("C:\\somebody\\my textures\\my wall.png", "lib/my wall.png"),
    ] {
        let mtl = format!("newmtl a\nKd 0.5 0.5 0.5\nmap_Kd {written}\nnewmtl b\nmap_Kd -clamp on {written}\n");
        let scene = loaded(&mtl, &[file]).1.unwrap();
        assert_eq!(scene.warnings, [""; 0], "{written}");
        let [a, b] = [0, 1].map(|m| scene.materials[m].maps.as_ref().unwrap().reflectance.as_ref().unwrap());
        assert!(Arc::ptr_eq(&a.image, &b.image), "{written}");
        // Without Kd the texture counts alone.
        assert_eq!([scene.materials[0].rho.x, scene.materials[1].rho.x], [0.5, 1.0]);
        assert_eq!(scene.coordinates[1].map(|at| at.to_array()), [[0., 0.], [1., 1.], [0., 1.]]);
    }
}

#[test]
fn images_that_cannot_be_read_leave_the_plain_numbers() {
    let mtl = "newmtl a\nKd 0.5 0.5 0.5\nmap_Kd lost.png\nmap_Bump x.png\nnewmtl b\nmap_Kd wall.dds\n";
    let scene = loaded(mtl, &[]).1.unwrap();
    assert_eq!([scene.materials[0].rho.x, scene.materials[1].rho.x], [0.5, 0.8]);
    assert!(scene.materials.iter().all(|m| m.maps.is_none()) && scene.coordinates.is_empty());
    let all = scene.warnings.join("\n");
    assert_eq!(scene.warnings.len(), 2, "{all}");
    assert!(
        all.contains("2 missing map_Kds of materials a, b (first: lib/m.mtl, line 3): lost.png, wall.dds"),
        "{all}"
    );
    assert!(all.contains("1 texture of material `a` (first: lib/m.mtl, line 4)"), "{all}");
}

#[test]
fn a_broken_image_is_an_error_with_its_line() {
    let (place, _) = loaded("newmtl a\n\nmap_Kd wall.png\n", &[]);
    fs::write(place.path().join("lib/wall.png"), b"\x89PNG\r\n\x1a\nand no more").unwrap();
    let error = Scene::open(&place.path().join("s.obj").to_string_lossy()).unwrap_err();
    assert!(error.to_string().starts_with("lib/m.mtl, line 3: the image `wall.png` is broken: "), "{error}");
}

#[test]
fn images_of_unused_materials_are_not_read() {
    let scene = loaded("newmtl a\nKd .5\nnewmtl b\nKd .5\nnewmtl c\nKd .5\nmap_Kd lost.png\n", &[]).1.unwrap();
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn faces_without_coordinates_are_counted() {
    let (place, _) = loaded("newmtl a\nmap_Kd wall.png\nnewmtl b\nKd .5\n", &["wall.png"]);
    let obj = OBJ.replace("f 1/1 2/2 3/3", "f 1 2 3\nf 1/1 2/9 3/1\nf 1/1 2/2 3/3");
    fs::write(place.path().join("s.obj"), obj).unwrap();
    let scene = Scene::open(&place.path().join("s.obj").to_string_lossy()).unwrap();
    assert_eq!(scene.warnings.len(), 2, "{:?}", scene.warnings);
    assert!(scene.warnings[1].contains("in one place"), "{}", scene.warnings[1]);
    assert!(scene.warnings[0].starts_with("2 textured faces of material `a` (first: "), "{}", scene.warnings[0]);
}
