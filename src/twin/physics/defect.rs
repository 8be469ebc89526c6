//! Single defects of the running surface, on top of the random irregularity: joints, dipped welds,
//! crossings, corrugation, settled slabs.
//!
//! Shapes of the running surface z over the distance x from the defect, h deep and L long:
//!
//! ```text
//! joint        z = -h (1 - |x| / L)^2            |x| < L: a cusp with a dip angle of 4 h / L
//! dip          z = -h (1 + cos(pi x / L)) / 2    |x| < L
//! corrugation  z =  h cos(2 pi x / wavelength)   fading in and out over one wavelength
//! slab         z = -h (1 - cos(pi x / R)) / 2    x < R: the ramp at its begin; -h; a ramp at its end
//! ```
//!
//! The joint is the cusp of two parabolas of Jenkins et al., "The effect of track and vehicle
//! parameters on wheel/rail vertical dynamic forces", Railway Engineering Journal 3 (1974). A
//! wheel on one dipped rail lowers the middle of the axle by half of it, and rolls it.

use super::deviation::Deviation;
use crate::settings::{Checker, settings};
use crate::track::CANT_BASE_M;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// The rail that has a defect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RailSide {
    /// Both rails alike.
    #[default]
    Both,
    /// The left rail only.
    Left,
    /// The right rail only.
    Right,
}

settings! {
    /// What is wrong with the running surface.
    #[derive(Copy)]
    #[serde(tag = "kind", rename_all = "snake_case")]
    pub enum DefectShape {
        /// A rail joint that hangs: a cusp.
        Joint {
            /// Depth, metres.
            depth_m: f64, in -0.05..=0.05;
            /// From its bottom to either end, metres.
            half_length_m: f64, in 0.05..=10.0;
        },
        /// A weld, or the gap of a crossing, ground hollow: a smooth dip.
        Dip {
            /// Depth, metres.
            depth_m: f64, in -0.05..=0.05;
            /// From its bottom to either end, metres.
            half_length_m: f64, in 0.05..=10.0;
        },
        /// Waves of one length.
        Corrugation {
            /// Half of the height from trough to crest, metres.
            amplitude_m: f64, in 0.0..=1e-3;
            // A train at 160 km/h takes 4 steps of 1 ms over it.
            /// Metres.
            wavelength_m: f64, in 0.18..=10.0;
            /// From the defect's chainage to the last wave, metres: two waves at least.
            length_m: f64, in 0.36..=1e5;
        },
        /// A slab that lies lower than its neighbours (or, where the depth is negative, higher).
        Slab {
            /// Metres.
            depth_m: f64, in -0.05..=0.05;
            /// Of the slab with both ramps, metres.
            length_m: f64, in 1.0..=1e5;
            /// Over which the level changes, at either end, metres.
            ramp_m: f64, in 0.5..=100.0;
        },
    }
    also check_length
}

settings! {
    /// A defect at a place, or one that comes back every so many metres.
    pub struct DefectSettings {
        /// Its shape.
        shape: DefectShape, nested;
        /// Name of the track. Default: the tunnel's first.
        track: Option<String>;
        /// Chainage of the (first) defect, metres: its bottom, or where it begins.
        chainage_m: f64, in -1e6..=1e6;
        /// The rail.
        #[serde(default)]
        side: RailSide;
        /// It comes back after this many metres: the length of a rail. Default: only once.
        every_m: Option<f64>, in 0.1..=1e5;
        /// How many there are, where they come back.
        #[serde(default = "crate::settings::one::<u32>")]
        count: u32, in 1.0..=1e5;
    }
}

/// One defect where it is, with the depth of each rail's share.
#[derive(Clone, Copy, Debug)]
struct Defect {
    from_m: f64,
    to_m: f64,
    shape: DefectShape,
    /// Of the shape: what the middle of the axle goes up by, and what it rolls by.
    up: f64,
    roll_per_m: f64,
}

/// All defects of a line, by chainage.
#[derive(Clone, Debug, Default)]
pub(super) struct Defects {
    defects: Vec<Defect>,
    longest_m: f64,
}

impl Defects {
    pub(super) fn new(settings: &[DefectSettings]) -> Self {
        let mut defects: Vec<_> = settings.iter().flat_map(repeated).collect();
        defects.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
        let length_m = |d: &Defect| d.to_m - d.from_m;
        Self {
            longest_m: defects.iter().map(length_m).fold(0.0, f64::max),
            defects,
        }
    }

    /// Adds what they do to the track at a chainage.
    pub(super) fn add(&self, s_m: f64, deviation: &mut Deviation) {
        let before = self.defects.partition_point(|d| d.from_m <= s_m);
        let near = (self.defects[..before].iter().rev())
            .take_while(|d| d.from_m >= s_m - self.longest_m)
            .filter(|d| s_m <= d.to_m);
        for d in near {
            let (z_m, z_per_m) = d.shape.at(s_m - d.from_m);
            deviation.up_m += d.up * z_m;
            deviation.up_per_m += d.up * z_per_m;
            deviation.roll_rad += d.roll_per_m * z_m;
            deviation.roll_rad_per_m += d.roll_per_m * z_per_m;
        }
    }
}

fn repeated(settings: &DefectSettings) -> impl Iterator<Item = Defect> + '_ {
    let (up, roll_per_m) = match settings.side {
        RailSide::Both => (1.0, 0.0),
        RailSide::Left => (0.5, 1.0 / CANT_BASE_M),
        RailSide::Right => (0.5, -1.0 / CANT_BASE_M),
    };
    let (begin_m, length_m) = settings.shape.extent_m();
    let count = settings.every_m.map_or(1, |_| settings.count);
    (0..count).map(move |k| {
        let at_m = settings.chainage_m + f64::from(k) * settings.every_m.unwrap_or(0.0);
        Defect {
            from_m: at_m + begin_m,
            to_m: at_m + begin_m + length_m,
            shape: settings.shape,
            up,
            roll_per_m,
        }
    })
}

impl DefectShape {
    /// Both ends of it must find room.
    fn check_length(&self, check: &mut Checker<'_>) {
        let (end_m, length_m) = match *self {
            Self::Joint { .. } | Self::Dip { .. } => return,
            Self::Corrugation {
                wavelength_m,
                length_m,
                ..
            } => (wavelength_m, length_m),
            Self::Slab {
                ramp_m, length_m, ..
            } => (ramp_m, length_m),
        };
        check.within("length_m", length_m, 2.0 * end_m..=1e5);
    }

    /// Where it begins, from its chainage on, and how long it is.
    fn extent_m(&self) -> (f64, f64) {
        match *self {
            Self::Joint { half_length_m, .. } | Self::Dip { half_length_m, .. } => {
                (-half_length_m, 2.0 * half_length_m)
            }
            Self::Corrugation { length_m, .. } | Self::Slab { length_m, .. } => (0.0, length_m),
        }
    }

    /// Height of the running surface and its derivative, `x_m` after the defect's begin.
    fn at(&self, x_m: f64) -> (f64, f64) {
        match *self {
            Self::Joint {
                depth_m,
                half_length_m,
            } => {
                let x = x_m / half_length_m - 1.0;
                let u = 1.0 - x.abs();
                (
                    -depth_m * u * u,
                    2.0 * depth_m * u * x.signum() / half_length_m,
                )
            }
            Self::Dip {
                depth_m,
                half_length_m,
            } => {
                let (sin, cos) = (PI * (x_m / half_length_m - 1.0)).sin_cos();
                (
                    -0.5 * depth_m * (1.0 + cos),
                    0.5 * depth_m * PI / half_length_m * sin,
                )
            }
            Self::Corrugation {
                amplitude_m,
                wavelength_m,
                length_m,
            } => {
                let (sin, cos) = (TAU * x_m / wavelength_m).sin_cos();
                let (rise, fall) = (x_m / wavelength_m, (length_m - x_m) / wavelength_m);
                let fade = rise.min(fall).min(1.0);
                let fade_per_m = match (fade < 1.0, rise < fall) {
                    (false, _) => 0.0,
                    (true, true) => 1.0 / wavelength_m,
                    (true, false) => -1.0 / wavelength_m,
                };
                let wave_per_m = -TAU / wavelength_m * sin;
                (
                    amplitude_m * fade * cos,
                    amplitude_m * (fade_per_m * cos + fade * wave_per_m),
                )
            }
            Self::Slab {
                depth_m,
                length_m,
                ramp_m,
            } => {
                let (near, sign) = match x_m < 0.5 * length_m {
                    true => (x_m, 1.0),
                    false => (length_m - x_m, -1.0),
                };
                if near >= ramp_m {
                    return (-depth_m, 0.0);
                }
                let (sin, cos) = (PI * near / ramp_m).sin_cos();
                (
                    -0.5 * depth_m * (1.0 - cos),
                    -0.5 * depth_m * PI / ramp_m * sin * sign,
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [DefectShape; 4] = [
        DefectShape::Joint {
            depth_m: 0.006,
            half_length_m: 0.6,
        },
        DefectShape::Dip {
            depth_m: 0.004,
            half_length_m: 0.5,
        },
        DefectShape::Corrugation {
            amplitude_m: 1e-4,
            wavelength_m: 0.3,
            length_m: 6.0,
        },
        DefectShape::Slab {
            depth_m: 0.008,
            length_m: 25.0,
            ramp_m: 4.0,
        },
    ];

    fn one_at(shape: DefectShape, chainage_m: f64, side: RailSide) -> DefectSettings {
        DefectSettings {
            track: None,
            shape,
            chainage_m,
            side,
            every_m: None,
            count: 1,
        }
    }

    fn at(defects: &Defects, s_m: f64) -> Deviation {
        let mut deviation = Deviation::default();
        defects.add(s_m, &mut deviation);
        deviation
    }

    /// Fails where a slope is not the derivative of its height, where a defect jumps at its ends,
    /// or is not as deep as it says.
    #[test]
    fn shapes_are_smooth_and_as_deep_as_they_say() {
        for shape in SHAPES {
            let (begin_m, length_m) = shape.extent_m();
            let mut low_m = 0.0f64;
            for k in 0..=10_000 {
                // Off the cusp of the joint and the ends of fades.
                let x_m = length_m * (f64::from(k) + 0.37) / 10_001.0;
                let (z_m, z_per_m) = shape.at(x_m);
                let h = 1e-7;
                let slope = (shape.at(x_m + h).0 - shape.at(x_m - h).0) / (2.0 * h);
                assert!(
                    (slope - z_per_m).abs() < 1e-5,
                    "{shape:?} at {x_m}: {slope} {z_per_m}"
                );
                low_m = low_m.min(z_m);
            }
            for x_m in [0.0, length_m] {
                assert!(shape.at(x_m).0.abs() < 1e-12, "{shape:?} {begin_m}");
            }
            let want_m = match shape {
                DefectShape::Joint { depth_m, .. }
                | DefectShape::Dip { depth_m, .. }
                | DefectShape::Slab { depth_m, .. } => depth_m,
                DefectShape::Corrugation { amplitude_m, .. } => amplitude_m,
            };
            assert!((low_m + want_m).abs() < 1e-3 * want_m, "{shape:?} {low_m}");
        }
    }

    /// Fails where the dip angle of a joint is not the one of its source's drawing, 4 h / L.
    #[test]
    fn val_dip_angle_of_a_joint() {
        let joint = Defects::new(&[one_at(SHAPES[0], 100.0, RailSide::Both)]);
        let (before, after) = (at(&joint, 100.0 - 1e-9), at(&joint, 100.0 + 1e-9));
        let angle = after.up_per_m - before.up_per_m;
        assert!((angle - 4.0 * 0.006 / 0.6).abs() < 1e-6, "{angle}");
        assert!((after.up_m + 0.006).abs() < 1e-9);
    }

    /// Fails where one rail's dip does not lower the axle by half and roll it to that side.
    #[test]
    fn a_dip_of_one_rail_rolls_the_axle() {
        for (side, sign) in [(RailSide::Left, -1.0), (RailSide::Right, 1.0)] {
            let dip = Defects::new(&[one_at(SHAPES[1], 100.0, side)]);
            let d = at(&dip, 100.0);
            assert!((d.up_m + 0.002).abs() < 1e-12);
            assert!((d.roll_rad - sign * 0.004 / CANT_BASE_M).abs() < 1e-12);
        }
    }

    /// Fails where joints do not come back at every rail's length, or overlapping ones are lost.
    #[test]
    fn defects_come_back_and_add_up() {
        let joints = DefectSettings {
            track: None,
            every_m: Some(25.0),
            count: 4,
            ..one_at(SHAPES[0], 50.0, RailSide::Both)
        };
        let defects = Defects::new(&[joints, one_at(SHAPES[3], 90.0, RailSide::Both)]);
        for (s_m, want_m) in [
            (50.0, 0.006),
            (75.0, 0.006),
            (100.0, 0.014),
            (125.0, 0.006),
            (150.0, 0.0),
        ] {
            let up_m = at(&defects, s_m).up_m;
            assert!((up_m + want_m).abs() < 1e-12, "{s_m}: {up_m}");
        }
    }
}
