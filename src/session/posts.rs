//! How the wayside posts did, held against the truth.

use super::health::Health;
use super::presence::{FieldOfView, Presence};
use super::summary::Wayside;
use super::wayside_score::WaysideScore;
use crate::bus::{Node, SimTime, WaysideReport};
use crate::scenario::{Scenario, WaysidePost};
use crate::twin::physics::World;
use std::collections::VecDeque;

/// The scores of all posts, in the order of the scenario.
pub struct Posts {
    posts: Vec<Post>,
    /// How their cameras do, by what the equipment says.
    pub health: Health,
    /// Frames that they reported on.
    pub frames: u32,
}

struct Post {
    node: Node,
    view: FieldOfView,
    score: WaysideScore,
    /// What there was at each frame that has not been reported on yet.
    exposed: VecDeque<(u32, Vec<Presence>)>,
}

impl Posts {
    /// Before the first frame.
    pub fn new(scenario: &Scenario) -> Self {
        let posts = scenario.wayside.iter();
        let names = posts.clone().map(|post| post.calibration.name.as_str());
        Self {
            posts: (posts.zip(FieldOfView::of_all(scenario)))
                .map(|(post, view)| Post::new(post, view))
                .collect(),
            health: Health::of(names),
            frames: 0,
        }
    }

    /// The place of a post in the scenario's list.
    pub fn index(&self, node: &Node) -> usize {
        let place = self.posts.iter().position(|post| post.node == *node);
        place.unwrap_or(self.posts.len())
    }

    /// A frame of a post is over.
    pub fn expose(&mut self, post: usize, number: u32, world: &World) {
        if let Some(post) = self.posts.get_mut(post) {
            let present = post.view.present(world);
            post.exposed.push_back((number, present));
        }
    }

    /// What a post reports of a frame, when, and what making it cost.
    pub fn report(&mut self, post: usize, report: &WaysideReport, given: SimTime, cost_ms: f64) {
        self.frames += 1;
        let Some(post) = self.posts.get_mut(post) else {
            return;
        };
        while let Some((number, present)) = post.exposed.pop_front() {
            if number == report.number {
                post.score.report(report, given, cost_ms, &present);
                return;
            }
        }
    }

    /// What all of them found.
    pub fn finish(self) -> Option<Wayside> {
        let scores = self.posts.into_iter().map(|post| post.score);
        let all = scores.reduce(|mut a, b| {
            a.add(b);
            a
        });
        all.map(WaysideScore::finish)
    }
}

impl Post {
    fn new(post: &WaysidePost, view: FieldOfView) -> Self {
        Self {
            node: Node::Post(post.calibration.name.clone()),
            view,
            score: WaysideScore::default(),
            exposed: VecDeque::new(),
        }
    }
}
