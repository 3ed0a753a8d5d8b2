// §5 V at the vertices of a shell's mesh, from the outer to the inner surface. Twins: visibility_below of
// src/engine/cpu/integrate/shell_light.rs, and Shell::below_vertex.

#import layout
#import light::shell_depth
#import mapping::shell
#import trace::levels
#import volume::cells
#import walk

// A part of the values of one shell and light.
struct ShellLightPart {
    // nx, ny, nz of the volume.
    cells: vec3<i32>,
    // As in the frame's uniforms.
    extinction: f32,
    // Position of the volume's first cell in the texture.
    base: vec3<i32>,
    flow_cells: f32,
    shell: u32,
    light: u32,
    // Values [first, first + count) of the shell and light.
    first: u32,
    count: u32,
    max_cells: u32,
    pad_a: u32,
    pad_b: u32,
    pad_c: u32,
}

@group(0) @binding(0) var<uniform> part: ShellLightPart;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var volume: texture_storage_3d<rg32uint, read>;
// Bricks of sparse storage, see shaders/volume/cells.wgsl.
@group(0) @binding(3) var bricks: texture_storage_3d<rgba32uint, read>;
@group(0) @binding(4) var shells: texture_2d<u32>;
// V in the rows of SHELL_ROW. A walk that the device ended leaves −1.
@group(0) @binding(5) var shell_light: texture_storage_2d<r32float, write>;

@compute @workgroup_size(64)
fn fill(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= part.count {
        return;
    }
    let index = part.first + id.x;
    let shell = shell_new(part.shell);
    let vertex = index / (shell.layers + 1u);
    let layer = index % (shell.layers + 1u);
    let depth = clamp(f32(layer) / f32(shell.layers), 0.01, 0.99);
    // A prism at the vertex, and the vertex's position there.
    let corner = shell_texel(shell.points + 2u * vertex).w;
    let vertices = prism_vertices(shell, corner >> 2u);
    let position = corner & 3u;
    let a = below(shell, vertices.x, depth);
    let b = below(shell, vertices.y, depth);
    let c = below(shell, vertices.z, depth);
    let middle = (a + b + c) / 3.0;
    let at = select(select(c, b, position == 1u), a, position == 0u);
    let point = at + (middle - at) * 0.003;

    let light = lights[part.light];
    let to_light = light_from(light, point).xyz;
    let far = light_distance(light, point);
    let place = ShellPlace(corner >> 2u, 2u - position, point, part.cells, part.flow_cells);
    let level = level_new(part.cells, part.base, 0u);
    let walked = shell_depth(level, shell, place, to_light, far, part.extinction, part.max_cells);
    let value = select(exp2(-part.extinction * walked.depth), -1.0, walked.cut);
    let texel = shell.light + part.light * shell.vertices * (shell.layers + 1u) + index;
    let row = 1u << SHELL_ROW;
    textureStore(shell_light, vec2<u32>(texel % row, texel / row), vec4<f32>(value));
}

// Point at a depth (0 to 1) below a vertex.
fn below(shell: Shell, vertex: u32, depth: f32) -> vec3<f32> {
    let outer = shell_point(shell, 2u * vertex);
    return outer + (shell_point(shell, 2u * vertex + 1u) - outer) * depth;
}
