//! Options that take one of a few words. The words and their help stand here, so that the library's own types
//! need no derive for the command line.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::quality::Quality;
use crate::engine::EngineChoice;
use crate::output::frame::Compression;
use crate::output::movie::Codec;
use crate::picture::Layer;
#[cfg(feature = "viewer")]
use crate::viewer::WindowChoice;

/// Word, help and value of each choice of an option.
type Choices<T> = [(&'static str, &'static str, T)];

/// Parses the words of `choices`. Help, completions and error messages list them.
fn choice<T: Copy + Send + Sync + 'static>(choices: &'static Choices<T>) -> impl TypedValueParser<Value = T> {
    let words = choices.iter().map(|(word, help, _)| PossibleValue::new(*word).help(*help));
    PossibleValuesParser::new(words).try_map(|word| {
        let chosen = choices.iter().find(|(known, ..)| *known == word);
        chosen.map(|(.., value)| *value).ok_or("unknown word")
    })
}

/// Parser of `--engine`.
pub fn engine() -> impl TypedValueParser<Value = EngineChoice> {
    choice(&[
        ("auto", "A GPU if there is one, otherwise the CPU", EngineChoice::Auto),
        (
            "gpu",
            "A GPU adapter, also one that is software; without one, taki exits with code 69",
            EngineChoice::Gpu,
        ),
        ("cpu", "All cores of the CPU", EngineChoice::Cpu),
    ])
}

/// Parser of `--quality`.
pub fn quality() -> impl TypedValueParser<Value = Quality> {
    choice(&[
        ("draft", "One sample and two layers, for the place of things", Quality::Draft),
        ("preview", "Four samples, for light and look", Quality::Preview),
        ("final", "64 samples, interpolated cells and eight layers", Quality::Final),
    ])
}

/// Parser of `--bits`.
pub fn bits() -> impl TypedValueParser<Value = u8> {
    choice(&[
        ("8", "256 steps, dithered; what displays show", 8),
        ("16", "65536 steps, for programs that change the picture", 16),
    ])
}

/// Parser of `--movie-bits`.
pub fn movie_bits() -> impl TypedValueParser<Value = u8> {
    choice(&[
        ("8", "Plays everywhere", 8),
        ("10", "Four times as many steps; older players may not show it", 10),
    ])
}

/// Parser of `--codec`.
pub fn codec() -> impl TypedValueParser<Value = Codec> {
    choice(&[
        ("h264", "H.264, 4:2:0: plays everywhere", Codec::H264),
        ("h265", "H.265, 4:2:0: smaller", Codec::H265),
        ("prores", "ProRes 422 HQ, 10 bits, .mov alone: for editing", Codec::Prores),
        ("vp9", "VP9, 4:2:0, .webm alone", Codec::Vp9),
    ])
}

/// Parser of `--window`.
#[cfg(feature = "viewer")]
pub fn window() -> impl TypedValueParser<Value = WindowChoice> {
    choice(&[
        (
            "auto",
            "Vulkan, Metal or Direct3D on a GPU; OpenGL if only software drivers exist",
            WindowChoice::Auto,
        ),
        ("wgpu", "Vulkan, Metal or Direct3D", WindowChoice::Wgpu),
        ("opengl", "OpenGL", WindowChoice::Opengl),
    ])
}

/// Parser of `--compression`.
pub fn compression() -> impl TypedValueParser<Value = Compression> {
    let words =
        Compression::ALL.map(|method| PossibleValue::new(method.word()).help(compression_help(method)));
    PossibleValuesParser::new(words).try_map(|word| {
        Compression::ALL.into_iter().find(|method| method.word() == word).ok_or("unknown compression")
    })
}

fn compression_help(method: Compression) -> &'static str {
    match method {
        Compression::Zip => "Deflate, 16 lines at a time: the usual one",
        Compression::Zips => "Deflate, line by line: less memory, and fast access to parts",
        Compression::Piz => "Wavelets, 32 lines at a time: small where colours are grainy",
        Compression::Rle => "Run lengths: the fastest",
        Compression::None => "None: the largest files",
    }
}

/// Parser of one word of `--layers`.
pub fn layer() -> impl TypedValueParser<Value = Layer> {
    let words = Layer::ALL.map(|layer| PossibleValue::new(layer.name()).help(layer_help(layer)));
    PossibleValuesParser::new(words)
        .try_map(|word| Layer::ALL.into_iter().find(|layer| layer.name() == word).ok_or("unknown layer"))
}

fn layer_help(layer: Layer) -> &'static str {
    match layer {
        Layer::Rgb | Layer::Rgba => "Linear radiance (channels R, G, B; with --alpha also A)",
        Layer::Depth => "Metres to the first surface, along the view (depth.Z) and the ray (distance.D)",
        Layer::Uv => "Texture coordinates (u, v) on the quad",
        Layer::Quad => "Number of the quad plus 1; 0 if there is none",
        Layer::Transmittance => "Transmittance of the volume, 0 to 1",
        Layer::Cells => "Number of cells that the view rays walked",
        Layer::Normal => "Normal of the first surface, on the side that is seen",
    }
}
