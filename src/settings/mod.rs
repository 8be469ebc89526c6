//! What every file of a user has in common: how its tables are declared, what is said of a wrong
//! value, and how TOML is read.
//!
//! It stands below all other rooms because each of them declares settings of its own, and knows
//! none of them.

mod checker;
mod declaration;
mod document;
mod files;
mod numbers;
mod problem;
mod unit;

pub use checker::Checker;
pub use declaration::Settings;
pub(crate) use declaration::settings;
pub use document::{locate, name_around, read_settings, read_toml};
pub use files::{ReadLimit, open_regular, read_bytes, read_text};
pub(crate) use numbers::one;
pub use numbers::{Numbers, put_range};
pub use problem::{
    FileError, LONGEST_KEY, Problem, did_you_mean, is_within, key_below, name_advice, shortened,
    shown,
};
pub use unit::unit_in;
