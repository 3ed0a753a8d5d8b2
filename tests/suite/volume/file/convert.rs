//! Volume files of other programs: what has a meaning is converted with a note, the rest is refused.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use tempfile::TempDir;
use zip::{ZipWriter, write::SimpleFileOptions};

use super::super::{build, spec};
use super::{CELLS, ROOMY, SHAPE};
use crate::cli::faults::{run, taki};
use taki::job::VolumeMemo;
use taki::scene::{Kind, Limits, PARAMS, Scene};
use taki::util::monitor::{Monitor, Unwatched};
use taki::volume::{ReadOptions, StorageChoice, VolumeTexture, read_npz, sparse_bytes};

/// Keeps the warnings.
#[derive(Default)]
struct Notes(Mutex<Vec<String>>);

impl Monitor for Notes {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> taki::Result<()> {
        Ok(())
    }

    fn warn(&self, text: &str) {
        self.0.lock().unwrap().push(text.into());
    }
}

impl Notes {
    /// Asserts that there is one note for each set of words, in this order, and none beside them.
    fn assert(&self, wanted: &[&[&str]]) {
        let notes = self.0.lock().unwrap();
        assert_eq!(notes.len(), wanted.len(), "{notes:?}");
        for (note, words) in notes.iter().zip(wanted) {
            for word in *words {
                assert!(note.contains(word), "no {word:?} in {note:?}");
            }
        }
    }
}

/// An array as another program writes it.
#[derive(Clone)]
struct Array {
    /// NumPy's name of the element type, such as `<f4`.
    descr: &'static str,
    fortran: bool,
    shape: Vec<u64>,
    /// Values in C order.
    values: Vec<f64>,
}

impl Array {
    fn new(shape: &[u64], values: Vec<f64>) -> Array {
        Array { descr: "<f4", fortran: false, shape: shape.to_vec(), values }
    }

    fn of(&self, descr: &'static str) -> Array {
        Array { descr, ..self.clone() }
    }

    fn in_fortran_order(&self) -> Array {
        Array { fortran: true, ..self.clone() }
    }

    /// The array as `numpy.save` writes it.
    fn bytes(&self) -> Vec<u8> {
        let shape = match self.shape.as_slice() {
            [n] => format!("({n},)"),
            shape => format!("({})", shape.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")),
        };
        let fortran = if self.fortran { "True" } else { "False" };
        let header = format!("{{'descr': '{}', 'fortran_order': {fortran}, 'shape': {shape}, }}", self.descr);
        let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
        let header = format!("{header:<width$}\n", width = length - 1);
        let mut out = b"\x93NUMPY\x01\x00".to_vec();
        out.extend((header.len() as u16).to_le_bytes());
        out.extend(header.as_bytes());
        let values: Vec<f64> = match self.fortran {
            false => self.values.clone(),
            true => fortran_order(&self.shape).iter().map(|&i| self.values[i]).collect(),
        };
        values.iter().for_each(|&x| out.extend(encoded(self.descr, x)));
        out
    }
}

/// Index in C order of each place in Fortran order.
fn fortran_order(shape: &[u64]) -> Vec<usize> {
    let count = shape.iter().product::<u64>() as usize;
    let index = |mut place: usize| {
        let (mut index, mut step) = (0, count);
        for &n in shape {
            step /= n as usize;
            index += place % n as usize * step;
            place /= n as usize;
        }
        index
    };
    (0..count).map(index).collect()
}

/// Bytes of one number. Numbers that float16 cannot hold are cut, not rounded.
fn encoded(descr: &str, x: f64) -> Vec<u8> {
    let mut bytes = match &descr[1..] {
        "f2" => half(x).to_le_bytes().to_vec(),
        "f4" => (x as f32).to_le_bytes().to_vec(),
        "f8" => x.to_le_bytes().to_vec(),
        "b1" | "u1" | "i1" => vec![x as i16 as u8],
        "u2" | "i2" => (x as i32 as u16).to_le_bytes().to_vec(),
        "u4" | "i4" => (x as i64 as u32).to_le_bytes().to_vec(),
        "u8" | "i8" => (x as i64).to_le_bytes().to_vec(),
        "f16" | "c16" => [x.to_le_bytes(), [0; 8]].concat(),
        "c8" => [(x as f32).to_le_bytes(), [0; 4]].concat(),
        "U1" => vec![b'1', 0, 0, 0],
        "S1" | "V1" => vec![b'1'],
        other => panic!("{other}"),
    };
    if descr.starts_with('>') {
        bytes.reverse();
    }
    bytes
}

/// Bits of float16.
fn half(x: f64) -> u16 {
    let sign = u16::from(x.is_sign_negative()) << 15;
    let size = x.abs();
    sign | match size {
        _ if size.is_nan() => 0x7e00,
        _ if size >= 65536.0 => 0x7c00,
        _ if size < 2f64.powi(-14) => (size * 2f64.powi(24)) as u16,
        _ => {
            let exponent = size.log2().floor();
            ((exponent as i32 + 15) as u16) << 10 | ((size / exponent.exp2() - 1.0) * 1024.0) as u16
        }
    }
}

/// A volume file of 4×3×2 cells that differ. All its numbers are float16 numbers, and codes of uint8 times
/// 1/255 are not among them.
struct Foreign {
    rho: Array,
    v: Array,
    k: Option<Array>,
    alpha: Option<Array>,
}

impl Default for Foreign {
    fn default() -> Self {
        let with = |n: u64| SHAPE.iter().copied().chain([n]).collect::<Vec<_>>();
        let v = |i: usize| match i % 5 {
            0 => [0.0, 1.0, 0.0],
            1 => [0.5, 0.5, 0.70703125],
            2 => [-1.0, 0.0, 0.0],
            3 => [0.0, -0.5, -0.8662109375],
            _ => [0.0, 0.0, 1.0],
        };
        Foreign {
            rho: Array::new(&SHAPE, (0..CELLS).map(|i| i as f64 / 32.0).collect()),
            v: Array::new(&with(3), (0..CELLS).flat_map(v).collect()),
            k: Some(Array::new(&with(2), (0..2 * CELLS).map(|i| i as f64 / 64.0).collect())),
            alpha: None,
        }
    }
}

impl Foreign {
    /// A file that holds the numbers of a volume.
    fn of(volume: &VolumeTexture) -> Foreign {
        let shape = [volume.size[2], volume.size[1], volume.size[0]].map(u64::from);
        let with = |n: u64| shape.iter().copied().chain([n]).collect::<Vec<_>>();
        let cells = || volume.cells.iter();
        let numbers = |values: Vec<f32>| values.into_iter().map(f64::from).collect();
        Foreign {
            rho: Array::new(&shape, numbers(cells().map(|c| c.rho() * volume.alpha).collect())),
            v: Array::new(&with(3), numbers(cells().flat_map(|c| c.v().to_array()).collect())),
            k: Some(Array::new(&with(2), numbers(cells().flat_map(|c| <[f32; 2]>::from(c.k())).collect()))),
            alpha: Some(Array::new(&[], vec![volume.alpha.into()])),
        }
    }

    fn write(&self, path: &Path) {
        let mut zip = ZipWriter::new(File::create(path).unwrap());
        let arrays = [
            ("rho", Some(&self.rho)),
            ("v", Some(&self.v)),
            ("k", self.k.as_ref()),
            ("alpha", self.alpha.as_ref()),
        ];
        for (name, array) in arrays {
            let Some(array) = array else { continue };
            zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
            zip.write_all(&array.bytes()).unwrap();
        }
        zip.finish().unwrap();
    }

    fn written(&self) -> (TempDir, PathBuf) {
        let dir = super::folder();
        let path = dir.path().join("foreign.npz");
        self.write(&path);
        (dir, path)
    }

    fn try_read(&self, options: &ReadOptions) -> (taki::Result<VolumeTexture>, Notes) {
        let (_dir, path) = self.written();
        let notes = Notes::default();
        (read_npz(&path, options, &notes), notes)
    }

    fn read(&self) -> (VolumeTexture, Notes) {
        let (volume, notes) = self.try_read(&ROOMY);
        (volume.unwrap_or_else(|e| panic!("{e}")), notes)
    }

    /// Asserts that the file is refused with exit code 65 and a message that holds `words`.
    fn refused(&self, words: &[&str]) {
        let fault = self.try_read(&ROOMY).0.expect_err(words[0]);
        assert_eq!(fault.exit_code(), 65, "{fault}");
        for word in words {
            assert!(fault.to_string().contains(word), "no {word:?} in {fault}");
        }
    }
}

fn ok() -> Foreign {
    Foreign::default()
}

#[test]
fn float32_in_c_order_is_read_without_a_note() {
    let (volume, notes) = ok().read();
    notes.assert(&[]);
    assert_eq!((volume.size, volume.cells.len()), ([4, 3, 2], CELLS));
    assert_eq!(volume.cell(1, 2, 0).rho_code(), (9.0 / 32.0 * 65535.0f32).round() as u32);
    let own = build(&spec([5, 4, 3], 3));
    let (_dir, path) = Foreign::of(&own).written();
    let notes = Notes::default();
    assert_eq!(read_npz(&path, &ROOMY, &notes).unwrap(), own);
    notes.assert(&[]);
}

#[test]
fn floats_of_other_sizes_and_byte_orders_are_converted() {
    let wanted = ok().read().0;
    let types = [
        ("<f2", "float16"),
        ("<f8", "float64"),
        (">f2", "big-endian float16"),
        (">f4", "big-endian float32"),
        (">f8", "big-endian float64"),
    ];
    for (descr, words) in types {
        let file = Foreign {
            rho: ok().rho.of(descr),
            v: ok().v.of(descr),
            k: ok().k.map(|k| k.of(descr)),
            alpha: Some(Array::new(&[], vec![1.0]).of(descr)),
        };
        let (volume, notes) = file.read();
        assert_eq!(volume, wanted, "{descr}");
        notes.assert(&[&["foreign.npz", "alpha ", words], &["v ", words], &["rho ", words], &["k ", words]]);
    }
}

#[test]
fn every_kind_of_float16_is_read() {
    let smallest = 2f64.powi(-24);
    for alpha in [0.0, smallest, 1000.0 * smallest, 2f64.powi(-14), 0.333251953125, 0.99951171875, 1.0] {
        let alpha = Array::new(&[], vec![alpha]).of("<f2");
        let rho = Array::new(&SHAPE, vec![0.0; CELLS]);
        let (volume, _) = Foreign { rho, alpha: Some(alpha.clone()), ..ok() }.read();
        assert_eq!(f64::from(volume.alpha), alpha.values[0]);
    }
    for value in [f64::INFINITY, f64::NAN, -smallest] {
        Foreign { alpha: Some(Array::new(&[], vec![value]).of("<f2")), ..ok() }.refused(&["alpha: "]);
    }
}

#[test]
fn integers_and_truth_values_are_read_as_the_numbers_that_they_are() {
    let rho = Array::new(&SHAPE, (0..CELLS).map(|i| (i % 2) as f64).collect());
    let v: Vec<f64> = (0..CELLS).flat_map(|i| [0.0, if i % 3 == 0 { -1.0 } else { 1.0 }, 0.0]).collect();
    let floats = Foreign { rho, v: Array::new(&ok().v.shape, v), ..ok() };
    let wanted = floats.read().0;
    for (descr, words) in [("|b1", "bool"), ("<i2", "int16"), (">i4", "big-endian int32"), ("<u8", "uint64")]
    {
        let (volume, notes) = Foreign { rho: floats.rho.of(descr), v: floats.v.clone(), ..ok() }.read();
        assert_eq!(volume, wanted, "{descr}");
        notes.assert(&[&["rho ", words]]);
    }
    for descr in ["|i1", "<i8", ">i2"] {
        let file = Foreign { v: floats.v.of(descr), rho: floats.rho.clone(), ..ok() };
        assert_eq!(file.read().0, wanted, "{descr}");
    }
    let (volume, notes) = Foreign { alpha: Some(Array::new(&[], vec![1.0]).of("<i8")), ..ok() }.read();
    assert_eq!(volume, ok().read().0);
    notes.assert(&[&["alpha ", "int64"]]);
}

#[test]
fn uint8_densities_and_coefficients_are_codes_of_0_to_1() {
    let codes = |n: usize| (0..n).map(|i| (i * 255 / (n - 1)) as f64).collect::<Vec<_>>();
    let k = codes(2 * CELLS);
    let file = Foreign {
        rho: Array::new(&SHAPE, codes(CELLS)).of("|u1"),
        k: Some(Array::new(&ok().k.unwrap().shape, k.clone()).of("|u1")),
        ..ok()
    };
    let (volume, notes) = file.read();
    notes.assert(&[&["rho ", "uint8", "0 to 255"], &["k ", "uint8", "0 to 255"]]);
    for (i, cell) in volume.cells.iter().enumerate() {
        assert_eq!(cell.rho_code(), codes(CELLS)[i] as u32 * 257);
        assert_eq!(cell.k_codes(), (k[2 * i] as u32, k[2 * i + 1] as u32));
    }
}

#[test]
fn a_mask_in_uint8_is_pointed_out() {
    let mask = Array::new(&SHAPE, (0..CELLS).map(|i| (i % 2) as f64).collect());
    let (volume, notes) = Foreign { rho: mask.of("|u1"), ..ok() }.read();
    assert_eq!(volume.cells[1].rho_code(), 257);
    notes.assert(&[&["rho ", "uint8"], &["rho ", "no code above 1", "bool"]]);
    // The advice.
    let (volume, notes) = Foreign { rho: mask.of("|b1"), ..ok() }.read();
    assert_eq!(volume.cells[1].rho_code(), 65535);
    notes.assert(&[&["rho ", "bool"]]);
}

#[test]
fn fortran_order_is_converted() {
    let wanted = ok().read().0;
    let whole = || Foreign {
        rho: ok().rho.in_fortran_order(),
        v: ok().v.in_fortran_order(),
        k: ok().k.map(|k| k.in_fortran_order()),
        alpha: None,
    };
    let (volume, notes) = whole().read();
    assert_eq!(volume, wanted);
    let order = "Fortran order";
    notes.assert(&[&["v ", order], &["rho ", order], &["k ", order]]);
    let (volume, notes) = Foreign { v: ok().v, rho: whole().rho.of(">f8"), ..whole() }.read();
    assert_eq!(volume, wanted);
    notes.assert(&[&["rho ", "big-endian float64", order], &["k ", order]]);
}

#[test]
fn fortran_order_is_converted_within_the_budget_of_either_storage() {
    let volume = build(&spec([30, 22, 26], 3));
    let file = Foreign::of(&volume);
    let file = Foreign {
        rho: file.rho.in_fortran_order(),
        v: file.v.in_fortran_order(),
        k: file.k.map(|k| k.in_fortran_order()),
        alpha: file.alpha,
    };
    let cells = volume.cells.len() as u64;
    let stored = volume.cells.iter().filter(|c| c.has_direction()).count() as u64;
    let sparse = sparse_bytes(volume.size, stored, 0) as u64;
    assert!(sparse / 4 < cells * 12 / 2, "several passes are needed");
    for (storage, budget) in [(StorageChoice::Dense, 20 * cells), (StorageChoice::Sparse, sparse)] {
        let read = |budget| file.try_read(&ReadOptions { storage, budget, ..ROOMY }).0;
        let back = read(budget).unwrap();
        assert_eq!(
            (back.is_sparse(), back.checksum()),
            (storage == StorageChoice::Sparse, volume.checksum())
        );
        assert_eq!(read(budget - 1).expect_err("a budget too small").exit_code(), 33);
    }
}

#[test]
fn fortran_arrays_of_the_wrong_length_are_refused() {
    let whole = ok().rho.in_fortran_order();
    for values in [CELLS - 1, CELLS + 1] {
        let rho = Array { fortran: false, values: vec![0.5; values], ..whole.clone() };
        let mut bytes = rho.bytes();
        let at = bytes.windows(5).position(|w| w == b"False").unwrap();
        bytes[at..at + 5].copy_from_slice(b"True ");
        let dir = super::folder();
        let path = dir.path().join("cut.npz");
        let mut zip = ZipWriter::new(File::create(&path).unwrap());
        for (name, array) in [("rho", bytes), ("v", ok().v.bytes()), ("k", ok().k.unwrap().bytes())] {
            zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
            zip.write_all(&array).unwrap();
        }
        zip.finish().unwrap();
        let fault = read_npz(&path, &ROOMY, &Unwatched).expect_err("a wrong length").to_string();
        let word = if values < CELLS { "ends after" } else { "has more than" };
        assert!(fault.contains("rho: ") && fault.contains(word), "{fault}");
    }
}

#[test]
fn a_size_over_the_budget_is_refused_in_fortran_order_too() {
    let n = 100_000;
    for shape in [vec![n, n, n], vec![u64::MAX, 3, 7]] {
        let mut rho = Array::new(&[4], vec![0.5; 4]);
        rho.fortran = true;
        let mut bytes = rho.bytes();
        let claimed = format!("({}, {}, {}), }}", shape[0], shape[1], shape[2]);
        let at = bytes.windows(4).position(|w| w == b"(4,)").unwrap();
        bytes[at..at + claimed.len()].copy_from_slice(claimed.as_bytes());
        let dir = super::folder();
        let path = dir.path().join("huge.npz");
        let mut zip = ZipWriter::new(File::create(&path).unwrap());
        for (name, array) in [("rho", bytes), ("v", ok().v.bytes())] {
            zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
            zip.write_all(&array).unwrap();
        }
        zip.finish().unwrap();
        for storage in [StorageChoice::Auto, StorageChoice::Dense, StorageChoice::Sparse] {
            let fault = read_npz(&path, &ReadOptions { storage, ..ROOMY }, &Unwatched).unwrap_err();
            assert_eq!(fault.exit_code(), 33, "{fault}");
        }
    }
}

#[test]
fn directions_within_a_hundredth_of_a_unit_vector_are_normalised() {
    let scaled = |factor: f64, cells: usize| {
        let mut v = ok().v;
        v.values[..3 * cells].iter_mut().for_each(|x| *x *= factor);
        Foreign { v, ..ok() }
    };
    let wanted = ok().read().0;
    for (factor, length) in [(0.991, "0.9910"), (1.009, "1.0090")] {
        let (volume, notes) = scaled(factor, 1).read();
        assert_eq!(volume, wanted);
        notes.assert(&[&["v is normalised", "1 cell", length]]);
        let (volume, notes) = scaled(factor, 10).read();
        assert_eq!(volume, wanted);
        notes.assert(&[&["v is normalised", "10 cells"]]);
    }
    for factor in [0.985, 1.015, 3.0] {
        scaled(factor, 1).refused(&["v: ", "[0, 0, 0]", "numpy.where(n > 0, n, 1)"]);
    }
}

#[test]
fn a_file_without_k_takes_the_reflection_of_the_scene() {
    let file = || Foreign { k: None, ..ok() };
    let codes = |volume: &VolumeTexture| {
        let first = volume.cells[0].k_codes();
        assert!(volume.cells.iter().all(|c| c.k_codes() == first));
        first
    };
    let (volume, notes) = file().read();
    assert_eq!(codes(&volume), (128, 128));
    notes.assert(&[&["k is missing", "k_d = 0.5", "k_s = 0.5"]]);
    let (volume, notes) = file().try_read(&ReadOptions { k: [0.2, 1.0], ..ROOMY });
    assert_eq!(codes(&volume.unwrap()), (51, 255));
    notes.assert(&[&["k is missing", "k_d = 0.2", "k_s = 1"]]);

    let (_dir, path) = file().written();
    let scene = |k_d: f32| {
        let sets = [
            format!("volume.file={}", path.display()),
            format!("volume.k_d={k_d}"),
            "volume.k_s=0.4".to_string(),
        ];
        Scene::load(Path::new("front"), &sets, &Limits::default()).unwrap()
    };
    assert_eq!(codes(&scene(0.6).volume(1 << 30, &Unwatched).unwrap()), (153, 102));
    // A new coefficient changes a remembered volume, but not one whose file has k.
    let mut memo = VolumeMemo::default();
    let mut remembered = |k_d: f32| {
        let (volumes, cost) = memo.volumes(&scene(k_d), 1 << 30, &Unwatched).unwrap();
        (volumes[0].cells[0].k_codes(), cost.is_some())
    };
    assert_eq!(remembered(0.6), ((153, 102), true));
    assert_eq!(remembered(0.6), ((153, 102), false));
    assert_eq!(remembered(0.8), ((204, 102), true));
    ok().write(&path);
    assert_eq!(remembered(0.8), ((0, 4), true));
    assert_eq!(remembered(0.6), ((0, 4), false));
}

#[test]
fn the_reflection_read_without_a_scene_is_the_default_of_the_parameters() {
    let default = |key: &str| match PARAMS.iter().find(|p| p.key == key).unwrap().kind {
        Kind::Float(_, _, default) => default as f32,
        ref other => panic!("{other:?}"),
    };
    assert_eq!(ReadOptions::default().k, [default("volume.k_d"), default("volume.k_s")]);
    assert_eq!(ReadOptions::default().budget, Limits::default().memory);
}

#[test]
fn alpha_is_one_number_in_any_shape() {
    let alpha = |shape: &[u64], n: usize| Some(Array::new(shape, vec![0.75; n]));
    let wanted = Foreign { alpha: alpha(&[], 1), ..ok() }.read().0;
    assert_eq!(wanted.alpha, 0.75);
    for shape in [&[1][..], &[1, 1], &[1, 1, 1, 1]] {
        let (volume, notes) = Foreign { alpha: alpha(shape, 1), ..ok() }.read();
        assert_eq!(volume, wanted, "{shape:?}");
        notes.assert(&[]);
        let array = alpha(shape, 1).map(|a| a.in_fortran_order());
        assert_eq!(Foreign { alpha: array, ..ok() }.read().0, wanted, "{shape:?}");
    }
    for (shape, n) in [(&[2][..], 2), (&[0], 0), (&[1, 3], 3)] {
        Foreign { alpha: alpha(shape, n), ..ok() }.refused(&["alpha: ", "one number", "leave alpha out"]);
    }
}

#[test]
fn rounding_to_a_coarse_type_does_not_lift_density_over_alpha() {
    // 0.3701171875 is the float16 number above 0.37, and 95/255 lies above 0.371.
    let cases =
        [("<f2", 0.3701171875, "<f4", 0.37), ("<f4", 0.37, "<f2", 0.36988), ("|u1", 95.0, "<f8", 0.371)];
    for (descr, rho, scale, alpha) in cases {
        let file = Foreign {
            rho: Array::new(&SHAPE, vec![rho; CELLS]).of(descr),
            alpha: Some(Array::new(&[], vec![alpha]).of(scale)),
            ..ok()
        };
        let (volume, _) = file.read();
        assert!(volume.cells.iter().all(|c| c.rho_code() == 65535), "{descr}");
        let file = Foreign { alpha: Some(Array::new(&[], vec![alpha * 0.98])), ..file };
        file.refused(&["rho: ", "more than", "leave alpha out"]);
    }
}

#[test]
fn what_has_no_meaning_is_refused() {
    for descr in ["<c8", "<c16", "<U1", "|S1", "|V1", "<f16"] {
        let array = |a: Array| a.of(descr);
        Foreign { rho: array(ok().rho), ..ok() }.refused(&["rho: ", &descr[1..], "float32"]);
        Foreign { v: array(ok().v), ..ok() }.refused(&["v: ", &descr[1..], "float32"]);
        Foreign { k: ok().k.map(array), ..ok() }.refused(&["k: ", &descr[1..], "float32"]);
    }
    let with = |array: Array, at: usize, value: f64| {
        let mut array = array;
        array.values[at] = value;
        array
    };
    for descr in ["<f2", ">f4", "<f8"] {
        for value in [f64::NAN, -0.5, 1.5, f64::INFINITY, 1e300] {
            let rho = with(ok().rho, 17, value).of(descr);
            Foreign { rho: rho.clone(), ..ok() }.refused(&["rho: ", "[1, 1, 1]", "numpy.clip"]);
            Foreign { rho: rho.in_fortran_order(), ..ok() }.refused(&["rho: ", "[1, 1, 1]"]);
            let k = with(ok().k.unwrap(), 47, value).of(descr);
            Foreign { k: Some(k), ..ok() }.refused(&["k: ", "[1, 2, 3]", "numpy.clip"]);
        }
        let v = with(ok().v, 4, f64::NAN).of(descr);
        Foreign { v, ..ok() }.refused(&["v: ", "[0, 0, 1]", "numpy.isfinite"]);
    }
    let negative = with(ok().rho, 17, -1.0);
    Foreign { rho: negative.of("<i4"), ..ok() }.refused(&["rho: ", "[1, 1, 1]"]);
    let mut v = ok().v;
    v.values[15..18].fill(0.0);
    Foreign { v, ..ok() }.refused(&["rho: ", "[0, 1, 1]", "v is zero", "rho[(v == 0).all(-1)] = 0"]);
}

#[test]
fn densities_of_a_larger_range_are_to_be_divided() {
    let ramp = |most: f64| -> Vec<f64> {
        (0..CELLS).map(|i| (i as f64 / (CELLS - 1) as f64 * most).floor()).collect()
    };
    let of = |values: Vec<f64>, descr| Array::new(&SHAPE, values).of(descr);
    for (rho, by) in [
        (of(ramp(255.0), "<i2"), "/ 255,"),
        (of(ramp(200.0), "<i4"), "/ 255,"),
        (of(ramp(255.0), "<f4"), "/ 255,"),
        (of(ramp(65535.0), "<u2"), "/ 65535,"),
        (of(ramp(1000.0), "<u2"), "/ 1000,"),
        (of(ramp(12.0).iter().map(|x| x + 0.5).collect(), "<f8"), "/ 12.5,"),
    ] {
        let advice = format!("rho = numpy.clip(numpy.nan_to_num(rho) {by} 0, 1)");
        Foreign { rho: rho.clone(), ..ok() }.refused(&["rho: ", &advice]);
        Foreign { rho: rho.in_fortran_order(), ..ok() }.refused(&["rho: ", &advice]);
    }
    // α stays the largest density.
    let alpha = Some(Array::new(&[], vec![0.5]));
    Foreign { rho: of(ramp(255.0), "<i2"), alpha, ..ok() }
        .refused(&["rho = 0.5 * numpy.clip(numpy.nan_to_num(rho) / 255, 0, 1)"]);
    let k = Array { values: (0..2 * CELLS).map(|i| (i * 5) as f64).collect(), ..ok().k.unwrap() };
    Foreign { k: Some(k.of("<i2")), ..ok() }.refused(&["k = numpy.clip(numpy.nan_to_num(k) / 255, 0, 1)"]);
    // Codes of 8 bits become negative where they are taken for bytes with a sign.
    let signed = ramp(255.0).iter().map(|x| if *x > 127.0 { x - 256.0 } else { *x }).collect();
    Foreign { rho: of(signed, "|i1"), ..ok() }.refused(&["rho = rho.view(numpy.uint8) / 255"]);
    // Noise around 0 and 1 is cut, and the density stays as it is.
    let mut noisy = ok().rho;
    (noisy.values[3], noisy.values[5]) = (-0.001, 1.001);
    Foreign { rho: noisy, ..ok() }.refused(&["rho = numpy.clip(numpy.nan_to_num(rho), 0, 1)"]);
}

#[test]
fn an_array_in_place_of_a_volume_is_told_to_be_one() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("rho.npy");
    std::fs::write(&path, b"\x93NUMPY\x01\x00").unwrap();
    let read = read_npz(&path, &ReadOptions::default(), &Unwatched);
    let error = read.expect_err("a refusal").to_string();
    assert!(error.contains("an .npy, which holds one array") && error.contains("numpy.savez"), "{error}");
}

#[test]
fn a_volume_without_a_flow_is_told_how_to_give_one() {
    let (_dir, path) = ok().written();
    let mut zip = ZipWriter::new(File::create(&path).unwrap());
    zip.start_file("rho.npy", SimpleFileOptions::default()).unwrap();
    zip.write_all(&ok().rho.bytes()).unwrap();
    zip.finish().unwrap();
    let fault = read_npz(&path, &ROOMY, &Unwatched).unwrap_err().to_string();
    for words in ["v: there is no such array, but rho", "v = numpy.zeros((*rho.shape, 3))", "v[..., 1] = 1"] {
        assert!(fault.contains(words), "no {words:?} in {fault}");
    }
}

#[test]
fn arrays_under_other_names_are_told() {
    let dir = super::folder();
    let path = dir.path().join("unnamed.npz");
    let mut zip = ZipWriter::new(File::create(&path).unwrap());
    for (name, array) in [("arr_0", ok().rho), ("arr_1", ok().v)] {
        zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
        zip.write_all(&array.bytes()).unwrap();
    }
    zip.finish().unwrap();
    let fault = read_npz(&path, &ROOMY, &Unwatched).unwrap_err().to_string();
    assert!(fault.contains("rho: ") && fault.contains("arr_0, arr_1"), "{fault}");
}

#[test]
fn info_tells_what_was_converted() {
    let file = Foreign { rho: ok().rho.of(">f8"), k: None, ..ok() };
    let (_dir, path) = file.written();
    let said = run(taki(["volume", "info"]).arg(&path));
    let (head, notes) = said.done().split_once("\nconverted on reading:\n").expect("notes");
    assert!(head.starts_with("size            4 × 3 × 2 cells"));
    let lines: Vec<&str> = notes.lines().collect();
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert_eq!(lines[0], "  rho is converted from big-endian float64");
    assert!(lines[1].starts_with("  k is missing: "), "{lines:?}");
    let json = |path: &Path| -> serde_json::Value {
        serde_json::from_str(run(taki(["volume", "info", "--json"]).arg(path)).done()).unwrap()
    };
    assert_eq!(json(&path)["converted"].as_array().unwrap().len(), 2);
    assert_eq!(json(&path)["size"], serde_json::json!([4, 3, 2]));
    // A file that needs no conversion.
    ok().write(&path);
    assert_eq!(json(&path)["converted"], serde_json::json!([]));
    assert!(!run(taki(["volume", "info"]).arg(&path)).done().contains("converted"));
}

#[test]
fn a_picture_of_a_converted_volume_is_made_with_one_warning_for_each_note() {
    let file = Foreign { rho: ok().rho.of("<f8"), v: ok().v.in_fortran_order(), k: None, ..ok() };
    let (dir, path) = file.written();
    for exposure in ["none", "average"] {
        let sets = [format!("volume.file={}", path.display()), format!("image.auto_exposure={exposure}")];
        let sets = sets.map(|set| format!("--set={set}"));
        let out = dir.path().join("x.png");
        let said = run(taki(["render", "front", "--engine=cpu", "--size=16x9", "-o"]).arg(&out).args(sets));
        said.done();
        let warnings = said.lines("taki: warning:");
        assert_eq!(warnings.len(), 3, "{warnings:?}");
    }
}
