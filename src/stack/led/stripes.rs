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

use super::profile::Profile;
use crate::bus::Shutter;
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

/// Entries of a profile, from the one read first to the one read last.
#[derive(Clone, Copy, Debug)]
struct Rows {
    first: usize,
    last: usize,
}

impl Rows {
    /// Each with the one that is read next.
    fn neighbours(self) -> impl Iterator<Item = (usize, usize)> {
        let up = self.last < self.first;
        (0..self.first.abs_diff(self.last)).map(move |k| {
            if up {
                (self.first - k, self.first - k - 1)
            } else {
                (self.first + k, self.first + k + 1)
            }
        })
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

/// Reads stripes; owns what it needs from frame to frame.
#[derive(Debug)]
pub struct StripeReader {
    chip_s: f64,
    shutter: Shutter,
    edges: Vec<Edge>,
}

impl StripeReader {
    /// For lamps of one chip time seen through one shutter.
    pub fn new(chip_s: f64, shutter: Shutter) -> Self {
        Self {
            chip_s,
            shutter,
            edges: Vec::new(),
        }
    }

    /// What comes next was exposed for so long.
    pub fn expose(&mut self, exposure_s: f64) {
        self.shutter.exposure_s = exposure_s;
    }

    /// Reads the chips of a profile into `out`. `false` where there is no code in it.
    pub fn read(&mut self, profile: &Profile, black: f64, out: &mut StripeReading) -> bool {
        out.chips.clear();
        (out.coherence, out.edges) = (0.0, 0);
        if self.shutter.is_global() {
            return false;
        }
        let Some((first, last)) = profile.lit_stretch(ENVELOPE_FLOOR) else {
            return false;
        };
        let rows = self.in_time(first, last);
        self.find_edges(profile, black, &rows);
        if self.edges.len() < MIN_EDGES {
            return false;
        }
        let phase = self.set_clock(out);
        if out.edges as f64 * out.coherence.powi(2) < MIN_RAYLEIGH {
            return false;
        }
        let lit = |k: usize| profile.light[k] > 0.5 * profile.envelope[k];
        let row_time = |k: usize| self.row_mid_s(profile.first_row + k as f64);
        let times = (row_time(rows.first), row_time(rows.last));
        self.fill(phase, times, lit(rows.first), out)
    }

    fn row_mid_s(&self, row: f64) -> f64 {
        self.shutter.delay_s(row) + 0.5 * self.shutter.exposure_s
    }

    /// The rows of a stretch in the order in which they are read.
    fn in_time(&self, top: usize, bottom: usize) -> Rows {
        if self.shutter.row_step_s() < 0.0 {
            Rows {
                first: bottom,
                last: top,
            }
        } else {
            Rows {
                first: top,
                last: bottom,
            }
        }
    }

    fn find_edges(&mut self, profile: &Profile, black: f64, rows: &Rows) {
        self.edges.clear();
        let share = |k: usize| profile.light[k] / profile.envelope[k];
        for (k, next) in rows.neighbours() {
            let (a, b) = (share(k), share(next));
            if (a > 0.5) != (b > 0.5) {
                let way = (0.5 - a) / (b - a);
                let row = profile.first_row + k as f64 + way * (next as f64 - k as f64);
                let bright = profile.light[k].max(profile.light[next]);
                self.edges.push(Edge {
                    time_s: self.row_mid_s(row),
                    rising: b > a,
                    saturated: bright + black > SATURATED_GREY,
                });
            }
        }
    }

    /// Moves broadened edges back and gives the clock's phase, seconds in [0, chip).
    fn set_clock(&mut self, out: &mut StripeReading) -> f64 {
        let sum = |edges: &[Edge], chosen: fn(&Edge) -> bool| {
            edges
                .iter()
                .filter(|e| chosen(e))
                .fold((0.0, 0.0), |(x, y), e| {
                    let (sin, cos) = (TAU * e.time_s / self.chip_s).sin_cos();
                    (x + cos, y + sin)
                })
        };
        let rising = sum(&self.edges, |e| e.saturated && e.rising);
        let falling = sum(&self.edges, |e| e.saturated && !e.rising);
        let cross = falling.1 * rising.0 - falling.0 * rising.1;
        let dot = falling.0 * rising.0 + falling.1 * rising.1;
        let both = rising.0.hypot(rising.1) > 0.5 && falling.0.hypot(falling.1) > 0.5;
        let turn = if both {
            (cross.atan2(dot) / TAU).rem_euclid(1.0)
        } else {
            0.0
        };
        let candidates = [turn, turn - 1.0].map(|turn| 0.5 * turn * self.chip_s);
        let wide = self.shortest_stripe_s(candidates[0]) >= self.shortest_stripe_s(candidates[1]);
        let broadening_s = candidates[usize::from(!wide)];
        for edge in &mut self.edges {
            edge.time_s += edge.correction_s(broadening_s);
        }
        let (x, y) = sum(&self.edges, |_| true);
        out.edges = self.edges.len();
        out.coherence = x.hypot(y) / out.edges as f64;
        y.atan2(x) / TAU * self.chip_s
    }

    /// Duration of the shortest stripe, were edges broadened by so much.
    fn shortest_stripe_s(&self, broadening_s: f64) -> f64 {
        let at = |e: &Edge| e.time_s + e.correction_s(broadening_s);
        let stripes = self
            .edges
            .windows(2)
            .map(|pair| at(&pair[1]) - at(&pair[0]));
        stripes.fold(f64::INFINITY, f64::min)
    }

    /// Writes the levels between edges. A stretch that ends without an edge counts for the chips
    /// that it certainly covers.
    fn fill(
        &self,
        phase_s: f64,
        (from_s, to_s): (f64, f64),
        lit_first: bool,
        out: &mut StripeReading,
    ) -> bool {
        let chip = |t: f64| (t - phase_s) / self.chip_s;
        let start = (chip(from_s) - 0.25).ceil() as i64;
        let end = (chip(to_s) + 0.25).floor() as i64;
        let length = end - start;
        if length < 2 || length > MAX_CHIPS as i64 {
            return false;
        }
        out.phase_s = phase_s + start as f64 * self.chip_s;
        out.chips.resize(length as usize, None);
        let (mut at, mut level) = (start, lit_first);
        let inner = self
            .edges
            .iter()
            .map(|e| (chip(e.time_s).round() as i64, e.rising));
        for (boundary, rising) in inner.chain([(end, !level)]) {
            for k in at.max(start)..boundary.min(end) {
                out.chips[(k - start) as usize] = Some(level);
            }
            (at, level) = (boundary.max(at), rising);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::uid::Uid;
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
    fn profile(wave: &Waveform, grey: f64, shutter: &Shutter) -> Profile {
        let row = |v: i32| {
            let open = shutter.delay_s(f64::from(v));
            (grey * wave.on_share(open, open + shutter.exposure_s)).min(251.0)
        };
        let mut profile = Profile::default();
        profile.first_row = 200.0;
        profile.light.extend((200..300).map(row));
        profile.envelope.resize(100, grey.min(251.0));
        profile
    }

    /// Every chip right at any phase, read downwards and upwards; with the sensor saturated five times over, when edges are
    /// known to half a row only, 95 of 100 (96 measured; joining outvotes the others).
    #[test]
    fn chips_are_those_that_were_sent() {
        let mut reading = StripeReading::default();
        for (shutter, grey, least) in [
            (SHUTTER, 80.0, 1.0),
            (SHUTTER, 1190.0, 0.95),
            (UPWARDS, 80.0, 1.0),
            (UPWARDS, 1190.0, 0.95),
        ] {
            let mut reader = StripeReader::new(45e-6, shutter);
            let (mut right, mut all) = (0, 0);
            for k in 0..40 {
                let uid = Uid {
                    line: 1,
                    lamp: 25 * k,
                };
                let wave = Waveform::sharp(uid.manchester(), 45e-6, 1e-3 + 3.7e-6 * f64::from(k));
                let seen = profile(&wave, grey, &shutter);
                let read = reader.read(&seen, 4.0, &mut reading);
                assert!(
                    read,
                    "{k} {grey} {} of {}",
                    reading.coherence, reading.edges
                );
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
        let wave = Waveform::sharp(uid.manchester(), 45e-6, 1e-3);
        let mut reader = StripeReader::new(45e-6, SHUTTER);
        let mut reading = StripeReading::default();
        let phases = [8e-6, 42e-6].map(|exposure_s| {
            let shutter = Shutter {
                exposure_s,
                ..SHUTTER
            };
            reader.expose(exposure_s);
            assert!(reader.read(&profile(&wave, 80.0, &shutter), 4.0, &mut reading));
            reading.phase_s
        });
        let turns = (phases[1] - phases[0]) / 45e-6;
        assert!((turns - turns.round()).abs() < 0.05, "{turns}");
    }

    /// Steady light, darkness, light that blinks in another clock, and any light through a global
    /// shutter are no code.
    #[test]
    fn light_without_the_clock_is_refused() {
        let mut reading = StripeReading::default();
        let uid = Uid { line: 1, lamp: 77 };
        let wave = |chip_s: f64| Waveform::sharp(uid.manchester(), chip_s, 0.0);
        let mut steady = profile(&wave(45e-6), 80.0, &SHUTTER);
        steady.light.fill(80.0);
        let mut dark = profile(&wave(45e-6), 80.0, &SHUTTER);
        dark.light.fill(0.0);
        dark.envelope.fill(0.0);
        let other = profile(&wave(61e-6), 80.0, &SHUTTER);
        for profile in [steady, dark, other] {
            let mut reader = StripeReader::new(45e-6, SHUTTER);
            assert!(!reader.read(&profile, 4.0, &mut reading));
        }
        let global = Shutter {
            line_time_s: 0.0,
            ..SHUTTER
        };
        let mut reader = StripeReader::new(45e-6, global);
        let stripes = profile(&wave(45e-6), 80.0, &SHUTTER);
        assert!(!reader.read(&stripes, 4.0, &mut reading));
    }
}
