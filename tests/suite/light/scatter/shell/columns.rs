//! Columns: flat even shells are slabs.

use super::super::closed_forms::h_function;
use super::super::flux::exact;
use super::*;

#[test]
fn a_flat_shell_sends_back_and_through_what_the_exact_slab_does() {
    let mut worst = [0.0f64; 2];
    for x in [0.05, 0.3, 1.0, 4.0, 16.0] {
        for omega in [0.5, 0.8, 0.95, 1.0] {
            for mu in [0.1, 0.3, 0.7, 1.0] {
                let light = [light(mu)];
                let lit = Surroundings { lights: &light, ..Default::default() };
                for layers in [4, 16] {
                    let values = in_slab(x, omega, layers, Below::Open, &lit);
                    let [back, through] = fluxes(&values, x, omega, mu);
                    let want = exact(x, omega, 0.0, mu);
                    let through = through + (-x / mu).exp();
                    let errors = [back - want[0], through - want[1]];
                    println!(
                        "x {x} ω {omega} μ {mu} layers {layers}: {back:.4} {through:.4} want {want:.4?} errors {errors:.4?} rel {:.3}",
                        back / want[0] - 1.0
                    );
                    worst = [0, 1].map(|k| worst[k].max(errors[k].abs()));
                }
            }
        }
    }
    println!("worst {worst:.4?}");
}

#[test]
fn a_half_space_reflects_as_chandrasekhar_found() {
    for omega in [0.5, 0.8, 0.9, 0.95, 0.99, 1.0] {
        for mu in [0.1, 0.5, 1.0] {
            let light = [light(mu)];
            let lit = Surroundings { lights: &light, ..Default::default() };
            for x in [4.0, 20.0] {
                let values = in_slab(x, omega, 8, Below::Core, &lit);
                let [back, _] = fluxes(&values, x, omega, mu);
                let want = 1.0 - (1.0 - omega).sqrt() * h_function(omega, mu);
                println!("ω {omega} μ {mu} x {x}: {back:.4} want {want:.4} rel {:.4}", back / want - 1.0);
            }
        }
    }
}

#[test]
fn a_half_space_behind_a_surface_reflects_as_giovanelli_found() {
    // Giovanelli 1955: n = 1.5, albedo 0.9, isotropic scattering, normal incidence: 0.2600 with the 0.04 that
    // the surface reflects.
    for x in [4.0, 10.0, 20.0] {
        for layers in [8, 16, 32] {
            let light = [light(1.0)];
            let lit = Surroundings { lights: &light, ..Default::default() };
            let shell = flat([2, 2], 1.0, |_| x as f32);
            let matter = ShellMatter { eta: 1.5, ..even(2 * layers, 0.9, Below::Core) };
            let values = column(&solve(&shell, layers, &matter, &lit), 4);
            let mut sum = 0.0;
            for i in 0..4000 {
                let tau = (i as f64 + 0.5) / 4000.0 * x;
                let j = between(&values, tau / x) + 0.25 * 0.96 * (-tau).exp();
                for k in 0..200 {
                    let mu = (k as f64 + 0.5) / 200.0;
                    sum +=
                        2.0 * 0.9 * j * (-tau / mu).exp() * (1.0 - reflectance(1.5, mu)) / 200.0 * x / 4000.0;
                }
            }
            println!("x {x} layers {layers}: {:.4} want 0.2600", sum + 0.04);
        }
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
            let values = in_slab(x, 1.0, 8, Below::Open, &lit);
            let sum = fluxes(&values, x, 1.0, mu).iter().sum::<f64>() + (-x / mu.abs()).exp();
            print!("x {x} μ {mu}: open {sum:.4}");
            if mu > 0.0 {
                let values = in_slab(x, 1.0, 8, Below::Opaque { albedo: Vec3::ONE }, &lit);
                let [back, through] = fluxes(&values, x, 1.0, mu);
                // What arrives below leaves from there as from any white surface.
                let below = (through + (-x / mu).exp()) * 2.0 * exponential_integrals(x)[2];
                print!(" white {:.4}", back + below);
                if x >= 8.0 {
                    let values = in_slab(x, 1.0, 8, Below::Core, &lit);
                    let sum = fluxes(&values, x, 1.0, mu)[0];
                    print!(" core {sum:.4}");
                }
            }
            println!();
        }
    }
}

#[test]
fn in_even_light_white_matter_has_its_radiance() {
    let ambient = Surroundings { ambient: Vec3::new(1.0, 0.5, 2.0), ..Default::default() };
    for below in [Below::Open, Below::Opaque { albedo: Vec3::ONE }, Below::Core] {
        for eta in [1.0, 1.4] {
            if eta > 1.0 && below == Below::Open {
                continue;
            }
            for x in [0.01, 1.0, 10.0] {
                let shell = flat([4, 4], 1.0, |v| x * v as f32 / 24.0);
                let solved = solve(&shell, 6, &ShellMatter { eta, ..even(11, 1.0, below) }, &ambient);
                let want = ambient.ambient * (eta * eta);
                let worst = solved
                    .values
                    .iter()
                    .map(|j| ((*j - want) / want).abs().max_element())
                    .fold(0.0, f32::max);
                println!("{below:?} η {eta} x {x}: {worst} steps {}", solved.steps);
            }
        }
    }
}
