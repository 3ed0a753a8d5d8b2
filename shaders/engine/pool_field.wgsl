// §3 Shading of a pool with a field of waves and foam in the raster pass. Twin: src/engine/cpu/pool/field.rs,
// which holds the reasoning. src/place/pool computes the field.

#import engine::gbuffer
#import engine::opaque
#import engine::pool
#import layout
#import light::environment

// Slopes along x and z in each cell, and their change while the shutter is open.
@group(0) @binding(17) var pool_slopes: texture_2d<f32>;
// Density of the foam, velocity along x and z in metres per second, and noise, in cells twice as wide.
@group(0) @binding(18) var pool_carried: texture_2d<f32>;

// Weighted sum of a cell and its neighbours along x.
fn slopes_of_row(at: vec2<i32>, weights: vec3<f32>) -> vec4<f32> {
    let most = vec2<i32>(textureDimensions(pool_slopes)) - vec2<i32>(1);
    let z = clamp(at.y, 0, most.y);
    let low = vec2<i32>(clamp(at.x - 1, 0, most.x), z);
    let own = vec2<i32>(clamp(at.x, 0, most.x), z);
    let high = vec2<i32>(clamp(at.x + 1, 0, most.x), z);
    return textureLoad(pool_slopes, low, 0) * weights.x + textureLoad(pool_slopes, own, 0) * weights.y
        + textureLoad(pool_slopes, high, 0) * weights.z;
}

// Slopes of the field at a point at the time of the sample, by quadratic B-splines.
fn field_slopes(p: vec2<f32>, time: f32) -> vec2<f32> {
    let s = (p - pool.field_origin) * pool.field_scale;
    let middle = floor(s);
    let f = s - middle - vec2<f32>(0.5);
    let low = vec2<f32>(0.5) - f;
    let high = vec2<f32>(0.5) + f;
    let first = low * low * 0.5;
    let second = vec2<f32>(0.75) - f * f;
    let third = high * high * 0.5;
    let weights = vec3<f32>(first.x, second.x, third.x);
    let at = vec2<i32>(middle);
    let sum = slopes_of_row(at - vec2<i32>(0, 1), weights) * first.y
        + slopes_of_row(at, weights) * second.y
        + slopes_of_row(at + vec2<i32>(0, 1), weights) * third.y;
    return sum.xy + sum.zw * time;
}

// Foam, velocity and noise at a point, interpolated linearly.
fn carried_at(p: vec2<f32>) -> vec4<f32> {
    let s = (p - pool.field_origin) * (0.5 * pool.field_scale) - vec2<f32>(0.5);
    let low = floor(s);
    let f = s - low;
    let most = vec2<i32>(textureDimensions(pool_carried)) - vec2<i32>(1);
    let a = clamp(vec2<i32>(low), vec2<i32>(0), most);
    let b = clamp(vec2<i32>(low) + vec2<i32>(1), vec2<i32>(0), most);
    let near = textureLoad(pool_carried, a, 0) * (1.0 - f.x)
        + textureLoad(pool_carried, vec2<i32>(b.x, a.y), 0) * f.x;
    let far = textureLoad(pool_carried, vec2<i32>(a.x, b.y), 0) * (1.0 - f.x)
        + textureLoad(pool_carried, b, 0) * f.x;
    return near * (1.0 - f.y) + far * f.y;
}

// Noise of one lattice at a point.
fn turned_noise(p: vec2<f32>, lattice: Foam) -> f32 {
    let axis = lattice.axis;
    return value_noise(vec2<f32>(p.x * axis.x - p.y * axis.y, p.x * axis.y + p.y * axis.x), lattice);
}

// Cover of foam of a density at a point of its pattern, and the pattern's noise there.
fn lace(p: vec2<f32>, density: f32) -> vec2<f32> {
    let wide = turned_noise(p, pool.foam[0]);
    let next = turned_noise(p, pool.foam[1]);
    let q = p + (vec2<f32>(wide, next) - vec2<f32>(0.5)) * (0.2 / pool.foam_scale);
    let noise = 0.45 * wide + 0.27 * next + 0.17 * turned_noise(q, pool.foam[2])
        + 0.11 * turned_noise(q, pool.foam[3]);
    let patches = clamp((2.2 * density + wide - 1.05) * 1.5, 0.0, 1.0);
    let line = clamp((0.03 + 0.25 * density * density - abs(noise - 0.5)) * 9.0 + 0.5, 0.0, 1.0);
    let thick = 0.45 + 0.55 * min(1.6 * density, 1.0);
    return vec2<f32>(patches * line * thick, noise);
}

// Unit normal of the field's waves and of the fine ones, whose crests `carried.w` bends.
fn field_normal(in: OpaquePoint, carried: vec4<f32>) -> vec3<f32> {
    let to_eye = frame.eye_world - in.position_world;
    let e = to_eye_unit(in);
    let pixel = 2.0 * sqrt(dot3(frame.up, frame.up)) / frame.image_height;
    let footprint = sqrt(dot3(to_eye, to_eye)) * pixel / max(e.y, 0.05);
    let churn = 1.0 + 1.5 * min(max(carried.x, in.albedo.y), 1.0);
    let time = shutter_time(frame, frame.window_x + in.pixel.x, frame.window_y + in.pixel.y);
    let bend = carried.w * pool.bend;
    let fine = fine_waves(WavePlace(in.position_world.xz, churn, footprint, time), bend);
    let wide = pool.field_blur * footprint;
    let blur = 1.0 + wide * wide;
    let slopes = field_slopes(in.position_world.xz, time) / (blur * blur) + fine.xy;
    let n = vec3<f32>(-slopes.x, max(1.0 - fine.z, 0.3), -slopes.y);
    return n / sqrt(dot3(n, n));
}

// A fine wave, which is moved by `bend` metres along its direction.
fn fine_wave(wave: Wave, at: WavePlace, bend: f32) -> vec3<f32> {
    let along = dot2(wave.toward, at.p) + bend;
    return rise(wave, wave.toward, along, wave.slope * at.churn, at);
}

// Shades a point with the radiance of its clear water and the light on its foam.
fn shade_field(in: OpaquePoint, n: vec3<f32>, carried: vec4<f32>, water: PoolLight) -> OpaqueTargets {
    let density = min(max(carried.x, in.albedo.y), 1.0);
    let to_eye = frame.eye_world - in.position_world;
    let p = in.position_world.xz + vec2<f32>(n.x, n.z) * (0.1 / pool.foam_scale);
    let a = lace(p - carried.yz * pool.carry.x, density);
    let b = lace(p - carried.yz * pool.carry.y, density);
    let cover = a.x * pool.carry.z + b.x * pool.carry.w;
    let noise = a.y * pool.carry.z + b.y * pool.carry.w;
    let foam = water.irradiance * ((0.25 + 0.5 * noise) * cover);
    return opaque_targets(water.clear * (1.0 - cover) + foam, n, to_eye, pool.holdout != 0.0);
}

@fragment
fn pool_field_fragment(in: PoolVarying) -> OpaqueTargets {
    let at = on_pool(pool_point(in));
    let carried = carried_at(at.position_world.xz);
    let n = field_normal(at, carried);
    let sky = background_radiance(pool_mirrored(at, n));
    return shade_field(at, n, carried, pool_light(at, n, frame.ambient, sky));
}

@fragment
fn pool_field_environment_fragment(in: PoolVarying) -> OpaqueTargets {
    let at = on_pool(pool_point(in));
    let carried = carried_at(at.position_world.xz);
    let n = field_normal(at, carried);
    let ambient = frame.ambient + environment_irradiance(environment, vec3<f32>(0.0, 1.0, 0.0));
    let sky = environment_irradiance(environment, pool_mirrored(at, n));
    return shade_field(at, n, carried, pool_light(at, n, ambient, sky));
}
