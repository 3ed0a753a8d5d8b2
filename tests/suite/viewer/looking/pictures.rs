//! Layers of a frame as pictures.

use eframe::egui;
use egui_kittest::Harness;
use taki::picture::{Frame, Layer};
use taki::viewer::layer_image::{LayerImage, Legend, layer_image, quad_colour, show_legend};

const MAGENTA: [u8; 4] = [255, 0, 255, 255];

/// A frame of 8 × 8 empty pixels.
fn empty() -> Frame {
    let mut frame = Frame::new(8, 8, true);
    frame.radiance.fill([0.0, 0.0, 0.0, 1.0]);
    frame.picture.fill([10, 20, 30, 255]);
    frame
}

fn surface(frame: &mut Frame) -> &mut taki::picture::Surface {
    frame.surface.as_mut().expect("layers")
}

fn is_nothing(p: [u8; 4]) -> bool {
    let [r, g, b, a] = p;
    a == 255 && r == g && b - r <= 6 && (35..60).contains(&r)
}

fn scale(image: &LayerImage) -> (f32, f32, &'static str) {
    match image.legend {
        Legend::Scale { low, high, unit, .. } => (low, high, unit),
        other => panic!("not a scale: {other:?}"),
    }
}

fn sum(p: [u8; 4]) -> u32 {
    p[..3].iter().map(|&c| c as u32).sum()
}

#[test]
fn the_checker_shows_through_a_picture_with_alpha() {
    let mut frame = empty();
    frame.picture[0] = [250, 0, 0, 0];
    frame.picture[1] = [240, 0, 0, 128];
    let pixels = layer_image(&frame, Layer::Rgb, 1).pixels;
    assert!(is_nothing(pixels[0]), "{:?}", pixels[0]);
    let [r, g, _, a] = pixels[1];
    assert!((138..=146).contains(&r) && (17..=26).contains(&g) && a == 255, "{:?}", pixels[1]);
    assert_eq!(pixels[2..], frame.picture[2..]);
}

#[test]
fn a_frame_without_anything_is_a_checker_without_a_legend() {
    let frame = empty();
    for layer in Layer::ALL {
        let image = layer_image(&frame, layer, 4);
        assert_eq!(image.pixels.len(), 64);
        if layer == Layer::Rgb {
            assert_eq!(image.pixels, frame.picture);
        } else {
            assert!(image.pixels.iter().all(|&p| is_nothing(p)), "{layer:?}");
        }
        if matches!(layer, Layer::Rgb | Layer::Depth | Layer::Cells | Layer::Quad) {
            assert!(matches!(image.legend, Legend::None), "{layer:?}: {:?}", image.legend);
        }
    }
    let bare = Frame { surface: None, ..empty() };
    for layer in Layer::ALL.into_iter().filter(|l| l.of_surface()) {
        let image = layer_image(&bare, layer, 1);
        assert!(image.pixels.iter().all(|&p| is_nothing(p)) && matches!(image.legend, Legend::None));
    }
    for (width, height) in [(0, 0), (0, 5), (1, 1)] {
        for layer in Layer::ALL {
            let pixels = layer_image(&Frame::new(width, height, true), layer, 1).pixels;
            assert_eq!(pixels.len(), (width * height) as usize);
        }
    }
}

#[test]
fn near_is_brighter_and_one_far_pixel_does_not_darken_the_rest() {
    let mut frame = empty();
    for i in 1..64 {
        surface(&mut frame).depth[i] = 2.0 + i as f32 / 63.0;
    }
    let image = layer_image(&frame, Layer::Depth, 1);
    let (low, high, unit) = scale(&image);
    assert_eq!((low, high, unit), (2.0 + 1.0 / 63.0, 3.0, "m"), "the whole range if nothing is far off");
    assert!(is_nothing(image.pixels[0]));
    assert!(sum(image.pixels[1]) > sum(image.pixels[30]) && sum(image.pixels[30]) > sum(image.pixels[63]));

    surface(&mut frame).depth[63] = 1e6;
    surface(&mut frame).depth[62] = f32::INFINITY;
    surface(&mut frame).depth[61] = f32::NAN;
    let image = layer_image(&frame, Layer::Depth, 1);
    let (low, high, _) = scale(&image);
    assert!(low == 2.0 + 1.0 / 63.0 && high > 2.9 && high < 4.0, "{low} {high}");
    assert_eq!((image.pixels[62], image.pixels[61]), (MAGENTA, MAGENTA));
    assert!(sum(image.pixels[1]) > sum(image.pixels[30]) && sum(image.pixels[60]) > sum(image.pixels[63]));
}

#[test]
fn a_single_depth_is_as_bright_as_the_nearest() {
    let mut frame = empty();
    surface(&mut frame).depth[9] = 4.0;
    let image = layer_image(&frame, Layer::Depth, 1);
    assert_eq!(scale(&image), (4.0, 4.0, "m"));
    assert!(sum(image.pixels[9]) > 600, "{:?}", image.pixels[9]);
    assert!(is_nothing(image.pixels[10]));
}

#[test]
fn cells_are_a_mean_over_the_samples_and_zero_is_nothing() {
    let mut frame = empty();
    for i in 1..64 {
        frame.counts[i] = [4 * i as u32, 7];
    }
    let image = layer_image(&frame, Layer::Cells, 4);
    assert_eq!(scale(&image), (0.0, 63.0, "cells"));
    assert!(is_nothing(image.pixels[0]));
    assert!(!is_nothing(image.pixels[1]) && sum(image.pixels[63]) > sum(image.pixels[20]));
    assert_eq!(scale(&layer_image(&frame, Layer::Cells, 0)).1, 252.0, "0 samples count as one");
}

#[test]
fn transmittance_goes_from_0_to_1_where_cells_were_walked() {
    let mut frame = empty();
    for (i, t) in [0.0, 0.5, 1.0, f32::NAN].into_iter().enumerate() {
        frame.counts[i] = [3, 0];
        frame.radiance[i][3] = t;
    }
    let image = layer_image(&frame, Layer::Transmittance, 1);
    assert_eq!(scale(&image), (0.0, 1.0, ""));
    assert!(sum(image.pixels[0]) < sum(image.pixels[1]) && sum(image.pixels[1]) < sum(image.pixels[2]));
    assert_eq!(image.pixels[3], MAGENTA);
    assert!(is_nothing(image.pixels[4]));
}

#[test]
fn coordinates_normals_and_quads_have_their_colours() {
    let mut frame = empty();
    let s = surface(&mut frame);
    s.quad[..4].copy_from_slice(&[1, 2, 3, 1]);
    s.uv[..4].copy_from_slice(&[[0.0, 1.0], [0.5, 0.25], [f32::NAN, 0.0], [1.0, 0.0]]);
    s.normal[..4].copy_from_slice(&[[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [0.0; 3]]);
    let uv = layer_image(&frame, Layer::Uv, 1);
    assert_eq!(uv.pixels[..4], [[0, 255, 0, 255], [128, 64, 0, 255], MAGENTA, [255, 0, 0, 255]]);
    assert!(is_nothing(uv.pixels[4]) && matches!(uv.legend, Legend::Uv));
    let normal = layer_image(&frame, Layer::Normal, 1);
    assert_eq!(normal.pixels[..3], [[128, 128, 255, 255], [0, 128, 128, 255], MAGENTA]);
    assert!(is_nothing(normal.pixels[3]) && matches!(normal.legend, Legend::Normal));
    let quad = layer_image(&frame, Layer::Quad, 1);
    let [r, g, b] = quad_colour(2);
    assert_eq!(quad.pixels[2], [r, g, b, 255]);
    assert_eq!(quad.pixels[0], quad.pixels[3]);
    assert!(is_nothing(quad.pixels[4]) && matches!(quad.legend, Legend::Quads(3)));
}

#[test]
fn quads_near_in_number_differ_clearly_and_none_is_magenta_or_the_checker() {
    for quad in 0..500u32 {
        let [r, g, b] = quad_colour(quad);
        assert!(!is_nothing([r, g, b, 255]) && [r, g, b, 255] != MAGENTA);
        for near in 1..=12 {
            let other = quad_colour(quad + near);
            let distance: u32 = (0..3).map(|c| [r, g, b][c].abs_diff(other[c]) as u32).sum();
            assert!(distance > 60, "quads {quad} and {}: {distance}", quad + near);
        }
    }
}

#[test]
fn the_picture_is_the_frames_but_for_values_that_are_not_finite() {
    let mut frame = empty();
    frame.radiance[5][1] = f32::NAN;
    frame.radiance[6][3] = f32::INFINITY;
    let image = layer_image(&frame, Layer::Rgb, 1);
    assert_eq!((image.pixels[5], image.pixels[6]), (MAGENTA, MAGENTA));
    assert_eq!(image.pixels[7], frame.picture[7]);
    assert!(matches!(image.legend, Legend::None));
}

#[test]
fn a_legend_names_its_layer_its_ends_and_its_unit() {
    use egui_kittest::kittest::Queryable;
    let map = |_: f32| [1, 2, 3];
    let legends = [
        (
            Layer::Depth,
            Legend::Scale { low: 1.5, high: 3.25, unit: "m", map },
            vec!["depth", "1.50", "3.25 m"],
        ),
        (
            Layer::Cells,
            Legend::Scale { low: 0.0, high: 63.0, unit: "cells", map },
            vec!["cells", "0", "63 cells"],
        ),
        (Layer::Uv, Legend::Uv, vec!["uv"]),
        (Layer::Normal, Legend::Normal, vec!["normal"]),
        (Layer::Quad, Legend::Quads(48), vec!["quad", " … 48"]),
    ];
    for (layer, legend, words) in legends {
        let harness = Harness::new_ui(move |ui: &mut egui::Ui| show_legend(ui, layer, &legend));
        for word in words {
            harness.get_by_label(word);
        }
    }
    let harness = Harness::new_ui(|ui: &mut egui::Ui| show_legend(ui, Layer::Rgb, &Legend::None));
    assert!(harness.query_by_label("rgb").is_none());
}
