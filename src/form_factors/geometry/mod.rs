//! Plane geometry of form factors: Lambert's closed form of polygons and meshes, and the shadows cut out of them.

pub(crate) mod chebyshev;
pub(crate) mod hull;
pub(crate) mod lambert;
pub(crate) mod plane;
pub(crate) mod shadow;
pub(crate) mod silhouette;
