// §3 The raster pass: z-buffer, opaque radiance, texture coordinates and quad ids. Twin:
// src/engine/cpu/gbuffer.rs.
//
// The pipelines share one z-buffer (reversed: 1 at the near plane, 0 at the far plane or at infinity).
// `rock_surface` writes the tile of the mesh that a sample shows and the position in it. `opaque` shades the
// visible rock once per sample. `volume` intersects the pixel's own ray with the quad and maps the point by
// the exact inverse bilinear map (src/mapping/mod.rs, QuadMap::uv), so the result does not depend on how a
// quad is cut into triangles. `hull` does so for the faces of shells that the eye sees. `peel` finds the
// sheets behind the nearest, one layer per pass.

#import engine::opaque
#import engine::pool
#import layout
#import light::environment
#import light::haze
#import mapping

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> quads: array<Quad>;
// Depth of the layer before, and the quads' numbers of all layers before.
@group(0) @binding(3) var known_depth: texture_depth_2d;
@group(0) @binding(4) var known_ids: texture_2d_array<u32>;
@group(0) @binding(5) var<uniform> environment: Environment;
@group(0) @binding(6) var environment_map: texture_2d<f32>;
@group(0) @binding(8) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read> tiles: array<MeshTile>;
@group(0) @binding(11) var<storage, read> coats: array<VertexMaterial>;
// The visible rock: position in its tile in squares of the grid, number of the tile, and depth.
@group(0) @binding(10) var rock_surface: texture_2d<f32>;
@group(0) @binding(12) var<storage, read> hull_faces: array<HullFace>;

// Material of a vertex. The normal (signed), film of water, occlusion and shadow are packed in pairs into
// words.
struct VertexMaterial {
    albedo_r: f32,
    albedo_g: f32,
    albedo_b: f32,
    normal_xy: u32,
    normal_z_wet: u32,
    occlusion_shadow: u32,
}

// A tile of the opaque mesh: Tile of src/place/tiles.rs.
struct MeshTile {
    // Index of its first vertex.
    first: u32,
    // Vertices in a row of its grid; 0 for triangles that are no grid, three vertices each.
    pitch: u32,
    // Squares on a side, or the number of those triangles.
    side: u32,
    // 1: a hole in a picture with alpha.
    holdout: u32,
    // Number of its paint plus 1; 0: it is shaded as rock is.
    paint: u32,
    // Number of the first texture coordinates of its triangles.
    coordinates: u32,
    // Number of its stone plus 1; 0: plain rock.
    stone: u32,
}

// Vertices in a row of the largest tile.
const TILE_ROW: u32 = 17u;

// Whether the scene has exactly one light. It is then read at a constant index, which software Vulkan does
// once for eight samples; in a loop it reads lane by lane.
override ONE_LIGHT: bool = false;

struct RockSurfaceVarying {
    @builtin(position) clip: vec4<f32>,
    // Position in the tile, in squares of its grid.
    @location(0) in_tile: vec2<f32>,
    @location(1) @interpolate(flat) tile: u32,
    // Number of the triangle, of those that are no grid: apart, because interpolation would round it.
    @location(2) @interpolate(flat) triangle: u32,
}

struct OpaquePoint {
    pixel: vec2<u32>,
    position_world: vec3<f32>,
    normal_world: vec3<f32>,
    // Normal of the plane of a triangle that is no part of a grid, of any length, on the side of its
    // vertices' normals; 0 in a grid.
    plane: vec3<f32>,
    albedo: vec3<f32>,
    // Occlusion, shadow and film of water, 0 to 1 each.
    shade: vec3<f32>,
    // Whether a picture with alpha has a hole here.
    holdout: bool,
    // Number of the stone plus 1; 0: plain rock.
    stone: u32,
    // Squared roughness of the film of water on a stone; 0: that of plain rock.
    film: f32,
}

struct OpaqueTargets {
    // Radiance, and metres from the eye.
    @location(0) radiance: vec4<f32>,
    // Unit normal, and the share of a backdrop behind the opaque scene that shows.
    @location(1) normal: vec4<f32>,
}

@vertex
fn rock_surface_vertex(
    @builtin(vertex_index) corner: u32,
    @builtin(instance_index) number: u32,
) -> RockSurfaceVarying {
    let tile = tiles[number];
    let row = corner / TILE_ROW;
    let column = corner - row * TILE_ROW;
    var vertex = tile.first + row * tile.pitch + column;
    var in_tile = vec2<f32>(f32(column), f32(row));
    var triangle = 0u;
    if tile.pitch == 0u {
        triangle = corner / 3u;
        let k = corner - 3u * triangle;
        vertex = tile.first + corner;
        in_tile = select(vec2<f32>(0.25), vec2<f32>(0.75), vec2<u32>(k) == vec2<u32>(1u, 2u));
    }
    var out: RockSurfaceVarying;
    out.clip = frame.clip_from_world * vec4<f32>(positions[vertex].xyz, 1.0);
    out.in_tile = in_tile;
    out.tile = number;
    out.triangle = triangle;
    return out;
}

@fragment
fn rock_surface_fragment(in: RockSurfaceVarying) -> @location(0) vec4<f32> {
    let in_tile = in.in_tile + vec2<f32>(f32(2u * in.triangle), 0.0);
    return vec4<f32>(in_tile, f32(in.tile), in.clip.z);
}

// Adds a vertex's share to a point.
fn add_coat(in: OpaquePoint, number: u32, weight: f32) -> OpaquePoint {
    let coat = coats[number];
    let normal_z = unpack2x16snorm(coat.normal_z_wet).x;
    let wet = unpack2x16unorm(coat.normal_z_wet).y;
    var out = in;
    out.normal_world += vec3<f32>(unpack2x16snorm(coat.normal_xy), normal_z) * weight;
    out.albedo += vec3<f32>(coat.albedo_r, coat.albedo_g, coat.albedo_b) * weight;
    out.shade += vec3<f32>(unpack2x16unorm(coat.occlusion_shadow), wet) * weight;
    return out;
}

// The visible point of rock under a pixel, on the pixel's own ray at the drawn depth. Twin: Points::at.
fn opaque_point(pixel: vec2<u32>) -> OpaquePoint {
    let drawn = textureLoad(rock_surface, pixel, 0);
    let tile = tiles[u32(drawn.z)];
    let at = image_point(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    var out: OpaquePoint;
    out.pixel = pixel;
    out.position_world = point_at(frame, at, drawn.w);
    out.holdout = tile.holdout != 0u;
    out.stone = tile.stone;
    if tile.pitch == 0u {
        let triangle = clamp(floor(drawn.x * 0.5), 0.0, f32(tile.side) - 1.0);
        let origin = vec2<f32>(2.0 * triangle + 0.25, 0.25);
        let b = clamp((drawn.xy - origin) * 2.0, vec2<f32>(0.0), vec2<f32>(1.0));
        let corner = tile.first + 3u * u32(triangle);
        let a = positions[corner].xyz;
        out.plane = cross3(positions[corner + 1u].xyz - a, positions[corner + 2u].xyz - a);
        out = add_coat(out, corner, 1.0 - b.x - b.y);
        out = add_coat(out, corner + 1u, b.x);
        return add_coat(out, corner + 2u, b.y);
    }
    let cell = clamp(floor(drawn.xy), vec2<f32>(0.0), vec2<f32>(f32(tile.side) - 1.0));
    let f = clamp(drawn.xy - cell, vec2<f32>(0.0), vec2<f32>(1.0));
    let first = tile.first + u32(cell.y) * tile.pitch + u32(cell.x);
    let low = min(f.x, f.y);
    let high = max(f.x, f.y);
    out = add_coat(out, first, 1.0 - high);
    out = add_coat(out, first + select(tile.pitch, 1u, f.x >= f.y), high - low);
    return add_coat(out, first + tile.pitch + 1u, low);
}

struct VolumeVarying {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) quad: u32,
}

struct VolumeTargets {
    // u, v, metres from the eye.
    @location(0) surface: vec4<f32>,
    // Number of the quad plus 1; 0: none.
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
    let at = image_point(frame, frame.window_x + u32(in.clip.x), frame.window_y + u32(in.clip.y));
    var out: VolumeTargets;
    out.surface = vec4<f32>(quad_hit(quads[in.quad], at, ray_length(frame, at)), 0.0);
    out.quad_id = in.quad + 1u;
    return out;
}

// Finds the next sheet of each pixel (depth peeling, Everitt 2001): the nearest quad behind the layers
// before. Quads of equal depth come in the order of their numbers, and no quad comes twice.
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

// A face of a hull that the eye sees: its corners, metres, and their texture coordinates. In the last parts:
// its number among the faces, u of the first corner, and v; u and v of the second and of the third corner.
struct HullFace {
    a: vec3<f32>,
    number: u32,
    b: vec3<f32>,
    u_a: f32,
    c: vec3<f32>,
    v_a: f32,
    uv_b: vec2<f32>,
    uv_c: vec2<f32>,
}

struct HullVarying {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) quad: u32,
    // Its position in the list.
    @location(1) @interpolate(flat) index: u32,
}

@vertex
fn hull_vertex(@builtin(vertex_index) vertex: u32) -> HullVarying {
    let index = vertex / 3u;
    let corner = vertex % 3u;
    let face = hull_faces[index];
    let point = select(select(face.c, face.b, corner == 1u), face.a, corner == 0u);
    var out: HullVarying;
    out.clip = frame.clip_from_world * vec4<f32>(point, 1.0);
    out.quad = face.number;
    out.index = index;
    return out;
}

@fragment
fn hull_fragment(in: HullVarying) -> VolumeTargets {
    let d = view_ray(frame, frame.window_x + u32(in.clip.x), frame.window_y + u32(in.clip.y));
    let face = hull_faces[in.index];
    let metres = face_metres(face.a, face.b, face.c, frame.eye_world, d);
    let shares = face_point_shares(face.a, face.b, face.c, frame.eye_world, d, metres);
    let uv = vec2<f32>(face.u_a, face.v_a) * shares.x + face.uv_b * shares.y + face.uv_c * shares.z;
    var out: VolumeTargets;
    out.surface = vec4<f32>(uv, metres, 0.0);
    out.quad_id = in.quad + 1u;
    return out;
}

// One triangle over the whole image, at infinity.
@vertex
fn behind_vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(vertex & 1u) * 4.0 - 1.0, f32(vertex >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// Targets where no opaque geometry is, marked by distance and normal 0. `d_y` is the view direction's y
// component. Twin: Shading::background.
fn background_targets(radiance: vec3<f32>, d_y: f32) -> OpaqueTargets {
    let seen = select(radiance, vec3<f32>(0.0), frame.alpha != 0u);
    var out: OpaqueTargets;
    out.radiance = vec4<f32>(haze_over(frame, seen, d_y, frame.haze_far), 0.0);
    out.normal = vec4<f32>(0.0, 0.0, 0.0, haze_passes(frame, d_y, frame.haze_far));
    return out;
}

// Radiance of the background.
@fragment
fn background_fragment(@builtin(position) clip: vec4<f32>) -> OpaqueTargets {
    let d = view_ray(frame, frame.window_x + u32(clip.x), frame.window_y + u32(clip.y));
    return background_targets(background_radiance(d), d.y);
}

// As `background_fragment`, under an environment. Twin: Environment::radiance.
@fragment
fn background_environment_fragment(@builtin(position) clip: vec4<f32>) -> OpaqueTargets {
    let d = view_ray(frame, frame.window_x + u32(clip.x), frame.window_y + u32(clip.y));
    return background_targets(environment_radiance(environment, environment_map, d), d.y);
}
