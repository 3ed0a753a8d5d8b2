//! The cost of each change. The picture must always show the document's values.

use super::*;
use taki::engine::cpu;
use taki::scene::Cost;
use taki::util::monitor::Unwatched;

/// Radiance and bytes of the picture that is shown.
fn shown(window: &Window) -> (Vec<[f32; 4]>, Vec<[u8; 4]>) {
    let picture = window.picture();
    assert_eq!(picture.scale, 1, "settled at full resolution");
    (picture.frame.radiance.clone(), picture.frame.picture.clone())
}

/// Keys with another value and the cost of the change.
fn changes() -> Vec<(&'static str, Raw, Cost)> {
    vec![
        ("curves.h", Raw::Float(0.3), Cost::Volume),
        ("volume.seed", Raw::Int(9), Cost::Volume),
        ("volume.nx", Raw::Int(20), Cost::Volume),
        ("volume.k_d", Raw::Float(0.9), Cost::Upload),
        ("volume.k_noise", Raw::Float(0.4), Cost::Upload),
        ("rocks.wall.seed", Raw::Int(77), Cost::Upload),
        ("volume.alpha", Raw::Float(0.8), Cost::Uniform),
        ("volume.flow", Raw::Float(0.4), Cost::Uniform),
        ("trace.sigma", Raw::Float(9.0), Cost::Uniform),
        ("materials.water.thickness", Raw::Float(0.6), Cost::Uniform),
        ("lights.sun.intensity", Raw::Float(5.0), Cost::Uniform),
        ("camera.fov", Raw::Float(30.0), Cost::Uniform),
    ]
}

fn each_change_shows_and_undo_takes_it_back(mut window: Window) {
    let first = shown(&window);
    for (key, raw, cost) in changes() {
        let built = window.viewer().worker().state().volume_seconds;
        window.set(key, raw);
        window.settle();
        let changed = shown(&window);
        assert!(changed.0 != first.0 && changed.1 != first.1, "{key} shows");
        assert_eq!(window.picture().cost, cost, "{key}");
        let now = window.viewer().worker().state().volume_seconds;
        assert_eq!(now != built, cost == Cost::Volume, "{key}: is the volume built again?");
        window.undo();
        window.settle();
        assert!(shown(&window) == first, "{key} is undone bit for bit");
        window.redo();
        window.settle();
        assert!(shown(&window) == changed, "{key} is redone bit for bit");
        window.undo();
        window.settle();
    }
}

#[test]
fn each_change_shows_its_cost_and_undo_gives_the_first_bytes_back() {
    each_change_shows_and_undo_takes_it_back(Setup::bare().open());
}

#[test]
fn so_it_is_on_the_gpu() {
    if crate::engine::gpu::renderer("viewer").is_none() {
        return;
    }
    let window = Setup { engine: EngineChoice::Gpu, ..Setup::bare() }.open();
    assert!(window.viewer().worker().state().engine.contains("gpu"));
    each_change_shows_and_undo_takes_it_back(window);
}

#[test]
fn the_picture_is_what_the_library_renders_of_the_same_values() {
    let mut window = Setup::bare().open();
    for (key, raw, _) in changes() {
        window.set(key, raw);
    }
    window.settle();
    let mut scene = (**window.viewer().document().scene()).clone();
    let frame = &window.picture().frame;
    [scene.edit().image.width, scene.edit().image.height] = [frame.width, frame.height];
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let want = cpu::render(&scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame");
    assert!(frame.radiance == want.radiance && frame.picture == want.picture);
}

#[test]
fn tone_and_exposure_change_the_bytes_and_not_the_radiance() {
    let mut window = Setup::bare().open();
    let first = shown(&window);
    let changes = [
        ("image.exposure", Raw::Float(2.0)),
        ("image.auto_exposure", Raw::Text("highlights".into())),
        ("image.bloom", Raw::Float(0.3)),
        ("image.temperature", Raw::Float(4000.0)),
        ("image.tone", Raw::Text("agx".into())),
        ("image.tone", Raw::Text("none".into())),
    ];
    for (key, raw) in changes {
        let before = shown(&window);
        window.set(key, raw);
        window.settle();
        let now = shown(&window);
        assert!(now.0 == first.0 && now.1 != before.1, "{key}");
    }
}

#[test]
fn an_automatic_exposure_follows_the_light_and_stays_while_the_water_flows() {
    let mut window = Setup::bare().open();
    let mut chosen = |key: &str, raw: Raw| {
        window.set(key, raw);
        window.settle();
        window.picture().scene.image.look.exposure
    };
    let first = chosen("image.auto_exposure", Raw::Text("highlights".into()));
    assert!(first != 0.0);
    for flow in [0.1, 0.2, 0.37, 0.5, 0.7] {
        assert_eq!(chosen("volume.flow", Raw::Float(flow)), first);
    }
    assert_eq!(chosen("image.exposure", Raw::Float(1.0)), first + 1.0);
    assert!(chosen("lights.sun.intensity", Raw::Float(9.0)) < first + 1.0);
}

#[test]
fn a_picture_is_refined_to_the_samples_asked_for() {
    let mut window = Setup { size: [900.0, 300.0], ..Setup::bare() }.open();
    assert_eq!(window.picture().samples, 1);
    let one = shown(&window);
    window.choose("Refine to", "4 samples");
    window.settle();
    assert_eq!(window.picture().samples, 4);
    assert!(shown(&window).0 != one.0);
    window.set("image.samples", Raw::Int(8));
    window.settle();
    assert_eq!(window.picture().samples, 8, "the scene asks for more");
}

#[test]
fn a_refined_picture_is_a_render_of_its_samples() {
    let mut window = Setup { size: [500.0, 300.0], ..Setup::bare() }.open();
    // From even to odd and back, no sample of the last picture is kept.
    for samples in [2, 4, 7, 9, 10] {
        window.set("image.samples", Raw::Int(samples));
        // A layer is shown between, which must not change with the samples.
        window.key(if samples % 2 == 0 { Key::Num3 } else { Key::Num1 });
        window.settle();
        let picture = window.picture();
        assert_eq!(i64::from(picture.samples), samples);
        let mut scene = (**window.viewer().document().scene()).clone();
        [scene.edit().image.width, scene.edit().image.height] = [picture.frame.width, picture.frame.height];
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let want = cpu::render(&scene, &volume, &scene.mesh(), true, &Unwatched).expect("a frame");
        assert!(picture.frame.counts == want.counts, "{samples} samples have other rays");
        for (i, (got, want)) in picture.frame.radiance.iter().zip(&want.radiance).enumerate() {
            for (got, want) in got.iter().zip(want) {
                assert!((got - want).abs() <= 1e-5 * want.abs() + 1e-6, "{samples}, {i}: {got} for {want}");
            }
        }
        assert!(picture.frame.surface.is_none() || picture.frame.surface == want.surface);
    }
}
