// Tunnel, rails and bodies under a rolling shutter. Writes the signal in electrons.

// Whether the blinking of lamps shows on walls.
override BANDED: bool = true;
// Whether more than a texel passes in the exposure.
override SMEARED: bool = false;

@group(0) @binding(3) var painting: texture_2d<f32>;
@group(0) @binding(4) var texels: sampler;

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

struct Lit {
    @invariant @builtin(position) clip: vec4f,
    // What white paint sends in steady light, and in that of the blinking lamp.
    @location(0) white_e: vec2f,
    @location(1) place: vec2f,
    // Its own light, and that of the air before it.
    @location(2) own_e: f32,
    @location(3) @interpolate(flat, either) shares: u32,
    // Way on the painting that passes in the exposure.
    @location(4) @interpolate(flat, either) smear: f32,
}

fn lit(in: Vertex) -> Lit {
    var out: Lit;
    let c = seen_vertex(in);
    let clear = exp(-view.extinction_per_m * length(c));
    out.clip = clip_of(c);
    let electrons_per_lx = in.paint * clear * view.electrons_per_cd_m2 / PI;
    let steady = in.light_lx.x + headlights_lx(in.position_m + in.offset_m, in.normal);
    out.white_e = vec2f(steady, in.light_lx.y) * electrons_per_lx;
    out.place = in.place_m * in.paint_per_m + vec2f(in.period_share, 0.0);
    out.own_e = mix(view.airlight_e, in.luminance_cd_m2 * view.electrons_per_cd_m2, clear);
    out.shares = in.shares;
    out.smear = in.smear_m * in.paint_per_m.x;
    return out;
}

// In the mean over what passes in the exposure, a sample a texel: between these the painting is straight.
fn albedo(in: Lit) -> f32 {
    if !SMEARED {
        return textureSample(painting, texels, in.place).r;
    }
    let size = vec2f(textureDimensions(painting));
    let right = dpdx(in.place) * size;
    let down = dpdy(in.place) * size;
    let level = 0.5 * log2(max(max(dot(right, right), dot(down, down)), 1.0));
    let count = max(ceil(abs(in.smear) * size.x), 1.0);
    let step = vec2f(in.smear / count, 0.0);
    var place = in.place + 0.5 * (1.0 - count) * step;
    var sum = 0.0;
    for (var k = 0.0; k < count; k += 1.0) {
        sum += textureSampleLevel(painting, texels, place, level).r;
        place += step;
    }
    return sum / count;
}

@vertex
fn project_lit(in: Vertex) -> Lit {
    return lit(in);
}

@fragment
fn shade_lit(in: Lit) -> @location(0) vec4f {
    var white_e = in.white_e.x + in.white_e.y;
    if BANDED {
        white_e = in.white_e.x + in.white_e.y * share_of(in.shares, u32(in.clip.y));
    }
    let signal = albedo(in) * white_e + in.own_e;
    return vec4f(min(signal, BRIGHTEST_E), 0.0, 0.0, 1.0);
}

// For a picture that is kept: light of a lamp times its share in a row comes when it is used.
struct Split {
    // Steady, and blinking in the mean.
    @location(0) light_e: vec4f,
    // The lamp's row in `shares`.
    @location(1) lamp: vec4u,
}

@vertex
fn project_split(in: Vertex) -> Lit {
    return lit(in);
}

@fragment
fn shade_split(in: Lit) -> Split {
    let light = albedo(in) * in.white_e + vec2f(in.own_e, 0.0);
    return Split(vec4f(min(light, vec2f(BRIGHTEST_E)), 0.0, 0.0), vec4u(in.shares, 0u, 0u, 0u));
}
