//! The light of a blinking lamp in time, and its exact integral over any exposure.
//!
//! The driver switches between chips; the light follows with a first-order lag, one time constant
//! up and one down. That is a usual model of an LED and its driver (an RC low-pass); it leaves the
//! mean brightness of a code alone when both times are equal, also where edges outlast a chip. Rise and fall times are those of data sheets, from
//! 10 to 90 %, so a time constant is the time over ln 9. On top comes the ripple that the mains
//! leave in the driver's current, a sine at twice their frequency.
//!
//! # Theory
//!
//! In a chip of target u (0 or 1) the light is x(s) = u + (x0 - u) exp(-s / tau). With w the
//! ripple's angular frequency, both integrals that an exposure needs are closed:
//!
//! ```text
//! int x ds           = u s + (x0 - u) tau (1 - exp(-s/tau))
//! int x exp(iws) ds  = u (exp(iws) - 1) / (iw) + (x0 - u) (1 - exp((iw - 1/tau) s)) tau / (1 - iw tau)
//! ```
//!
//! Their sums up to every chip of the frame are kept. The light at the frame's start is that of the
//! steady state, a fixed point of the affine map that one period is. Whole periods between the ends
//! of a window make a geometric series of exp(iwT), so a window of any length costs the same.

use super::uid::ChipFrame;
use nalgebra::Complex;
use std::f64::consts::TAU;

/// Most chips of a frame.
const MAX_CHIPS: usize = 64;

/// How a lamp blinks: a chip frame sent over and over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waveform {
    /// One period.
    pub frame: ChipFrame,
    /// Duration of a chip.
    pub chip_s: f64,
    /// Time of the start of some period, seconds.
    pub phase_s: f64,
    /// From 10 to 90 % of the light after it is switched on; 0 for at once.
    pub rise_s: f64,
    /// From 90 to 10 % of the light after it is switched off; 0 for at once.
    pub fall_s: f64,
}

impl Waveform {
    /// One that switches at once.
    pub fn sharp(frame: ChipFrame, chip_s: f64, phase_s: f64) -> Self {
        Self {
            frame,
            chip_s,
            phase_s,
            rise_s: 0.0,
            fall_s: 0.0,
        }
    }

    /// Duration of the whole frame.
    pub fn period_s(&self) -> f64 {
        self.chip_s * f64::from(self.frame.len)
    }
}

/// What the mains leave in a lamp's light: a factor 1 + depth sin(2 pi frequency t + phase).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ripple {
    /// Amplitude as a share of the mean, 0 to 1 (the modulation depth of IEEE 1789).
    pub depth: f64,
    /// Twice the frequency of the mains.
    pub frequency_hz: f64,
    /// Phase at time 0.
    pub phase_rad: f64,
}

/// Light at the start of a chip, and integrals from the frame's start up to there.
#[derive(Clone, Copy, Debug, Default)]
struct Knot {
    light: f64,
    sum: f64,
    wave: Complex<f64>,
}

/// A waveform with its integrals.
#[derive(Clone, Debug)]
pub struct LightCurve {
    waveform: Waveform,
    ripple: Ripple,
    omega: f64,
    chips: usize,
    /// One a chip, and one for the end of the frame.
    knots: [Knot; MAX_CHIPS + 1],
}

impl LightCurve {
    /// Of a waveform under a ripple.
    pub fn new(waveform: &Waveform, ripple: Ripple) -> Self {
        let mut curve = Self {
            waveform: *waveform,
            ripple,
            omega: TAU * ripple.frequency_hz,
            chips: (waveform.frame.len as usize).clamp(1, MAX_CHIPS),
            knots: [Knot::default(); MAX_CHIPS + 1],
        };
        // Light at the end of a frame is `kept` of that at its start, plus `gained`.
        let (mut kept, mut gained) = (1.0, 0.0);
        for k in 0..curve.chips {
            let (on, tau_s) = curve.chip(k);
            let left = decay(waveform.chip_s, tau_s);
            kept *= left;
            gained = on + (gained - on) * left;
        }
        curve.knots[0].light = if kept < 1.0 {
            gained / (1.0 - kept)
        } else {
            gained
        };
        for k in 0..curve.chips {
            curve.knots[k + 1] = curve.within(k, waveform.chip_s);
        }
        curve
    }

    /// Mean light from `open_s` to `close_s`, as a share of the light of a lamp that stays on; the
    /// light at `open_s` where that is no time at all.
    pub fn mean(&self, open_s: f64, close_s: f64) -> f64 {
        if close_s <= open_s {
            return self.at(open_s);
        }
        self.integral_s(open_s, close_s) / (close_s - open_s)
    }

    /// Light at a time.
    pub fn at(&self, t_s: f64) -> f64 {
        let (_, inside_s) = self.place(t_s);
        let ripple = 1.0 + self.ripple.depth * (self.omega * t_s + self.ripple.phase_rad).sin();
        ripple * self.up_to(inside_s).light
    }

    /// Light at all times in the mean, the ripple averaged out.
    pub fn long_mean(&self) -> f64 {
        self.knots[self.chips].sum / self.period_s()
    }

    /// Integral of the light over a window, in seconds of a lamp that stays on.
    pub fn integral_s(&self, open_s: f64, close_s: f64) -> f64 {
        let (first, from_s) = self.place(open_s);
        let (last, to_s) = self.place(close_s);
        let (from, to) = (self.up_to(from_s), self.up_to(to_s));
        let whole = &self.knots[self.chips];
        let plain = (last - first) * whole.sum + to.sum - from.sum;
        if self.ripple.depth <= 0.0 {
            return plain;
        }
        // Phases count from the start of the period in which the window opens.
        let turn = self.omega * self.period_s();
        let wave = geometric(turn, last - first) * whole.wave
            + Complex::cis(turn * (last - first)) * to.wave
            - from.wave;
        let start_s = self.waveform.phase_s + first * self.period_s();
        let begin = Complex::cis(self.omega * start_s + self.ripple.phase_rad);
        plain + self.ripple.depth * (begin * wave).im
    }

    fn period_s(&self) -> f64 {
        self.waveform.chip_s * self.chips as f64
    }

    /// The period that a time falls in, and the time since its start.
    fn place(&self, t_s: f64) -> (f64, f64) {
        let since_s = t_s - self.waveform.phase_s;
        let period = (since_s / self.period_s()).floor();
        (period, since_s - period * self.period_s())
    }

    /// Target and time constant of a chip.
    fn chip(&self, k: usize) -> (f64, f64) {
        let (on, edge_s) = if self.waveform.frame.is_on(k as u32) {
            (1.0, self.waveform.rise_s)
        } else {
            (0.0, self.waveform.fall_s)
        };
        (on, edge_s / 9f64.ln())
    }

    /// Light and integrals at a time after the frame's start.
    fn up_to(&self, inside_s: f64) -> Knot {
        let k = (inside_s / self.waveform.chip_s).floor().max(0.0) as usize;
        let k = k.min(self.chips - 1);
        self.within(k, inside_s - k as f64 * self.waveform.chip_s)
    }

    /// Light and integrals at a time after the start of chip `k`.
    fn within(&self, k: usize, s: f64) -> Knot {
        let start = &self.knots[k];
        let (on, tau_s) = self.chip(k);
        let (behind, left) = (start.light - on, decay(s, tau_s));
        let mut end = Knot {
            light: on + behind * left,
            sum: start.sum + on * s + behind * tau_s * (1.0 - left),
            wave: Complex::default(),
        };
        if self.ripple.depth > 0.0 {
            let turned = Complex::cis(self.omega * s);
            let lag = Complex::new(1.0, -self.omega * tau_s);
            let wave = on * s * Complex::cis(0.5 * self.omega * s) * sinc(0.5 * self.omega * s)
                + behind * tau_s * (Complex::from(1.0) - left * turned) / lag;
            let since_start = self.omega * self.waveform.chip_s * k as f64;
            end.wave = start.wave + Complex::cis(since_start) * wave;
        }
        end
    }
}

/// What is left of a deviation after a time.
fn decay(s: f64, tau_s: f64) -> f64 {
    if tau_s > 0.0 { (-s / tau_s).exp() } else { 0.0 }
}

fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-8 { 1.0 } else { x.sin() / x }
}

/// Sum of exp(i turn k) over k from 0 to n - 1.
fn geometric(turn: f64, n: f64) -> Complex<f64> {
    // A whole number of turns changes nothing; what is left decides.
    let half = 0.5 * (turn - TAU * (turn / TAU).round());
    let ratio = if half.abs() < 1e-12 {
        n
    } else {
        (n * half).sin() / half.sin()
    };
    Complex::cis((n - 1.0) * half) * ratio
}

#[cfg(test)]
impl Waveform {
    /// Whether the lamp is switched on at a time.
    pub fn on_at(&self, t_s: f64) -> bool {
        let chip = ((t_s - self.phase_s) / self.chip_s).floor();
        self.frame
            .is_on(chip.rem_euclid(f64::from(self.frame.len)) as u32)
    }

    /// Mean light from `open_s` to `close_s`, as a share of the light of a lamp that stays on.
    pub fn on_share(&self, open_s: f64, close_s: f64) -> f64 {
        LightCurve::new(self, Ripple::default()).mean(open_s, close_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::uid::{LineCode, Uid};

    const MAINS: Ripple = Ripple {
        depth: 0.3,
        frequency_hz: 100.0,
        phase_rad: 0.7,
    };
    const CODES: [LineCode; 2] = [LineCode::Manchester, LineCode::Nrz];

    fn wave(k: usize, rise_s: f64, fall_s: f64) -> Waveform {
        let uid = Uid {
            line: 3,
            lamp: (k * 97 % 1024) as u16,
        };
        Waveform {
            frame: uid.frame(CODES[k % 2]),
            chip_s: [45e-6, 100e-6, 20e-6][k % 3],
            phase_s: 3.21e-4 * k as f64,
            rise_s,
            fall_s,
        }
    }

    /// Light by Euler's method from long before, knowing nothing but the lag's equation.
    fn stepped(wave: &Waveform, ripple: Ripple, open_s: f64, close_s: f64) -> f64 {
        let step_s = 2e-8;
        let lead_s = 12.0 * wave.rise_s.max(wave.fall_s) / 9f64.ln();
        let lead = (lead_s / step_s).ceil();
        let steps = ((close_s - open_s) / step_s).round();
        let step_s = (close_s - open_s) / steps;
        let (mut light, mut sum) = (0.5, 0.0);
        for k in 0..(lead + steps) as usize {
            let t_s = open_s + (k as f64 - lead + 0.5) * step_s;
            let (on, edge_s) = if wave.on_at(t_s) {
                (1.0, wave.rise_s)
            } else {
                (0.0, wave.fall_s)
            };
            let before = light;
            light = on + (light - on) * decay(step_s, edge_s / 9f64.ln());
            if k as f64 >= lead {
                let turn = TAU * ripple.frequency_hz * t_s + ripple.phase_rad;
                let mean = if edge_s > 0.0 {
                    0.5 * (before + light)
                } else {
                    on
                };
                sum += mean * (1.0 + ripple.depth * turn.sin()) / steps;
            }
        }
        sum
    }

    /// Provokes: an integral that is off at chip borders, over whole periods, before the phase, late
    /// in a run, with edges that do not end within a chip, or under a ripple.
    #[test]
    fn means_are_those_of_brute_force() {
        let edges = [(0.0, 0.0), (2e-6, 5e-6), (30e-6, 10e-6), (4e-4, 4e-4)];
        for (k, (rise_s, fall_s)) in edges.into_iter().enumerate() {
            for ripple in [Ripple::default(), MAINS] {
                let wave = wave(k, rise_s, fall_s);
                let curve = LightCurve::new(&wave, ripple);
                for (open_s, span_s) in [
                    (-0.01, 50e-6),
                    (0.0123, 13e-6),
                    (0.3, 45e-6),
                    (600.0, 1e-4),
                    (2.0, 7e-3),
                ] {
                    let right = stepped(&wave, ripple, open_s, open_s + span_s);
                    let found = curve.mean(open_s, open_s + span_s);
                    // A step decides for its cell: half a cell a chip border.
                    let borders = 2.0 + span_s / wave.chip_s;
                    let tolerance = 0.5 * borders * 2e-8 / span_s + 1e-5;
                    assert!(
                        (found - right).abs() < tolerance,
                        "{k} {open_s} {span_s}: {found} {right}"
                    );
                }
            }
        }
    }

    /// Provokes: prefix sums that do not fit together: a window is the sum of its parts, however
    /// cut, over many periods, also where the ripple beats with the frame.
    #[test]
    fn windows_add_up() {
        let mut resonant = wave(0, 3e-6, 6e-6);
        resonant.chip_s = 0.01 / 48.0;
        for wave in [wave(1, 0.0, 0.0), wave(2, 3e-6, 6e-6), resonant] {
            let curve = LightCurve::new(&wave, MAINS);
            let cuts: Vec<f64> = (0..400).map(|k| 1.0 + 1.37e-4 * f64::from(k)).collect();
            let parts: f64 = cuts.windows(2).map(|w| curve.integral_s(w[0], w[1])).sum();
            let whole = curve.integral_s(cuts[0], cuts[399]);
            assert!((parts / whole - 1.0).abs() < 1e-9, "{parts} {whole}");
        }
    }

    /// Provokes: edges that change the mean brightness: equal times leave it, a slow fall adds
    /// (fall - rise) / ln 9 of light each time it is switched off after a long time on.
    #[test]
    fn edges_and_mean_light() {
        for k in 0..6 {
            let sharp = wave(k, 0.0, 0.0);
            let duty = f64::from(sharp.frame.bits.count_ones()) / f64::from(sharp.frame.len);
            for edge_s in [0.0, 1e-6, 20e-6, 1e-3] {
                let mean = LightCurve::new(&wave(k, edge_s, edge_s), MAINS).long_mean();
                assert!((mean - duty).abs() < 1e-12, "{edge_s}: {mean} {duty}");
            }
        }
        let once = Waveform {
            rise_s: 1e-6,
            fall_s: 3e-6,
            ..Waveform::sharp(ChipFrame { bits: 1, len: 2 }, 1e-3, 0.0)
        };
        let mean = LightCurve::new(&once, Ripple::default()).long_mean();
        assert!((mean - 0.5 - 2e-6 / 9f64.ln() / 2e-3).abs() < 1e-12);
    }

    /// Provokes: rise times that are no 10-to-90 % times.
    #[test]
    fn edges_take_the_time_of_the_data_sheet() {
        let wave = Waveform {
            rise_s: 10e-6,
            fall_s: 4e-6,
            ..Waveform::sharp(ChipFrame { bits: 1, len: 2 }, 1e-3, 0.0)
        };
        let curve = LightCurve::new(&wave, Ripple::default());
        let crossing = |from_s: f64, level: f64| {
            let steps = (0..1_000_000).map(|k| from_s + 1e-10 * f64::from(k));
            let side = |t| curve.at(t) > level;
            let first = side(from_s + 1e-10);
            steps.skip(1).find(|t| side(*t) != first).unwrap_or(0.0)
        };
        let rise_s = crossing(0.0, 0.9) - crossing(0.0, 0.1);
        let fall_s = crossing(1e-3, 0.1) - crossing(1e-3, 0.9);
        assert!((rise_s - 10e-6).abs() < 1e-9, "{rise_s}");
        assert!((fall_s - 4e-6).abs() < 1e-9, "{fall_s}");
    }

    /// Provokes: shifts by more bits than there are, indices beyond the table.
    #[test]
    fn odd_frames_do_not_panic() {
        for (bits, len) in [(u64::MAX, 64), (5, 0), (u64::MAX, 200)] {
            for chip_s in [45e-6, 0.0, f64::NAN] {
                let wave = Waveform::sharp(ChipFrame { bits, len }, chip_s, 0.0);
                for t in [-1.0, 0.0, 1e-3, f64::NAN] {
                    wave.on_at(t);
                    wave.on_share(t, t + 1e-4);
                }
            }
        }
        let full = ChipFrame {
            bits: u64::MAX,
            len: 64,
        };
        let wave = Waveform::sharp(full, 1.0, 0.0);
        assert!((wave.on_share(-3.3, 130.7) - 1.0).abs() < 1e-12);
    }
}
