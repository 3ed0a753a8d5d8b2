//! Volumes measured in simulations: amounts, directions and places, against closed forms.

use glam::{DAffine3, DMat3, DQuat, DVec3, EulerRot};
use taki::grid::{Bounds, Class, Grid};
use taki::util::monitor::Unwatched;
use taki::volume::{
    LevelSetUnit, Measured, MeasuredSpec, ReflectBy, RhoRule, StorageChoice, VelocityAt, VelocityNames,
    VolumeTexture,
};

/// Voxels along each axis, and the index of the first.
pub const SIZE: [u32; 3] = [21, 34, 17];
const FIRST: [i32; 3] = [-5, 3, 11];

/// A transform with voxels of unequal sides, turned and moved.
pub fn to_world() -> DAffine3 {
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.4, -0.9, 0.2);
    DAffine3::from_scale_rotation_translation(DVec3::new(0.1, 0.15, 0.07), turn, DVec3::new(3.0, -2.0, 5.0))
}

/// A grid of the values of a function of the indices.
pub fn grid<const N: usize>(name: &str, f: impl Fn(DVec3) -> [f64; N]) -> Grid {
    let mut values = Vec::new();
    // Other grids reach one voxel farther on each side, so that what lies between their samples is known.
    let more = i32::from(name != "density");
    let first = FIRST.map(|x| x - more);
    let size = SIZE.map(|n| n + 2 * more as u32);
    for z in 0..size[2] as i32 {
        for y in 0..size[1] as i32 {
            for x in 0..size[0] as i32 {
                let at = DVec3::new((first[0] + x).into(), (first[1] + y).into(), (first[2] + z).into());
                values.extend(f(at).map(|x| x as f32));
            }
        }
    }
    Grid::from_dense(name, N, first, size, values, to_world())
}

pub fn spec(cells: [u32; 3]) -> MeasuredSpec {
    let max = [0, 1, 2].map(|a| FIRST[a] + SIZE[a] as i32 - 1);
    MeasuredSpec {
        path: "none".into(),
        density: "density".into(),
        velocity: VelocityNames::None,
        second: None,
        specular: None,
        bounds: Bounds { min: FIRST, max },
        to_world: to_world(),
        scene_from_file: DAffine3::IDENTITY,
        level_set_unit: LevelSetUnit::Auto,
        velocity_scale: 1.0,
        size: cells,
        rho: RhoRule::Linear,
        rho_scale: 1.0,
        velocity_at: VelocityAt::Auto,
        reflect: ReflectBy::Even,
        reflect_range: [0.0, 1.0],
        k: [[0.5, 0.25], [1.0, 0.0]],
        alpha: 1.0,
        strands: None,
    }
}

pub fn build(grids: &Measured, spec: &MeasuredSpec) -> VolumeTexture {
    grids.volume(spec, StorageChoice::Dense, 1 << 30, &Unwatched).expect("a volume")
}

/// Smooth matter with an empty region.
fn density(at: DVec3) -> [f64; 1] {
    let wave = (at.x * 0.7).sin() * (at.y * 0.45).cos() + 0.3 * (at.z * 1.3).sin();
    [(2.5 * wave).max(0.0)]
}

pub fn measured(velocity: Vec<Grid>) -> Measured {
    Measured { density: grid("density", density), velocity, second: None, specular: None }
}

/// Metres of the world per cell, as columns.
pub fn world_from_cell(spec: &MeasuredSpec) -> DMat3 {
    spec.world_from_texture().matrix3
        * DMat3::from_diagonal(DVec3::ONE / DVec3::from_array(spec.size.map(f64::from)))
}

/// The centre of a cell in the world, metres.
pub fn centre(spec: &MeasuredSpec, cell: [u32; 3]) -> DVec3 {
    let at = (DVec3::from_array(cell.map(f64::from)) + 0.5) / DVec3::from_array(spec.size.map(f64::from));
    spec.world_from_texture().transform_point3(at)
}

/// Largest angle between the flow of cells with matter and `truth` of their centres, degrees.
fn worst_angle(spec: &MeasuredSpec, volume: &VolumeTexture, truth: impl Fn(DVec3) -> DVec3) -> f64 {
    let mut worst = 0f64;
    let mut count = 0;
    for z in 0..spec.size[2] {
        for y in 0..spec.size[1] {
            for x in 0..spec.size[0] {
                let cell = volume.cell(x, y, z);
                if cell.has_direction() {
                    let v = world_from_cell(spec) * cell.v().as_dvec3();
                    worst = worst.max(v.angle_between(truth(centre(spec, [x, y, z]))).to_degrees());
                    count += 1;
                }
            }
        }
    }
    assert!(count > 1000 || spec.size != SIZE, "{count} cells");
    worst
}

#[test]
fn the_amount_of_matter_stays_at_every_number_of_cells() {
    let grids = measured(Vec::new());
    let total: f64 = (0..SIZE[2] as i32)
        .flat_map(|z| (0..SIZE[1] as i32).flat_map(move |y| (0..SIZE[0] as i32).map(move |x| [x, y, z])))
        .map(|at| {
            let value = density(DVec3::from_array([0, 1, 2].map(|a| f64::from(FIRST[a] + at[a]))))[0];
            f64::from(value as f32)
        })
        .sum();
    for cells in [SIZE, [7, 12, 6], [1, 1, 1], [20, 33, 16], [40, 50, 60], [3, 34, 100]] {
        for scale in [1.0f32, 0.3, 40.0] {
            let spec = MeasuredSpec { rho_scale: scale, ..spec(cells) };
            let volume = build(&grids, &spec);
            let sum: f64 = volume.cells.iter().map(|cell| f64::from(cell.rho())).sum();
            let share = cells.iter().zip(SIZE).map(|(&n, of)| f64::from(of) / f64::from(n)).product::<f64>();
            let found = sum * f64::from(volume.alpha) * share / f64::from(scale);
            assert!((found / total - 1.0).abs() < 1e-4, "{cells:?} {scale}: {found} of {total}");
            // The densest cell has the largest code, so no ρ is cut off.
            assert_eq!(volume.cells.iter().map(|cell| cell.rho_code()).max(), Some(65535));
        }
    }
}

#[test]
fn each_voxel_is_the_cell_of_its_index() {
    let grids = measured(Vec::new());
    let volume = build(&grids, &spec(SIZE));
    for [x, y, z] in [[0, 0, 0], [4, 30, 16], [20, 33, 3], [9, 1, 7]] {
        let at = DVec3::from_array([x as i32, y as i32, z as i32].map(f64::from));
        let truth = density(at + DVec3::from_array(FIRST.map(f64::from)))[0];
        let found = f64::from(volume.cell(x, y, z).rho() * volume.alpha);
        assert!((found - truth).abs() <= 1e-5 * f64::from(volume.alpha), "{x} {y} {z}: {found} {truth}");
    }
    // The sample of a voxel lies in the middle of its cell.
    let sample = to_world().transform_point3(DVec3::from_array(FIRST.map(f64::from)));
    assert!(centre(&spec(SIZE), [0; 3]).distance(sample) < 1e-12);
}

#[test]
fn opacity_is_that_of_an_edge_of_a_cell() {
    let grids =
        Measured { density: grid("density", |_| [3.0]), velocity: Vec::new(), second: None, specular: None };
    let spec = MeasuredSpec { rho: RhoRule::Opacity, rho_scale: 2.0, ..spec(SIZE) };
    let volume = build(&grids, &spec);
    let edge = (0.1f64 * 0.15 * 0.07).cbrt();
    let truth = 1.0 - (-2.0 * 3.0 * edge).exp();
    assert!((f64::from(volume.cell(3, 4, 5).rho() * volume.alpha) - truth).abs() < 1e-6);
}

#[test]
fn an_even_velocity_is_even_in_the_world_whatever_the_voxels() {
    let velocity = DVec3::new(0.3, -2.0, 0.7);
    let grids = measured(vec![grid("velocity", |_| velocity.to_array())]);
    for cells in [SIZE, [7, 12, 6]] {
        let spec = spec(cells);
        // The code of a direction is exact to 0.08° in the cell, and unequal sides stretch that.
        assert!(worst_angle(&spec, &build(&grids, &spec), |_| velocity) < 0.2);
    }
}

/// Velocity of a body that turns about an axis through a point.
pub fn turning(at: DVec3) -> DVec3 {
    DVec3::new(0.2, 1.0, -0.4).cross(at - DVec3::new(3.7, 0.2, 6.1))
}

#[test]
fn a_turning_body_flows_in_circles_wherever_the_samples_lie() {
    let world = |at: DVec3| to_world().transform_point3(at);
    let centred = grid("velocity", |at| turning(world(at)).to_array());
    let node = grid("velocity", |at| turning(world(at - 0.5)).to_array());
    let face = |at: DVec3, a: usize| turning(world(at - DVec3::AXES[a] * 0.5))[a];
    let faces = grid("velocity", |at| [0, 1, 2].map(|a| face(at, a)));
    let parts = || [0, 1, 2].map(|a| grid("velocity_x", move |at| [face(at, a)])).to_vec();
    let mut staggered = faces.clone();
    staggered.class = Class::Staggered;
    for (what, velocity, at) in [
        ("centres", vec![centred.clone()], VelocityAt::Auto),
        ("centres", vec![centred], VelocityAt::Centre),
        ("nodes", vec![node.clone()], VelocityAt::Node),
        ("faces", vec![faces.clone()], VelocityAt::Staggered),
        ("faces by class", vec![staggered], VelocityAt::Auto),
        ("faces in three grids", parts(), VelocityAt::Staggered),
    ] {
        let spec = MeasuredSpec { velocity_at: at, ..spec(SIZE) };
        let worst = worst_angle(&spec, &build(&measured(velocity), &spec), turning);
        assert!(worst < 0.2, "{what}: {worst}°");
    }
    // Half a voxel is seen: the same numbers in the wrong place.
    for (velocity, at) in [(node, VelocityAt::Centre), (faces, VelocityAt::Centre)] {
        let spec = MeasuredSpec { velocity_at: at, ..spec(SIZE) };
        let worst = worst_angle(&spec, &build(&measured(vec![velocity]), &spec), turning);
        assert!(worst > 1.0, "{worst}°");
    }
}

#[test]
fn velocity_of_another_resolution_is_found_by_its_place() {
    // Half as many voxels, moved by a fraction of one.
    let coarse = to_world()
        * DAffine3::from_translation(DVec3::new(-9.3, -1.2, 6.9))
        * DAffine3::from_scale(DVec3::splat(2.1));
    let (size, mut values) = ([20, 24, 18], Vec::new());
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let at = coarse.transform_point3(DVec3::new(x.into(), y.into(), z.into()));
                values.extend(turning(at).to_array().map(|x| x as f32));
            }
        }
    }
    let velocity = Grid::from_dense("velocity", 3, [0; 3], size, values, coarse);
    let spec = spec(SIZE);
    let worst = worst_angle(&spec, &build(&measured(vec![velocity]), &spec), turning);
    assert!(worst < 0.2, "{worst}°");
}

#[test]
fn k_follows_speed_vorticity_or_a_grid() {
    let world = |at: DVec3| to_world().transform_point3(at);
    let velocity = grid("velocity", |at| turning(world(at)).to_array());
    let curl = 2.0 * DVec3::new(0.2, 1.0, -0.4).length();
    let mut grids = measured(vec![velocity]);
    let foam = |at: DVec3| 0.02 * at.y;
    grids.second = Some(grid("foam", |at| [foam(at)]));
    let of = |reflect, reflect_range| {
        let spec = MeasuredSpec { reflect, reflect_range, ..spec(SIZE) };
        let volume = build(&grids, &spec);
        move |cell: [u32; 3]| {
            let (k_d, k_s) = volume.cell(cell[0], cell[1], cell[2]).k();
            assert!((k_s - (0.25 - 0.5 * (k_d - 0.5))).abs() < 0.01, "{k_d} {k_s}");
            f64::from(2.0 * k_d - 1.0)
        }
    };
    let cells = [[2, 5, 6], [13, 20, 3], [3, 25, 12]];
    let volume = build(&grids, &spec(SIZE));
    let cells: Vec<_> = cells.into_iter().filter(|c| volume.cell(c[0], c[1], c[2]).rho_code() > 0).collect();
    assert!(!cells.is_empty());
    let near =
        |found: f64, truth: f64| assert!((found - truth.clamp(0.0, 1.0)).abs() < 0.006, "{found} {truth}");
    let (speed, churn, age) = (
        of(ReflectBy::Speed, [1.0, 5.0]),
        of(ReflectBy::Vorticity, [0.0, 1.5 * curl as f32]),
        of(ReflectBy::Grid, [0.0, 1.0]),
    );
    for cell in cells {
        let at = centre(&spec(SIZE), cell);
        near(speed(cell), (turning(at).length() - 1.0) / 4.0);
        near(churn(cell), 1.0 / 1.5);
        near(
            age(cell),
            foam(DVec3::from_array(cell.map(f64::from)) + DVec3::from_array(FIRST.map(f64::from))),
        );
    }
}

#[test]
fn threads_and_storage_change_no_bit() {
    let velocity = grid("velocity", |at| [at.x, at.y.sin(), at.z * at.x]);
    let grids = measured(vec![velocity]);
    for cells in [SIZE, [9, 15, 7]] {
        let spec = spec(cells);
        let on = |threads: usize, storage| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| grids.volume(&spec, storage, 1 << 30, &Unwatched).expect("a volume"))
        };
        let one = on(1, StorageChoice::Dense);
        for volume in
            [on(5, StorageChoice::Dense), on(1, StorageChoice::Sparse), on(5, StorageChoice::Sparse)]
        {
            assert_eq!(one.checksum(), volume.checksum());
        }
    }
}

#[test]
fn more_cells_than_the_memory_holds_are_refused_with_the_way_out() {
    let grids = measured(Vec::new());
    for storage in [StorageChoice::Dense, StorageChoice::Sparse, StorageChoice::Auto] {
        let fault = grids.volume(&spec([4000; 3]), storage, 1 << 26, &Unwatched).expect_err("refused");
        assert_eq!(fault.exit_code(), 33);
        assert!(format!("{fault:?}").contains("volume.voxels"), "{fault:?}");
    }
    let spec = MeasuredSpec { rho_scale: f32::MAX, ..spec(SIZE) };
    let fault = grids.volume(&spec, StorageChoice::Dense, 1 << 30, &Unwatched).expect_err("refused");
    assert!(format!("{fault:?}").contains("volume.rho_scale"), "{fault:?}");
}

#[test]
fn the_inside_of_a_level_set_is_even() {
    let middle = DVec3::from_array(FIRST.map(f64::from)) + DVec3::new(10.0, 16.5, 8.0);
    let mut distance = grid("density", |at| [(at - middle).length() - 6.3]);
    // Distances are metres, and these voxels are cubes of 1 m.
    distance.to_world = DAffine3::IDENTITY;
    distance.class = Class::LevelSet;
    let grids = Measured { density: distance, velocity: Vec::new(), second: None, specular: None };
    let spec = MeasuredSpec { to_world: DAffine3::IDENTITY, ..spec(SIZE) };
    let volume = build(&grids, &spec);
    let sum: f64 = volume.cells.iter().map(|cell| f64::from(cell.rho() * volume.alpha)).sum();
    let truth = 4.0 / 3.0 * std::f64::consts::PI * 6.3f64.powi(3);
    assert!((sum / truth - 1.0).abs() < 0.01, "{sum} {truth}");
    assert_eq!(volume.cell(10, 16, 8).rho(), 1.0);
}
