//! Whole runs by the library: what equipment hears, says and comes to.
#![cfg(feature = "twin")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it measured"
)]

#[path = "../common/mod.rs"]
mod common;

mod calibration;
mod combined;
mod determinism;
mod fault_matrix;
mod faults;
mod messages;
mod occupancy;
mod radar;
mod receivers;
mod trains;
mod validation;
