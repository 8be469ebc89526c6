// Parts of a picture before anything is drawn in them.

struct Part {
    // Bounds, pixels.
    low: vec2f,
    high: vec2f,
}

@group(0) @binding(1) var<storage, read> parts: array<Part>;

struct Corner {
    // Infinitely far away.
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) beyond_e: f32,
}

@vertex
fn part_corner(@builtin(vertex_index) k: u32, @builtin(instance_index) part: u32) -> Corner {
    return Corner(rectangle(k, parts[part].low, parts[part].high), view.beyond_e);
}

@fragment
fn clear(in: Corner) -> @location(0) vec4f {
    return vec4f(in.beyond_e, 0.0, 0.0, 1.0);
}
