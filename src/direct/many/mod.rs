//! Many luminaires: a tree of them with moments that stand for halves, and the cut through it that each patch keeps.

pub(crate) mod light_cut;
pub(crate) mod light_tree;
pub(crate) mod moments;
