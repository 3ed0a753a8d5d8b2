// §2 The volume's cells as walks read them. A stage that imports this file binds `volume` and `bricks`.

// Whether the storage is sparse (src/volume/bricks.rs). `volume` then holds the stored cells, one after the
// other.
override SPARSE: bool = false;

// Words of a cell; `at` is its position in the dense texture.
fn cell_words(at: vec3<i32>) -> vec2<u32> {
    if !SPARSE {
        return textureLoad(volume, at).xy;
    }
    // The low and the high half of the mask, and the index of the first stored cell of each half.
    let brick = textureLoad(bricks, at >> vec3<u32>(2u));
    let bit = u32((at.x & 3) | ((at.y & 3) << 2u) | ((at.z & 1) << 4u));
    let upper = (at.z & 2) != 0;
    let mask = select(brick.x, brick.y, upper);
    let below = mask & ((1u << bit) - 1u);
    let index = i32(select(brick.z, brick.w, upper) + countOneBits(below));
    let words = textureLoad(volume, vec3<i32>(index & 1023, (index >> 10u) & 1023, index >> 20u)).xy;
    return select(vec2<u32>(0u), words, ((mask >> bit) & 1u) != 0u);
}
