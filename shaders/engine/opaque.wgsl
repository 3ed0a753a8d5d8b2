// §3 Shading of a point of rock in the raster pass. Twin: src/engine/cpu/opaque.rs.

#import engine::gbuffer
#import engine::stone
#import layout
#import light::environment
#import light::haze

// Unit normal of a point on the side that the eye sees. Twin: Points::view, which explains it.
fn seen_normal(in: OpaquePoint) -> vec3<f32> {
    let to_eye = frame.eye_world - in.position_world;
    let n = in.normal_world / sqrt(max(dot3(in.normal_world, in.normal_world), 1e-30));
    let by_plane = dot3(in.plane, to_eye);
    let side = select(by_plane, dot3(n, to_eye), by_plane == 0.0);
    let seen = select(n, -n, side < 0.0);
    let e = to_eye / max(sqrt(dot3(to_eye, to_eye)), 1e-6);
    let across = seen - e * dot3(seen, e);
    let leans = dot3(seen, to_eye) < 0.0;
    return select(seen, across / sqrt(max(dot3(across, across), 1e-30)), leans);
}

struct Lit {
    irradiance: vec3<f32>,
    gloss: vec3<f32>,
}

// Adds light `i` to the light that reaches a point.
fn lit_by(sum: Lit, in: OpaquePoint, n: vec3<f32>, e: vec3<f32>, i: u32) -> Lit {
    let light = lights[i];
    let arrives = light_from(light, in.position_world);
    let lit = select(1.0, 1.0 - in.shade.y, i == frame.shadow_light);
    let cos_light = max(dot3(n, arrives.xyz), 0.0);
    var out = sum;
    out.irradiance += light.intensity * (arrives.w * lit * cos_light);
    if in.shade.z > 0.0 {
        out.gloss += light.intensity * (arrives.w * lit * cos_light * film_on(in, n, arrives.xyz, e));
    }
    return out;
}

// Shades rock: two-sided Lambert, with the gloss of a film of water. `sky` is the radiance of the
// surroundings along the mirrored view.
fn shade_opaque(in: OpaquePoint, n: vec3<f32>, ambient: vec3<f32>, sky: vec3<f32>) -> OpaqueTargets {
    let to_eye = frame.eye_world - in.position_world;
    let distance = sqrt(dot3(to_eye, to_eye));
    let e = to_eye / max(distance, 1e-6);
    let open = 1.0 - in.shade.x;
    var sum = Lit(ambient * open, vec3<f32>(0.0));
    if ONE_LIGHT {
        sum = lit_by(sum, in, n, e, 0u);
    } else {
        for (var i = 0u; i < frame.light_count; i++) {
            sum = lit_by(sum, in, n, e, i);
        }
    }
    var radiance = in.albedo * sum.irradiance;
    if in.shade.z > 0.0 {
        radiance += (sum.gloss + sky * (open * fresnel(dot3(n, e)))) * in.shade.z;
    }
    return opaque_targets(radiance, n, to_eye, in.holdout);
}

// Targets of a point with this radiance, behind haze. Twin: Shading::rock.
fn opaque_targets(radiance: vec3<f32>, n: vec3<f32>, to_eye: vec3<f32>, holdout: bool) -> OpaqueTargets {
    let distance = sqrt(dot3(to_eye, to_eye));
    let d_y = -to_eye.y / max(distance, 1e-20);
    let hole = holdout & (frame.alpha != 0u);
    let seen = select(radiance, vec3<f32>(0.0), hole);
    var out: OpaqueTargets;
    out.radiance = vec4<f32>(haze_over(frame, seen, d_y, distance), distance);
    out.normal = vec4<f32>(n, select(0.0, haze_passes(frame, d_y, distance), hole));
    return out;
}

// Applies the stone under a point, if it has one. Returns the point and its normal on the eye's side.
fn stony(in: OpaquePoint) -> StonePoint {
    let n = seen_normal(in);
    if STONES {
        if in.stone > 0u {
            return stone_at(in, n);
        }
    }
    return StonePoint(in, n);
}

// π times the reflectance of the film of water at a point.
fn film_on(in: OpaquePoint, n: vec3<f32>, l: vec3<f32>, e: vec3<f32>) -> f32 {
    if STONES {
        if in.film > 0.0 {
            return stone_lobe(n, l, e, in.film);
        }
    }
    return film_lobe(n, l, e);
}

// π times the reflectance of a film of water on rough rock: Blinn 1977 with the exponent s = 32, normalised
// by (s + 8)/8π.
fn film_lobe(n: vec3<f32>, l: vec3<f32>, e: vec3<f32>) -> f32 {
    let sum = l + e;
    let h = sum / sqrt(max(dot3(sum, sum), 1e-12));
    let c = max(dot3(n, h), 0.0);
    let c2 = c * c;
    let c4 = c2 * c2;
    let c8 = c4 * c4;
    let c16 = c8 * c8;
    return 5.0 * fresnel(dot3(l, h)) * (c16 * c16);
}

// Direction to the eye, mirrored at the normal.
fn mirrored(in: OpaquePoint, n: vec3<f32>) -> vec3<f32> {
    let to_eye = frame.eye_world - in.position_world;
    let e = to_eye / sqrt(max(dot3(to_eye, to_eye), 1e-12));
    return n * (2.0 * dot3(n, e)) - e;
}

// Radiance of the background along a unit direction. Twin: background_at in src/engine/cpu/lights.rs.
fn background_radiance(d: vec3<f32>) -> vec3<f32> {
    return frame.horizon + (frame.zenith - frame.horizon) * max(d.y, 0.0);
}

@fragment
fn opaque_fragment(@builtin(position) clip: vec4<f32>) -> OpaqueTargets {
    let seen = stony(opaque_point(vec2<u32>(clip.xy)));
    let in = seen.point;
    let n = seen.normal;
    return shade_opaque(in, n, frame.ambient, background_radiance(mirrored(in, n)));
}

// As `opaque_fragment`, under an environment. A film on rough rock reflects the light from all around the
// mirrored view.
@fragment
fn opaque_environment_fragment(@builtin(position) clip: vec4<f32>) -> OpaqueTargets {
    let seen = stony(opaque_point(vec2<u32>(clip.xy)));
    let in = seen.point;
    let n = seen.normal;
    let sky = environment_irradiance(environment, mirrored(in, n));
    return shade_opaque(in, n, frame.ambient + environment_irradiance(environment, n), sky);
}
