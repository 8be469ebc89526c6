// What every shader shares: the view, and the hash. Prepended to each of the other files, after
// the constants written by twin/render/gpu/shaders.rs.

const PI: f32 = 3.14159265;

struct ViewHeadlight {
    // Relative to the view's reference point.
    position_m: vec3f,
    intensity_cd: f32,
    axis: vec3f,
    exponent: f32,
}

struct ViewConstants {
    focal_px: vec2f,
    centre_px: vec2f,
    size_px: vec2f,
    key: vec2u,
    // Steps of the table of poses a row; negative where the sensor is read upwards.
    pose_per_row: f32,
    // From the bodies' time to the first pose, and from pose to pose.
    time_first_s: f32,
    pose_step_s: f32,
    pose_last: f32,
    dn_per_e: vec4f,
    electrons_per_cd_m2: f32,
    black_dn: f32,
    white_dn: f32,
    // Place of row 0 in the table of poses.
    pose_middle: f32,
    read_noise_e: f32,
    full_well_e: f32,
    blooming: f32,
    dark_e: f32,
    level_step_e: f32,
    hot_step_e: f32,
    noise: u32,
    frame: u32,
    halo_px: f32,
    saturation_e: f32,
    // p1, p2 of the lens's distortion; k1, k2, k3 and the square of its reach.
    tangential: vec2f,
    radial: vec4f,
    // Share of light that the air takes on a metre, and the signal of endless air.
    extinction_per_m: f32,
    airlight_e: f32,
    // Circle of confusion of a point at depth 1, were infinity in focus; one over the distance in
    // focus; how far away blur looks.
    confusion_px_m: f32,
    focus_per_m: f32,
    reach_px: i32,
    // Lamps that glossy surfaces mirror.
    mirrored: u32,
    // Signal where nothing is drawn.
    beyond_e: f32,
    headlights: array<ViewHeadlight, MAX_HEADLIGHTS>,
}

@group(0) @binding(0) var<uniform> view: ViewConstants;

// Where a point in the camera's frame is seen at depth 1, times its depth: bus/camera.rs.
fn distort(c: vec3f) -> vec2f {
    let p = c.xy / max(c.z, NEAR_M);
    let free = dot(p, p);
    let r2 = min(free, view.radial.w);
    let radial = 1.0 + r2 * (view.radial.x + r2 * (view.radial.y + r2 * view.radial.z));
    // Beyond the reach the tangential part grows with the radius, like the rest.
    let t = view.tangential * min(1.0, sqrt(view.radial.w / max(free, 1e-9)));
    let aside = 2.0 * p.x * p.y * t + t.yx * (free + 2.0 * p * p);
    return c.xy * radial + c.z * aside;
}

// Jarzynski and Olano, JCGT 9(3), 2020; the same as twin/random.rs.
fn pcg4d(seed: vec4u) -> vec4u {
    var v = seed * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4u(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Two triangles that span `low` to `high`, in pixels with pixel centres at integers.
fn rectangle(corner: u32, low: vec2f, high: vec2f) -> vec4f {
    let right = corner == 1u || corner == 2u || corner == 4u;
    let down = corner >= 2u && corner != 3u;
    let at = vec2f(select(low.x, high.x, right), select(low.y, high.y, down));
    let ndc = (at + 0.5) * 2.0 / view.size_px - 1.0;
    return vec4f(ndc.x, -ndc.y, 0.0, 1.0);
}
