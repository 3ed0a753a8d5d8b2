//! GPU devices that are missing, lost, slow or chosen by a wrong name.

use std::fs;
use std::time::{Duration, Instant};

use super::{has_only, is_picture, render, run, taki};
use taki::Error;
use taki::engine::gpu::{DeviceOptions, Gpu, GpuRenderer, adapters};
use taki::engine::{Engine, EngineChoice, RenderOptions};
use taki::scene::{Limits, Scene};
use taki::util::monitor::{Monitor, Unwatched};
use tempfile::tempdir;

/// Whether a GPU is present. In continuous integration (CI set) its absence fails the test.
fn has_gpu() -> bool {
    let found = !adapters().is_empty();
    assert!(found || std::env::var_os("CI").is_none(), "CI needs an adapter (mesa-vulkan-drivers)");
    if !found {
        eprintln!("skipped: no GPU adapter");
    }
    found
}

fn front(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|s| (*s).into()).collect();
    Scene::load("front".as_ref(), &sets, &Limits::default()).unwrap()
}

const TINY: [&str; 2] = ["image.width=16", "image.height=16"];

#[test]
fn without_an_adapter_gpu_is_refused_and_auto_takes_the_cpu() {
    let dir = tempdir().unwrap();
    let out = dir.path().join("x.png");
    let blind = |arguments: &[&str]| {
        let mut command = taki(["render", "front", "--size=16x16", "-o"]);
        command.arg(&out).args(arguments);
        // The loader has a new and an old variable that name its drivers.
        run(command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent"))
    };
    blind(&["--engine=gpu"]).refused(69, &["no GPU adapter", "mesa-vulkan-drivers", "--engine cpu"]);
    blind(&["--adapter=nothing"]).refused(69, &["nothing"]);
    has_only(dir.path(), &[]);
    let auto = blind(&["--json"]);
    let json: serde_json::Value = serde_json::from_str(auto.done()).unwrap();
    assert_eq!(json["engine"], "cpu");
    let said = auto.lines("taki: engine");
    assert_eq!(said.len(), 1, "{}", auto.err);
    assert!(said[0].contains("no GPU adapter"), "{}", auto.err);
    is_picture(&out);
}

#[test]
fn auto_leaves_software_to_the_cpu_unless_it_is_named() {
    let Ok(gpu) = Gpu::open(&DeviceOptions::default()) else { return };
    let dir = tempdir().unwrap();
    let word = |more: &[&str]| {
        let mut command = taki(["render", "front", "--size=16x16", "--samples=1", "--json", "--overwrite"]);
        let run = run(command.args(["-o", "p.png"]).args(more).current_dir(&dir));
        let json: serde_json::Value = serde_json::from_str(run.done()).unwrap();
        (json["engine"].as_str().unwrap().to_owned(), run.lines("taki: engine").concat())
    };
    let (auto, line) = word(&[]);
    assert_eq!(auto, if gpu.is_software() { "cpu" } else { "gpu" }, "{line}");
    assert_eq!(line.contains("which is software and slower"), gpu.is_software(), "{line}");
    let name = adapters()[0].get_info().name;
    assert_eq!(word(&["--adapter", &name]).0, "gpu");
    assert_eq!(word(&["--engine", "gpu"]).0, "gpu");
}

#[test]
fn an_adapter_of_another_name_is_refused() {
    let dir = tempdir().unwrap();
    for engine in ["auto", "gpu"] {
        let mut command = taki(["render", "front", "--adapter=no such thing", "--engine", engine, "-o"]);
        let run = run(command.arg(dir.path().join("x.png")));
        run.refused(69, &["no such thing", "leave out --adapter"]);
        // The adapters that there are stand in the message.
        assert!(adapters().iter().all(|a| run.stderr().contains(&a.get_info().name)), "{run:?}");
    }
    has_only(dir.path(), &[]);
}

#[test]
fn the_watchdog_ends_the_run_and_removes_its_temporary_file() {
    if !has_gpu() {
        return;
    }
    let dir = tempdir().unwrap();
    let mut command = taki(["render", "front", "--engine=gpu", "--watchdog=1e-9", "-o"]);
    run(command.arg(dir.path().join("x.png"))).refused(124, &["did not answer", "--watchdog"]);
    has_only(dir.path(), &[]);
    for wrong in ["-1", "0", "NaN", "inf", "1e9", "soon"] {
        let run = run(render("front", "x.png").arg(format!("--watchdog={wrong}")));
        assert_eq!(run.code, Some(2), "{wrong}: {}", run.err);
    }
}

#[test]
fn a_device_that_hangs_is_not_waited_for() {
    if !has_gpu() {
        return;
    }
    // One submission takes seconds; the watchdog allows it a third of a second.
    let mut sets = vec!["image.width=1024", "image.height=1024", "light.visibility=march"];
    sets.extend(["volume.nx=200", "volume.ny=200", "volume.nz=200", "trace.sigma=0.1", "volume.alpha=0.05"]);
    let scene = front(&sets);
    let volume = scene.volume(1 << 30, &Unwatched).unwrap();
    let device = DeviceOptions { watchdog: Duration::from_millis(300), ..Default::default() };
    let (mut engine, _) = Engine::open(EngineChoice::Gpu, &device).unwrap();
    let options = RenderOptions { tile_pixels: Some(1 << 20), ..Default::default() };
    let clock = Instant::now();
    let result = engine.render_volume(&scene, &volume, &scene.mesh(), &options, &Unwatched);
    if result.is_ok() {
        eprintln!("skipped: this GPU is too fast to seem hung");
        return;
    }
    assert!(matches!(result, Err(Error::Watchdog { .. })), "{:?}", result.err());
    let answered = clock.elapsed();
    drop(engine);
    assert!(clock.elapsed() - answered < Duration::from_millis(500), "waited {:?}", clock.elapsed());
}

#[test]
fn a_lost_device_is_an_error_and_no_panic() {
    if !has_gpu() {
        return;
    }
    let scene = front(&TINY);
    let volume = scene.volume(1 << 30, &Unwatched).unwrap();
    let mut renderer = GpuRenderer::new(Gpu::open(&DeviceOptions::default()).unwrap());
    // First with a new renderer, then with one whose shaders are compiled.
    for warm in [false, true] {
        if warm {
            renderer = GpuRenderer::new(Gpu::open(&DeviceOptions::default()).unwrap());
            renderer.render(&scene, &volume, &scene.mesh(), &RenderOptions::default(), &Unwatched).unwrap();
        }
        renderer.gpu.device.destroy();
        let result = renderer.render(&scene, &volume, &scene.mesh(), &RenderOptions::default(), &Unwatched);
        let error = result.err().unwrap();
        assert!(matches!(error, Error::DeviceLost(_)), "{error}");
        assert_eq!(error.exit_code(), 75);
    }
}

#[test]
fn a_lost_device_is_replaced_once_with_a_warning() {
    if !has_gpu() {
        return;
    }
    #[derive(Default)]
    struct Warnings(std::sync::Mutex<Vec<String>>);
    impl Monitor for Warnings {
        fn progress(&self, _: &'static str, _: u64, _: u64) -> taki::Result<()> {
            Ok(())
        }
        fn warn(&self, text: &str) {
            self.0.lock().unwrap().push(text.into());
        }
    }
    let scene = front(&TINY);
    let volume = scene.volume(1 << 30, &Unwatched).unwrap();
    let (mut engine, _) = Engine::open(EngineChoice::Gpu, &DeviceOptions::default()).unwrap();
    let (options, warnings) = (RenderOptions::default(), Warnings::default());
    let mut picture =
        || engine.render_volume(&scene, &volume, &scene.mesh(), &options, &warnings).unwrap().picture;
    let before = picture();
    assert!(warnings.0.lock().unwrap().is_empty());
    if let Engine::Gpu { renderer, .. } = &engine {
        renderer.gpu.device.destroy();
    }
    let after = engine.render_volume(&scene, &volume, &scene.mesh(), &options, &warnings).unwrap().picture;
    // Smaller tiles must give the same pixels.
    assert!(before == after);
    let warnings = warnings.0.into_inner().unwrap();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("trying once more on a new device"), "{warnings:?}");
}

#[test]
fn the_gpu_gives_the_same_bytes_each_time() {
    if !has_gpu() {
        return;
    }
    let dir = tempdir().unwrap();
    let bytes = || {
        ["x.png", "x.exr"].map(|name| {
            let out = dir.path().join(name);
            let mut command = taki(["render", "front", "--engine=gpu", "--size=33x17", "--samples=3", "-o"]);
            run(command.arg(&out).arg("--set=light.visibility=march")).done();
            fs::read(out).unwrap()
        })
    };
    assert!(bytes() == bytes());
}

#[test]
fn a_watchdog_that_ends_work_in_flight_ends_the_process_with_its_own_code() {
    if !has_gpu() {
        return;
    }
    let dir = tempdir().unwrap();
    // The volume is deep and light is marched. On software Vulkan the first tile takes far longer than the
    // watchdog allows, and its threads are still at work when the process ends.
    let sets = ["volume.nz=200", "volume.nx=100", "volume.ny=100", "trace.max_cells=5000"];
    // Chance decides whether the end of the process catches the threads at work, so the test runs several
    // times.
    for _ in 0..12 {
        let mut command =
            taki(["render", "front", "--engine=gpu", "--watchdog=0.01", "--size=1500x1500", "-o"]);
        command.arg(dir.path().join("x.png")).arg("--set=light.visibility=march");
        let run = run(command.args(sets.map(|s| format!("--set={s}"))));
        // A fast GPU may finish in time. The process must never end by a signal.
        assert!(matches!(run.code, Some(0 | 124)), "{:?}: {}", run.code, run.err);
        if run.code == Some(124) {
            has_only(dir.path(), &[]);
        }
    }
}
