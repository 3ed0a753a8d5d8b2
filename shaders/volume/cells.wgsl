// The volume's cells as walks read them. Shared by the stages visibility and integrate, which bind `volume` and `bricks`.

// Whether cells are stored in bricks: src/volume/bricks.rs. `volume` then holds the stored ones, one after the other.
override SPARSE: bool = false;

// The words of a cell; `at` is its place in the dense texture.
fn cell_words(at: vec3<i32>) -> vec2<u32> {
    if !SPARSE {
        return textureLoad(volume, at).xy;
    }
    // The mask's halves, and the numbers of the first cells of either.
    let brick = textureLoad(bricks, at >> vec3<u32>(2u));
    let bit = u32((at.x & 3) | ((at.y & 3) << 2u) | ((at.z & 1) << 4u));
    let upper = (at.z & 2) != 0;
    let mask = select(brick.x, brick.y, upper);
    let below = mask & ((1u << bit) - 1u);
    let number = i32(select(brick.z, brick.w, upper) + countOneBits(below));
    let words = textureLoad(volume, vec3<i32>(number & 1023, (number >> 10u) & 1023, number >> 20u)).xy;
    return select(vec2<u32>(0u), words, ((mask >> bit) & 1u) != 0u);
}
