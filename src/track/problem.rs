//! What is wrong with a file, in terms of its own keys.

use std::fmt;

/// One wrong value: where, what, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Dotted path of the key, as in the file: `lamps.spacing_m`, `obstacles[2].mass_kg`.
    pub key: String,
    /// What is wrong, with the numbers and their units.
    pub what: String,
    /// What would be right.
    pub remedy: String,
}

impl Problem {
    /// A problem at `key`.
    pub fn new(key: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            what: what.into(),
            remedy: remedy.into(),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; {}", self.key, self.what, self.remedy)
    }
}
