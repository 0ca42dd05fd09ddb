//! Why a picture is not as near as was asked for, in words, and what would help.

use crate::cli::console::Console;
use crate::light::Transport;
use crate::render::{Ended, Rendered};

/// Says where more is estimated than was asked for, and of what.
pub(crate) fn warn_of_error(console: &Console, transport: Transport, found: &Rendered, tolerance: f64) {
    if let Some(why) = unmet(found, tolerance) {
        console.warn(format!("{}: {why}", transport.label()));
    }
}

/// What keeps a picture from its tolerance, and what would help.
pub(crate) fn unmet(found: &Rendered, tolerance: f64) -> Option<String> {
    let error = &found.error;
    if error.total <= tolerance {
        return None;
    }
    let parts = [
        (error.form_factors, "noise of F"),
        (error.patches, "the light read on patches"),
        (error.truncation, "the series' truncation"),
        (error.gather, "the gather pass"),
    ];
    let largest = parts.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
    let (part, name) = largest.unwrap_or_default();
    if found.is_black() {
        return Some(
            "the scene emits light, but no ray found any on what the camera sees: the error is not known".into(),
        );
    }
    if error.total >= 1.0 {
        return Some(format!("the error is not known: most of the light comes by ways that few rays find ({name})"));
    }
    let why = match found.ended {
        Ended::ByTime => "when the time was over; a longer --time helps",
        Ended::ByItself => "which more effort lessened too little; a larger --size leaves less to bend within a pixel",
    };
    Some(format!(
        "estimated error {:.2} %, more than the {:.2} % asked for; most of it ({:.2} %) is {name}, {why}",
        100.0 * error.total,
        100.0 * tolerance,
        100.0 * part,
    ))
}
