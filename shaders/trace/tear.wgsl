// §4 Torn water. Twin: src/trace/tear.rs, which holds the reasoning.

#import layout
#import trace::noise

// Whether any sheet is torn.
override TEARS: bool = false;

const TEAR_INVERSE_DEVIATION: f32 = 3.8215;
const TEAR_SOFT: f32 = 0.6;
const TEAR_LEVELS: f32 = 2.0;

// Value noise at `p` in cells of a lattice that repeats after `period` cells, 0 to 1.
fn tear_noise(p: vec2<f32>, period: vec2<u32>, octave: u32) -> f32 {
    let cell = floor(p);
    let f = p - cell;
    let s = f * f * (vec2<f32>(3.0) - f * 2.0);
    let at = vec2<u32>(cell) % period;
    let next = (at + 1u) % period;
    let low = lattice(at.x, at.y, octave);
    let near = low + (lattice(next.x, at.y, octave) - low) * s.x;
    let high = lattice(at.x, next.y, octave);
    let far = high + (lattice(next.x, next.y, octave) - high) * s.x;
    return near + (far - near) * s.y;
}

// Rank of a place among all of its volume's, 0 to 1; `place` is in copies of the volume, 0 to 1.
fn tear_rank(cells: vec2<u32>, place: vec2<f32>) -> f32 {
    var p = place * vec2<f32>(cells);
    p.y += 1.5 * tear_noise(vec2<f32>(p.x * 2.0, 0.0), vec2<u32>(cells.x * 2u, 1u), 8u);
    p.y += 0.75 * tear_noise(vec2<f32>(p.x * 4.0, 0.0), vec2<u32>(cells.x * 4u, 1u), 9u);
    let sum = tear_noise(p, cells, 0u) - 0.5
        + 0.6 * (tear_noise(p * 2.0, cells * 2u, 1u) - 0.5)
        + 0.36 * (tear_noise(p * vec2<f32>(4.0, 3.0), cells * vec2<u32>(4u, 3u), 2u) - 0.5);
    let u = clamp(0.5 + sum * (0.2 * TEAR_INVERSE_DEVIATION), 0.0, 1.0);
    return u * u * u * (10.0 + u * (6.0 * u - 15.0));
}

// Erosion at the texture coordinates `uv` of a quad. `place` is the place in the volume, in copies of it;
// `level` is the level of the pyramid whose cells a pixel sees, of a volume of `cells` cells across.
fn tear_erosion(quad: Quad, uv: vec2<f32>, place: vec2<f32>, cells: f32, level: f32) -> f32 {
    let open = quad.tear.x + (quad.tear.y - quad.tear.x) * uv.y;
    if open <= 0.0 {
        return 0.0;
    }
    let rank = tear_rank(vec2<u32>(quad.tear.zw), place);
    let torn = clamp((rank - (1.0 - open)) * (1.0 / TEAR_SOFT), 0.0, 1.0);
    let mean = select(open - 0.5 * TEAR_SOFT, open * open / (2.0 * TEAR_SOFT), open < TEAR_SOFT);
    let hole = log2(cells / quad.tear.z);
    let unseen = clamp(1.0 + (level - hole) * (1.0 / TEAR_LEVELS), 0.0, 1.0);
    return torn + (mean - torn) * unseen;
}
