//! Tests of what is studied, against closed forms, other programs and the path tracer.

mod coincident;
#[path = "../../../tests/common/mod.rs"]
mod common;
mod cornell_reference;
mod factor_bodies;
mod factors;
mod geometry_contacts;
mod geometry_scenes;
mod masked_factors;
mod sky;
mod verdict;
