//! Sheets of mist that turn towards the camera.

use glam::Vec3;

use super::sheet::read;
use taki::scene::Scene;

/// A leaning sheet of mist or water before a camera at `eye`.
fn cloud(eye: Vec3, mist: f32, facing: bool) -> Scene {
    let [x, y, z] = eye.to_array();
    read(&format!(
        "[camera]\neye = [{x}, {y}, {z}]\ntarget = [1, 0, 2]\n
        [materials.fog]\nmist = {mist}\nfacing = {facing}\n
        [sheets.a]\npoints = [[1, -1, 2], [1.2, 1, 2], [0.8, 2, 1.9]]\nwidths = [2.0]\nmaterial = \"fog\"\n"
    ))
    .unwrap_or_else(|e| panic!("{e}"))
}

/// Mean of the corners, and the unit vector along the rows.
fn place(scene: &Scene) -> (Vec3, Vec3) {
    let corners: Vec<Vec3> = scene.quads.iter().flat_map(|quad| quad.corners).collect();
    let middle = corners.iter().sum::<Vec3>() / corners.len() as f32;
    (middle, (scene.quads[0].corners[1] - scene.quads[0].corners[0]).normalize())
}

#[test]
fn mist_faces_the_camera_wherever_it_stands_and_keeps_its_middle() {
    let (middle, rows) = place(&cloud(Vec3::new(1.0, 0.0, 12.0), 0.5, false));
    assert!(rows.distance(Vec3::X) < 1e-6);
    for angle in [-170.0f32, -80.0, -20.0, 0.0, 45.0, 89.0, 130.0] {
        let (sin, cos) = angle.to_radians().sin_cos();
        let eye = Vec3::new(1.0 + 10.0 * sin, 0.7, 2.0 + 10.0 * cos);
        let (turned, rows) = place(&cloud(eye, 0.5, true));
        assert!(turned.distance(middle) < 0.25, "{angle}: {turned} is not about {middle}");
        let view = (eye - turned).with_y(0.0).normalize();
        // The sheet's middle and that of its corners differ by some centimetres.
        assert!(rows.y == 0.0 && rows.dot(view).abs() < 0.03, "{angle}: {rows} to {view}");
        assert!(rows.dot(Vec3::X) > -1e-3, "{angle}: turned by more than a quarter");
    }
}

#[test]
fn water_and_mist_that_is_not_asked_to_stay_where_they_are() {
    let aside = Vec3::new(9.0, 0.0, 3.0);
    let still = place(&cloud(aside, 0.5, false));
    assert_eq!(place(&cloud(aside, 0.0, true)), still);
    assert_ne!(place(&cloud(aside, 0.5, true)), still);
}
