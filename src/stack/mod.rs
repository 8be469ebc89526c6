//! The real thing, as it would run on a train or in a wayside box: raw sensor output, the
//! surveyed map and calibrations in; fixes, reports, messages and commands out. No clock, no
//! randomness, no files, no knowledge of the simulated world.
//!
//! Each part is [`Equipment`] of a train or a wayside post.

pub mod camera_watch;
pub mod combined;
mod equipment;
mod history;
pub mod led;
pub mod occupancy;
mod odometry;
pub mod positioning;
pub mod protection;
pub mod protection_level;
pub mod radar;
mod runs;
pub mod wayside;

pub use equipment::Equipment;
