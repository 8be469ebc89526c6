// Shadows of bodies, laid over the finished background: a factor on the light of every pixel in the
// tiles where some may fall. What is hidden is defined in twin/render/photometry.rs: straight lines from
// the surface to 16 places on a light's disc, cut by a body or not.

struct Corner {
    // A pixel at optical depth z is the point origin + z ray from the view's reference point.
    origin_m: vec3f,
    // From the bodies' time to the middle of the row's exposure.
    time_s: f32,
    ray: vec3f,
}

struct Tile {
    low_px: vec2f,
    high_px: vec2f,
    // In the lists: where the numbers of sources begin that bodies hide in whole, and then the shaded
    // lights. Each is the number of its source, where its bodies that are no capsules begin, where its
    // bodies end, and the numbers of its bodies, capsules first.
    shaded: u32,
    // From here the numbers of other sources, and their end.
    plain: u32,
    end: u32,
    // In the mean over all directions that a surface may face; added to it, times the upward part of the normal.
    ambient_lx: vec2f,
    // Upper left, upper right, lower left, lower right.
    corners: array<Corner, 4>,
}

struct ShadowSource {
    position_m: vec3f,
    intensity_cd: f32,
    axis: vec3f,
    exponent: f32,
    // Two radii of its disc.
    aside_m: vec3f,
    reach_m: f32,
    up_m: vec3f,
}

// A capsule, or the part of a tube that is inside all of some slabs.
struct Blocker {
    centre_m: vec3f,
    radius_m: f32,
    velocity_mps: vec3f,
    first_slab: u32,
    // Of a capsule: to an end of its straight part. Of a tube: unit vector; 0 where there is none.
    axis: vec3f,
    end_slab: u32,
}

// Between two parallel planes.
struct Slab {
    normal: vec3f,
    low_m: f32,
    high_m: f32,
}

// Whether some bodies are no capsules: software adapters run a loop's body even for a count of 0.
override OTHERS: bool = true;

@group(0) @binding(1) var depth: texture_depth_2d;
@group(0) @binding(2) var<storage, read> tiles: array<Tile>;
// Software adapters read these faster from uniforms than from storage.
@group(0) @binding(3) var<uniform> lists: array<vec4u, MAX_WORDS / 4u>;
@group(0) @binding(4) var<uniform> sources: array<ShadowSource, MAX_SOURCES>;
@group(0) @binding(5) var<uniform> blockers: array<Blocker, MAX_BLOCKERS>;
@group(0) @binding(6) var<uniform> slabs: array<Slab, MAX_SLABS>;

const ALL: u32 = 0xffffu;
// Cosine and sine of the golden angle.
const GOLDEN: vec2f = vec2f(-0.73736888, 0.67549029);
const FAR: f32 = 1e9;

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) origin_m: vec3f,
    @location(1) ray: vec3f,
    @location(2) time_s: f32,
    // Shaded lights, other lights and their end in the lists.
    @location(3) @interpolate(flat, either) lights: vec3u,
    @location(4) @interpolate(flat, either) ambient_lx: vec2f,
}

@vertex
fn tile_corner(@builtin(vertex_index) k: u32, @builtin(instance_index) index: u32) -> Varying {
    let right = u32(k == 1u || k == 2u || k == 4u);
    let down = u32(k >= 2u && k != 3u);
    let corner = tiles[index].corners[right + 2u * down];
    return Varying(
        rectangle(k, tiles[index].low_px, tiles[index].high_px),
        corner.origin_m,
        corner.ray,
        corner.time_s,
        vec3u(tiles[index].shaded, tiles[index].plain, tiles[index].end),
        tiles[index].ambient_lx,
    );
}

// Least distance of the lines from `a` along `way` and from -axis to axis.
fn gap_m(a: vec3f, way: vec3f, axis: vec3f) -> f32 {
    let along = max(dot(way, way), 1e-12);
    let length2 = max(dot(axis, axis), 1e-12);
    let b = dot(way, axis);
    let c = dot(way, a);
    let f = dot(axis, a);
    let skew = along * length2 - b * b;
    let near = select(0.0, clamp((b * f - c * length2) / skew, 0.0, 1.0), skew > 1e-9);
    let t = clamp((b * near + f) / length2, -1.0, 1.0);
    let s = clamp((b * t - c) / along, 0.0, 1.0);
    return length(a + way * s - axis * t);
}

// The part of a span of s in which over + slope s <= 0.
fn cut(span: vec2f, over: f32, slope: f32) -> vec2f {
    let steep = select(slope, 1e-9, abs(slope) < 1e-9);
    let s = -over / steep;
    return select(vec2f(max(span.x, s), span.y), vec2f(span.x, min(span.y, s)), steep > 0.0);
}

// Where the line from `a` along `way` is in a tube with slabs.
fn span_in(a: vec3f, way: vec3f, body: Blocker) -> vec2f {
    var span = span_in_tube(a, way, body.axis, body.radius_m);
    for (var k = body.first_slab; k < body.end_slab; k++) {
        let slab = slabs[k];
        let at = dot(slab.normal, a);
        let slope = dot(slab.normal, way);
        span = cut(span, at - slab.high_m, slope);
        span = cut(span, slab.low_m - at, -slope);
    }
    return span;
}

fn span_in_tube(a: vec3f, way: vec3f, axis: vec3f, radius_m: f32) -> vec2f {
    let side = a - axis * dot(axis, a);
    let across = way - axis * dot(axis, way);
    let q = max(dot(across, across), 1e-9);
    let half = dot(side, across) / q;
    let square = half * half - (dot(side, side) - radius_m * radius_m) / q;
    let root = sqrt(max(square, 0.0));
    return select(vec2f(FAR, -FAR), vec2f(-half - root, -half + root), square > 0.0);
}

// Where a cone about that line, `wide_m` wide at its end, is in it with any part, and with all.
fn spans_in(a: vec3f, way: vec3f, body: Blocker, wide_m: f32) -> vec4f {
    var any = span_in_tube(a, way, body.axis, body.radius_m + wide_m);
    var all = span_in_tube(a, way, body.axis, max(body.radius_m - wide_m, 0.0));
    for (var k = body.first_slab; k < body.end_slab; k++) {
        let slab = slabs[k];
        let at = dot(slab.normal, a);
        let slope = dot(slab.normal, way);
        any = cut(any, at - slab.high_m, slope - wide_m);
        any = cut(any, slab.low_m - at, -slope - wide_m);
        all = cut(all, at - slab.high_m, slope + wide_m);
        all = cut(all, slab.low_m - at, -slope + wide_m);
    }
    return vec4f(any, all);
}

// Whether a line enters from outside, before its end.
fn enters(span: vec2f, end: f32) -> bool {
    return span.x >= 0.0 && span.x <= span.y && span.x < end;
}

// To the place number `k` on a disc, in shares of its radius; `turn` is the cosine and sine of k
// golden angles.
fn place(source: ShadowSource, k: u32, turn: vec2f) -> vec3f {
    return (source.aside_m * turn.x + source.up_m * turn.y) * sqrt((f32(k) + 0.5) / f32(PLACES));
}

fn turned(turn: vec2f) -> vec2f {
    return vec2f(
        turn.x * GOLDEN.x - turn.y * GOLDEN.y,
        turn.x * GOLDEN.y + turn.y * GOLDEN.x,
    );
}

// A number of the lists.
fn word(at: u32) -> u32 {
    return lists[at >> 2u][at & 3u];
}

// Which places on a light's disc the capsules in a range of the lists hide from a point. Where all
// or none of the disc is hidden one line to its centre tells.
fn behind_capsules(at: vec3f, time_s: f32, source: ShadowSource, begin: u32, end: u32) -> u32 {
    let radius_m = length(source.aside_m);
    let to = source.position_m - at;
    var mask = 0u;
    for (var j = begin; j < end; j++) {
        let body = blockers[word(j)];
        let a = at - body.centre_m - body.velocity_mps * time_s;
        // A line that starts inside meets nothing.
        let outside = gap_m(a, vec3f(0.0), body.axis) >= body.radius_m;
        let off_m = gap_m(a, to, body.axis) - body.radius_m;
        mask |= select(0u, ALL, outside && off_m < -radius_m);
        let edge = outside && abs(off_m) <= radius_m && mask != ALL;
        var turn = vec2f(1.0, 0.0);
        for (var k = select(PLACES, 0u, edge); k < PLACES; k++) {
            let way = to + place(source, k, turn);
            mask |= select(0u, 1u << k, gap_m(a, way, body.axis) < body.radius_m);
            turn = turned(turn);
        }
    }
    return mask;
}

// The same of other bodies.
fn behind_others(at: vec3f, time_s: f32, source: ShadowSource, begin: u32, end: u32) -> u32 {
    let radius_m = length(source.aside_m);
    let to = source.position_m - at;
    var mask = 0u;
    for (var j = begin; j < end; j++) {
        let body = blockers[word(j)];
        let a = at - body.centre_m - body.velocity_mps * time_s;
        let spans = spans_in(a, to, body, radius_m);
        mask |= select(0u, ALL, enters(spans.zw, 1.0));
        let some = spans.y >= max(spans.x, 0.0) && spans.x < 1.0 && mask != ALL;
        var turn = vec2f(1.0, 0.0);
        for (var k = select(PLACES, 0u, some); k < PLACES; k++) {
            let span = span_in(a, to + place(source, k, turn), body);
            mask |= select(0u, 1u << k, enters(span, 1.0));
            turn = turned(turn);
        }
    }
    return mask;
}

// Illuminance by a light: twin/render/photometry.rs.
fn irradiance_lx(p: vec3f, n: vec3f, source: ShadowSource) -> f32 {
    let d = p - source.position_m;
    let square = max(dot(d, d), 1e-4);
    let inverse = inverseSqrt(square);
    let out = max(dot(source.axis, d) * inverse, 0.0);
    let into = max(-dot(n, d) * inverse, 0.0);
    let clear = exp(-view.extinction_per_m / inverse);
    let lux = source.intensity_cd * pow(out, source.exponent) * into * inverse * inverse * clear;
    return select(0.0, lux, square <= source.reach_m * source.reach_m);
}

// The neighbour of a pixel one way or the other that is on its surface: depth is linear over the
// picture of a plane, so an edge is where it jumps.
fn side(pixel: vec2i, way: vec2i, in: Varying, origin: vec3f, ray: vec3f) -> vec3f {
    let here = textureLoad(depth, pixel, 0);
    let before = textureLoad(depth, max(pixel - way, vec2i(0)), 0);
    let after = textureLoad(depth, min(pixel + way, vec2i(view.size_px) - 1), 0);
    let first = any(pixel - way < vec2i(0));
    let last = any(pixel + way >= vec2i(view.size_px));
    let forth = first || (!last && abs(after - here) < abs(before - here));
    let z = NEAR_M / max(select(before, after, forth), 1e-9);
    let sign = select(-1.0, 1.0, forth);
    return in.origin_m + sign * origin + z * (in.ray + sign * ray);
}

// In the alpha the share of the light that is left; before it what the air between adds to it.
@fragment
fn shade(in: Varying) -> @location(0) vec4f {
    let pixel = vec2i(in.clip.xy);
    let z = NEAR_M / max(textureLoad(depth, pixel, 0), 1e-9);
    let from_eye = z * in.ray;
    let p = in.origin_m + from_eye;
    let right = side(pixel, vec2i(1, 0), in, dpdx(in.origin_m), dpdx(in.ray)) - p;
    let down = side(pixel, vec2i(0, 1), in, dpdy(in.origin_m), dpdy(in.ray)) - p;
    // One of both may be the pixel before, so the sign is left to the view.
    let across = cross(right, down);
    let n = normalize(select(across, -across, dot(across, in.ray) > 0.0));
    let start = p + n * OFFSET_M;
    var total_lx = in.ambient_lx.x + n.z * in.ambient_lx.y;
    var hidden_lx = 0.0;
    let hidden = word(in.lights.x);
    for (var k = in.lights.x + 1u; k < hidden; k = word(k + 2u)) {
        let source = sources[word(k)];
        let lux = irradiance_lx(p, n, source);
        let others = word(k + 1u);
        let end = word(k + 2u);
        // Nothing is hidden of a light that does not shine here.
        let dark = lux <= 0.0;
        var mask = behind_capsules(start, in.time_s, source, select(k + 3u, others, dark), others);
        if OTHERS {
            let done = dark || mask == ALL;
            mask |= behind_others(start, in.time_s, source, select(others, end, done), end);
        }
        total_lx += lux;
        hidden_lx += lux * f32(countOneBits(mask)) / f32(PLACES);
    }
    for (var k = hidden; k < in.lights.y; k++) {
        let lux = irradiance_lx(p, n, sources[word(k)]);
        total_lx += lux;
        hidden_lx += lux;
    }
    for (var k = in.lights.y; k < in.lights.z; k++) {
        total_lx += irradiance_lx(p, n, sources[word(k)]);
    }
    let left = 1.0 - hidden_lx / max(total_lx, 1e-9);
    let air_e = view.airlight_e * (1.0 - exp(-view.extinction_per_m * length(from_eye)));
    return vec4f(air_e * (1.0 - left), 0.0, 0.0, left);
}
