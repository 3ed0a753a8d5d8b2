//! The report of one pixel's ray equals the frame's own pixel, cell by cell.

use crate::engine::gpu::scene;
use glam::Vec3;
use taki::engine::cpu::gbuffer;
use taki::engine::cpu::ray::{RayReport, inspect};
use taki::light::Light;
use taki::picture::Image;
use taki::picture::camera::sample_offset;
use taki::scene::Scene;
use taki::trace::{Prefilter, flow_cells, tear};
use taki::util::monitor::Unwatched;
use taki::util::window::Window;

/// Coarse rocks, because each report projects them again.
const FIG5_ROCKS: [&str; 4] =
    ["rocks.wall.levels=4", "rocks.left.levels=4", "rocks.right.levels=4", "rocks.foot.levels=4"];
const WATERFALL_ROCKS: [&str; 14] = [
    "haze.density=0",
    "trace.filter=none",
    "trace.lookup=nearest",
    "materials.mist.billow=0",
    "rocks.wall.levels=4",
    "rocks.left.levels=4",
    "rocks.right.levels=4",
    "rocks.far_right.levels=4",
    "rocks.bed.levels=4",
    "rocks.boulder_a.levels=4",
    "rocks.boulder_b.levels=4",
    "rocks.boulder_c.levels=4",
    "rocks.hills.levels=4",
    "volume.flow=0.4",
];

/// Small scenes with rock and water.
fn scenes() -> [(&'static str, Scene); 3] {
    let small = |preset, width: u32, height: u32, more: &[&str]| {
        let size = [format!("image.width={width}"), format!("image.height={height}")];
        let sets: Vec<&str> =
            size.iter().map(String::as_str).chain(["image.samples=1"]).chain(more.iter().copied()).collect();
        (preset, scene(preset, &sets))
    };
    let mut lit = small("front", 33, 41, &["light.visibility=march"]);
    let position = Vec3::new(1.0, 1.0, 2.0);
    lit.1.edit().lights.push(Light::Point { position, intensity: Vec3::splat(3.0) });
    [small("fig5", 67, 107, &FIG5_ROCKS), small("waterfall", 96, 54, &WATERFALL_ROCKS), lit]
}

/// Asserts that the report accounts for all of its radiance.
pub fn assert_whole(what: &str, report: &RayReport) {
    let sum: Vec3 = report.steps.iter().map(|s| s.radiance).sum();
    let all = sum + report.behind * report.transmittance;
    let bound = 1e-5 * report.radiance.abs().max_element() + 1e-6;
    assert!((all - report.radiance).abs().max_element() <= bound, "{what}: {all}, not {}", report.radiance);
    assert_eq!(report.steps.len() as u32, report.cells[0], "{what}");
    assert_eq!(report.face().is_some(), !report.steps.is_empty(), "{what}");
    for pair in report.steps.windows(2) {
        let next = usize::from(pair[0].face != pair[1].face);
        assert_eq!(pair[1].face, pair[0].face + next, "{what}");
        assert_eq!(pair[1].enter_m, if next == 0 { pair[0].exit_m } else { 0.0 }, "{what}");
        assert!(pair[0].transmittance >= pair[1].transmittance, "{what}");
    }
    if let Some(first) = report.steps.first() {
        assert_eq!((first.enter_m, first.transmittance), (0.0, 1.0), "{what}");
    }
}

#[test]
fn a_filtered_pictures_report_is_of_the_volumes_own_cells_and_says_so() {
    let [_, (_, mut scene), _] = scenes();
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let mesh = scene.mesh();
    let report = |scene: &Scene| inspect(scene, &volume, &mesh, [40, 30]);
    let plain = report(&scene);
    scene.edit().trace.filter = Prefilter::Pyramid;
    let filtered = report(&scene);
    assert!(!plain.filtered && filtered.filtered && !plain.steps.is_empty());
    assert_eq!((filtered.radiance, &filtered.steps), (plain.radiance, &plain.steps));
}

#[test]
fn a_rays_report_is_the_pixel_of_the_frame_on_every_pixel() {
    for (name, scene) in scenes() {
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let mesh = scene.mesh();
        let frame = taki::engine::cpu::render(&scene, &volume, &mesh, true, &Unwatched).expect("a frame");
        let surface = frame.surface.as_ref().expect("asked for");
        let (mut wet, mut dry) = (0, 0);
        // The step is prime to the width, so every column and row is tested.
        for i in (0..frame.radiance.len()).step_by(13) {
            let pixel = [i as u32 % frame.width, i as u32 / frame.width];
            let what = format!("{name} at {pixel:?}");
            let report = inspect(&scene, &volume, &mesh, pixel);
            assert_eq!(report.pixel, pixel);
            assert_eq!(report.radiance.extend(report.transmittance).to_array(), frame.radiance[i], "{what}");
            assert_eq!(report.cells, frame.counts[i], "{what}");
            assert_whole(&what, &report);
            let Some(face) = report.face() else {
                assert!(report.radiance == report.behind && report.transmittance == 1.0, "{what}");
                dry += 1;
                continue;
            };
            wet += 1;
            assert_eq!((face.uv, face.depth_m), (surface.uv[i], surface.depth[i]), "{what}");
            let ray = scene.camera.view_ray(frame.width, frame.height, pixel, [0.5, 0.5]).as_dvec3();
            let own = scene.camera.eye + ray * f64::from(face.depth_m);
            assert!((own - face.point).length() < 1e-3, "{what}: {own} and {}", face.point);
            for step in &report.steps {
                let cell = volume.cells[volume.index(step.cell[0], step.cell[1], step.cell[2])];
                let face = &report.faces[step.face];
                let (quad, [u, v]) = (&scene.quads[face.quad], face.uv);
                let mix = |a: f32, b: f32, x: f32| a * (1.0 - x) + b * x;
                let [a, b, c, d] = quad.erosion;
                let e = mix(mix(a, b, u), mix(d, c, u), v);
                let (extent, size) = ([quad.material.repeat_u, quad.material.repeat_v], volume.size);
                let flow = [0.0, flow_cells(scene.recipes[0].flow, size[1])];
                let place = [0, 1].map(|axis| {
                    let n = size[axis] as f32;
                    let x = (face.uv[axis] * extent[axis] + quad.offset[axis]) * n - flow[axis];
                    (x - n * (x / n).floor()) / n
                });
                let e = e + (1.0 - e) * tear::erosion(&quad.tear, v, place.into(), size[0] as f32, 0.0);
                let rho = match quad.mist > 0.0 {
                    true => (0.3 * cell.rho() + 0.7 * 32768.0 / 65535.0) * (1.0 - e),
                    false => (cell.rho() - e).max(0.0),
                };
                // The result is exact where nothing is eroded. Otherwise numbers of up to 1 are rounded a few
                // times.
                let allowed = if quad.mist > 0.0 || e > 0.0 { 1e-6 } else { 0.0 };
                assert!((step.rho - rho * volume.alpha).abs() <= allowed, "{what}: {} {rho}", step.rho);
                assert_eq!(step.v, cell.v(), "{what}");
                assert_eq!((step.k_d, step.k_s), cell.k(), "{what}");
                let lights = if step.rho > 0.0 { scene.lights.len() } else { 0 };
                assert_eq!(step.visibility.len(), lights, "{what}");
                assert!(step.visibility.iter().all(|v| (0.0..=1.0).contains(v)), "{what}");
            }
        }
        assert!(wet > 20 && dry > 20, "{name}: {wet} pixels of water, {dry} without");
    }
}

#[test]
fn a_window_of_the_raster_pass_has_the_bits_of_the_whole() {
    let (_, scene) = &scenes()[1];
    let mesh = scene.mesh();
    let whole = gbuffer::run(scene, &mesh, 0);
    for window in [
        Window { x: 0, y: 0, width: 1, height: 1 },
        Window { x: 95, y: 53, width: 1, height: 1 },
        Window { x: 30, y: 11, width: 37, height: 35 },
        Window { x: 0, y: 20, width: 96, height: 17 },
    ] {
        let part = gbuffer::run_window(scene, &mesh, window, 0);
        assert_eq!(part.opaque.len() as u32, window.width * window.height);
        for y in window.y..window.y + window.height {
            for x in window.x..window.x + window.width {
                let (p, w) = (window.index([x, y]), whole.window.index([x, y]));
                assert_eq!((part.opaque[p], part.normal[p]), (whole.opaque[w], whole.normal[w]), "{x} {y}");
                assert!(part.faces(p).eq(whole.faces(w)), "{x} {y}");
            }
        }
    }
}

#[test]
fn a_pixel_outside_the_image_is_the_nearest_inside_and_the_first_sample_its_centre() {
    let (_, scene) = &scenes()[2];
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let mesh = scene.mesh();
    let corner = inspect(scene, &volume, &mesh, [32, 40]);
    assert_eq!(inspect(scene, &volume, &mesh, [33, u32::MAX]), corner);
    let with = |samples| Image { samples, ..scene.image };
    assert!((1..9).all(|samples| sample_offset(&with(samples), 0) == [0.5, 0.5]));
}

#[cfg(feature = "viewer")]
mod panel {
    use std::path::PathBuf;

    use eframe::egui::{self, Theme};
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;
    use taki::engine::cpu::ray::{RayReport, RayStep, inspect};
    use taki::util::monitor::Unwatched;
    use taki::viewer::ray_panel;

    use crate::engine::gpu::scene;

    /// Reports of a pixel with water and of one without.
    fn reports() -> [RayReport; 2] {
        let scene = scene("front", &["light.visibility=march"]);
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        [[130, 200], [5, 5]].map(|pixel| inspect(&scene, &volume, &scene.mesh(), pixel))
    }

    fn harness(report: &RayReport, theme: Theme) -> Harness<'_> {
        let mut harness = Harness::builder().with_size([520.0, 900.0]).with_theme(theme).build_ui(|ui| {
            egui::Frame::central_panel(ui.style()).show(ui, |ui| {
                ui.set_min_size(ui.available_size());
                ray_panel::show(ui, report);
            });
        });
        harness.run();
        harness
    }

    #[test]
    fn the_inspector_tells_a_pixel_in_words_and_figures() {
        let [wet, dry] = reports();
        let face = wet.face().expect("water");
        let mut panel = harness(&wet, Theme::Dark);
        panel.get_by_label("Pixel 130, 200");
        panel.get_by_label(&format!("{:.3} m", face.depth_m));
        panel.get_by_label(&format!("{}   u {:.4}   v {:.4}", face.quad, face.uv[0], face.uv[1]));
        panel.get_by_label_contains("density α·ρ");
        for head in ["ρ", "k_d", "V", "41 cells, 19 with water"] {
            panel.get_by_label(head);
        }
        let cell = |step: &RayStep| format!("{:>2} {:>2} {:>2}", step.cell[0], step.cell[1], step.cell[2]);
        let find = |water: bool| wet.steps.iter().find(|s| (s.rho > 0.0) == water).map(cell);
        let (full, empty) = (find(true).expect("water"), find(false).expect("a gap"));
        panel.get_by_label(&full);
        assert!(panel.query_by_label(&empty).is_none());
        panel.get_by_label("list empty cells").click();
        panel.run();
        panel.get_by_label(&empty);
        assert!(panel.query_by_label_contains("No water").is_none());
        let panel = harness(&dry, Theme::Dark);
        panel.get_by_label("Pixel 5, 5");
        panel.get_by_label_contains("No water covers this pixel");
        assert!(panel.query_by_label("k_d").is_none());
    }

    #[test]
    fn the_inspector_lists_every_face_and_says_which_one_a_cell_belongs_to() {
        let scene = crate::engine::layers::crossing();
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let report = inspect(&scene, &volume, &crate::engine::layers::no_rock(), [20, 24]);
        assert_eq!(report.faces.iter().map(|f| f.quad).collect::<Vec<_>>(), [1, 0]);
        let panel = harness(&report, Theme::Dark);
        panel.get_by_label("face");
        for (face, place) in report.faces.iter().zip(["", "face 1"]) {
            panel.get_by_label(&format!("{}   u {:.4}   v {:.4}", face.quad, face.uv[0], face.uv[1]));
            panel.get_by_label(&format!("{:.3} m", face.depth_m));
            assert!(place.is_empty() || panel.query_by_label(place).is_some());
        }
        let away = report.faces[1].depth_m - report.faces[0].depth_m;
        let second = report.steps.iter().find(|s| s.face == 1).expect("a cell of the second");
        assert_eq!(report.behind_nearest_m(second), [away, away + second.exit_m]);
        let [wet, _] = reports();
        assert!(harness(&wet, Theme::Dark).query_by_label("face").is_none());
    }

    #[test]
    fn a_row_under_the_pointer_marks_its_cell_and_the_panel_comes_to_rest() {
        let [wet, _] = reports();
        let mut panel = harness(&wet, Theme::Light);
        let Some([x, y, z]) = wet.steps.iter().find(|s| s.rho > 0.0).map(|s| s.cell) else { panic!("dry") };
        panel.get_by_label(&format!("{x:>2} {y:>2} {z:>2}")).hover();
        panel.run();
        panel.get_by_label_contains("density α·ρ").hover();
        panel.run();
    }

    /// `TAKI_LOOK=folder` keeps the pictures, to look at.
    #[test]
    fn the_inspector_is_drawn_in_both_themes() {
        if crate::engine::gpu::renderer("inspector").is_none() {
            return;
        }
        let [wet, dry] = reports();
        for (name, report, theme) in [
            ("wet-dark", &wet, Theme::Dark),
            ("wet-light", &wet, Theme::Light),
            ("dry-light", &dry, Theme::Light),
        ] {
            let mut panel = harness(report, theme);
            if name == "wet-light" {
                let [x, y, z] = report.steps.iter().rfind(|s| s.rho > 0.5).expect("water").cell;
                panel.get_by_label(&format!("{x:>2} {y:>2} {z:>2}")).hover();
                panel.run();
            }
            let image = panel.render().expect("a picture");
            assert_eq!((image.width(), image.height()), (520, 900));
            let colors: std::collections::HashSet<[u8; 4]> = image.pixels().map(|p| p.0).collect();
            assert!(colors.len() > 20, "{name}: {} colours", colors.len());
            if let Some(folder) = std::env::var_os("TAKI_LOOK") {
                image.save(PathBuf::from(folder).join(format!("ray-{name}.png"))).expect("written");
            }
        }
    }
}
