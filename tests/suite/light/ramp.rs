//! §5 Colours of a volume's cells.

use glam::Vec3;
use taki::engine::cpu::integrate::Integrator;
use taki::light::ramp::Ramp;
use taki::light::{Light, Visibility};
use taki::mapping::{Material, Quad};
use taki::scene::Scene;
use taki::trace::Attenuation;
use taki::volume::{Cell, Moments, VolumeTexture, coarse_levels};

const COLORS: [Vec3; 4] =
    [Vec3::new(0.9, 0.1, 0.2), Vec3::new(0.3, 0.7, 0.0), Vec3::new(0.0, 0.2, 0.8), Vec3::new(1.0, 0.9, 0.6)];

#[test]
fn colours_stand_at_equal_distances_on_the_ramp() {
    for count in 1..=4usize {
        let ramp = Ramp::new(&COLORS[..count], 0.4);
        for (i, color) in COLORS[..count].iter().enumerate() {
            let code = 255.0 * i as f32 / (count.max(2) - 1) as f32;
            let ink = ramp.ink(code);
            assert!((ink.color - *color).abs().max_element() < 1e-6, "{i} of {count}: {ink:?}");
            let k_s = if count == 1 { code } else { 102.0 };
            assert!((ink.k_s - k_s).abs() < 1e-4, "{i} of {count}: {ink:?}");
        }
    }
    let between = Ramp::new(&COLORS[..2], 0.4).ink(0.25 * 255.0).color;
    assert!((between - COLORS[0].lerp(COLORS[1], 0.25)).abs().max_element() < 1e-6);
    assert_eq!(Ramp::new(&[], 0.3), Ramp::WHITE);
}

/// A quad of 2 m × 3 m in front of a light, without shadows, and a volume of equal cells.
fn lit_by(ramp: Ramp, ambient: Vec3, to_light: Vec3) -> (Scene, Vec3) {
    let mut scene = Scene::preset("front").expect("a preset");
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let corners = [corner(0.0, 0.0), corner(2.0, 0.0), corner(2.0, 3.0), corner(0.0, 3.0)];
    let material =
        Material { thickness_m: 0.4, repeat_u: 1.0, repeat_v: 1.0, volume: 0, billow: Default::default() };
    let intensity = Vec3::new(1.0, 0.7, 0.4);
    let parts = scene.edit();
    parts.quads = vec![Quad::new(corners, material).expect("a quad")];
    parts.lights = vec![Light::Directional { to_light, intensity }];
    parts.ambient = ambient;
    parts.visibility = Visibility::None;
    parts.p = 6.0;
    parts.trace.attenuation = Attenuation::PathLength { sigma: 5.0 };
    parts.trace.early_end = 0.0;
    parts.recipes[0].ramp = ramp;
    (scene, intensity)
}

#[test]
fn a_cell_reflects_diffuse_and_ambient_light_in_its_colour_and_highlights_in_that_of_the_light() {
    let (rho, k_d, place) = (0.6f32, 0.8f32, 0.4f32);
    let cell = Cell::from_direction(Vec3::Y).with_density(rho, k_d, place);
    let volume = VolumeTexture { size: [4, 4, 4], alpha: 1.0, cells: vec![cell; 64].into() };
    let ambient = Vec3::new(0.1, 0.2, 0.3);
    let to_light = Vec3::new(0.3, 0.5, 0.8).normalize();
    let ramp = Ramp::new(&COLORS, 0.7);
    let (scene, intensity) = lit_by(ramp, ambient, to_light);
    let seen = Integrator::new(&scene, &volume).trace(0, -Vec3::Z, [0.4, 0.6, 3.0], Vec3::ZERO, &mut ());

    let [rho, k_d, place] = [cell.rho(), cell.k().0, cell.k().1];
    let covered = 1.0 - (-f64::from(5.0 * rho * 0.4)).exp() as f32;
    let color = COLORS[1].lerp(COLORS[2], place * 3.0 - 1.0);
    let sine = (1.0 - to_light.y * to_light.y).sqrt();
    let want =
        covered * (ambient * color + intensity * (color * (k_d * sine) + Vec3::splat(0.7 * sine.powi(6))));
    assert!((seen.radiance - want).abs().max_element() < 1e-4, "{:?} not {want:?}", seen.radiance);

    // A single colour leaves each cell its own k_s.
    let (scene, _) = lit_by(Ramp::new(&COLORS[..1], 0.7), ambient, to_light);
    let seen = Integrator::new(&scene, &volume).trace(0, -Vec3::Z, [0.4, 0.6, 3.0], Vec3::ZERO, &mut ());
    let own = COLORS[0] * (k_d * sine) + Vec3::splat(place * sine.powi(6));
    let want = covered * (ambient * COLORS[0] + intensity * own);
    assert!((seen.radiance - want).abs().max_element() < 1e-4, "{:?} not {want:?}", seen.radiance);
}

#[test]
fn coarse_cells_have_the_mean_colour_of_their_cells() {
    // Places between two neighbouring colours, where the ramp is a straight line.
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 16_777_216.0
    };
    let cells: Vec<Cell> = (0..512)
        .map(|_| Cell::from_direction(Vec3::Y).with_density(next(), 0.5, 0.34 + 0.32 * next()))
        .collect();
    let volume = VolumeTexture { size: [8, 8, 8], alpha: 1.0, cells: cells.clone().into() };
    let ramp = Ramp::new(&COLORS, 0.7);
    let color = |cell: &Cell| ramp.ink(cell.k_codes().1 as f32).color;
    let weight: f32 = cells.iter().map(|cell| cell.rho()).sum();
    let mean = cells.iter().map(|cell| color(cell) * cell.rho()).sum::<Vec3>() / weight;
    let coarsest = coarse_levels(&volume, 1e-9).pop().expect("coarse levels");
    assert_eq!(coarsest.size, [1, 1, 1]);
    let cell = coarsest.cells[0];
    assert!((color(&cell) - mean).abs().max_element() < 0.01, "{:?} not {mean:?}", color(&cell));
    assert!(Moments::unpacked(cell.y).diagonal.y > 0.99);
}
