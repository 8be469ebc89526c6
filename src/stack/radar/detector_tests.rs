//! Detections against the radar equation, the Cramer-Rao bounds and the resolution of tones.

use super::*;
use crate::stack::radar::testing::{Draw, Scatterer, frame, noise_power, sheet, unweighted};
use std::f64::consts::TAU;

/// The strongest sighting of scatterers.
fn strongest(settings: &RadarTrackingSettings, scatterers: &[Scatterer], seed: u64) -> Sighting {
    let sheet = sheet();
    let mut detector = Detector::new(&sheet, settings);
    let frame = frame(&sheet, scatterers, 1.0, &mut Draw::new(seed));
    detector.detect(&frame.counts, [0.0; 2]).unwrap().0[0]
}

/// Ratio of signal to noise of a point after all integration, dB, by the radar equation, without windows.
fn expected_snr_db(sheet: &RadarSheet, range_m: f64, cross_section_m2: f64) -> f64 {
    let wave = sheet.waveform.wave_m();
    let spread = wave * wave * cross_section_m2 / ((4.0 * PI).powi(3) * range_m.powi(4));
    let gains = sheet.transmit_gain_dbi + sheet.receive_gain_dbi + 10.0 * spread.log10();
    let full = sheet.power_dbm + gains - sheet.full_scale_dbm;
    let noise_db = 10.0 * (noise_power(sheet) / RadarSheet::FULL_SCALE.powi(2)).log10();
    full - noise_db + 10.0 * (sheet.frame_samples() as f64).log10()
}

/// The mean over frames, less what windows cost, from 10 to 200 m, with ranges, speeds and azimuths between cells. So is
/// the cross-section.
#[test]
fn the_ratio_of_signal_to_noise_is_that_of_the_radar_equation() {
    let mut draw = Draw::new(11);
    for settings in [RadarTrackingSettings::default(), unweighted()] {
        let windows = weights(&sheet(), &settings);
        let loss_db = windows[0].loss_db + windows[1].loss_db;
        // A person, a car, a truck, the flat front of a train.
        for (range_m, area_m2) in [
            (10.0, 0.5),
            (25.0, 0.5),
            (50.0, 10.0),
            (100.0, 100.0),
            (200.0, 1000.0),
        ] {
            let (mut off_db, mut off_area_db) = (0.0, 0.0);
            let frames = 4;
            for k in 0..frames {
                let range_m = range_m + 0.5 * draw.uniform();
                let (azimuth, speed) = (draw.uniform() - 0.5, 60.0 * draw.uniform() - 30.0);
                let point = Scatterer::polar(range_m, azimuth, speed, area_m2);
                let seen = strongest(&settings, &[point], k).detection;
                let expected_db = expected_snr_db(&sheet(), range_m, area_m2) - loss_db;
                off_db += (seen.snr_db - expected_db) / frames as f64;
                off_area_db += 10.0 * (seen.cross_section_m2 / area_m2).log10() / frames as f64;
            }
            assert!(off_db.abs() < 0.5, "{range_m} m: {off_db} dB");
            assert!(off_area_db.abs() < 0.5, "{range_m} m: {off_area_db} dB");
        }
    }
}

/// The root mean square error of range, azimuth and speed over drawn frames is that of theory: the Cramer-Rao bound
/// without windows, and more by what a window costs. 2000 errors have theirs to 1.6 %, one sigma: 5 % are three.
#[test]
fn errors_are_the_cramer_rao_bounds() {
    let mut sheet = sheet();
    // A small frame, of which many can be drawn.
    (sheet.waveform.samples, sheet.waveform.loops) = (64, 32);
    for (settings, seed) in [(unweighted(), 5), (RadarTrackingSettings::default(), 6)] {
        let mut detector = Detector::new(&sheet, &settings);
        let mut draw = Draw::new(seed);
        let windows_db = detector.weights[0].loss_db + detector.weights[1].loss_db;
        let (mut squares, frames) = ([0.0; 3], 2000);
        for _ in 0..frames {
            let range_m = 40.0 + 20.0 * draw.uniform();
            let (azimuth, speed) = (draw.uniform() - 0.5, 20.0 * draw.uniform() - 10.0);
            let area = 10f64.powf(0.1 * (28.0 - expected_snr_db(&sheet, range_m, 1.0)));
            let point = Scatterer::polar(range_m, azimuth, speed, area);
            let frame = frame(&sheet, &[point], 1.0, &mut draw);
            let (seen, _) = detector.detect(&frame.counts, [0.0; 2]).unwrap();
            let middle = middle_m(&sheet, range_m, azimuth);
            let snr_db = 28.0 - windows_db;
            let truth = [middle, azimuth, speed];
            let seen = seen[0];
            let d = seen.detection;
            let measured = [d.range_m, d.azimuth_rad, d.radial_speed_mps];
            for k in 0..3 {
                // Bounds are those of the true ratio of signal to noise, not of the measured one.
                let sigma = seen.sigmas[k] * 10f64.powf(0.05 * (d.snr_db - snr_db));
                squares[k] += ((measured[k] - truth[k]) / sigma).powi(2) / f64::from(frames);
            }
        }
        for square in squares {
            let ratio: f64 = square.sqrt();
            assert!((ratio - 1.0).abs() < 0.05, "{squares:?}");
        }
    }
}

/// Range from the middle of the elements, which is where the phase of all of them together belongs to.
fn middle_m(sheet: &RadarSheet, range_m: f64, azimuth_rad: f64) -> f64 {
    let mean = |places: &[[f64; 2]]| places.iter().map(|p| p[0]).sum::<f64>() / places.len() as f64;
    let left_m = 0.5 * (mean(&sheet.transmitters_m) + mean(&sheet.receivers_m));
    range_m - left_m * azimuth_rad.sin()
}

/// Share of relative phases at which two equal echoes so many cells apart are told, along range, speed or azimuth.
fn told(axis: usize, cells: f64) -> f64 {
    let sheet = sheet();
    let mut detector = Detector::new(&sheet, &unweighted());
    let cell = [
        sheet.waveform.range_bin_m(),
        0.25,
        sheet.waveform.speed_bin_mps(2),
    ];
    let mut draw = Draw::new(7);
    let (mut found, frames) = (0, 40);
    for k in 0..frames {
        let offset = draw.uniform() - 0.5;
        let mut points = [0.0, cells].map(|apart| {
            let mut off = [0.0; 3];
            off[axis] = cell[axis] * (apart + offset);
            Scatterer::polar(30.0 + off[0], off[1].asin(), 5.0 + off[2], 5.0)
        });
        points[1].phase_rad = TAU * (f64::from(k) + 0.5) / f64::from(frames);
        let frame = frame(&sheet, &points, 1.0, &mut draw);
        let (seen, _) = detector.detect(&frame.counts, [0.0; 2]).unwrap();
        // Side lobes of both together are weaker by more than 6 dB.
        let least_db = seen[0].detection.snr_db - 6.0;
        let strong = seen.iter().filter(|seen| seen.detection.snr_db > least_db);
        found += u32::from(strong.count() == 2);
    }
    f64::from(found) / f64::from(frames)
}

/// Two echoes of equal power: told at 1.5 cells at any phase between them. At half a cell the spectrum has two heights
/// only where they nearly cancel, within 54 degrees of opposite phases, which are 0.30 of all.
#[test]
fn echoes_apart_are_told_and_close_ones_are_not() {
    for axis in 0..3 {
        let (apart, close) = (told(axis, 1.5), told(axis, 0.5));
        assert!(apart > 0.95, "axis {axis}: {apart}");
        assert!(close < 0.35, "axis {axis}: {close}");
    }
}

/// A speed beyond those that alias has the right azimuth none the less, where the train's own speed tells it.
#[test]
fn an_aliased_speed_does_not_turn_the_azimuth() {
    let sheet = sheet();
    let limit = sheet.waveform.most_speed_mps(2);
    let point = Scatterer::polar(60.0, 0.2, -44.0, 10.0);
    let frame = frame(&sheet, &[point], 1.0, &mut Draw::new(1));
    let mut detector = Detector::new(&sheet, &RadarTrackingSettings::default());
    // From -40 m/s it would come at 84 over ground: then it is taken not to have aliased.
    for (own_mps, fold) in [(22.0, 1), (0.0, 1), (-40.0, 0)] {
        let seen = detector.detect(&frame.counts, [own_mps, 0.0]).unwrap().0[0];
        let is_right = (seen.detection.azimuth_rad - 0.2).abs() < 0.02;
        assert_eq!(is_right, fold == 1, "{own_mps}: {seen:?}");
        assert!((seen.detection.radial_speed_mps - (2.0 * limit - 44.0)).abs() < 0.1);
        assert_eq!(seen.fold, fold);
    }
}

/// Noise of the sheet has no rise, noise of four times its power 6 dB; and one frame of 400 cells' worth of false alarms
/// has no more of them than the binomial distribution says.
#[test]
fn noise_is_measured_against_the_sheet() {
    let sheet = sheet();
    let mut detector = Detector::new(&sheet, &RadarTrackingSettings::default());
    for (rise, expected_db) in [(1.0, 0.0), (4.0, 6.02)] {
        let frame = frame(&sheet, &[], rise, &mut Draw::new(3));
        let (seen, state) = detector.detect(&frame.counts, [0.0; 2]).unwrap();
        assert!((state.noise_rise_db - expected_db).abs() < 0.1, "{state:?}");
        assert!(!state.is_saturated && seen.len() <= 4, "{}", seen.len());
    }
}

/// Echoes beyond full scale are said to be; frames of a wrong size give nothing.
#[test]
fn saturation_and_wrong_sizes_are_seen() {
    let sheet = sheet();
    let mut detector = Detector::new(&sheet, &RadarTrackingSettings::default());
    let point = Scatterer::polar(2.0, 0.0, 0.0, 1e5);
    let frame = frame(&sheet, &[point], 1.0, &mut Draw::new(3));
    let (_, state) = detector.detect(&frame.counts, [0.0; 2]).unwrap();
    assert!(state.is_saturated);
    assert!(detector.detect(&frame.counts[1..], [0.0; 2]).is_none());
    assert!(detector.detect(&[], [0.0; 2]).is_none());
}

/// Provokes: radars without samples, with odd sizes, with one element, with no numbers; and frames of the extremes.
#[test]
fn any_sheet_and_any_counts_do_not_panic() {
    for (samples, loops, elements) in [(0, 4, 1), (4, 0, 1), (1, 1, 1), (7, 5, 3), (33, 2, 0)] {
        for scale in [1.0, 0.0, f64::NAN] {
            let mut sheet = sheet();
            (sheet.waveform.samples, sheet.waveform.loops) = (samples, loops);
            sheet.waveform.start_hz *= scale;
            sheet.receivers_m = vec![[0.0, 0.0]; elements];
            let mut detector = Detector::new(&sheet, &RadarTrackingSettings::default());
            for count in [0, i16::MIN, i16::MAX] {
                let counts = vec![[count; 2]; sheet.frame_samples()];
                assert_eq!(
                    detector.detect(&counts, [0.0; 2]).is_some(),
                    !counts.is_empty()
                );
            }
        }
    }
}
