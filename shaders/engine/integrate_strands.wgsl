// §4 The walk of a ray whose pixel sees less than a cell: through the strands that made the cells. Part of
// the stage integrate. Twin: walk_strands of src/engine/cpu/integrate/walk.rs.

#import engine::integrate
#import layout
#import light::optical_depth
#import trace::levels
#import trace::lines
#import trace::lookup
#import trace::matter
#import volume::cells
#import walk

// Walks the strands of the volume to the end of the slab or of the ray, between the centres of its cells.
fn walk_strands(view: View, ray: ptr<function, Ray>) {
    let origin = view.origin + 0.5;
    var walk = walk_new(view.level.size + vec3<i32>(0, 0, 1), origin, view.d_cell);
    let back = f32(view.level.size.z) / view.d_cell.z;
    let c = abs(view.d_cell);
    let depth_of_t = view.extinction * select(1.0, c.x + c.y + c.z, PER_CELL);
    while !(*ray).done {
        let t_exit = min(walk_exit(walk), back);
        let middle = origin + view.d_cell * (((*ray).t + t_exit) * 0.5);
        let segment = LineSegment(middle - floor(middle), view.d_cell, (t_exit - (*ray).t) * 0.5);
        var tau_bits = 0.0;
        for (var corner = 0; corner < 8; corner++) {
            tau_bits += strand_at(corner, segment, walk.cell, depth_of_t, view).tau_bits;
        }
        if tau_bits > 0.0 {
            // The strands lie side by side: each has its share of what all of them hide.
            let passed = (*ray).transmittance * exp2(-tau_bits);
            let each = ((*ray).transmittance - passed) / tau_bits;
            for (var corner = 0; corner < 8; corner++) {
                let met = strand_at(corner, segment, walk.cell, depth_of_t, view);
                if met.tau_bits > 0.0 {
                    var sample: CellSample;
                    sample.k_d = f32((met.texel.x >> 16u) & 0xffu);
                    sample.k_s = f32(met.texel.x >> 24u);
                    if PYRAMID {
                        sample.moments = moments_of(met.texel.y, view.level);
                    }
                    let hides = vec2<f32>(met.tau_bits, met.tau_bits * each);
                    light_cell(met.cell, met.texel.y, sample, hides, true, view, ray);
                }
            }
            (*ray).transmittance = passed;
            if MULTIPLE {
                (*ray).depth += tau_bits;
            }
        }
        (*ray).cells += 1u;
        (*ray).t = t_exit;
        walk_step(&walk, true);
        (*ray).done = (t_exit >= back) | ((*ray).transmittance < view.early_end)
            | ((*ray).cells >= view.max_cells);
    }
}

// A strand of a cell as a ray meets it.
struct MetStrand {
    cell: vec3<i32>,
    texel: vec2<u32>,
    tau_bits: f32,
}

// Finds the strand of one of the eight cells between whose centres a ray is. `upper` is the highest of the
// cells; `depth_of_t` is the optical depth of ρ = 1 in one unit of t, bits.
fn strand_at(corner: i32, segment: LineSegment, upper: vec3<i32>, depth_of_t: f32, view: View) -> MetStrand {
    let away = vec3<i32>(corner & 1, (corner >> 1u) & 1, corner >> 2u);
    var met: MetStrand;
    met.cell = line_cell(upper, away, view.level);
    if (met.cell.z >= 0) & (met.cell.z < view.level.size.z) {
        met.texel = cell_words(in_texture(met.cell, view.level));
        let code = met.texel.x & 0xffffu;
        if code != 0u {
            let rho = matter_rho(f32(code), view.matter);
            met.tau_bits = rho * depth_of_t * line_through(segment, met.texel, vec3<f32>(away));
        }
    }
    return met;
}
