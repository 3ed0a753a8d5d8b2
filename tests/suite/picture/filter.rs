//! The sample filter: density of the samples' offsets, crops bit for bit, and parity of the engines.

use std::f64::consts::PI;

use crate::engine::gpu::{assert_parity, both, renderer, scene};
use taki::engine::RenderOptions;
use taki::engine::cpu::{LightVolumeCache, render_with};
use taki::picture::camera::{FILTER_RADIUS, sample_offset};
use taki::picture::{Filter, Image};
use taki::util::monitor::Unwatched;
use taki::util::window::Window;

const ALL: [Filter; 3] = [Filter::Box, Filter::Gaussian, Filter::BlackmanHarris];

fn image(filter: Filter, samples: u32) -> Image {
    Image { filter, samples, ..scene("front", &[]).image }
}

fn weight(filter: Filter, x: f64) -> f64 {
    let a = PI * x / FILTER_RADIUS;
    match filter {
        Filter::Box => f64::from(u8::from(x.abs() < 0.5)),
        Filter::Gaussian => (-2.0 * x * x).exp(),
        Filter::BlackmanHarris => {
            0.35875 + 0.48829 * a.cos() + 0.14128 * (2.0 * a).cos() + 0.01168 * (3.0 * a).cos()
        }
    }
}

/// Mean of `value` under a filter, by the midpoint rule.
fn mean(filter: Filter, value: impl Fn(f64) -> f64) -> f64 {
    const N: i32 = 30_000;
    let (mut sum, mut total) = (0.0, 0.0);
    for i in 0..N {
        let x = (2.0 * (f64::from(i) + 0.5) / f64::from(N) - 1.0) * FILTER_RADIUS;
        sum += weight(filter, x) * value(x);
        total += weight(filter, x);
    }
    sum / total
}

#[test]
fn samples_lie_as_densely_as_their_filter_weighs() {
    const N: u32 = 4096;
    for filter in ALL {
        let image = image(filter, N);
        for axis in 0..2 {
            let away = |s: u32| f64::from(sample_offset(&image, s)[axis]) - 0.5;
            let values: [fn(f64) -> f64; 4] = [|x| x, |x| x * x, |x| x.abs(), |x| (5.0 * x).cos()];
            for (k, value) in values.into_iter().enumerate() {
                let got = (0..N).map(|s| value(away(s))).sum::<f64>() / f64::from(N);
                let want = mean(filter, value);
                // For an even sequence of N points, the discrepancy is some log N / N of the values'
                // variation.
                assert!((got - want).abs() < 5e-3, "{filter:?}, axis {axis}, moment {k}: {got} for {want}");
            }
            assert!((0..N).all(|s| away(s).abs() <= FILTER_RADIUS), "{filter:?} ends");
        }
    }
}

#[test]
fn the_first_sample_is_the_centre_and_a_single_one_always() {
    for filter in ALL {
        assert!((1..9).all(|samples| sample_offset(&image(filter, samples), 0) == [0.5, 0.5]), "{filter:?}");
    }
}

#[test]
fn a_part_of_a_filtered_picture_has_the_bits_of_the_whole_and_the_engines_agree() {
    let sets = ["image.width=60", "image.height=50", "image.samples=5", "light.visibility=none"];
    for filter in ["image.filter=gaussian", "image.filter=blackman-harris"] {
        let scene = scene("front", &[&sets[..], &[filter]].concat());
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let mesh = scene.mesh();
        let render = |window| {
            let kept = &mut LightVolumeCache::default();
            let options = RenderOptions { window: Some(window), ..Default::default() };
            render_with(&scene, &volume, &mesh, &options, kept, &Unwatched).expect("a frame")
        };
        let whole = render(Window::whole([60, 50]));
        let part = Window { x: 11, y: 7, width: 20, height: 9 };
        let frame = render(part);
        for y in 0..9 {
            for x in 0..20 {
                let i = (y + 7) * 60 + x + 11;
                assert_eq!(frame.radiance[y * 20 + x], whole.radiance[i]);
            }
        }
        if let Some(mut renderer) = renderer("filters") {
            assert_parity(filter, &both(&mut renderer, &scene));
        }
    }
}
