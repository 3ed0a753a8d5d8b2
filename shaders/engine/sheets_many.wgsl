// All that a pixel sees of the water: its sheets, front to back. Part of the stage integrate. One call of the walk in a
// loop, for every call is compiled anew.

#import engine::integrate
#import layout
#import mapping

// The nearest sheet is that of quad `nearest` − 1.
fn sheets(nearest: u32, pixel: vec2<u32>, behind: vec3<f32>, count: ptr<function, vec2<u32>>) -> vec4<f32> {
    var result = vec4<f32>(0.0, 0.0, 0.0, 1.0);
    var quad_number = nearest;
    var hit = textureLoad(surface, pixel, 0).xyz;
    let d_world = view_ray(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    for (var layer = 1u; quad_number != 0u; layer++) {
        var next = 0u;
        if layer < frame.layers {
            next = textureLoad(quad_id, pixel, layer, 0).x;
        }
        let quad = quads[quad_number - 1u];
        if layer > 1u {
            hit = quad_hit(quad, d_world);
        }
        result = trace(quad, quad_number - 1u, pixel, hit, behind, result, next == 0u, count);
        if result.w < frame.early_end || (*count).x == CUT {
            break;
        }
        quad_number = next;
    }
    return result;
}
