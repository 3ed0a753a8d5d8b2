//! Keys of skin: what becomes of them, where skin is refused, and what has no effect.

use glam::Vec3;
use taki::light::skin::Tissue;
use taki::scene::{Limits, Scene, settings_without_effect, without_effect};
use taki::volume::Matter;

use super::meshes::Folder;
use super::refused;

/// A ring of skin.
const RING: &str = "version = 1
[volumes.skin]
builder = \"skin\"
nx = 32
ny = 32
nz = 8
[materials.skin]
volume = \"skin\"
carrier = \"shell\"
thickness = 0.02
[meshes.ring]
file = \"taki:torus.glb\"
material = \"skin\"
[trace]
sigma = 400.0
";

fn with(text: &str, sets: &[&str]) -> Result<Scene, String> {
    let folder = Folder::new();
    folder.write("s.toml", text);
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Scene::load(&folder.path("s.toml"), &sets, &Limits::default()).map_err(|e| e.to_string())
}

#[test]
fn tissue_and_surface_become_the_light_of_the_volume() {
    let scene = with(RING, &["volumes.skin.melanin=0.1", "volumes.skin.eta=1.5"]).expect("a scene");
    let recipe = &scene.recipes[0];
    let Some(Matter::Skin(spec)) = &recipe.matter else { panic!("no skin") };
    assert_eq!((spec.size, spec.epidermis_cells), ([32, 32, 8], 0.2));
    let tissue = Tissue { melanin: 0.1, blood: 0.008, oxygen: 0.75 };
    let skin = recipe.skin.expect("light of skin");
    assert_eq!(skin.extinction, tissue.extinction());
    let surface = skin.surface.expect("a surface");
    assert_eq!((surface.eta, surface.roughness), (1.5, 0.35));
    for (i, albedo) in tissue.albedos(0.2).into_iter().enumerate() {
        let ink = recipe.ramp.ink(i as f32 * 85.0).color;
        assert!((ink - albedo).abs().max_element() < 1e-6, "{ink} {albedo}");
    }
    // Colours stand in the place of the tissue's.
    let wax = with(RING, &["volumes.skin.color=[0.99, 0.98, 0.9]"]).expect("a scene");
    assert_eq!(wax.recipes[0].ramp.ink(170.0).color, Vec3::new(0.99, 0.98, 0.9));
}

#[test]
fn skin_is_refused_where_its_light_is_not_known() {
    let face = RING.replace("carrier = \"shell\"\nthickness", "carrier = \"face\"\nthickness");
    refused(with(&face, &[]), &["skin", "shells of meshes", "carrier = \"shell\""]);
    let quad = format!(
        "{RING}[[quads]]\ncorners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nmaterial = \"flat\"\n\
         [materials.flat]\nvolume = \"skin\"\n"
    );
    refused(with(&quad, &[]), &["skin", "shells of meshes"]);
    refused(with(&format!("{RING}[boxes.b]\nvolume = \"skin\"\n"), &[]), &["the box b", "skin"]);
    refused(with(RING, &["volumes.skin.storage=sparse"]), &["volumes.skin.storage", "auto"]);
}

#[test]
fn settings_without_effect_on_skin_are_told() {
    let scene = with(RING, &[]).expect("a scene");
    let said = |scene: &Scene, set: &str| {
        let set = format!("volumes.skin.{set}");
        let scene = scene.with(&[&set]).expect("valid");
        !settings_without_effect(scene.values().expect("values"), &[set], &[]).is_empty()
    };
    for set in ["melanin=0.2", "furrow=0.1", "roughness=0.2", "seed=3", "nx=40", "color=[0.9,0.8,0.7]"] {
        assert!(!said(&scene, set), "{set}");
    }
    for set in ["k_d=0.2", "k_s=0.1", "h=0.5", "amplitude=0.3", "hairs=10", "grain_size=3"] {
        assert!(said(&scene, set), "{set}");
    }
    let smooth = scene.with(&["volumes.skin.plates=0"]).expect("valid");
    assert!(said(&smooth, "furrow=0.1"));
    let wax = scene.with(&["volumes.skin.color=[0.9,0.8,0.7]"]).expect("valid");
    assert!(said(&wax, "melanin=0.2") && said(&wax, "oxygen=0.2") && !said(&wax, "eta=1.2"));
    let cloth = scene.with(&["volumes.skin.builder=cloth"]).expect("valid");
    assert!(said(&cloth, "blood=0.2"));
    // The way out is not another reflection model: none of them is that of skin.
    let hair = scene.with(&["light.reflection=hair"]).expect("valid");
    for scene in [&scene, &hair] {
        let why = |key: &str| without_effect(scene.values().expect("values"), key).expect("told");
        for key in ["volumes.skin.reflection", "volumes.skin.k_d"] {
            assert!(why(key).contains("while volumes.skin.builder is \"skin\""), "{}", why(key));
        }
        for key in ["light.scattering", "light.reflection", "light.p", "hair.melanin"] {
            assert!(why(key).contains("the scene's volumes are skin"), "{}", why(key));
        }
    }
    assert_eq!(without_effect(cloth.values().expect("values"), "light.scattering"), None);
}
