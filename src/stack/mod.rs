//! The real thing, as it would run on a train or in a wayside box: raw sensor output, the
//! surveyed map and calibrations in; fixes, reports, messages and commands out. No clock, no
//! randomness, no files, no knowledge of the simulated world.

pub mod camera_watch;
pub mod led;
pub mod positioning;
pub mod protection;
pub mod wayside;
