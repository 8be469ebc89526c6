//! Is the camera alive? Seen from its frames alone, before anything is read from them.
//!
//! A frame grabber that is stuck delivers its last image again and again, with new numbers and new
//! times; a detector that looks at it finds nothing new, for ever, and a train that measures its
//! place in it stands still while it runs. But no two images of a real sensor are equal: with a
//! read noise of a few electrons some of a million pixels always differ. So an image that repeats
//! the one before bit for bit is a fault, and the first such image shows it.
//!
//! A sensor whose output is stuck gives one grey level all over; a camera off the bus gives nothing
//! at all, which only a clock can tell ([`CameraWatch::silence`]).

use crate::bus::{CameraFault, CameraHealth, Frame, SimTime};
use image::GrayImage;

/// Watches one camera.
#[derive(Clone, Debug)]
pub struct CameraWatch {
    size_px: (u32, u32),
    repeats_allowed: bool,
    /// When it was first asked about silence.
    watched_since: Option<SimTime>,
    last: Option<Seen>,
}

/// What is kept of the frame before.
#[derive(Clone, Debug)]
struct Seen {
    number: u32,
    start: SimTime,
    image: GrayImage,
    /// Since the frame before.
    interval_s: f64,
}

/// A camera is given this long for its first frames.
const STARTING_S: f64 = 5.0;
/// It is not silent before so many frames are missing.
const MISSING: f64 = 3.0;

impl CameraWatch {
    /// For images of this size. `repeats_allowed` where they are without noise, and may repeat or be
    /// of one grey all over.
    pub fn new(size_px: (u32, u32), repeats_allowed: bool) -> Self {
        Self {
            size_px,
            repeats_allowed,
            watched_since: None,
            last: None,
        }
    }

    /// Takes a frame; frames come in order.
    pub fn look(&mut self, frame: &Frame) -> CameraHealth {
        let pixels = frame.image.as_raw();
        let last = self.last.take();
        let fault = if pixels.is_empty() || frame.image.dimensions() != self.size_px {
            Some(CameraFault::Missing)
        } else if self.repeats_allowed {
            None
        } else if pixels.iter().all(|grey| *grey == pixels[0]) {
            Some(CameraFault::Dead)
        } else {
            let repeated = last.as_ref().is_some_and(|l| l.image == frame.image);
            repeated.then_some(CameraFault::Frozen)
        };
        let (expected, since_last_s) = match &last {
            Some(l) => (l.number.saturating_add(1), frame.start.since(l.start)),
            None => (frame.number, STARTING_S),
        };
        let lost = frame.number.saturating_sub(expected);
        // The last image's memory serves again.
        let mut image = last.map(|l| l.image).unwrap_or_default();
        image.clone_from(&frame.image);
        self.last = Some(Seen {
            number: frame.number,
            start: frame.start,
            image,
            interval_s: since_last_s / (f64::from(lost) + 1.0),
        });
        CameraHealth { fault, lost }
    }

    /// Whether the last frame is longer ago than `limit_s`, and than a camera of its rate may
    /// take.
    pub fn silence(&mut self, now: SimTime, limit_s: f64) -> bool {
        let since = *self.watched_since.get_or_insert(now);
        let (heard, usual_s) = match &self.last {
            Some(last) => (last.start, MISSING * last.interval_s),
            None => (since, STARTING_S),
        };
        now.since(heard) > limit_s.max(usual_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    fn frame(number: u32, image: &GrayImage) -> Frame {
        let start = SimTime::from_secs(f64::from(number) / 30.0);
        let image = image.clone();
        Frame {
            number,
            start,
            exposure_s: 30e-6,
            gain_db: 0.0,
            image,
        }
    }

    /// 33 x 7 pixels, no multiple of a block, with a grey of their own.
    fn image(seed: u32) -> GrayImage {
        GrayImage::from_fn(33, 7, |u, v| Luma([(u * 7 + v * 31 + seed * 13) as u8]))
    }

    /// Each fault by its own name; a living camera by none; and a stuck one is found by its first
    /// repetition, since the fix from it would be a frame's way off already.
    #[test]
    fn each_fault_has_its_name() {
        let mut watch = CameraWatch::new((33, 7), false);
        let mut say = |number, image: &GrayImage| watch.look(&frame(number, image)).fault;
        assert_eq!(say(0, &image(0)), None);
        assert_eq!(say(1, &image(1)), None);
        assert_eq!(say(2, &image(1)), Some(CameraFault::Frozen));
        assert_eq!(say(3, &image(1)), Some(CameraFault::Frozen));
        assert_eq!(say(4, &image(2)), None);
        assert_eq!(say(5, &GrayImage::new(33, 7)), Some(CameraFault::Dead));
        let white = GrayImage::from_pixel(33, 7, Luma([255]));
        assert_eq!(say(6, &white), Some(CameraFault::Dead));
        assert_eq!(say(7, &GrayImage::new(0, 0)), Some(CameraFault::Missing));
        let small = GrayImage::from_fn(7, 33, |u, _| Luma([u as u8]));
        assert_eq!(say(8, &small), Some(CameraFault::Missing));
        assert_eq!(say(9, &image(3)), None);
        let mut allowed = CameraWatch::new((33, 7), true);
        for number in 0..3 {
            assert!(allowed.look(&frame(number, &image(1))).is_good());
        }
    }

    /// One lost too few or too many, the first frame counted from 0, numbers that run backwards.
    #[test]
    fn gaps_in_the_numbers_are_lost_frames() {
        let mut watch = CameraWatch::new((33, 7), false);
        let numbers = [4, 5, 8, 9, 9, 3, 4];
        let lost: Vec<_> = (0..)
            .zip(numbers)
            .map(|(k, number)| watch.look(&frame(number, &image(k))).lost)
            .collect();
        assert_eq!(lost, [0, 0, 2, 0, 0, 0, 0]);
    }

    /// A camera that takes its time is not silent: neither at the start nor at a low rate.
    #[test]
    fn silence_is_longer_than_patience_and_rate() {
        let mut watch = CameraWatch::new((33, 7), false);
        let at = SimTime::from_secs;
        assert!(!watch.silence(at(0.0), 0.5));
        assert!(!watch.silence(at(4.9), 0.5) && watch.silence(at(5.1), 0.5));
        for (number, start_s) in [(0, 0.0), (1, 0.1), (3, 0.3)] {
            let mut frame = frame(number, &image(number));
            frame.start = at(start_s);
            watch.look(&frame);
        }
        assert!(!watch.silence(at(0.79), 0.5) && watch.silence(at(0.81), 0.5));
        assert!(!watch.silence(at(0.59), 0.1) && watch.silence(at(0.61), 0.1));
    }
}
