// §3 The path of a ray through a shell, from tetrahedron to tetrahedron. Twin: src/mapping/shell/path.rs,
// which holds the reasoning.

#import layout
#import mapping::shell
#import walk

// Faces that a path passes before it is given up. Twin: MOST_FACES of path.rs.
const MOST_FACES: u32 = 65536u;

// Space behind a segment.
const END_SEGMENT: u32 = 0u;
const END_OUTER: u32 = 1u;
const END_INNER: u32 = 2u;
const END_BORDER: u32 = 3u;

// A corner of a tetrahedron as the ray sees it.
struct Corner {
    point: u32,
    // Position across the ray and along it, metres.
    at: vec2<f32>,
    t: f32,
    // Position in the world, metres.
    world: vec3<f32>,
}

struct ShellPath {
    shell: Shell,
    origin: vec3<f32>,
    direction: vec3<f32>,
    // Unit vectors across the direction.
    across_x: vec3<f32>,
    across_y: vec3<f32>,
    prism: u32,
    tetrahedron: u32,
    // Corners of the face that the ray enters through next, counter-clockwise around it, and their shares in
    // the point where it does.
    a: Corner,
    b: Corner,
    c: Corner,
    shares: vec3<f32>,
    t: f32,
    // Number of faces that may still be passed; 0 behind the last segment.
    left: u32,
}

// Share of the way to a tetrahedron's middle by which the origin of a line is moved that passes it by.
const INWARDS: f32 = 1e-3;

// The part of a ray inside one tetrahedron: Segment of path.rs.
struct Segment {
    prism: u32,
    tetrahedron: u32,
    t_in: f32,
    t_out: f32,
    at_in: vec3<f32>,
    at_out: vec3<f32>,
    shares_in: vec3<f32>,
    shares_out: vec3<f32>,
    end: u32,
    // Whether the triangle has an area in the texture.
    is_mapped: bool,
    // The prism's vertices and edges in the texture, and the corners of the tetrahedron in the world, so that
    // nobody fetches them again: software Vulkan fetches texels lane by lane.
    vertices: vec3<u32>,
    uv_ab: vec2<f32>,
    uv_ac: vec2<f32>,
    p0: vec3<f32>,
    p1: vec3<f32>,
    p2: vec3<f32>,
    p3: vec3<f32>,
}

// Twin: Shell::jacobian, for a triangle that has an area in the texture.
fn shell_jacobian(segment: Segment) -> ShellJacobian {
    let tetrahedron = segment.tetrahedron;
    let p0 = segment.p0;
    let p1 = segment.p1;
    let p2 = segment.p2;
    let p3 = segment.p3;
    let down = select(select(p3 - p2, p2 - p1, tetrahedron == 1u), p1 - p0, tetrahedron == 2u);
    let e1 = select(p1 - p0, p2 - p0 - down, tetrahedron == 2u);
    let e2 = select(p3 - p0 - down, p2 - p0, tetrahedron == 0u);
    let a = segment.uv_ab;
    let b = segment.uv_ac;
    let inverse = 1.0 / cross2(a, b);
    return ShellJacobian((e1 * b.y - e2 * a.y) * inverse, (e2 * a.x - e1 * b.x) * inverse, down);
}

// x·y − product, where `product` is x·y as rounded. It is exact: the halves of the factors have 12 bits, so
// their products fit float32, and so does each sum.
fn product_error(x: f32, y: f32, product: f32) -> f32 {
    let x_high = bitcast<f32>(bitcast<u32>(x) & 0xfffff000u);
    let y_high = bitcast<f32>(bitcast<u32>(y) & 0xfffff000u);
    let x_low = x - x_high;
    let y_low = y - y_high;
    return ((x_high * y_high - product) + x_high * y_low + x_low * y_high) + x_low * y_low;
}

// Whether the ray passes to the left of the edge from `p` to `q`. Twin: is_left of path.rs, which computes in
// float64. Here the two products are compared as they are: rounding keeps their order. If they round to the
// same number, their errors decide, which are exact too. So all answers fit one another and those of the CPU,
// and neither fused products nor a grid of coordinates can make two tetrahedra disagree.
fn is_left(p: Corner, q: Corner) -> bool {
    let one = p.at.x * q.at.y;
    let other = p.at.y * q.at.x;
    let one_error = product_error(p.at.x, q.at.y, one);
    let other_error = product_error(p.at.y, q.at.x, other);
    let along = q.at - p.at;
    let along_ray = select(p.point < q.point, along.x < 0.0, along.x != 0.0);
    let on_edge = select(along_ray, along.y > 0.0, along.y != 0.0);
    let close = select(on_edge, one_error > other_error, one_error != other_error);
    return select(close, one > other, one != other);
}

// Shares of a face's corners in the point where the ray passes it.
fn face_shares(a: Corner, b: Corner, c: Corner) -> vec3<f32> {
    let shares = max(vec3<f32>(cross2(b.at, c.at), cross2(c.at, a.at), cross2(a.at, b.at)), vec3<f32>(0.0));
    let sum = shares.x + shares.y + shares.z;
    return select(vec3<f32>(1.0 / 3.0), shares / sum, sum > 0.0);
}

// Parameter of a point of a face.
fn face_parameter(a: Corner, b: Corner, c: Corner, shares: vec3<f32>) -> f32 {
    return shares.x * a.t + shares.y * b.t + shares.z * c.t;
}

fn path_corner(path: ShellPath, point: u32) -> Corner {
    let world = shell_point(path.shell, point);
    let away = world - path.origin;
    let at = vec2<f32>(dot3(away, path.across_x), dot3(away, path.across_y));
    return Corner(point, at, dot3(away, path.direction), world);
}

// Position of the point `point`, which is one of four corners.
fn world_of(point: u32, a: Corner, b: Corner, c: Corner, d: Corner) -> vec3<f32> {
    let ab = select(b.world, a.world, a.point == point);
    return select(select(d.world, c.world, c.point == point), ab, (a.point == point) | (b.point == point));
}

fn path_at(
    shell: Shell,
    prism: u32,
    tetrahedron: u32,
    origin: vec3<f32>,
    direction: vec3<f32>,
) -> ShellPath {
    var path: ShellPath;
    path.shell = shell;
    path.origin = origin;
    path.direction = direction;
    // Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017, as the CPU engine's vectors do.
    let side = select(-1.0, 1.0, (bitcast<u32>(direction.z) >> 31u) == 0u);
    let a = -1.0 / (side + direction.z);
    let b = direction.x * direction.y * a;
    path.across_x = vec3<f32>(1.0 + side * direction.x * direction.x * a, side * b, -side * direction.x);
    path.across_y = vec3<f32>(b, side + direction.y * direction.y * a, -direction.y);
    path.prism = prism;
    path.tetrahedron = tetrahedron;
    path.left = MOST_FACES;
    return path;
}

// Enters through a face, seen from either side.
fn path_enter(path: ptr<function, ShellPath>, a: Corner, b: Corner, c: Corner) {
    let turned = cross2(b.at - a.at, c.at - a.at) < 0.0;
    (*path).a = a;
    (*path).b = b;
    (*path).c = c;
    if turned {
        (*path).b = c;
        (*path).c = b;
    }
    (*path).shares = face_shares((*path).a, (*path).b, (*path).c);
    (*path).t = face_parameter((*path).a, (*path).b, (*path).c, (*path).shares);
}

// Path through a face of the hull, whose words are `face`. Twin: ShellPath::new.
fn path_through(shell: Shell, face: vec4<u32>, origin: vec3<f32>, direction: vec3<f32>) -> ShellPath {
    var path = path_at(shell, face.x >> 2u, face.x & 3u, origin, direction);
    path.left = 0u;
    for (var turn = 0; turn < 2; turn++) {
        let a = path_corner(path, face.y);
        let b = path_corner(path, face.z);
        let c = path_corner(path, face.w);
        path_enter(&path, a, b, c);
        if is_left(path.a, path.b) && is_left(path.b, path.c) && is_left(path.c, path.a) {
            path.left = MOST_FACES;
            break;
        }
        let shares = path.shares * 0.999 + 0.001 / 3.0;
        let at = path.a.at * shares.x + path.b.at * shares.y + path.c.at * shares.z;
        path.origin += path.across_x * at.x + path.across_y * at.y;
    }
    return path;
}

// Considers a face as the one that a path from inside begins at. `turns` tells to which side of its edges the
// ray passes.
fn path_consider(
    path: ptr<function, ShellPath>,
    least: ptr<function, f32>,
    turns: vec3<bool>,
    a: Corner,
    b: Corner,
    c: Corner,
) {
    if all(turns == vec3<bool>(turns.x)) {
        var p = b;
        var q = c;
        if !turns.x {
            p = c;
            q = b;
        }
        let t = face_parameter(a, p, q, face_shares(a, p, q));
        if t < *least {
            *least = t;
            path_enter(path, a, p, q);
        }
    }
}

// Path of a ray whose origin lies in a tetrahedron. Without segments if the tetrahedron has no volume. Twin:
// ShellPath::inside, which explains the second try.
fn path_inside(
    shell: Shell,
    prism: u32,
    tetrahedron: u32,
    origin: vec3<f32>,
    direction: vec3<f32>,
) -> ShellPath {
    let points = tetrahedron_points(prism_vertices(shell, prism), tetrahedron);
    var from_point = origin;
    var path: ShellPath;
    for (var attempt = 0u; attempt < 2u; attempt++) {
        path = path_at(shell, prism, tetrahedron, from_point, direction);
        let a = path_corner(path, points.x);
        let b = path_corner(path, points.y);
        let c = path_corner(path, points.z);
        let d = path_corner(path, points.w);
        // An edge that is seen the other way has the ray on its other side.
        let ab = is_left(a, b);
        let ac = is_left(a, c);
        let ad = is_left(a, d);
        let bc = is_left(b, c);
        let bd = is_left(b, d);
        let cd = is_left(c, d);
        var least = NEVER;
        path_consider(&path, &least, vec3<bool>(bc, cd, !bd), b, c, d);
        path_consider(&path, &least, vec3<bool>(ac, cd, !ad), a, c, d);
        path_consider(&path, &least, vec3<bool>(ab, bd, !ad), a, b, d);
        path_consider(&path, &least, vec3<bool>(ab, bc, !ac), a, b, c);
        if least != NEVER {
            path.t = min(path.t, 0.0);
            return path;
        }
        let middle = (a.world + b.world + c.world + d.world) * 0.25;
        from_point = origin + (middle - origin) * INWARDS;
    }
    path.left = 0u;
    return path;
}

// Shares of a prism's vertices in a point that lies between corners, given by their shares.
fn shares_of_vertices(vertices: vec3<u32>, a: Corner, b: Corner, c: Corner, shares: vec3<f32>) -> vec3<f32> {
    let zero = vec3<f32>(0.0);
    return select(zero, vec3<f32>(shares.x), vertices == vec3<u32>(a.point >> 1u))
        + select(zero, vec3<f32>(shares.y), vertices == vec3<u32>(b.point >> 1u))
        + select(zero, vec3<f32>(shares.z), vertices == vec3<u32>(c.point >> 1u));
}

// Texture coordinates of that point.
fn texture_of(
    prism: Prism,
    a: Corner,
    b: Corner,
    c: Corner,
    shares: vec3<f32>,
    vertices: vec3<f32>,
) -> vec3<f32> {
    let depth = shares.x * f32(a.point & 1u) + shares.y * f32(b.point & 1u) + shares.z * f32(c.point & 1u);
    let uv = prism.uv_a * vertices.x + prism.uv_b * vertices.y + prism.uv_c * vertices.z;
    return vec3<f32>(uv, min(depth, 1.0));
}

// Spaces beyond the faces of the three tetrahedra, four bits for each, opposite the corner of the same
// position: another tetrahedron (0 to 2), a surface (3), or 4 + 2·side + half. Twin: FACES of mod.rs.
const FACES_OF_FIRST: u32 = 0x3186u;
const FACES_OF_SECOND: u32 = 0x4027u;
const FACES_OF_THIRD: u32 = 0x5913u;
// Tetrahedra at the halves of the sides, four bits for each. Twin: AT_SIDES of mod.rs.
const AT_SIDES: u32 = 0x201021u;

// The next segment of a path that has some left. Twin: ShellPath::next.
fn path_next(path: ptr<function, ShellPath>) -> Segment {
    let prism = prism_of((*path).shell, (*path).prism);
    let tetrahedron = (*path).tetrahedron;
    let a = (*path).a;
    let b = (*path).b;
    let c = (*path).c;
    let points = tetrahedron_points(prism.vertices, tetrahedron);
    let is_old = (points == vec4<u32>(a.point)) | (points == vec4<u32>(b.point))
        | (points == vec4<u32>(c.point));
    var new_point = select(points.w, points.z, !is_old.z);
    new_point = select(new_point, points.y, !is_old.y);
    new_point = select(new_point, points.x, !is_old.x);
    let d = path_corner(*path, new_point);
    let left_a = is_left(d, a);
    let left_b = is_left(d, b);
    let left_c = is_left(d, c);
    var segment: Segment;
    segment.prism = (*path).prism;
    segment.tetrahedron = tetrahedron;
    segment.vertices = prism.vertices;
    segment.uv_ab = prism.uv_b - prism.uv_a;
    segment.uv_ac = prism.uv_c - prism.uv_a;
    segment.is_mapped = is_an_area(segment.uv_ab, segment.uv_ac);
    segment.p0 = world_of(points.x, a, b, c, d);
    segment.p1 = world_of(points.y, a, b, c, d);
    segment.p2 = world_of(points.z, a, b, c, d);
    segment.p3 = world_of(points.w, a, b, c, d);
    segment.shares_in = shares_of_vertices(prism.vertices, a, b, c, (*path).shares);
    segment.at_in = texture_of(prism, a, b, c, (*path).shares, segment.shares_in);
    // The face behind c, a or b.
    var near = c;
    var far = a;
    var dropped = b.point;
    if left_a & !left_b {
        near = a;
        far = b;
        dropped = c.point;
    } else if left_b & !left_c {
        near = b;
        far = c;
        dropped = a.point;
    }
    let shares = face_shares(near, far, d);
    let t_in = (*path).t;
    let t_out = max(face_parameter(near, far, d, shares), t_in);
    segment.t_in = t_in;
    segment.t_out = t_out;
    segment.shares_out = shares_of_vertices(prism.vertices, near, far, d, shares);
    segment.at_out = texture_of(prism, near, far, d, shares, segment.shares_out);
    (*path).a = near;
    (*path).b = far;
    (*path).c = d;
    (*path).shares = shares;
    (*path).t = t_out;

    let first_two = select(1u, 0u, points.x == dropped);
    let opposite = select(select(3u, 2u, points.z == dropped), first_two,
        (points.x == dropped) | (points.y == dropped));
    let faces = select(select(FACES_OF_THIRD, FACES_OF_SECOND, tetrahedron == 1u), FACES_OF_FIRST,
        tetrahedron == 0u);
    let beyond = (faces >> (4u * opposite)) & 15u;
    segment.end = END_SEGMENT;
    if beyond < 3u {
        (*path).tetrahedron = beyond;
    } else if beyond == 3u {
        segment.end = select(END_INNER, END_OUTER, tetrahedron == 0u);
    } else {
        let side = (beyond - 4u) >> 1u;
        let half = beyond & 1u;
        let next = select(select(prism.beyond.z, prism.beyond.y, side == 1u), prism.beyond.x, side == 0u);
        if next == NO_PRISM {
            segment.end = END_BORDER;
        } else {
            (*path).prism = next >> 2u;
            (*path).tetrahedron = (AT_SIDES >> (4u * (2u * (next & 3u) + half))) & 15u;
        }
    }
    (*path).left = select(0u, (*path).left - 1u, segment.end == END_SEGMENT);
    return segment;
}

// The part of a segment behind the parameter `t`, if it lies inside the segment. Twin: Segment::from.
fn segment_from(segment: Segment, t: f32) -> Segment {
    var out = segment;
    if (t > segment.t_in) & (t <= segment.t_out) {
        let share = clamp((t - segment.t_in) / (segment.t_out - segment.t_in), 0.0, 1.0);
        out.t_in = t;
        out.at_in = segment.at_in + (segment.at_out - segment.at_in) * share;
        out.shares_in = segment.shares_in + (segment.shares_out - segment.shares_in) * share;
    }
    return out;
}

// The part of a segment before the parameter `t`. Twin: Segment::until.
fn segment_until(segment: Segment, t: f32) -> Segment {
    var out = segment;
    if t < segment.t_out {
        let share = clamp((t - segment.t_in) / (segment.t_out - segment.t_in), 0.0, 1.0);
        out.t_out = max(t, segment.t_in);
        out.at_out = segment.at_in + (segment.at_out - segment.at_in) * share;
        out.shares_out = segment.shares_in + (segment.shares_out - segment.shares_in) * share;
    }
    return out;
}

// Point in cells, moved into a tile. Twin: wrapped of src/engine/cpu/integrate/shell.rs.
fn in_tile(at: vec3<f32>, size: vec3<i32>) -> vec3<f32> {
    let n = vec2<f32>(size.xy);
    return vec3<f32>(at.xy - n * floor(at.xy / n), at.z);
}

// Where a segment begins, in cells and inside the tile. Twin: in_cells.
fn segment_origin(segment: Segment, size: vec3<i32>, flow_cells: f32) -> vec3<f32> {
    return in_tile(segment.at_in * vec3<f32>(size) - vec3<f32>(0.0, flow_cells, 0.0), size);
}

// Its direction in cells per metre.
fn segment_direction(segment: Segment, size: vec3<i32>) -> vec3<f32> {
    let n = vec3<f32>(size);
    let length = segment.t_out - segment.t_in;
    let way = segment.at_out * n - segment.at_in * n;
    return select(vec3<f32>(0.0, 0.0, 1.0), way / length, length > 0.0);
}
