// Tunnel, rails and bodies under a rolling shutter. Writes the signal in grey levels over black.

struct Pose {
    // Rows of camera_from_world, the translation last, relative to the view's reference point.
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

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
    // Material in bits 0-7, pulse in bits 8-15, stains in bit 16.
    @location(6) look: u32,
    // Of the mesh: its origin from the reference point, its first stain cell, its velocity.
    @location(7) offset_m: vec3f,
    @location(8) first_cell: i32,
    @location(9) velocity_mps: vec3f,
}

struct Surface {
    @builtin(position) clip: vec4f,
    @location(0) position_m: vec3f,
    @location(1) irradiance_lx: f32,
    @location(2) pattern_m: vec2f,
    @location(3) @interpolate(flat, either) normal: vec3f,
    @location(4) @interpolate(flat, either) albedo: f32,
    @location(5) @interpolate(flat, either) luminance_cd_m2: f32,
    @location(6) @interpolate(flat, either) look: u32,
    @location(7) @interpolate(flat, either) first_cell: i32,
    // Marks a metre, their share of it, and what they add to albedo 1.
    @location(8) @interpolate(flat, either) pulse: vec3f,
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
    out.look = in.look;
    out.first_cell = in.first_cell;
    let pulse = PULSES[(in.look >> 8u) & 0xffu];
    out.pulse = vec3f(1.0 / pulse.x, pulse.y / pulse.x, pulse.z - 1.0);
    return out;
}

// Integral of the pulse train from 0 to x periods.
fn pulses(x: f32, duty: f32) -> f32 {
    let whole = floor(x);
    return whole * duty + min(x - whole, duty);
}

fn lattice(i: vec2i, material: u32) -> f32 {
    return f32(pcg4d(vec4u(vec2u(i), material, 0u)).x) / 4294967296.0;
}

fn stains(s: f32, q: f32, first_cell: i32, material: u32) -> f32 {
    let at = vec2f(s, q) / STAIN_CELL_M;
    let cell = floor(at);
    let i = vec2i(cell) + vec2i(first_cell, 0);
    let t = at - cell;
    let f = t * t * (3.0 - 2.0 * t);
    let near = mix(lattice(i, material), lattice(i + vec2i(1, 0), material), f.x);
    let far = mix(lattice(i + vec2i(0, 1), material), lattice(i + vec2i(1, 1), material), f.x);
    return mix(near, far, f.y);
}

fn headlights_lx(p: vec3f, n: vec3f) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < min(view.headlight_count, MAX_HEADLIGHTS); k++) {
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

    let fade = clamp(2.0 - footprint / STAIN_FADE_M, 0.0, 1.0) * f32(in.look >> 16u);
    let noise = stains(in.pattern_m.x, in.pattern_m.y, in.first_cell, in.look & 0xffu);
    let albedo = in.albedo * (1.0 + in.pulse.z * share)
        * (1.0 + STAIN_CONTRAST * fade * (noise - 0.5));

    let light = in.irradiance_lx + headlights_lx(p, in.normal);
    let luminance = albedo * light * (1.0 / PI) + in.luminance_cd_m2;
    return vec4f(min(luminance * view.grey_per_cd_m2, SATURATION_GREY), 0.0, 0.0, 1.0);
}
