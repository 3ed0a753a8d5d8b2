// §3 to §5: the way of a ray through a shell, tetrahedron by tetrahedron. shaders/engine/integrate.wgsl holds
// the bindings. Twins: src/engine/cpu/integrate/shell.rs and shell_light.rs, which hold the reasoning.

#import engine::integrate
#import engine::shell_scatter
#import engine::shell_visibility
#import layout
#import light::fibre
#import light::optics
#import light::ramp
#import light::strand
#import mapping
#import mapping::shell
#import mapping::shell_path
#import trace::levels
#import trace::lookup
#import trace::matter
#import volume::cells
#import walk

// Whether the scene has shells.
override SHELLS: bool = false;
// Whether the scene has quads.
override QUADS: bool = true;

// A ray inside a shell.
struct ShellRay {
    d: vec3<f32>,
    transmittance: f32,
    light: vec3<f32>,
    cells: u32,
    light_cells: u32,
    // Whether the device ended a walk early.
    cut: bool,
    // T at the shell's start. Radiance of the last cell where light scatters many times, and extinction
    // there.
    start: f32,
    beyond: vec3<f32>,
    beyond_extinction: vec3<f32>,
}

// An occupied cell of a shell.
struct ShellCell {
    segment: Segment,
    // Shares of the prism's vertices, and the depth from the outer surface, 0 to 1.
    shares: vec3<f32>,
    depth: f32,
    sample: CellSample,
    // Second word of the cell.
    direction: u32,
    // Position in the world.
    point: vec3<f32>,
    // Shares and depth of the place that stands for the cell's diffuse light.
    deep: vec4<f32>,
}

// Traces a shell from the face number `face` of its hull, as `trace` does a sheet.
fn trace_shell(
    face: u32,
    pixel: vec2<u32>,
    behind: vec3<f32>,
    before: vec4<f32>,
    is_last: bool,
    count: ptr<function, vec2<u32>>,
) -> vec4<f32> {
    let shell = shell_of_face(face);
    let own = volume_of(shell.volume);
    let d = view_ray(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    let words = shell_texel(shell.hull + face - shell.first_face);
    var metres = 0.0;
    var origin = bitcast<vec3<f32>>(words.yzw);
    var begin = 0.0;
    var path: ShellPath;
    if (words.x & 3u) == EYE_FACE {
        path = path_inside(shell, words.x >> 4u, (words.x >> 2u) & 3u, origin, d);
    } else {
        let a = shell_point(shell, words.y);
        metres = face_metres(a, shell_point(shell, words.z), shell_point(shell, words.w), frame.eye_world, d);
        // The path may move its origin onto the face.
        origin = frame.eye_world + d * metres;
        begin = -NEVER;
        path = path_through(shell, words, origin, d);
    }
    let opaque = textureLoad(opaque_radiance, pixel, 0).w;
    let t_end = select(NEVER, opaque - metres, opaque > 0.0);

    var ray: ShellRay;
    ray.d = d;
    ray.transmittance = before.w;
    ray.start = before.w;
    var done = path.left == 0u;
    while !done {
        var segment = path_next(&path);
        done = (segment.t_in >= t_end) | (ray.transmittance < frame.early_end);
        if !done {
            segment = segment_until(segment_from(segment, begin), t_end);
            // A triangle without an area in the texture shows nothing of it, nor does a tetrahedron that
            // the ray only touches.
            if segment.is_mapped & (segment.t_out > segment.t_in) {
                through_tetrahedron(&ray, segment, shell, own, origin, metres);
            }
            done = path.left == 0u;
        }
    }
    *count += vec2<u32>(ray.cells, ray.light_cells);
    if ray.cut | !done {
        *count = vec2<u32>(CUT);
    }
    let end = ray.transmittance;
    let ends = is_last | (end < frame.early_end);
    let passed = select(vec3<f32>(0.0), behind * end, ends);
    var even = ambient_of(false) * (before.w - end);
    if SHELL_SCATTER {
        if own.optics.extinction.x > 0.0 {
            even = beyond_end(ray);
        }
    }
    return vec4<f32>(before.rgb + ray.light + even + passed, end);
}

// Walks through a tetrahedron. Twin: Integrator::through.
fn through_tetrahedron(
    ray: ptr<function, ShellRay>,
    segment: Segment,
    shell: Shell,
    own: VolumeConstants,
    origin: vec3<f32>,
    metres: f32,
) {
    let n = vec3<f32>(own.cells);
    let start = segment_origin(segment, own.cells, own.flow_cells);
    let direction = segment_direction(segment, own.cells);
    let begin = origin + (*ray).d * segment.t_in;
    if PYRAMID {
        var jacobian = shell_jacobian(segment);
        jacobian = ShellJacobian(jacobian.x / n.x, jacobian.y / n.y, jacobian.z / n.z);
        let c = dot3((*ray).d, frame.forward);
        let t = metres + segment.t_in;
        let covered = frame.footprint * (c * c * c) * (t * t);
        let cell = abs(dot3(cross3(jacobian.x, jacobian.y), jacobian.z)) * sqrt(dot3(direction, direction));
        let exact = clamp(0.5 * log2(max(covered / cell, 1e-30)), 0.0, f32(own.levels - 1u));
        let share = fract(exact);
        let before = (*ray).transmittance;
        var end = 0.0;
        var walks = select(1u, 2u, share > 0.0);
        for (var i = 0u; i < walks; i++) {
            let weight = select(share, 1.0 - share, i == 0u);
            let level = level_new(own.cells, own.base, u32(exact) + i);
            (*ray).transmittance = before;
            walk_tetrahedron(ray, segment, start, direction, level, weight, shell, own, begin);
            end += (*ray).transmittance * weight;
        }
        (*ray).transmittance = end;
    } else {
        let level = level_new(own.cells, own.base, 0u);
        walk_tetrahedron(ray, segment, start, direction, level, 1.0, shell, own, begin);
    }
}

// Walks through the cells of one level in a tetrahedron. Their light counts by `share`; `begin` is the point
// where the segment begins. Twin: Integrator::in_level.
fn walk_tetrahedron(
    ray: ptr<function, ShellRay>,
    segment: Segment,
    start: vec3<f32>,
    direction: vec3<f32>,
    level: Level,
    share: f32,
    shell: Shell,
    own: VolumeConstants,
    begin: vec3<f32>,
) {
    let whole = SheetDensity(1.0, 0.0, 0.0, 0.0, 1.0);
    let length = segment.t_out - segment.t_in;
    let origin = start * level.scale;
    let d_cell = direction * level.scale;
    var walk = walk_new(level.size, origin, d_cell);
    var t = 0.0;
    var done = false;
    while !done {
        var sample: CellSample;
        var texel = vec2<u32>(0u);
        var enter = 0.0;
        var leave = 0.0;
        // Rays of one SIMD group that have found an occupied cell wait for the others.
        var seeking = true;
        while seeking {
            let z = walk.cell.z;
            done = (t >= length) | ((*ray).cells >= frame.max_cells) | (z < 0) | (z >= level.size.z)
                | ((*ray).transmittance < frame.early_end);
            if !done {
                let t_exit = walk_exit(walk);
                enter = t;
                leave = select(length, t_exit, t_exit < length);
                texel = cell_words(in_texture(walk.cell, level));
                if TRILINEAR {
                    let along = origin + d_cell * ((enter + leave) * 0.5);
                    sample = sample_trilinear(level, whole, walk.cell, along, shell.is_single);
                } else {
                    sample.rho = f32(texel.x & 0xffffu);
                }
                (*ray).cells += 1u;
                t = t_exit;
                walk_step(&walk, true);
            }
            seeking = !done & (sample.rho <= 0.0);
        }
        if !done {
            if !TRILINEAR {
                sample.k_d = f32((texel.x >> 16u) & 0xffu);
                sample.k_s = f32(texel.x >> 24u);
                if PYRAMID {
                    sample.moments = moments_of(texel.y, level);
                }
            }
            let bits = sample.rho * own.extinction * (leave - enter);
            let passed = (*ray).transmittance * exp2(-bits);
            let weight = ((*ray).transmittance - passed) * share;
            var middle = 0.5 * (enter + leave);
            var deep = vec4<f32>(0.0);
            if SHELL_SCATTER {
                if own.optics.extinction.x > 0.0 {
                    let within = enter + (leave - enter) * cell_within(bits);
                    middle = within.x;
                    let share_out = within.y / length;
                    deep = vec4<f32>(
                        segment.shares_in + (segment.shares_out - segment.shares_in) * share_out,
                        segment.at_in.z + (segment.at_out.z - segment.at_in.z) * share_out,
                    );
                }
            }
            let point = begin + (*ray).d * middle;
            let along = middle / length;
            let shares = segment.shares_in + (segment.shares_out - segment.shares_in) * along;
            let depth = segment.at_in.z + (segment.at_out.z - segment.at_in.z) * along;
            let cell = ShellCell(segment, shares, depth, sample, texel.y, point, deep);
            if SHELL_SCATTER {
                let view = depth_between((*ray).start, (*ray).transmittance);
                let passage = Passage((*ray).start * share, view, bits);
                (*ray).light += shell_lit(ray, cell, level, shell, own, weight, passage);
            } else if (LIGHTS > 0u) | COLORED {
                (*ray).light += shell_lit(ray, cell, level, shell, own, weight, Passage(0.0, 0.0, 0.0));
            }
            (*ray).transmittance = passed;
        }
        // The device ends these loops together.
        (*ray).cut |= seeking;
    }
    (*ray).cut |= !done;
}

// Light that a cell of this weight sends to the eye, of all lights.
fn shell_lit(
    ray: ptr<function, ShellRay>,
    cell: ShellCell,
    level: Level,
    shell: Shell,
    own: VolumeConstants,
    weight: f32,
    passage: Passage,
) -> vec3<f32> {
    let n = vec3<f32>(own.cells);
    let frame_j = shell_frame(shell, cell.segment.prism, cell.shares, cell.depth);
    let j = ShellJacobian(frame_j.x / n.x, frame_j.y / n.y, frame_j.z / n.z);
    let is_texture = frame.texture_frame != 0u;
    // Rows of J⁻¹ times the determinant.
    let row_x = cross3(j.y, j.z);
    let row_y = cross3(j.z, j.x);
    let row_z = cross3(j.x, j.y);
    let det = dot3(j.x, row_x);
    let e = in_frame(row_x, row_y, row_z, det, -(*ray).d, is_texture);
    var t = v_code(cell.direction);
    var spread: Spread;
    if MANY_DIRECTIONS {
        let moments = cell.sample.moments;
        var mapped = moments;
        if !is_texture {
            mapped = moments_mapped(moments, j);
        }
        spread = spread_new(vec4<f32>(1.0, 0.0, 1.0, 1.0), mapped, e);
    }
    if !MANY_DIRECTIONS | TILTED {
        if !is_texture {
            t = j.x * t.x + j.y * t.y + j.z * t.z;
        }
    }
    let inverse_q = 1.0 / max(dot3(t, t), 1e-30);
    let t_dot_e = dot3(t, e);
    let sin2_e = max(1.0 - t_dot_e * t_dot_e * inverse_q, 0.0);
    let k_d = cell.sample.k_d;
    var k_s = cell.sample.k_s;
    var sum = vec3<f32>(0.0);
    var color = vec3<f32>(1.0);
    if COLORED {
        let ink = ramp_ink(own.ramp, k_s);
        k_s = ink.w;
        color = ink.rgb;
        sum = frame.ambient * (color - 1.0);
    }
    var scatter: Scatter;
    if SHELL_SCATTER {
        if own.optics.extinction.x > 0.0 {
            scatter = scatter_new(ray, cell, level, shell, own, j, color, passage);
            sum = scatter.diffuse;
        }
    }
    let count = select(0u, arrayLength(&lights), LIGHTS > 0u);
    var i = 0u;
    for (; i < count; i++) {
        let light = lights[i];
        let arrives = light_from(light, cell.point);
        let l = in_frame(row_x, row_y, row_z, det, arrives.xyz, is_texture);
        let l_dot_e = dot3(l, e);
        var fibre = vec3<f32>(0.0);
        if SHELL_FIBRES {
            if STRAND {
                let root = sqrt(inverse_q);
                var t_dot = vec2<f32>(dot3(t, l), t_dot_e) * root;
                if MANY_DIRECTIONS {
                    if TILTED {
                        var way = ROOT_TO_TIP;
                        if !is_texture {
                            way = row_x * way.x + row_y * way.y + row_z * way.z;
                            way = select(way, -way, det < 0.0);
                        }
                        t_dot = select(spread_along(spread, l, way), t_dot, has_one_direction(level));
                    } else {
                        t_dot = spread_of_one(spread, l);
                    }
                }
                fibre = strand_psi(strand_table, linear, reflection.strand, k_d, k_s, t_dot.x, t_dot.y, l_dot_e);
            } else {
                var parts = vec2<f32>(0.0);
                if MANY_DIRECTIONS {
                    parts = spread_psi_parts(spread, k_d, k_s, frame.p, l, l_dot_e);
                } else {
                    parts = psi_parts(frame.p, k_d, k_s, t, l, t_dot_e, sin2_e, inverse_q);
                }
                fibre = vec3<f32>((parts.x + parts.y) * (1.0 / 255.0));
                if COLORED {
                    fibre = (color * parts.x + vec3<f32>(parts.y)) * (1.0 / 255.0);
                }
            }
        }
        let arriving = shell_visibility(ray, cell, level, shell, own, i, arrives.xyz);
        if SHELL_SCATTER {
            if scatter.is_on {
                let lit = scatter_light(scatter, (*ray).d, arrives.xyz, fibre, weight, arriving);
                sum += light.intensity * arrives.w * lit;
            } else {
                sum += light.intensity * arrives.w * fibre * (arriving.x * arriving.y);
            }
        } else {
            sum += light.intensity * arrives.w * fibre * (arriving.x * arriving.y);
        }
    }
    (*ray).cut |= i < count;
    if SHELL_SCATTER {
        return select(sum * weight, sum, scatter.is_on);
    }
    return sum * weight;
}

// A unit vector in the frame where angles are measured.
fn in_frame(
    row_x: vec3<f32>,
    row_y: vec3<f32>,
    row_z: vec3<f32>,
    det: f32,
    v: vec3<f32>,
    is_texture: bool,
) -> vec3<f32> {
    let turned = vec3<f32>(dot3(row_x, v), dot3(row_y, v), dot3(row_z, v)) / det;
    let length = sqrt(dot3(turned, turned));
    return select(v, select(vec3<f32>(0.0), turned / length, length > 0.0), is_texture);
}

// Moments J·S·Jᵀ of the directions J·v. Twin: Moments::mapped.
fn moments_mapped(moments: Moments, j: ShellJacobian) -> Moments {
    let row_x = vec3<f32>(j.x.x, j.y.x, j.z.x);
    let row_y = vec3<f32>(j.x.y, j.y.y, j.z.y);
    let row_z = vec3<f32>(j.x.z, j.y.z, j.z.z);
    let x = moments_times(moments, row_x);
    let y = moments_times(moments, row_y);
    let z = moments_times(moments, row_z);
    return Moments(
        vec3<f32>(dot3(row_x, x), dot3(row_y, y), dot3(row_z, z)),
        vec3<f32>(dot3(row_x, y), dot3(row_x, z), dot3(row_y, z)),
    );
}
