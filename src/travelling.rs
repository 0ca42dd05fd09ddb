//! What processes that share a solve hand each other: all types of the crate that do, and how serde has them.
//!
//! A struct is the list of its fields, an enum the number of its variant. Not handled: reports and files, whose types
//! say for themselves what they are made of.

use glam::DVec3;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::direct::many::light_cut::{Chance, LightCut, Seen};
use crate::error::light_walks::TermPower;
use crate::form_factors::chebyshev::{Rectangle, Tiles};
use crate::form_factors::layers::{Crossing, Row};
use crate::form_factors::sampled::Sums;
use crate::form_factors::{Estimate, Method};
use crate::gather::irradiance::Irradiance;
use crate::gather::pixels::pixel::{Met, Pixel, SmallFace};
use crate::gather::pixels::pixel_layer::{Layer, SurfaceKey};
use crate::gather::pixels::pixel_light::PixelLight;
use crate::gather::pixels::pixel_noise::{Basis, PixelNoise};
use crate::gather::pixels::pixel_texture::{Footprint, PixelTexture};
use crate::gather::records::fit_error::LayerFit;
use crate::gather::records::guiding::CellSums;
use crate::gather::records::indirect_light::PixelIndirect;
use crate::gather::records::record::{Record, Site};
use crate::patches::Sample;
use crate::rays::Side;
use crate::surfaces::SurfacePoint;

/// Names in pairs, each with the rest: serde has tuples of few only.
macro_rules! pairs {
    () => { () };
    ($first:ident $($rest:ident)*) => { ($first, pairs!($($rest)*)) };
}

/// Structs with all of their fields.
macro_rules! structs {
    ($($own:ident { $($field:ident),* })*) => { $(
        impl Serialize for $own {
            fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                let $own { $($field),* } = self;
                pairs!($($field)*).serialize(to)
            }
        }

        impl<'de> Deserialize<'de> for $own {
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<$own, D::Error> {
                let pairs!($($field)*) = Deserialize::deserialize(from)?;
                Ok($own { $($field),* })
            }
        }
    )* };
}

/// Enums without fields with all of their variants, in order.
macro_rules! enums {
    ($($own:ident { $($variant:ident),* })*) => { $(
        impl Serialize for $own {
            fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                (*self as u8).serialize(to)
            }
        }

        impl<'de> Deserialize<'de> for $own {
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<$own, D::Error> {
                let own = [$($own::$variant),*].get(usize::from(u8::deserialize(from)?)).copied();
                own.ok_or_else(|| Error::custom(stringify!($own)))
            }
        }
    )* };
}

structs! {
    SurfacePoint { position, normal, face }
    Sample { point, light }
    Estimate { value, error }
    Sums { met, moved }
    Crossing { slot, depth, weight }
    Row { columns, ends, crossings }
    Seen { node, share, until }
    Chance { node, until, power, expected }
    Rectangle { center, normal, half }
    Tiles { rectangle, side, values }
    LightCut { seen, smooth, exact, drawn, near, draws }
    TermPower { visible, invisible }
    Irradiance { direct, fields, total, squared_error, is_coarse, rays }
    SmallFace { share, light }
    SurfaceKey { plane, side, material }
    Layer { key, first, count, sum, reflected, origins }
    Footprint { key, face, rho, extent }
    PixelLight { emitted, lit, ambient, emitters }
    Met { emitting, reflecting, backs, rays, partly_hidden, reach }
    PixelNoise { basis, differed, predicted, noted, is_explained }
    Pixel { count, light, met, layers, texture, small_faces, noise, counts_emission }
    LayerFit { pixel, layer, fitted, rho, weight, light, uncertainty, rays }
    CellSums { cell, sums, squares, count }
    PixelIndirect { fields, variance, auxiliary, layers, ambient }
    Site { pixel, camera_count, spacing, seed }
    Record { site, layer, density, distance, rays, nearness, sums }
}

enums! {
    Side { Front, Back }
    Method { ClosedForm, Quadrature }
}

impl Serialize for PixelTexture {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let known = match self {
            PixelTexture::Unknown => None,
            PixelTexture::One(footprint) => Some(Some(footprint)),
            PixelTexture::Varied => Some(None),
        };
        known.serialize(to)
    }
}

impl<'de> Deserialize<'de> for PixelTexture {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<PixelTexture, D::Error> {
        let known = Option::<Option<Box<Footprint>>>::deserialize(from)?;
        Ok(known.map_or(PixelTexture::Unknown, |one| one.map_or(PixelTexture::Varied, PixelTexture::One)))
    }
}

impl Serialize for Basis {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let known = match self {
            Basis::AllRays => (None, None),
            Basis::Resampled(variance) => (Some(variance), None),
            Basis::Chosen { unseen } => (None, Some(unseen)),
        };
        known.serialize(to)
    }
}

impl<'de> Deserialize<'de> for Basis {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Basis, D::Error> {
        let (resampled, unseen) = <(Option<DVec3>, Option<f64>)>::deserialize(from)?;
        let chosen = || unseen.map_or(Basis::AllRays, |unseen| Basis::Chosen { unseen });
        Ok(resampled.map_or_else(chosen, Basis::Resampled))
    }
}
