//! Which lights and shadows may matter on a surface in a ball, as sets of numbers, and the lists that
//! the shader reads. Lights have the first numbers of a set, then come casts, then once more the
//! lights, of those that no body hides in whole.

use super::casts::{self, Around, Bodies, Cast, Light};
use super::occluder::{Cut, End};
use super::tiles::Eyes;
use crate::twin::render::gpu::view::Framed;
use crate::twin::render::lamp_field::LampField;
use crate::twin::render::scene::Job;
use nalgebra::Point3;
use std::ops::Range;

/// What matters in a tile, in the lists: where its hidden lights begin, and its shaded ones, from `shaded`
/// on; others from `plain` on.
#[derive(Clone, Copy)]
pub struct List {
    pub shaded: u32,
    pub plain: u32,
    pub end: u32,
    /// Whether there are any bodies but capsules.
    pub others: bool,
}

/// The lights and bodies about a view, and which body may throw a shadow of which light.
pub struct Candidates<'j> {
    pub lights: Vec<Light<'j>>,
    pub bodies: Bodies<'j>,
    pub casts: Vec<Cast>,
    pub of_light: Vec<Range<usize>>,
    pub eyes: Eyes,
    /// Where the camera is in the middle of the frame, and how far it goes from there.
    pub eye: (Point3<f64>, f64),
}

impl<'j> Candidates<'j> {
    /// Of a view; none where nothing may throw a shadow.
    pub fn of(framed: &Framed<'_>, job: &'j Job, lamps: &LampField) -> Option<Self> {
        let bodies = casts::bodies(framed, job);
        let lights = casts::lights(framed, job, lamps);
        let (casts, of_light) = casts::casts(&lights, &bodies);
        if casts.is_empty() {
            return None;
        }
        let eyes = Eyes::of(framed, job.time);
        Some(Self {
            lights,
            bodies,
            casts,
            of_light,
            eye: (framed.reference(), eyes.travel_m(&framed.reference())),
            eyes,
        })
    }

    /// Appends those casts, of all or of the list from `first` on, that may fall on anything in a
    /// ball.
    pub fn narrow(&self, casts: &mut Vec<usize>, first: Option<usize>, around: Around<'_>) {
        let (centre, radius_m, normal) = around;
        let falls = |k: usize| {
            let cast = &self.casts[k];
            let light = &self.lights[cast.light];
            light.may_light(centre, radius_m, normal) && cast.may_fall_on(light, centre, radius_m)
        };
        match first {
            None => casts.extend((0..self.casts.len()).filter(|k| falls(*k))),
            Some(first) => {
                for at in first..casts.len() {
                    if falls(casts[at]) {
                        casts.push(casts[at]);
                    }
                }
            }
        }
    }

    /// Makes the set of some casts, and of the lights on a surface in a ball: those casts that fall on it
    /// in part or in whole, the lights, and those lights that no body hides in whole.
    pub fn collect(&self, casts: &[usize], around: Around<'_>, set: &mut Vec<u64>) {
        let (centre, radius_m, normal) = around;
        let lights = self.lights.len();
        set.clear();
        set.resize((2 * lights + self.casts.len()).div_ceil(64), 0);
        for (k, light) in self.lights.iter().enumerate() {
            if light.may_light(centre, radius_m, normal) {
                put(set, k);
                put(set, self.open(k));
            }
        }
        let ball = End { centre, radius_m };
        for k in casts {
            let cast = &self.casts[*k];
            let light = &self.lights[cast.light];
            let disc = End {
                centre: &light.centre,
                radius_m: light.radius_m,
            };
            let cut = self.bodies.solids[cast.body].cut(ball, disc);
            if cut != Cut::None {
                put(set, lights + k);
            }
            if cut == Cut::All {
                take(set, self.open(cast.light));
            }
        }
    }

    /// The number of a light that is not hidden in whole.
    fn open(&self, light: usize) -> usize {
        self.lights.len() + self.casts.len() + light
    }

    /// Whether a body hides all that is in a ball from the camera.
    pub fn hides(&self, centre: &Point3<f64>, radius_m: f64) -> bool {
        let ball = End { centre, radius_m };
        let eye = End {
            centre: &self.eye.0,
            radius_m: self.eye.1,
        };
        let mut large = self.bodies.solids.iter().filter(|s| s.radius_m > radius_m);
        large.any(|solid| solid.cut(ball, eye) == Cut::All)
    }

    /// Appends the list of a set.
    pub fn list(&self, set: &[u64], lists: &mut Vec<u32>) -> List {
        let lights = self.lights.len();
        let (shaded, mut others) = (lists.len() as u32, false);
        let casts_in = |light: usize| {
            let casts = self.of_light[light].clone();
            casts
                .filter(|k| has(set, lights + k))
                .map(|k| &self.casts[k])
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
        List {
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
