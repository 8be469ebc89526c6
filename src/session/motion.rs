//! The sensors of motion of a run, each sampled at its own rate.

use super::cameras::Clock;
use crate::bus::{DopplerSample, ImuSample, OdometerSample};
use crate::scenario::Scenario;
use crate::twin::physics::World;
use crate::twin::sensors::{Doppler, Imu, Odometer};

/// Inertial unit, odometer and, where the train has one, Doppler radar.
pub struct MotionSensors {
    imu: (Imu, Clock),
    odometer: (Odometer, Clock),
    doppler: Option<(Doppler, Clock)>,
}

/// What is new after a step.
#[derive(Clone, Copy, Debug)]
pub struct MotionSamples {
    /// Of the inertial unit.
    pub imu: Option<ImuSample>,
    /// Of the odometer.
    pub odometer: Option<OdometerSample>,
    /// Of the radar.
    pub doppler: Option<DopplerSample>,
}

impl MotionSensors {
    /// As the scenario has them.
    pub fn new(scenario: &Scenario) -> Self {
        let seed = scenario.seed;
        let imu = Imu::new(&scenario.imu, seed, 0);
        let odometer = Odometer::new(&scenario.odometer, seed, 0);
        let doppler = scenario.doppler.as_ref();
        let [imu_clock, odometer_clock] = [imu.period_s(), odometer.period_s()].map(clock);
        Self {
            imu: (imu, imu_clock),
            odometer: (odometer, odometer_clock),
            doppler: doppler.map(|settings| {
                let doppler = Doppler::new(settings, seed, 0);
                let clock = clock(doppler.period_s());
                (doppler, clock)
            }),
        }
    }

    /// There is a Doppler radar.
    pub fn has_radar(&self) -> bool {
        self.doppler.is_some()
    }

    /// Samples that are due now.
    pub fn sample(&mut self, world: &World) -> MotionSamples {
        let now = world.time();
        let (imu, odometer) = (&mut self.imu, &mut self.odometer);
        MotionSamples {
            imu: (imu.1.due(now, 0.0)).and_then(|_| imu.0.sample(world)),
            odometer: (odometer.1.due(now, 0.0)).and_then(|_| odometer.0.sample(world)),
            doppler: (self.doppler.as_mut()).and_then(|(doppler, clock)| {
                clock.due(now, 0.0)?;
                doppler.sample(world)
            }),
        }
    }
}

fn clock(period_s: f64) -> Clock {
    Clock::new(1.0 / period_s)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::TrainCommand;
    use crate::settings::read_toml;
    use crate::track::Tunnel;

    const TUNNEL: &str = include_str!("../../tunnels/chengdu_line1.toml");

    fn scenario(more: &str) -> Scenario {
        let text = format!(
            "name = \"motion\"\ntunnel = \"given\"\n[train]\nstart_chainage_m = 400.0\n\
             start_speed_kmh = 54.0\n{more}"
        );
        Scenario::new(
            read_toml(&text).unwrap(),
            Tunnel::from_toml(TUNNEL).unwrap(),
        )
        .unwrap()
    }

    /// Each has its own rate, and all agree on the speed of a rolling train within their errors:
    /// wheels to three times 0.3 %, the radar to its mount, its noise and the car's pitch.
    #[test]
    fn rates_and_speeds() {
        let scenario = scenario("[doppler]\nrate_hz = 20.0\njanus = true\n");
        let mut world = World::new(scenario.tunnel.clone(), &scenario.physics, 1, 0).unwrap();
        let mut sensors = MotionSensors::new(&scenario);
        assert!(sensors.has_radar());
        let (mut imus, mut odometers, mut radars) = (0, 0, 0);
        let (mut wheel, mut radar, mut truth) = (0.0, 0.0, 0.0);
        let command = TrainCommand {
            permitted_speed_mps: 15.0,
            ..TrainCommand::default()
        };
        while world.time().secs() < 4.0 {
            world.step(&command).unwrap();
            let samples = sensors.sample(&world);
            imus += usize::from(samples.imu.is_some());
            if let Some(sample) = samples.odometer {
                odometers += 1;
                wheel = sample.speed_mps;
            }
            if let Some(sample) = samples.doppler {
                radars += 1;
                radar += sample.speed_mps.unwrap();
                truth += world.train().unwrap().speed_mps;
            }
        }
        // Of inertial unit and radar the first call only starts them.
        assert_eq!((imus, odometers, radars), (800, 201, 80));
        let speed = world.train().unwrap().speed_mps;
        assert!((wheel / speed - 1.0).abs() < 0.0095, "{wheel} of {speed}");
        assert!((radar / truth - 1.0).abs() < 0.005, "{radar} of {truth}");
    }

    /// A scenario that does not ask for a radar has none.
    #[test]
    fn no_radar_by_default() {
        assert!(!MotionSensors::new(&scenario("")).has_radar());
    }
}
