//! Tests of the program, which run it, as one program: it is compiled and linked once.

mod audit;
mod bake;
mod book;
mod chart;
mod cli;
mod cli_errors;
#[path = "../../../tests/common/mod.rs"]
mod common;
mod compare;
mod daylight;
mod explore;
mod exports;
mod factors_command;
mod first_minute;
mod glb_camera;
mod interrupt;
mod kept;
mod layers;
mod manifests;
mod map;
mod memory;
mod points;
mod ranks;
mod report;
mod run;
mod trace_command;
mod wound_outwards;
