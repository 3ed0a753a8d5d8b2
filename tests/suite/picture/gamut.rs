//! Primaries of linear light against published matrices.

use glam::{DMat3, DVec3};
use taki::picture::Gamut;

/// Matrix of three rows.
fn rows(rows: [[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(&rows).transpose()
}

fn assert_near(what: &str, got: DMat3, right: DMat3, allowed: f64) {
    let worst = (got - right).to_cols_array().into_iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    assert!(worst <= allowed, "{what}: {got} differs from {right} by {worst}");
}

#[test]
fn rec_2020_is_that_of_the_itu() {
    // Rec. ITU-R BT.2087-0, M2, to four digits.
    let published = rows([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]]);
    assert_near("Rec. 2020", Gamut::Rec2020.from_rec709().expect("another"), published, 5e-5);
}

#[test]
fn acescg_is_that_of_the_aces_configuration_of_opencolorio() {
    // Linear Rec. 709 to ACEScg by OpenColorIO 2.6, in its configuration cg-config-v2.2.0_aces-v1.3.
    let published = rows([
        [0.613_097_402_4, 0.339_523_146_2, 0.047_379_451_4],
        [0.070_193_722_5, 0.916_353_879_5, 0.013_452_398_1],
        [0.020_615_592_9, 0.109_569_773, 0.869_814_634_2],
    ]);
    assert_near("ACEScg", Gamut::Acescg.from_rec709().expect("another"), published, 5e-6);
}

#[test]
fn grey_stays_grey_and_rec_709_stays_as_it_is() {
    assert_eq!(Gamut::Rec709.from_rec709(), None);
    for gamut in [Gamut::Acescg, Gamut::Rec2020] {
        let m = gamut.from_rec709().expect("another");
        assert!((m * DVec3::ONE - DVec3::ONE).length() < 1e-9, "{gamut:?}");
        // No colour of Rec. 709 lies outside.
        assert!(m.to_cols_array().into_iter().all(|x| x > 0.0), "{gamut:?}");
        assert_eq!(Gamut::of(&gamut.chromaticities()), Some(gamut));
    }
    assert_eq!(Gamut::ALL.map(Gamut::word).as_slice(), Gamut::WORDS);
}
