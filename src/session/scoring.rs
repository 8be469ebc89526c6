//! What a session writes down as it goes: what equipment says is held against the truth, and shown to
//! observers.

use super::scheduler::Session;
use super::train_score::TrainScore;
use super::{
    End, Event, Opening, Physics, SessionError, Summary, TrainOpening, TrainSummary, WallShares,
};
use crate::bus::{
    CameraHealth, Content, EYES, LedReport, Message, Node, OccupancyReport, SimTime, TrainId,
    WaysideReport,
};
use crate::scenario::OnboardSettings;

impl Session<'_, '_> {
    pub(super) fn open(&mut self) -> Result<(), SessionError> {
        let posts = self.scenario.wayside.iter();
        let calibrations: Vec<_> = posts.map(|post| post.calibration.clone()).collect();
        let opening = |onboard: &OnboardSettings| TrainOpening {
            id: onboard.id(),
            rig: onboard.rig.as_ref().map(|rig| rig.calibration()),
            car_half_extents_m: (self.world.car_half_extents_m(onboard.id())).unwrap_or_default(),
            cars: (self.world.train(onboard.id())).map_or(0, |t| t.world_from_cars.len()),
            radar: onboard.doppler.is_some(),
            occupancy: onboard.tells_its_track(),
            protection: onboard.protects(),
        };
        let trains: Vec<_> = self.scenario.onboard.iter().map(opening).collect();
        let opening = Opening {
            scenario: &self.scenario.file.name,
            seed: self.scenario.file.seed,
            tunnel: &self.scenario.tunnel,
            trains: &trains,
            wayside: &calibrations,
        };
        self.observers.each(|o| o.open(&opening))?;
        Ok(())
    }

    /// Scores what equipment says, and shows it.
    pub(super) fn score_message(
        &mut self,
        now: SimTime,
        message: &Message,
    ) -> Result<(), SessionError> {
        let sender = &message.sender;
        if let (Content::Protection(report), Node::Train(id)) = (&message.content, sender)
            && let Some(train) = self.trains.get_mut(id)
        {
            train.on_protection(now, report);
        }
        match (&message.content, sender) {
            (Content::Led(report), Node::Train(id)) => self.score_led(*id, report),
            (Content::Occupancy(report), Node::Train(id)) => self.score_occupancy(*id, report),
            (Content::Wayside(report), Node::Post(_)) => self.score_wayside(now, sender, report),
            (Content::Camera(status), _) => {
                self.note_camera(sender, &status.camera, now, status.health)
            }
            _ => Ok(self.observers.show(&Event::Message {
                node: sender,
                message,
            })?),
        }
    }

    fn score_led(&mut self, id: TrainId, report: &LedReport) -> Result<(), SessionError> {
        let node = Node::Train(id);
        for (eye, health) in EYES.into_iter().zip(report.eyes) {
            self.note_camera(&node, eye, report.time, health)?;
        }
        let (world, images) = (&self.world, &self.images);
        let delivered = images.iter().find_map(|d| match &d.message.content {
            Content::Pair(pair)
                if d.message.sender == node && pair.left.number == report.number =>
            {
                Some((pair, d.cost_ms))
            }
            _ => None,
        });
        if let (Some(train), Some((pair, cost_ms))) = (self.trains.get_mut(&id), delivered) {
            let truths_m = train.on_led(report, cost_ms, world)?;
            self.observers.show(&Event::Pair {
                train: id,
                pair,
                report,
                true_chainages_m: &truths_m,
            })?;
        }
        Ok(())
    }

    fn score_occupancy(
        &mut self,
        train: TrainId,
        report: &OccupancyReport,
    ) -> Result<(), SessionError> {
        let score = self.trains.get_mut(&train);
        let judged = score.and_then(|score| score.on_occupancy(report, &self.world));
        self.observers.show(&Event::Occupancy {
            train,
            report,
            class: judged.and_then(|judged| judged.class),
            truth: judged.map(|judged| judged.truth),
        })?;
        Ok(())
    }

    fn score_wayside(
        &mut self,
        now: SimTime,
        node: &Node,
        report: &WaysideReport,
    ) -> Result<(), SessionError> {
        let post = self.posts.index(node);
        let delivered = self.images.iter().find_map(|d| match &d.message.content {
            Content::Frame(frame) if d.message.sender == *node && frame.number == report.number => {
                Some((frame, d.cost_ms))
            }
            _ => None,
        });
        if let Some((frame, cost_ms)) = delivered {
            self.posts.report(post, report, now, cost_ms);
            self.observers.show(&Event::Wayside {
                post,
                frame,
                report,
            })?;
        }
        let Node::Post(name) = node else {
            return Ok(());
        };
        self.note_camera(node, name, report.time, report.camera)
    }

    /// Takes down what equipment says of a camera, and shows it where it is new.
    fn note_camera(
        &mut self,
        node: &Node,
        camera: &str,
        time: SimTime,
        health: CameraHealth,
    ) -> Result<(), SessionError> {
        let all = match node {
            Node::Train(id) => self.trains.get_mut(id).map(|train| &mut train.health),
            _ => Some(&mut self.posts.health),
        };
        if all.is_some_and(|all| all.note(camera, time, health)) {
            self.observers.show(&Event::Camera {
                time,
                node,
                camera,
                fault: health.fault,
            })?;
        }
        Ok(())
    }

    pub(super) fn show_truth(&mut self, now: SimTime) -> Result<(), SessionError> {
        if self.truth_ticker.due(now, 0.0).is_some() {
            let world = &self.world;
            for (id, score) in &mut self.trains {
                if let Some(truth) = world.train(*id) {
                    score.on_motion(&truth, world);
                    let left_eye = score.left_eye(world);
                    self.observers.show(&Event::Train {
                        train: *id,
                        truth: &truth,
                        left_eye: left_eye.as_ref(),
                    })?;
                }
            }
        }
        if self.bodies_ticker.due(now, 0.0).is_some() {
            let (bodies, _) = self.world.owned_bodies(self.world.train_ids().next());
            self.observers.show(&Event::Bodies {
                time: now,
                bodies: &bodies,
            })?;
            let switches = 0..self.world.network().switches.len();
            let shares: Vec<f64> = switches.map(|k| self.world.switch_share(k)).collect();
            if shares != self.blade_shares {
                self.blade_shares = shares;
                let (bodies, _) = self.world.blades(None);
                self.observers.show(&Event::Blades {
                    time: now,
                    bodies: &bodies,
                })?;
            }
        }
        Ok(())
    }

    /// Time that the pairs of a bench take.
    fn pairs_s(&self) -> f64 {
        let rig = self.scenario.onboard.first().and_then(|o| o.rig.as_ref());
        let pairs = self
            .trains
            .get(&TrainId::default())
            .map_or(0, TrainScore::pairs);
        rig.map_or(0.0, |rig| {
            SimTime::from_secs(f64::from(pairs) / rig.pairs_per_s).secs()
        })
    }

    pub(super) fn summary(mut self, end: End, derailed: Option<TrainId>) -> Summary {
        let simulated_s = match &self.bench {
            Some(_) => self.pairs_s(),
            None => self.world.time().secs(),
        };
        let (scenario, world, cost) = (&self.scenario.file, &self.world, &self.cost);
        let wall_s = self.observers.wall_s();
        let trains = self.trains.into_iter();
        let trains = trains.map(|(id, score)| score.finish(world, derailed == Some(id)));
        let mut trains: Vec<TrainSummary> = trains.collect();
        let first = trains.first().cloned().unwrap_or_default();
        // One train has no list beside the figures at the top.
        if trains.len() == 1 {
            trains.clear();
        }
        let mut cameras = std::mem::take(&mut self.posts.health.cameras);
        cameras.extend(first.cameras);
        Summary {
            scenario: scenario.name.clone(),
            seed: scenario.seed,
            end,
            simulated_s,
            wall_s,
            real_time_factor: simulated_s / wall_s,
            renderer: self.imaging.backend(),
            stereo_frames: first.stereo_frames,
            wayside_frames: self.posts.frames,
            physics: Physics {
                us_per_step: 1e6 * cost.physics.total_s / cost.physics.times.max(1) as f64,
            },
            wall_shares_s: WallShares {
                physics_s: cost.physics.total_s,
                submit_s: cost.submit.total_s,
                wait_s: cost.wait.total_s,
                stack_s: cost.stack.total_s,
                record_s: self.observers.watch.total_s,
            },
            positioning: first.positioning,
            wayside: self.posts.finish(),
            cameras,
            dark_lamps: first.dark_lamps,
            occupancy: first.occupancy,
            protection: first.protection,
            train: first.train,
            incidents: world.incidents().to_vec(),
            trains,
        }
    }
}
