//! Boxes in scene files: their places, what scenes print of them, and every slip.

use glam::DVec3;
use taki::scene::Scene;

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
    assert!(said("volume.nx").is_some_and(|why| why.contains("box")));
}
