// §4 Strands finer than cells: what a ray between eight centres of cells meets of their lines. Part of the
// stage integrate. Twins: src/trace/lines.rs, which explains it, and Cell::line in src/volume/cell.rs.

#import layout
#import light::fibre
#import trace::levels
#import volume::cells

// Whether rays walk the strands where their pixel sees less than a cell.
override LINES: bool = false;

// Number of the level that stands for the strands' lines.
const STRANDS: i32 = -1;
// Radius of a strand, cells.
const STRAND_RADIUS: f32 = 0.5;
// Density on a line, in units of its cell's: 3/(πR²).
const ON_LINE: f32 = 3.8197186;
// Smallest squared sine between a ray and a line.
const LEAST_SINE2: f32 = 1e-4;

// Part of a ray between eight centres of cells.
struct LineSegment {
    // Its middle, in cells from the lowest of the eight centres.
    middle: vec3<f32>,
    direction: vec3<f32>,
    // Half its length in units of t.
    half: f32,
}

// Position of one of the eight cells above which `upper` is the highest, wrapped into the level.
fn line_cell(upper: vec3<i32>, away: vec3<i32>, level: Level) -> vec3<i32> {
    let at = upper - 1 + away;
    return vec3<i32>(select(at.xy, level.size.xy - 1, at.xy < vec2<i32>(0)), at.z);
}

// Integral over t of a strand's density along the segment, in units of the density of its cell, whose words
// are `texel`. `corner` is the cell's centre among the eight. Twin: Segment::through.
fn line_through(segment: LineSegment, texel: vec2<u32>, corner: vec3<f32>) -> f32 {
    let v = v_code(texel.y);
    let size = abs(v);
    let is_x = (size.x >= size.y) & (size.x >= size.z);
    let is_y = !is_x & (size.y >= size.z);
    let largest = select(select(size.z, size.y, is_y), size.x, is_x);
    let line = u32(511.0 - largest) | ((texel.y >> 30u) << 6u);
    let first = (f32(line & 15u) + 0.5) * (1.0 / 16.0) - 0.5;
    let second = (f32(line >> 4u) + 0.5) * (1.0 / 16.0) - 0.5;
    let not_x = select(vec3<f32>(first, second, 0.0), vec3<f32>(first, 0.0, second), is_y);
    let place = select(not_x, vec3<f32>(0.0, first, second), is_x);

    let d = segment.direction;
    let w = segment.middle - corner - place;
    let inverse = 1.0 / max(dot3(v, v), 1e-20);
    let d_v = dot3(d, v);
    let w_v = dot3(w, v);
    let dd = dot3(d, d);
    let a = max(dd - d_v * d_v * inverse, dd * LEAST_SINE2);
    let b = dot3(w, d) - w_v * d_v * inverse;
    let c = dot3(w, w) - w_v * w_v * inverse;
    let nearest = -b / a;
    let scale = 1.0 / (STRAND_RADIUS * STRAND_RADIUS);
    let u = 1.0 - (c + b * nearest) * scale;
    let k = a * scale;
    let reach = sqrt(max(u, 0.0) / k);
    let enter = max(nearest - reach, -segment.half);
    let exit = min(nearest + reach, segment.half);
    let w_main = select(select(w.z, w.y, is_y), w.x, is_x);
    let d_main = select(select(d.z, d.y, is_y), d.x, is_x);
    let corner_main = select(select(corner.z, corner.y, is_y), corner.x, is_x);
    let low = enter - nearest;
    let high = exit - nearest;
    let sum = line_upto(high, u, k) - line_upto(low, u, k);
    let square_low = u - k * low * low;
    let square_high = u - k * high * high;
    let cube_low = square_low * square_low * square_low;
    let moment = (cube_low - square_high * square_high * square_high) / (6.0 * k);
    // Towards the next centre along the strand, its share falls from 1 to 0.
    let side = 1.0 - 2.0 * corner_main;
    let share = 1.0 - side * (w_main + d_main * nearest);
    let through = max(share * sum - side * d_main * moment, 0.0) * ON_LINE * largest * sqrt(inverse);
    return select(0.0, through, (u > 0.0) & (exit > enter));
}

// Integral of (u − k·s²)² from 0.
fn line_upto(s: f32, u: f32, k: f32) -> f32 {
    return s * (u * u + s * s * k * (0.2 * k * s * s - 2.0 / 3.0 * u));
}
