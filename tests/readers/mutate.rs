//! Scene texts a few changes away from valid ones, chosen by a seed: most are wrong in one place, some are right.
//!
//! Changes are made to words, lines, line ends and single characters, so that the readers are reached beyond their
//! first check. Not handled: guidance by coverage; the targets under `fuzz/` are for that.

use halflight::scene::{AddedLight, LoadOptions, Scene, SceneError};

/// Valid texts that use what the readers know.
const OBJS: [&str; 4] = [
    "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1 2 3 4\n",
    "# c\nmtllib m.mtl n.mtl\no box\nv 0 0 0 1\nv 2 0 0\nv 2 2 \\\n 0\nv 0 2 0\nv 1 1 1\ng side\nusemtl b c\nf -5/1/1 -4//2 -1/3\nf 2 3 5\nusemtl a\nf 1 4 3 2\n",
    "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 1 1 0\nv 1 2 0\nv 3 2 0\nv 3 3 0\nv 0 3 0\nf 1 2 3 4 5 6 7 8\n",
    "mtllib m.mtl\r\nusemtl a\r\nv -1e3 0 .5\r\nv +1 2. 3e-2\r\nv 0 0 1\r\nvt 0 0\r\nvn 0 0 1\r\ns off\r\nl 1 2\r\nf 1 2 3\r\n",
];
const MTLS: [&str; 2] = [
    "newmtl a\nKd .5\nKe 1\n",
    "# m\nnewmtl a\nKd 0.5 0.25 1\nKe 1 2 3\nnewmtl b c\nKs 0 0 0\nKd 0\nmap_Kd x.png\nillum 2\n",
];
const TOMLS: [&str; 3] = [
    "obj = \"s.obj\"\nmode = \"global\"\n",
    "obj = \"s.obj\"\nalpha = 0.5\ntau = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0.5, 0, 0]\nup = [0, 1, 0]\nvertical_fov = 40\n",
    "obj = 's.obj'\n[materials.a]\nalpha = 0.5\ntwo_sided = true\nemission = [1, 2, 3]\nvisible_emission = false\n[materials.\"b c\"]\nmode = \"shadowless\"\n",
];
/// Words that have broken readers before.
#[rustfmt::skip]
const NASTY: [&str; 64] = [
    "nan", "-inf", "1e308", "-1e308", "1e309", "5e-324", "-0", "1e-46", "3.5e38", "0", "-1", "1", "2", "3", "5",
    "9223372036854775807", "-9223372036854775808", "18446744073709551616", "4294967297", "2147483648", "1/", "/1",
    "1//", "1/2/3/4", "1.5", "0x10", "1e", "+", "#", "\\", "\\\n", "\u{feff}", "\0", "\u{85}", "\u{2028}", "\r", "é",
    "f", "fo", "v", "o", "g", "usemtl", "mtllib", "newmtl", "Kd", "Ke", "Ks", "spectral", "xyz", "map_Kd", "(none)",
    "[", "]", "{a={", "}", "\"", "\"\"\"", "'''", "=", "a.b.c", "[[materials]]", "true", "2026-01-01T00:00:00Z",
];

/// Numbers without visible pattern (Steele, Lea and Flood, *Fast splittable pseudorandom number generators*).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below n.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn pick<'a>(&mut self, list: &[&'a str]) -> &'a str {
        list[self.below(list.len())]
    }
}

/// The three texts of one scene.
pub struct Texts {
    pub toml: Option<String>,
    pub obj: String,
    pub mtl: String,
}

impl Texts {
    /// The texts of a seed: up to four changes to one, two or all of them.
    pub fn new(seed: u64) -> Texts {
        let mut random = Random(seed);
        let mut text = |list: &[&str], changed: bool| {
            let mut text = random.pick(list).to_owned();
            let changes = if changed { random.below(5) } else { 0 };
            for _ in 0..changes {
                text = change(text, &mut random);
            }
            text
        };
        let all = seed.is_multiple_of(4);
        Texts {
            toml: seed.is_multiple_of(3).then(|| text(&TOMLS, true)),
            obj: text(&OBJS, all || seed % 3 == 1),
            mtl: text(&MTLS, all || seed % 3 == 2),
        }
    }

    pub fn read(&self) -> Result<Scene, SceneError> {
        match &self.toml {
            Some(toml) => {
                let light = toml.len().is_multiple_of(2).then_some(AddedLight::Ceiling);
                let options = LoadOptions { light, ..LoadOptions::default() };
                Scene::from_toml_text("s", toml, &self.obj, &self.mtl, options)
            }
            None => Scene::from_obj_text("s", &self.obj, &self.mtl),
        }
    }
}

/// One change somewhere in a text.
pub fn change(text: String, random: &mut Random) -> String {
    match random.below(8) {
        0 | 1 => replace_word(&text, random),
        2 => change_line(&text, random),
        3 => {
            let at = place(&text, random);
            format!("{}{}{}", &text[..at], random.pick(&NASTY), &text[at..])
        }
        4 => text[..place(&text, random)].to_owned(),
        5 => {
            let (a, b) = (place(&text, random), place(&text, random));
            let (a, b) = (a.min(b), a.max(b));
            let times = random.below(9);
            format!("{}{}{}", &text[..a], text[a..b].repeat(times), &text[b..])
        }
        6 => text.replace('\n', random.pick(&["\r\n", "\r", " \n", "\\\n", "\n\n"])),
        _ => scale_number(&text, random),
    }
}

/// A character boundary.
fn place(text: &str, random: &mut Random) -> usize {
    let mut at = random.below(text.len() + 1);
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Swaps one word for a nasty one or for none.
fn replace_word(text: &str, random: &mut Random) -> String {
    let words: Vec<&str> = text.split([' ', '\n', ',']).collect();
    let word = words[random.below(words.len())];
    let start = word.as_ptr() as usize - text.as_ptr() as usize;
    let new = match random.below(8) {
        0 => "",
        _ => random.pick(&NASTY),
    };
    format!("{}{new}{}", &text[..start], &text[start + word.len()..])
}

/// Drops, doubles or moves a line.
fn change_line(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.split('\n').collect();
    let (from, to) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(3) {
        0 => drop(lines.remove(from)),
        1 => lines.insert(to, lines[from]),
        _ => lines.swap(from, to),
    }
    lines.join("\n")
}

/// Puts an exponent behind a digit.
fn scale_number(text: &str, random: &mut Random) -> String {
    let digits: Vec<usize> = text.match_indices(|c: char| c.is_ascii_digit()).map(|d| d.0 + 1).collect();
    match digits.is_empty() {
        true => text.to_owned(),
        false => {
            let at = digits[random.below(digits.len())];
            let exponent = random.below(700) as i32 - 350;
            format!("{}e{exponent}{}", &text[..at], &text[at..])
        }
    }
}
