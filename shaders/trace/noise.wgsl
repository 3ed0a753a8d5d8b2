// Numbers at the points of a lattice. Twin: src/trace/noise.rs.

// Hash of a lattice point, 0 to 1.
fn lattice(x: u32, y: u32, z: u32) -> f32 {
    var h = (x * 0x8da6b343u) ^ (y * 0xd8163841u) ^ (z * 0xcb1ab31fu);
    h = (h ^ (h >> 13u)) * 0x9e3779b1u;
    h = h ^ (h >> 16u);
    return f32(h >> 8u) / 16777216.0;
}
