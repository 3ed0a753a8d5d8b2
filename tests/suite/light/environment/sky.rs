//! The sky model against the published coefficients, its symmetries and known properties of daylight.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use taki::light::environment::{
    BakedSky, Cells, Irradiance, LightSet, Sky, UNIT_CD_M2, air_mass, luminance, luminance_cd_m2,
    moments_of_map, sun_irradiance, uv_of,
};

const NOON: Sky = Sky { elevation: 60.0, turbidity: 3.0, ground: Vec3::splat(0.2), sun: 1.0 };

fn at(sky: &BakedSky, x: u32, y: u32) -> Vec3 {
    Vec3::from_slice(&sky.map.texels[(y * sky.map.width + x) as usize])
}

#[test]
fn a_pure_sky_under_a_sun_at_the_zenith_has_the_published_radiance() {
    // Hosek and Wilkie's RGB data at turbidity 1, albedo 0 and the elevation's last control point: nine
    // coefficients and the mean radiance, for red and for blue. Eq. 8 of the paper combines them.
    type Published = (usize, [f64; 9], f64);
    let published: [Published; 2] = [
        (
            0,
            [-1.139072, -0.1796056, 1.923311, 6.788529, -2.364389, -1.064041, 0.1717010, 1.534681, 0.5015810],
            4.324573,
        ),
        (
            2,
            [
                -1.087457, -0.1888896, 0.8156686, 0.3101712, -2.155419, 1.422205, 0.09692261, 3.122404,
                0.4999430,
            ],
            13.90238,
        ),
    ];
    let sky = Sky { elevation: 90.0, turbidity: 1.0, ground: Vec3::ZERO, sun: 1.0 };
    let baked = sky.bake();
    for (channel, [a, b, c, d, e, f, g, i, h], mean) in published {
        for row in [0, 40, 100, 200] {
            let theta = (row as f64 + 0.5) / baked.map.height as f64 * PI;
            // The sun is straight up, so γ = θ.
            let (cos, gamma) = (theta.cos(), theta);
            let mie = (1.0 + cos * cos) / (1.0 + h * h - 2.0 * h * cos).powf(1.5);
            let shape = (1.0 + a * (b / (cos + 0.01)).exp())
                * (c + d * (e * gamma).exp() + f * cos * cos + g * mie + i * cos.sqrt());
            let right = mean * shape * 683.0 / UNIT_CD_M2;
            let got = f64::from(at(&baked, 17, row)[channel]);
            assert!((got / right - 1.0).abs() < 1e-4, "{channel} {row}: {got} {right}");
        }
    }
}

#[test]
fn the_sky_is_the_same_on_both_sides_of_the_sun() {
    for elevation in [0.0, 10.0, 60.0, 90.0] {
        let sky = Sky { elevation, ..NOON }.bake();
        let (width, height) = (sky.map.width, sky.map.height);
        for y in (0..height).step_by(7) {
            for x in 0..width / 2 {
                assert_eq!(at(&sky, x, y), at(&sky, width - 1 - x, y));
            }
        }
    }
}

#[test]
fn the_sky_is_brightest_towards_the_sun_which_stands_where_its_angles_say() {
    let sky = Sky { elevation: 30.0, ..NOON };
    let baked = sky.bake();
    assert!((sky.to_sun() - DVec3::new(0.0, 0.5, -(0.75f64.sqrt()))).length() < 1e-9);
    let [u, v] = uv_of(sky.to_sun().as_vec3(), 0.0);
    let (x, y) = ((u * baked.map.width as f32) as u32, (v * baked.map.height as f32) as u32);
    assert_eq!((x, y), (512, 170));
    // At the sun's height, the sky darkens with the azimuth from the sun, down to the blue at a right angle
    // and beyond.
    let green = |x: u32| at(&baked, x, y).y;
    assert!((512..768).all(|x| green(x) >= green(x + 1)));
    assert!(green(512) > 2.0 * green(900));
    // Above the sun it darkens up to the zenith. Below the sun, the haze at the horizon is bright too.
    let above = |y: u32| at(&baked, 512, y).y;
    assert!((0..y).all(|y| above(y) <= above(y + 1)));
}

#[test]
fn daylight_has_the_luminance_that_is_measured() {
    let baked = NOON.bake();
    // On a clear day the direct sun at 60° gives 80 to 105 klx and the sky alone 8 to 25 klx (CIE 108,
    // Littlefair 1985).
    let direct = luminance(baked.sun) * UNIT_CD_M2;
    assert!((8e4..1.05e5).contains(&direct), "{direct}");
    let up = Irradiance::new(&moments_of_map(&baked.map), 0.0, 1.0).at(Vec3::Y);
    let diffuse = luminance_cd_m2(up) * PI;
    assert!((8e3..2.5e4).contains(&diffuse), "{diffuse}");
    let zenith = luminance_cd_m2(at(&baked, 0, 0));
    assert!((1500.0..9000.0).contains(&zenith), "{zenith}");
    // Away from the sun the sky is blue.
    let away = at(&baked, 0, 100);
    assert!(away.z > 1.5 * away.x, "{away}");
}

#[test]
fn the_sun_fades_and_reddens_with_the_air_it_shines_through() {
    assert!((air_mass(PI / 2.0) - 1.0).abs() < 1e-3);
    // Values of Kasten and Young at 30°, 10° and 0°.
    for (degrees, mass) in [(30.0, 1.9943), (10.0, 5.5841), (0.0, 37.9196)] {
        assert!((air_mass(f64::to_radians(degrees)) / mass - 1.0).abs() < 2e-3, "{degrees}");
    }
    let mut before = sun_irradiance(PI / 2.0, 3.0);
    for degrees in [60.0, 30.0, 10.0, 5.0, 1.0] {
        let now = sun_irradiance(f64::to_radians(degrees), 3.0);
        assert!(luminance(now) < luminance(before) && now.z / now.x < before.z / before.x, "{degrees}");
        before = now;
    }
    assert!(luminance(sun_irradiance(0.5, 6.0)) < luminance(sun_irradiance(0.5, 2.0)));
    // Above the air, sunlight is 128 to 135 klx. From straight above and without haze, at least nine tenths
    // of it reach the ground.
    let clearest = luminance(sun_irradiance(PI / 2.0, 1.0)) * 683.0;
    assert!((1.1e5..1.28e5).contains(&clearest), "{clearest}");
}

#[test]
fn the_ground_sends_back_its_share_of_what_sky_and_sun_send_down() {
    let ground = Vec3::new(0.1, 0.3, 0.5);
    for (elevation, sun) in [(60.0, 1.0), (20.0, 0.0), (5.0, 3.0)] {
        let sky = Sky { elevation, ground, sun, ..NOON };
        let baked = sky.bake();
        // The upper half alone: E on a level surface, summed with the texels' own solid angles.
        let (width, height) = (baked.map.width, baked.map.height);
        let mut down = baked.sun * sky.to_sun().y;
        for y in 0..height / 2 {
            let edge = |j: u32| (PI * j as f64 / height as f64).cos();
            let middle = (PI * (y as f64 + 0.5) / height as f64).cos();
            let omega = (edge(y) - edge(y + 1)) * 2.0 * PI / width as f64;
            for x in 0..width {
                down += at(&baked, x, y).as_dvec3() * (omega * middle);
            }
        }
        let right = (ground.as_dvec3() * down / PI).as_vec3();
        for y in [height / 2, height - 1] {
            let got = at(&baked, 5, y);
            assert!((got / right - Vec3::ONE).abs().max_element() < 1e-4, "{got} {right}");
        }
    }
}

#[test]
fn every_sky_is_finite_and_not_negative_and_its_lights_keep_its_power() {
    for elevation in [0.0, 0.01, 3.0, 45.0, 90.0] {
        for turbidity in [1.0, 1.5, 9.99, 10.0] {
            for ground in [Vec3::ZERO, Vec3::ONE] {
                let baked = Sky { elevation, turbidity, ground, sun: 1.0 }.bake();
                let fine = |x: &f32| x.is_finite() && *x >= 0.0;
                assert!(baked.map.texels.iter().flatten().all(fine), "{elevation} {turbidity} {ground}");
                assert!(baked.sun.is_finite() && baked.sun.min_element() >= 0.0);
            }
        }
    }
    let map = NOON.bake().map;
    let lights = LightSet::new(&Cells::new(&map), 24).lights;
    let sum: DVec3 = lights.iter().map(|(_, power)| *power).sum();
    assert!((sum / moments_of_map(&map)[0] - DVec3::ONE).abs().max_element() < 1e-10);
}
