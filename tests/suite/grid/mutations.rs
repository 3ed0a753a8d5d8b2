//! Mutations of small files: the reader answers with a whole grid or an error.
//!
//! `cargo test --release grid::mutations -- --ignored` reads a million of them.

use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use taki::grid::{BlockData, Grid, list, read};

use super::{Folder, npz, sample, written};

/// Memory that a mutated file may take, bytes.
const MEMORY: u64 = 4 << 20;

/// Numbers that break things.
const NUMBERS: [u64; 12] = [
    0,
    1,
    2,
    0x7f,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    1 << 32,
    1 << 40,
    i64::MAX as u64,
    u64::MAX,
];

fn below(random: &mut Pcg64Mcg, most: usize) -> usize {
    (random.next_u64() % most.max(1) as u64) as usize
}

/// A place in a file: mostly near one of its bytes that are not 0.
fn place(random: &mut Pcg64Mcg, file: &[u8], filled: &[usize]) -> usize {
    match below(random, 4) {
        0 => below(random, file.len()),
        _ => (filled[below(random, filled.len())] + below(random, 8)).min(file.len() - 1),
    }
}

/// Changes a file in one of six ways.
fn mutate(random: &mut Pcg64Mcg, file: &[u8], filled: &[usize]) -> Vec<u8> {
    let mut out = file.to_vec();
    let at = place(random, file, filled);
    match below(random, 12) {
        0 => out.truncate(at),
        1 => {
            let end = (at + 1 + below(random, 40)).min(out.len());
            let part = out[at..end].to_vec();
            match below(random, 2) {
                0 => drop(out.drain(at..end)),
                _ => drop(out.splice(at..at, part)),
            }
        }
        2..=5 => {
            let number = NUMBERS[below(random, NUMBERS.len())].to_le_bytes();
            let end = (at + if below(random, 2) == 0 { 4 } else { 8 }).min(out.len());
            out[at..end].copy_from_slice(&number[..end - at]);
        }
        6..=8 => out[at] ^= 1 << below(random, 8),
        _ => (0..1 + below(random, 8)).for_each(|_| {
            let at = place(random, file, filled);
            out[at] = random.next_u64() as u8;
        }),
    }
    out
}

/// Checks that a grid is whole.
fn check(grid: &Grid) {
    assert!(grid.bytes() <= MEMORY, "{} bytes", grid.bytes());
    assert!(grid.to_world.is_finite() && grid.background.iter().all(|x| x.is_finite()));
    let mut active = 0u64;
    for block in grid.blocks() {
        active = active.saturating_add(block.active_count());
        match block.data {
            BlockData::Leaf { values, .. } => assert!(values.iter().all(|x| x.is_finite())),
            BlockData::Tile { value, .. } => assert!(value.iter().all(|x| x.is_finite())),
        }
    }
    assert_eq!(active, grid.active_count());
    assert_eq!(grid.bounds().is_some(), active > 0);
    if let Some(bounds) = grid.bounds() {
        assert!((0..3).all(|a| bounds.min[a] <= bounds.max[a]));
        assert!(
            [bounds.min, bounds.max].map(|index| grid.at(index)).as_flattened().iter().all(|x| x.is_finite())
        );
    }
}

/// Writes the bytes that differ between two contents of a file.
fn change(file: &mut File, from: &[u8], to: &[u8]) {
    let Some(first) = from
        .iter()
        .zip(to)
        .position(|(a, b)| a != b)
        .or((from.len() != to.len()).then(|| from.len().min(to.len())))
    else {
        return;
    };
    let last = match from.len() == to.len() {
        true => to.len() - from.iter().rev().zip(to.iter().rev()).position(|(a, b)| a != b).unwrap_or(0),
        false => to.len(),
    };
    file.seek(SeekFrom::Start(first as u64)).expect("a place");
    file.write_all(&to[first..last.max(first)]).expect("written");
    file.set_len(to.len() as u64).expect("cut");
}

/// Reads mutations of a sample. Returns how many still had a grid.
fn read_mutations(seed: u64, name: &str, count: usize) -> usize {
    let whole = match name {
        WRITTEN => written::nano(),
        ARRAYS => npz::small(),
        _ => sample(name),
    };
    let filled: Vec<usize> = (0..whole.len()).filter(|&i| whole[i] != 0).collect();
    let folder = Folder::new(name, &whole);
    let path = folder.path();
    let names = |grids: Vec<taki::grid::Summary>| -> Vec<String> {
        grids.into_iter().filter(|grid| grid.refusal.is_none()).map(|grid| grid.name).collect()
    };
    let known = names(list(&path, MEMORY).expect("a list"));
    known.iter().for_each(|grid| check(&read(&path, grid, MEMORY).expect("a grid")));
    let mut file = OpenOptions::new().write(true).open(&path).expect("a file");
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut grids = 0;
    for i in 0..count {
        let mutated = mutate(&mut random, &whole, &filled);
        change(&mut file, &whole, &mutated);
        // A list without the grid is an answer as well.
        if let Ok(listed) = list(&path, MEMORY) {
            let listed = names(listed);
            let name = &listed.get(i % listed.len().max(1)).unwrap_or(&known[0]).clone();
            if let Ok(grid) = read(&path, name, MEMORY) {
                check(&grid);
                grids += 1;
            }
        }
        change(&mut file, &mutated, &whole);
    }
    grids
}

/// A file that the library itself writes.
const WRITTEN: &str = "written.nvdb";
/// Arrays of NumPy.
const ARRAYS: &str = "arrays.npz";

/// Samples, how many mutations of each are read, and how many of these may still be grids.
const FILES: [(&str, usize, [usize; 2]); 11] = [
    ("old_off_two.vdb", 4000, [100, 3900]),
    ("cc_zip_mask.vdb", 4000, [100, 3900]),
    ("tool_active_16.vdb", 4000, [100, 3900]),
    ("old_vector.vdb", 4000, [100, 3900]),
    ("cc_other_tree.vdb", 4000, [100, 3900]),
    ("tool_zip.nvdb", 5000, [50, 4900]),
    ("tool_blosc.nvdb", 3000, [30, 2900]),
    ("warp_blosc.nvdb", 2000, [20, 1950]),
    ("warp_none.nvdb", 10_000, [100, 9900]),
    (WRITTEN, 2000, [20, 1950]),
    (ARRAYS, 2000, [20, 1950]),
];

#[test]
fn mutated_files_are_read_or_refused() {
    std::thread::scope(|scope| {
        for (i, (name, count, [least, most])) in FILES.into_iter().enumerate() {
            scope.spawn(move || {
                let grids = read_mutations(i as u64, name, count);
                println!("{name}: {grids} grids");
                assert!((least..most).contains(&grids), "{name}: {grids} grids in {count}");
            });
        }
    });
}

#[test]
#[ignore = "takes many minutes"]
fn a_million_mutated_files_are_read_or_refused() {
    std::thread::scope(|scope| {
        for (i, (name, count, _)) in FILES.into_iter().enumerate() {
            scope.spawn(move || {
                let start = std::time::Instant::now();
                let grids = read_mutations(100 + i as u64, name, 25 * count);
                println!("{name}: {grids} grids in {}, {:?}", 25 * count, start.elapsed());
            });
        }
    });
}
