// §4 Layout of the volumes' levels in their texture: each volume itself comes first; its coarse levels lie
// behind it along z, one after the other along y. Shared by the stages visibility and integrate. Twins:
// LevelAtlas in src/volume/pyramid.rs, and Level in src/trace/lookup.rs.

// Whether the texture holds coarse levels.
override PYRAMID: bool = false;
// Whether the texture holds several volumes.
override SEVERAL: bool = false;

struct Level {
    // 0 is the volume itself.
    number: u32,
    // Position of the volume's first cell in the texture.
    base: vec3<i32>,
    // Position of the level's first cell among the levels of its volume.
    offset: vec3<i32>,
    size: vec3<i32>,
    // Cells of the level per cell of the volume.
    scale: vec3<f32>,
    // Depth of one cell of the level, in cells of the volume.
    deep: f32,
}

fn level_size(size: vec3<i32>, number: u32) -> vec3<i32> {
    return ((size - 1) >> vec3<u32>(number)) + 1;
}

fn level_new(size: vec3<i32>, base: vec3<i32>, number: u32) -> Level {
    var level = Level(number, base, vec3<i32>(0), size, vec3<f32>(1.0), 1.0);
    if PYRAMID {
        if number > 0u {
            level.size = level_size(size, number);
            level.offset.z = (size.z + 3) & ~3;
            for (var l = 1u; l < number; l++) {
                level.offset.y += level_size(size, l).y;
            }
            level.scale = vec3<f32>(level.size) / vec3<f32>(size);
            level.deep = 1.0 / level.scale.z;
        }
    }
    return level;
}

// Position of a cell among the levels of its volume, as light volumes have them.
fn in_level(cell: vec3<i32>, level: Level) -> vec3<i32> {
    if PYRAMID {
        return cell + level.offset;
    }
    return cell;
}

// Position of a cell of a level in the texture.
fn in_texture(cell: vec3<i32>, level: Level) -> vec3<i32> {
    if SEVERAL {
        return in_level(cell, level) + level.base;
    }
    return in_level(cell, level);
}
