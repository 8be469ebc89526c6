//! What is drawn, against closed forms, brute force and the other renderer.
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

mod gpu;
mod gpu_vs_cpu;
mod lamps;
mod network;
mod parts;
mod sensor;
mod shaders;
mod shadows;
mod smear;
mod veil;
