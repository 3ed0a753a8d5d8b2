//! Shells: their geometry, and paths through them, against brute force in float64.

use fearless_simd::{Level, dispatch};
use glam::{DVec3, Mat3, Vec2, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg as Rng;
use taki::mapping::shell::{
    Beyond, EDGES, End, HullFace, LanePaths, LaneSegments, Segment, Shell, ShellFault, ShellPath, Side,
    SurfaceMesh,
};

/// A torus in the plane y = 0 with `n` × `m` quads, and thickness `h`. Its texture coordinates have seams.
pub fn torus(n: u32, m: u32, h: f32) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    for j in 0..=m {
        for i in 0..=n {
            // The vertices of both sides of a seam have the same bits.
            let [a, b] = [(i % n, n), (j % m, m)].map(|(k, n)| std::f32::consts::TAU * k as f32 / n as f32);
            let r = 2.0 + 0.7 * b.cos();
            mesh.positions.push(Vec3::new(r * a.cos(), 0.7 * b.sin(), r * a.sin()));
            mesh.uv.push(Vec2::new(4.0 * i as f32 / n as f32, 2.0 * j as f32 / m as f32));
            mesh.thickness.push(h);
        }
    }
    for j in 0..m {
        for i in 0..n {
            let at = |i: u32, j: u32| j * (n + 1) + i;
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// An octahedron whose faces are cut `levels` times into four, on the unit sphere.
pub fn sphere(levels: u32, h: f32) -> SurfaceMesh {
    let tips = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    let [x, y, z, nx, ny, nz] = tips;
    let mut faces = vec![
        [x, y, z],
        [y, nx, z],
        [nx, ny, z],
        [ny, x, z],
        [y, x, nz],
        [nx, y, nz],
        [ny, nx, nz],
        [x, ny, nz],
    ];
    for _ in 0..levels {
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| (p + q).normalize());
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let mut mesh = SurfaceMesh::default();
    for (i, face) in faces.iter().enumerate() {
        mesh.positions.extend(face);
        // Each triangle is an island of its own: all edges are seams.
        mesh.uv.extend([Vec2::ZERO, Vec2::new(0.4, 0.1), Vec2::new(0.1, 0.5)].map(|uv| uv + i as f32 * 0.37));
        mesh.thickness.extend([h; 3]);
        mesh.triangles.push([0, 1, 2].map(|k| 3 * i as u32 + k));
    }
    mesh
}

/// A bent strip with open ends, thinner towards one of them.
pub fn strip(n: u32) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    for i in 0..=n {
        let s = i as f32 / n as f32;
        let (sin, cos) = (2.5 * s).sin_cos();
        for side in [-0.5, 0.5] {
            mesh.positions.push(Vec3::new(1.5 * cos, side, 1.5 * sin));
            mesh.uv.push(Vec2::new(side + 0.5, 3.0 * s));
            mesh.thickness.push(0.3 - 0.2 * s);
        }
    }
    for i in 0..n {
        let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2];
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

fn shell(mesh: &SurfaceMesh) -> Shell {
    Shell::new(mesh, Side::Outward).expect("a valid mesh")
}

/// The interval of a line inside a tetrahedron, by its planes in float64.
pub fn interval(corners: [DVec3; 4], origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let mut t = [f64::NEG_INFINITY, f64::INFINITY];
    for k in 0..4 {
        let [a, b, c] = [1, 2, 3].map(|i| corners[(k + i) % 4]);
        let normal = (b - a).cross(c - a);
        // Towards the corner opposite the face.
        let normal = normal * normal.dot(corners[k] - a).signum();
        let (height, speed) = (normal.dot(origin - a), normal.dot(direction));
        if speed == 0.0 {
            if height < 0.0 {
                return None;
            }
        } else if speed > 0.0 {
            t[0] = t[0].max(-height / speed);
        } else {
            t[1] = t[1].min(-height / speed);
        }
    }
    (t[0] < t[1]).then_some(t)
}

/// Intervals of a line in all tetrahedra, in their order along it.
pub fn intervals(shell: &Shell, origin: Vec3, direction: Vec3) -> Vec<([f64; 2], [usize; 2])> {
    let mut all = Vec::new();
    for prism in 0..shell.prisms.len() {
        for k in 0..3 {
            let corners = shell.tetrahedron(prism, k).map(|p| shell.points[p as usize].as_dvec3());
            if let Some(t) = interval(corners, origin.as_dvec3(), direction.as_dvec3()) {
                all.push((t, [prism, k]));
            }
        }
    }
    all.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    all
}

/// Walks all parts of a line in a shell: from each face of the hull that the line enters through.
fn walked(shell: &Shell, origin: Vec3, direction: Vec3) -> Vec<Segment> {
    let mut parts: Vec<Vec<Segment>> = Vec::new();
    for face in &shell.hull {
        let [a, b, c] = shell.corners(face).map(|p| p.as_dvec3());
        let is_entry = (b - a).cross(c - a).dot(direction.as_dvec3()) < 0.0;
        if is_entry && ShellPath::meets(shell, face, origin, direction) {
            parts.push(ShellPath::new(shell, face, origin, direction).collect());
        }
    }
    parts.sort_by(|a, b| a[0].t[0].total_cmp(&b[0].t[0]));
    parts.concat()
}

fn ray(rng: &mut Rng, size: f32) -> (Vec3, Vec3) {
    let mut point = |size: f32| Vec3::from_array([(); 3].map(|()| rng.random_range(-size..size)));
    let (from, to) = (point(3.0 * size), point(size));
    (from, (to - from).normalize())
}

#[test]
fn a_path_passes_the_tetrahedra_that_brute_force_finds() {
    let mut rng = Rng::seed_from_u64(1);
    for (mesh, size) in [(torus(14, 9, 0.4), 2.5), (sphere(2, 0.3), 1.2), (strip(9), 1.8)] {
        let shell = shell(&mesh);
        let mut met = 0;
        for _ in 0..3000 {
            let (origin, direction) = ray(&mut rng, size);
            let exact = intervals(&shell, origin, direction);
            let path = walked(&shell, origin, direction);
            let sum = |t: f64, (from, to): (f64, f64)| t + (to - from);
            let length = exact.iter().map(|(t, _)| (t[0], t[1])).fold(0.0, sum);
            let own = path.iter().map(|s| (f64::from(s.t[0]), f64::from(s.t[1]))).fold(0.0, sum);
            // Coordinates of 7 m have steps of 5e-7. Faces at a tenth of a degree turn them into 3e-4 along
            // the ray.
            assert!((length - own).abs() < 1e-3, "{length} {own} {origin} {direction}");
            for (t, [prism, k]) in exact.iter().filter(|(t, _)| t[1] - t[0] > 1e-3) {
                met += 1;
                let found = path.iter().find(|s| [s.prism, s.tetrahedron] == [*prism, *k]).expect("passed");
                assert!((f64::from(found.t[0]) - t[0]).abs() < 1e-3, "{found:?} {t:?}");
                assert!((f64::from(found.t[1]) - t[1]).abs() < 1e-3, "{found:?} {t:?}");
                let [a, b] = found.at;
                let columns = shell.jacobian(*prism, *k).expect("mapped");
                let along = Mat3::from_cols(columns[0], columns[1], columns[2]) * (b - a);
                let way = direction * (found.t[1] - found.t[0]);
                assert!(along.abs_diff_eq(way, 2e-4), "{along} {way}");
                assert!(a.z >= 0.0 && b.z >= 0.0 && a.z <= 1.0 && b.z <= 1.0);
            }
        }
        assert!(met > 500, "{met}");
    }
}

#[test]
fn segments_begin_where_the_last_one_ended() {
    let mut rng = Rng::seed_from_u64(2);
    let shell = shell(&torus(14, 9, 0.4));
    let (mut joins, mut seams) = (0, 0);
    for _ in 0..3000 {
        let (origin, direction) = ray(&mut rng, 2.5);
        for pair in walked(&shell, origin, direction).windows(2) {
            if pair[0].end != End::Segment {
                continue;
            }
            assert_eq!(pair[0].t[1], pair[1].t[0]);
            let jump = pair[1].at[0] - pair[0].at[1];
            if jump.abs().max_element() < 1e-5 {
                joins += 1;
            } else {
                // A whole number of copies lies between the two sides of a seam of the torus.
                seams += 1;
                assert!(jump.abs_diff_eq(jump.round(), 1e-5), "{jump}");
            }
        }
    }
    assert!(joins > 1000 && seams > 50, "{joins} {seams}");
}

/// Length of a line in a convex body around the origin, given by the outward sides of its faces.
fn chord(planes: &[(DVec3, f64)], origin: DVec3, direction: DVec3) -> f64 {
    let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
    for &(normal, far) in planes {
        let (height, speed) = (normal.dot(origin) - far, normal.dot(direction));
        if speed == 0.0 {
            if height > 0.0 {
                return 0.0;
            }
        } else if speed < 0.0 {
            first = first.max(-height / speed);
        } else {
            last = last.min(-height / speed);
        }
    }
    (last - first).max(0.0)
}

#[test]
fn a_million_rays_at_edges_and_vertices_lose_and_count_nothing_twice() {
    let shell = shell(&sphere(1, 0.3));
    // Both surfaces are convex: the shell is one body without the other.
    let planes = |depth: u32| -> Vec<(DVec3, f64)> {
        let own = shell.hull.iter().filter(|face| face.points.iter().all(|p| p % 2 == depth));
        own.map(|face| {
            let [a, b, c] = shell.corners(face).map(|p| p.as_dvec3());
            let normal = (b - a).cross(c - a).normalize();
            let normal = normal * normal.dot(a).signum();
            (normal, normal.dot(a))
        })
        .collect()
    };
    let (outer, inner) = (planes(0), planes(1));
    assert_eq!((outer.len(), inner.len()), (32, 32));
    let mut rng = Rng::seed_from_u64(3);
    for i in 0..1_000_000u32 {
        let face = &shell.hull[rng.random_range(0..shell.hull.len())];
        let [a, b, c] = shell.corners(face);
        let at = match i % 3 {
            0 => a,
            1 => a + (b - a) * rng.random_range(0.0..1.0f32),
            // A diagonal of the side of a prism, or an edge of it.
            _ => c.lerp(a * rng.random_range(0.8..1.2f32), 0.5),
        };
        // Some rays run along axes of the mesh, where products are 0.
        let direction = match i % 5 {
            0 => [Vec3::X, Vec3::Y, Vec3::NEG_Z][i as usize / 5 % 3],
            _ => ray(&mut rng, 1.0).1,
        };
        let origin = at - direction * 4.0;
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let own: f64 = walked(&shell, origin, direction).iter().map(|s| f64::from(s.t[1] - s.t[0])).sum();
        // A ray may pass where float32 cannot tell it from its neighbours.
        let (x, y) = d.any_orthonormal_pair();
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        for k in 0..9 {
            let o = o + (x * f64::from(k % 3 - 1) + y * f64::from(k / 3 - 1)) * 1e-6;
            let exact = chord(&outer, o, d) - chord(&inner, o, d);
            (least, most) = (least.min(exact), most.max(exact));
        }
        assert!(least - 1e-5 < own && own < most + 1e-5, "{least} {own} {most}: {origin} {direction}");
    }
}

#[test]
fn a_path_from_inside_is_the_rest_of_the_path_from_outside() {
    let mut rng = Rng::seed_from_u64(4);
    let shell = shell(&torus(14, 9, 0.4));
    let mut compared = 0;
    for _ in 0..500 {
        let (origin, direction) = ray(&mut rng, 2.5);
        let whole = walked(&shell, origin, direction);
        for (i, s) in whole.iter().enumerate().filter(|(_, s)| s.t[1] - s.t[0] > 1e-2) {
            let middle = origin + direction * ((s.t[0] + s.t[1]) * 0.5);
            let path =
                ShellPath::inside(&shell, [s.prism, s.tetrahedron], middle, direction).expect("inside");
            let rest: Vec<_> = path.collect();
            let end = whole[i..].iter().position(|s| s.end != End::Segment).expect("an end") + i;
            let own = rest.last().expect("segments").t[1] - rest[0].t[0];
            assert!((own - (whole[end].t[1] - s.t[0])).abs() < 1e-3);
            assert!(rest[0].t[0] < 0.0 && rest[0].t[1] > 0.0);
            assert!(rest[0].at[0].abs_diff_eq(s.at[0], 1e-3));
            compared += 1;
        }
    }
    assert!(compared > 500, "{compared}");
}

#[test]
fn closed_meshes_have_no_walls_and_open_ones_do() {
    let torus = shell(&torus(14, 9, 0.4));
    assert_eq!(torus.points.len(), 2 * 14 * 9);
    assert_eq!(torus.hull.len(), 2 * torus.prisms.len());
    assert!(torus.prisms.iter().flat_map(|p| p.beyond).all(|beyond| beyond != Beyond::NOTHING));
    let strip = shell(&strip(9));
    // Nine quads: 18 triangles on either surface, and two triangles at each of the 20 edges of the border.
    assert_eq!(strip.hull.len(), 36 + 40);
    // Every edge of the hull has one triangle on either side.
    for shell in [&torus, &strip] {
        let mut turns = std::collections::HashMap::new();
        for [a, b, c] in shell.hull.iter().map(|face| face.points) {
            for edge in [[a, b], [b, c], [c, a]] {
                assert_eq!(turns.insert(edge, ()), None, "{edge:?} twice");
            }
        }
        assert!(turns.keys().all(|&[a, b]| turns.contains_key(&[b, a])));
        assert!(shell.prisms.iter().all(|p| EDGES.len() == p.beyond.len() && p.vertices.is_sorted()));
    }
}

#[test]
fn three_triangles_at_an_edge_end_there() {
    let mut mesh = SurfaceMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::NEG_Y, Vec3::Z],
        uv: vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::NEG_Y, Vec2::ONE],
        thickness: vec![0.1; 5],
        triangles: vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]],
    };
    assert_eq!(shell(&mesh).hull.len(), 3 * (2 + 6));
    mesh.triangles.pop();
    assert_eq!(shell(&mesh).hull.len(), 2 * (2 + 4));
}

#[test]
fn shells_thicker_than_the_radius_turn_over() {
    let turned = |mesh: SurfaceMesh, side| {
        let shell = Shell::new(&mesh, side).expect("a shell");
        (shell.turned_over(), shell.prisms.len())
    };
    // The inner surface of a unit sphere passes its centre where the shell is thicker than 1.
    for (thickness, is_turned) in [(0.5, false), (0.9, false), (1.1, true), (3.0, true)] {
        let (count, all) = turned(sphere(3, thickness), Side::Inward);
        assert_eq!(count, if is_turned { all } else { 0 }, "{thickness}");
    }
    assert_eq!(turned(sphere(3, 3.0), Side::Outward).0, 0);
    // A torus whose tube has the radius 0.7 turns over where its shell is thicker than that.
    assert_eq!(turned(torus(60, 40, 0.6), Side::Inward).0, 0);
    let (count, all) = turned(torus(60, 40, 0.8), Side::Inward);
    assert_eq!(count, all);
}

#[test]
fn an_inward_shell_lies_under_its_mesh() {
    let mesh = sphere(2, 0.25);
    for (side, depth, other) in [(Side::Outward, 1, 1.25), (Side::Inward, 0, 0.75)] {
        let shell = Shell::new(&mesh, side).expect("valid");
        for (i, point) in shell.points.iter().enumerate() {
            // Normals of the cut octahedron point almost away from its centre.
            let (radius, slack) = if i % 2 == depth { (1.0, 1e-6) } else { (other, 4e-3) };
            assert!((point.length() - radius).abs() < slack, "{side:?}: {i} {point}");
        }
    }
}

#[test]
fn meshes_that_carry_no_shell_are_refused() {
    let fault = |change: &dyn Fn(&mut SurfaceMesh)| {
        let mut mesh = strip(2);
        change(&mut mesh);
        Shell::new(&mesh, Side::Outward).expect_err("no shell")
    };
    assert_eq!(fault(&|mesh| mesh.triangles.clear()), ShellFault::Empty);
    assert_eq!(fault(&|mesh| mesh.positions.fill(Vec3::ONE)), ShellFault::Empty);
    assert_eq!(fault(&|mesh| mesh.uv.fill(Vec2::ONE)), ShellFault::Unmapped);
    assert_eq!(fault(&|mesh| mesh.positions[1].y = f32::NAN), ShellFault::NotFinite);
    assert_eq!(fault(&|mesh| mesh.uv[1].y = f32::INFINITY), ShellFault::NotFinite);
    assert_eq!(fault(&|mesh| mesh.thickness[1] = -0.1), ShellFault::NotFinite);
}

/// Largest angle between the frame's axes along the mesh and those of the smooth torus, radians.
fn frame_error(n: u32, m: u32) -> f64 {
    let mesh = torus(n, m, 0.3);
    let shell = Shell::new(&mesh, Side::Outward).expect("a valid mesh");
    let mut most = 0.0f64;
    for (i, prism) in shell.prisms.iter().enumerate() {
        for shares in [Vec3::splat(1.0 / 3.0), Vec3::new(0.5, 0.5, 0.0), Vec3::new(0.1, 0.2, 0.7), Vec3::X] {
            let uv = prism.uv[0] * shares.x + prism.uv[1] * shares.y + prism.uv[2] * shares.z;
            let [a, b] = [uv.x / 4.0, uv.y / 2.0].map(|t| f64::from(t) * std::f64::consts::TAU);
            let along_u = DVec3::new(-a.sin(), 0.0, a.cos());
            let along_v = DVec3::new(-b.sin() * a.cos(), b.cos(), -b.sin() * a.sin());
            for depth in [0.0, 0.5, 1.0] {
                let [u, v, _] = shell.frame(i, shares, depth).map(|axis| axis.as_dvec3());
                most = most.max(u.angle_between(along_u)).max(v.angle_between(along_v));
            }
        }
    }
    most
}

#[test]
fn frames_of_light_come_to_those_of_the_smooth_surface_with_the_square_of_the_edges() {
    let errors = [1, 2, 4].map(|k| frame_error(16 * k, 10 * k));
    // Those of the facets would halve.
    assert!(errors[1] < errors[0] / 3.5 && errors[2] < errors[1] / 3.5, "{errors:?}");
    assert!(errors[2] < 0.01, "{errors:?}");
}

#[test]
fn frames_of_light_keep_edges_and_turned_seams() {
    // Two squares that meet along z; the texture of the second goes on from that of the first, or is turned
    // by 90°.
    let corners = [[0, 0], [1, 0], [1, 1], [0, 1], [1, 0], [2, 0], [2, 1], [1, 1]];
    let charts = [[[1, 0], [2, 0], [2, 1], [1, 1]], [[0, 0], [0, 1], [-1, 1], [-1, 0]]];
    for (fold, chart) in [(90.0f32, 0), (0.0, 1), (1.0, 1), (90.0, 1)] {
        let turn = Mat3::from_rotation_z(fold.to_radians());
        let place = |i: usize| {
            let [x, y] = corners[i].map(|c| c as f32);
            let flat = Vec3::new(x, 0.0, -y);
            if i < 4 { flat } else { Vec3::X + turn * (flat - Vec3::X) }
        };
        let uv = corners[..4].iter().chain(&charts[chart]).map(|uv| Vec2::from(uv.map(|c| c as f32)));
        let mesh = SurfaceMesh {
            positions: (0..8).map(place).collect(),
            uv: uv.collect(),
            thickness: vec![0.1; 8],
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
        };
        let shell = Shell::new(&mesh, Side::Inward).expect("a valid mesh");
        let second = if chart == 0 { [turn * Vec3::X, Vec3::NEG_Z] } else { [Vec3::Z, turn * Vec3::X] };
        for prism in 0..4 {
            let want = if prism < 2 { [Vec3::X, Vec3::NEG_Z] } else { second };
            for shares in [Vec3::X, Vec3::Y, Vec3::Z] {
                let [u, v, _] = shell.frame(prism, shares, 0.0);
                let error = u.distance(want[0]) + v.distance(want[1]);
                assert!(error < 1e-6, "fold {fold}, chart {chart}, prism {prism}: {u} {v} not {want:?}");
            }
        }
    }
}

/// A ray at an edge, a vertex or any other place of a hull's face.
fn aimed(rng: &mut Rng, shell: &Shell) -> (HullFace, Vec3, Vec3) {
    let face = shell.hull[rng.random_range(0..shell.hull.len())];
    let [a, b, c] = shell.corners(&face);
    let at = match rng.random_range(0..4) {
        0 => a,
        1 => a + (b - a) * 0.5,
        _ => a + (b - a) * rng.random_range(0.0..0.5f32) + (c - a) * rng.random_range(0.0..0.5f32),
    };
    let direction = match rng.random_range(0..4) {
        0 => [Vec3::X, Vec3::Y, Vec3::NEG_Z][rng.random_range(0..3)],
        _ => ray(rng, 1.0).1,
    };
    (face, at - direction * rng.random_range(0.0..2.0f32), direction)
}

#[test]
fn eight_paths_side_by_side_are_those_of_each_ray_alone() {
    let mut rng = Rng::seed_from_u64(8);
    let shells = [shell(&sphere(1, 0.3)), shell(&torus(14, 9, 0.35)), shell(&strip(9))];
    let mut compared = 0;
    for _ in 0..4000 {
        let rays: [_; 8] = std::array::from_fn(|_| {
            let shell = &shells[rng.random_range(0..shells.len())];
            let (face, origin, direction) = aimed(&mut rng, shell);
            ShellPath::new(shell, &face, origin, direction)
        });
        let mut paths = LanePaths::default();
        let mut bits = 0u8;
        for (lane, path) in rays.iter().enumerate() {
            bits |= u8::from(paths.start(lane, path)) << lane;
        }
        let mut alone = rays.clone();
        let mut side_by_side = LaneSegments::default();
        while bits != 0 {
            let goes_on = dispatch!(Level::new(), simd => paths.next(simd, bits, &mut side_by_side));
            for lane in (0..8).filter(|lane| bits >> lane & 1 == 1) {
                let own = alone[lane].next().expect("a segment");
                let LaneSegments { prism, tetrahedron, t, at, shares, end } = &side_by_side;
                let seen = Segment {
                    prism: prism[lane],
                    tetrahedron: tetrahedron[lane],
                    t: [t[0].0[lane], t[1].0[lane]],
                    at: [at[0].get(lane), at[1].get(lane)],
                    shares: [shares[0].get(lane), shares[1].get(lane)],
                    end: end[lane],
                };
                assert_eq!(seen, own);
                assert_eq!(goes_on >> lane & 1 == 1, own.end == End::Segment);
                compared += 1;
            }
            bits = goes_on;
        }
        assert!(alone.iter_mut().all(|path| path.next().is_none()));
    }
    assert!(compared > 100_000, "{compared}");
}

#[test]
fn a_point_below_a_triangle_lies_in_its_tetrahedron_at_its_shares_and_depth() {
    let shell = shell(&torus(14, 9, 0.35));
    let rng = &mut Rng::seed_from_u64(8);
    for _ in 0..2000 {
        let prism = rng.random_range(0..shell.prisms.len());
        let [s, t]: [f32; 2] = [rng.random(), rng.random()];
        let [s, t] = if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
        let shares = Vec3::new(1.0 - s - t, s, t);
        let depth = rng.random_range(0.01..0.99);
        let (point, [own, tetrahedron]) = shell.below_triangle(prism, shares, depth);
        assert_eq!(own, prism);
        // The path through the point passes it with these shares.
        let direction = ray(rng, 1.0).1;
        let path = ShellPath::inside(&shell, [prism, tetrahedron], point, direction).expect("a path");
        let segment = { path }.next().expect("a segment");
        assert!(segment.t[0] <= 0.0 && segment.t[1] >= -1e-4, "{segment:?}");
        let along = -segment.t[0] / (segment.t[1] - segment.t[0]).max(1e-9);
        let near = |a: f32, b: f32| (a - b).abs() < 2e-3;
        let seen = segment.shares[0].lerp(segment.shares[1], along);
        assert!((0..3).all(|k| near(seen[k], shares[k])), "{seen} not {shares}");
        assert!(near(segment.at[0].lerp(segment.at[1], along).z, depth), "{segment:?} {depth}");
    }
}
