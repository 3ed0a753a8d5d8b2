//! Shadows of opaque matter on shells: their values at vertices against closed forms and brute force, and
//! what they make of the picture.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use taki::Unwatched;
use taki::light::{Light, Visibility};
use taki::mapping::shell::{Shell, Side, SurfaceMesh};
use taki::picture::Camera;
use taki::place::{MeshShade, ShellShadows, Triangles, Vertex};
use taki::scene::Scene;

use super::closed_forms::{noise, uniform};
use super::shells::{compare, render, scene, scene_with, shell};
use crate::mapping::shell::{intervals, sphere, torus};

/// Opaque triangles in the place of quads.
pub fn walls(quads: &[[Vec3; 4]]) -> Triangles {
    let vertex = |p: Vec3| Vertex { position: p.to_array(), normal: [0.0, 0.0, 1.0], ..Default::default() };
    let corners = quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d].map(vertex));
    Triangles {
        vertices: Arc::new(corners.collect()),
        holdout: false,
        shade: MeshShade::default(),
        painting: None,
    }
}

/// Matter of a thickness on the plane y = 0, from −2 to 2 m along x and z, in squares of a side.
fn meadow(squares: u32, thickness: f32) -> Shell {
    let mut mesh = SurfaceMesh::default();
    for j in 0..=squares {
        for i in 0..=squares {
            let [s, t] = [i, j].map(|k| k as f32 / squares as f32);
            mesh.positions.push(Vec3::new(4.0 * s - 2.0, 0.0, 4.0 * t - 2.0));
            mesh.uv.push(Vec2::new(4.0 * s, 4.0 * t));
            mesh.thickness.push(thickness);
        }
    }
    for j in 0..squares {
        for i in 0..squares {
            let at = |i: u32, j: u32| j * (squares + 1) + i;
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    shell(&mesh, Side::Outward)
}

/// A wall of 1 m in the plane x = 1.
fn wall() -> Triangles {
    let corner = |y: f32, z: f32| Vec3::new(1.0, y, z);
    walls(&[[corner(-1.0, -9.0), corner(1.0, -9.0), corner(1.0, 9.0), corner(-1.0, 9.0)]])
}

fn sun(to_light: [f32; 3]) -> Light {
    Light::Directional { to_light: Vec3::from(to_light).normalize(), intensity: Vec3::ONE }
}

fn lamp(position: [f32; 3]) -> Light {
    Light::Point { position: position.into(), intensity: Vec3::ONE }
}

fn shadows(scene: &Scene) -> Option<Arc<ShellShadows>> {
    scene.shadows_on_shells(&scene.mesh(), &Unwatched).expect("nobody stops it")
}

#[test]
fn a_wall_hides_lights_from_the_vertices_in_its_shadow() {
    let (side, thickness) = (0.1, 0.2);
    let mut scene = scene(meadow(40, thickness), [0.0, 3.0, 3.0]);
    let (left, right) = (lamp([0.9, 3.0, 0.0]), lamp([3.0, 3.0, 0.0]));
    scene.edit().lights = vec![sun([1.0, 1.0, 0.0]), left, right];
    scene.edit().triangles = vec![wall()];
    let shadows = shadows(&scene).expect("a shadow");
    let own = &scene.shells[0];
    let mut counts = [[0; 2]; 3];
    for (light, counts) in counts.iter_mut().enumerate() {
        // Whether the ray from a point passes below the top of the wall.
        let is_dark = |x: f32, y: f32| {
            let height = match light {
                0 => y + (1.0 - x),
                1 => return false,
                _ => y + (3.0 - y) * (1.0 - x) / (3.0 - x),
            };
            x < 1.0 && height < 1.0
        };
        for (vertex, shares) in shadows.of(0, light).iter().enumerate() {
            let x = own.points[2 * vertex].x;
            for (surface, &share) in shares.iter().enumerate() {
                let y = thickness * [0.99, 0.01][surface];
                // Rays start within one square of the vertex.
                let around = [x - side, x, x + side].map(|x| is_dark(x, y));
                if around == [around[0]; 3] && (x - 1.0).abs() > side {
                    assert_eq!(share, if around[0] { 0.0 } else { 1.0 }, "light {light}, {x}, {y}");
                    counts[usize::from(around[0])] += 1;
                }
            }
        }
    }
    assert!(counts[0][0] > 1000 && counts[0][1] > 500 && counts[2][1] > 500, "{counts:?}");
    assert!(counts[1][0] > 2000 && counts[1][1] == 0, "{counts:?}");
}

#[test]
fn a_thin_post_between_vertices_takes_as_much_light_as_it_is_wide() {
    // Squares of 20 cm, and a post of 5 cm whose shadow lies between two rows of vertices.
    let mut scene = scene(meadow(20, 0.02), [0.0, 3.0, 3.0]);
    scene.edit().lights = vec![sun([1.0, 1.0, 0.0])];
    let corner = |y: f32, z: f32| Vec3::new(1.0, y, z);
    let post = [corner(-1.0, 0.08), corner(9.0, 0.08), corner(9.0, 0.13), corner(-1.0, 0.13)];
    scene.edit().triangles = vec![walls(&[post])];
    let shadows = shadows(&scene).expect("a shadow");
    let own = &scene.shells[0];
    let mut lost = 0.0;
    for (vertex, [outer, _]) in shadows.of(0, 0).iter().enumerate() {
        let at = own.points[2 * vertex];
        if at.x > -1.7 && at.x < 0.7 {
            lost += f64::from(1.0 - outer) * 0.2 * 0.2;
        }
    }
    let want = 0.05 * 12.0 * 0.2;
    assert!((lost - want).abs() < 0.2 * want, "{lost} m², not {want}");
}

/// Whether a ray meets the inner surface of a shell, and how far away, by its planes in float64.
fn skin_ahead(shell: &Shell, origin: DVec3, d: DVec3) -> Option<f64> {
    let meets = |prism: &taki::mapping::shell::Prism| {
        let [a, b, c] = prism.vertices.map(|v| shell.points[2 * v as usize + 1].as_dvec3());
        let normal = (b - a).cross(c - a);
        let t = normal.dot(a - origin) / normal.dot(d);
        let p = origin + d * t;
        let sides = [[a, b], [b, c], [c, a]].map(|[p0, p1]| (p1 - p0).cross(p - p0).dot(normal) >= 0.0);
        (t > 0.0 && sides == [sides[0]; 3] && sides[0]).then_some(t)
    };
    shell.prisms.iter().filter_map(meets).reduce(f64::min)
}

/// Whether a point sees the sun past the skin, as [`skin_ahead`] finds; `None` where the ray does not leave
/// the shell before it meets the skin.
fn is_open(shell: &Shell, point: DVec3, to_sun: DVec3) -> Option<bool> {
    let Some(skin) = skin_ahead(shell, point, to_sun) else { return Some(true) };
    let mut end = 0.0;
    for ([from, to], _) in intervals(shell, point.as_vec3(), to_sun.as_vec3()) {
        if to > end && from < end + 1e-5 {
            end = to;
        }
    }
    (skin > end + 1e-4).then_some(false)
}

#[test]
fn the_far_inside_of_a_ring_is_dark_under_a_low_sun() {
    let mut ring = shell(&torus(40, 20, 0.2), Side::Outward);
    ring.skin = true;
    let mut scene = scene(ring, [0.5, 4.5, 3.0]);
    let to_sun = Vec3::new(1.0, 0.12, 0.0).normalize();
    scene.edit().lights = vec![sun([1.0, 0.12, 0.0])];
    let shadows = shadows(&scene).expect("a shadow");
    let own = &*scene.shells[0];
    let (mut compared, mut far_inside) = ([0; 2], 0);
    // Every third vertex; brute force takes long.
    for vertex in (0..own.vertices()).step_by(3) {
        let around = own.prisms.iter().filter(|prism| prism.vertices.contains(&(vertex as u32)));
        let around: Vec<_> = around.collect();
        for (surface, depth) in [0.01, 0.99].into_iter().enumerate() {
            let mut seen = Vec::new();
            for prism in &around {
                for (i, j) in (0..5).flat_map(|i| (0..5 - i).map(move |j| (i, j))) {
                    let shares = [i as f64, j as f64, (4 - i - j) as f64].map(|k| (k + 0.15) / 4.45);
                    let point = (prism.vertices.iter().zip(shares))
                        .map(|(&v, share)| {
                            let [outer, inner] = [0, 1].map(|k| own.points[2 * v as usize + k].as_dvec3());
                            (outer + (inner - outer) * depth) * share
                        })
                        .sum::<DVec3>();
                    seen.extend(is_open(own, point, to_sun.as_dvec3()));
                }
            }
            if !seen.is_empty() && seen.iter().all(|open| *open == seen[0]) {
                let share = shadows.of(0, 0)[vertex][surface];
                let at = own.points[2 * vertex];
                assert_eq!(share, if seen[0] { 1.0 } else { 0.0 }, "vertex {vertex} at {at}, {surface}");
                compared[usize::from(seen[0])] += 1;
                let faces_sun = own.points[2 * vertex] - own.points[2 * vertex + 1];
                far_inside += usize::from(at.x < -1.0 && faces_sun.x > 0.1 && at.y.abs() < 0.3 && !seen[0]);
            }
        }
    }
    assert!(compared[0] > 60 && compared[1] > 200 && far_inside > 5, "{compared:?} {far_inside}");
}

#[test]
fn pixels_behind_a_wall_are_those_of_a_tracer_in_float64() {
    let volume = noise([6, 8, 5], 4);
    let l = Vec3::new(1.0, 2.0, 0.5).normalize();
    let (u, v) = l.any_orthonormal_pair();
    // The wall is out of the picture, and behind the lamp.
    let corner = |a: f32, b: f32| l * 6.0 + u * a + v * b;
    let half = [corner(0.0, -6.0), corner(6.0, -6.0), corner(6.0, 6.0), corner(0.0, 6.0)];
    for (shell, eye) in [
        (shell(&torus(14, 9, 0.35), Side::Outward), [0.5, 4.5, 3.0]),
        (shell(&sphere(2, 0.4), Side::Outward), [1.0, 2.0, 2.6]),
    ] {
        let mut scene = scene(shell, eye);
        assert!(shadows(&scene).is_none());
        let open = render(&scene, &volume);
        scene.edit().triangles = vec![walls(&[half])];
        let own = shadows(&scene).expect("a shadow");
        let dark = own.of(0, 0).iter().filter(|share| **share == [0.0; 2]).count();
        assert!(dark * 10 > own.of(0, 0).len(), "{dark}");
        assert!(own.of(0, 1).iter().all(|share| *share == [1.0; 2]), "the lamp is nearer than the wall");
        let share = compare(&scene, &volume, |_, _| None);
        assert!(share > 0.1, "{share}");
        assert_ne!(open, render(&scene, &volume));
    }
}

#[test]
fn a_meadow_is_lit_beside_the_shadow_of_a_wall_and_not_in_it() {
    let (side, thickness) = (0.1f64, 0.05f64);
    for sets in [
        &["light.visibility=march"][..],
        &["light.visibility=cached"],
        &["light.visibility=cached", "trace.filter=pyramid"],
    ] {
        let mut with_wall = scene_with(meadow(40, thickness as f32), [0.0, 4.0, 0.01], sets);
        let volume = uniform([8, 8, 4], Vec3::Y, 0.6, 0.5, 0.5);
        with_wall.edit().lights = vec![sun([1.0, 1.0, 0.0])];
        with_wall.edit().triangles.clear();
        let lit = render(&with_wall, &volume);
        with_wall.edit().lights.clear();
        let unlit = render(&with_wall, &volume);
        with_wall.edit().lights = vec![sun([1.0, 1.0, 0.0])];
        with_wall.edit().triangles = vec![wall()];
        let own = render(&with_wall, &volume);
        let image = &with_wall.image;
        let [forward, right, up] = with_wall.camera.rays(image.width, image.height);
        let eye = with_wall.camera.eye_local();
        let mut counts = [0; 2];
        for i in 0..own.len() {
            let pixel = [i as u32 % image.width, i as u32 / image.width];
            let at = Camera::image_point(image.width, image.height, pixel, [0.5; 2]).as_dvec2();
            let d = forward + right * at.x + up * at.y;
            // Where the ray enters the shell and where it leaves it.
            let x = [thickness, 0.0].map(|y| (eye + d * ((y - eye.y) / d.y)).x);
            let [low, high] = [x[0].min(x[1]) - 2.0 * side, x[0].max(x[1]) + 2.0 * side];
            let near =
                |a: [f32; 4], b: [f32; 4]| (0..3).all(|c| (a[c] - b[c]).abs() <= 1e-4 * b[c].max(0.05));
            // The wall itself is seen from above as a line.
            if high < 0.0 || (low > 1.0 + side) {
                assert!(near(own[i], lit[i]), "{sets:?} {x:?}: {:?} not {:?}", own[i], lit[i]);
                counts[0] += 1;
            } else if low > thickness && high < 1.0 {
                assert!(near(own[i], unlit[i]), "{sets:?} {x:?}: {:?} not {:?}", own[i], unlit[i]);
                counts[1] += usize::from(lit[i][0] > 1.1 * unlit[i][0]);
            }
        }
        assert!(counts[0] > 200 && counts[1] > 100, "{counts:?}");
    }
}

#[test]
fn nothing_is_hidden_without_casters_or_by_a_convex_body_or_without_visibility() {
    let plain = scene(shell(&torus(14, 9, 0.35), Side::Outward), [0.5, 4.5, 3.0]);
    assert!(shadows(&plain).is_none());
    let mut ball = shell(&sphere(3, 0.4), Side::Outward);
    ball.skin = true;
    assert!(shadows(&scene(ball, [1.0, 2.0, 2.6])).is_none());
    let mut ring = plain.clone();
    let mut furred = (*plain.shells[0]).clone();
    furred.skin = true;
    ring.edit().shells = vec![Arc::new(furred)];
    ring.edit().lights = vec![sun([1.0, 0.12, 0.0])];
    assert!(shadows(&ring).is_some());
    ring.edit().visibility = Visibility::None;
    assert!(shadows(&ring).is_none());
    ring.edit().visibility = Visibility::March;
    ring.edit().lights.clear();
    assert!(shadows(&ring).is_none());
}

#[test]
fn shadows_are_kept_while_mesh_shells_and_lights_stay() {
    let mut scene = scene(meadow(10, 0.1), [0.0, 3.0, 3.0]);
    scene.edit().lights = vec![sun([1.0, 1.0, 0.0])];
    scene.edit().triangles = vec![wall()];
    let mesh = scene.mesh();
    let of =
        |scene: &Scene| scene.shadows_on_shells(&mesh, &Unwatched).expect("nobody stops it").expect("one");
    let first = of(&scene);
    scene.edit().camera.eye.x += 1.0;
    scene.edit().lights[0] = scene.lights[0].with_intensity(Vec3::splat(2.0));
    assert!(Arc::ptr_eq(&first, &of(&scene)));
    scene.edit().lights[0] = sun([1.0, 0.5, 0.0]);
    let other = of(&scene);
    assert!(!Arc::ptr_eq(&first, &other) && first != other);
}
