// Shot noise, read noise and eight bits. Every fragment makes four neighbouring pixels of a row,
// packed in one RGBA texel: the target's bytes are the image, and one hash serves four pixels.

@group(0) @binding(1) var signal: texture_2d<f32>;
@group(0) @binding(2) var glare: texture_2d<f32>;

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

@fragment
fn develop(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let x = 4 * i32(at.x);
    let y = i32(at.y);
    let s = vec4f(
        textureLoad(signal, vec2i(x, y), 0).r,
        textureLoad(signal, vec2i(x + 1, y), 0).r,
        textureLoad(signal, vec2i(x + 2, y), 0).r,
        textureLoad(signal, vec2i(x + 3, y), 0).r,
    );
    var electrons = min(s + glare_in(vec2i(at.xy)), vec4f(view.saturation_e));
    if view.noise != 0u {
        let per_row = (u32(view.size_px.x) + 3u) / 4u;
        let n = normals(u32(y) * per_row + u32(at.x));
        electrons += sqrt(max(electrons, vec4f(0.0)) + view.read_variance_e2) * n;
    }
    let grey = view.black_grey + view.grey_per_e * electrons;
    return round(clamp(grey, vec4f(0.0), vec4f(255.0))) / 255.0;
}
