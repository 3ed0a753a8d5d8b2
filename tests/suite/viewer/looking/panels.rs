//! The panels: effects of their controls, and pictures of them.

use std::path::PathBuf;
use std::sync::Arc;

use super::spec;
use crate::engine::gpu::{renderer, scene};
use eframe::egui::{self, Role, Theme};
use egui_kittest::{Harness, kittest::Queryable};
use taki::engine::cpu;
use taki::picture::{Frame, Layer};
use taki::util::monitor::Unwatched;
use taki::viewer::curves_panel::CurvesPanel;
use taki::viewer::layer_image::{layer_image, show_legend};
use taki::viewer::volume_panel::VolumePanel;
use taki::volume::{VolumeTexture, WaterSpec, build_water};

fn volume(size: [u32; 3]) -> Arc<VolumeTexture> {
    Arc::new(build_water(&spec(size, size[0] / 2, size[2] / 2), &Unwatched).expect("a volume"))
}

struct Inspected {
    panel: VolumePanel,
    volume: Arc<VolumeTexture>,
}

fn inspector(volume: Arc<VolumeTexture>, size: [f32; 2]) -> Harness<'static, Inspected> {
    let state = Inspected { panel: VolumePanel::default(), volume };
    Harness::builder()
        .with_size(size)
        .build_ui_state(|ui, state: &mut Inspected| state.panel.show(ui, &state.volume.clone()), state)
}

#[test]
fn scrubbers_move_the_planes() {
    let mut harness = inspector(volume([20, 30, 12]), [420.0, 900.0]);
    assert_eq!(harness.state().panel.cell(), [10, 15, 6]);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        harness.get_by_role_and_label(Role::Slider, name).set_value_accesskit(3.0 + axis as f64);
        harness.run();
        assert_eq!(harness.state().panel.cell()[axis], 3 + axis as u32);
    }
    harness.get_by_role_and_label(Role::Slider, "y").set_value_accesskit(1e9);
    harness.run();
    assert_eq!(harness.state().panel.cell(), [3, 29, 5]);
}

#[test]
fn a_moved_plane_shows_its_own_flow_cells() {
    if renderer("planes").is_none() {
        return;
    }
    let volume = volume([20, 30, 12]);
    let state = Inspected { panel: VolumePanel::default(), volume: volume.clone() };
    let mut harness = Harness::builder()
        .with_size([420.0, 900.0])
        .wgpu()
        .build_ui_state(|ui, state: &mut Inspected| state.panel.show(ui, &state.volume.clone()), state);
    for z in [9, 2] {
        harness.get_by_role_and_label(Role::Slider, "z").set_value_accesskit(z as f64);
        harness.run();
        let rect = harness.get_by_label("Slice across z").rect();
        let scale = rect.width() / 20.0;
        let image = harness.render().expect("a picture");
        let mut colours = [Vec::new(), Vec::new()];
        for y in (0..30u32).filter(|y| y.abs_diff(15) > 1) {
            for x in (0..20u32).filter(|x| x.abs_diff(10) > 1) {
                let at = rect.min + egui::vec2((x as f32 + 0.5) * scale, (y as f32 + 0.5) * scale);
                let cell = volume.cells[volume.index(x, y, z)];
                colours[usize::from(cell.has_direction())].push(image.get_pixel(at.x as u32, at.y as u32).0);
            }
        }
        let [empty, flow] = colours;
        assert!(empty.len() > 20 && flow.len() > 20);
        assert!(empty.iter().all(|c| *c == empty[0]), "plane {z}: empty cells look alike");
        assert!(flow.iter().all(|c| *c != empty[0]), "plane {z}: no flow cell looks empty");
    }
}

#[test]
fn a_click_or_drag_in_a_slice_moves_the_other_two_planes() {
    for width in [240.0, 420.0, 900.0] {
        let mut harness = inspector(volume([20, 30, 12]), [width, 1200.0]);
        // Name of each slice, its axis, and the axes of cells that run right and down in it.
        for (name, axis, right, down) in [("x", 0, 2, 1), ("y", 1, 0, 2), ("z", 2, 0, 1)] {
            let before = harness.state().panel.cell();
            let rect = harness.get_by_label(&format!("Slice across {name}")).rect();
            let size = [20.0, 30.0, 12.0];
            let scale = rect.width() / size[right];
            assert!((rect.height() / size[down] / scale - 1.0).abs() < 0.02, "cells are square");
            let at = |x: f32, y: f32| rect.min + egui::vec2((x + 0.5) * scale, (y + 0.5) * scale);
            harness.hover_at(at(2.0, 4.0));
            harness.drag_at(at(2.0, 4.0));
            harness.run();
            harness.hover_at(at(7.0, 9.0));
            harness.run();
            let mut want = before;
            want[right] = 7;
            want[down] = 9;
            assert_eq!(harness.state().panel.cell(), want, "width {width}, slice {name}: drag");
            // While the pointer is beyond the edge, the plane stays at the edge.
            harness.hover_at(rect.max + egui::vec2(500.0, 500.0));
            harness.run();
            want[right] = size[right] as u32 - 1;
            want[down] = size[down] as u32 - 1;
            assert_eq!(harness.state().panel.cell(), want, "width {width}, slice {name}: beyond");
            assert_eq!(want[axis], before[axis]);
            harness.drop_at(rect.max);
            harness.run();
            harness.hover_at(at(5.0, 6.0));
            harness.drag_at(at(5.0, 6.0));
            harness.drop_at(at(5.0, 6.0));
            harness.run();
            want[right] = 5;
            want[down] = 6;
            assert_eq!(harness.state().panel.cell(), want, "width {width}, slice {name}: click");
        }
    }
}

#[test]
fn the_pointer_over_a_slice_reads_the_cell() {
    let volume = volume([20, 30, 12]);
    let mut harness = inspector(volume.clone(), [420.0, 900.0]);
    let (i, _) =
        volume.cells.iter().enumerate().find(|(i, c)| i / 600 == 6 && c.rho_code() > 0).expect("a cell");
    let [x, y] = [i % 20, i / 20 % 30];
    let rect = harness.get_by_label("Slice across z").rect();
    let scale = rect.width() / 20.0;
    harness.hover_at(rect.min + egui::vec2((x as f32 + 0.5) * scale, (y as f32 + 0.5) * scale));
    // A tool tip appears once the pointer rests.
    harness.run_steps(60);
    let rho = volume.cells[i].rho() * volume.alpha;
    let words = format!("cell ({x}, {y}, 6)\nρ {rho:.3}");
    harness.get_by_label_contains(&words);
}

#[test]
fn another_volume_is_counted_anew_and_a_large_one_beside_the_frames() {
    let mut harness = inspector(volume([20, 30, 12]), [420.0, 1000.0]);
    harness.get_by_label("20 × 30 × 12");
    harness.get_by_role_and_label(Role::Slider, "x").set_value_accesskit(2.0);
    harness.run();
    // The new volume has the same size, so the planes stay.
    harness.state_mut().volume = volume([20, 30, 12]);
    harness.run();
    assert_eq!(harness.state().panel.cell()[0], 2);

    let large = VolumeTexture {
        size: [130, 70, 60],
        alpha: 1.0,
        cells: vec![taki::volume::Cell::default(); 130 * 70 * 60].into(),
    };
    harness.state_mut().volume = Arc::new(large);
    for _ in 0..1000 {
        harness.step();
        if harness.query_by_label("130 × 70 × 60").is_some() {
            assert_eq!(harness.state().panel.cell(), [65, 35, 30]);
            harness.get_by_label("546\u{2009}000, 4.2 MiB");
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("a large volume is never counted");
}

struct Curves {
    panel: CurvesPanel,
    spec: WaterSpec,
}

fn curves(spec: WaterSpec) -> Harness<'static, Curves> {
    let state = Curves { panel: CurvesPanel::default(), spec };
    Harness::builder()
        .with_size([420.0, 640.0])
        // The two clicks of a double click take four steps.
        .with_step_dt(0.02)
        .build_ui_state(|ui, state: &mut Curves| state.panel.show(ui, &state.spec), state)
}

/// Number of line points that a panel draws.
fn points_drawn(harness: &Harness<'_, Curves>) -> usize {
    let points = |shape: &egui::Shape| match shape {
        egui::Shape::Path(path) if !path.closed => path.points.len(),
        _ => 0,
    };
    harness.output().shapes.iter().map(|clipped| points(&clipped.shape)).sum()
}

#[test]
fn the_slider_sets_how_many_curves_are_drawn() {
    let mut harness = curves(spec([40, 40, 40], 60, 60));
    let slider = |harness: &mut Harness<'_, Curves>, count: f64| {
        harness.get_by_role_and_label(Role::Slider, "Curves shown").set_value_accesskit(count);
        harness.run();
        // The points change in the next frame.
        harness.step();
        points_drawn(harness)
    };
    let one = slider(&mut harness, 1.0);
    // A curve has 128 segments in runs. The ends of runs are drawn twice.
    assert!((129..=200).contains(&one), "{one}");
    let many = slider(&mut harness, 24.0);
    assert!((24 * 129..=24 * 200).contains(&many), "{many}");
    let most = slider(&mut harness, 200.0);
    assert!((10_000..=24_000).contains(&most), "{most} points of 200 curves: levels are left out");
    // A volume with few curves shows all of them.
    harness.state_mut().spec = spec([40, 40, 40], 2, 1);
    harness.run();
    let two = points_drawn(&harness);
    assert!((258..=400).contains(&two), "{two}");
}

#[test]
fn levels_are_drawn_over_the_curves_when_asked_for() {
    let mut harness = curves(spec([40, 40, 40], 60, 60));
    assert!(harness.query_by_role_and_label(Role::Slider, "Level").is_none());
    let without = points_drawn(&harness);
    harness.get_by_label("Show levels").click();
    harness.run();
    let with = points_drawn(&harness);
    assert!(with > without);
    harness.get_by_role_and_label(Role::Slider, "Level").set_value_accesskit(0.0);
    harness.run();
    // Levels 1 and 2 of four curves have 3 + 5 points each.
    assert_eq!(points_drawn(&harness), with - 4 * 8);
    harness.get_by_label_contains("Level 0");
}

#[test]
fn a_drag_turns_the_curves_and_a_double_click_turns_them_back() {
    let shapes = |harness: &Harness<'_, Curves>| format!("{:?}", harness.output().shapes);
    let mut harness = curves(spec([40, 40, 40], 10, 10));
    harness.run();
    let at = harness.get_by_label("Spatial fractal curves").rect().center();
    harness.hover_at(at);
    harness.run();
    let first = shapes(&harness);
    harness.drag_at(at);
    harness.run();
    harness.hover_at(at + egui::vec2(80.0, 30.0));
    harness.run();
    harness.event(egui::Event::PointerButton {
        pos: at + egui::vec2(80.0, 30.0),
        button: egui::PointerButton::Primary,
        pressed: false,
        modifiers: egui::Modifiers::NONE,
    });
    harness.run();
    harness.hover_at(at);
    harness.run();
    let turned = shapes(&harness);
    assert_ne!(first, turned);
    for _ in 0..2 {
        harness.drag_at(at);
        harness.event(egui::Event::PointerButton {
            pos: at,
            button: egui::PointerButton::Primary,
            pressed: false,
            modifiers: egui::Modifiers::NONE,
        });
        harness.step();
    }
    harness.run();
    assert_eq!(first, shapes(&harness));
    harness.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: egui::vec2(0.0, 3.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: egui::Modifiers::NONE,
    });
    harness.run_steps(20);
    assert_ne!(first, shapes(&harness), "scroll zooms");
}

/// Folder for pictures, if any are wanted.
fn folder() -> Option<PathBuf> {
    std::env::var_os("TAKI_LOOK").map(PathBuf::from)
}

fn save(harness: &mut Harness<'_, impl Sized>, name: &str) {
    let Some(folder) = folder() else { return };
    harness.remove_cursor();
    harness.run_steps(4);
    let image = harness.render().expect("an adapter to draw with");
    image.save(folder.join(format!("{name}.png"))).expect("saved");
}

#[test]
fn pictures_of_the_panels_on_demand() {
    if folder().is_none() {
        return;
    }
    let figure = scene("fig5", &[]);
    let volume = Arc::new(figure.volume(1 << 30, &Unwatched).expect("a volume"));
    let long = self::volume([40, 200, 16]);
    for (theme, name) in [(Theme::Dark, "dark"), (Theme::Light, "light")] {
        let sizes = [
            ("volume", [420.0, 900.0], "v"),
            ("volume_wide", [900.0, 900.0], "ρ"),
            ("volume_rho", [420.0, 900.0], "ρ"),
            ("volume_narrow", [250.0, 900.0], "k_d"),
            ("volume_long", [420.0, 900.0], "ρ"),
        ];
        for (what, size, shown) in sizes {
            let volume = if what == "volume_long" { long.clone() } else { volume.clone() };
            let state = Inspected { panel: VolumePanel::default(), volume };
            let mut harness = Harness::builder().with_size(size).with_theme(theme).wgpu().build_ui_state(
                |ui, state: &mut Inspected| {
                    egui::CentralPanel::default().show(ui, |ui| state.panel.show(ui, &state.volume.clone()));
                },
                state,
            );
            harness.get_by_label(shown).click();
            harness.run();
            save(&mut harness, &format!("{what}_{name}"));
        }
        for (what, h, amplitude, levels, size) in [
            ("curves", 0.9, 0.05, None, [420.0, 640.0]),
            ("curves_rough", 0.3, 0.1, None, [420.0, 640.0]),
            ("curves_levels", 0.9, 0.2, Some(3.0), [420.0, 640.0]),
            ("curves_narrow", 0.9, 0.05, Some(2.0), [250.0, 500.0]),
        ] {
            let mut spec = figure.recipes[0].water;
            spec.shape.h = h;
            spec.shape.sigma_g_cells = amplitude * spec.size[1] as f32;
            let state = Curves { panel: CurvesPanel::default(), spec };
            let mut harness = Harness::builder().with_size(size).with_theme(theme).wgpu().build_ui_state(
                |ui, state: &mut Curves| {
                    egui::CentralPanel::default().show(ui, |ui| state.panel.show(ui, &state.spec));
                },
                state,
            );
            if let Some(level) = levels {
                harness.get_by_label("Show levels").click();
                harness.run();
                harness.get_by_role_and_label(Role::Slider, "Level").set_value_accesskit(level);
                harness.run();
            }
            save(&mut harness, &format!("{what}_{name}"));
        }
    }
}

#[test]
fn pictures_of_the_layers_on_demand() {
    if folder().is_none() {
        return;
    }
    let figure = scene("fig5", &["image.width=320", "image.height=400", "image.samples=2"]);
    let volume = figure.volume(1 << 30, &Unwatched).expect("a volume");
    let frame = cpu::render(&figure, &volume, &figure.mesh(), true, &Unwatched).expect("a frame");
    let size = [frame.width as usize, frame.height as usize];
    let mut harness = Harness::builder().with_size([1320.0, 840.0]).wgpu().build_ui_state(
        move |ui, textures: &mut Vec<egui::TextureHandle>| {
            for (i, layer) in Layer::ALL.into_iter().enumerate() {
                let image = layer_image(&frame, layer, 2);
                if textures.len() <= i {
                    let bytes: Vec<u8> = image.pixels.iter().flatten().copied().collect();
                    let image = egui::ColorImage::from_rgba_unmultiplied(size, &bytes);
                    textures.push(ui.ctx().load_texture(layer.name(), image, Default::default()));
                }
                let corner = egui::pos2((i % 4) as f32 * 328.0 + 4.0, (i / 4) as f32 * 408.0 + 4.0);
                let rect = egui::Rect::from_min_size(corner, egui::vec2(320.0, 400.0));
                egui::Image::new(&textures[i]).paint_at(ui, rect);
                let below = rect.with_min_y(rect.bottom() - 60.0).shrink(6.0);
                ui.scope_builder(egui::UiBuilder::new().max_rect(below), |ui| {
                    show_legend(ui, layer, &image.legend)
                });
            }
        },
        Vec::new(),
    );
    save(&mut harness, "layers");
}

#[test]
fn a_layer_of_a_large_frame_is_drawn_in_a_few_milliseconds() {
    let mut frame = Frame::new(1280, 720, true);
    for (i, depth) in frame.surface.as_mut().expect("layers").depth.iter_mut().enumerate() {
        *depth = 1.0 + (i % 977) as f32;
    }
    let seconds = (0..5).map(|_| {
        let clock = std::time::Instant::now();
        assert_eq!(layer_image(&frame, Layer::Depth, 1).pixels.len(), 1280 * 720);
        clock.elapsed().as_secs_f64()
    });
    let seconds = seconds.fold(f64::INFINITY, f64::min);
    eprintln!("depth at 1280×720: {:.1} ms", seconds * 1e3);
    // This takes a few milliseconds on idle cores. The bound allows for a busy machine and catches errors of
    // another order.
    assert!(seconds < 1.0, "{seconds} s");
}
