//! What processes that share a solve hand each other: all types of the crate that do, and how serde has them.
//!
//! A struct is the list of its fields, an enum that of its variants, one of which is there. Not handled: reports and
//! files, whose types say for themselves what they are made of.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::direct::many::light_cut::{Chance, LightCut, Seen, SeenSum};
use crate::error::bounce_powers::TermPower;
use crate::error::landings::Landing;
use crate::form_factors::chebyshev::{Rectangle, Tiles};
use crate::form_factors::layers::{Crossing, Row};
use crate::form_factors::sampled::Sums;
use crate::form_factors::{Estimate, Method};
use crate::gather::irradiance::Irradiance;
use crate::gather::pixels::emission::outlines::Sampled;
use crate::gather::pixels::pixel::{Met, Pixel, SmallFace};
use crate::gather::pixels::pixel_layer::{Layer, SurfaceKey};
use crate::gather::pixels::pixel_light::{PixelLight, SeenEmission, SmoothLight};
use crate::gather::pixels::pixel_noise::{Basis, PixelNoise};
use crate::gather::pixels::pixel_texture::{Footprint, PixelTexture};
use crate::gather::pixels::textured_light::{HalfLight, TexturedLight};
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

/// Enums with all of their variants, and a name for each field of those.
macro_rules! enums {
    ($($own:ident { $($variant:ident { $($field:tt: $name:ident),* }),* })*) => { $(
        impl Serialize for $own {
            fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                let each = ($( if let $own::$variant { $($field: $name),* } = self { Some((pairs!($($name)*),)) } else { None }, )*);
                each.serialize(to)
            }
        }

        impl<'de> Deserialize<'de> for $own {
            #[allow(non_snake_case)]
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<$own, D::Error> {
                let ($($variant,)*) = Deserialize::deserialize(from)?;
                $( if let Some((pairs!($($name)*),)) = $variant { return Ok($own::$variant { $($field: $name),* }); } )*
                Err(Error::custom(stringify!($own)))
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
    Chance { node, until, power_until, expected }
    Rectangle { center, normal, half }
    Tiles { rectangle, side, values }
    LightCut { seen, sum, exact, drawn, near, draws }
    TermPower { visible, invisible }
    Irradiance { direct, fields, total, squared_error, rays }
    SmallFace { share, light }
    SurfaceKey { plane, side, material }
    Layer { key, first, count, sum, reflected, lit, origins }
    Footprint { key, face, rho, extent }
    SeenEmission { value, variance, emitters }
    Sampled { seen, rays }
    SmoothLight { direct, variance }
    PixelLight { emitted, glows, outline, lit, textured, smooth, ambient, emitters }
    TexturedLight { halves }
    HalfLight { count, light, off }
    Met { emitting, reflecting, backs, rays, reach }
    PixelNoise { basis, differed, predicted, noted, is_explained }
    Pixel { count, light, met, layers, texture, small_faces, noise, counts_emission }
    LayerFit { pixel, layer, fitted, rho, weight, light, uncertainty, rays }
    CellSums { cell, sums, squares, count }
    PixelIndirect { fields, variance, auxiliary, layers, ambient }
    Site { pixel, camera_count, spacing, seed }
    Record { site, layer, density, pixel, rays, nearness, sums }
    Landing { position, face, side, power }
}

enums! {
    Side { Front {}, Back {} }
    SeenSum { ByNode {}, Tiles { 0: tiles }, Known { 0: light } }
    Method { ClosedForm {}, Quadrature {} }
    PixelTexture { Unknown {}, One { 0: footprint }, Varied {} }
    Basis { AllRays {}, Resampled { 0: variance }, Chosen { unseen: unseen } }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What comes of a value on its way.
    fn sent<T: Serialize + for<'de> Deserialize<'de>>(value: &T) -> T {
        serde_json::from_str(&serde_json::to_string(value).expect("numbers and lists")).expect("what was sent")
    }

    #[test]
    fn enums_keep_their_variants_and_structs_their_fields() {
        assert_eq!([Side::Front, Side::Back].map(|side| sent(&side)), [Side::Front, Side::Back]);
        let estimate = Estimate { value: 2.0, error: 0.5 };
        assert_eq!(sent(&estimate), estimate);
        let key = SurfaceKey { plane: 3, side: Side::Back, material: 1 };
        let one = PixelTexture::One(Box::new(Footprint { key, face: 7, rho: glam::DVec3::ONE, extent: 0.25 }));
        assert!(matches!(sent(&one), PixelTexture::One(own) if own.key == key && (own.face, own.extent) == (7, 0.25)));
        assert!(matches!(sent(&PixelTexture::Unknown), PixelTexture::Unknown));
        assert!(matches!(sent(&PixelTexture::Varied), PixelTexture::Varied));
        assert!(matches!(sent(&Basis::Chosen { unseen: 0.5 }), Basis::Chosen { unseen: 0.5 }));
    }
}
