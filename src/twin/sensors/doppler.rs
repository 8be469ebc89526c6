//! Doppler radar under the leading car: speed over ground, whatever the wheels do.
//!
//! **Frequency.** A beam of unit direction u (world) from a mount that moves with v, onto a bed at
//! rest, comes back shifted by f = (2/λ) v·u. The unit takes u to be at its depression angle δ in
//! the car's length plane, so one beam says λ f/(2 cos δ). Its own velocity enters whole: heave w
//! as -w tan δ, and a pitch error p (mount or car, nose down) as
//! cos(δ + p)/cos δ = 1 - p tan δ + O(p²).
//!
//! **Janus.** A second beam looks backward. Half the difference of the two frequencies says
//! ½[cos(δ + p) + cos(δ - p)] v/cos δ = v cos p, and of heave ½[-sin(δ + p) + sin(δ - p)] w/cos δ
//! = -w sin p: what is of first order is gone.
//!
//! **Noise.** The footprint spreads over angles, so the echo is a band, not a line. With a Gaussian
//! beam of half-power width Θ, one way, the two-way gain over the angle has sigma
//! σ_θ = Θ/(4 √ln 2), and the band σ_f = (2v/λ) sin δ σ_θ. The mean frequency of such a band over a
//! time T scatters by var f = σ_f/(4 √π T), without receiver noise (Doviak and Zrnić, Doppler Radar
//! and Weather Observations, chapters 5 and 6; the test makes it from scatterers). So noise grows
//! with √v. A mean over less than the band's own time cannot scatter more than the band is wide.
//!
//! Not modelled: receiver noise, the bed's own unevenness and its loss of echo with angle (a
//! constant scale that calibration takes out), water and ice, rails and sleepers as lines in the
//! spectrum, other radars.

use super::ClockSettings;
use crate::bus::{DopplerSample, TrainEnd, TrainId};
use crate::numerics::LIGHT_MPS;
use crate::settings::{Checker, settings};
use crate::twin::physics::{VehicleMotion, World};
use crate::twin::random::Stream;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::f64::consts::{LN_2, PI};

settings! {
    /// A Doppler radar that looks at the track bed. Defaults are of the usual 24 GHz class.
    #[derive(Copy)]
    pub struct DopplerSettings {
        /// Samples a second, each a mean over the time since the last one.
        rate_hz: f64 = 20.0, in 1.0..=1000.0;
        /// Where it is in the vehicle frame (forward, left, up from the head at top of rail),
        /// metres.
        position_m: [f64; 3] = [-6.0, 0.0, 0.5], in -30.0..=10.0;
        /// How far its beam points below the horizontal, degrees.
        depression_deg: f64 = 45.0, in 10.0..=80.0;
        /// Half-power width of the beam, one way, degrees.
        beam_width_deg: f64 = 10.0, in 0.0..=40.0;
        /// Frequency sent, GHz.
        carrier_ghz: f64 = 24.125, in 1.0..=200.0;
        /// A second beam looks backward (Janus): pitch and heave cancel, and the direction is
        /// known.
        janus: bool = false;
        /// Sigma of the mount's angle errors in pitch, yaw and roll, degrees.
        mount_error_deg: f64 = 0.2, in 0.0..=10.0;
        /// Speed below which it says nothing, m/s.
        min_speed_mps: f64 = 0.2, in 0.0..=10.0;
        /// Its clock.
        clock: ClockSettings = ClockSettings::default(), nested;
    }
    also check_place
}

impl DopplerSettings {
    fn check_place(&self, check: &mut Checker<'_>) {
        let [_, y, z] = self.position_m;
        check.within("position_m", y, -2.0..=2.0);
        check.within("position_m", z, 0.05..=4.0);
    }

    fn wave_m(&self) -> f64 {
        LIGHT_MPS / (1e9 * self.carrier_ghz)
    }

    /// Standard deviation of one beam's mean frequency over a time, Hz.
    fn frequency_sigma_hz(&self, speed_mps: f64, span_s: f64) -> f64 {
        let spread_rad = self.beam_width_deg.to_radians() / (4.0 * LN_2.sqrt());
        let sine = self.depression_deg.to_radians().sin();
        let band_hz = 2.0 * speed_mps.abs() / self.wave_m() * sine * spread_rad;
        (band_hz / (4.0 * PI.sqrt() * span_s)).sqrt().min(band_hz)
    }
}

/// A radar at work.
#[derive(Clone, Debug)]
pub struct Doppler {
    settings: DopplerSettings,
    place_m: Vector3<f64>,
    /// Forward, and backward of a Janus radar: its true direction in the vehicle frame, and the
    /// sign of its frequency when going forward.
    beams: Vec<(Vector3<f64>, f64)>,
    noise: Stream,
    last: Option<VehicleMotion>,
    samples: u64,
}

impl Doppler {
    /// A radar whose errors depend on seed and run index.
    pub fn new(settings: &DopplerSettings, seed: u64, index: u64) -> Self {
        let mount = Stream::new(seed, index, "doppler mount");
        let sigma_rad = settings.mount_error_deg.to_radians();
        let turned = Vector3::from_fn(|axis, _| sigma_rad * mount.normal(axis as u64));
        Self::mounted(
            settings,
            &UnitQuaternion::from_scaled_axis(turned),
            Stream::new(seed, index, "doppler noise"),
        )
    }

    fn mounted(s: &DopplerSettings, turned: &UnitQuaternion<f64>, noise: Stream) -> Self {
        let (sine, cosine) = s.depression_deg.to_radians().sin_cos();
        let ways: &[f64] = if s.janus { &[1.0, -1.0] } else { &[1.0] };
        let beams = ways.iter();
        Self {
            settings: *s,
            place_m: Vector3::from(s.position_m),
            beams: beams
                .map(|&way| (turned * Vector3::new(way * cosine, 0.0, -sine), way))
                .collect(),
            noise,
            last: None,
            samples: 0,
        }
    }

    /// A sample of the time since the last one; `None` without its train, and on the first call,
    /// which starts the radar.
    pub fn sample(&mut self, world: &World, train: TrainId) -> Option<DopplerSample> {
        let now = *world.vehicle_motion(train, TrainEnd::Front)?;
        let before = self.last.replace(now)?;
        self.between(&before, &now)
    }

    /// A sample of the time between two motions; `None` if there is none.
    fn between(&mut self, before: &VehicleMotion, now: &VehicleMotion) -> Option<DopplerSample> {
        let span_s = now.time.since(before.time);
        if span_s <= 0.0 {
            return None;
        }
        self.samples += 1;
        let [from, to] = [before, now].map(|m| m.world_from_vehicle);
        // Where the mount went, so what shook in between is averaged as in the radar.
        let mount = Point3::from(self.place_m);
        let way = to * mount - from * mount;
        let middle = from.rotation.slerp(&to.rotation, 0.5);
        let velocity = middle.inverse() * (way / span_s);
        let speed = self.speed_mps(&velocity, span_s);
        Some(DopplerSample {
            time: now.time,
            speed_mps: Some(speed).filter(|v| v.abs() >= self.settings.min_speed_mps),
        })
    }

    /// What the unit makes of its mount's mean velocity, vehicle frame.
    fn speed_mps(&self, velocity_mps: &Vector3<f64>, span_s: f64) -> f64 {
        let s = &self.settings;
        let per_mps = 2.0 / s.wave_m();
        let sigma_hz = s.frequency_sigma_hz(velocity_mps.norm(), span_s);
        let beams = self.beams.len() as u64;
        let mut sum_hz = 0.0;
        for ((along, way), k) in self.beams.iter().zip(self.samples * beams..) {
            let frequency_hz = per_mps * velocity_mps.dot(along);
            sum_hz += way * (frequency_hz + sigma_hz * self.noise.normal(k));
        }
        let nominal = per_mps * s.depression_deg.to_radians().cos();
        let speed = sum_hz / (beams as f64 * nominal);
        if s.janus { speed } else { speed.abs() }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::SimTime;
    use nalgebra::{Isometry3, Translation3};
    use std::f64::consts::TAU;

    /// A radar without noise, pitched nose down.
    fn pitched(janus: bool, pitch_rad: f64) -> Doppler {
        let settings = DopplerSettings {
            janus,
            beam_width_deg: 0.0,
            ..DopplerSettings::default()
        };
        let turned = UnitQuaternion::from_scaled_axis(Vector3::y() * pitch_rad);
        Doppler::mounted(&settings, &turned, Stream::new(1, 0, "test"))
    }

    /// Motion along the world's x after a time, the body pitched and heaving.
    fn moved(t: f64, velocity: Vector3<f64>, pitch_rad: f64) -> VehicleMotion {
        VehicleMotion {
            time: SimTime::from_secs(t),
            world_from_vehicle: Isometry3::from_parts(
                Translation3::from(velocity * t),
                UnitQuaternion::from_scaled_axis(Vector3::y() * pitch_rad),
            ),
            velocity_mps: velocity,
            angular_rad_s: Vector3::zeros(),
        }
    }

    fn said(radar: &mut Doppler, velocity: Vector3<f64>, pitch_rad: f64) -> Option<f64> {
        let (before, now) = (
            moved(0.0, velocity, pitch_rad),
            moved(0.05, velocity, pitch_rad),
        );
        radar.between(&before, &now).unwrap().speed_mps
    }

    /// One beam errs by -p tan(delta), two by cos p; a wrong sign of the beam's slope, or the sum
    /// in place of the difference, fails. The car's pitch acts as the mount's.
    #[test]
    fn janus_cancels_pitch_to_first_order() {
        let v = Vector3::new(20.0, 0.0, 0.0);
        let delta = 45f64.to_radians();
        for p in [-0.02f64, 0.0, 0.005, 0.02] {
            for (mount, car) in [(p, 0.0), (0.0, p)] {
                let one = said(&mut pitched(false, mount), v, car).unwrap();
                let exact = 20.0 * (delta + p).cos() / delta.cos();
                assert!((one - exact).abs() < 1e-9, "{one} at {p}");
                assert!((one / 20.0 - (1.0 - p * delta.tan())).abs() <= p * p + 1e-12);
                let two = said(&mut pitched(true, mount), v, car).unwrap();
                assert!((two - 20.0 * p.cos()).abs() < 1e-9, "{two} at {p}");
            }
        }
    }

    /// Heave enters one beam by -tan(delta) and two by -sin p only.
    #[test]
    fn janus_cancels_heave() {
        let v = Vector3::new(20.0, 0.0, 0.5);
        let one = said(&mut pitched(false, 0.0), v, 0.0).unwrap();
        assert!((one - 19.5).abs() < 1e-9, "{one}");
        let two = said(&mut pitched(true, 0.01), v, 0.0).unwrap();
        let exact = 20.0 * 0.01f64.cos() - 0.5 * 0.01f64.sin();
        assert!((two - exact).abs() < 1e-9, "{two}");
    }

    /// Backwards: a Janus radar says so, one beam says how fast. Slower than the threshold: both
    /// say nothing.
    #[test]
    fn direction_and_threshold() {
        for (janus, back) in [(true, -3.0), (false, 3.0)] {
            let mut radar = pitched(janus, 0.0);
            let speed = said(&mut radar, Vector3::new(-3.0, 0.0, 0.0), 0.0).unwrap();
            assert!((speed - back).abs() < 1e-9);
            assert_eq!(said(&mut radar, Vector3::new(0.19, 0.0, 0.0), 0.0), None);
            assert!(said(&mut radar, Vector3::new(-0.21, 0.0, 0.0), 0.0).is_some());
        }
    }

    /// In a pitching car the mount ahead of the centre goes up and down: the lever arm is felt.
    #[test]
    fn a_pitching_car_lifts_the_mount() {
        let mut radar = pitched(false, 0.0);
        let rate = 0.02;
        let [before, now] = [-0.001, 0.001].map(|t| moved(t, Vector3::x() * 20.0, rate * t));
        let speed = radar.between(&before, &now).unwrap().speed_mps.unwrap();
        // At (-6, 0, 0.5) w x r is (0.5 w, 0, 6 w), nose down.
        let wanted = 20.0 + 0.5 * rate - 6.0 * rate;
        assert!((speed - wanted).abs() < 1e-6, "{speed}");
    }

    /// The scatter of samples is what beam, speed and time make: Hz for m/s, one-way for two-way
    /// width, or one draw for both beams miss. At 20 m/s and 50 ms: 0.16 m/s, with Janus 0.11.
    #[test]
    fn noise_is_that_of_the_footprint() {
        for (janus, speed) in [(false, 20.0), (true, 20.0), (false, 5.0)] {
            let settings = DopplerSettings {
                janus,
                ..DopplerSettings::default()
            };
            let still = UnitQuaternion::identity();
            let mut radar = Doppler::mounted(&settings, &still, Stream::new(1, 0, "test"));
            let n = 10_000;
            let (mut sum, mut square) = (0.0, 0.0);
            for _ in 0..n {
                let wrong = said(&mut radar, Vector3::x() * speed, 0.0).unwrap() - speed;
                sum += wrong;
                square += wrong * wrong;
            }
            let sigma = (square / f64::from(n)).sqrt();
            let (wave_m, sine) = (0.012_426_6, 0.5f64.sqrt());
            let band_hz = 2.0 * speed / wave_m * sine * (10f64.to_radians() * 0.300_28);
            let beam_mps = (band_hz / (7.0898 * 0.05)).sqrt() * wave_m / (2.0 * sine);
            let wanted = if janus {
                beam_mps / 2f64.sqrt()
            } else {
                beam_mps
            };
            eprintln!("janus {janus}, {speed} m/s: sigma {sigma:.4} m/s, wanted {wanted:.4}");
            assert!((sigma / wanted - 1.0).abs() < 0.03, "{sigma} for {wanted}");
            assert!((sum / f64::from(n)).abs() < 4.0 * wanted / f64::from(n).sqrt());
        }
    }

    /// The formula against echoes made of scatterers: closely along the bed, each with phase and
    /// strength by chance and the beam's gain at its angle, there and back; the mean frequency is
    /// the phase's mean step, weighted with power. A factor of two in the band or in its averaging
    /// fails.
    #[test]
    fn val_scatter_of_the_mean_frequency() {
        let settings = DopplerSettings::default();
        let (speed, span_s) = (20.0, 0.05);
        let delta = settings.depression_deg.to_radians();
        let width = settings.beam_width_deg.to_radians();
        let per_cosine_hz = 2.0 * speed / settings.wave_m();
        let chance = Stream::new(8, 0, "scatterers");
        let (scatterers, steps, trials) = (160u64, 160, 1500u64);
        let dt = span_s / f64::from(steps);
        let (mut sum, mut square) = (0.0, 0.0);
        for trial in 0..trials {
            // Echo by step, the beam's middle taken off.
            let mut echo = vec![(0.0f64, 0.0f64); steps as usize + 1];
            for k in 0..scatterers {
                let angle = (k as f64 / scatterers as f64 - 0.5) * 2.4 * width;
                let gain = (-4.0 * LN_2 * (angle / width).powi(2)).exp();
                let number = 2 * (trial * scatterers + k);
                let (mut re, mut im) = (
                    gain * chance.normal(number),
                    gain * chance.normal(number + 1),
                );
                let hz = per_cosine_hz * ((delta + angle).cos() - delta.cos());
                let (sine, cosine) = (TAU * hz * dt).sin_cos();
                for e in &mut echo {
                    *e = (e.0 + re, e.1 + im);
                    (re, im) = (re * cosine - im * sine, re * sine + im * cosine);
                }
            }
            let (re, im) = echo.windows(2).fold((0.0, 0.0), |(re, im), w| {
                let ((a, b), (c, d)) = (w[0], w[1]);
                (re + a * c + b * d, im + a * d - b * c)
            });
            let hz = im.atan2(re) / (TAU * dt);
            sum += hz;
            square += hz * hz;
        }
        let n = trials as f64;
        let sigma = (square / n - (sum / n).powi(2)).sqrt();
        let wanted = settings.frequency_sigma_hz(speed, span_s);
        eprintln!("mean frequency scatters by {sigma:.2} Hz, formula {wanted:.2} Hz");
        assert!((sigma / wanted - 1.0).abs() < 0.1, "{sigma} for {wanted}");
    }

    /// The mount's errors: at 45 deg one beam's scale scatters over units as the given pitch.
    #[test]
    fn mount_errors_are_scale_errors() {
        let settings = DopplerSettings {
            beam_width_deg: 0.0,
            mount_error_deg: 0.2,
            ..DopplerSettings::default()
        };
        let units = 2000;
        let mut square = 0.0;
        for index in 0..units {
            let mut radar = Doppler::new(&settings, 6, index);
            let speed = said(&mut radar, Vector3::x() * 20.0, 0.0).unwrap();
            square += (speed / 20.0 - 1.0).powi(2);
        }
        let share = (square / units as f64).sqrt();
        assert!((share / 0.2f64.to_radians() - 1.0).abs() < 0.05, "{share}");
    }
}
