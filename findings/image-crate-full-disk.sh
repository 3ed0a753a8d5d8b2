#!/usr/bin/env bash
# The image crate's save reports success on a full disk.
#
# Versions: image 0.25.10 (crate, PNG and Radiance HDR), /dev/full of Linux.
# Expected: save_with_format returns the error of any write that fails.
# Seen: a small picture (its file is less than 8 KiB) is "saved" with Ok(()) on a device that takes no byte,
#   as PNG and as Radiance HDR. A larger picture returns the error.
# Why it matters: a farm marks a thumbnail or a light probe as done that is empty. Encode into memory and
#   write the bytes yourself.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
[ -c /dev/full ] || cannot "there is no /dev/full"
cargo_build 'image = { version = "=0.25.10", default-features = false, features = ["hdr", "png"] }' <<'RUST'
use image::{ImageFormat, Rgb, Rgb32FImage, RgbImage};

fn main() {
    for size in [32u32, 256] {
        let bytes = RgbImage::from_fn(size, size, |x, y| Rgb([(x * 7) as u8, (x * y) as u8, (x ^ y) as u8]));
        let floats = Rgb32FImage::from_fn(size, size, |x, y| Rgb([x as f32 + 0.1, y as f32, (x ^ y) as f32]));
        let told = |result: image::ImageResult<()>| format!("{:?}", result.map_err(|e| e.to_string()));
        let png = told(bytes.save_with_format("/dev/full", ImageFormat::Png));
        let hdr = told(floats.save_with_format("/dev/full", ImageFormat::Hdr));
        println!("png {size} = {png}");
        println!("hdr {size} = {hdr}");
    }
    let std_says = std::fs::write("/dev/full", [0]).map_err(|e| e.to_string());
    println!("std = {std_says:?}");
}
RUST
observe "$work/crate/target/debug/finding"
full='Err("No space left on device (os error 28)")'
expect "std, one byte" "$(seen std)" "$full"
expect "PNG of 32x32" "$(seen "png 32")" "Ok(())"
expect "HDR of 32x32" "$(seen "hdr 32")" "Ok(())"
expect "PNG of 256x256" "$(seen "png 256")" "$full"
expect "HDR of 256x256" "$(seen "hdr 256")" "$full"
verdict
