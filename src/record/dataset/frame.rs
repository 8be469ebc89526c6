//! Rows of the tables of frames (when, from where, through which lens) and of image rows, each with
//! its own time and pose.

use crate::record::parquet::table_rows;
use crate::record::slug;
use crate::scenario::ScenarioFile;
use crate::session::TrainPoint;
use crate::twin::render::View;
use crate::twin::render::labels::Projection;
use nalgebra::Isometry3;

table_rows! {
    /// A row of `frames.parquet`.
    struct FrameRow {
        /// 1,000,000 times the camera's place in meta.json, plus the frame's number
        frame_id: i64, "";
        /// name of the scenario
        scenario: String, "";
        /// seed of the run
        seed: u64, "";
        /// left, right, or the name of a wayside device
        camera: String, "";
        /// of the frame, counting all that the camera took from 0; both eyes of a pair have one
        /// number
        number: u32, "";
        /// the image as the stack got it
        image: String, "";
        /// digital numbers of the converter; null where left out
        raw: Option<String>, "";
        /// the image without flaws; null where left out
        clean: Option<String>, "";
        /// depth; null where left out
        depth: Option<String>, "";
        /// numbers of instances; null where left out
        mask: Option<String>, "";
        /// optical flow to flow_to; null where left out, and for the last frame of a camera
        flow: Option<String>, "";
        /// frame_id of the camera's next frame in the set
        flow_to: Option<i64>, "";
        /// when the row that is read first opens, since the start of the scenario
        start_ns: i64, "ns";
        /// how long every row is exposed
        exposure_s: f64, "s";
        /// from the opening of a row to that of the next to open; 0 for a global shutter
        line_time_s: f64, "s";
        /// the row that opens first: 0 where the sensor is read downwards, the last one where it is
        /// read upwards
        first_row: u32, "";
        /// columns
        width_px: u32, "px";
        /// rows
        height_px: u32, "px";
        /// focal length over pixel width
        fx_px: f64, "px";
        /// focal length over pixel height
        fy_px: f64, "px";
        /// principal point, column
        cx_px: f64, "px";
        /// principal point, row
        cy_px: f64, "px";
        /// radial distortion, as OpenCV has it: (k1, k2, p1, p2, k3)
        k1: f64, "";
        /// radial
        k2: f64, "";
        /// tangential
        p1: f64, "";
        /// tangential
        p2: f64, "";
        /// radial
        k3: f64, "";
        /// pose in the middle of the frame: x, y, z, qx, qy, qz, qw
        world_from_camera: [f64; 7], "m";
        /// mount on the train as built; null for wayside cameras
        vehicle_from_camera: Option<[f64; 7]>, "m";
        /// pose in the left eye's axes as built; null for wayside cameras
        left_from_camera: Option<[f64; 7]>, "m";
        /// distance from the left eye
        baseline_m: Option<f64>, "m";
        /// of the train's head in the middle of the frame; null without a train
        chainage_m: Option<f64>, "m";
        /// of the train along the line
        speed_mps: Option<f64>, "m/s";
        /// of the converter
        bits: u32, "";
        /// digital number of darkness, on the scale of raw/
        black_dn: f64, "";
        /// digital numbers an electron, on the scale of raw/: the gain K of EMVA 1288
        dn_per_e: f64, "";
        /// electrons that a pixel holds
        full_well_e: f64, "";
        /// standard deviation of the read noise, electrons
        read_noise_e: f64, "";
        /// electrons that a luminance of 1 cd/m2 on the axis gives in a row's exposure
        electrons_per_cd_m2: f64, "m2/cd";
        /// of the lens
        f_number: f64, "";
        /// before the converter
        gain_db: f64, "dB";
    }
}

table_rows! {
    /// A row of `rows.parquet`.
    struct ImageRow {
        /// the frame, as in frames.parquet
        frame_id: i64, "";
        /// from the top, counting from 0
        row: u32, "";
        /// when the row opens, since the start of the scenario
        open_ns: i64, "ns";
        /// middle of its exposure, the time of its pose
        mid_ns: i64, "ns";
        /// camera in the world (east, north, up)
        x_m: f64, "m";
        /// north
        y_m: f64, "m";
        /// up
        z_m: f64, "m";
        /// attitude, world_from_camera
        qx: f64, "";
        /// the quaternion's y
        qy: f64, "";
        /// its z
        qz: f64, "";
        /// its real part
        qw: f64, "";
    }
}

impl FrameRow {
    /// Of a camera's frame with this id and number, still without files.
    pub fn new(
        (frame_id, camera, number): (i64, &str, u32),
        scenario: &ScenarioFile,
        sight: &Projection<'_>,
        left: Option<&View>,
        train: Option<&TrainPoint>,
    ) -> Self {
        let view = sight.view;
        let (lens, shutter) = (&view.camera.intrinsics, &view.camera.shutter);
        let mid = view.mid();
        let pose = view.motion.pose_at(mid);
        let left_from_camera = left.map(|left| left.motion.pose_at(mid).inverse() * pose);
        // The train's pose is that of the left eye's middle time.
        let vehicle_from_left = left.zip(train).map(|(left, train)| {
            train.world_from_vehicle.inverse() * left.motion.pose_at(left.mid())
        });
        let vehicle_from_camera = vehicle_from_left.zip(left_from_camera).map(|(a, b)| a * b);
        let distortion = lens.distortion.coefficients();
        let sensor = &view.sensor;
        Self {
            frame_id,
            scenario: scenario.name.clone(),
            seed: scenario.seed,
            camera: camera.to_owned(),
            number,
            image: String::new(),
            raw: None,
            clean: None,
            depth: None,
            mask: None,
            flow: None,
            flow_to: None,
            start_ns: view.start.nanos(),
            exposure_s: shutter.exposure_s,
            line_time_s: shutter.line_time_s,
            first_row: shutter.first_row,
            width_px: lens.width_px,
            height_px: lens.height_px,
            fx_px: lens.fx_px,
            fy_px: lens.fy_px,
            cx_px: lens.cx_px,
            cy_px: lens.cy_px,
            k1: distortion.k1,
            k2: distortion.k2,
            p1: distortion.p1,
            p2: distortion.p2,
            k3: distortion.k3,
            world_from_camera: seven(&pose),
            vehicle_from_camera: vehicle_from_camera.as_ref().map(seven),
            left_from_camera: left_from_camera.as_ref().map(seven),
            baseline_m: left_from_camera.map(|p| p.translation.vector.norm()),
            chainage_m: train.map(|t| t.chainage_m),
            speed_mps: train.map(|t| t.speed_mps),
            bits: sensor.bits.into(),
            black_dn: sensor.black_dn(),
            dn_per_e: sensor.dn_per_e(),
            full_well_e: sensor.full_well_e,
            read_noise_e: sensor.read_noise_e,
            electrons_per_cd_m2: view.electrons_per_cd_m2(),
            f_number: view.lens.f_number,
            gain_db: sensor.gain_db,
        }
    }

    /// Its file in one of the folders, relative to the data set's and the same on all systems.
    pub fn file(&self, folder: &str, extension: &str) -> String {
        let camera = slug(&self.camera);
        format!("{folder}/{camera}/{:06}.{extension}", self.number)
    }
}

impl ImageRow {
    /// All of a frame.
    pub fn all(frame_id: i64, sight: &Projection<'_>) -> impl Iterator<Item = Self> {
        let view = sight.view;
        let shutter = &view.camera.shutter;
        (0..view.camera.intrinsics.height_px).map(move |row| {
            let at = f64::from(row);
            let [x_m, y_m, z_m, qx, qy, qz, qw] = seven(&sight.pose(at));
            Self {
                frame_id,
                row,
                open_ns: shutter.row_open(view.start, at).nanos(),
                mid_ns: shutter.row_mid(view.start, at).nanos(),
                x_m,
                y_m,
                z_m,
                qx,
                qy,
                qz,
                qw,
            }
        })
    }
}

/// Position and quaternion (x, y, z, w).
fn seven(pose: &Isometry3<f64>) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, pose.rotation.coords);
    [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
}
