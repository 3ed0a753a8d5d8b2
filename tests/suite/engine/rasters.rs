//! Results of the raster pass that the CPU engine keeps: they are used as long as nothing changes that the
//! pass reads, and never longer.

use std::collections::HashSet;
use std::sync::Arc;

use taki::engine::RenderOptions;
use taki::engine::cpu::gbuffer::band_rows;
use taki::engine::cpu::{LightVolumeCache, render_with};
use taki::picture::Frame;
use taki::place::Mesh;
use taki::scene::{Kind, Limits, Param, Scene};
use taki::util::monitor::Unwatched;
use taki::util::window::Window;
use taki::volume::VolumeTexture;

/// A small picture of the default scene, which has rock, a pool, several sheets and mist, with coarse rock.
fn scene(sets: &[String]) -> taki::util::error::Result<Scene> {
    let whole = Scene::load("waterfall".as_ref(), &[], &Limits::default())?;
    let coarse = whole.keys().into_iter().filter(|key| key.starts_with("rocks.") && key.ends_with(".levels"));
    let small = [
        "image.width=32",
        "image.height=18",
        "image.samples=1",
        "volume.nx=24",
        "volume.ny=48",
        "volume.nz=8",
    ];
    let all = coarse.map(|key| format!("{key}=3")).chain(small.map(String::from));
    Scene::load("waterfall".as_ref(), &all.chain(sets.to_vec()).collect::<Vec<_>>(), &Limits::default())
}

/// The CPU engine with what it keeps.
struct Engine {
    cache: LightVolumeCache,
    volume: Option<(Scene, VolumeTexture)>,
    mesh: Option<(Scene, Mesh)>,
}

impl Engine {
    fn new() -> Engine {
        Engine { cache: LightVolumeCache::default(), volume: None, mesh: None }
    }

    /// Renders a scene, with the volume and the mesh of the last one if they are its own.
    fn render(&mut self, scene: &Scene) -> Frame {
        let volume = match self.volume.take() {
            Some((old, volume)) if old.recipes == scene.recipes => volume,
            _ => scene.volume(1 << 30, &Unwatched).expect("a volume"),
        };
        let mesh = match self.mesh.take() {
            Some((old, mesh)) if old.ground() == scene.ground() => mesh,
            _ => scene.mesh(),
        };
        let options = RenderOptions { surface: true, keep_rasters: 64 << 20, ..Default::default() };
        let frame =
            render_with(scene, &volume, &mesh, &options, &mut self.cache, &Unwatched).expect("a frame");
        self.volume = Some((scene.clone(), volume));
        self.mesh = Some((scene.clone(), mesh));
        frame
    }

    /// Renders a scene, and returns how many passes were drawn for it.
    fn drawn(&mut self, scene: &Scene) -> u64 {
        let before = self.cache.rasters.drawn;
        self.render(scene);
        self.cache.rasters.drawn - before
    }
}

fn same(a: &Frame, b: &Frame) -> bool {
    a.radiance == b.radiance && a.counts == b.counts && a.surface == b.surface && a.alpha == b.alpha
}

/// Other values of a parameter, as they stand after `--set`.
fn others(param: &Param) -> Vec<String> {
    match param.kind {
        Kind::Float(min, max, usual) => {
            let (low, high) = param.slider.unwrap_or((min, max));
            [low + 0.3 * (high - low), usual * 0.9 + 0.01].map(|x| x.clamp(min, max).to_string()).to_vec()
        }
        Kind::Int(min, max, usual) => [usual + 1, usual - 1].map(|n| n.clamp(min, max).to_string()).to_vec(),
        Kind::Choice(words) => words.iter().map(|word| format!("\"{word}\"")).collect(),
        Kind::Switch(usual) => vec![(!usual).to_string()],
        Kind::Color(_) => vec!["[0.3, 0.7, 0.5]".into()],
        Kind::Point(_) => vec!["[0.3, 0.7, 0.5]".into(), "[2.0, 9.0, 14.0]".into()],
        Kind::Text(_) | Kind::Corners | Kind::Frames | Kind::Series => Vec::new(),
    }
}

#[test]
fn whatever_parameter_changes_a_kept_pass_shows_what_a_new_one_shows() {
    let usual = scene(&[]).expect("a scene");
    let mut engine = Engine::new();
    let first = engine.render(&usual);
    assert!(same(&engine.render(&usual), &first) && same(&engine.render(&usual), &first));
    let (mut kept, mut tried) = (0, 0);
    let mut known = HashSet::new();
    for key in usual.keys() {
        let Some(param) = Param::find(&key) else { continue };
        // One rock, one light, one sheet and one material stand for all.
        let (section, name) = (key.split('.').next(), key.rsplit('.').next());
        if !known.insert((section.map(String::from), name.map(String::from))) {
            continue;
        }
        // A finer volume or rock takes long, and neither is read from the scene.
        if ["nx", "ny", "nz", "levels", "samples"].iter().any(|end| key.ends_with(end)) {
            continue;
        }
        for other in others(param) {
            let Ok(changed) = scene(&[format!("{key}={other}")]) else { continue };
            let drawn = engine.cache.rasters.drawn;
            let got = engine.render(&changed);
            (kept, tried) = (kept + u64::from(engine.cache.rasters.drawn == drawn), tried + 1);
            let mut new = Engine { cache: LightVolumeCache::default(), ..engine };
            let want = new.render(&changed);
            engine = Engine { cache: std::mem::take(&mut engine.cache), ..new };
            assert!(same(&got, &want), "{key}={other}");
            assert!(same(&engine.render(&usual), &first), "back from {key}={other}");
        }
    }
    assert!(kept > 20 && tried > 100, "{kept} of {tried} changes needed no new pass");
}

#[test]
fn a_pass_is_drawn_again_only_when_something_it_reads_has_changed() {
    let usual = scene(&[]).expect("a scene");
    let mut engine = Engine::new();
    // A pass is kept when it comes up a second time.
    assert_eq!([1, 2, 3, 4].map(|_| engine.drawn(&usual)), [1, 1, 0, 0]);
    let of_water = ["trace.sigma=5.0", "light.p=9.0", "volume.k_d=0.3", "curves.h=0.5", "volume.flow=0.3"];
    for set in of_water.into_iter().chain(["image.exposure=1.0", "volume.flow=0.9"]) {
        assert_eq!(engine.drawn(&scene(&[set.into()]).expect("a scene")), 0, "{set}");
    }
    for set in ["camera.fov=41.0", "light.ambient=[0.1, 0.2, 0.3]", "image.height=26", "image.rock_error=3.0"]
    {
        assert_eq!(engine.drawn(&scene(&[set.into()]).expect("a scene")), 1, "{set}");
    }
    assert_eq!(engine.drawn(&usual), 0, "the first picture is still kept");
    assert_eq!(engine.render(&usual).seconds.gbuffer, 0.0, "a pass that is kept takes no time");
}

/// What `f` returns on so many threads.
fn on<T: Send>(threads: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(f)
}

#[test]
fn bands_in_work_are_a_small_part_of_a_window_whatever_the_number_of_threads() {
    for (threads, height) in [(1, 64), (2, 720), (16, 64), (16, 720), (64, 2160)] {
        let window = Window { x: 0, y: 0, width: 30_000, height };
        let rows = on(threads, || band_rows(window));
        assert!(
            rows >= 1 && rows * threads as u32 <= height / 8 + threads as u32,
            "{threads} {height} {rows}"
        );
    }
}

#[test]
fn kept_passes_serve_any_number_of_threads() {
    let usual = scene(&["image.height=96".into()]).expect("a scene");
    let mut engine = Engine::new();
    let first = on(1, || engine.render(&usual));
    for threads in [1, 1, 3, 3, 3, 1] {
        assert!(same(&on(threads, || engine.render(&usual)), &first), "{threads} threads");
    }
}

#[test]
fn passes_hold_no_mesh_and_no_sky_that_the_scene_has_left() {
    let mut engine = Engine::new();
    let sky = |elevation: u32| {
        ["environment.kind=\"sky\"".into(), format!("sky.elevation={elevation}")].map(String::from).to_vec()
    };
    let first = scene(&sky(20)).expect("a scene");
    engine.render(&first);
    let map = Arc::downgrade(&first.environment.as_ref().expect("a sky").map);
    let vertices = Arc::downgrade(&engine.mesh.as_ref().expect("a mesh").1.vertices);
    drop(first);
    let mut other = sky(30);
    other.push("rocks.wall.amplitude=0.31".into());
    // Another environment is remembered beside the scene's own.
    for sets in [other, sky(40), sky(50)] {
        engine.render(&scene(&sets).expect("a scene"));
    }
    assert_eq!((vertices.strong_count(), map.strong_count()), (0, 0));
}
