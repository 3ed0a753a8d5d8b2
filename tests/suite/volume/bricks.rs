//! Sparse storage: it equals dense storage cell for cell and picture for picture, in less memory.

use std::path::Path;

use crate::engine::gpu::{assert_parity, both, renderer, scene};
use glam::Vec3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use taki::curve::{CurveShape, levels_for};
use taki::engine::gpu::{Filling, GpuRenderer};
use taki::engine::{RenderOptions, cpu};
use taki::job::{VolumeMemo, memory_of, strips};
use taki::picture::Frame;
use taki::scene::{Limits, Scene, presets};
use taki::util::monitor::Unwatched;
use taki::util::window::Window;
use taki::volume::{
    Bricks, Cell, Cells, ReadOptions, Storage, StorageChoice, Structure, VolumeTexture, WaterSpec,
    build_sparse_water, build_water, expected_cells, read_npz, sparse_bytes, write_npz,
};

const MEMORY: u64 = 1 << 30;

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1992),
        ..ProptestConfig::default()
    }
}

/// Water of any kind in volumes of odd sizes.
fn spec() -> impl Strategy<Value = WaterSpec> {
    let size = [1u32..34, 1u32..34, 1u32..34];
    let curves = (1u32..20, 1u32..20, 0.0f32..2.0, 0.0f32..0.6);
    let structure =
        (0u32..4, prop::sample::select(vec![0.0f32, 0.7]), prop::sample::select(vec![0.0f32, 0.8]));
    (size, curves, structure, any::<u64>(), 0.0f32..1.0).prop_map(
        |(size, (across, deep, h, amplitude), (bundles, coherence, coverage), seed, crest)| WaterSpec {
            size,
            across,
            deep,
            shape: CurveShape { h, sigma_g_cells: amplitude * size[1] as f32, levels: levels_for(size[1]) },
            structure: Structure {
                bundles,
                radius_cells: 2.0,
                wander_cells: 3.0,
                breathe: 0.4,
                loose: 0.2,
                coherence,
                strand_length: 0.1,
                coverage,
                crest,
                lines: seed % 2 == 0,
            },
            seed,
            alpha: 0.9,
            k_d: 0.5,
            k_s: 0.4,
            k_noise: 0.2,
        },
    )
}

fn dense(spec: &WaterSpec) -> VolumeTexture {
    build_water(spec, &Unwatched).expect("a volume")
}

fn sparse(spec: &WaterSpec) -> VolumeTexture {
    build_sparse_water(spec, MEMORY, &Unwatched).expect("a volume")
}

/// The same volume in bricks.
fn packed(volume: &VolumeTexture) -> VolumeTexture {
    let cells = Bricks::of(volume.size, volume.cells.dense().expect("dense")).into();
    VolumeTexture { cells, ..volume.clone() }
}

/// Asserts that both volumes are equal: cell by cell, with every way to read a cell, and in everything
/// computed from all cells.
fn assert_same(dense: &VolumeTexture, sparse: &VolumeTexture) {
    assert!(sparse.is_sparse() && !dense.is_sparse());
    let [nx, ny, nz] = dense.size;
    for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
        let own = dense.cells[dense.index(x, y, z)];
        assert_eq!(own, sparse.cell(x, y, z), "({x}, {y}, {z}) of {:?}", dense.size);
        assert_eq!(own, sparse.cells[sparse.index(x, y, z)]);
    }
    assert!(dense.cells.iter().eq(sparse.cells.iter()));
    assert_eq!(dense.cells, sparse.cells);
    assert_eq!(dense.cells.len(), sparse.cells.len());
    assert_eq!(dense.checksum(), sparse.checksum());
    assert_eq!(dense.layer_codes(), sparse.layer_codes());
    assert_eq!(dense.rho_histogram(10), sparse.rho_histogram(10));
    let [a, b] = [dense, sparse].map(VolumeTexture::statistics);
    assert_eq!((a.cells, a.flow_cells, a.occupied_cells), (b.cells, b.flow_cells, b.occupied_cells));
    // Both are sums of the same numbers below 1, in different orders.
    assert!((a.rho_mean - b.rho_mean).abs() < 1e-12 && (a.k_d_mean - b.k_d_mean).abs() < 1e-12);
    assert_eq!(b.stored_cells as usize, sparse.cells.stored().len());
    assert!(b.stored_cells <= a.cells && b.stored_cells >= b.flow_cells);
}

proptest! {
    #![proptest_config(cases(150))]

    #[test]
    fn the_sparse_builder_makes_the_cells_of_the_dense_one_bit_for_bit(spec in spec()) {
        assert_same(&dense(&spec), &sparse(&spec));
    }

    #[test]
    fn what_is_packed_is_what_was_and_files_do_not_tell_the_difference(
        size in [1u32..14, 1u32..14, 1u32..14],
        full in prop::sample::select(vec![0u8, 1, 16, 128, 255]),
        seed in any::<u64>(),
    ) {
        let mut state = seed | 1;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 56) as u8
        };
        let mut cell = || {
            let [x, y, z] = [next(), next(), next()].map(|c| f32::from(c) - 127.5);
            let cell = Cell::from_direction(Vec3::new(x, y, z));
            let [rho, k_d, k_s] = [next(), next(), next()].map(|c| f32::from(c) / 255.0);
            if next() <= full && full > 0 { cell.with_density(rho, k_d, k_s) } else { Cell::default() }
        };
        let cells: Vec<Cell> = (0..size.iter().product::<u32>()).map(|_| cell()).collect();
        let volume = VolumeTexture { size, alpha: 0.7, cells: cells.into() };
        let bricks = packed(&volume);
        assert_same(&volume, &bricks);
        let stored = volume.cells.iter().filter(|cell| **cell != Cell::default()).count();
        prop_assert_eq!(stored, bricks.cells.stored().len());

        let folder = tempfile::tempdir().unwrap();
        let files = [&volume, &bricks].map(|volume| {
            let path = folder.path().join("v.npz");
            write_npz(volume, std::fs::File::create(&path).unwrap()).unwrap();
            let read = |storage| {
                let options = ReadOptions { storage, budget: MEMORY, ..Default::default() };
                read_npz(&path, &options, &Unwatched).unwrap()
            };
            assert_eq!(read(StorageChoice::Auto), read(StorageChoice::Dense));
            assert_same(&read(StorageChoice::Auto), &read(StorageChoice::Sparse));
            std::fs::read(path).unwrap()
        });
        prop_assert_eq!(&files[0], &files[1]);
    }
}

#[test]
fn many_rounds_of_curves_on_any_number_of_threads_are_the_dense_volume() {
    // The spec needs several tasks and rounds, has a depth that its slabs do not divide, and has strands that
    // cross in most cells.
    let structure = Structure { coherence: 0.6, strand_length: 0.1, coverage: 0.5, ..Default::default() };
    let spec = WaterSpec {
        size: [23, 40, 75],
        across: 90,
        deep: 90,
        shape: CurveShape { h: 0.9, sigma_g_cells: 4.0, levels: levels_for(40) },
        structure,
        seed: 7,
        alpha: 1.0,
        k_d: 0.5,
        k_s: 0.5,
        k_noise: 0.1,
    };
    let whole = dense(&spec);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_same(&whole, &pool.install(|| sparse(&spec)));
    }
}

#[test]
fn another_cell_makes_another_volume_in_either_storage() {
    let volume = dense(&scene("front", &["volume.nx=13", "volume.ny=9", "volume.nz=6"]).recipes[0].water);
    let changed = |at: usize| {
        let mut other = packed(&volume);
        other.cells.change(|i, _, cell| if i == at as u64 { Cell { x: cell.x ^ 1, ..cell } } else { cell });
        other
    };
    let full = (0..volume.cells.len()).filter(|&i| volume.cells[i].has_direction());
    for at in full.step_by(97) {
        let other = changed(at);
        assert_ne!(volume.cells, other.cells);
        assert_ne!(packed(&volume).cells, other.cells);
        assert_ne!(volume.checksum(), other.checksum());
        assert_eq!(volume.cells[at].x ^ 1, other.cells[at].x);
    }
}

fn on_cpu(scene: &Scene, volume: &VolumeTexture) -> Frame {
    cpu::render(scene, volume, &scene.mesh(), false, &Unwatched).expect("a frame")
}

fn on_gpu(renderer: &mut GpuRenderer, scene: &Scene, volume: &VolumeTexture) -> Frame {
    // The host rounds codes of light volumes differently, and it never fills those of sparse volumes.
    let options = RenderOptions { filling: Filling::Device, ..Default::default() };
    renderer.render(scene, volume, &scene.mesh(), &options, &Unwatched).expect("a frame")
}

/// Asserts that pictures and counts of dense and sparse storage are equal, on both engines.
fn assert_alike(renderer: &mut Option<GpuRenderer>, what: &str, scene: &Scene, volume: &VolumeTexture) {
    let volumes = [volume.clone(), packed(volume)];
    let alike = |engine: &str, [a, b]: [Frame; 2]| {
        assert!(a.counts.iter().any(|c| c[0] > 0), "{what}: no water");
        assert_eq!(a.counts, b.counts, "{what}: cells of {engine}");
        assert!(a.radiance == b.radiance, "{what}: radiance of {engine}");
    };
    alike("cpu", volumes.each_ref().map(|volume| on_cpu(scene, volume)));
    if let Some(renderer) = renderer {
        alike("gpu", volumes.each_ref().map(|volume| on_gpu(renderer, scene, volume)));
    }
}

const SMALL: [&str; 4] = ["image.width=48", "image.height=40", "image.samples=1", "trace.filter=none"];

#[test]
fn every_preset_is_the_same_bit_for_bit_in_sparse_storage() {
    let mut renderer = renderer("presets in bricks");
    for (name, _) in presets() {
        let scene = scene(name, &SMALL);
        // `pour` shows two volumes.
        if scene.recipes.len() == 1 {
            let volume = scene.volume(MEMORY, &Unwatched).expect("a volume");
            assert_alike(&mut renderer, name, &scene, &volume);
        }
    }
}

#[test]
fn every_way_to_look_up_and_to_light_is_the_same_in_sparse_storage() {
    let mut renderer = renderer("ways in bricks");
    // Bricks do not divide these sizes, so copies of the volume meet inside bricks.
    let odd = ["curves.across=7", "curves.deep=6", "volume.nx=37", "volume.ny=41", "volume.nz=22"];
    let ways: [&[&str]; 9] = [
        &["light.visibility=none"],
        &["light.visibility=march", "trace.attenuation=path-length", "trace.sigma=20"],
        &["light.visibility=cached"],
        &["light.visibility=cached", "light.scattering=multiple"],
        &["trace.lookup=trilinear"],
        &["trace.lookup=trilinear", "light.visibility=cached"],
        &["trace.max_cells=17", "volume.flow=0.37"],
        &["environment.kind=sky", "environment.lights=3", "light.reflection=strand"],
        &["volume.nx=1", "volume.ny=3", "volume.nz=2", "curves.across=1", "curves.deep=2"],
    ];
    for way in ways {
        let sets = [&SMALL[..], &odd, way].concat();
        let scene = scene("fig5", &sets);
        let volume = scene.volume(MEMORY, &Unwatched).expect("a volume");
        assert_alike(&mut renderer, &way.join(" "), &scene, &volume);
    }
    // Mist gives every empty cell a density. Erosion takes it from thin cells.
    for preset in ["cascade", "curtain"] {
        let scene = scene(preset, &[&SMALL[..], &odd, &["light.visibility=march"]].concat());
        assert!(scene.quads.iter().any(|quad| quad.mist > 0.0 || quad.erosion != [0.0; 4]), "{preset}");
        let volume = scene.volume(MEMORY, &Unwatched).expect("a volume");
        assert_alike(&mut renderer, preset, &scene, &volume);
    }
}

#[test]
fn one_cell_anywhere_in_a_brick_is_seen_where_it_is() {
    let mut renderer = renderer("a cell in a brick");
    let scene = scene("front", &[&SMALL[..], &["trace.sigma=100", "light.ambient=[1,1,1]"]].concat());
    for at in 0..6 * 5 * 7 {
        if at % 3 == 1 {
            continue;
        }
        let mut cells = vec![Cell::default(); 6 * 5 * 7];
        cells[at] = Cell::from_direction(Vec3::Y).with_density(1.0, 1.0, 0.5);
        let volume = VolumeTexture { size: [6, 5, 7], alpha: 1.0, cells: cells.into() };
        let volumes = [volume.clone(), packed(&volume)];
        let [a, b] = volumes.each_ref().map(|volume| match &mut renderer {
            Some(renderer) => on_gpu(renderer, &scene, volume),
            None => on_cpu(&scene, volume),
        });
        assert!(a.radiance.iter().any(|p| p[3] < 0.9), "cell {at} is seen");
        assert!(a.radiance == b.radiance, "cell {at}");
    }
}

fn load(sets: &[&str], memory: u64) -> taki::Result<Scene> {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Scene::load(Path::new("front"), &sets, &Limits { memory, ..Limits::default() })
}

#[test]
fn auto_is_dense_where_that_fits_and_sparse_where_only_that_does() {
    const LARGE: [&str; 5] =
        ["volume.nx=128", "volume.ny=128", "volume.nz=128", "image.width=16", "image.height=16"];
    let storage =
        |sets: &[&str], memory: u64| load(&[&LARGE[..], sets].concat(), memory).map(|s| s.recipes[0].storage);
    // 24 bytes for each of 128³ cells, and what the picture takes besides: one byte more and one less.
    const DENSE: u64 = 24 << 21;
    let dense = load(&[&LARGE[..], &["volume.storage=dense"]].concat(), 1 << 32).unwrap();
    let (need, _) = memory_of(&dense, Window::whole([16, 16]), true, 1 << 32).unwrap();
    assert!((DENSE + (64 << 20)..DENSE + (65 << 20)).contains(&need), "{need}");
    assert_eq!(storage(&[], need).unwrap(), Storage::Dense);
    assert_eq!(storage(&[], need - 1).unwrap(), Storage::Sparse);
    assert_eq!(storage(&["volume.storage=sparse"], 1 << 32).unwrap(), Storage::Sparse);
    assert_eq!(storage(&["volume.storage=dense"], 1 << 32).unwrap(), Storage::Dense);
    // Building a dense volume takes 20 bytes a cell.
    let refused = storage(&["volume.storage=dense"], (20 << 21) - 1).unwrap_err();
    assert_eq!(refused.exit_code(), 33);
    // Coarse levels need all cells, so the volume stays dense.
    assert_eq!(storage(&["trace.filter=pyramid"], DENSE - 1).unwrap(), Storage::Dense);
    let refused = storage(&["trace.filter=pyramid", "volume.storage=sparse"], 1 << 32).unwrap_err();
    assert_eq!(refused.exit_code(), 65);
    assert!(refused.to_string().contains("trace.filter=none"), "{refused}");
    assert_eq!(storage(&["volume.storage=spares"], 1 << 32).unwrap_err().exit_code(), 65);
}

#[test]
fn auto_is_refused_only_where_either_storage_is() {
    let whole = Window::whole([16, 16]);
    let size = ["image.width=16", "image.height=16"];
    let thin = ["volume.nx=160", "volume.ny=160", "volume.nz=160"];
    // So many strands that sparse storage takes more than dense.
    let full = ["volume.nx=96", "volume.ny=96", "volume.nz=96", "curves.across=150", "curves.deep=150"];
    for (name, volume, limits) in [("thin", &thin[..], 60..170), ("full", &full[..], 60..100)] {
        let works = |storage: &str, memory: u64| {
            let sets = [volume, &size, &[storage]].concat();
            load(&sets, memory).and_then(|scene| strips(&scene, whole, true, memory)).is_ok()
        };
        let mut refused = 0;
        for mib in limits {
            let [auto, dense, sparse] =
                ["auto", "dense", "sparse"].map(|word| works(&format!("volume.storage={word}"), mib << 20));
            assert_eq!(auto, dense || sparse, "{name} {mib}: dense {dense}, sparse {sparse}");
            refused += u32::from(!auto);
        }
        assert!((1..40).contains(&refused), "{name}: {refused}");
    }
}

#[test]
fn a_sparse_volume_that_does_not_fit_is_refused_before_its_cells_are_made() {
    let sets = ["volume.nx=96", "volume.ny=96", "volume.nz=96", "volume.storage=sparse"];
    let scene = load(&sets, 1 << 32).unwrap();
    let stored = scene.volume(1 << 32, &Unwatched).unwrap().cells.stored().len() as u64;
    // Memory of the builder: 12 bytes of masks and bases per brick; 8 for each stored cell and 12 for its
    // sum.
    let need = 24u64.pow(3) * 12 + stored * (8 + 12);
    assert_eq!(sparse_bytes(scene.recipes[0].water.size, stored, 12), u128::from(need));
    assert!(scene.volume(need, &Unwatched).is_ok());
    let refused = scene.volume(need - 1, &Unwatched).unwrap_err();
    assert_eq!(refused.exit_code(), 33);
    for word in ["96×96×96", "curves.across", "--memory", &stored.to_string()] {
        assert!(refused.to_string().contains(word), "{word}: {refused}");
    }
    // The estimate for a picture. The lengths of curves differ by a tenth, so 32 curves give their mean to 2
    // %. Starts are jittered, so curves meet less often than by chance.
    let expected = expected_cells(&scene.recipes[0].water);
    assert!(expected.abs_diff(stored) < stored / 20, "{expected} for {stored}");
}

#[test]
fn a_change_of_reflection_repacks_a_sparse_volume_and_one_of_storage_makes_it_anew() {
    let mut memo = VolumeMemo::default();
    let mut volume = |sets: &[&str]| {
        let scene = scene("front", sets);
        let (volumes, cost) = memo.volumes(&scene, MEMORY, &Unwatched).expect("a volume");
        (volumes[0].clone(), cost, dense(&scene.recipes[0].water))
    };
    let (first, cost, whole) = volume(&["volume.storage=sparse"]);
    assert_eq!(cost, Some(taki::scene::Cost::Volume));
    assert_same(&whole, &first);
    let (second, cost, whole) = volume(&["volume.storage=sparse", "volume.k_d=0.2", "volume.k_noise=0.3"]);
    assert_eq!(cost, Some(taki::scene::Cost::Upload));
    assert_same(&whole, &second);
    let (third, cost, _) = volume(&["volume.storage=dense", "volume.k_d=0.2", "volume.k_noise=0.3"]);
    assert_eq!(cost, Some(taki::scene::Cost::Volume));
    assert!(!third.is_sparse() && third == second);
}

#[test]
fn an_empty_volume_and_a_full_one_are_stored_as_such() {
    let cells = |cell| VolumeTexture { size: [5, 6, 7], alpha: 1.0, cells: vec![cell; 210].into() };
    let empty = packed(&cells(Cell::default()));
    assert_eq!((empty.cells.stored().len(), empty.cells.bytes()), (0, 2 * 2 * 2 * 12));
    assert_same(&cells(Cell::default()), &empty);
    let full = packed(&cells(Cell::from_direction(Vec3::X).with_density(0.3, 0.2, 0.1)));
    assert_eq!((full.cells.stored().len(), full.cells.bytes()), (210, 2 * 2 * 2 * 12 + 210 * 8));
    assert_same(&cells(full.cells[0]), &full);
    assert_ne!(Cells::default(), full.cells);
}

#[test]
fn a_volume_of_several_uploads_and_planes_of_stored_cells_is_drawn_as_the_cpu_engine_draws_it() {
    let Some(mut renderer) = renderer("a large volume in bricks") else { return };
    let sets = [
        "volume.nx=1024",
        "volume.ny=1022",
        "volume.nz=262",
        "volume.storage=sparse",
        "curves.across=150",
        "curves.deep=60",
        "trace.sigma=40",
        "trace.max_cells=4096",
        // The camera looks from the side, so that rays pass through copies of the volume too.
        "camera.eye=[1.5, 1.0, 3.0]",
    ];
    let scene = scene("front", &[&SMALL[..], &sets].concat());
    let volume = scene.volume(MEMORY, &Unwatched).expect("a volume");
    // An upload takes 64 MiB at a time: 16 bytes per brick and 8 per stored cell. 2²⁰ stored cells make one
    // plane of their texture.
    let bricks = taki::volume::brick_grid(volume.size).map(u64::from).iter().product::<u64>();
    let stored = volume.cells.stored().len();
    assert!(bricks * 16 > 64 << 20 && stored * 8 > 64 << 20, "{bricks} bricks, {stored} cells");
    assert!(
        stored > 9 << 20 && !stored.is_multiple_of(1 << 20),
        "whole planes and a part of one are uploaded after the first slab"
    );
    let frames = both(&mut renderer, &scene);
    assert_parity("a large volume in bricks", &frames);
    // Rays meet cells of the last layers, which hide the background.
    let mut thinner = volume.clone();
    let last = u64::from(volume.size[0]) * u64::from(volume.size[1]) * 200;
    thinner.cells.change(|i, _, cell| if i >= last { Cell::default() } else { cell });
    assert_ne!(on_gpu(&mut renderer, &scene, &thinner).radiance, frames[0].radiance);
}
