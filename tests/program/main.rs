//! The program as its users and their scripts meet it: what it says, what it writes, how it ends.
#![cfg(feature = "twin")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it measured"
)]

#[path = "../common/fuzz.rs"]
mod fuzz;
#[path = "../common/program.rs"]
mod program;
#[path = "../common/recordings.rs"]
mod recordings;

mod cli;
mod cli_input;
mod digest;
#[cfg(unix)]
mod folders;
mod frames;
mod import;
#[cfg(unix)]
mod kills;
mod locate;
#[cfg(target_os = "linux")]
mod memory;
mod schema;
#[cfg(target_os = "linux")]
mod signals;
mod studies;
mod swept;
