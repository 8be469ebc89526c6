//! The lamps of a view: for every row that one touches, where its disc is, how bright it is in each
//! part of the exposure, and its glare; in double precision.
//!
//! Where a lamp stands in the camera's frame is worked out at knots of time 150 us apart, and runs
//! straight between them: at 20 m/s^2 it strays from that by less than a micrometre.

use super::layout::{DiscRow, GlareArea, GlareRow, Instant, Lamp};
use super::spread::PointSpread;
use super::view::{Framed, single};
use crate::twin::lights::LampLight;
use crate::twin::render::constants::{DARK_DISC_ALBEDO, FAINT_E, LAMP_SIGHT_M};
use crate::twin::render::lit_scene::{BODIES_TRACK, LitScene};
use crate::twin::render::photometry::BlinkingLamp;
use crate::twin::render::scene::View;
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
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

/// Lamps of a view.
#[derive(Default)]
pub struct LampTable {
    /// Discs in sight, far ones first.
    pub lamps: Vec<Lamp>,
    /// Rows of all of them.
    pub rows: Vec<DiscRow>,
    /// Instants of all of those.
    pub instants: Vec<Instant>,
    /// Glare in sight.
    pub glares: Vec<GlareArea>,
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
struct PassingLamp<'a> {
    view: &'a View,
    lamp: &'a BlinkingLamp,
    /// Share of its light that the air lets through.
    clear: f64,
    /// From knot to knot.
    step_s: f64,
    knots: Vec<Option<SeenLamp>>,
}

/// `camera_from_world` at the knots of a view, and from knot to knot.
fn knot_poses(view: &View) -> (Vec<Isometry3<f64>>, f64) {
    let rows = view.camera.intrinsics.height_px;
    let span_s = view.camera.shutter.frame_span_s(rows);
    let steps = if view.motion.poses.len() > 1 {
        (span_s / KNOT_S).ceil().clamp(1.0, MAX_KNOTS)
    } else {
        0.0
    };
    let step_s = span_s / steps.max(1.0);
    let time = |k: u32| view.start.plus(f64::from(k) * step_s);
    let poses = (0..=steps as u32).map(|k| view.motion.pose_at(time(k)).inverse());
    (poses.collect(), step_s)
}

impl PassingLamp<'_> {
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

    /// From the view's start to the opening of a row.
    fn open_s(&self, v: u32) -> f64 {
        self.view.camera.shutter.delay_s(f64::from(v))
    }

    /// In the middle of the exposure of a row.
    fn in_row(&self, v: u32) -> Option<SeenLamp> {
        self.at(self.open_s(v) + 0.5 * self.view.camera.shutter.exposure_s)
    }

    /// Mean light in a time after the view's start, as a share of that of a good lamp that stays on
    /// in clear air.
    fn light(&self, from_s: f64, span_s: f64) -> f64 {
        let open_s = self.view.start.secs() + from_s;
        self.clear * self.lamp.share(open_s, open_s + span_s)
    }

    /// The rows within `reach_px` of the lamp, first and last, and the columns.
    fn bounds(&self, reach_px: Vector2<f64>) -> Option<LampBounds> {
        let lens = &self.view.camera.intrinsics;
        let width = f64::from(lens.width_px);
        let mut bounds: Option<LampBounds> = None;
        for v in 0..lens.height_px {
            let Some(at) = self.in_row(v).map(|lamp| lamp.image) else {
                continue;
            };
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
        let mut bounds = bounds?;
        let (left, right) = bounds.columns;
        bounds.columns = (
            left.floor().max(0.0) - 0.5,
            right.ceil().min(width - 1.0) + 0.5,
        );
        Some(bounds)
    }

    /// The spread of the lamp's light, at the depth that it has in the middle of the picture.
    fn spread(&self) -> PointSpread {
        let middle = self.in_row(self.view.camera.intrinsics.height_px / 2);
        let depth_m = middle.map_or(f64::INFINITY, |s| s.centre.z);
        let confusion_px = self.view.confusion_px(depth_m.max(0.1));
        PointSpread::new(self.view.lens.blur_px, confusion_px)
    }

    /// How far the rim reaches from the centre in the image, in the row that sees the centre.
    fn extent_px(&self) -> Option<Vector2<f64>> {
        let lens = &self.view.camera.intrinsics;
        let seen = (0..lens.height_px).step_by(4).filter_map(|v| {
            let seen = self.in_row(v)?;
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
        let mut extent_px = Vector2::zeros();
        for k in 0..RIM_POINTS {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(RIM_POINTS)).sin_cos();
            let rim = seen.centre + (side * cos + up * sin) * self.lamp.radius_m;
            let off = lens.project(&Point3::from(rim))? - seen.image;
            extent_px = extent_px.sup(&off.abs());
        }
        Some(extent_px)
    }

    /// How far the image moves in a row's exposure: the most of three rows.
    fn smear_px(&self) -> Vector2<f64> {
        let last = self.view.camera.intrinsics.height_px.max(1) - 1;
        let exposure_s = self.view.camera.shutter.exposure_s;
        let moved = [0, last / 2, last].into_iter().filter_map(|v| {
            let open_s = self.open_s(v);
            let off = self.at(open_s + exposure_s)?.image - self.at(open_s)?.image;
            Some(off.abs())
        });
        moved.fold(Vector2::zeros(), |a, b| a.sup(&b))
    }
}

impl LampTable {
    /// Of all lamps that the view may see.
    pub fn new(framed: &Framed<'_>, scene: &LitScene, airlight_cd_m2: f64) -> Self {
        let mut table = Self::default();
        let from = framed.reference();
        let mut near: Vec<(f64, &BlinkingLamp)> = (scene.lamps.lamps().iter())
            .map(|lamp| ((lamp.centre - from).norm(), lamp))
            .filter(|(d, _)| *d < LAMP_SIGHT_M)
            .collect();
        near.sort_by(|a, b| f64::total_cmp(&b.0, &a.0));
        let (view, (poses, step_s)) = (framed.view, knot_poses(framed.view));
        for (away_m, lamp) in near {
            let seen = poses.iter().map(|pose| SeenLamp::new(view, lamp, pose));
            let passing = PassingLamp {
                view,
                lamp,
                clear: scene.air.transmission(away_m),
                step_s,
                knots: seen.collect(),
            };
            if passing.knots.iter().any(Option::is_some) {
                let ambient_lx = (scene.surroundings_on(BODIES_TRACK, &lamp.centre))
                    .on_surface_lx(&lamp.centre, &lamp.facing);
                table.add_disc(&passing, ambient_lx, airlight_cd_m2);
                table.add_glare(&passing);
            }
        }
        table
    }

    fn add_disc(&mut self, passing: &PassingLamp<'_>, ambient_lx: f64, airlight_cd_m2: f64) {
        let (view, lamp) = (passing.view, passing.lamp);
        let Some(extent_px) = passing.extent_px() else {
            return;
        };
        let (spread, smear) = (passing.spread(), passing.smear_px());
        let ends_px = 1.1 * spread.ends_px;
        let reach_px = extent_px * RIM_SLACK + smear.add_scalar(ends_px + 0.5);
        let Some(bounds) = passing.bounds(reach_px) else {
            return;
        };
        let count = (smear.norm() / STEP_PX).ceil().clamp(1.0, MAX_INSTANTS) as u32;
        let direct_cd_m2 = view.lens.direct_share() * lamp.luminance_cd_m2;
        let axial_e = direct_cd_m2 * view.electrons_per_cd_m2();
        let dark_cd_m2 = passing.clear * DARK_DISC_ALBEDO * ambient_lx / PI
            + (1.0 - passing.clear) * airlight_cd_m2;
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
            let open_s = passing.open_s(v);
            for k in 0..count {
                let from_s = open_s + f64::from(k) * step_s;
                let part_e = axial_e * passing.light(from_s, step_s) / f64::from(count);
                let seen = passing.at(from_s + 0.5 * step_s);
                // A disc behind the camera is hit by no ray.
                let centre = seen.map_or(Vector3::new(0.0, 0.0, -1e3), |s| s.centre);
                self.instants.push(Instant {
                    centre: single(&centre),
                    signal_e: part_e as f32,
                });
            }
            let seen = passing.in_row(v);
            let normal = seen.map_or(-Vector3::z(), |s| s.normal);
            self.rows.push(DiscRow {
                normal: single(&normal),
                unused: 0.0,
            });
        }
    }

    fn add_glare(&mut self, passing: &PassingLamp<'_>) {
        let (view, lamp) = (passing.view, passing.lamp);
        let reach_px = |seen: &SeenLamp| {
            let glare = (view.lens).glare(seen.apparent_px, passing.clear * seen.signal_e);
            glare.reach_px(FAINT_E)
        };
        let reaches_px = passing.knots.iter().flatten().map(reach_px);
        let reach_px = reaches_px.fold(0.0, f64::max);
        if reach_px <= 0.0 || lamp.level <= 0.0 {
            return;
        }
        let Some(bounds) = passing.bounds(Vector2::repeat(reach_px)) else {
            return;
        };
        let ([low, high], first_row) = bounds.corners();
        self.glares.push(GlareArea {
            low,
            high,
            first_row,
            rows_at: self.glare_rows.len() as u32,
        });
        let exposure_s = view.camera.shutter.exposure_s;
        for v in bounds.rows.0..=bounds.rows.1 {
            let row = passing.in_row(v).map(|s| {
                let light = passing.light(passing.open_s(v), exposure_s);
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
