//! The sensor measured as EMVA 1288 (release 4.0) measures cameras: from rendered flats, with both
//! renderers. A luminous board fills the picture.
//!
//! Bounds are five standard errors of what is estimated, or rounding where there is no noise, and
//! never wider than what a camera's sheet is asked for. A flat has N = 76,800 pixels: a mean is
//! known to sigma / 277, a variance to sqrt(2 / N) = 0.5 %.

use crate::common::{RENDERERS, dark_scene, sample};
use metrotwin::bus::Intrinsics;
use metrotwin::twin::geometry::{Body, Shape};
use metrotwin::twin::random::Stream;
use metrotwin::twin::render::{Job, Pattern, RawImage, Renderer, SensorSettings, View, upper_bits};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

const SIZE_PX: (u32, u32) = (320, 240);
const PIXELS: f64 = 320.0 * 240.0;

/// The same test with either renderer.
fn both(test: impl Fn(&mut dyn Renderer, &str)) {
    for (name, make) in RENDERERS {
        test(&mut *make(dark_scene(Vec::new())), name);
    }
}

/// A still camera of twelve bits without any fixed pattern.
fn camera() -> View {
    let mut view = sample::rig_view(&sample::track(), 100.0, 0.0);
    view.camera.intrinsics = Intrinsics::centred(SIZE_PX.0, SIZE_PX.1, 300.0);
    view.motion.poses.truncate(1);
    view.lens.halo_share = 0.0;
    view.lens.vignetting = 0.0;
    view.sensor = SensorSettings {
        bits: 12,
        // The full well stays within the converter's range.
        gain_db: -1.0,
        prnu: 0.0,
        dsnu_e: 0.0,
        hot_pixel_share: 0.0,
        dark_current_e_per_s: 0.0,
        ..SensorSettings::default()
    };
    view
}

/// A board three metres ahead that gives that many photo-electrons everywhere.
fn all_over(view: &View, electrons: f64) -> Body {
    let mut world_from_body = view.motion.poses[0];
    world_from_body.translation = (world_from_body * Point3::new(0.0, 0.0, 3.0)).coords.into();
    Body {
        shape: Shape::Box(Vector3::new(30.0, 30.0, 1e-3)),
        world_from_body,
        velocity_mps: Vector3::zeros(),
        albedo: 0.0,
        luminance_cd_m2: electrons / view.electrons_per_cd_m2(),
    }
}

/// Provokes a wrong factor anywhere between luminance and electrons, which all other tests would divide
/// out again. Worked by hand: 100 cd/m^2 through f/2 and a transmission of 0.9 give the sensor
/// 0.7854 x 0.9 x 100 / 4 = 17.671 lx; in 1 ms a pixel of 3.75 um gets 2.4850e-13 lm s, at 320 lm/W
/// 7.7658e-16 J, at 3.55e-19 J a photon 2187.5 photons, with a quantum efficiency of 0.6 1312.5
/// electrons.
#[test]
fn a_known_scene_gives_the_electrons_worked_by_hand() {
    let mut view = sample::wayside_job(&sample::track(), 100.0).views.remove(0);
    view.pixel_m = 3.75e-6;
    view.camera.shutter.exposure_s = 1e-3;
    (view.lens.f_number, view.lens.transmission) = (2.0, 0.9);
    view.sensor.quantum_efficiency = 0.6;
    let electrons = 100.0 * view.electrons_per_cd_m2();
    println!("{electrons:.2} electrons");
    assert!((electrons - 1312.5).abs() < 0.1, "{electrons}");
    // One stop is a factor of two, and twice the pixel a factor of four.
    view.lens.f_number *= 2f64.sqrt();
    view.pixel_m *= 2.0;
    view.camera.shutter.exposure_s *= 3.0;
    let more = 100.0 * view.electrons_per_cd_m2();
    assert!((more / electrons - 6.0).abs() < 1e-9, "{more}");
}

/// Raw frames, number `first` and on.
fn frames(
    renderer: &mut dyn Renderer,
    view: &View,
    body: Body,
    first: u32,
    count: u32,
) -> Vec<RawImage> {
    let views = (first..first + count).map(|frame| {
        let mut view = view.clone();
        view.noise.frame = frame;
        view
    });
    let job = Job {
        bodies: vec![body],
        views: views.collect(),
        ..Job::default()
    };
    renderer.submit(&job).unwrap();
    renderer.collect_raw().unwrap()
}

fn flats(renderer: &mut dyn Renderer, view: &View, electrons: f64, count: u32) -> Vec<RawImage> {
    // No two flats share their noise.
    let first = (1e3 * electrons) as u32;
    frames(renderer, view, all_over(view, electrons), first, count)
}

fn mean(image: &RawImage) -> f64 {
    image.iter().map(|x| f64::from(*x)).sum::<f64>() / image.len() as f64
}

/// Mean and temporal variance of pairs of frames, as EMVA has them: half the mean square of the
/// difference, which no fixed pattern reaches.
fn pair_statistics(images: &[RawImage]) -> (f64, f64) {
    let pairs = images.chunks_exact(2);
    let count = pairs.len() as f64;
    let (mut level, mut variance) = (0.0, 0.0);
    for pair in pairs {
        let (a, b) = (mean(&pair[0]), mean(&pair[1]));
        let square = |(x, y): (&u16, &u16)| (f64::from(*x) - f64::from(*y) - a + b).powi(2);
        let squares: f64 = pair[0].iter().zip(pair[1].iter()).map(square).sum();
        level += 0.5 * (a + b) / count;
        variance += 0.5 * squares / pair[0].len() as f64 / count;
    }
    (level, variance)
}

/// Slope of y over x through the origin.
fn slope(points: &[(f64, f64)]) -> f64 {
    let xy: f64 = points.iter().map(|(x, y)| x * y).sum();
    xy / points.iter().map(|(x, _)| x * x).sum::<f64>()
}

/// Slope of variances over means with an offset of their own: in darkness, eight bits hide the
/// noise and with it the 1/12 that rounding adds elsewhere.
fn regression(levels: &[(f64, f64, f64)]) -> f64 {
    let count = levels.len() as f64;
    let x0 = levels.iter().map(|l| l.1).sum::<f64>() / count;
    let y0 = levels.iter().map(|l| l.2).sum::<f64>() / count;
    slope(
        &levels
            .iter()
            .map(|l| (l.1 - x0, l.2 - y0))
            .collect::<Vec<_>>(),
    )
}

/// Provokes a gain, shot noise, read noise or quantisation of another size in either renderer, at
/// any depth, and a response that bends.
#[test]
fn photon_transfer_gives_gain_and_read_noise() {
    both(|renderer, who| {
        for bits in [8, 10, 12] {
            let mut view = camera();
            view.sensor.bits = bits;
            let sensor = view.sensor;
            let (dark, dark_variance) = pair_statistics(&flats(renderer, &view, 0.0, 4));
            // Fourteen levels up to 70 % of the full well, as EMVA fits, and five beyond.
            let levels: Vec<_> = (1..=19)
                .map(|k| {
                    let electrons = 0.05 * f64::from(k) * sensor.full_well_e;
                    let (y, variance) = pair_statistics(&flats(renderer, &view, electrons, 4));
                    (electrons, y - dark, variance)
                })
                .collect();
            let gain = regression(&levels[..14]);
            let error = gain / sensor.dn_per_e() - 1.0;
            println!(
                "{who} {bits} bits: K {gain:.5} DN/e, off by {:.2} %",
                100.0 * error
            );
            // Fourteen variances, each to 0.36 %, the larger ones weighing more: 0.25 %.
            assert!(error.abs() < 0.01, "{who} {bits} bits: K off by {error}");
            let read_e = (dark_variance - 1.0 / 12.0).max(0.0).sqrt() / gain;
            // With eight bits read noise hides below a step (EMVA wants 0.24 at least).
            if bits > 8 {
                let error = read_e / sensor.read_noise_e - 1.0;
                println!(
                    "{who} {bits} bits: read noise {read_e:.3} e, off by {:.2} %",
                    100.0 * error
                );
                assert!(
                    error.abs() < 0.03,
                    "{who} {bits} bits: read noise {read_e} e"
                );
            }
            // The adapter's signal has 11 bits: off by 2^-11 at most, and by 2^-10 if it cuts.
            let response = slope(&levels.iter().map(|(e, y, _)| (*e, *y)).collect::<Vec<_>>());
            for (electrons, y, _) in &levels {
                let off = y / (response * electrons) - 1.0;
                let rounding = 0.02 / (response * electrons);
                assert!(
                    off.abs() < 1e-3 + rounding,
                    "{who} {bits} bits: bends by {off} at {electrons} e"
                );
            }
        }
    });
}

/// Variance of the lesser of a standard normal number and z.
fn clipped_variance(z: f64) -> f64 {
    let steps = 4000;
    let (mut first, mut second) = (0.0, 0.0);
    for k in 0..steps {
        let x = -8.0 + 16.0 * (f64::from(k) + 0.5) / f64::from(steps);
        let weight = (-0.5 * x * x).exp() / TAU.sqrt() * 16.0 / f64::from(steps);
        first += weight * x.min(z);
        second += weight * x.min(z).powi(2);
    }
    second - first * first
}

/// Provokes a full well that clips too early, too late, or before the shot noise.
#[test]
fn the_variance_peaks_at_the_full_well() {
    // A well of F electrons clips noise of sqrt(m), so the variance m * V((F - m) / sqrt(m)) peaks
    // z standard deviations below F.
    let full_e = camera().sensor.full_well_e;
    let peak = (0..600)
        .map(|k| (0.9 + 2e-4 * f64::from(k)) * full_e)
        .map(|m| (m * clipped_variance((full_e - m) / m.sqrt()), m))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap();
    let below = (full_e - peak.1) / peak.1.sqrt();
    both(|renderer, who| {
        let view = camera();
        let gain = view.sensor.dn_per_e();
        let (dark, _) = pair_statistics(&flats(renderer, &view, 0.0, 2));
        let found = (-10..=4)
            .map(|k| {
                let electrons = (1.0 + 0.01 * f64::from(k)) * full_e;
                pair_statistics(&flats(renderer, &view, electrons, 8))
            })
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap();
        let peak_e = (found.0 - dark) / gain;
        let well_e = peak_e + below * peak_e.sqrt();
        println!(
            "{who}: variance peaks at {peak_e:.0} e, {below:.2} sigma below a well of {well_e:.0} e"
        );
        assert!((well_e / full_e - 1.0).abs() < 0.02, "{who}: {well_e} e");
        // Deep in saturation there is only read noise, around the full well.
        let (level, variance) = pair_statistics(&flats(renderer, &view, 2.0 * full_e, 2));
        assert!(
            ((level - dark) / gain / full_e - 1.0).abs() < 1e-3,
            "{who}: {level}"
        );
        let read_e = (variance - 1.0 / 12.0).sqrt() / gain;
        assert!(
            (read_e / view.sensor.read_noise_e - 1.0).abs() < 0.03,
            "{who}: {read_e} e"
        );
    });
}

/// Provokes dark current that does not grow with the exposure, or has no shot noise.
#[test]
fn dark_current_is_the_slope_over_exposures() {
    both(|renderer, who| {
        let mut view = camera();
        view.sensor.dark_current_e_per_s = 1500.0;
        let gain = view.sensor.dn_per_e();
        let measured: Vec<_> = (1..=6u32)
            .map(|k| {
                let exposure_s = 0.02 * f64::from(k);
                view.camera.shutter.exposure_s = exposure_s;
                view.noise.stream = Stream::new(3, k.into(), "dark");
                let (level, variance) = pair_statistics(&flats(renderer, &view, 0.0, 2));
                (
                    exposure_s,
                    (level - view.sensor.black_dn()) / gain,
                    variance,
                )
            })
            .collect();
        let by_mean = slope(
            &measured
                .iter()
                .map(|(t, y, _)| (*t, *y))
                .collect::<Vec<_>>(),
        );
        let floor = (gain * view.sensor.read_noise_e).powi(2) + 1.0 / 12.0;
        let variances = measured
            .iter()
            .map(|(t, _, v)| (*t, (v - floor) / gain.powi(2)));
        let by_variance = slope(&variances.collect::<Vec<_>>());
        println!("{who}: dark current {by_mean:.1} e/s by means, {by_variance:.0} by variances");
        // Means to 15 e / 277 of 180 e; variances to 0.5 % of 216 e^2 of 180.
        assert!((by_mean / 1500.0 - 1.0).abs() < 0.002, "{who}: {by_mean}");
        assert!(
            (by_variance / 1500.0 - 1.0).abs() < 0.03,
            "{who}: {by_variance}"
        );
    });
}

/// Mean over frames, the spatial variance of that mean without what is left of the temporal one,
/// and its mean over pixels.
fn pattern(images: &[RawImage]) -> (f64, f64) {
    let count = images.len() as f64;
    let pixels = images[0].len();
    let averages: Vec<f64> = (0..pixels)
        .map(|k| images.iter().map(|i| f64::from(i.as_raw()[k])).sum::<f64>() / count)
        .collect();
    let level = averages.iter().sum::<f64>() / pixels as f64;
    let spatial = averages.iter().map(|a| (a - level).powi(2)).sum::<f64>() / pixels as f64;
    let (_, temporal) = pair_statistics(images);
    (level, spatial - temporal / count)
}

/// Provokes a fixed pattern of another size, one that changes from frame to frame, or one that
/// both eyes share.
#[test]
fn prnu_and_dsnu_are_those_of_the_settings() {
    both(|renderer, who| {
        let mut view = camera();
        view.sensor.prnu = 0.012;
        view.sensor.dsnu_e = 5.0;
        let gain = view.sensor.dn_per_e();
        let (dark, dark_s2) = pattern(&flats(renderer, &view, 0.0, 32));
        let half = flats(renderer, &view, 0.5 * view.sensor.full_well_e, 16);
        let (level, half_s2) = pattern(&half);
        let dsnu_e = dark_s2.sqrt() / gain;
        let prnu = (half_s2 - dark_s2).sqrt() / (level - dark);
        println!(
            "{who}: DSNU1288 {dsnu_e:.3} e, PRNU1288 {:.3} %",
            100.0 * prnu
        );
        // Spatial variances to 0.5 % of pattern and rest together: 0.3 % of their roots.
        assert!((dsnu_e / 5.0 - 1.0).abs() < 0.015, "{who}: {dsnu_e}");
        assert!((prnu / 0.012 - 1.0).abs() < 0.015, "{who}: {prnu}");
        view.noise.stream = Stream::new(1, 0, "another eye");
        let other = flats(renderer, &view, 0.5 * view.sensor.full_well_e, 16);
        let product: f64 = (0..half[0].len())
            .map(|k| {
                let at = |images: &[RawImage]| {
                    let sum: f64 = images.iter().map(|i| f64::from(i.as_raw()[k])).sum();
                    sum / images.len() as f64 - level
                };
                at(&half) * at(&other)
            })
            .sum();
        assert!(
            (product / PIXELS / half_s2).abs() < 6.0 / PIXELS.sqrt(),
            "{who}: eyes share a pattern"
        );
    });
}

/// Provokes noise that repeats along rows, columns or texels of four, in the next frame or in the
/// other eye.
#[test]
fn noise_is_white_and_independent() {
    both(|renderer, who| {
        let mut view = camera();
        let electrons = 0.4 * view.sensor.full_well_e;
        let images = flats(renderer, &view, electrons, 2);
        view.noise.stream = Stream::new(2, 0, "another eye");
        let other = flats(renderer, &view, electrons, 1).remove(0);
        let (level, variance) = pair_statistics(&images);
        let noise = |image: &RawImage, x: u32, y: u32| f64::from(image.get_pixel(x, y)[0]) - level;
        let correlation = |a: &RawImage, b: &RawImage, dx: u32, dy: u32| {
            let rows = 0..SIZE_PX.1 - dy;
            let each = rows.flat_map(|y| (0..SIZE_PX.0 - dx).map(move |x| (x, y)));
            let product = |(x, y)| noise(a, x, y) * noise(b, x + dx, y + dy);
            each.map(product).sum::<f64>() / PIXELS / variance
        };
        // A correlation of N pairs is known to 1 / sqrt(N).
        let bound = 5.0 / PIXELS.sqrt();
        for (dx, dy) in (0..9).flat_map(|dx| (0..5).map(move |dy| (dx, dy))).skip(1) {
            let r = correlation(&images[0], &images[0], dx, dy);
            assert!(r.abs() < bound, "{who}: {r} at {dx}, {dy}");
        }
        assert!(
            correlation(&images[0], &images[1], 0, 0).abs() < bound,
            "{who}: frames"
        );
        assert!(
            correlation(&images[0], &other, 0, 0).abs() < bound,
            "{who}: eyes"
        );
        // The power of 240 rows at a frequency is known to 1 / sqrt(240).
        for k in 1..SIZE_PX.0 / 2 {
            let wave: Vec<_> = (0..SIZE_PX.0)
                .map(|x| (TAU * f64::from(k * x) / f64::from(SIZE_PX.0)).sin_cos())
                .collect();
            let mut power = 0.0;
            for y in 0..SIZE_PX.1 {
                let (mut re, mut im) = (0.0, 0.0);
                for (x, (sin, cos)) in (0..).zip(&wave) {
                    let n = noise(&images[0], x, y);
                    (re, im) = (re + n * cos, im + n * sin);
                }
                power += (re * re + im * im) / variance / PIXELS;
            }
            let off = (power - 1.0) * f64::from(SIZE_PX.1).sqrt();
            assert!(off.abs() < 5.0, "{who}: {off} sigma at frequency {k}");
        }
    });
}

/// Provokes streams, maps or formulas that differ between GPU and CPU: the signal's 11 bits are
/// all that may differ, at most 2^-11 of 10,000 e, a fifth of a grey level here.
#[test]
fn noise_is_equal_for_gpu_and_cpu_streams() {
    let [mut cpu, mut gpu, mut whole] = RENDERERS.map(|(_, make)| make(dark_scene(Vec::new())));
    let mut view = camera();
    view.sensor = SensorSettings {
        bits: 8,
        hot_pixel_share: 0.01,
        ..SensorSettings::default()
    };
    view.camera.intrinsics = Intrinsics::centred(333, 97, 300.0);
    view.camera.shutter.exposure_s = 0.01;
    view.lens.vignetting = 1.0;
    view.lens.dirt_share = 0.1;
    view.lens.occluded_share = 0.1;
    for pattern in [Pattern::Grey, Pattern::Rggb] {
        view.sensor.pattern = pattern;
        for electrons in [0.0, 5.0, 100.0, 3000.0, 7000.0, 12_000.0] {
            let other = flats(&mut *cpu, &view, electrons, 1).remove(0);
            for (who, renderer) in [("processor", &mut gpu), ("adapter", &mut whole)] {
                let one = flats(&mut **renderer, &view, electrons, 1).remove(0);
                let apart = one.iter().zip(other.iter()).map(|(a, b)| a.abs_diff(*b));
                let (worst, off) = apart.fold((0, 0), |(worst, off), d| {
                    (worst.max(d), off + u32::from(d > 0))
                });
                let share = f64::from(off) / one.len() as f64;
                let case = format!("{who}, {pattern:?}, {electrons} e");
                println!("{case}: {:.3} % off, by {worst} at most", 100.0 * share);
                assert!(worst <= 1, "{case}: off by {worst}");
                // Rounding splits two numbers this far apart.
                let bound = 2e-3 + 2f64.powi(-11) * electrons * view.sensor.grey_per_e() * 2.05;
                assert!(share < bound, "{case}: {share} differ");
            }
        }
    }
}

/// Provokes eight bits that are not the upper ones.
#[test]
fn eight_bits_are_the_upper_ones() {
    both(|renderer, who| {
        let view = camera();
        let job = Job {
            bodies: vec![all_over(&view, 4000.0)],
            views: vec![view.clone()],
            ..Job::default()
        };
        renderer.submit(&job).unwrap();
        renderer.submit(&job).unwrap();
        let raw = renderer.collect_raw().unwrap();
        let grey = renderer.collect().unwrap();
        let upper = upper_bits(&raw[0], view.sensor.spare_bits());
        assert!(grey[0] == upper, "{who}");
        assert!(
            raw[0].iter().any(|x| x % 16 != 0),
            "{who}: no more than eight bits"
        );
    });
}

/// Provokes charge that blooming makes or loses: a bright band's excess lies in the pixels above
/// and below it, less what the drain takes.
#[test]
fn blooming_keeps_charge() {
    both(|renderer, who| {
        let mut view = camera();
        view.sensor.noise = false;
        let board = |view: &View, electrons| Body {
            // Eight rows, half the columns.
            shape: Shape::Box(Vector3::new(0.8, 0.04, 1e-3)),
            ..all_over(view, electrons)
        };
        let columns = |view: &View, image: &RawImage| -> Vec<f64> {
            let sensor = &view.sensor;
            let electrons = |x: u16| (f64::from(x) - sensor.black_dn()) / sensor.dn_per_e();
            let column = |x| {
                (0..SIZE_PX.1)
                    .map(move |y| electrons(image.get_pixel(x, y)[0]))
                    .sum()
            };
            (0..SIZE_PX.0).map(column).collect()
        };
        let full_e = view.sensor.full_well_e;
        let electrons = 1.7 * full_e;
        let body = board(&view, electrons);
        // What arrives, seen by a sensor that holds it all.
        let mut deep = view.clone();
        deep.sensor.full_well_e = 6e4;
        let arrived = columns(&deep, &frames(renderer, &deep, body.clone(), 0, 1)[0]);
        for share in [0.0, 0.5, 1.0] {
            view.sensor.blooming = share;
            let image = &frames(renderer, &view, body.clone(), 0, 1)[0];
            let lit = image
                .iter()
                .filter(|x| f64::from(**x) > view.sensor.black_dn() + 2.0)
                .count();
            println!("{who}: {lit} pixels lit with {share}");
            for (x, (kept, arrived)) in columns(&view, image).iter().zip(&arrived).enumerate() {
                let rows = (arrived / electrons).round();
                let over_e = rows * (electrons - full_e);
                let right = arrived - (1.0 - share) * over_e;
                // Rounding of up to 40 pixels, and the 11 bits of the adapter's signal.
                let bound = 0.5 * 72.0 / deep.sensor.dn_per_e() + 2f64.powi(-10) * arrived;
                assert!(
                    (kept - right).abs() <= bound,
                    "{who} column {x}: {kept} of {right} e"
                );
            }
        }
    });
}

/// Provokes hot pixels that are too many or too few, wander, or are the same in every camera.
#[test]
fn hot_pixels_are_counted() {
    both(|renderer, who| {
        let mut view = camera();
        view.sensor.hot_pixel_share = 2e-3;
        view.sensor.hot_pixel_e_per_s = 1e4;
        view.camera.shutter.exposure_s = 0.1;
        let limit = view.sensor.black_dn() + 200.0 * view.sensor.dn_per_e();
        let hot = |image: &RawImage| -> Vec<usize> {
            let bright = |(k, x): (usize, &u16)| (f64::from(*x) > limit).then_some(k);
            image.iter().enumerate().filter_map(bright).collect()
        };
        let images = flats(renderer, &view, 0.0, 2);
        let (first, second) = (hot(&images[0]), hot(&images[1]));
        // Leaks are exponential: that share of them is over 200 e of 1000 in the mean.
        let expected = PIXELS * 2e-3 * (-0.2f64).exp();
        let count = first.len() as f64;
        println!("{who}: {count} hot pixels, {expected:.0} expected");
        assert!(
            (count - expected).abs() < 5.0 * expected.sqrt(),
            "{who}: {count}"
        );
        let stayed = first.iter().filter(|k| second.contains(k)).count() as f64;
        // Shot noise moves the few that are near the limit over it.
        assert!(stayed > 0.9 * count, "{who}: {stayed} of {count} stay");
        view.noise.stream = Stream::new(9, 0, "another eye");
        let other = hot(&flats(renderer, &view, 0.0, 1)[0]);
        let shared = first.iter().filter(|k| other.contains(k)).count();
        assert!(shared < 5, "{who}: {shared} shared by both eyes");
    });
}

/// Provokes vignetting of another shape, about another centre, or on one renderer only.
#[test]
fn vignetting_is_the_fourth_power_of_the_cosine() {
    both(|renderer, who| {
        let mut view = camera();
        view.sensor.noise = false;
        view.camera.intrinsics.cx_px += 20.0;
        let electrons = 0.9 * view.sensor.full_well_e;
        for left in [1.0, 0.4] {
            view.lens.vignetting = left;
            let image = &flats(renderer, &view, electrons, 1)[0];
            for (u, v, dn) in image.enumerate_pixels() {
                let cosine = 1.0
                    / view
                        .camera
                        .intrinsics
                        .ray(f64::from(u), f64::from(v))
                        .norm();
                let share = 1.0 - left * (1.0 - cosine.powi(4));
                let right = view.sensor.black_dn() + view.sensor.dn_per_e() * share * electrons;
                // Half a step, 11 bits of signal, and chords of 8 px: 2 * 64 / 8 * 4 / f^2.
                let bound = 0.5 + (2f64.powi(-11) + 7.2e-4) * right;
                assert!(
                    (f64::from(dn[0]) - right).abs() < bound,
                    "{who} {u} {v}: {} {right}",
                    dn[0]
                );
            }
        }
    });
}

/// Provokes colours in the wrong pixels, gains before the shot noise, or white LEDs that are not
/// white.
#[test]
fn a_mosaic_has_the_noise_of_its_colours() {
    both(|renderer, who| {
        let mut view = camera();
        view.sensor.pattern = Pattern::Rggb;
        let sensor = view.sensor;
        let electrons = 0.8 * sensor.full_well_e;
        let images = flats(renderer, &view, electrons, 2);
        for (place, channel) in [((0, 0), 0), ((1, 0), 1), ((0, 1), 1), ((1, 1), 2)] {
            let part = |image: &RawImage| {
                RawImage::from_fn(SIZE_PX.0 / 2, SIZE_PX.1 / 2, |x, y| {
                    *image.get_pixel(2 * x + place.0, 2 * y + place.1)
                })
            };
            let (level, variance) = pair_statistics(&[part(&images[0]), part(&images[1])]);
            let gain = sensor.dn_per_e() * sensor.white_balance[channel];
            let charge_e = electrons * sensor.channel_response[channel];
            let off = (level - sensor.black_dn()) / (gain * charge_e) - 1.0;
            assert!(off.abs() < 1e-3, "{who} {place:?}: {off}");
            let right = gain.powi(2) * (charge_e + sensor.read_noise_e.powi(2)) + 1.0 / 12.0;
            // Half the pixels' quarter: 19,200, a variance to 1 %.
            assert!(
                (variance / right - 1.0).abs() < 0.05,
                "{who} {place:?}: {variance} {right}"
            );
        }
    });
}
