// Glare of the lamps, row by row, in a texture of its own with a texel for every fourth pixel of a
// row: twin/render/glare.rs. Far from a lamp it is flat, near it the lamp outshines it, so between
// texels it may run straight.

struct GlareArea {
    // Bounds, pixels.
    low: vec2f,
    high: vec2f,
    // Rows `first_row` and on are entries `rows_at` and on.
    first_row: i32,
    rows_at: u32,
}

struct GlareRow {
    centre_px: vec2f,
    apparent_px: f32,
    // Signal of the near part on the disc, of the wide one times the third power of its width, and
    // the square of that.
    near_e: f32,
    wide_e: f32,
    wide_px2: f32,
}

@group(0) @binding(1) var<storage, read> glares: array<GlareArea>;
@group(0) @binding(2) var<storage, read> rows: array<GlareRow>;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) lamp: u32,
}

@vertex
fn glare_corner(@builtin(vertex_index) k: u32, @builtin(instance_index) lamp_index: u32) -> Corner {
    let lamp = glares[lamp_index];
    // The texture has a texel more than the picture has steps. A texel more on either side keeps
    // what lies between.
    let wide = (view.size_px.x + GLARE_STEP_PX - 1.0) / GLARE_STEP_PX;
    let scale = vec2f(view.size_px.x / (floor(wide) + 1.0), 1.0);
    let low = vec2f(floor(lamp.low.x / GLARE_STEP_PX), lamp.low.y + 0.5) * scale - 0.5;
    let high = vec2f(ceil(lamp.high.x / GLARE_STEP_PX) + 1.0, lamp.high.y + 0.5) * scale - 0.5;
    return Corner(rectangle(k, low, high), lamp_index);
}

@fragment
fn glare(in: Corner) -> @location(0) vec4f {
    let lamp = glares[in.lamp];
    let texel = floor(in.clip.xy);
    let row = rows[lamp.rows_at + u32(i32(texel.y) - lamp.first_row)];
    let off = vec2f(GLARE_STEP_PX, 1.0) * texel - row.centre_px;
    let r2 = dot(off, off);
    let outside = max(sqrt(r2) - row.apparent_px, 0.0) / view.halo_px;
    let narrow = inverseSqrt(row.wide_px2 + r2);
    let wide = row.wide_e * narrow * narrow * narrow;
    return vec4f(min(row.near_e * exp(-outside) + wide, BRIGHTEST_E), 0.0, 0.0, 0.0);
}
