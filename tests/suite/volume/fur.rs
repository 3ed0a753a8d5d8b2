//! §2 The builder of fur: what its hairs hide, where they stand and lean, and what does not change them.

use glam::Vec3;
use taki::util::monitor::Unwatched;
use taki::volume::{FurSpec, VolumeTexture};

/// Straight guard hairs, thin enough that no cell is full.
const PLAIN: FurSpec = FurSpec {
    size: [32, 48, 20],
    hairs: 700,
    length: 0.8,
    spread: 0.0,
    width_cells: 0.02,
    taper: 0.0,
    undercoat: 0.0,
    undercoat_length: 0.5,
    lean: 0.0,
    h: 0.9,
    amplitude: 0.0,
    clumps: 0,
    clumping: 0.0,
    seed: 5,
    alpha: 1.0,
    k_d: 0.8,
    shade: 0.0,
    k_s: Some(0.3),
};

fn build(spec: &FurSpec) -> VolumeTexture {
    spec.build(&Unwatched).expect("fur")
}

/// Sum of ρ over all cells: length × width of all hairs, where no cell is full.
fn hidden(volume: &VolumeTexture) -> f64 {
    volume.cells.iter().map(|cell| f64::from(cell.rho())).sum()
}

#[test]
fn rho_sums_up_to_length_times_width_of_all_hairs() {
    let codes = 32.0 * 48.0 * 20.0 * 0.5 / 65535.0;
    let (hairs, length, width) = (700.0, 0.8 * 20.0, 0.02);
    let cases = [
        (PLAIN, hairs * length * width),
        // Half of the width is lost in the mean.
        (FurSpec { taper: 1.0, ..PLAIN }, hairs * length * width / 2.0),
        // The arc length of the parabola y = lean·s², 0 ≤ s ≤ 1, over one unit of height.
        (FurSpec { lean: 1.5, ..PLAIN }, hairs * length * width * arc(1.5)),
        // All hairs are half as long.
        (FurSpec { undercoat: 1.0, ..PLAIN }, hairs * length * width / 2.0),
    ];
    for (spec, want) in cases {
        let sum = hidden(&build(&spec));
        assert!((sum - want).abs() < codes + 0.005 * want, "{spec:?}: {sum} not {want}");
    }
    // 40 % of the hairs are undercoat: 280 ± 5 σ of 13.
    let sum = hidden(&build(&FurSpec { undercoat: 0.4, ..PLAIN }));
    let of = |under: f64| (hairs - under / 2.0) * length * width;
    assert!((of(345.0)..of(215.0)).contains(&sum), "{sum}");
}

/// Arc length of y = a·s² from s = 0 to 1.
fn arc(a: f64) -> f64 {
    let steps = 100_000;
    (0..steps).map(|i| (2.0 * a * (f64::from(i) + 0.5) / f64::from(steps)).hypot(1.0)).sum::<f64>()
        / f64::from(steps)
}

#[test]
fn hairs_stand_evenly_on_the_skin_and_lean_as_a_parabola_up_to_their_length() {
    let spec = FurSpec { lean: 0.7, length: 0.75, ..PLAIN };
    let volume = build(&spec);
    let [nx, ny, nz] = spec.size;
    // Tips end 15 of 20 layers above the skin.
    for z in 0..nz {
        let cells: Vec<_> = (0..ny).flat_map(|y| (0..nx).map(move |x| (x, y))).collect();
        let rho: f64 = cells.iter().map(|&(x, y)| f64::from(volume.cell(x, y, z).rho())).sum();
        assert_eq!(rho > 0.0, z >= 5, "layer {z}: {rho}");
        if z < 5 {
            continue;
        }
        let v: Vec3 = cells.iter().map(|&(x, y)| volume.cell(x, y, z).v() * volume.cell(x, y, z).rho()).sum();
        let way = (20.0 - z as f32 - 0.5) / 15.0;
        let slope = 2.0 * 0.7 * way;
        assert!(
            (v.y / -v.z - slope).abs() < 0.02 && (v.x / v.z).abs() < 0.005,
            "layer {z}: {v:?}, slope {slope}"
        );
    }
    // Every quarter of the skin has its share of roots, across the row that is not full.
    let quarter = |i: u32| {
        let rows = i * ny / 4..(i + 1) * ny / 4;
        let cells = rows.flat_map(|y| (0..nx).map(move |x| (x, y)));
        cells.map(|(x, y)| f64::from(volume.cell(x, y, nz - 1).rho())).sum::<f64>()
    };
    let quarters = [0, 1, 2, 3].map(quarter);
    let mean = quarters.iter().sum::<f64>() / 4.0;
    assert!(quarters.iter().all(|own| (own / mean - 1.0).abs() < 0.12), "{quarters:?}");
}

#[test]
fn a_finer_volume_lets_as_much_light_pass() {
    let fine = FurSpec { size: PLAIN.size.map(|n| 2 * n), width_cells: 2.0 * PLAIN.width_cells, ..PLAIN };
    let depth = |spec: &FurSpec| hidden(&build(spec)) / f64::from(spec.size[0] * spec.size[1]);
    let [coarse, fine] = [depth(&PLAIN), depth(&fine)];
    assert!((coarse / fine - 1.0).abs() < 0.005, "{coarse} {fine}");
}

#[test]
fn a_hair_wider_than_a_cell_fills_its_round() {
    for width in [1.0f32, 1.7, 2.0, 5.0, 9.0] {
        let spec = FurSpec { hairs: 1, width_cells: width, length: 1.0, ..PLAIN };
        let volume = build(&spec);
        let layer: Vec<f32> = (0..48 * 32).map(|i| volume.cell(i % 32, i / 32, 10).rho()).collect();
        let sum: f32 = layer.iter().sum();
        // Between a disc and a square, which few strips are.
        let share = sum / (width * width);
        assert!(share > 0.7 && share < 1.02, "{width}: {share}");
        let filled = layer.iter().filter(|&&rho| rho > 0.0).count() as f32;
        assert!(filled <= (width + 2.0) * (width + 2.0), "{width}: {filled} cells");
    }
}

#[test]
fn clumps_gather_the_tips() {
    // A hair is still on its way in the layer of its tip, so a clump takes up to 3×3 cells there.
    let spread = |clumping: f32| {
        let spec = FurSpec { clumps: 12, clumping, ..PLAIN };
        let volume = build(&spec);
        let tips = (0..48).flat_map(|y| (0..32).map(move |x| (x, y)));
        tips.filter(|&(x, y)| volume.cell(x, y, 4).rho_code() > 0).count()
    };
    let [none, half, all] = [0.0, 0.5, 1.0].map(spread);
    assert!(none > 400 && half < none * 4 / 5 && all <= 12 * 9, "{none} {half} {all} cells");
}

#[test]
fn places_on_the_ramp_run_from_root_to_tip_and_undercoat_stays_at_the_root() {
    let spec = FurSpec { k_s: None, length: 1.0, ..PLAIN };
    let volume = build(&spec);
    for z in 0..20 {
        let all = (0..48 * 32).map(|i| volume.cell(i % 32, i / 32, z));
        let places: Vec<f32> = all.filter(|cell| cell.rho_code() > 0).map(|cell| cell.k().1).collect();
        let want = 1.0 - (z as f32 + 0.5) / 20.0;
        assert!(places.iter().all(|place| (place - want).abs() < 0.04), "layer {z}: {places:?}");
    }
    let under = build(&FurSpec { undercoat: 1.0, ..spec });
    assert!(under.flow_cells().all(|cell| cell.k_codes().1 == 0));
    let even = build(&PLAIN);
    assert!(even.flow_cells().all(|cell| cell.k() == (204.0 / 255.0, 77.0 / 255.0)));
}

#[test]
fn one_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let spec = FurSpec {
        hairs: 9000,
        spread: 0.2,
        undercoat: 0.5,
        amplitude: 0.1,
        clumps: 40,
        clumping: 0.5,
        shade: 0.2,
        k_s: None,
        ..PLAIN
    };
    let one = super::same_on_any_number_of_threads(|| build(&spec));
    assert_ne!(one, build(&FurSpec { seed: 6, ..spec }));
}

#[test]
#[ignore = "prints a time"]
fn time_of_128_cells_a_side() {
    let spec = FurSpec {
        size: [128; 3],
        hairs: 4000,
        width_cells: 1.0,
        amplitude: 0.1,
        undercoat: 0.5,
        clumps: 80,
        clumping: 0.5,
        ..PLAIN
    };
    super::print_times(|| build(&spec));
}
