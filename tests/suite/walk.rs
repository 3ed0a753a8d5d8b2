//! §4 The exact walk against a brute-force walker in float64, and its invariants. Reference truth.

use glam::{DVec3, IVec3, Vec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use taki::walk::{Crossing, PARALLEL, Walk};

/// Largest relative error of a boundary parameter. It has a difference, a reciprocal and a product, each
/// rounded to 2^-24, and one more for their products.
const ROUNDING: f64 = 4.0 / (1u64 << 24) as f64;

/// A crossing of a cell boundary: its parameter and axis.
pub type Event = (f64, usize);

/// Cell in which a ray starts, not wrapped. On a face it is the cell that the ray enters.
pub fn true_start(origin: DVec3, direction: DVec3) -> IVec3 {
    IVec3::from_array([0, 1, 2].map(|axis| {
        let x = origin[axis];
        (if direction[axis] < 0.0 { x.ceil() - 1.0 } else { x.floor() }) as i32
    }))
}

/// Every crossing of a cell boundary with a parameter below `t_end`, in order; equal parameters are ordered
/// x, y, z. Each axis is enumerated on its own, without steps.
pub fn true_events(origin: DVec3, direction: DVec3, t_end: f64) -> Vec<Event> {
    let start = true_start(origin, direction);
    let mut events = Vec::new();
    for axis in 0..3 {
        let d = direction[axis];
        if d.abs() < PARALLEL as f64 {
            continue;
        }
        let first = start[axis] as f64 + if d > 0.0 { 1.0 } else { 0.0 };
        let at = |n: i32| (first + n as f64 * d.signum() - origin[axis]) / d;
        events.extend((0..).map(at).take_while(|&t| t < t_end).map(|t| (t, axis)));
    }
    events.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    events
}

fn wrapped(cell: IVec3, size: IVec3) -> IVec3 {
    IVec3::new(cell.x.rem_euclid(size.x), cell.y.rem_euclid(size.y), cell.z)
}

/// Axis of the step from `a` to `b`, with axes that wrap as in the walk. `step` gives the direction of each
/// axis.
fn stepped_axis(a: IVec3, b: IVec3, step: IVec3, size: IVec3) -> Result<usize, TestCaseError> {
    let fits = |axis: usize| {
        let mut next = a;
        next[axis] += step[axis];
        step[axis] != 0 && wrapped(next, size) == b
    };
    (0..3)
        .find(|&axis| fits(axis))
        .ok_or_else(|| TestCaseError::fail(format!("{a} to {b} is no single step")))
}

/// Compares a walk with the truth. Cells may differ only where crossings coincide within rounding.
fn agrees_with_truth(size: IVec3, origin: Vec3, direction: Vec3, t_end: f32) -> Result<(), TestCaseError> {
    let walk: Vec<Crossing> = Walk::new(size, origin, direction, t_end).collect();
    let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
    let slack = |t: f64| t.abs() * ROUNDING;
    let truth = true_events(o, d, t_end as f64 + slack(t_end as f64));
    let certain = truth.iter().filter(|e| e.0 < t_end as f64 - slack(e.0)).count();
    prop_assert!((certain..=truth.len()).contains(&(walk.len() - 1)), "{} of {certain}", walk.len() - 1);

    let mut cell = true_start(o, d);
    prop_assert_eq!(walk[0].cell, wrapped(cell, size));
    let mut per_axis = [0, 1, 2].map(|axis| truth.iter().filter(move |e| e.1 == axis));
    for (i, pair) in walk.windows(2).enumerate() {
        // In a tile of one or two cells, the wrapped cell does not show the axis of a step, so the truth's
        // axis is tried first.
        let t = pair[1].t_enter as f64;
        let (t_true, axis_true) = truth[i];
        prop_assert!((t - t_true).abs() <= slack(t_true), "crossing {i} at {t}, in truth at {t_true}");
        let mut next = cell;
        next[axis_true] += d[axis_true].signum() as i32;
        let axis = if wrapped(next, size) == pair[1].cell {
            axis_true
        } else {
            let step = IVec3::from_array([0, 1, 2].map(|a| match d[a].abs() < PARALLEL as f64 {
                true => 0,
                false => d[a].signum() as i32,
            }));
            stepped_axis(pair[0].cell, pair[1].cell, step, size)?
        };
        cell[axis] += d[axis].signum() as i32;
        prop_assert_eq!(pair[1].cell, wrapped(cell, size));
        let of_axis = per_axis[axis].next();
        prop_assert!(of_axis.is_some(), "one crossing of axis {axis} too many");
        // The order may differ from the truth's only where crossings coincide.
        let own = of_axis.unwrap().0;
        prop_assert!((t - own).abs() <= 2.0 * slack(own), "axis {axis} is crossed at {t}, in truth at {own}");
    }
    Ok(())
}

/// Checks that the lengths add up, that parameters never decrease, and that each cell begins where the last
/// one ended.
fn is_gapless(walk: &[Crossing], t_end: f32) -> Result<(), TestCaseError> {
    prop_assert_eq!(walk[0].t_enter, 0.0);
    prop_assert_eq!(walk.last().unwrap().t_exit, t_end);
    for c in walk {
        prop_assert!(c.t_exit >= c.t_enter, "{:?}", c);
    }
    for pair in walk.windows(2) {
        prop_assert_eq!(pair[0].t_exit, pair[1].t_enter);
    }
    let sum: f64 = walk.iter().map(|c| c.t_exit as f64 - c.t_enter as f64).sum();
    prop_assert!((sum - t_end as f64).abs() <= 1e-12 * t_end as f64, "{sum} is not {t_end}");
    Ok(())
}

/// A component of a start: anywhere, on a face, or on a coarse grid where crossings coincide.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -20.0f32..20.0,
        1 => (-20i32..20).prop_map(|x| x as f32),
        1 => (-80i32..80).prop_map(|x| x as f32 / 4.0),
    ]
}

/// A component of a direction: any, coarse, tiny, zero of either sign, or below every bound.
fn component() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => -1.0f32..1.0,
        2 => (-4i32..=4).prop_map(|x| x as f32 / 4.0),
        1 => -1e-4f32..1e-4,
        1 => prop::sample::select(vec![0.0f32, -0.0, 1e-40, -1e-40, 1e-21, -1e-21]),
    ]
}

fn vector(of: impl Strategy<Value = f32> + Clone) -> impl Strategy<Value = Vec3> {
    [of.clone(), of.clone(), of].prop_map(Vec3::from_array)
}

fn tile() -> impl Strategy<Value = IVec3> {
    [1i32..9, 1i32..9, 1i32..9].prop_map(IVec3::from_array)
}

fn rays(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1992),
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(rays(100_000))]

    #[test]
    fn the_walk_meets_the_cells_a_brute_force_walk_meets(
        size in tile(),
        origin in vector(coordinate().boxed()),
        direction in vector(component().boxed()),
        t_end in 0.01f32..24.0,
    ) {
        agrees_with_truth(size, origin, direction, t_end)?;
        is_gapless(&Walk::new(size, origin, direction, t_end).collect::<Vec<_>>(), t_end)?;
    }
}

proptest! {
    #![proptest_config(rays(10_000))]

    #[test]
    fn the_cells_of_a_ray_form_a_six_connected_chain(
        origin in vector(coordinate().boxed()),
        direction in vector(component().boxed()),
    ) {
        // The tile is as large as the ray's reach, so a wrapped step cannot be mistaken for another.
        let size = IVec3::splat(97);
        let walk: Vec<Crossing> = Walk::new(size, origin, direction, 30.0).collect();
        for pair in walk.windows(2) {
            let step = (pair[1].cell - pair[0].cell).to_array();
            let step = [step[0].rem_euclid(97), step[1].rem_euclid(97), step[2].rem_euclid(97)];
            let distance: i32 = step.map(|s| s.min(97 - s)).iter().sum();
            prop_assert_eq!(distance, 1, "{:?}", pair);
        }
    }

    #[test]
    fn shifting_the_start_by_whole_tiles_changes_nothing(
        size in tile(),
        start in [0u32..4096, 0u32..4096, 0u32..4096],
        tiles in [-50i32..50, -50i32..50],
        direction in vector(component().boxed()),
    ) {
        // Coordinates are multiples of 1/512, so that the shifted start is exact.
        let origin = Vec3::from_array(start.map(|x| x as f32 / 512.0));
        let shift = Vec3::new((tiles[0] * size.x) as f32, (tiles[1] * size.y) as f32, 0.0);
        let here: Vec<Crossing> = Walk::new(size, origin, direction, 20.0).collect();
        let there: Vec<Crossing> = Walk::new(size, origin + shift, direction, 20.0).collect();
        prop_assert_eq!(here, there);
    }

    #[test]
    fn a_slab_meets_at_most_its_layers_and_the_cells_crossed_sideways(
        x in 0.0f32..1.0,
        y in 0.0f32..1.0,
        dx in -12.0f32..12.0,
        dy in -12.0f32..12.0,
        dz in 0.01f32..1.0,
        nz in 1i32..60,
    ) {
        let d = Vec3::new(dx * dz, dy * dz, dz);
        let met = Walk::new(IVec3::new(5, 7, nz), Vec3::new(x, y, 0.0), d, f32::INFINITY)
            .take_while(|c| c.cell.z < nz)
            .count();
        let (d, layers) = (d.as_dvec3(), nz as f64);
        // If the start lies near a face, each sideways axis is crossed once more than its whole cells.
        let most = layers * (1.0 + (d.x / d.z).abs() + (d.y / d.z).abs()) + 2.0;
        prop_assert!(met as f64 <= most * (1.0 + ROUNDING), "{met} cells, at most {most}");
        prop_assert!(met as f64 >= most - 4.0 - layers * ROUNDING, "{met} cells of {most}");
    }
}

/// (cell, t_enter, t_exit) of a walk through a 4×4×4 tile.
fn cells(origin: [f32; 3], direction: [f32; 3], t_end: f32) -> Vec<([i32; 3], f32, f32)> {
    Walk::new(IVec3::splat(4), origin.into(), direction.into(), t_end)
        .map(|c| (c.cell.to_array(), c.t_enter, c.t_exit))
        .collect()
}

#[test]
fn a_zero_component_of_either_sign_never_steps() {
    for zero in [0.0, -0.0] {
        let along_z = cells([0.5, 0.5, 0.0], [zero, zero, 1.0], 2.0);
        assert_eq!(along_z, [([0, 0, 0], 0.0, 1.0), ([0, 0, 1], 1.0, 2.0)]);
        // This holds on a face too, in the cell above it.
        assert_eq!(cells([2.0, 0.5, 0.5], [zero, 0.0, 1.0], 0.5), [([2, 0, 0], 0.0, 0.5)]);
        assert_eq!(cells([2.0, 1.0, 3.0], [zero, zero, zero], 9.0), [([2, 1, 3], 0.0, 9.0)]);
    }
}

#[test]
fn a_start_on_a_face_belongs_to_the_cell_the_ray_goes_into() {
    assert_eq!(cells([1.0, 0.5, 0.5], [1.0, 0.0, 0.0], 1.0), [([1, 0, 0], 0.0, 1.0)]);
    assert_eq!(cells([1.0, 0.5, 0.5], [-1.0, 0.0, 0.0], 1.0), [([0, 0, 0], 0.0, 1.0)]);
    // Beyond the end of the tile its neighbouring copy begins. Along z the ray leaves the slab.
    assert_eq!(cells([0.0, 0.5, 0.5], [-1.0, 0.0, 0.0], 1.0), [([3, 0, 0], 0.0, 1.0)]);
    assert_eq!(cells([4.0, 0.5, 0.5], [1.0, 0.0, 0.0], 1.0), [([0, 0, 0], 0.0, 1.0)]);
    assert_eq!(cells([0.5, 0.5, 0.0], [0.0, 0.0, -1.0], 1.0), [([0, 0, -1], 0.0, 1.0)]);
}

#[test]
fn through_a_corner_one_axis_steps_at_a_time_x_before_y_before_z() {
    let met = cells([0.5, 0.5, 0.5], [1.0, 1.0, 1.0], 1.0);
    let want = [([0, 0, 0], 0.0, 0.5), ([1, 0, 0], 0.5, 0.5), ([1, 1, 0], 0.5, 0.5), ([1, 1, 1], 0.5, 1.0)];
    assert_eq!(met, want);
    let back = cells([1.5, 1.5, 1.5], [-1.0, -1.0, -1.0], 1.0);
    assert_eq!(back.iter().map(|c| c.0).collect::<Vec<_>>(), [[1, 1, 1], [0, 1, 1], [0, 0, 1], [0, 0, 0]]);
}

#[test]
fn a_denormal_component_counts_as_zero_and_gives_finite_parameters() {
    for tiny in [f32::from_bits(1), -f32::from_bits(1), 1e-39, -1e-39, 1e-21] {
        let walk: Vec<Crossing> =
            Walk::new(IVec3::splat(4), Vec3::splat(0.5), Vec3::new(tiny, 1.0, tiny), 50.0).collect();
        assert_eq!(walk.len(), 51);
        assert!(walk.iter().all(|c| c.cell.x == 0 && c.cell.z == 0 && c.t_exit.is_finite()));
    }
}

#[test]
fn no_error_adds_up_along_a_long_ray() {
    let d = Vec3::new(0.3, 0.7, 0.1);
    let last = Walk::new(IVec3::splat(40), Vec3::new(0.1, 0.2, 0.3), d, f32::INFINITY).nth(100_000).unwrap();
    let t = last.t_enter as f64;
    let nearest = (0..3)
        .map(|axis| {
            let x = [0.1f32, 0.2, 0.3][axis] as f64 + t * d[axis] as f64;
            (x - x.round()).abs() / d[axis] as f64
        })
        .fold(f64::INFINITY, f64::min);
    assert!(nearest <= t * ROUNDING, "{nearest} from a boundary at t = {t}");
}
