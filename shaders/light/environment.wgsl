// §5 Environment light: radiance of an equirectangular map, and irradiance from its spherical harmonics.
// Twins: src/light/environment/map.rs, which explains the map's orientation, and
// src/light/environment/irradiance.rs; the operations are the same, in the same order.

#import layout

const HALF_PI: f32 = 1.5707964;
const PI: f32 = 3.1415927;
const INVERSE_PI: f32 = 0.31830987;

struct Environment {
    // E(n)/π: coefficients of 1, x, y, z, xy, yz, 3y² − 1, xz, x² − z².
    irradiance: array<vec4<f32>, 9>,
    to_sun: vec3<f32>,
    // Square of the chord on the unit sphere from the sun's centre to its rim; 0 without a sun.
    rim2: f32,
    sun_radiance: vec3<f32>,
    // Factor on the map's radiance.
    intensity: f32,
    // Rotation about +y, in turns.
    turn: f32,
    pad_a: f32,
    pad_b: f32,
    pad_c: f32,
}

fn angle_of(y: f32, x: f32) -> f32 {
    let ax = abs(x);
    let ay = abs(y);
    let r = min(ax, ay) / max(max(ax, ay), 1e-30);
    let r2 = r * r;
    var sum = 0.0028662257;
    sum = sum * r2 - 0.016165737;
    sum = sum * r2 + 0.042909614;
    sum = sum * r2 - 0.07528964;
    sum = sum * r2 + 0.10656264;
    sum = sum * r2 - 0.142089;
    sum = sum * r2 + 0.19993551;
    sum = sum * r2 - 0.33333147;
    sum = sum * r2 + 1.0;
    var angle = sum * r;
    angle = select(angle, HALF_PI - angle, ay > ax);
    angle = select(angle, PI - angle, x < 0.0);
    return select(angle, -angle, y < 0.0);
}

fn environment_radiance(environment: Environment, map: texture_2d<f32>, d: vec3<f32>) -> vec3<f32> {
    let turned = 0.5 + angle_of(d.x, -d.z) * (0.5 * INVERSE_PI) + environment.turn;
    let u = turned - floor(turned);
    let v = 0.5 - angle_of(d.y, sqrt(d.x * d.x + d.z * d.z)) * INVERSE_PI;

    let size = textureDimensions(map);
    let s = u * f32(size.x) - 0.5;
    let t = clamp(v * f32(size.y) - 0.5, 0.0, f32(size.y) - 1.0);
    let left = floor(s);
    let top = floor(t);
    let f = s - left;
    let g = t - top;
    let x0 = select(min(u32(max(left, 0.0)), size.x - 1u), size.x - 1u, left < 0.0);
    let x1 = select(x0 + 1u, 0u, x0 + 1u == size.x);
    let y0 = u32(top);
    let y1 = min(y0 + 1u, size.y - 1u);
    let a = textureLoad(map, vec2<u32>(x0, y0), 0).rgb;
    let b = textureLoad(map, vec2<u32>(x1, y0), 0).rgb;
    let c = textureLoad(map, vec2<u32>(x0, y1), 0).rgb;
    let e = textureLoad(map, vec2<u32>(x1, y1), 0).rgb;
    let upper = a + (b - a) * f;
    let lower = c + (e - c) * f;
    let radiance = (upper + (lower - upper) * g) * environment.intensity;

    let away = d - environment.to_sun;
    let in_disc = (d.y > 0.0) & (dot3(away, away) < environment.rim2);
    return radiance + select(vec3<f32>(0.0), environment.sun_radiance, in_disc);
}

fn environment_irradiance(environment: Environment, n: vec3<f32>) -> vec3<f32> {
    var sum = environment.irradiance[0].rgb;
    sum += environment.irradiance[1].rgb * n.x;
    sum += environment.irradiance[2].rgb * n.y;
    sum += environment.irradiance[3].rgb * n.z;
    sum += environment.irradiance[4].rgb * (n.x * n.y);
    sum += environment.irradiance[5].rgb * (n.y * n.z);
    sum += environment.irradiance[6].rgb * (3.0 * n.y * n.y - 1.0);
    sum += environment.irradiance[7].rgb * (n.x * n.z);
    sum += environment.irradiance[8].rgb * (n.x * n.x - n.z * n.z);
    return max(sum, vec3<f32>(0.0));
}
