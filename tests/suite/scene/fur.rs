//! Keys of fur and of colours: what they are read as, what is refused, and what has no effect.

use std::path::Path;

use glam::Vec3;
use taki::job::VolumeMemo;
use taki::light::ramp::Ramp;
use taki::scene::{Cost, Limits, Scene, settings_without_effect};
use taki::util::monitor::Unwatched;

fn with(sets: &[&str]) -> Result<Scene, String> {
    let scene = Scene::preset("fig5").expect("a preset");
    scene.with(sets).map_err(|e| e.to_string())
}

const FUR: [&str; 5] =
    ["volume.builder=fur", "volume.nx=16", "volume.ny=16", "volume.nz=10", "fur.hairs=200"];

#[test]
fn colours_are_read_in_their_order_up_to_the_first_that_is_missing() {
    let [a, b] = ["volume.color=[0.1,0.2,0.3]", "volume.color_2=[0.4,0.5,0.6]"];
    let ramp = |sets: &[&str]| with(&[&FUR, sets].concat()).expect("a scene").recipes[0].ramp;
    let [first, second] = [Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.4, 0.5, 0.6)];
    assert_eq!(ramp(&[]), Ramp::WHITE);
    assert_eq!(ramp(&[a]), Ramp::new(&[first], 0.5));
    assert_eq!(ramp(&[a, b, "volume.k_s=0.25"]), Ramp::new(&[first, second], 0.25));
    assert_eq!(ramp(&[a, "volume.color_3=[0,1,0]"]), Ramp::new(&[first], 0.5));
}

#[test]
fn colours_that_cannot_be_shown_are_refused() {
    let color = "volume.color=[0.1,0.2,0.3]";
    let cases: [(&[&str], &[&str]); 7] = [
        (&["volume.color=[0.1,1.2,0.3]"], &["volume.color", "more light than it receives", "at most 1"]),
        (&[color, "light.reflection=strand"], &["volume.color", "light.reflection=kajiya-kay"]),
        (&[color, "light.reflection=hair"], &["volume.color", "hair", "light.reflection=kajiya-kay"]),
        (
            &["light.reflection=hair", "hair.color=[0.2,1.1,0.3]"],
            &["hair.color", "more light than it receives", "at most 1"],
        ),
        (
            &[color, "light.visibility=march", "light.scattering=multiple"],
            &["volume.color", "light.scattering=single"],
        ),
        (&[color, "volume.color_2=[0,1,0]"], &["volume.color_2", "set volume.builder to another word"]),
        (&["volume.builder=fur", "volume.storage=sparse"], &["volume.storage", "auto"]),
    ];
    for (sets, words) in cases {
        super::refused(with(sets).map(|_| ()), words);
    }
    // Water may have one colour.
    with(&[color]).expect("a scene");
}

#[test]
fn colours_of_shells_go_with_light_that_scatters_many_times() {
    let ring = Scene::preset("torus").expect("a preset");
    let many = ring.with(&["light.scattering=multiple"]).expect("a scene");
    assert!(!many.shells.is_empty() && many.recipes.iter().all(|recipe| recipe.ramp != Ramp::WHITE));
    // A quad with the fur's volume refuses it.
    let quad = ["materials.fur.carrier=face", "light.scattering=multiple"];
    super::refused(
        ring.with(&quad).map(|_| ()).map_err(|e| e.to_string()),
        &["volumes.fur.color", "light.scattering=single"],
    );
}

#[test]
fn settings_of_other_builders_have_no_effect() {
    let fur = with(&FUR).expect("a scene");
    let said = |scene: &Scene, set: &str| {
        let set = set.to_owned();
        !settings_without_effect(scene.with(&[&set]).expect("valid").values().expect("values"), &[set], &[])
            .is_empty()
    };
    for set in [
        "curves.across=20",
        "volume.crest=0.3",
        "volume.coherence=0.5",
        "volume.strands=100",
        "fur.clumping=0.3",
    ] {
        assert!(said(&fur, set), "{set}");
    }
    for set in
        ["fur.lean=1", "curves.h=0.8", "curves.amplitude=0.2", "volume.nx=20", "fur.taper=0", "volume.seed=3"]
    {
        assert!(!said(&fur, set), "{set}");
    }
    let water = with(&[]).expect("a scene");
    assert!(said(&water, "fur.taper=0.2") && said(&water, "volume.color_2=[1,0,0]"));
    assert!(!said(&water, "volume.color=[1,0,0]"));
}

#[test]
fn a_colour_is_changed_without_building_the_fur_again() {
    let scene = with(&[&FUR[..], &["volume.color=[0.1,0.2,0.3]"]].concat()).expect("a scene");
    let mut memo = VolumeMemo::default();
    let mut cost = |scene: &Scene| memo.volumes(scene, 1 << 30, &Unwatched).expect("volumes").1;
    assert_eq!(cost(&scene), Some(Cost::Volume));
    assert_eq!(cost(&scene.with(&["volume.color=[0.5,0.2,0.3]"]).expect("valid")), None);
    // With a second colour the cells need places on the ramp.
    let two = scene.with(&["volume.color_2=[0.5,0.2,0.3]"]).expect("valid");
    assert_eq!(cost(&two), Some(Cost::Volume));
    assert_eq!(cost(&two.with(&["volume.color_2=[0.5,0.9,0.3]"]).expect("valid")), None);
    assert_eq!(cost(&two.with(&["fur.taper=0.1"]).expect("valid")), Some(Cost::Volume));
}

#[test]
fn a_file_of_cells_is_not_read_where_another_builder_makes_them() {
    let scene = with(&[&FUR[..], &["volume.file=nowhere.npz"]].concat()).expect("a scene");
    assert!(scene.recipes[0].file.is_none() && scene.recipes[0].matter.is_some());
}

#[test]
fn fur_that_does_not_fit_is_refused_before_it_is_built_without_advice_that_leads_nowhere() {
    let limits = Limits { memory: 50 << 20, ..Limits::default() };
    let sets = ["volume.builder=fur", "volume.nx=200", "volume.ny=200", "volume.nz=200"].map(str::to_owned);
    let told = Scene::load(Path::new("fig5"), &sets, &limits).map(|_| ()).map_err(|e| e.to_string());
    super::refused(told.clone(), &["200×200×200", "244.1 MiB", "volume.nx"]);
    assert!(!told.unwrap_err().contains("sparse"));
}

#[test]
fn cloth_that_is_cut_off_by_its_volume_is_told() {
    let told = |sets: &[&str]| {
        let cloth =
            ["volume.builder=cloth", "volume.nx=40", "volume.ny=40", "cloth.warp=10", "cloth.weft=10"];
        let scene = with(&[&cloth[..], sets].concat()).expect("a scene");
        let volumes = scene.volumes(1 << 30, &Unwatched).expect("volumes");
        scene.warnings(&volumes).into_iter().find(|words| words.contains("cuts the cloth off"))
    };
    // A yarn is 4 × 0.95 cells wide, and its middle swings by 0.4 of that to each side: 6.84 cells.
    assert_eq!(told(&["volume.nz=7"]), None);
    let words = told(&["volume.nz=6"]).expect("a warning");
    assert!(words.contains("volume.nz = 6") && words.contains("7 cells thick"), "{words}");
}

#[test]
fn mountains_and_grains_take_their_own_keys_alone_and_no_sparse_storage() {
    let size = ["volume.nx=16", "volume.ny=16", "volume.nz=10"];
    let of =
        |builder: &str| with(&[&size[..], &[&format!("volume.builder={builder}")]].concat()).expect("valid");
    let said = |scene: &Scene, set: &str| {
        let set = set.to_owned();
        let scene = scene.with(&[&set]).expect("valid");
        !settings_without_effect(scene.values().expect("values"), &[set], &[]).is_empty()
    };
    let (mountain, grains) = (of("mountain"), of("grains"));
    for set in ["curves.amplitude=0.2", "fur.lean=1", "curves.across=9", "cloth.twist=1", "grains.filled=0.2"]
    {
        assert!(said(&mountain, set), "{set}");
    }
    for set in
        ["curves.h=0.8", "mountain.relief=0.2", "mountain.stone_size=0.1", "volume.seed=3", "volume.k_d=1"]
    {
        assert!(!said(&mountain, set), "{set}");
    }
    for [set, switch] in [
        ["mountain.blade_lean=1", "mountain.blades=0"],
        ["mountain.stone_size=0.1", "mountain.scree=0"],
        ["mountain.blades=10", "mountain.soil=0"],
        ["mountain.beds=0.2", "mountain.fracture=0"],
    ] {
        assert!(!said(&mountain, set), "{set}");
        assert!(said(&mountain.with(&[switch]).expect("valid"), set), "{set} with {switch}");
    }
    for set in
        ["curves.h=0.8", "curves.amplitude=0.2", "mountain.moss=0.5", "fur.hairs=9", "volume.file=a.npz"]
    {
        assert!(said(&grains, set), "{set}");
    }
    for set in ["grains.filled=0.2", "grains.grain_size=3", "volume.nx=20", "volume.seed=3", "volume.k_s=1"] {
        assert!(!said(&grains, set), "{set}");
    }
    for builder in ["mountain", "grains"] {
        let sets = [&format!("volume.builder={builder}"), "volume.storage=sparse"];
        super::refused(with(&sets).map(|_| ()), &["volume.storage", "auto"]);
    }
}
