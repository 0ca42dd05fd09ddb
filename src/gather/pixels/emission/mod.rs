//! Light as emitted that pixels show: by areas of what is seen, and by rays where those do not tell.

pub(crate) mod outlines;
pub(crate) mod visible_areas;
