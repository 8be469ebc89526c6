//! Lamps as the world has them and a camera sees them: outline, light row by row, phase of the
//! code. Nothing here comes from the stack.

use crate::record::parquet::table_rows;
use crate::track::LampSite;
use crate::twin::lights::LampLight;
use crate::twin::render::Job;
use crate::twin::render::constants::LAMP_SIGHT_M;
use crate::twin::render::labels::{Labeller, Projection, Seen};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

/// Corners of an outline.
const CORNERS: u32 = 64;
/// Places of a disc at which it is looked whether it is hidden.
const PLACES: u32 = 64;
/// Lamps nearer to the camera's plane than this are left out.
const NEAREST_M: f64 = 0.1;

table_rows! {
    /// A row of `lamps.parquet`.
    struct LampRow {
        /// the frame, as in frames.parquet
        frame_id: i64, "";
        /// name of the lamp on the air, line-lamp
        uid: String, "";
        /// line number, the first part of the name
        line: u32, "";
        /// lamp number, the second part of the name
        lamp: u32, "";
        /// one period of the signal, 1 on and 0 off, as sent
        chips: String, "";
        /// length of a chip by the lamp's own clock
        chip_s: f64, "s";
        /// centre of the disc, in the row that sees it
        u_px: f64, "px";
        /// the same, row
        v_px: f64, "px";
        /// 64 places of the rim, each in the row that sees it: a polygon whose corners are on the
        /// outline
        outline_u_px: Vec<f64>, "px";
        /// the same, rows
        outline_v_px: Vec<f64>, "px";
        /// of the centre along the optical axis
        depth_m: f64, "m";
        /// from the camera to the centre
        distance_m: f64, "m";
        /// angle at the lamp between its normal and the camera
        off_normal_deg: f64, "deg";
        /// centre in the world: east
        x_m: f64, "m";
        /// north
        y_m: f64, "m";
        /// up
        z_m: f64, "m";
        /// of the disc
        radius_m: f64, "m";
        /// of the lamp, as it really hangs
        chainage_m: f64, "m";
        /// uppermost row of the image that its outline touches
        first_row: u32, "px";
        /// lowest one
        last_row: u32, "px";
        /// leftmost column of the image that its outline touches
        first_column: u32, "px";
        /// rightmost one
        last_column: u32, "px";
        /// chip that is being sent when first_row opens, counting from 0
        chip: i64, "";
        /// share of that chip that is over by then
        chip_phase: f64, "";
        /// chips from the opening of a row to that of the row below; negative where the sensor is
        /// read upwards
        chips_per_row: f64, "";
        /// mean light in the exposure of each row from first_row to last_row, with rise, fall,
        /// mains ripple and ageing: 1 is a good lamp that is on throughout
        on_share: Vec<f64>, "";
        /// share of the disc that is in the image and not hidden by anything
        visible_share: f64, "";
    }
}

impl LampRow {
    /// Of each lamp whose disc is in the image at least in part.
    pub fn all(
        frame_id: i64,
        job: &Job,
        sight: &Projection<'_>,
        labeller: &Labeller,
        sites: &[&LampSite],
    ) -> Vec<Self> {
        let lamps = labeller.lamps().iter().zip(sites);
        lamps
            .filter_map(|(lamp, site)| Self::new(frame_id, job, sight, labeller, (lamp, site)))
            .collect()
    }

    fn new(
        frame_id: i64,
        job: &Job,
        sight: &Projection<'_>,
        labeller: &Labeller,
        (lamp, site): (&LampLight, &LampSite),
    ) -> Option<Self> {
        let eye = |v: f64| Point3::from(sight.pose(v).translation.vector);
        // The far ones first, and cheaply: a line has hundreds.
        if (lamp.centre - eye(0.0)).norm() > LAMP_SIGHT_M + 1.0 {
            return None;
        }
        let lamp = &lamp.at(job.time);
        let centre = sight.of(&lamp.centre).filter(|c| c.depth_m > NEAREST_M)?;
        let way = eye(centre.pixel.y) - lamp.centre;
        let cos = lamp.facing.dot(&way) / way.norm();
        if cos <= 0.0 || way.norm() > LAMP_SIGHT_M {
            return None;
        }
        let outline: Vec<Seen> = (0..CORNERS)
            .map(|k| sight.of(&on_disc(lamp, 1.0, TAU * f64::from(k) / f64::from(CORNERS))))
            .collect::<Option<_>>()?;
        let (outline_u_px, outline_v_px): (Vec<f64>, Vec<f64>) =
            outline.iter().map(|s| (s.pixel.x, s.pixel.y)).unzip();
        let camera = &sight.view.camera;
        let [first_column, last_column] = covered(&outline_u_px, camera.intrinsics.width_px)?;
        let [first_row, last_row] = covered(&outline_v_px, camera.intrinsics.height_px)?;
        let shutter = &camera.shutter;
        let open_s = |v: u32| shutter.row_open(sight.view.start, f64::from(v)).secs();
        let (wave, light) = (&lamp.waveform, lamp.curve());
        let on_share = (first_row..=last_row).map(|v| {
            let open_s = open_s(v);
            lamp.level * light.mean(open_s, open_s + shutter.exposure_s)
        });
        let sent = (open_s(first_row) - wave.phase_s) / wave.chip_s;
        let chips = (0..wave.frame.len).map(|k| if wave.frame.is_on(k) { '1' } else { '0' });
        Some(Self {
            frame_id,
            uid: site.uid.to_string(),
            line: site.uid.line.into(),
            lamp: site.uid.lamp.into(),
            chips: chips.collect(),
            chip_s: wave.chip_s,
            u_px: centre.pixel.x,
            v_px: centre.pixel.y,
            outline_u_px,
            outline_v_px,
            depth_m: centre.depth_m,
            distance_m: way.norm(),
            off_normal_deg: cos.min(1.0).acos().to_degrees(),
            x_m: lamp.centre.x,
            y_m: lamp.centre.y,
            z_m: lamp.centre.z,
            radius_m: lamp.radius_m,
            chainage_m: site.chainage_m,
            first_row,
            last_row,
            first_column,
            last_column,
            chip: sent.floor().rem_euclid(f64::from(wave.frame.len)) as i64,
            chip_phase: sent - sent.floor(),
            chips_per_row: shutter.row_step_s() / wave.chip_s,
            on_share: on_share.collect(),
            visible_share: visible_share(lamp, job, sight, labeller),
        })
    }
}

/// A place on the disc, at a share of its radius.
fn on_disc(lamp: &LampLight, share: f64, angle: f64) -> Point3<f64> {
    let n = lamp.facing.into_inner();
    let least = if n.x.abs() < 0.6 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let across = n.cross(&least).normalize();
    let along = n.cross(&across);
    let (sin, cos) = angle.sin_cos();
    lamp.centre + share * lamp.radius_m * (across * cos + along * sin)
}

/// First and last pixel of `0..size` that a range of coordinates touches.
fn covered(coordinates: &[f64], size: u32) -> Option<[u32; 2]> {
    let low = coordinates.iter().copied().fold(f64::INFINITY, f64::min);
    let high = coordinates
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    let last = f64::from(size) - 1.0;
    let (first, end) = (low.round().max(0.0), high.round().min(last));
    (first <= last && end >= 0.0 && first <= end).then_some([first as u32, end as u32])
}

/// Looked at evenly over the disc, on a spiral.
fn visible_share(lamp: &LampLight, job: &Job, sight: &Projection<'_>, labeller: &Labeller) -> f64 {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let seen = (0..PLACES).filter(|k| {
        let share = ((f64::from(*k) + 0.5) / f64::from(PLACES)).sqrt();
        let place = on_disc(lamp, share, golden * f64::from(*k));
        sight.of(&place).is_some_and(|s| {
            sight.contains(&s.pixel) && labeller.sees(job, sight, s.pixel.y, &place)
        })
    });
    seen.count() as f64 / f64::from(PLACES)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::super::clean::clean;
    use super::*;
    use crate::track::uid::ChipFrame;
    use crate::twin::geometry::{Body, Shape};
    use crate::twin::render::cpu::CpuRenderer;
    use crate::twin::render::{Renderer, Scene, View, sample};
    use nalgebra::Translation3;

    const SPEED_MPS: f64 = 160.0 / 3.6;

    /// The left eye at 160 km/h, without noise and halo, bright enough that a lamp is not white.
    fn view(s_m: f64) -> View {
        let mut view = sample::rig_view(&sample::track(), s_m, SPEED_MPS);
        view.sensor.bits = 12;
        // It would move the centre of the light.
        view.lens.vignetting = 0.0;
        view.set_gain_for(sample::scene().lamps[0].luminance_cd_m2, 180.0);
        clean(&view, 1.0)
    }

    /// What the table says of the lamps in a view of a job.
    fn seen(scene: &Scene, job: &Job) -> Vec<LampRow> {
        let sight = Projection::new(&job.views[0], job.time);
        let lamps: Vec<_> = scene.tracks[0].lamps.iter().collect();
        LampRow::all(7, job, &sight, &Labeller::new(scene), &lamps)
    }

    /// Area and centroid of a polygon.
    fn moments(us: &[f64], vs: &[f64]) -> (f64, [f64; 2]) {
        let n = us.len();
        let (mut area, mut u, mut v) = (0.0, 0.0, 0.0);
        for k in 0..n {
            let j = (k + 1) % n;
            let cross = us[k] * vs[j] - us[j] * vs[k];
            area += cross / 2.0;
            u += (us[k] + us[j]) * cross / 6.0;
            v += (vs[k] + vs[j]) * cross / 6.0;
        }
        (area.abs(), [u / area, v / area])
    }

    /// Fails where an outline is off by a half pixel, solved with another row's pose, or not that
    /// of the disc: the drawn picture has its light where the outline says.
    #[test]
    fn outlines_are_where_the_picture_has_its_light() {
        let mut scene = sample::scene();
        for lamp in &mut scene.lamps {
            // Always on, and as bright from everywhere: the picture of the whole disc.
            lamp.exponent = 1.0;
            lamp.waveform.frame = ChipFrame {
                bits: u64::MAX,
                len: 64,
            };
        }
        let mut renderer = CpuRenderer::oracle(scene.clone());
        let mut compared = 0;
        for s_m in [100.4, 102.0, 402.5] {
            let job = Job {
                views: vec![view(s_m)],
                ..Job::default()
            };
            renderer.submit(&job).unwrap();
            let image = renderer.collect_raw().unwrap().remove(0);
            let sensor = &job.views[0].sensor;
            for row in seen(&scene, &job) {
                let (u0, u1) = (row.first_column, row.last_column);
                let (v0, v1) = (row.first_row, row.last_row);
                let whole = u0 > 3 && u1 < 1276 && v0 > 3 && v1 < 716;
                if !whole || v1 - v0 < 25 {
                    continue;
                }
                let (mut light, mut u_sum, mut v_sum, mut most) = (0.0, 0.0, 0.0, 0.0f64);
                for v in v0 - 2..=v1 + 2 {
                    for u in u0 - 2..=u1 + 2 {
                        let dn = f64::from(image.get_pixel(u, v).0[0]) - sensor.black_dn();
                        light += dn;
                        u_sum += dn * f64::from(u);
                        v_sum += dn * f64::from(v);
                        most = most.max(dn);
                    }
                }
                let (area, centroid) = moments(&row.outline_u_px, &row.outline_v_px);
                let off = [u_sum / light - centroid[0], v_sum / light - centroid[1]];
                assert!(off[0].hypot(off[1]) < 0.03, "{s_m} m: {off:?}");
                assert!(
                    (light / most / area - 1.0).abs() < 0.03,
                    "{} {area}",
                    light / most
                );
                compared += 1;
            }
        }
        assert!(compared >= 3, "{compared}");
    }

    /// Fails where the phase is of another row, counts the wrong way, or the chips are mirrored:
    /// chips, phase and step give the light of every row again.
    #[test]
    fn phase_and_chips_give_the_light_of_every_row() {
        let mut scene = sample::scene();
        for lamp in &mut scene.lamps {
            // On and off at once, as the chips alone say.
            (lamp.waveform.rise_s, lamp.waveform.fall_s) = (0.0, 0.0);
        }
        for first_row in [0, 719] {
            let mut view = sample::rig_view(&sample::track(), 100.4, SPEED_MPS);
            view.camera.shutter.first_row = first_row;
            let exposure_s = view.camera.shutter.exposure_s;
            let job = Job {
                views: vec![view],
                ..Job::default()
            };
            let lamps = seen(&scene, &job);
            assert!(!lamps.is_empty());
            for row in lamps {
                let chips = row.chips.bytes();
                let chips: Vec<f64> = chips.map(|b| f64::from(b - b'0')).collect();
                let begin = row.chip as f64 + row.chip_phase;
                let open = exposure_s / row.chip_s;
                for (k, share) in row.on_share.iter().enumerate() {
                    let from = begin + k as f64 * row.chips_per_row;
                    let n = 2000;
                    let on = (0..n).map(|i| {
                        let x = from + open * (f64::from(i) + 0.5) / f64::from(n);
                        chips[x.floor().rem_euclid(chips.len() as f64) as usize]
                    });
                    let mean = on.sum::<f64>() / f64::from(n);
                    assert!((mean - share).abs() < 0.02, "row {k}: {mean} {share}");
                }
            }
        }
    }

    /// Fails where what hides a lamp does not count, or the lamp hides itself.
    #[test]
    fn a_hidden_lamp_is_not_visible() {
        let scene = sample::scene();
        let mut job = Job {
            views: vec![view(100.4)],
            ..Job::default()
        };
        let nearest = |rows: Vec<LampRow>| {
            let by_depth = |a: &LampRow, b: &LampRow| a.depth_m.total_cmp(&b.depth_m);
            rows.into_iter().min_by(by_depth).unwrap()
        };
        let free = nearest(seen(&scene, &job));
        assert!((free.visible_share - 1.0).abs() < 1e-9);
        let pose = job.views[0].motion.poses[0];
        let lamp = Point3::new(free.x_m, free.y_m, free.z_m);
        let half_way = nalgebra::center(&lamp, &pose.translation.vector.into());
        job.bodies.push(Body {
            shape: Shape::Sphere(0.4),
            world_from_body: Translation3::from(half_way).into(),
            velocity_mps: Vector3::zeros(),
            albedo: 0.5,
            luminance_cd_m2: 0.0,
        });
        assert!(nearest(seen(&scene, &job)).visible_share.abs() < 1e-9);
    }
}
