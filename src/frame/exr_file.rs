//! EXR: float32, linear, one part with dotted channel names, and the resolved scene as attributes.

use std::io::{Seek, Write};
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, ImageAttributes, LayerAttributes,
    LineOrder, ReadChannels, ReadLayers, Text, WritableImage,
};

use super::{Frame, Layer};
use crate::error::{Error, Result};

/// Writes `layers` of a frame. The bytes depend on the arguments alone.
pub fn write_exr(
    frame: &Frame,
    layers: &[Layer],
    texts: &[(&str, &str)],
    out: impl Write + Seek,
) -> std::result::Result<(), exr::error::Error> {
    let size = (frame.width as usize, frame.height as usize);
    let pixels = size.0 * size.1;
    let channels = layers.iter().flat_map(|layer| {
        layer.channels().iter().enumerate().map(move |(c, name)| {
            let values: Vec<f32> = (0..pixels).map(|i| layer.value(frame, c, i)).collect();
            AnyChannel::new(*name, FlatSamples::F32(values))
        })
    });
    let channels = AnyChannels::sort(channels.collect());
    let mut attributes = LayerAttributes::default();
    for (key, text) in texts {
        if *key == "Software" {
            attributes.software_name = Some(Text::from(*text));
        } else {
            // A hash map: a second text of this kind would come in an order of its own each time.
            attributes.other.insert(Text::from(*key), AttributeValue::Text(Text::from(*text)));
        }
    }
    // Without an order, chunks are written as the threads finish them.
    let encoding = Encoding { line_order: LineOrder::Increasing, ..Encoding::FAST_LOSSLESS };
    let layer = exr::prelude::Layer::new(size, attributes, encoding, channels);
    let image = Image { attributes: ImageAttributes::with_size(size), layer_data: smallvec_of(layer) };
    image.write().to_buffered(out)
}

fn smallvec_of<T>(layer: exr::prelude::Layer<T>) -> exr::prelude::Layers<T> {
    std::iter::once(layer).collect()
}

/// Channels of an EXR file, by name, row by row.
pub type Channels = Vec<(String, Vec<f32>)>;

/// Reads every channel of the first part of an EXR file: width, height, channels.
pub fn read_exr(path: &Path) -> Result<(u32, u32, Channels)> {
    let bad = |why: String| Error::input(format!("{}: {why}", path.display()), "give an EXR image");
    let file = std::fs::File::open(path).map_err(|e| Error::read(path, e))?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::BufReader::new(file))
        .map_err(|e| bad(e.to_string()))?;
    let size = image.layer_data.size;
    let channels = image.layer_data.channel_data.list;
    let channels =
        channels.into_iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()));
    Ok((size.width() as u32, size.height() as u32, channels.collect()))
}
