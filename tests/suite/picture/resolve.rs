//! Tone curves: grey stays grey, and brighter light is never shown darker. Dither: the mean is exact.
//! Vignette and grain: closed forms.

use crate::engine::gpu::scene;
use taki::engine::{RenderOptions, cpu};
use taki::output::frame::{Encoding, samples_of};
use taki::picture::resolve::Resolver;
use taki::picture::{Dither, Look, Tone};
use taki::util::monitor::Unwatched;
use taki::util::window::Window;

fn look(tone: Tone) -> Look {
    Look { tone, dither: Dither::None, ..scene("front", &[]).image.look }
}

fn of(tone: Tone, linear: [f32; 3]) -> [u8; 3] {
    let [r, g, b, _] = Resolver::new(&look(tone)).pixel([linear[0], linear[1], linear[2], 1.0], [0; 2]);
    [r, g, b]
}

#[test]
fn a_dithered_gradient_has_no_bands_and_the_right_mean_in_every_row_and_column() {
    let dithered = Resolver::new(&Look { dither: Dither::Pattern, ..look(Tone::None) });
    let grey = |linear: f32| [linear, linear, linear, 1.0];
    // 128 rows of one step of 255: without dither two flat bands.
    let exact = |row: u32| dithered.encoded(grey(0.2 + row as f32 * 2.7e-5), [0; 2])[0] * 255.0;
    let (first, last) = (exact(0), exact(127));
    assert!(last - first > 0.5 && last - first < 1.5, "{first} to {last}");
    let mut columns = [0.0; 128];
    let mut means = Vec::new();
    for row in 0..128 {
        let linear = 0.2 + row as f32 * 2.7e-5;
        let bytes = (0..128).map(|x| dithered.pixel(grey(linear), [x + 7000, row + 300]));
        let mut sum = 0.0;
        for (x, [r, g, b, a]) in bytes.enumerate() {
            assert!(r == g && g == b && a == 255, "grey stays grey");
            let error = f32::from(r) - exact(row);
            assert!(error.abs() <= 1.0, "{r} for {}", exact(row));
            columns[x] += error;
            sum += f32::from(r);
        }
        means.push(sum / 128.0);
        assert!((sum / 128.0 - exact(row)).abs() < 0.06, "row {row}: {} for {}", sum / 128.0, exact(row));
    }
    columns.iter().for_each(|sum| assert!((sum / 128.0).abs() < 0.06, "{columns:?}"));
    // What is exact stays as it is, black and white above all.
    for (linear, byte) in [(0.0, 0), (1.0, 255), (9.0, 255)] {
        assert!((0..4000).all(|i| dithered.pixel(grey(linear), [i, 3 * i])[1] == byte), "{linear}");
    }
    // The twin: rounding to the nearest value shows bands.
    let flat = Resolver::new(&look(Tone::None));
    let rows: std::collections::BTreeSet<u8> =
        (0..128).map(|row| flat.pixel(grey(0.2 + row as f32 * 2.7e-5), [0, row])[0]).collect();
    assert!(rows.len() == 2, "{rows:?}");
}

#[test]
fn grey_stays_grey_and_more_light_is_never_darker_in_every_tone_curve() {
    for tone in [Tone::None, Tone::Filmic, Tone::Agx] {
        let mut last = 0;
        for step in -1600..=1600 {
            let x = (step as f32 / 100.0).exp2();
            let [r, g, b] = of(tone, [x; 3]);
            // The rows of AgX's published matrices sum to 1.0001, so half a step of 255 may round either way.
            assert!(r.abs_diff(g) <= 1 && g.abs_diff(b) <= 1, "{tone:?} {x}: {r} {g} {b}");
            assert!(g >= last, "{tone:?}: {x} gives {g} after {last}");
            last = g;
        }
        assert!(last >= 254, "{tone:?} ends at {last}");
        assert_eq!(of(tone, [0.0; 3]), [0; 3], "{tone:?}");
    }
}

#[test]
fn agx_shows_middle_grey_in_the_middle_and_is_white_four_stops_and_the_rest_above_it() {
    // At the curve's pivot, 0.18 is encoded as one half. The fit is good to some thousandths.
    let [_, grey, _] = of(Tone::Agx, [0.18; 3]);
    assert!(grey.abs_diff(128) <= 3, "{grey}");
    // The curve ends 4.026 stops above 1.
    let [_, bright, _] = of(Tone::Agx, [16.3; 3]);
    let [_, less, _] = of(Tone::Agx, [8.0; 3]);
    assert!(bright >= 254 && less < bright, "{less} {bright}");
}

#[test]
fn agx_leads_a_saturated_light_to_white_where_filmic_keeps_it_saturated() {
    let blue = |tone, stops: f32| of(tone, [0.0, 0.0, stops.exp2()]);
    let channel = |c: usize| (0..14).map(|stops| blue(Tone::Agx, stops as f32)[c]).collect::<Vec<_>>();
    assert!(channel(0).windows(2).all(|w| w[1] >= w[0]), "{:?}", channel(0));
    assert!(blue(Tone::Agx, 13.0).iter().all(|&c| c > 240), "{:?}", blue(Tone::Agx, 13.0));
    assert_eq!(blue(Tone::Filmic, 13.0)[..2], [0, 0]);
}

#[test]
fn what_is_drawn_in_is_drawn_out_again() {
    // Where the curve between the two matrices is straight, one undoes the other and a nearly grey light
    // keeps its tint. Without one of them, red and green would be a fifth closer to each other.
    let [r, g, b] = of(Tone::Agx, [0.22, 0.18, 0.18]);
    // The curve's slope at middle grey is 2.06, over 16.5 stops.
    let want = (0.22f32 / 0.18).log2() * 2.06 / 16.5 * 255.0;
    let got = f32::from(r) - f32::from(g);
    // Each of the two is rounded by up to half a step.
    assert!((got - want).abs() <= 1.0 && g.abs_diff(b) <= 1, "{r} {g} {b}: {got} for {want}");
}

#[test]
fn a_vignette_darkens_the_corners_by_its_stops_and_follows_the_cosine_law() {
    let size = [3001, 2001];
    let light = [0.4, 0.5, 0.6, 1.0];
    let of = |vignette| Resolver::over(&Look { vignette, ..look(Tone::None) }, size);
    for stops in [0.5, 1.0, 3.0] {
        let share = |at: [u32; 2]| of(stops).exposed(light, at)[1] / 0.5;
        for corner in [[0, 0], [3000, 0], [0, 2000], [3000, 2000]] {
            let seen = -share(corner).log2();
            assert!((seen - stops).abs() < 0.003 * stops, "{stops} stops: {seen} in {corner:?}");
        }
        assert_eq!(share([1500, 1000]), 1.0, "the middle");
        // A picture whose corner lies at an angle of which cos⁴ is that dark.
        let tan_corner = (2f64.powf(f64::from(stops) / 2.0) - 1.0).sqrt();
        for at in [[700u32, 1900u32], [2900, 1000], [1500, 400]] {
            let away = (f64::from(at[0]) - 1500.0).hypot(f64::from(at[1]) - 1000.0);
            let tan = tan_corner * away / 1500.5f64.hypot(1000.5);
            let truth = (1.0 / (1.0 + tan * tan)).powi(2);
            assert!((f64::from(share(at)) - truth).abs() < 1e-4, "{stops} stops at {at:?}");
        }
    }
    // Without the size of the image, and without stops, nothing is darkened.
    let alone = Resolver::new(&Look { vignette: 3.0, ..look(Tone::None) });
    assert_eq!(alone.exposed(light, [0, 0]), [0.4, 0.5, 0.6]);
    assert_eq!(of(0.0).exposed(light, [0, 0]), [0.4, 0.5, 0.6]);
}

#[test]
fn grain_has_the_deviation_that_is_asked_for_and_leaves_black_and_white() {
    let of = |grain_seed| Resolver::new(&Look { grain: 0.03, grain_seed, ..look(Tone::None) });
    let (clean, grainy) = (Resolver::new(&look(Tone::None)), of(7));
    for linear in [0.0f32, 0.05, 0.214, 0.6, 1.0] {
        let light = [linear, linear, linear, 1.0];
        let middle = f64::from(clean.encoded(light, [0; 2])[0]);
        let noise: Vec<f64> =
            (0..40_000).map(|i| f64::from(grainy.encoded(light, [i % 200, i / 200])[0]) - middle).collect();
        let mean = noise.iter().sum::<f64>() / 40_000.0;
        let deviation = (noise.iter().map(|x| x * x).sum::<f64>() / 40_000.0).sqrt();
        let truth = 0.03 * 4.0 * middle * (1.0 - middle);
        assert!(mean.abs() < 0.03 * truth + 1e-9, "{linear}: mean {mean}");
        assert!((deviation - truth).abs() < 0.02 * truth + 1e-7, "{linear}: {deviation} for {truth}");
        // Neighbours along a row and along a column have nothing to do with each other.
        for step in [1, 200] {
            let pairs = noise.iter().zip(&noise[step..]);
            let shared = pairs.map(|(a, b)| a * b).sum::<f64>() / 40_000.0;
            assert!(shared.abs() <= 0.02 * truth * truth + 1e-12, "{linear}: {shared}");
        }
    }
    // All channels have the same grain, and another seed another one.
    let [r, g, b] = of(7).encoded([0.2, 0.2, 0.2, 1.0], [5, 9]);
    assert!(r == g && g == b && of(8).encoded([0.2, 0.2, 0.2, 1.0], [5, 9])[0] != r);
}

#[test]
fn a_crop_has_the_vignette_and_the_grain_of_the_whole_picture_in_8_and_16_bits() {
    let scene = scene(
        "front",
        &["image.width=48", "image.height=40", "image.samples=1", "image.vignette=2", "image.grain=0.05"],
    );
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    let render = |window| {
        let options = RenderOptions { window, ..Default::default() };
        cpu::render_with(&scene, &volumes, &scene.mesh(), &options, &mut Default::default(), &Unwatched)
            .expect("a frame")
    };
    let (whole, size) = (render(None), [48, 40]);
    let window = Window { x: 31, y: 5, width: 13, height: 22 };
    let part = render(Some(window));
    let samples = |frame, window| {
        let encoding = Encoding { bits: 16, ..Encoding::DISPLAY };
        samples_of(frame, encoding, &scene.image.look, window, size)
    };
    let [all, own] = [samples(&whole, Window::whole(size)), samples(&part, window)];
    for (i, pixel) in window.each().enumerate() {
        let at = Window::whole(size).index(pixel);
        assert_eq!(part.picture[i], whole.picture[at], "{pixel:?}");
        assert_eq!(own[6 * i..][..6], all[6 * at..][..6], "{pixel:?}");
    }
}
