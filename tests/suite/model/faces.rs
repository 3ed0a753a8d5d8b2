use taki::model::{Face, Primitive, find_name};

fn primitive(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Primitive {
    Primitive { positions: positions.to_vec(), triangles: triangles.to_vec(), ..Primitive::default() }
}

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn both_ways_of_cutting_a_quad_are_undone() {
    let quad = [Face::Quad([0, 1, 2, 3])];
    assert_eq!(primitive(&SQUARE, &[[0, 1, 2], [0, 2, 3]]).faces(), quad);
    assert_eq!(primitive(&SQUARE, &[[0, 1, 3], [1, 2, 3]]).faces(), quad);
}

#[test]
fn triangles_that_are_no_quad_stay_triangles() {
    let two = [Face::Triangle([0, 1, 2]), Face::Triangle([0, 2, 3])];
    let mut concave = SQUARE;
    concave[1] = [0.5, 0.9, 0.0];
    concave[3] = [-1.0, 1.0, 0.0];
    let mut folded = SQUARE;
    folded[3] = [0.5, 0.5, 1.0];
    for corners in [concave, folded] {
        assert_eq!(primitive(&corners, &[[0, 1, 2], [0, 2, 3]]).faces(), two, "{corners:?}");
    }
    // Two that share no edge, and two that share one in the same direction.
    let apart = [[0, 1, 2], [3, 2, 0]];
    assert_eq!(primitive(&SQUARE, &apart).faces(), apart.map(Face::Triangle));
    let turned = [[0, 1, 2], [0, 3, 2]];
    assert_eq!(primitive(&SQUARE, &turned).faces(), turned.map(Face::Triangle));
}

#[test]
fn a_triangle_before_quads_does_not_shift_them() {
    let mut positions = SQUARE.to_vec();
    positions.push([-1.0, 0.5, 0.0]);
    let mesh = primitive(&positions, &[[0, 3, 4], [0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.faces(), [Face::Triangle([0, 3, 4]), Face::Quad([0, 1, 2, 3])]);
}

#[test]
fn a_bent_quad_is_one_quad() {
    let mut bent = SQUARE;
    bent[2][2] = 0.4;
    assert_eq!(primitive(&bent, &[[0, 1, 2], [0, 2, 3]]).faces(), [Face::Quad([0, 1, 2, 3])]);
}

#[test]
fn a_name_with_blanks_is_found_with_underscores_and_a_slip_is_mended() {
    let names = ["Rock", "Wet_stone", "Wet stone", "Fall"];
    assert_eq!(find_name("Wet stone", names), Ok(2));
    assert_eq!(find_name("Wet_stone", names), Ok(1));
    assert_eq!(find_name("Wet stone", ["Rock", "Wet_stone"]), Ok(1));
    assert_eq!(find_name("Wet_stone", ["Rock", "Wet stone"]), Ok(1));
    assert_eq!(find_name("wet stone", names), Err(Some("Wet stone")));
    assert_eq!(find_name("Rokc", names), Err(Some("Rock")));
    assert_eq!(find_name("xyzzy", names), Err(None));
    assert_eq!(find_name("x", []), Err(None));
}
