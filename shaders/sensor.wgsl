// The sensor: fixed pattern, noise, bits, as twin/render/sensor.rs has it. Every fragment makes
// four neighbouring pixels of a row, packed in one RGBA texel: the target's words are the image,
// and one hash serves four pixels.

@group(0) @binding(1) var glare: texture_2d<f32>;
// Four pixels an entry, in half precision; rows begin at multiples of 256 bytes.
@group(0) @binding(2) var<storage, read> signal: array<vec2u>;
// Four pixels' words a texel; see twin/render/pixel_map.rs.
@group(0) @binding(3) var map: texture_2d<u32>;

// How far charge spills up and down; 0 where nothing does.
override BLOOMING_REACH: i32 = 0;

// Glare in four pixels of a row, which lie between two texels of it.
fn glare_in(at: vec2i) -> vec4f {
    // A sum may have become infinite.
    let here = min(textureLoad(glare, at, 0).r, BRIGHTEST_E);
    let next = min(textureLoad(glare, at + vec2i(1, 0), 0).r, BRIGHTEST_E);
    return here + (next - here) * vec4f(0.0, 0.25, 0.5, 0.75);
}

// What the view says of the sensor, the same in every texel: a software adapter reads a uniform once
// for each of the pixels that it works at together, but hands on a flat value at once.
struct Texel {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) dn_per_e: vec4f,
    @location(1) @interpolate(flat, either) saturation_e: f32,
    @location(2) @interpolate(flat, either) dark_e: f32,
    @location(3) @interpolate(flat, either) level_step_e: f32,
    @location(4) @interpolate(flat, either) hot_step_e: f32,
    @location(5) @interpolate(flat, either) full_well_e: f32,
    @location(6) @interpolate(flat, either) read_noise_e: f32,
    @location(7) @interpolate(flat, either) black_dn: f32,
    @location(8) @interpolate(flat, either) white_dn: f32,
    // Of the noise, the frame's number last.
    @location(9) @interpolate(flat, either) key: vec3u,
    // 0 without noise.
    @location(10) @interpolate(flat, either) noise: f32,
    // Entries a row of `signal`.
    @location(11) @interpolate(flat, either) stride: u32,
    // Texels a row.
    @location(12) @interpolate(flat, either) width: u32,
}

@vertex
fn whole(@builtin(vertex_index) k: u32) -> Texel {
    let clip = rectangle(k, vec2f(-0.5), view.size_px - 0.5);
    let width_px = u32(view.size_px.x);
    return Texel(
        clip,
        view.dn_per_e,
        view.saturation_e,
        view.dark_e,
        view.level_step_e,
        view.hot_step_e,
        view.full_well_e,
        view.read_noise_e,
        view.black_dn,
        view.white_dn,
        vec3u(view.key, view.frame),
        f32(min(view.noise, 1u)),
        (width_px + 127u) / 128u * 32u,
        (width_px + 3u) / 4u,
    );
}

// In (0, 1): the upper 24 bits, which f32 holds.
fn unit(word: vec2u) -> vec2f {
    return (vec2f(word >> vec2u(8u)) + 0.5) / 16777216.0;
}

// Four standard normal numbers by Box and Muller's transform.
fn gaussian(key: vec3u, counter: u32) -> vec4f {
    let word = pcg4d(vec4u(key, counter));
    let radius = sqrt(max(-2.0 * log(unit(word.xz)), vec2f(0.0)));
    let turn = 2.0 * PI * unit(word.yw);
    return vec4f(radius * cos(turn), radius * sin(turn));
}

// Charge of the four pixels at `at` before anything spills.
fn charge_e(in: Texel, at: vec2i) -> vec4f {
    let halves = signal[u32(at.y) * in.stride + u32(at.x)];
    let s = vec4f(unpack2x16float(halves.x), unpack2x16float(halves.y)) + glare_in(at);
    let word = textureLoad(map, at, 0);
    let gain = GAIN_STEP * vec4f(vec4i(word & vec4u(0xffffu)));
    let level = vec4f(bitcast<vec4i>(word) >> vec4u(LEVEL_SHIFT));
    let hot = (word & vec4u(HOT)) != vec4u(0u);
    let step_e = select(vec4f(in.level_step_e), vec4f(in.hot_step_e), hot);
    // What half precision ends at may be any amount more.
    let held = select(min(s, vec4f(in.saturation_e)), vec4f(in.saturation_e), s >= vec4f(BRIGHTEST_E));
    return held * gain + (level * step_e + in.dark_e);
}

// What comes into four pixels with `charge` from above and below; see BLOOMING_REACH in
// twin/render/sensor.rs.
fn spilled_e(in: Texel, charge: vec4f) -> vec4f {
    let room = 0.5 * max(in.full_well_e - charge, vec4f(0.0));
    let at = vec2i(in.clip.xy);
    let rows = i32(view.size_px.y);
    var spilled = vec4f(0.0);
    for (var side = -1; side <= 1; side += 2) {
        var flow = vec4f(0.0);
        for (var k = BLOOMING_REACH; k > 0; k--) {
            let y = at.y + side * k;
            if y >= 0 && y < rows {
                let over = charge_e(in, vec2i(at.x, y)) - in.full_well_e;
                let added = select(over, view.blooming * over, over > vec4f(0.0));
                flow = max(flow + 0.5 * added, vec4f(0.0));
            }
        }
        spilled += min(flow, room);
    }
    return spilled;
}

// Digital numbers of the four pixels of a texel.
fn converted(in: Texel) -> vec4f {
    let at = vec2i(in.clip.xy);
    var charge = charge_e(in, at);
    if BLOOMING_REACH > 0 {
        charge += spilled_e(in, charge);
    }
    let n = in.noise * gaussian(in.key, u32(at.y) * in.width + u32(at.x));
    let read_e = in.read_noise_e;
    let deviation = sqrt(max(charge + read_e * read_e, vec4f(0.0)));
    // A full pixel has no shot noise, but still read noise.
    let electrons = min(charge + deviation * n, in.full_well_e + read_e * n);
    let dn_per_e = select(in.dn_per_e.xyxy, in.dn_per_e.zwzw, (at.y & 1) == 1);
    let dn = in.black_dn + dn_per_e * electrons;
    return round(clamp(dn, vec4f(0.0), vec4f(in.white_dn)));
}

@fragment
fn develop(in: Texel) -> @location(0) vec4u {
    return vec4u(converted(in));
}
