//! Colours of volumes: the engines agree, on quads and in shells, beside a volume without colours.

use glam::Vec3;
use taki::light::ramp::Ramp;
use taki::scene::Scene;
use taki::util::monitor::Unwatched;

use super::gpu::{SURFACE, assert_parity, renderer};
use super::shells::add_rings;

/// Two volumes, of which the first is coloured.
fn scene(sets: &[&str], colors: usize) -> Scene {
    let mut scene = super::volumes::two(&[&["light.ambient=[0.1,0.2,0.3]"], sets].concat());
    let ramp = [Vec3::new(0.9, 0.1, 0.2), Vec3::new(0.1, 0.8, 0.3), Vec3::new(0.2, 0.3, 1.0)];
    scene.edit().recipes[0].ramp = Ramp::new(&ramp[..colors], 0.6);
    scene
}

#[test]
fn the_engines_agree_on_colours_of_quads_and_shells() {
    let Some(mut renderer) = renderer("colours") else { return };
    let (pyramid, trilinear) = ("trace.filter=pyramid", "trace.lookup=trilinear");
    let (march, cached) = ("light.visibility=march", "light.visibility=cached");
    let variants: [&[&str]; 6] =
        [&[march], &[cached], &[pyramid, cached], &[trilinear, cached], &["light.frame=texture"], &[pyramid]];
    for (i, sets) in variants.into_iter().enumerate() {
        let mut scene = scene(sets, 1 + i % 3);
        let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
        let mut white = scene.clone();
        white.edit().recipes[0].ramp = Ramp::WHITE;
        add_rings(&mut scene);
        for lights in [scene.lights.len(), 1, 0] {
            scene.edit().lights.truncate(lights);
            let mesh = scene.mesh();
            let mut draw = |scene: &Scene| {
                let gpu = renderer.render(scene, &volumes, &mesh, &SURFACE, &Unwatched).expect("a frame");
                let cpu =
                    taki::engine::cpu::render(scene, &volumes, &mesh, true, &Unwatched).expect("a frame");
                [gpu, cpu]
            };
            let frames = draw(&scene);
            assert_parity(&format!("{sets:?}, {lights} lights"), &frames);
            let others = draw(&white);
            let differs = |i: usize| {
                let [a, b] = [&frames[1], &others[1]].map(|frame| Vec3::from_slice(&frame.radiance[i]));
                (a - b).abs().max_element() > 0.02
            };
            let count = (0..frames[1].radiance.len()).filter(|&i| differs(i)).count();
            assert!(count * 20 > frames[1].radiance.len(), "{sets:?}: {count} pixels have a colour");
        }
    }
}
