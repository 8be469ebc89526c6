//! Ride of the Manchester car on random track, against the linear model and the table of a program
//! that shares nothing with this one: `tests/validation/ride.py` computes it.
//!
//! The track is a table that repeats itself, and the car runs over exactly one period of it at
//! constant speed. So its motion is periodic too, every harmonic of it is exact, and the theory
//! can be asked for the answer to this very track: what is left between them is not chance. The
//! band is 0.3 to 30 Hz, wavelengths are 1 to 80 m (the settings' default), and accelerations are
//! those of the harmonics, omega^2 z.

use super::super::irregularity::Irregularity;
use super::model::{CAR, LinearModel, PITCH, Under, WHEELSETS, Z, dof};
use super::*;
use nalgebra::{Complex, DVector};
use rapier3d_f64::math::Vector;
use std::f64::consts::TAU;

type C = Complex<f64>;

/// Length of the table of a line that is a little shorter.
const PERIOD_M: f64 = 1638.4;
const LINE_M: f64 = 1600.0;
/// Every so many steps of 1 ms are looked at.
const EVERY: usize = 6;
const BAND_HZ: std::ops::RangeInclusive<f64> = 0.3..=30.0;

/// Car centre, m/s^2; over the bogie, m/s^2; bounce, mm; pitch, mrad.
type Ride = [f64; 4];
const NAMES: [&str; 4] = [
    "centre m/s^2",
    "over bogie m/s^2",
    "bounce mm",
    "pitch mrad",
];

/// Complex amplitude of harmonic `k` of a period's samples.
fn harmonic(samples: &[f64], k: usize) -> C {
    let turn = C::from_polar(1.0, -TAU * k as f64 / samples.len() as f64);
    let mut at = C::from(2.0 / samples.len() as f64);
    let mut sum = C::from(0.0);
    for x in samples {
        sum += at * *x;
        at *= turn;
    }
    sum
}

/// Mean squares that a harmonic with amplitudes of bounce and pitch (nose up) adds.
fn squares(omega: f64, semi_distance_m: f64, bounce: C, pitch: C) -> Ride {
    let over_bogie = bounce + pitch * semi_distance_m;
    let half = |x: C| 0.5 * x.norm_sqr();
    [
        half(bounce) * omega.powi(4),
        half(over_bogie) * omega.powi(4),
        half(bounce) * 1e6,
        half(pitch) * 1e6,
    ]
}

fn add(sum: &mut Ride, part: Ride, scale: f64) {
    for (s, p) in sum.iter_mut().zip(part) {
        *s += scale * p;
    }
}

/// One speed and class.
struct Case {
    kmh: f64,
    class: IrregularityClass,
    /// A of the German vertical spectrum, m^2 rad/m.
    roughness: f64,
    /// Realisations.
    seeds: u64,
}

impl Case {
    fn speed_mps(&self) -> f64 {
        self.kmh / 3.6
    }

    /// Harmonics of the period in the band, with their angular frequencies.
    fn harmonics(&self) -> impl Iterator<Item = (usize, f64)> {
        let base_hz = self.speed_mps() / PERIOD_M;
        let last = (BAND_HZ.end() / base_hz) as usize;
        let all = (1..=last).map(move |k| (k, k as f64 * base_hz));
        all.filter(|(_, hertz)| BAND_HZ.contains(hertz))
            .map(|(k, hertz)| (k, TAU * hertz))
    }

    /// Mean squares over one period of the simulated car.
    fn simulated(&self, file: &VehicleFile, seed: u64) -> Ride {
        let settings = on_track(free_car(file.clone(), self.kmh), self.class);
        let mut world = World::new(straight(LINE_M), &settings, seed, 0).unwrap();
        let steps = (1000.0 * PERIOD_M / self.speed_mps()).round() as usize;
        let start_m = consist(&world).wheelsets[0].s_m;
        let mut steps_done = 0.0;
        let mut hold = |world: &mut World| {
            // What dampers and creep take out of its run is given back: it keeps its timetable.
            steps_done += 1.0;
            let due_m = start_m + self.speed_mps() * world.step_s * steps_done;
            let late_m = due_m - consist(world).wheelsets[0].s_m;
            let short_mps = self.speed_mps() - consist(world).speed_mps();
            let traction_mps2 = (0.5 * short_mps + 0.1 * late_m).max(0.0);
            step_with(
                world,
                Effort {
                    traction_mps2,
                    brake_mps2: 0.0,
                },
                None,
            );
        };
        for _ in 0..15_000 {
            hold(&mut world);
        }
        let (mut bounce, mut pitch) = (Vec::new(), Vec::new());
        for k in 0..steps {
            if k % EVERY == 0 {
                let car = &consist(&world).states[0];
                bounce.push(car.position.z);
                pitch.push((car.rotation * Vector::X).z);
            }
            hold(&mut world);
        }
        let mut sum = [0.0; 4];
        let a = 0.5 * file.bogie.distance_m;
        for (k, omega) in self.harmonics() {
            let part = squares(omega, a, harmonic(&bounce, k), harmonic(&pitch, k));
            add(&mut sum, part, 1.0);
        }
        sum
    }

    /// Mean squares of the linear car on the same track, on the expected one, and the scatter of
    /// the latter's root over one period.
    fn theory(&self, file: &VehicleFile, seed: u64) -> (Ride, Ride, Ride) {
        let settings = on_track(free_car(file.clone(), self.kmh), self.class);
        let track = Irregularity::new(&settings.track.irregularity, LINE_M, seed, 0);
        let up: Vec<f64> = (0..8192)
            .map(|k| track.at(0.2 * f64::from(k)).up_m)
            .collect();
        let model = LinearModel::new(file, Under::dry(self.speed_mps())).vertical();
        let a = 0.5 * file.bogie.distance_m;
        let (mut same, mut expected, mut fourth) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        let span = &settings.track.irregularity;
        for (k, omega) in self.harmonics() {
            let wave = omega / self.speed_mps();
            if !(TAU / span.longest_m..=TAU / span.shortest_m).contains(&wave) {
                continue;
            }
            let q = answer(&model, file, self.speed_mps(), omega);
            let part = squares(omega, a, q[0], -q[1]);
            add(&mut same, part, harmonic(&up, k).norm_sqr());
            // A cosine of amplitude A has the mean square A^2 / 2.
            let square = 2.0 * german(self.roughness, wave) * TAU / PERIOD_M;
            add(&mut expected, part, square);
            add(&mut fourth, part.map(|p| (p * square).powi(2)), 1.0);
        }
        // Each harmonic's power is exponentially distributed: its deviation is its mean.
        let scatter = std::array::from_fn(|k| 0.5 * fourth[k].sqrt() / expected[k]);
        (same, expected, scatter)
    }
}

/// German vertical density.
fn german(roughness: f64, wave: f64) -> f64 {
    let (corner, long) = (0.8246f64.powi(2), 0.0206f64.powi(2));
    roughness * corner / ((wave * wave + long) * (wave * wave + corner))
}

/// Places of the wheelsets from the middle of the car.
fn wheelsets_m(file: &VehicleFile) -> [f64; 4] {
    let (a, b) = (0.5 * file.bogie.distance_m, 0.5 * file.bogie.wheelbase_m);
    [a + b, a - b, b - a, -a - b]
}

/// Bounce and pitch (about y) of the car on a wave of the rails of 1 m, by the wheels' springs and
/// the share of the weight along the slope.
fn answer(model: &LinearModel, file: &VehicleFile, speed_mps: f64, omega: f64) -> [C; 2] {
    let under = Under::dry(speed_mps);
    let mass_kg = file.body.mass_kg + 2.0 * file.bogie.mass_kg + 4.0 * file.wheelset.mass_kg;
    let mut force = DVector::from_element(model.dofs.len(), C::from(0.0));
    for (body, along_m) in WHEELSETS.into_iter().zip(wheelsets_m(file)) {
        let up = C::from_polar(1.0, omega * along_m / speed_mps);
        force[model.place(dof(body, Z))] =
            2.0 * up * C::new(under.support.0, omega * under.support.1);
        let slope = up * C::new(0.0, omega / speed_mps);
        force[model.place(dof(body, 0))] = -0.25 * mass_kg * under.weight_mps2 * slope;
    }
    let q = model.response(omega, &force);
    [dof(CAR, Z), dof(CAR, PITCH)].map(|d| q[model.place(d)])
}

/// Expected root mean squares of the textbook's car: six coordinates on rigid rails, between two
/// wavelengths.
fn textbook(case: &Case, file: &VehicleFile, wavelengths_m: (f64, f64)) -> Ride {
    let full = LinearModel::textbook(file);
    let six = LinearModel::six(file);
    let mut sum = [0.0; 4];
    for (_, omega) in case.harmonics() {
        let wave = omega / case.speed_mps();
        if !(TAU / wavelengths_m.1..=TAU / wavelengths_m.0).contains(&wave) {
            continue;
        }
        let force = DVector::from_fn(6, |row, _| {
            let row = full.place(six.dofs[row]);
            let of = |(body, along_m): (usize, f64)| {
                let column = dof(body, Z);
                let up = C::from_polar(1.0, wave * along_m);
                -up * C::new(
                    full.stiffness[(row, column)],
                    omega * full.damping[(row, column)],
                )
            };
            WHEELSETS
                .into_iter()
                .zip(wheelsets_m(file))
                .map(of)
                .sum::<C>()
        });
        let q = six.response(omega, &force);
        let [z, pitch] = [dof(CAR, Z), dof(CAR, PITCH)].map(|d| q[six.place(d)]);
        let square = 2.0 * german(case.roughness, wave) * TAU / PERIOD_M;
        add(
            &mut sum,
            squares(omega, 0.5 * file.bogie.distance_m, z, -pitch),
            square,
        );
    }
    sum.map(f64::sqrt)
}

/// Compares the simulation with the theory, and with a row of the table.
fn check(case: &Case, table: Ride) {
    let file = shipped("manchester");
    let (mut simulated, mut same, mut expected) = ([0.0; 4], [0.0; 4], [0.0; 4]);
    let mut scatter = [0.0; 4];
    for seed in 1..=case.seeds {
        let (on_same, on_expected, over_period) = case.theory(&file, seed);
        add(
            &mut simulated,
            case.simulated(&file, seed),
            1.0 / case.seeds as f64,
        );
        add(&mut same, on_same, 1.0 / case.seeds as f64);
        expected = on_expected;
        scatter = over_period.map(|s| s / (case.seeds as f64).sqrt());
    }
    let [simulated, same, expected] = [simulated, same, expected].map(|r| r.map(f64::sqrt));
    let rigid = textbook(case, &file, (1.0, 80.0));
    let wide = textbook(case, &file, (0.1, 300.0));
    for k in 0..4 {
        eprintln!(
            "{:?} {} km/h {:17} simulated {:.4}, theory on the same track {:.4} ({:+.2} %), expected {:.4} +- {:.1} %, rigid rails {:.4}, all waves {:.4}, table {:.3} ({:+.1} %)",
            case.class,
            case.kmh,
            NAMES[k],
            simulated[k],
            same[k],
            100.0 * (simulated[k] / same[k] - 1.0),
            expected[k],
            100.0 * scatter[k],
            rigid[k],
            wide[k],
            table[k],
            100.0 * (simulated[k] / table[k] - 1.0)
        );
    }
    for k in 0..4 {
        let name = NAMES[k];
        assert!((simulated[k] / same[k] - 1.0).abs() < 0.008, "{name}");
        assert!(
            (simulated[k] / expected[k] - 1.0).abs() < 3.0 * scatter[k] + 0.02,
            "{name}"
        );
        assert!((simulated[k] / table[k] - 1.0).abs() < 0.15, "{name}");
    }
}

fn low(kmh: f64) -> Case {
    Case {
        kmh,
        class: IrregularityClass::GermanLow,
        roughness: 4.032e-7,
        // Slow runs are long: one is enough.
        seeds: if kmh < 30.0 { 1 } else { 3 },
    }
}

fn high(kmh: f64) -> Case {
    Case {
        kmh,
        class: IrregularityClass::GermanHigh,
        roughness: 1.08e-6,
        seeds: 3,
    }
}

/// Fails where springs, dampers, time delays between the wheelsets or the track's spectrum are
/// wrong: low disturbance, in town.
#[test]
fn val_ride_german_low_slow() {
    check(&low(20.0), [0.0093, 0.0167, 0.5202, 0.0493]);
    check(&low(40.0), [0.0381, 0.0523, 1.2058, 0.1183]);
}

/// The same at line speed.
#[test]
fn val_ride_german_low_fast() {
    check(&low(60.0), [0.0633, 0.0898, 1.7586, 0.1927]);
    check(&low(80.0), [0.0970, 0.1216, 2.2159, 0.2136]);
}

/// The same for high disturbance.
#[test]
fn val_ride_german_high() {
    check(&high(60.0), [0.1036, 0.1470, 2.8781, 0.3154]);
    check(&high(80.0), [0.1587, 0.1990, 3.6266, 0.3495]);
}
