//! Optics of shells: Fresnel's limits, the surface's lobe, normals of cells, and light that scatters many
//! times beside the formula of slabs.

use glam::{DMat3, Mat3, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use taki::light::scatter::optics::{Arriving, CellNormal, Passage, ShellOptics, Surface};
use taki::light::scatter::{Scattering, forward_peak, multiple};
use taki::volume::Moments;

const SKIN: Surface = Surface { eta: 1.4, roughness: 0.3 };

/// Fresnel's reflectance in float64, between media of these indices, by the angles.
fn fresnel(from: f64, to: f64, mu: f64) -> f64 {
    let angle = mu.acos();
    let inside = (from * angle.sin() / to).asin();
    let across = (angle - inside).sin() / (angle + inside).sin();
    let along = (angle - inside).tan() / (angle + inside).tan();
    0.5 * (across * across + along * along)
}

#[test]
fn the_surface_reflects_after_fresnel_from_both_sides() {
    let straight = (0.4 / 2.4f32).powi(2);
    assert!((SKIN.fresnel(1.0) - straight).abs() < 1e-6);
    assert!((SKIN.fresnel(0.0) - 1.0).abs() < 1e-5);
    for i in 1..40 {
        let mu = f64::from(i) / 40.0;
        let own = f64::from(SKIN.fresnel(mu as f32));
        assert!((own - fresnel(1.0, 1.4, mu)).abs() < 1e-5, "{mu}: {own}");
        // Light that leaves at the refracted angle is reflected as much.
        let inside = f64::from(SKIN.refracted(mu as f32));
        assert!((own - fresnel(1.4, 1.0, inside)).abs() < 1e-4, "{mu}: {own}");
        // Snell's law.
        let sines = [mu, inside].map(|mu| (1.0 - mu * mu).sqrt());
        assert!((sines[0] - 1.4 * sines[1]).abs() < 1e-6);
    }
}

#[test]
fn without_a_step_of_the_index_there_is_no_surface() {
    let none = Surface { eta: 1.0, roughness: 0.3 };
    for i in 1..=20 {
        let mu = i as f32 / 20.0;
        for value in [none.stretch(mu), none.leaving(mu)[0], none.leaving(mu)[1], none.entering(mu)[0]] {
            assert!((value - 1.0).abs() < 1e-4, "{mu}: {value}");
        }
        let l = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
        assert!(none.lobe(Vec3::Z, l, Vec3::new(0.6, 0.0, 0.8), 0.09) < 1e-6);
    }
}

/// Unit vector with the cosine `mu` to z.
fn direction(mu: f32, turn: f32) -> Vec3 {
    let sin = (1.0 - mu * mu).sqrt();
    Vec3::new(sin * turn.cos(), sin * turn.sin(), mu)
}

#[test]
fn a_mirror_in_a_white_furnace_loses_only_what_bounces_twice() {
    // Facets lose what they hide from light and eye. The truth is summed over facets in place of lights, with
    // Smith's shadowing of both directions as Heitz writes it (2014, equations 72 and 99).
    let truth = |alpha: f64, mu: f64| {
        const N: usize = 1500;
        let lambda = |cos: f64| {
            let tan2 = (1.0 - cos * cos) / (cos * cos);
            0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
        };
        let mut sum = 0.0;
        for i in 0..N {
            // The share of the projected area with smaller slopes.
            let share = (i as f64 + 0.5) / N as f64;
            let cos_h = (1.0 + alpha * alpha * share / (1.0 - share)).sqrt().recip();
            let sin_h = (1.0 - cos_h * cos_h).sqrt();
            for j in 0..N {
                let turn = (j as f64 + 0.5) / N as f64 * std::f64::consts::PI;
                let e_h = sin_h * turn.cos() * (1.0 - mu * mu).sqrt() + cos_h * mu;
                let l_z = 2.0 * e_h * cos_h - mu;
                if e_h > 0.0 && l_z > 0.0 {
                    sum += e_h / (cos_h * mu) / (1.0 + lambda(l_z) + lambda(mu));
                }
            }
        }
        sum / (N * N) as f64
    };
    for alpha in [0.1f32, 0.3, 0.5] {
        let mirror = Surface { eta: 1e5, roughness: alpha };
        for mu in [1.0f32, 0.7, 0.4] {
            const N: usize = 1500;
            let mut sum = 0.0;
            for i in 0..N {
                let cos = (i as f32 + 0.5) / N as f32;
                for j in 0..N {
                    let turn = (j as f32 + 0.5) / N as f32 * std::f32::consts::PI;
                    let l = direction(cos, turn);
                    sum += f64::from(mirror.lobe(Vec3::Z, l, direction(mu, 0.0), alpha * alpha));
                }
            }
            // f·(m·l) over the hemisphere; the lobe is π times that.
            let albedo = sum / (N * N) as f64 * 2.0;
            let want = truth(alpha.into(), mu.into());
            assert!((albedo - want).abs() < 2e-3 && want < 1.0, "{alpha} {mu}: {albedo}, not {want}");
        }
    }
}

#[test]
fn the_lobe_is_reciprocal() {
    let rng = &mut Pcg64Mcg::seed_from_u64(1);
    for _ in 0..200 {
        let mut of = || direction(rng.random_range(0.05..1.0), rng.random_range(0.0..6.2));
        let (l, e) = (of(), of());
        let [there, back] = [(l, e), (e, l)].map(|(l, e)| SKIN.lobe(Vec3::Z, l, e, 0.09) / Vec3::Z.dot(l));
        assert!((there - back).abs() <= 1e-4 * there, "{l} {e}: {there} {back}");
    }
}

#[test]
fn normals_are_covectors_and_point_outwards() {
    let rng = &mut Pcg64Mcg::seed_from_u64(2);
    for _ in 0..200 {
        let mut x = || rng.random_range(-1.0f32..1.0);
        let j = Mat3::from_cols(
            Vec3::new(1.0 + 0.3 * x(), 0.4 * x(), 0.3 * x()),
            Vec3::new(0.4 * x(), -1.2, 0.3 * x()),
            Vec3::new(0.3 * x(), 0.2 * x(), 0.7),
        );
        let v = Vec3::new(x(), x(), 0.3 + x().abs());
        // Directions have no sign.
        let own = CellNormal::new(&Moments::of(if x() < 0.0 { v } else { -v }), &j);
        let inverse: DMat3 = j.as_dmat3().inverse().transpose();
        let truth = -(inverse * v.as_dvec3()).normalize();
        assert!(truth.dot(j.z_axis.as_dvec3()) < 0.0, "z grows inwards");
        assert!(own.m.as_dvec3().distance(truth) < 1e-5, "{v}: {} {truth}", own.m);
        assert!(own.variance < 1e-4 * v.length_squared() / (v.z * v.z), "{v}: {}", own.variance);
    }
}

#[test]
fn a_cell_of_two_normals_is_as_rough_as_their_slopes_differ() {
    // Slopes ±0.2 along x in cells that are twice as deep as wide.
    let j = Mat3::from_diagonal(Vec3::new(0.5, 0.5, 1.0));
    let [a, b] = [0.2, -0.2].map(|x| Moments::of(Vec3::new(x, 0.0, 1.0)));
    let both = Moments { diagonal: a.diagonal + b.diagonal, mixed: a.mixed + b.mixed };
    let own = CellNormal::new(&both, &j);
    assert!(own.m.distance(Vec3::NEG_Z) < 1e-6);
    assert!((own.variance - 0.4f32.powi(2)).abs() < 1e-5, "{}", own.variance);
    // Walls have a normal and a finite spread, too.
    let wall = CellNormal::new(&Moments::of(Vec3::X), &j);
    assert!(wall.m.is_finite() && wall.variance.is_finite());
}

#[test]
fn shares_of_cells_add_up_to_what_the_reduced_medium_hides() {
    let a = Vec3::new(0.25, 1.0, 3.0);
    let bits = [0.1, 0.7, 0.0, 2.0, 0.3];
    let (mut view, mut sum) = (0.0, Vec3::ZERO);
    for cell in bits {
        sum += Passage { start: 0.8, view, cell }.weight(a);
        view += cell;
    }
    let truth = Vec3::splat(0.8) - (a * -view).map(f32::exp2) * 0.8;
    assert!((sum - truth).abs().max_element() < 1e-5, "{sum} {truth}");
}

#[test]
fn a_cell_of_a_shell_is_one_of_a_slab_with_the_same_diffuse_light() {
    let rng = &mut Pcg64Mcg::seed_from_u64(3);
    for (albedo, g) in [(0.9, 0.0), (0.8, 0.5), (0.95, 0.8)] {
        let scattering = Scattering { albedo: Vec3::splat(albedo), g };
        let similarity = scattering.similarity();
        let own = ShellOptics::of_fibres(&similarity).of_cell(Vec3::ONE);
        assert!((own.whole - similarity.albedo).abs().max_element() < 1e-5);
        let mut compared = 0;
        for _ in 0..200 {
            let mut bits = |most: f32| rng.random_range(0.0..most);
            let (view, cell, light) = (bits(4.0), bits(1.0), bits(4.0));
            let peak = forward_peak(g, bits(2.0) - 1.0);
            let j = Vec3::new(0.1, 0.2, 0.3);
            let passage = Passage { start: 1.0, view, cell };
            let weight = passage.weight(own.extinction);
            let arriving = Arriving { through: (-light).exp2(), open: 1.0 };
            let once = (-view).exp2() * (1.0 - (-cell).exp2()) * arriving.visible();
            let more = own.more(weight, once, &peak, &arriving);
            let seen = weight * (own.albedo * j) + more;
            // Each of them leaves out what would be negative.
            if more.min_element() > 0.0 {
                let slab = multiple(&similarity, &peak, own.albedo * j, view, cell, light);
                assert!((seen - slab).abs().max_element() < 1e-5, "{g}: {seen} {slab}");
                compared += 1;
            }
            if g == 0.0 {
                assert!(more.max_element() < 1e-6, "isotropic light that scattered once is in Ψ: {more}");
            }
        }
        assert!(g == 0.0 || compared > 50, "{g}: {compared}");
    }
}
