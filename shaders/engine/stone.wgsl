// §3 Grain, cracks, moss and streaks of stone, evaluated for each sample. Twin: src/engine/cpu/stone.rs; the
// numbers of each kind: src/place/rock/stone.rs.

#import engine::gbuffer
#import layout

@group(0) @binding(16) var<storage, read> stones: array<Stone>;

// Whether any rock of the scene has a kind of stone.
override STONES: bool = false;

const OCTAVES: u32 = 10u;
const COARSEST: f32 = 1.0;
const GRADIENT: f32 = 4.471;
const CRACK: f32 = 0.011;
const CRACK_SHARE: f32 = 2.62;
const EDGE: f32 = 0.35;
const STREAK_WIDTH: f32 = 0.45;
const STREAK_HEIGHT: f32 = 4.5;
// Factor that gives the noise a deviation of 1.
const UNIT: f32 = 0.541047;

struct Octave {
    tone: f32,
    slope: f32,
    crack: f32,
    fold: f32,
    moss: f32,
    lichen: f32,
    tinted: f32,
    pad: f32,
}

// A stone: Stone of src/place/rock/stone.rs.
struct Stone {
    cells: vec3<i32>,
    along: f32,
    rest: vec3<f32>,
    moss: f32,
    streak_cells: vec3<i32>,
    streaks: f32,
    streak_rest: vec3<f32>,
    film: f32,
    up: vec3<f32>,
    bare: f32,
    tint: vec3<f32>,
    slope2: f32,
    moss_color: vec3<f32>,
    moss2: f32,
    lichen: vec3<f32>,
    lichen2: f32,
    octaves: array<Octave, 10>,
}

// Gradient at a point of the lattice, each component from -511.5 to 511.5.
fn corner_gradient(cell: vec3<u32>) -> vec3<f32> {
    var h = (cell.x * 0x8da6b343u) ^ (cell.y * 0xd8163841u) ^ (cell.z * 0xcb1ab31fu);
    h = (h ^ (h >> 15u)) * 0x9e3779b1u;
    h = (h ^ (h >> 13u)) * 0x85ebca6bu;
    let bits = vec3<u32>(h >> 22u, (h >> 12u) & 1023u, (h >> 2u) & 1023u);
    return vec3<f32>(bits) - vec3<f32>(511.5);
}

// Share of a corner at the distance `d` in the noise: its gradient, and its value last.
fn corner_share(cell: vec3<u32>, d: vec3<f32>) -> vec4<f32> {
    let g = corner_gradient(cell);
    let t = max(0.5 - dot3(d, d), 0.0);
    let t2 = t * t;
    let t4 = t2 * t2;
    let along = dot3(g, d);
    return vec4<f32>(g * t4 - d * (8.0 * t2 * t * along), t4 * along);
}

// Simplex noise of deviation 1: its gradient per cell, and its value last. `cells` is the skewed cell of the
// origin.
fn simplex(p: vec3<f32>, cells: vec3<u32>) -> vec4<f32> {
    let i = floor(p + (p.x + p.y + p.z) * (1.0 / 3.0));
    let d = p - i + (i.x + i.y + i.z) * (1.0 / 6.0);
    let xy = d.x >= d.y;
    let yz = d.y >= d.z;
    let zx = d.z >= d.x;
    let first = select(vec3<u32>(0u), vec3<u32>(1u), vec3<bool>(xy & !zx, yz & !xy, zx & !yz));
    let second = select(vec3<u32>(0u), vec3<u32>(1u), vec3<bool>(xy | !zx, yz | !xy, zx | !yz));
    let cell = vec3<u32>(vec3<i32>(i)) + cells;
    var sum = corner_share(cell, d);
    sum += corner_share(cell + first, d - vec3<f32>(first) + vec3<f32>(1.0 / 6.0));
    sum += corner_share(cell + second, d - vec3<f32>(second) + vec3<f32>(1.0 / 3.0));
    sum += corner_share(cell + vec3<u32>(1u), d - vec3<f32>(0.5));
    return sum * UNIT;
}

// Share of a noise with cells of `samples` samples that a sample shows. The noise has no power to speak of
// above 1.5 periods a cell; it is gone where a period has two samples.
fn shown(samples: f32) -> f32 {
    let x = clamp(samples * (1.0 / 3.0) - 1.0, 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
}

// Share of the area where a normal number of deviation 1 lies below `x`: a polynomial within 0.015 of it.
fn below(x: f32) -> f32 {
    let u = clamp(0.5 + x * 0.2, 0.0, 1.0);
    return u * u * u * (10.0 + u * (6.0 * u - 15.0));
}

struct StonePoint {
    point: OpaquePoint,
    normal: vec3<f32>,
}

// Lays a stone over a point of rock. `n` is its unit normal on the eye's side.
fn stone_at(in: OpaquePoint, n: vec3<f32>) -> StonePoint {
    let number = in.stone - 1u;
    let up = stones[number].up;
    let along = stones[number].along;
    let wet = in.shade.z;
    let to_eye = frame.eye_world - in.position_world;
    let distance = sqrt(dot3(to_eye, to_eye));
    let e = to_eye / max(distance, 1e-6);
    let spacing = distance * sqrt(frame.footprint) / max(dot3(n, e), 0.25);
    let across = up * (dot3(up, in.position_world) * (1.0 - 1.0 / along));
    let p = (in.position_world * (1.0 / along) + across) * (1.0 / COARSEST) + stones[number].rest;
    let cells = vec3<u32>(stones[number].cells);
    var tone = 0.0;
    var tinted = 0.0;
    var slope = vec3<f32>(0.0);
    var slope2 = stones[number].slope2;
    var moss = 0.0;
    var moss2 = stones[number].moss2;
    var lichen = 0.0;
    var lichen2 = stones[number].lichen2;
    var before = 0.0;
    for (var k = 0u; k < OCTAVES; k++) {
        let scale = f32(1u << k);
        let samples = COARSEST / (scale * spacing);
        let weight = shown(samples);
        if weight <= 0.0 {
            break;
        }
        let octave = stones[number].octaves[k];
        let noise = simplex(p * scale, cells << vec3<u32>(k));
        let value = noise.w;
        let g = noise.xyz;
        let soft = 0.1 + 1.5 / samples;
        let folded = value / sqrt(value * value + soft * soft);
        slope += g * (weight * octave.slope / GRADIENT * (1.0 + (folded - 1.0) * octave.fold));
        let away = abs(value) / sqrt(max(dot3(g, g), 1.0));
        let reach = CRACK + 0.5 / samples;
        let line = CRACK / reach * max(1.0 - away / reach, 0.0) - CRACK * CRACK_SHARE;
        let open = clamp(0.5 + 0.6 * before, 0.0, 1.0);
        tone += weight * (octave.tone * (1.0 - octave.tinted) * value - octave.crack * open * line);
        tinted += weight * octave.tone * octave.tinted * value;
        let kept = weight * weight;
        slope2 -= kept * octave.slope * octave.slope;
        moss += weight * octave.moss * value;
        moss2 -= kept * octave.moss * octave.moss;
        lichen += weight * octave.lichen * value;
        lichen2 -= kept * octave.lichen * octave.lichen;
        before = value;
    }
    let streak_size = vec3<f32>(1.0 / STREAK_WIDTH, 1.0 / STREAK_HEIGHT, 1.0 / STREAK_WIDTH);
    let q = in.position_world * streak_size + stones[number].streak_rest;
    let streak_cells = vec3<u32>(stones[number].streak_cells);
    let broad = shown(STREAK_WIDTH / spacing) * simplex(q, streak_cells).w;
    let narrow = shown(0.25 * STREAK_WIDTH / spacing) * simplex(q * 4.0, streak_cells << vec3<u32>(2u)).w;
    let streak = (0.7 * broad + 0.7 * narrow) * (1.0 - n.y * n.y);
    tone += stones[number].streaks * streak;
    var albedo = in.albedo * max(vec3<f32>(1.0 + tone) + stones[number].tint * tinted, vec3<f32>(0.1));
    let bare = below((lichen - stones[number].bare) / sqrt(EDGE * EDGE + max(lichen2, 0.0)));
    albedo += (in.albedo * stones[number].lichen * (1.0 + tone) - albedo) * (bare * (1.0 - wet));
    var rough = 1.0;
    if stones[number].moss > 0.0 {
        let bias = 3.0 * (n.y - 1.0 + 1.3 * stones[number].moss);
        let cover = below((moss + bias) / sqrt(EDGE * EDGE + max(moss2, 0.0)));
        let color = stones[number].moss_color * (max(1.0 + 1.6 * tone, 0.2) * (1.0 - 0.4 * wet));
        albedo += (color - albedo) * cover;
        rough = 1.0 - 0.5 * cover;
    }
    let share = rough * (1.0 - 0.4 * wet);
    var out: StonePoint;
    out.point = in;
    out.point.albedo = albedo;
    out.point.shade.z = clamp(wet + 0.5 * wet * streak, 0.0, 1.0);
    out.point.film = min(stones[number].film + 2.0 * max(slope2, 0.0) * share * share, 1.0);
    let flat_slope = slope * (1.0 / along) + up * (dot3(up, slope) * (1.0 - 1.0 / along));
    let tilt = flat_slope - n * dot3(n, flat_slope);
    let bent = n - tilt * share;
    let unit = bent / sqrt(max(dot3(bent, bent), 1e-12));
    let aside = unit - e * dot3(unit, e);
    let seen = aside / sqrt(max(dot3(aside, aside), 1e-12));
    out.normal = select(unit, seen, dot3(unit, e) < 0.0);
    return out;
}

// As `film_lobe`, for a film on a stone: a lobe with the squared roughness `film` (Trowbridge and Reitz
// 1975; Walter and others 2007), and the height of the peak of `film_lobe` at 0.05.
fn stone_lobe(n: vec3<f32>, l: vec3<f32>, e: vec3<f32>, film: f32) -> f32 {
    let sum = l + e;
    let h = sum / sqrt(max(dot3(sum, sum), 1e-12));
    let c = max(dot3(n, h), 0.0);
    let spread = c * c * (film - 1.0) + 1.0;
    return 0.25 * fresnel(dot3(l, h)) * film / (spread * spread);
}
