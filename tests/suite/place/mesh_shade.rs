//! Shade and wetness of meshes: closed forms (float64), cracks, threads, memory and parity of the engines.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use taki::place::{SHADE_VERSION, Vertex, wet_albedo, wetness};
use taki::scene::Scene;
use taki::util::cache::Cache;
use tempfile::tempdir;

use crate::engine::gpu::{assert_parity, both, renderer};
use crate::scene::meshes::{Folder, PLACE};

/// Text of an OBJ file: corners and faces, counted from 0.
#[derive(Default)]
struct Obj {
    points: Vec<DVec3>,
    faces: Vec<Vec<usize>>,
}

impl Obj {
    fn face(mut self, corners: [[f64; 3]; 4]) -> Obj {
        let first = self.points.len();
        self.points.extend(corners.map(DVec3::from));
        self.faces.push((first..first + 4).collect());
        self
    }

    /// A level square that faces up.
    fn floor(self, half: f64) -> Obj {
        let h = half;
        self.face([[-h, 0.0, h], [h, 0.0, h], [h, 0.0, -h], [-h, 0.0, -h]])
    }

    /// A box whose corners are shared by its faces.
    fn cuboid(mut self, low: DVec3, high: DVec3) -> Obj {
        let first = self.points.len();
        for i in 0..8 {
            let pick = |bit: usize, axis: usize| if i >> bit & 1 == 1 { high[axis] } else { low[axis] };
            self.points.push(DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2)));
        }
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        self.faces.extend(faces.map(|face| face.map(|i| first + i).to_vec()));
        self
    }

    /// A ball of `rows` rows, whose points lie on a sphere.
    fn ball(mut self, middle: DVec3, radius: f64, rows: usize) -> Obj {
        let (first, columns) = (self.points.len(), 2 * rows);
        for j in 0..=rows {
            let polar = j as f64 / rows as f64 * PI;
            for i in 0..columns {
                let turn = i as f64 / columns as f64 * TAU;
                // The points of a pole are one.
                let sin = if j % rows == 0 { 0.0 } else { polar.sin() };
                let cos = polar.cos();
                self.points.push(middle + radius * DVec3::new(sin * turn.sin(), cos, sin * turn.cos()));
            }
        }
        for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
            let at = |di: usize, dj: usize| first + (j + dj) * columns + (i + di) % columns;
            match j {
                0 => self.faces.push(vec![at(0, 0), at(0, 1), at(1, 1)]),
                j if j + 1 == rows => self.faces.push(vec![at(0, 0), at(0, 1), at(1, 0)]),
                _ => self.faces.push(vec![at(0, 0), at(0, 1), at(1, 1), at(1, 0)]),
            }
        }
        self
    }

    fn text(&self) -> String {
        let points = self.points.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
        let faces = self.faces.iter().map(|face| {
            let numbers: Vec<String> = face.iter().map(|i| (i + 1).to_string()).collect();
            format!("f {}\n", numbers.join(" "))
        });
        points.chain(faces).collect()
    }
}

const MESH: &str = "[meshes.a]\nfile = \"a.obj\"\ncolor = [0.3, 0.3, 0.3]\n";
const SUN: &str = "lights.key.direction=[0.6,0.8,0]";

fn scene(obj: &Obj, more: &str, sets: &[&str]) -> Scene {
    let folder = Folder::new();
    folder.write("a.obj", obj.text());
    folder.scene(&format!("{PLACE}{MESH}{more}"), sets)
}

/// Vertices that lie on the floor and face up.
fn on_floor(scene: &Scene) -> Vec<Vertex> {
    let all = scene.mesh();
    let is_floor = |v: &&Vertex| v.position[1] == 0.0 && v.normal[1] > 0.999;
    all.vertices.iter().filter(is_floor).copied().collect()
}

#[test]
fn a_ball_on_a_floor_hides_of_the_sky_what_its_form_factor_says() {
    let (r, half) = (0.5, 2.0);
    for h in [0.5, 0.9] {
        let ball = Obj::default().floor(half).ball(DVec3::Y * h, r, 48);
        let floor = on_floor(&scene(&ball, "", &[]));
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for vertex in &floor {
            let [x, _, z] = vertex.position.map(f64::from);
            let away = x.hypot(z);
            if !(0.06..=1.8).contains(&away) {
                continue;
            }
            let d2 = away * away + h * h;
            // A sphere that is wholly above the horizon: (r/d)²·cos θ (Howell, Mengüç, Daun and Siegel 2020).
            let truth = r * r / d2 * h / d2.sqrt();
            let error = f64::from(vertex.occlusion) - truth;
            assert!(error.abs() < 0.06, "{h}: {away}: {} {truth}", vertex.occlusion);
            (sum, squares, count) = (sum + error, squares + error * error, count + 1.0);
        }
        let (mean, rms) = (sum / count, f64::sqrt(squares / count));
        assert!(count > 1000.0 && mean.abs() < 0.004 && rms < 0.015, "{count} {mean} {rms}");
    }
}

#[test]
fn a_corner_of_high_walls_leaves_a_quarter_of_the_sky_and_half_the_strength_half_the_loss() {
    let walls = Obj::default()
        .face([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        .face([[0.0, 0.0, 60.0], [0.0, 0.0, 0.0], [0.0, 60.0, 0.0], [0.0, 60.0, 60.0]])
        .face([[0.0, 0.0, 0.0], [60.0, 0.0, 0.0], [60.0, 60.0, 0.0], [0.0, 60.0, 0.0]]);
    // The floor is a mesh of its own, so that it is fine.
    let floor = Obj { points: walls.points[..4].to_vec(), faces: walls.faces[..1].to_vec() };
    let walls = Obj {
        points: walls.points[4..].to_vec(),
        faces: walls.faces[1..].iter().map(|face| face.iter().map(|i| i - 4).collect()).collect(),
    };
    let folder = Folder::new();
    folder.write("a.obj", floor.text());
    folder.write("b.obj", walls.text());
    let text = format!("{PLACE}{MESH}[meshes.b]\nfile = \"b.obj\"\n");
    let of = |sets: &[&str]| on_floor(&folder.scene(&text, sets));
    let [whole, half, none, alone] = [
        &[][..],
        &["meshes.a.occlusion=0.5"],
        &["meshes.a.occlusion=0"],
        &["meshes.b.occlusion=0", "meshes.b.shadow=0"],
    ]
    .map(of);
    assert!(whole.len() > 1000 && whole.len() == half.len());
    for (whole, half) in whole.iter().zip(&half) {
        // Some six triangles with 16 rays each meet in a vertex, and two or three on the floor's border.
        let [x, _, z] = whole.position;
        let is_inside = [x, z].iter().all(|c| (0.002..0.998).contains(c));
        let bound = if is_inside { 0.09 } else { 0.15 };
        assert!((whole.occlusion - 0.75).abs() < bound, "{whole:?}");
        assert_eq!(half.occlusion, 0.5 * whole.occlusion);
    }
    let mean = whole.iter().map(|v| v.occlusion).sum::<f32>() / whole.len() as f32;
    // Walls of 60 m leave open what endless ones would not: 0.7452 is the exact mean on the floor.
    assert!((mean - 0.7452).abs() < 0.003, "{mean}");
    assert!(none.iter().chain(&alone).all(|vertex| vertex.occlusion == 0.0));
}

#[test]
fn the_shadow_of_a_ball_is_an_ellipse() {
    let (r, h) = (0.5, 1.5);
    let ball = Obj::default().floor(2.5).ball(DVec3::Y * h, r, 64);
    let floor = on_floor(&scene(&ball, "", &[SUN, "meshes.a.shadow=0.8"]));
    let middle = -h * 0.6 / 0.8;
    let spacing = 5.0 / 256.0;
    let (mut inside, mut outside) = (0, 0);
    for vertex in &floor {
        let [x, _, z] = vertex.position.map(f64::from);
        // Across the light the ball is a disc.
        let away = ((x - middle) * 0.8).hypot(z);
        if away < 0.995 * r - 1.5 * spacing {
            assert_eq!(vertex.shadow, 0.8, "{x} {z}");
            inside += 1;
        } else if away > r + 1.5 * spacing {
            assert_eq!(vertex.shadow, 0.0, "{x} {z}");
            outside += 1;
        } else {
            // A slope of two triangles to both sides.
            let reached =
                f64::from(vertex.shadow) / 0.8 - (0.5 + (r - away) / (2.0 * spacing)).clamp(0.0, 1.0);
            assert!(reached.abs() < 0.4, "{x} {z}: {}", vertex.shadow);
        }
    }
    assert!(inside > 1000 && outside > 1000, "{inside} {outside}");
    let mut corners: HashMap<[u32; 3], f32> = HashMap::new();
    corners.extend(floor.iter().map(|v| (v.position.map(f32::to_bits), v.shadow)));
    let area = corners.values().sum::<f32>() as f64 / 0.8 * spacing * spacing;
    let truth = PI * r * r / 0.8;
    assert!((area / truth - 1.0).abs() < 0.01, "{area} {truth}");
}

/// Times that each edge is used in each direction, by the positions of its ends.
fn edges(vertices: &[Vertex]) -> HashMap<[[u32; 3]; 2], i32> {
    let mut edges = HashMap::new();
    for corners in vertices.as_chunks::<3>().0 {
        let at = corners.map(|v| v.position.map(|c| (c + 0.0).to_bits()));
        for i in 0..3 {
            *edges.entry([at[i], at[(i + 1) % 3]]).or_insert(0) += 1;
        }
    }
    edges
}

fn area(vertices: &[Vertex]) -> f64 {
    let of = |corners: &[Vertex; 3]| {
        let [a, b, c] = corners.map(|v| Vec3::from(v.position).as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    };
    vertices.as_chunks::<3>().0.iter().map(of).sum()
}

#[test]
fn triangles_made_finer_leave_no_crack_and_no_vertex_on_an_edge() {
    let closed = Obj::default().cuboid(DVec3::new(-3.1, -0.2, -0.77), DVec3::new(2.9, 0.13, 1.3)).ball(
        DVec3::new(9.0, 1.0, 0.0),
        1.7,
        7,
    );
    let scene = scene(&closed, "", &[]);
    let (before, after) = (&scene.triangles[0].vertices, scene.mesh().vertices);
    assert!(after.len() > 20 * before.len(), "{} {}", before.len(), after.len());
    let edges = edges(&after);
    // On a closed surface an edge is used once each way.
    assert!(edges.iter().all(|([a, b], count)| *count == 1 && edges.get(&[*b, *a]) == Some(&1)));
    let (old, new) = (area(before), area(&after));
    assert!((new / old - 1.0).abs() < 1e-6, "{old} {new}");
    let size = [Vec3::min, Vec3::max]
        .map(|f| before.iter().map(|v| Vec3::from(v.position)).reduce(f).expect("vertices"));
    let longest = edges.keys().map(|ends| {
        let [a, b] = ends.map(|end| Vec3::from(end.map(f32::from_bits)));
        a.distance(b)
    });
    assert!(longest.fold(0.0, f32::max) <= size[0].distance(size[1]) / 200.0);
    for vertex in after.iter() {
        assert!((Vec3::from(vertex.normal).length() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn fine_meshes_and_meshes_without_shade_stay_as_they_are() {
    let fine = scene(&Obj::default().ball(DVec3::Y, 0.5, 300), "", &["meshes.a.occlusion=0"]);
    let plain = |v: &Vertex| Vertex { occlusion: 0.0, shadow: 0.0, ..*v };
    let (own, made) = (&fine.triangles[0].vertices, fine.mesh().vertices);
    assert!(own.len() == made.len() && made.iter().zip(own.iter()).all(|(a, b)| plain(a) == *b));
    let off = ["meshes.a.occlusion=0", "meshes.a.shadow=0"];
    let bare = scene(&Obj::default().floor(2.0), "", &off);
    assert!(bare.mesh().vertices == bare.triangles[0].vertices);
}

#[test]
fn triangles_are_added_within_a_budget_however_large_a_mesh_is() {
    let mut many = Obj::default();
    for i in 0..300 {
        let y = f64::from(i) * 0.01;
        many = many.face([[-9.0, y, 9.0], [9.0, y, 9.0], [9.0, y, -9.0], [-9.0, y, -9.0]]);
    }
    let scene = scene(&many, "", &["meshes.a.occlusion=0", "meshes.a.shadow=0.5"]);
    let count = scene.mesh().vertices.len() / 3;
    assert!((100_000..=400_600).contains(&count), "{count}");
}

#[test]
fn a_convex_ball_hides_nothing_of_itself_and_its_dark_side_is_in_shadow() {
    let ball = scene(&Obj::default().ball(DVec3::Y, 0.5, 60), "", &[SUN]);
    let sun = Vec3::new(0.6, 0.8, 0.0);
    for vertex in ball.mesh().vertices.iter() {
        assert!(vertex.occlusion == 0.0, "{vertex:?}");
        let cos = Vec3::from(vertex.normal).dot(sun);
        if cos.abs() > 0.05 {
            assert_eq!(vertex.shadow, if cos > 0.0 { 0.0 } else { 1.0 }, "{vertex:?}");
        }
    }
}

/// A rock under a mesh, and a pool in front.
const GROUND: &str = "[rocks.floor]\ncorners = [[-3,-0.5,3],[3,-0.5,3],[3,-0.5,-3],[-3,-0.5,-3]]\n\
    levels = 5\namplitude = 0.0\nocclusion = 1.0\nshadow = 1.0\n[pools.p]\n\
    corners = [[-3,-0.4,3],[3,-0.4,3],[3,-0.4,1],[-3,-0.4,1]]\n";

#[test]
fn a_pool_under_a_mesh_without_rock_is_shaded() {
    let ball = Obj::default().ball(DVec3::Y, 0.6, 40);
    let pool = "[pools.p]\ncorners = [[-3,-0.4,3],[3,-0.4,3],[3,-0.4,-3],[-3,-0.4,-3]]\n";
    let mesh = scene(&ball, pool, &[SUN]).mesh();
    let pool: Vec<&Vertex> = mesh.vertices.iter().filter(|vertex| vertex.pool == 1).collect();
    assert!(pool.iter().all(|vertex| (0.0..=1.0).contains(&vertex.occlusion)));
    assert!(pool.iter().all(|vertex| (0.0..=1.0).contains(&vertex.shadow)));
    assert!(
        pool.iter().any(|vertex| vertex.occlusion > 0.2) && pool.iter().any(|vertex| vertex.shadow == 1.0)
    );
}

#[test]
fn rock_and_pools_are_shaded_by_meshes_where_both_want_it() {
    let ball = Obj::default().ball(DVec3::Y, 0.6, 40);
    let of = |sets: &[&str]| scene(&ball, GROUND, &[&[SUN][..], sets].concat()).mesh().vertices;
    let whole = of(&[]);
    let bare = of(&["meshes.a.occlusion=0", "meshes.a.shadow=0"]);
    let folder = Folder::new();
    let without = folder.scene(&format!("{PLACE}{GROUND}"), &[SUN]).mesh().vertices;
    assert!(bare[..without.len()] == **without, "a mesh without shade changes nothing");
    let rock = 33 * 33;
    let truth = |p: Vec3, (h, r): (f64, f64)| {
        let d2 = f64::from(p.x * p.x + p.z * p.z) + h * h;
        r * r / d2 * h / d2.sqrt()
    };
    let mut errors = Vec::new();
    for (with, without) in whole[..rock].iter().zip(without.iter()) {
        let p = Vec3::from(with.position);
        assert!(with.occlusion >= without.occlusion && with.shadow >= without.shadow);
        errors.push(f64::from(with.occlusion - without.occlusion) - truth(p, (1.5, 0.6)));
        let away = (f64::from(p.x) + 1.5 * 0.75) * 0.8;
        let away = away.hypot(p.z.into());
        if away < 0.4 {
            assert_eq!(with.shadow, 1.0, "{p}");
        } else if away > 0.8 {
            assert_eq!(with.shadow, without.shadow, "{p}");
        }
    }
    // As coarse as the 48 directions of rock.
    assert!(errors.iter().all(|e| e.abs() < 0.07), "{errors:?}");
    let pool = whole.iter().zip(without.iter()).filter(|(v, _)| v.pool > 0);
    assert!(pool.filter(|(with, without)| with.occlusion > without.occlusion).count() > 1000);
    // The rock casts on the mesh, if it may.
    let lowest = |vertices: &[Vertex]| {
        let below = vertices.iter().filter(|v| v.pool == 0 && v.normal[1] < -0.9 && v.position[1] > 0.0);
        below.map(|v| v.occlusion).fold(0.0, f32::max)
    };
    assert!(lowest(&whole) > 0.5 && lowest(&of(&["rocks.floor.occlusion=0"])) == 0.0);
}

#[test]
fn meshes_are_wet_by_their_distance_from_water_and_four_times_as_far_down() {
    let wall = Obj::default().face([[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [5.0, 5.0, 0.0], [-5.0, 5.0, 0.0]]);
    let water = "[[quads]]\ncorners = [[-1,1,0.2],[1,1,0.2],[1,-1,0.2],[-1,-1,0.2]]\n";
    let wet = scene(&wall, water, &["meshes.a.wet=0.8", "meshes.a.wet_reach=1"]);
    let mut seen = 0;
    for vertex in wet.mesh().vertices.iter() {
        let [x, y, _] = vertex.position;
        let across = (x.abs() - 1.0).max(0.0);
        let (above, below) = ((y - 1.0).max(0.0), (-1.0 - y).max(0.0));
        let metres = (0.04 + across * across + above * above + (below / 4.0).powi(2)).sqrt();
        let truth = 0.8 * wetness(metres, 1.0);
        assert!((vertex.wet - truth).abs() < 1e-4, "{x} {y}: {} {truth}", vertex.wet);
        let albedo = 0.3 + (wet_albedo(Vec3::splat(0.3)).x - 0.3) * truth;
        assert!((vertex.albedo[0] - albedo).abs() < 1e-4);
        seen += usize::from(truth > 0.1);
    }
    assert!(seen > 1000);
    let mist = scene(&wall, water, &["meshes.a.wet=1", "materials.water.mist=0.5"]);
    assert!(mist.mesh().vertices.iter().all(|v| v.wet == 0.0));
}

#[test]
fn shells_of_water_wet_meshes_and_rocks_and_shells_of_fur_do_not() {
    let wall = Obj::default().face([[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]]);
    let folder = Folder::new();
    folder.write("a.obj", wall.text());
    let strip = "v -0.5 -0.5 0.3\nv 0.5 -0.5 0.3\nv 0.5 0.5 0.3\nv -0.5 0.5 0.3\n\
                 vt 0 1\nvt 1 1\nvt 1 0\nvt 0 0\nf 1/1 2/2 3/3 4/4\n";
    folder.write("b.obj", strip);
    let text = format!(
        "{PLACE}{MESH}[meshes.b]\nfile = \"b.obj\"\nmaterial = \"stream\"\n[materials.stream]\n\
         carrier = \"shell\"\nskin = false\nthickness = 0.1\nside = \"outward\"\n[rocks.r]\n\
         corners = [[-2,-2,-0.01],[2,-2,-0.01],[2,2,-0.01],[-2,2,-0.01]]\namplitude = 0.0\nwet = 1.0\n"
    );
    let vertices = |sets: &[&str]| folder.scene(&text, &[&["meshes.a.wet=1"], sets].concat()).mesh().vertices;
    for vertex in vertices(&[]).iter() {
        let [x, y, z] = vertex.position;
        let across = (x.abs() - 0.5).max(0.0);
        let (above, below) = ((y - 0.5).max(0.0), (-0.5 - y).max(0.0));
        let truth = wetness(
            ((0.3 - z).powi(2) + across * across + above * above + (below / 4.0).powi(2)).sqrt(),
            1.0,
        );
        assert!((vertex.wet - truth).abs() < 1e-4, "{:?}: {} {truth}", vertex.position, vertex.wet);
    }
    assert!(vertices(&["volume.builder=fur"]).iter().all(|vertex| vertex.wet == 0.0));
}

#[test]
fn shade_is_the_same_on_any_number_of_threads_after_other_suns_and_from_the_cache() {
    let place = Obj::default().floor(2.0).cuboid(DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.6, 0.8, 0.4));
    let folder = Folder::new();
    folder.write("a.obj", place.text());
    let text = format!("{PLACE}{MESH}{GROUND}");
    let fresh = |sun: &str| folder.scene(&text, &[sun, "meshes.a.wet=1"]);
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let [one, two] = [1, 2].map(|threads| pool(threads).install(|| fresh(SUN).mesh()));
    assert!(one == two);
    let other = "lights.key.direction=[-0.3,0.8,0.4]";
    let scene = fresh(SUN);
    assert!(scene.mesh() == one);
    let moved = scene.with(&[other]).expect("valid").mesh();
    assert!(moved != one && moved == fresh(other).mesh());
    assert!(scene.with(&[SUN]).expect("valid").mesh() == one);
    let halved = ["meshes.a.occlusion=0.5"];
    assert!(scene.with(&halved).expect("valid").mesh() == fresh(SUN).with(&halved).expect("valid").mesh());
    let dir = tempdir().expect("a folder");
    let cache = Cache::new(dir.path(), 64 << 20).keeping_all();
    for scene in [fresh(SUN), fresh(SUN), fresh(other)] {
        assert!(scene.cached_mesh(Some(&cache)) == scene.mesh());
    }
    // Rock and mesh, twice: the second scene finds those of the first.
    assert_eq!(std::fs::read_dir(dir.path().join("meshes")).expect("a folder").count(), 4);
}

#[test]
fn the_engines_agree_on_shaded_and_wet_meshes() {
    let Some(mut renderer) = renderer("shade of meshes") else { return };
    let place = Obj::default().floor(2.0).cuboid(DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.6, 0.8, 0.4));
    // So near that a triangle spans several pixels.
    let view = ["camera.eye=[1.5,0.5,1.1]", "camera.target=[0.7,0.2,0.2]", "light.ambient=[0.3,0.35,0.4]"];
    let water = "[[quads]]\ncorners = [[0.7,0.9,0.3],[1.1,0.9,0.3],[1.1,0.05,0.3],[0.7,0.05,0.3]]\n";
    let sets = [&view[..], &[SUN, "meshes.a.wet=1", "image.width=320", "image.height=240"]].concat();
    let scene = scene(&place, water, &sets);
    let made = scene.mesh();
    let any = |of: fn(&Vertex) -> f32| made.vertices.iter().filter(|v| of(v) > 0.3).count() > 100;
    assert!(any(|v| v.occlusion) && any(|v| v.shadow) && any(|v| v.wet));
    assert_parity("shade of meshes", &both(&mut renderer, &scene));
}

#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
#[test]
fn the_version_of_the_shade_stands_for_its_values() {
    let place = Obj::default().floor(2.0).cuboid(DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.6, 0.8, 0.4));
    let water = "[[quads]]\ncorners = [[0.7,0.9,0.3],[1.1,0.9,0.3],[1.1,0.05,0.3],[0.7,0.05,0.3]]\n";
    let made = scene(&place, water, &[SUN, "meshes.a.wet=1"]).mesh();
    let checksum = format!("{:08x}", crc32fast::hash(bytemuck::cast_slice(&made.vertices)));
    // Without a new version, a new checksum would leave users with their old shade.
    assert_eq!((SHADE_VERSION, checksum.as_str()), (1, "b74818e7"));
}
