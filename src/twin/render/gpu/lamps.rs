//! The lamps of a view: for every row that one touches, where its disc is, how bright it is in each
//! part of the exposure, and its glare; in double precision.
//!
//! Where a lamp stands in the camera's frame is worked out at knots of time 150 us apart, and runs
//! straight between them: at 20 m/s^2 it strays from that by less than a micrometre.

use super::layout::{Glare, GlareRow, Instant, Lamp, LampRow};
use super::spread::PointSpread;
use super::view::{Framed, single};
use crate::twin::lights::LampLight;
use crate::twin::render::constants::{DARK_DISC_ALBEDO, FAINT_E, LAMP_SIGHT_M};
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::photometry::BlinkingLamp;
use crate::twin::render::scene::View;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use std::f64::consts::{PI, TAU};

/// No disc that comes nearer to the camera's plane than this is drawn.
const MIN_DEPTH_M: f64 = 0.1;
/// From knot to knot.
const KNOT_S: f64 = 150e-6;
const MAX_KNOTS: f64 = 4096.0;
/// A row sees a lamp anew each time that it has moved by this.
const STEP_PX: f64 = 0.25;
const MAX_INSTANTS: f64 = 64.0;
/// Points of a rim that its bounds are taken from, and what they may miss.
const RIM_POINTS: u32 = 32;
const RIM_SLACK: f64 = 1.05;

/// Lamps of the view at hand, and the buffers to make them in.
#[derive(Default)]
pub struct LampTable {
    poses: Vec<Isometry3<f64>>,
    track: Track,
    /// Discs in sight, far ones first.
    pub lamps: Vec<Lamp>,
    /// Rows of all of them.
    pub rows: Vec<LampRow>,
    /// Instants of all of those.
    pub instants: Vec<Instant>,
    /// Glare in sight.
    pub glares: Vec<Glare>,
    /// Rows of all of it.
    pub glare_rows: Vec<GlareRow>,
}

/// A lamp as the camera has it at one time.
#[derive(Clone, Copy, Debug)]
struct SeenLamp {
    centre: Vector3<f64>,
    normal: Vector3<f64>,
    image: Point2<f64>,
    apparent_px: f64,
    /// Signal of a good lamp that stays on, in this direction, and as the near and wide part of its
    /// glare.
    signal_e: f64,
    near_e: f64,
    wide_e: f64,
}

impl SeenLamp {
    /// Nothing where the lamp shows its back or reaches the camera's plane.
    fn new(view: &View, lamp: &LampLight, camera_from_world: &Isometry3<f64>) -> Option<Self> {
        let centre = camera_from_world * lamp.centre;
        let normal = camera_from_world.rotation * lamp.facing.into_inner();
        let lean = (1.0 - normal.z * normal.z).max(0.0).sqrt();
        let cosine = -normal.dot(&centre.coords) / centre.coords.norm();
        if centre.z - lamp.radius_m * lean <= MIN_DEPTH_M || cosine <= 0.0 {
            return None;
        }
        let lens = &view.camera.intrinsics;
        let apparent_px = lens.fx_px * lamp.radius_m * cosine.sqrt() / centre.z;
        let signal_e =
            lamp.luminance_cd_m2 * cosine.powf(lamp.exponent - 1.0) * view.electrons_per_cd_m2();
        let glare = view.lens.glare(apparent_px, signal_e);
        Some(Self {
            centre: centre.coords,
            normal,
            image: lens.project(&centre)?,
            apparent_px,
            signal_e,
            near_e: glare.near,
            wide_e: glare.wide,
        })
    }

    fn mix(&self, other: &Self, x: f64) -> Self {
        let between = |a: f64, b: f64| a + (b - a) * x;
        Self {
            centre: self.centre.lerp(&other.centre, x),
            normal: self.normal.lerp(&other.normal, x),
            image: self.image.lerp(&other.image, x),
            apparent_px: between(self.apparent_px, other.apparent_px),
            signal_e: between(self.signal_e, other.signal_e),
            near_e: between(self.near_e, other.near_e),
            wide_e: between(self.wide_e, other.wide_e),
        }
    }
}

/// A lamp through a frame.
#[derive(Default)]
struct Track {
    step_s: f64,
    knots: Vec<Option<SeenLamp>>,
}

impl Track {
    /// At a time after the view's start.
    fn at(&self, t_s: f64) -> Option<SeenLamp> {
        let last = self.knots.len().checked_sub(1)?;
        if last == 0 {
            return self.knots[0];
        }
        let x = (t_s / self.step_s).clamp(0.0, last as f64);
        let k = (x as usize).min(last - 1);
        let (a, b) = (self.knots[k].as_ref()?, self.knots[k + 1].as_ref()?);
        Some(a.mix(b, x - k as f64))
    }

    fn most(&self, of: impl Fn(&SeenLamp) -> f64) -> f64 {
        let knots = self.knots.iter().flatten();
        knots.map(of).fold(0.0, f64::max)
    }
}

impl LampTable {
    /// Makes the tables of all lamps that the view may see.
    pub fn fill(&mut self, framed: &Framed<'_>, scene: &LitScene, airlight_cd_m2: f64) {
        self.lamps.clear();
        self.rows.clear();
        self.instants.clear();
        self.glares.clear();
        self.glare_rows.clear();
        let from = framed.reference();
        let mut near: Vec<(f64, &BlinkingLamp)> = (scene.lamps.lamps().iter())
            .map(|lamp| ((lamp.centre - from).norm(), lamp))
            .filter(|(d, _)| *d < LAMP_SIGHT_M)
            .collect();
        if near.is_empty() {
            return;
        }
        near.sort_by(|a, b| f64::total_cmp(&b.0, &a.0));
        self.place_knots(framed.view);
        for (away_m, lamp) in near {
            self.follow(framed.view, lamp);
            if self.track.knots.iter().any(Option::is_some) {
                let clear = scene.air.transmission(away_m);
                let exposed = Exposed::new(framed.view, lamp, clear);
                self.add_disc(&exposed, scene.tunnel.ambient_lx, airlight_cd_m2);
                self.add_glare(&exposed);
            }
        }
    }

    fn place_knots(&mut self, view: &View) {
        let rows = view.camera.intrinsics.height_px;
        let span_s = view.camera.shutter.frame_span_s(rows);
        let steps = if view.motion.poses.len() > 1 {
            (span_s / KNOT_S).ceil().clamp(1.0, MAX_KNOTS)
        } else {
            0.0
        };
        self.track.step_s = span_s / steps.max(1.0);
        self.poses.clear();
        self.poses.extend((0..=steps as u32).map(|k| {
            let t = view.start.plus(f64::from(k) * self.track.step_s);
            view.motion.pose_at(t).inverse()
        }));
    }

    fn follow(&mut self, view: &View, lamp: &LampLight) {
        self.track.knots.clear();
        let seen = self
            .poses
            .iter()
            .map(|pose| SeenLamp::new(view, lamp, pose));
        self.track.knots.extend(seen);
    }

    /// The rows within `reach_px` of a lamp, first and last, and the columns.
    fn bounds(&self, exposed: &Exposed<'_>, reach_px: Vector3<f64>) -> Option<LampBounds> {
        let lens = &exposed.view.camera.intrinsics;
        let (width, height) = (f64::from(lens.width_px), lens.height_px);
        let mut bounds: Option<LampBounds> = None;
        for v in 0..height {
            let Some(lamp) = self.track.at(exposed.mid_s(v)) else {
                continue;
            };
            let at = lamp.image;
            let (left, right) = (at.x - reach_px.x, at.x + reach_px.x);
            let near = (f64::from(v) - at.y).abs() <= reach_px.y;
            if near && right >= -0.5 && left <= width - 0.5 {
                let b = bounds.get_or_insert(LampBounds {
                    rows: (v, v),
                    columns: (left, right),
                });
                b.rows.1 = v;
                b.columns = (b.columns.0.min(left), b.columns.1.max(right));
            }
        }
        if let Some(b) = &mut bounds {
            b.columns = (
                b.columns.0.floor().max(0.0) - 0.5,
                b.columns.1.ceil().min(width - 1.0) + 0.5,
            );
        }
        bounds
    }

    fn add_disc(&mut self, exposed: &Exposed<'_>, ambient_lx: f64, airlight_cd_m2: f64) {
        let (view, lamp) = (exposed.view, exposed.lamp);
        let Some(extent_px) = self.extent_px(exposed) else {
            return;
        };
        let spread = self.spread(exposed);
        let ends_px = 1.1 * spread.ends_px;
        let smear = self.smear_px(exposed);
        let reach_px = extent_px * RIM_SLACK + smear.add_scalar(ends_px + 0.5);
        let Some(bounds) = self.bounds(exposed, reach_px) else {
            return;
        };
        let count = (smear.norm() / STEP_PX).ceil().clamp(1.0, MAX_INSTANTS) as u32;
        let direct_cd_m2 = view.lens.direct_share() * lamp.luminance_cd_m2;
        let axial_e = direct_cd_m2 * view.electrons_per_cd_m2();
        let dark_cd_m2 = exposed.clear * DARK_DISC_ALBEDO * ambient_lx / PI
            + (1.0 - exposed.clear) * airlight_cd_m2;
        let dark_e = dark_cd_m2 * view.electrons_per_cd_m2();
        let ([low, high], first_row) = bounds.corners();
        self.lamps.push(Lamp {
            low,
            high,
            first_row,
            rows_at: self.rows.len() as u32,
            instants_at: self.instants.len() as u32,
            instants: count,
            radius_m: lamp.radius_m as f32,
            exponent: (lamp.exponent - 1.0) as f32,
            dark_e: dark_e as f32,
            sharp: (1.0 / spread.sigma_px) as f32,
            flat: spread.flat as f32,
            ends_px: spread.ends_px as f32,
        });
        let step_s = view.camera.shutter.exposure_s / f64::from(count);
        for v in bounds.rows.0..=bounds.rows.1 {
            let open_s = exposed.open_s(v);
            for k in 0..count {
                let from_s = open_s + f64::from(k) * step_s;
                let part_e = axial_e * exposed.light(from_s, step_s) / f64::from(count);
                let seen = self.track.at(from_s + 0.5 * step_s);
                // A disc behind the camera is hit by no ray.
                let centre = seen.map_or(Vector3::new(0.0, 0.0, -1e3), |s| s.centre);
                self.instants.push(Instant {
                    centre: single(&centre),
                    signal_e: part_e as f32,
                });
            }
            let seen = self.track.at(exposed.mid_s(v));
            let normal = seen.map_or(-Vector3::z(), |s| s.normal);
            self.rows.push(LampRow {
                normal: single(&normal),
                unused: 0.0,
            });
        }
    }

    /// The spread of the lamp's light, at the depth that it has in the middle of the picture.
    fn spread(&self, exposed: &Exposed<'_>) -> PointSpread {
        let view = exposed.view;
        let middle = exposed.mid_s(view.camera.intrinsics.height_px / 2);
        let depth_m = self.track.at(middle).map_or(f64::INFINITY, |s| s.centre.z);
        PointSpread::new(view.lens.blur_px, view.confusion_px(depth_m.max(0.1)))
    }

    /// How far the rim reaches from the centre in the image, in the row that sees the centre.
    fn extent_px(&self, exposed: &Exposed<'_>) -> Option<Vector3<f64>> {
        let (lens, lamp) = (&exposed.view.camera.intrinsics, exposed.lamp);
        let rows = (0..lens.height_px).step_by(4);
        let seen = rows.filter_map(|v| {
            let seen = self.track.at(exposed.mid_s(v))?;
            Some(((seen.image.y - f64::from(v)).abs(), seen))
        });
        let (_, seen) = seen.min_by(|a, b| f64::total_cmp(&a.0, &b.0))?;
        let across = seen.normal.cross(&Vector3::x());
        let other = seen.normal.cross(&Vector3::y());
        let side = if across.norm() > other.norm() {
            across.normalize()
        } else {
            other.normalize()
        };
        let up = seen.normal.cross(&side);
        let mut extent_px = Vector3::zeros();
        for k in 0..RIM_POINTS {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(RIM_POINTS)).sin_cos();
            let rim = seen.centre + (side * cos + up * sin) * lamp.radius_m;
            let off = lens.project(&Point3::from(rim))? - seen.image;
            extent_px = extent_px.sup(&Vector3::new(off.x.abs(), off.y.abs(), 0.0));
        }
        Some(extent_px)
    }

    /// How far the image moves in a row's exposure: the most of three rows.
    fn smear_px(&self, exposed: &Exposed<'_>) -> Vector3<f64> {
        let last = exposed.view.camera.intrinsics.height_px.max(1) - 1;
        let exposure_s = exposed.view.camera.shutter.exposure_s;
        let moved = [0, last / 2, last].into_iter().filter_map(|v| {
            let open_s = exposed.open_s(v);
            let (a, b) = (self.track.at(open_s)?, self.track.at(open_s + exposure_s)?);
            let off = b.image - a.image;
            Some(Vector3::new(off.x.abs(), off.y.abs(), 0.0))
        });
        moved.fold(Vector3::zeros(), |a, b| a.sup(&b))
    }

    fn add_glare(&mut self, exposed: &Exposed<'_>) {
        let (view, lamp) = (exposed.view, exposed.lamp);
        let reach_px = self.track.most(|s| {
            let glare = view.lens.glare(s.apparent_px, exposed.clear * s.signal_e);
            glare.reach_px(FAINT_E)
        });
        if reach_px <= 0.0 || lamp.level <= 0.0 {
            return;
        }
        let Some(bounds) = self.bounds(exposed, Vector3::repeat(reach_px)) else {
            return;
        };
        let ([low, high], first_row) = bounds.corners();
        self.glares.push(Glare {
            low,
            high,
            first_row,
            rows_at: self.glare_rows.len() as u32,
        });
        let exposure_s = view.camera.shutter.exposure_s;
        for v in bounds.rows.0..=bounds.rows.1 {
            let row = self.track.at(exposed.mid_s(v)).map(|s| {
                let light = exposed.light(exposed.open_s(v), exposure_s);
                let wide_px2 = view.lens.veil_px.powi(2) + s.apparent_px.powi(2);
                GlareRow {
                    centre_px: [s.image.x as f32, s.image.y as f32],
                    apparent_px: s.apparent_px as f32,
                    near_e: (light * s.near_e) as f32,
                    wide_e: (light * s.wide_e) as f32,
                    wide_px2: wide_px2 as f32,
                }
            });
            // Where the lamp is out of sight there is nothing, of any width.
            self.glare_rows.push(row.unwrap_or(GlareRow {
                wide_px2: 1.0,
                ..GlareRow::default()
            }));
        }
    }
}

/// Rows and columns that a lamp touches.
struct LampBounds {
    rows: (u32, u32),
    columns: (f64, f64),
}

impl LampBounds {
    /// For the rasteriser, and the first row.
    fn corners(&self) -> ([[f32; 2]; 2], i32) {
        let (first, last) = (self.rows.0 as f32, self.rows.1 as f32);
        let low = [self.columns.0 as f32, first - 0.5];
        let high = [self.columns.1 as f32, last + 0.5];
        ([low, high], self.rows.0 as i32)
    }
}

/// A lamp and the times at which rows see it.
struct Exposed<'a> {
    view: &'a View,
    lamp: &'a BlinkingLamp,
    start_s: f64,
    /// Share of its light that the air lets through.
    clear: f64,
}

impl<'a> Exposed<'a> {
    fn new(view: &'a View, lamp: &'a BlinkingLamp, clear: f64) -> Self {
        Self {
            clear,
            view,
            lamp,
            start_s: view.start.secs(),
        }
    }

    /// From the view's start to the opening of a row.
    fn open_s(&self, v: u32) -> f64 {
        self.view.camera.shutter.delay_s(f64::from(v))
    }

    /// To the middle of its exposure.
    fn mid_s(&self, v: u32) -> f64 {
        self.open_s(v) + 0.5 * self.view.camera.shutter.exposure_s
    }

    /// Mean light in a time after the view's start, as a share of that of a good lamp that stays on
    /// in clear air.
    fn light(&self, from_s: f64, span_s: f64) -> f64 {
        let open_s = self.start_s + from_s;
        self.clear * self.lamp.share(open_s, open_s + span_s)
    }
}
