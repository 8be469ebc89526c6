//! Which lights and shadows may matter on a surface in a ball, as sets of numbers, and the lists that
//! the shader reads. Lights have the first numbers of a set, then come casts, then once more the
//! lights, of those that no body hides in whole.

use super::casts::{self, Bodies, Cast};
use super::occluder::LinesCut;
use crate::twin::render::gpu::region::Region;
use crate::twin::render::gpu::tiles::Eyes;
use crate::twin::render::gpu::view::Framed;
use crate::twin::render::lamp_field::LampField;
use crate::twin::render::light_source::LightSource;
use crate::twin::render::scene::Job;
use nalgebra::Point3;

/// What matters in a tile, in the lists: where its hidden lights begin, and its shaded ones, from `shaded`
/// on; others from `plain` on.
pub struct TileLists {
    pub shaded: u32,
    pub plain: u32,
    pub end: u32,
    /// Whether there are any bodies but capsules.
    pub others: bool,
}

/// The lights and bodies about a view, and which body may throw a shadow of which light.
pub struct Candidates<'j> {
    pub lights: Vec<LightSource<'j>>,
    pub bodies: Bodies<'j>,
    pub casts: Vec<Cast>,
    pub eyes: Eyes,
    /// Where the camera is in the middle of the frame, and how far it goes from there.
    pub eye: (Point3<f64>, f64),
}

impl<'j> Candidates<'j> {
    /// Of a view; none where nothing may throw a shadow.
    pub fn of(framed: &Framed<'_>, job: &'j Job, lamps: &'j LampField) -> Option<Self> {
        let bodies = casts::bodies(framed, job);
        let lights = casts::lights(framed, job, lamps);
        let casts = casts::casts(&lights, &bodies);
        if casts.is_empty() {
            return None;
        }
        let eyes = Eyes::of(framed, job.time);
        Some(Self {
            lights,
            bodies,
            casts,
            eye: (framed.reference(), eyes.travel_m(&framed.reference())),
            eyes,
        })
    }

    /// Whether a cast may fall on anything in a region.
    pub fn may_fall_on(&self, cast: usize, region: &Region) -> bool {
        let cast = &self.casts[cast];
        let light = &self.lights[cast.light];
        region.may_be_lit(light) && cast.may_fall_on(light, region)
    }

    /// Those of some casts that may fall on anything in a region.
    pub fn falling_on(&self, casts: &[usize], region: &Region) -> Vec<usize> {
        let casts = casts.iter().copied();
        casts.filter(|k| self.may_fall_on(*k, region)).collect()
    }

    /// Makes the set of some casts, and of the lights on a surface in a ball: those casts that fall on it
    /// in part or in whole, the lights, and those lights that no body hides in whole.
    pub fn collect(&self, casts: &[usize], region: &Region) -> Vec<u64> {
        let lights = self.lights.len();
        let mut set = vec![0; (2 * lights + self.casts.len()).div_ceil(64)];
        for (k, light) in self.lights.iter().enumerate() {
            if region.may_be_lit(light) {
                put(&mut set, k);
                put(&mut set, self.open(k));
            }
        }
        for k in casts {
            let cast = &self.casts[*k];
            let light = &self.lights[cast.light];
            let disc = Region::around(light.centre, light.radius_m);
            let cut = self.bodies.solids[cast.body].cut(region, &disc);
            if cut != LinesCut::None {
                put(&mut set, lights + k);
            }
            if cut == LinesCut::All {
                take(&mut set, self.open(cast.light));
            }
        }
        set
    }

    /// The number of a light that is not hidden in whole.
    fn open(&self, light: usize) -> usize {
        self.lights.len() + self.casts.len() + light
    }

    /// Whether a body hides all that is in a region from the camera.
    pub fn hides(&self, region: &Region) -> bool {
        let eye = Region::around(self.eye.0, self.eye.1);
        let mut large = (self.bodies.solids.iter()).filter(|s| s.radius_m > region.radius_m);
        large.any(|solid| solid.cut(region, &eye) == LinesCut::All)
    }

    /// Appends the list of a set.
    pub fn list(&self, set: &[u64], lists: &mut Vec<u32>) -> TileLists {
        let lights = self.lights.len();
        let (shaded, mut others) = (lists.len() as u32, false);
        let casts_in = |light: usize| {
            let first = self.casts.partition_point(|cast| cast.light < light);
            (self.casts[first..].iter().zip(first..))
                .take_while(move |(cast, _)| cast.light == light)
                .filter(|(_, k)| has(set, lights + k))
                .map(|(cast, _)| cast)
        };
        let lit = || (0..lights).filter(|k| has(set, *k));
        let is_hidden = |light: &usize| !has(set, self.open(*light));
        let is_shaded = |light: &usize| !is_hidden(light) && casts_in(*light).next().is_some();
        // Where the hidden lights begin is known when the shaded ones are there.
        lists.push(0);
        for light in lit().filter(is_shaded) {
            let first = lists.len() + 3;
            let count = casts_in(light).count();
            let capsules = casts_in(light)
                .filter(|c| c.body < self.bodies.capsules)
                .count();
            others |= count > capsules;
            lists.extend([light, first + capsules, first + count].map(|k| k as u32));
            lists.extend(casts_in(light).map(|cast| cast.body as u32));
        }
        lists[shaded as usize] = lists.len() as u32;
        lists.extend(lit().filter(is_hidden).map(|light| light as u32));
        let border = lists.len() as u32;
        let is_plain = |light: &usize| !is_hidden(light) && !is_shaded(light);
        lists.extend(lit().filter(is_plain).map(|light| light as u32));
        TileLists {
            shaded,
            plain: border,
            end: lists.len() as u32,
            others,
        }
    }
}

/// Whether a number is in a set.
pub fn has(set: &[u64], number: usize) -> bool {
    set[number / 64] >> (number % 64) & 1 == 1
}

fn put(set: &mut [u64], number: usize) {
    set[number / 64] |= 1 << (number % 64);
}

fn take(set: &mut [u64], number: usize) {
    set[number / 64] &= !(1 << (number % 64));
}
