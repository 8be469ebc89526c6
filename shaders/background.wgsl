// Tunnel, rails and bodies under a rolling shutter. Writes the signal in electrons.

struct Pose {
    // Rows of camera_from_world, the translation last, relative to the view's reference point.
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// Fixed when the pipeline is made: software adapters run a loop's body even for a count of 0.
override HEADLIGHTS: u32 = 0u;

@group(0) @binding(1) var<storage, read> poses: array<Pose>;

struct Vertex {
    @location(0) position_m: vec3f,
    // By lamps and ambient light.
    @location(1) irradiance_lx: f32,
    @location(2) normal: vec3f,
    @location(3) albedo: f32,
    // Chainage from the mesh's origin, and metres along the outline.
    @location(4) pattern_m: vec2f,
    @location(5) luminance_cd_m2: f32,
    @location(6) pulse: u32,
    // Of the facet that the vertex begins: lower left corner of its two stain cells, and the
    // stains at their corners: three along the line, then three beside them, then 1 if any.
    @location(7) stain_cell: vec2f,
    @location(8) stains_a: vec4f,
    @location(9) stains_b: vec4f,
    // Of the mesh: its origin from the reference point, and its velocity.
    @location(10) offset_m: vec3f,
    @location(11) velocity_mps: vec3f,
}

struct Surface {
    @builtin(position) clip: vec4f,
    @location(0) position_m: vec3f,
    @location(1) irradiance_lx: f32,
    @location(2) pattern_m: vec2f,
    @location(3) @interpolate(flat) normal: vec3f,
    @location(4) @interpolate(flat) albedo: f32,
    @location(5) @interpolate(flat) luminance_cd_m2: f32,
    @location(6) @interpolate(flat) stain_cell: vec2f,
    @location(7) @interpolate(flat) stains_a: vec4f,
    @location(8) @interpolate(flat) stains_b: vec4f,
    // Marks a metre, their share of it, and what they add to albedo 1.
    @location(9) @interpolate(flat) pulse: vec3f,
}

// The point in the camera's frame while row `v` is in mid-exposure.
fn seen_at(v: f32, p: vec3f, velocity: vec3f) -> vec3f {
    let x = v * view.pose_per_row;
    let k = u32(clamp(floor(x), 0.0, view.pose_last - 1.0));
    let moved = vec4f(p + velocity * (view.time_first_s + x * view.pose_step_s), 1.0);
    let a = poses[k];
    let b = poses[k + 1u];
    let early = vec3f(dot(a.x, moved), dot(a.y, moved), dot(a.z, moved));
    let late = vec3f(dot(b.x, moved), dot(b.y, moved), dot(b.z, moved));
    return mix(early, late, x - f32(k));
}

// The row that a point falls on, not far beyond the image.
fn row_of(c: vec3f) -> f32 {
    let v = view.focal_px.y * c.y / max(c.z, NEAR_M) + view.centre_px.y;
    return clamp(v, -view.size_px.y, 2.0 * view.size_px.y);
}

// Solves v = row_of(seen_at(v)), which is nearly linear in v, by Aitken's acceleration of the
// fixed-point iteration.
fn seen(p: vec3f, velocity: vec3f) -> vec3f {
    let v0 = 0.5 * view.size_px.y;
    let v1 = row_of(seen_at(v0, p, velocity));
    let v2 = row_of(seen_at(v1, p, velocity));
    let gap = v1 - v0;
    let slope = clamp(select(0.0, (v2 - v1) / gap, abs(gap) > 1e-3), -0.8, 0.8);
    return seen_at(v1 + (v2 - v1) / (1.0 - slope), p, velocity);
}

@vertex
fn project(in: Vertex) -> Surface {
    let p = in.position_m + in.offset_m;
    let c = seen(p, in.velocity_mps);
    let pixel = view.focal_px * c.xy + (view.centre_px + 0.5) * c.z;
    let ndc = pixel * 2.0 / view.size_px - c.z;
    var out: Surface;
    out.clip = vec4f(ndc.x, -ndc.y, NEAR_M, c.z);
    out.position_m = p;
    out.irradiance_lx = in.irradiance_lx;
    out.pattern_m = in.pattern_m;
    out.normal = in.normal;
    out.albedo = in.albedo;
    out.luminance_cd_m2 = in.luminance_cd_m2;
    out.stain_cell = in.stain_cell;
    out.stains_a = in.stains_a;
    out.stains_b = in.stains_b;
    let pulse = PULSES[in.pulse];
    out.pulse = vec3f(1.0 / pulse.x, pulse.y / pulse.x, pulse.z - 1.0);
    return out;
}

// Integral of the pulse train from 0 to x periods.
fn pulses(x: f32, duty: f32) -> f32 {
    let whole = floor(x);
    return whole * duty + min(x - whole, duty);
}

// Value noise at a place in two cells side by side.
fn stains(at: vec2f, a: vec4f, b: vec4f) -> f32 {
    let second = at.x >= 1.0;
    let t = clamp(at - vec2f(select(0.0, 1.0, second), 0.0), vec2f(0.0), vec2f(1.0));
    let f = t * t * (3.0 - 2.0 * t);
    let near = mix(select(a.x, a.y, second), select(a.y, a.z, second), f.x);
    let far = mix(select(a.w, b.x, second), select(b.x, b.y, second), f.x);
    return mix(near, far, f.y);
}

fn headlights_lx(p: vec3f, n: vec3f) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < HEADLIGHTS; k++) {
        let light = view.headlights[k];
        let d = p - light.position_m;
        let inverse = inverseSqrt(max(dot(d, d), 1e-4));
        let out = max(dot(light.axis, d) * inverse, 0.0);
        let into = max(-dot(n, d) * inverse, 0.0);
        sum += light.intensity_cd * pow(out, light.exponent) * into * inverse * inverse;
    }
    return sum;
}

@fragment
fn shade(in: Surface) -> @location(0) vec4f {
    let p = in.position_m;
    let square = dot(p, p);
    let inverse = inverseSqrt(square);
    let sine = max(abs(dot(in.normal, p)) * inverse, MIN_SINE);
    let footprint = square * inverse / (view.focal_px.x * sine);

    // Mean of the marks over the footprint.
    let span = footprint * in.pulse.x;
    let begin = in.pattern_m.x * in.pulse.x + 0.5 * (in.pulse.y - span);
    let share = (pulses(begin + span, in.pulse.y) - pulses(begin, in.pulse.y)) / span;

    let fade = clamp(2.0 - footprint / STAIN_FADE_M, 0.0, 1.0) * in.stains_b.z;
    let noise = stains(in.pattern_m / STAIN_CELL_M - in.stain_cell, in.stains_a, in.stains_b);
    let albedo = in.albedo * (1.0 + in.pulse.z * share)
        * (1.0 + STAIN_CONTRAST * fade * (noise - 0.5));

    let light = in.irradiance_lx + headlights_lx(p, in.normal);
    let luminance = albedo * light * (1.0 / PI) + in.luminance_cd_m2;
    return vec4f(min(luminance * view.electrons_per_cd_m2, view.saturation_e), 0.0, 0.0, 1.0);
}
