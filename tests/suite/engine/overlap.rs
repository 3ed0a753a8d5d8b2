//! Squares of the image that water may cover: no covered square is left out, and few others are included.

use super::gpu::{COARSE_PLACE, scene};
use glam::{DVec3, Vec3};
use rand::{RngExt, SeedableRng};
use taki::engine::cpu::gbuffer;
use taki::engine::overlap::covered;
use taki::picture::camera::sample_numbers;
use taki::util::window::Window;

#[test]
fn no_square_under_water_is_left_out_wherever_the_eye_is() {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(17);
    let size = ["image.width=90", "image.height=50", "image.samples=4", "image.filter=gaussian"];
    let (mut wet, mut dry) = (0, 0);
    for preset in ["fig5", "waterfall", "front"] {
        let rocks: &[&str] = if preset == "waterfall" { &COARSE_PLACE } else { &[] };
        let base = scene(preset, &[&size[..], rocks].concat());
        let mesh = base.mesh();
        for _ in 0..24 {
            let mut scene = base.clone();
            let place = |rng: &mut rand_pcg::Pcg64Mcg| {
                Vec3::from_array([(); 3].map(|()| rng.random_range(-3.0..3.0)))
            };
            let (eye, forward) = (place(&mut rng), place(&mut rng).normalize());
            // Some eyes lie among the quads, so that the near plane cuts some quads.
            scene.edit().camera.eye = base.camera.eye.lerp(eye.as_dvec3(), rng.random_range(0.0..1.0));
            scene.edit().camera.forward =
                base.camera.forward.lerp(forward.as_dvec3(), rng.random_range(0.0..1.0)).normalize();
            scene.edit().camera.right = scene.camera.forward.cross(DVec3::Y).normalize();
            scene.edit().camera.up = scene.camera.right.cross(scene.camera.forward);
            let window = Window { x: 5, y: 3, width: 80, height: 45 };
            let squares = covered(&scene, [window.x, window.y], [10, 6], 8);
            for sample in sample_numbers(&scene.image) {
                let raster = gbuffer::run_window(&scene, &mesh, window, sample);
                for y in 0..window.height {
                    for x in 0..window.width {
                        let under = squares[(y / 8 * 10 + x / 8) as usize];
                        let i = (y * window.width + x) as usize;
                        assert!(
                            under || raster.faces(i).next().is_none(),
                            "{preset}: pixel {x}, {y} is left out"
                        );
                        if under { wet += 1 } else { dry += 1 }
                    }
                }
            }
        }
    }
    assert!(wet > 10_000 && dry > 10_000, "{wet} and {dry} pixels");
}

#[test]
fn a_small_quad_covers_its_own_squares_and_a_margin() {
    // A quad of 1 m seen from 3 m covers a tenth of the image's height, in its middle.
    let sets = ["image.width=640", "image.height=640", "camera.fov=118"];
    let scene = scene("front", &sets);
    let squares = covered(&scene, [0, 0], [80, 80], 8);
    // 640 pixels show 2·3·tan 59° = 9.98 m, so the quad has 64 pixels or 8 squares a side. With 3 more pixels
    // on each side it has at most 10 squares.
    let count = squares.iter().filter(|&&under| under).count();
    assert!((64..=100).contains(&count), "{count}");
    assert!(squares[40 * 80 + 40] && !squares[0]);
}
