// All that a pixel sees of the water, where that is one sheet. Part of the stage integrate: the loop of
// shaders/integrate_many.wgsl would cost what is in it half as much again.

#import engine::integrate

fn sheets(nearest: u32, pixel: vec2<u32>, behind: vec3<f32>, count: ptr<function, vec2<u32>>) -> vec4<f32> {
    let hit = textureLoad(surface, pixel, 0).xyz;
    return trace(quads[nearest - 1u], nearest - 1u, pixel, hit, behind, vec4<f32>(0.0, 0.0, 0.0, 1.0), true, count);
}
