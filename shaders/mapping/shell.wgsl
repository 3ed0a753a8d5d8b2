// §3 Shells, as src/engine/gpu/shells.rs packs them. Twins: src/mapping/shell/mod.rs and tangents.rs, which
// hold the reasoning. A stage that imports this file binds `shells`.

#import layout

// Texels in a row of the texture: 2^SHELL_ROW.
const SHELL_ROW: u32 = 13u;
// Texels in front of those of the first shell's header, and texels of a header.
const SHELL_TABLE: u32 = 1u;
const SHELL_HEADER: u32 = 3u;
// Texels of a prism, and of the tangents at a vertex.
const PRISM: u32 = 4u;
const TANGENTS: u32 = 4u;
// Beyond a side where the shell ends.
const NO_PRISM: u32 = 0xffffffffu;
// In place of a tetrahedron's number: the face of an eye inside a box. Its words are four times the number of
// the tetrahedron around the eye among all plus this, and the eye's place.
const EYE_FACE: u32 = 3u;

struct Shell {
    number: u32,
    // First texels of its points, prisms and hull. The tangents follow the points.
    points: u32,
    prisms: u32,
    hull: u32,
    // Number of its first face among those of the raster pass.
    first_face: u32,
    // Number of its volume.
    volume: u32,
    // Whether opaque matter lies behind the inner surface, and whether it shows its volume once.
    skin: bool,
    is_single: bool,
    // First value of V at its vertices, and the number of layers between which V is interpolated; without
    // layers rays walk to the light.
    light: u32,
    layers: u32,
    vertices: u32,
    // First of the shares of light that opaque matter lets through, and of the values of J.
    shadows: u32,
    diffuse: u32,
}

// Corners and texture coordinates of a prism, and what stands beyond its sides.
struct Prism {
    vertices: vec3<u32>,
    uv_a: vec2<f32>,
    uv_b: vec2<f32>,
    uv_c: vec2<f32>,
    beyond: vec3<u32>,
}

// Jacobian of a tetrahedron, as columns: metres of the world per copy of the volume along u, along v and
// into the depth.
struct ShellJacobian {
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
}

fn shell_texel(index: u32) -> vec4<u32> {
    return textureLoad(shells, vec2<u32>(index & ((1u << SHELL_ROW) - 1u), index >> SHELL_ROW), 0);
}

// Number of the first face of a hull: that behind the last quad.
fn first_hull_face() -> u32 {
    return shell_texel(0u).y;
}

fn shell_new(number: u32) -> Shell {
    let header = SHELL_TABLE + SHELL_HEADER * number;
    let a = shell_texel(header);
    let b = shell_texel(header + 1u);
    let c = shell_texel(header + 2u);
    let skin = (b.x >> 31u) != 0u;
    let is_single = (b.x & 0x40000000u) != 0u;
    let volume = b.x & 0x3fffffffu;
    return Shell(number, a.x, a.y, a.z, a.w, volume, skin, is_single, b.y, b.z, b.w, c.x, c.y);
}

// The shell of a face, given by its number.
fn shell_of_face(face: u32) -> Shell {
    let count = shell_texel(0u).x;
    var number = 0u;
    for (var i = 1u; i < count; i++) {
        number = select(number, i, shell_texel(SHELL_TABLE + SHELL_HEADER * i).w <= face);
    }
    return shell_new(number);
}

fn shell_point(shell: Shell, point: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(shell_texel(shell.points + point).xyz);
}

fn prism_vertices(shell: Shell, prism: u32) -> vec3<u32> {
    return shell_texel(shell.prisms + PRISM * prism).xyz;
}

fn prism_of(shell: Shell, prism: u32) -> Prism {
    let first = shell.prisms + PRISM * prism;
    let a = shell_texel(first);
    let b = shell_texel(first + 1u);
    let c = shell_texel(first + 2u);
    return Prism(a.xyz, bitcast<vec2<f32>>(b.xy), bitcast<vec2<f32>>(b.zw), bitcast<vec2<f32>>(c.xy),
        vec3<u32>(a.w, c.zw));
}

// Numbers of the points of a tetrahedron. Twin: Shell::tetrahedron.
fn tetrahedron_points(vertices: vec3<u32>, tetrahedron: u32) -> vec4<u32> {
    let outer = vertices * 2u;
    return vec4<u32>(
        outer.x,
        select(outer.y, outer.x + 1u, tetrahedron == 2u),
        select(outer.y + 1u, outer.z, tetrahedron == 0u),
        outer.z + 1u,
    );
}

// Whether two edges span an area.
fn is_an_area(a: vec2<f32>, b: vec2<f32>) -> bool {
    return abs(cross2(a, b)) > 1e-6 * sqrt(dot2(a, a)) * sqrt(dot2(b, b));
}

// Jacobian with which light is computed in a triangle that has an area in the texture. Twin: Shell::frame.
fn shell_frame(shell: Shell, number: u32, shares: vec3<f32>, depth: f32) -> ShellJacobian {
    let numbers = shell_texel(shell.prisms + PRISM * number + 3u);
    let first = vec3<u32>(shell.points + 2u * shell.vertices) + TANGENTS * numbers.xyz;
    let p = tangents_mean(first, shares);
    let q = tangents_mean(first + 1u, shares);
    let r = tangents_mean(first + 2u, shares);
    let down = tangents_mean(first + 3u, shares).xyz;
    let outer_v = vec3<f32>(p.w, q.xy);
    let inner_u = vec3<f32>(q.zw, r.x);
    return ShellJacobian(p.xyz + (inner_u - p.xyz) * depth, outer_v + (r.yzw - outer_v) * depth, down);
}

// Sum of four numbers of three tangents, each times its share. Twin: Tangents::mean.
fn tangents_mean(texels: vec3<u32>, shares: vec3<f32>) -> vec4<f32> {
    return bitcast<vec4<f32>>(shell_texel(texels.x)) * shares.x
        + bitcast<vec4<f32>>(shell_texel(texels.y)) * shares.y
        + bitcast<vec4<f32>>(shell_texel(texels.z)) * shares.z;
}
