//! §2 The builder of grains: how many are filled, that no direction is preferred, and what does not change
//! them.

use glam::{Vec3, Vec3Swizzles};
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, GrainsSpec, VolumeTexture};

const FINE: GrainsSpec = GrainsSpec {
    size: [40, 36, 30],
    filled: 0.3,
    settled: 0.0,
    grain_cells: 1.0,
    shade: 0.0,
    seed: 2,
    alpha: 1.0,
    k_d: 0.8,
    k_s: Some(0.4),
};
const CELLS: f64 = 40.0 * 36.0 * 30.0;

fn build(spec: &GrainsSpec) -> VolumeTexture {
    spec.build(&Unwatched).expect("grains")
}

fn filled(volume: &VolumeTexture) -> f64 {
    volume.cells.iter().filter(|cell| cell.rho_code() == 0xffff).count() as f64
}

#[test]
fn the_share_of_grains_is_filled_and_the_rest_is_empty() {
    for share in [0.0f32, 0.1, 0.3, 0.9, 1.0] {
        let volume = build(&GrainsSpec { filled: share, ..FINE });
        let want = CELLS * f64::from(share);
        let error = 5.0 * (want * (1.0 - f64::from(share))).sqrt();
        assert!((filled(&volume) - want).abs() <= error, "{share}: {}", filled(&volume));
        assert!(volume.cells.iter().all(|cell| cell.rho_code() == 0xffff || *cell == Cell::default()));
    }
}

#[test]
fn no_direction_is_preferred() {
    let volume = build(&GrainsSpec { filled: 1.0, ..FINE });
    let all: Vec<Vec3> = volume.cells.iter().map(|cell| cell.v()).collect();
    let mean = all.iter().sum::<Vec3>() / all.len() as f32;
    let squares = all.iter().map(|v| *v * *v).sum::<Vec3>() / all.len() as f32;
    let mixed = all.iter().map(|v| *v * v.zxy()).sum::<Vec3>() / all.len() as f32;
    // 5 standard deviations of means over 43,200 directions: of v, v² and products.
    assert!(mean.abs().max_element() < 5.0 * 0.577 / 207.8, "{mean}");
    assert!((squares - Vec3::splat(1.0 / 3.0)).abs().max_element() < 5.0 * 0.298 / 207.8, "{squares}");
    assert!(mixed.abs().max_element() < 5.0 * 0.258 / 207.8, "{mixed}");
}

#[test]
fn grains_of_several_cells_are_as_many_as_fit_and_go_on_across_the_border() {
    let volume = build(&GrainsSpec { grain_cells: 5.0, filled: 1.0, ..FINE });
    let mut directions: Vec<u32> = volume.cells.iter().map(|cell| cell.y).collect();
    directions.sort_unstable();
    directions.dedup();
    // 8 × 7 × 6 grains, of which few are hidden behind others.
    assert!((320..=336).contains(&directions.len()), "{}", directions.len());
    let same = |a: Cell, b: Cell| usize::from(a.y == b.y);
    let pairs = (0..36).flat_map(|y| (0..30).map(move |z| (y, z)));
    let across: usize = pairs.map(|(y, z)| same(volume.cell(39, y, z), volume.cell(0, y, z))).sum();
    let pairs = (0..36).flat_map(|y| (0..30).map(move |z| (y, z)));
    let inside: usize = pairs.map(|(y, z)| same(volume.cell(19, y, z), volume.cell(20, y, z))).sum();
    let all = 36 * 30;
    assert!(across > all / 2 && inside > all / 2, "{across} {inside} of {all}");
    // The share is that of the grains, of which there are few.
    let some = filled(&build(&GrainsSpec { grain_cells: 3.0, ..FINE })) / CELLS;
    assert!((some - 0.3).abs() < 5.0 * (0.3f64 * 0.7 * 27.0 * 1.4 / CELLS).sqrt(), "{some}");
}

#[test]
fn settled_grains_become_fewer_up_to_the_outer_face() {
    let volume = build(&GrainsSpec { filled: 0.8, settled: 1.0, ..FINE });
    for z in 0..30 {
        let layer = (0..40 * 36).filter(|&i| volume.cell(i % 40, i / 40, z).rho_code() > 0).count() as f64;
        let want = 0.8 * (f64::from(z) + 0.5) / 30.0;
        assert!(
            (layer / 1440.0 - want).abs() < 5.0 * (want * (1.0 - want) / 1440.0).sqrt(),
            "layer {z}: {layer}"
        );
    }
}

#[test]
fn k_varies_from_grain_to_grain_and_places_are_even() {
    let even = build(&FINE);
    assert!(even.flow_cells().all(|cell| cell.k() == (204.0 / 255.0, 102.0 / 255.0)));
    let moments = |values: Vec<f32>| {
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        [mean, (values.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / values.len() as f32).sqrt()]
    };
    let varied = build(&GrainsSpec { shade: 0.1, ..FINE });
    let [mean, deviation] = moments(varied.flow_cells().map(|cell| cell.k().1).collect());
    assert!((mean - 0.4).abs() < 0.002 && (deviation - 0.04).abs() < 0.002, "{mean} {deviation}");
    let placed = build(&GrainsSpec { k_s: None, ..FINE });
    let [mean, deviation] = moments(placed.flow_cells().map(|cell| cell.k().1).collect());
    assert!((mean - 0.5).abs() < 0.02 && (deviation - 12f32.powf(-0.5)).abs() < 0.01, "{mean} {deviation}");
}

#[test]
fn one_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let spec = GrainsSpec { grain_cells: 2.5, shade: 0.3, settled: 0.5, ..FINE };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| build(&spec))
    };
    let one = on(1);
    assert_eq!(one, on(4));
    assert_ne!(one, build(&GrainsSpec { seed: 3, ..spec }));
    for size in [[1, 1, 1], [1, 50, 2], [7, 3, 1]] {
        build(&GrainsSpec { size, grain_cells: 1000.0, ..spec });
    }
}
