//! **metrotwin**: a physics-backed digital twin of a metro tunnel.
//!
//! A simulated train shakes along a surveyed line; a rolling-shutter camera on its head and a
//! camera on the tunnel wall see what such cameras would see; the positioning and detection
//! stack reads those pixels, never the truth; its decisions act on the train.
//!
//! The rooms, from the ground up. Imports point up this list only, and stack and twin never import
//! each other:
//!
//! | room | what it holds |
//! |---|---|
//! | [`settings`] | how files are declared, read and checked |
//! | [`track`] | the line as surveyed: alignment, cross-sections, lamps, devices; networks in plan |
//! | [`bus`] | what travels between the world and the stack, as plain data |
//! | [`stack`] | the real thing: lamp decoding, positioning, track occupancy, obstacle detection, protection |
//! | `files` | results on the disk: whole or not there, listed by folder |
//! | `twin` | the world: geometry, physics, renderers, sensors, links, faults |
//! | `scenario` | the files a user writes |
//! | `session` | one loop over world, sensors, links and equipment, scored against the truth |
//! | `record` | what a session shows in a rerun recording |
//! | `study` | many sessions: draws, workers, rows, statistics, report |
//! | `cli` | one file a subcommand |
//!
//! `settings`, `track`, `bus` and `stack` build alone (`--no-default-features`): that is what would run
//! on a train or in a wayside box. The feature `cli` adds the commands that need no world, the feature
//! `twin` (on by default) the rest.

// Tests of rooms and those in `tests` share files that name the library as its users do.
#[cfg(all(test, feature = "twin"))]
extern crate self as metrotwin;

pub mod bus;
#[cfg(feature = "cli")]
mod files;
mod numerics;
pub mod settings;
pub mod stack;
pub mod track;

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "twin")]
pub mod record;
#[cfg(feature = "twin")]
pub mod scenario;
#[cfg(feature = "twin")]
pub mod session;
#[cfg(feature = "twin")]
pub mod study;
#[cfg(feature = "twin")]
pub mod twin;
