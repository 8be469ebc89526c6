//! One run: twin -> bus -> stack -> bus -> twin, step by step, scored against the truth.

mod event;

pub use event::{Event, Observer, ObserverError, Opening, TrainTruth};
