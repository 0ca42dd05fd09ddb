//! What stands behind the three coordinates of `v`: `w` a weight, `r g b` a colour, `w r g b` both.
//!
//! Colours are linear, as other readers of OBJ take them. Numbers outside 0..1 are clamped, with a warning. A weight
//! counts in rational curves alone: one that is not 1 is warned of, since some readers divide by it, and so is what is
//! none of these, or not a finite number.
//!
//! Not handled: where colours lie on faces ([`crate::scene::obj_colours`]); colours in comments (`#MRGB`), which are
//! warned of.

use glam::Vec3;

use crate::scene::lines::Statement;
use crate::scene::warnings::Tally;

/// The colours of vertices, and what is passed over.
#[derive(Debug, Default)]
pub(crate) struct Extras {
    /// Of each vertex up to the last one that has one; NaN for those without.
    pub colours: Vec<Vec3>,
    outside: Tally,
    weights: Tally,
    both: Tally,
    odd: Tally,
}

impl Extras {
    /// Reads what follows the coordinates of vertex `index`.
    pub fn read(&mut self, statement: &Statement, index: usize) {
        let (mut numbers, mut count) = ([0.0; 4], 0);
        for word in statement.words().skip(3) {
            if let Some(slot) = numbers.get_mut(count) {
                *slot = word.parse().unwrap_or(f64::NAN);
            }
            count += 1;
        }
        let [w, ..] = numbers;
        match count {
            0 => {}
            _ if numbers.iter().any(|number| !number.is_finite()) => self.odd.add(statement.line),
            1 => self.weight(w, statement.line),
            3 => self.colour(index, [numbers[0], numbers[1], numbers[2]], statement.line),
            4 => {
                self.both.add(statement.line);
                self.weight(w, statement.line);
                self.colour(index, [numbers[1], numbers[2], numbers[3]], statement.line);
            }
            _ => self.odd.add(statement.line),
        }
    }

    fn weight(&mut self, w: f64, line: usize) {
        if w != 1.0 {
            self.weights.add(line);
        }
    }

    fn colour(&mut self, index: usize, rgb: [f64; 3], line: usize) {
        if rgb.iter().any(|part| !(0.0..=1.0).contains(part)) {
            self.outside.add(line);
        }
        self.colours.resize(index, Vec3::NAN);
        self.colours.push(Vec3::from_array(rgb.map(|part| part.clamp(0.0, 1.0) as f32)));
    }

    /// Warns of what was passed over; `text` is all of the file.
    pub fn report(&self, file: &str, text: &str, warnings: &mut Vec<String>) {
        let outside = "its numbers are clamped to 0..1; divide those of eight bits by 255";
        self.outside.report(file, "line", "vertex colour", outside, warnings);
        let weights = "w of `v x y z w` counts in curves alone, and positions are not divided by it";
        self.weights.report(file, "line", "vertex weight", weights, warnings);
        let both = "read as x y z w r g b, of which w has no effect; write x y z r g b if the last one is an alpha";
        self.both.report(file, "line", "seven-number v", both, warnings);
        let odd = "what follows x y z is left out: neither a weight nor a colour of three numbers";
        self.odd.report(file, "line", "v", odd, warnings);
        if let Some(at) = text.find("#MRGB") {
            let line = 1 + text[..at].matches('\n').count();
            warnings.push(format!("{file}, line {line}: colours of vertices in comments (#MRGB) are not modelled"));
        }
    }
}
