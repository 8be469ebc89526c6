//! What every file of a user has in common: how its tables are declared, what is said of a wrong
//! value, and how TOML is read.
//!
//! It stands below all other rooms because each of them declares settings of its own, and knows
//! none of them.

mod declaration;
mod document;
mod entries;
mod files;
mod names;
mod numbers;
mod problem;
mod search;
mod unit;
mod wrong;

pub use declaration::Settings;
pub(crate) use declaration::settings;
pub use document::{read_settings, read_toml};
pub use entries::locate;
pub use files::{ReadLimit, read_bytes, read_text};
pub use names::{did_you_mean, name_advice};
pub(crate) use numbers::one;
pub use numbers::{Numbers, put_range};
pub use problem::{
    Checker, FileError, LONGEST_KEY, Problem, is_within, key_below, shortened, shown,
};
pub use unit::unit_in;
