use super::*;
use crate::track::Tunnel;
use crate::track::geodesy::Geodetic;

/// 600 m: open, a bridge of 12 m over the track, open, and from 300 m on a tunnel of 200 m.
const LINE: &str = "name = 'line'\n\
    datum = { latitude_deg = 48.2, longitude_deg = 15.6, height_m = 270.0, heading_deg = 30.0 }\n\
    plan = [{ kind = 'straight', length_m = 600.0 }]\n\
    [[sections]]\nkind = 'open'\nfrom_m = 0.0\n\
    [[sections]]\nkind = 'rectangular'\nfrom_m = 100.0\nceiling_m = 6.0\n\
    [[sections]]\nkind = 'open'\nfrom_m = 112.0\n\
    [[sections]]\nkind = 'rectangular'\nfrom_m = 300.0\n\
    [[sections]]\nkind = 'open'\nfrom_m = 500.0\n";

fn line() -> Tunnel {
    Tunnel::from_toml(LINE).unwrap()
}

fn receiver(settings: &GnssSettings, line: &Tunnel, seed: u64) -> Gnss {
    one_of_several(settings, line, [seed, seed])
}

/// Of a scenario's seed and its own.
fn one_of_several(settings: &GnssSettings, line: &Tunnel, [common, own]: [u64; 2]) -> Gnss {
    let tracks = (line.network.tracks.as_slice(), &line.datum.unwrap());
    Gnss::new(settings, TrainId(0), tracks, GnssSeeds { common, own })
}

fn antenna(line: &Tunnel, s_m: f64) -> Point3<f64> {
    line.first_track().alignment.at(s_m).origin + Vector3::new(0.0, 0.0, 3.9)
}

/// Error in the world's x and y, of a fix of an antenna that is there.
fn error_m(line: &Tunnel, fix: &GnssFix, antenna: &Point3<f64>) -> nalgebra::Vector2<f64> {
    (line.datum.unwrap().world(&fix.place) - antenna).xy()
}

/// Without reflections and troposphere the stated covariance is that of the errors: the squared Mahalanobis distance
/// has the mean 2 of chi-square with two degrees of freedom, whatever the satellites and the world's heading.
#[test]
fn errors_are_as_stated() {
    let line = line();
    let settings = GnssSettings {
        reflected_share: 0.0,
        troposphere_m: 0.0,
        stated_scale: 1.0,
        ..GnssSettings::default()
    };
    let datum = line.datum.unwrap();
    let turn = Rotation2::new(datum.heading_deg.to_radians());
    let antenna = antenna(&line, 50.0);
    let (count, mut sum, mut most_m2) = (3000, 0.0, 0.0f64);
    for seed in 0..count {
        let fix = receiver(&settings, &line, seed)
            .fix(SimTime::default(), &antenna)
            .unwrap();
        let error = turn * error_m(&line, &fix, &antenna);
        sum += error.dot(&(fix.covariance_m2.try_inverse().unwrap() * error));
        most_m2 = most_m2.max(fix.covariance_m2.trace());
    }
    let mean = sum / f64::from(count as u32);
    // The sum's own deviation is 2 sqrt(count).
    assert!(
        (mean - 2.0).abs() < 4.0 * 2.0 / f64::from(count as u32).sqrt(),
        "{mean}"
    );
    assert!(most_m2 < 25.0, "an open sky: {most_m2}");
}

/// Errors of one fix are those of the next, as their correlation time says.
#[test]
fn multipath_is_gauss_markov() {
    let line = line();
    let settings = GnssSettings {
        reflected_share: 0.0,
        troposphere_m: 0.0,
        signal_in_space_m: 0.0,
        noise_m: 0.0,
        multipath_s: 40.0,
        ..GnssSettings::default()
    };
    let antenna = antenna(&line, 50.0);
    for lag_s in [10.0, 40.0, 120.0] {
        let (mut product, mut squares) = (0.0, 0.0);
        for seed in 0..1500 {
            let mut receiver = receiver(&settings, &line, seed);
            let [a, b] = [0.0, lag_s].map(|s| {
                let fix = receiver.fix(SimTime::from_secs(s), &antenna).unwrap();
                error_m(&line, &fix, &antenna)
            });
            product += a.dot(&b);
            squares += 0.5 * (a.norm_squared() + b.norm_squared());
        }
        let (found, expected) = (product / squares, f64::exp(-lag_s / 40.0));
        // 3000 pairs of components.
        assert!(
            (found - expected).abs() < 4.0 / 3000f64.sqrt(),
            "{lag_s}: {found} {expected}"
        );
    }
}

/// What comes from the sky is wrong by one number for all receivers of a scenario: of two trains 10 m apart the fixes are
/// 10 m apart, also where the one has begun later and has another rate.
#[test]
fn two_receivers_have_one_sky() {
    let line = line();
    let settings = GnssSettings {
        multipath_m: 0.0,
        noise_m: 0.0,
        reflected_share: 0.0,
        acquisition_s: 0.0,
        signal_in_space_s: 20.0,
        troposphere_s: 50.0,
        ..GnssSettings::default()
    };
    let antennas = [50.0, 60.0].map(|s_m| antenna(&line, s_m));
    let mut one = one_of_several(&settings, &line, [1, 2]);
    let mut other = one_of_several(&settings, &line, [1, 3]);
    let mut errors_m = Vec::new();
    for k in 0..400 {
        let time = SimTime::from_secs(0.2 * f64::from(k));
        let a = one.fix(time, &antennas[0]).unwrap();
        if k >= 7 && k % 3 == 0 {
            let b = other.fix(time, &antennas[1]).unwrap();
            let [a_m, b_m] = [
                error_m(&line, &a, &antennas[0]),
                error_m(&line, &b, &antennas[1]),
            ];
            assert!((a_m - b_m).norm() < 1e-6, "{a_m} {b_m}");
            assert_eq!(a.satellites, b.satellites);
            errors_m.push(a_m);
        }
    }
    let most_m = errors_m.iter().map(|m| m.norm()).fold(0.0, f64::max);
    let changed_m = (errors_m[0] - errors_m[errors_m.len() - 1]).norm();
    assert!(most_m > 0.3 && changed_m > 0.1, "{most_m} {changed_m}");
    let mut another = one_of_several(&settings, &line, [4, 2]);
    let fix = another.fix(SimTime::default(), &antennas[0]).unwrap();
    assert!((error_m(&line, &fix, &antennas[0]) - errors_m[0]).norm() > 1e-3);
}

/// Multipath and noise of one train's receiver say nothing of those of another one.
#[test]
fn own_errors_are_independent() {
    let line = line();
    let settings = GnssSettings {
        reflected_share: 0.0,
        troposphere_m: 0.0,
        signal_in_space_m: 0.0,
        ..GnssSettings::default()
    };
    let antenna = antenna(&line, 50.0);
    let (mut product, mut squares) = (0.0, 0.0);
    for seed in 0..1500 {
        let [a, b] = [1, 2].map(|train| {
            let mut receiver = one_of_several(&settings, &line, [seed, 10 * seed + train]);
            let fix = receiver.fix(SimTime::default(), &antenna).unwrap();
            error_m(&line, &fix, &antenna)
        });
        product += a.dot(&b);
        squares += 0.5 * (a.norm_squared() + b.norm_squared());
    }
    // 3000 pairs of components.
    let found = product / squares;
    assert!(found.abs() < 4.0 / 3000f64.sqrt(), "{found}");
}

/// A mixture: its share of time, mean excess and mean duration are those of the settings.
#[test]
fn reflections_have_their_share_excess_and_duration() {
    let settings = GnssSettings {
        error_scale: 0.0,
        reflected_share: 0.2,
        reflected_s: 4.0,
        reflected_excess_m: 12.0,
        ..GnssSettings::default()
    };
    let mut errors = RangeErrors::new(&settings, GnssSeeds { common: 3, own: 3 });
    let (sine, step_s, count) = (0.6, 0.5, 400_000u32);
    let (mut on, mut begun, mut excess_m) = (0u32, 0u32, 0.0);
    let mut was_on = false;
    for k in 1..=count {
        errors.advance(step_s * f64::from(k));
        let error_m = errors.of(7, sine, SignalWay::Free, step_s).unwrap();
        let is_on = error_m > 0.0;
        on += u32::from(is_on);
        begun += u32::from(is_on && !was_on);
        excess_m += error_m;
        was_on = is_on;
    }
    let (share, expected) = (f64::from(on) / f64::from(count), 0.2 * 0.8);
    assert!((share - expected).abs() < 0.01, "{share}");
    let mean_m = excess_m / f64::from(on);
    assert!((mean_m - 12.0).abs() < 0.5, "{mean_m}");
    // It looks every half second: what is shorter is missed, and what is seen lasts to the next look, so the mean
    // between begin and end is step / (1 - stay) with stay the chance to go on.
    let change = 1.0 - (-step_s / (4.0 * (1.0 - expected))).exp();
    let expected_s = step_s / (change * (1.0 - expected));
    let lasts_s = f64::from(on) * step_s / f64::from(begun);
    assert!(
        (lasts_s / expected_s - 1.0).abs() < 0.05,
        "{lasts_s} {expected_s}"
    );
}

/// None underground, worse under a bridge, and back behind a portal once satellites are received again.
#[test]
fn walls_and_bridges_hide_the_sky() {
    let line = line();
    let settings = GnssSettings {
        reflected_if_blocked: 0.0,
        reflected_share: 0.0,
        ..GnssSettings::default()
    };
    let mut satellites = std::collections::BTreeMap::new();
    let (mut first_behind_s, mut runs) = (Vec::new(), 0);
    for seed in 0..20 {
        let mut receiver = receiver(&settings, &line, seed);
        runs += 1;
        let mut back_s = None;
        for k in 0..295 {
            let (s_m, seconds) = (2.0 * f64::from(k), 0.2 * f64::from(k));
            let fix = receiver.fix(SimTime::from_secs(seconds), &antenna(&line, s_m));
            let seen = fix.as_ref().map_or(0, |fix| u32::from(fix.satellites));
            *satellites.entry(k).or_insert(0) += seen;
            if s_m > 500.0 && fix.is_some() {
                back_s = back_s.or(Some((s_m - 500.0) / 10.0));
            }
        }
        first_behind_s.push(back_s.unwrap());
    }
    let mean = |s_m: i32| f64::from(satellites[&(s_m / 2)]) / f64::from(runs);
    assert!(mean(50) > 10.0, "open: {}", mean(50));
    assert!(mean(106) < 0.7 * mean(50), "bridge: {}", mean(106));
    for s_m in (320..480).step_by(10) {
        assert_eq!(satellites[&(s_m / 2)], 0, "tunnel at {s_m}");
    }
    // 0.7 m under the ceiling the antenna sees satellites of ten degrees 4 m before the mouth.
    for back_s in first_behind_s {
        assert!((1.5..6.0).contains(&back_s), "{back_s} s");
    }
}

/// A vault over one half of the sky makes the error ellipse long along the track: before a portal, in its mouth.
#[test]
fn in_a_portal_the_ellipse_is_long_along_the_line() {
    let line = line();
    let settings = GnssSettings {
        reflected_if_blocked: 0.0,
        reflected_share: 0.0,
        ..GnssSettings::default()
    };
    let turn = Rotation2::new(-line.datum.unwrap().heading_deg.to_radians());
    let (mut along_m2, mut across_m2, mut open_m2) = (0.0, 0.0, 0.0);
    for seed in 0..40 {
        let mouth = |s_m: f64| {
            let fix =
                receiver(&settings, &line, seed).fix(SimTime::default(), &antenna(&line, s_m))?;
            Some(turn.matrix() * fix.covariance_m2 * turn.matrix().transpose())
        };
        if let Some(covariance) = mouth(300.5) {
            along_m2 += covariance[(0, 0)];
            across_m2 += covariance[(1, 1)];
            open_m2 += mouth(50.0).unwrap()[(0, 0)];
        }
    }
    assert!(along_m2 > 1.5 * open_m2, "{along_m2} {open_m2}");
    assert!(along_m2 > across_m2, "{along_m2} {across_m2}");
}

/// Twice with one seed is the same to the bit; with another it is not.
#[test]
fn the_seed_decides() {
    let line = line();
    let fix = |seed| {
        let mut receiver = receiver(&GnssSettings::default(), &line, seed);
        let times = (0..50).map(|k| SimTime::from_secs(0.2 * f64::from(k)));
        times
            .filter_map(|time| receiver.fix(time, &antenna(&line, 50.0)))
            .collect::<Vec<_>>()
    };
    assert_eq!(fix(5), fix(5));
    assert_ne!(fix(5), fix(6));
    let datum = line.datum.unwrap();
    let far = |a: &Geodetic| (datum.world(a) - antenna(&line, 50.0)).norm() < 40.0;
    assert!(fix(5).iter().all(|fix| far(&fix.place)));
}
