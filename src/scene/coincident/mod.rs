//! Faces in one place: which of them is there.
//!
//! A place of a plane has two sides, and each side shows one face: of those that face its way one that emits, as a
//! luminaire laid into a ceiling does, else the first in the file; where there is none, the back of what faces the
//! other way, if that has two sides. One place is what rays take for
//! one plane ([`planes`]). Where the first face is cut out by a mask, the next one is there.
//!
//! So that rays, closed forms, areas and form factors need no test, a scene has each place once: what is covered is cut
//! off, exactly, in the plane ([`division`]). Faces that face opposite ways stay: each is seen from its front. Of a
//! face with two sides, the piece behind another's front has one.
//!
//! Not handled: faces whose planes rounding separates (see there); they are as near as rays find them.

mod division;
mod masks;
mod plane;
pub(crate) mod planes;
mod triangle_tree;

use glam::{DVec2, DVec3, Vec2, Vec4};
use rayon::prelude::*;

use crate::scene::coincident::division::Polygon;
use crate::scene::coincident::masks::Materials;
use crate::scene::coincident::plane::{Covered, covered};
use crate::scene::coincident::planes::{Planes, TOLERANCE, by_plane};
use crate::scene::error::{About, Effect, list, shorten};
use crate::scene::model::{Face, Scene};
use crate::scene::polygon::{Points, THINNEST, height};

/// Objects and places named at most, beyond which the rest is counted.
const MOST: usize = 100;

/// Where the faces come from.
pub(crate) struct Origin<'a> {
    /// The file.
    pub file: &'a str,
    /// What `numbers` count: `line`, `face` or `triangle`.
    pub item: &'a str,
    /// Of each face.
    pub numbers: &'a [usize],
}

/// A triangle in place of a face, or of a part of one.
struct Placed {
    exact: [DVec3; 3],
    coordinates: [Vec2; 3],
    colours: [Vec4; 3],
    material: u32,
}

/// Leaves of faces in one place what is there, and warns of what is not. `points` are the scene's, to which it adds.
pub(crate) fn resolve(scene: &mut Scene, points: &mut Points, origin: &Origin) {
    let found = all_covered(scene);
    if !found.is_empty() {
        let text = origin.warning(scene, &found);
        scene.warnings.extend(text.map(|text| About::Shape(Effect::LeftOut).warning(text)));
        replace(scene, points, found);
    }
}

/// The faces of which not all is there, by number.
fn all_covered(scene: &Scene) -> Vec<Covered> {
    let planes = Planes::new(scene);
    let (faces, starts) = by_plane(&planes.of_face);
    let own = |plane: &usize| &faces[starts[*plane] as usize..starts[*plane + 1] as usize];
    let several = (0..planes.planes.len()).into_par_iter().with_min_len(64).filter(|plane| own(plane).len() > 1);
    let found = several.flat_map_iter(|plane| covered(scene, &planes.planes[plane], own(&plane)));
    let mut found: Vec<Covered> = found.collect();
    found.sort_unstable_by_key(|covered| covered.face);
    found
}

/// Puts what is there of faces in their place.
fn replace(scene: &mut Scene, points: &mut Points, found: Vec<Covered>) {
    let mut materials = Materials::default();
    let placed = found.into_iter().map(|covered| (covered.face as usize, triangles(scene, &mut materials, &covered)));
    let placed: Vec<(usize, Vec<Placed>)> = placed.collect();
    points.list = std::mem::take(&mut scene.vertices);
    scene.materials.append(&mut materials.list);
    scene.faces = replaced(&scene.faces, &placed, |face, piece| Face {
        vertices: piece.exact.map(|corner| points.number(corner.as_vec3())),
        material: piece.material,
        ..*face
    });
    scene.exact = replaced(&scene.exact, &placed, |_, piece| piece.exact);
    if !scene.coordinates.is_empty() {
        scene.coordinates = replaced(&scene.coordinates, &placed, |_, piece| piece.coordinates);
    }
    if !scene.colours.is_empty() {
        scene.colours = replaced(&scene.colours, &placed, |_, piece| piece.colours);
    }
    scene.vertices = std::mem::take(&mut points.list);
}

/// A list with an item for each face, with items for what is placed in place of faces.
fn replaced<T: Copy>(list: &[T], placed: &[(usize, Vec<Placed>)], mut of: impl FnMut(&T, &Placed) -> T) -> Vec<T> {
    let added: usize = placed.iter().map(|(_, new)| new.len()).sum();
    let (mut all, mut next) = (Vec::with_capacity(list.len() + added), 0);
    for (face, new) in placed {
        all.extend_from_slice(&list[next..*face]);
        all.extend(new.iter().map(|piece| of(&list[*face], piece)));
        next = face + 1;
    }
    all.extend_from_slice(&list[next..]);
    all
}

/// The triangles that a face's pieces are cut into.
fn triangles(scene: &Scene, materials: &mut Materials, covered: &Covered) -> Vec<Placed> {
    let [a, b, c] = scene.exact_corners(covered.face);
    let place = |w: DVec2| a + w.x * (b - a) + w.y * (c - a);
    let [d, e, f] = scene.colours.get(covered.face as usize).copied().unwrap_or_default();
    let colour = |w: DVec2| d + w.x as f32 * (e - d) + w.y as f32 * (f - d);
    let of_piece = |(polygon, marks): &(Polygon, _)| {
        let made = materials.of(scene, covered.face, marks);
        let at = |w: DVec2| made.coordinates.transform_point2(w).as_vec2();
        let one = |weights: [DVec2; 3]| Placed {
            exact: weights.map(place),
            coordinates: weights.map(at),
            colours: weights.map(colour),
            material: made.material,
        };
        fan(polygon, place).into_iter().map(one).collect::<Vec<Placed>>()
    };
    covered.pieces.iter().flat_map(of_piece).collect()
}

/// A convex polygon as triangles around the corner that gives the thickest; too thin ones are left out.
fn fan(polygon: &[DVec2], place: impl Fn(DVec2) -> DVec3) -> Vec<[DVec2; 3]> {
    let n = polygon.len();
    let around = |k: usize| (1..n - 1).map(move |j| [k, (k + j) % n, (k + j + 1) % n].map(|i| polygon[i]));
    let thickness = |triangle: [DVec2; 3]| height(triangle.map(|w| place(w).as_vec3()));
    let least = |k: usize| around(k).map(thickness).fold(f64::INFINITY, f64::min);
    let best = (0..n).map(|k| (k, least(k))).fold((0, 0.0), |best, next| if next.1 > best.1 { next } else { best });
    around(best.0).filter(|&triangle| thickness(triangle) >= THINNEST).collect()
}

impl Origin<'_> {
    /// How many faces are not there, or not all of them; of which objects, and which objects are there in their place.
    fn warning(&self, scene: &Scene, found: &[Covered]) -> Option<String> {
        let hidden: Vec<(u32, u32)> = found.iter().filter_map(|covered| Some((covered.face, covered.by?))).collect();
        let &(first, over) = hidden.first()?;
        let (file, item) = (self.file, self.item);
        let [at, other] = [first, over].map(|face| self.numbers[face as usize]);
        let [own, others] = [names(scene, hidden.iter().map(|h| h.0)), names(scene, hidden.iter().map(|h| h.1))];
        let gap = TOLERANCE * scene.frame.scale;
        let (count, plural, lie) = if hidden.len() == 1 { (1, "", "lies") } else { (hidden.len(), "s", "lie") };
        Some(format!(
            "{count} triangle{plural} of {own} {lie} where triangles of {others} that face the same way lie (first: \
             {file}, {item} {at} on {item} {other}; gaps up to {gap:.1e} count as none): of faces in one place the \
             one that emits is there, else the first in the file, and what it covers of others is left out; delete \
             one of the two, or move it"
        ))
    }
}

/// The names of the objects of faces, each once.
fn names(scene: &Scene, faces: impl Iterator<Item = u32>) -> String {
    let mut objects: Vec<u32> = faces.map(|face| scene.faces[face as usize].object).collect();
    objects.sort_unstable();
    objects.dedup();
    let name = |object: &u32| scene.objects.get(*object as usize).map_or("", String::as_str);
    match &objects[..] {
        [one] => format!("object `{}`", shorten(name(one))),
        all => format!("objects {}", list(all.iter().take(MOST).map(name))),
    }
}
