//! A graphics driver's message that has nothing to do with this program.
//!
//! Mesa asks the Wayland desktop which adapter is its own, once for each list of adapters. Without
//! `XDG_RUNTIME_DIR`, as in containers and under cron, Wayland's library prints an error each time.
//! Any folder in that variable silences it: no desktop is found there, as before.

/// Starts the program again in place of itself, with the variable set where it is not: a process
/// cannot change its own environment safely. Where it cannot be started, all goes on as it is.
#[cfg(target_os = "linux")]
pub(super) fn silence() {
    use std::env;
    use std::os::unix::process::CommandExt;
    let is_set =
        env::var_os("XDG_RUNTIME_DIR").is_some_and(|dir| std::path::Path::new(&dir).is_absolute());
    let folder = env::temp_dir();
    if is_set || !folder.is_absolute() {
        return;
    }
    let Ok(program) = env::current_exe() else {
        return;
    };
    let mut arguments = env::args_os();
    let mut again = std::process::Command::new(&program);
    again.arg0(arguments.next().unwrap_or(program.into_os_string()));
    let error = again.args(arguments).env("XDG_RUNTIME_DIR", folder).exec();
    tracing::debug!("the graphics driver may complain of XDG_RUNTIME_DIR: {error}");
}

/// Only Linux has it.
#[cfg(not(target_os = "linux"))]
pub(super) fn silence() {}
