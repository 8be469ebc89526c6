// Blinking discs. Everything about a lamp that changes from row to row comes in tables made in
// double precision; here is only the geometry inside a pixel.
//
// The image of a disc is bounded by a conic. Around one pixel the undistorted rays are linear, so
// in offsets (u, v) from its centre the conic is a quadratic form, and a line of constant v cuts it
// in two places that have a closed form. Between them the spread of light over the pixel is
// integrated in closed form along u, and along v by a sum over lines.

struct Lamp {
    // Bounds of the disc, pixels.
    low: vec2f,
    high: vec2f,
    // Rows `first_row` and on are entries `rows_at` and on; the instants of the first of them
    // begin at `instants_at`, each row has `instants`.
    first_row: i32,
    rows_at: u32,
    instants_at: u32,
    instants: u32,
    radius_m: f32,
    // Exponent of luminance against the cosine.
    exponent: f32,
    // Signal of the disc while off.
    dark_e: f32,
    // Of its spread, see Spread.
    sharp: f32,
    flat: f32,
    ends_px: f32,
}

struct DiscRow {
    // Of the disc in the camera's frame.
    normal: vec3f,
    unused: f32,
}

struct Instant {
    // Of the disc in the camera's frame.
    centre: vec3f,
    // Signal along the normal in this part of the exposure.
    signal_e: f32,
}

@group(0) @binding(1) var<storage, read> lamps: array<Lamp>;
@group(0) @binding(2) var<storage, read> rows: array<DiscRow>;
@group(0) @binding(3) var<storage, read> instants: array<Instant>;
@group(0) @binding(4) var depth: texture_depth_2d;

// Lines of constant v across a pixel and its blur.
const LINES: u32 = 8u;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) lamp: u32,
}

@vertex
fn disc_corner(@builtin(vertex_index) k: u32, @builtin(instance_index) lamp: u32) -> Corner {
    return Corner(rectangle(k, lamps[lamp].low, lamps[lamp].high), lamp);
}

// The ray through a pixel at depth 1, and what it gains a pixel to the right and a pixel down.
struct Rays {
    middle: vec3f,
    right: vec3f,
    down: vec3f,
}

fn rays_of(pixel: vec2f) -> Rays {
    let seen = (pixel - view.centre_px) / view.focal_px;
    var p = seen;
    // Derivative of what is seen by the ray, which is symmetric but for the reach's share.
    var a = 1.0;
    var b = 0.0;
    var d = 1.0;
    // Also where there is no distortion: a software adapter compiles a shader anew, time and again,
    // whose branches hang on the view's constants.
    let t = view.tangential;
    for (var k = 0; k < 5; k++) {
        let free = dot(p, p);
        let r2 = min(free, view.radial.w);
        let radial = 1.0 + r2 * (view.radial.x + r2 * (view.radial.y + r2 * view.radial.z));
        let aside = 2.0 * p.x * p.y * t + t.yx * (r2 + 2.0 * p * p);
        var slope = view.radial.x + r2 * (2.0 * view.radial.y + r2 * 3.0 * view.radial.z);
        slope = select(0.0, slope, free < view.radial.w);
        a = radial + 2.0 * p.x * p.x * slope + 2.0 * t.x * p.y + 6.0 * t.y * p.x;
        b = 2.0 * p.x * p.y * slope + 2.0 * t.x * p.x + 2.0 * t.y * p.y;
        d = radial + 2.0 * p.y * p.y * slope + 6.0 * t.x * p.y + 2.0 * t.y * p.x;
        let miss = seen - (p * radial + aside);
        p += vec2f(d * miss.x - b * miss.y, a * miss.y - b * miss.x) / (a * d - b * b);
    }
    let det = a * d - b * b;
    let right = vec3f(d, -b, 0.0) / (det * view.focal_px.x);
    let down = vec3f(-b, a, 0.0) / (det * view.focal_px.y);
    return Rays(vec3f(p, 1.0), right, down);
}

// A pixel's square, the Gaussian of the lens and its disc of confusion together, along either axis:
// variance and fourth cumulant, which Edgeworth's series keeps; see twin/render/gpu/spread.rs.
struct Spread {
    // One over the standard deviation.
    sharp: f32,
    // A 24th of the cumulant over the square of the variance, less its sign.
    flat: f32,
    // The spread ends this far away.
    ends_px: f32,
}

// Share of the spread below x, for two x (error function by Abramowitz and Stegun 7.1.25).
fn below(x: vec2f, s: Spread) -> vec2f {
    let z = x * s.sharp;
    let z2 = z * z;
    let fall = exp(-0.5 * z2);
    let t = 1.0 / (1.0 + 0.33267241 * abs(z));
    let tail = 0.5 * t * (0.3480242 + t * (-0.0958798 + t * 0.7478556)) * fall;
    return select(tail, 1.0 - tail, z > vec2f(0.0))
        + (0.39894228 * s.flat) * z * (z2 - 3.0) * fall;
}

// Density of the spread.
fn density(x: f32, s: Spread) -> f32 {
    let z2 = x * x * s.sharp * s.sharp;
    return 0.39894228 * s.sharp * exp(-0.5 * z2) * (1.0 - s.flat * (z2 * (z2 - 6.0) + 3.0));
}

// Share of a pixel that the disc covers.
fn coverage(rays: Rays, centre: vec3f, normal: vec3f, radius_m: f32, s: Spread) -> f32 {
    let r2 = radius_m * radius_m;
    let plane = dot(normal, centre);
    // Towards the disc's plane, and in it from the centre: both times the slope of the ray.
    let m = vec3f(dot(normal, rays.middle), dot(normal, rays.right), dot(normal, rays.down));
    let off = rays.middle * plane - centre * m.x;
    let off_u = rays.right * plane - centre * m.y;
    let off_v = rays.down * plane - centre * m.z;

    // Most pixels lie well inside or outside: from pixel to pixel the distance from the centre
    // changes by no more than the greatest gain in the pixel, give or take a tenth.
    let ends_px = s.ends_px;
    let from_m = length(off) / abs(m.x);
    let gain_u = (off_u - off * (m.y / m.x)) / m.x;
    let gain_v = (off_v - off * (m.z / m.x)) / m.x;
    let gains = vec3f(dot(gain_u, gain_u), dot(gain_v, gain_v), dot(gain_u, gain_v));
    let apart = 0.5 * (gains.x - gains.y);
    let gain = sqrt(0.5 * (gains.x + gains.y) + sqrt(apart * apart + gains.z * gains.z));
    if abs(from_m - radius_m) > 1.1 * ends_px * gain {
        return select(0.0, 1.0, from_m < radius_m);
    }

    // q + 2 (hu u + hv v) + a u^2 + 2 b u v + c v^2 < 0 inside.
    let q = dot(off, off) - r2 * m.x * m.x;
    let hu = dot(off, off_u) - r2 * m.x * m.y;
    let hv = dot(off, off_v) - r2 * m.x * m.z;
    let a = dot(off_u, off_u) - r2 * m.y * m.y;
    let b = dot(off_u, off_v) - r2 * m.y * m.z;
    let c = dot(off_v, off_v) - r2 * m.z * m.z;
    let det = a * c - b * b;
    // No ellipse: the disc reaches the camera's plane, which the tables do not let happen.
    if a <= 0.0 || det <= 0.0 {
        return 0.0;
    }
    let middle = vec2f(b * hv - c * hu, b * hu - a * hv) / det;
    let depth = max(-(q + dot(vec2f(hu, hv), middle)), 0.0);
    let half_height = sqrt(depth * a / det);
    let low = max(-ends_px, middle.y - half_height);
    let high = min(ends_px, middle.y + half_height);
    if low >= high {
        return 0.0;
    }
    let narrow = sqrt(det) / a;
    let crowd = select(vec2f(0.0), vec2f(1.0), vec2f(low, -high) > vec2f(-ends_px));
    var sum = 0.0;
    for (var k = 0u; k < LINES; k++) {
        // Lines crowd at an end of the disc, where its width grows like a square root.
        let x = (f32(k) + 0.5) / f32(LINES);
        let y = 1.0 - x;
        let v = low + (high - low) * (x - crowd.x * x * y * y + crowd.y * x * x * y);
        let weight = 1.0 - crowd.x * y * (1.0 - 3.0 * x) + crowd.y * x * (2.0 - 3.0 * x);
        let up = v - middle.y;
        let half = narrow * sqrt(max((half_height - up) * (half_height + up), 0.0));
        let mid = -(hu + b * v) / a;
        let along = below(vec2f(mid + half, mid - half), s);
        sum += weight * density(v, s) * (along.x - along.y);
    }
    return clamp(sum * (high - low) / f32(LINES), 0.0, 1.0);
}

@fragment
fn disc(in: Corner) -> @location(0) vec4f {
    let lamp = lamps[in.lamp];
    let pixel = floor(in.clip.xy);
    let r = u32(i32(pixel.y) - lamp.first_row);
    let row = rows[lamp.rows_at + r];
    let rays = rays_of(pixel);
    let first = lamp.instants_at + r * lamp.instants;

    let spread = Spread(lamp.sharp, lamp.flat, lamp.ends_px);
    var cover = 0.0;
    var signal = 0.0;
    // Counted, not compared with the last: lanes beyond the rectangle have no sensible row.
    for (var k = 0u; k < lamp.instants; k++) {
        let instant = instants[first + k];
        let c = coverage(rays, instant.centre, row.normal, lamp.radius_m, spread);
        cover += c;
        signal += c * instant.signal_e;
    }
    cover /= f32(lamp.instants);
    if cover <= 0.0 {
        discard;
    }
    let towards = dot(row.normal, rays.middle);
    let cosine = clamp(-towards * inverseSqrt(dot(rays.middle, rays.middle)), 0.0, 1.0);
    signal = signal * pow(cosine, lamp.exponent) + cover * lamp.dark_e;

    // Something nearer than the disc hides the pixel; a centimetre of slack keeps a lamp that is
    // flush with its wall in sight.
    let disc_m = dot(row.normal, instants[first + lamp.instants / 2u].centre) / towards;
    let solid_m = NEAR_M / max(textureLoad(depth, vec2i(pixel), 0), 1e-9);
    let seen = select(0.0, 1.0, solid_m > disc_m - 0.01);
    return vec4f(min(signal, BRIGHTEST_E), 0.0, 0.0, cover) * seen;
}
