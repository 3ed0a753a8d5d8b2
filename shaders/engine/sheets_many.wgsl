// The sheets of water under a pixel, traced front to back. Part of the stage integrate. Twin:
// `Integrator::pixel` of src/engine/cpu/integrate.rs. A loop with one call of the walk, because every call is
// compiled again.

#import engine::integrate
#import layout
#import mapping

// Radiance and transmittance of all sheets; the nearest sheet belongs to quad `nearest` − 1.
fn sheets(nearest: u32, pixel: vec2<u32>, behind: vec3<f32>, count: ptr<function, vec2<u32>>) -> vec4<f32> {
    var result = vec4<f32>(0.0, 0.0, 0.0, 1.0);
    var quad_number = nearest;
    var hit = textureLoad(surface, pixel, 0).xyz;
    let at = image_point(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    let length = ray_length(frame, at);
    var ended = false;
    for (var layer = 1u; quad_number != 0u; layer++) {
        var next = 0u;
        if layer < frame.layers {
            next = textureLoad(quad_id, pixel, layer, 0).x;
        }
        let quad = quads[quad_number - 1u];
        if layer > 1u {
            hit = quad_hit(quad, at, length);
        }
        result = trace_face(quad, quad_number - 1u, pixel, hit, behind, result, next == 0u, count);
        ended = result.w < frame.early_end || (*count).x == CUT;
        if ended {
            break;
        }
        quad_number = next;
    }
    // The device ends this loop too.
    if quad_number != 0u && !ended {
        *count = vec2<u32>(CUT);
    }
    return result;
}
