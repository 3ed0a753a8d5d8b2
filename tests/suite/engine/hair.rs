//! Hair in both engines: its sense from root to tip on every way to a cell, and its colour in the ambient
//! light.

use glam::{Vec2, Vec3};
use taki::engine::cpu;
use taki::engine::cpu::integrate::Integrator;
use taki::light::strand::hair::{Hair, Pigment};
use taki::light::strand::table::StrandShading;
use taki::light::{Light, Reflection};
use taki::mapping::shell::{Shell, Side};
use taki::mapping::{Material, Quad};
use taki::picture::Frame;
use taki::scene::Scene;
use taki::trace::{Attenuation, Lookup};
use taki::util::monitor::Unwatched;

use super::gpu::{SURFACE, assert_parity, renderer};
use crate::mapping::shell::torus;
use crate::trace::closed_forms::{noise, uniform};
use crate::trace::shells::scene_with;

/// Hairs whose sense is easy to see.
fn scaly(tilt_degrees: f32) -> Reflection {
    Reflection::Hair(Hair { tilt_degrees, roughness_m: 0.2, ..Hair::default() }.strand())
}

#[test]
fn the_keys_of_a_scene_make_its_hair() {
    let of = |sets: &[&str]| {
        let scene = Scene::preset("front").expect("a preset");
        scene.with(&[&["light.reflection=hair"], sets].concat()).expect("valid").reflection
    };
    assert_eq!(of(&[]), Reflection::Hair(Hair::default().strand()));
    let own = Hair {
        eta: 1.4,
        tilt_degrees: -2.0,
        roughness_m: 0.4,
        roughness_n: 0.6,
        pigment: Pigment::Melanin(3.0, 0.5),
    };
    let sets = [
        "hair.eta=1.4",
        "hair.tilt=-2",
        "hair.beta_m=0.4",
        "hair.beta_n=0.6",
        "hair.melanin=3",
        "hair.redness=0.5",
    ];
    assert_eq!(of(&sets), Reflection::Hair(own.strand()));
    let dyed = Hair { pigment: Pigment::Color(Vec3::new(0.5, 0.25, 0.125).as_dvec3()), ..own };
    assert_eq!(of(&[&sets[..], &["hair.color=[0.5,0.25,0.125]"]].concat()), Reflection::Hair(dyed.strand()));
}

/// A rectangle of 2 m × 3 m in the plane z = 0 under one light, with v along +y.
fn rectangle(light: Light, reflection: Reflection) -> Scene {
    let mut scene =
        Scene::preset("front").expect("a preset").with(&["light.visibility=none"]).expect("valid");
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let corners = [corner(0.0, 0.0), corner(2.0, 0.0), corner(2.0, 3.0), corner(0.0, 3.0)];
    let material =
        Material { thickness_m: 0.45, repeat_u: 1.0, repeat_v: 1.0, volume: 0, billow: Default::default() };
    let parts = scene.edit();
    parts.quads = vec![Quad::new(corners, material).expect("a quad")];
    (parts.lights, parts.ambient, parts.reflection) = (vec![light], Vec3::ZERO, reflection);
    parts.trace.attenuation = Attenuation::PathLength { sigma: 3.0 };
    parts.trace.early_end = 0.0;
    scene
}

#[test]
fn cells_of_hair_send_what_the_model_says_from_both_sides_of_a_quad() {
    let reflection = scaly(9.0);
    let shading = StrandShading::new(reflection.strands().expect("strands"));
    let size = [5, 4, 6];
    // World from cell, with z away from the eye.
    let cell = Vec3::new(2.0 / 5.0, 3.0 / 4.0, 0.45 / 6.0);
    let (mut compared, mut turned) = (0, 0);
    for v in [Vec3::Y, Vec3::new(0.3, 0.6, -0.4), Vec3::new(-0.5, 0.2, -0.9), -Vec3::Z] {
        let volume = uniform(size, v, 0.8, 0.5, 0.5);
        for to_light in [Vec3::new(0.1, 0.2, 1.0), Vec3::new(-0.6, -0.7, 0.4), Vec3::new(0.2, 0.5, -1.0)] {
            let to_light = to_light.normalize();
            let light = Light::Directional { to_light, intensity: Vec3::new(2.0, 1.0, 0.5) };
            for d in [Vec3::new(0.2, 0.4, -1.0), Vec3::new(-0.3, -0.6, -0.5), Vec3::new(0.1, -0.3, 1.0)] {
                let d = d.normalize();
                let code = volume.cells[0].v_code();
                let t = (code * cell * Vec3::new(1.0, 1.0, d.z.signum())).normalize();
                let psi = |t: Vec3| shading.psi(0.5, 0.5, t.dot(to_light), t.dot(-d), to_light.dot(-d));
                for lookup in [Lookup::Nearest, Lookup::Trilinear] {
                    let mut scene = rectangle(light, reflection);
                    scene.edit().trace.lookup = lookup;
                    let uv = [0.41, 0.37, 3.0];
                    let traced = Integrator::new(&scene, &volume).trace(0, d, uv, Vec3::ZERO, &mut ());
                    let got = traced.radiance / (1.0 - traced.transmittance);
                    let want = psi(t) * Vec3::new(2.0, 1.0, 0.5);
                    let error = (got - want).abs().max_element() / (want.max_element() + 0.01);
                    assert!(error < 2e-3, "{got}, not {want} of {v} from {d} under {to_light}, {lookup:?}");
                    compared += 1;
                }
                turned += usize::from((psi(-t) - psi(t)).abs().max_element() > 0.1 * psi(t).max_element());
            }
        }
    }
    assert!(compared == 72 && turned > 12, "the sense matters in {turned} of {} cases", compared / 2);
}

/// Root mean square of the difference of two pictures, relative to the second.
fn difference(a: &Frame, b: &Frame) -> f64 {
    let square = |x: f32| f64::from(x) * f64::from(x);
    let sum = |f: &dyn Fn(usize, usize) -> f32| {
        (0..a.radiance.len())
            .flat_map(|i| (0..3).map(move |c| (i, c)))
            .map(|(i, c)| square(f(i, c)))
            .sum::<f64>()
    };
    let apart = sum(&|i, c| a.radiance[i][c] - b.radiance[i][c]);
    (apart / sum(&|i, c| b.radiance[i][c])).sqrt()
}

#[test]
fn hair_keeps_its_sense_in_shells_however_it_is_looked_up() {
    let mut renderer = renderer("the sense of hair");
    for (k, v) in [Vec3::Y, -Vec3::Z, Vec3::new(0.5, 0.3, -0.6)].into_iter().enumerate() {
        let volume = [uniform([6, 5, 4], v, 0.7, 0.5, 0.5)];
        for (mirror, frame) in [(1.0, "world"), (-1.0, "world"), (-1.0, "texture")] {
            let mut mesh = torus(22, 14, 0.35);
            // No edge lies between cells: there rounding decides which of them a ray counts.
            mesh.uv.iter_mut().for_each(|uv| *uv = Vec2::new(uv.x * mirror + 0.1371, uv.y + 0.0713));
            let shell = Shell::new(&mesh, Side::Outward).expect("a valid mesh");
            let sets = ["light.visibility=none", &format!("light.frame={frame}")];
            let mut scene = scene_with(shell, [0.5, 4.5, 3.0], &sets);
            scene.edit().ambient = Vec3::ZERO;
            let mut draw = |lookup: Lookup, tilt: f32| {
                scene.edit().trace.lookup = lookup;
                scene.edit().reflection = scaly(tilt);
                let mesh = scene.mesh();
                let on_cpu = cpu::render(&scene, &volume, &mesh, true, &Unwatched).expect("a frame");
                if let Some(renderer) = &mut renderer {
                    let on_gpu =
                        renderer.render(&scene, &volume, &mesh, &SURFACE, &Unwatched).expect("a frame");
                    assert_parity(&format!("{v}, {mirror}, {frame}, {lookup:?}"), &[on_gpu, on_cpu.clone()]);
                }
                on_cpu
            };
            let nearest = draw(Lookup::Nearest, 9.0);
            let [between, wrong] = [9.0, -9.0].map(|tilt| draw(Lookup::Trilinear, tilt));
            let [right, wrong] = [between, wrong].map(|frame| difference(&frame, &nearest));
            assert!(right < 2e-3 && wrong > 0.05, "{right}, {wrong} for {v}, {mirror}, {frame}, {k}");
        }
    }
}

#[test]
fn the_ambient_light_of_hair_has_its_colour_and_that_of_water_and_mist_is_white() {
    let mut renderer = renderer("ambient light of hair");
    let ambient = Vec3::new(0.8, 1.0, 1.2);
    let hair = scaly(3.0);
    let albedo = StrandShading::new(hair.strands().expect("strands")).moments().albedo.as_vec3();
    assert!(albedo.x < 0.7 && albedo.z < 0.6 * albedo.x, "brown: {albedo}");
    assert_eq!(hair.ambient_share(), albedo);
    let water = Reflection::Strand(taki::light::strand::water::Water::default().strand());
    let cases = [(hair, 0.0, albedo), (hair, 0.3, Vec3::ONE), (water, 0.0, Vec3::ONE)];
    for (reflection, mist, share) in cases {
        let light = Light::Directional { to_light: Vec3::Z, intensity: Vec3::ZERO };
        let mut on_quad = rectangle(light, reflection);
        on_quad.edit().quads[0].mist = mist;
        let shell = Shell::new(&torus(12, 8, 0.35), Side::Outward).expect("a valid mesh");
        let mut in_shell = scene_with(shell, [0.5, 4.5, 3.0], &["light.visibility=none"]);
        in_shell.edit().reflection = reflection;
        for (number, mut scene) in [on_quad, in_shell].into_iter().enumerate() {
            if number == 1 && mist > 0.0 {
                continue;
            }
            let parts = scene.edit();
            parts.lights.clear();
            parts.ambient = ambient;
            (parts.background.zenith, parts.background.horizon) = (Vec3::ZERO, Vec3::ZERO);
            let volume = [noise([6, 8, 5], 4)];
            let mesh = scene.mesh();
            let mut frames = vec![cpu::render(&scene, &volume, &mesh, true, &Unwatched).expect("a frame")];
            if let Some(renderer) = &mut renderer {
                frames.push(renderer.render(&scene, &volume, &mesh, &SURFACE, &Unwatched).expect("a frame"));
            }
            for frame in frames {
                let mut seen = 0;
                for pixel in &frame.radiance {
                    let want = ambient * share * (1.0 - pixel[3]);
                    let error = (Vec3::from_slice(pixel) - want).abs().max_element();
                    assert!(error < 1e-4, "{pixel:?}, not {want}, mist {mist}, scene {number}");
                    seen += usize::from(pixel[3] < 0.9);
                }
                assert!(seen > 100, "{seen} pixels show cells");
            }
        }
    }
}

#[test]
fn the_engines_agree_on_hair_of_two_volumes_among_quads() {
    let Some(mut renderer) = renderer("hair on quads and shells") else { return };
    for sets in
        [["light.visibility=march", "trace.filter=none"], ["light.visibility=cached", "trace.filter=pyramid"]]
    {
        let mut scene = super::volumes::two(&sets);
        let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
        super::shells::add_rings(&mut scene);
        scene.edit().reflection = scaly(6.0);
        let mut lamp = scene.clone();
        lamp.edit().lights.truncate(1);
        for scene in [&scene, &lamp] {
            let mesh = scene.mesh();
            let on_gpu = renderer.render(scene, &volumes, &mesh, &SURFACE, &Unwatched).expect("a frame");
            let on_cpu = cpu::render(scene, &volumes, &mesh, true, &Unwatched).expect("a frame");
            assert_parity(&format!("{sets:?}"), &[on_gpu, on_cpu]);
        }
    }
}
