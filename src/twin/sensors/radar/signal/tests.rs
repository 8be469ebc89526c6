use super::*;
use crate::bus::TrainEnd;
use crate::twin::random::Stream;
use crate::twin::sensors::radar::RadarSettings;

fn figures(loops: u32) -> RadarSheet {
    let settings = RadarSettings {
        loops,
        ..RadarSettings::default()
    };
    settings.sheet(TrainEnd::Front)
}

/// An echo of the same way out and back.
fn echo(place_m: Point3<f64>, velocity_mps: Vector3<f64>, amplitude: f64) -> RadarEcho {
    let way = Moving {
        place_m,
        velocity_mps,
    };
    RadarEcho {
        out: way,
        back: way,
        amplitude,
        phase_rad: 0.3,
    }
}

/// Echoes all over the field of view, faster than a number to either way at most, every third by different ways.
fn crowd(count: u64, fastest_mps: f64) -> Vec<RadarEcho> {
    let stream = Stream::new(5, 0, "crowd");
    let one = |k: u64| {
        let draw = |n: u64| 2.0 * stream.uniform(16 * k + n) - 1.0;
        let azimuth = 1.2 * draw(1);
        let away = Vector3::new(azimuth.cos(), azimuth.sin(), 0.1 * draw(2));
        let place = Point3::from(away * (101.0 + 100.0 * draw(0)));
        let velocity = away * (fastest_mps * draw(3)) + Vector3::new(0.0, draw(4), 0.0);
        let mut echo = echo(place, velocity, 10.0 * (1.5 + draw(5)));
        if k.is_multiple_of(3) {
            echo.back.place_m.y += 4.0;
            echo.back.velocity_mps.y *= -1.0;
        }
        echo
    };
    (0..count).map(one).collect()
}

fn channels(figures: &RadarSheet) -> Vec<Complex<f64>> {
    let channel = |k: usize| Complex::from_polar(1.0 + 0.05 * k as f64, 0.2 * k as f64);
    (0..figures.channels()).map(channel).collect()
}

/// Power of the difference to the reference over that of the reference, dB.
fn error_db(echoes: &[RadarEcho], loops: u32) -> f64 {
    let figures = figures(loops);
    let model = BeatModel {
        figures: &figures,
        channels: &channels(&figures),
    };
    let reference = model.reference(echoes);
    let fast = model.samples(echoes);
    let difference = reference.iter().zip(&fast).map(|(r, f)| {
        let f = Complex::new(f64::from(f.re), f64::from(f.im));
        (r - f).norm_sqr()
    });
    let power: f64 = reference.iter().map(Complex::norm_sqr).sum();
    10.0 * (difference.sum::<f64>() / power).log10()
}

/// Standing echoes differ by the array alone: it makes ways up to 6.4 mm longer, 11 mrad at the ends of a chirp, and half
/// the square of that is left, -84 dB there. What moves with 39 m/s makes 3.9 mm in half of 8 loops: 25 mrad with the array,
/// -70 dB; and while it is sampled its beat bends by 0.7 mrad, -63 dB at the ends of a chirp. All of it is less in the mean.
#[test]
fn the_product_is_the_model() {
    let still = error_db(&crowd(40, 0.0), 8);
    let slow = error_db(&crowd(40, 10.0), 8);
    let fast = error_db(&crowd(40, 39.0), 8);
    assert!(
        still < -84.0 && slow < -74.0 && fast < -66.0,
        "{still} {slow} {fast}"
    );
}

/// The same bytes on any number of threads.
#[test]
fn threads_do_not_count() {
    let figures = figures(32);
    let channels = channels(&figures);
    let model = BeatModel {
        figures: &figures,
        channels: &channels,
    };
    let echoes = crowd(20, 30.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map(|pool| pool.install(|| model.samples(&echoes)))
            .ok()
    };
    assert!(on(1).is_some() && on(1) == on(3));
}

/// Frames of any length, and none of echoes.
#[test]
fn short_frames_are_right_too() {
    assert!(error_db(&crowd(3, 0.0), 1) < -80.0);
    assert!(error_db(&crowd(3, 0.0), 7) < -80.0);
    let figures = figures(4);
    let model = BeatModel {
        figures: &figures,
        channels: &channels(&figures),
    };
    assert!(model.samples(&[]).iter().all(|z| z.norm() < f32::EPSILON));
}

/// Argument of the product of one sample with the conjugate of another, in turns.
fn turn(samples: &[Complex<f32>], from: usize, to: usize) -> f64 {
    f64::from((samples[to] * samples[from].conj()).arg()) / TAU
}

/// By the header: the beat of a chirp is S tau; from loop to loop the phase grows by 2 v / lambda a second, so it falls for
/// what comes nearer; from receiver to receiver by sin(azimuth) d / lambda, the shorter the way the less.
#[test]
fn beat_doppler_and_angle_have_the_signs_of_the_header() {
    let figures = figures(2);
    let w = figures.waveform;
    let (range_m, speed_mps, azimuth) = (50.0, -7.0, 0.3f64);
    let away = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
    let echo = echo(Point3::from(away * range_m), away * speed_mps, 100.0);
    let model = BeatModel {
        figures: &figures,
        channels: &[Complex::new(1.0, 0.0); 8],
    };
    let samples = model.samples(&[echo]);
    let beat = w.slope_hzps * 2.0 * range_m / LIGHT_MPS + 2.0 * speed_mps / w.wave_m();
    // Samples of one chirp lie side by side, then receivers, transmitters, loops.
    let (sample, receiver, a_loop) = (1, 256, 256 * 8);
    let in_chirp = turn(&samples, 127, 127 + sample);
    assert!(
        (in_chirp - beat / w.sample_rate_hz).abs() < 1e-5,
        "{in_chirp}"
    );
    let doppler = 2.0 * speed_mps / w.wave_m() * w.loop_s(2);
    let from_loop = turn(&samples, 127, 127 + a_loop);
    assert!(
        (from_loop - doppler).abs() < 1e-3,
        "{from_loop} for {doppler}"
    );
    assert!(from_loop < 0.0);
    // Half a wave to the left, towards the echo: a shorter way.
    let nearer = -0.5 * azimuth.sin();
    let from_receiver = turn(&samples, 127, 127 + receiver);
    assert!(
        (from_receiver - nearer).abs() < 2e-3,
        "{from_receiver} for {nearer}"
    );
    // The second transmitter is two wave lengths to the left and sends a chirp later.
    let from_sender = turn(&samples, 127, 127 + 4 * receiver);
    let expected = 4.0 * nearer + 0.5 * doppler;
    let off = from_sender - expected;
    assert!(
        (off - off.round()).abs() < 5e-3,
        "{from_sender} for {expected}"
    );
}
