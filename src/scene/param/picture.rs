//! The picture and its motion.

use super::Cost::*;
use super::Kind::*;
use super::{Param, p};

pub(super) const TABLE: &[Param] = &[
    p("image.width", "", "pixels", Int(1, 1_000_000, 1280), Uniform, "Width of the picture.")
        .slider(16.0, 8192.0),
    p("image.height", "", "pixels", Int(1, 1_000_000, 720), Uniform, "Height of the picture.")
        .slider(16.0, 8192.0),
    p(
        "image.samples",
        "",
        "",
        Int(1, 4096, 1),
        Uniform,
        "Jittered samples a pixel; 1 is the pixel's centre.",
    )
    .slider(1.0, 256.0),
    p(
        "image.filter",
        "",
        "",
        Choice(&["box", "gaussian", "blackman-harris"]),
        Uniform,
        "How several samples are spread about a pixel: evenly over it, or three pixels wide and denser in the middle.",
    ),
    p(
        "image.rock_error",
        "",
        "samples",
        Float(0.0, 16.0, 0.5),
        Uniform,
        "How far outlines of rock may be off, in distances between samples: where less is lost, fewer triangles are drawn; 0: all are.",
    )
    .slider(0.0, 4.0),
    p(
        "image.exposure",
        "",
        "stops",
        Float(-32.0, 32.0, 0.0),
        Uniform,
        "Factor 2^exposure on the radiance, in the PNG only.",
    )
    .slider(-8.0, 8.0),
    p(
        "image.auto_exposure",
        "",
        "",
        Choice(&["none", "average", "highlights"]),
        Uniform,
        "Adds stops measured on frame 0: the logarithmic mean becomes middle grey, or the brightest hundredth begins at 1.",
    ),
    p(
        "image.bloom",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Uniform,
        "Share of the light that is spread around bright things, in the PNG only; of whole pictures only.",
    )
    .slider(0.0, 0.5),
    p(
        "image.bloom_radius",
        "",
        "heights",
        Float(0.0, 0.25, 0.04),
        Uniform,
        "How far it is spread: standard deviation of the widest of its six octaves, in heights of the image.",
    ),
    p(
        "image.temperature",
        "",
        "K",
        Float(1500.0, 15000.0, 6500.0),
        Uniform,
        "White balance of the PNG: light of this colour temperature is shown as that of 6500 K; lower turns the picture blue.",
    )
    .slider(2500.0, 12000.0),
    p(
        "image.tint",
        "",
        "Duv/1000",
        Float(-50.0, 50.0, 0.0),
        Uniform,
        "How much greener than a black body that light is; above 0 turns the picture magenta.",
    ),
    p(
        "image.tone",
        "",
        "",
        Choice(&["filmic", "agx", "none"]),
        Uniform,
        "Tone curve of the PNG: Narkowicz's fit of ACES, Sobotka's AgX, or none.",
    ),
    p("animate.frames", "", "frames", Int(1, 1_000_000, 96), Uniform, "Frames of the animation; --frames chooses others.")
        .slider(1.0, 1000.0),
    p("animate.fps", "", "1/s", Float(0.01, 1000.0, 24.0), Uniform, "Frames a second.").slider(1.0, 120.0),
    p(
        "animate.loop",
        "",
        "frames",
        Int(0, 1_000_000, 0),
        Uniform,
        "The animation comes round exactly after so many frames, which then are its length; 0: it does not.",
    )
    .slider(0.0, 1000.0),
    p(
        "animate.speed",
        "",
        "lengths/s",
        Float(-1000.0, 1000.0, 0.5),
        Uniform,
        "How fast the volume moves down the flow; in a loop rounded to whole lengths, but not to none.",
    )
    .slider(0.0, 4.0),
    p(
        "animate.turn",
        "",
        "frames",
        Int(-1_000_000, 1_000_000, 0),
        Uniform,
        "Turntable: the camera goes once round its target, about camera.up, in so many frames; 0: it does not.",
    )
    .slider(-1000.0, 1000.0),
    p("animate.path.frames", "", "frames", Frames, Uniform, "When the camera is at the points of its path."),
    p("animate.path.eyes", "", "m", Series, Uniform, "Points of the camera's path: a smooth curve goes through them."),
    p(
        "animate.path.targets",
        "",
        "m",
        Series,
        Uniform,
        "What the camera looks at there; without them camera.target all the way.",
    ),
    p("animate.tracks.*.key", "", "", Text(""), Uniform, "The parameter that a track moves, any with a numeric value."),
    p("animate.tracks.*.frames", "", "frames", Frames, Uniform, "Frames of its keyframes."),
    p("animate.tracks.*.values", "", "", Series, Uniform, "Values at its keyframes."),
    p(
        "animate.tracks.*.interpolation",
        "",
        "",
        Choice(&["linear", "smooth", "hold"]),
        Uniform,
        "Between keyframes: straight lines, a smooth curve that never overshoots, or steps.",
    ),
];
