//! Shadow of falling water: the sheets as a light at infinity sees them, drawn into cells across its
//! direction. A cell keeps every sheet in it, because water hides only a share of the light.

use glam::{Vec2, Vec3};

use super::shade::Plane;
use crate::place::ShadedWater;

/// Cells on the longer side: 3 cm for a fall of 12 m.
const SIDE: usize = 448;

/// Share of the light that white water hides where it is whole.
pub const WATER_COVER: f32 = 0.75;

/// A quad of falling water.
#[derive(Clone, Debug, PartialEq)]
pub struct Veil {
    /// Corners of what is drawn, in the world, metres: A, B, C, D. A triangle repeats its last corner.
    pub corners: [Vec3; 4],
    /// Their places in the quad's map.
    pub uv: [Vec2; 4],
    /// Unit normal.
    pub normal: Vec3,
    /// Share of the light that it hides at each corner, 0 to 1.
    pub cover: [f32; 4],
}

impl Veil {
    /// Whether it is a triangle.
    pub fn is_triangle(&self) -> bool {
        self.corners[2] == self.corners[3]
    }
}

/// Sheets as a light sees them.
pub struct Veils {
    plane: Plane,
    /// Index in `sheets` at which those of each cell begin, and their number at the end.
    starts: Vec<u32>,
    /// Extent of a sheet towards the light, metres, and the share of the light that it lets pass.
    sheets: Vec<[f32; 2]>,
}

impl Veils {
    /// Draws water as seen along the unit vector `to_light`. None if it hides no light.
    pub fn new(water: &ShadedWater, to_light: Vec3) -> Option<Veils> {
        if water.shadow == 0.0 {
            return None;
        }
        let veils = || water.veils.iter().filter(|veil| veil.cover != [0.0; 4]);
        let plane = Plane::around(veils().flat_map(|veil| veil.corners), to_light, SIDE)?;
        let mut drawn: Vec<(u32, [f32; 2])> = Vec::new();
        for veil in veils() {
            let [a, b, c, d] = veil.corners;
            let [cover_a, cover_b, cover_c, cover_d] = veil.cover;
            let mut draw = |corners: [Vec3; 3], [at_a, at_b, at_c]: [f32; 3]| {
                plane.cells(corners, 0.0, |cell, depth, [u, v]| {
                    let cover = at_a + (at_b - at_a) * u + (at_c - at_a) * v;
                    drawn.push((cell as u32, [depth, 1.0 - water.shadow * cover]));
                });
            };
            draw([a, b, c], [cover_a, cover_b, cover_c]);
            if !veil.is_triangle() {
                draw([a, c, d], [cover_a, cover_c, cover_d]);
            }
        }
        drawn.sort_by_key(|(cell, _)| *cell);
        let count = plane.side * plane.side;
        let starts = (0..=count as u32).map(|cell| drawn.partition_point(|(own, _)| *own < cell) as u32);
        let starts = starts.collect();
        Some(Veils { plane, starts, sheets: drawn.into_iter().map(|(_, sheet)| sheet).collect() })
    }

    /// Share of the light that reaches a point past the sheets that are nearer to the light.
    pub fn pass(&self, point: Vec3) -> f32 {
        self.plane.between(point, |cell, depth| {
            let own = &self.sheets[self.starts[cell] as usize..self.starts[cell + 1] as usize];
            let nearer = own.iter().filter(|[sheet, _]| *sheet > depth);
            nearer.map(|[_, pass]| pass).product()
        })
    }
}
