//! Cached visibility: light volumes hold the values that an exact walk from every cell gives.

use crate::engine::gpu::renderer;
use glam::{IVec3, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use taki::engine::cpu::integrate::Lanes;
use taki::engine::gpu::Filling;
use taki::engine::{RenderOptions, cpu};
use taki::light::Light;
use taki::light::fill::Rows;
use taki::light::optical_depth::{light_volume_value, optical_depth};
use taki::light::visibility::{Form, LightVolume, Medium};
use taki::picture::Frame;
use taki::scene::{Limits, Scene};
use taki::trace::lookup::Level;
use taki::trace::{Lookup, SheetDensity};
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, VolumeTexture, levels_of};
use taki::walk::NEVER;

/// Settings of a point light 8 cm before `front`.
const CLOSE: [&str; 3] =
    ["lights.key.kind=point", "lights.key.position=[0.3,0.4,0.58]", "lights.key.intensity=0.1"];

fn scene(preset: &str, sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.into()).collect();
    Scene::load(preset.as_ref(), &sets, &Limits::default()).expect("valid")
}

fn volume(scene: &Scene) -> VolumeTexture {
    scene.volume(1 << 30, &Unwatched).expect("a volume")
}

/// Root mean square difference of the radiances, relative to the mean radiance of the second frame.
fn rmse([a, b]: [&Frame; 2]) -> f64 {
    let (mut squares, mut sum, mut n) = (0.0, 0.0, 0.0);
    for (a, b) in a.radiance.iter().zip(&b.radiance) {
        for c in 0..3 {
            squares += f64::from(a[c] - b[c]).powi(2);
            sum += f64::from(b[c]);
            n += 1.0;
        }
    }
    (squares / n).sqrt() / (sum / n)
}

fn on_cpu(scene: &Scene) -> Frame {
    cpu::render(scene, &volume(scene), &scene.mesh(), false, &Unwatched).expect("a frame")
}

/// A volume whose size alone counts.
fn hollow(size: [u32; 3]) -> VolumeTexture {
    VolumeTexture { size, alpha: 1.0, cells: Default::default() }
}

#[test]
fn one_light_volume_serves_all_quads_that_have_the_same_jacobian_and_light() {
    let size = [40; 3];
    let of = |sets: &[&str]| scene("front", sets).light_volumes(&hollow(size), u64::MAX).expect("they fit");
    let one = of(&[]);
    assert_eq!((one.volumes.len(), one.cornered(), one.patches.len()), (1, false, 1));
    // The same parallelogram again at another place; then with another thickness; then another eye on the
    // same side.
    let mut two = scene("front", &[]);
    let mut moved = two.quads[0];
    moved.corners = moved.corners.map(|c| c + Vec3::new(3.0, 1.0, -2.0));
    moved.map.a_world = moved.corners[0];
    two.edit().quads.push(moved);
    let volumes = two.light_volumes(&hollow(size), u64::MAX).expect("they fit");
    assert_eq!((volumes.volumes.len(), volumes.patches.len()), (1, 2));
    two.edit().quads[1].material.thickness_m *= 2.0;
    assert_eq!(two.light_volumes(&hollow(size), u64::MAX).expect("they fit").volumes.len(), 2);
    let elsewhere = of(&["camera.eye=[0.7,1.0,2.0]", "image.exposure=3", "volume.flow=0.4"]);
    assert_eq!(elsewhere, one, "camera, exposure and flow leave light volumes as they are");
    // σ leaves light volumes of optical depths as they are, too.
    let many = of(&["light.visibility=cached", "light.scattering=multiple"]);
    assert_eq!(of(&["light.visibility=cached", "light.scattering=multiple", "trace.sigma=3"]), many);
    // From behind, the eye sees the other face.
    let behind = of(&["camera.eye=[0,0,-3.5]"]);
    assert!(
        (behind.volumes[0].direction * Vec3::new(1.0, 1.0, -1.0) - one.volumes[0].direction).length() < 1e-5
    );
}

#[test]
fn a_point_light_near_a_quad_cuts_it_into_patches_and_a_far_one_does_not() {
    let of = |position: &str| {
        let position = format!("lights.key.position={position}");
        let scene = scene("front", &["lights.key.kind=point", &position]);
        scene.light_volumes(&hollow([40; 3]), u64::MAX).expect("they fit")
    };
    let near = of("[0.2,0.3,0.8]");
    assert!(near.cornered() && near.volumes.len() > 16, "{:?}", near.patches);
    assert!(!of("[200,300,800]").cornered());
    // A light closer than a patch is wide: cells below it walk, and farther cells do not.
    let close = of("[0.3,0.4,0.58]");
    let marched = close.marched.iter().filter(|&&marched| marched).count();
    assert!((10..100).contains(&marched), "{marched} of 256 patches");
    assert!(close.volumes.len() < near.volumes.len() && !of("[0.3,0.4,1.2]").marches());
}

#[test]
fn light_volumes_over_the_budget_are_coarser_and_then_refused_with_what_they_need() {
    let near = ["lights.key.kind=point", "lights.key.position=[0.2,0.3,0.8]", "light.visibility=cached"];
    let of = |budget: u64| scene("front", &near).light_volumes(&hollow([40; 3]), budget);
    let whole = of(u64::MAX).expect("they fit");
    let tight = of(whole.bytes(&[[40; 3]]) as u64 - 1).expect("coarser ones fit");
    assert!(tight.volumes.len() < whole.volumes.len());
    let error = of(100_000).expect_err("nothing fits");
    assert_eq!(error.exit_code(), 33);
    let words = error.to_string();
    assert!(words.contains("light.cache") && words.contains("light.visibility=march"), "{words}");
    let limits = Limits { memory: 100 << 20, ..Limits::default() };
    assert_eq!(Scene::load("front".as_ref(), &[], &limits).expect("valid").light_cache, 50 << 20);
}

#[test]
fn a_frame_whose_light_volumes_do_not_fit_is_refused_once_and_in_one_line() {
    let sets = [
        "--set=light.visibility=cached",
        "--set=light.cache=1",
        "--set=volume.nx=256",
        "--set=volume.ny=256",
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.png");
    let mut args = vec!["render", "front", "-o", out.to_str().expect("UTF-8")];
    args.extend(sets);
    let run = crate::cli::faults::run(&mut crate::cli::faults::taki(&args));
    run.refused(33, &["cached visibility of 1 lights on 1 quads needs 2.5 MiB", "light.cache=3"]);
    assert!(!run.stderr().contains("once more"), "{}", run.stderr());
    // The advice leads to a picture.
    args.extend(["--set=light.cache=3", "--size=32x32"]);
    crate::cli::faults::run(&mut crate::cli::faults::taki(&args)).done();
}

#[test]
fn depths_through_a_uniform_slab_are_its_thickness_over_the_cosine() {
    let mut front = scene("front", &[]);
    let mut uniform = volume(&front);
    let full = uniform.cells.iter().find(|c| c.rho_code() == 0xffff).copied().expect("a full cell");
    uniform.cells = vec![full; 40 * 40 * 40].into();
    for (towards, cosine) in
        [(Vec3::Z, 1.0), (Vec3::new(0.6, 0.0, 0.8), 0.8), (Vec3::new(0.0, -0.8, -0.6), 0.6)]
    {
        front.edit().lights = vec![Light::Directional { to_light: towards, intensity: Vec3::ONE }];
        let volumes = front.light_volumes(&hollow(uniform.size), u64::MAX).expect("they fit");
        for z in [0, 7, 39] {
            let cell = IVec3::new(3, 5, z);
            let depth = optical_depth(
                &Level::new(std::slice::from_ref(&uniform), 0),
                &SheetDensity::WHOLE,
                cell,
                volumes.volumes[0].direction,
                volumes.medium,
                NEVER,
                &mut 0,
            ) / 65535.0;
            let above = if towards.z > 0.0 { z as f32 + 0.5 } else { 39.5 - z as f32 };
            assert!((depth * cosine / above - 1.0).abs() < 1e-5, "{towards} {z}: {depth}");
        }
    }
    // With attenuation per cell, a cell does not hide its own light.
    let medium = Medium { per_cell: true, max_cells: 512 };
    let mut walked = 0;
    let depth = optical_depth(
        &Level::new(&[uniform], 0),
        &SheetDensity::WHOLE,
        IVec3::new(3, 5, 7),
        Vec3::NEG_Z,
        medium,
        NEVER,
        &mut walked,
    );
    assert_eq!((depth, walked), (7.0 * 65535.0, 8));
}

#[test]
fn cached_visibility_is_within_two_per_cent_of_an_exact_walk_from_every_cell() {
    let size = ["image.width=200", "image.height=200"];
    let near = ["lights.key.kind=point", "lights.key.position=[0.3,0.4,1.2]", "lights.key.intensity=2"];
    let cell = ["trace.attenuation=per-cell", "trace.tau=0.3"];
    let keys = ["main.edge", "main.breakup", "main.fade", "leap.edge", "leap.breakup"];
    let more = ["thread.edge", "thread.breakup", "far.edge", "far.breakup"];
    let surges = ["main.surge", "leap.surge", "thread.surge", "far.surge"];
    let whole: Vec<String> =
        keys.iter().chain(&more).chain(&surges).map(|key| format!("sheets.{key}=0")).collect();
    let whole: Vec<&str> = whole.iter().map(String::as_str).collect();
    let few = [&whole[..], &["light.cache=160"]].concat();
    // A directional light on a parallelogram is exact except for the codes. √T in 255ths gives T to 0.0039·√T
    // at most and to 0.0023·√T in the mean. Relative to T that is more where it is dark, and less in the mean
    // of a ray's cells. Under a point light half the quad's width away, directions turn by 80° over the quad.
    // The promise does not cover this interpolation between corners 5° apart. Under one 8 cm away, cells near
    // it walk to the light.
    for (preset, more, allowed) in [
        ("front", &[][..], 2.5e-3),
        ("front", &cell[..], 2.5e-3),
        ("front", &near[..], 0.06),
        ("front", &CLOSE[..], 0.025),
        ("fig5", &[][..], 0.02),
        ("waterfall", &whole[..], 0.02),
        // Quads share light volumes whose directions are up to 8° apart, so that all of them fit into 160
        // MiB.
        ("waterfall", &few[..], 0.035),
        // In eroded water the depths are reduced by the mean loss over cells, not cell by cell.
        ("waterfall", &[][..], 0.05),
    ] {
        let sets: Vec<&str> = size.iter().chain(more).copied().collect();
        let [march, cached, none] = ["march", "cached", "none"].map(|visibility| {
            let visibility = format!("light.visibility={visibility}");
            on_cpu(&scene(preset, &[&sets[..], &[&visibility]].concat()))
        });
        let error = rmse([&cached, &march]);
        println!("{preset} {more:?}: cached {error:.5}, none {:.3}", rmse([&none, &march]));
        assert!(error <= allowed, "{preset} {more:?}: {error}");
        // The comparison can fail: it does without attenuation.
        assert!(rmse([&none, &march]) > 0.02, "{preset} {more:?}");
    }
}

#[test]
fn the_engines_agree_on_light_volumes() {
    let Some(mut renderer) = renderer("light volumes") else { return };
    let small = ["image.width=96", "image.height=80", "light.visibility=cached"];
    let near = ["lights.key.kind=point", "lights.key.position=[0.3,0.4,1.2]"];
    let behind = ["camera.eye=[0.3,0.2,-3.5]"];
    let cell = ["trace.attenuation=per-cell", "light.frame=texture", "trace.max_cells=30"];
    for (preset, more) in [
        ("front", &near[..]),
        ("front", &CLOSE[..]),
        ("front", &behind[..]),
        ("front", &cell[..]),
        ("fig5", &[][..]),
    ] {
        let sets: Vec<&str> = small.iter().chain(more).copied().collect();
        let scene = scene(preset, &sets);
        let (volume, mesh) = (volume(&scene), scene.mesh());
        let on_cpu = cpu::render(&scene, &volume, &mesh, true, &Unwatched).expect("a frame");
        for filling in [Filling::Device, Filling::Host] {
            renderer.forget_light_volumes();
            let options = RenderOptions { surface: true, filling, ..Default::default() };
            let on_gpu = renderer.render(&scene, &volume, &mesh, &options, &Unwatched).expect("a frame");
            assert!(on_gpu.seconds.visibility > 0.0, "{preset} {more:?} {filling:?}: filled anew");
            let both = [on_gpu, on_cpu.clone()];
            crate::engine::gpu::assert_parity(&format!("{preset} {more:?} {filling:?}"), &both);
        }
    }
}

/// Light rays of a scene's frame on the CPU and, if there is a device, on the GPU, with the frames.
fn with_and_without_plan(test: &str, scene: &Scene) -> Vec<[Frame; 2]> {
    // Without a budget for light volumes, rays walk.
    let mut walked = scene.clone();
    walked.edit().light_cache = 0;
    let (volume, mesh) = (volume(scene), scene.mesh());
    let on_cpu = [scene, &walked].map(on_cpu);
    let on_gpu = renderer(test).map(|mut renderer| {
        [scene, &walked].map(|scene| {
            let options = RenderOptions::default();
            renderer.render(scene, &volume, &mesh, &options, &Unwatched).expect("a frame")
        })
    });
    [Some(on_cpu), on_gpu].into_iter().flatten().collect()
}

#[test]
fn where_light_volumes_equal_the_walks_to_the_lights_they_take_their_place() {
    let small = ["image.width=96", "image.height=80", "light.visibility=march"];
    let odd = ["volume.nx=37", "volume.ny=41", "volume.nz=23", "camera.eye=[0.9,0.4,2.2]"];
    let behind = ["camera.eye=[0.3,0.2,-3.5]", "lights.key.direction=[0.4,-0.3,0.5]"];
    for more in [
        &odd[..],
        &behind,
        &["lights.key.direction=[1,0,0.02]", "trace.max_cells=200"],
        &["trace.attenuation=per-cell", "light.frame=texture", "trace.max_cells=30"],
        &["trace.filter=pyramid", "camera.eye=[0,0,9]"],
        &["trace.lookup=trilinear", "volume.nx=24", "volume.ny=24"],
        &["light.scattering=multiple", "light.reflection=strand"],
        &["environment.kind=sky", "environment.lights=5", "image.samples=2"],
    ] {
        let sets: Vec<&str> = small.iter().chain(more).copied().collect();
        for [planned, walked] in with_and_without_plan("exact light volumes", &scene("front", &sets)) {
            let [own, light] = planned.cells_walked();
            assert_eq!((own, light), (walked.cells_walked()[0], 0), "{more:?}");
            assert!(walked.cells_walked()[1] > 10 * own / 4, "{more:?}: rays walk");
            let brightest = walked.radiance.iter().flatten().fold(0f32, |a, b| a.max(*b));
            for (a, b) in planned.radiance.iter().zip(&walked.radiance) {
                let near = |c: usize| (a[c] - b[c]).abs() <= 1e-5 * b[c].abs() + 1e-7 * brightest;
                assert!((0..4).all(near), "{more:?}: {a:?} for {b:?}");
            }
        }
    }
}

#[test]
fn where_light_volumes_would_not_equal_the_walks_or_cost_more_rays_walk() {
    let small = ["image.width=48", "image.height=40", "image.samples=1", "light.visibility=march"];
    let plan = |preset: &str, more: &[&str]| {
        let sets: Vec<&str> = small.iter().chain(more).copied().collect();
        let scene = scene(preset, &sets);
        scene.light_plan(&volume(&scene)).expect("march needs no budget").is_some()
    };
    assert!(plan("front", &[]));
    for (preset, more) in [
        // A light that is near, quads that fan out, matter that a sheet makes thinner.
        ("front", &CLOSE[..]),
        ("fig5", &[]),
        ("waterfall", &["volume.nx=8", "volume.ny=8"]),
        // Longer walks than a light volume holds.
        ("front", &["trace.max_cells=65536"]),
        // More cells than the rays meet, and sparse ones.
        ("front", &["image.width=8", "image.height=8"]),
        ("front", &["volume.storage=sparse"]),
    ] {
        assert!(!plan(preset, more), "{preset} {more:?}");
    }
}

#[test]
fn light_volumes_hold_what_the_walk_from_every_cell_finds_to_the_bit() {
    let of = |sets: &[&str]| {
        let scene = scene("fig5", sets);
        let volume = volume(&scene);
        (levels_of(&volume, scene.pyramid_spec(&volume)), volume)
    };
    let odd = ["volume.nx=13", "volume.ny=9", "volume.nz=7", "curves.across=4", "curves.deep=4"];
    let (plain, whole) = of(&odd);
    let (pyramid, _) = of(&[&odd[..], &["trace.filter=pyramid"]].concat());
    let most = whole.cells.iter().filter(|cell| cell.rho_code() > 0).count();
    assert!((100..whole.cells.len() - 100).contains(&most), "{most} cells: some are empty");
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let mut compared = 0;
    for round in 0..60 {
        let levels = [&plain, &pyramid][round % 2];
        let mut direction = Vec3::from_array([0; 3].map(|_| rng.random_range(-4.0..4.0)));
        match round % 5 {
            // Directions along the slab, which the walk then never leaves; along axes; and through corners.
            0 => direction.z = 0.0,
            1 => direction = Vec3::new(0.0, -0.0, -1.0),
            2 => direction = Vec3::new(-1.0, 1.0, 1.0),
            _ => {}
        }
        let light_volume = LightVolume { volume: 0, direction, bits: [1e-5, 1e-4][round % 2] };
        for (per_cell, max_cells) in [(false, 512), (true, 512), (false, 5)] {
            let medium = Medium { per_cell, max_cells };
            for (form, lookup) in [(Form::Depths, Lookup::Nearest), (Form::Codes, Lookup::Trilinear)] {
                let filled = Rows::new(levels, lookup).fill(&light_volume, medium, form);
                assert_eq!(filled.len(), levels.len());
                for (at, numbers) in filled.iter().enumerate() {
                    let level = Level::new(levels, at as u32);
                    let [nx, ny, _] = level.volume.size.map(|n| n as usize);
                    for (index, cell) in level.volume.cells.iter().enumerate() {
                        let place = [index % nx, index / nx % ny, index / nx / ny].map(|c| c as i32);
                        let asked = cell.rho_code() > 0 || lookup == Lookup::Trilinear;
                        let expected = match asked {
                            true => light_volume_value(&level, place.into(), &light_volume, medium, form),
                            false => 0.0,
                        };
                        assert_eq!(numbers.at(index), expected, "{direction} {medium:?} {form:?} {place:?}");
                        compared += usize::from(expected > 0.0);
                    }
                }
            }
        }
    }
    assert!(compared > 100_000, "{compared} were above 0");
}

#[test]
fn rows_of_any_width_have_the_sums_of_the_walk_on_every_instruction_set() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut compared = 0;
    for nx in [1, 7, 8, 13, 21, 29, 37, 45, 48, 70, 100] {
        let size = [nx, 3, 5];
        let mut cell = || match rng.random::<f32>() {
            x if x < 0.6 => Cell::from_direction(Vec3::Y).with_density(x, 1.0, 1.0),
            _ => Cell::default(),
        };
        let cells: Vec<Cell> = (0..size.iter().product::<u32>()).map(|_| cell()).collect();
        let volume = VolumeTexture { size, alpha: 1.0, cells: cells.into() };
        let levels = levels_of(&volume, scene("front", &[]).pyramid_spec(&volume));
        let level = Level::new(&levels, 0);
        for direction in [Vec3::new(3.7, 0.2, 1.0), Vec3::new(-30.0, -2.0, -1.0)] {
            let light_volume = LightVolume { volume: 0, direction, bits: 3e-5 };
            let medium = Medium { per_cell: false, max_cells: 512 };
            for form in [Form::Codes, Form::Depths] {
                let walked: Vec<f32> = (0..nx * 15)
                    .map(|index| {
                        let cell = [index % nx, index / nx % 3, index / nx / 3].map(|c| c as i32).into();
                        let is_read = level.cell(cell).rho_code() > 0;
                        let value = light_volume_value(&level, cell, &light_volume, medium, form);
                        compared += u32::from(is_read && value > 0.0);
                        if is_read { value } else { 0.0 }
                    })
                    .collect();
                for (name, lanes) in Lanes::all() {
                    let Lanes::Lockstep(simd) = lanes else { continue };
                    let rows = Rows::summed_with(simd, &levels, Lookup::Nearest);
                    let filled = rows.fill(&light_volume, medium, form);
                    let summed: Vec<f32> = (0..walked.len()).map(|index| filled[0].at(index)).collect();
                    assert_eq!(summed, walked, "{nx} cells, {direction}, {form:?}, {name}");
                }
            }
        }
    }
    assert!(compared > 10_000, "{compared} were above 0");
}

#[test]
fn light_volumes_on_the_device_are_kept_and_never_stale() {
    let Some(mut kept) = renderer("kept light volumes") else { return };
    let base = ["image.width=60", "image.height=50", "light.visibility=cached"];
    let changes: [(&str, bool); 10] = [
        ("volume.seed=1", true),
        ("camera.eye=[0.5,0.2,3]", false),
        ("image.exposure=1", false),
        ("volume.flow=0.3", false),
        ("trace.sigma=4", true),
        ("lights.key.intensity=2", false),
        ("lights.key.direction=[0.1,0.9,0.4]", true),
        ("materials.water.thickness=0.9", true),
        ("trace.attenuation=per-cell", true),
        ("camera.eye=[0,0,-3]", true),
    ];
    let mut sets: Vec<&str> = base.to_vec();
    let mut of: Option<VolumeTexture> = None;
    for (change, walks) in changes {
        sets.push(change);
        let scene = scene("front", &sets);
        let (volume, mesh) = (of.get_or_insert_with(|| volume(&scene)).clone(), scene.mesh());
        let frame = kept.render(&scene, &volume, &mesh, &Default::default(), &Unwatched).expect("a frame");
        assert_eq!(frame.seconds.visibility > 0.0, walks, "{change}");
        let mut fresh = renderer("a new renderer").expect("as before");
        let new = fresh.render(&scene, &volume, &mesh, &Default::default(), &Unwatched).expect("a frame");
        assert_eq!(frame.radiance, new.radiance, "{change}");
    }
}

#[test]
fn bad_values_of_light_in_the_volume_have_their_line() {
    for (set, words) in [
        ("light.visibility=kept", "march, cached, none"),
        ("light.cache=0", "1 to 65536"),
        ("light.cache=1.5", "1 to 65536"),
        ("trace.layers=17", "1 to 16"),
        ("light.reflection=water", "kajiya-kay, strand, hair"),
        ("light.scattering=twice", "single, multiple"),
        ("light.scattering=multiple", "use light.visibility=cached or march"),
        ("strand.radius=0", "1e-5 to 1"),
        ("strand.roughness_m=0.05", "0.1 to 1"),
        ("strand.roughness_n=1.01", "0.1 to 1"),
        ("strand.absorption=-1", "0 to 10000"),
        ("strand.aeration=1.5", "0 to 1"),
        ("strand.g=1", "-0.99 to 0.99"),
        ("hair.eta=1", "1.1 to 3"),
        ("hair.tilt=11", "-10 to 10"),
        ("hair.melanin=-1", "0 to 100"),
        ("hair.redness=1.1", "0 to 1"),
        ("hair.beta_m=0.05", "0.1 to 1"),
        ("hair.beta_n=1.01", "0.1 to 1"),
    ] {
        let error =
            Scene::load("front".as_ref(), &[set.into()], &Limits::default()).expect_err(set).to_string();
        assert!(error.contains(words), "{set}: {error}");
    }
}

#[test]
fn a_kept_walk_that_ends_in_the_dark_has_the_code_of_the_whole_one() {
    use taki::light::visibility::{DARK_BITS, transmittance_code};
    assert_eq!([DARK_BITS, DARK_BITS - 0.01].map(transmittance_code), [0, 0]);
    assert!(transmittance_code(DARK_BITS - 0.1) > 0, "the walk ends no later than necessary");
    let volume = volume(&scene("front", &[]));
    let medium = Medium { per_cell: false, max_cells: 512 };
    let direction = Vec3::new(3.0, 0.7, -0.1);
    let bits = 1e-5;
    let (mut whole, mut early) = (0, 0);
    let level = Level::new(std::slice::from_ref(&volume), 0);
    for x in 0..40 {
        let cell = IVec3::new(x, 9, 30);
        let depth = |enough, walked: &mut u32| {
            optical_depth(&level, &SheetDensity::WHOLE, cell, direction, medium, enough, walked) * bits
        };
        let codes = [depth(NEVER, &mut whole), depth(DARK_BITS / bits, &mut early)].map(transmittance_code);
        assert_eq!(codes[0], codes[1], "{x}");
    }
    assert!(early < whole, "{early} of {whole} cells");
}
