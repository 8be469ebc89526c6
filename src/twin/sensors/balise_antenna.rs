//! The antenna under the train head that notices balises.

use super::{Output, Sensor, SensorError};
use crate::bus::{Content, TrainId};
use crate::twin::physics::World;

/// Says the name of each balise that the head passes, in the step in which it does.
pub struct BaliseAntenna {
    train: TrainId,
    /// Along the train's route when it was last looked where the head is.
    last_m: Option<f64>,
}

impl BaliseAntenna {
    /// Under the head of a train.
    pub fn new(train: TrainId, world: &World) -> Self {
        Self {
            train,
            last_m: world.run_m(train),
        }
    }
}

impl Sensor for BaliseAntenna {
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let head_m = world.run_m(self.train);
        let (Some(from_m), Some(to_m), Some(track)) = (
            std::mem::replace(&mut self.last_m, head_m),
            head_m,
            world.along_route(self.train),
        ) else {
            return Ok(Vec::new());
        };
        let passed = track.balises_passed(from_m, to_m);
        let sample =
            |name: &str| Output::at_once(world.time(), Content::BalisePassed(name.to_owned()));
        Ok(passed.map(sample).collect())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::Direction;
    use crate::track::Tunnel;
    use crate::twin::physics::{PhysicsSettings, TrainSettings};
    use crate::twin::sensors::SensorSample;

    /// A balise that is missed, read twice, or read by a train that runs up only.
    #[test]
    fn each_balise_is_read_once_either_way() {
        let text = "name = 'line'\nplan = [{ kind = 'straight', length_m = 400.0 }]\n\
                    balises = [{ name = 'B1', chainage_m = 200.0 }, { name = 'B2', chainage_m = 206.0 }]";
        let tunnel = std::sync::Arc::new(Tunnel::from_toml(text).unwrap());
        for (direction, start_chainage_m, expected) in [
            (Direction::Up, 195.0, ["B1", "B2"]),
            (Direction::Down, 211.0, ["B2", "B1"]),
        ] {
            let train = TrainSettings {
                cars: 1,
                direction,
                start_chainage_m,
                start_speed_kmh: 36.0,
                ..TrainSettings::default()
            };
            let settings = PhysicsSettings {
                trains: vec![train],
                ..PhysicsSettings::default()
            };
            let mut world = World::new(tunnel.clone(), &settings, 1, 0).unwrap();
            let mut antenna = BaliseAntenna::new(TrainId(0), &world);
            let mut read = Vec::new();
            while world.time().secs() < 1.5 {
                world.step(&[]).unwrap();
                for output in antenna.sample(&world).unwrap() {
                    if let Output::Sample(SensorSample {
                        content: Content::BalisePassed(name),
                        ..
                    }) = output
                    {
                        read.push(name);
                    }
                }
            }
            assert_eq!(read, expected);
        }
    }
}
