//! What mist leaves of the contrast across the track, in pictures of the shipped line, as its wayside device
//! measures it.

#![cfg(feature = "twin")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test fails by panicking"
)]

use metrotwin::bus::BedSight;
use metrotwin::scenario::Scenario;
use metrotwin::session::{Event, Observer, ObserverError, RunOptions, run};
use metrotwin::settings::read_toml;
use metrotwin::track::Tunnel;

/// The last report's view of the bed, and whether the device called itself blind.
#[derive(Default)]
struct LastSight(Option<(BedSight, bool)>);

impl Observer for LastSight {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        if let Event::Wayside { report, .. } = event {
            self.0 = report.bed.map(|bed| (bed, report.blind));
        }
        Ok(())
    }
}

fn seen_by_w1530(more: &str) -> (f64, f64, bool) {
    let text = format!(
        r#"
        name = "veil"
        tunnel = "chengdu_line1.toml"
        duration_s = 4.5
        {more}
        [[wayside]]
        device = "W1530"
        camera = {{ frames_per_s = 5.0, width_px = 960, height_px = 540, pixel_um = 6.0 }}
        "#
    );
    let tunnel = Tunnel::from_toml(include_str!("../tunnels/chengdu_line1.toml")).unwrap();
    let scenario = Scenario::new(read_toml(&text).unwrap(), tunnel).unwrap();
    let mut last = LastSight::default();
    run(&scenario, &RunOptions::default(), &mut [&mut last]).unwrap();
    let (bed, blind) = last.0.expect("frames with a view of the bed");
    (bed.track_contrast.unwrap(), bed.unseen_m, blind)
}

/// The shipped `stack.wayside.track_contrast` (0.35) must be what the camera of the shipped line has in clear
/// air, or less: if it had less, the device would be blind there. In mist what is left must fall as
/// Koschmieder's law says, 50^(-d / V) at a distance d, for the middle of the bed in view, some 35 m away; and
/// the device must be blind where that is less than it needs. Fails where a veil is measured by grey levels.
#[test]
fn val_the_contrast_across_the_track_tells_of_mist() {
    let (clear, unseen_m, blind) = seen_by_w1530("");
    eprintln!("clear: contrast {clear:.3}, {unseen_m:.0} m unseen");
    assert!((0.35..0.55).contains(&clear) && !blind);
    for (visibility_m, is_blind) in [(1000.0, false), (200.0, true), (60.0, true)] {
        let air = format!("air = {{ visibility_m = {visibility_m:.1} }}");
        let (contrast, unseen_m, blind) = seen_by_w1530(&air);
        let left = contrast / clear;
        let away_m = -left.ln() / 50.0f64.ln() * visibility_m;
        eprintln!(
            "{visibility_m} m of sight: contrast {contrast:.3}, {left:.3} of it left, as at {away_m:.0} m; {unseen_m:.0} m unseen, blind {blind}"
        );
        assert_eq!(blind, is_blind, "{visibility_m} m");
    }
}
