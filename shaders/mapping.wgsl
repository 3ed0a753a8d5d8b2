// §3 The map between a quad and the volume's face, and its Jacobian. Twins: QuadMap and CellFrame in
// src/mapping/mod.rs, map_quad in src/engine/cpu/gbuffer.rs, and the start of a ray in
// src/engine/cpu/integrate.rs.

#import layout

// Jacobian J = world_from_cell at one point, in the axes e1, e2 and seen normal of the quad's plane. Its
// columns are (cx, 0), (cy, 0) and (0, 0, −depth).
struct CellFrame {
    cx: vec2<f32>,
    cy: vec2<f32>,
    depth: f32,
    det: f32,
}

// J⁻¹·d, where d is given in the plane's axes.
fn cell_from_plane(j: CellFrame, d: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(cross2(d.xy, j.cy) / j.det, cross2(j.cx, d.xy) / j.det, -d.z / j.depth);
}

// Jᵀ·d, where d is given in the plane's axes.
fn transposed(j: CellFrame, d: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot2(j.cx, d.xy), dot2(j.cy, d.xy), -j.depth * d.z);
}

// Jacobian at the texture coordinates `uv`, for a volume of `size` cells.
fn cell_frame(quad: Quad, uv: vec2<f32>, size: vec3<i32>) -> CellFrame {
    let cells = vec3<f32>(size);
    var j: CellFrame;
    j.cx = (quad.e + quad.g * uv.y) / (quad.repeat_u * cells.x);
    j.cy = (quad.f + quad.g * uv.x) / (quad.repeat_v * cells.y);
    j.depth = quad.thickness / cells.z;
    j.det = cross2(j.cx, j.cy);
    return j;
}

// World vector in the plane's axes. `side` is −1 if the quad is seen from behind, otherwise 1.
fn plane_from_world(quad: Quad, side: f32, d: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot3(d, quad.e1), dot3(d, quad.e2), dot3(d, quad.n) * side);
}

// Returns −1 if the direction `d_world` meets the quad from behind, otherwise 1.
fn seen_side(quad: Quad, d_world: vec3<f32>) -> f32 {
    return select(1.0, -1.0, dot3(d_world, quad.n) > 0.0);
}

// View direction in the plane's axes. A direction along the plane is tilted into the surface, so that its
// walk ends.
fn view_in_plane(quad: Quad, side: f32, d_world: vec3<f32>) -> vec3<f32> {
    let d = plane_from_world(quad, side, d_world);
    return vec3<f32>(d.xy, min(d.z, -1e-6));
}

// Point on the face z = 0, inside the tile, where the walk begins. The volume has moved by `flow_cells` along
// y.
fn face_point(quad: Quad, uv: vec2<f32>, size: vec3<i32>, flow_cells: f32) -> vec3<f32> {
    let cells = vec2<f32>(size.xy);
    let copies = uv * vec2<f32>(quad.repeat_u, quad.repeat_v) + quad.offset;
    let xy = copies * cells - vec2<f32>(0.0, flow_cells);
    return vec3<f32>(xy - cells * floor(xy / cells), 0.0);
}

// Value of a row of a PlaneView at a point of the image.
fn linear_in(row: vec3<f32>, at: vec2<f32>) -> f32 {
    return row.x + row.y * at.x + row.z * at.y;
}

// Point of a plane under a point of the image, and the length of the ray in front of it as a multiple of
// `ray_to`. Twin: PlaneView::hit in src/mapping/view.rs, which holds the reasoning.
fn plane_hit(
    across: vec3<f32>,
    along: vec3<f32>,
    normal: vec3<f32>,
    height: f32,
    at: vec2<f32>,
) -> vec3<f32> {
    let v_n = linear_in(normal, at);
    let inverse = 1.0 / select(v_n, 1e-20, abs(v_n) < 1e-20);
    let hh = vec2<f32>(linear_in(across, at), linear_in(along, at)) * inverse;
    return vec3<f32>(clamp(hh, vec2<f32>(-1e9), vec2<f32>(1e9)), clamp(-height * inverse, 0.0, 1e9));
}

// Point of a quad in the world at the texture coordinates `uv`. Twin: QuadMap::point_world.
fn point_world(quad: Quad, uv: vec2<f32>) -> vec3<f32> {
    let p = quad.e * uv.x + quad.f * uv.y + quad.g * (uv.x * uv.y);
    return quad.a + quad.e1 * p.x + quad.e2 * p.y;
}

// Point where the ray through the point `at` of the image meets a quad: u, v, and the distance in metres.
// `length` is the ray's ray_length.
fn quad_hit(quad: Quad, at: vec2<f32>, length: f32) -> vec3<f32> {
    let hit = plane_hit(quad.across, quad.along, quad.normal, quad.height, at);
    let hh = hit.xy;
    let t = hit.z * length;

    let k2 = cross2(quad.g, quad.f);
    let k1 = cross2(quad.e, quad.f) + cross2(hh, quad.g);
    let k0 = cross2(hh, quad.e);
    let s = sqrt(max(k1 * k1 - 4.0 * k0 * k2, 0.0));
    let v = select((s - k1) / (2.0 * k2), -2.0 * k0 / (k1 + s), k1 >= 0.0);
    let along = quad.e + quad.g * v;
    let u = dot2(hh - quad.f * v, along) / dot2(along, along);
    return vec3<f32>(clamp(u, 0.0, 1.0), clamp(v, 0.0, 1.0), t);
}

// Metres from the eye to where a ray along the unit vector `d` meets the plane of a triangle, as far as its
// corners at most. Twin: map_hull in src/engine/cpu/gbuffer.rs.
fn face_metres(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, eye: vec3<f32>, d: vec3<f32>) -> f32 {
    let normal = cross3(b - a, c - a);
    let along = vec3<f32>(dot3(a - eye, d), dot3(b - eye, d), dot3(c - eye, d));
    let fall = dot3(normal, d);
    let t = dot3(normal, a - eye) / select(fall, -1e-30, fall == 0.0);
    return clamp(t, min(along.x, min(along.y, along.z)), max(along.x, max(along.y, along.z)));
}

// Shares of a triangle's corners at `metres` from the eye along `d`.
fn face_point_shares(
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    eye: vec3<f32>,
    d: vec3<f32>,
    metres: f32,
) -> vec3<f32> {
    let p = eye + d * metres;
    let normal = cross3(b - a, c - a);
    let areas = vec3<f32>(dot3(cross3(b - p, c - p), normal), dot3(cross3(c - p, a - p), normal),
        dot3(cross3(a - p, b - p), normal));
    let inside = max(areas, vec3<f32>(0.0));
    let sum = inside.x + inside.y + inside.z;
    return select(vec3<f32>(1.0 / 3.0), inside / sum, sum > 0.0);
}
