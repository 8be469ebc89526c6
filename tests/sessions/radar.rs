//! The radar's sensor and its equipment together.

use metrotwin::bus::{Content, Node, RadarReport, TrainEnd, TrainId};
use metrotwin::scenario::{Scenario, ScenarioFile};
use metrotwin::session::{
    Event, Observer, ObserverError, RendererChoice, RunOptions, renderer, run_with,
};
use metrotwin::settings::read_toml;
use metrotwin::stack::radar::{RadarTracking, RadarTrackingSettings};
use metrotwin::track::Tunnel;

const SPEED_MPS: f64 = 10.0;
const START_M: f64 = 100.0;
const CAR_M: f64 = 260.0;
const CAR_LENGTH_M: f64 = 4.0;

/// What the radar's equipment says.
#[derive(Default)]
struct Reports(Vec<RadarReport>);

impl Observer for Reports {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        if let Event::Message { message, .. } = event
            && let Content::Radar(report) = &message.content
        {
            self.0.push(report.clone());
        }
        Ok(())
    }
}

/// Fails where a car that stands on the track is not followed where it is, from 120 m to 40 m before the train: by the signal of
/// the sensor, with the errors that its sheet does not know, amid the clutter of a tunnel.
#[test]
fn a_car_on_the_track_is_followed_where_it_stands() {
    let file: ScenarioFile = read_toml(&format!(
        "name = 'car'\ntunnel = 'given'\nduration_s = 12.0\nseed = 3\n\
         train = {{ cars = 1, start_chainage_m = {START_M}, start_speed_kmh = 36.0, cruise_speed_kmh = 36.0 }}\n\
         stack = {{ onboard = [] }}\n[radar]\n\
         [[obstacles]]\nname = 'car'\nchainage_m = {CAR_M}\nmaterial = 'vehicle'\n\
         body = {{ shape = 'box', size_m = [{CAR_LENGTH_M}, 1.8, 1.5] }}\n"
    ))
    .unwrap();
    let tunnel =
        Tunnel::from_toml("name = 'line'\nplan = [{ kind = 'straight', length_m = 600.0 }]")
            .unwrap();
    let scenario = Scenario::new(file, tunnel).unwrap();
    let radar = scenario.file.radar.clone().unwrap();
    let mut renderer = renderer(&scenario, RendererChoice::Cpu).unwrap();
    let mut reports = Reports::default();
    run_with(
        &scenario,
        renderer.as_mut(),
        &|fitting| {
            let node = Node::Train(TrainId(0));
            let settings = RadarTrackingSettings::default();
            let sheet = radar.sheet(TrainEnd::Front);
            fitting.add_equipment(node.clone(), RadarTracking::new(node, settings, &sheet));
        },
        &RunOptions::default(),
        &mut [&mut reports],
    )
    .unwrap();
    let (mut followed, mut frames, mut others) = (0, 0, 0);
    for report in &reports.0 {
        let head_m = START_M + SPEED_MPS * report.time.secs();
        let left_m = CAR_M - 0.5 * CAR_LENGTH_M - head_m;
        if !(40.0..120.0).contains(&left_m) {
            continue;
        }
        frames += 1;
        let near = |place_m: [f64; 2]| {
            (-2.0..CAR_LENGTH_M + 2.0).contains(&(place_m[0] - left_m)) && place_m[1].abs() < 1.5
        };
        let real = report.tracks.iter().filter(|track| !track.is_ghost);
        let (cars, rest): (Vec<_>, Vec<_>) = real.partition(|track| near(track.place_m));
        let stands = |track: &&metrotwin::bus::RadarTrack| track.velocity_mps[0].abs() < 1.0;
        followed += u32::from(cars.iter().any(stands));
        others += rest.len();
    }
    println!(
        "{} reports, car followed in {followed} of {frames} frames, {others} other tracks",
        reports.0.len()
    );
    assert!(frames >= 70, "{frames}");
    assert!(
        f64::from(followed) > 0.9 * f64::from(frames),
        "{followed} of {frames}"
    );
}
