//! A static test: the rig stands at one point after the other, as on the paper's bench.
//!
//! At every point the equipment starts anew, without odometer or prediction: the lamp's name must
//! be read from its stripes before there is a fix. The rig goes on to the next point when it has
//! its fixes, or after [`PATIENCE_S`] without.

use super::cameras::{Clock, StereoCamera, pair};
use super::score::PositioningScore;
use super::watch::{Stopwatch, Watchers, now};
use super::{
    End, Event, Observer, Opening, Physics, RunOptions, SessionError, Summary, TrainTruth,
    WallShares,
};
use crate::bus::{Method, SimTime};
use crate::scenario::{BenchSettings, Scenario};
use crate::stack::positioning::LedPositioner;
use crate::twin::render::{Job, Renderer};
use crate::twin::sensors::RigSettings;
use nalgebra::{Isometry3, Vector3};

/// How long a point is given to yield its fixes.
const PATIENCE_S: f64 = 5.0;

/// One bench test.
pub struct Bench<'s> {
    scenario: &'s Scenario,
    settings: BenchSettings,
    rig: &'s RigSettings,
    camera: StereoCamera,
    renderer: Box<dyn Renderer>,
    score: PositioningScore,
    clock: Clock,
    submit: Stopwatch,
    wait: Stopwatch,
    stack: Stopwatch,
}

impl<'s> Bench<'s> {
    /// Before the first point.
    pub fn new(
        scenario: &'s Scenario,
        settings: BenchSettings,
        rig: &'s RigSettings,
        renderer: Box<dyn Renderer>,
    ) -> Self {
        Self {
            scenario,
            settings,
            rig,
            camera: StereoCamera::new(rig, scenario.seed),
            renderer,
            score: PositioningScore::new(scenario.tunnel.clone(), &Method::ALL),
            clock: Clock::new(rig.pairs_per_s),
            submit: Stopwatch::default(),
            wait: Stopwatch::default(),
            stack: Stopwatch::default(),
        }
    }

    /// Through all points.
    pub fn run(
        mut self,
        options: &RunOptions<'_>,
        observers: &mut [&mut dyn Observer],
    ) -> Result<Summary, SessionError> {
        let begin = now();
        let mut watchers = Watchers::new(observers);
        let calibration = self.rig.calibration();
        watchers.each(|o| {
            o.open(&Opening {
                scenario: &self.scenario.name,
                seed: self.scenario.seed,
                tunnel: &self.scenario.tunnel,
                rig: Some(&calibration),
                wayside: &[],
                car_half_extents_m: Vector3::zeros(),
                cars: 0,
                protection: false,
            })
        })?;
        let end = self.points(options, &mut watchers);
        watchers.each(|o| o.close())?;
        Ok(self.summary(end?, begin.elapsed().as_secs_f64(), watchers.watch))
    }

    fn points(
        &mut self,
        options: &RunOptions<'_>,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<End, SessionError> {
        for head_m in self.settings.heads_m() {
            let vehicle = self.scenario.tunnel.alignment.at(head_m).world_from_rails();
            let mut positioner = LedPositioner::new(
                &self.scenario.stack.led,
                self.rig.calibration(),
                self.scenario.tunnel.clone(),
            );
            let wanted = self.score.fixes(Method::Paper) + self.settings.fixes_per_point as usize;
            let arrived = self.clock.next().1;
            while self.score.fixes(Method::Paper) < wanted {
                let (number, start) = self.clock.next();
                if options.stopped() {
                    return Ok(End::Interrupted);
                }
                if start.since(arrived) > PATIENCE_S {
                    let text = format!("no more fixes with the head at {head_m} m: gone on");
                    watchers.show(&Event::Note(start, &text))?;
                    break;
                }
                self.clock.advance();
                self.look(number, start, head_m, &vehicle, &mut positioner, watchers)?;
            }
            if let Some(progress) = options.progress {
                progress(self.clock.next().1.secs());
            }
        }
        Ok(End::Complete)
    }

    /// One pair of images from a rig that stands still.
    fn look(
        &mut self,
        number: u32,
        start: SimTime,
        head_m: f64,
        vehicle: &Isometry3<f64>,
        positioner: &mut LedPositioner,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let views = (self.camera.views(number, start, |_| Some(*vehicle)))
            .ok_or(SessionError::PoseForgotten(start.secs()))?;
        let job = Job {
            time: start,
            views: views.into(),
            ..Job::default()
        };
        let renderer = &mut self.renderer;
        self.submit.time(|| renderer.submit(&job)).0?;
        let images = self.wait.time(|| renderer.collect()).0?;
        let Ok(images) = images.try_into() else {
            return Ok(());
        };
        let images = pair(number, start, images);
        let (report, seconds) = self.stack.time(|| positioner.on_pair(&images));
        let left = vehicle * self.camera.rig.vehicle_from_left;
        let intrinsics = self.camera.rig.camera.intrinsics;
        self.score
            .report(&report, 1e3 * seconds, &intrinsics, |_| Some(left));
        for fix in &report.fixes {
            self.score.fix(fix, head_m);
        }
        let truths_m = vec![head_m; report.fixes.len()];
        watchers.show(&Event::Train(&still(start, head_m, vehicle, left)))?;
        watchers.show(&Event::Pair(&images, &report, &truths_m))?;
        Ok(())
    }

    fn summary(self, end: End, wall_s: f64, record: Stopwatch) -> Summary {
        let (pairs, next) = self.clock.next();
        let simulated_s = next.secs();
        Summary {
            scenario: self.scenario.name.clone(),
            seed: self.scenario.seed,
            end,
            simulated_s,
            wall_s,
            real_time_factor: simulated_s / wall_s,
            renderer: self.renderer.backend(),
            stereo_frames: pairs,
            wayside_frames: 0,
            physics: Physics::default(),
            wall_shares_s: WallShares {
                physics_s: 0.0,
                submit_s: self.submit.total_s,
                wait_s: self.wait.total_s,
                stack_s: self.stack.total_s,
                record_s: record.total_s,
            },
            positioning: self.score.finish(),
            wayside: None,
            protection: None,
        }
    }
}

fn still(
    time: SimTime,
    chainage_m: f64,
    vehicle: &Isometry3<f64>,
    left: Isometry3<f64>,
) -> TrainTruth {
    TrainTruth {
        time,
        chainage_m,
        speed_mps: 0.0,
        accel_mps2: 0.0,
        world_from_vehicle: *vehicle,
        world_from_left: Some(left),
        world_from_cars: Vec::new(),
        floor_accel_mps2: Vector3::zeros(),
        secondary_travel_m: 0.0,
    }
}
