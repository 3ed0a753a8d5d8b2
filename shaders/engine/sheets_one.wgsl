// The sheet or shell under a pixel, in scenes with at most one. Part of the stage integrate. The loop of
// shaders/engine/sheets_many.wgsl would make the walk half as slow again.

#import engine::integrate

fn sheets(nearest: u32, pixel: vec2<u32>, behind: vec3<f32>, count: ptr<function, vec2<u32>>) -> vec4<f32> {
    let hit = textureLoad(surface, pixel, 0).xyz;
    let before = vec4<f32>(0.0, 0.0, 0.0, 1.0);
    return trace_face(quads[nearest - 1u], nearest - 1u, pixel, hit, behind, before, true, count);
}
