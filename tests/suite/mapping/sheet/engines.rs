//! Sheets in pictures, on both engines.

use super::{CURVED, plumb, scene, uniform};
use crate::engine::gpu::{SURFACE, assert_parity, renderer};
use crate::tolerance::{PARITY_ABSOLUTE, PARITY_RELATIVE};
use taki::engine::{Engine, RenderOptions, cpu};
use taki::light::{Reflection, Scattering, Visibility};
use taki::mapping::{GRAVITY, Quad};
use taki::output::frame::{Difference, Tolerance};
use taki::picture::Frame;
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, VolumeTexture};

fn small(mut scene: Scene) -> Scene {
    (scene.edit().image.width, scene.edit().image.height, scene.edit().image.samples) = (120, 90, 1);
    scene
}

fn engines(what: &str) -> Vec<Engine> {
    let mut engines = vec![Engine::cpu()];
    engines.extend(renderer(what).map(Engine::gpu));
    engines
}

fn frame(engine: &mut Engine, scene: &Scene, volume: &VolumeTexture) -> Frame {
    engine
        .render_volume(scene, volume, &scene.mesh(), &RenderOptions::default(), &Unwatched)
        .expect("a frame")
}

fn volume(scene: &Scene) -> VolumeTexture {
    scene.volume(1 << 30, &Unwatched).expect("a volume")
}

#[test]
fn the_engines_agree_on_eroded_sheets_and_mist() {
    let Some(mut renderer) = renderer("eroded") else { return };
    let mist = format!(
        "{CURVED}[materials.fog]\nmist = 0.6\n[sheets.b]\npoints = [[0, -1, 1], [0, 1, 1]]\n\
        widths = [2.0]\nmaterial = \"fog\"\nsegments = 3\ncolumns = 3\nedge = 1.0\nhead = 0.5\nfade = 0.5\n"
    );
    let billows = mist.replace("mist = 0.6", "mist = 0.6\nbillow = 1.0\nbillow_size = 0.4");
    let torn = CURVED.replace("edge = 0.6", "edge = 0.6\ntear = 0.9\ntear_size = 0.2");
    for (text, layers) in [(CURVED, 1), (mist.as_str(), 3), (billows.as_str(), 3), (torn.as_str(), 1)] {
        for visibility in [Visibility::None, Visibility::March, Visibility::Cached] {
            for (strand, scattering) in
                [(false, Scattering::Single), (true, Scattering::Single), (false, Scattering::Multiple)]
            {
                if visibility == Visibility::None && scattering == Scattering::Multiple {
                    continue;
                }
                let mut scene = small(scene(text));
                (scene.edit().trace.layers, scene.edit().visibility, scene.edit().scattering) =
                    (layers, visibility, scattering);
                if strand {
                    scene.edit().reflection = super::scene("[light]\nreflection = \"strand\"\n").reflection;
                    assert!(matches!(scene.reflection, Reflection::Strand(_)));
                }
                let volume = volume(&scene);
                let on_gpu =
                    renderer.render(&scene, &volume, &scene.mesh(), &SURFACE, &Unwatched).expect("a frame");
                let on_cpu = cpu::render(&scene, &volume, &scene.mesh(), true, &Unwatched).expect("a frame");
                assert_parity(&format!("{layers} {visibility:?} {strand} {scattering:?}"), &[on_gpu, on_cpu]);
            }
        }
    }
}

#[test]
fn holes_fall_with_the_water_and_loops_close() {
    // A volume of one density shows nothing of its own motion, only that of the holes.
    let pictures = |flow: &str, tear: &str, engine: &mut Engine| {
        let mut scene = small(plumb(&format!("tear = {tear}\ntear_size = 0.3\n[volume]\nflow = {flow}")));
        scene.edit().camera = super::scene("[camera]\neye = [0, 0, 8]\n").camera;
        frame(engine, &scene, &uniform(0.5)).radiance
    };
    for engine in &mut engines("holes") {
        let [start, later, end] = ["0.0", "0.3", "2.0"].map(|flow| pictures(flow, "1.0", engine));
        let [even, moved] = ["0.0", "0.3"].map(|flow| pictures(flow, "0.0", engine));
        let most = |a: &[[f32; 4]], b: &[[f32; 4]]| {
            a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        assert!(start == end && most(&start, &later) > 0.1);
        // Sums of even cells are rounded at other places.
        assert!(most(&even, &moved) < 1e-5);
    }
}

#[test]
fn a_flat_even_sheet_is_one_quad() {
    let mut whole = small(plumb("segments = 1\nstretch = 0.0"));
    whole.edit().camera = scene("[camera]\neye = [1, 0, 6]\n").camera;
    let volume = volume(&whole);
    for engine in &mut engines("flat sheet") {
        let one = frame(engine, &whole, &volume);
        let mut cut = whole.clone();
        cut.edit().quads = plumb("segments = 7\ncolumns = 3\nstretch = 0.0").quads.clone();
        let many = frame(engine, &cut, &volume);
        let rgb = |frame: &Frame| frame.radiance.iter().map(|r| [r[0], r[1], r[2]]).collect::<Vec<_>>();
        let tolerance = Tolerance { relative: PARITY_RELATIVE, absolute: PARITY_ABSOLUTE };
        let outside = Difference::new(120, &rgb(&one), &rgb(&many), tolerance).share_outside();
        // Where a ray grazes a corner of a cell, one ulp of its position selects another cell.
        assert!(outside < 0.01, "{outside}");
        // A quad with another place in the texture must look different.
        cut.edit().quads[10].offset.y += 0.5;
        let moved = frame(engine, &cut, &volume);
        assert!(Difference::new(120, &rgb(&one), &rgb(&moved), tolerance).share_outside() > outside + 0.005);
    }
}

#[test]
fn what_is_not_eroded_stays_as_it_is_beside_what_is() {
    let plain = small(plumb("segments = 2"));
    let volume = volume(&plain);
    let mut with = plain.clone();
    let away = Quad { erosion: [0.5; 4], ..plain.quads[0] };
    let corners = away.corners.map(|c| c + glam::Vec3::new(0.0, 0.0, 500.0));
    with.edit().quads.push(Quad { erosion: [0.5; 4], ..Quad::new(corners, away.material).unwrap() });
    for engine in &mut engines("beside") {
        for visibility in [Visibility::March, Visibility::Cached] {
            let mut frames = [&plain, &with].map(|scene| {
                let mut scene = scene.clone();
                scene.edit().visibility = visibility;
                if visibility == Visibility::March {
                    // Beside eroded matter rays walk. Alone they do so without a budget for light volumes.
                    scene.edit().light_cache = 0;
                }
                frame(engine, &scene, &volume)
            });
            let [a, b] = &mut frames;
            // The second scene compiles another shader, which may order products differently: two units in
            // the last place.
            let near = |a: f32, b: f32| (a - b).abs() <= 2.4e-7 * a.abs();
            let same = |i: usize| (0..4).all(|c| near(a.radiance[i][c], b.radiance[i][c]));
            let others: Vec<usize> = (0..a.counts.len()).filter(|&i| !same(i)).collect();
            assert!(others.is_empty() && a.counts == b.counts, "{visibility:?}: {others:?}");
        }
    }
}

#[test]
fn the_flow_falls_with_gravity_and_loops() {
    // One of the volume's 64 layers is dense and makes a bar across the sheet.
    let mut scene = plumb("segments = 40\nv0 = 1.0");
    let image = &mut scene.edit().image;
    (image.width, image.height, image.samples) = (16, 400, 1);
    scene.edit().camera =
        super::scene("[camera]\neye = [0, 0.5, 10]\ntarget = [0, 0.5, 0]\nfov = 40\n").camera;
    scene.edit().visibility = Visibility::None;
    let dense = Cell::from_direction(glam::Vec3::Y).with_density(1.0, 0.5, 0.5);
    let cells = (0..64).map(|y| if y == 8 { dense } else { Cell::default() }).collect::<Vec<_>>();
    let volume = VolumeTexture { size: [1, 64, 1], alpha: 1.0, cells: cells.into() };
    for quad in &mut scene.edit().quads {
        quad.material.thickness_m = 1e-3;
    }
    scene.edit().trace.attenuation = taki::trace::Attenuation::PathLength { sigma: 1e4 };
    let whole = ((1.0 + 2.0 * GRAVITY * 5.0).sqrt() - 1.0) / GRAVITY;
    let fallen = |time: f64| time + 0.5 * GRAVITY * time * time;
    let mut last = f64::INFINITY;
    for engine in &mut engines("falling bar") {
        for flow in [0.0f32, 0.25, 0.5, 0.75] {
            scene.edit().recipes[0].flow = flow;
            let picture = frame(engine, &scene, &volume);
            let (mut sum, mut weight) = (0.0, 0.0);
            for (i, r) in picture.radiance.iter().enumerate() {
                let hidden = 1.0 - f64::from(r[3]);
                sum += hidden * ((i / 16) as f64 + 0.5);
                weight += hidden;
            }
            assert!(weight > 1.0);
            // Metres per row at the sheet. The middle row is at y = 0.5.
            let metres = 2.0 * 10.0 * 20f64.to_radians().tan() / 400.0;
            let got = 0.5 + (200.0 - sum / weight) * metres;
            let time = |y: f64| (y / 64.0 + f64::from(flow)) * whole;
            let want = 3.0 - 0.5 * (fallen(time(8.0)) + fallen(time(9.0)));
            // The tolerance covers a pixel's rounding at either end of the bar, and the sheet's rows, in
            // which time is linear.
            assert!((got - want).abs() < metres + 0.01, "flow {flow}: {got} {want}");
            last = got.min(last);
        }
        let mut at = |flow: f32| {
            let mut scene = scene.clone();
            scene.edit().recipes[0].flow = flow;
            frame(engine, &scene, &volume).radiance
        };
        assert!(at(0.25) == at(3.25));
    }
    assert!(last < 0.0);
}
