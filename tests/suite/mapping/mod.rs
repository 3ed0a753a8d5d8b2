//! §3 The mapping between quad and volume against its definition in float64. Reference truth.

pub mod facing;
pub mod sheet;
pub mod shell;
pub mod splash;
pub mod surge;
pub mod tears;

use glam::{DMat3, DVec2, DVec3, Mat3, Quat, Vec2, Vec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use taki::mapping::{CellFrame, Material, QuadFault, QuadMap};

/// Margin by which the random quads are convex: the smallest sine-like corner measure that they may have.
/// Towards 0 the inverse map becomes singular, and float32 loses digits as 1/margin.
const MARGIN: f64 = 0.1;

/// A random convex planar quad with sides of 0.1 to 20 m, rotated and moved at random.
pub fn quad() -> impl Strategy<Value = [Vec3; 4]> {
    let corner = || [-0.45f64..0.45, -0.45f64..0.45].prop_map(DVec2::from_array);
    let shape = [corner(), corner(), corner(), corner()]
        .prop_map(|d| [d[0], DVec2::X + d[1], DVec2::ONE + d[2], DVec2::Y + d[3]])
        .prop_filter("convex by a margin", |p| {
            (0..4).all(|i| {
                let (e, f) = (p[(i + 1) % 4] - p[i], p[(i + 2) % 4] - p[(i + 1) % 4]);
                e.perp_dot(f) > MARGIN
            })
        });
    let size = [-1.0f64..1.3, -1.0f64..1.3].prop_map(|s| s.map(|s| 10f64.powf(s)));
    let turn = [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0, 0.1f32..1.0];
    let place = [-5.0f32..5.0, -5.0f32..5.0, -5.0f32..5.0];
    (shape, size, turn, place).prop_map(|(p, size, turn, place)| {
        let turn = Quat::from_array(turn).normalize();
        p.map(|p| {
            turn * Vec3::new((p.x * size[0]) as f32, (p.y * size[1]) as f32, 0.0) + Vec3::from_array(place)
        })
    })
}

fn material() -> impl Strategy<Value = Material> {
    (0.1f32..3.0, 0.2f32..5.0, 0.2f32..5.0).prop_map(|(thickness_m, repeat_u, repeat_v)| Material {
        thickness_m,
        repeat_u,
        repeat_v,
        volume: 0,
        billow: Default::default(),
    })
}

/// X(u,v) of the method, computed from the corners.
fn point(corners: [Vec3; 4], u: f64, v: f64) -> DVec3 {
    let [a, b, c, d] = corners.map(Vec3::as_dvec3);
    a * ((1.0 - u) * (1.0 - v)) + b * (u * (1.0 - v)) + c * (u * v) + d * ((1.0 - u) * v)
}

/// ∂X/∂u and ∂X/∂v, computed from the corners.
fn jacobian(corners: [Vec3; 4], u: f64, v: f64) -> (DVec3, DVec3) {
    let [a, b, c, d] = corners.map(Vec3::as_dvec3);
    let g = a - b + c - d;
    (b - a + g * v, d - a + g * u)
}

fn in_plane(map: &QuadMap, x: DVec3) -> Vec2 {
    let away = x - map.a_world.as_dvec3();
    DVec2::new(away.dot(map.e1_world.as_dvec3()), away.dot(map.e2_world.as_dvec3())).as_vec2()
}

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 5_000,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(3),
        max_global_rejects: 100_000,
        max_local_rejects: 1_000_000,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn corners_map_to_the_corners_of_the_unit_square(corners in quad()) {
        let map = QuadMap::new(corners).unwrap();
        for (corner, want) in corners.iter().zip([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]) {
            let (uv, _) = map.uv_and_det(in_plane(&map, corner.as_dvec3()));
            prop_assert!(uv.distance(want) < 1e-4, "{uv}, not {want}");
            prop_assert!(map.point_world(want.x, want.y).distance(*corner) < 1e-5 * 40.0);
            let clamped = map.uv(in_plane(&map, corner.as_dvec3()));
            prop_assert!(clamped == clamped.clamp(Vec2::ZERO, Vec2::ONE));
        }
    }

    #[test]
    fn the_inverse_map_undoes_the_map(corners in quad(), u in 0.0f32..=1.0, v in 0.0f32..=1.0) {
        let map = QuadMap::new(corners).unwrap();
        let uv = Vec2::new(u, v);
        // The inverse is compared with the corners in float64 and with the map's own forward direction.
        let truth = map.uv_and_det(in_plane(&map, point(corners, u as f64, v as f64))).0;
        prop_assert!(truth.distance(uv) < 1e-4, "{truth}, not {uv}");
        let own = map.uv_and_det(map.point(u, v)).0;
        prop_assert!(own.distance(uv) < 1e-4, "{own}, not {uv}");
    }

    #[test]
    fn the_root_is_the_determinant_of_the_jacobian(
        corners in quad(),
        u in 0.0f32..=1.0,
        v in 0.0f32..=1.0,
    ) {
        let map = QuadMap::new(corners).unwrap();
        let (_, s) = map.uv_and_det(in_plane(&map, point(corners, u as f64, v as f64)));
        let (du, dv) = jacobian(corners, u as f64, v as f64);
        let det = du.cross(dv).dot(map.n_world.as_dvec3());
        prop_assert!(det > 0.0, "the corners run counter-clockwise about n");
        prop_assert!((s as f64 / det - 1.0).abs() < 2e-4, "{s}, not {det}");
    }

    #[test]
    fn the_cell_frame_is_the_jacobian_per_cell(
        corners in quad(),
        material in material(),
        size in [1u32..80, 1u32..80, 1u32..80],
        u in 0.0f32..=1.0,
        v in 0.0f32..=1.0,
        d in [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0],
    ) {
        let map = QuadMap::new(corners).unwrap();
        let frame = CellFrame::new(&map, &material, size, Vec2::new(u, v));
        // Columns of the Jacobian in the world, computed from the corners.
        let (du, dv) = jacobian(corners, u as f64, v as f64);
        let columns = [
            du / (material.repeat_u as f64 * size[0] as f64),
            dv / (material.repeat_v as f64 * size[1] as f64),
            map.n_world.as_dvec3() * -(material.thickness_m as f64 / size[2] as f64),
        ];
        let plane =
            DMat3::from_cols(map.e1_world.as_dvec3(), map.e2_world.as_dvec3(), map.n_world.as_dvec3());
        let j = DMat3::from_cols(columns[0], columns[1], columns[2]);
        let in_plane = plane.transpose() * j;
        let own = Mat3::from_cols(
            frame.cx.extend(0.0),
            frame.cy.extend(0.0),
            Vec3::new(0.0, 0.0, -frame.depth),
        ).as_dmat3();
        for axis in 0..3 {
            let (a, b) = (own.col(axis), in_plane.col(axis));
            prop_assert!(a.distance(b) < 1e-5 * b.length().max(1e-3), "column {axis}: {a}, not {b}");
        }
        // d_cell = J⁻¹ d and Jᵀ d are compared in float64 with the frame's own columns.
        let d = Vec3::from_array(d);
        let back = own * frame.cell_from_plane(d).as_dvec3();
        let condition = (frame.cx.length() * frame.cy.length() / frame.det) as f64;
        prop_assert!(back.distance(d.as_dvec3()) < 2e-6 * condition, "{back}, not {d}");
        let transposed = own.transpose() * d.as_dvec3();
        let error = frame.transposed(d).as_dvec3().distance(transposed);
        let largest = (0..3).map(|axis| own.col(axis).length()).fold(0.0, f64::max);
        prop_assert!(error < 1e-6 * largest, "Jᵀd is off by {error}");
        prop_assert!(
            (frame.det as f64 / own.determinant() * -frame.depth as f64 - 1.0).abs() < 2e-5 * condition
        );
    }

    #[test]
    fn a_columns_direction_is_one_cell(corners in quad(), material in material(), u in 0.0f32..=1.0) {
        let map = QuadMap::new(corners).unwrap();
        let frame = CellFrame::new(&map, &material, [7, 9, 11], Vec2::new(u, 0.3));
        let n = Vec3::new(0.0, 0.0, -frame.depth);
        let axes = [(frame.cx.extend(0.0), Vec3::X), (frame.cy.extend(0.0), Vec3::Y), (n, Vec3::Z)];
        for (column, axis) in axes {
            prop_assert!(frame.cell_from_plane(column).distance(axis) < 1e-4);
        }
    }
}

/// A quad in the plane z = 2.
fn flat(corners: [[f32; 2]; 4]) -> Result<QuadMap, QuadFault> {
    QuadMap::new(corners.map(|[x, y]| Vec3::new(x, y, 2.0)))
}

#[test]
fn a_quad_without_area_or_with_a_repeated_corner_is_degenerate() {
    let degenerate = [
        [[1.0, 1.0]; 4],
        [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]],
        [[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 1.0]],
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]],
        // The two halves of an even bow-tie cancel.
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]],
        [[0.0, 0.0], [1.0, f32::NAN], [1.0, 1.0], [0.0, 1.0]],
    ];
    for corners in degenerate {
        assert_eq!(flat(corners), Err(QuadFault::Degenerate), "{corners:?}");
    }
}

#[test]
fn a_concave_or_self_crossing_quad_is_not_convex() {
    let not_convex = [
        // Each of these is concave at another corner.
        [[0.9, 0.9], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        [[0.0, 0.0], [0.2, 0.7], [1.0, 1.0], [0.0, 1.0]],
        [[0.0, 0.0], [1.0, 0.0], [0.3, 0.3], [0.0, 1.0]],
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.7, 0.2]],
        // Bow-ties with unequal halves.
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.0, 1.0]],
        [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [0.0, 1.5]],
        // A corner of 180°.
        [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]],
    ];
    for corners in not_convex {
        assert_eq!(flat(corners), Err(QuadFault::NotConvex), "{corners:?}");
    }
}

#[test]
fn a_quad_that_leaves_its_plane_is_not_planar() {
    let bent = |z: f32| QuadMap::new([Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, z), Vec3::Y]);
    for z in [1.0, -0.3, 1e-2, 1e-3] {
        assert_eq!(bent(z), Err(QuadFault::NotPlanar), "{z}");
    }
    // The rounding of corners far from the origin is accepted.
    assert!(bent(1e-5).is_ok());
}

#[test]
fn the_plane_faces_the_side_from_which_the_corners_run_counter_clockwise() {
    let square = [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]];
    let map = flat(square).unwrap();
    assert_eq!((map.e1_world, map.e2_world, map.n_world), (Vec3::X, Vec3::Y, Vec3::Z));
    assert_eq!((map.e, map.f, map.g), (Vec2::X * 3.0, Vec2::Y * 2.0, Vec2::ZERO));
    let [a, b, c, d] = square;
    assert_eq!(flat([a, d, c, b]).unwrap().n_world, -Vec3::Z);
}

#[test]
fn tiny_and_huge_quads_are_as_good_as_any() {
    for scale in [1e-4f32, 1e-2, 1.0, 1e3, 1e6] {
        let map =
            flat([[0.0, 0.0], [scale, 0.0], [0.9 * scale, scale], [-0.2 * scale, 1.1 * scale]]).unwrap();
        let (uv, _) = map.uv_and_det(map.point(0.25, 0.75));
        assert!(uv.distance(Vec2::new(0.25, 0.75)) < 1e-5, "scale {scale}: {uv}");
    }
}
