//! What the stack says of its cameras, through a run.

use super::summary::{CameraFigures, FaultSpan};
use crate::bus::{CameraHealth, SimTime};
use std::collections::BTreeMap;

/// Follows every camera that the stack looks through.
#[derive(Debug)]
pub struct Health {
    /// The figures, by camera.
    pub cameras: BTreeMap<String, CameraFigures>,
}

impl Health {
    /// Of the cameras in use.
    pub fn of<'n>(cameras: impl IntoIterator<Item = &'n str>) -> Self {
        let cameras = cameras.into_iter();
        Self {
            cameras: cameras
                .map(|n| (n.to_owned(), CameraFigures::default()))
                .collect(),
        }
    }

    /// The stack says how a camera does; true where its fault is another than before.
    pub fn note(&mut self, camera: &str, time: SimTime, health: CameraHealth) -> bool {
        let Some(figures) = self.cameras.get_mut(camera) else {
            return false;
        };
        figures.lost_frames = figures.lost_frames.saturating_add(health.lost);
        let now = figures.faults.last_mut().filter(|span| span.to_s.is_none());
        if now.as_ref().map(|span| span.fault) == health.fault {
            return false;
        }
        if let Some(before) = now {
            before.to_s = Some(time.secs());
        }
        figures.faults.extend(health.fault.map(|fault| FaultSpan {
            fault,
            from_s: time.secs(),
            to_s: None,
        }));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::CameraFault;

    /// A span that ends with the next one's beginning, is opened twice, or is lost; frames counted
    /// in a fault only.
    #[test]
    fn spans_begin_and_end_with_what_the_stack_says() {
        let mut health = Health::of(["W1"]);
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
        let figures = health.cameras;
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

    /// More lost frames than can be counted.
    #[test]
    fn the_count_of_lost_frames_ends() {
        let mut health = Health::of(["W1"]);
        let said = CameraHealth {
            fault: None,
            lost: u32::MAX,
        };
        health.note("W1", SimTime::ZERO, said);
        health.note("W1", SimTime::ZERO, said);
        assert_eq!(health.cameras["W1"].lost_frames, u32::MAX);
    }
}
