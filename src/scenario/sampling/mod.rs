//! Scenarios that are drawn: a file with a `[study]` says which keys vary and how; any run of it can
//! be had alone, by its index.
//!
//! ```
//! use metrotwin::scenario::sampling::Template;
//! # let folder = std::env::temp_dir().join(format!("metrotwin-draw-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! # std::fs::copy("tunnels/test_bench.toml", folder.join("bench.toml"))?;
//! let path = folder.join("speeds.toml");
//! std::fs::write(&path, r#"
//!     name = "speeds"
//!     tunnel = "bench.toml"
//!     duration_s = 5.0
//!     [train]
//!     [study]
//!     seed = 7
//!     runs = 50
//!     require = ["speed_kmh > 25 || cars < 5"]
//!     [study.variables.speed_kmh]
//!     keys = ["train.cruise_speed_kmh"]
//!     from = { uniform = { min = 20.0, max = 80.0 } }
//!     [study.variables.cars]
//!     keys = ["train.cars"]
//!     from = { integer = { min = 1, max = 6 } }
//! "#)?;
//! let template = Template::load(&path)?;
//! let draw = template.sample(12)?;
//! assert_eq!(draw, template.sample(12)?); // whatever came before
//! let scenario = template.scenario(&draw)?;
//! assert_eq!(scenario.file.seed, draw.seed);
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # From an index to a scenario
//!
//! 1. A [plan](PlanSettings) gives run k a point of the unit cube, a coordinate a variable: independent,
//!    of a Latin hypercube, or of a scrambled Sobol sequence. Every coordinate has a stream of its own,
//!    by the variable's name, so that a new variable leaves the others' draws as they are (but
//!    Sobol's, whose dimensions go by the order of names).
//! 2. Coordinates of a correlated group are turned by a Gaussian copula.
//! 3. Each variable's quantile function makes a value of its coordinate.
//! 4. Where a condition does not hold, the run is drawn again, from independent points; how often is
//!    counted.
//! 5. The values are set in the file as `--set` would, and it is checked like any other.
//!
//! The same (seed, index) is the same scenario for ever: nothing depends on other runs, on the number
//! of runs, or on threads.
//!
//! # What it does not do
//!
//! Distributions with parameters that are drawn themselves; draws that follow from earlier results.

mod concrete;
mod condition;
mod copula;
mod distribution;
mod inputs;
mod plan;
mod sample;
mod settings;
mod tables;
mod template;

pub use concrete::complete;
pub use condition::{Condition, ConditionError};
pub(crate) use inputs::read_input;
pub use inputs::{Inputs, sha256};
pub use sample::{SampleError, ScenarioSample};
pub use settings::{
    CorrelationSettings, Distribution, PlanSettings, PrecisionSettings, StopSettings,
    StudySettings, VariableSettings, as_written,
};
pub use template::{MOST_RUNS, Template};
