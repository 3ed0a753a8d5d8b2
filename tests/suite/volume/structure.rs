//! Bundles, coherence, coverage and crests: the builder's additions to the paper.

use std::collections::HashSet;

use super::{build, mean, on_threads, spec};
use glam::Vec3;
use taki::util::random::{Family, Stream};
use taki::volume::{Ripple, Structure, VolumeTexture, WaterSpec, build_water, curve_points};

/// A spec with every addition turned on.
fn rich(size: [u32; 3], grid: u32) -> WaterSpec {
    let structure = Structure {
        bundles: 9,
        radius_cells: 2.0,
        wander_cells: 3.0,
        breathe: 0.5,
        loose: 0.2,
        coherence: 0.7,
        strand_length: 0.1,
        coverage: 1.0,
        crest: 0.5,
        lines: true,
    };
    WaterSpec { structure, ..spec(size, grid) }
}

fn curves(spec: &WaterSpec) -> Vec<Vec<Vec3>> {
    let curve = |i| {
        let mut points = Vec::new();
        curve_points(spec, i as usize, &mut points);
        points
    };
    (0..spec.across * spec.deep).map(curve).collect()
}

#[test]
fn structured_volumes_are_the_same_bytes_on_any_number_of_threads() {
    let spec = rich([23, 40, 37], 90);
    let one = on_threads(1, &spec);
    assert_eq!(one, on_threads(3, &spec));
    assert_eq!(one, on_threads(4, &spec));
    let plain = WaterSpec { structure: Structure::default(), ..spec };
    assert_ne!(one.cells, build(&plain).cells);
}

#[test]
fn curves_of_bundles_end_where_they_began_so_that_copies_join() {
    let spec = rich([30, 64, 20], 12);
    for points in curves(&spec) {
        let way = points[points.len() - 1] - points[0];
        // These are float32 sums of numbers below 128.
        assert!((way - Vec3::new(0.0, 64.0, 0.0)).abs().max_element() < 1e-4, "{way}");
    }
}

#[test]
fn without_a_spread_of_their_own_all_curves_of_a_bundle_are_one() {
    let mut spec = rich([30, 64, 20], 12);
    spec.shape.sigma_g_cells = 0.0;
    spec.structure = Structure { radius_cells: 0.0, breathe: 0.0, loose: 0.0, ..spec.structure };
    let different: HashSet<Vec<[i64; 3]>> = curves(&spec)
        .iter()
        .map(|points| points.iter().map(|p| p.to_array().map(|x| (x * 256.0).round() as i64)).collect())
        .collect();
    // 144 curves choose among 9 parents. The chance that one parent is left out is 4e-7.
    assert_eq!(different.len(), 9);
    let straight = different.iter().filter(|points| points.iter().all(|p| p[0] == points[0][0]));
    assert_eq!(straight.count(), 0, "parents wander");
}

#[test]
fn coarser_curves_of_bundles_are_the_same_curves() {
    let fine = rich([30, 64, 20], 4);
    let mut coarse = fine;
    coarse.shape.levels -= 2;
    for (fine, coarse) in curves(&fine).iter().zip(curves(&coarse)) {
        let far = coarse.iter().enumerate().map(|(i, p)| p.distance(fine[4 * i])).fold(0.0, f32::max);
        assert!(far < 1e-4, "{far}");
    }
}

#[test]
fn ripples_have_variance_1_and_the_wrapped_gaussian_covariance() {
    let (seeds, steps, length) = (20_000, 20, 0.1f64);
    let family = Family::new(5, Stream::Strand);
    let mut sums = vec![0.0f64; steps];
    let mut values = Vec::new();
    for seed in 0..seeds {
        values.clear();
        Ripple::new(length as f32, &mut family.member(seed)).sample(steps, &mut values);
        for (sum, w) in sums.iter_mut().zip(&values) {
            *sum += f64::from(values[0] * w);
        }
    }
    let gauss = |d: f64| (-2..=2).map(|n| (-0.5 * ((d + f64::from(n)) / length).powi(2)).exp()).sum::<f64>();
    for (i, sum) in sums.iter().enumerate() {
        let truth = gauss(i as f64 / steps as f64) / gauss(0.0);
        // A product of two normal numbers has variance 1 + R². The tolerance is five standard errors.
        let tolerance = 5.0 * ((1.0 + truth * truth) / seeds as f64).sqrt();
        let covariance = sum / seeds as f64;
        assert!((covariance - truth).abs() < tolerance, "{i}: {covariance} {truth}");
    }
}

/// Correlation of ρ between cells `steps` apart along y that both have flow.
fn along_y(volume: &VolumeTexture, steps: u32) -> f64 {
    let [nx, ny, nz] = volume.size;
    let (mut n, mut sums) = (0.0, [0.0f64; 3]);
    for (x, y, z) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (x, y, z)))) {
        let cells = [y, (y + steps) % ny].map(|y| volume.cells[volume.index(x, y, z)]);
        if cells.iter().all(|c| c.has_direction()) {
            let [a, b] = cells.map(|c| f64::from(c.rho()) - 0.5);
            n += 1.0;
            sums = [sums[0] + a * b, sums[1] + a * a, sums[2] + b * b];
        }
    }
    assert!(n > 5_000.0, "{n} pairs");
    sums[0] / (sums[1] * sums[2]).sqrt()
}

#[test]
fn coherent_density_follows_the_strands_and_keeps_its_distribution() {
    let mut spec = spec([60, 80, 40], 40);
    spec.shape.sigma_g_cells = 0.5;
    let paper = build(&spec);
    spec.structure = Structure { coherence: 1.0, strand_length: 0.1, ..Structure::default() };
    let volume = build(&spec);
    assert_eq!(
        paper.cells.iter().map(|c| c.y).collect::<Vec<_>>(),
        volume.cells.iter().map(|c| c.y).collect::<Vec<_>>(),
        "directions stay"
    );
    let half = WaterSpec { structure: Structure { coherence: 0.5, ..spec.structure }, ..spec };
    // There are 1600 strands of 1/(2.5·0.1) independent pieces each. The mean of numbers between 0 and 1 with
    // a standard deviation of 0.42 is then known to 0.0053, and the share to 0.0058.
    for volume in [&volume, &build(&half)] {
        let (rho, _) = mean(volume, |c| f64::from(c.rho()));
        assert!((rho - 0.5).abs() < 4.0 * 0.0053, "{rho}");
        for code in [0, 0xffff] {
            let (share, _) = mean(volume, |c| f64::from(c.rho_code() == code));
            assert!((share - 0.3085).abs() < 4.0 * 0.0058, "{share}");
        }
    }
    // Neighbouring cells mostly hold the same strands.
    let (near, far) = (along_y(&volume, 1), along_y(&volume, 40));
    assert!(near > 0.75 && far.abs() < 0.1, "{near} {far}");
    let none = along_y(&paper, 1);
    assert!(none.abs() < 0.05, "{none}");
}

#[test]
fn coverage_is_by_the_length_of_the_strands_in_a_cell() {
    let mut spec = spec([1, 16, 1], 1);
    // A straight line passes through all 16 cells, with 1 cell of its length in each. Two lines give 2.
    spec.shape.sigma_g_cells = 0.0;
    for lines in [1, 2] {
        spec.across = lines;
        let whole = build(&spec);
        let covered =
            build(&WaterSpec { structure: Structure { coverage: 1.0, ..Structure::default() }, ..spec });
        for (a, b) in whole.cells.iter().zip(covered.cells.iter()) {
            let truth = a.rho() * (1.0 - (-(lines as f32)).exp());
            // The bound is one step of the code.
            assert!((b.rho() - truth).abs() <= 1.6e-5, "{} {truth}", b.rho());
        }
    }
}

#[test]
fn crests_are_bright_where_the_water_is_dense() {
    let mut spec = spec([30, 30, 30], 20);
    spec.k_noise = 0.0;
    spec.structure.crest = 0.6;
    let volume = build(&spec);
    for cell in volume.cells.iter().filter(|c| c.has_direction()) {
        let (k_d, k_s) = cell.k();
        // The bound is one step of k's code and one of ρ's.
        assert!((k_d - (0.5 + 0.6 * (cell.rho() - 0.5))).abs() < 0.5 / 255.0 + 1e-5);
        assert!((k_s - 0.5).abs() < 0.5 / 255.0 + 1e-6);
    }
}

#[test]
fn a_coherent_volume_tiles_along_the_flow() {
    let mut spec = rich([20, 64, 20], 30);
    spec.structure = Structure { coherence: 1.0, coverage: 0.0, ..spec.structure };
    let volume = build_water(&spec, &taki::util::monitor::Unwatched).unwrap();
    // Mean |Δρ| between neighbours along y, by the y of the first. The seam must not stand out.
    let step = |y: u32| {
        let next = (y + 1) % 64;
        let (mut n, mut sum) = (0.0, 0.0f64);
        for (x, z) in (0..20).flat_map(|z| (0..20).map(move |x| (x, z))) {
            let [a, b] = [y, next].map(|y| volume.cells[volume.index(x, y, z)]);
            if a.has_direction() && b.has_direction() {
                n += 1.0;
                sum += f64::from((a.rho() - b.rho()).abs());
            }
        }
        sum / n
    };
    let inside = (0..63).map(step).fold(0.0, f64::max);
    assert!(step(63) <= inside, "{} {inside}", step(63));
}
