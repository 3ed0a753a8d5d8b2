//! The picture and its motion.

use super::Cost::*;
use super::Kind::*;
use super::{Group, p};
use crate::picture::{AutoExposure, Dither, Filter, Gamut, Tone};
use crate::scene::keyframes::Interpolation;

pub(super) const IMAGE: Group = Group {
    title: "Image",
    about: "These parameters set the size of the picture, its samples, and the way from linear radiance to \
         what is shown. Exposure, bloom, white balance, tone curve, vignette, grain and dither change what \
         is shown; an EXR holds the radiance without them.",
    params: &[
        p("image.width", "", "pixels", Int(1, 1_000_000, 1280), Uniform)
            .slider(16.0, 8192.0)
            .doc("Width of the picture.")
            .when("Lower it for drafts, raise it for the final picture; `--size` sets width and height."),
        p("image.height", "", "pixels", Int(1, 1_000_000, 720), Uniform)
            .slider(16.0, 8192.0)
            .doc("Height of the picture.")
            .when("Lower it for drafts, raise it for the final picture; the field of view stays as it is."),
        p("image.samples", "", "", Int(1, 4096, 1), Uniform)
            .slider(1.0, 256.0)
            .doc("Number of samples in a pixel. Their mean position is the pixel's centre.")
            .when("Raise it when edges are jagged or strands flicker; the time grows with it."),
        p("image.filter", "", "", Choice(Filter::WORDS), Uniform)
            .doc(
                "Spread of a pixel's samples: `box` is even over the pixel; `gaussian` and \
                 `blackman-harris` are three pixels wide and denser in the middle. A single sample is not \
                 spread.",
            )
            .when(
                "Choose `gaussian` or `blackman-harris` when edges look hard; keep `box` for the sharpest \
                 picture.",
            ),
        p("image.rock_error", "", "samples", Float(0.0, 16.0, 0.5), Uniform)
            .slider(0.0, 4.0)
            .doc(
                "Largest error of the outlines of rock, in distances between samples. Within it fewer \
                 triangles are drawn; 0 draws all of them.",
            )
            .when("Raise it to draw rock faster; lower it to 0 for reference pictures."),
        p("image.alpha", "", "", Switch(false), Uniform)
            .doc(
                "Transparent background: the picture holds water, rock, pools and haze, and its alpha tells \
                 how much of what is put behind them they hide. The background and the environment give \
                 light, but are not seen.",
            )
            .when("Set it to put the water over a photograph or another rendering; `--alpha` does the same."),
        p("image.primaries", "", "", Choice(Gamut::WORDS), Uniform)
            .doc(
                "Primaries of linear light, in EXR files and with `--linear`: `rec709` are those of sRGB, \
                 `acescg` is AP1 with the white of ACES, `rec2020` is wide gamut television. Pictures and \
                 movies for a display stay sRGB.",
            )
            .when("Set it to the working space of your compositor; docs/aces.md shows the way into ACES."),
        p("image.exposure", "", "stops", Float(-32.0, 32.0, 0.0), Uniform)
            .slider(-8.0, 8.0)
            .doc("Exposure: the radiance is multiplied by 2^exposure.")
            .when("Raise it when the picture is too dark; lower it when bright water burns out."),
        p("image.auto_exposure", "", "", Choice(AutoExposure::WORDS), Uniform)
            .doc(
                "Stops added to the exposure, measured on frame 0: `average` brings the logarithmic mean \
                 to middle grey; `highlights` lets the brightest hundredth of the pixels begin at 1.",
            )
            .when(
                "Choose `average` for a first look at a new scene, `highlights` to keep white water from \
                 burning out.",
            ),
        p("image.bloom", "", "", Float(0.0, 1.0, 0.0), Uniform)
            .slider(0.0, 0.5)
            .doc(
                "Share of the light that is spread around bright things. It needs the whole picture, not \
                 a crop.",
            )
            .when(
                "Raise it to about 0.1 or 0.2 for lamps and glints that should glow; 0 leaves every edge \
                 clean.",
            ),
        p("image.bloom_radius", "", "heights", Float(0.0, 0.25, 0.04), Uniform)
            .doc("Standard deviation of the widest of the bloom's six octaves, in heights of the image.")
            .when("Raise it for a wide, faint glow; lower it for a tight one."),
        p("image.temperature", "", "K", Float(1500.0, 15000.0, 6500.0), Uniform)
            .slider(2500.0, 12000.0)
            .doc("White balance: light of this colour temperature is shown as light of 6500 K.")
            .when(
                "Lower it to take away the yellow of lamps or evening light; raise it for a warmer \
                 picture.",
            ),
        p("image.tint", "", "Duv/1000", Float(-50.0, 50.0, 0.0), Uniform)
            .doc(
                "White balance: how far the light lies from that of a black body of `image.temperature`. \
                 Above 0 that light is greener, and the picture turns magenta.",
            )
            .when("Raise it against a green cast; lower it against a magenta one."),
        p("image.tone", "", "", Choice(Tone::WORDS), Uniform)
            .doc(
                "Tone curve: `filmic` is Narkowicz's fit of ACES, `agx` is Sobotka's AgX, `none` cuts off \
                 what is brighter than 1.",
            )
            .when(
                "Choose `agx` when bright coloured light should turn white, `none` when pixel values \
                 should be compared.",
            ),
        p("image.dither", "", "", Choice(Dither::WORDS), Uniform)
            .doc(
                "Rounding to 8 bits: `pattern` rounds up or down by a fixed fine pattern, whose mean is the \
                 exact colour; `none` rounds to the nearest value. 16-bit pictures are not dithered.",
            )
            .when(
                "Choose `none` for the smallest files, or when pixel values should be compared; smooth \
                 skies then show bands.",
            ),
        p("image.vignette", "", "stops", Float(0.0, 8.0, 0.0), Uniform)
            .slider(0.0, 3.0)
            .doc(
                "Stops by which the corners are darker than the middle, as tests of lenses state it; between \
                 them the light falls by the cos⁴ law. An EXR is without it.",
            )
            .when("Set it to about 0.7 to lead the eye to the middle, as a fast lens does; 0 is even."),
        p("image.grain", "", "", Float(0.0, 0.5, 0.0), Uniform)
            .slider(0.0, 0.1)
            .doc(
                "Grain of the picture as shown: standard deviation in the middle greys, as a share of white. \
                 Black and white stay clean, and so do EXR files and `--linear`. A grain is a pixel.",
            )
            .when(
                "Set it to about 0.02 for the look of film; an animation gets another pattern in each frame.",
            ),
        p("image.grain_seed", "", "", Int(0, 2_147_483_647, 0), Uniform)
            .slider(0.0, 100.0)
            .doc("Number of the grain's pattern. An animation adds the number of its frame.")
            .when("Change it where two pictures side by side should not have the same grain."),
    ],
};

pub(super) const ANIMATION: Group = Group {
    title: "Animation",
    about: "`taki batch` renders a scene in time; `taki render --frame` renders one moment of it. The water \
         moves by itself, a turntable or a path moves the camera, and tracks move other parameters. \
         Frames are counted from 0; there are frames before it, too.",
    params: &[
        p("animate.frames", "", "frames", Int(1, 1_000_000, 96), Uniform)
            .slider(1.0, 1000.0)
            .doc("Number of frames of an animation that is not a loop.")
            .when("Raise it for a longer film; `--frames` renders a part of it."),
        p("animate.fps", "", "1/s", Float(0.01, 1000.0, 24.0), Uniform)
            .slider(1.0, 120.0)
            .doc("Number of frames in a second.")
            .when("Set it to the frame rate of the film; the water keeps its speed."),
        p("animate.loop", "", "frames", Int(0, 1_000_000, 0), Uniform)
            .slider(0.0, 1000.0)
            .doc(
                "Length of a loop in frames: after so many frames the animation repeats exactly. \
                 Keyframes lie within it and lead back to the first. 0 means no loop.",
            )
            .when(
                "Set it for a film that repeats without a jump; a few seconds are enough for falling \
                 water.",
            ),
        p("animate.speed", "", "lengths/s", Float(-1000.0, 1000.0, 0.5), Uniform)
            .slider(0.0, 4.0)
            .doc(
                "Speed at which the volume `water` moves down the flow; others stay, unless a track moves \
                 `volumes.*.flow`. A loop rounds it to whole lengths of the volume, but not to none.",
            )
            .when(
                "Raise it for faster water; lower it for slow motion. A sheet falls at its natural speed \
                 when this is `materials.*.repeat_v` divided by the seconds of the fall.",
            ),
        p("animate.turn", "", "frames", Int(-1_000_000, 1_000_000, 0), Uniform)
            .slider(-1000.0, 1000.0)
            .doc(
                "Number of frames in which the camera goes once round its target, about `camera.up`. \
                 Negative numbers go the other way; 0 leaves the camera where it is.",
            )
            .when("Set it to `animate.loop` for a turntable that repeats without a jump."),
        p("animate.path.frames", "", "frames", Frames, Uniform)
            .doc(
                "Frames at which the camera is at the points of its path. Without them they are spread \
                 evenly.",
            )
            .when("Set them when the camera should linger at some points and hurry between others."),
        p("animate.path.eyes", "", "m", Series, Uniform)
            .doc("Points of the camera's path, at least two. A smooth curve goes through them.")
            .when("Set them when the camera should travel; in a loop the path closes by itself."),
        p("animate.path.targets", "", "m", Series, Uniform)
            .doc(
                "Points that the camera looks at, one for each point of the path. Without them it looks \
                 at `camera.target`.",
            )
            .when("Set them when the camera should turn its view on the way."),
        p("animate.tracks.*.key", "", "", Text(""), Uniform)
            .doc(
                "Key of the parameter that the track moves. It holds numbers, and is neither the size of \
                 the image nor a parameter of the animation.",
            )
            .when("Add a track when something besides the water and the camera should change in time."),
        p("animate.tracks.*.frames", "", "frames", Frames, Uniform)
            .doc("Frames of the keyframes.")
            .when("Move keyframes apart for a slower change, together for a faster one."),
        p("animate.tracks.*.values", "", "", Series, Uniform)
            .doc("Values at the keyframes, one for each frame.")
            .when("Set the same value at two keyframes in a row to let the parameter rest between them."),
        p("animate.tracks.*.interpolation", "", "", Choice(Interpolation::WORDS), Uniform)
            .doc(
                "Course between keyframes: `linear` is straight, `smooth` is a curve that never \
                 overshoots, `hold` keeps the value until the next keyframe.",
            )
            .when(
                "Choose `smooth` when a change should start and end gently, `hold` when it should happen \
                 at once.",
            ),
    ],
};
