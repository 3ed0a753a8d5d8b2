//! Eight rays in lockstep against the walk of one ray at a time, on every instruction set of the processor:
//! the same numbers of cells, and the same radiance to the bit.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use taki::engine::cpu::LightVolumeCache;
use taki::engine::cpu::gbuffer::{self, Gbuffer};
use taki::engine::cpu::integrate::{Integrator, Lanes, RayResult};
use taki::light::ramp::Ramp;
use taki::light::strand::hair::Hair;
use taki::light::strand::water::Water;
use taki::light::{AngleFrame, Light, Reflection, Scattering, Visibility};
use taki::mapping::shell::{Shell, Side};
use taki::mapping::{Billow, Material, Quad, Tear};
use taki::place::Mesh;
use taki::scene::{Limits, Recipe, Scene};
use taki::trace::{Attenuation, Lookup, Prefilter};
use taki::util::monitor::Unwatched;
use taki::util::window::Window;
use taki::volume::{Bricks, Cell, VolumeTexture};

use crate::mapping::shell::{sphere, strip, torus};
use crate::trace::closed_forms::noise;
use crate::trace::shell_shadows::walls;
use crate::trace::shells::scene_with;

/// Width and height of the images. The middle pixels' rays run along the axis of the camera.
const SIZE: [u32; 2] = [13, 5];

/// A volume in which `share` of the cells are occupied.
fn volume(rng: &mut Pcg64Mcg, share: f32, is_sparse: bool) -> VolumeTexture {
    let size: [u32; 3] = [0; 3].map(|_: u32| rng.random_range(1..12));
    let cells: Vec<Cell> = (0..size.iter().product::<u32>())
        .map(|_| {
            let mut x = || rng.random::<f32>();
            let v = Vec3::new(x() - 0.5, x() - 0.5, x() - 0.5);
            match x() < share {
                true => Cell::from_direction(v).with_density(x(), x(), x()),
                false => Cell::default(),
            }
        })
        .collect();
    let cells = if is_sparse { Bricks::of(size, &cells).into() } else { cells.into() };
    VolumeTexture { size, alpha: 1.0, cells }
}

/// Three quads of 2 m × 3 m in the plane z = 0, seen from +z: whole, eroded and of mist. The last is no
/// parallelogram.
fn quads(rng: &mut Pcg64Mcg) -> Vec<Quad> {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let material = Material {
        thickness_m: rng.random_range(0.05..1.0),
        repeat_u: rng.random_range(1..4) as f32,
        repeat_v: rng.random_range(1..4) as f32,
        volume: 0,
        billow: Billow { strength: 0.7, inverse_size: 2.0, rise: 1.0 },
    };
    let rectangle = [corner(0.0, 0.0), corner(2.0, 0.0), corner(2.0, 3.0), corner(0.0, 3.0)];
    let wedge = [corner(0.0, 0.0), corner(2.0, 0.0), corner(1.5, 3.0), corner(0.25, 2.5)];
    let mut quads = [rectangle, rectangle, wedge, wedge].map(|q| Quad::new(q, material).expect("a quad"));
    quads[1].erosion = [0.0, 0.3, 0.9, 0.5];
    quads[2].mist = 0.4;
    quads[3].erosion = [0.1; 4];
    quads[0].tear = Tear { open: [0.2, 0.9], lattice: [5, 3] };
    quads[2].tear = Tear { open: [0.0, 0.5], lattice: [2, 7] };
    quads.to_vec()
}

/// A light: far away, along an axis, or so near that its rays fan out.
fn light(rng: &mut Pcg64Mcg) -> Light {
    let mut x = || rng.random_range(-1.0f32..1.0);
    let intensity = Vec3::new(1.0, 0.7, 0.4);
    match (x() * 4.0) as i32 {
        0 => Light::Directional { to_light: Vec3::Z, intensity },
        1 => Light::Directional { to_light: Vec3::new(1.0, 0.0, 1.0).normalize(), intensity },
        2 => Light::Point { position: Vec3::new(1.0 + x(), 1.5 + x(), 0.3), intensity },
        _ => Light::Directional { to_light: Vec3::new(x(), x(), x() + 0.1).normalize(), intensity },
    }
}

/// A ramp of some colours, of which there may be none.
fn ramp(count: usize) -> Ramp {
    let colors = [Vec3::new(0.9, 0.1, 0.2), Vec3::new(0.3, 0.7, 0.0), Vec3::new(0.0, 0.2, 0.8)];
    Ramp::new(&colors[..count], 0.35)
}

/// A random scene. Its camera looks at the quads along their normal, along a diagonal, or at a steep angle.
fn scene(rng: &mut Pcg64Mcg) -> Scene {
    let mut scene = Scene::load(Path::new("front"), &[], &Limits::default()).expect("a preset");
    let quads = quads(rng);
    let lights = (0..rng.random_range(0..4)).map(|_| light(rng)).collect();
    let mut one_of = |n: u32| rng.random_range(0..n);
    let parts = scene.edit();
    (parts.quads, parts.lights) = (quads, lights);
    [parts.image.width, parts.image.height] = SIZE;
    parts.ambient = Vec3::new(0.1, 0.2, 0.3);
    parts.recipes[0].flow = [0.0, 0.4][one_of(2) as usize];
    parts.recipes[0].moves = [0.0, 0.7][one_of(2) as usize];
    parts.p = [12.0, 1.0, 7.3][one_of(3) as usize];
    parts.angles = [AngleFrame::World, AngleFrame::Texture][one_of(2) as usize];
    parts.visibility = [Visibility::None, Visibility::March, Visibility::Cached][one_of(3) as usize];
    parts.scattering = [Scattering::Single, Scattering::Single, Scattering::Multiple][one_of(3) as usize];
    parts.reflection = match one_of(4) {
        0 => Reflection::Strand(Water::default().strand()),
        1 => Reflection::Hair(Hair::default().strand()),
        _ => Reflection::KajiyaKay,
    };
    if parts.scattering == Scattering::Single && parts.reflection == Reflection::KajiyaKay {
        parts.recipes[0].ramp = ramp(one_of(4) as usize);
    }
    parts.trace.attenuation =
        [Attenuation::PathLength { sigma: 6.0 }, Attenuation::PerCell { tau: 0.8 }][one_of(2) as usize];
    parts.trace.filter = [Prefilter::None, Prefilter::Pyramid][one_of(2) as usize];
    parts.trace.lookup =
        [Lookup::Nearest, Lookup::Nearest, Lookup::Trilinear, Lookup::Strand][one_of(4) as usize];
    parts.recipes[0].water.structure.lines = parts.trace.lookup == Lookup::Strand;
    parts.trace.max_cells = [65_536, 300, 13, 8, 1][one_of(5) as usize];
    parts.trace.early_end = [0.0, 0.001, 0.5][one_of(3) as usize];
    parts.trace.layers = 3;
    let back: DVec3 = [
        DVec3::Z,
        DVec3::new(1.0, 1.0, 1.0),
        DVec3::new(0.0, 1.0, 1.0),
        DVec3::new(-3.0, 0.0, 0.1),
        DVec3::new(0.3, -0.2, 1.0),
    ][one_of(5) as usize];
    let camera = &mut parts.camera;
    camera.forward = -back.normalize();
    camera.right = DVec3::new(camera.forward.y, -camera.forward.x, 0.0).try_normalize().unwrap_or(DVec3::X);
    camera.up = camera.right.cross(camera.forward);
    camera.eye = camera.origin - camera.forward * 2.0;
    scene
}

/// Targets of the raster pass in which the rays meet random sheets, many of them at corners of cells.
fn hits(rng: &mut Pcg64Mcg, scene: &Scene, size: [u32; 3]) -> Gbuffer {
    let layers = scene.trace.layers as usize;
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let mut gbuffer = Gbuffer::empty(scene);
    gbuffer.window = Window::whole(SIZE);
    gbuffer.opaque = vec![[0.2, 0.3, 0.4, 7.0]; pixels];
    gbuffer.normal = vec![Vec4::new(0.0, 0.0, 1.0, 0.25); pixels];
    gbuffer.layers = layers;
    gbuffer.surface = vec![[0.0; 3]; pixels * layers];
    gbuffer.quad_id = vec![0; pixels * layers];
    for pixel in 0..pixels {
        for layer in 0..rng.random_range(0..=layers) {
            let at = pixel * layers + layer;
            let mut coordinate = |n: u32| match rng.random_range(0..3) {
                0 => rng.random_range(0..=n) as f32 / n as f32,
                _ => rng.random::<f32>(),
            };
            let (u, v) = (coordinate(size[0]), coordinate(size[1]));
            // Some sheets are so far away that a pixel covers many of their cells.
            gbuffer.surface[at] = [u, v, [0.5, 3.0, 40.0, 400.0][rng.random_range(0..4)]];
            gbuffer.quad_id[at] = rng.random_range(1..=scene.quads.len() as u32);
        }
    }
    gbuffer
}

/// Everything about a ray, bit for bit.
fn bits(result: &RayResult) -> ([u32; 5], [u32; 2]) {
    let [r, g, b] = result.radiance.to_array();
    ([r, g, b, result.transmittance, result.uncovered].map(f32::to_bits), result.cells)
}

/// Lets the quads show random ones of `count` volumes. Returns the volumes.
fn volumes(rng: &mut Pcg64Mcg, scene: &mut Scene, count: usize) -> Vec<VolumeTexture> {
    let is_pyramid = scene.trace.filter != Prefilter::None;
    let mut volume = || {
        let is_sparse = !is_pyramid && rng.random();
        let share = [0.0, 0.03, 0.3, 1.0][rng.random_range(0..4)];
        VolumeTexture { alpha: rng.random_range(0.3..1.0), ..volume(rng, share, is_sparse) }
    };
    let volumes: Vec<VolumeTexture> = (0..count).map(|_| volume()).collect();
    let parts = scene.edit();
    let recipe = parts.recipes[0].clone();
    let flow = |number: usize| recipe.flow + 0.1 * number as f32;
    let ramp = |number: usize| if number == 1 { Ramp::WHITE } else { recipe.ramp };
    let own = |number: usize| Recipe { flow: flow(number), ramp: ramp(number), ..recipe.clone() };
    parts.recipes = (0..count).map(own).collect();
    for quad in &mut parts.quads {
        quad.material.volume = rng.random_range(0..count as u32);
    }
    volumes
}

#[test]
fn every_instruction_set_gives_the_bits_of_the_scalar_walk() {
    let mut walked = [0u64; 2];
    let mut bright = 0;
    for seed in 0..640 {
        let rng = &mut Pcg64Mcg::seed_from_u64(seed);
        let mut scene = scene(rng);
        let is_sparse = scene.trace.filter == Prefilter::None && rng.random();
        let share = [0.0, 0.03, 0.3, 1.0][rng.random_range(0..4)];
        let volumes = match seed % 3 {
            2 => volumes(rng, &mut scene, 3),
            _ => vec![volume(rng, share, is_sparse)],
        };
        let gbuffer = hits(rng, &scene, volumes[0].size);
        let pixels: Vec<[u32; 2]> = (0..SIZE[0] * SIZE[1]).map(|i| [i % SIZE[0], i / SIZE[0]]).collect();
        let mut cache = LightVolumeCache::default();
        let mesh = Mesh::default();
        let mut prepared =
            || Integrator::prepared(&scene, &volumes, &mesh, &mut cache, &Unwatched).expect("a valid scene");
        let scalar = prepared();
        let truth: Vec<_> = pixels.iter().map(|&p| scalar.pixel(&gbuffer, p, 0, &mut ())).collect();
        for result in &truth {
            (0..2).for_each(|c| walked[c] += u64::from(result.cells[c]));
            bright += u32::from(result.radiance.max_element() > 0.5);
        }
        for (name, lanes) in Lanes::all() {
            let integrator = prepared().with_lanes(lanes);
            let mut seen = vec![None; pixels.len()];
            integrator.walker().pixels(&gbuffer, &pixels, 0, |i, result| seen[i] = Some(result));
            for (pixel, (seen, truth)) in pixels.iter().zip(seen.iter().zip(&truth)) {
                let seen = seen.as_ref().expect("every pixel has a result");
                assert_eq!(
                    bits(seen),
                    bits(truth),
                    "seed {seed}, {name}, pixel {pixel:?}: {seen:?} instead of {truth:?}, {:?}",
                    scene.trace
                );
            }
        }
    }
    assert!(walked[0] > 400_000 && walked[1] > 200_000 && bright > 1000, "{walked:?}, {bright}");
}

#[test]
fn results_do_not_depend_on_the_rays_beside_them() {
    let rng = &mut Pcg64Mcg::seed_from_u64(7);
    let mut scene = scene(rng);
    scene.edit().trace.max_cells = 65_536;
    scene.edit().trace.early_end = 0.001;
    let volume = volume(rng, 0.4, false);
    let gbuffer = hits(rng, &scene, volume.size);
    let integrator =
        Integrator::prepared(&scene, &volume, &Mesh::default(), &mut LightVolumeCache::default(), &Unwatched)
            .expect("the light volumes fit");
    let pixels: Vec<[u32; 2]> = (0..SIZE[0] * SIZE[1]).map(|i| [i % SIZE[0], i / SIZE[0]]).collect();
    let run = |pixels: &[[u32; 2]]| {
        let mut out = vec![None; pixels.len()];
        integrator.walker().pixels(&gbuffer, pixels, 0, |i, result| out[i] = Some(bits(&result)));
        out
    };
    let all = run(&pixels);
    let backwards: Vec<_> = pixels.iter().rev().copied().collect();
    assert!(run(&backwards).iter().rev().eq(&all));
    assert!(pixels.chunks(3).flat_map(run).eq(all));
}

#[test]
fn every_instruction_set_gives_the_bits_of_the_scalar_walk_through_shells() {
    let (strand, pyramid) = ("light.reflection=strand", "trace.filter=pyramid");
    let (hair, trilinear) = ("light.reflection=hair", "trace.lookup=trilinear");
    let (none, cached) = ("light.visibility=none", "light.visibility=cached");
    let colored = "light.ambient=[0.1,0.3,0.2]";
    let (multiple, skin) = ("light.scattering=multiple", "light.ambient=[0.2,0.3,0.1]");
    let variants: [&[&str]; 27] = [
        &[multiple],
        &[multiple, pyramid, cached, "camera.fov=80"],
        &[multiple, hair, colored, pyramid],
        &[multiple, skin, colored, "trace.early_end=0.3"],
        &[skin, cached],
        &[skin, pyramid, none, "trace.early_end=0.3"],
        &[skin, multiple, pyramid, "light.frame=texture"],
        &[hair, "hair.tilt=8"],
        &[hair, pyramid, cached, "camera.fov=80"],
        &[hair, trilinear, "light.frame=texture"],
        &[hair, pyramid, "hair.tilt=0", none],
        &[colored],
        &[colored, none],
        &[colored, pyramid, cached],
        &[colored, "trace.lookup=trilinear", none],
        &[],
        &[none],
        &[cached],
        &[pyramid, none],
        &[pyramid, cached, "camera.fov=80"],
        &[pyramid, strand, none],
        &[strand],
        &["trace.max_cells=9"],
        &[pyramid, "trace.max_cells=15", none],
        &["trace.early_end=0.3", pyramid],
        &["light.frame=texture", "light.p=7.5"],
        &["trace.lookup=trilinear", none],
    ];
    let mut furred = Shell::new(&torus(14, 9, 0.35), Side::Outward).expect("a valid mesh");
    furred.skin = true;
    // Some triangles show nothing of the texture, and a border ends the shell.
    let mut torn = strip(9);
    torn.triangles.swap_remove(3);
    torn.uv[6] = torn.uv[7];
    torn.uv[8] = torn.uv[7];
    let torn = Shell::new(&torn, Side::Inward).expect("a valid mesh");
    let ball = Shell::new(&sphere(1, 0.4), Side::Outward).expect("a valid mesh");
    let eyes = [[0.5, 4.5, 3.0], [0.2, 0.3, 4.4], [0.2, 1.2, 3.4]];
    let volumes = [noise([6, 8, 5], 4), noise([9, 4, 7], 5)];
    let (mut walked, mut lit) = ([0u64; 2], 0);
    for (i, sets) in variants.into_iter().enumerate() {
        let mut scene = scene_with(furred.clone(), eyes[i % 3], sets);
        let parts = scene.edit();
        [parts.image.width, parts.image.height] = [61, 40];
        let recipe = parts.recipes[0].clone();
        let ramp = if sets.contains(&colored) { ramp(3) } else { Ramp::WHITE };
        let skin = sets.contains(&skin).then(super::shell_scatter::skin);
        parts.recipes =
            vec![Recipe { ramp, skin, ..recipe.clone() }, Recipe { flow: 0.3, moves: 0.6, ..recipe }];
        let mut torn = torn.clone();
        torn.volume = 1;
        parts.shells.extend([Arc::new(torn), Arc::new(ball.clone())]);
        // Opaque matter casts shadows on the shells, and ends some of the rays inside them.
        let corner = |x: f32, z: f32| Vec3::new(x, 2.5, z);
        parts.triangles =
            vec![walls(&[[corner(0.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(0.0, 9.0)]])];
        let mesh = scene.mesh();
        let shadows = scene.shadows_on_shells(&mesh, &Unwatched).expect("nobody stops it");
        assert_eq!(shadows.is_some(), scene.visibility != Visibility::None);
        let mut targets = gbuffer::run(&scene, &mesh, 0);
        for opaque in targets.opaque.iter_mut().step_by(3) {
            *opaque = [0.2, 0.3, 0.4, 4.0];
        }
        let pixels: Vec<[u32; 2]> = (0..61 * 40).map(|i| [i % 61, i / 61]).collect();
        let mut cache = LightVolumeCache::default();
        let mut prepared =
            || Integrator::prepared(&scene, &volumes, &mesh, &mut cache, &Unwatched).expect("a valid scene");
        let scalar = prepared();
        let truth: Vec<_> = pixels.iter().map(|&p| scalar.pixel(&targets, p, 0, &mut ())).collect();
        for result in &truth {
            (0..2).for_each(|c| walked[c] += u64::from(result.cells[c]));
            lit += u32::from(result.radiance.x > 0.3);
        }
        // Here each ray walks to the lights for what eight lanes have kept at the vertices.
        let on_demand = Integrator::new(&scene, &volumes)
            .with_shadows_of(&volumes, &mesh, &Unwatched)
            .expect("nobody stops it");
        for (pixel, truth) in pixels.iter().zip(&truth).step_by(5) {
            let alone = on_demand.pixel(&targets, *pixel, 0, &mut ());
            assert_eq!(bits(&alone), bits(truth), "{sets:?}, on demand, {pixel:?}: {alone:?} not {truth:?}");
        }
        for (name, lanes) in Lanes::all() {
            let integrator = prepared().with_lanes(lanes);
            integrator.walker().pixels(&targets, &pixels, 0, |i, seen| {
                let truth = &truth[i];
                assert_eq!(
                    bits(&seen),
                    bits(truth),
                    "{sets:?}, {name}, {:?}: {seen:?} not {truth:?}",
                    pixels[i]
                );
            });
        }
    }
    assert!(walked[0] > 100_000 && walked[1] > 100_000 && lit > 1000, "{walked:?}, {lit}");
}
