//! Columns: flat even shells are slabs.

use super::super::closed_forms::h_function;
use super::super::flux::exact_for;
use super::*;

#[test]
fn a_flat_shell_sends_back_and_through_what_the_exact_slab_does() {
    // The flux of even steps of μ² near μ = 0 needs many of them.
    let eyes: Vec<f64> = (0..200).map(|i| ((f64::from(i) + 0.5) / 200.0).sqrt()).collect();
    for x in [0.05, 1.0, 4.0, 16.0] {
        for omega in [0.5, 0.8, 0.95, 1.0] {
            for mu in [0.1, 0.3, 1.0] {
                let want = exact_for(x, omega, 0.0, mu, &eyes);
                let light = [light(mu)];
                let lit = Surroundings { lights: &light, ..Default::default() };
                for layers in [4, 16] {
                    let [back, through] = fluxes(&in_slab(x, omega, layers, Below::Open, &lit), x, omega, mu);
                    let errors = [back / want[0] - 1.0, through + (-x / mu).exp() - want[1]];
                    // A grazing beam ends within the first of few layers.
                    let allowed = if x / layers as f64 > 3.0 * mu { 0.05 } else { 0.01 };
                    assert!(
                        errors[0].abs() < allowed && errors[1].abs() < 0.005,
                        "x {x}, ω {omega}, μ {mu}, {layers} layers: {errors:.4?}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_half_space_reflects_as_chandrasekhar_found() {
    for omega in [0.5, 0.8, 0.95, 1.0] {
        for mu in [0.3, 1.0] {
            let want = 1.0 - f64::sqrt(1.0 - omega) * h_function(omega, mu);
            let light = [light(mu)];
            let lit = Surroundings { lights: &light, ..Default::default() };
            // What comes from below a shell that is 8 deep passes it hardly ever.
            for x in [8.0, 20.0] {
                let [back, _] = fluxes(&in_slab(x, omega, 8, Below::Core, &lit), x, omega, mu);
                assert!((back / want - 1.0).abs() < 0.01, "ω {omega}, μ {mu}: {back}, not {want}");
                // Another albedo is another half-space.
                let [other, _] = fluxes(&in_slab(x, omega - 0.1, 8, Below::Core, &lit), x, omega - 0.1, mu);
                assert!((other / want - 1.0).abs() > 0.03);
            }
        }
    }
}

#[test]
fn a_half_space_behind_a_surface_reflects_as_giovanelli_found() {
    // Giovanelli 1955, as cited by Wang, Jacques and Zheng 1995: n = 1.5, albedo 0.9, isotropic scattering,
    // normal incidence: 0.2600 with the 0.04 that the surface reflects.
    let light = [light(1.0)];
    let lit = Surroundings { lights: &light, ..Default::default() };
    for (x, layers) in [(4.0, 8), (10.0, 16), (20.0, 32)] {
        let shell = flat([2, 2], 1.0, |_| x as f32);
        let matter = ShellMatter { eta: 1.5, ..even(2 * layers, 0.9, Below::Core) };
        let values = column(&solve(&shell, layers, &matter, &lit), 4);
        let mut sum = 0.04;
        const STEPS: usize = 2000;
        for i in 0..STEPS {
            let tau = (i as f64 + 0.5) / STEPS as f64 * x;
            let j = between(&values, tau / x) + 0.25 * 0.96 * (-tau).exp();
            for k in 0..200 {
                let mu = (k as f64 + 0.5) / 200.0;
                let leaves = (-tau / mu).exp() * (1.0 - reflectance(1.5, mu)) / 200.0;
                sum += 2.0 * 0.9 * j * leaves * x / STEPS as f64;
            }
        }
        assert!((sum - 0.26).abs() < 0.001, "{sum}");
    }
}

/// Fresnel's reflectance from inside.
fn reflectance(eta: f64, mu: f64) -> f64 {
    let squared = 1.0 - (1.0 - mu * mu) * eta * eta;
    if squared <= 0.0 {
        return 1.0;
    }
    let out = squared.sqrt();
    let s = (eta * mu - out) / (eta * mu + out);
    let p = (mu - eta * out) / (mu + eta * out);
    0.5 * (s * s + p * p)
}

#[test]
fn matter_that_absorbs_nothing_loses_no_light() {
    for x in [0.05, 0.5, 2.0, 8.0, 32.0] {
        for mu in [0.1, 0.5, 1.0, -0.7] {
            let light = [light(mu)];
            let lit = Surroundings { lights: &light, ..Default::default() };
            let direct = (-x / mu.abs()).exp();
            let mut sums =
                vec![fluxes(&in_slab(x, 1.0, 8, Below::Open, &lit), x, 1.0, mu).iter().sum::<f64>() + direct];
            if mu > 0.0 {
                let white = Below::Opaque { albedo: Vec3::ONE };
                let [back, through] = fluxes(&in_slab(x, 1.0, 8, white, &lit), x, 1.0, mu);
                // What arrives below leaves from there as from any white surface.
                sums.push(back + (through + direct) * 2.0 * exponential_integrals(x)[2]);
            }
            if mu > 0.0 && x >= 8.0 {
                sums.push(fluxes(&in_slab(x, 1.0, 8, Below::Core, &lit), x, 1.0, mu)[0]);
            }
            assert!(sums.iter().all(|sum| (sum - 1.0).abs() < 0.01), "x {x}, μ {mu}: {sums:.4?}");
        }
    }
}

#[test]
fn in_even_light_white_matter_has_its_radiance() {
    let ambient = Surroundings { ambient: Vec3::new(1.0, 0.5, 2.0), ..Default::default() };
    let white = Below::Opaque { albedo: Vec3::ONE };
    for (below, eta) in
        [(Below::Open, 1.0), (white, 1.0), (white, 1.4), (Below::Core, 1.0), (Below::Core, 1.4)]
    {
        for x in [0.01, 1.0, 10.0] {
            // From no thickness to x.
            let shell = flat([4, 4], 1.0, |v| x * v as f32 / 24.0);
            let solved = solve(&shell, 6, &ShellMatter { eta, ..even(11, 1.0, below) }, &ambient);
            let want = ambient.ambient * (eta * eta);
            let is_even = |j: &Vec3| ((*j - want) / want).abs().max_element() < 1e-5;
            assert!(solved.values.iter().all(is_even), "{below:?}, η {eta}, x {x}: {:?}", solved.values);
        }
    }
    // Grey matter absorbs some.
    let shell = flat([4, 4], 1.0, |_| 1.0);
    let grey = solve(&shell, 6, &even(11, 0.9, Below::Open), &ambient);
    assert!(grey.values.iter().all(|j| (*j / ambient.ambient).max_element() < 0.97));
}

#[test]
fn empty_layers_have_no_more_light_than_there_is() {
    // Cloth: little or nothing in the outer layers, and much behind them.
    let shell = flat([1, 1], 1.0, |_| 1.0);
    for (outer, depth, omega) in [(0.0, 40.0, 0.9), (1e-3, 8.0, 0.3), (0.05, 2.5, 0.6), (1e-4, 200.0, 1.0)] {
        let extinction = [outer, outer, 0.3, 1.0, 1.0, 0.3, outer, outer].map(|rho| Vec3::splat(rho * depth));
        for below in [Below::Open, Below::Opaque { albedo: Vec3::splat(0.1) }] {
            let albedo = vec![Vec3::splat(omega); 8];
            let matter = ShellMatter { extinction: extinction.to_vec(), albedo, eta: 1.0, below };
            let even = Surroundings { ambient: Vec3::ONE, ..Surroundings::default() };
            let solved = solve(&shell, 4, &matter, &even);
            let most = solved.values.iter().map(|j| j.max_element()).fold(0.0, f32::max);
            // J at the outer surface is a little more than in the first sublayer.
            assert!((0.4..1.05).contains(&most), "{outer} {depth} {omega} {below:?}: {most}");
            let lights = [light(0.6)];
            let lit = solve(&shell, 4, &matter, &Surroundings { lights: &lights, ..Surroundings::default() });
            let most = lit.values.iter().map(|j| j.max_element()).fold(0.0, f32::max);
            // A beam's own mean intensity is ¼, and no matter makes more than a few times that of it.
            assert!(most < 0.8, "{outer} {depth} {omega} {below:?}: {most}");
        }
    }
}

#[test]
fn columns_of_any_length_are_those_of_an_even_shell() {
    // Columns so far from one another do not know of each other.
    let shell = flat([8, 8], 1e5, |v| 0.25 * v as f32);
    let light = [light(0.6)];
    let lit = Surroundings { lights: &light, ambient: Vec3::splat(0.2), ..Default::default() };
    let matter = ShellMatter {
        extinction: (0..12).map(|k| Vec3::splat(k as f32 / 6.0)).collect(),
        ..even(12, 0.9, Below::Open)
    };
    let solved = solve(&shell, 6, &matter, &lit);
    for vertex in [1, 7, 20, 55, 80] {
        let x = 0.25 * vertex as f32;
        let own = column(&solve(&flat([2, 2], 1e5, |_| x), 6, &matter, &lit), 4);
        let most = own.iter().fold(0.0, |most: f64, j| most.max(*j));
        for (got, want) in column(&solved, vertex).into_iter().zip(own) {
            assert!((got - want).abs() < 0.01 * most, "x {x}: {got}, not {want}");
        }
    }
}

#[test]
fn many_layers_are_solved_in_fewer_and_have_the_same_light() {
    let light = [light(0.8)];
    let lit = Surroundings { lights: &light, ..Default::default() };
    let shell = flat([2, 2], 5.0, |_| 5.0);
    // Extinction that grows from layer to layer.
    let matter = |cells: usize| ShellMatter {
        extinction: (0..cells).map(|k| Vec3::splat(2.0 * (k as f32 + 0.5) / cells as f32)).collect(),
        ..even(cells, 0.95, Below::Opaque { albedo: Vec3::splat(0.3) })
    };
    let few = column(&solve(&shell, 32, &matter(64), &lit), 4);
    let many = column(&solve(&shell, 150, &matter(300), &lit), 4);
    assert_eq!(many.len(), 151);
    for (i, got) in many.into_iter().enumerate() {
        let want = between(&few, i as f64 / 150.0);
        assert!((got / want - 1.0).abs() < 0.02, "{i}: {got}, not {want}");
    }
}
