//! The parameter table: every number, choice, colour and file a scene can set, once.
//!
//! It feeds the scene file, `--set`, the resolved print, the README's table and the viewer's sliders.
//! A `*` in a key stands for a name the scene chooses, or for the number of a quad.

use Cost::*;
use Kind::*;

/// What a change of a parameter costs an interactive renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// The volume texture is built again from its curves.
    Volume,
    /// Something already built is packed or uploaded again.
    Upload,
    /// A few bytes of uniforms.
    Uniform,
}

impl Cost {
    /// The word in tables and files.
    pub fn word(self) -> &'static str {
        match self {
            Volume => "volume",
            Upload => "upload",
            Uniform => "uniform",
        }
    }
}

/// Type, range and default of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A float32: smallest, largest, default.
    Float(f64, f64, f64),
    /// A whole number: smallest, largest, default.
    Int(i64, i64, i64),
    /// One of the words; the first is the default.
    Choice(&'static [&'static str]),
    /// Linear RGB, each 0 to 10000.
    Color([f64; 3]),
    /// A point or direction, each component −1e7 to 1e7.
    Point([f64; 3]),
    /// A path or name; empty means none.
    Text(&'static str),
    /// Four points A, B, C, D; there is no default.
    Corners,
    /// Numbers of frames, each larger than the one before; empty by default.
    Frames,
    /// A list of numbers, of triples or of four corners, all alike; empty by default.
    Series,
}

/// One parameter.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// Dotted key in the scene file and for `--set`.
    pub key: &'static str,
    /// The paper's symbol, if it has one.
    pub symbol: &'static str,
    /// Unit, or empty.
    pub unit: &'static str,
    /// Type, range and default.
    pub kind: Kind,
    /// What a change costs.
    pub cost: Cost,
    /// What it is, in one sentence.
    pub doc: &'static str,
    /// Where a slider runs, if that is not the whole of the allowed range.
    pub slider: Option<(f64, f64)>,
}

/// Largest colour component.
pub const COLOR_MAX: f64 = 1.0e4;
/// Largest coordinate, metres.
pub const POINT_MAX: f64 = 1.0e7;
/// Most keyframes of a track.
pub const MAX_KEYFRAMES: usize = 10_000;
/// Largest number of a frame.
pub const MAX_FRAME: i64 = 999_999_999;

const fn p(
    key: &'static str,
    symbol: &'static str,
    unit: &'static str,
    kind: Kind,
    cost: Cost,
    doc: &'static str,
) -> Param {
    Param { key, symbol, unit, kind, cost, doc, slider: None }
}

/// The table, in the order of the method.
pub const PARAMS: &[Param] = &[
    p(
        "curves.across",
        "",
        "",
        Int(1, 65536, 32),
        Volume,
        "Columns of the jitter grid of curve ends on the face y = 0, across the flow.",
    )
    .slider(1.0, 128.0),
    p("curves.deep", "", "", Int(1, 65536, 32), Volume, "Rows of the jitter grid, into the surface.")
        .slider(1.0, 128.0),
    p(
        "curves.h",
        "h",
        "",
        Float(0.0, 8.0, 0.9),
        Volume,
        "Complexity of the spatial fractal curves: small is rough, large is smooth.",
    )
    .slider(0.0, 3.0),
    p(
        "curves.amplitude",
        "",
        "flow lengths",
        Float(0.0, 1.0, 0.05),
        Volume,
        "Standard deviation of g as a fraction of the flow length ny.",
    )
    .slider(0.0, 0.3),
    p(
        "curves.levels",
        "",
        "",
        Int(0, 16, 0),
        Volume,
        "Depth of the recursion; 0: as deep as makes the leaf segments half a cell.",
    ),
    p("volume.nx", "nx", "cells", Int(1, 1_000_000, 40), Volume, "Cells across the flow.").slider(1.0, 256.0),
    p("volume.ny", "ny", "cells", Int(1, 1_000_000, 40), Volume, "Cells along the flow.").slider(1.0, 256.0),
    p("volume.nz", "nz", "cells", Int(1, 1_000_000, 40), Volume, "Cells into the surface.")
        .slider(1.0, 256.0),
    p("volume.seed", "", "", Int(0, i64::MAX, 1), Volume, "Seed of all randomness of the volume."),
    p("volume.alpha", "α", "", Float(0.0, 1.0, 1.0), Uniform, "Scale of the density ρ."),
    p(
        "volume.flow",
        "",
        "lengths",
        Float(-1e6, 1e6, 0.0),
        Uniform,
        "Moves the volume down the flow by this many of its lengths; every whole number gives the same picture.",
    )
    .slider(0.0, 1.0),
    p("volume.k_d", "k_d", "", Float(0.0, 1.0, 0.5), Upload, "Base of the diffuse reflection coefficient."),
    p("volume.k_s", "k_s", "", Float(0.0, 1.0, 0.5), Upload, "Base of the specular reflection coefficient."),
    p(
        "volume.k_noise",
        "",
        "",
        Float(0.0, 1.0, 0.1),
        Upload,
        "Standard deviation of the normal noise added to k_d and k_s.",
    ),
    p(
        "volume.file",
        "",
        "",
        Text(""),
        Volume,
        "Takes the volume texture from this .npz file instead of building it.",
    ),
    p(
        "materials.*.thickness",
        "H",
        "m",
        Float(1e-4, 1e4, 0.4),
        Uniform,
        "Depth of one volume under the face of the quads.",
    )
    .slider(0.01, 10.0),
    p(
        "materials.*.repeat_u",
        "",
        "",
        Float(1e-3, 1e4, 1.0),
        Uniform,
        "Copies of the volume along u, across the flow.",
    )
    .slider(0.1, 20.0),
    p(
        "materials.*.repeat_v",
        "",
        "",
        Float(1e-3, 1e4, 1.0),
        Uniform,
        "Copies of the volume along v, along the flow.",
    )
    .slider(0.1, 20.0),
    p(
        "quads.*.corners",
        "A B C D",
        "m",
        Corners,
        Upload,
        "Corners at (u,v) = (0,0) (1,0) (1,1) (0,1): convex, planar; v runs down the flow.",
    ),
    p("quads.*.material", "", "", Text("water"), Upload, "Name of the quad's material."),
    p(
        "trace.attenuation",
        "",
        "",
        Choice(&["path-length", "per-cell"]),
        Uniform,
        "How a cell attenuates: τ_k = σ·ρ·Δs over the metres inside it, or τ_k = τ·ρ however short the way.",
    ),
    p(
        "trace.sigma",
        "σ",
        "1/m",
        Float(0.0, 1e5, 10.0),
        Uniform,
        "Extinction at ρ = 1, for path-length attenuation.",
    )
    .slider(0.0, 200.0),
    p(
        "trace.tau",
        "τ",
        "",
        Float(0.0, 1e3, 0.1),
        Uniform,
        "Optical depth of one cell at ρ = 1, for per-cell attenuation.",
    )
    .slider(0.0, 2.0),
    p(
        "trace.max_cells",
        "",
        "cells",
        Int(1, 65536, 512),
        Uniform,
        "Most cells one view ray, and one light ray, may meet.",
    )
    .slider(1.0, 2048.0),
    p(
        "trace.early_end",
        "",
        "",
        Float(0.0, 1.0, 1.0 / 1024.0),
        Uniform,
        "A view ray ends where its transmittance falls below this; 0: never.",
    ),
    p(
        "trace.layers",
        "",
        "sheets",
        Int(1, 16, 4),
        Uniform,
        "Most quads one view ray goes through, the nearest first; those behind are left out.",
    ),
    p(
        "light.frame",
        "",
        "",
        Choice(&["world", "texture"]),
        Uniform,
        "Where angles are measured: in the world, or in the volume's own space as in the paper.",
    ),
    p(
        "light.visibility",
        "V",
        "",
        Choice(&["march", "cached", "none"]),
        Uniform,
        "Attenuation between light and cell: an exact walk from the cell's centre, the same walked once for every cell and kept, or none.",
    ),
    p(
        "light.cache",
        "",
        "MiB",
        Int(1, 65536, 512),
        Uniform,
        "Most memory that visibility cached may take, in light volumes of four bytes a cell.",
    )
    .slider(16.0, 4096.0),
    p(
        "light.reflection",
        "Ψ",
        "",
        Choice(&["kajiya-kay", "strand"]),
        Uniform,
        "How a cell reflects: as the paper's fibres, with k_d, k_s and p; or as strands of water with air between them.",
    ),
    p(
        "light.scattering",
        "",
        "",
        Choice(&["single", "multiple"]),
        Uniform,
        "How often light is scattered in the volume: once, or as often as it is.",
    ),
    p(
        "strand.radius",
        "",
        "m",
        Float(1e-5, 1.0, 5e-4),
        Uniform,
        "Radius of a strand of water; the light that goes through it is absorbed on as long a way.",
    )
    .slider(1e-5, 0.1),
    p(
        "strand.roughness_m",
        "β_m",
        "",
        Float(0.1, 1.0, 0.3),
        Uniform,
        "Roughness along the strands: small is a sharp cone of light.",
    ),
    p("strand.roughness_n", "β_n", "", Float(0.1, 1.0, 0.2), Uniform, "Roughness around the strands: small shows the bow."),
    p(
        "strand.absorption",
        "",
        "",
        Float(0.0, 1e4, 1.0),
        Uniform,
        "Absorption in the strands, in units of pure water's.",
    )
    .slider(0.0, 100.0),
    p(
        "strand.aeration",
        "",
        "",
        Float(0.0, 1.0, 0.5),
        Uniform,
        "Share of the light that meets air bubbles instead of strands, in a cell with k_d = k_s; it grows with k_d : k_s.",
    ),
    p(
        "strand.g",
        "g",
        "",
        Float(-0.99, 0.99, 0.8),
        Uniform,
        "Mean cosine of the scattering by bubbles: 0 sends light everywhere alike, towards 1 straight on.",
    ),
    p(
        "light.p",
        "p",
        "",
        Float(1.0, 1e4, 20.0),
        Uniform,
        "Exponent of the specular term; whole numbers up to 255 are fastest.",
    )
    .slider(1.0, 200.0),
    p(
        "light.ambient",
        "",
        "",
        Color([0.1, 0.1, 0.1]),
        Uniform,
        "Light from everywhere, added in every cell.",
    ),
    p("lights.*.kind", "", "", Choice(&["directional", "point", "spot"]), Uniform, "Kind of light."),
    p(
        "lights.*.direction",
        "l",
        "",
        Point([0.5, 0.8, 0.6]),
        Uniform,
        "Towards a directional light, or against the beam of a spot light; of any length but zero.",
    ),
    p("lights.*.position", "", "m", Point([0.0, 10.0, 10.0]), Uniform, "Where a point or spot light is."),
    p(
        "lights.*.angle",
        "",
        "°",
        Float(0.01, 90.0, 30.0),
        Uniform,
        "Half angle of a spot light's cone, from the beam to where the light ends.",
    ),
    p(
        "lights.*.softness",
        "",
        "",
        Float(0.0, 1.0, 0.2),
        Uniform,
        "Outer share of a spot light's angle in which its light fades away.",
    ),
    p("lights.*.color", "", "", Color([1.0, 1.0, 1.0]), Uniform, "Colour of the light."),
    p(
        "lights.*.intensity",
        "I",
        "",
        Float(0.0, 1e9, 1.0),
        Uniform,
        "Factor on the colour; of a point or spot light at a distance of 1 m, falling with its square.",
    )
    .slider(0.0, 100.0),
    p(
        "rocks.*.corners",
        "",
        "m",
        Corners,
        Upload,
        "Corners of the patch that the fractal height field is raised on, counter-clockwise from the outside.",
    ),
    p(
        "rocks.*.levels",
        "",
        "",
        Int(0, super::rock::MAX_LEVELS as i64, 7),
        Upload,
        "Subdivisions: the mesh has 2^levels squares a side.",
    )
    .slider(0.0, 9.0),
    p(
        "rocks.*.h",
        "",
        "",
        Float(0.0, 8.0, 0.9),
        Upload,
        "Roughness of the height field, as h of the curves.",
    )
    .slider(0.0, 2.0),
    p(
        "rocks.*.amplitude",
        "",
        "m",
        Float(0.0, 1e4, 0.5),
        Upload,
        "Standard deviation of the displacement at the first level.",
    )
    .slider(0.0, 5.0),
    p(
        "rocks.*.bulge",
        "",
        "m",
        Float(-1e4, 1e4, 0.0),
        Upload,
        "Height of the patch's middle over its border, before it is made rough.",
    )
    .slider(-5.0, 5.0),
    p("rocks.*.seed", "", "", Int(0, i64::MAX, 1), Upload, "Seed of the rock."),
    p("rocks.*.color", "", "", Color([0.12, 0.11, 0.10]), Upload, "Mean albedo."),
    p(
        "rocks.*.color_noise",
        "",
        "",
        Float(0.0, 1.0, 0.3),
        Upload,
        "Relative fractal variation of the albedo.",
    ),
    p("rocks.*.cavity", "", "", Float(0.0, 1.0, 0.6), Upload, "How much hollows are darker than ridges."),
    p("camera.eye", "", "m", Point([0.0, 0.0, 5.0]), Uniform, "Where the camera is."),
    p("camera.target", "", "m", Point([0.0, 0.0, 0.0]), Uniform, "The point in the middle of the image."),
    p("camera.up", "", "", Point([0.0, 1.0, 0.0]), Uniform, "Direction that is up in the image."),
    p("camera.fov", "", "°", Float(0.01, 170.0, 40.0), Uniform, "Vertical field of view.").slider(5.0, 120.0),
    p(
        "camera.near",
        "",
        "m",
        Float(1e-4, 1e4, 0.01),
        Uniform,
        "Geometry nearer than this, along the view axis, is cut off.",
    )
    .slider(0.001, 10.0),
    p(
        "background.zenith",
        "",
        "",
        Color([0.0, 0.0, 0.0]),
        Uniform,
        "Radiance of the background straight up.",
    ),
    p(
        "background.horizon",
        "",
        "",
        Color([0.0, 0.0, 0.0]),
        Uniform,
        "Radiance of the background at and below the horizon.",
    ),
    p(
        "environment.kind",
        "",
        "",
        Choice(&["none", "sky", "file"]),
        Upload,
        "Light of the surroundings, seen in place of the background: none, the clear sky of [sky], or a map from a file.",
    ),
    p(
        "environment.file",
        "",
        "",
        Text(""),
        Upload,
        "Equirectangular map of linear radiance, .hdr or .exr: the middle is seen looking along −z, +y is up.",
    ),
    p(
        "environment.intensity",
        "",
        "",
        Float(0.0, 1e4, 1.0),
        Uniform,
        "Factor on the light of the environment, its sun included.",
    )
    .slider(0.0, 4.0),
    p(
        "environment.turn",
        "",
        "°",
        Float(-36_000.0, 36_000.0, 0.0),
        Uniform,
        "Turns the environment about the y axis, from +z towards +x.",
    )
    .slider(-180.0, 180.0),
    p(
        "environment.lights",
        "",
        "",
        Int(1, 1024, 24),
        Uniform,
        "Most directional lights that stand for the environment in the water; the time for light walks grows with them.",
    )
    .slider(1.0, 256.0),
    p("sky.elevation", "", "°", Float(0.0, 90.0, 45.0), Upload, "Height of the sun above the horizon."),
    p(
        "sky.azimuth",
        "",
        "°",
        Float(-360.0, 360.0, 30.0),
        Uniform,
        "Direction of the sun, from +z towards +x; environment.turn adds to it.",
    )
    .slider(-180.0, 180.0),
    p("sky.turbidity", "", "", Float(1.0, 10.0, 3.0), Upload, "Haze: 2 is very clear, 3 clear, 6 hazy."),
    p(
        "sky.ground",
        "",
        "",
        Color([0.2, 0.2, 0.2]),
        Upload,
        "Albedo of the ground below the horizon, at most 1 each: it is lit by sky and sun, and lights the sky.",
    ),
    p(
        "sky.sun",
        "",
        "",
        Float(0.0, 1e4, 1.0),
        Upload,
        "Factor on the sun's own light; 0: no sun, as in the shade.",
    )
    .slider(0.0, 4.0),
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
        "image.exposure",
        "",
        "stops",
        Float(-32.0, 32.0, 0.0),
        Uniform,
        "Factor 2^exposure on the radiance, in the PNG only.",
    )
    .slider(-8.0, 8.0),
    p(
        "image.tone",
        "",
        "",
        Choice(&["filmic", "none"]),
        Uniform,
        "Tone curve of the PNG: Narkowicz's fit of ACES, or none.",
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

fn matches(pattern: &str, key: &str) -> bool {
    let mut parts = key.split('.');
    pattern
        .split('.')
        .all(|want| parts.next().is_some_and(|got| if want == "*" { !got.is_empty() } else { want == got }))
        && parts.next().is_none()
}

/// Known key nearest to a misspelt one, with the misspelt key's own names in place of `*`.
pub fn nearest(key: &str) -> Option<String> {
    let parts: Vec<&str> = key.split('.').collect();
    PARAMS
        .iter()
        .map(|param| {
            let named: Vec<&str> = param
                .key
                .split('.')
                .enumerate()
                .map(|(i, want)| if want == "*" { parts.get(i).copied().unwrap_or("NAME") } else { want })
                .collect();
            named.join(".")
        })
        .map(|candidate| {
            // A bare last word (`sigma` for `trace.sigma`) is the commonest slip.
            let last = candidate.rsplit('.').next().unwrap_or("").to_owned();
            let score = strsim::jaro_winkler(key, &candidate).max(strsim::jaro_winkler(key, &last));
            (score, candidate)
        })
        .filter(|(score, _)| *score > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

impl Param {
    const fn slider(self, low: f64, high: f64) -> Self {
        Param { slider: Some((low, high)), ..self }
    }

    /// Whether it holds a list, which only a scene file or `--set` can give.
    pub fn is_list(&self) -> bool {
        matches!(self.kind, Frames | Series)
    }

    /// The entry a concrete key such as `lights.sun.color` belongs to.
    pub fn find(key: &str) -> Option<&'static Param> {
        PARAMS.iter().find(|param| matches(param.key, key))
    }

    /// Range in words, for messages and tables.
    pub fn range(&self) -> String {
        match self.kind {
            Float(min, max, _) => format!("{} to {}", number(min), number(max)),
            Int(min, i64::MAX, _) => format!("{min} to 2^63−1"),
            Int(min, max, _) => format!("{min} to {max}"),
            Choice(words) => words.join(", "),
            Color(_) => format!("three numbers, 0 to {}", number(COLOR_MAX)),
            Point(_) => format!("three numbers, ±{}", number(POINT_MAX)),
            Text(_) => "text".into(),
            Corners => format!("four points of three numbers, ±{}", number(POINT_MAX)),
            Frames => format!(
                "at most {MAX_KEYFRAMES} whole numbers, 0 to {MAX_FRAME}, each larger than the one before"
            ),
            Series => format!("at most {MAX_KEYFRAMES} values of one kind: numbers, triples or corners"),
        }
    }

    /// Default in words.
    pub fn default_words(&self) -> String {
        match self.kind {
            Float(.., d) => number(d),
            Int(.., d) => d.to_string(),
            Choice(words) => words[0].into(),
            Color(c) | Point(c) => format!("[{}, {}, {}]", number(c[0]), number(c[1]), number(c[2])),
            Text("") => "none".into(),
            Text(t) => t.into(),
            Corners => "required".into(),
            Frames | Series => "none".into(),
        }
    }
}

/// A number as people write it.
fn number(x: f64) -> String {
    if x != 0.0 && (x.abs() >= 1e5 || x.abs() < 1e-3) { format!("{x:e}") } else { format!("{x}") }
}

/// The table as Markdown, for the README.
pub fn markdown_table() -> String {
    let mut text = String::from(
        "| key | symbol | unit | default | allowed | a change costs | what |\n|---|---|---|---|---|---|---|\n",
    );
    for param in PARAMS {
        text += &format!(
            "| `{}` | {} | {} | {} | {} | {} | {} |\n",
            param.key,
            param.symbol,
            param.unit,
            param.default_words(),
            param.range(),
            param.cost.word(),
            param.doc
        );
    }
    text
}
