//! Limits of the walk.

use crate::engine::gpu::{assert_parity, both, renderer, scene};
use taki::engine::cpu;
use taki::scene::Scene;
use taki::util::monitor::Unwatched;

/// Two sheets, one behind the other, with clear water of 40 cells each.
fn two_sheets(more: &[&str]) -> Scene {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("s.toml");
    let behind = "[[-9, -9, -2], [9, -9, -2], [9, 9, -2], [-9, 9, -2]]";
    let front = "[[-0.5, -0.5, 0.5], [0.5, -0.5, 0.5], [0.5, 0.5, 0.5], [-0.5, 0.5, 0.5]]";
    let quads = [front, behind].map(|corners| format!("[[quads]]\ncorners = {corners}\n"));
    std::fs::write(&file, format!("version = 1\nbase = \"front\"\n{}", quads.concat())).unwrap();
    let size = ["trace.sigma=0", "image.width=8", "image.height=8", "camera.fov=10"];
    scene(file.to_str().unwrap(), &[&size, more].concat())
}

#[test]
fn max_cells_counts_in_each_sheet_anew() {
    let walked = |scene: &Scene| {
        let volume = scene.volume(1 << 30, &Unwatched).unwrap();
        cpu::render(scene, &volume, &scene.mesh(), true, &Unwatched).unwrap().counts[27][0]
    };
    let whole = walked(&two_sheets(&[]));
    assert!(whole >= 80, "{whole}");
    for most in [1, 10, 39] {
        let limit = format!("trace.max_cells={most}");
        assert_eq!(walked(&two_sheets(&[&limit])), 2 * most);
        assert_eq!(walked(&two_sheets(&[&limit, "trace.layers=1"])), most);
        if let Some(mut renderer) = renderer("max_cells") {
            assert_parity(&limit, &both(&mut renderer, &two_sheets(&[&limit])));
        }
    }
}
