//! Patches as triangles with numbers on them: VTK's unstructured grid (`.vtu`) and Stanford's PLY with colours.
//!
//! Every triangle has its own three corners, in the file's units, and the numbers of the patch that it is a part of, so
//! that what is shown is what the solver has: one value a patch. Of a patch divided by light the parts share their
//! triangles, which have the mean of the parts, weighted by area. Both formats are a header of some lines and then
//! numbers, so they are written here: vtkio stopped at nom 3 and keeps every number several times, ply-rs-bw makes a
//! table of names for each vertex.
//!
//! Sources: *VTK file formats*, XML, appended data, raw; G. Turk, *The PLY polygon file format*, 1994.
//! Not handled: reading either; where the parts of a divided patch lie.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use glam::{DVec3, Vec3};

use halflight::light::Rgb;
use halflight::patches::Patches;
use halflight::pictures::{Exposure, WriteError, encode_srgb, write_whole_by};
use halflight::scene::Scene;

/// The triangles of all patches.
pub struct PatchMesh {
    /// Corners, in the file's units.
    corners: Vec<[DVec3; 3]>,
    /// The patch, as it was cut, that each triangle is a part of.
    patch: Vec<u32>,
    /// Of every patch the one it was cut from, and its area.
    whole: Vec<u32>,
    areas: Vec<f64>,
}

/// Numbers of every patch, under a name.
pub struct CellData {
    /// What tools call it.
    pub name: String,
    /// Numbers a patch: 1, or 3 for colours.
    pub components: usize,
    /// `components` numbers of each patch, one patch after another.
    pub values: Vec<f32>,
}

impl CellData {
    /// One number a patch.
    pub fn scalar(name: &str, values: impl IntoIterator<Item = f32>) -> CellData {
        CellData { name: name.into(), components: 1, values: values.into_iter().collect() }
    }

    /// A colour of each patch.
    pub fn colour(name: &str, values: impl IntoIterator<Item = Rgb>) -> CellData {
        let values = values.into_iter().flat_map(|colour| colour.to_array()).collect();
        CellData { name: name.into(), components: 3, values }
    }
}

/// A block of numbers of a `.vtu`: what opens its element, and the bytes.
struct Block {
    opening: String,
    bytes: Vec<u8>,
}

/// VTK's number of a triangle.
const TRIANGLE: u8 = 5;

impl PatchMesh {
    /// The triangles of a scene's patches, but for those of the sky.
    pub fn new(scene: &Scene, patches: &Patches) -> PatchMesh {
        let whole: Vec<u32> = (0..patches.len() as u32).map(|i| patches.whole(i)).collect();
        let mut mesh = PatchMesh { corners: Vec::new(), patch: Vec::new(), whole, areas: patches.areas().to_vec() };
        for i in (0..patches.len()).filter(|&i| patches.whole(i as u32) as usize == i) {
            for (_, corners) in patches.pieces(i).filter(|(face, _)| !scene.is_sky(*face)) {
                mesh.corners.push(corners.map(|p: Vec3| scene.frame.to_file(p.as_dvec3())));
                mesh.patch.push(i as u32);
            }
        }
        mesh
    }

    /// Corners of the triangles, in the file's units, counter-clockwise seen from the front.
    pub fn corners(&self) -> &[[DVec3; 3]] {
        &self.corners
    }

    /// The patch of each triangle.
    pub fn patch(&self) -> &[u32] {
        &self.patch
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.patch.len()
    }

    /// Writes the triangles with numbers on them as cell data, and `patch`, the number of each one's patch; whole or
    /// not at all.
    ///
    /// # Errors
    /// A destination that cannot be written.
    ///
    /// # Panics
    /// If there are fewer numbers than patches.
    pub fn write_vtu(&self, path: impl AsRef<Path>, data: &[CellData]) -> Result<(), WriteError> {
        let count = self.triangles();
        let points =
            array("Float64", "Points", 3, self.corners.iter().flatten().flat_map(|p| p.to_array()), f64::to_le_bytes);
        let cells = [
            array("Int64", "connectivity", 1, 0..3 * count as i64, i64::to_le_bytes),
            array("Int64", "offsets", 1, (1..=count as i64).map(|n| 3 * n), i64::to_le_bytes),
            array("UInt8", "types", 1, std::iter::repeat_n(TRIANGLE, count), u8::to_le_bytes),
        ];
        let mut own = vec![array("Int32", "patch", 1, self.patch.iter().map(|&i| i as i32), i32::to_le_bytes)];
        own.extend(data.iter().map(|data| self.data(data)));
        let sections = [("Points", vec![points]), ("Cells", cells.into()), ("CellData", own)];
        write_whole_by(path, |file| write_grid(file, count, &sections))
    }

    /// Numbers of the patches, triangle by triangle.
    fn data(&self, data: &CellData) -> Block {
        let means = self.means(data);
        let of = |&i: &u32| means[i as usize * data.components..][..data.components].iter().copied();
        array("Float32", &escaped(&data.name), data.components, self.patch.iter().flat_map(of), f32::to_le_bytes)
    }

    /// What is on the patches as they were cut: the mean over parts, weighted by area.
    fn means(&self, data: &CellData) -> Vec<f32> {
        let n = data.components;
        let mut sums = vec![0.0f64; data.values.len()];
        let mut weights = vec![0.0f64; self.whole.len()];
        for (i, &whole) in self.whole.iter().enumerate() {
            let area = self.areas[i].max(f64::MIN_POSITIVE);
            weights[whole as usize] += area;
            let own = &data.values[n * i..n * (i + 1)];
            sums[n * whole as usize..].iter_mut().zip(own).for_each(|(sum, v)| *sum += area * f64::from(*v));
        }
        let mean = |(k, sum): (usize, &f64)| match self.whole[k / n] as usize == k / n {
            // A patch that was not divided keeps its bits.
            true if weights[k / n] == self.areas[k / n].max(f64::MIN_POSITIVE) => data.values[k],
            _ => (sum / weights[k / n]) as f32,
        };
        sums.iter().enumerate().map(mean).collect()
    }

    /// Writes the triangles with the colour of a light on each, sRGB at an exposure; whole or not at all.
    ///
    /// # Errors
    /// A destination that cannot be written.
    ///
    /// # Panics
    /// If there are fewer colours than patches.
    pub fn write_ply(&self, path: impl AsRef<Path>, light: &[Rgb], exposure: Exposure) -> Result<(), WriteError> {
        let means = self.means(&CellData::colour("light", light.iter().copied()));
        let code = |v: f32| (255.0 * encode_srgb((v * exposure.factor()).clamp(0.0, 1.0))).round() as u8;
        write_whole_by(path, |file| {
            let mut out = BufWriter::new(file);
            write!(out, "{}", ply_header(self.triangles()))?;
            for (corners, &patch) in self.corners.iter().zip(&self.patch) {
                let colour: Vec<u8> = means[3 * patch as usize..][..3].iter().map(|&v| code(v)).collect();
                for corner in corners {
                    corner.as_vec3().to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
                    out.write_all(&colour)?;
                }
            }
            for first in (0..3 * self.triangles() as u32).step_by(3) {
                out.write_all(&[3])?;
                (first..first + 3).try_for_each(|corner| out.write_all(&corner.to_le_bytes()))?;
            }
            out.flush()
        })
    }
}

fn ply_header(triangles: usize) -> String {
    let corners = 3 * triangles;
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment patches of halflight, colours sRGB\nelement vertex {corners}\n\
         property float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {triangles}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
}

/// An array of a `.vtu`.
fn array<T, const N: usize>(
    kind: &str,
    name: &str,
    components: usize,
    values: impl Iterator<Item = T>,
    bytes: impl Fn(T) -> [u8; N],
) -> Block {
    let opening = format!("<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
    Block { opening, bytes: values.flat_map(bytes).collect() }
}

/// A name as it stands in an attribute.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;")
}

/// A grid of triangles: arrays that name where their bytes begin, and after them all bytes.
fn write_grid(file: &mut File, count: usize, sections: &[(&str, Vec<Block>)]) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
    )?;
    writeln!(out, "<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{count}\">", 3 * count)?;
    let mut offset = 0;
    for (name, blocks) in sections {
        writeln!(out, "<{name}>")?;
        for block in blocks {
            writeln!(out, "{} format=\"appended\" offset=\"{offset}\"/>", block.opening)?;
            offset += 8 + block.bytes.len();
        }
        writeln!(out, "</{name}>")?;
    }
    write!(out, "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_")?;
    for block in sections.iter().flat_map(|(_, blocks)| blocks) {
        out.write_all(&(block.bytes.len() as u64).to_le_bytes())?;
        out.write_all(&block.bytes)?;
    }
    writeln!(out, "\n</AppendedData>\n</VTKFile>")?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh() -> PatchMesh {
        let corners = vec![[DVec3::ZERO, DVec3::X, DVec3::Y]; 3];
        // Patches 0 and 1 were cut, and 2 is a part of 0.
        PatchMesh { corners, patch: vec![0, 0, 1], whole: vec![0, 1, 0], areas: vec![1.0, 2.0, 3.0] }
    }

    #[test]
    fn parts_of_a_patch_have_their_mean() {
        let data = CellData::colour("L", [1.0, 7.0, 5.0].map(Rgb::splat));
        assert_eq!(mesh().means(&data)[..6], [4.0, 4.0, 4.0, 7.0, 7.0, 7.0]);
    }

    #[test]
    fn a_ply_has_as_many_bytes_as_it_announces() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("patches.ply");
        mesh().write_ply(&path, &[Rgb::ONE; 3], Exposure::default()).expect("it is written");
        let bytes = std::fs::read(path).expect("it is there");
        assert_eq!(bytes.len(), ply_header(3).len() + 9 * 15 + 3 * 13);
        assert!(bytes.windows(3).any(|three| three == [255; 3]));
    }

    #[test]
    fn a_vtu_names_the_place_of_every_array() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("patches.vtu");
        mesh().write_vtu(&path, &[CellData::scalar("a & b", [1.0, 2.0, 3.0])]).expect("it is written");
        let bytes = std::fs::read(path).expect("it is there");
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("Name=\"a &amp; b\""));
        let start = bytes.windows(2).position(|two| two == b"\n_").expect("the bytes begin") + 2;
        let last = text.split("offset=\"").last().and_then(|rest| rest.split('"').next()).expect("an offset");
        let at = start + last.parse::<usize>().expect("a number");
        assert_eq!(bytes[at..at + 8], 12u64.to_le_bytes());
        assert_eq!(bytes[at + 8..at + 12], 2.5f32.to_le_bytes());
    }
}
