//! What every file of a user has in common: how its tables are declared, what is said of a wrong
//! value, and how TOML is read.
//!
//! It stands below all other rooms because each of them declares settings of its own, and knows
//! none of them.

mod declaration;
mod document;
mod numbers;
mod problem;
mod unit;

pub use declaration::Settings;
pub(crate) use declaration::settings;
pub use document::{did_you_mean, locate, name_advice, read_toml};
pub(crate) use numbers::one;
pub use numbers::{Numbers, put_range};
pub use problem::{Checker, FileError, Problem, key_below};
pub use unit::unit_in;
