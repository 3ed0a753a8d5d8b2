// Structs that stages share with the host, and functions that several stages use. Twins of the structs:
// src/engine/gpu/layout.rs. A test compares names, offsets, sizes and constants.

// Side of a workgroup, pixels.
const WORKGROUP: u32 = 8u;

// Uniforms of one sample of one window.
struct FrameUniforms {
    clip_from_world: mat4x4<f32>,
    eye_world: vec3<f32>,
    // Offset of the sample in its pixel, along x.
    jitter_x: f32,
    // Half the width of the image plane at distance 1; `up` is half its height.
    right: vec3<f32>,
    // Offset of the sample in its pixel, along y.
    jitter_y: f32,
    up: vec3<f32>,
    // Number of the sample, from 0, among the `samples` that are summed up.
    sample_index: u32,
    forward: vec3<f32>,
    samples: u32,
    // Radiance of the background straight up; `horizon` is that at the horizon and below.
    zenith: vec3<f32>,
    light_count: u32,
    horizon: vec3<f32>,
    // Exponent p of the fibre model.
    p: f32,
    ambient: vec3<f32>,
    // Transmittance below which a ray ends.
    early_end: f32,
    // nx, ny, nz of the volume. With several volumes the shader reads VolumeConstants in place of this and
    // of the other properties of the volume.
    cells: vec3<i32>,
    // Largest number of cells on one walk.
    max_cells: u32,
    image_width: f32,
    image_height: f32,
    // log₂e · α/65535 · σ (1/m) or τ: optical depth in bits per unit of ρ code, with σ also per metre.
    extinction: f32,
    // 1: angles are measured in the frame of the texture. 0: in the world.
    texture_frame: u32,
    // Extinction of the haze at the eye, 1/m. See src/light/haze.rs.
    haze_density: f32,
    // Rate at which the haze thins upwards, 1/m.
    haze_falloff: f32,
    // Part of the image that the targets hold: its first pixel and its size.
    window_x: u32,
    window_y: u32,
    window_width: u32,
    window_height: u32,
    // Distance that the volume has moved down the flow, 0 to ny cells.
    flow_cells: f32,
    // Layers of the target of quad ids: the largest number of sheets on one ray.
    layers: u32,
    // Radiance of endless haze.
    haze_color: vec3<f32>,
    // Metres of haze in front of the background.
    haze_far: f32,
    // Number of the light that rock casts shadows from; 0xffffffff if there is none.
    shadow_light: u32,
    // Number of levels of the volume, itself included.
    levels: u32,
    // Solid angle of the pixel in the middle of the image, divided by the number of samples, sr.
    footprint: f32,
    // 1: the background is transparent. 0: it is seen.
    alpha: u32,
    // Constants that turn a depth of the z-buffer into a point: DepthToPoint of src/picture/camera.rs.
    anchor: vec3<f32>,
    depth_shift: f32,
    depth_rise: f32,
    depth_slope: f32,
    depth_scale: f32,
    // Cells by which the volume moves down the flow while the shutter is open.
    flow_moves: f32,
    // Times of the sample in all pixels: SampleTimes of src/picture/shutter.rs.
    shutter_first: f32,
    shutter_step: f32,
    // Turn of the sample to walk strands: StrandTurn of src/trace/lookup.rs.
    strand_scale: f32,
    strand_shift: f32,
    // How far both fields of billows have risen, in loops, and their weights: BillowTimes of
    // src/trace/billow.rs.
    billow: vec4<f32>,
}

struct Light {
    // Unit direction towards a directional light, or the position of another light, metres.
    vector: vec3<f32>,
    has_position: u32,
    // Colour × intensity, at 1 m if the light has a position.
    intensity: vec3<f32>,
    // Cosine at the edge of a spot light's cone, outside of which it is dark; −2 for other lights.
    cos_edge: f32,
    // Unit vector against a spot light's beam.
    axis: vec3<f32>,
    // 1 / (cosine inside of which the light is full − cos_edge).
    inverse_soft: f32,
}

struct Quad {
    // Corners of what is drawn, in the world, metres. A triangle repeats its last corner.
    corners: array<vec4<f32>, 4>,
    // Axes of the plane in the world: e1, e2 and the normal n.
    e1: vec3<f32>,
    // Depth H of one volume, metres.
    thickness: f32,
    e2: vec3<f32>,
    // Copies of the volume along u; `repeat_v` is the number along v.
    repeat_u: f32,
    n: vec3<f32>,
    repeat_v: f32,
    // The plane as the eye sees it, and the eye's height over it: PlaneView of src/mapping/view.rs.
    across: vec3<f32>,
    height: f32,
    along: vec3<f32>,
    // Index of the first value of the material's multiple-scattering profile.
    profile: u32,
    normal: vec3<f32>,
    // Number of the quad's volume.
    volume: u32,
    // E = B − A, F = D − A and G = A − B + C − D in the plane, metres.
    e: vec2<f32>,
    f: vec2<f32>,
    g: vec2<f32>,
    // Texture position of corner A, in copies of the volume along u and v.
    offset: vec2<f32>,
    // Erosion e at A, B, C and D.
    erosion: vec4<f32>,
    // Corner A of the map in the world, metres.
    a: vec3<f32>,
    // Ψ of mist, which replaces that of the cells; 0 if the quad is not mist.
    mist: f32,
    // Holes: shares that are torn at v = 0 and v = 1, and the holes' cells across a copy of the volume and
    // along it.
    tear: vec4<f32>,
    // Shares of the surroundings' light and of the light that casts shadows that the quad loses, each at
    // (0, 0), (1, 0), (1, 1) and (0, 1).
    occlusion: vec4<f32>,
    shadow: vec4<f32>,
    // Billows of mist: strength, reciprocal size in 1/m, metres of rise in a loop, and padding.
    billow: vec4<f32>,
}

// Rectangular part of the window, pixels.
struct Tile {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

// Workgroups that one submission works on: `count` entries from `first` of a list. An entry holds a
// workgroup's x in its lower half and y in its upper half.
struct Groups {
    area: Tile,
    first: u32,
    count: u32,
    pad_a: u32,
    pad_b: u32,
}

// Index of the list entry that workgroup `group` takes: first the even ones, then the odd ones. Software
// Vulkan gives each of its threads a fixed part of a dispatch; interleaving balances their work, because
// water is not everywhere equally dense.
fn listed(groups: Groups, group: u32) -> u32 {
    let half = (groups.count + 1u) / 2u;
    return groups.first + select(2u * group, 2u * (group - half) + 1u, group >= half);
}

// Cross product of two vectors in a plane: its component along the normal.
fn cross2(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

fn cross3(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

// Dot product, summed from left to right as in the CPU twins. The built-in `dot` leaves the order to the
// device.
fn dot3(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn dot2(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.x + a.y * b.y;
}

// Unit direction from a point to a light, and the factor of its intensity at the point. Twin: Light::at in
// src/light/lights.rs.
fn light_from(light: Light, point: vec3<f32>) -> vec4<f32> {
    if light.has_position == 0u {
        return vec4<f32>(light.vector, 1.0);
    }
    let away = light.vector - point;
    let d2 = max(dot3(away, away), 1e-12);
    let to_light = away / sqrt(d2);
    var falloff = 1.0 / d2;
    if light.cos_edge > -2.0 {
        let s = clamp((dot3(light.axis, to_light) - light.cos_edge) * light.inverse_soft, 0.0, 1.0);
        falloff *= s * s * (3.0 - 2.0 * s);
    }
    return vec4<f32>(to_light, falloff);
}

// Distance of a light from a point, metres. Twin: Light::distance.
fn light_distance(light: Light, point: vec3<f32>) -> f32 {
    let away = light.vector - point;
    return select(1.0e30, sqrt(dot3(away, away)), light.has_position != 0u);
}

// Share of light that water reflects, after Fresnel, by Schlick's approximation (1994). `cos_angle` is the
// cosine between the light and the normal. Twin: fresnel in src/engine/cpu/opaque.rs.
fn fresnel(cos_angle: f32) -> f32 {
    let m = 1.0 - clamp(cos_angle, 0.0, 1.0);
    let m2 = m * m;
    return 0.02 + 0.98 * (m2 * m2 * m);
}

// The point (X, Y) of the image under a pixel of the whole image. Twin: Camera::image_point in
// src/picture/camera.rs.
fn image_point(frame: FrameUniforms, pixel_x: u32, pixel_y: u32) -> vec2<f32> {
    let x = 2.0 * (f32(pixel_x) + frame.jitter_x) / frame.image_width - 1.0;
    let y = 1.0 - 2.0 * (f32(pixel_y) + frame.jitter_y) / frame.image_height;
    return vec2<f32>(x, y);
}

// Time of the sample in a pixel of the whole image: -0.5 when the shutter opens, 0.5 when it closes. Twin:
// SampleTimes::of in src/picture/shutter.rs.
fn shutter_time(frame: FrameUniforms, pixel_x: u32, pixel_y: u32) -> f32 {
    return frame.shutter_first + f32((hilbert(pixel_x, pixel_y) * 0x9e3779b9u) >> 8u) * frame.shutter_step;
}

// Number of a pixel along a Hilbert curve. Twin: hilbert of src/picture/shutter.rs.
fn hilbert(pixel_x: u32, pixel_y: u32) -> u32 {
    var x = pixel_x % 256u;
    var y = pixel_y % 256u;
    var number = 0u;
    for (var side = 128u; side > 0u; side /= 2u) {
        let right = select(0u, 1u, (x & side) != 0u);
        let down = select(0u, 1u, (y & side) != 0u);
        number += side * side * ((3u * right) ^ down);
        if down == 0u {
            let turned = select(vec2<u32>(x, y), vec2<u32>(255u - x, 255u - y), right == 1u);
            x = turned.y;
            y = turned.x;
        }
    }
    return number;
}

// Vector from the eye to a point of the image plane at distance 1. Twin: Camera::ray_to.
fn ray_to(frame: FrameUniforms, at: vec2<f32>) -> vec3<f32> {
    return frame.forward + frame.right * at.x + frame.up * at.y;
}

// Length of `ray_to`.
fn ray_length(frame: FrameUniforms, at: vec2<f32>) -> f32 {
    let d = ray_to(frame, at);
    return sqrt(dot3(d, d));
}

// Unit direction through a pixel of the whole image. Twin: Camera::view_ray.
fn view_ray(frame: FrameUniforms, pixel_x: u32, pixel_y: u32) -> vec3<f32> {
    let d = ray_to(frame, image_point(frame, pixel_x, pixel_y));
    return d / sqrt(dot3(d, d));
}

// Point at depth `z` of the z-buffer under a point of the image. Twin: Shading::points.
fn point_at(frame: FrameUniforms, at: vec2<f32>, z: f32) -> vec3<f32> {
    let inverse = 1.0 / (z - frame.depth_shift);
    let along = (frame.depth_rise + frame.depth_slope * z) * inverse;
    return frame.anchor + frame.forward * along
        + (frame.right * at.x + frame.up * at.y) * (frame.depth_scale * inverse);
}
