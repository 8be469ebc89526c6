//! The antenna under the train head that notices balises.

use super::{Output, Sample, Sensor, SensorError};
use crate::bus::{Content, TrainId};
use crate::track::Tunnel;
use crate::twin::physics::World;
use std::sync::Arc;

/// Says the name of each balise that the head passes, in the step in which it does.
pub struct BaliseAntenna {
    train: TrainId,
    tunnel: Arc<Tunnel>,
    last_m: Option<f64>,
}

impl BaliseAntenna {
    /// Under the head of a train.
    pub fn new(train: TrainId, tunnel: Arc<Tunnel>, world: &World) -> Self {
        Self {
            train,
            tunnel,
            last_m: world.head_m(train),
        }
    }
}

impl Sensor for BaliseAntenna {
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let head_m = world.head_m(self.train);
        let (Some(from_m), Some(to_m)) = (std::mem::replace(&mut self.last_m, head_m), head_m)
        else {
            return Ok(Vec::new());
        };
        let passed = self.tunnel.balises_passed(from_m, to_m);
        let sample = |name: &str| {
            Output::Sample(Sample {
                valid_at: world.time(),
                delay_s: 0.0,
                content: Content::BalisePassed(name.to_owned()),
            })
        };
        Ok(passed.map(sample).collect())
    }
}
