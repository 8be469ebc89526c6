//! A static test: the rig stands at one point after the other, as on the paper's bench.
//!
//! At every point the equipment starts anew, without odometer or prediction: the lamp's name must
//! be read from its stripes before there is a fix. The rig goes on to the next point when it has
//! its fixes, or after [`PATIENCE_S`] without.

use super::cameras::Taken;
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
    renderer: &'s mut dyn Renderer,
    cost: Costs,
}

impl<'s> Bench<'s> {
    /// Before the first point.
    pub fn new(
        scenario: &'s Scenario,
        settings: BenchSettings,
        rig: &'s RigSettings,
        renderer: &'s mut dyn Renderer,
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
        let mut views = (self.eyes.camera.views(number, start, |_| Some(*vehicle)))
            .ok_or(SessionError::PoseForgotten(start.secs()))?;
        let taken = Taken {
            number,
            start,
            with: self.eyes.expose(&mut views),
        };
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
        let read = (self.eyes).read(&taken, images, watch, vehicle_at, head_at)?;
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::session::{ObserverError, RendererChoice, run};
    use crate::settings::read_toml;
    use crate::twin::render::View;

    /// Exposures and gains as pairs are drawn, as their frames say, and by how much fixes are off the
    /// middle of the exposure that their frames say.
    #[derive(Default)]
    struct Seen {
        drawn: Vec<(f64, f64)>,
        said: Vec<(f64, f64)>,
        off_s: Vec<f64>,
    }

    impl Observer for Seen {
        fn open(&mut self, _: &Opening<'_>) -> Result<(), ObserverError> {
            Ok(())
        }

        fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
            match event {
                Event::Exposure(exposure) => {
                    let views = exposure.job.views.iter();
                    let with = |v: &View| (v.camera.shutter.exposure_s, v.sensor.gain_db);
                    self.drawn.extend(views.map(with));
                }
                Event::Pair(pair, report, _) => {
                    let eyes = [&pair.left, &pair.right];
                    (self.said).extend(eyes.map(|eye| (eye.exposure_s, eye.gain_db)));
                    for fix in &report.fixes {
                        let mut spots = report.left.iter();
                        let spot = spots.find(|s| s.uid.is_some_and(|u| u.0 == fix.uid));
                        let open_s = 22.2e-6 * spot.unwrap().centre.y;
                        let after_s = fix.time.since(pair.left.start);
                        (self.off_s).push(after_s - open_s - 0.5 * pair.left.exposure_s);
                    }
                }
                _ => {}
            }
            Ok(())
        }

        fn close(&mut self) -> Result<(), ObserverError> {
            Ok(())
        }
    }

    /// Automatic exposure acts on a bench too; each frame says what it was taken with, and the stack
    /// times its rows by that.
    #[test]
    fn frames_say_what_the_control_chose() {
        let text = r#"
            name = "bench"
            tunnel = "given"
            bench = { points = 1, first_m = 195.0, fixes_per_point = 3 }
            [rig]
            exposure_us = 10.0
            exposure_control = { mode = "auto", max_exposure_us = 40.0 }
        "#;
        let tunnel = Tunnel::from_toml(include_str!("../../tunnels/test_bench.toml")).unwrap();
        let scenario = Scenario::new(read_toml(text).unwrap(), tunnel).unwrap();
        let options = RunOptions {
            renderer: RendererChoice::Cpu,
            ..RunOptions::default()
        };
        let mut seen = Seen::default();
        run(&scenario, &options, &mut [&mut seen]).unwrap();
        assert_eq!(seen.drawn, seen.said);
        let (first, last) = (seen.said[0], seen.said[seen.said.len() - 1]);
        assert!((first.0 - 10e-6).abs() < 1e-12, "{first:?}");
        assert!((last.0 - 40e-6).abs() < 1e-12, "{last:?}");
        assert!(last.1 > first.1, "{last:?}");
        assert!(!seen.off_s.is_empty());
        assert!(
            seen.off_s.iter().all(|s| s.abs() < 2e-9),
            "{:?}",
            seen.off_s
        );
    }
}
