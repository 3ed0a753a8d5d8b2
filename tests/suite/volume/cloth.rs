//! §2 The builder of cloth: weaves, what yarns cover, and what does not change them.

use glam::Vec3;
use taki::util::monitor::Unwatched;
use taki::volume::{ClothSpec, VolumeTexture, Weave, WeaveName};

/// Flat yarns of straight fibres, with gaps between them.
fn plain() -> ClothSpec {
    ClothSpec {
        size: [80, 80, 16],
        yarns: [4, 4],
        weave: Weave::named(WeaveName::Plain),
        thickness: 0.5,
        fibres: 400,
        fibre_width: 0.1,
        twist: 0.0,
        crimp: 0.0,
        fuzz: 0.0,
        seed: 4,
        alpha: 1.0,
        k_d: 0.8,
        shade: 0.0,
        k_s: None,
    }
}

fn build(spec: &ClothSpec) -> VolumeTexture {
    spec.build(&Unwatched).expect("cloth")
}

#[test]
fn weaves_repeat_as_weavers_know_them() {
    let of = |name| Weave::named(name);
    let rows = |weave: &Weave| {
        let [columns, rows] = weave.repeat().map(|n| n as usize);
        let row =
            |j: usize| (0..columns).map(|i| if weave.is_warp_on_top(i, j) { '1' } else { '0' }).collect();
        (0..rows).map(row).collect::<Vec<String>>().join("/")
    };
    assert_eq!(rows(&of(WeaveName::Plain)), "10/01");
    for name in [WeaveName::Plain, WeaveName::Twill, WeaveName::Satin] {
        let weave = of(name);
        assert_eq!(Weave::of_text(&rows(&weave)), Some(weave.clone()), "{name:?}");
        // Each yarn of the warp lies on top as often, and so does each of the weft.
        let [n, m] = weave.repeat().map(|n| n as usize);
        let on_top = |i: usize| (0..m).filter(|&j| weave.is_warp_on_top(i, j)).count();
        assert!((0..n).all(|i| on_top(i) == on_top(0)), "{name:?}");
    }
    // A twill's diagonal moves by one yarn from row to row.
    let twill = of(WeaveName::Twill);
    assert!((0..4).all(|j| (0..4).all(|i| twill.is_warp_on_top(i, j + 1) == twill.is_warp_on_top(i + 1, j))));
    // No two neighbours of a satin bind at the same place.
    let satin = of(WeaveName::Satin);
    let binds = |j: usize| (0..5).find(|&i| !satin.is_warp_on_top(i, j)).expect("a binding");
    assert!((0..4).all(|j| binds(j).abs_diff(binds(j + 1)) > 1));
    for text in ["", "1/10", "12", "10//01", "satin5", "１０"] {
        assert_eq!(Weave::of_text(text), None, "{text:?}");
    }
}

#[test]
fn yarns_cover_what_their_diameters_say() {
    // Of the face, c = d of the pitch is covered by each kind, and c + c − c² by both: 0.75.
    let volume = build(&plain());
    let covered = |x: u32, y: u32| (0..16).any(|z| volume.cell(x, y, z).rho_code() > 0);
    let all = (0..80).flat_map(|y| (0..80).map(move |x| (x, y)));
    let share = all.filter(|&(x, y)| covered(x, y)).count() as f64 / 6400.0;
    // A cell that a yarn only touches counts: at most one on each side of its ten.
    assert!((0.74..0.84).contains(&share), "{share}");
    // Fibres' length × width is that of the cells, where none is full.
    let thin = ClothSpec { fibres: 20, fibre_width: 0.02, ..plain() };
    let sum: f64 = build(&thin).cells.iter().map(|cell| f64::from(cell.rho())).sum();
    let want = 8.0 * 20.0 * 80.0 * 0.02 * 10.0;
    assert!((sum / want - 1.0).abs() < 0.02, "{sum} {want}");
}

#[test]
fn fibres_run_along_their_yarns_and_places_tell_warp_from_weft() {
    let volume = build(&plain());
    // In the middle of gaps of the weft lies the warp alone, and the other way round.
    for (at, along) in [([10, 0], Vec3::Y), ([0, 10], Vec3::X)] {
        let cells: Vec<_> =
            (0..16).map(|z| volume.cell(at[0], at[1], z)).filter(|c| c.rho_code() > 0).collect();
        assert!(cells.len() >= 9, "{at:?}");
        for cell in cells {
            assert!(cell.v().dot(along) > 0.999, "{at:?}: {}", cell.v());
            assert_eq!(cell.k_codes().1, if along == Vec3::Y { 0 } else { 255 });
        }
    }
    // Twisted fibres lean by 2π·turns·r/pitch at most, where r is the yarn's radius.
    let twisted = build(&ClothSpec { twist: 0.5, ..plain() });
    let steepest = (0..16)
        .flat_map(|z| (0..20).map(move |x| (x, z)))
        .map(|(x, z)| twisted.cell(x, 0, z))
        .filter(|cell| cell.rho_code() > 0)
        .map(|cell| (cell.v().x.hypot(cell.v().z) / cell.v().y.abs()).abs())
        .fold(0.0f32, f32::max);
    let want = std::f32::consts::TAU * 0.5 * 4.5 / 20.0;
    assert!(steepest < want * 1.05 && steepest > want * 0.7, "{steepest} {want}");
}

#[test]
fn the_yarn_on_top_is_seen_first() {
    let spec = ClothSpec { crimp: 0.5, thickness: 0.6, size: [80, 80, 32], ..plain() };
    let volume = build(&spec);
    for (warp, weft) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
        let [x, y] = [warp, weft].map(|n: u32| n * 20 + 10);
        let first = (0..32).map(|z| volume.cell(x, y, z)).find(|cell| cell.rho_code() > 0).expect("a yarn");
        let is_warp = spec.weave.is_warp_on_top(warp as usize, weft as usize);
        assert_eq!(first.k_codes().1 == 0, is_warp, "{warp} {weft}: {first:?}");
    }
}

#[test]
fn one_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let spec = ClothSpec { twist: 0.3, crimp: 0.4, fuzz: 3.0, shade: 0.2, ..plain() };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| build(&spec))
    };
    let one = on(1);
    assert_eq!(one, on(4));
    assert_ne!(one, build(&ClothSpec { seed: 5, ..spec }));
}
