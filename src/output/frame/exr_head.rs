//! Header of the EXR files that are written: channels, compression, colour space, rate and camera.

use std::fmt;

use exr::meta::header::Header;
use exr::prelude::attribute::Chromaticities;
use exr::prelude::{
    ChannelDescription, Compression as Method, ImageAttributes, LayerAttributes, SampleType, Vec2,
};

use crate::picture::{Camera, Gamut, Layer};
use crate::util::error::{Error, Result};

/// Largest block that is compressed at once without being asked for, bytes.
const SMALL_BLOCK: u64 = 8 << 20;
/// Largest block that is compressed at once, bytes. It is held three times.
const LARGEST_BLOCK: u64 = 32 << 20;
/// Width of the film of which a focal length is told, mm: that of a frame of 35 mm film in a still camera.
const FILM_MM: f64 = 36.0;

/// Lossless compression of an EXR.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// None.
    None,
    /// Run lengths, line by line.
    Rle,
    /// Deflate, line by line.
    Zips,
    /// Deflate, 16 lines at a time.
    #[default]
    Zip,
    /// Wavelets and Huffman's code, 32 lines at a time.
    Piz,
}

impl Compression {
    /// All of them.
    pub const ALL: [Compression; 5] =
        [Compression::Zip, Compression::Zips, Compression::Piz, Compression::Rle, Compression::None];

    /// Returns the word on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Compression::None => "none",
            Compression::Rle => "rle",
            Compression::Zips => "zips",
            Compression::Zip => "zip",
            Compression::Piz => "piz",
        }
    }

    pub(super) fn method(self) -> Method {
        match self {
            Compression::None => Method::Uncompressed,
            Compression::Rle => Method::RLE,
            Compression::Zips => Method::ZIP1,
            Compression::Zip => Method::ZIP16,
            Compression::Piz => Method::PIZ,
        }
    }

    pub(super) fn of(method: Method) -> Option<Compression> {
        Compression::ALL.into_iter().find(|compression| compression.method() == method)
    }

    /// Returns the number of lines that are compressed at a time.
    pub fn lines(self) -> u32 {
        self.method().scan_lines_per_block() as u32
    }

    /// Returns the compression for pictures of this width: the one asked for; otherwise ZIP, or ZIPS where
    /// 16 lines take more than 8 MiB. The width is that of the whole picture, so that a part is compressed as
    /// the whole is.
    ///
    /// # Errors
    /// [`Error::Usage`] if the one asked for needs too much memory.
    pub fn for_width(asked: Option<Compression>, channels: &[Channel], width: u32) -> Result<Compression> {
        let line = u64::from(width) * channels.iter().map(|c| c.bytes() as u64).sum::<u64>();
        let block = |compression: Compression| line * u64::from(compression.lines());
        match asked {
            None if block(Compression::Zip) <= SMALL_BLOCK => Ok(Compression::Zip),
            None => Ok(Compression::Zips),
            Some(asked) if asked.lines() == 1 || block(asked) <= LARGEST_BLOCK => Ok(asked),
            Some(asked) => Err(Error::Usage(format!(
                "--compression {}: {} lines of {width} pixels have {} MiB, and at most {} are compressed at \
                 a time; use zips, rle or none, or write fewer layers",
                asked.word(),
                asked.lines(),
                block(asked) >> 20,
                LARGEST_BLOCK >> 20
            ))),
        }
    }
}

/// Channel of an EXR.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Name.
    pub name: String,
    /// Whether its values are half floats; otherwise they are floats.
    pub half: bool,
}

impl Channel {
    /// Returns the size of a value, bytes.
    pub fn bytes(&self) -> usize {
        if self.half { 2 } else { 4 }
    }

    pub(super) fn description(&self) -> ChannelDescription {
        let kind = if self.half { SampleType::F16 } else { SampleType::F32 };
        ChannelDescription::named(self.name.as_str(), kind)
    }

    pub(super) fn of(description: &ChannelDescription) -> Option<Channel> {
        let half = match description.sample_type {
            SampleType::F16 => true,
            SampleType::F32 => false,
            SampleType::U32 => return None,
        };
        (description.sampling == Vec2(1, 1)).then(|| Channel { name: description.name.to_string(), half })
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.name, if self.half { " (half)" } else { "" })
    }
}

/// Formats channels for messages.
pub fn listed(channels: &[Channel]) -> String {
    channels.iter().map(Channel::to_string).collect::<Vec<_>>().join(", ")
}

/// Returns whether a channel may be half floats: a half has 11 binary digits and ends at 65504, which is
/// enough for colours, shares and directions, but not for distances, numbers and texture coordinates.
pub fn fits_half(name: &str) -> bool {
    let layer = Layer::ALL.into_iter().find(|layer| layer.channels().contains(&name));
    match layer {
        Some(Layer::Rgb | Layer::Rgba | Layer::Transmittance | Layer::Normal) => true,
        Some(Layer::Depth | Layer::Uv | Layer::Quad | Layer::Cells) => false,
        None => name == "A",
    }
}

/// Attributes that tell of an EXR's picture, besides texts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExrHead {
    /// Compression.
    pub compression: Compression,
    /// Primaries of R, G and B.
    pub gamut: Gamut,
    /// Frames per second as a fraction, if the picture is one of a sequence.
    pub rate: Option<[u32; 2]>,
    /// Camera of the whole picture.
    pub camera: Option<ExrCamera>,
}

/// A camera as OpenEXR tells it: matrices for row vectors, row by row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExrCamera {
    /// From the world, metres, to the camera: x to the right, y up, z forward.
    pub world_to_camera: [f32; 16],
    /// From the world to the picture: x from 0 on its left to 1 on its right, y from 0 at its top to 1 at its
    /// bottom, after division by the fourth component.
    pub world_to_ndc: [f32; 16],
    /// Width of what is seen at the distance 1.
    pub width_at_1: f32,
}

impl ExrCamera {
    /// Returns the camera of a picture of this size.
    pub fn new(camera: &Camera, [width, height]: [u32; 2]) -> ExrCamera {
        let [world_to_camera, world_to_ndc] =
            [camera.camera_from_world(), camera.ndc_from_world(width, height)];
        // The columns of a matrix for column vectors are the rows of one for row vectors.
        let rows = |m: glam::DMat4| m.to_cols_array().map(|x| x as f32);
        let aspect = f64::from(width) / f64::from(height);
        ExrCamera {
            world_to_camera: rows(world_to_camera),
            world_to_ndc: rows(world_to_ndc),
            width_at_1: (2.0 * f64::from(camera.tan_half_fov) * aspect) as f32,
        }
    }

    /// Returns the attributes by which the field's programs know the angle of view, with their names: that of
    /// V-Ray in degrees, and those of Arnold in mm.
    pub(super) fn lens(&self, [width, height]: [u32; 2]) -> [(&'static str, f32); 4] {
        let half = f64::from(self.width_at_1) / 2.0;
        let film_height = FILM_MM * f64::from(height) / f64::from(width);
        [
            ("cameraFov", (2.0 * half.atan().to_degrees()) as f32),
            ("CameraFocalLength", (FILM_MM / 2.0 / half) as f32),
            ("CameraFilmApertureHorizontal", FILM_MM as f32),
            ("CameraFilmApertureVertical", film_height as f32),
        ]
    }
}

impl ExrHead {
    /// Returns the attributes that the library writes.
    pub(super) fn attributes(&self, whole: [u32; 2]) -> (ImageAttributes, LayerAttributes) {
        let [width, height] = whole.map(|n| n as usize);
        let mut image = ImageAttributes::with_size((width, height));
        let [rx, ry, gx, gy, bx, by, wx, wy] = self.gamut.chromaticities().map(|x| x as f32);
        image.chromaticities = Some(Chromaticities {
            red: Vec2(rx, ry),
            green: Vec2(gx, gy),
            blue: Vec2(bx, by),
            white: Vec2(wx, wy),
        });
        let mut own = LayerAttributes {
            frames_per_second: self.rate.map(|[n, d]| (n as i32, d)),
            ..LayerAttributes::default()
        };
        if let Some(camera) = &self.camera {
            own.world_to_camera = Some(camera.world_to_camera);
            own.world_to_normalized_device = Some(camera.world_to_ndc);
            own.screen_window_width = camera.width_at_1;
        }
        (image, own)
    }

    /// Reads the head of a file that this program wrote. `None` for other compressions.
    pub(super) fn of(header: &Header) -> Option<ExrHead> {
        let (image, own) = (&header.shared_attributes, &header.own_attributes);
        let gamut = image.chromaticities.and_then(|Chromaticities { red, green, blue, white }| {
            let all = [red.0, red.1, green.0, green.1, blue.0, blue.1, white.0, white.1];
            Gamut::of(&all.map(f64::from))
        });
        let camera = own.world_to_camera.zip(own.world_to_normalized_device);
        Some(ExrHead {
            compression: Compression::of(header.compression)?,
            gamut: gamut.unwrap_or_default(),
            rate: own.frames_per_second.and_then(|(n, d)| Some([u32::try_from(n).ok()?, d])),
            camera: camera.map(|(world_to_camera, world_to_ndc)| ExrCamera {
                world_to_camera,
                world_to_ndc,
                width_at_1: own.screen_window_width,
            }),
        })
    }
}
