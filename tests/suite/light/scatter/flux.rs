//! Fluxes of homogeneous slabs: the exact solution against published values and a random walk, and the model
//! and the renderer against the exact solution. `docs/method.md` holds the tables that these tests print.

use std::f64::consts::{LOG2_E, PI, TAU};

use super::tracer::henyey_greenstein;
use glam::{DVec3, Vec3};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use taki::engine::cpu::integrate::Integrator;
use taki::light::Light;
use taki::light::scatter::doubling::{MOMENTS, emergent};
use taki::light::scatter::{Layers, Profile, Row, Scattering, forward_peak, multiple};
use taki::scene::{Limits, Scene};
use taki::trace::Attenuation;
use taki::util::monitor::Unwatched;
use taki::volume::VolumeTexture;

/// Number of cosines of the eye, and of its azimuths over half a turn.
const EYES: usize = 20;
const TURNS: usize = 32;

/// `count` cosines of the eye. Even steps of μ² weight them as flux does.
fn cosines(count: usize) -> Vec<f64> {
    (0..count).map(|i| ((i as f64 + 0.5) / count as f64).sqrt()).collect()
}

fn eyes() -> Vec<f64> {
    cosines(EYES)
}

fn moments(g: f64) -> [f64; MOMENTS] {
    std::array::from_fn(|l| g.powi(l as i32))
}

/// Shares of a beam's light that a slab sends back and through, the latter with the beam, by doubling.
fn exact(x: f64, omega: f64, g: f64, mu_0: f64) -> [f64; 2] {
    exact_for(x, omega, g, mu_0, &eyes())
}

pub fn exact_for(x: f64, omega: f64, g: f64, mu_0: f64, eyes: &[f64]) -> [f64; 2] {
    let out = emergent(x, omega, &moments(g), &[mu_0], eyes);
    let [back, through] = out.faces.map(|face| face.iter().sum::<f64>() / eyes.len() as f64 / mu_0);
    [back, through + (-x / mu_0).exp()]
}

/// The same by `count` random walks, with the standard deviation of each.
fn walked(x: f64, omega: f64, g: f64, mu_0: f64, count: u32) -> [[f64; 2]; 2] {
    let sums = (0..64u64)
        .into_par_iter()
        .map(|seed| {
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let mut sums = [0.0; 2];
            for _ in 0..count / 64 {
                let (mut z, mut mu, mut weight) = (0.0, mu_0, 1.0);
                loop {
                    z -= mu * (1.0 - rng.random::<f64>()).ln();
                    if !(0.0..=x).contains(&z) {
                        sums[usize::from(z > x)] += weight;
                        break;
                    }
                    weight *= omega;
                    if weight < 0.1 {
                        if rng.random::<bool>() {
                            break;
                        }
                        weight *= 2.0;
                    }
                    mu = turned(mu, g, &mut rng);
                }
            }
            sums
        })
        .collect::<Vec<_>>();
    let n = f64::from(count / 64 * 64);
    [0, 1].map(|side| {
        let share = sums.iter().map(|sum| sum[side]).sum::<f64>() / n;
        // The weights are at most 1.
        [share, (share * (1.0 - share).max(0.0) / n).sqrt()]
    })
}

/// Cosine after a scattering by Henyey and Greenstein's function.
fn turned(mu: f64, g: f64, rng: &mut impl Rng) -> f64 {
    let u: f64 = rng.random();
    let cos = match g == 0.0 {
        true => 1.0 - 2.0 * u,
        false => {
            let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
            ((1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0)
        }
    };
    let turn = (TAU * rng.random::<f64>()).cos();
    (mu * cos + ((1.0 - mu * mu) * (1.0 - cos * cos)).sqrt() * turn).clamp(-1.0, 1.0)
}

/// The same of the model: the light of `layers` even layers, summed as the renderer does it.
fn modelled(layers: usize, x: f64, omega: f64, g: f64, mu_0: &[f64]) -> Vec<[f64; 2]> {
    let scattering = Scattering { albedo: Vec3::splat(omega as f32), g: g as f32 };
    let similarity = scattering.similarity();
    let profile = Profile::new(&Layers::new(vec![x / layers as f64; layers]), &scattering);
    let side = |mu_0: f64, sign: f64| -> f64 {
        let row = Row::new((sign * mu_0) as f32, layers as u32);
        let sum = eyes().into_iter().map(|mu| {
            let gain = profile.gain(&row, mu as f32);
            let turns = (0..TURNS).map(|turn| {
                let turn = (turn as f64 + 0.5) / TURNS as f64 * PI;
                let cos = -sign * mu * mu_0 + ((1.0 - mu * mu) * (1.0 - mu_0 * mu_0)).sqrt() * turn.cos();
                let psi = omega * PI * henyey_greenstein(g, cos);
                let peak = forward_peak(similarity.g, cos as f32);
                let cell = |z: usize| {
                    let depth = x / layers as f64;
                    let view = depth * z as f64 / mu;
                    let within = depth / mu;
                    let middle = depth * (z as f64 + 0.5);
                    let light = if sign > 0.0 { middle } else { x - middle } / mu_0;
                    let weight = (-view).exp() - (-view - within).exp();
                    let [view, within, light_bits] = [view, within, light].map(|d| (d * LOG2_E) as f32);
                    let diffuse = profile.at(&row, z as u32);
                    let more = multiple(&similarity, &peak, diffuse, view, within, light_bits).x;
                    weight * psi * (-light).exp()
                        + f64::from(gain.x * more)
                        + omega * f64::from(gain.w) * weight
                };
                (0..layers).map(cell).sum::<f64>()
            });
            turns.sum::<f64>() / TURNS as f64
        });
        sum.sum::<f64>() / EYES as f64 / mu_0
    };
    let fluxes = |mu_0: &f64| [side(*mu_0, 1.0), side(*mu_0, -1.0) + (-x / mu_0).exp()];
    mu_0.iter().map(fluxes).collect()
}

/// Error of a share of light. Below a hundredth of the beam it is taken against that hundredth.
fn off(got: f64, want: f64) -> f64 {
    (got - want) / want.max(0.01)
}

#[test]
fn light_leaves_a_slab_as_van_de_hulst_and_random_walks_found() {
    // Van de Hulst 1980, table 35, as quoted by Wang, Jacques and Zheng 1995: g = 0.75, ω = 0.9, τ = 2,
    // normal incidence. They count all light, in all directions.
    let fine = cosines(400);
    let [back, through] = exact_for(2.0, 0.9, 0.75, 1.0, &fine);
    assert!((back - 0.09739).abs() < 1e-5 && (through - 0.66096).abs() < 1e-4, "{back} {through}");
    for (x, omega, g, mu_0) in [
        (1.0, 1.0, 0.8, 0.1),
        (1.0, 1.0, 0.8, 1.0),
        (3.0, 0.9, 0.85, 0.5),
        (10.0, 1.0, 0.8, 0.8),
        (10.0, 0.8, 0.5, 0.3),
        (30.0, 1.0, 0.85, 0.6),
    ] {
        let (exact, walked) = (exact_for(x, omega, g, mu_0, &fine), walked(x, omega, g, mu_0, 200_000));
        for (exact, [walked, sigma]) in exact.into_iter().zip(walked) {
            // The peak that doubling cuts off is worth up to a quarter of a per cent at g = 0.85.
            let allowed = 4.0 * sigma + 0.0025 * walked;
            assert!((exact - walked).abs() < allowed, "{x} {omega} {g} {mu_0}: {exact}, not {walked}");
        }
    }
    // Nothing is lost.
    for (x, g, mu_0) in [(0.01, 0.0, 0.3), (1.0, 0.85, 0.7), (50.0, 0.5, 1.0), (500.0, -0.4, 0.2)] {
        let sum: f64 = exact_for(x, 1.0, g, mu_0, &fine).iter().sum();
        assert!((sum - 1.0).abs() < 2.5e-3, "{x} {g} {mu_0}: {sum}");
    }
}

#[test]
fn a_homogeneous_slab_sends_back_and_through_what_it_should() {
    let depths = [0.1, 0.3, 1.0, 3.0, 10.0, 50.0];
    let cosines = [0.1, 0.12, 0.2, 0.36, 0.6, 0.85, 1.0];
    println!("largest error of the flux in %, reflected / transmitted, by layers, g and tau {depths:?}");
    for layers in [80, 40, 20, 8] {
        for g in [0.0, 0.5, 0.8, 0.85] {
            let largest = |x: &f64| {
                let mut most = [0.0f64; 2];
                for omega in [1.0, 0.9, 0.8] {
                    for (got, mu_0) in modelled(layers, *x, omega, g, &cosines).iter().zip(cosines) {
                        let want = exact(*x, omega, g, mu_0);
                        most = [0, 1].map(|side| most[side].max(off(got[side], want[side]).abs()));
                    }
                }
                most
            };
            let errors: Vec<[f64; 2]> = depths.par_iter().map(largest).collect();
            let words = errors.iter().map(|[r, t]| format!(" {:.1} / {:.1} |", 100.0 * r, 100.0 * t));
            println!("| {layers} | {g} |{}", words.collect::<String>());
            let worst = errors.iter().flatten().fold(0.0f64, |a, b| a.max(*b));
            assert!(worst < 0.04, "{layers} layers, g {g}: {errors:?}");
        }
    }
}

/// A slab of air alone, or of mist, 1 m thick and facing +z.
fn slab(sets: &[&str], layers: u32) -> (Scene, VolumeTexture) {
    let nz = format!("volume.nz={layers}");
    let air = ["light.reflection=strand", "strand.aeration=1", "light.scattering=multiple"];
    let more = ["volume.nx=4", "volume.ny=4", "curves.across=4", "curves.deep=4", "light.ambient=[0,0,0]"];
    let march = ["light.visibility=march", "trace.max_cells=4000", "volume.k_d=0.5", "volume.k_s=0.5"];
    let sets: Vec<String> =
        air.iter().chain(&more).chain(&march).chain([&&*nz]).chain(sets).map(|&s| s.into()).collect();
    let scene = Scene::load("front".as_ref(), &sets, &Limits::default()).expect("valid");
    let mut volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let any = *volume.cells.iter().find(|cell| cell.rho_code() > 0).as_ref().expect("an occupied cell");
    let full = any.with_density(1.0, 0.5, 0.5);
    volume.cells = vec![full; (16 * layers) as usize].into();
    (scene, volume)
}

/// Radiance and transmittance that the renderer finds for an eye in the direction `e`.
fn seen(integrator: &Integrator, e: DVec3) -> [f64; 2] {
    let ray = integrator.trace(0, -e.as_vec3(), [0.4, 0.6, 0.0], Vec3::ZERO, &mut ());
    [ray.radiance.x.into(), ray.transmittance.into()]
}

fn direction(mu: f64, turn: f64) -> DVec3 {
    let sin = (1.0 - mu * mu).sqrt();
    DVec3::new(sin * turn.cos(), sin * turn.sin(), mu)
}

/// Shares of a beam's light that the renderer sends back and through, the latter with the beam.
fn rendered(scene: &mut Scene, volume: &VolumeTexture, mu_0: f64) -> [f64; 2] {
    let mut shares = [1.0, -1.0].map(|side| {
        let to_light = direction(mu_0, 0.3) * DVec3::new(1.0, 1.0, side);
        scene.edit().lights = vec![Light::Directional { to_light: to_light.as_vec3(), intensity: Vec3::ONE }];
        let integrator = Integrator::new(scene, volume);
        let all = eyes().into_iter().enumerate().flat_map(|(i, mu)| {
            // The azimuths of successive cosines lie between one another.
            let shift = (i as f64 * 0.618).fract();
            (0..TURNS).map(move |turn| direction(mu, (turn as f64 + shift) / TURNS as f64 * TAU))
        });
        all.map(|e| seen(&integrator, e)[0]).sum::<f64>() / (EYES * TURNS) as f64 / mu_0
    });
    shares[1] += seen(&Integrator::new(scene, volume), direction(mu_0, 0.3))[1];
    shares
}

#[test]
fn the_renderer_keeps_the_energy_of_slabs() {
    println!("reflected and transmitted share, albedo 1: rendered, exact");
    for (g, x) in [(0.0, 3.0), (0.5, 1.0), (0.8, 0.3), (0.8, 1.0), (0.8, 10.0), (0.85, 3.0)] {
        let g_set = format!("strand.g={g}");
        let (mut scene, volume) = slab(&[&g_set], 40);
        scene.edit().trace.attenuation = Attenuation::PathLength { sigma: x as f32 };
        for mu_0 in [0.15, 0.5, 0.9] {
            let (got, want) = (rendered(&mut scene, &volume, mu_0), exact(x, 1.0, g, mu_0));
            println!("g {g} tau {x} mu {mu_0}: {got:.3?} {want:.3?}, sum {:.3}", got[0] + got[1]);
            for side in 0..2 {
                assert!(off(got[side], want[side]).abs() < 0.05, "{g} {x} {mu_0}: {got:?}, not {want:?}");
            }
        }
    }
}

/// `count` directions spread evenly over the sphere.
fn sphere(count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        direction(z.abs(), i as f64 * 2.399_963_229_728_653) * DVec3::new(1.0, 1.0, z.signum())
    })
}

/// Radiance of a slab in the middle of a white sphere, which is 1 if it keeps all light, for four eyes.
fn furnace(scene: &mut Scene, volume: &VolumeTexture, lights: usize) -> [f64; 4] {
    let intensity = Vec3::splat(4.0 / lights as f32);
    let lamps = sphere(lights).map(|l| Light::Directional { to_light: l.as_vec3(), intensity });
    scene.edit().lights = lamps.collect();
    let integrator = Integrator::new(scene, volume);
    [0.2, 0.5, 0.8, 1.0].map(|mu| seen(&integrator, direction(mu, 1.1)).iter().sum())
}

#[test]
fn a_white_furnace_stays_white() {
    let depths = [0.3, 1.0, 3.0, 10.0, 50.0];
    println!("least and greatest radiance, by g and tau {depths:?}");
    for count in [1024, 24] {
        for g in [0.0, 0.5, 0.8, 0.85] {
            let extremes = depths.map(|x| {
                let (mut scene, volume) = slab(&[&format!("strand.g={g}")], 40);
                scene.edit().trace.attenuation = Attenuation::PathLength { sigma: x };
                let radiances = furnace(&mut scene, &volume, count);
                [radiances.into_iter().fold(9.0, f64::min), radiances.into_iter().fold(0.0, f64::max)]
            });
            let words = extremes.map(|[least, most]| format!(" {least:.3} to {most:.3} |"));
            println!("{count} lights | {g} |{}", words.concat());
            // A few lights miss the peak of the phase function, or meet it.
            let allowed = if count > 100 { 0.01 } else { 0.15 };
            assert!(
                extremes.iter().flatten().all(|r| (r - 1.0).abs() < allowed),
                "{count} {g}: {extremes:?}"
            );
        }
    }
}

#[test]
fn cells_that_do_not_hide_their_own_light_send_back_no_more() {
    // Along the normal, a cell is as long as a layer, so both attenuations mean the same medium.
    let (mut scene, volume) = slab(&["strand.g=0.5"], 12);
    scene.edit().lights = vec![Light::Directional { to_light: Vec3::Z, intensity: Vec3::ONE }];
    let eye = DVec3::new(1e-4, 1e-4, 1.0).normalize();
    let [metres, cells] =
        [Attenuation::PathLength { sigma: 6.0 }, Attenuation::PerCell { tau: 0.5 }].map(|attenuation| {
            scene.edit().trace.attenuation = attenuation;
            [taki::light::Scattering::Multiple, taki::light::Scattering::Single].map(|scattering| {
                scene.edit().scattering = scattering;
                seen(&Integrator::new(&scene, &volume), eye)[0]
            })
        });
    println!("multiple, single: {metres:.4?} per metre, {cells:.4?} per cell");
    assert!(cells[1] > 1.2 * metres[1], "light scattered once is brighter: {cells:?}, not {metres:?}");
    assert!((cells[0] / metres[0] - 1.0).abs() < 0.01, "{cells:?}, not {metres:?}");
}

#[test]
fn white_mist_keeps_all_light_and_grey_mist_has_no_light_of_strands() {
    let mist = ["light.reflection=kajiya-kay", "materials.water.mist=0.25"];
    for (full, x) in [(true, 2.0), (false, 2.0), (false, 0.5), (false, 12.0)] {
        let (mut scene, mut volume) = slab(&mist, 40);
        if !full {
            volume.cells = vec![taki::volume::Cell::default(); volume.cells.len()].into();
        }
        let rho = if full { 0.65 } else { 0.35 };
        scene.edit().trace.attenuation = Attenuation::PathLength { sigma: x / rho };
        for mu_0 in [0.2, 0.6, 1.0] {
            let [back, through] = rendered(&mut scene, &volume, mu_0);
            let want = exact(x.into(), 1.0, 0.0, mu_0);
            println!(
                "mist tau {x} mu {mu_0}: {back:.3} + {through:.3} = {:.3}, exact {want:.3?}",
                back + through
            );
            assert!((back + through - 1.0).abs() < 0.02, "tau {x}, mu {mu_0}: {back} + {through}");
        }
        let furnace = furnace(&mut scene, &volume, 1024);
        assert!(furnace.iter().all(|radiance| (radiance - 1.0).abs() < 0.02), "tau {x}: {furnace:?}");
    }
    // Mist that absorbs nearly all light sends back about what it scatters once.
    let (mut scene, mut volume) = slab(&["light.reflection=kajiya-kay", "materials.water.mist=0.0025"], 40);
    let half = volume.cells.iter().next().expect("a cell").with_density(0.5, 0.5, 0.5);
    volume.cells = vec![half; volume.cells.len()].into();
    scene.edit().trace.attenuation = Attenuation::PathLength { sigma: 10.0 };
    scene.edit().lights = vec![Light::Directional { to_light: Vec3::Z, intensity: Vec3::ONE }];
    let multiple = seen(&Integrator::new(&scene, &volume), direction(0.9, 0.4))[0];
    scene.edit().scattering = taki::light::Scattering::Single;
    let single = seen(&Integrator::new(&scene, &volume), direction(0.9, 0.4))[0];
    assert!(multiple > single && multiple < 1.05 * single, "{multiple}, once {single}");
}
