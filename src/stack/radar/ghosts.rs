//! Which targets are mirror images of others in a wall.
//!
//! A wall along the track, at y = w in the vehicle frame (its x axis along the wall), mirrors a target at (x, y) with the
//! velocity (u, v) to (x, 2 w - y) with (u, -v). The radar at m sees it
//!
//! - by the wall both ways, at the image's range |i - m|, azimuth and radial speed;
//! - by the wall one way and directly the other: at the mean of both ranges and of both radial speeds, at an azimuth
//!   between both, as the array takes the two ways of sending and receiving together.
//!
//! Either way is longer than the direct one, and its echo is weaker: the wall takes its part. So a target is explained
//! when another one, nearer and with a larger cross-section, makes it one of the two, in place and velocity, within what
//! is known of both and of the wall. It is called a ghost when it was explained in [`RadarTrackingSettings::ghost_frames`]
//! frames more than it was not. In a curve of radius R a wall is off its tangent by x^2 / 2 R: that is added to what is not
//! known of the wall, from the yaw rate.
//!
//! Walls are found by their own echoes: things that stand, one distance to the side, at many places along the track,
//! farther apart than a body is long. Without such a wall nothing is called a ghost: a real person beside another must not
//! be. Long walls hide their own echoes from detection but for some, so places are gathered over the last
//! [`MEMORY_M`] metres.
//!
//! Source: R. Feng, E. De Greef, M. Rykunov, H. Sahli, S. Pollin and A. Bourdoux, Multipath Ghost Recognition for Indoor
//! MIMO Radar, IEEE Trans. Geosci. Remote Sens. 60 (2022), for the classes of paths.

use super::detector::Sighting;
use super::own_motion::Mount;
use super::settings::RadarTrackingSettings;
use super::target::{Target, View};
use crate::numerics::wrapped;
use nalgebra::{Matrix4, Vector2, Vector4};
use std::ops::Range;

/// Width of the steps in which walls are looked for, metres.
const STEP_M: f64 = 0.25;
/// A wall is known by what was seen of it along so much of the way, metres: farther on a tunnel has another width.
const MEMORY_M: f64 = 60.0;
/// Places that make a wall: a few parked things do not stand in line as often.
const LEAST_PLACES: usize = 4;
/// Squared Mahalanobis distances that are exceeded once in a thousand, with 4 and with 2 degrees of freedom.
const GATE_OF_4: f64 = 18.47;
const GATE_OF_2: f64 = 13.82;

/// Finds walls, and marks ghosts.
#[derive(Clone, Debug)]
pub struct Ghosts {
    settings: RadarTrackingSettings,
    /// How far the vehicle has run, metres.
    run_m: f64,
    /// Where along the way things stand, by steps from right to left, metres.
    places_m: Vec<Vec<f64>>,
}

impl Ghosts {
    /// Without walls.
    pub fn new(settings: RadarTrackingSettings) -> Self {
        let steps = (2.0 * settings.wall_most_m / STEP_M).ceil().clamp(1.0, 1e5) as usize;
        Self {
            settings,
            run_m: 0.0,
            places_m: vec![Vec::new(); steps],
        }
    }

    /// Takes the sightings of a frame in, and judges the confirmed targets.
    pub fn on_frame(&mut self, sightings: &[Sighting], targets: &mut [Target], view: &View) {
        self.note(sightings, view);
        let walls = self.walls();
        let curvature = curvature(view);
        for k in 0..targets.len() {
            let target = &targets[k];
            let is_explained = targets.iter().any(|source| {
                let pair = MirrorPair {
                    source,
                    target,
                    view,
                    curvature,
                };
                source.is_confirmed
                    && walls
                        .iter()
                        .any(|wall| pair.is_explained(*wall, &self.settings))
            });
            let score = &mut targets[k].ghost_score;
            *score = if is_explained {
                *score + 1
            } else {
                score.saturating_sub(1)
            };
            // From then on it is one until it was not explained as often.
            *score = (*score).min(2 * self.settings.ghost_frames);
            let score = *score;
            let was = targets[k].is_ghost;
            targets[k].is_ghost = score >= self.settings.ghost_frames || (was && score > 0);
        }
    }

    /// Distances of the walls to the left of the middle, at most one on either side, metres.
    pub fn walls(&self) -> Vec<f64> {
        let middle = self.places_m.len() / 2;
        let right = self.strongest(0..middle);
        let left = self.strongest(middle..self.places_m.len());
        [right, left].into_iter().flatten().collect()
    }

    /// The mean distance of the three neighbours with most places.
    fn strongest(&self, steps: Range<usize>) -> Option<f64> {
        let count = |k: usize| self.places_m[k].len();
        let sum = |k: usize| self.around(k).map(count).sum::<usize>();
        let best = steps.max_by_key(|k| (sum(*k), count(*k)))?;
        let weighted = self
            .around(best)
            .map(|k| count(k) as f64 * self.lateral_m(k));
        (sum(best) >= LEAST_PLACES).then(|| weighted.sum::<f64>() / sum(best) as f64)
    }

    /// A step and those beside it.
    fn around(&self, step: usize) -> Range<usize> {
        step.saturating_sub(1)..(step + 2).min(self.places_m.len())
    }

    fn lateral_m(&self, step: usize) -> f64 {
        STEP_M * (step as f64 + 0.5 - 0.5 * self.places_m.len() as f64)
    }

    /// Notes where things stand that are no part of a body that was noted before.
    fn note(&mut self, sightings: &[Sighting], view: &View) {
        self.run_m += view.own.run_m;
        let run_m = self.run_m;
        for places in &mut self.places_m {
            places.retain(|place| (place - run_m).abs() < MEMORY_M);
        }
        for seen in sightings {
            let Some(place) = standing_at(seen, view, &self.settings) else {
                continue;
            };
            let along_m = run_m + place.x;
            let step = place.y / STEP_M + 0.5 * self.places_m.len() as f64;
            let is_wall = place.y.abs() >= self.settings.wall_least_m && place.x.abs() < MEMORY_M;
            if !(is_wall && step >= 0.0 && (step as usize) < self.places_m.len()) {
                continue;
            }
            let step = step as usize;
            let near = |other: &f64| (other - along_m).abs() < self.settings.body_length_m;
            if !self.around(step).any(|k| self.places_m[k].iter().any(near)) {
                self.places_m[step].push(along_m);
            }
        }
    }
}

/// Forward and left, metres, of what has the radial speed of something that stands, where its azimuth says the distance
/// to within a wall's spread.
fn standing_at(
    seen: &Sighting,
    view: &View,
    settings: &RadarTrackingSettings,
) -> Option<Vector2<f64>> {
    let Mount { place_m, yaw_rad } = view.mount;
    let detection = &seen.detection;
    let azimuth = detection.azimuth_rad + yaw_rad;
    let along = Vector2::new(azimuth.cos(), azimuth.sin());
    let standing_mps = -view.mount.velocity(&view.own).dot(&along);
    let off_mps = wrapped(detection.radial_speed_mps - standing_mps, view.span_mps);
    let sigma_mps = settings.own_speed_sigma_mps + seen.sigmas[2];
    let across_m = seen.sigmas[1] * detection.range_m;
    let is_told = across_m < settings.wall_sigma_m && off_mps.abs() < 3.0 * sigma_mps;
    is_told.then(|| place_m + detection.range_m * along)
}

/// One over the radius of the vehicle's way, 1/m; 0 below walking pace, where the yaw rate says little.
fn curvature(view: &View) -> f64 {
    let speed_mps = view.own.speed_mps.abs();
    if speed_mps > 1.0 {
        view.own.yaw_rate_radps / speed_mps
    } else {
        0.0
    }
}

/// A target that a source may explain.
struct MirrorPair<'a> {
    source: &'a Target,
    target: &'a Target,
    view: &'a View,
    curvature: f64,
}

impl MirrorPair<'_> {
    fn is_explained(&self, wall_m: f64, settings: &RadarTrackingSettings) -> bool {
        let away = |target: &Target| (target.place() - self.view.mount.place_m).norm();
        let is_nearer = away(self.source) < away(self.target);
        let is_stronger = self.source.cross_section_m2 > self.target.cross_section_m2;
        let own_side = (self.source.state[1] - wall_m) * (self.view.mount.place_m.y - wall_m);
        let is_other = self.source.id != self.target.id;
        is_other && is_nearer && is_stronger && own_side > 0.0 && {
            let image = self.image(wall_m, settings);
            self.is_image(&image) || self.is_between(&image)
        }
    }

    /// The source mirrored, with its covariance and that of the wall.
    fn image(&self, wall_m: f64, settings: &RadarTrackingSettings) -> Target {
        let mirror = Matrix4::from_diagonal(&Vector4::new(1.0, -1.0, 1.0, -1.0));
        let mut image = self.source.clone();
        image.state = mirror * self.source.state;
        image.state[1] += 2.0 * wall_m;
        image.covariance = mirror * self.source.covariance * mirror;
        let bent_m = 0.5 * self.curvature * self.source.state[0].powi(2);
        image.covariance[(1, 1)] += 4.0 * (settings.wall_sigma_m.powi(2) + bent_m * bent_m);
        image
    }

    /// By the wall both ways.
    fn is_image(&self, image: &Target) -> bool {
        let off = self.target.state - image.state;
        let covariance = self.target.covariance + image.covariance;
        let inverse = covariance.try_inverse();
        inverse.is_some_and(|inverse| (off.transpose() * inverse * off).x < GATE_OF_4)
    }

    /// By the wall one way.
    fn is_between(&self, image: &Target) -> bool {
        let targets = [self.source, image, self.target];
        let [Some(direct), Some(by_wall), Some(own)] = targets.map(|target| {
            let (seen, jacobian) = target.measure(self.view)?;
            Some((seen, jacobian * target.covariance * jacobian.transpose()))
        }) else {
            return false;
        };
        let off = own.0 - 0.5 * (direct.0 + by_wall.0);
        let covariance = own.1 + 0.25 * (direct.1 + by_wall.1);
        // Range and radial speed.
        let part = |k: usize| off[k].powi(2) / covariance[(k, k)];
        let half = 0.5 * (direct.0.y - by_wall.0.y).abs();
        let beyond = (off.y.abs() - half).max(0.0).powi(2) / covariance[(1, 1)];
        part(0) + part(2) < GATE_OF_2 && beyond < GATE_OF_2
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::RadarDetection;
    use crate::stack::radar::own_motion::OwnMotion;

    fn view() -> View {
        let mount = Mount {
            place_m: Vector2::new(0.0, 0.5),
            yaw_rad: 0.1,
        };
        let own = OwnMotion {
            time_s: 0.05,
            run_m: 0.5,
            speed_mps: 10.0,
            ..OwnMotion::default()
        };
        View {
            mount,
            own,
            span_mps: 80.0,
            transmitters: 2,
        }
    }

    fn seen(range_m: f64, azimuth_rad: f64, speed_mps: f64, cross_section_m2: f64) -> Sighting {
        Sighting {
            detection: RadarDetection {
                range_m,
                radial_speed_mps: speed_mps,
                azimuth_rad,
                snr_db: 30.0,
                cross_section_m2,
            },
            fold: 0,
            sigmas: [0.05, 0.005, 0.05],
        }
    }

    /// A confirmed target at a place with a velocity, known well.
    fn target(id: u32, state: [f64; 4], cross_section_m2: f64) -> Target {
        let settings = RadarTrackingSettings::default();
        let mut target = Target::new(
            id,
            &seen(9.0, 0.0, 0.0, cross_section_m2),
            &view(),
            &settings,
        );
        target.state = state.into();
        target.covariance = Matrix4::from_diagonal(&Vector4::new(0.02, 0.02, 0.05, 0.05));
        target.is_confirmed = true;
        target
    }

    /// Sightings of a wall at 3.5 m to the left, and frames of targets after it; who is a ghost then.
    fn ghosts_among(targets: &mut [Target], has_wall: bool) -> Vec<bool> {
        let view = view();
        let mut ghosts = Ghosts::new(RadarTrackingSettings::default());
        for x in [12.0, 18.0, 24.0, 30.0].into_iter().filter(|_| has_wall) {
            let away = Vector2::<f64>::new(x, 3.0);
            let speed_mps = -10.0 * x / away.norm();
            let azimuth = away.y.atan2(away.x) - view.mount.yaw_rad;
            let stands = seen(away.norm(), azimuth, speed_mps, 0.1);
            ghosts.on_frame(&[stands], &mut [], &view);
        }
        for _ in 0..RadarTrackingSettings::default().ghost_frames {
            ghosts.on_frame(&[], targets, &view);
        }
        targets.iter().map(|target| target.is_ghost).collect()
    }

    /// The path by the wall both ways, as the geometry says; and by the wall one way, at the mean range and radial speed,
    /// with the place and velocity that these make between both directions. Neither without the wall, nor when it is
    /// stronger, moves otherwise, or is as far off as another wall would make it.
    #[test]
    fn both_paths_by_a_wall_are_ghosts() {
        let source = target(0, [20.0, -1.0, 1.0, 0.5], 2.0);
        let image = target(1, [20.0, 8.0, 1.0, -0.5], 0.5);
        let view = view();
        let [direct, by_wall] = [&source, &image].map(|target| target.measure(&view).unwrap().0);
        let half = 0.5 * (direct + by_wall);
        let settings = RadarTrackingSettings::default();
        let mut mixed = Target::new(2, &seen(half.x, half.y, half.z, 0.5), &view, &settings);
        mixed.is_confirmed = true;
        let mut all = vec![source.clone(), image.clone(), mixed.clone()];
        assert_eq!(ghosts_among(&mut all, true), [false, true, true]);
        let mut all = vec![source.clone(), image.clone(), mixed];
        assert_eq!(ghosts_among(&mut all, false), [false; 3]);
        let others = [
            target(3, [20.0, 8.0, 1.0, -0.5], 3.0),
            target(4, [20.0, 8.0, -2.0, -0.5], 0.5),
            target(5, [20.0, 12.0, 1.0, -0.5], 0.5),
            target(6, [24.0, 8.0, 1.0, -0.5], 0.5),
        ];
        for other in others {
            let mut two = vec![source.clone(), other];
            assert_eq!(ghosts_among(&mut two, true), [false; 2], "{:?}", two[1]);
        }
    }

    /// One thing that stands, seen often, is no wall.
    #[test]
    fn a_body_is_no_wall() {
        let view = view();
        let mut ghosts = Ghosts::new(RadarTrackingSettings::default());
        for k in 0..30 {
            let away = Vector2::<f64>::new(30.0 - 0.5 * f64::from(k), 3.0);
            let speed_mps = -10.0 * away.x / away.norm();
            let azimuth = away.y.atan2(away.x) - view.mount.yaw_rad;
            ghosts.on_frame(
                &[seen(away.norm(), azimuth, speed_mps, 1.0)],
                &mut [],
                &view,
            );
        }
        assert!(ghosts.walls().is_empty(), "{:?}", ghosts.walls());
    }
}
