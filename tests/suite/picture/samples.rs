//! The samples of a pixel: their mean is the pixel's middle for every number of samples, so pictures of any
//! number, and the layers, register.

use crate::engine::gpu::{SURFACE, renderer, scene};
use taki::engine::cpu;
use taki::picture::camera::{CENTRE, sample_numbers, sample_offset};
use taki::picture::{Filter, Frame, Image};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;

const ALL: [Filter; 3] = [Filter::Box, Filter::Gaussian, Filter::BlackmanHarris];

fn image(filter: Filter, samples: u32) -> Image {
    Image { filter, samples, ..scene("front", &[]).image }
}

fn offsets(image: &Image) -> Vec<[f32; 2]> {
    sample_numbers(image).map(|sample| sample_offset(image, sample)).collect()
}

#[test]
fn the_mean_of_any_number_of_samples_is_the_middle_of_the_pixel() {
    for filter in ALL {
        let image = image(filter, 1);
        for samples in (1..=256).chain((257..4096).step_by(61)).chain([4096]) {
            let offsets = offsets(&Image { samples, ..image });
            assert_eq!(offsets.len() as u32, samples);
            for axis in 0..2 {
                let sum = offsets.iter().map(|offset| f64::from(offset[axis])).sum::<f64>();
                let away = sum / f64::from(samples) - 0.5;
                // Two offsets that mirror each other round by 2^-25 and, above 1, by 2^-24.
                assert!(away.abs() <= 6e-8, "{filter:?}, {samples} samples, axis {axis}: {away}");
            }
        }
    }
}

#[test]
fn any_number_of_samples_is_well_spread() {
    for samples in (2..=256).chain([1000, 1001, 4096]) {
        let offsets = offsets(&image(Filter::Box, samples));
        let apart = |i: usize, j: usize| {
            // Pixels repeat, so the distance to the copies in the neighbours counts too.
            let d = [0, 1].map(|c| f64::from(offsets[i][c] - offsets[j][c]));
            let [x, y] = d.map(|d| d - d.round());
            x.hypot(y)
        };
        let pairs = (0..offsets.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let least = pairs.map(|(i, j)| apart(i, j)).fold(f64::INFINITY, f64::min);
        // The nearest of n random points lie 0.5/n apart; those of the best lattice 1.07/√n.
        assert!(least >= 0.5 / f64::from(samples).sqrt(), "{samples} samples: {least}");
    }
}

#[test]
fn more_samples_continue_fewer_of_the_same_parity() {
    for filter in ALL {
        for samples in 1..65 {
            let (few, more) = (offsets(&image(filter, samples)), offsets(&image(filter, samples + 2)));
            assert_eq!(few, more[..samples as usize], "{filter:?}, {samples}");
        }
    }
}

#[test]
fn only_odd_numbers_of_samples_have_one_at_the_centre_and_all_know_where_it_is() {
    for filter in ALL {
        for samples in 1..65 {
            let image = image(filter, samples);
            assert_eq!(sample_offset(&image, CENTRE), [0.5, 0.5]);
            assert_eq!(sample_numbers(&image).contains(&CENTRE), samples % 2 == 1);
        }
    }
}

/// `fig5` at 1/`scale` of its size with that many samples. Its rock does not depend on their number.
fn figure(scale: u32, samples: u32) -> Scene {
    let mut scene = scene("fig5", &["image.rock_error=0"]);
    let image = &mut scene.edit().image;
    (image.width, image.height, image.samples) = (image.width / scale, image.height / scale, samples);
    scene
}

/// Returns by how many pixels `picture` lies to the right of `truth` and below it: the shift by which the
/// truth's slopes explain most of the difference.
fn shift(picture: &Frame, truth: &Frame) -> [f64; 2] {
    let (width, height) = (truth.width as usize, truth.height as usize);
    let mut normal = [0.0; 3];
    let mut right = [0.0; 2];
    for c in 0..3 {
        let at = |frame: &Frame, x: usize, y: usize| f64::from(frame.radiance[y * width + x][c]);
        for y in 1..height - 1 {
            for x in 1..width - 1 {
                let dx = (at(truth, x - 1, y) - at(truth, x + 1, y)) / 2.0;
                let dy = (at(truth, x, y - 1) - at(truth, x, y + 1)) / 2.0;
                let d = at(picture, x, y) - at(truth, x, y);
                normal = [normal[0] + dx * dx, normal[1] + dx * dy, normal[2] + dy * dy];
                right = [right[0] + dx * d, right[1] + dy * d];
            }
        }
    }
    let [xx, xy, yy] = normal;
    let det = xx * yy - xy * xy;
    [(right[0] * yy - right[1] * xy) / det, (right[1] * xx - right[0] * xy) / det]
}

#[test]
fn pictures_of_any_number_of_samples_register() {
    // A single sample lies where the layers lie. Aliasing moves pictures at random, smaller ones by more.
    let volume = figure(1, 1).volume(1 << 30, &Unwatched).expect("a volume");
    let mesh = figure(1, 1).mesh();
    let render = |samples| {
        let scene = figure(1, samples);
        cpu::render(&scene, &volume, &mesh, false, &Unwatched).expect("a frame")
    };
    let truth = render(64);
    for samples in [1, 2, 3, 4, 8] {
        let shift = shift(&render(samples), &truth);
        assert!(shift[0].hypot(shift[1]) < 0.02, "{samples} samples lie off by {shift:?} pixels");
    }
}

#[test]
fn layers_lie_at_the_centre_for_any_number_of_samples() {
    let one = figure(6, 1);
    let volume = one.volume(1 << 30, &Unwatched).expect("a volume");
    let mesh = one.mesh();
    let want = cpu::render(&one, &volume, &mesh, true, &Unwatched).expect("a frame").surface;
    let mut gpu = renderer("layers at the centre");
    let mut on_gpu = |scene: &Scene| {
        let frame = gpu.as_mut()?.render(scene, &volume, &mesh, &SURFACE, &Unwatched);
        Some(frame.expect("a frame").surface)
    };
    let want_of_gpu = on_gpu(&one);
    for samples in [2, 3, 4] {
        let scene = figure(6, samples);
        let got = cpu::render(&scene, &volume, &mesh, true, &Unwatched).expect("a frame").surface;
        assert!(got == want, "CPU, {samples} samples");
        assert!(on_gpu(&scene) == want_of_gpu, "GPU, {samples} samples");
    }
}
