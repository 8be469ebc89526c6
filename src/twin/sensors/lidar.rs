//! Lidar of a wayside device: a rotating head with a fan of beams, of the class of the Velodyne
//! VLP-16 (16 beams over 30 deg, 10 turns a second, 0.2 deg from shot to shot, 3 cm accuracy).
//!
//! Each shot meets the first surface on its axis, tunnel or body; the head takes its time to turn,
//! so a body is where it is when the beam passes. The echo of a Lambert surface of reflectance rho
//! met at angle i is proportional to rho cos(i) / R^2 (the lidar equation without extinction);
//! below the detector's threshold there is no echo. No beam divergence, no mixed echoes at edges.

use super::ClockSettings;
use crate::bus::{LidarReturn, LidarScan, SimTime};
use crate::settings::{Checker, settings};
use crate::track::Track;
use crate::twin::geometry::{Body, Solid, TunnelCaster};
use crate::twin::random::Stream;
use crate::twin::reflectance::mean_albedo;
use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::TAU;
use std::sync::Arc;

settings! {
    /// The lidar of a wayside device. Angles count from its axis.
    pub struct LidarSettings {
        /// Beams, one above the other.
        channels: u32 = 16, in 1.0..=256.0;
        /// Elevation of the lowest beam, deg.
        lowest_deg: f64 = -15.0, in -89.0..=89.0;
        /// Elevation of the highest beam, deg.
        highest_deg: f64 = 15.0, in -89.0..=89.0;
        /// Sector in which echoes are reported, to either side of the axis, deg.
        half_sector_deg: f64 = 60.0, in 0.0..=180.0;
        /// Turn from shot to shot, deg.
        step_deg: f64 = 0.2, in 0.01..=10.0;
        /// Turns of the head a second, one scan each; a frame goes with the latest scan that was
        /// complete when the frame's last row closed.
        rate_hz: f64 = 10.0, in 0.1..=100.0;
        /// Standard deviation of a range, m.
        range_noise_m: f64 = 0.02, in 0.0..=1.0;
        /// Nearest range, m.
        min_range_m: f64 = 0.5, in 0.0..=500.0;
        /// Longest range, m.
        max_range_m: f64 = 120.0, in 1.0..=500.0;
        /// Reflectance that, met square, is just seen at the longest range; darker or slanted
        /// surfaces are lost earlier. 0 to lose none.
        threshold_reflectance: f64 = 0.1, in 0.0..=1.0;
        /// Its clock.
        clock: ClockSettings = ClockSettings::default(), nested;
    }
    also check_order
}

impl LidarSettings {
    fn check_order(&self, check: &mut Checker<'_>) {
        check.within("highest_deg", self.highest_deg, self.lowest_deg..=89.0);
        check.within("min_range_m", self.min_range_m, 0.0..=self.max_range_m);
    }

    fn elevation_rad(&self, channel: u32) -> f64 {
        let gaps = f64::from(self.channels.max(2) - 1);
        let share = f64::from(channel) / gaps;
        (self.lowest_deg + (self.highest_deg - self.lowest_deg) * share).to_radians()
    }

    /// Shots to either side of the axis.
    fn side_shots(&self) -> i32 {
        // The slack keeps the outermost shot when the quotient is rounded down.
        (self.half_sector_deg / self.step_deg + 1e-6).floor() as i32
    }
}

/// A lidar on the wall.
#[derive(Clone, Debug)]
pub struct Lidar {
    pub(super) settings: LidarSettings,
    origin: Point3<f64>,
    beams: Vec<Beam>,
    stream: Stream,
}

/// One shot of a scan.
#[derive(Clone, Debug)]
struct Beam {
    azimuth_rad: f64,
    elevation_rad: f64,
    /// World, unit.
    direction: Vector3<f64>,
    /// When in the scan.
    after_s: f64,
    /// The tunnel on its axis.
    wall: Option<Echo>,
}

/// A surface on a beam's axis.
#[derive(Clone, Copy, Debug)]
struct Echo {
    range_m: f64,
    /// Reflectance times cosine of incidence.
    brightness: f64,
}

impl Lidar {
    /// A lidar mounted at `world_from_lidar` (x right, y along its axis, z up); its noise is
    /// drawn from `stream`. The tunnel does not move, so it is ranged here, once.
    pub fn new(
        settings: &LidarSettings,
        tracks: &[Arc<Track>],
        world_from_lidar: &Isometry3<f64>,
        stream: Stream,
    ) -> Self {
        let caster = TunnelCaster::new(tracks);
        let origin = Point3::from(world_from_lidar.translation.vector);
        let ray_start = caster.ray_start(&origin, None);
        let side = settings.side_shots();
        let mut beams = Vec::new();
        for shot in -side..=side {
            let azimuth_rad = (f64::from(shot) * settings.step_deg).to_radians();
            let after_s = (f64::from(shot + side) * settings.step_deg).to_radians()
                / (TAU * settings.rate_hz);
            for channel in 0..settings.channels {
                let elevation_rad = settings.elevation_rad(channel);
                let (sin_a, cos_a) = azimuth_rad.sin_cos();
                let (sin_w, cos_w) = elevation_rad.sin_cos();
                let direction =
                    world_from_lidar * Vector3::new(cos_w * sin_a, cos_w * cos_a, sin_w);
                let hit = caster.cast(ray_start, &origin, &direction, settings.max_range_m);
                let wall = hit.map(|hit| {
                    let at = caster.surface_at(&origin, &direction, &hit);
                    Echo {
                        range_m: hit.t,
                        brightness: mean_albedo(at.material) * -at.normal.dot(&direction),
                    }
                });
                beams.push(Beam {
                    azimuth_rad,
                    elevation_rad,
                    direction,
                    after_s,
                    wall,
                });
            }
        }
        Self {
            settings: settings.clone(),
            origin,
            beams,
            stream,
        }
    }

    /// From the first shot of a scan to its last.
    pub fn sweep_s(&self) -> f64 {
        self.beams.last().map_or(0.0, |beam| beam.after_s)
    }

    /// Scan `number`, begun at `time`, among bodies whose poses are those of `bodies_time`.
    pub fn scan(
        &self,
        time: SimTime,
        number: u32,
        bodies_time: SimTime,
        bodies: &[Body],
    ) -> LidarScan {
        let begin_s = time.since(bodies_time);
        let returns = self.beams.iter().enumerate().filter_map(|(k, beam)| {
            let echo = self.first_echo(beam, begin_s + beam.after_s, bodies)?;
            let noise = self.stream.normal(u64::from(number) << 32 | k as u64);
            self.detects(&echo).then_some(LidarReturn {
                range_m: echo.range_m + self.settings.range_noise_m * noise,
                azimuth_rad: beam.azimuth_rad,
                elevation_rad: beam.elevation_rad,
            })
        });
        LidarScan {
            time,
            returns: returns.collect(),
        }
    }

    fn first_echo(&self, beam: &Beam, after_s: f64, bodies: &[Body]) -> Option<Echo> {
        let mut first = beam.wall;
        for body in bodies {
            let solid = Solid::at(body, after_s);
            if let Some((range_m, normal)) = solid.cast(&self.origin, &beam.direction)
                && first.is_none_or(|e| range_m < e.range_m)
            {
                first = Some(Echo {
                    range_m,
                    brightness: body.albedo * -normal.dot(&beam.direction),
                });
            }
        }
        first
    }

    fn detects(&self, echo: &Echo) -> bool {
        let s = &self.settings;
        let relative = echo.range_m / s.max_range_m;
        (s.min_range_m..=s.max_range_m).contains(&echo.range_m)
            && echo.brightness >= s.threshold_reflectance * relative * relative
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;
    use crate::twin::geometry::Shape;
    use crate::twin::render::sample;

    /// 20 m down the straight of the sample tunnel, on the right wall, looking up the line.
    fn mount(track: &Track) -> Isometry3<f64> {
        let at = crate::track::TrackPoint {
            s_m: 20.0,
            l_m: -2.0,
            h_m: 2.5,
        };
        // The camera's z forward and y down are the lidar's y and -z.
        sample::camera_pose(track, at, 0.0, 0.0)
            * nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.25 * TAU)
    }

    fn lidar(settings: &LidarSettings) -> Lidar {
        let track = sample::track();
        let stream = Stream::new(1, 0, "lidar");
        Lidar::new(settings, &[Arc::new(track.clone())], &mount(&track), stream)
    }

    /// A board across the line, `away_m` in front of the lidar at the time of its pose.
    fn board(away_m: f64, albedo: f64, speed_mps: f64) -> Body {
        let pose = mount(&sample::track()) * Isometry3::translation(0.0, away_m + 0.5, 0.0);
        Body {
            shape: Shape::Box(Vector3::new(20.0, 0.5, 20.0)),
            velocity_mps: pose * Vector3::new(0.0, speed_mps, 0.0),
            world_from_body: pose,
            albedo,
            luminance_cd_m2: 0.0,
        }
    }

    fn point(echo: &LidarReturn) -> Vector3<f64> {
        let (sin_a, cos_a) = echo.azimuth_rad.sin_cos();
        let (sin_w, cos_w) = echo.elevation_rad.sin_cos();
        Vector3::new(cos_w * sin_a, cos_w * cos_a, sin_w) * echo.range_m
    }

    /// Fails where an angle or an axis is wrong: echoes of a plane lie on it.
    #[test]
    fn a_plane_at_a_known_distance() {
        let lidar = lidar(&LidarSettings {
            range_noise_m: 0.0,
            half_sector_deg: 5.0,
            ..LidarSettings::default()
        });
        let scan = lidar.scan(SimTime::ZERO, 0, SimTime::ZERO, &[board(6.0, 0.5, 0.0)]);
        assert_eq!(scan.returns.len(), 16 * 51);
        let mut on_board = 0;
        for echo in &scan.returns {
            // The bed and the right wall cut the fan's edges off.
            assert!(point(echo).y <= 6.0 + 1e-9);
            on_board += usize::from((point(echo).y - 6.0).abs() < 1e-9);
        }
        assert!(on_board > 16 * 45, "{on_board}");
    }

    /// Fails where noise is biased, has another strength or repeats from scan to scan.
    #[test]
    fn ranges_are_noisy_as_set() {
        let lidar = lidar(&LidarSettings {
            channels: 1,
            lowest_deg: 0.0,
            highest_deg: 0.0,
            half_sector_deg: 4.0,
            ..LidarSettings::default()
        });
        let bodies = [board(6.0, 0.5, 0.0)];
        let errors: Vec<f64> = (0..200)
            .flat_map(|k| lidar.scan(SimTime::ZERO, k, SimTime::ZERO, &bodies).returns)
            .map(|e| e.range_m - 6.0 / e.azimuth_rad.cos())
            .collect();
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / n;
        let variance = errors.iter().map(|e| e * e).sum::<f64>() / n;
        assert!(n > 8000.0 && mean.abs() < 4.0 * 0.02 / n.sqrt(), "{mean}");
        assert!((variance.sqrt() / 0.02 - 1.0).abs() < 0.04, "{variance}");
    }

    /// Fails where the head turns in no time, or bodies are not moved to the scan's time.
    #[test]
    fn bodies_move_while_the_head_turns() {
        let lidar = lidar(&LidarSettings {
            range_noise_m: 0.0,
            half_sector_deg: 10.0,
            ..LidarSettings::default()
        });
        let start = SimTime::from_secs(2.0);
        let scan = lidar.scan(start, 0, SimTime::from_secs(1.9), &[board(4.0, 0.5, 20.0)]);
        let (mut first, mut last) = (None, None);
        for echo in scan.returns.iter().filter(|e| e.elevation_rad.abs() < 0.1) {
            let after = 0.1 + (echo.azimuth_rad.to_degrees() + 10.0) / 3600.0;
            let expected = 4.0 + 20.0 * after;
            if (point(echo).y - expected).abs() < 1e-6 {
                first = first.or(Some(point(echo).y));
                last = Some(point(echo).y);
            }
        }
        let walked = last.zip(first).map_or(0.0, |(b, a)| b - a);
        assert!((walked - 20.0 * 20.0 / 3600.0).abs() < 0.03, "{walked}");
    }

    /// Fails where dark surfaces echo as far as bright ones.
    #[test]
    fn dark_boards_are_lost_at_the_range_of_the_lidar_equation() {
        let lidar = lidar(&LidarSettings {
            channels: 1,
            lowest_deg: 0.0,
            highest_deg: 0.0,
            half_sector_deg: 0.0,
            ..LidarSettings::default()
        });
        // rho = 0.02 is seen to 120 m * sqrt(0.02 / 0.1) = 53.7 m.
        for (away_m, albedo, seen) in [
            (53.0, 0.02, true),
            (54.5, 0.02, false),
            (119.0, 0.1, true),
            (121.0, 1.0, false),
            (0.4, 0.5, false),
        ] {
            let scan = lidar.scan(
                SimTime::ZERO,
                0,
                SimTime::ZERO,
                &[board(away_m, albedo, 0.0)],
            );
            assert_eq!(
                scan.returns.len(),
                usize::from(seen),
                "{away_m} m, {albedo}"
            );
        }
    }

    /// Fails where the tunnel does not echo: the lining of the sample tunnel is a circle.
    #[test]
    fn the_lining_is_where_it_is() {
        let lidar = lidar(&LidarSettings {
            range_noise_m: 0.0,
            ..LidarSettings::default()
        });
        let scan = lidar.scan(SimTime::ZERO, 0, SimTime::ZERO, &[]);
        assert!(scan.returns.len() > 5000, "{}", scan.returns.len());
        let lining = scan.returns.iter().filter(|echo| {
            let p = point(echo);
            let radius = (p.x + 2.0).hypot(p.z + 2.5 - 1.7);
            // 32 chords of a circle of 3.4 m: inside it by up to 1.1 cm.
            radius > 3.38 && radius < 3.4 + 1e-9
        });
        assert!(lining.count() > 4000);
    }

    /// Fails where a setting that cannot work passes, or a good one does not.
    #[test]
    fn settings_are_checked() {
        let mut problems = Vec::new();
        LidarSettings::default().check("wayside[0].lidar", &mut problems);
        assert!(problems.is_empty(), "{problems:?}");
        let bad = LidarSettings {
            channels: 0,
            step_deg: f64::NAN,
            highest_deg: -20.0,
            ..LidarSettings::default()
        };
        bad.check("wayside[0].lidar", &mut problems);
        let keys: Vec<_> = problems.iter().map(|p| p.key.as_str()).collect();
        let expected = ["channels", "step_deg", "highest_deg"];
        assert_eq!(keys, expected.map(|k| format!("wayside[0].lidar.{k}")));
    }
}
