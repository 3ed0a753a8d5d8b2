//! §2 The builder of long hair: what its strands hide, where they run, and what does not change them.

use std::f64::consts::PI;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, HairSpec, VolumeTexture};

/// Straight strands, thin enough that no cell is full.
const PLAIN: HairSpec = HairSpec {
    size: [48, 120, 16],
    strands: 600,
    reach: 0.75,
    spread: 0.0,
    width_cells: 0.03,
    thinning: 0.0,
    locks: 0,
    gathering: 0.0,
    stray: 0.0,
    wave_cells: 0.0,
    waves: 0.0,
    h: 0.9,
    amplitude_cells: 0.0,
    seed: 5,
    alpha: 1.0,
    k_d: 0.8,
    shade: 0.0,
    k_s: Some(0.3),
};

fn build(spec: &HairSpec) -> VolumeTexture {
    spec.build(&Unwatched).expect("hair")
}

/// Cells of the layer at `y`.
fn layer(volume: &VolumeTexture, y: u32) -> Vec<Cell> {
    let [nx, _, nz] = volume.size;
    (0..nz).flat_map(|z| (0..nx).map(move |x| volume.cell(x, y, z))).collect()
}

/// Sum of ρ in the layers from `first` to `end`.
fn hidden(volume: &VolumeTexture, first: u32, end: u32) -> f64 {
    let cells = (first..end).flat_map(|y| layer(volume, y));
    cells.map(|cell| f64::from(cell.rho())).sum()
}

#[test]
fn strands_hide_length_times_width_from_the_rise_to_the_tip() {
    // From layer 10 on the strands are parallel to y, and they end at 90 of 120 cells.
    let want = 600.0 * 0.03;
    let cases = [
        (PLAIN, want * 80.0),
        // At `way` of its length a strand has lost that share of its width.
        (
            HairSpec { thinning: 1.0, ..PLAIN },
            want * (10..90).map(|y| 1.0 - (f64::from(y) + 0.5) / 90.0).sum::<f64>(),
        ),
        // Gathering and locks move strands, and do not lengthen them much.
        (HairSpec { locks: 12, gathering: 0.3, ..PLAIN }, want * 80.0),
        (HairSpec { size: [48, 240, 16], width_cells: 0.03, ..PLAIN }, want * 160.0),
    ];
    for (spec, want) in cases {
        let ny = spec.size[1];
        let sum = hidden(&build(&spec), ny / 12, ny);
        assert!((sum / want - 1.0).abs() < 0.006, "{spec:?}: {sum} not {want}");
        assert_eq!(hidden(&build(&spec), ny * 3 / 4 + 1, ny), 0.0, "{spec:?}");
    }
    // Strands of different reach end one after the other: the mean stays.
    let sum = hidden(&build(&HairSpec { spread: 0.1, ..PLAIN }), 10, 120);
    assert!((sum / (want * 80.0) - 1.0).abs() < 0.02, "{sum}");
}

#[test]
fn strands_run_from_the_skin_to_the_tip_with_the_sign_of_the_flow() {
    let spec =
        HairSpec { locks: 20, gathering: 0.6, wave_cells: 1.0, waves: 3.0, amplitude_cells: 1.0, ..PLAIN };
    let volume = build(&spec);
    let back = volume.flow_cells().filter(|cell| cell.v().y <= 0.0).count();
    assert!(back * 200 < volume.flow_cells().count(), "{back} cells point to the root");
    // Roots stand on the skin. From the rise on, strands fill the depth evenly.
    let roots = layer(&build(&PLAIN), 0);
    let on_skin: f32 = roots[15 * 48..].iter().map(|cell| cell.rho()).sum();
    assert!(on_skin > 0.95 * roots.iter().map(|cell| cell.rho()).sum::<f32>());
    let full = layer(&build(&PLAIN), 60);
    let depths: Vec<f32> =
        full.chunks(48).map(|row| row.iter().map(|cell| cell.rho()).sum()).collect::<Vec<f32>>();
    let mean = depths.iter().sum::<f32>() / 16.0;
    assert!(depths.iter().all(|own| (own / mean - 1.0).abs() < 0.3), "{depths:?}");
}

#[test]
fn locks_gather_their_strands_at_the_tip_and_strays_stay_away() {
    let filled = |spec: &HairSpec| {
        let volume = build(&HairSpec { reach: 1.0, ..*spec });
        layer(&volume, 119).iter().filter(|cell| cell.rho_code() > 0).count()
    };
    let locks = HairSpec { locks: 10, ..PLAIN };
    let [none, half, all] = [0.0, 0.5, 1.0].map(|gathering| filled(&HairSpec { gathering, ..locks }));
    // A strand is still on its way in the last cell, so a lock may take four of them.
    assert!(none > 300 && half < none * 3 / 4 && all <= 40, "{none} {half} {all} cells");
    assert_eq!(build(&HairSpec { stray: 1.0, gathering: 0.7, ..locks }), build(&PLAIN));
    let [few, many] = [0.1, 0.6].map(|stray| filled(&HairSpec { gathering: 1.0, stray, ..locks }));
    assert!(all < few && few < many && many < none, "{all} {few} {many} {none} cells");
}

#[test]
fn waves_have_the_amplitude_and_the_number_that_the_recipe_says() {
    // Few strands in a wide volume, so that hardly any two meet in a cell.
    let size = [120, 120, 40];
    let spec = HairSpec { size, strands: 400, locks: 400, wave_cells: 0.8, waves: 4.0, reach: 1.0, ..PLAIN };
    let volume = build(&spec);
    let (mut sum, mut all) = (0.0, 0.0);
    for cell in (12..120).flat_map(|y| layer(&volume, y)).filter(|cell| cell.has_direction()) {
        let (v, rho) = (cell.v().as_dvec3(), f64::from(cell.rho()));
        // Length along y alone, which does not depend on the slope.
        let weight = rho * v.y.abs();
        sum += weight * (v.x / v.y).powi(2);
        all += weight;
    }
    // The mean square of the slope of a sine, with the spread of amplitude (0.3) and pace (0.15).
    let slope = 2.0 * PI * 4.0 * 0.8 / 120.0;
    let want = 0.5 * slope * slope * (1.0 + 0.09) * (1.0 + 0.0225);
    assert!((sum / all / want - 1.0).abs() < 0.15, "{} not {want}", sum / all);
}

#[test]
fn places_on_the_ramp_run_from_root_to_tip() {
    let volume = build(&HairSpec { k_s: None, reach: 1.0, ..PLAIN });
    for y in 10..120 {
        let want = (y as f32 + 0.5) / 120.0;
        let cells = layer(&volume, y);
        assert!(
            cells.iter().filter(|cell| cell.rho_code() > 0).all(|cell| (cell.k().1 - want).abs() < 0.01),
            "layer {y}"
        );
    }
    assert!(build(&PLAIN).flow_cells().all(|cell| cell.k() == (204.0 / 255.0, 77.0 / 255.0)));
}

#[test]
fn one_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let spec = HairSpec {
        strands: 9000,
        spread: 0.1,
        thinning: 0.5,
        locks: 30,
        gathering: 0.6,
        stray: 0.1,
        wave_cells: 2.0,
        waves: 3.0,
        amplitude_cells: 1.0,
        shade: 0.2,
        k_s: None,
        ..PLAIN
    };
    let one = super::same_on_any_number_of_threads(|| build(&spec));
    assert_ne!(one, build(&HairSpec { seed: 6, ..spec }));
}

#[test]
#[ignore = "prints a time"]
fn time_of_128_cells_a_side() {
    let spec = HairSpec {
        size: [128; 3],
        strands: 4000,
        width_cells: 0.5,
        locks: 60,
        gathering: 0.5,
        wave_cells: 3.0,
        waves: 3.0,
        amplitude_cells: 1.0,
        ..PLAIN
    };
    super::print_times(|| build(&spec));
}
