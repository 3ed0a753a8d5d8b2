//! What the water is in: rock, camera and surroundings.

use super::Cost::*;
use super::Kind::*;
use super::{Param, p};

pub(super) const TABLE: &[Param] = &[
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
        Int(0, crate::scene::rock::MAX_LEVELS as i64, 7),
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
    p(
        "rocks.*.ridges",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Upload,
        "How much of the height field is folded into ridges: the share of −|f| of a second field f in it.",
    ),
    p(
        "rocks.*.strata",
        "",
        "",
        Float(0.0, 10.0, 0.0),
        Upload,
        "How far layers of rock, and the blocks they are broken into, step out and back, in heights of a layer.",
    )
    .slider(0.0, 2.0),
    p(
        "rocks.*.strata_height",
        "",
        "m",
        Float(1e-3, 1e4, 0.6),
        Upload,
        "Mean height of a layer; the heights differ.",
    )
    .slider(0.05, 5.0),
    p(
        "rocks.*.strata_tilt",
        "",
        "°",
        Float(-90.0, 90.0, 0.0),
        Upload,
        "Angle of the layers with the horizon, seen from the outside.",
    ),
    p(
        "rocks.*.strata_color",
        "",
        "",
        Float(0.0, 1.0, 0.3),
        Upload,
        "Largest relative difference of a layer's albedo from the mean.",
    ),
    p(
        "rocks.*.border",
        "",
        "m",
        Float(0.0, 1e4, 0.0),
        Upload,
        "Standard deviation of the displacement of points inside the patch at the first level: its sides are no straight lines.",
    )
    .slider(0.0, 3.0),
    p(
        "rocks.*.wet",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Upload,
        "How much of a film of water is on the rock where volume quads are: it is darker (Lekner and Dorf 1988), and shines.",
    ),
    p(
        "rocks.*.wet_reach",
        "",
        "m",
        Float(1e-3, 1e4, 1.0),
        Upload,
        "How far from the quads the rock is dry; downwards four times as far.",
    )
    .slider(0.05, 5.0),
    p(
        "rocks.*.occlusion",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Upload,
        "How much of the light from the surroundings is kept away by the rocks that have this above 0.",
    ),
    p(
        "rocks.*.shadow",
        "",
        "",
        Float(0.0, 1.0, 0.0),
        Upload,
        "How much of the light of the brightest directional light, or of the sun, the rocks that have this above 0 keep away.",
    ),
    p(
        "pools.*.corners",
        "",
        "m",
        Corners,
        Upload,
        "Corners of a level patch of water, counter-clockwise seen from above.",
    ),
    p("pools.*.depth", "", "m", Float(1e-3, 1e4, 1.2), Upload, "Depth of the water, where no rock reaches into it.")
        .slider(0.05, 5.0),
    p(
        "pools.*.color",
        "",
        "",
        Color([0.016, 0.026, 0.02]),
        Upload,
        "Albedo of the water itself where nothing is seen below it, at most 1 each.",
    ),
    p("pools.*.bottom", "", "", Color([0.11, 0.095, 0.07]), Upload, "Albedo of the ground, at most 1 each."),
    p("pools.*.absorption", "", "1/m", Color([1.5, 0.7, 0.9]), Upload, "Absorption of the water."),
    p("pools.*.height", "", "m", Float(0.0, 10.0, 0.008), Upload, "Standard deviation of the surface's height.")
        .slider(0.0, 0.1),
    p("pools.*.wavelength", "", "m", Float(1e-2, 1e4, 1.6), Upload, "Length of the longest waves.")
        .slider(0.05, 10.0),
    p(
        "pools.*.rings",
        "",
        "m",
        Float(0.0, 10.0, 0.02),
        Upload,
        "Amplitude of the rings from where quads that are no mist go through the surface.",
    )
    .slider(0.0, 0.2),
    p(
        "pools.*.period",
        "",
        "s",
        Float(0.01, 1e4, 2.0),
        Upload,
        "Time in which volume.flow grows by 1: every wave goes through whole turns in it.",
    )
    .slider(0.1, 10.0),
    p("pools.*.foam", "", "", Float(0.0, 1.0, 0.9), Upload, "How dense the foam is where water falls in."),
    p("pools.*.foam_reach", "", "m", Float(1e-3, 1e4, 2.0), Upload, "How far from there it reaches.").slider(0.1, 10.0),
    p("pools.*.seed", "", "", Int(0, i64::MAX, 1), Upload, "Seed of the waves."),
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
        "haze.density",
        "β₀",
        "1/m",
        Float(0.0, 1000.0, 0.0),
        Uniform,
        "Extinction of the haze between the eye and rock and water; 0: there is none.",
    )
    .slider(0.0, 0.2),
    p("haze.color", "", "", Color([0.6, 0.68, 0.75]), Uniform, "Radiance of endless haze."),
    p(
        "haze.scale_height",
        "H",
        "m",
        Float(0.0, 1e5, 0.0),
        Uniform,
        "The haze thins upwards by e in so many metres; 0: it is the same at every height.",
    )
    .slider(0.0, 20.0),
    p(
        "haze.level",
        "y₀",
        "m",
        Float(-1e7, 1e7, 0.0),
        Uniform,
        "Height at which haze that thins has its density.",
    )
    .slider(-20.0, 20.0),
    p(
        "haze.far",
        "",
        "m",
        Float(0.0, 1e7, 0.0),
        Uniform,
        "Metres of haze before the background or environment; 0: it is seen as it is.",
    )
    .slider(0.0, 200.0),
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
];
