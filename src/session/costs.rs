//! Wall time of a session, which the figures report and nothing depends on.

use super::{Event, Observer, ObserverError};

/// Adds up the time spent in one kind of work.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stopwatch {
    /// Seconds so far.
    pub total_s: f64,
    /// Pieces of work so far.
    pub times: u64,
}

impl Stopwatch {
    /// Does the work; gives its result and its seconds.
    pub fn time<T>(&mut self, work: impl FnOnce() -> T) -> (T, f64) {
        let begin = now();
        let result = work();
        let seconds = begin.elapsed().as_secs_f64();
        self.total_s += seconds;
        self.times += 1;
        (result, seconds)
    }
}

/// What a run spends its wall time on.
#[derive(Clone, Copy, Debug, Default)]
pub struct Costs {
    /// Steps of the world.
    pub physics: Stopwatch,
    /// Handing scenes to the renderer.
    pub submit: Stopwatch,
    /// Waiting for images.
    pub wait: Stopwatch,
    /// The stack at work.
    pub stack: Stopwatch,
}

/// The wall clock, for figures of speed only.
#[allow(
    clippy::disallowed_methods,
    reason = "how long a run takes is one of its figures; no result depends on it"
)]
fn now() -> std::time::Instant {
    std::time::Instant::now()
}

/// All observers as one, timed.
pub struct Observers<'a, 'b> {
    begin: std::time::Instant,
    observers: &'a mut [&'b mut dyn Observer],
    /// Time spent in them.
    pub watch: Stopwatch,
}

impl<'a, 'b> Observers<'a, 'b> {
    /// Of these observers.
    pub fn new(observers: &'a mut [&'b mut dyn Observer]) -> Self {
        Self {
            begin: now(),
            observers,
            watch: Stopwatch::default(),
        }
    }

    /// Seconds since the first of them was called in.
    pub fn wall_s(&self) -> f64 {
        self.begin.elapsed().as_secs_f64()
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
