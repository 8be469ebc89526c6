//! A run with a train: every step the world moves, sensors sample, cameras trigger, images that
//! are due reach the stack, and what the stack decides acts on the train.
//!
//! An image is handed to the renderer when its last row has closed, and reaches the stack
//! `latency_ms` later; the renderer draws in between, while the world goes on. So the order of
//! things does not depend on how fast anything is.

use super::WallShares;
use super::cameras::{Clock, StereoCamera, pair};
use super::devices::{Device, Look};
use super::score::PositioningScore;
use super::summary::{self, Summary};
use super::watch::{Stopwatch, Watchers, now};
use super::{End, Event, Observer, Opening, Physics, RunOptions, SessionError, TrainTruth};
use crate::bus::{BrakeDemand, Frame, Method, SimTime, TrainCommand, TrainReport};
use crate::scenario::Scenario;
use crate::stack::positioning::LedPositioner;
use crate::stack::protection::Protection;
use crate::twin::comms::Comms;
use crate::twin::physics::{TrainState, World};
use crate::twin::random::Stream;
use crate::twin::render::{Job, Renderer, View};
use crate::twin::sensors::{Imu, Odometer};
use image::GrayImage;
use nalgebra::{Isometry3, Vector3};
use std::collections::VecDeque;

/// Cycles of the protection a second.
const PROTECTION_HZ: f64 = 10.0;
/// Samples of the truth shown to observers a second.
const TRUTH_HZ: f64 = 50.0;
/// Positions of everything else shown to observers a second.
const BODIES_HZ: f64 = 10.0;

/// Images on their way from shutter to stack.
struct Pending {
    number: u32,
    start: SimTime,
    deliver: SimTime,
    what: What,
}

enum What {
    Pair,
    Wayside(usize, Look),
}

/// The eyes on the train and what reads them.
struct Eyes {
    camera: StereoCamera,
    clock: Clock,
    positioner: LedPositioner,
    score: PositioningScore,
}

/// One run under way.
pub struct Run<'s> {
    scenario: &'s Scenario,
    world: World,
    renderer: Box<dyn Renderer>,
    imu: Imu,
    imu_clock: Clock,
    odometer: Odometer,
    odometer_clock: Clock,
    eyes: Option<Eyes>,
    devices: Vec<Device>,
    comms: Comms,
    protection: Protection,
    protection_clock: Clock,
    command: TrainCommand,
    truth_clock: Clock,
    bodies_clock: Clock,
    pending: VecDeque<Pending>,
    outcome: Outcome,
    cost: Costs,
}

/// What a run came to.
#[derive(Default)]
struct Outcome {
    /// An obstacle ahead permits less than the driver aims at.
    slowed_by_obstacle: bool,
    brake_commanded: Option<SimTime>,
    stopped: Option<SimTime>,
    has_run: bool,
    standing_since: Option<SimTime>,
    stereo_frames: u32,
    wayside_frames: u32,
    steps: u64,
}

#[derive(Default)]
struct Costs {
    physics: Stopwatch,
    submit: Stopwatch,
    wait: Stopwatch,
    stack: Stopwatch,
}

impl<'s> Run<'s> {
    /// At time zero.
    pub fn new(scenario: &'s Scenario, renderer: Box<dyn Renderer>) -> Result<Self, SessionError> {
        let seed = scenario.seed;
        let stream = |name: &str| Stream::new(seed, 0, name);
        let map = scenario.tunnel.clone();
        let world = World::new(map.clone(), &scenario.physics, seed, 0)?;
        let imu = Imu::new(&scenario.imu, seed, 0);
        let odometer = Odometer::new(&scenario.odometer, seed, 0);
        let eyes = (scenario
            .rig
            .as_ref()
            .filter(|_| scenario.physics.train.is_some()))
        .map(|rig| Eyes {
            camera: StereoCamera::new(rig, seed),
            clock: Clock::new(rig.pairs_per_s),
            positioner: LedPositioner::new(&scenario.stack.led, rig.calibration(), map.clone()),
            score: PositioningScore::new(map.clone(), &Method::ALL),
        });
        Ok(Self {
            scenario,
            world,
            renderer,
            imu_clock: Clock::new(1.0 / imu.period_s()),
            imu,
            odometer_clock: Clock::new(1.0 / odometer.period_s()),
            odometer,
            eyes,
            devices: Device::all(scenario),
            comms: Comms::new(&scenario.radio, &map.base_stations, stream("radio")),
            protection: Protection::new(&scenario.stack.protection, map),
            protection_clock: Clock::new(PROTECTION_HZ),
            command: TrainCommand::default(),
            truth_clock: Clock::new(TRUTH_HZ),
            bodies_clock: Clock::new(BODIES_HZ),
            pending: VecDeque::new(),
            outcome: Outcome::default(),
            cost: Costs::default(),
        })
    }

    /// To the end of the scenario.
    pub fn run(
        mut self,
        options: &RunOptions<'_>,
        observers: &mut [&mut dyn Observer],
    ) -> Result<Summary, SessionError> {
        let begin = now();
        let mut watchers = Watchers::new(observers);
        self.open(&mut watchers)?;
        let end = self.steps(options, &mut watchers);
        watchers.each(|o| o.close())?;
        let end = match end {
            Ok(end) => end,
            Err(SessionError::Physics(error)) => End::Failed(error.to_string()),
            Err(other) => return Err(other),
        };
        Ok(self.summary(end, begin.elapsed().as_secs_f64(), watchers.watch))
    }

    fn open(&self, watchers: &mut Watchers<'_, '_>) -> Result<(), SessionError> {
        let calibrations: Vec<_> = self
            .devices
            .iter()
            .map(|d| d.calibration().clone())
            .collect();
        let rig = self.scenario.rig.as_ref().map(|r| r.calibration());
        let opening = Opening {
            scenario: &self.scenario.name,
            seed: self.scenario.seed,
            tunnel: &self.scenario.tunnel,
            rig: rig.as_ref(),
            wayside: &calibrations,
            car_half_extents_m: self.world.car_half_extents_m().unwrap_or(Vector3::zeros()),
            cars: self.world.train().map_or(0, |t| t.world_from_cars.len()),
            protection: self.world.head_m().is_some(),
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
        let before_m = self.world.head_m();
        let (world, command) = (&mut self.world, &self.command);
        self.cost.physics.time(|| world.step(command)).0?;
        self.outcome.steps += 1;
        let now = self.world.time();
        self.sample_motion(now);
        self.meet_messages(now, before_m, watchers)?;
        self.trigger(now)?;
        while self.pending.front().is_some_and(|p| p.deliver <= now) {
            self.deliver(now, watchers)?;
        }
        self.protect(now, watchers)?;
        self.show_truth(now, watchers)
    }

    /// Inertial unit and odometer.
    fn sample_motion(&mut self, now: SimTime) {
        let mut positioner = self.eyes.as_mut().map(|e| &mut e.positioner);
        if self.imu_clock.due(now, 0.0).is_some()
            && let Some(sample) = self.imu.sample(&self.world)
            && let Some(positioner) = &mut positioner
        {
            positioner.on_imu(&sample);
        }
        if self.odometer_clock.due(now, 0.0).is_some()
            && let Some(sample) = self.odometer.sample(&self.world)
        {
            self.protection.on_odometer(&sample);
            if let Some(positioner) = &mut positioner {
                positioner.on_odometer(&sample);
            }
        }
    }

    /// Balises under the train and messages in the air.
    fn meet_messages(
        &mut self,
        now: SimTime,
        before_m: Option<f64>,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let (Some(before_m), Some(head_m)) = (before_m, self.world.head_m()) else {
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
    fn trigger(&mut self, now: SimTime) -> Result<(), SessionError> {
        if let Some(eyes) = &mut self.eyes
            && let Some((number, start)) = eyes.clock.due(now, eyes.camera.delay_s())
        {
            let world = &self.world;
            let views = eyes
                .camera
                .views(number, start, |t| world.vehicle_at(t))
                .ok_or(SessionError::PoseForgotten(start.secs()))?;
            self.submit(now, number, start, views.into(), What::Pair)?;
            self.outcome.stereo_frames += 1;
        }
        for k in 0..self.devices.len() {
            if let Some((number, start, view)) = self.devices[k].due(now) {
                let look = self.devices[k].look(&self.world, start, number);
                self.submit(now, number, start, vec![view], What::Wayside(k, look))?;
                self.outcome.wayside_frames += 1;
            }
        }
        Ok(())
    }

    fn submit(
        &mut self,
        now: SimTime,
        number: u32,
        start: SimTime,
        views: Vec<View>,
        what: What,
    ) -> Result<(), SessionError> {
        let mut bodies = self.world.bodies();
        if matches!(what, What::Wayside(..)) {
            bodies.extend(self.world.train_bodies());
        }
        let job = Job {
            time: now,
            bodies,
            headlights: self.world.headlights(),
            views,
        };
        let renderer = &mut self.renderer;
        self.cost.submit.time(|| renderer.submit(&job)).0?;
        // Results arrive in the order of submission, so none is due before the one ahead of it.
        let own = now.plus(1e-3 * self.scenario.stack.latency_ms);
        let ahead = self.pending.back().map_or(own, |p| p.deliver);
        self.pending.push_back(Pending {
            number,
            start,
            deliver: own.max(ahead),
            what,
        });
        Ok(())
    }

    /// The oldest images reach the stack.
    fn deliver(
        &mut self,
        now: SimTime,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let Some(pending) = self.pending.pop_front() else {
            return Ok(());
        };
        let renderer = &mut self.renderer;
        let images = self.cost.wait.time(|| renderer.collect()).0?;
        let (number, start) = (pending.number, pending.start);
        match pending.what {
            What::Pair => self.judge_pair(number, start, images, watchers),
            What::Wayside(k, look) => {
                self.judge_wayside(now, k, number, start, &look, images, watchers)
            }
        }
    }

    fn judge_pair(
        &mut self,
        number: u32,
        start: SimTime,
        images: Vec<GrayImage>,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let (Some(eyes), Ok(images)) = (&mut self.eyes, images.try_into()) else {
            return Ok(());
        };
        let images = pair(number, start, images);
        let positioner = &mut eyes.positioner;
        let (report, seconds) = self.cost.stack.time(|| positioner.on_pair(&images));
        let (world, rig) = (&self.world, &eyes.camera.rig);
        let left_at = |t| Some(world.vehicle_at(t)? * rig.vehicle_from_left);
        let intrinsics = rig.camera.intrinsics;
        eyes.score
            .report(&report, 1e3 * seconds, &intrinsics, left_at);
        let mut truths_m = Vec::with_capacity(report.fixes.len());
        for fix in &report.fixes {
            let truth_m = world
                .chainage_at(fix.time)
                .ok_or(SessionError::PoseForgotten(fix.time.secs()))?;
            eyes.score.fix(fix, truth_m);
            truths_m.push(truth_m);
            if fix.method == Method::Paper {
                self.protection.on_fix(fix);
            }
        }
        watchers.show(&Event::Pair(&images, &report, &truths_m))?;
        Ok(())
    }

    #[allow(
        clippy::too_many_arguments,
        reason = "one call, each a plain value of the frame"
    )]
    fn judge_wayside(
        &mut self,
        now: SimTime,
        k: usize,
        number: u32,
        start: SimTime,
        look: &Look,
        mut images: Vec<GrayImage>,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        let Some(image) = images.pop() else {
            return Ok(());
        };
        let frame = Frame {
            number,
            start,
            image,
        };
        let (comms, watch) = (&mut self.comms, &mut self.cost.stack);
        let report = self.devices[k].judge(&frame, look, now, comms, watch);
        watchers.show(&Event::Wayside(k, start, &frame.image, &report))?;
        Ok(())
    }

    /// A cycle of the protection; its command acts from the next step on.
    fn protect(
        &mut self,
        now: SimTime,
        watchers: &mut Watchers<'_, '_>,
    ) -> Result<(), SessionError> {
        if self.world.head_m().is_none() || self.protection_clock.due(now, 0.0).is_none() {
            return Ok(());
        }
        let protection = &mut self.protection;
        let report = self.cost.stack.time(|| protection.cycle(now)).0;
        let aim_mps = (self.scenario.physics.train.as_ref())
            .map_or(f64::INFINITY, |t| t.cruise_speed_kmh / 3.6);
        self.outcome.slowed_by_obstacle =
            report.authority_end_m.is_some() && report.permitted_mps < aim_mps;
        if report.command.brake != BrakeDemand::None {
            self.outcome.brake_commanded.get_or_insert(now);
        }
        self.command = report.command;
        if let (Some(chainage_m), Some(head_m)) = (report.position_m, self.world.head_m()) {
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
            && let Some(train) = self.world.train()
        {
            self.note_motion(now, &train);
            if let Some(eyes) = &mut self.eyes {
                eyes.score.head_at(train.chainage_m);
            }
            let rig = self.eyes.as_ref().map(|e| e.camera.rig.vehicle_from_left);
            watchers.show(&Event::Train(&truth(train, rig)))?;
        }
        if self.bodies_clock.due(now, 0.0).is_some() {
            watchers.show(&Event::Bodies(now, &self.world.bodies()))?;
        }
        Ok(())
    }

    /// Follows whether the train has run, and since when it stands.
    fn note_motion(&mut self, now: SimTime, train: &TrainState) {
        self.outcome.has_run |= !train.standing;
        // A driver who obeys brakes before the equipment has to.
        if self.outcome.slowed_by_obstacle && train.brake_mps2 > 0.0 {
            self.outcome.brake_commanded.get_or_insert(now);
        }
        if !train.standing {
            self.outcome.standing_since = None;
            return;
        }
        self.outcome.standing_since.get_or_insert(now);
        if self.outcome.brake_commanded.is_some() {
            self.outcome.stopped.get_or_insert(now);
        }
    }

    fn stood_long_enough(&self) -> bool {
        match (
            self.scenario.stop_after_standstill_s,
            self.outcome.standing_since,
        ) {
            (Some(limit_s), Some(since)) if self.outcome.has_run => {
                self.world.time().since(since) >= limit_s
            }
            _ => false,
        }
    }

    fn summary(self, end: End, wall_s: f64, record: Stopwatch) -> Summary {
        let simulated_s = self.world.time().secs();
        let head_m = self.world.head_m();
        let stop_margin_m = head_m
            .filter(|_| self.outcome.stopped.is_some())
            .and_then(|head_m| {
                (self.world.obstacles())
                    .map(|o| o.chainage_m - 0.5 * o.size_m.x - head_m)
                    .filter(|margin_m| *margin_m > -1.0)
                    .min_by(f64::total_cmp)
            });
        let protection = head_m.map(|_| summary::Protection {
            brake_commanded_s: self.outcome.brake_commanded.map(SimTime::secs),
            stopped_s: self.outcome.stopped.map(SimTime::secs),
            stop_margin_m,
            collision: self.world.collision().is_some(),
        });
        let wayside = self
            .devices
            .into_iter()
            .map(Device::into_score)
            .reduce(|mut a, b| {
                a.add(b);
                a
            });
        Summary {
            scenario: self.scenario.name.clone(),
            seed: self.scenario.seed,
            end,
            simulated_s,
            wall_s,
            real_time_factor: simulated_s / wall_s,
            renderer: self.renderer.backend(),
            stereo_frames: self.outcome.stereo_frames,
            wayside_frames: self.outcome.wayside_frames,
            physics: Physics {
                us_per_step: 1e6 * self.cost.physics.total_s / self.outcome.steps.max(1) as f64,
            },
            wall_shares_s: WallShares {
                physics_s: self.cost.physics.total_s,
                submit_s: self.cost.submit.total_s,
                wait_s: self.cost.wait.total_s,
                stack_s: self.cost.stack.total_s,
                record_s: record.total_s,
            },
            positioning: self.eyes.map(|e| e.score.finish()).unwrap_or_default(),
            wayside: wayside.map(|w| w.finish()),
            protection,
        }
    }
}

/// The truth as observers see it.
fn truth(train: TrainState, vehicle_from_left: Option<Isometry3<f64>>) -> TrainTruth {
    TrainTruth {
        time: train.time,
        chainage_m: train.chainage_m,
        speed_mps: train.speed_mps,
        accel_mps2: train.accel_mps2,
        world_from_vehicle: train.world_from_vehicle,
        world_from_left: vehicle_from_left.map(|v| train.world_from_vehicle * v),
        world_from_cars: train.world_from_cars,
        floor_accel_mps2: train.floor_accel_mps2,
        secondary_travel_m: train.secondary_travel_m,
    }
}
