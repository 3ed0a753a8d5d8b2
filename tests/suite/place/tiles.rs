//! Rock in tiles of different resolution: closed forms of the choice, watertight borders, parity of the
//! engines.

use std::collections::HashMap;

use crate::engine::gpu::{SURFACE, both, renderer, scene};
use crate::tolerance::Parity;
use glam::Vec2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use taki::engine::RenderOptions;
use taki::engine::cpu::{self, gbuffer};
use taki::place::tiles::steps;
use taki::place::{Mesh, Vertex};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::util::window::Window;

/// A grid over [0, size]² at z = 0, raised by `height(column, row)`.
fn grid(squares: u32, size: f32, height: impl Fn(u32, u32) -> f32) -> Mesh {
    let at = |i: u32| size * i as f32 / squares as f32;
    let vertex = |x, y| Vertex {
        position: [at(x), at(y), height(x, y)],
        normal: [0.0, 0.0, 1.0],
        albedo: [0.3; 3],
        ..Vertex::default()
    };
    let rows = (0..=squares).flat_map(|y| (0..=squares).map(move |x| (x, y)));
    Mesh::new(rows.map(|(x, y)| vertex(x, y)).collect(), [(squares, false)])
}

/// A cliff with near and far, smooth and rough parts.
fn cliff(more: &[&str]) -> Scene {
    let mut sets: Vec<&str> = vec![
        "rocks.wall.levels=6",
        "rocks.left.levels=6",
        "rocks.right.levels=5",
        "rocks.far_right.levels=6",
        "rocks.bed.levels=5",
        "rocks.boulder_a.levels=5",
        "rocks.boulder_b.levels=5",
        "rocks.boulder_c.levels=5",
        "rocks.hills.levels=6",
        "image.width=96",
        "image.height=54",
        "image.samples=1",
    ];
    sets.extend(more);
    scene("waterfall", &sets)
}

fn chosen(scene: &Scene, mesh: &Mesh) -> Vec<u32> {
    steps(&mesh.tiles, &scene.camera, &scene.image)
}

/// Random steps; those of neighbours differ by one level at most.
fn random_steps(mesh: &Mesh, random: &mut Pcg64Mcg) -> Vec<u32> {
    let mut steps: Vec<u32> = mesh.tiles.iter().map(|t| t.side.min(1 << random.random_range(0..5))).collect();
    for _ in 0..5 {
        for (i, tile) in mesh.tiles.iter().enumerate() {
            let around = tile.neighbours.iter().flatten().map(|&other| steps[other as usize]);
            steps[i] = steps[i].min(2 * around.min().unwrap_or(16));
        }
    }
    steps
}

#[test]
fn tiles_of_any_steps_cover_their_grid_once_and_leave_no_cracks() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    for squares in [1, 2, 8, 16, 32, 64] {
        let mesh = grid(squares, squares as f32, |_, _| 0.0);
        let mut mixed = 0;
        for _ in 0..40 {
            let steps = random_steps(&mesh, &mut random);
            mixed += usize::from(steps.iter().any(|&step| step != steps[0]));
            let triangles = mesh.triangles(&steps);
            let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
            let mut doubled = 0.0;
            for t in &triangles {
                let [a, b, c] = t.map(|i| Vec2::from_slice(&mesh.vertices[i as usize].position));
                let area = (b - a).perp_dot(c - a);
                assert!(area > 0.0, "a triangle of {squares} squares is turned over: {a} {b} {c}");
                doubled += area;
                for (from, to) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                    *edges.entry((from, to)).or_default() += 1;
                }
            }
            assert_eq!(doubled, 2.0 * (squares * squares) as f32);
            // Every edge occurs once in each direction, except the edges around the grid.
            for (&(from, to), &count) in &edges {
                let side = squares as f32;
                let [a, b] = [from, to].map(|i| Vec2::from_slice(&mesh.vertices[i as usize].position));
                let rim = (a.x == b.x && (a.x == 0.0 || a.x == side))
                    || (a.y == b.y && (a.y == 0.0 || a.y == side));
                let back = edges.get(&(to, from)).copied().unwrap_or(0);
                assert_eq!((count, back), (1, i32::from(!rim)), "{a} to {b} of {squares} squares");
            }
        }
        assert_eq!(mixed > 0, squares > 16, "{squares}");
    }
}

#[test]
fn the_step_is_the_largest_whose_loss_stays_below_the_distance_of_samples() {
    // Every other column stands out by h metres. With step s, s/2 of s + 1 columns are missed by h. The root
    // mean square is h·√(s/(2(s + 1))), which is above h/3, a third of the largest loss.
    let h = 0.01;
    let loss = |s: f64| h * (s / (2.0 * (s + 1.0))).sqrt();
    let mesh = grid(16, 1.0, |x, _| if x % 2 == 1 { h as f32 } else { 0.0 });
    let mut scene = cliff(&[]);
    (scene.edit().image.height, scene.edit().image.samples, scene.edit().image.rock_error) = (1000, 1, 1.0);
    // From far off and along the grid, the loss is f·loss/distance pixels.
    let distance = 1e4;
    scene.edit().camera.eye = glam::DVec3::new(0.5 - distance, 0.5, 0.0);
    scene.edit().camera.forward = glam::DVec3::X;
    let mut step = |lost_pixels: f64, samples: u32, error: f32| {
        // With this focal length, a step of 2 moves points by `lost_pixels`.
        let focal = lost_pixels * distance / loss(2.0);
        scene.edit().camera.tan_half_fov = (500.0 / focal) as f32;
        (scene.edit().image.samples, scene.edit().image.rock_error) = (samples, error);
        chosen(&scene, &mesh)[0]
    };
    let of = |s: f64| loss(2.0) / loss(s);
    assert_eq!(step(1.01, 1, 1.0), 1);
    assert_eq!(step(0.99, 1, 1.0), 2);
    assert_eq!(step(1.01 * of(4.0), 1, 1.0), 2);
    assert_eq!(step(0.99 * of(4.0), 1, 1.0), 4);
    assert_eq!(step(0.99 * of(8.0), 1, 1.0), 8);
    assert_eq!(step(0.99 * of(16.0), 1, 1.0), 16);
    // With four samples, a sample is half as far from the next.
    assert_eq!((step(0.99, 4, 1.0), step(0.505, 4, 1.0), step(0.495, 4, 1.0)), (1, 1, 2));
    assert_eq!((step(1.98, 1, 2.0), step(2.02, 1, 2.0), step(0.99, 1, 0.0)), (2, 1, 1));
    // Seen from straight above, no point moves.
    (scene.edit().image.samples, scene.edit().image.rock_error) = (1, 1.0);
    scene.edit().camera.eye = glam::DVec3::new(0.5, 0.5, distance);
    scene.edit().camera.forward = glam::DVec3::NEG_Z;
    scene.edit().camera.tan_half_fov = (500.0 * loss(2.0) / (4.0 * distance)) as f32;
    assert_eq!(chosen(&scene, &mesh), [16]);
    // A tile that the eye is in or beside is drawn whole.
    scene.edit().camera.eye = glam::DVec3::new(0.5, 0.5, 0.005);
    assert_eq!(chosen(&scene, &mesh), [1]);
}

#[test]
fn one_stone_that_stands_out_alone_is_kept() {
    // One of 289 vertices stands out by 0.3 m. The mean square is small, but a third of the largest loss is
    // not.
    let mesh = grid(16, 1.0, |x, y| if (x, y) == (7, 7) { 0.3 } else { 0.0 });
    let mut scene = cliff(&[]);
    scene.edit().camera.eye = glam::DVec3::new(-1e4, 0.5, 0.0);
    scene.edit().camera.forward = glam::DVec3::X;
    (scene.edit().image.height, scene.edit().image.rock_error) = (1000, 1.0);
    for (pixels, step) in [(2.0, 16), (4.0, 1)] {
        scene.edit().camera.tan_half_fov = 500.0 * 0.3 / (pixels * 1e4);
        assert_eq!(chosen(&scene, &mesh), [step], "{pixels}");
    }
}

#[test]
fn triangles_grow_with_distance_and_all_are_drawn_for_many_samples() {
    let near = cliff(&["image.height=720", "image.width=1280"]);
    let mesh = near.mesh();
    let count = |scene: &Scene| mesh.triangles(&chosen(scene, &mesh)).len();
    let all = mesh.triangles(&vec![1; mesh.tiles.len()]).len();
    let mut far = near.clone();
    let back = far.camera.forward * -200.0;
    far.edit().camera.eye += back;
    let small = cliff(&[]);
    let counts = [&small, &far, &near].map(count);
    assert!(counts[0] < counts[2] && counts[1] < counts[2] && counts[2] <= all, "{counts:?} of {all}");
    let mut many = small.clone();
    many.edit().image.samples = 4096;
    assert_eq!(count(&many), all);
    assert_eq!(count(&cliff(&["image.rock_error=0"])), all);
    // Neighbours differ by one level at most, and pools are drawn whole.
    for scene in [&near, &far, &small] {
        let steps = chosen(scene, &mesh);
        for (i, tile) in mesh.tiles.iter().enumerate() {
            let around = tile.neighbours.iter().flatten();
            assert!(around.clone().all(|&other| steps[i] <= 2 * steps[other as usize]));
            assert!(tile.pool == 0 || steps[i] == 1);
        }
    }
}

#[test]
fn a_place_has_the_values_of_the_vertices_around_it() {
    let mesh = grid(32, 1.0, |_, _| 0.0);
    for tile in mesh.tiles.iter() {
        for corner in tile.triangles(4, [false; 4]) {
            let (numbers, weights) = tile.around(tile.place_of(*corner));
            let whole = (0..3).find(|&i| weights[i] == 1.0).expect("one vertex alone");
            assert_eq!(numbers[whole], tile.vertex_of(*corner));
        }
        let (numbers, weights) = tile.around(Vec2::new(3.75, 5.25));
        assert_eq!(numbers, [[3, 5], [4, 5], [4, 6]].map(|place| tile.vertex(place)));
        assert_eq!(weights.to_array(), [0.25, 0.5, 0.25]);
        let (numbers, weights) = tile.around(Vec2::new(3.25, 5.75));
        assert_eq!(numbers, [[3, 5], [3, 6], [4, 6]].map(|place| tile.vertex(place)));
        assert_eq!(weights.to_array(), [0.25, 0.5, 0.25]);
    }
}

#[test]
fn the_engines_agree_on_rock_of_mixed_steps() {
    let Some(mut renderer) = renderer("tiles") else { return };
    // Foam is left out, because it varies more inside a pixel than the engines interpolate alike.
    let scene = cliff(&["image.rock_error=2", "pools.plunge.foam=0"]);
    let steps = chosen(&scene, &scene.mesh());
    assert!([1, 2, 4].iter().all(|step| steps.contains(step)), "{steps:?}");
    let [a, b] = both(&mut renderer, &scene).map(|frame| frame.surface.expect("asked for"));
    let parity = Parity::of_adapter();
    let near = |a: f32, b: f32| (a - b).abs() <= parity.absolute.max(parity.relative * a.abs().max(b.abs()));
    let same = a.depth.iter().zip(&b.depth).filter(|(a, b)| near(**a, **b)).count();
    assert!(same as f64 >= parity.share * a.depth.len() as f64, "{same} of {}", a.depth.len());
}

#[test]
fn parts_of_a_picture_have_the_bits_of_the_whole_with_mixed_steps() {
    let scene = cliff(&["image.rock_error=2"]);
    let (mesh, volume) = (scene.mesh(), scene.volume(1 << 30, &Unwatched).expect("a volume"));
    let part = Window { x: 20, y: 11, width: 50, height: 30 };
    let whole = gbuffer::run(&scene, &mesh, 0);
    let alone = gbuffer::run_window(&scene, &mesh, part, 0);
    for (i, pixel) in alone.opaque.iter().enumerate() {
        let at = (part.y as usize + i / 50) * 96 + part.x as usize + i % 50;
        assert_eq!((pixel, alone.normal[i]), (&whole.opaque[at], whole.normal[at]));
    }
    let Some(mut renderer) = renderer("parts") else { return };
    let mut draw = |window| {
        let options = RenderOptions { window, ..SURFACE };
        renderer.render(&scene, &volume, &mesh, &options, &Unwatched).expect("a frame")
    };
    let (whole, again, alone) = (draw(None), draw(None), draw(Some(part)));
    assert_eq!(whole.radiance, again.radiance);
    for (i, pixel) in alone.radiance.iter().enumerate() {
        let at = (part.y as usize + i / 50) * 96 + part.x as usize + i % 50;
        assert_eq!(pixel, &whole.radiance[at]);
    }
}

#[test]
fn fewer_triangles_change_the_picture_of_rock_by_less_than_an_eye_finds() {
    let one = |more: &[&str]| {
        let mut sets = vec!["image.width=160", "image.height=90"];
        sets.extend(more);
        let scene = cliff(&sets);
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        cpu::render(&scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame").radiance
    };
    let (all, few) = (one(&["image.rock_error=0"]), one(&[]));
    let mean = |frame: &[[f32; 4]]| {
        frame.iter().map(|p| f64::from(p[0] + p[1] + p[2])).sum::<f64>() / frame.len() as f64
    };
    assert_ne!(all, few);
    // The mean changes by less than a step of eight bits, because the shares of light come from all vertices.
    let (a, b) = (mean(&all), mean(&few));
    assert!((a - b).abs() < a / 256.0, "{a} {b}");
}
