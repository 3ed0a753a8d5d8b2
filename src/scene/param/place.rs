//! Rock, pools, camera and surroundings.

use super::Cost::*;
use super::Kind::*;
use super::{Group, p};
use crate::place::{PoolWaves, Show, StoneKind};
use crate::scene::build::EnvironmentKind;

pub(super) const ROCKS: Group = Group {
    title: "Rocks",
    about: "A rock is a fractal height field, raised on a patch of four corners by midpoint displacement. \
         Ridges, layers, ragged sides, wetness and shade are off unless a scene sets them.",
    params: &[
        p("rocks.*.corners", "", "m", Corners, Upload)
            .doc(
                "Corners of the patch that the height field is raised on, counter-clockwise seen from the \
                 outside.",
            )
            .when("Let patches overlap at their borders, so that no gap shows between two rocks."),
        p("rocks.*.show", "", "", Choice(Show::WORDS), Upload)
            .doc(
                "What the picture shows of the rock. With `image.alpha`, a `holdout` is a hole in the shape \
                 of the rock: it hides what is behind it, and its alpha is 0. Without `image.alpha` it is \
                 seen. `hidden` leaves the rock out of the scene, with its shade and its mirror image.",
            )
            .when(
                "Choose `holdout` for a stand-in of the rock in a photograph that the water is put over, \
                 `hidden` to look at the rest alone.",
            ),
        p("rocks.*.kind", "", "", Choice(StoneKind::WORDS), Upload)
            .doc(
                "Kind of stone: `plain`, or `granite`, `basalt`, `limestone` or `slate` with grain, cracks, \
                 streaks and lichen finer than the mesh, an albedo, and beds of very uneven height.",
            )
            .when(
                "Choose `granite` for massive pale rock, `basalt` for dark broken rock, `limestone` for \
                 pale beds, `slate` for thin dark ones; leave `plain` for earth and far hills.",
            ),
        p("rocks.*.grain", "", "", Float(0.0, 4.0, 1.0), Upload)
            .slider(0.0, 2.0)
            .doc("Strength of the grain, cracks and streaks of a `kind`.")
            .when("Lower it for worn, polished rock; raise it for rock that is broken or seen from afar."),
        p("rocks.*.moss", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc(
                "Amount of moss on a `kind` of stone: at 0.5 it covers level rock and little of what is \
                 steep, at 1 nearly all.",
            )
            .when("Raise it for shade and spray; leave it at 0 for dry or new rock."),
        p("rocks.*.levels", "", "", Int(0, crate::place::MAX_LEVELS as i64, 7), Upload)
            .slider(0.0, 9.0)
            .doc("Number of subdivisions: the mesh has 2^levels squares a side.")
            .when("Raise it for fine detail near the camera; lower it for small or distant rocks."),
        p("rocks.*.h", "", "", Float(0.0, 8.0, 0.9), Upload)
            .slider(0.0, 2.0)
            .doc("Roughness of the height field, as `curves.h`: small values are rough, large ones smooth.")
            .when("Lower it for jagged rock; raise it for rounded, worn stone."),
        p("rocks.*.amplitude", "", "m", Float(0.0, 1e4, 0.5), Upload)
            .slider(0.0, 5.0)
            .doc("Standard deviation of the displacement at the first level.")
            .when("Raise it for deep relief; lower it in proportion for a small patch."),
        p("rocks.*.bulge", "", "m", Float(-1e4, 1e4, 0.0), Upload)
            .slider(-5.0, 5.0)
            .doc("Height of the patch's middle above its border, before it is made rough.")
            .when("Raise it for boulders; lower it below 0 for a hollow, as behind a fall."),
        p("rocks.*.seed", "", "", Int(0, i64::MAX, 1), Upload)
            .doc("Seed of the rock's randomness.")
            .when("Change it for another rock of the same kind, or when two rocks look alike."),
        p("rocks.*.color", "", "", Color([0.12, 0.11, 0.10]), Upload)
            .doc(
                "Mean albedo of the dry rock, linear RGB. If a rock has a `kind` and no `color`, the kind's \
                 albedo holds.",
            )
            .when("Lower it when the rock is as bright as the water; raise green against red for moss."),
        p("rocks.*.color_noise", "", "", Float(0.0, 1.0, 0.3), Upload)
            .doc("Relative fractal variation of the albedo.")
            .when("Raise it for stained or mossy rock; lower it for even stone."),
        p("rocks.*.cavity", "", "", Float(0.0, 1.0, 0.6), Upload)
            .doc("Share of the albedo that the deepest hollows lose.")
            .when("Raise it when relief looks flat; lower it when hollows are too black."),
        p("rocks.*.ridges", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc(
                "Share of the height field that is folded into ridges. A ridge lies where a second \
                 fractal field passes 0, because its absolute value has a sharp bend there.",
            )
            .when("Raise it for sharp crests; lower it for rounded rock."),
        p("rocks.*.strata", "", "", Float(0.0, 10.0, 0.0), Upload)
            .slider(0.0, 2.0)
            .doc(
                "Distance by which layers of rock, and the blocks they are broken into, step out and \
                 back, in heights of a layer. 0 leaves layers out.",
            )
            .when(
                "Raise it to about 0.5 for cliffs, to about 0.2 for boulders; leave it at 0 for rock \
                 without layers.",
            ),
        p("rocks.*.strata_height", "", "m", Float(1e-3, 1e4, 0.6), Upload)
            .slider(0.05, 5.0)
            .doc("Mean height of a layer. Single layers differ from it.")
            .when("Raise it for massive blocks; lower it for thin beds and for small rocks."),
        p("rocks.*.strata_tilt", "", "°", Float(-90.0, 90.0, 0.0), Upload)
            .doc("Angle of the layers with the horizon, seen from the outside.")
            .when("Set a few degrees, different for each rock, when the layers look built."),
        p("rocks.*.strata_color", "", "", Float(0.0, 1.0, 0.3), Upload)
            .doc("Largest relative difference of a layer's albedo from the mean.")
            .when("Raise it to tell layers apart by colour; lower it for one kind of stone."),
        p("rocks.*.round", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc("Share by which the outline of the patch is rounded to an ellipse.")
            .when("Raise it to 0.8 for boulders, whose patches would show their corners."),
        p("rocks.*.border", "", "m", Float(0.0, 1e4, 0.0), Upload)
            .slider(0.0, 3.0)
            .doc("Standard deviation of the displacement of points within the patch, at the first level.")
            .when("Raise it when a rock shows the straight sides of its patch."),
        p("rocks.*.wet", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc(
                "Strength of the film of water on the rock near quads that are not mist, below them, and \
                 at pools. Wet rock is darker and shines.",
            )
            .when("Raise it to 1 for rock that water runs over or splashes; leave it at 0 for dry rock."),
        p("rocks.*.wet_reach", "", "m", Float(1e-3, 1e4, 1.0), Upload)
            .slider(0.05, 5.0)
            .doc(
                "Distance from falling water at which the rock is dry. Below the water it is four times \
                 as far.",
            )
            .when("Raise it for a broad wet margin; lower it in small scenes."),
        p("rocks.*.occlusion", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc(
                "Share of the surroundings' light that this rock loses where other rock hides them. Only \
                 rocks with a value above 0 hide them.",
            )
            .when("Raise it when clefts and the ground between rocks look too bright in the shade."),
        p("rocks.*.shadow", "", "", Float(0.0, 1.0, 0.0), Upload)
            .doc(
                "Share of the light of the brightest directional light, the sky's sun included, that this \
                 rock loses in the shadow of rock. Only rocks with a value above 0 cast it.",
            )
            .when(
                "Raise it when rock should cast shadows on rock; leave it at 0 for far hills, which would \
                 make all shadows coarser.",
            ),
    ],
};

pub(super) const POOLS: Group = Group {
    title: "Pools",
    about: "A pool is a level patch of water with waves and foam. It mirrors the sky and a coarse picture of \
         the rocks and falls around it, and the ground shows through. A scene has at most 8 pools.",
    params: &[
        p("pools.*.corners", "", "m", Corners, Upload)
            .doc("Corners of the patch, all at one height, counter-clockwise seen from above.")
            .when("Put the borders inside rock or outside the picture, so that no edge of water shows."),
        p("pools.*.show", "", "", Choice(Show::WORDS), Upload)
            .doc(
                "What the picture shows of the pool: `visible`, `holdout` or `hidden`, as for \
                 `rocks.*.show`.",
            )
            .when("Choose `holdout` where the photograph behind the water has a pool of its own."),
        p("pools.*.depth", "", "m", Float(1e-3, 1e4, 1.2), Upload)
            .slider(0.05, 5.0)
            .doc("Depth of the water where no rock rises from the ground.")
            .when("Lower it for a basin whose ground shows; raise it for a dark plunge pool."),
        p("pools.*.color", "", "", Color([0.016, 0.026, 0.02]), Upload)
            .doc("Albedo of the water itself where nothing is seen below it, at most 1 in each component.")
            .when("Raise it for milky water; lower it for clear, dark water."),
        p("pools.*.bottom", "", "", Color([0.11, 0.095, 0.07]), Upload)
            .doc("Albedo of the ground, at most 1 in each component.")
            .when("Raise it for sand; lower it for dark stone."),
        p("pools.*.absorption", "", "1/m", Color([1.5, 0.7, 0.9]), Upload)
            .doc("Absorption of the water, linear RGB.")
            .when(
                "Raise it to hide the ground; raise red against the others for bluer and greener \
                 shallows.",
            ),
        p("pools.*.waves", "", "", Choice(PoolWaves::WORDS), Upload)
            .doc(
                "How waves and foam are made. `sum`: straight waves and rings, and a disc of foam where \
                 water falls in. `field`: waves that rocks mirror and bend, and foam that a current \
                 carries, on a grid of at most 512×512 cells.",
            )
            .when("Choose `field` where rocks stand in the water or the pool is seen from near."),
        p("pools.*.height", "", "m", Float(0.0, 10.0, 0.008), Upload)
            .slider(0.0, 0.1)
            .doc("Standard deviation of the surface's height.")
            .when("Raise it for choppy water; lower it for a mirror."),
        p("pools.*.wavelength", "", "m", Float(1e-2, 1e4, 1.6), Upload)
            .slider(0.05, 10.0)
            .doc("Length of the longest waves. The shortest are about a tenth as long.")
            .when("Raise it for wide water; lower it for small basins."),
        p("pools.*.rings", "", "m", Float(0.0, 10.0, 0.02), Upload)
            .slider(0.0, 0.2)
            .doc(
                "Amplitude of the rings that run out from where quads that are not mist go through the \
                 surface.",
            )
            .when("Raise it for heavy water that falls into a calm pool; lower it for thin threads."),
        p("pools.*.period", "", "s", Float(0.01, 1e4, 2.0), Upload)
            .slider(0.1, 10.0)
            .doc(
                "Time in which `volume.flow` grows by 1. Every wave makes a whole number of turns in that \
                 time, so that loops close.",
            )
            .when("Set it to 1 divided by `animate.speed`; then the waves run at their natural speed."),
        p("pools.*.foam", "", "", Float(0.0, 1.0, 0.9), Upload)
            .doc("Density of the foam where water falls in. Along the shore there is less.")
            .when("Raise it for a white plunge pool; lower it for quiet water."),
        p("pools.*.foam_reach", "", "m", Float(1e-3, 1e4, 2.0), Upload)
            .slider(0.1, 10.0)
            .doc(
                "Distance from the falling water at which the foam ends; with `waves=field` the length over \
                 which the current slows down.",
            )
            .when("Raise it for a high fall that churns the whole pool; lower it for a thin jet."),
        p("pools.*.foam_life", "", "s", Float(0.01, 1e4, 4.0), Upload)
            .slider(0.5, 20.0)
            .doc("Time in which foam falls to 1/e on its way, with `waves=field`.")
            .when("Raise it for foam that drifts far; lower it for foam that stays where water falls in."),
        p("pools.*.current", "", "m/s", Float(0.0, 100.0, 0.7), Upload)
            .slider(0.0, 3.0)
            .doc("Speed at which falling water pushes the surface away, with `waves=field`.")
            .when("Raise it for heavy water; lower it for thin jets."),
        p("pools.*.drift", "", "m/s", Float(0.0, 100.0, 0.1), Upload)
            .slider(0.0, 1.0)
            .doc(
                "Speed of the whole surface, with `waves=field`: from the falling water through the middle \
                 of the pool.",
            )
            .when("Raise it for a pool that a stream leaves; lower it for a basin without an outlet."),
        p("pools.*.seed", "", "", Int(0, i64::MAX, 1), Upload)
            .doc("Seed of the waves' randomness.")
            .when("Change it for other waves of the same kind."),
    ],
};

pub(super) const CAMERA: Group = Group {
    title: "Camera",
    about: "The camera is a pinhole, or a lens, at `camera.eye` that looks at `camera.target`. In the viewer \
         the mouse moves it.",
    params: &[
        p("camera.from", "", "", Text(""), Uniform)
            .doc(
                "Name of a mesh whose camera is taken, such as `cliff`, or `cliff/Camera` for one of \
                 several: its place, direction and field of view. `taki batch` moves it as the file does.",
            )
            .when("Set it to see a scene as the other program shows it."),
        p("camera.eye", "", "m", Point([0.0, 0.0, 5.0]), Uniform)
            .doc("Position of the camera.")
            .when("Move it low and near to make a fall look high; move it away to show where the water is."),
        p("camera.target", "", "m", Point([0.0, 0.0, 0.0]), Uniform)
            .doc("Point that lies in the middle of the image.")
            .when("Move it to choose what the picture is centred on."),
        p("camera.up", "", "", Point([0.0, 1.0, 0.0]), Uniform)
            .doc("Direction that is up in the image.")
            .when("Tilt it for a slanted picture, or when the view is straight up or down."),
        p("camera.fov", "", "°", Float(1e-5, 170.0, 40.0), Uniform)
            .slider(5.0, 120.0)
            .doc("Vertical field of view.")
            .when("Lower it to magnify what is far away; raise it to show more from nearby."),
        p("camera.near", "", "m", Float(1e-4, 1e4, 0.01), Uniform)
            .slider(0.001, 10.0)
            .doc("Distance along the view axis within which geometry is cut off.")
            .when(
                "Raise it to look through something close to the camera; lower it when a near thing is \
                 cut open.",
            ),
        p("camera.f_number", "N", "", Float(0.0, 128.0, 0.0), Uniform)
            .slider(0.0, 22.0)
            .doc(
                "F-number of the lens, behind which lies a sensor 24 mm high, as that of a 35 mm camera: \
                 things in front of and behind the plane in focus become blurred. 0 is a pinhole, through \
                 which all is sharp. Each sample sees the scene from one point of the lens.",
            )
            .when(
                "Set it to 2.8 or less to part a near fall from what is behind it; give the picture 64 \
                 samples or more.",
            ),
        p("camera.focus", "", "m", Float(0.0, 1e6, 0.0), Uniform)
            .slider(0.0, 50.0)
            .doc(
                "Distance of the plane in focus along the view axis. 0 is the distance of `camera.target`; a \
                 camera of a file (`camera.from`) has its target at 10 m.",
            )
            .when("Set it to the distance of the thing that should be sharp."),
        p("camera.shutter", "", "s", Float(0.0, 60.0, 0.0), Uniform)
            .slider(0.0, 1.0)
            .doc(
                "Time for which the shutter is open, half of it before the frame's time and half after. The \
                 volume `water` moves meanwhile with `animate.speed`, and the waves of pools with it; \
                 cameras, other volumes and other parameters stay where they are at the frame's time.",
            )
            .when(
                "Set it to 0.017 for the crisp water of a snapshot, 0.125 to 1 for silk; give the picture 16 \
                 samples or more.",
            ),
    ],
};

pub(super) const BACKGROUND_AND_HAZE: Group = Group {
    title: "Background and haze",
    about: "The background runs from the horizon to the zenith. It is seen where nothing else is and \
            mirrored by wet rock and pools; an environment takes its place. Haze dims what is far away and \
            shines in a colour of its own.",
    params: &[
        p("background.zenith", "", "", Color([0.0, 0.0, 0.0]), Uniform)
            .doc("Radiance of the background straight up.")
            .when("Choose a deep blue for a clear day, and nearly black for night."),
        p("background.horizon", "", "", Color([0.0, 0.0, 0.0]), Uniform)
            .doc("Radiance of the background at and below the horizon.")
            .when("Raise it above the zenith's for daylight; lower it for night."),
        p("haze.density", "β₀", "1/m", Float(0.0, 1000.0, 0.0), Uniform)
            .slider(0.0, 0.2)
            .doc("Extinction of the haze in front of rock and water. 0 means no haze.")
            .when("Raise it when near and far look equally clear; begin with 0.01 in scenes of some 20 m."),
        p("haze.color", "", "", Color([0.6, 0.68, 0.75]), Uniform).doc("Radiance of endless haze.").when(
            "Bring it near `background.horizon`, so that far rock melts into the sky; darken it for \
             night.",
        ),
        p("haze.scale_height", "H", "m", Float(0.0, 1e5, 0.0), Uniform)
            .slider(0.0, 20.0)
            .doc(
                "Height over which the haze thins upwards by a factor of e. 0 keeps it the same at every \
                 height.",
            )
            .when("Set it to a metre or two for mist that lies on a pool; leave it at 0 for air."),
        p("haze.level", "y₀", "m", Float(-1e7, 1e7, 0.0), Uniform)
            .slider(-20.0, 20.0)
            .doc("Height at which haze that thins upwards has the density `haze.density`.")
            .when("Set it to the height of the pool that the mist lies on."),
        p("haze.far", "", "m", Float(0.0, 1e7, 0.0), Uniform)
            .slider(0.0, 200.0)
            .doc("Metres of haze in front of the background or the environment. 0 leaves them clear.")
            .when("Raise it when far rock is hazy and the sky behind it is not."),
    ],
};

pub(super) const ENVIRONMENT_AND_SKY: Group = Group {
    title: "Environment and sky",
    about: "An environment is light from all directions, of a clear sky or of a map from a file. It lights \
         rock and water and replaces the background. With an environment, set the scene's own sun and \
         `light.ambient` to 0, unless you want both.",
    params: &[
        p("environment.kind", "", "", Choice(EnvironmentKind::WORDS), Upload)
            .doc(
                "Source of the environment: `none`, the clear `sky` of the parameters below, or a map \
                 from a `file`.",
            )
            .when("Choose `sky` for daylight at any hour, `file` for the light of a real place."),
        p("environment.file", "", "", Text(""), Upload)
            .doc(
                "Path of an equirectangular map of linear radiance, .hdr or .exr. Its middle is seen \
                 looking along −z, and +y is up.",
            )
            .when("Set it together with `environment.kind=file`."),
        p("environment.intensity", "", "", Float(0.0, 1e4, 1.0), Uniform)
            .slider(0.0, 4.0)
            .doc("Factor on the light of the environment, its sun included.")
            .when(
                "Change it when the environment is too bright or too dark beside the scene's own lights; \
                 for the whole picture change `image.exposure`.",
            ),
        p("environment.turn", "", "°", Float(-36_000.0, 36_000.0, 0.0), Uniform)
            .slider(-180.0, 180.0)
            .doc("Turn of the environment about the y axis, from +z towards +x.")
            .when("Turn it to bring the brightest part of a map to the side that it should light."),
        p("environment.lights", "", "", Int(1, 1024, 24), Uniform)
            .slider(1.0, 256.0)
            .doc("Largest number of directional lights that represent the environment in the water.")
            .when("Raise it when the light in the water looks coarse; lower it to render faster."),
        p("sky.elevation", "", "°", Float(0.0, 90.0, 45.0), Upload)
            .doc("Height of the sun above the horizon.")
            .when("Lower it for the red light of evening; raise it for noon."),
        p("sky.azimuth", "", "°", Float(-360.0, 360.0, 30.0), Uniform)
            .slider(-180.0, 180.0)
            .doc("Direction of the sun, from +z towards +x. `environment.turn` adds to it.")
            .when(
                "Set it to about 180 for a sun behind a fall that faces +z, to about 90 for a sun at its \
                 side.",
            ),
        p("sky.turbidity", "", "", Float(1.0, 10.0, 3.0), Upload)
            .doc("Haziness of the air: 2 is very clear, 3 is clear, 6 is hazy.")
            .when("Raise it for a milky sky and a weaker sun; lower it for a deep blue one."),
        p("sky.ground", "", "", Color([0.2, 0.2, 0.2]), Upload)
            .doc(
                "Albedo of the ground below the horizon, at most 1 in each component. Sun and sky light \
                 it, and it lights the sky.",
            )
            .when("Raise it for snow or sand, which light the scene from below; lower it for woods."),
        p("sky.sun", "", "", Float(0.0, 1e4, 1.0), Upload)
            .slider(0.0, 4.0)
            .doc("Factor on the sun's own light. 0 takes the sun away, as in the shade.")
            .when("Lower it when shadows are too hard; set 0 for the light of the sky alone."),
    ],
};
