//! From chips to a name, out of one frame or of several joined.
//!
//! The lamp repeats its frame without a pause, so any `n` consecutive chips hold all of it, turned
//! by an unknown number of chips; the header, which data cannot contain, tells by how many. A far
//! lamp shows fewer than `n` chips at a time. But rows have absolute times and the lamp's clock is
//! stable: from image to image (33 ms, some 740 chips) a clock that is 100 ppm off slips by 0.07
//! chips. So chips of successive images are folded by time modulo the frame's period into one
//! vote a chip, and each image's own edges set the fold's phase anew (a first-order phase-locked
//! loop), so that the slips do not add up.
//!
//! A check sum of 6 bits passes 1 wrong name in 64. Manchester's second halves (or NRZ's
//! complements), header and footer are checked besides: of random chips 1 set in 2^34 passes. Up to
//! [`MAX_UNKNOWN`] chips that were never seen are tried both ways; a name must then be the only
//! one that fits.

use super::stripes::StripeReading;
use crate::track::uid::{ChipFrame, LineCode, Uid};

/// Chips of a frame that may be unknown.
pub const MAX_UNKNOWN: u32 = 6;
/// A chip is known if its votes agree this well: |sum| over weight.
const AGREEMENT: f64 = 0.5;
/// Share of a phase error that the loop takes over.
const LOOP_GAIN: f64 = 0.4;
/// More chips than this with contradicting votes: the fold has slipped.
const MAX_CONTRADICTIONS: u32 = 6;

/// Reads the only name that fits `on` where `known`, in any rotation.
pub fn decode_cyclic(on: u64, known: u64, code: LineCode) -> Option<Uid> {
    let n = code.chips();
    let whole = u64::MAX >> (64 - n);
    let unknown = n - (known & whole).count_ones();
    if unknown > MAX_UNKNOWN {
        return None;
    }
    let turn = |x: u64, by: u32| (x >> by | x << (n - by)) & whole;
    let (header, header_chips) = code.header();
    let header_mask = (1u64 << header_chips) - 1;
    let mut found = None;
    for by in 0..n {
        let (on, known) = (turn(on & whole, by), turn(known & whole, by));
        if (on ^ header) & known & header_mask != 0 {
            continue;
        }
        let open = whole & !known;
        let mut fill = open;
        loop {
            let bits = on & known | fill;
            if let Some(uid) = Uid::from_frame(ChipFrame { bits, len: n }, code) {
                if found.is_some_and(|f| f != uid) {
                    return None;
                }
                found = Some(uid);
            }
            if fill == 0 {
                break;
            }
            fill = (fill - 1) & open;
        }
    }
    found
}

/// Votes for every chip of a lamp's frame, folded by time.
#[derive(Clone, Debug)]
pub struct ChipVotes {
    code: LineCode,
    chip_s: f64,
    /// Time of a chip boundary and the place in the frame of the chip after it.
    anchor: Option<(f64, i64)>,
    sum: [f64; 64],
    weight: [f64; 64],
}

impl ChipVotes {
    /// No votes yet.
    pub fn new(code: LineCode, chip_s: f64) -> Self {
        Self {
            code,
            chip_s,
            anchor: None,
            sum: [0.0; 64],
            weight: [0.0; 64],
        }
    }

    /// Forgets all votes.
    pub fn clear(&mut self) {
        *self = Self::new(self.code, self.chip_s);
    }

    /// Adds the chips of an image whose row 0 opened `start_s` after a time of the caller's
    /// choice. Where they contradict what was folded before, that is forgotten.
    pub fn add(&mut self, start_s: f64, reading: &StripeReading) {
        self.fold(start_s + reading.phase_s, reading);
        if self.contradictions() > MAX_CONTRADICTIONS {
            self.clear();
            self.fold(start_s + reading.phase_s, reading);
        }
    }

    fn fold(&mut self, phase_s: f64, reading: &StripeReading) {
        let n = i64::from(self.code.chips());
        let (time, place) = self.anchor.unwrap_or((phase_s, 0));
        let elapsed = ((phase_s - time) / self.chip_s).round();
        let expected = time + elapsed * self.chip_s;
        let first = (place + elapsed as i64).rem_euclid(n);
        self.anchor = Some((expected + LOOP_GAIN * (phase_s - expected), first));
        for (k, level) in reading.chips.iter().enumerate() {
            if let Some(on) = level {
                let chip = ((first + k as i64) % n) as usize;
                self.sum[chip] += if *on {
                    reading.coherence
                } else {
                    -reading.coherence
                };
                self.weight[chip] += reading.coherence;
            }
        }
    }

    /// Fewest chips that a name is read from.
    pub fn least_chips(&self) -> u32 {
        self.code.chips() - MAX_UNKNOWN
    }

    fn is_known(&self, chip: usize) -> bool {
        self.weight[chip] > 0.0 && self.sum[chip].abs() >= AGREEMENT * self.weight[chip]
    }

    fn contradictions(&self) -> u32 {
        let seen = (0..self.code.chips() as usize).filter(|&k| self.weight[k] > 0.0);
        seen.filter(|&k| !self.is_known(k)).count() as u32
    }

    /// The name that the votes spell.
    pub fn decode(&self) -> Option<Uid> {
        let (mut on, mut known) = (0, 0);
        for k in 0..self.code.chips() as usize {
            if self.is_known(k) {
                known |= 1u64 << k;
                on |= u64::from(self.sum[k] > 0.0) << k;
            }
        }
        decode_cyclic(on, known, self.code)
    }
}

/// The longest run of dark chips among these frames, read cyclically.
pub fn longest_dark_run(frames: impl Iterator<Item = ChipFrame>) -> u32 {
    frames.map(dark_run).max().unwrap_or(0)
}

fn dark_run(frame: ChipFrame) -> u32 {
    let (mut run, mut longest) = (0, 0);
    // Twice round, so that a run over the end is counted whole.
    for k in 0..2 * frame.len {
        run = if frame.is_on(k % frame.len) {
            0
        } else {
            run + 1
        };
        longest = longest.max(run.min(frame.len));
    }
    longest
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const CODES: [LineCode; 2] = [LineCode::Manchester, LineCode::Nrz];

    fn turned(frame: ChipFrame, by: u32) -> u64 {
        let n = frame.len;
        (0..n).fold(0, |bits, k| {
            bits | u64::from(frame.is_on((k + by) % n)) << k
        })
    }

    /// Any rotation of any name's frame is read, and read as that name.
    #[test]
    fn reads_every_rotation() {
        for code in CODES {
            for lamp in (0..1024).step_by(41) {
                let uid = Uid {
                    line: (lamp % 16) as u8,
                    lamp,
                };
                for by in 0..code.chips() {
                    let on = turned(uid.frame(code), by);
                    assert_eq!(decode_cyclic(on, u64::MAX, code), Some(uid));
                }
            }
        }
    }

    /// Chips that nobody saw are filled in, and a wrong chip is never read as another name.
    #[test]
    fn few_unknown_chips_are_filled_and_one_wrong_chip_is_refused() {
        let uid = Uid { line: 1, lamp: 613 };
        let frame = uid.frame(LineCode::Manchester);
        let on = turned(frame, 17);
        for k in 0..43 {
            let hidden = 0b1_1111u64 << k;
            let read = decode_cyclic(on & !hidden, !hidden, LineCode::Manchester);
            assert!(read.is_none() || read == Some(uid), "{k}: {read:?}");
            assert_eq!(
                decode_cyclic(on ^ 1 << k, u64::MAX, LineCode::Manchester),
                None
            );
        }
        assert_eq!(decode_cyclic(on, 0xff_ffff, LineCode::Manchester), None);
        assert_eq!(decode_cyclic(0, 0, LineCode::Nrz), None);
    }

    /// A dozen chips an image, a clock 60 ppm off and half a chip of phase noise: joined.
    #[test]
    fn joins_a_far_lamp_with_a_wrong_clock() {
        for code in CODES {
            let uid = Uid { line: 1, lamp: 357 };
            let frame = uid.frame(code);
            let (chip, true_chip) = (45e-6, 45e-6 * (1.0 + 60e-6));
            let mut votes = ChipVotes::new(code, chip);
            let mut read = None;
            for image in 0..12 {
                let start = f64::from(image) / 30.0;
                let first = ((start + 0.009) / true_chip).ceil();
                let noise = [0.2, -0.15, 0.1, -0.2][image as usize % 4] * chip;
                let chip_at = |k| ((first as u64 + k) % u64::from(frame.len)) as u32;
                let reading = StripeReading {
                    phase_s: first * true_chip - start + noise,
                    chips: (0..14).map(|k| Some(frame.is_on(chip_at(k)))).collect(),
                    coherence: 0.9,
                    edges: 8,
                };
                votes.add(start, &reading);
                read = read.or(votes.decode());
            }
            assert_eq!(read, Some(uid), "{code:?}");
        }
    }

    #[test]
    fn dark_runs_go_round_the_end() {
        let frame = ChipFrame {
            bits: 0b00_1110_1100,
            len: 10,
        };
        assert_eq!(longest_dark_run([frame].into_iter()), 4);
        let all = (0..1024).map(|lamp| Uid { line: 1, lamp }.frame(LineCode::Manchester));
        assert_eq!(longest_dark_run(all), 4);
    }
}
