//! A scene with several volumes: each has its parameters, and the inspectors show the one that is chosen.

use glam::{DAffine3, DVec3};
use taki::grid::{Grid, write_vdb};

use super::*;

/// The scene of the other tests with fur on one of its quads.
fn window() -> Window {
    let fur =
        "[volumes.fur]\nnx = 9\nny = 14\nnz = 5\nacross = 5\ndeep = 4\n[materials.pelt]\nvolume = \"fur\"\n";
    Setup {
        scene: SCENE.to_owned() + fur,
        sets: vec!["quads.3.material=pelt".into()],
        settings: r#"{"refine_to": 1, "inspectors": true}"#.into(),
        size: [1300.0, 900.0],
        ..Setup::default()
    }
    .open()
}

fn volumes(window: &Window) -> Vec<String> {
    window.picture().scene.recipes.iter().map(|recipe| recipe.name.clone()).collect()
}

#[test]
fn the_keys_of_a_volume_have_widgets_and_can_be_undone() {
    let mut window = window();
    assert_eq!(volumes(&window), ["water", "fur"]);
    let before = window.picture().frame.radiance.clone();
    window.enter("Search parameters", "volumes.fur");
    assert!(window.reads("volumes · fur"));
    window.widget(Role::Slider, "volumes.fur.alpha").set_value_accesskit(0.1);
    window.harness.run_steps(2);
    window.settle();
    assert!((window.float("volumes.fur.alpha") - 0.1).abs() < 1e-6);
    assert_ne!(window.picture().frame.radiance, before);
    window.undo();
    window.settle();
    assert_eq!(window.picture().frame.radiance, before);
    // The material's volume is one of those there are.
    window.enter("Search parameters", "materials.pelt.volume");
    window.choose("materials.pelt.volume", "water");
    window.settle();
    assert_eq!(volumes(&window), ["water"]);
    window.undo();
    window.settle();
    assert_eq!(volumes(&window), ["water", "fur"]);
    assert_eq!(window.picture().frame.radiance, before);
}

#[test]
fn the_inspectors_show_the_volume_that_is_chosen() {
    let mut window = window();
    window.press("Volume");
    assert!(window.reads("16 × 16 × 16"));
    window.choose("Inspected volume", "fur");
    assert!(window.reads("9 × 14 × 5") && !window.reads("16 × 16 × 16"));
    // Curves of fur: five across and four deep.
    window.press("Curves");
    let slider = window.widget(Role::Slider, "Curves shown");
    assert_eq!(slider.accesskit_node().max_numeric_value(), Some(20.0));
    window.choose("Inspected volume", "water");
    let slider = window.widget(Role::Slider, "Curves shown");
    assert_eq!(slider.accesskit_node().max_numeric_value(), Some(36.0));
    // With fur shown no more, there is nothing to choose.
    window.choose("Inspected volume", "fur");
    window.set("quads.3.material", Raw::Text("water".into()));
    window.settle();
    assert!(!window.names(Role::ComboBox).contains(&"Inspected volume".to_owned()));
    let slider = window.widget(Role::Slider, "Curves shown");
    assert_eq!(slider.accesskit_node().max_numeric_value(), Some(36.0));
}

#[test]
fn a_volume_has_the_rows_of_its_builder_alone() {
    let smoke = "[volumes.smoke]\nbuilder = \"flow\"\nsource = \"taki:pour.vdb\"\nvoxels = 4\n\
                 [boxes.smoke]\nvolume = \"smoke\"\n";
    let mut window =
        Setup { scene: SCENE.to_owned() + smoke, size: [700.0, 2000.0], ..Setup::default() }.open();
    let rows = |window: &mut Window, search: &str| -> Vec<String> {
        window.enter("Search parameters", search);
        let roles = [Role::Slider, Role::SpinButton, Role::ComboBox, Role::TextInput];
        roles.into_iter().flat_map(|role| window.names(role)).collect()
    };
    let has = |rows: &[String], keys: &[&str], there: bool| {
        for key in keys {
            assert_eq!(rows.iter().any(|row| row == key), there, "{key}: {rows:?}");
        }
    };
    let of_water = rows(&mut window, "volume.");
    has(&of_water, &["volume.builder", "volume.nx", "volume.coherence", "volume.alpha"], true);
    has(&of_water, &["volume.source", "volume.strands", "volume.voxels", "volume.reflect"], false);
    has(&rows(&mut window, "curves."), &["curves.across", "curves.amplitude"], true);
    let own = |key: &str| format!("volumes.smoke.{key}");
    let own = |keys: &[&str]| keys.iter().map(|key| own(key)).collect::<Vec<_>>();
    let [kept, curves, strands] = [
        own(&[
            "builder", "source", "grid", "velocity", "voxels", "fine", "strands", "rho", "reflect", "alpha",
        ]),
        own(&["across", "deep", "bundles", "lean", "radius", "nx", "crest", "flow"]),
        own(&["amplitude", "h", "coherence", "coverage", "k_noise"]),
    ];
    let [kept, curves, strands] =
        [&kept, &curves, &strands].map(|all| all.iter().map(String::as_str).collect::<Vec<_>>());
    let without = rows(&mut window, "volumes.smoke");
    has(&without, &kept, true);
    has(&without, &curves, false);
    has(&without, &strands, false);
    window.set("volumes.smoke.strands", Raw::Int(20));
    window.settle();
    let with = rows(&mut window, "volumes.smoke");
    has(&with, &kept, true);
    has(&with, &curves, false);
    has(&with, &strands, true);
}

#[test]
fn the_slider_of_a_sequence_goes_over_its_files_and_a_missing_one_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    for number in [3u32, 5, 6] {
        let values = vec![1.0; number.pow(3) as usize];
        let to_world = DAffine3::from_scale(DVec3::splat(0.2));
        let grid = Grid::from_dense("density", 1, [0; 3], [number; 3], values, to_world);
        write_vdb(&folder.path().join(format!("s.{number:04}.vdb")), &[grid]).expect("a file");
    }
    let source = folder.path().join("s.####.vdb");
    let smoke = "[volumes.smoke]\nbuilder = \"flow\"\nsource = \"taki:pour.vdb\"\n\
                 [boxes.smoke]\nvolume = \"smoke\"\n";
    let mut window = Setup {
        scene: SCENE.to_owned() + smoke,
        sets: vec![format!("volumes.smoke.source={}", source.display()), "volumes.smoke.frame=3".into()],
        size: [700.0, 900.0],
        ..Setup::default()
    }
    .open();
    window.settle();
    window.enter("Search parameters", "volumes.smoke.frame");
    let slider = window.widget(Role::Slider, "volumes.smoke.frame");
    let ends = [slider.accesskit_node().min_numeric_value(), slider.accesskit_node().max_numeric_value()];
    assert_eq!(ends, [Some(3.0), Some(6.0)]);
    let scrub = |window: &mut Window, number: f64| {
        window.widget(Role::Slider, "volumes.smoke.frame").set_value_accesskit(number);
        window.harness.run_steps(2);
        window.settle();
        window.picture().frame.radiance.clone()
    };
    let first = window.picture().frame.radiance.clone();
    let last = scrub(&mut window, 6.0);
    assert_ne!(last, first, "another file is another picture");
    assert_eq!(scrub(&mut window, 4.0), last, "the picture stays");
    let fault = window.viewer().document().fault().expect("it is told").to_owned();
    assert!(fault.contains("s.0004.vdb"), "{fault}");
}
