// What every stage shares with the host: put in front of each stage's source.
// src/gpu/layout.rs holds the twins; a test compares names, offsets and sizes.

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
    // Haze at the eye, 1/m, and how it thins upwards, 1/m. src/haze.rs.
    haze_density: f32,
    haze_falloff: f32,
    // The part of the image in the targets: its first pixel and its size.
    window_x: u32,
    window_y: u32,
    window_width: u32,
    window_height: u32,
    // How far the volume has moved down the flow, in cells: 0 to ny.
    flow_cells: f32,
    // Layers of the quad ids: most sheets one ray goes through.
    layers: u32,
    haze_color: vec3<f32>,
    // Metres of haze before the background.
    haze_far: f32,
    // The light that rock keeps from rock.
    shadow_light: u32,
    // Levels of the volume.
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
    // Unit, against a spot light's beam.
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
    // Where the profile of its material begins, of multiple scattering.
    profile: u32,
    e: vec2<f32>,
    f: vec2<f32>,
    g: vec2<f32>,
    // Where in the texture corner A is, copies of the volume.
    offset: vec2<f32>,
    // e at A, B, C and D.
    erosion: vec4<f32>,
    // Ψ of droplets in place of the cells', if above 0.
    mist: f32,
    pad_a: f32,
    pad_b: f32,
    pad_c: f32,
}

// The part of the window that is looked at.
struct Tile {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

// The workgroups that one submission works on: of a list, in which x is in the lower half of a word and y in the upper.
struct Groups {
    area: Tile,
    first: u32,
    count: u32,
    pad_a: u32,
    pad_b: u32,
}

// Which of the list workgroup `group` takes: even ones first. Software Vulkan deals workgroups out to its threads in fixed
// parts of a dispatch, and water is not everywhere alike.
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

// Unit direction from a point to a light, and how much of its intensity arrives there. Light::at.
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

// Fresnel's reflection of water for light at an angle to the normal (Schlick 1994).
fn fresnel(cos_angle: f32) -> f32 {
    let m = 1.0 - clamp(cos_angle, 0.0, 1.0);
    let m2 = m * m;
    return 0.02 + 0.98 * (m2 * m2 * m);
}

// Camera::view_ray: unit direction through a pixel of the whole image.
fn view_ray(frame: FrameUniforms, pixel_x: u32, pixel_y: u32) -> vec3<f32> {
    let x = 2.0 * (f32(pixel_x) + frame.jitter_x) / frame.image_width - 1.0;
    let y = 1.0 - 2.0 * (f32(pixel_y) + frame.jitter_y) / frame.image_height;
    let d = frame.forward + frame.right * x + frame.up * y;
    return d / sqrt(dot3(d, d));
}
