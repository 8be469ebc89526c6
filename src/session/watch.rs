//! Wall time of a session, which the figures report and nothing depends on.

use super::{Event, Observer, ObserverError};

/// Adds up the time spent in one kind of work.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stopwatch {
    /// Seconds so far.
    pub total_s: f64,
}

impl Stopwatch {
    /// Does the work; gives its result and its seconds.
    pub fn time<T>(&mut self, work: impl FnOnce() -> T) -> (T, f64) {
        let begin = now();
        let result = work();
        let seconds = begin.elapsed().as_secs_f64();
        self.total_s += seconds;
        (result, seconds)
    }
}

/// The wall clock, for figures of speed only.
#[allow(
    clippy::disallowed_methods,
    reason = "how long a run takes is one of its figures; no result depends on it"
)]
pub fn now() -> std::time::Instant {
    std::time::Instant::now()
}

/// All observers as one, timed.
pub struct Watchers<'a, 'b> {
    observers: &'a mut [&'b mut dyn Observer],
    /// Time spent in them.
    pub watch: Stopwatch,
}

impl<'a, 'b> Watchers<'a, 'b> {
    /// Of these observers.
    pub fn new(observers: &'a mut [&'b mut dyn Observer]) -> Self {
        Self {
            observers,
            watch: Stopwatch::default(),
        }
    }

    /// Shows an event to all.
    pub fn show(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        self.each(|o| o.observe(event))
    }

    /// Calls every observer.
    pub fn each(
        &mut self,
        mut call: impl FnMut(&mut dyn Observer) -> Result<(), ObserverError>,
    ) -> Result<(), ObserverError> {
        let observers = &mut *self.observers;
        let work = || observers.iter_mut().try_for_each(|o| call(*o));
        self.watch.time(work).0
    }
}
