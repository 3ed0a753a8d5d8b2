// What a sheet makes of the cells: eroded ρ, and mist. Shared by the stages visibility and integrate. Twin:
// src/trace/matter.rs.

#import layout

// Sheets that are eroded, or of mist.
override ERODED: bool = false;

// Share of mist's ρ that is the cells', and ρ of even mist in codes.
const MIST_OF_CELLS: f32 = 0.3;
const MIST_RHO: f32 = 32768.0;

// Constant along a ray. ρ' = max(scale·ρ + shift, 0), in codes.
struct SheetDensity {
    scale: f32,
    shift: f32,
    // 255·Ψ of mist; 0 where there is none.
    mist: f32,
    // ρ of even mist.
    even: f32,
    // Share of the mean ρ that is left.
    left: f32,
}

// Of cells that stand for many (`coarse`) e is taken in the mean.
fn matter_at(quad: Quad, uv: vec2<f32>, coarse: bool) -> SheetDensity {
    if !ERODED {
        return SheetDensity(1.0, 0.0, 0.0, 0.0, 1.0);
    }
    let near = quad.erosion.x + (quad.erosion.y - quad.erosion.x) * uv.x;
    let far = quad.erosion.w + (quad.erosion.z - quad.erosion.w) * uv.x;
    let e = clamp(near + (far - near) * uv.y, 0.0, 1.0);
    if quad.mist > 0.0 {
        let left = 1.0 - e;
        let shift = (1.0 - MIST_OF_CELLS) * MIST_RHO * left;
        return SheetDensity(MIST_OF_CELLS * left, shift, quad.mist * 255.0, MIST_RHO * left, left);
    }
    let left = (1.0 - e) * (1.0 - 0.383 * e);
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
