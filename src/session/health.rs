//! What the stack says of its cameras, through a run.

use super::summary::{CameraFigures, FaultSpan};
use crate::bus::{CameraFault, CameraHealth, SimTime};
use std::collections::BTreeMap;

/// Follows every camera that the stack looks through.
#[derive(Debug, Default)]
pub struct Health {
    cameras: BTreeMap<String, Camera>,
}

#[derive(Debug, Default)]
struct Camera {
    fault: Option<CameraFault>,
    figures: CameraFigures,
}

impl Health {
    /// A camera is in use.
    pub fn expect(&mut self, camera: &str) {
        self.cameras.entry(camera.to_owned()).or_default();
    }

    /// The stack says how a camera does; true where its fault is another than before.
    pub fn note(&mut self, camera: &str, time: SimTime, health: CameraHealth) -> bool {
        let Some(camera) = self.cameras.get_mut(camera) else {
            return false;
        };
        camera.figures.lost_frames += health.lost;
        let before = std::mem::replace(&mut camera.fault, health.fault);
        if before == health.fault {
            return false;
        }
        let faults = &mut camera.figures.faults;
        if let Some(last) = faults.last_mut().filter(|_| before.is_some()) {
            last.to_s = Some(time.secs());
        }
        faults.extend(health.fault.map(|fault| FaultSpan {
            fault,
            from_s: time.secs(),
            to_s: None,
        }));
        true
    }

    /// The figures, by camera.
    pub fn finish(self) -> BTreeMap<String, CameraFigures> {
        let cameras = self.cameras.into_iter();
        cameras.map(|(name, c)| (name, c.figures)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A span that ends with the next one's beginning, is opened twice, or is lost; frames counted
    /// in a fault only.
    #[test]
    fn spans_begin_and_end_with_what_the_stack_says() {
        let mut health = Health::default();
        health.expect("W1");
        let said = [
            None,
            Some(CameraFault::Frozen),
            Some(CameraFault::Frozen),
            Some(CameraFault::Silent),
            None,
            Some(CameraFault::Dead),
        ];
        let told: Vec<bool> = (0u32..)
            .zip(said)
            .map(|(k, fault)| {
                let lost = u32::from(k >= 4);
                health.note(
                    "W1",
                    SimTime::from_secs(k.into()),
                    CameraHealth { fault, lost },
                )
            })
            .collect();
        assert_eq!(told, [false, true, false, true, true, true]);
        assert!(!health.note("W2", SimTime::ZERO, CameraHealth::default()));
        let figures = health.finish();
        assert_eq!(figures["W1"].lost_frames, 2);
        let span = |fault, from_s, to_s| FaultSpan {
            fault,
            from_s,
            to_s,
        };
        let expected = [
            span(CameraFault::Frozen, 1.0, Some(3.0)),
            span(CameraFault::Silent, 3.0, Some(4.0)),
            span(CameraFault::Dead, 5.0, None),
        ];
        assert_eq!(figures["W1"].faults, expected);
    }
}
