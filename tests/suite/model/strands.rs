//! Files of hair: what a small file must become, and that broken ones are told.

use glam::Vec3;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use taki::model::Strands;
use taki::{Error, Result};

use super::{Folder, floats, shorts};

/// A header with these arrays, and its default number of segments and thickness.
fn header([strands, points, arrays, segments]: [u32; 4], thickness: f32) -> Vec<u8> {
    let mut bytes = b"HAIR".to_vec();
    bytes.extend([strands, points, arrays, segments].iter().flat_map(|word| word.to_le_bytes()));
    bytes.extend(floats(&[thickness, 0.5, 0.1, 0.2, 0.3]));
    bytes.resize(128, b' ');
    bytes
}

/// Points of two strands, of 3 and of 2 points.
const POINTS: [f32; 15] = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.5, 2.0, 0.0, 3.0, 0.0, 0.0, 3.0, 0.0, -4.0];

/// Both strands with all arrays.
fn whole() -> Vec<u8> {
    let mut bytes = header([2, 5, 31, 7], 9.0);
    bytes.extend(shorts(&[2, 1]));
    bytes.extend(floats(&POINTS));
    bytes.extend(floats(&[0.1, 0.2, 0.3, 0.4, 0.5]));
    bytes.extend(floats(&[0.0; 5]));
    bytes.extend(floats(&[1.0; 15]));
    bytes
}

fn read(folder: &Folder, bytes: &[u8]) -> Result<Strands> {
    folder.write("a.hair", bytes);
    Strands::read(&folder.path("a.hair"), 1 << 20)
}

#[test]
fn strands_have_the_points_and_the_thickness_of_the_file() {
    let folder = Folder::new(&[]);
    let strands = read(&folder, &whole()).expect("strands");
    assert_eq!(strands.count(), 2);
    let (points, widths) = strands.strand(0);
    assert_eq!(points, [Vec3::ZERO, Vec3::Y, Vec3::new(0.5, 2.0, 0.0)]);
    assert_eq!(widths, [0.1, 0.2, 0.3]);
    assert_eq!(strands.strand(1).0, [Vec3::X * 3.0, Vec3::new(3.0, 0.0, -4.0)]);
    assert_eq!(strands.bounds(), Some([Vec3::new(0.0, 0.0, -4.0), Vec3::new(3.0, 2.0, 0.0)]));

    // Without arrays the numbers of the header stand for all: three strands of a single segment.
    let mut even = header([2, 4, 2, 1], 0.25);
    even.extend(floats(&POINTS[..12]));
    let strands = read(&folder, &even).expect("strands");
    assert_eq!((strands.starts, strands.widths), (vec![0, 2, 4], vec![0.25; 4]));
}

#[test]
fn what_is_written_is_read_again_without_strands_of_one_point() {
    let folder = Folder::new(&[]);
    let strands = read(&folder, &whole()).expect("strands");
    let mut more = strands.clone();
    more.push([(Vec3::ONE, 1.0)]);
    for own in [&strands, &more] {
        let mut bytes = Vec::new();
        own.write(&mut bytes).expect("written");
        assert_eq!(read(&folder, &bytes).expect("strands"), strands);
    }
    // A strand longer than a file can hold is cut.
    let mut long = Strands::default();
    long.push((0..70_000).map(|i| (Vec3::X * i as f32, 1.0)));
    let mut bytes = Vec::new();
    long.write(&mut bytes).expect("written");
    folder.write("long.hair", &bytes);
    let cut = Strands::read(&folder.path("long.hair"), 1 << 30).expect("strands");
    assert_eq!((cut.count(), cut.points.len(), cut.points[65535]), (1, 65536, Vec3::X * 65535.0));
}

#[test]
fn broken_files_are_told() {
    let folder = Folder::new(&[]);
    let with = |at: usize, bytes: &[u8]| {
        let mut file = whole();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    let nan = f32::NAN.to_le_bytes();
    let cases: [(Vec<u8>, &str); 10] = [
        (b"HAIR".to_vec(), "ends early"),
        (Vec::new(), "letters HAIR"),
        (with(0, b"hair"), "letters HAIR"),
        (whole()[..150].to_vec(), "ends early"),
        (with(4, &0u32.to_le_bytes()), "no strands"),
        (with(12, &29u32.to_le_bytes()), "no strands"),
        (with(4, &4_000_000_000u32.to_le_bytes()), "4000000000 strands and 5 points"),
        (with(128, &7u16.to_le_bytes()), "10 points, and the file 5"),
        (with(136, &nan), "point 0 is"),
        (with(196, &(-1.0f32).to_le_bytes()), "thickness of point 1 is -1"),
    ];
    for (bytes, words) in cases {
        let error = read(&folder, &bytes).expect_err(words).to_string();
        assert!(error.contains(words) && error.contains("a.hair"), "no {words:?} in: {error}");
    }
    // The memory is known before it is taken.
    folder.write("a.hair", &whole());
    let told = Strands::read(&folder.path("a.hair"), 64).expect_err("too large");
    assert!(matches!(told, Error::Memory { .. }), "{told}");
}

#[test]
fn mutations_give_strands_or_an_error() {
    let (folder, mut random) = (Folder::new(&[]), Pcg64Mcg::seed_from_u64(11));
    let mut refused = 0;
    for _ in 0..4000 {
        let mut bytes = whole();
        for _ in 0..1 + random.next_u64() % 4 {
            let at = (random.next_u64() % 160.min(bytes.len() as u64)) as usize;
            bytes[at] = random.next_u64() as u8;
        }
        if random.next_u64() % 4 == 0 {
            bytes.truncate((random.next_u64() % bytes.len() as u64) as usize);
        }
        match read(&folder, &bytes) {
            Ok(strands) => {
                let points: usize = (0..strands.count()).map(|i| strands.strand(i).0.len()).sum();
                assert!(points == strands.points.len() && points == strands.widths.len() && points <= 5);
            }
            Err(Error::Input { .. } | Error::Memory { .. }) => refused += 1,
            Err(other) => panic!("{other}"),
        }
    }
    assert!((500..4000).contains(&refused), "{refused} refused");
}
