// §4 The exact 3-D DDA walk through a tiled grid of unit cells. Twin: src/walk.rs, which explains the edge
// cases.

// Parameter of a boundary that is never met.
const NEVER: f32 = 1.0e30;
// Smallest direction component that does not count as zero, in cells per unit of t.
const PARALLEL: f32 = 1.0e-20;
// Share of a box's exit parameter before which a leap ends, 1 − 2^−20.
const LEAP_MARGIN: f32 = 0.99999905;

// Whether empty cells hold boxes to leap over (src/volume/leaps.rs).
override LEAPS: bool = false;

struct Walk {
    // The cell that the ray is in; x and y wrapped into the tile.
    cell: vec3<i32>,
    step: vec3<i32>,
    step_f32: vec3<f32>,
    // A step onto `past`, one cell outside the tile, wraps around to `entry`. z does not wrap.
    past: vec2<i32>,
    entry: vec2<i32>,
    origin: vec3<f32>,
    inverse: vec3<f32>,
    boundary: vec3<f32>,
    t_next: vec3<f32>,
    // For leaps only: boundaries along each axis in one unit of t, and the reciprocal.
    speed: vec3<f32>,
    inverse_abs: vec3<f32>,
    // Parameter where the ray leaves the slab.
    t_slab: f32,
    // Shifts of the exponents of the ray's octant in the words of an empty cell (y, y and x).
    octant: vec3<u32>,
    tile: vec2<i32>,
}

fn walk_new(size: vec3<i32>, origin: vec3<f32>, direction: vec3<f32>) -> Walk {
    var walk: Walk;
    let start = select(floor(origin), ceil(origin) - 1.0, direction < vec3<f32>(0.0));
    let moves = abs(direction) >= vec3<f32>(PARALLEL);
    let forward = direction > vec3<f32>(0.0);
    walk.step = select(vec3<i32>(0), select(vec3<i32>(-1), vec3<i32>(1), forward), moves);
    walk.step_f32 = vec3<f32>(walk.step);
    walk.past = select(vec2<i32>(-1), size.xy, forward.xy);
    walk.entry = select(size.xy - 1, vec2<i32>(0), forward.xy);
    // A parallel axis stays at boundary 1 of origin 0: its parameter is always NEVER.
    walk.origin = select(vec3<f32>(0.0), origin, moves);
    walk.inverse = select(vec3<f32>(NEVER), vec3<f32>(1.0) / direction, moves);
    walk.boundary = select(vec3<f32>(1.0), start + select(vec3<f32>(0.0), vec3<f32>(1.0), forward), moves);
    walk.t_next = (walk.boundary - walk.origin) * walk.inverse;
    walk.cell = vec3<i32>(start);
    walk.cell.x = select(walk.cell.x, size.x - 1, walk.cell.x < 0);
    walk.cell.y = select(walk.cell.y, size.y - 1, walk.cell.y < 0);
    walk.cell.x = select(walk.cell.x, 0, walk.cell.x >= size.x);
    walk.cell.y = select(walk.cell.y, 0, walk.cell.y >= size.y);
    if LEAPS {
        walk.speed = select(vec3<f32>(0.0), abs(direction), moves);
        walk.inverse_abs = abs(walk.inverse);
        let last = select(0.0, f32(size.z), forward.z);
        walk.t_slab = select(NEVER, (last - walk.origin.z) * walk.inverse.z, moves.z);
        let down = select(vec3<u32>(0u), vec3<u32>(2u, 4u, 8u), walk.step < vec3<i32>(0));
        walk.octant = vec3<u32>(down.x + down.y + down.z) + vec3<u32>(0u, 16u, 16u);
        walk.tile = size.xy;
    }
    return walk;
}

// Parameter where the ray leaves its cell.
fn walk_exit(walk: Walk) -> f32 {
    // Comparisons instead of `min`, which handles NaN and costs a third more.
    let t_next = walk.t_next;
    let x = (t_next.x <= t_next.y) & (t_next.x <= t_next.z);
    let y = !x & (t_next.y <= t_next.z);
    return select(select(t_next.z, t_next.y, y), t_next.x, x);
}

// Advances to the last cell inside the box of the ray's cell (or to the one before it) without leaving the
// slab. Does nothing unless `on` is set and the cell, whose words are `texel`, is empty. Returns the number
// of cells skipped.
fn walk_leap(walk: ptr<function, Walk>, texel: vec2<u32>, on: bool) -> u32 {
    let empty = on & ((texel.x & 0xffffu) == 0u);
    let exponents = (vec3<u32>(texel.y, texel.y, texel.x) >> (*walk).octant) & vec3<u32>(3u);
    let more = vec3<f32>((vec3<u32>(1u) << exponents) - 1u);
    let far = (*walk).t_next + more * (*walk).inverse_abs;
    let xy = select(far.y, far.x, far.x < far.y);
    let end = select((*walk).t_slab, far.z, far.z < (*walk).t_slab);
    let t = select(end, xy, xy < end) * LEAP_MARGIN;
    let ahead = ceil((t - (*walk).t_next) * (*walk).speed);
    let passed = select(vec3<f32>(0.0), ahead, (ahead > vec3<f32>(0.0)) & vec3<bool>(empty));
    let way = passed * (*walk).step_f32;
    (*walk).boundary += way;
    (*walk).t_next = ((*walk).boundary - (*walk).origin) * (*walk).inverse;
    let cell = (*walk).cell + vec3<i32>(way);
    let wraps = vec2<u32>(cell.xy) >= vec2<u32>((*walk).tile);
    let xy_in = cell.xy - select(vec2<i32>(0), (*walk).tile * (*walk).step.xy, wraps);
    (*walk).cell = vec3<i32>(xy_in, cell.z);
    return u32(passed.x + passed.y + passed.z);
}

// Advances to the next cell if `on`. One axis steps, x before y before z if several boundaries coincide.
fn walk_step(walk: ptr<function, Walk>, on: bool) {
    let t_next = (*walk).t_next;
    let x = (t_next.x <= t_next.y) & (t_next.x <= t_next.z);
    let y = !x & (t_next.y <= t_next.z);
    let moved = vec3<bool>(x & on, y & on, !(x | y) & on);
    (*walk).boundary += select(vec3<f32>(0.0), (*walk).step_f32, moved);
    (*walk).t_next = ((*walk).boundary - (*walk).origin) * (*walk).inverse;
    let cell = (*walk).cell + select(vec3<i32>(0), (*walk).step, moved);
    let xy = select(cell.xy, (*walk).entry, cell.xy == (*walk).past);
    (*walk).cell = vec3<i32>(xy, cell.z);
}
