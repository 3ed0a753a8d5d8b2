// §3 Shading of opaque triangles that have a paint. Twin: src/engine/cpu/gloss.rs.

#import engine::gbuffer
#import engine::opaque
#import engine::paint
#import layout
#import light::environment

// Reflectance of a dielectric with n = 1.5, seen head-on.
const DIELECTRIC: f32 = 0.04;
// Least α. A lamp is a point, and normals of vertices have 16 bits.
const LEAST_ALPHA: f32 = 0.01;

// A point with its gloss.
struct Glossy {
    n: vec3<f32>,
    e: vec3<f32>,
    cos_eye: f32,
    // Albedo of the diffuse part.
    diffuse: vec3<f32>,
    // Reflectance seen head-on.
    f0: vec3<f32>,
    // Share of light that leaves or enters through the surface, along the view.
    passes: f32,
    alpha: f32,
}

// (1 − c)⁵ (Schlick 1994).
fn rim(c: f32) -> f32 {
    let m = 1.0 - clamp(c, 0.0, 1.0);
    let m2 = m * m;
    return m2 * m2 * m;
}

// Strength of the rim of a surface that reflects from all sides.
fn rim_strength(alpha: f32) -> f32 {
    return 1.0 - 0.9 * alpha;
}

fn passes_along(alpha: f32, c: f32) -> f32 {
    return (1.0 - DIELECTRIC) * (1.0 - rim_strength(alpha) * rim(c));
}

fn glossy(albedo: vec3<f32>, painted: Painted, n: vec3<f32>, e: vec3<f32>) -> Glossy {
    let alpha = max(painted.roughness * painted.roughness, LEAST_ALPHA);
    var g: Glossy;
    g.n = n;
    g.e = e;
    g.cos_eye = max(dot3(n, e), 1e-3);
    g.diffuse = albedo * (1.0 - painted.metallic);
    g.f0 = vec3<f32>(DIELECTRIC) + (albedo - vec3<f32>(DIELECTRIC)) * painted.metallic;
    g.passes = passes_along(alpha, g.cos_eye);
    g.alpha = alpha;
    return g;
}

// π times the reflectance for light from a unit direction at a cosine above 0.
fn reflects(g: Glossy, l: vec3<f32>, cos_light: f32) -> vec3<f32> {
    let sum = l + g.e;
    let h = sum / sqrt(max(dot3(sum, sum), 1e-12));
    let a2 = g.alpha * g.alpha;
    let cos_half = max(dot3(g.n, h), 0.0);
    let sine = cross3(g.n, h);
    let spread = cos_half * cos_half * a2 + dot3(sine, sine);
    let hidden = cos_light * sqrt(g.cos_eye * g.cos_eye * (1.0 - a2) + a2)
        + g.cos_eye * sqrt(cos_light * cos_light * (1.0 - a2) + a2);
    let lobe = a2 / (spread * spread) * (0.5 / hidden);
    let fresnel_rim = rim(dot3(l, h));
    let mirrored = g.f0 + (vec3<f32>(1.0) - g.f0) * fresnel_rim;
    let scattered = g.passes * passes_along(g.alpha, cos_light) / (1.0 - DIELECTRIC);
    return g.diffuse * scattered + mirrored * lobe;
}

struct GlossyLit {
    radiance: vec3<f32>,
    // Gloss of a film of water.
    film: vec3<f32>,
}

fn glossy_lit_by(sum: GlossyLit, in: OpaquePoint, g: Glossy, i: u32) -> GlossyLit {
    let light = lights[i];
    let arrives = light_from(light, in.position_world);
    let lit = select(1.0, 1.0 - in.shade.y, i == frame.shadow_light);
    let cos_light = max(dot3(g.n, arrives.xyz), 0.0);
    let strength = light.intensity * (arrives.w * lit * cos_light);
    var out = sum;
    if cos_light > 0.0 {
        out.radiance += strength * reflects(g, arrives.xyz, cos_light);
    }
    if in.shade.z > 0.0 {
        out.film += strength * film_lobe(g.n, arrives.xyz, g.e);
    }
    return out;
}

// Shades a point with gloss. `sky` is the radiance of the surroundings along the mirrored view.
fn shade_glossy(
    in: OpaquePoint,
    painted: Painted,
    ambient: vec3<f32>,
    sky: vec3<f32>,
) -> OpaqueTargets {
    let to_eye = frame.eye_world - in.position_world;
    let e = to_eye / max(sqrt(dot3(to_eye, to_eye)), 1e-6);
    let g = glossy(in.albedo, painted, painted.normal, e);
    let open = 1.0 - in.shade.x;
    let mirrors = g.f0 + (vec3<f32>(1.0) - g.f0) * (rim_strength(g.alpha) * rim(g.cos_eye));
    let mean = 1.0 - rim_strength(g.alpha) / 21.0;
    // The rougher a surface is, the more directions it mirrors.
    let mirrored_light = sky + (ambient - sky) * g.alpha;
    var sum = GlossyLit(
        (g.diffuse * ambient * (g.passes * mean) + mirrored_light * mirrors) * open,
        vec3<f32>(0.0),
    );
    if ONE_LIGHT {
        sum = glossy_lit_by(sum, in, g, 0u);
    } else {
        for (var i = 0u; i < frame.light_count; i++) {
            sum = glossy_lit_by(sum, in, g, i);
        }
    }
    var radiance = sum.radiance;
    if in.shade.z > 0.0 {
        radiance += (sum.film + sky * (open * fresnel(dot3(g.n, e)))) * in.shade.z;
    }
    return opaque_targets(radiance, g.n, to_eye, in.holdout);
}

// Applies the paint of the tile under a pixel to its point; a point without a paint stays as it is.
fn painted_point(in: OpaquePoint, tile: MeshTile, n: vec3<f32>) -> Painted {
    let drawn = textureLoad(rock_surface, in.pixel, 0);
    let triangle = u32(clamp(floor(drawn.x * 0.5), 0.0, f32(tile.side) - 1.0));
    let paint = paints[tile.paint - 1u];
    let first = tile.first + 3u * triangle;
    let a = positions[first].xyz;
    var s: Sight;
    s.corner = a - frame.eye_world;
    s.e1 = positions[first + 1u].xyz - a;
    s.e2 = positions[first + 2u].xyz - a;
    s.ray = ray_to(frame, image_point(frame, frame.window_x + in.pixel.x, frame.window_y + in.pixel.y));
    s.normal = n;
    s.coordinates = tile.coordinates + 3u * paint.slots * triangle;
    return painted_at(paint, s);
}

// Albedo under a texture. Vertices under a film of water hold a darker one, but a texture's is dry. Twin:
// wet_albedo of src/place/rock/wet.rs.
fn painted_albedo(in: OpaquePoint, painted: Painted, paint: Paint) -> vec3<f32> {
    let dry = in.albedo * painted.color;
    let wet = 0.98 * 0.526 * dry / (1.0 - 0.474 * min(dry, vec3<f32>(1.0)));
    return dry + (wet - dry) * select(0.0, in.shade.z, paint.color.levels > 0u);
}

fn tile_of(pixel: vec2<u32>) -> MeshTile {
    return tiles[u32(textureLoad(rock_surface, pixel, 0).z)];
}

@fragment
fn painted_fragment(@builtin(position) clip: vec4<f32>) -> OpaqueTargets {
    let seen = stony(opaque_point(vec2<u32>(clip.xy)));
    var in = seen.point;
    let n = seen.normal;
    let tile = tile_of(in.pixel);
    if tile.paint == 0u {
        return shade_opaque(in, n, frame.ambient, background_radiance(mirrored(in, n)));
    }
    let painted = painted_point(in, tile, n);
    in.albedo = painted_albedo(in, painted, paints[tile.paint - 1u]);
    let sky = background_radiance(mirrored(in, painted.normal));
    if paints[tile.paint - 1u].has_gloss == 0u {
        return shade_opaque(in, painted.normal, frame.ambient, sky);
    }
    return shade_glossy(in, painted, frame.ambient, sky);
}

// As `painted_fragment`, under an environment.
@fragment
fn painted_environment_fragment(@builtin(position) clip: vec4<f32>) -> OpaqueTargets {
    let seen = stony(opaque_point(vec2<u32>(clip.xy)));
    var in = seen.point;
    let n = seen.normal;
    let tile = tile_of(in.pixel);
    if tile.paint == 0u {
        let sky = environment_irradiance(environment, mirrored(in, n));
        return shade_opaque(in, n, frame.ambient + environment_irradiance(environment, n), sky);
    }
    let painted = painted_point(in, tile, n);
    in.albedo = painted_albedo(in, painted, paints[tile.paint - 1u]);
    let sky = environment_irradiance(environment, mirrored(in, painted.normal));
    let ambient = frame.ambient + environment_irradiance(environment, painted.normal);
    if paints[tile.paint - 1u].has_gloss == 0u {
        return shade_opaque(in, painted.normal, ambient, sky);
    }
    return shade_glossy(in, painted, ambient, sky);
}
