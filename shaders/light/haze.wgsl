// Haze between the eye and the scene. Twin: EyeHaze in src/light/haze.rs.

#import layout

// Transmittance e^(−τ) over t metres along a unit direction with the y component d_y.
fn haze_transmittance(density: f32, falloff: f32, d_y: f32, t: f32) -> f32 {
    let x = max(d_y * t * falloff, -60.0);
    var mean = 1.0 - x * (0.5 - x * (1.0 / 6.0));
    if abs(x) >= 1e-2 {
        mean = (1.0 - exp(-x)) / x;
    }
    return exp(-(density * t * mean));
}

// Transmittance of the frame's haze.
fn haze_passes(frame: FrameUniforms, d_y: f32, t: f32) -> f32 {
    if frame.haze_density == 0.0 {
        return 1.0;
    }
    return haze_transmittance(frame.haze_density, frame.haze_falloff, d_y, t);
}

fn haze_over(frame: FrameUniforms, radiance: vec3<f32>, d_y: f32, t: f32) -> vec3<f32> {
    if frame.haze_density == 0.0 {
        return radiance;
    }
    let transmittance = haze_passes(frame, d_y, t);
    return radiance * transmittance + frame.haze_color * (1.0 - transmittance);
}

// Twin: EyeHaze::over_water. `seen` holds the radiance of the water with its backdrop, and in w the share of
// the backdrop that the water lets through.
fn haze_over_water(frame: FrameUniforms, seen: vec4<f32>, behind: vec3<f32>, d_y: f32, t: f32) -> vec4<f32> {
    let transmittance = haze_transmittance(frame.haze_density, frame.haze_falloff, d_y, t);
    let passed = behind * seen.w;
    let water = (seen.rgb - passed) * transmittance;
    return vec4<f32>(water + passed + frame.haze_color * ((1.0 - seen.w) * (1.0 - transmittance)), seen.w);
}
