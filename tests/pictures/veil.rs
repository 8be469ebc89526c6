//! What mist leaves of the contrast across the track, in pictures of the shipped line, as its wayside device
//! measures it.

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
        camera = {{ frames_per_s = 5.0 }}
        "#
    );
    let tunnel = Tunnel::from_toml(include_str!("../../tunnels/chengdu_line1.toml")).unwrap();
    let scenario = Scenario::new(read_toml(&text).unwrap(), tunnel).unwrap();
    let mut last = LastSight::default();
    run(&scenario, &RunOptions::default(), &mut [&mut last]).unwrap();
    let (bed, blind) = last.0.expect("frames with a view of the bed");
    (bed.track_contrast.unwrap(), bed.unseen_m, blind)
}

/// In clear air the camera of the shipped line must have the contrast of the shipped
/// `stack.wayside.track_contrast` (0.35), or nearly: with less, bodies would count as less visible than they
/// are, with much more, mist would be noticed too late. Mist lowers it, as it absorbs light and adds its own,
/// and where too little is left the device must be blind. Provokes a bright veil taken for a bright bed.
#[test]
fn mist_takes_the_contrast_of_the_track() {
    let (clear, unseen_m, blind) = seen_by_w1530("");
    println!("clear air: contrast {clear:.3}, {unseen_m:.0} m of bed unseen");
    assert!((0.35..0.5).contains(&clear) && !blind);
    let mut last = clear;
    for (visibility_m, is_blind) in [(1000.0, false), (200.0, true), (60.0, true)] {
        let air = format!("air = {{ visibility_m = {visibility_m:.1} }}");
        let (contrast, unseen_m, blind) = seen_by_w1530(&air);
        println!(
            "{visibility_m} m of sight: contrast {contrast:.3}, {unseen_m:.0} m of bed unseen"
        );
        assert!(contrast < 0.75 * last, "{visibility_m} m: {contrast}");
        assert_eq!(blind, is_blind, "{visibility_m} m");
        last = contrast;
    }
}
