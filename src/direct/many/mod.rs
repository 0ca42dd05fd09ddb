//! Many luminaires: a tree of them with moments for every node, and the cut through it for each patch.

pub(crate) mod light_cut;
pub(crate) mod light_tree;
pub(crate) mod moments;
pub(crate) mod place;
