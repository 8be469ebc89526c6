//! The whole chain on drawn images: raw pixels in, fixes out, held against the truth.

use super::{LedPositioner, LedSettings};
use crate::bus::{Identity, LedReport, Method, OdometerSample, SimTime};
use crate::stack::led::testing::{World, tunnel};
use std::sync::Arc;

/// Drives a world for some pairs from time `from_s` on, 30 pairs a second, and gives the reports.
fn drive(world: &World, positioner: &mut LedPositioner, from_s: f64, pairs: u32) -> Vec<LedReport> {
    let mut reports = Vec::new();
    for k in 0..pairs {
        let start_s = from_s + f64::from(k) / 30.0;
        for tick in 0..4 {
            let time_s = start_s + f64::from(tick) * 0.008;
            positioner.on_odometer(&OdometerSample {
                time: SimTime::from_secs(time_s),
                distance_m: world.speed_mps * time_s,
                speed_mps: world.speed_mps,
            });
        }
        reports.push(positioner.on_pair(&world.pair(k, start_s)));
    }
    reports
}

fn errors_m(world: &World, reports: &[LedReport], method: Method) -> Vec<f64> {
    let fixes = reports
        .iter()
        .flat_map(|r| &r.fixes)
        .filter(|f| f.method == method);
    fixes
        .map(|f| f.chainage_m - world.start_m - world.speed_mps * f.time.secs())
        .collect()
}

fn worst(errors: &[f64]) -> f64 {
    errors.iter().fold(0.0, |w, e| f64::max(w, e.abs()))
}

fn mean(errors: &[f64]) -> f64 {
    errors.iter().map(|e| e.abs()).sum::<f64>() / errors.len() as f64
}

#[test]
fn explore() {
    let map = Arc::new(tunnel("manchester"));
    let lamp = map.lamps[30].chainage_m;
    for k in 1..=20 {
        let ahead = 10.0 - 0.5 * f64::from(k - 1);
        let world = World::new(&map, lamp - ahead, 0.0);
        let mut p = LedPositioner::new(&LedSettings::default(), world.rig, map.clone());
        let reports = drive(&world, &mut p, 0.0, 12);
        let paper = errors_m(&world, &reports, Method::Paper);
        let mono = errors_m(&world, &reports, Method::Mono);
        for r in &reports {
            for f in r.fixes.iter().filter(|f| f.method == Method::Paper) {
                let e = f.chainage_m - world.start_m - world.speed_mps * f.time.secs();
                if e.abs() > 0.15 {
                    println!("   #{} {e:.3} L {:?} R {:?}", r.number, r.left, r.right);
                }
            }
        }
        let first = reports.iter().position(|r| !r.fixes.is_empty());
        let last = &reports[11];
        println!(
            "{ahead:5.1} m: first {first:?} n {} worst {:.3} mean {:.3} | mono {:.3} | {:?} sigma {:.3} z {:.2}",
            paper.len(),
            worst(&paper),
            mean(&paper),
            worst(&mono),
            last.left.first().map(|s| (
                s.bounds.u0,
                s.bounds.v0,
                s.bounds.u1,
                s.bounds.v1,
                s.cut,
                s.ellipse.is_some(),
                s.uid
            )),
            last.fixes.first().map_or(f64::NAN, |f| f.sigma_m),
            last.fixes.first().map_or(f64::NAN, |f| f.lamp_in_camera.z),
        );
    }
    for kmh in [20.0, 60.0, 100.0] {
        let mut world = World::new(&map, lamp - 25.0, kmh / 3.6);
        world.clock_ppm = 50.0;
        let mut p = LedPositioner::new(&LedSettings::default(), world.rig, map.clone());
        let reports = drive(&world, &mut p, 0.0, (45.0 / world.speed_mps * 30.0) as u32);
        let paper = errors_m(&world, &reports, Method::Paper);
        let mono = errors_m(&world, &reports, Method::Mono);
        println!(
            "{kmh} km/h: {} pairs {} fixes, worst {:.3} mean {:.3} mono {:.3} {:.3}",
            reports.len(),
            paper.len(),
            worst(&paper),
            mean(&paper),
            worst(&mono),
            mean(&mono)
        );
        let ids: String = reports
            .iter()
            .map(|r| match (r.left.first().map(|s| s.uid), r.fixes.first()) {
                (None, _) => '.',
                (Some(None), _) => '?',
                (_, None) => '-',
                (_, Some(f)) => match f.identity {
                    Identity::Decoded => 'D',
                    Identity::Joined => 'J',
                    Identity::Predicted => 'P',
                },
            })
            .collect();
        println!("{ids}");
    }
}
