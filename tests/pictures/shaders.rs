//! Shaders without a GPU: every file in `shaders/` parses and validates with the constants that
//! Rust writes, and the structs that both sides share have the same layout on both.

use metrotwin::twin::render::gpu::{layout, shader_source};
use std::mem::{offset_of, size_of};

fn parse(name: &str) -> naga::Module {
    let source = shader_source(name).unwrap_or_else(|| panic!("{name} is not used by any pass"));
    let module = naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&source)));
    naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        // What WebGPU has everywhere: halves packed in words.
        naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32,
    )
    .validate(&module)
    .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&source)));
    module
}

/// Provokes a shader that only a GPU would refuse, one that no pass uses, and one that declares a
/// constant again that Rust writes.
#[test]
fn every_file_validates() {
    let mut files = 0;
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders")).unwrap() {
        let path = entry.unwrap().path();
        assert_eq!(path.extension().unwrap(), "wgsl", "{path:?}");
        parse(path.file_stem().unwrap().to_str().unwrap());
        files += 1;
    }
    assert!(files > 0, "no shaders found");
}

/// Holds a struct of a shader against a list of (member, offset) and a size.
fn same_layout(shader: &str, name: &str, members: &[(&str, usize)], size: usize) {
    let module = parse(shader);
    let (_, found) = module
        .types
        .iter()
        .find(|(_, t)| t.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("no struct {name} in {shader}"));
    let naga::TypeInner::Struct {
        members: theirs,
        span,
    } = &found.inner
    else {
        panic!("{name} is no struct");
    };
    let theirs: Vec<_> = theirs
        .iter()
        .map(|m| (m.name.as_deref().unwrap(), m.offset as usize))
        .collect();
    assert_eq!(theirs, members, "{name}");
    assert_eq!(*span as usize, size, "{name}");
}

macro_rules! same_layout {
    ($shader:literal, $name:ident, $($member:ident),+) => {
        same_layout(
            $shader,
            stringify!($name),
            &[$((stringify!($member), offset_of!(layout::$name, $member))),+],
            size_of::<layout::$name>(),
        )
    };
}

/// Provokes a member that is added, moved or retyped on one side only.
#[test]
fn structs_agree() {
    same_layout!(
        "common",
        ViewConstants,
        focal_px,
        centre_px,
        size_px,
        key,
        pose_per_row,
        time_first_s,
        pose_step_s,
        pose_last,
        dn_per_e,
        electrons_per_cd_m2,
        black_dn,
        white_dn,
        pose_middle,
        read_noise_e,
        full_well_e,
        blooming,
        dark_e,
        level_step_e,
        hot_step_e,
        noise,
        frame,
        halo_px,
        saturation_e,
        tangential,
        radial,
        extinction_per_m,
        airlight_e,
        confusion_px_m,
        focus_per_m,
        reach_px,
        mirrored,
        beyond_e,
        headlights
    );
    same_layout!(
        "common",
        ViewHeadlight,
        position_m,
        intensity_cd,
        axis,
        exponent
    );
    same_layout!("rows", Pose, x, y, z);
    same_layout!(
        "gloss",
        Mirrored,
        position_m,
        intensity_cd,
        axis,
        exponent,
        radius_m,
        shares
    );
    same_layout!(
        "lamps",
        Lamp,
        low,
        high,
        first_row,
        rows_at,
        instants_at,
        instants,
        radius_m,
        exponent,
        dark_e,
        sharp,
        flat,
        ends_px
    );
    same_layout!("lamps", DiscRow, normal, unused);
    same_layout!("lamps", Instant, centre, signal_e);
    same_layout!("glare", GlareArea, low, high, first_row, rows_at);
    same_layout!(
        "glare",
        GlareRow,
        centre_px,
        apparent_px,
        near_e,
        wide_e,
        wide_px2
    );
    same_layout!("shadows", Corner, origin_m, time_s, ray);
    same_layout!(
        "shadows", Tile, low_px, high_px, shaded, plain, end, ambient_lx, corners
    );
    same_layout!(
        "shadows",
        ShadowSource,
        position_m,
        intensity_cd,
        axis,
        exponent,
        aside_m,
        reach_m,
        up_m
    );
    same_layout!(
        "shadows",
        Blocker,
        centre_m,
        radius_m,
        velocity_mps,
        first_slab,
        axis,
        end_slab
    );
    same_layout!("shadows", Slab, normal, low_m, high_m);
}
