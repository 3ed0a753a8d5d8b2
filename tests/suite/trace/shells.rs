//! Shells, pixel by pixel, against a tracer in float64 that knows no paths: it cuts every ray with all
//! tetrahedra, sorts the intervals, and walks the cells in each.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3, IVec3, Vec3};
use taki::Unwatched;
use taki::engine::cpu;
use taki::light::{AngleFrame, Light, Visibility};
use taki::mapping::shell::{Shell, Side, SurfaceMesh};
use taki::place::{MeshShade, ShellShadows, Triangles, Vertex};
use taki::scene::Scene;
use taki::trace::{Attenuation, Prefilter};
use taki::volume::VolumeTexture;

use super::closed_forms::{noise, uniform};
use crate::mapping::shell::{interval, sphere, strip, torus};
use crate::walk::{true_events, true_start};

const SIZE: [u32; 2] = [72, 48];
const SIGMA: f32 = 2.5;

/// A scene of one shell and two lights, seen from `eye`.
pub fn scene(shell: Shell, eye: [f64; 3]) -> Scene {
    scene_with(shell, eye, &[])
}

/// The scene with more settings.
pub fn scene_with(shell: Shell, eye: [f64; 3], sets: &[&str]) -> Scene {
    let mut scene = Scene::preset("front").expect("a preset");
    let own = [
        &format!("camera.eye=[{},{},{}]", eye[0], eye[1], eye[2]),
        "camera.target=[0,0,0]",
        "camera.fov=45",
        &format!("image.width={}", SIZE[0]),
        &format!("image.height={}", SIZE[1]),
        "image.samples=1",
        "light.visibility=march",
        "trace.layers=8",
        "trace.max_cells=65536",
        "trace.early_end=0",
        "light.p=8",
    ];
    scene = scene.with(&[&own, sets].concat()).expect("valid settings");
    let parts = scene.edit();
    parts.quads.clear();
    parts.shells = vec![Arc::new(shell)];
    parts.trace.attenuation = Attenuation::PathLength { sigma: SIGMA };
    parts.ambient = Vec3::new(0.1, 0.2, 0.05);
    parts.lights = vec![
        Light::Directional {
            to_light: Vec3::new(1.0, 2.0, 0.5).normalize(),
            intensity: Vec3::new(0.9, 0.7, 0.5),
        },
        Light::Point { position: Vec3::new(-2.0, 3.0, 2.0), intensity: Vec3::new(4.0, 9.0, 8.0) },
    ];
    parts.background.zenith = Vec3::new(0.3, 0.0, 1.2);
    parts.background.horizon = parts.background.zenith;
    scene
}

/// A tetrahedron: its corners, its Jacobian (metres per copy of the volume), and the texture coordinates of
/// its first corner.
struct Tetrahedron {
    corners: [DVec3; 4],
    texture_from_world: DMat3,
    at: DVec3,
    /// Texture coordinates of the prism.
    uv: [DVec2; 3],
    /// Frames of light at its outer and inner points.
    frames: [[DMat3; 2]; 3],
    /// Whether its fourth face is the inner surface.
    is_innermost: bool,
    /// Vertices of the prism.
    vertices: [u32; 3],
}

fn tetrahedra(shell: &Shell) -> Vec<Tetrahedron> {
    let facets: Vec<[DMat3; 2]> = (0..shell.prisms.len()).map(|i| facet_frames(shell, i)).collect();
    let mut out = Vec::new();
    for (i, prism) in shell.prisms.iter().enumerate() {
        let frames = prism.vertices.map(|vertex| vertex_frames(shell, &facets, i, vertex));
        for k in 0..3 {
            let numbers = shell.tetrahedron(i, k);
            let corners = numbers.map(|p| shell.points[p as usize].as_dvec3());
            let at = numbers.map(|p| {
                let vertex = prism.vertices.iter().position(|&v| v == p / 2).expect("a vertex of the prism");
                prism.uv[vertex].as_dvec2().extend(f64::from(p % 2))
            });
            let edges = |all: [DVec3; 4]| DMat3::from_cols(all[1] - all[0], all[2] - all[0], all[3] - all[0]);
            let texture_from_world = edges(at) * edges(corners).inverse();
            out.push(Tetrahedron {
                corners,
                texture_from_world,
                at: at[0],
                uv: prism.uv.map(|uv| uv.as_dvec2()),
                frames,
                is_innermost: k == 2,
                vertices: prism.vertices,
            });
        }
    }
    out
}

/// Frames of a prism's outer and inner triangle: metres per copy of the volume, by solving for the texture's
/// gradient. The third column is not used.
fn facet_frames(shell: &Shell, i: usize) -> [DMat3; 2] {
    let prism = &shell.prisms[i];
    [0, 1].map(|depth| {
        let [p, q, r] = prism.vertices.map(|v| shell.points[(2 * v + depth) as usize].as_dvec3());
        let [a, b, c] = prism.uv.map(|uv| uv.as_dvec2());
        let normal = (q - p).cross(r - p);
        let edges = DMat3::from_cols(q - p, r - p, normal);
        let texture = DMat3::from_cols((b - a).extend(0.0), (c - a).extend(0.0), DVec3::Z);
        edges * texture.inverse()
    })
}

/// Frames of light at a vertex of prism number `own`: means over the prisms there whose axes along the
/// surface are near its own, weighted by their angles halfway between the surfaces. A group of such prisms
/// has the axes of its first one.
fn vertex_frames(shell: &Shell, facets: &[[DMat3; 2]], own: usize, vertex: u32) -> [DMat3; 2] {
    let middle = |v: u32| {
        let [outer, inner] = [0, 1].map(|k| shell.points[(2 * v + k) as usize].as_dvec3());
        (outer + inner) * 0.5
    };
    let around: Vec<(usize, usize)> = (shell.prisms.iter().enumerate())
        .filter_map(|(i, prism)| Some((i, prism.vertices.iter().position(|&v| v == vertex)?)))
        .collect();
    let axes = |i: usize| facets[i][0] + facets[i][1];
    let is_near = |i: usize, j: usize| {
        let [a, b] = [axes(i), axes(j)];
        a.x_axis.angle_between(b.x_axis) < PI / 3.0 && a.y_axis.angle_between(b.y_axis) < PI / 3.0
    };
    let mut firsts: Vec<usize> = Vec::new();
    let mut group_of = |i: usize| match firsts.iter().find(|&&first| is_near(first, i)) {
        Some(&first) => first,
        None => {
            firsts.push(i);
            i
        }
    };
    let groups: Vec<usize> = around.iter().map(|&(i, _)| group_of(i)).collect();
    let own = groups[around.iter().position(|&(i, _)| i == own).expect("a prism at its vertex")];
    let (mut sum, mut weights) = ([DMat3::ZERO; 2], 0.0);
    for (&(i, k), _) in around.iter().zip(&groups).filter(|(_, group)| **group == own) {
        let [at, p, q] = [0, 1, 2].map(|n| middle(shell.prisms[i].vertices[(k + n) % 3]));
        let angle = (p - at).normalize().dot((q - at).normalize()).acos();
        (0..2).for_each(|k| sum[k] += facets[i][k] * angle);
        weights += angle;
    }
    let down = shell.points[(2 * vertex + 1) as usize] - shell.points[(2 * vertex) as usize];
    sum.map(|sum| {
        let mean = sum * (1.0 / weights);
        DMat3::from_cols(mean.x_axis, mean.y_axis, down.as_dvec3())
    })
}

impl Tetrahedron {
    /// Shares of the prism's vertices at a point, and the depth.
    fn shares(&self, point: DVec3) -> ([f64; 3], f64) {
        let at = self.at + self.texture_from_world * (point - self.corners[0]);
        let [a, b, c] = self.uv;
        let p = at.truncate();
        let whole = (b - a).perp_dot(c - a);
        ([(b, c), (c, a), (a, b)].map(|(q, r)| (q - p).perp_dot(r - p) / whole), at.z)
    }

    /// Frame of light at a point: interpolated between the prism's vertices, and into the depth.
    fn frame(&self, point: DVec3) -> DMat3 {
        let (shares, z) = self.shares(point);
        let mut sum = DMat3::ZERO;
        for (frames, share) in self.frames.iter().zip(shares) {
            sum += (frames[0] * (1.0 - z) + frames[1] * z) * share;
        }
        sum
    }

    /// Share of a light that opaque matter lets through to a point, where `at_vertices` is that at the
    /// vertices of the shell.
    fn past_opaque_matter(&self, point: DVec3, at_vertices: &[[f32; 2]]) -> f64 {
        let (shares, z) = self.shares(point);
        let of_vertex = |(&vertex, share): (&u32, f64)| {
            let [outer, inner] = at_vertices[vertex as usize].map(f64::from);
            (outer * (1.0 - z) + inner * z) * share
        };
        self.vertices.iter().zip(shares).map(of_vertex).sum()
    }
}

/// Intervals of a ray in the tetrahedra from t = 0 on, in order.
fn cut<'a>(all: &'a [Tetrahedron], origin: DVec3, direction: DVec3) -> Vec<([f64; 2], &'a Tetrahedron)> {
    let of = |tetrahedron: &'a Tetrahedron| {
        let [from, to] = interval(tetrahedron.corners, origin, direction)?;
        (to > 0.0).then_some(([from.max(0.0), to], tetrahedron))
    };
    let mut cuts: Vec<_> = all.iter().filter_map(of).collect();
    cuts.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    cuts
}

/// Cells of a ray in a tetrahedron, with the parameters where it enters and leaves each.
fn cells(
    tetrahedron: &Tetrahedron,
    size: [u32; 3],
    [origin, direction]: [DVec3; 2],
    t: [f64; 2],
) -> Vec<(IVec3, [f64; 2])> {
    let n = DVec3::from_array(size.map(f64::from));
    let start = origin + direction * t[0];
    let from = (tetrahedron.at + tetrahedron.texture_from_world * (start - tetrahedron.corners[0])) * n;
    let d = tetrahedron.texture_from_world * direction * n;
    let length = t[1] - t[0];
    let mut cell = true_start(from, d);
    let mut out = Vec::new();
    let mut last = 0.0;
    for (next, axis) in true_events(from, d, length * (1.0 - 1e-12)).into_iter().chain([(length, 2)]) {
        let [nx, ny, nz] = size.map(|n| n as i32);
        let inside = IVec3::new(cell.x.rem_euclid(nx), cell.y.rem_euclid(ny), cell.z.clamp(0, nz - 1));
        out.push((inside, [t[0] + last, t[0] + next]));
        last = next;
        cell[axis] += d[axis].signum() as i32;
    }
    out
}

/// Radiance of a ray up to the distance `far`, behind which `behind` is seen, and whether it meets the shell.
fn trace(
    scene: &Scene,
    volume: &VolumeTexture,
    (all, shadows): (&[Tetrahedron], Option<&ShellShadows>),
    ray: [DVec3; 2],
    (far, behind): (f64, DVec3),
) -> (DVec3, bool) {
    let skin = scene.shells[0].skin;
    let at = |c: IVec3| volume.cell(c.x as u32, c.y as u32, c.z as u32);
    let density = |c: IVec3| f64::from(at(c).rho_code()) / 65535.0 * f64::from(volume.alpha * SIGMA);
    let [origin, d] = ray;
    let cuts = cut(all, origin, d);
    let (mut lit, mut transmittance) = (DVec3::ZERO, 1.0);
    for (t, tetrahedron) in &cuts {
        if t[0] >= far {
            break;
        }
        let t = &[t[0], t[1].min(far)];
        let n = DVec3::from_array(volume.size.map(f64::from));
        for (cell, [enter, leave]) in cells(tetrahedron, volume.size, ray, *t) {
            let passed = transmittance * (-density(cell) * (leave - enter)).exp();
            let weight = transmittance - passed;
            transmittance = passed;
            if weight == 0.0 {
                continue;
            }
            let (k_d, k_s) = at(cell).k_codes();
            let v = at(cell).v_code().as_dvec3();
            let mut sum = scene.ambient.as_dvec3();
            let middle = origin + d * (0.5 * (enter + leave));
            let world_from_cell = tetrahedron.frame(middle) * DMat3::from_diagonal(1.0 / n);
            for (i, light) in scene.lights.iter().enumerate() {
                let (l, intensity) = light.at(middle.as_vec3());
                let far = f64::from(light.distance(middle.as_vec3()));
                let (l, intensity) = (l.as_dvec3().normalize(), intensity.as_dvec3());
                let (fibre, l_frame, e_frame) = match scene.angles {
                    AngleFrame::World => (world_from_cell * v, l, -d),
                    AngleFrame::Texture => {
                        let inverse = world_from_cell.inverse();
                        (v, inverse * l, inverse * -d)
                    }
                };
                let (angle_l, angle_e) = (fibre.angle_between(l_frame), fibre.angle_between(e_frame));
                let specular = (-(angle_l + angle_e).cos()).max(0.0).powf(f64::from(scene.p));
                let psi = f64::from(k_d) / 255.0 * angle_l.sin() + f64::from(k_s) / 255.0 * specular;
                let mut depth = 0.0;
                let mut end = 0.0;
                for (t, tetrahedron) in cut(all, middle, l) {
                    // Beyond the shell, light comes from outside.
                    if t[0] > end + 1e-6 || t[0] >= far || depth == f64::INFINITY {
                        break;
                    }
                    end = t[1];
                    for (cell, [enter, leave]) in
                        cells(tetrahedron, volume.size, [middle, l], [t[0], t[1].min(far)])
                    {
                        depth += density(cell) * (leave - enter);
                    }
                    let [_, b, c, d] = tetrahedron.corners;
                    let normal = (c - b).cross(d - b).normalize();
                    let is_inside = (middle + l * t[1] - b).dot(normal).abs() > 1e-6;
                    if skin && tetrahedron.is_innermost && !is_inside && t[1] < far {
                        depth = f64::INFINITY;
                    }
                }
                let open = shadows.map_or(1.0, |own| tetrahedron.past_opaque_matter(middle, own.of(0, i)));
                sum += intensity * ((-depth).exp() * psi * open);
            }
            lit += sum * weight;
        }
    }
    (lit + behind * transmittance, !cuts.is_empty())
}

/// Compares all pixels of a scene. `opaque` finds the distance and the radiance of what lies behind the shell
/// on a ray. Returns the share of those that meet the shell.
pub fn compare(
    scene: &Scene,
    volume: &VolumeTexture,
    opaque: impl Fn(DVec3, DVec3) -> Option<(f64, DVec3)>,
) -> f64 {
    let [width, height] = SIZE;
    let mesh = scene.mesh();
    let frame = cpu::render(scene, volume, &mesh, false, &Unwatched).expect("a frame");
    let all = tetrahedra(&scene.shells[0]);
    // Their values are tested beside brute force in `shell_shadows.rs`.
    let shadows = scene.shadows_on_shells(&mesh, &Unwatched).expect("nobody stops it");
    let [forward, right, up] = scene.camera.rays(width, height);
    let (mut wrong, mut met) = (0, 0);
    for (i, own) in frame.radiance.iter().enumerate() {
        let pixel = [i as u32 % width, i as u32 / width];
        let at = taki::picture::Camera::image_point(width, height, pixel, [0.5; 2]).as_dvec2();
        let d = (forward + right * at.x + up * at.y).normalize();
        let eye = scene.camera.eye_local();
        let end = opaque(eye, d).unwrap_or((f64::INFINITY, scene.background.zenith.as_dvec3()));
        let (truth, meets) = trace(scene, volume, (&all, shadows.as_deref()), [eye, d], end);
        met += u32::from(meets);
        let own = DVec3::new(own[0].into(), own[1].into(), own[2].into());
        let error = (own - truth).abs() / truth.max(DVec3::splat(0.05));
        if error.max_element() > 1e-3 {
            wrong += 1;
            if wrong < 4 {
                eprintln!("{pixel:?}: {own} not {truth}");
            }
        }
    }
    assert!(wrong * 1000 <= met, "{wrong} of {met} pixels");
    f64::from(met) / f64::from(width * height)
}

pub fn shell(mesh: &SurfaceMesh, side: Side) -> Shell {
    Shell::new(mesh, side).expect("a valid mesh")
}

#[test]
fn pixels_of_shells_are_those_of_a_tracer_in_float64() {
    let volume = noise([6, 8, 5], 4);
    let mut torus = shell(&torus(14, 9, 0.35), Side::Outward);
    torus.skin = true;
    let shells = [
        // A view from above, and one along the surface.
        (torus, [[0.5, 4.5, 3.0], [0.2, 0.3, 4.4]]),
        (shell(&sphere(2, 0.4), Side::Outward), [[1.0, 2.0, 2.6], [0.1, 1.45, 3.2]]),
        (shell(&strip(9), Side::Inward), [[0.2, 1.2, 3.4], [-1.0, 0.05, 2.6]]),
    ];
    for (shell, eyes) in shells {
        for (eye, angles) in eyes.into_iter().zip([AngleFrame::World, AngleFrame::Texture]) {
            let mut scene = scene(shell.clone(), eye);
            scene.edit().angles = angles;
            let share = compare(&scene, &volume, |_, _| None);
            assert!(share > 0.1, "{share}");
        }
    }
}

#[test]
fn a_uniform_hollow_sphere_lets_pass_what_its_chord_does() {
    // The facets of the mesh stand for the sphere, so its chords are those of a polytope: finer ones come
    // closer, in proportion to the area of the facets.
    let errors = [3, 4].map(|levels| {
        let mut scene = scene(shell(&sphere(levels, 0.4), Side::Outward), [0.0, 0.0, 4.0]);
        scene.edit().lights.clear();
        scene.edit().ambient = Vec3::ZERO;
        let volume = uniform([4, 4, 4], Vec3::Y, 0.6, 0.5, 0.5);
        let rho = f64::from(volume.cells[0].rho());
        let frame = cpu::render(&scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame");
        let [forward, right, up] = scene.camera.rays(SIZE[0], SIZE[1]);
        let mut sum = 0.0;
        for (i, own) in frame.radiance.iter().enumerate() {
            let pixel = [i as u32 % SIZE[0], i as u32 / SIZE[0]];
            let at = taki::picture::Camera::image_point(SIZE[0], SIZE[1], pixel, [0.5; 2]).as_dvec2();
            let d = (forward + right * at.x + up * at.y).normalize();
            let away = scene.camera.eye_local();
            let b2 = away.length_squared() - away.dot(d).powi(2);
            let half = |r: f64| (r * r - b2).max(0.0).sqrt();
            let chord = 2.0 * (half(1.4) - half(1.0));
            let want = (-f64::from(SIGMA) * rho * chord).exp();
            sum += (f64::from(own[2]) / 1.2 - want).abs();
        }
        sum / frame.radiance.len() as f64
    });
    assert!(errors[0] < 1e-2 && errors[1] < errors[0] * 0.3, "{errors:?}");
}

#[test]
fn turning_the_scene_turns_the_picture() {
    let volume = noise([6, 8, 5], 9);
    let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.7, -1.1, 0.4);
    let mesh = torus(14, 9, 0.35);
    let mut turned_mesh = mesh.clone();
    turned_mesh.positions.iter_mut().for_each(|p| *p = (turn * p.as_dvec3()).as_vec3());
    let plain = scene(shell(&mesh, Side::Outward), [0.5, 4.5, 3.0]);
    let mut turned = scene(shell(&turned_mesh, Side::Outward), [0.5, 4.5, 3.0]);
    let parts = turned.edit();
    for axis in
        [&mut parts.camera.eye, &mut parts.camera.right, &mut parts.camera.up, &mut parts.camera.forward]
    {
        *axis = turn * *axis;
    }
    for light in &mut parts.lights {
        match light {
            Light::Directional { to_light: v, .. }
            | Light::Point { position: v, .. }
            | Light::Spot { position: v, .. } => {
                *v = (turn * v.as_dvec3()).as_vec3();
            }
        }
    }
    let [a, b] = [&plain, &turned].map(|scene| {
        cpu::render(scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame").radiance
    });
    let differ =
        a.iter().zip(&b).filter(|(a, b)| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-3 * a[c].max(0.05)));
    let count = differ.count();
    assert!(count * 200 <= a.len(), "{count}");
}

#[test]
fn a_flat_shell_is_the_slab_where_no_border_is_near() {
    let volume = noise([6, 8, 5], 2);
    let (repeat_u, repeat_v, thickness) = (2.0, 3.0, 0.2);
    let corners = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
    let uv = [[0.0, 0.0], [repeat_u, 0.0], [repeat_u, repeat_v], [0.0, repeat_v]].map(glam::Vec2::from_array);
    let mesh = SurfaceMesh {
        positions: corners.to_vec(),
        uv: uv.to_vec(),
        thickness: vec![thickness; 4],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    };
    let with_shell = {
        let mut scene = scene(shell(&mesh, Side::Inward), [0.3, -0.2, 1.6]);
        scene.edit().visibility = Visibility::None;
        // The direction to a near light is that at the slab's face, but at the cell in a shell.
        scene.edit().lights.truncate(1);
        scene
    };
    let with_quad = {
        let mut scene = with_shell.clone();
        let material = taki::mapping::Material {
            thickness_m: thickness,
            repeat_u,
            repeat_v,
            volume: 0,
            billow: Default::default(),
        };
        scene.edit().shells.clear();
        scene.edit().quads = vec![taki::mapping::Quad::new(corners, material).expect("a quad")];
        scene
    };
    let [a, b] = [&with_shell, &with_quad].map(|scene| {
        cpu::render(scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame").radiance
    });
    let [forward, right, up] = with_quad.camera.rays(SIZE[0], SIZE[1]);
    let mut compared = 0;
    for (i, (a, b)) in a.iter().zip(&b).enumerate() {
        let pixel = [i as u32 % SIZE[0], i as u32 / SIZE[0]];
        let at = taki::picture::Camera::image_point(SIZE[0], SIZE[1], pixel, [0.5; 2]).as_dvec2();
        let d = forward + right * at.x + up * at.y;
        let eye = with_quad.camera.eye_local();
        let at_depth = |z: f64| eye + d * ((z - eye.z) / d.z);
        let is_inside = |p: DVec3| p.x.abs() < 0.999 && p.y.abs() < 0.999;
        if is_inside(at_depth(0.0)) && is_inside(at_depth(-f64::from(thickness))) {
            compared += 1;
            for c in 0..3 {
                assert!((a[c] - b[c]).abs() <= 5e-4 * b[c], "{pixel:?}: {a:?} {b:?}");
            }
        }
    }
    assert!(compared > 1000, "{compared}");
}

#[test]
fn the_opaque_scene_ends_a_ray_inside_a_shell() {
    // A wall through the middle of the sphere.
    let corners = [[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]].map(|[x, y]| Vec3::new(x, y, 0.1));
    let vertex = |k: usize| Vertex {
        position: corners[k].to_array(),
        normal: [0.0, 0.0, 1.0],
        albedo: [0.5, 0.25, 0.75],
        ..Default::default()
    };
    let mut scene = scene(shell(&sphere(2, 0.4), Side::Outward), [1.0, 1.2, 2.6]);
    let parts = scene.edit();
    parts.triangles = vec![Triangles {
        vertices: Arc::new([0, 1, 2, 0, 2, 3].map(vertex).to_vec()),
        holdout: false,
        shade: MeshShade::default(),
        painting: None,
    }];
    // Only ambient light, by which the wall's radiance is known.
    parts.lights.clear();
    let wall = parts.ambient.as_dvec3() * DVec3::new(0.5, 0.25, 0.75);
    let share = compare(&scene, &noise([6, 8, 5], 4), |eye, d| {
        let t = (f64::from(0.1f32) - eye.z) / d.z;
        let p = eye + d * t;
        (t > 0.0 && p.x.abs() < 3.0 && p.y.abs() < 3.0).then_some((t, wall))
    });
    assert!(share > 0.1, "{share}");
}

/// Root mean square of the differences between two pictures, relative to that of the second.
fn rmse(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let channels = |r: &[[f32; 4]]| r.iter().flat_map(|r| r[..3].to_vec()).map(f64::from).collect::<Vec<_>>();
    let (a, b) = (channels(a), channels(b));
    let square = |x: f64| x * x;
    let error: f64 = a.iter().zip(&b).map(|(a, b)| square(a - b)).sum();
    (error / b.iter().map(|b| square(*b)).sum::<f64>()).sqrt()
}

pub fn render(scene: &Scene, volume: &VolumeTexture) -> Vec<[f32; 4]> {
    cpu::render(scene, volume, &scene.mesh(), false, &Unwatched).expect("a frame").radiance
}

#[test]
fn light_kept_at_vertices_is_close_to_that_walked_from_every_cell() {
    // Edges of about one cell, and of eight.
    let volume = noise([12, 12, 10], 7);
    let errors = [(36, 18), (9, 5)].map(|(n, m)| {
        let mut torus = shell(&torus(n, m, 0.35), Side::Outward);
        torus.skin = true;
        let mut scene = scene(torus, [0.5, 4.5, 3.0]);
        scene.edit().ambient = Vec3::ZERO;
        scene.edit().background.zenith = Vec3::ZERO;
        scene.edit().background.horizon = Vec3::ZERO;
        let march = render(&scene, &volume);
        scene.edit().visibility = Visibility::Cached;
        rmse(&render(&scene, &volume), &march)
    });
    assert!(errors[0] < 0.06 && errors[1] < 0.25, "{errors:?}");
    assert!(errors[0] > 0.0, "the same picture");
}

#[test]
fn the_pyramid_spares_samples_where_cells_are_small() {
    let volume = noise([16, 16, 16], 3);
    let mut scene = scene(shell(&torus(28, 18, 0.35), Side::Outward), [3.0, 27.0, 18.0]);
    scene.edit().visibility = Visibility::None;
    let once = render(&scene, &volume);
    scene.edit().trace.filter = Prefilter::Pyramid;
    let filtered = render(&scene, &volume);
    scene.edit().trace.filter = Prefilter::None;
    scene.edit().image.samples = 64;
    let truth = render(&scene, &volume);
    let [plain, filtered] = [once, filtered].map(|picture| rmse(&picture, &truth));
    assert!(filtered < 0.8 * plain, "{filtered} {plain}");
}
