// The lights as a ray sees them, and what a cell sends on of them: the second half of shaders/integrate.wgsl, which
// holds the bindings.

#import engine::integrate
#import layout
#import light::fibre
#import light::optical_depth
#import light::scatter
#import light::strand
#import mapping
#import trace::levels
#import trace::lookup
#import trace::matter
#import walk

// One light as a ray sees it: Jᵀl (or J⁻¹l normalised), and J⁻¹l.
struct RayLight {
    l_v: vec3<f32>,
    l_cell: vec3<f32>,
    intensity: vec3<f32>,
    places: LightPlaces,
    // Cosine between light and eye, in the frame where angles are measured.
    l_dot_e: f32,
    // Of multiple scattering.
    row: Row,
    peak: Peak,
}

// Where a light's volumes are, at the corners of a patch, and where in the patch the ray is.
struct LightPlaces {
    p00: vec3<i32>,
    p10: vec3<i32>,
    p01: vec3<i32>,
    p11: vec3<i32>,
    at: vec2<f32>,
    // Whether the patch has four; else the first is its own.
    cornered: bool,
}

// Where a ray meets a quad: all that its lights depend on.
struct Place {
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
    // Of the volume itself.
    layers: i32,
}

// What a cell is to every light.
struct CellShading {
    cell: vec3<i32>,
    occupied: bool,
    tau_bits: f32,
    // T before it less T behind it.
    weight: f32,
    k_d: f32,
    k_s: f32,
    v: vec3<f32>,
    t_dot_e: f32,
    sin2_e: f32,
    inverse_q: f32,
    // In place of v, where cells have more than one direction.
    spread: Spread,
}

// Light `i` of `count` (the paper maps the light vectors at the point, not in every cell).
fn ray_light(i: u32, place: Place, level: Level, count: u32) -> RayLight {
    let light = lights[i];
    let found = light_from(light, place.point);
    let to_light = found.xyz;
    let l_n = dot3(to_light, place.n) * place.side;
    let l = vec3<f32>(dot3(to_light, place.e1), dot3(to_light, place.e2), l_n);
    var out: RayLight;
    out.intensity = light.intensity * found.w;
    out.l_cell = cell_from_plane(place.jacobian, l);
    out.l_v = transposed(place.jacobian, l);
    if place.texture_frame {
        out.l_v = out.l_cell / sqrt(dot3(out.l_cell, out.l_cell));
    }
    if CACHED {
        out.places = light_places_of(place.quad_number * count + i, place.uv);
    }
    if IN_COLOUR | MANY_DIRECTIONS {
        let cosine = dot3(to_light, place.d_world);
        out.l_dot_e = -cosine;
        if MULTIPLE {
            out.peak = scatter_peak(place.g, cosine);
            var slab = l_n;
            if PER_CELL {
                let c = abs(out.l_cell);
                slab = -out.l_cell.z / (c.x + c.y + c.z);
            }
            out.row = scatter_row(slab, u32(place.layers));
        }
        if place.texture_frame {
            out.l_dot_e = dot3(out.l_v, place.e_v);
        }
    }
    if PYRAMID {
        out.l_cell *= level.scale;
    }
    return out;
}

fn light_places_of(entry: u32, uv: vec2<f32>) -> LightPlaces {
    var out: LightPlaces;
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
            out.p00 = light_places[first].xyz;
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

// 255·Ψ of strands, or of mist.
fn psi_of(seen: CellShading, light: RayLight, view: View) -> f32 {
    if MANY_DIRECTIONS {
        let psi = spread_psi(seen.spread, seen.k_d, seen.k_s, view.p, light.l_v, light.l_dot_e);
        return select(psi, view.matter.mist, is_mist(view));
    }
    let strands = psi(view.p, seen.k_d, seen.k_s, seen.v, light.l_v, seen.t_dot_e, seen.sin2_e, seen.inverse_q);
    return select(strands, view.matter.mist, is_mist(view));
}

// What a cell sends to the eye of a light of intensity 1, in 255ths.
fn lit(seen: CellShading, light: RayLight, view: View, ray: ptr<function, Ray>) -> f32 {
    let fibre = psi_of(seen, light, view);
    return seen.weight * fibre * visibility_of(seen, light, view, ray).x;
}

// The same where it has a colour: strands, or light scattered more than once.
fn lit_in_colour(seen: CellShading, light: RayLight, view: View, ray: ptr<function, Ray>) -> vec3<f32> {
    let visibility = visibility_of(seen, light, view, ray);
    let weight = seen.weight * visibility.x;
    let fibre = psi_of(seen, light, view);
    var lit = vec3<f32>(weight * fibre * (1.0 / 255.0));
    if STRAND {
        let root = sqrt(seen.inverse_q);
        var t_dot = vec2<f32>(dot3(seen.v, light.l_v), seen.t_dot_e) * root;
        if MANY_DIRECTIONS {
            t_dot = spread_of_one(seen.spread, light.l_v);
        }
        if !is_mist(view) {
            let k_d = seen.k_d;
            lit = weight
                * strand_psi(strand_table, linear, view.strand, k_d, seen.k_s, t_dot.x, t_dot.y, light.l_dot_e);
        }
    }
    if MULTIPLE {
        let z = layer_in(view, seen.cell.z) + view.profile;
        let diffuse = scatter_diffuse(profiles[light.row.near + z].rgb, profiles[light.row.far + z].rgb, light.row);
        lit += scatter_multiple(view.similarity, light.peak, diffuse, (*ray).depth, seen.tau_bits, visibility.y);
    }
    return lit;
}

// V_i(k); and −log₂ of it, which is 0 where codes are kept.
fn visibility_of(seen: CellShading, light: RayLight, view: View, ray: ptr<function, Ray>) -> vec2<f32> {
    var depth = 0.0;
    if (MARCH | CACHED) & ERODED {
        if is_mist(view) {
            depth = select(0.0, mist_depth(seen.cell.z, light.l_cell, view), seen.occupied);
            return vec2<f32>(exp2(-depth), depth);
        }
    }
    if MARCH {
        if seen.occupied {
            let walked = optical_depth(view.level, view.matter, seen.cell, light.l_cell, view.max_cells, NEVER);
            (*ray).light_cells += walked.cells;
            (*ray).cut |= !walked.done;
            depth = walked.depth * view.extinction;
        }
    }
    if CACHED {
        var code = 0.0;
        // Light volumes of many patches are larger than caches: empty cells need not ask for theirs.
        if seen.occupied {
            let kept = kept_of(in_level(seen.cell, view.level), light.places);
            code = kept;
            depth = kept * view.depth_bits;
        }
        if CODES {
            let transmittance = code * code * (1.0 / 65025.0);
            if ERODED {
                let thinner = exp2(view.matter.left * log2(max(transmittance, 1e-9)));
                return vec2<f32>(select(transmittance, thinner, view.matter.left < 1.0), 0.0);
            }
            return vec2<f32>(transmittance, 0.0);
        }
    }
    return vec2<f32>(exp2(-depth), depth);
}

// The volume's own layer in the middle of layer `z` of the level.
fn layer_in(view: View, z: i32) -> u32 {
    if PYRAMID && view.level.number > 0u {
        return u32(min(i32((f32(z) + 0.5) * view.level.deep), view.place.layers - 1));
    }
    return u32(z);
}

// From the light volumes of the ray's patch, at a place of the volume's texture.
fn kept_of(cell: vec3<i32>, places: LightPlaces) -> f32 {
    let kept = kept_at(cell, places.p00);
    if CORNERED {
        if places.cornered {
            let near = mix(kept, kept_at(cell, places.p10), places.at.x);
            let far = mix(kept_at(cell, places.p01), kept_at(cell, places.p11), places.at.x);
            return mix(near, far, places.at.y);
        }
    }
    return kept;
}

fn kept_at(cell: vec3<i32>, place: vec3<i32>) -> f32 {
    if CODES {
        return code_in_word(textureLoad(light_volumes, vec3<i32>(cell.xy, cell.z >> 2u) + place).x, cell.z);
    }
    return bitcast<f32>(textureLoad(light_volumes, cell + place).x);
}

// From the middle of a cell in layer `layer` to where the light ray leaves the slab, as through even mist.
fn mist_depth(layer: i32, direction: vec3<f32>, view: View) -> f32 {
    let z = f32(layer) + 0.5;
    let way = select(f32(view.level.size.z) - z, z, direction.z < 0.0);
    let t = way / max(abs(direction.z), 1e-6);
    let c = abs(direction);
    let length = select(t, t * (c.x + c.y + c.z), PER_CELL);
    return view.matter.even * min(length, 1e9) * view.extinction;
}
