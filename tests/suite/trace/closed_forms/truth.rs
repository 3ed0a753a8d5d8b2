//! The whole trace of one ray, written a second time in float64 from the method alone with the brute-force
//! walker, and compared on random volumes, quads, rays and lights.

use super::{material, noise, scene};
use crate::tolerance::close;
use crate::walk::{true_events, true_start};
use glam::{DMat3, DVec3, IVec3, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use taki::engine::cpu::integrate::Integrator;
use taki::light::{AngleFrame, Light, Visibility};
use taki::scene::Scene;
use taki::trace::Attenuation;
use taki::volume::VolumeTexture;

/// Crossings that are closer than this share of the way are a near-tie: float32 may swap their order.
const TIE: f64 = 1e-4;

/// Radiance, transmittance, and whether a tie may change the result.
struct Truth {
    radiance: DVec3,
    transmittance: f64,
    near_tie: bool,
}

/// Cells that a ray meets while z is inside the slab, with the ray's length inside each, and whether two
/// crossings nearly coincide.
fn walk(size: IVec3, origin: DVec3, d: DVec3) -> (Vec<(IVec3, f64)>, bool) {
    let far = if d.z > 0.0 { size.z as f64 } else { 0.0 };
    let t_end = (far - origin.z) / d.z;
    let mut cell = true_start(origin, d);
    let mut cells = Vec::new();
    let (mut t, mut tie) = (0.0, false);
    for (t_next, axis) in true_events(origin, d, t_end * (1.0 - 1e-12)).into_iter().chain([(t_end, 2)]) {
        cells.push((IVec3::new(cell.x.rem_euclid(size.x), cell.y.rem_euclid(size.y), cell.z), t_next - t));
        // A start next to a face is a tie as well.
        tie |= t_next - t < TIE * t_end;
        t = t_next;
        cell[axis] += d[axis].signum() as i32;
    }
    (cells, tie)
}

fn trace(scene: &Scene, volume: &VolumeTexture, d: DVec3, uv: [f64; 2], x: DVec3, behind: DVec3) -> Truth {
    let size = IVec3::from_array(volume.size.map(|n| n as i32));
    let cells = size.as_dvec3();
    let quad = &scene.quads[0];
    let [a, b, c, e] = quad.corners.map(Vec3::as_dvec3);
    let g = a - b + c - e;
    let (du, dv) = (b - a + g * uv[1], e - a + g * uv[0]);
    let mut n = du.cross(dv).normalize();
    if n.dot(d) > 0.0 {
        n = -n;
    }
    let m = &quad.material;
    let (repeat_u, repeat_v) = (m.repeat_u as f64, m.repeat_v as f64);
    let world_from_cell = DMat3::from_cols(
        du / (repeat_u * cells.x),
        dv / (repeat_v * cells.y),
        n * (-(m.thickness_m as f64) / cells.z),
    );
    let cell_from_world = world_from_cell.inverse();
    let origin = DVec3::new(uv[0] * repeat_u * cells.x, uv[1] * repeat_v * cells.y, 0.0);

    let (per_cell, extinction) = match scene.trace.attenuation {
        Attenuation::PathLength { sigma } => (false, sigma as f64),
        Attenuation::PerCell { tau } => (true, tau as f64),
    };
    let at = |c: IVec3| volume.cells[volume.index(c.x as u32, c.y as u32, c.z as u32)];
    let rho = |c: IVec3| at(c).rho_code() as f64 / 65535.0 * volume.alpha as f64;
    let tau = |c: IVec3, length: f64| extinction * rho(c) * if per_cell { 1.0 } else { length };

    let (path, mut near_tie) = walk(size, origin, cell_from_world * d);
    let mut lit = DVec3::ZERO;
    let mut transmittance = 1.0;
    for (cell, length) in path {
        let passed = transmittance * (-tau(cell, length)).exp();
        let weight = transmittance - passed;
        transmittance = passed;
        if weight == 0.0 {
            continue;
        }
        let (k_d, k_s) = (at(cell).k_codes().0 as f64 / 255.0, at(cell).k_codes().1 as f64 / 255.0);
        let v = at(cell).v_code().as_dvec3();
        let mut sum = scene.ambient.as_dvec3();
        for light in &scene.lights {
            let (l, intensity) = match *light {
                Light::Directional { to_light, intensity } => (to_light.as_dvec3(), intensity.as_dvec3()),
                Light::Spot { .. } => unreachable!("the scenes of these tests have none"),
                Light::Point { position, intensity } => {
                    let away = position.as_dvec3() - x;
                    (away.normalize(), intensity.as_dvec3() / away.length_squared())
                }
            };
            let (t, l_frame, e_frame) = match scene.angles {
                AngleFrame::World => (world_from_cell * v, l, -d),
                AngleFrame::Texture => (v, cell_from_world * l, cell_from_world * -d),
            };
            let (angle_l, angle_e) = (t.angle_between(l_frame), t.angle_between(e_frame));
            // sin·sin − cos·cos is −cos of the sum of both angles.
            let specular = (-(angle_l + angle_e).cos()).max(0.0).powf(scene.p as f64);
            let psi = k_d * angle_l.sin() + k_s * specular;
            let seen = match scene.visibility {
                Visibility::None => 1.0,
                Visibility::March | Visibility::Cached => {
                    let (path, tie) = walk(size, cell.as_dvec3() + 0.5, cell_from_world * l);
                    near_tie |= tie;
                    let skip = usize::from(per_cell);
                    let depth: f64 = path.iter().skip(skip).map(|&(c, length)| tau(c, length)).sum();
                    (-depth).exp()
                }
            };
            sum += intensity * (seen * psi);
        }
        lit += sum * weight;
    }
    Truth { radiance: lit + behind * transmittance, transmittance, near_tie }
}

/// Largest relative error of a ray. Ψ's specular base is good to about 1e-6 and is raised to the power p. 1 −
/// cos² loses more where a fibre points at the light or the eye.
const RELATIVE: f64 = 2e-4;

/// Compares rays of one kind. Returns their number.
fn compare(attenuation: Attenuation, visibility: Visibility, frame: AngleFrame, seed: u64) -> usize {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut compared = 0;
    for i in 0..150 {
        let mut span = |low: f32, high: f32| low + (high - low) * rng.random::<f32>();
        let turn =
            glam::Quat::from_euler(glam::EulerRot::XYZ, span(-3.0, 3.0), span(-1.5, 1.5), span(-3.0, 3.0));
        let place = Vec3::new(span(-2.0, 2.0), span(-2.0, 2.0), span(-2.0, 2.0));
        let mut corner =
            |x: f32, y: f32| turn * Vec3::new(x + span(-0.2, 0.2), y + span(-0.2, 0.2), 0.0) + place;
        let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.6), corner(0.0, 1.6)];
        let mut scene = scene(corners, material(span(0.1, 0.6), span(0.5, 3.0), span(0.5, 3.0)));
        scene.edit().trace.attenuation = attenuation;
        scene.edit().visibility = visibility;
        scene.edit().angles = frame;
        scene.edit().p = [1.0, 8.0, 20.0, 7.5][i % 4];
        scene.edit().ambient = Vec3::new(0.1, 0.2, 0.05);
        let volume = noise([5, 7, 3], seed + i as u64);
        let n = scene.quads[0].map.n_world;
        for ray in 0..20 {
            let mut direction = || Vec3::new(span(-1.0, 1.0), span(-1.0, 1.0), span(-1.0, 1.0)).normalize();
            let (d, to_light) = (direction(), direction());
            // Rays and light that are nearly in the plane of the quad cross thousands of cells.
            if d.dot(n).abs() < 0.1 || to_light.dot(n).abs() < 0.1 {
                continue;
            }
            let (uv, distance) = ([span(0.0, 1.0), span(0.0, 1.0)], span(0.5, 4.0));
            let map = scene.quads[0].map;
            let x = map.point_world(uv[0], uv[1]);
            scene.edit().camera.eye = (x - d * distance).as_dvec3();
            // The point light lies on either side of the plane, away from it.
            let above = n * span(0.6, 2.0) * if ray % 2 == 0 { 1.0 } else { -1.0 };
            let position = x + above + map.e1_world * span(-1.0, 1.0);
            scene.edit().lights = vec![
                Light::Directional { to_light, intensity: Vec3::new(0.9, 0.7, 0.5) },
                Light::Point { position, intensity: Vec3::new(0.2, 0.9, 1.4) },
            ];
            let behind = Vec3::new(0.3, 0.0, 2.0);
            let own = Integrator::new(&scene, &volume).trace(0, d, [uv[0], uv[1], distance], behind, &mut ());
            let x = x.as_dvec3();
            let truth = trace(&scene, &volume, d.as_dvec3(), uv.map(f64::from), x, behind.as_dvec3());
            // A cell with a length of zero has no weight, except with per-cell attenuation.
            if truth.near_tie && matches!(attenuation, Attenuation::PerCell { .. }) {
                continue;
            }
            compared += 1;
            let what = format!("{attenuation:?} {visibility:?} {frame:?}, quad {i}, ray {ray}");
            assert!(
                close(own.transmittance as f64, truth.transmittance, 2e-5, 1e-7),
                "{what}: T {} not {}",
                own.transmittance,
                truth.transmittance
            );
            for (own, truth) in own.radiance.to_array().into_iter().zip(truth.radiance.to_array()) {
                assert!(close(own as f64, truth, RELATIVE, 1e-6), "{what}: {own}, not {truth}");
            }
        }
    }
    compared
}

#[test]
fn a_traced_ray_is_the_methods_sum_in_float64() {
    let kinds = [Attenuation::PathLength { sigma: 6.0 }, Attenuation::PerCell { tau: 0.3 }];
    for attenuation in kinds {
        for visibility in [Visibility::None, Visibility::March] {
            for frame in [AngleFrame::World, AngleFrame::Texture] {
                let compared = compare(attenuation, visibility, frame, 11);
                assert!(compared > 1000, "only {compared} rays of {attenuation:?} {visibility:?} {frame:?}");
            }
        }
    }
}
