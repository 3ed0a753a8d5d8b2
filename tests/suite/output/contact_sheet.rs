//! Contact sheets: no label overlaps another, and every picture is in the place of its values.

use image::{Rgb, RgbImage};
use proptest::prelude::*;
use taki::output::contact_sheet::{Axis, LONGEST_SIDE, Layout, Rect, Sheet, draw};
use taki::util::error::Error;

fn axis(name: &str, values: impl IntoIterator<Item = impl ToString>) -> Axis {
    Axis { name: name.into(), values: values.into_iter().map(|v| v.to_string()).collect() }
}

/// Asserts that everything lies on the sheet and that nothing overlaps.
fn sound(sheet: &Sheet, layout: &Layout) {
    let [width, height] = layout.size;
    assert!(width <= LONGEST_SIDE && height <= LONGEST_SIDE, "{:?}", layout.size);
    let lines = layout.arrows.iter().map(|[[x0, y0], [x1, y1]]| {
        assert!(x0 <= x1 && y0 <= y1);
        ("arrow".to_owned(), Rect { x: *x0, y: *y0, w: x1 - x0 + 1, h: y1 - y0 + 1 })
    });
    let labels = layout.labels.iter().map(|l| (l.text.clone(), l.rect));
    let places = layout.places.iter().map(|p| (format!("{},{}", p.row, p.column), p.rect));
    let mut boxes: Vec<(String, Rect)> = labels.chain(lines).chain(places).collect();
    for (what, r) in &boxes {
        assert!(r.w > 0 && r.h > 0 && r.x + r.w <= width && r.y + r.h <= height, "{what}: {r:?}");
    }
    boxes.sort_by_key(|(_, r)| r.y);
    for (i, (what, a)) in boxes.iter().enumerate() {
        for (other, b) in boxes[i + 1..].iter().take_while(|(_, b)| b.y < a.y + a.h) {
            assert!(!a.meets(b), "{what} {a:?} meets {other} {b:?}");
        }
    }
    let (columns, rows) = (sheet.columns.values.len().max(1), sheet.rows.values.len().max(1));
    let indices: Vec<_> = layout.places.iter().map(|p| (p.row, p.column)).collect();
    let expected: Vec<_> = (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))).collect();
    assert_eq!(indices, expected);
}

/// A flat colour that tells the place.
fn shade(row: usize, column: usize) -> Rgb<u8> {
    Rgb([60 + (row * 7 % 190) as u8, 60 + (column * 5 % 190) as u8, 200])
}

fn drawn(sheet: &Sheet) -> (Layout, RgbImage) {
    let layout = sheet.layout().unwrap();
    sound(sheet, &layout);
    let [w, h] = sheet.cell;
    let image = draw(sheet, |row, column| Ok(Some(RgbImage::from_pixel(w, h, shade(row, column))))).unwrap();
    assert_eq!(image.dimensions(), layout.size.into());
    for place in &layout.places {
        let r = place.rect;
        let middle = image.get_pixel(r.x + r.w / 2, r.y + r.h / 2);
        assert_eq!(*middle, shade(place.row, place.column), "{place:?}");
    }
    (layout, image)
}

/// Number of pixels of a box that are not paper.
fn ink(image: &RgbImage, r: Rect) -> usize {
    let paper = *image.get_pixel(0, 0);
    let all = (r.y..r.y + r.h).flat_map(|y| (r.x..r.x + r.w).map(move |x| (x, y)));
    all.filter(|(x, y)| *image.get_pixel(*x, *y) != paper).count()
}

#[test]
fn sweeps_of_every_shape_are_laid_out_soundly_and_every_label_is_drawn() {
    let numbers = |n: usize| (0..n).map(|i| format!("{:.2}", i as f64 * 0.05));
    let sheets = [
        vec![],
        vec![axis("σ 1/m", [10])],
        vec![axis("h", numbers(2))],
        vec![axis("h", numbers(37))],
        vec![axis("h", numbers(12)), axis("α", numbers(9))],
        vec![axis("h", numbers(1)), axis("α", numbers(1))],
        vec![axis("h", numbers(1)), axis("α", numbers(30))],
        vec![
            axis("curves.h", numbers(3)),
            axis("volume.alpha", numbers(2)),
            axis("trace.sigma 1/m", [5, 10]),
        ],
    ];
    for axes in sheets {
        for cell in [[133, 213], [64, 36], [36, 36], [8, 8]] {
            let sheet = Sheet::of("fig5", "seed 1 · 133×213", &axes, cell);
            let (layout, image) = drawn(&sheet);
            assert!(layout.places.iter().all(|p| [p.rect.w, p.rect.h] == cell), "no picture had to shrink");
            for label in &layout.labels {
                assert!(ink(&image, label.rect) > label.text.chars().count(), "{label:?}");
            }
            if cell[0] >= 64 {
                let texts: Vec<&str> = layout.labels.iter().map(|l| l.text.as_str()).collect();
                let all = [&sheet.columns, &sheet.rows].into_iter().flat_map(|a| a.values.iter());
                all.for_each(|value| assert!(texts.contains(&value.as_str()), "{value} of {texts:?}"));
            }
        }
    }
}

#[test]
fn the_first_axis_goes_across_and_the_last_runs_fastest() {
    let axes = [axis("a", [1, 2]), axis("b", [3, 4]), axis("c", [5, 6])];
    let sheet = Sheet::of("", "", &axes, [10, 10]);
    assert_eq!(sheet.columns, axes[0]);
    assert_eq!(sheet.rows, axis("b · c", ["3 · 5", "3 · 6", "4 · 5", "4 · 6"]));
}

#[test]
fn labels_stand_with_their_pictures() {
    let sheet = Sheet::of("t", "", &[axis("h", 0..12), axis("α", (0..9).map(|i| format!("r{i}")))], [50, 40]);
    let layout = sheet.layout().unwrap();
    let label = |text: &str| layout.labels.iter().find(|l| l.text == text).unwrap().rect;
    for place in &layout.places {
        let (column, row) = (label(&place.column.to_string()), label(&format!("r{}", place.row)));
        let r = place.rect;
        assert!((column.x + column.w / 2).abs_diff(r.x + r.w / 2) <= 1 && column.y + column.h <= r.y);
        assert!((row.y + row.h / 2).abs_diff(r.y + r.h / 2) <= 1 && row.x + row.w <= r.x);
    }
    // A single parameter wraps, with its value below each picture.
    let sheet = Sheet::of("", "", &[axis("h", (0..37).map(|i| format!("v{i}")))], [50, 40]);
    let layout = sheet.layout().unwrap();
    let label = |text: &str| layout.labels.iter().find(|l| l.text == text).unwrap().rect;
    for place in &layout.places {
        let (l, r) = (label(&format!("v{}", place.column)), place.rect);
        assert!((l.x + l.w / 2).abs_diff(r.x + r.w / 2) <= 1 && (r.y + r.h..r.y + r.h + 10).contains(&l.y));
    }
    let [width, height] = layout.size;
    assert!(width > height && width < 3 * height, "{width}x{height}");
}

#[test]
fn long_labels_are_shortened_in_their_place() {
    let long = "a value that nobody would call short ".repeat(20);
    let hostile = "x\n\u{7}\u{202e}滝👍".repeat(3000);
    for text in [long.as_str(), hostile.as_str()] {
        for others in [&[][..], &[axis(text, [text, "1"])]] {
            let axes: Vec<Axis> = std::iter::once(axis(text, ["0.9", text])).chain(others.to_vec()).collect();
            let sheet = Sheet::of(text, text, &axes, [80, 60]);
            let (layout, _) = drawn(&sheet);
            assert!(layout.size[0] < 2500);
            let shortened = layout.labels.iter().filter(|l| l.text.ends_with('…')).count();
            assert!(shortened >= 4, "{shortened}");
            let start: String = text.chars().take(3).collect();
            assert!(layout.labels.iter().filter(|l| l.text.starts_with(&start)).count() >= 4);
        }
    }
}

#[test]
fn absent_pictures_are_empty_frames_with_a_note() {
    let sheet = Sheet::of("", "", &[axis("h", 0..3)], [120, 60]);
    let layout = sheet.layout().unwrap();
    let picture = RgbImage::from_pixel(120, 60, Rgb([200; 3]));
    let image = draw(&sheet, |_, column| Ok((column != 1).then(|| picture.clone()))).unwrap();
    let r = layout.places[1].rect;
    let paper = *image.get_pixel(0, 0);
    for (x, y) in [(r.x, r.y), (r.x + r.w - 1, r.y + r.h - 1), (r.x, r.y + 20), (r.x + 20, r.y)] {
        assert_ne!(*image.get_pixel(x, y), paper, "the frame");
    }
    assert_eq!(*image.get_pixel(r.x + 3, r.y + 3), paper);
    let middle = Rect { x: r.x + 15, y: r.y + 15, w: r.w - 30, h: r.h - 30 };
    assert!(ink(&image, middle) > 50, "the note");
}

#[test]
fn pictures_of_another_size_keep_their_shape() {
    let sheet = Sheet::of("", "", &[axis("h", 0..2)], [60, 60]);
    let r = sheet.layout().unwrap().places[0].rect;
    let image = draw(&sheet, |_, _| Ok(Some(RgbImage::from_pixel(400, 100, Rgb([255, 0, 0]))))).unwrap();
    let red = |x: u32, y: u32| *image.get_pixel(r.x + x, r.y + y) == Rgb([255, 0, 0]);
    assert!(red(0, 30) && red(59, 30) && red(30, 23) && red(30, 36));
    assert!(!red(30, 21) && !red(30, 38));
}

#[test]
fn large_sweeps_shrink_and_larger_ones_are_refused() {
    let sheet = Sheet::of("t", "s", &[axis("h", 0..100), axis("α", 0..90)], [640, 360]);
    let layout = sheet.layout().unwrap();
    sound(&sheet, &layout);
    let r = layout.places[0].rect;
    assert!(r.w < 640 && r.w.abs_diff(r.h * 640 / 360) <= 2, "{r:?}");
    assert!(layout.size[0] > LONGEST_SIDE - 200, "as large as fits: {:?}", layout.size);
    for axes in [vec![axis("h", 0..3000), axis("α", 0..2)], vec![axis("h", 0..2), axis("α", 0..70_000)]] {
        let e = Sheet::of("", "", &axes, [64, 64]).layout().unwrap_err();
        assert_eq!(e.exit_code(), 65);
        assert!(e.to_string().contains("sweep fewer values"), "{e}");
    }
    assert!(Sheet::of("", "", &[], [0, 5]).layout().is_err());
    // Panoramas, and a single large picture.
    for cell in [[20_000, 10], [10, 20_000], [16_384, 16_384]] {
        let sheet = Sheet::of("t", "s", &[axis("h", 0..2)], cell);
        sound(&sheet, &sheet.layout().unwrap());
    }
}

#[test]
fn an_error_of_a_picture_ends_the_sheet() {
    let sheet = Sheet::of("", "", &[axis("h", 0..5)], [8, 8]);
    let mut asked = 0;
    let e = draw(&sheet, |_, _| {
        asked += 1;
        Err(Error::Interrupted { code: 130 })
    });
    assert_eq!((e.unwrap_err().exit_code(), asked), (130, 1));
}

#[test]
fn labels_of_pictures_lower_than_a_line_do_not_meet() {
    for cell in [[1, 1], [40, 3], [3, 40]] {
        let axis =
            |name: &str| Axis { name: name.into(), values: ["0.5", "1", "2"].map(String::from).into() };
        let sheet = Sheet::of("a", "b", &[axis("h"), axis("alpha")], cell);
        sound(&sheet, &sheet.layout().unwrap());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_sheet_is_sound(
        names in proptest::collection::vec("\\PC{0,30}", 4),
        values in proptest::collection::vec(proptest::collection::vec("\\PC{0,16}", 1..14), 0..4),
        cell in [1u32..400, 1u32..400],
    ) {
        let axes: Vec<Axis> = values.iter().zip(&names[1..]).map(|(v, n)| axis(n, v)).collect();
        let sheet = Sheet::of(&names[0], "subtitle", &axes, cell);
        match sheet.layout() {
            Ok(layout) => sound(&sheet, &layout),
            Err(e) => prop_assert!(e.to_string().contains("do not fit")),
        }
    }
}
