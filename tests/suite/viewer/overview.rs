//! The small picture of the environment: its numbers, and where the panel shows it.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::light::environment::{map, uneven};
use glam::DVec3;
use taki::light::environment::{Environment, direction_at, luminance, uv_of};
use taki::scene::Scene;

fn of(sets: &[String]) -> Environment {
    let scene = Scene::load(Path::new("front"), sets, &Limits::default()).expect("a valid scene");
    scene.environment.clone().expect("an environment")
}

fn sky(more: &[&str]) -> Environment {
    let sets = [&["environment.kind=sky"], more].concat();
    of(&sets.iter().map(ToString::to_string).collect::<Vec<_>>())
}

fn file(width: u32, height: u32, more: &[&str]) -> Environment {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("map.hdr");
    let texels = map(width, height, uneven).texels;
    let pixels: Vec<image::Rgb<f32>> = texels.iter().map(|&[r, g, b, _]| image::Rgb([r, g, b])).collect();
    let encoder = image::codecs::hdr::HdrEncoder::new(std::fs::File::create(&path).expect("a file"));
    encoder.encode(&pixels, width as usize, height as usize).expect("written");
    let path = format!("environment.file={}", path.display());
    of(&[&["environment.kind=file", &path], more]
        .concat()
        .iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>())
}

/// Mean of the texels over the sphere.
fn mean(texels: &[glam::Vec3], columns: usize, rows: usize) -> DVec3 {
    let edge = |j: usize| (PI * j as f64 / rows as f64).cos();
    let of = |i: usize| {
        texels[i].as_dvec3() * ((edge(i / columns) - edge(i / columns + 1)) * TAU / columns as f64)
    };
    (0..columns * rows).map(of).sum::<DVec3>() / (2.0 * TAU)
}

#[test]
fn the_overview_has_all_of_the_maps_power() {
    // Maps with more texels than cells (512×256), as many, and fewer. Each texel of the overview has a whole
    // number of cells.
    for (width, height) in [(1024, 512), (512, 256), (256, 128)] {
        let environment = file(width, height, &["environment.intensity=2.5", "environment.turn=33.75"]);
        let mean = mean(&environment.overview(256, 128), 256, 128);
        // Mean of E/π over all directions.
        let right = environment.irradiance.0[0].as_dvec3();
        // Both values are stored in float32.
        assert!((mean - right).abs().max_element() < 1e-5 * right.max_element(), "{mean} {right}");
    }
}

#[test]
fn each_texel_of_the_overview_is_the_background_there() {
    let environment = file(1024, 512, &["environment.intensity=0.5", "environment.turn=90"]);
    let (columns, rows) = (256, 128);
    for (i, radiance) in environment.overview(columns, rows).into_iter().enumerate() {
        let (x, y) = (i % columns, i / columns);
        let d = direction_at((x as f64 + 0.5) / columns as f64, (y as f64 + 0.5) / rows as f64);
        let right = environment.radiance(d.as_vec3());
        // Over 1.4° the spot of `uneven` departs from its tangent by at most 40·0.025²/8 of itself. An .hdr
        // file stores one byte per texel and component.
        assert!(
            (radiance - right).abs().max_element() < 0.02 * right.max_element(),
            "{x} {y}: {radiance} {right}"
        );
    }
}

#[test]
fn an_overview_of_a_map_of_any_size_is_finite_and_within_the_maps_range() {
    for (width, height) in [(1, 1), (2, 1), (7, 3), (100, 50), (515, 257), (1300, 70)] {
        let environment = file(width, height, &["environment.turn=200"]);
        let brightest = environment.map.texels.iter().flatten().copied().fold(0.0, f32::max);
        let overview = environment.overview(256, 128);
        assert_eq!(overview.len(), 256 * 128);
        for radiance in overview {
            assert!(radiance.is_finite() && radiance.min_element() >= 0.0, "{width}×{height}: {radiance}");
            assert!(radiance.max_element() <= brightest * 1.0001, "{width}×{height}: {radiance}");
        }
    }
}

#[test]
fn the_mark_is_the_sun_or_the_brightest_light_of_the_map() {
    let environment = sky(&["sky.elevation=20", "sky.azimuth=75"]);
    let sun = environment.sun.expect("a sun");
    assert_eq!(environment.strongest(), Some(uv_of(sun.to_sun, 0.0)));
    let environment = file(512, 256, &["environment.turn=120", "environment.lights=64"]);
    let [u, v] = environment.strongest().expect("a light");
    let overview = environment.overview(256, 128);
    let brightest = (0..overview.len()).max_by(|a, b| {
        let [a, b] = [a, b].map(|i| luminance(overview[*i].as_dvec3()));
        a.total_cmp(&b)
    });
    let i = brightest.expect("texels");
    let spot = direction_at(((i % 256) as f64 + 0.5) / 256.0, ((i / 256) as f64 + 0.5) / 128.0);
    let mark = direction_at(f64::from(u), f64::from(v));
    // The half width of the spot is 11°, and a light stands for a part of the spot.
    assert!(mark.dot(spot) > 11f64.to_radians().cos(), "{mark} {spot}");
}

#[test]
fn a_scene_with_an_environment_shows_it_beside_its_parameters() {
    let mut window = Setup { size: [760.0, 900.0], ..Setup::default() }.open();
    window.enter("Search parameters", "environment");
    let shown = |window: &Window| window.names(Role::Image).iter().any(|name| name == "Environment");
    assert!(!shown(&window), "there is none");
    window.choose("environment.kind", "sky");
    window.settle();
    assert!(shown(&window));
    window.undo();
    window.settle();
    assert!(!shown(&window));
}
