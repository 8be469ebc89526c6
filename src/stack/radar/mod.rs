//! The onboard radar: from the sampled beat signal of an FMCW radar to targets that are followed.
//!
//! A frame goes through transforms to the power by range, radial speed and beam (`range_doppler`, `array`, [`window`]),
//! through detection ([`cfar`]), to echoes between cells (`peak`, `interpolation`, `angle`), in metres, m/s, radians and
//! square metres (`detector`); detections of one body become one (`clustering`), bodies are followed (`tracker`, `target`,
//! `assignment`) while the train moves (`own_motion`), and mirror images in walls are marked (`ghosts`).
//!
//! Frames of reference: that of the radar for detections (see [`crate::bus::RadarSheet`]), the vehicle frame of its end of
//! the train for targets, whose velocities are over ground. Heights are not told: all is taken to be at the radar's.
//!
//! Buffers and transforms are made once: up to the detections nothing is allocated in a frame.
//!
//! What it cannot do: echoes that come nearer by more than a cell of range within a frame are smeared; a scatterer's delay
//! is taken to be the same for all of a chirp, as the bus says; two targets that cross within a cell may change their
//! names.

mod angle;
mod array;
mod assignment;
pub mod cfar;
mod clustering;
mod detector;
mod ghosts;
mod interpolation;
mod own_motion;
mod peak;
mod range_doppler;
mod settings;
mod target;
#[cfg(test)]
mod testing;
mod tracker;
mod tracking;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tracking_tests;
pub mod window;

pub use settings::{CfarKind, RadarTrackingSettings};
pub use tracking::RadarTracking;
