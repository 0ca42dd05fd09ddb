//! Rows of F: what each patch receives of the others, by hemisphere rays.
//!
//! [`cast`](crate::form_factors::cast()) fills rows for one tau; [`cast_layers`](crate::form_factors::cast_layers)
//! keeps the crossings of the rays apart, so that one cast gives `F^tau` for every tau. `checks` has closure and
//! reciprocity for anyone to call.

pub(crate) mod cast;
pub(crate) mod checks;
pub(crate) mod layers;
pub(crate) mod sparse;
