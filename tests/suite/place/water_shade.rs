//! Shade on falling water and its own shadow: closed forms, and what they depend on.

use std::collections::HashMap;

use super::{floor_and_wall_with, rock_of};
use crate::engine::gpu::{assert_parity, both, renderer, scene};
use glam::{Vec2, Vec3};
use taki::mapping::{Quad, Tear};
use taki::place::{QuadShade, Veil, WATER_COVER};
use taki::scene::Scene;
use taki::trace::tear;
use taki::util::monitor::Unwatched;

/// The floor and the wall with upright quads of water 1 m before the wall. Each is a square of 0.2 m around a
/// height, in metres.
fn before_the_wall(rock: &str, rest: &str, heights: &[f32]) -> Scene {
    let quads = heights.iter().map(|y| {
        let [low, high] = [y - 0.1, y + 0.1];
        format!("[[quads]]\ncorners = [[1,{high},0.1],[1,{high},-0.1],[1,{low},-0.1],[1,{low},0.1]]\n")
    });
    let quads: String = quads.collect();
    floor_and_wall_with(rock, &format!("[light]\nocclusion = 1.0\nshadow = 1.0\n{rest}{quads}"))
}

fn shades(scene: &Scene) -> Vec<QuadShade> {
    scene.mesh().on_water.to_vec()
}

#[test]
fn a_long_wall_hides_the_wedge_of_the_sky_that_lies_behind_it() {
    let heights = [0.5, 1.5, 2.5, 3.5];
    for (shade, y) in shades(&before_the_wall("occlusion = 1.0\n", "", &heights)).iter().zip(heights) {
        // The water is measured off its face, where it sees more: three tenths of a side of the quad away.
        let away = 1.0 + 0.3 * 0.2;
        let truth = ((4.0 - y) / away).atan() / std::f32::consts::PI;
        let mean = shade.occlusion.iter().sum::<f32>() / 4.0;
        // One direction of 48 weighs 0.02, and several may meet the wall's edge.
        assert!((mean - truth).abs() < 0.05, "{y}: {mean} {truth}");
        assert_eq!(shade.shadow, [0.0; 4]);
    }
}

#[test]
fn a_wall_hides_the_sun_below_the_ray_over_its_top() {
    let shades = shades(&before_the_wall("shadow = 1.0\n", "", &[1.0, 2.5, 3.5, 6.0]));
    // The sun stands at 45°: 1 m before the wall, whose height is 4 m, its light arrives above 3 m.
    assert_eq!(shades.iter().map(|shade| shade.shadow[0]).collect::<Vec<_>>(), [1.0, 1.0, 0.0, 0.0]);
    assert!(shades.iter().all(|shade| shade.occlusion == [0.0; 4]));
}

#[test]
fn strengths_weaken_the_shade_and_0_makes_none() {
    let rock = "occlusion = 1.0\nshadow = 1.0\n";
    let scene = before_the_wall(rock, "", &[1.0]);
    let whole = shades(&scene)[0];
    let with = |sets: &[&str]| shades(&scene.with(sets).expect("a valid scene"));
    let half = with(&["light.occlusion=0.5", "light.shadow=0.25"])[0];
    assert_eq!(half.occlusion, whole.occlusion.map(|share| 0.5 * share));
    assert_eq!(half.shadow, [0.25; 4]);
    assert!(with(&["light.occlusion=0", "light.shadow=0"]).is_empty());
    // Nothing casts shade.
    let off =
        ["floor", "wall"].map(|rock| [format!("rocks.{rock}.occlusion=0"), format!("rocks.{rock}.shadow=0")]);
    let off: Vec<&str> = off.iter().flatten().map(String::as_str).collect();
    assert!(with(&off).is_empty());
    let warnings = |scene: &Scene| {
        let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
        scene
            .warnings(&volumes)
            .into_iter()
            .filter(|warning| warning.contains("has no effect"))
            .collect::<Vec<_>>()
    };
    assert!(warnings(&scene).is_empty());
    assert_eq!(
        warnings(&scene.with(&off).expect("a valid scene")),
        ["occlusion", "shadow"].map(|name| format!(
            "light.{name} has no effect: no rock and no mesh of the scene has {name} above 0"
        ))
    );
}

#[test]
fn water_casts_a_shadow_as_dark_as_it_covers() {
    let floor = |light: f32| {
        let rest = format!(
            "[light]\nshadow = {light}\n[[quads]]\n\
             corners = [[5,1.5,2],[5,1.5,-2],[5,0.5,-2],[5,0.5,2]]\n"
        );
        rock_of(&floor_and_wall_with("shadow = 0.7\n", &rest), "floor")
    };
    for light in [0.5, 1.0] {
        let (mut dark, mut bright) = (0, 0);
        for vertex in floor(light) {
            let [x, _, z] = vertex.position;
            // The wall's own shadow ends at x = 4.
            if (5.7..6.3).contains(&x) && z.abs() < 1.8 {
                assert!(
                    (vertex.shadow - 0.7 * light * WATER_COVER).abs() < 1e-5,
                    "{x} {z} {}",
                    vertex.shadow
                );
                dark += 1;
            } else if x > 4.4 && z.abs() < 9.0 && !((5.4..6.6).contains(&x) && z.abs() < 2.2) {
                assert_eq!(vertex.shadow, 0.0, "{x} {z}");
                bright += 1;
            }
        }
        assert!(dark > 50 && bright > 1000, "{dark} {bright}");
    }
}

#[test]
fn worn_torn_and_misty_quads_cover_less() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, -1.0, 0.0), Vec3::NEG_Y];
    let material = before_the_wall("", "", &[1.0]).quads[0].material;
    let quad = Quad::new(corners, material).expect("a quad");
    assert_eq!(Veil::of(&quad).cover, [WATER_COVER; 4]);
    // Surges come and go; their erosion casts no shadow of its own.
    assert_eq!(Veil::of(&Quad { erosion: [0.5; 4], ..quad }).cover, [WATER_COVER; 4]);
    let worn = Quad { worn: [0.0, 0.25, 0.5, 1.0], ..quad };
    assert_eq!(Veil::of(&worn).cover, [1.0, 0.75, 0.5, 0.0].map(|left| WATER_COVER * left));
    let torn = Veil::of(&Quad { tear: Tear { open: [0.0, 0.6], lattice: [4, 4] }, ..quad }).cover;
    assert_eq!(torn[0], WATER_COVER);
    assert_eq!(torn[2], WATER_COVER * (1.0 - tear::mean(0.6)));
    assert!(torn[2] < torn[0]);
    assert_eq!(Veil::of(&Quad { mist: 0.3, ..quad }).cover, [0.0; 4]);
}

#[test]
fn triangles_and_quads_that_share_a_corner_share_its_shade() {
    let mut scene = before_the_wall("occlusion = 1.0\nshadow = 1.0\n", "", &[1.0]);
    let material = scene.quads[0].material;
    let [a, b, c, d] = [(0.0, 3.5), (2.0, 3.4), (2.2, 2.2), (-0.3, 2.4)].map(|(z, y)| Vec3::new(1.0, y, -z));
    // The second texture is mirrored.
    for right in [1.0, -1.0] {
        let uv = |p: Vec3| Vec2::new(0.1 - 0.3 * right * p.z, 2.0 - 0.5 * p.y);
        let triangle =
            |corners: [Vec3; 3]| Quad::triangle(corners, corners.map(uv), material).expect("a triangle");
        let below = Quad::new([d, c, c - Vec3::Y, d - Vec3::Y], material).expect("a quad");
        scene.edit().quads = vec![triangle([a, b, c]), triangle([a, c, d]), below];
        let shades = shades(&scene);
        // The corner of a parallelogram around a triangle lies outside of it, but only the triangle is drawn.
        let at = |quad: usize, p: Vec3| {
            let map = &scene.quads[quad].map;
            let away = p - map.a_world;
            let away = Vec2::new(away.dot(map.e1_world), away.dot(map.e2_world));
            // Not clamped: a point on an edge may lie outside by a rounding error.
            shades[quad].left(map.uv_and_det(away).0)
        };
        let close = |a: [f32; 2], b: [f32; 2]| (0..2).all(|i| (a[i] - b[i]).abs() < 1e-4);
        for (first, second, p) in
            [(0, 1, a), (0, 1, c), (0, 1, (a + c) * 0.5), (1, 2, d), (1, 2, c), (0, 2, c)]
        {
            assert!(close(at(first, p), at(second, p)), "{p}: {:?} {:?}", at(first, p), at(second, p));
        }
        assert!(!close(at(0, a), at(0, c)) && !close(at(1, a), at(1, d)));
    }
}

#[test]
fn rows_of_a_sheet_share_their_shade_and_surges_do_not_change_it() {
    let coarse =
        ["wall", "bed", "left", "right", "far_right", "hills"].map(|rock| format!("rocks.{rock}.levels=5"));
    let of = |flow: &str| {
        let shade = ["light.occlusion=1", "light.shadow=1"];
        let sets: Vec<&str> = coarse.iter().map(String::as_str).chain(shade).chain([flow]).collect();
        scene("waterfall", &sets)
    };
    let (first, second) = (of("volume.flow=0.1"), of("volume.flow=0.4"));
    assert!(first.quads.iter().zip(&second.quads).any(|(a, b)| a.erosion != b.erosion));
    assert_eq!(first.ground(), second.ground());
    let shades = shades(&first);
    let mut at_corners: HashMap<[u32; 3], [f32; 2]> = HashMap::new();
    let mut shared = 0;
    for (quad, shade) in first.quads.iter().zip(&shades) {
        for (i, corner) in quad.corners.iter().enumerate() {
            let own = [shade.occlusion[i], shade.shadow[i]];
            let known = at_corners.insert(corner.to_array().map(f32::to_bits), own);
            assert!(known.is_none_or(|known| known == own), "{corner}");
            shared += u32::from(known.is_some());
        }
    }
    assert!(shared > 300, "{shared}");
    assert!(shades.iter().any(|shade| shade.shadow.iter().any(|s| *s > 0.5)));
}

#[test]
fn water_in_full_shade_is_black_on_both_engines_and_the_sky_is_shaded_too() {
    let Some(mut renderer) = renderer("shaded water") else { return };
    // The eye looks along the wall's normal at water in and above its shadow.
    let view = "[camera]\neye = [9, 3, 0]\ntarget = [1, 3, 0]\nfov = 30.0\n[image]\nwidth = 48\nheight = 48\n\
                samples = 1\n";
    let heights = [1.0, 2.4, 2.6, 2.8, 3.0, 3.2, 3.4, 3.6, 4.5];
    let mut of = |strength: f32, more: &str| {
        let rock = format!("occlusion = {strength}\nshadow = {strength}\n");
        let frames = both(&mut renderer, &before_the_wall(&rock, &format!("{more}{view}"), &heights));
        assert_parity("shaded water", &frames);
        let surface = frames[1].surface.as_ref().expect("asked for");
        // The brightest pixel of the lowest quad, and of the one above the wall's shadow.
        // Numbers in the layer begin with 1.
        [1, 9].map(|quad| {
            let own = surface.quad.iter().zip(&frames[1].radiance).filter(|(own, _)| **own == quad);
            own.map(|(_, [r, g, b, _])| r + g + b).fold(0.0, f32::max)
        })
    };
    let [low, high] = of(1.0, "");
    let [open_low, open_high] = of(0.0, "");
    assert!(low < 0.5 * open_low && high > 0.9 * open_high, "{low} {open_low} {high} {open_high}");
    // The lights that stand for the sky are hidden as the sky is.
    let sky = "[environment]\nkind = \"sky\"\n[sky]\nsun = 0\n";
    let [low, high] = of(1.0, sky);
    let [open_low, open_high] = of(0.0, sky);
    assert!(low < 0.8 * open_low && high > 0.9 * open_high, "{low} {open_low} {high} {open_high}");
}
