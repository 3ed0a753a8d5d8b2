// §5 Light of cells of shells in which light scatters many times. Twin:
// src/engine/cpu/integrate/shell_scatter.rs.

#import engine::integrate
#import engine::integrate_shell
#import engine::shell_visibility
#import layout
#import light::fibre
#import light::optics
#import light::scatter
#import mapping::shell
#import trace::levels
#import trace::lookup

// Whether light scatters many times in any shell: of fibres, or of skin, which has a surface.
override SHELL_SCATTER: bool = false;
override SHELL_SURFACE: bool = false;
// Whether any shell has fibres.
override SHELL_FIBRES: bool = true;

// Terms that the lights of a cell have in common.
struct Scatter {
    is_on: bool,
    own: CellOptics,
    g: f32,
    eta: f32,
    // w', times what passes the surface.
    weight: vec3<f32>,
    // Diffuse light that the cell sends to the eye, and even light that its surface throws back.
    diffuse: vec3<f32>,
    // Outward normal of the shell, and share and normal of the cell in the surface.
    n: vec3<f32>,
    on_surface: f32,
    normal: CellNormal,
    alpha2: f32,
}

// Optical depth in bits between two places of a ray, by T at both.
fn depth_between(start: f32, transmittance: f32) -> f32 {
    return -log2(max(transmittance / max(start, 1e-30), 1e-30));
}

// J at a place in a shell. Twin: Integrator::diffuse_at.
fn shell_diffuse(shell: Shell, layers: u32, vertices: vec3<u32>, shares: vec3<f32>, depth: f32) -> vec3<f32> {
    let z = clamp(depth, 0.0, 1.0) * f32(layers);
    let layer = min(u32(z), layers - 1u);
    let first = vec3<u32>(shell.diffuse) + 3u * (vertices * (layers + 1u) + layer);
    let share = z - f32(layer);
    let sum = vertex_diffuse(first.x, share) * shares.x + vertex_diffuse(first.y, share) * shares.y
        + vertex_diffuse(first.z, share) * shares.z;
    return max(sum, vec3<f32>(0.0));
}

// J between two depths below a vertex; `first` is the first value at the upper one.
fn vertex_diffuse(first: u32, share: f32) -> vec3<f32> {
    let near = diffuse_value(first);
    return near + (diffuse_value(first + 3u) - near) * share;
}

fn diffuse_value(first: u32) -> vec3<f32> {
    let y = shell_light_value(first + 1u);
    return vec3<f32>(shell_light_value(first), y, shell_light_value(first + 2u));
}

// Prepares the light of a cell, and keeps in the ray what lies behind its end if this is the last cell.
fn scatter_new(
    ray: ptr<function, ShellRay>,
    cell: ShellCell,
    level: Level,
    shell: Shell,
    own: VolumeConstants,
    j: ShellJacobian,
    color: vec3<f32>,
    passage: Passage,
) -> Scatter {
    var out: Scatter;
    out.is_on = own.optics.extinction.x > 0.0;
    out.own = optics_of_cell(own.optics, color);
    out.g = own.optics.g;
    out.eta = own.optics.eta;
    var leaving = vec2<f32>(1.0);
    if SHELL_SURFACE {
        if out.eta > 0.0 {
            out.n = j.z * -(1.0 / sqrt(max(dot3(j.z, j.z), 1e-30)));
            leaving = surface_leaving(out.eta, abs(dot3(out.n, -(*ray).d)));
            out.on_surface = passage_surface_weight(passage);
            if MANY_DIRECTIONS {
                out.normal = cell_normal(cell.sample.moments, j);
            } else {
                out.normal = cell_normal(moments_of_one(v_code(cell.direction)), j);
            }
            out.alpha2 = own.optics.roughness * own.optics.roughness + out.normal.variance;
        }
    }
    let layers = u32(own.cells.z + 1) / 2u;
    let extinction = out.own.extinction * leaving.y;
    let albedo_j = out.own.albedo
        * shell_diffuse(shell, layers, cell.segment.vertices, cell.deep.xyz, cell.deep.w);
    out.weight = passage_weight(passage, extinction) * leaving.x;
    out.diffuse = out.weight * albedo_j;
    if SHELL_SURFACE {
        if out.eta > 0.0 {
            let thrown_back = (1.0 - leaving.x * (out.eta * out.eta)) * out.on_surface;
            out.diffuse += frame.ambient * thrown_back;
        }
    }
    (*ray).beyond = albedo_j * leaving.x;
    (*ray).beyond_extinction = extinction;
    return out;
}

// Light of a cell for a light of intensity 1 in the direction `l`. `fibre` is Ψ, `once` the cell's share in
// what the eye sees, and `arriving` V in the shell and the share past opaque matter.
fn scatter_light(
    scatter: Scatter,
    d: vec3<f32>,
    l: vec3<f32>,
    fibre: vec3<f32>,
    once: f32,
    arriving: vec2<f32>,
) -> vec3<f32> {
    if SHELL_SURFACE {
        if scatter.eta > 0.0 {
            let mu = max(dot3(scatter.n, l), 0.0);
            let entering = surface_entering(scatter.eta, mu);
            let depth = arriving_depth(arriving.x);
            let seen = arriving_reduced(arriving, scatter.own.extinction * entering.y, depth);
            let below = scatter.weight * (scatter.own.reduced * seen) * entering.x;
            let lobe = surface_lobe(scatter.eta, scatter.normal.m, l, -d, scatter.alpha2);
            return select(vec3<f32>(0.0), below + lobe * (scatter.on_surface * arriving.y), mu > 0.0);
        }
    }
    let weight = once * (arriving.x * arriving.y);
    let peak = scatter_peak(scatter.g, dot3(l, d));
    return fibre * weight + optics_more(scatter.own, scatter.weight, weight, peak, arriving);
}

// Diffuse light from behind a ray's end. Twin: Integrator::beyond_end.
fn beyond_end(ray: ShellRay) -> vec3<f32> {
    let depth = depth_between(ray.start, ray.transmittance);
    let left = exp2(ray.beyond_extinction * -depth) * ray.start;
    return select(vec3<f32>(0.0), left * ray.beyond, ray.transmittance < frame.early_end);
}
