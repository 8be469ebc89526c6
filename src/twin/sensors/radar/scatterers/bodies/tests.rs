use super::*;
use nalgebra::{Isometry3, Rotation3};

const WAVE_M: f64 = 3.9e-3;

fn body(shape: Shape) -> Body {
    Body {
        shape,
        world_from_body: Isometry3::translation(0.0, 0.0, 0.8),
        velocity_mps: Vector3::zeros(),
        albedo: 0.3,
        luminance_cd_m2: 0.0,
    }
}

fn echoes(settings: &BodyEchoSettings) -> BodyEchoes {
    BodyEchoes::new(settings, WAVE_M, Stream::new(3, 0, "bodies"))
}

/// Power of the sum of all centres, as a cross-section.
fn coherent_m2(centres: &[Centre], radar: &Point3<f64>) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for centre in centres {
        let way = (2.0 * (centre.place - radar).norm() / WAVE_M).fract();
        let (sin, cos) = (TAU * way + centre.phase_rad).sin_cos();
        re += centre.section_m2.sqrt() * cos;
        im += centre.section_m2.sqrt() * sin;
    }
    re * re + im * im
}

fn around(k: u32, of: u32) -> Point3<f64> {
    let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), TAU * f64::from(k) / f64::from(of));
    Point3::from(turned * Vector3::new(200.0, 0.0, 0.0)) + Vector3::new(0.0, 0.0, 0.8)
}

/// Trunk, head and legs of a standing worker.
fn person() -> Vec<Body> {
    let limb = |shape, y: f64, z: f64| Body {
        world_from_body: Isometry3::translation(0.0, y, z),
        ..body(shape)
    };
    vec![
        limb(Shape::Capsule(0.17, 0.17), 0.0, 1.19),
        limb(Shape::Sphere(0.11), 0.0, 1.64),
        limb(Shape::Capsule(0.08, 0.37), 0.09, 0.45),
        limb(Shape::Capsule(0.08, 0.37), -0.09, 0.45),
    ]
}

fn person_centres(echoes: &BodyEchoes, radar: &Point3<f64>, frame: u32) -> Vec<Centre> {
    let limbs = person();
    let of_limb = |(k, body): (usize, &Body)| {
        let seen = SeenBody {
            body,
            owner: BodyOwner::Worker(0),
            part: [k, 4],
            material: ObstacleMaterial::Metal,
        };
        echoes.centres(&seen, radar, frame)
    };
    limbs.iter().enumerate().flat_map(of_limb).collect()
}

/// A mean of 0.5 m^2 over aspects and frames, and of a car 10 m^2 over aspects: each within 10 %. An aspect of the car
/// is one draw of an exponential: 7200 of them scatter by 1.2 %, and lobes weigh on it.
#[test]
fn val_persons_and_cars_have_their_means() {
    let echoes = echoes(&BodyEchoSettings::default());
    let n = 2000;
    let sections = (0..n).map(|k| {
        let radar = around(k, n);
        coherent_m2(&person_centres(&echoes, &radar, k), &radar)
    });
    let mean = sections.sum::<f64>() / f64::from(n);
    assert!((mean / 0.5 - 1.0).abs() < 0.1, "person {mean} m^2");
    let car = body(Shape::Box(Vector3::new(2.25, 0.9, 0.75)));
    let n = 7200;
    let sections = (0..n).map(|k| {
        let radar = around(k, n);
        let seen = SeenBody {
            body: &car,
            owner: BodyOwner::Obstacle(0),
            part: [0, 1],
            material: ObstacleMaterial::Vehicle,
        };
        coherent_m2(&echoes.centres(&seen, &radar, 0), &radar)
    });
    let mean = sections.sum::<f64>() / f64::from(n);
    assert!((mean / 10.0 - 1.0).abs() < 0.1, "car {mean} m^2");
}

/// Over frames a person's cross-section is exponential (Swerling's first case): chi-square over ten classes of equal
/// share, 9 degrees of freedom, 27.9 at 0.1 %. Twelve equal centres differ from it by 0.9 in the mean of chi-square.
#[test]
fn a_person_fluctuates_as_swerling_1() {
    let echoes = echoes(&BodyEchoSettings::default());
    let (n, radar) = (600u32, Point3::new(40.0, 0.3, 1.0));
    let mut classes = [0u32; 10];
    for frame in 0..n {
        let section = coherent_m2(&person_centres(&echoes, &radar, frame), &radar);
        let below = 1.0 - (-section / 0.5).exp();
        classes[((10.0 * below) as usize).min(9)] += 1;
    }
    let expected = f64::from(n) / 10.0;
    let chi: f64 = classes
        .iter()
        .map(|&c| (f64::from(c) - expected).powi(2) / expected)
        .sum();
    assert!(chi < 27.9, "{chi}: {classes:?}");
    // Within a frame nothing fluctuates.
    assert_eq!(
        person_centres(&echoes, &radar, 7),
        person_centres(&echoes, &radar, 7)
    );
}

fn total_m2(
    echoes: &BodyEchoes,
    body: &Body,
    owner: BodyOwner,
    material: ObstacleMaterial,
    radar: &Point3<f64>,
) -> f64 {
    let seen = SeenBody {
        body,
        owner,
        part: [0, 1],
        material,
    };
    echoes
        .centres(&seen, radar, 0)
        .iter()
        .map(|c| c.section_m2)
        .sum()
}

/// A box of sheet metal echoes most where a face is met square; wood some 15 dB less, cardboard some 24 dB less.
#[test]
fn boxes_echo_by_aspect_and_material() {
    let echoes = echoes(&BodyEchoSettings::default());
    let crate_ = body(Shape::Box(Vector3::repeat(0.3)));
    let of = |material, radar: Point3<f64>| {
        total_m2(&echoes, &crate_, BodyOwner::Obstacle(0), material, &radar)
    };
    let (square, turned) = (around(0, 8), around(1, 8));
    let metal = of(ObstacleMaterial::Metal, square);
    assert!(metal > 20.0 * of(ObstacleMaterial::Metal, turned));
    // Never more than an ideal plate.
    assert!(metal < 4.0 * std::f64::consts::PI * 0.36f64.powi(2) / WAVE_M.powi(2));
    let db = |material| 10.0 * (of(material, square) / metal).log10();
    assert!(
        (db(ObstacleMaterial::Wood) + 15.4).abs() < 0.5,
        "{}",
        db(ObstacleMaterial::Wood)
    );
    assert!(
        (db(ObstacleMaterial::Cardboard) + 23.7).abs() < 0.5,
        "{}",
        db(ObstacleMaterial::Cardboard)
    );
    assert!((db(ObstacleMaterial::Masonry) + 8.1).abs() < 0.5);
}

/// A car of a train echoes from its end far more than from 60 degrees off it; couplers and bogies are there.
#[test]
fn trains_echo_from_their_ends() {
    let echoes = echoes(&BodyEchoSettings::default());
    let car = body(Shape::Box(Vector3::new(9.75, 1.4, 1.7)));
    let owner = BodyOwner::Car(crate::bus::TrainId(1), 0);
    let of = |radar| total_m2(&echoes, &car, owner, ObstacleMaterial::Metal, &radar);
    let (end, slanted) = (of(around(0, 6)), of(around(1, 6)));
    assert!(end > 5.0 * slanted && slanted > 1.0, "{end}, {slanted}");
    let seen = SeenBody {
        body: &car,
        owner,
        part: [0, 1],
        material: ObstacleMaterial::Metal,
    };
    let centres = echoes.centres(&seen, &around(0, 6), 0);
    let low = centres.iter().filter(|c| c.place.z < 0.8 - 1.7);
    assert_eq!(low.count(), 4, "bogies");
    let ahead = centres
        .iter()
        .filter(|c| c.place.x > 9.8 && c.section_m2 > 2.9);
    assert_eq!(ahead.count(), 1, "coupler");
}
