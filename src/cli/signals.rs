//! Signals that ask the program to end.

/// What a process can be asked to end by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Signal {
    /// The user, at the keyboard: SIGINT.
    CtrlC,
    /// SIGTERM or SIGHUP.
    #[cfg_attr(not(unix), allow(dead_code, reason = "there are none"))]
    Ended,
}

/// Calls `act` for every signal from now on. A signal that whoever started the program has had ignored, as
/// `nohup` does with SIGHUP, stays ignored.
#[cfg(unix)]
pub(super) fn handle(act: impl Fn(Signal) + Send + 'static) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let ignored = ignored();
    let wanted = [SIGINT, SIGTERM, SIGHUP];
    let wanted = wanted.iter().filter(|s| ignored >> (**s - 1) & 1 == 0);
    match signal_hook::iterator::Signals::new(wanted) {
        Ok(mut signals) => {
            std::thread::spawn(move || {
                let kind = |signal| match signal {
                    SIGINT => Signal::CtrlC,
                    _ => Signal::Ended,
                };
                signals.forever().map(kind).for_each(act);
            });
        }
        Err(error) => tracing::warn!("signals will end the run at once: {error}"),
    }
}

/// The signals that are ignored: bit k stands for signal k + 1. None where the system does not tell.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or(0)
}

/// Calls `act` for every Ctrl-C from now on.
#[cfg(not(unix))]
pub(super) fn handle(act: impl Fn(Signal) + Send + 'static) {
    if let Err(error) = ctrlc::set_handler(move || act(Signal::CtrlC)) {
        tracing::warn!("Ctrl-C will end the run at once: {error}");
    }
}
