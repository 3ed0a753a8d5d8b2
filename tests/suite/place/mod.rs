//! Rock and pools: closed forms (float64) of their shading, wetness and reflection, and parity of the
//! engines.

pub mod mesh_shade;
pub mod paint;
pub mod pool_field;
pub mod stone;
pub mod tiles;
pub mod triangles;
pub mod water_shade;

use std::f32::consts::PI;
use std::path::Path;

use crate::engine::gpu::{SURFACE, assert_parity, both, renderer};
use crate::tolerance::{Parity, close};
use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x8};
use glam::Vec3;
use taki::engine::RenderOptions;
use taki::engine::cpu::integrate::Lanes;
use taki::engine::cpu::{self, gbuffer, opaque, pool};
use taki::engine::pool_surface::{Surface, WAVES, surfaces, turns};
use taki::picture::Frame;
use taki::place::{Mesh, Vertex, wet_albedo, wetness};
use taki::scene::{Limits, Scene};
use taki::util::lanes::Lanes3;
use taki::util::monitor::Unwatched;
use taki::util::window::Window;
use tempfile::tempdir;

fn read(text: &str) -> Result<Scene, String> {
    let folder = tempdir().expect("a folder");
    let path = folder.path().join("s.toml");
    std::fs::write(&path, format!("version = 1\n{text}")).expect("written");
    Scene::load(&path, &[], &Limits::default()).map_err(|e| e.to_string())
}

fn of(text: &str) -> Scene {
    read(text).expect("a valid scene")
}

/// A smooth floor of 20 m × 20 m around the origin, with a wall of height 4 m on its line x = 0 that faces
/// +x.
fn floor_and_wall(more: &str) -> Scene {
    floor_and_wall_with(more, "")
}

/// The same with `rest` in the scene.
fn floor_and_wall_with(more: &str, rest: &str) -> Scene {
    let rock = "amplitude = 0.0\nlevels = 7\ncavity = 0.0\ncolor_noise = 0.0\n";
    of(&format!(
        "[rocks.floor]\ncorners = [[-10,0,10],[10,0,10],[10,0,-10],[-10,0,-10]]\n{rock}{more}\n\
         [rocks.wall]\ncorners = [[0,0,40],[0,0,-40],[0,4,-40],[0,4,40]]\n{rock}{more}\n\
         [lights.sun]\ndirection = [-1, 1, 0]\n{rest}"
    ))
}

fn rock_of(scene: &Scene, name: &str) -> Vec<Vertex> {
    let mut first = 0;
    for rock in &scene.rocks {
        let count = rock.vertex_count() as usize;
        if rock.name == name {
            return scene.mesh().vertices[first..first + count].to_vec();
        }
        first += count;
    }
    panic!("no rock {name}")
}

#[test]
fn a_wall_hides_of_the_sky_what_its_form_factor_says() {
    let floor = rock_of(&floor_and_wall("occlusion = 1.0"), "floor");
    let mut seen = 0;
    for vertex in floor {
        let [x, _, z] = vertex.position;
        if (0.8..6.0).contains(&x) && z.abs() < 3.0 {
            // Share of an endless wall (Howell, Mengüç, Daun and Siegel 2020, A-1): ½(1 − x/√(x² + h²)).
            let truth = 0.5 * (1.0 - x / (x * x + 16.0).sqrt());
            // Each of the 48 directions that meets the wall's edge weighs up to 1/24, and two or three may do
            // so at once.
            assert!((vertex.occlusion - truth).abs() < 0.06, "{x} {z}: {} {truth}", vertex.occlusion);
            seen += 1;
        }
    }
    assert!(seen > 500);
}

#[test]
fn a_wall_throws_a_shadow_as_long_as_it_is_high_when_the_sun_stands_at_45_degrees() {
    let floor = rock_of(&floor_and_wall("shadow = 0.7"), "floor");
    let (mut dark, mut light) = (0, 0);
    for vertex in floor {
        let [x, _, z] = vertex.position;
        // A cell of the map is 8 cm here, and the point that is looked up lies 1½ cells off the floor.
        if z.abs() < 9.0 && (0.5..3.6).contains(&x) {
            assert!((vertex.shadow - 0.7).abs() < 1e-6, "{x} {z}: {}", vertex.shadow);
            dark += 1;
        } else if z.abs() < 9.0 && !(-0.5..4.4).contains(&x) {
            assert_eq!(vertex.shadow, 0.0, "{x} {z}");
            light += 1;
        }
    }
    assert!(dark > 1000 && light > 1000);
}

#[test]
fn without_occlusion_shadow_and_water_nothing_is_shaded_or_wet() {
    let scene = Scene::load("fig5".as_ref(), &[], &Limits::default()).expect("a preset");
    let plain = |v: &Vertex| (v.occlusion, v.shadow, v.wet, v.pool) == (0.0, 0.0, 0.0, 0);
    assert!(scene.mesh().vertices.iter().all(plain));
}

#[test]
fn a_film_sends_back_what_gets_out_after_all_its_inner_reflections() {
    for dry in [0.0f64, 0.01, 0.08, 0.3, 0.7, 1.0] {
        let inside = 1.0 - (1.0 - 0.066) / (1.33 * 1.33);
        let mut on_rock = 0.98;
        let mut sum = 0.0;
        for _ in 0..2000 {
            sum += on_rock * dry * (1.0 - inside);
            on_rock *= dry * inside;
        }
        let wet = f64::from(wet_albedo(Vec3::splat(dry as f32)).x);
        // The constants of the film have three digits.
        assert!(close(wet, sum, 5e-3, 1e-9), "{dry}: {wet} {sum}");
        assert!(wet < dry || dry == 0.0);
    }
}

#[test]
fn rock_is_wet_by_its_distance_from_water_and_four_times_as_far_down() {
    let scene = of(
        "[rocks.wall]\ncorners = [[-5,-5,0],[5,-5,0],[5,5,0],[-5,5,0]]\namplitude = 0.0\ncolor_noise = 0.0\n\
         cavity = 0.0\ncolor = [0.2,0.2,0.2]\nwet = 0.8\nwet_reach = 1.0\n[materials.water]\n[[quads]]\n\
         corners = [[-1,1,0.2],[1,1,0.2],[1,-1,0.2],[-1,-1,0.2]]\n",
    );
    for vertex in rock_of(&scene, "wall") {
        let [x, y, _] = vertex.position;
        let across = (x.abs() - 1.0).max(0.0);
        let (above, below) = ((y - 1.0).max(0.0), (-1.0 - y).max(0.0));
        let metres = (0.04 + across * across + above * above + (below / 4.0).powi(2)).sqrt();
        let truth = 0.8 * wetness(metres, 1.0);
        assert!((vertex.wet - truth).abs() < 1e-4, "{x} {y}: {} {truth}", vertex.wet);
        let albedo = 0.2 + (wet_albedo(Vec3::splat(0.2)).x - 0.2) * truth;
        assert!((vertex.albedo[0] - albedo).abs() < 1e-4);
    }
    assert_eq!((wetness(0.0, 2.0), wetness(1.0, 2.0), wetness(2.0, 2.0)), (1.0, 0.5, 0.0));
}

fn wall(more: &str) -> Vec<Vertex> {
    let text = "[rocks.wall]\ncorners = [[-5,-5,0],[5,-5,0],[5,5,0],[-5,5,0]]\nseed = 3\n";
    rock_of(&of(&format!("{text}{more}")), "wall")
}

#[test]
fn ridges_never_stand_higher_than_where_their_field_is_zero() {
    let top = (2.0 / PI).sqrt() * 1.5;
    let heights: Vec<f32> = wall("ridges = 1.0\namplitude = 1.5").iter().map(|v| v.position[2]).collect();
    let highest = heights.iter().fold(f32::MIN, |a, b| a.max(*b));
    assert!(highest <= top + 1e-5 && highest > 0.98 * top, "{highest} {top}");
    assert!(wall("amplitude = 1.5").iter().any(|v| v.position[2] > top));
}

#[test]
fn beds_lie_level_or_as_they_are_tilted() {
    let side = 129;
    // Variance of the means along rows (level lines) and along columns.
    let variances = |tilt: f32| {
        let rock = wall(&format!("amplitude = 0.0\nstrata = 1.0\nstrata_height = 1.0\nstrata_tilt = {tilt}"));
        let mean = |of: &dyn Fn(usize, usize) -> usize| -> f32 {
            let means: Vec<f32> = (0..side)
                .map(|i| (0..side).map(|j| rock[of(i, j)].position[2]).sum::<f32>() / side as f32)
                .collect();
            let middle = means.iter().sum::<f32>() / side as f32;
            means.iter().map(|m| (m - middle).powi(2)).sum::<f32>()
        };
        [mean(&|i, j| i * side + j), mean(&|i, j| j * side + i)]
    };
    let ([rows, columns], [turned_rows, turned_columns]) = (variances(0.0), variances(90.0));
    assert!(rows > 2.0 * columns, "{rows} {columns}");
    assert!(turned_columns > 2.0 * turned_rows, "{turned_rows} {turned_columns}");
}

#[test]
fn a_border_is_no_straight_line_but_keeps_its_corners() {
    let rock = wall("amplitude = 0.0\nborder = 0.5");
    let lowest = &rock[..129];
    let off = lowest.iter().map(|v| (v.position[1] + 5.0).abs()).fold(0.0, f32::max);
    assert!(off > 0.2, "{off}");
    assert_eq!((lowest[0].position, lowest[128].position), ([-5.0, -5.0, 0.0], [5.0, -5.0, 0.0]));
}

const POOL: &str = "[pools.p]\ncorners = [[-9,0,9],[9,0,9],[9,0,-9],[-9,0,-9]]\n";
const VIEW: &str = "[camera]\neye = [0.5, 3, 12]\ntarget = [0, 0, 0]\n\
     [image]\nwidth = 64\nheight = 48\nsamples = 1\n\
     [background]\nzenith = [0.1, 0.4, 1.0]\nhorizon = [0.9, 0.7, 0.5]\n";

/// Radiance and depth, and coordinates, of every pixel that shows the pool.
fn pixels(scene: &Scene) -> Vec<([f32; 4], [u32; 2])> {
    let targets = gbuffer::run(scene, &scene.mesh(), 0);
    let place = |i: usize| [i as u32 % 64, i as u32 / 64];
    let all = targets.opaque.iter().enumerate().filter(|(_, o)| o[3] > 0.0);
    all.map(|(i, o)| (*o, place(i))).collect()
}

#[test]
fn a_still_pool_without_light_mirrors_the_background_by_fresnels_share() {
    let scene = of(&format!("{POOL}height = 0.0\n{VIEW}[light]\nambient = [0,0,0]\n"));
    let pixels = pixels(&scene);
    assert!(pixels.len() > 500);
    for (seen, pixel) in pixels {
        let d = scene.camera.view_ray(64, 48, pixel, [0.5, 0.5]).as_dvec3();
        let share = 0.02 + 0.98 * (1.0 + d.y).powi(5);
        for c in 0..3 {
            let (zenith, horizon) = (scene.background.zenith[c], scene.background.horizon[c]);
            let truth = share * (f64::from(horizon) - f64::from(zenith - horizon) * d.y);
            assert!(close(f64::from(seen[c]), truth, 1e-4, 0.0), "{pixel:?} {seen:?} {truth}");
        }
    }
}

#[test]
fn below_the_surface_light_fades_with_depth() {
    for depth in [0.1f64, 1.0, 30.0] {
        let text = format!(
            "{POOL}height = 0.0\nfoam = 0.0\ndepth = {depth}\ncolor = [0.02,0.03,0.04]\n\
             bottom = [0.3,0.2,0.1]\nabsorption = [2.0,0.5,0.1]\n[light]\nambient = [1,1,1]\n\
             [camera]\neye = [0,3,4]\ntarget = [0,0,0]\n\
             [image]\nwidth = 64\nheight = 48\nsamples = 1\n"
        );
        let scene = of(&text);
        for (seen, pixel) in pixels(&scene).into_iter().step_by(37) {
            let d = scene.camera.view_ray(64, 48, pixel, [0.5, 0.5]).as_dvec3();
            let through = 1.0 - (0.02 + 0.98 * (1.0 + d.y).powi(5));
            for (c, (color, bottom, absorption)) in
                [(0.02, 0.3, 2.0), (0.03, 0.2, 0.5), (0.04, 0.1, 0.1f64)].into_iter().enumerate()
            {
                let t = (-2.2 * depth * absorption).exp();
                let truth = through * (color * (1.0 - t) + bottom * t);
                assert!(close(f64::from(seen[c]), truth, 1e-3, 1e-6), "{depth} {seen:?} {truth}");
            }
        }
    }
}

#[test]
fn sin_turns_is_the_sine() {
    for i in -4000..4000 {
        let t = i as f32 * 0.000_977;
        let sines: [f32; 8] =
            dispatch!(Level::new(), simd => pool::sin_turns(simd, f32x8::splat(simd, t)).into());
        let truth = (f64::from(t) * std::f64::consts::TAU).sin();
        assert!((f64::from(sines[0]) - truth).abs() < 5e-5, "{t}");
    }
}

fn surface(scene: &Scene) -> Surface {
    surfaces(scene, &Mesh::default())[0]
}

#[test]
fn waves_have_the_variance_that_is_asked_for_and_close_with_the_flow() {
    let at =
        |flow: f32| surface(&of(&format!("{POOL}height = 0.05\nperiod = 3.0\n[volume]\nflow = {flow}\n")));
    let still = at(0.0);
    let variance: f64 = still
        .waves
        .iter()
        .filter(|w| w.k > 0.0)
        .map(|w| (f64::from(w.slope / w.k) / std::f64::consts::TAU).powi(2) / 2.0)
        .sum();
    assert!(close(variance.sqrt(), 0.05, 1e-5, 0.0), "{variance}");
    assert!(still == at(1.0) && still == at(7.0), "whole lengths of flow change nothing");
    assert!(still != at(0.5));
    for (a, b) in still.waves.iter().zip(at(0.125).waves).filter(|(a, _)| a.k > 0.0) {
        let moved = (a.phase - b.phase - 0.125 * turns(1.0 / a.k, 3.0)).rem_euclid(1.0);
        assert!(moved.min(1.0 - moved) < 1e-4, "{a:?}");
    }
    // A wave of 1 m makes √(9.81·2π)/2π = 1.249 turns a second.
    assert_eq!((turns(1.0, 10.0), turns(1.0, 0.01)), (12.0, 1.0));
}

#[test]
fn foam_is_where_water_falls_in_and_rings_run_from_there() {
    let fall = "[[quads]]\ncorners = [[-1,4,-2],[1,4,-2],[1,-1,-2],[-1,-1,-2]]\n";
    let scene = of(&format!("{POOL}foam = 0.8\nfoam_reach = 2.0\ndepth = 1.0\n{fall}"));
    for vertex in scene.mesh().vertices.iter() {
        let [x, _, z] = vertex.position;
        let metres = ((x.abs() - 1.0).max(0.0).powi(2) + (z + 2.0).powi(2)).sqrt();
        let near = (1.0 - metres / 2.0).clamp(0.0, 1.0);
        let truth = 0.8 * near * near * (3.0 - 2.0 * near);
        assert!((vertex.albedo[1] - truth).abs() < 1e-4 && vertex.albedo[0] == 1.0, "{vertex:?}");
    }
    let rings: Vec<_> = surface(&scene).waves.into_iter().filter(|w| w.ring == 1.0).collect();
    assert!(rings.len() == 2 && rings.iter().all(|w| w.toward == [0.0, -2.0]), "{rings:?}");
    let dry = of(&format!("{POOL}{}", fall.replace("-1,-2", "1,-2")));
    assert!(surface(&dry).waves.iter().all(|w| w.ring == 0.0), "this quad ends above the pool");
    assert_eq!(surface(&dry).waves.len(), WAVES);
}

#[test]
fn a_pool_between_black_walls_mirrors_less_than_one_under_the_sky() {
    let walls = "[rocks.back]\ncorners = [[-20,0,-9],[20,0,-9],[20,15,-9],[-20,15,-9]]\ncolor = [0,0,0]\n";
    let mean = |text: String| {
        let scene = of(&text);
        let targets = gbuffer::run(&scene, &scene.mesh(), 0);
        let water: Vec<f32> = targets.opaque[64 * 40..].iter().filter(|o| o[3] > 0.0).map(|o| o[0]).collect();
        water.iter().sum::<f32>() / water.len() as f32
    };
    let (open, closed) = (mean(format!("{POOL}{VIEW}")), mean(format!("{POOL}{walls}{VIEW}")));
    assert!(closed < 0.3 * open, "{closed} {open}");
}

/// One lane of [`opaque::film_lobe`].
fn lobe(n: Vec3, l: Vec3, e: Vec3) -> f32 {
    let lobes: [f32; 8] = dispatch!(Level::new(), simd => {
        let [n, l, e] = [n, l, e].map(|v| Lanes3::splat(simd, v));
        opaque::film_lobe(simd, n, l, e).into()
    });
    lobes[0]
}

#[test]
fn the_lobe_of_a_film_sends_back_no_more_than_fresnel_allows() {
    let n = Vec3::Y;
    for degrees in [0.0f32, 30.0, 60.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let l = Vec3::new(sin, cos, 0.0);
        // The mean of the lobe over all views. Its light is π times the irradiance.
        let (mut sum, count) = (0.0f64, 400);
        for i in 0..count {
            for j in 0..count {
                let (y, a) = ((i as f32 + 0.5) / count as f32, (j as f32 + 0.5) / count as f32 * 2.0 * PI);
                let r = (1.0 - y * y).sqrt();
                sum += f64::from(lobe(n, l, Vec3::new(r * a.cos(), y, r * a.sin())) * y);
            }
        }
        let share = 2.0 * sum / f64::from(count * count);
        // The lobe uses (s + 8)/8π instead of the exact (s + 2)(s + 4)/8π(s + 2^(−s/2)).
        let normalised = 40.0 / 38.25;
        let fresnel = 0.02 + 0.98 * (1.0 - f64::from(cos)).powi(5);
        assert!(share < 1.001 * normalised * fresnel, "{degrees}: {share}");
        if degrees == 0.0 {
            assert!(close(share, 0.02 * normalised, 0.02, 0.0), "{share}");
        }
    }
}

fn small(more: &str) -> Scene {
    small_seen_from("[0.3,1.5,9]", "[0,0.4,0]", more)
}

fn small_seen_from(eye: &str, target: &str, more: &str) -> Scene {
    let rock =
        "levels = 3\nstrata = 0.5\nridges = 0.5\nborder = 0.3\nwet = 1.0\nocclusion = 0.9\nshadow = 0.9\n";
    of(&format!(
        "[pools.p]\ncorners = [[-6,0,6],[6,0,6],[6,0,-4],[-6,0,-4]]\n\
         [rocks.a]\ncorners = [[-6,-1,-3],[6,-1,-3],[6,4,-4],[-6,4,-4]]\n{rock}\
         [rocks.b]\ncorners = [[2,-1,1],[4,-1,1],[4,2,-3],[2,2,-3]]\n{rock}\
         [materials.water]\n[[quads]]\ncorners = [[-1,4,-2],[1,4,-2],[1,-0.5,-1.5],[-1,-0.5,-1.5]]\n\
         [volume]\nnx = 16\nny = 16\nnz = 8\n[light]\nambient = [0.2,0.25,0.3]\n\
         [lights.lamp]\nkind = \"point\"\nposition = [3,4,5]\nintensity = 9.0\n\
         [lights.sun]\ndirection = [-0.5,1,0.4]\nintensity = 2.0\n\
         [camera]\neye = {eye}\ntarget = {target}\n[image]\nwidth = 96\nheight = 64\nsamples = 2\n\
         [background]\nzenith = [0.1,0.3,0.8]\nhorizon = [0.7,0.8,0.9]\n{more}"
    ))
}

#[test]
fn the_engines_agree_on_pools_and_on_wet_and_shaded_rock() {
    let Some(mut renderer) = renderer("place") else { return };
    for more in ["", "[environment]\nkind = \"sky\"\nlights = 3\n"] {
        // The first view is far off and without foam, because there a pixel holds several of the triangles
        // that it interpolates, and the engines' interpolations differ by more than their shading may. Its
        // picture is larger, so that fewer pixels lie on the shore. The second view is near the water.
        let mut scene = small(more);
        scene.edit().pools[0].foam = 0.0;
        (scene.edit().image.width, scene.edit().image.height) = (192, 128);
        assert_parity(more, &both(&mut renderer, &scene));
        let scene = small_seen_from("[0.3,1.5,0.6]", "[0,0,-1]", more);
        assert!(scene.pools[0].foam > 0.0);
        assert_parity(more, &both(&mut renderer, &scene));
    }
}

#[test]
fn where_only_waves_move_the_kept_place_has_the_bits_of_one_drawn_anew() {
    let Some(mut keeping) = renderer("waves") else { return };
    let Some(mut fresh) = renderer("waves") else { return };
    let options = RenderOptions { keep_rasters: 64 << 20, ..SURFACE };
    // One sheet, two sheets behind one another, and an environment.
    let behind = "[[quads]]\ncorners = [[-1,4,-2.4],[1,4,-2.4],[1,-0.5,-1.9],[-1,-0.5,-1.9]]\n";
    for (more, layers) in [("", 1), (behind, 2), ("[environment]\nkind = \"sky\"\nlights = 3\n", 1)] {
        let scene = small(more);
        assert_eq!(taki::engine::overlap::sheets(&scene), layers);
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let mesh = scene.mesh();
        let mut pictures: Vec<Vec<[f32; 4]>> = Vec::new();
        for (flow, height) in
            [(0.0, 1.0), (0.1, 1.0), (0.2, 1.0), (0.2, 1.0), (0.3, 1.0), (0.3, 2.0), (0.0, 1.0)]
        {
            let mut scene = scene.clone();
            scene.edit().recipes[0].flow = flow;
            scene.edit().wave_flow = flow;
            scene.edit().pools[0].height *= height;
            let kept = keeping.render(&scene, &volume, &mesh, &options, &Unwatched).expect("a frame");
            let drawn = fresh.render(&scene, &volume, &mesh, &SURFACE, &Unwatched).expect("a frame");
            assert!(kept.radiance == drawn.radiance && kept.surface == drawn.surface, "{more} {flow}");
            pictures.push(kept.radiance);
        }
        let moved = |a: usize, b: usize| pictures[a] != pictures[b];
        assert!(moved(1, 2) && moved(2, 4) && moved(4, 5) && !moved(2, 3) && !moved(0, 6));
    }
}

#[test]
fn no_rock_in_view_is_left_out_wherever_the_eye_is() {
    let Some(mut renderer) = renderer("in view") else { return };
    let options = SURFACE;
    let views = [
        ("[0.3,1.5,9]", "[0,0.4,0]", 50.0),
        ("[0,1.5,0]", "[-1,1.2,-3]", 120.0),
        ("[2.9,0.3,-1]", "[3,-4,-1.2]", 90.0),
        ("[0,30,40]", "[0,0,0]", 4.0),
        ("[-5.9,0.2,-3.2]", "[6,0.5,-3.6]", 100.0),
        ("[0,1,-9]", "[0.1,0.5,3]", 60.0),
    ];
    for (eye, target, fov) in views {
        let mut scene = small_seen_from(eye, target, "");
        // The larger of the two rocks has 32,768 triangles in 97 parts.
        scene.edit().rocks.iter_mut().for_each(|rock| rock.levels = 7);
        scene.edit().camera.tan_half_fov = (0.5 * f32::to_radians(fov)).tan();
        scene.edit().image.samples = 1;
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let mesh = scene.mesh();
        let on_gpu = renderer.render(&scene, &volume, &mesh, &options, &Unwatched).expect("a frame");
        let on_cpu = cpu::render(&scene, &volume, &mesh, true, &Unwatched).expect("a frame");
        let far = |frame: &Frame| frame.surface.as_ref().expect("asked for").depth.clone();
        let (a, b) = (far(&on_gpu), far(&on_cpu));
        // Rounding may give a pixel on a silhouette to what lies behind it. A part covers hundreds of pixels.
        let parity = Parity::of_adapter();
        let near = |a: f32, b: f32| (a - b).abs() <= parity.relative * b.abs().max(0.1);
        let differ = a.iter().zip(&b).filter(|(a, b)| !near(**a, **b)).count();
        let share = if parity.is_coarse() { parity.share } else { 0.995 };
        let same = 1.0 - differ as f64 / a.len() as f64;
        assert!(same >= share, "{eye} to {target}: {differ} of {} pixels", a.len());
        assert!(b.iter().filter(|d| **d > 0.0).count() * 10 > b.len(), "{eye}: rock is seen");
    }
}

#[test]
fn parity_can_fail_where_a_pool_is_another_on_one_engine() {
    let Some(mut renderer) = renderer("place") else { return };
    let [a, _] = both(&mut renderer, &small(""));
    let mut other = small("");
    other.edit().pools[0].seed = 2;
    let [_, b] = both(&mut renderer, &other);
    assert!(std::panic::catch_unwind(|| assert_parity("another", &[a, b])).is_err());
}

#[test]
fn what_is_no_pool_is_refused_with_what_to_do() {
    let corners = |c: &str| format!("[pools.p]\ncorners = {c}\n");
    let level = "[[-9,0,9],[9,0,9],[9,0,-9],[-9,0,-9]]";
    let many: String = (0..9).map(|i| format!("[pools.p{i}]\ncorners = {level}\n")).collect();
    let cases = [
        ("[pools.p]\nfoam = 0.5\n".into(), ["pools.p has no corners", "four points at one height"]),
        (
            corners("[[-9,0,9],[9,0,9],[9,1,-9],[-9,1,-9]]"),
            ["pool p (pools.p.corners) is not level", "one height"],
        ),
        (corners("[[-9,0,-9],[9,0,-9],[9,0,9],[-9,0,9]]"), ["faces down", "counter-clockwise"]),
        (corners("[[0,0,0],[0,0,0],[9,0,-9],[-9,0,-9]]"), ["has no area", "four corners"]),
        (corners("[[-9,0,9],[9,0,9],[-5,0,5],[-9,0,-9]]"), ["is not convex", "convex"]),
        (format!("{}color = [2,0,0]\n", corners(level)), ["pools.p.color", "at most 1"]),
        (format!("{}bottom = [0,2,0]\n", corners(level)), ["pools.p.bottom", "at most 1"]),
        (many, ["9 pools", "at most 8"]),
    ];
    for (text, words) in cases {
        let told = read(&text).expect_err(&text);
        words.iter().for_each(|word| assert!(told.contains(word), "{word}: {told}"));
        assert_eq!(told.lines().count(), 1);
    }
}

#[test]
fn targets_have_the_same_bits_with_each_instruction_set() {
    let sets = |more: &[&str]| -> Vec<String> {
        let own = ["image.width=93", "image.height=52"];
        own.iter().chain(more).map(|set| set.to_string()).collect()
    };
    // Rock, pools and haze; spot lights; an environment; holes.
    let scenes = [
        ("waterfall", sets(&["haze.density=0.02", "haze.scale_height=3"])),
        ("night", sets(&[])),
        ("evening", sets(&[])),
        ("waterfall", sets(&["image.alpha=true", "rocks.bed.show=holdout"])),
    ];
    for (preset, sets) in scenes {
        let scene = Scene::load(Path::new(preset), &sets, &Limits::default()).expect("a scene");
        let (mesh, window) = (scene.mesh(), Window { x: 3, y: 5, width: 83, height: 41 });
        for sample in [0, 2] {
            let mut all = Lanes::all().into_iter().filter_map(|(name, lanes)| match lanes {
                Lanes::Lockstep(level) => Some((name, level)),
                Lanes::Scalar => None,
            });
            let (first, level) = all.next().expect("an instruction set");
            let one = gbuffer::run_on(level, &scene, &mesh, window, sample);
            assert!(one.opaque.iter().any(|seen| seen[3] > 0.0) && one.quad_id.iter().any(|id| *id > 0));
            for (name, level) in all {
                let other = gbuffer::run_on(level, &scene, &mesh, window, sample);
                let what = format!("{preset}, sample {sample}: {first} and {name}");
                assert_eq!(one.opaque, other.opaque, "{what}");
                assert_eq!(one.normal, other.normal, "{what}");
                assert!(one.surface == other.surface && one.quad_id == other.quad_id, "{what}");
            }
        }
    }
}
