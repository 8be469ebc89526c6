// Blurs what is out of focus: along rows, then along columns. A place's circle of confusion follows from
// its depth; it spreads over what is farther away, and over what is as near as it.

override DOWN: bool = false;

@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var depth: texture_depth_2d;

@vertex
fn whole(@builtin(vertex_index) k: u32) -> @builtin(position) vec4f {
    return rectangle(k, vec2f(-0.5), view.size_px - 0.5);
}

// Variance of a disc of confusion along either axis.
fn variance(near: f32) -> f32 {
    let width = view.confusion_px_m * abs(view.focus_per_m - near / NEAR_M);
    return max(width * width * 0.0625, 0.01);
}

@fragment
fn focus(@builtin(position) clip: vec4f) -> @location(0) vec4f {
    let here = vec2i(clip.xy);
    let last = vec2i(view.size_px) - 1;
    let near = textureLoad(depth, here, 0);
    let own = variance(near);
    var light = 0.0;
    var sum = 0.0;
    for (var k = -view.reach_px; k <= view.reach_px; k++) {
        let at = clamp(here + select(vec2i(k, 0), vec2i(0, k), DOWN), vec2i(0), last);
        let other = textureLoad(depth, at, 0);
        let theirs = variance(other);
        let spread = select(min(own, theirs), theirs, other > near);
        let weight = exp(-0.5 * f32(k * k) / spread) * inverseSqrt(spread);
        // A sum may have become infinite.
        light += weight * min(textureLoad(picture, at, 0).r, BRIGHTEST_E);
        sum += weight;
    }
    return vec4f(light / sum, 0.0, 0.0, 1.0);
}
