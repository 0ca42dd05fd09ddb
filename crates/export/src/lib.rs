//! Files that other programs read: F, light on patches and tables of factors as NumPy's arrays, SciPy's sparse
//! matrices, Matrix Market, VTK's unstructured grids and Stanford's PLY.
//!
//! | file | holds | read by |
//! |---|---|---|
//! | `.npy` | one array ([`Array`]) | `numpy.load` |
//! | `.npz` | named arrays ([`write_npz`]); F with the keys of CSR ([`csr`]) | `scipy.sparse.load_npz` |
//! | `.mtx` | F, an entry a line ([`write_matrix_market`]) | `scipy.io.mmread` |
//! | `.vtu` | patches with numbers on them ([`PatchMesh::write_vtu`]) | ParaView, `pyvista`, `meshio` |
//! | `.ply` | patches with colours ([`PatchMesh::write_ply`]) | Blender, MeshLab, `trimesh` |
//!
//! All are written whole or not at all, and their bytes depend on what they hold alone. [`kept`] keeps a solved scene
//! as a folder of such files, and reads it back. What denoisers take beside a picture are [`Guides`] and
//! [`LightParts`].
//!
//! Not handled: compressed files; pictures and tables of text ([`halflight::pictures`]).

mod arrays;
mod denoiser;
mod fields;
pub mod kept;
mod matrix_market;
mod mesh;
mod npz;
mod scene_bytes;

pub use arrays::{Array, Values};
pub use denoiser::{Guides, LightParts};
pub use fields::{light_array, terms_array};
pub use matrix_market::write_matrix_market;
pub use mesh::{CellData, PatchMesh};
pub use npz::{csr, npz_bytes, read_npz, rows_of_csr, write_npz};
pub use scene_bytes::{SceneBytesError, scene_from_bytes, scene_to_bytes};
