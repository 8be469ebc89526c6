//! Published calibrations of real lenses, for tests.

use super::DistortionCoefficients;

/// From OpenCV's order of the coefficients.
pub const fn lens(k1: f64, k2: f64, p1: f64, p2: f64, k3: f64) -> DistortionCoefficients {
    DistortionCoefficients { k1, k2, k3, p1, p2 }
}

/// Left and right camera of the EuRoC MAV data set (M. Burri et al., Int. J. Robotics Research
/// 2016), `mav0/cam0/sensor.yaml` and `cam1`: 752 x 480, f 458.654 and 457.587 px, 79 deg.
pub const EUROC: [DistortionCoefficients; 2] = [
    lens(
        -0.283_408_11,
        0.073_959_07,
        0.000_193_59,
        1.761_871_14e-5,
        0.0,
    ),
    lens(
        -0.283_683_65,
        0.074_512_84,
        -0.000_104_73,
        -3.555_907_00e-5,
        0.0,
    ),
];

/// Camera 0 of the KITTI data set (A. Geiger et al., Int. J. Robotics Research 2013),
/// `2011_09_26/calib_cam_to_cam.txt`: 1392 x 512, f 984.2 px.
pub const KITTI: DistortionCoefficients = lens(
    -3.728_755e-1,
    2.037_299e-1,
    2.219_027e-3,
    1.383_707e-3,
    -7.233_722e-2,
);

/// OpenCV's own example, `samples/data/left_intrinsics.yml`: 640 x 480, f 535.9 px.
pub const OPENCV: DistortionCoefficients = lens(
    -0.266_372_609_096_606_8,
    -0.038_588_898_922_304_65,
    0.001_783_194_704_285_296,
    -0.000_281_221_004_411_154_7,
    0.238_391_530_808_784_86,
);
