//! Scattering centres of bodies: trains, obstacles, people.
//!
//! **Obstacles** echo by the pieces of their surface ([`super::facet`]), the smaller the nearer, for only what a lobe lights
//! glints; the material gives reflectivity (permittivities of
//! Recommendation ITU-R P.2040: concrete 5.24, wood 1.99; polyethylene 2.3; cardboard, mostly air, 1.3).
//!
//! **Vehicles.** Pieces as well, with panels that bend (slopes of 12 deg) and in sum so much that the mean over the
//! azimuth of a passenger car, 4.5 m x 1.8 m x 1.5 m, is the setting: 10 m^2, as radar texts and automotive practice take it.
//!
//! **Trains.** The boxes of cars are such pieces: an end square to the line echoes strongly, long sides met along hardly.
//! A coupler sticks out of each end of a car, and four centres of bogies hang below it.
//!
//! **People** are 12 centres over trunk, head and legs, of 0.5 m^2 in the mean together (measured at 77 GHz: some
//! -8 to 0 dBsm, Fortuny-Guasch and Chareau, EUR 25762, JRC 2013). Nobody stands still to a fraction of the wave
//! (3.9 mm): each centre sways by some mm from frame to frame, so that the sum fluctuates as Swerling's first case,
//! constant in a frame and exponential over frames.
//!
//! Not modelled: windows, which let waves into cars; limbs that swing within a frame (no micro-Doppler); edges;
//! polarisation; the sum of several bounces within a body.

use super::Centre;
use super::facet::{EchoSurface, Facet, reflectivity_of};
use super::shapes::{facets, piece_m};
use crate::settings::settings;
use crate::twin::geometry::{Body, Shape};
use crate::twin::physics::{BodyOwner, ObstacleMaterial};
use crate::twin::random::Stream;
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

settings! {
    /// How bodies echo.
    #[derive(Copy)]
    pub struct BodyEchoSettings {
        /// Mean cross-section of a person, m^2.
        person_m2: f64 = 0.5, in 0.0..=100.0;
        /// Mean cross-section of a passenger car, m^2.
        car_m2: f64 = 10.0, in 0.0..=1000.0;
        /// Slopes of flat sheet, deg: it is bent and dented.
        sheet_slope_deg: f64 = 3.0, in 0.1..=30.0;
        /// Slopes of train bodies, deg: their ends are shaped.
        train_slope_deg: f64 = 8.0, in 0.1..=30.0;
        /// Share of the power that edges and fittings scatter evenly.
        diffuse_share: f64 = 0.3, in 0.0..=1.0;
        /// Cross-section of a coupler, met from its end, m^2.
        coupler_m2: f64 = 3.0, in 0.0..=1000.0;
        /// Of each side of a bogie, m^2.
        bogie_m2: f64 = 2.0, in 0.0..=1000.0;
        /// By how much each part of a person sways from frame to frame, mm.
        sway_mm: f64 = 2.0, in 0.0..=100.0;
    }
}

/// Slopes of a car's panels, radians.
const PANEL_RAD: f64 = 0.21;
/// A passenger car, half of its length, width and height.
const CAR_HALF_M: [f64; 3] = [2.25, 0.9, 0.75];
/// Centres on each limb of a person.
const ON_LIMB: u64 = 3;
/// Bogies: from the end of a car, beside its middle, below its box.
const BOGIE_M: [f64; 3] = [3.5, 0.8, 0.2];
/// A coupler: out of the end of a car's box, above its bottom.
const COUPLER_M: [f64; 2] = [0.3, 0.3];

/// What bodies are to a radar.
#[derive(Clone, Debug)]
pub struct BodyEchoes {
    settings: BodyEchoSettings,
    wave_m: f64,
    /// Of a piece of a vehicle, so that a passenger car has its mean.
    vehicle_gain: f64,
    stream: Stream,
}

/// A body to find the centres of.
pub struct SeenBody<'a> {
    /// It.
    pub body: &'a Body,
    /// What it belongs to.
    pub owner: BodyOwner,
    /// Its place among those of its owner, and how many there are.
    pub part: [usize; 2],
    /// Its material, of an obstacle.
    pub material: ObstacleMaterial,
}

impl BodyEchoes {
    /// For a wave length; what is fixed at random follows from a stream.
    pub fn new(settings: &BodyEchoSettings, wave_m: f64, stream: Stream) -> Self {
        let mut echoes = Self {
            settings: *settings,
            wave_m,
            vehicle_gain: 1.0,
            stream,
        };
        let mean_m2 = echoes.car_mean_m2();
        if mean_m2 > 0.0 {
            echoes.vehicle_gain = settings.car_m2 / mean_m2;
        }
        echoes
    }

    /// Mean over the azimuth of a passenger car, by the pieces of its box.
    fn car_mean_m2(&self) -> f64 {
        let car = facets(&Shape::Box(CAR_HALF_M.into()), f64::INFINITY);
        let surface = self.surface(ObstacleMaterial::Vehicle);
        let steps = 720;
        let sections = (0..steps).map(|k| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(steps)).sin_cos();
            let towards = Vector3::new(cos, sin, 0.0);
            car.iter()
                .map(|f| f.section_m2(&towards, &surface, self.wave_m))
                .sum::<f64>()
        });
        sections.sum::<f64>() / f64::from(steps)
    }

    fn surface(&self, material: ObstacleMaterial) -> EchoSurface {
        let reflectivity = match material {
            ObstacleMaterial::Metal => 1.0,
            ObstacleMaterial::Vehicle => self.vehicle_gain,
            ObstacleMaterial::Masonry => reflectivity_of(5.24),
            ObstacleMaterial::Wood => reflectivity_of(1.99),
            ObstacleMaterial::Plastic => reflectivity_of(2.3),
            ObstacleMaterial::Cardboard => reflectivity_of(1.3),
        };
        EchoSurface {
            reflectivity,
            slope_rad: match material {
                ObstacleMaterial::Vehicle => PANEL_RAD,
                _ => self.settings.sheet_slope_deg.to_radians(),
            },
            diffuse: self.settings.diffuse_share,
        }
    }

    /// The centres of a body as a radar at a place meets it in a frame; those that it cannot meet are left out.
    pub fn centres(&self, seen: &SeenBody<'_>, radar: &Point3<f64>, frame: u32) -> Vec<Centre> {
        match seen.owner {
            BodyOwner::Worker(number) => self.limb(seen, number, frame),
            BodyOwner::Car(..) if matches!(seen.body.shape, Shape::Sphere(_)) => Vec::new(),
            BodyOwner::Car(..) => {
                let surface = EchoSurface {
                    slope_rad: self.settings.train_slope_deg.to_radians(),
                    ..self.surface(ObstacleMaterial::Metal)
                };
                let mut centres = self.pieces(seen, &surface, radar);
                centres.extend(self.running_gear(seen, radar));
                centres
            }
            _ => self.pieces(seen, &self.surface(seen.material), radar),
        }
    }

    /// A number in 0..1 that is always the same for a part of a body.
    fn fixed(&self, seen: &SeenBody<'_>, number: u64) -> f64 {
        let kind = match seen.owner {
            BodyOwner::Obstacle(k) => k as u64,
            BodyOwner::Cable(k) => 1 << 20 | k as u64,
            BodyOwner::Worker(k) => 2 << 20 | k as u64,
            BodyOwner::Load(k) => 3 << 20 | k as u64,
            BodyOwner::Car(train, k) => 4 << 20 | (train.index() as u64) << 8 | k as u64,
            BodyOwner::Blade(k) => 5 << 20 | k as u64,
        };
        self.stream
            .uniform(kind << 32 | (seen.part[0] as u64) << 20 | number)
    }

    fn centre(
        &self,
        seen: &SeenBody<'_>,
        place: Point3<f64>,
        section_m2: f64,
        number: u64,
    ) -> Centre {
        Centre {
            place,
            velocity_mps: seen.body.velocity_mps,
            section_m2,
            phase_rad: TAU * self.fixed(seen, number),
            owner: Some(seen.owner),
        }
    }

    fn pieces(
        &self,
        seen: &SeenBody<'_>,
        surface: &EchoSurface,
        radar: &Point3<f64>,
    ) -> Vec<Centre> {
        let pose = seen.body.world_from_body;
        let at = pose.inverse_transform_point(radar);
        let half = seen.body.shape.half_extents_m();
        let nearest = at.coords.zip_map(&half, |x, half| x.max(-half).min(half));
        let piece_m = piece_m(surface.slope_rad, (at.coords - nearest).norm());
        let all = facets(&seen.body.shape, piece_m).into_iter().zip(0..);
        let met = all.filter_map(|(facet, number): (Facet, u64)| {
            let towards = (at - facet.place).try_normalize(1e-9)?;
            let section_m2 = facet.section_m2(&towards, surface, self.wave_m);
            (section_m2 > 0.0).then(|| self.centre(seen, pose * facet.place, section_m2, number))
        });
        met.collect()
    }

    /// Couplers and bogies of a car.
    fn running_gear(&self, seen: &SeenBody<'_>, radar: &Point3<f64>) -> Vec<Centre> {
        let (half, pose) = (seen.body.shape.half_extents_m(), seen.body.world_from_body);
        let mut centres = Vec::new();
        for (way, number) in [1.0, -1.0].into_iter().zip(0u64..) {
            let [out, up] = COUPLER_M;
            let coupler = Point3::new(way * (half.x + out), 0.0, up - half.z);
            let towards = (pose.inverse_transform_point(radar) - coupler).try_normalize(1e-9);
            let cosine = towards.map_or(0.0, |t| (way * t.x).max(0.0));
            let section_m2 = self.settings.coupler_m2 * cosine;
            centres.push(self.centre(seen, pose * coupler, section_m2, 1 << 16 | number));
            for (side, k) in [1.0, -1.0].into_iter().zip(2u64..) {
                let [from_end, beside, below] = BOGIE_M;
                let along = (half.x - from_end).max(0.0);
                let bogie = Point3::new(way * along, side * beside, -half.z - below);
                let number = (1 << 16) | (2 * k + number);
                centres.push(self.centre(seen, pose * bogie, self.settings.bogie_m2, number));
            }
        }
        centres
    }

    /// Centres of a person's limb, which sway from frame to frame.
    fn limb(&self, seen: &SeenBody<'_>, worker: usize, frame: u32) -> Vec<Centre> {
        let half = seen.body.shape.half_extents_m();
        let [_, limbs] = seen.part;
        let section_m2 = self.settings.person_m2 / (ON_LIMB * limbs.max(1) as u64) as f64;
        let on_limb = |number: u64| {
            let draw = |k: u64| 2.0 * self.fixed(seen, 8 * number + k) - 1.0;
            let inside = Vector3::new(0.7 * draw(1), 0.7 * draw(2), draw(3));
            let key = (u64::from(frame) << 32) | (seen.part[0] as u64) << 8 | (8 * number);
            let sway = Vector3::from_fn(|axis, _| self.sway(worker, key + axis as u64));
            let place =
                seen.body.world_from_body * Point3::from(half.component_mul(&inside)) + sway;
            self.centre(seen, place, section_m2, 8 * number)
        };
        (0..ON_LIMB).map(on_limb).collect()
    }

    /// How far a part of a person is off along one axis in a frame.
    fn sway(&self, worker: usize, key: u64) -> f64 {
        let [a, b, ..] = self.stream.words(worker as u32, u32::MAX);
        1e-3 * self.settings.sway_mm * Stream { key: [a, b] }.normal(key)
    }
}

#[cfg(test)]
mod tests;
