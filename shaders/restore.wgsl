// Parts of a picture before anything is drawn in them: empty, or as a camera at rest has them from what is
// kept, each pixel's steady light, and that of the lamp whose blinking shows there times its share in the row.

struct Part {
    // Bounds, pixels.
    low: vec2f,
    high: vec2f,
    // Signal where nothing is drawn.
    empty_e: f32,
    unused: f32,
}

@group(0) @binding(1) var<storage, read> parts: array<Part>;
@group(0) @binding(2) var light: texture_2d<f32>;
@group(0) @binding(3) var lamps: texture_2d<u32>;
@group(0) @binding(4) var depth: texture_depth_2d;
// See rows.wgsl.
@group(0) @binding(5) var shares: texture_2d<f32>;

struct Restored {
    @location(0) signal: vec4f,
    @builtin(frag_depth) depth: f32,
}

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) empty_e: f32,
}

@vertex
fn part_corner(@builtin(vertex_index) k: u32, @builtin(instance_index) part: u32) -> Corner {
    return Corner(rectangle(k, parts[part].low, parts[part].high), parts[part].empty_e);
}

@fragment
fn clear(in: Corner) -> Restored {
    return Restored(vec4f(in.empty_e, 0.0, 0.0, 1.0), 0.0);
}

@fragment
fn restore(in: Corner) -> Restored {
    let at = vec2u(in.clip.xy);
    let kept = textureLoad(light, at, 0);
    let share = textureLoad(shares, vec2u(at.y, textureLoad(lamps, at, 0).r), 0).r;
    let signal = min(kept.x + kept.y * share, BRIGHTEST_E);
    return Restored(vec4f(signal, 0.0, 0.0, 1.0), textureLoad(depth, at, 0));
}
