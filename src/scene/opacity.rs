//! Faces of which nothing is there: those whose material has the opacity 0 everywhere are left out, with a warning.
//!
//! Not handled: opacities between 0 and 1, which are masks ([`crate::scene::textures::Mask`]).

use crate::scene::build::Soup;
use crate::scene::warnings::Tally;

/// Takes the polygons away of which nothing is there.
pub(crate) fn leave_out(soup: &mut Soup) {
    let is_nowhere = |m: u32| {
        let maps = soup.materials[m as usize].maps.as_ref();
        maps.and_then(|maps| maps.mask.as_ref()).is_some_and(|mask| mask.is_nowhere())
    };
    let absent: Vec<bool> = (0..soup.materials.len() as u32).map(is_nowhere).collect();
    if !absent.contains(&true) {
        return;
    }
    let mut left_out = Tally::default();
    let kept: Vec<bool> = soup.polygons.iter().map(|polygon| !absent[polygon.material as usize]).collect();
    for (polygon, _) in soup.polygons.iter().zip(&kept).filter(|(_, kept)| !**kept) {
        left_out.add_named(polygon.number, &soup.materials[polygon.material as usize].name);
    }
    let each = soup.polygons.iter().zip(&kept).flat_map(|(polygon, &kept)| std::iter::repeat_n(kept, polygon.corners));
    let of_corners: Vec<bool> = each.collect();
    retain(&mut soup.corners, &of_corners);
    retain(&mut soup.coordinates, &of_corners);
    retain(&mut soup.colours, &of_corners);
    retain(&mut soup.polygons, &kept);
    let consequence = "left out: its opacity is 0, so nothing is there";
    left_out.report(&soup.file, soup.item, "face", consequence, &mut soup.warnings);
}

/// Keeps the items that are marked; there may be fewer items than marks.
fn retain<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut marks = kept.iter();
    items.retain(|_| *marks.next().unwrap_or(&true));
}
