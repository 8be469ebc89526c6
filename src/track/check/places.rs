//! The centrelines of all tracks, each at its place in the world.

use super::joints::Joints;
use super::key_of;
use super::line::{self, UnplacedLine};
use super::placing::{self, Order};
use crate::settings::{Checker, Problem};
use crate::track::Alignment;
use crate::track::file::{TrackEntry, TunnelFile};

/// The centrelines; none where nothing says where some of them are.
pub(super) fn lines(
    file: &TunnelFile,
    tracks: &[TrackEntry],
    joints: &Joints,
    check: &mut Checker<'_>,
) -> Option<Vec<Alignment>> {
    let courses = tracks.iter().enumerate();
    let courses =
        courses.map(|(k, track)| UnplacedLine::of(track, &mut check.below(&key_of(file, k))));
    let courses: Vec<UnplacedLine> = courses.collect();
    let (lines, found) = placed(file, tracks, joints, courses.clone());
    let found = match found.is_empty() {
        true => found,
        false => without_start(file, tracks, joints, &courses, found),
    };
    check.add(found);
    lines
}

/// Of so many tracks with two places it is tried whether the rest is right without one of them.
const MOST_TRIED: usize = 8;

/// What is wrong with places; where the `start` of a track that begins at a joint is the cause, that, and what is
/// wrong without it.
fn without_start(
    file: &TunnelFile,
    tracks: &[TrackEntry],
    joints: &Joints,
    courses: &[UnplacedLine],
    found: Vec<Problem>,
) -> Vec<Problem> {
    let twice = placing::placed_twice(tracks, joints);
    let tried = twice.into_iter().take(MOST_TRIED).map(|k| {
        let mut once = tracks.to_vec();
        once[k].start = None;
        (k, placed(file, &once, joints, courses.to_vec()).1)
    });
    let best = tried.min_by_key(|(_, rest)| rest.len());
    let Some((k, mut rest)) = best.filter(|(_, rest)| rest.len() < found.len()) else {
        return found;
    };
    let from = tracks[k].from.as_deref().unwrap_or_default();
    rest.push(Problem::new(
        format!("{}.start", key_of(file, k)),
        format!("the track begins elsewhere by `from = \"{from}\"`"),
        "take `start` out: the place follows from the joint",
    ));
    rest
}

/// The centrelines at their places, with what is wrong there.
fn placed(
    file: &TunnelFile,
    tracks: &[TrackEntry],
    joints: &Joints,
    mut courses: Vec<UnplacedLine>,
) -> (Option<Vec<Alignment>>, Vec<Problem>) {
    let mut found = Vec::new();
    let check = &mut Checker::new("", &mut found);
    let Some(order) = Order::of(tracks, joints, check) else {
        return (None, found);
    };
    placing::close(tracks, joints, &order, &mut courses, check);
    for (k, (track, course)) in tracks.iter().zip(&mut courses).enumerate() {
        let check = &mut check.below(&key_of(file, k));
        course.grades = line::grades(track, course.length_m(), check);
    }
    let lines = order.place(tracks, &courses);
    placing::check_joints(tracks, joints, &lines, check);
    (Some(lines), found)
}
