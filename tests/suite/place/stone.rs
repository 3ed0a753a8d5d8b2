//! Kinds of stone: an independent evaluation in float64, what a sample's footprint leaves of them, and parity
//! of the engines.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x8};
use glam::{DVec3, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use taki::engine::cpu::opaque::{Points, View, film_lobe};
use taki::engine::cpu::stone::{stone_at, stone_lobe};
use taki::place::stone::{CRACK, CRACK_SHARE, EDGE, GRADIENT, OCTAVES, Stone};
use taki::place::{Rock, StoneKind};
use taki::scene::Scene;
use taki::util::lanes::{Lanes3, Stored, Stored3};

use super::{of, rock_of, small, small_seen_from};
use crate::engine::gpu::{assert_parity, both, renderer};

const KINDS: [StoneKind; 4] = [StoneKind::Granite, StoneKind::Basalt, StoneKind::Limestone, StoneKind::Slate];

fn wall(more: &str) -> Scene {
    of(&format!("[rocks.a]\ncorners = [[-4,-4,0],[4,-4,0],[4,4,0],[-4,4,0]]\nlevels = 5\n{more}"))
}

fn rock(kind: StoneKind, more: &str) -> Rock {
    wall(&format!("kind = \"{}\"\n{more}", kind.word())).rocks[0].clone()
}

fn stone(kind: StoneKind, more: &str) -> Stone {
    Stone::new(&rock(kind, more), DVec3::ZERO).expect("a stone")
}

/// Lays a stone over eight points of a surface of albedo 0.2, seen from straight above, with samples that
/// are `spacing` metres apart. Returns their albedo and normals.
fn lay(stone: &Stone, points: [Vec3; 8], n: Vec3, spacing: f32) -> [[Vec3; 8]; 2] {
    let (mut albedo, mut normal) = (Stored3::default(), Stored3::default());
    dispatch!(Level::new(), simd => {
        let zero = f32x8::splat(simd, 0.0);
        let normals = Lanes3::splat(simd, n);
        let points = Points {
            position: Stored3::from_fn(|lane| points[lane]).load(simd),
            normal: normals,
            plane: Lanes3::splat(simd, Vec3::ZERO),
            albedo: Lanes3::splat(simd, Vec3::splat(0.2)),
            occlusion: zero,
            shadow: zero,
            wet: zero,
            film: zero,
        };
        let view = View { n: normals, e: normals, distance: f32x8::splat(simd, spacing) };
        let (points, view) = stone_at(simd, stone, &points, &view, 1.0);
        albedo.store(points.albedo);
        normal.store(view.n);
    });
    [albedo, normal].map(|all| std::array::from_fn(|lane| all.get(lane)))
}

/// Simplex noise of deviation 1 with its gradient, on the lattice at the world's origin.
fn noise(p: DVec3) -> (f64, DVec3) {
    let cell = (p + p.element_sum() / 3.0).floor();
    let d = p - cell + cell.element_sum() / 6.0;
    // The corners of the tetrahedron are passed in the order of the coordinates, the largest first.
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| d[b].total_cmp(&d[a]));
    let (mut value, mut gradient, mut corner) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for step in 0..4 {
        let away = d - corner + corner.element_sum() / 6.0;
        let [x, y, z] = (cell + corner).to_array().map(|c| c as i64 as u32);
        let mut h = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ z.wrapping_mul(0xcb1a_b31f);
        h = (h ^ (h >> 15)).wrapping_mul(0x9e37_79b1);
        h = (h ^ (h >> 13)).wrapping_mul(0x85eb_ca6b);
        let g = DVec3::from_array([22, 12, 2].map(|bit| f64::from(h >> bit & 1023) - 511.5));
        let t = (0.5 - away.length_squared()).max(0.0);
        value += t.powi(4) * g.dot(away);
        gradient += g * t.powi(4) - away * (8.0 * t.powi(3) * g.dot(away));
        if step < 3 {
            corner[order[step]] = 1.0;
        }
    }
    (value * 0.541_047, gradient * 0.541_047)
}

fn cubic(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Albedo and normal of a level, dry point of granite without moss, as its documentation has them.
fn truth(stone: &Stone, p: DVec3, spacing: f64) -> (DVec3, DVec3) {
    let (mut tone, mut tinted, mut lichen, mut lichen2) = (0.0, 0.0, 0.0, f64::from(stone.lichen2));
    let (mut slope, mut before) = (DVec3::ZERO, 0.0f64);
    for (k, octave) in stone.octaves.iter().enumerate() {
        let [a_tone, a_slope, crack, fold, weight_lichen, share] =
            [octave.tone, octave.slope, octave.crack, octave.fold, octave.lichen, octave.tinted]
                .map(f64::from);
        let scale = f64::from(1u32 << k);
        let samples = 1.0 / (scale * spacing);
        let weight = cubic(samples / 3.0 - 1.0);
        let (value, gradient) = noise(p * scale);
        let folded = value / value.hypot(0.1 + 1.5 / samples);
        slope += gradient * (weight * a_slope / f64::from(GRADIENT) * (1.0 - fold + fold * folded));
        let (half, away) = (f64::from(CRACK), value.abs() / gradient.length().max(1.0));
        let reach = half + 0.5 / samples;
        let line = half / reach * (1.0 - away / reach).max(0.0) - half * f64::from(CRACK_SHARE);
        tone -= weight * crack * (0.5 + 0.6 * before).clamp(0.0, 1.0) * line;
        tone += weight * a_tone * (1.0 - share) * value;
        tinted += weight * a_tone * share * value;
        lichen += weight * weight_lichen * value;
        lichen2 -= (weight * weight_lichen).powi(2);
        before = value;
    }
    let edge = f64::from(EDGE).powi(2);
    let grown = (lichen - f64::from(stone.bare)) / (edge + lichen2.max(0.0)).sqrt();
    let u = (0.5 + grown / 5.0).clamp(0.0, 1.0);
    let bare = u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u);
    let factor = DVec3::splat(1.0 + tone) + Vec3::from(stone.tint).as_dvec3() * tinted;
    let rock = factor.max(DVec3::splat(0.1)) * 0.2;
    let color = Vec3::from(stone.lichen).as_dvec3() * (0.2 * (1.0 + tone));
    (rock.lerp(color, bare), DVec3::new(-slope.x, 1.0, -slope.z).normalize())
}

#[test]
fn a_stone_is_the_sum_of_its_octaves_in_float64() {
    let granite = stone(StoneKind::Granite, "");
    let mut random = Pcg64Mcg::seed_from_u64(1);
    for spacing in [0.0005f32, 0.004, 0.03, 0.2] {
        for _ in 0..200 {
            let points: [Vec3; 8] =
                std::array::from_fn(|_| Vec3::from_array([0; 3].map(|_| random.random_range(-4.0..4.0))));
            let [albedo, normal] = lay(&granite, points, Vec3::Y, spacing);
            for lane in 0..8 {
                let (albedo_64, normal_64) = truth(&granite, points[lane].as_dvec3(), f64::from(spacing));
                let off = (albedo[lane].as_dvec3() - albedo_64).abs().max_element();
                let turned = (normal[lane].as_dvec3() - normal_64).length();
                // Places in the finest cells are rounded to 2e-4 of a cell.
                assert!(off < 1e-3 && turned < 3e-3, "{} {spacing}: {off} {turned}", points[lane]);
            }
        }
    }
}

#[test]
fn the_noise_has_the_deviations_that_the_constants_say() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let (mut value2, mut gradient2, mut tent, n) = (0.0, 0.0, 0.0, 400_000);
    for _ in 0..n {
        let (value, gradient) = noise(DVec3::from_array([0; 3].map(|_| random.random_range(-300.0..300.0))));
        value2 += value * value;
        gradient2 += gradient.length_squared() / 3.0;
        tent += (1.0 - value.abs() / gradient.length().max(1.0) / 0.02).max(0.0) / 0.02;
    }
    let n = f64::from(n);
    assert!(((value2 / n).sqrt() - 1.0).abs() < 0.01, "{}", value2 / n);
    assert!(((gradient2 / n).sqrt() / f64::from(GRADIENT) - 1.0).abs() < 0.01, "{}", gradient2 / n);
    assert!((tent / n / f64::from(CRACK_SHARE) - 1.0).abs() < 0.03, "{}", tent / n);
}

/// Mean albedo of a stone over a plane of 50 m × 50 m with normal `n`.
fn mean_albedo(stone: &Stone, n: Vec3, spacing: f32) -> Vec3 {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let (x, y) = n.any_orthonormal_pair();
    let (mut sum, count) = (Vec3::ZERO, 6000);
    for _ in 0..count {
        let mut metres = || random.random_range(-25.0f32..25.0);
        let points = std::array::from_fn(|_| x * metres() + y * metres());
        let [albedo, _] = lay(stone, points, n, spacing);
        sum += albedo.into_iter().sum::<Vec3>() / 8.0;
    }
    sum / count as f32
}

#[test]
fn small_samples_have_in_the_mean_the_albedo_of_a_large_one() {
    for kind in KINDS {
        // Cover is exact for normal noise; simplex noise has other tails. The signs of moss's weights leave
        // some correlation with the grain.
        for (more, most) in [("", 0.03), ("moss = 0.5\n", 0.06)] {
            let stone = stone(kind, more);
            let n = Vec3::new(0.3, 0.5, 0.8).normalize();
            let far = mean_albedo(&stone, n, 20.0);
            for spacing in [0.001, 0.02, 0.15] {
                let near = mean_albedo(&stone, n, spacing);
                let off = (near / far - 1.0).abs().max_element();
                assert!(off < most, "{} {more} {spacing}: {near} {far}", kind.word());
            }
        }
    }
}

#[test]
fn no_octave_is_left_whose_waves_are_shorter_than_two_samples() {
    let random = |seed| {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        std::array::from_fn(|_| Vec3::from_array([0; 3].map(|_| random.random_range(-9.0f32..9.0))))
    };
    let n = Vec3::new(0.2, 0.4, 0.9).normalize();
    for kind in KINDS {
        let whole = stone(kind, "moss = 0.4\n");
        for k in 0..OCTAVES {
            // Cells of three samples: 1.5 periods a cell are two samples a period.
            let spacing = 1.0 / (3.0 * (1u32 << k) as f32);
            let mut other = whole;
            for octave in &mut other.octaves[k..] {
                (octave.tone, octave.slope, octave.crack, octave.moss, octave.lichen) =
                    (9.0, 9.0, 1.0, 9.0, 9.0);
            }
            let points = random(k as u64);
            assert_eq!(lay(&whole, points, n, spacing), lay(&other, points, n, spacing), "{k}");
            assert_ne!(lay(&whole, points, n, spacing / 2.0), lay(&other, points, n, spacing / 2.0), "{k}");
        }
    }
}

#[test]
fn the_grain_is_fixed_to_the_world_wherever_points_are_measured_from() {
    let n = Vec3::new(0.2, 0.4, 0.9).normalize();
    let origin = DVec3::new(301.25, -120.5, 77.125);
    for kind in KINDS {
        let rock = rock(kind, "strata_tilt = 12.0\n");
        let [near, far] = [origin, DVec3::ZERO].map(|origin| Stone::new(&rock, origin).expect("a stone"));
        let mut random = Pcg64Mcg::seed_from_u64(4);
        for _ in 0..50 {
            let points: [Vec3; 8] =
                std::array::from_fn(|_| Vec3::from_array([0; 3].map(|_| random.random_range(-3.0f32..3.0))));
            let [a, _] = lay(&near, points, n, 0.02);
            let [b, _] = lay(&far, points.map(|p| p + origin.as_vec3()), n, 0.02);
            for (a, b) in a.into_iter().zip(b) {
                assert!((a - b).abs().max_element() < 2e-3, "{}: {a} {b}", kind.word());
            }
        }
    }
}

#[test]
fn rocks_have_the_albedo_of_their_kind_unless_the_scene_gives_one() {
    let even = "color_noise = 0.0\ncavity = 0.0\n";
    let albedo = |more: &str| Vec3::from(rock_of(&wall(&format!("{even}{more}")), "a")[40].albedo);
    assert_eq!(albedo(""), Vec3::new(0.12, 0.11, 0.10));
    for kind in KINDS {
        let word = kind.word();
        assert_eq!(Some(albedo(&format!("kind = \"{word}\"\n"))), kind.albedo());
        assert_eq!(albedo(&format!("kind = \"{word}\"\ncolor = [0.5,0.4,0.3]\n")), Vec3::new(0.5, 0.4, 0.3));
    }
    assert_eq!(StoneKind::Plain.albedo(), None);
}

/// Albedo that a row of the table in docs/method.md says taki takes.
fn documented_albedo(row: &str) -> Vec3 {
    let page = include_str!("../../../docs/method.md");
    let table = &page[page.find("| kind | taki takes |").expect("the table of albedos")..];
    let line = table.lines().find(|line| line.starts_with(&format!("| {row} |"))).expect(row);
    let cell = line.split('|').nth(2).expect("a second cell");
    let numbers: Vec<f32> = cell.split(',').map(|n| n.trim().parse().expect(cell)).collect();
    Vec3::from_slice(&numbers)
}

#[test]
fn kinds_have_the_albedos_of_the_documented_table() {
    for kind in KINDS {
        let word = kind.word();
        assert_eq!(kind.albedo(), Some(documented_albedo(&format!("`{word}`"))), "{word}");
        // Lichen is kept as a factor of the albedo, so that its tone follows the rock's.
        let lichen = Vec3::from(stone(kind, "").lichen) * kind.albedo().expect("a kind");
        assert!((lichen - documented_albedo("lichen")).abs().max_element() < 1e-6, "{word}: {lichen}");
        assert_eq!(Vec3::from(stone(kind, "").moss_color), documented_albedo("moss"));
    }
}

#[test]
fn plain_rock_has_no_stone() {
    let mesh = wall("grain = 2.0\nmoss = 1.0\n").mesh();
    assert!(mesh.stones.is_empty() && mesh.tiles.iter().all(|tile| tile.stone == 0));
    let mesh = wall("kind = \"slate\"\n[rocks.b]\ncorners = [[9,0,0],[12,0,0],[12,3,0],[9,3,0]]\n").mesh();
    let stones: Vec<u32> = mesh.tiles.iter().map(|tile| tile.stone).collect();
    let first = stones.iter().take_while(|stone| **stone == 1).count();
    assert!(first > 0 && stones[first..].iter().all(|stone| *stone == 0), "{stones:?}");
}

#[test]
fn the_engines_agree_on_every_kind_of_stone() {
    let Some(mut renderer) = renderer("stone") else { return };
    let sky = "[environment]\nkind = \"sky\"\nlights = 3\n";
    for (kind, more) in KINDS.into_iter().zip(["", sky, "", ""]) {
        let sets = ["a", "b"].map(|rock| format!("rocks.{rock}.kind = {}", kind.word()));
        let sets = [&*sets[0], &*sets[1], "rocks.a.moss = 0.3", "rocks.b.round = 0.7", "pools.p.foam = 0"];
        for scene in [small(more), small_seen_from("[0.3,1.5,1.6]", "[0.4,0.8,-3]", more)] {
            let mut scene = scene.with(&sets).expect("a scene");
            (scene.edit().image.width, scene.edit().image.height) = (192, 128);
            assert_parity(kind.word(), &both(&mut renderer, &scene));
        }
    }
}

#[test]
fn one_stone_has_the_same_bits_in_every_run_and_another_has_others() {
    let picture = |kind: &str| {
        let scene = small("").with(&[&format!("rocks.a.kind = {kind}")]).expect("a scene");
        taki::engine::cpu::gbuffer::run(&scene, &scene.mesh(), 0).opaque
    };
    assert!(picture("slate") == picture("slate"));
    assert!(picture("slate") != picture("basalt") && picture("plain") != picture("basalt"));
}

#[test]
fn a_film_on_a_stone_has_the_peak_of_that_on_plain_rock() {
    let (mut lobes, mut plain) = (Stored::default(), Stored::default());
    dispatch!(Level::new(), simd => {
        let n = Lanes3::splat(simd, Vec3::Y);
        lobes.store(stone_lobe(simd, n, n, n, f32x8::splat(simd, 0.05)));
        plain.store(film_lobe(simd, n, n, n));
    });
    assert!((lobes.0[0] / plain.0[0] - 1.0).abs() < 1e-5, "{} {}", lobes.0[0], plain.0[0]);
}

/// A boulder whose points are moved about in its patch.
const BOULDER: &str =
    "[rocks.a]\ncorners = [[-1,-1,0],[1,-1,0],[1,1,0],[-1,1,0]]\nlevels = 7\nh = 0.8\nborder = 0.45\n";

/// Number of squares of a boulder that face into it.
fn folded(scene: &Scene) -> usize {
    let vertices = rock_of(scene, "a");
    let at = |i: usize| Vec3::from(vertices[i].position);
    let squares = (0..129 * 128).filter(|i| i % 129 < 128);
    squares.filter(|&i| (at(i + 1) - at(i)).cross(at(i + 129) - at(i)).z < 0.0).count()
}

#[test]
fn no_normal_points_into_the_rock_where_its_mesh_is_folded_over() {
    let scene = of(&format!("{BOULDER}amplitude = 0.12\nbulge = 0.7\n"));
    // The mesh does fold over, and seen so, its normals pointed into the rock there: black dots.
    assert!(folded(&scene) > 500, "{}", folded(&scene));
    for vertex in rock_of(&scene, "a") {
        let n = Vec3::from(vertex.normal);
        assert!(n.z > 0.0 && (n.length() - 1.0).abs() < 1e-5, "{n}");
    }
}

#[test]
fn patches_of_a_kind_of_stone_do_not_fold_over() {
    assert!(folded(&of(&format!("{BOULDER}amplitude = 0.0\n"))) > 500);
    for round in [0.0, 0.8] {
        let scene = of(&format!("{BOULDER}amplitude = 0.0\nkind = \"granite\"\nround = {round}\n"));
        assert_eq!(folded(&scene), 0, "{round}");
        let moved = rock_of(&scene, "a").iter().map(|v| v.position[0].abs()).fold(0.0, f32::max);
        assert!(round > 0.0 || moved > 1.02, "its border is not straight: {moved}");
    }
}

#[test]
fn a_round_patch_is_an_ellipse() {
    let scene = of("[rocks.a]\ncorners = [[-2,-1,0],[2,-1,0],[2,1,0],[-2,1,0]]\namplitude = 0.0\n\
         levels = 5\nround = 1.0\n");
    let vertices = rock_of(&scene, "a");
    for (i, vertex) in vertices.iter().enumerate() {
        let [x, y, _] = vertex.position;
        let r2 = 0.25 * x * x + y * y;
        let on_border = [i % 33, i / 33].iter().any(|c| *c == 0 || *c == 32);
        assert!(r2 < 1.0 + 1e-5 && (!on_border || (r2 - 1.0).abs() < 1e-5), "{x} {y}");
    }
}

/// Heights of the beds along a column of a wall, metres.
fn beds(kind: &str) -> Vec<f32> {
    let scene = of(&format!(
        "[rocks.a]\ncorners = [[-40,-40,0],[40,-40,0],[40,40,0],[-40,40,0]]\nlevels = 10\namplitude = 0.0\n\
         strata = 0.01\nstrata_height = 2.0\nstrata_color = 1.0\ncolor_noise = 0.0\ncavity = 0.0\n\
         color = [0.2,0.2,0.2]\nkind = \"{kind}\"\n"
    ));
    let vertices = rock_of(&scene, "a");
    let mut heights = Vec::new();
    for column in (100..1000).step_by(100) {
        let mut last = 0;
        for row in 1..1025 {
            let tone = |row: usize| vertices[row * 1025 + column].albedo[0];
            // Thinner beds within a bed change the albedo by less.
            if (tone(row) - tone(row - 1)).abs() > 0.07 {
                heights.push((row - last) as f32 * 80.0 / 1024.0);
                last = row;
            }
        }
    }
    heights
}

#[test]
fn beds_of_stone_are_thick_and_thin() {
    let spread = |kind: &str| {
        let heights = beds(kind);
        let mean = heights.iter().sum::<f32>() / heights.len() as f32;
        let variance = heights.iter().map(|h| (h - mean) * (h - mean)).sum::<f32>() / heights.len() as f32;
        variance.sqrt() / mean
    };
    let (plain, stone) = (spread("plain"), spread("limestone"));
    // Joints and thinner beds are told as beds too, in both alike.
    assert!(stone > 1.1 * plain, "{stone} {plain}");
}
