// The lights as a ray sees them: the second half of shaders/integrate.wgsl, which holds the bindings.

// One light as a ray sees it: Jᵀl (or J⁻¹l normalised), and J⁻¹l.
struct RayLight {
    l_v: vec3<f32>,
    l_cell: vec3<f32>,
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

fn ray_light(i: u32, quad: Quad, jacobian: CellFrame, side: f32, d_world: vec3<f32>, t_hit: f32) -> RayLight {
    let to_light = light_at(i, d_world, t_hit).xyz;
    let l = plane_from_world(quad, side, to_light);
    var out: RayLight;
    out.l_cell = cell_from_plane(jacobian, l);
    out.l_v = transposed(jacobian, l);
    if frame.texture_frame != 0u {
        out.l_v = out.l_cell / sqrt(dot3(out.l_cell, out.l_cell));
    }
    return out;
}

fn light_places_of(quad_number: u32, light: u32, uv: vec2<f32>) -> LightPlaces {
    var out: LightPlaces;
    let patches = light_places[quad_number * LIGHTS + light];
    let at = uv * vec2<f32>(patches.yz);
    let patch_at = min(vec2<i32>(at), patches.yz - 1);
    if !CORNERED | (patches.w == 0) {
        out.p00 = light_places[patches.x + patch_at.y * patches.y + patch_at.x].xyz;
        return out;
    }
    let row = patches.y + 1;
    let first = patches.x + patch_at.y * row + patch_at.x;
    out.cornered = true;
    out.at = at - vec2<f32>(patch_at);
    out.p00 = light_places[first].xyz;
    out.p10 = light_places[first + 1].xyz;
    out.p01 = light_places[first + row].xyz;
    out.p11 = light_places[first + row + 1].xyz;
    return out;
}

fn light_intensity(i: u32, d_world: vec3<f32>, t_hit: f32) -> vec3<f32> {
    return lights[i].intensity * light_at(i, d_world, t_hit).w;
}

// Unit direction from the mapped point to light i, and its falloff there (the paper maps the light
// vectors at the point, not in every cell).
fn light_at(i: u32, d_world: vec3<f32>, t_hit: f32) -> vec4<f32> {
    return light_from(lights[i], frame.eye_world + d_world * t_hit);
}

// The optical depth in bits from an occupied cell to a light: −log₂ of V_i(k).
fn light_depth(rho: f32, cell: vec3<i32>, light: RayLight, view: View, total: ptr<function, Ray>) -> f32 {
    var depth = 0.0;
    if (MARCH | CACHED) && is_mist(view) {
        return select(0.0, mist_depth(cell, light.l_cell, view), rho > 0.0);
    }
    if MARCH {
        if rho > 0.0 {
            depth = marched_depth(cell, light.l_cell, view, total);
        }
    }
    if CACHED {
        // Light volumes of many patches are larger than caches: empty cells need not ask for theirs.
        if rho > 0.0 {
            depth = kept_depth(cell, light.places, view);
        }
    }
    return depth;
}

// From the middle of `cell` to where the light ray leaves the slab.
struct LightWalk {
    depth: f32,
    t: f32,
    cells: u32,
    done: bool,
}

fn marched_depth(cell: vec3<i32>, direction: vec3<f32>, view: View, total: ptr<function, Ray>) -> f32 {
    var ray: LightWalk;
    var walk = walk_new(frame.cells, vec3<f32>(cell) + 0.5, direction);
    while !ray.done {
        visit_light(&walk, &ray, view);
        visit_light(&walk, &ray, view);
        visit_light(&walk, &ray, view);
        visit_light(&walk, &ray, view);
    }
    (*total).light_cells += ray.cells;
    return ray.depth * view.extinction;
}

fn visit_light(walk: ptr<function, Walk>, ray: ptr<function, LightWalk>, view: View) {
    let t_exit = walk_exit(*walk);
    let rho = matter_rho(textureLoad(volume, (*walk).cell).x & 0xffffu, view.matter);
    if PER_CELL {
        // The cell itself does not hide its own light.
        (*ray).depth += select(rho, 0.0, (*ray).done | ((*ray).cells == 0u));
    } else {
        (*ray).depth += select(rho * (t_exit - (*ray).t), 0.0, (*ray).done);
    }
    (*ray).cells += select(1u, 0u, (*ray).done);
    (*ray).t = t_exit;
    walk_step(walk, true);
    let z = (*walk).cell.z;
    (*ray).done |= (z < 0) | (z >= view.layers) | ((*ray).cells >= view.max_cells);
}

// From the light volumes of the ray's patch.
fn kept_depth(cell: vec3<i32>, places: LightPlaces, view: View) -> f32 {
    var depth = textureLoad(light_depths, cell + places.p00).x;
    if CORNERED && places.cornered {
        let near = mix(depth, textureLoad(light_depths, cell + places.p10).x, places.at.x);
        let far = mix(
            textureLoad(light_depths, cell + places.p01).x,
            textureLoad(light_depths, cell + places.p11).x,
            places.at.x,
        );
        depth = mix(near, far, places.at.y);
    }
    return depth * view.depth_bits;
}
