//! Textures of opaque triangles and their gloss: closed forms and independent sums in float64.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x8};
use glam::{DVec3, Vec2, Vec3};
use image::{Rgb, RgbImage};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use taki::engine::cpu::gloss::Gloss;
use taki::model::Wrap;
use taki::place::Vertex;
use taki::place::paint::texture::{Texture, dropped, level_count, pyramid_bytes, size_at};
use taki::place::paint::{Finish, Layer, Painting, Paints, Stretch, coarsened};
use taki::util::lanes::{Lanes3, Stored3};

/// Linear value of a code of sRGB.
pub fn linear(code: u8) -> f64 {
    let x = f64::from(code) / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

pub fn noise(width: u32, height: u32) -> RgbImage {
    let mut rng = Pcg64Mcg::seed_from_u64(u64::from(width * 7 + height));
    RgbImage::from_fn(width, height, |_, _| Rgb([rng.random(), rng.random(), rng.random()]))
}

fn layer(texture: usize, wrap: [Wrap; 2], nearest: bool) -> Layer {
    Layer { texture, slot: 0, wrap, nearest }
}

/// A painting of one triangle for each texture.
fn painting(textures: Vec<Texture>, wrap: [Wrap; 2], nearest: bool) -> Painting {
    let finish = |texture| Finish {
        color: Some(layer(texture, wrap, nearest)),
        surface: None,
        relief: None,
        relief_scale: 1.0,
        gloss: None,
        slots: 1,
    };
    let count = textures.len();
    Painting {
        textures: textures.into_iter().map(Arc::new).collect(),
        finishes: (0..count).map(finish).collect(),
        stretches: (0..count).map(|i| Stretch { triangles: 1, finish: Some(i) }).collect(),
        coordinates: vec![[0.0, 0.0]; 3 * count],
    }
}

fn joined(image: &RgbImage, wrap: [Wrap; 2], nearest: bool) -> Paints {
    let painting = painting(vec![Texture::new(image, true, 0)], wrap, nearest);
    Paints::join([&painting].into_iter(), u64::MAX).0
}

#[test]
fn every_level_has_the_mean_of_the_image() {
    for [width, height] in [[8, 8], [7, 5], [1, 9], [13, 1], [1, 1], [64, 33]] {
        for is_srgb in [true, false] {
            let image = noise(width, height);
            let value = |code: u8| if is_srgb { linear(code) } else { f64::from(code) / 255.0 };
            let mean = |texels: &[u32], c: usize| {
                texels.iter().map(|t| value(t.to_le_bytes()[c])).sum::<f64>() / texels.len() as f64
            };
            let texture = Texture::new(&image, is_srgb, 0);
            assert_eq!(texture.levels.len() as u32, level_count([width, height]));
            assert_eq!(texture.levels.last().map(Vec::len), Some(1));
            let bytes: usize = texture.levels.iter().map(|level| 4 * level.len()).sum();
            assert_eq!(texture.bytes(), bytes as u64);
            for (k, level) in texture.levels.iter().enumerate() {
                let [w, h] = size_at([width, height], k as u32);
                assert_eq!(level.len() as u32, w * h);
                for c in 0..3 {
                    let (own, truth) = (mean(level, c), mean(&texture.levels[0], c));
                    // Half a code, at most 0.0045 in linear light.
                    assert!((own - truth).abs() < 0.0046, "{width}×{height} {k} {c}: {own} {truth}");
                }
            }
            for drop in 1..level_count([width, height]) {
                let coarse = Texture::new(&image, is_srgb, drop);
                assert_eq!(coarse.levels, texture.levels[drop as usize..], "{width}×{height} without {drop}");
                assert_eq!(coarse.size, size_at([width, height], drop));
            }
        }
    }
    // Black and white mix in linear light: ½ has the code 188.
    let board = RgbImage::from_fn(4, 4, |x, y| Rgb([255 * ((x + y) % 2) as u8; 3]));
    let texture = Texture::new(&board, true, 0);
    assert!(texture.levels[1].iter().all(|t| t.to_le_bytes() == [188, 188, 188, 255]));
}

#[test]
fn the_largest_textures_lose_their_finest_levels_first() {
    let sizes = [[1024, 1024], [512, 512], [1024, 1024], [16, 16]];
    let total = |drops: &[u32]| -> u64 {
        sizes.iter().zip(drops).map(|(&size, &drop)| pyramid_bytes(size_at(size, drop))).sum()
    };
    assert_eq!(dropped(&sizes, total(&[0; 4])), [0; 4]);
    assert_eq!(dropped(&sizes, total(&[0; 4]) - 1), [1, 0, 0, 0]);
    assert_eq!(dropped(&sizes, total(&[1, 0, 1, 0])), [1, 0, 1, 0]);
    for most in [1 << 20, 1 << 16, 5000] {
        assert!(total(&dropped(&sizes, most)) <= most);
    }
    // What cannot fit is left with one texel each.
    assert_eq!(dropped(&sizes[..1], 0), [10]);
}

#[test]
fn a_shared_buffer_holds_each_texture_once_and_fits() {
    let images = [noise(64, 64), noise(16, 8)];
    let of = |images: &[RgbImage]| {
        let textures = images.iter().map(|image| Texture::new(image, true, 0)).collect();
        painting(textures, [Wrap::Repeat; 2], false)
    };
    let (a, b) = (of(&images), of(&images[1..]));
    let again = Painting { textures: vec![a.textures[0].clone()], ..b.clone() };
    let all = [&a, &b, &again];
    let (whole, firsts) = Paints::join(all.into_iter(), u64::MAX);
    assert_eq!(firsts, [[0, 0], [2, 6], [3, 9]]);
    assert_eq!(whole.all[3], whole.all[0]);
    let texels = pyramid_bytes([64, 64]) + 2 * pyramid_bytes([16, 8]);
    assert_eq!(4 * whole.words.len() as u64, texels + 4 * (7 + 5 + 5));
    assert_eq!(coarsened(all.into_iter(), u64::MAX), (0, 0));
    let most = 7000;
    let (less, _) = Paints::join(all.into_iter(), most);
    assert!(4 * less.words.len() as u64 <= most + 4 * 17);
    assert_eq!(coarsened(all.into_iter(), most), (1, 1));
    // A level that both hold is the same, under another number.
    let at = Vec2::new(0.3, 0.8);
    let [fine, coarse] =
        [(&whole, 3.0), (&less, 2.0)].map(|(paints, level)| paints.sample(&paints.all[0].color, at, level));
    assert_eq!(fine, coarse);
}

#[test]
fn parts_of_a_triangle_have_its_coordinates() {
    let vertex = |p: Vec3| Vertex { position: p.to_array(), ..Vertex::default() };
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let mut number = || rng.random::<f32>() * 4.0 - 2.0;
    let mut point = || Vec3::new(number(), number(), number());
    let corners: Vec<Vec3> = (0..9).map(|_| point()).collect();
    let image = noise(4, 4);
    let mut painting = painting(vec![Texture::new(&image, true, 0)], [Wrap::Repeat; 2], false);
    // Two slots, and a triangle without a paint before and none behind.
    painting.finishes[0].slots = 2;
    painting.stretches =
        vec![Stretch { triangles: 1, finish: None }, Stretch { triangles: 2, finish: Some(0) }];
    // Coordinates that are linear in the position, so that each part's are known.
    let uv = |p: Vec3, slot: usize| match slot {
        0 => [p.x + 0.5 * p.y, p.z],
        _ => [3.0 * p.z - p.x, 1.0 + p.y],
    };
    let of = |points: &[Vec3]| points.iter().flat_map(|&p| [uv(p, 0), uv(p, 1)]).collect::<Vec<_>>();
    painting.coordinates = of(&corners[3..]);
    let (mut after, pieces) = (Vec::new(), [2, 1, 4]);
    for (own, count) in corners.as_chunks::<3>().0.iter().zip(pieces) {
        let [a, b, c] = *own;
        let [d, e, f] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
        after.extend(match count {
            1 => vec![a, b, c],
            2 => vec![a, d, c, d, b, c],
            _ => vec![a, d, f, d, b, e, f, e, c, d, e, f],
        });
    }
    let vertices = |points: &[Vec3]| points.iter().map(|&p| vertex(p)).collect::<Vec<_>>();
    let split = painting.split(&vertices(&corners), &vertices(&after), &pieces);
    let counts: Vec<u32> = split.stretches.iter().map(|stretch| stretch.triangles).collect();
    assert_eq!(counts, [2, 5]);
    let truth = of(&after[6..]);
    assert_eq!(split.coordinates.len(), truth.len());
    for (own, truth) in split.coordinates.iter().zip(&truth) {
        assert!((own[0] - truth[0]).abs().max((own[1] - truth[1]).abs()) < 1e-5, "{own:?} {truth:?}");
    }
    let same = painting.split(&vertices(&corners), &vertices(&corners), &[1; 3]);
    assert_eq!(same.stretches, painting.stretches);
}

/// Index of a texel, by counting.
fn continued(i: i64, n: i64, wrap: Wrap) -> i64 {
    match wrap {
        Wrap::Clamp => i.max(0).min(n - 1),
        Wrap::Repeat => (i + 1000 * n) % n,
        Wrap::Mirror => {
            let k = (i + 1000 * n) % (2 * n);
            if k < n { k } else { 2 * n - 1 - k }
        }
    }
}

/// Bilinear lookup in linear light, float64.
pub fn bilinear(image: &RgbImage, [u, v]: [f64; 2], wrap: [Wrap; 2], nearest: bool) -> DVec3 {
    let [w, h] = [image.width(), image.height()].map(i64::from);
    let get = |x: i64, y: i64| {
        let [x, y] = [continued(x, w, wrap[0]), continued(y, h, wrap[1])];
        DVec3::from(image.get_pixel(x as u32, y as u32).0.map(linear))
    };
    let (x, y) = (u * w as f64, v * h as f64);
    if nearest {
        return get(x.floor() as i64, y.floor() as i64);
    }
    let (x, y) = (x - 0.5, y - 0.5);
    let (i, j) = (x.floor() as i64, y.floor() as i64);
    let row = |j: i64| get(i, j).lerp(get(i + 1, j), x - x.floor());
    row(j).lerp(row(j + 1), y - y.floor())
}

#[test]
fn lookup_follows_every_continuation() {
    let image = noise(5, 4);
    let mut rng = Pcg64Mcg::seed_from_u64(8);
    for u in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        for v in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for nearest in [false, true] {
                let paints = joined(&image, [u, v], nearest);
                for _ in 0..500 {
                    let at = Vec2::new(rng.random::<f32>() * 9.0 - 4.0, rng.random::<f32>() * 9.0 - 4.0);
                    let own = paints.sample(&paints.all[0].color, at, -1.0).as_dvec3();
                    let truth = bilinear(&image, at.to_array().map(f64::from), [u, v], nearest);
                    assert!((own - truth).abs().max_element() < 2e-5, "{u:?} {v:?} {nearest} {at}");
                }
            }
        }
    }
}

#[test]
fn between_levels_the_lookup_is_linear_and_no_level_is_beyond_the_last() {
    let paints = joined(&noise(16, 4), [Wrap::Repeat; 2], false);
    let used = &paints.all[0].color;
    let at = Vec2::new(0.37, 0.61);
    let of = |level: f32| paints.sample(used, at, level);
    assert!((of(1.25) - of(1.0).lerp(of(2.0), 0.25)).abs().max_element() < 1e-6);
    assert_eq!(of(-5.0), of(0.0));
    assert_eq!(of(9.0), of(4.0));
    assert_eq!(of(f32::INFINITY), of(4.0));
}

#[test]
fn no_coordinate_is_a_panic() {
    let image = noise(3, 7);
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        for nearest in [false, true] {
            let paints = joined(&image, [wrap; 2], nearest);
            for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e9, -1e9, f32::MAX, f32::MIN] {
                for level in [f32::NAN, -1.0, 0.5, 40.0] {
                    paints.sample(&paints.all[0].color, Vec2::new(x, 0.5), level);
                    paints.sample(&paints.all[0].color, Vec2::new(0.5, x), level);
                }
            }
        }
    }
}

/// π times the reflectance of a surface, for eight directions of light.
fn reflects(albedo: f32, roughness: f32, metallic: f32, e: Vec3, l: [Vec3; 8]) -> [f64; 8] {
    let out: [f32; 8] = dispatch!(Level::new(), simd => {
        let [albedo, n, e] = [Vec3::splat(albedo), Vec3::Z, e].map(|v| Lanes3::splat(simd, v));
        let [roughness, metallic] = [roughness, metallic].map(|x| f32x8::splat(simd, x));
        let gloss = Gloss::new(simd, albedo, roughness, metallic, n, e);
        let l = Stored3::from_fn(|lane| l[lane]).load(simd);
        gloss.reflects(simd, l, l.z.max(f32x8::splat(simd, 1e-6))).x.into()
    });
    out.map(f64::from)
}

fn direction(polar: f64, turn: f64) -> Vec3 {
    DVec3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()).as_vec3()
}

#[test]
fn gloss_is_the_textbooks_lobe() {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    for (roughness, metallic) in [(0.15f32, 1.0f32), (0.4, 0.0), (0.6, 0.3), (1.0, 1.0)] {
        for _ in 0..200 {
            let e = direction(rng.random::<f64>() * 1.5, rng.random::<f64>() * TAU);
            let l = direction(rng.random::<f64>() * 1.5, rng.random::<f64>() * TAU);
            let own = reflects(0.8, roughness, metallic, e, [l; 8])[0];
            let (e, l) = (e.as_dvec3(), l.as_dvec3());
            let h = (e + l).normalize();
            let a = f64::from(roughness) * f64::from(roughness);
            // Walter and others 2007, eq. 33; Heitz 2014, eq. 72 and 99.
            let tan2 = |d: DVec3| (1.0 - d.z * d.z) / (d.z * d.z);
            let normals = a * a / (PI * h.z.powi(4) * (a * a + tan2(h)).powi(2));
            let lambda = |d: DVec3| (-1.0 + (1.0 + a * a * tan2(d)).sqrt()) / 2.0;
            let shadows = 1.0 / (1.0 + lambda(e) + lambda(l));
            let f0 = 0.04 + (0.8 - 0.04) * f64::from(metallic);
            let fresnel = f0 + (1.0 - f0) * (1.0 - l.dot(h)).powi(5);
            let passes = |d: DVec3| 0.96 * (1.0 - (1.0 - 0.9 * a) * (1.0 - d.z).powi(5));
            let diffuse = 0.8 * (1.0 - f64::from(metallic)) * passes(e) * passes(l) / 0.96;
            let truth = diffuse + PI * normals * shadows * fresnel / (4.0 * e.z * l.z);
            assert!((own - truth).abs() < 2e-3 * truth, "{roughness} {metallic} {e} {l}: {own} {truth}");
        }
    }
}

#[test]
fn gloss_sends_back_no_more_light_than_arrives() {
    let mut least = f64::INFINITY;
    for roughness in [0.1f32, 0.15, 0.2, 0.3, 0.5, 0.7, 0.85, 1.0] {
        for metallic in [0.0f32, 0.5, 1.0] {
            for polar in [0.0, 0.5, 0.9, 1.2, 1.4, 1.52] {
                let e = direction(polar, 0.0);
                // Half vectors are drawn as the lobe has them, so that narrow lobes are met, and light from
                // all sides as Lambert's; the two are weighed by the balance heuristic (Veach 1995).
                let (mut sum, count) = (0.0, 128);
                let a2 = f64::from(roughness).powi(4).max(1e-4);
                let density = |l: DVec3| {
                    let h = (l + e.as_dvec3()).normalize();
                    let d = a2 / (PI * (h.z * h.z * (a2 - 1.0) + 1.0).powi(2));
                    l.z / PI + d * h.z / (4.0 * l.dot(h))
                };
                let mut lights = Vec::new();
                for i in 0..count {
                    for j in 0..count {
                        let [u, v] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(count));
                        lights.push(direction(u.sqrt().asin(), v * TAU));
                        let h = direction((a2 * u / (1.0 - u)).sqrt().atan(), v * TAU);
                        lights.push(h * (2.0 * h.dot(e)) - e);
                    }
                }
                for eight in lights.as_chunks::<8>().0 {
                    let own = reflects(1.0, roughness, metallic, e, *eight);
                    for (l, own) in eight.iter().zip(own).filter(|(l, _)| l.z > 1e-6) {
                        let l = l.as_dvec3();
                        sum += own * l.z / PI / density(l);
                    }
                }
                let share = sum / f64::from(count * count);
                assert!(share < 1.001, "roughness {roughness}, metallic {metallic}, {polar}: {share}");
                least = least.min(share);
            }
        }
    }
    assert!(least > 0.2 && least < 0.8, "a rough metal loses light: {least}");
}

#[test]
fn gloss_is_the_same_both_ways() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    for _ in 0..300 {
        let [a, b] = [(); 2].map(|()| direction(rng.random::<f64>() * 1.5, rng.random::<f64>() * TAU));
        let (roughness, metallic) = (rng.random::<f32>(), rng.random::<f32>());
        let [to, fro] = [(a, b), (b, a)].map(|(e, l)| reflects(0.6, roughness, metallic, e, [l; 8])[0]);
        assert!((to - fro).abs() <= 1e-3 * to, "{roughness} {metallic} {a} {b}: {to} {fro}");
    }
}
