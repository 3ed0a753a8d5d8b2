//! Views of a frame, a volume and its curves. Panels are driven by the labels of their controls, without a
//! window.
//!
//! `TAKI_LOOK=FOLDER cargo test --release -- looking` writes pictures of all panels to the folder.

use glam::{IVec3, Vec3};
use taki::curve::CurveShape;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, Structure, VolumeTexture, WaterSpec, build_water, curve_points};
use taki::walk::Walk;

fn spec(size: [u32; 3], across: u32, deep: u32) -> WaterSpec {
    WaterSpec {
        size,
        across,
        deep,
        shape: CurveShape { h: 0.9, sigma_g_cells: 0.05 * size[1] as f32, levels: 7 },
        structure: Structure::default(),
        seed: 7,
        alpha: 0.6,
        k_d: 0.5,
        k_s: 0.5,
        k_noise: 0.1,
    }
}

#[test]
fn the_shown_curve_is_the_curve_the_volume_is_built_from() {
    for seed in 0..20 {
        let spec = WaterSpec { seed, ..spec([24, 40, 18], 1, 1) };
        let volume = build_water(&spec, &Unwatched).expect("a volume");
        let mut points = vec![Vec3::NAN; 3];
        curve_points(&spec, 0, &mut points);
        assert_eq!(points.len(), 129);
        // The builder sums in this order: first the parts in a cell, then the cell.
        let mut directions = vec![Vec3::ZERO; volume.cells.len()];
        let mut open: Option<(IVec3, Vec3)> = None;
        let mut parts = Vec::new();
        for ends in points.windows(2) {
            let d = ends[1] - ends[0];
            for c in Walk::new(IVec3::new(24, 40, 18), ends[0], d, 1.0) {
                let part = d * (c.t_exit - c.t_enter);
                match &mut open {
                    Some((cell, sum)) if *cell == c.cell => *sum += part,
                    _ => parts.extend(open.replace((c.cell, part))),
                }
            }
        }
        parts.extend(open);
        for (c, part) in parts {
            if (0..18).contains(&c.z) {
                directions[volume.index(c.x as u32, c.y as u32, c.z as u32)] += part;
            }
        }
        for (cell, direction) in volume.cells.iter().zip(&directions) {
            assert_eq!(cell.y, Cell::from_direction(*direction).y, "seed {seed}");
        }
    }
}

#[test]
fn fewer_levels_give_points_of_the_same_curve() {
    let fine = spec([24, 40, 18], 5, 3);
    let mut coarse = fine;
    coarse.shape.levels = 4;
    let (mut all, mut some) = (Vec::new(), Vec::new());
    for curve in 0..15 {
        curve_points(&fine, curve, &mut all);
        curve_points(&coarse, curve, &mut some);
        assert!(all.iter().step_by(8).eq(some.iter()), "curve {curve}");
        // Each curve starts in its own square of the grid.
        assert_eq!((all[0].x / 24.0 * 5.0) as usize, curve % 5);
        assert_eq!((all[0].z / 18.0 * 3.0) as usize, curve / 5);
    }
}

#[test]
fn the_histogram_counts_every_flow_cell_once() {
    let volume = build_water(&spec([30, 30, 30], 30, 30), &Unwatched).expect("a volume");
    let s = volume.statistics();
    for bins in [0, 1, 7, 10, 65534] {
        let h = volume.rho_histogram(bins);
        assert_eq!(h.between.len(), bins.max(1));
        assert_eq!(h.total(), s.flow_cells);
        assert!((h.at_zero as f64 / s.flow_cells as f64 - s.rho_share_at_zero).abs() < 1e-12);
        assert!((h.at_alpha as f64 / s.flow_cells as f64 - s.rho_share_at_alpha).abs() < 1e-12);
    }
    let cells = [0.0, 0.1, 0.55, 0.56, 0.999, 1.0]
        .map(|rho| Cell::from_direction(Vec3::Y).with_density(rho, 0.0, 0.0));
    let volume = VolumeTexture {
        size: [7, 1, 1],
        alpha: 0.5,
        cells: cells.into_iter().chain([Cell::default()]).collect::<Vec<_>>().into(),
    };
    let h = volume.rho_histogram(4);
    assert_eq!((h.at_zero, h.between, h.at_alpha), (1, vec![1, 0, 2, 1], 1));
}

#[cfg(feature = "viewer")]
mod panels;
#[cfg(feature = "viewer")]
mod pictures;
