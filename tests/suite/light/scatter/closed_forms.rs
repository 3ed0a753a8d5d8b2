//! The slab's solution and the path tracer against published values and conservation laws.

use std::f64::consts::PI;

use super::tracer::{Medium, Phase};
use super::{ISOTROPIC, toward};
use glam::{DVec3, Vec3};
use rand::{RngExt, SeedableRng};
use taki::light::scatter::slab::{Slab, exponential_integrals};
use taki::light::scatter::{Layers, Profile, Row, Scattering};

/// Chandrasekhar's H for isotropic scattering, by iteration of 1/H(μ) = √(1−ω) + (ω/2) ∫ μ' H(μ') / (μ + μ')
/// dμ' ("Radiative Transfer", 1950, V §38) with 1000 midpoints.
pub fn h_function(omega: f64, mu: f64) -> f64 {
    let n = 1000;
    let node = |i: usize| (i as f64 + 0.5) / n as f64;
    let mut h = vec![1.0; n];
    let next = |h: &[f64], mu: f64| {
        let sum: f64 = h.iter().enumerate().map(|(i, h)| node(i) * h / (mu + node(i))).sum();
        1.0 / ((1.0 - omega).sqrt() + 0.5 * omega * sum / n as f64)
    };
    for _ in 0..200 {
        h = (0..n).map(|i| 0.5 * (h[i] + next(&h, node(i)))).collect();
    }
    next(&h, mu)
}

/// Fluxes of J (in units of E/4π) out of both faces, relative to the beam's flux π·E·μ₀/π. The second
/// includes the light that the beam itself carries through.
fn reflected_and_transmitted(slab: &Slab, omega: f64, j: &[f64], mu_0: f64) -> [f64; 2] {
    let x = slab.boundaries[j.len()];
    let e3 = |t: f64| exponential_integrals(t)[2];
    let mut out = [0.0, (-x / mu_0).exp()];
    for (layer, j) in slab.boundaries.windows(2).zip(j) {
        // Flux = 2π ω ∫ J E₂, with J = j·E/4π.
        out[0] += 0.5 * omega * j * (e3(layer[0]) - e3(layer[1])) / mu_0;
        out[1] += 0.5 * omega * j * (e3(x - layer[1]) - e3(x - layer[0])) / mu_0;
    }
    out
}

#[test]
fn exponential_integrals_are_those_of_abramowitz_and_stegun() {
    // Tables 5.1 and 5.4.
    for (x, n, want) in [
        (0.1, 1, 1.822_923_958),
        (0.5, 1, 0.559_773_595),
        (1.0, 1, 0.219_383_934),
        (2.0, 1, 0.048_900_511),
        (10.0, 1, 4.156_968_93e-6),
        (0.5, 2, 0.326_643_9),
        (1.0, 2, 0.148_495_5),
        (0.5, 3, 0.221_604_4),
        (1.0, 3, 0.109_692_0),
    ] {
        let got = exponential_integrals(x)[n - 1];
        assert!((got - want).abs() < 1e-7f64.min(1e-6 * want.max(0.06)), "E{n}({x}) = {got}");
    }
    assert_eq!(exponential_integrals(0.0)[1..], [1.0, 0.5]);
    // Both forms agree at 1.
    let [below, above] = [1.0 - 1e-12, 1.0 + 1e-12].map(exponential_integrals);
    assert!(below.iter().zip(above).all(|(a, b)| (a - b).abs() < 1e-11));
}

#[test]
fn a_slab_that_absorbs_nothing_sends_all_light_back() {
    let mu_0 = [0.02, 0.3, 1.0];
    for x in [0.01, 0.5, 3.0, 20.0, 64.0, 1000.0] {
        let slab = Slab::new(x);
        for (j, mu_0) in slab.mean_intensity(1.0, &mu_0).iter().zip(mu_0) {
            let sum: f64 = reflected_and_transmitted(&slab, 1.0, j, mu_0).iter().sum();
            assert!((sum - 1.0).abs() < 1e-8, "X = {x}, μ₀ = {mu_0}: {sum}");
        }
        // With an albedo below 1, some light is lost.
        let j = slab.mean_intensity(0.9, &mu_0);
        let sum: f64 = reflected_and_transmitted(&slab, 0.9, &j[2], 1.0).iter().sum();
        assert!(sum < 1.0 - 0.05 * x.min(1.0), "{sum}");
    }
}

#[test]
fn diffuse_light_passes_a_slab_as_heaslet_and_warming_found() {
    // Int. J. Heat Mass Transfer 8, 979 (1965): flux between two walls through a grey medium in equilibrium,
    // which equals a slab of albedo 1 under diffuse light.
    let table = [
        (0.1, 0.9157),
        (0.2, 0.8491),
        (0.5, 0.7040),
        (1.0, 0.5532),
        (2.0, 0.3900),
        (3.0, 0.3016),
        (5.0, 0.2077),
    ];
    let n = 200;
    let mu_0: Vec<f64> = (0..n).map(|i| (i as f64 + 0.5) / n as f64).collect();
    for (x, want) in table {
        let slab = Slab::new(x);
        let solved = slab.mean_intensity(1.0, &mu_0);
        let through =
            |(j, mu): (&Vec<f64>, &f64)| 2.0 * mu * reflected_and_transmitted(&slab, 1.0, j, *mu)[1];
        let got = solved.iter().zip(&mu_0).map(through).sum::<f64>() / n as f64;
        // Constant layers of ¼ let h²/4 = 1.6 % too much flux through. The table has four digits.
        assert!(got - want < 0.016 * want && got - want > -1e-4, "X = {x}: {got}, not {want}");
    }
}

#[test]
fn the_lit_face_of_a_deep_slab_is_chandrasekhars_h() {
    // Table XI: H(1) = 2.9078 at albedo 1. There light returns from any depth, but the slab is only 64 deep.
    assert!((h_function(1.0, 1.0) - 2.9078).abs() < 0.005);
    for (omega, allowed) in [(0.3, 0.003), (0.9, 0.003), (1.0, 0.03)] {
        let slab = Slab::new(64.0);
        for mu_0 in [0.1, 0.5, 1.0] {
            let j = &slab.mean_intensity(omega, &[mu_0])[0];
            // J(0) = E/4π · H(μ₀), of which the beam's own part is 1.
            let diffuse: f64 = slab.weights(0.0).iter().zip(j).map(|(w, j)| omega * w * j).sum();
            let want = h_function(omega, mu_0) - 1.0;
            assert!(
                (diffuse - want).abs() < allowed * (1.0 + want),
                "ω {omega}, μ₀ {mu_0}: {diffuse}, not {want}"
            );
        }
    }
}

#[test]
fn a_profile_knows_the_lit_face_the_cosine_and_the_albedo() {
    let depths = vec![0.5, 0.0, 1.5, 0.2, 0.8];
    let layers = Layers::new(depths.clone());
    let of = |albedo: Vec3, g: f32, l_n: f32, z: u32| {
        let profile = Profile::new(&layers, &Scattering { albedo, g });
        profile.at(&Row::new(l_n, 5), z)
    };
    let [front, back] = [1.0, -1.0].map(|l_n| [0, 4].map(|z| of(Vec3::ONE, 0.0, l_n, z).x));
    assert!(
        front[0] > 1.5 * front[1] && back[1] > 1.5 * back[0],
        "the lit side is brighter: {front:?} {back:?}"
    );
    // Turning the slab over equals lighting it from behind. Within a thick layer, P is what the eye sees.
    let slices = |depths: &[f64]| depths.iter().flat_map(|depth| [depth / 40.0; 40]).collect::<Vec<f64>>();
    let white = Scattering { albedo: Vec3::ONE, g: 0.0 };
    let sliced = Profile::new(&Layers::new(slices(&depths)), &white);
    let turned: Vec<f64> = depths.iter().rev().copied().collect();
    let over = Profile::new(&Layers::new(slices(&turned)), &white);
    for z in 0..200 {
        let mirrored = over.at(&Row::new(-0.4, 200), 199 - z) - sliced.at(&Row::new(0.4, 200), z);
        assert!(mirrored.abs().max_element() < 1e-5, "{z}: {mirrored}");
    }
    // Grazing light hardly enters. At the rows nothing is interpolated; between them the values join.
    assert!(of(Vec3::ONE, 0.0, 0.0, 0).x < 0.01);
    assert!(of(Vec3::ONE, 0.0, 0.05, 2).x < 0.2 * of(Vec3::ONE, 0.0, 0.8, 2).x);
    // The light was scattered at least twice, so it falls faster than the albedo. Colours do not mix.
    let coloured = of(Vec3::new(1.0, 0.5, 0.0), 0.0, 1.0, 2);
    assert_eq!(coloured.x, of(Vec3::ONE, 0.0, 1.0, 2).x);
    assert_eq!(coloured.y, of(Vec3::splat(0.5), 0.0, 1.0, 2).x);
    assert!(coloured.y < 0.25 * coloured.x && coloured.z == 0.0);
    // Similarity: without absorption, a slab of mean cosine g equals an isotropic slab of 1 − g times its
    // depth.
    let thin: Vec<f64> = depths.iter().map(|depth| 0.25 * depth).collect();
    let thin = Profile::new(&Layers::new(thin), &Scattering { albedo: Vec3::ONE, g: 0.0 });
    let mut differs = false;
    for z in 0..5 {
        let forward = of(Vec3::ONE, 0.75, 0.6, z);
        assert!((forward - thin.at(&Row::new(0.6, 5), z)).abs().max_element() < 1e-6);
        differs |= (forward.x / of(Vec3::ONE, 0.0, 0.6, z).x - 1.0).abs() > 0.05;
    }
    assert!(differs);
    // Extremes have numbers, too.
    for depth in [1e-12, 1e-4, 1.0, 1e3, 1e6] {
        for g in [-0.99, 0.0, 0.99] {
            for albedo in [1e-6, 1.0] {
                let scattering = Scattering { albedo: Vec3::splat(albedo), g };
                let profile = Profile::new(&Layers::new(vec![depth; 4]), &scattering);
                let sound = profile.values.iter().flatten().all(|v| v.is_finite() && *v >= 0.0);
                assert!(sound, "{depth} {g} {albedo}: {:?}", profile.values);
            }
        }
    }
    let empty = Profile::new(&Layers::new(vec![0.0; 3]), &Scattering { albedo: Vec3::ONE, g: 0.0 });
    assert!(empty.values.iter().all(|v| *v == [0.0; 4]));
}

#[test]
fn kajiya_and_kays_albedo_is_pi_k_d_and_below_one() {
    // ⟨sin⟩ over the sphere is π/4. Ψ/π over all eyes is 4 times that.
    let diffuse = Scattering::kajiya_kay(0.25, 0.0, 12.0, 0.99);
    assert!((diffuse.albedo.x as f64 - 0.25 * PI).abs() < 1e-3 && diffuse.g.abs() < 1e-3);
    let both = Scattering::kajiya_kay(0.1, 0.2, 12.0, 0.99);
    let plain = Scattering::kajiya_kay(0.1, 0.0, 12.0, 0.99);
    assert!(both.albedo.x > plain.albedo.x && both.albedo.x < 1.0);
    // A part (t·l)² of the light continues along the cone: on average a third of the specular part.
    assert!(both.g > 0.05 && both.g < 0.34, "{}", both.g);
    assert_eq!(Scattering::kajiya_kay(0.5, 0.5, 12.0, 0.99).albedo, Vec3::splat(0.99));
}

#[test]
fn the_path_tracers_single_scattering_is_the_closed_form() {
    let (sigma, x) = (1.5, 3.0);
    let medium = Medium::uniform(4, 0.5, sigma);
    for (e, l) in
        [(toward(0.0, 0.0, -1.0), toward(40.0, 1.0, -1.0)), (toward(50.0, 2.0, -1.0), toward(30.0, 0.4, 1.0))]
    {
        let (mu, mu_0) = (e.z.abs(), l.z.abs());
        let share = match l.z < 0.0 {
            true => mu_0 / (mu + mu_0) * (1.0 - (-x / mu - x / mu_0).exp()),
            false => mu_0 / (mu_0 - mu) * ((-x / mu_0).exp() - (-x / mu).exp()),
        };
        for g in [0.0, 0.7] {
            let phi = super::tracer::henyey_greenstein(g, -l.dot(e));
            let pixels = medium.render([e, l], 0.9, Phase::HenyeyGreenstein(g), 4, 20_000);
            let got = pixels.iter().map(|p| p.single).sum::<f64>() / 16.0;
            // With 320,000 paths whose spread is at most their mean, one sigma is 0.18 %.
            let want = 0.9 * PI * phi * share;
            assert!((got / want - 1.0).abs() < 0.007, "g {g}: {got}, not {want}");
        }
    }
}

#[test]
fn the_path_tracer_sees_h_times_h_over_a_deep_slab() {
    // L = I·(ω/4)·μ₀/(μ + μ₀)·H(μ)·H(μ₀).
    let medium = Medium::uniform(4, 10.0, 1.0);
    for omega in [0.5, 0.9] {
        let (e, l) = (toward(50.0, 0.3, -1.0), toward(20.0, 1.0, -1.0));
        let (mu, mu_0) = (-e.z, -l.z);
        let want = 0.25 * omega * mu_0 / (mu + mu_0) * h_function(omega, mu) * h_function(omega, mu_0);
        let pixels = medium.render([e, l], omega, ISOTROPIC, 4, 8000);
        let got = pixels.iter().map(|p| p.single + p.multiple).sum::<f64>() / 16.0;
        let sigma = pixels.iter().map(|p| p.variance).sum::<f64>().sqrt() / 16.0;
        assert!((got - want).abs() < 4.0 * sigma + 0.004 * want, "ω {omega}: {got} ± {sigma}, not {want}");
    }
}

#[test]
fn the_path_tracer_loses_no_light() {
    // R + T + beam = 1. The radiance covers both hemispheres, directions are weighted by their cosine, and
    // the light stands at 50°.
    let mut medium = Medium::uniform(6, 0.5, 1.0);
    // Neither clumps nor the phase function may matter.
    for (i, sigma) in medium.sigma.iter_mut().enumerate() {
        *sigma *= [0.2, 3.0, 0.0, 0.8][(i * 7 / 3) % 4];
    }
    let l = toward(50.0, 0.7, -1.0);
    fn rayleigh(_: Vec3, l: DVec3, e: DVec3) -> f64 {
        3.0 / (16.0 * PI) * (1.0 + l.dot(e).powi(2))
    }
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
    let beam = (0..20_000).map(|_| {
        let p = DVec3::new(4.0 * rng.random::<f64>(), 4.0 * rng.random::<f64>(), 6.0);
        (-medium.depth(p, l)).exp()
    });
    let beam = beam.sum::<f64>() / 20_000.0;
    for phase in [ISOTROPIC, Phase::HenyeyGreenstein(0.6), Phase::Given(rayleigh)] {
        let directions = 600;
        let mut sum = 0.0;
        for i in 0..directions {
            // Even steps of cos² weight the directions by their cosine.
            let cos = ((i as f64 + 0.5) / directions as f64).sqrt();
            let turn = i as f64 * 2.399_963;
            let sin = (1.0 - cos * cos).sqrt();
            for side in [-1.0, 1.0] {
                let e = DVec3::new(sin * turn.cos(), sin * turn.sin(), side * cos);
                let pixels = medium.render([e, l], 1.0, phase, 2, 40);
                sum += pixels.iter().map(|p| p.single + p.multiple).sum::<f64>() / 4.0;
            }
        }
        // ∫ L cosθ dω = π·mean(L). The light brings E·μ₀ = π·I·μ₀.
        let whole = sum / directions as f64 / l.z.abs() + beam;
        // With 192,000 paths and a spread of about 2 (their values reach a few I), one sigma is 0.5 %.
        assert!((whole - 1.0).abs() < 0.02, "{whole}");
    }
}
