//! The ways to a scene: a file, a built-in name, either of them, or text in memory.
//!
//! Not handled: formats other than OBJ with MTL, glTF, and scene files that name one of these.

use std::borrow::Cow;
use std::path::Path;
use std::{fs, io};

use glam::DVec3;

use crate::light::Rgb;
use crate::scene::build::{Triangulated, assemble};
use crate::scene::emission::SkyLight;
use crate::scene::error::{About, Effect, SceneError, list};
use crate::scene::inside_out::{sees_backs, turn_inside_out};
use crate::scene::model::{AddedLight, Camera, LoadOptions, Scene, Winding};
use crate::scene::obj::lines::decode;
use crate::scene::other_kinds::{refuse_gltf, refuse_other_kind};
use crate::scene::punctual::PunctualLight;
use crate::scene::scene_file::Text;
use crate::scene::soup::{SceneInput, Soup};
use crate::scene::{builtin, ceiling_light, gltf, obj};

impl Scene {
    /// Loads an `.obj`, a `.glb` or `.gltf`, or a `.toml` scene file.
    ///
    /// # Errors
    /// A file that cannot be read, or the first mistake found in it, with its line.
    pub fn load(path: &Path, options: LoadOptions) -> Result<Scene, SceneError> {
        let shown = path.display().to_string();
        if !is_scene_file(path) {
            return Err(SceneError::UnknownKind { file: shown });
        }
        let bytes = fs::read(path).map_err(|source| SceneError::Read { file: shown.clone(), source })?;
        let name = path.file_stem().map_or(shown.clone(), |stem| stem.to_string_lossy().into_owned());
        let folder = path.parent().unwrap_or(Path::new(""));
        let beside = |name: &str| fs::read(folder.join(name)).map(Cow::Owned);
        let input = SceneInput { name: &name, file: &shown, bytes: &bytes, reader: &beside, options };
        if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("toml")) {
            from_scene_file(&input)
        } else {
            from_geometry(&input)
        }
    }

    /// A built-in scene; none of that name gives none. See [`builtin::ALL`].
    ///
    /// # Errors
    /// None that a test has not ruled out: the built-in files go through the same checks as any other.
    pub fn builtin(name: &str, options: LoadOptions) -> Option<Result<Scene, SceneError>> {
        let scene = builtin::find(name)?;
        let beside = |name: &str| {
            let missing = || io::Error::from(io::ErrorKind::NotFound);
            builtin::file(name).map(Cow::Borrowed).ok_or_else(missing)
        };
        let file = format!("{name}.toml");
        let bytes = scene.toml.as_bytes();
        Some(from_scene_file(&SceneInput { name, file: &file, bytes, reader: &beside, options }))
    }

    /// A built-in scene of that name ([`builtin::ALL`]), else the `.obj`, `.glb`, `.gltf` or `.toml` file of that
    /// path.
    ///
    /// # Errors
    /// Those of [`Scene::load`]; where there is neither, the built-in names are listed.
    pub fn open(name_or_path: &str) -> Result<Scene, SceneError> {
        Scene::open_with(name_or_path, LoadOptions::default())
    }

    /// What [`Scene::open`] reads, under options.
    ///
    /// # Errors
    /// Those of [`Scene::load`]; where there is neither, the built-in names are listed.
    pub fn open_with(name_or_path: &str, options: LoadOptions) -> Result<Scene, SceneError> {
        if let Some(scene) = Scene::builtin(name_or_path, options) {
            return scene;
        }
        let path = Path::new(name_or_path);
        if !path.exists() {
            let known: Vec<&str> = builtin::names().collect();
            let nearest = nearest(name_or_path).map_or(String::new(), |name| format!("did you mean `{name}`? "));
            return Err(SceneError::NoSuchScene { name: name_or_path.to_owned(), nearest, known: known.join(", ") });
        }
        if path.is_dir() {
            return Err(SceneError::Folder { file: name_or_path.to_owned(), held: scenes_in(path) });
        }
        Scene::load(path, options)
    }

    /// A scene from the text of an OBJ and of an MTL, which every `mtllib` line of the OBJ stands for.
    ///
    /// # Errors
    /// The first mistake found in the texts, with its line.
    pub fn from_obj_text(name: &str, obj: &str, mtl: &str) -> Result<Scene, SceneError> {
        let any = |_: &str| Ok(Cow::Borrowed(mtl.as_bytes()));
        let (file, options) = (format!("{name}.obj"), LoadOptions::default());
        from_geometry(&SceneInput { name, file: &file, bytes: obj.as_bytes(), reader: &any, options })
    }

    /// A scene from the bytes of a glTF file, GLB or JSON, which holds its buffers itself.
    ///
    /// # Errors
    /// The first mistake found in the bytes; [`SceneError::MissingBuffer`] for a buffer in a file of its own.
    pub fn from_gltf_bytes(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
        let none = |_: &str| Err(io::Error::from(io::ErrorKind::NotFound));
        let (file, options) = (format!("{name}.gltf"), LoadOptions::default());
        from_geometry(&SceneInput { name, file: &file, bytes, reader: &none, options })
    }

    /// Looks through the file's camera of that name.
    ///
    /// # Errors
    /// [`SceneError::NoCamera`], which lists the names.
    pub fn look_through(&mut self, name: &str) -> Result<(), SceneError> {
        let found = self.cameras.iter().find(|camera| camera.name == name);
        let known = || list(self.cameras.iter().map(|camera| camera.name.as_str()));
        let missing = || SceneError::NoCamera { scene: self.name.clone(), name: name.to_owned(), known: known() };
        self.camera = found.ok_or_else(missing)?.camera;
        Ok(())
    }

    /// A scene from the text of a scene file, an OBJ and an MTL. The name in `obj` and all in `mtllib` stand for these.
    ///
    /// # Errors
    /// The first mistake found in the texts, with its line.
    pub fn from_toml_text(
        name: &str,
        toml: &str,
        obj: &str,
        mtl: &str,
        options: LoadOptions,
    ) -> Result<Scene, SceneError> {
        let any = |name: &str| {
            let text = if name.ends_with(".obj") { obj } else { mtl };
            Ok(Cow::Borrowed(text.as_bytes()))
        };
        let file = format!("{name}.toml");
        from_scene_file(&SceneInput { name, file: &file, bytes: toml.as_bytes(), reader: &any, options })
    }

    /// Checks that some face's material emits, or a punctual light shines: renderers need it, those who only look
    /// at the geometry do not.
    ///
    /// # Errors
    /// [`SceneError::Dark`], whose help is where emission is given.
    pub fn require_emission(&self) -> Result<(), SceneError> {
        let lit = (0..self.faces.len() as u32).any(|face| self.material(face).emits());
        let lit = lit || self.lights.iter().any(PunctualLight::shines);
        lit.then_some(()).ok_or_else(|| SceneError::Dark { name: self.name.clone() })
    }
}

/// Likeness of words from which one may stand for the other.
const ALIKE: f64 = 0.8;

/// The built-in scene whose name is most like a word, if one is like it at all.
fn nearest(word: &str) -> Option<&'static str> {
    let alike = |name: &str| strsim::jaro_winkler(word, name);
    let found = builtin::names().max_by(|a, b| alike(a).total_cmp(&alike(b)))?;
    (alike(found) >= ALIKE).then_some(found)
}

/// The names of the scene files in a folder, as a sentence.
fn scenes_in(folder: &Path) -> String {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok).map(|entry| entry.path());
    let mut names: Vec<String> =
        entries.filter(|path| is_scene_file(path)).map(|path| path.display().to_string()).collect();
    names.sort();
    if names.is_empty() {
        "it has no .obj, .glb, .gltf or .toml file".into()
    } else {
        format!("give a file in it: {}", list(names.iter().map(String::as_str)))
    }
}

/// Whether a path ends as those of scenes do: `.obj`, `.glb`, `.gltf` or `.toml`, in any case.
pub fn is_scene_file(path: &Path) -> bool {
    const KINDS: [&str; 4] = ["obj", "glb", "gltf", "toml"];
    path.extension().is_some_and(|end| KINDS.iter().any(|kind| end.eq_ignore_ascii_case(kind)))
}

fn from_geometry(input: &SceneInput) -> Result<Scene, SceneError> {
    let mut soup = read_geometry(input)?;
    soup.unit = input.options.unit.or(soup.unit);
    input.options.apply(&mut soup.materials, |_| false);
    turned(soup, input.options, |soup| {
        let mut scene = assemble_lit(soup, input.options.light)?;
        let is_assumed = input.options.unit.is_none() && !scene.lights.is_empty();
        warn_of_metres(&mut scene, is_assumed);
        Ok(scene)
    })
}

/// Metres that a scene lit by candela is long at most without a doubt that they are metres.
const LARGEST: f64 = 200.0;

/// Warns of a scene whose lights take a file's numbers for metres, where they are likely none.
fn warn_of_metres(scene: &mut Scene, is_assumed: bool) {
    let size = 2.0 * scene.frame.in_metres();
    if is_assumed && size > LARGEST {
        let text = format!(
            "`{}` is {size:.0} m long as its lights take it, so that little light arrives; if it is not in metres give the \
             unit, like unit = \"mm\" in a scene file, or --unit mm",
            scene.name
        );
        scene.warnings.push(About::Light(Effect::Guessed).warning(text));
    }
}

/// Reads a scene file and the geometry that it names.
fn from_scene_file(input: &SceneInput) -> Result<Scene, SceneError> {
    let SceneInput { file, bytes, reader, options, .. } = *input;
    refuse_other_kind(file, bytes)?;
    let text = Text { file, text: decode(file, bytes)? };
    let read = text.parse()?;
    let geometry = read.geometry();
    let bytes = reader(geometry).map_err(|source| read.missing_geometry(&text, source))?;
    // Buffers of a glTF are next to it, libraries of an OBJ next to the scene file or else to the OBJ.
    let folder = geometry.rfind(['/', '\\']).map_or("", |end| &geometry[..=end]);
    let beside = |name: &str| {
        let there = || reader(&format!("{folder}{name}"));
        if is_gltf(geometry) {
            return there();
        }
        match reader(name) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => there(),
            found => found,
        }
    };
    let mut soup = read_geometry(&SceneInput { file: geometry, bytes: &bytes, reader: &beside, ..*input })?;
    read.change_materials(&text, &mut soup)?;
    let unit = options.unit.or(read.unit()).or(soup.unit);
    soup.unit = unit;
    let (is_assumed, is_lit) = (options.unit.or(read.unit()).is_none(), !soup.lights.is_empty());
    options.apply(&mut soup.materials, |name| read.gives_sides(name));
    // Where light is may decide from where a scene is looked at; an added luminaire is not looked at.
    let is_framed_lit = read.is_lit() && !read.has_camera() && options.light != Some(AddedLight::Ceiling);
    soup.has_view = read.has_camera() || is_framed_lit;
    turned(soup, options, |soup| {
        let mut scene = assemble_lit(soup, options.light)?;
        read.finish(&text, &mut scene, reader)?;
        warn_of_metres(&mut scene, is_assumed && (is_lit || read.is_photometric()));
        if is_framed_lit && scene.cameras.is_empty() {
            scene.camera = Camera::framing(&scene);
        }
        Ok(scene)
    })
}

/// Makes a scene, and where rooms in it look outward and are to be turned makes it anew of what is turned; what is to
/// be told of it stands in order.
fn turned(
    soup: Soup,
    options: LoadOptions,
    make: impl Fn(&Soup) -> Result<Scene, SceneError>,
) -> Result<Scene, SceneError> {
    let mut scene = with_fronts(soup, options, make)?;
    scene.warnings.sort_by_key(|warning| warning.about.effect());
    Ok(scene)
}

fn with_fronts(
    mut soup: Soup,
    options: LoadOptions,
    make: impl Fn(&Soup) -> Result<Scene, SceneError>,
) -> Result<Scene, SceneError> {
    let scene = make(&soup)?;
    if options.winding == Winding::AsModelled || !sees_backs(&scene) {
        return Ok(scene);
    }
    let Triangulated { scene: read, polygons, .. } = Triangulated::new(&soup)?;
    let camera = read.frame.to_unit(scene.frame.to_file(scene.camera.position.as_dvec3())).as_vec3();
    if turn_inside_out(&mut soup, (&read, &polygons), camera) { make(&soup) } else { Ok(scene) }
}

/// How many faces those of the first objects are, so many; light that was added is of others.
fn first_faces(scene: &Scene, objects: usize) -> u32 {
    let others = scene.faces.iter().position(|face| face.object as usize >= objects);
    others.map_or(scene.solid_faces(), |first| first as u32)
}

/// Reads an OBJ or a glTF. Faces of opacity 0 are left out.
fn read_geometry(input: &SceneInput) -> Result<Soup, SceneError> {
    refuse_other_kind(input.file, input.bytes)?;
    let is_gltf = is_gltf(input.file);
    if !is_gltf {
        refuse_gltf(input.file, input.bytes)?;
    }
    let mut soup = if is_gltf { gltf::read(input) } else { obj::read(input) }?;
    soup.remove_invisible();
    Ok(soup)
}

fn is_gltf(file: &str) -> bool {
    let extension = file.rsplit('.').next().unwrap_or("");
    ["glb", "gltf"].iter().any(|known| extension.eq_ignore_ascii_case(known))
}

/// Makes the scene as [`assemble`] does, with the light requested. The default camera frames the rest alone, and is
/// inside of a room where the light is.
fn assemble_lit(soup: &Soup, light: Option<AddedLight>) -> Result<Scene, SceneError> {
    let Some(light) = light else { return assemble(soup) };
    let is_framed = soup.cameras.is_empty() && !soup.has_view;
    let mut soup = Soup { has_view: true, ..soup.clone() };
    let objects = soup.objects.len();
    let mut scene = assemble(&soup)?;
    match light {
        AddedLight::Ceiling => {
            ceiling_light::add(&scene, &mut soup);
            scene = assemble(&soup)?;
        }
        AddedLight::Sky => scene.set_sky(SkyLight { upper: Rgb::ONE, lower: Rgb::ONE }, DVec3::Y),
    }
    if is_framed {
        scene.camera = Camera::framing_first(&scene, first_faces(&scene, objects));
    }
    Ok(scene)
}
