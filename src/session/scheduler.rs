//! The loop of a session: every step the world moves, sensors sample, links deliver, images that are
//! due are read out, equipment works, and what it commands acts on the trains.

use super::bench::{Bench, Move};
use super::costs::{Costs, Observers};
use super::fitting::{Fitted, Fitting, Maps, Mounted, onboard_equipment};
use super::imaging::{Imaging, Pending};
use super::posts::Posts;
use super::train_score::TrainScore;
use super::{
    End, Event, Exposure, Observer, RunOptions, SessionError, Source, Summary, TrainPoint,
};
use crate::bus::{
    Content, Message, Node, Receiver, SimTime, Ticker, TrainCommand, TrainEnd, TrainId,
};
use crate::scenario::{OnboardSettings, Scenario};
use crate::twin::links::Links;
use crate::twin::physics::{PhysicsError, World};
use crate::twin::random::Stream;
use crate::twin::render::constants::SIGHT_M;
use crate::twin::render::{Job, Renderer};
use crate::twin::sensors::{Capture, Output};
use nalgebra::Point3;
use std::collections::BTreeMap;

/// Samples of the truth shown to observers a second.
const TRUTH_HZ: f64 = 50.0;
/// Positions of everything else shown to observers a second.
const BODIES_HZ: f64 = 10.0;

/// One session under way.
pub struct Session<'s, 'o> {
    pub(super) scenario: &'s Scenario,
    /// All that is true.
    pub(super) world: World,
    sensors: Vec<Mounted>,
    equipment: Vec<Fitted>,
    links: Links,
    pub(super) imaging: Imaging<'s>,
    /// Samples that take their time to the equipment, with when and where they arrive.
    delayed: BTreeMap<(SimTime, u64), (Node, Message)>,
    delayed_so_far: u64,
    /// Messages with images that were delivered in this step, and what working on each cost.
    pub(super) images: Vec<Delivered>,
    /// What each train is commanded by all of its equipment.
    commands: Vec<TrainCommand>,
    /// The last command of each piece of equipment.
    commanded: BTreeMap<(TrainId, usize), TrainCommand>,
    pub(super) trains: BTreeMap<TrainId, TrainScore>,
    pub(super) posts: Posts,
    pub(super) bench: Option<Bench>,
    pub(super) truth_ticker: Ticker,
    pub(super) bodies_ticker: Ticker,
    /// Of each switch the share (0 to 1) of its blades' way, as last shown.
    pub(super) blade_shares: Vec<f64>,
    pub(super) cost: Costs,
    pub(super) observers: Observers<'s, 'o>,
}

/// What trains are commanded before their equipment's first cycle: those without a protection, to run
/// as their drivers like.
fn first_commands(scenario: &Scenario) -> Vec<TrainCommand> {
    let mut commands = vec![TrainCommand::UNSUPERVISED; TrainId::MOST];
    let protected = scenario.onboard.iter().filter(|o| o.protects());
    for onboard in protected {
        if let Some(command) = commands.get_mut(onboard.id().index()) {
            *command = TrainCommand::default();
        }
    }
    commands
}

/// A message with images, for those who look at it after the equipment.
pub(super) struct Delivered {
    pub message: Message,
    pub cost_ms: f64,
}

impl<'s, 'o> Session<'s, 'o> {
    /// At time zero, with the equipment of the scenario and whatever `add` puts in.
    pub fn new(
        scenario: &'s Scenario,
        renderer: &'s mut dyn Renderer,
        add: &dyn Fn(&mut Fitting),
        observers: &'s mut [&'o mut dyn Observer],
    ) -> Result<Self, SessionError> {
        let seed = scenario.file.seed;
        let world = World::new(scenario.tunnel.clone(), &scenario.physics, seed, 0)?;
        let mut fitting = Fitting::new(scenario, &world);
        add(&mut fitting);
        let radio = Stream::new(seed, 0, "radio");
        let links = Links::new(
            &scenario.file.radio,
            &scenario.tunnel.network,
            fitting.nodes(),
            radio,
        );
        let latency_ms = match scenario.file.bench {
            // The rig goes on when its pairs have been read.
            Some(_) => 0.0,
            None => scenario.file.stack.latency_ms,
        };
        let onboard = |id| scenario.onboard.iter().find(|o| o.id() == id);
        let ids = world
            .train_ids()
            .chain(scenario.onboard.iter().map(|o| o.id()));
        let trains = ids.map(|id| (id, TrainScore::new(scenario, id, onboard(id))));
        Ok(Self {
            trains: trains.collect(),
            posts: Posts::new(scenario),
            bench: scenario.file.bench.map(|bench| Bench::new(&bench)),
            commands: first_commands(scenario),
            commanded: BTreeMap::new(),
            scenario,
            world,
            sensors: fitting.sensors,
            equipment: fitting.equipment,
            links,
            imaging: Imaging::new(renderer, 1e-3 * latency_ms),
            delayed: BTreeMap::new(),
            delayed_so_far: 0,
            images: Vec::new(),
            truth_ticker: Ticker::new(TRUTH_HZ),
            bodies_ticker: Ticker::new(BODIES_HZ),
            blade_shares: Vec::new(),
            cost: Costs::default(),
            observers: Observers::new(observers),
        })
    }

    /// To the end of the scenario. A failure of the world ends it as [`End::Failed`].
    pub fn run(mut self, options: &RunOptions<'_>) -> Result<Summary, SessionError> {
        self.open()?;
        let end = self.steps(options);
        self.observers.each(|o| o.close())?;
        let derailed = match &end {
            Err(SessionError::Physics(PhysicsError::Derailed { train, .. })) => Some(*train),
            _ => None,
        };
        let end = match end {
            Ok(end) => end,
            Err(SessionError::Physics(error)) => End::Failed(error.to_string()),
            Err(other) => return Err(other),
        };
        Ok(self.summary(end, derailed))
    }

    fn steps(&mut self, options: &RunOptions<'_>) -> Result<End, SessionError> {
        let mut next_progress_s = 0.0;
        loop {
            let time_s = self.world.time().secs();
            if options.stopped() {
                return Ok(End::Interrupted);
            }
            if self.bench_is_over()? || self.is_over(time_s) {
                return Ok(End::Complete);
            }
            if let Some(progress) = options.progress.filter(|_| time_s >= next_progress_s) {
                progress(time_s);
                next_progress_s = time_s + 0.1;
            }
            self.step()?;
        }
    }

    /// The scenario's time is over, or all trains with equipment have stood long enough.
    fn is_over(&self, time_s: f64) -> bool {
        if self.bench.is_some() {
            return false;
        }
        let stood_long = |limit_s: f64| {
            let now = self.world.time();
            let mut equipped = self.scenario.onboard.iter().map(|o| &self.trains[&o.id()]);
            !self.scenario.onboard.is_empty()
                && equipped.all(|train| train.stood_s(now).is_some_and(|s| s >= limit_s))
        };
        let standstill = self.scenario.file.stop_after_standstill_s;
        time_s >= self.scenario.file.duration_s || standstill.is_some_and(stood_long)
    }

    /// A bench goes on to its next point where it is done with one; whether it was the last.
    fn bench_is_over(&mut self) -> Result<bool, SessionError> {
        let (now, fixes) = (self.world.time(), self.fixes());
        let next = self.bench.as_mut().map(|bench| bench.next(now, fixes));
        if let Some(Move::To { head_m, given_up_m }) = next {
            if let Some(left_m) = given_up_m {
                let text = format!("no more fixes with the head at {left_m} m: gone on");
                self.observers.show(&Event::Note {
                    time: now,
                    text: &text,
                })?;
            }
            self.place_rig(head_m);
        }
        Ok(next == Some(Move::Over))
    }

    fn step(&mut self) -> Result<(), SessionError> {
        let (world, commands) = (&mut self.world, &self.commands);
        let (hits, told) = (world.impacts().len(), world.incidents().len());
        self.cost.physics.time(|| world.step(commands)).0?;
        let now = self.world.time();
        for hit in &self.world.impacts()[hits..] {
            let (with, kmh) = (&hit.with, 3.6 * hit.speed_mps);
            let text = format!("hit {with} at {kmh:.1} km/h");
            self.observers.show(&Event::Note {
                time: now,
                text: &text,
            })?;
        }
        for incident in &self.world.incidents()[told..] {
            let text = incident.to_string();
            self.observers.show(&Event::Note {
                time: now,
                text: &text,
            })?;
        }
        self.images.clear();
        self.sample(now)?;
        self.receive(now)?;
        self.read_out(now)?;
        self.work(now)?;
        self.show_truth(now)
    }

    /// Every sensor gives what is due.
    fn sample(&mut self, now: SimTime) -> Result<(), SessionError> {
        for k in 0..self.sensors.len() {
            for output in self.sensors[k].sensor.sample(&self.world)? {
                match output {
                    Output::Capture(capture) => self.submit(k, now, capture)?,
                    Output::Sample(sample) => {
                        let node = self.sensors[k].node.clone();
                        let due = now.plus(sample.delay_s);
                        let message = Message {
                            valid_at: sample.valid_at,
                            ..Message::own(node.clone(), due, sample.content)
                        };
                        if sample.delay_s > 0.0 {
                            let number = self.delayed_so_far;
                            self.delayed_so_far += 1;
                            self.delayed.insert((due, number), (node, message));
                        } else {
                            self.deliver(&node, message)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Hands a capture to the renderer, with the world as it is now.
    fn submit(
        &mut self,
        sensor: usize,
        now: SimTime,
        capture: Capture,
    ) -> Result<(), SessionError> {
        let Capture {
            header,
            views,
            late_s,
        } = capture;
        let (source, own) = match &self.sensors[sensor].node {
            Node::Train(id) => (Source::Rig(*id), Some(*id)),
            node => (Source::Wayside(self.posts.index(node)), None),
        };
        let (mut bodies, mut owners) = self.world.owned_bodies(own);
        let poses = views.iter().filter_map(|view| view.motion.poses.first());
        let eyes: Vec<Point3<f64>> = poses.map(|p| p.translation.vector.into()).collect();
        let (blades, switches) = self.world.blades(Some((&eyes, SIGHT_M)));
        bodies.extend(blades);
        owners.extend(switches);
        let train = views.first().and_then(|view| {
            let id = own.or(self.world.train_ids().next())?;
            self.train_at(id, view.mid())
        });
        let job = Job {
            time: now,
            bodies,
            headlights: self.world.headlights(),
            views,
        };
        self.observers.show(&Event::Exposure(&Exposure {
            source,
            number: header.number,
            job: &job,
            owners: &owners,
            train,
        }))?;
        if let Source::Wayside(post) = source {
            self.posts.expose(post, header.number, &self.world);
        }
        let pending = Pending {
            sensor,
            header,
            late_s,
        };
        Ok(self.imaging.submit(&job, pending, &mut self.cost)?)
    }

    /// A train at a time of the recent past, by the speed that it has now, and the end of it that its
    /// rig is at.
    fn train_at(&self, id: TrainId, time: SimTime) -> Option<TrainPoint> {
        let onboard = self.scenario.onboard.iter().find(|o| o.id() == id);
        let end = onboard.map_or(TrainEnd::Front, OnboardSettings::rig_end);
        let place = self.world.place_at(id, time)?;
        Some(TrainPoint {
            track: place.track,
            chainage_m: place.s_m,
            speed_mps: self.world.train(id)?.speed_mps,
            world_from_vehicle: self.world.vehicle_at(id, end, time)?,
        })
    }

    /// What comes by links, and samples that took their time.
    fn receive(&mut self, now: SimTime) -> Result<(), SessionError> {
        while let Some(first) = self.delayed.first_entry().filter(|e| e.key().0 <= now) {
            let (node, message) = first.remove();
            self.deliver(&node, message)?;
        }
        loop {
            let world = &self.world;
            let Some(message) = self.links.receive(now, |id| world.head(id)) else {
                return Ok(());
            };
            if let Receiver::Node(node) = message.receiver.clone() {
                self.deliver(&node, message)?;
            }
        }
    }

    /// Images that are due.
    fn read_out(&mut self, now: SimTime) -> Result<(), SessionError> {
        while let Some((pending, images)) = self.imaging.due(now, &mut self.cost)? {
            let Mounted { node, sensor } = &mut self.sensors[pending.sensor];
            let node = node.clone();
            if let Some(content) = sensor.read_out(&pending.header, images)? {
                let message = Message {
                    valid_at: pending.header.start,
                    ..Message::own(node.clone(), now, content)
                };
                self.deliver(&node, message)?;
            }
        }
        Ok(())
    }

    /// Hands a message to all equipment of a node.
    fn deliver(&mut self, node: &Node, message: Message) -> Result<(), SessionError> {
        let has_images = matches!(message.content, Content::Pair(_) | Content::Frame(_));
        if !has_images {
            self.observers.show(&Event::Message {
                node,
                message: &message,
            })?;
        }
        let equipment = &mut self.equipment;
        let mut hand_on = || {
            let own = equipment.iter_mut().filter(|e| e.node == *node);
            own.for_each(|e| e.equipment.on(&message));
        };
        if has_images {
            let cost_s = self.cost.stack.time(hand_on).1;
            let cost_ms = 1e3 * cost_s;
            self.observers.show(&Event::Cost { node, cost_ms })?;
            self.images.push(Delivered { message, cost_ms });
            return Ok(());
        }
        hand_on();
        if let (Content::BalisePassed(name), Node::Train(id)) = (&message.content, node)
            && let Some(telegram) = self.links.read_balise(message.received_at, name, *id)
        {
            self.deliver(node, telegram)?;
        }
        Ok(())
    }

    /// Every piece of equipment does what is due; what it says reaches those after it on its node in
    /// this cycle, and those before it in the next.
    fn work(&mut self, now: SimTime) -> Result<(), SessionError> {
        for k in 0..self.equipment.len() {
            let equipment = &mut self.equipment[k].equipment;
            let messages = self.cost.stack.time(|| equipment.cycle(now)).0;
            for message in messages {
                self.score_message(now, &message)?;
                self.send(k, message);
            }
        }
        Ok(())
    }

    /// Equipment `k` commands a train, which obeys all of its equipment.
    fn command(&mut self, id: TrainId, k: usize, command: TrainCommand) {
        self.commanded.insert((id, k), command);
        let of_train = self.commanded.range((id, 0)..=(id, usize::MAX));
        let all = of_train.map(|(_, command)| *command);
        if let Some(current) = self.commands.get_mut(id.index()) {
            *current = all.fold(TrainCommand::UNSUPERVISED, TrainCommand::stricter);
        }
    }

    /// Sends what equipment `k` says.
    fn send(&mut self, k: usize, message: Message) {
        let own = message.sender == self.equipment[k].node;
        if own
            && let (Content::Command(command), Node::Train(id)) =
                (&message.content, &message.sender)
        {
            self.command(*id, k, *command);
        }
        if message.receiver != Receiver::Own {
            let world = &self.world;
            self.links.send(message, |id| world.head(id));
            return;
        }
        let sender = &message.sender;
        let others = self.equipment.iter_mut().enumerate();
        let others = others.filter(|(other, e)| *other != k && e.node == *sender);
        others.for_each(|(_, e)| e.equipment.on(&message));
    }

    /// Fixes of the rig of a bench so far, by the first of its methods.
    fn fixes(&self) -> usize {
        let onboard = self.scenario.onboard.first();
        let method = onboard.and_then(|onboard| onboard.led.methods.first());
        let score = self.trains.get(&TrainId::default()).zip(method);
        score.map_or(0, |(score, method)| score.fixes(*method))
    }

    /// Puts the rig of a bench at a point. The scenario's equipment starts anew; the user's own goes on.
    fn place_rig(&mut self, head_m: f64) {
        self.world.place_carrier(head_m);
        let maps = Maps::new(self.scenario);
        let onboard = self.scenario.onboard.iter();
        let anew = onboard.flat_map(|onboard| onboard_equipment(onboard, &maps));
        let added = std::mem::take(&mut self.equipment).into_iter();
        let added = added.filter(|fitted| fitted.is_added);
        self.equipment = anew.chain(added).collect();
    }
}
