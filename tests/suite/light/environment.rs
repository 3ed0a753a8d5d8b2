//! Environments against closed forms in float64. `file` tests map files and their faults, `foreign` maps of
//! other programs, `sky` the sky, `scene` both engines.

mod file;
mod foreign;
mod scene;
mod sky;

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use taki::light::environment::{
    Cells, Irradiance, LightSet, Map, angle_of, direction_at, error_of, luminance, moments_of_map, uv_of,
};

/// Rounding error of float32 values after a few operations, each good to 6e-8.
const ROUNDING: f64 = 1e-6;

/// A map whose texels hold `radiance` of the direction through their middle.
pub fn map(width: u32, height: u32, radiance: impl Fn(DVec3) -> DVec3) -> Map {
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let d = direction_at((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
        radiance(d).as_vec3().extend(0.0).to_array()
    };
    Map { width, height, texels: (0..width * height).map(texel).collect() }
}

/// Radiance with a bright spot, colours and no symmetry.
pub fn uneven(d: DVec3) -> DVec3 {
    let spot = (40.0 * (d.dot(DVec3::new(0.6, 0.64, -0.48)) - 1.0)).exp();
    DVec3::new(0.4 + 0.3 * d.x + 9.0 * spot, 0.5 + 0.2 * d.y * d.z + 7.0 * spot, 0.6 + 0.3 * d.y + 5.0 * spot)
}

/// Directions spread over the whole sphere.
pub fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let y = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (i as f64 * 2.399963).sin_cos();
        DVec3::new((1.0 - y * y).sqrt() * sin, y, (1.0 - y * y).sqrt() * cos)
    })
}

fn solid_angle(map: &Map, y: u32) -> f64 {
    let edge = |j: u32| (PI * j as f64 / map.height as f64).cos();
    (edge(y) - edge(y + 1)) * TAU / map.width as f64
}

fn about(d: DVec3, turn: f64) -> DVec3 {
    glam::DQuat::from_axis_angle(DVec3::Y, turn * TAU) * d
}

#[test]
fn the_six_axes_lie_where_the_convention_says() {
    let places = [
        (Vec3::NEG_Z, 0.5, 0.5),
        (Vec3::X, 0.75, 0.5),
        (Vec3::NEG_X, 0.25, 0.5),
        (Vec3::Y, 0.5, 0.0),
        (Vec3::NEG_Y, 0.5, 1.0),
    ];
    for (d, u, v) in places {
        let [got_u, got_v] = uv_of(d, 0.0);
        // At a pole every u is correct.
        let u_is = d.y != 0.0 || (f64::from(got_u) - u).abs() < ROUNDING;
        assert!(u_is && (f64::from(got_v) - v).abs() < ROUNDING, "{d}: {got_u} {got_v}");
        assert!((direction_at(u, v).as_vec3() - d).length() < 1e-6, "{d}");
    }
    let [u, v] = uv_of(Vec3::Z, 0.0);
    assert!(u.min(1.0 - u) < 1e-6 && (v - 0.5).abs() < 1e-6, "+z is at the edge: {u} {v}");
    // After a turn from +z towards +x, the light from +z is seen at +x.
    let [u, _] = uv_of(Vec3::X, 0.25);
    assert!(u.min(1.0 - u) < 1e-6, "{u}");
}

#[test]
fn directions_and_places_in_the_map_are_inverse_to_each_other() {
    for d in directions(4000) {
        for turn in [0.0, 0.3] {
            let [u, v] = uv_of(d.as_vec3(), turn as f32);
            assert!((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v));
            let back = about(direction_at(u.into(), v.into()), turn);
            // u and v are float32, so the angle is off by 2π times their last digit.
            assert!((back - d).length() < 1.5e-6, "{d} {back}");
        }
    }
}

#[test]
fn the_arctangent_is_good_to_the_last_digits_all_round() {
    for i in 0..20_000 {
        let angle = (i as f64 / 20_000.0 - 0.5) * TAU * 0.99999;
        let (y, x) = ((3.0 * angle.sin()) as f32, (3.0 * angle.cos()) as f32);
        let right = f64::from(y).atan2(f64::from(x));
        // The polynomial is off by 2e-8. Values of up to π are rounded a few times.
        assert!((f64::from(angle_of(y, x)) - right).abs() < 6e-7, "{angle}");
    }
    assert_eq!(angle_of(0.0, 0.0), 0.0);
}

#[test]
fn radiance_is_the_texels_own_in_its_middle_and_linear_between_and_wraps_round() {
    let map = map(8, 4, uneven);
    let at = |x: u32, y: u32| Vec3::from_slice(&map.texels[(y * 8 + x) as usize]);
    for y in 0..4 {
        for x in 0..8 {
            let (u, v) = ((x as f32 + 0.5) / 8.0, (y as f32 + 0.5) / 4.0);
            assert!((map.radiance([u, v]) - at(x, y)).length() < 1e-5);
            let next = at((x + 1) % 8, y);
            let between = map.radiance([(u + 0.25 / 8.0).fract(), v]);
            assert!((between - (at(x, y) * 0.75 + next * 0.25)).length() < 1e-5, "{x} {y}");
            let below = at(x, (y + 1).min(3));
            let between = map.radiance([u, v + 0.5 / 4.0]);
            assert!((between - (at(x, y) + below) * 0.5).length() < 1e-5, "{x} {y}");
        }
    }
    // Both sides of the map's edge agree. The poles return the texels of the outermost rows.
    assert!((map.radiance([0.0, 0.5]) - map.radiance([1.0, 0.5])).length() < 1e-5);
    assert_eq!(map.radiance([0.5 / 8.0, 0.0]), at(0, 0));
    assert_eq!(map.radiance([0.5 / 8.0, 1.0]), at(0, 3));
}

#[test]
fn even_light_gives_pi_times_its_radiance_on_every_normal_exactly() {
    for (width, height) in [(1, 1), (2, 1), (7, 3), (64, 32)] {
        let moments = moments_of_map(&map(width, height, |_| DVec3::new(1.0, 2.0, 0.5)));
        assert!((moments[0] - DVec3::new(1.0, 2.0, 0.5) * 4.0 * PI).length() < 1e-9);
        // Every other moment integrates to zero over the sphere, however coarse the map is.
        assert!(moments[1..].iter().all(|m| m.length() < 1e-12), "{moments:?}");
        let irradiance = Irradiance::new(&moments, 0.0, 1.0);
        for n in directions(50) {
            let e = irradiance.at(n.as_vec3());
            assert!((e - Vec3::new(1.0, 2.0, 0.5)).length() < 1e-6, "{width}×{height} {n}: {e}");
        }
    }
}

#[test]
fn moments_are_the_integrals_of_the_directions_products() {
    // A fine map of a polynomial whose products have integrals in closed form: ∫x²=4π/3, ∫x⁴=4π/5,
    // ∫x²y²=4π/15.
    let (a, b) = (0.7, 0.4);
    let fine = map(512, 256, |d| DVec3::new(1.0 + a * d.x, 1.0 + b * d.y * d.z, 1.0 + d.x * d.x - d.z * d.z));
    let m = moments_of_map(&fine);
    let expected = [
        (0, DVec3::splat(4.0 * PI)),
        (1, DVec3::new(a * 4.0 * PI / 3.0, 0.0, 0.0)),
        (2, DVec3::ZERO),
        (3, DVec3::ZERO),
        (4, DVec3::ZERO),
        (5, DVec3::new(0.0, b * 4.0 * PI / 15.0, 0.0)),
        (6, DVec3::ZERO),
        (7, DVec3::ZERO),
        (8, DVec3::new(0.0, 0.0, 2.0 * (4.0 * PI / 5.0 - 4.0 * PI / 15.0))),
    ];
    for (i, right) in expected {
        // A texel has one value but the polynomial varies inside it, so the error is of the order of half a
        // texel squared.
        assert!((m[i] - right).length() < 1e-3, "{i}: {} {right}", m[i]);
    }
}

#[test]
fn light_of_the_first_two_orders_gives_its_exact_irradiance() {
    // E/π of L = 1 is 1. For L = x, y or z it is two thirds of L; for products of the second order, a
    // quarter.
    type Order = fn(DVec3) -> f64;
    let orders: [(f64, Order); 8] = [
        (2.0 / 3.0, |d| d.x),
        (2.0 / 3.0, |d| d.y),
        (2.0 / 3.0, |d| d.z),
        (0.25, |d| d.x * d.y),
        (0.25, |d| d.y * d.z),
        (0.25, |d| d.y * d.y - 1.0 / 3.0),
        (0.25, |d| d.x * d.z),
        (0.25, |d| d.x * d.x - d.z * d.z),
    ];
    for (i, (share, order)) in orders.into_iter().enumerate() {
        let fine = map(512, 256, |d| DVec3::splat(1.0 + 0.8 * order(d)));
        let irradiance = Irradiance::new(&moments_of_map(&fine), 0.0, 1.0);
        for n in directions(200) {
            let right = 1.0 + 0.8 * share * order(n);
            assert!((f64::from(irradiance.at(n.as_vec3()).x) - right).abs() < 1e-4, "{i} {n}");
        }
    }
}

#[test]
fn light_from_one_half_is_exact_and_light_from_one_spot_is_never_negative() {
    // Light from the whole upper half gives E(n) = π(1 + n·y)/2, which has only the zeroth and first orders.
    let half = map(256, 128, |d| DVec3::splat(if d.y > 0.0 { 1.0 } else { 0.0 }));
    let irradiance = Irradiance::new(&moments_of_map(&half), 0.0, 1.0);
    for n in directions(500) {
        let right = (1.0 + n.y) / 2.0;
        let got = f64::from(irradiance.at(n.as_vec3()).y);
        assert!((got - right).abs() < 1e-5, "{n} {got}");
    }
    // A spot straight up gives ¼ + c/2 + 5/32·(3c² − 1) with c = n·y, which is below zero around c = −8/15.
    let spot = map(64, 32, |d| DVec3::splat(if d.y > 0.995 { 100.0 } else { 0.0 }));
    let irradiance = Irradiance::new(&moments_of_map(&spot), 0.0, 1.0);
    let c = -8.0f32 / 15.0;
    let raw = irradiance.0[0] + irradiance.0[2] * c + irradiance.0[6] * (3.0 * c * c - 1.0);
    assert!(raw.max_element() < -0.001 * irradiance.0[0].x, "{raw}");
    assert_eq!(irradiance.at(Vec3::new((1.0 - c * c).sqrt(), c, 0.0)), Vec3::ZERO);
    assert!(directions(500).all(|n| irradiance.at(n.as_vec3()).min_element() >= 0.0));
}

#[test]
fn the_lights_have_all_the_maps_power_and_no_more() {
    for radiance in [(|_| DVec3::ONE) as fn(DVec3) -> DVec3, uneven] {
        for (width, height) in [(64, 32), (700, 301)] {
            let map = map(width, height, radiance);
            let mut total = DVec3::ZERO;
            for (i, texel) in map.texels.iter().enumerate() {
                total += Vec3::from_slice(texel).as_dvec3() * solid_angle(&map, i as u32 / width);
            }
            let cells = Cells::new(&map);
            for count in [1, 2, 24, 1024] {
                let lights = LightSet::new(&cells, count).lights;
                assert_eq!(lights.len(), count as usize);
                let sum: DVec3 = lights.iter().map(|(_, power)| *power).sum();
                assert!((sum / total - DVec3::ONE).abs().max_element() < 1e-10, "{count}: {sum} {total}");
                assert!(lights.iter().all(|(to, _)| (to.length() - 1.0).abs() < 1e-12));
            }
        }
    }
    let even: DVec3 = LightSet::new(&Cells::new(&map(64, 32, |_| DVec3::ONE)), 24)
        .lights
        .iter()
        .map(|(_, power)| *power)
        .sum();
    assert!((even - DVec3::splat(4.0 * PI)).length() < 1e-10, "{even}");
}

#[test]
fn one_bright_texel_becomes_one_light_of_its_direction_and_power() {
    for (x, y) in [(0, 0), (5, 9), (63, 31), (32, 16), (31, 2)] {
        let mut map = map(64, 32, |_| DVec3::ZERO);
        map.texels[y * 64 + x] = [3.0, 2.0, 1.0, 0.0];
        let d = direction_at((x as f64 + 0.5) / 64.0, (y as f64 + 0.5) / 32.0);
        let lights = LightSet::new(&Cells::new(&map), 24).lights;
        assert_eq!(lights.len(), 1);
        let (to, power) = lights[0];
        // The centroid of a texel's light lies slightly off its middle, towards the equator.
        assert!(to.angle_between(d) < 0.03 && (to.y.abs() < d.y.abs() + 1e-9), "{to} {d}");
        assert!((to.x * d.z - to.z * d.x).abs() < 1e-12, "the longitude is the same");
        let right = DVec3::new(3.0, 2.0, 1.0) * solid_angle(&map, y as u32);
        assert!((power / right - DVec3::ONE).length() < 1e-12);
    }
}

#[test]
fn a_black_map_has_no_lights_and_no_error() {
    let cells = Cells::new(&map(16, 8, |_| DVec3::ZERO));
    let set = LightSet::new(&cells, 24);
    assert!(set.lights.is_empty());
    assert_eq!(set.error(&cells), 0.0);
}

#[test]
fn a_turned_map_turns_irradiance_and_lights_with_it() {
    // The turn is a quarter of the columns: the same texels lie at other places, so everything else must be
    // the same.
    let (width, turn) = (64, 0.25);
    let still = map(width, 32, uneven);
    let mut turned = map(width, 32, uneven);
    for row in turned.texels.chunks_exact_mut(width as usize) {
        // u falls as the azimuth grows.
        row.rotate_left(width as usize / 4);
    }
    let of = |map: &Map, turn| Irradiance::new(&moments_of_map(map), turn, 1.0);
    for i in 0..9 {
        let (a, b) = (of(&still, turn).0[i], of(&turned, 0.0).0[i]);
        assert!((a - b).length() < 1e-6, "{i}: {a} {b}");
    }
    for n in directions(100) {
        let back = about(n, -turn);
        let (a, b) = (of(&still, turn).at(n.as_vec3()), of(&still, 0.0).at(back.as_vec3()));
        assert!((a - b).length() < 1e-5, "{n}");
        let seen = still.radiance(uv_of(n.as_vec3(), turn as f32));
        assert!((seen - turned.radiance(uv_of(n.as_vec3(), 0.0))).length() < 1e-3, "{n}");
    }
    // So many lights that the position of the map's edge, which has moved, does not matter.
    let first = |map: &Map| -> DVec3 {
        LightSet::new(&Cells::new(map), 1024).lights.iter().map(|(to, p)| *to * luminance(*p)).sum()
    };
    assert!((about(first(&still), turn) - first(&turned)).length() < 0.01);
}

#[test]
fn more_lights_are_nearer_to_the_map_and_the_error_is_what_it_says() {
    let cells = Cells::new(&map(256, 128, uneven));
    let errors: Vec<f64> =
        [1, 4, 24, 128, 1024].iter().map(|&n| LightSet::new(&cells, n).error(&cells)).collect();
    assert!(errors.windows(2).all(|pair| pair[1] < 0.7 * pair[0]), "{errors:?}");
    assert!(errors[2] < 0.05 && errors[4] < 0.002, "{errors:?}");
    // One light from above replaces even light: E = 4π·max(0, y) instead of π. The mean square of 4max(0,y) −
    // 1 is 16/6 − 2 + 1.
    let even = Cells::new(&map(64, 32, |_| DVec3::ONE));
    let one = LightSet::new(&even, 1).error(&even);
    assert!((one - (16.0 / 6.0 - 1.0f64).sqrt()).abs() < 1e-3, "{one}");
    // The map's own irradiance has no error, and twice that irradiance has an error of 1. Only the cells that
    // horizons cut deviate: in a band of half their height h on both sides, by at most 2h² of the mean.
    let even = Cells::new(&map(512, 256, |_| DVec3::ONE));
    let cut = 2.0 * (PI / 64.0 / 2.0f64).powi(2);
    assert!(error_of(&even, |_| PI) < cut);
    assert!((error_of(&even, |_| 2.0 * PI) - 1.0).abs() < cut);
}

#[test]
fn the_same_map_gives_the_same_lights_on_any_number_of_threads() {
    let map = map(300, 150, uneven);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let cells = Cells::new(&map);
            (moments_of_map(&map), LightSet::new(&cells, 64), cells.beams)
        })
    };
    assert!(on(1) == on(3));
}
