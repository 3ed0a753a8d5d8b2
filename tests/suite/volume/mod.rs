//! §2 The volume texture: what its builder promises. Packing and files have modules of their own.

pub mod axes;
pub mod bricks;
pub mod cell;
pub mod cloth;
pub mod file;
pub mod fur;
pub mod grains;
mod grids;
pub mod hair;
pub mod leaps;
pub mod measured;
pub mod measured_strands;
pub mod mountain;
pub mod pyramid;
pub mod skin;
pub mod structure;
mod units;

use std::collections::{HashMap, HashSet};

use glam::{DVec3, IVec3, Vec3};
use rand::RngExt;
use taki::curve::{CurveShape, levels_for, spatial_fractal_curve};
use taki::util::monitor::Unwatched;
use taki::util::random::{Family, Stream};
use taki::volume::{Structure, VolumeTexture, WaterSpec, build_water};

/// Checks that a builder gives the same cells on one, three and four threads, and returns them.
fn same_on_any_number_of_threads(build: impl Fn() -> VolumeTexture + Sync) -> VolumeTexture {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(&build)
    };
    let one = on(1);
    assert_eq!(one, on(4));
    assert_eq!(one, on(3));
    one
}

/// Prints how long a builder takes, five times.
fn print_times(build: impl Fn() -> VolumeTexture) {
    for _ in 0..5 {
        let start = std::time::Instant::now();
        let cells = build().statistics().occupied_cells;
        println!("{cells} cells in {:.3} s", start.elapsed().as_secs_f64());
    }
}

fn spec(size: [u32; 3], grid: u32) -> WaterSpec {
    WaterSpec {
        size,
        across: grid,
        deep: grid,
        shape: CurveShape { h: 0.9, sigma_g_cells: 0.05 * size[1] as f32, levels: levels_for(size[1]) },
        structure: Structure::default(),
        seed: 7,
        alpha: 1.0,
        k_d: 0.5,
        k_s: 0.5,
        k_noise: 0.1,
    }
}

fn build(spec: &WaterSpec) -> VolumeTexture {
    build_water(spec, &Unwatched).unwrap()
}

fn on_threads(threads: usize, spec: &WaterSpec) -> VolumeTexture {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| build(spec))
}

/// Mean of `of` over the flow cells, and the number of flow cells.
fn mean(volume: &VolumeTexture, of: impl Fn(&taki::volume::Cell) -> f64) -> (f64, f64) {
    let flow: Vec<f64> = volume.cells.iter().filter(|c| c.has_direction()).map(of).collect();
    (flow.iter().sum::<f64>() / flow.len() as f64, flow.len() as f64)
}

#[test]
fn one_seed_gives_the_same_bytes_on_any_number_of_threads() {
    // The spec has enough curves for several tasks and rounds, and a depth that its slabs do not divide.
    let spec = spec([23, 40, 37], 90);
    let one = on_threads(1, &spec);
    assert_eq!(one, on_threads(4, &spec));
    assert_eq!(one, on_threads(3, &spec));
    assert_ne!(one, build(&WaterSpec { seed: 8, ..spec }));
}

#[test]
fn density_over_the_flow_cells_is_a_clamped_normal() {
    let volume = build(&spec([60, 60, 60], 60));
    let (rho, n) = mean(&volume, |c| c.rho() as f64);
    assert!(n > 50_000.0, "{n} flow cells");
    // A share Φ(−½) of the cells is clamped at either end. The codes round another 1/131070 onto each end.
    let share = 0.308_537_538_7;
    let five = 5.0 * (share * (1.0 - share) / n).sqrt() + 1e-5;
    let (at_zero, _) = mean(&volume, |c| f64::from(c.rho_code() == 0));
    let (at_one, _) = mean(&volume, |c| f64::from(c.rho_code() == 65535));
    assert!((at_zero - share).abs() < five, "share at 0: {at_zero}");
    assert!((at_one - share).abs() < five, "share at 1: {at_one}");
    // ½ is the largest standard deviation of values in 0..=1. The true one is 0.41.
    assert!((rho - 0.5).abs() < 5.0 * 0.42 / n.sqrt(), "mean {rho}");
    let s = volume.statistics();
    assert_eq!(s.flow_cells as f64, n);
    assert!((s.rho_share_at_zero - at_zero).abs() < 1e-12 && (s.rho_share_at_alpha - at_one).abs() < 1e-12);
    assert!((s.rho_mean - rho).abs() < 1e-6);
}

#[test]
fn directions_are_unit_in_flow_cells_and_the_rest_is_empty() {
    let volume = build(&spec([30, 40, 20], 8));
    let mut empty = 0;
    for cell in volume.cells.iter() {
        if cell.has_direction() {
            assert!((cell.v().length() - 1.0).abs() < 1e-6);
        } else {
            empty += 1;
            assert_eq!((cell.x, cell.y), (0, 0), "an empty cell holds nothing");
            assert_eq!(cell.v(), Vec3::ZERO);
        }
    }
    assert!(empty > 1000 && empty < volume.cells.len());
}

#[test]
fn without_amplitude_the_flow_is_straight_columns() {
    let mut spec = spec([20, 16, 12], 6);
    spec.shape.sigma_g_cells = 0.0;
    let volume = build(&spec);
    let mut columns = 0;
    for z in 0..12 {
        for x in 0..20 {
            let column: Vec<Vec3> = (0..16).map(|y| volume.cells[volume.index(x, y, z)].v()).collect();
            assert!(column.iter().all(|v| *v == column[0]), "column {x} {z}: {column:?}");
            assert!(column[0] == Vec3::Y || column[0] == Vec3::ZERO);
            columns += usize::from(column[0] == Vec3::Y);
        }
    }
    // Each square of the grid has one curve, and the squares are larger than a cell.
    assert!((25..=36).contains(&columns), "{columns} columns");
}

#[test]
fn curves_wrap_in_x_and_y_and_are_dropped_in_z() {
    let size = [16u32, 24, 8];
    let (mut over_x, mut over_y, mut over_z) = (0, 0, 0);
    for seed in 0..60 {
        let mut spec = spec(size, 1);
        spec.seed = seed;
        // The curve is rough and wide, because only tilted segments are displaced along y.
        spec.shape.sigma_g_cells = 12.0;
        spec.shape.h = 0.3;
        let volume = build(&spec);
        // The same curve in unwrapped space, sampled point by point.
        let points = only_curve(&spec);
        let mut seen = HashSet::new();
        for ends in points.windows(2) {
            for i in 0..200 {
                let p = ends[0].lerp(ends[1], (i as f32 + 0.5) / 200.0);
                if p.to_array().iter().any(|x| (x - x.round()).abs() < 1e-3) {
                    continue;
                }
                let c = p.floor().as_ivec3();
                over_x += usize::from(!(0..size[0] as i32).contains(&c.x));
                over_y += usize::from(!(0..size[1] as i32).contains(&c.y));
                if !(0..size[2] as i32).contains(&c.z) {
                    over_z += 1;
                    continue;
                }
                seen.insert(IVec3::new(c.x.rem_euclid(16), c.y.rem_euclid(24), c.z));
            }
        }
        for c in &seen {
            let cell = volume.cells[volume.index(c.x as u32, c.y as u32, c.z as u32)];
            assert!(cell.has_direction(), "seed {seed}: the curve passes {c}, which is empty");
        }
        let flow = volume.cells.iter().filter(|c| c.has_direction()).count();
        // The points miss only corners, which are cut by less than the step between points.
        assert!(flow >= seen.len() && flow <= seen.len() + seen.len() / 10 + 3, "{flow} of {}", seen.len());
    }
    assert!(over_x > 1000 && over_y > 1000 && over_z > 1000, "{over_x} {over_y} {over_z}");
}

/// Points of curve 0 of a jitter grid of one square, computed with the crate's public functions.
fn only_curve(spec: &WaterSpec) -> Vec<Vec3> {
    let mut rng = Family::new(spec.seed, Stream::Curve).member(0);
    let x = rng.random::<f32>() * spec.size[0] as f32;
    let z = rng.random::<f32>() * spec.size[2] as f32;
    let (p1, p2) = (Vec3::new(x, 0.0, z), Vec3::new(x, spec.size[1] as f32, z));
    let mut points = Vec::new();
    spatial_fractal_curve(&spec.shape, p1, p2, &mut rng, &mut points);
    points
}

#[test]
fn a_cells_direction_is_the_length_weighted_sum_of_its_segments() {
    let size = IVec3::new(32, 24, 32);
    let (mut checked, mut mixed) = (0, 0);
    for seed in 0..20 {
        let mut spec = spec(size.to_array().map(|n| n as u32), 1);
        spec.seed = seed;
        // The segments are several cells long and meet at sharp angles.
        spec.shape = CurveShape { h: 0.3, sigma_g_cells: 4.0, levels: 4 };
        let volume = build(&spec);
        // Each segment is cut into short equal pieces. Each piece is added to the cell of its middle.
        let mut sums: HashMap<IVec3, [DVec3; 2]> = HashMap::new();
        for (i, ends) in only_curve(&spec).windows(2).enumerate() {
            let (start, d) = (ends[0].as_dvec3(), (ends[1] - ends[0]).as_dvec3());
            let pieces = 20_000;
            for k in 0..pieces {
                let p = start + d * ((k as f64 + 0.5) / pieces as f64);
                let c = p.floor().as_ivec3();
                if (0..size.z).contains(&c.z) {
                    let cell = IVec3::new(c.x.rem_euclid(size.x), c.y.rem_euclid(size.y), c.z);
                    sums.entry(cell).or_default()[i % 2] += d / pieces as f64;
                }
            }
        }
        for (c, parts) in sums {
            let sum = parts[0] + parts[1];
            // Pieces of some 4e-4 cells give a shorter way too inaccurately.
            if sum.length() < 0.2 {
                continue;
            }
            let v = volume.cells[volume.index(c.x as u32, c.y as u32, c.z as u32)].v().as_dvec3();
            assert!(v.angle_between(sum) < 1e-2, "seed {seed}, cell {c}: {v}, not along {sum}");
            checked += 1;
            let lengths = [parts[0].length(), parts[1].length()];
            // Where two segments of unequal length diverge, only the weighted sum fits.
            mixed += usize::from(
                lengths[0].min(lengths[1]) > 0.05
                    && (lengths[0] / lengths[1]).ln().abs() > 0.4
                    && parts[0].angle_between(parts[1]) > 0.3,
            );
        }
    }
    assert!(checked > 500 && mixed > 20, "{checked} cells, {mixed} of two segments");
}

#[test]
fn k_lies_around_its_base_and_is_clamped() {
    let base = spec([40, 40, 40], 40);
    let volume = build(&base);
    let (k_d, n) = mean(&volume, |c| c.k().0 as f64);
    let (k_s, _) = mean(&volume, |c| c.k().1 as f64);
    let five = 5.0 * 0.1 / n.sqrt();
    assert!((k_d - 0.5).abs() < five && (k_s - 0.5).abs() < five, "{k_d} {k_s}");
    let (square, _) = mean(&volume, |c| (c.k().0 as f64 - 0.5).powi(2));
    assert!((square.sqrt() - 0.1).abs() < 5.0 * 0.1 / (2.0 * n).sqrt() + 1e-4, "noise {}", square.sqrt());
    // The two values are drawn independently.
    let (both, _) = mean(&volume, |c| (c.k().0 as f64 - 0.5) * (c.k().1 as f64 - 0.5));
    assert!(both.abs() < 5.0 * 0.01 / n.sqrt(), "covariance {both}");

    let high = build(&WaterSpec { k_d: 1.0, k_s: 0.0, k_noise: 0.5, ..base });
    // Half of the draws are clamped at the base, and Φ(−2) of them at the other end.
    let want = 0.5 + (0.5 - 0.022_750_1) + 0.5 * (0.053_991_0 - 0.398_942_3);
    let (k_d, n) = mean(&high, |c| c.k().0 as f64);
    let (k_s, _) = mean(&high, |c| c.k().1 as f64);
    let five = 5.0 * 0.3 / n.sqrt() + 1e-4;
    assert!((k_d - want).abs() < five && (k_s - (1.0 - want)).abs() < five, "{k_d} {k_s} {want}");

    let exact = build(&WaterSpec { k_noise: 0.0, k_d: 0.2, k_s: 0.8, ..base });
    assert!(exact.cells.iter().filter(|c| c.has_direction()).all(|c| c.k_codes() == (51, 204)));
}

#[test]
fn another_base_of_k_d_changes_the_bits_of_k_d_only() {
    let base = spec([30, 40, 20], 12);
    let a = build(&base);
    let b = build(&WaterSpec { k_d: 0.7, ..base });
    let k_d_bits = 0x00ff_0000;
    let mut changed = 0;
    for (a, b) in a.cells.iter().zip(b.cells.iter()) {
        assert_eq!((a.x & !k_d_bits, a.y), (b.x & !k_d_bits, b.y));
        changed += usize::from(a != b);
    }
    assert!(changed > 1000);
}

#[test]
fn another_h_keeps_the_density_of_cells_that_stay_occupied() {
    let base = spec([30, 40, 20], 12);
    let mut rough = base;
    rough.shape.h = 0.4;
    let (a, b) = (build(&base), build(&rough));
    let (mut both, mut moved) = (0, 0);
    for (a, b) in a.cells.iter().zip(b.cells.iter()) {
        if a.has_direction() && b.has_direction() {
            assert_eq!(a.x, b.x, "ρ and k belong to the cell, not to its curves");
            both += 1;
            moved += usize::from(a.y != b.y);
        }
    }
    assert!(both > 500 && moved > 400, "{both} cells in both, {moved} with another direction");
}

#[test]
fn alpha_scales_density_and_leaves_the_cells_alone() {
    let base = spec([20, 20, 20], 10);
    let (a, b) = (build(&base), build(&WaterSpec { alpha: 0.25, ..base }));
    assert_eq!(a.cells, b.cells);
    assert_eq!(b.alpha, 0.25);
    assert!((b.statistics().rho_mean / a.statistics().rho_mean - 0.25).abs() < 1e-6);
}
