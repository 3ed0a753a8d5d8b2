//! §2 The builder of skin: how much tissue there is, where the epidermis lies, and its surface.

use glam::Vec3;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, SkinSpec, VolumeTexture};

use super::same_on_any_number_of_threads;

const SPEC: SkinSpec = SkinSpec {
    size: [64, 48, 12],
    plates: 12,
    furrow_cells: 0.8,
    epidermis_cells: 0.4,
    freckles: 0.0,
    flush: 0.0,
    seed: 3,
    alpha: 1.0,
};

fn build(spec: &SkinSpec) -> VolumeTexture {
    spec.build(&Unwatched).expect("skin")
}

/// Place of a cell on the ramp, 0 to 1.
fn place(cell: &Cell) -> f32 {
    cell.k().1
}

/// Sum of ρ down a column, cells.
fn height(volume: &VolumeTexture, x: u32, y: u32) -> f32 {
    (0..volume.size[2]).map(|z| volume.cell(x, y, z).rho()).sum()
}

#[test]
fn smooth_skin_is_full_with_a_thin_epidermis_and_an_upright_normal() {
    let volume = build(&SkinSpec { plates: 0, ..SPEC });
    for (i, cell) in volume.cells.iter().enumerate() {
        let z = i / (64 * 48);
        assert_eq!(cell.rho(), 1.0);
        assert_eq!(cell.v(), -Vec3::Z, "the surface faces outwards");
        let want = if z == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
        assert!((place(cell) - want).abs() <= 0.5 / 255.0, "layer {z}: {}", place(cell));
    }
}

#[test]
fn a_thick_epidermis_ends_at_its_depth() {
    let volume = build(&SkinSpec { plates: 0, epidermis_cells: 2.25, ..SPEC });
    let places: Vec<f32> = (0..4).map(|z| place(&volume.cell(5, 6, z))).collect();
    for (z, want) in [1.0 / 3.0, 1.0 / 3.0, (0.25 + 0.75 * 2.0) / 3.0, 2.0 / 3.0].into_iter().enumerate() {
        assert!((places[z] - want).abs() <= 0.5 / 255.0, "layer {z}: {}", places[z]);
    }
}

#[test]
fn furrows_are_as_deep_as_asked_and_their_slope_is_in_the_normals() {
    let volume = build(&SPEC);
    let nz = volume.size[2] as f32;
    let depths: Vec<f32> =
        (0..64 * 48).map(|column| nz - height(&volume, column % 64, column / 64)).collect();
    let deepest = depths.iter().copied().fold(0.0, f32::max);
    let mean = depths.iter().sum::<f32>() / depths.len() as f32;
    assert!((0.75..=0.8 + 1e-4).contains(&deepest), "{deepest}");
    // Borders of cells of size 1 are some 2 a unit of area; a furrow's profile is worth 2.5 · 0.12 of width.
    // Where borders meet, it does not add up.
    assert!((0.4..0.6).contains(&(mean / 0.8)), "{mean}");
    let mut seen = 0;
    for (x, y) in (0..48).flat_map(|y| (0..64).map(move |x| (x, y))) {
        let at = |dx: u32, dy: u32| nz - height(&volume, (x + dx) % 64, (y + dy) % 48);
        let slope = 0.5 * Vec3::new(at(1, 0) - at(63, 0), at(0, 1) - at(0, 47), -2.0);
        let v = volume.cell(x, y, 1).v();
        // Depths have steps of 1/65535 a cell, and directions some 0.08°.
        assert!(v.dot(slope.normalize()) > 0.99999, "{x} {y}: {v} {slope}");
        seen += usize::from(slope.truncate().length() > 0.1);
    }
    assert!(seen > 300, "{seen} columns are steep");
}

#[test]
fn plates_are_as_many_as_asked() {
    // Furrows along rows.
    let of = |plates: u32| {
        let volume = build(&SkinSpec { plates, size: [128, 128, 8], ..SPEC });
        let deep = |x: u32, y: u32| 8.0 - height(&volume, x % 128, y % 128) > 0.5;
        // Each furrow is entered and left.
        let crossed = (0..128).map(|y| (0..128).filter(|&x| deep(x, y) != deep(x + 1, y)).count());
        crossed.sum::<usize>() as f64 / 128.0 / 2.0
    };
    let (few, many) = (of(6), of(12));
    // A line meets about one border a plate; where it follows one, they count as one.
    assert!((0.65..1.2).contains(&(few / 6.0)), "{few}");
    assert!((0.9..1.1).contains(&(many / few / 2.0)), "{few} {many}");
}

#[test]
fn freckles_cover_their_share_and_lie_in_the_epidermis() {
    let volume = build(&SkinSpec { plates: 0, freckles: 0.2, ..SPEC });
    let top: Vec<f32> = (0..64 * 48).map(|column| place(&volume.cell(column % 64, column / 64, 0))).collect();
    let dark = top.iter().filter(|place| **place < 1.0 / 3.0 - 0.003).count() as f32 / top.len() as f32;
    assert!((0.17..=0.2).contains(&dark), "{dark}");
    assert!((0..64 * 48).all(|column| place(&volume.cell(column % 64, column / 64, 1)) > 0.66));
}

#[test]
fn flush_brings_blood_into_the_dermis_alone() {
    let volume = build(&SkinSpec { plates: 0, flush: 0.5, ..SPEC });
    let of = |z: u32| -> Vec<f32> {
        (0..64 * 48).map(|column| place(&volume.cell(column % 64, column / 64, z))).collect()
    };
    assert!(of(0).iter().all(|place| *place < 0.34));
    // Half of the places have more than the mean.
    let more = of(5).iter().filter(|place| **place > 0.67).count() as f32 / (64.0 * 48.0);
    assert!((0.4..0.6).contains(&more), "{more}");
    assert!(of(5).iter().all(|place| *place > 0.66));
}

#[test]
fn a_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let spec = SkinSpec { freckles: 0.1, flush: 0.3, ..SPEC };
    let one = same_on_any_number_of_threads(|| build(&spec));
    assert_ne!(one, build(&SkinSpec { seed: 4, ..spec }));
    for size in [[1, 1, 1], [1, 50, 2], [7, 3, 1]] {
        build(&SkinSpec { size, plates: 10_000, epidermis_cells: 100.0, ..spec });
    }
}
