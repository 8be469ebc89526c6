// Tunnel, rails and bodies under a rolling shutter. Writes the signal in electrons.

struct Pose {
    // Rows of camera_from_world, the translation last, relative to the view's reference point.
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// Fixed when the pipeline is made: software adapters run a loop's body even for a count of 0.
override HEADLIGHTS: u32 = 0u;
// Whether the blinking of lamps shows on walls.
override BANDED: bool = true;

@group(0) @binding(1) var<storage, read> poses: array<Pose>;
// For each lamp whose blinking shows on walls, row by row: its light in the exposure over its mean.
@group(0) @binding(2) var<storage, read> shares: array<f32>;
@group(0) @binding(3) var painting: texture_2d<f32>;
@group(0) @binding(4) var texels: sampler;

struct Vertex {
    @location(0) position_m: vec3f,
    @location(1) normal: vec3f,
    // By ambient light and all lamps but the mesh's own; by that one in the mean over time.
    @location(2) light_lx: vec2f,
    // Chainage from the mesh's origin, and metres along the outline.
    @location(3) place_m: vec2f,
    // Albedo is the painting's times x, plus y.
    @location(4) paint: vec2f,
    @location(5) albedo: f32,
    @location(6) luminance_cd_m2: f32,
    // Of the mesh: its origin from the reference point, its velocity, where the painting starts,
    // the instant drawn after the middle of a row's exposure, the first entry in `shares`, and
    // the share of the painting that a metre takes, each way.
    @location(7) offset_m: vec3f,
    @location(8) period_share: f32,
    @location(9) velocity_mps: vec3f,
    @location(10) late_s: f32,
    @location(11) shares: u32,
    @location(12) paint_per_m: vec2f,
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
    return mix(early, late, x - f32(k));
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

fn headlights_lx(p: vec3f, n: vec3f) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < HEADLIGHTS; k++) {
        let light = view.headlights[k];
        let d = p - light.position_m;
        let inverse = inverseSqrt(max(dot(d, d), 1e-4));
        let out = max(dot(light.axis, d) * inverse, 0.0);
        let into = max(-dot(n, d) * inverse, 0.0);
        let clear = exp(-view.extinction_per_m / inverse);
        sum += light.intensity_cd * pow(out, light.exponent) * into * inverse * inverse * clear;
    }
    return sum;
}

// Where it is too dark to tell a joint from the wall beside it: one colour a material.

struct Dim {
    @invariant @builtin(position) clip: vec4f,
    @location(0) signal_e: f32,
}

@vertex
fn project_dim(in: Vertex) -> Dim {
    let light = in.light_lx.x + in.light_lx.y + headlights_lx(in.position_m + in.offset_m, in.normal);
    let luminance = in.albedo * light * (1.0 / PI) + in.luminance_cd_m2;
    let c = seen_vertex(in);
    let clear = exp(-view.extinction_per_m * length(c));
    let signal_e = mix(view.airlight_e, luminance * view.electrons_per_cd_m2, clear);
    return Dim(clip_of(c), signal_e);
}

@fragment
fn shade_dim(in: Dim) -> @location(0) vec4f {
    return vec4f(min(in.signal_e, view.saturation_e), 0.0, 0.0, 1.0);
}

struct Lit {
    @invariant @builtin(position) clip: vec4f,
    @location(0) light_e: vec2f,
    @location(1) place: vec2f,
    @location(2) @interpolate(flat, either) paint: vec2f,
    // Its own light, and that of the air before it.
    @location(3) own_e: f32,
    @location(4) @interpolate(flat, either) shares: u32,
}

@vertex
fn project_lit(in: Vertex) -> Lit {
    var out: Lit;
    let c = seen_vertex(in);
    let clear = exp(-view.extinction_per_m * length(c));
    out.clip = clip_of(c);
    let electrons_per_lx = clear * view.electrons_per_cd_m2 / PI;
    let steady = in.light_lx.x + headlights_lx(in.position_m + in.offset_m, in.normal);
    out.light_e = vec2f(steady, in.light_lx.y) * electrons_per_lx;
    out.place = in.place_m * in.paint_per_m + vec2f(in.period_share, 0.0);
    out.paint = in.paint;
    out.own_e = mix(view.airlight_e, in.luminance_cd_m2 * view.electrons_per_cd_m2, clear);
    out.shares = in.shares;
    return out;
}

@fragment
fn shade_lit(in: Lit) -> @location(0) vec4f {
    let albedo = textureSample(painting, texels, in.place).r * in.paint.x + in.paint.y;
    var light_e = in.light_e.x + in.light_e.y;
    if BANDED {
        light_e = in.light_e.x + in.light_e.y * shares[in.shares + u32(in.clip.y)];
    }
    let signal = albedo * light_e + in.own_e;
    return vec4f(min(signal, view.saturation_e), 0.0, 0.0, 1.0);
}
