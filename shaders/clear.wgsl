// Parts of a picture before anything is drawn in them.

struct Part {
    // Bounds, pixels.
    low: vec2f,
    high: vec2f,
    // Signal where nothing is drawn.
    empty_e: f32,
    unused: f32,
}

@group(0) @binding(1) var<storage, read> parts: array<Part>;

struct Corner {
    // Infinitely far away.
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) empty_e: f32,
}

@vertex
fn part_corner(@builtin(vertex_index) k: u32, @builtin(instance_index) part: u32) -> Corner {
    return Corner(rectangle(k, parts[part].low, parts[part].high), parts[part].empty_e);
}

@fragment
fn clear(in: Corner) -> @location(0) vec4f {
    return vec4f(in.empty_e, 0.0, 0.0, 1.0);
}
