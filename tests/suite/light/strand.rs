//! The reflection model of flowing water and of hair. Reference truth: closed forms of optics, and for the
//! table the direct model in float64. The shader is tested for parity with the CPU.

mod hair;
mod lookup;
mod optics;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use taki::light::strand::table::{StrandShading, StrandTable};
use taki::light::strand::water::Water;
use taki::light::strand::{Strand, StrandParams, cell_aeration, henyey_greenstein};

/// Roughnesses along and around the strand: both ends of the range, the default, and mixtures.
const ROUGHNESSES: [[f32; 2]; 7] =
    [[0.1, 0.1], [0.1, 1.0], [0.3, 0.2], [0.3, 0.1], [0.6, 0.6], [1.0, 0.1], [1.0, 1.0]];

/// Water without air.
fn clear([roughness_m, roughness_n]: [f32; 2], absorption: f32) -> Water {
    Water { roughness_m, roughness_n, absorption, aeration: 0.0, ..Water::default() }
}

/// Parameters of strands without air.
fn strands(roughness: [f32; 2], absorption: f32) -> StrandParams {
    clear(roughness, absorption).strand()
}

/// Cosines t·l, t·e and l·e of two directions, given by their inclinations and the azimuth between them.
fn cosines(theta_i: f64, theta_o: f64, phi: f64) -> [f32; 3] {
    let l_dot_e = theta_i.sin() * theta_o.sin() + theta_i.cos() * theta_o.cos() * phi.cos();
    [theta_i.sin(), theta_o.sin(), l_dot_e].map(|x| x as f32)
}

/// ∫ f(θ, φ) dω over the sphere, in cells of equal angles, each with its exact solid angle.
fn over_sphere(thetas: usize, phis: usize, f: impl Fn(f64, f64) -> f64) -> f64 {
    let step = PI / thetas as f64;
    let mut sum = 0.0;
    for i in 0..thetas {
        let low = i as f64 * step - FRAC_PI_2;
        let ring: f64 = (0..phis).map(|j| f(low + 0.5 * step, (j as f64 + 0.5) * PI / phis as f64)).sum();
        sum += ring * ((low + step).sin() - low.sin());
    }
    sum * TAU / phis as f64
}

/// Directions of light and eye. Half of them lie anywhere, the others near the mirror cone, where Φ is large.
fn directions(count: usize, sigma: f64) -> Vec<[f64; 3]> {
    let mut rng = Pcg64Mcg::seed_from_u64(1986);
    let mut unit = || rng.random_range(-1.0..1.0f64);
    (0..count)
        .map(|k| {
            let theta_i = unit().asin();
            let anywhere = unit().asin();
            let beside = (3.0 * sigma * unit() - theta_i).clamp(-1.56, 1.56);
            [theta_i, if k % 2 == 0 { anywhere } else { beside }, PI * unit().abs()]
        })
        .collect()
}

#[test]
fn white_strands_give_back_all_light_at_every_inclination_and_roughness() {
    for roughness in ROUGHNESSES {
        let table = StrandTable::build(&strands(roughness, 0.0));
        for degrees in [0.0f64, 3.0, 17.0, 30.0, 45.0, 59.4, 70.0, 80.0, 86.0, 88.5, 89.5] {
            let theta_i = degrees.to_radians();
            let sum = over_sphere(720, 120, |theta_o, phi| {
                let [l, e, le] = cosines(theta_i, theta_o, phi);
                table.psi(l, e, le).y as f64 / PI
            });
            assert!((sum - 1.0).abs() < 0.01, "{sum} of 1 at {degrees}° with roughness {roughness:?}");
        }
    }
}

#[test]
fn the_model_itself_gives_back_all_light() {
    for roughness_m in [0.1, 0.3, 1.0] {
        let strand = Strand::new(&strands([roughness_m, 0.5], 0.0));
        for degrees in [0.0f64, 30.0, 60.0, 85.0] {
            let phi_and_theta =
                |theta_o: f64, phi: f64| strand.lobes(degrees.to_radians(), theta_o, phi).total().x;
            let sum = over_sphere(720, 16, phi_and_theta);
            // The balance uses inclinations 0.7° apart, and its iteration has ended.
            assert!((sum - 1.0).abs() < 2e-3, "{sum} at {degrees}°, roughness {roughness_m}");
        }
    }
}

/// Checks that light and eye may change places, in the model to 1e-12 and in the table to the bit.
fn is_reciprocal(params: &StrandParams) {
    let (strand, shading) = (Strand::new(params), StrandShading::new(params));
    for [theta_i, theta_o, phi] in directions(300, 0.3) {
        let there = strand.lobes(theta_i, theta_o, phi).total();
        let back = strand.lobes(theta_o, theta_i, phi).total();
        assert!((there - back).abs().max_element() <= 1e-12 * there.max_element(), "{there} and {back}");
        let [l, e, le] = cosines(theta_i, theta_o, phi);
        assert_eq!(shading.psi(0.4, 0.6, l, e, le), shading.psi(0.4, 0.6, e, l, le));
    }
}

#[test]
fn light_and_eye_change_places_without_a_change() {
    is_reciprocal(&Water { radius_m: 0.1, ..Water::default() }.strand());
}

#[test]
fn neither_the_sense_of_the_flow_nor_that_of_the_azimuth_matters() {
    let params = Water::default().strand();
    let (strand, shading) = (Strand::new(&params), StrandShading::new(&params));
    for [theta_i, theta_o, phi] in directions(300, 0.3) {
        let here = strand.lobes(theta_i, theta_o, phi).total();
        for other in [strand.lobes(-theta_i, -theta_o, phi), strand.lobes(theta_i, theta_o, -phi)] {
            assert!((here - other.total()).abs().max_element() <= 1e-12 * here.max_element());
        }
        let [l, e, le] = cosines(theta_i, theta_o, phi);
        assert_eq!(shading.psi(0.4, 0.6, l, e, le), shading.psi(0.4, 0.6, -l, -e, le));
    }
}

#[test]
fn light_goes_to_the_mirror_cone_and_on_through_the_strand() {
    let strand = Strand::new(&strands([0.1, 0.1], 0.0));
    for degrees in [20.0f64, 45.0, 70.0] {
        let theta = degrees.to_radians();
        let mirror = strand.lobes(theta, -theta, PI);
        let beside = strand.lobes(theta, theta, PI);
        assert!(mirror.total().x > 1e3 * beside.total().x, "{mirror:?}, {beside:?}");
        // Light that passed through the strand leaves straight on. Only reflected light returns to the
        // light's side.
        let back = strand.lobes(theta, -theta, 0.0);
        assert!(mirror.tt.x > 10.0 * mirror.r.x && back.tt.x < 1e-3 * back.r.x, "{mirror:?}, {back:?}");
    }
}

#[test]
fn water_takes_most_of_red_and_least_of_blue() {
    // The strand is a metre thick, because thin ones absorb almost nothing.
    let thick = |absorption| Water { radius_m: 0.5, ..clear([0.3, 0.2], absorption) }.strand();
    let albedo = StrandTable::of(&thick(1.0)).moments().albedo;
    assert!(albedo.x < albedo.y && albedo.y < albedo.z && albedo.z < 1.0, "{albedo}");
    let more = StrandTable::of(&thick(2.0)).moments().albedo;
    assert!(more.cmplt(albedo).all(), "{more}, {albedo}");
    let none = StrandTable::of(&thick(0.0)).moments().albedo;
    assert!((none - 1.0).abs().max_element() < 1e-3, "{none}");
}

#[test]
fn air_scatters_all_light_by_its_mean_cosine() {
    for g in [-0.9f64, -0.3, 0.0, 0.5, 0.9] {
        let steps = 100_000;
        let (mut sum, mut cosine) = (0.0, 0.0);
        for i in 0..steps {
            let mu = (i as f64 + 0.5) * 2.0 / steps as f64 - 1.0;
            let phi = TAU * 2.0 / steps as f64 * henyey_greenstein(g, mu);
            sum += phi;
            cosine += phi * mu;
        }
        // The bound is the midpoint rule's h²/24·f′ at g = 0.9, where f′ is 6e3.
        assert!((sum - 1.0).abs() < 1e-6 && (cosine - g).abs() < 1e-6, "{g}: {sum}, {cosine}");
    }
}

#[test]
fn isotropic_air_alone_is_a_quarter_everywhere_and_g_is_its_own_mean_cosine() {
    let air = |g: f32| StrandShading::new(&Water { aeration: 1.0, g, ..Water::default() }.strand());
    for [theta_i, theta_o, phi] in directions(100, 0.3) {
        let [l, e, le] = cosines(theta_i, theta_o, phi);
        assert_eq!(air(0.0).psi(0.5, 0.5, l, e, le).to_array(), [0.25; 3]);
        // Light goes forward if the eye is opposite the light.
        let want = PI * henyey_greenstein(0.6, -le as f64);
        assert!((air(0.6).psi(0.5, 0.5, l, e, le).x as f64 - want).abs() < 1e-5 * want);
    }
    assert!((air(0.7).moments().mean_cosine - 0.7f32 as f64).abs().max_element() < 1e-12);
}

#[test]
fn means_over_all_directions_are_those_of_the_model() {
    let params = Water { radius_m: 0.1, ..clear([0.4, 0.4], 1.0) }.strand();
    let strand = Strand::new(&params);
    let moments = StrandTable::of(&params).moments();
    let mut albedo = 0.0;
    let mut cosine = 0.0;
    let light = 24;
    for i in 0..light {
        // The inclinations have equal shares of one half of the sphere.
        let theta_i = ((i as f64 + 0.5) / light as f64).asin();
        albedo += over_sphere(120, 24, |theta_o, phi| strand.lobes(theta_i, theta_o, phi).total().x);
        cosine += over_sphere(120, 24, |theta_o, phi| {
            -strand.lobes(theta_i, theta_o, phi).total().x * cosines(theta_i, theta_o, phi)[2] as f64
        });
    }
    assert!((moments.albedo.x - albedo / light as f64).abs() < 2e-3, "{moments:?}, {albedo}");
    assert!((moments.mean_cosine.x - cosine / albedo).abs() < 2e-3, "{moments:?}, {cosine} / {albedo}");
    let half = StrandShading::new(&StrandParams { aeration: 0.5, g: 0.2, ..params }).moments();
    let want = (moments.albedo.x * moments.mean_cosine.x + 0.2) / (moments.albedo.x + 1.0);
    assert!((half.mean_cosine.x - want).abs() < 1e-7, "{half:?}, not {want}");
}

#[test]
fn the_noise_of_k_is_noise_of_the_air() {
    assert_eq!(cell_aeration(0.3, 0.5, 0.5), 0.3);
    assert_eq!(cell_aeration(0.3, 0.0, 0.0), 0.3);
    assert_eq!(cell_aeration(0.3, 0.0, 0.5), 0.0);
    assert_eq!(cell_aeration(0.3, 0.5, 0.0), 0.6);
    assert_eq!(cell_aeration(0.8, 0.5, 0.0), 1.0);
    // The unit of k does not matter: the shader has k in 1/255.
    assert_eq!(cell_aeration(0.3, 0.25, 0.75), cell_aeration(0.3, 1.0, 3.0));
}
