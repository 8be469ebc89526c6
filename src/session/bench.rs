//! A static test: the rig stands at one point after the other, as on the paper's bench.
//!
//! At every point the equipment starts anew, without odometer or prediction: the lamp's name must
//! be read from its stripes before there is a fix. The rig goes on to the next point when it has
//! its fixes, or after [`PATIENCE_S`] without.

use super::eyes::{Eyes, positioner};
use super::watch::{Costs, Watchers};
use super::{
    End, Event, Exposure, Observer, Opening, RunOptions, SessionError, Source, Summary, TrainPoint,
};
use crate::bus::{Method, SimTime};
use crate::scenario::{BenchSettings, Scenario};
use crate::track::Tunnel;
use crate::twin::physics::TrainState;
use crate::twin::render::{Job, Renderer};
use crate::twin::sensors::RigSettings;
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

/// How long a point is given to yield its fixes.
const PATIENCE_S: f64 = 5.0;

/// One bench test.
pub struct Bench<'s> {
    scenario: &'s Scenario,
    settings: BenchSettings,
    rig: &'s RigSettings,
    /// As the stack is given it.
    map: Arc<Tunnel>,
    eyes: Eyes,
    renderer: Box<dyn Renderer>,
    cost: Costs,
}

impl<'s> Bench<'s> {
    /// Before the first point.
    pub fn new(
        scenario: &'s Scenario,
        settings: BenchSettings,
        rig: &'s RigSettings,
        renderer: Box<dyn Renderer>,
    ) -> Self {
        let map = scenario.map();
        Self {
            scenario,
            settings,
            rig,
            eyes: Eyes::new(scenario, rig, &map),
            map,
            renderer,
            cost: Costs::default(),
        }
    }

    /// Through all points.
    pub fn run(
        mut self,
        options: &RunOptions<'_>,
        observers: &mut [&mut dyn Observer],
    ) -> Result<Summary, SessionError> {
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
                radar: false,
                protection: false,
            })
        })?;
        let end = self.points(options, &mut watchers);
        watchers.each(|o| o.close())?;
        Ok(self.summary(end?, &watchers))
    }

    fn points(
        &mut self,
        options: &RunOptions<'_>,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<End, SessionError> {
        for head_m in self.settings.heads_m() {
            let vehicle = self.scenario.tunnel.alignment.at(head_m).world_from_rails();
            self.eyes.positioner = positioner(self.scenario, self.rig, &self.map);
            let score = &self.eyes.score;
            let wanted = score.fixes(Method::Paper) + self.settings.fixes_per_point as usize;
            let arrived = self.eyes.clock.next().1;
            while self.eyes.score.fixes(Method::Paper) < wanted {
                let (number, start) = self.eyes.clock.next();
                if options.stopped() {
                    return Ok(End::Interrupted);
                }
                if start.since(arrived) > PATIENCE_S {
                    let text = format!("no more fixes with the head at {head_m} m: gone on");
                    watchers.show(&Event::Note(start, &text))?;
                    break;
                }
                self.eyes.clock.advance();
                if self.eyes.trouble.drops(number, start) {
                    continue;
                }
                self.look(number, start, head_m, &vehicle, watchers)?;
            }
            if let Some(progress) = options.progress {
                progress(self.eyes.clock.next().1.secs());
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
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let views = (self.eyes.camera.views(number, start, |_| Some(*vehicle)))
            .ok_or(SessionError::PoseForgotten(start.secs()))?;
        let job = Job {
            time: start,
            views: views.into(),
            ..Job::default()
        };
        watchers.show(&Event::Exposure(&Exposure {
            source: Source::Rig,
            number,
            job: &job,
            owners: &[],
            train: Some(TrainPoint {
                chainage_m: head_m,
                speed_mps: 0.0,
                world_from_vehicle: *vehicle,
            }),
        }))?;
        let renderer = &mut self.renderer;
        self.cost.submit.time(|| renderer.submit(&job)).0?;
        let images = self.cost.wait.time(|| renderer.collect()).0?;
        let watch = &mut self.cost.stack;
        let (vehicle_at, head_at) = (|_| Some(*vehicle), |_| Some(head_m));
        let read = (self.eyes).read((number, start), images, watch, vehicle_at, head_at)?;
        let train = TrainState {
            time: start,
            chainage_m: head_m,
            world_from_vehicle: *vehicle,
            standing: true,
            ..TrainState::default()
        };
        let left = vehicle * self.eyes.camera.rig.vehicle_from_left;
        watchers.show(&Event::Train(&train, Some(&left)))?;
        watchers.show(&Event::Pair(&read.images, &read.report, &read.truths_m))?;
        Ok(())
    }

    fn summary(self, end: End, watchers: &Watchers<'_, '_>) -> Summary {
        let (pairs, next) = self.eyes.clock.next();
        let (backend, cost) = (self.renderer.backend(), &self.cost);
        let speed = Summary::new(self.scenario, end, next.secs(), backend, cost, watchers);
        Summary {
            stereo_frames: pairs,
            positioning: self.eyes.score.finish(),
            ..speed
        }
    }
}
