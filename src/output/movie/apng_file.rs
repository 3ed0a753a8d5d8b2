//! Animated PNG. Programs that do not know animation show its first frame.

use std::fs::File;

use super::MovieOptions;
use crate::output::frame::Output;
use crate::util::error::{Error, Result};

pub(super) struct ApngWriter {
    writer: png::Writer<File>,
    output: Output,
}

impl ApngWriter {
    pub(super) fn create(mut output: Output, options: &MovieOptions) -> Result<Self> {
        let [width, height] = options.size;
        let path = output.path().to_owned();
        let mut open = || -> std::result::Result<_, png::EncodingError> {
            // The file is unbuffered: the encoder writes whole chunks, and the drop of a buffer would hide
            // errors.
            let file = output.file().try_clone()?;
            let mut encoder = png::Encoder::new(file, width, height);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
            encoder.add_text_chunk("Comment".into(), options.mark_text())?;
            if options.frames > 1 {
                encoder.set_animated(options.frames as u32, if options.repeat { 0 } else { 1 })?;
                let [seconds, parts] = delay(options.fps);
                encoder.set_frame_delay(seconds, parts)?;
            }
            encoder.write_header()
        };
        let writer = open().map_err(|e| Error::write(&path, e))?;
        Ok(ApngWriter { writer, output })
    }

    pub(super) fn push(&mut self, rgb: &[u8]) -> Result<()> {
        self.writer.write_image_data(rgb).map_err(|e| Error::write(self.output.path(), e))
    }

    pub(super) fn finish(self) -> Result<()> {
        let ApngWriter { writer, output } = self;
        writer.finish().map_err(|e| Error::write(output.path(), e))?;
        output.finish()
    }
}

/// Returns 1 / `fps` as a fraction of two 16-bit numbers: the last convergent of its continued fraction that
/// fits. Whole rates, 23.976 and 30000/1001 are exact. The relative error of a rate with many digits is less
/// than 1/65535, which is ten milliseconds in eleven minutes.
pub(super) fn delay(fps: f64) -> [u16; 2] {
    let ([mut n, mut d], [mut n_before, mut d_before]) = ([1u64, 0u64], [0u64, 1u64]);
    let mut x = 1.0 / fps;
    loop {
        let whole = x.floor();
        let next = [whole as u64 * n + n_before, whole as u64 * d + d_before];
        if next[0] > 65_535 || next[1] > 65_535 {
            break;
        }
        ([n_before, d_before], [n, d]) = ([n, d], next);
        // A smaller remainder is rounding, as after 125/2997.
        if x - whole < 1e-9 {
            break;
        }
        x = 1.0 / (x - whole);
    }
    [n as u16, d as u16]
}

#[cfg(test)]
mod tests {
    #[test]
    fn delays_are_the_fractions_meant() {
        assert_eq!(super::delay(24.0), [1, 24]);
        assert_eq!(super::delay(23.976), [125, 2997]);
        assert_eq!(super::delay(30000.0 / 1001.0), [1001, 30000]);
        assert_eq!(super::delay(0.25), [4, 1]);
        assert_eq!(super::delay(0.001), [1000, 1]);
        assert_eq!(super::delay(1000.0), [1, 1000]);
        for i in 1..2000 {
            let fps = i as f64 * 0.499_713;
            let [n, d] = super::delay(fps);
            assert!((n as f64 / d as f64 * fps - 1.0).abs() < 1.0 / 65_535.0, "{fps}: {n}/{d}");
        }
    }
}
