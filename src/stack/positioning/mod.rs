//! Where the train is, from lamps seen by a stereo camera.

mod positioner;
mod settings;

pub use positioner::LedPositioner;
pub use settings::LedSettings;
