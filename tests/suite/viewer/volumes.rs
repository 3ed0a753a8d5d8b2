//! A scene with several volumes: each has its parameters, and the inspectors show the one that is chosen.

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
