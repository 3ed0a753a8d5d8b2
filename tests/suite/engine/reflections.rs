//! Volumes of the scene's reflection model beside others of Kajiya and Kay's, in both engines: each looks as
//! it does where all have its model.

use taki::engine::cpu;
use taki::picture::Frame;
use taki::scene::{Limits, Scene};
use taki::util::monitor::Unwatched;

use super::gpu::{SURFACE, assert_same_radiance, renderer};
use crate::scene::meshes::Folder;

/// Two quads above two rings; the left ones show the volume `a`, the right ones `b`.
const PAIRS: &str = "version = 1
[volumes.a]
builder = \"fur\"
nx = 16
ny = 16
nz = 12
hairs = 2000
undercoat = 0.0
k_d = 0.8
[volumes.b]
builder = \"fur\"
nx = 16
ny = 16
nz = 12
hairs = 2000
undercoat = 0.0
seed = 5
[materials.a]
volume = \"a\"
thickness = 0.3
[materials.b]
volume = \"b\"
thickness = 0.3
[materials.ring_a]
volume = \"a\"
carrier = \"shell\"
thickness = 0.3
repeat_u = 7.37
repeat_v = 3.71
[materials.ring_b]
volume = \"b\"
carrier = \"shell\"
thickness = 0.3
repeat_u = 7.37
repeat_v = 3.71
[[quads]]
corners = [[-3, 0.5, 0], [-0.2, 0.5, 0], [-0.2, 2.5, 0], [-3, 2.5, 0]]
material = \"a\"
[[quads]]
corners = [[0.2, 0.5, 0], [3, 0.5, 0], [3, 2.5, 0], [0.2, 2.5, 0]]
material = \"b\"
[meshes.a]
file = \"taki:torus.glb\"
material = \"ring_a\"
position = [-2.0, -1.5, 0.0]
[meshes.b]
file = \"taki:torus.glb\"
material = \"ring_b\"
position = [2.0, -1.5, 0.0]
[trace]
sigma = 30.0
[light]
visibility = \"none\"
ambient = [0.2, 0.25, 0.3]
[lights.key]
direction = [0.4, 0.8, 1.0]
intensity = 1.5
[background]
zenith = [0.0, 0.0, 0.0]
horizon = [0.0, 0.0, 0.0]
[camera]
eye = [0.13, 0.57, 9.0]
target = [0.07, 0.22, 0.0]
fov = 40.0
[image]
width = 96
height = 64
samples = 1
";

fn scene(sets: &[&str]) -> Scene {
    let folder = Folder::new();
    folder.write("s.toml", PAIRS);
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Scene::load(&folder.path("s.toml"), &sets, &Limits::default()).expect("a scene")
}

/// Frames of the CPU engine, and of the GPU engine if there is one.
fn frames(what: &str, scene: &Scene) -> (Frame, Option<Frame>) {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("volumes");
    let mesh = scene.mesh();
    let on_cpu = cpu::render(scene, &volumes, &mesh, true, &Unwatched).expect("a frame");
    let on_gpu = renderer(what)
        .map(|mut gpu| gpu.render(scene, &volumes, &mesh, &SURFACE, &Unwatched).expect("a frame"));
    (on_cpu, on_gpu)
}

/// Whether the pixels of one side of two pictures are the same, but for the rounding of sums in grey and in
/// colour, and how many there are that are lit.
fn same(a: &Frame, b: &Frame, is_right: bool) -> (bool, usize) {
    let width = a.width as usize;
    let own = (0..a.radiance.len()).filter(|i| (i % width >= width / 2) == is_right);
    let (mut all, mut lit) = (true, 0);
    for i in own {
        let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-5 * (a.abs() + b.abs());
        all &= a.radiance[i].iter().zip(&b.radiance[i]).all(near);
        lit += usize::from(a.radiance[i][0] > 0.01);
    }
    (all, lit)
}

#[test]
fn each_volume_has_its_model() {
    for word in ["hair", "strand"] {
        for more in ["trace.filter=none", "trace.filter=pyramid", "light.scattering=multiple"] {
            let what = format!("{word}, {more}");
            let model = format!("light.reflection={word}");
            // Without V there is no multiple scattering.
            let more =
                [more, if more.ends_with("multiple") { "light.visibility=march" } else { "light.p=9" }];
            let [fibres, strands, both] =
                [vec![], vec![model.as_str()], vec![model.as_str(), "volumes.a.reflection=kajiya-kay"]]
                    .map(|sets| frames(&what, &scene(&[&sets[..], &more].concat())));
            let (left, of_left) = same(&both.0, &fibres.0, false);
            let (right, of_right) = same(&both.0, &strands.0, true);
            assert!(of_left > 400 && of_right > 400, "{what}: {of_left} and {of_right} pixels");
            assert!(left, "{what}: fibres beside strands");
            assert!(right, "{what}: strands beside fibres");
            assert!(!same(&both.0, &strands.0, false).0, "{what}: the models differ");
            if let Some(on_gpu) = both.1 {
                assert_same_radiance(&what, &[on_gpu, both.0]);
            }
        }
    }
}

#[test]
fn fibres_of_their_own_have_colours_beside_hair() {
    let scene = scene(&[
        "light.reflection=hair",
        "volumes.a.reflection=kajiya-kay",
        "volumes.a.color=[0.1, 0.2, 0.9]",
        "volumes.a.k_s=0.1",
    ]);
    let (on_cpu, on_gpu) = frames("colours beside hair", &scene);
    let colour = |is_right: bool| {
        let width = on_cpu.width as usize;
        let own = (0..on_cpu.radiance.len()).filter(|i| (i % width >= width / 2) == is_right);
        let [red, blue] =
            own.fold([0.0; 2], |[r, b], i| [r + on_cpu.radiance[i][0], b + on_cpu.radiance[i][2]]);
        red / blue
    };
    // Hair is brown, and the fur is blue.
    assert!(colour(true) > 1.2 && colour(false) < 0.8, "{} {}", colour(true), colour(false));
    if let Some(on_gpu) = on_gpu {
        assert_same_radiance("colours beside hair", &[on_gpu, on_cpu]);
    }
}
