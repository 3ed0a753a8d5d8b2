//! The surroundings that a pool mirrors besides the sky: rock and falling water as seen from its centre, in
//! cells of equal solid angle over the upper hemisphere. The map is coarse because waves blur it.

use glam::Vec3;

use super::{AROUND, turn};
use crate::mapping::Quad;
use crate::place::{Mesh, Vertex, WATER_COVER};
use crate::scene::Scene;
use crate::trace::tear;

/// Step between the mesh vertices that are sampled.
const STRIDE: usize = 5;
/// Distance relative to a cell's nearest vertex beyond which a vertex counts as hidden behind it.
const BEHIND: f32 = 1.4;
/// Points sampled along each side of a quad.
const POINTS: u32 = 6;
/// Share of the lights' irradiance that white water reflects.
const WATER_REFLECTANCE: f32 = 0.35;

/// Returns the cell of a unit direction; `None` below the horizon. The lookup, which interpolates between
/// cells, is `around` of `shaders/engine/pool.wgsl`.
fn cell(d: Vec3) -> Option<usize> {
    if d.y < 0.0 {
        return None;
    }
    let column = (turn(d) * AROUND[0] as f32) as usize % AROUND[0];
    let row = ((d.y * AROUND[1] as f32) as usize).min(AROUND[1] - 1);
    Some(row * AROUND[0] + column)
}

/// Returns the mean distance of the surrounding rock from the point `middle` in metres, and the cells of the
/// map ([`Surface::around`](super::Surface::around)).
pub fn around(scene: &Scene, mesh: &Mesh, middle: Vec3) -> (f32, [[f32; 4]; AROUND[0] * AROUND[1]]) {
    const CELLS: usize = AROUND[0] * AROUND[1];
    let sampled = || {
        let rock = (0..).zip(mesh.vertices.iter()).filter(|(_, v)| v.pool == 0).step_by(STRIDE);
        rock.filter_map(|(number, vertex)| {
            let away = Vec3::from(vertex.position) - middle;
            let distance = away.length();
            Some(((number, vertex), distance, cell(away / distance.max(1e-6))?))
        })
    };
    let mut nearest = [f32::INFINITY; CELLS];
    for (_, distance, cell) in sampled() {
        nearest[cell] = nearest[cell].min(distance);
    }
    let mut sums = [Vec3::ZERO; CELLS];
    let mut counts = [0.0f32; CELLS];
    let tints = mesh.tints();
    for ((number, vertex), distance, cell) in sampled() {
        if distance < BEHIND * nearest[cell] {
            let tile = tints.partition_point(|(first, _)| *first <= number);
            let tint = tile.checked_sub(1).map_or(Vec3::ONE, |tile| tints[tile].1);
            sums[cell] += radiance(scene, vertex) * tint;
            counts[cell] += 1.0;
        }
    }
    let mut cells = [[0.0; 4]; CELLS];
    for column in 0..AROUND[0] {
        // Rock stands on the ground, so no sky shows below its highest cell.
        let mut above: Option<Vec3> = None;
        for row in (0..AROUND[1]).rev() {
            let i = row * AROUND[0] + column;
            if counts[i] > 0.0 {
                above = Some(sums[i] / counts[i]);
            }
            if let Some(colour) = above {
                cells[i] = colour.extend(1.0).to_array();
            }
        }
    }
    add_water(scene, mesh, middle, &mut cells);
    let near: Vec<f32> = nearest.iter().copied().filter(|d| d.is_finite()).collect();
    let radius = if near.is_empty() { 1e4 } else { near.iter().sum::<f32>() / near.len() as f32 };
    (radius, cells)
}

/// Returns the radiance of a vertex of rock: Lambert, as in `src/engine/cpu/opaque.rs`.
fn radiance(scene: &Scene, vertex: &Vertex) -> Vec3 {
    let n = Vec3::from(vertex.normal);
    let surroundings = scene.environment.as_ref().map_or(Vec3::ZERO, |e| e.irradiance.at(n));
    let mut irradiance = (scene.ambient + surroundings) * (1.0 - vertex.occlusion);
    for (i, light) in scene.lights.iter().enumerate() {
        let (to_light, intensity) = light.at(vertex.position.into());
        let lit = if scene.shadow_light() == Some(i) { 1.0 - vertex.shadow } else { 1.0 };
        irradiance += intensity * (lit * n.dot(to_light).max(0.0));
    }
    Vec3::from(vertex.albedo) * irradiance
}

/// Composites falling water over the cells.
fn add_water(scene: &Scene, mesh: &Mesh, middle: Vec3, cells: &mut [[f32; 4]]) {
    let solid_angle = std::f32::consts::TAU / cells.len() as f32;
    let mut sky = scene.ambient;
    if let Some(environment) = &scene.environment {
        sky += environment.irradiance.at(Vec3::Y);
    }
    let lights = scene.lights.iter().map(|light| light.at(middle).1 * WATER_REFLECTANCE);
    let lights: Vec<Vec3> = lights.collect();
    let sun = scene.shadow_light().map_or(Vec3::ZERO, |i| lights[i]);
    let white = lights.iter().fold(sky, |sum, light| sum + *light);
    let mut cover = vec![0.0f32; cells.len()];
    // Light that shade takes from the water in each cell.
    let mut lost = vec![Vec3::ZERO; cells.len()];
    for (i, quad) in scene.quads.iter().enumerate().filter(|(_, quad)| quad.mist == 0.0) {
        let shade = mesh.on_water.get(i).copied().unwrap_or_default();
        let [occlusion, shadow] = [shade.occlusion, shade.shadow].map(|all| all.iter().sum::<f32>() / 4.0);
        let dark = sky * occlusion + sun * shadow;
        let Quad { corners: [a, b, c, d], erosion, tear, .. } = quad;
        let area = (*c - *a).cross(*d - *b).length() * 0.5 / (POINTS * POINTS) as f32;
        let whole = 1.0 - tear.open.map(tear::mean).iter().sum::<f32>() / 2.0;
        let share_left = (1.0 - erosion.iter().sum::<f32>() / 4.0).clamp(0.0, 1.0) * whole;
        for i in 0..POINTS * POINTS {
            let u = ((i % POINTS) as f32 + 0.5) / POINTS as f32;
            let v = ((i / POINTS) as f32 + 0.5) / POINTS as f32;
            let away = a.lerp(*b, u).lerp(d.lerp(*c, u), v) - middle;
            let distance = away.length().max(1e-3);
            if let Some(cell) = cell(away / distance) {
                let facing = away.dot(quad.map.n_world).abs() / distance;
                let more = share_left * area * facing / (distance * distance * solid_angle);
                cover[cell] += more;
                lost[cell] += dark * more;
            }
        }
    }
    for ((cell, cover), lost) in cells.iter_mut().zip(cover).zip(lost) {
        let white = white - lost / cover.max(1e-30);
        let cover = cover.min(WATER_COVER);
        let [r, g, b, behind] = *cell;
        let mixed = Vec3::new(r, g, b) * (1.0 - cover) + white * cover;
        *cell = mixed.extend(behind + (1.0 - behind) * cover).to_array();
    }
}
