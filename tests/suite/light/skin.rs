//! §5 Absorption and scattering by skin, beside published figures.

use glam::Vec3;
use taki::light::skin::Tissue;

const LIGHT: Tissue = Tissue { melanin: 0.03, blood: 0.01, oxygen: 0.75 };

#[test]
fn coefficients_are_those_of_the_sources() {
    // Jacques 2013: 46 cm⁻¹ at 500 nm, falling with the power 1.421.
    let scattering = Tissue::scattering();
    let want = Vec3::new(46.0 * 0.7537, 46.0 * 0.8733, 46.0 * 1.1052) * 100.0;
    assert!((scattering / want - 1.0).abs().max_element() < 1e-3, "{scattering} {want}");
    // Epidermis of melanosomes alone: 6.6e11·λ^−3.33 is 350, 494 and 857 cm⁻¹.
    let melanosomes = Tissue { melanin: 1.0, ..LIGHT }.epidermis();
    let want = Vec3::new(350.2, 494.4, 858.4) * 100.0;
    assert!((melanosomes / want - 1.0).abs().max_element() < 3e-3, "{melanosomes} {want}");
    // Dermis of blood alone, at the isosbestic point near 550 nm: 230 to 286 cm⁻¹ for any oxygen.
    for oxygen in [0.0, 0.5, 1.0] {
        let blood = Tissue { blood: 1.0, oxygen, ..LIGHT }.dermis();
        assert!((23_000.0..28_700.0).contains(&blood.y), "{blood}");
    }
    let red = |oxygen| Tissue { blood: 1.0, oxygen, ..LIGHT }.dermis().x;
    assert!((red(0.0) / red(1.0) - 9443.6 / 1506.0).abs() < 1e-3, "blood without oxygen is dark red");
    // Without both, 0.33, 0.46 and 1.01 cm⁻¹ are left.
    let bare = Tissue { melanin: 0.0, blood: 0.0, ..LIGHT };
    let want = Vec3::new(33.0, 46.0, 101.0);
    assert!((bare.dermis() / want - 1.0).abs().max_element() < 0.02, "{}", bare.dermis());
    assert_eq!(bare.dermis(), bare.epidermis());
}

#[test]
fn albedos_tell_melanin_and_blood() {
    let [freckled, epidermis, dermis, flushed] = LIGHT.albedos(0.4);
    for (darker, lighter) in [(freckled, epidermis), (epidermis, dermis), (flushed, dermis)] {
        assert!(darker.cmplt(lighter).all() && darker.cmpgt(Vec3::ZERO).all(), "{darker} {lighter}");
        assert!(lighter.cmplt(Vec3::ONE).all());
    }
    // Melanin takes most from blue, blood from green and blue.
    let absorption = LIGHT.epidermis();
    assert!(absorption.z > absorption.y && absorption.y > absorption.x, "{absorption}");
    let lost = (dermis - flushed) / dermis;
    assert!(lost.y > 10.0 * lost.x && lost.z > 5.0 * lost.x, "{lost}");
    // Where there is no epidermis in a layer, it is dermis.
    let [freckled, epidermis, dermis, _] = LIGHT.albedos(0.0);
    assert!(freckled == dermis && epidermis == dermis);
}

#[test]
fn red_goes_farthest() {
    let extinction = LIGHT.extinction();
    assert_eq!(extinction.y, 1.0);
    assert!(extinction.x < 0.9 && extinction.z > 1.1, "{extinction}");
}
