//! Networks drawn at random, and a small one whose ways are known.

use super::*;
use crate::track::{Grade, PlanElement};
use std::f64::consts::FRAC_PI_2;

/// Trains that pass are so far apart, between centrelines.
const APART_M: f64 = 3.6;

fn place(track: u16, s_m: f64) -> Place {
    Place {
        track: TrackId(track),
        s_m,
    }
}

fn low(track: u16) -> TrackEnd {
    TrackEnd {
        track: TrackId(track),
        way: Direction::Down,
    }
}

fn high(track: u16) -> TrackEnd {
    TrackEnd {
        track: TrackId(track),
        way: Direction::Up,
    }
}

/// Numbers in [0, 1), the same in every run (Knuth's linear congruence).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn below(&mut self, end: usize) -> usize {
        ((self.next() * end as f64) as usize).min(end - 1)
    }
}

/// Elements that begin with a curvature and have no kink.
fn elements(numbers: &mut Numbers, first_per_m: f64) -> Vec<PlanElement> {
    let mut curvature = first_per_m;
    let mut all = vec![PlanElement::arc(
        numbers.between(20.0, 60.0),
        curvature,
        0.0,
    )];
    for _ in 0..numbers.below(4) {
        let next = numbers.between(-1.0 / 150.0, 1.0 / 150.0);
        all.push(PlanElement {
            length_m: numbers.between(30.0, 120.0),
            start_per_m: curvature,
            end_per_m: next,
            start_cant_m: 0.0,
            end_cant_m: 0.0,
        });
        curvature = next;
        all.push(PlanElement::arc(
            numbers.between(10.0, 200.0),
            curvature,
            0.0,
        ));
    }
    all
}

/// A line from a pose on, with a grade that goes on and then changes.
fn line(numbers: &mut Numbers, from: &TrackFrame, curvature_per_m: f64) -> Alignment {
    let grade = |from_m, slope, radius_m| Grade {
        from_m,
        slope,
        radius_m,
    };
    let grades = [
        grade(0.0, from.slope, 0.0),
        grade(12.0, numbers.between(-0.03, 0.03), 300.0),
    ];
    let elements = elements(numbers, curvature_per_m);
    Alignment::new(from.origin, from.heading_rad, &elements, &grades)
}

/// Tracks that grow from the ends of those before: switches, lines that go on, buffers. Some tracks are
/// counted from their far end.
fn grown(seed: u64, tracks: usize) -> Network {
    let mut numbers = Numbers(seed);
    let origin = TrackFrame {
        s_m: 0.0,
        origin: Point3::new(4000.0, -3000.0, 12.0),
        heading_rad: 0.3,
        slope: 0.0,
        curvature_per_m: 0.0,
        roll_rad: 0.0,
    };
    let mut lines = vec![line(&mut numbers, &origin, 0.0)];
    let (mut switches, mut ends) = (Vec::new(), vec![Ends::Open(low(0))]);
    let mut tips = vec![high(0)];
    while lines.len() + 2 <= tracks {
        let tip = tips.swap_remove(numbers.below(tips.len()));
        let pose = leaving(&lines, tip);
        let mut add = |numbers: &mut Numbers, curvature_per_m: f64| {
            let line = line(numbers, &pose, curvature_per_m);
            let k = lines.len() as u16;
            // Who counts from the other end enters at the upper one.
            let (line, enters, tip) = match numbers.below(2) {
                0 => (line, low(k), high(k)),
                _ => (line.reversed(), high(k), low(k)),
            };
            lines.push(line);
            tips.push(tip);
            enters
        };
        match numbers.below(3) {
            0 => ends.push(Ends::Joined(tip, add(&mut numbers, pose.curvature_per_m))),
            _ => {
                let side = [-1.0, 1.0][numbers.below(2)];
                switches.push(Switch {
                    name: format!("W{}", switches.len() + 1),
                    toe: tip,
                    through: add(&mut numbers, 0.0),
                    diverging: add(&mut numbers, side / 190.0),
                    diverging_mps: 10.0,
                    throw_s: 4.0,
                });
            }
        }
    }
    for tip in tips {
        ends.push(match numbers.below(2) {
            0 => Ends::Buffer(tip),
            _ => Ends::Open(tip),
        });
    }
    Network::new(bare(lines), switches, ends).unwrap()
}

fn bare(lines: Vec<Alignment>) -> Vec<Arc<Track>> {
    let tracks = lines.into_iter().map(|line| Track::bare("", line));
    tracks.map(Arc::new).collect()
}

fn leaving(lines: &[Alignment], end: TrackEnd) -> TrackFrame {
    let line = &lines[usize::from(end.track.0)];
    match end.way {
        Direction::Up => line.at(line.length_m()),
        Direction::Down => {
            let reversed = line.reversed();
            reversed.at(reversed.length_m())
        }
    }
}

/// A loop line of two tracks with a station in the middle: from the left a switch to either platform track,
/// from the right another one.
///
/// ```text
///                ,- 1 -.
/// open -- 0 -- W1       W2 -- 3 -- buffer
///                `- 2 -'
/// ```
fn passing_loop() -> Network {
    let radius_m = 300.0;
    let turn: f64 = 0.1;
    let straight = |from: Point3<f64>, heading: f64, m: f64| {
        Alignment::new(from, heading, &[PlanElement::straight(m)], &[])
    };
    let arc = |side: f64| PlanElement::arc(radius_m * turn, side / radius_m, 0.0);
    let aside = [arc(1.0), PlanElement::straight(100.0), arc(-1.0)];
    let there = Alignment::new(Point3::new(200.0, 0.0, 0.0), 0.0, &aside, &[]);
    let shift = there.at(there.length_m()).origin;
    let back = [arc(-1.0), arc(1.0)];
    let mut platform = vec![
        arc(1.0),
        PlanElement::straight(100.0),
        arc(-1.0),
        PlanElement::straight(80.0),
    ];
    platform.extend([back[0], PlanElement::straight(100.0), back[1]]);
    let platform = Alignment::new(Point3::new(200.0, 0.0, 0.0), 0.0, &platform, &[]);
    let meets = platform.at(platform.length_m()).origin;
    assert!(shift.y > 5.0 && meets.y.abs() < 1e-9, "{shift} {meets}");
    let through = straight(Point3::new(200.0, 0.0, 0.0), 0.0, meets.x - 200.0);
    let tracks = vec![
        straight(Point3::origin(), 0.0, 200.0),
        platform,
        through,
        straight(meets, 0.0, 150.0),
    ];
    let switch = |name: &str, toe, through, diverging| Switch {
        name: name.into(),
        toe,
        through,
        diverging,
        diverging_mps: 10.0,
        throw_s: 4.0,
    };
    let switches = vec![
        switch("W1", high(0), low(2), low(1)),
        switch("W2", low(3), high(2), high(1)),
    ];
    let ends = vec![Ends::Open(low(0)), Ends::Buffer(high(3))];
    Network::new(bare(tracks), switches, ends).unwrap()
}

/// Provokes: a place that is elsewhere in the world, on another track, or at another chainage, in networks of
/// 200 tracks some of which are counted backwards.
#[test]
fn places_and_coordinates_go_both_ways() {
    for seed in 0..5 {
        let network = grown(seed, 200);
        let mut numbers = Numbers(seed + 99);
        assert!(network.tracks.len() >= 199 && network.switches.len() > 40);
        for _ in 0..400 {
            let track = TrackId(numbers.below(network.tracks.len()) as u16);
            let length_m = network.alignment(track).unwrap().length_m();
            let point = TrackPoint {
                s_m: numbers.between(0.0, length_m),
                l_m: numbers.between(-2.0, 2.0),
                h_m: numbers.between(-1.0, 4.0),
            };
            let world = network.world_from_track(track, point).unwrap();
            let near = network.near(&world, 2.0 + 1e-6);
            let same = near
                .iter()
                .find(|(id, p)| *id == track && (p.s_m - point.s_m).abs() < 1.0);
            let (_, same) = same.unwrap();
            assert!(
                (same.s_m - point.s_m).abs() < 1e-9,
                "{track:?} {point:?} {same:?}"
            );
            assert!((same.l_m - point.l_m).abs() < 1e-9 && (same.h_m - point.h_m).abs() < 1e-9);
        }
    }
}

/// Provokes: a route with a step or a kink at a joint, a distance along it that is off, a leg run the wrong
/// way, a train that leaves its track: 1,000 random routes, each run by a point mass.
#[test]
fn a_point_mass_stays_on_random_routes() {
    let mut run = 0;
    for seed in 0..10 {
        let network = grown(seed + 50, 200);
        let mut numbers = Numbers(seed);
        for _ in 0..100 {
            let track = TrackId(numbers.below(network.tracks.len()) as u16);
            let length_m = network.alignment(track).unwrap().length_m();
            let from = Place {
                track,
                s_m: numbers.between(0.0, length_m),
            };
            let way = [Direction::Up, Direction::Down][numbers.below(2)];
            let mut end = TrackEnd { track, way };
            let mut tracks = vec![track];
            loop {
                let next: Vec<_> = network.next(end).collect();
                if next.is_empty() || tracks.len() > 12 {
                    break;
                }
                let entered = next[numbers.below(next.len())];
                end = entered.opposite();
                tracks.push(entered.track);
            }
            let last_m = network.alignment(end.track).unwrap().length_m();
            let to_m = match end.way {
                Direction::Up => last_m,
                Direction::Down => 0.0,
            };
            let route = network.route_over((from, way), &tracks, to_m).unwrap();
            run_along(&network, &route);
            run += 1;
        }
    }
    assert_eq!(run, 1000);
}

/// Runs a point mass at 20 m/s.
fn run_along(network: &Network, route: &Route) {
    let line = network.route_alignment(route).unwrap();
    assert!((line.length_m() - route.length_m()).abs() < 1e-8);
    let reversed = route.reversed();
    let (step_m, mut run_m) = (0.7, 0.0);
    let mut before: Option<TrackFrame> = None;
    while run_m < route.length_m() {
        let frame = line.at(run_m);
        let (place, way) = route.place(run_m);
        let track = network.alignment(place.track).unwrap().at(place.s_m);
        assert!((track.origin - frame.origin).norm() < 1e-9, "{run_m}");
        let heading = track.heading_rad + if way == Direction::Down { PI } else { 0.0 };
        assert!((heading - frame.heading_rad).sin().abs() < 1e-9);
        assert!((heading - frame.heading_rad).cos() > 0.0);
        assert!((way.sign() * track.slope - frame.slope).abs() < 1e-9);
        if let Some(before) = before {
            let moved = (frame.origin - before.origin).xy().norm();
            assert!(
                moved <= step_m + 1e-9 && moved > 0.999 * step_m,
                "{run_m} {moved}"
            );
            let turned = (frame.heading_rad - before.heading_rad).sin().abs();
            assert!(turned < 0.01, "{run_m} {turned}");
        }
        let again = route.runs_m(place).map(|m| (m - run_m).abs());
        assert!(again.fold(f64::INFINITY, f64::min) < 1e-9);
        let (mirrored, back) = reversed.place(route.length_m() - run_m);
        // At a joint it may be on either track, but it is in the same place.
        let same = network.alignment(mirrored.track).unwrap().at(mirrored.s_m);
        assert!((same.origin - frame.origin).norm() < 1e-8, "{run_m}");
        if mirrored.track == place.track {
            assert!((mirrored.s_m - place.s_m).abs() < 1e-8 && back == way.reversed());
        }
        before = Some(frame);
        run_m += step_m;
    }
}

/// Provokes: a way over the longer platform track, against the line, or through a switch from leg to leg.
#[test]
fn ways_through_a_passing_loop() {
    let network = passing_loop();
    let through_m = network.tracks[2].alignment.length_m();
    let platform_m = network.tracks[1].alignment.length_m();
    assert!(platform_m > through_m);
    let (from, to) = ((place(0, 50.0), Direction::Up), place(3, 20.0));
    let shortest = network.shortest(from, to).unwrap();
    assert!((shortest.length_m() - (150.0 + through_m + 20.0)).abs() < 1e-9);
    let all = network.routes(from, to, 1e4);
    let lengths: Vec<_> = all.iter().map(Route::length_m).collect();
    assert_eq!(all.len(), 2, "{lengths:?}");
    assert_eq!(all[0], shortest);
    assert!((lengths[1] - (150.0 + platform_m + 20.0)).abs() < 1e-9);
    assert_eq!(network.routes(from, to, 180.0).len(), 0);
    // Down the line, from one platform track to the other: over a switch, but never from leg to leg.
    assert!(
        network
            .shortest((place(1, 50.0), Direction::Up), place(2, 50.0))
            .is_none()
    );
    assert!(
        network
            .shortest((place(0, 50.0), Direction::Down), to)
            .is_none()
    );
    let down = network
        .shortest((place(3, 20.0), Direction::Down), place(0, 50.0))
        .unwrap();
    assert_eq!(down, shortest.reversed());
    let within = network
        .shortest((place(2, 10.0), Direction::Up), place(2, 30.0))
        .unwrap();
    assert!((within.length_m() - 20.0).abs() < 1e-12);
}

/// Provokes: a side that is mixed up, a clearance point that is not where the legs are so far apart.
///
/// Legs that part on an arc of radius R are R (1 - cos a) apart at R a.
#[test]
fn switches_have_a_hand_and_a_clearance_point() {
    let network = passing_loop();
    assert_eq!(network.hand(&network.switches[0]), Side::Left);
    assert_eq!(network.hand(&network.switches[1]), Side::Right);
    let near_m = network.clearance_m(&network.switches[0], 1.0).unwrap();
    let closed_m = 300.0 * (1.0f64 - 1.0 / 300.0).acos();
    assert!(
        (near_m - closed_m).abs() <= 0.25 + 1e-9,
        "{near_m} {closed_m}"
    );
    let beyond_arc_m = 30.0 + (APART_M - 300.0 * (1.0 - 0.1f64.cos())) / 0.1f64.sin();
    let found_m = network.clearance_m(&network.switches[0], APART_M).unwrap();
    assert!(
        (found_m - beyond_arc_m).abs() <= 0.25 + 1e-9,
        "{found_m} {beyond_arc_m}"
    );
    assert!(network.clearance_m(&network.switches[0], 100.0).is_none());
}

/// Provokes: trains on both platform tracks that are taken to be in each other's way, and trains that foul a
/// switch and are not.
#[test]
fn routes_conflict_where_they_foul_a_switch() {
    let network = passing_loop();
    let on = |track, from_m, to_m| {
        let from = (place(track, from_m), Direction::Up);
        network.route_over(from, &[TrackId(track)], to_m).unwrap()
    };
    let (platform, through) = (on(1, 60.0, 300.0), on(2, 60.0, 300.0));
    assert!(network.conflicts(&platform, &through, APART_M).is_empty());
    assert!(platform.shared_with(&through).is_empty());
    let out = network.route_over(
        (place(2, 60.0), Direction::Up),
        &[TrackId(2), TrackId(3)],
        50.0,
    );
    let fouls = on(1, 60.0, network.tracks[1].alignment.length_m() - 5.0);
    assert_eq!(
        network.conflicts(out.as_ref().unwrap(), &fouls, APART_M),
        [Conflict::Switch(1)]
    );
    assert!(
        network
            .conflicts(out.as_ref().unwrap(), &platform, APART_M)
            .is_empty()
    );
    let shared = out.unwrap().shared_with(&through);
    assert_eq!(shared.len(), 1);
    assert!((shared[0].length_m() - 240.0).abs() < 1e-9);
}

/// Provokes: joints that are taken though ends are apart, at an angle, joined twice, loose or of no track.
#[test]
fn what_does_not_meet_is_no_network() {
    let straight = |x: f64, y: f64, heading: f64| {
        Alignment::new(
            Point3::new(x, y, 0.0),
            heading,
            &[PlanElement::straight(100.0)],
            &[],
        )
    };
    let joined = |tracks, more: Vec<Ends>| {
        let mut ends = vec![Ends::Open(low(0)), Ends::Open(high(1))];
        ends.extend(more);
        Network::new(bare(tracks), Vec::new(), ends)
    };
    let meet = vec![Ends::Joined(high(0), low(1))];
    let two = |x, y, heading| vec![straight(0.0, 0.0, 0.0), straight(x, y, heading)];
    assert!(joined(two(100.0, 0.0, 0.0), meet.clone()).is_ok());
    let gap = joined(two(100.0, 0.002, 0.0), meet.clone()).unwrap_err();
    assert!(matches!(gap, NetworkError::Gap { gap_m, .. } if (gap_m - 0.002).abs() < 1e-9));
    let kink = joined(two(100.0, 0.0, 0.01), meet.clone()).unwrap_err();
    assert!(matches!(kink, NetworkError::Kink { kink_rad, .. } if (kink_rad - 0.01).abs() < 1e-9));
    let square = joined(two(100.0, 0.0, FRAC_PI_2), meet.clone()).unwrap_err();
    assert!(matches!(square, NetworkError::Kink { .. }));
    let twice = joined(two(100.0, 0.0, 0.0), [meet.clone(), meet].concat()).unwrap_err();
    assert_eq!(
        twice.to_string(),
        "the upper end of track 0 is joined twice"
    );
    let loose = joined(two(100.0, 0.0, 0.0), vec![Ends::Open(high(0))]).unwrap_err();
    assert_eq!(loose, NetworkError::Loose(low(1)));
    let no_track = joined(two(100.0, 0.0, 0.0), vec![Ends::Open(high(7))]).unwrap_err();
    assert_eq!(no_track, NetworkError::NoTrack(TrackId(7)));
}

/// Provokes: a route that begins or ends beside its track, or leaps from track to track.
#[test]
fn routes_that_are_none_are_refused() {
    let network = passing_loop();
    let up = |s_m| (place(0, s_m), Direction::Up);
    let beside = network
        .route_over(up(250.0), &[TrackId(0)], 260.0)
        .unwrap_err();
    assert_eq!(beside.to_string(), "chainage 250 m is not on track 0");
    let behind = network
        .route_over(up(150.0), &[TrackId(0)], 20.0)
        .unwrap_err();
    assert!(matches!(behind, NetworkError::NotOnTrack { .. }));
    let leap = network
        .route_over(up(50.0), &[TrackId(0), TrackId(3)], 20.0)
        .unwrap_err();
    assert_eq!(
        leap.to_string(),
        "track 3 does not follow the upper end of track 0"
    );
}
