// Mixes the picture of one instant of the exposure into the mean of others; the blend constant is
// its share.

@group(0) @binding(1) var instant: texture_2d<f32>;

@vertex
fn whole(@builtin(vertex_index) k: u32) -> @builtin(position) vec4f {
    return rectangle(k, vec2f(-0.5), view.size_px - 0.5);
}

@fragment
fn share(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return textureLoad(instant, vec2i(at.xy), 0);
}
