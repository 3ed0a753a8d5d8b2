//! Volume files: what is written can be read back, and malformed files are refused.

use std::fs::File;
use std::io::{BufWriter, Cursor, Write};
use std::path::Path;

use npyz::WriterBuilder;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tempfile::TempDir;
use zip::{ZipWriter, write::SimpleFileOptions};

use super::{build, spec};
use taki::util::monitor::Unwatched;
use taki::volume::{ReadOptions, StorageChoice, VolumeTexture, WaterSpec, read_npz, write_npz};

mod convert;

/// Automatic storage with more memory than any of these files needs.
const ROOMY: ReadOptions = ReadOptions { storage: StorageChoice::Auto, budget: 1 << 30, k: [0.5; 2] };
/// [nz, ny, nx] of the hand-made files.
const SHAPE: [u64; 3] = [2, 3, 4];
const CELLS: usize = 24;

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn bytes_of(volume: &VolumeTexture) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    write_npz(volume, &mut out).unwrap();
    out.into_inner()
}

fn read_bytes(dir: &TempDir, bytes: &[u8]) -> taki::Result<VolumeTexture> {
    let path = dir.path().join("volume.npz");
    std::fs::write(&path, bytes).unwrap();
    read_npz(&path, &ROOMY, &Unwatched)
}

/// The four arrays of a hand-made file. Unless changed, it is a valid file of 4×3×2 cells.
struct Arrays {
    rho: (Vec<u64>, Vec<f32>),
    v: (Vec<u64>, Vec<f32>),
    k: (Vec<u64>, Vec<f32>),
    alpha: Option<(Vec<u64>, Vec<f32>)>,
    /// Name of an array to leave out.
    left_out: &'static str,
}

impl Default for Arrays {
    fn default() -> Self {
        let with = |n: u64| SHAPE.iter().copied().chain([n]).collect();
        Arrays {
            rho: (SHAPE.to_vec(), vec![0.5; CELLS]),
            v: (with(3), [0.0, 0.6, 0.8].repeat(CELLS)),
            k: (with(2), [0.25, 0.75].repeat(CELLS)),
            alpha: None,
            left_out: "",
        }
    }
}

impl Arrays {
    fn write(&self, path: &Path) {
        let mut zip = ZipWriter::new(BufWriter::new(File::create(path).unwrap()));
        let arrays = [("rho", &self.rho), ("v", &self.v), ("k", &self.k)];
        let alpha = self.alpha.as_ref().map(|alpha| ("alpha", alpha));
        for (name, (shape, values)) in arrays.into_iter().chain(alpha) {
            if name == self.left_out {
                continue;
            }
            zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
            // A buffer is used, because the array's length need not fit the shape that it claims.
            let mut array = Vec::new();
            let options = npyz::WriteOptions::new().default_dtype().shape(&[values.len() as u64]);
            let mut writer = options.writer(&mut array).begin_nd().unwrap();
            writer.extend(values.iter().copied()).unwrap();
            writer.finish().unwrap();
            zip.write_all(&with_shape(&array, values.len(), shape)).unwrap();
        }
        zip.finish().unwrap().flush().unwrap();
    }

    fn read(&self) -> taki::Result<VolumeTexture> {
        let dir = folder();
        let path = dir.path().join("hand-made.npz");
        self.write(&path);
        read_npz(&path, &ROOMY, &Unwatched)
    }
}

/// Replaces the shape in an array's header and keeps the header's length, which is padded.
fn with_shape(array: &[u8], len: usize, shape: &[u64]) -> Vec<u8> {
    let header_len = 10 + u16::from_le_bytes([array[8], array[9]]) as usize;
    let header = String::from_utf8(array[10..header_len].to_vec()).unwrap();
    let claimed = match shape {
        [one] => format!("({one}, )"),
        _ => format!("({})", shape.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")),
    };
    assert!(header.contains(&format!("({len}, )")), "{header}");
    let header = header.replace(&format!("({len}, )"), &claimed);
    let header = format!("{:<width$}\n", header.trim_end(), width = header_len - 11);
    assert_eq!(header.len(), header_len - 10, "the padding is used up");
    [&array[..10], header.as_bytes(), &array[header_len..]].concat()
}

#[test]
fn what_is_written_is_read_back_cell_for_cell() {
    let dir = folder();
    for alpha in [1.0, 0.37, 1e-3] {
        let volume = build(&WaterSpec { alpha, ..spec([17, 40, 9], 8) });
        let back = read_bytes(&dir, &bytes_of(&volume)).unwrap();
        assert_eq!(back, volume);
        assert_eq!(bytes_of(&back), bytes_of(&volume), "the bytes depend on the volume alone");
    }
}

#[test]
fn a_hand_made_file_is_read_with_and_without_alpha() {
    let plain = Arrays::default().read().unwrap();
    assert_eq!((plain.size, plain.alpha, plain.cells.len()), ([4, 3, 2], 1.0, CELLS));
    let cell = plain.cells[7];
    assert!((cell.rho() - 0.5).abs() < 1e-5 && cell.k_codes() == (64, 191));
    assert!(cell.v().distance(glam::Vec3::new(0.0, 0.6, 0.8)) < 1e-3);
    let half = Arrays { alpha: Some((vec![], vec![0.5])), ..Default::default() }.read().unwrap();
    assert_eq!((half.alpha, half.cells[0].rho_code()), (0.5, 65535));
}

#[test]
fn every_prefix_of_a_file_is_refused() {
    let dir = folder();
    let bytes = bytes_of(&build(&spec([3, 4, 2], 2)));
    assert!(read_bytes(&dir, &bytes).is_ok());
    for end in 0..bytes.len() {
        let fault = read_bytes(&dir, &bytes[..end]).expect_err("a cut file");
        assert_eq!(fault.exit_code(), 65, "{end} bytes: {fault}");
    }
}

#[test]
fn flipped_bytes_never_panic_and_never_change_a_value_unseen() {
    let dir = folder();
    let volume = build(&spec([3, 4, 2], 2));
    let bytes = bytes_of(&volume);
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let mut refused = 0;
    for _ in 0..400 {
        let mut flipped = bytes.clone();
        let at = rng.random_range(0..bytes.len());
        flipped[at] ^= 1 << rng.random_range(0..8);
        match read_bytes(&dir, &flipped) {
            // Dates, versions and the like are ignored. Array data has a checksum.
            Ok(read) => assert_eq!(read, volume, "bit flipped in byte {at}"),
            Err(fault) => {
                assert!([65, 33].contains(&fault.exit_code()), "byte {at}: {fault}");
                refused += 1;
            }
        }
    }
    assert!(refused > 200, "only {refused} of 400 were noticed");
}

#[test]
fn random_bytes_between_a_files_ends_never_panic() {
    let dir = folder();
    let bytes = bytes_of(&build(&spec([3, 4, 2], 2)));
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    for _ in 0..300 {
        let mut noisy = bytes.clone();
        for _ in 0..rng.random_range(1..20) {
            let at = rng.random_range(0..bytes.len());
            noisy[at] = rng.random();
        }
        if let Err(fault) = read_bytes(&dir, &noisy) {
            assert!([65, 33].contains(&fault.exit_code()), "{fault}");
        }
    }
}

#[test]
fn faulty_arrays_are_refused_with_exit_code_65_and_the_arrays_name() {
    let refused = |name: &str, arrays: Arrays| {
        let fault = arrays.read().expect_err(name);
        assert_eq!(fault.exit_code(), 65, "{name}: {fault}");
        assert!(fault.to_string().contains(&format!("{name}: ")), "{name} is not named: {fault}");
    };
    let ok = Arrays::default;
    for name in ["rho", "v"] {
        refused(name, Arrays { left_out: name, ..ok() });
    }
    let change = |mut values: Vec<f32>, at: usize, value: f32| {
        values[at] = value;
        values
    };
    for value in [1.000_1, -0.1, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        refused("rho", Arrays { rho: (ok().rho.0, change(ok().rho.1, 11, value)), ..ok() });
        refused("k", Arrays { k: (ok().k.0, change(ok().k.1, 47, value)), ..ok() });
        refused("alpha", Arrays { alpha: Some((vec![], vec![value])), ..ok() });
    }
    for value in [0.7, -0.5, 0.0, f32::NAN, f32::INFINITY, 1e30] {
        refused("v", Arrays { v: (ok().v.0, change(ok().v.1, 4, value)), ..ok() });
    }
    // A cell with density needs a direction, and no density may exceed α.
    let mut v = ok().v.1;
    v[3..6].fill(0.0);
    refused("rho", Arrays { v: (ok().v.0, v), ..ok() });
    refused("rho", Arrays { alpha: Some((vec![], vec![0.25])), ..ok() });
    // These shapes contradict one another or the data.
    refused("v", Arrays { v: (vec![2, 3, 3, 4], ok().v.1), ..ok() });
    refused("v", Arrays { v: (vec![4, 3, 2, 3], ok().v.1), ..ok() });
    refused("k", Arrays { k: (vec![2, 3, 4, 3], ok().k.1), ..ok() });
    refused("alpha", Arrays { alpha: Some((vec![2], vec![1.0, 1.0])), ..ok() });
    refused("rho", Arrays { rho: (SHAPE.to_vec(), vec![0.5; CELLS - 1]), ..ok() });
    refused("rho", Arrays { rho: (SHAPE.to_vec(), vec![0.5; CELLS + 1]), ..ok() });
    refused("v", Arrays { v: (ok().v.0, vec![0.0; 3 * CELLS - 1]), ..ok() });
}

#[test]
fn a_density_that_is_no_volume_is_refused_with_exit_code_65() {
    for shape in [vec![24], vec![6, 4], vec![2, 3, 2, 2], vec![0, 3, 4]] {
        let arrays = Arrays { rho: (shape.clone(), vec![0.5; CELLS]), ..Default::default() };
        assert_eq!(arrays.read().expect_err("no volume").exit_code(), 65, "{shape:?}");
    }
}

#[test]
fn a_claimed_size_over_the_budget_is_refused_before_it_is_allocated() {
    // 10^15 cells cannot be allocated. An attempt would end the process.
    let n = 100_000;
    let huge = |shape: Vec<u64>| Arrays { rho: (shape, vec![0.5; CELLS]), ..Default::default() };
    assert_eq!(huge(vec![n, n, n]).read().expect_err("10^15 cells").exit_code(), 33);
    // 24 cells need 480 bytes.
    let dir = folder();
    let path = dir.path().join("small.npz");
    Arrays::default().write(&path);
    let within =
        |budget| read_npz(&path, &ReadOptions { storage: StorageChoice::Dense, budget, ..ROOMY }, &Unwatched);
    assert_eq!(within(479).expect_err("a budget too small").exit_code(), 33);
    assert!(within(480).is_ok());
}

#[test]
fn what_is_no_file_is_refused() {
    let dir = folder();
    assert_eq!(read_npz(&dir.path().join("none.npz"), &ROOMY, &Unwatched).unwrap_err().exit_code(), 65);
    assert_eq!(read_npz(dir.path(), &ROOMY, &Unwatched).unwrap_err().exit_code(), 65);
    assert_eq!(read_bytes(&dir, b"PK\x03\x04 no archive").unwrap_err().exit_code(), 65);
}
