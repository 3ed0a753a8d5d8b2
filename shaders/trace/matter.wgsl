// §4 Density of the cells as one sheet shows it: eroded, or replaced by mist. Shared by the stages visibility
// and integrate. Twin: src/trace/matter.rs.

#import layout

// Whether any sheet is eroded or of mist.
override ERODED: bool = false;

// Share of mist's ρ that comes from the cells, and ρ of uniform mist in codes.
const MIST_OF_CELLS: f32 = 0.3;
const MIST_RHO: f32 = 32768.0;
// How much faster than linearly erosion takes the mean ρ.
const MEAN_EROSION: f32 = 0.383;

// Map from a cell's ρ to the sheet's ρ' = max(scale·ρ + shift, 0), both in codes. Constant along a ray.
struct SheetDensity {
    scale: f32,
    shift: f32,
    // 255·Ψ of mist; 0 on a sheet without mist.
    mist: f32,
    // ρ of uniform mist, in codes.
    even: f32,
    // Share of the mean ρ that erosion leaves, 0 to 1.
    left: f32,
}

// Density map at texture coordinates of a quad, in which holes erode by `torn`. For cells of a coarse level
// (`coarse`), erosion scales ρ by the mean loss instead of subtracting e.
fn matter_at(quad: Quad, uv: vec2<f32>, torn: f32, coarse: bool) -> SheetDensity {
    if !ERODED {
        return SheetDensity(1.0, 0.0, 0.0, 0.0, 1.0);
    }
    let near = quad.erosion.x + (quad.erosion.y - quad.erosion.x) * uv.x;
    let far = quad.erosion.w + (quad.erosion.z - quad.erosion.w) * uv.x;
    let whole = clamp(near + (far - near) * uv.y, 0.0, 1.0);
    let e = whole + (1.0 - whole) * torn;
    if quad.mist > 0.0 {
        let left = 1.0 - e;
        let shift = (1.0 - MIST_OF_CELLS) * MIST_RHO * left;
        return SheetDensity(MIST_OF_CELLS * left, shift, quad.mist * 255.0, MIST_RHO * left, left);
    }
    let left = (1.0 - e) * (1.0 - MEAN_EROSION * e);
    if coarse {
        return SheetDensity(left, 0.0, 0.0, 0.0, left);
    }
    return SheetDensity(1.0, e * -65535.0, 0.0, 0.0, left);
}

fn matter_rho(code: f32, matter: SheetDensity) -> f32 {
    if ERODED {
        return max(code * matter.scale + matter.shift, 0.0);
    }
    return code;
}
