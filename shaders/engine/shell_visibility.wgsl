// §5 V in shells, and what else is kept at the vertices of their meshes. Twin:
// src/engine/cpu/integrate/shell_light.rs.

#import engine::integrate
#import engine::integrate_shell
#import layout
#import light::shell_depth
#import mapping::shell
#import trace::levels

// Whether rays walk to the lights in some shells, and whether V is kept at the vertices of some.
override SHELL_MARCH: bool = false;
override SHELL_KEPT: bool = false;
// Whether opaque matter casts shadows on shells.
override SHELL_SHADOWS: bool = false;

// V of light number `i`, which lies in the direction `l`: in the shell, and past opaque matter. Twin:
// Integrator::arriving.
fn shell_visibility(
    ray: ptr<function, ShellRay>,
    cell: ShellCell,
    level: Level,
    shell: Shell,
    own: VolumeConstants,
    i: u32,
    l: vec3<f32>,
) -> vec2<f32> {
    let segment = cell.segment;
    var visible = 1.0;
    var open = 1.0;
    if SHELL_KEPT {
        let shares = cell.shares;
        let z = clamp(cell.depth, 0.0, 1.0) * f32(shell.layers);
        let vertices = segment.vertices;
        let first = shell.light + i * shell.vertices * (shell.layers + 1u);
        let a = vertex_visibility(ray, shell, first, vertices.x, z);
        let b = vertex_visibility(ray, shell, first, vertices.y, z);
        let c = vertex_visibility(ray, shell, first, vertices.z, z);
        visible = clamp(a * shares.x + b * shares.y + c * shares.z, 0.0, 1.0);
    }
    if SHELL_MARCH {
        if !SHELL_KEPT || shell.layers == 0u {
            let place =
                ShellPlace(segment.prism, segment.tetrahedron, cell.point, own.cells, own.flow_cells);
            let far = light_distance(lights[i], cell.point);
            let walked = shell_depth(level, shell, place, l, far, own.extinction, frame.max_cells);
            (*ray).light_cells += walked.cells;
            (*ray).cut |= walked.cut;
            visible = exp2(-own.extinction * walked.depth);
        }
    }
    if SHELL_SHADOWS {
        open = shell_shadow(shell, i, segment.vertices, cell.shares, cell.depth);
    }
    return vec2<f32>(visible, open);
}

// Share of light number `i` that opaque matter lets through. Twin: ShellShadows::at.
fn shell_shadow(shell: Shell, i: u32, vertices: vec3<u32>, shares: vec3<f32>, depth: f32) -> f32 {
    let first = vec3<u32>(shell.shadows) + 2u * (vertices + i * shell.vertices);
    let outer = vec3<f32>(shell_light_value(first.x), shell_light_value(first.y), shell_light_value(first.z));
    let next = first + 1u;
    let inner = vec3<f32>(shell_light_value(next.x), shell_light_value(next.y), shell_light_value(next.z));
    let seen = outer + (inner - outer) * depth;
    return clamp(seen.x * shares.x + seen.y * shares.y + seen.z * shares.z, 0.0, 1.0);
}

// V at the depth of `z` layers below a vertex. `first` is the first value of the shell and light.
fn vertex_visibility(ray: ptr<function, ShellRay>, shell: Shell, first: u32, vertex: u32, z: f32) -> f32 {
    // A shell that keeps nothing has no layers.
    let layer = min(u32(z), max(shell.layers, 1u) - 1u);
    let at = first + vertex * (shell.layers + 1u) + layer;
    let near = shell_light_value(at);
    let far = shell_light_value(at + 1u);
    (*ray).cut |= (near < 0.0) | (far < 0.0);
    return near + (far - near) * (z - f32(layer));
}

fn shell_light_value(index: u32) -> f32 {
    return textureLoad(shell_light, vec2<u32>(index & ((1u << SHELL_ROW) - 1u), index >> SHELL_ROW), 0).x;
}
