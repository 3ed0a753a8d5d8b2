//! §2 The builder of mountain faces: heights and their roughness, what covers the rock, grass, and what does
//! not change them.

use std::time::Instant;

use taki::util::monitor::Unwatched;
use taki::volume::{MountainSpec, VolumeTexture};

/// Smooth bare rock.
const BARE: MountainSpec = MountainSpec {
    size: [160, 192, 40],
    relief: 0.1,
    h: 0.8,
    block: 0.25,
    fracture: 0.0,
    beds: 0.0,
    scree: 0.0,
    stone_cells: 6.0,
    moss: 0.0,
    soil: 0.0,
    blades: 0,
    blade_length: 0.5,
    blade_width_cells: 0.02,
    blade_lean: 0.0,
    seed: 3,
    alpha: 1.0,
    k_d: 0.8,
    k_s: None,
};

/// Everything at once.
const FULL: MountainSpec = MountainSpec {
    fracture: 0.7,
    beds: 0.5,
    scree: 0.15,
    moss: 0.3,
    soil: 0.4,
    blades: 3000,
    blade_width_cells: 0.5,
    blade_lean: 0.5,
    ..BARE
};

fn build(spec: &MountainSpec) -> VolumeTexture {
    spec.build(&Unwatched).expect("a mountain")
}

/// Sum of ρ of each column, row by row: its height, where there is rock alone.
fn heights(volume: &VolumeTexture) -> Vec<f64> {
    let [nx, ny, nz] = volume.size;
    let column = |i: u32| (0..nz).map(|z| f64::from(volume.cell(i % nx, i / nx, z).rho())).sum();
    (0..nx * ny).map(column).collect()
}

fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64;
    [mean, square.sqrt()]
}

/// Share of the columns in which two volumes differ.
fn share_changed(spec: &MountainSpec, other: &MountainSpec) -> f64 {
    let [a, b] = [spec, other].map(|spec| heights(&build(spec)));
    a.iter().zip(&b).filter(|(a, b)| (*a - *b).abs() > 1e-3).count() as f64 / a.len() as f64
}

#[test]
fn rock_fills_each_column_up_to_its_height_and_no_further() {
    for spec in [BARE, MountainSpec { fracture: 1.0, beds: 1.0, ..BARE }] {
        let volume = build(&spec);
        let [nx, ny, nz] = spec.size;
        for (x, y) in (0..ny).flat_map(|y| (0..nx).map(move |x| (x, y))) {
            let rho: Vec<u32> = (0..nz).rev().map(|z| volume.cell(x, y, z).rho_code()).collect();
            let full = rho.iter().take_while(|&&code| code == 0xffff).count();
            assert!(full >= 1 && rho.iter().skip(full + 1).all(|&code| code == 0), "{x} {y}: {rho:?}");
        }
    }
}

#[test]
fn heights_have_the_mean_and_the_deviation_of_their_relief() {
    for relief in [0.05, 0.1, 0.15] {
        let spec = MountainSpec { relief, block: 0.06, ..BARE };
        let [mean, deviation] = mean_and_deviation(&heights(&build(&spec)));
        // A normal distribution whose hollows below −1.4 σ are filled, at least 1.5 cells high.
        let of = |f: f64| {
            let f = if f < -1.4 { -1.4 - (-1.4 - f).tanh() } else { f };
            ((f + f64::from(MountainSpec::MEAN)) * f64::from(relief) * 40.0).max(1.5)
        };
        let steps = || (-6000..=6000).map(|i| f64::from(i) / 1000.0);
        let weight = |f: f64| (-0.5 * f * f).exp() / (1000.0 * std::f64::consts::TAU.sqrt());
        let want = steps().map(|f| weight(f) * of(f)).sum::<f64>();
        let spread = steps().map(|f| weight(f) * (of(f) - want).powi(2)).sum::<f64>().sqrt();
        assert!((mean / want - 1.0).abs() < 0.01, "{relief}: mean {mean}, not {want}");
        assert!((deviation / spread - 1.0).abs() < 0.02, "{relief}: deviation {deviation}, not {spread}");
    }
    let flat = heights(&build(&MountainSpec { relief: 0.0, ..BARE }));
    assert!(flat.iter().all(|height| (height - 1.5).abs() < 1e-4), "the skin is covered");
}

/// B-spline of degree 7, the autocorrelation of a cubic one.
fn spline_7(x: f64) -> f64 {
    let binomial = [1.0, -8.0, 28.0, -56.0, 70.0, -56.0, 28.0, -8.0, 1.0];
    let term = |k: usize| binomial[k] * (x + 4.0 - k as f64).max(0.0).powi(7);
    (0..9).map(term).sum::<f64>() / 5040.0
}

#[test]
fn differences_of_heights_grow_with_the_distance_as_h_says() {
    let mut slopes = Vec::new();
    for h in [0.2f32, 0.5, 0.9] {
        let lags = [2usize, 4, 8, 16];
        let mut sums = [0.0; 4];
        for seed in 0..6 {
            let spec = MountainSpec { size: [256, 256, 40], h, seed, ..BARE };
            let heights = heights(&build(&spec));
            for (sum, lag) in sums.iter_mut().zip(lags) {
                let of = |i: usize| heights[i] - heights[i / 256 * 256 + (i + lag) % 256];
                *sum += (0..256 * 256).map(|i| of(i).powi(2)).sum::<f64>();
            }
        }
        // Level n has the variance 4^(−n·h) and a lattice of 64/2^n cells, down to 2 cells.
        let level = |n: i32, lag: f64| {
            let scale = 4f64.powf(-f64::from(n) * f64::from(h));
            scale * (spline_7(0.0) - spline_7(lag * 2f64.powi(n) / 64.0))
        };
        let want = lags.map(|lag| (0..=5).map(|n| level(n, lag as f64)).sum::<f64>());
        for i in 0..3 {
            let [got, want] = [sums[i + 1] / sums[i], want[i + 1] / want[i]].map(f64::log2);
            assert!((got - want).abs() < 0.1, "h {h}, lag {}: 2^{got:.3}, not 2^{want:.3}", lags[i]);
        }
        slopes.push((sums[3] / sums[0]).log2());
    }
    assert!(slopes.is_sorted() && slopes[2] - slopes[0] > 1.5, "{slopes:?}");
}

#[test]
fn stones_moss_and_soil_cover_their_shares() {
    for share in [0.1f32, 0.3] {
        let stones = share_changed(&BARE, &MountainSpec { scree: share, ..BARE });
        // The last stone may add its own area.
        let one = std::f64::consts::PI * 36.0 / (160.0 * 192.0);
        assert!((f64::from(share) - 0.005..f64::from(share) + one).contains(&stones), "stones {stones}");
        let moss = share_changed(&BARE, &MountainSpec { moss: share, ..BARE });
        assert!((moss - f64::from(share)).abs() < 0.002, "moss {moss}");
        let soiled = MountainSpec { soil: 0.4, ..BARE };
        let moss = share_changed(&soiled, &MountainSpec { moss: share, ..soiled });
        assert!((moss - 0.6 * f64::from(share)).abs() < 0.002, "moss beside soil {moss}");
        let volume = build(&MountainSpec { soil: share, ..BARE });
        let top =
            |i: u32| (0..40).map(|z| volume.cell(i % 160, i / 160, z)).find(|c| c.rho_code() > 0).unwrap();
        let soil = (0..160 * 192).filter(|&i| top(i).k().1 > 0.38).count() as f64 / (160.0 * 192.0);
        assert!((soil - f64::from(share)).abs() < 0.002, "soil {soil}");
    }
}

#[test]
fn grass_hides_length_times_width_of_its_blades_however_it_leans() {
    let ground = MountainSpec { relief: 0.0, soil: 1.0, ..BARE };
    let bare: f64 = heights(&build(&ground)).iter().sum();
    let grass = |spec: MountainSpec| heights(&build(&spec)).iter().sum::<f64>() - bare;
    let width = 0.004;
    let cases = [(40_000, 0.4, 0.0), (80_000, 0.4, 0.0), (80_000, 0.3, 0.0), (80_000, 0.4, 1.5)];
    for (blades, length, lean) in cases {
        let leaning = MountainSpec { blades, blade_length: length, blade_lean: lean, ..ground };
        let spec = MountainSpec { blade_width_cells: width, ..leaning };
        // Three quarters stand in tufts, whose blades have the mean length; single ones have 0.6 of it. Half
        // of the taper is lost, and half of the first half cell lies in the ground.
        let mean = (0.75 + 0.25 * 0.6) * f64::from(length) * 40.0 - 0.25;
        let want = f64::from(blades) * mean * f64::from(width) * (1.0 - 0.85 / 2.0);
        let got = grass(spec);
        assert!((got / want - 1.0).abs() < 0.06, "{blades} of {length}, lean {lean}: {got} not {want}");
    }
    // Without soil none grows.
    assert_eq!(build(&MountainSpec { blades: 5000, ..BARE }), build(&BARE));
}

#[test]
fn blades_stand_up_and_lean_down_the_slope() {
    let lean = |blade_lean: f32| {
        let spec = MountainSpec { relief: 0.0, soil: 1.0, blades: 8000, blade_lean, ..BARE };
        let volume = build(&spec);
        let above = (0..160 * 192 * 37).map(|i| volume.cells[i]).filter(|cell| cell.has_direction());
        let v: glam::Vec3 = above.map(|cell| cell.v() * cell.rho()).sum();
        [v.x / -v.z, v.y / -v.z]
    };
    let [x, y] = lean(0.0);
    assert!(x.abs() < 0.04 && y.abs() < 0.04, "{x} {y}");
    // The mean of 2s over a blade's way s, by its width 1 − 0.85s, is 0.75; without the first tenth, which
    // lies below these layers, 0.9.
    let [x, y] = lean(1.0);
    assert!(x.abs() < 0.04 && (0.75..0.9).contains(&y), "{x} {y}");
}

#[test]
fn rock_is_matt_with_tangents_to_all_sides_and_grass_alone_shines() {
    let volume = build(&MountainSpec { relief: 0.0, ..BARE });
    let top: Vec<glam::Vec3> = (0..160 * 192).map(|i| volume.cell(i % 160, i / 160, 38).v()).collect();
    let n = top.len() as f32;
    let mean = top.iter().sum::<glam::Vec3>() / n;
    let squares = top.iter().map(|v| *v * *v).sum::<glam::Vec3>() / n;
    assert!(mean.length() < 0.02 && (squares - glam::Vec3::new(0.5, 0.5, 0.0)).length() < 0.02, "{squares}");
    let shiny = build(&MountainSpec { k_s: Some(0.4), ..FULL });
    let k_s = |shines: bool| {
        let of = shiny.cells.iter().filter(move |cell| cell.has_direction() && (cell.k().1 > 0.35) == shines);
        of.count()
    };
    assert!(k_s(true) > 1000 && k_s(false) > 100_000);
    assert!(shiny.cells.iter().all(|cell| cell.rho_code() < 0xffff || cell.k().1 < 0.41));
}

#[test]
fn copies_join_without_a_seam() {
    let spec = MountainSpec { soil: 0.4, moss: 0.2, scree: 0.1, ..BARE };
    let heights = heights(&build(&spec));
    let at = |x: usize, y: usize| heights[(y % 192) * 160 + x % 160];
    let across = |x: usize| (0..192).map(|y| (at(x + 1, y) - at(x, y)).abs()).sum::<f64>() / 192.0;
    let along = |y: usize| (0..160).map(|x| (at(x, y + 1) - at(x, y)).abs()).sum::<f64>() / 160.0;
    let mean = |steps: Vec<f64>| steps.iter().sum::<f64>() / steps.len() as f64;
    let [x, y] = [mean((0..160).map(across).collect()), mean((0..192).map(along).collect())];
    assert!(across(159) < 1.6 * x && along(191) < 1.6 * y, "{} {x}, {} {y}", across(159), along(191));
}

#[test]
fn one_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| build(&FULL))
    };
    let one = on(1);
    assert_eq!(one, on(4));
    assert_ne!(one, build(&MountainSpec { seed: 4, ..FULL }));
}

#[test]
fn extreme_recipes_give_whole_cells() {
    let cases = [
        MountainSpec { size: [1, 1, 1], ..FULL },
        MountainSpec { size: [3, 70, 2], ..FULL },
        MountainSpec { size: [64, 2, 9], block: 0.001, ..FULL },
        MountainSpec { size: [32, 32, 8], relief: 1.0, h: 0.0, block: 1.0, scree: 0.9, soil: 1.0, ..FULL },
        MountainSpec { size: [32, 32, 8], h: 8.0, stone_cells: 16.0, scree: 0.9, moss: 1.0, ..FULL },
        MountainSpec {
            size: [32, 32, 8],
            blade_length: 2.0,
            blade_lean: 10.0,
            blade_width_cells: 16.0,
            ..FULL
        },
        MountainSpec {
            size: [32, 32, 8],
            stone_cells: 0.003,
            scree: 0.5,
            blade_lean: -10.0,
            k_d: 1.0,
            ..FULL
        },
    ];
    for spec in cases {
        let spec = MountainSpec { blades: spec.blades.min(200), ..spec };
        for cell in build(&spec).cells.iter() {
            assert_eq!(cell.rho_code() > 0, cell.has_direction(), "{spec:?}: {cell:?}");
        }
    }
}

#[test]
#[ignore = "prints a time"]
fn time_of_128_cells_a_side() {
    for _ in 0..5 {
        let start = Instant::now();
        let cells = build(&MountainSpec { size: [128; 3], blades: 4000, ..FULL }).statistics().occupied_cells;
        println!("{cells} cells in {:.3} s", start.elapsed().as_secs_f64());
    }
}
