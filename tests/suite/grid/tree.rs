//! The sparse storage against dense arrays and maps.

use std::collections::HashMap;

use glam::DAffine3;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use taki::grid::{BlockData, Bounds, Builder, Class, Grid};

fn value(index: [i32; 3], channel: usize) -> f32 {
    let [x, y, z] = index.map(|x| x as f32);
    x + 100.0 * y + 10_000.0 * z + 0.25 * channel as f32
}

/// A dense grid whose values tell their index.
fn dense(channels: usize, origin: [i32; 3], size: [u32; 3]) -> Grid {
    let mut values = Vec::new();
    for z in 0..size[2] as i32 {
        for y in 0..size[1] as i32 {
            for x in 0..size[0] as i32 {
                let index = [origin[0] + x, origin[1] + y, origin[2] + z];
                values.extend((0..channels).map(|channel| value(index, channel)));
            }
        }
    }
    Grid::from_dense("test", channels, origin, size, values, DAffine3::IDENTITY)
}

#[test]
fn a_dense_array_is_found_again_at_negative_indices_too() {
    for channels in [1, 3] {
        let (origin, size) = ([-13, 250, -3], [29, 17, 9]);
        let grid = dense(channels, origin, size);
        assert_eq!(grid.channels(), channels);
        assert_eq!(grid.active_count(), 29 * 17 * 9);
        let bounds = Bounds { min: origin, max: [15, 266, 5] };
        assert_eq!(grid.bounds(), Some(bounds));
        assert_eq!(bounds.size(), size.map(u64::from));
        let mut reader = grid.reader();
        for z in -5..8 {
            for y in 248..270 {
                for x in -15..18 {
                    let index = [x, y, z];
                    let inside = (0..3).all(|a| (bounds.min[a]..=bounds.max[a]).contains(&index[a]));
                    let expected: [f32; 3] = std::array::from_fn(|channel| match inside {
                        true if channel < channels => value(index, channel),
                        _ => 0.0,
                    });
                    assert_eq!(reader.at(index), expected, "{index:?}");
                    assert_eq!(grid.at(index), expected, "{index:?}");
                }
            }
        }
    }
}

#[test]
fn constant_blocks_of_an_array_are_tiles() {
    let grid = Grid::from_dense("c", 1, [-8, 0, 0], [24, 16, 8], vec![0.5; 24 * 16 * 8], DAffine3::IDENTITY);
    let tiles = grid.blocks().filter(|b| matches!(b.data, BlockData::Tile { is_active: true, .. })).count();
    assert_eq!((tiles, grid.blocks().count()), (6, 6));
    assert_eq!(grid.active_count(), 24 * 16 * 8);
    assert_eq!((grid.at([15, 15, 7]), grid.at([16, 0, 0])), ([0.5, 0.0, 0.0], [0.0; 3]));
}

#[test]
fn an_empty_grid_has_no_bounds() {
    let grid = Grid::from_dense("e", 3, [0; 3], [0, 4, 4], vec![], DAffine3::IDENTITY);
    assert_eq!((grid.bounds(), grid.active_count(), grid.blocks().count()), (None, 0, 0));
    assert_eq!(grid.at([0; 3]), [0.0; 3]);
}

#[test]
fn tiles_of_every_size_and_leaves_stand_side_by_side() {
    let mut builder = Builder::new(1, [-1.0, 0.0, 0.0]);
    let mut corners = HashMap::new();
    for (i, side) in [8, 16, 64, 128, 512, 4096].into_iter().enumerate() {
        let origin = [4096 * (i as i32 - 3), -4096, 4096 - side as i32];
        builder.tile(origin, side, [i as f32, 0.0, 0.0], i != 2).expect("placed");
        corners.insert(origin, (side, i as f32));
    }
    builder.leaf([8, 8, 8], [1 << 63, 0, 0, 0, 0, 0, 0, 2], |v| v[0] = 7.0).expect("placed");
    builder.tile([16, 8, 8], 8, [-1.0, 0.0, 0.0], false).expect("left out");
    let grid = builder.finish("tiles", Class::LevelSet, DAffine3::IDENTITY);
    for (origin, (side, value)) in corners {
        let last = side - 1;
        let end = origin.map(|x| x + last as i32);
        assert_eq!((grid.at(origin)[0], grid.at(end)[0]), (value, value), "{side}");
        assert_eq!(grid.at([end[0] + 1, end[1], end[2]])[0], -1.0, "{side}");
    }
    assert_eq!((grid.at([8; 3])[0], grid.at([9, 8, 8])[0], grid.at([16, 8, 8])[0]), (7.0, -1.0, -1.0));
    let cubes: u64 = [8u64, 16, 128, 512, 4096].iter().map(|side| side.pow(3)).sum();
    assert_eq!(grid.active_count(), cubes + 2);
    // Bit 63 of the first layer is (7, 7, 0) and bit 1 of the last one (1, 0, 7).
    let leaf = grid.blocks().next().and_then(|block| block.bounds());
    assert_eq!(leaf, Some(Bounds { min: [9, 8, 8], max: [15, 15, 15] }));
    assert_eq!(grid.blocks().map(|b| b.active_count()).sum::<u64>(), grid.active_count());
    assert!(grid.bytes() > 2048 && grid.bytes() < 200_000, "{} bytes", grid.bytes());
}

#[test]
fn blocks_that_lie_askew_or_twice_are_refused() {
    let mut builder = Builder::new(3, [0.0; 3]);
    let nothing = |_: &mut [f32]| {};
    assert!(builder.leaf([4, 0, 0], [0; 8], nothing).is_err());
    assert!(builder.tile([8, 0, 0], 16, [1.0; 3], true).is_err());
    assert!(builder.tile([0; 3], 24, [1.0; 3], true).is_err());
    assert!(builder.tile([0; 3], 4, [1.0; 3], true).is_err());
    builder.leaf([i32::MIN; 3], [0; 8], nothing).expect("the first block of all");
    builder.tile([i32::MAX - 7; 3], 8, [1.0; 3], true).expect("the last block of all");
    assert!(builder.tile([i32::MIN; 3], 8, [1.0; 3], true).is_err());
    builder.tile([0; 3], 4096, [1.0; 3], true).expect("placed");
    assert!(builder.tile([0; 3], 4096, [1.0; 3], true).is_err());
    let grid = builder.finish("edges", Class::Unknown, DAffine3::IDENTITY);
    assert_eq!(grid.bounds(), Some(Bounds { min: [0; 3], max: [i32::MAX; 3] }));
}

#[test]
fn random_samples_are_where_a_map_has_them() {
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let mut map: HashMap<[i32; 3], f32> = HashMap::new();
    for i in 0..5000 {
        map.insert(std::array::from_fn(|_| (random.next_u64() % 600) as i32 - 300), i as f32 + 1.0);
    }
    let mut leaves: HashMap<[i32; 3], ([u64; 8], Vec<f32>)> = HashMap::new();
    for (index, value) in &map {
        let (mask, values) = leaves.entry(index.map(|x| x & !7)).or_insert_with(|| ([0; 8], vec![0.0; 512]));
        let [x, y, z] = index.map(|x| (x & 7) as usize);
        mask[z] |= 1 << (x + 8 * y);
        values[x + 8 * y + 64 * z] = *value;
    }
    let mut builder = Builder::new(1, [0.0; 3]);
    for (origin, (mask, values)) in &leaves {
        builder.leaf(*origin, *mask, |into| into.copy_from_slice(values)).expect("placed");
    }
    let grid = builder.finish("random", Class::Unknown, DAffine3::IDENTITY);
    assert_eq!(grid.active_count(), map.len() as u64);
    let bounds = grid.bounds().expect("samples");
    for a in 0..3 {
        assert_eq!(Some(bounds.min[a]), map.keys().map(|index| index[a]).min());
        assert_eq!(Some(bounds.max[a]), map.keys().map(|index| index[a]).max());
    }
    let mut reader = grid.reader();
    for _ in 0..200_000 {
        let index: [i32; 3] = std::array::from_fn(|_| (random.next_u64() % 620) as i32 - 310);
        assert_eq!(reader.at(index)[0], map.get(&index).copied().unwrap_or(0.0));
    }
}
