//! Exposure on a bench.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use crate::scenario::Scenario;
use crate::session::{Event, Observer, ObserverError, RendererChoice, RunOptions, run};
use crate::settings::read_toml;
use crate::track::Tunnel;
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
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        match event {
            Event::Exposure(exposure) => {
                let views = exposure.job.views.iter();
                let with = |v: &View| (v.camera.shutter.exposure_s, v.sensor.gain_db);
                self.drawn.extend(views.map(with));
            }
            Event::Pair { pair, report, .. } => {
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
    let tunnel = Tunnel::from_toml(include_str!("../../../tunnels/test_bench.toml")).unwrap();
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
