//! A run with a train: every step the world moves, sensors sample, cameras trigger, images that
//! are due reach the stack, and what the stack decides acts on the train.

use super::cameras::{Clock, Taken};
use super::devices::{Device, Look};
use super::eyes::Eyes;
use super::health::{EYES, Health};
use super::motion::MotionSensors;
use super::outcome::Outcome;
use super::ride::Ride;
use super::shots::{Shot, Shots, What};
use super::watch::{Costs, Watchers};
use super::{
    End, Event, Exposure, OWN_TRAIN, Observer, Opening, RunOptions, SessionError, Source, Summary,
    TrainPoint,
};
use crate::bus::{CameraFault, CameraHealth, Frame, SimTime, TrainCommand, TrainReport};
use crate::scenario::Scenario;
use crate::stack::protection::Protection;
use crate::twin::comms::Comms;
use crate::twin::physics::{PhysicsError, World};
use crate::twin::random::Stream;
use crate::twin::render::{Job, Renderer, View};
use image::GrayImage;
use nalgebra::Vector3;

/// Cycles of the protection a second.
const PROTECTION_HZ: f64 = 10.0;
/// How often a second the stack looks whether a camera has fallen silent.
const WATCH_HZ: f64 = 10.0;
/// Samples of the truth shown to observers a second.
const TRUTH_HZ: f64 = 50.0;
/// Positions of everything else shown to observers a second.
const BODIES_HZ: f64 = 10.0;

/// One run under way.
pub struct Run<'s> {
    scenario: &'s Scenario,
    world: World,
    shots: Shots<'s>,
    motion: MotionSensors,
    eyes: Option<Eyes>,
    devices: Vec<Device>,
    comms: Comms,
    protection: Protection,
    protection_clock: Clock,
    command: TrainCommand,
    truth_clock: Clock,
    bodies_clock: Clock,
    stereo_frames: u32,
    wayside_frames: u32,
    outcome: Outcome,
    ride: Ride,
    health: Health,
    watch_clock: Clock,
    cost: Costs,
}

impl<'s> Run<'s> {
    /// At time zero.
    pub fn new(
        scenario: &'s Scenario,
        renderer: &'s mut dyn Renderer,
    ) -> Result<Self, SessionError> {
        let seed = scenario.seed;
        let (tunnel, map) = (&scenario.tunnel, scenario.map());
        let world = World::new(tunnel.clone(), &scenario.physics, seed, 0)?;
        let radio = Stream::new(seed, 0, "radio");
        let rig = scenario.rig.as_ref();
        let eyes = rig
            .filter(|_| !scenario.physics.trains.is_empty())
            .map(|rig| Eyes::new(scenario, rig, &map));
        let mut health = Health::default();
        let eye_names = EYES.iter().filter(|_| eyes.is_some()).copied();
        let devices = scenario.wayside.iter().map(|p| p.calibration.name.as_str());
        eye_names
            .chain(devices)
            .for_each(|name| health.expect(name));
        Ok(Self {
            scenario,
            world,
            shots: Shots::new(renderer, scenario.stack.latency_ms),
            motion: MotionSensors::new(scenario),
            eyes,
            devices: Device::all(scenario, &map),
            comms: Comms::new(&scenario.radio, &tunnel.base_stations, radio),
            protection: Protection::new(&scenario.stack.protection, map),
            protection_clock: Clock::new(PROTECTION_HZ),
            command: TrainCommand::default(),
            truth_clock: Clock::new(TRUTH_HZ),
            bodies_clock: Clock::new(BODIES_HZ),
            stereo_frames: 0,
            wayside_frames: 0,
            outcome: Outcome::default(),
            ride: Ride::default(),
            health,
            watch_clock: Clock::new(WATCH_HZ),
            cost: Costs::default(),
        })
    }

    /// To the end of the scenario.
    pub fn run(
        mut self,
        options: &RunOptions<'_>,
        observers: &mut [&mut dyn Observer],
    ) -> Result<Summary, SessionError> {
        let mut watchers = Watchers::new(observers);
        self.open(&mut watchers)?;
        let end = self.steps(options, &mut watchers);
        watchers.each(|o| o.close())?;
        let derailed = matches!(
            end,
            Err(SessionError::Physics(PhysicsError::Derailed { .. }))
        );
        let end = match end {
            Ok(end) => end,
            Err(SessionError::Physics(error)) => End::Failed(error.to_string()),
            Err(other) => return Err(other),
        };
        Ok(self.summary(end, derailed, &watchers))
    }

    fn open(&self, watchers: &mut Watchers<'_, '_>) -> Result<(), SessionError> {
        let devices = self.devices.iter();
        let calibrations: Vec<_> = devices.map(|d| d.calibration().clone()).collect();
        let rig = self.scenario.rig.as_ref().map(|r| r.calibration());
        let opening = Opening {
            scenario: &self.scenario.name,
            seed: self.scenario.seed,
            tunnel: &self.scenario.tunnel,
            rig: rig.as_ref(),
            wayside: &calibrations,
            car_half_extents_m: self
                .world
                .car_half_extents_m(OWN_TRAIN)
                .unwrap_or(Vector3::zeros()),
            cars: self
                .world
                .train(OWN_TRAIN)
                .map_or(0, |t| t.world_from_cars.len()),
            radar: self.motion.has_radar(),
            protection: self.world.head_m(OWN_TRAIN).is_some(),
        };
        watchers.each(|o| o.open(&opening))?;
        Ok(())
    }

    fn steps(
        &mut self,
        options: &RunOptions<'_>,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<End, SessionError> {
        let mut next_progress_s = 0.0;
        loop {
            let time_s = self.world.time().secs();
            if options.stopped() {
                return Ok(End::Interrupted);
            }
            if time_s >= self.scenario.duration_s || self.stood_long_enough() {
                return Ok(End::Complete);
            }
            if let Some(progress) = options.progress.filter(|_| time_s >= next_progress_s) {
                progress(time_s);
                next_progress_s = time_s + 0.1;
            }
            self.step(watchers)?;
        }
    }

    fn step(&mut self, watchers: &mut Watchers<'_, '_>) -> Result<(), SessionError> {
        let before_m = self.world.head_m(OWN_TRAIN);
        let (world, command) = (&mut self.world, &self.command);
        let hits = world.impacts().len();
        self.cost.physics.time(|| world.step(&[*command])).0?;
        let now = self.world.time();
        let hits = self.world.impacts()[hits..].iter();
        for hit in hits.filter(|hit| hit.train == OWN_TRAIN) {
            let (with, kmh) = (&hit.with, 3.6 * hit.speed_mps);
            watchers.show(&Event::Note(now, &format!("hit {with} at {kmh:.1} km/h")))?;
        }
        self.sample_motion(watchers)?;
        self.meet_messages(now, before_m, watchers)?;
        self.trigger(now, watchers)?;
        while let Some((shot, images)) = self.shots.due(now, &mut self.cost)? {
            self.deliver(now, shot, images, watchers)?;
        }
        self.watch_cameras(now, watchers)?;
        self.protect(now, watchers)?;
        self.show_truth(now, watchers)
    }

    /// Inertial unit, odometer, radar.
    fn sample_motion(&mut self, watchers: &mut Watchers<'_, '_>) -> Result<(), SessionError> {
        let samples = self.motion.sample(&self.world, OWN_TRAIN);
        let mut positioner = self.eyes.as_mut().map(|e| &mut e.positioner);
        if let (Some(sample), Some(positioner)) = (&samples.imu, &mut positioner) {
            positioner.on_imu(sample);
        }
        if let Some(sample) = &samples.odometer {
            self.protection.on_odometer(sample);
            if let Some(positioner) = &mut positioner {
                positioner.on_odometer(sample);
            }
            watchers.show(&Event::Odometer(sample))?;
        }
        if let Some(sample) = &samples.doppler {
            watchers.show(&Event::Doppler(sample))?;
        }
        Ok(())
    }

    /// Balises under the train and messages in the air.
    fn meet_messages(
        &mut self,
        now: SimTime,
        before_m: Option<f64>,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let (Some(before_m), Some(head_m)) = (before_m, self.world.head_m(OWN_TRAIN)) else {
            return Ok(());
        };
        let tunnel = self.scenario.tunnel.clone();
        for name in tunnel.balises_passed(before_m, head_m) {
            self.protection.on_balise(name, now);
            if let Some(delivery) = self.comms.read_balise(now, name) {
                self.protection.on_delivery(&delivery);
                watchers.show(&Event::Delivery(&delivery))?;
            }
        }
        while let Some(delivery) = self.comms.receive(now, head_m) {
            self.protection.on_delivery(&delivery);
            watchers.show(&Event::Delivery(&delivery))?;
        }
        Ok(())
    }

    /// Frames whose last row has closed go to the renderer.
    fn trigger(
        &mut self,
        now: SimTime,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        if let Some(eyes) = &mut self.eyes
            && let Some((number, start)) = eyes.due(now)
        {
            let world = &self.world;
            let mut views = eyes
                .camera
                .views(number, start, |t| world.vehicle_at(OWN_TRAIN, t))
                .ok_or(SessionError::PoseForgotten(start.secs()))?;
            let with = eyes.expose(&mut views);
            let shot = Shot {
                taken: Taken {
                    number,
                    start,
                    with,
                },
                what: What::Pair,
                late_s: eyes.late_s(start),
            };
            self.submit(now, views.into(), shot, watchers)?;
        }
        for k in 0..self.devices.len() {
            self.devices[k].sweep(&self.world);
            if let Some((taken, view)) = self.devices[k].due(now) {
                let what = What::Wayside(k, self.devices[k].look(&self.world));
                let shot = Shot {
                    taken,
                    what,
                    late_s: self.devices[k].late_s(taken.start),
                };
                self.submit(now, vec![view], shot, watchers)?;
            }
        }
        Ok(())
    }

    fn submit(
        &mut self,
        now: SimTime,
        views: Vec<View>,
        shot: Shot,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let source = match shot.what {
            What::Pair => Source::Rig,
            What::Wayside(k, _) => Source::Wayside(k),
        };
        let without = (source == Source::Rig).then_some(OWN_TRAIN);
        let (bodies, owners) = self.world.owned_bodies(without);
        let train = views.first().and_then(|view| self.train_at(view.mid()));
        let job = Job {
            time: now,
            bodies,
            headlights: self.world.headlights(),
            views,
            ..Job::default()
        };
        watchers.show(&Event::Exposure(&Exposure {
            source,
            number: shot.taken.number,
            job: &job,
            owners: &owners,
            train,
        }))?;
        Ok(self.shots.submit(&job, shot, &mut self.cost)?)
    }

    /// The train at a time of the recent past, by the speed that it has now.
    fn train_at(&self, time: SimTime) -> Option<TrainPoint> {
        Some(TrainPoint {
            chainage_m: self.world.chainage_at(OWN_TRAIN, time)?,
            speed_mps: self.world.train(OWN_TRAIN)?.speed_mps,
            world_from_vehicle: self.world.vehicle_at(OWN_TRAIN, time)?,
        })
    }

    /// Images reach the stack.
    fn deliver(
        &mut self,
        now: SimTime,
        shot: Shot,
        mut images: Vec<GrayImage>,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let Shot { taken, what, .. } = shot;
        match what {
            What::Pair => self.judge_pair(&taken, images, watchers),
            What::Wayside(k, look) => {
                let image = images.pop().ok_or(SessionError::Images(1, 0))?;
                let frame = self.devices[k].frame(&taken, image);
                self.judge_wayside(now, k, &frame, &look, watchers)
            }
        }
    }

    fn judge_pair(
        &mut self,
        taken: &Taken,
        images: Vec<GrayImage>,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let (Some(eyes), world) = (&mut self.eyes, &self.world) else {
            return Ok(());
        };
        let watch = &mut self.cost.stack;
        let (vehicle_at, head_at) = (
            |t| world.vehicle_at(OWN_TRAIN, t),
            |t| world.chainage_at(OWN_TRAIN, t),
        );
        let read = eyes.read(taken, images, watch, vehicle_at, head_at)?;
        self.stereo_frames += 1;
        if let Some(fix) = read.report.best_fix() {
            self.protection.on_fix(fix);
        }
        for (eye, health) in EYES.into_iter().zip(read.report.eyes) {
            note(&mut self.health, watchers, eye, taken.start, health)?;
        }
        watchers.show(&Event::Pair(&read.images, &read.report, &read.truths_m))?;
        Ok(())
    }

    fn judge_wayside(
        &mut self,
        now: SimTime,
        k: usize,
        frame: &Frame,
        look: &Look,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let (comms, watch) = (&mut self.comms, &mut self.cost.stack);
        let report = self.devices[k].judge(frame, look, now, comms, watch);
        self.wayside_frames += 1;
        let name = &self.devices[k].calibration().name;
        note(&mut self.health, watchers, name, frame.start, report.camera)?;
        watchers.show(&Event::Wayside(k, frame, &report))?;
        Ok(())
    }

    /// Cameras that have fallen silent have no frames to tell of it.
    fn watch_cameras(
        &mut self,
        now: SimTime,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        if self.watch_clock.due(now, 0.0).is_none() {
            return Ok(());
        }
        let silent = CameraHealth {
            fault: Some(CameraFault::Silent),
            lost: 0,
        };
        if self
            .eyes
            .as_ref()
            .is_some_and(|e| e.positioner.is_silent(now))
        {
            for eye in EYES {
                note(&mut self.health, watchers, eye, now, silent)?;
            }
        }
        for device in &mut self.devices {
            if let Some(health) = device.wait(now, &mut self.comms) {
                let name = &device.calibration().name;
                note(&mut self.health, watchers, name, now, health)?;
            }
        }
        Ok(())
    }

    /// A cycle of the protection; its command acts from the next step on.
    fn protect(
        &mut self,
        now: SimTime,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        if self.world.head_m(OWN_TRAIN).is_none() || self.protection_clock.due(now, 0.0).is_none() {
            return Ok(());
        }
        let protection = &mut self.protection;
        let report = self.cost.stack.time(|| protection.cycle(now)).0;
        let aim_mps = (self.scenario.physics.trains.first())
            .map_or(f64::INFINITY, |t| t.cruise_speed_kmh / 3.6);
        self.outcome.on_cycle(now, &report, aim_mps);
        self.command = report.command;
        if let (Some(chainage_m), Some(head_m)) = (report.position_m, self.world.head_m(OWN_TRAIN))
        {
            let train = TrainReport {
                chainage_m,
                speed_mps: report.speed_mps,
                time: now,
            };
            self.comms.report_train(now, head_m, train);
        }
        watchers.show(&Event::Protection(&report))?;
        Ok(())
    }

    fn show_truth(
        &mut self,
        now: SimTime,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        if self.truth_clock.due(now, 0.0).is_some()
            && let Some(train) = self.world.train(OWN_TRAIN)
        {
            let line = &self.scenario.tunnel.alignment;
            self.outcome.on_motion(&train, &self.world, line);
            self.ride.on_motion(&train);
            if let Some(eyes) = &mut self.eyes {
                eyes.score.head_at(train.chainage_m);
            }
            let vehicle_from_left = self.eyes.as_ref().map(|e| e.camera.rig.vehicle_from_left);
            let left = vehicle_from_left.map(|v| train.world_from_vehicle * v);
            watchers.show(&Event::Train(&train, left.as_ref()))?;
        }
        if self.bodies_clock.due(now, 0.0).is_some() {
            watchers.show(&Event::Bodies(now, &self.world.bodies(Some(OWN_TRAIN))))?;
        }
        Ok(())
    }

    fn stood_long_enough(&self) -> bool {
        let stood_s = self.outcome.stood_s(self.world.time());
        let limit_s = self.scenario.stop_after_standstill_s;
        limit_s
            .zip(stood_s)
            .is_some_and(|(limit, stood)| stood >= limit)
    }

    fn summary(mut self, end: End, derailed: bool, watchers: &Watchers<'_, '_>) -> Summary {
        let eyes = self.eyes.as_mut();
        let dark_lamps = eyes
            .map(|e| std::mem::take(&mut e.dark_lamps))
            .unwrap_or_default();
        let scores = self.devices.into_iter().map(Device::into_score);
        let wayside = scores.reduce(|mut a, b| {
            a.add(b);
            a
        });
        let train = self.scenario.physics.trains.first();
        let stop_at_m = train.and_then(|t| t.stop_at_m);
        let simulated_s = self.world.time().secs();
        let backend = self.shots.backend();
        let cost = &self.cost;
        let speed = Summary::new(self.scenario, end, simulated_s, backend, cost, watchers);
        Summary {
            stereo_frames: self.stereo_frames,
            wayside_frames: self.wayside_frames,
            dark_lamps,
            positioning: self.eyes.map(|e| e.score.finish()).unwrap_or_default(),
            wayside: wayside.map(|w| w.finish()),
            cameras: self.health.finish(),
            protection: self.outcome.protection(&self.world),
            train: self.ride.finish(&self.world, stop_at_m, derailed),
            ..speed
        }
    }
}

/// Takes down what the stack says of a camera, and shows it where it is new.
fn note(
    health: &mut Health,
    watchers: &mut Watchers<'_, '_>,
    camera: &str,
    time: SimTime,
    said: CameraHealth,
) -> Result<(), SessionError> {
    if health.note(camera, time, said) {
        watchers.show(&Event::Camera(time, camera, said.fault))?;
    }
    Ok(())
}
