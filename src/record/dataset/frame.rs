//! What a frame's row says of its camera: when, from where, through which lens; and its rows, each
//! with its own time and pose.

use crate::record::parquet::Kind::{Int, Real, Reals, Text};
use crate::record::parquet::{Column, Value, column};
use crate::session::TrainPoint;
use crate::twin::render::View;
use crate::twin::render::labels::Projection;
use nalgebra::Isometry3;
use std::path::{Path, PathBuf};

pub(super) const COLUMNS: [Column; 41] = [
    column(
        "frame_id",
        Int,
        "",
        "1,000,000 times the camera's place in meta.json, plus the frame's number",
    ),
    column("scenario", Text, "", "name of the scenario"),
    column("seed", Int, "", "seed of the run"),
    column(
        "camera",
        Text,
        "",
        "left, right, or the name of a wayside device",
    ),
    column(
        "number",
        Int,
        "",
        "of the frame, counting all that the camera took from 0; both eyes of a pair have one number",
    ),
    column("image", Text, "", "the image as the stack got it"),
    column(
        "raw",
        Text,
        "",
        "digital numbers of the converter; null where left out",
    ),
    column(
        "clean",
        Text,
        "",
        "the image without flaws; null where left out",
    ),
    column("depth", Text, "", "depth; null where left out"),
    column(
        "mask",
        Text,
        "",
        "numbers of instances; null where left out",
    ),
    column(
        "flow",
        Text,
        "",
        "optical flow to flow_to; null where left out, and for the last frame of a camera",
    ),
    column(
        "flow_to",
        Int,
        "",
        "frame_id of the camera's next frame in the set",
    ),
    column(
        "start_ns",
        Int,
        "ns",
        "when the row that is read first opens, since the start of the scenario",
    ),
    column("exposure_s", Real, "s", "how long every row is exposed"),
    column(
        "line_time_s",
        Real,
        "s",
        "from the opening of a row to that of the next to open; 0 for a global shutter",
    ),
    column(
        "first_row",
        Int,
        "",
        "the row that opens first: 0 where the sensor is read downwards, the last one where it is read upwards",
    ),
    column("width_px", Int, "px", "columns"),
    column("height_px", Int, "px", "rows"),
    column("fx_px", Real, "px", "focal length over pixel width"),
    column("fy_px", Real, "px", "focal length over pixel height"),
    column("cx_px", Real, "px", "principal point, column"),
    column("cy_px", Real, "px", "principal point, row"),
    column(
        "k1",
        Real,
        "",
        "radial distortion, as OpenCV has it: (k1, k2, p1, p2, k3)",
    ),
    column("k2", Real, "", "radial"),
    column("p1", Real, "", "tangential"),
    column("p2", Real, "", "tangential"),
    column("k3", Real, "", "radial"),
    column(
        "world_from_camera",
        Reals,
        "m",
        "pose in the middle of the frame: x, y, z, qx, qy, qz, qw",
    ),
    column(
        "vehicle_from_camera",
        Reals,
        "m",
        "mount on the train as built; null for wayside cameras",
    ),
    column(
        "left_from_camera",
        Reals,
        "m",
        "pose in the left eye's axes as built; null for wayside cameras",
    ),
    column("baseline_m", Real, "m", "distance from the left eye"),
    column(
        "chainage_m",
        Real,
        "m",
        "of the train's head in the middle of the frame; null without a train",
    ),
    column("speed_mps", Real, "m/s", "of the train along the line"),
    column("bits", Int, "", "of the converter"),
    column(
        "black_dn",
        Real,
        "",
        "digital number of darkness, on the scale of raw/",
    ),
    column(
        "dn_per_e",
        Real,
        "",
        "digital numbers an electron, on the scale of raw/: the gain K of EMVA 1288",
    ),
    column("full_well_e", Real, "", "electrons that a pixel holds"),
    column(
        "read_noise_e",
        Real,
        "",
        "standard deviation of the read noise, electrons",
    ),
    column(
        "electrons_per_cd_m2",
        Real,
        "m2/cd",
        "electrons that a luminance of 1 cd/m2 on the axis gives in a row's exposure",
    ),
    column("f_number", Real, "", "of the lens"),
    column("gain_db", Real, "dB", "before the converter"),
];

/// Column of `flow` and of `flow_to`.
const FLOW: usize = 10;

pub(super) const ROWS: [Column; 11] = [
    column("frame_id", Int, "", "the frame, as in frames.parquet"),
    column("row", Int, "", "from the top, counting from 0"),
    column(
        "open_ns",
        Int,
        "ns",
        "when the row opens, since the start of the scenario",
    ),
    column(
        "mid_ns",
        Int,
        "ns",
        "middle of its exposure, the time of its pose",
    ),
    column("x_m", Real, "m", "camera in the world (east, north, up)"),
    column("y_m", Real, "m", "north"),
    column("z_m", Real, "m", "up"),
    column("qx", Real, "", "attitude, world_from_camera"),
    column("qy", Real, "", "the quaternion's y"),
    column("qz", Real, "", "its z"),
    column("qw", Real, "", "its real part"),
];

/// Files of a frame, relative to the data set's folder.
pub(super) struct Paths {
    stem: PathBuf,
}

impl Paths {
    pub fn new(camera: &str, number: u32) -> Self {
        Self {
            stem: Path::new(&crate::record::slug(camera)).join(format!("{number:06}")),
        }
    }

    /// In one of the folders.
    pub fn file(&self, folder: &str, extension: &str) -> PathBuf {
        Path::new(folder).join(&self.stem).with_extension(extension)
    }
}

/// A path as it stands in tables, the same on all systems.
pub(super) fn text(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

/// What a row of `frames.parquet` begins with.
pub(super) struct Name<'a> {
    pub frame_id: i64,
    pub scenario: &'a str,
    pub seed: u64,
    pub camera: &'a str,
    pub number: u32,
    /// Image, raw, clean, depth, mask.
    pub files: [Option<String>; 5],
}

/// A row of `frames.parquet`, still without flow.
pub(super) fn row(
    name: Name<'_>,
    sight: &Projection<'_>,
    left: Option<&View>,
    train: Option<&TrainPoint>,
) -> Vec<Value> {
    let view = sight.view;
    let (camera, shutter) = (&view.camera.intrinsics, &view.camera.shutter);
    let mid = view.mid();
    let pose = view.motion.pose_at(mid);
    let left_from_camera = left.map(|left| left.motion.pose_at(mid).inverse() * pose);
    // The train's pose is that of the left eye's middle time.
    let vehicle_from_left = left
        .zip(train)
        .map(|(left, train)| train.world_from_vehicle.inverse() * left.motion.pose_at(left.mid()));
    let vehicle_from_camera = vehicle_from_left.zip(left_from_camera).map(|(a, b)| a * b);
    let d = camera.distortion.coefficients();
    let sensor = &view.sensor;
    let [image, raw, clean, depth, mask] = name.files;
    vec![
        name.frame_id.into(),
        name.scenario.into(),
        (name.seed as i64).into(),
        name.camera.into(),
        name.number.into(),
        image.into(),
        raw.into(),
        clean.into(),
        depth.into(),
        mask.into(),
        Value::Null,
        Value::Null,
        view.start.nanos().into(),
        shutter.exposure_s.into(),
        shutter.line_time_s.into(),
        shutter.first_row.into(),
        camera.width_px.into(),
        camera.height_px.into(),
        camera.fx_px.into(),
        camera.fy_px.into(),
        camera.cx_px.into(),
        camera.cy_px.into(),
        d.k1.into(),
        d.k2.into(),
        d.p1.into(),
        d.p2.into(),
        d.k3.into(),
        seven(&pose).into(),
        vehicle_from_camera.as_ref().map(seven).into(),
        left_from_camera.as_ref().map(seven).into(),
        left_from_camera.map(|p| p.translation.vector.norm()).into(),
        train.map(|t| t.chainage_m).into(),
        train.map(|t| t.speed_mps).into(),
        u32::from(sensor.bits).into(),
        sensor.black_dn().into(),
        sensor.dn_per_e().into(),
        sensor.full_well_e.into(),
        sensor.read_noise_e.into(),
        view.electrons_per_cd_m2().into(),
        view.lens.f_number.into(),
        sensor.gain_db.into(),
    ]
}

/// Enters the flow into a row.
pub(super) fn set_flow(row: &mut [Value], file: String, to: i64) {
    if let [flow, flow_to] = &mut row[FLOW..FLOW + 2] {
        (*flow, *flow_to) = (file.into(), to.into());
    }
}

/// The rows of a frame.
pub(super) fn rows(frame_id: i64, sight: &Projection<'_>) -> impl Iterator<Item = Vec<Value>> {
    let view = sight.view;
    (0..view.camera.intrinsics.height_px).map(move |v| {
        let shutter = &view.camera.shutter;
        let at = f64::from(v);
        let mut row = vec![
            frame_id.into(),
            v.into(),
            shutter.row_open(view.start, at).nanos().into(),
            shutter.row_mid(view.start, at).nanos().into(),
        ];
        row.extend(seven(&sight.pose(at)).into_iter().map(Value::from));
        row
    })
}

/// Position and quaternion (x, y, z, w).
fn seven(pose: &Isometry3<f64>) -> Vec<f64> {
    let (p, q) = (pose.translation.vector, pose.rotation.coords);
    vec![p.x, p.y, p.z, q.x, q.y, q.z, q.w]
}
