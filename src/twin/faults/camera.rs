//! Cameras that freeze, lose frames, go dead, or deliver late: what happens to images between the
//! sensor and whoever reads them.

use super::check_times;
use crate::bus::{SimTime, TrainId};
use crate::settings::{Checker, settings};
use crate::twin::random::Stream;
use image::GrayImage;

settings! {
    /// A fault of one camera.
    pub struct CameraFaultSettings {
        /// Whose: `rig` (both eyes), `left` or `right` (one of them), or the name of a wayside
        /// device. Those of other trains are `train 1/rig`, `train 1/left` and so on.
        camera: String;
        /// What is wrong with it.
        fault: CameraFaultKind, nested;
        /// Since when, s. Default 0.
        #[serde(default)]
        from_s: f64, in 0.0..=86_400.0;
        /// Until when, s. Default: to the end.
        to_s: Option<f64>, in 0.0..=1e6;
    }
    also check_stretch
}

settings! {
    /// What may be wrong with a camera.
    #[serde(tag = "kind", rename_all = "snake_case")]
    pub enum CameraFaultKind {
        /// Its frame grabber is stuck: the image before comes again and again, with new numbers and
        /// times.
        Freeze,
        /// Frames are lost; the numbers of the others show the gap. Where one eye's image is lost
        /// the pair comes without it.
        Drop {
            /// This share of them, 0 to 1, each drawn from the seed.
            #[serde(default = "crate::settings::one::<f64>")]
            share: f64, in 0.0..=1.0;
            /// Only those with these numbers. Default: any.
            frames: Option<Vec<u32>>;
        },
        /// Its sensor is dead: every pixel is 0.
        Dead,
        /// Images come late, in their order.
        Late {
            /// By so much more than `stack.latency_ms`, ms.
            by_ms: f64, in 0.0..=MAX_LATE_MS;
        },
    }
}

/// What the cameras of a train's rig are called: both eyes together, the left one, the right one.
pub fn rig_cameras(train: TrainId) -> [String; 3] {
    ["rig", "left", "right"].map(|name| match train {
        TrainId(0) => name.to_owned(),
        other => format!("{other}/{name}"),
    })
}

/// Later than this nothing comes.
const MAX_LATE_MS: f64 = 5000.0;

impl CameraFaultSettings {
    fn check_stretch(&self, check: &mut Checker<'_>) {
        check_times(self.from_s, self.to_s, check);
    }

    /// Images come as much later as this at most.
    pub fn late_s(&self) -> f64 {
        match self.fault {
            CameraFaultKind::Late { by_ms } => 1e-3 * by_ms,
            _ => 0.0,
        }
    }

    fn acts_at(&self, time: SimTime) -> bool {
        let ended = self.to_s.is_some_and(|s| time >= SimTime::from_secs(s));
        time >= SimTime::from_secs(self.from_s) && !ended
    }
}

/// All that is wrong with one camera, through a run: hands on its images with its faults.
#[derive(Clone, Debug)]
pub struct CameraFaults {
    faults: Vec<(CameraFaultSettings, Stream)>,
    /// The last image that was handed on.
    held: Option<GrayImage>,
}

impl CameraFaults {
    /// The faults that a scenario has for a camera of these names.
    pub fn of(names: &[&str], faults: &[CameraFaultSettings], seed: u64) -> Self {
        let own = faults.iter().enumerate();
        let own = own.filter(|(_, f)| names.contains(&f.camera.as_str()));
        Self {
            faults: own
                .map(|(k, f)| {
                    let name = format!("camera fault/{k}/{}", f.camera);
                    (f.clone(), Stream::new(seed, 0, &name))
                })
                .collect(),
            held: None,
        }
    }

    fn at(&self, time: SimTime) -> impl Iterator<Item = &(CameraFaultSettings, Stream)> {
        self.faults.iter().filter(move |(f, _)| f.acts_at(time))
    }

    /// Whether a frame that starts then is lost.
    pub fn drops(&self, number: u32, start: SimTime) -> bool {
        self.at(start).any(|(f, stream)| match &f.fault {
            CameraFaultKind::Drop { share, frames } => {
                frames.as_ref().is_none_or(|list| list.contains(&number))
                    && stream.uniform(number.into()) < *share
            }
            _ => false,
        })
    }

    /// By how much the images of a frame that starts then come later than those of a good camera.
    pub fn late_s(&self, start: SimTime) -> f64 {
        let delays = self.at(start).map(|(f, _)| f.late_s());
        delays.fold(0.0, f64::max)
    }

    fn has(&self, kind: &CameraFaultKind, time: SimTime) -> bool {
        self.at(time).any(|(f, _)| f.fault == *kind)
    }

    /// What is handed on in place of the image of a frame; 0 x 0 pixels where it is lost.
    pub fn deliver(&mut self, number: u32, start: SimTime, image: GrayImage) -> GrayImage {
        if self.faults.is_empty() {
            return image;
        }
        if self.drops(number, start) {
            return GrayImage::default();
        }
        if self.has(&CameraFaultKind::Freeze, start)
            && let Some(held) = &self.held
        {
            return held.clone();
        }
        let image = if self.has(&CameraFaultKind::Dead, start) {
            GrayImage::new(image.width(), image.height())
        } else {
            image
        };
        self.held = Some(image.clone());
        image
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::settings::read_toml;
    use crate::twin::faults::FaultSettings;
    use image::Luma;

    fn faults(names: &[&str], seed: u64, text: &str) -> CameraFaults {
        let settings: FaultSettings = read_toml(text).unwrap();
        CameraFaults::of(names, &settings.cameras, seed)
    }

    fn start(number: u32) -> SimTime {
        SimTime::from_secs(f64::from(number) / 10.0)
    }

    /// What comes of the images 1, 2, 3 ..., each of one grey; 0 where none comes.
    fn delivered(output: &mut CameraFaults, numbers: std::ops::Range<u32>) -> Vec<u8> {
        let grey = |number: u32| {
            let image = GrayImage::from_pixel(3, 2, Luma([number as u8 + 1]));
            let image = output.deliver(number, start(number), image);
            image.as_raw().first().copied().unwrap_or(0)
        };
        numbers.map(grey).collect()
    }

    /// Fails where the frozen image is another than the last one before, where it goes on after
    /// the end, or where another camera's fault strikes.
    #[test]
    fn a_frozen_camera_repeats_its_last_image() {
        let text =
            "cameras = [{ camera = 'W1', fault = { kind = 'freeze' }, from_s = 0.3, to_s = 0.6 }]";
        let images = |name| delivered(&mut faults(&[name], 1, text), 0..8);
        assert_eq!(images("W1"), [1, 2, 3, 3, 3, 3, 7, 8]);
        assert_eq!(images("W2"), [1, 2, 3, 4, 5, 6, 7, 8]);
        let from_start = "cameras = [{ camera = 'W1', fault = { kind = 'freeze' } }]";
        let mut output = faults(&["W1"], 1, from_start);
        assert_eq!(delivered(&mut output, 0..3), [1, 1, 1]);
    }

    /// A dead sensor gives nothing but zeros, and is frozen as such.
    #[test]
    fn a_dead_camera_is_black() {
        let text = "[[cameras]]\ncamera = 'left'\nfault = { kind = 'dead' }\nfrom_s = 0.1\nto_s = 0.3\n\
                    [[cameras]]\ncamera = 'rig'\nfault = { kind = 'freeze' }\nfrom_s = 0.2\nto_s = 0.4\n";
        let mut left = faults(&["rig", "left"], 1, text);
        let black = left.deliver(0, start(1), GrayImage::from_pixel(3, 2, Luma([9])));
        assert_eq!(black.dimensions(), (3, 2));
        assert_eq!(delivered(&mut left, 0..6), [1, 0, 0, 0, 5, 6]);
        let mut right = faults(&["rig", "right"], 1, text);
        assert_eq!(delivered(&mut right, 0..6), [1, 2, 2, 2, 5, 6]);
    }

    /// Fails where a share is another one, depends on the order of asking, or not on the seed; where
    /// a list drops its neighbours.
    #[test]
    fn frames_are_dropped_by_share_list_and_stretch() {
        let text =
            "cameras = [{ camera = 'W1', fault = { kind = 'drop', share = 0.1 }, from_s = 10.0 }]";
        let one = faults(&["W1"], 1, text);
        let dropped: Vec<u32> = (0..5000).filter(|k| one.drops(*k, start(*k))).collect();
        assert!(dropped[0] >= 100);
        let share = dropped.len() as f64 / 4900.0;
        // Four standard deviations of a draw of 4900.
        assert!(
            (share - 0.1).abs() < 4.0 * (0.09f64 / 4900.0).sqrt(),
            "{share}"
        );
        let backwards = (0..5000).rev().filter(|k| one.drops(*k, start(*k)));
        assert!(backwards.eq(dropped.iter().rev().copied()));
        let other = faults(&["W1"], 2, text);
        assert!(dropped.iter().any(|k| !other.drops(*k, start(*k))));
        let list =
            "cameras = [{ camera = 'W1', fault = { kind = 'drop', frames = [2, 5] }, to_s = 0.4 }]";
        let mut output = faults(&["W1"], 1, list);
        assert_eq!(delivered(&mut output, 0..7), [1, 2, 0, 4, 5, 6, 7]);
    }

    /// The longest delay of those that act counts.
    #[test]
    fn late_images_are_late_while_they_are() {
        let text = "[[cameras]]\ncamera = 'rig'\nfault = { kind = 'late', by_ms = 40.0 }\n\
                    [[cameras]]\ncamera = 'rig'\nfault = { kind = 'late', by_ms = 90.0 }\nfrom_s = 1.0\nto_s = 2.0\n";
        let rig = faults(&["rig"], 1, text);
        for (k, expected_s) in [(5, 0.04), (10, 0.09), (19, 0.09), (20, 0.04)] {
            assert!((rig.late_s(start(k)) - expected_s).abs() < 1e-12, "{k}");
        }
    }
}
