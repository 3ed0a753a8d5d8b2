// §3 Raster pass: z-buffer, opaque radiance, texture coordinates and quad id.
//
// Pipelines share one z-buffer (reversed: 1 at the near plane, 0 at infinity). `opaque` shades the
// rock; `volume` finds the point of its quad under the pixel's own ray and maps it by the exact
// inverse bilinear map (src/mapping.rs, QuadMap::uv), so nothing depends on how a quad is cut into
// triangles; `peel` finds the sheets behind the nearest, in a pass each. CPU twin: src/cpu/gbuffer.rs.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> quads: array<Quad>;
// Of the sheets before: the last one's depth, and the numbers of all.
@group(0) @binding(3) var known_depth: texture_depth_2d;
@group(0) @binding(4) var known_ids: texture_2d_array<u32>;
@group(0) @binding(5) var<uniform> environment: Environment;
@group(0) @binding(6) var environment_map: texture_2d<f32>;

struct OpaqueVertex {
    @location(0) position_world: vec3<f32>,
    @location(1) normal_world: vec3<f32>,
    @location(2) albedo: vec3<f32>,
}

struct OpaqueVarying {
    @builtin(position) clip: vec4<f32>,
    @location(0) position_world: vec3<f32>,
    @location(1) normal_world: vec3<f32>,
    @location(2) albedo: vec3<f32>,
}

struct OpaqueTargets {
    // Radiance, and metres from the eye.
    @location(0) radiance: vec4<f32>,
    @location(1) normal: vec4<f32>,
}

@vertex
fn opaque_vertex(in: OpaqueVertex) -> OpaqueVarying {
    var out: OpaqueVarying;
    out.clip = frame.clip_from_world * vec4<f32>(in.position_world, 1.0);
    out.position_world = in.position_world;
    out.normal_world = in.normal_world;
    out.albedo = in.albedo;
    return out;
}

fn seen_normal(in: OpaqueVarying) -> vec3<f32> {
    let to_eye = frame.eye_world - in.position_world;
    let n = in.normal_world / sqrt(max(dot3(in.normal_world, in.normal_world), 1e-30));
    return select(n, -n, dot3(n, to_eye) < 0.0);
}

// Lambert, two-sided.
fn shade_opaque(in: OpaqueVarying, n: vec3<f32>, ambient: vec3<f32>) -> OpaqueTargets {
    let to_eye = frame.eye_world - in.position_world;
    let distance = sqrt(dot3(to_eye, to_eye));
    var irradiance = ambient;
    for (var i = 0u; i < frame.light_count; i++) {
        let light = lights[i];
        let arrives = light_from(light, in.position_world);
        irradiance += light.intensity * (arrives.w * max(dot3(n, arrives.xyz), 0.0));
    }
    var out: OpaqueTargets;
    let d_y = -to_eye.y / max(distance, 1e-20);
    out.radiance = vec4<f32>(haze_over(frame, in.albedo * irradiance, d_y, distance), distance);
    out.normal = vec4<f32>(n, 1.0);
    return out;
}

@fragment
fn opaque_fragment(in: OpaqueVarying) -> OpaqueTargets {
    return shade_opaque(in, seen_normal(in), frame.ambient);
}

// Under an environment.
@fragment
fn opaque_environment_fragment(in: OpaqueVarying) -> OpaqueTargets {
    let n = seen_normal(in);
    return shade_opaque(in, n, frame.ambient + environment_irradiance(environment, n));
}

struct VolumeVarying {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) quad: u32,
}

struct VolumeTargets {
    // u, v, metres from the eye.
    @location(0) surface: vec4<f32>,
    // Number of the quad plus 1; 0 where there is none.
    @location(1) quad_id: u32,
}

@vertex
fn volume_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) quad: u32) -> VolumeVarying {
    var corner_of_vertex = array<u32, 6>(0u, 1u, 2u, 0u, 2u, 3u);
    let corner = quads[quad].corners[corner_of_vertex[vertex]].xyz;
    var out: VolumeVarying;
    out.clip = frame.clip_from_world * vec4<f32>(corner, 1.0);
    out.quad = quad;
    return out;
}

@fragment
fn volume_fragment(in: VolumeVarying) -> VolumeTargets {
    let d = view_ray(frame, frame.window_x + u32(in.clip.x), frame.window_y + u32(in.clip.y));
    var out: VolumeTargets;
    out.surface = vec4<f32>(quad_hit(quads[in.quad], d), 0.0);
    out.quad_id = in.quad + 1u;
    return out;
}

// The next sheet of each pixel (depth peeling, Everitt 2001): of the quads that come after the last one that
// is known, the nearest. Equal depths come in the order of the quads, and no quad comes twice.
@fragment
fn peel_fragment(in: VolumeVarying) -> @location(0) u32 {
    let pixel = vec2<u32>(in.clip.xy);
    let id = in.quad + 1u;
    let known = textureNumLayers(known_ids);
    let depth = textureLoad(known_depth, pixel, 0);
    let last = textureLoad(known_ids, pixel, known - 1u, 0).x;
    var out = in.clip.z > depth || (in.clip.z == depth && id < last);
    for (var layer = 0u; layer < known; layer++) {
        out |= textureLoad(known_ids, pixel, layer, 0).x == id;
    }
    if out {
        discard;
    }
    return id;
}

// One triangle over the whole image, at infinity.
@vertex
fn background_vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(vertex & 1u) * 4.0 - 1.0, f32(vertex >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// Background::radiance; distance and normal 0 mark that nothing is there.
@fragment
fn background_fragment(@builtin(position) clip: vec4<f32>) -> OpaqueTargets {
    let d = view_ray(frame, frame.window_x + u32(clip.x), frame.window_y + u32(clip.y));
    var out: OpaqueTargets;
    let radiance = frame.horizon + (frame.zenith - frame.horizon) * max(d.y, 0.0);
    out.radiance = vec4<f32>(haze_over(frame, radiance, d.y, frame.haze_far), 0.0);
    out.normal = vec4<f32>(0.0);
    return out;
}

// Environment::radiance.
@fragment
fn background_environment_fragment(@builtin(position) clip: vec4<f32>) -> OpaqueTargets {
    let d = view_ray(frame, frame.window_x + u32(clip.x), frame.window_y + u32(clip.y));
    var out: OpaqueTargets;
    let radiance = environment_radiance(environment, environment_map, d);
    out.radiance = vec4<f32>(haze_over(frame, radiance, d.y, frame.haze_far), 0.0);
    out.normal = vec4<f32>(0.0);
    return out;
}
