//! Lights of KHR_lights_punctual, each at a node: it shines along the node's -z.
//!
//! Candela are taken as W/sr and lux as W/m², channel by channel, without a luminous efficacy. The soft edge of a spot,
//! `((cos - cos outer) / (cos inner - cos outer))²` of its intensity, becomes a hard one at the cone that carries the
//! same power: `cos cutoff = (2 cos inner + cos outer) / 3`.
//!
//! Not handled: ranges, beyond which glTF lets a light end; both are named in the warning.
//!
//! Source: Khronos Group, *KHR_lights_punctual*.

use std::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};
use gltf_json::Root;
use gltf_json::extensions::scene::khr_lights_punctual::{Light, Spot, Type};
use gltf_json::validation::Checked;

use crate::scene::error::{Place, SceneError};
use crate::scene::gltf::ignored::Ignored;
use crate::scene::gltf::materials::name;
use crate::scene::gltf::nodes::Placed;
use crate::scene::punctual::{PunctualForm, PunctualLight, PunctualPlace};

/// The lights in the order of the nodes, in the file's units.
pub(super) fn lights(
    file: &str,
    root: &Root,
    nodes: &[Placed],
    ignored: &mut Ignored,
) -> Result<Vec<PunctualLight>, SceneError> {
    let Some(listed) = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) else {
        return Ok(Vec::new());
    };
    let mut all = Vec::new();
    for placed in nodes {
        let own = placed.node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let Some(number) = own.map(|own| own.light.value()) else { continue };
        let light = &listed.lights[number];
        let name = name(&light.name, "light", number);
        if light.range.is_some() {
            ignored.add("ranges of lights", &name);
        }
        if light.spot.is_some() {
            ignored.add("soft edges of spots", &name);
        }
        let wrong = |fault: Fault| SceneError::LightValue {
            place: Place::item(file, "light", number),
            key: fault.key,
            value: fault.value,
            needed: fault.needed,
        };
        all.push(read(light, placed).map_err(wrong)?);
    }
    Ok(all)
}

/// A number of a light that is out of its range.
struct Fault {
    key: &'static str,
    value: String,
    needed: &'static str,
}

fn read(light: &Light, placed: &Placed) -> Result<PunctualLight, Fault> {
    let intensity = light.intensity * Vec3::from_array(light.color);
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        let value = format!("{} times {:?}", light.intensity, light.color);
        return Err(Fault { key: "intensity", value, needed: "finite and not negative" });
    }
    let position = placed.to_world.w_axis.truncate();
    let place = PunctualPlace::new(position, PunctualLight::PHYSICAL, 1.0);
    let form = match light.type_ {
        Checked::Valid(Type::Directional) => PunctualForm::Directional { direction: direction(placed)? },
        Checked::Valid(Type::Spot) => {
            let cutoff = cutoff(&light.spot.clone().unwrap_or_default())?;
            PunctualForm::Spot { place, direction: direction(placed)?, exponent: 0.0, cutoff }
        }
        Checked::Valid(Type::Point) | Checked::Invalid => PunctualForm::Point(place),
    };
    Ok(PunctualLight { form, intensity })
}

/// The node's -z, a unit vector.
fn direction(placed: &Placed) -> Result<DVec3, Fault> {
    let back = placed.to_world.z_axis.truncate();
    let unit = (-back / back.abs().max_element()).try_normalize();
    unit.ok_or_else(|| Fault { key: "direction", value: back.to_string(), needed: "a vector that is not zero" })
}

/// Cosine of the cone that carries a spot's power at its full intensity.
fn cutoff(spot: &Spot) -> Result<f64, Fault> {
    let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
    let fault = |key, value: f32, needed| Err(Fault { key, value: value.to_string(), needed });
    // A right angle in single precision is a little more than one.
    if !(outer > 0.0 && outer <= FRAC_PI_2) {
        return fault("outerConeAngle", outer, "above 0 and at most a right angle");
    }
    if !(0.0..=outer).contains(&inner) {
        return fault("innerConeAngle", inner, "0 or more, and at most outerConeAngle");
    }
    let [inner, outer] = [inner, outer].map(|angle| f64::from(angle).cos().max(0.0));
    Ok((2.0 * inner + outer) / 3.0)
}
