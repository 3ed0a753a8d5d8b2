// §5 Optical depth between a place in a shell and a light. Shared by the stages shell_light and integrate.
// Twin: shell_depth of src/engine/cpu/integrate/shell.rs.

#import mapping::shell
#import mapping::shell_path
#import trace::levels
#import volume::cells
#import walk

// Depth of opaque matter: no light passes it.
const OPAQUE_DEPTH: f32 = 1e30;
// Depth in bits behind which rays to the light go no further. Twin: ENOUGH_BITS of shell_light.rs.
const ENOUGH_BITS: f32 = 24.0;

// Walk from a place to where the light ray leaves the shell.
struct ShellWalk {
    // Σ ρ code × metres.
    depth: f32,
    cells: u32,
    // Whether the device ended the walk early.
    cut: bool,
}

// A place in a shell, and what the walks from it have in common.
struct ShellPlace {
    prism: u32,
    tetrahedron: u32,
    // The place in the world, metres.
    point: vec3<f32>,
    // nx, ny, nz of the volume, and how far it has moved down the flow, cells.
    size: vec3<i32>,
    flow_cells: f32,
}

// Walks along the unit vector `l`, for `far` metres at most, until no light is left. `extinction` is in bits
// per unit of the depth.
fn shell_depth(
    level: Level,
    shell: Shell,
    place: ShellPlace,
    l: vec3<f32>,
    far: f32,
    extinction: f32,
    max_cells: u32,
) -> ShellWalk {
    var out: ShellWalk;
    var path = path_inside(shell, place.prism, place.tetrahedron, place.point, l);
    var done = path.left == 0u;
    while !done {
        let segment = path_next(&path);
        done = (segment.t_in >= far) | (out.cells >= max_cells) | (out.depth * extinction >= ENOUGH_BITS);
        if !done {
            let start = max(-segment.t_in, 0.0);
            var end = min(segment.t_out, far) - segment.t_in - start;
            end = select(0.0, end, segment.is_mapped);
            let direction = segment_direction(segment, place.size);
            let origin = segment_origin(segment, place.size, place.flow_cells) + direction * start;
            let in_level = in_tile(origin, place.size) * level.scale;
            var walk = walk_new(level.size, in_level, direction * level.scale);
            var t = 0.0;
            var z = walk.cell.z;
            while (t < end) & (out.cells < max_cells) & (z >= 0) & (z < level.size.z) {
                let code = cell_words(in_texture(walk.cell, level)).x & 0xffffu;
                let t_exit = walk_exit(walk);
                out.depth += f32(code) * (select(end, t_exit, t_exit < end) - t);
                out.cells += 1u;
                t = t_exit;
                walk_step(&walk, true);
                z = walk.cell.z;
            }
            if (segment.end == END_INNER) & shell.skin & (segment.t_out < far) {
                out.depth = OPAQUE_DEPTH;
            }
            done = path.left == 0u;
        }
    }
    out.cut = !done;
    return out;
}
