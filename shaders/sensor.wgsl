// The sensor: fixed pattern, noise, bits, as twin/render/sensor.rs has it. Every fragment makes
// four neighbouring pixels of a row, packed in one RGBA texel: the target's bytes are the image,
// and one hash serves four pixels.

@group(0) @binding(1) var glare: texture_2d<f32>;
// Four pixels an entry, in half precision; rows begin at multiples of 256 bytes.
@group(0) @binding(2) var<storage, read> signal: array<vec2u>;
// Four pixels' words an entry; see twin/render/pixel_map.rs.
@group(0) @binding(3) var<storage, read> map: array<vec4u>;

// How far charge spills up and down; 0 where nothing does.
override BLOOMING_REACH: i32 = 0;

// Glare in four pixels of a row, which lie between two texels of it.
fn glare_in(at: vec2i) -> vec4f {
    let here = textureLoad(glare, at, 0).r;
    let next = textureLoad(glare, at + vec2i(1, 0), 0).r;
    return here + (next - here) * vec4f(0.0, 0.25, 0.5, 0.75);
}

@vertex
fn whole(@builtin(vertex_index) k: u32) -> @builtin(position) vec4f {
    return rectangle(k, vec2f(-0.5), view.size_px - 0.5);
}

// In (0, 1): the upper 24 bits, which f32 holds.
fn unit(word: vec2u) -> vec2f {
    return (vec2f(word >> vec2u(8u)) + 0.5) / 16777216.0;
}

// Four standard normal numbers by Box and Muller's transform.
fn normals(counter: u32) -> vec4f {
    let word = pcg4d(vec4u(view.key, view.frame, counter));
    let radius = sqrt(-2.0 * log(unit(word.xz)));
    let turn = 2.0 * PI * unit(word.yw);
    return vec4f(radius * cos(turn), radius * sin(turn));
}

// Charge of the four pixels of a texel before anything spills.
fn charge_e(texel: vec2i) -> vec4f {
    let width = u32(view.size_px.x);
    let signal_row = (width + 127u) / 128u * 32u;
    let halves = signal[u32(texel.y) * signal_row + u32(texel.x)];
    let s = vec4f(unpack2x16float(halves.x), unpack2x16float(halves.y)) + glare_in(texel);
    let word = map[u32(texel.y) * ((width + 3u) / 4u) + u32(texel.x)];
    let gain = GAIN_STEP * vec4f(vec4i(word & vec4u(0xffffu)));
    let level = vec4f(bitcast<vec4i>(word) >> vec4u(LEVEL_SHIFT));
    let hot = (word & vec4u(HOT)) != vec4u(0u);
    let step_e = select(vec4f(view.level_step_e), vec4f(view.hot_step_e), hot);
    return min(s, vec4f(view.saturation_e)) * gain + (level * step_e + view.dark_e);
}

// What comes into four pixels with `charge` from above and below; see BLOOMING_REACH in
// twin/render/sensor.rs.
fn spilled_e(texel: vec2i, charge: vec4f) -> vec4f {
    let room = 0.5 * max(view.full_well_e - charge, vec4f(0.0));
    let rows = i32(view.size_px.y);
    var spilled = vec4f(0.0);
    for (var side = -1; side <= 1; side += 2) {
        var flow = vec4f(0.0);
        for (var k = BLOOMING_REACH; k > 0; k--) {
            let y = texel.y + side * k;
            if y >= 0 && y < rows {
                let over = charge_e(vec2i(texel.x, y)) - view.full_well_e;
                let added = select(over, view.blooming * over, over > vec4f(0.0));
                flow = max(flow + 0.5 * added, vec4f(0.0));
            }
        }
        spilled += min(flow, room);
    }
    return spilled;
}

// Digital numbers of the four pixels of a texel.
fn converted(texel: vec2i) -> vec4f {
    var charge = charge_e(texel);
    if BLOOMING_REACH > 0 {
        charge += spilled_e(texel, charge);
    }
    // No branch, for the reason given in lamps.wgsl.
    let per_row = (u32(view.size_px.x) + 3u) / 4u;
    let noise = normals(u32(texel.y) * per_row + u32(texel.x));
    let n = select(vec4f(0.0), noise, view.noise != 0u);
    let read_e = view.read_noise_e;
    let deviation = sqrt(max(charge + read_e * read_e, vec4f(0.0)));
    // A full pixel has no shot noise, but still read noise.
    let electrons = min(charge + deviation * n, view.full_well_e + read_e * n);
    let dn_per_e = select(view.dn_per_e.xyxy, view.dn_per_e.zwzw, (texel.y & 1) == 1);
    let dn = view.black_dn + dn_per_e * electrons;
    return round(clamp(dn, vec4f(0.0), vec4f(view.white_dn)));
}

// The eight upper bits.
@fragment
fn develop(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return floor(converted(vec2i(at.xy)) * view.grey_per_dn) / 255.0;
}

@fragment
fn develop_raw(@builtin(position) at: vec4f) -> @location(0) vec4u {
    return vec4u(converted(vec2i(at.xy)));
}
