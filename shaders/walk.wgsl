// The exact 3-D DDA through a tiled grid of unit cells. Twin: src/walk.rs, where the edge cases stand.

const NEVER: f32 = 1.0e30;
const PARALLEL: f32 = 1.0e-20;

struct Walk {
    cell: vec3<i32>,
    step: vec3<i32>,
    step_f32: vec3<f32>,
    // Stepping onto `past` (one cell outside the tile) means coming in at `entry`. In z nothing wraps.
    past: vec2<i32>,
    entry: vec2<i32>,
    origin: vec3<f32>,
    inverse: vec3<f32>,
    boundary: vec3<f32>,
    t_next: vec3<f32>,
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
    return walk;
}

// Where the ray leaves the cell it is in.
fn walk_exit(walk: Walk) -> f32 {
    // The least of three: `min` minds NaN and costs a third more.
    let t_next = walk.t_next;
    let x = (t_next.x <= t_next.y) & (t_next.x <= t_next.z);
    let y = !x & (t_next.y <= t_next.z);
    return select(select(t_next.z, t_next.y, y), t_next.x, x);
}

// Goes to the next cell if `on`: one axis steps, x before y before z where several boundaries coincide.
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
