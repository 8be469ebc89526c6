//! The structs that Rust and the shaders share, laid out as WGSL lays them out. `tests/pictures/shaders.rs`
//! holds every offset against the shader's.

use bytemuck::{Pod, Zeroable};

/// Headlights beyond this many do not light a view; the nearest ones do.
pub const MAX_HEADLIGHTS: usize = 16;

/// Depth is reversed: 1 at this optical depth, 0 at infinity. What is nearer is not seen.
pub const NEAR_M: f64 = 0.05;

/// Numbers in the lists of a view's shadows.
pub const MAX_WORDS: usize = 16384;
/// Lights that may throw shadows in a view: the nearest.
pub const MAX_SOURCES: usize = 136;
/// Bodies that may throw shadows in a view: the nearest.
pub const MAX_BLOCKERS: usize = 512;
/// Slabs of all of them.
pub const MAX_SLABS: usize = 1024;

/// Structs as WGSL lays them out.
macro_rules! shared_with_shaders {
    ($($struct:item)*) => {$(
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
        $struct
    )*};
}

shared_with_shaders! {
    /// A corner of a surface.
    pub struct Vertex {
        /// From the mesh's origin, world axes.
        pub position_m: [f32; 3],
        /// Unit normal on the lit side, world axes.
        pub normal: [f32; 3],
        /// By ambient light and all lamps but the one that the mesh names, and by that one in the mean
        /// over time.
        pub light_lx: [f32; 2],
        /// Chainage from the mesh's origin, and metres along the outline.
        pub place_m: [f32; 2],
        /// Albedo is the painting's times this.
        pub paint: f32,
        /// Own luminance.
        pub luminance_cd_m2: f32,
        /// Reflectance head on, roughness along the track and across; 0 where it is dull.
        pub gloss: [f32; 3],
        /// Share of light reflected in the mean. No shader reads it.
        pub albedo: f32,
    }

    /// Where one mesh is drawn.
    pub struct Placement {
        /// The mesh's origin from the view's reference point, world axes.
        pub offset_m: [f32; 3],
        /// Part of the painting's period at the mesh's origin.
        pub period_share: f32,
        /// Where the mesh goes, world axes.
        pub velocity_mps: [f32; 3],
        /// Of the instant drawn, after the middle of a row's exposure.
        pub late_s: f32,
        /// Row of its lamp in the table of light shares.
        pub shares: u32,
        /// Share of the painting that a metre takes, each way.
        pub paint_per_m: [f32; 2],
        /// Up the track at the mesh's origin, world axes.
        pub along: [f32; 3],
        /// Its paint is the mean over this way along the track.
        pub smear_m: f32,
    }

    /// `camera_from_world` at one time, relative to the view's reference point: rows of the matrix,
    /// the translation last.
    pub struct Pose {
        /// First row.
        pub x: [f32; 4],
        /// Second row.
        pub y: [f32; 4],
        /// Third row.
        pub z: [f32; 4],
    }

    /// A headlight.
    pub struct ViewHeadlight {
        /// From the view's reference point, world axes.
        pub position_m: [f32; 3],
        /// Intensity along the axis.
        pub intensity_cd: f32,
        /// Unit vector, world axes.
        pub axis: [f32; 3],
        /// Exponent of the pattern.
        pub exponent: f32,
    }

    /// All that is the same for a whole view.
    pub struct ViewConstants {
        /// Focal lengths.
        pub focal_px: [f32; 2],
        /// Principal point.
        pub centre_px: [f32; 2],
        /// Width and height.
        pub size_px: [f32; 2],
        /// Key of the noise.
        pub key: [u32; 2],
        /// Steps of the table of poses a row; negative where the sensor is read upwards.
        pub pose_per_row: f32,
        /// From the bodies' time to the first pose.
        pub time_first_s: f32,
        /// From pose to pose.
        pub pose_step_s: f32,
        /// Index of the last pose.
        pub pose_last: f32,
        /// Digital numbers an electron in the pixels of a 2 x 2 cell, row by row.
        pub dn_per_e: [f32; 4],
        /// Signal of 1 cd/m^2, electrons.
        pub electrons_per_cd_m2: f32,
        /// Digital number of darkness.
        pub black_dn: f32,
        /// Largest digital number.
        pub white_dn: f32,
        /// Place of row 0 in the table of poses.
        pub pose_middle: f32,
        /// Read noise.
        pub read_noise_e: f32,
        /// Most electrons that a pixel holds.
        pub full_well_e: f32,
        /// Share of what is over it that spills up and down.
        pub blooming: f32,
        /// Electrons in the dark.
        pub dark_e: f32,
        /// Electrons a step of a pixel's level.
        pub level_step_e: f32,
        /// The same in a hot pixel.
        pub hot_step_e: f32,
        /// Whether to draw noise.
        pub noise: u32,
        /// Frame number of the noise.
        pub frame: u32,
        /// Decay length of the glare.
        pub halo_px: f32,
        /// Signals are clamped at this many electrons.
        pub saturation_e: f32,
        /// p1, p2 of the lens's distortion.
        pub tangential: [f32; 2],
        /// k1, k2, k3 and the square of its reach.
        pub radial: [f32; 4],
        /// Share of light that the air takes on a metre.
        pub extinction_per_m: f32,
        /// Signal of endless air.
        pub airlight_e: f32,
        /// Circle of confusion of a point at depth 1 m, were infinity in focus.
        pub confusion_px_m: f32,
        /// One over the distance in focus.
        pub focus_per_m: f32,
        /// What is out of focus is blurred by what is up to this far away.
        pub reach_px: i32,
        /// Lamps that glossy surfaces mirror.
        pub mirrored: u32,
        /// Signal where nothing is drawn.
        pub beyond_e: f32,
        /// Fills the stride.
        pub unused: u32,
        /// Headlights.
        pub headlights: [ViewHeadlight; MAX_HEADLIGHTS],
    }

    /// A part of the picture, from the outer corners of its pixels.
    pub struct Part {
        /// Upper left.
        pub low: [f32; 2],
        /// Lower right.
        pub high: [f32; 2],
    }

    /// A lamp's disc in a view.
    pub struct Lamp {
        /// Upper left bound.
        pub low: [f32; 2],
        /// Lower right bound.
        pub high: [f32; 2],
        /// First row that its table has.
        pub first_row: i32,
        /// Entry of the table for that row.
        pub rows_at: u32,
        /// First instant of that row.
        pub instants_at: u32,
        /// Instants of every row.
        pub instants: u32,
        /// Radius of the disc.
        pub radius_m: f32,
        /// Exponent of luminance against the cosine.
        pub exponent: f32,
        /// Signal of the disc while off.
        pub dark_e: f32,
        /// One over the standard deviation of its spread.
        pub sharp: f32,
        /// A 24th of the spread's fourth cumulant over the square of its variance, less its sign.
        pub flat: f32,
        /// The spread ends this far away.
        pub ends_px: f32,
    }

    /// A disc while one row is exposed.
    pub struct DiscRow {
        /// In the camera's frame.
        pub normal: [f32; 3],
        /// Fills the stride.
        pub unused: f32,
    }

    /// A disc in a part of the time in which one row is exposed.
    pub struct Instant {
        /// In the camera's frame.
        pub centre: [f32; 3],
        /// Signal along the normal in this part of the exposure.
        pub signal_e: f32,
    }

    /// A lamp's glare in a view.
    pub struct GlareArea {
        /// Upper left bound.
        pub low: [f32; 2],
        /// Lower right bound.
        pub high: [f32; 2],
        /// First row that its table has.
        pub first_row: i32,
        /// Entry of the table for that row.
        pub rows_at: u32,
    }

    /// Glare while one row is exposed.
    pub struct GlareRow {
        /// Centre of the lamp in the image.
        pub centre_px: [f32; 2],
        /// Radius of a circle as large as the lamp's image.
        pub apparent_px: f32,
        /// Signal of the near part on the disc.
        pub near_e: f32,
        /// Signal of the wide part times the third power of its width.
        pub wide_e: f32,
        /// Square of that width.
        pub wide_px2: f32,
    }

    /// A lamp that glossy surfaces mirror.
    pub struct Mirrored {
        /// From the view's reference point, world axes.
        pub position_m: [f32; 3],
        /// Mean intensity along the axis.
        pub intensity_cd: f32,
        /// Unit vector, world axes.
        pub axis: [f32; 3],
        /// Exponent of the pattern.
        pub exponent: f32,
        /// Radius of its disc.
        pub radius_m: f32,
        /// Its row in the table of light shares.
        pub shares: u32,
        /// Fills the stride.
        pub unused: [u32; 2],
    }

    /// What a corner of a tile sees.
    pub struct Corner {
        /// A pixel at optical depth z is the point `origin_m` + z `ray` from the reference point.
        pub origin_m: [f32; 3],
        /// From the bodies' time to the middle of the row's exposure.
        pub time_s: f32,
        /// World axes.
        pub ray: [f32; 3],
        /// Fills the stride.
        pub unused: f32,
    }

    /// A part of the picture in which shadows may fall.
    pub struct Tile {
        /// Upper left.
        pub low_px: [f32; 2],
        /// Lower right.
        pub high_px: [f32; 2],
        /// Where its shaded lights begin in the lists.
        pub shaded: u32,
        /// Where its other lights begin.
        pub plain: u32,
        /// After the last one.
        pub end: u32,
        /// Fills the stride.
        pub unused: u32,
        /// Ambient light: in the mean, and what is added for a normal upward.
        pub ambient_lx: [f32; 2],
        /// Fills the stride.
        pub unused_too: [f32; 2],
        /// Upper left, upper right, lower left, lower right.
        pub corners: [Corner; 4],
    }

    /// A lamp or headlight as shadows need it.
    pub struct ShadowSource {
        /// From the view's reference point, world axes.
        pub position_m: [f32; 3],
        /// Mean intensity along the axis.
        pub intensity_cd: f32,
        /// Unit vector, world axes.
        pub axis: [f32; 3],
        /// Exponent of the pattern.
        pub exponent: f32,
        /// A radius of its disc.
        pub aside_m: [f32; 3],
        /// It does not light what is farther.
        pub reach_m: f32,
        /// The radius of its disc across the other.
        pub up_m: [f32; 3],
        /// Fills the last vector up.
        pub unused: f32,
    }

    /// A body that hides light: a capsule, or the part of a tube that is inside all of some slabs.
    pub struct Blocker {
        /// Centre at the bodies' time, from the view's reference point.
        pub centre_m: [f32; 3],
        /// Radius of capsule or tube.
        pub radius_m: f32,
        /// Where it goes.
        pub velocity_mps: [f32; 3],
        /// First of its slabs.
        pub first_slab: u32,
        /// Of a capsule: to an end of its straight part. Of a tube: unit vector; 0 where there is none.
        pub axis: [f32; 3],
        /// After the last of its slabs.
        pub end_slab: u32,
    }

    /// Space between two parallel planes.
    pub struct Slab {
        /// Unit normal, world axes.
        pub normal: [f32; 3],
        /// From the body's centre to one plane.
        pub low_m: f32,
        /// To the other.
        pub high_m: f32,
        /// Fills the stride.
        pub unused: [f32; 3],
    }
}
