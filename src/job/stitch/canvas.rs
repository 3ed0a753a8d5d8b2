//! The row of the whole picture that is being assembled.

use crate::output::frame::{Channel, Encoding, Format, half_of};
use crate::util::window::Window;

/// Converts a line to channels that are half floats where those of `from` are floats.
pub fn recoded(line: &[u8], from: &[Channel], to: &[Channel]) -> Vec<u8> {
    let width = line.len() / from.iter().map(Channel::bytes).sum::<usize>();
    let mut out = Vec::with_capacity(line.len());
    let mut rest = line;
    for (from, to) in from.iter().zip(to) {
        let (values, after) = rest.split_at(width * from.bytes());
        rest = after;
        if from.half == to.half {
            out.extend_from_slice(values);
        } else {
            let values = values.chunks_exact(4).map(bytemuck::pod_read_unaligned::<f32>);
            values.for_each(|value| out.extend_from_slice(&half_of(value).to_ne_bytes()));
        }
    }
    out
}

/// The row of the whole picture that is being assembled.
pub struct Canvas {
    /// Pixels of a row.
    width: usize,
    /// Bytes that a pixel has in each plane: all of it in a developed picture, 2 or 4 in a channel of an EXR.
    items: Vec<usize>,
    pub row: Vec<u8>,
    /// By column, the index of the part that the pixel came from, plus 1; 0 where no part has drawn.
    owner: Vec<u32>,
}

impl Canvas {
    pub fn new(format: Format, encoding: Encoding, width: u32, channels: &[Channel]) -> Canvas {
        let items = match format {
            Format::Exr => channels.iter().map(Channel::bytes).collect(),
            _ => vec![encoding.pixel_bytes()],
        };
        let width = width as usize;
        let row = vec![0; width * items.iter().sum::<usize>()];
        Canvas { width, items, row, owner: vec![0; width] }
    }

    pub fn clear(&mut self) {
        self.owner.fill(0);
    }

    /// Draws a row of the part `index`.
    ///
    /// # Errors
    /// If a pixel differs from what another part drew there: its column, and the index of that part.
    pub fn draw(
        &mut self,
        index: usize,
        window: Window,
        row: &[u8],
    ) -> std::result::Result<(), (usize, usize)> {
        let (count, first) = (window.width as usize, window.x as usize);
        let mut done = 0;
        while done < count {
            let owner = self.owner[first + done];
            // A run of pixels with the same owner is copied or compared at once.
            let run = self.owner[first + done..first + count].iter().take_while(|&&o| o == owner).count();
            // Bytes that a pixel has in the planes before.
            let mut before = 0;
            for &item in &self.items {
                let target = before * self.width + item * (first + done)..;
                let target = &mut self.row[target][..item * run];
                let source = &row[before * count + item * done..][..item * run];
                before += item;
                if owner == 0 {
                    target.copy_from_slice(source);
                } else if let Some(byte) = (0..item * run).find(|&i| target[i] != source[i]) {
                    return Err((first + done + byte / item, owner as usize - 1));
                }
            }
            if owner == 0 {
                self.owner[first + done..][..run].fill(index as u32 + 1);
            }
            done += run;
        }
        Ok(())
    }
}
