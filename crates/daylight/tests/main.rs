//! Daylight coefficients against closed forms, under rotation, and their errors against what they are.

mod openings;
mod rooms;
mod skies;
mod statistics;
mod weather_files;
