// §3 Raster pass: z-buffer, opaque radiance, texture coordinates and quad id.
//
// Pipelines share one z-buffer (reversed: 1 at the near plane, 0 at infinity). `opaque` shades the
// rock; `volume` finds the point of its quad under the pixel's own ray and maps it by the exact
// inverse bilinear map (src/mapping.rs, QuadMap::uv), so nothing depends on how a quad is cut into
// triangles. CPU twin: src/cpu/gbuffer.rs.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> quads: array<Quad>;

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

// shade_opaque: Lambert, two-sided.
@fragment
fn opaque_fragment(in: OpaqueVarying) -> OpaqueTargets {
    let to_eye = frame.eye_world - in.position_world;
    let distance = sqrt(dot3(to_eye, to_eye));
    var n = in.normal_world / sqrt(max(dot3(in.normal_world, in.normal_world), 1e-30));
    if dot3(n, to_eye) < 0.0 {
        n = -n;
    }
    var irradiance = frame.ambient;
    for (var i = 0u; i < frame.light_count; i++) {
        let light = lights[i];
        let arrives = light_from(light, in.position_world);
        irradiance += light.intensity * (arrives.w * max(dot3(n, arrives.xyz), 0.0));
    }
    var out: OpaqueTargets;
    out.radiance = vec4<f32>(in.albedo * irradiance, distance);
    out.normal = vec4<f32>(n, 1.0);
    return out;
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
    let quad = quads[in.quad];
    let d = view_ray(frame, frame.window_x + u32(in.clip.x), frame.window_y + u32(in.clip.y));
    let d_n = dot3(d, quad.n);
    let t = clamp(-quad.eye_plane.z / select(d_n, 1e-20, abs(d_n) < 1e-20), 0.0, 1e9);
    let hh = quad.eye_plane.xy + vec2<f32>(dot3(d, quad.e1), dot3(d, quad.e2)) * t;

    let k2 = cross2(quad.g, quad.f);
    let k1 = cross2(quad.e, quad.f) + cross2(hh, quad.g);
    let k0 = cross2(hh, quad.e);
    let s = sqrt(max(k1 * k1 - 4.0 * k0 * k2, 0.0));
    let v = select((s - k1) / (2.0 * k2), -2.0 * k0 / (k1 + s), k1 >= 0.0);
    let along = quad.e + quad.g * v;
    let u = dot2(hh - quad.f * v, along) / dot2(along, along);

    var out: VolumeTargets;
    out.surface = vec4<f32>(clamp(u, 0.0, 1.0), clamp(v, 0.0, 1.0), t, 0.0);
    out.quad_id = in.quad + 1u;
    return out;
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
    out.radiance = vec4<f32>(frame.horizon + (frame.zenith - frame.horizon) * max(d.y, 0.0), 0.0);
    out.normal = vec4<f32>(0.0);
    return out;
}
