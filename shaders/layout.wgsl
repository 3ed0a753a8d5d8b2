// Types that every stage shares with the host; prepended to each stage's source. Twin:
// src/engine/gpu/layout.rs; a test compares names, offsets and sizes.

const WORKGROUP: u32 = 8u;

struct FrameUniforms {
    clip_from_world: mat4x4<f32>,
    eye_world: vec3<f32>,
    jitter_x: f32,
    // Half the image plane at distance 1: right and up are scaled by the field of view.
    right: vec3<f32>,
    jitter_y: f32,
    up: vec3<f32>,
    sample_index: u32,
    forward: vec3<f32>,
    samples: u32,
    zenith: vec3<f32>,
    light_count: u32,
    horizon: vec3<f32>,
    p: f32,
    ambient: vec3<f32>,
    early_end: f32,
    cells: vec3<i32>,
    max_cells: u32,
    image_width: f32,
    image_height: f32,
    // log₂e · α/65535 · (σ in 1/m, or τ): optical depth in bits per unit of ρ code (and metre).
    extinction: f32,
    texture_frame: u32,
    // Density of the haze at the eye, 1/m, and its decrease with height, 1/m. See src/light/haze.rs.
    haze_density: f32,
    haze_falloff: f32,
    // Part of the image that the targets hold: its first pixel and its size.
    window_x: u32,
    window_y: u32,
    window_width: u32,
    window_height: u32,
    // Distance that the volume has moved along the flow, in cells: 0 to ny.
    flow_cells: f32,
    // Layers of the quad ids: the most sheets that one ray passes.
    layers: u32,
    haze_color: vec3<f32>,
    // Distance of haze in front of the background, metres.
    haze_far: f32,
    // Index of the light for which rock casts shadows on rock; the largest u32 if there is none.
    shadow_light: u32,
    // Number of levels of the volume.
    levels: u32,
    // Solid angle of the pixel in the middle of the image, over its number of samples.
    footprint: f32,
    pad_c: f32,
}

struct Light {
    // Unit direction towards a directional light, or the position of a light that has one.
    vector: vec3<f32>,
    has_position: u32,
    intensity: vec3<f32>,
    // Cosine at the edge of a spot light's cone, below which it is dark; −2 where there is no cone.
    cos_edge: f32,
    // Unit vector opposite to a spot light's beam.
    axis: vec3<f32>,
    // 1 / (cosine where the full light begins − cos_edge).
    inverse_soft: f32,
}

struct Quad {
    corners: array<vec4<f32>, 4>,
    e1: vec3<f32>,
    thickness: f32,
    e2: vec3<f32>,
    repeat_u: f32,
    n: vec3<f32>,
    repeat_v: f32,
    // The eye relative to corner A, along e1, e2 and n.
    eye_plane: vec3<f32>,
    // Start of the multiple-scattering profile of the quad's material.
    profile: u32,
    e: vec2<f32>,
    f: vec2<f32>,
    g: vec2<f32>,
    // Texture position of corner A, in copies of the volume.
    offset: vec2<f32>,
    // Erosion e at A, B, C and D.
    erosion: vec4<f32>,
    // Ψ of droplets; replaces Ψ of the cells if above 0.
    mist: f32,
    pad_a: f32,
    pad_b: f32,
    pad_c: f32,
}

// Part of the window that a pass works on.
struct Tile {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

// Workgroups of one submission, a range of a list whose words hold x in the lower half and y in the upper.
struct Groups {
    area: Tile,
    first: u32,
    count: u32,
    pad_a: u32,
    pad_b: u32,
}

// Returns the list entry of workgroup `group`: even entries first. Software Vulkan gives its threads fixed
// parts of a dispatch; the interleaving evens out the load where the picture's water is uneven.
fn listed(groups: Groups, group: u32) -> u32 {
    let half = (groups.count + 1u) / 2u;
    return groups.first + select(2u * group, 2u * (group - half) + 1u, group >= half);
}

fn cross2(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

fn dot3(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn dot2(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.x + a.y * b.y;
}

// Returns the unit direction from a point to a light and the fraction of its intensity that arrives there
// (Light::at).
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

// Fresnel reflectance of water for light at an angle to the normal (Schlick 1994).
fn fresnel(cos_angle: f32) -> f32 {
    let m = 1.0 - clamp(cos_angle, 0.0, 1.0);
    let m2 = m * m;
    return 0.02 + 0.98 * (m2 * m2 * m);
}

// Returns the unit direction through a pixel of the whole image (Camera::view_ray).
fn view_ray(frame: FrameUniforms, pixel_x: u32, pixel_y: u32) -> vec3<f32> {
    let x = 2.0 * (f32(pixel_x) + frame.jitter_x) / frame.image_width - 1.0;
    let y = 1.0 - 2.0 * (f32(pixel_y) + frame.jitter_y) / frame.image_height;
    let d = frame.forward + frame.right * x + frame.up * y;
    return d / sqrt(dot3(d, d));
}
