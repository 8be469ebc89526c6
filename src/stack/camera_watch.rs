//! Is the camera alive? Told from its frames alone, before anything is read from them.
//!
//! A frame grabber that is stuck delivers its last image again and again, with new numbers and new
//! times; a detector that looks at it finds nothing new, for ever, and a train that measures its
//! place in it stands still while it runs. But no two images of a real sensor are equal: with a
//! read noise of a few electrons some of a million pixels always differ. So an image that repeats
//! the one before bit for bit is a fault, and the first such image tells. The images are compared by
//! a 64-bit fingerprint: two different ones have the same with a probability of 2^-64.
//!
//! A sensor whose output is stuck gives one grey level all over; a camera off the bus gives nothing
//! at all, which only a clock can tell ([`CameraWatch::silence`]).

use crate::bus::{CameraFault, CameraHealth, Frame, SimTime};

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
#[derive(Clone, Copy, Debug)]
struct Seen {
    number: u32,
    start: SimTime,
    fingerprint: u64,
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
        let (fingerprint, flat) = fingerprint(pixels);
        let repeated = self.last.is_some_and(|l| l.fingerprint == fingerprint);
        let fault = if pixels.is_empty() || frame.image.dimensions() != self.size_px {
            Some(CameraFault::Missing)
        } else if self.repeats_allowed {
            None
        } else if flat {
            Some(CameraFault::Dead)
        } else {
            repeated.then_some(CameraFault::Frozen)
        };
        let expected = self
            .last
            .map_or(frame.number, |l| l.number.saturating_add(1));
        let lost = frame.number.saturating_sub(expected);
        let since_last_s = self.last.map_or(STARTING_S, |l| frame.start.since(l.start));
        self.last = Some(Seen {
            number: frame.number,
            start: frame.start,
            fingerprint,
            interval_s: since_last_s / (f64::from(lost) + 1.0),
        });
        CameraHealth { fault, lost }
    }

    /// Whether the last frame is longer ago than `limit_s`, and than a camera of its rate may
    /// take.
    pub fn silence(&mut self, now: SimTime, limit_s: f64) -> bool {
        let since = *self.watched_since.get_or_insert(now);
        let (heard, usual_s) = match self.last {
            Some(last) => (last.start, MISSING * last.interval_s),
            None => (since, STARTING_S),
        };
        now.since(heard) > limit_s.max(usual_s)
    }
}

/// 64 bits that tell one image from another, and whether all its bytes are equal. Four sums run
/// side by side, each multiplied by an odd number at every step, so that place and value of every
/// byte count.
fn fingerprint(bytes: &[u8]) -> (u64, bool) {
    const ODD: [u64; 4] = [
        0x9e37_79b9_7f4a_7c15,
        0xbf58_476d_1ce4_e5b9,
        0x94d0_49bb_1331_11eb,
        0xd6e8_feb8_6659_fd93,
    ];
    let first = bytes.first().copied().unwrap_or(0);
    let all_first = u64::from_ne_bytes([first; 8]);
    let (mut sums, mut differ) = (ODD, 0);
    let mut blocks = bytes.chunks_exact(32);
    for block in &mut blocks {
        for ((sum, word), odd) in sums.iter_mut().zip(block.chunks_exact(8)).zip(ODD) {
            let mut eight = [0; 8];
            eight.copy_from_slice(word);
            let word = u64::from_le_bytes(eight);
            differ |= word ^ all_first;
            *sum = (*sum ^ word).wrapping_mul(odd);
            *sum ^= *sum >> 32;
        }
    }
    let mut sum = sums.iter().fold(bytes.len() as u64, |all, s| {
        (all ^ s).wrapping_mul(ODD[0]).rotate_left(29)
    });
    for &byte in blocks.remainder() {
        differ |= u64::from(byte ^ first);
        sum = (sum ^ u64::from(byte)).wrapping_mul(ODD[1]);
    }
    (sum ^ (sum >> 31), differ == 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};

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

    /// A change of any one bit of any pixel that is not seen would call a living camera frozen.
    #[test]
    fn any_single_bit_makes_another_image() {
        let base = image(1);
        let mut seen = vec![fingerprint(base.as_raw()).0];
        for k in 0..base.as_raw().len() {
            for bit in 0..8 {
                let mut other = base.clone().into_raw();
                other[k] ^= 1 << bit;
                seen.push(fingerprint(&other).0);
            }
        }
        let count = seen.len();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), count);
    }

    /// Each fault by its own name; a living camera by none; and a stuck one is told by its first
    /// repetition, since the fix from it would be a frame's way off already.
    #[test]
    fn each_fault_is_told() {
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
