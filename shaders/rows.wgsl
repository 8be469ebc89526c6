// Surfaces under a rolling shutter: where a corner is seen, and from where a row looks. Stands before
// what draws surfaces.

struct Pose {
    // Rows of camera_from_world, the translation last, relative to the view's reference point.
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// Fixed when the pipeline is made: software adapters run a loop's body even for a count of 0.
override HEADLIGHTS: u32 = 0u;

@group(0) @binding(1) var<storage, read> poses: array<Pose>;
// For each lamp whose blinking shows, on walls or mirrored, a row, with a number for each row of the
// picture: its light in the exposure over its mean. Row 0 is that of steady light.
@group(0) @binding(2) var shares: texture_2d<f32>;

struct Vertex {
    @location(0) position_m: vec3f,
    @location(1) normal: vec3f,
    // By ambient light and all lamps but the mesh's own; by that one in the mean over time.
    @location(2) light_lx: vec2f,
    // Chainage from the mesh's origin, and metres along the outline.
    @location(3) place_m: vec2f,
    // Albedo is the painting's times this.
    @location(4) paint: f32,
    @location(6) luminance_cd_m2: f32,
    // Of the mesh: its origin from the reference point, its velocity, where the painting starts,
    // the instant drawn after the middle of a row's exposure, its lamp's row in `shares`, and
    // the share of the painting that a metre takes, each way.
    @location(7) offset_m: vec3f,
    @location(8) period_share: f32,
    @location(9) velocity_mps: vec3f,
    @location(10) late_s: f32,
    @location(11) shares: u32,
    @location(12) paint_per_m: vec2f,
    // What the surface mirrors: twin/render/gloss.rs; and up the track from the mesh's origin.
    @location(13) gloss: vec3f,
    @location(14) along: vec3f,
    // The paint is the mean over this way along the track.
    @location(15) smear_m: f32,
}

// The point in the camera's frame `late_s` after the middle of the exposure of row `v`.
fn seen_at(v: f32, late_s: f32, p: vec3f, velocity: vec3f) -> vec3f {
    let x = v * view.pose_per_row + view.pose_middle + late_s / view.pose_step_s;
    let k = u32(clamp(floor(x), 0.0, view.pose_last - 1.0));
    let moved = vec4f(p + velocity * (view.time_first_s + x * view.pose_step_s), 1.0);
    let a = poses[k];
    let b = poses[k + 1u];
    let early = vec3f(dot(a.x, moved), dot(a.y, moved), dot(a.z, moved));
    let late = vec3f(dot(b.x, moved), dot(b.y, moved), dot(b.z, moved));
    // Exact where the camera rests, which `mix` is not.
    return early + (x - f32(k)) * (late - early);
}

// Distorted image coordinates at depth 1, times the depth.
fn imaged(c: vec3f) -> vec2f {
    return view.focal_px * distort(c) + view.centre_px * c.z;
}

// The row that a point falls on, not far beyond the image.
fn row_of(c: vec3f) -> f32 {
    let v = imaged(vec3f(c.xy, max(c.z, NEAR_M))).y / max(c.z, NEAR_M);
    return clamp(v, -view.size_px.y, 2.0 * view.size_px.y);
}

// Solves v = row_of(seen_at(v)), which is nearly linear in v, by Aitken's acceleration of the
// fixed-point iteration.
fn seen(p: vec3f, late_s: f32, velocity: vec3f) -> vec3f {
    let v0 = 0.5 * view.size_px.y;
    let v1 = row_of(seen_at(v0, late_s, p, velocity));
    let v2 = row_of(seen_at(v1, late_s, p, velocity));
    let gap = v1 - v0;
    let slope = clamp(select(0.0, (v2 - v1) / gap, abs(gap) > 1e-3), -0.8, 0.8);
    return seen_at(v1 + (v2 - v1) / (1.0 - slope), late_s, p, velocity);
}

fn seen_vertex(in: Vertex) -> vec3f {
    return seen(in.position_m + in.offset_m, in.late_s, in.velocity_mps);
}

fn clip_of(c: vec3f) -> vec4f {
    let ndc = (imaged(c) + 0.5 * c.z) * 2.0 / view.size_px - c.z;
    return vec4f(ndc.x, -ndc.y, NEAR_M, c.z);
}

// Where the camera is `late_s` after the middle of the exposure of row `v`.
fn eye_in(v: f32, late_s: f32) -> vec3f {
    let x = v * view.pose_per_row + view.pose_middle + late_s / view.pose_step_s;
    let k = u32(clamp(floor(x), 0.0, view.pose_last - 1.0));
    let early = eye_of(poses[k]);
    return early + (x - f32(k)) * (eye_of(poses[k + 1u]) - early);
}

fn eye_of(pose: Pose) -> vec3f {
    return -(pose.x.xyz * pose.x.w + pose.y.xyz * pose.y.w + pose.z.xyz * pose.z.w);
}

// Light of a lamp over its mean, in row `v` of the picture.
fn share_of(lamp: u32, v: u32) -> f32 {
    return textureLoad(shares, vec2u(v, lamp), 0).r;
}
