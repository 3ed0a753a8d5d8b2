//! Torn sheets: where they are torn, and how large the holes are.

use taki::mapping::GRAVITY;

use super::sheet::{plumb, read};

#[test]
fn a_free_fall_tears_as_it_thins_and_as_time_goes_by() {
    let v0 = 1.5f64;
    let scene = plumb(&format!("segments = 9\nv0 = {v0}\ntear = 0.7"));
    let speed = |y: f64| (v0 * v0 + 2.0 * GRAVITY * (3.0 - y)).sqrt();
    let open = |y: f64| 0.7 * (1.0 - v0 / speed(y)) * (speed(y) - v0) / (speed(-2.0) - v0);
    for quad in &scene.quads {
        let ys = [quad.corners[0].y, quad.corners[3].y];
        for (y, found) in ys.into_iter().zip(quad.tear.open) {
            let want = open(f64::from(y));
            // Corners are float32.
            assert!((f64::from(found) - want).abs() < 1e-5, "{found} and {want} at {y}");
        }
    }
    assert_eq!(scene.quads[0].tear.open[0], 0.0, "the lip is whole");
    assert!(plumb("").quads.iter().all(|quad| !quad.is_torn() && quad.tear.lattice == [0; 2]));
}

#[test]
fn a_sheet_that_grows_narrow_as_it_grows_fast_is_not_torn() {
    // 2 m at 1 m/s become 0.1 m at 10 m/s, so the sheet is twice as thick.
    let foot = 3.0 - 99.0 / (2.0 * GRAVITY);
    let text = format!(
        "[sheets.a]\npoints = [[0, 3, 0], [0, {foot}, 0]]\nwidths = [2.0, 0.1]\nv0 = 1.0\ntear = 1.0\n"
    );
    let scene = read(&text).expect("a scene");
    assert_eq!(scene.quads.last().expect("a quad").tear.open[1], 0.0);
}

#[test]
fn holes_have_the_size_asked_for_in_whole_numbers() {
    let scene = plumb("tear = 1.0\ntear_size = 0.09\n[materials.water]\nrepeat_u = 2.0\nrepeat_v = 0.7");
    let [across, along] = scene.quads[0].tear.lattice;
    // A copy is 1 m wide and 5/0.7 m long.
    assert_eq!([across, along], [11, 10]);
    let huge = plumb("tear = 1.0\ntear_size = 1000.0");
    assert_eq!(huge.quads[0].tear.lattice, [1, 1]);
    let tiny = plumb("tear = 1.0\ntear_size = 0.001\n[materials.water]\nrepeat_v = 0.01");
    assert!(tiny.quads[0].tear.lattice.iter().all(|n| *n <= 4096));
}

#[test]
fn arcs_of_a_splash_are_torn_where_they_spread() {
    let with = |more: &str| read(&format!("[splashes.a]\nfrom = [0, 0, 0]\n{more}")).expect("a scene");
    let scene = with("tear = 1.0\nsegments = 5\n");
    let arcs: Vec<_> = scene.quads.iter().filter(|quad| quad.is_torn()).collect();
    assert!(!arcs.is_empty());
    let most = arcs.iter().map(|quad| quad.tear.open[1]).fold(0.0, f32::max);
    assert!((0.3..1.0).contains(&most), "{most} is torn");
    assert!(with("").quads.iter().all(|quad| !quad.is_torn()));
}
