//! Several sheets on both engines: parity, and changes that must not alter a bit.

use super::{
    assert_composited, crossing, curves, folded, heap, no_rock, on_cpu, preset, quad, rock, sheets, uniform,
    upright,
};
use crate::engine::gpu::{SURFACE, assert_parity, renderer};
use glam::Vec3;
use taki::engine::RenderOptions;
use taki::engine::cpu::{self, gbuffer};
use taki::picture::{Frame, Grid};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::util::window::Window;

#[test]
fn the_order_of_the_quads_in_the_scene_does_not_matter() {
    let mut engines = vec![taki::engine::Engine::cpu()];
    engines.extend(renderer("order").map(taki::engine::Engine::gpu));
    for mut scene in [heap(6, 1), heap(6, 2), folded()] {
        let volume = curves(&scene);
        for engine in &mut engines {
            let mut frame = |scene: &Scene| {
                let options = RenderOptions::default();
                engine.render_volume(scene, &volume, &no_rock(), &options, &Unwatched).expect("a frame")
            };
            let first = frame(&scene);
            for _ in 0..2 {
                scene.edit().quads.rotate_left(1);
                scene.edit().quads.swap(0, 1);
                let other = frame(&scene);
                assert!(first.radiance == other.radiance && first.counts == other.counts);
            }
        }
    }
}

#[test]
fn a_quad_that_snapping_folds_over_itself_comes_once() {
    // Corners may leave their plane by 1e-4. Through a lens this long that is several pixels, and edge-on the
    // quad's two triangles lie over one another.
    let corner = |x: f32, y, z| Vec3::new(x, y, z);
    let (low, high) = (0.0, 1.9e-4);
    let saddle =
        [corner(-1.0, low, 1.0), corner(1.0, high, 1.0), corner(1.0, low, -1.0), corner(-1.0, high, -1.0)];
    let mut scene = sheets(vec![quad(saddle, 0.2), upright([-1.0, -1.0], [1.0, 1.0], -2.0)]);
    scene.edit().camera = preset("front", &["camera.fov=0.01"]).camera;
    let volume = uniform();
    let targets = gbuffer::run(&scene, &no_rock(), 0);
    let mut frames = vec![on_cpu(&scene, &volume, &no_rock())];
    frames.extend(renderer("folded").map(|mut renderer| {
        renderer.render(&scene, &volume, &no_rock(), &SURFACE, &Unwatched).expect("a frame")
    }));
    for frame in frames {
        // A ray along the first sheet meets as many cells as it may. The second sheet has five.
        let both = frame.counts.iter().filter(|count| count[0] == 512 + 5).count();
        assert!(both > 64 && frame.counts.iter().all(|count| [5, 512 + 5].contains(&count[0])), "{both}");
    }
    assert!((0..64 * 48).all(|i| targets.faces(i).last().is_some_and(|(quad, _)| quad == 1)));
}

#[test]
fn the_engines_agree_on_scenes_of_several_sheets() {
    let Some(mut renderer) = renderer("sheets") else { return };
    let mesh = rock([-0.3, -0.2], [0.6, 0.6], -0.2);
    let coplanar = sheets(
        folded()
            .quads
            .repeat(2)
            .into_iter()
            .zip(1..)
            .map(|(q, i)| quad(q.corners, 0.07 * i as f32))
            .collect(),
    );
    for (what, mut scene) in
        [("heap", heap(8, 6)), ("crossing", crossing()), ("folded", folded()), ("coplanar", coplanar)]
    {
        for (layers, early_end, max_cells) in [(16, 0.0, 512), (3, 0.3, 512), (2, 0.0, 6)] {
            scene.edit().trace.layers = layers;
            scene.edit().trace.early_end = early_end;
            scene.edit().trace.max_cells = max_cells;
            let volume = curves(&scene);
            for mesh in [&no_rock(), &mesh] {
                let on_gpu = renderer.render(&scene, &volume, mesh, &SURFACE, &Unwatched).expect("a frame");
                if early_end == 0.0 {
                    let told = assert_composited(what, &scene, &volume, mesh, &on_gpu);
                    let several: usize = told[2..].iter().sum();
                    assert!(several > 300 || what == "coplanar", "{what}: {told:?}");
                }
                assert_parity(what, &[on_gpu, on_cpu(&scene, &volume, mesh)]);
            }
        }
    }
    // The rock is left out, because its shading is not compared here.
    let scene = preset("waterfall", &["image.width=320", "image.height=180", "image.samples=1"]);
    let volume = curves(&scene);
    let on_gpu = renderer.render(&scene, &volume, &no_rock(), &SURFACE, &Unwatched).expect("a frame");
    assert_parity("waterfall", &[on_gpu, on_cpu(&scene, &volume, &no_rock())]);
}

#[test]
fn parts_tiles_and_kept_rasters_of_several_sheets_change_no_bit() {
    let mut scene = heap(8, 7);
    let (volume, mesh) = (curves(&scene), rock([-0.3, -0.2], [0.6, 0.6], -0.2));
    let whole = on_cpu(&scene, &volume, &mesh);
    let window = Window { x: 13, y: 9, width: 37, height: 25 };
    let part = |frame: &Frame| -> Vec<[f32; 4]> {
        let rows = window.y as usize..window.bottom() as usize;
        rows.flat_map(|y| frame.radiance[y * 64..][13..50].to_vec()).collect()
    };
    let options =
        RenderOptions { window: Some(window), samples: Some(0..1), surface: true, ..Default::default() };
    let some = cpu::render_with(&scene, &volume, &mesh, &options, &mut Default::default(), &Unwatched)
        .expect("a frame");
    assert_eq!(part(&whole), some.radiance);
    let Some(mut renderer) = renderer("parts of sheets") else { return };
    for grid in [Grid::default(), Grid { side: 32, pixels: 32 * 20 }] {
        let options = RenderOptions { grid, keep_rasters: 64 << 20, ..SURFACE };
        let mut frame = |scene: &Scene, options: &RenderOptions| {
            renderer.render(scene, &volume, &mesh, options, &Unwatched).expect("a frame")
        };
        let whole = frame(&scene, &options);
        let some =
            frame(&scene, &RenderOptions { window: Some(window), tile_pixels: Some(50), ..options.clone() });
        assert_eq!(part(&whole), some.radiance);
        // Each is drawn, kept and used again, with other numbers of layers in between.
        for layers in [2, 16, 16, 2, 3, 16] {
            scene.edit().trace.layers = layers;
            let [first, again] =
                [&options, &SURFACE].map(|o| frame(&scene, &RenderOptions { grid, ..o.clone() }));
            assert!(first.radiance == again.radiance && first.counts == again.counts, "{layers}");
            assert_eq!(first.radiance == whole.radiance, layers == 16);
        }
    }
}
