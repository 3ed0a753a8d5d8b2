//! Distant cameras and large coordinates: float32 has 7 digits, so whatever depends on where eye and scene
//! are must be computed in float64 before it is rounded.

use super::gpu::{SURFACE, assert_parity, renderer};
use glam::{DMat3, DVec3, Vec3};
use taki::engine::cpu;
use taki::picture::Frame;
use taki::scene::{Limits, Scene};
use taki::util::monitor::Unwatched;

/// Distances from the world's origin, or from the scene, metres. Coordinates end at 1e7.
const DISTANCES: [f64; 3] = [1e3, 1e5, 9.999e6];
const WIDTH: u32 = 80;
const HEIGHT: u32 = 60;

/// Corners A, B and D of the main quad, a parallelogram.
const A: DVec3 = DVec3::new(-1.0, 1.2, 0.0);
const B: DVec3 = DVec3::new(1.0, 1.2, 0.2);
const D: DVec3 = DVec3::new(-1.0, -0.8, 0.5);

/// Where the scene lies, and what looks at it.
#[derive(Clone, Copy)]
struct View {
    /// Place of the scene in the world.
    at: DVec3,
    /// Eye and target, relative to the scene.
    eye: DVec3,
    target: DVec3,
    fov_degrees: f64,
}

/// From a few metres.
const NEAR: View = View {
    at: DVec3::ZERO,
    eye: DVec3::new(0.5, 0.6, 4.0),
    target: DVec3::new(0.0, 0.2, 0.0),
    fov_degrees: 42.0,
};

/// A view of the whole scene from that far, which is almost parallel.
fn from_afar(metres: f64) -> View {
    let toward = DVec3::new(0.2, 0.3, 1.0).normalize();
    let fov_degrees = (2.0 * (1.5 / metres).atan()).to_degrees();
    View { eye: NEAR.target + toward * metres, fov_degrees, ..NEAR }
}

/// Two quads 5 cm apart, a sheet and a splash before a rock, over a still pool, with lights near them and
/// haze. Only what is fixed to the world is left out: beds of rock, waves and foam.
fn scene(View { at, eye, target, fov_degrees }: View, more: &str) -> Scene {
    let list = |p: DVec3| format!("[{:?}, {:?}, {:?}]", p.x, p.y, p.z);
    let point = |p: [f64; 3]| list(at + DVec3::from_array(p));
    let points =
        |all: &[[f64; 3]]| format!("[{}]", all.iter().map(|p| point(*p)).collect::<Vec<_>>().join(", "));
    let quad = |by: DVec3| points(&[A + by, B + by, B + D - A + by, D + by].map(|p| p.to_array()));
    let text = format!(
        "version = 1\n[volume]\nnx = 24\nny = 24\nnz = 24\n[curves]\nacross = 8\ndeep = 8\n\
         [materials.water]\nthickness = 0.03\nrepeat_u = 2\n[trace]\nsigma = 30.0\nlayers = 4\n\
         [[quads]]\ncorners = {}\n[[quads]]\ncorners = {}\n\
         [sheets.side]\npoints = {}\nwidths = [0.4]\nsegments = 3\n\
         [splashes.drops]\nfrom = {}\nto = {}\ndrop = 0.4\ncount = 3\nsegments = 2\nwidth = 0.05\n\
         [rocks.wall]\ncorners = {}\nlevels = 2\namplitude = 0.04\nbulge = 0.0\nstrata = 0.0\n\
         occlusion = 0.0\n\
         [pools.still]\ncorners = {}\nheight = 0.0\nrings = 0.0\nfoam = 0.0\ncolor = [0.1, 0.1, 0.1]\n\
         bottom = [0.1, 0.1, 0.1]\n[lights.lamp]\nkind = \"point\"\nposition = {}\nintensity = 8.0\n\
         [lights.spot]\nkind = \"spot\"\nposition = {}\ndirection = [-0.4, 0.5, 1.0]\nangle = 50.0\n\
         intensity = 6.0\n\
         [haze]\ndensity = 1e-9\nscale_height = 3.0\nlevel = {:?}\n\
         [camera]\neye = {}\ntarget = {}\nfov = {fov_degrees:?}\n\
         [image]\nwidth = {WIDTH}\nheight = {HEIGHT}\nsamples = 1\ntone = \"none\"\n{more}",
        quad(DVec3::ZERO),
        quad(DVec3::new(0.1, 0.1, -0.05)),
        points(&[[1.5, 1.2, -0.1], [1.6, 0.3, 0.1], [1.6, -0.7, 0.4]]),
        point([-1.2, -0.85, 0.6]),
        point([1.2, -0.85, 0.6]),
        points(&[[-2.0, -1.0, -0.3], [2.0, -1.0, -0.3], [2.0, 2.0, -0.3], [-2.0, 2.0, -0.3]]),
        points(&[[-2.0, -0.9, 2.0], [2.0, -0.9, 2.0], [2.0, -0.9, -0.3], [-2.0, -0.9, -0.3]]),
        point([1.0, 1.5, 1.5]),
        point([-1.0, 1.5, 2.0]),
        at.y,
        list(at + eye),
        list(at + target),
    );
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("far.toml");
    std::fs::write(&path, text).expect("written");
    Scene::load(&path, &[], &Limits::default()).expect("a valid scene")
}

/// Frames of both engines, as far as there is a device, which agree.
fn frames(scene: &Scene, what: &str) -> Vec<Frame> {
    let frames = each(scene, what);
    if let [a, b] = &frames[..] {
        assert_parity(what, &[a.clone(), b.clone()]);
    }
    frames
}

/// Frames of both engines, as far as there is a device.
fn each(scene: &Scene, what: &str) -> Vec<Frame> {
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let mesh = scene.mesh();
    let mut frames = vec![cpu::render(scene, &volume, &mesh, true, &Unwatched).expect("a frame")];
    if let Some(mut renderer) = renderer(what) {
        frames.insert(0, renderer.render(scene, &volume, &mesh, &SURFACE, &Unwatched).expect("a frame"));
    }
    frames
}

/// Texture coordinates of the main quad under the centre of a pixel, computed from the scene's numbers alone.
fn exact_uv(view: View, [x, y]: [u32; 2]) -> [f64; 2] {
    let forward = (view.target - view.eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let tan = (0.5 * view.fov_degrees.to_radians()).tan();
    let across = (2.0 * (f64::from(x) + 0.5) / f64::from(WIDTH) - 1.0) * f64::from(WIDTH) / f64::from(HEIGHT);
    let above = 1.0 - 2.0 * (f64::from(y) + 0.5) / f64::from(HEIGHT);
    let d = forward + (right * across + up * above) * tan;
    // A + (B − A)·u + (D − A)·v = eye + d·t.
    let solved = DMat3::from_cols(B - A, D - A, -d).inverse() * (view.eye - A);
    [solved.x, solved.y]
}

#[test]
fn texture_coordinates_do_not_drift_with_the_distance_of_the_eye() {
    for view in std::iter::once(NEAR).chain(DISTANCES.map(from_afar)) {
        for frame in frames(&scene(view, ""), "texture coordinates from afar") {
            let surface = frame.surface.as_ref().expect("asked for");
            let (mut pixels, mut worst) = (0, 0f64);
            for i in (0..surface.quad.len()).filter(|&i| surface.quad[i] == 1) {
                let want = exact_uv(view, [i as u32 % WIDTH, i as u32 / WIDTH]);
                // Along the quad's edges the raster's grid of 1/256 pixel decides, and coordinates end.
                if want.iter().all(|x| (0.001..0.999).contains(x)) {
                    let off = [0, 1].map(|c| (f64::from(surface.uv[i][c]) - want[c]).abs());
                    worst = worst.max(off[0]).max(off[1]);
                    pixels += 1;
                }
            }
            assert!(pixels > 800, "{pixels} pixels of the quad");
            assert!(worst < 1e-5, "from {} m: {worst:e}", view.eye.length());
        }
    }
}

/// Asserts that two frames show the same, but for pixels on edges.
fn assert_alike(what: &str, got: &Frame, want: &Frame, tolerance: f32, share: f64) {
    let pixels = want.radiance.len();
    let alike = |i: usize| {
        let near = |a: f32, b: f32| (a - b).abs() <= tolerance * a.abs().max(b.abs()) + 0.02 * tolerance;
        (0..4).all(|c| near(got.radiance[i][c], want.radiance[i][c]))
    };
    let count = (0..pixels).filter(|&i| alike(i)).count();
    assert!(count as f64 >= share * pixels as f64, "{what}: {count} of {pixels} pixels are alike");
}

#[test]
fn scene_and_eye_that_move_together_give_the_same_picture() {
    let home = frames(&scene(NEAR, ""), "the scene at the origin");
    for metres in DISTANCES {
        let at = DVec3::new(metres, -0.37 * metres, 0.83 * metres);
        for (frame, home) in frames(&scene(View { at, ..NEAR }, ""), "a scene far out").iter().zip(&home) {
            let what = format!("{metres} m from the origin");
            assert_alike(&what, frame, home, 2e-3, 0.99);
            let [near, far] = [home, frame].map(|frame| frame.surface.as_ref().expect("asked for"));
            let same: Vec<usize> = (0..near.quad.len()).filter(|&i| near.quad[i] == far.quad[i]).collect();
            assert!(same.len() as f64 >= 0.995 * near.quad.len() as f64, "{what}");
            let off = |i: usize| (0..2).map(move |c| (near.uv[i][c] - far.uv[i][c]).abs());
            let worst = same.iter().flat_map(|&i| off(i)).fold(0f32, f32::max);
            assert!(worst < 2e-5, "{what}: texture coordinates are off by {worst:e}");
        }
    }
}

#[test]
fn what_lies_behind_stays_behind_at_any_distance() {
    // From 100 km and from 10,000 km the view is parallel: both pictures are the same.
    let [nearer, farther] = [DISTANCES[1], DISTANCES[2]].map(|metres| {
        let still = "[light]\nambient = [0.2, 0.2, 0.2]\n";
        let mut scene = scene(from_afar(metres), still);
        scene.edit().haze.density = 0.0;
        frames(&scene, "depth from afar")
    });
    for (nearer, farther) in nearer.iter().zip(&farther) {
        assert_alike("100 and 10,000 km", farther, nearer, 5e-3, 0.98);
        // All of the scene's parts are seen.
        let surface = nearer.surface.as_ref().expect("asked for");
        for quad in [0, 1, 2, 3] {
            let seen = surface.quad.iter().filter(|&&q| q == quad).count();
            assert!(seen > 10, "quad {quad}: {seen} pixels");
        }
    }
}

#[test]
fn beds_of_rock_waves_and_foam_are_fixed_to_the_world() {
    // The origin follows most of the water. Rock, the pool and the fall that makes foam in it stay where they
    // are.
    let strata = "[[quads]]\ncorners = WATER\n[[quads]]\ncorners = WATER\n\
        [[quads]]\ncorners = [[500.5, 0.3, 2], [503.5, 0.3, 2], [503.5, -0.3, 2], [500.5, -0.3, 2]]\n\
        [rocks.cliff]\ncorners = [[500, 0, 0], [504, 0, 0], [504, 3, 0], [500, 3, 0]]\nlevels = 6\n\
        strata = 1.0\nstrata_height = 0.3\nstrata_tilt = 10.0\nwet = 0.0\n\
        [pools.pond]\ncorners = [[500, 0, 4], [504, 0, 4], [504, 0, 0], [500, 0, 0]]\nfoam = 1.0\n\
        foam_reach = 0.5\n[lights.sun]\nintensity = 3.0\n\
        [camera]\neye = [502, 2, 7]\ntarget = [502, 1, 0]\n\
        [image]\nwidth = 80\nheight = 60\nsamples = 1\ntone = \"none\"\n";
    let folder = tempfile::tempdir().expect("a folder");
    let with_water_at = |x: f64| {
        let corner = |dx: f64, y: f64| format!("[{:?}, {y:?}, 50.0]", x + dx);
        let water = [corner(0.0, 90.0), corner(1.0, 90.0), corner(1.0, 91.0), corner(0.0, 91.0)].join(", ");
        let path = folder.path().join("beds.toml");
        let text = format!("version = 1\n{}", strata.replace("WATER", &format!("[{water}]")));
        std::fs::write(&path, text).expect("written");
        Scene::load(&path, &[], &Limits::default()).expect("a valid scene")
    };
    let (near, far) = (with_water_at(510.0), with_water_at(900.0));
    assert_ne!(near.camera.origin, far.camera.origin);
    let [here, there] = [&near, &far].map(|scene| {
        let of = |p: [f32; 3]| scene.camera.origin + Vec3::from(p).as_dvec3();
        scene.mesh().vertices.iter().map(|vertex| of(vertex.position)).collect::<Vec<_>>()
    });
    let off = here.iter().zip(&there).map(|(a, b)| a.distance(*b)).collect::<Vec<_>>();
    // A step between two beds moves a vertex far where float32 rounds it to the other side.
    let same = off.iter().filter(|&&off| off < 1e-3).count();
    assert!(same as f64 > 0.999 * off.len() as f64, "{same} of {} vertices", off.len());
    for (a, b) in each(&near, "beds").iter().zip(&each(&far, "beds moved")) {
        assert_alike("beds, waves and foam", a, b, 2e-2, 0.98);
    }
}

/// Rock that fills the view of an eye 5 m before it, `apart` metres from the water, at `at` in the world.
fn rock_apart(apart: f64, at: f64) -> Scene {
    let rock = at + apart;
    let text = format!(
        "version = 1\n[volume]\nnx = 8\nny = 8\nnz = 8\n[curves]\nacross = 2\ndeep = 2\n\
         [[quads]]\ncorners = [[{at:?}, 1, 0], [{:?}, 1, 0], [{:?}, 0, 0], [{at:?}, 0, 0]]\n\
         [rocks.wall]\ncorners = [[{rock:?}, 0, 0], [{:?}, 0, 0], [{:?}, 3, 0], [{rock:?}, 3, 0]]\n\
         levels = 2\n\
         [lights.sun]\nintensity = 3.0\n[camera]\neye = [{:?}, 1, 5]\ntarget = [{:?}, 1, 0]\n\
         [image]\nwidth = 160\nheight = 120\n",
        at + 1.0,
        at + 1.0,
        rock + 4.0,
        rock + 4.0,
        rock + 2.0,
        rock + 2.0,
    );
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("apart.toml");
    std::fs::write(&path, text).expect("written");
    Scene::load(&path, &[], &Limits::default()).expect("a valid scene")
}

#[test]
fn parts_that_lie_too_far_apart_for_their_digits_are_told() {
    let warnings = |scene: &Scene| scene.warnings(&scene.volume(1 << 30, &Unwatched).expect("a volume"));
    // The scene as a whole may lie anywhere.
    for at in [0.0, 1e5, -9.9e6] {
        assert!(warnings(&rock_apart(1e3, at)).is_empty(), "at {at}");
    }
    let told = warnings(&rock_apart(1e6, 0.0));
    assert_eq!(told.len(), 1, "{told:?}");
    // A float32 near 10⁶ has steps of 2^-4 m.
    for word in ["rocks.wall", "1000002 m", "62.50 mm", "closer together"] {
        assert!(told[0].contains(word), "{word}: {}", told[0]);
    }
    // An eye that is as far from the rock does not see it rounded.
    let mut from_the_water = rock_apart(1e6, 0.0);
    from_the_water.edit().camera.eye = DVec3::new(0.5, 1.0, 5.0);
    assert!(warnings(&from_the_water).is_empty());
    // Nor does an eye that looks away.
    let mut away = rock_apart(1e6, 0.0);
    away.edit().camera.forward *= -1.0;
    assert!(warnings(&away).is_empty());
}
