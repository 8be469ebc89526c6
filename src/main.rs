//! The program `metrotwin`. See the library's [`metrotwin::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    metrotwin::cli::main()
}
