//! Input that nobody wrote: files, messages and folders with drawn mistakes.
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
#[path = "../common/fuzz.rs"]
mod fuzz;

mod check;
mod maps;
mod stack;
mod study;
