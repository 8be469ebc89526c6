//! From a row profile to chips: stripe edges, their clock, and the levels between them.
//!
//! A row sees the mean of the lamp's light from its opening to its closing, so light over envelope
//! crosses one half at the mid-exposure time of a switching. A crossing is interpolated between
//! rows. Rows are gone through in the order of time, upwards where the sensor is read upwards. A
//! global shutter has no such order: there is nothing to read.
//!
//! **Broadening.** A saturated row is white as soon as the lamp was on for a small part of its
//! exposure: bright stripes then begin early and end late, by one time delta, at most half the
//! exposure. On the circle of one chip time the rising edges then lie at phi - delta and the
//! falling ones at phi + delta. With R and F the sums of unit vectors of either kind,
//! 2 delta = arg(F conj R), but for whole chips: of the two values next to 0 the one is right that
//! leaves no stripe shorter than a chip. phi is the argument of the edges' sum after every one has
//! been moved back by its delta. The resultant's length tells how well
//! the edges keep to the clock: light that does not blink in this clock is no lamp.
//!
//! Knowing phi, every edge has an integer chip number, and a stripe's width in chips is the
//! difference of two: an error of one width does not shift the chips after it.

use super::profile::RowProfile;
use crate::bus::Shutter;
use nalgebra::Complex;
use std::f64::consts::TAU;

/// Chips of one spot in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StripeReading {
    /// Time of the boundary before chip 0, seconds from the frame's start.
    pub phase_s: f64,
    /// Levels of chips 0, 1, 2 ...; `None` where the stripes say nothing.
    pub chips: Vec<Option<bool>>,
    /// Length of the edges' mean unit vector: 1 when all keep to one clock.
    pub coherence: f64,
    /// Edges used.
    pub edges: usize,
}

/// An edge between two rows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Edge {
    time_s: f64,
    rising: bool,
    saturated: bool,
}

impl Edge {
    /// What moves the edge to the time of the switching.
    fn correction_s(&self, broadening_s: f64) -> f64 {
        match (self.saturated, self.rising) {
            (false, _) => 0.0,
            (true, true) => broadening_s,
            (true, false) => -broadening_s,
        }
    }
}

/// Grey level (raw) from which on a row counts as saturated.
const SATURATED_GREY: f64 = 245.0;
/// The envelope must stand this far over darkness, in grey levels.
const ENVELOPE_FLOOR: f64 = 3.0;
/// Least n R^2 of n edges with coherence R (Rayleigh's test: chance gives this to 3 in 100).
const MIN_RAYLEIGH: f64 = 3.5;
/// Fewer edges than this set no clock.
const MIN_EDGES: usize = 4;
/// More chips than this do not fit into any frame of interest.
const MAX_CHIPS: usize = 1024;

/// Reads stripes.
#[derive(Debug)]
pub struct StripeReader {
    chip_s: f64,
    shutter: Shutter,
}

impl StripeReader {
    /// For lamps of one chip time seen through one shutter.
    pub fn new(chip_s: f64, shutter: Shutter) -> Self {
        Self { chip_s, shutter }
    }

    /// What comes next was exposed for so long.
    pub fn expose(&mut self, exposure_s: f64) {
        self.shutter.exposure_s = exposure_s;
    }

    /// The chips of a profile; `None` where there is no code in it.
    pub fn read(&self, profile: &RowProfile, black: f64) -> Option<StripeReading> {
        if self.shutter.is_global() {
            return None;
        }
        let (top, bottom) = profile.lit_stretch(ENVELOPE_FLOOR)?;
        // In the order in which they are read.
        let mut rows: Vec<usize> = (top..=bottom).collect();
        if self.shutter.row_step_s() < 0.0 {
            rows.reverse();
        }
        let (first, last) = (*rows.first()?, *rows.last()?);
        let mut edges = self.edges(profile, black, &rows);
        if edges.len() < MIN_EDGES {
            return None;
        }
        self.sharpen(&mut edges);
        let sum = self.sum(&edges, |_| true);
        let coherence = sum.norm() / edges.len() as f64;
        if edges.len() as f64 * coherence.powi(2) < MIN_RAYLEIGH {
            return None;
        }
        // Seconds in [0, chip).
        let phase_s = sum.arg() / TAU * self.chip_s;
        let row_time = |k: usize| self.row_mid_s(profile.first_row + k as f64);
        let lit_first = profile.light[first] > 0.5 * profile.envelope[first];
        let (start, chips) = self.levels(
            &edges,
            phase_s,
            (row_time(first), row_time(last)),
            lit_first,
        )?;
        Some(StripeReading {
            phase_s: phase_s + start as f64 * self.chip_s,
            chips,
            coherence,
            edges: edges.len(),
        })
    }

    fn row_mid_s(&self, row: f64) -> f64 {
        self.shutter.delay_s(row) + 0.5 * self.shutter.exposure_s
    }

    fn edges(&self, profile: &RowProfile, black: f64, rows: &[usize]) -> Vec<Edge> {
        let share = |k: usize| profile.light[k] / profile.envelope[k];
        let edge = |pair: &[usize]| {
            let (k, next) = (pair[0], pair[1]);
            let (a, b) = (share(k), share(next));
            let way = (0.5 - a) / (b - a);
            let row = profile.first_row + k as f64 + way * (next as f64 - k as f64);
            let bright = profile.light[k].max(profile.light[next]);
            ((a > 0.5) != (b > 0.5)).then(|| Edge {
                time_s: self.row_mid_s(row),
                rising: b > a,
                saturated: bright + black > SATURATED_GREY,
            })
        };
        rows.windows(2).filter_map(edge).collect()
    }

    /// Sum of unit vectors, on the circle of one chip time.
    fn sum(&self, edges: &[Edge], chosen: fn(&Edge) -> bool) -> Complex<f64> {
        let chosen = edges.iter().filter(|e| chosen(e));
        chosen
            .map(|e| Complex::cis(TAU * e.time_s / self.chip_s))
            .sum()
    }

    /// Moves broadened edges back.
    fn sharpen(&self, edges: &mut [Edge]) {
        let rising = self.sum(edges, |e| e.saturated && e.rising);
        let falling = self.sum(edges, |e| e.saturated && !e.rising);
        let both = rising.norm() > 0.5 && falling.norm() > 0.5;
        let turn = if both {
            ((falling * rising.conj()).arg() / TAU).rem_euclid(1.0)
        } else {
            0.0
        };
        let candidates = [turn, turn - 1.0].map(|turn| 0.5 * turn * self.chip_s);
        let shortest = candidates.map(|broadening_s| shortest_stripe_s(edges, broadening_s));
        let broadening_s = candidates[usize::from(shortest[0] < shortest[1])];
        for edge in edges {
            edge.time_s += edge.correction_s(broadening_s);
        }
    }

    /// The number of the first chip after the phase, and the levels between edges from there on. A
    /// stretch that ends without an edge counts for the chips that it certainly covers.
    fn levels(
        &self,
        edges: &[Edge],
        phase_s: f64,
        (from_s, to_s): (f64, f64),
        lit_first: bool,
    ) -> Option<(i64, Vec<Option<bool>>)> {
        let chip = |t: f64| (t - phase_s) / self.chip_s;
        let start = (chip(from_s) - 0.25).ceil() as i64;
        let end = (chip(to_s) + 0.25).floor() as i64;
        let length = end - start;
        if length < 2 || length > MAX_CHIPS as i64 {
            return None;
        }
        let mut chips = vec![None; length as usize];
        let (mut at, mut level) = (start, lit_first);
        let inner = edges
            .iter()
            .map(|e| (chip(e.time_s).round() as i64, e.rising));
        for (boundary, rising) in inner.chain([(end, !level)]) {
            for k in at.max(start)..boundary.min(end) {
                chips[(k - start) as usize] = Some(level);
            }
            (at, level) = (boundary.max(at), rising);
        }
        Some((start, chips))
    }
}

/// Duration of the shortest stripe, were edges broadened by so much.
fn shortest_stripe_s(edges: &[Edge], broadening_s: f64) -> f64 {
    let at = |e: &Edge| e.time_s + e.correction_s(broadening_s);
    let stripes = edges.windows(2).map(|pair| at(&pair[1]) - at(&pair[0]));
    stripes.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::uid::{LineCode, Uid};
    use crate::track::waveform::Waveform;

    const SHUTTER: Shutter = Shutter {
        line_time_s: 22.2e-6,
        exposure_s: 30e-6,
        first_row: 0,
    };

    /// The same, read upwards.
    const UPWARDS: Shutter = Shutter {
        first_row: 719,
        ..SHUTTER
    };

    /// 100 rows of a lamp whose light would be `grey` if the sensor did not saturate at 251.
    fn profile(wave: &Waveform, grey: f64, shutter: &Shutter) -> RowProfile {
        let row = |v: i32| {
            let open = shutter.delay_s(f64::from(v));
            (grey * wave.on_share(open, open + shutter.exposure_s)).min(251.0)
        };
        RowProfile {
            first_row: 200.0,
            light: (200..300).map(row).collect(),
            envelope: vec![grey.min(251.0); 100],
        }
    }

    /// Every chip right at any phase, read downwards and upwards; with the sensor saturated five times over, when edges are
    /// known to half a row only, 95 of 100 (96 measured; joining outvotes the others).
    #[test]
    fn chips_are_those_that_were_sent() {
        for (shutter, grey, least) in [
            (SHUTTER, 80.0, 1.0),
            (SHUTTER, 1190.0, 0.95),
            (UPWARDS, 80.0, 1.0),
            (UPWARDS, 1190.0, 0.95),
        ] {
            let reader = StripeReader::new(45e-6, shutter);
            let (mut right, mut all) = (0, 0);
            for k in 0..40 {
                let uid = Uid {
                    line: 1,
                    lamp: 25 * k,
                };
                let wave = Waveform::sharp(
                    uid.frame(LineCode::Manchester),
                    45e-6,
                    1e-3 + 3.7e-6 * f64::from(k),
                );
                let seen = profile(&wave, grey, &shutter);
                let reading = reader.read(&seen, 4.0).unwrap();
                assert!(reading.chips.len() >= 46, "{}", reading.chips.len());
                for (chip, level) in reading.chips.iter().enumerate() {
                    let middle = reading.phase_s + (chip as f64 + 0.5) * 45e-6;
                    right += u32::from(*level == Some(wave.on_at(middle)));
                    all += 1;
                }
            }
            let share = f64::from(right) / f64::from(all);
            assert!(share >= least, "{share} at {grey}");
        }
    }

    /// Short and long exposures of one lamp tell of one clock, so that their chips can be joined: with
    /// the exposure of another frame they would be 17 us apart.
    #[test]
    fn the_clock_does_not_depend_on_the_exposure() {
        let uid = Uid { line: 1, lamp: 77 };
        let wave = Waveform::sharp(uid.frame(LineCode::Manchester), 45e-6, 1e-3);
        let mut reader = StripeReader::new(45e-6, SHUTTER);
        let phases = [8e-6, 42e-6].map(|exposure_s| {
            let shutter = Shutter {
                exposure_s,
                ..SHUTTER
            };
            reader.expose(exposure_s);
            let reading = reader.read(&profile(&wave, 80.0, &shutter), 4.0);
            reading.unwrap().phase_s
        });
        let turns = (phases[1] - phases[0]) / 45e-6;
        assert!((turns - turns.round()).abs() < 0.05, "{turns}");
    }

    /// Steady light, darkness, light that blinks in another clock, and any light through a global
    /// shutter are no code.
    #[test]
    fn light_without_the_clock_is_refused() {
        let uid = Uid { line: 1, lamp: 77 };
        let wave = |chip_s: f64| Waveform::sharp(uid.frame(LineCode::Manchester), chip_s, 0.0);
        let mut steady = profile(&wave(45e-6), 80.0, &SHUTTER);
        steady.light.fill(80.0);
        let mut dark = profile(&wave(45e-6), 80.0, &SHUTTER);
        dark.light.fill(0.0);
        dark.envelope.fill(0.0);
        let other = profile(&wave(61e-6), 80.0, &SHUTTER);
        for profile in [steady, dark, other] {
            let reader = StripeReader::new(45e-6, SHUTTER);
            assert_eq!(reader.read(&profile, 4.0), None);
        }
        let global = Shutter {
            line_time_s: 0.0,
            ..SHUTTER
        };
        let reader = StripeReader::new(45e-6, global);
        let stripes = profile(&wave(45e-6), 80.0, &SHUTTER);
        assert_eq!(reader.read(&stripes, 4.0), None);
    }
}
