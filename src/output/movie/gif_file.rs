//! GIF, with one palette for the whole movie and a dither that is the same in all frames, so that parts at
//! rest do not flicker. The palette needs all frames; until then they are stored in an unnamed file beside
//! the target.

use std::fs::File;
use std::io::{BufWriter, Read, Seek, Write};

use gif::{DisposalMethod, Encoder, EncodingError, Repeat};

use super::MovieOptions;
use super::palette::{Ditherer, PaletteSample};
use crate::output::frame::Output;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

/// Index of a pixel that does not change.
const SAME: u8 = 255;

pub(super) struct GifWriter {
    output: Output,
    /// File of the raw frames. The system removes it even if the process is killed.
    waiting: File,
    sample: PaletteSample,
    options: MovieOptions,
}

impl GifWriter {
    pub(super) fn create(output: Output, options: &MovieOptions) -> Result<Self> {
        let waiting = tempfile::tempfile_in(output.folder()).map_err(|e| Error::CannotCreate {
            path: output.path().to_owned(),
            why: e.to_string(),
            fix: "choose a place you may write to with -o".into(),
        })?;
        let pixels = options.size[0] as u64 * options.size[1] as u64;
        let sample = PaletteSample::new(pixels, options.frames);
        Ok(GifWriter { output, waiting, sample, options: *options })
    }

    pub(super) fn push(&mut self, rgb: &[u8]) -> Result<()> {
        self.waiting.write_all(rgb).map_err(|e| Error::write(self.output.path(), e))?;
        self.sample.add(rgb);
        Ok(())
    }

    pub(super) fn finish(self, monitor: &dyn Monitor) -> Result<()> {
        let GifWriter { mut output, mut waiting, sample, options } = self;
        let path = output.path().to_owned();
        let fail = |e: EncodingError| Error::write(&path, e);
        let frames = options.frames;
        monitor.progress("encoding", 0, frames)?;
        let mut ditherer = Ditherer::new(sample.palette());
        let [width, height] = options.size.map(|side| side as u16);
        let buffered = BufWriter::with_capacity(1 << 20, output.file());
        let mut encoder = Encoder::new(buffered, width, height, ditherer.palette()).map_err(fail)?;
        if options.repeat && frames > 1 {
            encoder.set_repeat(Repeat::Infinite).map_err(fail)?;
        }
        let mark = options.mark_text();
        encoder
            .write_raw_extension(gif::AnyExtension(gif::Extension::Comment as u8), &[mark.as_bytes()])
            .map_err(|e| Error::write(&path, e))?;
        waiting.rewind().map_err(|e| Error::read(&path, e))?;
        let mut rgb = vec![0; options.frame_bytes()];
        let mut before = Vec::new();
        for i in 0..frames {
            waiting.read_exact(&mut rgb).map_err(|e| Error::read(&path, e))?;
            let indices = ditherer.dither(&rgb, width as usize);
            let mut frame = changes(&before, &indices, width as usize);
            frame.delay = delay(i, options.fps);
            encoder.write_frame(&frame).map_err(fail)?;
            before = indices;
            monitor.progress("encoding", i + 1, frames)?;
        }
        let buffered = encoder.into_inner().map_err(|e| Error::write(&path, e))?;
        buffered.into_inner().map_err(|e| Error::write(&path, e.into_error()))?;
        output.finish()
    }
}

/// Returns the duration of frame `i` in hundredths of a second. Its start and end are each rounded to a
/// hundredth.
fn delay(i: u64, fps: f64) -> u16 {
    let at = |i: u64| (i as f64 * 100.0 / fps).round();
    (at(i + 1) - at(i)) as u16
}

/// Returns the part of a frame that differs from the frame `before`, with [`SAME`] for pixels that do not
/// change.
fn changes(before: &[u8], now: &[u8], width: usize) -> gif::Frame<'static> {
    let height = now.len() / width;
    let [mut left, mut right, mut top, mut bottom] = [width, 0, height, 0];
    for (y, (a, b)) in before.chunks(width).zip(now.chunks(width)).enumerate() {
        if let Some(x) = (0..width).find(|&x| a[x] != b[x]) {
            left = left.min(x);
            right = right.max((0..width).rfind(|&x| a[x] != b[x]).map_or(0, |x| x + 1));
            top = top.min(y);
            bottom = y + 1;
        }
    }
    if before.is_empty() {
        [left, right, top, bottom] = [0, width, 0, height];
    } else if bottom == 0 {
        // GIF has no empty frames, so a frame without changes is one unchanged pixel.
        [left, right, top, bottom] = [0, 1, 0, 1];
    }
    let mut buffer = Vec::with_capacity((right - left) * (bottom - top));
    for y in top..bottom {
        let row = y * width;
        buffer.extend((left..right).map(|x| match before.get(row + x) {
            Some(&same) if same == now[row + x] => SAME,
            _ => now[row + x],
        }));
    }
    gif::Frame {
        left: left as u16,
        top: top as u16,
        width: (right - left) as u16,
        height: (bottom - top) as u16,
        transparent: (!before.is_empty()).then_some(SAME),
        dispose: DisposalMethod::Keep,
        buffer: buffer.into(),
        ..Default::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_add_up_to_the_whole() {
        for fps in [0.01, 1.0, 12.5, 23.976, 24.0, 30.0, 45.0, 50.0] {
            let mut sum = 0;
            for i in 0..1000 {
                let d = delay(i, fps);
                assert!(d >= 2, "{fps}: viewers take 1 for 10");
                sum += d as u64;
                assert!((sum as f64 / 100.0 - (i + 1) as f64 / fps).abs() <= 0.005 + 1e-9, "{fps} {i}");
            }
        }
    }

    #[test]
    fn only_what_changes_is_written() {
        let before = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1];
        let mut now = before;
        [now[5], now[10]] = [2, 3];
        let frame = changes(&before, &now, 4);
        assert_eq!([frame.left, frame.top, frame.width, frame.height], [1, 1, 2, 2]);
        assert_eq!(&*frame.buffer, &[2, SAME, SAME, 3]);
        let frame = changes(&now, &now, 4);
        assert_eq!((frame.width, frame.height, &*frame.buffer), (1, 1, &[SAME][..]));
        let frame = changes(&[], &now, 4);
        assert_eq!((frame.width, frame.height, frame.transparent), (4, 3, None));
    }
}
