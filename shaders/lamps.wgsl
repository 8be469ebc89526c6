// Blinking discs and their glare, row by row. Everything about a lamp that changes from row to row
// comes in a table made in double precision; here is only the geometry inside a pixel.

struct Lamp {
    // Bounds of the disc and of its glare, pixels.
    disc_low: vec2f,
    disc_high: vec2f,
    halo_low: vec2f,
    halo_high: vec2f,
    // Rows `first_row` and on are entries `table` and on.
    first_row: i32,
    table: u32,
    radius_m: f32,
    // Exponent of luminance against the cosine.
    exponent: f32,
    // Signal of the disc while off.
    dark_e: f32,
}

struct LampRow {
    // Centre in the camera's frame in the middle of each quarter of the exposure, and the signal
    // along the normal in that quarter.
    quarters: array<vec4f, 4>,
    // Normal in the camera's frame, and the signal of the glare on the disc's rim.
    normal_halo: vec4f,
    // Centre and apparent radius in the image.
    image_px: vec4f,
}

@group(0) @binding(1) var<storage, read> lamps: array<Lamp>;
@group(0) @binding(2) var<storage, read> rows: array<LampRow>;
@group(0) @binding(3) var depth: texture_depth_2d;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) lamp: u32,
}

@vertex
fn disc_corner(@builtin(vertex_index) k: u32, @builtin(instance_index) lamp: u32) -> Corner {
    return Corner(rectangle(k, lamps[lamp].disc_low, lamps[lamp].disc_high), lamp);
}

@vertex
fn halo_corner(@builtin(vertex_index) k: u32, @builtin(instance_index) lamp: u32) -> Corner {
    return Corner(rectangle(k, lamps[lamp].halo_low, lamps[lamp].halo_high), lamp);
}

// Share of the 16 sub-rays of a pixel that hit the disc.
fn coverage(ray: vec3f, centre: vec3f, normal: vec3f, radius_m: f32) -> f32 {
    let plane = dot(normal, centre);
    var hits = 0.0;
    for (var j = 0; j < 4; j++) {
        for (var i = 0; i < 4; i++) {
            let shift = (vec2f(f32(i), f32(j)) - 1.5) / (4.0 * view.focal_px);
            let sub = vec3f(ray.xy + shift, 1.0);
            let from_centre = sub * (plane / dot(normal, sub)) - centre;
            hits += select(0.0, 1.0, dot(from_centre, from_centre) <= radius_m * radius_m);
        }
    }
    return hits / 16.0;
}

@fragment
fn disc(in: Corner) -> @location(0) vec4f {
    let lamp = lamps[in.lamp];
    let pixel = floor(in.clip.xy);
    let row = rows[lamp.table + u32(i32(pixel.y) - lamp.first_row)];
    let ray = vec3f((pixel - view.centre_px) / view.focal_px, 1.0);
    let normal = row.normal_halo.xyz;

    var cover = 0.0;
    var signal = 0.0;
    for (var k = 0; k < 4; k++) {
        let quarter = row.quarters[k];
        let c = coverage(ray, quarter.xyz, normal, lamp.radius_m);
        cover += 0.25 * c;
        signal += 0.25 * c * quarter.w;
    }
    let towards = dot(normal, ray);
    let cosine = clamp(-towards * inverseSqrt(dot(ray, ray)), 0.0, 1.0);
    signal = signal * pow(cosine, lamp.exponent) + cover * lamp.dark_e;

    // Something nearer than the disc hides the pixel; a centimetre of slack keeps a lamp that is
    // flush with its wall in sight.
    let disc_m = dot(normal, row.quarters[1].xyz) / towards;
    let solid_m = NEAR_M / max(textureLoad(depth, vec2i(pixel), 0), 1e-9);
    let seen = select(0.0, 1.0, solid_m > disc_m - 0.01);
    return vec4f(min(signal, view.saturation_e), 0.0, 0.0, cover) * seen;
}

@fragment
fn halo(in: Corner) -> @location(0) vec4f {
    let lamp = lamps[in.lamp];
    let pixel = floor(in.clip.xy);
    let row = rows[lamp.table + u32(i32(pixel.y) - lamp.first_row)];
    let outside = max(length(pixel - row.image_px.xy) - row.image_px.z, 0.0) / view.halo_px;
    let glare = select(0.0, row.normal_halo.w * exp(-outside), outside <= HALO_REACH);
    return vec4f(min(glare, view.saturation_e), 0.0, 0.0, 0.0);
}
