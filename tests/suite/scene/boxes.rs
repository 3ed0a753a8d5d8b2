//! Boxes in scene files: their places, what scenes print of them, and every slip.

use glam::{DAffine3, DQuat, DVec3, Vec3};
use taki::grid::{Grid, write_vdb};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::volume::{ReflectBy, RhoRule, VelocityAt};

use super::meshes::{Folder, PLACE};

fn text(own: &str) -> String {
    format!("{PLACE}[volumes.smoke]\nnx = 20\nny = 40\nnz = 10\n[boxes.b]\nvolume = \"smoke\"\n{own}")
}

fn scene(own: &str) -> Scene {
    Folder::new().scene(&text(own), &[])
}

fn close(a: DVec3, b: DVec3) {
    assert!(a.distance(b) < 1e-9, "{a} {b}");
}

#[test]
fn a_box_has_cubic_cells_or_the_size_that_the_scene_gives() {
    let own = &scene("").boxes[0];
    close(own.sides(), DVec3::new(0.5, 1.0, 0.25));
    close(own.middle(), DVec3::ZERO);
    let own = &scene("size = [2.0, 3.0, 4.0]\nposition = [1.0, -2.0, 5.0]\n").boxes[0];
    close(own.sides(), DVec3::new(2.0, 3.0, 4.0));
    close(own.middle(), DVec3::new(1.0, -2.0, 5.0));
    // Turned about its middle: z up becomes y up.
    let own = &scene("size = [2.0, 3.0, 4.0]\nposition = [1.0, -2.0, 5.0]\nturn = [-90, 0, 0]\n").boxes[0];
    close(own.middle(), DVec3::new(1.0, -2.0, 5.0));
    close(own.world_from_texture.matrix3.z_axis, DVec3::new(0.0, 4.0, 0.0));
    close(own.world_from_texture.matrix3.y_axis, DVec3::new(0.0, 0.0, -3.0));
}

#[test]
fn a_printed_scene_with_boxes_is_the_same_scene() {
    for own in ["", "size = [2.0, 3.0, 4.0]\n", "position = [1.0, -2.0, 5.0]\nturn = [10, 20, 30]\n"] {
        let first = scene(own);
        let again = Folder::new().scene(&first.to_toml(), &[]);
        assert_eq!(first.boxes, again.boxes);
        assert_eq!(first.to_toml(), again.to_toml());
        assert_eq!(first.shells, again.shells);
    }
}

#[test]
fn a_scene_lists_its_boxes() {
    let scene = scene("size = [2.0, 3.0, 4.0]\n");
    let listed = scene.comments();
    let truth = "\n# box b: volume smoke, 2.0000 × 3.0000 × 4.0000 m around [0.0000, 0.0000, 0.0000], \
                 20 × 40 × 10 cells\n";
    assert_eq!(listed, truth);
    let json = &scene.to_json()["derived"]["boxes"][0];
    assert_eq!(json["volume"], "smoke");
    assert_eq!(json["corner"], serde_json::json!([-1.0, -1.5, -2.0]));
}

#[test]
fn light_is_kept_in_columns_of_cells_and_walked_in_one_square() {
    let kept = Folder::new().scene(&text(""), &["light.visibility=cached"]);
    assert_eq!(kept.shells[0].prisms.len(), 2 * 3 * 5);
    assert!(kept.shells[0].light_layers([20, 40, 10]).is_some());
    let walked = Folder::new().scene(&text(""), &["light.visibility=march"]);
    assert_eq!(walked.shells[0].prisms.len(), 2);
}

#[test]
fn a_scene_of_boxes_alone_is_measured_from_them() {
    let scene = scene("position = [6400.0, 0.0, -640.0]\n");
    assert_eq!(scene.camera.origin, DVec3::new(6400.0, 0.0, -640.0));
}

#[test]
fn every_slip_is_told_with_the_way_out() {
    let folder = Folder::new();
    let fault = |text: &str, sets: &[&str], words: &[&str]| {
        let said = format!("{:?}", folder.load(text, sets).expect_err("refused"));
        words.iter().for_each(|word| assert!(said.contains(word), "{said}: no {word:?}"));
    };
    let flow =
        |own: &str| format!("{PLACE}[volumes.s]\nbuilder = \"flow\"\n{own}[boxes.b]\nvolume = \"s\"\n");
    fault(&text("size = [1.0, 0.0, 1.0]\n"), &[], &["boxes.b.size", "above 0"]);
    fault(&text("size = [1e7, 1e7, 1e7]\n"), &[], &["box b reaches", "boxes.b.size"]);
    fault(
        &text("").replace("volume = \"smoke\"", "volume = \"smok\""),
        &[],
        &["boxes.b.volume", "did you mean smoke"],
    );
    fault(&text("scale = 2\n"), &[], &["boxes.b.size"]);
    fault(&text(""), &["trace.attenuation=per-cell"], &["box b", "path-length"]);
    fault(&text(""), &["light.scattering=multiple"], &["box b", "light.scattering=single"]);
    fault(&flow(""), &[], &["volumes.s.source", ".vdb"]);
    fault(&flow("source = \"absent.vdb\"\n"), &[], &["volumes.s.source", "absent.vdb"]);
    fault(&flow("source = \"../up.vdb\"\n"), &[], &["volumes.s.source"]);
    folder.write("bad.vdb", b"nothing of the kind");
    fault(&flow("source = \"bad.vdb\"\n"), &[], &["bad.vdb", "OpenVDB"]);
    fault(&flow("source = \"bad.vdb\"\nreflect = \"grid\"\n"), &[], &["volumes.s.reflect_grid"]);
    fault(&format!("{PLACE}[boxes.b]\n[lights.b]\n[boxes.c]\nvolumes = \"x\"\n"), &[], &["boxes.c.volume"]);
}

#[test]
fn values_without_effect_are_told() {
    let scene = scene("");
    let values = scene.values().expect("its values");
    let said = |key: &str| taki::scene::without_effect(values, key);
    assert!(said("volumes.smoke.rho_scale").is_some_and(|why| why.contains("flow")));
    assert!(said("volumes.smoke.nx").is_none());
    assert!(said("volume.nx").is_some());
}

/// A grid of 6×8×4 voxels of 0.25 m, turned about z, with even matter and flow.
fn grids(folder: &Folder, name: &str) -> DAffine3 {
    let turn = DQuat::from_rotation_z(0.5);
    let to_world =
        DAffine3::from_scale_rotation_translation(DVec3::splat(0.25), turn, DVec3::new(2.0, 1.0, -3.0));
    let (first, size) = ([-2, 5, 1], [6, 8, 4]);
    let fill = |name: &str, value: &[f32]| {
        let values = value.iter().copied().cycle().take(6 * 8 * 4 * value.len()).collect();
        Grid::from_dense(name, value.len(), first, size, values, to_world)
    };
    let all = [
        fill("density", &[2.5]),
        fill("vel", &[0.0, 0.0, 3.0]),
        fill("foam", &[0.5]),
        fill("kd", &[0.25]),
        fill("ks", &[0.75]),
    ];
    write_vdb(&folder.path(name), &all).expect("a file");
    let low = DVec3::new(-2.5, 4.5, 0.5);
    to_world * DAffine3::from_translation(low) * DAffine3::from_scale(DVec3::new(6.0, 8.0, 4.0))
}

fn flow(own: &str) -> String {
    format!("{PLACE}[volumes.s]\nbuilder = \"flow\"\nsource = \"a.vdb\"\n{own}[boxes.b]\nvolume = \"s\"\n")
}

#[test]
fn a_box_of_a_simulation_stands_where_the_simulation_was() {
    let folder = Folder::new();
    let truth = grids(&folder, "a.vdb");
    let scene = folder.scene(&flow("rho_scale = 0.4\n"), &[]);
    let own = &scene.boxes[0];
    for corner in [DVec3::ZERO, DVec3::ONE, DVec3::X, DVec3::new(0.3, 0.9, 0.1)] {
        let at = |place: &DAffine3| place.transform_point3(corner);
        assert!(at(&own.world_from_texture).distance(at(&truth)) < 1e-6);
    }
    assert!(
        scene.comments().contains("6 × 8 × 4 voxels: density density, velocity vel"),
        "{}",
        scene.comments()
    );
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    assert_eq!((volume.size, volume.alpha), ([6, 8, 4], 1.0));
    let cell = volume.cell(3, 4, 2);
    assert_eq!((cell.rho(), cell.v()), (1.0, Vec3::Z));
    // Larger cells, another place and size, and the flow turned with them.
    let text =
        flow("voxels = 2\n") + "position = [1.0, 2.0, 3.0]\nsize = [6.0, 8.0, 4.0]\nturn = [0, 90, 0]\n";
    let scene = folder.scene(&text, &[]);
    // Cells of two voxels begin at even indices: at −2, 4 and 0.
    assert_eq!(scene.recipes[0].water.size, [3, 5, 3]);
    let own = &scene.boxes[0];
    close(own.middle(), DVec3::new(1.0, 2.0, 3.0));
    close(own.sides(), DVec3::new(6.0, 8.0, 4.0));
    close(own.world_from_texture.matrix3.z_axis, DVec3::new(4.0, 0.0, 0.0));
    // The printed scene names the file again.
    let again = folder.scene(&scene.to_toml(), &[]);
    assert_eq!((again.boxes.clone(), again.recipes.clone()), (scene.boxes.clone(), scene.recipes.clone()));
    assert_eq!(scene.references()[0].0, "volumes.s.source");
}

#[test]
fn every_word_of_a_measured_volume_gives_the_variant_of_its_name() {
    let folder = Folder::new();
    grids(&folder, "a.vdb");
    let of = |own: &str| folder.scene(&flow(own), &[]).recipes[0].measured.clone().expect("measured");
    for word in RhoRule::WORDS {
        assert_eq!(of(&format!("rho = {word:?}\n")).rho.word(), *word);
    }
    for word in VelocityAt::WORDS {
        assert_eq!(of(&format!("velocity_at = {word:?}\n")).velocity_at.word(), *word);
    }
    for word in ReflectBy::WORDS {
        assert_eq!(of(&format!("reflect = {word:?}\nreflect_grid = \"foam\"\n")).reflect.word(), *word);
    }
    let stored = folder.scene(&flow("reflect = \"stored\"\n"), &[]);
    let volume = stored.volume(1 << 30, &Unwatched).expect("a volume");
    assert_eq!(volume.cell(3, 4, 2).k_codes(), (64, 191));
    let strands = folder.load(&flow("reflect = \"stored\"\nstrands = 10\n"), &[]);
    let said = format!("{:?}", strands.expect_err("refused"));
    assert!(said.contains("volumes.s.reflect") && said.contains("volumes.s.strands"), "{said}");
}

#[test]
fn grids_that_a_file_does_not_have_are_told_with_those_it_has() {
    let folder = Folder::new();
    grids(&folder, "a.vdb");
    for (own, words) in [
        ("grid = \"smoke\"\n", ["there is no grid", "density, vel, foam"]),
        ("velocity = \"flow\"\n", ["there is no grid", "volumes.s.velocity"]),
        ("velocity = \"foam\"\n", ["no vectors", "volumes.s.velocity=none"]),
        ("reflect = \"grid\"\nreflect_grid = \"age\"\n", ["there is no grid", "volumes.s.reflect_grid"]),
        ("grid = \"vel\"\n", ["holds vectors", "another grid"]),
    ] {
        let loaded =
            folder.load(&flow(own), &[]).and_then(|scene| scene.volume(1 << 30, &Unwatched).map(drop));
        let said = format!("{:?}", loaded.expect_err("refused"));
        words.iter().for_each(|word| assert!(said.contains(word), "{said}: no {word:?}"));
    }
    assert!(folder.load(&flow("velocity = \"none\"\n"), &[]).is_ok());
}
