//! The files a user writes: a scenario says everything about one run, and is checked as a whole
//! before anything starts.
//!
//! [`ScenarioFile`] is the file as written (TOML; every key is optional but `name` and `tunnel`).
//! [`Scenario`] is what it means: the tunnel is read, the cameras are calibrated, and every
//! check has passed, including those between parts: an obstacle in the rock, a wayside device that
//! the tunnel does not have, more rows than a frame has time for, a rig that never sees a lamp.
//! All problems are reported at once, each with its key, what is wrong and what would be right.
//!
//! ```
//! use metrotwin::scenario::ScenarioFile;
//! use metrotwin::settings::read_toml;
//!
//! let file: ScenarioFile = read_toml(r#"
//!     name = "first_run"
//!     tunnel = "../tunnels/test_bench.toml"
//!     duration_s = 10.0
//!     [train]
//!     cruise_speed_kmh = 40.0
//! "#)?;
//! assert_eq!(file.duration_s, 10.0);
//! // What is not written has the reference values.
//! assert_eq!(file.train.map(|t| t.cars), Some(6));
//! # Ok::<(), metrotwin::settings::FileError>(())
//! ```
//!
//! The settings of each part are declared beside its own code; this room puts them together, and
//! declares those that belong to no part below it: bench, recording, latency.
//! `--set key=value` overrides are applied to the document before it is parsed ([`Override`]), so
//! that they meet the same checks as the file.
//!
//! Distributions over any of its keys stand in the file too: [`sampling`].
//!
//! What it does not do: many runs (studies), and anything that needs a clock or a renderer.

mod build;
mod check;
mod error;
mod file;
mod meshes;
mod overrides;
mod parts;
mod recording;
pub mod sampling;

pub use build::{Scenario, WaysidePost};
pub use error::ScenarioError;
pub use file::{
    BenchSettings, MOST_SEED, OnboardEquipment, OnboardSettings, ScenarioFile, StackSettings,
    WaysidePostSettings,
};
pub use overrides::{Override, OverrideError};
pub(crate) use parts::{parse_vehicle, read};
pub use recording::RecordSettings;
