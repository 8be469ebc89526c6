//! What serde finds wrong with a document, in the words of this program.

use crate::settings::problem::MISSING;
use crate::settings::{Problem, did_you_mean, name_advice};

/// What serde found wrong, read from its message (it gives no other form).
pub(super) enum SerdeMessage {
    UnknownKey { key: String, known: Vec<String> },
    MissingKey { key: String },
    Value { what: String, expected: String },
}

impl SerdeMessage {
    pub(super) fn read(message: &str) -> Self {
        let mut quoted = quoted(message);
        if message.starts_with("unknown field") {
            Self::UnknownKey {
                key: quoted.next().unwrap_or_default(),
                known: quoted.collect(),
            }
        } else if message.starts_with("missing field") {
            Self::MissingKey {
                key: quoted.next().unwrap_or_default(),
            }
        } else {
            let (what, expected) = message.rsplit_once(", expected ").unwrap_or((message, ""));
            Self::Value {
                what: what.to_owned(),
                expected: expected.to_owned(),
            }
        }
    }

    /// A value is not what may stand there, but its message does not list the names that may.
    pub(super) fn lacks_names(&self) -> bool {
        let of_names = |expected: &str| {
            ["variant", "string or", "enum", "tagged"]
                .iter()
                .any(|word| expected.contains(word))
        };
        matches!(self, Self::Value { expected, .. } if of_names(expected) && !expected.contains('`'))
    }

    /// Names that may stand in place of a wrong value.
    pub(super) fn names(&self) -> Vec<String> {
        match self {
            Self::Value { expected, .. } => quoted(expected).collect(),
            _ => Vec::new(),
        }
    }

    /// The known key that an unknown one is taken for.
    pub(super) fn meant(&self) -> Option<&str> {
        match self {
            Self::UnknownKey { key, known } => did_you_mean(key, known),
            _ => None,
        }
    }

    /// The problem at a key; `names` are those that may stand there, where the message has none.
    pub(super) fn problem(&self, key: String, names: Vec<String>) -> Problem {
        match self {
            Self::UnknownKey { key: name, known } => Problem::new(
                key,
                format!("there is no key `{name}` here"),
                name_advice(name, known, "keys that may stand here", "take it out"),
            ),
            Self::MissingKey { .. } => Problem::new(key, MISSING, "give it a value"),
            Self::Value { what, expected } if is_too_large(what) => {
                Problem::new(key, what_is_there(what), "give a smaller whole number")
            }
            Self::Value { what, expected } => {
                let mut allowed = self.names();
                allowed.extend(names);
                let wrong = quoted(what).next().unwrap_or_default();
                Problem::new(key, what_is_there(what), remedy(&wrong, &allowed, expected))
            }
        }
    }
}

/// Whether a whole number is larger than its type holds.
fn is_too_large(what: &str) -> bool {
    let number = what.strip_prefix("invalid value: integer `");
    number.is_some_and(|number| !number.starts_with('-'))
}

/// What stands between backquotes.
fn quoted(message: &str) -> impl Iterator<Item = String> {
    message.split('`').skip(1).step_by(2).map(str::to_owned)
}

fn remedy(wrong: &str, allowed: &[String], expected: &str) -> String {
    match did_you_mean(wrong, allowed) {
        Some(similar) => format!("did you mean `{similar}`?"),
        None if !allowed.is_empty() => format!("give one of: {}", allowed.join(", ")),
        None if expected.is_empty() => "correct it".to_owned(),
        None => format!("give {}", what_is_expected(expected)),
    }
}

/// "invalid type: string "x"" and its like as a predicate of the key.
fn what_is_there(what: &str) -> String {
    let thing = ["invalid type: ", "invalid value: "]
        .iter()
        .find_map(|start| what.strip_prefix(start));
    let bare = |text: &str| text.replace('`', "");
    let Some(thing) = thing else {
        return match what.strip_prefix("invalid length ") {
            Some(length) => format!("has {length} elements"),
            None => what.replace("unknown variant", "there is no choice"),
        };
    };
    let (kind, value) = thing.split_once(' ').unwrap_or((thing, ""));
    match (kind, value) {
        ("string", value) => format!("is the text {value}"),
        ("integer", value) => format!("is the whole number {}", bare(value)),
        ("floating", value) => {
            let number = value.trim_start_matches("point ");
            format!("is the number {}", bare(number))
        }
        ("boolean", value) => format!("is {}", bare(value)),
        ("sequence", _) => "is a list".to_owned(),
        ("map", _) => "is a table or a date".to_owned(),
        _ => format!("is {}", bare(thing)),
    }
}

/// What Rust's name of a type means to a user.
fn what_is_expected(expected: &str) -> String {
    let array = expected.strip_prefix("an array of length ");
    let words = match expected {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more",
        "i64" | "i32" => "a whole number",
        "a string" | "a borrowed string" | "a character" => "a text in quotes",
        "a boolean" => "true or false",
        "a sequence" => "a list, in [ ]",
        "a map" => "a table of keys, in { } or under a heading in [ ]",
        _ if array.is_some() => {
            return format!("a list of {} elements", array.unwrap_or_default());
        }
        _ if expected.starts_with("struct") => "a table of keys, in { } or under a heading in [ ]",
        _ if expected.contains("variant") || expected.contains("string or") => {
            "the name of a choice, in quotes"
        }
        other => other,
    };
    words.to_owned()
}
