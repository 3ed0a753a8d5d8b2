// §5 Per-ray terms of the lights, and the light that a cell sends to the eye. shaders/engine/integrate.wgsl
// holds the bindings. Twins: src/engine/cpu/integrate/light.rs, and for `lit` and `lit_in_colour` the loop
// over lights in src/engine/cpu/integrate/walk.rs.

#import engine::integrate
#import layout
#import light::fibre
#import light::optical_depth
#import light::ramp
#import light::scatter
#import light::strand
#import mapping
#import trace::levels
#import trace::lookup
#import trace::matter
#import walk

// Terms of one light that are constant along a ray.
struct RayLight {
    // Jᵀl, or J⁻¹l normalised.
    l_v: vec3<f32>,
    // J⁻¹l, in the level's cells.
    l_cell: vec3<f32>,
    intensity: vec3<f32>,
    corners: PatchCorners,
    // Cosine between light and eye, in the frame where angles are measured.
    l_dot_e: f32,
    // Row of the profile, gain and fill, and forward peaks of multiple scattering.
    row: Row,
    gain: vec4<f32>,
    peak: Peak,
}

// Origins of the light volumes at the corners of a patch, and the ray's position in the patch.
struct PatchCorners {
    p00: vec3<i32>,
    p10: vec3<i32>,
    p01: vec3<i32>,
    p11: vec3<i32>,
    at: vec2<f32>,
    // Whether the patch has four light volumes; otherwise it has only the first.
    cornered: bool,
    // Whether rays walk to the light instead, because it is too close.
    marched: bool,
}

// The point where a ray meets a quad: everything the terms of its lights depend on.
struct SheetHit {
    jacobian: CellFrame,
    e1: vec3<f32>,
    e2: vec3<f32>,
    n: vec3<f32>,
    side: f32,
    d_world: vec3<f32>,
    point: vec3<f32>,
    e_v: vec3<f32>,
    uv: vec2<f32>,
    quad_number: u32,
    texture_frame: bool,
    g: f32,
    // Layers of the volume itself.
    layers: i32,
    // Index at which the quad's profile begins, and the eye's column in its gains.
    profile: u32,
    column: GainColumn,
    left: LightLeft,
}

// Shares of the light that shade leaves.
struct LightLeft {
    // Shares of the surroundings' light, and of the light that casts shadows.
    sky: f32,
    sun: f32,
    // Number of that light, and of the scene's own lights, which those of the surroundings follow.
    shadow_light: u32,
    own: u32,
}

// Shares of the light that the shade on a quad leaves. Twin: QuadShade::left of src/place/water_shade.rs.
fn light_left(quad: Quad, uv: vec2<f32>) -> LightLeft {
    return LightLeft(share_left(quad.occlusion, uv), share_left(quad.shadow, uv), frame.shadow_light,
        frame.light_count);
}

fn share_left(corners: vec4<f32>, uv: vec2<f32>) -> f32 {
    let near = corners.x + (corners.y - corners.x) * uv.x;
    let far = corners.w + (corners.z - corners.w) * uv.x;
    return 1.0 - clamp(near + (far - near) * uv.y, 0.0, 1.0);
}

// Share that is left of light number `i`.
fn left_of(left: LightLeft, i: u32) -> f32 {
    return select(select(1.0, left.sky, i >= left.own), left.sun, i == left.shadow_light);
}

// Values of a cell that all lights share.
struct CellShading {
    cell: vec3<i32>,
    occupied: bool,
    tau_bits: f32,
    // T before the cell minus T behind it.
    weight: f32,
    k_d: f32,
    k_s: f32,
    // Colour of what is reflected diffusely, if any volume has colours.
    color: vec3<f32>,
    v: vec3<f32>,
    t_dot_e: f32,
    sin2_e: f32,
    inverse_q: f32,
    // Replaces v if cells have more than one direction.
    spread: Spread,
}

// Terms of light `i` of `count`. As in the paper, the light vectors are mapped at the point, not in every
// cell.
fn ray_light(i: u32, hit: SheetHit, level: Level, count: u32) -> RayLight {
    let light = lights[i];
    let arrives = light_from(light, hit.point);
    let to_light = arrives.xyz;
    let l_n = dot3(to_light, hit.n) * hit.side;
    let l = vec3<f32>(dot3(to_light, hit.e1), dot3(to_light, hit.e2), l_n);
    var out: RayLight;
    out.intensity = light.intensity * arrives.w * left_of(hit.left, i);
    out.l_cell = cell_from_plane(hit.jacobian, l);
    out.l_v = transposed(hit.jacobian, l);
    if hit.texture_frame {
        out.l_v = out.l_cell / sqrt(dot3(out.l_cell, out.l_cell));
    }
    if CACHED {
        out.corners = patch_corners(hit.quad_number * count + i, hit.uv);
    }
    if IN_COLOUR | MANY_DIRECTIONS {
        let cosine = dot3(to_light, hit.d_world);
        out.l_dot_e = -cosine;
        if MULTIPLE {
            out.peak = scatter_peak(hit.g, cosine);
            out.row = scatter_row(slab_cosine(l_n, out.l_cell), u32(hit.layers));
            let near = hit.profile + out.row.gain + hit.column.below;
            let far = near + VIEWS;
            out.gain = scatter_gain(array(profiles[near], profiles[near + 1u]),
                array(profiles[far], profiles[far + 1u]), out.row, hit.column);
        }
        if hit.texture_frame {
            out.l_dot_e = dot3(out.l_v, hit.e_v);
        }
    }
    if PYRAMID {
        out.l_cell *= level.scale;
    }
    return out;
}

// Cosine of a direction with the slab's normal, as Row::new of src/light/scatter/mod.rs takes it.
fn slab_cosine(cosine: f32, in_cells: vec3<f32>) -> f32 {
    if PER_CELL {
        let c = abs(in_cells);
        return -in_cells.z / (c.x + c.y + c.z);
    }
    return cosine;
}

// The light volumes around the point `uv` of a quad; `entry` is that of quad and light in the table.
fn patch_corners(entry: u32, uv: vec2<f32>) -> PatchCorners {
    var out: PatchCorners;
    let patches = light_places[entry];
    let at = uv * vec2<f32>(patches.yz);
    let patch_at = min(vec2<i32>(at), patches.yz - 1);
    out.p00 = light_places[patches.x + patch_at.y * patches.y + patch_at.x].xyz;
    if CORNERED {
        if patches.w != 0 {
            let row = patches.y + 1;
            let first = patches.x + patch_at.y * row + patch_at.x;
            out.cornered = true;
            out.at = at - vec2<f32>(patch_at);
            let first_corner = light_places[first];
            out.marched = first_corner.w != 0;
            out.p00 = first_corner.xyz;
            out.p10 = light_places[first + 1].xyz;
            out.p01 = light_places[first + row].xyz;
            out.p11 = light_places[first + row + 1].xyz;
        }
    }
    return out;
}

fn is_mist(view: View) -> bool {
    return ERODED && view.matter.mist > 0.0;
}

// Summands of 255·Ψ of a cell's fibres, or 255·Ψ of mist.
fn psi_parts_of(seen: CellShading, light: RayLight, view: View) -> vec2<f32> {
    let mist = vec2<f32>(view.matter.mist, 0.0);
    if MANY_DIRECTIONS {
        let parts = spread_psi_parts(seen.spread, seen.k_d, seen.k_s, view.p, light.l_v, light.l_dot_e);
        return select(parts, mist, is_mist(view));
    }
    let t_dot_e = seen.t_dot_e;
    let parts =
        psi_parts(view.p, seen.k_d, seen.k_s, seen.v, light.l_v, t_dot_e, seen.sin2_e, seen.inverse_q);
    return select(parts, mist, is_mist(view));
}

// Light that a cell sends to the eye from a light of intensity 1, in 255ths.
fn lit(seen: CellShading, light: RayLight, view: View, ray: ptr<function, Ray>) -> f32 {
    let parts = psi_parts_of(seen, light, view);
    return seen.weight * (parts.x + parts.y) * visibility_of(seen, light, view, ray).x;
}

// Light that a cell sends to the eye from a light of intensity 1, in colour: with the strand model,
// multiple scattering or colours of the cells.
fn lit_in_colour(seen: CellShading, light: RayLight, view: View, ray: ptr<function, Ray>) -> vec3<f32> {
    let visibility = visibility_of(seen, light, view, ray);
    let weight = seen.weight * visibility.x;
    let parts = psi_parts_of(seen, light, view);
    var lit = vec3<f32>(weight * (parts.x + parts.y) * (1.0 / 255.0));
    if COLORED {
        if !is_mist(view) {
            lit = (seen.color * parts.x + vec3<f32>(parts.y)) * (weight * (1.0 / 255.0));
        }
    }
    if STRAND {
        let root = sqrt(seen.inverse_q);
        var t_dot = vec2<f32>(dot3(seen.v, light.l_v), seen.t_dot_e) * root;
        if MANY_DIRECTIONS {
            if TILTED {
                let many = spread_along(seen.spread, light.l_v, ROOT_TO_TIP);
                t_dot = select(many, t_dot, has_one_direction(view.level));
            } else {
                t_dot = spread_of_one(seen.spread, light.l_v);
            }
        }
        if !is_mist(view) & view.is_strand {
            let k_d = seen.k_d;
            let k_s = seen.k_s;
            lit = weight
                * strand_psi(strand_table, linear, view.strand, k_d, k_s, t_dot.x, t_dot.y, light.l_dot_e);
        }
    }
    if MULTIPLE {
        let z = layer_in(view, seen.cell.z) + view.profile;
        let row = light.row;
        let diffuse = scatter_diffuse(profiles[row.near + z].rgb, profiles[row.far + z].rgb, row);
        let depth = (*ray).depth;
        let more = scatter_multiple(view.similarity, light.peak, diffuse, depth, seen.tau_bits, visibility.y);
        lit += light.gain.xyz * more + view.similarity.albedo * (light.gain.w * seen.weight);
    }
    return lit;
}

// V_i(k) of a light and a cell, and −log₂ of it, which is 0 if light volumes hold codes.
fn visibility_of(seen: CellShading, light: RayLight, view: View, ray: ptr<function, Ray>) -> vec2<f32> {
    var depth = 0.0;
    if (MARCH | CACHED) & ERODED {
        if is_mist(view) {
            depth = select(0.0, mist_depth(seen.cell.z, light.l_cell, view), seen.occupied);
            return vec2<f32>(exp2(-depth), depth);
        }
    }
    if MARCH | MARCHED {
        if MARCH || light.corners.marched {
            if seen.occupied {
                let l_cell = light.l_cell;
                let walked = optical_depth(view.level, view.matter, seen.cell, l_cell, view.max_cells, NEVER);
                (*ray).light_cells += walked.cells;
                (*ray).cut |= !walked.done;
                depth = walked.depth * view.extinction;
            }
            return vec2<f32>(exp2(-depth), depth);
        }
    }
    if CACHED {
        var code = 0.0;
        // Light volumes of many patches exceed the caches, so empty cells do not fetch theirs.
        if seen.occupied {
            let value = patch_value(in_level(seen.cell, view.level), light.corners);
            code = value;
            depth = value * view.depth_bits;
        }
        if CODES {
            let transmittance = code * code * TRANSMITTANCE_OF_CODE;
            if ERODED {
                let thinner = exp2(view.matter.left * log2(max(transmittance, 1e-9)));
                return vec2<f32>(select(transmittance, thinner, view.matter.left < 1.0), 0.0);
            }
            return vec2<f32>(transmittance, 0.0);
        }
    }
    return vec2<f32>(exp2(-depth), depth);
}

// The volume's own layer at the middle of layer `z` of the level.
fn layer_in(view: View, z: i32) -> u32 {
    if PYRAMID && view.level.number > 0u {
        return u32(min(i32((f32(z) + 0.5) * view.level.deep), view.hit.layers - 1));
    }
    return u32(z);
}

// Interpolates a value between the light volumes of the ray's patch; `cell` is a position in the volume's
// texture.
fn patch_value(cell: vec3<i32>, corners: PatchCorners) -> f32 {
    let value = volume_value(cell, corners.p00);
    if CORNERED {
        if corners.cornered {
            let near = mix(value, volume_value(cell, corners.p10), corners.at.x);
            let far = mix(volume_value(cell, corners.p01), volume_value(cell, corners.p11), corners.at.x);
            return mix(near, far, corners.at.y);
        }
    }
    return value;
}

// Value of a cell in the light volume that begins at `origin`.
fn volume_value(cell: vec3<i32>, origin: vec3<i32>) -> f32 {
    if CODES {
        return code_in_word(textureLoad(light_volumes, vec3<i32>(cell.xy, cell.z >> 2u) + origin).x, cell.z);
    }
    return bitcast<f32>(textureLoad(light_volumes, cell + origin).x);
}

// Optical depth in bits of even mist from the middle of a cell in layer `layer` to the point where the light
// ray leaves the slab.
fn mist_depth(layer: i32, direction: vec3<f32>, view: View) -> f32 {
    let z = f32(layer) + 0.5;
    let layers_left = select(f32(view.level.size.z) - z, z, direction.z < 0.0);
    let t = layers_left / max(abs(direction.z), 1e-6);
    let c = abs(direction);
    let length = select(t, t * (c.x + c.y + c.z), PER_CELL);
    return view.matter.even * min(length, 1e9) * view.extinction;
}
