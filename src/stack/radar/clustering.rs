//! Detections of one body as one.
//!
//! The strongest detection that is left leads: all that are near it in range, speed and azimuth are of its body. So a
//! cluster never grows along a wall, as it would if neighbours of neighbours came in. Place and speed are means weighted
//! by signal over noise.

use super::detector::{Resolution, Sighting};
use crate::numerics::wrapped;

/// What near means.
#[derive(Clone, Copy, Debug)]
pub struct Gates {
    /// Metres.
    pub range_m: f64,
    /// m/s.
    pub speed_mps: f64,
    /// In the sine of the azimuth.
    pub u: f64,
    /// From the least to the greatest speed that does not alias, m/s.
    pub span_mps: f64,
}

impl Gates {
    /// So many resolutions apart, and in range by half a body more.
    pub fn new(resolution: &Resolution, resolutions: f64, body_m: f64, span_mps: f64) -> Self {
        Self {
            range_m: resolutions * resolution.range_m + 0.5 * body_m,
            speed_mps: resolutions * resolution.speed_mps,
            u: resolutions * resolution.u,
            span_mps,
        }
    }

    fn has(&self, leader: &Sighting, other: &Sighting) -> bool {
        let (a, b) = (&leader.detection, &other.detection);
        (a.range_m - b.range_m).abs() <= self.range_m
            && wrapped(a.radial_speed_mps - b.radial_speed_mps, self.span_mps).abs()
                <= self.speed_mps
            && (a.azimuth_rad.sin() - b.azimuth_rad.sin()).abs() <= self.u
    }
}

/// One sighting of each body, in the order of their leaders; the cross-section is the sum of its parts'.
pub fn clusters(sightings: &[Sighting], gates: &Gates) -> Vec<Sighting> {
    let mut taken = vec![false; sightings.len()];
    let mut clusters = Vec::new();
    for k in 0..sightings.len() {
        if taken[k] {
            continue;
        }
        let leader = &sightings[k];
        let mut sum = Sum::default();
        for (other, is_taken) in sightings.iter().zip(&mut taken).skip(k) {
            if !*is_taken && gates.has(leader, other) {
                *is_taken = true;
                sum.add(leader, other, gates.span_mps);
            }
        }
        clusters.push(sum.mean(leader, gates.span_mps));
    }
    clusters
}

/// Against the leader: range, azimuth, speed.
#[derive(Default)]
struct Sum {
    weight: f64,
    offs: [f64; 3],
    cross_section_m2: f64,
}

impl Sum {
    fn add(&mut self, leader: &Sighting, other: &Sighting, span_mps: f64) {
        let (a, b) = (&leader.detection, &other.detection);
        let weight = 10f64.powf(0.1 * b.snr_db);
        let speed = wrapped(b.radial_speed_mps - a.radial_speed_mps, span_mps);
        let offs = [b.range_m - a.range_m, b.azimuth_rad - a.azimuth_rad, speed];
        for (sum, off) in self.offs.iter_mut().zip(offs) {
            *sum += weight * off;
        }
        self.weight += weight;
        self.cross_section_m2 += b.cross_section_m2;
    }

    fn mean(&self, leader: &Sighting, span_mps: f64) -> Sighting {
        let mut mean = *leader;
        let [range, azimuth, speed] = self.offs.map(|off| off / self.weight);
        let detection = &mut mean.detection;
        detection.range_m += range;
        detection.azimuth_rad += azimuth;
        detection.radial_speed_mps = wrapped(detection.radial_speed_mps + speed, span_mps);
        detection.cross_section_m2 = self.cross_section_m2;
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::RadarDetection;

    fn seen(range_m: f64, azimuth_rad: f64, radial_speed_mps: f64, snr_db: f64) -> Sighting {
        Sighting {
            detection: RadarDetection {
                range_m,
                radial_speed_mps,
                azimuth_rad,
                snr_db,
                cross_section_m2: 1.0,
            },
            fold: 0,
            sigmas: [0.1; 3],
        }
    }

    /// Parts of a body are one, at the mean of equals and at the speed where it aliases; what is far in any one of range,
    /// speed and azimuth is another; a row is not one body.
    #[test]
    fn near_detections_are_one_body() {
        let resolution = Resolution {
            range_m: 1.0,
            speed_mps: 1.0,
            u: 0.2,
        };
        let gates = Gates::new(&resolution, 1.0, 2.0, 40.0);
        let parts = [
            seen(50.0, 0.0, 19.9, 30.0),
            seen(51.0, 0.1, -19.9, 30.0),
            seen(50.0, 0.0, 17.0, 20.0),
            seen(50.0, 0.5, 19.9, 20.0),
            seen(54.0, 0.0, 19.9, 20.0),
        ];
        let found = clusters(&parts, &gates);
        assert_eq!(found.len(), 4);
        let body = &found[0].detection;
        assert!((body.range_m - 50.5).abs() < 1e-9 && (body.azimuth_rad - 0.05).abs() < 1e-9);
        assert!(
            (body.radial_speed_mps.abs() - 20.0).abs() < 1e-9,
            "{body:?}"
        );
        assert!((body.cross_section_m2 - 2.0).abs() < 1e-9);
        let row: Vec<Sighting> = (0..9)
            .map(|k| seen(50.0 + 1.5 * f64::from(k), 0.0, 0.0, 20.0))
            .collect();
        assert_eq!(clusters(&row, &gates).len(), 5);
        assert!(clusters(&[], &gates).is_empty());
    }
}
