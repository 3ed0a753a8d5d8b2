//! Strands along measured flows: where they run, and what they make of the cells.

use glam::DVec3;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, Measured, MeasuredSpec, ReflectBy, StorageChoice, StrandSpec, VolumeTexture};

use super::measured::{SIZE, build, centre, grid, measured, spec, to_world, turning, world_from_cell};

const STRANDS: StrandSpec = StrandSpec {
    count: 300,
    h: 0.9,
    amplitude: 0.0,
    coherence: 0.0,
    strand_length: 0.1,
    coverage: 0.0,
    k_noise: 0.0,
    seed: 4,
};

/// Three cells to a voxel.
fn fine(strands: StrandSpec) -> MeasuredSpec {
    MeasuredSpec { strands: Some(strands), ..spec(SIZE.map(|n| 3 * n)) }
}

/// Cells with matter, with their coordinates.
fn occupied(volume: &VolumeTexture) -> Vec<([u32; 3], Cell)> {
    let [nx, ny, nz] = volume.size;
    let all = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    all.map(|at| (at, volume.cell(at[0], at[1], at[2]))).filter(|(_, cell)| cell.rho_code() > 0).collect()
}

/// Angles between the strands and the velocity at the centres of their cells, degrees, ascending.
fn angles(spec: &MeasuredSpec, volume: &VolumeTexture, truth: impl Fn(DVec3) -> DVec3) -> Vec<f64> {
    let of = |(at, cell): &([u32; 3], Cell)| {
        let v = world_from_cell(spec) * cell.v().as_dvec3();
        v.angle_between(truth(centre(spec, *at))).to_degrees()
    };
    let mut all: Vec<f64> = occupied(volume).iter().map(of).collect();
    all.sort_by(f64::total_cmp);
    all
}

fn in_a_turning_body() -> Measured {
    measured(vec![grid("velocity", |at| turning(to_world().transform_point3(at)).to_array())])
}

#[test]
fn strands_follow_the_flow_and_the_fractal_moves_them() {
    let grids = in_a_turning_body();
    let straight = fine(STRANDS);
    let volume = build(&grids, &straight);
    let all = angles(&straight, &volume, turning);
    assert!(all.len() > 3000, "{} cells", all.len());
    let quantile = |all: &[f64], share: f64| all[(all.len() as f64 * share) as usize];
    assert!(
        quantile(&all, 0.5) < 1.5 && quantile(&all, 0.95) < 6.0,
        "{:?}",
        [0.5, 0.95].map(|s| quantile(&all, s))
    );
    // The other way round, every strand would be seen.
    assert!(quantile(&angles(&straight, &volume, |at| -turning(at)), 0.05) > 170.0);
    let bent = fine(StrandSpec { amplitude: 0.03, ..STRANDS });
    let bent = angles(&bent, &build(&grids, &bent), turning);
    assert!(quantile(&bent, 0.5) > 2.0 * quantile(&all, 0.5), "the fractal bends them");
    assert!(quantile(&bent, 0.5) < 45.0, "they still follow the flow");
}

#[test]
fn cells_of_strands_have_the_papers_densities_and_lie_where_matter_is() {
    let velocity = || vec![grid("velocity", |_| [0.3, -1.0, 0.2])];
    let uniform =
        Measured { density: grid("density", |_| [2.0]), velocity: velocity(), second: None, specular: None };
    let own = fine(STRANDS);
    let volume = build(&uniform, &own);
    assert_eq!(volume.alpha, 2.0);
    // At the border, values between voxels are lower: nothing is known beyond it.
    let is_inside = |at: &[u32; 3]| (0..3).all(|a| at[a] >= 3 && at[a] + 3 < volume.size[a]);
    let inside = occupied(&volume).into_iter().filter(|(at, _)| is_inside(at));
    let flowing: Vec<f64> = inside.map(|(_, cell)| f64::from(cell.rho())).collect();
    assert!(flowing.len() > 2000, "{} cells", flowing.len());
    let share =
        |is: fn(&f64) -> bool| flowing.iter().filter(|rho| is(rho)).count() as f64 / flowing.len() as f64;
    let mean = flowing.iter().sum::<f64>() / flowing.len() as f64;
    // Cells of ρ = 0 are not kept, so of the paper's shares (0.3085 at either end) the first is gone.
    let kept = 1.0 - 0.3085;
    // Three standard errors of 2000 cells are 0.02 and 0.033.
    let whole = share(|rho| *rho == 1.0);
    assert!((mean - 0.5 / kept).abs() < 0.02 && (whole - 0.3085 / kept).abs() < 0.033, "{mean} {whole}");

    let grids = measured(velocity());
    let volume = build(&grids, &own);
    let empty = MeasuredSpec { strands: None, ..own.clone() };
    let even = build(&grids, &empty);
    let strands = occupied(&volume);
    assert!(strands.len() > 2000 && 2 * strands.len() < occupied(&even).len());
    // Trilinear values reach one voxel, three cells, beyond the matter.
    let near = |at: [u32; 3]| {
        let around = |c: u32, n: u32| c.saturating_sub(3)..n.min(c + 4);
        let [nx, ny, nz] = volume.size;
        around(at[2], nz)
            .any(|z| around(at[1], ny).any(|y| around(at[0], nx).any(|x| even.cell(x, y, z).rho_code() > 0)))
    };
    assert!(strands.iter().all(|(at, _)| near(*at)));
}

/// k_d of cells with strands, of which k follows the vorticity from 0 to `most`, 1/s. k_d is 0 at none.
fn churned(velocity: impl Fn(DVec3) -> DVec3, most: f64) -> (MeasuredSpec, Vec<([u32; 3], f64)>) {
    let velocity = grid("velocity", |at| velocity(to_world().transform_point3(at)).to_array());
    let uniform = Measured {
        density: grid("density", |_| [2.0]),
        velocity: vec![velocity],
        second: None,
        specular: None,
    };
    let own = MeasuredSpec {
        reflect: ReflectBy::Vorticity,
        reflect_range: [0.0, most as f32],
        k: [[0.0, 0.5], [1.0, 0.5]],
        ..fine(STRANDS)
    };
    let volume = build(&uniform, &own);
    // The helper's velocity reaches one voxel around the matter. From half a voxel inside, all is known.
    let is_known = |at: &[u32; 3]| (0..3).all(|a| at[a] >= 2 && at[a] + 2 < volume.size[a]);
    let cells = occupied(&volume).into_iter().filter(|(at, _)| is_known(at));
    let cells: Vec<_> = cells.map(|(at, cell)| (at, f64::from(cell.k().0))).collect();
    assert!(cells.len() > 2000, "{} cells", cells.len());
    (own, cells)
}

/// Steps of k_d are 1/255, so it is half of that off, and a little for the velocity in single precision.
const K_STEP: f64 = 1.0 / 255.0;

#[test]
fn churn_is_smooth_in_cells_finer_than_voxels() {
    // The velocity grows with the square of the way along `grows`, and its curl in proportion to that way.
    let (grows, across) = (DVec3::new(2.0, -1.0, 2.0) / 3.0, DVec3::new(1.0, 2.0, 0.0) / 5f64.sqrt());
    let way = |at: DVec3| (at - DVec3::new(3.0, -2.0, 5.0)).dot(grows) - 6.0;
    let (own, cells) = churned(|at| across * way(at).powi(2), 24.0);
    let truth = |at: [u32; 3]| 2.0 * way(centre(&own, at)).abs() / 24.0;
    for &(at, k) in &cells {
        assert!((k - truth(at)).abs() < 0.6 * K_STEP, "{at:?}: {k}, {}", truth(at));
    }
    // Voxel by voxel, k would stand still in two of three cells, and then take three steps at once.
    let values: std::collections::HashMap<_, _> = cells.iter().copied().collect();
    let longest = world_from_cell(&own).x_axis.dot(grows).abs() * 2.0 / 24.0;
    let steps = cells
        .iter()
        .filter_map(|(at, k)| values.get(&[at[0] + 1, at[1], at[2]]).map(|next| (next - k).abs()));
    let steps: Vec<f64> = steps.collect();
    assert!(steps.len() > 500, "{} pairs", steps.len());
    assert!(steps.iter().all(|step| *step < longest + 1.2 * K_STEP), "{longest}");
}

#[test]
fn a_turning_body_churns_evenly_in_strands() {
    let curl = 2.0 * DVec3::new(0.2, 1.0, -0.4).length();
    let (_, cells) = churned(turning, 1.6 * curl);
    assert!(cells.iter().all(|(_, k)| (k - 1.0 / 1.6).abs() < 0.6 * K_STEP));
}

#[test]
fn strands_have_the_same_bits_on_any_number_of_threads_and_in_any_storage() {
    let grids = in_a_turning_body();
    let spec = fine(StrandSpec { amplitude: 0.02, coherence: 0.8, coverage: 0.5, ..STRANDS });
    let on = |threads: usize, storage| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| grids.volume(&spec, storage, 1 << 30, &Unwatched).expect("a volume"))
    };
    let one = on(1, StorageChoice::Dense);
    for (threads, storage) in
        [(5, StorageChoice::Dense), (1, StorageChoice::Sparse), (5, StorageChoice::Sparse)]
    {
        assert_eq!(one.checksum(), on(threads, storage).checksum());
    }
    let other =
        MeasuredSpec { strands: spec.strands.map(|own| StrandSpec { seed: 5, ..own }), ..spec.clone() };
    assert_ne!(one.checksum(), build(&grids, &other).checksum());
}

#[test]
fn without_velocity_there_are_no_strands() {
    let volume = build(&measured(Vec::new()), &fine(STRANDS));
    assert!(occupied(&volume).is_empty());
}
