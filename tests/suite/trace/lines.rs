//! Strands finer than cells: what a ray meets of them.

use glam::{DVec3, IVec3, Vec3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, UnitSphere};
use rand_pcg::Pcg64Mcg;
use taki::trace::lines::{STRAND_RADIUS, Segment};
use taki::trace::lookup::StrandTurn;
use taki::volume::Cell;

/// Density of a cell's strand at `p`, cells from the cell's centre, by its definition.
fn density(cell: Cell, p: DVec3) -> f64 {
    let (place, axis) = cell.line();
    let v = cell.v_code().as_dvec3().normalize();
    let w = p - place.as_dvec3();
    let distance2 = w.length_squared() - w.dot(v).powi(2);
    let r2 = f64::from(STRAND_RADIUS).powi(2);
    let across = (1.0 - distance2 / r2).max(0.0).powi(2);
    let along = (1.0 - p[axis].abs()).max(0.0);
    3.0 / (std::f64::consts::PI * r2) * v[axis].abs() * across * along
}

fn random_vec(rng: &mut Pcg64Mcg) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random())
}

#[test]
fn the_density_along_a_ray_is_the_integral_of_its_definition() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let mut met = 0;
    for _ in 0..2000 {
        let cell = Cell::with_line(Vec3::from_array(UnitSphere.sample(&mut rng)), random_vec(&mut rng));
        let (from, to) = (random_vec(&mut rng), random_vec(&mut rng));
        // A ray that is not of unit speed, through part of the cube between the centres.
        let direction = (to - from) * 0.7;
        let segment = Segment { middle: (from + to) * 0.5, direction, half: 0.5 / 0.7 };
        let corner = IVec3::new(rng.random_range(0..2), rng.random_range(0..2), rng.random_range(0..2));
        let steps = 400;
        let sum: f64 = (0..steps)
            .map(|i| {
                let t = (f64::from(i) + 0.5) / f64::from(steps);
                let p = from.as_dvec3().lerp(to.as_dvec3(), t) - corner.as_dvec3();
                density(cell, p)
            })
            .sum();
        let exact = sum / f64::from(steps) / 0.7;
        let through = f64::from(segment.through(cell, corner.as_vec3()));
        assert!((through - exact).abs() < 1e-3 + 1e-3 * exact, "{through} instead of {exact}");
        met += i32::from(exact > 0.1);
    }
    assert!(met > 200, "only {met} rays met their strand");
}

#[test]
fn the_mean_density_of_a_strand_is_that_of_its_cells() {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    for lean in [Vec3::Y, Vec3::new(0.1, 1.0, -0.2), Vec3::new(0.3, -0.5, 0.1), Vec3::new(0.2, 0.1, 1.0)] {
        // One infinite strand, through the middle of a cell: the cells along its axis keep its line.
        let axis = if lean.y.abs() > lean.z.abs() { 1 } else { 2 };
        let start = Vec3::splat(0.5) + lean * 1e-3;
        let samples = 400_000;
        let mut sum = 0.0;
        for _ in 0..samples {
            // A point of the layer between two cells along the axis, in a window around the strand.
            let mut p = (random_vec(&mut rng) - 0.5) * 4.0;
            p[axis] = rng.random();
            for step in 0..2 {
                // The cell that the strand passes `step` cells further, and its place there.
                let along = (step as f32) / lean[axis];
                let at = start + lean * along;
                let corner = at.floor();
                let cell = Cell::with_line(lean, at - corner);
                sum += density(cell, (p + Vec3::splat(0.5) - corner - Vec3::splat(0.5)).as_dvec3());
            }
        }
        // The window is 16 cells wide, and one cell of the layer holds the strand.
        let mean = sum / f64::from(samples) * 16.0;
        assert!((mean - 1.0).abs() < 0.05, "{lean}: {mean}");
    }
}

#[test]
fn no_line_reaches_beyond_the_eight_cells_around_a_point() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    for _ in 0..200_000 {
        let cell = Cell::with_line(Vec3::from_array(UnitSphere.sample(&mut rng)), random_vec(&mut rng));
        let mut p = (random_vec(&mut rng) - 0.5) * 4.0;
        // One coordinate at least is more than a cell away from the cell's centre.
        let far = rng.random_range(0..3);
        p[far] = (1.0 + rng.random::<f32>()).copysign(p[far]);
        let (_, axis) = cell.line();
        let slope = cell.v_code() / cell.v_code()[axis];
        let reached = density(cell, p.as_dvec3());
        // A slanting line can leave its column along its axis, by at most half a cell there.
        if slope[far].abs() < 0.05 || far == axis {
            assert_eq!(reached, 0.0, "{cell:?} at {p}");
        }
    }
}

#[test]
fn the_samples_of_a_pixel_take_turns_to_walk_strands() {
    for samples in [1, 3, 4, 16, 100] {
        let pixel_levels = 0.5 * (samples as f32).log2();
        let shares = |of_pixel: f32| -> Vec<f32> {
            let level = of_pixel - pixel_levels;
            let own = |i| StrandTurn::new(samples, i).level(level, true, 3.0);
            (0..samples).map(own).map(|level| (-level).clamp(0.0, 1.0)).collect()
        };
        assert!(shares(0.0).iter().all(|&share| share == 0.0));
        assert!(shares(-1.0).iter().chain(&shares(-5.0)).all(|&share| share == 1.0));
        for step in 0..=1000 {
            let strands = step as f32 / 1000.0;
            let shares = shares(-strands);
            assert!(shares.is_sorted_by(|a, b| a >= b), "{shares:?}");
            let both = shares.iter().filter(|&&share| share > 0.0 && share < 1.0).count();
            assert!(both <= 1, "{both} of {samples} samples walk both");
            // At the ends of its turn, a sample is a quarter ahead or behind.
            let off = shares.iter().sum::<f32>() - strands * samples as f32;
            assert!(off.abs() < 0.2501, "{off} samples too many at {strands}");
        }
        // Without lines, or seen from afar, the levels are those of the cells.
        let turn = StrandTurn::new(samples, 0);
        assert_eq!(turn.level(-7.0, false, 3.0), 0.0);
        assert_eq!([turn.level(1.25, true, 3.0), turn.level(9.0, true, 3.0)], [1.25, 3.0]);
    }
}
