// Lamps and headlights mirrored in rail heads and in a wet bed, added to the signal. The law and its
// sources stand in twin/render/gloss.rs.

struct Mirrored {
    // From the view's reference point.
    position_m: vec3f,
    // Along the axis, of a good lamp that stays on, times its mean over time.
    intensity_cd: f32,
    axis: vec3f,
    exponent: f32,
    radius_m: f32,
    // Its row in `shares`.
    shares: u32,
}

@group(0) @binding(3) var<storage, read> mirrored: array<Mirrored>;

struct Glossy {
    @builtin(position) clip: vec4f,
    @location(0) at_m: vec3f,
    @location(1) @interpolate(flat, either) normal: vec3f,
    @location(2) @interpolate(flat, either) along: vec3f,
    // Reflectance head on, roughness along and across.
    @location(3) @interpolate(flat, either) gloss: vec3f,
    @location(4) @interpolate(flat, either) late_s: f32,
}

@vertex
fn project_gloss(in: Vertex) -> Glossy {
    let clip = clip_of(seen_vertex(in));
    let along = normalize(in.along - in.normal * dot(in.normal, in.along));
    return Glossy(clip, in.position_m + in.offset_m, in.normal, along, in.gloss, in.late_s);
}

// Share of the mirrors that are not behind others from a direction.
fn unhidden(widths: vec2f, to: vec3f) -> f32 {
    let a = to.z / max(length(widths * to.xy), 1e-6);
    let seen = a * (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a));
    return select(seen, 1.0, a >= 1.6);
}

// Intensity of a source that is `away`, towards here.
fn towards_cd(axial_cd: f32, axis: vec3f, exponent: f32, away: vec3f) -> f32 {
    let distance_m = length(away);
    let cos = max(-dot(axis, away) / distance_m, 0.0);
    return axial_cd * pow(cos, exponent) * exp(-view.extinction_per_m * distance_m);
}

// Luminance mirrored of a source of 1 cd that is `away` along, across and above, towards `out`.
fn luminance(gloss: vec3f, away: vec3f, out: vec3f, radius_m: f32) -> f32 {
    let inverse = inverseSqrt(max(dot(away, away), 1e-6));
    let to = away * inverse;
    let half = to + out;
    let slope = half.xy / half.z;
    let cos2 = 1.0 / (1.0 + dot(slope, slope));

    // Squares of the widths of slopes: (x, z; z, y), with what the source's size adds.
    let level = max(dot(to.xy, to.xy), 1e-9);
    let rho2 = 0.125 * radius_m * radius_m * inverse * inverse;
    let steep2 = rho2 / (to.z * to.z);
    let squares = to.xy * to.xy / level;
    let xx = gloss.y * gloss.y + rho2 * squares.x + steep2 * squares.y;
    let yy = gloss.z * gloss.z + rho2 * squares.y + steep2 * squares.x;
    let xy = (rho2 - steep2) * to.x * to.y / level;
    let det = xx * yy - xy * xy;
    let far = (yy * slope.x * slope.x + xx * slope.y * slope.y - 2.0 * xy * slope.x * slope.y) / det;
    let leaning = exp(-far) / (PI * sqrt(det) * cos2 * cos2);

    let open = unhidden(gloss.yz, to) * unhidden(gloss.yz, out);
    let flat = clamp(1.0 - dot(out, half) * inverseSqrt(dot(half, half)), 0.0, 1.0);
    let mirrored = gloss.x + (1.0 - gloss.x) * flat * flat * flat * flat * flat;
    let l = mirrored * leaning * open * inverse * inverse / (4.0 * out.z);
    return select(0.0, l, to.z > 0.0);
}

@fragment
fn shade_gloss(in: Glossy) -> @location(0) vec4f {
    let across = cross(in.normal, in.along);
    let to_surface = mat3x3f(
        vec3f(in.along.x, across.x, in.normal.x),
        vec3f(in.along.y, across.y, in.normal.y),
        vec3f(in.along.z, across.z, in.normal.z),
    );
    let row = u32(in.clip.y);
    let sight = eye_in(f32(row), in.late_s) - in.at_m;
    let out = to_surface * normalize(sight);
    var sum = 0.0;
    for (var k = 0u; k < view.mirrored; k++) {
        let source = mirrored[k];
        let away = source.position_m - in.at_m;
        let near = select(0.0, 1.0, length(away) < MIRROR_REACH_M);
        let light = near * towards_cd(source.intensity_cd, source.axis, source.exponent, away);
        let l = luminance(in.gloss, to_surface * away, out, source.radius_m);
        sum += light * l * share_of(source.shares, row);
    }
    for (var k = 0u; k < HEADLIGHTS; k++) {
        let source = view.headlights[k];
        let away = source.position_m - in.at_m;
        let light = towards_cd(source.intensity_cd, source.axis, source.exponent, away);
        sum += light * luminance(in.gloss, to_surface * away, out, HEADLIGHT_RADIUS_M);
    }
    let clear = exp(-view.extinction_per_m * length(sight));
    let signal = select(0.0, sum * clear * view.electrons_per_cd_m2, out.z > 0.0);
    return vec4f(min(signal, BRIGHTEST_E), 0.0, 0.0, 1.0);
}
