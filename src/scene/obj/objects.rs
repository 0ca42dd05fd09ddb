//! Names of an OBJ's objects (`o`) and groups (`g`), each of which that has faces is an object of the scene.
//!
//! A group goes by its own name. Where that alone would make groups of two objects one, or a group and another object,
//! it is `object/group`. A group of its object's name is the object, a group outside of any object is one itself, and
//! `o` ends the group before it. Not handled: the several names that one `g` may have; they are one name.

use std::collections::{HashMap, HashSet};

use crate::scene::obj::lines::Statement;

/// What a face belongs to where the file has no `o` or `g`, or one without a name.
const DEFAULT: &str = "default";

/// An object and, where it has one, a group in it.
type Key = (String, Option<String>);

/// Objects and groups that have faces, in order of their first face.
#[derive(Debug, Default)]
pub(super) struct Objects {
    keys: Vec<Key>,
    index: HashMap<Key, usize>,
    object: Option<String>,
    group: Option<String>,
    /// The number of the current one, where it is known.
    current: Option<usize>,
}

impl Objects {
    /// Begins the object or group that an `o` or `g` names.
    pub(super) fn begin(&mut self, statement: &Statement) {
        let name = Some(if statement.rest().is_empty() { DEFAULT } else { statement.rest() }.to_owned());
        (self.object, self.group) = match statement.keyword() {
            "o" => (name, None),
            _ => (self.object.take(), name),
        };
        self.current = None;
    }

    /// The number of the current one, which has a face.
    pub(super) fn current(&mut self) -> usize {
        let Objects { keys, index, object, group, current } = self;
        *current.get_or_insert_with(|| {
            let key = key(object.as_deref(), group.as_deref());
            *index.entry(key).or_insert_with_key(|key| {
                keys.push(key.clone());
                keys.len() - 1
            })
        })
    }

    /// Their names, no two alike.
    pub(super) fn names(&self) -> Vec<String> {
        let mut own: HashMap<&str, u32> = HashMap::new();
        for key in &self.keys {
            *own.entry(last(key)).or_default() += 1;
        }
        let mut taken = HashSet::new();
        let name = |key: &Key| {
            let mut name = match key {
                (object, Some(group)) if own[group.as_str()] > 1 => format!("{object}/{group}"),
                _ => last(key).to_owned(),
            };
            // An object may have the name that another's group gets.
            while !taken.insert(name.clone()) {
                name.push('\'');
            }
            name
        };
        self.keys.iter().map(name).collect()
    }
}

fn key(object: Option<&str>, group: Option<&str>) -> Key {
    let inside = object.and(group).filter(|group| Some(*group) != object);
    (object.or(group).unwrap_or(DEFAULT).to_owned(), inside.map(str::to_owned))
}

fn last((object, group): &Key) -> &str {
    group.as_ref().unwrap_or(object)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::obj::lines::statements;

    /// The objects of faces `f` among `o` and `g`, and all names.
    fn read(text: &str) -> (Vec<usize>, Vec<String>) {
        let (mut objects, mut faces) = (Objects::default(), Vec::new());
        for statement in statements(&text.replace(';', "\n")) {
            if statement.keyword() == "f" {
                faces.push(objects.current());
            } else {
                objects.begin(&statement);
            }
        }
        (faces, objects.names())
    }

    #[test]
    fn groups_of_one_name_in_two_objects_are_two() {
        for (text, faces, names) in [
            ("o floor;g default;f;o ceiling;g default;f", &[0, 1][..], &["floor/default", "ceiling/default"][..]),
            ("o floor;g a;f;g b;f;o ceiling;g a;f", &[0, 1, 2], &["floor/a", "b", "ceiling/a"]),
            ("o a;g;f;o b;g;f", &[0, 1], &["a/default", "b/default"]),
            ("f;o one;f;g two;g three;f;o one;f", &[0, 1, 2, 1], &["default", "one", "three"]),
            ("o a;g a;f;o a;f;g x;f;g a;f", &[0, 0, 1, 0], &["a", "x"]),
            ("g x;f;g y;f;g x;f", &[0, 1, 0], &["x", "y"]),
            ("o x;f;o y;g x;f", &[0, 1], &["x", "y/x"]),
            ("f;g default;f", &[0, 0], &["default"]),
            ("o a/b;f;o a;g b;f;o b;f", &[0, 1, 2], &["a/b", "a/b'", "b"]),
            ("o a;g left right;f;o b;g left right;f", &[0, 1], &["a/left right", "b/left right"]),
        ] {
            let found = read(text);
            assert_eq!(
                (&found.0[..], found.1.iter().map(String::as_str).collect::<Vec<_>>()),
                (faces, names.to_vec()),
                "{text}"
            );
        }
    }
}
