//! From polygons in the file's units to a checked [`Scene`] in unit coordinates.
//!
//! Center and scale are found and applied in double precision and only the result is rounded, so neither the size of
//! a scene nor its distance from the origin changes the unit coordinates beyond single precision. Points that
//! coincide there are made one. Triangles thinner than [`THINNEST`] are dropped, and of those in one place all but one
//! ([`crate::scene::coincident`]).
//!
//! Not handled: what polygons stand for; [`crate::scene::obj`] and [`crate::scene::gltf`] read them.

use glam::{DVec3, Vec2, Vec4};

use crate::light::Gloss;
use crate::scene::camera::ViewError;
use crate::scene::coincident::{Source, resolve};
use crate::scene::error::{Place, SceneError};
use crate::scene::material_checks::{check_emission, check_gloss, check_rho};
use crate::scene::points::{Points, THINNEST, height};
use crate::scene::polygon::{Cover, MOST_CORNERS, Triangulator};
use crate::scene::punctual::{PunctualForm, PunctualLight, PunctualPlace};
use crate::scene::warnings::Tally;
use crate::scene::{Camera, Face, Material, NamedCamera, Scene, UnitFrame};

/// Polygons as read, in the file's units.
#[derive(Debug, Default)]
pub(crate) struct Soup {
    /// The scene's name.
    pub name: String,
    /// The file, or the name again where there is none.
    pub file: String,
    /// What `Polygon::number` counts: `line`, `face` or `triangle`.
    pub item: &'static str,
    pub vertices: Vec<DVec3>,
    /// The corners of all polygons, one after the other.
    pub corners: Vec<u32>,
    /// Texture coordinates of the corners, as many or none; (0, 0) for corners beyond them.
    pub coordinates: Vec<Vec2>,
    /// Linear RGB and alpha of the corners, as many or none.
    pub colours: Vec<Vec4>,
    pub polygons: Vec<Polygon>,
    pub materials: Vec<Material>,
    pub objects: Vec<String>,
    /// The file's own cameras; the first one looks.
    pub cameras: Vec<SoupCamera>,
    /// Lights without area, in the file's units.
    pub lights: Vec<PunctualLight>,
    /// Whether a camera is told elsewhere, so that none need be found.
    pub has_view: bool,
    pub warnings: Vec<String>,
}

/// A camera of a [`Soup`].
#[derive(Debug)]
pub(crate) struct SoupCamera {
    pub name: String,
    /// The eye, in the file's units.
    pub position: DVec3,
    /// All of the camera but its position.
    pub view: Camera,
}

/// One polygon of a [`Soup`]; its corners follow those of the polygon before it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polygon {
    pub corners: usize,
    pub material: u32,
    pub object: u32,
    /// Its line or number, for messages.
    pub number: usize,
}

impl Scene {
    /// A scene from arrays: vertices in any unit, faces as (corners counter-clockwise seen from the front, material).
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
        check_arrays(name, vertices, faces, &materials)?;
        let polygon = |(number, (corners, material)): (usize, &(Vec<u32>, u32))| Polygon {
            corners: corners.len(),
            material: *material,
            object: 0,
            number,
        };
        assemble(Soup {
            name: name.to_owned(),
            file: name.to_owned(),
            item: "face",
            vertices: vertices.to_vec(),
            corners: faces.iter().flat_map(|face| face.0.iter().copied()).collect(),
            polygons: faces.iter().enumerate().map(polygon).collect(),
            materials,
            objects: vec![name.to_owned()],
            ..Soup::default()
        })
    }
}

fn check_arrays(
    name: &str,
    vertices: &[DVec3],
    faces: &[(Vec<u32>, u32)],
    materials: &[Material],
) -> Result<(), SceneError> {
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
    for (number, (corners, material)) in faces.iter().enumerate() {
        let (place, index) = (Place::item(name, "face", number), *material);
        check_corners(&place, corners, vertices.len())?;
        if index as usize >= materials.len() {
            return Err(SceneError::MaterialOutOfRange { place, index, materials: materials.len() });
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
pub(crate) fn assemble(soup: Soup) -> Result<Scene, SceneError> {
    let Some(frame) = UnitFrame::of(soup.corners.iter().map(|&v| soup.vertices[v as usize])) else {
        return Err(SceneError::Empty { file: soup.file, dropped: soup.polygons.len() });
    };
    let mut mesh = Mesh::default();
    let mut flaws = Flaws::default();
    mesh.add_polygons(&soup, &frame, &mut flaws);
    if mesh.faces.is_empty() {
        return Err(SceneError::Empty { file: soup.file, dropped: soup.polygons.len() });
    }
    let cameras = cameras(&soup, &frame)?;
    let lights = lights(&soup, &frame)?;
    let (has_view, mut warnings) = (soup.has_view, soup.warnings);
    flaws.report(&soup.file, soup.item, &mut warnings);
    let mut scene = Scene {
        name: soup.name,
        vertices: std::mem::take(&mut mesh.points.list),
        faces: mesh.faces,
        exact: mesh.exact,
        coordinates: mesh.coordinates,
        colours: mesh.colours,
        materials: soup.materials,
        objects: soup.objects,
        lights,
        sky: None,
        camera: Camera::NOWHERE,
        cameras,
        frame,
        transport: None,
        warnings,
    };
    let source = Source { file: &soup.file, item: soup.item, numbers: &mesh.numbers };
    resolve(&mut scene, &mut mesh.points, &source);
    scene.camera = match scene.cameras.first() {
        Some(own) => own.camera,
        None if has_view => Camera::NOWHERE,
        None => Camera::framing(&scene),
    };
    Ok(scene)
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
        |place: PunctualPlace| PunctualPlace::new(frame.to_unit(place.position), place.attenuation, frame.scale);
    let mut all = soup.lights.clone();
    for (number, light) in all.iter_mut().enumerate() {
        if let PunctualForm::Point(place) | PunctualForm::Spot { place, .. } = &mut light.form {
            *place = placed(*place);
            if !place.position.as_vec3().is_finite() {
                let (statement, word) = ("light".to_owned(), place.position.to_string());
                return Err(SceneError::NotFinite { place: Place::item(&soup.file, "light", number), statement, word });
            }
        }
    }
    Ok(all)
}

#[derive(Default)]
struct Flaws {
    flat: Tally,
    crossing: Tally,
}

impl Flaws {
    fn report(&self, file: &str, item: &str, warnings: &mut Vec<String>) {
        self.flat.report(file, item, "face", "dropped, having no area", warnings);
        let consequence = "an outline that crosses itself has no inside, so the triangles are a guess";
        self.crossing.report(file, item, "polygon", consequence, warnings);
    }
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
}

impl Mesh {
    fn add_polygons(&mut self, soup: &Soup, frame: &UnitFrame, flaws: &mut Flaws) {
        let unit: Vec<DVec3> = soup.vertices.iter().map(|&v| frame.to_unit(v)).collect();
        let mut triangulator = Triangulator::default();
        let (mut points, mut rest): (Vec<DVec3>, _) = (Vec::new(), &soup.corners[..]);
        for polygon in &soup.polygons {
            let first = soup.corners.len() - rest.len();
            let (corners, after) = rest.split_at(polygon.corners);
            rest = after;
            points.clear();
            points.extend(corners.iter().map(|&v| unit[v as usize]));
            if triangulator.run(&points) == Cover::Crossing {
                flaws.crossing.add(polygon.number);
            }
            let before = self.faces.len();
            for triangle in &triangulator.triangles {
                let added = self.add_triangle(triangle.map(|i| points[i as usize]), polygon);
                if added && !soup.coordinates.is_empty() {
                    let at = |i: u32| soup.coordinates.get(first + i as usize).copied().unwrap_or_default();
                    self.coordinates.push(triangle.map(at));
                }
                if added && !soup.colours.is_empty() {
                    let at = |i: u32| soup.colours.get(first + i as usize).copied().unwrap_or(Vec4::ONE);
                    self.colours.push(triangle.map(at));
                }
            }
            if self.faces.len() == before {
                flaws.flat.add_named(polygon.number, &soup.materials[polygon.material as usize].name);
            }
        }
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
