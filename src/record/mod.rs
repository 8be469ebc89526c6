//! Recordings.

mod settings;

pub use settings::RecordSettings;
