//! Light that scatters many times in a flat shell of hairs, against walks from hair to hair.

use std::f64::consts::{LOG2_E, TAU};

use super::*;
use glam::DVec3;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use taki::light::scatter::optics::ShellOptics;
use taki::light::scatter::{Scattering, forward_peak, multiple};
use taki::light::strand::hair::{Hair, Pigment};
use taki::light::strand::table::StrandShading;

/// Numbers of walks, and of the steps of a hair's albedo over the sine of the light's inclination.
const WALKS: u32 = 16_000;
const SINES: usize = 41;

/// A unit vector, uniform.
fn uniform(rng: &mut impl Rng) -> DVec3 {
    let z = 2.0 * rng.random::<f64>() - 1.0;
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
}

/// Hairs, as walks meet them: green light.
struct Hairs {
    shading: StrandShading,
    /// Albedo by the sine of the light's inclination, from −1 to 1.
    albedo: Vec<f64>,
    /// Largest 4πΦ.
    most: f64,
    /// Direction of all hairs; `None` where they have every direction.
    along: Option<DVec3>,
}

impl Hairs {
    fn new(melanin: f32, along: Option<DVec3>) -> Hairs {
        let hair = Hair { pigment: Pigment::Melanin(melanin, 0.2), ..Hair::default() };
        let shading = StrandShading::new(&hair.strand());
        let mut hairs = Hairs { shading, albedo: Vec::new(), most: 0.0, along };
        const RINGS: usize = 1000;
        const TURNS: usize = 48;
        for i in 0..SINES {
            let sine = -1.0 + 2.0 * i as f64 / (SINES - 1) as f64;
            let l = DVec3::new((1.0 - sine * sine).sqrt(), sine, 0.0);
            let mut sum = 0.0;
            for ring in 0..RINGS {
                let y = -1.0 + 2.0 * (ring as f64 + 0.5) / RINGS as f64;
                for turn in 0..TURNS {
                    let (sin, cos) = ((turn as f64 + 0.5) / TURNS as f64 * PI).sin_cos();
                    let across = (1.0 - y * y).sqrt();
                    let value = hairs.phase(DVec3::Y, l, DVec3::new(across * cos, y, across * sin));
                    sum += value;
                    hairs.most = hairs.most.max(value);
                }
            }
            hairs.albedo.push((sum / (RINGS * TURNS) as f64).min(1.0));
        }
        hairs
    }

    /// 4πΦ: its mean over all directions is the albedo.
    fn phase(&self, t: DVec3, l: DVec3, e: DVec3) -> f64 {
        let [t_l, t_e, l_e] = [t.dot(l), t.dot(e), l.dot(e)].map(|x| x as f32);
        4.0 * f64::from(self.shading.psi(1.0, 1.0, t_l, t_e, l_e).y)
    }

    /// Shares of the light along `l` that leave a slab above and below: scattered once, and more often.
    fn walked(&self, depth: f64, l: DVec3) -> [[f64; 2]; 2] {
        let parts: Vec<[[f64; 2]; 2]> = (0..64u64)
            .into_par_iter()
            .map(|seed| {
                let mut rng = Pcg64Mcg::seed_from_u64(seed);
                let mut sums = [[0.0; 2]; 2];
                for _ in 0..WALKS / 64 {
                    let (mut at, mut way, mut weight, mut order) = (0.0, -l, 1.0, 0);
                    loop {
                        at -= way.z * -(1.0 - rng.random::<f64>()).ln();
                        if !(0.0..depth).contains(&at) {
                            if order > 0 {
                                sums[order.min(2) - 1][usize::from(at > 0.0)] += weight;
                            }
                            break;
                        }
                        order += 1;
                        let t = self.along.unwrap_or_else(|| uniform(&mut rng));
                        let place = (t.dot(-way) + 1.0) * 0.5 * (SINES - 1) as f64;
                        weight *= between(&self.albedo, place / (SINES - 1) as f64);
                        if weight < 0.02 {
                            if rng.random::<bool>() {
                                break;
                            }
                            weight *= 2.0;
                        }
                        way = loop {
                            let e = uniform(&mut rng);
                            if rng.random::<f64>() * self.most < self.phase(t, -way, e) {
                                break e;
                            }
                        };
                    }
                }
                sums
            })
            .collect();
        let walks = f64::from(WALKS / 64 * 64);
        [0, 1].map(|order| [0, 1].map(|side| parts.iter().map(|p| p[order][side]).sum::<f64>() / walks))
    }
}

/// The same of the model, light that scatters more than once: in the light's direction of cosine `mu`.
fn modelled(hairs: &Hairs, depth: f64, mu: f64) -> [f64; 2] {
    const LAYERS: usize = 16;
    const CELLS: usize = 128;
    let moments = hairs.shading.moments();
    let scattering = Scattering { albedo: moments.albedo.as_vec3(), g: moments.mean_cosine.y as f32 };
    let similarity = scattering.similarity();
    let optics = ShellOptics::of_fibres(&similarity);
    let matter = ShellMatter {
        extinction: vec![Vec3::splat(optics.extinction.y); 2 * LAYERS],
        ..even(2 * LAYERS, optics.albedo.y, Below::Open)
    };
    let lights = [light(mu)];
    let lit = Surroundings { lights: &lights, ..Default::default() };
    let shell = flat([2, 2], depth as f32, |_| depth as f32);
    let values = column(&solve(&shell, LAYERS, &matter, &lit), 4);
    let l = lights[0].at(Vec3::ZERO).0;
    let mut sums = [0.0; 2];
    for i in 0..20 {
        let cosine = ((f64::from(i) + 0.5) / 20.0).sqrt();
        for turn in 0..16 {
            let turn = (f64::from(turn) + 0.5) / 16.0 * PI;
            for (side, sum) in sums.iter_mut().enumerate() {
                let (sine, sign) = ((1.0 - cosine * cosine).sqrt(), [1.0, -1.0][side]);
                let e =
                    Vec3::new((sine * turn.cos()) as f32, (sine * turn.sin()) as f32, (sign * cosine) as f32);
                let peak = forward_peak(similarity.g, -l.dot(e));
                let own = depth / CELLS as f64;
                for cell in 0..CELLS {
                    let above = own * cell as f64;
                    let middle = above + 0.5 * own;
                    let seen = if side == 0 { above } else { depth - above - own };
                    let bits = [seen / cosine, own / cosine, middle / mu].map(|d| (d * LOG2_E) as f32);
                    let diffuse = optics.albedo * between(&values, middle / depth) as f32;
                    let light = multiple(&similarity, &peak, diffuse, bits[0], bits[1], bits[2]);
                    *sum += f64::from(light.y) / (320.0 * mu);
                }
            }
        }
    }
    sums
}

#[test]
fn hairs_send_back_what_walks_from_hair_to_hair_do() {
    for (name, melanin) in [("blond", 0.1), ("brown", 0.5)] {
        let hairs = Hairs::new(melanin, None);
        for (depth, mu, allowed) in [(2.0, 1.0, 0.06), (8.0, 1.0, 0.06), (8.0, 0.5, 0.15)] {
            let l = light(mu).at(Vec3::ZERO).0.as_dvec3();
            let [once, truth] = hairs.walked(depth, l);
            let model = modelled(&hairs, depth, mu);
            let error = (model[0] - truth[0]) / (truth[0] + once[0]);
            println!("{name} {depth} {mu}: once {once:.3?} more {truth:.3?} model {model:.3?} {error:.3}");
            assert!(error.abs() < allowed, "{name}, depth {depth}, μ {mu}: {error}");
        }
    }
}

#[test]
fn hairs_that_lie_along_the_light_scatter_it_on() {
    // The reduced medium knows the hairs' mean albedo and cosine alone. Where all hairs lie nearly along the
    // light, it sends several times too much back; docs/method.md says so.
    let hairs = Hairs::new(0.1, Some(DVec3::new(0.8, 0.0, 0.6)));
    let l = light(0.5).at(Vec3::ZERO).0.as_dvec3();
    let ([_, truth], model) = (hairs.walked(8.0, l), modelled(&hairs, 8.0, 0.5));
    println!("{truth:.3?} {model:.3?}");
    assert!(model[0] > 2.0 * truth[0]);
}
