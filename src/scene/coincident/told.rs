//! The warning of faces that others cover.
//!
//! Not handled: backs behind fronts, which nobody sees.

use crate::scene::Scene;
use crate::scene::coincident::plane::Covered;
use crate::scene::lines::{list, shorten};
use crate::scene::planes::TOLERANCE;

/// Objects and places named at most, beyond which the rest is counted.
const MOST: usize = 100;

/// Where the faces come from.
pub(crate) struct Source<'a> {
    /// The file.
    pub file: &'a str,
    /// What `numbers` count: `line`, `face` or `triangle`.
    pub item: &'a str,
    /// Of each face.
    pub numbers: &'a [usize],
}

impl Source<'_> {
    /// How many faces are not there, or not all of them; of which objects, and which objects are there in their place.
    pub(super) fn warning(&self, scene: &Scene, found: &[Covered]) -> Option<String> {
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
             first in the file is there, what it covers of others is left out; delete one of the two, or move it"
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
