//! Lamps as the world has them and a camera sees them: outline, light row by row, phase of the
//! code. Nothing here comes from the stack.

use super::tables::Kind::{Int, Real, Reals, Text};
use super::tables::{Column, Value, column};
use crate::track::LampSite;
use crate::twin::render::cpu::{Labeller, Seen, Sight};
use crate::twin::render::surface::LAMP_SIGHT_M;
use crate::twin::render::{Job, LampLight};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

/// Corners of an outline.
const CORNERS: u32 = 64;
/// Places of a disc at which it is looked whether it is hidden.
const PLACES: u32 = 64;
/// Lamps nearer to the camera's plane than this are left out.
const NEAREST_M: f64 = 0.1;

pub(super) const COLUMNS: [Column; 27] = [
    column("frame_id", Int, "", "the frame, as in frames.parquet"),
    column("uid", Text, "", "name of the lamp on the air, line-lamp"),
    column("line", Int, "", "line number, the first part of the name"),
    column("lamp", Int, "", "lamp number, the second part of the name"),
    column(
        "chips",
        Text,
        "",
        "one period of the signal, 1 on and 0 off, as sent",
    ),
    column(
        "chip_s",
        Real,
        "s",
        "length of a chip by the lamp's own clock",
    ),
    column(
        "u_px",
        Real,
        "px",
        "centre of the disc, in the row that sees it",
    ),
    column("v_px", Real, "px", "the same, row"),
    column(
        "outline_u_px",
        Reals,
        "px",
        "64 places of the rim, each in the row that sees it: a polygon whose corners are on the outline",
    ),
    column("outline_v_px", Reals, "px", "the same, rows"),
    column("depth_m", Real, "m", "of the centre along the optical axis"),
    column("distance_m", Real, "m", "from the camera to the centre"),
    column(
        "off_normal_deg",
        Real,
        "deg",
        "angle at the lamp between its normal and the camera",
    ),
    column("x_m", Real, "m", "centre in the world: east"),
    column("y_m", Real, "m", "north"),
    column("z_m", Real, "m", "up"),
    column("radius_m", Real, "m", "of the disc"),
    column("chainage_m", Real, "m", "of the lamp, as it really hangs"),
    column(
        "first_row",
        Int,
        "px",
        "uppermost row of the image that its outline touches",
    ),
    column("last_row", Int, "px", "lowest one"),
    column(
        "first_column",
        Int,
        "px",
        "leftmost column of the image that its outline touches",
    ),
    column("last_column", Int, "px", "rightmost one"),
    column(
        "chip",
        Int,
        "",
        "chip that is being sent when first_row opens, counting from 0",
    ),
    column(
        "chip_phase",
        Real,
        "",
        "share of that chip that is over by then",
    ),
    column(
        "chips_per_row",
        Real,
        "",
        "chips from the opening of a row to that of the row below; negative where the sensor is read upwards",
    ),
    column(
        "on_share",
        Reals,
        "",
        "mean light in the exposure of each row from first_row to last_row, 1 where the lamp is fully on throughout",
    ),
    column(
        "visible_share",
        Real,
        "",
        "share of the disc that is in the image and not hidden by anything",
    ),
];

/// A row for each lamp whose disc is in the image at least in part.
pub(super) fn rows(
    frame_id: i64,
    job: &Job,
    sight: &Sight<'_>,
    labeller: &Labeller,
    sites: &[LampSite],
) -> Vec<Vec<Value>> {
    let lamps = labeller.lamps().iter().zip(sites);
    lamps
        .filter_map(|(lamp, site)| row(frame_id, job, sight, labeller, (lamp, site)))
        .collect()
}

fn row(
    frame_id: i64,
    job: &Job,
    sight: &Sight<'_>,
    labeller: &Labeller,
    (lamp, site): (&LampLight, &LampSite),
) -> Option<Vec<Value>> {
    let eye = |v: f64| Point3::from(sight.pose(v).translation.vector);
    // The far ones first, and cheaply: a line has hundreds.
    if (lamp.centre - eye(0.0)).norm() > LAMP_SIGHT_M + 1.0 {
        return None;
    }
    let centre = sight.of(&lamp.centre).filter(|c| c.depth_m > NEAREST_M)?;
    let way = eye(centre.pixel.y) - lamp.centre;
    let cos = lamp.facing.dot(&way) / way.norm();
    if cos <= 0.0 || way.norm() > LAMP_SIGHT_M {
        return None;
    }
    let outline: Vec<Seen> = (0..CORNERS)
        .map(|k| sight.of(&on_disc(lamp, 1.0, TAU * f64::from(k) / f64::from(CORNERS))))
        .collect::<Option<_>>()?;
    let (us, vs): (Vec<f64>, Vec<f64>) = outline.iter().map(|s| (s.pixel.x, s.pixel.y)).unzip();
    let camera = &sight.view.camera;
    let columns = covered(&us, camera.intrinsics.width_px)?;
    let rows = covered(&vs, camera.intrinsics.height_px)?;
    let shutter = &camera.shutter;
    let open_s = |v: u32| shutter.row_open(sight.view.start, f64::from(v)).secs();
    let wave = &lamp.waveform;
    let on_share = (rows[0]..=rows[1]).map(|v| {
        let open_s = open_s(v);
        wave.on_share(open_s, open_s + shutter.exposure_s)
    });
    let sent = (open_s(rows[0]) - wave.phase_s) / wave.chip_s;
    let chips = (0..wave.frame.len).map(|k| if wave.frame.is_on(k) { '1' } else { '0' });
    Some(vec![
        frame_id.into(),
        site.uid.to_string().into(),
        u32::from(site.uid.line).into(),
        u32::from(site.uid.lamp).into(),
        chips.collect::<String>().into(),
        wave.chip_s.into(),
        centre.pixel.x.into(),
        centre.pixel.y.into(),
        us.into(),
        vs.into(),
        centre.depth_m.into(),
        way.norm().into(),
        cos.min(1.0).acos().to_degrees().into(),
        lamp.centre.x.into(),
        lamp.centre.y.into(),
        lamp.centre.z.into(),
        lamp.radius_m.into(),
        site.chainage_m.into(),
        rows[0].into(),
        rows[1].into(),
        columns[0].into(),
        columns[1].into(),
        (sent.floor().rem_euclid(f64::from(wave.frame.len)) as i64).into(),
        (sent - sent.floor()).into(),
        (shutter.row_step_s() / wave.chip_s).into(),
        on_share.collect::<Vec<_>>().into(),
        visible_share(lamp, job, sight, labeller).into(),
    ])
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
fn visible_share(lamp: &LampLight, job: &Job, sight: &Sight<'_>, labeller: &Labeller) -> f64 {
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
