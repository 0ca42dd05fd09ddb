//! From polygons in the file's units to a checked [`Scene`] in unit coordinates.
//!
//! Centre and scale are found and applied in double precision and only the result is rounded, so neither the size of
//! a scene nor its distance from the origin changes the unit coordinates beyond single precision. Points that
//! coincide there are made one. Triangles thinner than [`THINNEST`] are dropped, and of those in one place all but one
//! ([`crate::scene::coincident`]).
//!
//! Not handled: what polygons stand for; [`crate::scene::obj`] and [`crate::scene::gltf`] read them.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec4};

use crate::light::Gloss;
use crate::scene::coincident::{Origin, resolve};
use crate::scene::error::{About, Effect, Place, SceneError, Tally, ViewError, Warning};
use crate::scene::model::{Camera, Face, Material, NamedCamera, Scene, UnitFrame};
use crate::scene::polygon::{Cover, MOST_CORNERS, Points, THINNEST, Triangulator, height};
use crate::scene::punctual::{PunctualForm, PunctualLight, PunctualPlace};
use crate::scene::soup::{Polygon, Soup, SoupCamera, check_emission, check_gloss, check_rho};
use crate::scene::unit::LengthUnit;

/// A polygon of a scene that is made from arrays.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GivenFace {
    /// Numbers of its vertices, counter-clockwise seen from the front.
    pub corners: Vec<u32>,
    /// The number of its material.
    pub material: u32,
    /// The number of its object.
    pub object: u32,
}

/// A scene as arrays: all numbers in the file's units, all indices from 0.
#[derive(Clone, Debug, Default)]
pub struct SceneArrays {
    /// What it is called.
    pub name: String,
    /// Corner points.
    pub vertices: Vec<DVec3>,
    /// Texture coordinates of each vertex; empty where no material has an image.
    pub coordinates: Vec<Vec2>,
    /// Polygons.
    pub faces: Vec<GivenFace>,
    /// What they are made of.
    pub materials: Vec<Material>,
    /// Names of the objects.
    pub objects: Vec<String>,
    /// Lights without area: directions of length 1, `1/d²` in metres.
    pub lights: Vec<PunctualLight>,
    /// Unit of all lengths.
    pub unit: LengthUnit,
}

impl Scene {
    /// A scene from arrays: vertices in any unit, faces as (corners counter-clockwise seen from the front, material),
    /// all of one object, which has the scene's name.
    ///
    /// Checks, unit frame and camera are those of files. Corners and materials count from 0.
    ///
    /// # Errors
    /// The first vertex, face or material that breaks a rule of [`Scene`], or no face with area.
    pub fn from_faces(
        name: &str,
        vertices: &[DVec3],
        faces: &[(Vec<u32>, u32)],
        materials: Vec<Material>,
    ) -> Result<Scene, SceneError> {
        let face = |(corners, material): &(Vec<u32>, u32)| GivenFace {
            corners: corners.clone(),
            material: *material,
            object: 0,
        };
        let faces: Vec<GivenFace> = faces.iter().map(face).collect();
        Scene::from_objects(name, vertices, &faces, materials, vec![name.to_owned()])
    }

    /// A scene from faces of several objects, which count from 0 too.
    ///
    /// # Errors
    /// As [`Scene::from_faces`].
    pub fn from_objects(
        name: &str,
        vertices: &[DVec3],
        faces: &[GivenFace],
        materials: Vec<Material>,
        objects: Vec<String>,
    ) -> Result<Scene, SceneError> {
        let (name, vertices, faces) = (name.to_owned(), vertices.to_vec(), faces.to_vec());
        Scene::from_arrays(SceneArrays { name, vertices, faces, materials, objects, ..SceneArrays::default() })
    }

    /// A scene from arrays, with textures and lights without area.
    ///
    /// # Errors
    /// As [`Scene::from_faces`], and for a light that is not finite or negative.
    pub fn from_arrays(arrays: SceneArrays) -> Result<Scene, SceneError> {
        let SceneArrays { name, vertices, coordinates, faces, mut materials, objects, lights, unit } = arrays;
        check_arrays(&name, &vertices, &materials)?;
        check_lights(&name, &lights)?;
        check_faces(&name, &faces, [vertices.len(), materials.len(), objects.len()])?;
        for material in &mut materials {
            if let Some(maps) = material.maps.take() {
                material.set_maps(Arc::unwrap_or_clone(maps));
            }
        }
        let polygon = |(number, face): (usize, &GivenFace)| Polygon {
            corners: face.corners.len(),
            material: face.material,
            object: face.object,
            number,
        };
        let corners: Vec<u32> = faces.iter().flat_map(|face| face.corners.iter().copied()).collect();
        let at = |&corner: &u32| coordinates.get(corner as usize).copied().unwrap_or_default();
        let has_images = materials.iter().any(Material::has_images);
        assemble(&Soup {
            file: name.clone(),
            name,
            item: "face",
            unit: Some(unit),
            vertices,
            coordinates: if has_images { corners.iter().map(at).collect() } else { Vec::new() },
            corners,
            polygons: faces.iter().enumerate().map(polygon).collect(),
            materials,
            objects,
            lights,
            ..Soup::default()
        })
    }
}

fn check_lights(name: &str, lights: &[PunctualLight]) -> Result<(), SceneError> {
    for (number, light) in lights.iter().enumerate() {
        let named = light.name.as_deref().unwrap_or("light");
        check_emission(light.intensity.as_dvec3().to_array(), named, || Place::item(name, "light", number))?;
    }
    Ok(())
}

fn check_arrays(name: &str, vertices: &[DVec3], materials: &[Material]) -> Result<(), SceneError> {
    if let Some(number) = vertices.iter().position(|vertex| !vertex.is_finite()) {
        let (statement, word) = ("vertex".to_owned(), vertices[number].to_string());
        return Err(SceneError::NotFinite { place: Place::item(name, "vertex", number), statement, word });
    }
    for (number, material) in materials.iter().enumerate() {
        let place = || Place::item(name, "material", number);
        check_rho(material.rho.as_dvec3().to_array(), &material.name, place)?;
        check_emission(material.emission.as_dvec3().to_array(), &material.name, place)?;
        if let Some(Gloss { specular, exponent }) = material.gloss {
            check_gloss(&specular.extend(exponent).to_array().map(f64::from), &material.name, place)?;
        }
        material.check_transport().map_err(|source| SceneError::Transport { place: place(), source })?;
    }
    Ok(())
}

/// Checks faces of so many vertices, materials and objects.
fn check_faces(name: &str, faces: &[GivenFace], [vertices, materials, objects]: [usize; 3]) -> Result<(), SceneError> {
    for (number, face) in faces.iter().enumerate() {
        let place = Place::item(name, "face", number);
        check_corners(&place, &face.corners, vertices)?;
        if face.material as usize >= materials {
            return Err(SceneError::MaterialOutOfRange { place, index: face.material, materials });
        }
        if face.object as usize >= objects {
            return Err(SceneError::ObjectOutOfRange { place, index: face.object, objects });
        }
    }
    Ok(())
}

fn check_corners(place: &Place, corners: &[u32], vertices: usize) -> Result<(), SceneError> {
    let place = || place.clone();
    let (found, limit) = (corners.len(), MOST_CORNERS);
    if found < 3 {
        return Err(SceneError::TooFewCorners { place: place(), found });
    }
    if found > limit {
        return Err(SceneError::TooManyCorners { place: place(), found, limit });
    }
    if let Some(corner) = corners.iter().find(|&&corner| corner as usize >= vertices) {
        return Err(SceneError::IndexOutOfRange { place: place(), index: corner.to_string(), vertices });
    }
    Ok(())
}

/// Makes the scene: frame, triangles, points, camera.
pub(crate) fn assemble(soup: &Soup) -> Result<Scene, SceneError> {
    let Triangulated { mut scene, mut points, numbers, .. } = Triangulated::new(soup)?;
    let origin = Origin { file: &soup.file, item: soup.item, numbers: &numbers };
    resolve(&mut scene, &mut points, &origin);
    scene.camera = match scene.cameras.first() {
        Some(own) => own.camera,
        None if soup.has_view => Camera::NOWHERE,
        None => Camera::framing(&scene),
    };
    Ok(scene)
}

/// All triangles of a file, of which some may lie in one place, without a camera.
pub(super) struct Triangulated {
    pub scene: Scene,
    points: Points,
    /// Of the polygons that the faces are parts of, for messages.
    numbers: Vec<usize>,
    /// Their places in the list of polygons.
    pub polygons: Vec<usize>,
}

impl Triangulated {
    pub(super) fn new(soup: &Soup) -> Result<Triangulated, SceneError> {
        let empty = || SceneError::Empty { file: soup.file.clone(), dropped: soup.polygons.len() };
        let frame = soup.frame().ok_or_else(empty)?;
        let (mut mesh, mut warnings) = (Mesh::default(), soup.warnings.clone());
        mesh.add_polygons(soup, &frame, &mut warnings);
        if mesh.faces.is_empty() {
            return Err(empty());
        }
        let scene = Scene {
            cameras: cameras(soup, &frame)?,
            lights: lights(soup, &frame)?,
            name: soup.name.clone(),
            vertices: std::mem::take(&mut mesh.points.list),
            faces: mesh.faces,
            exact: mesh.exact,
            coordinates: mesh.coordinates,
            colours: mesh.colours,
            materials: soup.materials.clone(),
            objects: soup.objects.clone(),
            sky: None,
            camera: Camera::NOWHERE,
            frame,
            transport: None,
            warnings,
        };
        Ok(Triangulated { scene, points: mesh.points, numbers: mesh.numbers, polygons: mesh.polygons })
    }
}

/// The file's cameras in unit coordinates.
fn cameras(soup: &Soup, frame: &UnitFrame) -> Result<Vec<NamedCamera>, SceneError> {
    let place = |number| Place::item(&soup.file, "camera", number);
    let one = |(number, read): (usize, &SoupCamera)| {
        let position = frame.to_unit(read.position).as_vec3();
        let camera = Camera { position, ..read.view };
        let finite = position.is_finite().then(|| NamedCamera { name: read.name.clone(), camera });
        finite.ok_or_else(|| SceneError::View { place: place(number), source: ViewError::NotFinite })
    };
    soup.cameras.iter().enumerate().map(one).collect()
}

/// The file's lights in unit coordinates.
fn lights(soup: &Soup, frame: &UnitFrame) -> Result<Vec<PunctualLight>, SceneError> {
    let placed =
        |place: PunctualPlace| PunctualPlace::new(frame.to_unit(place.position), place.attenuation, frame.in_metres());
    let mut all = soup.lights.clone();
    for (number, light) in all.iter_mut().enumerate() {
        if let PunctualForm::Point { place, .. } = &mut light.form {
            *place = placed(*place);
            if !place.position.as_vec3().is_finite() {
                let (statement, word) = ("light".to_owned(), place.position.to_string());
                return Err(SceneError::NotFinite { place: Place::item(&soup.file, "light", number), statement, word });
            }
        }
    }
    Ok(all)
}

/// Triangles and their points; equal points are one.
#[derive(Default)]
struct Mesh {
    points: Points,
    faces: Vec<Face>,
    exact: Vec<[DVec3; 3]>,
    coordinates: Vec<[Vec2; 3]>,
    colours: Vec<[Vec4; 3]>,
    /// Of the polygons that the faces are parts of.
    numbers: Vec<usize>,
    /// Their places in the list of polygons.
    polygons: Vec<usize>,
}

impl Mesh {
    fn add_polygons(&mut self, soup: &Soup, frame: &UnitFrame, warnings: &mut Vec<Warning>) {
        let unit: Vec<DVec3> = soup.vertices.iter().map(|&v| frame.to_unit(v)).collect();
        let (mut flat, mut crossing) = (Tally::default(), Tally::default());
        let (mut triangulator, mut points) = (Triangulator::default(), Vec::new());
        for (place, (own, polygon)) in soup.ranges().enumerate() {
            points.clear();
            points.extend(soup.corners[own.clone()].iter().map(|&v| unit[v as usize]));
            if triangulator.run(&points) == Cover::Crossing {
                crossing.add(polygon.number);
            }
            let before = self.faces.len();
            for triangle in &triangulator.triangles {
                let corners = triangle.map(|i| own.start + i as usize);
                let added = self.add_triangle(triangle.map(|i| points[i as usize]), polygon);
                if added && !soup.coordinates.is_empty() {
                    let at = |i: usize| soup.coordinates.get(i).copied().unwrap_or_default();
                    self.coordinates.push(corners.map(at));
                }
                if added && !soup.colours.is_empty() {
                    let at = |i: usize| soup.colours.get(i).copied().unwrap_or(Vec4::ONE);
                    self.colours.push(corners.map(at));
                }
            }
            self.polygons.resize(self.faces.len(), place);
            if self.faces.len() == before {
                flat.add_named(polygon.number, &soup.materials[polygon.material as usize].name);
            }
        }
        let place = (soup.file.as_str(), soup.item);
        flat.report(About::Shape(Effect::Simplified), place, "face", "dropped, having no area", warnings);
        let consequence = "an outline that crosses itself has no inside, so the triangles are a guess";
        crossing.report(About::Shape(Effect::Guessed), place, "polygon", consequence, warnings);
    }

    /// Adds a triangle, unless it is too thin; whether it was added.
    fn add_triangle(&mut self, exact: [DVec3; 3], polygon: &Polygon) -> bool {
        let corners = exact.map(|corner| corner.as_vec3());
        let thick = height(corners) >= THINNEST;
        if thick {
            // Adding zero makes -0 and 0 one point.
            self.exact.push(exact.map(|corner| corner + DVec3::ZERO));
            let vertices = corners.map(|corner| self.points.number(corner));
            let (material, object) = (polygon.material, polygon.object);
            self.faces.push(Face { vertices, material, object });
            self.numbers.push(polygon.number);
        }
        thick
    }
}
