//! Leaps over empty boxes end in states of the plain walk. Boxes are compared with brute force, leaps with
//! the plain walk crossing by crossing, and pictures bit for bit.

use crate::engine::gpu::{renderer, scene};
use glam::{IVec3, Vec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use taki::engine::RenderOptions;
use taki::engine::cpu::{self, LightVolumeCache};
use taki::engine::gpu::GpuRenderer;
use taki::picture::Frame;
use taki::scene::{Scene, presets};
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, Leaps, VolumeTexture, box_exponents, empty_share, with_boxes, worth_leaping};
use taki::walk::{Crossing, Walk};

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1992),
        ..ProptestConfig::default()
    }
}

/// A small random volume. `full` of 256 cells have density. One in eight of the others has a direction
/// nevertheless.
fn volume() -> impl Strategy<Value = VolumeTexture> {
    ([1u32..14, 1u32..14, 1u32..14], prop::sample::select(vec![0u8, 1, 4, 16, 60, 200]), any::<u64>())
        .prop_map(|(size, full, seed)| {
            let mut state = seed | 1;
            let mut next = || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 56) as u8
            };
            let cell = Cell::from_direction(Vec3::new(0.1, 1.0, -0.3));
            let cells: Vec<Cell> = (0..size.iter().product())
                .map(|_| match (next() < full, next() < 32) {
                    (true, _) => cell.with_density(0.6, 0.4, 0.7),
                    (false, true) => cell.with_density(0.0, 0.4, 0.7),
                    (false, false) => Cell::default(),
                })
                .collect();
            VolumeTexture { size, alpha: 1.0, cells: cells.into() }
        })
}

fn cell_at(volume: &VolumeTexture, c: IVec3) -> Option<Cell> {
    let [nx, ny, nz] = volume.size.map(|n| n as i32);
    let inside = (0..nz).contains(&c.z);
    let [x, y] = [c.x.rem_euclid(nx), c.y.rem_euclid(ny)];
    inside.then(|| volume.cells[volume.index(x as u32, y as u32, c.z as u32)])
}

fn is_full(volume: &VolumeTexture, c: IVec3) -> bool {
    cell_at(volume, c).is_some_and(|cell| cell.rho_code() > 0)
}

/// Whether a ray that looks between cells may meet density there.
fn is_full_around(volume: &VolumeTexture, c: IVec3) -> bool {
    let near = |i: i32| IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    cell_at(volume, c).is_some() && (0..27).any(|i| is_full(volume, c + near(i)))
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn boxes_are_empty_and_no_side_of_them_could_be_doubled(volume in volume(), between in any::<bool>()) {
        let full: fn(&VolumeTexture, IVec3) -> bool = if between { is_full_around } else { is_full };
        let boxed = with_boxes(&volume, between);
        let [nx, ny, nz] = volume.size.map(|n| n as i32);
        for i in 0..volume.cells.len() as i32 {
            let c = IVec3::new(i % nx, i / nx % ny, i / nx / ny);
            let (own, seen) = (volume.cells[i as usize], boxed.cells[i as usize]);
            prop_assert_eq!(own.rho_code(), seen.rho_code());
            if own.rho_code() > 0 {
                prop_assert_eq!(own, seen);
                continue;
            }
            for octant in 0..8 {
                let way = IVec3::from_array([0, 1, 2].map(|axis| 1 - 2 * (octant >> axis & 1)));
                let empty = |l: [u32; 3]| {
                    let [x, y, z] = l.map(|l| 1 << l);
                    x <= nx.max(1) && y <= ny.max(1) && l.iter().all(|&l| l < 4)
                        && (0..x * y * z)
                            .map(|i| IVec3::new(i % x, i / x % y, i / x / y))
                            .all(|at| !full(&volume, c + way * at))
                };
                let l = box_exponents(seen, octant as u32);
                if full(&volume, c) {
                    prop_assert_eq!(l, [0; 3]);
                    continue;
                }
                prop_assert!(empty(l), "{:?} at {} of {} in {:?}", l, c, octant, [nx, ny, nz]);
                for axis in 0..3 {
                    let mut longer = l;
                    longer[axis] += 1;
                    prop_assert!(
                        !empty(longer),
                        "{:?} at {} of {} could be longer along {}", l, c, octant, axis
                    );
                }
            }
        }
    }
}

/// Crossings of cells with density up to the end of the slab or `most` cells; the number of all cells; and
/// the number of loop turns.
fn met(
    volume: &VolumeTexture,
    origin: Vec3,
    direction: Vec3,
    leaps: bool,
    most: u32,
) -> (Vec<Crossing>, u32, u32) {
    let size = IVec3::from_array(volume.size.map(|n| n as i32));
    let mut walk = Walk::new(size, origin, direction, f32::INFINITY);
    let octant = walk.octant();
    let (mut met, mut cells, mut turns) = (Vec::new(), 0, 0);
    while cells < most && (0..size.z).contains(&walk.cell().z) {
        let cell = cell_at(volume, walk.cell()).expect("inside");
        if cell.rho_code() == 0 && leaps {
            cells += walk.leap(box_exponents(cell, octant));
        }
        let crossing = walk.next().expect("it has no end");
        if cell.rho_code() > 0 {
            met.push(crossing);
        }
        cells += 1;
        turns += 1;
    }
    (met, cells.min(most), turns)
}

/// A coordinate anywhere, on a face, or where crossings coincide.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 0.0f32..1.0, 1 => Just(0.0f32), 1 => (0i32..8).prop_map(|x| x as f32 / 8.0)]
}

fn component() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => -1.0f32..1.0,
        2 => (-4i32..=4).prop_map(|x| x as f32 / 4.0),
        1 => -1e-4f32..1e-4,
        1 => prop::sample::select(vec![0.0f32, -0.0, 1e-40, -1e-40, 1e-21, -1e-21]),
    ]
}

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn a_leaping_ray_meets_the_crossings_of_the_plain_walk_bit_for_bit(
        volume in volume(),
        start in [coordinate().boxed(), coordinate().boxed(), coordinate().boxed()],
        direction in [component().boxed(), component().boxed(), component().boxed()],
    ) {
        let direction = Vec3::from_array(direction);
        let [nx, ny, nz] = volume.size.map(|n| n as f32);
        // The start lies on the near face or inside the slab.
        let z = if direction.z < 0.0 { nz - start[2] } else { start[2] };
        let origin = Vec3::new(start[0] * nx, start[1] * ny, z);
        let boxed = with_boxes(&volume, false);
        let plain = met(&volume, origin, direction, false, 400);
        let leaping = met(&boxed, origin, direction, true, 400);
        prop_assert_eq!(plain.1, leaping.1, "cells");
        prop_assert!(leaping.2 <= plain.2);
        let bits = |c: &Crossing| (c.cell, c.t_enter.to_bits(), c.t_exit.to_bits());
        let [plain, leaping] = [plain.0, leaping.0].map(|met| met.iter().map(bits).collect::<Vec<_>>());
        prop_assert_eq!(plain, leaping);
    }
}

#[test]
fn rays_through_an_empty_volume_take_a_fifth_of_the_turns() {
    let volume = VolumeTexture { size: [40; 3], alpha: 1.0, cells: vec![Cell::default(); 64_000].into() };
    let boxed = with_boxes(&volume, false);
    for direction in
        [Vec3::Z, Vec3::new(0.3, 0.7, 1.0), Vec3::new(-2.0, 1.5, -0.7), Vec3::new(0.01, -1.0, 0.2)]
    {
        let origin = Vec3::new(3.3, 17.2, if direction.z < 0.0 { 40.0 } else { 0.0 });
        let (_, cells, turns) = met(&boxed, origin, direction, true, u32::MAX);
        assert_eq!(cells, met(&volume, origin, direction, false, u32::MAX).1);
        assert!(turns * 5 <= cells, "{direction}: {turns} turns for {cells} cells");
    }
}

fn on_cpu(scene: &Scene, volume: &VolumeTexture, leaps: Leaps) -> Frame {
    let mut kept = LightVolumeCache::default();
    kept.levels.leaps = leaps;
    let options = RenderOptions::default();
    cpu::render_with(scene, volume, &scene.mesh(), &options, &mut kept, &Unwatched).expect("a frame")
}

fn on_gpu(renderer: &mut GpuRenderer, scene: &Scene, volume: &VolumeTexture, leaps: Leaps) -> Frame {
    let options = RenderOptions { leaps, ..Default::default() };
    renderer.render(scene, volume, &scene.mesh(), &options, &Unwatched).expect("a frame")
}

/// Asserts that frames with and without leaps are equal, on both engines.
fn assert_alike(renderer: &mut Option<GpuRenderer>, what: &str, scene: &Scene) {
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let alike = |engine: &str, [a, b]: [Frame; 2]| {
        assert!(a.counts.iter().any(|c| c[0] > 0), "{what}: no water");
        assert_eq!(a.counts, b.counts, "{what}: cells of {engine}");
        assert!(a.radiance == b.radiance, "{what}: radiance of {engine}");
    };
    alike("cpu", [Leaps::Never, Leaps::Always].map(|leaps| on_cpu(scene, &volume, leaps)));
    if let Some(renderer) = renderer {
        alike("gpu", [Leaps::Never, Leaps::Always].map(|leaps| on_gpu(renderer, scene, &volume, leaps)));
    }
}

const SMALL: [&str; 3] = ["image.width=48", "image.height=40", "image.samples=1"];

#[test]
fn every_preset_is_the_same_bit_for_bit_with_and_without_leaps() {
    let mut renderer = renderer("presets and leaps");
    for (name, _) in presets() {
        let scene = scene(name, &SMALL);
        // `pour` shows two volumes.
        if scene.recipes.len() == 1 {
            assert_alike(&mut renderer, name, &scene);
        }
    }
}

#[test]
fn every_way_to_look_up_and_to_light_is_the_same_with_and_without_leaps() {
    let mut renderer = renderer("ways and leaps");
    let sparse = ["curves.across=5", "curves.deep=5", "volume.nx=36", "volume.nz=21"];
    let ways: [&[&str]; 10] = [
        &["light.visibility=none"],
        &["light.visibility=march", "trace.attenuation=path-length", "trace.sigma=20"],
        &["light.visibility=cached"],
        &["light.visibility=cached", "light.scattering=multiple"],
        &["trace.lookup=trilinear"],
        &["trace.lookup=trilinear", "light.visibility=cached"],
        &["trace.filter=pyramid", "camera.fov=110"],
        &["trace.filter=pyramid", "trace.lookup=trilinear", "light.reflection=strand", "camera.fov=80"],
        &["trace.max_cells=17", "volume.flow=0.37"],
        &["environment.kind=sky", "environment.lights=3"],
    ];
    for way in ways {
        let sets = [&SMALL[..], &sparse, way].concat();
        assert_alike(&mut renderer, &way.join(" "), &scene("fig5", &sets));
    }
}

#[test]
fn leaps_are_taken_where_most_of_the_volume_is_empty() {
    let volume =
        |preset: &str, sets: &[&str]| scene(preset, sets).volume(1 << 30, &Unwatched).expect("a volume");
    let sparse = volume("fig5", &["volume.nx=80", "volume.ny=80", "volume.nz=80"]);
    assert!(worth_leaping(&sparse), "{}", empty_share(&sparse));
    let dense = volume("front", &[]);
    assert!(!worth_leaping(&dense), "{}", empty_share(&dense));
    let empty = VolumeTexture { size: [1, 3, 2], alpha: 1.0, cells: vec![Cell::default(); 6].into() };
    assert_eq!(empty_share(&empty), 1.0);
    assert_eq!(empty_share(&VolumeTexture { cells: vec![Cell { x: 1, y: 0 }; 6].into(), ..empty }), 0.0);
}
